//! What several tests use.
#![allow(dead_code, unused_imports)]

pub use pelage_sim::rig::*;
pub use pelage_sim::{Model, Vec3};

/// Models that the tests of physics are run with.
pub const MODELS: [Model; 2] = [Model::Rod, Model::Springs];

/// Lets everything come to rest.
pub fn come_to_rest(rig: &mut Rig) {
    rig.rest().unwrap();
    assert!(rig.fastest() < 1e-5 && rig.last.held.is_empty(), "still moves at {} m/s", rig.fastest());
}
