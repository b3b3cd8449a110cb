//! Eight hairs at a time, one a lane: the same arithmetic in every lane, so the same bytes as one by one.

use std::ops::{Add, Sub};
use wide::bytemuck;
use wide::{f32x8, u32x8};

/// Hairs that are handled together.
pub(crate) const LANES: usize = 8;

pub(crate) type F = f32x8;
pub(crate) type U = u32x8;

/// A vector in every lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct V(pub [F; 3]);

impl Add for V {
    type Output = V;
    #[inline(always)]
    fn add(self, o: V) -> V {
        V([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl Sub for V {
    type Output = V;
    #[inline(always)]
    fn sub(self, o: V) -> V {
        V([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl V {
    /// A vector for every lane.
    #[inline(always)]
    pub fn gather(of: impl Fn(usize) -> [f32; 3]) -> V {
        let v = [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)];
        let all = |x: usize| F::from([v[0][x], v[1][x], v[2][x], v[3][x], v[4][x], v[5][x], v[6][x], v[7][x]]);
        V([all(0), all(1), all(2)])
    }

    #[inline(always)]
    pub fn times(self, s: F) -> V {
        V([self.0[0] * s, self.0[1] * s, self.0[2] * s])
    }

    #[inline(always)]
    pub fn dot(self, o: V) -> F {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }

    #[inline(always)]
    pub fn cross(self, o: V) -> V {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        V([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// `self` where `mask` is set, else `other`.
    #[inline(always)]
    pub fn or(self, mask: F, other: V) -> V {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        V([mask.bitselect(a, x), mask.bitselect(b, y), mask.bitselect(c, z)])
    }
}

/// A number for every lane.
#[inline(always)]
pub(crate) fn gather(of: impl Fn(usize) -> f32) -> F {
    F::from([of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)])
}

/// Largest magnitude whose whole part is taken: beyond it single precision has hardly a fraction.
const WHOLE: f32 = 4e6;

/// 1.5 times 2^23: what is added to it is rounded to a whole number, which its last bits then hold.
const ROUND: f32 = 12_582_912.0;

/// Whole part as the bits of an integer, and the fraction, within 0 and 1 also where x is too large to have one.
#[inline(always)]
fn cell(x: F) -> (U, F) {
    let (whole, near) = floor(x);
    (whole, (x - near).fast_max(F::splat(0.0)).fast_min(F::splat(1.0)))
}

/// Whole part, as the bits of an integer and as a number; nothing useful for what is not a number.
#[inline(always)]
fn floor(x: F) -> (U, F) {
    let x = x.fast_max(F::splat(-WHOLE)).fast_min(F::splat(WHOLE));
    let shifted = x + F::splat(ROUND);
    let near = shifted - F::splat(ROUND);
    let above = near.simd_gt(x);
    // All bits set is -1.
    let whole = bytemuck::cast::<F, U>(shifted) - U::splat(ROUND.to_bits()) + bytemuck::cast::<F, U>(above);
    (whole, near - (above & F::splat(1.0)))
}

/// (sin, cos) of `2 pi x`, error below 2e-7 for small x. Only additions and products: the same on every machine.
#[inline(always)]
pub(crate) fn sin_cos_turn(x: F) -> (F, F) {
    // Quarter turn and what is left, within an eighth of a turn.
    let (q, quarter) = floor(x * F::splat(4.0) + F::splat(0.5));
    // Bounded for what is too large to have a fraction.
    let eighth = F::splat(0.125);
    let left = (x - quarter * F::splat(0.25)).fast_max(-eighth).fast_min(eighth);
    let a = left * F::splat(std::f32::consts::TAU);
    let a2 = a * a;
    let c = |v: f32| F::splat(v);
    let s =
        a * (c(1.0) + a2 * (c(-1.0 / 6.0) + a2 * (c(1.0 / 120.0) + a2 * (c(-1.0 / 5040.0) + a2 * c(1.0 / 362_880.0)))));
    let k = c(1.0) + a2 * (c(-0.5) + a2 * (c(1.0 / 24.0) + a2 * (c(-1.0 / 720.0) + a2 * c(1.0 / 40_320.0))));
    let odd: F = bytemuck::cast(U::splat(0) - (q & U::splat(1)));
    let (sin, cos) = (odd.bitselect(k, s), odd.bitselect(s, k));
    let sign = |q: U| -> F { bytemuck::cast((q & U::splat(2)) << 30) };
    (sin ^ sign(q), cos ^ sign(q + U::splat(1)))
}

#[inline(always)]
fn mix(x: U) -> U {
    let x = (x ^ (x >> 16)) * U::splat(0x7feb_352d);
    let x = (x ^ (x >> 15)) * U::splat(0x846c_a68b);
    x ^ (x >> 16)
}

#[inline(always)]
fn fade(t: F) -> F {
    t * t * t * (t * (t * F::splat(6.0) - F::splat(15.0)) + F::splat(10.0))
}

/// [`super::perlin::perlin1`] with a key for every lane.
#[inline(always)]
pub(crate) fn perlin1(key: U, x: F) -> F {
    let (i, t) = cell(x);
    // A number from 1 to 2 of which the hash gives the fraction.
    let slope = |i: U| {
        let hash = mix(key ^ (i * U::splat(0x9e37_79b9)));
        let unit: F = bytemuck::cast((hash >> 9) | U::splat(0x3f80_0000));
        unit * F::splat(2.0) - F::splat(3.0)
    };
    let (a, b) = (slope(i) * t, slope(i + U::splat(1)) * (t - F::splat(1.0)));
    F::splat(2.0) * (a + (b - a) * fade(t))
}

/// [`super::perlin::perlin3`].
#[inline(always)]
pub(crate) fn perlin3(key: u32, p: V) -> [F; 2] {
    let one = F::splat(1.0);
    let [(i, u), (j, v), (k, w)] = [cell(p.0[0]), cell(p.0[1]), cell(p.0[2])];
    let t = [u, v, w];
    let w = [fade(t[0]), fade(t[1]), fade(t[2])];
    // What the sides of the cell share is hashed once.
    let next = U::splat(1);
    let (p, q, r) = (U::splat(0x9e37_79b9), U::splat(0x85eb_ca77), U::splat(0xc2b2_ae3d));
    let half = |z: U| (z << 16) | (z >> 16);
    let xs = [i * p, (i + next) * p];
    let ys = [mix(j * q), mix((j + next) * q)];
    let zs = [half(k * r), half((k + next) * r)];
    let side = [[one - w[0], w[0]], [one - w[1], w[1]], [one - w[2], w[2]]];
    let from = [[t[0], t[0] - one], [t[1], t[1] - one], [t[2], t[2] - one]];
    let mut sum = [F::splat(0.0); 2];
    for corner in 0..8 {
        let (x, y, z) = (corner & 1, (corner >> 1) & 1, corner >> 2);
        let hash = mix(U::splat(key) ^ xs[x] ^ ys[y] ^ zs[z]);
        let weight = side[0][x] * side[1][y] * side[2][z];
        let slope = |bits: U| {
            let unit: F = bytemuck::cast((bits & U::splat(31 << 18)) | U::splat(0x3f80_0000));
            (unit - F::splat(1.484_375)) * F::splat(64.0 / 31.0)
        };
        let (dx, dy, dz) = (from[0][x], from[1][y], from[2][z]);
        sum[0] += weight * (slope(hash << 18) * dx + slope(hash << 13) * dy + slope(hash << 8) * dz);
        sum[1] += weight * (slope(hash << 3) * dx + slope(hash >> 2) * dy + slope(hash >> 7) * dz);
    }
    let scale = F::splat(1.0 / super::perlin::RMS3);
    [sum[0] * scale, sum[1] * scale]
}

/// Hairs side by side: point k of all lanes.
#[derive(Debug, Default)]
pub(crate) struct Block {
    pub point: Vec<V>,
}

impl Block {
    /// Takes up to four hairs of `points` points; lanes without a hair repeat the last.
    pub fn load(&mut self, points: usize, hairs: &[[f32; 3]]) {
        let last = hairs.len() / points - 1;
        let at: [&[[f32; 3]]; LANES] = std::array::from_fn(|l| &hairs[l.min(last) * points..][..points]);
        self.point.clear();
        self.point.extend((0..points).map(|k| V::gather(|l| at[l][k])));
    }

    /// Writes back the hairs whose lane is `active`; roots stay.
    pub fn store(&self, points: usize, active: [bool; LANES], hairs: &mut [[f32; 3]]) {
        for (hair, l) in hairs.chunks_exact_mut(points).zip(0..LANES).filter(|(_, l)| active[*l]) {
            for (p, v) in hair.iter_mut().zip(&self.point).skip(1) {
                *p = [v.0[0].as_array()[l], v.0[1].as_array()[l], v.0[2].as_array()[l]];
            }
        }
    }

    /// Lengths of the hairs.
    pub fn length(&self) -> F {
        let mut sum = F::splat(0.0);
        for w in self.point.windows(2) {
            let d = w[1] - w[0];
            sum += d.dot(d).sqrt();
        }
        sum
    }

    /// Lays hairs out again from their roots with the segment lengths that `arc` (the length up to each point) says; a
    /// segment without a direction keeps the one before it.
    pub fn relay(&mut self, arc: &[F]) {
        let mut before = self.point[0];
        let (mut at, mut last) = (before, V::default());
        for k in 1..self.point.len() {
            let d = self.point[k] - before;
            let n = d.dot(d).sqrt();
            let moves = n.simd_gt(F::splat(0.0));
            last = d.times(F::splat(1.0) / n).or(moves, last);
            before = self.point[k];
            at = at + last.times(arc[k] - arc[k - 1]);
            self.point[k] = at;
        }
    }
}

/// `a` below `b`, as a mask.
#[inline(always)]
pub(crate) fn below(a: F, b: F) -> F {
    a.simd_lt(b)
}

#[cfg(test)]
mod tests {
    use super::super::perlin;
    use super::*;

    #[test]
    fn sine_and_cosine_are_those_of_the_library() {
        for i in -4000..4000 {
            let x: [f32; LANES] = std::array::from_fn(|l| i as f32 * 0.002_37 + l as f32 * 0.1);
            let (s, c) = sin_cos_turn(F::from(x));
            for (l, x) in x.iter().enumerate() {
                let a = f64::from(*x) * std::f64::consts::TAU;
                let off = (f64::from(s.to_array()[l]) - libm::sin(a)).abs()
                    + (f64::from(c.to_array()[l]) - libm::cos(a)).abs();
                assert!(off < 2e-6, "{x}");
            }
        }
        let wild = F::from([0.0, 1e30, f32::INFINITY, f32::NAN, -1e9, 3e7, f32::MAX, -f32::INFINITY]);
        let (s, c) = sin_cos_turn(wild);
        assert_eq!((s.to_array()[0], c.to_array()[0]), (0.0, 1.0));
        let noise = [perlin1(U::splat(3), wild), perlin3(3, V([wild; 3]))[0]];
        let bounded = |v: F| v.to_array().iter().enumerate().all(|(l, x)| l == 3 || x.abs() < 10.0);
        assert!([s, c].into_iter().chain(noise).all(bounded), "{s:?} {c:?} {noise:?}");
    }

    #[test]
    fn noise_in_lanes_is_noise_one_by_one() {
        for i in 0..2000u64 {
            let r = |k: u64| (pelage_geom::rng::uniform(2, i, k, 0) * 60.0 - 30.0) as f32;
            let key: [u32; LANES] = std::array::from_fn(|l| perlin::key(1, i, l as u64));
            let x: [f32; LANES] = std::array::from_fn(|l| r(l as u64));
            let one = perlin1(U::from(key), F::from(x)).to_array();
            assert!((0..LANES).all(|l| one[l] == perlin::perlin1(key[l], x[l])), "{x:?}");
            let p: [[f32; 3]; LANES] = std::array::from_fn(|l| std::array::from_fn(|x| r((8 + 3 * l + x) as u64)));
            let three = perlin3(key[0], V::gather(|l| p[l])).map(|v| v.to_array());
            for l in 0..LANES {
                let plain = perlin::perlin3(key[0], p[l]);
                assert!((three[0][l] - plain[0]).abs() < 1e-5 && (three[1][l] - plain[1]).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_block_gives_back_what_it_took() {
        let hairs: Vec<[f32; 3]> = (0..15).map(|i| [i as f32, 1.0, -0.0]).collect();
        let mut block = Block::default();
        block.load(5, &hairs);
        let mut out = vec![[9.0; 3]; 15];
        let mut active = [true; LANES];
        active[1] = false;
        block.store(5, active, &mut out);
        assert!(out[1..5] == hairs[1..5] && out[11..] == hairs[11..] && out[5..10].iter().all(|p| *p == [9.0; 3]));
        let arc: Vec<F> = (0..5).map(|k| F::splat(2.0 * k as f32)).collect();
        block.relay(&arc);
        assert!(block.length().to_array().iter().all(|l| (l - 8.0).abs() < 1e-5));
    }
}
