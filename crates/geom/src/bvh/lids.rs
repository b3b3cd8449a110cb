//! The sign where a closed hole's lid is the closest.

use super::{Bvh, Feature};
use crate::{NONE, Topology, Vec3};
use std::sync::OnceLock;

impl Bvh {
    /// Says that triangles from `first` on close holes. In another pose than the one it was made for a lid may cut
    /// through the mesh; what lies behind the piece outside is then no inside, though the pseudo-normal says so. So a
    /// point whose closest feature belongs to a lid is inside only if a ray away from that feature leaves the mesh
    /// through the back of the first triangle that it meets.
    pub fn with_lids(mut self, first: usize, topology: &Topology) -> Self {
        let slots = || (0..self.index.len()).filter(|&k| self.index[k] as usize >= first);
        let welded = |k: usize, i: usize| topology.welded(self.index[k], i);
        let mut on_lid = vec![false; topology.weld.len()];
        for k in slots() {
            (0..3).for_each(|i| on_lid[welded(k, i) as usize] = true);
        }
        self.rim = vec![false; self.position.len()];
        for k in 0..self.index.len() {
            (0..3).for_each(|i| self.rim[self.triangle[k][i] as usize] = on_lid[welded(k, i) as usize]);
        }
        self.lids = first as u32;
        self.folds = OnceLock::new();
        self
    }

    /// True if a feature belongs to a lid or its rim.
    pub(super) fn is_on_lid(&self, slot: usize, feature: Feature) -> bool {
        let lid = |slot: usize| self.index[slot] >= self.lids;
        let beside = |i: usize| self.neighbour[slot][i];
        match feature {
            _ if self.lids == NONE => false,
            Feature::Face => lid(slot),
            Feature::Edge(i) => lid(slot) || (beside(i) != NONE && lid(beside(i) as usize)),
            Feature::Corner(i) => self.rim[self.triangle[slot][i] as usize],
        }
    }

    /// True if the first triangle in a direction is seen from behind.
    pub(super) fn is_behind(&self, from: Vec3, direction: Vec3) -> bool {
        let hit = self.first_hit(from, direction, f64::INFINITY);
        hit.is_some_and(|(_, slot, _)| self.face_normal(slot).dot(&direction) > 0.0)
    }
}
