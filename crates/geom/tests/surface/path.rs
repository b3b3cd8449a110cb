use crate::shapes::{cube, sphere, square, tube};
use pelage_geom::path::{PathPoint, polyline_path, straight_path};
use pelage_geom::{Bvh, Mesh, SurfacePoint, Topology, Vec3, rng};

fn at(triangle: u32, bary: [f32; 2]) -> SurfacePoint {
    SurfacePoint { triangle, bary }
}

fn points(m: &Mesh, path: &[PathPoint]) -> Vec<Vec3> {
    path.iter().map(|p| m.point(&p.before)).collect()
}

fn length(p: &[Vec3]) -> f64 {
    p.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// Laws of any path: it starts and ends where it should, each step stays in one triangle, each crossing is one place.
fn check(m: &Mesh, path: &[PathPoint], from: &SurfacePoint, to: &SurfacePoint) {
    assert_eq!((path[0].before, path[path.len() - 1].after), (*from, *to));
    for w in path.windows(2) {
        assert_eq!(w[0].after.triangle, w[1].before.triangle);
    }
    for (k, p) in path.iter().enumerate() {
        assert!((m.point(&p.before) - m.point(&p.after)).norm() < 1e-6, "{p:?}");
        if k > 0 && k + 1 < path.len() && p.before.triangle != p.after.triangle {
            assert!(p.before.weights().contains(&0.0) && p.after.weights().contains(&0.0), "{p:?}");
        }
    }
}

fn random_point(m: &Mesh, k: u64) -> SurfacePoint {
    let r = |c: u64| rng::uniform(3, k, 0, c);
    let (a, b) = (r(1), r(2));
    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
    at((r(0) * m.triangle.len() as f64) as u32, [a as f32, b as f32])
}

#[test]
fn on_a_plane_paths_are_straight_lines() {
    let m = square(7);
    let t = Topology::new(&m);
    for k in 0..500 {
        let (a, b) = (random_point(&m, 2 * k), random_point(&m, 2 * k + 1));
        let path = straight_path(&m, &t, a, b).expect("a square is convex");
        check(&m, &path, &a, &b);
        assert!((length(&points(&m, &path)) - (m.point(&a) - m.point(&b)).norm()).abs() < 1e-6);
    }
}

#[test]
fn through_vertices_and_along_edges() {
    let n = 6;
    let m = square(n);
    let t = Topology::new(&m);
    // Every vertex to every other, seen from any of their triangles: along rows, diagonals and the rim too.
    let mut seen = vec![None; m.position.len()];
    for k in 0..m.triangle.len() {
        for i in 0..3 {
            let s = at(k as u32, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][i]);
            let keep = &mut seen[m.triangle[k][i] as usize];
            if keep.is_none() || (k * 7 + i) % 3 == 0 {
                *keep = Some(s);
            }
        }
    }
    let seen: Vec<SurfacePoint> = seen.into_iter().flatten().collect();
    for a in &seen {
        for b in &seen {
            let path = straight_path(&m, &t, *a, *b).unwrap_or_else(|| panic!("{a:?} {b:?}"));
            check(&m, &path, a, b);
            assert!((length(&points(&m, &path)) - (m.point(a) - m.point(b)).norm()).abs() < 1e-6);
        }
    }
}

#[test]
fn round_a_tube_the_shorter_way_and_over_its_seam() {
    let m = tube(64, 4);
    let (t, h) = (Topology::new(&m), Bvh::build(&m.position, &m.triangle, &Topology::new(&m)));
    let on = |turn: f64, z: f64| {
        let (x, y) = crate::shapes::circle(turn);
        h.closest(Vec3::new(x, y, z), 9.0).unwrap().point
    };
    for (from, to) in [(0.9, 1.15), (1.15, 0.9), (0.2, 0.55), (0.0, 0.3)] {
        let (a, b) = (on(from, 0.4), on(to, 0.4));
        let path = straight_path(&m, &t, a, b).unwrap();
        check(&m, &path, &a, &b);
        let arc = (to - from).abs() * std::f64::consts::TAU;
        assert!((length(&points(&m, &path)) - arc).abs() < 0.01 * arc);
        // The seam is known from both sides: u = 0 here, u = 1 there.
        let jumps = path.iter().filter(|p| (m.uv(&p.before)[0] - m.uv(&p.after)[0]).abs() > 0.5).count();
        assert_eq!(jumps, usize::from(from.max(to) > 1.0), "{from} {to}");
    }
}

#[test]
fn on_a_sphere_paths_are_great_circles() {
    let m = sphere(96, 48, 1.0);
    let t = Topology::new(&m);
    for k in 0..200 {
        let (a, b) = (random_point(&m, 2 * k), random_point(&m, 2 * k + 1));
        let (p, q) = (m.point(&a), m.point(&b));
        if p.z.abs() > 0.99 || q.z.abs() > 0.99 || p.normalize().dot(&q.normalize()) < -0.97 {
            continue;
        }
        let path = straight_path(&m, &t, a, b).unwrap_or_else(|| panic!("{a:?} {b:?}"));
        check(&m, &path, &a, &b);
        let angle = libm::acos(p.normalize().dot(&q.normalize()).min(1.0));
        assert!((length(&points(&m, &path)) - angle).abs() < 0.02 * angle + 0.01, "{k}");
    }
}

#[test]
fn over_the_edges_of_a_cube_and_to_nowhere() {
    let mut m = cube(3);
    let t = Topology::new(&m);
    for k in 0..300 {
        let (a, b) = (random_point(&m, 2 * k), random_point(&m, 2 * k + 1));
        let path = straight_path(&m, &t, a, b).expect("a closed convex body has one section");
        check(&m, &path, &a, &b);
    }
    // Another part of the mesh.
    let base = m.position.len() as u32;
    m.position.extend([[9.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]]);
    m.triangle.push([base, base + 1, base + 2]);
    let t = Topology::new(&m);
    let last = m.triangle.len() as u32 - 1;
    assert_eq!(straight_path(&m, &t, at(0, [0.3, 0.3]), at(last, [0.3, 0.3])), None);
}

#[test]
fn polylines_are_projected_and_joined() {
    let m = square(8);
    let t = Topology::new(&m);
    let h = Bvh::build(&m.position, &m.triangle, &t);
    let line =
        [Vec3::new(0.1, 0.1, 0.5), Vec3::new(0.8, 0.1, -0.2), Vec3::new(0.8, 0.9, 0.3), Vec3::new(0.5, 0.5, 0.0)];
    let path = polyline_path(&m, &t, &h, &line).unwrap();
    check(&m, &path, &path[0].before, &path[path.len() - 1].after);
    assert!((length(&points(&m, &path)) - (0.7 + 0.8 + 0.5)).abs() < 1e-6);
    assert_eq!(polyline_path(&m, &t, &h, &[]), None);
    assert_eq!(polyline_path(&m, &t, &h, &line[..1]).unwrap().len(), 1);
}
