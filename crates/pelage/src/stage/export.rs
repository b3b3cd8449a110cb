//! Export: finished hair for other programs. Every file is written beside its place, read back and checked, and only
//! then renamed.

use super::plan_light::written_lights;
use super::plan_look::{finished_rest, is_wet};
use super::run::{Counts, Runner};
use super::{Step, What, curves, groom, instance, interpolate, shadow};
use crate::Error;
use crate::config::{ExportFormat, UpAxis};
use crate::files::unfinished;
use crate::format::mcap::{self, McapHair};
use crate::format::{FormatError, HairFrame, HairLayer, ShotFacts, ply, usd::UsdHair};
use pelage_geom::Offsets;
use pelage_groom::along::{point_colors, point_widths};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A file that a step has written, as kept in the cache.
#[derive(Debug, Serialize, Deserialize)]
struct Receipt {
    name: String,
    bytes: u64,
    blake3: String,
}

/// True if the files of a step lie in the output folder as they were written.
pub fn is_written(run: &Runner<'_>, step: &Step) -> bool {
    let out = run.project.out_dir();
    let Some(entry) = run.store.get(&step.key) else { return false };
    let receipts: Option<Vec<Receipt>> = entry.payload.first().and_then(|b| serde_json::from_slice(b).ok());
    receipts.is_some_and(|r| {
        r.iter().all(|r| {
            let path = out.join(&r.name);
            path.metadata().is_ok_and(|m| m.len() == r.bytes) && run.file_hash(&path).is_some_and(|h| h == r.blake3)
        })
    })
}

/// Renames finished files into the output folder and keeps the receipt.
pub fn publish(run: &mut Runner<'_>, what: What, files: Vec<(PathBuf, String)>) -> Result<(), Error> {
    let out = run.project.out_dir();
    let mut receipts = Vec::new();
    for (part, name) in &files {
        let blake3 = crate::cache::hash_file(part).map_err(Error::disk(part))?;
        let bytes = part.metadata().map_err(Error::disk(part))?.len();
        receipts.push(Receipt { name: name.clone(), bytes, blake3 });
    }
    for (part, name) in &files {
        let place = out.join(name);
        std::fs::rename(part, &place).map_err(Error::disk(&place))?;
    }
    let text = serde_json::to_vec(&receipts).expect("plain JSON");
    let bytes = receipts.iter().map(|r| r.bytes).sum();
    run.keep(what, Counts::from([("bytes".to_owned(), bytes)]), &[("files.json", &text)])
}

/// Files that vanish unless they are published.
struct Parts(Vec<(PathBuf, String)>);

impl Parts {
    fn add(&mut self, out: &Path, name: String) -> PathBuf {
        let part = unfinished(&out.join(&name));
        self.0.push((part.clone(), name));
        part
    }
}

impl Drop for Parts {
    fn drop(&mut self) {
        for (part, _) in &self.0 {
            let _ = std::fs::remove_file(part);
        }
    }
}

/// Facts of the shot that every file states.
pub fn facts(run: &mut Runner<'_>) -> Result<ShotFacts, Error> {
    let origin = run.origin()?;
    let lights =
        written_lights(run.project).into_iter().map(|l| run.project.shot.value.light[l].name.clone()).collect();
    let shot = &run.project.shot.value.shot;
    Ok(ShotFacts {
        name: shot.name.clone(),
        meters_per_unit: shot.meters_per_unit,
        up: if shot.up == UpAxis::Y { 'Y' } else { 'Z' },
        fps: shot.fps,
        frames: run.project.frames.keys().copied().collect(),
        origin,
        lights,
        extra: vec![("generator".into(), concat!("pelage ", env!("CARGO_PKG_VERSION")).into())],
    })
}

/// The parts of a layer that do not change over the shot.
fn hair_layer(run: &mut Runner<'_>, i: usize) -> Result<HairLayer, Error> {
    let rest = finished_rest(run.project, i);
    Ok(HairLayer { rest: interpolate::positions(run, rest)?, ..look(run, i)? })
}

/// How thick and how opaque a layer's hairs are, and nothing else of them.
pub fn thickness(run: &mut Runner<'_>, i: usize) -> Result<HairLayer, Error> {
    if run.project.curves.is_some() {
        return curves::look(run);
    }
    let layer = &run.project.groom.value.layer[i];
    let width = instance::column(run, What::Width(i), i)?;
    let opacity = instance::column(run, What::Opacity(i), i)?;
    let offsets = Offsets::uniform(width.len(), run.project.points(i));
    let unit_per_micrometre = (1e-6 / run.project.shot.value.shot.meters_per_unit) as f32;
    let width: Vec<f32> = width.iter().map(|w| w * unit_per_micrometre).collect();
    Ok(HairLayer {
        width: point_widths(&width, &offsets, &layer.width.stations()),
        opacity: opacity.iter().map(|o| o.clamp(0.0, 1.0)).collect(),
        offsets,
        ..HairLayer::default()
    })
}

/// A layer's hairs without any positions.
pub fn look(run: &mut Runner<'_>, i: usize) -> Result<HairLayer, Error> {
    if run.project.curves.is_some() {
        return curves::look(run);
    }
    let skin = groom::skin(run)?;
    let roots = instance::roots(run, i)?;
    let (thickness, color) = (thickness(run, i)?, instance::color(run, i)?);
    let layer = &run.project.groom.value.layer[i];
    Ok(HairLayer {
        name: layer.name.clone(),
        skin_face: roots.root.iter().map(|p| skin.mesh.face[p.triangle as usize] as i32).collect(),
        skin_bary: roots.root.iter().map(|p| p.bary).collect(),
        id: roots.id.clone(),
        root_uv: roots.uv.clone(),
        rest: Vec::new(),
        color: match layer.color.stations() {
            Some(ramp) => point_colors(&color, &thickness.offsets, &ramp),
            None => color,
        },
        ..thickness
    })
}

/// All layers. What was read to make them is dropped: frames need the memory.
fn hair_layers(run: &mut Runner<'_>) -> Result<Vec<HairLayer>, Error> {
    let layers = (0..run.project.groom.value.layer.len()).map(|i| hair_layer(run, i)).collect();
    run.forget_layers();
    layers
}

/// Writes one format.
pub fn write(run: &mut Runner<'_>, what: What, format: ExportFormat) -> Result<(), Error> {
    let out = run.project.out_dir();
    std::fs::create_dir_all(&out).map_err(Error::disk(&out))?;
    let facts = facts(run)?;
    let mut parts = Parts(Vec::new());
    // Layers are read once to write and once to check: they need not lie beside the frames in memory.
    match format {
        ExportFormat::Usd => {
            let part = parts.add(&out, "hair.usdc".into());
            let mut file = UsdHair::create(&part, &facts, &hair_layers(run)?)?;
            frames(run, &facts, |frame, hair| Ok(file.write_frame(frame, hair)?))?;
            file.finish()?;
            crate::format::usd::verify(&part, &facts, &hair_layers(run)?)?;
        }
        ExportFormat::Mcap => {
            let part = parts.add(&out, "hair.mcap".into());
            let mut file = McapHair::create(&part, &facts, &hair_layers(run)?)?;
            frames(run, &facts, |frame, hair| Ok(file.write_frame(frame, hair)?))?;
            file.finish()?;
            let sizes = {
                let layers = hair_layers(run)?;
                mcap::verify_layers(&part, &facts, &layers)?;
                layers.iter().map(|l| [l.offsets.len(), l.offsets.total()]).collect::<Vec<_>>()
            };
            mcap::verify_frames(&part, &facts, &sizes)?;
        }
        ExportFormat::Ply => {
            let layers = hair_layers(run)?;
            frames(run, &facts, |frame, hair| {
                let part = parts.add(&out, format!("hair.{frame:04}.ply"));
                ply::write_hair(&part, &facts, &layers, hair)?;
                verify_ply(&part, &layers, hair)?;
                Ok(ply::verify_hair(&part, &facts, &layers, hair)?)
            })?;
        }
    }
    publish(run, what, std::mem::take(&mut parts.0))
}

/// Hands out every frame in order with its velocities: the forward difference to the next frame, the backward one at
/// the last, per second. Two frames are in memory at a time.
fn frames(
    run: &mut Runner<'_>,
    facts: &ShotFacts,
    mut write: impl FnMut(i32, &[HairFrame<'_>]) -> Result<(), Error>,
) -> Result<(), Error> {
    let count = run.project.groom.value.layer.len();
    let load = |run: &mut Runner<'_>, f: i32| {
        (0..count).map(|i| interpolate::hairs(run, What::Frame(i, f))).collect::<Result<Vec<_>, Error>>()
    };
    let looks = (0..count).map(|i| wet_look(run, i)).collect::<Result<Vec<_>, Error>>()?;
    let mut now = load(run, facts.frames[0])?;
    let mut velocity: Vec<Vec<[f32; 3]>> = now.iter().map(|p| vec![[0.0; 3]; p.position.len()]).collect();
    for (k, &frame) in facts.frames.iter().enumerate() {
        let next = facts.frames.get(k + 1).map(|f| load(run, *f)).transpose()?;
        if let Some(next) = &next {
            let rate = (facts.fps / f64::from(facts.frames[k + 1] - frame)) as f32;
            for (v, (a, b)) in velocity.iter_mut().zip(now.iter().zip(next)) {
                v.par_iter_mut().zip(a.position.par_iter().zip(&b.position)).for_each(|(v, (a, b))| {
                    *v = std::array::from_fn(|x| (b[x] - a[x]) * rate);
                });
            }
        }
        let wet: Vec<(Vec<f32>, Vec<f32>)> = now.iter().zip(&looks).map(|(h, l)| h.wet_columns(l.as_ref())).collect();
        let lit = shadow::written(run, frame, &now.iter().map(|h| h.position.len()).collect::<Vec<_>>())?;
        let layers = now.iter().zip(&velocity).zip(&wet).zip(&lit);
        let hair: Vec<HairFrame<'_>> = layers
            .map(|(((h, velocity), (width, opacity)), transmittance)| HairFrame {
                position: &h.position,
                velocity,
                width,
                opacity,
                transmittance,
            })
            .collect();
        write(frame, &hair)?;
        now = next.unwrap_or_default();
    }
    Ok(())
}

/// Columns of a layer that the look changes from frame to frame; `None` if it changes none.
fn wet_look(run: &mut Runner<'_>, i: usize) -> Result<Option<HairLayer>, Error> {
    if is_wet(run.project, i) { look(run, i).map(Some) } else { Ok(None) }
}

/// Reads a PLY file back as curves, if it has any: ids, counts and positions must be what was written.
fn verify_ply(path: &Path, layers: &[HairLayer], hair: &[HairFrame<'_>]) -> Result<(), Error> {
    if layers.iter().all(|l| l.id.is_empty()) {
        return Ok(());
    }
    let read = ply::read_curves(path)?.strands;
    let same = read.id.iter().eq(layers.iter().flat_map(|l| &l.id))
        && read.offsets.counts().eq(layers.iter().flat_map(|l| l.offsets.counts()))
        && read.position.iter().eq(hair.iter().flat_map(|h| h.position));
    let what = "is not what was exported when read back";
    if same { Ok(()) } else { Err(FormatError::new(path, what).hint("export it again").into()) }
}
