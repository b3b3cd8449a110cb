//! Waviness and noise of the streamlines paper (§4.3, §4.4): a wave across the hair whose amplitude and frequency run
//! through four stations, all of it decided by one number r of the hair, its root variable.
//!
//! `W(l) = A(l) sin(Phi + T(l) l)` along each of the two axes (equation 11), `N(l) = A(l) noise(Phi + T(l) l)` (16), with l
//! from 0 at the root to 1 at the tip, A and T Catmull-Rom curves through stations at 1/4, 1/2, 3/4 and 1 (12). A is 0 at
//! the root; T, for which the paper names no fifth value, is there what it is at the first station. Each station's value is
//! `mean + deviation random(scale r)` with Perlin's noise for `random` (13 to 15), so random(0) = 0.

use super::axes::{Beside, RootAxes};
use super::lanes::{Bits, Block, Group, Kernel, LANES, Lanes, Pack, V, perlin1 as lanes_perlin1, run, sin_cos_turn};
use super::perlin::{key, perlin1, perlin3};
use super::vary::Drawn;
use super::{CHUNK, Param, station_weights};
use pelage_geom::TiledMap;
use pelage_geom::rng::{channel, uniform};
use rayon::prelude::*;

/// A value at four stations as a function of the root variable.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stations {
    /// At r = 0, and on average.
    pub mean: [f32; 4],
    /// How far the value goes up and down with r.
    pub deviation: [f32; 4],
    /// How fast: a high value makes neighbours independent, a low one makes it change smoothly over the map.
    pub scale: [f32; 4],
}

impl Stations {
    /// Values for root variable `r`; `key` names what they are of.
    pub fn at(&self, key: u32, r: f32) -> [f32; 4] {
        std::array::from_fn(|i| {
            let random = if self.deviation[i] == 0.0 { 0.0 } else { perlin1(key ^ (i as u32 + 1), r * self.scale[i]) };
            self.mean[i] + self.deviation[i] * random
        })
    }
}

/// The wave along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Axis {
    /// Scene units.
    pub amplitude: Stations,
    /// Turns over the hair's length (for noise: bumps).
    pub frequency: Stations,
    /// Turns at the root: mean, deviation, scale.
    pub phase: [f32; 3],
}

/// What stands for the sine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A sine: structured waves.
    Sine,
    /// Noise along the hair.
    Noise,
}

/// Waves of a layer.
#[derive(Clone, Copy, Debug)]
pub struct Waves<'a> {
    /// Sine or noise.
    pub shape: Shape,
    /// Along x and y (the paper's x and z).
    pub axis: [Axis; 2],
    /// Factor on both amplitudes.
    pub strength: Param<'a>,
    /// \[N\] root variable, see [`root_variable`].
    pub r: &'a [f32],
    /// Keep the lengths of segments; else waves make hair longer.
    pub keep_length: bool,
    /// \[N\] axes of the roots.
    pub axes: &'a [RootAxes],
    /// Keys the random functions.
    pub seed: u64,
    /// Names them: different for each set of waves of a layer.
    pub channel: u64,
}

/// Where the root variable comes from.
#[derive(Clone, Copy, Debug, Default)]
pub struct RootVariable<'a> {
    /// A painted map. Without one: 0, or smooth noise.
    pub map: Option<&'a TiledMap>,
    /// Without a map: distance over which it changes, scene units; 0 for the same everywhere.
    pub size: f32,
    /// Share of hairs that break away: theirs is a random number, whatever the map says.
    pub stray: f32,
    /// Name of the random numbers.
    pub channel: u64,
}

/// \[N\] root variables.
pub fn root_variable(hairs: &Drawn, v: &RootVariable) -> Vec<f32> {
    let smooth = key(hairs.seed, 0, v.channel);
    let one = |h: usize| {
        if v.stray > 0.0 && uniform(hairs.seed, hairs.id[h], v.channel, 0) < f64::from(v.stray) {
            return (1.0 - uniform(hairs.seed, hairs.id[h], v.channel, 1)) as f32;
        }
        match v.map {
            Some(m) => m.value(hairs.uv[h]),
            None if v.size > 0.0 => 0.5 + 0.25 * perlin3(smooth, hairs.position[h].map(|x| x / v.size))[0],
            None => 0.0,
        }
    };
    (0..hairs.id.len()).into_par_iter().with_min_len(CHUNK).map(one).collect()
}

/// Waves hairs of `points` points. Roots stay; a hair of strength 0 keeps its bytes.
pub fn wave(points: usize, w: &Waves, position: &mut [[f32; 3]]) {
    let stations = station_weights(5, points);
    let name = |what: &str, axis: usize| key(w.seed ^ channel(what), axis as u64, w.channel);
    let names: [[u32; 3]; 2] = std::array::from_fn(|a| [name("amplitude", a), name("frequency", a), name("phase", a)]);
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, hairs)| {
        let first = chunk * CHUNK;
        let own_of = |h: usize, a: usize| Own::new(&w.axis[a], names[a], w.r[h], w.strength.of(h));
        let own: Vec<[Own; 2]> = (first..first + hairs.len() / points).map(|h| [own_of(h, 0), own_of(h, 1)]).collect();
        run(Chunk { waves: w, own: &own, phase: [names[0][2], names[1][2]], stations: &stations, first, hairs });
    });
}

/// Hairs that one task handles.
struct Chunk<'a> {
    waves: &'a Waves<'a>,
    own: &'a [[Own; 2]],
    /// Names of the phases.
    phase: [u32; 2],
    /// Weights of the stations at each point.
    stations: &'a [Vec<f32>],
    /// The first hair's index.
    first: usize,
    hairs: &'a mut [[f32; 3]],
}

impl Kernel for Chunk<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (w, points) = (self.waves, self.stations.len());
        let (mut along, mut block) = (Beside::new(points), Block::new(points));
        let moves = |h: &usize| self.own[*h][0].amplitude != [0.0; 5] || self.own[*h][1].amplitude != [0.0; 5];
        let todo: Vec<usize> = (0..self.own.len()).filter(moves).collect();
        for hairs in todo.chunks(LANES) {
            let group = Group::new(self.first, hairs);
            let x = OwnLanes::<L>::new(self.own, 0, &group);
            let y = OwnLanes::<L>::new(self.own, 1, &group);
            block.load::<L>(self.hairs, &group);
            let total = along.set::<L>(&block, group.roots(w.axes)).max(L::splat(f32::MIN_POSITIVE));
            for (k, stations) in self.stations.iter().enumerate().skip(1) {
                let l = L::load(&along.arc[k]) / total;
                let x = V::load(&along.normal[k]).times(x.at(w.shape, self.phase[0], stations, l));
                let y = V::load(&along.binormal[k]).times(y.at(w.shape, self.phase[1], stations, l));
                (V::load(&block.point[k]) + x + y).store(&mut block.point[k]);
            }
            if w.keep_length {
                block.relay::<L>(&along.arc);
            }
            block.store::<L>(&group, self.hairs);
        }
    }
}

/// The wave of one hair along one axis, at five stations.
struct Own {
    amplitude: [f32; 5],
    frequency: [f32; 5],
    phase: f32,
}

impl Own {
    fn new(axis: &Axis, [amplitude, frequency, phase]: [u32; 3], r: f32, strength: f32) -> Self {
        let a = axis.amplitude.at(amplitude, r).map(|x| x * strength);
        let t = axis.frequency.at(frequency, r);
        let [mean, deviation, scale] = axis.phase;
        Own {
            amplitude: [0.0, a[0], a[1], a[2], a[3]],
            frequency: [t[0], t[0], t[1], t[2], t[3]],
            phase: mean + deviation * perlin1(phase, r * scale),
        }
    }
}

/// [`Own`] in lanes.
struct OwnLanes<L> {
    amplitude: [L; 5],
    frequency: [L; 5],
    phase: L,
}

impl<L: Lanes> OwnLanes<L> {
    #[inline(always)]
    fn new(own: &[[Own; 2]], axis: usize, group: &Group) -> Self {
        let (mut amplitude, mut frequency, mut phase) = ([Pack::default(); 5], [Pack::default(); 5], Pack::default());
        for l in 0..LANES {
            let own = &own[group.lane[l]][axis];
            for s in 0..5 {
                amplitude[s].0[l] = own.amplitude[s];
                frequency[s].0[l] = own.frequency[s];
            }
            phase.0[l] = own.phase;
        }
        let zero = L::splat(0.0);
        let mut out = OwnLanes { amplitude: [zero; 5], frequency: [zero; 5], phase: L::load(&phase) };
        for s in 0..5 {
            out.amplitude[s] = L::load(&amplitude[s]);
            out.frequency[s] = L::load(&frequency[s]);
        }
        out
    }

    #[inline(always)]
    fn at(&self, shape: Shape, key: u32, stations: &[f32], l: L) -> L {
        let turns = self.phase + sum(&self.frequency, stations) * l;
        let wave = match shape {
            Shape::Sine => sin_cos_turn(turns).0,
            Shape::Noise => lanes_perlin1(L::Bits::splat(key ^ 0x5bd1_e995), turns),
        };
        sum(&self.amplitude, stations) * wave
    }
}

/// Sum of stations' values by weights.
#[inline(always)]
fn sum<L: Lanes>(values: &[L; 5], weights: &[f32]) -> L {
    let mut sum = L::splat(0.0);
    for (v, w) in values.iter().zip(weights) {
        sum = sum + *v * L::splat(*w);
    }
    sum
}
