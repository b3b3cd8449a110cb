//! Evaluating a generalized cylinder: points, derivatives, sections, and back from points.

use super::curve::{around, through};
use super::{Cylinder, Region, Skeleton};
use pelage_geom::Vec3;

/// A cylinder made ready for evaluation.
#[derive(Clone, Debug)]
pub struct Shape<'a> {
    cylinder: &'a Cylinder,
    skeleton: Skeleton,
    /// The largest [`Section::girth`] at any station, scene units.
    widest: f64,
}

/// A section across a cylinder.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// C, scene units.
    pub centre: Vec3,
    /// T, N, B, unit.
    pub axes: [Vec3; 3],
    /// S_N, S_B.
    pub scale: [f64; 2],
    /// W, radians.
    pub twist: f64,
    /// \[K\] radii at equal angles theta from 0, scene units.
    pub ring: Vec<f64>,
}

impl Section {
    /// R at an angle, scene units.
    pub fn radius(&self, theta: f64) -> f64 {
        around(&self.ring, &[], theta)[0]
    }

    /// V at (r, theta), scene units.
    pub fn point(&self, r: f64, theta: f64) -> Vec3 {
        let (sin, cos) = libm::sincos(theta + self.twist);
        let [_, n, b] = self.axes;
        self.centre + (n * (cos * self.scale[0]) + b * (sin * self.scale[1])) * (r * self.radius(theta))
    }

    /// Coordinates (r, theta) of the point of the section's plane that lies under `p`: its inverse where both scales
    /// are above 0.
    pub fn coordinates(&self, p: Vec3) -> [f64; 2] {
        let d = p - self.centre;
        let (x, y) = (d.dot(&self.axes[1]) / self.scale[0], d.dot(&self.axes[2]) / self.scale[1]);
        let across = (x * x + y * y).sqrt();
        if across == 0.0 {
            return [0.0; 2];
        }
        let theta = libm::atan2(y, x) - self.twist;
        [across / self.radius(theta), theta]
    }

    /// T, and N and B turned by the twist: axes that things of the section turn with.
    pub fn turned_axes(&self) -> [Vec3; 3] {
        let (sin, cos) = libm::sincos(self.twist);
        let [t, n, b] = self.axes;
        [t, n * cos + b * sin, b * cos - n * sin]
    }

    /// Mean radius, scene units: the mean of the ring times the root of the product of the scales.
    pub fn girth(&self) -> f64 {
        let mean = self.ring.iter().sum::<f64>() / self.ring.len() as f64;
        mean * (self.scale[0] * self.scale[1]).sqrt()
    }

    /// Area inside the contour, scene units squared: S_N S_B times the integral of R^2 / 2, by 256 angles.
    pub fn area(&self) -> f64 {
        Region { centre: [0.0; 2], radius: self.ring.clone() }.area() * self.scale[0] * self.scale[1]
    }
}

impl<'a> Shape<'a> {
    /// Checks a cylinder and makes it ready; says what is wrong with it.
    pub fn new(cylinder: &'a Cylinder) -> Result<Self, String> {
        cylinder.check()?;
        let skeleton = Skeleton::new(&cylinder.control, cylinder.axis, cylinder.side)?;
        let mut out = Shape { cylinder, skeleton, widest: 0.0 };
        let [n, b] = &cylinder.scale;
        let stations = cylinder.contour.t.iter().chain(&n.t).chain(&b.t);
        out.widest = stations.map(|t| out.section(*t).girth()).fold(0.0, f64::max);
        if out.widest > 0.0 { Ok(out) } else { Err("a cluster has no width anywhere".into()) }
    }

    /// What it was made from.
    pub fn cylinder(&self) -> &'a Cylinder {
        self.cylinder
    }

    /// The skeleton.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// The largest girth at any of its stations, scene units.
    pub fn widest(&self) -> f64 {
        self.widest
    }

    /// The section at `t`, clamped to [0, 1].
    pub fn section(&self, t: f64) -> Section {
        let place = self.skeleton.place(t);
        let ring = self.ring(t).into_iter().map(|r| r.0).collect();
        let [n, b] = &self.cylinder.scale;
        Section {
            centre: place.at,
            axes: [place.tangent, place.normal, place.binormal()],
            scale: [n.at(t), b.at(t)],
            twist: self.cylinder.twist.at(t),
            ring,
        }
    }

    /// V(r, theta, t), scene units. Evaluate several points of one section by [`Shape::section`].
    pub fn point(&self, r: f64, theta: f64, t: f64) -> Vec3 {
        self.section(t).point(r, theta)
    }

    /// Derivatives of V by r, theta and t. That by t takes the frame as free of turn about the skeleton, which it is to
    /// the accuracy of its steps.
    pub fn derivatives(&self, r: f64, theta: f64, t: f64) -> [Vec3; 3] {
        let (place, length) = (self.skeleton.place(t), self.skeleton.length());
        let (ring, change): (Vec<f64>, Vec<f64>) = self.ring(t).into_iter().unzip();
        let [radius, by_theta, by_t] = around(&ring, &change, theta);
        let [s, c] = &self.cylinder.scale;
        let (sn, sb, twist) = (s.at(t), c.at(t), &self.cylinder.twist);
        let (sin, cos) = libm::sincos(theta + twist.at(t));
        let (n, b) = (place.normal, place.binormal());
        let out = n * (cos * sn) + b * (sin * sb);
        let about = b * (cos * sb) - n * (sin * sn);
        let wider = n * (cos * s.slope(t)) + b * (sin * c.slope(t));
        // A frame that does not turn about T: N' = -(T' N) T, and the same for B.
        let tilt = -place.tangent * (place.bend.dot(&out) * length);
        let along = place.tangent * length;
        let change = out * by_t + (about * twist.slope(t) + wider + tilt) * radius;
        [out * radius, (out * by_theta + about * radius) * r, along + change * r]
    }

    /// Radii at the angles of the contour, and their derivatives by t.
    fn ring(&self, t: f64) -> Vec<(f64, f64)> {
        let c = &self.cylinder.contour;
        (0..c.angles).map(|a| through(&c.t, |s| c.radius[s * c.angles + a], t)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::{plain, samples};
    use super::*;
    use crate::cluster::{Contour, Curve};

    #[test]
    fn a_straight_cylinder_is_the_formula() {
        let t = |value: &[f64]| Curve { t: vec![0.0, 1.0], value: value.to_vec() };
        let mut c = plain(vec![Vec3::zeros(), Vec3::new(0.0, 0.0, 3.0), Vec3::new(0.0, 0.0, 4.0)], 0.5);
        c.scale = [t(&[1.0, 2.0]), t(&[3.0, 0.5])];
        c.twist = t(&[0.5, 7.0]);
        c.contour = Contour { t: vec![0.0, 1.0], angles: 1, radius: vec![0.5, 0.1] };
        let shape = Shape::new(&c).expect("a shape");
        for k in 0..50 {
            let (r, theta, t) = (f64::from(k) * 0.03, f64::from(k) * 0.7, f64::from(k) / 49.0);
            let a = theta + 0.5 + 6.5 * t;
            let radius = r * (0.5 - 0.4 * t);
            let wanted = Vec3::new(radius * (1.0 + t) * libm::cos(a), radius * (3.0 - 2.5 * t) * libm::sin(a), 4.0 * t);
            assert!((shape.point(r, theta, t) - wanted).norm() < 1e-12);
        }
        let section = shape.section(0.5);
        assert!((section.area() - std::f64::consts::PI * 0.3 * 0.3 * 1.5 * 1.75).abs() < 1e-9);
        assert!((section.girth() - 0.3 * (1.5f64 * 1.75).sqrt()).abs() < 1e-12);
        assert!((shape.widest() - 0.5 * 3f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn derivatives_are_differences() {
        for c in samples() {
            let shape = Shape::new(&c).expect("a shape");
            let (h, length) = (1e-6, shape.skeleton().length());
            for k in 0..60 {
                let (r, a, t) = (0.2 + 0.02 * f64::from(k), 0.37 * f64::from(k), 0.011 + 0.0163 * f64::from(k));
                let fd = [
                    shape.point(r + h, a, t) - shape.point(r - h, a, t),
                    shape.point(r, a + h, t) - shape.point(r, a - h, t),
                    shape.point(r, a, t + h) - shape.point(r, a, t - h),
                ];
                let got = shape.derivatives(r, a, t);
                for (fd, got) in fd.into_iter().zip(got) {
                    assert!((fd / (2.0 * h) - got).norm() < 2e-4 * length, "{k}: {} {got}", fd / (2.0 * h));
                }
            }
        }
    }

    #[test]
    fn coordinates_come_back() {
        for c in samples() {
            let shape = Shape::new(&c).expect("a shape");
            for k in 0..60 {
                let (r, a, t) = (0.01 + 0.04 * f64::from(k), 0.37 * f64::from(k), f64::from(k) / 60.0);
                let section = shape.section(t);
                let p = section.point(r, a);
                assert!((p - section.centre).dot(&section.axes[0]).abs() < 1e-12);
                let [rr, aa] = section.coordinates(p);
                let turns = (a - aa) / std::f64::consts::TAU;
                assert!((rr - r).abs() < 1e-9 && (turns - turns.round()).abs() < 1e-9, "{r} {rr} {turns}");
                assert_eq!(section.coordinates(section.centre), [0.0; 2]);
            }
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let of = |edit: &dyn Fn(&mut Cylinder)| {
            let mut c = plain(vec![Vec3::zeros(), Vec3::z()], 1.0);
            edit(&mut c);
            Shape::new(&c).map(|_| ()).unwrap_err()
        };
        assert!(of(&|c| c.control.clear()).contains("2 control points"));
        assert!(of(&|c| c.contour.radius.clear()).contains("0 radii"));
        assert!(of(&|c| c.contour.radius[0] = 0.0).contains("above 0"));
        assert!(of(&|c| c.contour.t.clear()).contains("the contour has no stations"));
        assert!(of(&|c| c.scale[1].value[0] = -1.0).contains("the scale along B is below 0"));
        assert!(of(&|c| c.scale[1].value[0] = 0.0).contains("no width"));
        assert!(of(&|c| c.twist.t[0] = -1.0).contains("the twist"));
    }
}
