//! Wind without simulation: a noise moves the points of hairs (production-pipeline paper §4.3), more toward the tip, and
//! their lengths stay.

use super::axes::Beside;
use super::lanes::{Block, Group, Kernel, LANES, Lanes, V, perlin3, run};
use super::perlin::key;
use super::{CHUNK, Param, V3};
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
    // Gusts travel with the wind (frozen turbulence): one of their size passes in 1 / frequency.
    let gone = along * (f64::from(w.frequency) * w.time) as f32;
    let (down, side, gone) = (along.into(), across.into(), gone.into());
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, hairs)| {
        run(Chunk { wind: w, down, side, gone, points, first: chunk * CHUNK, hairs });
    });
}

/// Hairs that one task handles.
struct Chunk<'a> {
    wind: &'a Wind<'a>,
    /// Where the wind blows to.
    down: [f32; 3],
    /// Across it.
    side: [f32; 3],
    /// How far gusts have gone, in gusts.
    gone: [f32; 3],
    points: usize,
    /// The first hair's index.
    first: usize,
    hairs: &'a mut [[f32; 3]],
}

impl Kernel for Chunk<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (w, points) = (self.wind, self.points);
        let noise = key(w.seed, 0, w.channel);
        let (down, side, gone) = (V::splat(self.down), V::splat(self.side), V::splat(self.gone));
        let (mut arc, mut block) = (Beside::new(points), Block::new(points));
        let moves = |h: &usize| w.amplitude.of(self.first + h) != 0.0;
        let todo: Vec<usize> = (0..self.hairs.len() / points).filter(moves).collect();
        for hairs in todo.chunks(LANES) {
            let group = Group::new(self.first, hairs);
            block.load::<L>(self.hairs, &group);
            arc.set_arc::<L>(&block);
            let amplitude: L = group.param(&w.amplitude);
            let ([x, y, z], size) = (group.vectors::<L>(w.root).0, L::splat(w.size));
            let here = V([x / size, y / size, z / size]) - gone;
            for k in 1..points {
                let l = L::splat(k as f32 / (points - 1) as f32);
                let [a, b] = perlin3(noise, here - down.times(l * L::splat(LAG)));
                let size = amplitude * l * l;
                // Wind does not turn back between gusts.
                let force = (L::splat(1.0) + a * L::splat(w.gust)).max(L::splat(0.0));
                let push = down.times(size * force);
                let moved = V::load(&block.point[k]) + push + side.times(size * b * L::splat(0.5 * w.gust));
                moved.store(&mut block.point[k]);
            }
            block.relay::<L>(&arc.arc);
            block.store::<L>(&group, self.hairs);
        }
    }
}
