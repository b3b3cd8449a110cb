//! Polygons cut into triangles.

use pelage_geom::Vec3;

/// Concave polygons with more corners than this are cut as a fan: the careful way takes time with the cube of the
/// corners. Lower and real n-gon caps of cylinders are cut wrongly; higher and a hostile file takes minutes.
const CAREFUL_CORNERS: usize = 256;

/// Triangles of a polygon as corner numbers, three or more corners, in the polygon's sense of rotation.
///
/// Quads are split along the shorter diagonal unless only the other one gives two triangles that face the way of the
/// polygon. Larger polygons become a fan from corner 0 if all its triangles face that way, else ears are clipped.
/// False if the polygon is concave and too large for that, and became a fan all the same.
pub(super) fn triangulate(corner: &[Vec3], out: &mut Vec<[usize; 3]>) -> bool {
    out.clear();
    let n = corner.len();
    if n == 3 {
        out.push([0, 1, 2]);
        return true;
    }
    let normal = newell(corner);
    if n == 4 {
        let cuts = [[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]];
        let faces = |cut: &[[usize; 3]; 2]| cut.iter().all(|t| area(corner, *t).dot(&normal) > 0.0);
        let shorter = usize::from((corner[1] - corner[3]).norm() < (corner[0] - corner[2]).norm());
        let pick = if !faces(&cuts[shorter]) && faces(&cuts[1 - shorter]) { 1 - shorter } else { shorter };
        out.extend(cuts[pick]);
        return true;
    }
    out.extend((1..n - 1).map(|i| [0, i, i + 1]));
    if out.iter().all(|t| area(corner, *t).dot(&normal) > 0.0) || normal == Vec3::zeros() {
        return true;
    }
    if n > CAREFUL_CORNERS {
        return false;
    }
    clip_ears(corner, normal, out);
    true
}

/// Normal of a polygon that need not be flat, twice its area long (Newell's sum).
fn newell(corner: &[Vec3]) -> Vec3 {
    let o = corner[0];
    (1..corner.len() - 1).map(|i| (corner[i] - o).cross(&(corner[i + 1] - o))).sum()
}

fn area(corner: &[Vec3], t: [usize; 3]) -> Vec3 {
    (corner[t[1]] - corner[t[0]]).cross(&(corner[t[2]] - corner[t[0]]))
}

/// Cuts off, again and again, the corner that faces the right way, contains no other corner, and has the shortest
/// cut. Where the polygon crosses itself and no corner qualifies, the first that is left is cut.
fn clip_ears(corner: &[Vec3], normal: Vec3, out: &mut Vec<[usize; 3]>) {
    out.clear();
    let mut ring: Vec<usize> = (0..corner.len()).collect();
    while ring.len() > 3 {
        let m = ring.len();
        let ear = |k: usize| [ring[(k + m - 1) % m], ring[k], ring[(k + 1) % m]];
        let fits = |t: &[usize; 3]| {
            area(corner, *t).dot(&normal) > 0.0
                && ring.iter().all(|&p| t.contains(&p) || !inside(corner, *t, corner[p], normal))
        };
        let cut = |t: [usize; 3]| (corner[t[0]] - corner[t[2]]).norm_squared();
        let best = (0..m).filter(|&k| fits(&ear(k))).min_by(|&a, &b| cut(ear(a)).total_cmp(&cut(ear(b))));
        let k = best.unwrap_or(0);
        out.push(ear(k));
        ring.remove(k);
    }
    out.push([ring[0], ring[1], ring[2]]);
}

/// True if `p`, seen along `normal`, lies in the triangle or on its border (but not on a corner: polygons may touch
/// themselves there).
fn inside(corner: &[Vec3], t: [usize; 3], p: Vec3, normal: Vec3) -> bool {
    let side = |a: Vec3, b: Vec3| (b - a).cross(&(p - a)).dot(&normal);
    let [a, b, c] = t.map(|i| corner[i]);
    p != a && p != b && p != c && side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(points: &[[f64; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    /// All triangles counter-clockwise and of the polygon's total area: an exact cover if none overlap.
    fn covers(points: &[[f64; 2]]) {
        let corner = flat(points);
        let mut out = Vec::new();
        assert!(triangulate(&corner, &mut out));
        assert_eq!(out.len(), points.len() - 2);
        let areas: Vec<f64> = out.iter().map(|t| 0.5 * area(&corner, *t).z).collect();
        assert!(areas.iter().all(|a| *a >= 0.0), "{areas:?}");
        let whole = 0.5 * newell(&corner).z;
        assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-12 * whole, "{areas:?} {whole}");
    }

    #[test]
    fn a_quad_takes_its_shorter_diagonal() {
        let mut out = Vec::new();
        triangulate(&flat(&[[0.0, 0.0], [3.0, 0.0], [4.0, 1.0], [1.0, 1.0]]), &mut out);
        assert_eq!(out, [[1, 2, 3], [1, 3, 0]]);
        triangulate(&flat(&[[1.0, 0.0], [4.0, 0.0], [3.0, 1.0], [0.0, 1.0]]), &mut out);
        assert_eq!(out, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn an_arrow_head_is_not_folded_over() {
        // The notch points inwards; the diagonal between its neighbours is shorter and lies outside.
        for k in 0..4 {
            let mut p = [[0.0, 0.0], [-1.0, 4.0], [0.0, 3.5], [1.0, 4.0]];
            p.reverse();
            p.rotate_left(k);
            covers(&p);
        }
    }

    #[test]
    fn large_polygons_convex_and_not() {
        let hexagon: Vec<[f64; 2]> = (0..6).map(|i| f64::from(i) * 1.047).map(|a| [a.cos(), a.sin()]).collect();
        covers(&hexagon);
        covers(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        let star: Vec<[f64; 2]> = (0..24)
            .map(|i| (f64::from(i) * 0.2618, if i % 2 == 0 { 1.0 } else { 0.3 }))
            .map(|(a, r)| [r * a.cos(), r * a.sin()])
            .collect();
        covers(&star);
        let comb: Vec<[f64; 2]> = (0..20)
            .map(|i| [f64::from(i), if i % 2 == 0 { 0.5 } else { 5.0 }])
            .chain([[19.0, 6.0], [0.0, 6.0]])
            .collect();
        covers(&comb);
    }

    #[test]
    fn degenerate_polygons_still_give_their_triangles() {
        let mut out = Vec::new();
        assert!(triangulate(&flat(&[[0.0, 0.0]; 7]), &mut out));
        assert_eq!(out.len(), 5);
        assert!(triangulate(&flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [1.5, 0.0]]), &mut out));
        assert_eq!(out.len(), 3);
        assert!(triangulate(&flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [1.0, 3.0]]), &mut out));
        assert_eq!(out.len(), 3);
    }
}
