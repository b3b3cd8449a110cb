//! One tile of the picture: skin triangles with eight depth samples a pixel, behind the hairs that `stroke` draws.

mod stroke;

pub(crate) use stroke::{Filter, Piece, REACH, Strokes};

use crate::V3;

/// Side of a tile, pixels. What lines touch of a tile (32 bytes a pixel, 128 KB) should stay in the second-level
/// cache. Much smaller tiles repeat lines that cross their borders.
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

/// A pixel through which less light than this comes takes no more hairs: what is so deep is dark, so the error is
/// under half a step of 8 bits. At 1/50 dense hair gets holes to the background.
const OPAQUE: f32 = 1.0 / 400.0;

/// A sample this little outside a triangle, in barycentric coordinates, counts as inside: no cracks from rounding.
const EDGE: f64 = -1e-9;

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

/// State of one pixel. Most have all their samples alike: those are kept as one.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Pixel {
    /// Colour of the hairs so far, linear, weighted by what is seen of them.
    rgb: [f32; 3],
    /// Strand drawn last, and how much of the pixel it covers by now.
    strand: u32,
    covered: f32,
    /// Part of the light from behind that comes through the hairs so far, at every sample; [`MIXED`] if samples differ.
    through: f32,
    /// Least depth of the skin at a sample.
    near: f32,
}

/// Says that samples of a pixel differ, and stand in [`Tile::through`].
const MIXED: f32 = -1.0;

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
    /// Per pixel and sample: as [`Pixel::through`] where that is [`MIXED`].
    through: Vec<[f32; SAMPLES]>,
    /// Per pixel and sample: depth of the skin, scene units.
    depth: Vec<[f32; SAMPLES]>,
    /// Per row a bit for each pixel through which more can be seen.
    open: [u64; TILE],
    /// Number of those bits.
    left: usize,
    /// Pixels that pieces of hairs were blended into, counted for each piece.
    pub blended: usize,
    /// Triangle seen at each sample; empty as long as there is none.
    triangle: Vec<[u32; SAMPLES]>,
}

impl Tile {
    /// An empty tile: its pixel (0, 0) is (x0, y0) of the picture.
    pub fn new(x0: usize, y0: usize, width: usize, height: usize) -> Tile {
        let pixel = Pixel { rgb: [0.0; 3], strand: NOBODY, covered: 0.0, through: 1.0, near: f32::INFINITY };
        Tile {
            x0,
            y0,
            width,
            height,
            pixel: vec![pixel; width * height],
            through: vec![[1.0; SAMPLES]; width * height],
            depth: vec![[f32::INFINITY; SAMPLES]; width * height],
            open: [ones(width); TILE],
            left: width * height,
            blended: 0,
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
                        self.pixel[k].near = self.pixel[k].near.min(z);
                        self.triangle[k][s] = facet.triangle;
                    }
                }
            }
        }
    }

    /// The finished colours, row by row. `skin` gives the colour of a triangle at a pixel position and depth.
    pub fn resolve(&self, background: [f32; 3], skin: impl Fn(u32, [f64; 2], f32) -> V3) -> Vec<[f32; 3]> {
        let finish = |(k, p): (usize, &Pixel)| {
            let seen = self.triangle.get(k).copied().unwrap_or([NOBODY; SAMPLES]);
            let through = if p.through == MIXED { self.through[k] } else { [p.through; SAMPLES] };
            if seen == [NOBODY; SAMPLES] && through == [1.0; SAMPLES] {
                return background;
            }
            let mut rgb = V3::from(p.rgb);
            // The last triangle and its colour: samples of one triangle share one.
            let mut known = (NOBODY, V3::from(background));
            for ((&triangle, &through), (&depth, at)) in
                seen.iter().zip(&through).zip(self.depth[k].iter().zip(&SAMPLE))
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

    /// Puts a coverage of colour behind what is in pixel `k`, at the samples whose skin is not nearer than `z`. Coverages
    /// of one strand add up, where those of different strands multiply what is left: pieces of a hair lie side by side, so
    /// a hair looks the same however many pieces it has. Returns what comes through at most.
    #[inline]
    fn blend(&mut self, k: usize, rgb: [f32; 3], alpha: f32, z: f32, strand: u32) -> f32 {
        let p = &mut self.pixel[k];
        if p.strand != strand {
            (p.strand, p.covered) = (strand, 0.0);
        }
        let rest = 1.0 - p.covered;
        let part = if rest > 1e-4 { (alpha / rest).min(1.0) } else { 0.0 };
        let (open, seen, most);
        if p.through != MIXED && z <= p.near {
            // All samples alike: the same numbers as below, as eighths of eight like ones are exact.
            seen = p.through * part;
            p.through -= seen;
            (open, most) = (1.0, p.through);
        } else {
            let through = &mut self.through[k];
            if p.through != MIXED {
                *through = [p.through; SAMPLES];
                p.through = MIXED;
            }
            let is_open = self.depth[k].map(|d| if z <= d { 1.0f32 } else { 0.0 });
            let taken: [f32; SAMPLES] = std::array::from_fn(|s| through[s] * part * is_open[s]);
            *through = std::array::from_fn(|s| through[s] - taken[s]);
            (open, seen) = (SHARE * sum(&is_open), SHARE * sum(&taken));
            let half: [f32; SAMPLES / 2] = std::array::from_fn(|s| through[s].max(through[s + SAMPLES / 2]));
            most = (half[0].max(half[2])).max(half[1].max(half[3]));
        }
        p.covered += alpha * open;
        for (sum, c) in p.rgb.iter_mut().zip(rgb) {
            *sum += seen * c;
        }
        most
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

/// Twice the area of the triangle a, b, p.
fn cross(a: [f64; 3], b: [f64; 3], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}
