//! Grids of roots on the charts of a skin: equal in (u, v), or equal in arc length.

use crate::control::Skin;
use pelage_geom::{SurfacePoint, Topology, Vec3};
use rayon::prelude::*;

/// The smallest box around each chart in texture space: (low, high).
fn uv_bounds(topology: &Topology) -> Vec<([f64; 2], [f64; 2])> {
    let mut bounds = vec![([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]); topology.charts];
    for cv in &topology.chart_vertex {
        let (low, high) = &mut bounds[cv.chart as usize];
        for i in 0..2 {
            low[i] = low[i].min(f64::from(cv.uv[i]));
            high[i] = high[i].max(f64::from(cv.uv[i]));
        }
    }
    bounds
}

/// Centres of u x v cells over each chart's box in texture space, as points of the skin (where triangles overlap: of the
/// lowest); and how many centres lie outside. Chart by chart, rows of rising v.
pub(crate) fn grid_roots(skin: &Skin, u: usize, v: usize) -> (Vec<SurfacePoint>, usize) {
    let (mesh, topology) = (skin.mesh, skin.topology);
    let bounds = uv_bounds(topology);
    let mut found: Vec<Option<SurfacePoint>> = vec![None; topology.charts * u * v];
    for t in 0..mesh.triangle.len() {
        if topology.flat_uv[t] {
            continue;
        }
        let chart = topology.chart[t] as usize;
        let (low, high) = bounds[chart];
        let size = [(high[0] - low[0]) / u as f64, (high[1] - low[1]) / v as f64];
        let uv = mesh.corner_uv[t].map(|c| c.map(f64::from));
        let range = |i: usize, n: usize| {
            let of = |x: f64| (x - low[i]) / size[i] - 0.5;
            let (a, b) = (
                uv.iter().map(|c| of(c[i])).fold(f64::MAX, f64::min),
                uv.iter().map(|c| of(c[i])).fold(f64::MIN, f64::max),
            );
            // One cell more on both sides, for rounding; the triangle decides.
            (a.ceil() as i64 - 1).max(0) as usize..(b.floor() as i64 + 2).clamp(0, n as i64) as usize
        };
        for j in range(1, v) {
            for i in range(0, u) {
                let at = [low[0] + (i as f64 + 0.5) * size[0], low[1] + (j as f64 + 0.5) * size[1]];
                let slot = &mut found[(chart * v + j) * u + i];
                if let (None, Some(bary)) = (&slot, barycentric(uv, at)) {
                    *slot = Some(SurfacePoint { triangle: t as u32, bary });
                }
            }
        }
    }
    let total = found.len();
    let roots: Vec<SurfacePoint> = found.into_iter().flatten().collect();
    let outside = total - roots.len();
    (roots, outside)
}

/// Weights of the second and third corner at a point of texture space; `None` outside.
fn barycentric(uv: [[f64; 2]; 3], at: [f64; 2]) -> Option<[f32; 2]> {
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let area = cross(uv[0], uv[1], uv[2]);
    let w = [cross(uv[1], uv[2], at), cross(uv[2], uv[0], at), cross(uv[0], uv[1], at)].map(|x| x / area);
    if w.iter().any(|&x| x.is_nan() || x < -1e-12) {
        return None;
    }
    let w = w.map(|x| x.max(0.0));
    let sum = w[0] + w[1] + w[2];
    Some([(w[1] / sum) as f32, (w[2] / sum) as f32])
}

/// v rows of u roots on each chart, equally spaced by arc length on the rest skin: rows stand at (j + 1/2) / v of the
/// length of the column through the middle of the chart's box in texture space, roots at (i + 1/2) / u of the length of
/// their row. What a column or row has to cross outside the chart counts as no length. And how many roots find no place
/// because their row misses the chart. Chart by chart, rows of rising v, rising u within.
pub(crate) fn even_roots(skin: &Skin, u: usize, v: usize) -> (Vec<SurfacePoint>, usize) {
    let topology = skin.topology;
    let mut triangles: Vec<Vec<u32>> = vec![Vec::new(); topology.charts];
    for t in (0..skin.mesh.corner_uv.len()).filter(|&t| !topology.flat_uv[t]) {
        triangles[topology.chart[t] as usize].push(t as u32);
    }
    let mut rows: Vec<(usize, f64)> = Vec::with_capacity(topology.charts * v);
    for (chart, (low, high)) in uv_bounds(topology).into_iter().enumerate() {
        let column = cut(skin, &triangles[chart], 0, 0.5 * (low[0] + high[0]));
        // A column of no length, through flat triangles alone, says nothing: rows are equal in v then.
        let level = |j: usize| low[1] + (j as f64 + 0.5) / v as f64 * (high[1] - low[1]);
        if column.is_empty() {
            rows.extend((0..v).map(|j| (chart, level(j))));
        } else {
            rows.extend(centres(&column, v).map(|(p, f)| (chart, p.at[0] + (p.at[1] - p.at[0]) * f)));
        }
    }
    let found: Vec<Vec<SurfacePoint>> = rows
        .par_iter()
        .map(|&(chart, level)| {
            let row = cut(skin, &triangles[chart], 1, level);
            centres(&row, u).map(|(p, f)| p.point(f)).collect()
        })
        .collect();
    let roots = found.concat();
    let outside = topology.charts * u * v - roots.len();
    (roots, outside)
}

/// What a line of constant u or v cuts out of a triangle.
struct Piece {
    triangle: u32,
    /// Weights of the triangle's corners at both ends.
    end: [[f64; 3]; 2],
    /// The other texture coordinate there, ascending.
    at: [f64; 2],
    /// Length on the rest skin.
    length: f64,
}

impl Piece {
    /// The point a fraction `f` along.
    fn point(&self, f: f64) -> SurfacePoint {
        let [_, b, c]: [f64; 3] = std::array::from_fn(|i| self.end[0][i] + (self.end[1][i] - self.end[0][i]) * f);
        SurfacePoint { triangle: self.triangle, bary: [b as f32, c as f32] }
    }
}

/// The pieces of given triangles where texture coordinate `axis` has the given value, in the order of the other one.
/// Pieces without length are left out.
fn cut(skin: &Skin, triangles: &[u32], axis: usize, value: f64) -> Vec<Piece> {
    let mut out: Vec<Piece> = Vec::new();
    for &t in triangles {
        let uv = skin.mesh.corner_uv[t as usize].map(|c| c.map(f64::from));
        // A corner on the line counts as above it, for all its triangles: a line along an edge cuts one of the two.
        let above = uv.map(|c| c[axis] >= value);
        let mut ends = (0..3).map(|i| (i, (i + 1) % 3)).filter(|&(i, k)| above[i] != above[k]).map(|(i, k)| {
            let f = (value - uv[i][axis]) / (uv[k][axis] - uv[i][axis]);
            let mut weight = [0.0; 3];
            (weight[i], weight[k]) = (1.0 - f, f);
            (uv[i][1 - axis] + (uv[k][1 - axis] - uv[i][1 - axis]) * f, weight)
        });
        let (Some(a), Some(b)) = (ends.next(), ends.next()) else { continue };
        let (a, b) = if b.0 < a.0 { (b, a) } else { (a, b) };
        let corner = skin.mesh.corners(t);
        let length = (0..3).map(|i| corner[i] * (b.1[i] - a.1[i])).sum::<Vec3>().norm();
        if length > 0.0 && length.is_finite() {
            out.push(Piece { triangle: t, end: [a.1, b.1], at: [a.0, b.0], length });
        }
    }
    out.sort_by(|p, q| (p.at[0] + p.at[1]).total_cmp(&(q.at[0] + q.at[1])).then(p.triangle.cmp(&q.triangle)));
    out
}

/// The middles of `n` equal parts of the length of all pieces: piece and fraction along it. None without pieces.
fn centres(pieces: &[Piece], n: usize) -> impl Iterator<Item = (&Piece, f64)> {
    let total: f64 = pieces.iter().map(|p| p.length).sum();
    let (mut i, mut before) = (0, 0.0);
    (0..if pieces.is_empty() { 0 } else { n }).map(move |k| {
        let target = total * (k as f64 + 0.5) / n as f64;
        while i + 1 < pieces.len() && before + pieces[i].length < target {
            before += pieces[i].length;
            i += 1;
        }
        (&pieces[i], ((target - before) / pieces[i].length).clamp(0.0, 1.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_skin::TestSkin;
    use pelage_geom::{Mesh, Pose};

    #[test]
    fn grid_cells_are_found_where_their_centres_are() {
        let s = TestSkin::new(24, 12, 0.0);
        let (roots, outside) = grid_roots(&s.skin(), 9, 5);
        assert_eq!(roots.len() + outside, 2 * 9 * 5);
        // The charts fill their boxes but for the corners at the poles, where no cell centre comes.
        assert_eq!(outside, 0);
        for (k, r) in roots.iter().enumerate() {
            let (chart, j, i) = (k / 45, k / 9 % 5, k % 9);
            assert_eq!(s.topology.chart[r.triangle as usize] as usize, chart);
            let low = if s.topology.chart[0] as usize == chart { 0.0 } else { 0.625 };
            let uv = s.mesh.uv(r).map(f64::from);
            assert!((uv[0] - (low + 0.375 * (i as f64 + 0.5) / 9.0)).abs() < 1e-6, "{uv:?}");
            assert!((uv[1] - (j as f64 + 0.5) / 5.0).abs() < 1e-6, "{uv:?}");
        }
    }

    /// Mesh of n x n cells over the unit square of texture space; a cell may be left out.
    fn sheet(n: usize, at: impl Fn(f64, f64) -> Vec3, keep: impl Fn(usize, usize) -> bool) -> (Mesh, Topology, Pose) {
        let mut mesh = Mesh::default();
        let uv = |k: usize| [(k % (n + 1)) as f64 / n as f64, (k / (n + 1)) as f64 / n as f64];
        mesh.position = (0..(n + 1) * (n + 1)).map(|k| at(uv(k)[0], uv(k)[1]).into()).collect();
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)).filter(|&(i, j)| keep(i, j)) {
            let [a, b] = [j * (n + 1) + i, (j + 1) * (n + 1) + i];
            for t in [[a, a + 1, b + 1], [a, b + 1, b]] {
                mesh.triangle.push(t.map(|k| k as u32));
                mesh.corner_uv.push(t.map(|k| uv(k).map(|x| x as f32)));
                mesh.face.push((j * n + i) as u32);
            }
        }
        let topology = Topology::new(&mesh);
        let rest = Pose::new(&mesh, &topology, mesh.position.clone());
        (mesh, topology, rest)
    }

    fn even((mesh, topology, rest): &(Mesh, Topology, Pose), u: usize, v: usize) -> (Vec<Vec3>, usize) {
        let (roots, outside) = even_roots(&Skin { mesh, topology, rest }, u, v);
        (roots.iter().map(|p| mesh.point(p)).collect(), outside)
    }

    /// On a plane whose texture coordinates are stretched, arc length is x and y.
    #[test]
    fn even_grids_undo_the_stretch_of_texture_coordinates() {
        for mirrored in [1.0, -1.0] {
            let s = sheet(16, |u, v| Vec3::new(u * u, (v * v * v + v) * 0.5, 0.0) * mirrored, |_, _| true);
            let (at, outside) = even(&s, 7, 5);
            assert_eq!((at.len(), outside), (35, 0));
            for (k, p) in at.iter().enumerate() {
                let wanted = Vec3::new(((k % 7) as f64 + 0.5) / 7.0, ((k / 7) as f64 + 0.5) / 5.0, 0.0) * mirrored;
                assert!((p - wanted).norm() < 1e-6, "{p} {wanted}");
            }
        }
    }

    #[test]
    fn holes_have_no_length() {
        let flat = |u: f64, v: f64| Vec3::new(u, v, 0.0);
        // A hole beside the middle column: rows through it are shorter by its width.
        let (at, outside) = even(&sheet(16, flat, |i, j| !((2..5).contains(&i) && (4..12).contains(&j))), 8, 8);
        assert_eq!((at.len(), outside), (64, 0));
        for (k, p) in at.iter().enumerate() {
            let y = ((k / 8) as f64 + 0.5) / 8.0;
            let hole = if (0.25..0.75).contains(&y) { 3.0 / 16.0 } else { 0.0 };
            let along = ((k % 8) as f64 + 0.5) / 8.0 * (1.0 - hole);
            let x = along + if along < 0.125 { 0.0 } else { hole };
            assert!((p - Vec3::new(x, y, 0.0)).norm() < 1e-6, "{k}: {p}");
        }
        // A hole across the middle column: no row goes through it.
        let (at, outside) = even(&sheet(16, flat, |i, j| !((5..11).contains(&i) && (4..12).contains(&j))), 4, 6);
        assert_eq!((at.len(), outside), (24, 0));
        for (k, p) in at.iter().enumerate() {
            let along = ((k / 4) as f64 + 0.5) / 12.0;
            assert!((p.y - along - if along < 0.25 { 0.0 } else { 0.5 }).abs() < 1e-6, "{p}");
        }
    }

    #[test]
    fn flat_charts_have_no_rows() {
        let mut s = sheet(4, |u, v| Vec3::new(u, v, 0.0), |_, _| true);
        s.0.corner_uv.iter_mut().flatten().for_each(|c| c[1] = 0.5);
        s.1 = Topology::new(&s.0);
        let (at, outside) = even(&s, 3, 2);
        assert_eq!((at.len(), outside), (0, 6 * s.1.charts));
        s.0.corner_uv.clear();
        s.1 = Topology::new(&s.0);
        assert_eq!(even(&s, 3, 2).0.len(), 0);
        assert_eq!(even(&s, 0, 0).0.len(), 0);
        // A few flat triangles among others: the rest of their row counts.
        let mut s = sheet(8, |u, v| Vec3::new(u, v, 0.0), |_, _| true);
        for t in (0..128).step_by(9) {
            s.0.corner_uv[t] = [s.0.corner_uv[t][0]; 3];
        }
        s.1 = Topology::new(&s.0);
        let (at, outside) = even(&s, 5, 5);
        assert_eq!(at.len() + outside, 25 * s.1.charts);
        assert!(at.len() >= 25 && at.iter().all(|p| p.iter().all(|x| x.is_finite())));
    }

    /// Against lengths of curves sampled densely, on a bumpy skin.
    #[test]
    fn even_grids_are_even_along_the_curves_themselves() {
        let s = TestSkin::new(24, 12, 1.0);
        let (skin, (u, v)) = (s.skin(), (6, 3));
        let (roots, outside) = even_roots(&skin, u, v);
        assert_eq!((roots.len(), outside), (2 * u * v, 0));
        let bounds = uv_bounds(&s.topology);
        // Part of the length of the curve on which coordinate 1 - axis is constant, at given places along it.
        let parts = |chart: usize, axis: usize, level: f64, places: &[f64]| -> Vec<f64> {
            let (low, high) = (bounds[chart].0[axis], bounds[chart].1[axis]);
            let own: Vec<usize> =
                (0..s.mesh.triangle.len()).filter(|&t| s.topology.chart[t] as usize == chart).collect();
            let at = |x: f64| {
                let uv = if axis == 0 { [x, level] } else { [level, x] };
                own.iter().find_map(|&t| {
                    let bary = barycentric(s.mesh.corner_uv[t].map(|c| c.map(f64::from)), uv)?;
                    Some(s.mesh.point(&SurfacePoint { triangle: t as u32, bary }))
                })
            };
            let n = 4000;
            let x = |k: usize| low + (high - low) * (k as f64 + 0.5) / n as f64;
            let points: Vec<Option<Vec3>> = (0..n).map(|k| at(x(k))).collect();
            let mut length = vec![0.0];
            for w in points.windows(2) {
                let step = w[0].zip(w[1]).map_or(0.0, |(a, b)| (b - a).norm());
                length.push(length[length.len() - 1] + step);
            }
            let place = |p: &f64| length[(0..n).take_while(|&k| x(k) < *p).count().min(n - 1)] / length[n - 1];
            places.iter().map(place).collect()
        };
        let close = |found: Vec<f64>| {
            let n = found.len() as f64;
            assert!(found.iter().enumerate().all(|(i, f)| (f - (i as f64 + 0.5) / n).abs() < 1e-3), "{found:?}");
        };
        for chart in 0..2 {
            let own = &roots[chart * u * v..(chart + 1) * u * v];
            let uv: Vec<[f64; 2]> = own.iter().map(|p| s.mesh.uv(p).map(f64::from)).collect();
            assert!(own.iter().all(|p| s.topology.chart[p.triangle as usize] as usize == chart));
            for row in uv.chunks(u) {
                assert!(row.iter().all(|c| (c[1] - row[0][1]).abs() < 1e-6));
                close(parts(chart, 0, row[0][1], &row.iter().map(|c| c[0]).collect::<Vec<_>>()));
            }
            let middle = 0.5 * (bounds[chart].0[0] + bounds[chart].1[0]);
            close(parts(chart, 1, middle, &uv.chunks(u).map(|r| r[0][1]).collect::<Vec<_>>()));
        }
    }
}
