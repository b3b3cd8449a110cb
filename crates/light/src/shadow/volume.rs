//! Optical depth of one tile in slices.

use super::TILE;
use super::exp::exp_neg;
use super::line::Line;
use super::settings::Interpolation;
use wide::f32x4;

/// Taps of the widest filter along a side, a multiple of 4.
pub(crate) const TAPS: usize = 20;

/// Optical depth that counts as no light: 6e-6 of it is left. Lower, the sum of what is lost shows in the mean.
const DARK: f32 = 12.0;

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
        let inverse = f32x4::splat(1.0 / filter);
        let place = |v: f32, weight: &mut [f32; TAPS]| {
            let (low, high) = (v - 0.5 * filter, v + 0.5 * filter);
            let first = low as i32;
            let taps = ((high as i32 - first + 1) as usize).min(TAPS - 3);
            let (low, high) = (f32x4::splat(low), f32x4::splat(high));
            let mut at = f32x4::splat(first as f32) + f32x4::new([0.0, 1.0, 2.0, 3.0]);
            for quad in weight.chunks_exact_mut(4).take(taps.div_ceil(4)) {
                let cover = (at + f32x4::ONE).fast_min(high) - at.fast_max(low);
                quad.copy_from_slice(&(cover.fast_max(f32x4::ZERO) * inverse).to_array());
                at += f32x4::splat(4.0);
            }
            (first, taps)
        };
        (self.x, self.across) = place(x, &mut self.weight[0]);
        (self.y, self.down) = place(y, &mut self.weight[1]);
    }
}

/// The lines of one hair.
pub(crate) struct Own<'a> {
    lines: &'a [Line],
    /// Optical depth, the hair's own included, from which on no light is left.
    dark: f32,
}

impl<'a> Own<'a> {
    pub fn new(lines: &'a [Line]) -> Own<'a> {
        Own { lines, dark: DARK + lines.iter().map(Line::most).sum::<f32>() }
    }
}

/// Optical depth in the texels of a window, row by row without gaps, at each of the planes that are interpolated. Behind
/// them a quad may jut out by three, and four more stand for what lies outside.
pub(crate) struct Taps([[f32; TAPS * TAPS + 8]; 4]);

impl Taps {
    pub fn new() -> Taps {
        Taps([[0.0; TAPS * TAPS + 8]; 4])
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
        line.places(size, |places, parts| {
            for (p, d) in places.into_iter().zip(parts) {
                depth[p as usize] += d;
            }
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

    /// Mean transmittance over a window at slice coordinate `s` in [0, slices], without what the lines of the hair itself
    /// take. The mean is over transmittance, as a footprint's is: of mean optical depth it would be too dark, at the
    /// default by 0.017 in long hair and 0.027 in fur.
    #[inline]
    pub fn sample(&self, window: &Window, s: f32, own: &Own, taps: &mut Taps, interpolation: Interpolation) -> f32 {
        match interpolation {
            Interpolation::OpticalDepth => self.sample_as::<1>(window, s, own, taps),
            Interpolation::Transmittance => self.sample_as::<2>(window, s, own, taps),
            Interpolation::Cubic => self.sample_as::<4>(window, s, own, taps),
        }
    }

    /// [`Volume::sample`] with optical depth kept apart at this many planes: 1 for linear optical depth, 2 for linear
    /// transmittance, 4 for the cubic.
    #[inline]
    fn sample_as<const PLANES: usize>(&self, window: &Window, s: f32, own: &Own, taps: &mut Taps) -> f32 {
        let (plane, f) = self.plane(s);
        let f4 = f32x4::splat(f);
        let (across, count) = (window.across, window.across * window.down);
        let least = self.read::<PLANES>(window, plane, f4, taps);
        if PLANES == 1 && least > own.dark {
            return 0.0;
        }
        self.take::<PLANES>(window, plane, f4, own.lines, taps);
        let taps = &mut taps.0;
        for k in (0..count).step_by(4) {
            let at = |p: usize| quad(&taps[p], k);
            let light = match PLANES {
                1 => exp_neg(at(0)),
                2 => {
                    let (a, b) = (exp_neg(at(0)), exp_neg(at(1)));
                    a + (b - a) * f4
                }
                _ => exp_neg(cubic(at(0), at(1), at(2), at(3), f4)),
            };
            taps[0][k..k + 4].copy_from_slice(&light.to_array());
        }
        // What juts out of a row is some light with weight 0.
        let mut sum = f32x4::ZERO;
        for (row, weight) in window.weight[1][..window.down].iter().enumerate() {
            let mut line = f32x4::ZERO;
            for x in (0..across).step_by(4) {
                line += quad(&taps[0], row * across + x) * quad(&window.weight[0], x);
            }
            sum += line * f32x4::splat(*weight);
        }
        let [a, b, c, d] = sum.to_array();
        ((a + b) + (c + d)).clamp(0.0, 1.0)
    }

    /// Fills the taps; the least of them.
    #[inline]
    fn read<const PLANES: usize>(&self, window: &Window, plane: usize, f: f32x4, taps: &mut Taps) -> f32 {
        let layer = self.stride * self.side;
        let corner = window.y as usize * self.stride + window.x as usize;
        let mut least = f32x4::splat(f32::MAX);
        for row in 0..window.down {
            for x in (0..window.across).step_by(4) {
                let at = |p: usize| quad(&self.depth, p * layer + corner + row * self.stride + x);
                let to = row * window.across + x;
                let mut put = |k: usize, v: f32x4| taps.0[k][to..to + 4].copy_from_slice(&v.to_array());
                let (a, b) = (at(plane), at(plane + 1));
                match PLANES {
                    1 => {
                        let v = a + (b - a) * f;
                        least = least.fast_min(v);
                        put(0, v);
                    }
                    2 => {
                        put(0, a);
                        put(1, b);
                    }
                    _ => {
                        put(0, if plane > 0 { at(plane - 1) } else { a });
                        put(1, a);
                        put(2, b);
                        put(3, if plane + 2 <= self.slices { at(plane + 2) } else { b });
                    }
                }
            }
        }
        let [a, b, c, d] = least.to_array();
        a.min(b).min(c.min(d))
    }

    /// Takes the hair's own lines out of the taps.
    #[inline]
    fn take<const PLANES: usize>(&self, window: &Window, plane: usize, f: f32x4, own: &[Line], taps: &mut Taps) {
        let low = [window.x as f32, window.y as f32];
        let size = [window.across as f32, window.down as f32];
        let around = f32x4::new([low[0] + size[0], low[1] + size[1], -low[0], -low[1]]);
        let seen = f32x4::splat(plane as f32 + 1.0) + f;
        for line in own.iter().filter(|l| !l.misses(around)) {
            line.places_within(low, size, [self.side, self.slices + 1], |places, z, depth| {
                for (k, taps) in taps.0[..PLANES].iter_mut().enumerate() {
                    let part = if PLANES == 1 {
                        // All of what lies before the plane, f of what lies between it and the next.
                        (seen - z).fast_max(f32x4::ZERO).fast_min(f32x4::ONE)
                    } else {
                        let first = if PLANES == 2 { plane as f32 } else { plane as f32 - 1.0 };
                        // What stands for a plane that is not there is the one next to it.
                        let at = (first + k as f32).clamp(0.0, self.slices as f32);
                        (f32x4::splat(at + 1.0) - z).fast_max(f32x4::ZERO).fast_min(f32x4::ONE)
                    };
                    for (p, d) in places.into_iter().zip((part * depth).to_array()) {
                        taps[p as usize] -= d;
                    }
                }
            });
        }
    }

    /// Plane before slice coordinate `s`, and how far between it and the next.
    #[inline]
    pub fn plane(&self, s: f32) -> (usize, f32) {
        let s = s.clamp(0.0, self.slices as f32);
        let p = (s as usize).min(self.slices - 1);
        (p, s - p as f32)
    }
}

/// Four numbers from `start` on.
#[inline(always)]
fn quad(v: &[f32], start: usize) -> f32x4 {
    f32x4::from(<[f32; 4]>::try_from(&v[start..start + 4]).unwrap_or_default())
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
