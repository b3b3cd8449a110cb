//! The look: what displaces finished hairs after they have been interpolated or simulated.
//!
//! Clumps (production-pipeline paper §4.2, §5), curls (sparse-guide-hairs paper §2.4), waves (streamlines paper §4), noise
//! and wind. Every operator works on hairs of one layer with P points each, hair after hair, root first, scene units, in
//! place; none moves a root. What it does to a hair follows from the hair's name and its place on the rest skin, so the
//! same hair gets the same offsets on every frame; frames along the hair (module [`axes`]) carry them with the motion.

pub mod axes;
pub mod clump;
pub mod curl;
pub mod gather;
mod lanes;
pub mod member;
pub mod noise;
pub mod perlin;
pub mod refine;
pub mod region;
pub mod vary;
pub mod wave;
pub mod wind;

pub(crate) type V3 = nalgebra::Vector3<f32>;

/// Hairs that one task handles. Results do not depend on it.
pub(crate) const CHUNK: usize = 512;

/// A parameter of an operator for every hair: `value * factor[h] + shift[h]`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Param<'a> {
    /// Value where nothing varies.
    pub value: f32,
    /// Factor of each hair; empty for 1.
    pub factor: &'a [f32],
    /// Added for each hair; empty for 0.
    pub shift: &'a [f32],
}

impl Param<'_> {
    /// The same for all hairs.
    pub const fn constant(value: f32) -> Self {
        Param { value, factor: &[], shift: &[] }
    }

    /// Value of hair `h`.
    pub fn of(&self, h: usize) -> f32 {
        self.value * self.factor.get(h).unwrap_or(&1.0) + self.shift.get(h).unwrap_or(&0.0)
    }
}

/// Lays a hair out again from its root: the directions of `hair`, the segment lengths `length`. A segment without a
/// direction keeps the one before it.
pub(crate) fn relay(hair: &mut [[f32; 3]], length: &[f32]) {
    let mut last = V3::zeros();
    let mut at = V3::from(hair[0]);
    let mut before = at;
    for (k, &l) in length.iter().enumerate() {
        let next = V3::from(hair[k + 1]);
        let d = next - before;
        let n = d.norm();
        if n > 0.0 {
            last = d / n;
        }
        before = next;
        at += last * l;
        hair[k + 1] = at.into();
    }
}

/// Lengths of a hair's segments.
pub(crate) fn lengths(hair: &[[f32; 3]], out: &mut Vec<f32>) {
    out.clear();
    out.extend(hair.windows(2).map(|w| (V3::from(w[1]) - V3::from(w[0])).norm()));
}

/// Weights of the at most four of `n` equally spaced stations that say the value at `x` (0 at the first, n - 1 at the
/// last): Catmull-Rom between the inner stations, with the end slopes of the outer segments' parabola (for two stations, a
/// straight line).
fn stations_at(n: usize, x: f64) -> [(usize, f32); 4] {
    let last = n - 1;
    let i = (x as usize).min(last - 1);
    let first = i.saturating_sub(1).min(n.saturating_sub(4));
    let t = x - i as f64;
    let (t2, t3) = (t * t, t * t * t);
    let mut w = [0.0f64; 4];
    w[i - first] += 2.0 * t3 - 3.0 * t2 + 1.0;
    w[i + 1 - first] += 3.0 * t2 - 2.0 * t3;
    for (j, h) in [(i, t3 - 2.0 * t2 + t), (i + 1, t3 - t2)] {
        let slope: &[(usize, f64)] = match (j, last) {
            (_, 1) => &[(0, -1.0), (1, 1.0)],
            (0, _) => &[(0, -1.5), (1, 2.0), (2, -0.5)],
            (j, last) if j == last => &[(last, 1.5), (last - 1, -2.0), (last - 2, 0.5)],
            _ => &[(j - 1, -0.5), (j + 1, 0.5)],
        };
        slope.iter().for_each(|(s, m)| w[s - first] += h * m);
    }
    std::array::from_fn(|k| ((first + k).min(last), w[k] as f32))
}

/// Weight of each of `stations` equally spaced stations from root to tip at the points of a hair: P rows.
pub fn station_weights(stations: usize, points: usize) -> Vec<Vec<f32>> {
    assert!(stations >= 2 && points >= 2, "a curve needs two stations, a hair two points");
    let row = |k: usize| {
        let mut row = vec![0.0; stations];
        let x = (stations - 1) as f64 * k as f64 / (points - 1) as f64;
        stations_at(stations, x).iter().for_each(|(s, w)| row[*s] += w);
        row
    };
    (0..points).map(row).collect()
}

/// Sum of stations' values by weights.
pub(crate) fn at_station(weights: &[f32], values: &[f32]) -> f32 {
    weights.iter().zip(values).map(|(w, v)| w * v).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stations_are_met_and_lines_stay_lines() {
        for n in 2..6 {
            let points = 4 * (n - 1) + 1;
            let w = station_weights(n, points);
            let values: Vec<f32> = (0..n).map(|i| 3.0 - 2.0 * i as f32).collect();
            for (k, row) in w.iter().enumerate() {
                assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-6);
                let line = 3.0 - 0.5 * k as f32;
                assert!((at_station(row, &values) - line).abs() < 1e-5, "{n} {k}");
            }
            for i in 0..n {
                assert_eq!(w[4 * i][i], 1.0);
            }
        }
    }

    #[test]
    fn laid_out_again_a_hair_has_the_lengths_asked_for() {
        let mut hair = [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [2.0, 4.0, 3.0], [2.0, 4.0, 3.0]];
        relay(&mut hair, &[0.5, 2.0, 1.0]);
        let mut found = Vec::new();
        lengths(&hair, &mut found);
        // The first segment has no direction to go in; the last keeps the one before it.
        assert!(found[0] == 0.0 && (found[1] - 2.0).abs() < 1e-6 && (found[2] - 1.0).abs() < 1e-6, "{found:?}");
    }
}
