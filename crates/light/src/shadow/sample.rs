//! What light reaches a point: the mean over its footprint of the light that passes the texels.

use super::exp::exp_neg;
use super::line::{Line, Parts};
use super::slices::Slices;
use pelage_geom::registers::{Bits, COUNT, LANES, Lanes};
use wide::f32x4;

/// Texels of the widest footprint along a side.
const TAPS: usize = 17;

/// Length of a row of taps; more than a footprint is wide, so that what lies to the left of a row lies behind another.
const ROW: usize = 2 * LANES;

/// From one tap to the next along x and y.
const STRIDE: [f32; 2] = [1.0, ROW as f32];

/// What is read behind the end of a map.
pub(crate) const SPARE: usize = 4 * ROW;

/// Optical depth that counts as no light: 6e-6 of it is left. Lower, the sum of what is lost shows in the mean.
const DARK: f32 = 12.0;

/// Where a point looks: the texels of its footprint and their weights, which sum to 1.
pub(crate) struct Window {
    x: i32,
    y: i32,
    across: usize,
    down: usize,
    weight: [[f32; ROW]; 2],
}

impl Window {
    pub fn new() -> Window {
        Window { x: 0, y: 0, across: 0, down: 0, weight: [[0.0; ROW]; 2] }
    }

    /// Moves to the square of side `filter` around (x, y).
    #[inline(always)]
    pub fn put<L: Lanes>(&mut self, x: f32, y: f32, filter: f32) {
        (self.x, self.across) = weigh::<L>(x, filter, &mut self.weight[0]);
        (self.y, self.down) = weigh::<L>(y, filter, &mut self.weight[1]);
    }
}

/// Weights of the texels that are within half of `filter` from `v`; the first one, and how many they are.
#[inline(always)]
fn weigh<L: Lanes>(v: f32, filter: f32, weight: &mut [f32; ROW]) -> (i32, usize) {
    let inverse = L::splat(1.0 / filter);
    let (low, high) = (v - 0.5 * filter, v + 0.5 * filter);
    let first = low as i32;
    let taps = ((high as i32 - first + 1) as usize).min(TAPS);
    let mut at = L::splat(first as f32) + L::read(&COUNT);
    for k in (0..taps).step_by(LANES) {
        let cover = (at + L::splat(1.0)).min(L::splat(high)) - at.max(L::splat(low));
        (cover.max(L::splat(0.0)) * inverse).write(lanes_mut(weight, k));
        at = at + L::splat(LANES as f32);
    }
    (first, taps)
}

/// The lines of one hair.
pub(crate) struct Own<'a> {
    pub lines: &'a [Line],
    /// Optical depth, the hair's own included, from which on no light is left.
    pub dark: f32,
}

/// Optical depth from which on no light is left where a hair with these lines is in it.
pub(crate) fn dark(lines: &[Line]) -> f32 {
    DARK + lines.iter().map(Line::most).sum::<f32>()
}

/// Optical depth in the texels of a window, row by row, at each of the planes that are interpolated; one row more on each
/// side stands for what lies outside.
pub(crate) struct Taps([[f32; ROW * (TAPS + 2)]; 4]);

impl Taps {
    pub fn new() -> Taps {
        Taps([[0.0; ROW * (TAPS + 2)]; 4])
    }

    /// Optical depth of sixteen texels, not below 0.
    #[inline(always)]
    fn at<L: Lanes>(&self, plane: usize, start: usize) -> L {
        L::read(lanes(&self.0[plane], start)).max(L::splat(0.0))
    }
}

/// Planes around a point: two maps, or four for the cubic, rows of `side` texels, the point between the middle two at the
/// fraction `f`.
pub(crate) struct Around<'a> {
    pub map: &'a [Vec<f32>],
    pub side: usize,
    /// Number of the one before the point.
    pub plane: usize,
    pub f: f32,
    pub slices: &'a Slices,
}

impl Around<'_> {
    /// Mean transmittance over a window, without what the lines of the hair itself take, with optical depth kept apart at
    /// this many planes: 1 for linear optical depth, 2 for linear transmittance, 4 for the cubic. The mean is over
    /// transmittance, as a footprint's is: of mean optical depth it would be too dark, at the default by 0.017 in long hair
    /// and 0.027 in fur.
    #[inline(always)]
    pub fn light<L: Lanes, const PLANES: usize>(&self, window: &Window, own: &Own, taps: &mut Taps) -> f32 {
        if self.read::<L, PLANES>(window, own.dark, taps) {
            return 0.0;
        }
        self.take::<L, PLANES>(window, own.lines, taps);
        let f = L::splat(self.f);
        // What juts out of a row is some light with weight 0.
        let mut sum = L::splat(0.0);
        for (row, weight) in window.weight[1][..window.down].iter().enumerate() {
            let mut line = L::splat(0.0);
            for x in (0..window.across).step_by(LANES) {
                let at = (row + 1) * ROW + x;
                let light = match PLANES {
                    1 => exp_neg(taps.at::<L>(0, at)),
                    2 => {
                        let (a, b) = (exp_neg(taps.at::<L>(0, at)), exp_neg(taps.at::<L>(1, at)));
                        a + (b - a) * f
                    }
                    _ => exp_neg(cubic(taps.at(0, at), taps.at(1, at), taps.at(2, at), taps.at(3, at), f)),
                };
                line = line + light * L::read(lanes(&window.weight[0], x));
            }
            sum = sum + line * L::splat(*weight);
        }
        let mut each = [0.0; LANES];
        sum.write(&mut each);
        total(each).clamp(0.0, 1.0)
    }

    /// Fills the taps; true if all that is read of linear optical depth is more than `dark`.
    #[inline(always)]
    fn read<L: Lanes, const PLANES: usize>(&self, window: &Window, dark: f32, taps: &mut Taps) -> bool {
        let corner = window.y as usize * self.side + window.x as usize;
        let (f, dark) = (L::splat(self.f), L::splat(dark));
        let mut is_dark = PLANES == 1;
        for x in (0..window.across).step_by(LANES) {
            let mut low = L::splat(f32::MAX);
            for row in 0..window.down {
                let (from, to) = (corner + row * self.side + x, (row + 1) * ROW + x);
                if PLANES == 1 {
                    let (a, b) = (L::read(lanes(&self.map[0], from)), L::read(lanes(&self.map[1], from)));
                    let v = a + (b - a) * f;
                    low = low.min(v);
                    v.write(lanes_mut(&mut taps.0[0], to));
                } else {
                    for (taps, map) in taps.0[..PLANES].iter_mut().zip(self.map) {
                        L::read(lanes(map, from)).write(lanes_mut(taps, to));
                    }
                }
            }
            // What juts out of the row has no weight, and counts as dark.
            let seen = L::if_gt(L::read(lanes(&window.weight[0], x)), L::splat(0.0), low, dark);
            is_dark &= !L::any_gt(dark, seen);
        }
        is_dark
    }

    /// Takes the hair's own lines out of the taps.
    #[inline(always)]
    fn take<L: Lanes, const PLANES: usize>(&self, window: &Window, own: &[Line], taps: &mut Taps) {
        let low = [window.x as f32, window.y as f32];
        let size = [window.across as f32, window.down as f32];
        let high = [low[0] + size[0], low[1] + size[1]];
        let around = f32x4::new([high[0], high[1], -low[0], -low[1]]);
        let (edge, end) = (L::splat(self.side as f32 - 0.5), L::splat(Slices::END));
        let (zero, one, f) = (L::splat(0.0), L::splat(1.0), L::splat(self.f));
        let behind = self.behind::<PLANES>();
        // Of what lies behind the planes nothing was put in.
        let last = behind[PLANES.max(2) - 1];
        let next = L::splat(behind[1]);
        let (mut place, mut depth) = ([0u32; LANES], [[0.0; LANES]; PLANES]);
        for line in own.iter().filter(|l| !l.misses(around, last)) {
            let parts = line.within(low, high);
            let (a, b) = (line.axis(), 1 - line.axis());
            for k in parts.clone().step_by(LANES) {
                let part: Parts<L> = line.parts(k, edge, end);
                // From one row and column before the window to one behind it; it begins at the second row of the taps.
                let along = (part.along - L::splat(low[a])).max(L::splat(-1.0)).min(L::splat(size[a]));
                let across = (part.across - L::splat(low[b])).max(L::splat(-1.0)).min(L::splat(size[b]));
                let at = along * L::splat(STRIDE[a]) + across * L::splat(STRIDE[b]) + L::splat(STRIDE[1]);
                // What lies before both the first row and the first column counts nowhere, as the row before the window.
                at.max(zero).whole().store(&mut place);
                for (depth, behind) in depth.iter_mut().zip(behind) {
                    // All of what lies before the plane; of linear optical depth f of what lies between it and the next.
                    let beyond = if PLANES == 1 { L::if_gt(next, part.row, f, zero) } else { zero };
                    (part.depth * L::if_gt(L::splat(behind), part.row, one, beyond)).write(depth);
                }
                for i in 0..(parts.end - k).min(LANES) {
                    for (depth, taps) in depth.iter().zip(&mut taps.0) {
                        taps[place[i] as usize] -= depth[i];
                    }
                }
            }
        }
    }

    /// The first row behind each of the planes that are read.
    #[inline(always)]
    fn behind<const PLANES: usize>(&self) -> [f32; 4] {
        let first = self.plane as isize - isize::from(PLANES == 4);
        std::array::from_fn(|p| self.slices.behind(first + p as isize))
    }
}

/// Sum in a fixed order.
#[inline(always)]
fn total(mut v: [f32; LANES]) -> f32 {
    let mut n = LANES / 2;
    while n > 0 {
        for i in 0..n {
            v[i] += v[i + n];
        }
        n /= 2;
    }
    v[0]
}

/// Sixteen numbers from `start` on.
#[inline(always)]
fn lanes(v: &[f32], start: usize) -> &[f32; LANES] {
    v[start..].first_chunk().expect("room behind the last row")
}

#[inline(always)]
fn lanes_mut(v: &mut [f32], start: usize) -> &mut [f32; LANES] {
    v[start..].first_chunk_mut().expect("room behind the last row")
}

/// Catmull-Rom between `b` and `c`, kept between them: optical depth never falls along a ray.
#[inline(always)]
fn cubic<L: Lanes>(a: L, b: L, c: L, d: L, t: L) -> L {
    let half = L::splat(0.5);
    let m0 = (c - a) * half;
    let m1 = (d - b) * half;
    let rise = c - b;
    let two = L::splat(2.0);
    let three = L::splat(3.0);
    let v = b + t * (m0 + t * (three * rise - two * m0 - m1 + t * (m0 + m1 - two * rise)));
    v.max(b.min(c)).min(b.max(c))
}
