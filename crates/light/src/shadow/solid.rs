//! What solid things hide from a light.

use super::project::Projection;
use pelage_geom::{Bvh, Vec3};

/// A solid mesh in the pose of the frame: skin, clothes, a prop. Its triangles are counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Solid<'a> {
    /// Vertices, scene units.
    pub position: &'a [[f64; 3]],
    /// Triangles as vertex indices.
    pub triangle: &'a [[u32; 3]],
    /// Hierarchy over just these triangles in this pose.
    pub bvh: &'a Bvh,
}

/// Distance from a surface within which a point counts as on it, as a fraction of the hair's size: 10 um on 50 cm. Roots
/// lie on the skin to about 1e-7 of it; at 1e-6 rays that graze the skin begin to miss that, at 1e-3 thin things
/// (lids, ears' edges) let light through to roots on their back.
const ON: f64 = 2e-5;

/// Most surfaces a ray passes at its start.
const PASSED: usize = 8;

/// True if light reaches `p` past one solid. A point on the surface is lit if that surface faces the light: whether a
/// root is a rounding error inside or outside says nothing. Points inside are dark.
fn is_lit(solid: &Solid, p: Vec3, toward: Vec3, distance: f64, size: f64) -> bool {
    let on = ON * size;
    // From just before the point, so that its own surface is met on either side of it.
    let start = p - toward * on;
    let end = distance + on;
    let mut passed = 0.0;
    for _ in 0..PASSED {
        let Some((t, hit)) = solid.bvh.ray(start + toward * passed, toward, end - passed) else { return true };
        let t = passed + t;
        if t > 2.0 * on {
            return false;
        }
        let [a, b, c] = solid.triangle[hit.triangle as usize].map(|v| Vec3::from(solid.position[v as usize]));
        if (b - a).cross(&(c - a)).dot(&toward) < 0.0 {
            return false;
        }
        passed = t + 0.01 * on;
    }
    true
}

/// True if a solid lies between `p` and the light.
pub(crate) fn is_hidden(solids: &[Solid], p: Vec3, projection: &Projection) -> bool {
    let Some((toward, distance)) = projection.toward(p) else { return false };
    !solids.iter().all(|s| is_lit(s, p, toward, distance, projection.size))
}
