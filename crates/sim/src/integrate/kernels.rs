//! The loops of a step in lanes.

use crate::band::{self, Panel, RING, Window};
use crate::group::Group;
use crate::lanes::{self, Kernel, L3, LANES, Lanes, Pack, load3, mul_add3, scale3, store3, sub3};
use crate::rod::{self, Damping, Scratch, Watch};
use crate::springs::kernel;
use crate::springs::paper::limit_strain as limit_springs;
use crate::stage::{Motion, Stage, open_node};

/// Weight of both earlier derivatives in the last stage of TR-BDF2: sqrt 2 / 4.
const WEIGHT: f64 = 0.353_553_390_593_273_8;

/// One iteration of a rod.
pub(super) struct Iterate<'a, 'b, const D: usize, const ROWS: usize> {
    pub(super) g: &'a mut Group,
    pub(super) turned: &'a mut [Pack],
    pub(super) damping: Damping,
    pub(super) stage: Stage<'b>,
    pub(super) scratch: &'a mut Scratch<D, ROWS>,
}

impl<const D: usize, const ROWS: usize> Kernel for Iterate<'_, '_, D, ROWS> {
    type Out = Pack;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Pack {
        let Iterate { g, turned, damping, mut stage, scratch } = self;
        rod::solve::<L, D, ROWS>(&g.node, &g.elastic, &g.motion, turned, damping, &mut stage, scratch);
        let largest = rod::apply::<L, D, ROWS>(&g.node, &mut g.motion, turned, &stage.active, scratch);
        let mut out = Pack::default();
        largest.store(&mut out);
        out
    }
}

/// One iteration of springs.
pub(super) struct IterateSprings<'a, 'b> {
    pub(super) g: &'a mut Group,
    pub(super) turned: &'a mut [Pack],
    pub(super) stage: Stage<'b>,
    pub(super) scratch: &'a mut Scratch<3, 12>,
    pub(super) x: &'a mut Vec<[Pack; 3]>,
}

impl Kernel for IterateSprings<'_, '_> {
    type Out = Pack;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Pack {
        let IterateSprings { g, turned, mut stage, scratch, x } = self;
        let n = g.node.len();
        let springs = g.springs.as_mut().expect("a group of springs");
        positions(&g.motion, x);
        let rhs = &mut scratch.rhs[..n + 4];
        for r in &mut rhs[n..] {
            *r = [Pack::default(); 3];
        }
        let mut window: Window<L, 3, 12> = [Panel::zero(); RING];
        let base = stage.base;
        let rate = L::splat(springs.model.damping / stage.h);
        for i in 0..n + 3 {
            if i < n {
                open_node(i, &g.node[i], &g.motion[i], &mut stage, &mut window, &mut rhs[i]);
                let (model, altitude) = (&springs.model.model[i], &springs.altitude[i]);
                kernel::add_node::<L, true>(i, model, altitude, x, base, rate, &mut window, rhs);
            }
            if i >= 3 {
                band::eliminate::<L, 3, 12>(i - 3, &mut window, &mut scratch.factor[i - 3], rhs);
            }
        }
        for j in (0..n).rev() {
            band::substitute::<L, 3, 12>(j, &scratch.factor[j], rhs);
        }
        let active = L::load(&stage.active);
        for i in 1..n {
            kernel::pull_node(i, &springs.model.model[i], &mut springs.altitude[i], x, Some((rhs, active)));
        }
        let largest = rod::apply::<L, 3, 12>(&g.node, &mut g.motion, turned, &stage.active, scratch);
        let mut out = Pack::default();
        largest.store(&mut out);
        out
    }
}

fn positions(motion: &[Motion], x: &mut Vec<[Pack; 3]>) {
    x.clear();
    x.extend(motion.iter().map(|m| m.x));
}

/// Chooses the altitudes of a step.
pub(super) struct Choose<'a> {
    pub(super) g: &'a mut Group,
    pub(super) x: &'a mut Vec<[Pack; 3]>,
    pub(super) forget: f64,
}

impl Kernel for Choose<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Choose { g, x, forget } = self;
        positions(&g.motion, x);
        let springs = g.springs.as_mut().expect("a group of springs");
        for i in 3..x.len() {
            let (candidates, altitude) = (&springs.model.candidates[i], &mut springs.altitude[i]);
            kernel::choose_node::<L>(i, candidates, altitude, x, L::splat(forget));
        }
        for i in 1..x.len() {
            kernel::pull_node::<L>(i, &springs.model.model[i], &mut springs.altitude[i], x, None);
        }
        for (m, x) in g.motion.iter_mut().zip(x.iter()) {
            m.x = *x;
        }
    }
}

/// Strain limiting of springs, which act on more than the axis.
pub(super) struct LimitSprings<'a> {
    pub(super) g: &'a mut Group,
    pub(super) x: &'a mut Vec<[Pack; 3]>,
    pub(super) limit: f64,
    pub(super) dt: f64,
}

impl Kernel for LimitSprings<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let LimitSprings { g, x, limit, dt } = self;
        positions(&g.motion, x);
        let springs = g.springs.as_ref().expect("a group of springs");
        // Only strands that are themselves too long: what others in the group do must not touch a strand.
        let (mut strain, zero) = (L::splat(0.0), L::splat(0.0));
        for i in 0..x.len() - 1 {
            let e = sub3(load3::<L>(&x[i + 1]), load3(&x[i]));
            let rest = L::load(&g.node[i].length);
            let stretched = (lanes::dot(e, e).sqrt() - rest) / rest;
            let real = L::if_gt(L::load(&g.elastic[i].stretch), zero, stretched.max(-stretched), zero);
            strain = real.max(strain);
        }
        limit_springs::<L>(&springs.model, x, limit, strain - L::splat(limit));
        for (m, x) in g.motion.iter_mut().zip(x.iter()) {
            for c in 0..3 {
                for l in 0..LANES {
                    m.v[c].0[l] += (x[c].0[l] - m.x[c].0[l]) / dt;
                }
            }
            m.x = *x;
        }
    }
}

/// Free flight and the first guess of a stage.
pub(super) struct Predict<'a> {
    pub(super) motion: &'a mut [Motion],
    pub(super) y: &'a mut [[Pack; 3]],
    pub(super) base: &'a mut [[Pack; 3]],
    pub(super) from: &'a mut [[Pack; 3]],
    pub(super) h: f64,
    pub(super) rest: f64,
    pub(super) gravity: [f64; 3],
    pub(super) second: bool,
    pub(super) cold: bool,
    pub(super) dt: f64,
}

impl Kernel for Predict<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let h = L::splat(self.h);
        let inverse = L::splat(1.0 / self.h);
        let rest = L::splat(self.rest);
        let [x, y, z] = self.gravity;
        let fall: L3<L> = [L::splat(x), L::splat(y), L::splat(z)];
        for (i, m) in self.motion.iter_mut().enumerate() {
            let x = load3::<L>(&m.x);
            let (vn, an) = (load3::<L>(&m.v), load3::<L>(&m.a));
            let w = L::splat(self.dt * WEIGHT);
            let (base, from, a) = if !self.cold && self.second {
                let (b1, f1) = (load3::<L>(&self.base[i]), load3::<L>(&self.from[i]));
                let v1 = scale3(sub3(x, b1), inverse);
                let a1 = scale3(sub3(v1, f1), inverse);
                let xn = mul_add3(vn, -h, b1);
                (mul_add3(lanes::add3(vn, v1), w, xn), mul_add3(lanes::add3(an, a1), w, vn), a1)
            } else if !self.cold {
                (mul_add3(vn, h, x), mul_add3(an, h, vn), an)
            } else if self.second {
                let start = load3::<L>(&self.base[i]);
                let before = load3::<L>(&self.from[i]);
                let v = scale3(sub3(x, start), inverse);
                let a = scale3(sub3(v, before), inverse);
                (mul_add3(v, rest, start), mul_add3(a, rest, before), a)
            } else {
                (x, vn, an)
            };
            store3(mul_add3(mul_add3(fall, h, from), h, base), &mut self.y[i]);
            store3(mul_add3(mul_add3(a, h, from), h, base), &mut m.x);
            store3(base, &mut self.base[i]);
            store3(from, &mut self.from[i]);
        }
    }
}

/// Velocities and accelerations after the last stage.
pub(super) struct Finish<'a> {
    pub(super) motion: &'a mut [Motion],
    pub(super) base: &'a [[Pack; 3]],
    pub(super) from: &'a [[Pack; 3]],
    pub(super) h: f64,
}

impl Kernel for Finish<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let inverse = L::splat(1.0 / self.h);
        for (i, m) in self.motion.iter_mut().enumerate() {
            let v = scale3(sub3(load3::<L>(&m.x), load3(&self.base[i])), inverse);
            store3(v, &mut m.v);
            store3(scale3(sub3(v, load3(&self.from[i])), inverse), &mut m.a);
        }
    }
}

/// Looks a step over.
pub(super) struct Look<'a> {
    pub(super) g: &'a Group,
    pub(super) before: &'a [Motion],
}

impl Kernel for Look<'_> {
    type Out = Watch;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Watch {
        let mut out = Watch::default();
        rod::watch::<L>(&self.g.node, &self.g.elastic, self.before, &self.g.motion, &mut out);
        out
    }
}
