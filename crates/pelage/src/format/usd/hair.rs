//! Hair of a shot as one binary USD file, and the check of what was written.

use super::curves::{UsdCurves, read_curves};
use super::read::{CrateFile, Node as FileNode};
use super::write::{CrateWriter, Element, Node};
use super::{Rep, Type};
use crate::format::check::{Bounds, ShotCheck, is_width, write_error};
use crate::format::{FormatError, HairFrame, HairLayer, ShotFacts};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, FormatError>;

/// Name of the prim that holds the layers.
const ROOT: &str = "Hair";

/// A shot being written. Frames stream to the disk as they come; what is kept is a few numbers a frame.
///
/// The file has an Xform "Hair" (moved to the origin of the shot) with one `BasisCurves` prim for each layer: cubic,
/// catmullRom, pinned, so that every curve starts at its first point and ends at its last. `points`, `velocities` (per
/// second) and `extent` are sampled at exactly the frames of the shot. `widths` are diameters, one a point. Uniform
/// (one a curve): `st` and `surface_uv_coordinate` (texture coordinates of the root), `hairId`, `displayColor` (one a
/// point, `vertex`, where the layer has it so), `displayOpacity`, and with a skin `skinprim`, `skinprimuv`. One a point:
/// `rest`. Constant: `layer`, `pelage` (the facts of the shot, also in the `customLayerData` of the file). Where a frame
/// brings widths or opacities of its own, `widths` or `displayOpacity` has a sample at every frame beside the layer's.
/// Where the facts name lights, `transmittance` (one a point, of all lights together, the same as `groom_ao`) and
/// `transmittance:NAME` of each light have a sample at every frame.
pub struct UsdHair {
    path: PathBuf,
    check: ShotCheck,
    out: CrateWriter<File>,
    frames: Vec<i32>,
    layers: Vec<LayerOut>,
}

/// Where the samples of one layer went.
struct LayerOut {
    points: Node,
    velocities: Node,
    extent: Node,
    /// Half the largest width: how far the hair reaches beyond its points.
    pad: f32,
    samples: [Vec<Rep>; 3],
    width: Sampled,
    opacity: Sampled,
    /// Columns of transmittance, and their samples.
    shadow: Vec<(Vec<Node>, Vec<Rep>)>,
}

/// A column that the layer has and single frames may replace.
struct Sampled {
    node: Node,
    /// Its value in the layer.
    layer: Rep,
    /// One a frame; the layer's where the frame has none.
    samples: Vec<Rep>,
    /// Whether any frame has its own.
    any: bool,
}

impl Sampled {
    fn push(&mut self, out: &mut CrateWriter<File>, values: &[f32]) -> io::Result<()> {
        self.any |= !values.is_empty();
        self.samples.push(if values.is_empty() { self.layer } else { out.array(values)? });
        Ok(())
    }
}

fn half_widest(width: &[f32]) -> f32 {
    width.iter().copied().fold(0.0, f32::max) / 2.0
}

impl UsdHair {
    /// Starts `path` and writes what does not change over the shot.
    pub fn create(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Result<Self> {
        let check = ShotCheck::new(path, facts, layers)?;
        let start = || -> io::Result<_> {
            let mut out = CrateWriter::new(File::create(path)?)?;
            let root = write_stage(&mut out, facts)?;
            let names = identifiers(layers.iter().map(|l| l.name.as_str()));
            let layers = layers.iter().zip(&names).map(|(l, name)| write_layer(&mut out, root, l, name, facts));
            let layers = layers.collect::<io::Result<_>>()?;
            Ok((out, layers))
        };
        let (out, layers) = start().map_err(|e| write_error(path, &e))?;
        Ok(UsdHair { path: path.to_path_buf(), check, out, frames: facts.frames.clone(), layers })
    }

    /// Writes the next frame, with one entry for each layer.
    pub fn write_frame(&mut self, frame: i32, layers: &[HairFrame]) -> Result<()> {
        let bounds = self.check.frame(frame, layers)?;
        for ((layer, data), bounds) in self.layers.iter_mut().zip(layers).zip(bounds) {
            let pad = if data.width.is_empty() { layer.pad } else { half_widest(data.width) };
            let extent = bounds.padded(pad);
            let mut write = || -> io::Result<()> {
                layer.samples[0].push(self.out.array(data.position)?);
                layer.samples[1].push(self.out.array(data.velocity)?);
                layer.samples[2].push(self.out.array(&extent)?);
                layer.width.push(&mut self.out, data.width)?;
                layer.opacity.push(&mut self.out, data.opacity)?;
                for ((_, samples), column) in layer.shadow.iter_mut().zip(data.transmittance) {
                    samples.push(self.out.array(column)?);
                }
                Ok(())
            };
            write().map_err(|e| write_error(&self.path, &e))?;
        }
        Ok(())
    }

    /// Completes the file, which cannot be opened before. An error if a frame of the shot is missing.
    pub fn finish(self) -> Result<()> {
        self.check.finish()?;
        let UsdHair { path, mut out, frames, layers, .. } = self;
        let finish = || -> io::Result<()> {
            let times: Vec<f64> = frames.iter().map(|&f| f64::from(f)).collect();
            let times = out.times(&times)?;
            for layer in layers {
                let nodes = [layer.points, layer.velocities, layer.extent];
                for (node, samples) in nodes.into_iter().zip(&layer.samples) {
                    let samples = out.time_samples(times, samples)?;
                    out.field(node, "timeSamples", samples);
                }
                for column in [layer.width, layer.opacity].into_iter().filter(|c| c.any) {
                    let samples = out.time_samples(times, &column.samples)?;
                    out.field(column.node, "timeSamples", samples);
                }
                for (nodes, samples) in layer.shadow {
                    let samples = out.time_samples(times, &samples)?;
                    nodes.into_iter().for_each(|node| out.field(node, "timeSamples", samples));
                }
            }
            out.finish().map(drop)
        };
        finish().map_err(|e| write_error(&path, &e))
    }
}

/// The facts of the shot and the prim above the layers.
fn write_stage(out: &mut CrateWriter<File>, facts: &ShotFacts) -> io::Result<Node> {
    let root = out.root();
    let [first, last] = [facts.frames.first(), facts.frames.last()].map(|f| f64::from(f.copied().unwrap_or(0)));
    let token = out.token(ROOT);
    out.field(root, "defaultPrim", token);
    let token = out.token(if facts.up == 'Z' { "Z" } else { "Y" });
    out.field(root, "upAxis", token);
    for (name, value) in [
        ("metersPerUnit", facts.meters_per_unit),
        ("timeCodesPerSecond", facts.fps),
        ("framesPerSecond", facts.fps),
        ("startTimeCode", first),
        ("endTimeCode", last),
    ] {
        let value = out.double(value)?;
        out.field(root, name, value);
    }
    let entries: Vec<(String, Rep)> = facts_list(facts).map(|(k, v)| (k.to_owned(), out.string(v))).collect();
    let inner = out.dictionary(&entries)?;
    let data = out.dictionary(&[("pelage".to_owned(), inner)])?;
    out.field(root, "customLayerData", data);

    let prim = out.prim(root, ROOT, "Xform");
    let kind = out.token("component");
    out.field(prim, "kind", kind);
    if facts.origin != [0.0; 3] {
        let node = out.attribute(prim, "xformOp:translate", "double3");
        let value = out.double3(facts.origin)?;
        out.field(node, "default", value);
        let order = out.token_array(&["xformOp:translate"])?;
        out.uniform(prim, "xformOpOrder", "token[]", order);
    }
    Ok(prim)
}

/// What a reader of the file may want to know beyond what USD has a place for.
fn facts_list(facts: &ShotFacts) -> impl Iterator<Item = (&str, &str)> {
    let own = [
        ("shot", facts.name.as_str()),
        ("widths", "diameters, scene units"),
        ("velocities", "scene units per second"),
        ("curves", "through their points, root first"),
    ];
    own.into_iter().chain(facts.extra.iter().map(|(k, v)| (k.as_str(), v.as_str())))
}

fn facts_text(facts: &ShotFacts) -> String {
    facts_list(facts).map(|(k, v)| format!("{k}={v}")).collect::<Vec<_>>().join("\n")
}

/// A column's name as USD allows it: no dashes.
fn property(name: &str) -> String {
    name.replace('-', "_")
}

/// Names that USD allows for prims: ASCII letters, digits and underscores, no digit first, all different.
fn identifiers<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut out: Vec<String> = vec![];
    for name in names {
        let mut id: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if !id.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            id.insert(0, '_');
        }
        let base = id.clone();
        let mut n = 2;
        while out.contains(&id) {
            id = format!("{base}_{n}");
            n += 1;
        }
        out.push(id);
    }
    out
}

fn write_layer(
    out: &mut CrateWriter<File>,
    root: Node,
    layer: &HairLayer,
    name: &str,
    facts: &ShotFacts,
) -> io::Result<LayerOut> {
    let prim = out.prim(root, name, "BasisCurves");
    let display = out.string(&layer.name);
    out.field(prim, "displayName", display);
    for (name, value) in [("type", "cubic"), ("basis", "catmullRom"), ("wrap", "pinned")] {
        let value = out.token(value);
        out.uniform(prim, name, "token", value);
    }
    let counts: Vec<i32> = layer.offsets.counts().map(|n| n as i32).collect();
    let node = out.attribute(prim, "curveVertexCounts", "int[]");
    let value = out.array(&counts)?;
    out.field(node, "default", value);
    let points = out.attribute(prim, "points", "point3f[]");
    let velocities = out.attribute(prim, "velocities", "vector3f[]");
    let extent = out.attribute(prim, "extent", "float3[]");

    let mut column = Columns { out, prim };
    let width = column.sampled("widths", "vertex", &layer.width)?;
    column.write("primvars:rest", "point3f[]", "vertex", &layer.rest)?;
    column.write("primvars:st", "texCoord2f[]", "uniform", &layer.root_uv)?;
    column.write("primvars:surface_uv_coordinate", "float2[]", "uniform", &layer.root_uv)?;
    column.write("primvars:hairId", "int64[]", "uniform", bytemuck::cast_slice::<u64, i64>(&layer.id))?;
    let per = if layer.color_per_point() { "vertex" } else { "uniform" };
    column.write("primvars:displayColor", "color3f[]", per, &layer.color)?;
    let opacity = column.sampled("primvars:displayOpacity", "uniform", &layer.opacity)?;
    if !layer.skin_face.is_empty() {
        column.write("primvars:skinprim", "int[]", "uniform", &layer.skin_face)?;
        column.write("primvars:skinprimuv", "texCoord2f[]", "uniform", &layer.skin_bary)?;
    }
    column.text("primvars:layer", &layer.name);
    column.text("primvars:pelage", &facts_text(facts));
    let names = facts.shadow_columns();
    let shadow = names.iter().enumerate().map(|(i, name)| {
        let node = column.unset(&format!("primvars:{}", property(name)), "float[]", "vertex");
        // Where a game engine reads light.
        let other = (i == 0).then(|| column.unset("primvars:groom_ao", "float[]", "vertex"));
        (std::iter::once(node).chain(other).collect(), vec![])
    });
    let shadow = shadow.collect();
    let pad = half_widest(&layer.width);
    Ok(LayerOut { points, velocities, extent, pad, samples: [vec![], vec![], vec![]], width, opacity, shadow })
}

/// Writes attributes of one prim that have an interpolation.
struct Columns<'a> {
    out: &'a mut CrateWriter<File>,
    prim: Node,
}

impl Columns<'_> {
    fn write<T: Element>(&mut self, name: &str, type_name: &str, interpolation: &str, values: &[T]) -> io::Result<()> {
        let value = self.out.array(values)?;
        self.field(name, type_name, interpolation, value);
        Ok(())
    }

    fn sampled(&mut self, name: &str, interpolation: &str, values: &[f32]) -> io::Result<Sampled> {
        let layer = self.out.array(values)?;
        Ok(Sampled { node: self.field(name, "float[]", interpolation, layer), layer, samples: vec![], any: false })
    }

    fn text(&mut self, name: &str, text: &str) {
        let value = self.out.string(text);
        self.field(name, "string", "constant", value);
    }

    fn field(&mut self, name: &str, type_name: &str, interpolation: &str, value: Rep) -> Node {
        let node = self.unset(name, type_name, interpolation);
        self.out.field(node, "default", value);
        node
    }

    /// An attribute without a value but those of its samples.
    fn unset(&mut self, name: &str, type_name: &str, interpolation: &str) -> Node {
        let node = self.out.attribute(self.prim, name, type_name);
        let interpolation = self.out.token(interpolation);
        self.out.field(node, "interpolation", interpolation);
        node
    }
}

/// Reads `path` back and compares it with what [`UsdHair`] was given: the facts; counts, ids and every column of every
/// layer; the sizes and times of all samples; at the first and the last frame also that all values are finite, widths
/// not negative, and that the extent holds the points with their widths.
pub fn verify(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Result<()> {
    let bad = |what: String| FormatError::new(path, what).hint("the file is not what was exported: export it again");
    if layers.is_empty() {
        return CrateFile::open(path).map(drop);
    }
    let mut file = CrateFile::open(path)?;
    let root = file.root();
    let prims = match file.prims_below(root)?.first() {
        Some(&hair) => file.prims_below(hair)?,
        None => vec![],
    };
    if prims.len() != layers.len() {
        return Err(bad(format!("has {} layers, expected {}", prims.len(), layers.len())));
    }
    let mut moving = vec![];
    for (&prim, layer) in prims.iter().zip(layers) {
        let found = verify_samples(&mut file, prim, facts, layer);
        moving.push(found.map_err(|e| e.at(format!("layer {:?}", layer.name)))?);
    }
    for frame in [facts.frames.first(), facts.frames.last()].into_iter().flatten() {
        let curves = read_curves(path, Some(f64::from(*frame)))?;
        for (((read, layer), &prim), &moving) in curves.iter().zip(layers).zip(&prims).zip(&moving) {
            let place = format!("layer {:?}, frame {frame}", layer.name);
            verify_layer(read, facts, layer, moving).map_err(|what| bad(what).at(place.clone()))?;
            verify_extent(&mut file, prim, *frame, read).map_err(|e| e.at(place))?;
        }
    }
    Ok(())
}

/// Times and sizes of all samples of a layer. Says whether widths and opacities have samples; if they have, the values
/// beside them are the layer's.
fn verify_samples(file: &mut CrateFile, prim: FileNode, facts: &ShotFacts, layer: &HairLayer) -> Result<[bool; 2]> {
    let times: Vec<f64> = facts.frames.iter().map(|&f| f64::from(f)).collect();
    let (curves, points) = (layer.offsets.len() as u64, layer.offsets.total() as u64);
    let columns = [("widths", &layer.width), ("primvars:displayOpacity", &layer.opacity)];
    let mut moving = [false; 2];
    for ((name, expected), moving) in columns.into_iter().zip(&mut moving) {
        let Some(node) = file.attribute(prim, name) else { continue };
        *moving = file.field(node, "timeSamples").is_some();
        let still = file.field(node, "default").map(|rep| file.floats(rep, 1)).transpose()?;
        if *moving && still.as_ref() != Some(expected) {
            return Err(file.bad(format!("{name} differs from what was exported")));
        }
    }
    let all = [
        ("points", Type::Vec3f, points, true),
        ("velocities", Type::Vec3f, points, true),
        ("extent", Type::Vec3f, 2, true),
        ("widths", Type::Float, points, moving[0]),
        ("primvars:displayOpacity", Type::Float, curves, moving[1]),
    ];
    let shadows: Vec<String> =
        facts.shadow_columns().iter().map(|name| format!("primvars:{}", property(name))).collect();
    let shadows = shadows.iter().map(|name| (name.as_str(), Type::Float, points, true));
    for (name, kind, len, _) in all.into_iter().filter(|column| column.3).chain(shadows) {
        let samples = file.attribute(prim, name).and_then(|a| file.field(a, "timeSamples"));
        let samples = samples.ok_or_else(|| file.bad(format!("has no samples of {name}")))?;
        let (found, values) = file.samples(samples)?;
        if found != times {
            return Err(file.bad(format!("{name} is not sampled at the frames of the shot")));
        }
        for (value, time) in values.into_iter().zip(found) {
            let n = file.array_len(value)?;
            if n != len || value.kind() != Ok(kind) {
                return Err(file.bad(format!("{name} at {time} has {n} values, expected {len}")));
            }
        }
    }
    Ok(moving)
}

/// What was read at a frame against what was to be written; `Err` says what differs. `moving` says whether widths and
/// opacities are the frame's own.
fn verify_layer(
    read: &UsdCurves,
    facts: &ShotFacts,
    layer: &HairLayer,
    moving: [bool; 2],
) -> std::result::Result<(), String> {
    let range = [facts.frames.first(), facts.frames.last()].map(|f| f64::from(f.copied().unwrap_or(0)));
    let trio = [read.kind.as_str(), read.basis.as_str(), read.wrap.as_str()];
    let same = [
        ("metersPerUnit", read.stage.meters_per_unit == facts.meters_per_unit),
        ("upAxis", read.stage.up == facts.up),
        ("timeCodesPerSecond", read.stage.fps == facts.fps),
        ("the range of frames", read.stage.range == Some(range)),
        ("the origin", read.origin == facts.origin),
        ("the kind of curve", trio == ["cubic", "catmullRom", "pinned"]),
        ("the name", read.name == layer.name),
        ("curveVertexCounts", read.offsets == layer.offsets),
        ("hairId", read.id == layer.id),
        ("st", read.root_uv == layer.root_uv),
        ("skinprim", read.skin_face == layer.skin_face),
        ("skinprimuv", read.skin_bary == layer.skin_bary),
        ("rest", read.rest == layer.rest),
        ("widths", if moving[0] { read.width.iter().all(|w| is_width(*w)) } else { read.width == layer.width }),
        ("displayColor", read.color == layer.color),
        (
            "displayOpacity",
            if moving[1] { read.opacity.iter().all(|x| x.is_finite()) } else { read.opacity == layer.opacity },
        ),
        ("the number of points", read.points.len() == layer.offsets.total()),
        ("the number of velocities", read.velocity.len() == layer.offsets.total()),
    ];
    if let Some((what, _)) = same.iter().find(|(_, same)| !same) {
        return Err(format!("{what} differs from what was exported"));
    }
    match Bounds::of(&read.points).and(Bounds::of(&read.velocity)) {
        Some(_) => Ok(()),
        None => Err("a position or velocity is not finite".into()),
    }
}

/// The extent at `frame` holds the points.
fn verify_extent(file: &mut CrateFile, prim: FileNode, frame: i32, read: &UsdCurves) -> Result<()> {
    let samples = file.attribute(prim, "extent").and_then(|a| file.field(a, "timeSamples"));
    let samples = samples.ok_or_else(|| file.bad("has no extent"))?;
    let (times, values) = file.samples(samples)?;
    let found = times.iter().position(|&t| t == f64::from(frame)).map(|i| values[i]);
    let extent = file.floats(found.ok_or_else(|| file.bad("has no extent at this frame"))?, 3)?;
    let pad = half_widest(&read.width);
    let holds = Bounds::of(&read.points).is_some_and(|b| {
        let [min, max] = b.padded(pad);
        extent.len() == 6 && (0..3).all(|k| extent[k] <= min[k] && extent[k + 3] >= max[k])
    });
    if holds { Ok(()) } else { Err(file.bad("the extent does not hold the points")) }
}

#[cfg(test)]
mod tests;
