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

/// Places of the keys around `time` and the fraction of the way from the first to the second, for keys that ascend in
/// time: linear in between, held beyond the ends. Of keys at one time the last counts from there on. `None` without keys.
pub fn between<T>(keys: &[T], time_of: impl Fn(&T) -> f64, time: f64) -> Option<(usize, usize, f64)> {
    let last = keys.len().checked_sub(1)?;
    let next = keys.partition_point(|k| time_of(k) <= time);
    let (a, b) = (next.saturating_sub(1), next.min(last));
    let span = time_of(&keys[b]) - time_of(&keys[a]);
    let f = if span > 0.0 { ((time - time_of(&keys[a])) / span).clamp(0.0, 1.0) } else { 0.0 };
    Some((a, b, f))
}

/// A rotation from (x, y, z, w) of length 1.
pub(crate) fn rotation([x, y, z, w]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
}

impl RigidMotion {
    /// The transform at `time` seconds about `pivot`; the identity without samples.
    pub fn at(&self, time: f64, pivot: [f64; 3]) -> RigidTransform {
        let Some((prev, next, f)) = between(&self.time, |t| *t, time) else {
            return RigidTransform { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0; 3], pivot };
        };
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
        let pivot = Vec3::from(self.pivot);
        rotation(self.rotation) * (rest - pivot) + pivot + Vec3::from(self.translation)
    }

    /// Takes a moved position back to the rest pose.
    pub fn invert(&self, moved: Vec3) -> Vec3 {
        let pivot = Vec3::from(self.pivot);
        self.invert_direction(moved - pivot - Vec3::from(self.translation)) + pivot
    }

    /// Takes a direction of the moved pose back to the rest pose.
    pub fn invert_direction(&self, moved: Vec3) -> Vec3 {
        rotation(self.rotation).conjugate() * moved
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
