//! Small meshes by formula.

use pelage_geom::Mesh;

/// A mesh from vertices with texture coordinates; triangle corners take their vertex's.
pub fn mesh(position: Vec<[f64; 3]>, uv: &[[f32; 2]], triangle: Vec<[u32; 3]>) -> Mesh {
    let corner_uv =
        if uv.is_empty() { Vec::new() } else { triangle.iter().map(|t| t.map(|v: u32| uv[v as usize])).collect() };
    let face = (0..triangle.len() as u32).collect();
    Mesh { position, triangle, corner_uv, face }
}

/// `m` x `n` quads over the parameter square, each cut in two, `at(u, v)` giving positions. Every grid point is a vertex
/// of its own, so closed surfaces are split at their seams.
pub fn grid(m: usize, n: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> Mesh {
    let (mut position, mut uv, mut triangle) = (Vec::new(), Vec::new(), Vec::new());
    for j in 0..=n {
        for i in 0..=m {
            let (u, v) = (i as f64 / m as f64, j as f64 / n as f64);
            position.push(at(u, v));
            uv.push([u as f32, v as f32]);
        }
    }
    let k = |i: usize, j: usize| (j * (m + 1) + i) as u32;
    for j in 0..n {
        for i in 0..m {
            triangle.push([k(i, j), k(i + 1, j), k(i + 1, j + 1)]);
            triangle.push([k(i, j), k(i + 1, j + 1), k(i, j + 1)]);
        }
    }
    mesh(position, &uv, triangle)
}

/// A flat unit square in z = 0, facing +z.
pub fn square(n: usize) -> Mesh {
    grid(n, n, |u, v| [u, v, 0.0])
}

/// Cosine and sine of `turn` turns, exactly periodic.
pub fn circle(turn: f64) -> (f64, f64) {
    let a = std::f64::consts::TAU * (turn - turn.floor());
    (libm::cos(a), libm::sin(a))
}

/// An open tube of radius 1 around z, from z = 0 to 1, facing out, its seam at u = 0.
pub fn tube(m: usize, n: usize) -> Mesh {
    grid(m, n, |u, v| [circle(u).0, circle(u).1, v])
}

/// The part of the unit sphere from v = 0 (south pole) up to latitude fraction `top`; 1 closes it with collapsed
/// triangles at the poles.
pub fn sphere(m: usize, n: usize, top: f64) -> Mesh {
    grid(m, n, |u, v| {
        let v = v * top;
        let (x, y) = circle(u);
        // Exact poles, so that they weld.
        let (r, z) = if v <= 0.0 {
            (0.0, -1.0)
        } else if v >= 1.0 {
            (0.0, 1.0)
        } else {
            (libm::sin(std::f64::consts::PI * v), -libm::cos(std::f64::consts::PI * v))
        };
        [r * x, r * y, z]
    })
}

/// The cube [-1, 1]^3, faces of `n` x `n` quads, split at its edges, without texture coordinates.
pub fn cube(n: usize) -> Mesh {
    let mut all = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let face = grid(n, n, |u, v| {
                // Rounded to be the same from both sides of an edge.
                let even = |x: f64| ((2.0 * x - 1.0) * n as f64).round() / n as f64;
                let (a, b) = (even(u), side * even(v));
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, a, b);
                p
            });
            let base = all.position.len() as u32;
            all.position.extend(face.position);
            all.triangle.extend(face.triangle.iter().map(|t| t.map(|v| v + base)));
        }
    }
    all.face = (0..all.triangle.len() as u32).collect();
    all
}
