//! Rigid motions sampled in time.

use crate::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};

/// A rigid motion given by samples in time: positions linear between them, rotations by slerp, held beyond the ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RigidMotion {
    /// Seconds, ascending.
    pub time: Vec<f64>,
    /// Displacements from the rest pose, scene units.
    pub translation: Vec<[f64; 3]>,
    /// Rotations from the rest pose as unit quaternions (x, y, z, w).
    pub rotation: Vec<[f64; 4]>,
}

/// `world = rotation * (rest - pivot) + pivot + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidTransform {
    /// Unit quaternion (x, y, z, w).
    pub rotation: [f64; 4],
    /// Displacement, scene units.
    pub translation: [f64; 3],
    /// Point that the rotation leaves in place, scene units.
    pub pivot: [f64; 3],
}

impl RigidMotion {
    /// The transform at `time` seconds about `pivot`; the identity without samples.
    pub fn at(&self, time: f64, pivot: [f64; 3]) -> RigidTransform {
        let Some(last) = self.time.len().checked_sub(1) else {
            return RigidTransform { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0; 3], pivot };
        };
        let next = self.time.partition_point(|&t| t <= time).min(last);
        let prev = if time >= self.time[last] { last } else { next.saturating_sub(1) };
        let span = self.time[next] - self.time[prev];
        let f = if span > 0.0 { ((time - self.time[prev]) / span).clamp(0.0, 1.0) } else { 0.0 };
        let (a, b) = (self.translation[prev], self.translation[next]);
        RigidTransform {
            rotation: slerp(self.rotation[prev], self.rotation[next], f),
            translation: std::array::from_fn(|i| a[i] + (b[i] - a[i]) * f),
            pivot,
        }
    }
}

/// Spherical interpolation along the shorter arc, with portable sine and arc cosine.
fn slerp(a: [f64; 4], b: [f64; 4], f: f64) -> [f64; 4] {
    let dot: f64 = (0..4).map(|i| a[i] * b[i]).sum();
    let (dot, sign) = if dot < 0.0 { (-dot, -1.0) } else { (dot, 1.0) };
    let (wa, wb) = if dot > 0.999_999 {
        (1.0 - f, f)
    } else {
        let angle = libm::acos(dot);
        let s = libm::sin(angle);
        (libm::sin((1.0 - f) * angle) / s, libm::sin(f * angle) / s)
    };
    let q: [f64; 4] = std::array::from_fn(|i| wa * a[i] + wb * sign * b[i]);
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / norm)
}

impl RigidTransform {
    /// Moves a rest-pose position.
    pub fn apply(&self, rest: Vec3) -> Vec3 {
        let [x, y, z, w] = self.rotation;
        let q = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        let pivot = Vec3::from(self.pivot);
        q * (rest - pivot) + pivot + Vec3::from(self.translation)
    }

    /// Takes a moved position back to the rest pose.
    pub fn invert(&self, moved: Vec3) -> Vec3 {
        let [x, y, z, w] = self.rotation;
        let q = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        let pivot = Vec3::from(self.pivot);
        q.conjugate() * (moved - pivot - Vec3::from(self.translation)) + pivot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_way_through_a_quarter_turn_is_an_eighth() {
        let h = std::f64::consts::FRAC_1_SQRT_2;
        let m = RigidMotion {
            time: vec![0.0, 2.0],
            translation: vec![[0.0; 3], [4.0, 0.0, 0.0]],
            rotation: vec![[0.0, 0.0, 0.0, 1.0], [0.0, -h, 0.0, -h]],
        };
        let p = m.at(1.0, [0.0; 3]).apply(Vec3::new(0.0, 0.0, 1.0));
        assert!((p - Vec3::new(2.0 + h, 0.0, h)).norm() < 1e-12, "{p}");
        for (t, x) in [(-1.0, 0.0), (0.0, 0.0), (2.0, 4.0), (9.0, 4.0)] {
            assert_eq!(m.at(t, [0.0; 3]).translation[0], x);
        }
        let (t, rest) = (m.at(0.7, [3.0, -1.0, 2.0]), Vec3::new(0.3, -0.5, 1.0));
        assert!((t.invert(t.apply(rest)) - rest).norm() < 1e-14);
    }
}
