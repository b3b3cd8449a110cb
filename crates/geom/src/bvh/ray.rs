//! Where a ray meets the mesh.

use super::{Bvh, surface_point};
use crate::mesh::corners;
use crate::{SurfacePoint, Vec3};

impl Bvh {
    /// Nearest hit, from either side, of the ray `origin` + t `direction` with 0 <= t < `max_t`: t and where on the
    /// mesh. No ray slips through an edge that two triangles share (Woop, Benthin, Wald 2013, "Watertight Ray/Triangle
    /// Intersection"). Ties go to the lowest triangle.
    pub fn ray(&self, origin: Vec3, direction: Vec3, max_t: f64) -> Option<(f64, SurfacePoint)> {
        self.first_hit(origin, direction, max_t).map(|(t, slot, weight)| (t, surface_point(self.index[slot], weight)))
    }

    /// What [`Bvh::ray`] finds: t, place in the order of the leaves, weights of corners 1 and 2.
    pub(super) fn first_hit(&self, origin: Vec3, direction: Vec3, max_t: f64) -> Option<(f64, usize, [f64; 2])> {
        let shear = Shear::new(origin, direction)?;
        let inverse = direction.map(|d| 1.0 / d);
        if origin.iter().chain(&direction).chain([&max_t]).any(|x| x.is_nan()) {
            return None;
        }
        let mut best: Option<(f64, usize, [f64; 2])> = None;
        // Finite, so that a box that is missed (infinite) is never within reach.
        self.descend(
            max_t.min(f64::MAX),
            |n| n.enter(&origin, &inverse),
            |slot, reach| match shear.hit(corners(&self.position, self.triangle[slot])) {
                Some((t, weight))
                    if t < reach || (t == reach && best.is_some_and(|b| self.index[slot] < self.index[b.1])) =>
                {
                    best = Some((t, slot, weight));
                    t
                }
                _ => reach,
            },
        );
        best
    }
}

/// Ray in a space where it runs along one axis.
pub(super) struct Shear {
    origin: Vec3,
    axis: [usize; 3],
    shear: Vec3,
}

impl Shear {
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let z = direction.iamax();
        if direction[z] == 0.0 {
            return None;
        }
        let axis = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = Vec3::new(direction[axis[0]] / direction[z], direction[axis[1]] / direction[z], 1.0 / direction[z]);
        Some(Shear { origin, axis, shear })
    }

    /// Parameter of the hit and weights of corners 1 and 2.
    pub(super) fn hit(&self, corner: [Vec3; 3]) -> Option<(f64, [f64; 2])> {
        let [kx, ky, kz] = self.axis;
        let p = corner.map(|c| {
            let d = c - self.origin;
            (d[kx] - self.shear.x * d[kz], d[ky] - self.shear.y * d[kz], self.shear.z * d[kz])
        });
        let side = |i: usize, j: usize| p[i].0 * p[j].1 - p[i].1 * p[j].0;
        let (u, v, w) = (side(1, 2), side(2, 0), side(0, 1));
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        let t = (u * p[0].2 + v * p[1].2 + w * p[2].2) / sum;
        (t >= 0.0).then_some((t, [v / sum, w / sum]))
    }
}
