//! Simulate: hair in motion, one stretch of frames after another, each from the checkpoint at the end of the one before.

mod material;
mod moment;

use super::body::{self, Colliders};
use super::run::{Counts, Runner};
use super::{What, instance};
use crate::Error;
use crate::cache::LongStep;
use crate::config::StrandModel;
use crate::format::mcap;
use crate::timeline::Timeline;
use material::materials;
use moment::{Source, check_at_rest, moment, rest_region, source, still};
use pelage_geom::Vec3;
use pelage_sim::{Hairs, Model, Rigid, Settings, SimError, Simulation, Span, SpanReport, Started};
use rayon::prelude::*;
use std::time::Instant;

/// Checkpoints within a stretch take at most this share of the time: a run that is killed loses about as little as that
/// allows. Much more is felt, much less loses minutes of a large groom.
const SAVING: f64 = 0.03;

/// Strands that a warning names.
const NAMED: usize = 8;

/// Count of strands at rest: what the stage skips.
pub(super) const SLEEPING: &str = "sleeping_strands";

/// Hairs at rest and all hairs, summed over frames: what the stage skips.
pub(super) const SKIPPED: [&str; 2] = ["sleeping_hair_frames", "hair_frames"];

/// Count of strands that can't twist: they have one unknown less a point.
pub(super) const UNTWISTED: &str = "strands that can't twist";

/// Counts that add up over stretches; of others the largest counts.
pub(super) const SUMMED: [&str; 6] = [
    "particle steps",
    "strands carried over a jump",
    "strands held for a frame",
    "roots held for a frame",
    SKIPPED[0],
    SKIPPED[1],
];

/// A layer in motion, kept from one stretch to the next.
pub(super) struct Running {
    layer: usize,
    /// The frame that it has come to.
    frame: i64,
    sim: Simulation,
    source: Source,
}

/// Positions of a simulated layer at a frame, scene units relative to the skin's origin.
pub fn positions(run: &mut Runner<'_>, i: usize, frame: i32) -> Result<Vec<[f32; 3]>, Error> {
    let what = What::Simulate(i, Timeline::new(run.project).stretch_of(frame));
    let read = |run: &Runner<'_>| {
        let bytes = run.fetch_file(what, &frame_file(i64::from(frame)))?;
        mcap::read_frame_payload(&bytes).ok()?.into_iter().next()
    };
    if let Some(found) = read(run) {
        return Ok(found);
    }
    make(run, what)?;
    let lost = std::io::Error::other("a simulated frame can't be read back");
    read(run).ok_or_else(|| Error::disk(&run.project.cache_dir())(lost))
}

fn frame_file(frame: i64) -> String {
    format!("frame.{frame}.mcap")
}

fn state_file(frame: i64) -> String {
    format!("state.{frame}.mcap")
}

/// Simulates a stretch.
pub fn make(run: &mut Runner<'_>, what: What) -> Result<(), Error> {
    let What::Simulate(i, k) = what else { unreachable!("{what:?} is not simulated") };
    let project = run.project;
    let timeline = Timeline::new(project);
    let (first, end) = timeline.stretch(k).into_inner();
    let cache = project.cache_dir();
    let disk = || Error::disk(&cache);
    let forced = run.is_forced(what);
    let mut step = run.store.long_step(&run.plan.step(what).recipe, forced).map_err(disk())?;
    let mut at = saved(&step);
    if at.is_none() && !forced {
        at = shorter(run, &mut step, i, k)?;
    }
    let begin = at.unwrap_or(*timeline.simulated(k).start() - 1);
    let mut running = match run.running.take().filter(|r| r.layer == i && r.frame == begin) {
        Some(running) => running,
        None => {
            let (mut running, started) = start(run, i, &timeline)?;
            running.frame = begin;
            let state = match at {
                Some(_) => step.read(&state_file(begin)),
                None if k > 0 => Some(state_before(run, What::Simulate(i, k - 1), begin)?),
                None => None,
            };
            if let Some(state) = state {
                let state = mcap::read_state_payload(&state).map_err(|e| Error::input(e, "delete the cache folder"))?;
                running.sim.restore(&state).map_err(|e| failed(run, i, &e))?;
            }
            note_start(run, i, &running, &started, &mut step)?;
            running
        }
    };
    for frame in first..=at.unwrap_or(first - 1) {
        run.simulated(frame, false);
    }
    advance(run, &timeline, &mut running, &mut step, k, end)?;
    let counts = step.finish(&run.store).map_err(disk())?;
    run.kept(what, counts);
    // The last stretch needs no more; the first frames of a stretch may be asked for again after damage.
    run.running = (end < timeline.last).then_some(running);
    Ok(())
}

/// The frame that a killed run had come to.
fn saved(step: &LongStep) -> Option<i64> {
    let states = step.files().filter_map(|f| f.strip_prefix("state.")?.strip_suffix(".mcap")?.parse().ok());
    states.max()
}

/// Takes over the frames and the last state of this stretch from a time when the shot ended earlier.
fn shorter(run: &Runner<'_>, step: &mut LongStep, i: usize, k: u32) -> Result<Option<i64>, Error> {
    let found = run.plan.shorter(run.project, i, k).find(|(_, key)| run.store.contains(key));
    let Some((end, key)) = found else { return Ok(None) };
    let first = *Timeline::new(run.project).stretch(k).start();
    let names = (first..=end).map(frame_file).chain([state_file(end)]);
    let files: Option<Vec<(String, Vec<u8>)>> = names.map(|n| Some((n.clone(), run.store.file(&key, &n)?))).collect();
    let Some(files) = files else { return Ok(None) };
    let cache = run.project.cache_dir();
    let mut keep = || -> std::io::Result<()> {
        for (name, bytes) in &files {
            step.write(name, bytes)?;
        }
        step.counts().extend(run.store.counts(&key).unwrap_or_default());
        step.save("state.", &state_file(end))
    };
    keep().map_err(Error::disk(&cache))?;
    Ok(Some(end))
}

/// State at the end of the stretch before; a damaged one is simulated again.
fn state_before(run: &mut Runner<'_>, what: What, end: i64) -> Result<Vec<u8>, Error> {
    let name = state_file(end);
    if let Some(found) = run.fetch_file(what, &name) {
        return Ok(found);
    }
    make(run, what)?;
    let lost = std::io::Error::other("a checkpoint can't be read back");
    run.fetch_file(what, &name).ok_or_else(|| Error::disk(&run.project.cache_dir())(lost))
}

/// The hairs of a layer at rest, ready to move.
fn start(run: &mut Runner<'_>, i: usize, timeline: &Timeline<'_>) -> Result<(Running, Started), Error> {
    let source = source(run, i)?;
    let settings = settings(run, i);
    let shot = &run.project.shot.value;
    let points = settings.segments.map_or(source.position.len() / source.id.len().max(1), |s| s + 1);
    let bytes = Simulation::memory(source.id.len(), points);
    let name = &run.project.groom.value.layer[i].name;
    run.say(&format!("{} hairs of {points} points in {name}: about {}", source.id.len(), size(bytes)));
    let material = materials(run, i, &source)?;
    let hairs = Hairs { offsets: &source.offsets, position: &source.position, id: &source.id, material: &material };
    let gravity = shot.simulate.gravity.downward(shot.shot.up).at(timeline.start() as f64);
    let (sim, started) = Simulation::new(&hairs, &settings, gravity).map_err(|e| failed(run, i, &e))?;
    let running = Running { layer: i, frame: timeline.start(), sim, source };
    if timeline.preroll == 0 {
        check_at_rest(run, timeline, &running.source)?;
    }
    Ok((running, started))
}

fn size(bytes: u64) -> String {
    let mega = bytes as f64 / 1e6;
    if mega < 1000.0 { format!("{:.0} MB", mega.ceil()) } else { format!("{:.1} GB", mega / 1e3) }
}

fn settings(run: &Runner<'_>, i: usize) -> Settings {
    let s = &run.project.shot.value.simulate;
    Settings {
        model: match s.model {
            StrandModel::Rod => Model::Rod,
            StrandModel::Springs => Model::Springs,
            StrandModel::Paper => Model::Paper,
        },
        material: run.project.material(i).1.si(|_| 1.0),
        segments: if run.project.curves.is_some() { s.segments } else { Some(run.project.segments()) },
        substeps: s.substeps,
        tolerance: s.tolerance.unwrap_or(Settings::default().tolerance),
        sag_free: run.project.sag_free(),
        strain_limit: s.strain_limit,
        friction: s.friction,
        offset: s.offset * 1e-3,
        teleport: s.teleport,
        sleep: s.sleep,
        ..Settings::default()
    }
}

fn failed(run: &Runner<'_>, i: usize, e: &SimError) -> Error {
    if matches!(e, SimError::Stopped) {
        return Error::Stopped;
    }
    Error::input(format!("layer {} can't be simulated: {e}", run.project.groom.value.layer[i].name), "")
}

/// Counts and warnings of what a simulation starts with.
fn note_start(
    run: &mut Runner<'_>,
    i: usize,
    running: &Running,
    started: &Started,
    step: &mut LongStep,
) -> Result<(), Error> {
    let hairs = match &run.project.curves {
        Some(_) => running.source.id.len(),
        None => instance::roots(run, i)?.id.len(),
    };
    let layer = &run.project.groom.value.layer[i].name;
    let counts = step.counts();
    for (name, n) in [
        ("hairs", hairs as u64),
        ("simulated", running.source.id.len() as u64),
        ("particles", started.particles),
        (UNTWISTED, started.untwisted),
        ("strands stiffened so that their pose can stand", started.stiffened.len() as u64),
        ("strands too short to simulate", started.rigid.len() as u64),
    ] {
        counts.insert(name.to_owned(), n);
    }
    if !started.stiffened.is_empty() {
        let ids: Vec<u64> = started.stiffened.iter().map(|s| s.id).collect();
        let most = started.stiffened.iter().map(|s| s.factor).fold(0.0, f64::max);
        let text =
            format!("layer {layer}: strands stiffened (up to {most:.2} times) to stand as groomed: {}", list(&ids));
        run.warnings.push(text);
    }
    Ok(())
}

fn list(ids: &[u64]) -> String {
    let named: Vec<String> = ids.iter().take(NAMED).map(u64::to_string).collect();
    let more = if ids.len() > NAMED { format!(" and {} more", ids.len() - NAMED) } else { String::new() };
    named.join(", ") + &more
}

/// Simulates up to frame `end` and keeps every frame of the shot and a checkpoint now and then.
fn advance(
    run: &mut Runner<'_>,
    timeline: &Timeline<'_>,
    running: &mut Running,
    step: &mut LongStep,
    k: u32,
    end: i64,
) -> Result<(), Error> {
    let project = run.project;
    let shot = &project.shot.value;
    let unit = shot.shot.meters_per_unit;
    let cache = project.cache_dir();
    let disk = || Error::disk(&cache);
    let (gravity, wind) = (shot.simulate.gravity.downward(shot.shot.up), shot.simulate.wind.as_ref());
    let (layer, arrival) = (&project.groom.value.layer[running.layer].name, timeline.arrival());
    let origin = run.origin()?;
    let region = rest_region(run, &running.source)?;
    let colliders = body::colliders(run, running.layer, body::deforms(timeline), region)?;
    let colliders: &Colliders = &colliders;
    let seconds = 1.0 / shot.shot.fps;
    let mut before = moment(run, timeline, &running.source, colliders, running.frame)?;
    let (mut saved, mut saving) = (Instant::now(), 0.0);
    // Without pre-roll the first frame is the start.
    if running.frame == timeline.first
        && k == 0
        && timeline.preroll == 0
        && !step.files().any(|f| f.starts_with("frame"))
    {
        keep_frame(run, running, step, unit, origin)?;
        checkpoint(running, step).map_err(disk())?;
    }
    while running.frame < end {
        let (from, frame) = (running.frame as f64, running.frame + 1);
        let now = moment(run, timeline, &running.source, colliders, frame)?;
        let ends_of_skin = before.end.clone().zip(now.end.clone());
        let moving = ends_of_skin.and_then(|(a, b)| colliders.moving([a, b], seconds));
        let placements = [before.placement, now.placement];
        let motion = |f: f64| match timeline.rigid(arrival, from + f) {
            Some(t) => placement(&t, unit),
            None => colliders.between(&placements, f),
        };
        let winds = wind.map(|w| [from, frame as f64].map(|f| w.at(f, shot.shot.fps)));
        let own = colliders.motions(from, unit);
        let body = colliders.body(&motion, &own, moving.as_ref(), seconds);
        let still = match (&before.skin, &now.skin) {
            (Some(a), Some(b)) if own.iter().all(|m| m(0.0) == m(0.5) && m(0.0) == m(1.0)) => {
                still(run, &running.source, a, b)?
            }
            (Some(_), Some(_)) => vec![false; running.source.id.len()],
            _ => Vec::new(),
        };
        let span = Span {
            seconds,
            time: timeline.seconds(from),
            motion: &motion,
            roots: [&before.root, &now.root],
            tips: None,
            body: &body,
            gravity: [gravity.at(from), gravity.at(frame as f64)],
            wind: winds.as_ref().map(|[a, b]| [a, b]),
            still: &still,
        };
        let clock = Instant::now();
        let ticker = run.ticker(&format!("{layer} {frame}"));
        let report = running.sim.advance(&span, &ticker).map_err(|e| failed(run, running.layer, &e))?;
        running.frame = frame;
        note(run, (layer, running.source.id.len()), frame, &report, step.counts(), clock.elapsed().as_secs_f64());
        if frame >= *timeline.stretch(k).start() {
            keep_frame(run, running, step, unit, origin)?;
        }
        if frame == end || saved.elapsed().as_secs_f64() * SAVING >= saving {
            let clock = Instant::now();
            checkpoint(running, step).map_err(disk())?;
            (saved, saving) = (Instant::now(), clock.elapsed().as_secs_f64());
        }
        before = now;
    }
    Ok(())
}

/// Keeps the frame that the hair has come to.
fn keep_frame(
    run: &mut Runner<'_>,
    running: &Running,
    step: &mut LongStep,
    unit: f64,
    origin: [f64; 3],
) -> Result<(), Error> {
    let scene = |p: &[f64; 3]| std::array::from_fn::<f32, 3, _>(|x| (p[x] / unit - origin[x]) as f32);
    let positions: Vec<[f32; 3]> = running.sim.positions().par_iter().map(scene).collect();
    let bytes = frame_bytes(running.frame, &positions);
    step.write(&frame_file(running.frame), &bytes).map_err(Error::disk(&run.project.cache_dir()))?;
    run.simulated(running.frame, true);
    Ok(())
}

/// Keeps the state, from which a run goes on after a kill.
fn checkpoint(running: &Running, step: &mut LongStep) -> std::io::Result<()> {
    let name = state_file(running.frame);
    step.write(&name, &mcap::write_state_payload("state", running.frame, &running.sim.save()))?;
    step.save("state.", &name)
}

fn frame_bytes(frame: i64, positions: &[[f32; 3]]) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::with_capacity(positions.len() * 12 + 4096));
    let frame = i32::try_from(frame).expect("a frame of the shot");
    mcap::write_frame_payload(&mut file, "simulate", frame, &[positions]).expect("writing to memory does not fail");
    file.into_inner()
}

/// `world = rotation (rest - pivot) + pivot + translation` in metres, without the pivot.
pub(super) fn placement(t: &pelage_geom::motion::RigidTransform, unit: f64) -> Rigid {
    let at = t.apply(Vec3::zeros()) * unit;
    Rigid { rotation: t.rotation, translation: at.into() }
}

/// Counts of a frame, what is odd in it, and how it goes.
fn note(
    run: &mut Runner<'_>,
    (layer, hairs): (&str, usize),
    frame: i64,
    r: &SpanReport,
    counts: &mut Counts,
    seconds: f64,
) {
    let mut most = |name: &str, n: u64| {
        let at = counts.entry(name.to_owned()).or_default();
        *at = n.max(*at);
    };
    most(SLEEPING, r.sleeping);
    most("points that the exact mesh pushed out", r.corrected);
    // In the pre-roll points that the groom put inside come out.
    if frame >= i64::from(run.project.shot.value.shot.frames[0]) {
        most("deepest point, micrometres", (r.deepest * 1e6).round() as u64);
    }
    most("strands that took steps of their own", r.subdivided);
    most("largest strain, millionths", (r.largest_strain * 1e6).round() as u64);
    let values =
        [r.particle_steps, r.teleported, r.held.len() as u64, r.bad_roots.len() as u64, r.sleeping, hairs as u64];
    SUMMED.into_iter().zip(values).for_each(|(name, n)| *counts.entry(name.to_owned()).or_default() += n);
    let odd = [
        (&r.stopped, "strands moved too violently to be followed and were stopped"),
        (&r.held, "strands diverged and were held"),
        (&r.bad_roots, "roots are not numbers: held"),
    ];
    for (ids, what) in odd {
        if !ids.is_empty() {
            run.warnings.push(format!("layer {layer}, frame {frame}: {} {what}: {}", ids.len(), list(ids)));
        }
    }
    let rate = r.particle_steps as f64 / seconds.max(1e-9) / 1e6;
    let (strain, dt) = (100.0 * r.largest_strain, 1e3 * r.shortest_step);
    run.working(&format!("{layer} {frame}: {rate:.1} M points x steps/s, strain {strain:.2} %, dt {dt:.3} ms"));
}
