//! A skin at one instant: positions, smooth normals, tangents along u, and root frames.

use crate::mesh::corners;
use crate::{Mesh, SurfacePoint, Topology, Vec3};
use rayon::prelude::*;

/// A sum of vectors counts as cancelled when it is shorter than this fraction of the sum of their lengths. Below about
/// 1e-14 its direction is rounding noise and flips from frame to frame; above about 1e-4 the rims of thin folded skin
/// (ears, lips) lose normals that are perfectly good.
const CANCELLED: f64 = 1e-9;

/// A skin at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Vertices, scene units, in the mesh's order.
    pub position: Vec<[f64; 3]>,
    /// Unit normals, one a mesh vertex; equal at vertices that are welded.
    pub normal: Vec<[f32; 3]>,
    /// Unit tangents along u, one a chart vertex.
    pub tangent: Vec<[f32; 3]>,
}

/// Root frame [N, dU, N x dU] at a point of the skin (production-pipeline paper, Figure 4): columns of a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The point, scene units.
    pub origin: Vec3,
    /// Unit smooth normal.
    pub n: Vec3,
    /// Unit tangent along u, at right angles to `n`.
    pub du: Vec3,
    /// `n` x `du`.
    pub dv: Vec3,
}

impl Pose {
    /// Normals and tangents of `position` on the topology of the rest pose.
    ///
    /// Normals are sums of cross products (area-weighted). Tangents are area-weighted means of the directions of
    /// dP/du over a chart's triangles at the vertex, made orthogonal to the normal. Where a sum cancels or nothing
    /// counts (triangles without area, in space or in texture coordinates), values spread from neighbours.
    pub fn new(mesh: &Mesh, topology: &Topology, position: Vec<[f64; 3]>) -> Self {
        assert_eq!(position.len(), topology.weld.len(), "a pose has the vertices of its rest mesh");
        let cross: Vec<Vec3> = mesh
            .triangle
            .par_iter()
            .map(|t| {
                let [a, b, c] = corners(&position, *t);
                (b - a).cross(&(c - a))
            })
            .collect();
        let welded = welded_normals(mesh, topology, &cross);
        let tangent = tangents(mesh, topology, &position, &cross, &welded);
        let normal = topology.weld.par_iter().map(|&w| to_f32(welded[w as usize])).collect();
        Pose { position, normal, tangent: tangent.par_iter().map(|&t| to_f32(t)).collect() }
    }

    /// Root frame at a point of the skin.
    pub fn frame(&self, mesh: &Mesh, topology: &Topology, p: &SurfacePoint) -> Frame {
        let tri = mesh.triangle[p.triangle as usize];
        let at = corners(&self.position, tri);
        let normals = tri.map(|v| to_f64(self.normal[v as usize]));
        let face = || (at[1] - at[0]).cross(&(at[2] - at[0]));
        let n = unit(p.blend(normals), 1.0).or_else(|| unit(face(), 1.0)).unwrap_or(normals[0]);

        let tangents = topology.corner[p.triangle as usize].map(|c| to_f64(self.tangent[c as usize]));
        // What comes second is rarely needed.
        let du = tangential(p.blend(tangents), n)
            .or_else(|| tangential(along_u(mesh, topology, p.triangle, at), n))
            .or_else(|| tangents.into_iter().find_map(|v| tangential(v, n)))
            .unwrap_or_else(|| perpendicular(n));
        Frame { origin: p.blend(at), n, du, dv: n.cross(&du) }
    }
}

fn to_f32(v: Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn to_f64(v: [f32; 3]) -> Vec3 {
    Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}

/// `sum` at length 1, unless it is cancelled against `total`.
fn unit(sum: Vec3, total: f64) -> Option<Vec3> {
    let norm = sum.norm();
    (norm > CANCELLED * total && norm.is_finite() && norm > 0.0).then(|| sum / norm)
}

/// Unit vector of `v` without its part along the unit vector `n`.
fn tangential(v: Vec3, n: Vec3) -> Option<Vec3> {
    let once = unit(v - n * n.dot(&v), v.norm())?;
    // Again, for what rounding left where `v` was nearly along `n`.
    unit(once - n * n.dot(&once), 1.0)
}

/// A unit vector at right angles to the unit vector `n`, always the same.
fn perpendicular(n: Vec3) -> Vec3 {
    let a = n.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        Vec3::x()
    } else if a.y <= a.z {
        Vec3::y()
    } else {
        Vec3::z()
    };
    tangential(axis, n).unwrap_or(axis)
}

/// Unit direction of dP/du of a triangle; zero if it has none.
fn along_u(mesh: &Mesh, topology: &Topology, t: u32, at: [Vec3; 3]) -> Vec3 {
    if topology.flat_uv[t as usize] {
        return Vec3::zeros();
    }
    let uv = mesh.corner_uv[t as usize].map(|c| c.map(f64::from));
    let (v1, v2) = (uv[1][1] - uv[0][1], uv[2][1] - uv[0][1]);
    let det = (uv[1][0] - uv[0][0]) * v2 - (uv[2][0] - uv[0][0]) * v1;
    let (e1, e2) = (at[1] - at[0], at[2] - at[0]);
    let total = e1.norm() * v2.abs() + e2.norm() * v1.abs();
    unit((e1 * v2 - e2 * v1) * det.signum(), total).unwrap_or_default()
}

/// Unit normals by vertex; set at welded vertices only.
fn welded_normals(mesh: &Mesh, topology: &Topology, cross: &[Vec3]) -> Vec<Vec3> {
    let mut normal: Vec<Vec3> = (0..topology.weld.len() as u32)
        .into_par_iter()
        .map(|v| {
            let around = topology.incident_welded(v).iter().map(|&c| cross[c as usize / 3]);
            let (sum, total) = around.fold((Vec3::zeros(), 0.0), |(s, t), n| (s + n, t + n.norm()));
            unit(sum, total).unwrap_or_default()
        })
        .collect();
    let missing: Vec<u32> = (0..topology.weld.len() as u32)
        .filter(|&v| topology.weld[v as usize] == v && normal[v as usize] == Vec3::zeros())
        .collect();
    let beside = |v: u32, found: &mut Vec<u32>| {
        for &c in topology.incident_welded(v) {
            found.extend(mesh.triangle[c as usize / 3].map(|w| topology.weld[w as usize]).iter().filter(|&&w| w != v));
        }
    };
    spread(&mut normal, &missing, &beside, &|_, sum, total| unit(sum, total));
    for v in missing {
        if normal[v as usize] == Vec3::zeros() {
            normal[v as usize] = Vec3::y();
        }
    }
    normal
}

/// Unit tangents by chart vertex.
fn tangents(mesh: &Mesh, topology: &Topology, position: &[[f64; 3]], cross: &[Vec3], normal: &[Vec3]) -> Vec<Vec3> {
    let weighted: Vec<Vec3> = (0..mesh.triangle.len() as u32)
        .into_par_iter()
        .map(|t| along_u(mesh, topology, t, corners(position, mesh.triangle[t as usize])) * cross[t as usize].norm())
        .collect();
    let normal_at = |k: u32| normal[topology.chart_vertex[k as usize].vertex as usize];
    let mut tangent: Vec<Vec3> = (0..topology.chart_vertex.len() as u32)
        .into_par_iter()
        .map(|k| {
            let around = topology.incident(k as usize).iter().map(|&c| weighted[c as usize / 3]);
            let (sum, total) = around.fold((Vec3::zeros(), 0.0), |(s, t), n| (s + n, t + n.norm()));
            unit(sum, total).and_then(|s| tangential(s, normal_at(k))).unwrap_or_default()
        })
        .collect();
    let lacks = |tangent: &[Vec3], k: &u32| tangent[*k as usize] == Vec3::zeros();
    let missing: Vec<u32> = (0..tangent.len() as u32).filter(|k| lacks(&tangent, k)).collect();
    let in_chart = |k: u32, found: &mut Vec<u32>| {
        for &c in topology.incident(k as usize) {
            found.extend(topology.corner[c as usize / 3].iter().filter(|&&o| o != k));
        }
    };
    let anywhere = |k: u32, found: &mut Vec<u32>| {
        in_chart(k, found);
        let here = topology.chart_vertices(topology.chart_vertex[k as usize].vertex);
        found.extend(here.map(|o| o as u32).filter(|&o| o != k));
    };
    let settle = |k: u32, sum: Vec3, total: f64| unit(sum, total).and_then(|s| tangential(s, normal_at(k)));
    spread(&mut tangent, &missing, &in_chart, &settle);
    let still: Vec<u32> = missing.into_iter().filter(|k| lacks(&tangent, k)).collect();
    spread(&mut tangent, &still, &anywhere, &settle);
    for k in still {
        if lacks(&tangent, &k) {
            tangent[k as usize] = perpendicular(normal_at(k));
        }
    }
    tangent
}

/// Spreads values to the `missing` elements (which hold zero) from those beside them, breadth first: each ring reads
/// only the rings before it. `beside` appends the neighbours of an element, `settle` makes a value from their sum and
/// the sum of their lengths.
fn spread(
    value: &mut [Vec3],
    missing: &[u32],
    beside: &dyn Fn(u32, &mut Vec<u32>),
    settle: &dyn Fn(u32, Vec3, f64) -> Option<Vec3>,
) {
    let mut ring = missing.to_vec();
    let mut found = Vec::new();
    while !ring.is_empty() {
        let mut set = Vec::new();
        for &k in &ring {
            found.clear();
            beside(k, &mut found);
            let sum =
                found.iter().map(|&o| value[o as usize]).fold((Vec3::zeros(), 0.0), |s, v| (s.0 + v, s.1 + v.norm()));
            set.extend(settle(k, sum.0, sum.1).map(|v| (k, v)));
        }
        found.clear();
        for &(k, v) in &set {
            value[k as usize] = v;
            beside(k, &mut found);
        }
        ring = found.iter().copied().filter(|&o| value[o as usize] == Vec3::zeros()).collect();
        ring.sort_unstable();
        ring.dedup();
    }
}
