//! Skin of NURBS patches, as a TOML file of control grids.

use super::ply::ReadMesh;
use crate::Error;
use crate::config::{ConfigError, Document};
use pelage_geom::nurbs::{Patch, Tessellation, mesh};
use serde::Deserialize;
use std::path::Path;

/// Most cells of a patch along a direction.
const MOST_CELLS: usize = 4096;

/// A skin of patches.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NurbsFile {
    /// Borders of patches that lie this near to each other are one, scene units. Default: a millionth of the skin's size.
    tolerance: Option<f64>,
    /// The patches, each in a texture tile of its own: the first in 1001, the second in 1002, ten in a row.
    patch: Vec<PatchFile>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PatchFile {
    /// Degrees along u and v. Default: 3, 3.
    #[serde(default = "cubic")]
    degree: [usize; 2],
    /// Control points along u and v.
    count: [usize; 2],
    /// Control points, u running faster, scene units.
    points: Vec<[f64; 3]>,
    /// Their weights. Default: 1.
    weights: Option<Vec<f64>>,
    /// Knots along u. Default: even, the patch begins and ends in its border points.
    u: Option<Vec<f64>>,
    /// Knots along v.
    v: Option<Vec<f64>>,
    /// Cells that it is cut into along u and v. Default: four for each piece between knots.
    cells: Option<[usize; 2]>,
    /// True if v runs to the right of u as seen from its front; to the left if not.
    #[serde(default)]
    flip: bool,
}

fn cubic() -> [usize; 2] {
    [3, 3]
}

/// Reads a skin of patches as the mesh that stands for it.
pub fn read_mesh(path: &Path) -> Result<ReadMesh, Error> {
    let file: Document<NurbsFile> = Document::read(path)?;
    let mut patches = Vec::new();
    let mut size = 0.0f64;
    for (k, p) in file.value.patch.iter().enumerate() {
        let at = format!("patch[{k}]");
        let wrong = |e: String| file.error(&at, e, "");
        let [nu, nv] = p.count;
        if nu.checked_mul(nv) != Some(p.points.len()) {
            let what = format!("{} points are not {nu} x {nv}", p.points.len());
            return Err(file
                .error(&format!("{at}.points"), what, "`count` says how many there are along u and v")
                .into());
        }
        let knots = |given: &Option<Vec<f64>>, i: usize| -> Result<Vec<f64>, ConfigError> {
            let (n, d) = (p.count[i], p.degree[i]);
            if given.is_none() && n <= d {
                return Err(wrong(format!("degree {d} takes {} points or more, not {n}", d + 1)));
            }
            Ok(given.clone().unwrap_or_else(|| clamped(n, d)))
        };
        let knots = [knots(&p.u, 0)?, knots(&p.v, 1)?];
        let weights = p.weights.clone().unwrap_or_else(|| vec![1.0; p.points.len()]);
        let patch = Patch::new(p.degree, knots, p.points.clone(), weights).map_err(wrong)?;
        let cells = p.cells.unwrap_or([0, 1].map(|i| 4 * p.count[i].saturating_sub(p.degree[i]).max(1)));
        if cells.iter().any(|n| !(1..=MOST_CELLS).contains(n)) {
            return Err(file.error(&format!("{at}.cells"), "is out of range", format!("1 to {MOST_CELLS}")).into());
        }
        for x in p.points.iter().flatten() {
            size = size.max(x.abs());
        }
        let patch = if p.flip { patch.turned_over() } else { patch };
        patches.push((patch, Tessellation::tile(cells, k)));
    }
    let tolerance = file.value.tolerance.unwrap_or(1e-6 * size);
    let mesh = mesh(&patches, tolerance).map_err(|e| file.error("patch", e, ""))?;
    let faces = mesh.face.iter().max().map_or(0, |f| *f as usize + 1);
    Ok(ReadMesh { mesh, faces, vertex_normals_present: false, warnings: Vec::new() })
}

/// Even knots of a curve that begins in its first point and ends in its last.
fn clamped(n: usize, degree: usize) -> Vec<f64> {
    let pieces = n - degree;
    let knot = |k: usize| k.saturating_sub(degree).min(pieces) as f64 / pieces as f64;
    (0..=n + degree).map(knot).collect()
}

/// Positions of a skin of patches at a frame: as many as at rest.
pub fn read_frame(path: &Path, vertices: usize) -> Result<Vec<[f64; 3]>, Error> {
    let position = read_mesh(path)?.mesh.position;
    if position.len() == vertices {
        return Ok(position);
    }
    let what = format!("{}: has {} vertices, the rest pose has {vertices}", path.display(), position.len());
    Err(Error::input(what, "patches of a frame must be cut and meet as at rest"))
}

/// True if a file is a skin of patches, by its name.
pub fn is_nurbs(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}
