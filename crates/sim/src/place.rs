//! Order in space.

use crate::Vec3;

/// Places of points on a curve that fills their box and keeps neighbours together (Morton 1966), 20 bits an axis.
pub(crate) fn along_curve(points: impl Iterator<Item = Vec3> + Clone) -> Vec<u64> {
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.clone().fold(start, |(low, high), p| (low.inf(&p), high.sup(&p)));
    let size = (high - low).max();
    let scale = if size > 0.0 { f64::from((1u32 << 20) - 1) / size } else { 0.0 };
    points.map(|p| (0..3).map(|i| spread(((p[i] - low[i]) * scale) as u64) << i).sum()).collect()
}

/// The lower 21 bits, two empty ones between each two.
fn spread(x: u64) -> u64 {
    let x = x & 0x1f_ffff;
    let x = (x | x << 32) & 0x1f_0000_0000_ffff;
    let x = (x | x << 16) & 0x1f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_the_axes_take_turns() {
        assert_eq!(spread(0b1011), 0b1_000_001_001);
        assert_eq!(spread(0x1f_ffff).count_ones(), 21);
        let corner = |k: u32| Vec3::from_fn(|i, _| f64::from(k >> i & 1));
        let place = along_curve((0..8).map(corner));
        assert!(place.is_sorted(), "{place:?}");
        assert_eq!(along_curve([Vec3::zeros(); 2].into_iter()), [0, 0]);
    }
}
