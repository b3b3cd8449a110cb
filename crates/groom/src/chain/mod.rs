//! Hairs as chains of capsules, and where they meet.
//!
//! After Golodetz, "Modelling Hair Collisions Using Spline-Based Cylinder Chains" (2007). The paper bounds each hair, a
//! cubic B-spline, by a chain of cylinders and compares cylinders by the distance of their axes. That distance is exact
//! for capsules (cylinders with round caps: all points within a radius of a segment), not for cylinders with flat ends,
//! so the links here are capsules. Its sections on fitting and on many hairs are empty; here
//!
//! - [`fit`] bounds splines by few links that hold the thick curve, within a tolerance;
//! - [`segment`] has the distance of two axes, exact however they lie;
//! - [`pairs`] finds all pairs of hairs that meet, by boxes and wider capsules around runs of links, and sums up a groom;
//! - [`ellipsoid`] compares chains with an ellipsoid by the true distance: an ellipsoid with longer semi-axes, which
//!   the paper takes for it, lies inside of the true offset and misses contacts.

pub mod ellipsoid;
pub mod fit;
pub mod pairs;
pub mod segment;

use crate::spline::BSpline;
use fit::Fitted;
use pelage_geom::{Offsets, Vec3};
use rayon::prelude::*;

/// All points within `radius` of the segment between two ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Capsule {
    /// Ends of the axis, scene units; equal ends make a ball.
    pub axis: [Vec3; 2],
    /// Radius, scene units.
    pub radius: f64,
}

/// Hairs as chains of capsules that share their joints. A hair of one point is one link, a ball; one of no points has
/// no links.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chains {
    /// Runs of `joint`, one a hair.
    offsets: Offsets,
    joint: Vec<Vec3>,
    /// One a joint: the radius of the link that begins there (of the last joint: that of the link that ends there).
    radius: Vec<f64>,
}

impl Chains {
    /// Chains along polylines: `position` (scene units) cut into hairs by `offsets`, and `radius` at each of them. A
    /// link is as wide as its wider end. Says what is wrong if the lengths differ or something is not finite or less
    /// than nothing.
    pub fn of_polylines(position: &[[f32; 3]], offsets: &Offsets, radius: &[f32]) -> Result<Chains, String> {
        let n = offsets.total();
        if position.len() != n || radius.len() != n {
            return Err(format!("{n} points have {} positions and {} radii", position.len(), radius.len()));
        }
        let bad = |i: usize| !position[i].iter().all(|x| x.is_finite()) || !(0.0..f32::MAX).contains(&radius[i]);
        if let Some(i) = (0..n).find(|&i| bad(i)) {
            let (hair, p, r) = (offsets.run_of(i), position[i], radius[i]);
            return Err(format!("hair {hair} has a point at {p:?} of radius {r}"));
        }
        let mut chains = Chains {
            offsets: offsets.clone(),
            joint: position.iter().map(|p| Vec3::from(p.map(f64::from))).collect(),
            radius: radius.iter().map(|&r| f64::from(r)).collect(),
        };
        for s in 0..offsets.len() {
            let run = &mut chains.radius[offsets.range(s)];
            (1..run.len()).for_each(|k| run[k - 1] = run[k - 1].max(run[k]));
            if let [.., before, last] = run {
                *last = *before;
            }
        }
        Ok(chains)
    }

    /// Chains around splines of the given radii (one a hair, scene units), see [`fit::fit`]: link `k` of a hair holds
    /// all within its radius of its curve, and is wider than that by no more than `tolerance`.
    pub fn of_splines(curve: &[BSpline], radius: &[f64], tolerance: f64) -> Result<Chains, String> {
        if curve.len() != radius.len() {
            return Err(format!("{} splines have {} radii", curve.len(), radius.len()));
        }
        let fitted: Vec<Fitted> = curve
            .par_iter()
            .zip(radius)
            .enumerate()
            .map(|(s, (c, r))| {
                if !(0.0..f64::MAX).contains(r) {
                    return Err(format!("hair {s} has radius {r}"));
                }
                fit::fit(c, tolerance).map_err(|e| format!("hair {s}: {e}"))
            })
            .collect::<Result<_, String>>()?;
        let mut chains = Chains {
            offsets: Offsets::from_counts(fitted.iter().map(|f| f.joint.len())),
            joint: Vec::new(),
            radius: Vec::new(),
        };
        for (f, r) in fitted.iter().zip(radius) {
            chains.joint.extend(&f.joint);
            chains.radius.extend(f.off.iter().chain(f.off.last()).map(|off| r + off));
        }
        Ok(chains)
    }

    /// Number of hairs.
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// True if there are no hairs.
    pub fn is_empty(&self) -> bool {
        self.offsets.is_empty()
    }

    /// Number of links of hair `s`.
    pub fn links(&self, s: usize) -> usize {
        match self.offsets.range(s).len() {
            0 => 0,
            joints => (joints - 1).max(1),
        }
    }

    /// Link `k` of hair `s`, counted from its root.
    pub fn link(&self, s: usize, k: usize) -> Capsule {
        let run = self.offsets.range(s);
        let i = run.start + k;
        Capsule { axis: [self.joint[i], self.joint[(i + 1).min(run.end - 1)]], radius: self.radius[i] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_as_wide_as_their_wider_end_and_bad_input_is_told() {
        let offsets = Offsets::from_counts([3, 0, 1, 2]);
        let position: Vec<[f32; 3]> = (0..6u8).map(|k| [f32::from(k), 0.0, 0.0]).collect();
        let radius = [0.1, 0.3, 0.2, 0.4, 0.5, 0.25];
        let chains = Chains::of_polylines(&position, &offsets, &radius).expect("chains");
        assert_eq!((0..4).map(|s| chains.links(s)).collect::<Vec<_>>(), vec![2, 0, 1, 1]);
        let widths: Vec<f64> = [(0, 0), (0, 1), (2, 0), (3, 0)].map(|(s, k)| chains.link(s, k).radius).into();
        assert_eq!(widths, [0.3f32, 0.3, 0.4, 0.5].map(f64::from));
        assert_eq!(chains.link(2, 0).axis, [Vec3::x() * 3.0; 2]);
        assert_eq!(chains.link(3, 0).axis, [Vec3::x() * 4.0, Vec3::x() * 5.0]);
        let told = |p: &[[f32; 3]], r: &[f32]| Chains::of_polylines(p, &offsets, r).err().unwrap_or_default();
        assert!(told(&position[1..], &radius).contains("5 positions"));
        assert!(told(&position, &[0.1, 0.1, 0.1, -1.0, 0.1, 0.1]).contains("hair 2"));
        let mut far = position.clone();
        far[4][1] = f32::NAN;
        assert!(told(&far, &radius).contains("hair 3"));
        let line = BSpline { control: (0..5u8).map(|k| Vec3::x() * f64::from(k)).collect() };
        assert!(Chains::of_splines(std::slice::from_ref(&line), &[f64::NAN], 0.1).is_err());
        assert!(Chains::of_splines(std::slice::from_ref(&line), &[], 0.1).is_err());
        let straight = Chains::of_splines(&[line], &[0.5], 0.1).expect("chains");
        assert!(straight.links(0) == 1 && (straight.link(0, 0).radius - 0.5).abs() < 1e-9);
    }
}
