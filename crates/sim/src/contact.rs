//! Hair against the body: planes that nodes may not cross, found anew for every stage.
//!
//! The response (Bridson et al. 2003 in the paper's section 5.1: relative normal velocities are constrained, friction
//! opposes sliding) is part of the implicit stage, see [`crate::stage::Contact`]; here is where contacts are found, how
//! contact ends without a bounce, and how points that are inside anyway come out without a gain of energy.

use crate::Vec3;
use crate::body::Instant;
use crate::group::{Group, lane3};
use crate::lanes::{LANES, Pack};
use crate::stage::{Contact, Motion};

/// Stiffness of contact over a node's inertia m / h^2: the share of a step's approach that is left as depth is one over
/// this. Below 100, fast approaches end 0.1 mm deep; above 1e6 the matrix loses digits to it.
const STIFFNESS: f64 = 1e2;

/// Points that are inside come out no faster than this, metres per second. Faster, and hair born inside jumps; slower,
/// and it stays there for seconds.
const WAY_OUT: f64 = 0.2;

/// Planes are set up for points closer than this, beyond what they may travel in the stage, metres.
const NEAR: f64 = 2e-3;

/// Depth at which the exact mesh pushes a point out, metres. Much less than 0.1 mm, which is what may be seen; more than
/// what contact leaves.
const VISIBLE: f64 = 2e-5;

/// Stiffness of friction's grip over a node's mass, one over square seconds. Hair gives way by its normal force over its
/// mass times friction over this before it slips: 7 micrometres for hair that lies by its weight, under friction 0.3.
/// Much above the inertia 1 / h^2 of a usual stage iterations find the onset of sliding slowly; below, pressed hair creeps.
const GRIP: f64 = 4.3e5;

/// A point on its way out that has come this close to the surface, metres, is put onto it: the field that leads it out is
/// off by less. Above 2e-3 hair jumps by what is seen; below 2e-4 points stay where field and mesh do not agree.
const NEARLY_OUT: f64 = 1e-3;

/// How close points of a group may come to the body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Keep {
    /// What each node keeps, metres: the layer's offset, or less where it was groomed closer, or as much more as the shape is
    /// off where the mesh had to push it out.
    pub most: Vec<Pack>,
    /// 1 for nodes that were put inside (by the groom, a jump, a hold) and are on their way out.
    pub inside: Vec<Pack>,
}

impl Keep {
    /// Distances that nodes keep from now on, from where they are at the beginning.
    pub fn new(g: &Group, body: &Instant<'_, '_>, offset: f64) -> Self {
        let n = g.node.len();
        let mut keep = Keep { most: vec![Pack::splat(offset); n], inside: vec![Pack::default(); n] };
        for l in 0..LANES {
            for i in 0..g.count[l] {
                if is_free(g, i, l) && body.distance_bound(g.x(i, l)) < offset {
                    let (hit, stands_for) = body.nearest(g.x(i, l));
                    // Hair stays as deep in a shape around the skin as it was groomed; out of the skin itself it comes.
                    let least = if stands_for { f64::NEG_INFINITY } else { 0.0 };
                    keep.most[i].0[l] = hit.distance.clamp(least, offset);
                    keep.inside[i].0[l] = f64::from(u8::from(hit.distance < least));
                }
            }
        }
        keep
    }

    /// Points of a strand that was carried may be inside now.
    pub fn carried(g: &mut Group, l: usize, body: &Instant<'_, '_>) {
        for i in 0..g.count[l] {
            if is_free(g, i, l) {
                let p = g.x(i, l);
                let inside = body.distance_bound(p) < 0.0 && body.sample(p).distance < 0.0;
                g.keep.inside[i].0[l] = f64::from(u8::from(inside));
            }
        }
    }
}

/// Points of the axis that nobody holds.
pub fn is_free(g: &Group, i: usize, l: usize) -> bool {
    g.strand[l].is_some() && g.node[i].held.0[l] == 0.0 && g.node[i].share.0[l] > 0.0
}

/// Finds the contacts of some lanes at the nodes' present positions; the lanes that have some. `start` is where nodes were
/// `elapsed` seconds ago, at the beginning of the step.
pub fn find(
    g: &Group,
    start: &[Motion],
    body: &Instant<'_, '_>,
    lanes: [bool; LANES],
    h: f64,
    elapsed: f64,
    contact: &mut [Contact],
) -> [bool; LANES] {
    let mut any = [false; LANES];
    for i in 0..g.node.len() {
        for l in 0..LANES {
            if !lanes[l] {
                continue;
            }
            let c = &mut contact[i];
            c.stiffness.0[l] = 0.0;
            if !is_free(g, i, l) {
                continue;
            }
            let p = g.x(i, l);
            let most = g.keep.most[i].0[l];
            let reach = most + NEAR + 0.5 * h * g.v(i, l).norm();
            let near = body.distance_bound(p) <= reach;
            let Some(hit) = near.then(|| body.sample(p)).filter(|hit| hit.distance < reach) else {
                (c.force.0[l], c.hold.0[l]) = (0.0, 0.0);
                continue;
            };
            any[l] = true;
            let Motion { x, grip, .. } = &start[i];
            // Where it was before the step, carried along by the body.
            let carried: Vec3 = std::array::from_fn(|k| x[k].0[l] + hit.velocity[k] * elapsed).into();
            // Deep points come out slowly: those the groom put inside, and those that the mesh has outside but its field, off by a
            // part of a voxel in a crease, has not. At once, short hair there is thrown about at every frame.
            let before = hit.distance - hit.normal.dot(&(p - carried));
            let keep = most.min(before + WAY_OUT * elapsed);
            c.level.0[l] = hit.normal.dot(&p) - hit.distance + keep;
            for k in 0..3 {
                c.normal[k].0[l] = hit.normal[k];
                c.velocity[k].0[l] = hit.velocity[k];
                c.anchor[k].0[l] = carried[k] - grip[k].0[l];
            }
            c.grip.0[l] = GRIP * g.node[i].mass.0[l];
            c.stiffness.0[l] = STIFFNESS * g.node[i].mass.0[l] / (h * h);
        }
    }
    any
}

/// After a step: no bounce (the relative normal velocity of touching points is 0, not outward), and grips as far as they
/// were dragged.
pub fn settle(g: &mut Group, contact: &[Contact], lanes: [bool; LANES]) {
    let mut touching = [false; LANES];
    for i in 0..g.node.len() {
        for l in (0..LANES).filter(|&l| lanes[l]) {
            let c = &contact[i];
            if c.stiffness.0[l] == 0.0 || c.force.0[l] == 0.0 {
                for p in &mut g.motion[i].grip {
                    p.0[l] = 0.0;
                }
                continue;
            }
            let at = |v: &[Pack; 3]| lane3(v, l);
            let n = at(&c.normal);
            let away = n.dot(&(g.v(i, l) - at(&c.velocity))).max(0.0);
            let off = g.x(i, l) - at(&c.anchor);
            let slip = (off - n * n.dot(&off)) * (c.hold.0[l] / c.grip.0[l]);
            let m = &mut g.motion[i];
            for k in 0..3 {
                m.v[k].0[l] -= away * n[k];
                m.grip[k].0[l] = slip[k];
            }
            touching[l] = true;
        }
    }
    // What an impact did to the acceleration must not be done again.
    for l in (0..LANES).filter(|&l| touching[l]) {
        g.forget_acceleration(l);
    }
}

/// At the end of a span: points that the exact mesh has inside come out to its surface, but not those that are still deep
/// on their way out; strands that sleep are passed over. Returns how many were moved, and how deep the deepest is that stays.
pub fn correct(g: &mut Group, body: &Instant<'_, '_>, asleep: [bool; LANES]) -> (u64, f64) {
    let (mut moved, mut deepest) = (0, 0.0f64);
    for i in 0..g.node.len() {
        for l in (0..LANES).filter(|l| !asleep[*l]) {
            if !is_free(g, i, l) {
                continue;
            }
            let p = g.x(i, l);
            let Some(hit) = body.exact(p, 0.0) else {
                g.keep.inside[i].0[l] = 0.0;
                continue;
            };
            if g.keep.inside[i].0[l] > 0.0 && hit.distance < -NEARLY_OUT {
                deepest = deepest.max(-hit.distance);
            } else if hit.distance < -VISIBLE {
                moved += 1;
                g.keep.inside[i].0[l] = 0.0;
                let to = p - hit.normal * hit.distance;
                // Where the field has room that the mesh has not, hair would come back there in every span.
                let most = &mut g.keep.most[i].0[l];
                *most = most.max(body.sample(to).distance.min(NEARLY_OUT));
                let inward = hit.normal.dot(&(g.v(i, l) - hit.velocity)).min(0.0);
                for k in 0..3 {
                    g.motion[i].x[k].0[l] = to[k];
                    g.motion[i].v[k].0[l] -= inward * hit.normal[k];
                }
            }
        }
    }
    (moved, deepest)
}
