//! One-line results: buckling, small deflections, friction, and motions of rigid things.

use super::root;
use std::f64::consts::{FRAC_PI_4, PI};

/// Gamma at which a clamped upright heavy rod buckles: `(9 / 4) j^2`, with `j` the first zero of the Bessel function
/// J_{-1/3} (A. G. Greenhill 1881). From the series `sum (-x^2/4)^k / (k! (2/3)_k)`.
pub fn self_buckling() -> f64 {
    let series = |x: f64| {
        let (mut term, mut sum) = (1.0, 1.0);
        for k in 1..60 {
            let k = f64::from(k);
            term *= -0.25 * x * x / (k * (k - 1.0 / 3.0));
            sum += term;
        }
        sum
    };
    let j = root(series, 1.0, 3.0);
    2.25 * j * j
}

/// Euler's load `P L^2 / B`, clamped and free: `pi^2 / 4`.
pub fn euler_clamped_free() -> f64 {
    PI * PI / 4.0
}

/// Euler's load, clamped and pinned: `k^2` with `tan k = k`.
pub fn euler_clamped_pinned() -> f64 {
    let k = root(|k| libm::sin(k) - k * libm::cos(k), 4.0, 4.7);
    k * k
}

/// Euler's load, clamped at both ends: `4 pi^2`.
pub fn euler_clamped_clamped() -> f64 {
    4.0 * PI * PI
}

/// End moment `M L / B` about its axis at which a straight rod, pinned at both ends, buckles under a tension `T L^2 / B`
/// (negative: compression): `M^2 / 4 = pi^2 + T` (Greenhill 1883). For an infinite rod `M^2 = 4 B T`.
pub fn twist_buckling(tension: f64) -> f64 {
    2.0 * (PI * PI + tension).sqrt()
}

/// Total twist at which a welded ring of a straight isotropic rod leaves its plane: `2 pi sqrt(n^2 - 1) B / C`, least
/// for n = 2 (J. H. Michell 1889).
pub fn ring_twist(n: u32, c_over_b: f64) -> f64 {
    2.0 * PI * f64::from(n * n - 1).sqrt() / c_over_b
}

/// Tip of a straight rod of length 1 bent by an end moment `M L / B` = its turned angle: an arc; along and across.
pub fn bent_by_moment(angle: f64) -> [f64; 2] {
    if angle == 0.0 { [1.0, 0.0] } else { [libm::sin(angle) / angle, (1.0 - libm::cos(angle)) / angle] }
}

/// Angle by which an end moment turns the tip of a straight rod: bending `M L / B`, twisting `M L / C`.
pub fn end_moment_angle(moment: f64, length: f64, stiffness: f64) -> f64 {
    moment * length / stiffness
}

/// Small deflection of a cantilever's tip: under its tip load `P L^3 / (3 B)`, a uniform load `q L^4 / (8 B)`, an end
/// moment `M L^2 / (2 B)`.
pub fn small_deflection(tip_load: f64, uniform_load: f64, end_moment: f64, length: f64, bending: f64) -> f64 {
    let l = length;
    (tip_load * l / 3.0 + uniform_load * l * l / 8.0 + end_moment / 2.0) * l * l / bending
}

/// Small displacement of the tip of a quarter circle of radius R clamped at one end, per `P R^3 / B`, by Castigliano's
/// theorem.
#[derive(Clone, Copy, Debug)]
pub struct QuarterCircle {
    /// Load in the plane, across the tangent at the clamp: displacement along it, `3 pi / 4 - 2`. (It is radial
    /// at the clamp, tangential at the tip.)
    pub tangential_at_tip: f64,
    /// Load in the plane, along the tangent at the clamp (radial at the tip): displacement along it, `pi / 4`.
    pub radial_at_tip: f64,
    /// Displacement across either of those loads due to the other one's direction, `1 / 2` in size.
    pub coupling: f64,
    /// Load across the plane: displacement along it, `pi / 4 + (3 pi / 4 - 2) B / C`.
    pub across_plane: f64,
}

/// See [`QuarterCircle`].
pub fn quarter_circle(c_over_b: f64) -> QuarterCircle {
    let tangential = 3.0 * FRAC_PI_4 - 2.0;
    QuarterCircle {
        tangential_at_tip: tangential,
        radial_at_tip: FRAC_PI_4,
        coupling: 0.5,
        across_plane: FRAC_PI_4 + tangential / c_over_b,
    }
}

/// How much longer a hanging elastic rod of stretching stiffness E A and weight per length w gets: `w L^2 / (2 E A)`.
pub fn stretch_under_weight(weight: f64, length: f64, stretching: f64) -> f64 {
    weight * length * length / (2.0 * stretching)
}

/// Ratio of tensions at slip around a cylinder: `exp(mu phi)` (Euler, Eytelwein).
pub fn capstan(friction: f64, angle: f64) -> f64 {
    libm::exp(friction * angle)
}

/// Length that hangs on the far side of a drum when a string of even weight w, `near` of which hangs on the other, just slips
/// over half a turn: T' = mu (T + w R sin a) + w R cos a, of which w R ((1 - mu^2) sin a - 2 mu cos a) / (1 + mu^2) is one
/// solution and [`capstan`] gives the others.
pub fn slips_over_drum(near: f64, radius: f64, friction: f64) -> f64 {
    let own = 2.0 * friction * radius / (1.0 + friction * friction);
    capstan(friction, PI) * (near + own) + own
}

/// Acceleration down an incline over g: `sin a - mu cos a` from rest, 0 while `tan a <= mu`.
pub fn incline(friction: f64, angle: f64) -> f64 {
    (libm::sin(angle) - friction * libm::cos(angle)).max(0.0)
}

/// Distance slid at constant deceleration `mu g` from a speed, until it stops: `v^2 / (2 mu g)`.
pub fn sliding_distance(speed: f64, friction: f64, gravity: f64) -> f64 {
    speed * speed / (2.0 * friction * gravity)
}

/// Position of a free body's centre after `t`: `x + v t + g t^2 / 2`.
pub fn free_flight(x: f64, v: f64, g: f64, t: f64) -> f64 {
    x + v * t + 0.5 * g * t * t
}

/// Speed after `t` of something that falls from rest against a drag proportional to speed, `rate` = drag over mass:
/// `(g / rate)(1 - exp(-rate t))`.
pub fn falling_speed(g: f64, rate: f64, t: f64) -> f64 {
    -g / rate * libm::expm1(-rate * t)
}
