//! Triangles that flow wells out of evenly: source panels.

use super::element::PER_SPHERE;
use pelage_geom::Vec3;

/// Least distance, relative to an edge, at which the logarithm of its distance is taken. The velocity along a panel is
/// logarithmically infinite at its edges; this keeps it below 5 strengths there. Larger would show in the velocity at
/// this distance, smaller has no use.
const EDGE: f64 = 1e-12;

/// A triangle of constant source strength (volume a time and area: a speed).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panel {
    /// Corners, counter-clockwise seen from outside.
    pub corner: [Vec3; 3],
    /// Centroid, where the normal velocity is prescribed.
    pub centre: Vec3,
    /// Unit normal, outward.
    pub normal: Vec3,
    /// Square scene units.
    pub area: f64,
}

impl Panel {
    /// A panel of a triangle; none if the triangle has no area or is not finite.
    pub fn new(corner: [Vec3; 3]) -> Option<Self> {
        let cross = (corner[1] - corner[0]).cross(&(corner[2] - corner[0]));
        let longest = (0..3).map(|i| (corner[(i + 1) % 3] - corner[i]).norm_squared()).fold(0.0, f64::max);
        let double = cross.norm();
        // Thinner triangles have no sure normal.
        let solid = double.is_finite() && double > 1e-12 * longest;
        let centre = (corner[0] + corner[1] + corner[2]) / 3.0;
        solid.then(|| Panel { corner, centre, normal: cross / double, area: 0.5 * double })
    }

    /// Velocity at a point by a unit strength: exact, after Hess and Smith (1967, "Calculation of potential flow about
    /// arbitrary bodies"). Along the normal it is the solid angle over 4 pi, which jumps by 1 across the panel; along
    /// the panel each edge gives its outward normal times the integral of 1 / distance over it.
    pub fn velocity(&self, at: Vec3) -> Vec3 {
        let ray = self.corner.map(|c| c - at);
        let distance = ray.map(|r| r.norm());
        (self.along(&distance) + self.normal * solid_angle(&ray, &distance)) * PER_SPHERE
    }

    /// Velocity at the panel's own centre by a unit strength, as the limit from outside: half along the normal.
    pub fn velocity_at_centre(&self) -> Vec3 {
        let distance = self.corner.map(|c| (c - self.centre).norm());
        self.along(&distance) * PER_SPHERE + self.normal * 0.5
    }

    /// Component in the plane of the panel, times 4 pi.
    fn along(&self, distance: &[f64; 3]) -> Vec3 {
        (0..3).fold(Vec3::zeros(), |sum, i| {
            let (j, side) = ((i + 1) % 3, self.corner[(i + 1) % 3] - self.corner[i]);
            let length = side.norm();
            let reach = distance[i] + distance[j];
            let integral = libm::log((reach + length) / (reach - length).max(EDGE * length));
            sum + side.cross(&self.normal) * (integral / length)
        })
    }

    /// Distance from the centre to the farthest corner.
    pub fn radius(&self) -> f64 {
        self.corner.iter().map(|c| (c - self.centre).norm()).fold(0.0, f64::max)
    }

    /// Second moment about the centre: the integral of d d^T over the area.
    pub(super) fn second_moment(&self) -> nalgebra::Matrix3<f64> {
        let d = self.corner.map(|c| c - self.centre);
        (d[0] * d[0].transpose() + d[1] * d[1].transpose() + d[2] * d[2].transpose()) * (self.area / 12.0)
    }
}

/// Solid angle of a triangle, positive seen from its front, by rays to its corners and their lengths (Van Oosterom,
/// Strackee 1983, "The solid angle of a plane triangle").
fn solid_angle(r: &[Vec3; 3], d: &[f64; 3]) -> f64 {
    let volume = r[0].dot(&r[1].cross(&r[2]));
    let across = d[0] * d[1] * d[2] + r[0].dot(&r[1]) * d[2] + r[0].dot(&r[2]) * d[1] + r[1].dot(&r[2]) * d[0];
    -2.0 * libm::atan2(volume, across)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::test_laws::{curl, divergence};
    use std::f64::consts::PI;

    fn panel() -> Panel {
        Panel::new([Vec3::new(0.2, 0.0, 0.1), Vec3::new(1.5, 0.3, -0.2), Vec3::new(0.4, 1.1, 0.5)]).expect("a triangle")
    }

    /// The same by point sources: midpoints of n^2 equal parts.
    fn quadrature(p: &Panel, at: Vec3, n: usize) -> Vec3 {
        let [a, b, c] = p.corner;
        let mut sum = Vec3::zeros();
        let mut add = |i: f64, j: f64| {
            let r = at - (a + (b - a) * (i / n as f64) + (c - a) * (j / n as f64));
            sum += r / (r.norm() * r.norm_squared());
        };
        for i in 0..n {
            for j in 0..n - i {
                add(i as f64 + 1.0 / 3.0, j as f64 + 1.0 / 3.0);
                if j + 1 < n - i {
                    add(i as f64 + 2.0 / 3.0, j as f64 + 2.0 / 3.0);
                }
            }
        }
        sum * (p.area / (n * n) as f64 / (4.0 * PI))
    }

    #[test]
    fn a_panel_is_the_sum_of_its_points() {
        let p = panel();
        for at in [
            p.centre + p.normal * 0.3,
            p.centre - p.normal * 0.4,
            Vec3::new(2.0, -1.0, 0.5),
            Vec3::new(-3.0, 4.0, 9.0),
            p.centre + (p.corner[1] - p.corner[0]) * 1.7,
        ] {
            // Richardson: the error of midpoints is even in 1 / n.
            let best = (quadrature(&p, at, 160) * 4.0 - quadrature(&p, at, 80)) / 3.0;
            assert!((p.velocity(at) - best).norm() < 1e-7 * best.norm(), "{at}");
        }
    }

    #[test]
    fn the_velocity_jumps_by_the_strength_across_a_panel() {
        let p = panel();
        let (out, inside) = (p.velocity(p.centre + p.normal * 1e-9), p.velocity(p.centre - p.normal * 1e-9));
        assert!((out - inside - p.normal).norm() < 1e-7);
        assert!((p.velocity_at_centre() - out).norm() < 1e-7);
        assert!((p.velocity_at_centre().dot(&p.normal) - 0.5).abs() < 1e-14);
        // On its edges and corners it is finite.
        for at in [p.corner[0], (p.corner[0] + p.corner[1]) * 0.5] {
            assert!(p.velocity(at).norm() < 6.0);
        }
    }

    #[test]
    fn flow_out_of_a_panel_is_ideal() {
        let p = panel();
        for at in [p.centre + p.normal * 0.3, Vec3::new(1.0, 2.0, 0.4), Vec3::new(0.2, -0.2, 0.1)] {
            let f = |x| p.velocity(x);
            assert!(divergence(&f, at).abs() < 1e-7 && curl(&f, at).norm() < 1e-7);
        }
    }

    #[test]
    fn a_triangle_without_area_is_no_panel() {
        assert!(Panel::new([Vec3::zeros(), Vec3::x(), Vec3::x() * 3.0]).is_none());
        assert!(Panel::new([Vec3::zeros(), Vec3::x(), Vec3::repeat(f64::NAN)]).is_none());
    }
}
