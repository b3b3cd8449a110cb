//! Few links that hold a cubic B-spline (Golodetz 2007, §4, whose text is missing; the method is ours).
//!
//! The joints lie on the curve. The distance from a segment is a convex function of space, so on a Bézier piece it is
//! at most the Bernstein sum of the distances of the piece's control points, and the largest value of that sum, a cubic
//! of one variable, is known in closed form. It is the true deviation for plane arcs without inflection, and no less
//! than it for all others. Each link reaches as far along the curve as this bound allows.

use super::segment::point_distance;
use crate::spline::BSpline;
use pelage_geom::Vec3;

/// A link is long enough when it uses this part of the tolerance: more costs time, 0.9 a twentieth more links.
const ENOUGH: f64 = 0.97;

/// Links a spline may need. More is a tolerance that was mistyped, or coordinates too large for it.
const MOST: usize = 100_000;

/// Segments near a curve: link `k` is from joint `k` to joint `k + 1`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fitted {
    /// \[links + 1\] parameters of the joints, from 0 to 1, ascending.
    pub parameter: Vec<f64>,
    /// \[links + 1\] joints, points of the curve, scene units.
    pub joint: Vec<Vec3>,
    /// \[links\] No point of the curve between two joints is farther than this from the segment between them, and
    /// no point of the segment is farther from the curve. At most the tolerance.
    pub off: Vec<f64>,
}

/// The links of a curve for a tolerance (more than 0, scene units). Says what is wrong with the curve or the tolerance.
pub fn fit(curve: &BSpline, tolerance: f64) -> Result<Fitted, String> {
    let m = curve.control.len();
    if m < 4 {
        return Err(format!("a B-spline has 4 control points or more, not {m}"));
    }
    if !curve.control.iter().all(|p| p.iter().all(|x| x.is_finite())) {
        return Err("a control point is not finite".into());
    }
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(format!("a tolerance is more than 0, not {tolerance}"));
    }
    let pieces = (m - 3) as f64;
    let mut fitted = Fitted { parameter: vec![0.0], joint: vec![curve.at(0.0)], off: Vec::new() };
    let mut from = 0.0;
    while from < pieces {
        if fitted.off.len() == MOST {
            return Err(format!("a tolerance of {tolerance} takes more than {MOST} links"));
        }
        let (to, off) = reach(curve, from, tolerance)
            .ok_or_else(|| format!("a tolerance of {tolerance} is below the rounding of the curve's points"))?;
        fitted.parameter.push(to / pieces);
        fitted.joint.push(curve.at(to / pieces));
        fitted.off.push(off);
        from = to;
    }
    Ok(fitted)
}

/// How far a link from a place may go, and its deviation; `None` if it gets nowhere.
fn reach(curve: &BSpline, from: f64, tolerance: f64) -> Option<(f64, f64)> {
    let end = (curve.control.len() - 3) as f64;
    let (mut low, mut high, mut found) = (from, end, 0.0);
    let mut to = end;
    loop {
        let off = deviation(curve, from, to);
        if off <= tolerance {
            (low, found) = (to, off);
        } else {
            high = to;
        }
        if to == end && low == end || found > ENOUGH * tolerance || (high - low) <= 1e-3 * (low - from) {
            return Some((low, found));
        }
        // The deviation grows as the square of the length, or nearly.
        let middle = 0.5 * (low + high);
        let guess = from + (to - from) * (0.5 * (1.0 + ENOUGH) * tolerance / off).sqrt();
        let aside = 0.02 * (high - low);
        to = if guess > low + aside && guess < high - aside { guess } else { middle };
        if to <= low || to >= high {
            return (low > from).then_some((low, found));
        }
    }
}

/// Bound of the distance of the curve from its chord between two places, in pieces from the root.
fn deviation(curve: &BSpline, from: f64, to: f64) -> f64 {
    let pieces = (curve.control.len() - 3) as f64;
    let chord = [curve.at(from / pieces), curve.at(to / pieces)];
    let mut most = 0.0f64;
    let mut piece = from as usize;
    while (piece as f64) < to {
        let start = piece as f64;
        let b = bezier(curve, piece, (from - start).max(0.0), (to - start).min(1.0));
        most = most.max(largest(b.map(|p| point_distance(p, chord))));
        piece += 1;
    }
    // What rounding may add to points of this size.
    most + 8.0 * f64::EPSILON * (chord[0].norm() + chord[1].norm() + most)
}

/// Bézier control points of one piece from `u` to `v`, both in [0, 1]: the values of its polar form there.
fn bezier(curve: &BSpline, piece: usize, u: f64, v: f64) -> [Vec3; 4] {
    let c = &curve.control[piece..piece + 4];
    let polar = |x: f64, y: f64, z: f64| {
        let a: [Vec3; 3] = std::array::from_fn(|i| c[i].lerp(&c[i + 1], (x + (2 - i) as f64) / 3.0));
        let b: [Vec3; 2] = std::array::from_fn(|i| a[i].lerp(&a[i + 1], (y + (1 - i) as f64) / 2.0));
        b[0].lerp(&b[1], z)
    };
    [polar(u, u, u), polar(u, u, v), polar(u, v, v), polar(v, v, v)]
}

/// Largest value on [0, 1] of a cubic with the Bernstein coefficients `d`.
fn largest(d: [f64; 4]) -> f64 {
    let at = |t: f64| {
        let s = 1.0 - t;
        s * s * (s * d[0] + 3.0 * t * d[1]) + t * t * (3.0 * s * d[2] + t * d[3])
    };
    // Its derivative is 3 (a (1-t)^2 + 2 b (1-t) t + c t^2), with roots t = a / (a + q) and q / (q + c).
    let (a, b, c) = (d[1] - d[0], d[2] - d[1], d[3] - d[2]);
    let square = (b * b - a * c).max(0.0).sqrt();
    let q = -(b + if b < 0.0 { -square } else { square });
    let mut most = d[0].max(d[3]);
    for (top, bottom) in [(a, a + q), (q, q + c)] {
        let t = top / bottom;
        if (0.0..=1.0).contains(&t) {
            most = most.max(at(t));
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;

    fn random(id: u64, m: usize, rough: f64) -> BSpline {
        let mut p = Vec3::zeros();
        let control = (0..m as u64).map(|k| {
            p += Vec3::from_fn(|i, _| rough * (rng::uniform(4, id, k, i as u64) - 0.5)) + Vec3::z();
            p
        });
        BSpline { control: control.collect() }
    }

    #[test]
    fn the_largest_value_of_a_cubic_is_found() {
        for id in 0..3000 {
            let mut d: [f64; 4] = std::array::from_fn(|k| rng::uniform(5, id, k as u64, 0));
            match id % 4 {
                1 => (d[0], d[3]) = (0.0, 0.0),
                2 => d = [d[0]; 4],
                3 => (d[2], d[3]) = (2.0 * d[1] - d[0], 3.0 * d[1] - 2.0 * d[0]),
                _ => {}
            }
            let at = |t: f64| {
                let s = 1.0 - t;
                s * s * s * d[0] + 3.0 * s * t * (s * d[1] + t * d[2]) + t * t * t * d[3]
            };
            let want = (0..=2000).map(|k| at(f64::from(k) / 2000.0)).fold(0.0, f64::max);
            let found = largest(d);
            assert!(found > want - 1e-12 && found < want + 1e-6, "{d:?}: {found} {want}");
        }
    }

    #[test]
    fn bezier_points_are_those_of_the_curve() {
        let s = random(1, 9, 4.0);
        for (piece, u, v) in [(0, 0.0, 1.0), (3, 0.25, 0.5), (5, 0.1, 1.0)] {
            let b = bezier(&s, piece, u, v);
            for k in 0..=10 {
                let t = f64::from(k) / 10.0;
                let w = 1.0 - t;
                let p = b[0] * (w * w * w) + (b[1] * w + b[2] * t) * (3.0 * w * t) + b[3] * (t * t * t);
                let at = (piece as f64 + u + (v - u) * t) / 6.0;
                assert!((p - s.at(at)).norm() < 1e-13);
            }
        }
    }

    #[test]
    fn links_hold_the_curve_and_are_near_it() {
        for id in 0..60 {
            let s = random(id, 4 + id as usize % 9, [0.3, 3.0, 12.0][id as usize % 3]);
            for tolerance in [0.5, 0.02, 1e-4] {
                let f = fit(&s, tolerance).expect("links");
                assert_eq!((f.parameter[0], f.parameter[f.off.len()]), (0.0, 1.0));
                assert_eq!((f.joint.len(), f.parameter.len()), (f.off.len() + 1, f.off.len() + 1));
                for (k, off) in f.off.iter().enumerate() {
                    assert!(*off <= tolerance && f.parameter[k] < f.parameter[k + 1]);
                    let chord = [f.joint[k], f.joint[k + 1]];
                    let curve: Vec<Vec3> = (0..=100)
                        .map(|i| f64::from(i) * 0.01)
                        .map(|t| s.at(f.parameter[k] * (1.0 - t) + f.parameter[k + 1] * t))
                        .collect();
                    let far = curve.iter().map(|p| point_distance(*p, chord)).fold(0.0, f64::max);
                    assert!(far <= *off, "{id}: {far} {off}");
                    // The bound is no gross one, and links but the last use the tolerance.
                    assert!(far > 0.4 * off || *off < 1e-9, "{id} {tolerance}: {far} of {off}");
                    assert!(k + 1 == f.off.len() || *off > 0.9 * tolerance, "{id}: {off} of {tolerance}");
                    // The other way round.
                    for t in (0..=10).map(|i| f64::from(i) * 0.1) {
                        let p = chord[0].lerp(&chord[1], t);
                        let near = curve.windows(2).map(|w| point_distance(p, [w[0], w[1]]));
                        assert!(near.fold(f64::MAX, f64::min) < off * (1.0 + 1e-3) + 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn links_are_few() {
        // On a circle a chord of half-angle h is off by R (1 - cos h).
        let ring = |k: usize| Vec3::new(libm::cos(0.05 * k as f64), libm::sin(0.05 * k as f64), 0.0) * 10.0;
        let arc = BSpline { control: (0..63).map(ring).collect() };
        let angle = 60.0 * 0.05;
        for tolerance in [1.0, 0.1, 1e-3, 1e-5] {
            let half = 2.0 * libm::asin((tolerance / 20.0f64).sqrt());
            let least = libm::ceil(angle / (2.0 * half) * 0.999) as usize;
            let links = fit(&arc, tolerance).expect("links").off.len();
            assert!((least..=least + 1 + least / 50).contains(&links), "{tolerance}: {links} of {least}");
        }
        // No choice of joints among many places of a curve takes much less, even by its true deviation.
        for id in 0..6 {
            let s = random(id, 10, 5.0);
            let at: Vec<Vec3> = s.points(281);
            let far =
                |i: usize, j: usize| at[i..=j].iter().map(|p| point_distance(*p, [at[i], at[j]])).fold(0.0, f64::max);
            let mut least = vec![0usize];
            for j in 1..at.len() {
                let best = (0..j).filter(|&i| far(i, j) <= 0.05).map(|i| least[i] + 1).min();
                least.push(best.expect("a link"));
            }
            let (links, want) = (fit(&s, 0.05).expect("links").off.len(), least[280]);
            assert!(links <= want + 1 + want / 8, "{id}: {links} of {want}");
        }
        let straight = BSpline { control: (0..9u8).map(|k| Vec3::new(0.3, 0.1, 0.7) * f64::from(k * k)).collect() };
        assert_eq!(fit(&straight, 1e-9).expect("links").off.len(), 1);
    }

    #[test]
    fn what_cannot_be_fitted_is_told() {
        let s = random(1, 6, 3.0);
        assert!(fit(&s, 0.0).is_err() && fit(&s, f64::NAN).is_err() && fit(&s, 1e-300).is_err());
        assert!(fit(&BSpline { control: vec![Vec3::x(); 3] }, 0.1).is_err());
        assert!(fit(&BSpline { control: vec![Vec3::repeat(f64::NAN); 5] }, 0.1).is_err());
        let point = fit(&BSpline { control: vec![Vec3::x(); 5] }, 0.1).expect("a link");
        assert!(point.joint.len() == 2 && point.joint.iter().all(|p| (p - Vec3::x()).norm() < 1e-15));
        // Out and back the same way.
        let back = BSpline { control: [0.0, 1.0, 2.0, 1.0, 0.0].map(|x| Vec3::x() * x).into() };
        let f = fit(&back, 0.01).expect("links");
        assert!(f.off.len() == 2 && f.off.iter().all(|o| *o <= 0.01), "{f:?}");
    }
}
