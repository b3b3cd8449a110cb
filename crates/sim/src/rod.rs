//! Discrete elastic rod: a centreline of nodes, and a material frame on every edge.
//!
//! Energy (M. Bergou et al., "Discrete Elastic Rods", 2008, and "Discrete Viscous Threads", 2010, for a round section):
//!
//! `E = sum 1/2 ks (|e| - l)^2 + sum 1/2 kb |kappa - kappa0|^2 + sum 1/2 kt (m - m0)^2`
//!
//! with ks = EA / l on edges, kb = EI / l', kt = GJ / l' at inner nodes, l' half the length of both edges. The curvature
//! `kappa` has the direction of t0 x t1 and a length close to the angle between the edges: the papers' 2 tan(angle / 2)
//! would be 2 % too stiff at 0.25 rad, so a rational function is used that stays within 1e-4 of the angle up to 1 rad
//! and still grows without bound as an edge folds back. It is measured in the frame half-way between those of the two
//! edges. The twist `m` is the angle between frames after parallel transport, measured in the same way.
//!
//! The tangent matrix is Gauss-Newton (a sum of squares, hence positive semidefinite) plus what the moments add, which may
//! be indefinite (inertia outweighs it, or the step is halved), plus the positive part of the geometric stiffness of
//! stretched edges. Twist has no inertia worth a step: it is solved along with the positions, in balance, and
//! frames are carried in time by parallel transport plus that turn.

use crate::band::{self, Column, RING, Window};
use crate::hinge::{Blocks, Edge, FOLDED, Hinge, edge, moment, second, straight_hinge, transport, twisting_hinge};
use crate::lanes::{L3, Lanes, Pack, add3, cross, dot, load3, mul_add3, neg_mul_add3, scale3, store3, sub3};
use crate::stage::{LARGEST_TURN, Motion, Node, Stage, open_node};

/// Elastic constants of a node's hinge and of the edge behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Elastic {
    /// Stretching stiffness of the edge from this node to the next, newton per metre.
    pub stretch: Pack,
    /// Bending stiffness of the hinge at this node, newton metres (per radian); 0 at the ends.
    pub bend: Pack,
    /// Twisting stiffness of the hinge, newton metres.
    pub twist: Pack,
    /// Natural curvature in both material directions, radians, and natural twist, radians.
    pub rest: [Pack; 3],
    /// Rotational inertia of the edge about its axis, kilogram square metres: bounds turns in the tangent alone.
    pub spin: Pack,
}

/// Adds the stretching of the edge from node `i` to `i + 1`.
#[inline(always)]
fn add_edge<L: Lanes, const D: usize, const ROWS: usize, const MATRIX: bool>(
    i: usize,
    e: &Edge<L>,
    rest: L,
    stiffness: L,
    foreseen: L,
    window: &mut Window<L, D, ROWS>,
    rhs: &mut [[Pack; D]],
) {
    let zero = L::splat(0.0);
    let pull = stiffness * (e.length - rest);
    let across = foreseen.max(zero) * e.inverse;
    let along = stiffness - across;
    for r in 0..3 {
        let f = pull * e.t[r];
        (L::load(&rhs[i][r]) + f).store(&mut rhs[i][r]);
        (L::load(&rhs[i + 1][r]) - f).store(&mut rhs[i + 1][r]);
        if !MATRIX {
            continue;
        }
        for c in 0..=r {
            let mut k = along * e.t[r] * e.t[c];
            if r == c {
                k = k + across;
            }
            let (here, next) = (&mut window[i % RING].0, i + 1);
            here[r][c] = here[r][c] + k;
            here[D + r][c] = here[D + r][c] - k;
            if r != c {
                here[D + c][r] = here[D + c][r] - k;
            }
            let next = &mut window[next % RING].0;
            next[r][c] = next[r][c] + k;
        }
    }
}

/// Weights of a hinge's measures in an iteration.
struct Weight<L> {
    /// Stiffness of each measure.
    k: [L; 3],
    /// Force of each measure: stiffness times (value - rest + damping rate).
    force: [L; 3],
    /// Stiffness with damping.
    damped: [L; 3],
}

/// Component `r` of three vectors.
#[inline(always)]
fn column<L: Lanes>(v: &[L3<L>; 3], r: usize) -> L3<L> {
    [v[0][r], v[1][r], v[2][r]]
}

/// Products, one by one.
#[inline(always)]
fn times<L: Lanes>(a: L3<L>, b: L3<L>) -> L3<L> {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

/// Adds a hinge at node `i` (edges `i - 1` and `i`).
#[inline(always)]
fn add_hinge<L: Lanes, const D: usize, const ROWS: usize, const MATRIX: bool>(
    i: usize,
    h: &Hinge<L>,
    w: &Weight<L>,
    second: Blocks<L>,
    window: &mut Window<L, D, ROWS>,
    rhs: &mut [[Pack; D]],
) {
    let Blocks { mut aa, mut ab, mut bb } = second;
    for r in 0..3 {
        let (a, b) = (column(&h.a, r), column(&h.b, r));
        let (fa, fb) = (dot(w.force, a), dot(w.force, b));
        (L::load(&rhs[i - 1][r]) + fa).store(&mut rhs[i - 1][r]);
        (L::load(&rhs[i][r]) + (fb - fa)).store(&mut rhs[i][r]);
        (L::load(&rhs[i + 1][r]) - fb).store(&mut rhs[i + 1][r]);
        if !MATRIX {
            continue;
        }
        let (wa, wb) = (times(a, w.damped), times(b, w.damped));
        for c in 0..3 {
            ab[r][c] = ab[r][c] + dot(wa, column(&h.b, c));
            if c <= r {
                aa[r][c] = aa[r][c] + dot(wa, column(&h.a, c));
                bb[r][c] = bb[r][c] + dot(wb, column(&h.b, c));
                (aa[c][r], bb[c][r]) = (aa[r][c], bb[r][c]);
            }
        }
    }
    // The three nodes move the measures by -a, a - b and b.
    for r in 0..if MATRIX { 3 } else { 0 } {
        for c in 0..3 {
            let first = &mut window[(i - 1) % RING].0;
            first[D + r][c] = first[D + r][c] + (ab[c][r] - aa[r][c]);
            first[2 * D + r][c] = first[2 * D + r][c] - ab[c][r];
            if c <= r {
                first[r][c] = first[r][c] + aa[r][c];
            }
            let middle = &mut window[i % RING].0;
            middle[D + r][c] = middle[D + r][c] + (ab[c][r] - bb[r][c]);
            if c <= r {
                middle[r][c] = middle[r][c] + ((aa[r][c] + bb[r][c]) - (ab[r][c] + ab[c][r]));
                let last = &mut window[(i + 1) % RING].0;
                last[r][c] = last[r][c] + bb[r][c];
            }
        }
    }
    if D == 4 {
        add_turns::<L, D, ROWS, MATRIX>(i, h, w, window, rhs);
    }
}

/// The rows and columns of both edges' turns.
#[inline(always)]
fn add_turns<L: Lanes, const D: usize, const ROWS: usize, const MATRIX: bool>(
    i: usize,
    h: &Hinge<L>,
    w: &Weight<L>,
    window: &mut Window<L, D, ROWS>,
    rhs: &mut [[Pack; D]],
) {
    let (t0, t1) = ([h.turn[0][0], h.turn[1][0], h.turn[2][0]], [h.turn[0][1], h.turn[1][1], h.turn[2][1]]);
    let (p, q) = (times(t0, w.damped), times(t1, w.damped));
    let t = 3;
    (L::load(&rhs[i - 1][t]) - dot(w.force, t0)).store(&mut rhs[i - 1][t]);
    (L::load(&rhs[i][t]) - dot(w.force, t1)).store(&mut rhs[i][t]);
    if !MATRIX {
        return;
    }
    // The moment turns with the frames: half of the mean turn's second derivative.
    let half = L::splat(0.5);
    let (f1, f2) = (half * w.force[0], half * w.force[1]);
    let turned = -(half * f1.mul_add(h.value[0], f2 * h.value[1]));
    let first = &mut window[(i - 1) % RING].0;
    first[t][t] = first[t][t] + dot(p, t0) + turned;
    first[D + t][t] = first[D + t][t] + dot(p, t1) + turned;
    for r in 0..3 {
        let a = [h.a[0][r], h.a[1][r], h.a[2][r]];
        let b = [h.b[0][r], h.b[1][r], h.b[2][r]];
        let (ta, tb) = (f2.neg_mul_add(a[0], f1 * a[1]), f2.neg_mul_add(b[0], f1 * b[1]));
        let (pa, pb, qa) = (dot(p, a) + ta, dot(p, b) + tb, dot(q, a) + ta);
        // Turn of the first edge against the three nodes.
        first[t][r] = first[t][r] - pa;
        first[D + r][t] = first[D + r][t] + pa - pb;
        first[2 * D + r][t] = first[2 * D + r][t] + pb;
        // Turn of the second edge against the first node.
        first[D + t][r] = first[D + t][r] - qa;
    }
    let middle = &mut window[i % RING].0;
    middle[t][t] = middle[t][t] + dot(q, t1) + turned;
    for r in 0..3 {
        let a = [h.a[0][r], h.a[1][r], h.a[2][r]];
        let b = [h.b[0][r], h.b[1][r], h.b[2][r]];
        let (ta, tb) = (f2.neg_mul_add(a[0], f1 * a[1]), f2.neg_mul_add(b[0], f1 * b[1]));
        let (qa, qb) = (dot(q, a) + ta, dot(q, b) + tb);
        middle[t][r] = middle[t][r] + qa - qb;
        middle[D + r][t] = middle[D + r][t] + qb;
    }
}

/// Buffers of a solve.
#[derive(Clone, Debug, Default)]
pub struct Scratch<const D: usize, const ROWS: usize> {
    /// Right-hand sides, then the solution.
    pub rhs: Vec<[Pack; D]>,
    /// The factor.
    pub factor: Vec<Column<D, ROWS>>,
    /// Tension of the edge from each node to the next as the tangent has it, newtons: that of the last converged state, then
    /// that to which each iteration leads by its own, linear reckoning. Nodes move along straight lines, so positions in
    /// between are stretched by half a turn's square, and the tension of that would stiffen bending manyfold.
    pub pull: Vec<Pack>,
}

impl<const D: usize, const ROWS: usize> Scratch<D, ROWS> {
    /// Room for `nodes` nodes.
    pub fn reserve(&mut self, nodes: usize) {
        self.rhs.resize(nodes + 4, [Pack::default(); D]);
        self.factor.resize(nodes, [[Pack::default(); D]; ROWS]);
        self.pull.resize(nodes, Pack::default());
    }
}

/// Internal damping: force per rate of a measure over its stiffness, seconds.
#[derive(Clone, Copy, Debug)]
pub struct Damping(pub f64);

/// Assembles and solves one iteration; the movement is left in `scratch.rhs`. `again`: with the factor of the last
/// iteration (a chord step), a third of the work, good where little has moved since.
///
/// `D` = 4 with twist, 3 without; `ROWS` = 2 D + 3.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
pub fn solve<L: Lanes, const D: usize, const ROWS: usize>(
    nodes: &[Node],
    elastic: &[Elastic],
    motion: &[Motion],
    turned: &[Pack],
    damping: Damping,
    stage: &mut Stage<'_>,
    scratch: &mut Scratch<D, ROWS>,
    again: bool,
) {
    if again {
        sweep::<L, D, ROWS, false>(nodes, elastic, motion, turned, damping, stage, scratch);
        band::solve::<L, D, ROWS>(&scratch.factor[..nodes.len()], &mut scratch.rhs);
        return;
    }
    sweep::<L, D, ROWS, true>(nodes, elastic, motion, turned, damping, stage, scratch);
    for j in (0..nodes.len()).rev() {
        band::substitute::<L, D, ROWS>(j, &scratch.factor[j], &mut scratch.rhs);
    }
}

/// Assembles node by node and eliminates behind; without a matrix, `scratch.rhs` is left with the negative gradient.
#[inline(always)]
pub fn sweep<L: Lanes, const D: usize, const ROWS: usize, const MATRIX: bool>(
    nodes: &[Node],
    elastic: &[Elastic],
    motion: &[Motion],
    turned: &[Pack],
    damping: Damping,
    stage: &mut Stage<'_>,
    scratch: &mut Scratch<D, ROWS>,
) {
    let zero = L::splat(0.0);
    let n = nodes.len();
    let rhs = &mut scratch.rhs[..n + 4];
    for r in &mut rhs[n..] {
        *r = [Pack::default(); D];
    }
    let mut window: Window<L, D, ROWS> = [band::Panel::zero(); RING];
    let rate = damping.0 / stage.h;
    let damp = L::splat(1.0 + rate);
    let beta_h = L::splat(rate);
    let spin_scale = L::splat(1.0 / (stage.h * stage.h));
    let mut before: Option<Edge<L>> = None;
    let mut here = edge::<L>(load3(&motion[0].x), load3(&motion[1].x));
    open_turn::<L, D, ROWS, MATRIX>(0, nodes, elastic, motion, stage, &mut window, rhs, spin_scale);
    for i in 0..n {
        if i + 1 < n {
            let next = if i + 2 < n { edge::<L>(load3(&motion[i + 1].x), load3(&motion[i + 2].x)) } else { here };
            open_turn::<L, D, ROWS, MATRIX>(i + 1, nodes, elastic, motion, stage, &mut window, rhs, spin_scale);
            let (rest, stretch) = (L::load(&nodes[i].length), L::load(&elastic[i].stretch));
            add_edge::<L, D, ROWS, MATRIX>(i, &here, rest, stretch, L::load(&scratch.pull[i]), &mut window, rhs);
            if let Some(e0) = &before {
                let e = &elastic[i];
                let h = if D == 4 {
                    twisting_hinge(e0, &here, load3(&motion[i - 1].m), load3(&motion[i].m))
                } else {
                    straight_hinge(e0, &here)
                };
                let kb = L::load(&e.bend);
                let k = if D == 4 { [kb, kb, L::load(&e.twist)] } else { [kb; 3] };
                let d01 = sub3(change::<L>(i - 1, motion, stage), change::<L>(i, motion, stage));
                let d12 = sub3(change::<L>(i, motion, stage), change::<L>(i + 1, motion, stage));
                let mut w = Weight { k, force: [zero; 3], damped: [zero; 3] };
                for q in 0..3 {
                    let mut r = h.value[q] - if D == 4 { L::load(&e.rest[q]) } else { zero };
                    let moved = -(dot(h.a[q], d01) + dot(h.b[q], d12));
                    r = beta_h.mul_add(moved, r);
                    if D == 4 {
                        let (t0, t1) = (L::load(&turned[i - 1]), L::load(&turned[i]));
                        r = beta_h.mul_add(h.turn[q][0].mul_add(t0, h.turn[q][1] * t1), r);
                    }
                    w.force[q] = w.k[q] * r;
                    w.damped[q] = w.k[q] * damp;
                }
                let second = if !MATRIX {
                    Blocks { aa: [[zero; 3]; 3], ab: [[zero; 3]; 3], bb: [[zero; 3]; 3] }
                } else if D == 4 {
                    let m = [load3::<L>(&motion[i - 1].m), load3::<L>(&motion[i].m)];
                    let moment = moment([e0, &here], m, &h, w.force);
                    second(e0, &here, add3(moment.n[0], moment.n[1]), Some(moment))
                } else {
                    second(e0, &here, w.force, None)
                };
                add_hinge::<L, D, ROWS, MATRIX>(i, &h, &w, second, &mut window, rhs);
            }
            before = Some(here);
            here = next;
        }
        if MATRIX && i >= 1 {
            band::eliminate::<L, D, ROWS>(i - 1, &mut window, &mut scratch.factor[i - 1], rhs);
        }
    }
    if MATRIX {
        band::eliminate::<L, D, ROWS>(n - 1, &mut window, &mut scratch.factor[n - 1], rhs);
    }
}

/// Movement of a node since the origin of velocities.
#[inline(always)]
fn change<L: Lanes>(j: usize, motion: &[Motion], stage: &Stage<'_>) -> L3<L> {
    sub3(load3(&motion[j].x), load3(&stage.base[j]))
}

/// Opens a node's panel and that of the turn of the edge behind it. Inertia about the axis only bounds a turn that nothing
/// resists. Its torque is left out: a turn counts from the parallel frame, which is no inertial one, so free hair would be
/// braked from outside (a hundredth of its angular momentum in half a second).
#[allow(clippy::too_many_arguments)]
#[inline(always)]
fn open_turn<L: Lanes, const D: usize, const ROWS: usize, const MATRIX: bool>(
    j: usize,
    nodes: &[Node],
    elastic: &[Elastic],
    motion: &[Motion],
    stage: &mut Stage<'_>,
    window: &mut Window<L, D, ROWS>,
    rhs: &mut [[Pack; D]],
    spin_scale: L,
) {
    open_node::<L, D, ROWS, MATRIX>(j, &nodes[j], &motion[j], stage, window, &mut rhs[j]);
    if MATRIX && D == 4 {
        let spin = L::load(&elastic[j].spin) * spin_scale;
        window[j % RING].0[3][3] = spin + L::load(&nodes[j].held_turn);
    }
}

#[inline(always)]
fn delta<L: Lanes, const D: usize>(rhs: &[Pack; D]) -> L3<L> {
    [L::load(&rhs[0]), L::load(&rhs[1]), L::load(&rhs[2])]
}

/// `x + d scale` where the scale is above 0.
#[inline(always)]
fn moved<L: Lanes>(x: L3<L>, d: L3<L>, scale: L) -> L3<L> {
    let zero = L::splat(0.0);
    let to = mul_add3(d, scale, x);
    [L::if_gt(scale, zero, to[0], x[0]), L::if_gt(scale, zero, to[1], x[1]), L::if_gt(scale, zero, to[2], x[2])]
}

/// A frame's direction after its edge has moved, without a turn about it (parallel transport in time).
#[inline(always)]
pub(crate) fn carried<L: Lanes>(from: &Edge<L>, to: &Edge<L>, m: L3<L>) -> L3<L> {
    let one = L::splat(1.0);
    let folded = one / (dot(from.t, to.t) + one).max(L::splat(FOLDED));
    transport(m, from.t, to.t, folded)
}

/// Moves the nodes and frames by the solution, no segment by more than [`LARGEST_TURN`]; returns the square of the
/// largest movement over the edge's length.
#[inline(always)]
pub fn apply<L: Lanes, const D: usize, const ROWS: usize>(
    nodes: &[Node],
    elastic: Option<&[Elastic]>,
    motion: &mut [Motion],
    turned: &mut [Pack],
    active: &Pack,
    scratch: &mut Scratch<D, ROWS>,
) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let n = nodes.len();
    let mut largest = zero;
    let mut last = delta::<L, D>(&scratch.rhs[0]);
    for j in 1..n {
        let d = delta::<L, D>(&scratch.rhs[j]);
        let length = L::load(&nodes[j - 1].length);
        let bend = sub3(d, last);
        largest = largest.max((dot(bend, bend) / (length * length)).max(zero));
        if D == 4 {
            let turn = L::load(&scratch.rhs[j - 1][3]);
            largest = largest.max(turn * turn);
        }
        last = d;
    }
    let limit = L::splat(LARGEST_TURN * LARGEST_TURN);
    let scale = L::if_gt(largest, limit, (limit / largest).sqrt(), one);
    let on = L::load(active);
    // Not a product with `active`: what is not a number must stay out of lanes that are done.
    let scale = L::if_gt(on, zero, scale, zero);
    let mut old = load3::<L>(&motion[0].x);
    let mut new = moved(old, delta::<L, D>(&scratch.rhs[0]), scale);
    store3(new, &mut motion[0].x);
    for j in 1..n {
        let old_next = load3::<L>(&motion[j].x);
        let new_next = moved(old_next, delta::<L, D>(&scratch.rhs[j]), scale);
        store3(new_next, &mut motion[j].x);
        if let Some(elastic) = elastic {
            let e0 = edge(old, old_next);
            let by = sub3(delta::<L, D>(&scratch.rhs[j]), delta::<L, D>(&scratch.rhs[j - 1]));
            let long = dot(e0.t, by).mul_add(scale, e0.length) - L::load(&nodes[j - 1].length);
            let pull = L::load(&elastic[j - 1].stretch) * long;
            L::if_gt(scale, zero, pull, L::load(&scratch.pull[j - 1])).store(&mut scratch.pull[j - 1]);
        }
        if D == 4 {
            let (e0, e1) = (edge(old, old_next), edge(new, new_next));
            let m = carried(&e0, &e1, load3(&motion[j - 1].m));
            let turn = L::if_gt(scale, zero, L::load(&scratch.rhs[j - 1][3]) * scale, zero);
            (L::load(&turned[j - 1]) + turn).store(&mut turned[j - 1]);
            // Cayley's rotation: an exact rotation by almost `turn`.
            let half = turn * L::splat(0.5);
            let d = one / half.mul_add(half, one);
            let cosine = (half.neg_mul_add(half, one)) * d;
            let sine = (half + half) * d;
            let m = mul_add3(cross(e1.t, m), sine, scale3(m, cosine));
            let m = neg_mul_add3(e1.t, dot(e1.t, m), m);
            let inverse = one / dot(m, m).max(L::splat(1e-60)).sqrt();
            let (was, now) = (load3::<L>(&motion[j - 1].m), scale3(m, inverse));
            // Strands that are done keep every bit, however long their neighbours take.
            let keep = |c: usize| L::if_gt(scale, zero, now[c], was[c]);
            store3([keep(0), keep(1), keep(2)], &mut motion[j - 1].m);
        }
        (old, new) = (old_next, new_next);
    }
    largest
}

/// The measures of every hinge as they are become its natural ones, and the lengths of the edges their rest lengths.
#[inline(always)]
pub fn relax<L: Lanes>(nodes: &mut [Node], elastic: &mut [Elastic], motion: &[Motion]) {
    for i in 0..nodes.len() - 1 {
        let here = edge::<L>(load3(&motion[i].x), load3(&motion[i + 1].x));
        here.length.store(&mut nodes[i].length);
        if i > 0 {
            let before = edge::<L>(load3(&motion[i - 1].x), load3(&motion[i].x));
            let h = twisting_hinge(&before, &here, load3(&motion[i - 1].m), load3(&motion[i].m));
            store3(h.value, &mut elastic[i].rest);
        }
    }
}

/// Largest part of its length by which an edge's natural length may differ from that at rest. At 1 hair as heavy as lead
/// has edges of no length or less; real hair's are within 0.001.
const BEARS: f64 = 0.5;

/// Natural shape and rest lengths such that the hair as it stands is in equilibrium under `weight` (newtons, per node).
///
/// A strand clamped at one end is statically determinate: from the tip to the root, the edge's tension and the three
/// moments of its hinge follow from the four equations of the node and the turn behind it. `free` is 1 in lanes and at
/// nodes where this applies (beyond the clamp, up to the tip).
#[inline(always)]
pub fn stand<L: Lanes>(
    nodes: &mut [Node],
    elastic: &mut [Elastic],
    motion: &[Motion],
    weight: &[[Pack; 3]],
    free: &[Pack],
    force: &mut Vec<[Pack; 3]>,
) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let n = nodes.len();
    // What hinges and edges must bear at every node, still open.
    force.clear();
    force.extend_from_slice(weight);
    let mut torque = zero;
    for i in (1..n - 1).rev() {
        let e0 = edge::<L>(load3(&motion[i - 1].x), load3(&motion[i].x));
        let e1 = edge::<L>(load3(&motion[i].x), load3(&motion[i + 1].x));
        let h = twisting_hinge(&e0, &e1, load3(&motion[i - 1].m), load3(&motion[i].m));
        let on = L::load(&free[i + 1]);
        let f = load3::<L>(&force[i + 1]);
        let tension = dot(f, e1.t);
        // Forces of the hinge on the node ahead, across the edge; the torque about the edge along it, scaled by its
        // length.
        let lever = |k: usize| mul_add3(e1.t, h.turn[k][1] * e1.inverse, h.b[k]);
        let c = [lever(0), lever(1), lever(2)];
        let f = mul_add3(e1.t, torque * e1.inverse, neg_mul_add3(e1.t, tension, f));
        let (c12, c20, c01) = (cross(c[1], c[2]), cross(c[2], c[0]), cross(c[0], c[1]));
        // A hinge folded back onto itself has no lever to bear anything with.
        let volume = dot(c[0], c12);
        let inverse = L::if_gt(on * volume * volume, zero, on / volume, zero);
        let moment = [dot(f, c12) * inverse, dot(f, c20) * inverse, dot(f, c01) * inverse];
        let e = &mut elastic[i];
        let k = [L::load(&e.bend), L::load(&e.bend), L::load(&e.twist)];
        for q in 0..3 {
            let natural = h.value[q] - moment[q] / L::if_gt(k[q], zero, k[q], one);
            L::if_gt(on, zero, natural, L::load(&e.rest[q])).store(&mut e.rest[q]);
        }
        let stretch = L::load(&elastic[i].stretch);
        let rest = e1.length - on * tension / L::if_gt(stretch, zero, stretch, one);
        // An edge bears no more than leaves it a length.
        let (least, most) = (e1.length * L::splat(1.0 - BEARS), e1.length * L::splat(1.0 + BEARS));
        let rest = L::if_gt(rest, least, rest, least);
        let rest = L::if_gt(most, rest, rest, most);
        L::if_gt(on, zero, rest, L::load(&nodes[i].length)).store(&mut nodes[i].length);
        // The reactions go on to the nodes behind.
        let a = sum3(&h.a, moment);
        let b = sum3(&h.b, moment);
        let tension = tension * on;
        let here = add3(load3(&force[i]), mul_add3(e1.t, tension, sub3(b, a)));
        store3(here, &mut force[i]);
        store3(add3(load3(&force[i - 1]), a), &mut force[i - 1]);
        torque = -(h.turn[0][0].mul_add(moment[0], h.turn[1][0].mul_add(moment[1], h.turn[2][0] * moment[2])));
    }
}

#[inline(always)]
fn sum3<L: Lanes>(v: &[L3<L>; 3], s: [L; 3]) -> L3<L> {
    mul_add3(v[0], s[0], mul_add3(v[1], s[1], scale3(v[2], s[2])))
}

/// What [`watch`] finds in every lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Watch {
    /// Square of the sine of the largest turn of an edge since `before`.
    pub turn: Pack,
    /// Largest strain.
    pub strain: Pack,
    /// Square of the largest speed.
    pub speed: Pack,
    /// 0 if every position and velocity is a number, else not a number.
    pub finite: Pack,
}

/// Looks a step over.
#[inline(always)]
pub fn watch<L: Lanes>(nodes: &[Node], elastic: &[Elastic], before: &[Motion], after: &[Motion], out: &mut Watch) {
    let zero = L::splat(0.0);
    let (mut turn, mut strain, mut speed, mut finite) = (zero, zero, zero, zero);
    for i in 0..nodes.len() {
        let v = load3::<L>(&after[i].v);
        speed = dot(v, v).max(speed);
        finite = (v[0] + v[1] + v[2]).mul_add(zero, finite);
        if i + 1 < nodes.len() {
            let e0 = edge::<L>(load3(&before[i].x), load3(&before[i + 1].x));
            let e1 = edge::<L>(load3(&after[i].x), load3(&after[i + 1].x));
            let s = cross(e0.t, e1.t);
            // An edge that turned by more than a right angle has a small sine again.
            let large = L::if_gt(zero, dot(e0.t, e1.t), L::splat(4.0), dot(s, s));
            turn = L::if_gt(L::load(&elastic[i].stretch), zero, large, zero).max(turn);
            let rest = L::load(&nodes[i].length);
            let stretched = (e1.length - rest) / rest;
            let real = L::if_gt(L::load(&elastic[i].stretch), zero, stretched.max(-stretched), zero);
            strain = real.max(strain);
        }
        let x = load3::<L>(&after[i].x);
        finite = (x[0] + x[1] + x[2]).mul_add(zero, finite);
    }
    turn.store(&mut out.turn);
    strain.store(&mut out.strain);
    speed.store(&mut out.speed);
    finite.store(&mut out.finite);
}

#[cfg(test)]
#[path = "rod_tests.rs"]
mod tests;
