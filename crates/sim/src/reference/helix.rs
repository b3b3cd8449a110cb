//! A uniformly wound helix pulled along its axis, ends free to turn.

use super::root;

/// A helix under load. Lengths in units of 1 / (natural curvature).
#[derive(Clone, Copy, Debug)]
pub struct Helix {
    /// Curvature.
    pub curvature: f64,
    /// Torsion.
    pub torsion: f64,
    /// Sine of the angle between its tangent and the plane across the axis: axial length over arc length.
    pub sin_pitch: f64,
    /// Radius of its cylinder.
    pub radius: f64,
    /// Axial length over that without load.
    pub extension: f64,
}

/// A Kirchhoff rod of natural curvature 1 and torsion `torsion`, stiffness ratio `c_over_b` = C / B, pulled along its
/// axis by `force` in units of B (natural curvature)^2, without axial moment (A. E. H. Love, Theory of Elasticity,
/// sections 270 and 271).
///
/// With pitch angle a, `m_b = B (kappa - kappa0)`, `m_t = C (tau - tau0)`, `r = cos^2 a / kappa`:
/// `m_t sin a + m_b cos a = 0` and `F r = m_t cos a - m_b sin a`. The first gives `omega = hypot(kappa, tau)` for an
/// angle, the second the force, which grows with the angle.
pub fn helix(c_over_b: f64, torsion: f64, force: f64) -> Helix {
    let natural = libm::atan(torsion);
    let at = |a: f64| {
        let (s, c) = libm::sincos(a);
        let omega = (c_over_b * torsion * s + c) / (c_over_b * s * s + c * c);
        let (bend, twist) = (omega * c - 1.0, c_over_b * (omega * s - torsion));
        (omega, (twist * c - bend * s) * omega / c)
    };
    let a = if force == 0.0 { natural } else { root(|a| at(a).1 - force, natural, std::f64::consts::FRAC_PI_2 - 1e-9) };
    let (s, c) = libm::sincos(a);
    let omega = at(a).0;
    Helix {
        curvature: omega * c,
        torsion: omega * s,
        sin_pitch: s,
        radius: c / omega,
        extension: s / libm::sin(natural),
    }
}
