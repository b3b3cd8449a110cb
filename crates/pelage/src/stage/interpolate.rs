//! Interpolate: every hair at every frame, from control hairs on the skin of that frame.

use super::look::{self, Displaced};
use super::run::{Counts, Runner};
use super::{What, comb, curves, groom, instance, simulate};
use crate::Error;
use crate::config::{CombKind, Target};
use crate::format::mcap;
use crate::project::SkinAt;
use pelage_geom::Vec3;
use pelage_groom::control::ControlHairs;
use pelage_groom::instance::Roots;
use pelage_groom::interpolate::{
    Blend, ControlPose, cut_lengths, interpolate, local_controls, pose_controls, root_positions, seen_from_roots,
    to_roots,
};
use rayon::prelude::*;
use std::rc::Rc;

/// What the interpolator reads of a layer, one entry a hair.
#[derive(Debug)]
pub struct LayerHairs {
    /// Points of a hair.
    pub points: usize,
    /// Roots on the rest skin.
    pub roots: Rc<Roots>,
    /// Control hairs.
    pub hair: Vec<[u32; 3]>,
    /// Their weights.
    pub weight: Vec<[f32; 3]>,
    /// Lengths before they are cut, scene units.
    whole: Vec<f32>,
    /// Lengths among control hairs as they are combed at rest, scene units.
    pub length: Vec<f32>,
}

fn layer(run: &mut Runner<'_>, i: usize) -> Result<Rc<LayerHairs>, Error> {
    if let Some(found) = run.layers.get(&i) {
        return Ok(found.clone());
    }
    let roots = instance::roots(run, i)?;
    let (hair, weight) = instance::weights(run, i)?;
    let whole = instance::column(run, What::Length(i), i)?;
    let control = comb::combed(run)?;
    let length = cut(run, &hair, &weight, &control, whole.clone());
    let points = run.project.base_points(i);
    let most = points.max(run.project.points(i));
    if u32::try_from(roots.id.len() * most).is_err() {
        let what = format!("{} hairs of {most} points are more than 2^32 points", roots.id.len());
        let help = "lower the density or the points, or make two layers of it";
        return Err(run.project.groom.error(&format!("layer[{i}].points"), what, help).into());
    }
    let found = Rc::new(LayerHairs { points, roots, hair, weight, whole, length });
    run.layers.insert(i, found.clone());
    Ok(found)
}

/// Positions of a layer's hairs at rest or at a frame, scene units relative to the skin's origin, hair after hair.
pub fn positions(run: &mut Runner<'_>, what: What) -> Result<Vec<[f32; 3]>, Error> {
    Ok(hairs(run, what)?.position)
}

/// A layer's hairs at rest or at a frame.
pub fn hairs(run: &mut Runner<'_>, what: What) -> Result<Displaced, Error> {
    let (i, at) = match what {
        What::Rest(i) | What::Finished(i) => (i, SkinAt::Rest),
        What::Frame(i, f) => (i, run.project.frames[&f].clone()),
        other => unreachable!("{other:?} has no positions"),
    };
    if let Some(entry) = run.fetch(what)
        && let Some(found) = entry.payload.into_iter().next().and_then(|b| mcap::read_frame_payload(&b).ok())
        && let Some(found) = unpacked(found)
    {
        return Ok(found);
    }
    let (base, cancelled) = match (what, run.project.target(i)) {
        (What::Finished(i), _) => (positions(run, What::Rest(i))?, 0),
        (What::Frame(_, f), Target::EveryHair) => (simulate::positions(run, i, f)?, 0),
        (What::Frame(_, f), _) if run.project.curves.is_some() => (curves::ridden(run, f)?, 0),
        _ if run.project.curves.is_some() => (curves::rest(run)?, 0),
        _ => blended(run, what, i, &at)?,
    };
    let count = match &run.project.curves {
        Some(_) => curves::hair(run)?.offsets.len(),
        None => instance::roots(run, i)?.id.len(),
    };
    let mut counts = Counts::from([
        ("hairs".to_owned(), count as u64),
        ("hairs with cancelled directions".to_owned(), cancelled as u64),
    ]);
    let out = look::finish(run, what, &at, base, &mut counts)?;
    counts.insert("points".to_owned(), out.position.len() as u64);
    let name = run.plan.step(what).name.clone();
    let mut file = std::io::Cursor::new(Vec::with_capacity(out.position.len() * 12 + 4096));
    let both: [&[[f32; 3]]; 2] = [&out.position, &out.wet];
    let arrays = if out.wet.is_empty() { &both[..1] } else { &both[..] };
    mcap::write_frame_payload(&mut file, &name, what.frame().unwrap_or(0), arrays)
        .expect("writing to memory does not fail");
    run.keep(what, counts, &[("frame.mcap", file.get_ref())])?;
    Ok(out)
}

/// Hairs as they lie in the cache: positions, and if they are wet factors on width and opacity and how wet.
fn unpacked(arrays: Vec<Vec<[f32; 3]>>) -> Option<Displaced> {
    let mut arrays = arrays.into_iter();
    let position = arrays.next()?;
    Some(Displaced { position, wet: arrays.next().unwrap_or_default() })
}

/// Hairs of a layer at rest before anything displaces them.
pub fn undisplaced(run: &mut Runner<'_>, i: usize) -> Result<Vec<[f32; 3]>, Error> {
    match run.project.target(i) {
        Target::EveryHair => positions(run, What::Rest(i)),
        _ => Ok(blended(run, What::Rest(i), i, &SkinAt::Rest)?.0),
    }
}

/// The same as control hairs are combed at a frame.
pub fn undisplaced_at(run: &mut Runner<'_>, i: usize, frame: i32) -> Result<Vec<[f32; 3]>, Error> {
    match run.project.target(i) {
        Target::Off => Ok(blended(run, What::Frame(i, frame), i, &SkinAt::Rest)?.0),
        _ => undisplaced(run, i),
    }
}

/// Control hairs that hair of a step is blended from.
fn controls(run: &mut Runner<'_>, what: What) -> Result<Rc<ControlHairs>, Error> {
    match what {
        What::Frame(_, f) if run.project.combs_move() => comb::combed_at(run, f),
        _ => comb::combed(run),
    }
}

/// Lengths among control hairs of which some were cut.
fn cut(
    run: &Runner<'_>,
    hair: &[[u32; 3]],
    weight: &[[f32; 3]],
    control: &ControlHairs,
    mut length: Vec<f32>,
) -> Vec<f32> {
    if run.project.groom.value.comb.iter().any(|c| matches!(c.kind, CombKind::Cut | CombKind::Trim)) {
        cut_lengths(hair, weight, &control.cut, &mut length);
    }
    length
}

/// Lengths of a layer's hairs at a frame where control hairs move, scene units: cut, and changed as those are that are hairs
/// themselves.
fn moved_lengths(run: &mut Runner<'_>, i: usize, layer: &LayerHairs, now: &ControlHairs) -> Result<Vec<f32>, Error> {
    let mut length = layer.whole.clone();
    if instance::is_by_hand(run, i) {
        let rest = comb::combed(run)?;
        for (length, [own, ..]) in length.iter_mut().zip(&layer.hair) {
            let [now, rest] = [now, &rest].map(|c| c.length(*own as usize));
            *length *= if rest > 0.0 { (now / rest) as f32 } else { 1.0 };
        }
    }
    Ok(cut(run, &layer.hair, &layer.weight, now, length))
}

/// Hairs blended from control hairs, and how many had directions that cancelled.
fn blended(run: &mut Runner<'_>, what: What, i: usize, at: &SkinAt) -> Result<(Vec<[f32; 3]>, usize), Error> {
    let skin = groom::skin(run)?;
    let layer = layer(run, i)?;
    let pose = groom::pose(run, at)?;
    let from_roots = run.project.groom.value.layer[i].root_frames;
    let moved = match what {
        What::Frame(_, f) if run.project.combs_move() => {
            let now = comb::combed_at(run, f)?;
            Some(moved_lengths(run, i, &layer, &now)?)
        }
        _ => None,
    };
    let control = match (what, run.project.target(i)) {
        (What::Frame(_, f), Target::ControlHairs) => {
            let simulated = simulate::positions(run, i, f)?;
            let mut lines: Vec<Vec3> = simulated.par_iter().map(|p| Vec3::from(p.map(f64::from))).collect();
            let points = run.project.segments() + 1;
            if from_roots {
                let control = &comb::combed(run)?.root;
                seen_from_roots(&mut lines, points, control, &skin.mesh, &skin.topology, &pose);
            }
            ControlPose::from_polylines(&lines, points, layer.points)
        }
        _ if from_roots => local_controls(&*controls(run, what)?, layer.points),
        _ => pose_controls(&*controls(run, what)?, &skin.mesh, &skin.topology, &pose, layer.points),
    };
    let root = root_positions(&skin.mesh, &pose, &layer.roots.root, skin.origin());
    let origin = vec![[0.0; 3]; if from_roots { root.len() } else { 0 }];
    let blend = Blend {
        root: if from_roots { &origin } else { &root },
        hair: &layer.hair,
        weight: &layer.weight,
        length: moved.as_ref().unwrap_or(&layer.length),
    };
    let mut out = vec![[0.0f32; 3]; layer.roots.id.len() * layer.points];
    let found = interpolate(&blend, &control, &mut out);
    if from_roots {
        to_roots(&skin.mesh, &skin.topology, &pose, &layer.roots.root, &root, layer.points, &mut out);
    }
    Ok((out, found.cancelled_hairs))
}
