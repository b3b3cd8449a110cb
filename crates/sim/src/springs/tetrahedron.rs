//! Altitudes of a tetrahedron (section 3.1).
//!
//! With `D` six times the signed volume and `A_j` its gradient in vertex `j` (twice the area vector of the opposite
//! face), the vector `u x v` of each of the seven altitudes is a sum of some of `A_1, A_2, A_3`: a face's own, the sum of
//! two for a pair of opposite edges. So the seven are the seven ways to choose from three. The altitude is
//! `h = D / |u x v|`, its direction `n = (u x v) / |u x v|`, its gradient `w_j n` with the weights
//! `w_j = (u x v) . A_j / |u x v|^2`: barycentric, or the parameters on the two lines.

use crate::Vec3;

/// Candidates for the altitude: bit `j - 1` of `candidate + 1` chooses `A_j`.
pub const CANDIDATES: usize = 7;

/// Added to squared lengths of area vectors, m^4, so that four equal points divide nothing by zero.
pub const TINY: f64 = 1e-90;

/// Which of `A_1, A_2, A_3` make up a candidate.
pub fn chosen(candidate: usize) -> [f64; 3] {
    std::array::from_fn(|j| f64::from(((candidate + 1) >> j & 1) as u8))
}

/// Six times the volume of a tetrahedron, and its gradients.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// Six times the signed volume.
    pub value: f64,
    /// Gradients in the vertices.
    pub gradient: [Vec3; 4],
}

/// Volume of the tetrahedron `x`, vertex 0 first.
pub fn volume(x: [Vec3; 4]) -> Volume {
    let e: [Vec3; 3] = [x[1] - x[0], x[2] - x[0], x[3] - x[0]];
    let a = [e[1].cross(&e[2]), e[2].cross(&e[0]), e[0].cross(&e[1])];
    Volume { value: e[0].dot(&a[0]), gradient: [-(a[0] + a[1] + a[2]), a[0], a[1], a[2]] }
}

impl Volume {
    /// `u x v` of a candidate.
    pub fn area(&self, candidate: usize) -> Vec3 {
        let c = chosen(candidate);
        self.gradient[1] * c[0] + self.gradient[2] * c[1] + self.gradient[3] * c[2]
    }

    /// `|u x v|^2` of all candidates.
    pub fn areas_squared(&self) -> [f64; CANDIDATES] {
        std::array::from_fn(|c| self.area(c).norm_squared())
    }

    /// Altitude of a candidate with the sign of the volume, its direction, and the weights of the vertices.
    pub fn altitude(&self, candidate: usize) -> (f64, Vec3, [f64; 4]) {
        let area = self.area(candidate);
        let inverse = 1.0 / (area.norm_squared() + TINY);
        let weight = |j: usize| area.dot(&self.gradient[j]) * inverse;
        let w = [weight(1), weight(2), weight(3)];
        let scale = inverse.sqrt();
        (self.value * scale, area * scale, [-(w[0] + w[1] + w[2]), w[0], w[1], w[2]])
    }
}

/// How a candidate's direction turns: it changes by `-q_j (n . dx_j)` as vertex `j` moves, so the altitude's second
/// derivative in vertices `i` and `j` is `-(w_i q_j n^T + w_j n q_i^T + h (q_i . q_j) n n^T)`.
pub fn turns(x: [Vec3; 4], candidate: usize) -> [Vec3; 4] {
    let e: [Vec3; 3] = [x[1] - x[0], x[2] - x[0], x[3] - x[0]];
    let c = chosen(candidate);
    let area = volume(x).area(candidate);
    let inverse = 1.0 / (area.norm_squared() + TINY);
    // d(u x v) = sum de_j x m_j with m_j in the plane of u and v.
    let turn = |j: usize, k: usize| area.cross(&(e[k] * c[j] - e[j] * c[k])) * inverse;
    let q = [turn(1, 2), turn(2, 0), turn(0, 1)];
    [-(q[0] + q[1] + q[2]), q[0], q[1], q[2]]
}

/// Largest `u x v`, the first unless a later one is larger by 2 %: a straight hair's largest two are equal, and rounding
/// must not choose between them.
pub fn largest(areas_squared: &[f64; CANDIDATES]) -> usize {
    (1..CANDIDATES).fold(0, |best, c| if areas_squared[c] > 1.04 * areas_squared[best] { c } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;

    fn random(seed: u64) -> [Vec3; 4] {
        std::array::from_fn(|i| Vec3::from_fn(|c, _| rng::uniform(seed, i as u64, 1, c as u64)))
    }

    #[test]
    fn least_altitude_has_weights_within_its_ends() {
        for seed in 0..500 {
            let v = volume(random(seed));
            let areas = v.areas_squared();
            let best = (0..CANDIDATES).max_by(|&a, &b| areas[a].total_cmp(&areas[b])).unwrap();
            let (h, n, w) = v.altitude(best);
            assert!(w.iter().sum::<f64>().abs() < 1e-12);
            assert!(w.iter().all(|w| w.abs() < 1.0 + 1e-9), "{w:?}");
            assert!((n.norm() - 1.0).abs() < 1e-12);
            for c in 0..CANDIDATES {
                assert!(h.abs() <= v.altitude(c).0.abs() + 1e-12);
            }
            // The paper's proof: all virtual nodes are inside a face, or inside both edges.
            let positive: f64 = w.iter().filter(|w| **w > 0.0).sum();
            assert!((positive - 1.0).abs() < 1e-9, "{w:?}");
        }
    }

    #[test]
    fn candidates_are_the_faces_and_the_pairs_of_opposite_edges() {
        let x = random(9);
        let v = volume(x);
        let mut found = v.areas_squared().map(f64::sqrt);
        let face = |a: usize, b: usize, c: usize| (x[b] - x[a]).cross(&(x[c] - x[a])).norm();
        let pair = |a: usize, b: usize, c: usize, d: usize| (x[b] - x[a]).cross(&(x[d] - x[c])).norm();
        let mut expected = [
            face(1, 2, 3),
            face(0, 2, 3),
            face(0, 1, 3),
            face(0, 1, 2),
            pair(0, 1, 2, 3),
            pair(0, 2, 1, 3),
            pair(0, 3, 1, 2),
        ];
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        for (f, e) in found.iter().zip(&expected) {
            assert!((f - e).abs() < 1e-14);
        }
    }

    #[test]
    fn altitude_gradient_is_the_weighted_direction() {
        for seed in 0..20 {
            let x = random(seed);
            let v = volume(x);
            for c in 0..CANDIDATES {
                let (_, n, w) = v.altitude(c);
                for j in 0..4 {
                    for axis in 0..3 {
                        let moved = |d: f64| {
                            let mut y = x;
                            y[j][axis] += d;
                            volume(y).altitude(c).0
                        };
                        let d = 1e-6;
                        let difference = (moved(d) - moved(-d)) / (2.0 * d);
                        assert!((difference - w[j] * n[axis]).abs() < 1e-6, "{seed} {c} {j} {axis}");
                    }
                }
            }
        }
    }
}
