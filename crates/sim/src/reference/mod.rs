//! Closed forms and semi-analytic references for the physics of a strand, computed from their equations.
//!
//! Notation: length L, bending stiffness B = E I, twisting stiffness C = G J, weight per length w = rho A g, mass per
//! length rho A; Gamma = w L^3 / B. Unless an argument says otherwise, lengths are in units of L, forces of B / L^2,
//! moments of B / L, and angles in radians. The clamp of the discrete chains: point 0 is held, the hinge there has
//! twice the stiffness of the others, L is the whole polyline.
//!
//! Nothing here uses the simulation. Tests (`tests/closed_form.rs`) hold these against outside computations and against each
//! other; tests and studies of strands measure against them.

pub mod cable;
pub mod chain;
pub mod elastica;
pub mod formula;
pub mod helix;
pub mod spectral;
pub mod vibration;

/// Root of `f` between `a` and `b`, where it has different signs: bisection to the last bit.
pub fn root(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let sign = f(a) > 0.0;
    for _ in 0..200 {
        let m = 0.5 * (a + b);
        if (f(m) > 0.0) == sign { a = m } else { b = m }
    }
    0.5 * (a + b)
}

/// Solves a tridiagonal system in place: `lower[i] x[i-1] + diagonal[i] x[i] + upper[i] x[i+1] = right[i]`; `right`
/// becomes `x`. No pivoting.
pub fn tridiagonal(lower: &[f64], diagonal: &mut [f64], upper: &[f64], right: &mut [f64]) {
    let n = right.len();
    for i in 1..n {
        let m = lower[i] / diagonal[i - 1];
        diagonal[i] -= m * upper[i - 1];
        right[i] -= m * right[i - 1];
    }
    right[n - 1] /= diagonal[n - 1];
    for i in (0..n - 1).rev() {
        right[i] = (right[i] - upper[i] * right[i + 1]) / diagonal[i];
    }
}
