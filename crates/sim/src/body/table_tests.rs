use super::super::testing::*;
use super::*;
use pelage_geom::shapes::{bust, cube_sphere};
use pelage_geom::{Mesh, Topology};

fn bvh(mesh: &Mesh) -> Bvh {
    Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(mesh))
}

#[test]
fn a_spherical_table_of_a_sphere_is_a_sphere() {
    let table = Table::sphere(&bvh(&cube_sphere(48, 0.1)), Vec3::new(0.01, 0.0, 0.0), Vec3::y(), 0.2, [40, 40]);
    assert_eq!(table.missed, 0);
    for i in 0..4000 {
        let p = random_in(i, [-0.15; 3], [0.15; 3]);
        if p.norm() > 0.07 {
            let s = table.sample(p);
            let allowed = 0.0012 + 0.1 * (p.norm() - 0.1).abs();
            assert!((s.distance - (p.norm() - 0.1)).abs() < allowed, "{p} {}", s.distance - p.norm() + 0.1);
            assert!(s.normal.dot(&p.normalize()) > 0.97);
            assert!(table.distance_bound(p) <= (p.norm() - 0.1).max(0.0) + 1e-3);
        }
    }
}

#[test]
fn a_cylindrical_table_is_right_at_its_sides_and_ends() {
    let mut mesh = cube_sphere(48, 0.1);
    mesh.position.iter_mut().for_each(|p| p[1] *= 3.0);
    let bvh = bvh(&mesh);
    let (from, to) = (Vec3::new(0.0, -0.1, 0.0), Vec3::new(0.0, 0.1, 0.0));
    let table = Table::cylinder(&bvh, from, to, 0.2, [40, 40]);
    for i in 0..4000 {
        let p = random_in(i, [-0.15, -0.09, -0.15], [0.15, 0.09, 0.15]);
        let d = bvh.closest(p, f64::INFINITY).unwrap().signed_distance;
        if d.abs() < 0.01 {
            assert!((table.sample(p).distance - d).abs() < 1.2e-3, "{p} {d} {}", table.sample(p).distance);
        }
        assert!(table.distance_bound(p) <= d.max(0.0) + 1e-6);
    }
    let above = table.sample(Vec3::new(0.02, 0.13, 0.01));
    assert!((above.distance - 0.03).abs() < 1e-12 && above.normal.y > 0.999);
    let corner = table.sample(Vec3::new(0.2, 0.15, 0.0));
    assert!(corner.distance > 0.11 && corner.normal.x > 0.5 && corner.normal.y > 0.3);
    let low = table.sample(Vec3::new(0.0, -0.095, 0.001));
    assert!((low.distance + 0.005).abs() < 1e-12 && low.normal.y < -0.999);
}

#[test]
fn tables_are_continuous_where_the_azimuth_wraps_and_at_ends() {
    let mesh = metres(bust().mesh);
    let bvh = bvh(&mesh);
    let centre = Vec3::new(0.0, 0.1, 0.0);
    let tables = [
        Table::sphere(&bvh, centre, Vec3::y(), 0.25, [40, 40]),
        Table::cylinder(&bvh, Vec3::new(0.0, -0.06, -0.03), Vec3::new(0.0, 0.2, 0.0), 0.2, [40, 40]),
    ];
    for table in tables {
        for line in 0..10 {
            let from = centre + random_in(2 * line, [-1.0; 3], [1.0; 3]).normalize() * 0.2;
            let to = centre + random_in(2 * line + 1, [-1.0; 3], [1.0; 3]).normalize() * 0.2;
            let mut last = None;
            for k in 0..40_000 {
                let p = from + (to - from) * (f64::from(k) / 40_000.0);
                let d = table.sample(p).distance;
                if (p - centre).norm() > 0.05 {
                    assert!(last.is_none_or(|l: f64| (d - l).abs() < 2e-4), "{line} {k}: {last:?} {d}");
                    last = Some(d);
                } else {
                    last = None;
                }
            }
        }
        for bad in [Vec3::repeat(f64::NAN), Vec3::repeat(f64::INFINITY), centre] {
            table.sample(bad);
        }
    }
}

/// How well 40 x 40 samples stand for a head: what the paper calls a rough approximation.
#[test]
fn a_spherical_table_of_the_head() {
    let mesh = metres(bust().mesh);
    let bvh = bvh(&mesh);
    let table = Table::sphere(&bvh, Vec3::new(0.0, 0.1, 0.0), Vec3::y(), 0.25, [40, 40]);
    let mut off: Vec<f64> = (0..40_000)
        .map(|i| random_in(i, [-0.15, 0.1, -0.15], [0.15, 0.25, 0.15]))
        .map(|p| (p, bvh.closest(p, f64::INFINITY).unwrap().signed_distance))
        .filter(|(_, d)| d.abs() < 0.005)
        .map(|(p, d)| (table.sample(p).distance - d).abs())
        .collect();
    off.sort_by(f64::total_cmp);
    let (half, most) = (off[off.len() / 2], off[off.len() * 95 / 100]);
    println!("head by 40 x 40: median {:.2} mm, 95 % {:.2} mm", half * 1e3, most * 1e3);
    assert!(half < 1e-3 && most < 6e-3);
}
