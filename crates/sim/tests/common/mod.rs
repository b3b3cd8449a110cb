//! A layer of hair with everything prescribed, for tests.
#![allow(dead_code)]

use nalgebra::{UnitQuaternion, Vector3};
use pelage_geom::Offsets;
use pelage_sim::{Body, Hairs, Material, Rigid, Root, Settings, Simulation, Span, SpanReport, Started, Wind};

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

/// Hairs in a simulation, with the roots where they were groomed.
pub struct Shot {
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
        let at = |p: [f64; 3]| Root { position: p, rotation: [0.0, 0.0, 0.0, 1.0] };
        let roots = hairs.iter().map(|h| at(h[0])).collect();
        Shot { sim, started, roots, tips: None, gravity, time: 0.0, last: SpanReport::default() }
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
            wind,
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
