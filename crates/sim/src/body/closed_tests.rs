use super::super::testing::*;
use super::super::{Field, FieldSettings};
use super::*;
use pelage_geom::Bvh;
use pelage_geom::shapes::{bust, cube_sphere, plane};

fn field(mesh: &Mesh, topology: &Topology) -> (Field, Bvh) {
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, topology);
    let settings = FieldSettings { voxel: 0.004, outside: 0.02, inside: 0.01 };
    (Field::build(&mesh.position, &mesh.triangle, topology, &bvh, &settings, None), bvh)
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

#[test]
fn an_open_head_is_outside_behind_its_rim() {
    let (open, _) = cut(-0.05);
    let topology = Topology::new(&open);
    let (field, _) = field(&open, &topology);
    assert!(field.open_edges > 20);
    for i in 0..10_000 {
        let p = random_in(i, [-0.12, -0.12, -0.12], [0.12, -0.065, 0.12]);
        assert!(field.sample(p).distance > 0.0, "{p}");
    }
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
