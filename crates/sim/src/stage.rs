//! One implicit stage of a step for eight strands: what every model shares.
//!
//! A stage finds positions `x` that make  `1/2 (x - y)^T M (x - y) / h^2 + E(x)`  stationary: inertia pulls towards `y`,
//! where the hair would fly freely, and `E` holds elasticity, contact, and (linearised) drag and friction. Each
//! iteration assembles a positive definite matrix and gradient per node, solves the band directly, and moves.

use crate::band::Window;
use crate::lanes::{Lanes, Pack, dot, load3, scale3, sub3};

/// Longest turn of a segment in one iteration, radians. Above about 1 an iteration may jump to a wrong fold; below 0.1
/// large steps need many iterations.
pub const LARGEST_TURN: f64 = 0.5;

/// What nodes are, constant over a shot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Node {
    /// Kilograms.
    pub mass: Pack,
    /// 0, or [`crate::band::HELD`] if the position is prescribed.
    pub held: Pack,
    /// 0, or [`crate::band::HELD`] if the turn of the edge behind the node is prescribed.
    pub held_turn: Pack,
    /// Rest length of the edge from this node to the next, metres.
    pub length: Pack,
    /// Length of hair that this node stands for, metres: carries drag.
    pub share: Pack,
}

/// Where nodes are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Metres.
    pub x: [Pack; 3],
    /// Metres per second.
    pub v: [Pack; 3],
    /// Acceleration in the last stage, metres per second squared: a guess for the next.
    pub a: [Pack; 3],
    /// First material direction of the edge from this node to the next, a unit vector. Rods with twist only.
    pub m: [Pack; 3],
    /// How far friction has dragged its grip on the body, metres: see [`Contact::anchor`].
    pub grip: [Pack; 3],
}

/// Contact of a node with the body: a plane that it may not cross.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Unit normal, out of the body.
    pub normal: [Pack; 3],
    /// The node is outside where `normal . x > level`.
    pub level: Pack,
    /// Newton per metre of penetration; 0 without contact.
    pub stiffness: Pack,
    /// Velocity of the body there, metres per second.
    pub velocity: [Pack; 3],
    /// Normal force of the last iteration, newtons.
    pub force: Pack,
    /// Where friction pulls the node to, along the plane, with the stiffness `grip`, but no harder than Coulomb allows:
    /// below the limit hair sticks without creeping, above it the anchor is dragged along.
    pub anchor: [Pack; 3],
    /// Newton per metre, as long as nothing slips.
    pub grip: Pack,
    /// Newton per metre in this iteration.
    pub hold: Pack,
}

/// The air at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Air {
    /// Its velocity, metres per second.
    pub velocity: [Pack; 3],
    /// Direction of the hair.
    pub tangent: [Pack; 3],
    /// Drag across the hair, newton second per metre.
    pub across: Pack,
    /// Drag along the hair.
    pub along: Pack,
}

/// Everything prescribed in a stage.
pub struct Stage<'a> {
    /// Length of the implicit step, seconds.
    pub h: f64,
    /// Free flight: where inertia alone would carry each node.
    pub y: &'a [[Pack; 3]],
    /// Origin of velocities: `v = (x - base) / h`.
    pub base: &'a [[Pack; 3]],
    /// Contacts, if any lane has one.
    pub contact: Option<&'a mut [Contact]>,
    /// Friction coefficient.
    pub friction: f64,
    /// Whether friction follows the last iteration's normal force and sliding; else it stays as it was, so that later
    /// iterations converge.
    pub refresh: bool,
    /// Whether positions are those of a solve, so that depths are forces; those of a guess may be far too deep.
    pub solved: bool,
    /// Air, if it acts.
    pub air: Option<&'a [Air]>,
    /// Lanes that still move: 1 or 0.
    pub active: Pack,
}

impl<'a> Stage<'a> {
    /// A stage in which nothing acts but inertia and elasticity, on every lane.
    pub fn free(h: f64, y: &'a [[Pack; 3]], base: &'a [[Pack; 3]]) -> Self {
        let active = Pack::splat(1.0);
        Stage { h, y, base, contact: None, friction: 0.0, refresh: false, solved: false, air: None, active }
    }
}

/// Opens the panel of a node, if there is to be a matrix, and its right-hand side: inertia, contact and friction, drag.
#[inline(always)]
pub fn open_node<L: Lanes, const D: usize, const ROWS: usize, const MATRIX: bool>(
    j: usize,
    node: &Node,
    motion: &Motion,
    stage: &mut Stage<'_>,
    window: &mut Window<L, D, ROWS>,
    rhs: &mut [Pack; D],
) {
    // A zero that the compiler does not see: it would clear the panel by a call, 7 % of the time of a step.
    let zero = L::splat(std::hint::black_box(0.0));
    let inverse_h = L::splat(1.0 / stage.h);
    let inertia = L::load(&node.mass) * inverse_h * inverse_h;
    let x = load3::<L>(&motion.x);
    let p = &mut window[j % crate::band::RING];
    let mut b = scale3(sub3(load3(&stage.y[j]), x), inertia);
    if MATRIX {
        for r in 0..ROWS {
            for c in 0..D {
                if r >= c {
                    p.0[r][c] = zero;
                }
            }
        }
        let diagonal = inertia + L::load(&node.held);
        for c in 0..3 {
            p.0[c][c] = diagonal;
        }
    }
    if let Some(air) = stage.air {
        let air = &air[j];
        let velocity = scale3(sub3(x, load3(&stage.base[j])), inverse_h);
        let relative = sub3(velocity, load3(&air.velocity));
        let (across, along) = (L::load(&air.across), L::load(&air.along));
        let tangent = load3::<L>(&air.tangent);
        let more = (along - across) * dot(tangent, relative);
        for r in 0..3 {
            b[r] = across.neg_mul_add(relative[r], more.neg_mul_add(tangent[r], b[r]));
            if !MATRIX {
                continue;
            }
            p.0[r][r] = across.mul_add(inverse_h, p.0[r][r]);
            for c in 0..=r {
                p.0[r][c] = ((along - across) * inverse_h * tangent[r]).mul_add(tangent[c], p.0[r][c]);
            }
        }
    }
    if let Some(contact) = &mut stage.contact {
        let contact = &mut contact[j];
        // Strands that are done keep what they have, however long their neighbours take.
        let active = L::load(&stage.active);
        let n = load3::<L>(&contact.normal);
        let depth = (L::load(&contact.level) - dot(n, x)).max(zero);
        let stiffness = L::if_gt(depth, zero, L::load(&contact.stiffness), zero);
        let force = stiffness * depth;
        let off = sub3(x, load3(&contact.anchor));
        let slip = crate::lanes::neg_mul_add3(n, dot(n, off), off);
        // The force of the last iteration sets the limit, so that the matrix stays symmetric; a secant of the force that
        // does not grow any more lies above it, so that iterations go down.
        if stage.refresh {
            let reach = dot(slip, slip).sqrt().max(L::splat(1e-12));
            let limit = L::splat(stage.friction) * L::load(&contact.force) / reach;
            let hold = L::if_gt(active, zero, limit.min(L::load(&contact.grip)), L::load(&contact.hold));
            hold.store(&mut contact.hold);
        }
        let hold = L::if_gt(depth, zero, L::load(&contact.hold), zero);
        if stage.solved {
            L::if_gt(active, zero, force, L::load(&contact.force)).store(&mut contact.force);
        }
        for r in 0..3 {
            b[r] = hold.neg_mul_add(slip[r], force.mul_add(n[r], b[r]));
            if !MATRIX {
                continue;
            }
            p.0[r][r] = p.0[r][r] + hold;
            for c in 0..=r {
                p.0[r][c] = ((stiffness - hold) * n[r]).mul_add(n[c], p.0[r][c]);
            }
        }
    }
    for c in 0..3 {
        b[c].store(&mut rhs[c]);
    }
    for slot in rhs.iter_mut().skip(3) {
        *slot = Pack::default();
    }
}
