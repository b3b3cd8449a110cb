//! Kept: of the hairs that a layer has, those that the shot needs (`[skip]`), once for all frames.

use super::plan_look::{Effect, acting_clumps, effects};
use super::run::{Counts, Runner};
use super::skin::{Texel, read_map};
use super::tables::{decode, encode, table};
use super::{What, clumps, groom, instance, layer_seed, preview};
use crate::Error;
use crate::format::ply::Column;
use crate::project::Project;
use pelage_geom::Vec3;
use pelage_groom::instance::Roots;
use pelage_groom::interpolate::root_positions;
use pelage_groom::keep::{around, kept, shares};
use pelage_groom::look::member::rest_sites;
use pelage_groom::look::vary::Drawn;
use pelage_light::visible::{Depths, Sight};
use rayon::prelude::*;
use std::rc::Rc;

/// Map value from which hair is made.
const OPEN: f32 = 0.5;

/// Least part of a layer's hairs that distance leaves: of fewer, single hairs show as bars.
const LEAST: f64 = 1.0 / 64.0;

/// How far hair comes from its root, in lengths: simulated hair stretches by up to a hundredth, and the look displaces it.
/// What curls and waves add beyond that the margin holds.
const REACH: f64 = 1.05;

/// Counts of hairs that are left out, by reason.
pub(super) const LEFT_OUT: [&str; 4] =
    ["hairs masked", "hairs out of the picture", "hairs behind the skin", "hairs thinned by distance"];

/// Hairs that are left.
#[derive(Debug)]
pub struct Kept {
    /// Their roots.
    pub roots: Rc<Roots>,
    /// Factor on their diameter: 1 over the part that distance leaves.
    pub wider: Vec<f32>,
}

/// Hairs of a layer that the shot needs.
pub fn kept_hairs(run: &mut Runner<'_>, i: usize) -> Result<Kept, Error> {
    let read = |bytes: &Vec<u8>| {
        let wider = decode(bytes)?.get("hair")?.f32("wider")?.to_vec();
        Some(Kept { roots: Rc::new(instance::decode_roots(bytes)?), wider })
    };
    if let Some(found) = run.fetch(What::Kept(i)).and_then(|e| read(e.payload.first()?)) {
        return Ok(found);
    }
    let all = instance::grown(run, i)?;
    let mut counts = Counts::new();
    let Choice { keep, wider } = choose(run, i, &all, &mut counts)?;
    let roots = kept(&all, &keep);
    let wider: Vec<f32> = wider.iter().zip(&keep).filter(|(_, k)| **k).map(|(w, _)| *w).collect();
    counts.insert("hairs that the shot needs".to_owned(), roots.id.len() as u64);
    let mut columns = instance::roots_columns(&roots);
    columns.push(("wider", Column::F32(wider.clone())));
    let file = encode("hairs that the shot needs: as hairs, and a factor on the diameter", &[table("hair", columns)]);
    run.keep(What::Kept(i), counts, &[("data.ply", &file)])?;
    Ok(Kept { roots: Rc::new(roots), wider })
}

/// Which hairs are kept, and how much wider each is.
struct Choice {
    keep: Vec<bool>,
    wider: Vec<f32>,
}

fn choose(run: &mut Runner<'_>, i: usize, all: &Roots, counts: &mut Counts) -> Result<Choice, Error> {
    let project = run.project;
    let (skip, unit) = (&project.shot.value.skip, project.shot.value.shot.meters_per_unit);
    let margin = skip.margin(unit);
    let skin = groom::skin(run)?;
    let (position, _) = rest_sites(&groom::view(&skin), &all.root, skin.origin());
    let n = all.id.len();
    // Why a hair is left out, as `LEFT_OUT` has it; of several reasons the first.
    let mut why: Vec<Option<usize>> = vec![None; n];
    if let (Some(m), Some(tiles)) = (&skip.mask, &project.mask) {
        let map = read_map(tiles, m, Texel::Value, &mut run.warnings)?;
        let open: Vec<bool> = all.uv.par_iter().map(|uv| map.value(*uv) >= OPEN).collect();
        let near = around(&position, &open, margin as f32);
        (0..n).filter(|h| !near[*h]).for_each(|h| why[h] = Some(0));
    }
    let mut wider = vec![1.0f32; n];
    if skip.sees() {
        let found = seen(run, i, all, margin)?;
        let unseen = |sight: Sight| match sight {
            Sight::Seen => None,
            Sight::Outside => Some(1),
            Sight::Hidden => Some(2),
        };
        if skip.camera {
            (0..n).for_each(|h| why[h] = why[h].or(unseen(found[h].0)));
        }
        // Hairs by hand are of no density.
        if let Some(lod) = skip.lod.filter(|_| project.groom.value.layer[i].hairs.is_empty()) {
            let density = instance::density(run, i)?;
            for (h, share) in shares(all, &density.view(), skin.area()).into_iter().enumerate() {
                let part = (f64::from(found[h].1) / lod).clamp(LEAST, 1.0) as f32;
                wider[h] = 1.0 / part;
                why[h] = why[h].or((share > part).then_some(3));
            }
        }
    }
    let mut keep: Vec<bool> = why.iter().map(Option::is_none).collect();
    if keep.iter().any(|k| !*k) {
        add_centres(run, i, all, &position, &mut keep)?;
    }
    let centres: Vec<usize> = (0..n).filter(|h| keep[*h] && why[*h].is_some()).collect();
    // A centre that is there for its clump only is no wider than it was.
    centres.iter().for_each(|h| wider[*h] = 1.0);
    for (k, name) in LEFT_OUT.iter().enumerate() {
        let count = (0..n).filter(|h| !keep[*h] && why[*h] == Some(k)).count() as u64;
        counts.extend((count > 0).then(|| ((*name).to_owned(), count)));
    }
    counts.insert("hairs kept as centres of clumps".to_owned(), centres.len() as u64);
    let layer = &project.groom.value.layer[i].name;
    counts.insert(format!("hairs needed in layer {layer}"), keep.iter().filter(|k| **k).count() as u64);
    if n > 0 && !keep.contains(&true) {
        run.warnings.push(format!("layer {layer}: [skip] leaves none of its {n} hairs"));
    }
    Ok(Choice { keep, wider })
}

/// What the camera sees of each hair over all frames, with a margin around it: of sights the best, of widths in pixels the largest.
fn seen(run: &mut Runner<'_>, i: usize, all: &Roots, margin: f64) -> Result<Vec<(Sight, f32)>, Error> {
    let project = run.project;
    let skin = groom::skin(run)?;
    let length = instance::feature(run, What::Length(i), i, all)?;
    // Only distance asks how wide hairs are.
    let width = match project.shot.value.skip.lod {
        Some(_) => instance::feature(run, What::Width(i), i, all)?,
        None => Vec::new(),
    };
    let unit = project.shot.value.shot.meters_per_unit;
    let size = project.shot.value.preview.size.map(|s| s as usize);
    let origin = Vec3::from(skin.origin());
    let mut found = vec![(Sight::Outside, 0.0f32); all.id.len()];
    for (frame, at) in &project.frames {
        run.working(&format!("what the camera sees at {frame}"));
        let camera = preview::shot_camera(project, *frame).expect("checked: what the camera decides has one");
        let pose = groom::pose(run, at)?;
        let depths = Depths::new(&camera, size, &pose.position, &skin.mesh.triangle);
        let root = root_positions(&skin.mesh, &pose, &all.root, skin.origin());
        found.par_iter_mut().enumerate().for_each(|(h, (best, pixels))| {
            let centre = origin + Vec3::from(root[h].map(f64::from));
            let reach = f64::from(length[h]) * REACH;
            if let Some(width) = width.get(h) {
                let width = f64::from(*width) * 1e-6 / unit;
                *pixels = pixels.max(depths.pixels(centre, reach, width) as f32);
            }
            if *best != Sight::Seen {
                match depths.sight(centre, reach + margin) {
                    Sight::Outside => {}
                    sight => *best = sight,
                }
            }
        });
    }
    Ok(found)
}

/// Keeps the centres that hairs which are kept are drawn to, level after level: whatever is in a clump of a finer level goes
/// where the centre of that goes.
/// True if the centres of clumps are found among all hairs of their region or cluster.
fn needs_all(project: &Project, i: usize) -> bool {
    let layer = &project.groom.value.layer[i];
    let found = |k: usize| layer.clump[k].regions.is_some() || layer.clump[k].clusters.is_some();
    effects(project, i).concat().contains(&Effect::Cluster) || acting_clumps(project, i).into_iter().any(found)
}

fn add_centres(
    run: &mut Runner<'_>,
    i: usize,
    all: &Roots,
    position: &[[f32; 3]],
    keep: &mut [bool],
) -> Result<(), Error> {
    let layer = &run.project.groom.value.layer[i];
    let hairs = Drawn { id: &all.id, uv: &all.uv, position, seed: u64::from(layer_seed(&layer.name)) };
    if needs_all(run.project, i) {
        run.warn_once(format!("layer {}: its clusters or regions need all hairs: [skip] leaves none out", layer.name));
        keep.fill(true);
        return Ok(());
    }
    for k in acting_clumps(run.project, i) {
        let centre = clumps::centre_hairs(run, i, k, &hairs, &[])?;
        let reach = clumps::sizes(run, i, k, &hairs)?.most();
        let near = around(position, keep, reach);
        centre.into_iter().map(|h| h as usize).filter(|h| near[*h]).for_each(|h| keep[h] = true);
    }
    Ok(())
}
