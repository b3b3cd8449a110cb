//! A heavy cable without stiffness between two points at equal height, 1 apart.

use super::root;

/// A hanging cable.
#[derive(Clone, Copy, Debug)]
pub struct Cable {
    /// Depth of its lowest point.
    pub sag: f64,
    /// Horizontal tension over the weight of the whole cable.
    pub tension: f64,
}

/// Catenary of a `length` over 1: `2 a sinh(1 / (2 a)) = length`, `sag = a (cosh(1 / (2 a)) - 1)`, tension `w a`.
pub fn catenary(length: f64) -> Cable {
    // u = 1 / (2 a): sinh(u) / u = length, increasing.
    let u = root(|u| libm::sinh(u) / u - length, 1e-9, 20.0);
    let a = 0.5 / u;
    let half = libm::sinh(0.5 * u);
    Cable { sag: a * 2.0 * half * half, tension: a / length }
}

/// The same for `n` rigid links with the weight of a link at each inner node: link i carries the vertical force
/// `w l (i - (n - 1) / 2)` and the horizontal tension H; the sum of the links' widths is 1.
pub fn discrete(length: f64, n: usize) -> Cable {
    let l = length / n as f64;
    let vertical = |i: usize| (i as f64 - 0.5 * (n as f64 - 1.0)) / n as f64;
    let width = |h: f64| (0..n).map(|i| l * h / libm::hypot(h, vertical(i))).sum::<f64>();
    let tension = root(|h| width(h) - 1.0, 1e-12, 1e3);
    let sag = (0..n / 2).map(|i| -l * vertical(i) / libm::hypot(tension, vertical(i))).sum();
    Cable { sag, tension }
}
