//! The preview: skin and hairs of a scene to a picture on the CPU.
//!
//! Hairs are drawn as antialiased lines in the order of their depth and blended (opacity shadow maps paper §3). The
//! paper sorts into bins and draws far to near; here the picture is cut into tiles, each with an exact order, drawn
//! near to far, so that covered pixels cost nothing and tiles are independent of each other.

use crate::hair::{Chunk, Draw, Scratch, Tiling};
use crate::raster::{Facet, Filter, Piece, Point, Strokes, TILE, Tile};
use crate::shade::{HairModel, HairPoint, LightDir, fade, to_light};
use crate::slab::{HUGE, Slabs};
use crate::{Camera, HairShade, Image, Light, V3, View, camera};
use pelage_geom::{Offsets, Vec3, registers};
use rayon::prelude::*;
use std::ops::Range;

/// A skin to draw.
#[derive(Clone, Copy, Debug)]
pub struct SkinView<'a> {
    /// Vertices, scene units.
    pub position: &'a [[f64; 3]],
    /// Triangles as vertex indices; both sides are drawn.
    pub triangle: &'a [[u32; 3]],
    /// Smooth unit normals, one a vertex; empty for flat facets.
    pub normal: &'a [[f32; 3]],
    /// Linear colour.
    pub color: [f32; 3],
}

/// A layer of hairs to draw. Columns may be empty where a default is named; missing ends of columns count as default.
#[derive(Clone, Copy, Debug)]
pub struct HairView<'a> {
    /// Runs of points, one a strand.
    pub offsets: &'a Offsets,
    /// Points, scene units relative to `origin`; root first.
    pub position: &'a [[f32; 3]],
    /// Scene-space point that positions are relative to.
    pub origin: [f64; 3],
    /// Diameter, scene units, one a point (default 0: not seen).
    pub width: &'a [f32],
    /// Linear colour, one a strand or one a point, interpolated along the hair (default a middle brown).
    pub color: &'a [[f32; 3]],
    /// Opacity of a hair's whole width, one a strand, in [0, 1] (default 1).
    pub opacity: &'a [f32],
    /// Unit normal of the skin at the root, one a strand (default none: shading by the hair's direction alone).
    pub root_normal: &'a [[f32; 3]],
    /// Factor of the first highlight, one a strand, >= 0 (default 1): guard hairs, wet hair.
    pub shine: &'a [f32],
    /// How far out on its clump a point lies, and which way in scene space: 0 in the middle to 1 in length, one a point
    /// (default 0). What is turned to a light is brighter by that much, what is turned away darker: the production
    /// pipeline's shading of wet fur (§4.4).
    pub side: &'a [[f32; 3]],
    /// For each light of the scene the part that arrives, one a point, in [0, 1], past hair and skin; empty: a cue by
    /// coarse slabs instead.
    pub transmittance: &'a [Vec<f32>],
}

impl<'a> HairView<'a> {
    /// Hairs with a width along them, all else as by default.
    pub fn plain(offsets: &'a Offsets, position: &'a [[f32; 3]], origin: [f64; 3], width: &'a [f32]) -> Self {
        HairView {
            offsets,
            position,
            origin,
            width,
            color: &[],
            opacity: &[],
            root_normal: &[],
            shine: &[],
            side: &[],
            transmittance: &[],
        }
    }
}

/// What is drawn, and in what light.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Skin: hides hair, takes light and shadow.
    pub skin: Option<SkinView<'a>>,
    /// Layers of hair, drawn as one.
    pub layers: &'a [HairView<'a>],
    /// Lights; [`crate::studio_lights`] makes three.
    pub lights: &'a [Light],
    /// Linear colour behind everything.
    pub background: [f32; 3],
}

/// How it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Shading of hairs.
    pub hair: HairShade,
    /// Linear colour of the light from all around.
    pub ambient: [f32; 3],
    /// Factor of the optical depth of hair in the shadow cue; 0 for none, 1 for what the widths say.
    pub shadow: f32,
    /// Part of its width that the farthest hair loses, the others by their depth, in [0, 1): a cue for depth beyond that
    /// of perspective.
    pub depth_cue: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { hair: HairShade::default(), ambient: [0.18, 0.19, 0.21], shadow: 0.9, depth_cue: 0.0 }
    }
}

/// What was drawn and what could not be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderCounts {
    /// Strands of all layers.
    pub hairs: usize,
    /// Lines drawn for them: only what is in the picture.
    pub pieces: usize,
    /// Pixels that those lines were blended into, counted for each line.
    pub pixels: usize,
    /// Points of strands left out because they are not finite; the hair is cut there.
    pub bad_points: usize,
    /// Triangles left out because a corner is missing or not finite.
    pub bad_triangles: usize,
}

/// Part of the light that a white hair passes on to those behind it. Light hair scatters forward: at 0 blond hair gets
/// black shadows, at 1 white fur gets none.
const SCATTER: f32 = 0.6;

/// Part of the ambient light that reaches a place into which no light shines.
const DEEP: f32 = 0.15;

/// Cosine between view and triangle under which both of its sides count as the outer one: slivers on an outline.
const EDGE_ON: f64 = 0.05;

/// Linear colour of hair without a colour.
const BROWN: [f32; 3] = [0.16, 0.085, 0.042];

/// Strands per chunk of work.
const CHUNK: usize = 256;

/// A point of a layer in scene space.
pub(crate) fn in_layer(layer: &HairView, p: &[f32; 3]) -> Vec3 {
    in_scene(layer.origin, p)
}

/// A point that is stored relative to an origin.
pub(crate) fn in_scene(origin: [f64; 3], p: &[f32; 3]) -> Vec3 {
    Vec3::new(origin[0] + f64::from(p[0]), origin[1] + f64::from(p[1]), origin[2] + f64::from(p[2]))
}

/// Diameter at point `i`, finite and >= 0.
pub(crate) fn diameter(width: &[f32], i: usize) -> f32 {
    width.get(i).copied().filter(|w| *w > 0.0 && *w < 1e15).unwrap_or(0.0)
}

impl HairView<'_> {
    /// Diameter at point `i`, >= 0.
    pub(crate) fn width(&self, i: usize) -> f32 {
        diameter(self.width, i)
    }

    /// Colour of strand `s` at its point `i` (counted over all strands). A strand has two points or more: more colours
    /// than strands are one a point.
    pub(crate) fn color(&self, s: usize, i: usize) -> V3 {
        let entry = if self.color.len() > self.offsets.len() { i } else { s };
        V3::from(self.color.get(entry).copied().unwrap_or(BROWN)).map(|c| c.clamp(0.0, 1.0)).map(not_nan)
    }

    pub(crate) fn opacity(&self, s: usize) -> f32 {
        not_nan(self.opacity.get(s).copied().unwrap_or(1.0).clamp(0.0, 1.0))
    }

    pub(crate) fn shine(&self, s: usize) -> f32 {
        not_nan(self.shine.get(s).copied().unwrap_or(1.0).clamp(0.0, 1e3))
    }

    pub(crate) fn side(&self, i: usize) -> V3 {
        let side = V3::from(self.side.get(i).copied().unwrap_or_default()).map(not_nan);
        side / side.norm().max(1.0)
    }

    pub(crate) fn root_normal(&self, s: usize) -> Option<Vec3> {
        let n = Vec3::from(self.root_normal.get(s)?.map(f64::from));
        (n.norm_squared() > 0.25 && n.norm_squared() < 4.0).then(|| n.normalize())
    }
}

impl SkinView<'_> {
    /// Corners of a triangle, if they exist and are finite.
    pub(crate) fn corners(&self, triangle: &[u32; 3]) -> Option<[Vec3; 3]> {
        let mut corner = [Vec3::zeros(); 3];
        for (c, &v) in corner.iter_mut().zip(triangle) {
            *c = Vec3::from(*self.position.get(v as usize)?);
        }
        corner.iter().all(|c| c.iter().all(|v| v.abs() < HUGE)).then_some(corner)
    }
}

fn not_nan(x: f32) -> f32 {
    if x.is_nan() { 0.0 } else { x }
}

/// Middle of the bounds of all hair and skin.
fn middle(scene: &Scene) -> Vec3 {
    let hair = scene.layers.iter().flat_map(|l| l.position.iter().map(|p| in_layer(l, p)));
    let skin = scene.skin.iter().flat_map(|s| s.position.iter().map(|p| Vec3::from(*p)));
    camera::middle(hair.chain(skin).filter(|p| p.iter().all(|v| v.abs() < HUGE)))
}

/// Width of hair by its depth: factor at depth 0, and its change by depth. It is 1 at the nearest hair before the camera
/// and `1 - strength` at the farthest.
fn cue(scene: &Scene, view: &View, strength: f32) -> [f32; 2] {
    if strength <= 0.0 || strength.is_nan() {
        return [1.0, 0.0];
    }
    let none = [f32::INFINITY, f32::NEG_INFINITY];
    let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let depth = |layer: &HairView, p: &[f32; 3]| view.to_camera(in_layer(layer, p)).z;
    let seen = |z: f64| if z >= view.near && z < HUGE { [z as f32; 2] } else { none };
    let of = |l: &HairView| l.position.par_iter().map(|p| seen(depth(l, p))).reduce(|| none, join);
    let [near, far] = scene.layers.iter().map(of).fold(none, join);
    let per = strength.min(0.999) / (far - near);
    if per.is_finite() && per > 0.0 { [1.0 + per * near, -per] } else { [1.0, 0.0] }
}

/// Lights in camera space with their shadow cues.
pub(crate) struct Lighting {
    lights: Vec<LightDir>,
    slabs: Vec<Slabs>,
    model: HairModel,
    settings: Settings,
    /// Unit, camera space.
    up: V3,
    parallel: bool,
}

impl Lighting {
    fn new(scene: &Scene, camera: &Camera, view: &View, settings: &Settings) -> Lighting {
        let toward: Vec<Vec3> = scene.lights.iter().map(to_light).collect();
        let lights = toward.iter().zip(scene.lights);
        let up = to_light(&Light { direction: camera.up.map(|v| -v), ..Light::default() });
        // Shadows on the skin of a light nearby are those of one far away beyond it.
        let middle = if scene.lights.iter().any(|l| l.position.is_some()) { middle(scene) } else { Vec3::zeros() };
        let far = |(t, l): (&Vec3, &Light)| {
            l.position.and_then(|p| (Vec3::from(p) - middle).try_normalize(0.0)).unwrap_or(*t)
        };
        let far: Vec<Vec3> = toward.iter().zip(scene.lights).map(far).collect();
        Lighting {
            lights: lights
                .map(|(t, l)| LightDir {
                    to_light: view.turn(*t).cast(),
                    color: V3::from(l.color),
                    position: l.position.map(|p| view.to_camera(Vec3::from(p)).cast()),
                    cone: l.cone.map(|c| c.map(|a| libm::cos(a) as f32)),
                    wrap: libm::sin(l.wrap.clamp(0.0, std::f64::consts::FRAC_PI_2)) as f32,
                })
                .collect(),
            slabs: far.par_iter().map(|t| Slabs::new(scene, *t, view)).collect(),
            model: HairModel::new(settings.hair),
            settings: *settings,
            up: view.turn(up).cast(),
            parallel: view.parallel,
        }
    }

    /// Numbers that [`Lighting::depths`] gives for a point.
    pub fn columns(&self) -> usize {
        2 * self.lights.len()
    }

    /// Appends per light: optical depth of hair towards it, and the part of it that the skin lets through. `normal` is
    /// that of the skin at a point of the skin, else zero.
    pub fn depths(&self, p: V3, normal: V3, out: &mut Vec<f32>) {
        for s in &self.slabs {
            out.push(self.settings.shadow * s.hair_depth(p));
            out.push(s.skin_light(p, normal));
        }
    }

    /// The same for a point of a hair, from its light if that is known: a column for each light.
    pub fn depths_of(&self, p: V3, known: &[Vec<f32>], i: usize, out: &mut Vec<f32>) {
        if known.len() != self.lights.len() || known.iter().any(|c| i >= c.len()) {
            return self.depths(p, V3::zeros(), out);
        }
        for column in known {
            let t = column[i].clamp(0.0, 1.0);
            // What is dark altogether is behind the skin: hair lets something through.
            out.push(if t > 0.0 { -self.settings.shadow * libm::logf(t) } else { 0.0 });
            out.push(f32::from(t > 0.0));
        }
    }

    fn eye(&self, p: V3) -> V3 {
        if self.parallel { -V3::z() } else { -p / p.norm().max(f32::MIN_POSITIVE) }
    }

    /// Part of the ambient light that arrives where `depth` is as from [`Lighting::depths`].
    fn ambient(&self, depth: &[f32]) -> f32 {
        let open: f32 = depth.chunks_exact(2).map(|d| fade(d[0]) * (0.5 + 0.5 * d[1])).sum();
        DEEP + (1.0 - DEEP) * if depth.is_empty() { 1.0 } else { open / self.lights.len() as f32 }
    }

    /// Colour of a hair at a point where `depth` is as from [`Lighting::depths`].
    pub fn hair(&self, at: &HairPoint, depth: &[f32]) -> V3 {
        let (p, color) = (at.position, at.color);
        let eye = self.eye(p);
        let ambient = V3::from(self.settings.ambient).component_mul(&color) * self.ambient(depth);
        let mut sum = ambient;
        for (light, d) in self.lights.iter().zip(depth.chunks_exact(2)) {
            let through = color.map(|c| fade(d[0] * (1.0 - SCATTER * c)) * d[1]);
            let (toward, beam) = light.toward(p);
            let sent = self.model.reflect(at, eye, toward, light.wrap) * (beam * (1.0 + at.side.dot(&toward)));
            sum += sent.component_mul(&light.color).component_mul(&through);
        }
        sum
    }

    /// Colour of the skin at a point of camera space with a unit normal on the side that is seen.
    fn skin(&self, p: V3, n: V3, color: V3) -> V3 {
        let mut depth = Vec::with_capacity(self.columns());
        self.depths(p, n, &mut depth);
        let mut sum = V3::from(self.settings.ambient) * (self.ambient(&depth) * (0.75 + 0.25 * n.dot(&self.up)));
        for (light, d) in self.lights.iter().zip(depth.chunks_exact(2)) {
            let (toward, beam) = light.toward(p);
            sum += light.color * (n.dot(&toward).max(0.0) * beam * fade(d[0]) * d[1]);
        }
        sum.component_mul(&color)
    }
}

/// Pixels of a picture: columns and rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    /// Columns, from the left.
    pub x: Range<usize>,
    /// Rows, from the top.
    pub y: Range<usize>,
}

/// Draws a scene. The same bytes for any number of threads. Bad input is passed over and counted, never an error; a
/// picture without pixels is an empty image.
pub fn render(
    scene: &Scene,
    camera: &Camera,
    width: usize,
    height: usize,
    settings: &Settings,
) -> (Image, RenderCounts) {
    render_region(scene, camera, [width, height], &Region { x: 0..width, y: 0..height }, settings)
}

/// Draws a region of the picture of `size` (width, height) that [`render`] draws: the same pixels, byte for byte. What
/// lies outside the picture is left off. Shadows are those of the whole scene; lines are drawn for the region only.
pub fn render_region(
    scene: &Scene,
    camera: &Camera,
    [width, height]: [usize; 2],
    region: &Region,
    settings: &Settings,
) -> (Image, RenderCounts) {
    let mut counts = RenderCounts { hairs: scene.layers.iter().map(|l| l.offsets.len()).sum(), ..Default::default() };
    let within = |r: &Range<usize>, size: usize| r.start.min(size)..r.end.min(size);
    let region = Region { x: within(&region.x, width), y: within(&region.y, height) };
    if region.x.is_empty() || region.y.is_empty() {
        return (Image { width: region.x.len(), height: region.y.len(), rgb: Vec::new() }, counts);
    }
    let view = camera.view(width, height);
    let tiling = Tiling::new(width, height, &region);
    let lighting = Lighting::new(scene, camera, &view, settings);
    let (facets, facet_bins) = facets(scene, &view, &tiling, &mut counts);
    let draw = Draw { view: &view, lighting: &lighting, tiling, cue: cue(scene, &view, settings.depth_cue) };
    let lines = lines(scene, &draw, &mut counts);
    let filter = Filter::new();
    let tiles: Vec<usize> = (0..tiling.count()).filter(|t| tiling.is_drawn(*t)).collect();
    let (drawn, blended): (Vec<Vec<[f32; 3]>>, Vec<usize>) = tiles
        .into_par_iter()
        // Some tiles cost many times as much as others.
        .with_max_len(1)
        .map(|t| {
            let (x, y) = (t % tiling.across * TILE, t / tiling.across * TILE);
            let mut tile = Tile::new(x, y, TILE.min(width - x), TILE.min(height - y));
            for &f in &facet_bins.1[facet_bins.0[t]..facet_bins.0[t + 1]] {
                tile.facet(&facets[f as usize], !view.parallel);
            }
            let (order, points, opacity) = (&lines.of(t)[..], &lines.points[..], &lines.opacity[..]);
            registers::run(Strokes { tile: &mut tile, order, points, opacity, view: &view, filter: &filter });
            let drawn = tile.resolve(scene.background, |triangle, at, depth| {
                skin_color(scene, &view, &lighting, triangle, at, depth)
            });
            (drawn, tile.blended)
        })
        .unzip();
    counts.pixels = blended.iter().sum();
    (assemble(&drawn, &tiling, &region), counts)
}

/// Puts the region together from the drawn tiles.
fn assemble(drawn: &[Vec<[f32; 3]>], tiling: &Tiling, region: &Region) -> Image {
    let mut image = Image::filled(region.x.len(), region.y.len(), [0.0; 3]);
    let [[left, right], [top, _]] = tiling.drawn;
    image.rgb.par_chunks_mut(region.x.len()).zip(region.y.clone()).for_each(|(row, y)| {
        for i in left..right {
            let x0 = i * TILE;
            let x1 = (x0 + TILE).min(tiling.width);
            let (from, to) = (x0.max(region.x.start), x1.min(region.x.end));
            let tile = &drawn[(y / TILE - top) * (right - left) + i - left];
            let start = y % TILE * (x1 - x0) + from - x0;
            row[from - region.x.start..to - region.x.start].copy_from_slice(&tile[start..start + to - from]);
        }
    });
    image
}

/// What falls into each tile t: elements start[t] to start[t + 1] of the list.
type Bins<T> = (Vec<usize>, Vec<T>);

/// Sorts pairs of (tile, value) into tiles, in their order.
fn bin<T: Copy + Default>(tiles: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Bins<T> {
    let mut start = vec![0usize; tiles + 1];
    for (t, _) in pairs.clone() {
        start[t as usize + 1] += 1;
    }
    for t in 0..tiles {
        start[t + 1] += start[t];
    }
    let mut list = vec![T::default(); start[tiles]];
    let mut next = start.clone();
    for (t, v) in pairs {
        list[next[t as usize]] = v;
        next[t as usize] += 1;
    }
    (start, list)
}

/// Hairs in the picture.
struct Lines {
    /// Points, by chunk of strands.
    points: Vec<Vec<Point>>,
    /// Pieces by tile in each chunk: bits of their depth, and first point.
    pieces: Vec<Bins<[u32; 2]>>,
    /// Opacity per strand.
    opacity: Vec<f32>,
}

impl Lines {
    /// A tile's pieces, near to far. No two are alike, so sorting them gives one order only.
    fn of(&self, tile: usize) -> Vec<Piece> {
        let mut all: Vec<Piece> = Vec::new();
        for (chunk, (start, list)) in (0u32..).zip(&self.pieces) {
            all.extend(list[start[tile]..start[tile + 1]].iter().map(|[depth, point]| [*depth, chunk, *point]));
        }
        all.sort_unstable();
        all
    }
}

/// Shades all hairs and cuts them to pieces.
fn lines(scene: &Scene, draw: &Draw, counts: &mut RenderCounts) -> Lines {
    let mut jobs: Vec<(&HairView, Range<usize>, usize)> = Vec::new();
    let mut opacity = Vec::with_capacity(counts.hairs);
    for layer in scene.layers {
        let (n, first) = (layer.offsets.len(), opacity.len());
        jobs.extend((0..n).step_by(CHUNK).map(|s| (layer, s..(s + CHUNK).min(n), first)));
        opacity.extend((0..n).map(|s| layer.opacity(s)));
    }
    let work = |(layer, strands, first): &(&HairView, Range<usize>, usize)| {
        let (mut chunk, mut scratch) = (Chunk::default(), Scratch::default());
        for s in strands.clone() {
            draw.strand(layer, s, (first + s) as u32, &mut scratch, &mut chunk);
        }
        let piece = |&(tile, i): &(u32, u32)| {
            let z = 0.5 * (chunk.points[i as usize].z + chunk.points[i as usize + 1].z);
            (tile, [z.to_bits(), i])
        };
        let pieces = bin(draw.tiling.count(), chunk.bins.iter().map(piece));
        ((chunk.points, pieces), [chunk.pieces, chunk.bad_points])
    };
    let (lists, sums): (Vec<_>, Vec<[usize; 2]>) = jobs.par_iter().with_max_len(1).map(work).unzip();
    for [pieces, bad_points] in sums {
        counts.pieces += pieces;
        counts.bad_points += bad_points;
    }
    let (points, pieces) = lists.into_iter().unzip();
    Lines { points, pieces, opacity }
}

/// Triangles in the picture, cut at the near plane, and for each tile the list of those that touch it.
fn facets(scene: &Scene, view: &View, tiling: &Tiling, counts: &mut RenderCounts) -> (Vec<Facet>, Bins<u32>) {
    let mut facets = Vec::new();
    let mut pairs = Vec::new();
    for (t, corner) in scene.skin.iter().flat_map(|s| s.triangle.iter().map(|t| s.corners(t)).enumerate()) {
        let Some(corner) = corner else {
            counts.bad_triangles += 1;
            continue;
        };
        let polygon = clip_near(corner.map(|p| view.to_camera(p)), view.near);
        let polygon: Vec<[f64; 3]> = polygon
            .iter()
            .map(|c| [view.centre[0] + c.x * view.scale(c.z), view.centre[1] + c.y * view.scale(c.z), c.z])
            .collect();
        for k in 2..polygon.len() {
            let corner = [polygon[0], polygon[k - 1], polygon[k]];
            let low = std::array::from_fn(|i| corner.iter().fold(f64::INFINITY, |m, c| m.min(c[i])) as f32 - 1.0);
            let high = std::array::from_fn(|i| corner.iter().fold(f64::NEG_INFINITY, |m, c| m.max(c[i])) as f32 + 1.0);
            let index = facets.len() as u32;
            facets.push(Facet { corner, triangle: t as u32 });
            tiling.touched(low, high, |tile| pairs.push((tile, index)));
        }
    }
    let bins = bin(tiling.count(), pairs.iter().copied());
    (facets, bins)
}

/// The part of a triangle of camera space beyond the near plane: 0, 3 or 4 corners.
fn clip_near(corner: [Vec3; 3], near: f64) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (corner[i], corner[(i + 1) % 3]);
        if a.z >= near {
            out.push(a);
        }
        if (a.z >= near) != (b.z >= near) {
            out.push(a + (b - a) * ((near - a.z) / (b.z - a.z)));
        }
    }
    out
}

/// The unit normal of the side that `eye` (unit, away from the skin) sees. `face` is the normal of the flat triangle, on
/// the side of `normal`: it says which side is seen, as a smooth normal near an outline may already point away. Such
/// a normal is bent until it is at right angles to the view; turned round, it would light the outline from behind.
fn seen_side(normal: Vec3, face: Vec3, eye: Vec3) -> Vec3 {
    let normal = if face.dot(&eye) < -EDGE_ON { -normal } else { normal };
    let away = normal.dot(&eye).min(0.0);
    let bent = normal - eye * away;
    let size = bent.norm();
    if size > 1e-6 { bent / size } else { eye }
}

/// Colour of the skin where the ray through pixel position `at` meets `triangle` at `depth`.
fn skin_color(scene: &Scene, view: &View, lighting: &Lighting, triangle: u32, at: [f64; 2], depth: f32) -> V3 {
    let Some(skin) = &scene.skin else { return V3::zeros() };
    let vertex = skin.triangle[triangle as usize];
    let Some(corner) = skin.corners(&vertex) else { return V3::zeros() };
    let c = corner.map(|p| view.to_camera(p));
    let per = 1.0 / view.scale(f64::from(depth));
    let p = Vec3::new((at[0] - view.centre[0]) * per, (at[1] - view.centre[1]) * per, f64::from(depth));
    let face = (c[1] - c[0]).cross(&(c[2] - c[0]));
    let area = face.norm_squared();
    if area <= 0.0 || !area.is_finite() {
        return V3::zeros();
    }
    let weight = |i: usize| (c[(i + 1) % 3] - p).cross(&(c[(i + 2) % 3] - p)).dot(&face) / area;
    let mut normal = Vec3::zeros();
    for (i, &v) in vertex.iter().enumerate() {
        if let Some(n) = skin.normal.get(v as usize) {
            normal += view.turn(Vec3::from(n.map(f64::from))) * weight(i).clamp(0.0, 1.0);
        }
    }
    let size = normal.norm();
    let face = face / area.sqrt();
    let normal = if size > 1e-9 && size.is_finite() { normal / size } else { face };
    let eye = lighting.eye(p.cast()).cast();
    let normal = seen_side(normal, if face.dot(&normal) < 0.0 { -face } else { face }, eye);
    lighting.skin(p.cast(), normal.cast(), V3::from(skin.color))
}
