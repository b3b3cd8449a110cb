//! Segments as rows of equal deposits of optical depth.

use super::bins::Segment;
use wide::{f32x4, i32x4};

/// Widest part of a segment that is drawn as one line, texels: the line has no width, and its depth lands up to half of
/// this beside where it belongs. Wider segments are drawn as several lines side by side.
const LINE: f32 = 0.3;

/// Most lines of one segment.
const LINES: f32 = 128.0;

/// Deposits of a line per texel. With 1.5 they bunch and the default becomes too bright by 0.004; with 3 its error falls by
/// 2 % and its time grows by 8 %.
const DEPOSITS: f32 = 2.0;

/// Deposits of a line per slice.
const DEEP: f32 = 1.0;

/// Opacity that counts as opaque: optical depth 11.5, light 1e-5.
const OPAQUE: f32 = 0.99999;

/// Optical depth per area covered: -ln(1 - o c) / c for the mean coverage c that a hair of `width` texels has of the
/// texels it touches, weighted by itself. Hairs of one texel are independent of each other, so its mean transmittance
/// is the product of 1 - o c. Measured at the default (long hair, fur): bias 0.001 and 0.000. With o alone, the limit for
/// thin hairs, hairs that are not much thinner than a texel are too clear: bias +0.022, +0.031. With -ln(1 - o), right
/// for a hair that covers the texel, thin ones are too dark: -0.121, -0.123.
pub(crate) fn thickness(width: f32, opacity: f32) -> f32 {
    let width = width.max(1e-6);
    // A strip along the texels, anywhere between them.
    let c = if width < 1.0 { width * (1.0 - width / 3.0) } else { 1.0 - 1.0 / (3.0 * width) };
    let x = opacity * c;
    if x < 0.1 {
        opacity * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * 0.2))))
    } else {
        -libm::logf(1.0 - x.min(OPAQUE)) / c
    }
}

/// Deposits at `first` + k `step` for whole k below `count`: texels, and slices from 1 (layer 0 lies before the first).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub first: [f32; 3],
    pub step: [f32; 3],
    /// Optical depth of each.
    pub each: f32,
    pub count: u32,
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
        let lines = (segment.width / LINE).ceil().min(LINES);
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
        let (mut from, mut to) = (0.0f32, 1.0f32);
        for i in 0..2 {
            let (low, high) = (a[i].min(b[i]), a[i].max(b[i]));
            if low >= 0.0 && high < side {
                continue;
            }
            if low >= side || high < 0.0 {
                return None;
            }
            let inverse = 1.0 / (b[i] - a[i]);
            let (u, v) = (-a[i] * inverse, (side - a[i]) * inverse);
            from = from.max(u.min(v));
            to = to.min(u.max(v));
        }
        if from >= to || a[2].min(b[2]) >= slices {
            return None;
        }
        let part = to - from;
        let d = [(b[0] - a[0]) * part, (b[1] - a[1]) * part, (b[2] - a[2]) * part];
        let start = [a[0] + (b[0] - a[0]) * from, a[1] + (b[1] - a[1]) * from, a[2] + (b[2] - a[2]) * from + 1.0];
        // Outside the slices one deposit is as good as many.
        let deep = d[2].abs().min(slices + 2.0);
        let count = (DEPOSITS * d[0].abs().max(d[1].abs())).max(DEEP * deep) as u32 + 1;
        let inverse = 1.0 / count as f32;
        let step = d.map(|v| v * inverse);
        let first = [start[0] + 0.5 * step[0], start[1] + 0.5 * step[1], start[2] + 0.5 * step[2]];
        Some(Line { first, step, each: depth * part * inverse, count })
    }

    /// The deposits that may lie in the box [low, high) of texels: all that do, and at most a few more.
    #[inline]
    pub fn within(&self, low: [f32; 2], high: [f32; 2]) -> std::ops::Range<u32> {
        let n = (self.count - 1) as f32;
        let (mut from, mut to) = (0.0f32, n);
        for i in 0..2 {
            let end = self.first[i] + self.step[i] * n;
            let (least, most) = (self.first[i].min(end), self.first[i].max(end));
            if least >= high[i] || most < low[i] {
                return 0..0;
            }
            if least < low[i] || most >= high[i] {
                let inverse = 1.0 / self.step[i];
                let (u, v) = ((low[i] - self.first[i]) * inverse, (high[i] - self.first[i]) * inverse);
                from = from.max(u.min(v) - 0.01);
                to = to.min(u.max(v) + 0.01);
            }
        }
        if from > to { 0..0 } else { from.ceil() as u32..to as u32 + 1 }
    }

    /// Four deposits from `k` on: texel from `low` as whole numbers in [0, `end`], where `end` stands for all that is
    /// outside; layer as a whole number; optical depth, 0 beyond the last.
    #[inline]
    pub fn quad(&self, k: u32, low: [f32; 2], end: [f32; 2]) -> [f32x4; 4] {
        let t = f32x4::splat(k as f32) + f32x4::new([0.0, 1.0, 2.0, 3.0]);
        let whole = |v: f32x4| v.fast_trunc_int().round_float();
        let texel = |i: usize| {
            let v = f32x4::splat(self.first[i] - low[i]) + f32x4::splat(self.step[i]) * t;
            // What is before the window is as good as beyond it.
            let outside = v.simd_lt(f32x4::ZERO);
            let v = outside.select(f32x4::splat(end[i]), v);
            whole(v.fast_min(f32x4::splat(end[i])))
        };
        let z = f32x4::splat(self.first[2]) + f32x4::splat(self.step[2]) * t;
        let left = (f32x4::splat(self.count as f32) - t).fast_max(f32x4::ZERO).fast_min(f32x4::ONE);
        [texel(0), texel(1), whole(z.fast_max(f32x4::ZERO)), left * f32x4::splat(self.each)]
    }

    /// Hands out the place of each deposit in an array of layers, rows and texels, four at a time and in order.
    /// `size` is (side, rows' length, layers' length, last layer); places up to 2^24 are exact.
    #[inline]
    pub fn places(&self, [side, row, layer, last]: [usize; 4], mut visit: impl FnMut(usize)) {
        let zero = f32x4::ZERO;
        let edge = f32x4::splat(side as f32 - 0.5);
        let end = f32x4::splat(last as f32 + 0.5);
        let [rows, layers] = [row, layer].map(|v| f32x4::splat(v as f32));
        let [fx, fy, fz] = self.first.map(f32x4::splat);
        let [sx, sy, sz] = self.step.map(f32x4::splat);
        let mut t = f32x4::new([0.0, 1.0, 2.0, 3.0]);
        let mut left = self.count as usize;
        let whole = |v: f32x4| v.fast_trunc_int().round_float();
        loop {
            let x = whole((fx + sx * t).fast_max(zero).fast_min(edge));
            let y = whole((fy + sy * t).fast_max(zero).fast_min(edge));
            let z = whole((fz + sz * t).fast_max(zero).fast_min(end));
            let place: i32x4 = (z * layers + y * rows + x).fast_trunc_int();
            let place = place.to_array();
            if left <= 4 {
                for p in &place[..left] {
                    visit(*p as usize);
                }
                return;
            }
            for p in place {
                visit(p as usize);
            }
            left -= 4;
            t += f32x4::splat(4.0);
        }
    }
}
