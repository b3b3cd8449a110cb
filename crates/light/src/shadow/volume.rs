//! Optical depth of one tile in slices.

use super::TILE;
use super::bins::Segment;
use super::exp::exp_neg;
use super::settings::Interpolation;
use wide::f32x4;

/// Widest part of a line that is drawn as one, texels: the line has no width then, and its mass lands up to half of this
/// beside where it belongs. Wider segments are drawn as several lines side by side.
const LINE: f32 = 0.3;

/// Pieces of a line per texel. With 1 the error of the default grows by a tenth; more change nothing.
const PIECES: f32 = 2.0;

/// Most lines of one segment.
const LINES: f32 = 128.0;

/// Opacity that counts as opaque: optical depth 11.5, light 1e-5.
const OPAQUE: f32 = 0.99999;

/// Taps of the widest filter along a side, a multiple of 4.
pub(crate) const TAPS: usize = 20;

/// Layers of texels: layer 0 holds what lies before the first slice plane, layer k what lies between planes k - 1 and
/// k, and the last one what lies beyond the last plane. After [`Volume::sum`] layer k is what lies before plane k.
pub(crate) struct Volume {
    /// Texels along a side, with the border.
    pub side: usize,
    stride: usize,
    slices: usize,
    depth: Vec<f32>,
}

/// Where a point looks: the texels of its footprint and their weights, which sum to 1.
pub(crate) struct Window {
    pub x: i32,
    pub y: i32,
    pub across: usize,
    pub down: usize,
    weight: [[f32; TAPS]; 2],
}

/// Part of a hair in one texel of one layer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fragment {
    pub x: i16,
    pub y: i16,
    pub layer: i16,
    pub depth: f32,
}

impl Window {
    /// The square of side `filter` around (x, y).
    #[inline]
    pub fn new(x: f32, y: f32, filter: f32) -> Window {
        let mut w = Window { x: 0, y: 0, across: 0, down: 0, weight: [[0.0; TAPS]; 2] };
        let inverse = 1.0 / filter;
        for (i, v) in [x, y].into_iter().enumerate() {
            let (low, high) = (v - 0.5 * filter, v + 0.5 * filter);
            let first = low.floor();
            let taps = ((high - first).ceil() as usize).clamp(1, TAPS - 3);
            for (k, weight) in w.weight[i][..taps].iter_mut().enumerate() {
                let at = first + k as f32;
                *weight = ((at + 1.0).min(high) - at.max(low)).max(0.0) * inverse;
            }
            if i == 0 {
                (w.x, w.across) = (first as i32, taps);
            } else {
                (w.y, w.down) = (first as i32, taps);
            }
        }
        w
    }
}

/// Optical depth that the hair itself puts into the window of one of its points, for the planes that are interpolated.
pub(crate) struct Own([[[f32; TAPS]; TAPS]; 4]);

impl Own {
    pub fn new() -> Own {
        Own([[[0.0; TAPS]; TAPS]; 4])
    }

    #[inline]
    pub fn clear(&mut self, window: &Window, interpolation: Interpolation) {
        let quads = window.across.div_ceil(4) * 4;
        for plane in &mut self.0[..planes(interpolation)] {
            for row in &mut plane[..window.down] {
                row[..quads].fill(0.0);
            }
        }
    }

    /// Adds fragments of the hair for a point at `f` between planes `plane` and `plane` + 1. What is outside the window
    /// goes to where no weight is.
    #[inline]
    pub fn add(&mut self, window: &Window, fragments: &[Fragment], plane: i32, f: f32, interpolation: Interpolation) {
        let place = |g: &Fragment| {
            let x = ((i32::from(g.x) - window.x) as u32).min(window.across as u32) as usize;
            let y = ((i32::from(g.y) - window.y) as u32).min(window.down as u32) as usize;
            (x, y)
        };
        if interpolation == Interpolation::OpticalDepth {
            let [own, ..] = &mut self.0;
            for g in fragments {
                let (x, y) = place(g);
                let layer = i32::from(g.layer);
                let seen = if layer <= plane { 1.0 } else { f };
                let seen = if layer <= plane + 1 { seen } else { 0.0 };
                own[y][x] += g.depth * seen;
            }
            return;
        }
        let first = if interpolation == Interpolation::Cubic { plane - 1 } else { plane };
        for g in fragments {
            let (x, y) = place(g);
            for (k, own) in self.0[..planes(interpolation)].iter_mut().enumerate() {
                if i32::from(g.layer) <= first + k as i32 {
                    own[y][x] += g.depth;
                }
            }
        }
    }
}

/// Planes for which the hair's own depth is kept apart.
fn planes(interpolation: Interpolation) -> usize {
    match interpolation {
        Interpolation::OpticalDepth => 1,
        Interpolation::Transmittance => 2,
        Interpolation::Cubic => 4,
    }
}

impl Volume {
    fn sides(filter: f32) -> (usize, usize) {
        let side = TILE + 2 * (0.5 * filter).ceil() as usize;
        (side, side.next_multiple_of(4))
    }

    pub fn new(filter: f32, slices: usize) -> Volume {
        let (side, stride) = Volume::sides(filter);
        Volume { side, stride, slices, depth: vec![0.0; (slices + 2) * side * stride + TAPS] }
    }

    /// Memory of a tile.
    pub fn bytes(filter: f32, slices: usize) -> usize {
        let (side, stride) = Volume::sides(filter);
        4 * ((slices + 2) * side * stride + TAPS)
    }

    pub fn clear(&mut self) {
        self.depth.fill(0.0);
    }

    /// Adds a segment; coordinates in texels of the volume and slices.
    pub fn splat(&mut self, segment: &Segment) {
        let (row, layer) = (self.stride as i32, (self.stride * self.side) as i32);
        let (side, slices) = (self.side, self.slices);
        let depth = &mut self.depth[..];
        fragments(segment, side, slices, |x, y, z, d| {
            depth[(z * layer + y * row + x) as usize] += d;
        });
    }

    /// From parts to sums along the light.
    pub fn sum(&mut self) {
        let layer = self.stride * self.side;
        for k in 1..=self.slices {
            let (before, rest) = self.depth.split_at_mut(k * layer);
            for (v, b) in rest[..layer].iter_mut().zip(&before[(k - 1) * layer..]) {
                *v += b;
            }
        }
    }

    /// Mean transmittance over a window at slice coordinate `s` in [0, slices], without what the hair itself takes.
    #[inline]
    pub fn sample(&self, window: &Window, s: f32, own: &Own, interpolation: Interpolation) -> f32 {
        let (plane, f) = self.plane(s);
        let layer = self.stride * self.side;
        let at = |p: usize, row: usize, x: usize| {
            let start = p * layer + (window.y as usize + row) * self.stride + window.x as usize + x;
            f32x4::from(<[f32; 4]>::try_from(&self.depth[start..start + 4]).unwrap_or_default())
        };
        let own = |k: usize, row: usize, x: usize| {
            f32x4::from(<[f32; 4]>::try_from(&own.0[k][row][x..x + 4]).unwrap_or_default())
        };
        let f4 = f32x4::splat(f);
        let mut sum = f32x4::ZERO;
        for row in 0..window.down {
            let mut line = f32x4::ZERO;
            for x in (0..window.across).step_by(4) {
                let (a, b) = (at(plane, row, x), at(plane + 1, row, x));
                let light = match interpolation {
                    Interpolation::OpticalDepth => exp_neg(a + (b - a) * f4 - own(0, row, x)),
                    Interpolation::Transmittance => {
                        let (a, b) = (exp_neg(a - own(0, row, x)), exp_neg(b - own(1, row, x)));
                        a + (b - a) * f4
                    }
                    Interpolation::Cubic => {
                        let (a, b) = (a - own(1, row, x), b - own(2, row, x));
                        let before = plane.max(1) - 1;
                        let after = (plane + 2).min(self.slices);
                        let z = at(before, row, x) - if plane > 0 { own(0, row, x) } else { own(1, row, x) };
                        let c = at(after, row, x)
                            - if plane + 2 <= self.slices { own(3, row, x) } else { own(2, row, x) };
                        exp_neg(cubic(z, a, b, c, f4))
                    }
                };
                let w = &window.weight[0][x..x + 4];
                line += light * f32x4::new([w[0], w[1], w[2], w[3]]);
            }
            sum += line * f32x4::splat(window.weight[1][row]);
        }
        let [a, b, c, d] = sum.to_array();
        ((a + b) + (c + d)).clamp(0.0, 1.0)
    }

    /// Plane before slice coordinate `s`, and how far between it and the next.
    #[inline]
    pub fn plane(&self, s: f32) -> (usize, f32) {
        let s = s.clamp(0.0, self.slices as f32);
        let p = (s as usize).min(self.slices - 1);
        (p, s - p as f32)
    }
}

/// Catmull-Rom between `b` and `c`, kept between them: optical depth never falls along a ray.
#[inline]
fn cubic(a: f32x4, b: f32x4, c: f32x4, d: f32x4, t: f32x4) -> f32x4 {
    let half = f32x4::splat(0.5);
    let m0 = (c - a) * half;
    let m1 = (d - b) * half;
    let rise = c - b;
    let two = f32x4::splat(2.0);
    let three = f32x4::splat(3.0);
    let v = b + t * (m0 + t * (three * rise - two * m0 - m1 + t * (m0 + m1 - two * rise)));
    v.fast_max(b.fast_min(c)).fast_min(b.fast_max(c))
}

/// Optical depth per area covered: -ln(1 - o c) / c for the coverage c that a hair of `width` texels has of a texel
/// that it crosses. Hairs of one texel are independent of each other, so its mean transmittance is the product of 1 - o
/// c; o alone (its limit for thin hairs) leaves hairs of a texel's width too clear, and -ln(1 - o), right for a hair
/// that covers the texel, makes thin ones too dark.
#[inline]
pub(crate) fn thickness(width: f32, opacity: f32) -> f32 {
    let width = width.max(1e-6);
    let c = if width < 1.0 { width * (1.0 - width / 3.0) } else { 1.0 - 1.0 / (3.0 * width) };
    let x = opacity * c;
    if x < 0.1 {
        opacity * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * 0.2))))
    } else {
        -libm::logf(1.0 - x.min(OPAQUE)) / c
    }
}

/// Cuts a segment into equal pieces of half a texel and one slice at most, each of which goes to the texel and layer of
/// its middle. Whatever the width and the place, the pieces add up to the area that the hair covers.
#[inline]
pub(crate) fn fragments(segment: &Segment, side: usize, slices: usize, mut emit: impl FnMut(i32, i32, i32, f32)) {
    let (a, b) = (segment.a, segment.b);
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length = (dx * dx + dy * dy).sqrt();
    let depth = segment.thickness * segment.width * length;
    if !(depth > 0.0 && depth < f32::MAX) {
        return;
    }
    if segment.width <= LINE {
        line(a, b, depth, side, slices, &mut emit);
        return;
    }
    let lines = (segment.width / LINE).ceil().min(LINES);
    let (nx, ny) = (-dy / length * segment.width, dx / length * segment.width);
    for k in 0..lines as usize {
        let t = (k as f32 + 0.5) / lines - 0.5;
        let shift = |p: [f32; 3]| [p[0] + nx * t, p[1] + ny * t, p[2]];
        line(shift(a), shift(b), depth / lines, side, slices, &mut emit);
    }
}

/// One line of no width.
#[inline]
fn line(a: [f32; 3], b: [f32; 3], depth: f32, side: usize, slices: usize, emit: &mut impl FnMut(i32, i32, i32, f32)) {
    let high = side as f32;
    let top = slices as f32 + 1.0;
    let (mut from, mut to) = (0.0f32, 1.0f32);
    for i in 0..2 {
        let (low_end, high_end) = (a[i].min(b[i]), a[i].max(b[i]));
        if low_end >= 0.0 && high_end < high {
            continue;
        }
        if low_end >= high || high_end < 0.0 {
            return;
        }
        let inverse = 1.0 / (b[i] - a[i]);
        let (u, v) = (-a[i] * inverse, (high - a[i]) * inverse);
        from = from.max(u.min(v));
        to = to.min(u.max(v));
    }
    if !(from < to) {
        return;
    }
    let part = to - from;
    let d = [(b[0] - a[0]) * part, (b[1] - a[1]) * part, (b[2] - a[2]) * part];
    // Slices beyond the ends do not count.
    let (s0, s1) = (a[2] + (b[2] - a[2]) * from, a[2] + (b[2] - a[2]) * to);
    if s0.min(s1) >= slices as f32 {
        return;
    }
    let deep = (s0.clamp(-1.0, top) - s1.clamp(-1.0, top)).abs();
    let steps = (PIECES * d[0].abs().max(d[1].abs())).max(deep * (d[2].abs() / deep.max(1e-6)).min(4.0));
    let steps = steps as i32 + 1;
    let inverse = 1.0 / steps as f32;
    let each = depth * part * inverse;
    let step = d.map(|v| v * inverse);
    let first = [a[0] + (b[0] - a[0]) * from, a[1] + (b[1] - a[1]) * from, s0 + 1.0];
    let last = side as i32 - 1;
    for k in 0..steps {
        let t = k as f32 + 0.5;
        let x = ((first[0] + step[0] * t) as i32).clamp(0, last);
        let y = ((first[1] + step[1] * t) as i32).clamp(0, last);
        let layer = (first[2] + step[2] * t).clamp(0.0, top) as i32;
        emit(x, y, layer, each);
    }
}
