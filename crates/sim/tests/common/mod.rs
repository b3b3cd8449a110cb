//! A layer of hair with everything prescribed, for tests.
#![allow(dead_code)]

use nalgebra::{UnitQuaternion, Vector3};
use pelage_geom::{Bvh, Mesh, Offsets, Topology, shapes};
use pelage_sim::{
    Body, End, Field, FieldSettings, Hairs, Material, Model, Rigid, Root, Settings, Simulation, Span, SpanReport,
    Started, Wind,
};

pub type Vec3 = Vector3<f64>;

pub const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// Nothing moves.
pub fn still(_: f64) -> Rigid {
    Rigid::default()
}

/// A rotation about an axis as a placement.
pub fn turned(axis: Vec3, angle: f64) -> Rigid {
    let q = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
    Rigid { rotation: [q.i, q.j, q.k, q.w], translation: [0.0; 3] }
}

/// Hair of real thickness, without the air.
pub fn in_vacuum() -> Material {
    Material { drag_factor: 0.0, damping: 0.0, ..Material::default() }
}

/// Models that the tests of physics are run with.
pub const MODELS: [Model; 2] = [Model::Rod, Model::Springs];

/// Size of gravity in the tests, metres per second squared.
pub const G: f64 = 9.81;

/// A material with `w L^3 / B = gamma` for a rod of length 1 m, hardly extensible, without damping.
pub fn rod(gamma: f64) -> Material {
    let m = Material { diameter: 1e-3, ..in_vacuum() };
    let area = std::f64::consts::FRAC_PI_4 * m.diameter * m.diameter;
    let bend = m.density * area * G / gamma;
    Material { young: bend / (area * m.diameter * m.diameter / 16.0), ..m }
}

/// Time unit of bending, `sqrt(rho A L^4 / B)`, of a rod of length 1 m with [`rod`]'s material, seconds.
pub fn bending_time(gamma: f64) -> f64 {
    (gamma / G).sqrt()
}

/// Settings for tests of the model alone: the input is the natural shape, nothing sleeps, one step a span, strands
/// subdivide only where a stage does not converge.
pub fn plain(model: Model, material: Material) -> Settings {
    Settings {
        model,
        material,
        sag_free: false,
        sleep: false,
        substeps: Some(1),
        largest_turn: 10.0,
        tolerance: 1e-7,
        ..Settings::default()
    }
}

/// A straight hair of length 1 m from the origin in `n` segments.
pub fn straight(n: usize, direction: Vec3) -> Vec<[f64; 3]> {
    let d = direction.normalize();
    (0..=n).map(|i| (d * (i as f64 / n as f64)).into()).collect()
}

/// A hair of length 1 m in the plane z = 0 whose segments have these angles above the x axis.
pub fn links(angle: &[f64]) -> Vec<[f64; 3]> {
    let l = 1.0 / angle.len() as f64;
    let mut p = vec![[0.0; 3]];
    for a in angle {
        let [x, y, _] = p[p.len() - 1];
        p.push([x + l * libm::cos(*a), y + l * libm::sin(*a), 0.0]);
    }
    p
}

/// A placement where hair was groomed.
pub fn placed(p: [f64; 3]) -> Root {
    Root { position: p, rotation: [0.0, 0.0, 0.0, 1.0] }
}

/// A placement there, turned about an axis.
pub fn placed_turned(p: [f64; 3], axis: Vec3, angle: f64) -> Root {
    Root { position: p, rotation: turned(axis, angle).rotation }
}

/// A ball as a mesh with its field.
pub struct Ball {
    pub mesh: Mesh,
    pub bvh: Bvh,
    pub field: Field,
}

pub fn ball(radius: f64) -> Ball {
    let mesh = shapes::cube_sphere(48, radius);
    let topology = Topology::new(&mesh);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let field = Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, &FieldSettings::default(), None);
    Ball { mesh, bvh, field }
}

/// Hairs that stand on the upper half of a ball and lie around it, slowly away from it.
pub fn tuft(radius: f64, count: usize, length: f64, points: usize) -> Vec<Vec<[f64; 3]>> {
    (0..count)
        .map(|k| {
            let around = 2.4 * k as f64;
            let up = 0.3 + 0.65 * (k as f64 + 0.5) / count as f64;
            let flat = (1.0f64 - up * up).sqrt();
            let n = Vec3::new(flat * libm::cos(around), up, flat * libm::sin(around));
            let down = (-Vec3::y() + n * n.y).normalize();
            (0..points)
                .map(|i| {
                    let s = length * i as f64 / (points - 1) as f64;
                    let a = s / radius;
                    // Around the ball and slowly away from it.
                    let out = n * libm::cos(a) + down * libm::sin(a);
                    (out * (radius * (1.0 + 0.05 * s / length))).into()
                })
                .collect()
        })
        .collect()
}

/// Hairs in a simulation, with the roots where they were groomed.
#[derive(Clone)]
pub struct Shot {
    pub model: Model,
    pub sim: Simulation,
    pub started: Started,
    pub roots: Vec<Root>,
    pub tips: Option<Vec<Root>>,
    pub gravity: [f64; 3],
    pub time: f64,
    pub last: SpanReport,
}

impl Shot {
    pub fn new(hairs: &[Vec<[f64; 3]>], settings: &Settings, gravity: [f64; 3]) -> Shot {
        let offsets = Offsets::from_counts(hairs.iter().map(Vec::len));
        let position = hairs.concat();
        let id: Vec<u64> = (1..=hairs.len() as u64).collect();
        let hairs_in = Hairs { offsets: &offsets, position: &position, id: &id };
        let (sim, started) = Simulation::new(&hairs_in, settings, gravity).unwrap();
        let roots = hairs.iter().map(|h| placed(h[0])).collect();
        let tips = (settings.tip != End::Free).then(|| hairs.iter().map(|h| placed(h[h.len() - 1])).collect());
        Shot { model: settings.model, sim, started, roots, tips, gravity, time: 0.0, last: SpanReport::default() }
    }

    /// Hairs whose natural shape is `natural`, at rest but in the pose `pose`, not relaxed.
    pub fn deformed(natural: &[Vec<[f64; 3]>], pose: &[Vec<[f64; 3]>], settings: &Settings, gravity: [f64; 3]) -> Shot {
        let mut shot = Shot::new(natural, settings, gravity);
        shot.sim.restore(&Shot::new(pose, settings, gravity).sim.save()).unwrap();
        shot
    }

    /// Moves on by a number of equal spans.
    pub fn steps(&mut self, count: usize, seconds: f64) {
        for _ in 0..count {
            self.wait(seconds);
        }
    }

    /// Moves the ends to new placements in a span.
    pub fn carry(&mut self, seconds: f64, roots: Vec<Root>, tips: Option<Vec<Root>>) {
        let span = Span {
            seconds,
            time: self.time,
            motion: &still,
            roots: [&self.roots, &roots],
            tips: self.tips.as_deref().zip(tips.as_deref()).map(|(a, b)| [a, b]),
            body: &Body::default(),
            gravity: [self.gravity; 2],
            wind: None,
            still: &[],
        };
        self.last = self.sim.advance(&span, &|_| true).unwrap();
        self.time += seconds;
        self.roots = roots;
        if tips.is_some() {
            self.tips = tips;
        }
    }

    /// Lets everything come to rest: long steps damp all that they can't resolve.
    pub fn come_to_rest(&mut self) {
        for (count, seconds) in [(40, 0.05), (40, 0.2), (60, 1.0)] {
            self.steps(count, seconds);
        }
        assert!(self.fastest() < 1e-5 && self.last.held.is_empty(), "still moves at {} m/s", self.fastest());
    }

    /// Largest speed of a point, metres per second.
    pub fn fastest(&self) -> f64 {
        self.sim.velocities().iter().map(|v| Vec3::from(*v).norm()).fold(0.0, f64::max)
    }

    /// Moves on with everything at rest.
    pub fn wait(&mut self, seconds: f64) {
        self.go(seconds, &still, &Body::default(), None);
    }

    /// Moves on with a skin and a body.
    pub fn go(&mut self, seconds: f64, motion: &(dyn Fn(f64) -> Rigid + Sync), body: &Body<'_>, wind: Option<&Wind>) {
        let tips = self.tips.clone();
        let span = Span {
            seconds,
            time: self.time,
            motion,
            roots: [&self.roots, &self.roots],
            tips: tips.as_deref().map(|t| [t, t]),
            body,
            gravity: [self.gravity; 2],
            wind: wind.map(|w| [w, w]),
            still: &[],
        };
        self.last = self.sim.advance(&span, &|_| true).unwrap();
        self.time += seconds;
    }

    /// Points of a hair.
    pub fn hair(&self, h: usize) -> Vec<Vec3> {
        self.sim.positions()[self.sim.offsets().range(h)].iter().map(|p| Vec3::from(*p)).collect()
    }

    /// Last point of a hair.
    pub fn tip(&self, h: usize) -> Vec3 {
        *self.hair(h).last().unwrap()
    }
}
