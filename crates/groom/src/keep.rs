//! Hairs that a shot needs, of those that there are: chosen by their roots and ranks, so that what is left is the same hair.

use crate::candidates::rank;
use crate::instance::{Density, Roots};
use crate::look::member::Grid;
use rayon::prelude::*;

/// True for positions within their own `distance` of one of some places. \[N\] positions and distances, scene units.
pub fn near(position: &[[f32; 3]], distance: &[f32], place: &[[f32; 3]]) -> Vec<bool> {
    let most = distance.iter().fold(0.0f32, |a, b| a.max(*b));
    if !(most > 0.0 && most.is_finite()) || place.is_empty() {
        return vec![false; position.len()];
    }
    let grid = Grid::new(most, place.iter().copied());
    let near = |(p, distance): (&[f32; 3], &f32)| {
        let mut found = false;
        for ring in 0..=1 {
            grid.ring(*p, ring, |k| {
                let d: [f32; 3] = std::array::from_fn(|x| p[x] - place[k][x]);
                found = found || d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= distance * distance;
            });
        }
        found
    };
    position.par_iter().zip(distance).map(near).collect()
}

/// True for positions that are chosen or within `distance` of one that is. \[N\] positions and choices, scene units.
pub fn around(position: &[[f32; 3]], chosen: &[bool], distance: f32) -> Vec<bool> {
    let place: Vec<[f32; 3]> = position.iter().zip(chosen).filter(|(_, c)| **c).map(|(p, _)| *p).collect();
    let mut out = near(position, &vec![distance; position.len()], &place);
    out.iter_mut().zip(chosen).for_each(|(o, c)| *o |= c);
    out
}

/// \[N\] shares of the local density from which on each hair is there, in (0, 1]: those at or below a share are what a layer
/// of that share of the density has. `area` is that of the rest skin, square scene units.
pub fn shares(roots: &Roots, density: &Density, area: f64) -> Vec<f32> {
    let share = |(id, uv): (&u64, &[f32; 2])| (rank(*id) / (area * density.at(*uv))) as f32;
    roots.id.par_iter().zip(&roots.uv).map(share).collect()
}

/// The roots that are kept.
pub fn kept(roots: &Roots, keep: &[bool]) -> Roots {
    fn of<T: Copy>(all: &[T], keep: &[bool]) -> Vec<T> {
        all.iter().zip(keep).filter(|(_, k)| **k).map(|(x, _)| *x).collect()
    }
    Roots {
        root: of(&roots.root, keep),
        uv: of(&roots.uv, keep),
        chart: of(&roots.chart, keep),
        id: of(&roots.id, keep),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;

    #[test]
    fn around_is_what_looking_at_all_pairs_finds() {
        let at = |k: u64| std::array::from_fn(|x| rng::uniform(1, k, x as u64, 0) as f32);
        let position: Vec<[f32; 3]> = (0..600).map(at).collect();
        let chosen: Vec<bool> = (0..600).map(|k| rng::uniform(2, k, 0, 0) < 0.02).collect();
        for distance in [0.0, 0.05, 0.2] {
            let near = |p: &[f32; 3]| {
                let d2 = |q: &[f32; 3]| (0..3).map(|x| (p[x] - q[x]) * (p[x] - q[x])).sum::<f32>();
                position.iter().zip(&chosen).any(|(q, c)| *c && d2(q) <= distance * distance)
            };
            let plain: Vec<bool> = position.iter().map(near).collect();
            assert_eq!(around(&position, &chosen, distance), plain, "{distance}");
        }
        assert_eq!(around(&position, &[false; 600], 0.2), [false; 600]);
    }

    /// What a share keeps is what a layer of that share of the density has.
    #[test]
    fn shares_are_those_of_the_density() {
        let crate::test_skin::TestSkin { mesh, topology, .. } = crate::test_skin::TestSkin::new(12, 8, 0.0);
        let candidates = crate::candidates::candidates(&mesh, &topology, 7, 500, &mut |_| true).unwrap();
        let density = |share: f64| Density { value: 400.0 * share / candidates.area, map: None, on_off: None };
        let all = crate::instance::roots(&mesh, &topology, &candidates, &density(1.0), 3);
        let share = shares(&all, &density(1.0), candidates.area);
        assert!(share.iter().all(|s| *s > 0.0 && *s <= 1.0));
        for part in [0.5, 0.125] {
            let keep: Vec<bool> = share.iter().map(|s| f64::from(*s) <= part).collect();
            assert_eq!(kept(&all, &keep), crate::instance::roots(&mesh, &topology, &candidates, &density(part), 3));
        }
    }
}
