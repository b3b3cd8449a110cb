//! The step in time.
//!
//! TR-BDF2 (R. E. Bank et al., "Transient simulation of silicon devices and circuits", 1985): a trapezoidal stage to the
//! fraction 2 - sqrt 2 of the step, then a second-order backward difference to its end. Both are implicit steps of the
//! length `gamma dt`, gamma = 1 - 1/sqrt 2, the minimisation of [`crate::stage`]. It is of second order also where stretching
//! is stiff, and damps what it can't resolve (L-stable). It needs the acceleration at the beginning; a strand that has none
//! to trust takes SDIRK2, with the same implicit steps. No other history, so a strand may change its step at any time.
//!
//! A strand whose stage does not converge, or that turns too far in a step, takes that step in two halves, and so on; it
//! alone, so no hair changes another.

mod kernels;

use crate::band::HELD;
use crate::contact;
use crate::group::{Group, Snapshot, mask};
use crate::lanes::{self, LANES, Pack, Width};
use crate::rod::{Damping, Scratch, Watch};
use crate::springs::paper::FORGET;
use crate::stage::{Air, Contact, Motion, Stage};
use kernels::{Choose, Finish, Iterate, IterateSprings, LimitSprings, Look, Origin, Predict};

/// The fraction of a step that each stage spans: 1 - 1 / sqrt 2.
const GAMMA: f64 = 0.292_893_218_813_452_5;

/// Weight of both earlier derivatives in the last stage of TR-BDF2: sqrt 2 / 4.
const WEIGHT: f64 = 0.353_553_390_593_273_8;

/// What the last stage of TR-BDF2 takes from the first stage's movement: (1 - c)^2 / (c (2 - c)), c = 2 - sqrt 2.
const TURN_CARRIED: f64 = 0.207_106_781_186_547_5;

/// Steps are halved until they are shorter than this, seconds: six times from a usual one. Each halving doubles the work
/// of that strand only.
const SHORTEST_STEP: f64 = 1.6e-4;

/// A step of the deepest level whose iterations still turn an edge by this, radians, says nothing of speed: it is taken away.
const LOOSE: f64 = 0.1;

/// Iterations of a stage before its step is halved.
const ITERATIONS: usize = 8;

/// What is left of an iteration's turn when contact comes and goes, radians. Above 0.05, hair that is pressed on a corner
/// shows it; below 1e-3, strands halve their steps for nothing.
const CONTACT_TOLERANCE: f64 = 1e-2;

/// Iterations in which friction follows; in later ones it stays, so that they converge. With few, sliding begins late.
const FRICTION_ITERATIONS: usize = 6;

/// The first iteration counts as well converged if it turns less than the root of this times the tolerance, radians: what the
/// guess from the last acceleration leaves. Larger, errors of fast motion stay; smaller, calm hair iterates twice.
const FIRST_TURN: f64 = 0.05;

/// Slowest convergence that is believed.
const SLOWEST: f64 = 0.9;

/// Buffers of a thread.
#[derive(Debug, Default)]
pub struct Work {
    saved: Vec<Snapshot>,
    y: Vec<[Pack; 3]>,
    base: Vec<[Pack; 3]>,
    /// Velocity that a stage starts from.
    from: Vec<[Pack; 3]>,
    turned: Vec<Pack>,
    contact: Vec<Contact>,
    air: Vec<Air>,
    twisting: Scratch<4, 11>,
    springs: Scratch<3, 12>,
    x: Vec<[Pack; 3]>,
    straight: Scratch<3, 9>,
    /// Turn of each lane's last iteration, radians.
    left: Pack,
}

impl Work {
    /// Forgets the group that was moved before: what a strand does must not depend on which thread takes it.
    pub fn forget(&mut self) {
        self.contact.clear();
    }
}

/// How steps are taken.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Widest registers to use.
    pub width: Width,
    /// An iteration ends when no edge turned by more than this in it, radians.
    pub tolerance: f64,
    /// Friction with the body.
    pub friction: f64,
    /// Internal damping.
    pub damping: Damping,
    /// A strand that turns farther than this in a step takes smaller ones, radians.
    pub largest_turn: f64,
    /// Largest strain.
    pub strain_limit: f64,
}

/// What happens around a group while it moves.
pub trait Around {
    /// Places the held nodes of some lanes at a fraction of the span.
    fn hold(&self, group: &mut Group, lanes: [bool; LANES], fraction: f64);
    /// Gravity at a fraction of the span, metres per second squared.
    fn gravity(&self, fraction: f64) -> [f64; 3];
    /// Whether there is a body.
    fn solid(&self) -> bool;
    /// Fills in contacts at the nodes' present positions; the lanes that have some.
    fn touch(
        &self,
        group: &Group,
        start: &[Motion],
        lanes: [bool; LANES],
        time: StageTime,
        contact: &mut [Contact],
    ) -> [bool; LANES];
    /// Fills in the air at the nodes of some lanes as they will be in the middle of a step, as far as they know; false if it
    /// does not act.
    fn air(&self, group: &Group, lanes: [bool; LANES], at: Interval, air: &mut [Air]) -> bool;
}

/// When a stage is.
#[derive(Clone, Copy, Debug)]
pub struct StageTime {
    /// Fraction of the span.
    pub fraction: f64,
    /// Length of the implicit step, seconds.
    pub h: f64,
    /// Since the beginning of the step, seconds.
    pub elapsed: f64,
}

/// What a group did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Done {
    /// Steps times nodes.
    pub node_steps: u64,
    /// Linear solves times nodes.
    pub node_solves: u64,
    /// Of these, with the factor of the solve before.
    pub node_chords: u64,
    /// Depth of the deepest halving, per lane.
    pub deepest: [u8; LANES],
    /// Lanes whose motion could not be followed: it was stopped, and went on from rest.
    pub stopped: [bool; LANES],
    /// Lanes that diverged.
    pub failed: [bool; LANES],
    /// Largest strain at the end of a step, per lane.
    pub strain: [f64; LANES],
    /// Largest speed at the end, per lane.
    pub speed: [f64; LANES],
}

/// Times of a step: its beginning and length as fractions of the span, and the span's length in seconds.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// Fraction of the span at which the step begins.
    pub start: f64,
    /// Its length as a fraction of the span.
    pub length: f64,
    /// Length of the span, seconds.
    pub span: f64,
}

/// Takes a step with some lanes; halves it for those that need it.
#[allow(clippy::too_many_arguments)]
pub fn advance<A: Around>(
    g: &mut Group,
    around: &A,
    method: &Method,
    at: Interval,
    lanes: [bool; LANES],
    depth: u8,
    work: &mut Work,
    done: &mut Done,
) {
    let last = at.length * at.span <= SHORTEST_STEP;
    let wanted: [bool; LANES] = std::array::from_fn(|l| lanes[l] && !done.failed[l]);
    let mut deeper: [bool; LANES] = std::array::from_fn(|l| wanted[l] && g.level[l] > depth);
    let now: [bool; LANES] = std::array::from_fn(|l| wanted[l] && !deeper[l]);
    if now.contains(&true) {
        let saved = save(g, work, depth);
        let converged = step(g, around, method, at, now, &saved.motion, work, done);
        let mut seen = look(g, method, &saved.motion);
        for l in (0..LANES).filter(|&l| now[l]) {
            seen.strain.0[l] = seen.strain.0[l].max(axis_strain(g, l));
        }
        let (mut long, mut halted) = ([false; LANES], [false; LANES]);
        for l in 0..LANES {
            let finite = seen.finite.0[l] == 0.0;
            let calm = converged[l] && finite && seen.turn.0[l] <= method.largest_turn * method.largest_turn;
            let settled = converged[l] || work.left.0[l] < LOOSE;
            if now[l] && (calm || (last && finite)) {
                done.deepest[l] = done.deepest[l].max(depth);
                done.strain[l] = seen.strain.0[l];
                if seen.strain.0[l] > method.strain_limit {
                    long[l] = true;
                    done.strain[l] = method.strain_limit;
                }
                if !calm && !settled {
                    // What can't be followed in the shortest step goes on from rest: folds open, heaps spread.
                    done.stopped[l] = true;
                    halted[l] = true;
                }
                done.speed[l] = seen.speed.0[l].sqrt();
                // Half the turn would have been fine with twice the step.
                if depth > 0 && seen.turn.0[l] < 0.16 * method.largest_turn * method.largest_turn {
                    g.level[l] = depth - 1;
                }
                continue;
            }
            g.revert(l, &saved);
            if now[l] {
                if last {
                    done.failed[l] = true;
                } else {
                    g.level[l] = depth + 1;
                    deeper[l] = true;
                }
            }
        }
        work.saved[depth as usize] = saved;
        if long.contains(&true) {
            let (limit, dt) = (method.strain_limit, at.length * at.span);
            if g.springs.is_some() {
                lanes::run(method.width, LimitSprings { g, x: &mut work.x, limit, dt, due: mask(long) });
            }
            for l in (0..LANES).filter(|&l| long[l]) {
                if g.springs.is_none() {
                    limit_strain(g, l, limit, dt);
                }
                g.forget_acceleration(l);
            }
        }
        (0..LANES).filter(|&l| halted[l]).for_each(|l| g.stop(l));
    }
    if deeper.contains(&true) {
        let half = 0.5 * at.length;
        for start in [at.start, at.start + half] {
            advance(g, around, method, Interval { start, length: half, ..at }, deeper, depth + 1, work, done);
        }
    }
}

/// Largest strain of the axis of springs, which may pass between particles beside it.
fn axis_strain(g: &Group, l: usize) -> f64 {
    let Some(springs) = &g.springs else { return 0.0 };
    let strain = |w: &[u32]| {
        let (a, b) = (w[0] as usize, w[1] as usize);
        let rest = springs.model.model[b].length[b - a - 1].0[l];
        if g.node[b].held.0[l] == 0.0 { ((g.x(b, l) - g.x(a, l)).norm() / rest - 1.0).abs() } else { 0.0 }
    };
    g.at[l].windows(2).map(strain).fold(0.0, f64::max)
}

/// Strain limiting from root to tip (the springs paper's section 4.2): only the node farther from the root moves, along the
/// edge, and its velocity with it.
fn limit_strain(g: &mut Group, l: usize, limit: f64, dt: f64) {
    for i in 0..g.count[l] - 1 {
        if g.elastic[i].stretch.0[l] == 0.0 || g.node[i + 1].held.0[l] != 0.0 {
            continue;
        }
        let rest = g.node[i].length.0[l];
        let from = g.x(i, l);
        let e = g.x(i + 1, l) - from;
        let length = e.norm();
        let wanted = length.clamp(rest * (1.0 - limit), rest * (1.0 + limit));
        if wanted != length {
            let by = e * ((wanted - length) / length);
            for c in 0..3 {
                g.motion[i + 1].x[c].0[l] += by[c];
                g.motion[i + 1].v[c].0[l] += by[c] / dt;
            }
        }
    }
}

/// A copy of the group's state, in the buffer for its depth.
fn save(g: &Group, work: &mut Work, depth: u8) -> Snapshot {
    if work.saved.len() <= depth as usize {
        work.saved.resize(depth as usize + 1, Snapshot::default());
    }
    let mut saved = std::mem::take(&mut work.saved[depth as usize]);
    g.save(&mut saved);
    saved
}

/// Both stages of a step; returns the lanes that converged.
///
/// Strands that know their acceleration take TR-BDF2; those that do not (at the start, in contact, after limiting) take
/// SDIRK2 (R. Alexander 1977), which needs none. Both have two implicit steps of the same length, from other origins.
#[allow(clippy::too_many_arguments)]
fn step<A: Around>(
    g: &mut Group,
    around: &A,
    method: &Method,
    at: Interval,
    lanes: [bool; LANES],
    before: &[Motion],
    work: &mut Work,
    done: &mut Done,
) -> [bool; LANES] {
    let n = g.node.len();
    let dt = at.length * at.span;
    for v in [&mut work.y, &mut work.base, &mut work.from] {
        v.resize(n, Default::default());
    }
    work.turned.resize(n, Pack::default());
    work.contact.resize(n, Contact::default());
    work.air.resize(n, Air::default());
    if g.springs.is_some() {
        work.springs.reserve(n);
        let forget = (FORGET * dt).min(1.0);
        lanes::run(method.width, Choose { g, x: &mut work.x, forget });
    } else {
        if g.twist {
            work.twisting.reserve(n);
        } else {
            work.straight.reserve(n);
        }
    }
    let h = GAMMA * dt;
    let (mut converged, mut touching) = (lanes, [false; LANES]);
    let unknown = |l: usize| g.motion[..g.count[l]].iter().all(|m| m.a.iter().all(|a| a.0[l] == 0.0));
    let cold: [bool; LANES] = std::array::from_fn(|l| lanes[l] && unknown(l));
    let warm: [bool; LANES] = std::array::from_fn(|l| lanes[l] && !cold[l]);
    let pick = |if_cold: f64, if_warm: f64| Pack(cold.map(|cold| if cold { if_cold } else { if_warm }));
    let carried = pick(1.0 - (1.0 - GAMMA) / GAMMA, -TURN_CARRIED);
    let blowing = around.air(g, lanes, at, &mut work.air);
    for l in (0..LANES).filter(|&l| lanes[l]) {
        work.left.0[l] = 0.0;
    }
    work.turned.fill(Pack::default());
    for second in [false, true] {
        let reached = if second { [1.0, 1.0] } else { [GAMMA, 2.0 * GAMMA] };
        let origin = if second {
            // Turns count from where the first stage's rate would have brought them, as positions do from `base`.
            for t in &mut work.turned {
                for l in 0..LANES {
                    t.0[l] *= carried.0[l];
                }
            }
            Origin::Second { before: pick(0.0, WEIGHT * dt - h), first: pick(dt - h, WEIGHT * dt), weight: WEIGHT * dt }
        } else {
            Origin::First(pick(0.0, h))
        };
        let pulls = reached.map(|r| around.gravity(at.start + r * at.length));
        let gravity = std::array::from_fn(|c| pick(pulls[0][c], pulls[1][c]));
        let Work { y, base, from, twisting, straight, .. } = work;
        let (rods, frames) = (g.springs.is_none(), g.twist);
        let pull = rods.then_some(if frames { &mut twisting.pull[..] } else { &mut straight.pull[..] });
        let Group { node, elastic, motion, .. } = &mut *g;
        let predict = Predict { node, elastic, motion, pull, y, base, from, h, origin, gravity, frames };
        lanes::run(method.width, predict);
        for (lanes, reached) in [(cold, reached[0]), (warm, reached[1])] {
            if !lanes.contains(&true) {
                continue;
            }
            let time = StageTime { fraction: at.start + reached * at.length, h, elapsed: reached * dt };
            around.hold(g, lanes, time.fraction);
            prescribe(g, lanes, work, before, time);
            if around.solid() {
                let found = around.touch(g, before, lanes, time, &mut work.contact);
                for l in (0..LANES).filter(|&l| lanes[l]) {
                    touching[l] = found[l];
                }
            }
        }
        let stage_ok = solve(g, method, Acting { h, touching, blowing }, lanes, work, done);
        for l in 0..LANES {
            converged[l] &= stage_ok[l];
        }
    }
    let Work { base, from, .. } = work;
    lanes::run(method.width, Finish { motion: &mut g.motion, base, from, h });
    if around.solid() {
        contact::settle(g, &work.contact, lanes);
    }
    let count: usize = (0..LANES).filter(|&l| lanes[l]).map(|l| g.count[l]).sum();
    done.node_steps += count as u64;
    converged
}

/// Gives held nodes their prescribed velocity, and no inertia.
fn prescribe(g: &Group, lanes: [bool; LANES], work: &mut Work, before: &[Motion], time: StageTime) {
    for i in 0..g.node.len() {
        if g.node[i].held.0 == [0.0; LANES] {
            continue;
        }
        for l in (0..LANES).filter(|&l| lanes[l]) {
            if g.node[i].held.0[l] == HELD {
                for c in 0..3 {
                    let x = g.motion[i].x[c].0[l];
                    let v = (x - before[i].x[c].0[l]) / time.elapsed;
                    work.y[i][c].0[l] = x;
                    work.base[i][c].0[l] = x - time.h * v;
                    work.from[i][c].0[l] = v;
                }
            }
        }
    }
}

/// What acts in a stage.
#[derive(Clone, Copy)]
struct Acting {
    h: f64,
    touching: [bool; LANES],
    blowing: bool,
}

/// Iterates a stage to its tolerance; returns the lanes that reached it.
fn solve(
    g: &mut Group,
    method: &Method,
    acting: Acting,
    lanes: [bool; LANES],
    work: &mut Work,
    done: &mut Done,
) -> [bool; LANES] {
    let Acting { h, touching, blowing } = acting;
    let mut active = lanes;
    let mut last = Pack::splat(FIRST_TURN);
    for iteration in 0..ITERATIONS {
        // The second iteration of free strands has little left to do: the first one's factor is good enough.
        let second = iteration == 1 && g.springs.is_none();
        let chord: [bool; LANES] = std::array::from_fn(|l| second && active[l] && !touching[l]);
        let newton: [bool; LANES] = std::array::from_fn(|l| active[l] && !chord[l]);
        for (again, which) in [(true, chord), (false, newton)] {
            if !which.contains(&true) {
                continue;
            }
            let stage = Stage {
                h,
                y: &work.y,
                base: &work.base,
                contact: (!again && touching.contains(&true)).then_some(&mut work.contact),
                friction: method.friction,
                refresh: iteration < FRICTION_ITERATIONS,
                solved: iteration > 0,
                air: blowing.then_some(&work.air),
                active: mask(which),
            };
            let (turned, damping) = (&mut work.turned, method.damping);
            let largest = if g.springs.is_some() {
                let (scratch, x) = (&mut work.springs, &mut work.x);
                lanes::run(method.width, IterateSprings { g, turned, stage, scratch, x })
            } else if g.twist {
                let scratch = &mut work.twisting;
                lanes::run(method.width, Iterate { g, turned, damping, stage, scratch, again })
            } else {
                let scratch = &mut work.straight;
                lanes::run(method.width, Iterate { g, turned, damping, stage, scratch, again })
            };
            for l in (0..LANES).filter(|&l| which[l]) {
                let n = g.count[l] as u64;
                done.node_solves += n;
                done.node_chords += if again { n } else { 0 };
                let turn = largest.0[l].sqrt();
                let ratio = (turn / last.0[l]).min(SLOWEST);
                // What later iterations would still turn, if each turned by the same fraction of the one before.
                active[l] = turn * ratio > method.tolerance * (1.0 - ratio) || (touching[l] && iteration < 2);
                last.0[l] = turn;
            }
        }
        if !active.contains(&true) {
            break;
        }
    }
    for l in (0..LANES).filter(|&l| lanes[l]) {
        work.left.0[l] = work.left.0[l].max(last.0[l]);
    }
    // Points that come and go at the body may swing around the tolerance: close is enough there.
    std::array::from_fn(|l| !active[l] || (touching[l] && last.0[l] < CONTACT_TOLERANCE))
}

fn look(g: &Group, method: &Method, before: &[Motion]) -> Watch {
    lanes::run(method.width, Look { g, before })
}
