//! Ellipsoids (Golodetz 2007, §6). The paper tests hair of radius r against the ellipsoid with semi-axes longer by r;
//! that surface lies inside the true offset and misses contacts, so distances here are exact.

use super::{Hit, Rigid, eigen};
use crate::Vec3;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Shortest semi-axis over the longest: below it a flat ellipsoid's distance loses digits.
const FLATTEST: f64 = 1e-4;

/// Newton's iterations at most; points on the planes of symmetry, near the focal curve, need 30, others 4 to 8.
const ITERATIONS: usize = 60;

/// A solid ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Carries its own axes and centre to where it is.
    pub placement: Rigid,
    /// Semi-axes along x, y, z of its own axes, metres.
    pub semi_axes: [f64; 3],
}

impl Ellipsoid {
    /// Ellipsoid of the solid's inertia: centre and axes are those of its volume's second moments, semi-axes the square
    /// roots of five times these, which is right for an ellipsoid however its surface is cut into triangles. Where the mesh
    /// holds no volume it is that of the points: three times, right for the image of an even sphere. The surface lies on both
    /// sides of it; [`Ellipsoid::around`] bounds it. `None` without finite points.
    pub fn fit(position: &[[f64; 3]], triangle: &[[u32; 3]]) -> Option<Self> {
        let points = || position.iter().filter(|p| p.iter().all(|x| x.is_finite())).map(|p| Vec3::from(*p));
        let n = points().count() as f64;
        if n == 0.0 {
            return None;
        }
        let middle = points().fold(Vec3::zeros(), |s, p| s + p) / n;
        let outer = |v: Vec3| v * v.transpose();
        // Tetrahedra from the middle to every triangle; sums of 1, x and x x^T over their volume.
        let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Matrix3::zeros());
        for t in triangle {
            let [a, b, c] = t.map(|v| Vec3::from(position[v as usize]) - middle);
            let piece = a.dot(&b.cross(&c)) / 6.0;
            if piece.is_finite() {
                let sum = a + b + c;
                volume += piece;
                first += sum * (piece / 4.0);
                second += (outer(sum) + outer(a) + outer(b) + outer(c)) * (piece / 20.0);
            }
        }
        let radius = points().map(|p| (p - middle).norm()).fold(0.0, f64::max);
        let (mean, second, times) = if volume.abs() > 1e-6 * radius * radius * radius {
            let mean = first / volume;
            (middle + mean, second / volume - outer(mean), 5.0)
        } else {
            (middle, points().fold(Matrix3::zeros(), |s, p| s + outer(p - middle)) / n, 3.0)
        };
        let (value, vector) = eigen::symmetric([0, 1, 2].map(|i| [0, 1, 2].map(|j| second[(i, j)])));
        let [x, y, z] = vector.map(Vec3::from);
        let z = if x.cross(&y).dot(&z) < 0.0 { -z } else { z };
        let turn =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z])));
        let c = turn.coords;
        let placement = Rigid { rotation: [c.x, c.y, c.z, c.w], translation: mean.into() };
        Some(Ellipsoid { placement, semi_axes: value.map(|v| (times * v.max(0.0)).sqrt()) })
    }

    /// The same shape, as large as it must be to hold all finite points.
    pub fn around(self, position: &[[f64; 3]]) -> Self {
        let a = self.axes();
        let k = |p: &[f64; 3]| self.placement.invert(Vec3::from(*p)).component_div(&a).norm();
        let largest = position.iter().map(k).filter(|k| k.is_finite()).fold(0.0, f64::max);
        Ellipsoid { semi_axes: self.semi_axes.map(|a| a * largest), ..self }
    }

    /// Semi-axes, none of them too short to compute with.
    fn axes(&self) -> Vec3 {
        let longest = self.semi_axes.iter().fold(f64::MIN_POSITIVE, |l, a| l.max(a.abs()));
        Vec3::from(self.semi_axes.map(|a| a.abs().max(FLATTEST * longest)))
    }

    /// Distance and normal, exact to about 1e-9 of the longest semi-axis.
    ///
    /// The closest point x to y has x_i = a_i^2 y_i / (t + a_i^2), t being the largest root of sum (a_i y_i / (t +
    /// a_i^2))^2 = 1 (Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid"). The left side
    /// is convex and falling there, so that Newton's method from its left climbs to the root without overshooting.
    pub fn sample(&self, p: Vec3) -> Hit {
        let a = self.axes();
        let y = self.placement.invert(p);
        // Off the planes of symmetry by what nobody sees: inside, closest points then exist on one side.
        let tiny = 1e-10 * a.max();
        let abs = y.map(|c| c.abs().max(tiny));
        let square = a.component_mul(&a);
        // u = t + the shortest semi-axis squared keeps its digits where it is small.
        let excess = square.map(|s| s - square.min());
        let ay = a.component_mul(&abs);
        // At each of these one term is 1.
        let mut u = (ay - excess).max();
        for _ in 0..ITERATIONS {
            let q = ay.component_div(&excess.map(|e| e + u));
            let f = q.norm_squared() - 1.0;
            let slope = -2.0 * (0..3).map(|i| q[i] * q[i] / (u + excess[i])).sum::<f64>();
            let step = -f / slope;
            if step <= 1e-15 * u || step.is_nan() {
                break;
            }
            u += step;
        }
        let x = square.component_mul(&abs).component_div(&excess.map(|e| e + u));
        let outward = x.component_div(&square).normalize();
        let inside = y.component_div(&a).norm_squared() < 1.0;
        let gap = (abs - x).norm();
        let normal = Vec3::from(std::array::from_fn(|i| outward[i].copysign(y[i])));
        Hit {
            distance: if inside { -gap } else { gap },
            normal: self.placement.quaternion() * normal,
            velocity: Vec3::zeros(),
        }
    }

    /// Lower bound of the distance outside, below zero inside: stretched to a sphere no distance shrinks by more than the
    /// shortest semi-axis.
    pub fn distance_bound(&self, p: Vec3) -> f64 {
        let a = self.axes();
        let y = self.placement.invert(p);
        ((y.component_div(&a).norm() - 1.0) * a.min()).max(y.norm() - a.max())
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::random_in;
    use super::*;

    fn some(semi_axes: [f64; 3]) -> Ellipsoid {
        let q = UnitQuaternion::from_scaled_axis(Vec3::new(0.3, -0.8, 0.5)).coords;
        Ellipsoid { placement: Rigid { rotation: [q.x, q.y, q.z, q.w], translation: [0.3, -0.1, 0.2] }, semi_axes }
    }

    /// Distance by a fine net of points on the surface, refined around the best.
    fn brute(e: &Ellipsoid, p: Vec3) -> f64 {
        let at = |u: f64, v: f64| {
            let ((su, cu), (sv, cv)) = (libm::sincos(u), libm::sincos(v));
            e.placement.apply(Vec3::new(su * cv, cu, su * sv).component_mul(&Vec3::from(e.semi_axes)))
        };
        let (mut best, mut centre, mut reach) = (f64::INFINITY, (1.5, 3.2), (1.7, 3.2));
        for _ in 0..14 {
            let from = centre;
            for i in -24..=24 {
                for j in -24..=24 {
                    let (u, v) = (from.0 + reach.0 * f64::from(i) / 24.0, from.1 + reach.1 * f64::from(j) / 24.0);
                    let d = (at(u, v) - p).norm();
                    if d < best {
                        (best, centre) = (d, (u, v));
                    }
                }
            }
            reach = (reach.0 * 0.25, reach.1 * 0.25);
        }
        best
    }

    #[test]
    fn distances_are_those_of_brute_force() {
        for (k, axes) in [[0.1, 0.1, 0.1], [0.1, 0.13, 0.08], [0.02, 0.2, 0.1]].into_iter().enumerate() {
            let e = some(axes);
            for i in 0..60 {
                let mut y = random_in(i + 1000 * k as u64, [-0.25; 3], [0.25; 3]);
                // Planes and axes of symmetry too.
                (0..3).filter(|b| i >> b & 1 == 1 && i % 5 == 0).for_each(|b| y[b] = 0.0);
                let p = e.placement.apply(y);
                let (s, d) = (e.sample(p), brute(&e, p));
                assert!((s.distance.abs() - d).abs() < 2e-8, "{axes:?} {y}: {} {d}", s.distance);
                assert!((s.normal.norm() - 1.0).abs() < 1e-12);
                let foot = e.placement.invert(p - s.normal * s.distance);
                assert!((foot.component_div(&Vec3::from(axes)).norm() - 1.0).abs() < 1e-6, "{axes:?} {y}");
                assert!(e.distance_bound(p) <= s.distance.max(0.0) + 1e-12);
            }
        }
    }

    /// What is wrong with testing against longer semi-axes.
    #[test]
    fn longer_semi_axes_lie_inside_the_offset() {
        let (e, r) = (some([0.02, 0.2, 0.1]), 0.02);
        let longer = Ellipsoid { semi_axes: e.semi_axes.map(|a| a + r), ..e };
        let shortest = (0..2000)
            .map(|i| random_in(i, [-1.0; 3], [1.0; 3]).normalize())
            .map(|n| e.sample(longer.placement.apply(n.component_mul(&Vec3::from(longer.semi_axes)))).distance)
            .fold(f64::INFINITY, f64::min);
        println!("semi-axes longer by 20 mm: {:.1} mm from the surface", 1e3 * shortest);
        assert!(shortest < 0.9 * r);
    }

    #[test]
    fn fits_recover_an_ellipsoid_and_bounds_hold_all() {
        let e = some([0.08, 0.14, 0.1]);
        let sphere = pelage_geom::shapes::cube_sphere(24, 1.0);
        let points: Vec<[f64; 3]> = sphere
            .position
            .iter()
            .map(|n| e.placement.apply(Vec3::from(*n).component_mul(&Vec3::from(e.semi_axes))).into())
            .collect();
        let fit = Ellipsoid::fit(&points, &sphere.triangle).unwrap();
        for p in &points {
            assert!(fit.sample(Vec3::from(*p)).distance.abs() < 5e-4);
        }
        // Many small triangles around a pole do not pull it.
        let globe = |i: i32, j: i32| {
            let (u, v) = (std::f64::consts::PI * f64::from(i) / 12.0, std::f64::consts::TAU * f64::from(j) / 24.0);
            [libm::sin(u) * libm::cos(v), libm::cos(u), libm::sin(u) * libm::sin(v)]
        };
        let vertices: Vec<[f64; 3]> = (0..=12).flat_map(|i| (0..24).map(move |j| globe(i, j))).collect();
        let quad = |i: u32, j: u32| [24 * i + j, 24 * i + (j + 1) % 24, 24 * i + 24 + j, 24 * i + 24 + (j + 1) % 24];
        let triangles: Vec<[u32; 3]> = (0..12)
            .flat_map(|i| (0..24).map(move |j| quad(i, j)))
            .flat_map(|[a, b, c, d]| [[a, b, c], [b, d, c]])
            .collect();
        let round = Ellipsoid::fit(&vertices, &triangles).unwrap();
        assert!(round.semi_axes.iter().all(|a| (a - 0.99).abs() < 0.01), "{:?}", round.semi_axes);
        let all = fit.around(&points);
        assert!(points.iter().all(|p| all.sample(Vec3::from(*p)).distance < 1e-9));
        assert!(Ellipsoid::fit(&[[f64::NAN; 3]], &[[0; 3]]).is_none());
        let flat = Ellipsoid::fit(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]).unwrap();
        let s = flat.sample(Vec3::new(0.3, 0.3, 1.0));
        assert!((s.distance - 1.0).abs() < 1e-2 && s.normal.norm() > 0.99);
        for p in [Vec3::zeros(), flat.placement.apply(Vec3::zeros()), Vec3::repeat(f64::NAN)] {
            flat.sample(p);
        }
    }
}
