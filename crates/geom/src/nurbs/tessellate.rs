//! One triangle mesh of many patches.

use super::Patch;
use super::join::{Border, join};
use crate::Mesh;

/// How a patch is cut into triangles, and where its parameters lie in texture space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tessellation {
    /// Cells along u and v, 1 or more, at equal steps of the parameter.
    pub cells: [usize; 2],
    /// Texture coordinates of u = v = 0.
    pub low: [f32; 2],
    /// Texture coordinates of u = v = 1.
    pub high: [f32; 2],
}

impl Tessellation {
    /// `cells` in texture tile `tile`, counted from 0 as UDIM tiles are: ten in a row, u first.
    pub fn tile(cells: [usize; 2], tile: usize) -> Self {
        let low = [(tile % 10) as f32, (tile / 10) as f32];
        Tessellation { cells, low, high: low.map(|x| x + 1.0) }
    }

    fn uv(&self, uv: [f64; 2]) -> [f32; 2] {
        std::array::from_fn(|i| (f64::from(self.low[i]) * (1.0 - uv[i]) + f64::from(self.high[i]) * uv[i]) as f32)
    }
}

/// The mesh of patches, each with its tessellation. Its texture coordinates are the patches' parameters, its polygons
/// (`face`) their cells, patch after patch, u running faster.
///
/// Vertices on borders of patches (and of one patch, where it closes) that lie within `tolerance` (scene units, more than
/// 0) of each other become one. Where neighbours are cut differently, the vertices of either that lie on the other's
/// border within the tolerance are inserted there, and the cell is cut around its middle, so that no cracks remain. The
/// tolerance must be larger than what patches that should meet are apart, and smaller than the cells; sides shorter than
/// it collapse to a point, and their triangles are left out. Says what is wrong.
pub fn mesh(patches: &[(Patch, Tessellation)], tolerance: f64) -> Result<Mesh, String> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(format!("a tolerance is more than 0, not {tolerance}"));
    }
    let mut points = 0;
    for (k, (_, cut)) in patches.iter().enumerate() {
        if cut.cells[0] == 0 || cut.cells[1] == 0 {
            return Err(format!("patch {k} is cut into {} x {} cells", cut.cells[0], cut.cells[1]));
        }
        // Corners and middles.
        points += 2 * (cut.cells[0] + 1).saturating_mul(cut.cells[1] + 1);
        if points > u32::MAX as usize {
            return Err("patches are cut into more than 2^32 points".into());
        }
    }
    let mut builder = Builder::default();
    let mut borders = Vec::new();
    let mut corners = Vec::new();
    for (patch, cut) in patches {
        let first = builder.mesh.position.len() as u32;
        let [nu, nv] = cut.cells;
        for j in 0..=nv {
            for i in 0..=nu {
                builder.point(patch, [i as f64 / nu as f64, j as f64 / nv as f64]);
            }
        }
        corners.push(first);
        borders.push(Border { patch, cells: cut.cells, first });
    }
    let (same, inserted) = join(&builder.mesh.position, &borders, tolerance);
    let mut inserted = inserted.iter().peekable();
    for (k, (patch, cut)) in patches.iter().enumerate() {
        let [nu, nv] = cut.cells;
        for j in 0..nv {
            for i in 0..nu {
                // Counter-clockwise from (0, 0); sides as in `join`.
                let at = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                let corner = at.map(|[i, j]| Corner {
                    vertex: same[corners[k] as usize + j * (nu + 1) + i],
                    uv: [i as f64 / nu as f64, j as f64 / nv as f64],
                });
                let mut ring: Vec<Corner> = Vec::new();
                for (side, c) in corner.into_iter().enumerate() {
                    ring.push(c);
                    while let Some(new) = inserted.next_if(|n| (n.patch, n.cell, n.side) == (k, [i, j], side)) {
                        ring.push(Corner { vertex: same[new.vertex as usize], uv: new.uv });
                    }
                }
                builder.cell(patch, cut, &ring);
            }
        }
    }
    builder.mesh.keep_used();
    Ok(builder.mesh)
}

#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    uv: [f64; 2],
}

#[derive(Default)]
struct Builder {
    mesh: Mesh,
    cells: u32,
}

impl Builder {
    fn point(&mut self, patch: &Patch, uv: [f64; 2]) -> u32 {
        self.mesh.position.push(patch.point(uv).into());
        self.mesh.position.len() as u32 - 1
    }

    /// Triangles of a cell: two, or around its middle if there is something on its sides.
    fn cell(&mut self, patch: &Patch, cut: &Tessellation, ring: &[Corner]) {
        if let [a, b, c, d] = ring {
            self.triangle(cut, [a, b, c]);
            self.triangle(cut, [a, c, d]);
        } else {
            let uv = [0, 1].map(|i| 0.5 * (ring[0].uv[i] + ring.iter().map(|c| c.uv[i]).fold(0.0, f64::max)));
            let middle = Corner { vertex: self.point(patch, uv), uv };
            for k in 0..ring.len() {
                self.triangle(cut, [&ring[k], &ring[(k + 1) % ring.len()], &middle]);
            }
        }
        self.cells += 1;
    }

    fn triangle(&mut self, cut: &Tessellation, corner: [&Corner; 3]) {
        let v = corner.map(|c| c.vertex);
        if v[0] != v[1] && v[1] != v[2] && v[2] != v[0] {
            self.mesh.triangle.push(v);
            self.mesh.corner_uv.push(corner.map(|c| cut.uv(c.uv)));
            self.mesh.face.push(self.cells);
        }
    }
}

impl Mesh {
    /// Leaves out vertices without triangles.
    fn keep_used(&mut self) {
        let mut used = vec![false; self.position.len()];
        self.triangle.iter().flatten().for_each(|v| used[*v as usize] = true);
        let mut number = 0;
        let new: Vec<u32> = used
            .iter()
            .map(|u| {
                number += u32::from(*u);
                number.saturating_sub(1)
            })
            .collect();
        self.triangle.iter_mut().flatten().for_each(|v| *v = new[*v as usize]);
        let mut used = used.iter();
        self.position.retain(|_| used.next().copied().unwrap_or(false));
    }
}
