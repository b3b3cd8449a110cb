//! Curls: offsets across the hair as functions of its arc length (sparse-guide-hairs paper §2.4.1, equations 3 and 4).
//!
//! `Wave(t) = Mag(t) sin(2 pi (R t + P0) t + phi0) + Bias` and
//! `Mag(t) = A + B t exp(-alpha t) + C (1 - exp(-beta t)) + D exp(gamma (t - t0))`, one for each of the two axes across the
//! hair; t is the arc length. As printed the function does not vanish at the root: it is faded in there.

use super::axes::{Along, RootAxes};
use super::turn::sin_cos_turn;
use super::{CHUNK, Param, V3, lengths};
use crate::along::at_points;
use rayon::prelude::*;

/// Offset along one axis. Lengths in radii, arc length in pitches: with radius and pitch 1 those of the paper, in scene
/// units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wave {
    /// A: magnitude at the root.
    pub a: f32,
    /// B: a bulge, greatest at `1 / alpha`.
    pub b: f32,
    /// alpha.
    pub alpha: f32,
    /// C: what the magnitude gains along the hair.
    pub c: f32,
    /// beta: how soon.
    pub beta: f32,
    /// D: growth at the end of the hair.
    pub d: f32,
    /// gamma: how steep.
    pub gamma: f32,
    /// t0: from where on.
    pub t0: f32,
    /// R: the local frequency is `2 R t + P0`.
    pub r: f32,
    /// P0: waves a pitch at the root.
    pub p0: f32,
    /// phi0, turns.
    pub phase: f32,
    /// Bias.
    pub bias: f32,
}

impl Wave {
    /// Mag at arc length `t`.
    #[inline(always)]
    pub fn magnitude(&self, t: f32) -> f32 {
        let mut m = self.a;
        // Presets have only A.
        if self.b != 0.0 {
            m += self.b * t * libm::expf(-self.alpha * t);
        }
        if self.c != 0.0 {
            m += self.c * (1.0 - libm::expf(-self.beta * t));
        }
        if self.d != 0.0 {
            m += self.d * libm::expf(self.gamma * (t - self.t0));
        }
        m
    }

    /// Wave at arc length `t`, its phase `phase` turns ahead, its frequency growing by `tighten` at the tip, at `tip`.
    #[inline(always)]
    fn at(&self, t: f32, phase: f32, tighten: f32) -> f32 {
        if *self == Wave::NONE {
            return 0.0;
        }
        let turns = (self.r * t + self.p0 * (1.0 + tighten * t)) * t + self.phase + phase;
        self.magnitude(t) * sin_cos_turn(turns).0 + self.bias
    }

    /// No offset.
    pub const NONE: Wave =
        Wave { a: 0.0, b: 0.0, alpha: 0.0, c: 0.0, beta: 0.0, d: 0.0, gamma: 0.0, t0: 0.0, r: 0.0, p0: 0.0, phase: 0.0, bias: 0.0 };

    const SINE: Wave = Wave { a: 1.0, p0: 1.0, ..Wave::NONE };
}

/// The three natural types of hair waves (paper §2.4.1), in radii and pitches: offsets along x and y.
pub fn uniplanar() -> [Wave; 2] {
    [Wave::SINE, Wave::NONE]
}

/// A circle around the hair.
pub fn helix() -> [Wave; 2] {
    [Wave { phase: 0.25, ..Wave::SINE }, Wave::SINE]
}

/// A wave over half a cylinder: along y always to one side, at half the period, `depth` radii deep.
pub fn dished(depth: f32) -> [Wave; 2] {
    [Wave::SINE, Wave { a: 0.5 * depth, p0: 2.0, phase: -0.25, bias: 0.5 * depth, ..Wave::NONE }]
}

/// Curls of a layer.
#[derive(Clone, Debug)]
pub struct Curl<'a> {
    /// Offsets along x and y.
    pub wave: [Wave; 2],
    /// Unit of the offsets, scene units.
    pub radius: Param<'a>,
    /// Unit of the arc length, scene units: for the presets, the length of a turn along the hair.
    pub pitch: Param<'a>,
    /// Added to the phases, turns.
    pub phase: Param<'a>,
    /// Turns of the plane of the wave about the hair.
    pub angle: Param<'a>,
    /// How much tighter turns are at the tip than at the root: 1 means half as long.
    pub tighten: Param<'a>,
    /// Part of the hair's length over which curls fade in from the root, in pitches.
    pub start: f32,
    /// Factors on the offsets at equally spaced stations from root to tip (at least two); empty for 1.
    pub profile: &'a [f32],
    /// Keep the hair's length: a curled hair ends earlier along its middle line. Else curls make hair longer.
    pub keep_length: bool,
    /// \[N\] axes of the roots.
    pub axes: &'a [RootAxes],
}

/// Curls hairs of `points` points. Roots stay; a hair of radius 0 keeps its bytes.
pub fn curl(points: usize, c: &Curl, position: &mut [[f32; 3]]) {
    let profile = at_points(c.profile, points);
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, out)| {
        let mut s = Scratch::default();
        for (h, hair) in (chunk * CHUNK..).zip(out.chunks_exact_mut(points)) {
            let own = Own::new(c, h);
            if own.radius == 0.0 || own.pitch <= 0.0 {
                continue;
            }
            if !c.keep_length {
                own.displace(c, h, &profile, hair, &mut s.along);
                continue;
            }
            s.spine.clear();
            s.spine.extend_from_slice(hair);
            lengths(hair, &mut s.length);
            let total: f32 = s.length.iter().sum();
            own.displace(c, h, &profile, hair, &mut s.along);
            // Cut the middle line until the curled hair is as long as the straight one was.
            let (mut share, mut curled) = (1.0f32, arc_length(hair));
            for _ in 0..SHORTENINGS {
                if !curled.is_finite() || (curled - total).abs() <= total * CLOSE {
                    break;
                }
                share = (share * total / curled).min(1.0);
                shortened(&s.spine, &s.length, share * total, hair);
                own.displace(c, h, &profile, hair, &mut s.along);
                curled = arc_length(hair);
            }
            if curled > 0.0 {
                let (root, scale) = (hair[0], total / curled);
                let from_root = |p: &[f32; 3]| std::array::from_fn(|x| root[x] + (p[x] - root[x]) * scale);
                hair[1..].iter_mut().for_each(|p| *p = from_root(p));
            }
        }
    });
}

fn arc_length(hair: &[[f32; 3]]) -> f32 {
    hair.windows(2).map(|w| (V3::from(w[1]) - V3::from(w[0])).norm()).sum()
}

/// Rounds of shortening: each leaves about a tenth of the error before it.
const SHORTENINGS: usize = 4;

/// Relative error of length that is left to the last step, which scales the hair about its root: a thousandth does not
/// show in a radius.
const CLOSE: f32 = 1e-3;

#[derive(Default)]
struct Scratch {
    along: Along,
    spine: Vec<[f32; 3]>,
    length: Vec<f32>,
}

/// The first `length` of a polyline, its points in the same shares.
fn shortened(spine: &[[f32; 3]], segment: &[f32], length: f32, out: &mut [[f32; 3]]) {
    let total: f32 = segment.iter().sum();
    let (mut k, mut arc, mut target) = (0, 0.0f32, 0.0f32);
    for i in 1..out.len() {
        target += segment[i - 1] * (length / total);
        while k + 1 < segment.len() && arc + segment[k] < target {
            arc += segment[k];
            k += 1;
        }
        let t = if segment[k] > 0.0 { (target - arc) / segment[k] } else { 0.0 };
        out[i] = std::array::from_fn(|x| spine[k][x] + (spine[k + 1][x] - spine[k][x]) * t);
    }
}

/// Parameters of one hair.
struct Own {
    radius: f32,
    pitch: f32,
    phase: f32,
    angle: f32,
    tighten: f32,
}

impl Own {
    fn new(c: &Curl, h: usize) -> Self {
        Own {
            radius: c.radius.of(h),
            pitch: c.pitch.of(h),
            phase: c.phase.of(h),
            angle: c.angle.of(h),
            tighten: c.tighten.of(h),
        }
    }

    /// Adds the offsets to a hair.
    fn displace(&self, c: &Curl, h: usize, profile: &[f32], hair: &mut [[f32; 3]], along: &mut Along) {
        along.set(hair, &c.axes[h]);
        let per_unit = 1.0 / self.pitch;
        let tip = along.arc[hair.len() - 1] * per_unit;
        let tighten = if tip > 0.0 { 0.5 * self.tighten / tip } else { 0.0 };
        let (sin, cos) = sin_cos_turn(self.angle);
        let rise = if c.start > 0.0 { 1.0 / c.start } else { f32::INFINITY };
        for k in 1..hair.len() {
            let t = along.arc[k] * per_unit;
            let f = (t * rise).min(1.0);
            let size = self.radius * f * f * (3.0 - 2.0 * f) * profile.get(k).unwrap_or(&1.0);
            let x = size * c.wave[0].at(t, self.phase, tighten);
            let y = size * c.wave[1].at(t, self.phase, tighten);
            let (u, v) = (x * cos - y * sin, x * sin + y * cos);
            let (n, b) = (along.normal[k], along.tangent[k].cross(&along.normal[k]));
            hair[k] = (V3::from(hair[k]) + n * u + b * v).into();
        }
    }
}
