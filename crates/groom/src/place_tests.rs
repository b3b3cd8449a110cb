use super::*;
use crate::interpolate::{Blend, interpolate, pose_controls, root_positions};
use crate::test_skin::TestSkin;
use pelage_geom::{Map, Offsets, Wrap, rng::uniform};

fn settings(placement: Placement<'_>) -> PlaceSettings<'_> {
    PlaceSettings { placement, length: 3.0, ..PlaceSettings::default() }
}

fn random_roots(s: &TestSkin, n: u64) -> Vec<SurfacePoint> {
    let t = |i| (uniform(1, i, 2, 0) * s.mesh.triangle.len() as f64) as u32;
    (0..n).map(|i| SurfacePoint { triangle: t(i), bary: [0.3, 0.2 + 0.3 * uniform(1, i, 2, 1) as f32] }).collect()
}

/// Hairs that go up and along x, different everywhere, with roots off the skin.
fn drawn(s: &TestSkin, n: u64, off: f64) -> Strands {
    let roots = random_roots(s, n);
    let mut out = Strands { offsets: Offsets::uniform(n as usize, 6), origin: [1.0, 2.0, 3.0], ..Strands::default() };
    for (i, r) in roots.iter().enumerate() {
        let f = s.skin().frame(r);
        let curl = uniform(1, i as u64, 2, 2);
        for k in 0..6 {
            let t = f64::from(k);
            let p = f.origin + f.n * (off + 0.5 * t) + Vec3::new(0.1 * t * t * curl, 0.0, 0.1 * t);
            let p = p - Vec3::from(out.origin);
            out.position.push([p.x as f32, p.y as f32, p.z as f32]);
        }
    }
    out
}

#[test]
fn every_border_vertex_has_one_hair_and_a_site_in_each_chart() {
    let s = TestSkin::new(24, 12, 1.0);
    let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(Placement::Grid { u: 6, v: 5, even: false }));
    // Two meridians of 11 inner vertices and the poles.
    assert_eq!(counts.border, 24);
    assert!(hairs.border[..24].iter().all(|&b| b) && hairs.border[24..].iter().all(|&b| !b));
    assert_eq!(counts.inner + counts.dropped + counts.outside, 2 * 6 * 5);
    assert_eq!(hairs.len(), counts.border + counts.inner);
    let mut seen: Vec<(u32, [u32; 2])> = Vec::new();
    for cv in s.topology.chart_vertex.iter().filter(|cv| cv.border) {
        let k = (0..sites.len()).find(|&k| sites.chart[k] == cv.chart && sites.uv[k] == cv.uv).unwrap();
        seen.push((cv.vertex, sites.hair[k]));
        let at = Vec3::from(s.mesh.position[cv.vertex as usize]);
        assert!((s.mesh.point(&hairs.root[sites.hair[k][0] as usize]) - at).norm() < 1e-9);
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 24, "one hair a border vertex");
}

#[test]
fn default_hairs_stand_along_the_normal_with_the_length_of_the_map() {
    let s = TestSkin::new(24, 12, 1.0);
    let map = TiledMap {
        tiles: vec![(0, Map { width: 2, height: 1, channels: 1, data: vec![0.0, 2.0] })],
        wrap: Wrap::Clamp,
    };
    let with = PlaceSettings { length_map: Some(&map), ..settings(Placement::Grid { u: 5, v: 5, even: false }) };
    let (hairs, _, _) = place(&s.skin(), &s.bvh, &with);
    for h in 0..hairs.len() {
        let expected = 3.0 * f64::from(map.value(s.mesh.uv(&hairs.root[h]))).max(1e-3);
        assert!((hairs.length(h) - expected).abs() < 1e-5 * expected);
        assert!(hairs.hair(h).iter().all(|p| p[1] == 0.0 && p[2] == 0.0 && p[0] >= 0.0));
    }
}

#[test]
fn inner_hairs_keep_their_distance_from_the_border() {
    let s = TestSkin::new(48, 24, 0.5);
    let roots = random_roots(&s, 500);
    let density = 0.4;
    let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(Placement::PerArea { density, root: &roots }));
    assert_eq!(counts.inner + counts.dropped, 500);
    assert!(counts.dropped > 5 && counts.dropped < 100, "{}", counts.dropped);
    let at = |h: usize| s.mesh.point(&hairs.root[h]);
    for h in counts.border..hairs.len() {
        let nearest = (0..counts.border).map(|b| (at(h) - at(b)).norm()).fold(f64::MAX, f64::min);
        assert!(nearest > BORDER_GAP / density.sqrt());
    }
    assert_eq!(sites.hair[sites.len() - 1], [hairs.len() as u32 - 1; 2]);
}

#[test]
fn drawn_hairs_keep_their_shape_and_are_moved_onto_the_skin() {
    let s = TestSkin::new(24, 12, 0.5);
    let mut curves = drawn(&s, 60, -0.3);
    for k in 12..18 {
        curves.position[k] = curves.position[12];
    }
    let with = PlaceSettings { points: 6, ..settings(Placement::Curves { drawn: &curves, spacing: 0.0 }) };
    let (hairs, _, counts) = place(&s.skin(), &s.bvh, &with);
    assert_eq!((counts.skipped_short, counts.inner), (1, 59));
    assert!(counts.bind_max <= 0.3 + 1e-6 && counts.bind_mean > 0.2, "{counts:?}");
    for (h, strand) in (counts.border..hairs.len()).zip((0..60).filter(|&i| i != 2)) {
        let line = crate::comb::world_points(&s.skin().frame(&hairs.root[h]), hairs.hair(h));
        let source: Vec<Vec3> = curves.points(strand).iter().map(|&p| vec3(p)).collect();
        for (a, b) in line.iter().zip(resample(&source, 6)) {
            assert!(((a - line[0]) - (b - source[0])).norm() < 1e-5);
        }
    }
    // Border hairs lie between drawn ones: as long, outward.
    for h in 0..counts.border {
        assert!((1.5..6.0).contains(&hairs.length(h)) && hairs.hair(h)[1][0] > 0.2, "{:?}", hairs.hair(h));
    }
}

#[test]
fn near_drawn_hairs_are_thinned() {
    let s = TestSkin::new(24, 12, 0.5);
    let curves = drawn(&s, 300, 0.1);
    let (hairs, _, counts) = place(&s.skin(), &s.bvh, &settings(Placement::Curves { drawn: &curves, spacing: 1.5 }));
    assert_eq!(counts.inner + counts.dropped, 300);
    let at: Vec<Vec3> = hairs.root.iter().map(|r| s.mesh.point(r)).collect();
    for h in counts.border..hairs.len() {
        assert!((0..h).all(|o| (at[h] - at[o]).norm() > 1.5));
    }
}

/// The seam step: a hair on a seam gets the same direction from the controls of either chart, in any pose.
#[test]
fn directions_agree_across_seams_in_every_pose() {
    let s = TestSkin::new(24, 12, 1.0);
    let curves = drawn(&s, 200, 0.1);
    let with = PlaceSettings { points: 6, ..settings(Placement::Curves { drawn: &curves, spacing: 0.5 }) };
    let (hairs, sites, _) = place(&s.skin(), &s.bvh, &with);
    let edge = |e: &[u32; 2]| e.map(|k| sites.hair[k as usize][0]);
    let mut tested = 0;
    for shear in [0.0, 0.7] {
        let pose = s.posed(|p| Vec3::new(p.x + shear * p.y, p.y * (1.0 + shear), p.z - shear * p.x * p.x * 0.1));
        let controls = pose_controls(&hairs, &s.mesh, &s.topology, &pose, 6);
        for a in &sites.border_edges {
            let chart = sites.chart[a[0] as usize];
            if chart != 0 {
                continue;
            }
            // The same edge seen from the other chart runs the other way.
            let b = sites
                .border_edges
                .iter()
                .find(|b| sites.chart[b[0] as usize] != chart && edge(b) == [edge(a)[1], edge(a)[0]])
                .expect("the seam has two sides");
            let inner = |chart: u32| (0..sites.len()).rfind(|&k| sites.chart[k] == chart).unwrap();
            let third = [inner(0), inner(1)].map(|k| sites.hair[k][0]);
            let t = uniform(3, tested, 4, 0) as f32;
            let corner = [[edge(a)[0], edge(a)[1], third[0]], [edge(b)[0], third[1], edge(b)[1]]];
            let weight = [[1.0 - t, t, 0.0], [t, 0.0, 1.0 - t]];
            let blend = Blend { root: &[[0.0; 3]; 2], hair: &corner, weight: &weight, length: &[5.0; 2] };
            let mut out = [[0.0; 3]; 12];
            interpolate(&blend, &controls, &mut out);
            for k in 0..5 {
                let [p, q] = [k, k + 6].map(|k| (vec3(out[k + 1]) - vec3(out[k])).normalize());
                assert!(p.cross(&q).norm() < 1e-5 && p.dot(&q) > 0.0);
            }
            tested += 1;
        }
    }
    assert_eq!(tested, 2 * 24);
}

/// A rigid motion of the skin carries the hairs along.
#[test]
fn hairs_ride_a_rigid_motion() {
    let s = TestSkin::new(24, 12, 1.0);
    let curves = drawn(&s, 100, 0.1);
    let (hairs, _, counts) = place(&s.skin(), &s.bvh, &settings(Placement::Curves { drawn: &curves, spacing: 0.5 }));
    let axis = Vec3::new(1.0, -2.0, 0.5).normalize();
    let shift = Vec3::new(1000.0, -500.0, 20.0);
    let turn = |p: Vec3| crate::comb::rotate(p, axis, 1.1);
    let roots = random_roots(&s, 50);
    let n = counts.inner as u64;
    let pick = |i: u64, k| counts.border as u32 + (uniform(5, i, 6, k) * n as f64) as u32;
    let hair: Vec<[u32; 3]> = (0..50).map(|i| [pick(i, 0), pick(i, 1), pick(i, 2)]).collect();
    let run = |pose: &pelage_geom::Pose, origin: Vec3| {
        let controls = pose_controls(&hairs, &s.mesh, &s.topology, pose, 12);
        let root = root_positions(&s.mesh, pose, &roots, origin.into());
        for (r, p) in root.iter().zip(&roots) {
            let at = p.blend(pelage_geom::mesh::corners(&pose.position, s.mesh.triangle[p.triangle as usize]));
            assert!((vec3(*r) + origin - at).norm() < 1e-5);
        }
        let mut out = vec![[0.0; 3]; 50 * 12];
        let blend = Blend { root: &root, hair: &hair, weight: &[[0.3, 0.2, 0.5]; 50], length: &[4.0; 50] };
        interpolate(&blend, &controls, &mut out);
        out
    };
    let still = run(&s.rest, Vec3::zeros());
    let moved = run(&s.posed(|p| turn(p) + shift), shift);
    for (a, b) in still.iter().zip(&moved) {
        assert!((turn(vec3(*a)) - vec3(*b)).norm() < 1e-5 * 10.0, "{a:?} {b:?}");
    }
}

/// A point of the round skin by longitude, at latitude 30 degrees.
fn on(a: f64) -> Vec3 {
    let a = a.to_radians();
    Vec3::new(libm::cos(a) * 0.75f64.sqrt(), 0.5, -libm::sin(a) * 0.75f64.sqrt()) * 10.0
}

#[test]
fn hairs_along_a_line_stand_at_equal_steps_between_its_ends() {
    let s = TestSkin::new(96, 48, 0.0);
    let arc = |from: f64, to: f64| (0..=40).map(|k| on(from + (to - from) * f64::from(k) / 40.0)).collect();
    let lines = [
        Line { points: arc(30.0, 150.0), count: 9 },
        Line { points: arc(200.0, 240.0), count: 1 },
        Line { points: arc(200.0, 240.0), count: 0 },
        Line { points: vec![on(20.0)], count: 3 },
    ];
    let with = PlaceSettings { lines: &lines, ..settings(Placement::None) };
    let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &with);
    assert_eq!((counts.inner, counts.on_lines, counts.lines_skipped, counts.lines_cut_short), (0, 10, 1, 0));
    assert_eq!(hairs.len(), counts.border + 10);
    let at = |k: usize| s.mesh.point(&hairs.root[counts.border + k]);
    for k in 0..9 {
        assert!((at(k) - on(30.0 + 15.0 * k as f64)).norm() < 0.02, "{k}");
    }
    assert!((at(9) - on(220.0)).norm() < 0.02);
    for h in counts.border..hairs.len() {
        let k = (0..sites.len()).find(|&k| sites.hair[k] == [h as u32; 2]).unwrap();
        assert_eq!(sites.chart[k], s.topology.chart[hairs.root[h].triangle as usize]);
        assert_eq!(sites.uv[k], s.mesh.uv(&hairs.root[h]));
    }
    // Besides a placement, whose hairs keep away from them.
    let with = PlaceSettings { lines: &lines, ..settings(Placement::Grid { u: 9, v: 60, even: true }) };
    let (hairs, _, counts) = place(&s.skin(), &s.bvh, &with);
    let plain = place(&s.skin(), &s.bvh, &settings(with.placement)).2;
    assert!(counts.on_lines == 10 && counts.dropped > plain.dropped);
    assert_eq!(counts.inner + counts.dropped, plain.inner + plain.dropped);
    let gap = BORDER_GAP * (s.topology.area.iter().sum::<f64>() / 1080.0).sqrt();
    for h in counts.border + 10..hairs.len() {
        assert!((0..10).all(|k| (s.mesh.point(&hairs.root[h]) - at(k)).norm() > 0.99 * gap));
    }
}

#[test]
fn hairs_placed_one_by_one_have_their_roots_shapes_and_numbers() {
    let s = TestSkin::new(24, 12, 0.5);
    let hook = vec![Vec3::new(50.0, 1.0, 2.0), Vec3::new(51.0, 1.0, 2.0), Vec3::new(51.0, 3.0, 2.0)];
    let nan = Vec3::new(f64::NAN, 0.0, 0.0);
    let single = [
        Single { at: on(40.0) * 1.1, line: Some(hook.clone()) },
        Single { at: nan, line: None },
        Single { at: on(60.0), line: None },
        Single { at: on(60.0), line: Some(vec![nan, on(1.0)]) },
        Single { at: on(70.0), line: Some(vec![]) },
    ];
    let curves = drawn(&s, 60, 0.1);
    for placement in [
        Placement::None,
        Placement::Grid { u: 30, v: 30, even: false },
        Placement::Curves { drawn: &curves, spacing: 0.5 },
    ] {
        let with = PlaceSettings { single: &single, ..settings(placement) };
        let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &with);
        assert_eq!((counts.single, counts.single_skipped, counts.single_straight), (4, 1, 2));
        let b = counts.border;
        let expected = |h: usize| if (b..b + 4).contains(&h) { [0, 2, 3, 4][h - b] } else { NONE };
        assert!((0..hairs.len()).all(|h| hairs.single[h] == expected(h)));
        assert_eq!(hairs.root[b], s.bvh.closest(single[0].at, f64::INFINITY).unwrap().point);
        let line: Vec<Vec3> = hairs.placed(b, &s.skin().frame(&hairs.root[b])).collect();
        for (p, q) in line.iter().zip(resample(&hook, 4)) {
            assert!(((p - line[0]) - (q - hook[0])).norm() < 1e-5);
        }
        for h in b + 1..b + 4 {
            assert_eq!((hairs.hair(h)[3], hairs.root[b + 1]), ([3.0, 0.0, 0.0], hairs.root[b + 2]));
        }
        // Two at one place are one site of the triangulation.
        let mirrored = crate::triangulate::mirrored_charts(&s.mesh, &s.topology);
        let net = crate::triangulate::triangulate(&sites, &mirrored);
        assert_eq!((net.counts.duplicates, net.counts.crossing), (1, 0));
        assert!(!net.triangle.is_empty());
        assert!(!matches!(placement, Placement::Grid { .. }) || counts.dropped > 0);
    }
}

#[test]
fn only_inner_hairs_give_way() {
    let s = TestSkin::new(24, 12, 0.5);
    let roots = random_roots(&s, 100);
    let lines = [Line { points: vec![on(30.0), on(60.0)], count: 4 }];
    let single = [Single { at: on(100.0), line: None }];
    let placement = Placement::PerArea { density: 0.1, root: &roots };
    let [still, moved] = [0, 10].map(|relax| {
        place(&s.skin(), &s.bvh, &PlaceSettings { relax, lines: &lines, single: &single, ..settings(placement) })
    });
    assert_eq!(still.2, moved.2);
    let fixed = still.2.border + 5;
    assert_eq!(still.0.root[..fixed], moved.0.root[..fixed]);
    assert!((fixed..still.0.len()).filter(|&h| still.0.root[h] != moved.0.root[h]).count() > 50);
    let k = moved.1.len() - 1;
    assert_eq!(moved.1.uv[k], s.mesh.uv(&moved.0.root[moved.0.len() - 1]));
    // Drawn ones stay where they were drawn.
    let curves = drawn(&s, 60, 0.1);
    let placement = Placement::Curves { drawn: &curves, spacing: 0.5 };
    let [still, moved] = [0, 10].map(|relax| place(&s.skin(), &s.bvh, &PlaceSettings { relax, ..settings(placement) }));
    assert!(still == moved);
}
