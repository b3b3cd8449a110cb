//! Drawing into one tile: skin triangles with eight depth samples a pixel, then hairs as filtered lines, near to far.

use crate::V3;

/// Side of a tile, pixels. A tile's pixels (96 bytes each) should stay in the second-level cache: at 64, 384 KB. Much
/// smaller tiles repeat lines that cross their borders.
pub(crate) const TILE: usize = 64;

/// No triangle, no strand.
const NOBODY: u32 = u32::MAX;

/// Depth samples of a pixel. Four leave steps on the outline of skin before a plain background.
const SAMPLES: usize = 8;

/// Where they lie, pixels: all of their rows and columns are distinct, so that steep and flat outlines get all shades.
const SAMPLE: [[f64; 2]; SAMPLES] = [
    [0.5625, 0.3125],
    [0.4375, 0.6875],
    [0.8125, 0.5625],
    [0.3125, 0.1875],
    [0.1875, 0.8125],
    [0.0625, 0.4375],
    [0.6875, 0.9375],
    [0.9375, 0.0625],
];

/// Part of a pixel that a sample stands for.
const SHARE: f32 = 1.0 / SAMPLES as f32;

/// Standard deviation of the pixel filter. A Gaussian of 0.52 pixels leaves ripples of 1 % at most in the coverage of a
/// thin line; 0.45 leaves 4 %, which shows as beads and moire, 0.7 is visibly soft.
const SIGMA: f32 = 0.52;

/// Where the filter ends, pixels: a whole number of table steps.
pub(crate) const REACH: f32 = 1.5;

/// Steps of the table per pixel.
const STEPS: usize = 128;

/// A pixel through which less light than this comes takes no more hairs: what is so deep is dark, so the error is
/// under half a step of 8 bits. At 1/50 dense hair gets holes to the background.
const OPAQUE: f32 = 1.0 / 400.0;

/// How far behind the skin's depth sample a hair may be and still show, pixels at its depth. Roots lie in the skin and
/// the sample of a sloping skin is up to a pixel beside the hair: under 1, roots flicker; over 4, hair shines through
/// ears and lips.
const BIAS: f32 = 1.5;

/// A sample this little outside a triangle, in barycentric coordinates, counts as inside: no cracks from rounding.
const EDGE: f64 = -1e-9;

/// Integral of the pixel filter: a Gaussian cut at [`REACH`] and scaled to an area of exactly 1, isotropic, so that the
/// coverage of a line does not depend on its angle or its place between pixels.
#[derive(Clone, Debug)]
pub(crate) struct Filter {
    table: Vec<f32>,
}

impl Filter {
    pub fn new() -> Filter {
        let half = (REACH * STEPS as f32) as i32;
        let at = |i: i32| libm::erf(f64::from(i) / STEPS as f64 / f64::from(SIGMA) * std::f64::consts::FRAC_1_SQRT_2);
        let full = at(half);
        Filter { table: (-half..=half + 1).map(|i| (0.5 + 0.5 * at(i.min(half)) / full) as f32).collect() }
    }

    /// Integral from minus infinity to `x` pixels.
    #[inline]
    fn upto(&self, x: f32) -> f32 {
        let x = (x.clamp(-REACH, REACH) + REACH) * STEPS as f32;
        let i = x as i32 as usize;
        let (a, b) = (self.table[i], self.table[i + 1]);
        a + (b - a) * (x - i as f32)
    }
}

/// A point of a hair in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Point {
    /// Pixels.
    pub x: f32,
    /// Pixels.
    pub y: f32,
    /// Depth, scene units.
    pub z: f32,
    /// Diameter, pixels.
    pub width: f32,
    /// Shaded colour, linear.
    pub rgb: [f32; 3],
    /// Number of the strand over all layers.
    pub strand: u32,
}

/// State of one pixel.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Pixel {
    /// Colour of the hairs so far, linear, weighted by what is seen of them.
    rgb: [f32; 3],
    /// Strand drawn last, and how much of the pixel it covers by now.
    strand: u32,
    covered: f32,
    /// Per sample: part of the light from behind that comes through the hairs so far.
    through: [f32; SAMPLES],
}

/// A triangle of the skin in the picture: corners as (x pixels, y pixels, depth).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    pub corner: [[f64; 3]; 3],
    /// Its number in the mesh.
    pub triangle: u32,
}

/// One tile of the picture.
pub(crate) struct Tile {
    x0: usize,
    y0: usize,
    width: usize,
    height: usize,
    pixel: Vec<Pixel>,
    /// Per pixel and sample: depth of the skin, scene units.
    depth: Vec<[f32; SAMPLES]>,
    /// Per row a bit for each pixel through which more can be seen.
    open: [u64; TILE],
    /// Number of those bits.
    left: usize,
    /// Triangle seen at each sample; empty as long as there is none.
    triangle: Vec<[u32; SAMPLES]>,
}

impl Tile {
    /// An empty tile: its pixel (0, 0) is (x0, y0) of the picture.
    pub fn new(x0: usize, y0: usize, width: usize, height: usize) -> Tile {
        let pixel = Pixel { rgb: [0.0; 3], strand: NOBODY, covered: 0.0, through: [1.0; SAMPLES] };
        Tile {
            x0,
            y0,
            width,
            height,
            pixel: vec![pixel; width * height],
            depth: vec![[f32::INFINITY; SAMPLES]; width * height],
            open: [ones(width); TILE],
            left: width * height,
            triangle: Vec::new(),
        }
    }

    /// True if nothing behind what is drawn can be seen.
    pub fn full(&self) -> bool {
        self.left == 0
    }

    /// Draws a triangle into the depth samples. `inverse` if depth is linear as 1 / z over the picture (perspective).
    pub fn facet(&mut self, facet: &Facet, inverse: bool) {
        let c = facet.corner;
        let area = cross(c[0], c[1], [c[2][0], c[2][1]]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let span = |i: usize, origin: usize, size: usize| {
            let lo = c[0][i].min(c[1][i]).min(c[2][i]) - origin as f64 - 1.0;
            let hi = c[0][i].max(c[1][i]).max(c[2][i]) - origin as f64 + 1.0;
            lo.max(0.0) as usize..(hi.min(size as f64).max(0.0) as usize).max(lo.max(0.0) as usize)
        };
        let key = c.map(|p| if inverse { 1.0 / p[2] } else { p[2] });
        for j in span(1, self.y0, self.height) {
            for i in span(0, self.x0, self.width) {
                for (s, offset) in SAMPLE.iter().enumerate() {
                    let p = [(self.x0 + i) as f64 + offset[0], (self.y0 + j) as f64 + offset[1]];
                    let w = [cross(c[1], c[2], p) / area, cross(c[2], c[0], p) / area, cross(c[0], c[1], p) / area];
                    if w[0] < EDGE || w[1] < EDGE || w[2] < EDGE {
                        continue;
                    }
                    let z = w[0] * key[0] + w[1] * key[1] + w[2] * key[2];
                    let z = (if inverse { 1.0 / z } else { z }) as f32;
                    let k = j * self.width + i;
                    if z < self.depth[k][s] {
                        if self.triangle.is_empty() {
                            self.triangle = vec![[NOBODY; SAMPLES]; self.width * self.height];
                        }
                        self.depth[k][s] = z;
                        self.triangle[k][s] = facet.triangle;
                    }
                }
            }
        }
    }

    /// Blends the piece of a hair from `a` to `b` behind what is there already. `opacity` is that of its whole width,
    /// `pixel_size` scene units per pixel at its depth. The coverage of a pixel is the filtered area of a rectangle of
    /// the true width: a hair of a tenth of a pixel covers a tenth.
    pub fn line(&mut self, a: &Point, b: &Point, opacity: f32, pixel_size: f32, filter: &Filter) {
        let (ax, ay) = (a.x - self.x0 as f32, a.y - self.y0 as f32);
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let length = (dx * dx + dy * dy).sqrt();
        let (ux, uy) = if length > 1e-6 { (dx / length, dy / length) } else { (1.0, 0.0) };
        let side = REACH + 0.5 * a.width.max(b.width);
        let per = if length > 1e-6 { 1.0 / length } else { 0.0 };
        let half = [0.5 * a.width, 0.5 * (b.width - a.width)];
        let bias = BIAS * pixel_size;
        let tall = uy.abs() * REACH + ux.abs() * side;
        let Some((top, bottom)) = centres(ay.min(ay + dy) - tall, ay.max(ay + dy) + tall, self.height) else { return };
        for j in top..=bottom {
            if self.open[j] == 0 {
                continue;
            }
            let ry = j as f32 + 0.5 - ay;
            // Across: |ux ry - uy rx| <= side. Along: -REACH <= ux rx + uy ry <= length + REACH.
            let (mut lo, mut hi) = (-ax, self.width as f32 - ax);
            if uy.abs() > 1e-6 {
                let (m, r) = (ux * ry / uy, side / uy.abs());
                (lo, hi) = (lo.max(m - r), hi.min(m + r));
            }
            if ux.abs() > 1e-6 {
                let (s, e) = ((-REACH - uy * ry) / ux, (length + REACH - uy * ry) / ux);
                (lo, hi) = (lo.max(s.min(e)), hi.min(s.max(e)));
            }
            let Some((first, last)) = centres(lo + ax, hi + ax, self.width) else { continue };
            let mut todo = self.open[j] & ones(last + 1) & !ones(first);
            while todo != 0 {
                let i = todo.trailing_zeros() as usize;
                todo &= todo - 1;
                let rx = i as f32 + 0.5 - ax;
                let (across, along) = (ux * ry - uy * rx, ux * rx + uy * ry);
                let f = (along * per).clamp(0.0, 1.0);
                let h = half[0] + half[1] * f;
                let mut cover = filter.upto(across + h) - filter.upto(across - h);
                if along < REACH || along > length - REACH {
                    cover *= filter.upto(along) - filter.upto(along - length);
                }
                let rgb = std::array::from_fn(|c| a.rgb[c] + (b.rgb[c] - a.rgb[c]) * f);
                let k = j * self.width + i;
                let z = a.z + (b.z - a.z) * f - bias;
                if self.pixel[k].blend(rgb, cover * opacity, z, &self.depth[k], a.strand) < OPAQUE {
                    self.open[j] &= !(1 << i);
                    self.left -= 1;
                }
            }
        }
    }

    /// The finished colours, row by row. `skin` gives the colour of a triangle at a pixel position and depth.
    pub fn resolve(&self, background: [f32; 3], skin: impl Fn(u32, [f64; 2], f32) -> V3) -> Vec<[f32; 3]> {
        let finish = |(k, p): (usize, &Pixel)| {
            let seen = self.triangle.get(k).copied().unwrap_or([NOBODY; SAMPLES]);
            if seen == [NOBODY; SAMPLES] && p.through == [1.0; SAMPLES] {
                return background;
            }
            let mut rgb = V3::from(p.rgb);
            // The last triangle and its colour: samples of one triangle share one.
            let mut known = (NOBODY, V3::from(background));
            for ((&triangle, &through), (&depth, at)) in
                seen.iter().zip(&p.through).zip(self.depth[k].iter().zip(&SAMPLE))
            {
                if triangle == NOBODY {
                    rgb += V3::from(background) * (SHARE * through);
                } else if through >= OPAQUE {
                    if known.0 != triangle {
                        let (x, y) = (self.x0 + k % self.width, self.y0 + k / self.width);
                        known = (triangle, skin(triangle, [x as f64 + at[0], y as f64 + at[1]], depth));
                    }
                    rgb += known.1 * (SHARE * through);
                }
            }
            rgb.into()
        };
        self.pixel.iter().enumerate().map(finish).collect()
    }
}

impl Pixel {
    /// Puts a coverage of colour behind what is there, at the samples whose skin is not nearer than `z`. Coverages of one
    /// strand add up, where those of different strands multiply what is left: pieces of a hair lie side by side, so
    /// a hair looks the same however many pieces it has. Returns what comes through at most.
    #[inline]
    fn blend(&mut self, rgb: [f32; 3], alpha: f32, z: f32, depth: &[f32; SAMPLES], strand: u32) -> f32 {
        if self.strand != strand {
            (self.strand, self.covered) = (strand, 0.0);
        }
        let rest = 1.0 - self.covered;
        let part = if rest > 1e-4 { (alpha / rest).min(1.0) } else { 0.0 };
        let open = depth.map(|d| if z <= d { 1.0f32 } else { 0.0 });
        let taken: [f32; SAMPLES] = std::array::from_fn(|s| self.through[s] * part * open[s]);
        let left: [f32; SAMPLES] = std::array::from_fn(|s| self.through[s] - taken[s]);
        self.through = left;
        self.covered += SHARE * alpha * sum(&open);
        let seen = SHARE * sum(&taken);
        for (sum, c) in self.rgb.iter_mut().zip(rgb) {
            *sum += seen * c;
        }
        let half: [f32; SAMPLES / 2] = std::array::from_fn(|s| left[s].max(left[s + SAMPLES / 2]));
        (half[0].max(half[2])).max(half[1].max(half[3]))
    }
}

/// Sum of all samples, in an order that four lanes can follow.
#[inline]
fn sum(v: &[f32; SAMPLES]) -> f32 {
    let half: [f32; SAMPLES / 2] = std::array::from_fn(|s| v[s] + v[s + SAMPLES / 2]);
    (half[0] + half[2]) + (half[1] + half[3])
}

/// The lowest `n` bits.
fn ones(n: usize) -> u64 {
    if n >= 64 { u64::MAX } else { (1 << n) - 1 }
}

/// First and last of `size` pixels whose centres lie in [low, high].
#[inline]
fn centres(low: f32, high: f32, size: usize) -> Option<(usize, usize)> {
    let (low, high) = ((low - 0.5).max(0.0), high - 0.5);
    if !(high >= low && low < size as f32) {
        return None;
    }
    let first = low as usize;
    let first = if (first as f32) < low { first + 1 } else { first };
    let last = (high as usize).min(size - 1);
    (first <= last).then_some((first, last))
}

/// Twice the area of the triangle a, b, p.
fn cross(a: [f64; 3], b: [f64; 3], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}
