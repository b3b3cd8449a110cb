//! What is done to hair to see whether it stays hair: cases of abuse, each with bounds that must hold.
//!
//! A case runs a strand model through something that no shot should contain and measures the worst of it. Every case is run
//! on one thread and on several, and must give the same bytes.

mod bodies;
mod cases;
mod inputs;
mod paper;
mod rig;

pub use cases::CASES;

use crate::{Model, SimError};

/// A case of abuse.
#[derive(Clone, Copy)]
pub struct Case {
    /// Its name, as typed.
    pub name: &'static str,
    /// What is done.
    pub about: &'static str,
    /// The models it is for.
    pub models: &'static [Model],
    run: fn(Model, &mut Measures) -> Result<(), SimError>,
}

/// Something measured, and what it may be at most.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// What it is, with its unit.
    pub what: &'static str,
    /// The worst that was found.
    pub value: f64,
    /// What it may be.
    pub bound: f64,
}

impl Measure {
    /// True if the bound holds.
    pub fn holds(&self) -> bool {
        self.value <= self.bound
    }
}

/// What was measured in a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    /// Worst of each kind, in the order in which they were first measured.
    pub all: Vec<Measure>,
    /// A hash of the final states.
    pub digest: u64,
}

impl Measures {
    /// Takes a value that may be `bound` at most; of several of a name the worst stays.
    fn most(&mut self, what: &'static str, value: f64, bound: f64) {
        match self.all.iter_mut().find(|m| m.what == what) {
            Some(m) if m.value.is_nan() || value <= m.value => {}
            Some(m) => (m.value, m.bound) = (value, bound),
            None => self.all.push(Measure { what, value, bound }),
        }
    }

    fn mix(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.digest = pelage_geom::rng::mix(self.digest.rotate_left(1) ^ u64::from_le_bytes(word));
        }
    }
}

/// Threads of the second run of a case.
const THREADS: usize = 3;

impl Case {
    /// Measures a case once, on the threads at hand.
    pub fn once(&self, model: Model) -> Measures {
        let mut found = Measures::default();
        let ran = (self.run)(model, &mut found);
        found.most("inputs refused that should have run", f64::from(u8::from(ran.is_err())), 0.0);
        found
    }

    /// Measures a case on one thread and on several.
    pub fn measure(&self, model: Model) -> Measures {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| self.once(model))
        };
        let (mut one, several) = (on(1), on(THREADS));
        let differ = one.digest != several.digest || one.all != several.all;
        one.most("results that depend on threads", f64::from(u8::from(differ)), 0.0);
        one
    }
}
