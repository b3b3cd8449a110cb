//! Times of topology, pose and closest-point search on a bumpy sphere of a million triangles, printed as
//! milliseconds. Building uses all threads, searches one.
#![allow(clippy::disallowed_methods)] // A bench reads the clock.

use pelage_geom::{Bvh, Mesh, Pose, Topology, Vec3, rng};
use std::time::Instant;

fn timed<T>(what: &str, f: impl Fn() -> T) -> T {
    let mut best = f64::INFINITY;
    let mut result = None;
    for _ in 0..3 {
        let start = Instant::now();
        result = Some(f());
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{what:<44} {:>8.1} ms", best * 1e3);
    result.expect("ran three times")
}

/// 1000 x 500 quads around a sphere, split at the back seam.
fn sphere() -> Mesh {
    let (m, n) = (1000usize, 500usize);
    let mut mesh = Mesh::default();
    let at = |i: usize, j: usize| {
        let (u, v) = ((i % m) as f64 / m as f64 * std::f64::consts::TAU, j as f64 / n as f64 * std::f64::consts::PI);
        let r = 10.0 + 0.3 * libm::sin(7.0 * u) * libm::sin(9.0 * v);
        [r * libm::sin(v) * libm::cos(u), r * libm::sin(v) * libm::sin(u), -r * libm::cos(v)]
    };
    for j in 0..=n {
        mesh.position.extend((0..=m).map(|i| at(i, j)));
    }
    let k = |i: usize, j: usize| (j * (m + 1) + i) as u32;
    let uv = |i: usize, j: usize| [i as f32 / m as f32, j as f32 / n as f32];
    for j in 0..n {
        for i in 0..m {
            for c in [[(i, j), (i + 1, j), (i + 1, j + 1)], [(i, j), (i + 1, j + 1), (i, j + 1)]] {
                mesh.triangle.push(c.map(|(i, j)| k(i, j)));
                mesh.corner_uv.push(c.map(|(i, j)| uv(i, j)));
            }
        }
    }
    mesh
}

fn main() {
    let mesh = sphere();
    println!(
        "{} triangles, {} vertices, {} threads",
        mesh.triangle.len(),
        mesh.position.len(),
        rayon::current_num_threads()
    );
    let topology = timed("topology", || Topology::new(&mesh));
    timed("pose", || Pose::new(&mesh, &topology, mesh.position.clone()));
    let bvh = timed("bvh build", || Bvh::build(&mesh.position, &mesh.triangle, &topology));
    let random = |k: u64| Vec3::new(rng::uniform(1, k, 1, 0), rng::uniform(1, k, 1, 1), rng::uniform(1, k, 1, 2));
    // On the surface, moved by up to 1 % of the radius; and anywhere in the box of twice its size.
    let near: Vec<Vec3> = (0..200_000u64)
        .map(|k| {
            let triangle = (rng::uniform(2, k, 1, 0) * mesh.triangle.len() as f64) as u32;
            mesh.corners(triangle)[0] + (random(k) * 2.0 - Vec3::repeat(1.0)) * 0.1
        })
        .collect();
    let far: Vec<Vec3> = (0..2_000).map(|k| random(k).map(|x| 40.0 * x - 20.0)).collect();
    let search = |queries: &[Vec3]| queries.iter().filter_map(|&q| bvh.closest(q, f64::INFINITY)).count();
    timed("200,000 closest points, near, shuffled", || search(&near));
    let mut ordered = near.clone();
    ordered.sort_by_key(|q| [q.x, q.y, q.z].map(|x| (4.0 * x) as i64));
    timed("200,000 closest points, near, place by place", || search(&ordered));
    timed("2,000 closest points, far", || search(&far));
    let cast = || near.iter().filter(|&&q| bvh.ray(Vec3::zeros(), q, f64::INFINITY).is_some()).count();
    let hits = timed("200,000 rays", cast);
    println!("{hits} rays hit");
}
