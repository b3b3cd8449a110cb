//! The mass-spring model in lanes: what a particle adds to the open columns of its strand's matrix.
//!
//! The same model as [`super::plain`]. Constants that every solve reads, state, and what only the choice of altitudes
//! reads, once a step, lie apart, so that memory is read once and no more than needed.

use super::plain::{COINCIDENT, COLINEAR, Choice, FIRM, HALF, HYSTERESIS, LOWEST, Model, NUDGE};
use super::tetrahedron::{CANDIDATES, TINY, chosen};
use crate::band::{RING, Window};
use crate::lanes::{self, L3, LANES, Lanes, Pack};

/// Constants of the springs that end at a particle. Where there is none the stiffness is 0 and the length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeModel {
    /// `k / l0` to the first, second and third particle before, newtons per metre.
    pub stiffness: [Pack; 3],
    /// Their rest lengths, metres.
    pub length: [Pack; 3],
    /// 1 where the second spring bends a hinge, 0 where it is a segment over its extra particle.
    pub bends: Pack,
    /// `K` of the altitude spring, joules.
    pub altitude: Pack,
}

/// The altitude in use at a particle: state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeAltitude {
    /// Which of the area vectors `A_1, A_2, A_3` make it up: 1 or 0.
    pub face: [Pack; 3],
    /// `s / h0`, per metre.
    pub inverse_height: Pack,
    /// Strain carried over changes less the rest strain.
    pub offset: Pack,
    /// Pull of the first two springs over their length as the tangent has it, newtons per metre ([`pull_node`]).
    pub pull: [Pack; 2],
}

/// What only the choice of altitudes reads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeCandidates {
    /// `s / h0` of each candidate, per metre.
    pub inverse_height: [Pack; CANDIDATES],
    /// Strain is measured from this.
    pub rest: Pack,
    /// 1 for a free particle, 0 for a held one or none.
    pub free: Pack,
}

/// Up to eight strands side by side, padded to the longest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Constants, one a particle.
    pub model: Vec<NodeModel>,
    /// For the choice of altitudes.
    pub candidates: Vec<NodeCandidates>,
    /// Masses, kilograms; 1 for padding.
    pub mass: Vec<Pack>,
    /// 1 for held particles and padding, 0 for free ones.
    pub held: Vec<Pack>,
    /// 1 where the particle before is an extra one: the axis runs from the second particle before.
    pub skip: Vec<Pack>,
    /// Relaxation time of bending and twisting, seconds.
    pub damping: f64,
}

/// Packs at most [`LANES`] strands; further lanes and the ends of shorter strands are inert.
pub fn pack(strands: &[&Model]) -> Group {
    let n = strands.iter().map(|s| s.mass.len()).max().unwrap_or(0);
    let (zero, one) = (Pack::default(), Pack::splat(1.0));
    let mut group = Group {
        model: vec![NodeModel { stiffness: [zero; 3], length: [one; 3], bends: zero, altitude: zero }; n],
        candidates: vec![NodeCandidates::default(); n],
        mass: vec![one; n],
        held: vec![one; n],
        skip: vec![zero; n],
        damping: strands.first().map_or(0.0, |s| s.damping),
    };
    for (lane, s) in strands.iter().enumerate().take(LANES) {
        for i in 0..s.mass.len() {
            let (m, c) = (&mut group.model[i], &mut group.candidates[i]);
            for (k, spring) in s.spring[i].iter().enumerate() {
                if spring.stiffness > 0.0 {
                    m.stiffness[k].0[lane] = spring.stiffness;
                    m.length[k].0[lane] = spring.length;
                }
            }
            m.bends.0[lane] = f64::from(u8::from(i >= 2 && !s.extra[i - 1]));
            m.altitude.0[lane] = s.tetrahedron[i].stiffness;
            for (to, v) in c.inverse_height.iter_mut().zip(s.tetrahedron[i].inverse_height) {
                to.0[lane] = v;
            }
            c.rest.0[lane] = s.tetrahedron[i].rest;
            group.mass[i].0[lane] = s.mass[i];
            let held = f64::from(u8::from(s.held[i]));
            group.held[i].0[lane] = held;
            c.free.0[lane] = 1.0 - held;
            group.skip[i].0[lane] = f64::from(u8::from(i >= 2 && s.extra[i - 1]));
        }
    }
    group
}

/// Packs the altitudes in use.
pub fn pack_altitudes(strands: &[(&Model, &[Choice])]) -> Vec<NodeAltitude> {
    let n = strands.iter().map(|s| s.1.len()).max().unwrap_or(0);
    let mut altitude = vec![NodeAltitude::default(); n];
    for (lane, (model, choices)) in strands.iter().enumerate().take(LANES) {
        for (i, c) in choices.iter().enumerate() {
            let t = &model.tetrahedron[i];
            for (to, v) in altitude[i].face.iter_mut().zip(chosen(c.candidate as usize)) {
                to.0[lane] = v;
            }
            altitude[i].inverse_height.0[lane] = t.inverse_height[c.candidate as usize];
            altitude[i].offset.0[lane] = c.carried - t.rest;
        }
    }
    altitude
}

/// Symmetric 3 x 3: xx, yx, yy, zx, zy, zz.
type Symmetric<L> = [L; 6];

/// Index into [`Symmetric`] by row and column.
const AT: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];

#[inline(always)]
fn outer<L: Lanes>(v: L3<L>, scale: L) -> Symmetric<L> {
    let s = lanes::scale3(v, scale);
    [s[0] * v[0], s[1] * v[0], s[1] * v[1], s[2] * v[0], s[2] * v[1], s[2] * v[2]]
}

/// Vector from particle `i - k` to `i`; never all zero.
#[inline(always)]
fn difference<L: Lanes>(x: &[[Pack; 3]], i: usize, k: usize) -> L3<L> {
    let mut d = lanes::sub3(lanes::load3(&x[i]), lanes::load3(&x[i - k]));
    d[k - 1] = d[k - 1] + L::splat(COINCIDENT);
    d
}

/// Length of `d` and its inverse.
#[inline(always)]
fn length<L: Lanes>(d: L3<L>) -> (L, L) {
    let square = lanes::dot(d, d);
    let length = square.sqrt();
    (length, L::splat(1.0) / length)
}

/// Pull of the spring to particle `i - k`, and its block of the tangent. `moved` is how much farther the particle has
/// moved than the other since the origin of velocities.
#[inline(always)]
fn spring<L: Lanes, const ROBUST: bool>(
    model: &NodeModel,
    node: &NodeAltitude,
    k: usize,
    d: L3<L>,
    moved: L3<L>,
    rate: L,
) -> (L3<L>, Symmetric<L>) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let stiffness = L::load(&model.stiffness[k - 1]);
    let rest = L::load(&model.length[k - 1]);
    let (length, inverse) = length(d);
    if ROBUST {
        let hinge = match k {
            1 => zero,
            2 => L::load(&model.bends),
            _ => one,
        };
        let rate = rate * hinge;
        let stretch = rest.neg_mul_add(inverse, one);
        // Strain and damping, over the length.
        let pull = (rate * inverse * inverse).mul_add(lanes::dot(d, moved), stretch);
        let force = lanes::scale3(d, stiffness * pull);
        let across = if k < 3 { L::load(&node.pull[k - 1]) } else { stiffness * pull };
        let across = across.max(L::splat(LOWEST) * L::load(&model.stiffness[2]));
        let along = (one + rate).mul_add(stiffness, -across) * inverse * inverse;
        let mut m = outer(d, along);
        for q in [0, 2, 5] {
            m[q] = m[q] + across;
        }
        (force, m)
    } else {
        let force = lanes::scale3(d, stiffness * (length - rest) * inverse);
        (force, outer(d, stiffness * inverse * inverse))
    }
}

/// The altitude of the tetrahedron with the differences `d`: weights of particles `i`, `i - 1`, ..., the unscaled
/// direction, the inverse of its squared length, and the strain.
#[inline(always)]
fn altitude<L: Lanes>(node: &NodeAltitude, d: &[L3<L>; 3]) -> ([L; 4], L3<L>, L, L) {
    let a = [lanes::cross(d[1], d[2]), lanes::cross(d[2], d[0]), lanes::cross(d[0], d[1])];
    let face = lanes::load3::<L>(&node.face);
    let n = lanes::mul_add3(a[0], face[0], lanes::mul_add3(a[1], face[1], lanes::scale3(a[2], face[2])));
    let inverse = L::splat(1.0) / (lanes::dot(n, n) + L::splat(TINY));
    let w = [lanes::dot(n, a[0]) * inverse, lanes::dot(n, a[1]) * inverse, lanes::dot(n, a[2]) * inverse];
    let height = -(lanes::dot(d[0], a[0]) * inverse.sqrt());
    let strain = height.mul_add(L::load(&node.inverse_height), L::load(&node.offset));
    ([-(w[0] + w[1] + w[2]), w[0], w[1], w[2]], n, inverse, strain)
}

/// How far particle `i` has moved beyond particle `i - k` since the origin of velocities.
#[inline(always)]
fn movement<L: Lanes>(d: L3<L>, base: &[[Pack; 3]], i: usize, k: usize) -> L3<L> {
    lanes::sub3(d, lanes::sub3(lanes::load3(&base[i]), lanes::load3(&base[i - k])))
}

/// Adds all springs that end at particle `i` to the columns `i - 3 ..= i` and their forces to the right-hand sides:
/// after it column `i - 3` is complete. Column `i` must have been begun.
///
/// `ROBUST` with damping and geometric terms; without, section 4.1's fixed directions. `base` is the origin of
/// velocities, `rate` the relaxation time over the time since.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
pub fn add_node<L: Lanes, const ROBUST: bool>(
    i: usize,
    model: &NodeModel,
    node: &NodeAltitude,
    x: &[[Pack; 3]],
    base: &[[Pack; 3]],
    rate: L,
    window: &mut Window<L, 3, 12>,
    rhs: &mut [[Pack; 3]],
) {
    if i < 3 {
        for k in 1..=i {
            let d = difference(x, i, k);
            let (force, m) = spring::<L, ROBUST>(model, node, k, d, movement(d, base, i, k), rate);
            add_diagonal(window, i, &m);
            add_diagonal(window, i - k, &m);
            add_block(window, i, i - k, &m, L::splat(-1.0));
            push(rhs, i, lanes::scale3(force, L::splat(-1.0)));
            push(rhs, i - k, force);
        }
        return;
    }
    let d = [difference::<L>(x, i, 1), difference(x, i, 2), difference(x, i, 3)];
    let moved = [movement(d[0], base, i, 1), movement(d[1], base, i, 2), movement(d[2], base, i, 3)];
    let mut own = [L::splat(0.0); 6];
    let mut at_i = [L::splat(0.0); 3];
    for k in 1..=3 {
        let (force, m) = spring::<L, ROBUST>(model, node, k, d[k - 1], moved[k - 1], rate);
        at_i = lanes::sub3(at_i, force);
        push(rhs, i - k, force);
        for q in 0..6 {
            own[q] = own[q] + m[q];
        }
        add_diagonal(window, i - k, &m);
        add_block(window, i, i - k, &m, L::splat(-1.0));
    }
    add_diagonal(window, i, &own);
    push(rhs, i, at_i);
    add_altitude::<L, ROBUST>(i, model, node, &d, &moved, rate, window, rhs);
}

/// Adds the altitude spring of particles `i - 3 ..= i`, as [`super::plain::tangent`].
#[allow(clippy::too_many_arguments)]
#[inline(always)]
fn add_altitude<L: Lanes, const ROBUST: bool>(
    i: usize,
    model: &NodeModel,
    node: &NodeAltitude,
    d: &[L3<L>; 3],
    moved: &[L3<L>; 3],
    rate: L,
    window: &mut Window<L, 3, 12>,
    rhs: &mut [[Pack; 3]],
) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let (w, n, inverse, strain) = altitude(node, d);
    let scale = inverse.sqrt();
    let n = lanes::scale3(n, scale);
    let below = (strain - L::splat(HALF)).min(zero);
    let law = L::splat(FIRM - 1.0).mul_add(below, strain);
    let firm = L::if_gt(L::splat(HALF), strain, L::splat(FIRM), one);
    let gain = L::load(&model.altitude) * L::load(&node.inverse_height);
    let slope = gain * L::load(&node.inverse_height) * firm;
    let mut pull = gain * law;
    if ROBUST {
        // The altitude grows by -(w_k n) . moved_k, the weights of all four being 0 in sum.
        let grown = lanes::mul_add3(moved[0], w[1], lanes::mul_add3(moved[1], w[2], lanes::scale3(moved[2], w[3])));
        pull = (slope * rate).neg_mul_add(lanes::dot(n, grown), pull);
    }
    for k in 0..4 {
        push(rhs, i - k, lanes::scale3(n, -(pull * w[k])));
    }
    if ROBUST {
        let slope = slope * (one + rate);
        // Of the strain alone: damping's part would be as often negative as positive.
        let pull = L::if_gt(strain, L::splat(HALF), gain * law, zero);
        let face = lanes::load3::<L>(&node.face);
        let height = -(lanes::dot(d[0], lanes::cross(d[1], d[2])) * scale);
        let turn = |j: usize, k: usize| {
            let m = lanes::neg_mul_add3(d[k], face[j], lanes::scale3(d[j], face[k]));
            lanes::scale3(lanes::cross(n, m), scale)
        };
        let (q1, q2, q3) = (turn(1, 2), turn(2, 0), turn(0, 1));
        let q = [lanes::scale3(lanes::add3(q1, lanes::add3(q2, q3)), -one), q1, q2, q3];
        for a in 0..4 {
            for b in a..4 {
                let along = (pull * height).neg_mul_add(lanes::dot(q[a], q[b]), slope * w[a] * w[b]);
                // Half of what is along the normal goes with either factor.
                let left = lanes::neg_mul_add3(q[b], pull * w[a], lanes::scale3(n, along));
                let right = lanes::scale3(q[a], -(pull * w[b]));
                let panel = &mut window[(i - b) % RING].0;
                let first = 3 * (b - a);
                for r in 0..3 {
                    for c in 0..if a == b { r + 1 } else { 3 } {
                        let sum = left[r].mul_add(n[c], panel[first + r][c]);
                        panel[first + r][c] = n[r].mul_add(right[c], sum);
                    }
                }
            }
        }
    } else {
        let t = outer(n, slope);
        for k in 0..4 {
            let m: Symmetric<L> = std::array::from_fn(|q| t[q] * (w[k] * w[k]));
            add_diagonal(window, i - k, &m);
            for back in k + 1..4 {
                add_block(window, i - k, i - back, &t, w[k] * w[back]);
            }
        }
    }
}

#[inline(always)]
fn push<L: Lanes>(rhs: &mut [[Pack; 3]], i: usize, f: L3<L>) {
    let sum = lanes::add3(lanes::load3::<L>(&rhs[i]), f);
    lanes::store3(sum, &mut rhs[i]);
}

#[inline(always)]
fn add_diagonal<L: Lanes>(window: &mut Window<L, 3, 12>, i: usize, m: &Symmetric<L>) {
    let panel = &mut window[i % RING].0;
    for r in 0..3 {
        for c in 0..=r {
            panel[r][c] = panel[r][c] + m[AT[r][c]];
        }
    }
}

#[inline(always)]
fn add_block<L: Lanes>(window: &mut Window<L, 3, 12>, row: usize, column: usize, m: &Symmetric<L>, scale: L) {
    let panel = &mut window[column % RING].0;
    let first = 3 * (row - column);
    for r in 0..3 {
        for c in 0..3 {
            panel[first + r][c] = m[AT[r][c]].mul_add(scale, panel[first + r][c]);
        }
    }
}

/// The pulls that the tangent takes in an iteration. With `solution`, those to which an iteration from `x` leads by its
/// own, linear reckoning, where `active`; else those at `x`.
///
/// Nodes move along straight lines, so an iteration that turns segments leaves them stretched by half the turn's square,
/// and the pull of that would make bending appear many times as stiff to the next. The linear one is the force that holds
/// the length (a Lagrange multiplier's estimate, as in sequential quadratic programming).
#[inline(always)]
pub fn pull_node<L: Lanes>(
    i: usize,
    model: &NodeModel,
    node: &mut NodeAltitude,
    x: &[[Pack; 3]],
    solution: Option<(&[[Pack; 3]], L)>,
) {
    for k in 1..=2.min(i) {
        let d = difference::<L>(x, i, k);
        let (_, inverse) = length(d);
        let mut pull = L::load(&model.length[k - 1]).neg_mul_add(inverse, L::splat(1.0));
        let mut on = L::splat(1.0);
        if let Some((solution, active)) = solution {
            let by = lanes::sub3(lanes::load3::<L>(&solution[i]), lanes::load3(&solution[i - k]));
            pull = (lanes::dot(d, by) * inverse).mul_add(inverse, pull);
            on = active;
        }
        let slot = &mut node.pull[k - 1];
        L::if_gt(on, L::splat(0.0), pull * L::load(&model.stiffness[k - 1]), L::load(slot)).store(slot);
    }
}

/// Elastic energy of all springs that end at particle `i`, joules.
#[inline(always)]
pub fn energy_node<L: Lanes>(i: usize, model: &NodeModel, node: &NodeAltitude, x: &[[Pack; 3]]) -> L {
    let half = L::splat(0.5);
    let mut sum = L::splat(0.0);
    for k in 1..=3 {
        if k <= i {
            let stretch = length(difference::<L>(x, i, k)).0 - L::load(&model.length[k - 1]);
            sum = (half * L::load(&model.stiffness[k - 1]) * stretch).mul_add(stretch, sum);
        }
    }
    if i >= 3 {
        let d = [difference::<L>(x, i, 1), difference(x, i, 2), difference(x, i, 3)];
        let strain = altitude(node, &d).3;
        let below = (strain - L::splat(HALF)).min(L::splat(0.0));
        let law = strain.mul_add(strain, L::splat(FIRM - 1.0) * below * below);
        sum = (half * L::load(&model.altitude)).mul_add(law, sum);
    }
    sum
}

/// Chooses the altitude of the tetrahedron that ends at particle `i` anew, as [`super::plain::choose`]; in ascending
/// order, once a step.
#[inline(always)]
pub fn choose_node<L: Lanes>(
    i: usize,
    candidates: &NodeCandidates,
    node: &mut NodeAltitude,
    x: &mut [[Pack; 3]],
    relax: L,
) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mut d = [difference::<L>(x, i, 1), difference(x, i, 2), difference(x, i, 3)];
    let mut a = [lanes::cross(d[1], d[2]), lanes::cross(d[2], d[0]), lanes::cross(d[0], d[1])];
    let mut areas = areas_squared(&a);
    let mut most = areas[0];
    for area in &areas[1..] {
        most = most.max(*area);
    }
    // Off the line.
    let other = lanes::sub3(lanes::load3::<L>(&x[i - 1]), lanes::load3(&x[i - 2]));
    let (long2, other2) = (lanes::dot(d[2], d[2]), lanes::dot(other, other));
    let longest: L3<L> = std::array::from_fn(|c| L::if_gt(long2, other2, d[2][c], other[c]));
    let size2 = long2.max(other2);
    let limit = L::splat(COLINEAR) * size2 * size2;
    let nudge = L::if_gt(limit, most, L::splat(NUDGE), zero) * L::load(&candidates.free) * size2.sqrt();
    let off = lanes::scale3(perpendicular(longest), nudge);
    let moved = lanes::add3(lanes::load3::<L>(&x[i]), off);
    lanes::store3(moved, &mut x[i]);
    for e in &mut d {
        *e = lanes::add3(*e, off);
    }
    a = [lanes::cross(d[1], d[2]), lanes::cross(d[2], d[0]), lanes::cross(d[0], d[1])];
    areas = areas_squared(&a);

    let value = -lanes::dot(d[0], a[0]);
    let face = lanes::load3::<L>(&node.face);
    let n = lanes::mul_add3(a[0], face[0], lanes::mul_add3(a[1], face[1], lanes::scale3(a[2], face[2])));
    let now2 = lanes::dot(n, n);
    let rest = L::load(&candidates.rest);
    let strain_of =
        |area2: L, inverse_height: L| value * (one / (area2 + L::splat(TINY))).sqrt() * inverse_height - rest;
    let (mut best2, mut best) = (now2, face);
    let mut inverse_height = L::load(&node.inverse_height);
    let before = strain_of(now2, inverse_height);
    let strain = before + rest + L::load(&node.offset);
    for (c, area2) in areas.into_iter().enumerate() {
        let bits = chosen(c).map(L::splat);
        let height = L::load(&candidates.inverse_height[c]);
        best = std::array::from_fn(|j| L::if_gt(area2, best2, bits[j], best[j]));
        inverse_height = L::if_gt(area2, best2, height, inverse_height);
        best2 = best2.max(area2);
    }
    let bar = now2.mul_add(L::splat(HYSTERESIS), L::splat(TINY));
    let choose = |new: L, old: L| L::if_gt(best2, bar, new, old);
    lanes::store3(std::array::from_fn(|j| choose(best[j], face[j])), &mut node.face);
    let after = choose(strain_of(best2, inverse_height), before);
    choose(inverse_height, L::load(&node.inverse_height)).store(&mut node.inverse_height);
    let carried = strain - after;
    // What was carried fades.
    let (size, reach) = (carried.max(-carried), strain.max(-strain));
    let lowers = L::if_gt(carried * strain, zero, (relax * size).min(reach), zero);
    let fade = L::if_gt(L::splat(HALF), after, relax * size, lowers);
    let carried = carried - L::if_gt(zero, carried, -fade, fade);
    (carried - rest).store(&mut node.offset);
}

/// `|u x v|^2` of all candidates.
#[inline(always)]
fn areas_squared<L: Lanes>(a: &[L3<L>; 3]) -> [L; CANDIDATES] {
    let two = L::splat(2.0);
    let own = [lanes::dot(a[0], a[0]), lanes::dot(a[1], a[1]), lanes::dot(a[2], a[2])];
    let pair = [lanes::dot(a[0], a[1]), lanes::dot(a[0], a[2]), lanes::dot(a[1], a[2])];
    let both = |j: usize, k: usize, p: usize| two.mul_add(pair[p], own[j] + own[k]);
    let all = own[0] + own[1] + own[2] + two * (pair[0] + pair[1] + pair[2]);
    [own[0], own[1], both(0, 1, 0), own[2], both(0, 2, 1), both(1, 2, 2), all]
}

/// A unit vector across `t`.
#[inline(always)]
fn perpendicular<L: Lanes>(t: L3<L>) -> L3<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let a = [t[0].max(-t[0]), t[1].max(-t[1]), t[2].max(-t[2])];
    let y_least = L::if_gt(a[1], a[2], zero, one);
    let x_least = L::if_gt(a[0], a[1], zero, L::if_gt(a[0], a[2], zero, one));
    let e = [x_least, (one - x_least) * y_least, (one - x_least) * (one - y_least)];
    let across = lanes::cross(t, e);
    let square = lanes::dot(across, across) + L::splat(TINY);
    lanes::scale3(across, one / square.sqrt())
}
