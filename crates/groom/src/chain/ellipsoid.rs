//! Chains against an ellipsoid (Golodetz 2007, §6).
//!
//! The paper tests the axis of a link of radius r against the ellipsoid with semi-axes longer by r. That surface lies
//! inside of the true offset wherever the curvature changes, so contacts are missed. Here the signed distance of the
//! axis is minimised. Signed distance from a convex solid is a convex function, and its gradient is the normal at the
//! closest point, so that the tangents at two places bound it from below between them: the search knows its error.

use super::Chains;
use nalgebra::UnitQuaternion;
use pelage_geom::Vec3;
use rayon::prelude::*;

/// Searches stop when the least distance is known to this part of the longest semi-axis. Ten times less is rounding.
const SURE: f64 = 1e-12;

/// Shortest semi-axis over the longest at least: the square of it is compared with 1, so that flatter ellipsoids lose
/// more digits than half.
const FLATTEST: f64 = 1e-4;

/// Newton's iterations for a closest point at most: 3 to 8 are usual.
const ITERATIONS: usize = 60;

/// A solid ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    centre: Vec3,
    turn: UnitQuaternion<f64>,
    semi_axes: Vec3,
}

/// Where a link is near an ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Hair.
    pub hair: u32,
    /// Link of the hair, counted from its root.
    pub link: u32,
    /// Distance of the link from the solid, scene units. Below 0 they meet; then it is how far the link must be moved
    /// along `normal` to be free at this place.
    pub gap: f64,
    /// Place of it on the link's axis, from 0 to 1.
    pub at: f64,
    /// Outward unit normal of the ellipsoid where it is closest to that place.
    pub normal: Vec3,
    /// Part of the axis whose distance is less than the link's radius, from 0 to 1; twice `at` if there is none.
    pub inside: [f64; 2],
}

impl Ellipsoid {
    /// An ellipsoid with its centre, the rotation of its axes and its semi-axes (scene units). Says what is wrong with
    /// them: semi-axes are more than 0 and the longest is at most 10,000 times the shortest.
    pub fn new(centre: Vec3, turn: UnitQuaternion<f64>, semi_axes: Vec3) -> Result<Self, String> {
        let finite = |x: &f64| x.is_finite();
        if !(centre.iter().all(finite) && turn.coords.iter().all(finite) && semi_axes.iter().all(finite)) {
            return Err("an ellipsoid is not finite".into());
        }
        if semi_axes.min() <= 0.0 || semi_axes.min() < FLATTEST * semi_axes.max() {
            return Err(format!("semi-axes {:?} of an ellipsoid are too unlike or not above 0", semi_axes.as_slice()));
        }
        Ok(Ellipsoid { centre, turn, semi_axes })
    }

    /// It after a translation.
    pub fn moved(&self, by: Vec3) -> Self {
        Ellipsoid { centre: self.centre + by, ..*self }
    }

    /// Signed distance (inside below 0) and outward unit normal at the closest point of the surface.
    ///
    /// The closest point x to y has x_i = a_i^2 y_i / (t + a_i^2), where t is the largest root of F(t) = sum (a_i y_i /
    /// (t + a_i^2))^2 = 1 (Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid"). Newton's
    /// method on 1 / sqrt(F), which is nearly straight, climbs to it from the left without overshooting.
    pub fn signed_distance(&self, p: Vec3) -> (f64, Vec3) {
        let a = self.semi_axes;
        let least = a.min();
        let y = self.turn.inverse_transform_vector(&(p - self.centre));
        // In units of the shortest semi-axis. On planes of symmetry, one side for the inside, where both are as near.
        let z = y.zip_map(&a, |y, a| (y.abs() / least).max(1e-18 * a / least));
        let e = a / least;
        let excess = e.map(|e| (e - 1.0) * (e + 1.0));
        let pull = e.component_mul(&z);
        // u = t + 1; where it starts one term is 1.
        let mut u = (pull - excess).max();
        for _ in 0..ITERATIONS {
            let (mut sum, mut fall) = (0.0, 0.0);
            for i in 0..3 {
                let q = pull[i] / (u + excess[i]);
                sum += q * q;
                fall += q * q / (u + excess[i]);
            }
            let next = u + (sum.sqrt() - 1.0) * sum / fall;
            if next.is_nan() || next <= u * (1.0 + 1e-16) {
                break;
            }
            u = next;
        }
        let shrink = excess.map(|x| u + x);
        // Point minus closest point is (u - 1) times the normal's components before it has length 1.
        let slope = z.component_div(&shrink);
        let distance = (u - 1.0) * slope.norm() * least;
        let outward = slope.normalize();
        let normal = Vec3::from_fn(|i, _| outward[i].copysign(y[i]));
        (distance, self.turn.transform_vector(&normal))
    }

    /// The place on a segment, from 0 to 1, of least signed distance; that distance and the normal there.
    pub fn nearest_on(&self, axis: [Vec3; 2]) -> (f64, f64, Vec3) {
        let along = axis[1] - axis[0];
        let look = |at: f64| {
            let (distance, normal) = self.signed_distance(axis[0] + along * at);
            Look { at, distance, slope: normal.dot(&along), normal }
        };
        let (mut low, mut high) = (look(0.0), look(1.0));
        let sure = SURE * self.semi_axes.max();
        if low.slope < 0.0 && high.slope > 0.0 {
            // Tangents meet at the lowest value there can be in between. Halves now and then, where a kink (on the
            // planes of symmetry inside) or a straight piece lets the tangents crawl.
            for round in 0..200 {
                let meet = (high.distance - low.distance + low.slope * low.at - high.slope * high.at)
                    / (low.slope - high.slope);
                let bound = low.distance + low.slope * (meet - low.at);
                if low.distance.min(high.distance) - bound <= sure {
                    break;
                }
                let middle = 0.5 * (low.at + high.at);
                let at = if round % 3 == 2 || !(meet > low.at && meet < high.at) { middle } else { meet };
                if at <= low.at || at >= high.at {
                    break;
                }
                let new = look(at);
                if new.slope < 0.0 { low = new } else { high = new }
            }
        }
        let best = if high.distance < low.distance { high } else { low };
        (best.at, best.distance, best.normal)
    }

    /// Part of a segment, from 0 to 1, that is nearer than `radius`, given a place `at` that is; by Newton's method from
    /// either end, which stays outside of a convex function's level.
    fn inside(&self, axis: [Vec3; 2], radius: f64, at: f64) -> [f64; 2] {
        let along = axis[1] - axis[0];
        let edge = |end: f64| {
            let mut s = end;
            for _ in 0..100 {
                let (distance, normal) = self.signed_distance(axis[0] + along * s);
                let step = (distance - radius) / normal.dot(&along);
                if distance <= radius || !step.is_finite() || step.abs() < 1e-15 {
                    break;
                }
                s = if end < at { (s - step).clamp(s, at) } else { (s - step).clamp(at, s) };
            }
            s
        };
        [edge(0.0), edge(1.0)]
    }
}

/// The signed distance at one place of a segment, and its derivative by the place.
#[derive(Clone, Copy)]
struct Look {
    at: f64,
    distance: f64,
    slope: f64,
    normal: Vec3,
}

/// All links that come within `margin` (scene units; below 0 for those that are deeper than that) of an ellipsoid, by
/// hair and link.
pub fn contacts(chains: &Chains, body: &Ellipsoid, margin: f64) -> Vec<Contact> {
    let of = |s: usize| -> Vec<Contact> {
        let mut found = Vec::new();
        for k in 0..chains.links(s) {
            let link = chains.link(s, k);
            let reach = link.radius + margin;
            // No distance changes faster than the place.
            let [a, b] = link.axis;
            let (middle, half) = ((a + b) * 0.5, 0.5 * (b - a).norm() + SURE * body.semi_axes.max());
            if (middle - body.centre).norm() - body.semi_axes.max() > reach + half
                || body.signed_distance(middle).0 > reach + half
            {
                continue;
            }
            let (at, distance, normal) = body.nearest_on(link.axis);
            if distance <= reach {
                let inside = if distance < link.radius { body.inside(link.axis, link.radius, at) } else { [at; 2] };
                found.push(Contact { hair: s as u32, link: k as u32, gap: distance - link.radius, at, normal, inside });
            }
        }
        found
    };
    (0..chains.len()).into_par_iter().map(of).collect::<Vec<_>>().concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::segment::point_distance;
    use pelage_geom::{Offsets, rng};

    fn random(id: u64, step: u64) -> Vec3 {
        Vec3::from_fn(|i, _| 2.0 * rng::uniform(6, id, step, i as u64) - 1.0)
    }

    fn some(id: u64) -> Ellipsoid {
        let axes = [Vec3::new(3.0, 2.0, 1.0), Vec3::new(1.0, 1.0, 2.5), Vec3::new(0.4, 2.0, 2.0), Vec3::repeat(1.5)];
        let turn = UnitQuaternion::from_scaled_axis(random(id, 50) * 2.0);
        Ellipsoid::new(random(id, 51), turn, axes[id as usize % 4]).expect("an ellipsoid")
    }

    /// A point of the surface and its normal.
    fn surface(e: &Ellipsoid, direction: Vec3) -> (Vec3, Vec3) {
        let d = direction.normalize();
        let normal = d.component_div(&e.semi_axes).normalize();
        (e.centre + e.turn * d.component_mul(&e.semi_axes), e.turn * normal)
    }

    #[test]
    fn points_along_a_normal_have_its_distance() {
        for id in 0..4000 {
            let e = some(id);
            let mut d = random(id, 1);
            match id % 5 {
                1 => d.x = 0.0,
                2 => d = Vec3::ith(id as usize % 3, if id % 2 == 0 { 1.0 } else { -1.0 }),
                _ => {}
            }
            let (x, n) = surface(&e, d);
            // Inward up to the least radius of curvature, which is a_min^2 / a_max.
            let least = e.semi_axes.min() * e.semi_axes.min() / e.semi_axes.max();
            for h in [-0.9 * least, -1e-7, 0.0, 1e-7, 0.3, 7.0] {
                let (found, normal) = e.signed_distance(x + n * h);
                assert!((found - h).abs() < 4e-14 * (1.0 + h.abs()), "{id} {h}: {:e}", found - h);
                assert!((normal - n).norm() < 1e-6, "{id} {h}: {normal} {n}");
            }
        }
        let e = some(0);
        let (middle, normal) = e.signed_distance(e.centre);
        assert!((middle + 1.0).abs() < 1e-12 && (normal.norm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn signed_distance_is_convex() {
        for id in 0..4000 {
            let e = some(id);
            let (mut a, mut b) = (e.centre + random(id, 2) * 3.0, e.centre + random(id, 3) * 3.0);
            if id % 3 == 0 {
                // Through the middle.
                (a, b) = (e.centre + random(id, 2) * 2.0, e.centre - random(id, 2) * 2.0);
            }
            let (fa, na) = e.signed_distance(a);
            let fb = e.signed_distance(b).0;
            let t = rng::uniform(6, id, 4, 0);
            assert!(e.signed_distance(a.lerp(&b, t)).0 <= fa + (fb - fa) * t + 1e-12);
            assert!(fb >= fa + na.dot(&(b - a)) - 1e-12);
        }
    }

    #[test]
    fn segments_come_as_near_as_dense_samples_say() {
        let mut kinds = [0; 3];
        for id in 0..1500 {
            let e = some(id);
            let (a, b) = (e.centre + random(id, 2) * 3.0, e.centre + random(id, 3) * 3.0);
            let (at, distance, normal) = e.nearest_on([a, b]);
            let sampled = (0..=400).map(|k| e.signed_distance(a.lerp(&b, f64::from(k) / 400.0)).0);
            let want = sampled.fold(f64::MAX, f64::min);
            let step = (b - a).norm() / 800.0;
            assert!(distance <= want + 1e-11 && distance >= want - step, "{id}: {distance} {want}");
            let there = e.signed_distance(a.lerp(&b, at));
            assert!((there.0 - distance).abs() < 1e-12 && (distance < 0.0 || (there.1 - normal).norm() < 1e-9));
            kinds[usize::from(distance < 0.0) + usize::from(at > 0.0 && at < 1.0)] += 1;
            let r = 0.3;
            if distance < r {
                let [low, high] = e.inside([a, b], r, at);
                assert!(low <= at && at <= high);
                for k in 0..=200 {
                    let t = f64::from(k) / 200.0;
                    let off = e.signed_distance(a.lerp(&b, t)).0 - r;
                    if t < low - 1e-9 || t > high + 1e-9 {
                        assert!(off > -1e-9, "{id}");
                    } else if t > low + 1e-9 && t < high - 1e-9 {
                        assert!(off < 1e-9, "{id} {t} {low} {high} {off}");
                    }
                }
            }
        }
        assert!(kinds.iter().all(|k| *k > 50), "{kinds:?}");
    }

    #[test]
    fn contacts_are_those_of_the_sampled_surface_and_longer_semi_axes_miss_some() {
        let e = Ellipsoid::new(Vec3::new(0.2, 0.1, -0.3), UnitQuaternion::identity(), Vec3::new(4.0, 2.0, 1.0));
        let e = e.expect("an ellipsoid");
        let n = 3000;
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let shell: Vec<Vec3> = (0..n)
            .map(|k| {
                let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(n);
                let (r, a) = ((1.0 - z * z).sqrt(), golden * f64::from(k));
                surface(&e, Vec3::new(r * libm::cos(a), r * libm::sin(a), z)).0
            })
            .collect();
        let offsets = Offsets::uniform(300, 2);
        let mut position = Vec::new();
        for id in 0..300 {
            let p = surface(&e, random(id, 1)).0 + random(id, 2) * 0.8;
            position.push((p + random(id, 3) * 0.7).cast::<f32>().into());
            position.push((p - random(id, 3) * 0.7).cast::<f32>().into());
        }
        let radius = 0.5f64;
        let chains = Chains::of_polylines(&position, &offsets, &[radius as f32; 600]).expect("chains");
        let found = contacts(&chains, &e, 0.0);
        assert!(found.windows(2).all(|w| w[0].hair < w[1].hair));
        let mut missed = 0;
        for s in 0..300 {
            let link = chains.link(s as usize, 0);
            let hit = found.iter().find(|c| c.hair == s);
            let near = shell.iter().map(|p| point_distance(*p, link.axis)).fold(f64::MAX, f64::min);
            let within = link.axis.iter().any(|p| e.signed_distance(*p).0 < 0.0);
            if near < radius || within {
                assert!(hit.is_some(), "{s}");
            }
            // Samples of the surface are at most 0.15 from any of its points.
            if near > radius + 0.15 && !within {
                assert!(hit.is_none(), "{s}");
            }
            let longer = Ellipsoid { semi_axes: e.semi_axes.map(|a| a + radius), ..e };
            let paper = longer.nearest_on(link.axis).1 <= 0.0;
            assert!(!paper || hit.is_some());
            missed += usize::from(hit.is_some() && !paper);
        }
        assert!(missed > 3, "{missed}");
        assert!(contacts(&chains, &e, -0.2).len() < found.len() && contacts(&chains, &e, 0.2).len() > found.len());
        assert!(Ellipsoid::new(Vec3::zeros(), UnitQuaternion::identity(), Vec3::new(1.0, 0.0, 1.0)).is_err());
        assert!(Ellipsoid::new(Vec3::zeros(), UnitQuaternion::identity(), Vec3::new(1.0, f64::NAN, 1.0)).is_err());
    }
}
