//! Motions of the bust: a deforming one with a skinned neck, and a rigid head shake.

use super::field::{bump, fold, v};
use crate::{Mesh, RigidMotion, Vec3};
use std::f64::consts::{PI, TAU};

/// The base of the neck, cm: the pivot of [`head_shake`].
pub const BUST_PIVOT: [f64; 3] = [0.0, -6.0, -4.0];

/// Where the head turns and nods on the neck.
const ATLAS: [f64; 3] = [0.0, 3.0, -2.6];

/// Seconds after which [`bust_pose`] repeats.
const PERIOD: f64 = 4.0;

/// 0 below `low`, 1 above `high`, with continuous curvature between.
fn blend(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// `p` turned about `centre` by `angle` radians around axis x (0) or y (1), right-handed.
fn spin(p: Vec3, centre: Vec3, axis: usize, angle: f64) -> Vec3 {
    super::field::turn(p, centre, axis, angle.to_degrees())
}

/// Positions of the bust `rest` at `t` seconds: the head turns up to 35 degrees to either side and nods up to 9 while the
/// shoulders stay, jaw and brows move a little. At rest, and at rest in velocity, at t = 0 and every 4 s; smooth between.
/// Each vertex is turned by a share of the angle that grows along the neck (a twist, which keeps the neck's girth, where
/// blended matrices would not).
pub fn bust_pose(t: f64, rest: &Mesh) -> Vec<[f64; 3]> {
    let x = TAU * t / PERIOD;
    // sin x (1 - cos x) peaks at 3 sqrt(3) / 4.
    let turn = 35.0_f64.to_radians() * libm::sin(x) * (1.0 - libm::cos(x)) / 1.299;
    let nod = 9.0_f64.to_radians() * 0.5 * (1.0 - libm::cos(2.0 * x));
    let jaw = 2.5_f64.to_radians() * 0.5 * (1.0 - libm::cos(3.0 * x));
    let brow = 0.3 * 0.5 * (1.0 - libm::cos(x));
    if [turn, nod, jaw, brow] == [0.0; 4] {
        return rest.position.clone();
    }
    let moved = rest.position.iter().map(|p| {
        let p = Vec3::from(*p);
        let mut q = p;
        let lift = bump(fold(p, 0.5), v(3.0, 13.6, 8.0), v(3.6, 2.4, 4.0));
        q.y += brow * lift;
        q = spin(q, v(0.0, 8.5, 0.5), 0, jaw * jaw_share(p));
        // The border of head and neck rises from the throat to the nape.
        let along = p.y + 0.45 * (p.z + 3.0);
        if along <= -9.0 {
            return [p.x, p.y, p.z];
        }
        q = spin(q, Vec3::from(ATLAS), 0, nod * blend(-7.0, 4.0, along));
        q = spin(q, v(0.0, 0.0, -3.2), 1, turn * blend(-9.0, 3.0, along));
        [q.x, q.y, q.z]
    });
    moved.collect()
}

/// How far a point follows the jaw: 1 at the chin, 0 above the mouth, behind the ears and on the neck.
fn jaw_share(p: Vec3) -> f64 {
    // Distance below the plane through the jaw joints and the line between the lips.
    let below = (-4.0 * (p.z - 0.5) - 8.5 * (p.y - 8.5)) / 9.39;
    blend(-0.6, 1.6, below) * blend(-0.5, 5.5, p.z) * blend(-3.5, 0.0, p.y)
}

/// A head shake ("no") of the whole bust about [`BUST_PIVOT`]: 2 s at 48 keys a second and a still second after it; two
/// swings to either side, the widest of 45 degrees, up to about 300 degrees a second, with a slight nod and tilt. Starts
/// and ends at rest with no velocity.
pub fn head_shake() -> RigidMotion {
    let mut motion = RigidMotion::default();
    for k in 0..=144 {
        let time = f64::from(k) / 48.0;
        let x = (time / 2.0).min(1.0);
        let envelope = libm::sin(PI * x) * libm::sin(PI * x);
        // sin(4 pi x) sin^2(pi x) peaks at 0.8663.
        let swing = if x < 1.0 { libm::sin(2.0 * TAU * x) * envelope / 0.8663 } else { 0.0 };
        let envelope = if x < 1.0 { envelope } else { 0.0 };
        let half = |degrees: f64| (0.5 * degrees).to_radians();
        let (sy, cy) = libm::sincos(half(45.0 * swing));
        let (sx, cx) = libm::sincos(half(5.0 * envelope));
        let (sz, cz) = libm::sincos(half(-4.0 * swing * envelope));
        // Turn (y) after nod (x) after tilt (z).
        let (a, b) = ([sx * cz, -sx * sz, cx * sz, cx * cz], [sy, cy]);
        motion.time.push(time);
        motion.translation.push([0.0; 3]);
        motion.rotation.push([
            b[1] * a[0] + b[0] * a[2],
            b[1] * a[1] + b[0] * a[3],
            b[1] * a[2] - b[0] * a[0],
            b[1] * a[3] - b[0] * a[1],
        ]);
    }
    motion
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::bust::bust;

    fn worst(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn the_pose_starts_at_rest_and_moves_smoothly() {
        let rest = bust().mesh;
        assert_eq!(bust_pose(0.0, &rest), rest.position);
        let frame = |k: i32| bust_pose(f64::from(k) / 48.0, &rest);
        assert!(worst(&frame(0), &frame(1)) < 0.05);
        assert!(worst(&frame(192), &rest.position) < 1e-9);
        let mut widest = 0.0f64;
        let (mut a, mut b) = (frame(0), frame(1));
        for k in 2..=192 {
            let c = frame(k);
            // Below 150 cm/s and 12 m/s2, far from the limits of a neck.
            assert!(worst(&b, &c) < 150.0 / 48.0);
            let bend: Vec<[f64; 3]> = (0..a.len()).map(|i| std::array::from_fn(|j| 2.0 * b[i][j] - c[i][j])).collect();
            assert!(worst(&a, &bend) * 48.0 * 48.0 < 1200.0);
            widest = widest.max(worst(&c, &rest.position));
            (a, b) = (b, c);
        }
        assert!(widest > 5.0, "{widest}");
    }

    #[test]
    fn no_triangle_collapses_or_turns_over_and_the_chest_stays() {
        let rest = bust().mesh;
        for k in [16, 40, 64, 96, 128, 150] {
            let moved = Mesh { position: bust_pose(f64::from(k) / 48.0, &rest), ..rest.clone() };
            for t in 0..rest.triangle.len() as u32 {
                let ratio = moved.area(t) / rest.area(t);
                assert!((0.3..3.0).contains(&ratio), "{ratio} {:?}", rest.corners(t));
            }
            for (p, q) in rest.position.iter().zip(&moved.position).filter(|(p, _)| p[1] < -13.0) {
                assert_eq!(p, q);
            }
            // Vertices split at seams stay together: the motion is a function of position.
            assert!(moved.position.iter().flatten().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn the_shake_reaches_45_degrees_and_rests_at_both_ends() {
        let m = head_shake();
        let turned = |t: f64| {
            let z = m.at(t, BUST_PIVOT).apply(Vec3::from(BUST_PIVOT) + Vec3::z()) - Vec3::from(BUST_PIVOT);
            libm::atan2(z.x, z.z).to_degrees()
        };
        let all: Vec<f64> = (0..=300).map(|k| turned(f64::from(k) / 100.0)).collect();
        let (low, high) = all.iter().fold((0.0f64, 0.0f64), |(l, h), &x| (l.min(x), h.max(x)));
        assert!((44.0..46.5).contains(&high) && (-46.5..-44.0).contains(&low), "{low} {high}");
        assert!(all.windows(2).all(|w| (w[1] - w[0]).abs() < 3.6), "faster than 360 degrees a second");
        assert!(turned(0.0) == 0.0 && turned(0.02).abs() < 0.1 && turned(2.0) == 0.0 && turned(3.0) == 0.0);
        for q in &m.rotation {
            assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
