//! Which of the control hairs around it a hair follows: all three, one of them, and none across a divider.

use crate::field::Region;
use pelage_geom::{StrandId, Vec3, rng};
use rayon::prelude::*;

/// Which control hairs a hair follows, of the three around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guides {
    /// All, by their weights.
    Blend,
    /// The one of the largest weight.
    Nearest,
    /// One at random, as probable as its weight is large: copies of typical strands with roots displaced at random
    /// (Kurihara, Anjyo, Thalmann 1993, §4), where the three strands around are the typical ones.
    Copy,
}

/// Leaves each hair what it follows: its control hairs and their weights (\[N\]). `id` and `seed` key the random numbers.
pub fn choose(guides: Guides, id: &[StrandId], seed: u64, hair: &mut [[u32; 3]], weight: &mut [[f32; 3]]) {
    if guides == Guides::Blend {
        return;
    }
    let channel = rng::channel("guides");
    hair.par_iter_mut().zip(weight).zip(id).for_each(|((hair, weight), id)| {
        let largest = (0..3).fold(0, |best, k| if weight[k] > weight[best] { k } else { best });
        let own = match guides {
            Guides::Copy => {
                let (mut left, mut own) = (rng::uniform(seed, *id, channel, 0) as f32, largest);
                for (k, w) in weight.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    own = k;
                    left -= w;
                    if left < 0.0 {
                        break;
                    }
                }
                own
            }
            _ => largest,
        };
        (*hair, *weight) = ([hair[own]; 3], [1.0, 0.0, 0.0]);
    });
}

/// Takes from hairs the control hairs on the other side of a divider: the rest share their weight, and a hair that has none
/// left follows the nearest on its side. `root` of hairs, `control` of control hairs, scene units, at rest. Returns how many
/// hairs lost one; a hair with no control hair on its side keeps what it had.
pub fn respect(
    dividers: &[Region],
    root: &[Vec3],
    control: &[Vec3],
    hair: &mut [[u32; 3]],
    weight: &mut [[f32; 3]],
) -> usize {
    if dividers.is_empty() {
        return 0;
    }
    let side = |p: &Vec3| -> Vec<bool> { dividers.iter().map(|d| d.contains(*p)).collect() };
    let sides: Vec<Vec<bool>> = control.par_iter().map(side).collect();
    let changed = |((hair, weight), root): ((&mut [u32; 3], &mut [f32; 3]), &Vec3)| {
        let own = side(root);
        let here = |h: u32| sides[h as usize] == own;
        if (0..3).all(|k| weight[k] == 0.0 || here(hair[k])) {
            return 0;
        }
        let kept: [f32; 3] = std::array::from_fn(|k| if here(hair[k]) { weight[k] } else { 0.0 });
        let sum: f32 = kept.iter().sum();
        if sum > 0.0 {
            // Two that are left sum to 1 exactly: the last takes the rest.
            let mut out = kept.map(|w| w / sum);
            if let Some(last) = (0..3).rev().find(|k| out[*k] > 0.0) {
                out[last] = 1.0 - (0..3).filter(|k| *k != last).map(|k| out[k]).sum::<f32>();
            }
            *weight = out;
            // What does not count is of this side too.
            if let Some(k) = (0..3).find(|k| out[*k] > 0.0) {
                (0..3).filter(|j| out[*j] == 0.0).for_each(|j| hair[j] = hair[k]);
            }
            return 1;
        }
        let apart = |h: &u32| (control[*h as usize] - root).norm_squared();
        let near = (0..control.len() as u32).filter(|h| here(*h)).min_by(|a, b| apart(a).total_cmp(&apart(b)));
        if let Some(h) = near {
            (*hair, *weight) = ([h; 3], [1.0, 0.0, 0.0]);
        }
        1
    };
    hair.par_iter_mut().zip(weight).zip(root).map(changed).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hairs with control hairs at random.
    fn hairs(n: u64, controls: u64) -> (Vec<[u32; 3]>, Vec<[f32; 3]>) {
        let at = |k: u64, x: u64| rng::uniform(5, k, x, 0);
        let hair = |k: u64| [0, 1, 2].map(|x| (at(k, x) * controls as f64) as u32);
        let weight = |k: u64| {
            let w = [3, 4, 5].map(|x| at(k, x) as f32);
            w.map(|x| x / w.iter().sum::<f32>())
        };
        ((0..n).map(hair).collect(), (0..n).map(weight).collect())
    }

    #[test]
    fn copies_are_as_many_as_their_weights_say() {
        let n = 30_000;
        let id: Vec<u64> = (0..n).collect();
        let (mut hair, mut weight) = (vec![[0, 1, 2]; n as usize], vec![[0.5, 0.3, 0.2]; n as usize]);
        choose(Guides::Copy, &id, 7, &mut hair, &mut weight);
        for (k, share) in [0.5, 0.3, 0.2].into_iter().enumerate() {
            let count = hair.iter().filter(|h| **h == [k as u32; 3]).count() as f64 / n as f64;
            assert!((count - share).abs() < 0.01, "{k}: {count}");
        }
        assert!(weight.iter().all(|w| *w == [1.0, 0.0, 0.0]));
        let (mut hair, mut weight) = (vec![[4, 5, 6]], vec![[0.2, 0.5, 0.3]]);
        choose(Guides::Nearest, &[0], 7, &mut hair, &mut weight);
        assert_eq!((hair[0], weight[0]), ([5; 3], [1.0, 0.0, 0.0]));
    }

    #[test]
    fn no_hair_follows_one_across_a_divider() {
        let at = |k: u64, s: u64| Vec3::from([0, 1, 2].map(|x| 2.0 * rng::uniform(s, k, x, 0) - 1.0));
        let control: Vec<Vec3> = (0..40).map(|k| at(k, 1)).collect();
        let root: Vec<Vec3> = (0..3000).map(|k| at(k, 2)).collect();
        let ellipsoid = Region::Ellipsoid {
            centre: Vec3::new(0.3, 0.0, 0.0),
            rotation: nalgebra::UnitQuaternion::identity(),
            radii: Vec3::new(0.9, 0.6, 0.8),
        };
        let dividers = [ellipsoid, Region::HalfSpace { point: Vec3::zeros(), normal: Vec3::new(0.0, 1.0, 0.2) }];
        let (mut hair, mut weight) = hairs(3000, 40);
        let before = (hair.clone(), weight.clone());
        let changed = respect(&dividers, &root, &control, &mut hair, &mut weight);
        assert!(changed > 1000 && changed < 3000, "{changed}");
        let mut same = 0;
        for (h, p) in root.iter().enumerate() {
            for d in &dividers {
                assert!(hair[h].iter().all(|c| d.contains(control[*c as usize]) == d.contains(*p)), "hair {h}");
            }
            let sum: f32 = weight[h].iter().sum();
            assert!((sum - 1.0).abs() < 1e-6 && weight[h].iter().all(|w| *w >= 0.0));
            same += usize::from(hair[h] == before.0[h] && weight[h] == before.1[h]);
        }
        assert_eq!(same, 3000 - changed);
        assert_eq!(respect(&[], &root, &control, &mut hair, &mut weight), 0);
    }
}
