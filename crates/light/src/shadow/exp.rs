//! The exponential function without the platform's.

use wide::{f32x4, i32x4};

/// exp(-x) four at once: 2^k times a polynomial of degree 5 on [-ln 2 / 2, ln 2 / 2]. The relative error is
/// under 3.5e-6; from 87 on the result stays at exp(-87), about 1e-38. x may be negative down to -87.
#[inline]
pub(crate) fn exp_neg(x: f32x4) -> f32x4 {
    let y = -x.fast_min(f32x4::splat(87.0));
    // Adding 1.5 * 2^23 rounds to an integer, which then stands in the low bits.
    const MAGIC: f32 = 12_582_912.0;
    let shifted = y * f32x4::splat(std::f32::consts::LOG2_E) + f32x4::splat(MAGIC);
    let k = shifted - f32x4::splat(MAGIC);
    // ln 2 in two parts, the first with zeros at its end, so that the product is exact.
    let r = (y - k * f32x4::splat(0.693_359_4)) - k * f32x4::splat(-2.121_944_4e-4);
    let mut p = f32x4::splat(1.0 / 120.0);
    for c in [1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p * r + f32x4::splat(c);
    }
    let bits: i32x4 = wide::bytemuck::cast(shifted);
    let power: f32x4 = wide::bytemuck::cast((bits - i32x4::splat(0x4b40_0000 - 127)) << 23);
    p * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_near_the_exponential() {
        let mut worst = 0.0f64;
        for i in 0..87_000 {
            let x = i as f32 * 1e-3 + 3.3e-4;
            let y = exp_neg(f32x4::splat(x)).to_array()[0];
            let truth = libm::exp(-f64::from(x));
            worst = worst.max((f64::from(y) / truth - 1.0).abs());
        }
        assert!(worst < 3.5e-6, "{worst:e}");
        let edge = exp_neg(f32x4::new([0.0, -0.0, 1e30, f32::INFINITY])).to_array();
        assert_eq!(edge[..2], [1.0, 1.0]);
        assert!(edge[2] > 0.0 && edge[2] < 1e-37 && edge[3] == edge[2]);
    }
}
