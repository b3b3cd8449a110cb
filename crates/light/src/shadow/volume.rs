//! Optical depth of one tile in slices.

use super::TILE;
use super::exp::exp_neg;
use super::line::Line;
use super::settings::Interpolation;
use wide::f32x4;

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

    /// Its texels as a box.
    #[inline]
    fn bounds(&self) -> ([f32; 2], [f32; 2]) {
        let low = [self.x as f32, self.y as f32];
        (low, [low[0] + self.across as f32, low[1] + self.down as f32])
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

    /// Adds a line of the hair for a point at `f` between planes `plane` and `plane` + 1. What is outside the window
    /// goes to where no weight is.
    #[inline]
    pub fn add(&mut self, window: &Window, line: &Line, plane: i32, f: f32, interpolation: Interpolation) {
        let (low, high) = window.bounds();
        let place = |p: [i32; 3]| {
            let x = ((p[0] - window.x) as u32).min(window.across as u32) as usize;
            let y = ((p[1] - window.y) as u32).min(window.down as u32) as usize;
            (x, y)
        };
        for k in line.within(low, high) {
            let p = line.at(k);
            let (x, y) = place(p);
            if interpolation == Interpolation::OpticalDepth {
                let seen = if p[2] <= plane { 1.0 } else { f };
                let seen = if p[2] <= plane + 1 { seen } else { 0.0 };
                self.0[0][y][x] += line.each * seen;
                continue;
            }
            let first = if interpolation == Interpolation::Cubic { plane - 1 } else { plane };
            for (k, own) in self.0[..planes(interpolation)].iter_mut().enumerate() {
                if p[2] <= first + k as i32 {
                    own[y][x] += line.each;
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
                        let c =
                            at(after, row, x) - if plane + 2 <= self.slices { own(3, row, x) } else { own(2, row, x) };
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
