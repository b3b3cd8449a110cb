//! What tests ask of a mesh.

use crate::{Mesh, Vec3};

/// Counts and measures of a mesh.
#[derive(Debug)]
pub struct Facts {
    /// Edges with one triangle, after welding equal positions.
    pub open_edges: usize,
    /// Edges with three or more triangles, or two that run the same way.
    pub bad_edges: usize,
    /// Triangles with no or negative area in (u, v).
    pub flipped_uv: usize,
    /// Sets of triangles joined by shared vertex indices.
    pub charts: usize,
    /// Vertices - edges + triangles of the welded mesh.
    pub euler: i64,
    /// Enclosed volume, positive if oriented outward.
    pub volume: f64,
    /// Smallest angle of each triangle, degrees.
    pub min_angle: Vec<f64>,
}

/// First vertex at the same position, for each vertex.
pub fn weld(mesh: &Mesh) -> Vec<u32> {
    let key = |v: u32| mesh.position[v as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..mesh.position.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));
    let mut first = vec![0; order.len()];
    let mut lead = 0;
    for (i, &v) in order.iter().enumerate() {
        if i == 0 || key(v) != key(order[i - 1]) {
            lead = v;
        }
        first[v as usize] = lead;
    }
    first
}

/// Charts by shared vertex indices: one number a triangle.
pub fn charts(mesh: &Mesh) -> Vec<usize> {
    let mut parent: Vec<u32> = (0..mesh.position.len() as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    for t in &mesh.triangle {
        for k in 1..3 {
            let (a, b) = (root(&mut parent, t[0]), root(&mut parent, t[k]));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let of: Vec<u32> = mesh.triangle.iter().map(|t| root(&mut parent, t[0])).collect();
    let mut all = of.clone();
    all.sort_unstable();
    all.dedup();
    of.iter().map(|r| all.binary_search(r).unwrap()).collect()
}

/// Measures a mesh.
pub fn facts(mesh: &Mesh) -> Facts {
    let first = weld(mesh);
    let triangle: Vec<[u32; 3]> = mesh.triangle.iter().map(|t| t.map(|v| first[v as usize])).collect();
    let mut edge: Vec<(u32, u32, bool)> = triangle
        .iter()
        .flat_map(|t| (0..3).map(|i| (t[i], t[(i + 1) % 3])))
        .map(|(a, b)| (a.min(b), a.max(b), a < b))
        .collect();
    edge.sort_unstable();
    let (mut open, mut bad, mut edges) = (0, 0, 0);
    for group in edge.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        edges += 1;
        match group {
            [_] => open += 1,
            [a, b] if a.2 != b.2 => {}
            _ => bad += 1,
        }
    }
    let mut used: Vec<u32> = triangle.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let area = |c: &[[f32; 2]; 3]| {
        let [a, b, c] = c.map(|p| p.map(f64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let angle = |c: [Vec3; 3]| {
        let at = |i: usize| (c[(i + 1) % 3] - c[i]).angle(&(c[(i + 2) % 3] - c[i])).to_degrees();
        at(0).min(at(1)).min(at(2))
    };
    let corners = (0..triangle.len()).map(|t| mesh.corners(t as u32));
    Facts {
        open_edges: open,
        bad_edges: bad,
        flipped_uv: mesh.corner_uv.iter().filter(|c| area(c) <= 0.0).count(),
        charts: charts(mesh).into_iter().max().map_or(0, |m| m + 1),
        euler: used.len() as i64 - edges + triangle.len() as i64,
        volume: corners.clone().map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum(),
        min_angle: corners.map(angle).collect(),
    }
}

/// Texels of a `size` map whose centre lies strictly inside triangles of two charts.
pub fn uv_overlap(mesh: &Mesh, size: usize) -> usize {
    let chart = charts(mesh);
    let mut owner = vec![usize::MAX; size * size];
    let mut shared = 0;
    for (t, c) in mesh.corner_uv.iter().enumerate() {
        let p = c.map(|p| p.map(|x| f64::from(x) * size as f64 - 0.5));
        let range = |k: usize| {
            let (lo, hi) = p.iter().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(q[k]), h.max(q[k])));
            lo.ceil().max(0.0) as usize..=hi.floor() as usize
        };
        for y in range(1) {
            for x in range(0) {
                let side =
                    |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (y as f64 - a[1]) - (b[1] - a[1]) * (x as f64 - a[0]);
                if (0..3).all(|i| side(p[i], p[(i + 1) % 3]) > 1e-9) {
                    let o = &mut owner[y * size + x];
                    // Also counts a chart that lies over itself.
                    shared += usize::from(*o != usize::MAX);
                    *o = chart[t];
                }
            }
        }
    }
    shared
}

/// Pairs (edge, triangle) of the welded mesh that cross without sharing a vertex.
pub fn crossings(mesh: &Mesh) -> usize {
    let first = weld(mesh);
    let triangle: Vec<[u32; 3]> = mesh.triangle.iter().map(|t| t.map(|v| first[v as usize])).collect();
    let (lo, hi) = mesh.bounds();
    let widest = (0..3).map(|i| hi[i] - lo[i]).fold(0.0, f64::max);
    let n = 48;
    let cell = |x: f64, i: usize| (((x - lo[i]) / widest * n as f64) as usize).min(n - 1);
    let mut bin: Vec<Vec<u32>> = vec![Vec::new(); n * n * n];
    let cells_of = |t: u32, out: &mut Vec<Vec<u32>>| {
        let c = mesh.corners(t);
        let r: [_; 3] = std::array::from_fn(|i| {
            let (a, b) = c.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[i]), h.max(p[i])));
            cell(a, i)..=cell(b, i)
        });
        for z in r[2].clone() {
            for y in r[1].clone() {
                for x in r[0].clone() {
                    out[(z * n + y) * n + x].push(t);
                }
            }
        }
    };
    (0..triangle.len() as u32).for_each(|t| cells_of(t, &mut bin));
    let mut found = Vec::new();
    for list in &bin {
        for (&s, &t) in list.iter().flat_map(|s| list.iter().map(move |t| (s, t))) {
            let (e, f) = (triangle[s as usize], triangle[t as usize]);
            if e.iter().any(|v| f.contains(v)) {
                continue;
            }
            let (p, q) = (mesh.corners(s), mesh.corners(t));
            if (0..3).any(|i| pierces(p[i], p[(i + 1) % 3], q)) {
                found.push((s, t));
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found.len()
}

/// Segment `a b` crosses triangle `t`.
fn pierces(a: Vec3, b: Vec3, t: [Vec3; 3]) -> bool {
    let six = |a: Vec3, b: Vec3, c: Vec3, d: Vec3| (b - a).cross(&(c - a)).dot(&(d - a));
    let (u, w) = (six(t[0], t[1], t[2], a), six(t[0], t[1], t[2], b));
    if u * w > 0.0 {
        return false;
    }
    let s = [six(a, b, t[0], t[1]), six(a, b, t[1], t[2]), six(a, b, t[2], t[0])];
    s.iter().all(|&x| x > 0.0) || s.iter().all(|&x| x < 0.0)
}

/// 64-bit FNV-1a over the bits of positions and texture coordinates.
pub fn fingerprint(mesh: &Mesh) -> u64 {
    let position = mesh.position.iter().flatten().flat_map(|x| x.to_bits().to_le_bytes());
    let uv = mesh.corner_uv.iter().flatten().flatten().flat_map(|x| x.to_bits().to_le_bytes());
    position.chain(uv).fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3))
}

mod tests {
    use super::*;
    use crate::shapes::bodies::plane;

    #[test]
    fn crossings_and_overlaps_are_seen() {
        let mut mesh = plane(2, 2, 2.0);
        assert_eq!((crossings(&mesh), uv_overlap(&mesh, 64)), (0, 0));
        let other = plane(2, 2, 2.0);
        mesh.position.extend(other.position.iter().map(|p| [0.1 + p[1], 0.05 + p[0], 0.02 + p[2]]));
        mesh.triangle.extend(other.triangle.iter().map(|t| t.map(|v| v + 9)));
        mesh.corner_uv.extend(other.corner_uv);
        assert!(crossings(&mesh) > 0);
        assert!(uv_overlap(&mesh, 64) > 3000);
    }
}
