//! `pelage depenetrate`: pushes any curves out of a skin.

use super::print;
use crate::Error;
use crate::curves::signature;
use crate::files::{unfinished, write_whole};
use crate::format::mcap::{self, McapHair};
use crate::format::usd::{self, UsdCurves, UsdHair};
use crate::format::{FormatError, HairFrame, HairLayer, ShotFacts, hair, ply};
use pelage_geom::{Bvh, Topology};
use pelage_groom::depenetrate::{Depenetrate, DepenetrateCounts, depenetrate};
use pelage_sim::body::Closed;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Distance of samples, metres.
const MILLIMETRE: f64 = 1e-3;

/// Diameter written for curves that come without, metres: that of the sample grooms.
const WIDTH: f64 = 80e-6;

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct DepenetrateArguments {
    /// Curves: USD, MCAP, PLY or .hair
    pub curves: PathBuf,
    /// Skin that they may not enter, at the same moment (PLY; texture coordinates are not needed)
    #[arg(long)]
    pub skin: PathBuf,
    /// File to write: .ply, .usdc or .mcap; only a report if not given
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Distance from the skin at which pushed hair ends, millimetres
    #[arg(long, default_value_t = 0.05)]
    pub clearance: f64,
    /// Length at the root that may be inside, millimetres
    #[arg(long, default_value_t = 1.0)]
    pub held: f64,
    /// Metres per unit of both files, where the curves do not say
    #[arg(long)]
    pub meters_per_unit: Option<f64>,
    /// Frame of the curves; the first one if not given
    #[arg(long, allow_hyphen_values = true)]
    pub frame: Option<f64>,
    /// JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Formats that can be written.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Ply,
    Usd,
    Mcap,
}

/// Curves at one frame with every column that their file has.
struct Source {
    facts: ShotFacts,
    /// What the file itself says.
    meters_per_unit: Option<f64>,
    /// Frames in the file.
    frames: usize,
    layers: Vec<HairLayer>,
    position: Vec<Vec<[f32; 3]>>,
    velocity: Vec<Vec<[f32; 3]>>,
    /// The file as it is, if it is a PLY whose points lie hair after hair: what is not a position is passed on.
    tables: Option<ply::Tables>,
    warnings: Vec<String>,
}

/// Pushes the curves of a file out of a skin, says what was done, and writes them.
pub fn run(a: &DepenetrateArguments) -> Result<bool, Error> {
    let target = a.out.as_deref().map(|out| target(a, out)).transpose()?;
    let mut source = read(&a.curves, a.frame)?;
    let unit = unit(a, &source)?;
    source.facts.meters_per_unit = unit;
    let bvh = skin(&a.skin, &mut source.warnings)?;
    for (name, value, hint) in [
        ("clearance", a.clearance, "0.05 is more than the radius of a hair"),
        ("held", a.held, "as deep as the roots are sunk, 1 where they lie on the skin"),
    ] {
        if !(value > 0.0 && value <= 100.0) {
            let what = format!("--{name} {value}: expected millimetres, more than 0 and at most 100");
            return Err(Error::input(what, hint));
        }
    }
    let mm = MILLIMETRE / unit;
    let settings = Depenetrate { step: mm, clearance: a.clearance * mm, held: a.held * mm };
    let drawn = source.position.clone();
    let mut counts = DepenetrateCounts::default();
    for (layer, position) in source.layers.iter().zip(&mut source.position) {
        let origin = source.facts.origin;
        counts = counts.and(depenetrate(&bvh, &settings, None, &layer.offsets, origin, None, position));
    }
    if let (Some(out), Some(target)) = (&a.out, target) {
        if source.frames > 1 {
            let text = format!("of {} frames only {} is written", source.frames, source.facts.frames[0]);
            source.warnings.push(text);
        }
        write(out, target, &mut source, &drawn)?;
    }
    report(a, &source, &counts, mm);
    Ok(true)
}

/// The format of the file to write, which must not be one of those read.
fn target(a: &DepenetrateArguments, out: &Path) -> Result<Target, Error> {
    let same = |input: &Path| match (input.canonicalize(), out.canonicalize()) {
        (Ok(i), Ok(o)) => i == o,
        _ => false,
    };
    if let Some(input) = [&a.curves, &a.skin].into_iter().find(|p| same(p)) {
        let what = format!("--out {} would overwrite its own input {}", out.display(), input.display());
        return Err(Error::input(what, "give another name"));
    }
    match out.extension().unwrap_or_default().to_string_lossy().to_lowercase().as_str() {
        "ply" => Ok(Target::Ply),
        "usdc" => Ok(Target::Usd),
        "mcap" => Ok(Target::Mcap),
        _ => {
            let what = format!("--out {}: no format that curves are written in", out.display());
            Err(Error::input(what, "end the name in .ply, .usdc or .mcap"))
        }
    }
}

fn unit(a: &DepenetrateArguments, source: &Source) -> Result<f64, Error> {
    let Some(unit) = a.meters_per_unit.or(source.meters_per_unit) else {
        let what = format!("{}: does not say how long its unit is", a.curves.display());
        return Err(Error::input(what, "say it: --meters-per-unit 0.01 for centimetres"));
    };
    if unit > 0.0 && unit.is_finite() {
        return Ok(unit);
    }
    Err(Error::input(format!("{unit} metres per unit: expected a positive number"), "0.01 for centimetres"))
}

/// Closest-point structure of a skin with its holes closed.
fn skin(path: &Path, warnings: &mut Vec<String>) -> Result<Bvh, Error> {
    let read = ply::read_mesh(path)?;
    warnings.extend(read.warnings.iter().map(|w| format!("{}: {w}", path.display())));
    let closed = Closed::new(&read.mesh, &Topology::new(&read.mesh));
    let open = closed.topology.counts.open_edges;
    if open > 0 {
        let text = "edges at holes too large or too tangled to be closed: next to them it is a guess what is inside";
        warnings.push(format!("{}: {open} {text}", path.display()));
    }
    Ok(closed.bvh(&closed.mesh.position))
}

fn read(path: &Path, frame: Option<f64>) -> Result<Source, Error> {
    match signature(path)? {
        s if s.starts_with(b"PXR-USDC") || s.starts_with(b"#usda") => read_usd(path, frame),
        s if s.starts_with(b"\x89MCAP") => read_mcap(path, frame),
        s if s.starts_with(b"HAIR") => Ok(plain(path, hair::read_hair(path)?, None)),
        _ => Ok(plain(path, ply::read_curves(path)?, ply::read_tables(path).ok())),
    }
}

fn facts(path: &Path, frame: f64) -> ShotFacts {
    ShotFacts {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        meters_per_unit: 1.0,
        up: 'Y',
        fps: 24.0,
        frames: vec![frame.round() as i32],
        origin: [0.0; 3],
        lights: vec![],
        extra: vec![("generator".into(), concat!("pelage ", env!("CARGO_PKG_VERSION")).into())],
    }
}

fn read_usd(path: &Path, frame: Option<f64>) -> Result<Source, Error> {
    let prims = usd::read_curves(path, frame)?;
    let (stage, times) = (prims[0].stage.clone(), prims[0].times.clone());
    let at = frame.or(times.first().copied()).unwrap_or(1.0);
    // Positions of all prims relative to one point.
    let origin = prims[0].origin;
    let mut source = Source {
        facts: ShotFacts { up: stage.up, fps: stage.fps, origin, ..facts(path, at) },
        meters_per_unit: Some(stage.meters_per_unit),
        frames: times.len(),
        layers: Vec::new(),
        position: Vec::new(),
        velocity: Vec::new(),
        tables: None,
        warnings: stage.notes,
    };
    for p in prims {
        let UsdCurves { name, offsets, id, root_uv, skin_face, skin_bary, width, color, opacity, .. } = p;
        let rebase = |points: Vec<[f32; 3]>| match p.origin == origin {
            true => points,
            false => points
                .iter()
                .map(|q| std::array::from_fn(|x| (f64::from(q[x]) + p.origin[x] - origin[x]) as f32))
                .collect(),
        };
        let rest = rebase(p.rest);
        source.position.push(rebase(p.points));
        source.velocity.push(p.velocity);
        source.warnings.extend(p.notes);
        let layer = HairLayer { name, offsets, id, root_uv, skin_face, skin_bary, rest, width, color, opacity };
        source.layers.push(layer);
    }
    Ok(source)
}

fn read_mcap(path: &Path, frame: Option<f64>) -> Result<Source, Error> {
    let mut file = mcap::read_hair_mcap(path)?;
    let all = file.facts().clone();
    let index = frame.map_or(Some(0), |f| all.frames.iter().position(|g| f64::from(*g) == f));
    let missing = || FormatError::new(path, format!("has no frame {}", frame.unwrap_or_default()));
    let index = index.ok_or_else(|| missing().hint("`pelage inspect` lists its frames"))?;
    let mut source = Source {
        meters_per_unit: Some(all.meters_per_unit),
        frames: all.frames.len(),
        facts: ShotFacts { frames: vec![all.frames[index]], ..all },
        layers: Vec::new(),
        position: Vec::new(),
        velocity: Vec::new(),
        tables: None,
        warnings: Vec::new(),
    };
    for i in 0..file.layer_names().count() {
        source.layers.push(file.layer(i)?);
        let now = file.frame(index, i)?;
        source.position.push(now.position);
        source.velocity.push(now.velocity);
    }
    Ok(source)
}

/// Curves of a PLY or .hair file; facts from the comments that Pelage writes.
fn plain(path: &Path, curves: ply::Curves, tables: Option<ply::Tables>) -> Source {
    let said = |name: &str| curves.comments.iter().find_map(|c| c.strip_prefix(name)?.strip_prefix(' '));
    let number = |name: &str| said(name).and_then(|v| v.trim().parse::<f64>().ok());
    let facts = ShotFacts {
        up: if said("up") == Some("Z") { 'Z' } else { 'Y' },
        fps: number("fps").filter(|f| *f > 0.0).unwrap_or(24.0),
        origin: curves.strands.origin,
        ..facts(path, number("frame").unwrap_or(1.0))
    };
    let strands = curves.strands;
    let tables = tables.filter(|t| in_order(t, &strands.offsets));
    let column = |name: &str| tables.as_ref()?.tables.iter().find_map(|t| t.f32(name)).map(<[f32]>::to_vec);
    let (color, opacity) = match (column("r"), column("g"), column("b"), column("opacity")) {
        (Some(r), Some(g), Some(b), opacity) if r.len() == strands.len() => {
            (r.iter().zip(&g).zip(&b).map(|((r, g), b)| [*r, *g, *b]).collect(), opacity.unwrap_or_default())
        }
        _ => (Vec::new(), Vec::new()),
    };
    let layer = HairLayer {
        name: "hair".into(),
        offsets: strands.offsets,
        id: strands.id,
        root_uv: strands.root_uv,
        width: curves.width.unwrap_or_default(),
        color,
        opacity,
        ..HairLayer::default()
    };
    Source {
        meters_per_unit: number("meters_per_unit"),
        facts,
        frames: 1,
        layers: vec![layer],
        position: vec![strands.position],
        velocity: vec![Vec::new()],
        tables,
        warnings: curves.warnings,
    }
}

/// True if the points of a file are those of its curves in order.
fn in_order(tables: &ply::Tables, offsets: &pelage_geom::Offsets) -> bool {
    let ranges = tables.tables.iter().find_map(|t| Some((t.u32("first")?, t.u32("count")?)));
    tables.get("vertex").is_some_and(|t| t.rows == offsets.total())
        && ranges.is_some_and(|(first, count)| {
            count.len() == offsets.len()
                && (0..count.len()).all(|i| {
                    let r = offsets.range(i);
                    (first[i] as usize, count[i] as usize) == (r.start, r.len())
                })
        })
}

fn write(out: &Path, target: Target, source: &mut Source, drawn: &[Vec<[f32; 3]>]) -> Result<(), Error> {
    if let (Target::Ply, Some(tables)) = (target, &mut source.tables) {
        move_points(tables, source.facts.origin, &drawn[0], &source.position[0]);
        return write_whole(out, |file| ply::write_tables(file, &tables.comments, &tables.tables))
            .map_err(Error::disk(out));
    }
    let filled = fill(source, target, drawn);
    if !filled.is_empty() {
        let text = format!("the curves have no {}: the usual values are written", filled.join(", "));
        source.warnings.push(text);
    }
    let (facts, layers) = (&source.facts, &source.layers);
    let frames = source.position.iter().zip(&source.velocity);
    let frame: Vec<HairFrame<'_>> =
        frames.map(|(position, velocity)| HairFrame { position, velocity, ..HairFrame::default() }).collect();
    let part = unfinished(out);
    let written = || match target {
        Target::Ply => ply::write_hair(&part, facts, layers, &frame),
        Target::Usd => {
            let mut file = UsdHair::create(&part, facts, layers)?;
            file.write_frame(facts.frames[0], &frame)?;
            file.finish()?;
            usd::verify(&part, facts, layers)
        }
        Target::Mcap => {
            let mut file = McapHair::create(&part, facts, layers)?;
            file.write_frame(facts.frames[0], &frame)?;
            file.finish()?;
            mcap::verify_layers(&part, facts, layers)
        }
    };
    let done = written().map_err(|e| FormatError { path: out.to_path_buf(), ..e });
    let done = done.map_err(Error::from).and_then(|()| std::fs::rename(&part, out).map_err(Error::disk(out)));
    if done.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    done
}

/// Puts the points that moved into the columns of a file.
fn move_points(tables: &mut ply::Tables, origin: [f64; 3], drawn: &[[f32; 3]], moved: &[[f32; 3]]) {
    let vertex = tables.tables.iter_mut().find(|t| t.name == "vertex").expect("a table of points");
    for (x, name) in ["x", "y", "z"].into_iter().enumerate() {
        let Some((_, column)) = vertex.columns.iter_mut().find(|c| c.0 == name) else { continue };
        if let (ply::Column::F32(v), true) = (&*column, origin != [0.0; 3]) {
            // Single precision would put points so far out back into the skin.
            *column = ply::Column::F64(v.iter().map(|x| f64::from(*x)).collect());
        }
        for (i, (_, b)) in drawn.iter().zip(moved).enumerate().filter(|(_, (a, b))| a != b) {
            let value = f64::from(b[x]) + origin[x];
            match column {
                ply::Column::F32(v) => v[i] = value as f32,
                ply::Column::F64(v) => v[i] = value,
                // Whole numbers hold no hair.
                _ => {}
            }
        }
    }
}

/// Columns that a format wants and the curves do not have; their names.
fn fill(source: &mut Source, target: Target, drawn: &[Vec<[f32; 3]>]) -> Vec<&'static str> {
    fn missing<T: Clone>(out: &mut Vec<T>, n: usize, value: T) -> bool {
        let wrong = out.len() != n;
        if wrong {
            *out = vec![value; n];
        }
        wrong
    }
    let width = (WIDTH / source.facts.meters_per_unit) as f32;
    let mut filled = Vec::new();
    let mut note = |name: &'static str, yes: bool| {
        if yes && !filled.contains(&name) {
            filled.push(name);
        }
    };
    let mut next = source.layers.iter().flat_map(|l| &l.id).max().map_or(0, |m| m + 1);
    for ((l, velocity), drawn) in source.layers.iter_mut().zip(&mut source.velocity).zip(drawn) {
        let (hairs, points) = (l.offsets.len(), l.offsets.total());
        if l.id.len() != hairs {
            l.id = (next..next + hairs as u64).collect();
            next += hairs as u64;
            note("ids", true);
        }
        note("widths", missing(&mut l.width, points, width));
        note("velocities", missing(velocity, points, [0.0; 3]));
        if target != Target::Ply {
            note("root coordinates", missing(&mut l.root_uv, hairs, [0.0; 2]));
            note("colours", missing(&mut l.color, hairs, [1.0; 3]));
            note("opacities", missing(&mut l.opacity, hairs, 1.0));
            if l.rest.len() != points {
                l.rest = drawn.clone();
                note("rest points", true);
            }
        }
    }
    filled
}

fn report(a: &DepenetrateArguments, source: &Source, counts: &DepenetrateCounts, mm: f64) {
    let hairs: usize = source.layers.iter().map(|l| l.offsets.len()).sum();
    let points: usize = source.layers.iter().map(|l| l.offsets.total()).sum();
    let [before, after] = counts.deepest.map(|d| d / mm);
    if a.json {
        let value = json!({
            "hairs": hairs,
            "points": points,
            "frame": source.facts.frames[0],
            "meters_per_unit": source.facts.meters_per_unit,
            "pushed": counts.pushed,
            "still_inside": counts.uncleared,
            "buried_roots": counts.buried,
            "shortened": counts.shortened,
            "deepest_before_mm": before,
            "deepest_after_mm": after,
            "farthest_moved_mm": counts.moved / mm,
            "largest_stretch": counts.stretched,
            "written": a.out.as_ref().map(|o| o.display().to_string()),
            "warnings": source.warnings,
        });
        return print(&(serde_json::to_string_pretty(&value).expect("plain JSON") + "\n"));
    }
    for w in &source.warnings {
        eprintln!("warning: {w}");
    }
    let mut out = format!("{hairs} hairs, {} pushed, {} still inside", counts.pushed, counts.uncleared);
    if counts.buried > 0 {
        out.push_str(&format!(" ({} that grow within the skin, deeper than --held {} mm)", counts.buried, a.held));
    }
    if counts.shortened > 0 {
        out.push_str(&format!(", {} shortened for want of room", counts.shortened));
    }
    out.push_str(&format!("\ndeepest: {before:.3} mm before, {after:.3} mm after\n"));
    let (moved, stretch) = (counts.moved / mm, 100.0 * counts.stretched);
    out.push_str(&format!("farthest way of a point: {moved:.3} mm; largest change of a segment: {stretch:.2} %\n"));
    match &a.out {
        Some(file) => out.push_str(&format!("wrote {}\n", file.display())),
        None => out.push_str("nothing was written: say where with --out\n"),
    }
    print(&out);
}
