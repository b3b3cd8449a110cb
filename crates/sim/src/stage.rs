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

/// Sliding slower than this counts as sticking, metres per second: Coulomb friction is viscous below it. Above 1e-3
/// hair creeps visibly on slopes; below 1e-7 the lagged iteration needs many passes.
const STICK_SPEED: f64 = 1e-5;

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
    /// Friction as a viscous drag, newton second per metre.
    pub drag: Pack,
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

/// Opens the panel of a node: inertia, contact and friction, drag.
#[inline(always)]
pub fn open_node<L: Lanes, const D: usize, const ROWS: usize>(
    j: usize,
    node: &Node,
    motion: &Motion,
    stage: &mut Stage<'_>,
    window: &mut Window<L, D, ROWS>,
    rhs: &mut [Pack; D],
) {
    let zero = L::splat(0.0);
    let inverse_h = L::splat(1.0 / stage.h);
    let inertia = L::load(&node.mass) * inverse_h * inverse_h;
    let x = load3::<L>(&motion.x);
    let p = &mut window[j % crate::band::RING];
    for r in 0..ROWS {
        for c in 0..D {
            if r >= c {
                p.0[r][c] = zero;
            }
        }
    }
    let diagonal = inertia + L::load(&node.held);
    let mut b = scale3(sub3(load3(&stage.y[j]), x), inertia);
    for c in 0..3 {
        p.0[c][c] = diagonal;
    }
    let velocity = scale3(sub3(x, load3(&stage.base[j])), inverse_h);
    if let Some(air) = stage.air {
        let air = &air[j];
        let relative = sub3(velocity, load3(&air.velocity));
        let (across, along) = (L::load(&air.across), L::load(&air.along));
        let tangent = load3::<L>(&air.tangent);
        let more = (along - across) * dot(tangent, relative);
        for r in 0..3 {
            b[r] = across.neg_mul_add(relative[r], more.neg_mul_add(tangent[r], b[r]));
            p.0[r][r] = across.mul_add(inverse_h, p.0[r][r]);
            for c in 0..=r {
                p.0[r][c] = ((along - across) * inverse_h * tangent[r]).mul_add(tangent[c], p.0[r][c]);
            }
        }
    }
    if let Some(contact) = &mut stage.contact {
        let contact = &mut contact[j];
        let n = load3::<L>(&contact.normal);
        let depth = (L::load(&contact.level) - dot(n, x)).max(zero);
        let stiffness = L::if_gt(depth, zero, L::load(&contact.stiffness), zero);
        let force = stiffness * depth;
        let relative = sub3(velocity, load3(&contact.velocity));
        let slide = crate::lanes::neg_mul_add3(n, dot(n, relative), relative);
        let speed = dot(slide, slide).sqrt().max(L::splat(STICK_SPEED));
        // The force of the last iteration sets the friction, so that the matrix stays symmetric.
        if stage.refresh {
            (L::splat(stage.friction) * L::load(&contact.force) / speed).store(&mut contact.drag);
        }
        let drag = L::if_gt(depth, zero, L::load(&contact.drag), zero);
        if stage.solved {
            force.store(&mut contact.force);
        }
        for r in 0..3 {
            b[r] = drag.neg_mul_add(slide[r], force.mul_add(n[r], b[r]));
            p.0[r][r] = drag.mul_add(inverse_h, p.0[r][r]);
            for c in 0..=r {
                p.0[r][c] = (drag.neg_mul_add(inverse_h, stiffness) * n[r]).mul_add(n[c], p.0[r][c]);
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
