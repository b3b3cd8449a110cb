//! Where a cluster stands: a closed curve in scalp space.

use super::curve::around;
use std::f64::consts::TAU;

/// The inside of a closed curve in scalp space, seen whole from its centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Its centre: a cluster's root.
    pub centre: [f64; 2],
    /// \[K\] radii at equal angles from u towards v, above 0, in units of scalp space; one is a circle. Between them
    /// the curve is smooth.
    pub radius: Vec<f64>,
}

impl Region {
    /// A circle.
    pub fn circle(centre: [f64; 2], radius: f64) -> Self {
        Region { centre, radius: vec![radius] }
    }

    /// The inside of a polygon, either way around, with `angles` radii about its centroid. Says so if it is not seen
    /// whole from there: then it must be cut in parts.
    pub fn polygon(corners: &[[f64; 2]], angles: usize) -> Result<Self, String> {
        let n = corners.len();
        if n < 3 || angles == 0 || !corners.iter().flatten().all(|x| x.is_finite()) {
            return Err(format!("a contour needs 3 corners or more, not {n}, all of them numbers, and an angle"));
        }
        let [ox, oy] = corners[0];
        let side = |k: usize| {
            let ([ax, ay], [bx, by]) = (corners[k], corners[(k + 1) % n]);
            let (a, b) = ([ax - ox, ay - oy], [bx - ox, by - oy]);
            (a, b, a[0] * b[1] - a[1] * b[0])
        };
        let area: f64 = (0..n).map(|k| side(k).2).sum();
        let moment = |i: usize| (0..n).map(side).map(|(a, b, c)| c * (a[i] + b[i])).sum::<f64>() / (3.0 * area);
        let middle = [moment(0), moment(1)];
        if !middle.iter().all(|x| x.is_finite()) {
            return Err("a contour has no area".into());
        }
        let corner = |k: usize| [corners[k % n][0] - ox - middle[0], corners[k % n][1] - oy - middle[1]];
        let about: Vec<[f64; 2]> = (0..n).map(corner).collect();
        // Seen whole: every side turns the same way about the middle.
        let turns_back = |k: usize| {
            let ([ax, ay], [bx, by]) = (corner(k), corner(k + 1));
            (ax * by - ay * bx) * area <= 0.0
        };
        let centre = [middle[0] + ox, middle[1] + oy];
        match (0..n).find(|k| turns_back(*k)) {
            Some(k) => Err(format!("side {k} of a contour is not seen from its middle {centre:?}: cut it in parts")),
            None => Ok(Region { centre, radius: seen(&about, angles) }),
        }
    }

    /// Radius at an angle.
    pub fn radius(&self, angle: f64) -> f64 {
        around(&self.radius, &[], angle)[0]
    }

    /// Coordinates of a point: 0 at the centre to 1 on the curve and beyond, and the angle from u towards v, radians.
    pub fn polar(&self, at: [f64; 2]) -> [f64; 2] {
        let (x, y) = (at[0] - self.centre[0], at[1] - self.centre[1]);
        let away = (x * x + y * y).sqrt();
        if away == 0.0 {
            return [0.0; 2];
        }
        let angle = libm::atan2(y, x);
        [away / self.radius(angle), angle]
    }

    /// The point with these coordinates.
    pub fn at(&self, [r, angle]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(angle);
        let away = r * self.radius(angle);
        [self.centre[0] + away * cos, self.centre[1] + away * sin]
    }

    /// True inside and on the curve.
    pub fn contains(&self, at: [f64; 2]) -> bool {
        self.polar(at)[0] <= 1.0
    }

    /// `n` places (r, angle) spread evenly over it: the first ones of more are the same. The sequence of Roberts (2018,
    /// "The unreasonable effectiveness of quasirandom sequences"): multiples of 1/g and 1/g^2, with g^3 = g + 1.
    pub fn fill(&self, n: usize) -> Vec<[f64; 2]> {
        const STEPS: usize = 256;
        const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];
        // Share of the area up to an angle.
        let mut share = vec![0.0];
        for k in 0..STEPS {
            let r = self.radius((k as f64 + 0.5) * TAU / STEPS as f64);
            share.push(share[k] + r * r);
        }
        let place = |k: usize| {
            let [u, v] = STEP.map(|s| 0.5 + s * k as f64).map(|x| x - x.floor());
            let wanted = v * share[STEPS];
            let i = share[1..STEPS].partition_point(|s| *s <= wanted);
            let angle = (i as f64 + (wanted - share[i]) / (share[i + 1] - share[i])) * TAU / STEPS as f64;
            [u.sqrt(), angle]
        };
        (0..n).map(place).collect()
    }

    /// Its area.
    pub fn area(&self) -> f64 {
        let turn = TAU / 256.0;
        (0..256).map(|k| self.radius(turn * f64::from(k))).map(|r| 0.5 * r * r * turn).sum()
    }

    /// Those of `uv` that it contains, in order.
    pub fn roots(&self, uv: &[[f64; 2]]) -> Vec<u32> {
        (0..uv.len() as u32).filter(|k| self.contains(uv[*k as usize])).collect()
    }

    /// Square of the distance of a point from the centre.
    pub fn distance_squared(&self, at: [f64; 2]) -> f64 {
        let (x, y) = (at[0] - self.centre[0], at[1] - self.centre[1]);
        x * x + y * y
    }

    /// Says what is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        if !self.centre.iter().all(|x| x.is_finite()) {
            Err("the centre of a region is no number".into())
        } else if self.radius.is_empty() || !self.radius.iter().all(|r| r.is_finite() && *r > 0.0) {
            Err("a region needs radii above 0".into())
        } else {
            Ok(())
        }
    }
}

/// Distances from the origin to a polygon around it at equal angles from u towards v: the farthest where there are
/// several, 0 where there is none.
pub(super) fn seen(corners: &[[f64; 2]], angles: usize) -> Vec<f64> {
    let distance = |k: usize| {
        let (sin, cos) = libm::sincos(TAU * k as f64 / angles as f64);
        let mut farthest = 0.0f64;
        for (i, a) in corners.iter().enumerate() {
            let b = &corners[(i + 1) % corners.len()];
            let across = |p: &[f64; 2]| cos * p[1] - sin * p[0];
            let (from, to) = (across(a), across(b));
            if (from <= 0.0) != (to <= 0.0) {
                let f = from / (from - to);
                farthest = farthest.max(cos * (a[0] + (b[0] - a[0]) * f) + sin * (a[1] + (b[1] - a[1]) * f));
            }
        }
        farthest
    };
    (0..angles).map(distance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng::uniform;

    #[test]
    fn polygons_contain_what_they_contain() {
        let corners = [[2.0, 1.0], [6.0, 1.5], [5.5, 4.0], [4.0, 3.2], [2.5, 4.0]];
        let backward: Vec<[f64; 2]> = corners.iter().rev().copied().collect();
        let region = Region::polygon(&corners, 720).expect("a region");
        let other = Region::polygon(&backward, 720).expect("a region");
        assert!(region.radius.iter().zip(&other.radius).all(|(a, b)| (a - b).abs() < 1e-12));
        let uv: Vec<[f64; 2]> = (0..4000).map(|k| [0, 1].map(|i| 1.0 + 6.0 * uniform(1, k, 0, i))).collect();
        let found = region.roots(&uv);
        let mut wrong = 0;
        for (k, [x, y]) in uv.iter().enumerate() {
            // Crossings of a ray to the right.
            let crossed = (0..5).filter(|i| {
                let ([ax, ay], [bx, by]) = (corners[*i], corners[(i + 1) % 5]);
                (ay > *y) != (by > *y) && *x < ax + (bx - ax) * (y - ay) / (by - ay)
            });
            wrong += usize::from((crossed.count() % 2 == 1) != found.contains(&(k as u32)));
        }
        assert!(wrong <= 4, "{wrong}");
        assert!((region.centre[0] - 4.0).abs() < 0.3 && found.len() > 500);
        for k in 0..50 {
            let p = [0.03 * f64::from(k + 1), 0.1 * f64::from(k) - 2.5];
            let q = region.polar(region.at(p));
            assert!((p[0] - q[0]).abs() < 1e-12 && (p[1] - q[1]).abs() < 1e-9);
        }
        assert!(
            Region::circle([1.0, 2.0], 0.5).contains([1.3, 2.3])
                && !Region::circle([1.0, 2.0], 0.5).contains([1.4, 2.4])
        );
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert!(Region::polygon(&[[0.0; 2]; 2], 8).unwrap_err().contains("not 2"));
        assert!(Region::polygon(&[[0.0; 2]; 3], 8).unwrap_err().contains("no area"));
        let horns = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [8.0, 9.0], [8.0, 0.5], [1.0, 0.5], [1.0, 9.0], [0.0, 9.0]];
        assert!(Region::polygon(&horns, 8).unwrap_err().contains("cut it in parts"));
        assert!(Region::circle([0.0; 2], -1.0).check().is_err() && Region::circle([f64::NAN; 2], 1.0).check().is_err());
        assert!(Region::circle([0.0; 2], 1.0).check().is_ok());
    }
}
