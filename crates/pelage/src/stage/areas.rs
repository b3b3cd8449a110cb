//! Animated clump areas: where particles have hit the skin, frame after frame, and what they do to clumps.

use super::clumps::RestSites;
use super::run::{Counts, Runner};
use super::tables::{decode, encode, root_columns, roots_of, table};
use super::{What, groom};
use crate::Error;
use crate::config::{Emitter as Settings, Keyed};
use crate::format::csv;
use crate::format::ply::Column;
use crate::project::SkinAt;
use pelage_geom::{Bvh, NONE, SurfacePoint};
use pelage_groom::areas::{Area, AreaLaw, Centres, Emitter, Hit, Particle, areas, hits as find_hits, wetness};
use pelage_groom::look::member::Members;
use std::ops::Range;
use std::rc::Rc;

/// Hits of every emitter up to the end of a frame.
pub type Hits = Vec<Vec<Hit>>;

/// Hits up to the end of a frame: those of the frame before, and those of particles that leave in this one.
pub fn hits(run: &mut Runner<'_>, frame: i32) -> Result<Rc<Hits>, Error> {
    if let Some((_, found)) = run.hits.as_ref().filter(|(f, _)| *f == frame) {
        return Ok(found.clone());
    }
    let what = What::Hits(frame);
    let emitters = run.project.groom.value.emitter.len();
    let found = match run.fetch(what).and_then(|e| read(e.payload.first()?, emitters)) {
        Some(found) => found,
        None => find(run, frame)?,
    };
    let found = Rc::new(found);
    run.hits = Some((frame, found.clone()));
    Ok(found)
}

fn find(run: &mut Runner<'_>, frame: i32) -> Result<Hits, Error> {
    let project = run.project;
    let emitters = &project.groom.value.emitter;
    let mut all = match project.frames.range(..frame).next_back() {
        Some((before, _)) => hits(run, *before)?.to_vec(),
        None => vec![Vec::new(); emitters.len()],
    };
    let first = project.shot.value.shot.frames[0];
    let emitters = 0..emitters.len();
    let now = emitters.clone().map(|k| particles(run, k, frame..frame + 1)).collect::<Result<Vec<_>, _>>()?;
    let launched = emitters.map(|k| launched(run, k, first..frame + 1)).sum::<Result<usize, _>>()?;
    if frame == first {
        note_early(run, first)?;
    }
    let at = &project.frames[&frame];
    if now.iter().any(|p| !p.is_empty()) {
        let skin = groom::skin(run)?;
        let posed;
        let (bvh, placement) = match at {
            SkinAt::Rest => (skin.bvh(), None),
            SkinAt::Rigid(t) => (skin.bvh(), Some(t)),
            SkinAt::File(_) => {
                posed = Bvh::build(&groom::pose(run, at)?.position, &skin.mesh.triangle, &skin.topology);
                (&posed, None)
            }
        };
        for (all, particles) in all.iter_mut().zip(&now) {
            all.extend(find_hits(particles, bvh, placement));
        }
    }
    let on_skin: usize = all.iter().map(Vec::len).sum();
    let counts = [("particles on the skin", on_skin), ("particles past the skin", launched - on_skin)];
    let counts: Counts = counts.map(|(name, n)| (name.to_owned(), n as u64)).into();
    run.keep(What::Hits(frame), counts, &[("data.ply", &write(&all))])?;
    Ok(all)
}

/// Where the particles of an emitter come from.
enum Source {
    File(Rc<Vec<Particle>>),
    Emitter(Emitter),
}

fn source(run: &mut Runner<'_>, k: usize) -> Result<Option<Source>, Error> {
    if !run.project.opens_areas(k) {
        return Ok(None);
    }
    let shot = &run.project.shot.value.shot;
    if let Some(file) = &run.project.particles[k] {
        if let Some(found) = run.particles.get(&k) {
            return Ok(Some(Source::File(found.clone())));
        }
        let read = Rc::new(csv::read_particles(&file.path, shot.fps)?);
        run.particles.insert(k, read.clone());
        return Ok(Some(Source::File(read)));
    }
    let e = &run.project.groom.value.emitter[k];
    let keys = e.position.iter().flat_map(|p| p.vectors().0);
    Ok(Some(Source::Emitter(Emitter {
        position: keys.map(|k| (k.frame, k.value)).collect(),
        direction: e.direction.map_or([0.0; 3], |d| d.0),
        spread: e.spread,
        rate: e.rate,
        seed: u64::from(e.seed),
        frames: e.frames.unwrap_or(shot.frames),
    })))
}

/// True for particles that leave from the start of `frames.start` to the start of `frames.end`.
fn leaves(frames: &Range<i32>) -> impl Fn(&&Particle) -> bool {
    let frames = f64::from(frames.start)..f64::from(frames.end);
    move |p| frames.contains(&p.time)
}

/// Particles of an emitter that leave in some frames.
fn particles(run: &mut Runner<'_>, k: usize, frames: Range<i32>) -> Result<Vec<Particle>, Error> {
    let fps = run.project.shot.value.shot.fps;
    Ok(match source(run, k)? {
        Some(Source::File(all)) => all.iter().filter(leaves(&frames)).copied().collect(),
        Some(Source::Emitter(e)) => e.particles(frames, fps),
        None => Vec::new(),
    })
}

/// How many they are.
fn launched(run: &mut Runner<'_>, k: usize, frames: Range<i32>) -> Result<usize, Error> {
    let fps = run.project.shot.value.shot.fps;
    Ok(match source(run, k)? {
        Some(Source::File(all)) => all.iter().filter(leaves(&frames)).count(),
        Some(Source::Emitter(e)) => {
            let numbers = e.numbers(frames, fps);
            (numbers.end - numbers.start) as usize
        }
        None => 0,
    })
}

/// Particles that leave before the shot begins meet no skin: that is told.
fn note_early(run: &mut Runner<'_>, first: i32) -> Result<(), Error> {
    for (k, e) in run.project.groom.value.emitter.iter().enumerate() {
        let early = match e.file {
            Some(_) => launched(run, k, i32::MIN..first)?,
            None if e.frames.is_some_and(|f| f[0] < first) && run.project.opens_areas(k) => 1,
            None => 0,
        };
        if early > 0 {
            let name = &e.name;
            run.warnings.push(format!("emitter {name}: particles that leave before frame {first} open no areas"));
        }
    }
    Ok(())
}

fn write(all: &Hits) -> Vec<u8> {
    let flat = || all.iter().enumerate().flat_map(|(k, hits)| hits.iter().map(move |h| (k, h)));
    let root: Vec<SurfacePoint> = flat().map(|(_, h)| h.point).collect();
    let mut columns = root_columns(&root);
    columns.push(("emitter", Column::U32(flat().map(|(k, _)| k as u32).collect())));
    columns.push(("number", Column::U32(flat().map(|(_, h)| h.number as u32).collect())));
    columns.push(("time", Column::F64(flat().map(|(_, h)| h.time).collect())));
    encode("particles on the skin: where, of which emitter, when (frames)", &[table("hit", columns)])
}

fn read(bytes: &[u8], emitters: usize) -> Option<Hits> {
    let file = decode(bytes)?;
    let t = file.get("hit")?;
    let Column::F64(time) = t.column("time")? else { return None };
    let (emitter, number, point) = (t.u32("emitter")?, t.u32("number")?, roots_of(t)?);
    let mut all = vec![Vec::new(); emitters];
    for i in 0..t.rows {
        all.get_mut(emitter[i] as usize)?.push(Hit { number: u64::from(number[i]), time: time[i], point: point[i] });
    }
    Some(all)
}

/// Clump percent and rate of every hair of a level at a frame: those of its clump's centre in the areas that are open.
pub fn strengths(
    run: &mut Runner<'_>,
    i: usize,
    k: usize,
    frame: i32,
    m: &Members,
    sites: &RestSites,
) -> Result<[Vec<f32>; 2], Error> {
    let (skin, hits) = (groom::skin(run)?, hits(run, frame)?);
    let groom = &run.project.groom.value;
    let named = &groom.layer[i].clump[k].areas;
    let origin = skin.origin();
    let (mesh, topology, rest) = (&skin.mesh, &skin.topology, &skin.rest);
    let place = |p: &SurfacePoint| {
        let f = rest.frame(mesh, topology, p);
        (f.origin.into(), [f.n.x as f32, f.n.y as f32, f.n.z as f32])
    };
    let open = |(e, hits): (&Settings, &Vec<Hit>)| areas(hits, &law(e), f64::from(frame), place);
    let acting = groom.emitter.iter().zip(hits.iter()).filter(|(e, _)| named.contains(&e.name));
    let all: Vec<Area> = acting.flat_map(open).collect();
    let scene = |h: &u32| std::array::from_fn(|x| f64::from(sites.position[*h as usize][x]) + origin[x]);
    let root: Vec<[f64; 3]> = m.centre.iter().map(scene).collect();
    let normal: Vec<[f32; 3]> = m.centre.iter().map(|h| sites.normal[*h as usize]).collect();
    let wet = wetness(&all, &Centres { root: &root, normal: &normal });
    let of = |x: usize| m.clump.iter().map(|c| if *c == NONE { 0.0 } else { wet[*c as usize][x] }).collect();
    Ok([of(0), of(1)])
}

fn law(e: &Settings) -> AreaLaw {
    let keys = |k: &Keyed<f64>| k.0.iter().map(|k| (k.frame, k.value)).collect();
    AreaLaw { radius: keys(&e.radius), percent: keys(&e.percent), rate: keys(&e.clump_rate) }
}
