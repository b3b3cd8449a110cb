//! Every width gives the same bits.

use super::exp::exp_neg;
use super::numbers::*;
use pelage_geom::registers::*;
use pelage_geom::rng;

struct Everything<'a>(&'a [[f32; LANES]; 2]);

impl Kernel for Everything<'_> {
    type Out = Vec<[u32; LANES]>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<[u32; LANES]> {
        let (a, b) = (L::read(&self.0[0]), L::read(&self.0[1]));
        let small = a.max(L::splat(0.0)).min(L::splat(65_535.0));
        let all = [
            a + b,
            a - b,
            a * b,
            a.max(b),
            a.min(b),
            small.whole().values(),
            short(a),
            exp_neg(small),
            exp_neg(b.max(L::splat(-80.0))),
            (small.bits() + b.bits().left::<23>()).numbers(),
        ];
        let mut out = vec![[0; LANES]; all.len() + 2];
        for (v, p) in all.iter().zip(&mut out) {
            let mut pack = [0.0; LANES];
            v.write(&mut pack);
            *p = pack.map(|v| if v.is_nan() { 0 } else { v.to_bits() });
        }
        small.whole().store(&mut out[all.len()]);
        deposits(short(b), small.whole().values(), &mut out[all.len() + 1]);
        out
    }
}

#[test]
fn every_width_gives_the_same_bits() {
    for step in 0..300 {
        let value = |k: u64| {
            let u = rng::uniform(7, k, 1, step) as f32;
            let scale = [1.0, 1e-40, 1e38, 100.0, -1.0, 3e4][(k + step) as usize % 6];
            let odd = [f32::INFINITY, f32::NAN, 0.0, -0.0];
            if u < 0.08 { odd[(u * 50.0) as usize] } else { (u - 0.3) * scale }
        };
        let packs: [[f32; LANES]; 2] = std::array::from_fn(|i| std::array::from_fn(|l| value((i * LANES + l) as u64)));
        let plain = run_at(Width::Plain, Everything(&packs));
        for width in Width::ALL {
            assert_eq!(run_at(width, Everything(&packs)), plain, "{width:?} at step {step}");
        }
    }
}

#[test]
fn deposits_keep_place_and_depth() {
    let depth: [f32; LANES] = std::array::from_fn(|i| libm::exp2f(i as f32 * 2.1 - 24.0) * 1.2345);
    let place: [f32; LANES] = std::array::from_fn(|i| (i * 4369) as f32);
    let mut word = [0; LANES];
    let kept_depth = short(Plain::read(&depth));
    deposits(kept_depth, Plain::read(&place), &mut word);
    let mut kept = [0.0; LANES];
    kept_depth.write(&mut kept);
    for i in 0..LANES {
        assert_eq!((place_of(word[i]), depth_of(word[i])), (i * 4369, kept[i]));
        assert!((kept[i] / depth[i].min(255.0) - 1.0).abs() < 2.5e-4, "{} {}", depth[i], kept[i]);
    }
}
