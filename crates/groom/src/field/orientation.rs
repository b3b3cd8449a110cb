//! Directions of vector fields.

use crate::flow::segment;
use pelage_geom::Vec3;
use pelage_geom::curve::closest_on_polyline;

/// The direction of a primitive in its own coordinates: unit vectors but for a [`Orientation::Wave`], zero where there
/// is none.
#[derive(Clone, Debug, PartialEq)]
pub enum Orientation {
    /// The same everywhere.
    Constant {
        /// Any length.
        direction: Vec3,
    },
    /// Away from the origin; with a negative strength toward it.
    Radial,
    /// Around the z axis, counter-clockwise seen from +z.
    Around,
    /// As a polyline runs at its nearest point.
    Along {
        /// At least two points.
        points: Vec<Vec3>,
    },
    /// Away from the plane x = 0 on either side: hair parts there (figure 4a).
    Divide,
    /// Around a wire as the magnetic field of a current in it (law of Biot and Savart; figure 4b), drawn to the surface
    /// of a tube about it: hair winds up on a roller.
    Roller {
        /// The wire, at least two points: straight or an arc.
        points: Vec<Vec3>,
        /// Radius of the tube, positive.
        radius: f64,
        /// Advance along the wire for the same length around it: 0 winds on the spot.
        pitch: f64,
    },
    /// A wave that runs through space (figure 4c): hair along `along` sways in the direction of `across` by
    /// amplitude * wavelength / (2 pi).
    Wave {
        /// Where hair runs, any length.
        along: Vec3,
        /// Where it sways, any length.
        across: Vec3,
        /// Length of a wave.
        wavelength: f64,
        /// Greatest slope.
        amplitude: f64,
        /// Radians; 0 begins at the steepest.
        phase: f64,
    },
}

impl Orientation {
    /// Direction at a point.
    pub fn direction(&self, at: Vec3) -> Vec3 {
        let unit = |v: Vec3| v.try_normalize(0.0).unwrap_or_default();
        match self {
            Orientation::Constant { direction } => unit(*direction),
            Orientation::Radial => unit(at),
            Orientation::Around => unit(Vec3::new(-at.y, at.x, 0.0)),
            Orientation::Along { points } => tangent(points, at).0,
            Orientation::Divide => {
                if at.x == 0.0 {
                    Vec3::zeros()
                } else {
                    Vec3::new(at.x.signum(), 0.0, 0.0)
                }
            }
            Orientation::Roller { points, radius, pitch } => {
                let around = points.windows(2).fold(Vec3::zeros(), |v, w| v + segment(at, w[0], w[1], 0.0));
                let (along, near) = tangent(points, at);
                let out = at - near;
                let pull = ((radius - out.norm()) / radius).clamp(-1.0, 1.0);
                unit(unit(around) + unit(out) * pull + along * *pitch)
            }
            Orientation::Wave { along, across, wavelength, amplitude, phase } => {
                let along = unit(*along);
                let angle = std::f64::consts::TAU * at.dot(&along) / wavelength + phase;
                along + unit(*across) * (amplitude * libm::cos(angle))
            }
        }
    }

    /// The curve that distances are taken from.
    pub(super) fn curve(&self) -> Option<&[Vec3]> {
        match self {
            Orientation::Along { points } | Orientation::Roller { points, .. } => Some(points),
            _ => None,
        }
    }
}

/// Unit tangent of a polyline at its point nearest to `at`, and that point.
fn tangent(points: &[Vec3], at: Vec3) -> (Vec3, Vec3) {
    let (k, _, near, _) = closest_on_polyline(points, at);
    let direction = points.get(k + 1).map_or(Vec3::zeros(), |b| b - points[k]);
    (direction.try_normalize(0.0).unwrap_or_default(), near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{GuideField, Primitive};
    use crate::flow::trace::{Start, Trace};
    use std::f64::consts::{PI, TAU};

    fn hair(orientation: Orientation, at: Vec3, length: f64) -> Vec<Vec3> {
        let field = GuideField { primitives: vec![Primitive::new(orientation)], ..GuideField::default() };
        let settings = Trace { points: 401, step: 0.0, reverse: false, slow: 0.0 };
        field.trace(&[Start { at, direction: Vec3::y(), length }], &settings, None).at
    }

    /// Angle that a line has gone around the z axis.
    fn turns(line: &[Vec3]) -> f64 {
        let step = |w: &[Vec3]| libm::atan2(w[0].x * w[1].y - w[0].y * w[1].x, w[0].x * w[1].x + w[0].y * w[1].y);
        line.windows(2).map(step).sum::<f64>() / TAU
    }

    #[test]
    fn a_wave_sways_by_its_amplitude() {
        let (along, across) = (Vec3::x() * 3.0, Vec3::z());
        let wave = Orientation::Wave { along, across, wavelength: 2.0, amplitude: 0.5, phase: 0.0 };
        for p in hair(wave, Vec3::zeros(), 6.0) {
            assert!((p.z - 0.5 * 2.0 / TAU * libm::sin(PI * p.x)).abs() < 1e-6 && p.y == 0.0);
        }
    }

    #[test]
    fn hair_winds_on_a_roller() {
        let points = vec![Vec3::z() * -50.0, Vec3::z() * 50.0];
        let roller = Orientation::Roller { points, radius: 0.5, pitch: 0.1 };
        for from in [1.5, 0.2] {
            let line = hair(roller.clone(), Vec3::x() * from, 20.0);
            let end = &line[300..];
            assert!(end.iter().all(|p| (p.xy().norm() - 0.5).abs() < 1e-3), "{}", end[0].xy().norm());
            // A helix: its pitch, and so its turns.
            let round = turns(end);
            assert!((round - 5.0 / (1.0f64 + 0.01).sqrt() / (TAU * 0.5)).abs() < 0.01, "{round}");
            let advance = end[100].z - end[0].z;
            assert!((advance / round - TAU * 0.5 * 0.1).abs() < 1e-3, "{advance} {round}");
        }
    }

    #[test]
    fn directions_are_what_they_are_called() {
        let at = Vec3::new(3.0, -4.0, 5.0);
        assert_eq!(Orientation::Around.direction(at), Vec3::new(0.8, 0.6, 0.0));
        assert!((Orientation::Radial.direction(at) - at / 50f64.sqrt()).norm() < 1e-15);
        assert_eq!(Orientation::Divide.direction(at), Vec3::x());
        assert_eq!(Orientation::Divide.direction(-at), -Vec3::x());
        let points = vec![Vec3::zeros(), Vec3::x(), Vec3::new(1.0, 2.0, 0.0)];
        let along = Orientation::Along { points: points.clone() };
        assert_eq!(along.direction(Vec3::new(0.2, -1.0, 0.0)), Vec3::x());
        assert_eq!(along.direction(Vec3::new(2.0, 1.5, 0.0)), Vec3::y());
        assert_eq!(Orientation::Along { points: Vec::new() }.direction(at), Vec3::zeros());
        for o in [Orientation::Around, Orientation::Radial, Orientation::Divide] {
            assert_eq!(o.direction(Vec3::zeros()), Vec3::zeros());
        }
        // Near an arc of current the field goes around it.
        let arc: Vec<Vec3> =
            (0..40).map(|k| f64::from(k) * 0.05).map(|a| Vec3::new(libm::cos(a), libm::sin(a), 0.0)).collect();
        let near = arc[20] * 1.05;
        let roller = Orientation::Roller { points: arc, radius: 0.05, pitch: 0.0 };
        assert!(roller.direction(near).dot(&Vec3::z()) < -0.99);
    }
}
