use super::testing::*;
use super::*;
use pelage_geom::Topology;
use pelage_geom::shapes::cube_sphere;

const SECONDS: f64 = 1.0 / 24.0;

/// Turns about y and moves along x over a span.
fn moving(alpha: f64) -> Rigid {
    let q = UnitQuaternion::from_scaled_axis(Vec3::y() * (0.8 * alpha)).coords;
    Rigid { rotation: [q.x, q.y, q.z, q.w], translation: [0.3 * alpha, 0.1, 0.0] }
}

fn still(_: f64) -> Rigid {
    Rigid { translation: [0.0, -0.2, 0.0], ..Rigid::default() }
}

fn ball() -> (Field, Bvh) {
    let mesh = cube_sphere(32, 0.1);
    let topology = Topology::new(&mesh);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let field = Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, &FieldSettings::default(), None, None);
    (field, bvh)
}

#[test]
fn rigid_parts_ride_their_motion() {
    let (field, bvh) = ball();
    let exact = Some(Exact { bvh: &bvh, triangle: &[], velocity: None });
    let ellipsoid = Ellipsoid { placement: Rigid::default(), semi_axes: [0.05, 0.1, 0.05] };
    let parts = vec![
        Part { motion: &moving, shape: Shape::Field(&field), exact },
        Part { motion: &still, shape: Shape::Ellipsoid(&ellipsoid), exact: None },
    ];
    let body = Body { parts, seconds: SECONDS };
    for i in 0..3000 {
        let alpha = [0.0, 0.3, 1.0][i as usize % 3];
        let p = random_in(i, [-0.3; 3], [0.6; 3]);
        let hit = body.sample(p, alpha);
        let centre = Vec3::from(moving(alpha).translation);
        let d = (p - centre).norm() - 0.1;
        let e = ellipsoid.sample(p - Vec3::new(0.0, -0.2, 0.0)).distance;
        let near = if (-0.005..0.012).contains(&d) { 3e-4 } else { 0.03 };
        assert!((hit.distance - d.min(e)).abs() < near, "{p} {} {d} {e}", hit.distance);
        assert!(body.distance_bound(p, alpha) <= d.min(e).max(0.0) + 1e-9);
        assert!((hit.normal.norm() - 1.0).abs() < 1e-12);
        if d < e - 0.02 && d > -0.05 {
            let foot = p - hit.normal * hit.distance - centre;
            let want = (Vec3::y() * 0.8).cross(&foot) / SECONDS + Vec3::x() * (0.3 / SECONDS);
            assert!((hit.velocity - want).norm() < 2e-6 * want.norm(), "{} {want}", hit.velocity);
        } else if e < d - 0.02 {
            assert_eq!(hit.velocity, Vec3::zeros());
        }
    }
}

#[test]
fn exact_points_are_those_of_the_mesh_at_the_end() {
    let (field, bvh) = ball();
    let exact = Some(Exact { bvh: &bvh, triangle: &[], velocity: None });
    let body = Body { parts: vec![Part { motion: &moving, shape: Shape::Field(&field), exact }], seconds: SECONDS };
    let mut found = 0;
    for i in 0..3000 {
        let p = random_in(i, [0.1, -0.1, -0.2], [0.5, 0.3, 0.2]);
        let want = bvh.closest(moving(1.0).invert(p), f64::INFINITY).unwrap().signed_distance;
        match body.exact(p, 0.002) {
            Some(hit) => {
                assert!((hit.distance - want).abs() < 1e-12);
                let out = body.exact(p - hit.normal * (hit.distance - 1e-4), 0.002).unwrap();
                assert!((out.distance - 1e-4).abs() < 1e-5, "{} {}", hit.distance, out.distance);
                found += 1;
            }
            None => assert!(want >= 0.002),
        }
    }
    assert!(found > 150);
}

#[test]
fn nothing_is_infinitely_far() {
    let body = Body::default();
    assert_eq!(body.sample(Vec3::zeros(), 0.5).distance, f64::INFINITY);
    assert_eq!(body.distance_bound(Vec3::zeros(), 0.5), f64::INFINITY);
    assert!(body.exact(Vec3::zeros(), 1.0).is_none());
}
