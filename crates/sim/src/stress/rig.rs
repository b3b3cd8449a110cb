//! Hairs of the cases, and what is measured of them.

use super::Measures;
use crate::rig::{FRAME, Rig, length};
use crate::{Model, Settings, SimError, Vec3};

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

impl Rig {
    /// What holds always: numbers, and hair no longer than it is.
    pub(super) fn check(&self, m: &mut Measures) {
        self.bounded(m, 1.02, 0.01 + 1e-12);
    }

    /// Numbers, no point farther from its root than `reach` hair lengths, and no more strain than given.
    pub(super) fn bounded(&self, m: &mut Measures, most: f64, strain: f64) {
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
    pub(super) fn check_held(&self, m: &mut Measures) {
        m.most("strands held", self.last.held.len() as f64, 0.0);
    }

    /// Mixes the whole state into the digest.
    pub(super) fn digest(&self, m: &mut Measures) {
        m.mix(&self.sim.save());
    }

    /// With nothing moving any more: hair is calm after some frames.
    pub(super) fn calms(&mut self, m: &mut Measures, frames: usize, limit: f64) -> Result<(), SimError> {
        self.steps(frames, FRAME)?;
        self.check(m);
        m.most("speed when it should have calmed, m/s", self.fastest(), limit);
        Ok(())
    }
}

/// Settings of a model.
pub fn settings(model: Model) -> Settings {
    Settings { model, ..Settings::default() }
}
