//! Guide hairs that follow a sum of simple vector fields.
//!
//! After Chang, Jin, Yu (course notes 2003, "sparse guide hairs"), §2.1 and 2.2: each primitive is a direction and a
//! strength in coordinates of its own, acts on the hair of its regions of the scalp, and makes one large feature of the
//! style; hair follows their sum, segment by segment, up to its length ([`lengths`]).

pub mod lengths;
mod orientation;

pub use orientation::Orientation;

use crate::flow::trace::{Guard, Lines, Start, Trace, trace};
use nalgebra::UnitQuaternion;
use pelage_geom::Vec3;
use rayon::prelude::*;

/// One vector field.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Origin of its coordinates, scene space.
    pub position: Vec3,
    /// Turns its coordinates into the scene's.
    pub rotation: UnitQuaternion<f64>,
    /// Its direction at a point.
    pub orientation: Orientation,
    /// Its strength at its reference, negative to turn it round. Strengths of primitives weigh against each other; the
    /// speed of the sum does not matter.
    pub strength: f64,
    /// How the strength falls with distance from the origin, or from the curve of [`Orientation::Along`] and
    /// [`Orientation::Roller`].
    pub falloff: Falloff,
    /// Lengths of its axes that count as distance 1: (1, 1, 1) for scene units, unequal for an ellipsoid. A thin one
    /// divides hair (figure 4a). All positive; with a curve only the first counts.
    pub shape: Vec3,
    /// Regions of the scalp that it acts on, by where hairs are rooted; none for everywhere.
    pub domain: Vec<Region>,
    /// Acts on hair on the other side of dividers too.
    pub across: bool,
}

impl Primitive {
    /// A primitive of strength 1 everywhere, in scene coordinates.
    pub fn new(orientation: Orientation) -> Self {
        Primitive {
            position: Vec3::zeros(),
            rotation: UnitQuaternion::identity(),
            orientation,
            strength: 1.0,
            falloff: Falloff::Uniform,
            shape: Vec3::repeat(1.0),
            domain: Vec::new(),
            across: false,
        }
    }

    /// Its vector at a point, scene space.
    pub fn vector(&self, at: Vec3) -> Vec3 {
        let local = self.rotation.inverse_transform_vector(&(at - self.position));
        let distance = match self.orientation.curve() {
            Some(points) => pelage_geom::curve::closest_on_polyline(points, local).3 / self.shape.x,
            None => local.component_div(&self.shape).norm(),
        };
        let strength = self.strength * self.falloff.factor(distance);
        if strength == 0.0 {
            return Vec3::zeros();
        }
        self.rotation.transform_vector(&self.orientation.direction(local)) * strength
    }
}

/// How a strength falls with distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Falloff {
    /// The same everywhere.
    Uniform,
    /// (near / r)^exponent, and 1 within `near`.
    InversePower {
        /// Power, positive.
        exponent: f64,
        /// Distance within which it is 1, positive.
        near: f64,
    },
    /// `s0` up to `r0`, `s1` beyond `r1`, half a cosine between (equation 1).
    Smooth {
        /// Distance where it begins to change.
        r0: f64,
        /// Distance where it ends to; more than `r0`.
        r1: f64,
        /// Factor within.
        s0: f64,
        /// Factor beyond; 0 for a field of local influence.
        s1: f64,
    },
}

impl Falloff {
    /// Factor at a distance.
    pub fn factor(&self, r: f64) -> f64 {
        match *self {
            Falloff::Uniform => 1.0,
            Falloff::InversePower { exponent, near } => {
                if r > near {
                    libm::pow(near / r, exponent)
                } else {
                    1.0
                }
            }
            Falloff::Smooth { r0, r1, s0, s1 } => {
                if r <= r0 {
                    s0
                } else if r >= r1 {
                    s1
                } else {
                    let c = libm::cos((r - r0) / (r1 - r0) * std::f64::consts::PI);
                    0.5 * (s0 + s1) + 0.5 * (s0 - s1) * c
                }
            }
        }
    }
}

/// A part of space, scene coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// Within an ellipsoid.
    Ellipsoid {
        /// Its centre.
        centre: Vec3,
        /// Turns its axes into the scene's.
        rotation: UnitQuaternion<f64>,
        /// Half its axes, positive; equal for a sphere.
        radii: Vec3,
    },
    /// The side of a plane that its normal points to.
    HalfSpace {
        /// A point of the plane.
        point: Vec3,
        /// Its normal, any length.
        normal: Vec3,
    },
}

impl Region {
    /// True within the region and on its border.
    pub fn contains(&self, at: Vec3) -> bool {
        match self {
            Region::Ellipsoid { centre, rotation, radii } => {
                rotation.inverse_transform_vector(&(at - centre)).component_div(radii).norm_squared() <= 1.0
            }
            Region::HalfSpace { point, normal } => (at - point).dot(normal) >= 0.0,
        }
    }
}

/// Primitives and what divides them.
#[derive(Clone, Debug, Default)]
pub struct GuideField {
    /// The primitives.
    pub primitives: Vec<Primitive>,
    /// Dividers: hair rooted on one side of their borders sees only the primitives positioned on that side, but for
    /// those that act `across`.
    pub dividers: Vec<Region>,
    /// Factors on the strength of each primitive, \[hairs that are traced\]; without, or empty, 1 for all.
    pub factor: Vec<Vec<f32>>,
}

impl GuideField {
    /// The primitives that act on a hair rooted at a point, by number.
    pub fn seen_from(&self, root: Vec3) -> Vec<usize> {
        let same_side = |p: &Primitive| self.dividers.iter().all(|d| d.contains(root) == d.contains(p.position));
        let reaches = |p: &Primitive| p.domain.is_empty() || p.domain.iter().any(|d| d.contains(root));
        let acts = |p: &Primitive| reaches(p) && (p.across || same_side(p));
        (0..self.primitives.len()).filter(|k| acts(&self.primitives[*k])).collect()
    }

    /// The vector at a point for a hair rooted at `root`: the sum over what it sees.
    pub fn vector(&self, root: Vec3, at: Vec3) -> Vec3 {
        self.seen_from(root).into_iter().fold(Vec3::zeros(), |v, k| v + self.primitives[k].vector(at))
    }

    /// Guide hairs from every start.
    pub fn trace(&self, starts: &[Start], settings: &Trace, guard: Option<&Guard>) -> Lines {
        let factor = |k: usize, h: usize| self.factor.get(k).and_then(|f| f.get(h)).map_or(1.0, |f| f64::from(*f));
        let seen = |(h, s): (usize, &Start)| -> Vec<(&Primitive, f64)> {
            self.seen_from(s.at).into_iter().map(|k| (&self.primitives[k], factor(k, h))).collect()
        };
        let seen: Vec<_> = starts.par_iter().enumerate().map(seen).collect();
        let field = |h: usize, at: Vec3| seen[h].iter().fold(Vec3::zeros(), |v, (p, f)| v + p.vector(at) * *f);
        trace(field, starts, settings, guard)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACE: Trace = Trace { points: 31, step: 0.0, reverse: false, slow: 0.0 };

    fn constant(v: Vec3) -> Primitive {
        Primitive::new(Orientation::Constant { direction: v })
    }

    fn start(at: Vec3, length: f64) -> Start {
        Start { at, direction: Vec3::y(), length }
    }

    #[test]
    fn strengths_fall_as_they_say() {
        let smooth = Falloff::Smooth { r0: 1.0, r1: 3.0, s0: 2.0, s1: 0.5 };
        for (r, s) in [(0.0, 2.0), (1.0, 2.0), (2.0, 1.25), (3.0, 0.5), (9.0, 0.5)] {
            assert!((smooth.factor(r) - s).abs() < 1e-12);
        }
        let slope = |r: f64| (smooth.factor(r + 1e-6) - smooth.factor(r - 1e-6)) / 2e-6;
        assert!(slope(1.0).abs() < 1e-5 && slope(3.0).abs() < 1e-5 && slope(2.0) < -1.0);
        let power = Falloff::InversePower { exponent: 2.0, near: 0.5 };
        assert_eq!((power.factor(0.2), power.factor(2.0)), (1.0, 0.0625));
    }

    #[test]
    fn a_primitive_moves_and_turns_with_its_coordinates() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0);
        let shift = Vec3::new(4.0, -1.0, 2.0);
        let wire = vec![Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.1, 0.2, 1.0)];
        for orientation in [
            Orientation::Constant { direction: Vec3::new(1.0, 2.0, 0.5) },
            Orientation::Radial,
            Orientation::Around,
            Orientation::Divide,
            Orientation::Along { points: wire.clone() },
            Orientation::Roller { points: wire, radius: 0.5, pitch: 0.1 },
            Orientation::Wave { along: Vec3::x(), across: Vec3::y(), wavelength: 0.7, amplitude: 0.4, phase: 0.2 },
        ] {
            let falloff = Falloff::Smooth { r0: 0.1, r1: 5.0, s0: 1.0, s1: 0.0 };
            let here = Primitive { falloff, shape: Vec3::new(1.0, 0.4, 2.0), ..Primitive::new(orientation) };
            let there = Primitive { position: shift, rotation: turn, ..here.clone() };
            for p in [Vec3::new(0.3, 0.7, -0.2), Vec3::new(-1.0, 0.4, 0.9)] {
                let (a, b) = (here.vector(p), there.vector(shift + turn * p));
                assert!((turn * a - b).norm() < 1e-12 && a.norm() > 1e-3, "{:?}", here.orientation);
            }
        }
    }

    #[test]
    fn hair_sees_its_side_of_dividers_and_its_domain() {
        let mut field = GuideField {
            primitives: vec![
                Primitive { position: Vec3::x(), ..constant(Vec3::x()) },
                Primitive { position: -Vec3::x(), ..constant(-Vec3::x()) },
                Primitive { position: Vec3::x(), across: true, strength: -3.0, ..constant(Vec3::y() * 7.0) },
            ],
            dividers: vec![Region::HalfSpace { point: Vec3::zeros(), normal: Vec3::x() }],
            ..GuideField::default()
        };
        let starts = [start(Vec3::new(0.01, 1.0, 0.0), 2.0), start(Vec3::new(-0.01, 1.0, 0.0), 2.0)];
        let lines = field.trace(&starts, &TRACE, None);
        let down = (Vec3::x() - Vec3::y() * 3.0).normalize() * 2.0;
        assert!((lines.at[30] - starts[0].at - down).norm() < 1e-12);
        assert!((lines.line(1)[30] - starts[1].at - Vec3::new(-down.x, down.y, 0.0)).norm() < 1e-12);
        // Painted strengths: the first hair sees half of the third, the second nothing of its own.
        field.factor = vec![vec![], vec![1.0, 0.0], vec![0.5, 1.0]];
        let lines = field.trace(&starts, &TRACE, None);
        let half = (Vec3::x() - Vec3::y() * 1.5).normalize() * 2.0;
        assert!((lines.line(0)[30] - starts[0].at - half).norm() < 1e-12);
        assert!((lines.line(1)[30] - starts[1].at + Vec3::y() * 2.0).norm() < 1e-12);
        field.factor.clear();
        let ball = |x: f64| Region::Ellipsoid {
            centre: Vec3::x() * x,
            rotation: UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2),
            radii: Vec3::new(1.0, 0.2, 1.0),
        };
        field.dividers = vec![ball(0.0)];
        assert_eq!(field.seen_from(Vec3::new(0.0, 0.9, 0.0)).len(), 1);
        assert_eq!(field.seen_from(Vec3::new(0.9, 0.0, 0.0)).len(), 3);
        field.dividers.clear();
        field.primitives[0].domain = vec![ball(0.0), ball(5.0)];
        let seen = |x: f64| field.seen_from(Vec3::new(x, 0.5, 0.0)).len();
        assert_eq!((seen(0.0), seen(1.0), seen(5.0)), (3, 2, 3));
        assert!((field.vector(Vec3::x() * 2.0, Vec3::zeros()) - Vec3::new(-1.0, -3.0, 0.0)).norm() < 1e-12);
    }
}
