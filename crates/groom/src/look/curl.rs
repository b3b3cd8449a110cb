//! Curls: offsets across the hair as functions of its arc length (sparse-guide-hairs paper §2.4.1, equations 3 and 4).
//!
//! `Wave(t) = Mag(t) sin(2 pi (R t + P0) t + phi0) + Bias` and
//! `Mag(t) = A + B t exp(-alpha t) + C (1 - exp(-beta t)) + D exp(gamma (t - t0))`, one for each of the two axes across the
//! hair; t is the arc length. As printed the function does not vanish at the root: it is faded in there.

use super::axes::{Beside, RootAxes};
use super::lanes::{Block, F, LANES, below, sin_cos_turn};
use super::{CHUNK, Param, lanes};
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

    /// Turns at arc length `t` without the wave's own phase, the frequency growing by `tighten` a pitch.
    #[inline(always)]
    fn turns(&self, t: F, tighten: F) -> F {
        (F::splat(self.r) * t + F::splat(self.p0) * (F::splat(1.0) + tighten * t)) * t
    }

    /// Wave at arc length `t` where the sine and cosine of its turns are known.
    #[inline(always)]
    fn at(&self, t: F, (sin, cos): (F, F), (own_sin, own_cos): (f32, f32)) -> F {
        let only_a = self.b == 0.0 && self.c == 0.0 && self.d == 0.0;
        let magnitude = if only_a { F::splat(self.a) } else { F::from(t.to_array().map(|t| self.magnitude(t))) };
        magnitude * (sin * F::splat(own_cos) + cos * F::splat(own_sin)) + F::splat(self.bias)
    }

    /// No offset.
    pub const NONE: Wave = Wave {
        a: 0.0,
        b: 0.0,
        alpha: 0.0,
        c: 0.0,
        beta: 0.0,
        d: 0.0,
        gamma: 0.0,
        t0: 0.0,
        r: 0.0,
        p0: 0.0,
        phase: 0.0,
        bias: 0.0,
    };

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
        for (b, hairs) in out.chunks_mut(LANES * points).enumerate() {
            let lane = lanes(chunk * CHUNK + b * LANES, hairs.len() / points);
            let own = Own::new(c, lane, &profile);
            let active: [bool; LANES] = lane.map(|h| c.radius.of(h) != 0.0 && c.pitch.of(h) > 0.0);
            if active == [false; LANES] {
                continue;
            }
            s.block.load(points, hairs);
            if c.keep_length {
                own.curl_keeping(&mut s, points, hairs);
            } else {
                s.along.set(&s.block, own.root);
                own.displace(&s.along, &mut s.block);
            }
            s.block.store(points, active, hairs);
        }
    });
}

/// Relative error of length that is left to the end, where hairs are scaled about their roots: this much of a radius does
/// not show.
const CLOSE: f32 = 5e-3;

/// Times that a hair is curled at most: again only where bends of its middle line made it longer or shorter than reckoned
/// for a straight one.
const TRIES: usize = 3;

#[derive(Default)]
struct Scratch {
    along: Beside,
    block: Block,
    cut: Vec<[f32; 3]>,
}

/// Parameters of hairs side by side.
struct Own<'a> {
    curl: &'a Curl<'a>,
    root: [&'a RootAxes; LANES],
    profile: &'a [f32],
    radius: F,
    per_unit: F,
    phase: F,
    tighten: F,
    plane: (F, F),
    /// Sine and cosine of the waves' own phases.
    own: [(f32, f32); 2],
}

impl<'a> Own<'a> {
    fn new(c: &'a Curl<'a>, lane: [usize; LANES], profile: &'a [f32]) -> Self {
        let of = |p: &Param| F::from(lane.map(|h| p.of(h)));
        Own {
            curl: c,
            root: lane.map(|h| &c.axes[h]),
            profile,
            radius: of(&c.radius),
            per_unit: F::splat(1.0) / of(&c.pitch),
            phase: of(&c.phase),
            tighten: of(&c.tighten),
            plane: sin_cos_turn(of(&c.angle)),
            own: [0, 1].map(|a| libm::sincosf(std::f32::consts::TAU * c.wave[a].phase)),
        }
    }

    /// Growth of the frequency a pitch, for hairs of that length.
    fn tightening(&self, length: F) -> F {
        let tip = length * self.per_unit;
        let share = F::splat(0.5) * self.tighten / tip;
        F::splat(0.0).max(share).min(F::splat(f32::MAX))
    }

    /// Offsets along the two axes at point `k`, at arc length `arc`.
    #[inline(always)]
    fn offset(&self, k: usize, arc: F, tighten: F) -> [F; 2] {
        let (one, t) = (F::splat(1.0), arc * self.per_unit);
        let c = self.curl;
        let f = if c.start > 0.0 { (t * F::splat(1.0 / c.start)).fast_min(one) } else { one };
        let size = self.radius * f * f * (F::splat(3.0) - f - f) * F::splat(*self.profile.get(k).unwrap_or(&1.0));
        let [wx, wy] = &c.wave;
        let turn = |w: &Wave| sin_cos_turn(w.turns(t, tighten) + self.phase);
        let first = turn(wx);
        let x = size * wx.at(t, first, self.own[0]);
        let y = match () {
            () if *wy == Wave::NONE => F::splat(0.0),
            // One sine does for both.
            () if wx.p0 == wy.p0 && wx.r == wy.r => size * wy.at(t, first, self.own[1]),
            () => size * wy.at(t, turn(wy), self.own[1]),
        };
        let (sin, cos) = self.plane;
        [x * cos - y * sin, x * sin + y * cos]
    }

    /// Adds the offsets to hairs whose axes are `along`.
    fn displace(&self, along: &Beside, hairs: &mut Block) {
        let tighten = self.tightening(along.arc[hairs.point.len() - 1]);
        for (k, p) in hairs.point.iter_mut().enumerate().skip(1) {
            let [u, v] = self.offset(k, along.arc[k], tighten);
            *p = *p + along.normal[k].times(u) + along.binormal[k].times(v);
        }
    }

    /// Length of curled hairs whose middle line is straight and ends at a share of itself.
    fn reckoned(&self, arc: &[F], share: F) -> F {
        let tighten = self.tightening(arc[arc.len() - 1] * share);
        let (mut sum, mut before, mut at) = (F::splat(0.0), [F::splat(0.0); 2], F::splat(0.0));
        for (k, arc) in arc.iter().enumerate().skip(1) {
            let (o, t) = (self.offset(k, *arc * share, tighten), *arc * share);
            let [dx, dy, dz] = [o[0] - before[0], o[1] - before[1], t - at];
            sum += (dx * dx + dy * dy + dz * dz).sqrt();
            (before, at) = (o, t);
        }
        sum
    }

    /// Share of the middle line at which curled hairs are as long as it is, reckoned as if it were straight: the length is
    /// nearly linear in the share, so the line through two shares finds it (to 1e-3 for curls that fade in over a tenth of
    /// the hair).
    fn share(&self, arc: &[F], total: F) -> F {
        let one = F::splat(1.0);
        let whole = self.reckoned(arc, one);
        let first = within_one(total / whole);
        let less = self.reckoned(arc, first);
        let slope = (whole - less) / (one - first);
        let second = first + (total - less) / slope;
        // No curls: no slope.
        within_one(below(first, F::splat(0.999_9)).bitselect(second, first))
    }

    /// Curls hairs so that they stay as long as they are: their middle lines end earlier.
    fn curl_keeping(&self, s: &mut Scratch, points: usize, hairs: &[[f32; 3]]) {
        s.along.set_arc(&s.block);
        let arc = std::mem::take(&mut s.along.arc);
        let total = arc[points - 1];
        let mut share = self.share(&arc, total);
        let mut curled = total;
        for _ in 0..TRIES {
            cut(points, hairs, &arc, share, &mut s.cut);
            s.block.load(points, &s.cut);
            s.along.set(&s.block, self.root);
            self.displace(&s.along, &mut s.block);
            curled = s.block.length();
            let off = ((curled - total) / total).abs();
            let far = below(F::splat(CLOSE), off);
            if !far.any() {
                break;
            }
            // Hairs that are near keep their share: what a hair gets does not depend on those beside it.
            share = far.bitselect(within_one(share * total / curled), share);
        }
        let one = F::splat(1.0);
        s.along.arc = arc;
        let scale = below(F::splat(0.0), curled).bitselect(total / curled, one);
        let root = s.block.point[0];
        s.block.point.iter_mut().for_each(|p| *p = root + (*p - root).times(scale));
    }
}

/// A share of 0 to 1; 1 for what is none.
fn within_one(share: F) -> F {
    below(F::splat(0.0), share).bitselect(share.fast_min(F::splat(1.0)), F::splat(1.0))
}

/// The first `share` of each hair, its points in the same shares of its length. `arc` has the length up to each point.
fn cut(points: usize, hairs: &[[f32; 3]], arc: &[F], share: F, out: &mut Vec<[f32; 3]>) {
    out.clear();
    let share = share.to_array();
    for (l, hair) in hairs.chunks_exact(points).enumerate() {
        let share = share[l];
        let arc = |k: usize| arc[k].as_array()[l];
        let mut k = 0;
        out.push(hair[0]);
        for i in 1..points {
            let target = arc(i) * share;
            while k + 2 < points && arc(k + 1) < target {
                k += 1;
            }
            let side = arc(k + 1) - arc(k);
            let t = if side > 0.0 { ((target - arc(k)) / side).min(1.0) } else { 0.0 };
            let (a, b) = (hair[k], hair[k + 1]);
            out.push([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t]);
        }
    }
}
