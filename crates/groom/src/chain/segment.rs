//! How near two segments come.

use pelage_geom::Vec3;
use pelage_geom::curve::foot;

/// Segments whose angle's sine is below this get their ends compared as well, for where they are parallel the place of
/// closest approach is rounding noise. At 1e-6 its error is 1e-10 of a length. Below 1e-15 noise would be believed;
/// above costs time.
const PARALLEL: f64 = 1e-6;

/// Where two segments come closest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Least distance, scene units.
    pub distance: f64,
    /// Places of it, from 0 (first end) to 1 on each segment. Where segments are parallel and lie beside each other
    /// there are many, and this is one of them.
    pub at: [f64; 2],
}

/// Distance from `p` to segment `s`.
pub fn point_distance(p: Vec3, s: [Vec3; 2]) -> f64 {
    (s[0] + (s[1] - s[0]) * foot(p, s) - p).norm()
}

/// Closest approach of two segments (Golodetz 2007, §5.1); either may be a point.
///
/// The squared distance is a convex quadratic of the two places: its minimum over the unit square is where the lines
/// come closest, or has an end of a segment in it. The lines' places come from cross products, which lose no digits
/// to cancellation where the segments are nearly parallel; the second is then the foot of the first, so that what
/// error the first has moves the distance only by its sine.
pub fn approach(a: [Vec3; 2], b: [Vec3; 2]) -> Approach {
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let between = |s: f64, t: f64| Approach { distance: (w + v * t - u * s).norm(), at: [s, t] };
    let normal = u.cross(&v);
    let square = normal.norm_squared();
    let mut best = between(0.0, foot(a[0], b));
    if square > 0.0 {
        let s = w.cross(&v).dot(&normal) / square;
        let t = w.cross(&u).dot(&normal) / square;
        let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        if inside {
            let crossing = between(s, foot(a[0] + u * s, b));
            if square > PARALLEL * PARALLEL * u.norm_squared() * v.norm_squared() {
                return crossing;
            }
            best = nearer(best, crossing);
        }
    }
    best = nearer(best, between(1.0, foot(a[1], b)));
    best = nearer(best, between(foot(b[0], a), 0.0));
    nearer(best, between(foot(b[1], a), 1.0))
}

fn nearer(a: Approach, b: Approach) -> Approach {
    if b.distance < a.distance { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;

    fn random(id: u64, step: u64) -> Vec3 {
        Vec3::from_fn(|i, _| 2.0 * rng::uniform(3, id, step, i as u64) - 1.0)
    }

    /// Least distance by a search along `a`: from a place on it to `b` is convex.
    fn searched(a: [Vec3; 2], b: [Vec3; 2]) -> f64 {
        let at = |s: f64| point_distance(a[0] + (a[1] - a[0]) * s, b);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..120 {
            let (s, t) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if at(s) < at(t) { high = t } else { low = s }
        }
        at(low).min(at(0.0)).min(at(1.0))
    }

    #[test]
    fn it_is_what_a_search_finds() {
        let mut inside = 0;
        for id in 0..20_000 {
            let mut p: [Vec3; 4] = std::array::from_fn(|k| random(id, k as u64));
            match id % 8 {
                // Short, far, parallel, points, sharing an end, all in one line, at a small angle.
                1 => p[1] = p[0] + (p[1] - p[0]) * 1e-3,
                2 => p[3] = p[2] + (p[1] - p[0]) * 0.7,
                3 => p[1] = p[0],
                4 => p[2] = p[1],
                5 => (p[2], p[3]) = (p[0] + (p[1] - p[0]) * 0.4, p[0] + (p[1] - p[0]) * random(id, 9).x * 3.0),
                6 => p[3] = p[2] - (p[1] - p[0]) * 0.9 + random(id, 8) * 1e-7,
                7 => (p[1], p[3]) = (p[0], p[2]),
                _ => {}
            }
            let (a, b) = ([p[0], p[1]], [p[2], p[3]]);
            let found = approach(a, b);
            let want = searched(a, b);
            assert!((found.distance - want).abs() < 2e-8, "{id}: {} {want}", found.distance);
            let [s, t] = found.at;
            assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t));
            let apart = (a[0] + (a[1] - a[0]) * s - b[0] - (b[1] - b[0]) * t).norm();
            assert!((apart - found.distance).abs() < 1e-14);
            assert!((approach(b, a).distance - found.distance).abs() < 1e-14);
            inside += usize::from(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0);
        }
        assert!(inside > 1000, "{inside}");
    }

    #[test]
    fn crossings_at_any_angle_are_exact_to_rounding() {
        for id in 0..2000 {
            // Two segments that come closest at known places, at a distance and an angle down to nothing.
            let x = random(id, 0).normalize();
            let n = x.cross(&random(id, 1)).normalize();
            let angle = libm::pow(10.0, -14.0 * rng::uniform(3, id, 5, 0));
            let y = x * libm::cos(angle) + x.cross(&n) * libm::sin(angle);
            let gap = if id % 2 == 0 { 0.0 } else { rng::uniform(3, id, 6, 0) };
            let middle = random(id, 2);
            let [s, t, k, l] = std::array::from_fn(|c| 0.1 + 0.8 * rng::uniform(3, id, 7, c as u64));
            let a = [middle - x * s * k * 3.0, middle + x * (1.0 - s) * k * 3.0];
            let b = [middle + n * gap - y * t * l, middle + n * gap + y * (1.0 - t) * l];
            let found = approach(a, b);
            assert!((found.distance - gap).abs() < 2e-15, "{id} {angle:e}: {:e} {gap:e}", found.distance);
            if angle > 1e-3 {
                let off = (found.at[0] - s).abs().max((found.at[1] - t).abs());
                assert!(off < 1e-9, "{id} {angle:e}: {off:e}");
            }
        }
    }
}
