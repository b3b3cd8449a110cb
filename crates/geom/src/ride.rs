//! How points of a skin have moved since rest, and how a skin comes from its rest pose into a motion.

use crate::motion::{RigidTransform, rotation};
use crate::{Mesh, Offsets, Pose, SurfacePoint, Topology, Vec3};
use nalgebra::{Quaternion, UnitQuaternion};
use rayon::prelude::*;

/// Where a root is, and how its frame is turned from the rest pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ride {
    /// The point of the skin, scene units.
    pub position: [f64; 3],
    /// Rotation of the root frame [N, dU, N x dU] from rest, unit quaternion (x, y, z, w), w >= 0.
    pub rotation: [f64; 4],
}

impl Ride {
    /// At rest at a point.
    pub fn still(position: [f64; 3]) -> Self {
        Ride { position, rotation: [0.0, 0.0, 0.0, 1.0] }
    }
}

/// Roots at `now`, turned from `rest` with the skin at their points `root`. `anchor` is where they are at rest: on the
/// skin or beside it, where they stay.
pub fn rides(
    mesh: &Mesh,
    topology: &Topology,
    rest: &Pose,
    now: &Pose,
    root: &[SurfacePoint],
    anchor: &[[f64; 3]],
) -> Vec<Ride> {
    let ride = |(p, anchor): (&SurfacePoint, &[f64; 3])| {
        let (a, b) = (rest.frame(mesh, topology, p), now.frame(mesh, topology, p));
        // Columns of the rotation that takes frame a to frame b.
        let turned = |v: Vec3| b.n * a.n.dot(&v) + b.du * a.du.dot(&v) + b.dv * a.dv.dot(&v);
        let rotation = quaternion([turned(Vec3::x()), turned(Vec3::y()), turned(Vec3::z())]);
        Ride { position: (b.origin + turned(Vec3::from(*anchor) - a.origin)).into(), rotation }
    };
    root.par_iter().zip(anchor).map(ride).collect()
}

/// Moves hairs as they are with their roots. `points` are relative to `origin`, before and after; `anchor` is where the
/// roots are at rest.
pub fn carry(offsets: &Offsets, origin: [f64; 3], anchor: &[[f64; 3]], rides: &[Ride], points: &mut [[f32; 3]]) {
    let origin = Vec3::from(origin);
    for (h, (anchor, ride)) in anchor.iter().zip(rides).enumerate() {
        let turn = rotation(ride.rotation);
        for p in &mut points[offsets.range(h)] {
            let from_root = Vec3::from(p.map(f64::from)) + origin - Vec3::from(*anchor);
            let q = turn * from_root + Vec3::from(ride.position) - origin;
            *p = [q.x as f32, q.y as f32, q.z as f32];
        }
    }
}

/// Unit quaternion of a rotation given by its columns, with square roots only (the method of S. W. Shepperd, "Quaternion
/// from rotation matrix", 1978: the largest of the four components comes from the root).
fn quaternion([x, y, z]: [Vec3; 3]) -> [f64; 4] {
    let trace = x.x + y.y + z.z;
    let q = if trace >= x.x.max(y.y).max(z.z) {
        [y.z - z.y, z.x - x.z, x.y - y.x, 1.0 + trace]
    } else if x.x >= y.y.max(z.z) {
        [1.0 + x.x - y.y - z.z, y.x + x.y, z.x + x.z, y.z - z.y]
    } else if y.y >= z.z {
        [y.x + x.y, 1.0 + y.y - x.x - z.z, z.y + y.z, z.x - x.z]
    } else {
        [z.x + x.z, z.y + y.z, 1.0 + z.z - x.x - y.y, x.y - y.x]
    };
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
    q.map(|v| sign * v / norm)
}

/// The way from rest into a motion, `s` from 0 to 1: share of the pose that is come to, and of that pose's velocity times
/// the duration (cubic Hermite). Position and velocity are those of rest at 0 and those of the motion at 1.
pub fn ease(s: f64) -> [f64; 2] {
    let s = s.clamp(0.0, 1.0);
    [s * s * (3.0 - 2.0 * s), s * s * (s - 1.0)]
}

/// Vertices on the way from `rest` to `target`; `next` is where they are one frame after that, `frames` how long the way
/// takes in frames.
pub fn ease_positions(rest: &[[f64; 3]], target: &[[f64; 3]], next: &[[f64; 3]], frames: f64, s: f64) -> Vec<[f64; 3]> {
    let [pose, velocity] = ease(s);
    let at = |((r, t), n): ((&[f64; 3], &[f64; 3]), &[f64; 3])| {
        std::array::from_fn(|x| r[x] + (t[x] - r[x]) * pose + (n[x] - t[x]) * (velocity * frames))
    };
    rest.iter().zip(target).zip(next).map(at).collect()
}

/// The same for a skin that moves as a whole: translation, and rotation by slerp. `next` is the placement `step` frames
/// after `target`.
pub fn ease_rigid(target: &RigidTransform, next: &RigidTransform, step: f64, frames: f64, s: f64) -> RigidTransform {
    let [pose, velocity] = ease(s);
    let velocity = velocity * frames / step;
    let (to, then) = (rotation(target.rotation), rotation(next.rotation));
    let q = power(then * to.inverse(), velocity) * power(to, pose);
    let translation = std::array::from_fn(|x| {
        target.translation[x] * pose + (next.translation[x] - target.translation[x]) * velocity
    });
    RigidTransform { rotation: [q.i, q.j, q.k, q.w], translation, pivot: target.pivot }
}

/// A rotation about the same axis by `t` times the angle (the shorter way round).
fn power(q: UnitQuaternion<f64>, t: f64) -> UnitQuaternion<f64> {
    let v = Vec3::new(q.i, q.j, q.k) * if q.w < 0.0 { -1.0 } else { 1.0 };
    let sine = v.norm();
    if sine == 0.0 {
        return UnitQuaternion::identity();
    }
    let half = t * libm::atan2(sine, q.w.abs());
    let v = v * (libm::sin(half) / sine);
    UnitQuaternion::new_normalize(Quaternion::new(libm::cos(half), v.x, v.y, v.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::cube_sphere;

    fn turn(axis: Vec3, angle: f64) -> [f64; 4] {
        let v = axis.normalize() * libm::sin(0.5 * angle);
        [v.x, v.y, v.z, libm::cos(0.5 * angle)]
    }

    #[test]
    fn a_skin_that_moves_as_a_whole_turns_every_root_alike() {
        let mesh = cube_sphere(4, 5.0);
        let topology = Topology::new(&mesh);
        let rest = Pose::new(&mesh, &topology, mesh.position.clone());
        let root: Vec<SurfacePoint> =
            (0..mesh.triangle.len() as u32).map(|t| SurfacePoint { triangle: t, bary: [0.2, 0.5] }).collect();
        for (axis, angle) in
            [(Vec3::x(), 0.3), (Vec3::y(), 3.1), (Vec3::new(1.0, -2.0, 0.5), 2.5), (Vec3::z(), 3.13), (Vec3::x(), 0.0)]
        {
            let t =
                RigidTransform { rotation: turn(axis, angle), translation: [1.0, 2.0, 3.0], pivot: [0.0, 1.0, 0.0] };
            let moved: Vec<[f64; 3]> = mesh.position.iter().map(|p| t.apply(Vec3::from(*p)).into()).collect();
            let now = Pose::new(&mesh, &topology, moved);
            // Beside the skin.
            let anchor: Vec<[f64; 3]> = root
                .iter()
                .map(|p| (rest.frame(&mesh, &topology, p).origin + Vec3::new(0.1, -0.2, 0.3)).into())
                .collect();
            let found = rides(&mesh, &topology, &rest, &now, &root, &anchor);
            for (ride, a) in found.iter().zip(&anchor) {
                let dot: f64 = (0..4).map(|x| ride.rotation[x] * t.rotation[x]).sum();
                assert!(dot.abs() > 1.0 - 1e-11 && ride.rotation[3] >= 0.0, "{ride:?} {t:?}");
                // Frames come from single-precision normals and tangents.
                assert!((Vec3::from(ride.position) - t.apply(Vec3::from(*a))).norm() < 1e-6);
            }
            let offsets = Offsets::uniform(root.len(), 1);
            let mut points: Vec<[f32; 3]> = anchor.iter().map(|a| a.map(|x| x as f32)).collect();
            carry(&offsets, [0.0; 3], &anchor, &found, &mut points);
            let near =
                |(p, r): (&[f32; 3], &Ride)| (Vec3::from(p.map(f64::from)) - Vec3::from(r.position)).norm() < 1e-5;
            assert!(points.iter().zip(&found).all(near));
        }
        let still = rides(&mesh, &topology, &rest, &rest, &root, &vec![[0.0; 3]; root.len()]);
        assert!(still.iter().all(|r| (r.rotation[3] - 1.0).abs() < 1e-12));
    }

    #[test]
    fn easing_starts_at_rest_and_arrives_with_the_velocity_of_the_motion() {
        let (rest, target, next) = ([[1.0, 0.0, 0.0]], [[3.0, 1.0, 0.0]], [[3.5, 1.0, -1.0]]);
        let at = |s: f64| ease_positions(&rest, &target, &next, 8.0, s)[0];
        assert_eq!((at(0.0), at(1.0)), (rest[0], target[0]));
        let h = 1e-6;
        for x in 0..3 {
            assert!((at(h)[x] - rest[0][x]).abs() < 1e-10);
            let velocity = (target[0][x] - at(1.0 - h)[x]) / (8.0 * h);
            assert!((velocity - (next[0][x] - target[0][x])).abs() < 1e-4);
        }
    }

    #[test]
    fn rigid_easing_does_the_same_for_turns() {
        let place = |angle: f64, x: f64| RigidTransform {
            rotation: turn(Vec3::new(0.3, 1.0, 0.0), angle),
            translation: [x, 0.0, 0.0],
            pivot: [0.0, 2.0, 0.0],
        };
        let (target, next) = (place(1.2, 4.0), place(1.2 + 0.05, 4.1));
        let at = |s: f64| ease_rigid(&target, &next, 0.25, 6.0, s).apply(Vec3::new(1.0, 1.0, 1.0));
        let whole = |t: &RigidTransform| t.apply(Vec3::new(1.0, 1.0, 1.0));
        assert!((at(0.0) - Vec3::new(1.0, 1.0, 1.0)).norm() < 1e-12 && (at(1.0) - whole(&target)).norm() < 1e-12);
        let h = 1e-5;
        assert!((at(h) - at(0.0)).norm() < 1e-8, "no velocity at rest");
        let arrives = (at(1.0) - at(1.0 - h)) / (6.0 * h);
        let goes = (whole(&place(1.2 + 0.05 * h / 0.25, 4.0 + 0.1 * h / 0.25)) - whole(&target)) / h;
        assert!((arrives - goes).norm() < 1e-3 * goes.norm(), "{arrives} {goes}");
    }
}
