//! Optical depth of one tile in slices.

use super::TILE;
use super::exp::exp_neg;
use super::line::Line;
use super::settings::Interpolation;
use wide::{f32x4, i32x4};

/// Taps of the widest filter along a side, a multiple of 4.
pub(crate) const TAPS: usize = 20;

/// Layers of texels: layer 0 holds what lies before the first slice plane, layer k what lies between planes k - 1 and
/// k, and the last one what lies beyond the last plane. After [`Volume::sum`] layer k is what lies before plane k.
pub(crate) struct Volume {
    /// Texels along a side, with the border.
    side: usize,
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

impl Window {
    pub fn new() -> Window {
        Window { x: 0, y: 0, across: 0, down: 0, weight: [[0.0; TAPS]; 2] }
    }

    /// Moves to the square of side `filter` around (x, y).
    #[inline]
    pub fn put(&mut self, x: f32, y: f32, filter: f32) {
        let inverse = 1.0 / filter;
        let place = |v: f32, weight: &mut [f32; TAPS]| {
            let (low, high) = (v - 0.5 * filter, v + 0.5 * filter);
            let first = low as i32;
            let taps = ((high as i32 - first + 1) as usize).min(TAPS - 3);
            for (k, weight) in weight[..taps.next_multiple_of(4)].iter_mut().enumerate() {
                let at = (first + k as i32) as f32;
                *weight = ((at + 1.0).min(high) - at.max(low)).max(0.0) * inverse;
            }
            (first, taps)
        };
        (self.x, self.across) = place(x, &mut self.weight[0]);
        (self.y, self.down) = place(y, &mut self.weight[1]);
    }

    /// Its texels as a box.
    #[inline]
    fn bounds(&self) -> ([f32; 2], [f32; 2]) {
        let low = [self.x as f32, self.y as f32];
        (low, [low[0] + self.across as f32, low[1] + self.down as f32])
    }
}

/// Optical depth that the hair itself puts into the window of one of its points, for the planes that are interpolated.
pub(crate) struct Own([[f32; TAPS * TAPS]; 4]);

impl Own {
    pub fn new() -> Own {
        Own([[0.0; TAPS * TAPS]; 4])
    }

    #[inline]
    pub fn clear(&mut self, window: &Window, interpolation: Interpolation) {
        let quads = window.across.div_ceil(4) * 4;
        for plane in &mut self.0[..planes(interpolation)] {
            for row in plane.chunks_exact_mut(TAPS).take(window.down) {
                row[..quads].fill(0.0);
            }
        }
    }

    /// Adds a line of the hair for a point at `f` between planes `plane` and `plane` + 1. What is outside the window
    /// goes to where no weight is.
    #[inline]
    pub fn add(&mut self, window: &Window, line: &Line, plane: i32, f: f32, interpolation: Interpolation) {
        let (low, high) = window.bounds();
        let end = [window.across, window.down].map(|n| n as f32);
        for k in line.within(low, high).step_by(4) {
            let [x, y, z, depth] = line.quad(k, low, end);
            let place: i32x4 = (y * f32x4::splat(TAPS as f32) + x).fast_trunc_int();
            if interpolation == Interpolation::OpticalDepth {
                // All of what lies before the plane, f of what lies between it and the next.
                let seen = f32x4::splat(plane as f32 + 1.0 + f) - z;
                let seen = (seen.fast_max(f32x4::ZERO).fast_min(f32x4::ONE) * depth).to_array();
                for (p, d) in place.to_array().into_iter().zip(seen) {
                    self.0[0][p as usize] += d;
                }
                continue;
            }
            let first = if interpolation == Interpolation::Cubic { plane - 1 } else { plane };
            for ((p, z), d) in place.to_array().into_iter().zip(z.to_array()).zip(depth.to_array()) {
                for (k, own) in self.0[..planes(interpolation)].iter_mut().enumerate() {
                    if z <= (first + k as i32) as f32 {
                        own[p as usize] += d;
                    }
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

    /// Texels along a side, with the border.
    pub fn side(&self) -> usize {
        self.side
    }

    /// Adds a line.
    #[inline]
    pub fn add(&mut self, line: &Line) {
        let depth = &mut self.depth[..];
        let size = [self.side, self.stride, self.stride * self.side, self.slices + 1];
        line.places(size, |p| depth[p] += line.each);
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

    /// Mean transmittance over a window at slice coordinate `s` in [0, slices], without what the hair itself takes. The mean
    /// is over transmittance, as a footprint's is: of mean optical depth it would be too dark, at the default by 0.017 in
    /// long hair and 0.027 in fur.
    #[inline]
    pub fn sample(&self, window: &Window, s: f32, own: &Own, interpolation: Interpolation) -> f32 {
        let (plane, f) = self.plane(s);
        let layer = self.stride * self.side;
        let corner = window.y as usize * self.stride + window.x as usize;
        let f4 = f32x4::splat(f);
        let row_of =
            |v: &[f32], start: usize| f32x4::from(<[f32; 4]>::try_from(&v[start..start + 4]).unwrap_or_default());
        let mut sum = f32x4::ZERO;
        for row in 0..window.down {
            let mut line = f32x4::ZERO;
            for x in (0..window.across).step_by(4) {
                let light = shade(
                    interpolation,
                    plane,
                    self.slices,
                    f4,
                    |p| row_of(&self.depth, p * layer + corner + row * self.stride + x),
                    |k| row_of(&own.0[k], row * TAPS + x),
                );
                line += light * row_of(&window.weight[0], x);
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

/// Transmittance of four texels at `f` after `plane`, from the depths at planes and what of them is the hair's own.
#[inline(always)]
fn shade(
    interpolation: Interpolation,
    plane: usize,
    slices: usize,
    f: f32x4,
    at: impl Fn(usize) -> f32x4,
    own: impl Fn(usize) -> f32x4,
) -> f32x4 {
    let (a, b) = (at(plane), at(plane + 1));
    match interpolation {
        Interpolation::OpticalDepth => exp_neg(a + (b - a) * f - own(0)),
        Interpolation::Transmittance => {
            let (a, b) = (exp_neg(a - own(0)), exp_neg(b - own(1)));
            a + (b - a) * f
        }
        Interpolation::Cubic => {
            let (a, b) = (a - own(1), b - own(2));
            let before = if plane > 0 { at(plane - 1) - own(0) } else { a };
            let after = if plane + 2 <= slices { at(plane + 2) - own(3) } else { b };
            exp_neg(cubic(before, a, b, after, f))
        }
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
