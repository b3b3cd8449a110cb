//! Lengths of hair over the scalp: cut to planes, or between lengths at key places (§2.1).

use pelage_geom::Vec3;

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of it.
    pub point: Vec3,
    /// Its normal, not zero, any length.
    pub normal: Vec3,
}

/// The sphere that stands for the scalp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub centre: Vec3,
    /// Its radius, scene units.
    pub radius: f64,
}

/// Planes that part the scalp, and planes that hair of each part is cut to.
#[derive(Clone, Debug, PartialEq)]
pub enum Shear {
    /// Parts the roots.
    Part {
        /// The plane.
        plane: Plane,
        /// For roots on the side that its normal points to, and on it.
        front: Box<Shear>,
        /// For the others.
        back: Box<Shear>,
    },
    /// Hair is cut to this plane.
    Cut {
        /// The plane.
        plane: Plane,
    },
}

impl Shear {
    /// The plane that hair of a root is cut to.
    pub fn plane(&self, root: Vec3) -> Plane {
        match self {
            Shear::Part { plane, front, back } => {
                let side = if (root - plane.point).dot(&plane.normal) >= 0.0 { front } else { back };
                side.plane(root)
            }
            Shear::Cut { plane } => *plane,
        }
    }

    /// Length of hair that is pulled around the scalp to its plane and cut there: [`shortest_to_plane`].
    pub fn length(&self, scalp: &Sphere, root: Vec3) -> f64 {
        shortest_to_plane(scalp, root, &self.plane(root))
    }

    /// Length of a hair, root first, that is cut where it first meets the plane of its root as it hangs; none if it
    /// does not reach it.
    pub fn length_along(&self, line: &[Vec3]) -> Option<f64> {
        let plane = self.plane(*line.first()?);
        crate::flow::trim::length_to_plane(line, plane.point, plane.normal)
    }
}

/// Length of the shortest way from a point to a plane that does not run through a sphere. Points within the sphere
/// count as the nearest on it.
///
/// The way lies in the plane of the point, the centre and the normal, and goes straight to the sphere's tangent, around
/// the sphere, and along the normal. With z along the normal toward the plane, from the centre, it leaves the sphere at
/// z = 0, or at the plane if that comes before.
pub fn shortest_to_plane(sphere: &Sphere, from: Vec3, plane: &Plane) -> f64 {
    let radius = sphere.radius.max(0.0);
    let Some(mut up) = plane.normal.try_normalize(0.0) else { return 0.0 };
    let mut r = from - sphere.centre;
    let mut distance = r.norm();
    if distance < radius {
        r = r.try_normalize(0.0).unwrap_or(up) * radius;
        distance = radius;
    }
    let mut height = (plane.point - sphere.centre).dot(&up);
    if height < r.dot(&up) {
        (up, height) = (-up, -height);
    }
    let z = r.dot(&up);
    let across = (r - up * z).norm();
    let straight = height - z;
    // Where the ray along the normal meets the sphere.
    let shadow = z < 0.0 && across < radius;
    if !shadow || height <= -(radius * radius - across * across).sqrt() {
        return straight;
    }
    // Angles from the normal: of the point, of where its tangent touches, of where the way leaves the sphere.
    let angle = libm::atan2(across, z);
    let touch = angle - libm::acos((radius / distance).min(1.0));
    let leave = if height >= 0.0 { std::f64::consts::FRAC_PI_2 } else { libm::acos((height / radius).max(-1.0)) };
    if leave >= touch {
        // The rim of the plane's section is in sight.
        let rim = radius * libm::sin(leave) - across;
        return (rim * rim + straight * straight).sqrt();
    }
    let tangent = (distance * distance - radius * radius).max(0.0).sqrt();
    tangent + radius * (touch - leave) + height.max(0.0)
}

/// Length at a root between lengths at key places of the scalp: weighted by the inverse square of the angle between
/// their directions from the centre (Shepard 1968, "A two-dimensional interpolation function for irregularly-spaced
/// data"). At a key place it is the key's; everywhere it is between the least and the greatest. 0 without keys.
pub fn between_keys(centre: Vec3, keys: &[(Vec3, f64)], root: Vec3) -> f64 {
    let direction = root - centre;
    let (mut sum, mut weights) = (0.0, 0.0);
    for (at, length) in keys {
        let key = at - centre;
        let angle = libm::atan2(key.cross(&direction).norm(), key.dot(&direction));
        // Nearer than this a key is the place itself, and its weight would not be finite.
        if angle < 1e-9 {
            return *length;
        }
        let w = 1.0 / (angle * angle);
        sum += w * length;
        weights += w;
    }
    if weights > 0.0 { sum / weights } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    /// A point at an angle along the great circle from unit `a` in the direction of unit `d`.
    fn on_circle(a: Vec3, d: Vec3, angle: f64) -> Vec3 {
        let (s, c) = libm::sincos(angle);
        a * c + d * s
    }

    /// Least length over ways of a great circle and a straight piece from it, on a unit sphere; `root` is on it. Ways
    /// leave the root in any direction and the sphere anywhere, along the normal if nothing is in the way or else along
    /// their circle.
    fn brute(root: Vec3, height: f64, up: Vec3) -> f64 {
        let (up, height) = if height < root.dot(&up) { (-up, -height) } else { (up, height) };
        let e1 =
            up.cross(&root).try_normalize(1e-9).unwrap_or_else(|| up.cross(&Vec3::ith(up.iamin(), 1.0)).normalize());
        let e2 = root.cross(&e1);
        let length = |heading: f64, arc: f64| {
            let d = on_circle(e1, e2, heading);
            let q = on_circle(root, d, arc);
            // The arc itself may reach the plane.
            let met = (1..=64).map(|k| arc * f64::from(k) / 64.0).find(|&a| on_circle(root, d, a).dot(&up) >= height);
            if let Some(a) = met {
                let (mut low, mut high) = (a - arc / 64.0, a);
                for _ in 0..50 {
                    let m = 0.5 * (low + high);
                    if on_circle(root, d, m).dot(&up) >= height { high = m } else { low = m }
                }
                return high;
            }
            let along = on_circle(d, -root, arc);
            let rise = height - q.dot(&up);
            let free = q.dot(&up) >= 0.0;
            let normal = if free { rise } else { f64::INFINITY };
            let tangent = if along.dot(&up) > 1e-9 { rise / along.dot(&up) } else { f64::INFINITY };
            arc + normal.min(tangent)
        };
        let (mut best, mut at, mut step) = (f64::INFINITY, (0.0, 0.0), (TAU / 48.0, PI / 48.0));
        for i in 0..48 {
            for j in 0..=48 {
                let x = (f64::from(i) * step.0, f64::from(j) * step.1);
                let l = length(x.0, x.1);
                if l < best {
                    (best, at) = (l, x);
                }
            }
        }
        for _ in 0..60 {
            let middle = at;
            for i in -4..=4 {
                for j in -4..=4 {
                    let x = (middle.0 + f64::from(i) * step.0 * 0.3, (middle.1 + f64::from(j) * step.1 * 0.3).max(0.0));
                    let l = length(x.0, x.1);
                    if l < best {
                        (best, at) = (l, x);
                    }
                }
            }
            step = (step.0 * 0.7, step.1 * 0.7);
        }
        best
    }

    #[test]
    fn the_shortest_way_around_the_scalp_is_that_of_brute_force() {
        for k in 0..60 {
            let u = |c: u64| 2.0 * rng::uniform(4, k, 0, c) - 1.0;
            let root = Vec3::new(u(0), u(1), u(2)).normalize();
            let up = Vec3::new(u(3), u(4), u(5)).normalize();
            let height = 1.8 * u(6);
            let plane = Plane { point: up * height + up.cross(&root) * 7.0, normal: up * 3.0 };
            let sphere = Sphere { centre: Vec3::new(1.0, 2.0, 3.0), radius: 2.0 };
            let moved = Plane { point: plane.point * 2.0 + sphere.centre, normal: -plane.normal };
            let got = shortest_to_plane(&sphere, root * 2.0 + sphere.centre, &moved) / 2.0;
            let best = brute(root, height, up);
            assert!((got - best).abs() < 1e-6, "{k}: {got} {best}");
        }
    }

    #[test]
    fn from_above_the_scalp_ways_are_those_of_a_taut_string() {
        let unit = Sphere { centre: Vec3::zeros(), radius: 1.0 };
        let mut kinds = [0; 3];
        for k in 0..300 {
            let u = |c: u64| rng::uniform(6, k, 0, c);
            let (angle, distance) = (PI * u(0), 1.0 + u(1) * u(1));
            let root = Vec3::new(distance * libm::sin(angle), 0.0, distance * libm::cos(angle));
            let height = 4.0 * u(2) - 2.0;
            if height < root.z {
                continue;
            }
            let got = shortest_to_plane(&unit, root, &Plane { point: Vec3::z() * height, normal: Vec3::z() });
            // In the plane of the way: straight to a point of the sphere or of the plane, around, up. Clear if it is
            // nowhere within.
            let clear = |a: Vec3, b: Vec3| {
                let t = (-a.dot(&(b - a)) / (b - a).norm_squared().max(1e-300)).clamp(0.0, 1.0);
                (a + (b - a) * t).norm() > 1.0 - 1e-9
            };
            let mut best = f64::INFINITY;
            let above = Vec3::new(root.x, 0.0, height);
            if clear(root, above) {
                best = height - root.z;
                kinds[0] += 1;
            } else {
                let at = |a: f64| Vec3::new(libm::sin(a), 0.0, libm::cos(a));
                let leave = if height >= 0.0 { FRAC_PI_2 } else { libm::acos(height) };
                for i in 0..=20_000 {
                    let a = leave + (PI - leave) * f64::from(i) / 20_000.0;
                    if clear(root, at(a)) {
                        best = best.min((at(a) - root).norm() + (a - leave) + height.max(0.0));
                    }
                }
                kinds[if height >= 0.0 { 1 } else { 2 }] += 1;
            }
            assert!((got - best).abs() < 1e-6, "{k}: {got} {best}, {height} {angle} {distance}");
        }
        assert!(kinds.iter().all(|k| *k > 10), "{kinds:?}");
        // Within the sphere: from its surface.
        let plane = Plane { point: Vec3::z() * 2.0, normal: Vec3::z() };
        assert!((shortest_to_plane(&unit, Vec3::z() * -0.2, &plane) - (FRAC_PI_2 + 2.0)).abs() < 1e-12);
        assert!((shortest_to_plane(&unit, Vec3::z() * 0.2, &plane) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn roots_find_their_plane() {
        let flat = |y: f64| Plane { point: Vec3::y() * y, normal: Vec3::y() };
        let cut = |y: f64| Box::new(Shear::Cut { plane: flat(y) });
        let shear = Shear::Part { plane: flat(0.5), front: cut(3.0), back: cut(-2.0) };
        let scalp = Sphere { centre: Vec3::zeros(), radius: 1.0 };
        assert!((shear.length(&scalp, Vec3::y()) - 2.0).abs() < 1e-12);
        assert!((shear.length(&scalp, Vec3::x()) - 2.0).abs() < 1e-12);
        let line = [Vec3::x(), Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, -5.0, 0.0)];
        assert_eq!(shear.length_along(&line), Some(3.0));
        assert_eq!(shear.length_along(&line[..2]), None);
        assert_eq!(shear.length_along(&[]), None);
    }

    #[test]
    fn lengths_between_keys() {
        let keys = [(Vec3::x() * 2.0, 1.0), (Vec3::y(), 5.0), (-Vec3::x(), 3.0)];
        let at = |p: Vec3| between_keys(Vec3::zeros(), &keys, p);
        assert_eq!((at(Vec3::x()), at(Vec3::y() * 9.0)), (1.0, 5.0));
        assert!((at(Vec3::new(1.0, 1.0, 0.0)) - (16.0 + 80.0 + 16.0 / 3.0) / (32.0 + 16.0 / 9.0)).abs() < 1e-9);
        assert!((at(Vec3::new(1.0, 1e-5, 0.0)) - 1.0).abs() < 1e-6);
        assert_eq!(between_keys(Vec3::zeros(), &[], Vec3::x()), 0.0);
    }
}
