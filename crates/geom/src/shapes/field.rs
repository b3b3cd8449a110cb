//! Signed fields that bodies are modelled from: roundish primitives, smooth joins, and bumps of bounded support.
//!
//! Every field is negative inside and close to a distance near its surface. The joins are the cubic smooth minimum (I.
//! Quilez, "smooth minimum", the C2 variant), so surfaces have continuous curvature.

use crate::Vec3;

/// Short form of a point.
pub fn v(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Approximate distance to an axis-aligned ellipsoid: exact on the surface, first order beside it.
pub fn ellipsoid(p: Vec3, centre: Vec3, radius: Vec3) -> f64 {
    let a = (p - centre).component_div(&radius);
    let (k0, k1) = (a.norm(), a.component_div(&radius).norm());
    if k1 < 1e-9 { -radius.min() } else { k0 * (k0 - 1.0) / k1 }
}

/// Distance to a ball.
pub fn ball(p: Vec3, centre: Vec3, radius: f64) -> f64 {
    (p - centre).norm() - radius
}

/// Closest point of segment `a b` to `p`: (parameter in 0..1, distance).
pub fn segment(p: Vec3, a: Vec3, b: Vec3) -> (f64, f64) {
    let ab = b - a;
    let t = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
    (t, (p - a - ab * t).norm())
}

/// A limb: a segment with a radius that goes from `ra` to `rb`.
pub fn limb(p: Vec3, a: Vec3, b: Vec3, ra: f64, rb: f64) -> f64 {
    let (t, d) = segment(p, a, b);
    d - (ra + (rb - ra) * t * t * (3.0 - 2.0 * t))
}

/// A chain of limbs through `(point, radius)`, joined over `k`.
pub fn chain(p: Vec3, points: &[(Vec3, f64)], k: f64) -> f64 {
    let mut f = f64::INFINITY;
    for w in points.windows(2) {
        f = join(f, limb(p, w[0].0, w[1].0, w[0].1, w[1].1), k);
    }
    f
}

/// Catmull-Rom curve through `(point, radius)`, four segments for each given one.
pub fn spline(points: &[(Vec3, f64)]) -> Vec<(Vec3, f64)> {
    let at = |i: i64| points[i.clamp(0, points.len() as i64 - 1) as usize];
    let mut out = Vec::new();
    for i in 0..points.len() as i64 - 1 {
        let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
        for k in 0..4 {
            let t = f64::from(k) / 4.0;
            let w = [
                t * (-0.5 + t * (1.0 - 0.5 * t)),
                1.0 + t * t * (-2.5 + 1.5 * t),
                t * (0.5 + t * (2.0 - 1.5 * t)),
                t * t * (-0.5 + 0.5 * t),
            ];
            out.push((
                a.0 * w[0] + b.0 * w[1] + c.0 * w[2] + d.0 * w[3],
                a.1 * w[0] + b.1 * w[1] + c.1 * w[2] + d.1 * w[3],
            ));
        }
    }
    out.extend(points.last());
    out
}

/// Smooth union over a blend width `k` (scene units): inflates by at most k / 6 where both fields are equal.
pub fn join(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    if h > 0.0 { a.min(b) - h * h * h * k * (1.0 / 6.0) } else { a.min(b) }
}

/// Smooth intersection over a blend width `k`.
pub fn meet(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, -b, k)
}

/// 1 at `centre`, falling smoothly to 0 at the ellipsoid of semi-axes `radius`.
pub fn bump(p: Vec3, centre: Vec3, radius: Vec3) -> f64 {
    let d = (p - centre).component_div(&radius);
    falloff(d.norm_squared())
}

/// 1 on the chain of segments through `points`, falling smoothly to 0 at distance `radius`.
pub fn ridge(p: Vec3, points: &[Vec3], radius: f64) -> f64 {
    let mut d = f64::INFINITY;
    for w in points.windows(2) {
        d = join(d, segment(p, w[0], w[1]).1, 0.3 * radius);
    }
    let d = d.max(0.0) / radius;
    falloff(d * d)
}

/// `(1 - s)^3` for squared distance `s` below 1, else 0.
fn falloff(s: f64) -> f64 {
    let h = (1.0 - s).max(0.0);
    h * h * h
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `p` with x replaced by a smooth absolute value: folds the left side onto the right without a crease. `round` is the
/// half-width over which the fold is rounded.
pub fn fold(p: Vec3, round: f64) -> Vec3 {
    v((p.x * p.x + round * round).sqrt(), p.y, p.z)
}

/// `p` turned about `centre` by `degrees` around the axis x (0), y (1) or z (2), right-handed.
pub fn turn(p: Vec3, centre: Vec3, axis: usize, degrees: f64) -> Vec3 {
    let (s, c) = libm::sincos(degrees.to_radians());
    let d = p - centre;
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut q = d;
    q[i] = c * d[i] - s * d[j];
    q[j] = s * d[i] + c * d[j];
    q + centre
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joins_are_exact_away_from_the_blend_and_bounded_in_it() {
        assert_eq!(join(1.0, 3.0, 1.5), 1.0);
        assert!((join(1.0, 1.0, 1.2) - 0.8).abs() < 1e-15);
        assert_eq!(meet(1.0, 3.0, 1.5), 3.0);
    }

    #[test]
    fn ellipsoid_is_zero_on_its_surface_and_a_distance_for_a_ball() {
        let (c, r) = (v(1.0, 2.0, 3.0), v(2.0, 3.0, 4.0));
        assert!(ellipsoid(c + v(0.0, 3.0, 0.0), c, r).abs() < 1e-12);
        assert!((ellipsoid(v(4.0, 2.0, 3.0), c, v(2.0, 2.0, 2.0)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn turn_is_right_handed() {
        assert!((turn(v(1.0, 0.0, 0.0), Vec3::zeros(), 2, 90.0) - v(0.0, 1.0, 0.0)).norm() < 1e-12);
    }
}
