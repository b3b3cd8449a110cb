//! Wind without simulation: a noise moves the points of hairs (production-pipeline paper §4.3), more toward the tip, and
//! their lengths stay.

use super::axes::Beside;
use super::lanes::{Block, F, LANES, V, perlin3};
use super::perlin::key;
use super::{CHUNK, Param, V3, lanes};
use rayon::prelude::*;

/// How far a gust at a hair's tip is behind one at its root, in gusts: bends run along the hair. At 0 hair moves as a
/// stiff whole; above about 1 long hair ripples like a flag.
const LAG: f32 = 0.35;

/// Wind at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Wind<'a> {
    /// How far the tip is moved on average, scene units.
    pub amplitude: Param<'a>,
    /// Where it blows to, in the world; its length does not matter.
    pub direction: [f32; 3],
    /// Gusts that pass a place in a second.
    pub frequency: f32,
    /// Size of a gust, scene units.
    pub size: f32,
    /// How much gusts change the wind, 0 to 1: at 0 it is steady.
    pub gust: f32,
    /// Seconds.
    pub time: f64,
    /// \[N\] rest roots, scene units.
    pub root: &'a [[f32; 3]],
    /// Keys the noise.
    pub seed: u64,
    /// Names it.
    pub channel: u64,
}

/// Blows at hairs of `points` points. Roots and lengths stay; a hair of amplitude 0 keeps its bytes.
pub fn wind(points: usize, w: &Wind, position: &mut [[f32; 3]]) {
    let along = V3::from(w.direction);
    if along.norm() == 0.0 {
        return;
    }
    let along = along.normalize();
    let smallest = along.iamin();
    let across = along.cross(&V3::ith(smallest, 1.0)).normalize();
    let noise = key(w.seed, 0, w.channel);
    // Gusts travel with the wind (frozen turbulence): one of their size passes in 1 / frequency.
    let gone = along * (f64::from(w.frequency) * w.time) as f32;
    let all = |v: V3| V([F::splat(v.x), F::splat(v.y), F::splat(v.z)]);
    let (down, side, gone) = (all(along), all(across), all(gone));
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, out)| {
        let (mut arc, mut block) = (Beside::default(), Block::default());
        for (b, hairs) in out.chunks_mut(LANES * points).enumerate() {
            let lane = lanes(chunk * CHUNK + b * LANES, hairs.len() / points);
            let amplitude = lane.map(|h| w.amplitude.of(h));
            if amplitude == [0.0; LANES] {
                continue;
            }
            block.load(points, hairs);
            arc.set_arc(&block);
            let here = V::gather(|l| w.root[lane[l]].map(|x| x / w.size)) - gone;
            for k in 1..points {
                let l = F::splat(k as f32 / (points - 1) as f32);
                let [a, b] = perlin3(noise, here - down.times(l * F::splat(LAG)));
                let size = F::from(amplitude) * l * l;
                // Wind does not turn back between gusts.
                let force = (F::splat(1.0) + a * F::splat(w.gust)).fast_max(F::splat(0.0));
                let push = down.times(size * force);
                block.point[k] = block.point[k] + push + side.times(size * b * F::splat(0.5 * w.gust));
            }
            block.relay(&arc.arc);
            block.store(points, amplitude.map(|a| a != 0.0), hairs);
        }
    });
}
