//! Test bodies with exact closed forms: a plane, two spheres, a torus.

use crate::{Mesh, NONE, Vec3};

/// A grid of `nx` by `ny` quads, cut along the rising diagonal; vertex (i, j) at `at(i, j)` with uv `uv(i, j)`. Counter-
/// clockwise with i to the right and j up. Appends to `mesh`.
fn grid(
    mesh: &mut Mesh,
    [nx, ny]: [usize; 2],
    at: impl Fn(usize, usize) -> Vec3,
    uv: impl Fn(usize, usize) -> [f64; 2],
) {
    let first = mesh.position.len() as u32;
    let mut flat = Vec::with_capacity((nx + 1) * (ny + 1));
    for j in 0..=ny {
        for i in 0..=nx {
            mesh.position.push(at(i, j).into());
            flat.push(uv(i, j).map(|x| x as f32));
        }
    }
    let mut face = mesh.face.last().map_or(0, |f| f + 1);
    for j in 0..ny {
        for i in 0..nx {
            let a = j * (nx + 1) + i;
            let (b, c, d) = (a + 1, a + nx + 2, a + nx + 1);
            for t in [[a, b, c], [a, c, d]] {
                mesh.triangle.push(t.map(|v| first + v as u32));
                mesh.corner_uv.push(t.map(|v| flat[v]));
                mesh.face.push(face);
            }
            face += 1;
        }
    }
}

/// A square of side `size` in the plane y = 0 about the origin, normal +y: u runs along +x and v along -z over 0..1 in one
/// chart; `nx` by `ny` quads.
pub fn plane(nx: usize, ny: usize, size: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let part = |i: usize, n: usize| i as f64 / n as f64;
    let at = |i, j| Vec3::new((part(i, nx) - 0.5) * size, 0.0, (0.5 - part(j, ny)) * size);
    grid(&mut mesh, [nx, ny], at, |i, j| [part(i, nx), part(j, ny)]);
    mesh
}

/// A sphere of latitudes and longitudes about the origin: `rings` rows of quads from the south pole (v = 0) to the north
/// pole (v = 1, +y), `segments` of them around. One chart with its seam at the back (-z), where vertices are split at
/// exactly equal positions, as they are at the poles (one triangle a segment there).
pub fn sphere(rings: usize, segments: usize, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |i: usize, j: usize| {
        if j == 0 || j == rings {
            return Vec3::new(0.0, if j == 0 { -radius } else { radius }, 0.0);
        }
        let (sa, ca) = libm::sincos(std::f64::consts::TAU * ((i % segments) as f64 / segments as f64 - 0.5));
        let (se, ce) = libm::sincos(std::f64::consts::PI * (j as f64 / rings as f64 - 0.5));
        Vec3::new(radius * sa * ce, radius * se, radius * ca * ce)
    };
    let uv = |i: usize, j: usize| [i as f64 / segments as f64, j as f64 / rings as f64];
    grid(&mut mesh, [segments, rings], at, uv);
    // At a pole half of each quad has no area: drop it and put the pole's corner over the middle of its edge.
    let columns = segments as u32 + 1;
    let row = |v: u32| (v / columns) as usize;
    let keep: Vec<bool> = mesh
        .triangle
        .iter()
        .map(|t| t.iter().filter(|&&v| row(v) == 0).count() < 2 && t.iter().filter(|&&v| row(v) == rings).count() < 2)
        .collect();
    for (t, uv) in mesh.triangle.iter().zip(&mut mesh.corner_uv) {
        let column = t.iter().map(|v| v % columns).min().unwrap_or(0);
        for c in (0..3).filter(|&c| row(t[c]) == 0 || row(t[c]) == rings) {
            uv[c][0] = ((f64::from(column) + 0.5) / segments as f64) as f32;
        }
    }
    let mut thin = Mesh::default();
    let mut number = vec![NONE; mesh.position.len()];
    for t in (0..keep.len()).filter(|&t| keep[t]) {
        thin.triangle.push(mesh.triangle[t].map(|v| {
            if number[v as usize] == NONE {
                number[v as usize] = thin.position.len() as u32;
                thin.position.push(mesh.position[v as usize]);
            }
            number[v as usize]
        }));
        thin.corner_uv.push(mesh.corner_uv[t]);
        thin.face.push(mesh.face[t]);
    }
    thin
}

/// A sphere from a cube: six charts of `n` by `n` quads of nearly equal angles, packed 3 by 2 into the unit square with
/// gaps. Vertices are split at chart borders: other indices, exactly equal positions.
pub fn cube_sphere(n: usize, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    // (right, up, outward) of each chart.
    let axes: [[[i64; 3]; 3]; 6] = [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    ];
    let side = |k: i64| {
        let n = n as i64;
        if k.abs() == n { k.signum() as f64 } else { libm::tan(std::f64::consts::FRAC_PI_4 * k as f64 / n as f64) }
    };
    const GAP: f64 = 0.03;
    let wide = (1.0 - 4.0 * GAP) / 3.0;
    for (f, [right, up, out]) in axes.iter().enumerate() {
        // From integer points of the cube's surface, so that shared ones agree to the last bit.
        let at = |i: usize, j: usize| {
            let (a, b) = (2 * i as i64 - n as i64, 2 * j as i64 - n as i64);
            let p = Vec3::from_fn(|c, _| side(a * right[c] + b * up[c] + n as i64 * out[c]));
            p * (radius / p.norm())
        };
        let corner = [GAP + (wide + GAP) * (f % 3) as f64, GAP + (wide + GAP) * (f / 3) as f64];
        let uv = |i: usize, j: usize| [corner[0] + wide * i as f64 / n as f64, corner[1] + wide * j as f64 / n as f64];
        grid(&mut mesh, [n, n], at, uv);
    }
    mesh
}

/// A torus around the y axis: `around` quads about the axis (u), `across` about the tube (v), one chart whose seams run
/// along the inner equator and at the back.
pub fn torus(around: usize, across: usize, major: f64, minor: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |i: usize, j: usize| {
        let (sa, ca) = libm::sincos(std::f64::consts::TAU * ((i % around) as f64 / around as f64 - 0.5));
        let (sb, cb) = libm::sincos(std::f64::consts::TAU * ((j % across) as f64 / across as f64 - 0.5));
        let r = major + minor * cb;
        Vec3::new(r * sa, minor * sb, r * ca)
    };
    grid(&mut mesh, [around, across], at, |i, j| [i as f64 / around as f64, j as f64 / across as f64]);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::check::{Facts, facts};

    #[test]
    fn closed_bodies_are_closed_outward_and_of_the_right_size() {
        let pi = std::f64::consts::PI;
        let ball = 4.0 / 3.0 * pi;
        for (mesh, volume, charts, euler) in [
            (sphere(48, 96, 1.0), ball, 1, 2),
            (cube_sphere(32, 1.0), ball, 6, 2),
            (torus(96, 48, 2.0, 0.5), 2.0 * pi * pi * 2.0 * 0.25, 1, 0),
        ] {
            let Facts { open_edges, bad_edges, flipped_uv, charts: found, euler: e, volume: v, .. } = facts(&mesh);
            assert_eq!((open_edges, bad_edges, flipped_uv, found, e), (0, 0, 0, charts, euler));
            assert!((v / volume - 1.0).abs() < 0.01, "{v} {volume}");
            assert!(mesh.corner_uv.iter().flatten().flatten().all(|x| (0.0..=1.0).contains(x)));
        }
    }

    #[test]
    fn the_plane_is_square_and_faces_up() {
        let mesh = plane(4, 3, 2.0);
        let f = facts(&mesh);
        assert_eq!((f.charts, f.open_edges, f.bad_edges, f.flipped_uv), (1, 14, 0, 0));
        let area: f64 = (0..mesh.triangle.len()).map(|t| mesh.area(t as u32)).sum();
        assert!((area - 4.0).abs() < 1e-12);
        let [a, b, c] = mesh.corners(0);
        assert!((b - a).cross(&(c - a)).y > 0.0);
        assert_eq!(mesh.face.last(), Some(&11));
    }
}
