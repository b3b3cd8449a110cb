//! Spring constants from a rod's stiffness.
//!
//! Triangles are nearly rigid, so a strand is a chain of them, hinged at the hair's points. At a hinge three springs
//! (torsion, torsion, bending between the two extra particles) and two altitude springs resist the relative rotation. The
//! hinge's 3 x 3 stiffness couples bending and twisting, with a sign that turns with the azimuth; under a constant moment
//! the hinges' rotations add, so the strand answers with the *mean of the hinges' compliances* over a turn of the
//! azimuth, four hinges: the axial entry for twisting, the mean of the two others for bending. Two unknown constants, two
//! targets.

use super::layout::EQUILATERAL;
use super::tetrahedron::{largest, volume};
use crate::{Material, Vec3};
use nalgebra::Matrix3;

/// Altitude springs' constant over that of torsion springs. At 1 the strand is 2.7 times too stiff when bent far and the
/// choice of altitude chatters at rest; without them (below about 0.02) hinges past 0.3 to 0.5 rad fold.
pub const ALTITUDE: f64 = 0.1;

/// Stiffness of a round section, and its mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Young's modulus times area, `EA`, newtons.
    pub stretching: f64,
    /// Young's modulus times second moment of area, `EI`, newton square metres.
    pub bending: f64,
    /// Shear modulus times polar moment, `GJ`, newton square metres.
    pub twisting: f64,
    /// Mass per length, kilograms per metre.
    pub line_density: f64,
    /// Relaxation time of bending and twisting, seconds.
    pub damping: f64,
}

impl Section {
    /// Of a hair: `A = pi d^2 / 4`, `I = pi d^4 / 64`, `J = 2 I`, `G = E / (2 (1 + nu))`; with the artist's factors.
    pub fn round(m: &Material) -> Section {
        let d2 = m.diameter * m.diameter;
        let area = std::f64::consts::PI * d2 / 4.0;
        let bending = m.young * area * d2 / 16.0;
        Section {
            stretching: m.young * area * m.stretch_factor,
            bending: bending * m.bend_factor,
            twisting: bending / (1.0 + m.poisson) * m.twist_factor,
            line_density: m.density * area,
            damping: m.damping,
        }
    }
}

/// Factors on the closed forms that [`super::plain::Model`] takes its constants from, for one ratio of twisting to
/// bending stiffness. All are ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Distance of the extra particles from the axis, in segments. [`EQUILATERAL`] up to `GJ / EI` = 1.25 (Poisson's
    /// ratio -0.2), farther beyond: three springs alone can't give more than `2 height^2`.
    pub height: f64,
    /// Torsion springs: their constant is this times `EI l0^3 / (l |a x b|^2)`, where `a` and `b` lead from the hinge to
    /// the ends and `l` is half the length of the two segments.
    pub torsion: f64,
    /// Bending springs between extra particles: this times `EI l0^3 / (l ((a x b) . t)^2)`, `t` along the axis.
    pub bending: f64,
    /// Altitude springs: their constant over the torsion spring's on the same particles.
    pub altitude: f64,
}

/// The hinge between two straight unit segments: how fast each spring lengthens as the second segment turns about the
/// hinge, and the springs' rest lengths.
struct Hinge {
    /// Torsion, torsion, bending: length per radian about the axis and across it.
    springs: [(Vec3, f64); 3],
    /// Altitudes: strain per radian, and the altitude.
    altitudes: [(Vec3, f64); 2],
}

fn hinge(height: f64) -> Hinge {
    let x = [
        Vec3::new(-1.0, 0.0, 0.0),
        Vec3::new(-0.5, height, 0.0),
        Vec3::zeros(),
        Vec3::new(0.5, 0.0, height),
        Vec3::new(1.0, 0.0, 0.0),
    ];
    let spring = |a: usize, b: usize| {
        let length = (x[b] - x[a]).norm();
        // b moves by r x b: the length grows by (b - a)/l . (r x b) = r . (a x b) / l.
        (x[a].cross(&x[b]) / length, length)
    };
    let altitude = |first: usize| {
        // As in the strand, vertex 0 is the last particle.
        let at: [usize; 4] = std::array::from_fn(|k| first + 3 - k);
        let v = volume(at.map(|i| x[i]));
        let (h, n, w) = v.altitude(largest(&v.areas_squared()));
        let turn: Vec3 = (0..4).filter(|&k| at[k] > 2).map(|k| x[at[k]].cross(&n) * w[k]).sum();
        (turn / h, h.abs())
    };
    Hinge { springs: [spring(0, 3), spring(1, 4), spring(1, 3)], altitudes: [altitude(0), altitude(1)] }
}

/// Mean compliance in twisting and in bending of hinges with torsion springs of constant 1.
fn compliance(hinge: &Hinge, bending: f64, altitude: f64) -> (f64, f64) {
    let mut k = Matrix3::zeros();
    for ((row, length), constant) in hinge.springs.iter().zip([1.0, 1.0, bending]) {
        k += row * row.transpose() * (constant / length);
    }
    for (row, h) in &hinge.altitudes {
        k += row * row.transpose() * (altitude * h);
    }
    let c = k.try_inverse().unwrap_or_else(Matrix3::zeros);
    (c[(0, 0)], 0.5 * (c[(1, 1)] + c[(2, 2)]))
}

/// Calibration for `ratio` = `GJ / EI` > 0; `1 / (1 + nu)` for a round section.
///
/// At `nu` = 0.3, without altitude springs: torsion 1, bending spring 1.6015 times the torsion spring.
pub fn calibrate(ratio: f64) -> Calibration {
    calibrate_with(ratio, ALTITUDE * (ratio / 0.2).min(1.0))
}

/// [`calibrate`] with a share of altitude springs of one's own. A very low `ratio` needs less of them, since they alone
/// resist twisting with a fortieth of the bending stiffness.
pub fn calibrate_with(ratio: f64, altitude: f64) -> Calibration {
    let height = EQUILATERAL.max((0.6 * ratio).sqrt());
    let hinge = hinge(height);
    // GJ / EI = c_bend / c_twist grows with the bending springs' constant.
    let (mut low, mut high) = (1e-9_f64, 1e9_f64);
    for _ in 0..100 {
        let middle = (low * high).sqrt();
        let (twist, bend) = compliance(&hinge, middle, altitude);
        if bend < ratio * twist { low = middle } else { high = middle }
    }
    let over_torsion = (low * high).sqrt();
    let (_, bend) = compliance(&hinge, over_torsion, altitude);
    // Rows hold |a x b| / l0, so EI = row^2 / l0 for a constant of 1 on unit segments.
    let [(across, torsion_length), _, (coupled, bending_length)] = hinge.springs;
    let torsion = bend * across.norm_squared() / torsion_length;
    let bending = bend * over_torsion * coupled.x * coupled.x / bending_length;
    Calibration { height, torsion, bending, altitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_altitude_springs_the_closed_forms_hold() {
        // EI = sqrt(3)/12 k_t l^2: the torsion factor is 1. The measured lead: k_b / k_t = 1.6015 at nu = 0.3.
        let c = calibrate_with(1.0 / 1.3, 0.0);
        assert!((c.torsion - 1.0).abs() < 1e-12);
        let hinge = hinge(EQUILATERAL);
        let per_bending = hinge.springs[2].1 / hinge.springs[2].0.x.powi(2);
        let per_torsion = hinge.springs[0].1 / hinge.springs[0].0.norm_squared();
        assert!((1.0 / per_torsion - 3f64.sqrt() / 12.0).abs() < 1e-12);
        assert!((c.bending * per_bending / (c.torsion * per_torsion) - 1.601_528).abs() < 1e-5);
    }

    #[test]
    fn every_ratio_is_met() {
        for poisson in [-0.99, -0.9, -0.5, -0.34, -0.2, 0.0, 0.3, 0.5] {
            let ratio = 1.0 / (1.0 + poisson);
            let c = calibrate(ratio);
            let hinge = hinge(c.height);
            let per = |s: (Vec3, f64), row2: f64| s.1 / row2;
            let torsion = c.torsion * per(hinge.springs[0], hinge.springs[0].0.norm_squared());
            let bending = c.bending * per(hinge.springs[2], hinge.springs[2].0.x.powi(2));
            let (twist, bend) = compliance(&hinge, bending / torsion, c.altitude);
            assert!((bend / twist / ratio - 1.0).abs() < 1e-9, "{poisson}");
            assert!((torsion / bend - 1.0).abs() < 1e-9, "{poisson}: bending stiffness {}", torsion / bend);
        }
    }
}
