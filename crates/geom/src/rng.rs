//! Random numbers as a pure function of names: no state, no order of use.
//!
//! Squares (B. Widynski, "Squares: A Fast Counter-Based RNG", arXiv 2004.06278, the five-round 64-bit variant), keyed
//! by a mixed (seed, strand id, channel) and counted by step.

/// Five rounds of squaring: 64 random bits for (counter, key). The key should have well mixed digits, see [`key`].
pub fn squares64(counter: u64, key: u64) -> u64 {
    let mut x = counter.wrapping_mul(key);
    let y = x;
    let z = y.wrapping_add(key);
    for w in [y, z, y] {
        x = x.wrapping_mul(x).wrapping_add(w).rotate_left(32);
    }
    let t = x.wrapping_mul(x).wrapping_add(z);
    x = t.rotate_left(32);
    t ^ (x.wrapping_mul(x).wrapping_add(y) >> 32)
}

/// Mixes three names into one key (finaliser of MurmurHash3 by position, then made odd).
pub fn key(seed: u64, id: u64, channel: u64) -> u64 {
    let mut k = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    for v in [id, channel] {
        k = mix(k ^ v.wrapping_mul(0xd6e8_feb8_6659_fd93).wrapping_add(0x2545_f491_4f6c_dd1d));
    }
    k | 1
}

/// Finaliser of MurmurHash3: a bijection that spreads every input bit.
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    x ^ (x >> 33)
}

/// Uniform in [0, 1) with 53 random bits, for (seed, strand id, channel, step).
pub fn uniform(seed: u64, id: u64, channel: u64, step: u64) -> f64 {
    (squares64(step, key(seed, id, channel)) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Channel number of a name: distinct uses of randomness get distinct names (64-bit FNV-1a).
pub const fn channel(name: &str) -> u64 {
    let bytes = name.as_bytes();
    let mut h = 0xcbf2_9ce4_8422_2325u64;
    let mut i = 0;
    while i < bytes.len() {
        h = (h ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_fixed_for_ever() {
        // Stored results: a change here changes every groom.
        assert_eq!(channel(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(channel("a"), 0xaf63_dc4c_8601_ec8c);
    }

    #[test]
    fn uniform_has_mean_and_variance_of_the_unit_interval() {
        let n = 100_000;
        let v: Vec<f64> = (0..n).map(|i| uniform(1, i, channel("test"), 0)).collect();
        let mean = v.iter().sum::<f64>() / n as f64;
        let var = v.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 0.004 && (var - 1.0 / 12.0).abs() < 0.002, "{mean} {var}");
        assert!(v.iter().all(|x| (0.0..1.0).contains(x)));
    }

    #[test]
    fn names_are_independent() {
        let n = 100_000;
        let corr = |f: &dyn Fn(u64) -> (f64, f64)| {
            (0..n)
                .map(|i| {
                    let (a, b) = f(i);
                    (a - 0.5) * (b - 0.5)
                })
                .sum::<f64>()
                / n as f64
                * 12.0
        };
        assert!(corr(&|i| (uniform(1, i, 5, 0), uniform(1, i + 1, 5, 0))).abs() < 0.015);
        assert!(corr(&|i| (uniform(1, i, 5, 0), uniform(1, i, 6, 0))).abs() < 0.015);
        assert!(corr(&|i| (uniform(1, i, 5, 0), uniform(1, i, 5, 1))).abs() < 0.015);
        assert!(corr(&|i| (uniform(1, i, 5, 0), uniform(2, i, 5, 0))).abs() < 0.015);
    }
}
