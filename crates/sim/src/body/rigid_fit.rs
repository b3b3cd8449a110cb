//! The rigid part of a deforming skin's motion.

use super::{Rigid, eigen};
use crate::Vec3;

/// A best rigid motion, and what it leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidFit {
    /// Carries the first pose onto the second.
    pub motion: Rigid,
    /// Root of the mean square distance left, metres.
    pub rms: f64,
    /// Largest distance left, metres.
    pub largest: f64,
}

/// The rotation and translation that carry `from` onto `to` with the least sum of squares: the unit quaternion is the
/// eigenvector of the largest eigenvalue of Horn's 4 x 4 matrix (Horn 1987, "Closed-form solution of absolute
/// orientation using unit quaternions"), which is Kabsch's solution and can't reflect. Points that are not finite in
/// either pose are left out. Where the points leave the rotation open (fewer than three, or on a line) one of the best
/// is taken.
pub fn rigid_fit(from: &[[f64; 3]], to: &[[f64; 3]]) -> RigidFit {
    let pairs = || {
        let finite = |(a, b): &(&[f64; 3], &[f64; 3])| a.iter().chain(b.iter()).all(|x| x.is_finite());
        from.iter().zip(to).filter(finite).map(|(a, b)| (Vec3::from(*a), Vec3::from(*b)))
    };
    let (sum_a, sum_b, n) =
        pairs().fold((Vec3::zeros(), Vec3::zeros(), 0.0), |s, (a, b)| (s.0 + a, s.1 + b, s.2 + 1.0));
    if n == 0.0 {
        return RigidFit { motion: Rigid::default(), rms: 0.0, largest: 0.0 };
    }
    let (mean_a, mean_b) = (sum_a / n, sum_b / n);
    let mut s = [[0.0; 3]; 3];
    for (a, b) in pairs() {
        let (a, b) = (a - mean_a, b - mean_b);
        for i in 0..3 {
            for j in 0..3 {
                s[i][j] += a[i] * b[j];
            }
        }
    }
    let rotation = horn(&s);
    let turn = Rigid { rotation, translation: [0.0; 3] };
    let motion = Rigid { rotation, translation: (mean_b - turn.apply(mean_a)).into() };
    let left = |(a, b): (Vec3, Vec3)| (motion.apply(a) - b).norm_squared();
    let (sum, largest) = pairs().map(left).fold((0.0, 0.0f64), |(s, l), d| (s + d, l.max(d)));
    RigidFit { motion, rms: (sum / n).sqrt(), largest: largest.sqrt() }
}

/// Unit quaternion (x, y, z, w) for sums of products s[i][j] = sum of from_i to_j; w is not negative.
fn horn(s: &[[f64; 3]; 3]) -> [f64; 4] {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = *s;
    let (value, vector) = eigen::symmetric([
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ]);
    // The first of equals: with no points to tell, the identity.
    let best = (1..4).fold(0, |best, k| if value[k] > value[best] { k } else { best });
    let [w, x, y, z] = vector[best];
    let scale = (w * w + x * x + y * y + z * z).sqrt() * if w < 0.0 { -1.0 } else { 1.0 };
    [x, y, z, w].map(|c| c / scale)
}

#[cfg(test)]
mod tests {
    use super::super::testing::random_in;
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    fn points(n: u64) -> Vec<[f64; 3]> {
        (0..n).map(|i| random_in(i, [-0.1, -0.3, 0.9], [0.2, 0.1, 1.0]).into()).collect()
    }

    #[test]
    fn motions_are_recovered_up_to_half_a_turn() {
        for (i, angle) in [0.0, 1e-9, 0.3, 1.5, 3.0, std::f64::consts::PI].into_iter().enumerate() {
            let q = UnitQuaternion::from_scaled_axis(random_in(i as u64, [-1.0; 3], [1.0; 3]).normalize() * angle);
            let shift = Vector3::new(5.0, -2.0, 1.0);
            let from = points(50);
            let to: Vec<[f64; 3]> = from.iter().map(|p| (q * Vec3::from(*p) + shift).into()).collect();
            let fit = rigid_fit(&from, &to);
            assert!(fit.rms < 1e-14 && fit.largest < 1e-14, "{angle}: {fit:?}");
            let r = fit.motion.quaternion();
            let off = |x: Vec3| (r * x - q * x).norm();
            assert!(off(Vec3::x()) + off(Vec3::y()) + off(Vec3::z()) < 1e-13);
        }
    }

    #[test]
    fn no_small_motion_beside_it_is_better() {
        let from = points(60);
        let to: Vec<[f64; 3]> =
            (0u64..).zip(&from).map(|(i, p)| [p[1] + 0.02 * random_in(i, [0.0; 3], [1.0; 3]).x, -p[0], p[2]]).collect();
        let fit = rigid_fit(&from, &to);
        let cost = |m: &Rigid| -> f64 {
            from.iter().zip(&to).map(|(a, b)| (m.apply(Vec3::from(*a)) - Vec3::from(*b)).norm_squared()).sum()
        };
        assert!((cost(&fit.motion) / 60.0 - fit.rms * fit.rms).abs() < 1e-15);
        for i in 0..40 {
            let turn = UnitQuaternion::from_scaled_axis(random_in(i, [-1e-3; 3], [1e-3; 3])) * fit.motion.quaternion();
            let c = turn.coords;
            let shift = Vec3::from(fit.motion.translation) + random_in(i + 100, [-1e-3; 3], [1e-3; 3]);
            let other = Rigid { rotation: [c.x, c.y, c.z, c.w], translation: shift.into() };
            assert!(cost(&other) > cost(&fit.motion));
        }
    }

    #[test]
    fn mirrors_lines_and_bad_points_give_rotations() {
        let from = points(20);
        let mirrored: Vec<[f64; 3]> = from.iter().map(|p| [-p[0], p[1], p[2]]).collect();
        let line: Vec<[f64; 3]> = (0..5).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let mut bad = from.clone();
        bad[3][1] = f64::NAN;
        for (a, b) in [(&from, &mirrored), (&line, &line), (&from, &bad), (&vec![[1.0; 3]], &vec![[2.0; 3]])] {
            let fit = rigid_fit(a, b);
            let norm: f64 = fit.motion.rotation.iter().map(|x| x * x).sum();
            assert!((norm - 1.0).abs() < 1e-12 && fit.rms.is_finite());
        }
        assert!(rigid_fit(&from, &bad).rms < 1e-14);
        assert_eq!(rigid_fit(&[[1.0; 3]], &[[2.0; 3]]).motion.translation, [1.0; 3]);
        assert_eq!(rigid_fit(&[], &[]).motion, Rigid::default());
    }
}
