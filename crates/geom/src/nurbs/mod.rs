//! Skin as NURBS patches: values, derivatives, and one closed mesh of many patches ([`mesh`]).
//!
//! Bruderlin (course notes 2003, "a hair grooming and simulation pipeline") grows hair on rectangular NURBS patches.
//! Here patches become a triangle mesh whose texture coordinates are their parameters, so that a patch is a chart.
//! Formulas are those of Piegl, Tiller, "The NURBS Book", chapters 2 and 4.

mod join;
mod tessellate;
#[cfg(test)]
mod tests;

pub use tessellate::{Tessellation, mesh};

use crate::Vec3;

/// Highest degree.
pub const DEGREE: usize = 5;

/// Values of the basis functions that are not zero at a place.
type Basis = [f64; DEGREE + 1];

/// A rational tensor-product patch. Its parameters u and v run from 0 to 1 over the domain of its knots.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    degree: [usize; 2],
    count: [usize; 2],
    knots: [Vec<f64>; 2],
    control: Vec<[f64; 3]>,
    weight: Vec<f64>,
}

impl Patch {
    /// A patch of the given degrees (1 to [`DEGREE`]) and knots along u and v. `control` (scene units) and `weight` (more
    /// than 0) have one entry a control point, u running faster; there are as many along a direction as knots less the
    /// degree less 1. Knots that do not begin and end with degree + 1 equal ones are allowed: the patch then covers
    /// their middle, from knot `degree` on. Says what is wrong.
    pub fn new(
        degree: [usize; 2],
        knots: [Vec<f64>; 2],
        control: Vec<[f64; 3]>,
        weight: Vec<f64>,
    ) -> Result<Patch, String> {
        let mut count = [0; 2];
        for (i, name) in ["u", "v"].into_iter().enumerate() {
            let (p, k) = (degree[i], &knots[i]);
            if !(1..=DEGREE).contains(&p) {
                return Err(format!("the degree along {name} is {p}, not 1 to {DEGREE}"));
            }
            if k.len() < 2 * p + 2 {
                return Err(format!("degree {p} along {name} takes {} knots or more, not {}", 2 * p + 2, k.len()));
            }
            count[i] = k.len() - p - 1;
            if !k.iter().all(|x| x.is_finite()) || !k.windows(2).all(|w| w[0] <= w[1]) {
                return Err(format!("the knots along {name} do not ascend"));
            }
            let (first, last) = (k[p], k[count[i]]);
            if first >= last {
                return Err(format!("the knots along {name} have no length"));
            }
            if k.windows(p + 1).any(|w| w[0] == w[p] && w[0] > first && w[0] < last) {
                return Err(format!("{} equal knots along {name} tear the patch", p + 1));
            }
        }
        let n = count[0] * count[1];
        if control.len() != n || weight.len() != n {
            let (c, w) = (control.len(), weight.len());
            return Err(format!("{} x {} control points have {c} positions and {w} weights", count[0], count[1]));
        }
        if !control.iter().flatten().all(|x| x.is_finite()) {
            return Err("a control point is not finite".into());
        }
        if !weight.iter().all(|w| *w > 0.0 && w.is_finite()) {
            return Err("a weight is not more than 0".into());
        }
        Ok(Patch { degree, count, knots, control, weight })
    }

    /// The patch with u and v exchanged: the same points, its other side outside.
    pub fn turned_over(&self) -> Patch {
        let [nu, nv] = self.count;
        let from = |i: usize| i % nv * nu + i / nv;
        let swap = |[a, b]: [usize; 2]| [b, a];
        Patch {
            degree: swap(self.degree),
            count: swap(self.count),
            knots: [self.knots[1].clone(), self.knots[0].clone()],
            control: (0..nu * nv).map(|i| self.control[from(i)]).collect(),
            weight: (0..nu * nv).map(|i| self.weight[from(i)]).collect(),
        }
    }

    /// Point at (u, v), each clamped to 0 to 1.
    pub fn point(&self, uv: [f64; 2]) -> Vec3 {
        self.at(uv).0
    }

    /// Point at (u, v), each clamped to 0 to 1, and its derivatives by u and by v. The outside is where their cross
    /// product points. At a knot as often as the degree, the derivative is that of the side of higher parameters.
    pub fn at(&self, uv: [f64; 2]) -> (Vec3, [Vec3; 2]) {
        let [(i, nu, du), (j, nv, dv)] = [0, 1].map(|k| basis(&self.knots[k], self.degree[k], uv[k]));
        let mut sum = [Vec3::zeros(); 3];
        let mut weight = [0.0; 3];
        for b in 0..=self.degree[1] {
            for a in 0..=self.degree[0] {
                let at = (j + b) * self.count[0] + i + a;
                let (w, p) = (self.weight[at], Vec3::from(self.control[at]));
                for (k, f) in [nu[a] * nv[b], du[a] * nv[b], nu[a] * dv[b]].into_iter().enumerate() {
                    sum[k] += p * (w * f);
                    weight[k] += w * f;
                }
            }
        }
        let p = sum[0] / weight[0];
        (p, [1, 2].map(|k| (sum[k] - p * weight[k]) / weight[0]))
    }
}

/// The first control point that counts at `t`, clamped to 0 to 1 over the domain of the knots; the values there of its
/// basis function and the next ones, and their derivatives by `t` (Cox, de Boor).
fn basis(knots: &[f64], degree: usize, t: f64) -> (usize, Basis, Basis) {
    let n = knots.len() - degree - 1;
    let (first, last) = (knots[degree], knots[n]);
    let x = first + (last - first) * t.clamp(0.0, 1.0);
    // The span that holds x: the last one that begins at or before it and has a length.
    let span = knots[..n].partition_point(|k| *k <= x).max(degree + 1) - 1;
    let span = if knots[span] < last { span } else { knots[..n].partition_point(|k| *k < last) - 1 };
    let (mut value, mut lower) = ([0.0; DEGREE + 1], [0.0; DEGREE + 1]);
    value[0] = 1.0;
    for p in 1..=degree {
        lower = value;
        let mut carry = 0.0;
        for r in 0..p {
            let (right, left) = (knots[span + r + 1], knots[span + 1 + r - p]);
            let share = lower[r] / (right - left);
            value[r] = carry + (right - x) * share;
            carry = (x - left) * share;
        }
        value[p] = carry;
    }
    let mut slope = [0.0; DEGREE + 1];
    let mut carry = 0.0;
    for r in 0..degree {
        let share = lower[r] * degree as f64 / (knots[span + r + 1] - knots[span + 1 + r - degree]) * (last - first);
        slope[r] = carry - share;
        carry = share;
    }
    slope[degree] = carry;
    (span - degree, value, slope)
}
