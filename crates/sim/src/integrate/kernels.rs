//! The loops of a step in lanes.

use crate::band::{self, Panel, RING, Window};
use crate::group::Group;
use crate::hinge::edge;
use crate::lanes::{Kernel, L3, LANES, Lanes, Pack, load3, mul_add3, scale3, store3, sub3};
use crate::rod::{self, Damping, Elastic, Scratch, Watch};
use crate::springs::kernel;
use crate::springs::paper::limit_strain as limit_springs;
use crate::stage::{Motion, Node, Stage, open_node};

/// One iteration of a rod.
pub(super) struct Iterate<'a, 'b, const D: usize, const ROWS: usize> {
    pub(super) g: &'a mut Group,
    pub(super) turned: &'a mut [Pack],
    pub(super) damping: Damping,
    pub(super) stage: Stage<'b>,
    pub(super) scratch: &'a mut Scratch<D, ROWS>,
    /// With the factor of the last iteration.
    pub(super) again: bool,
}

impl<const D: usize, const ROWS: usize> Kernel for Iterate<'_, '_, D, ROWS> {
    type Out = Pack;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Pack {
        let Iterate { g, turned, damping, mut stage, scratch, again } = self;
        rod::solve::<L, D, ROWS>(&g.node, &g.elastic, &g.motion, turned, damping, &mut stage, scratch, again);
        let largest =
            rod::apply::<L, D, ROWS>(&g.node, Some(&g.elastic), &mut g.motion, turned, &stage.active, scratch);
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
                open_node::<L, 3, 12, true>(i, &g.node[i], &g.motion[i], &mut stage, &mut window, &mut rhs[i]);
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
        let largest = rod::apply::<L, 3, 12>(&g.node, None, &mut g.motion, turned, &stage.active, scratch);
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
    /// Strands that are too long: 1, others 0.
    pub(super) due: Pack,
}

impl Kernel for LimitSprings<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let LimitSprings { g, x, limit, dt, due } = self;
        positions(&g.motion, x);
        let springs = g.springs.as_ref().expect("a group of springs");
        limit_springs::<L>(&springs.model, x, limit, L::load(&due));
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

/// What a stage starts from, per lane.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// The beginning of the step, and this times its velocity.
    First(Pack),
    /// The first stage's origin, `before` times the velocity at the beginning, and `first` times that of the first stage.
    Second {
        before: Pack,
        first: Pack,
        /// Weight of the acceleration at the beginning.
        weight: f64,
    },
}

/// Free flight and the first guess of a stage.
pub(super) struct Predict<'a> {
    pub(super) node: &'a [Node],
    pub(super) elastic: &'a [Elastic],
    pub(super) motion: &'a mut [Motion],
    /// Tension of rods' edges.
    pub(super) pull: Option<&'a mut [Pack]>,
    pub(super) y: &'a mut [[Pack; 3]],
    pub(super) base: &'a mut [[Pack; 3]],
    pub(super) from: &'a mut [[Pack; 3]],
    pub(super) h: f64,
    pub(super) origin: Origin,
    pub(super) gravity: [Pack; 3],
    /// Whether edges have frames.
    pub(super) frames: bool,
}

impl Kernel for Predict<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let h = L::splat(self.h);
        let inverse = L::splat(1.0 / self.h);
        let fall: L3<L> = load3(&self.gravity);
        // Where the node behind was, and is now.
        let mut behind: Option<(L3<L>, L3<L>)> = None;
        for i in 0..self.motion.len() {
            let m = &mut self.motion[i];
            let old = load3::<L>(&m.x);
            let (vn, an) = (load3::<L>(&m.v), load3::<L>(&m.a));
            // Accelerations are 0 where they are unknown.
            let (base, from, a) = match &self.origin {
                Origin::First(ahead) => (mul_add3(vn, L::load(ahead), old), mul_add3(an, h, vn), an),
                Origin::Second { before, first, weight } => {
                    let (b1, f1) = (load3::<L>(&self.base[i]), load3::<L>(&self.from[i]));
                    let v1 = scale3(sub3(old, b1), inverse);
                    let a1 = scale3(sub3(v1, f1), inverse);
                    let (before, first) = (L::load(before), L::load(first));
                    let base = mul_add3(v1, first, mul_add3(vn, before, b1));
                    (base, mul_add3(a1, first, mul_add3(an, L::splat(*weight), vn)), a1)
                }
            };
            store3(mul_add3(mul_add3(fall, h, from), h, base), &mut self.y[i]);
            let new = mul_add3(mul_add3(a, h, from), h, base);
            store3(new, &mut m.x);
            store3(base, &mut self.base[i]);
            store3(from, &mut self.from[i]);
            if let (Some(pull), Some((was, is))) = (&mut self.pull, behind) {
                let before = edge(was, old);
                let (rest, stretch) = (L::load(&self.node[i - 1].length), L::load(&self.elastic[i - 1].stretch));
                (stretch * (before.length - rest)).store(&mut pull[i - 1]);
                if self.frames {
                    let m = &mut self.motion[i - 1].m;
                    store3(rod::carried(&before, &edge(is, new), load3(m)), m);
                }
            }
            behind = Some((old, new));
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
