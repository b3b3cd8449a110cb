//! Polylines: length, resampling, closest point.

use crate::Vec3;

/// Sum of the straight segments, in the units of the points.
pub fn length(points: &[[f32; 3]]) -> f64 {
    let at = |p: &[f32; 3]| Vec3::from(p.map(f64::from));
    points.windows(2).map(|w| (at(&w[1]) - at(&w[0])).norm()).sum()
}

/// How far, relative to their mean, the segments of a resampled polyline may differ before plain arc length is used.
const UNEQUAL: f64 = 1e-6;

/// `n` points on the polyline, its ends kept, so that the straight segments between them are equal (to 1e-6 of their
/// length). Where no such points are found (a polyline that folds back within a segment) they lie at equal arc length
/// instead. A polyline without length gives `n` copies of its first point; none gives none.
///
/// Points are laid off with a pair of compasses: each is the first at distance c from the one before. The opening c
/// that ends at the end is found between 0 and the arc length over n - 1, where the last point surely lies beyond.
pub fn resample(points: &[Vec3], n: usize) -> Vec<Vec3> {
    let Some(&first) = points.first() else { return Vec::new() };
    let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    if n < 2 || !(total > 0.0 && total.is_finite()) {
        return vec![first; n];
    }
    let steps = n - 1;
    let (mut low, mut high) = (0.0, total / steps as f64);
    let (mut below, mut beyond) = (-total, overshoot(points, total, high, steps, &mut Vec::new()));
    let mut opening = high;
    let mut laid = Vec::with_capacity(n);
    // Regula falsi, Illinois variant: an end that stays put twice counts half.
    let mut last_moved_low = None;
    for _ in 0..60 {
        let guess = if beyond > 0.0 { (low * beyond - high * below) / (beyond - below) } else { high };
        opening = if guess > low && guess <= high { guess } else { 0.5 * (low + high) };
        let off = overshoot(points, total, opening, steps, &mut laid);
        if off.abs() <= 1e-12 * total {
            break;
        }
        let again = last_moved_low == Some(off < 0.0);
        last_moved_low = Some(off < 0.0);
        if off < 0.0 {
            (low, below) = (opening, off);
            beyond *= if again { 0.5 } else { 1.0 };
        } else {
            (high, beyond) = (opening, off);
            below *= if again { 0.5 } else { 1.0 };
        }
    }
    laid.truncate(steps);
    laid.push(points[points.len() - 1]);
    let equal =
        laid.len() == n && laid.windows(2).all(|w| ((w[1] - w[0]).norm() - opening).abs() <= 0.5 * UNEQUAL * opening);
    if equal { laid } else { by_arc_length(points, total, n) }
}

/// Lays off `steps` chords of length `opening` along the polyline, which goes straight on beyond its end, into `laid`
/// (start included); returns the arc length of the last point minus `total`.
fn overshoot(points: &[Vec3], total: f64, opening: f64, steps: usize, laid: &mut Vec<Vec3>) -> f64 {
    laid.clear();
    laid.push(points[0]);
    let (mut at, mut segment, mut arc) = (points[0], 0, 0.0);
    for done in 0..steps {
        // First segment whose end is farther than the opening; `arc` is the arc length at its start.
        while segment + 1 < points.len() && (points[segment + 1] - at).norm() < opening {
            arc += (points[segment + 1] - points[segment]).norm();
            segment += 1;
        }
        if segment + 1 >= points.len() {
            // What is missing, in straight chords.
            let missing = (points[points.len() - 1] - at).norm();
            return opening * (steps - done) as f64 - missing;
        }
        let (a, side) = (points[segment], points[segment + 1] - points[segment]);
        let offset = a - at;
        let (half, square) = (offset.dot(&side), side.norm_squared());
        let root = (half * half - square * (offset.norm_squared() - opening * opening)).max(0.0).sqrt();
        // The way out of the sphere, written without cancellation.
        let t = if half > 0.0 {
            (opening * opening - offset.norm_squared()) / (half + root)
        } else {
            (root - half) / square
        };
        at = a + side * t.clamp(0.0, 1.0);
        laid.push(at);
    }
    arc + (at - points[segment]).norm() - total
}

/// `n` >= 2 points at equal arc length.
fn by_arc_length(points: &[Vec3], total: f64, n: usize) -> Vec<Vec3> {
    let mut out = vec![points[0]];
    let (mut segment, mut arc) = (0, 0.0);
    for k in 1..n - 1 {
        let target = total * k as f64 / (n - 1) as f64;
        let mut side = (points[segment + 1] - points[segment]).norm();
        while arc + side < target && segment + 2 < points.len() {
            arc += side;
            segment += 1;
            side = (points[segment + 1] - points[segment]).norm();
        }
        let t = if side > 0.0 { ((target - arc) / side).clamp(0.0, 1.0) } else { 0.0 };
        out.push(points[segment] + (points[segment + 1] - points[segment]) * t);
    }
    out.push(points[points.len() - 1]);
    out
}

/// Place on a segment nearest to `q`, from 0 to 1; 0 if the segment has no length.
pub fn foot(q: Vec3, segment: [Vec3; 2]) -> f64 {
    let side = segment[1] - segment[0];
    let square = side.norm_squared();
    if square > 0.0 { (side.dot(&(q - segment[0])) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// Closest point of a polyline: segment, parameter along it in [0, 1], position, distance. Ties go to the first
/// segment. A single point is segment 0 at 0; no point is infinitely far.
pub fn closest_on_polyline(points: &[Vec3], q: Vec3) -> (usize, f64, Vec3, f64) {
    let Some(&first) = points.first() else { return (0, 0.0, q, f64::INFINITY) };
    let mut best = (0, 0.0, first, (q - first).norm_squared());
    for (k, w) in points.windows(2).enumerate() {
        let t = foot(q, [w[0], w[1]]);
        let p = if t == 1.0 { w[1] } else { w[0] + (w[1] - w[0]) * t };
        let d = (q - p).norm_squared();
        if d < best.3 {
            best = (k, t, p, d);
        }
    }
    (best.0, best.1, best.2, best.3.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn helix(n: usize, turns: f64) -> Vec<Vec3> {
        let at = |i: usize| {
            let x = i as f64 / (n - 1) as f64;
            let a = turns * std::f64::consts::TAU * x;
            Vec3::new(libm::cos(a), libm::sin(a), 2.0 * x * x)
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn length_is_the_sum_of_segments() {
        assert_eq!(length(&[]), 0.0);
        assert_eq!(length(&[[1.0; 3]]), 0.0);
        assert_eq!(length(&[[0.0; 3], [3.0, 4.0, 0.0], [3.0, 4.0, 2.0]]), 7.0);
    }

    #[test]
    fn resampled_segments_are_equal_and_lie_on_the_polyline() {
        for (points, n) in [(helix(50, 1.5), 20), (helix(7, 0.8), 40), (helix(200, 3.0), 8), (helix(3, 0.3), 2)] {
            let out = resample(&points, n);
            assert_eq!((out.len(), out[0], out[n - 1]), (n, points[0], points[points.len() - 1]));
            let chords: Vec<f64> = out.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
            let mean = chords.iter().sum::<f64>() / chords.len() as f64;
            assert!(chords.iter().all(|c| (c / mean - 1.0).abs() < 1e-6), "{n}: {chords:?}");
            assert!(out.iter().all(|p| closest_on_polyline(&points, *p).3 < 1e-9));
            // In order along it.
            let place: Vec<f64> =
                out.iter().map(|p| closest_on_polyline(&points, *p)).map(|c| c.0 as f64 + c.1).collect();
            assert!(place.windows(2).all(|w| w[1] >= w[0] - 1e-9));
        }
    }

    #[test]
    fn a_straight_line_is_parted_evenly_whatever_its_points() {
        let points = [0.0, 0.1, 0.1, 0.7, 2.0].map(|x| Vec3::new(x, -x, 0.0));
        for (k, p) in resample(&points, 9).iter().enumerate() {
            assert!((p - Vec3::new(1.0, -1.0, 0.0) * (0.25 * k as f64)).norm() < 1e-12);
        }
        let right_angle = [Vec3::zeros(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0)];
        let out = resample(&right_angle, 4);
        let c: Vec<f64> = out.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        assert!((c[0] - c[1]).abs() < 1e-9 && (c[1] - c[2]).abs() < 1e-9);
    }

    #[test]
    fn a_polyline_that_folds_back_is_parted_by_arc_length() {
        let fold = [Vec3::zeros(), Vec3::x(), Vec3::zeros()];
        let out = resample(&fold, 4);
        assert_eq!((out.len(), out[0], out[3]), (4, fold[0], fold[2]));
        assert!(out.iter().all(|p| (0.0..=1.0).contains(&p.x)));
        assert!((out[1].x - 2.0 / 3.0).abs() < 1e-9 && (out[2].x - 2.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn little_or_nothing_to_resample() {
        assert!(resample(&[], 5).is_empty());
        assert_eq!(resample(&[Vec3::x()], 3), vec![Vec3::x(); 3]);
        assert_eq!(resample(&[Vec3::x(); 4], 3), vec![Vec3::x(); 3]);
        assert!(resample(&helix(5, 1.0), 0).is_empty());
        assert_eq!(resample(&helix(5, 1.0), 1).len(), 1);
    }

    #[test]
    fn closest_point_of_a_polyline() {
        let l = [Vec3::zeros(), Vec3::x(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0)];
        let (segment, t, p, d) = closest_on_polyline(&l, Vec3::new(0.25, -2.0, 0.0));
        assert_eq!((segment, t, p, d), (0, 0.25, Vec3::x() * 0.25, 2.0));
        assert_eq!(closest_on_polyline(&l, Vec3::new(2.0, 0.5, 0.0)).0, 2);
        // At the shared corner the first segment has it.
        assert_eq!(closest_on_polyline(&l, Vec3::new(2.0, -1.0, 0.0)).0, 0);
        assert_eq!(closest_on_polyline(&[Vec3::x()], Vec3::zeros()), (0, 0.0, Vec3::x(), 1.0));
        assert_eq!(closest_on_polyline(&[], Vec3::zeros()).3, f64::INFINITY);
        for k in 0..200u64 {
            let points = helix(12, 1.3);
            let q = Vec3::from([0.0, 1.0, 2.0]).map(|c| 3.0 * crate::rng::uniform(9, k, 0, c as u64) - 1.0);
            let found = closest_on_polyline(&points, q);
            let brute =
                points.windows(2).flat_map(|w| (0..=400).map(move |i| w[0] + (w[1] - w[0]) * (f64::from(i) / 400.0)));
            let least = brute.map(|p| (p - q).norm()).fold(f64::INFINITY, f64::min);
            assert!(found.3 <= least + 1e-12 && found.3 > least - 1e-3);
        }
    }
}
