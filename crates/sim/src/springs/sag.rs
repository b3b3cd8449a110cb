//! Start without sag: a groom is a pose under gravity.
//!
//! A particle hangs on three springs to particles nearer the root, so the truss of a strand held at its root alone is
//! statically determinate: one sweep from tip to root of 3 x 3 solves gives every tension `t`, whatever the constants, and
//! `t = k (l/l0 - 1)` the rest lengths `l0 = l k / (k + t)`. Altitude springs stay at rest: their rest heights are the
//! pose's.
//!
//! An equilibrium need not be stable: the signs of the tangent's pivots tell (Sylvester's law of inertia). A strand that
//! can't stand is stiffened in bending and twisting until it can.

use super::plain::{self, Choice, Model, Spring};
use crate::Vec3;
use crate::band::HELD;
use nalgebra::Matrix3;

/// Largest `|t| / k` of bending and torsion springs that is left as it is. At 1 a rest length would be infinite or a
/// spring's stiffness gone; at 0.1 a straight horizontal hair of 15 cm would be stiffened already (20 cm: 0.27).
pub const LIMIT: f64 = 0.5;

/// Stiffest that a strand is made for its pose to stand, as for rods. Hair that would need more keeps some of its sag.
const STIFFEST: f64 = 64.0;

/// Springs as they are under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sagged {
    /// Largest `|t| / k` before anything was stiffened.
    pub load: f64,
    /// Factor on bending, torsion and altitude springs that keeps loads below [`LIMIT`] and lets the pose stand; 1 mostly.
    pub factor: f64,
}

/// Changes the rest lengths so that `x` is in equilibrium under `gravity` (metres per second squared).
///
/// `None`, and nothing changed, where the truss is not determinate: both ends held, or a root that turns freely; or where
/// four particles are in a plane.
pub fn without_sag(model: &mut Model, x: &[Vec3], gravity: Vec3) -> Option<Sagged> {
    let n = x.len();
    if n < 4 || model.held[n - 1] || !(0..n).all(|i| model.held[i] == (i < 3)) {
        return None;
    }
    let mut force: Vec<Vec3> = model.mass.iter().map(|m| gravity * *m).collect();
    let mut tension = vec![[0.0; 3]; n];
    for i in (3..n).rev() {
        let toward = |k: usize| (x[i - k] - x[i]).normalize();
        let along = [toward(1), toward(2), toward(3)];
        let t = Matrix3::from_columns(&along).lu().solve(&-force[i])?;
        for k in 1..=3 {
            tension[i][k - 1] = t[k - 1];
            force[i - k] -= along[k - 1] * t[k - 1];
        }
    }
    if !tension.iter().flatten().all(|t| t.is_finite()) {
        return None;
    }
    // A spring bends or twists unless it is a triangle's side.
    let extra = model.extra.clone();
    let hinge = |i: usize, k: usize| k == 3 || (k == 2 && !extra[i - 1]);
    let mut load = 0.0_f64;
    for (i, t) in tension.iter().enumerate().skip(3) {
        for k in (1..=3).filter(|&k| hinge(i, k)) {
            let spring = &model.spring[i][k - 1];
            load = load.max(t[k - 1].abs() / (spring.stiffness * spring.length));
        }
    }
    let mut factor = (load / LIMIT).clamp(1.0, STIFFEST);
    let choices = model.choices();
    let natural = model.clone();
    loop {
        for i in 3..n {
            for k in 1..=3 {
                let was = natural.spring[i][k - 1];
                let constant = was.stiffness * was.length * if hinge(i, k) { factor } else { 1.0 };
                let l = (x[i] - x[i - k]).norm();
                // A spring bears no more than leaves it a rest length.
                let most = LIMIT * constant;
                let length = l * constant / (constant + tension[i][k - 1].clamp(-most, most));
                model.spring[i][k - 1] = Spring { stiffness: constant / length, length };
            }
            model.tetrahedron[i].stiffness = natural.tetrahedron[i].stiffness * factor;
        }
        if 2.0 * factor > STIFFEST || stands(model, &choices, x) {
            break;
        }
        factor *= 2.0;
    }
    Some(Sagged { load, factor })
}

/// Whether the tangent at `x` is positive definite: banded elimination in scalars.
fn stands(model: &Model, choices: &[Choice], x: &[Vec3]) -> bool {
    const BAND: usize = 12;
    let n = 3 * x.len();
    let mut rows = vec![[0.0; BAND]; n];
    for (i, blocks) in plain::tangent(model, choices, x, true).iter().enumerate() {
        for (k, block) in blocks.iter().enumerate().take(i + 1) {
            for (r, c) in (0..9).map(|e| (e / 3, e % 3)) {
                let (row, column) = (3 * i + r, 3 * (i - k) + c);
                if column <= row {
                    rows[row][row - column] += block[(r, c)];
                }
            }
        }
        if model.held[i] {
            (0..3).for_each(|c| rows[3 * i + c][0] += HELD);
        }
    }
    for j in 0..n {
        if rows[j][0] < 0.0 {
            return false;
        }
        for r in j + 1..(j + BAND).min(n) {
            let l = rows[r][r - j] / rows[j][0];
            for k in j + 1..=r {
                rows[r][r - k] -= l * rows[k][k - j];
            }
        }
    }
    true
}
