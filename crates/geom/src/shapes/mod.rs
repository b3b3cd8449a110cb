//! Meshes made by formula: samples to groom and bodies to test on. All of them are pure functions of their arguments, the
//! same to the last bit on every machine.

mod animal;
mod atlas;
mod banded;
mod bodies;
mod bust;
#[cfg(test)]
mod check;
mod field;
mod gait;
mod nets;
mod paint;
mod remesh;
mod shake;
mod unwrap;

pub use animal::{animal, fur_direction, overcoat, undercoat};
pub use bodies::{cube_sphere, plane, sphere, torus};
pub use bust::{brow, bust, scalp};
pub use gait::animal_pose;
pub use paint::{paint, paint3};
pub use shake::{BUST_PIVOT, bust_pose, head_shake};

use crate::{Mesh, Vec3};

/// A part of a skin as a function of position (scene units of its mesh): 1 inside, 0 outside, smooth between.
pub type Region = fn(Vec3) -> f32;

/// A mesh with the regions that maps are painted from.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Centimetres, y up, facing +z; closed; vertices split at texture seams, charts without overlap in the unit square.
    pub mesh: Mesh,
    /// Name and function of each region.
    pub regions: Vec<(&'static str, Region)>,
}
