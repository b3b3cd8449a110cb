//! Features that vary from root to tip: width profiles and colour ramps, given at stations and read at the points of
//! every hair.
//!
//! Between stations values run linearly. A Catmull-Rom curve through them would overshoot: a profile that ends in 0
//! would go below it, a ramp would leave the colours that it is made of.

use pelage_geom::Offsets;

/// Fraction of the way along a hair of `points` points (two or more) at which point `k` counts: 0 at the root, 1 at
/// the tip, in equal steps whatever the distances.
fn fraction(k: usize, points: usize) -> f32 {
    k as f32 / (points - 1).max(1) as f32
}

/// Station before fraction `t` of `stations` (two or more) at equal distances, and how far it is to the next, 0 to 1.
fn place(stations: usize, t: f32) -> (usize, f32) {
    let at = t * (stations - 1) as f32;
    let before = (at as usize).min(stations - 2);
    (before, at - before as f32)
}

/// \[V\] diameters of hairs from those of their roots (one a hair, scene units) and factors at two or more stations at
/// equal distances from root to tip.
pub fn point_widths(root: &[f32], offsets: &Offsets, profile: &[f32]) -> Vec<f32> {
    spread(root, offsets, |w, t| w * value(profile, t))
}

/// Value at fraction `t` of the way along a hair from two or more stations.
fn value(profile: &[f32], t: f32) -> f32 {
    let (i, f) = place(profile.len(), t);
    profile[i] + (profile[i + 1] - profile[i]) * f
}

/// Values at the points of hairs of `points` points from two or more stations; none from none.
pub(crate) fn at_points(profile: &[f32], points: usize) -> Vec<f32> {
    if profile.is_empty() { Vec::new() } else { (0..points).map(|k| value(profile, fraction(k, points))).collect() }
}

/// \[V\] diameters and \[C\] opacities of hairs with factors on both for each hair (a third number is not read); opacities stay within 0 and 1.
pub fn scaled(offsets: &Offsets, width: &[f32], opacity: &[f32], factor: &[[f32; 3]]) -> (Vec<f32>, Vec<f32>) {
    let mut wide = Vec::with_capacity(width.len());
    for (h, f) in factor.iter().enumerate() {
        wide.extend(width[offsets.range(h)].iter().map(|w| w * f[0]));
    }
    (wide, opacity.iter().zip(factor).map(|(o, f)| (o * f[1]).clamp(0.0, 1.0)).collect())
}

/// \[V\] linear colours of hairs from one a hair and factors for red, green and blue at two or more stations at equal
/// distances from root to tip.
pub fn point_colors(color: &[[f32; 3]], offsets: &Offsets, ramp: &[[f32; 3]]) -> Vec<[f32; 3]> {
    spread(color, offsets, |c, t| {
        let (i, f) = place(ramp.len(), t);
        std::array::from_fn(|k| c[k] * (ramp[i][k] + (ramp[i + 1][k] - ramp[i][k]) * f))
    })
}

fn spread<T: Copy>(values: &[T], offsets: &Offsets, at: impl Fn(T, f32) -> T) -> Vec<T> {
    let mut out = Vec::with_capacity(offsets.total());
    for (&v, n) in values.iter().zip(offsets.counts()) {
        out.extend((0..n).map(|k| at(v, fraction(k, n))));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_stations_are_a_straight_taper() {
        let offsets = Offsets::from_counts([5, 2, 3]);
        let got = point_widths(&[2.0, 1.0, 4.0], &offsets, &[1.0, 0.5]);
        assert_eq!(got, [2.0, 1.75, 1.5, 1.25, 1.0, 1.0, 0.5, 4.0, 3.0, 2.0]);
    }

    #[test]
    fn points_on_stations_have_their_values_and_others_lie_between_the_next_two() {
        let profile = [1.0, 1.25, 0.75, 0.25];
        let offsets = Offsets::from_counts([4, 7]);
        let got = point_widths(&[2.0, 2.0], &offsets, &profile);
        assert_eq!(got[..4], [2.0, 2.5, 1.5, 0.5]);
        let wanted = [2.0, 2.25, 2.5, 2.0, 1.5, 1.0, 0.5];
        assert!(got[4..].iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{got:?}");
        // Against every pair of stations in turn.
        for n in 2..40 {
            let (ramp, offsets) = ([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.5, 0.5, 2.0]], Offsets::uniform(1, n));
            for (k, c) in point_colors(&[[0.5, 1.0, 2.0]], &offsets, &ramp).into_iter().enumerate() {
                let at = 2.0 * k as f64 / (n - 1) as f64;
                let (a, b, f) = if at < 1.0 { (ramp[0], ramp[1], at) } else { (ramp[1], ramp[2], at - 1.0) };
                for (x, scale) in [0.5, 1.0, 2.0].into_iter().enumerate() {
                    let wanted = scale * (f64::from(a[x]) * (1.0 - f) + f64::from(b[x]) * f);
                    assert!((f64::from(c[x]) - wanted).abs() < 1e-6, "point {k} of {n}: {c:?}");
                }
            }
        }
    }

    #[test]
    fn nothing_leaves_the_range_of_its_stations() {
        let offsets = Offsets::uniform(1, 101);
        let widths = point_widths(&[1.0], &offsets, &[1.0, 0.0, 0.0, 1.0]);
        assert!(widths.iter().all(|w| (0.0..=1.0).contains(w)));
    }
}
