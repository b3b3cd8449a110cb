//! Sixteen numbers at a time in the widest registers that the processor has.
//!
//! Every operation is a single IEEE operation per lane or one on its bits, and nothing is fused, so all widths give the
//! same bits (`registers_tests.rs`). This file holds the crate's only `unsafe` code: the intrinsics behind the wide lanes.

#![allow(unsafe_code)]

use std::ops::{Add, Mul, Sub};

/// Numbers that are handled together.
pub(crate) const LANES: usize = 16;

/// Sixteen numbers as they lie in memory.
pub(crate) type Pack = [f32; LANES];

/// Range of depth that [`Lanes::short`] keeps: 2^-24 to just below 2^8.
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

/// Asks for memory that is read soon, so that it is near by then; nothing depends on it.
#[inline(always)]
pub(crate) fn fetch<T>(v: Option<&T>) {
    #[cfg(target_arch = "x86_64")]
    if let Some(v) = v {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, and the memory is there.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(v).cast()) }
    }
    let _ = v;
}

/// The depth in a word of [`Lanes::deposits`].
#[inline(always)]
pub(crate) fn depth_of(word: u32) -> f32 {
    f32::from_bits(((word & 0xffff_0000) >> 4) + BASE)
}

/// The place in a word of [`Lanes::deposits`].
#[inline(always)]
pub(crate) fn place_of(word: u32) -> usize {
    (word & 0xffff) as usize
}

/// Numbers in registers.
pub(crate) trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// The same number in every lane.
    fn splat(v: f32) -> Self;
    /// From memory that lies anywhere.
    fn read(p: &Pack) -> Self;
    /// To memory that lies anywhere.
    fn write(self, p: &mut Pack);
    /// The larger; `o` if either is not a number.
    fn max(self, o: Self) -> Self;
    /// The smaller; `o` if either is not a number.
    fn min(self, o: Self) -> Self;
    /// Whole part of numbers in [0, 2^31).
    fn whole(self) -> Self;
    /// Whole part of numbers in [0, 2^31), to memory.
    fn write_whole(self, p: &mut [u32; LANES]);
    /// Kept in [2^-24, 255] and rounded to 12 significant bits.
    fn short(self) -> Self;
    /// Words of a [`Lanes::short`] depth and a place, a whole number below 2^16.
    fn deposits(depth: Self, place: Self, p: &mut [u32; LANES]);
    /// Times 2^k, for the whole number k in the low bits of `shifted`.
    fn scaled(self, shifted: Self) -> Self;
}

/// Lanes one after another: the plain reference, and the fallback on other processors.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Plain(Pack);

macro_rules! plain_op {
    ($trait:ident, $name:ident, |$a:ident, $b:ident| $value:expr) => {
        impl $trait for Plain {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                Plain(std::array::from_fn(|i| {
                    let ($a, $b) = (self.0[i], o.0[i]);
                    $value
                }))
            }
        }
    };
}
plain_op!(Add, add, |a, b| a + b);
plain_op!(Sub, sub, |a, b| a - b);
plain_op!(Mul, mul, |a, b| a * b);

impl Lanes for Plain {
    #[inline(always)]
    fn splat(v: f32) -> Self {
        Plain([v; LANES])
    }
    #[inline(always)]
    fn read(p: &Pack) -> Self {
        Plain(*p)
    }
    #[inline(always)]
    fn write(self, p: &mut Pack) {
        *p = self.0;
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Plain(std::array::from_fn(|i| if self.0[i] > o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Plain(std::array::from_fn(|i| if self.0[i] < o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn whole(self) -> Self {
        Plain(self.0.map(|v| v as i32 as f32))
    }
    #[inline(always)]
    fn write_whole(self, p: &mut [u32; LANES]) {
        *p = self.0.map(|v| v as i32 as u32);
    }
    #[inline(always)]
    fn short(self) -> Self {
        let kept = self.max(Self::splat(LEAST)).min(Self::splat(MOST));
        Plain(kept.0.map(|v| f32::from_bits((v.to_bits() + 0x800) & !0xfff)))
    }
    #[inline(always)]
    fn deposits(depth: Self, place: Self, p: &mut [u32; LANES]) {
        *p = std::array::from_fn(|i| ((depth.0[i].to_bits() - BASE) << 4) | place.0[i] as i32 as u32);
    }
    #[inline(always)]
    fn scaled(self, shifted: Self) -> Self {
        Plain(std::array::from_fn(|i| f32::from_bits(self.0[i].to_bits().wrapping_add(shifted.0[i].to_bits() << 23))))
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Add, BASE, Kernel, LANES, LEAST, Lanes, MOST, Mul, Pack, Sub};
    use std::arch::x86_64::*;

    /// One 512-bit register. Only made inside [`run512`], after the processor was asked.
    #[derive(Clone, Copy)]
    pub struct W512(__m512);

    /// Two 256-bit registers. Only made inside [`run256`], after the processor was asked.
    #[derive(Clone, Copy)]
    pub struct W256(__m256, __m256);

    macro_rules! op {
        ($trait:ident, $name:ident, $wide:ident, $half:ident) => {
            impl $trait for W512 {
                type Output = Self;
                #[inline(always)]
                fn $name(self, o: Self) -> Self {
                    unsafe { W512($wide(self.0, o.0)) }
                }
            }
            impl $trait for W256 {
                type Output = Self;
                #[inline(always)]
                fn $name(self, o: Self) -> Self {
                    unsafe { W256($half(self.0, o.0), $half(self.1, o.1)) }
                }
            }
        };
    }
    op!(Add, add, _mm512_add_ps, _mm256_add_ps);
    op!(Sub, sub, _mm512_sub_ps, _mm256_sub_ps);
    op!(Mul, mul, _mm512_mul_ps, _mm256_mul_ps);

    // SAFETY, for all below: a lane type exists only where the processor has its registers, and memory is given as arrays
    // of sixteen.
    impl Lanes for W512 {
        #[inline(always)]
        fn splat(v: f32) -> Self {
            unsafe { W512(_mm512_set1_ps(v)) }
        }
        #[inline(always)]
        fn read(p: &Pack) -> Self {
            unsafe { W512(_mm512_loadu_ps(p.as_ptr())) }
        }
        #[inline(always)]
        fn write(self, p: &mut Pack) {
            unsafe { _mm512_storeu_ps(p.as_mut_ptr(), self.0) }
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
        fn whole(self) -> Self {
            unsafe { W512(_mm512_cvtepi32_ps(_mm512_cvttps_epi32(self.0))) }
        }
        #[inline(always)]
        fn write_whole(self, p: &mut [u32; LANES]) {
            unsafe { _mm512_storeu_si512(p.as_mut_ptr().cast(), _mm512_cvttps_epi32(self.0)) }
        }
        #[inline(always)]
        fn short(self) -> Self {
            unsafe {
                let kept = _mm512_castps_si512(self.max(Self::splat(LEAST)).min(Self::splat(MOST)).0);
                let up = _mm512_add_epi32(kept, _mm512_set1_epi32(0x800));
                W512(_mm512_castsi512_ps(_mm512_and_si512(up, _mm512_set1_epi32(!0xfff))))
            }
        }
        #[inline(always)]
        fn deposits(depth: Self, place: Self, p: &mut [u32; LANES]) {
            unsafe {
                let d = _mm512_sub_epi32(_mm512_castps_si512(depth.0), _mm512_set1_epi32(BASE as i32));
                let word = _mm512_or_si512(_mm512_slli_epi32::<4>(d), _mm512_cvttps_epi32(place.0));
                _mm512_storeu_si512(p.as_mut_ptr().cast(), word);
            }
        }
        #[inline(always)]
        fn scaled(self, shifted: Self) -> Self {
            unsafe {
                let k = _mm512_slli_epi32::<23>(_mm512_castps_si512(shifted.0));
                W512(_mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(self.0), k)))
            }
        }
    }

    impl Lanes for W256 {
        #[inline(always)]
        fn splat(v: f32) -> Self {
            unsafe { W256(_mm256_set1_ps(v), _mm256_set1_ps(v)) }
        }
        #[inline(always)]
        fn read(p: &Pack) -> Self {
            unsafe { W256(_mm256_loadu_ps(p.as_ptr()), _mm256_loadu_ps(p.as_ptr().add(8))) }
        }
        #[inline(always)]
        fn write(self, p: &mut Pack) {
            unsafe {
                _mm256_storeu_ps(p.as_mut_ptr(), self.0);
                _mm256_storeu_ps(p.as_mut_ptr().add(8), self.1);
            }
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
        fn whole(self) -> Self {
            macro_rules! half {
                ($v:expr) => {
                    _mm256_cvtepi32_ps(_mm256_cvttps_epi32($v))
                };
            }
            unsafe { W256(half!(self.0), half!(self.1)) }
        }
        #[inline(always)]
        fn write_whole(self, p: &mut [u32; LANES]) {
            unsafe {
                _mm256_storeu_si256(p.as_mut_ptr().cast(), _mm256_cvttps_epi32(self.0));
                _mm256_storeu_si256(p.as_mut_ptr().add(8).cast(), _mm256_cvttps_epi32(self.1));
            }
        }
        #[inline(always)]
        fn short(self) -> Self {
            let kept = self.max(Self::splat(LEAST)).min(Self::splat(MOST));
            macro_rules! half {
                ($v:expr) => {{
                    let up = _mm256_add_epi32(_mm256_castps_si256($v), _mm256_set1_epi32(0x800));
                    _mm256_castsi256_ps(_mm256_and_si256(up, _mm256_set1_epi32(!0xfff)))
                }};
            }
            unsafe { W256(half!(kept.0), half!(kept.1)) }
        }
        #[inline(always)]
        fn deposits(depth: Self, place: Self, p: &mut [u32; LANES]) {
            macro_rules! half {
                ($d:expr, $place:expr) => {{
                    let d = _mm256_sub_epi32(_mm256_castps_si256($d), _mm256_set1_epi32(BASE as i32));
                    _mm256_or_si256(_mm256_slli_epi32::<4>(d), _mm256_cvttps_epi32($place))
                }};
            }
            unsafe {
                _mm256_storeu_si256(p.as_mut_ptr().cast(), half!(depth.0, place.0));
                _mm256_storeu_si256(p.as_mut_ptr().add(8).cast(), half!(depth.1, place.1));
            }
        }
        #[inline(always)]
        fn scaled(self, shifted: Self) -> Self {
            macro_rules! half {
                ($v:expr, $k:expr) => {{
                    let k = _mm256_slli_epi32::<23>(_mm256_castps_si256($k));
                    _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256($v), k))
                }};
            }
            unsafe { W256(half!(self.0, shifted.0), half!(self.1, shifted.1)) }
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

/// Work that runs at any width. `run` and all that it calls on lanes must be functions that are `#[inline(always)]` (no
/// closures): only then are they compiled for the processor's wide registers.
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
    pub fn is_here(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        match self {
            Width::W512 => return is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
            Width::W256 => return is_x86_feature_detected!("avx2"),
            Width::Plain => {}
        }
        self == Width::Plain
    }

    /// The widest that this processor has.
    pub fn widest() -> Width {
        Width::ALL.into_iter().find(|w| w.is_here()).unwrap_or(Width::Plain)
    }
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
