use crate::shapes::{cube, mesh, sphere, square};
use pelage_geom::{Bvh, Mesh, Topology, Vec3, rng};

fn bvh(m: &Mesh) -> Bvh {
    Bvh::build(&m.position, &m.triangle, &Topology::new(m))
}

/// Uniform point of the cube [-r, r]^3.
fn random(k: u64, r: f64) -> Vec3 {
    Vec3::new(rng::uniform(1, k, 1, 0), rng::uniform(1, k, 1, 1), rng::uniform(1, k, 1, 2)).map(|x| r * (2.0 * x - 1.0))
}

/// Points that are hard: corners, middles of edges, centres, and near each.
fn special(m: &Mesh) -> Vec<Vec3> {
    let mut q = Vec::new();
    for t in 0..m.triangle.len() as u32 {
        let [a, b, c] = m.corners(t);
        for p in [a, (a + b) * 0.5, (a + b + c) / 3.0] {
            q.extend([p, p * 1.25, p * 0.5, p + Vec3::new(1e-9, 0.0, 0.0)]);
        }
    }
    q
}

/// Distance to a triangle by another road: projected gradient over the sides and the plane.
fn distance(q: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let on = |p: Vec3, d: Vec3| {
        let s = d.norm_squared();
        (q - p - d * if s > 0.0 { (d.dot(&(q - p)) / s).clamp(0.0, 1.0) } else { 0.0 }).norm()
    };
    let mut best = on(a, b - a).min(on(b, c - b)).min(on(c, a - c));
    let n = (b - a).cross(&(c - a));
    if n.norm() > 1e-12 {
        let n = n.normalize();
        let inside = |p: Vec3, d: Vec3| n.dot(&d.cross(&(q - p))) >= 0.0;
        if inside(a, b - a) && inside(b, c - b) && inside(c, a - c) {
            best = best.min(n.dot(&(q - a)).abs());
        }
    }
    best
}

/// Agrees with brute force; the surface point is where it says.
fn check(m: &Mesh, queries: &[Vec3]) {
    let h = bvh(m);
    for &q in queries {
        let found = h.closest(q, f64::INFINITY).unwrap();
        let brute: Vec<f64> = (0..m.triangle.len() as u32).map(|t| distance(q, m.corners(t))).collect();
        let least = brute.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((found.signed_distance.abs() - least).abs() < 1e-12, "{q} {found:?} {least}");
        assert!(((q - found.position).norm() - least).abs() < 1e-12);
        assert!((m.point(&found.point) - found.position).norm() < 3e-7);
        assert!((found.normal.norm() - 1.0).abs() < 1e-12);
        let w = found.point.weights();
        assert!(w.iter().all(|w| (0.0..=1.0).contains(w)) && w[0] + w[1] + w[2] == 1.0, "{w:?}");
        // Ties go to the lowest triangle.
        let first = brute.iter().position(|&d| d < least + 1e-13).unwrap() as u32;
        assert!(found.point.triangle >= first && brute[found.point.triangle as usize] < least + 1e-12);
        // Limits.
        assert_eq!(h.closest(q, least * 1.000001 + 1e-12), Some(found));
        if least > 1e-6 {
            assert_eq!(h.closest(q, least * 0.999999), None);
        }
    }
}

#[test]
fn closest_agrees_with_brute_force() {
    for m in [cube(2), sphere(12, 7, 1.0), sphere(9, 6, 0.5), square(5)] {
        let mut q: Vec<Vec3> = (0..400).map(|k| random(k, 2.0)).collect();
        q.extend(special(&m));
        check(&m, &q);
    }
}

#[test]
fn at_shared_corners_and_edges_the_lowest_triangle_wins() {
    let m = sphere(12, 7, 1.0);
    let t = Topology::new(&m);
    let h = bvh(&m);
    for v in (0..m.position.len()).filter(|&v| m.position[v][2].abs() < 1.0) {
        let found = h.closest(Vec3::from(m.position[v]) * 1.3, 9.0).unwrap();
        let sound = t.incident_welded(t.weld[v]).iter().map(|c| c / 3).filter(|&k| t.area[k as usize] > 0.0);
        let lowest = sound.min();
        assert_eq!(Some(found.point.triangle), lowest, "{v}");
    }
    for k in 0..m.triangle.len() as u32 {
        for i in 0..3 {
            let p = (m.corners(k)[i] + m.corners(k)[(i + 1) % 3]) * 0.5;
            if let Some((n, _)) = t.across(k, i) {
                let normal = |t: u32| {
                    let [a, b, c] = m.corners(t);
                    (b - a).cross(&(c - a)).normalize()
                };
                // Out between the two normals; the halves of a quad are coplanar and share rounding only.
                let found = h.closest(p * 1.1, 9.0).unwrap();
                if t.area[k as usize].min(t.area[n as usize]) > 0.0 && normal(k).dot(&normal(n)) < 0.9999 {
                    assert!((found.position - p).norm() < 0.05);
                    assert_eq!(found.point.triangle, k.min(n));
                }
            }
        }
    }
}

#[test]
fn the_sign_is_right_around_a_cube() {
    let m = cube(3);
    let h = bvh(&m);
    let mut q: Vec<Vec3> = (0..4000).map(|k| random(k, 1.5)).collect();
    // Straight out from and in from corners and edges.
    for s in [0.5, 0.999, 1.001, 2.0] {
        for x in [-1.0, 0.3, 1.0] {
            q.extend([Vec3::new(x, 1.0, -1.0) * s, Vec3::new(1.0, x, 1.0) * s, Vec3::new(-1.0, -1.0, x) * s]);
        }
    }
    for q in q {
        let d = q.abs() - Vec3::repeat(1.0);
        let exact = d.sup(&Vec3::zeros()).norm() + d.max().min(0.0);
        assert!((h.closest(q, 9.0).unwrap().signed_distance - exact).abs() < 1e-12, "{q}");
    }
}

#[test]
fn the_sign_is_right_around_a_thin_spike() {
    // A needle on a plate: the classic failure of plain vertex normals.
    let p = vec![[0.01, 0.0, 0.0], [-0.005, 0.01, 0.0], [-0.005, -0.01, 0.0], [3.0, 0.0, 0.5]];
    let m = mesh(p, &[], vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
    let h = bvh(&m);
    for k in 0..2000 {
        let q = random(k, 4.0);
        let outside = (0..4).any(|t| {
            let [a, b, c] = m.corners(t);
            (b - a).cross(&(c - a)).dot(&(q - a)) > 0.0
        });
        assert_eq!(h.closest(q, 99.0).unwrap().signed_distance > 0.0, outside, "{q}");
    }
}

#[test]
fn signs_of_closed_and_open_spheres() {
    let closed = bvh(&sphere(48, 24, 1.0));
    let open = bvh(&sphere(48, 24, 0.5));
    for k in 0..4000 {
        let q = random(k, 2.0);
        let r = q.norm();
        if (r - 1.0).abs() > 0.02 {
            assert_eq!(closed.closest(q, 9.0).unwrap().signed_distance < 0.0, r < 1.0, "{q}");
        }
        // Lower half only: well above the rim's plane the closest point is on the rim, which is open.
        let d = open.closest(q, 9.0).unwrap();
        if q.z > 0.05 {
            assert!(d.signed_distance > 0.0 && d.position.z.abs() < 1e-12, "{q}");
        } else if (r - 1.0).abs() > 0.02 && q.z < -0.1 {
            assert_eq!(d.signed_distance < 0.0, r < 1.0, "{q}");
        }
    }
}

#[test]
fn triangles_without_area_are_points_and_lines() {
    let p = vec![[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.3, 0.0, 0.0], [5.0, 5.0, 5.0]];
    let m = mesh(p, &[], vec![[0, 1, 2], [0, 3, 3], [4, 4, 4], [2, 0, 3]]);
    let q: Vec<Vec3> = (0..200).map(|k| random(k, 6.0)).collect();
    check(&m, &q);
    let same = mesh(vec![[1.0; 3], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]], &[], vec![[0, 1, 2]; 50]);
    assert_eq!(bvh(&same).closest(Vec3::zeros(), 9.0).unwrap().point.triangle, 0);
}

#[test]
fn empty_and_not_finite_meshes() {
    assert_eq!(bvh(&Mesh::default()).closest(Vec3::zeros(), 9.0), None);
    assert_eq!(bvh(&Mesh::default()).ray(Vec3::zeros(), Vec3::x(), 9.0), None);
    let m = mesh(vec![[f64::NAN; 3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[], vec![[0, 1, 2], [1, 2, 3]]);
    assert_eq!(bvh(&m).closest(Vec3::zeros(), 9.0).unwrap().point.triangle, 1);
    assert_eq!(bvh(&m).closest(Vec3::repeat(f64::NAN), 9.0), None);
}

#[test]
fn rays_agree_with_brute_force_and_slip_through_nothing() {
    let m = sphere(12, 7, 1.0);
    let h = bvh(&m);
    for k in 0..1000 {
        let (o, d) = (random(k, 0.45), random(k + 5000, 1.0));
        let (t, p) = h.ray(o, d, f64::INFINITY).expect("from inside every ray hits");
        assert!((m.point(&p) - (o + d * t)).norm() < 1e-6);
        assert_eq!(h.ray(o, d, t * 0.999), None);
        // Back from the hit's far side the same triangle is hit.
        let (s, b) = h.ray(o + d * (t * 1.5), -d, f64::INFINITY).unwrap();
        assert!((s - 0.5 * t).abs() < 1e-9 && b.triangle == p.triangle);
    }
    // At corners and middles of edges.
    for t in 0..m.triangle.len() as u32 {
        let [a, b, _] = m.corners(t);
        for q in [a, (a + b) * 0.5] {
            let (t, _) = h.ray(Vec3::zeros(), q, 2.0).expect("no gaps");
            assert!((t - 1.0).abs() < 1e-12);
        }
    }
    assert_eq!(h.ray(Vec3::new(2.0, 0.0, 0.0), Vec3::x(), f64::INFINITY), None);
    assert_eq!(h.ray(Vec3::zeros(), Vec3::zeros(), 9.0), None);
}

#[test]
fn slivers_lose_nothing() {
    // Height against length from ordinary to nothing, in a skew plane; queries above known feet.
    let (along, up) = (Vec3::new(1.0, 2.0, 2.0) / 3.0, Vec3::new(2.0, 1.0, -2.0) / 3.0);
    for height in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0.0] {
        let p = [Vec3::zeros(), along, along * 0.4 + up * height].map(|v| v.into());
        let h = bvh(&mesh(p.to_vec(), &[], vec![[0, 1, 2]]));
        for k in 0..200 {
            let foot = along * rng::uniform(7, k, 0, 0) + up * (height * 0.5 * rng::uniform(7, k, 0, 1));
            let q = foot + along.cross(&up) * rng::uniform(7, k, 0, 2);
            let found = h.closest(q, 9.0).unwrap();
            let (x, y) = (foot.dot(&along), foot.dot(&up));
            if y < height * (x / 0.4).min((1.0 - x) / 0.6) {
                assert!((found.position - foot).norm() < 3e-8, "{height} {foot} {found:?}");
            }
        }
    }
}

#[test]
fn the_distance_bound_is_one_and_not_far_off() {
    let m = sphere(48, 24, 1.0);
    let b = bvh(&m);
    for k in 0..2000 {
        let q = random(k, 4.0);
        let distance = b.closest(q, f64::INFINITY).expect("a mesh").signed_distance.abs();
        let bound = b.distance_bound(q, f64::INFINITY);
        assert!(bound <= distance, "{bound} of {distance}");
        // Boxes of leaves are less than 1 across.
        assert!(bound >= 0.5 * (distance - 1.0), "{bound} of {distance}");
        assert_eq!(b.distance_bound(q, 0.01 * bound), 0.01 * bound);
    }
    assert_eq!(Bvh::default().distance_bound(Vec3::zeros(), 3.0), 3.0);
    assert_eq!(b.distance_bound(Vec3::new(f64::NAN, 0.0, 0.0), 3.0), 0.0);
}
