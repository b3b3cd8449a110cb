//! Segments as rows of equal deposits of optical depth.

use super::bins::Segment;
use super::numbers::{least, most, short};
use super::slices::Slices;
use pelage_geom::registers::{Bits, COUNT, Lanes};
use wide::f32x4;

/// Widest segment that is drawn as one line, texels: the line has no width, and its depth lands up to half of this beside
/// where it belongs.
const ONE: f32 = 0.5;

/// Widest part of a wider segment that is drawn as one line.
const LINE: f32 = 0.4;

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
    if width <= ONE { 1.0 } else { ((width * (1.0 / LINE)) as u32 as f32 + 1.0).min(LINES) }
}

/// Optical depth per area covered with which a hair of `width` texels takes the light that it covers times its opacity,
/// in the mean over all places of the texels; `slant` is its length over the columns it passes (see [`Line`]), 1 to sqrt 2.
/// Hairs of one texel are independent of each other, so their mean transmittance is the product of each one's.
/// With the opacity alone, the limit for thin hairs, hairs that are not much thinner than a texel are too clear: bias +0.022
/// (long hair), +0.031 (fur). With -ln(1 - o), right for a hair that covers the texel, thin ones are too dark: -0.121, -0.123.
/// With no regard to the slant: +0.006 (long hair). With -ln(1 - o c) / c for the mean coverage c, right for one line, hairs
/// of 1.5 texels are too dark: -0.0055.
#[inline]
pub(crate) fn thickness(width: f32, slant: f32, opacity: f32) -> f32 {
    // What it covers of a column.
    let v = (width * slant).max(1e-6);
    let n = lines(width);
    if n == 1.0 { depth(opacity * v) / v } else { thickness_of_lines(v, n, opacity) }
}

/// [`thickness`] of a hair that covers `v` of a column with `n` lines.
fn thickness_of_lines(v: f32, n: f32, opacity: f32) -> f32 {
    // In lines at `each` from each other.
    let each = v / n;
    let reach = 1.0 / each;
    let k = reach as u32;
    let r = reach - k as f32;
    let (lines, wanted) = (n as u32, opacity.min(OPAQUE) * n);
    // A column lies over j lines of the hair for a length of `each` times: 2 for all j that are less than n and than
    // what goes into a column; where the hair is wider than the column, as many times k or k + 1 as are left, else n.
    let last = k.min(lines - 1);
    let mut t = depth(opacity * v.min(1.0) * (2.0 / 3.0)) / v.min(1.0);
    for _ in 0..STEPS {
        // Light that j lines let through is q^j; its slope by t is -each j q^j.
        let q = libm::expf(-t * each);
        let (mut taken, mut slope, mut power) = (0.0, 0.0, 1.0);
        let mut add = |times: f32, j: u32, power: f32| {
            taken += times * (1.0 - power);
            slope += times * j as f32 * power;
        };
        for j in 1..=last {
            power *= q;
            add(2.0, j, power);
        }
        if lines > k {
            let wide = (lines - 1 - k) as f32;
            add(r + wide * r, k + 1, power * q);
            add(wide * (1.0 - r), k, power);
        } else {
            add((k - lines + 1) as f32 + r, lines, power * q);
        }
        t = (t + (wanted - taken) / (each * slope).max(1e-6)).max(0.0);
    }
    t
}

/// Steps of Newton's method for [`thickness`]: it comes from below, so each doubles the digits.
const STEPS: u32 = 6;

/// -ln(1 - x).
#[inline]
fn depth(x: f32) -> f32 {
    // All that is drawn as one line: its width is at most 1 / 2, its slant sqrt 2.
    if x < 0.71 {
        // 2 artanh(s) in powers of s up to 0.55; what is left out is under 5e-6 of it.
        let s = x / (2.0 - x);
        let q = s * s;
        let series = 1.0 / 9.0 + q * (1.0 / 11.0 + q * (1.0 / 13.0 + q * (1.0 / 15.0)));
        let series = 1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * series)));
        2.0 * s * series
    } else {
        -libm::logf(1.0 - x.min(OPAQUE))
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
/// row where it mostly goes across rows), and into slices between: point `origin` + t `step` for t in [`from`, `to`], cut at
/// whole t. What lies in a column goes into one texel, in the middle of it, so every column has its share exactly; deposits
/// at equal distances from the line's end instead bunch, which at 1.5 a texel makes the default too bright by 0.004. A texel
/// for each slice's part would spread a column over two, and take up to a tenth more light than the hair covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Texels along the axis that it mostly follows, along the other, and rows of [`Slices`].
    origin: [f32; 3],
    step: [f32; 3],
    from: f32,
    to: f32,
    /// The axis that it mostly follows: 0 or 1.
    axis: u32,
    /// t per texel along it.
    rate: f32,
    /// Optical depth per t.
    each: f32,
    /// Least row.
    near: f32,
    /// Least x and y, and negated most x and y.
    bounds: f32x4,
}

/// Parts of a line: the texel, along the axis that the line mostly follows and along the other, and the row of [`Slices`]
/// that each lies in, and its optical depth.
#[derive(Clone, Copy)]
pub(crate) struct Parts<L> {
    pub along: L,
    pub across: L,
    pub row: L,
    pub depth: L,
}

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
        if segment.width <= ONE {
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
        let step = [axis, 1 - axis, 2].map(|i| d[i] * inverse);
        let origin = [start[axis] - step[0] * phase, start[1 - axis] - step[1] * phase, start[2] - step[2] * phase];
        let end = [0, 1, 2].map(|i| start[i] + d[i]);
        let low = [0, 1, 2].map(|i| least(start[i], end[i]));
        let bounds = f32x4::new([low[0], low[1], -most(start[0], end[0]), -most(start[1], end[1])]);
        let each = depth * part * inverse;
        let (from, to, axis) = (phase, phase + parts, axis as u32);
        Some(Line { origin, step, from, to, axis, rate, each, near: low[2], bounds })
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
        let (u, v) = (self.when(low[self.axis()]), self.when(high[self.axis()]));
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
        let depth = short((to - from) * L::splat(self.each));
        let along = self.at(0, middle, edge).whole().values();
        let mut column = middle;
        // One part in a column is the column's; where a line stays in one column, the rate is infinite.
        if self.rate.abs() > 1.5 {
            let u = (along - L::splat(self.origin[0])) * L::splat(self.rate);
            let v = (along + L::splat(1.0) - L::splat(self.origin[0])) * L::splat(self.rate);
            column = (u.min(v).max(L::splat(self.from)) + u.max(v).min(L::splat(self.to))) * L::splat(0.5);
        }
        let across = self.at(1, column, edge).whole().values();
        Parts { along, across, row: self.at(2, middle, end), depth }
    }

    /// The axis that it mostly follows.
    #[inline(always)]
    pub fn axis(&self) -> usize {
        (self.axis & 1) as usize
    }

    /// t at which it reaches a place on that axis.
    #[inline(always)]
    fn when(&self, place: f32) -> f32 {
        (place - self.origin[0]) * self.rate
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hair_anywhere_takes_its_area_times_its_opacity() {
        for width in [0.01f32, 0.3, 0.49, 0.51, 0.9, 1.5, 2.3, 7.0, 40.0, 90.0] {
            for (slant, opacity) in [(1.0f32, 0.02f32), (1.2, 0.5), (1.0, 0.9), (1.4, 1.0)] {
                let t = f64::from(thickness(width, slant, opacity));
                let (n, v) = (lines(width) as usize, f64::from(width * slant));
                // All places of the hair on a row of columns, in 2,000 steps of a column.
                let steps = 2000;
                let mut taken = 0.0;
                for place in 0..steps {
                    let at = |k: usize| place as f64 / steps as f64 + v * k as f64 / n as f64;
                    let (mut k, mut column) = (0, 0);
                    while k < n {
                        let mut j = 0;
                        while k < n && at(k) < (column + 1) as f64 {
                            (k, j) = (k + 1, j + 1);
                        }
                        taken += 1.0 - libm::exp(-t * v * j as f64 / n as f64);
                        column += 1;
                    }
                }
                let share = taken / steps as f64 / (f64::from(opacity) * v);
                // Opaque hairs of many columns are left with a little light in them.
                let within = if width > 10.0 { 6e-3 } else { 1e-3 };
                assert!((share - 1.0).abs() < within, "{width} {slant} {opacity}: {share}");
            }
        }
    }
}
