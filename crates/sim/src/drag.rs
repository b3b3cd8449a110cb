//! Drag of the air on a thin round fibre, as coefficients for an implicit step.
//!
//! A hair of 50 to 100 micrometres in air at up to 10 m/s has a Reynolds number (by diameter) of up to 70, mostly 0.01
//! to 10: neither Stokes' flow, where drag is proportional to speed, nor the square law. With `u` the velocity of the
//! hair relative to the air, the force per length is
//!
//! `f = -across u_across - along u_along`, across and along the hair's direction,
//!
//! and both coefficients grow slowly with speed. Everything here is made of additions, multiplications, divisions,
//! maxima and square roots: exact on every machine, and cheap in lanes.

/// The air. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Density, kilograms per cubic metre.
    pub density: f64,
    /// Dynamic viscosity, pascal seconds.
    pub viscosity: f64,
}

impl Default for Air {
    /// Dry air at 20 degrees Celsius and 101,325 Pa (US Standard Atmosphere 1976: ideal gas; Sutherland's formula).
    fn default() -> Self {
        Air { density: 1.204, viscosity: 1.813e-5 }
    }
}

/// Drag coefficients of a fibre, newton seconds per metre of speed, per metre of length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drag {
    /// Against motion across the fibre.
    pub across: f64,
    /// Against motion along the fibre.
    pub along: f64,
}

/// Largest ratio of diameter to length that is treated as slender; shorter stubs get the drag of this one.
const STUB: f64 = 0.05;

/// What crossing air adds to [`axial`]'s `reach`, times `Re^2`. 0.0055 would be 18 % high at Re 44, 0.003 13 % low at 0.02.
const CROSSING: f64 = 0.004;

/// Drag coefficients of a fibre of a `diameter` and `length` (metres) that moves through the air with the speeds
/// `across` and `along` itself (metres per second, not negative).
///
/// **Across**: `F/L = 1/2 rho d Cd u^2`, that is `mu/2 (Cd Re) u`, see [`cross_flow`].
///
/// **Along**: the fibre drags a layer of air with it, and drag is a function of how far that layer reaches, see
/// [`axial`]. Its reach is cut by the fibre's length, by its growth along a fibre that moves lengthwise, and by air that
/// crosses: the speed along an infinite yawed cylinder obeys the equation of a passive scalar with Prandtl number 1
/// (W. R. Sears, J. Aeronaut. Sci. 15, 1948), so there `F/L = pi mu Nu(Re, Pr = 1) u`. With `Nu` of D. C. Collis and
/// M. J. Williams (J. Fluid Mech. 6, 1959: `0.24 + 0.56 Re^0.45` in air, Re 0.02 to 44), carried from Pr = 0.7 to 1 at
/// equal Peclet number, that cut is `(Re / 16)^2` in the measure of [`axial`], within 12 %. It comes to 0.5 to 0.6 of
/// the drag across for Re from 0.05 to 10.
///
/// At rest both are Stokes' drag of a slender cylinder of that length, so they stay finite and the force is linear.
/// `length` enters by its logarithm only: the hair's own length will do for all of its points.
#[inline]
pub fn drag(air: &Air, diameter: f64, length: f64, across: f64, along: f64) -> Drag {
    let slender = (diameter / length).min(STUB);
    let length = diameter / slender;
    let kinematic = air.viscosity / air.density;
    let re = across * diameter / kinematic;
    // Square of (radius / distance to which the fibre drags the air along): Stokes' drag reaches its length, axial
    // motion at speed U reaches sqrt(4 nu L / U) before the fibre has passed.
    let reach = 0.25 * slender * slender * (1.0 + 0.25 * along * length / kinematic);
    // Re at which the cross flow's own reach, 3 nu / U, equals that distance: slender-body theory for a cylinder has
    // `4 pi mu / (ln(L/a) + 0.193)`, and [`cross_flow`] goes as `4 pi mu / (2.0022 - ln Re)`.
    let still = 6.105 * reach.sqrt();
    Drag {
        across: 0.5 * air.viscosity * cross_flow(re + still),
        along: air.viscosity * axial(reach + CROSSING * re * re),
    }
}

/// `Cd Re` of a long cylinder in cross flow, `Cd` by diameter and `Re = rho u d / mu`.
///
/// A cubic in `Re^(1/4)`, fitted to S. Kaplun's expansion up to Re 0.5 (J. Math. Mech. 6, 1957: `Cd = 8 pi / Re (D -
/// 0.87 D^3)`, `1/D = 2.0022 - ln Re`, which follows D. J. Tritton's measurements, J. Fluid Mech. 6, 1959) and to the
/// steady solutions of S. C. R. Dennis and G.-Z. Chang from 5 to 40 (J. Fluid Mech. 42, 1970): within 4 % of both for
/// Re from 0.001 to 50. Above 56 the wake sheds vortices and `Cd` is held at 1.33, within 5 % up to Re 300 (R. D.
/// Henderson, Phys. Fluids 7, 1995) and within a third up to 1e5.
#[inline]
pub fn cross_flow(re: f64) -> f64 {
    let q = re.sqrt().sqrt();
    let steady = 1.956 + q * (4.872 + q * (1.320 + q * 2.424));
    steady.max(1.33 * re)
}

/// Drag per length along a fibre over viscosity and speed, where nothing blows across it; `reach` is the square of
/// (radius / distance to which the air is dragged along).
///
/// Slender-body theory at rest has `2 pi / (ln(L/a) - 0.807)` (G. K. Batchelor, J. Fluid Mech. 44, 1970), the mean over
/// a laminar layer that grows along the fibre tends to `4 pi / (ln(4 nu L / (U a^2)) - 1.58)` (M. B. Glauert and M. J.
/// Lighthill, Proc. R. Soc. A 230, 1955): one function of `reach`. A quadratic in `reach^(1/8)`, within 10 % of the
/// first and of their integral method for `reach` from 1e-8 to 0.1, that is for hairs from 1 cm at up to 20 m/s.
#[inline]
pub fn axial(reach: f64) -> f64 {
    let y = reach.sqrt().sqrt().sqrt();
    0.564 + y * (1.113 + y * 6.818)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAIR: f64 = 70e-6;

    #[test]
    fn cross_flow_follows_tables_and_theory() {
        // Dennis and Chang 1970, table 2 (steady).
        for (re, cd) in [(5.0, 4.116), (7.0, 3.421), (10.0, 2.846), (20.0, 2.045), (40.0, 1.522)] {
            let ours = cross_flow(re) / re;
            assert!((ours / cd - 1.0).abs() < 0.02, "Re {re}: {ours} for {cd}");
        }
        // Kaplun 1957.
        for re in [0.001, 0.003, 0.01, 0.03, 0.1, 0.3] {
            let d = 1.0 / (2.0022 - libm::log(re));
            let cd = 8.0 * std::f64::consts::PI / re * (d - 0.87 * d * d * d);
            let ours = cross_flow(re) / re;
            assert!((ours / cd - 1.0).abs() < 0.04, "Re {re}: {ours} for {cd}");
        }
        // Vortex shedding, Henderson 1995.
        for (re, cd) in [(100.0, 1.35), (200.0, 1.34)] {
            assert!((cross_flow(re) / re / cd - 1.0).abs() < 0.05);
        }
    }

    #[test]
    fn at_rest_it_is_the_stokes_drag_of_a_slender_cylinder() {
        let air = Air::default();
        for length in [0.01, 0.05, 0.2, 0.5] {
            let d = drag(&air, HAIR, length, 0.0, 0.0);
            let ln = libm::log(2.0 * length / HAIR);
            let across = 4.0 * std::f64::consts::PI * air.viscosity / (ln + 0.193);
            let along = 2.0 * std::f64::consts::PI * air.viscosity / (ln - 0.807);
            assert!((d.across / across - 1.0).abs() < 0.06, "{length} across {} for {across}", d.across);
            assert!((d.along / along - 1.0).abs() < 0.20, "{length} along {} for {along}", d.along);
        }
    }

    /// Mean drag over viscosity and speed by Glauert and Lighthill's integral method: a velocity `ln(r/a) / alpha`
    /// with `d/dx (momentum thickness) = nu / (U alpha)`, integrated from the leading end to `4 nu x / (U a^2) = end`.
    fn integral_method(end: f64) -> f64 {
        // Momentum thickness over a^2, and its growth, in closed form.
        let theta = |a: f64| {
            let e = libm::exp(2.0 * a);
            // integral of (s/a)(1 - s/a) e^{2s} over 0..a
            let i1 = (e * (2.0 * a - 1.0) + 1.0) / 4.0;
            let i2 = (e * (2.0 * a * a - 2.0 * a + 1.0) - 1.0) / 4.0;
            i1 / a - i2 / (a * a)
        };
        let (mut x, mut a, da) = (0.0, 1e-2, 1e-4);
        x += 2.0 / 3.0 * a * theta(a);
        while 4.0 * x < end {
            x += (a + 0.5 * da) * (theta(a + da) - theta(a));
            a += da;
        }
        2.0 * std::f64::consts::PI * theta(a) / x
    }

    #[test]
    fn along_a_hair_the_layer_grows_as_glauert_and_lighthill_have_it() {
        for end in [10.0, 30.0, 100.0, 1e3, 1e4, 1e5, 1e6] {
            let theirs = integral_method(end);
            let ours = axial(1.0 / end);
            assert!((ours / theirs - 1.0).abs() < 0.13, "{end}: {ours} for {theirs}");
        }
        for end in [1e5, 1e6, 1e7, 1e8] {
            let theirs = 4.0 * std::f64::consts::PI / (libm::log(end) - 1.577);
            assert!((axial(1.0 / end) / theirs - 1.0).abs() < 0.06);
        }
    }

    #[test]
    fn crossing_air_drags_along_as_a_heated_wire_cools() {
        // Collis and Williams 1959, carried from Pr 0.7 to 1 at equal Peclet number.
        let air = Air { density: 1.0, viscosity: 1.0 };
        for re in [0.02f64, 0.1, 1.0, 5.0, 44.0] {
            let nusselt = 0.24 + 0.56 * libm::pow(re / 0.7, 0.45);
            let d = drag(&air, 1.0, 1e6, re, 0.0).along / std::f64::consts::PI;
            assert!((d / nusselt - 1.0).abs() < 0.13, "Re {re}: {d} for {nusselt}");
        }
        // About half of the drag across.
        let air = Air::default();
        for u in [0.02, 0.1, 0.3, 1.0, 2.0] {
            let d = drag(&air, HAIR, 0.2, u, 0.0);
            assert!((0.45..0.7).contains(&(d.along / d.across)), "{u}: {}", d.along / d.across);
        }
    }

    #[test]
    fn drag_grows_with_speed_and_is_finite_everywhere() {
        let air = Air::default();
        for length in [0.0, 1e-6, 1e-3, 0.3, 1e3] {
            for other in [0.0, 1.0, 1e6] {
                let mut last = Drag::default();
                for e in -40..=40 {
                    let u = libm::exp2(f64::from(e) * 0.5);
                    let d = drag(&air, HAIR, length, u, other);
                    assert!(d.across.is_finite() && d.across >= last.across, "{length} {u}");
                    assert!(d.along.is_finite() && d.along >= last.along);
                    last = d;
                }
            }
        }
    }

    #[test]
    fn a_hair_falls_as_fast_as_it_should() {
        // Terminal speed of a horizontal hair: weight per length = drag per length; with Cd 9.6 at Re 1.1 by hand:
        // 1300 * pi/4 * d * 9.81 = 1/2 * 1.204 * Cd * u^2.
        let air = Air::default();
        let weight = 1300.0 * std::f64::consts::FRAC_PI_4 * HAIR * HAIR * 9.81;
        let (mut lo, mut hi) = (0.0, 10.0);
        for _ in 0..60 {
            let u = 0.5 * (lo + hi);
            if drag(&air, HAIR, 0.2, u, 0.0).across * u < weight { lo = u } else { hi = u }
        }
        let re = air.density * lo * HAIR / air.viscosity;
        let cd = weight / (0.5 * air.density * HAIR * lo * lo);
        // White's textbook fit 1 + 10 Re^(-2/3), 10 % at this Re.
        assert!((cd / (1.0 + 10.0 * libm::pow(re, -2.0 / 3.0)) - 1.0).abs() < 0.15, "Re {re} Cd {cd} u {lo}");
    }
}
