use crate::common::*;
use pelage_geom::NONE;
use pelage_groom::look::member::{
    Members, Sites, centres, densities, members, members_plain, nearest_hairs, representatives, sides, whole_clumps,
};
use pelage_groom::look::region::regions;

/// Roots all over a sphere of radius 5: hairs on its two sides never meet, seams are nowhere.
fn sphere(n: usize) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    (0..n as u64)
        .map(|i| V::new(r(11, i, 0), r(11, i, 1), r(11, i, 2)).normalize())
        .map(|v| (single(v * 5.0), single(v)))
        .unzip()
}

fn every(n: usize, step: usize) -> Vec<u32> {
    (0..n as u32).step_by(step).collect()
}

#[test]
fn members_are_those_of_brute_force() {
    let (position, normal) = sphere(4000);
    for (step, size, vary) in [(40, 0.9, 0.0), (40, 0.9, 0.6), (7, 0.2, 0.3), (400, 30.0, 0.0), (5, 2.0, 0.9)] {
        let centre = every(4000, step);
        let radius: Vec<f32> = centre.iter().map(|h| (size * (1.0 + vary * r(12, u64::from(*h), 0))) as f32).collect();
        let open: Vec<bool> = (0..4000).map(|h| h % 13 != 5).collect();
        let spacing = 10.0 * (std::f64::consts::PI * step as f64 / 4000.0).sqrt() as f32;
        for open in [&open[..], &[]] {
            let sites = Sites { position: &position, normal: &normal, side: &[] };
            let fast = members(&sites, centre.clone(), &radius, spacing, open);
            assert!(fast == members_plain(&sites, centre.clone(), &radius, open), "{step} {size} {vary}");
            assert!(fast.clump.iter().any(|c| *c != NONE));
            let tiny = members(&sites, centre.clone(), &radius, 1e-3, open);
            assert!(tiny == fast, "what the spacing says changes nothing");
        }
    }
}

#[test]
fn equally_near_centres_are_taken_in_order_and_sides_do_not_mix() {
    let position = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -0.01]];
    let up = [0.0, 0.0, 1.0];
    let normal = [up, up, up, [0.0, 0.0, -1.0]];
    let sites = Sites { position: &position, normal: &normal, side: &[] };
    let found = members(&sites, vec![1, 2], &[1.5, 1.5], 1.0, &[]);
    assert_eq!(found.clump, [0, 0, 1, NONE]);
    assert!((found.reach[0] - 1.0 / 1.5).abs() < 1e-6 && found.reach[1] == 0.0);
    let empty = members(&sites, Vec::new(), &[], 1.0, &[]);
    assert!(empty.clump.iter().all(|c| *c == NONE));
}

#[test]
fn no_clump_crosses_a_parting() {
    let n = 3000;
    let position: Vec<[f32; 3]> = (0..n).map(|i| [4.0 * r(21, i, 0) as f32, 0.0, 4.0 * r(21, i, 1) as f32]).collect();
    let normal = vec![[0.0, 1.0, 0.0]; n as usize];
    let line = vec![vec![V::new(0.0, 0.0, -3.0), V::new(0.3, 0.0, 0.0), V::new(0.0, 0.0, 3.0)]];
    let bare = Sites { position: &position, normal: &normal, side: &[] };
    let side = sides(&line, 1.0, &bare);
    let parted = Sites { side: &side, ..bare };
    let centre = every(n as usize, 20);
    let radius = vec![0.6; centre.len()];
    let found = members(&parted, centre.clone(), &radius, 0.5, &[]);
    assert!(found == members_plain(&parted, centre.clone(), &radius, &[]));
    let crossing = |m: &Members| {
        let left = |h: usize| position[h][0] < 0.3 - 0.1 * position[h][2].abs();
        let beside = |h: usize| position[h][2].abs() < 2.5;
        let both = |h: &usize| m.clump[*h] != NONE && beside(*h) && beside(m.centre[m.clump[*h] as usize] as usize);
        (0..n as usize).filter(both).filter(|h| left(*h) != left(m.centre[m.clump[*h] as usize] as usize)).count()
    };
    assert_eq!(crossing(&found), 0);
    assert!(crossing(&members(&bare, centre, &radius, 0.5, &[])) > 20, "without the parting some do");
}

#[test]
fn raising_the_density_adds_clumps_and_coarse_centres_are_fine_ones() {
    let id: Vec<u64> = (0..5000).map(|i| (9 << 32) | (3 * i)).collect();
    let at = |d: f64| centres(&id, 100.0, &|_| d, &[]);
    let (few, many) = (at(0.7), at(6.0));
    assert!(few.len() < many.len() && few.iter().all(|h| many.contains(h)));
    // A third of the candidates grew hair: a third of the 70 places have a centre.
    assert!((22..=24).contains(&few.len()), "{}", few.len());
    let half: Vec<bool> = (0..5000).map(|h| h < 10).collect();
    assert_eq!(centres(&id, 100.0, &|_| 6.0, &half).len(), 10);
}

#[test]
fn clumps_of_clumps_take_whole_clumps() {
    let (position, normal) = sphere(3000);
    let sites = Sites { position: &position, normal: &normal, side: &[] };
    let fine_centre = every(3000, 10);
    let fine = members(&sites, fine_centre.clone(), &vec![0.7; fine_centre.len()], 0.7, &[]);
    let open = representatives(&fine);
    let centre: Vec<u32> = every(3000, 100);
    let radius = vec![4.0; centre.len()];
    let coarse = members(&sites, centre, &radius, 2.0, &open);
    let whole = whole_clumps(&sites, &fine, &radius, coarse);
    for h in 0..3000 {
        if let Some(f) = fine.centre.get(fine.clump[h] as usize) {
            assert_eq!(whole.clump[h], whole.clump[*f as usize]);
        }
        assert!((0.0..=1.0).contains(&whole.reach[h]));
    }
    assert!(whole.clump.iter().filter(|c| **c != NONE).count() > 2900);
}

#[test]
fn regions_are_those_of_brute_force() {
    let (position, normal) = sphere(1500);
    let sites = Sites { position: &position, normal: &normal, side: &[] };
    // Painted cells; hairs of a cell that are not joined by steps of 0.6 are regions of their own.
    let value: Vec<f32> = position.iter().map(|p| (p[0].floor() + 7.0 * p[1].floor()) * 0.01).collect();
    let open: Vec<bool> = (0..1500).map(|h| h % 17 != 0).collect();
    let near = 0.6;
    let found = regions(&sites, &value, near, &open);
    let mut label: Vec<usize> = (0..1500).collect();
    let joined = |a: usize, b: usize| {
        let d = double(position[a]) - double(position[b]);
        let faces = double(normal[a]).dot(&double(normal[b])) > 0.0;
        value[a] == value[b] && open[a] && open[b] && faces && d.norm() <= f64::from(near)
    };
    loop {
        let mut changed = false;
        for a in 0..1500 {
            for b in 0..1500 {
                if label[b] < label[a] && joined(a, b) {
                    label[a] = label[b];
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
    }
    for a in 0..1500 {
        assert_eq!(found.clump[a] == NONE, !open[a]);
        for b in (0..1500).filter(|b| open[a] && open[*b]) {
            assert_eq!(found.clump[a] == found.clump[b], label[a] == label[b], "{a} {b}");
        }
    }
    assert!(found.centre.len() > 50 && found.centre.len() < 1000);
    for (c, &h) in found.centre.iter().enumerate() {
        assert_eq!(found.clump[h as usize], c as u32);
    }
}

#[test]
fn the_nearest_hair_is_the_nearest() {
    let (position, _) = sphere(500);
    let asked = [position[42], [5.0, 0.0, 0.0]];
    let found = nearest_hairs(&position, &asked);
    assert_eq!(found[0], 42);
    let d = |h: usize| (double(position[h]) - double(asked[1])).norm();
    assert!((0..500).all(|h| d(found[1] as usize) <= d(h)));
}

#[test]
fn densities_are_hairs_per_area() {
    // A sphere of radius 5 with 20,000 hairs, of which one half has four times as many as the other.
    let even = |i: u64| {
        let (z, a) = (r(21, i, 0), std::f64::consts::PI * r(21, i, 1));
        let s = (1.0 - z * z).sqrt();
        single(V::new(z, s * libm::cos(a), s * libm::sin(a)) * 5.0)
    };
    let position: Vec<[f32; 3]> =
        (0..40_000).map(even).enumerate().filter(|(i, p)| p[0] > 0.0 || i % 4 == 0).map(|(_, p)| p).collect();
    let area = 2.0 * std::f32::consts::PI * 25.0;
    let found = densities(&position);
    for (side, hairs) in [(1.0, 20_000.0), (-1.0, 5_000.0)] {
        // Away from the border, whose hairs have both kinds around them.
        let own: Vec<f32> =
            position.iter().zip(&found).filter(|(p, _)| p[0] * side > 1.0).map(|(_, d)| d * area / hairs).collect();
        let mean = own.iter().sum::<f32>() / own.len() as f32;
        // Sixteen at random are one of sixteen too many on average.
        assert!((mean - 1.0).abs() < 0.08, "{mean}");
    }
    // By brute force.
    for i in (0..position.len()).step_by(997) {
        let mut square: Vec<f32> =
            position.iter().map(|q| (double(*q) - double(position[i])).norm_squared() as f32).collect();
        square.sort_by(f32::total_cmp);
        let expected = 16.0 / (std::f32::consts::PI * square[16]);
        assert!((found[i] / expected - 1.0).abs() < 1e-4, "{} {expected}", found[i]);
    }
    // Few hairs, hairs at one place, hairs far apart.
    assert_eq!((densities(&[]), densities(&[[1.0; 3]])), (vec![], vec![0.0]));
    assert!(densities(&[[0.0; 3]; 40]).iter().all(|d| *d > 0.0));
    let mut far = vec![[0.0f32; 3]; 3];
    (far[1][0], far[2][0]) = (1e-3, 1e6);
    assert!(densities(&far).iter().all(|d| d.is_finite() && *d > 0.0));
}
