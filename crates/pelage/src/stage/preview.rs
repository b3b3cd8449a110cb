//! Preview: pictures of the hair by which a groom is judged.

use super::look::Displaced;
use super::plan_light::source;
use super::run::Runner;
use super::{SkinPose, What, curves, export, groom, instance, interpolate, shadow};
use crate::Error;
use crate::config::UpAxis;
use crate::files::unfinished;
use crate::format::{HairLayer, image::write_png};
use pelage_geom::{Offsets, SurfacePoint};
use pelage_light::shadow::Source;
use pelage_light::{
    Camera, HairView, Image, Light, Region, Scene, Settings, SkinView, contact_sheet, render_region, studio_lights,
};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Linear grey of the background: dark enough for light hair, light enough for dark hair.
const BACKGROUND: [f32; 3] = [0.16, 0.17, 0.19];
/// Linear colour of skin, a neutral warm clay.
const SKIN: [f32; 3] = [0.42, 0.31, 0.26];
/// Hairs of a layer that the camera is placed by: all, or as many evenly over them. The margin holds the others.
const FRAMED: usize = 20_000;
/// Hairs that a picture draws at most. Of more, every n-th is drawn, n times as wide: the same cover, less time and
/// memory. A tenth of this shows single hairs as bars; ten times as many no longer fit beside a large frame.
const DRAWN: usize = 250_000;
/// Pictures of a contact sheet are drawn this many times as large and scaled down: hairs are thin there.
const FINER: u32 = 2;

/// Draws the still.
pub fn still(run: &mut Runner<'_>) -> Result<(), Error> {
    let picture = seen(run, &Part::default())?;
    save(run, What::Still, "preview.png", &picture)
}

/// What is drawn of the still.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Percentage of the hairs, in (0, 100], drawn as much wider as they are fewer. The run's project is the shot thinned
    /// to it ([`crate::project::Project::thinned`]); of hair from a curves file, which that leaves whole, every n-th is
    /// drawn.
    pub hairs: f64,
    /// Left, upper, right and lower border in [0, 1] of the picture's width and height.
    pub crop: [f64; 4],
}

impl Default for Part {
    fn default() -> Self {
        Part { hairs: 100.0, crop: [0.0, 0.0, 1.0, 1.0] }
    }
}

impl Part {
    /// Pixels of a picture that the crop asks for, one at least.
    pub fn region(&self, size: [u32; 2]) -> Region {
        let range = |i: usize| {
            let [from, to] = [self.crop[i], self.crop[i + 2]].map(|x| (x * f64::from(size[i])).round() as usize);
            let from = from.min(size[i] as usize - 1);
            from..to.max(from + 1)
        };
        Region { x: range(0), y: range(1) }
    }
}

/// Draws a part of the still into a file of its own and returns its path. Nothing is kept that says so: the still itself
/// counts as drawn only by [`still`].
pub fn part(run: &mut Runner<'_>, part: &Part, name: &str) -> Result<PathBuf, Error> {
    let picture = seen(run, part)?;
    let path = run.project.out_dir().join(name);
    let unfinished = write(&path, &picture)?;
    std::fs::rename(&unfinished, &path).map_err(Error::disk(&path))?;
    Ok(path)
}

fn seen(run: &mut Runner<'_>, part: &Part) -> Result<Image, Error> {
    let (frame, size) = (run.project.still_frame(), run.project.shot.value.preview.size);
    let drawn = drawn(run, part.hairs)?;
    let camera = camera(run, &drawn, &[frame])?;
    draw(run, &drawn, &camera, frame, size, &part.region(size))
}

/// Draws the contact sheet: frames evenly over the shot, each a third of the still's size, seen by one camera.
pub fn sheet(run: &mut Runner<'_>) -> Result<(), Error> {
    let frames = run.project.sheet_frames();
    let drawn = drawn(run, 100.0)?;
    let camera = camera(run, &drawn, &frames)?;
    let size = run.project.shot.value.preview.size.map(|x| (x / 3).max(16) * FINER);
    let whole = Part::default().region(size);
    let mut pictures = Vec::new();
    for frame in &frames {
        let mut picture = draw(run, &drawn, &camera, *frame, size, &whole)?.shrunk(FINER as usize);
        picture.draw_number(i64::from(*frame), (picture.width / 160).max(1));
        pictures.push(picture);
    }
    let columns = (1..=frames.len()).find(|c| c * c >= frames.len()).unwrap_or(1);
    save(run, What::Sheet, "sheet.png", &contact_sheet(&pictures, columns))
}

/// Layers to draw, and which hairs of them: every n-th of `all`.
struct Drawn {
    layers: Vec<HairLayer>,
    all: Vec<Offsets>,
    every: usize,
}

/// Layers of a run whose project has `percent` of the shot's hairs.
fn drawn(run: &mut Runner<'_>, percent: f64) -> Result<Drawn, Error> {
    let count = run.project.groom.value.layer.len();
    let offsets = |i: usize| Ok(export::thickness(run, i)?.offsets);
    let all = (0..count).map(offsets).collect::<Result<Vec<Offsets>, Error>>()?;
    let hairs: usize = all.iter().map(Offsets::len).sum();
    // Curves are not thinned yet, grooms are.
    let least = if run.project.curves.is_some() { (100.0 / percent).round() as usize } else { 1 };
    let every = hairs.div_ceil(DRAWN).max(least).max(1);
    let share = run.project.share.clone();
    let layer = |i: usize| Ok(thinned(export::look(run, i)?, every, 1.0 / share[i] as f32));
    let layers = (0..count).map(layer).collect::<Result<_, Error>>()?;
    run.layers.clear();
    Ok(Drawn { layers, all, every })
}

/// Every n-th hair, n times as wide, and `wider` times that.
fn thinned(layer: HairLayer, every: usize, wider: f32) -> HairLayer {
    if every == 1 && wider == 1.0 {
        return layer;
    }
    let wider = wider * every as f32;
    HairLayer {
        width: nth(&layer.width, &layer.offsets, every).map(|w| w * wider).collect(),
        offsets: Offsets::from_counts(layer.offsets.counts().step_by(every)),
        opacity: layer.opacity.iter().copied().step_by(every).collect(),
        color: match layer.color_per_point() {
            true => nth(&layer.color, &layer.offsets, every).collect(),
            false => layer.color.iter().copied().step_by(every).collect(),
        },
        ..HairLayer::default()
    }
}

/// Values of every n-th hair.
fn nth<'a, T: Copy>(values: &'a [T], offsets: &'a Offsets, every: usize) -> impl Iterator<Item = T> + 'a {
    (0..offsets.len()).step_by(every).flat_map(|h| values[offsets.range(h)].iter().copied())
}

/// The hairs to draw.
fn hairs(run: &mut Runner<'_>, drawn: &Drawn, i: usize, frame: i32) -> Result<Displaced, Error> {
    let all = interpolate::hairs(run, What::Frame(i, frame))?;
    if drawn.every == 1 {
        return Ok(all);
    }
    let position = nth(&all.position, &drawn.all[i], drawn.every).collect();
    Ok(Displaced { position, wet: all.wet.into_iter().step_by(drawn.every).collect() })
}

/// A camera that sees skin and hair at all of the frames, as near as it can.
fn camera(run: &mut Runner<'_>, drawn: &Drawn, frames: &[i32]) -> Result<Camera, Error> {
    let origin = run.origin()?;
    let mut points = Vec::new();
    for frame in frames {
        if let Some(pose) = pose(run, *frame)? {
            points.extend_from_slice(&pose.position);
        }
        for (i, layer) in drawn.layers.iter().enumerate() {
            let position = hairs(run, drawn, i, *frame)?.position;
            let count = layer.offsets.len();
            for hair in (0..count).step_by(count.div_ceil(FRAMED).max(1)) {
                let hair = &position[layer.offsets.range(hair)];
                points.extend(hair.iter().map(|p| std::array::from_fn::<f64, 3, _>(|x| f64::from(p[x]) + origin[x])));
            }
        }
    }
    let shot = &run.project.shot.value;
    let up = if shot.shot.up == UpAxis::Y { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let aspect = f64::from(shot.preview.size[0]) / f64::from(shot.preview.size[1]);
    Ok(Camera::frame_points(points, shot.preview.from.map(|x| -x), up, aspect).zoomed(shot.preview.zoom))
}

/// The skin at a frame, if there is one.
fn pose(run: &mut Runner<'_>, frame: i32) -> Result<Option<Rc<SkinPose>>, Error> {
    match &run.project.rest {
        Some(_) => groom::pose(run, &run.project.frames[&frame]).map(Some),
        None => Ok(None),
    }
}

/// Normals of the skin at the roots that are drawn.
fn normals(run: &mut Runner<'_>, drawn: &Drawn, pose: &SkinPose, i: usize) -> Result<Vec<[f32; 3]>, Error> {
    let skin = groom::skin(run)?;
    let of = |root: &[SurfacePoint]| root.iter().step_by(drawn.every).map(|p| skin.normal(pose, p)).collect();
    Ok(match &run.project.curves {
        Some(_) => of(&curves::hair(run)?.root),
        None => of(&instance::roots(run, i)?.root),
    })
}

/// Draws a region of the picture of `size` at a frame.
fn draw(
    run: &mut Runner<'_>,
    drawn: &Drawn,
    camera: &Camera,
    frame: i32,
    size: [u32; 2],
    region: &Region,
) -> Result<Image, Error> {
    let layers = &drawn.layers;
    let (pose, origin) = (pose(run, frame)?, run.origin()?);
    let hairs = (0..layers.len()).map(|i| hairs(run, drawn, i, frame)).collect::<Result<Vec<_>, Error>>()?;
    let wet: Vec<(Vec<f32>, Vec<f32>)> = hairs.iter().zip(layers).map(|(h, l)| h.wet_columns(Some(l))).collect();
    let normals = (0..layers.len())
        .map(|i| match &pose {
            Some(pose) => normals(run, drawn, pose, i),
            None => Ok(Vec::new()),
        })
        .collect::<Result<Vec<Vec<[f32; 3]>>, Error>>()?;
    let Lit { lights, transmittance } = lights(run, drawn, camera, frame)?;
    let views: Vec<HairView<'_>> = (0..layers.len())
        .map(|i| HairView {
            offsets: &layers[i].offsets,
            position: &hairs[i].position,
            origin,
            width: if wet[i].0.is_empty() { &layers[i].width } else { &wet[i].0 },
            color: &layers[i].color,
            opacity: if wet[i].1.is_empty() { &layers[i].opacity } else { &wet[i].1 },
            root_normal: &normals[i],
            transmittance: &transmittance[i],
        })
        .collect();
    let skin = if pose.is_some() { Some(groom::skin(run)?) } else { None };
    let surface = pose.as_ref().zip(skin.as_ref()).map(|(pose, skin)| SkinView {
        position: &pose.position,
        triangle: &skin.mesh.triangle,
        normal: &pose.normal,
        color: SKIN,
    });
    let scene = Scene { skin: surface, layers: &views, lights: &lights, background: BACKGROUND };
    Ok(render_region(&scene, camera, size.map(|x| x as usize), region, &Settings::default()).0)
}

/// Lights, and for each layer what arrives of each light at the points that are drawn; nothing where that is not known.
struct Lit {
    lights: Vec<Light>,
    transmittance: Vec<Vec<Vec<f32>>>,
}

/// The lights of a frame with what arrives of each at the hairs that are drawn; three that move with the camera where the
/// shot has none.
fn lights(run: &mut Runner<'_>, drawn: &Drawn, camera: &Camera, frame: i32) -> Result<Lit, Error> {
    let mut transmittance = vec![Vec::new(); drawn.layers.len()];
    if run.project.shot.value.light.is_empty() {
        return Ok(Lit { lights: studio_lights(camera), transmittance });
    }
    let mut lights = Vec::new();
    for (l, light) in run.project.shot.value.light.iter().enumerate().filter(|(_, l)| l.is_on(frame)) {
        let strength = light.intensity.at(f64::from(frame));
        let color = light.color.map(|c| (c * strength) as f32);
        lights.push(match source(light, frame) {
            Source::Directional { direction } => Light { direction: direction.into(), color, ..Light::default() },
            Source::Point { position } => Light { position: Some(position.into()), color, ..Light::default() },
            Source::Spot { position, direction, cone, softness } => Light {
                direction: direction.into(),
                color,
                position: Some(position.into()),
                cone: Some([cone, cone + softness]),
            },
        });
        for (i, column) in shadow::columns(run, l, frame)?.into_iter().enumerate() {
            transmittance[i].push(match drawn.every {
                1 => column,
                every => nth(&column, &drawn.all[i], every).collect(),
            });
        }
    }
    Ok(Lit { lights, transmittance })
}

fn save(run: &mut Runner<'_>, what: What, name: &str, picture: &Image) -> Result<(), Error> {
    let part = write(&run.project.out_dir().join(name), picture)?;
    export::publish(run, what, vec![(part, name.to_owned())])
}

/// Writes a picture beside its path.
fn write(path: &Path, picture: &Image) -> Result<PathBuf, Error> {
    let out = path.parent().unwrap_or(path);
    std::fs::create_dir_all(out).map_err(Error::disk(out))?;
    let part = unfinished(path);
    write_png(&part, picture.width, picture.height, &picture.to_srgb8())?;
    Ok(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinned_hair_keeps_its_colours_at_its_points() {
        let offsets = Offsets::from_counts([2, 3, 4]);
        let layer = HairLayer { width: vec![0.5; 9], opacity: vec![1.0, 0.5, 0.25], offsets, ..HairLayer::default() };
        let hairs: Vec<[f32; 3]> = (0..3).map(|h| [h as f32; 3]).collect();
        let points: Vec<[f32; 3]> = (0..9).map(|p| [p as f32; 3]).collect();
        let of = |color: &[[f32; 3]]| thinned(HairLayer { color: color.to_vec(), ..layer.clone() }, 2, 1.0);
        assert_eq!(of(&hairs).color, [[0.0; 3], [2.0; 3]]);
        let drawn = of(&points);
        assert_eq!(drawn.color, [0.0f32, 1.0, 5.0, 6.0, 7.0, 8.0].map(|p| [p; 3]));
        assert_eq!((drawn.offsets, drawn.width), (Offsets::from_counts([2, 4]), vec![1.0; 6]));
        assert_eq!(drawn.opacity, [1.0, 0.25]);
    }
}
