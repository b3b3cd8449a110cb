//! Straight paths over a mesh: the section of the mesh with a plane.

use crate::bvh::{edge_point, surface_point};
use crate::mesh::corners;
use crate::{Bvh, Mesh, SurfacePoint, Topology, Vec3};

/// A vertex lies on the plane when it is nearer than this fraction of the mesh's and path's extent. Below 1e-15 it is
/// rounding noise that decides; above 1e-7 a path visibly bends to vertices.
const ON_PLANE: f64 = 1e-12;

/// A corner with no more weight than this does not count: what single-precision barycentric coordinates leave.
const NO_WEIGHT: f64 = 2.5e-7;

/// Cosine and sine of the angles by which planes are turned: multiples of 22.5 degrees, either way round.
const TURNS: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
    [0.923_879_532_511_286_7, -0.382_683_432_365_089_8],
    [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2],
    [std::f64::consts::FRAC_1_SQRT_2, -std::f64::consts::FRAC_1_SQRT_2],
    [0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
    [0.382_683_432_365_089_8, -0.923_879_532_511_286_7],
    [0.0, 1.0],
];

/// A point of a path, in the triangle that the path comes from and in the one that it goes on in. Inside a triangle
/// both are the same; on an edge they are the same place seen from both sides, and where the edge is a seam they know
/// the texture coordinates of both charts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// In the triangle that is left.
    pub before: SurfacePoint,
    /// In the triangle that is entered.
    pub after: SurfacePoint,
}

/// Path from one point of the rest mesh to another along its section with the plane through both that contains the
/// mean of the normals there: start, every edge crossed (exactly on the edge), end. Of the two ways round a closed
/// section it is the shorter. Where neither way arrives (the section leaves over an open edge, or runs through a fold or
/// another part of the mesh) planes turned about the line between the points are tried, the least turned first; `None`
/// if no plane arrives.
pub fn straight_path(mesh: &Mesh, topology: &Topology, from: SurfacePoint, to: SurfacePoint) -> Option<Vec<PathPoint>> {
    let inner = |p: SurfacePoint| PathPoint { before: p, after: p };
    if from.triangle == to.triangle {
        return Some(vec![inner(from), inner(to)]);
    }
    let (starts, ends) = (seen_from(topology, &from), seen_from(topology, &to));
    for &a in &starts {
        if let Some(&b) = ends.iter().find(|b| b.triangle == a.triangle) {
            return Some(vec![PathPoint { before: from, after: a }, PathPoint { before: b, after: to }]);
        }
    }
    let plane = Plane::new(mesh, topology, &from, &to);
    TURNS.iter().find_map(|turn| {
        let plane = plane.turned(mesh.point(&to), *turn);
        // A vertex on the plane counts as above it in the first round, below it in the second, so that the plane
        // passes through no vertex and cuts each triangle in two edges or none.
        let mut best: Option<(f64, Vec<PathPoint>)> = None;
        for zero_is_above in [true, false] {
            let cut = Cut { mesh, topology, plane: &plane, zero_is_above };
            for &start in starts.iter().filter(|s| cut.crosses(s.triangle)) {
                for edge in (0..3).filter(|&e| cut.crosses_edge(start.triangle, e)) {
                    let limit = best.as_ref().map_or(f64::INFINITY, |b| b.0 * (1.0 - 1e-9));
                    best = cut.walk(from, to, start, edge, &ends, limit).or(best);
                }
            }
        }
        best.map(|b| b.1)
    })
}

/// Path over the points of the rest mesh closest to `points` (scene units), straight from each to the next; `bvh` is
/// that of the rest mesh. `None` without points or where a straight path does not arrive.
pub fn polyline_path(mesh: &Mesh, topology: &Topology, bvh: &Bvh, points: &[Vec3]) -> Option<Vec<PathPoint>> {
    let mut path: Vec<PathPoint> = Vec::new();
    for p in points {
        let to = bvh.closest(*p, f64::INFINITY)?.point;
        match path.pop() {
            None => path.push(PathPoint { before: to, after: to }),
            Some(joint) => {
                let mut piece = straight_path(mesh, topology, joint.after, to)?;
                piece[0].before = joint.before;
                path.append(&mut piece);
            }
        }
    }
    (!path.is_empty()).then_some(path)
}

/// A point as every triangle around it sees it (one inside a triangle, two on an edge, all around a vertex), without
/// triangles that have two corners welded together.
fn seen_from(topology: &Topology, p: &SurfacePoint) -> Vec<SurfacePoint> {
    let mut support: Vec<(u32, f64)> = Vec::new();
    for (i, w) in p.weights().into_iter().enumerate() {
        let v = topology.welded(p.triangle, i);
        if w > NO_WEIGHT {
            match support.iter_mut().find(|s| s.0 == v) {
                Some(s) => s.1 += w,
                None => support.push((v, w)),
            }
        }
    }
    let total: f64 = support.iter().map(|s| s.1).sum();
    let Some(&(first, _)) = support.first() else { return Vec::new() };
    let mut around: Vec<u32> = topology.incident_welded(first).iter().map(|c| c / 3).collect();
    around.sort_unstable();
    around.dedup();
    let seen = around.into_iter().filter_map(|t| {
        let v = [0, 1, 2].map(|i| topology.welded(t, i));
        let sound = v[0] != v[1] && v[1] != v[2] && v[2] != v[0];
        let weight = |i: usize| support.iter().find(|s| s.0 == v[i]).map_or(0.0, |s| s.1 / total);
        let whole = support.iter().all(|s| v.contains(&s.0));
        // Three corners welded to the same vertices may be another triangle, back to back: the point is in one.
        let same = support.len() < 3 || t == p.triangle;
        (sound && whole && same).then(|| surface_point(t, [weight(1), weight(2)]))
    });
    seen.collect()
}

/// Signed distances of vertices from the plane of a path.
struct Plane {
    origin: Vec3,
    normal: Vec3,
    on: f64,
}

impl Plane {
    fn new(mesh: &Mesh, topology: &Topology, from: &SurfacePoint, to: &SurfacePoint) -> Self {
        let (a, b) = (mesh.point(from), mesh.point(to));
        let (na, nb) = (normal_at(mesh, topology, from), normal_at(mesh, topology, to));
        let along = b - a;
        let across = [na + nb, na, nb, Vec3::x(), Vec3::y(), Vec3::z()].map(|n| n.cross(&along));
        let steep = 1e-6 * along.norm();
        let normal = across.into_iter().find_map(|m| m.try_normalize(steep)).unwrap_or_else(Vec3::x);
        let (low, high) = mesh.bounds();
        let extent = (Vec3::from(high) - Vec3::from(low)).norm() + a.amax();
        Plane { origin: a, normal, on: ON_PLANE * extent }
    }

    /// Turned about the line from its origin to `to`.
    fn turned(&self, to: Vec3, [cos, sin]: [f64; 2]) -> Self {
        let axis = (to - self.origin).try_normalize(0.0).unwrap_or_default();
        let normal = self.normal * cos + axis.cross(&self.normal) * sin;
        Plane { normal: if normal.norm() > 0.0 { normal } else { self.normal }, ..*self }
    }

    /// Distance, scene units; 0 if it is next to nothing.
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let d = self.normal.dot(&(Vec3::from(*p) - self.origin));
        if d.abs() <= self.on { 0.0 } else { d }
    }
}

/// Mean unit normal of the triangles around a point.
fn normal_at(mesh: &Mesh, topology: &Topology, p: &SurfacePoint) -> Vec3 {
    let unit = |s: &SurfacePoint| {
        let [a, b, c] = mesh.corners(s.triangle);
        (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
    };
    let sum: Vec3 = seen_from(topology, p).iter().map(unit).sum();
    sum.try_normalize(1e-6).unwrap_or_default()
}

/// A mesh cut by a plane.
struct Cut<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    plane: &'a Plane,
    zero_is_above: bool,
}

impl Cut<'_> {
    /// Distances of a triangle's corners, those of welded vertices.
    fn distances(&self, t: u32) -> [f64; 3] {
        [0, 1, 2].map(|i| self.plane.distance(&self.mesh.position[self.topology.welded(t, i) as usize]))
    }

    fn above(&self, d: f64) -> bool {
        d > 0.0 || (d == 0.0 && self.zero_is_above)
    }

    fn crosses_edge(&self, t: u32, edge: usize) -> bool {
        let d = self.distances(t);
        self.above(d[edge]) != self.above(d[(edge + 1) % 3])
    }

    fn crosses(&self, t: u32) -> bool {
        (0..3).any(|e| self.crosses_edge(t, e))
    }

    /// Where the plane crosses an edge, as weight of its end in steps of 2^-24, the same from both sides.
    fn crossing(&self, t: u32, edge: usize) -> f64 {
        let d = self.distances(t);
        let (a, b) = (d[edge], d[(edge + 1) % 3]);
        let turned = self.topology.welded(t, edge) > self.topology.welded(t, (edge + 1) % 3);
        let (from, to) = if turned { (b, a) } else { (a, b) };
        let end = ((from / (from - to)).clamp(0.0, 1.0) * 16_777_216.0).round() / 16_777_216.0;
        if turned { 1.0 - end } else { end }
    }

    /// Walks from `start` out over `edge` until a triangle of `ends`; length and points, or `None` if the way leaves
    /// the mesh, gets as long as `limit`, or does not end.
    fn walk(
        &self,
        from: SurfacePoint,
        to: SurfacePoint,
        start: SurfacePoint,
        mut edge: usize,
        ends: &[SurfacePoint],
        limit: f64,
    ) -> Option<(f64, Vec<PathPoint>)> {
        let mut path = vec![PathPoint { before: from, after: start }];
        let mut t = start.triangle;
        let mut at = self.mesh.point(&from);
        let mut length = 0.0;
        for _ in 0..self.mesh.triangle.len() {
            let end = self.crossing(t, edge);
            let (n, j) = self.topology.across(t, edge)?;
            let before = edge_point(t, edge, end);
            path.push(PathPoint { before, after: edge_point(n, j, 1.0 - end) });
            let p = before.blend(corners(&self.mesh.position, self.mesh.triangle[t as usize]));
            length += (p - at).norm();
            at = p;
            if let Some(&arrived) = ends.iter().find(|e| e.triangle == n) {
                path.push(PathPoint { before: arrived, after: to });
                length += (self.mesh.point(&to) - at).norm();
                return (length < limit).then_some((length, path));
            }
            if length >= limit {
                return None;
            }
            edge = (1..3).map(|k| (j + k) % 3).find(|&e| self.crosses_edge(n, e))?;
            t = n;
        }
        None
    }
}
