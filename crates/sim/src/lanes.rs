//! Eight strands at a time: one lane a strand, the same arithmetic in every lane.
//!
//! Every operation is a single IEEE operation per lane (add, subtract, multiply, divide, square root, fused
//! multiply-add, compare), so all widths give the same bits. No operation mixes lanes.
//!
//! This file holds the crate's only `unsafe` code: the intrinsics behind the wide lanes. Arrays of eight numbers left to
//! the compiler were slower, because it splits large kernels into scalars and does not find its way back (measured in
//! `docs/benchmarks.md`). The parity test below holds all widths to the same bits.

#![allow(unsafe_code)]

pub use pelage_geom::registers::Width;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Strands that are solved together.
pub const LANES: usize = 8;

/// One number for each of eight strands, as it lies in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Pack(pub [f64; LANES]);

impl Default for Pack {
    fn default() -> Self {
        Pack([0.0; LANES])
    }
}

impl Pack {
    /// The same number in every lane.
    pub fn splat(v: f64) -> Self {
        Pack([v; LANES])
    }
}

/// Eight numbers in registers.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// The same number in every lane.
    fn splat(v: f64) -> Self;
    /// From memory.
    fn load(p: &Pack) -> Self;
    /// To memory.
    fn store(self, p: &mut Pack);
    /// `self * b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// In each lane `x` if `a > b`, else `y` (also when either is not a number).
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self;

    /// The larger; `other` if `self` is not a number.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::if_gt(self, other, self, other)
    }

    /// The smaller; `other` if `self` is not a number.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::if_gt(other, self, self, other)
    }
}

/// Lanes one after another: the plain reference, and the fallback on other processors.
#[derive(Clone, Copy, Debug)]
pub struct Plain([f64; LANES]);

macro_rules! plain_op {
    ($trait:ident, $name:ident, $op:tt) => {
        impl $trait for Plain {
            type Output = Self;
            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                let mut r = self.0;
                for i in 0..LANES {
                    r[i] = self.0[i] $op o.0[i];
                }
                Plain(r)
            }
        }
    };
}
plain_op!(Add, add, +);
plain_op!(Sub, sub, -);
plain_op!(Mul, mul, *);
plain_op!(Div, div, /);

impl Neg for Plain {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Plain(self.0.map(|v| -v))
    }
}

impl Lanes for Plain {
    #[inline(always)]
    fn splat(v: f64) -> Self {
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
    fn mul_add(self, b: Self, c: Self) -> Self {
        let mut r = self.0;
        for i in 0..LANES {
            r[i] = self.0[i].mul_add(b.0[i], c.0[i]);
        }
        Plain(r)
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        let mut r = self.0;
        for i in 0..LANES {
            r[i] = (-self.0[i]).mul_add(b.0[i], c.0[i]);
        }
        Plain(r)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Plain(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
        let mut r = y.0;
        for i in 0..LANES {
            r[i] = if a.0[i] > b.0[i] { x.0[i] } else { y.0[i] };
        }
        Plain(r)
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Lanes, Pack};
    use std::arch::x86_64::*;
    use std::ops::{Add, Div, Mul, Neg, Sub};

    /// One 512-bit register. Only made inside [`super::run`], after the processor was asked.
    #[derive(Clone, Copy)]
    #[repr(transparent)]
    pub struct W512(__m512d);

    /// Two 256-bit registers. Only made inside [`super::run`], after the processor was asked.
    #[derive(Clone, Copy)]
    pub struct W256(__m256d, __m256d);

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
    op!(Add, add, _mm512_add_pd, _mm256_add_pd);
    op!(Sub, sub, _mm512_sub_pd, _mm256_sub_pd);
    op!(Mul, mul, _mm512_mul_pd, _mm256_mul_pd);
    op!(Div, div, _mm512_div_pd, _mm256_div_pd);

    impl Neg for W512 {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            Self::splat(-0.0) - self
        }
    }

    impl Neg for W256 {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            Self::splat(-0.0) - self
        }
    }

    impl Lanes for W512 {
        #[inline(always)]
        fn splat(v: f64) -> Self {
            unsafe { W512(_mm512_set1_pd(v)) }
        }
        #[inline(always)]
        fn load(p: &Pack) -> Self {
            unsafe { W512(_mm512_load_pd(p.0.as_ptr())) }
        }
        #[inline(always)]
        fn store(self, p: &mut Pack) {
            unsafe { _mm512_store_pd(p.0.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn mul_add(self, b: Self, c: Self) -> Self {
            unsafe { W512(_mm512_fmadd_pd(self.0, b.0, c.0)) }
        }
        #[inline(always)]
        fn neg_mul_add(self, b: Self, c: Self) -> Self {
            unsafe { W512(_mm512_fnmadd_pd(self.0, b.0, c.0)) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { W512(_mm512_sqrt_pd(self.0)) }
        }
        #[inline(always)]
        fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
            unsafe { W512(_mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(a.0, b.0), y.0, x.0)) }
        }
    }

    impl Lanes for W256 {
        #[inline(always)]
        fn splat(v: f64) -> Self {
            unsafe { W256(_mm256_set1_pd(v), _mm256_set1_pd(v)) }
        }
        #[inline(always)]
        fn load(p: &Pack) -> Self {
            unsafe { W256(_mm256_load_pd(p.0.as_ptr()), _mm256_load_pd(p.0.as_ptr().add(4))) }
        }
        #[inline(always)]
        fn store(self, p: &mut Pack) {
            unsafe {
                _mm256_store_pd(p.0.as_mut_ptr(), self.0);
                _mm256_store_pd(p.0.as_mut_ptr().add(4), self.1);
            }
        }
        #[inline(always)]
        fn mul_add(self, b: Self, c: Self) -> Self {
            unsafe { W256(_mm256_fmadd_pd(self.0, b.0, c.0), _mm256_fmadd_pd(self.1, b.1, c.1)) }
        }
        #[inline(always)]
        fn neg_mul_add(self, b: Self, c: Self) -> Self {
            unsafe { W256(_mm256_fnmadd_pd(self.0, b.0, c.0), _mm256_fnmadd_pd(self.1, b.1, c.1)) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { W256(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
        }
        #[inline(always)]
        fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
            unsafe {
                let (m, n) = (_mm256_cmp_pd::<_CMP_GT_OQ>(a.0, b.0), _mm256_cmp_pd::<_CMP_GT_OQ>(a.1, b.1));
                W256(_mm256_blendv_pd(y.0, x.0, m), _mm256_blendv_pd(y.1, x.1, n))
            }
        }
    }

    #[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
    pub fn run512<K: super::Kernel>(kernel: K) -> K::Out {
        kernel.run::<W512>()
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn run256<K: super::Kernel>(kernel: K) -> K::Out {
        kernel.run::<W256>()
    }

    #[target_feature(enable = "fma")]
    pub fn run_plain<K: super::Kernel>(kernel: K) -> K::Out {
        kernel.run::<super::Plain>()
    }
}

/// Work that runs at any width. `run` and all that it calls on lanes must be `#[inline(always)]`: only then are they
/// compiled for the processor's wide registers.
pub trait Kernel {
    /// What it gives back.
    type Out;
    /// Does the work.
    fn run<L: Lanes>(self) -> Self::Out;
}

/// Runs a kernel at a width; [`Width::Plain`] where the processor lacks it.
pub fn run<K: Kernel>(width: Width, kernel: K) -> K::Out {
    #[cfg(target_arch = "x86_64")]
    {
        // SAFETY: each call is behind the test for the features that the function is compiled for; AVX-512 has AVX2 and FMA.
        match width {
            Width::W512 if width.is_here() => return unsafe { wide::run512(kernel) },
            Width::W256 if width.is_here() => return unsafe { wide::run256(kernel) },
            _ if is_x86_feature_detected!("fma") => return unsafe { wide::run_plain(kernel) },
            _ => {}
        }
    }
    let _ = width;
    kernel.run::<Plain>()
}

/// Three coordinates in each lane.
pub type L3<L> = [L; 3];

/// `a - b`.
#[inline(always)]
pub fn sub3<L: Lanes>(a: L3<L>, b: L3<L>) -> L3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + b`.
#[inline(always)]
pub fn add3<L: Lanes>(a: L3<L>, b: L3<L>) -> L3<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a s`.
#[inline(always)]
pub fn scale3<L: Lanes>(a: L3<L>, s: L) -> L3<L> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `a s + b`.
#[inline(always)]
pub fn mul_add3<L: Lanes>(a: L3<L>, s: L, b: L3<L>) -> L3<L> {
    [a[0].mul_add(s, b[0]), a[1].mul_add(s, b[1]), a[2].mul_add(s, b[2])]
}

/// `b - a s`.
#[inline(always)]
pub fn neg_mul_add3<L: Lanes>(a: L3<L>, s: L, b: L3<L>) -> L3<L> {
    [a[0].neg_mul_add(s, b[0]), a[1].neg_mul_add(s, b[1]), a[2].neg_mul_add(s, b[2])]
}

/// Scalar product.
#[inline(always)]
pub fn dot<L: Lanes>(a: L3<L>, b: L3<L>) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// Vector product.
#[inline(always)]
pub fn cross<L: Lanes>(a: L3<L>, b: L3<L>) -> L3<L> {
    [a[2].neg_mul_add(b[1], a[1] * b[2]), a[0].neg_mul_add(b[2], a[2] * b[0]), a[1].neg_mul_add(b[0], a[0] * b[1])]
}

/// From memory.
#[inline(always)]
pub fn load3<L: Lanes>(p: &[Pack; 3]) -> L3<L> {
    [L::load(&p[0]), L::load(&p[1]), L::load(&p[2])]
}

/// To memory.
#[inline(always)]
pub fn store3<L: Lanes>(v: L3<L>, p: &mut [Pack; 3]) {
    v[0].store(&mut p[0]);
    v[1].store(&mut p[1]);
    v[2].store(&mut p[2]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng;

    struct Everything<'a>(&'a [Pack; 3]);

    impl Kernel for Everything<'_> {
        type Out = Vec<Pack>;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<Pack> {
            let [a, b, c] = load3::<L>(self.0);
            let all = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                a.mul_add(b, c),
                a.neg_mul_add(b, c),
                (a * a).sqrt(),
                L::if_gt(a, b, a, c),
                a.max(b),
                a.min(b),
                dot([a, b, c], [b, c, a]),
                cross([a, b, c], [b, c, a])[1],
            ];
            let mut out = vec![Pack::default(); all.len()];
            for (v, p) in all.iter().zip(&mut out) {
                v.store(p);
            }
            out
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        for step in 0..200 {
            let value = |k: u64| {
                let u = rng::uniform(7, k, 1, step);
                let scale = [1.0, 1e-300, 1e300, 1e-12, -1.0][(k + step) as usize % 5];
                if u < 0.02 { f64::INFINITY } else { (u - 0.5) * scale }
            };
            let packs: [Pack; 3] = std::array::from_fn(|i| Pack(std::array::from_fn(|l| value((i * 8 + l) as u64))));
            let bits = |w: Width| -> Vec<[u64; LANES]> {
                let bits_of = |v: f64| if v.is_nan() { 0 } else { v.to_bits() };
                run(w, Everything(&packs)).iter().map(|p| p.0.map(bits_of)).collect()
            };
            let plain = bits(Width::Plain);
            for w in Width::available() {
                assert_eq!(bits(w), plain, "{w:?}");
            }
        }
    }
}
