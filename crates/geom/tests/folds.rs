//! Inside and outside of meshes that run through themselves, against sums of solid angles.

use pelage_geom::rng::uniform;
use pelage_geom::{Bvh, Mesh, Topology, Vec3, shapes};

/// Meshes side by side as one, each moved; those marked are turned inside out.
fn together(parts: &[(Mesh, Vec3, bool)]) -> Mesh {
    let mut all = Mesh::default();
    for (mesh, by, turned) in parts {
        let first = all.position.len() as u32;
        all.position.extend(mesh.position.iter().map(|p| <[f64; 3]>::from(Vec3::from(*p) + by)));
        let order = if *turned { [0, 2, 1] } else { [0, 1, 2] };
        all.triangle.extend(mesh.triangle.iter().map(|t| order.map(|i| first + t[i])));
    }
    all
}

fn hierarchy(mesh: &Mesh) -> Bvh {
    Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(mesh))
}

/// Sum of the solid angles of all triangles (Van Oosterom, Strackee 1983) over 4 pi: no hierarchy, no normals.
fn winding(mesh: &Mesh, p: Vec3) -> i32 {
    let angle = |t: u32| {
        let [a, b, c] = mesh.corners(t).map(|c| c - p);
        let (x, y, z) = (a.norm(), b.norm(), c.norm());
        libm::atan2(a.dot(&b.cross(&c)), x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y)
    };
    let sum: f64 = (0..mesh.triangle.len() as u32).map(angle).sum();
    (sum / (2.0 * std::f64::consts::PI)).round() as i32
}

fn any_point(k: u64, size: f64) -> Vec3 {
    Vec3::from([0, 1, 2].map(|x| (uniform(3, k, 0, x) - 0.5) * size))
}

/// A sphere whose top is pushed down through its bottom: sheets cross, and what is beyond is inside out.
fn pushed_through() -> Mesh {
    let mut mesh = shapes::cube_sphere(14, 4.0);
    for p in &mut mesh.position {
        let across = p[0] * p[0] + p[2] * p[2];
        if p[1] > 0.0 && across < 4.0 {
            p[1] -= 10.0 * (1.0 - across / 4.0);
        }
    }
    mesh
}

fn folded() -> Vec<(&'static str, Mesh)> {
    let ball = || shapes::cube_sphere(10, 3.0);
    vec![
        ("two balls", together(&[(ball(), Vec3::zeros(), false), (ball(), Vec3::new(3.1, 0.7, 0.4), false)])),
        (
            "ball in a ring",
            together(&[
                (shapes::torus(24, 12, 4.0, 1.5), Vec3::zeros(), false),
                (ball(), Vec3::new(4.2, 0.3, 0.1), false),
            ]),
        ),
        (
            "ball in a ball",
            together(&[(ball(), Vec3::zeros(), false), (shapes::cube_sphere(6, 1.2), Vec3::new(0.3, 0.2, 0.1), false)]),
        ),
        (
            "pocket beside a ball",
            together(&[(ball(), Vec3::zeros(), false), (shapes::cube_sphere(8, 2.0), Vec3::new(3.3, 0.6, 0.2), true)]),
        ),
        ("pushed through", pushed_through()),
    ]
}

#[test]
fn the_sign_is_that_of_the_sum_of_solid_angles() {
    for (name, mesh) in folded() {
        let bvh = hierarchy(&mesh);
        assert!(bvh.is_folded(), "{name}");
        let (mut inside, mut told_apart, mut blocked) = (0, 0, 0);
        for k in 0..3000 {
            let p = any_point(k, 12.0);
            let (plain, c) = (bvh.closest(p, f64::INFINITY).unwrap(), bvh.closest_outside(p, f64::INFINITY).unwrap());
            let within = winding(&mesh, p) != 0;
            assert_eq!(c.signed_distance < 0.0, within, "{name}: {p}");
            inside += usize::from(within);
            told_apart += usize::from((plain.signed_distance < 0.0) != within || c.point != plain.point);
            // The distance is that to the place.
            assert!(((c.position - p).norm() - c.signed_distance.abs()).abs() < 1e-9);
            // It has the outside in front; of triangles that are cut, nearly always.
            blocked += usize::from(winding(&mesh, c.position + c.normal * 1e-6) != 0);
            if within {
                assert!(c.signed_distance.abs() >= plain.signed_distance.abs() - 1e-9);
            } else {
                assert_eq!(c.position, plain.position);
            }
        }
        println!("{name}: {inside} inside, {told_apart} where the closest skin says other, {blocked} blocked");
        assert!(blocked <= inside / 50, "{name}: {blocked} of {inside}");
        assert!(inside > 50 && told_apart > 10, "{name}: {inside} {told_apart}");
    }
}

#[test]
fn the_way_out_is_hardly_longer_than_the_nearest() {
    // Two balls: the surface of what they fill together, sampled.
    let balls = [(Vec3::zeros(), 3.0), (Vec3::new(3.1, 0.7, 0.4), 3.0)];
    let mesh = together(&balls.map(|(c, r)| (shapes::cube_sphere(20, r), c, false)));
    let bvh = hierarchy(&mesh);
    let mut sample = Vec::new();
    for (i, (c, r)) in balls.iter().enumerate() {
        let other = balls[1 - i];
        let on = (0..40_000).map(|k| c + any_point(k, 2.0).normalize() * *r);
        sample.extend(on.filter(|p| (p - other.0).norm() > other.1));
    }
    for k in 0..400 {
        let p = any_point(k, 8.0);
        let c = bvh.closest_outside(p, f64::INFINITY).unwrap();
        let nearest = sample.iter().map(|s| (s - p).norm()).fold(f64::INFINITY, f64::min);
        let apart = (c.signed_distance.abs() - nearest).abs();
        assert!(apart < 0.1 + 0.05 * nearest, "{p}: {} and {nearest}", c.signed_distance);
    }
}

#[test]
fn skin_that_is_covered_or_inside_out_is_told() {
    let ball = || shapes::cube_sphere(10, 3.0);
    let by = Vec3::new(3.1, 0.0, 0.0);
    let two = hierarchy(&together(&[(ball(), Vec3::zeros(), false), (ball(), by, false)]));
    assert_eq!(two.winding_in_front(Vec3::new(3.0, 0.01, 0.02)), 1);
    assert_eq!(two.winding_in_front(Vec3::new(-3.0, 0.01, 0.02)), 0);
    let pocket = hierarchy(&together(&[(ball(), Vec3::zeros(), false), (shapes::cube_sphere(6, 2.0), by, true)]));
    assert_eq!(pocket.winding_in_front(Vec3::new(5.1, 0.01, 0.02)), -1);
}

#[test]
fn plain_meshes_are_not_folded() {
    let balls = together(&[
        (shapes::cube_sphere(8, 2.0), Vec3::zeros(), false),
        (shapes::cube_sphere(8, 2.0), Vec3::new(4.5, 0.0, 0.0), false),
    ]);
    let mut inside_out = shapes::cube_sphere(8, 2.0);
    inside_out.triangle.iter_mut().for_each(|t| t.swap(1, 2));
    // Sheets have no inside; a mesh that is all inside out is the inner wall of a room.
    for mesh in [shapes::torus(24, 12, 6.0, 2.0), shapes::bust().mesh, shapes::plane(4, 4, 3.0), balls, inside_out] {
        assert!(!hierarchy(&mesh).is_folded());
    }
    assert!(!Bvh::default().is_folded());
}
