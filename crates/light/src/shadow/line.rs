//! Segments as rows of equal deposits of optical depth.

use super::bins::Segment;
use wide::{f32x4, i32x4};

/// Widest part of a segment that is drawn as one line, texels: the line has no width, and its depth lands up to half of
/// this beside where it belongs. Wider segments are drawn as several lines side by side.
const LINE: f32 = 0.3;

/// Most lines of one segment.
const LINES: f32 = 128.0;

/// Parts of a texel's side, at most, that a line is cut into to reach every slice it passes; a line that is steeper than
/// that stays within a texel for most of its way, and is cut into equal parts.
const PARTS: f32 = 64.0;

/// Opacity that counts as opaque: optical depth 11.5, light 1e-5.
const OPAQUE: f32 = 0.99999;

/// How many lines a hair of `width` texels is drawn as.
#[inline]
fn lines(width: f32) -> f32 {
    if width <= LINE { 1.0 } else { ((width * (1.0 / LINE)) as u32 as f32 + 1.0).min(LINES) }
}

/// Optical depth per area covered: -ln(1 - o c) / c for the mean coverage c that a hair of `width` texels has of the
/// texels it is deposited in, weighted by itself; `slant` is its length over the columns it passes (see [`Line`]), 1 to
/// sqrt 2. Hairs of one texel are independent of each other, so its mean transmittance is the product of 1 - o c.
/// With o alone, the limit for thin hairs, hairs that are not much thinner than a texel are too clear: bias +0.022 (long
/// hair), +0.031 (fur). With -ln(1 - o), right for a hair that covers the texel, thin ones are too dark: -0.121, -0.123.
/// With no regard to the slant: +0.006 (long hair).
pub(crate) fn thickness(width: f32, slant: f32, opacity: f32) -> f32 {
    // What it covers of a column, anywhere between the texels. As n lines at v / n from each other it has of a texel
    // v / n^2 times the sum over pairs of lines of the chance 1 - d that d does not part them.
    let v = (width * slant).max(1e-6);
    let n = lines(width);
    let c = if v < 1.0 { v * (1.0 - v * (1.0 / 3.0) * (1.0 - 1.0 / (n * n))) } else { 1.0 - 1.0 / (3.0 * v) };
    let x = opacity * c;
    if x < 0.5 {
        // 2 artanh(s) in powers of s up to 1/3; what is left out is under 1e-6 of it.
        let s = x / (2.0 - x);
        let q = s * s;
        let series = 1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0))));
        opacity * 2.0 / (2.0 - x) * series
    } else {
        -libm::logf(1.0 - x.min(OPAQUE)) / c
    }
}

/// First and last parameter of the part of a line from `a` to `b` that lies over the square [low, high)^2 of texels.
#[inline]
pub(crate) fn part_over(a: &[f32; 3], b: &[f32; 3], low: f32, high: f32) -> Option<[f32; 2]> {
    let (mut from, mut to) = (0.0f32, 1.0f32);
    for i in 0..2 {
        let (least, most) = (a[i].min(b[i]), a[i].max(b[i]));
        if least >= low && most < high {
            continue;
        }
        if least >= high || most < low {
            return None;
        }
        let inverse = 1.0 / (b[i] - a[i]);
        let (u, v) = ((low - a[i]) * inverse, (high - a[i]) * inverse);
        from = from.max(u.min(v));
        to = to.min(u.max(v));
    }
    (from < to).then_some([from, to])
}

/// A line in a volume, cut where it passes from column to column of texels along the axis it mostly follows (from row to
/// row where it mostly goes across rows): point `origin` + t `step` for t in [`from`, `to`], cut at whole t. Each part is
/// deposited at its middle, so every column has its share exactly; deposits at equal distances from the line's end instead
/// bunch, which at 1.5 a texel makes the default too bright by 0.004.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Texels, and slices from 1 (layer 0 lies before the first).
    origin: [f32; 3],
    step: [f32; 3],
    from: f32,
    to: f32,
    /// t per texel along the axis that the line mostly follows.
    rate: f32,
    /// Optical depth per t.
    each: f32,
    /// Least x and y, and negated most x and y.
    bounds: f32x4,
}

/// Four parts of a line: where they lie, texels and layers; optical depth of each, 0 beyond the last.
struct Parts {
    x: f32x4,
    y: f32x4,
    z: f32x4,
    depth: f32x4,
}

/// Whole part of what is not negative.
#[inline(always)]
fn whole(v: f32x4) -> f32x4 {
    v.fast_trunc_int().round_float()
}

impl Line {
    /// Lines of a segment in a volume of `side` texels each way. Whatever the width and the place, the deposits add up
    /// to the area that the hair covers.
    #[inline]
    pub fn of(segment: &Segment, side: usize, slices: usize, mut emit: impl FnMut(Line)) {
        let (a, b) = (segment.a, segment.b);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let depth = segment.thickness * segment.width * length;
        if !(depth > 0.0 && depth < f32::MAX) {
            return;
        }
        if segment.width <= LINE {
            if let Some(l) = Line::new(a, b, depth, side as f32, slices as f32) {
                emit(l);
            }
            return;
        }
        let lines = lines(segment.width);
        let (nx, ny) = (-dy / length * segment.width, dx / length * segment.width);
        for k in 0..lines as usize {
            let t = (k as f32 + 0.5) / lines - 0.5;
            let shift = |p: [f32; 3]| [p[0] + nx * t, p[1] + ny * t, p[2]];
            if let Some(l) = Line::new(shift(a), shift(b), depth / lines, side as f32, slices as f32) {
                emit(l);
            }
        }
    }

    /// The part of a line that lies over the volume and before its last plane.
    #[inline]
    fn new(a: [f32; 3], b: [f32; 3], depth: f32, side: f32, slices: f32) -> Option<Line> {
        let [from, to] = part_over(&a, &b, 0.0, side)?;
        if a[2].min(b[2]) >= slices {
            return None;
        }
        let part = to - from;
        let d = [(b[0] - a[0]) * part, (b[1] - a[1]) * part, (b[2] - a[2]) * part];
        let start = [a[0] + (b[0] - a[0]) * from, a[1] + (b[1] - a[1]) * from, a[2] + (b[2] - a[2]) * from + 1.0];
        let axis = usize::from(d[1].abs() > d[0].abs());
        let reach = d[axis].abs();
        // Outside the slices one deposit is as good as many.
        let deep = d[2].abs().min(slices + 2.0);
        let (parts, phase) = if deep <= PARTS * reach {
            let parts = if deep <= reach { 1.0 } else { (deep / reach) as u32 as f32 + 1.0 };
            // From the edge that lies behind the start.
            let ahead = if d[axis] < 0.0 { -start[axis] * parts } else { start[axis] * parts };
            (reach * parts, ahead - floor(ahead))
        } else {
            (deep as u32 as f32 + 1.0, 0.0)
        };
        let (inverse, rate) = (1.0 / parts, parts / d[axis]);
        let step = d.map(|v| v * inverse);
        let origin = [0, 1, 2].map(|i| start[i] - step[i] * phase);
        let end = [start[0] + d[0], start[1] + d[1]];
        let bounds =
            f32x4::new([start[0].min(end[0]), start[1].min(end[1]), -start[0].max(end[0]), -start[1].max(end[1])]);
        Some(Line { origin, step, from: phase, to: phase + parts, rate, each: depth * part * inverse, bounds })
    }

    /// True if the line has nothing in a box, given as [high x, high y, -low x, -low y].
    #[inline(always)]
    pub fn misses(&self, r#box: f32x4) -> bool {
        self.bounds.simd_ge(r#box).any()
    }

    /// Most optical depth that the line leaves in one texel.
    #[inline(always)]
    pub fn most(&self) -> f32 {
        self.each * self.rate.abs().min(self.to - self.from)
    }

    /// The parts that may lie in the box [low, high) of texels: all that do, and at most a few more.
    #[inline]
    pub fn within(&self, low: [f32; 2], high: [f32; 2]) -> std::ops::Range<u32> {
        let axis = usize::from(self.step[1].abs() > self.step[0].abs());
        let (u, v) = ((low[axis] - self.origin[axis]) * self.rate, (high[axis] - self.origin[axis]) * self.rate);
        // Texels' edges are whole t, but for rounding.
        let from = (u.min(v) + 0.01).max(0.0);
        let to = (u.max(v) + 0.99).min(self.to + 1.0).max(0.0);
        from as u32..to as u32
    }

    /// Four parts from `t` on, texels kept in [0, edge] and layers in [0, end].
    #[inline(always)]
    fn parts(&self, t: f32x4, edge: f32x4, end: f32x4) -> Parts {
        let (from, to) = (t.fast_max(f32x4::splat(self.from)), (t + f32x4::ONE).fast_min(f32x4::splat(self.to)));
        let middle = (from + to) * f32x4::HALF;
        let at = |i: usize, most: f32x4| {
            let v = f32x4::splat(self.origin[i]) + f32x4::splat(self.step[i]) * middle;
            whole(v.fast_max(f32x4::ZERO).fast_min(most))
        };
        let depth = (to - from).fast_max(f32x4::ZERO) * f32x4::splat(self.each);
        Parts { x: at(0, edge), y: at(1, edge), z: at(2, end), depth }
    }

    /// Hands out place and optical depth of each part, four at a time: places in an array of layers, rows and texels.
    /// `size` is (side, rows' length, layers' length, last layer); places up to 2^24 are exact.
    #[inline]
    pub fn places(&self, [side, row, layer, last]: [usize; 4], mut visit: impl FnMut([i32; 4], [f32; 4])) {
        let (edge, end) = (f32x4::splat(side as f32 - 0.5), f32x4::splat(last as f32 + 0.5));
        let [rows, layers] = [row, layer].map(|v| f32x4::splat(v as f32));
        let mut t = 0.0;
        while t < self.to {
            let Parts { x, y, z, depth } = self.parts(f32x4::splat(t) + f32x4::new(LANES), edge, end);
            let place: i32x4 = (z * layers + y * rows + x).fast_trunc_int();
            visit(place.to_array(), depth.to_array());
            t += 4.0;
        }
    }

    /// Hands out parts that lie in a box of `size` texels from `low` on: place in an array of rows of size[0], layer,
    /// optical depth. Parts that lie outside go four to seven places behind the array. `side` and `last`
    /// as for [`Line::places`].
    #[inline]
    pub fn places_within(
        &self,
        low: [f32; 2],
        size: [f32; 2],
        [side, last]: [usize; 2],
        mut visit: impl FnMut([i32; 4], f32x4, f32x4),
    ) {
        let (edge, end) = (f32x4::splat(side as f32 - 0.5), f32x4::splat(last as f32 + 0.5));
        let behind = f32x4::splat(size[0] * size[1] + 4.0) + f32x4::new(LANES);
        for k in self.within(low, [low[0] + size[0], low[1] + size[1]]).step_by(4) {
            let Parts { x, y, z, depth } = self.parts(f32x4::splat(k as f32) + f32x4::new(LANES), edge, end);
            let (x, y) = (x - f32x4::splat(low[0]), y - f32x4::splat(low[1]));
            let outside = |v: f32x4, n: f32| v.simd_lt(f32x4::ZERO) | v.simd_ge(f32x4::splat(n));
            let outside = outside(x, size[0]) | outside(y, size[1]);
            let place: i32x4 = outside.select(behind, y * f32x4::splat(size[0]) + x).fast_trunc_int();
            visit(place.to_array(), z, depth);
        }
    }
}

const LANES: [f32; 4] = [0.0, 1.0, 2.0, 3.0];

/// Largest whole number that is not larger, for sizes up to 2^31.
#[inline(always)]
fn floor(v: f32) -> f32 {
    let whole = v as i32 as f32;
    if whole > v { whole - 1.0 } else { whole }
}
