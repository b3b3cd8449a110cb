//! A chain of rigid massless links with the rod's mass at its nodes, in the plane, in motion: the reference for the
//! dynamics of a strand, and its small oscillations.

use super::tridiagonal;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// A rod of length 1, mass 1, weight 1 and bending stiffness 1 / Gamma (time in units of sqrt(L / g)), clamped at the
/// origin, cut into `n` links. Masses 1/n at inner nodes, half of that at the tip. Hinges of stiffness n / Gamma, twice
/// that at the clamp.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Gamma = w L^3 / B.
    pub gamma: f64,
    /// Direction of the clamp, radians below the horizontal.
    pub clamp: f64,
    /// Angles of the links below the horizontal.
    pub angle: Vec<f64>,
    /// Their rates.
    pub rate: Vec<f64>,
}

impl Chain {
    /// A straight rod at rest along its clamp, its natural shape.
    pub fn straight(gamma: f64, clamp: f64, n: usize) -> Chain {
        Chain { gamma, clamp, angle: vec![clamp; n], rate: vec![0.0; n] }
    }

    /// Where the tip is: to the right, up.
    pub fn tip(&self) -> [f64; 2] {
        let l = 1.0 / self.angle.len() as f64;
        self.angle.iter().fold([0.0, 0.0], |p, a| [p[0] + l * libm::cos(*a), p[1] - l * libm::sin(*a)])
    }

    /// Kinetic, elastic and potential energy in units of the weight times L; 0 for the straight horizontal rod at rest.
    pub fn energy(&self) -> f64 {
        let n = self.angle.len();
        let l = 1.0 / n as f64;
        let (mut p, mut v, mut sum) = ([0.0; 2], [0.0; 2], 0.0);
        for i in 0..n {
            let (sin, cos) = libm::sincos(self.angle[i]);
            p = [p[0] + l * cos, p[1] - l * sin];
            v = [v[0] - l * sin * self.rate[i], v[1] - l * cos * self.rate[i]];
            let mass = if i + 1 < n { l } else { 0.5 * l };
            sum += mass * (0.5 * (v[0] * v[0] + v[1] * v[1]) + p[1]);
            let before = if i == 0 { self.clamp } else { self.angle[i - 1] };
            let k = if i == 0 { 2.0 } else { 1.0 } / (l * self.gamma);
            sum += 0.5 * k * (self.angle[i] - before) * (self.angle[i] - before);
        }
        sum
    }

    /// Angular accelerations of the links.
    ///
    /// Node accelerations are `m_k a_k = f_k + T_{k+1} e_{k+1} - T_k e_k`, with hinge moments as pairs of forces across
    /// the links; that each link keeps its length, `e . (a_k - a_{k-1}) = -l rate^2`, is a tridiagonal system for the
    /// tensions T. The same motion as Lagrange's equations in the angles, in O(n).
    pub fn acceleration(&self, angle: &[f64], rate: &[f64]) -> Vec<f64> {
        let n = angle.len();
        let l = 1.0 / n as f64;
        let k = |i: usize| if i == 0 { 2.0 / (l * self.gamma) } else { 1.0 / (l * self.gamma) };
        let moment: Vec<f64> = (0..=n)
            .map(|i| match i {
                0 => k(0) * (angle[0] - self.clamp),
                i if i == n => 0.0,
                i => k(i) * (angle[i] - angle[i - 1]),
            })
            .collect();
        // Along and across each link; node i + 1 ends link i. Angles turn clockwise: across is d(along)/d(angle).
        let along: Vec<[f64; 2]> = angle.iter().map(|a| [libm::cos(*a), -libm::sin(*a)]).collect();
        let across: Vec<[f64; 2]> = angle.iter().map(|a| [-libm::sin(*a), -libm::cos(*a)]).collect();
        let inverse = |i: usize| if i + 1 < n { 1.0 / l } else { 2.0 / l };
        let mut a: Vec<[f64; 2]> = (0..n).map(|i| [0.0, -1.0 / inverse(i)]).collect();
        for i in 0..n {
            let turn = (moment[i + 1] - moment[i]) / l;
            for c in 0..2 {
                a[i][c] += turn * across[i][c];
                if i > 0 {
                    a[i - 1][c] -= turn * across[i][c];
                }
            }
        }
        for (i, f) in a.iter_mut().enumerate() {
            *f = f.map(|f| f * inverse(i));
        }
        let dot = |u: [f64; 2], v: [f64; 2]| u[0] * v[0] + u[1] * v[1];
        let difference = |a: &[[f64; 2]], i: usize| {
            let before = if i == 0 { [0.0; 2] } else { a[i - 1] };
            [a[i][0] - before[0], a[i][1] - before[1]]
        };
        let (mut low, mut dia, mut up, mut tension) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            dia[i] = inverse(i) + if i > 0 { inverse(i - 1) } else { 0.0 };
            if i > 0 {
                low[i] = -inverse(i - 1) * dot(along[i], along[i - 1]);
            }
            if i + 1 < n {
                up[i] = -inverse(i) * dot(along[i], along[i + 1]);
            }
            tension[i] = dot(along[i], difference(&a, i)) + l * rate[i] * rate[i];
        }
        tridiagonal(&low, &mut dia, &up, &mut tension);
        for i in 0..n {
            for c in 0..2 {
                let next = if i + 1 < n { tension[i + 1] * along[i + 1][c] } else { 0.0 };
                a[i][c] += inverse(i) * (next - tension[i] * along[i][c]);
            }
        }
        (0..n).map(|i| dot(across[i], difference(&a, i)) / l).collect()
    }

    /// One step of the classical Runge-Kutta method. Stable up to `dt = 2.8 / omega` with the chain's highest frequency
    /// `omega`, at most `4 n^2 / sqrt(Gamma)` when bending rules.
    pub fn step(&mut self, dt: f64) {
        let (q, v) = (self.angle.clone(), self.rate.clone());
        let mix = |x: &[f64], d: &[f64], f: f64| -> Vec<f64> { x.iter().zip(d).map(|(x, d)| x + f * d).collect() };
        let a1 = self.acceleration(&q, &v);
        let v2 = mix(&v, &a1, 0.5 * dt);
        let a2 = self.acceleration(&mix(&q, &v, 0.5 * dt), &v2);
        let v3 = mix(&v, &a2, 0.5 * dt);
        let a3 = self.acceleration(&mix(&q, &v2, 0.5 * dt), &v3);
        let v4 = mix(&v, &a3, dt);
        let a4 = self.acceleration(&mix(&q, &v3, dt), &v4);
        for i in 0..q.len() {
            self.angle[i] += dt / 6.0 * (v[i] + 2.0 * (v2[i] + v3[i]) + v4[i]);
            self.rate[i] += dt / 6.0 * (a1[i] + 2.0 * (a2[i] + a3[i]) + a4[i]);
        }
    }

    /// One step of SDIRK2 (R. Alexander 1977), with Newton's method to rounding: what an L-stable method with the implicit
    /// coefficient of the simulation's errs where nothing stretches.
    pub fn implicit_step(&mut self, dt: f64) {
        let n = self.angle.len();
        let h = (1.0 - 0.5f64.sqrt()) * dt;
        let (mut q0, mut v0) = (self.angle.clone(), self.rate.clone());
        for second in [false, true] {
            let mut v = v0.clone();
            let place = |v: &[f64]| -> Vec<f64> { (0..n).map(|i| q0[i] + h * v[i]).collect() };
            for _ in 0..12 {
                let f = |v: &[f64]| -> Vec<f64> {
                    let a = self.acceleration(&place(v), v);
                    (0..n).map(|i| v[i] - v0[i] - h * a[i]).collect()
                };
                let here = f(&v);
                let mut jacobian = DMatrix::zeros(n, n);
                for k in 0..n {
                    let mut moved = v.clone();
                    moved[k] += 1e-6;
                    for (i, there) in f(&moved).into_iter().enumerate() {
                        jacobian[(i, k)] = (there - here[i]) / 1e-6;
                    }
                }
                let by = jacobian.lu().solve(&DVector::from_vec(here)).expect("regular");
                v.iter_mut().zip(by.iter()).for_each(|(v, by)| *v -= by);
                if by.amax() < 1e-9 {
                    break;
                }
            }
            let (q, a): (Vec<f64>, Vec<f64>) = (place(&v), (0..n).map(|i| (v[i] - v0[i]) / h).collect());
            if second {
                (self.angle, self.rate) = (q, v);
            } else {
                for i in 0..n {
                    q0[i] = self.angle[i] + (dt - h) * v[i];
                    v0[i] = self.rate[i] + (dt - h) * a[i];
                }
            }
        }
    }

    /// Moves on by `time` in equal steps no longer than `longest`.
    pub fn advance(&mut self, time: f64, longest: f64) {
        let steps = (time / longest).ceil() as usize;
        for _ in 0..steps {
            self.step(time / steps as f64);
        }
    }
}

/// Angular frequencies of the chain's small oscillations about hanging straight down, in units of sqrt(B / (rho A L^4)),
/// ascending. Negative `gamma`: standing upright. `M_ij = m(max(i, j)) / n^2` with `m(i)` the mass beyond link i;
/// stiffness from hinges and weight.
pub fn frequencies(gamma: f64, n: usize) -> Vec<f64> {
    let (mass, stiffness) = small_oscillations(gamma, n);
    generalised(&stiffness, &mass).iter().map(|x| x.max(0.0).sqrt()).collect()
}

/// What to weigh the links' angles with to get the amplitude of one of those oscillations alone, in their order.
pub fn projections(gamma: f64, n: usize) -> Vec<Vec<f64>> {
    let (mass, stiffness) = small_oscillations(gamma, n);
    let l = mass.cholesky().expect("positive definite").l();
    let half = l.solve_lower_triangular(&stiffness).expect("regular");
    let whole = l.solve_lower_triangular(&half.transpose()).expect("regular");
    let e = SymmetricEigen::new((&whole + whole.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| e.eigenvalues[*a].total_cmp(&e.eigenvalues[*b]));
    order.iter().map(|k| (&l * e.eigenvectors.column(*k)).iter().copied().collect()).collect()
}

/// Mass and stiffness by the links' angles.
fn small_oscillations(gamma: f64, n: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let l = 1.0 / n as f64;
    let beyond = |i: usize| (n as f64 - i as f64 - 0.5) * l;
    let mass = DMatrix::from_fn(n, n, |i, j| l * l * beyond(i.max(j)));
    let stiffness = DMatrix::from_fn(n, n, |i, j| {
        let hinge = |i: usize| if i == 0 { 2.0 / l } else { 1.0 / l };
        match i.abs_diff(j) {
            0 => hinge(i) + if i + 1 < n { hinge(i + 1) } else { 0.0 } + gamma * beyond(i) * l,
            1 => -hinge(i.max(j)),
            _ => 0.0,
        }
    });
    (mass, stiffness)
}

/// Eigenvalues of `a x = lambda b x`, ascending; `b` positive definite.
pub fn generalised(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Vec<f64> {
    let l = b.clone().cholesky().expect("positive definite").l();
    let half = l.solve_lower_triangular(a).expect("regular");
    let whole = l.solve_lower_triangular(&half.transpose()).expect("regular");
    let mut values: Vec<f64> =
        SymmetricEigen::new((&whole + whole.transpose()) * 0.5).eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}
