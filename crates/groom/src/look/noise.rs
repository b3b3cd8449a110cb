//! Noise and frizz: random offsets across the hair, smooth along it.

use super::axes::{Beside, RootAxes};
use super::lanes::{Block, F, LANES, U, V, perlin1, perlin3};
use super::perlin::key;
use super::{CHUNK, Param, lanes};
use crate::along::at_points;
use pelage_geom::StrandId;
use rayon::prelude::*;

/// Root mean square of [`super::perlin::perlin1`].
const RMS1: f32 = 0.281_39;

/// The way through noise in space that a hair takes: no lattice direction, so that no two of its cells are alike.
const WAY: [f32; 3] = [0.529, 0.671, 0.519];

/// Noise of a layer.
#[derive(Clone, Copy, Debug)]
pub struct Noise<'a> {
    /// Root mean square of the offset along each axis, scene units.
    pub amplitude: Param<'a>,
    /// Distance along the hair over which it changes, scene units. It fades in over this length from the root.
    pub size: f32,
    /// Distance over the skin over which it changes, scene units; 0: every hair by itself (frizz).
    pub across: f32,
    /// Factors at equally spaced stations from root to tip (at least two); empty for 1.
    pub profile: &'a [f32],
    /// Keep the lengths of segments; else noise makes hair longer.
    pub keep_length: bool,
    /// \[N\] names of the hairs.
    pub id: &'a [StrandId],
    /// \[N\] rest roots, scene units.
    pub root: &'a [[f32; 3]],
    /// \[N\] axes of the roots.
    pub axes: &'a [RootAxes],
    /// Keys the noise.
    pub seed: u64,
    /// Names it: different for each noise of a layer.
    pub channel: u64,
}

/// Adds noise to hairs of `points` points. Roots stay; a hair of amplitude 0 keeps its bytes.
pub fn noise(points: usize, n: &Noise, position: &mut [[f32; 3]]) {
    let profile = at_points(n.profile, points);
    let of_all = key(n.seed, 0, n.channel);
    let per_unit = 1.0 / n.size;
    let way = V([F::splat(WAY[0]), F::splat(WAY[1]), F::splat(WAY[2])]);
    let (one, three) = (F::splat(1.0), F::splat(3.0));
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, out)| {
        let (mut along, mut block) = (Beside::default(), Block::default());
        for (b, hairs) in out.chunks_mut(LANES * points).enumerate() {
            let lane = lanes(chunk * CHUNK + b * LANES, hairs.len() / points);
            let amplitude = lane.map(|h| n.amplitude.of(h));
            if amplitude == [0.0; LANES] {
                continue;
            }
            block.load(points, hairs);
            along.set(&block, lane.map(|h| &n.axes[h]));
            let own = U::from(lane.map(|h| key(n.seed, n.id[h], n.channel)));
            let root = V::gather(|l| n.root[lane[l]].map(|x| x / n.across));
            let amplitude_of = F::from(amplitude);
            for k in 1..points {
                let t = along.arc[k] * F::splat(per_unit);
                let f = t.fast_min(one);
                let size = amplitude_of * f * f * (three - f - f) * F::splat(*profile.get(k).unwrap_or(&1.0));
                let [x, y] = if n.across > 0.0 {
                    perlin3(of_all, root + way.times(t))
                } else {
                    // Half a cell apart, so that they are not both 0 at the same places.
                    let (x, y) = (perlin1(own, t), perlin1(!own, t + F::splat(0.5)));
                    [x * F::splat(1.0 / RMS1), y * F::splat(1.0 / RMS1)]
                };
                let offset = along.normal[k].times(size * x) + along.binormal[k].times(size * y);
                block.point[k] = block.point[k] + offset;
            }
            if n.keep_length {
                block.relay(&along.arc);
            }
            block.store(points, amplitude.map(|a| a != 0.0), hairs);
        }
    });
}
