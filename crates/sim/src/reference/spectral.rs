//! The continuous heavy rod in motion, by a spectral method: a second reference for the dynamics of a strand, that
//! shares nothing with the chain of links.

use super::vibration::gauss_legendre;
use nalgebra::{DMatrix, DVector};

/// An inextensible rod of length 1, mass 1, weight 1 and bending stiffness 1 / Gamma, clamped horizontally at the
/// origin; time in units of sqrt(L / g). Its angle below the horizontal is `theta = sum q_k phi_k(s)`, with `phi_k' =
/// sqrt(2 k + 1) P_k(2 s - 1)` and `phi_k(0) = 0`, so that the bending energy is `q . q / (2 Gamma)`.
///
/// Virtual work: `int (r_tt + g) . dr/dq_k ds + q_k / Gamma = 0`, where `r = int_0^s (cos theta, -sin theta)` and
/// `r_tt = sum q_k'' dr/dq_k - int_0^s theta_t^2 (cos theta, -sin theta)`. Integrals by Gauss-Legendre quadrature.
pub struct Rod {
    gamma: f64,
    weight: DVector<f64>,
    /// Values at the quadrature points become integrals from 0 to them.
    integral: DMatrix<f64>,
    basis: DMatrix<f64>,
    /// Coefficients of the angle.
    pub q: DVector<f64>,
    /// Their rates.
    pub v: DVector<f64>,
}

/// Values of shifted Legendre polynomials 0..n at `s`, normalised on [0, 1], and their integrals from 0.
fn polynomials(n: usize, s: f64) -> (Vec<f64>, Vec<f64>) {
    let x = 2.0 * s - 1.0;
    let mut p = vec![1.0, x];
    for k in 1..=n {
        let f = k as f64;
        p.push(((2.0 * f + 1.0) * x * p[k] - f * p[k - 1]) / (f + 1.0));
    }
    let scale = |k: usize| ((2 * k + 1) as f64).sqrt();
    let integral = |k: usize| if k == 0 { s } else { (p[k + 1] - p[k - 1]) / (2.0 * (2 * k + 1) as f64) };
    ((0..n).map(|k| p[k] * scale(k)).collect(), (0..n).map(|k| integral(k) * scale(k)).collect())
}

impl Rod {
    /// Straight and at rest, with `modes` coefficients. Eight are good to 5e-5 for Gamma = 10 up to t = 3.
    pub fn straight(gamma: f64, modes: usize) -> Rod {
        let n = 4 * modes;
        let (points, weights) = gauss_legendre(n);
        let all: Vec<(Vec<f64>, Vec<f64>)> = points.iter().map(|s| polynomials(n, *s)).collect();
        // f = sum_k <f, P_k> P_k, the products by quadrature.
        let integral = DMatrix::from_fn(n, n, |i, j| (0..n).map(|k| all[i].1[k] * all[j].0[k] * weights[j]).sum());
        Rod {
            gamma,
            integral,
            basis: DMatrix::from_fn(n, modes, |i, k| all[i].1[k]),
            weight: DVector::from_vec(weights),
            q: DVector::zeros(modes),
            v: DVector::zeros(modes),
        }
    }

    /// Where the tip is: to the right, up.
    pub fn tip(&self) -> [f64; 2] {
        let theta = &self.basis * &self.q;
        [self.weight.dot(&theta.map(libm::cos)), -self.weight.dot(&theta.map(libm::sin))]
    }

    fn acceleration(&self, q: &DVector<f64>, v: &DVector<f64>) -> DVector<f64> {
        let theta = &self.basis * q;
        let rate = &self.basis * v;
        let (sin, cos) = (theta.map(libm::sin), theta.map(libm::cos));
        let times = |f: &DVector<f64>| DMatrix::from_fn(f.len(), q.len(), |i, k| -f[i] * self.basis[(i, k)]);
        let (jx, jy) = (&self.integral * times(&sin), &self.integral * times(&cos));
        let square = rate.component_mul(&rate);
        let ax = &self.integral * -cos.component_mul(&square);
        let ay = &self.integral * sin.component_mul(&square);
        let weigh = |m: &DMatrix<f64>| DMatrix::from_fn(m.nrows(), m.ncols(), |i, k| m[(i, k)] * self.weight[i]);
        let (wx, wy) = (weigh(&jx), weigh(&jy));
        let mass = wx.tr_mul(&jx) + wy.tr_mul(&jy);
        let force = -wx.tr_mul(&ax) - wy.tr_mul(&ay.add_scalar(1.0)) - q / self.gamma;
        mass.cholesky().expect("positive definite").solve(&force)
    }

    /// Moves on by `time` in `steps` steps of the classical Runge-Kutta method.
    pub fn advance(&mut self, time: f64, steps: usize) {
        let dt = time / steps as f64;
        for _ in 0..steps {
            let (q, v) = (&self.q, &self.v);
            let a1 = self.acceleration(q, v);
            let v2 = v + &a1 * (0.5 * dt);
            let a2 = self.acceleration(&(q + v * (0.5 * dt)), &v2);
            let v3 = v + &a2 * (0.5 * dt);
            let a3 = self.acceleration(&(q + &v2 * (0.5 * dt)), &v3);
            let v4 = v + &a3 * dt;
            let a4 = self.acceleration(&(q + &v3 * dt), &v4);
            self.q = q + (v + (&v2 + &v3) * 2.0 + &v4) * (dt / 6.0);
            self.v = v + (a1 + (a2 + a3) * 2.0 + a4) * (dt / 6.0);
        }
    }
}
