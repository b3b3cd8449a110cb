use crate::shapes::{cube, mesh, sphere, square, tube};
use pelage_geom::{Frame, Mesh, Pose, SurfacePoint, Topology, Vec3};

fn pose(m: &Mesh) -> (Topology, Pose) {
    let t = Topology::new(m);
    let p = Pose::new(m, &t, m.position.clone());
    check(m, &t, &p);
    (t, p)
}

fn vec(v: [f32; 3]) -> Vec3 {
    Vec3::from(v.map(f64::from))
}

/// Laws that hold on any mesh.
fn check(m: &Mesh, t: &Topology, p: &Pose) {
    for (v, n) in p.normal.iter().enumerate() {
        let used = !t.chart_vertices(t.weld[v]).is_empty();
        assert!((vec(*n).norm() - 1.0).abs() < 1e-6 || !used, "normal {v} {n:?}");
        assert_eq!(*n, p.normal[t.weld[v] as usize]);
    }
    for (k, d) in p.tangent.iter().enumerate() {
        let n = vec(p.normal[t.chart_vertex[k].vertex as usize]);
        assert!((vec(*d).norm() - 1.0).abs() < 1e-6 && vec(*d).dot(&n).abs() < 1e-6, "tangent {k} {d:?}");
    }
    for triangle in 0..m.triangle.len() as u32 {
        for bary in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0 / 3.0, 1.0 / 3.0], [0.5, 0.5]] {
            let f = p.frame(m, t, &SurfacePoint { triangle, bary });
            is_rotation(&f);
        }
    }
}

fn is_rotation(f: &Frame) {
    for (a, b, d) in
        [(f.n, f.n, 1.0), (f.du, f.du, 1.0), (f.dv, f.dv, 1.0), (f.n, f.du, 0.0), (f.n, f.dv, 0.0), (f.du, f.dv, 0.0)]
    {
        assert!((a.dot(&b) - d).abs() < 1e-12, "{f:?}");
    }
    assert!((f.n.cross(&f.du) - f.dv).norm() < 1e-12);
}

#[test]
fn a_plane_has_its_own_frame_exactly() {
    let m = square(4);
    let (t, p) = pose(&m);
    let f = p.frame(&m, &t, &SurfacePoint { triangle: 11, bary: [0.2, 0.3] });
    assert_eq!((f.n, f.du, f.dv), (Vec3::z(), Vec3::x(), Vec3::y()));
    assert!((f.origin - m.point(&SurfacePoint { triangle: 11, bary: [0.2, 0.3] })).norm() < 1e-15);
}

#[test]
fn a_tube_has_radial_normals_and_tangents_around_also_at_its_seam() {
    let m = tube(64, 4);
    let (t, p) = pose(&m);
    for (v, n) in p.normal.iter().enumerate() {
        let radial = Vec3::new(m.position[v][0], m.position[v][1], 0.0);
        assert!((vec(*n) - radial).norm() < 0.05);
    }
    for (k, d) in p.tangent.iter().enumerate() {
        let at = m.position[t.chart_vertex[k].vertex as usize];
        assert!((vec(*d) - Vec3::new(-at[1], at[0], 0.0)).norm() < 0.06, "{k}");
    }
}

#[test]
fn a_closed_sphere_has_radial_normals_at_poles_and_seams() {
    let m = sphere(48, 24, 1.0);
    let (_, p) = pose(&m);
    for (v, n) in p.normal.iter().enumerate() {
        let pole = m.position[v][2].abs() == 1.0;
        let allowed = if pole { 1e-6 } else { 0.07 };
        assert!((vec(*n) - Vec3::from(m.position[v])).norm() < allowed, "{v}");
    }
}

#[test]
fn frames_turn_with_the_skin() {
    let m = sphere(24, 12, 0.8);
    let (t, p) = pose(&m);
    // Quarter turn about z and a shift: exact in the coordinates.
    let turn = |v: [f64; 3]| [-v[1] + 5.0, v[0] - 1.0, v[2] + 2.0];
    let moved = Pose::new(&m, &t, m.position.iter().map(|&v| turn(v)).collect());
    let spin = |v: Vec3| Vec3::new(-v.y, v.x, v.z);
    for triangle in 0..m.triangle.len() as u32 {
        let at = SurfacePoint { triangle, bary: [0.3, 0.4] };
        let (a, b) = (p.frame(&m, &t, &at), moved.frame(&m, &t, &at));
        assert!((spin(a.n) - b.n).norm() + (spin(a.du) - b.du).norm() < 1e-5, "{triangle}");
    }
}

#[test]
fn a_mirrored_chart_has_its_own_direction_of_u() {
    let mut m = square(4);
    for uv in m.corner_uv.iter_mut().flatten() {
        uv[0] = uv[0].min(1.0 - uv[0]);
    }
    let (t, p) = pose(&m);
    for triangle in 0..m.triangle.len() as u32 {
        let f = p.frame(&m, &t, &SurfacePoint { triangle, bary: [0.3, 0.3] });
        let sign = if f.origin.x < 0.5 { 1.0 } else { -1.0 };
        assert_eq!((f.n, f.du), (Vec3::z(), Vec3::x() * sign));
    }
}

#[test]
fn tangents_spread_into_triangles_without_texture_area() {
    // The right half of the square has a single texture point on its rim with the left half.
    let mut m = square(8);
    for uv in m.corner_uv.iter_mut().flatten() {
        uv[0] = uv[0].min(0.5);
    }
    let (t, p) = pose(&m);
    assert_eq!(t.charts, 1);
    assert!(p.tangent.iter().all(|d| (vec(*d) - Vec3::x()).norm() < 1e-6));
    // The same with all its coordinates collapsed: a chart of its own that takes them over the seam.
    for tri in &mut m.corner_uv {
        if tri.iter().all(|c| c[0] == 0.5) {
            *tri = [[3.0, 3.0]; 3];
        }
    }
    let (t, p) = pose(&m);
    assert_eq!(t.charts, 2);
    assert!(p.tangent.iter().all(|d| (vec(*d) - Vec3::x()).norm() < 1e-6));
}

#[test]
fn anything_has_frames() {
    pose(&cube(3));
    pose(&Mesh::default());
    // All in one point; back to back; collinear beside sound.
    pose(&mesh(vec![[1.0; 3]; 4], &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], vec![[0, 1, 2], [2, 1, 3]]));
    let p = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [9.0; 3]];
    pose(&mesh(p.clone(), &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 0.0]], vec![[0, 1, 2], [1, 0, 2]]));
    pose(&mesh(p, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 0.0]], vec![[0, 1, 2], [0, 3, 1]]));
}
