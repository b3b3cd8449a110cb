//! Partings: curves on the skin that cut the triangulation of the control hairs.

use crate::control::Skin;
use crate::place::Plan;
use pelage_geom::{Bvh, Vec3};

/// What became of the partings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartingCounts {
    /// Control hairs on partings.
    pub hairs: usize,
}

pub(crate) fn add_partings(
    skin: &Skin,
    bvh: &Bvh,
    partings: &[Vec<Vec3>],
    spacing: f64,
    plan: &mut Plan,
) -> PartingCounts {
    let _ = (skin, bvh, partings, spacing, plan);
    PartingCounts::default()
}
