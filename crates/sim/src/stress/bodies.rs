//! Cases of hair against bodies.

use super::Measures;
use super::cases::Done;
use super::rig::settings;
use crate::rig::{FRAME, Rig, still, turned};
use crate::{Body, Ellipsoid, Exact, Field, FieldSettings, Model, Part, Rigid, Settings, Shape, Vec3};
use pelage_geom::{Bvh, Mesh, Topology, shapes};

/// A ball of radius 9 cm as a solid.
pub(super) struct Ball {
    pub(super) mesh: Mesh,
    pub(super) bvh: Bvh,
    pub(super) field: Field,
}

pub(super) fn ball(change: impl Fn(&mut Mesh)) -> Ball {
    let mut mesh = shapes::cube_sphere(24, 0.09);
    change(&mut mesh);
    let topology = Topology::new(&mesh);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let field = Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, &FieldSettings::default(), None, None);
    Ball { mesh, bvh, field }
}

impl Ball {
    /// Moves hairs on with the ball. With `pushed`, measures how deep free points are within it at the end of a frame,
    /// and how many the mesh had to push out there, which may be as many as this.
    pub(super) fn go(
        &self,
        rig: &mut Rig,
        m: &mut Measures,
        frames: usize,
        motion: &(dyn Fn(f64) -> Rigid + Sync),
        pushed: Option<f64>,
    ) -> Done {
        for _ in 0..frames {
            let t = rig.time;
            let at = move |f: f64| motion(t + f * FRAME);
            let exact = Exact { bvh: &self.bvh, triangle: &self.mesh.triangle, velocity: None };
            let part = Part { motion: &at, shape: Shape::Field(&self.field), exact: Some(exact) };
            let body = Body { parts: vec![part], seconds: FRAME };
            rig.go(FRAME, &at, &body, None)?;
            rig.check(m);
            if let Some(pushed) = pushed {
                let end = body.at(1.0);
                let depth = |p: &Vec3| end.exact(*p, 0.0).map_or(0.0, |hit| -hit.distance);
                let free = (0..rig.hairs.len()).flat_map(|h| rig.hair(h).into_iter().skip(2));
                let deepest = free.map(|p| depth(&p)).fold(0.0, f64::max);
                m.most("deepest point in the body, m", deepest, 1e-4);
                m.most("points that only the mesh kept out", rig.last.corrected as f64, pushed);
            }
        }
        rig.digest(m);
        Ok(())
    }
}

/// Hairs that stand on the ball and lie around it.
pub(super) fn on_ball(count: usize) -> Vec<Vec<[f64; 3]>> {
    let of = |k: usize| {
        let (around, up) = (2.4 * k as f64, 0.3 + 0.65 * (k as f64 + 0.5) / count as f64);
        let flat = (1.0 - up * up).sqrt();
        let n = Vec3::new(flat * libm::cos(around), up, flat * libm::sin(around));
        let down = (-Vec3::y() + n * n.y).normalize();
        let at = |s: f64| (n * libm::cos(s / 0.09) + down * libm::sin(s / 0.09)) * (0.09 * (1.0 + 0.4 * s));
        (0..25).map(|i| at(0.15 * f64::from(i) / 24.0).into()).collect()
    };
    (0..count).map(of).collect()
}

pub(super) fn born_inside(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|_| {});
    // Straight through the middle, along a chord, and from inside out.
    let through =
        |from: Vec3, to: Vec3| (0..=24).map(|i| (from + (to - from) * (f64::from(i) / 24.0)).into()).collect();
    let hairs: Vec<Vec<[f64; 3]>> = vec![
        through(Vec3::new(0.0, 0.09, 0.0), Vec3::new(0.0, -0.12, 0.0)),
        through(Vec3::new(0.06, 0.067, 0.0), Vec3::new(0.06, -0.1, 0.0)),
        through(Vec3::new(0.0, 0.0, 0.08), Vec3::new(0.0, 0.02, 0.2)),
    ];
    let mut rig = Rig::new(&hairs, &settings(model))?;
    for _ in 0..12 {
        ball.go(&mut rig, m, 1, &still, None)?;
        rig.check_held(m);
        m.most("speed while it comes out, m/s", rig.fastest(), 5.0);
    }
    Ok(())
}

pub(super) fn flat_body(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|mesh| {
        let faces = mesh.triangle.len();
        for k in (0..faces).step_by(7) {
            let [a, b, c] = mesh.triangle[k];
            mesh.triangle.extend([[a, a, b], [a, b, b], [c, c, c], [a, b, c]]);
            let (uv, face) = (mesh.corner_uv[k], mesh.face[k]);
            mesh.corner_uv.extend([uv; 4]);
            mesh.face.extend([face; 4]);
        }
    });
    let mut rig = Rig::new(&on_ball(16), &settings(model))?;
    ball.go(&mut rig, m, 12, &|t| turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(6.0 * t)), Some(0.0))?;
    rig.check_held(m);
    // An ellipsoid of no thickness.
    let flat: Vec<[f64; 3]> = ball.mesh.position.iter().map(|p| [p[0], 0.0, p[2]]).collect();
    let Some(flat) = Ellipsoid::fit(&flat, &ball.mesh.triangle) else { return Ok(()) };
    let from_disc = |p: Vec3| Vec3::new((Vec3::new(p.x, 0.0, p.z).norm() - 0.09).max(0.0), p.y, 0.0).norm();
    let off = |p: Vec3| (flat.sample(p).distance.abs() - from_disc(p)).abs();
    for p in [[0.0, 0.01, 0.0], [0.02, -0.03, 0.04], [0.0, 0.0, 0.2], [0.01, 1e-4, 0.0], [0.0; 3]] {
        m.most("what a flat body's distance is off by, m", off(Vec3::from(p)), 1e-5);
    }
    let mut rig = Rig::new(&on_ball(16), &settings(model))?;
    for _ in 0..6 {
        let part = Part { motion: &still, shape: Shape::Ellipsoid(&flat), exact: None };
        rig.go(FRAME, &still, &Body { parts: vec![part], seconds: FRAME }, None)?;
        rig.check(m);
    }
    rig.digest(m);
    Ok(())
}

pub(super) fn shaken_body(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|_| {});
    let mut rig = Rig::new(&on_ball(24), &settings(model))?;
    ball.go(&mut rig, m, 6, &|t| turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(63.0 * t)), Some(0.0))?;
    rig.check_held(m);
    Ok(())
}

pub(super) fn thorns(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|mesh| mesh.position.iter_mut().step_by(29).for_each(|p| *p = p.map(|x| 1.2 * x)));
    let level = |k: u32| (0..=40).map(|i| [-0.1 + 0.005 * f64::from(i), 0.115, 0.02 * f64::from(k) - 0.04]).collect();
    let hairs: Vec<Vec<[f64; 3]>> = (0..5).map(level).collect();
    let mut rig = Rig::new(&hairs, &Settings { sag_free: false, ..settings(model) })?;
    ball.go(&mut rig, m, 8, &still, Some(20.0))?;
    rig.check_held(m);
    Ok(())
}
