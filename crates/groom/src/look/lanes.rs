//! Hairs side by side, one a lane: the same arithmetic in every lane, so the same bytes as one by one.
//!
//! All of it is inlined into kernels ([`run`]), which are compiled once for each width.

// Arrays of lanes are walked side by side.
#![allow(clippy::needless_range_loop)]

use super::Param;
use super::axes::RootAxes;
use pelage_geom::registers;
pub(crate) use pelage_geom::registers::{Bits, Kernel, LANES, Lanes, Pack, run};
use std::ops::{Add, Sub};

/// Asks for numbers that are read soon. What comes after the first lines of the cache, the processor fetches by itself.
#[inline(always)]
pub(crate) fn fetch(numbers: &[f32]) {
    for line in numbers.chunks(LANES).take(4) {
        registers::fetch(line.first());
    }
}

/// A vector in every lane, as it lies in memory.
pub(crate) type Pack3 = [Pack; 3];

/// A vector in every lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct V<L>(pub [L; 3]);

impl<L: Lanes> Add for V<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        V([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<L: Lanes> Sub for V<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        V([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<L: Lanes> V<L> {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(v: [f32; 3]) -> Self {
        V([L::splat(v[0]), L::splat(v[1]), L::splat(v[2])])
    }

    /// From memory.
    #[inline(always)]
    pub fn load(p: &Pack3) -> Self {
        V([L::load(&p[0]), L::load(&p[1]), L::load(&p[2])])
    }

    /// To memory.
    #[inline(always)]
    pub fn store(self, p: &mut Pack3) {
        self.0[0].store(&mut p[0]);
        self.0[1].store(&mut p[1]);
        self.0[2].store(&mut p[2]);
    }

    #[inline(always)]
    pub fn times(self, s: L) -> Self {
        V([self.0[0] * s, self.0[1] * s, self.0[2] * s])
    }

    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }

    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        V([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// In each lane `x` if `a > b`, else `y`.
    #[inline(always)]
    pub fn if_gt(a: L, b: L, x: Self, y: Self) -> Self {
        let ([p, q, r], [s, t, u]) = (x.0, y.0);
        V([L::if_gt(a, b, p, s), L::if_gt(a, b, q, t), L::if_gt(a, b, r, u)])
    }
}

/// Sets the vector of a lane.
#[inline(always)]
pub(crate) fn set(p: &mut Pack3, lane: usize, v: [f32; 3]) {
    p[0].0[lane] = v[0];
    p[1].0[lane] = v[1];
    p[2].0[lane] = v[2];
}

/// Hairs that are handled together; lanes without a hair repeat the last.
pub(crate) struct Group {
    /// Their indices among those of the task.
    pub lane: [usize; LANES],
    /// Index of the task's first hair.
    first: usize,
    /// Lanes whose hairs are written back.
    pub used: [bool; LANES],
}

impl Group {
    /// At least one and at most as many `hairs` of a task as there are lanes; `first` is the index of the task's first.
    #[inline(always)]
    pub fn new(first: usize, hairs: &[usize]) -> Self {
        let mut group = Group { lane: [hairs[hairs.len() - 1]; LANES], first, used: [false; LANES] };
        group.lane[..hairs.len()].copy_from_slice(hairs);
        group.used[..hairs.len()].fill(true);
        group
    }

    /// Index of a lane's hair.
    #[inline(always)]
    pub fn hair(&self, lane: usize) -> usize {
        self.first + self.lane[lane]
    }

    /// Their values of a parameter.
    #[inline(always)]
    pub fn param<L: Lanes>(&self, p: &Param) -> L {
        if p.factor.is_empty() && p.shift.is_empty() {
            return L::splat(p.of(0));
        }
        let mut out = Pack::default();
        for l in 0..LANES {
            out.0[l] = p.of(self.hair(l));
        }
        L::load(&out)
    }

    /// Their vectors.
    #[inline(always)]
    pub fn vectors<L: Lanes>(&self, all: &[[f32; 3]]) -> V<L> {
        let mut p = Pack3::default();
        for l in 0..LANES {
            set(&mut p, l, all[self.hair(l)]);
        }
        V::load(&p)
    }

    /// Axes of their roots: tangents and normals.
    #[inline(always)]
    pub fn roots<L: Lanes>(&self, axes: &[RootAxes]) -> [V<L>; 2] {
        let (mut tangent, mut normal) = (Pack3::default(), Pack3::default());
        for l in 0..LANES {
            let a = &axes[self.hair(l)];
            set(&mut tangent, l, a.tangent);
            set(&mut normal, l, a.normal);
        }
        [V::load(&tangent), V::load(&normal)]
    }
}

/// Largest magnitude whose whole part is taken: beyond it single precision has hardly a fraction.
const WHOLE: f32 = 4e6;

/// 1.5 times 2^23: what is added to it is rounded to a whole number, which its last bits then hold.
const ROUND: f32 = 12_582_912.0;

/// Whole part as the bits of an integer, and the fraction, within 0 and 1 also where x is too large to have one.
#[inline(always)]
fn cell<L: Lanes>(x: L) -> (L::Bits, L) {
    let (whole, near) = floor(x);
    (whole, (x - near).max(L::splat(0.0)).min(L::splat(1.0)))
}

/// Whole part, as the bits of an integer and as a number; nothing useful for what is not a number.
#[inline(always)]
fn floor<L: Lanes>(x: L) -> (L::Bits, L) {
    let (zero, one, round) = (L::splat(0.0), L::splat(1.0), L::splat(ROUND));
    let x = x.max(L::splat(-WHOLE)).min(L::splat(WHOLE));
    let near = (x + round) - round;
    let floor = near - L::if_gt(near, x, one, zero);
    let whole = (floor + round).bits() + L::Bits::splat(ROUND.to_bits().wrapping_neg());
    (whole, floor)
}

/// (sin, cos) of `2 pi x`, error below 2e-7 for small x. Only additions and products: the same on every machine.
#[inline(always)]
pub(crate) fn sin_cos_turn<L: Lanes>(x: L) -> (L, L) {
    // Quarter turn and what is left, within an eighth of a turn.
    let (q, quarter) = floor(x * L::splat(4.0) + L::splat(0.5));
    // Bounded for what is too large to have a fraction.
    let left = (x - quarter * L::splat(0.25)).max(L::splat(-0.125)).min(L::splat(0.125));
    let a = left * L::splat(std::f32::consts::TAU);
    let a2 = a * a;
    let (one, c3, c5) = (L::splat(1.0), L::splat(-1.0 / 6.0), L::splat(1.0 / 120.0));
    let (c7, c9) = (L::splat(-1.0 / 5040.0), L::splat(1.0 / 362_880.0));
    let s = a * (one + a2 * (c3 + a2 * (c5 + a2 * (c7 + a2 * c9))));
    let (c2, c4) = (L::splat(-0.5), L::splat(1.0 / 24.0));
    let (c6, c8) = (L::splat(-1.0 / 720.0), L::splat(1.0 / 40_320.0));
    let k = one + a2 * (c2 + a2 * (c4 + a2 * (c6 + a2 * c8)));
    let (sin, cos) = (q.if_odd(k, s), q.if_odd(s, k));
    let two = L::Bits::splat(2);
    let sin_sign = (q & two).left::<30>();
    let cos_sign = ((q + L::Bits::splat(1)) & two).left::<30>();
    ((sin.bits() ^ sin_sign).numbers(), (cos.bits() ^ cos_sign).numbers())
}

#[inline(always)]
fn mix<L: Lanes<Bits = B>, B: Bits<L>>(x: B) -> B {
    let x = (x ^ x.right::<16>()) * B::splat(0x7feb_352d);
    let x = (x ^ x.right::<15>()) * B::splat(0x846c_a68b);
    x ^ x.right::<16>()
}

#[inline(always)]
fn fade<L: Lanes>(t: L) -> L {
    t * t * t * (t * (t * L::splat(6.0) - L::splat(15.0)) + L::splat(10.0))
}

/// A slope of -1 to 1 from a hash.
#[inline(always)]
fn slope<L: Lanes>(key: L::Bits, i: L::Bits) -> L {
    let hash = mix::<L, _>(key ^ (i * L::Bits::splat(0x9e37_79b9)));
    // A number from 1 to 2 of which the hash gives the fraction.
    let unit = (hash.right::<9>() | L::Bits::splat(0x3f80_0000)).numbers();
    unit * L::splat(2.0) - L::splat(3.0)
}

/// [`super::perlin::perlin1`] with a key for every lane.
#[inline(always)]
pub(crate) fn perlin1<L: Lanes>(key: L::Bits, x: L) -> L {
    let (i, t) = cell(x);
    let a = slope::<L>(key, i) * t;
    let b = slope::<L>(key, i + L::Bits::splat(1)) * (t - L::splat(1.0));
    L::splat(2.0) * (a + (b - a) * fade(t))
}

/// A slope of -1 to 1 from the five bits of a hash that stand before the last 18.
#[inline(always)]
fn coarse<L: Lanes>(bits: L::Bits) -> L {
    let unit = ((bits & L::Bits::splat(31 << 18)) | L::Bits::splat(0x3f80_0000)).numbers();
    (unit - L::splat(1.484_375)) * L::splat(64.0 / 31.0)
}

/// [`super::perlin::perlin3`].
#[inline(always)]
pub(crate) fn perlin3<L: Lanes>(key: u32, p: V<L>) -> [L; 2] {
    let (one, next, key) = (L::splat(1.0), L::Bits::splat(1), L::Bits::splat(key));
    let [(i, u), (j, v), (k, w)] = [cell(p.0[0]), cell(p.0[1]), cell(p.0[2])];
    let t = [u, v, w];
    let w = [fade(t[0]), fade(t[1]), fade(t[2])];
    // What the sides of the cell share is hashed once.
    let (p, q, r) = (L::Bits::splat(0x9e37_79b9), L::Bits::splat(0x85eb_ca77), L::Bits::splat(0xc2b2_ae3d));
    let xs = [i * p, (i + next) * p];
    let ys = [mix::<L, _>(j * q), mix::<L, _>((j + next) * q)];
    let zs = [k * r, (k + next) * r];
    let zs = [zs[0].left::<16>() | zs[0].right::<16>(), zs[1].left::<16>() | zs[1].right::<16>()];
    let side = [[one - w[0], w[0]], [one - w[1], w[1]], [one - w[2], w[2]]];
    let from = [[t[0], t[0] - one], [t[1], t[1] - one], [t[2], t[2] - one]];
    let mut sum = [L::splat(0.0); 2];
    for corner in 0..8 {
        let (x, y, z) = (corner & 1, (corner >> 1) & 1, corner >> 2);
        let h = mix::<L, _>(key ^ xs[x] ^ ys[y] ^ zs[z]);
        let weight = side[0][x] * side[1][y] * side[2][z];
        let (dx, dy, dz) = (from[0][x], from[1][y], from[2][z]);
        let [a, b, c] = [coarse::<L>(h.left::<18>()), coarse::<L>(h.left::<13>()), coarse::<L>(h.left::<8>())];
        sum[0] = sum[0] + weight * (a * dx + b * dy + c * dz);
        let [a, b, c] = [coarse::<L>(h.left::<3>()), coarse::<L>(h.right::<2>()), coarse::<L>(h.right::<7>())];
        sum[1] = sum[1] + weight * (a * dx + b * dy + c * dz);
    }
    let scale = L::splat(1.0 / super::perlin::RMS3);
    [sum[0] * scale, sum[1] * scale]
}

/// Where the tiles begin that `n` numbers of a hair are handled in, as many numbers as there are lanes; the last overlaps
/// the one before it. None where a hair is shorter than a tile.
#[inline(always)]
fn tiles(n: usize) -> impl Iterator<Item = usize> {
    let count = if n < LANES { 0 } else { n.div_ceil(LANES) };
    (0..count).map(move |i| (i * LANES).min(n - LANES))
}

/// Hairs side by side: point k of all lanes.
#[derive(Debug)]
pub(crate) struct Block {
    pub point: Vec<Pack3>,
}

impl Block {
    /// Room for hairs of `points` points.
    pub fn new(points: usize) -> Self {
        Block { point: vec![Pack3::default(); points] }
    }

    /// Takes the group's hairs from those of the task.
    #[inline(always)]
    pub fn load<L: Lanes>(&mut self, hairs: &[[f32; 3]], group: &Group) {
        let (row, hairs) = (self.point.as_flattened_mut(), hairs.as_flattened());
        let n = row.len();
        let hair = |l: usize| group.lane[l] * n;
        for first in tiles(n) {
            let mut tile = [L::splat(0.0); LANES];
            for l in 0..LANES {
                tile[l] = L::read(hairs[hair(l) + first..].first_chunk().expect("a tile lies within its hair"));
            }
            let tile = L::turned(tile);
            let row = &mut row[first..first + LANES];
            for k in 0..LANES {
                tile[k].store(&mut row[k]);
            }
        }
        if n < LANES {
            for l in 0..LANES {
                for (row, x) in row.iter_mut().zip(&hairs[hair(l)..][..n]) {
                    row.0[l] = *x;
                }
            }
        }
    }

    /// Writes the group's hairs back.
    #[inline(always)]
    pub fn store<L: Lanes>(&self, group: &Group, hairs: &mut [[f32; 3]]) {
        let (row, hairs) = (self.point.as_flattened(), hairs.as_flattened_mut());
        let n = row.len();
        let hair = |l: usize| group.lane[l] * n;
        for first in tiles(n) {
            let (mut tile, row) = ([L::splat(0.0); LANES], &row[first..first + LANES]);
            for k in 0..LANES {
                tile[k] = L::load(&row[k]);
            }
            let tile = L::turned(tile);
            for l in 0..LANES {
                if group.used[l] {
                    let to = hairs[hair(l) + first..].first_chunk_mut().expect("a tile lies within its hair");
                    tile[l].write(to);
                }
            }
        }
        if n < LANES {
            for l in (0..LANES).filter(|l| group.used[*l]) {
                for (row, x) in row.iter().zip(&mut hairs[hair(l)..][..n]) {
                    *x = row.0[l];
                }
            }
        }
    }

    /// Lays hairs out again from their roots with the segment lengths that `arc` (the length up to each point) says; a
    /// segment without a direction keeps the one before it.
    #[inline(always)]
    pub fn relay<L: Lanes>(&mut self, arc: &[Pack]) {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let mut before = V::<L>::load(&self.point[0]);
        let (mut at, mut last, mut arc_before) = (before, V([zero; 3]), L::load(&arc[0]));
        for (p, arc) in self.point.iter_mut().zip(arc).skip(1) {
            let (here, arc) = (V::load(p), L::load(arc));
            let d = here - before;
            let n = d.dot(d).sqrt();
            last = V::if_gt(n, zero, d.times(one / n), last);
            before = here;
            at = at + last.times(arc - arc_before);
            arc_before = arc;
            at.store(p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::perlin;
    use super::*;

    /// What a function of lanes makes of numbers in memory.
    struct Of<'a> {
        key: &'a [u32; LANES],
        x: &'a Pack,
        p: &'a Pack3,
    }

    #[derive(Debug)]
    struct Found {
        sin: [f32; LANES],
        cos: [f32; LANES],
        perlin1: [f32; LANES],
        perlin3: [[f32; LANES]; 2],
    }

    impl Kernel for Of<'_> {
        type Out = Found;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Found {
            let x = L::load(self.x);
            let (sin, cos) = sin_cos_turn(x);
            let [a, b] = perlin3(self.key[0], V::<L>::load(self.p));
            let all = [sin, cos, perlin1(L::Bits::load(self.key), x), a, b];
            let mut out = [Pack::default(); 5];
            for i in 0..5 {
                all[i].store(&mut out[i]);
            }
            let [sin, cos, perlin1, a, b] = out.map(|p| p.0);
            Found { sin, cos, perlin1, perlin3: [a, b] }
        }
    }

    fn found(key: [u32; LANES], x: [f32; LANES], p: Pack3) -> Found {
        run(Of { key: &key, x: &Pack(x), p: &p })
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_library() {
        for i in -4000..4000 {
            let x: [f32; LANES] = std::array::from_fn(|l| i as f32 * 0.002_37 + l as f32 * 0.1);
            let f = found([0; LANES], x, Pack3::default());
            for (l, x) in x.iter().enumerate() {
                let a = f64::from(*x) * std::f64::consts::TAU;
                let off = (f64::from(f.sin[l]) - libm::sin(a)).abs() + (f64::from(f.cos[l]) - libm::cos(a)).abs();
                assert!(off < 2e-6, "{x}");
            }
        }
        let some = [0.0, 1e30, f32::INFINITY, f32::NAN, -1e9, 3e7, f32::MAX, -f32::INFINITY];
        let wild: [f32; LANES] = std::array::from_fn(|l| some[l % some.len()]);
        let f = found([3; LANES], wild, [Pack(wild); 3]);
        assert_eq!((f.sin[0], f.cos[0]), (0.0, 1.0));
        let bounded = |v: [f32; LANES]| v.iter().zip(&wild).all(|(y, x)| x.is_nan() || y.abs() < 10.0);
        assert!([f.sin, f.cos, f.perlin1, f.perlin3[0]].into_iter().all(bounded), "{f:?}");
    }

    #[test]
    fn noise_in_lanes_is_noise_one_by_one() {
        for i in 0..2000u64 {
            let r = |k: u64| (pelage_geom::rng::uniform(2, i, k, 0) * 60.0 - 30.0) as f32;
            let key: [u32; LANES] = std::array::from_fn(|l| perlin::key(1, i, l as u64));
            let x: [f32; LANES] = std::array::from_fn(|l| r(l as u64));
            let p: Pack3 = std::array::from_fn(|x| Pack(std::array::from_fn(|l| r((LANES + 3 * l + x) as u64))));
            let f = found(key, x, p);
            for l in 0..LANES {
                assert_eq!(f.perlin1[l], perlin::perlin1(key[l], x[l]), "{x:?}");
                let plain = perlin::perlin3(key[0], [p[0].0[l], p[1].0[l], p[2].0[l]]);
                let off = |n: usize| (f.perlin3[n][l] - plain[n]).abs();
                assert!(off(0) < 1e-5 && off(1) < 1e-5);
            }
        }
    }

    #[test]
    fn a_block_gives_back_what_it_took() {
        struct Through<'a>(&'a Group, &'a [[f32; 3]], &'a mut [[f32; 3]], usize);
        impl Kernel for Through<'_> {
            type Out = Block;
            #[inline(always)]
            fn run<L: Lanes>(self) -> Block {
                let mut block = Block::new(self.3);
                block.load::<L>(self.1, self.0);
                block.store::<L>(self.0, self.2);
                let mut arc = vec![Pack::default(); self.3];
                for k in 0..self.3 {
                    arc[k] = Pack([2.0 * k as f32; LANES]);
                }
                block.relay::<L>(&arc);
                block
            }
        }
        for points in [2, 5, 6, 12, 23] {
            let hairs: Vec<[f32; 3]> = (0..3 * points).map(|i| [i as f32, 1.0, -0.0]).collect();
            let mut group = Group::new(0, &[0, 1, 2]);
            group.used[1] = false;
            let mut out = vec![[9.0; 3]; 3 * points];
            let block = run(Through(&group, &hairs, &mut out, points));
            let (first, last) = (0..points, 2 * points..3 * points);
            assert!(out[first.clone()] == hairs[first] && out[last.clone()] == hairs[last], "{points}");
            assert!(out[points..2 * points].iter().all(|p| *p == [9.0; 3]));
            let along = |x: usize, l: usize| block.point[points - 1][x].0[l] - block.point[0][x].0[l];
            let length = 2.0 * (points - 1) as f32;
            assert!((0..LANES).all(|l| (along(0, l) - length).abs() < 1e-5 && along(1, l) == 0.0));
        }
    }
}
