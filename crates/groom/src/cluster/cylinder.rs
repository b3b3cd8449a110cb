//! The generalized cylinder of a cluster, as plain data.

use super::Region;
use super::curve::{Curve, check_stations};
use super::skeleton::turned;
use nalgebra::{Rotation3, Similarity3, UnitQuaternion};
use pelage_geom::{Frame, Vec3};

/// Radii of a cluster: at K equal angles from 0 on, at stations along it. Between them they are smooth.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// \[S\] stations, from 0 at the root to 1 at the tip, each beyond the one before; at least one.
    pub t: Vec<f64>,
    /// K, one or more; one is a circle.
    pub angles: usize,
    /// \[S * K\] radii of one station after the other, scene units, above 0.
    pub radius: Vec<f64>,
}

impl Contour {
    /// The same contour everywhere.
    pub fn constant(radius: Vec<f64>) -> Self {
        Contour { t: vec![0.0], angles: radius.len(), radius }
    }
}

/// A generalized cylinder (Kim, Neumann): V(r, theta, t) = C(t) + r R(theta, t) \[cos(theta + W(t)) S_N(t) N(t) +
/// sin(theta + W(t)) S_B(t) B(t)\]. What evaluates it is [`super::Shape`].
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    /// \[M\] control points of the skeleton C, a Catmull-Rom spline, scene units, root first; at least two.
    pub control: Vec<Vec3>,
    /// Axis of the root: the skin's normal, or the parent's tangent. Unit.
    pub axis: Vec3,
    /// Side of the root, at right angles to `axis`: the skin's tangent along u, or the parent's N. The smallest
    /// rotation of `axis` into the skeleton's first tangent makes it N(0).
    pub side: Vec3,
    /// R.
    pub contour: Contour,
    /// S_N and S_B, 0 or more.
    pub scale: [Curve; 2],
    /// W, radians.
    pub twist: Curve,
}

impl Cylinder {
    /// A cylinder along `control` with the same contour everywhere (radii at equal angles from the direction of u to
    /// that of v), without scale and twist. `root` is the skin's frame at its root.
    pub fn new(control: Vec<Vec3>, root: &Frame, radius: Vec<f64>) -> Self {
        Cylinder::plain(control, root.n, root.du, radius)
    }

    /// The same from an axis and a side of its root.
    pub(super) fn plain(control: Vec<Vec3>, axis: Vec3, side: Vec3, radius: Vec<f64>) -> Self {
        Cylinder {
            control,
            axis,
            side,
            contour: Contour::constant(radius),
            scale: [Curve::constant(1.0), Curve::constant(1.0)],
            twist: Curve::constant(0.0),
        }
    }

    /// A cylinder along `control` whose section at the root is a region of scalp space laid on the skin. `root` is the
    /// skin's frame at the region's centre, where a unit of u and one of v are `unit` long, scene units: a root there
    /// is where V(r, theta, 0) is for its r and angle in the region, if the skin is flat and the skeleton stands
    /// upright.
    pub fn over(region: &Region, control: Vec<Vec3>, root: &Frame, unit: [f64; 2]) -> Self {
        let mean = (unit[0] * unit[1]).sqrt();
        let radius = region.radius.iter().map(|r| r * mean).collect();
        Cylinder { scale: unit.map(|u| Curve::constant(u / mean)), ..Cylinder::new(control, root, radius) }
    }

    /// It after a rigid motion, or a motion that scales.
    pub fn moved(&self, by: &Similarity3<f64>) -> Self {
        let mut out = self.clone();
        out.control.iter_mut().for_each(|p| *p = by.transform_point(&(*p).into()).coords);
        out.axis = by.isometry.rotation * self.axis;
        out.side = by.isometry.rotation * self.side;
        out.contour.radius.iter_mut().for_each(|r| *r *= by.scaling());
        out
    }

    /// From its own coordinates (axis, side, axis x side at its root, in units of `size`) to the scene.
    pub(super) fn root_motion(&self, size: f64) -> Similarity3<f64> {
        let axis = self.axis.normalize();
        let side = turned(self.side, axis, axis);
        let basis = Rotation3::from_basis_unchecked(&[axis, side, axis.cross(&side)]);
        Similarity3::from_parts(self.control[0].into(), UnitQuaternion::from_rotation_matrix(&basis), size)
    }

    /// Says what is wrong with it beside its skeleton.
    pub(super) fn check(&self) -> Result<(), String> {
        let Contour { t, angles, radius } = &self.contour;
        check_stations(t, "the contour")?;
        if *angles == 0 || radius.len() != t.len() * angles {
            let (s, n) = (t.len(), radius.len());
            return Err(format!("a contour of {s} stations with {angles} angles has {n} radii"));
        }
        if !radius.iter().all(|r| r.is_finite() && *r > 0.0) {
            return Err("radii of a contour must be above 0".into());
        }
        for (s, name) in self.scale.iter().zip(["the scale along N", "the scale along B"]) {
            s.check(name)?;
            if s.value.iter().any(|v| *v < 0.0) {
                return Err(format!("{name} is below 0"));
            }
        }
        self.twist.check("the twist")
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shape;
    use super::*;

    #[test]
    fn a_cylinder_over_a_region_stands_on_it() {
        let region = Region { centre: [0.4, 0.6], radius: vec![0.1, 0.2, 0.15, 0.1, 0.12] };
        let root = Frame { origin: Vec3::new(1.0, 2.0, 3.0), n: Vec3::y(), du: Vec3::z(), dv: Vec3::x() };
        let c = Cylinder::over(&region, vec![root.origin, root.origin + root.n * 2.0], &root, [3.0, 5.0]);
        let shape = Shape::new(&c).expect("a shape");
        for k in 0..30 {
            let uv = [0.4 + 0.01 * f64::from(k % 6) - 0.02, 0.6 + 0.01 * f64::from(k % 5)];
            let wanted = root.origin + root.du * (3.0 * (uv[0] - 0.4)) + root.dv * (5.0 * (uv[1] - 0.6));
            let [r, angle] = region.polar(uv);
            assert!((shape.point(r, angle, 0.0) - wanted).norm() < 1e-12);
        }
    }
}
