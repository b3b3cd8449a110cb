use super::super::testing::*;
use super::*;
use pelage_geom::Mesh;
use pelage_geom::shapes::{bust, cube_sphere, torus};

const FINE: FieldSettings = FieldSettings { voxel: 0.004, outside: 0.02, inside: 0.01 };

fn with(mesh: &Mesh, settings: &FieldSettings, region: Option<Bounds>) -> (Field, Bvh) {
    let topology = Topology::new(mesh);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    (Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, settings, region, None), bvh)
}

fn exact(bvh: &Bvh, p: Vec3) -> f64 {
    bvh.closest(p, f64::INFINITY).unwrap().signed_distance
}

/// Points in the band of a mesh with a voxel's diagonal to spare, with their exact distance.
fn band(mesh: &Mesh, bvh: &Bvh, n: u64) -> Vec<(Vec3, f64)> {
    let (low, high) = mesh.bounds();
    let (low, high) = (low.map(|x| x - 0.02), high.map(|x| x + 0.02));
    let points = (0..n).map(|i| random_in(i, low, high)).map(|p| (p, exact(bvh, p)));
    points.filter(|(_, d)| (-0.003..0.013).contains(d)).collect()
}

#[test]
fn a_sphere_is_within_the_error_of_trilinear_interpolation() {
    let mesh = cube_sphere(64, 0.1);
    let (field, bvh) = with(&mesh, &FINE, None);
    let near = band(&mesh, &bvh, 40_000);
    assert!(near.len() > 2000);
    for (p, _) in near {
        let s = field.sample(p);
        // Two curvatures of 1 / r over a cell: h^2 / 8 each, h being two voxels away from the surface; the mesh lies
        // up to 3e-5 inside the sphere.
        let h = if (p.norm() - 0.1).abs() < 0.004 { 0.004 } else { 0.008 };
        let allowed = h * h / 4.0 / (p.norm() - 0.004) + 3e-5;
        assert!((s.distance - (p.norm() - 0.1)).abs() < allowed, "{p}: {} {}", s.distance, p.norm() - 0.1);
        assert!(s.normal.dot(&p.normalize()) > 0.998, "{}", s.normal.dot(&p.normalize()));
    }
}

#[test]
fn the_error_falls_with_the_square_of_the_voxel() {
    let mesh = torus(128, 64, 0.1, 0.04);
    let error = |voxel: f64| {
        let (field, bvh) = with(&mesh, &FieldSettings { voxel, ..FINE }, None);
        let off: Vec<f64> =
            band(&mesh, &bvh, 20_000).iter().map(|(p, d)| (field.sample(*p).distance - d).abs()).collect();
        off.iter().sum::<f64>() / off.len() as f64
    };
    let (coarse, fine) = (error(0.008), error(0.004));
    println!("torus, mean error: {coarse:.2e} m at 8 mm, {fine:.2e} m at 4 mm");
    assert!(coarse / fine > 3.2, "{coarse} {fine}");
}

#[test]
fn the_bust_is_within_half_a_voxel() {
    let mesh = metres(bust().mesh);
    let (field, bvh) = with(&mesh, &FINE, None);
    let mut off: Vec<f64> =
        band(&mesh, &bvh, 100_000).iter().map(|(p, d)| (field.sample(*p).distance - d).abs()).collect();
    off.sort_by(f64::total_cmp);
    let (mean, last) = (off.iter().sum::<f64>() / off.len() as f64, off[off.len() - 1]);
    println!(
        "bust, {} points: mean {mean:.2e}, 99.9 % {:.2e}, most {last:.2e} m",
        off.len(),
        off[off.len() * 999 / 1000]
    );
    assert!(mean < 0.02 * 0.004 && last < 0.5 * 0.004);
}

#[test]
fn the_normal_is_the_gradient() {
    let mesh = torus(64, 32, 0.1, 0.04);
    let (field, _) = with(&mesh, &FINE, None);
    let h = 1e-7;
    let mut tested = 0;
    for i in 0..20_000 {
        let p = random_in(i, [-0.2, -0.1, -0.2], [0.2, 0.1, 0.2]);
        let (place, beyond) = field.locate(p);
        let edge = place.t.iter().any(|t| !(0.001..0.999).contains(t));
        let gradient = field.value(&place).1;
        if edge || beyond != Vec3::zeros() || gradient.norm() < 0.1 {
            continue;
        }
        let s = field.sample(p);
        let difference = Vec3::from(std::array::from_fn(|a| {
            let e = Vec3::ith(a, h);
            (field.sample(p + e).distance - field.sample(p - e).distance) / (2.0 * h)
        }));
        assert!((difference - gradient).norm() < 1e-5, "{difference} {gradient}");
        assert!((s.normal - gradient.normalize()).norm() < 1e-12 && (s.normal.norm() - 1.0).abs() < 1e-12);
        tested += 1;
    }
    assert!(tested > 5000, "{tested}");
}

/// Steps of 10 um along lines through everything: no jump beyond what the steepest gradient allows.
#[test]
fn distances_are_continuous_through_bricks_lattice_and_beyond() {
    let mesh = metres(bust().mesh);
    let (field, _) = with(&mesh, &FieldSettings { voxel: 0.006, ..FINE }, None);
    let step = 1e-5;
    for line in 0..12 {
        let from = random_in(2 * line, [-0.35; 3], [0.35; 3]);
        let towards = random_in(2 * line + 1, [-0.2; 3], [0.2; 3]);
        let way = (towards - from).normalize() * step;
        let mut last = field.sample(from).distance;
        for k in 1..60_000 {
            let d = field.sample(from + way * f64::from(k)).distance;
            assert!((d - last).abs() < 3.0 * step, "line {line}, {k}: {last} to {d}");
            last = d;
        }
    }
}

#[test]
fn flows_are_continuous_between_bricks_and_lattice() {
    let mesh = cube_sphere(32, 0.1);
    let (field, _) = with(&mesh, &FINE, None);
    let velocity: Vec<[f64; 3]> = mesh.position.iter().map(|p| [p[1] * 10.0, 1.0, -p[0] * 5.0]).collect();
    let flow = field.flow(&mesh.triangle, &velocity);
    let at = |p: Vec3| flow.at(&field.locate(p).0);
    let fastest = velocity.iter().map(|v| Vec3::from(*v).norm()).fold(0.0, f64::max);
    assert!((flow.fastest - fastest).abs() < 1e-12);
    let (from, way) = (Vec3::new(0.13, 0.12, 0.11), Vec3::new(-0.6, -0.51, -0.44).normalize() * 1e-5);
    for k in 0..6000 {
        let (a, b) = (at(from + way * f64::from(k)), at(from + way * f64::from(k + 1)));
        assert!((a - b).norm() < 0.01, "{k}: {a} {b}");
    }
    for i in 0..2000 {
        let n = random_in(i, [-1.0; 3], [1.0; 3]).normalize();
        let want = Vec3::new(n.y, 1.0, -0.5 * n.x);
        assert!((at(n * 0.105) - want).norm() < 0.03, "{} {want}", at(n * 0.105));
    }
}

#[test]
fn bounds_are_lower_bounds() {
    let mesh = metres(bust().mesh);
    let head = ([-0.12, 0.0, -0.12], [0.12, 0.25, 0.14]);
    for region in [None, Some(head)] {
        let (field, bvh) = with(&mesh, &FINE, region);
        let (mut loss, mut outside) = (0.0, 0.0);
        for i in 0..40_000 {
            let p = random_in(i, [-0.5; 3], [0.5; 3]) * if i % 2 == 0 { 1.0 } else { 0.5 };
            let (d, bound) = (exact(&bvh, p), field.distance_bound(p));
            assert!(bound <= d.max(0.0) + 1e-9, "{p}: {bound} over {d}");
            if d > 0.0 {
                (loss, outside) = (loss + d - bound, outside + 1.0);
            }
        }
        println!("region {}: bounds short by {:.1} mm in the mean", region.is_some(), 1e3 * loss / outside);
    }
}

#[test]
fn far_points_have_a_usable_distance_and_normal() {
    let mesh = cube_sphere(32, 0.1);
    let (field, _) = with(&mesh, &FINE, None);
    for i in 0..2000 {
        let p = random_in(i, [-3.0; 3], [3.0; 3]);
        let s = field.sample(p);
        assert!((s.normal.norm() - 1.0).abs() < 1e-12);
        if p.norm() > 0.2 {
            assert!(
                (s.distance - (p.norm() - 0.1)).abs() < 0.012 + 0.04 * p.norm(),
                "{p} {}",
                s.distance - (p.norm() - 0.1)
            );
            assert!(s.normal.dot(&p.normalize()) > 0.98, "{p} {}", s.normal);
        }
    }
    let centre = field.sample(Vec3::zeros());
    assert!(centre.distance < -0.05 && (centre.normal.norm() - 1.0).abs() < 1e-12);
    for bad in [Vec3::repeat(f64::NAN), Vec3::repeat(f64::INFINITY), Vec3::new(1e300, 0.0, f64::NAN)] {
        field.sample(bad);
        field.distance_bound(bad);
    }
}

#[test]
fn a_region_changes_nothing_inside() {
    let mesh = metres(bust().mesh);
    let region = ([-0.12, 0.05, -0.15], [0.12, 0.25, 0.14]);
    let ((all, bvh), (part, _)) = (with(&mesh, &FINE, None), with(&mesh, &FINE, Some(region)));
    assert!(part.bricks() * 3 < all.bricks() * 2, "{} of {}", part.bricks(), all.bricks());
    for i in 0..20_000 {
        let p = random_in(i, region.0, region.1);
        let d = exact(&bvh, p);
        if (-0.01..0.02).contains(&d) {
            assert!((part.sample(p).distance - d).abs() < 0.5 * FINE.voxel);
        }
    }
    let (none, bvh) = with(&mesh, &FINE, Some(([3.0; 3], [4.0; 3])));
    let p = Vec3::repeat(3.5);
    assert!(none.bricks() == 0 && none.distance_bound(p) > 4.0 && none.sample(p).distance <= exact(&bvh, p));
}

#[test]
fn odd_meshes_give_fields() {
    let mut mesh = cube_sphere(16, 0.1);
    for (k, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().enumerate() {
        mesh.position[40 + 9 * k][k] = bad;
    }
    let topology = Topology::new(&cube_sphere(16, 0.1));
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let field = Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, &FINE, None, None);
    assert_eq!(field.not_finite, 3);
    let s = field.sample(Vec3::new(0.0, -0.105, 0.0));
    assert!((s.distance - 0.005).abs() < 0.001, "{s:?}");
    let velocity = vec![[f64::NAN; 3]; mesh.position.len()];
    assert_eq!(field.flow(&mesh.triangle, &velocity).fastest, 0.0);
    for mesh in [Mesh::default(), Mesh { position: vec![[0.1; 3]; 3], triangle: vec![[0, 1, 2]], ..Mesh::default() }] {
        let (field, _) = with(&mesh, &FINE, None);
        let s = field.sample(Vec3::repeat(0.2));
        assert!(s.distance > 0.1 && (s.normal.norm() - 1.0).abs() < 1e-12, "{s:?}");
    }
    let bad = FieldSettings { voxel: f64::NAN, outside: f64::NAN, inside: -1.0 };
    with(&cube_sphere(4, 0.1), &bad, None).0.sample(Vec3::zeros());
}

#[test]
fn a_huge_body_gets_larger_voxels() {
    let mut mesh = cube_sphere(8, 0.1);
    mesh.position.iter_mut().flatten().for_each(|x| *x *= 1000.0);
    let (field, bvh) = with(&mesh, &FINE, None);
    assert!(field.voxel() > 0.1 && field.centre.len() <= build::MOST_CELLS as usize);
    let p = Vec3::new(103.0, 20.0, 10.0);
    assert!((field.sample(p).distance - exact(&bvh, p)).abs() < field.voxel());
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let mesh = torus(64, 32, 0.1, 0.04);
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| with(&mesh, &FINE, None).0)
    };
    let one = build(1);
    for threads in [2, 3, 7] {
        let more = build(threads);
        assert!(one.distance == more.distance && one.foot == more.foot && one.centre == more.centre);
    }
}

#[test]
fn a_field_like_a_known_one_is_what_it_would_be_by_itself() {
    let ball = cube_sphere(24, 0.1);
    let topology = Topology::new(&ball);
    let bvh = |position: &[[f64; 3]]| Bvh::build(position, &ball.triangle, &topology);
    let settings = FieldSettings::default();
    let at_rest = bvh(&ball.position);
    let rest = Field::build(&ball.position, &ball.triangle, &topology, &at_rest, &settings, None, None);
    // One side swells; the lattice grows with it.
    let swollen: Vec<[f64; 3]> =
        ball.position.iter().map(|p| [p[0] + 4.0 * (p[0] - 0.05).max(0.0) * p[0], p[1], p[2]]).collect();
    let moved = bvh(&swollen);
    let region = Some(([-0.09, -0.2, -0.2], [0.2; 3]));
    for region in [None, region] {
        let alone = Field::build(&swollen, &ball.triangle, &topology, &moved, &settings, region, None);
        let known = Known::new(&rest, &ball.triangle, &ball.position, &swollen).expect("most of it stays");
        let like = Field::build(&swollen, &ball.triangle, &topology, &moved, &settings, region, Some(known));
        assert_eq!(like.cells, alone.cells);
        assert_eq!((&like.brick, &like.centre), (&alone.brick, &alone.centre));
        assert!(like.distance == alone.distance, "distances differ");
        // Where several feet are as close either may stand.
        let apart = like.corner_foot.iter().zip(&alone.corner_foot).filter(|(a, b)| a != b).count();
        assert!(apart * 100 < like.corner_foot.len(), "feet of {apart} corners differ");
    }
    // Less than a quarter stays: nothing is taken over.
    let turned: Vec<[f64; 3]> = ball.position.iter().map(|p| [p[1], -p[0], p[2] + 1e-3]).collect();
    assert!(Known::new(&rest, &ball.triangle, &ball.position, &turned).is_none());
}

/// What a known field would give wrongly if more were taken over than may be is seen.
#[test]
fn what_moved_closer_is_sampled_again() {
    let ball = cube_sphere(12, 0.1);
    let topology = Topology::new(&ball);
    let settings = FieldSettings::default();
    let at_rest = Bvh::build(&ball.position, &ball.triangle, &topology);
    let rest = Field::build(&ball.position, &ball.triangle, &topology, &at_rest, &settings, None, None);
    // A thorn: one vertex moves far out.
    let mut thorn = ball.position.clone();
    let top = (0..thorn.len()).max_by(|a, b| thorn[*a][1].total_cmp(&thorn[*b][1])).unwrap();
    thorn[top][1] += 0.08;
    let bvh = Bvh::build(&thorn, &ball.triangle, &topology);
    let known = Known::new(&rest, &ball.triangle, &ball.position, &thorn).expect("most of it stays");
    let like = Field::build(&thorn, &ball.triangle, &topology, &bvh, &settings, None, Some(known));
    let alone = Field::build(&thorn, &ball.triangle, &topology, &bvh, &settings, None, None);
    assert!(like.distance == alone.distance && like.brick == alone.brick);
}
