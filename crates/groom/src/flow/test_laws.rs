//! Derivatives of velocities by finite differences.

use pelage_geom::Vec3;

/// Jacobian columns by central differences of fourth order.
fn jacobian(f: &dyn Fn(Vec3) -> Vec3, at: Vec3) -> [Vec3; 3] {
    const H: f64 = 1e-3;
    std::array::from_fn(|i| {
        let e = Vec3::ith(i, H);
        ((f(at + e) - f(at - e)) * 8.0 - (f(at + e * 2.0) - f(at - e * 2.0))) / (12.0 * H)
    })
}

/// Divergence at a point.
pub(crate) fn divergence(f: &dyn Fn(Vec3) -> Vec3, at: Vec3) -> f64 {
    let j = jacobian(f, at);
    j[0].x + j[1].y + j[2].z
}

/// Curl at a point.
pub(crate) fn curl(f: &dyn Fn(Vec3) -> Vec3, at: Vec3) -> Vec3 {
    let j = jacobian(f, at);
    Vec3::new(j[1].z - j[2].y, j[2].x - j[0].z, j[0].y - j[1].x)
}
