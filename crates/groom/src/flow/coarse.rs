//! Panels for a skin: a coarse mesh just under it.

use super::Panel;
use crate::control::vec3;
use pelage_geom::{Mesh, Vec3};
use std::collections::BTreeMap;

/// How far panels lie under the skin, in edges of the cells: flatter than this a skin is within a cell. At 0 half of a coarse
/// mesh lies above the skin, and roots in the flow of the inside; at 1 thin parts (ears) vanish.
const UNDER: f64 = 0.2;

/// Searches for the size of cells.
const HALVINGS: usize = 24;

/// A mesh of at most so many triangles a little under another, by clustering its vertices in cubic cells (Rossignac, Borrel 1993,
/// "Multi-resolution 3D approximations for rendering complex scenes"): vertices of a cell become their mean. A mesh with no more
/// triangles keeps them all. `normal`: outward unit normals of the vertices.
pub fn coarse(mesh: &Mesh, normal: &[[f32; 3]], at_most: usize) -> Mesh {
    let (low, high) = mesh.bounds();
    let largest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    if mesh.triangle.len() <= at_most || !(largest > 0.0 && largest.is_finite()) {
        return mesh.clone();
    }
    // Fewer triangles with larger cells, but for exceptions: the smallest cells that were seen to do.
    let (mut fine, mut rough) = (0.0, largest);
    for _ in 0..HALVINGS {
        let cell = 0.5 * (fine + rough);
        if clustered(mesh, normal, low, cell).triangle.len() > at_most { fine = cell } else { rough = cell }
    }
    clustered(mesh, normal, low, rough)
}

fn clustered(mesh: &Mesh, normal: &[[f32; 3]], low: [f64; 3], cell: f64) -> Mesh {
    let mut number: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let mut sum: Vec<(Vec3, Vec3, f64)> = Vec::new();
    let cluster: Vec<u32> = mesh
        .position
        .iter()
        .zip(normal)
        .map(|(p, n)| {
            let key = std::array::from_fn(|i| ((p[i] - low[i]) / cell).floor() as i64);
            let k = *number.entry(key).or_insert_with(|| {
                sum.push((Vec3::zeros(), Vec3::zeros(), 0.0));
                sum.len() as u32 - 1
            });
            let (at, up, count) = &mut sum[k as usize];
            *at += Vec3::from(*p);
            *up += vec3(*n);
            *count += 1.0;
            k
        })
        .collect();
    let under = |(at, up, count): &(Vec3, Vec3, f64)| {
        (at / *count - up.try_normalize(1e-6).unwrap_or_default() * (UNDER * cell)).into()
    };
    // The same three from both sides are a sheet without an inside: no wall.
    let mut sides: BTreeMap<[u32; 3], i32> = BTreeMap::new();
    for t in &mesh.triangle {
        let [a, b, c] = t.map(|v| cluster[v as usize]);
        // The same way round, from the least on.
        let first = if a < b && a < c {
            [a, b, c]
        } else if b < c {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let [a, b, c] = first;
        if a != b && b != c && a != c {
            if b < c { *sides.entry([a, b, c]).or_default() += 1 } else { *sides.entry([a, c, b]).or_default() -= 1 }
        }
    }
    let turned = |(&[a, b, c], n): (&[u32; 3], &i32)| match n.signum() {
        0 => None,
        1 => Some([a, b, c]),
        _ => Some([a, c, b]),
    };
    let mut triangle: Vec<[u32; 3]> = sides.iter().filter_map(turned).collect();
    let position: Vec<[f64; 3]> = sum.iter().map(under).collect();
    triangle.retain(|t| Panel::new(pelage_geom::mesh::corners(&position, *t)).is_some());
    Mesh { position, triangle, ..Mesh::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::shapes;

    #[test]
    fn a_coarse_ball_lies_under_the_ball_and_has_few_panels() {
        let ball = shapes::cube_sphere(24, 10.0);
        let normal: Vec<[f32; 3]> = ball.position.iter().map(|p| p.map(|x| (0.1 * x) as f32)).collect();
        let few = coarse(&ball, &normal, 500);
        assert!((250..=500).contains(&few.triangle.len()), "{}", few.triangle.len());
        for p in &few.position {
            let r = Vec3::from(*p).norm();
            assert!((8.5..10.0).contains(&r), "{r}");
        }
        // Closed: every edge twice.
        let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for t in &few.triangle {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|n| *n == 0));
        assert_eq!(coarse(&ball, &normal, ball.triangle.len()), ball);
    }
}
