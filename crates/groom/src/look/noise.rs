//! Noise and frizz: random offsets across the hair, smooth along it.

use super::axes::{Beside, RootAxes};
use super::lanes::{Bits, Block, Group, Kernel, LANES, Lanes, V, perlin1, perlin3, run};
use super::perlin::key;
use super::{CHUNK, Param};
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
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, hairs)| {
        run(Chunk { noise: n, profile: &profile, points, first: chunk * CHUNK, hairs });
    });
}

/// Hairs that one task handles.
struct Chunk<'a> {
    noise: &'a Noise<'a>,
    profile: &'a [f32],
    points: usize,
    /// The first hair's index.
    first: usize,
    hairs: &'a mut [[f32; 3]],
}

impl Kernel for Chunk<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (n, points) = (self.noise, self.points);
        let of_all = key(n.seed, 0, n.channel);
        let (per_unit, way) = (L::splat(1.0 / n.size), V::splat(WAY));
        let (one, three, half) = (L::splat(1.0), L::splat(3.0), L::splat(0.5));
        let scale = L::splat(1.0 / RMS1);
        let (mut along, mut block) = (Beside::new(points), Block::new(points));
        let moves = |h: &usize| n.amplitude.of(self.first + h) != 0.0;
        let todo: Vec<usize> = (0..self.hairs.len() / points).filter(moves).collect();
        for hairs in todo.chunks(LANES) {
            let group = Group::new(self.first, hairs);
            block.load::<L>(self.hairs, &group);
            along.set::<L>(&block, group.roots(n.axes));
            let amplitude: L = group.param(&n.amplitude);
            let (mut own, mut root) = ([0; LANES], V::splat([0.0; 3]));
            if n.across > 0.0 {
                let across = L::splat(n.across);
                let [x, y, z] = group.vectors::<L>(n.root).0;
                root = V([x / across, y / across, z / across]);
            } else {
                for (l, own) in own.iter_mut().enumerate() {
                    *own = key(n.seed, n.id[group.hair(l)], n.channel);
                }
            }
            let own = L::Bits::load(&own);
            for k in 1..points {
                let t = L::load(&along.arc[k]) * per_unit;
                let f = t.min(one);
                let size = amplitude * f * f * (three - f - f) * L::splat(*self.profile.get(k).unwrap_or(&1.0));
                let [x, y] = if n.across > 0.0 {
                    perlin3(of_all, root + way.times(t))
                } else {
                    // Half a cell apart, so that they are not both 0 at the same places.
                    let (x, y) = (perlin1(own, t), perlin1(own ^ L::Bits::splat(u32::MAX), t + half));
                    [x * scale, y * scale]
                };
                let offset = V::load(&along.normal[k]).times(size * x) + V::load(&along.binormal[k]).times(size * y);
                (V::load(&block.point[k]) + offset).store(&mut block.point[k]);
            }
            if n.keep_length {
                block.relay::<L>(&along.arc);
            }
            block.store::<L>(&group, self.hairs);
        }
    }
}
