//! Laws of candidates and instancing: counts, nesting, locality, evenness, independence of threads.

use pelage_geom::{Map, Mesh, SurfacePoint, TiledMap, Topology, Vec3, Wrap, rng};
use pelage_groom::candidates::{Candidates, candidates, strand_id};
use pelage_groom::control::Sites;
use pelage_groom::instance::{Density, Feature, colour_column, feature_column, is_guard, roots, scale_guards, weights};
use pelage_groom::triangulate::triangulate;

/// A grid of n x n cells over [0, 1]^2, bent by `shape`, with texture coordinates from `uv`.
fn sheet(n: usize, shape: impl Fn(f64, f64) -> [f64; 3], uv: impl Fn(f64, f64) -> [f32; 2]) -> Mesh {
    let at = |k: usize| k as f64 / n as f64;
    let mut m = Mesh::default();
    (0..=n).for_each(|j| (0..=n).for_each(|i| m.position.push(shape(at(i), at(j)))));
    for j in 0..n {
        for i in 0..n {
            let v = |i: usize, j: usize| (j * (n + 1) + i) as u32;
            for q in [[(i, j), (i + 1, j), (i + 1, j + 1)], [(i, j), (i + 1, j + 1), (i, j + 1)]] {
                m.triangle.push(q.map(|(i, j)| v(i, j)));
                m.corner_uv.push(q.map(|(i, j)| uv(at(i), at(j))));
                m.face.push((j * n + i) as u32);
            }
        }
    }
    m
}

fn flat(n: usize) -> Mesh {
    sheet(n, |x, y| [x, y, 0.0], |x, y| [x as f32, y as f32])
}

/// A closed sphere of radius 1 without texture coordinates.
fn sphere(n: usize) -> Mesh {
    let mut m = Mesh::default();
    for side in 0..6 {
        let (a, s) = (side % 3, if side < 3 { 1.0 } else { -1.0 });
        let part = sheet(
            n,
            |x, y| {
                let mut p = Vec3::zeros();
                (p[a], p[(a + 1) % 3], p[(a + 2) % 3]) = (s, s * (2.0 * x - 1.0), 2.0 * y - 1.0);
                p.normalize().into()
            },
            |_, _| [0.0; 2],
        );
        let base = m.position.len() as u32;
        m.position.extend(part.position);
        m.triangle.extend(part.triangle.iter().map(|t| t.map(|v| v + base)));
    }
    m
}

fn all(mesh: &Mesh, count: usize) -> Candidates {
    candidates(mesh, &Topology::new(mesh), 7, count, &mut |_| true).unwrap()
}

fn map(n: usize, f: impl Fn(f64, f64) -> f64) -> TiledMap {
    let at = |k: usize| (k as f64 + 0.5) / n as f64;
    let data = (0..n * n).map(|k| f(at(k % n), at(k / n)) as f32).collect();
    TiledMap { tiles: vec![(0, Map { width: n, height: n, channels: 1, data })], wrap: Wrap::Clamp }
}

/// Mean distance to the nearest neighbour over that of a hexagonal lattice of the same density.
fn evenness(mesh: &Mesh, root: &[SurfacePoint], area: f64) -> f64 {
    let mut p: Vec<Vec3> = root.iter().map(|r| mesh.point(r)).collect();
    p.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut sum = 0.0;
    for (i, q) in p.iter().enumerate() {
        let mut best = f64::INFINITY;
        for dir in [1, -1i64] {
            let mut k = i as i64 + dir;
            while let Some(o) = usize::try_from(k).ok().and_then(|k| p.get(k)) {
                if (o.x - q.x).powi(2) >= best {
                    break;
                }
                best = best.min((o - q).norm_squared());
                k += dir;
            }
        }
        sum += best.sqrt();
    }
    let rho = root.len() as f64 / area;
    sum / root.len() as f64 / (2.0 / (3f64.sqrt() * rho)).sqrt()
}

#[test]
fn every_beginning_is_even_and_irregular() {
    for mesh in [flat(1), flat(50), sphere(24)] {
        let c = all(&mesh, 20_000);
        for part in [10, 14, 20, 28, 40, 55, 75, 100] {
            let n = 20_000 * part / 100;
            let e = evenness(&mesh, &c.root[..n], c.area);
            // Random points have 0.47, a square lattice 0.93, a hexagonal one 1.
            assert!(e > 0.7 && e < 0.85, "{part} %: {e}");
        }
    }
}

#[test]
fn hairs_neither_line_up_along_an_open_edge_nor_shun_it() {
    let mesh = flat(10);
    let c = all(&mesh, 40_000);
    for n in [10_000, 25_000, 40_000] {
        let spacing = 1.0 / (n as f64).sqrt();
        let edge = |r: &SurfacePoint| {
            let p = mesh.point(r);
            p.x.min(1.0 - p.x).min(p.y).min(1.0 - p.y)
        };
        // Hairs within a distance of the edge, over those of an equal share.
        let share = |d: f64| {
            let strip = 1.0 - (1.0 - 2.0 * d * spacing).powi(2);
            c.root[..n].iter().filter(|r| edge(r) < d * spacing).count() as f64 / (n as f64 * strip)
        };
        let (row, strip) = (share(0.125), share(1.0));
        assert!(row < 0.6 && strip > 0.9 && strip < 1.15, "{row} {strip}");
    }
}

#[test]
fn asking_for_more_only_appends_whatever_the_threads() {
    let mesh = sphere(10);
    let many = all(&mesh, 9_000);
    for n in [0, 1, 2, 17, 1000, 4097] {
        assert_eq!(all(&mesh, n).root, many.root[..n]);
    }
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| all(&mesh, 9_000)), many);
    }
    assert_ne!(candidates(&mesh, &Topology::new(&mesh), 8, 100, &mut |_| true).unwrap().root, many.root[..100]);
}

#[test]
fn candidates_stop_when_told_and_need_area() {
    let mut calls = 0;
    let mesh = flat(3);
    let stopped = candidates(&mesh, &Topology::new(&mesh), 1, 100_000, &mut |n| {
        calls += 1;
        n < 500
    });
    assert!(stopped.is_none() && calls > 2);
    let mut mesh = flat(1);
    mesh.position.iter_mut().for_each(|p| p[1] = 0.0);
    assert_eq!(all(&mesh, 10).root.len(), 0);
    // Triangles without area, or with positions that are not numbers, carry nothing.
    let mut mesh = flat(2);
    mesh.position[4] = [f64::NAN; 3];
    let c = all(&mesh, 50);
    assert!(c.root.iter().all(|r| mesh.triangle[r.triangle as usize].iter().all(|&v| v != 4)));
    assert_eq!((c.root.len(), c.area), (50, 0.25));
}

#[test]
fn parts_of_the_skin_get_their_share() {
    let mesh = sphere(20);
    let c = all(&mesh, 40_000);
    for trial in 0..40 {
        let dir = Vec3::from_fn(|i, _| rng::uniform(3, trial, 0, i as u64) - 0.5).normalize();
        let edge = 1.6 * rng::uniform(3, trial, 1, 0) - 0.8;
        // A cap of whole triangles.
        let on: Vec<bool> = (0..mesh.triangle.len() as u32)
            .map(|t| mesh.corners(t).iter().sum::<Vec3>().dot(&dir) / 3.0 > edge)
            .collect();
        let area: f64 = (0..on.len()).filter(|&t| on[t]).map(|t| mesh.area(t as u32)).sum();
        for n in [9_000, 17_000, 40_000] {
            let want = n as f64 * area / c.area;
            let got = c.root[..n].iter().filter(|r| on[r.triangle as usize]).count() as f64;
            // An error of the border's stretches alone, not of the area's.
            assert!((got - want).abs() < 0.4 * want.sqrt(), "{got} of {want}");
        }
    }
}

/// Two charts of very different size in space, side by side in texture space: u below 0.5 is 100 times as large.
fn two_charts() -> Mesh {
    let mut m = sheet(12, |x, y| [10.0 * x, 10.0 * y, 0.0], |x, y| [0.45 * x as f32, y as f32]);
    let small = sheet(12, |x, y| [20.0 + x, y, 0.5 * x * x], |x, y| [(0.55 + 0.45 * x) as f32, y as f32]);
    let base = m.position.len() as u32;
    m.position.extend(small.position);
    m.triangle.extend(small.triangle.iter().map(|t| t.map(|v| v + base)));
    m.corner_uv.extend(small.corner_uv);
    m.face.extend(small.face);
    m
}

#[test]
fn counts_are_the_integral_of_density_for_any_map_resolution_and_chart_size() {
    let mesh = two_charts();
    let topology = Topology::new(&mesh);
    assert_eq!(topology.charts, 2);
    let wave = |u: f64, v: f64| 0.55 + 0.45 * libm::sin(8.0 * u) * libm::cos(5.0 * v);
    let c = all(&mesh, 60_000);
    let mut last: Option<f64> = None;
    for n in [64, 256, 1024] {
        let image = map(n, wave);
        // The integral by many points of each triangle.
        let integral: f64 = (0..mesh.triangle.len() as u32)
            .map(|t| {
                let k = 24;
                let mut sum = 0.0;
                for i in 0..k {
                    for j in 0..k {
                        let (mut b, mut d) = ((f64::from(i) + 0.5) / f64::from(k), (f64::from(j) + 0.5) / f64::from(k));
                        if b + d > 1.0 {
                            (b, d) = (1.0 - b, 1.0 - d);
                        }
                        let p = SurfacePoint { triangle: t, bary: [b as f32, d as f32] };
                        sum += f64::from(image.value(mesh.uv(&p)));
                    }
                }
                sum / f64::from(k * k) * mesh.area(t)
            })
            .sum();
        let density = Density { value: 20_000.0 / integral, map: Some(&image), on_off: None };
        assert!(density.needed_candidates(c.area) <= c.root.len());
        let got = roots(&mesh, &topology, &c, &density, 1).root.len() as f64;
        assert!((got / 20_000.0 - 1.0).abs() < 0.005, "{n}: {got}");
        assert!(last.is_none_or(|l| (l / got - 1.0).abs() < 0.005));
        last = Some(got);
    }
    let density = Density { value: 50_000.0 / c.area, map: None, on_off: None };
    let r = roots(&mesh, &topology, &c, &density, 1);
    assert_eq!(r.root.len(), 50_000);
    for chart in 0..2u32 {
        let area: f64 =
            (0..topology.area.len()).filter(|&t| topology.chart[t] == chart).map(|t| topology.area[t]).sum();
        let got = r.chart.iter().filter(|&&k| k == chart).count() as f64;
        assert!((got - area * density.value).abs() < 12.0, "chart {chart}: {got} of {}", area * density.value);
    }
}

#[test]
fn a_higher_value_keeps_every_hair() {
    let mesh = two_charts();
    let topology = Topology::new(&mesh);
    let c = all(&mesh, 30_000);
    let (image, on) = (map(64, |u, v| u * v + 0.1), map(64, |u, _| if u < 0.3 { 3.0 } else { 0.4 }));
    let make = |value: f64| roots(&mesh, &topology, &c, &Density { value, map: Some(&image), on_off: Some(&on) }, 5);
    let (few, many) = (make(100.0), make(200.0));
    assert!(few.id.len() > 1000 && many.id.len() > 3 * few.id.len() / 2);
    for (k, id) in few.id.iter().enumerate() {
        let j = many.id.binary_search(id).expect("a hair was lost");
        assert_eq!((few.root[k], few.uv[k], few.chart[k]), (many.root[j], many.uv[j], many.chart[j]));
    }
    assert_eq!(strand_id(5, 3), (5 << 32) | 3);
}

#[test]
fn an_edit_changes_only_hairs_under_its_texels_and_their_footprint() {
    let mesh = flat(8);
    let topology = Topology::new(&mesh);
    let c = all(&mesh, 60_000);
    let before = map(1024, |u, v| 0.5 + 0.3 * libm::sin(30.0 * u + 10.0 * v));
    let mut after = before.clone();
    let (i0, j0) = (400, 620);
    for j in j0..j0 + 32 {
        (i0..i0 + 32).for_each(|i| after.tiles[0].1.data[j * 1024 + i] = 1.0);
    }
    let near = |uv: [f32; 2]| {
        let t = [f64::from(uv[0]) * 1024.0, f64::from(uv[1]) * 1024.0];
        let within = |x: f64, low: usize| x > low as f64 - 0.5 && x < low as f64 + 32.5;
        within(t[0], i0) && within(t[1], j0)
    };
    let density = |m| Density { value: 60_000.0, map: Some(m), on_off: None };
    let [a, b] = [&before, &after].map(|m| roots(&mesh, &topology, &c, &density(m), 0));
    let outside = |r: &pelage_groom::instance::Roots| -> Vec<(u64, SurfacePoint)> {
        (0..r.id.len()).filter(|&k| !near(r.uv[k])).map(|k| (r.id[k], r.root[k])).collect()
    };
    assert_eq!(outside(&a), outside(&b));
    assert!(b.id.len() > a.id.len() + 10);
    // Features: the same hairs keep their values.
    let feature = |m| Feature { value: 3.0, map: Some(m), noise: 0.2, channel: rng::channel("length") };
    let [fa, fb] = [&before, &after].map(|m| feature_column(&a, &feature(m), 0));
    assert!((0..fa.len()).all(|k| near(a.uv[k]) || fa[k] == fb[k]));
    assert!(fa != fb);
}

#[test]
fn features_follow_value_map_and_noise() {
    let mesh = flat(2);
    let topology = Topology::new(&mesh);
    let r = roots(&mesh, &topology, &all(&mesh, 5000), &Density { value: 5000.0, ..Density::default() }, 2);
    assert_eq!(r.id.len(), 5000);
    assert!(feature_column(&r, &Feature { value: 4.0, ..Feature::default() }, 1).iter().all(|&x| x == 4.0));
    let half = map(4, |_, _| 0.5);
    let noisy = Feature { value: 4.0, map: Some(&half), noise: 0.25, channel: 9 };
    let v = feature_column(&r, &noisy, 1);
    assert!(v.iter().all(|&x| (1.5..=2.5).contains(&x)));
    let mean = v.iter().sum::<f32>() / 5000.0;
    assert!((mean - 2.0).abs() < 0.02, "{mean}");
    assert!(feature_column(&r, &Feature { noise: 3.0, ..noisy }, 1).iter().all(|&x| x >= 0.0));
    let grey = colour_column(&r, [1.0, 0.5, 0.0], Some(&half), 0.0, 9, 1);
    assert!(grey.iter().all(|&x| x == [0.5, 0.25, 0.0]));
    let varied = colour_column(&r, [1.0; 3], None, 0.5, 9, 1);
    assert!(varied.iter().all(|x| x[0] == x[1] && x[1] == x[2] && (0.5..=1.5).contains(&x[0])));
    assert!(varied[0] != varied[1]);
}

#[test]
fn guard_hairs_are_a_share_of_all_and_more_share_only_adds() {
    let mesh = flat(2);
    let topology = Topology::new(&mesh);
    let r = roots(&mesh, &topology, &all(&mesh, 20_000), &Density { value: 20_000.0, ..Density::default() }, 2);
    let n = r.id.len();
    let plain = feature_column(&r, &Feature { value: 4.0, noise: 0.3, channel: 9, ..Feature::default() }, 1);
    let mut before = vec![false; n];
    for share in [0.0, 0.02, 0.1, 0.5, 1.0] {
        let guard: Vec<bool> = r.id.iter().map(|id| is_guard(*id, share, 1)).collect();
        assert!(before.iter().zip(&guard).all(|(b, g)| !b || *g), "a share of {share} lost a guard hair");
        // Binomial: five standard deviations.
        let found = guard.iter().filter(|g| **g).count() as f64;
        assert!(
            (found - share * n as f64).abs() <= 5.0 * (share * (1.0 - share) * n as f64).sqrt(),
            "{share}: {found}"
        );
        let mut longer = plain.clone();
        scale_guards(&mut longer, &r, share.into(), 1.5, 1);
        for k in 0..n {
            assert_eq!(longer[k], if guard[k] { plain[k] * 1.5 } else { plain[k] });
        }
        before = guard;
    }
    // Other seeds draw other hairs, and they are spread over the skin: every quarter has its share.
    assert!((0..n).any(|k| is_guard(r.id[k], 0.1, 1) != is_guard(r.id[k], 0.1, 7)));
    for quarter in 0..4 {
        let here: Vec<usize> =
            (0..n).filter(|&k| usize::from(r.uv[k][0] > 0.5) + 2 * usize::from(r.uv[k][1] > 0.5) == quarter).collect();
        let found = here.iter().filter(|&&k| is_guard(r.id[k], 0.1, 1)).count() as f64;
        assert!((found / here.len() as f64 - 0.1).abs() < 0.025, "{found} of {}", here.len());
    }
}

#[test]
fn results_do_not_depend_on_threads() {
    let mesh = two_charts();
    let topology = Topology::new(&mesh);
    let c = all(&mesh, 20_000);
    let image = map(128, |u, v| u + v);
    let mut sites = Sites::default();
    for k in 0..150u64 {
        let uv = [rng::uniform(1, k, 0, 0) as f32, rng::uniform(1, k, 0, 1) as f32];
        sites.push(u32::from(uv[0] > 0.5), uv, [k as u32; 2]);
    }
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let density = Density { value: 150.0, map: Some(&image), on_off: None };
            let r = roots(&mesh, &topology, &c, &density, 3);
            let t = triangulate(&sites, &[false, false]);
            let w = weights(&r, &t);
            let f = Feature { value: 1.0, map: Some(&image), noise: 0.3, channel: 4 };
            let mut column = feature_column(&r, &f, 3);
            scale_guards(&mut column, &r, 0.2.into(), 1.5, 3);
            (column, t, w, r)
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
    assert!(one.2.outside > 0 && one.2.orphans == 0 && one.2.hair.len() == one.3.id.len());
    // A chart without controls is said to have none.
    sites.chart.iter_mut().for_each(|c| *c = 0);
    let alone = weights(&one.3, &triangulate(&sites, &[false, false]));
    assert_eq!(alone.orphans, one.3.chart.iter().filter(|&&c| c == 1).count());
}
