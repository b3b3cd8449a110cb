//! The paper's time integration: steps 1 to 8 of section 4 without hair against hair.
//!
//! The reading taken:
//! - Step 1 is implicit in the velocity with spring directions and altitudes fixed at `t(n)` (section 4.1): elastic forces
//!   are those at `x(n) + dt/2 v(n+1/2)`, linear in it.
//! - Step 7 solves the same system, directions still those of `t(n)`, with the `v(n)` that collisions left and with
//!   positions shifted by half of what collisions did to `x(n+1)`. Without collisions its result is step 1's, and steps 1,
//!   4, 7, 8 are one implicit-midpoint step. An elastic force taken explicitly at the corrected positions would be
//!   another reading; with real hair's stretching stiffness one corrected micrometre would then throw a particle.
//! - Step 8 is `v(n+1) = 2 v(n+1/2) - v(n)`. With [`Settings::backward_euler`] step 7 is a whole backward Euler step
//!   and step 8 falls away.
//! - Strain limiting acts on step 2's velocity alone, so on positions, not on the velocity that goes on.
//!
//! Limits, measured: a human hair of 20 cm and 50 segments hanging 1 degree off, a second. At rest root and 1 g, as printed
//! and without damping, it is bounded up to the longest step tried, 4e-3 s (strain 6e-3; 3e-5 at 6e-4 s). With the root
//! shaken by 10 g at 5 Hz, starting at the root's velocity, largest strain and speed in m/s (a shorter step's answer is a
//! speed of 18 to 24: the tip cracks like a whip):
//!
//! | | 4e-3 s | 1e-3 s | 6e-4 s | 3e-4 s | 1e-4 s | 3e-5 s |
//! |---|---|---|---|---|---|---|
//! | as printed, no limiting | blows up | blows up | blows up | blows up | blows up | blows up |
//! | strain limit 0.1 | 0.1, 35 | 0.1, 69 | 0.1, 68 | 0.1, 87 | 0.1, 540 | blows up |
//! | strain limit 0.1, damping 20/s | 0.1, 16 | 0.1, 38 | 0.1, 50 | 0.1, 230 | 0.1, 460 | blows up |
//! | backward Euler, no limiting | blows up | 110, 300 | 69, 350 | 44, 430 | 19, 600 | 0.003, 24 |
//! | backward Euler, strain limit 0.1 | 0.1, 9 | 0.1, 14 | 0.1, 17 | 0.1, 19 | 0.008, 19 | 0.003, 24 |
//! | backward Euler, strain limit 0.01 | 0.01, 9 | 0.01, 13 | 0.01, 15 | 0.01, 19 | 0.005, 17 | 0.003, 24 |
//!
//! So the scheme as printed is for slow motion; for fast motion backward Euler and strain limiting are both needed, and
//! then every step tried is bounded.

use super::kernel::{self, Group, NodeAltitude, NodeModel};
use crate::band::{self, Column, HELD, Panel, RING, Window};
use crate::lanes::{self, Kernel, Lanes, Pack, Width};

/// Carried strain of altitudes is forgotten at this rate, per second: a collapsed strand is back within a second. Below 5
/// 1 % would be left after it; above 1000 it is forgotten within a step, and changes would give energy.
pub const FORGET: f64 = 20.0;

/// How a group steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Time step, seconds.
    pub step: f64,
    /// Largest strain that limiting leaves; infinite for no limiting. The papers it cites use 0.1.
    pub strain_limit: f64,
    /// Damping of velocities, per second.
    pub damping: f64,
    /// Backward Euler in step 7.
    pub backward_euler: bool,
}

/// State of a group, eight strands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Positions, metres.
    pub x: Vec<[Pack; 3]>,
    /// Velocities, metres per second.
    pub v: Vec<[Pack; 3]>,
    /// Altitudes in use.
    pub altitude: Vec<NodeAltitude>,
}

/// Memory for a step; of no meaning between steps.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    factor: Vec<Column<3, 12>>,
    rhs: Vec<[Pack; 3]>,
    next: Vec<[Pack; 3]>,
    middle: Vec<[Pack; 3]>,
}

/// What moves a group in a step.
#[derive(Clone, Copy, Debug)]
pub struct Drive<'a> {
    /// Acceleration of all particles, metres per second squared.
    pub gravity: [f64; 3],
    /// Where particles are at the end of the step; only those of held particles are read.
    pub target: &'a [[Pack; 3]],
}

/// Body collisions, step 5: may change the positions at the end (first argument) and the velocities at the beginning
/// (second) of particles that are points of the hair, and says whether it did.
pub type Collide<'a> = dyn FnMut(&mut [[Pack; 3]], &mut [[Pack; 3]]) -> bool + 'a;

/// One step.
pub fn step(
    width: Width,
    group: &Group,
    state: &mut State,
    scratch: &mut Scratch,
    settings: &Settings,
    drive: &Drive<'_>,
    collide: &mut Collide<'_>,
) {
    let n = state.x.len();
    scratch.factor.resize(n, [[Pack::default(); 3]; 12]);
    scratch.rhs.resize(n + 3, [Pack::default(); 3]);
    scratch.next.resize(n, [Pack::default(); 3]);
    scratch.middle.resize(n, [Pack::default(); 3]);
    lanes::run(width, First { group, state, scratch, settings, drive });
    let free = scratch.next.clone();
    let touched = collide(&mut scratch.next, &mut state.v);
    lanes::run(width, Second { group, state, scratch, settings, drive, free: &free, touched });
    std::mem::swap(&mut state.x, &mut scratch.next);
}

/// Steps 1, 2, 4.
struct First<'a> {
    group: &'a Group,
    state: &'a mut State,
    scratch: &'a mut Scratch,
    settings: &'a Settings,
    drive: &'a Drive<'a>,
}

impl Kernel for First<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let First { group, state, scratch, settings, drive } = self;
        let n = state.x.len();
        let forget = L::splat((FORGET * settings.step).min(1.0));
        for i in 3..n {
            kernel::choose_node::<L>(i, &group.candidates[i], &mut state.altitude[i], &mut state.x, forget);
        }
        solve::<L>(group, state, scratch, settings, drive, 0.5 * settings.step, None);
        for i in 0..n {
            let x = lanes::load3::<L>(&state.x[i]);
            let half = lanes::load3::<L>(&scratch.rhs[i]);
            lanes::store3(half, &mut scratch.middle[i]);
            lanes::store3(lanes::mul_add3(half, L::splat(2.0), x), &mut scratch.next[i]);
        }
        limit_strain::<L>(group, &mut scratch.next, settings.strain_limit, L::splat(1.0));
    }
}

/// Steps 7 and 8.
struct Second<'a> {
    group: &'a Group,
    state: &'a mut State,
    scratch: &'a mut Scratch,
    settings: &'a Settings,
    drive: &'a Drive<'a>,
    free: &'a [[Pack; 3]],
    touched: bool,
}

impl Kernel for Second<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Second { group, state, scratch, settings, drive, free, touched } = self;
        let n = state.x.len();
        let h = if settings.backward_euler { settings.step } else { 0.5 * settings.step };
        if touched || settings.backward_euler {
            // Base of the linear forces: what collisions changed, in proportion.
            let share = L::splat(h / settings.step);
            let shift: Vec<[Pack; 3]> = (0..n)
                .map(|i| {
                    let d = lanes::sub3(lanes::load3::<L>(&scratch.next[i]), lanes::load3(&free[i]));
                    let mut out = [Pack::default(); 3];
                    lanes::store3(lanes::scale3(d, share), &mut out);
                    out
                })
                .collect();
            solve::<L>(group, state, scratch, settings, drive, h, Some(&shift));
            for i in 0..n {
                let w = lanes::load3::<L>(&scratch.rhs[i]);
                lanes::store3(lanes::sub3(w, lanes::load3(&shift[i])), &mut scratch.middle[i]);
            }
        }
        let inverse = L::splat(1.0 / h);
        for i in 0..n {
            let v = lanes::load3::<L>(&state.v[i]);
            let found = lanes::scale3(lanes::load3::<L>(&scratch.middle[i]), inverse);
            let held = L::load(&group.held[i]);
            let half = L::splat(0.5);
            for c in 0..3 {
                let on = if settings.backward_euler { found[c] } else { found[c] + found[c] - v[c] };
                L::if_gt(held, half, found[c], on).store(&mut state.v[i][c]);
            }
        }
    }
}

/// Displacements over `h` in `scratch.rhs`: `(M/h^2 + M c/h + K) w = M v/h + M g + F(x) + M/h^2 shift`, held particles on
/// their way to their targets.
#[inline(always)]
fn solve<L: Lanes>(
    group: &Group,
    state: &State,
    scratch: &mut Scratch,
    settings: &Settings,
    drive: &Drive<'_>,
    h: f64,
    shift: Option<&[[Pack; 3]]>,
) {
    let State { x, v, altitude } = state;
    let Scratch { factor, rhs, .. } = scratch;
    let n = x.len();
    let inverse = L::splat(1.0 / h);
    let damped = L::splat(1.0 / (h * h) + settings.damping / h);
    let share = L::splat(h / settings.step);
    let gravity = drive.gravity.map(L::splat);
    let mut window: Window<L, 3, 12> = [Panel::zero(); RING];
    for i in 0..n + 3 {
        let slot = &mut window[i % RING];
        *slot = Panel::zero();
        if i < n {
            let mass = L::load(&group.mass[i]);
            let held = L::load(&group.held[i]) * L::splat(HELD);
            for c in 0..3 {
                slot.0[c][c] = mass.mul_add(damped, held);
                let mut b = L::load(&v[i][c]).mul_add(inverse, gravity[c]);
                if let Some(shift) = shift {
                    b = L::load(&shift[i][c]).mul_add(damped, b);
                }
                let way = (L::load(&drive.target[i][c]) - L::load(&x[i][c])) * share;
                held.mul_add(way, mass * b).store(&mut rhs[i][c]);
            }
            let model: &NodeModel = &group.model[i];
            kernel::add_node::<L, false>(i, model, &altitude[i], x, x, L::splat(0.0), &mut window, rhs);
        } else {
            rhs[i] = [Pack::default(); 3];
        }
        if i >= 3 {
            band::eliminate(i - 3, &mut window, &mut factor[i - 3], rhs);
        }
    }
    for r in &mut rhs[n..] {
        *r = [Pack::default(); 3];
    }
    for i in (0..n).rev() {
        band::substitute::<L, 3, 12>(i, &factor[i], rhs);
    }
}

/// Biased strain limiting (section 4.2): from root to tip, moves the particle farther from the root along the segment so
/// that its strain is at most `limit` either way. An extra particle is limited along its edge nearer the root. `x` are the
/// positions that a step would reach; the velocity impulse is what it moves over the time step. Lanes where `due` is 0 stay
/// as they are, and so does what is within rounding of the limit: limiting twice is limiting once.
#[inline(always)]
pub fn limit_strain<L: Lanes>(group: &Group, x: &mut [[Pack; 3]], limit: f64, due: L) {
    if !limit.is_finite() {
        return;
    }
    let (most, least) = (L::splat(1.0 + limit), L::splat(1.0 - limit));
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    for i in 1..x.len() {
        let model = &group.model[i];
        let skip = L::load(&group.skip[i]);
        let choose = |near: L, far: L| L::if_gt(skip, zero, far, near);
        let near = lanes::load3::<L>(&x[i - 1]);
        let far = lanes::load3::<L>(&x[i.max(2) - 2]);
        let from = [choose(near[0], far[0]), choose(near[1], far[1]), choose(near[2], far[2])];
        let rest = choose(L::load(&model.length[0]), L::load(&model.length[1]));
        let at = lanes::load3::<L>(&x[i]);
        let mut d = lanes::sub3(at, from);
        d[0] = d[0] + L::splat(super::plain::COINCIDENT);
        let length = lanes::dot(d, d).sqrt();
        let allowed = length.min(rest * most).max(rest * least);
        let free = L::if_gt(L::load(&group.held[i]), zero, zero, one);
        let by = (allowed / length - one) * free;
        let worth = by.max(-by) - L::splat(1e-12);
        let by = L::if_gt(due, zero, L::if_gt(worth, zero, by, zero), zero);
        lanes::store3(lanes::mul_add3(d, by, at), &mut x[i]);
    }
}
