use super::*;
use crate::{Mesh, Topology, rng};

const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Control points and weights of the arc from angle `from` to `to`, less than pi apart, on the unit circle.
fn arc(from: f64, to: f64) -> [([f64; 2], f64); 3] {
    let w = libm::cos(0.5 * (to - from));
    let on = |a: f64, r: f64| [r * libm::cos(a), r * libm::sin(a)];
    [(on(from, 1.0), 1.0), (on(0.5 * (from + to), 1.0 / w), w), (on(to, 1.0), 1.0)]
}

fn bezier(degree: usize) -> Vec<f64> {
    [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat()
}

/// Part of the unit sphere: longitudes from `from` to `to`, from the equator to a pole, outside out.
fn cap(from: f64, to: f64, north: bool) -> Patch {
    let up = if north { 1.0 } else { -1.0 };
    let meridian = [([1.0, 0.0], 1.0), ([1.0, up], HALF), ([0.0, up], 1.0)];
    let (mut control, mut weight) = (Vec::new(), Vec::new());
    for ([r, z], w) in meridian {
        for ([x, y], a) in arc(from, to) {
            control.push([r * x, r * y, z]);
            weight.push(w * a);
        }
    }
    let patch = Patch::new([2, 2], [bezier(2), bezier(2)], control, weight).expect("a patch");
    if north { patch } else { patch.turned_over() }
}

fn bilinear(corner: [[f64; 3]; 4]) -> Patch {
    Patch::new([1, 1], [bezier(1), bezier(1)], corner.into(), vec![1.0; 4]).expect("a patch")
}

/// Degrees up to 5, knots with multiples, unclamped ones and weights.
fn random(id: u64) -> Patch {
    let r = |k: u64, i: u64| rng::uniform(11, id, k, i);
    let degree = [1 + id as usize % 5, 1 + (id / 5) as usize % 5];
    let knots = [0, 1].map(|d: usize| {
        let (p, k) = (degree[d], d as u64);
        let inner = (r(k, 99) * 5.0) as usize;
        let mut all: Vec<f64> = (0..2 * p + 2 + inner).map(|i| 3.0 * r(k, i as u64) - 1.0).collect();
        all.sort_by(f64::total_cmp);
        if !id.is_multiple_of(3) {
            let n = all.len();
            all[..=p].fill(-1.5);
            all[n - p - 1..].fill(2.5);
            if inner > 1 && p > 1 && id % 3 == 2 {
                all[p + 2] = all[p + 1];
            }
        }
        all
    });
    let n = [0, 1].map(|d| knots[d].len() - degree[d] - 1).iter().product::<usize>();
    let control = (0..n as u64).map(|i| std::array::from_fn(|c| r(2 + c as u64, i) * 4.0)).collect();
    Patch::new(degree, knots, control, (0..n as u64).map(|i| 0.2 + r(9, i)).collect()).expect("a patch")
}

fn volume(m: &Mesh) -> f64 {
    (0..m.triangle.len() as u32).map(|t| m.corners(t)).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

/// Euclidean length of edges with one triangle.
fn open(m: &Mesh) -> f64 {
    let t = Topology::new(m);
    let mut sum = 0.0;
    for k in 0..m.triangle.len() as u32 {
        let c = m.corners(k);
        let open = (0..3).filter(|&i| t.neighbour[k as usize][i] == crate::NONE);
        sum += open.map(|i| (c[(i + 1) % 3] - c[i]).norm()).sum::<f64>();
    }
    sum
}

#[test]
fn circles_and_spheres_are_exact() {
    let mut control = Vec::new();
    let mut weight = Vec::new();
    for z in [0.0, 3.0] {
        for ([x, y], w) in arc(0.0, std::f64::consts::FRAC_PI_2) {
            control.push([2.0 * x, 2.0 * y, z]);
            weight.push(w);
        }
    }
    let pipe = Patch::new([2, 1], [bezier(2), bezier(1)], control, weight).expect("a patch");
    let octant = cap(0.0, std::f64::consts::FRAC_PI_2, true);
    for i in 0..=20 {
        for j in 0..=20 {
            let uv = [f64::from(i) / 20.0, f64::from(j) / 20.0];
            let (p, [du, dv]) = pipe.at(uv);
            assert!((p.xy().norm() - 2.0).abs() < 1e-12 && (p.z - 3.0 * uv[1]).abs() < 1e-12);
            assert!(du.dot(&p).abs() < 1e-12 && (dv - Vec3::z() * 3.0).norm() < 1e-12);
            let (p, [du, dv]) = octant.at(uv);
            assert!((p.norm() - 1.0).abs() < 1e-12 && p.min() > -1e-15);
            assert!(du.dot(&p).abs() < 1e-12 && dv.dot(&p).abs() < 1e-12);
            assert!(j == 20 || du.cross(&dv).dot(&p) > 0.0);
        }
    }
    let south = cap(0.0, 1.0, false);
    let (p, [du, dv]) = south.at([0.3, 0.6]);
    assert!((p - cap(0.0, 1.0, true).point([0.6, 0.3]).component_mul(&Vec3::new(1.0, 1.0, -1.0))).norm() < 1e-14);
    assert!(du.cross(&dv).dot(&p) > 0.0);
}

#[test]
fn basis_functions_sum_to_one_and_keep_straight_lines() {
    for id in 0..150 {
        let patch = random(id);
        for d in 0..2 {
            let (k, p) = (&patch.knots[d], patch.degree[d]);
            for i in 0..=40 {
                let t = f64::from(i) / 40.0;
                let (first, value, slope) = basis(k, p, t);
                assert!(value.iter().all(|v| *v >= 0.0) && first + p < patch.count[d]);
                assert!((value.iter().sum::<f64>() - 1.0).abs() < 1e-13, "{id} {t}");
                assert!(slope.iter().sum::<f64>().abs() < 1e-9);
                // Control points at the means of their knots give the parameter itself.
                let mean = |a: usize| k[first + a + 1..=first + a + p].iter().sum::<f64>() / p as f64;
                let length = k[patch.count[d]] - k[p];
                let x: f64 = (0..=p).map(|a| value[a] * mean(a)).sum();
                assert!((x - k[p] - length * t).abs() < 1e-12);
                let dx: f64 = (0..=p).map(|a| slope[a] * mean(a)).sum();
                assert!((dx - length).abs() < 1e-8, "{id} {t}: {dx} {length}");
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    let mut seen = 0;
    for id in 0..150 {
        let patch = random(id);
        for k in 0..20 {
            let uv = [0, 1].map(|c| 0.01 + 0.98 * rng::uniform(12, id, k, c));
            let h = 1e-6;
            // Not across a knot.
            let span = |d: usize, t: f64| basis(&patch.knots[d], patch.degree[d], t).0;
            if (0..2).any(|d| span(d, uv[d] - h) != span(d, uv[d] + h)) {
                continue;
            }
            let (_, [du, dv]) = patch.at(uv);
            let su = (patch.point([uv[0] + h, uv[1]]) - patch.point([uv[0] - h, uv[1]])) / (2.0 * h);
            let sv = (patch.point([uv[0], uv[1] + h]) - patch.point([uv[0], uv[1] - h])) / (2.0 * h);
            let size = 1.0 + du.norm() + dv.norm();
            assert!((du - su).norm() < 1e-5 * size && (dv - sv).norm() < 1e-5 * size, "{id}: {du} {su} {dv} {sv}");
            seen += 1;
        }
    }
    assert!(seen > 2000, "{seen}");
}

#[test]
fn a_sphere_of_six_patches_of_different_cells_is_closed() {
    let third = std::f64::consts::TAU / 3.0;
    let cells = [[7, 5], [12, 8], [5, 5], [4, 9], [10, 3], [6, 11]];
    let patches: Vec<(Patch, Tessellation)> = (0..6)
        .map(|k| {
            let from = f64::from(k / 2) * third;
            (cap(from, from + third, k % 2 == 0), Tessellation::tile(cells[k as usize], k as usize))
        })
        .collect();
    let m = mesh(&patches, 1e-9).expect("a mesh");
    let t = Topology::new(&m);
    let c = t.counts;
    assert_eq!((c.open_edges, c.non_manifold_edges, c.zero_area, c.mirrored, c.zero_uv_area), (0, 0, 0, 0, 0));
    assert!(m.position.iter().all(|p| (Vec3::from(*p).norm() - 1.0).abs() < 1e-12));
    assert!(m.position.len() + m.triangle.len() - 3 * m.triangle.len() / 2 == 2, "one sphere");
    let full = 4.0 / 3.0 * std::f64::consts::PI;
    assert!(volume(&m) > 0.93 * full && volume(&m) < full, "{}", volume(&m));
    // Texture coordinates are the parameters, in the patch's tile.
    for (k, corner) in m.corner_uv.iter().enumerate() {
        let middle: [f32; 2] = std::array::from_fn(|i| (corner[0][i] + corner[1][i] + corner[2][i]) / 3.0);
        let tile = middle[0] as usize;
        for (c, v) in corner.iter().zip(m.triangle[k]) {
            let uv = [f64::from(c[0]) - tile as f64, f64::from(c[1])];
            assert!((patches[tile].0.point(uv) - Vec3::from(m.position[v as usize])).norm() < 2e-6, "{k}");
        }
    }
    let faces: usize = cells.iter().map(|c| c[0] * c[1]).sum();
    assert!(m.face.windows(2).all(|w| w[0] <= w[1]) && m.face.last() == Some(&(faces as u32 - 1)));
    // The same number of cells everywhere inserts nothing.
    let even: Vec<_> = patches.iter().map(|(p, _)| (p.clone(), Tessellation::tile([4, 4], 0))).collect();
    let m = mesh(&even, 1e-9).expect("a mesh");
    assert_eq!((m.triangle.len(), m.position.len()), (6 * (32 - 4), 6 * 9 + 3 * 3 + 6 * 3 + 3 + 2));
    assert_eq!(Topology::new(&m).counts.open_edges, 0);
}

#[test]
fn one_patch_may_meet_several_and_itself() {
    // A wall of one against two of unlike width, whose corner lies within its side; bent, so that chords differ.
    let bent = |from: f64, to: f64, low: f64, high: f64| {
        let at = |x: f64, z: f64| [x, 0.3 * x * x, z];
        // The parabola as a quadratic patch.
        let mid = |z: f64| [0.5 * (from + to), 0.3 * from * to, z];
        let control = [low, high].map(|z| [at(from, z), mid(z), at(to, z)]).concat();
        Patch::new([2, 1], [bezier(2), bezier(1)], control, vec![1.0; 6]).expect("a patch")
    };
    let cut = |u, v| Tessellation { cells: [u, v], low: [0.0; 2], high: [0.25; 2] };
    let patches = [
        (bent(-1.0, 2.0, 0.0, 1.0), cut(3, 2)),
        (bent(-1.0, 0.1, 1.0, 2.0), cut(4, 3)),
        (bent(0.1, 2.0, 1.0, 2.0), cut(5, 1)),
    ];
    let m = mesh(&patches, 1e-8).expect("a mesh");
    let outer = |p: &Patch, v: f64, n: usize| -> f64 {
        (0..n).map(|k| (p.point([(k + 1) as f64 / n as f64, v]) - p.point([k as f64 / n as f64, v])).norm()).sum()
    };
    let want = 4.0 + outer(&patches[0].0, 0.0, 3) + outer(&patches[1].0, 1.0, 4) + outer(&patches[2].0, 1.0, 5);
    assert!((open(&m) - want).abs() < 1e-9, "{} {want}", open(&m));
    assert_eq!(Topology::new(&m).counts.non_manifold_edges, 0);
    // A cube with every face cut in its own way.
    let faces = [[0, 2, 1, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 6, 3, 7], [0, 4, 2, 6], [1, 3, 5, 7]];
    let corner = |k: usize| [k & 1, (k >> 1) & 1, (k >> 2) & 1].map(|b| b as f64 - 0.5);
    let cube: Vec<_> = (0..6).map(|k| (bilinear(faces[k].map(corner)), cut(k + 1, 7 - k))).collect();
    let m = mesh(&cube, 1e-6).expect("a mesh");
    let c = Topology::new(&m).counts;
    assert_eq!((c.open_edges, c.non_manifold_edges, c.zero_area), (0, 0, 0));
    assert!((volume(&m) - 1.0).abs() < 1e-9);
    // Without joining there would be cracks: a tolerance below the distance of the faces.
    let apart: Vec<_> = cube.iter().take(2).cloned().collect();
    assert!((open(&mesh(&apart, 1e-6).expect("a mesh")) - 8.0).abs() < 1e-9);
    // A pipe of one patch whose sides meet: cubic, periodic knots.
    let n = 9;
    let ring = |k: usize| {
        let a = std::f64::consts::TAU * (k % n) as f64 / n as f64;
        [libm::cos(a), libm::sin(a)]
    };
    let control = [0.0, 1.0].map(|z| (0..n + 3).map(ring).map(|[x, y]| [x, y, z]).collect::<Vec<_>>()).concat();
    let knots = [(0..n + 7).map(|k| k as f64).collect(), bezier(1)];
    let pipe = Patch::new([3, 1], knots, control, vec![1.0; 2 * (n + 3)]).expect("a patch");
    let m = mesh(&[(pipe, cut(18, 2))], 1e-9).expect("a mesh");
    assert_eq!((m.position.len(), m.triangle.len()), (54, 72));
    assert_eq!(Topology::new(&m).counts.open_edges, 36);
}

#[test]
fn what_is_no_patch_is_told() {
    let line = bezier(1);
    let make = |degree, ku: &[f64], n: usize, w: f64| {
        Patch::new(degree, [ku.to_vec(), line.clone()], vec![[0.0; 3]; n], vec![w; n]).err().unwrap_or_default()
    };
    assert!(make([6, 1], &bezier(6), 14, 1.0).contains("degree along u"));
    assert!(make([0, 1], &bezier(1), 4, 1.0).contains("degree along u"));
    assert!(make([2, 1], &bezier(1), 4, 1.0).contains("6 knots"));
    assert!(make([1, 1], &[0.0, 1.0, 0.0, 1.0], 4, 1.0).contains("ascend"));
    assert!(make([1, 1], &[0.0, f64::NAN, 1.0, 1.0], 4, 1.0).contains("ascend"));
    assert!(make([1, 1], &[1.0; 4], 4, 1.0).contains("no length"));
    assert!(make([1, 1], &[0.0, 0.0, 0.5, 0.5, 1.0, 1.0], 8, 1.0).contains("tear"));
    assert!(make([1, 1], &line, 5, 1.0).contains("2 x 2"));
    assert!(make([1, 1], &line, 4, 0.0).contains("weight"));
    let patch = bilinear([[0.0; 3]; 4]);
    assert!(mesh(&[(patch.clone(), Tessellation::tile([0, 1], 0))], 0.1).is_err());
    assert!(mesh(&[(patch.clone(), Tessellation::tile([1, 1], 0))], 0.0).is_err());
    assert_eq!(mesh(&[(patch.clone(), Tessellation::tile([2, 1], 0))], 0.1), Ok(Mesh::default()));
    assert_eq!(mesh(&[], 0.1), Ok(Mesh::default()));
    assert!(patch.point([f64::NAN, 2.0]).x.is_nan());
}
