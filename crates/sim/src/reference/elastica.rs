//! Equilibria of a planar rod clamped at one end: its own weight, a load at the tip, natural curvature, any clamp.

use super::tridiagonal;

/// What bends a rod clamped at s = 0 and free at s = 1. Angles are measured downward from the horizontal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Load {
    /// Gamma = w L^3 / B: its weight, downward.
    pub gamma: f64,
    /// P L^2 / B: a dead load at the tip, downward.
    pub tip: f64,
    /// Natural curvature times L, positive if it curls downward; the same along the rod.
    pub curvature: f64,
    /// Angle of the clamp below the horizontal.
    pub clamp: f64,
}

/// An equilibrium.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Horizontal distance of the tip from the clamp.
    pub x: f64,
    /// How far the tip is below the clamp.
    pub drop: f64,
    /// Angle below the horizontal: continuous, at n + 1 equidistant points; discrete, of the n links.
    pub angle: Vec<f64>,
    /// Curvature at the clamp times L (continuous), or the root hinge's moment times L / B (discrete, plus natural
    /// curvature).
    pub root_curvature: f64,
}

impl Shape {
    /// Drop over horizontal distance.
    pub fn height_over_width(&self) -> f64 {
        self.drop / self.x
    }
}

/// Factors on the load that lead from the natural shape to the whole load, so that Newton's method stays on a branch.
fn ramp(load: &Load) -> impl Iterator<Item = f64> {
    let largest = load.gamma.abs().max(load.tip.abs()).max(1.0);
    let steps = (libm::log(10.0 * largest) / libm::log(1.25)) as i32 + 1;
    (0..=steps).rev().map(|k| libm::pow(1.25, -f64::from(k)))
}

/// `theta'' = -(Gamma (1 - s) + P) cos theta`, `theta(0) = clamp`, `theta'(1) = curvature`.
///
/// Numerov's three-point scheme on `n` intervals (n even; fourth order), Newton's method along a ramp of loads. The free
/// end uses a point beyond it, `theta(1 + h) - theta(1 - h) = 2 h theta' + h^3/3 theta''' + h^5/60 theta'''''` with the
/// derivatives taken from the equation.
pub fn continuous(load: &Load, n: usize) -> Shape {
    let h = 1.0 / n as f64;
    let s = |i: usize| i as f64 * h;
    let mut theta: Vec<f64> = (0..=n).map(|i| load.clamp + load.curvature * s(i)).collect();
    for factor in ramp(load) {
        let (gamma, tip) = (load.gamma * factor, load.tip * factor);
        let g = |i: usize| gamma * (1.0 - s(i)) + tip;
        for _ in 0..60 {
            let beyond = theta[n - 1] + past_the_end(theta[n], gamma, tip, load.curvature, h);
            let at = |i: usize| if i <= n { theta[i] } else { beyond };
            let (mut low, mut dia, mut up, mut right) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
            for i in 1..=n {
                let f = |j: usize| -g(j) * libm::cos(at(j));
                let df = |j: usize| g(j) * libm::sin(at(j));
                let c = h * h / 12.0;
                right[i - 1] = -(at(i + 1) - 2.0 * at(i) + at(i - 1) - c * (f(i + 1) + 10.0 * f(i) + f(i - 1)));
                dia[i - 1] = -2.0 - 10.0 * c * df(i);
                low[i - 1] = 1.0 - c * df(i - 1);
                up[i - 1] = 1.0 - c * df(i + 1);
            }
            low[n - 1] += up[n - 1];
            tridiagonal(&low, &mut dia, &up, &mut right);
            let largest = right.iter().fold(0.0f64, |m, d| m.max(d.abs()));
            let damp = (0.5 / largest).min(1.0);
            for (t, d) in theta[1..].iter_mut().zip(&right) {
                *t += damp * d;
            }
            if largest < 1e-14 {
                break;
            }
        }
    }
    let simpson = |f: &dyn Fn(usize) -> f64| {
        let inner: f64 = (1..n).map(|i| f(i) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
        (f(0) + inner + f(n)) * h / 3.0
    };
    let x = simpson(&|i| libm::cos(theta[i]));
    let drop = simpson(&|i| libm::sin(theta[i]));
    let bend = simpson(&|i| (load.gamma * (1.0 - s(i)) + load.tip) * libm::cos(theta[i]));
    Shape { x, drop, root_curvature: bend + load.curvature, angle: theta }
}

/// `theta(1 + h) - theta(1 - h)`, see [`continuous`].
fn past_the_end(theta: f64, gamma: f64, tip: f64, curvature: f64, h: f64) -> f64 {
    let (sin, cos) = libm::sincos(theta);
    let (d1, d2) = (curvature, -tip * cos);
    let d3 = gamma * cos + tip * sin * d1;
    let d5 = -3.0 * gamma * (cos * d1 * d1 + sin * d2) + tip * (sin * (d3 - d1 * d1 * d1) + 3.0 * cos * d1 * d2);
    2.0 * h * d1 + h * h * h / 3.0 * d3 + h * h * h * h * h / 60.0 * d5
}

/// A chain of `n` rigid links with the rod's weight at its nodes (half at the tip) and hinges of stiffness `B n / L`,
/// twice that at the clamp:
///
/// `k_i (phi_i - phi_{i-1} - c_i) - k_{i+1} (phi_{i+1} - phi_i - c_{i+1}) = (Gamma (n - i - 1/2)/n + P) cos(phi_i) / n`.
///
/// Natural hinge angles `c_i` are curvature / n, half of it at the clamp.
pub fn discrete(load: &Load, n: usize) -> Shape {
    let l = 1.0 / n as f64;
    let stiffness = |i: usize| if i == 0 { 2.0 / l } else { 1.0 / l };
    let natural = |i: usize| if i == 0 { 0.5 * load.curvature * l } else { load.curvature * l };
    let mut phi: Vec<f64> = (0..n).map(|i| load.clamp + load.curvature * (i as f64 + 0.5) * l).collect();
    let moment = |phi: &[f64], i: usize| {
        let before = if i == 0 { load.clamp } else { phi[i - 1] };
        stiffness(i) * (phi[i] - before - natural(i))
    };
    for factor in ramp(load) {
        for _ in 0..60 {
            let (mut low, mut dia, mut up, mut right) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
            for i in 0..n {
                let weight = factor * (load.gamma * (n as f64 - i as f64 - 0.5) * l + load.tip) * l;
                let next = if i + 1 < n { moment(&phi, i + 1) } else { 0.0 };
                let k = if i + 1 < n { stiffness(i + 1) } else { 0.0 };
                right[i] = weight * libm::cos(phi[i]) - moment(&phi, i) + next;
                dia[i] = stiffness(i) + k + weight * libm::sin(phi[i]);
                low[i] = -stiffness(i);
                up[i] = -k;
            }
            tridiagonal(&low, &mut dia, &up, &mut right);
            let largest = right.iter().fold(0.0f64, |m, d| m.max(d.abs()));
            let damp = (0.5 / largest).min(1.0);
            for (t, d) in phi.iter_mut().zip(&right) {
                *t += damp * d;
            }
            if largest < 1e-14 {
                break;
            }
        }
    }
    Shape {
        x: phi.iter().map(|p| libm::cos(*p)).sum::<f64>() * l,
        drop: phi.iter().map(|p| libm::sin(*p)).sum::<f64>() * l,
        root_curvature: moment(&phi, 0) + load.curvature,
        angle: phi,
    }
}
