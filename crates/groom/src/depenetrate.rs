//! Depenetration: final curves that enter the skin are moved out of it.
//!
//! "Course notes 2003, A sparse-guide-hair model", §3.1.3: from the root on, the first penetrated vertex moves to its
//! nearest valid location p1', and each one after it follows at its segment's length toward where it was:
//! p2' = p1' + |p2 - p1| (p2 - p1') / |p2 - p1'|. Here
//! * a segment may not enter along its whole length: its deepest point moves to the nearest valid location, and both ends
//!   with it in proportion to their share of that point (the least motion that does it);
//! * a vertex that follows need not move while its segment is within [`STRETCH`] of its length: what is left of a push
//!   runs out along the hair, and a tip beyond it stays where it was, to the bit;
//! * sweeps from the root repeat until nothing is inside and lengths are kept.
//!
//! Where a hair was before it was displaced is known for finished hair, and that is outside. The hair then goes from there
//! to where it is drawn in strides of its segments' length, and is pushed out after each: it ends on the side it came from.
//! The nearest way out of where it is drawn would be another one from frame to frame where skin is thick.
//!
//! **Inside** is decided along every segment, not at samples. Signed distance changes by at most the way gone, so nothing
//! within d of a point at distance d is inside; where that says nothing, a ray does. Where the skin runs through itself (a
//! thigh in the belly) the nearest skin may not lead out; what is inside and the nearest way out are then those of all of it
//! ([`Bvh::closest_outside`]), and hair that **grows inside** (its root is in such a fold) is left as it is up to the place
//! where it comes out, if it does.

use crate::push_up::{PushUp, around, drape};
use pelage_geom::motion::RigidTransform;
use pelage_geom::{Bvh, Offsets, Vec3};
use probe::{Ahead, Probe, SHALLOW};
use rayon::prelude::*;

mod probe;

/// Part of its length by which a segment may be stretched or shortened. At 0 every push reaches the tip; at 0.05 a pushed
/// hair looks longer than its neighbours.
pub const STRETCH: f64 = 0.01;

/// Sweeps over a hair. Convex skin takes 2 to 6; hair that is not clear after 40 is in a fold that has no room for it.
const SWEEPS: usize = 40;

/// Sweeps after which lengths yield to the skin: the stretch grows by [`YIELD`] a sweep, to 0.22 (at 1.25 some segments
/// end up four times as long, and hardly fewer hairs stay in an ear). With fewer, hair stretches that would have found a
/// way around; with more, hair in folds takes longer for the same.
const PATIENCE: usize = 16;
const YIELD: f64 = 1.15;

/// Pushes of a segment in one sweep. With 1 or 2 deep hair needs more sweeps; beyond 8 its ends go back and forth.
const TRIES: usize = 6;

/// Length at the root over which a push grows to the clearance, in clearances. At 10 hair lying flat is lifted to 6
/// degrees at its root; at 1000 none of a short hair is as clear as it should be.
const RAMP: f64 = 100.0;

/// Depth in steps beyond which hair goes in strides. At 0 all hair does, for three times the time and nothing gained; at 10
/// hair a centimetre deep in an arm changes sides from frame to frame.
const DEEP: f64 = 2.0;

/// Stride in lengths of a hair's segments, and the most strides. At 1 six times as many hairs change sides from frame to
/// frame; shorter ones take longer.
const STRIDE: f64 = 0.5;
const STRIDES: f64 = 16.0;

/// Strides beyond those that the way needs, for points that are held back. 0 and 2 let as many hairs change sides.
const AROUND: usize = 1;

/// Sweeps after a stride, which moves hair little.
const STRIDE_SWEEPS: usize = 8;

/// Factor by which a hair without room gets shorter until it is clear. At 0.95 it takes six times as many looks; at 0.5 it
/// ends up at half the room.
const SHORTER: f64 = 0.8;

/// Settings of [`depenetrate`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Depenetrate {
    /// Distance of samples where hair runs along the skin or in it, scene units; 1 mm. Positive. What is inside does not
    /// depend on it; how deep is known to within it.
    pub step: f64,
    /// Distance from the skin at which pushed hair ends, scene units; 0.05 mm. Positive.
    pub clearance: f64,
    /// Length at the root that may be inside, scene units; 1 mm. Positive.
    pub held: f64,
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepenetrateCounts {
    /// Hairs that were moved.
    pub pushed: usize,
    /// Of these, hairs that have no room at their length: they are straight and as long as there is room.
    pub shortened: usize,
    /// Hairs that are still inside somewhere. Those moved have the best shape that was found.
    pub uncleared: usize,
    /// Of these, hairs whose root lies too deep for the held length to reach the surface: it was put there, or grows where
    /// another part of the skin covers it.
    pub buried: usize,
    /// Greatest depth of a sample before and after, scene units; of hairs that grow inside only where they are out again.
    pub deepest: [f64; 2],
    /// Longest way that a point was moved, scene units.
    pub moved: f64,
    /// Greatest change of a segment's length of a hair that was cleared, as a fraction of it.
    pub stretched: f64,
    /// Segments looked at in all sweeps: what it costs.
    pub looks: u64,
}

impl DepenetrateCounts {
    /// Of both.
    pub fn and(self, other: Self) -> Self {
        DepenetrateCounts {
            pushed: self.pushed + other.pushed,
            shortened: self.shortened + other.shortened,
            uncleared: self.uncleared + other.uncleared,
            buried: self.buried + other.buried,
            deepest: [0, 1].map(|i| self.deepest[i].max(other.deepest[i])),
            moved: self.moved.max(other.moved),
            stretched: self.stretched.max(other.stretched),
            looks: self.looks + other.looks,
        }
    }
}

/// Moves hairs (runs `offsets` of `position`, scene units relative to `origin`, root first) out of the skin. `bvh` is that
/// of the skin at this moment; or that of the rest skin and `world_from_skin` its rigid motion. A skin with holes (a bust
/// open at the neck) should have them closed with lids ([`Bvh::with_lids`]): without, the sign next to a hole is a guess.
///
/// `from`: where the hairs were before they were displaced, if that is known; they stay on that side of the skin.
///
/// Roots stay, and hairs with nothing inside beyond the held length keep every bit; hairs with a number that is not finite
/// are left alone.
pub fn depenetrate(
    bvh: &Bvh,
    settings: &Depenetrate,
    world_from_skin: Option<&RigidTransform>,
    offsets: &Offsets,
    origin: [f64; 3],
    from: Option<&[[f32; 3]]>,
    position: &mut [[f32; 3]],
) -> DepenetrateCounts {
    let Depenetrate { step, clearance, held } = *settings;
    assert!(step > 0.0 && clearance > 0.0 && held > 0.0, "step, clearance and held length are positive");
    assert_eq!(offsets.total(), position.len(), "positions of all hairs");
    let space = Space { motion: world_from_skin, origin: Vec3::from(origin) };
    let folded = bvh.is_folded();
    let mut rest = position;
    let mut hairs = Vec::with_capacity(offsets.len());
    for n in offsets.counts() {
        let (hair, others) = rest.split_at_mut(n);
        hairs.push(hair);
        rest = others;
    }
    assert!(from.is_none_or(|f| f.len() == offsets.total()), "where all hairs came from");
    let one = |(line, open): &mut (Vec<Vec3>, Vec<bool>), (h, stored): (usize, &mut [[f32; 3]])| {
        line.clear();
        line.extend(stored.iter().map(|p| space.read(p)));
        let probe = Probe { bvh, settings, folded };
        // A sum that is not finite: a hair with a number that is not.
        if !line.iter().map(Vec3::sum).sum::<f64>().is_finite() {
            return DepenetrateCounts::default();
        }
        match probe.depth(line, held, open) {
            0.0 => DepenetrateCounts::default(),
            depth => Job::new(probe, &space, line, stored, open).run(depth, from.map(|f| &f[offsets.range(h)])),
        }
    };
    let none = DepenetrateCounts::default;
    hairs.into_par_iter().enumerate().map_init(Default::default, one).reduce(none, DepenetrateCounts::and)
}

/// How stored positions lie in the space of the skin's hierarchy.
struct Space<'a> {
    motion: Option<&'a RigidTransform>,
    origin: Vec3,
}

impl Space<'_> {
    fn read(&self, p: &[f32; 3]) -> Vec3 {
        let world = Vec3::from(p.map(f64::from)) + self.origin;
        self.motion.map_or(world, |m| m.invert(world))
    }

    fn store(&self, p: Vec3) -> [f32; 3] {
        let world = self.motion.map_or(p, |m| m.apply(p)) - self.origin;
        [world.x as f32, world.y as f32, world.z as f32]
    }
}

/// A hair that is inside.
struct Job<'a> {
    probe: Probe<'a>,
    space: &'a Space<'a>,
    /// Points in the space of the hierarchy, exactly those that are stored.
    line: &'a mut [Vec3],
    stored: &'a mut [[f32; 3]],
    /// The same as they came.
    drawn: (Vec<Vec3>, Vec<[f32; 3]>),
    /// Where vertices are to go, the same as drawn but for strides.
    target: (Vec<Vec3>, Vec<[f32; 3]>),
    /// Lengths of segments as they came.
    length: Vec<f64>,
    /// Vertices that were pushed, rather than following others or staying.
    pushed: Vec<bool>,
    /// Segments that have moved since they were last looked at.
    open: &'a mut Vec<bool>,
    /// Length at the root that is left alone: more than asked for where that cannot suffice.
    held: f64,
    /// It has no way out from its root.
    grows_inside: bool,
    /// What a coordinate may be off by as stored, in all.
    grain: f64,
    /// Segments looked at.
    looks: u64,
}

impl<'a> Job<'a> {
    fn new(
        probe: Probe<'a>,
        space: &'a Space<'a>,
        line: &'a mut [Vec3],
        stored: &'a mut [[f32; 3]],
        open: &'a mut Vec<bool>,
    ) -> Self {
        let held = probe.settings.held;
        let (root, grows_inside) = probe.root(line[0]);
        let largest = stored.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
        Job {
            probe,
            space,
            drawn: (line.to_vec(), stored.to_vec()),
            target: (line.to_vec(), stored.to_vec()),
            length: line.windows(2).map(|w| (w[1] - w[0]).norm()).collect(),
            pushed: vec![false; line.len()],
            open,
            held: if root > SHALLOW * held { held.max(2.0 * root) } else { held },
            grows_inside,
            grain: f64::from(4.0 * f32::EPSILON * largest),
            looks: 0,
            line,
            stored,
        }
    }

    /// Moves the hair out, which is `before` deep inside, to the side where it came `from` if that is known.
    fn run(mut self, before: f64, from: Option<&[[f32; 3]]>) -> DepenetrateCounts {
        if self.grows_inside {
            return self.run_inside();
        }
        let held = self.probe.settings.held;
        let mut other = Vec::new();
        let clear =
            from.is_some_and(|f| before > DEEP * self.probe.settings.step && self.stride(f)) || self.push_out(before);
        let mut after = if clear && self.held == held { 0.0 } else { self.probe.depth(self.line, held, &mut other) };
        let mut shortened = false;
        if after > 0.0 && self.held == held {
            if self.drape() {
                after = self.probe.depth(self.line, held, &mut other);
            }
            if after > 0.0 {
                shortened = true;
                after = self.shorten();
            }
        }
        let counts = self.counts([before, after], after > 0.0, self.held > held);
        if shortened { DepenetrateCounts { shortened: 1, stretched: 0.0, ..counts } } else { counts }
    }

    /// Moves out what enters again of a hair that grows inside and comes out.
    fn run_inside(mut self) -> DepenetrateCounts {
        let mut deepest = [0.0; 2];
        if let Some(s) = self.probe.comes_out(self.line) {
            self.held = s;
            deepest[0] = self.probe.depth(self.line, s, self.open);
            if deepest[0] > 0.0 && !self.push_out(deepest[0]) {
                deepest[1] = self.probe.depth(self.line, s, &mut Vec::new());
            }
        }
        self.counts(deepest, true, true)
    }

    fn counts(&self, deepest: [f64; 2], uncleared: bool, buried: bool) -> DepenetrateCounts {
        let far = self.line.iter().zip(&self.drawn.0).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        let longer = |(w, l): (&[Vec3], &f64)| if *l > 0.0 { ((w[1] - w[0]).norm() / l - 1.0).abs() } else { 0.0 };
        let stretched = self.line.windows(2).zip(&self.length).map(longer).fold(0.0, f64::max);
        DepenetrateCounts {
            pushed: usize::from(*self.stored != *self.drawn.1),
            shortened: 0,
            uncleared: usize::from(uncleared),
            buried: usize::from(uncleared && buried),
            deepest,
            moved: far,
            stretched: if uncleared { 0.0 } else { stretched },
            looks: self.looks,
        }
    }

    /// Sweeps until nothing is inside; else leaves the best shape that was found. `before`: depth of the hair as drawn.
    fn push_out(&mut self, before: f64) -> bool {
        let mut other = Vec::new();
        let mut best = (f64::INFINITY, self.drawn.1.clone());
        for sweep in 0..SWEEPS {
            let stretch = STRETCH * (0..sweep.saturating_sub(PATIENCE)).fold(1.0, |f, _| f * YIELD);
            let (moved, dips) = self.sweep(stretch);
            if !moved {
                if !dips {
                    return true;
                }
                break;
            }
            if sweep % 8 == 7 {
                let depth = self.probe.depth(self.line, self.held, &mut other);
                if depth < best.0 {
                    best = (depth, self.stored.to_vec());
                }
            }
        }
        let depth = self.probe.depth(self.line, self.held, &mut other);
        if best.0.min(before) < depth {
            // In a fold an earlier shape may have been better, or the one that was drawn.
            let shape = if best.0 < before { best.1 } else { self.drawn.1.clone() };
            self.shape(&shape);
        }
        false
    }

    /// Goes in strides from where the hair came from to where it is drawn; true if it is clear at the end. Else it is as
    /// it was.
    fn stride(&mut self, from: &[[f32; 3]]) -> bool {
        let (mut from, mut other) = (from.to_vec(), Vec::new());
        let mut came: Vec<Vec3> = from.iter().map(|p| self.space.read(p)).collect();
        let far = came.iter().zip(&self.drawn.0).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        if !(far > 0.0 && far.is_finite() && (came[0] - self.drawn.0[0]).norm() <= self.grain) {
            return false;
        }
        let inside = self.probe.depth(&came, self.held, &mut other);
        if inside > 0.0 {
            Job::new(self.probe, self.space, &mut came, &mut from, &mut other).push_out(inside);
        }
        other.clone_from(self.open);
        self.line[1..].copy_from_slice(&came[1..]);
        self.stored[1..].copy_from_slice(&from[1..]);
        let segment = self.length.iter().sum::<f64>() / self.length.len() as f64;
        let strides = (far / (STRIDE * segment)).ceil().clamp(1.0, STRIDES);
        let mut clear = false;
        for _ in 0..strides as usize + AROUND {
            clear = self.one_stride(far / strides);
        }
        if !clear {
            self.shape(&self.drawn.1.clone());
            self.target.clone_from(&self.drawn);
            self.pushed.fill(false);
            self.open.clone_from(&other);
        }
        clear
    }

    /// Moves every vertex toward where it is drawn by at most `most`, and the hair out of the skin again.
    fn one_stride(&mut self, most: f64) -> bool {
        for k in 1..self.line.len() {
            let way = self.drawn.0[k] - self.line[k];
            let r = way.norm();
            (self.target.0[k], self.target.1[k]) = if r <= most {
                (self.drawn.0[k], self.drawn.1[k])
            } else {
                let p = self.line[k] + way * (most / r);
                (p, self.space.store(p))
            };
        }
        self.pushed.fill(false);
        for _ in 0..STRIDE_SWEEPS {
            let (moved, dips) = self.sweep(STRETCH);
            if !moved {
                return !dips;
            }
        }
        false
    }

    /// Takes the shape of stored points.
    fn shape(&mut self, stored: &[[f32; 3]]) {
        self.stored.copy_from_slice(stored);
        self.line.iter_mut().zip(stored).for_each(|(p, s)| *p = self.space.read(s));
    }

    /// The last resort for a hair that found no way: its segments are turned toward the normal one after another from the
    /// root, as far as they must ([`drape`]). Ends up farther from where it was, but outside. False if that fails too.
    fn drape(&mut self) -> bool {
        let Depenetrate { step, clearance, .. } = *self.probe.settings;
        let Some(root) = self.probe.bvh.closest(self.line[0], f64::INFINITY) else { return false };
        let closest = |at: Vec3, limit: f64| self.probe.closest(at, limit);
        let Some(line) = drape(&closest, &PushUp { step, clearance }, root.normal, &self.drawn.0) else {
            return false;
        };
        for (k, p) in line.into_iter().enumerate().skip(1) {
            self.place(k, p);
        }
        true
    }

    /// For a hair that nothing else got out: it becomes straight, in the direction with the most room, and no longer than
    /// that; at worst as long as may be inside. Returns how deep it then is.
    fn shorten(&mut self) -> f64 {
        let Depenetrate { step, held, .. } = *self.probe.settings;
        let Some(nearest) = self.probe.closest(self.line[0], f64::INFINITY) else { return 0.0 };
        let total: f64 = self.length.iter().sum();
        let (root, chord) = (self.line[0], self.drawn.0[self.length.len()] - self.line[0]);
        let toward = chord.try_normalize(0.0).unwrap_or(nearest.normal);
        let room = |d: Vec3| {
            let mut s = held;
            while s < total && self.probe.closest(root + d * s, step).is_none_or(|c| c.signed_distance > 0.0) {
                s += step;
            }
            s.min(total)
        };
        let mut best = (0.0, nearest.normal);
        for d in around(nearest.normal, toward) {
            let r = room(d);
            if r > best.0 {
                best = (r, d);
            }
        }
        let (mut long, direction) = best;
        loop {
            let mut before = 0.0;
            for k in 0..self.length.len() {
                before += self.length[k];
                self.place(k + 1, root + direction * (long * before / total));
            }
            let depth = self.probe.depth(self.line, held, &mut Vec::new());
            if depth == 0.0 || long < 0.9 * held {
                return depth;
            }
            long *= SHORTER;
        }
    }

    /// Once along the hair: whether anything moved, and whether something inside could not be.
    fn sweep(&mut self, stretch: f64) -> (bool, bool) {
        let (mut moved, mut stuck, mut before, mut gone) = (false, false, 0.0, 0.0);
        self.looks += self.length.len() as u64;
        for i in 0..self.length.len() {
            moved |= self.follow(i, stretch);
            // As the hair lies now, not as it came: pushed segments are longer or shorter.
            let from = (self.held - gone).max(0.0);
            for _ in 0..TRIES {
                if !self.open[i] {
                    break;
                }
                self.open[i] = false;
                let (a, b) = (self.line[i], self.line[i + 1]);
                if from >= (b - a).norm() {
                    break;
                }
                let Some(dip) = self.probe.dip(a, b, from, (b - a).norm(), &mut Ahead::UNKNOWN.clone()) else { break };
                let way = dip.way(self.clearance(before + dip.t * self.length[i]));
                let pushed = self.push(i, dip.t, way, stretch);
                moved |= pushed;
                if !pushed {
                    // Still to be looked at, should anything else have moved.
                    (stuck, self.open[i]) = (true, true);
                    break;
                }
            }
            before += self.length[i];
            gone += (self.line[i + 1] - self.line[i]).norm();
        }
        (moved, stuck)
    }

    /// Distance from the skin that a pushed hair should have at an arc length.
    fn clearance(&self, s: f64) -> f64 {
        let clearance = self.probe.settings.clearance;
        clearance * (s / (RAMP * clearance)).min(1.0)
    }

    /// Moves the end of segment `i` toward where it was (where it was pushed to) as far as the segment's length allows.
    fn follow(&mut self, i: usize, stretch: f64) -> bool {
        let k = i + 1;
        let target = if self.pushed[k] { self.line[k] } else { self.target.0[k] };
        let (way, length) = (target - self.line[i], self.length[i]);
        let (r, slack) = (way.norm(), stretch * length + self.grain);
        if (r - length).abs() <= slack {
            return self.place(k, target);
        }
        let drawn = self.drawn.0[k] - self.drawn.0[i];
        let direction = way.try_normalize(1e-12 * length).or_else(|| drawn.try_normalize(0.0));
        // A little less than allowed, so that rounding does not make it more.
        let to = length + (0.9 * slack).copysign(r - length);
        direction.is_some_and(|d| self.place(k, self.line[i] + d * to))
    }

    /// Moves a segment so that its point at `t` goes a `way`: both ends by their weights of that point, which is the
    /// least motion in the sum of squares; the end alone where the segment begins at the root.
    fn push(&mut self, i: usize, t: f64, (out, way): (Vec3, f64), stretch: f64) -> bool {
        let (a, b) = if i == 0 { (0.0, t) } else { (1.0 - t, t) };
        let whole = way / (a * a + b * b);
        let mut moved = false;
        for (k, weight) in [(i, a), (i + 1, b)] {
            if weight > 1e-9 {
                moved |= self.place(k, self.line[k] + out * (whole * weight));
                self.pushed[k] = true;
            }
        }
        moved |= self.follow(i, stretch);
        moved
    }

    /// Puts a vertex somewhere, as exactly as it can be stored; true if it moved.
    fn place(&mut self, k: usize, p: Vec3) -> bool {
        let stored = if p == self.target.0[k] { self.target.1[k] } else { self.space.store(p) };
        if stored == self.stored[k] || !stored.iter().all(|x| x.is_finite()) {
            return false;
        }
        self.stored[k] = stored;
        self.line[k] = self.space.read(&stored);
        self.open[k - 1] = true;
        if let Some(open) = self.open.get_mut(k) {
            *open = true;
        }
        true
    }
}
