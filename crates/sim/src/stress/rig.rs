//! A few hairs with everything prescribed, and what is measured of them.

use super::Measures;
use crate::{Body, Hairs, Model, Motion, Rigid, Root, Settings, SimError, Simulation, Span, SpanReport, Vec3, Wind};
use pelage_geom::{Offsets, StrandId};

/// Seconds of a frame.
pub const FRAME: f64 = 1.0 / 24.0;

/// Gravity, metres per second squared.
pub const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// Nothing moves.
pub fn still(_: f64) -> Rigid {
    Rigid::default()
}

/// A rotation about an axis.
pub fn turned(axis: Vec3, angle: f64) -> Rigid {
    let (s, c) = (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    let a = axis.normalize() * s;
    Rigid { rotation: [a.x, a.y, a.z, c], translation: [0.0; 3] }
}

/// A hair that hangs from `root` in `n` segments, with a helix of radius `wave` in it.
pub fn hair(root: Vec3, length: f64, n: usize, wave: f64) -> Vec<[f64; 3]> {
    let at = |s: f64| root + Vec3::new(wave * (libm::cos(150.0 * s) - 1.0), -s, wave * libm::sin(150.0 * s));
    (0..=n).map(|i| at(length * i as f64 / n as f64).into()).collect()
}

/// Five hairs of 5 to 21 cm.
pub fn tuft() -> Vec<Vec<[f64; 3]>> {
    let of =
        |k: u32| hair(Vec3::new(0.01 * f64::from(k), 0.0, 0.0), 0.05 + 0.04 * f64::from(k), 12 + k as usize, 0.002);
    (0..5).map(of).collect()
}

/// Length of a hair.
pub fn length(hair: &[[f64; 3]]) -> f64 {
    hair.windows(2).map(|w| (Vec3::from(w[1]) - Vec3::from(w[0])).norm()).sum()
}

/// Hairs in a simulation.
#[derive(Clone)]
pub struct Rig {
    pub hairs: Vec<Vec<[f64; 3]>>,
    pub sim: Simulation,
    pub roots: Vec<Root>,
    pub gravity: [f64; 3],
    pub time: f64,
    pub last: SpanReport,
}

impl Rig {
    pub fn new(hairs: &[Vec<[f64; 3]>], settings: &Settings) -> Result<Rig, SimError> {
        Rig::under(hairs, settings, GRAVITY)
    }

    pub fn under(hairs: &[Vec<[f64; 3]>], settings: &Settings, gravity: [f64; 3]) -> Result<Rig, SimError> {
        let offsets = Offsets::from_counts(hairs.iter().map(Vec::len));
        let id: Vec<StrandId> = (1..=hairs.len() as u64).collect();
        let position = hairs.concat();
        let (sim, _) = Simulation::new(&Hairs { offsets: &offsets, position: &position, id: &id }, settings, gravity)?;
        let placed = |h: &Vec<[f64; 3]>| Root { position: h[0], rotation: [0.0, 0.0, 0.0, 1.0] };
        let roots = hairs.iter().map(placed).collect();
        Ok(Rig { hairs: hairs.to_vec(), sim, roots, gravity, time: 0.0, last: SpanReport::default() })
    }

    /// Moves through a span.
    pub fn go(
        &mut self,
        seconds: f64,
        motion: Motion<'_>,
        body: &Body<'_>,
        wind: Option<&Wind>,
    ) -> Result<(), SimError> {
        let roots = self.roots.clone();
        self.span(seconds, motion, roots, body, wind)
    }

    /// Moves through a span at whose end the roots are elsewhere.
    pub fn carry(&mut self, roots: Vec<Root>) -> Result<(), SimError> {
        self.span(FRAME, &still, roots, &Body::default(), None)
    }

    fn span(
        &mut self,
        seconds: f64,
        motion: Motion<'_>,
        roots: Vec<Root>,
        body: &Body<'_>,
        wind: Option<&Wind>,
    ) -> Result<(), SimError> {
        let span = Span {
            seconds,
            time: self.time,
            motion,
            roots: [&self.roots, &roots],
            tips: None,
            body,
            gravity: [self.gravity; 2],
            wind: wind.map(|w| [w, w]),
            still: &[],
        };
        self.last = self.sim.advance(&span, &|_| true)?;
        self.time += seconds;
        self.roots = roots;
        Ok(())
    }

    /// Moves through a number of frames in which nothing moves.
    pub fn wait(&mut self, frames: usize) -> Result<(), SimError> {
        (0..frames).try_for_each(|_| self.go(FRAME, &still, &Body::default(), None))
    }

    /// Points of a hair.
    pub fn hair(&self, h: usize) -> Vec<Vec3> {
        self.sim.positions()[self.sim.offsets().range(h)].iter().map(|p| Vec3::from(*p)).collect()
    }

    /// Largest distance between points of a hair here and of the same one elsewhere, metres.
    pub fn apart(&self, other: &Rig, h: usize) -> f64 {
        self.hair(h).iter().zip(other.hair(h)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    /// Largest speed of a point, metres per second.
    pub fn fastest(&self) -> f64 {
        self.sim.velocities().iter().map(|v| Vec3::from(*v).norm()).fold(0.0, f64::max)
    }

    /// What holds always: numbers, and hair no longer than it is.
    pub fn check(&self, m: &mut Measures) {
        self.bounded(m, 1.02, 0.01 + 1e-12);
    }

    /// Numbers, no point farther from its root than `reach` hair lengths, and no more strain than given.
    pub fn bounded(&self, m: &mut Measures, most: f64, strain: f64) {
        let mut strange = self.sim.velocities().iter().flatten().filter(|v| !v.is_finite()).count();
        let mut reach = 0.0f64;
        for (h, natural) in self.hairs.iter().enumerate() {
            let (p, all) = (self.hair(h), length(natural));
            strange += p.iter().filter(|x| !x.iter().all(|c| c.is_finite())).count();
            let far = p.iter().map(|x| (x - p[0]).norm()).filter(|d| d.is_finite()).fold(0.0, f64::max);
            reach = reach.max((far - 1e-9) / all.max(f64::MIN_POSITIVE));
        }
        m.most("points that are no numbers", strange as f64, 0.0);
        m.most("farthest point from its root, hair lengths", reach, most);
        m.most("strain after limiting", self.last.largest_strain, strain);
    }

    /// What holds where nothing is so bad that a strand had to be given up.
    pub fn check_held(&self, m: &mut Measures) {
        m.most("strands held", self.last.held.len() as f64, 0.0);
    }

    /// Mixes the whole state into the digest.
    pub fn digest(&self, m: &mut Measures) {
        m.mix(&self.sim.save());
    }

    /// With nothing moving any more: hair is calm after some frames.
    pub fn calms(&mut self, m: &mut Measures, frames: usize, limit: f64) -> Result<(), SimError> {
        self.wait(frames)?;
        self.check(m);
        m.most("speed when it should have calmed, m/s", self.fastest(), limit);
        Ok(())
    }
}

/// Settings of a model.
pub fn settings(model: Model) -> Settings {
    Settings { model, ..Settings::default() }
}
