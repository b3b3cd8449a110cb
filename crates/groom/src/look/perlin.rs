//! Gradient noise (K. Perlin, "An image synthesizer", SIGGRAPH 1985, with the quintic fade of his "Improving noise",
//! SIGGRAPH 2002), keyed: slopes are hashes of a key and the lattice point.

/// Root mean square of [`perlin3`] before it is scaled to 1, measured over a million points.
pub(super) const RMS3: f32 = 0.1969;

/// Mixes 32 bits (C. Wellons' "lowbias32").
#[inline(always)]
fn mix(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Key of a noise from the names of what it is for.
pub fn key(seed: u64, id: u64, channel: u64) -> u32 {
    let k = pelage_geom::rng::key(seed, id, channel);
    (k ^ (k >> 32)) as u32
}

#[inline(always)]
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[inline(always)]
fn slope(key: u32, i: i32) -> f32 {
    let hash = mix(key ^ (i as u32).wrapping_mul(0x9e37_79b9));
    // A number from 1 to 2 of which the hash gives the fraction.
    f32::from_bits((hash >> 9) | 0x3f80_0000) * 2.0 - 3.0
}

/// Noise along a line, within -1 to 1; 0 at whole numbers.
#[inline(always)]
pub fn perlin1(key: u32, x: f32) -> f32 {
    let floor = x.floor();
    let (i, t) = (floor as i32, x - floor);
    let (a, b) = (slope(key, i) * t, slope(key, i.wrapping_add(1)) * (t - 1.0));
    2.0 * (a + (b - a) * fade(t))
}

/// Two independent noises in space, mean 0, root mean square 1; 0 at lattice points.
#[inline(always)]
pub fn perlin3(key: u32, p: [f32; 3]) -> [f32; 2] {
    let floor = p.map(f32::floor);
    let cell = floor.map(|x| x as i32 as u32);
    let t: [f32; 3] = std::array::from_fn(|x| p[x] - floor[x]);
    let w = t.map(fade);
    let mut sum = [0.0f32; 2];
    for corner in 0..8u32 {
        let at = [corner & 1, (corner >> 1) & 1, corner >> 2];
        let hash = mix(key
            ^ cell[0].wrapping_add(at[0]).wrapping_mul(0x9e37_79b9)
            ^ mix(cell[1].wrapping_add(at[1]).wrapping_mul(0x85eb_ca77))
            ^ cell[2].wrapping_add(at[2]).wrapping_mul(0xc2b2_ae3d).rotate_left(16));
        let mut weight = 1.0;
        let mut d = [0.0f32; 3];
        for x in 0..3 {
            d[x] = t[x] - at[x] as f32;
            weight *= if at[x] == 1 { w[x] } else { 1.0 - w[x] };
        }
        // Ten bits a component would need two hashes; five are smooth enough, as noise sums eight of them.
        for (n, s) in sum.iter_mut().enumerate() {
            let bits = hash >> (15 * n);
            let g = |x: u32| ((bits >> (5 * x)) & 31) as f32 * (1.0 / 15.5) - 1.0;
            *s += weight * (g(0) * d[0] + g(1) * d[1] + g(2) * d[2]);
        }
    }
    sum.map(|s| s * (1.0 / RMS3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_along_a_line_is_within_bounds_smooth_and_zero_at_whole_numbers() {
        let (mut low, mut high) = (0.0f32, 0.0f32);
        for i in 0..100_000 {
            let x = i as f32 * 0.013 - 600.0;
            let v = perlin1(7, x);
            (low, high) = (low.min(v), high.max(v));
            assert!((perlin1(7, x + 1e-2) - v).abs() < 0.08);
        }
        assert!((-1.0..-0.6).contains(&low) && (0.6..=1.0).contains(&high), "{low} {high}");
        assert!((-50..50).all(|i| perlin1(3, i as f32) == 0.0));
        assert_ne!(perlin1(3, 0.4), perlin1(4, 0.4));
    }

    #[test]
    fn noise_in_space_has_mean_zero_and_root_mean_square_one() {
        let n = 1_000_000;
        let (mut sum, mut square, mut product) = ([0.0f64; 2], [0.0f64; 2], 0.0f64);
        for i in 0..n {
            let r = |k: u64| (pelage_geom::rng::uniform(1, i, k, 0) * 400.0 - 200.0) as f32;
            let v = perlin3(11, [r(0), r(1), r(2)]).map(f64::from);
            (0..2).for_each(|k| (sum[k], square[k]) = (sum[k] + v[k], square[k] + v[k] * v[k]));
            product += v[0] * v[1];
        }
        for k in 0..2 {
            let (mean, rms) = (sum[k] / n as f64, (square[k] / n as f64).sqrt());
            assert!(mean.abs() < 0.01 && (rms - 1.0).abs() < 0.01, "{mean} {rms}");
        }
        assert!((product / n as f64).abs() < 0.01);
    }

    #[test]
    fn noise_in_space_is_smooth() {
        for i in 0..20_000 {
            let r = |k: u64| (pelage_geom::rng::uniform(2, i, k, 0) * 60.0 - 30.0) as f32;
            let p = [r(0), r(1), r(2)];
            let q = [p[0] + 1e-3, p[1], p[2]];
            assert!((perlin3(5, p)[0] - perlin3(5, q)[0]).abs() < 0.03);
        }
    }
}
