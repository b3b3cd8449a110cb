//! Segments as rows of equal deposits of optical depth.

use super::bins::Segment;
use super::registers::{LANES, Lanes, least, most};
use super::slices::Slices;
use wide::f32x4;

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
        let (first, last) = (least(a[i], b[i]), most(a[i], b[i]));
        if first >= low && last < high {
            continue;
        }
        if first >= high || last < low {
            return None;
        }
        let inverse = 1.0 / (b[i] - a[i]);
        let (u, v) = ((low - a[i]) * inverse, (high - a[i]) * inverse);
        from = most(least(u, v), from);
        to = least(most(u, v), to);
    }
    (from < to).then_some([from, to])
}

/// A line in a tile, cut where it passes from column to column of texels along the axis it mostly follows (from row to
/// row where it mostly goes across rows): point `origin` + t `step` for t in [`from`, `to`], cut at whole t. Each part is
/// deposited at its middle, so every column has its share exactly; deposits at equal distances from the line's end instead
/// bunch, which at 1.5 a texel makes the default too bright by 0.004.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Texels, and rows of [`Slices`].
    origin: [f32; 3],
    step: [f32; 3],
    from: f32,
    to: f32,
    /// t per texel along the axis that the line mostly follows.
    rate: f32,
    /// Optical depth per t.
    each: f32,
    /// Least row.
    near: f32,
    /// Least x and y, and negated most x and y.
    bounds: f32x4,
}

/// Parts of a line: the texel and the row of [`Slices`] that each lies in, and its optical depth.
#[derive(Clone, Copy)]
pub(crate) struct Parts<L> {
    pub x: L,
    pub y: L,
    pub row: L,
    pub depth: L,
}

/// 0, 1, 2 and so on.
const COUNT: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

impl Line {
    /// Lines of a segment in a tile of `side` texels each way. Whatever the width and the place, the deposits add up to the
    /// area that the hair covers.
    #[inline(always)]
    pub fn of(segment: &Segment, side: f32, slices: &Slices, mut emit: impl FnMut(Line)) {
        let (a, b) = (segment.a, segment.b);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let depth = segment.thickness * segment.width * length;
        if !(depth > 0.0 && depth < f32::MAX) {
            return;
        }
        let [a, b] = [a, b].map(|p| [p[0], p[1], slices.row(p[2])]);
        if segment.width <= LINE {
            if let Some(l) = Line::new(a, b, depth, side, slices) {
                emit(l);
            }
            return;
        }
        let lines = lines(segment.width);
        let (nx, ny) = (-dy / length * segment.width, dx / length * segment.width);
        for k in 0..lines as usize {
            let t = (k as f32 + 0.5) / lines - 0.5;
            let shift = |p: [f32; 3]| [p[0] + nx * t, p[1] + ny * t, p[2]];
            if let Some(l) = Line::new(shift(a), shift(b), depth / lines, side, slices) {
                emit(l);
            }
        }
    }

    /// The part of a line that lies over the tile and before its last plane.
    #[inline(always)]
    fn new(a: [f32; 3], b: [f32; 3], depth: f32, side: f32, slices: &Slices) -> Option<Line> {
        let [from, to] = part_over(&a, &b, 0.0, side)?;
        if slices.is_behind(least(a[2], b[2])) {
            return None;
        }
        let part = to - from;
        let d = [(b[0] - a[0]) * part, (b[1] - a[1]) * part, (b[2] - a[2]) * part];
        let start = [a[0] + (b[0] - a[0]) * from, a[1] + (b[1] - a[1]) * from, a[2] + (b[2] - a[2]) * from];
        let axis = usize::from(d[1].abs() > d[0].abs());
        let reach = d[axis].abs();
        // Slices that it passes.
        let deep = slices.between(start[2], start[2] + d[2]);
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
        let end = [0, 1, 2].map(|i| start[i] + d[i]);
        let low = [0, 1, 2].map(|i| least(start[i], end[i]));
        let bounds = f32x4::new([low[0], low[1], -most(start[0], end[0]), -most(start[1], end[1])]);
        let each = depth * part * inverse;
        Some(Line { origin, step, from: phase, to: phase + parts, rate, each, near: low[2], bounds })
    }

    /// True if the line has nothing in a box, given as [high x, high y, -low x, -low y], or nothing before a row.
    #[inline(always)]
    pub fn misses(&self, r#box: f32x4, row: f32) -> bool {
        // Rounding of a part's row is far below one.
        self.near - 1.0 > row || self.bounds.simd_ge(r#box).any()
    }

    /// Most optical depth that the line leaves in one texel.
    #[inline(always)]
    pub fn most(&self) -> f32 {
        self.each * least(self.rate.abs(), self.to - self.from)
    }

    /// How many parts it has.
    #[inline(always)]
    pub fn count(&self) -> usize {
        let whole = self.to as usize;
        whole + usize::from((whole as f32) < self.to)
    }

    /// The parts that may lie in the box [low, high) of texels: all that do, and at most a few more.
    #[inline(always)]
    pub fn within(&self, low: [f32; 2], high: [f32; 2]) -> std::ops::Range<usize> {
        let axis = usize::from(self.step[1].abs() > self.step[0].abs());
        let (u, v) = ((low[axis] - self.origin[axis]) * self.rate, (high[axis] - self.origin[axis]) * self.rate);
        // Texels' edges are whole t, but for rounding.
        let from = most(least(u, v) + 0.01, 0.0);
        let to = most(least(most(u, v) + 0.99, self.to + 1.0), 0.0);
        from as u32 as usize..to as u32 as usize
    }

    /// Sixteen parts from part `k` on, texels kept in [0, `edge`] and rows in [0, `end`]. Those behind the last have the
    /// least depth that there is.
    #[inline(always)]
    pub fn parts<L: Lanes>(&self, k: usize, edge: L, end: L) -> Parts<L> {
        let t = L::splat(k as f32) + L::read(&COUNT);
        let (from, to) = (t.max(L::splat(self.from)), (t + L::splat(1.0)).min(L::splat(self.to)));
        let middle = (from + to) * L::splat(0.5);
        let depth = ((to - from) * L::splat(self.each)).short();
        let [x, y] = [self.at(0, middle, edge).whole(), self.at(1, middle, edge).whole()];
        Parts { x, y, row: self.at(2, middle, end), depth }
    }

    /// Coordinate `i` at `t`, kept in [0, `most`].
    #[inline(always)]
    fn at<L: Lanes>(&self, i: usize, t: L, most: L) -> L {
        (L::splat(self.origin[i]) + L::splat(self.step[i]) * t).max(L::splat(0.0)).min(most)
    }
}

/// Largest whole number that is not larger, for sizes up to 2^31.
#[inline(always)]
fn floor(v: f32) -> f32 {
    let whole = v as i32 as f32;
    if whole > v { whole - 1.0 } else { whole }
}
