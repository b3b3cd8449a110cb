//! Sample shots for studies: groomed by the pipeline in the bench's folder.

use crate::Error;
use crate::cli::Sample;
use crate::config::Target;
use crate::format::{HairLayer, image::png_bytes};
use crate::progress::Progress;
use crate::project::Project;
use crate::sample;
use crate::stage::{Options, Runner, Skin, SkinPose, What, export, groom, instance, interpolate};
use pelage_geom::{Offsets, StrandId};
use pelage_light::{Camera, HairView, Image, Light, Scene, Settings, SkinView, Tone, render, studio_lights};
use std::cell::OnceCell;
use std::path::Path;
use std::rc::Rc;

/// What is in a cell, made when first wanted.
pub(super) fn lazily<T>(cell: &OnceCell<T>, make: impl FnOnce() -> Result<T, Error>) -> Result<&T, Error> {
    if let Some(found) = cell.get() {
        return Ok(found);
    }
    let made = make()?;
    Ok(cell.get_or_init(|| made))
}

/// A sample shot in the bench's folder.
pub(super) fn project(folder: &Path, kind: Sample) -> Result<Project, Error> {
    let dir = folder.join(format!("shot-{kind:?}").to_lowercase());
    sample::write(&dir, &sample::files(kind))?;
    Project::open(&dir.join("pipeline.toml"))
}

/// The shot up to a frame.
pub(super) fn until(mut project: Project, last: i32) -> Project {
    project.shot.value.shot.frames[1] = last;
    project.frames.retain(|f, _| *f <= last);
    project.shot.value.preview.frame = None;
    project
}

/// The shot with a share of each layer's hairs, the first of their candidates. Unlike [`Project::thinned`] it goes below
/// what clumps need: studies look at hair one by one.
pub(super) fn thinned(project: &Project, share: f64) -> Project {
    let mut out = project.clone();
    out.groom.value.layer.iter_mut().for_each(|l| l.density.value *= share);
    out
}

/// Names of the hairs of a layer of a shot, ascending.
pub(super) fn names(project: &Project, layer: usize) -> Result<Vec<StrandId>, Error> {
    let mut progress = Progress::new(true);
    let mut run = Runner::new(project, draft(), &mut progress)?;
    Ok(instance::roots(&mut run, layer)?.id.clone())
}

/// A run whose results are nobody's last.
pub(super) fn draft() -> Options {
    Options { draft: true, ..Options::default() }
}

/// Finished hair at a shot's first frame, nothing simulated.
pub(super) struct Still {
    pub skin: Rc<Skin>,
    pub pose: Rc<SkinPose>,
    /// Layers with their hairs' positions in `rest`.
    pub layers: Vec<HairLayer>,
    pub origin: [f64; 3],
}

/// Finished hair at the first frame of a shot, without a simulation.
pub(super) fn still(project: &Project) -> Result<Still, Error> {
    let first = project.shot.value.shot.frames[0];
    let mut project = until(project.clone(), first);
    project.shot.value.simulate.target = Target::Off;
    let mut progress = Progress::new(true);
    let mut run = Runner::new(&project, draft(), &mut progress)?;
    let layer = |run: &mut Runner<'_>, i: usize| {
        let rest = interpolate::positions(run, What::Frame(i, first))?;
        Ok::<_, Error>(HairLayer { rest, ..export::look(run, i)? })
    };
    let layers = (0..project.groom.value.layer.len()).map(|i| layer(&mut run, i)).collect::<Result<Vec<_>, _>>()?;
    let pose = groom::pose(&mut run, &project.frames[&first])?;
    let (skin, origin) = (groom::skin(&mut run)?, run.origin()?);
    Ok(Still { skin, pose, layers, origin })
}

/// Hairs of a layer that are kept, by their place and name, `wider` times as wide.
pub(super) fn kept(layer: &HairLayer, keep: impl Fn(usize, StrandId) -> bool, wider: f32) -> HairLayer {
    let chosen: Vec<usize> = (0..layer.id.len()).filter(|&h| keep(h, layer.id[h])).collect();
    let points = || chosen.iter().flat_map(|&h| layer.offsets.range(h));
    HairLayer {
        offsets: Offsets::from_counts(chosen.iter().map(|&h| layer.offsets.range(h).len())),
        id: chosen.iter().map(|&h| layer.id[h]).collect(),
        rest: points().map(|p| layer.rest[p]).collect(),
        width: points().map(|p| layer.width[p] * wider).collect(),
        color: match layer.color_per_point() {
            true => points().map(|p| layer.color[p]).collect(),
            false => chosen.iter().map(|&h| layer.color[h]).collect(),
        },
        opacity: chosen.iter().map(|&h| layer.opacity[h]).collect(),
        ..HairLayer::default()
    }
}

/// A layer as it is drawn.
pub(super) fn view(layer: &HairLayer, origin: [f64; 3]) -> HairView<'_> {
    let plain = HairView::plain(&layer.offsets, &layer.rest, origin, &layer.width);
    HairView { color: &layer.color, opacity: &layer.opacity, ..plain }
}

/// A camera that sees layers of hair from a side.
pub(super) fn camera(layers: &[HairLayer], origin: [f64; 3], from: [f64; 3], aspect: f64) -> Camera {
    let scene = |p: &[f32; 3]| std::array::from_fn::<f64, 3, _>(|x| f64::from(p[x]) + origin[x]);
    let points = layers.iter().flat_map(|l| l.rest.iter().map(scene));
    Camera::frame_points(points, from.map(|x| -x), [0.0, 1.0, 0.0], aspect)
}

/// Draws layers of hair before a skin.
pub(super) fn draw(
    skin: (&Skin, &SkinPose, [f32; 3]),
    layers: &[HairView<'_>],
    camera: &Camera,
    size: [usize; 2],
    lights: &[Light],
    settings: &Settings,
) -> Image {
    let (mesh, pose, color) = skin;
    let skin = SkinView { position: &pose.position, triangle: &mesh.mesh.triangle, normal: &pose.normal, color };
    let scene = Scene { skin: Some(skin), layers, lights, background: [0.0; 3] };
    render(&scene, camera, size[0], size[1], settings).0
}

/// Several layers of hair drawn side by side under the lights of a studio, as a PNG file.
pub(super) fn side_by_side(skin: &Skin, each: &[(&SkinPose, HairView<'_>, &str)], camera: &Camera) -> Vec<u8> {
    let drawn = each.iter().map(|(pose, hair, name)| {
        let lights = studio_lights(camera);
        let mut image =
            draw((skin, pose, [0.3, 0.24, 0.2]), &[*hair], camera, [420, 480], &lights, &Settings::default());
        image.draw_text(name, [8, 8], 2);
        image
    });
    let images: Vec<Image> = drawn.collect();
    let sheet = pelage_light::contact_sheet(&images, images.len());
    png_bytes(sheet.width, sheet.height, 3, &sheet.to_srgb8(Tone::Shoulder))
}
