//! Laws of the triangulation of control sites and of point location.

use pelage_geom::rng;
use pelage_groom::control::{PartingPiece, Sites};
use pelage_groom::triangulate::{Located, Triangulation, triangulate};
use robust::{Coord, incircle, orient2d};

fn c(p: [f32; 2]) -> Coord<f64> {
    Coord { x: f64::from(p[0]), y: f64::from(p[1]) }
}

fn random(i: u64, channel: u64) -> [f32; 2] {
    [rng::uniform(5, i, channel, 0) as f32, rng::uniform(5, i, channel, 1) as f32]
}

/// Sites of one chart, each with a hair of its own number.
fn sites(uv: &[[f32; 2]]) -> Sites {
    let mut s = Sites::default();
    for (i, &p) in uv.iter().enumerate() {
        s.push(0, p, [i as u32; 2]);
    }
    s
}

/// A closed loop of border edges through consecutive sites.
fn close(s: &mut Sites, first: u32, end: u32) {
    s.border_edges.extend((first..end).map(|i| [i, if i + 1 == end { first } else { i + 1 }]));
}

/// Points of a regular polygon, jagged by turns.
fn ring(n: usize, radius: [f32; 2]) -> Vec<[f32; 2]> {
    (0..n)
        .map(|i| {
            let (a, r) = (std::f64::consts::TAU * i as f64 / n as f64, f64::from(radius[i % 2]));
            [(0.5 + r * libm::cos(a)) as f32, (0.5 + r * libm::sin(a)) as f32]
        })
        .collect()
}

fn contains(t: &[[f32; 2]; 3], p: [f32; 2]) -> bool {
    (0..3).all(|i| orient2d(c(t[i]), c(t[(i + 1) % 3]), c(p)) >= 0.0)
}

fn check_weights(at: &Located) {
    let sum: f64 = at.weight.iter().map(|&w| f64::from(w)).sum();
    assert!(at.weight.iter().all(|&w| w >= 0.0) && (sum - 1.0).abs() <= 1e-6, "{at:?}");
}

/// Across every edge that no constraint holds, the far corner is not inside the circumcircle. With that the triangulation
/// is Delaunay, constrained edges apart.
fn check_delaunay(t: &Triangulation, s: &Sites) {
    let held = |a: u32, b: u32| {
        let pair = |e: &[u32]| (e[0] == a && e[1] == b) || (e[0] == b && e[1] == a);
        s.border_edges.iter().any(|e| pair(e)) || s.partings.iter().any(|p| p.site.windows(2).any(pair))
    };
    for (k, site) in t.triangle.iter().enumerate() {
        let [a, b, d] = t.uv[k].map(c);
        assert!(orient2d(a, b, d) > 0.0, "triangle {k} is not counter-clockwise");
        for i in 0..3 {
            let n = t.neighbour[k][i];
            if n == pelage_geom::NONE || held(site[i], site[(i + 1) % 3]) {
                continue;
            }
            let far = t.triangle[n as usize].iter().position(|v| !site.contains(v)).unwrap();
            assert!(incircle(a, b, d, c(t.uv[n as usize][far])) <= 0.0, "triangles {k} and {n}");
        }
    }
}

#[test]
fn free_sites_have_empty_circumcircles_and_the_weights_of_another_triangulation() {
    let uv: Vec<[f32; 2]> = (0..600).map(|i| random(i, 1)).collect();
    let s = sites(&uv);
    let t = triangulate(&s, &[false]);
    check_delaunay(&t, &s);
    for tri in &t.uv {
        let [a, b, d] = tri.map(c);
        assert!(uv.iter().all(|&p| tri.contains(&p) || incircle(a, b, d, c(p)) <= 0.0));
    }
    let points: Vec<delaunator::Point> =
        uv.iter().map(|p| delaunator::Point { x: f64::from(p[0]), y: f64::from(p[1]) }).collect();
    let other = delaunator::triangulate(&points).triangles;
    assert_eq!(other.len() / 3, t.triangle.len());
    let mut inside = 0;
    for q in (0..5000).map(|i| random(i, 2)) {
        let at = t.locate(0, q).unwrap();
        check_weights(&at);
        // The other one's triangles are clockwise or not by its own convention: orient them.
        let found = other.chunks(3).find_map(|k| {
            let mut k = [k[0], k[1], k[2]];
            if orient2d(c(uv[k[0]]), c(uv[k[1]]), c(uv[k[2]])) < 0.0 {
                k.swap(1, 2);
            }
            let tri = k.map(|v| uv[v]);
            contains(&tri, q).then(|| {
                let o: [f64; 3] = std::array::from_fn(|i| orient2d(c(tri[(i + 1) % 3]), c(tri[(i + 2) % 3]), c(q)));
                let mut w = vec![0.0; uv.len()];
                k.iter().zip(o).for_each(|(&v, area)| w[v] = area / o.iter().sum::<f64>());
                w
            })
        });
        assert_eq!(found.is_none(), at.outside);
        let Some(w) = found else { continue };
        inside += 1;
        for k in 0..3 {
            assert!((w[at.hair[k] as usize] - f64::from(at.weight[k])).abs() < 1e-6);
        }
    }
    assert!(inside > 4500);
}

#[test]
fn location_equals_brute_force_with_an_outline_and_a_hole() {
    let mut uv = ring(40, [0.5, 0.35]);
    uv.extend(ring(14, [0.12, 0.2]));
    uv.extend((0..300).map(|i| random(i, 3)));
    let mut s = sites(&uv);
    close(&mut s, 0, 40);
    close(&mut s, 40, 54);
    let t = triangulate(&s, &[false]);
    check_delaunay(&t, &s);
    assert_eq!((t.counts.open_outlines, t.counts.crossing), (0, 0));
    let polygon = |p: [f32; 2], ring: &[[f32; 2]]| {
        (0..ring.len())
            .filter(|&i| {
                let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                let up = (a[1] <= p[1]) && (b[1] > p[1]) && orient2d(c(a), c(b), c(p)) > 0.0;
                let down = (a[1] > p[1]) && (b[1] <= p[1]) && orient2d(c(a), c(b), c(p)) < 0.0;
                up || down
            })
            .count()
            % 2
            == 1
    };
    let (mut inside, mut outside) = (0, 0);
    for q in (0..4000).map(|i| random(i, 4).map(|x| 1.4 * x - 0.2)) {
        let at = t.locate(0, q).unwrap();
        check_weights(&at);
        let first = t.uv.iter().position(|tri| contains(tri, q));
        assert_eq!(first.is_none(), at.outside);
        assert_eq!(!at.outside, polygon(q, &uv[..40]) && !polygon(q, &uv[40..54]), "{q:?}");
        if let Some(k) = first {
            assert_eq!(at.hair, t.hair[k]);
            inside += 1;
            continue;
        }
        outside += 1;
        let d2 = |e: &[[f32; 2]; 2]| {
            let [a, b, p] = [e[0], e[1], q].map(|x| x.map(f64::from));
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let f = (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
            ((p[0] - a[0] - f * dx).powi(2) + (p[1] - a[1] - f * dy).powi(2), f)
        };
        let best = t.edge.iter().map(|e| (d2(&e.uv), e.hair)).min_by(|a, b| a.0.0.total_cmp(&b.0.0)).unwrap();
        assert_eq!((at.hair, at.weight[2]), (best.1, 0.0));
        assert!((f64::from(at.weight[1]) - best.0.1).abs() < 1e-6);
    }
    assert!(inside > 500 && outside > 500);
}

#[test]
fn a_point_on_an_edge_takes_the_lower_triangle_and_a_site_its_own_hair() {
    // A grid: all squares are cocircular.
    let uv: Vec<[f32; 2]> = (0..81).map(|i| [(i % 9) as f32 / 8.0, (i / 9) as f32 / 8.0]).collect();
    let s = sites(&uv);
    let t = triangulate(&s, &[false]);
    assert_eq!(t.triangle.len(), 128);
    check_delaunay(&t, &s);
    for (i, &p) in uv.iter().enumerate() {
        let at = t.locate(0, p).unwrap();
        let k = at.hair.iter().position(|&h| h == i as u32).unwrap();
        assert_eq!((at.weight[k], at.outside), (1.0, false));
        assert_eq!(at.hair, t.hair[t.uv.iter().position(|tri| contains(tri, p)).unwrap()]);
    }
}

#[test]
fn poor_charts_still_give_weights() {
    let line: Vec<[f32; 2]> = [0.5, 0.1, 0.9, 0.3].iter().map(|&x| [x, 2.0 * x]).collect();
    let t = triangulate(&sites(&line), &[false]);
    assert_eq!((t.triangle.len(), t.edge.len()), (0, 3));
    let at = t.locate(0, [0.2, 0.4]).unwrap();
    check_weights(&at);
    let x: f32 = (0..3).map(|k| at.weight[k] * line[at.hair[k] as usize][0]).sum();
    assert!((x - 0.2).abs() < 1e-6 && at.outside);
    assert_eq!(t.locate(0, [-3.0, -6.0]).unwrap().weight.iter().filter(|&&w| w == 1.0).count(), 1);

    let t = triangulate(&sites(&[[0.25, 0.5]]), &[false]);
    let at = t.locate(0, [9.0, 9.0]).unwrap();
    assert_eq!((at.hair, at.weight), ([0; 3], [1.0, 0.0, 0.0]));

    let t = triangulate(&sites(&[[0.25, 0.5], [0.75, 0.5]]), &[false]);
    assert_eq!(t.locate(0, [0.375, 0.9]).unwrap().weight, [0.75, 0.25, 0.0]);

    let mut twice: Vec<[f32; 2]> = (0..20).map(|i| random(i % 10, 6)).collect();
    twice.push([f32::NAN, 0.0]);
    twice.push([-0.0, 0.0]);
    twice.push([0.0, 1e-41]);
    let t = triangulate(&sites(&twice), &[false, false]);
    assert_eq!((t.counts.duplicates, t.counts.not_finite, t.counts.empty_charts), (11, 1, 1));
    assert!(t.hair.iter().flatten().all(|&h| h < 10 || h == 21));
    assert_eq!(t.locate(1, [0.5, 0.5]), None);
    assert_eq!(t.locate(0, [0.5, f32::INFINITY]), None);
}

#[test]
fn outlines_that_cross_or_stay_open_are_counted_and_cut_nothing() {
    let mut s = sites(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.4, 0.7]]);
    close(&mut s, 0, 4);
    let t = triangulate(&s, &[false]);
    assert_eq!((t.counts.crossing, t.counts.open_outlines), (1, 1));
    assert_eq!(t.triangle.len(), 4);
    let mut s = sites(&ring(12, [0.5, 0.2]));
    s.border_edges.extend((0..11).map(|i| [i, i + 1]));
    assert_eq!(triangulate(&s, &[false]).counts.open_outlines, 1);
    // A slit, cut but not opened: its edge runs there and back.
    let mut s = sites(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]]);
    s.border_edges.extend([[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [4, 0]]);
    let t = triangulate(&s, &[false]);
    assert_eq!((t.counts.open_outlines, t.triangle.len()), (0, 4));
}

/// A square of random sites with a wavy parting whose inner sites have hair 2k + 1000 on the left, 2k + 1001 on the right.
fn parted(to_border: bool) -> Sites {
    let mut s = Sites::default();
    let mut square = vec![];
    for k in 0..4 {
        for i in 0..6 {
            let f = i as f32 / 6.0;
            square.push([[f, 0.0], [1.0, f], [1.0 - f, 1.0], [0.0, 1.0 - f]][k]);
        }
    }
    for p in &square {
        s.push(0, *p, [s.len() as u32; 2]);
    }
    close(&mut s, 0, 24);
    for p in (0..250).map(|i| random(i, 7)) {
        s.push(0, p, [s.len() as u32; 2]);
    }
    let mut site = Vec::new();
    for k in 0..=10u32 {
        let x = 0.15 + 0.07 * k as f32;
        let p = [x, (0.5 + 0.2 * libm::sin(9.0 * f64::from(x))) as f32];
        let end = k == 0 || (k == 10 && !to_border);
        let h = 1000 + 2 * k;
        site.push(s.push(0, p, if end { [h, h] } else { [h, h + 1] }));
    }
    if to_border {
        // The border site at the middle of the right side, one hair on either side of the parting.
        s.hair[9] = [1100, 1101];
        site.push(9);
    }
    s.partings.push(PartingPiece { parting: 0, chart: 0, site });
    s
}

#[test]
fn no_triangle_mixes_the_sides_of_a_parting() {
    for (to_border, mirrored) in [(false, false), (true, false), (false, true), (true, true)] {
        let s = parted(to_border);
        let t = triangulate(&s, &[mirrored]);
        check_delaunay(&t, &s);
        assert_eq!((t.counts.crossing, t.counts.no_side, t.counts.mixed), (0, 0, 0));
        let path: Vec<Coord<f64>> = s.partings[0].site.iter().map(|&k| c(s.uv[k as usize])).collect();
        let mut seen = [0; 2];
        for (k, hair) in t.hair.iter().enumerate() {
            for (i, &h) in hair.iter().enumerate() {
                let [left, right] = s.hair[t.triangle[k][i] as usize];
                if left == right {
                    continue;
                }
                let is_left = (h == left) != mirrored;
                assert!(h == left || h == right);
                seen[usize::from(is_left)] += 1;
                // Near its corner the triangle lies above the parting, a function of x, if it is on the left.
                let [a, b, d] = [0, 1, 2].map(|j| c(t.uv[k][(i + j) % 3]));
                let q =
                    Coord { x: a.x + 1e-3 * ((b.x - a.x) + (d.x - a.x)), y: a.y + 1e-3 * ((b.y - a.y) + (d.y - a.y)) };
                let on = path.windows(2).find(|w| w[0].x <= q.x && q.x <= w[1].x).unwrap();
                assert_eq!(orient2d(on[0], on[1], q) > 0.0, is_left, "triangle {k} corner {i}");
            }
        }
        assert!(seen[0] > 10 && seen[1] > 10);
    }
}

#[test]
fn a_parting_that_crosses_the_outline_still_mixes_nothing() {
    // A star: the straight way between its arms leaves it.
    let mut s = sites(&ring(16, [0.5, 0.2]));
    close(&mut s, 0, 16);
    let arm = |i: usize, r: f64| {
        let a = std::f64::consts::TAU * i as f64 / 16.0;
        [(0.5 + r * libm::cos(a)) as f32, (0.5 + r * libm::sin(a)) as f32]
    };
    let way = [arm(0, 0.1), arm(0, 0.3), arm(0, 0.38), arm(2, 0.38), arm(2, 0.3), arm(2, 0.1)];
    let site = way.iter().enumerate().map(|(k, &p)| s.push(0, p, [100 + 2 * k as u32, 101 + 2 * k as u32])).collect();
    s.partings.push(PartingPiece { parting: 0, chart: 0, site });
    let t = triangulate(&s, &[false]);
    assert!(t.counts.crossing > 0 && t.counts.open_outlines == 0);
    for hair in &t.hair {
        let sides: Vec<u32> = hair.iter().filter(|&&h| h >= 100).map(|h| h % 2).collect();
        assert!(sides.windows(2).all(|w| w[0] == w[1]), "{hair:?}");
    }
}
