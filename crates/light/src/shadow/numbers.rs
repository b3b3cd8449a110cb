//! Numbers of shadow maps, one by one and in lanes: comparisons, and deposits packed into words.

use pelage_geom::registers::{Bits, LANES, Lanes};

/// Range of depth that [`short`] keeps: 2^-24 to just below 2^8.
const LEAST: f32 = 1.0 / 16_777_216.0;
const MOST: f32 = 255.0;

/// Bits of [`LEAST`].
const BASE: u32 = (127 - 24) << 23;

/// The smaller of two numbers, `b` if either is not one: one instruction, which `f32::min` is not.
#[inline(always)]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers, `b` if either is not one.
#[inline(always)]
pub(crate) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Kept in [2^-24, 255] and rounded to 12 significant bits.
#[inline(always)]
pub(crate) fn short<L: Lanes>(v: L) -> L {
    let kept = v.max(L::splat(LEAST)).min(L::splat(MOST));
    ((kept.bits() + L::Bits::splat(0x800)) & L::Bits::splat(!0xfff)).numbers()
}

/// Words of a [`short`] depth and a place, a whole number below 2^16.
#[inline(always)]
pub(crate) fn deposits<L: Lanes>(depth: L, place: L, p: &mut [u32; LANES]) {
    // Sums wrap around.
    let depth = depth.bits() + L::Bits::splat(BASE.wrapping_neg());
    (depth.left::<4>() | place.whole()).store(p);
}

/// The depth in a word of [`deposits`].
#[inline(always)]
pub(crate) fn depth_of(word: u32) -> f32 {
    f32::from_bits(((word & 0xffff_0000) >> 4) + BASE)
}

/// The place in a word of [`deposits`].
#[inline(always)]
pub(crate) fn place_of(word: u32) -> usize {
    (word & 0xffff) as usize
}
