//! Smooth curves through and near polylines: Hermite pieces and uniform cubic B-splines.
//!
//! After Chang, Jin, Yu (course notes 2003, "sparse guide hairs"), §2.2: guide hairs are smoothed by Hermite pieces,
//! turned into B-splines and edited by their control points.

use nalgebra::{DMatrix, DVector};
use pelage_geom::Vec3;

/// Points a piece: enough for any number of control points up to the number of points.
const PARTS: usize = 4;

/// Unit tangents at the points of a polyline: the mean direction of the two segments that meet there; at the ends the
/// direction of the only one. Zero where segments have no length or turn right back.
pub fn tangents(points: &[Vec3]) -> Vec<Vec3> {
    let unit = |v: Vec3| v.try_normalize(0.0).unwrap_or_default();
    let segment: Vec<Vec3> = points.windows(2).map(|w| unit(w[1] - w[0])).collect();
    let at = |k: usize| k.checked_sub(1).and_then(|k| segment.get(k)).copied().unwrap_or_default();
    (0..points.len()).map(|k| unit(at(k) + segment.get(k).copied().unwrap_or_default())).collect()
}

/// A polyline with every segment cut in `parts` on its Hermite piece: a curve through the same points without kinks.
/// Its tangents are [`tangents`] times the length of the segment. (N - 1) `parts` + 1 points.
pub fn smooth(points: &[Vec3], parts: usize) -> Vec<Vec3> {
    let tangent = tangents(points);
    let mut out: Vec<Vec3> = points.first().copied().into_iter().collect();
    for (k, w) in points.windows(2).enumerate() {
        let length = (w[1] - w[0]).norm();
        let (from, to) = (tangent[k] * length, tangent[k + 1] * length);
        for part in 1..parts {
            out.push(hermite(w[0], from, w[1], to, part as f64 / parts as f64));
        }
        out.push(w[1]);
    }
    out
}

/// The cubic from `a` to `b` with derivatives `da` and `db` there, at `t` in [0, 1].
pub fn hermite(a: Vec3, da: Vec3, b: Vec3, db: Vec3, t: f64) -> Vec3 {
    let u = 1.0 - t;
    (a * (1.0 + 2.0 * t) + da * t) * (u * u) + (b * (1.0 + 2.0 * u) - db * u) * (t * t)
}

/// Parameters in [0, 1] of the points of a polyline by their arc length; equal steps if it has no length.
pub fn arc_parameters(points: &[Vec3]) -> Vec<f64> {
    let mut arc = vec![0.0];
    for w in points.windows(2) {
        arc.push(arc[arc.len() - 1] + (w[1] - w[0]).norm());
    }
    arc.truncate(points.len());
    let total = arc.last().copied().unwrap_or(0.0);
    let last = points.len().max(2) - 1;
    (0..arc.len()).map(|k| if total > 0.0 { arc[k] / total } else { k as f64 / last as f64 }).collect()
}

/// A uniform cubic B-spline: M control points for M - 3 pieces of equal parameter length over [0, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct BSpline {
    /// \[M\] control points, at least 4, scene units. Moving one moves four pieces.
    pub control: Vec<Vec3>,
}

impl BSpline {
    /// The spline of `m` control points nearest to N points (least squares at their parameters in [0, 1], see
    /// [`arc_parameters`]) among those that begin in the first and end in the last of them. Says what is missing if the
    /// points do not determine it: `m` must be 4 to N, and every piece must have its share of points.
    pub fn fit(points: &[Vec3], parameters: &[f64], m: usize) -> Result<Self, String> {
        let n = points.len();
        if m < 4 || m > n {
            return Err(format!("a B-spline near {n} points can have 4 to {n} control points, not {m}"));
        }
        if parameters.len() != n || !parameters.iter().all(|t| (0.0..=1.0).contains(t)) {
            return Err(format!("{n} points need {n} parameters from 0 to 1"));
        }
        // Normal equations with the two ends as constraints (Lagrange).
        let mut left = DMatrix::zeros(m + 2, m + 2);
        let mut right = DMatrix::zeros(m + 2, 3);
        for (p, &t) in points.iter().zip(parameters) {
            let (first, w) = weights(t, m);
            for i in 0..4 {
                for j in 0..4 {
                    left[(first + i, first + j)] += w[i] * w[j];
                }
                (0..3).for_each(|c| right[(first + i, c)] += w[i] * p[c]);
            }
        }
        for (row, t, p) in [(m, 0.0, points[0]), (m + 1, 1.0, points[n - 1])] {
            let (first, w) = weights(t, m);
            for i in 0..4 {
                left[(row, first + i)] = w[i];
                left[(first + i, row)] = w[i];
            }
            (0..3).for_each(|c| right[(row, c)] = p[c]);
        }
        let factored = left.lu();
        let pivot = factored.lu_internal().diagonal().abs();
        // Sound fits have pivots of 1e-4 and more.
        if pivot.iter().any(|p| !(*p).is_finite() || *p < 1e-10) {
            return Err(format!("{n} points at these parameters do not determine {m} control points"));
        }
        let column = |c: usize| -> Option<DVector<f64>> { factored.solve(&right.column(c).into_owned()) };
        match (column(0), column(1), column(2)) {
            (Some(x), Some(y), Some(z)) => {
                Ok(BSpline { control: (0..m).map(|k| Vec3::new(x[k], y[k], z[k])).collect() })
            }
            _ => Err(format!("{n} points at these parameters do not determine {m} control points")),
        }
    }

    /// The spline of `m` control points nearest to a polyline smoothed by Hermite pieces ([`smooth`]), with its ends.
    pub fn near(points: &[Vec3], m: usize) -> Result<Self, String> {
        BSpline::fit_smoothed(points, m).map(|(spline, _)| spline)
    }

    /// The same, and the parameters of the smoothed points.
    fn fit_smoothed(points: &[Vec3], m: usize) -> Result<(Self, Vec<f64>), String> {
        let curve = smooth(points, PARTS);
        let parameters = arc_parameters(&curve);
        Ok((BSpline::fit(&curve, &parameters, m)?, parameters))
    }

    /// The points of a polyline moved onto the spline of `m` control points near it (see [`BSpline::near`]), each to where it
    /// is among them by arc length.
    pub fn through(points: &[Vec3], m: usize) -> Result<Vec<Vec3>, String> {
        let (spline, parameters) = BSpline::fit_smoothed(points, m)?;
        Ok(parameters.iter().step_by(PARTS).map(|t| spline.at(*t)).collect())
    }

    /// Point at `t`, clamped to [0, 1]; the first control point, or zero, of less than four.
    pub fn at(&self, t: f64) -> Vec3 {
        if self.control.len() < 4 {
            return self.control.first().copied().unwrap_or_default();
        }
        let (first, w) = weights(t, self.control.len());
        (0..4).fold(Vec3::zeros(), |s, i| s + self.control[first + i] * w[i])
    }

    /// Derivative by `t` there; zero for less than four control points.
    pub fn derivative(&self, t: f64) -> Vec3 {
        if self.control.len() < 4 {
            return Vec3::zeros();
        }
        let (first, u) = place(t, self.control.len());
        let d = |i: usize| self.control[first + i + 1] - self.control[first + i];
        let w = [0.5 * (1.0 - u) * (1.0 - u), 0.5 + u * (1.0 - u), 0.5 * u * u];
        (0..3).fold(Vec3::zeros(), |s, i| s + d(i) * w[i]) * (self.control.len() - 3) as f64
    }

    /// `n` points at equal steps of the parameter.
    pub fn points(&self, n: usize) -> Vec<Vec3> {
        (0..n).map(|k| self.at(k as f64 / (n.max(2) - 1) as f64)).collect()
    }
}

/// Piece and parameter within it of a spline of `m` control points.
fn place(t: f64, m: usize) -> (usize, f64) {
    let at = t.clamp(0.0, 1.0) * (m - 3) as f64;
    let piece = (at as usize).min(m - 4);
    (piece, at - piece as f64)
}

/// First of four control points and their weights.
fn weights(t: f64, m: usize) -> (usize, [f64; 4]) {
    let (piece, u) = place(t, m);
    let v = 1.0 - u;
    let (u2, u3) = (u * u, u * u * u);
    (piece, [v * v * v, 3.0 * u3 - 6.0 * u2 + 4.0, 1.0 + 3.0 * (u + u2 - u3), u3].map(|w| w / 6.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;

    fn random(n: usize) -> Vec<Vec3> {
        (0..n as u64).map(|k| Vec3::from_fn(|i, _| rng::uniform(8, k, 0, i as u64))).collect()
    }

    fn cubic(t: f64) -> Vec3 {
        Vec3::new(1.0, 2.0, -1.0) + Vec3::new(0.3, -2.0, 1.0) * t + Vec3::new(2.0, 0.5, 0.0) * t * t
            - Vec3::new(1.0, 1.0, 3.0) * (t * t * t)
    }

    #[test]
    fn cubics_are_reproduced_and_ends_met() {
        let t: Vec<f64> = (0..30).map(|k| f64::from(k) / 29.0).map(|t| t * (0.5 + 0.5 * t)).collect();
        let points: Vec<Vec3> = t.iter().map(|t| cubic(*t)).collect();
        for m in [4, 5, 9, 12] {
            let s = BSpline::fit(&points, &t, m).expect("a spline");
            for k in 0..=50 {
                let t = f64::from(k) / 50.0;
                assert!((s.at(t) - cubic(t)).norm() < 1e-9, "{m} {t}");
            }
            let slope = (cubic(0.4 + 1e-5) - cubic(0.4 - 1e-5)) / 2e-5;
            assert!((s.derivative(0.4) - slope).norm() < 1e-7);
        }
        // Anything else: the ends, and no control points are better.
        let points = random(25);
        let t = arc_parameters(&points);
        let s = BSpline::fit(&points, &t, 8).expect("a spline");
        assert!((s.at(0.0) - points[0]).norm() < 1e-10 && (s.at(1.0) - points[24]).norm() < 1e-10);
        let off = |s: &BSpline| points.iter().zip(&t).map(|(p, t)| (s.at(*t) - p).norm_squared()).sum::<f64>();
        let least = off(&s);
        for k in 3..5 {
            // Control points 3 and 4 are in neither end.
            for h in [1e-3, -1e-3] {
                let mut moved = s.clone();
                moved.control[k].y += h;
                assert!(off(&moved) > least);
            }
        }
    }

    #[test]
    fn as_many_control_points_as_points_go_through_them() {
        let points = random(12);
        let t: Vec<f64> = (0..12).map(|k| f64::from(k) / 11.0).collect();
        let s = BSpline::fit(&points, &t, 12).expect("a spline");
        assert!(points.iter().zip(&t).all(|(p, t)| (s.at(*t) - p).norm() < 1e-8));
        assert_eq!(s.points(3).len(), 3);
        let of = |n: usize, m: usize| BSpline::fit(&random(n), &vec![0.5; n], m).err().unwrap_or_default();
        assert!(of(3, 4).contains("not 4") && of(9, 3).contains("not 3") && of(9, 7).contains("do not determine"));
        assert!(BSpline::fit(&points, &[2.0; 12], 5).is_err());
        let short = BSpline { control: vec![Vec3::x(); 3] };
        assert_eq!((short.at(0.5), short.derivative(0.5)), (Vec3::x(), Vec3::zeros()));
    }

    #[test]
    fn a_smooth_curve_goes_through_its_points_without_kinks() {
        let points = random(7);
        let s = smooth(&points, 64);
        assert_eq!(s.len(), 6 * 64 + 1);
        for (k, t) in tangents(&points).iter().enumerate() {
            assert_eq!(s[64 * k], points[k]);
            for side in [(64 * k).checked_sub(1), Some(64 * k)].into_iter().flatten().filter(|&i| i + 1 < s.len()) {
                assert!((s[side + 1] - s[side]).normalize().dot(t) > 0.995);
            }
        }
        // On a circle it is near to it, by the fourth power of the step.
        let circle = |n: usize| -> Vec<Vec3> {
            (0..=n)
                .map(|k| std::f64::consts::TAU * k as f64 / n as f64)
                .map(|a| Vec3::new(libm::cos(a), libm::sin(a), 0.0))
                .collect()
        };
        let off = |n: usize| {
            let all = smooth(&circle(n), 8);
            // The first and last piece have the tangents of their chords.
            all[8..all.len() - 8].iter().map(|p| (p.norm() - 1.0).abs()).fold(0.0, f64::max)
        };
        assert!(off(12) < 3e-3 && off(24) < off(12) / 3.0, "{} {}", off(12), off(24));
        let ring = circle(24);
        let near = BSpline::near(&ring, 12).expect("a spline");
        assert!((0..=100).map(|k| near.at(f64::from(k) * 0.01)).all(|p| (p.norm() - 1.0).abs() < 0.01));
        assert!((near.at(0.0) - ring[0]).norm() < 1e-9 && BSpline::near(&[], 4).is_err());
        assert!(smooth(&[], 4).is_empty() && smooth(&[Vec3::x()], 4) == vec![Vec3::x()]);
        assert_eq!(arc_parameters(&[Vec3::zeros(), Vec3::x(), Vec3::x() * 4.0]), vec![0.0, 0.25, 1.0]);
        assert_eq!(arc_parameters(&[Vec3::x(); 3]), vec![0.0, 0.5, 1.0]);
    }
}
