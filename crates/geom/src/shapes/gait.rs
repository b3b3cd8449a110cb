//! Motion of the animal: breath, a swaying tail, a turning head.

use super::animal::TAIL;
use super::field::{smoothstep, turn, v};
use crate::{Mesh, Vec3};
use std::f64::consts::TAU;

/// Seconds after which [`animal_pose`] repeats.
const PERIOD: f64 = 4.0;

/// Positions of the animal `rest` at `t` seconds: it breathes twice, sways its tail and turns its head within 4 s. At
/// rest at t = 0 and every 4 s; smooth in space and time.
pub fn animal_pose(t: f64, rest: &Mesh) -> Vec<[f64; 3]> {
    let x = TAU * t / PERIOD;
    let ease = 1.0 - libm::cos(x);
    let breath = 0.5 * (1.0 - libm::cos(2.0 * x));
    let head = 14.0 * libm::sin(x) * ease;
    if ease == 0.0 {
        return rest.position.clone();
    }
    let root = TAIL[0].0;
    let moved = rest.position.iter().map(|p| {
        let p = Vec3::from(*p);
        let mut q = p;
        // Ribs: out and down by up to a millimetre and a half.
        let ribs = smoothstep(-5.0, 0.5, p.z) * smoothstep(6.0, 2.5, p.z) * smoothstep(7.5, 9.5, p.y);
        q.x += 0.05 * breath * ribs * p.x;
        q.y += 0.03 * breath * ribs * (p.y - 13.0).min(0.0);
        let neck = smoothstep(3.0, 9.5, p.z + 0.45 * (p.y - 13.0)) * smoothstep(10.5, 14.0, p.y);
        q = turn(q, v(0.0, 14.0, 6.5), 1, head * neck);
        // Tail: later and wider towards the tip.
        let along = ((root.z - p.z - 1.5) / 13.0).max(0.0);
        let swing = libm::sin(2.0 * x - 1.6 * along) + libm::sin(1.6 * along);
        q = turn(q, root, 1, 9.0 * ease * swing * along * along / (0.3 + along));
        [q.x, q.y, q.z]
    });
    moved.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::animal::animal;

    #[test]
    fn the_animal_moves_smoothly_from_rest_and_keeps_its_triangles() {
        let rest = animal().mesh;
        assert_eq!(animal_pose(0.0, &rest), rest.position);
        let mut before = rest.position.clone();
        let mut widest = 0.0f64;
        for k in 1..=96 {
            let now = animal_pose(f64::from(k) / 24.0, &rest);
            for (i, p) in now.iter().enumerate() {
                let far = |q: [f64; 3]| (Vec3::from(*p) - Vec3::from(q)).norm();
                assert!(far(before[i]) < 3.0);
                widest = widest.max(far(rest.position[i]));
            }
            if k % 8 == 0 {
                let moved = Mesh { position: now.clone(), ..rest.clone() };
                for t in 0..rest.triangle.len() as u32 {
                    let ratio = moved.area(t) / rest.area(t);
                    assert!((0.3..3.0).contains(&ratio), "{ratio} {:?}", rest.corners(t));
                }
            }
            before = now;
        }
        assert!(widest > 3.0);
        let end = animal_pose(PERIOD, &rest);
        assert!(end.iter().flatten().zip(rest.position.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
