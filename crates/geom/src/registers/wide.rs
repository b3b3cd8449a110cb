//! Lanes in registers of 512 and of 256 bits.

use super::{Add, BitAnd, BitOr, BitXor, Bits, Div, Kernel, LANES, Lanes, Mul, Pack, Sub};
use std::arch::x86_64::*;

/// One 512-bit register. Only made inside [`super::run`], after the processor was asked.
#[derive(Clone, Copy)]
pub struct W512(__m512);

/// [`W512`] of whole numbers.
#[derive(Clone, Copy)]
pub struct B512(__m512i);

/// Two 256-bit registers. Only made inside [`super::run`], after the processor was asked.
#[derive(Clone, Copy)]
pub struct W256(__m256, __m256);

/// [`W256`] of whole numbers.
#[derive(Clone, Copy)]
pub struct B256(__m256i, __m256i);

macro_rules! op {
    ($whole:ident, $halves:ident, $trait:ident, $name:ident, $wide:ident, $half:ident) => {
        impl $trait for $whole {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                unsafe { $whole($wide(self.0, o.0)) }
            }
        }
        impl $trait for $halves {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                unsafe { $halves($half(self.0, o.0), $half(self.1, o.1)) }
            }
        }
    };
}
op!(W512, W256, Add, add, _mm512_add_ps, _mm256_add_ps);
op!(W512, W256, Sub, sub, _mm512_sub_ps, _mm256_sub_ps);
op!(W512, W256, Mul, mul, _mm512_mul_ps, _mm256_mul_ps);
op!(W512, W256, Div, div, _mm512_div_ps, _mm256_div_ps);
op!(B512, B256, Add, add, _mm512_add_epi32, _mm256_add_epi32);
op!(B512, B256, Mul, mul, _mm512_mullo_epi32, _mm256_mullo_epi32);
op!(B512, B256, BitXor, bitxor, _mm512_xor_si512, _mm256_xor_si256);
op!(B512, B256, BitAnd, bitand, _mm512_and_si512, _mm256_and_si256);
op!(B512, B256, BitOr, bitor, _mm512_or_si512, _mm256_or_si256);

/// Index of the last of `rows`, at which picking stops.
#[inline(always)]
fn last(rows: &[Pack]) -> u32 {
    // A greater number of rows would not fit into the index.
    assert!(!rows.is_empty() && rows.len() < 1 << 26, "rows to pick from");
    rows.len() as u32 - 1
}

/// Rows as columns: interleaving the first half of the rows with the second takes the highest digit of a row's index
/// (in binary) to the end of the column's, and that of the column's to the end of the row's; four times, and they have
/// changed places.
macro_rules! turned {
    ($rows:ident) => {{
        let mut rows = $rows;
        for _ in 0..LANES.ilog2() {
            let from = rows;
            for i in 0..LANES / 2 {
                let [even, odd] = from[i].interleaved(from[i + LANES / 2]);
                rows[2 * i] = even;
                rows[2 * i + 1] = odd;
            }
        }
        rows
    }};
}

impl W512 {
    /// Numbers of two rows in turns, as two rows.
    #[inline(always)]
    fn interleaved(self, o: Self) -> [Self; 2] {
        unsafe {
            let low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let high = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
            let of = |index| W512(_mm512_permutex2var_ps(self.0, index, o.0));
            [of(low), of(high)]
        }
    }
}

impl W256 {
    /// Numbers of two rows in turns, as two rows.
    #[inline(always)]
    fn interleaved(self, o: Self) -> [Self; 2] {
        unsafe {
            let (a, b) = (_mm256_unpacklo_ps(self.0, o.0), _mm256_unpackhi_ps(self.0, o.0));
            let (c, d) = (_mm256_unpacklo_ps(self.1, o.1), _mm256_unpackhi_ps(self.1, o.1));
            let low = W256(_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b));
            [low, W256(_mm256_permute2f128_ps::<0x20>(c, d), _mm256_permute2f128_ps::<0x31>(c, d))]
        }
    }
}

const LANE: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

impl Lanes for W512 {
    type Bits = B512;
    #[inline(always)]
    fn splat(v: f32) -> Self {
        unsafe { W512(_mm512_set1_ps(v)) }
    }
    #[inline(always)]
    fn load(p: &Pack) -> Self {
        unsafe { W512(_mm512_load_ps(p.0.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, p: &mut Pack) {
        unsafe { _mm512_store_ps(p.0.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn read(p: &[f32; LANES]) -> Self {
        unsafe { W512(_mm512_loadu_ps(p.as_ptr())) }
    }
    #[inline(always)]
    fn write(self, p: &mut [f32; LANES]) {
        unsafe { _mm512_storeu_ps(p.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn turned(rows: [Self; LANES]) -> [Self; LANES] {
        turned!(rows)
    }
    #[inline(always)]
    fn pick(rows: &[Pack], k: B512) -> Self {
        // SAFETY: indices stop at the last row.
        unsafe {
            let k = _mm512_min_epu32(k.0, _mm512_set1_epi32(last(rows) as i32));
            let at = _mm512_add_epi32(_mm512_slli_epi32::<4>(k), B512::load(&LANE).0);
            W512(_mm512_i32gather_ps::<4>(at, rows.as_ptr().cast()))
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { W512(_mm512_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        unsafe { W512(_mm512_max_ps(self.0, o.0)) }
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        unsafe { W512(_mm512_min_ps(self.0, o.0)) }
    }
    #[inline(always)]
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
        unsafe { W512(_mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(a.0, b.0), y.0, x.0)) }
    }
    #[inline(always)]
    fn any_gt(a: Self, b: Self) -> bool {
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a.0, b.0) != 0 }
    }
    #[inline(always)]
    fn bits(self) -> B512 {
        unsafe { B512(_mm512_castps_si512(self.0)) }
    }
    #[inline(always)]
    fn whole(self) -> B512 {
        unsafe { B512(_mm512_cvttps_epi32(self.0)) }
    }
}

impl Bits<W512> for B512 {
    #[inline(always)]
    fn splat(v: u32) -> Self {
        unsafe { B512(_mm512_set1_epi32(v as i32)) }
    }
    #[inline(always)]
    fn load(p: &[u32; LANES]) -> Self {
        unsafe { B512(_mm512_loadu_si512(p.as_ptr().cast())) }
    }
    #[inline(always)]
    fn left<const N: u32>(self) -> Self {
        unsafe { B512(_mm512_slli_epi32::<N>(self.0)) }
    }
    #[inline(always)]
    fn right<const N: u32>(self) -> Self {
        unsafe { B512(_mm512_srli_epi32::<N>(self.0)) }
    }
    #[inline(always)]
    fn if_odd(self, x: W512, y: W512) -> W512 {
        unsafe { W512(_mm512_mask_blend_ps(_mm512_test_epi32_mask(self.0, _mm512_set1_epi32(1)), y.0, x.0)) }
    }
    #[inline(always)]
    fn numbers(self) -> W512 {
        unsafe { W512(_mm512_castsi512_ps(self.0)) }
    }
    #[inline(always)]
    fn values(self) -> W512 {
        unsafe { W512(_mm512_cvtepi32_ps(self.0)) }
    }
    #[inline(always)]
    fn store(self, p: &mut [u32; LANES]) {
        unsafe { _mm512_storeu_si512(p.as_mut_ptr().cast(), self.0) }
    }
}

impl Lanes for W256 {
    type Bits = B256;
    #[inline(always)]
    fn splat(v: f32) -> Self {
        unsafe { W256(_mm256_set1_ps(v), _mm256_set1_ps(v)) }
    }
    #[inline(always)]
    fn load(p: &Pack) -> Self {
        unsafe { W256(_mm256_load_ps(p.0.as_ptr()), _mm256_load_ps(p.0.as_ptr().add(8))) }
    }
    #[inline(always)]
    fn store(self, p: &mut Pack) {
        unsafe {
            _mm256_store_ps(p.0.as_mut_ptr(), self.0);
            _mm256_store_ps(p.0.as_mut_ptr().add(8), self.1);
        }
    }
    #[inline(always)]
    fn read(p: &[f32; LANES]) -> Self {
        unsafe { W256(_mm256_loadu_ps(p.as_ptr()), _mm256_loadu_ps(p.as_ptr().add(8))) }
    }
    #[inline(always)]
    fn write(self, p: &mut [f32; LANES]) {
        unsafe {
            _mm256_storeu_ps(p.as_mut_ptr(), self.0);
            _mm256_storeu_ps(p.as_mut_ptr().add(8), self.1);
        }
    }
    #[inline(always)]
    fn turned(rows: [Self; LANES]) -> [Self; LANES] {
        turned!(rows)
    }
    #[inline(always)]
    fn pick(rows: &[Pack], k: B256) -> Self {
        // SAFETY: indices stop at the last row.
        unsafe {
            let (last, lane) = (_mm256_set1_epi32(last(rows) as i32), B256::load(&LANE));
            let at = |k, lane| _mm256_add_epi32(_mm256_slli_epi32::<4>(_mm256_min_epu32(k, last)), lane);
            let (a, b) = (at(k.0, lane.0), at(k.1, lane.1));
            let from: *const f32 = rows.as_ptr().cast();
            W256(_mm256_i32gather_ps::<4>(from, a), _mm256_i32gather_ps::<4>(from, b))
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { W256(_mm256_sqrt_ps(self.0), _mm256_sqrt_ps(self.1)) }
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        unsafe { W256(_mm256_max_ps(self.0, o.0), _mm256_max_ps(self.1, o.1)) }
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        unsafe { W256(_mm256_min_ps(self.0, o.0), _mm256_min_ps(self.1, o.1)) }
    }
    #[inline(always)]
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
        unsafe {
            let (m, n) = (_mm256_cmp_ps::<_CMP_GT_OQ>(a.0, b.0), _mm256_cmp_ps::<_CMP_GT_OQ>(a.1, b.1));
            W256(_mm256_blendv_ps(y.0, x.0, m), _mm256_blendv_ps(y.1, x.1, n))
        }
    }
    #[inline(always)]
    fn any_gt(a: Self, b: Self) -> bool {
        unsafe {
            let (m, n) = (_mm256_cmp_ps::<_CMP_GT_OQ>(a.0, b.0), _mm256_cmp_ps::<_CMP_GT_OQ>(a.1, b.1));
            _mm256_movemask_ps(_mm256_or_ps(m, n)) != 0
        }
    }
    #[inline(always)]
    fn bits(self) -> B256 {
        unsafe { B256(_mm256_castps_si256(self.0), _mm256_castps_si256(self.1)) }
    }
    #[inline(always)]
    fn whole(self) -> B256 {
        unsafe { B256(_mm256_cvttps_epi32(self.0), _mm256_cvttps_epi32(self.1)) }
    }
}

impl Bits<W256> for B256 {
    #[inline(always)]
    fn splat(v: u32) -> Self {
        unsafe { B256(_mm256_set1_epi32(v as i32), _mm256_set1_epi32(v as i32)) }
    }
    #[inline(always)]
    fn load(p: &[u32; LANES]) -> Self {
        let from = p.as_ptr();
        unsafe { B256(_mm256_loadu_si256(from.cast()), _mm256_loadu_si256(from.add(8).cast())) }
    }
    #[inline(always)]
    fn left<const N: u32>(self) -> Self {
        let by = N as i32;
        unsafe {
            let by = _mm_cvtsi32_si128(by);
            B256(_mm256_sll_epi32(self.0, by), _mm256_sll_epi32(self.1, by))
        }
    }
    #[inline(always)]
    fn right<const N: u32>(self) -> Self {
        let by = N as i32;
        unsafe {
            let by = _mm_cvtsi32_si128(by);
            B256(_mm256_srl_epi32(self.0, by), _mm256_srl_epi32(self.1, by))
        }
    }
    #[inline(always)]
    fn if_odd(self, x: W256, y: W256) -> W256 {
        let sign = self.left::<31>().numbers();
        unsafe { W256(_mm256_blendv_ps(y.0, x.0, sign.0), _mm256_blendv_ps(y.1, x.1, sign.1)) }
    }
    #[inline(always)]
    fn numbers(self) -> W256 {
        unsafe { W256(_mm256_castsi256_ps(self.0), _mm256_castsi256_ps(self.1)) }
    }
    #[inline(always)]
    fn values(self) -> W256 {
        unsafe { W256(_mm256_cvtepi32_ps(self.0), _mm256_cvtepi32_ps(self.1)) }
    }
    #[inline(always)]
    fn store(self, p: &mut [u32; LANES]) {
        let to = p.as_mut_ptr();
        unsafe {
            _mm256_storeu_si256(to.cast(), self.0);
            _mm256_storeu_si256(to.add(8).cast(), self.1);
        }
    }
}

#[target_feature(enable = "avx512f,avx512dq,avx2")]
pub fn run512<K: Kernel>(kernel: K) -> K::Out {
    kernel.run::<W512>()
}

#[target_feature(enable = "avx2")]
pub fn run256<K: Kernel>(kernel: K) -> K::Out {
    kernel.run::<W256>()
}
