use super::super::testing::*;
use super::super::{Field, FieldSettings};
use super::*;
use pelage_geom::Bvh;
use pelage_geom::shapes::{bust, cube_sphere, plane};

fn field(mesh: &Mesh, topology: &Topology) -> (Field, Bvh) {
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, topology);
    let settings = FieldSettings { voxel: 0.004, outside: 0.02, inside: 0.01 };
    (Field::build(&mesh.position, &mesh.triangle, topology, &bvh, &settings, None, None), bvh)
}

/// A bust without what is below a height (metres), and the whole one.
fn cut(height: f64) -> (Mesh, Mesh) {
    let whole = metres(bust().mesh);
    let above = |t: &[u32; 3]| t.iter().all(|&v| whole.position[v as usize][1] > height);
    let kept: Vec<usize> = (0..whole.triangle.len()).filter(|&t| above(&whole.triangle[t])).collect();
    let open = Mesh {
        triangle: kept.iter().map(|&t| whole.triangle[t]).collect(),
        corner_uv: kept.iter().map(|&t| whole.corner_uv[t]).collect(),
        face: Vec::new(),
        position: whole.position.clone(),
    };
    (open, whole)
}

/// Cut at the neck, the head keeps its inside, has none below the cut, and its field doesn't jump.
#[test]
fn a_head_cut_at_the_neck_is_a_solid() {
    let (open, whole) = cut(-0.05);
    let topology = Topology::new(&open);
    let closed = Closed::new(&open, &topology);
    assert!(closed.open_edges > 20 && closed.open_edges == topology.counts.open_edges);
    assert_eq!((closed.topology.counts.open_edges, closed.topology.counts.non_manifold_edges), (0, 0));
    assert_eq!(closed.mesh.position, closed.extend(&open.position));
    let (field, bvh) = field(&closed.mesh, &closed.topology);
    let (_, whole_bvh) = self::field(&whole, &Topology::new(&whole));
    for i in 0..40_000 {
        let p = random_in(i, [-0.12, -0.12, -0.12], [0.12, 0.24, 0.12]);
        let (d, s) = (bvh.closest(p, f64::INFINITY).unwrap().signed_distance, field.sample(p));
        if d.abs() > 0.004 && d.abs() < 0.013 {
            assert!((s.distance < 0.0) == (d < 0.0), "{p}");
        }
        let inside = whole_bvh.closest(p, f64::INFINITY).unwrap().signed_distance;
        if p.y > -0.03 && inside < -0.005 {
            assert!(s.distance < 0.0, "{p} {s:?} {inside}");
        }
        assert!(p.y > -0.06 || s.distance > -0.001, "{p} {s:?}");
    }
    // Up through the middle of the cut in steps of 10 um.
    let mut last = field.sample(Vec3::new(0.0, -0.15, -0.03)).distance;
    for k in 0..20_000 {
        let d = field.sample(Vec3::new(0.0, -0.15 + 1e-5 * f64::from(k), -0.03)).distance;
        assert!((d - last).abs() < 3e-5, "{k}: {last} {d}");
        last = d;
    }
    assert!(last < 0.0);
}

/// Without a lid most of what is below the rim is outside, but not what lies behind leaning walls.
#[test]
fn an_open_head_is_mostly_outside_behind_its_rim() {
    let (open, _) = cut(-0.05);
    let topology = Topology::new(&open);
    let (field, _) = field(&open, &topology);
    assert!(field.open_edges > 20);
    let below = (0..10_000).map(|i| random_in(i, [-0.12, -0.12, -0.12], [0.12, -0.065, 0.12]));
    let inside = below.filter(|p| field.sample(*p).distance < 0.0).count();
    println!("below an open rim: {inside} of 10000 inside");
    assert!(inside < 1000);
    assert!(field.sample(Vec3::new(0.0, 0.1, 0.0)).distance < 0.0);
}

#[test]
fn sheets_stay_open_and_solids_stay_as_they_are() {
    let sheet = plane(8, 8, 0.2);
    let closed = Closed::new(&sheet, &Topology::new(&sheet));
    assert_eq!((closed.open_edges, closed.mesh.triangle.len()), (32, sheet.triangle.len()));
    let (field, _) = field(&closed.mesh, &closed.topology);
    assert!(field.sample(Vec3::new(0.0, 0.005, 0.0)).distance > 0.0);
    assert!(field.sample(Vec3::new(0.0, -0.005, 0.0)).distance < 0.0);
    assert!(field.sample(Vec3::new(0.115, -0.005, 0.0)).distance > 0.0);
    let ball = cube_sphere(6, 0.1);
    let closed = Closed::new(&ball, &Topology::new(&ball));
    assert_eq!((closed.open_edges, &closed.mesh.triangle), (0, &ball.triangle));
}

/// Solid angle of the triangles as seen from a point over 4 pi (Van Oosterom, Strackee 1983): 1 inside, 0 outside.
fn winding_number(position: &[[f64; 3]], triangle: &[[u32; 3]], p: Vec3) -> f64 {
    let half_angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3::from(position[v as usize]) - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        libm::atan2(a.dot(&b.cross(&c)), la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
    };
    triangle.iter().map(half_angle).sum::<f64>() / (2.0 * std::f64::consts::PI)
}

/// A post of 5 cm on a skirt of 15 cm, open below, and a pose whose skirt is lifted on one side.
fn skirt() -> (Mesh, Vec<[f64; 3]>) {
    const AROUND: u32 = 48;
    let profile = [(0.15, 0.0), (0.1, 0.01), (0.05, 0.02), (0.05, 0.08), (0.05, 0.14), (0.05, 0.2)];
    let mut mesh = Mesh::default();
    for (radius, height) in profile {
        for k in 0..AROUND {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(AROUND);
            mesh.position.push([radius * libm::cos(angle), height, -radius * libm::sin(angle)]);
        }
    }
    let top = mesh.position.len() as u32;
    mesh.position.push([0.0, 0.2, 0.0]);
    for k in 0..AROUND {
        let next = (k + 1) % AROUND;
        for ring in (0..top - AROUND).step_by(AROUND as usize) {
            let [a, b, c, d] = [ring + k, ring + next, ring + AROUND + next, ring + AROUND + k];
            mesh.triangle.extend([[a, b, c], [a, c, d]]);
        }
        mesh.triangle.push([top - AROUND + k, top - AROUND + next, top]);
    }
    let mut pose = mesh.position.clone();
    pose.iter_mut().filter(|p| p[1] == 0.0 && p[2] < 0.0).for_each(|p| p[1] = 0.1);
    (mesh, pose)
}

/// The lid of the lifted skirt comes out above it. In the air over that piece is no inside, though the lid is closest and
/// shows its back. (Below, where the skirt itself shows its back, nothing says that it is not the inside of a body.)
#[test]
fn a_lid_that_cuts_through_the_mesh_makes_no_inside_in_the_air() {
    let (mesh, pose) = skirt();
    let closed = Closed::new(&mesh, &Topology::new(&mesh));
    assert_eq!(closed.topology.counts.open_edges, 0);
    for (position, crossing) in [(&mesh.position, false), (&pose, true)] {
        let position = closed.extend(position);
        let (triangle, topology) = (&closed.mesh.triangle, &closed.topology);
        let (bvh, naive) = (closed.bvh(&position), Bvh::build(&position, triangle, topology));
        let (mut inside, mut false_inside, mut lost, mut mended) = (0, 0, 0, 0);
        for i in 0..20_000 {
            let p = random_in(i, [-0.16, 0.1, -0.16], [0.16, 0.22, 0.16]);
            let winding = winding_number(&position, triangle, p);
            let sign = |bvh: &Bvh| bvh.closest(p, f64::INFINITY).unwrap().signed_distance < 0.0;
            inside += usize::from(winding > 0.5);
            false_inside += usize::from(winding < 0.5 && sign(&bvh));
            mended += usize::from(winding < 0.5 && sign(&naive) && !sign(&bvh));
            lost += usize::from(winding > 0.5 && sign(&naive) && !sign(&bvh));
        }
        println!("crossing {crossing}: {inside} inside, falsely {false_inside}, mended {mended}, lost {lost}");
        assert!(inside > 500 && false_inside == 0 && lost == 0);
        assert_eq!(mended > 200, crossing);
    }
}
