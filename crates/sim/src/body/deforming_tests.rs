use super::super::testing::*;
use super::super::{FieldSettings, rigid_fit};
use super::*;
use nalgebra::UnitQuaternion;
use pelage_geom::shapes::{bust, bust_pose, cube_sphere};
use pelage_geom::{Bvh, Mesh, Topology};

const VOXEL: f64 = 0.004;
const SECONDS: f64 = 1.0 / 24.0;

/// Two frames of a mesh over a span.
struct Frames {
    mesh: Mesh,
    topology: Topology,
    pose: [Vec<[f64; 3]>; 2],
    field: [Field; 2],
    flow: [Flow; 2],
}

impl Frames {
    fn new(mesh: Mesh, pose: [Vec<[f64; 3]>; 2]) -> Self {
        let topology = Topology::new(&mesh);
        let settings = FieldSettings { voxel: VOXEL, outside: 0.02, inside: 0.01 };
        let field = [0, 1].map(|i| {
            let bvh = Bvh::build(&pose[i], &mesh.triangle, &topology);
            Field::build(&pose[i], &mesh.triangle, &topology, &bvh, &settings, None, None)
        });
        let velocity: Vec<[f64; 3]> =
            pose[0].iter().zip(&pose[1]).map(|(a, b)| [0, 1, 2].map(|i| (b[i] - a[i]) / SECONDS)).collect();
        let flow = [0, 1].map(|i| field[i].flow(&mesh.triangle, &velocity));
        Frames { mesh, topology, pose, field, flow }
    }

    fn deforming(&self) -> Deforming<'_> {
        Deforming { field: [&self.field[0], &self.field[1]], flow: [&self.flow[0], &self.flow[1]], seconds: SECONDS }
    }

    /// The mesh on straight vertex paths.
    fn between(&self, alpha: f64) -> Bvh {
        let mix = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|i| a[i] + alpha * (b[i] - a[i]));
        let position: Vec<[f64; 3]> = self.pose[0].iter().zip(&self.pose[1]).map(mix).collect();
        Bvh::build(&position, &self.mesh.triangle, &self.topology)
    }

    /// Mean, 99 % and largest error over points within `reach` of the surface, metres; by the scheme given.
    fn error(&self, alpha: f64, reach: f64, scheme: &dyn Fn(Vec3, f64) -> f64) -> [f64; 3] {
        let bvh = self.between(alpha);
        let mut off = Vec::new();
        for (k, (a, b)) in (0u64..).zip(self.pose[0].iter().zip(&self.pose[1])).take(40_000) {
            let p = Vec3::from(*a) * (1.0 - alpha) + Vec3::from(*b) * alpha + random_in(k, [-reach; 3], [reach; 3]);
            off.push((scheme(p, alpha) - bvh.closest(p, f64::INFINITY).unwrap().signed_distance).abs());
        }
        off.sort_by(f64::total_cmp);
        [off.iter().sum::<f64>() / off.len() as f64, off[off.len() * 99 / 100], off[off.len() - 1]]
    }

    fn schemes(&self) -> [[f64; 3]; 4] {
        let d = self.deforming();
        let [f, _] = d.field;
        let naive = |p: Vec3, a: f64| f.sample(p).distance * (1.0 - a) + d.field[1].sample(p).distance * a;
        let forward = |p: Vec3, a: f64| f.sample(p - f.carried(d.flow[0], p) * (a * SECONDS)).distance;
        let paper = |p: Vec3, a: f64| d.sample_rounds(p, a, 0).distance;
        let ours = |p: Vec3, a: f64| d.sample(p, a).distance;
        let schemes: [&dyn Fn(Vec3, f64) -> f64; 4] = [&naive, &forward, &paper, &ours];
        schemes.map(|s| self.error(0.5, 0.002, s))
    }
}

/// A sphere that moves by `shift`, turns by `angle` and is stretched by `stretch` along y.
fn sphere(shift: f64, angle: f64, stretch: f64) -> Frames {
    let mesh = cube_sphere(32, 0.1);
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.2, 0.9, 0.4).normalize() * angle);
    let moved =
        |p: &[f64; 3]| (turn * Vec3::new(p[0], p[1] * stretch, p[2]) + Vec3::new(0.8, 0.36, 0.48) * shift).into();
    let pose = [mesh.position.clone(), mesh.position.iter().map(moved).collect()];
    Frames::new(mesh, pose)
}

/// The paper's figure 15: half-way between two frames, and what the fixed point adds to its scheme.
#[test]
fn two_sides_beat_one_and_the_fixed_point_beats_both() {
    let name = ["naive", "one-sided", "two-sided", "fixed point"];
    let cases = [
        ("3 cm", sphere(0.03, 0.0, 1.0)),
        ("1 cm, 20 degrees, 10 % longer", sphere(0.01, 0.35, 1.1)),
        ("30 cm (1.5 diameters), 10 degrees", sphere(0.3, 0.17, 1.0)),
        ("3 cm, 45 degrees", sphere(0.03, 0.785, 1.0)),
    ];
    for (case, frames) in &cases {
        let error = frames.schemes();
        for (n, e) in name.iter().zip(error) {
            println!(
                "{case}: {n}: mean {:.3}, 99 % {:.3}, most {:.3} voxels",
                e[0] / VOXEL,
                e[1] / VOXEL,
                e[2] / VOXEL
            );
        }
        let [naive, forward, paper, ours] = error.map(|e| e[1]);
        let slack = 0.02 * VOXEL;
        assert!(ours <= paper + slack && ours <= forward + slack && ours < naive, "{case}");
        assert!(error[3][2] < 0.5 * VOXEL, "{case}");
    }
}

#[test]
fn the_shaken_bust_is_within_half_a_voxel() {
    let mesh = bust().mesh;
    for (t, span) in [(0.7, 1.0 / 24.0), (1.2, 1.0 / 24.0), (1.2, 10.0 / 24.0)] {
        let pose = [t, t + span].map(|t| {
            let cm = bust_pose(t, &mesh);
            cm.iter().map(|p| p.map(|x| 0.01 * x)).collect::<Vec<_>>()
        });
        let moved = pose[0].iter().zip(&pose[1]).map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).norm());
        let moved = moved.fold(0.0, f64::max);
        let fit = rigid_fit(&pose[0], &pose[1]);
        let frames = Frames::new(metres(mesh.clone()), pose);
        println!("moved {:.1} mm at most; rigid part leaves {:.1} mm", moved * 1e3, fit.largest * 1e3);
        for (n, e) in ["naive", "one-sided", "two-sided", "fixed point"].iter().zip(frames.schemes()) {
            println!("  {n}: mean {:.3}, 99 % {:.3}, most {:.3} voxels", e[0] / VOXEL, e[1] / VOXEL, e[2] / VOXEL);
        }
        let ours = frames.schemes()[3];
        assert!(ours[1] < 0.5 * VOXEL);
    }
}

#[test]
fn frames_are_met_exactly_and_velocities_are_those_of_the_surface() {
    let frames = sphere(0.02, 0.2, 1.05);
    let d = frames.deforming();
    for i in 0..500 {
        let p = random_in(i, [-0.12; 3], [0.12; 3]);
        for (k, alpha) in [0.0, 1.0].into_iter().enumerate() {
            assert!((d.sample(p, alpha).distance - d.field[k].sample(p).distance).abs() < 1e-15);
        }
    }
    for (a, b) in frames.pose[0].iter().zip(&frames.pose[1]).step_by(7) {
        let (a, b) = (Vec3::from(*a), Vec3::from(*b));
        let s = d.sample(a * 0.7 + b * 0.3, 0.3);
        assert!((s.velocity - (b - a) / SECONDS).norm() < 0.02 * (b - a).norm() / SECONDS);
        assert!((s.normal.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn bounds_between_frames_are_lower_bounds() {
    let frames = sphere(0.03, 0.5, 1.1);
    let d = frames.deforming();
    for alpha in [0.0, 0.2, 0.5, 0.9, 1.0] {
        let bvh = frames.between(alpha);
        for i in 0..4000 {
            let p = random_in(i, [-0.3; 3], [0.3; 3]);
            let exact = bvh.closest(p, f64::INFINITY).unwrap().signed_distance;
            assert!(d.distance_bound(p, alpha) <= exact.max(0.0) + 1e-9);
        }
    }
}

/// A frame whose mesh is not a number leaves the other frame's; two such frames are nowhere.
#[test]
fn a_frame_without_a_mesh_is_passed_over() {
    let mut frames = sphere(0.02, 0.0, 1.0);
    let bad = vec![[f64::NAN; 3]; frames.mesh.position.len()];
    let bvh = Bvh::build(&bad, &frames.mesh.triangle, &frames.topology);
    let settings = FieldSettings::default();
    let lost = Field::build(&bad, &frames.mesh.triangle, &frames.topology, &bvh, &settings, None, None);
    frames.flow[1] = lost.flow(&frames.mesh.triangle, &bad);
    frames.field[1] = lost;
    let d = frames.deforming();
    let p = Vec3::new(0.12, 0.01, 0.0);
    for alpha in [0.0, 0.5, 1.0] {
        let hit = d.sample(p, alpha);
        assert!(hit.distance.is_finite() && hit.velocity.norm().is_finite() && hit.normal.norm() > 0.99);
        assert!(d.distance_bound(p, alpha).is_finite());
    }
    let d = Deforming { field: [d.field[1]; 2], flow: [d.flow[1]; 2], ..d };
    assert_eq!(d.sample(p, 0.0).distance, f64::INFINITY);
}
