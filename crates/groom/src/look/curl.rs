//! Curls: offsets across the hair as functions of its arc length (sparse-guide-hairs paper §2.4.1, equations 3 and 4).
//!
//! `Wave(t) = Mag(t) sin(2 pi (R t + P0) t + phi0) + Bias` and
//! `Mag(t) = A + B t exp(-alpha t) + C (1 - exp(-beta t)) + D exp(gamma (t - t0))`, one for each of the two axes across the
//! hair; t is the arc length. As printed the function does not vanish at the root: it is faded in there.

use super::axes::{Beside, RootAxes};
use super::lanes::{Bits, Block, Group, Kernel, LANES, Lanes, Pack, V, run, sin_cos_turn};
use super::{CHUNK, Param};
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
    fn turns<L: Lanes>(&self, t: L, tighten: L) -> L {
        (L::splat(self.r) * t + L::splat(self.p0) * (L::splat(1.0) + tighten * t)) * t
    }

    /// Wave at arc length `t` where the sine and cosine of its turns are known.
    #[inline(always)]
    fn at<L: Lanes>(&self, t: L, (sin, cos): (L, L), (own_sin, own_cos): (f32, f32)) -> L {
        let only_a = self.b == 0.0 && self.c == 0.0 && self.d == 0.0;
        let mut magnitude = L::splat(self.a);
        if !only_a {
            let mut m = Pack::default();
            t.store(&mut m);
            m.0.iter_mut().for_each(|t| *t = self.magnitude(*t));
            magnitude = L::load(&m);
        }
        magnitude * (sin * L::splat(own_cos) + cos * L::splat(own_sin)) + L::splat(self.bias)
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
    let own = [0, 1].map(|a| libm::sincosf(std::f32::consts::TAU * c.wave[a].phase));
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, hairs)| {
        run(Chunk { curl: c, own, profile: &profile, points, first: chunk * CHUNK, hairs });
    });
}

/// Relative error of length that is left to the end, where hairs are scaled about their roots: this much of a radius does
/// not show.
const CLOSE: f32 = 5e-3;

/// Times that a hair is curled at most: again only where bends of its middle line made it longer or shorter than reckoned
/// for a straight one.
const TRIES: usize = 3;

/// Hairs that one task curls.
struct Chunk<'a> {
    curl: &'a Curl<'a>,
    /// Sine and cosine of the waves' own phases.
    own: [(f32, f32); 2],
    profile: &'a [f32],
    points: usize,
    /// The first hair's index.
    first: usize,
    hairs: &'a mut [[f32; 3]],
}

impl Kernel for Chunk<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (c, points, first) = (self.curl, self.points, self.first);
        let curls = |h: &usize| c.radius.of(first + h) != 0.0 && c.pitch.of(first + h) > 0.0;
        let mut todo: Vec<usize> = (0..self.hairs.len() / points).filter(curls).collect();
        let mut s = Scratch::new(points);
        let tries = if c.keep_length { TRIES } else { 1 };
        let (mut share, mut again) = ([0.0; CHUNK], Vec::new());
        for time in 1..=tries {
            // What is not near enough is done again side by side: what a hair gets does not depend on those beside it.
            for hairs in todo.chunks(LANES) {
                let mut group = Group::new(first, hairs);
                let own = Own::<L>::new(&self, &group);
                s.block.load::<L>(self.hairs, &group);
                if !c.keep_length {
                    s.along.set(&s.block, own.root);
                    own.displace(&s.along, &mut s.block);
                    s.block.store::<L>(&group, self.hairs);
                    continue;
                }
                let mut at = Pack::default();
                for l in 0..LANES {
                    at.0[l] = share[group.lane[l]];
                }
                let next = own.curl_keeping(&mut s, if time == 1 { None } else { Some(L::load(&at)) });
                next.store(&mut at);
                for (l, h) in hairs.iter().enumerate() {
                    if at.0[l] > 0.0 && time < TRIES {
                        share[*h] = at.0[l];
                        again.push(*h);
                        group.used[l] = false;
                    }
                }
                s.block.store::<L>(&group, self.hairs);
            }
            std::mem::swap(&mut todo, &mut again);
            again.clear();
        }
    }
}

struct Scratch {
    along: Beside,
    /// Hairs as they were, and the length up to each of their points.
    whole: Block,
    arc: Vec<Pack>,
    block: Block,
}

impl Scratch {
    fn new(points: usize) -> Self {
        let (whole, block) = (Block::new(points), Block::new(points));
        Scratch { along: Beside::new(points), whole, arc: vec![Pack::default(); points], block }
    }
}

/// Parameters of hairs side by side.
struct Own<'a, L> {
    curl: &'a Curl<'a>,
    profile: &'a [f32],
    /// Sine and cosine of the waves' own phases.
    own: [(f32, f32); 2],
    root: [V<L>; 2],
    radius: L,
    per_unit: L,
    phase: L,
    tighten: L,
    plane: (L, L),
}

impl<'a, L: Lanes> Own<'a, L> {
    #[inline(always)]
    fn new(of: &Chunk<'a>, group: &Group) -> Self {
        let c = of.curl;
        Own {
            curl: c,
            profile: of.profile,
            own: of.own,
            root: group.roots(c.axes),
            radius: group.param(&c.radius),
            per_unit: L::splat(1.0) / group.param(&c.pitch),
            phase: group.param(&c.phase),
            tighten: group.param(&c.tighten),
            plane: sin_cos_turn(group.param(&c.angle)),
        }
    }

    /// Growth of the frequency a pitch, for hairs of that length.
    #[inline(always)]
    fn tightening(&self, length: L) -> L {
        let tip = length * self.per_unit;
        let share = L::splat(0.5) * self.tighten / tip;
        share.max(L::splat(0.0)).min(L::splat(f32::MAX))
    }

    /// Offsets along the two axes at point `k`, at arc length `arc`.
    #[inline(always)]
    fn offset(&self, k: usize, arc: L, tighten: L) -> [L; 2] {
        let (one, t) = (L::splat(1.0), arc * self.per_unit);
        let c = self.curl;
        let f = if c.start > 0.0 { (t * L::splat(1.0 / c.start)).min(one) } else { one };
        let size = self.radius * f * f * (L::splat(3.0) - f - f) * L::splat(*self.profile.get(k).unwrap_or(&1.0));
        let [wx, wy] = &c.wave;
        let first = sin_cos_turn(wx.turns(t, tighten) + self.phase);
        let x = size * wx.at(t, first, self.own[0]);
        let y = match () {
            () if *wy == Wave::NONE => L::splat(0.0),
            // One sine does for both.
            () if wx.p0 == wy.p0 && wx.r == wy.r => size * wy.at(t, first, self.own[1]),
            () => size * wy.at(t, sin_cos_turn(wy.turns(t, tighten) + self.phase), self.own[1]),
        };
        let (sin, cos) = self.plane;
        [x * cos - y * sin, x * sin + y * cos]
    }

    /// Adds the offsets to hairs whose axes are `along`; gives back their length after it.
    #[inline(always)]
    fn displace(&self, along: &Beside, hairs: &mut Block) -> L {
        let points = hairs.point.len();
        let tighten = self.tightening(L::load(&along.arc[points - 1]));
        let (mut length, mut before) = (L::splat(0.0), V::load(&hairs.point[0]));
        for (k, p) in hairs.point.iter_mut().enumerate().skip(1) {
            let [u, v] = self.offset(k, L::load(&along.arc[k]), tighten);
            let at = V::load(p) + V::load(&along.normal[k]).times(u) + V::load(&along.binormal[k]).times(v);
            at.store(p);
            let d = at - before;
            length = length + d.dot(d).sqrt();
            before = at;
        }
        length
    }

    /// Length of curled hairs whose middle line is straight and ends at a share of itself.
    #[inline(always)]
    fn reckoned(&self, arc: &[Pack], share: L) -> L {
        let zero = L::splat(0.0);
        let tighten = self.tightening(L::load(&arc[arc.len() - 1]) * share);
        let (mut sum, mut before, mut at) = (zero, [zero; 2], zero);
        for (k, arc) in arc.iter().enumerate().skip(1) {
            let t = L::load(arc) * share;
            let o = self.offset(k, t, tighten);
            let [dx, dy, dz] = [o[0] - before[0], o[1] - before[1], t - at];
            sum = sum + (dx * dx + dy * dy + dz * dz).sqrt();
            (before, at) = (o, t);
        }
        sum
    }

    /// Share of the middle line at which curled hairs are as long as it is, reckoned as if it were straight: the length is
    /// nearly linear in the share, so the line through two shares finds it (to 1e-3 for curls that fade in over a tenth of
    /// the hair).
    #[inline(always)]
    fn share(&self, arc: &[Pack], total: L) -> L {
        let one = L::splat(1.0);
        let whole = self.reckoned(arc, one);
        let first = within_one(total / whole);
        let less = self.reckoned(arc, first);
        let slope = (whole - less) / (one - first);
        let second = first + (total - less) / slope;
        // No curls: no slope.
        within_one(L::if_gt(L::splat(0.999_9), first, second, first))
    }

    /// Curls the hairs of `s.block` so that they stay as long as they are: their middle lines end earlier, at `share` of
    /// themselves (or at what is reckoned). Gives back the share to try next, 0 where the length is near enough.
    #[inline(always)]
    fn curl_keeping(&self, s: &mut Scratch, share: Option<L>) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let total = s.along.set_arc::<L>(&s.block);
        std::mem::swap(&mut s.along.arc, &mut s.arc);
        std::mem::swap(&mut s.block, &mut s.whole);
        let share = match share {
            Some(share) => share,
            None => self.share(&s.arc, total),
        };
        cut(&s.whole, &s.arc, share, &mut s.block);
        s.along.set(&s.block, self.root);
        let curled = self.displace(&s.along, &mut s.block);
        let scale = L::if_gt(curled, zero, total / curled, one);
        let root = V::<L>::load(&s.block.point[0]);
        for p in s.block.point.iter_mut().skip(1) {
            (root + (V::load(p) - root).times(scale)).store(p);
        }
        let off = (curled - total) / total;
        let off = L::if_gt(zero, off, zero - off, off);
        L::if_gt(off, L::splat(CLOSE), within_one(share * total / curled), zero)
    }
}

/// A share of 0 to 1; 1 for what is none.
#[inline(always)]
fn within_one<L: Lanes>(share: L) -> L {
    let one = L::splat(1.0);
    L::if_gt(share, L::splat(0.0), share.min(one), one)
}

/// The first `share` of each hair, its points in the same shares of its length. `arc` has the length up to each point.
#[inline(always)]
fn cut<L: Lanes>(hairs: &Block, arc: &[Pack], share: L, out: &mut Block) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let row = hairs.point.as_flattened();
    let step = L::Bits::splat(1).numbers();
    // The segment that each lane is in: its ends, the lengths up to them, and the index of its far end.
    let (mut a, mut b) = (V::<L>::load(&hairs.point[0]), V::load(&hairs.point[1]));
    let (mut from, mut to, mut far) = (L::load(&arc[0]), L::load(&arc[1]), L::Bits::splat(1));
    a.store(&mut out.point[0]);
    for (arc_k, out) in arc.iter().zip(&mut out.point).skip(1) {
        let target = L::load(arc_k) * share;
        // Ends at the last segment at the latest: no share is above 1, so no target beyond its end.
        while L::any_gt(target, to) {
            a = V::if_gt(target, to, b, a);
            from = L::if_gt(target, to, to, from);
            far = far + L::if_gt(target, to, step, zero).bits();
            let x = far + far + far;
            let (y, z) = (x + L::Bits::splat(1), x + L::Bits::splat(2));
            to = L::pick(arc, far);
            b = V([L::pick(row, x), L::pick(row, y), L::pick(row, z)]);
        }
        let side = to - from;
        let t = L::if_gt(side, zero, ((target - from) / side).min(one), zero);
        (a + (b - a).times(t)).store(out);
    }
}
