//! Sixteen numbers at a time in the widest registers that the processor has.
//!
//! Every operation is a single IEEE operation per lane (add, subtract, multiply, divide, square root, compare) or one on
//! its bits, and nothing is fused, so all widths give the same bits. Only [`Lanes::turned`] mixes lanes.
//!
//! This file and `wide.rs` hold the crate's only `unsafe` code: the intrinsics behind the wide lanes. What the compiler may
//! assume of every x86 processor has registers of four numbers and no product of integers in lanes, which made the look of
//! hair two to three times slower. The parity tests (`registers_tests.rs`) hold all widths to the same bits. Simulation has
//! lanes of its own: double precision, and fused.

#![allow(unsafe_code)]
// Arrays of lanes are walked side by side.
#![allow(clippy::needless_range_loop)]

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Sub};

/// Numbers that are handled together.
pub const LANES: usize = 16;

/// 0, 1, 2 and so on.
pub const COUNT: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// Sixteen numbers as they lie in memory, where a register can be loaded from at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Pack(pub [f32; LANES]);

/// Numbers in registers.
pub trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
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
    /// Whole part of numbers in [0, 2^31).
    fn whole(self) -> Self::Bits;
}

/// Whole numbers in registers; sums and products wrap around.
pub trait Bits<F>:
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
    /// Whole numbers below 2^31 as numbers.
    fn values(self) -> F;
    /// To memory.
    fn store(self, p: &mut [u32; LANES]);
}

/// Lanes one after another: the plain reference, and the fallback on other processors.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Plain([f32; LANES]);

/// [`Plain`] of whole numbers.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct PlainBits([u32; LANES]);

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
    #[inline(always)]
    fn whole(self) -> PlainBits {
        each!(PlainBits, 0, |i| self.0[i] as i32 as u32)
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
    #[inline(always)]
    fn values(self) -> Plain {
        each!(Plain, 0.0, |i| self.0[i] as i32 as f32)
    }
    #[inline(always)]
    fn store(self, p: &mut [u32; LANES]) {
        *p = self.0;
    }
}

#[cfg(target_arch = "x86_64")]
mod wide;

/// Asks for memory that is read soon, so that it is near by then; nothing depends on it.
#[inline(always)]
pub fn fetch<T>(v: Option<&T>) {
    #[cfg(target_arch = "x86_64")]
    if let Some(v) = v {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, and the memory is there.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(v).cast()) }
    }
    let _ = v;
}

/// Work that runs at any width. `run` and all that it calls on lanes must be functions that are `#[inline(always)]` (no
/// closures): only then are they compiled for the processor's wide registers.
pub trait Kernel {
    /// What it gives back.
    type Out;
    /// Does the work.
    fn run<L: Lanes>(self) -> Self::Out;
}

/// Widest registers to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// 512 bits: AVX-512.
    W512,
    /// 256 bits: AVX2 and FMA, which came together.
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
            Width::W256 => return is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            Width::Plain => {}
        }
        self == Width::Plain
    }

    /// Those that this processor has, the widest first.
    pub fn available() -> impl Iterator<Item = Width> {
        Width::ALL.into_iter().filter(|w| w.is_here())
    }

    /// The widest that this processor has.
    pub fn widest() -> Width {
        Width::available().next().unwrap_or(Width::Plain)
    }
}

/// Runs a kernel in the widest registers of this processor.
pub fn run<K: Kernel>(kernel: K) -> K::Out {
    run_at(Width::widest(), kernel)
}

/// Runs a kernel at a width; [`Width::Plain`] where the processor lacks it.
pub fn run_at<K: Kernel>(width: Width, kernel: K) -> K::Out {
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
