//! Animated clump areas (production-pipeline paper §4.2.2): particles hit the skin and open circular areas in which
//! clumps are wet.
//!
//! The paper keeps areas in the (u, v) of a patch and copies those that straddle a seam to its neighbours. Here an area is
//! a ball around its centre in the space of the rest skin: charts, seams and T-junctions mean nothing to it, and it moves
//! with the skin, as the hairs do.

use pelage_geom::motion::{RigidTransform, between};
use pelage_geom::{Bvh, SurfacePoint, Vec3, rng};
use rayon::prelude::*;
use std::ops::Range;

/// The value at `time` of keys (time, value), ascending in time: see [`between`].
pub fn keyed(keys: &[(f64, f64)], time: f64) -> Option<f64> {
    between(keys, |k| k.0, time).map(|(a, b, f)| keys[a].1 + (keys[b].1 - keys[a].1) * f)
}

/// A spout of particles.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Where it is, scene units, by frame; one key stands still.
    pub position: Vec<(f64, [f64; 3])>,
    /// Where it points, scene space; need not be unit.
    pub direction: [f64; 3],
    /// Half angle of the cone of particles, degrees in [0, 180]; even over its solid angle.
    pub spread: f64,
    /// Particles a second.
    pub rate: f64,
    /// Names its random numbers.
    pub seed: u64,
    /// First and last frame at which it is on: from the start of the first to the end of the last.
    pub frames: [i32; 2],
}

/// Something that flies straight, and fast enough to arrive at the moment it leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Which of its emitter's, from 0; or its row in a file.
    pub number: u64,
    /// When it leaves, frames: 1001.25 is a quarter of a frame after frame 1001.
    pub time: f64,
    /// Where from, scene units.
    pub origin: [f64; 3],
    /// Where to, scene space; any length but 0.
    pub direction: [f64; 3],
}

impl Emitter {
    /// When particle `k` leaves, frames. It never falls with k.
    fn time(&self, k: u64, fps: f64) -> f64 {
        f64::from(self.frames[0]) + k as f64 * fps / self.rate
    }

    /// First particle that does not leave before the start of `frame`.
    fn first_from(&self, frame: i32, fps: f64) -> u64 {
        let frame = f64::from(frame);
        let mut k = ((frame - f64::from(self.frames[0])) * self.rate / fps).max(0.0) as u64;
        while k > 0 && self.time(k - 1, fps) >= frame {
            k -= 1;
        }
        while self.time(k, fps) < frame {
            k += 1;
        }
        k
    }

    /// Numbers of the particles that leave from the start of `frames.start` to the start of `frames.end`. None without a
    /// position, a rate or a direction that can be followed.
    pub fn numbers(&self, frames: Range<i32>, fps: f64) -> Range<u64> {
        let on = frames.start.max(self.frames[0])..frames.end.min(self.frames[1].saturating_add(1));
        let pace = self.rate / fps;
        let flows = pace > 0.0 && pace.is_finite() && self.axis().is_some() && !self.position.is_empty();
        if on.is_empty() || !flows { 0..0 } else { self.first_from(on.start, fps)..self.first_from(on.end, fps) }
    }

    /// Unit direction, if there is one.
    fn axis(&self) -> Option<Vec3> {
        Vec3::from(self.direction).try_normalize(0.0).filter(|a| a.iter().all(|x| x.is_finite()))
    }

    /// Particles with those [numbers](Self::numbers). Particle k leaves k / rate seconds after the first and is a function
    /// of the emitter and k alone: however frames are split, the particles are the same.
    pub fn particles(&self, frames: Range<i32>, fps: f64) -> Vec<Particle> {
        let Some(axis) = self.axis() else { return Vec::new() };
        let (side, up) = across(axis);
        let narrow = 1.0 - libm::cos(self.spread.clamp(0.0, 180.0).to_radians());
        let particle = |number: u64| {
            let random = |name: &str| rng::uniform(self.seed, number, rng::channel(name), 0);
            // Even over a cap of the sphere: its height is uniform (Archimedes).
            let down = narrow * random("particle height");
            let (along, out) = (1.0 - down, (down * (2.0 - down)).max(0.0).sqrt());
            let turn = std::f64::consts::TAU * random("particle turn");
            let direction = axis * along + side * (out * libm::cos(turn)) + up * (out * libm::sin(turn));
            let time = self.time(number, fps);
            let (from, to, f) = between(&self.position, |k| k.0, time)?;
            let (from, to) = (self.position[from].1, self.position[to].1);
            let origin = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * f);
            Some(Particle { number, time, origin, direction: direction.into() })
        };
        self.numbers(frames, fps).filter_map(particle).collect()
    }
}

/// Two unit vectors at right angles to a unit vector and each other.
fn across(axis: Vec3) -> (Vec3, Vec3) {
    let mut least = Vec3::zeros();
    least[axis.iamin()] = 1.0;
    let side = axis.cross(&least).normalize();
    (side, axis.cross(&side))
}

/// Where and when a particle met the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Number of the particle.
    pub number: u64,
    /// When, frames.
    pub time: f64,
    /// Where on the skin.
    pub point: SurfacePoint,
}

/// First point of the skin that each particle meets; those that miss are left out. `bvh` is over the skin where it is at
/// the particles' frame, or at rest if `placement` takes it from there. In the order of the particles.
pub fn hits(particles: &[Particle], bvh: &Bvh, placement: Option<&RigidTransform>) -> Vec<Hit> {
    let hit = |p: &Particle| {
        let (origin, direction) = (Vec3::from(p.origin), Vec3::from(p.direction));
        let (origin, direction) = match placement {
            Some(t) => (t.invert(origin), t.invert_direction(direction)),
            None => (origin, direction),
        };
        let (_, point) = bvh.ray(origin, direction, f64::INFINITY)?;
        Some(Hit { number: p.number, time: p.time, point })
    };
    particles.par_iter().filter_map(hit).collect()
}

/// How an area lives: curves over its age, the frames since its particle hit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AreaLaw {
    /// Radius, scene units at rest; without keys 0.
    pub radius: Vec<(f64, f64)>,
    /// What it gives to the clump-percent of clumps inside; without keys 0.
    pub percent: Vec<(f64, f64)>,
    /// What it gives to their clump-rate; without keys 0.
    pub rate: Vec<(f64, f64)>,
}

/// An area at one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Centre on the rest skin, scene units.
    pub centre: [f64; 3],
    /// Unit normal of the rest skin there.
    pub normal: [f32; 3],
    /// Radius, scene units.
    pub radius: f64,
    /// Given to the clump-percent of clumps inside, >= 0.
    pub percent: f64,
    /// Given to the clump-rate of clumps inside, >= 0.
    pub rate: f64,
}

/// The areas that hits have opened by `frame`, and that act there. `place` gives position and unit normal of a point on the
/// rest skin.
pub fn areas(
    hits: &[Hit],
    law: &AreaLaw,
    frame: f64,
    place: impl Fn(&SurfacePoint) -> ([f64; 3], [f32; 3]) + Sync,
) -> Vec<Area> {
    let area = |hit: &Hit| {
        let age = frame - hit.time;
        let at = |keys: &[(f64, f64)]| keyed(keys, age).filter(|x| x.is_finite()).unwrap_or(0.0).max(0.0);
        let (radius, percent, rate) = (at(&law.radius), at(&law.percent), at(&law.rate));
        if !(age >= 0.0 && radius > 0.0 && percent + rate > 0.0) {
            return None;
        }
        let (centre, normal) = place(&hit.point);
        Some(Area { centre, normal, radius, percent, rate })
    };
    hits.par_iter().filter_map(area).collect()
}

impl Area {
    /// True for a centre hair rooted here: no farther than the radius, on the same side of something thin (an ear) as the
    /// area.
    fn holds(&self, root: [f64; 3], normal: [f32; 3]) -> bool {
        let d: [f64; 3] = std::array::from_fn(|i| root[i] - self.centre[i]);
        let facing: f64 = (0..3).map(|i| f64::from(normal[i]) * f64::from(self.normal[i])).sum();
        d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= self.radius * self.radius && facing > 0.0
    }
}

/// Roots of the centre hairs of clumps. An area acts on whole clumps, by these.
#[derive(Clone, Copy, Debug)]
pub struct Centres<'a> {
    /// \[clumps\] on the rest skin, scene units.
    pub root: &'a [[f64; 3]],
    /// \[clumps\] unit normals of the rest skin there.
    pub normal: &'a [[f32; 3]],
}

/// Clump-percent and clump-rate of every clump: the sums over the areas that hold its centre hair's root, 1 at most; 0 for
/// a clump in no area, which is dry. The same bytes for any number of threads.
pub fn wetness(areas: &[Area], centres: &Centres<'_>) -> Vec<[f32; 2]> {
    let shelves = shelves(areas);
    let of = |(&root, &normal): (&[f64; 3], &[f32; 3])| {
        let mut sum = [0.0; 2];
        for shelf in &shelves {
            for area in shelf.near(root).iter().map(|&a| &areas[a as usize]) {
                if area.holds(root, normal) {
                    sum = [sum[0] + area.percent, sum[1] + area.rate];
                    // More only adds.
                    if sum[0] >= 1.0 && sum[1] >= 1.0 {
                        return [1.0; 2];
                    }
                }
            }
        }
        sum.map(|x| x.min(1.0) as f32)
    };
    centres.root.par_iter().zip(centres.normal).map(of).collect()
}

/// Areas this many halvings smaller than the largest share a shelf: each shelf costs a look per clump, and areas much
/// smaller than a cell are looked at in vain. Speed alone depends on it.
const HALVINGS: i32 = 8;

/// Areas of like radius in a hashed grid of cubes, each listed at every cube that it may reach.
struct Shelf {
    /// Side of the cubes, at least the diameter of every area here, so that an area reaches two in each direction.
    cell: f64,
    /// Areas of slot s: `list[start[s]..start[s + 1]]`, ascending.
    start: Vec<u32>,
    list: Vec<u32>,
}

/// Areas by the power of two of their radius.
fn shelves(areas: &[Area]) -> Vec<Shelf> {
    let size = |a: &Area| libm::frexp(a.radius).1;
    let good = |a: &Area| a.radius > 0.0 && a.radius.is_finite();
    let Some(largest) = areas.iter().filter(|a| good(a)).map(size).max() else { return Vec::new() };
    let shelf = |e: i32| {
        let here = |a: &Area| good(a) && size(a).max(largest - HALVINGS) == e;
        let of: Vec<u32> = (0..areas.len() as u32).filter(|&a| here(&areas[a as usize])).collect();
        (!of.is_empty()).then(|| Shelf::new(areas, &of, libm::ldexp(1.0, e + 1)))
    };
    (largest - HALVINGS..=largest).filter_map(shelf).collect()
}

impl Shelf {
    fn new(areas: &[Area], of: &[u32], cell: f64) -> Shelf {
        let slots = (8 * of.len()).next_power_of_two();
        let mut shelf = Shelf { cell, start: vec![0; slots + 1], list: Vec::new() };
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(8 * of.len());
        for &a in of {
            let Area { centre, radius, .. } = areas[a as usize];
            // A little more than the radius, so that rounding hides no cube. Two cubes may share a slot.
            let reach = radius * (1.0 + 1e-9);
            let corner = |k: usize| std::array::from_fn(|i| centre[i] + if k >> i & 1 == 0 { -reach } else { reach });
            let mut slot: [u32; 8] = std::array::from_fn(|k| shelf.slot(corner(k)) as u32);
            slot.sort_unstable();
            let distinct = (0..8).filter(|&k| k == 0 || slot[k] != slot[k - 1]);
            pairs.extend(distinct.map(|k| (slot[k], a)));
        }
        pairs.sort_unstable();
        pairs.iter().for_each(|p| shelf.start[p.0 as usize + 1] += 1);
        (0..slots).for_each(|s| shelf.start[s + 1] += shelf.start[s]);
        shelf.list = pairs.into_iter().map(|p| p.1).collect();
        shelf
    }

    fn slot(&self, p: [f64; 3]) -> usize {
        let cube = p.map(|x| (x / self.cell).floor() as i64 as u64);
        let hash = cube.into_iter().fold(0, |h, c| rng::mix(h ^ c.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        hash as usize & (self.start.len() - 2)
    }

    /// Areas that may hold a point.
    fn near(&self, p: [f64; 3]) -> &[u32] {
        let s = self.slot(p);
        &self.list[self.start[s] as usize..self.start[s + 1] as usize]
    }
}

#[cfg(test)]
mod tests;
