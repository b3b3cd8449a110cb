//! Sixteen numbers at a time in the widest registers that the processor has.
//!
//! Every operation is a single IEEE operation per lane (add, subtract, multiply, divide, square root, compare) or one on
//! its bits, and nothing is fused, so all widths give the same bits. Only [`Lanes::turned`] mixes lanes.
//!
//! This file holds the crate's only `unsafe` code: the intrinsics behind the wide lanes. What the compiler may assume of
//! every x86 processor has registers of four numbers and no product of integers in lanes, which made the look two to three
//! times slower. The parity tests (`registers_tests.rs`) hold all widths to the same bits.

#![allow(unsafe_code)]
// Arrays of lanes are walked side by side.
#![allow(clippy::needless_range_loop)]

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Sub};

/// Hairs that are handled together.
pub(crate) const LANES: usize = 16;

/// One number for each hair, as it lies in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Pack(pub [f32; LANES]);

/// Numbers in registers.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Whole numbers of as many bits.
    type Bits: Bits<Self>;
    /// The same number in every lane.
    fn splat(v: f32) -> Self;
    /// From memory.
    fn load(p: &Pack) -> Self;
    /// To memory.
    fn store(self, p: &mut Pack);
    /// From memory that lies anywhere.
    fn read(p: &[f32; LANES]) -> Self;
    /// To memory that lies anywhere.
    fn write(self, p: &mut [f32; LANES]);
    /// Rows as columns.
    fn turned(rows: [Self; LANES]) -> [Self; LANES];
    /// In each lane the number of that lane in row `k` of `rows` (the last row for greater `k`).
    fn pick(rows: &[Pack], k: Self::Bits) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The larger; `o` if either is not a number.
    fn max(self, o: Self) -> Self;
    /// The smaller; `o` if either is not a number.
    fn min(self, o: Self) -> Self;
    /// In each lane `x` if `a > b`, else `y` (also when either is not a number).
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self;
    /// Whether `a > b` in any lane.
    fn any_gt(a: Self, b: Self) -> bool;
    /// Its bits.
    fn bits(self) -> Self::Bits;
}

/// Whole numbers in registers; sums and products wrap around.
pub(crate) trait Bits<F>:
    Copy + Add<Output = Self> + Mul<Output = Self> + BitXor<Output = Self> + BitAnd<Output = Self> + BitOr<Output = Self>
{
    /// The same in every lane.
    fn splat(v: u32) -> Self;
    /// From memory.
    fn load(p: &[u32; LANES]) -> Self;
    /// Shifted to the left.
    fn left<const N: u32>(self) -> Self;
    /// Shifted to the right; zeros come in.
    fn right<const N: u32>(self) -> Self;
    /// In each lane `x` if the number is odd, else `y`.
    fn if_odd(self, x: F, y: F) -> F;
    /// The numbers that have these bits.
    fn numbers(self) -> F;
}

/// Lanes one after another: the plain reference, and the fallback on other processors.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Plain([f32; LANES]);

/// [`Plain`] of whole numbers.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct PlainBits([u32; LANES]);

macro_rules! plain_op {
    ($of:ident, $trait:ident, $name:ident, |$a:ident, $b:ident| $value:expr) => {
        impl $trait for $of {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                let mut r = self.0;
                for i in 0..LANES {
                    let ($a, $b) = (self.0[i], o.0[i]);
                    r[i] = $value;
                }
                $of(r)
            }
        }
    };
}
plain_op!(Plain, Add, add, |a, b| a + b);
plain_op!(Plain, Sub, sub, |a, b| a - b);
plain_op!(Plain, Mul, mul, |a, b| a * b);
plain_op!(Plain, Div, div, |a, b| a / b);
plain_op!(PlainBits, Add, add, |a, b| a.wrapping_add(b));
plain_op!(PlainBits, Mul, mul, |a, b| a.wrapping_mul(b));
plain_op!(PlainBits, BitXor, bitxor, |a, b| a ^ b);
plain_op!(PlainBits, BitAnd, bitand, |a, b| a & b);
plain_op!(PlainBits, BitOr, bitor, |a, b| a | b);

/// A value for every lane, in a loop that the compiler can put into registers.
macro_rules! each {
    ($of:ident, $zero:expr, |$i:ident| $value:expr) => {{
        let mut r = [$zero; LANES];
        for $i in 0..LANES {
            r[$i] = $value;
        }
        $of(r)
    }};
}

impl Lanes for Plain {
    type Bits = PlainBits;
    #[inline(always)]
    fn splat(v: f32) -> Self {
        Plain([v; LANES])
    }
    #[inline(always)]
    fn load(p: &Pack) -> Self {
        Plain(p.0)
    }
    #[inline(always)]
    fn store(self, p: &mut Pack) {
        p.0 = self.0;
    }
    #[inline(always)]
    fn read(p: &[f32; LANES]) -> Self {
        Plain(*p)
    }
    #[inline(always)]
    fn write(self, p: &mut [f32; LANES]) {
        *p = self.0;
    }
    #[inline(always)]
    fn turned(rows: [Self; LANES]) -> [Self; LANES] {
        let mut out = rows;
        for l in 0..LANES {
            for k in 0..LANES {
                out[k].0[l] = rows[l].0[k];
            }
        }
        out
    }
    #[inline(always)]
    fn pick(rows: &[Pack], k: PlainBits) -> Self {
        each!(Plain, 0.0, |i| rows[(k.0[i] as usize).min(rows.len() - 1)].0[i])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(Plain, 0.0, |i| self.0[i].sqrt())
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self::if_gt(self, o, self, o)
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self::if_gt(o, self, self, o)
    }
    #[inline(always)]
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
        each!(Plain, 0.0, |i| if a.0[i] > b.0[i] { x.0[i] } else { y.0[i] })
    }
    #[inline(always)]
    fn any_gt(a: Self, b: Self) -> bool {
        let mut any = false;
        for i in 0..LANES {
            any |= a.0[i] > b.0[i];
        }
        any
    }
    #[inline(always)]
    fn bits(self) -> PlainBits {
        each!(PlainBits, 0, |i| self.0[i].to_bits())
    }
}

impl Bits<Plain> for PlainBits {
    #[inline(always)]
    fn splat(v: u32) -> Self {
        PlainBits([v; LANES])
    }
    #[inline(always)]
    fn load(p: &[u32; LANES]) -> Self {
        PlainBits(*p)
    }
    #[inline(always)]
    fn left<const N: u32>(self) -> Self {
        each!(PlainBits, 0, |i| self.0[i] << N)
    }
    #[inline(always)]
    fn right<const N: u32>(self) -> Self {
        each!(PlainBits, 0, |i| self.0[i] >> N)
    }
    #[inline(always)]
    fn if_odd(self, x: Plain, y: Plain) -> Plain {
        each!(Plain, 0.0, |i| if self.0[i] & 1 == 1 { x.0[i] } else { y.0[i] })
    }
    #[inline(always)]
    fn numbers(self) -> Plain {
        each!(Plain, 0.0, |i| f32::from_bits(self.0[i]))
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
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
    }

    #[target_feature(enable = "avx512f,avx512dq,avx2")]
    pub fn run512<K: Kernel>(kernel: K) -> K::Out {
        kernel.run::<W512>()
    }

    #[target_feature(enable = "avx2")]
    pub fn run256<K: Kernel>(kernel: K) -> K::Out {
        kernel.run::<W256>()
    }
}

/// Asks for numbers that are read soon, so that they are near by then; nothing depends on it.
#[inline(always)]
pub(crate) fn fetch(numbers: &[f32]) {
    // What comes after the first lines of the cache, the processor fetches by itself.
    #[cfg(target_arch = "x86_64")]
    for line in numbers.chunks(LANES).take(4) {
        // SAFETY: every x86-64 processor has the instruction, and the memory is there.
        unsafe { std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(line.as_ptr().cast()) }
    }
    let _ = numbers;
}

/// Work that runs at any width. `run` and all that it calls on lanes must be `#[inline(always)]`: only then are they
/// compiled for the processor's wide registers.
pub(crate) trait Kernel {
    /// What it gives back.
    type Out;
    /// Does the work.
    fn run<L: Lanes>(self) -> Self::Out;
}

/// Widest registers to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Width {
    /// 512 bits: AVX-512.
    W512,
    /// 256 bits: AVX2.
    W256,
    /// One lane after another.
    Plain,
}

impl Width {
    /// From the widest to the narrowest.
    pub const ALL: [Width; 3] = [Width::W512, Width::W256, Width::Plain];

    /// Whether this processor has it.
    fn is_here(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        match self {
            Width::W512 => return is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
            Width::W256 => return is_x86_feature_detected!("avx2"),
            Width::Plain => {}
        }
        self == Width::Plain
    }
}

/// Runs a kernel in the widest registers of this processor.
pub(crate) fn run<K: Kernel>(kernel: K) -> K::Out {
    let widest = Width::ALL.into_iter().find(|w| w.is_here());
    run_at(widest.unwrap_or(Width::Plain), kernel)
}

/// Runs a kernel at a width; [`Width::Plain`] where the processor lacks it.
pub(crate) fn run_at<K: Kernel>(width: Width, kernel: K) -> K::Out {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: each call is behind the test for the features that the function is compiled for.
    match width {
        Width::W512 if width.is_here() => return unsafe { wide::run512(kernel) },
        Width::W256 if width.is_here() => return unsafe { wide::run256(kernel) },
        _ => {}
    }
    let _ = width;
    kernel.run::<Plain>()
}
