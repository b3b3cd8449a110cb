//! More points on a hair: a smooth curve through those it has.

use super::{CHUNK, V3, lengths, relay, stations_at};
use rayon::prelude::*;

/// Hairs of `from` points as hairs of `to` points: points of a Catmull-Rom curve through theirs, laid out with equal
/// segments of the same total length.
pub fn refine(from: usize, to: usize, position: &[[f32; 3]]) -> Vec<[f32; 3]> {
    assert!(from >= 2 && to >= 2, "a hair has at least two points");
    let row = |k: usize| stations_at(from, (from - 1) as f64 * k as f64 / (to - 1) as f64);
    let rows: Vec<[(usize, f32); 4]> = (0..to).map(row).collect();
    let mut out = vec![[0.0; 3]; position.len() / from * to];
    out.par_chunks_mut(CHUNK * to).zip(position.par_chunks(CHUNK * from)).for_each(|(out, position)| {
        let mut length = Vec::new();
        for (hair, old) in out.chunks_exact_mut(to).zip(position.chunks_exact(from)) {
            let root = V3::from(old[0]);
            for (p, row) in hair.iter_mut().zip(&rows) {
                let mut sum = V3::zeros();
                for (s, w) in row {
                    sum += (V3::from(old[*s]) - root) * *w;
                }
                *p = (root + sum).into();
            }
            lengths(old, &mut length);
            let step = length.iter().sum::<f32>() / (to - 1) as f32;
            length.clear();
            length.resize(to - 1, step);
            hair[0] = old[0];
            relay(hair, &length);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refined_arc_stays_an_arc_of_its_length() {
        let arc = |n: usize| -> Vec<[f32; 3]> {
            let at = |k: usize| 1.5 * k as f32 / (n - 1) as f32;
            (0..n).map(|k| [libm::sinf(at(k)), 1.0 - libm::cosf(at(k)), 0.5]).collect()
        };
        let (coarse, fine) = (arc(12), refine(12, 50, &arc(12)));
        let mut length = Vec::new();
        lengths(&coarse, &mut length);
        let total: f32 = length.iter().sum();
        lengths(&fine, &mut length);
        assert!((length.iter().sum::<f32>() - total).abs() < 1e-5 && fine[0] == coarse[0]);
        assert!(length.iter().all(|l| (l - total / 49.0).abs() < 1e-5));
        for p in &fine {
            let r = (p[0] * p[0] + (p[1] - 1.0) * (p[1] - 1.0)).sqrt();
            assert!((r - 1.0).abs() < 2e-3, "{p:?}");
        }
    }
}
