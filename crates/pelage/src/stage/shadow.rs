//! Shadow: the part of a light that arrives at every point of every hair of a frame.

use super::plan_light::{settings, source, written_lights};
use super::run::{Counts, Runner};
use super::{What, clumps, curves, export, groom, interpolate, look};
use crate::Error;
use crate::config::Light;
use crate::format::mcap::{read_state_payload, write_state_payload};
use crate::format::{HairLayer, ply};
use crate::project::{BodyFile, SkinAt};
use pelage_geom::{Bvh, Topology, Vec3};
use pelage_groom::look::member::densities;
use pelage_light::shadow::{
    Footprint, MEASURED, ShadowHair, ShadowSettings, Solid, Source, transmittance, transmittance_exact,
};
use pelage_light::shortened;
use pelage_sim::body::Closed;
use std::rc::Rc;

/// Rays to a point where shadows are exact: their sampling noise is 1/64 at most, 0.003 to 0.006 over a groom. With 64 rays
/// it is three times as large as the error of fine maps.
pub const RAYS: usize = 1024;

/// The file of a step's payload.
const FILE: &str = "shadow.mcap";

/// What stands in the light at a frame, whatever light it is.
#[derive(Debug)]
pub struct Scene {
    /// Hairs by layer: how thick and opaque they are, and where.
    hairs: Vec<(HairLayer, Vec<[f32; 3]>)>,
    solids: Vec<Shade>,
}

/// A solid that stands in the light.
#[derive(Debug)]
struct Shade {
    position: Vec<[f64; 3]>,
    triangle: Vec<[u32; 3]>,
    bvh: Bvh,
}

/// A mesh beside the skin, its holes closed.
#[derive(Debug)]
pub struct Prop {
    rest: Vec<[f64; 3]>,
    closed: Closed,
}

/// Transmittance of light `l` at a frame: a value for each point of each layer, in [0, 1].
pub fn columns(run: &mut Runner<'_>, l: usize, frame: i32) -> Result<Vec<Vec<f32>>, Error> {
    let what = What::Shadow(l as u32, frame);
    if let Some(file) = run.fetch_file(what, FILE)
        && let Some(found) = read_state_payload(&file).ok().and_then(|b| decode(&b))
    {
        return Ok(found);
    }
    let (light, origin) = (&run.project.shot.value.light[l], run.origin()?);
    let from = source(light, frame);
    let scene = scene(run, frame)?;
    let layers: Vec<ShadowHair<'_>> = scene
        .hairs
        .iter()
        .map(|(l, position)| ShadowHair { offsets: &l.offsets, position, origin, width: &l.width, opacity: &l.opacity })
        .collect();
    let solid: Vec<Solid<'_>> =
        scene.solids.iter().map(|s| Solid { position: &s.position, triangle: &s.triangle, bvh: &s.bvh }).collect();
    if let Some(error) = run.project.shot.value.shadow.error
        && let Some(finest) = MEASURED.last().filter(|m| m.rms > error)
    {
        let rms = finest.rms;
        run.warn_once(format!(
            "shadow.error {error} is finer than any maps: they are wrong by up to {rms}; \"reference\" sends rays"
        ));
    }
    let mut counts = Counts::new();
    let made = match settings(&run.project.shot.value.shadow) {
        Some(settings) => transmittance(from, &layers, &solid, &settings).map(|(columns, found)| {
            counts.insert("points outside a light's cone".into(), found.masked as u64);
            counts.insert("points behind solids".into(), found.behind_solid as u64);
            counts.insert("points left out".into(), found.bad_points as u64);
            columns
        }),
        None => by_rays(from, &layers, &solid),
    };
    let made = made.map_err(|e| {
        let help = "key frames are joined by straight lines: let them not pass through nothing";
        run.project.shot.error(&format!("light[{l}]"), format!("at frame {frame}: {e}"), help)
    })?;
    counts.insert("points".into(), made.iter().map(|c| c.len() as u64).sum());
    let file = write_state_payload(&run.plan.step(what).name.clone(), i64::from(frame), &encode(&made));
    run.keep(what, counts, &[(FILE, &file)])?;
    Ok(made)
}

/// What files have of a frame, for layers of as many points: all lights together, then each. A light that is off holds
/// nothing back.
pub fn written(run: &mut Runner<'_>, frame: i32, points: &[usize]) -> Result<Vec<Vec<Vec<f32>>>, Error> {
    let lights = written_lights(run.project);
    let mut out: Vec<Vec<Vec<f32>>> = vec![Vec::new(); points.len()];
    if lights.is_empty() {
        return Ok(out);
    }
    let mut sum: Vec<Vec<f32>> = points.iter().map(|n| vec![0.0; *n]).collect();
    let mut weights = 0.0;
    for l in lights {
        let light = &run.project.shot.value.light[l];
        let weight = if light.is_on(frame) { weight(light, frame) } else { 0.0 };
        let found = match light.is_on(frame) {
            true => columns(run, l, frame)?,
            false => points.iter().map(|n| vec![1.0; *n]).collect(),
        };
        weights += weight;
        for ((sum, out), column) in sum.iter_mut().zip(&mut out).zip(found) {
            sum.iter_mut().zip(&column).for_each(|(s, t)| *s += weight * t);
            out.push(column);
        }
    }
    for (mut sum, out) in sum.into_iter().zip(&mut out) {
        sum.iter_mut().for_each(|s| *s = if weights > 0.0 { (*s / weights).min(1.0) } else { 1.0 });
        out.insert(0, sum);
    }
    Ok(out)
}

/// What a light counts among others: its intensity times the luminance of its colour.
fn weight(light: &Light, frame: i32) -> f32 {
    let [r, g, b] = light.color;
    (light.intensity.at(f64::from(frame)) * (0.2126 * r + 0.7152 * g + 0.0722 * b)) as f32
}

fn by_rays(
    from: Source,
    layers: &[ShadowHair<'_>],
    solids: &[Solid<'_>],
) -> Result<Vec<Vec<f32>>, pelage_light::shadow::BadSource> {
    let footprint = Footprint { side: ShadowSettings::default().filter, rays: RAYS, seed: 0 };
    let points: Vec<[usize; 2]> =
        layers.iter().enumerate().flat_map(|(l, h)| (0..h.position.len()).map(move |i| [l, i])).collect();
    let mut found = transmittance_exact(from, layers, solids, &footprint, &points)?.into_iter();
    let column = |h: &ShadowHair<'_>| found.by_ref().take(h.position.len()).map(|s| s.mean as f32).collect();
    Ok(layers.iter().map(column).collect())
}

/// What stands in the light at a frame, made once for all lights.
fn scene(run: &mut Runner<'_>, frame: i32) -> Result<Rc<Scene>, Error> {
    if let Some((_, found)) = run.scene.as_ref().filter(|(of, _)| *of == frame) {
        return Ok(found.clone());
    }
    let mut hairs = Vec::new();
    for i in 0..run.project.groom.value.layer.len() {
        let mut thickness = export::thickness(run, i)?;
        let hair = interpolate::hairs(run, What::Frame(i, frame))?;
        let (width, opacity) = hair.wet_columns(Some(&thickness));
        if !hair.wet.is_empty() {
            (thickness.width, thickness.opacity) = (width, opacity);
        }
        let wider = 1.0 / run.project.share[i] as f32;
        if wider != 1.0 {
            thickness.width.iter_mut().for_each(|w| *w *= wider);
        }
        let shorten = run.project.shot.value.shadow.shorten;
        if shorten > 0.0 {
            let density = density(run, i)?;
            let offsets = &thickness.offsets;
            thickness.width = shortened(offsets, &hair.position, &thickness.width, &density, shorten);
        }
        hairs.push((thickness, hair.position));
    }
    let found = Rc::new(Scene { hairs, solids: solids(run, frame)? });
    run.scene = Some((frame, found.clone()));
    Ok(found)
}

/// Hairs per square scene unit around the root of each hair of a layer, at rest.
pub fn density(run: &mut Runner<'_>, i: usize) -> Result<Vec<f32>, Error> {
    let root = match &run.project.curves {
        Some(_) => {
            let hair = curves::hair(run)?;
            (0..hair.offsets.len()).map(|h| hair.position[hair.offsets.range(h).start]).collect()
        }
        None => clumps::sites(run, i)?.position.clone(),
    };
    Ok(densities(&root))
}

/// Skin and other meshes at a frame, holes closed.
fn solids(run: &mut Runner<'_>, frame: i32) -> Result<Vec<Shade>, Error> {
    let mut out = Vec::new();
    let mut add = |closed: &Closed, position: &[[f64; 3]]| {
        let position = closed.extend(position);
        let bvh = closed.bvh(&position);
        out.push(Shade { position, triangle: closed.mesh.triangle.clone(), bvh });
    };
    if run.project.rest.is_some() {
        let at: SkinAt = run.project.frames[&frame].clone();
        let pose = groom::pose(run, &at)?;
        add(&look::barrier(run)?.closed, &pose.position);
    }
    for (prop, body) in props(run)?.iter().zip(&run.project.bodies) {
        match body.motion.as_ref().map(|m| m.at(f64::from(frame))) {
            Some(t) => {
                let moved: Vec<[f64; 3]> = prop.rest.iter().map(|p| t.apply(Vec3::from(*p)).into()).collect();
                add(&prop.closed, &moved);
            }
            None => add(&prop.closed, &prop.rest),
        }
    }
    Ok(out)
}

/// The meshes beside the skin, read once a run.
fn props(run: &mut Runner<'_>) -> Result<Rc<Vec<Prop>>, Error> {
    if let Some(found) = &run.props {
        return Ok(found.clone());
    }
    let read = |body: &BodyFile| {
        let mesh = ply::read_mesh(&body.file.path)?.mesh;
        let closed = Closed::new(&mesh, &Topology::new(&mesh));
        Ok(Prop { rest: mesh.position, closed })
    };
    let found = run.project.bodies.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
    Ok(run.props.insert(Rc::new(found)).clone())
}

/// Columns one after another: their number, their lengths, their values.
fn encode(columns: &[Vec<f32>]) -> Vec<u8> {
    let mut out = (columns.len() as u64).to_le_bytes().to_vec();
    columns.iter().for_each(|c| out.extend((c.len() as u64).to_le_bytes()));
    columns.iter().for_each(|c| out.extend_from_slice(bytemuck::cast_slice(c)));
    out
}

/// Columns from the bytes of a step; `None` for anything else.
pub fn decode(bytes: &[u8]) -> Option<Vec<Vec<f32>>> {
    let number = |b: &[u8]| Some(u64::from_le_bytes(b.get(..8)?.try_into().ok()?) as usize);
    let count = number(bytes)?;
    let mut at = count.checked_add(1)?.checked_mul(8)?;
    let mut out = Vec::new();
    for i in 0..count {
        let bytes_long = number(bytes.get(8 * (i + 1)..)?)?.checked_mul(4)?;
        let values = bytes.get(at..at.checked_add(bytes_long)?)?;
        out.push(bytemuck::pod_collect_to_vec(values));
        at += bytes_long;
    }
    (at == bytes.len()).then_some(out)
}
