//! Every width gives the same bits.
// Arrays of lanes are walked side by side.
#![allow(clippy::needless_range_loop)]

use crate::registers::*;
use crate::rng;

struct Everything<'a>(&'a [Pack; 3], &'a [u32; LANES]);

impl Kernel for Everything<'_> {
    type Out = Vec<Pack>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Pack> {
        let (a, b, c) = (L::load(&self.0[0]), L::load(&self.0[1]), L::load(&self.0[2]));
        let (i, one) = (L::Bits::load(self.1), L::splat(1.0));
        let j = a.bits();
        let all = [
            a + b,
            a - b,
            a * b,
            a / b,
            (a * a).sqrt(),
            a.max(b),
            a.min(b),
            L::if_gt(a, b, a, c),
            L::if_gt(L::splat(0.1), a, b, one),
            i.if_odd(a, b),
            (i + j).numbers(),
            (i * j).numbers(),
            ((i ^ j) & L::Bits::splat(0x3fff_ffff)).numbers(),
            (i | j).numbers(),
            i.left::<7>().numbers(),
            j.right::<9>().numbers(),
            if L::any_gt(a, b) { one } else { a },
            L::pick(self.0, i & L::Bits::splat(3)),
            L::pick(self.0, i),
            a.max(L::splat(0.0)).min(L::splat(65_535.0)).whole().values(),
        ];
        let mut out = vec![Pack::default(); all.len() + 1];
        for (v, p) in all.iter().zip(&mut out) {
            v.store(p);
        }
        let mut words = [0; LANES];
        (i ^ j).store(&mut words);
        out[all.len()] = Pack(words.map(|w| (w >> 8) as f32));
        out
    }
}

#[test]
fn every_width_gives_the_same_bits() {
    for step in 0..300 {
        let value = |k: u64| {
            let u = rng::uniform(7, k, 1, step) as f32;
            let scale = [1.0, 1e-40, 1e38, 1e-12, -1.0][(k + step) as usize % 5];
            let odd = [f32::INFINITY, f32::NAN, 0.0, -0.0];
            if u < 0.08 { odd[(u * 50.0) as usize] } else { (u - 0.5) * scale }
        };
        let packs: [Pack; 3] = std::array::from_fn(|i| Pack(std::array::from_fn(|l| value((i * LANES + l) as u64))));
        let whole: [u32; LANES] = std::array::from_fn(|l| rng::key(3, step, l as u64) as u32);
        let bits = |w: Width| -> Vec<[u32; LANES]> {
            let bits_of = |v: f32| if v.is_nan() { 0 } else { v.to_bits() };
            run_at(w, Everything(&packs, &whole)).iter().map(|p| p.0.map(bits_of)).collect()
        };
        let plain = bits(Width::Plain);
        for w in Width::ALL {
            assert_eq!(bits(w), plain, "{w:?}");
        }
    }
}

#[test]
fn rows_become_columns_at_every_width() {
    struct Turn(Vec<[f32; LANES]>);
    impl Kernel for Turn {
        type Out = Vec<[f32; LANES]>;
        #[inline(always)]
        fn run<L: Lanes>(mut self) -> Self::Out {
            let mut rows = [L::splat(0.0); LANES];
            for k in 0..LANES {
                rows[k] = L::read(&self.0[k]);
            }
            for (row, to) in L::turned(rows).into_iter().zip(&mut self.0) {
                row.write(to);
            }
            self.0
        }
    }
    let rows: Vec<[f32; LANES]> = (0..LANES).map(|k| std::array::from_fn(|l| (100 * k + l) as f32)).collect();
    for w in Width::ALL {
        let turned = run_at(w, Turn(rows.clone()));
        assert!((0..LANES).all(|k| (0..LANES).all(|l| turned[l][k] == rows[k][l])), "{w:?}");
    }
}

#[test]
fn rows_are_picked_lane_by_lane() {
    let rows: Vec<Pack> = (0..5).map(|k| Pack(std::array::from_fn(|l| (100 * k + l) as f32))).collect();
    struct Pick<'a>(&'a [Pack], [u32; LANES]);
    impl Kernel for Pick<'_> {
        type Out = Pack;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Pack {
            let mut out = Pack::default();
            L::pick(self.0, L::Bits::load(&self.1)).store(&mut out);
            out
        }
    }
    let k: [u32; LANES] = std::array::from_fn(|l| if l == 9 { u32::MAX } else { l as u32 % 5 });
    for w in Width::ALL {
        let got = run_at(w, Pick(&rows, k));
        assert!((0..LANES).all(|l| got.0[l] == (100 * k[l].min(4)) as f32 + l as f32), "{w:?} {got:?}");
    }
}
