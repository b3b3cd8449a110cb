//! A layer of hair in motion: the constant model, the changing state, and the step over a span of time.

use crate::contact::{self, Keep};
use crate::group::{Group, Strand};
use crate::integrate::{self, Around, Done, Interval, Method, Work};
use crate::lanes::{LANES, Pack};
use crate::nine_steps;
use crate::place;
use crate::rod::{self, Damping};
use crate::scene::{self, Calm, Scene};
use crate::settings::{Material, Model, Settings};
use crate::settle;
use crate::stage;
use crate::{Body, Motion, Rigid, Vec3, Wind};
use pelage_geom::{Offsets, StrandId};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Hairs at the rest pose, root first.
#[derive(Clone, Copy, Debug)]
pub struct Hairs<'a> {
    /// Runs of `position`, one a hair. A hair has at least one point.
    pub offsets: &'a Offsets,
    /// Points, metres.
    pub position: &'a [[f64; 3]],
    /// Names, one a hair.
    pub id: &'a [StrandId],
    /// What each is made of; empty if all are of the settings' material, whose damping is that of all in any case.
    pub material: &'a [Material],
}

/// A root's placement relative to its rest pose, in the coordinates of [`Span::motion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// Where the root is, metres.
    pub position: [f64; 3],
    /// Rotation from the rest pose, unit quaternion (x, y, z, w).
    pub rotation: [f64; 4],
}

/// A span of time, mostly one frame, with everything prescribed in it.
#[derive(Clone)]
pub struct Span<'a> {
    /// Its length, seconds.
    pub seconds: f64,
    /// Time of its beginning in the shot, seconds.
    pub time: f64,
    /// Placement of the coordinates of `roots`: the rigid part of the skin's motion.
    pub motion: Motion<'a>,
    /// Roots at the beginning and at the end, one a hair; linear in between.
    pub roots: [&'a [Root]; 2],
    /// Tips at the beginning and at the end, if tips are held.
    pub tips: Option<[&'a [Root]; 2]>,
    /// What hair can't enter.
    pub body: &'a Body<'a>,
    /// Gravity at the beginning and at the end, metres per second squared.
    pub gravity: [[f64; 3]; 2],
    /// The wind at the beginning and at the end.
    pub wind: Option<[&'a Wind; 2]>,
    /// \[hairs\] True for hairs of which the caller knows that in this span nothing moves that they hang on or may touch, up to
    /// rounding. Empty where that is not known: then all hairs count as still if `motion` and `body` rest.
    pub still: &'a [bool],
}

/// A strand that had to be stiffened so that its groomed pose can stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffenedStrand {
    /// Its name.
    pub id: StrandId,
    /// Factor on its bending and twisting stiffness; 0 if no factor tried was enough.
    pub factor: f64,
}

/// What a simulation starts with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Started {
    /// Points that are simulated.
    pub particles: u64,
    /// Memory of model and state, bytes.
    pub bytes: u64,
    /// Strands that can't twist: they have three unknowns a node instead of four.
    pub untwisted: u64,
    /// Strands that had to be stiffened.
    pub stiffened: Vec<StiffenedStrand>,
    /// Strands too short to simulate: they ride with their roots.
    pub rigid: Vec<StrandId>,
    /// Largest angle between neighbouring segments at rest, radians.
    pub largest_hinge: f64,
    /// Largest ratio of weight to bending stiffness, `w L^3 / B`.
    pub largest_gamma: f64,
}

/// What happened in a span.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpanReport {
    /// Steps in the span before any strand subdivides.
    pub steps: u32,
    /// Shortest step that any strand took, seconds.
    pub shortest_step: f64,
    /// Points times steps.
    pub particle_steps: u64,
    /// Linear solves times points.
    pub particle_solves: u64,
    /// Of these, with the factor of the solve before.
    pub particle_chords: u64,
    /// Largest strain at the end.
    pub largest_strain: f64,
    /// Strands that took steps of their own.
    pub subdivided: u64,
    /// Strands that slept.
    pub sleeping: u64,
    /// Points that the exact mesh pushed out at the end.
    pub corrected: u64,
    /// Depth of the deepest point that is on its way out of the body, metres.
    pub deepest: f64,
    /// Strands carried over a jump of their root.
    pub teleported: u64,
    /// Strands whose motion could not be followed in the shortest steps: they were stopped, and went on from rest.
    pub stopped: Vec<StrandId>,
    /// Strands that diverged and were held for this span.
    pub held: Vec<StrandId>,
    /// Strands whose root was not a number: held where it was last.
    pub bad_roots: Vec<StrandId>,
}

/// What can be wrong with a simulation's input or saved state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A value is not a number.
    #[error("hair {hair}, point {point}: not a finite position")]
    NotFinite {
        /// Index of the hair.
        hair: usize,
        /// Index of the point in its hair.
        point: usize,
    },
    /// A setting is out of range.
    #[error("{name} is {value}: {expected}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A saved state is not of this simulation.
    #[error("the saved state does not belong to this simulation: {0}")]
    State(&'static str),
    /// Work was stopped by the caller.
    #[error("stopped")]
    Stopped,
}

/// A hair that is too short to move by itself: it rides with its root.
#[derive(Clone, Debug, PartialEq)]
struct Rider {
    index: usize,
    point: Vec<Vec3>,
}

/// A layer of hair in motion.
#[derive(Clone, Debug)]
pub struct Simulation {
    settings: Settings,
    offsets: Offsets,
    id: Vec<StrandId>,
    group: Vec<Group>,
    rider: Vec<Rider>,
    /// Node of its strand for every output point.
    pick: Vec<u32>,
    /// Group and lane of every strand; `None` for riders.
    place: Vec<Option<(u32, u8)>>,
    /// Where every root was at the end of the last span, in the world.
    root: Vec<Rigid>,
}

/// Segments shorter than this have no direction, metres.
pub(crate) const SHORTEST: f64 = 1e-9;

/// Memory of a node of eight strands.
const NODE_BYTES: usize = size_of::<stage::Node>() + size_of::<stage::Motion>() + size_of::<rod::Elastic>();

/// Steps a second without motion of the body. Fewer and hair that swings freely takes steps of its own; more cost time.
const STEPS_PER_SECOND: f64 = 192.0;

/// A strand that moves slower than this over two spans, with nothing around it moving, sleeps, metres per second. What it
/// would still have moved is less than this times its longest period (about 1 s): a micrometre.
const SLEEP_SPEED: f64 = 1e-6;

/// Motion of a root over a span that is rounding, metres and radians: a billionth of a hair's length, which takes an hour of
/// film to add up to a micrometre.
const ROUNDING: f64 = 1e-10;

/// Farthest that the skin turns in a step, radians.
const STEP_TURN: f64 = 0.1;

impl Simulation {
    /// Prepares the hairs of a layer at rest under `gravity` (metres per second squared).
    ///
    /// The result depends on the arguments only.
    pub fn new(hairs: &Hairs<'_>, settings: &Settings, gravity: [f64; 3]) -> Result<(Self, Started), SimError> {
        settings.check()?;
        scene::finite("gravity", &gravity)?;
        hairs.material.iter().try_for_each(Material::check)?;
        let mut counts = Vec::new();
        let (mut pick, mut strands, mut rider) = (Vec::new(), Vec::new(), Vec::new());
        let mut root = Vec::new();
        for h in 0..hairs.offsets.len() {
            let points: Vec<Vec3> = hairs.position[hairs.offsets.range(h)].iter().map(|p| Vec3::from(*p)).collect();
            if let Some(point) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
                return Err(SimError::NotFinite { hair: h, point });
            }
            let points = sample(points, settings.segments);
            counts.push(points.len());
            root.push(Rigid { translation: points[0].into(), ..Rigid::default() });
            let mut own: Vec<Vec3> = Vec::with_capacity(points.len());
            for p in &points {
                if own.last().is_none_or(|q| (p - q).norm() > SHORTEST) {
                    own.push(*p);
                }
                pick.push(own.len() as u32 - 1);
            }
            // Springs need segments of like length.
            let material = hairs.material.get(h).unwrap_or(&settings.material);
            let springs = settings.model != Model::Rod && own.len() >= 2;
            if own.len() < 2 || (springs && settle::layout(&own, material, settings).is_none()) {
                rider.push(Rider { index: h, point: points });
            } else {
                strands.push(Strand { index: h, point: own, material: *material });
            }
        }
        // Strands of like length share a group, so that little is padded; those that never twist have their own. Of these,
        // neighbours: where hair is at rest in some places whole groups can sleep.
        let place = place::along_curve(strands.iter().map(|s| s.point[0]));
        let mut order: Vec<(bool, usize, u64, Strand)> = strands
            .into_iter()
            .zip(place)
            .map(|(s, place)| (settle::twists(&s, settings), s.point.len(), place, s))
            .collect();
        order.sort_by_key(|(twists, points, place, _)| (*twists, *points, *place));
        let strands: Vec<Strand> = order.into_iter().map(|o| o.3).collect();
        let (plain, twisting) = strands.split_at(strands.partition_point(|s| !settle::twists(s, settings)));
        let chunks: Vec<&[Strand]> = plain.chunks(LANES).chain(twisting.chunks(LANES)).collect();
        let prepare = |s: &&[Strand]| settle::prepare(s, settings, gravity);
        let (group, figures): (Vec<Group>, Vec<_>) = chunks.par_iter().map(prepare).unzip();
        let mut place = vec![None; hairs.offsets.len()];
        for (i, g) in group.iter().enumerate() {
            for (l, s) in g.strand.iter().enumerate() {
                if let Some(s) = s {
                    place[*s] = Some((i as u32, l as u8));
                }
            }
        }
        let nodes: usize = group.iter().map(|g| g.node.len()).sum();
        let started = Started {
            particles: pick.len() as u64,
            bytes: (nodes * NODE_BYTES) as u64,
            untwisted: plain.len() as u64,
            stiffened: figures
                .iter()
                .flat_map(|f| &f.stiffened)
                .map(|&(s, factor)| StiffenedStrand { id: hairs.id[s], factor })
                .collect(),
            rigid: rider.iter().map(|r| hairs.id[r.index]).collect(),
            largest_hinge: figures.iter().map(|f| f.hinge).fold(0.0, f64::max),
            largest_gamma: figures.iter().map(|f| f.gamma).fold(0.0, f64::max),
        };
        let offsets = Offsets::from_counts(counts);
        let id = hairs.id.to_vec();
        Ok((Simulation { settings: settings.clone(), offsets, id, group, rider, pick, place, root }, started))
    }

    /// Estimates the memory that [`Simulation::new`] will need, bytes, before any of it is taken.
    pub fn memory(hairs: usize, points: usize) -> u64 {
        // Ghost nodes, input and output points.
        (hairs.div_ceil(LANES) * (points + 1) * NODE_BYTES + hairs * points * 28) as u64
    }

    /// Moves through a span. A span with gravity, wind, motion or length that is not a number is refused by that name, and
    /// changes nothing. `progress` is told the fraction done and may stop the work by returning false; then the
    /// state is of no use until [`Simulation::restore`].
    pub fn advance(
        &mut self,
        span: &Span<'_>,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<SpanReport, SimError> {
        scene::check(span)?;
        let steps = self.steps(span);
        let method = Method {
            width: self.settings.width(),
            tolerance: self.settings.tolerance,
            friction: self.settings.friction,
            damping: Damping(self.settings.material.damping),
            largest_turn: self.settings.largest_turn,
            strain_limit: self.settings.strain_limit,
        };
        let count = self.group.len();
        let (finished, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
        let scene = Scene { span, settings: &self.settings, last: &self.root, calm: Calm::of(span) };
        let done: Vec<Moved> = self
            .group
            .par_iter_mut()
            .map_init(Work::default, |work, g| {
                let mut done = Moved::default();
                if !stopped.load(Ordering::Relaxed) {
                    move_group(g, &scene, &method, steps, work, &mut done);
                    let k = finished.fetch_add(1, Ordering::Relaxed) + 1;
                    if !progress(k as f64 / count as f64) {
                        stopped.store(true, Ordering::Relaxed);
                    }
                }
                done
            })
            .collect();
        if stopped.load(Ordering::Relaxed) || (count == 0 && !progress(1.0)) {
            return Err(SimError::Stopped);
        }
        let mut report = SpanReport { steps, shortest_step: span.seconds / f64::from(steps), ..SpanReport::default() };
        for (g, d) in self.group.iter().zip(&done) {
            report.corrected += d.corrected;
            report.deepest = report.deepest.max(d.deepest);
            report.teleported += count_true(d.teleported);
            report.sleeping += count_true(d.asleep);
            let d = &d.done;
            report.particle_steps += d.node_steps;
            report.particle_solves += d.node_solves;
            report.particle_chords += d.node_chords;
            for l in 0..LANES {
                let Some(s) = g.strand[l] else { continue };
                report.largest_strain = report.largest_strain.max(d.strain[l]);
                report.subdivided += u64::from(d.deepest[l] > 0);
                let short = span.seconds / f64::from(steps) / f64::from(1u32 << d.deepest[l]);
                report.shortest_step = report.shortest_step.min(short);
                if d.failed[l] {
                    report.held.push(self.id[s]);
                } else if d.stopped[l] {
                    report.stopped.push(self.id[s]);
                }
            }
        }
        report.held.sort_unstable();
        report.stopped.sort_unstable();
        let last = scene.all_roots();
        for (s, root) in last.iter().enumerate() {
            match root {
                Some(r) => self.root[s] = *r,
                None => report.bad_roots.push(self.id[s]),
            }
        }
        Ok(report)
    }

    /// Steps of a span, from what is prescribed only.
    fn steps(&self, span: &Span<'_>) -> u32 {
        let samples = 8;
        let pose = |k: i32| (span.motion)(f64::from(k) / f64::from(samples));
        let turn: f64 = (0..samples).map(|k| pose(k).quaternion().angle_to(&pose(k + 1).quaternion())).sum();
        let least = (span.seconds * STEPS_PER_SECOND).max(turn / STEP_TURN);
        let automatic = if least.is_finite() { (least - 1e-6).ceil().clamp(1.0, 4096.0) as u32 } else { 1 };
        self.settings.substeps.unwrap_or(automatic).max(1)
    }

    /// Runs of [`Simulation::positions`], one a hair, in the order of the input.
    pub fn offsets(&self) -> &Offsets {
        &self.offsets
    }

    /// Points of every hair, root first, metres.
    pub fn positions(&self) -> Vec<[f64; 3]> {
        let mut out = self.gather(Group::x);
        for r in &self.rider {
            for (p, i) in r.point.iter().zip(self.offsets.range(r.index)) {
                out[i] = self.root[r.index].apply(p - r.point[0]).into();
            }
        }
        out
    }

    /// Velocities of the points of every hair, metres per second; 0 for hairs that ride with their roots.
    pub fn velocities(&self) -> Vec<[f64; 3]> {
        self.gather(Group::v)
    }

    /// A value of the node behind every point; 0 for hairs that ride with their roots.
    fn gather(&self, value: fn(&Group, usize, usize) -> Vec3) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.offsets.total()];
        for (s, place) in self.place.iter().enumerate() {
            if let Some((g, l)) = place {
                let (g, l) = (&self.group[*g as usize], *l as usize);
                for i in self.offsets.range(s) {
                    out[i] = value(g, g.at[l][self.pick[i] as usize] as usize, l).into();
                }
            }
        }
        out
    }

    /// The whole changing state as bytes: [`Simulation::restore`] on a simulation made from the same input goes on as
    /// if nothing had happened. Strand by strand, so that it does not depend on how strands are packed.
    pub fn save(&self) -> Vec<u8> {
        let mut out: Vec<f64> = Vec::new();
        for (s, place) in self.place.iter().enumerate() {
            let r = &self.root[s];
            out.extend(r.rotation.iter().chain(&r.translation));
            if let Some((g, l)) = place {
                let (g, l) = (&self.group[*g as usize], *l as usize);
                out.extend([f64::from(g.level[l]), f64::from(g.quiet[l])]);
                for (i, m) in g.motion[..g.count[l]].iter().enumerate() {
                    out.extend([&m.x, &m.v, &m.a, &m.m, &m.grip].into_iter().flatten().map(|p| p.0[l]));
                    // Not a number before the first span.
                    let keep = |p: &[Pack]| p.get(i).map_or(f64::NAN, |p| p.0[l]);
                    out.extend([keep(&g.keep.most), keep(&g.keep.inside)]);
                    if let Some(springs) = &g.springs {
                        let a = &springs.altitude[i];
                        out.extend(a.face.iter().chain([&a.inverse_height, &a.offset]).map(|p| p.0[l]));
                    }
                }
            }
        }
        bytemuck::cast_slice(&out).to_vec()
    }

    /// Numbers that are saved of a node.
    fn node_values(&self) -> usize {
        if self.settings.model == Model::Rod { 17 } else { 22 }
    }

    /// Takes over a saved state.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), SimError> {
        let values: Vec<f64> = state.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect();
        let size = |p: &Option<(u32, u8)>| {
            7 + p.map_or(0, |(g, l)| 2 + self.node_values() * self.group[g as usize].count[l as usize])
        };
        if state.len() != 8 * self.place.iter().map(size).sum::<usize>() {
            return Err(SimError::State("its length differs"));
        }
        let mut values = values.into_iter();
        let mut next = || values.next().expect("the length was checked");
        for (s, place) in self.place.iter().enumerate() {
            let r = &mut self.root[s];
            r.rotation = std::array::from_fn(|_| next());
            r.translation = std::array::from_fn(|_| next());
            if let Some((g, l)) = place {
                let (g, l) = (&mut self.group[*g as usize], *l as usize);
                g.level[l] = next() as u8;
                g.quiet[l] = next() as u32;
                for i in 0..g.count[l] {
                    let m = &mut g.motion[i];
                    for p in [&mut m.x, &mut m.v, &mut m.a, &mut m.m, &mut m.grip].into_iter().flatten() {
                        p.0[l] = next();
                    }
                    let (most, inside) = (next(), next());
                    if most.is_nan() {
                        g.keep = Keep::default();
                    } else {
                        let n = g.node.len();
                        for (keep, value) in [(&mut g.keep.most, most), (&mut g.keep.inside, inside)] {
                            keep.resize(n, Pack::default());
                            keep[i].0[l] = value;
                        }
                    }
                    if let Some(springs) = &mut g.springs {
                        let a = &mut springs.altitude[i];
                        for p in a.face.iter_mut().chain([&mut a.inverse_height, &mut a.offset]) {
                            p.0[l] = next();
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

/// The points of a hair as they are, or `segments` equal chords of the same length as the hair.
fn sample(points: Vec<Vec3>, segments: Option<usize>) -> Vec<Vec3> {
    let Some(segments) = segments else { return points };
    let length = |p: &[Vec3]| p.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
    let mut new = pelage_geom::curve::resample(&points, segments + 1);
    // Chords cut corners; the hair keeps its length.
    let scale = length(&points) / length(&new);
    if scale.is_finite() {
        let root = new[0];
        for p in &mut new {
            *p = root + (*p - root) * scale;
        }
    }
    new
}

/// Moves a group through a span.
fn move_group(g: &mut Group, scene: &Scene<'_>, method: &Method, steps: u32, work: &mut Work, done: &mut Moved) {
    work.forget();
    if g.keep.most.is_empty() {
        g.keep = Keep::new(g, &scene.span.body.at(0.0), scene.settings.offset);
    }
    let world = [0.0, 1.0].map(scene.span.motion);
    let mut lanes = [false; LANES];
    for l in 0..LANES {
        let Some(s) = g.strand[l] else { continue };
        let (from, to) = (scene.root(&world[0], s, 0.0), scene.root(&world[1], s, 1.0));
        let jump = (Vec3::from(to.translation) - Vec3::from(from.translation)).norm();
        if jump > scene.settings.teleport {
            done.teleported[l] = true;
            g.carry(l, &from, &to);
            Keep::carried(g, l, &scene.span.body.at(1.0));
        } else if scene.is_calm(s) && scene.settings.sleep && g.quiet[l] >= 2 && stays(&from, &to) {
            done.asleep[l] = true;
        } else {
            lanes[l] = true;
        }
    }
    if !lanes.contains(&true) {
        return;
    }
    let saved = g.snapshot();
    if scene.settings.model == Model::Paper {
        let seconds = scene.span.seconds;
        let body = |f: f64| scene.solid().then(|| scene.span.body.at(f));
        let typical = (seconds / nine_steps::STEP - 1e-6).ceil().max(1.0) as u32;
        let span = nine_steps::Span {
            seconds,
            steps: scene.settings.substeps.unwrap_or(typical).max(1),
            width: method.width,
            strain_limit: method.strain_limit,
            friction: method.friction,
            body: &body,
        };
        nine_steps::advance(g, scene, &span, lanes, &mut done.done);
    } else {
        for k in 0..steps {
            let length = 1.0 / f64::from(steps);
            let at = Interval { start: f64::from(k) * length, length, span: scene.span.seconds };
            integrate::advance(g, scene, method, at, lanes, 0, work, &mut done.done);
        }
    }
    for l in 0..LANES {
        let Some(s) = g.strand[l] else { continue };
        if done.done.failed[l] {
            // Held: it rides with its root for this span, and starts again from rest.
            g.revert(l, &saved);
            g.carry(l, &scene.root(&world[0], s, 0.0), &scene.root(&world[1], s, 1.0));
            g.stop(l);
            Keep::carried(g, l, &scene.span.body.at(1.0));
        }
        if lanes[l] {
            let still = scene.is_calm(s) && done.done.speed[l] < SLEEP_SPEED;
            g.quiet[l] = if still { g.quiet[l] + 1 } else { 0 };
            if g.quiet[l] >= 2 && scene.settings.sleep {
                g.stop(l);
            }
        }
    }
    if scene.solid() {
        (done.corrected, done.deepest) = contact::correct(g, &scene.span.body.at(1.0), done.asleep);
    }
}

/// Whether a root is where it was, up to the rounding of coordinates that move.
fn stays(from: &Rigid, to: &Rigid) -> bool {
    let moved = (Vec3::from(to.translation) - Vec3::from(from.translation)).norm();
    let turned = from.quaternion().angle_to(&to.quaternion());
    moved <= ROUNDING && turned <= ROUNDING
}

/// What a group did in a span.
#[derive(Clone, Copy, Debug, Default)]
struct Moved {
    done: Done,
    teleported: [bool; LANES],
    asleep: [bool; LANES],
    corrected: u64,
    deepest: f64,
}

fn count_true(lanes: [bool; LANES]) -> u64 {
    lanes.iter().filter(|&&b| b).count() as u64
}
