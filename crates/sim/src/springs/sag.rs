//! Start without sag: a groom is a pose under gravity.
//!
//! A particle hangs on three springs to particles nearer the root, so the truss of a strand held at its root alone is
//! statically determinate: one sweep from tip to root of 3 x 3 solves gives every tension `t`, whatever the constants, and
//! `t = k (l/l0 - 1)` the rest lengths `l0 = l k / (k + t)`. Altitude springs stay at rest: their rest heights are the
//! pose's.

use super::plain::Model;
use crate::Vec3;
use nalgebra::Matrix3;

/// Largest `|t| / k` of bending and torsion springs that is left as it is. At 1 a rest length would be infinite or a
/// spring's stiffness gone; at 0.1 the tips of hair of 15 cm are stiffened needlessly.
pub const LIMIT: f64 = 0.5;

/// Springs as they are under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sagged {
    /// Largest `|t| / k` before anything was stiffened.
    pub load: f64,
    /// Factor on bending, torsion and altitude springs that keeps loads below [`LIMIT`]; 1 mostly.
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
    let constant = |i: usize, k: usize| model.spring[i][k - 1].stiffness * model.spring[i][k - 1].length;
    let mut load = 0.0_f64;
    for (i, t) in tension.iter().enumerate().skip(3) {
        for k in (1..=3).filter(|&k| hinge(i, k)) {
            load = load.max(t[k - 1].abs() / constant(i, k));
        }
    }
    let factor = (load / LIMIT).max(1.0);
    for i in 3..n {
        for k in 1..=3 {
            let spring = &mut model.spring[i][k - 1];
            let constant = spring.stiffness * spring.length * if hinge(i, k) { factor } else { 1.0 };
            let l = (x[i] - x[i - k]).norm();
            spring.length = l * constant / (constant + tension[i][k - 1]);
            spring.stiffness = constant / spring.length;
        }
        model.tetrahedron[i].stiffness *= factor;
    }
    Some(Sagged { load, factor })
}
