//! Hair cut shorter where it casts shadows (production pipeline §4.4): light goes round in white fur in ways that are not
//! computed, and without it dense fur has dark streaks.

use crate::preview::diameter;
use pelage_geom::{Offsets, curve};

/// Diameters at the points of hairs that cast shadow with a part of their length only: the part
/// `share * c / (1 + c)` is missing at the tip, where `c` = hairs per square scene unit x length x mean diameter is how
/// often hair covers the skin. So thin and short fur keeps its shadow, and long and dense fur loses up to `share` of it.
/// Diameters fall to 0 within one segment, by which the area is right to half a segment.
pub fn shortened(offsets: &Offsets, position: &[[f32; 3]], width: &[f32], density: &[f32], share: f64) -> Vec<f32> {
    let mut out: Vec<f32> = (0..position.len()).map(|i| diameter(width, i)).collect();
    for (s, &density) in density.iter().enumerate().take(offsets.len()) {
        let range = offsets.range(s);
        let (points, wide) = (&position[range.clone()], &mut out[range]);
        let length = curve::length(points);
        let mean = wide.iter().map(|w| f64::from(*w)).sum::<f64>() / wide.len().max(1) as f64;
        let cover = f64::from(density) * length * mean;
        let part = share * cover / (1.0 + cover);
        if !(part > 0.0 && part.is_finite()) {
            continue;
        }
        let (mut left, mut k) = (length * (1.0 - part), 1);
        while k < points.len() {
            let step = curve::length(&points[k - 1..=k]);
            if step > left {
                break;
            }
            (left, k) = (left - step, k + 1);
        }
        if k < points.len() {
            let kept = left / curve::length(&points[k - 1..=k]);
            wide[k] *= (2.0 * kept - 1.0).max(0.0) as f32;
            wide[k + 1..].fill(0.0);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hair_is_cut_by_how_often_it_covers_the_skin() {
        let (n, hairs) = (41usize, 3usize);
        let offsets = Offsets::uniform(hairs, n);
        let position: Vec<[f32; 3]> = (0..hairs * n).map(|i| [0.0, (i % n) as f32 * 0.1, 0.0]).collect();
        let width = vec![0.01; hairs * n];
        // Covers 0, 1 and 4 times: 0, 0.3 and 0.48 of the length are missing.
        let density = [0.0, 25.0, 100.0];
        let cut = shortened(&offsets, &position, &width, &density, 0.6);
        for (s, missing) in [0.0, 0.3, 0.48].into_iter().enumerate() {
            let w = &cut[offsets.range(s)];
            let area: f32 = w.windows(2).map(|w| 0.05 * (w[0] + w[1])).sum();
            assert!((area - 0.04 * (1.0 - missing)).abs() < 0.0006, "{area} of {missing}");
            assert!(w.windows(2).all(|w| w[0] >= w[1]));
        }
        assert_eq!(shortened(&offsets, &position, &width, &density, 0.0), width);
        assert_eq!(shortened(&offsets, &position, &width, &[f32::NAN; 3], 0.5), width);
    }
}
