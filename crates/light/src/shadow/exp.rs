//! The exponential function without the platform's.

use pelage_geom::registers::{Bits, Lanes};

/// exp(-x) in every lane: 2^(k + r) for the whole number k nearest to -x / ln 2, 2^r from a polynomial of degree 4 on
/// [-1/2, 1/2]. The error is under 5e-6 for any x >= 0, relative to the result under 1.2e-5; from 87 on the result stays
/// at exp(-87), about 1e-38. x may be negative down to -87.
#[inline(always)]
pub(crate) fn exp_neg<L: Lanes>(x: L) -> L {
    let y = x.min(L::splat(87.0)) * L::splat(-std::f32::consts::LOG2_E);
    // Adding 1.5 * 2^23 rounds to an integer, which then stands in the low bits.
    const MAGIC: f32 = 12_582_912.0;
    let shifted = y + L::splat(MAGIC);
    let r = y - (shifted - L::splat(MAGIC));
    let mut p = L::splat(POWER[4]);
    for c in [POWER[3], POWER[2], POWER[1], POWER[0]] {
        p = p * r + L::splat(c);
    }
    // k into the exponent; what stands above it in the sum is shifted out.
    (p.bits() + shifted.bits().left::<23>()).numbers()
}

/// Coefficients of 2^r by rising degree, of the least relative error on [-1/2, 1/2] with 2^0 exact.
const POWER: [f32; 5] = [1.0, 0.693_124_2, 0.240_240_98, 0.055_906_48, 0.009_582_875];

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::registers::Plain;

    #[test]
    fn is_near_the_exponential() {
        let of = |x: f32| {
            let mut y = [0.0; 16];
            exp_neg(Plain::splat(x)).write(&mut y);
            y[0]
        };
        let (mut worst, mut relative) = (0.0f64, 0.0f64);
        for i in 0..87_000 {
            let x = i as f32 * 1e-3 + 3.3e-4;
            let y = of(x);
            let truth = libm::exp(-f64::from(x));
            worst = worst.max((f64::from(y) - truth).abs());
            relative = relative.max((f64::from(y) / truth - 1.0).abs());
        }
        assert!(worst < 5e-6 && relative < 1.2e-5, "{worst:e} {relative:e}");
        let edge = [0.0, -0.0, 1e30, f32::INFINITY].map(of);
        assert_eq!(edge[..2], [1.0, 1.0]);
        assert!(edge[2] > 0.0 && edge[2] < 1e-37 && edge[3] == edge[2]);
    }
}
