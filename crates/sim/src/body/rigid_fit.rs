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

/// Rounds of [`rigid_part`]: it has settled after three or four where there is such a part.
const ROUNDS: usize = 10;

/// What is left of a part that moves as a whole, relative to its size: the rounding of positions in files.
const RIGID: f64 = 1e-6;

/// The motion of at least half of the points that move as a whole, if there are such (least trimmed squares by concentration,
/// Rousseeuw and Van Driessen 1999, from the fit of all); else the fit of all. Where most of a skin stays as it is, its motion
/// does not follow the rest, which jitters.
pub fn rigid_part(from: &[[f64; 3]], to: &[[f64; 3]]) -> RigidFit {
    let all = rigid_fit(from, to);
    let finite = |i: &usize| from[*i].iter().chain(&to[*i]).all(|x| x.is_finite());
    let points: Vec<usize> = (0..from.len()).filter(finite).collect();
    let pick = |chosen: &[usize], of: &[[f64; 3]]| chosen.iter().map(|i| of[*i]).collect::<Vec<_>>();
    let size = points.iter().map(|i| (Vec3::from(from[*i]) - Vec3::from(from[points[0]])).norm()).fold(0.0, f64::max);
    if all.largest <= RIGID * size || points.len() < 6 {
        return all;
    }
    let mut fit = all;
    for _ in 0..ROUNDS {
        let left = |i: usize| (fit.motion.apply(Vec3::from(from[i])) - Vec3::from(to[i])).norm();
        let mut ranked: Vec<(f64, usize)> = points.iter().map(|i| (left(*i), *i)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let half: Vec<usize> = ranked[..points.len().div_ceil(2)].iter().map(|r| r.1).collect();
        fit = rigid_fit(&pick(&half, from), &pick(&half, to));
    }
    if fit.largest > RIGID * size {
        return all;
    }
    // All that moves so, in the order of the points: the same part gives the same motion, whatever the others do.
    let near = |i: &usize| (fit.motion.apply(Vec3::from(from[*i])) - Vec3::from(to[*i])).norm() <= RIGID * size;
    let part: Vec<usize> = points.into_iter().filter(near).collect();
    let RigidFit { motion, .. } = rigid_fit(&pick(&part, from), &pick(&part, to));
    let left: Vec<f64> = from
        .iter()
        .zip(to)
        .map(|(a, b)| (motion.apply(Vec3::from(*a)) - Vec3::from(*b)).norm_squared())
        .filter(|d| d.is_finite())
        .collect();
    let sum: f64 = left.iter().sum();
    RigidFit {
        motion,
        rms: (sum / left.len() as f64).sqrt(),
        largest: left.iter().fold(0.0f64, |a, b| a.max(*b)).sqrt(),
    }
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

    /// Where 60 % of the points move as a whole it is their motion that is found; where none do, the fit of all.
    #[test]
    fn the_part_that_moves_as_a_whole_is_found() {
        let q = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.4, 0.1));
        let from = points(100);
        let swung = |i: usize, p: &[f64; 3]| {
            let bent = if i % 5 < 2 { Vector3::new(0.03 + 0.2 * p[0], 0.0, -0.1 * p[1]) } else { Vector3::zeros() };
            (q * (Vec3::from(*p) + bent) + Vector3::y()).into()
        };
        let to: Vec<[f64; 3]> = from.iter().enumerate().map(|(i, p)| swung(i, p)).collect();
        let fit = rigid_part(&from, &to);
        let off = |i: usize| (fit.motion.apply(Vec3::from(from[i])) - Vec3::from(to[i])).norm();
        assert!((0..100).filter(|i| i % 5 >= 2).all(|i| off(i) < 1e-14), "{fit:?}");
        assert!(fit.largest > 0.01);
        let soft: Vec<[f64; 3]> = from.iter().map(|p| [p[0] + 0.3 * p[1] * p[1], p[1], p[2]]).collect();
        assert_eq!(rigid_part(&from, &soft), rigid_fit(&from, &soft));
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
