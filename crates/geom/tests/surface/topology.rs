use crate::shapes::{cube, grid, mesh, sphere, square, tube};
use pelage_geom::topology::TopologyCounts;
use pelage_geom::{Mesh, NONE, Topology};

/// Laws that hold on any mesh.
fn check(mesh: &Mesh, t: &Topology) {
    assert_eq!(t.weld.len(), mesh.position.len());
    for (v, &w) in t.weld.iter().enumerate() {
        assert!(w as usize <= v && t.weld[w as usize] == w && mesh.position[w as usize] == mesh.position[v]);
    }
    for (k, tri) in mesh.triangle.iter().enumerate() {
        for i in 0..3 {
            let c = t.chart_vertex[t.corner[k][i] as usize];
            assert_eq!((c.vertex, c.chart), (t.weld[tri[i] as usize], t.chart[k]));
            assert_eq!(c.uv, mesh.corner_uv.get(k).map_or([0.0; 2], |uv| uv[i]));
            assert!(t.incident(t.corner[k][i] as usize).contains(&(3 * k as u32 + i as u32)));
            assert!(t.incident_welded(c.vertex).contains(&(3 * k as u32 + i as u32)));
            match t.across(k as u32, i) {
                Some((n, j)) => {
                    assert_eq!(t.across(n, j), Some((k as u32, i)));
                    assert_eq!(t.neighbour[k][i], n);
                }
                None => assert_eq!(t.neighbour[k][i], NONE),
            }
        }
    }
    let mut border = vec![false; t.chart_vertex.len()];
    for e in t.border_edges() {
        assert_eq!(t.chart_vertex[e[0] as usize].chart, t.chart_vertex[e[1] as usize].chart);
        border[e[0] as usize] = true;
        border[e[1] as usize] = true;
    }
    for (k, c) in t.chart_vertex.iter().enumerate() {
        assert_eq!(c.border, border[k]);
        assert!(t.chart_vertices(c.vertex).contains(&k));
    }
    let mut first_seen = 0;
    for &c in &t.chart {
        assert!(c <= first_seen, "charts are numbered by lowest triangle");
        first_seen += u32::from(c == first_seen);
    }
    assert_eq!(first_seen as usize, t.charts);
}

fn of(mesh: &Mesh) -> Topology {
    let t = Topology::new(mesh);
    check(mesh, &t);
    t
}

#[test]
fn a_square_has_one_chart_and_an_open_rim() {
    let m = square(4);
    let t = of(&m);
    assert_eq!((t.charts, t.chart_vertex.len()), (1, 25));
    assert_eq!(t.counts, TopologyCounts { open_edges: 16, ..TopologyCounts::default() });
    assert_eq!(t.chart_vertex.iter().filter(|c| c.border).count(), 16);
    assert!((t.area.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert_eq!(t.border_edges().len(), 16);
}

#[test]
fn a_tube_meets_itself_at_its_back_seam() {
    let (m, n) = (8, 3);
    let t = of(&tube(m, n));
    assert_eq!((t.charts, t.chart_vertex.len()), (1, (m + 1) * (n + 1)));
    assert_eq!(t.counts, TopologyCounts { open_edges: 2 * m, seam_edges: n, ..TopologyCounts::default() });
    for c in t.chart_vertex.iter().filter(|c| c.uv[0] == 0.0 || c.uv[0] == 1.0) {
        assert!(c.border);
        assert_eq!(t.chart_vertices(c.vertex).len(), 2);
    }
    assert_eq!(t.border_edges().len(), 2 * (m + n));
}

#[test]
fn a_sphere_with_collapsed_poles_is_one_chart_and_closed() {
    let (m, n) = (12, 8);
    let mesh = sphere(m, n, 1.0);
    let t = of(&mesh);
    let seams = n + 2 * (m - 1);
    let expected = TopologyCounts { zero_area: 2 * m, seam_edges: seams, ..TopologyCounts::default() };
    assert_eq!((t.counts, t.charts), (expected, 1));
    assert!(t.weld.iter().enumerate().filter(|(v, w)| *v == **w as usize).count() == m * (n - 1) + 2);
}

#[test]
fn collapsed_triangles_join_the_chart_that_they_touch() {
    // Where a pole row has texture coordinates of its own on every triangle, each collapsed triangle still joins.
    let t = of(&sphere(5, 3, 1.0));
    assert!(t.chart.iter().all(|&c| c == 0));
}

#[test]
fn mirrored_halves_are_charts_of_their_own() {
    // u folds back at x = 1/2: the right half is a mirror image of the left in the texture.
    let mut m = square(4);
    for uv in m.corner_uv.iter_mut().flatten() {
        uv[0] = uv[0].min(1.0 - uv[0]);
    }
    let t = of(&m);
    assert_eq!((t.charts, t.counts.mirrored, t.counts.seam_edges), (2, 16, 4));
    for (k, &c) in t.chart.iter().enumerate() {
        let right = m.corners(k as u32).iter().map(|p| p.x).sum::<f64>() > 1.5;
        assert_eq!(c == t.chart[2], !right ^ (m.corners(2).iter().map(|p| p.x).sum::<f64>() > 1.5));
    }
}

#[test]
fn flat_triangles_do_not_bridge_opposite_charts() {
    // Three strips in x: ordinary, collapsed to a line in the texture, mirrored.
    let mut m = grid(3, 2, |u, v| [3.0 * u, v, 0.0]);
    let fold = |u: f32| if u < 0.5 { (3.0 * u).min(1.0) } else { (3.0 - 3.0 * u).min(1.0) };
    for uv in m.corner_uv.iter_mut().flatten() {
        uv[0] = fold(uv[0]);
    }
    let t = of(&m);
    assert_eq!((t.charts, t.counts.zero_uv_area, t.counts.mirrored), (2, 4, 4));
    for k in 0..m.triangle.len() {
        let x = m.corners(k as u32).iter().map(|p| p.x).sum::<f64>() / 3.0;
        // Of the two triangles of a flat quad, one touches each side.
        assert_eq!(t.chart[k], u32::from(x > 1.5), "triangle {k}");
        assert_eq!(t.flat_uv[k], x > 1.0 && x < 2.0);
    }
    // Two diagonals, and where the halves of the upper and the lower quad meet.
    assert_eq!(t.counts.seam_edges, 3);
}

#[test]
fn rounding_of_text_files_does_not_make_charts() {
    // A column of the texture collapsed to a line that is jagged by less than a millionth.
    let mut m = square(16);
    let mut sign = 1.0;
    for uv in m.corner_uv.iter_mut().flatten() {
        if (0.3..0.6).contains(&uv[0]) {
            uv[0] = 0.5 + 2e-7 * sign;
            sign = -sign;
        }
    }
    let t = of(&m);
    assert!(t.counts.zero_uv_area > 0 && t.counts.mirrored == 0);
}

#[test]
fn without_texture_coordinates_charts_are_components() {
    assert_eq!(of(&cube(3)).counts.open_edges, 0);
    let mut m = cube(2);
    let t = of(&m);
    assert_eq!((t.charts, t.counts.seam_edges, t.counts.open_edges), (1, 0, 0));
    assert!(t.flat_uv.iter().all(|&f| f) && t.chart_vertex.iter().all(|c| !c.border));
    assert_eq!(t.chart_vertex.len(), 26);
    let base = m.position.len() as u32;
    m.position.extend([[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]]);
    m.triangle.push([base, base + 1, base + 2]);
    assert_eq!(of(&m).charts, 2);
}

#[test]
fn minus_zero_welds_to_zero() {
    let m = mesh(
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 0.0, -0.0], [1.0, -0.0, 0.0], [0.0, -1.0, 0.0]],
        &[],
        vec![[0, 1, 2], [4, 3, 5]],
    );
    let t = of(&m);
    assert_eq!((t.weld.clone(), t.counts.open_edges), (vec![0, 1, 2, 0, 1, 5], 4));
}

#[test]
fn odd_edges_are_counted_and_nothing_panics() {
    let p = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [7.0; 3]];
    // Three triangles on one edge.
    let t = of(&mesh(p.clone(), &[], vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]));
    assert_eq!((t.counts.non_manifold_edges, t.counts.open_edges, t.charts), (1, 6, 3));
    // Two that run the same way.
    let t = of(&mesh(p.clone(), &[], vec![[0, 1, 2], [0, 1, 3]]));
    assert_eq!((t.counts.non_manifold_edges, t.charts), (1, 2));
    // Two glued back to back along all edges.
    let t = of(&mesh(p.clone(), &[], vec![[0, 1, 2], [1, 0, 2]]));
    assert_eq!((t.counts.open_edges, t.neighbour.clone(), t.charts), (0, vec![[1; 3], [0; 3]], 1));
    // Repeated vertices, in triangles of one and of two points, between sound ones.
    let m = mesh(p, &[], vec![[0, 1, 2], [0, 0, 1], [1, 0, 3], [4, 4, 4], [1, 1, 0]]);
    let t = of(&m);
    assert_eq!((t.neighbour[0][0], t.neighbour[1], t.counts.zero_area), (2, [NONE; 3], 3));
    assert_eq!(t.chart, vec![0, 0, 0, 1, 0]);
    of(&Mesh::default());
    assert_eq!(Topology::new(&mesh(vec![[f64::NAN; 3]; 3], &[], vec![[0, 1, 2]])).charts, 1);
}
