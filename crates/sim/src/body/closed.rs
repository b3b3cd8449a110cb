//! Meshes with their holes closed.

use crate::Vec3;
use pelage_geom::{Bvh, Mesh, NONE, Topology};

/// A hole is closed if its lid has at most this share of the mesh's area. A hemisphere's has half and makes a solid; a
/// sheet's has all of it and would lie on the sheet, so that sheets stay open.
const LARGEST_LID: f64 = 0.6;

/// A rest mesh whose holes (a bust's at the neck) are closed by fans around the mean of their rim, so that its inside is
/// one everywhere. Vertices and triangles of the mesh come first and keep their numbers.
#[derive(Clone, Debug, Default)]
pub struct Closed {
    /// The mesh with its lids, at rest.
    pub mesh: Mesh,
    /// That mesh's topology.
    pub topology: Topology,
    /// Open edges of the mesh as it came; those left open are counted by `topology`.
    pub open_edges: usize,
    /// Rims, each the vertices whose mean is a lid's middle.
    rim: Vec<Vec<u32>>,
}

impl Closed {
    /// Closes the holes of a rest mesh with the topology given. Rims that branch, or whose lid is larger than 0.6 of the
    /// mesh, stay open.
    pub fn new(mesh: &Mesh, topology: &Topology) -> Self {
        let mut closed = Closed { mesh: mesh.clone(), open_edges: topology.counts.open_edges, ..Closed::default() };
        let area: f64 = topology.area.iter().sum();
        for rim in rims(mesh, topology) {
            let middle = mean(&mesh.position, &rim);
            let at = |k: usize| Vec3::from(mesh.position[rim[k % rim.len()] as usize]);
            let lid: f64 = (0..rim.len()).map(|k| 0.5 * (at(k) - middle).cross(&(at(k + 1) - middle)).norm()).sum();
            if lid > LARGEST_LID * area || lid.is_nan() {
                continue;
            }
            let centre = closed.mesh.position.len() as u32;
            closed.mesh.position.push(middle.into());
            // The rim runs as its triangles do; a lid's edges run against it.
            let fan = (0..rim.len()).map(|k| [rim[(k + 1) % rim.len()], rim[k], centre]);
            closed.mesh.triangle.extend(fan);
            closed.rim.push(rim);
        }
        closed.mesh.corner_uv.clear();
        closed.mesh.face.clear();
        closed.topology = Topology::new(&closed.mesh);
        closed
    }

    /// Hierarchy over a pose: `position` of the vertices with those of the lids' middles, as [`Closed::extend`] makes
    /// them. Where a lid cuts through the mesh, what lies behind it outside is outside.
    pub fn bvh(&self, position: &[[f64; 3]]) -> Bvh {
        let lids = self.rim.iter().map(Vec::len).sum::<usize>();
        let bvh = Bvh::build(position, &self.mesh.triangle, &self.topology);
        if lids == 0 { bvh } else { bvh.with_lids(self.mesh.triangle.len() - lids, &self.topology) }
    }

    /// Values by vertex (positions, velocities) of the mesh with those of the lids' middles after them.
    pub fn extend(&self, value: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut all = value.to_vec();
        all.extend(self.rim.iter().map(|rim| <[f64; 3]>::from(mean(value, rim))));
        all
    }
}

fn mean(value: &[[f64; 3]], rim: &[u32]) -> Vec3 {
    rim.iter().map(|&v| Vec3::from(value[v as usize])).sum::<Vec3>() / rim.len() as f64
}

/// Closed rims of holes as mesh vertices, in the direction of their triangles, by lowest edge.
fn rims(mesh: &Mesh, topology: &Topology) -> Vec<Vec<u32>> {
    let welded = |v: u32| topology.weld[v as usize];
    // (welded start, start, welded end) of each open edge.
    let mut edge: Vec<[u32; 3]> = Vec::new();
    for (t, n) in topology.neighbour.iter().enumerate() {
        let tri = mesh.triangle[t];
        let w = tri.map(welded);
        if w[0] == w[1] || w[1] == w[2] || w[2] == w[0] {
            continue;
        }
        edge.extend((0..3).filter(|&i| n[i] == NONE).map(|i| [w[i], tri[i], w[(i + 1) % 3]]));
    }
    edge.sort_unstable();
    let from = |v: u32| edge.partition_point(|e| e[0] < v)..edge.partition_point(|e| e[0] <= v);
    let mut used = vec![false; edge.len()];
    let mut rims = Vec::new();
    for start in 0..edge.len() {
        let (mut rim, mut at) = (Vec::new(), start);
        while !used[at] {
            used[at] = true;
            rim.push(edge[at][1]);
            let next = from(edge[at][2]);
            if next.len() != 1 {
                rim.clear();
                break;
            }
            at = next.start;
        }
        if at == start && rim.len() > 2 {
            rims.push(rim);
        }
    }
    rims
}

#[cfg(test)]
#[path = "closed_tests.rs"]
mod tests;
