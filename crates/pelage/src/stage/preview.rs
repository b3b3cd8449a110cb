//! Preview: pictures of the hair by which a groom is judged.

use super::look::Displaced;
use super::plan_light::source;
use super::plan_look::{acting_clumps, is_wet};
use super::run::Runner;
use super::{SkinPose, What, clumps, curves, export, groom, heat, instance, interpolate, shadow};
use crate::Error;
use crate::config::{Keyed, PreviewTone, UpAxis, Vector};
use crate::files::unfinished;
use crate::format::{HairLayer, image::write_png};
use crate::project::Project;
use pelage_geom::{Offsets, SurfacePoint, Vec3};
use pelage_groom::look::clump::sides;
use pelage_light::heat::{NO_VALUE, category_color, heat_color, range_of};
use pelage_light::shadow::Source;
use pelage_light::{
    Camera, HairShade, HairView, Image, Light, Region, Scene, Settings, SkinView, Tone, contact_sheet, render_region,
    studio_lights,
};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Linear grey of the background: dark enough for light hair, light enough for dark hair.
const BACKGROUND: [f32; 3] = [0.16, 0.17, 0.19];
/// Linear colour of skin, a neutral warm clay.
const SKIN: [f32; 3] = [0.42, 0.31, 0.26];
/// Linear colour of skin under a heat map.
const BARE: [f32; 3] = [0.3; 3];
/// Factor of the first highlight of wet hair. Under 3 it looks dry and matted, over 15 it looks like glass.
const WET_SHINE: f32 = 7.0;
/// Part of its light that wet hair gains on the side of its clump that is turned to the light, and loses on the other.
/// Under 0.2 clumps do not stand apart, at 1 their far sides are black.
const WET_SIDE: f32 = 0.6;
/// Part of the distance to the target nearer than which a camera sees nothing.
const NEAR: f64 = 0.02;
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
#[derive(Clone, Debug)]
pub struct Part {
    /// Percentage of the hairs, in (0, 100], drawn as much wider as they are fewer. The run's project is the shot thinned
    /// to it ([`crate::project::Project::thinned`]); of hair from a curves file, which that leaves whole, every n-th is
    /// drawn.
    pub hairs: f64,
    /// Left, upper, right and lower border in [0, 1] of the picture's width and height.
    pub crop: [f64; 4],
    /// A column of the hairs as colours instead of hair in light.
    pub show: Option<Show>,
}

/// A heat map.
#[derive(Clone, Debug)]
pub struct Show {
    /// What it shows.
    pub column: heat::Column,
    /// Ends of the scale; those of the values if not given.
    pub range: Option<[f32; 2]>,
}

impl Default for Part {
    fn default() -> Self {
        Part { hairs: 100.0, crop: [0.0, 0.0, 1.0, 1.0], show: None }
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
    // Colours of a heat map are those of its legend.
    let tone = if part.show.is_some() { Tone::Straight } else { tone(run) };
    let unfinished = write(&path, &picture, tone)?;
    std::fs::rename(&unfinished, &path).map_err(Error::disk(&path))?;
    Ok(path)
}

fn seen(run: &mut Runner<'_>, part: &Part) -> Result<Image, Error> {
    let (frame, size) = (run.project.still_frame(), run.project.shot.value.preview.size);
    let drawn = drawn(run, part.hairs)?;
    let camera = camera(run, &drawn, &[frame], frame)?;
    let seen = Seen { camera, frame, size, region: part.region(size) };
    match &part.show {
        Some(show) => heat_map(run, &drawn, &seen, show),
        None => draw(run, &drawn, &seen),
    }
}

/// Draws the contact sheet: frames evenly over the shot, each a third of the still's size.
pub fn sheet(run: &mut Runner<'_>) -> Result<(), Error> {
    let frames = run.project.sheet_frames();
    let drawn = drawn(run, 100.0)?;
    let size = run.project.shot.value.preview.size.map(|x| (x / 3).max(16) * FINER);
    let whole = Part::default().region(size);
    let mut pictures = Vec::new();
    for frame in &frames {
        let camera = camera(run, &drawn, &frames, *frame)?;
        let seen = Seen { camera, frame: *frame, size, region: whole.clone() };
        let mut picture = draw(run, &drawn, &seen)?.shrunk(FINER as usize);
        let dot = (picture.width / 320).max(1);
        picture.draw_text(&frame.to_string(), [2, picture.height as i64 - 9 * dot as i64], dot);
        pictures.push(picture);
    }
    let columns = (1..=frames.len()).find(|c| c * c >= frames.len()).unwrap_or(1);
    save(run, What::Sheet, "sheet.png", &contact_sheet(&pictures, columns))
}

/// Draws the picture of a frame, seen as in the contact sheet.
pub fn picture(run: &mut Runner<'_>, frame: i32) -> Result<(), Error> {
    let (drawn, size) = (drawn(run, 100.0)?, run.project.shot.value.preview.size);
    let framed = run.project.sheet_frames();
    let camera = camera(run, &drawn, &framed, frame)?;
    let picture = draw(run, &drawn, &Seen { camera, frame, size, region: Part::default().region(size) })?;
    save(run, What::Picture(frame), &format!("preview.{frame:04}.png"), &picture)
}

/// Draws picture `k` of the turntable: the still's frame from a camera that goes round it.
pub fn turn(run: &mut Runner<'_>, k: u32) -> Result<(), Error> {
    let (frame, size) = (run.project.still_frame(), run.project.shot.value.preview.size);
    let drawn = drawn(run, 100.0)?;
    let count = run.project.shot.value.preview.turntable;
    let (camera, axis) = match &run.project.shot.value.preview.camera {
        Some(_) => {
            let camera = camera(run, &drawn, &[frame], frame)?;
            (camera, camera.target)
        }
        None => turning(run, &drawn, frame, count)?,
    };
    let camera = camera.turned(axis, up(run.project), std::f64::consts::TAU * f64::from(k) / f64::from(count));
    let picture = draw(run, &drawn, &Seen { camera, frame, size, region: Part::default().region(size) })?;
    save(run, What::Turn(k), &format!("turntable.{:03}.png", k + 1), &picture)
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

/// The camera of `[preview.camera]` at a frame, if the shot has one.
pub(super) fn shot_camera(project: &Project, frame: i32) -> Option<Camera> {
    let c = project.shot.value.preview.camera.as_ref()?;
    let at = |k: &Keyed<Vector>| k.vectors().at(f64::from(frame));
    let (eye, target) = (at(&c.eye), at(&c.target));
    let near = NEAR * (Vec3::from(target) - Vec3::from(eye)).norm();
    let up = c.up.unwrap_or(up(project));
    Some(Camera { eye, target, up, fov_y_deg: c.fov.at(f64::from(frame)), near, parallel_height: None })
}

/// The camera of the shot at a frame; without one, a camera that sees skin and hair at all of the `frames`, as near as it
/// can.
fn camera(run: &mut Runner<'_>, drawn: &Drawn, frames: &[i32], frame: i32) -> Result<Camera, Error> {
    if let Some(camera) = shot_camera(run.project, frame) {
        return Ok(camera);
    }
    if let Some((_, camera)) = run.camera.as_ref().filter(|(of, _)| of == frames) {
        return Ok(*camera);
    }
    let points = points(run, drawn, frames)?;
    let p = &run.project.shot.value.preview;
    let camera = Camera::frame_points(points, p.from().map(|x| -x), up(run.project), aspect(run)).zoomed(p.zoom());
    run.camera = Some((frames.to_vec(), camera));
    Ok(camera)
}

/// A camera that sees skin and hair at a frame from all sides on its way round, and a point of the line that it goes round.
fn turning(run: &mut Runner<'_>, drawn: &Drawn, frame: i32, turns: u32) -> Result<(Camera, [f64; 3]), Error> {
    if let Some(found) = run.turning {
        return Ok(found);
    }
    let points = points(run, drawn, &[frame])?;
    let p = &run.project.shot.value.preview;
    let (camera, axis) = Camera::frame_turning(&points, p.from().map(|x| -x), up(run.project), aspect(run), turns);
    Ok(*run.turning.insert((camera.zoomed(p.zoom()), axis)))
}

fn aspect(run: &Runner<'_>) -> f64 {
    let [w, h] = run.project.shot.value.preview.size.map(f64::from);
    w / h
}

fn up(project: &Project) -> [f64; 3] {
    if project.shot.value.shot.up == UpAxis::Y { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] }
}

/// Points of skin and hair at frames.
fn points(run: &mut Runner<'_>, drawn: &Drawn, frames: &[i32]) -> Result<Vec<[f64; 3]>, Error> {
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
    Ok(points)
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

/// What is drawn of a layer at a frame.
struct Strands {
    hairs: Displaced,
    /// Diameters at the points and opacities.
    width: Vec<f32>,
    opacity: Vec<f32>,
    /// Normals of the skin at the roots; empty without a skin.
    normal: Vec<[f32; 3]>,
}

fn strands(run: &mut Runner<'_>, drawn: &Drawn, i: usize, frame: i32) -> Result<Strands, Error> {
    let (layer, hairs) = (&drawn.layers[i], hairs(run, drawn, i, frame)?);
    let (width, opacity) = match hairs.wet.is_empty() {
        true => (layer.width.clone(), layer.opacity.clone()),
        false => hairs.wet_columns(Some(layer)),
    };
    let normal = match pose(run, frame)? {
        Some(pose) => normals(run, drawn, &pose, i)?,
        None => Vec::new(),
    };
    Ok(Strands { hairs, width, opacity, normal })
}

/// A region of a picture of `size` at a frame, and the camera.
struct Seen {
    camera: Camera,
    frame: i32,
    size: [u32; 2],
    region: Region,
}

impl Seen {
    /// Draws hair and skin.
    fn render(
        &self,
        run: &mut Runner<'_>,
        layers: &[HairView<'_>],
        lights: &[Light],
        skin: [f32; 3],
        settings: &Settings,
    ) -> Result<Image, Error> {
        let posed = pose(run, self.frame)?.map(|pose| Ok::<_, Error>((groom::skin(run)?, pose))).transpose()?;
        let skin = posed.as_ref().map(|(mesh, pose)| SkinView {
            position: &pose.position,
            triangle: &mesh.mesh.triangle,
            normal: &pose.normal,
            color: skin,
        });
        let scene = Scene { skin, layers, lights, background: BACKGROUND };
        Ok(render_region(&scene, &self.camera, self.size.map(|x| x as usize), &self.region, settings).0)
    }
}

/// Draws hair in its light.
fn draw(run: &mut Runner<'_>, drawn: &Drawn, seen: &Seen) -> Result<Image, Error> {
    let frame = seen.frame;
    let count = drawn.layers.len();
    let strands = (0..count).map(|i| strands(run, drawn, i, frame)).collect::<Result<Vec<_>, Error>>()?;
    let gloss = (0..count).map(|i| gloss(run, drawn, i, frame)).collect::<Result<Vec<_>, Error>>()?;
    let Lit { lights, transmittance } = lights(run, drawn, &seen.camera, frame)?;
    let origin = run.origin()?;
    let views: Vec<HairView<'_>> = (0..count)
        .map(|i| HairView {
            shine: &gloss[i].shine,
            side: &gloss[i].side,
            transmittance: &transmittance[i],
            ..view(&drawn.layers[i], &strands[i], origin)
        })
        .collect();
    let p = &run.project.shot.value.preview;
    let (exposure, standard) = (p.exposure as f32, HairShade::default());
    let hair = HairShade {
        skin_normal: p.shade.fur as f32,
        specular: standard.specular * p.shade.specular as f32,
        glint: standard.glint * p.shade.specular as f32,
        through: p.shade.through as f32,
        ..standard
    };
    let settings = Settings { hair, depth_cue: p.depth_cue as f32, ..Settings::default() };
    Ok(seen.render(run, &views, &lights, SKIN, &settings)?.exposed(exposure))
}

fn view<'a>(layer: &'a HairLayer, strands: &'a Strands, origin: [f64; 3]) -> HairView<'a> {
    let plain = HairView::plain(&layer.offsets, &strands.hairs.position, origin, &strands.width);
    HairView { color: &layer.color, opacity: &strands.opacity, root_normal: &strands.normal, ..plain }
}

/// Draws a column of the hairs as colours, with a legend.
fn heat_map(run: &mut Runner<'_>, drawn: &Drawn, seen: &Seen, show: &Show) -> Result<Image, Error> {
    let heat::Heat { values, title, scale } = heat::column(run, &show.column, seen.frame)?;
    let range = show.range.unwrap_or_else(|| range_of(values.iter().flatten().copied()));
    let paint = |v: f32| match scale {
        true => heat_color(v, range),
        false if v < 0.0 => NO_VALUE,
        false => category_color(v as u64),
    };
    let colors = |i: usize| -> Vec<[f32; 3]> {
        match values[i].len() == drawn.all[i].len() {
            true => values[i].iter().step_by(drawn.every).map(|v| paint(*v)).collect(),
            false => nth(&values[i], &drawn.all[i], drawn.every).map(paint).collect(),
        }
    };
    let count = drawn.layers.len();
    let colors: Vec<Vec<[f32; 3]>> = (0..count).map(colors).collect();
    let strands = (0..count).map(|i| strands(run, drawn, i, seen.frame)).collect::<Result<Vec<_>, Error>>()?;
    let origin = run.origin()?;
    let of = |i: usize| HairView { color: &colors[i], ..view(&drawn.layers[i], &strands[i], origin) };
    let views: Vec<HairView<'_>> = (0..count).map(of).collect();
    // Light from all around shows colours as they are.
    let settings = Settings { ambient: [1.0; 3], ..Settings::default() };
    let mut picture = seen.render(run, &views, &[], BARE, &settings)?;
    picture.draw_legend(&title, scale.then_some(range));
    Ok(picture)
}

/// How hair of a layer shines: factors of its highlights, and which way it lies on its clump where it is wet.
#[derive(Default)]
struct Gloss {
    shine: Vec<f32>,
    side: Vec<[f32; 3]>,
}

fn gloss(run: &mut Runner<'_>, drawn: &Drawn, i: usize, frame: i32) -> Result<Gloss, Error> {
    let shade = run.project.shot.value.preview.shade.clone();
    let guard = run.project.groom.value.layer[i].guard.is_some() && run.project.curves.is_none();
    if !guard && !is_wet(run.project, i) && shade.wetness == 0.0 {
        return Ok(Gloss::default());
    }
    let all = interpolate::hairs(run, What::Frame(i, frame))?;
    let hairs = drawn.all[i].len();
    let wet: Vec<f32> = (0..hairs).map(|h| all.wet.get(h).map_or(0.0, |w| w[2]).max(shade.wetness as f32)).collect();
    let mut shine: Vec<f32> = wet.iter().map(|w| 1.0 + (WET_SHINE - 1.0) * w).collect();
    if guard {
        let roots = instance::roots(run, i)?;
        instance::scale_guard_hairs(run, i, &roots, shade.guard as f32, &mut shine)?;
    }
    let mut side = Vec::new();
    if let Some(&level) = acting_clumps(run.project, i).first()
        && let Some(points) = drawn.all[i].uniform_count()
        && wet.iter().any(|w| *w > 0.0)
    {
        let members = clumps::clumps(run, i, level)?;
        let all = sides(points, &all.position, &members);
        let part = |p: usize| all[p].map(|x| x * WET_SIDE * wet[p / points]);
        let scaled: Vec<[f32; 3]> = (0..all.len()).map(part).collect();
        side = nth(&scaled, &drawn.all[i], drawn.every).collect();
    }
    Ok(Gloss { shine: shine.into_iter().step_by(drawn.every).collect(), side })
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
        let lit = Light {
            color: light.color.map(|c| (c * strength) as f32),
            wrap: light.wrap.to_radians(),
            ..Light::default()
        };
        lights.push(match source(light, frame) {
            Source::Directional { direction } => Light { direction: direction.into(), ..lit },
            Source::Point { position } => Light { position: Some(position.into()), ..lit },
            Source::Spot { position, direction, cone, softness } => Light {
                direction: direction.into(),
                position: Some(position.into()),
                cone: Some([cone, cone + softness]),
                ..lit
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

fn tone(run: &Runner<'_>) -> Tone {
    match run.project.shot.value.preview.tone {
        PreviewTone::Shoulder => Tone::Shoulder,
        PreviewTone::Straight => Tone::Straight,
    }
}

fn save(run: &mut Runner<'_>, what: What, name: &str, picture: &Image) -> Result<(), Error> {
    let part = write(&run.project.out_dir().join(name), picture, tone(run))?;
    export::publish(run, what, vec![(part, name.to_owned())])
}

/// Writes a picture beside its path.
fn write(path: &Path, picture: &Image, tone: Tone) -> Result<PathBuf, Error> {
    let out = path.parent().unwrap_or(path);
    std::fs::create_dir_all(out).map_err(Error::disk(out))?;
    let part = unfinished(path);
    write_png(&part, picture.width, picture.height, &picture.to_srgb8(tone))?;
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
