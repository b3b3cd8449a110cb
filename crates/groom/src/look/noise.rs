//! Noise and frizz: random offsets across the hair, smooth along it.

use super::axes::{Along, RootAxes};
use super::perlin::{key, perlin1, perlin3};
use super::{CHUNK, Param, V3, lengths, relay};
use pelage_geom::StrandId;
use crate::along::at_points;
use rayon::prelude::*;

/// Root mean square of [`perlin1`].
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
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, out)| {
        let (mut along, mut length) = (Along::default(), Vec::new());
        for (h, hair) in (chunk * CHUNK..).zip(out.chunks_exact_mut(points)) {
            let amplitude = n.amplitude.of(h);
            if amplitude == 0.0 {
                continue;
            }
            along.set(hair, &n.axes[h]);
            if n.keep_length {
                lengths(hair, &mut length);
            }
            let own = key(n.seed, n.id[h], n.channel);
            let root = n.root[h].map(|x| x / n.across);
            for k in 1..points {
                let t = along.arc[k] * per_unit;
                let f = t.min(1.0);
                let size = amplitude * f * f * (3.0 - 2.0 * f) * profile.get(k).unwrap_or(&1.0);
                let [x, y] = if n.across > 0.0 {
                    perlin3(of_all, std::array::from_fn(|x| root[x] + WAY[x] * t))
                } else {
                    // Half a cell apart, so that they are not both 0 at the same places.
                    [perlin1(own, t), perlin1(!own, t + 0.5)].map(|v| v * (1.0 / RMS1))
                };
                let (a, b) = (along.normal[k], along.tangent[k].cross(&along.normal[k]));
                hair[k] = (V3::from(hair[k]) + a * (size * x) + b * (size * y)).into();
            }
            if n.keep_length {
                relay(hair, &length);
            }
        }
    });
}
