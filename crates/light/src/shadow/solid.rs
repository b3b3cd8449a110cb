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

/// Texels along a side of a cell of [`Cover`], and most cells along its side: of smaller ones a mesh's triangles cover many
/// each, in larger ones more points lie beside an edge of the mesh and take a ray.
const CELL: f32 = 4.0;
const CELLS: f32 = 256.0;

/// How far from the light the solids begin, in squares of a map: points before that are lit without a ray.
pub(crate) struct Cover {
    side: usize,
    /// Cells per texel.
    scale: f32,
    /// Least depth of what lies over a cell; empty without solids.
    near: Vec<f32>,
}

impl Cover {
    pub fn new(solids: &[Solid], projection: &Projection) -> Cover {
        let texels = projection.texels as f32;
        let scale = 1.0 / CELL.max(texels / CELLS);
        let side = (texels * scale) as usize + 1;
        let near = if solids.is_empty() { Vec::new() } else { vec![f32::INFINITY; side * side] };
        let mut cover = Cover { side, scale, near };
        let on = 2.0 * ON * projection.size;
        for solid in solids {
            for triangle in solid.triangle {
                let corner = triangle.map(|v| Vec3::from(solid.position[v as usize]));
                if corner.iter().all(|p| projection.is_behind(*p)) {
                    continue;
                }
                let [Some(a), Some(b), Some(c)] = corner.map(|p| projection.front(p, on)) else {
                    // It reaches past the light, where its image has no bounds.
                    cover.near.fill(f32::NEG_INFINITY);
                    return cover;
                };
                cover.add([a, b, c]);
            }
        }
        cover
    }

    /// Marks the cells in the box of a triangle. Depth is linear over it, so it is least at a corner.
    fn add(&mut self, corner: [[f32; 3]; 3]) {
        let least = |i: usize| corner[0][i].min(corner[1][i]).min(corner[2][i]);
        let most = |i: usize| corner[0][i].max(corner[1][i]).max(corner[2][i]);
        let end = (self.side - 1) as f32;
        // Rounding of a point's place is under 1e-3 texels.
        let cells = [0, 1].map(|i| [(least(i) - 0.01) * self.scale, (most(i) + 0.01) * self.scale]);
        if cells.iter().any(|c| c[1] < 0.0 || c[0] > end + 1.0) {
            return;
        }
        let [x, y] = cells.map(|c| c[0].clamp(0.0, end) as usize..=c[1].clamp(0.0, end) as usize);
        let depth = least(2);
        for row in y {
            for near in &mut self.near[row * self.side..][x.clone()] {
                *near = near.min(depth);
            }
        }
    }

    /// True if no solid lies between the light and a point with these coordinates on the map.
    #[inline]
    pub fn is_clear(&self, at: [f32; 3]) -> bool {
        let cell = |v: f32| ((v * self.scale) as usize).min(self.side - 1);
        self.near.is_empty() || at[2] < self.near[cell(at[1]) * self.side + cell(at[0])]
    }
}
