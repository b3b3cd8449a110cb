//! Control hairs that benchmarks blend.

use pelage_geom::{Vec3, rng};
use pelage_groom::interpolate::ControlPose;

/// Control hairs.
pub const CONTROLS: usize = 1_000;

/// A random number in [0, 1).
pub fn u(id: usize, k: u64) -> f64 {
    rng::uniform(1, id as u64, 2, k)
}

/// Crooked control hairs of `points` points.
pub fn controls(points: usize) -> ControlPose {
    let mut lines = Vec::with_capacity(CONTROLS * points);
    for h in 0..CONTROLS {
        let mut p = Vec3::zeros();
        for s in 0..points as u64 {
            lines.push(p);
            p += Vec3::new(u(h, 3 * s) - 0.5, 1.0, u(h, 3 * s + 1) - 0.5);
        }
    }
    ControlPose::from_polylines(&lines, points, points)
}
