//! What the tests of colliders share.

use crate::Vec3;
use pelage_geom::{Mesh, rng};

/// A point of a box, one for each `i`.
pub fn random_in(i: u64, low: [f64; 3], high: [f64; 3]) -> Vec3 {
    Vec3::from(std::array::from_fn(|a| low[a] + (high[a] - low[a]) * rng::uniform(7, i, a as u64, 0)))
}

/// A sample mesh, whose centimetres become metres.
pub fn metres(mut mesh: Mesh) -> Mesh {
    mesh.position.iter_mut().flatten().for_each(|x| *x *= 0.01);
    mesh
}
