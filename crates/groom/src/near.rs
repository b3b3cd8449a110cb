//! The few nearest of some hairs and the mean over them, for a hair that stands between.

use pelage_geom::Vec3;
use std::iter::Sum;
use std::ops::{Div, Mul};

/// Hairs that another one is blended from. One would copy a single hair with its accidents; ten blend across the crown of
/// a head, where directions fan out and cancel.
const NEIGHBOURS: usize = 4;

/// The hairs nearest to a point, nearest first, weighted by 1 / distance^2.
pub(crate) struct Near {
    /// Squared distance of the nearest.
    pub squared: f64,
    /// Index and weight; the nearest has weight 1.
    hair: Vec<(usize, f64)>,
    total: f64,
}

impl Near {
    /// Among hairs rooted at `root`: only those whose index `accept` takes, unless it takes none. `None` without hairs.
    pub fn find(
        root: impl ExactSizeIterator<Item = Vec3> + Clone,
        at: Vec3,
        accept: impl Fn(usize) -> bool,
    ) -> Option<Near> {
        // Ascending by (distance, index): the same whatever the order of evaluation.
        let mut near: Vec<(f64, usize)> = Vec::with_capacity(NEIGHBOURS + 1);
        for filter in [true, false] {
            for (i, r) in root.clone().enumerate() {
                let distance = (r - at).norm_squared();
                if near.len() == NEIGHBOURS && near[NEIGHBOURS - 1].0 <= distance || filter && !accept(i) {
                    continue;
                }
                let place = near.partition_point(|n| n.0 <= distance);
                near.insert(place, (distance, i));
                near.truncate(NEIGHBOURS);
            }
            if !near.is_empty() {
                break;
            }
        }
        let squared = near.first()?.0;
        let weight = |d: f64| if d == squared { 1.0 } else { squared / d };
        let hair: Vec<(usize, f64)> = near.iter().map(|&(d, i)| (i, weight(d))).collect();
        let total = hair.iter().map(|h| h.1).sum();
        Some(Near { squared, hair, total })
    }

    /// Index of the nearest.
    pub fn nearest(&self) -> usize {
        self.hair[0].0
    }

    /// The nearest alone.
    pub fn only_nearest(mut self) -> Near {
        self.hair.truncate(1);
        self.total = 1.0;
        self
    }

    /// Weighted mean of what `value` says of each.
    pub fn mean<T: Mul<f64, Output = T> + Div<f64, Output = T> + Sum>(&self, value: impl Fn(usize) -> T) -> T {
        self.hair.iter().map(|&(i, w)| value(i) * w).sum::<T>() / self.total
    }

    /// Unit mean of unit vectors; that of the nearest where they cancel.
    pub fn direction(&self, unit: impl Fn(usize) -> Vec3) -> Vec3 {
        self.mean(&unit).try_normalize(1e-3).unwrap_or_else(|| unit(self.nearest()))
    }

    /// True if `which` is true of all.
    pub fn all(&self, which: impl Fn(usize) -> bool) -> bool {
        self.hair.iter().all(|h| which(h.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_are_found_and_weighted_by_the_inverse_square() {
        let root: Vec<Vec3> = [5.0, -1.0, 2.0, 9.0, -3.0, 7.0].iter().map(|&x| Vec3::x() * x).collect();
        let near = Near::find(root.iter().copied(), Vec3::zeros(), |i| i != 2).unwrap();
        assert_eq!((near.nearest(), near.squared), (1, 1.0));
        // Distances 1, 3, 5, 7 of hairs 1, 4, 0, 5.
        let weight = |i: usize| [1.0 / 25.0, 1.0, 0.0, 0.0, 1.0 / 9.0, 1.0 / 49.0][i];
        let total: f64 = (0..6).map(weight).sum();
        for i in 0..6 {
            let got = near.mean(|k| if k == i { 1.0 } else { 0.0 });
            assert!((got - weight(i) / total).abs() < 1e-15, "{i}");
        }
        assert_eq!(near.only_nearest().mean(|k| k as f64), 1.0);
        assert!(Near::find(root.iter().copied(), Vec3::zeros(), |_| false).is_some(), "none taken: all");
        assert!(Near::find(std::iter::empty::<Vec3>(), Vec3::zeros(), |_| true).is_none());
    }
}
