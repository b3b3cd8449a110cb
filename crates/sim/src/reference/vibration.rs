//! Frequencies of beams, chains and pendulums, and how oscillations decay.

use super::{chain::generalised, root};
use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::PI;

/// `beta_n L` of a clamped-free beam, `n` from 1: `cos(b) cosh(b) = -1`; `omega = b^2 sqrt(B / (rho A L^4))`.
pub fn clamped_free(n: usize) -> f64 {
    let middle = (n as f64 - 0.5) * PI;
    root(|b| libm::cos(b) + 1.0 / libm::cosh(b), middle - 0.5, middle + 0.5)
}

/// `beta_n L` of a pinned-free beam's bending modes, `n` from 1: `tan(b) = tanh(b)`.
pub fn pinned_free(n: usize) -> f64 {
    let middle = (n as f64 + 0.25) * PI;
    root(|b| libm::sin(b) - libm::tanh(b) * libm::cos(b), middle - 0.5, middle + 0.5)
}

/// Frequencies of a hanging chain without stiffness, `n` from 1, in units of sqrt(g / L): `J0(2 omega) = 0`.
pub fn hanging_chain(n: usize) -> f64 {
    let middle = (n as f64 - 0.25) * PI;
    root(libm::j0, middle - 0.5, middle + 0.5) / 2.0
}

/// Frequencies of longitudinal (or torsional) vibration of a clamped-free rod, `n` from 1, in units of the wave speed
/// over L: `(2 n - 1) pi / 2`. Wave speed: sqrt(E / rho), or sqrt(C / polar inertia per length).
pub fn clamped_free_waves(n: usize) -> f64 {
    (n as f64 - 0.5) * PI
}

/// Frequencies of a clamped heavy rod hanging down, in units of sqrt(B / (rho A L^4)), ascending (divide by
/// sqrt(Gamma) for units of sqrt(g / L)):
///
/// `w'''' - Gamma ((1 - s) w')' = Omega^2 w`, clamped at 0, free at 1.
///
/// Rayleigh-Ritz: `w''` in `n` shifted Legendre polynomials, so that the bending energy is diagonal; the integrals by
/// Gauss-Legendre quadrature are exact. Negative `gamma`: standing upright; a negative square is returned as its
/// negative root, the rod has buckled.
pub fn hanging_rod(gamma: f64, n: usize) -> Vec<f64> {
    let (points, weights) = gauss_legendre(n + 4);
    // Rows: w and w' at the quadrature points, column k: w'' = P_k(2 s - 1) sqrt(2 k + 1), normalised on [0, 1].
    let scale = |k: usize| ((2 * k + 1) as f64).sqrt();
    // Integrals from 0 of shifted Legendre polynomials are combinations of their neighbours:
    // int P_k = (P_{k+1} - P_{k-1}) / (2 (2k + 1)), for k = 0: (P_1 + P_0) / 2.
    let integral = |c: &[f64]| {
        let mut out = vec![0.0; c.len() + 1];
        for (k, c) in c.iter().enumerate() {
            let f = c / (2.0 * (2 * k + 1) as f64);
            out[k + 1] += f;
            if k == 0 { out[0] += f } else { out[k - 1] -= f }
        }
        out
    };
    let (mut value, mut slope) = (DMatrix::zeros(points.len(), n), DMatrix::zeros(points.len(), n));
    for k in 0..n {
        let mut c = vec![0.0; k + 1];
        c[k] = scale(k);
        let first = integral(&c);
        let second = integral(&first);
        for (q, s) in points.iter().enumerate() {
            slope[(q, k)] = series(&first, 2.0 * s - 1.0);
            value[(q, k)] = series(&second, 2.0 * s - 1.0);
        }
    }
    let by = |f: &dyn Fn(f64) -> f64, m: &DMatrix<f64>| {
        let d = DMatrix::from_fn(points.len(), n, |q, k| m[(q, k)] * weights[q] * f(points[q]));
        m.transpose() * d
    };
    let mass = by(&|_| 1.0, &value);
    let stiffness = DMatrix::identity(n, n) + by(&|s| 1.0 - s, &slope) * gamma;
    generalised(&stiffness, &mass).iter().map(|x| x.abs().sqrt() * x.signum()).collect()
}

/// Value of a Legendre series at `x` in [-1, 1].
fn series(c: &[f64], x: f64) -> f64 {
    let (mut before, mut now, mut sum) = (0.0, 1.0, 0.0);
    for (k, c) in c.iter().enumerate() {
        sum += c * now;
        let k = k as f64;
        (before, now) = (now, ((2.0 * k + 1.0) * x * now - k * before) / (k + 1.0));
    }
    sum
}

/// Points and weights of Gauss-Legendre quadrature on [0, 1] (Golub and Welsch 1969).
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let off = |k: usize| k as f64 / ((4 * k * k - 1) as f64).sqrt();
    let jacobi = DMatrix::from_fn(n, n, |i, j| if i.abs_diff(j) == 1 { off(i.max(j)) } else { 0.0 });
    let e = SymmetricEigen::new(jacobi);
    let weights = (0..n).map(|k| e.eigenvectors[(0, k)] * e.eigenvectors[(0, k)]).collect();
    (e.eigenvalues.iter().map(|x| 0.5 * (x + 1.0)).collect(), weights)
}

/// Frequencies of `n` equal beads on massless links, hanging, the last at the tip, in units of sqrt(g / L), ascending:
/// `omega^2 = (g / l) x` with the roots of the Laguerre polynomial `L_n(x) = 0`, `l = L / n` (D. Bernoulli 1733). Roots
/// as eigenvalues of the Jacobi matrix with diagonal 2 k + 1 and off-diagonal k.
pub fn bead_chain(n: usize) -> Vec<f64> {
    let jacobi = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => (2 * i + 1) as f64,
        1 => i.max(j) as f64,
        _ => 0.0,
    });
    let mut x: Vec<f64> = SymmetricEigen::new(jacobi).eigenvalues.iter().copied().collect();
    x.sort_by(f64::total_cmp);
    x.iter().map(|x| (x * n as f64).sqrt()).collect()
}

/// Period of a pendulum released from rest at `angle`, over that of small swings `2 pi sqrt(l / g)`:
/// `(2 / pi) K(sin^2(angle / 2)) = 1 / AGM(1, cos(angle / 2))`.
pub fn pendulum_period(angle: f64) -> f64 {
    let (mut a, mut b) = (1.0, libm::cos(0.5 * angle));
    for _ in 0..60 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    1.0 / a
}

/// Damping ratio of a mode of angular frequency `omega` with an internal relaxation time (damping = time x stiffness,
/// Kelvin-Voigt) and a drag per mass (1 / s): `zeta = (omega time + drag / omega) / 2`.
pub fn damping_ratio(omega: f64, relaxation_time: f64, drag_over_mass: f64) -> f64 {
    0.5 * (omega * relaxation_time + drag_over_mass / omega)
}

/// Amplitude at time `t` of a mode released from rest at 1: `x'' + 2 zeta omega x' + omega^2 x = 0`, any `zeta`.
pub fn damped(omega: f64, zeta: f64, t: f64) -> f64 {
    let d = omega * (1.0 - zeta * zeta).abs().sqrt();
    let decay = libm::exp(-zeta * omega * t);
    if zeta < 1.0 {
        decay * (libm::cos(d * t) + zeta * omega / d * libm::sin(d * t))
    } else if zeta > 1.0 {
        decay * (libm::cosh(d * t) + zeta * omega / d * libm::sinh(d * t))
    } else {
        decay * (1.0 + omega * t)
    }
}
