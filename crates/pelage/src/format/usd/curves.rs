//! Hair curves out of any binary USD file.

use super::read::{CrateFile, Node};
use super::xform::{Matrix, determinant, local_to_world};
use super::{Rep, Type};
use crate::format::FormatError;
use crate::format::check::Bounds;
use pelage_geom::Offsets;
use std::path::Path;

type Result<T> = std::result::Result<T, FormatError>;

/// Facts of a file as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct UsdStage {
    /// Metres per scene unit.
    pub meters_per_unit: f64,
    /// 'Y' or 'Z'.
    pub up: char,
    /// Frames per second (`timeCodesPerSecond`).
    pub fps: f64,
    /// First and last frame, if stated.
    pub range: Option<[f64; 2]>,
    /// What the file does not say or what is not followed, in words.
    pub notes: Vec<String>,
}

/// One `BasisCurves` prim at one time, in scene space. V points in C curves; columns that the file does not have, or
/// not in a usable size (noted), are empty.
#[derive(Clone, Debug, PartialEq)]
pub struct UsdCurves {
    /// Facts of the file.
    pub stage: UsdStage,
    /// Path of the prim, "/Hair/overcoat".
    pub path: String,
    /// Its display name, or its own name if it has none.
    pub name: String,
    /// "linear" or "cubic".
    pub kind: String,
    /// "bezier", "bspline" or "catmullRom"; only catmullRom and linear pass through their points.
    pub basis: String,
    /// "nonperiodic", "periodic" or "pinned".
    pub wrap: String,
    /// C runs of points.
    pub offsets: Offsets,
    /// Scene-space point that positions are relative to: the translation of the prim.
    pub origin: [f64; 3],
    /// Points as stored (control points), turned and scaled as the prim is, relative to `origin`, V.
    pub points: Vec<[f32; 3]>,
    /// Velocities, scene units a second, V.
    pub velocity: Vec<[f32; 3]>,
    /// Rest points in the same space as `points`, V.
    pub rest: Vec<[f32; 3]>,
    /// Diameters, scene units, V.
    pub width: Vec<f32>,
    /// Stable names, C.
    pub id: Vec<u64>,
    /// Root texture coordinates, C.
    pub root_uv: Vec<[f32; 2]>,
    /// Polygon of the skin under each root, C.
    pub skin_face: Vec<i32>,
    /// Place on that polygon, C.
    pub skin_bary: Vec<[f32; 2]>,
    /// Linear colours, C or V.
    pub color: Vec<[f32; 3]>,
    /// Opacities, C.
    pub opacity: Vec<f32>,
    /// Times at which the points are sampled; empty if they do not move.
    pub times: Vec<f64>,
    /// What was left out or mended, in words.
    pub notes: Vec<String>,
}

/// Fields of a prim that bring in things from elsewhere.
const COMPOSITION: [&str; 5] = ["references", "payload", "inheritPaths", "specializes", "variantSetNames"];

/// Reads all curves of a `.usdc` file.
///
/// * `frame` — the time; between samples the points are interpolated, outside them the nearest is taken. `None` takes
///   the value without time if there is one, else the first sample.
///
/// Layers brought in by reference, variants and instances are not followed; that is noted.
pub fn read_curves(path: &Path, frame: Option<f64>) -> Result<Vec<UsdCurves>> {
    let mut file = CrateFile::open(path)?;
    let mut stage = read_stage(&mut file)?;
    let mut prims = vec![];
    let mut skipped = vec![];
    let root = file.root();
    let mut stack = vec![(root, String::new())];
    while let Some((node, place)) = stack.pop() {
        let inactive = file.field(node, "active").is_some_and(|r| r.payload() == 0);
        let class = file.field(node, "specifier").is_some_and(|r| r.payload() == 2);
        if inactive || class {
            skipped.push(format!("{place} is not active and was left out"));
            continue;
        }
        if COMPOSITION.iter().any(|f| file.field(node, f).is_some()) {
            skipped.push(format!("{place} refers to other prims or files, which are not followed"));
        }
        match file.field(node, "typeName").map(|r| file.text(r)).transpose()?.as_deref() {
            Some("BasisCurves") => prims.push((node, place.clone())),
            Some(other @ ("NurbsCurves" | "HermiteCurves")) => {
                skipped.push(format!("{place} is of type {other}, only BasisCurves are read"));
            }
            _ => {}
        }
        let below = file.prims_below(node)?;
        stack.extend(below.into_iter().rev().map(|n| (n, format!("{place}/{}", file.name(n)))));
    }
    stage.notes.extend(skipped);
    if prims.is_empty() {
        let why = if stage.notes.is_empty() { String::new() } else { format!(" ({})", stage.notes.join("; ")) };
        return Err(file
            .bad(format!("has no BasisCurves{why}"))
            .hint("export hair as curves, flattened into one file"));
    }
    prims.into_iter().map(|(node, place)| read_prim(&mut file, node, place, frame, &stage)).collect()
}

fn read_stage(file: &mut CrateFile) -> Result<UsdStage> {
    let root = file.root();
    let mut notes = vec![];
    let mut number = |name: &str| -> Result<Option<f64>> {
        let Some(rep) = file.field(root, name) else { return Ok(None) };
        Ok(file.numbers(rep)?.first().copied())
    };
    let mut stated = |name: &str, fallback: f64| match number(name)? {
        Some(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => {
            notes.push(format!("{name} is not stated and taken as {fallback}, as USD does"));
            Ok(fallback)
        }
    };
    let meters_per_unit = stated("metersPerUnit", 0.01)?;
    let fps = stated("timeCodesPerSecond", 24.0)?;
    let range = number("startTimeCode")?.zip(number("endTimeCode")?).map(|(a, b)| [a, b]);
    let up = match file.field(root, "upAxis").map(|r| file.text(r)).transpose()? {
        Some(axis) if axis == "Z" => 'Z',
        Some(axis) if axis == "Y" => 'Y',
        _ => {
            notes.push("upAxis is not stated and taken as Y, as USD does".into());
            'Y'
        }
    };
    if file.field(root, "subLayers").is_some() {
        notes.push("the file has sublayers, which are not followed".into());
    }
    Ok(UsdStage { meters_per_unit, up, fps, range, notes })
}

/// The stored values between which a time lies, and how far on.
struct Pick {
    low: Rep,
    high: Option<(Rep, f64)>,
}

fn pick(file: &mut CrateFile, attribute: Node, frame: Option<f64>) -> Result<Option<Pick>> {
    let default = file.field(attribute, "default");
    let not_blocked = |rep: Rep| (rep.kind() != Ok(Type::ValueBlock)).then_some(rep);
    let samples = match file.field(attribute, "timeSamples") {
        Some(rep) if frame.is_some() || default.is_none() => Some(file.samples(rep)?),
        _ => None,
    };
    let Some((times, values)) = samples.filter(|s| !s.0.is_empty()) else {
        return Ok(default.and_then(not_blocked).map(|low| Pick { low, high: None }));
    };
    let frame = frame.unwrap_or(times[0]);
    let after = times.partition_point(|&t| t <= frame);
    let low = after.saturating_sub(1);
    let Some(value) = not_blocked(values[low]) else { return Ok(None) };
    let mut high = None;
    if after > 0 && after < times.len() && frame > times[low] {
        high = not_blocked(values[after]).map(|r| (r, (frame - times[low]) / (times[after] - times[low])));
    }
    Ok(Some(Pick { low: value, high }))
}

/// The numbers of an attribute at a time, interpolated where both samples have the same size.
pub(super) fn value_at(file: &mut CrateFile, attribute: Node, frame: Option<f64>) -> Result<Option<Vec<f64>>> {
    let Some(pick) = pick(file, attribute, frame)? else { return Ok(None) };
    let mut low = file.numbers(pick.low)?;
    if let Some((rep, w)) = pick.high {
        let high = file.numbers(rep)?;
        if high.len() == low.len() {
            low.iter_mut().zip(high).for_each(|(a, b)| *a += w * (b - *a));
        }
    }
    Ok(Some(low))
}

fn floats_at(file: &mut CrateFile, attribute: Node, arity: usize, frame: Option<f64>) -> Result<Option<Vec<f32>>> {
    let Some(pick) = pick(file, attribute, frame)? else { return Ok(None) };
    let mut low = file.floats(pick.low, arity)?;
    if let Some((rep, w)) = pick.high {
        let high = file.floats(rep, arity)?;
        if high.len() == low.len() {
            low.iter_mut()
                .zip(high)
                .for_each(|(a, b)| *a = (f64::from(*a) + w * (f64::from(b) - f64::from(*a))) as f32);
        }
    }
    Ok(Some(low))
}

/// What a column has one value for.
#[derive(Clone, Copy, PartialEq)]
enum Per {
    Curve,
    Point,
    /// As the file has it; one a curve of a constant.
    Either,
}

/// Reads the columns of one prim.
struct Columns<'a> {
    file: &'a mut CrateFile,
    prim: Node,
    frame: Option<f64>,
    offsets: Offsets,
    notes: Vec<String>,
}

impl Columns<'_> {
    /// The first of `names` that the prim has, brought to one element of N numbers a curve or a point.
    fn vectors<const N: usize>(&mut self, names: &[&str], per: Per) -> Result<Vec<[f32; N]>> {
        let Some(&name) = names.iter().find(|n| self.file.attribute(self.prim, n).is_some()) else { return Ok(vec![]) };
        let Some(attribute) = self.file.attribute(self.prim, name) else { return Ok(vec![]) };
        let Some(flat) = floats_at(self.file, attribute, N, self.frame)? else { return Ok(vec![]) };
        let mut values: Vec<[f32; N]> = flat.as_chunks().0.to_vec();
        if let Some(indices) = self.file.attribute(self.prim, &format!("{name}:indices")) {
            let Some(pick) = pick(self.file, indices, self.frame)? else { return Ok(vec![]) };
            let indices = self.file.integers(pick.low)?;
            let picked: Option<Vec<_>> =
                indices.iter().map(|&i| usize::try_from(i).ok().and_then(|i| values.get(i)).copied()).collect();
            values = picked.ok_or_else(|| self.file.bad("an index is out of range").at(name))?;
        }
        Ok(self.fit(values, per, name))
    }

    fn scalars(&mut self, names: &[&str], per: Per) -> Result<Vec<f32>> {
        Ok(self.vectors::<1>(names, per)?.into_iter().map(|[v]| v).collect())
    }

    fn integers(&mut self, name: &str) -> Result<Vec<i64>> {
        let Some(attribute) = self.file.attribute(self.prim, name) else { return Ok(vec![]) };
        let Some(pick) = pick(self.file, attribute, self.frame)? else { return Ok(vec![]) };
        let values = self.file.integers(pick.low)?;
        Ok(self.fit(values, Per::Curve, name))
    }

    /// Spreads constant values and, where points are wanted, values per curve; takes the root's of values per point
    /// where curves are wanted.
    fn fit<T: Copy>(&mut self, values: Vec<T>, per: Per, name: &str) -> Vec<T> {
        let (curves, points) = (self.offsets.len(), self.offsets.total());
        let wanted = if per == Per::Point { points } else { curves };
        match (values.len(), per) {
            (n, _) if n == wanted => values,
            (n, Per::Either) if n == points => values,
            (1, _) => vec![values[0]; wanted],
            (n, Per::Curve) if n == points => (0..curves).map(|c| values[self.offsets.range(c).start]).collect(),
            (n, Per::Point) if n == curves => {
                (0..curves).flat_map(|c| std::iter::repeat_n(values[c], self.offsets.range(c).len())).collect()
            }
            (n, _) => {
                self.notes.push(format!("{name} has {n} values for {curves} curves with {points} points: left out"));
                vec![]
            }
        }
    }
}

fn read_prim(
    file: &mut CrateFile,
    prim: Node,
    path: String,
    frame: Option<f64>,
    stage: &UsdStage,
) -> Result<UsdCurves> {
    let place = |e: FormatError| if e.at.is_none() { e.at(path.clone()) } else { e };
    read_columns(file, prim, &path, frame, stage).map_err(place)
}

fn read_columns(
    file: &mut CrateFile,
    prim: Node,
    path: &str,
    frame: Option<f64>,
    stage: &UsdStage,
) -> Result<UsdCurves> {
    let token = |name: &str, fallback: &str| -> Result<String> {
        let rep = file.attribute(prim, name).and_then(|a| file.field(a, "default"));
        rep.map_or(Ok(fallback.to_owned()), |r| file.text(r))
    };
    let (kind, basis, wrap) = (token("type", "cubic")?, token("basis", "bezier")?, token("wrap", "nonperiodic")?);
    let name = match file.field(prim, "displayName") {
        Some(rep) => file.text(rep)?,
        None => file.name(prim).to_owned(),
    };
    let mut notes = vec![];
    if kind != "linear" && basis != "catmullRom" {
        notes
            .push(format!("the basis is {basis}: the points are control points, the curve does not pass through them"));
    }
    if kind != "linear" && basis == "catmullRom" && wrap == "nonperiodic" {
        notes.push("the curves are not pinned: they are drawn from their second to their last but one point".into());
    }
    let matrix = local_to_world(file, prim, frame, &mut notes)?;
    let (offsets, flat) = read_points(file, prim, frame)?;
    let times = match file.attribute(prim, "points").and_then(|a| file.field(a, "timeSamples")) {
        Some(rep) => file.samples(rep)?.0,
        None => vec![],
    };
    let mut columns = Columns { file, prim, frame, offsets, notes };
    let mut out = UsdCurves {
        stage: stage.clone(),
        path: path.to_owned(),
        name,
        kind,
        basis,
        wrap,
        origin: [matrix[3][0], matrix[3][1], matrix[3][2]],
        points: flat,
        velocity: columns.vectors(&["velocities"], Per::Point)?,
        rest: columns.vectors(&["primvars:rest"], Per::Point)?,
        width: columns.scalars(&["primvars:widths", "widths"], Per::Point)?,
        id: vec![],
        root_uv: columns.vectors(&["primvars:st", "primvars:uv", "primvars:surface_uv_coordinate"], Per::Curve)?,
        skin_face: columns.integers("primvars:skinprim")?.into_iter().map(|i| i as i32).collect(),
        skin_bary: columns.vectors(&["primvars:skinprimuv"], Per::Curve)?,
        color: columns.vectors(&["primvars:displayColor"], Per::Either)?,
        opacity: columns.scalars(&["primvars:displayOpacity"], Per::Curve)?,
        times,
        offsets: Offsets::default(),
        notes: vec![],
    };
    let ids = columns.integers("primvars:hairId")?;
    if ids.iter().any(|&i| i < 0) {
        columns.notes.push("hairId has negative values: left out".into());
    } else {
        out.id = ids.into_iter().map(|i| i as u64).collect();
    }
    (out.offsets, out.notes) = (columns.offsets, columns.notes);
    place_in_scene(&mut out, &matrix);
    let odd = out.points.iter().position(|p| !p.iter().all(|x| x.is_finite()));
    if let Some(i) = odd {
        let curve = (0..out.offsets.len()).find(|c| out.offsets.range(*c).contains(&i)).unwrap_or(0);
        let point = i - out.offsets.range(curve).start;
        return Err(file.bad(format!("curve {curve}, point {point}: not a finite number")));
    }
    if Bounds::of(&out.points).is_none() || !out.origin.iter().all(|x| x.is_finite()) {
        return Err(file.bad("a point is not a finite number"));
    }
    Ok(out)
}

/// Counts and points, which have to agree.
fn read_points(file: &mut CrateFile, prim: Node, frame: Option<f64>) -> Result<(Offsets, Vec<[f32; 3]>)> {
    let counts = match file.attribute(prim, "curveVertexCounts") {
        Some(a) => pick(file, a, frame)?.map(|p| file.integers(p.low)).transpose()?.unwrap_or_default(),
        None => vec![],
    };
    let points = match file.attribute(prim, "points") {
        Some(a) => floats_at(file, a, 3, frame)?.unwrap_or_default(),
        None => vec![],
    };
    let points: Vec<[f32; 3]> = points.as_chunks().0.to_vec();
    if let Some(short) = counts.iter().position(|&n| n < 2) {
        let n = counts[short];
        return Err(file.bad(format!("curve {short} has {n} points, a curve needs at least 2")));
    }
    let total = counts.iter().fold(0i64, |sum, &n| sum.saturating_add(n));
    if total != points.len() as i64 || total > i64::from(u32::MAX) {
        return Err(file.bad(format!("the counts add up to {total} points, {} are there", points.len())));
    }
    Ok((Offsets::from_counts(counts.into_iter().map(|n| n as usize)), points))
}

/// Turns and scales what lies in the space of the prim; the translation stays in `origin`.
fn place_in_scene(curves: &mut UsdCurves, m: &Matrix) {
    if m.iter().take(3).zip(&super::xform::IDENTITY).all(|(a, b)| a == b) {
        return;
    }
    let turn = |p: &mut [f32; 3]| {
        let q = p.map(f64::from);
        *p = std::array::from_fn(|j| (q[0] * m[0][j] + q[1] * m[1][j] + q[2] * m[2][j]) as f32);
    };
    for column in [&mut curves.points, &mut curves.velocity, &mut curves.rest] {
        column.iter_mut().for_each(turn);
    }
    let scale = libm::cbrt(determinant(m).abs());
    curves.width.iter_mut().for_each(|w| *w = (f64::from(*w) * scale) as f32);
    let lengths = m.map(|row| row[0] * row[0] + row[1] * row[1] + row[2] * row[2]);
    if lengths[..3].iter().any(|l| (l - scale * scale).abs() > 1e-4 * scale * scale) {
        curves.notes.push("the prim is scaled unevenly: widths are scaled by the mean".into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILES: [(&str, &[u8]); 2] = [
        ("0.8.0", include_bytes!("../../../testdata/openusd-26.11-crate-0.8.0.usdc")),
        ("0.0.1", include_bytes!("../../../testdata/openusd-24.11-crate-0.0.1.usdc")),
    ];

    fn close(a: [f32; 3], b: [f32; 3]) -> bool {
        (0..3).all(|k| (a[k] - b[k]).abs() < 1e-4)
    }

    /// Curves by OpenUSD: packed numbers, indexed values and transforms come out as they were put in.
    #[test]
    fn reads_what_openusd_wrote() {
        let dir = tempfile::tempdir().unwrap();
        for (version, bytes) in FILES {
            let path = dir.path().join(version);
            std::fs::write(&path, bytes).unwrap();
            for (frame, y) in [(None, 1.0), (Some(2.0), 2.0), (Some(2.5), 2.5), (Some(99.0), 3.0)] {
                let curves = read_curves(&path, frame).unwrap();
                let [hair, lines] = curves.as_slice() else { panic!("{version}: {} prims", curves.len()) };
                assert_eq!((hair.path.as_str(), hair.name.as_str()), ("/World/hair", "hair"));
                assert_eq!((hair.stage.meters_per_unit, hair.stage.up, hair.stage.fps), (1.0, 'Z', 25.0));
                assert_eq!((hair.stage.range, &hair.times), (Some([1.0, 3.0]), &vec![1.0, 2.0, 3.0]));
                assert_eq!(hair.origin, [1.0, 2.0, 3.0]);
                assert_eq!(hair.offsets, Offsets::uniform(20, 4));
                for (i, &p) in hair.points.iter().enumerate() {
                    // Scaled by two, then a quarter turn about X.
                    let i = i as f32;
                    assert!(close(p, [0.5 * i, i, 2.0 * y]), "{version} {frame:?} point {i}: {p:?}");
                }
                assert!(hair.width.iter().enumerate().all(|(i, w)| *w == 2.0 * (0.25 * (1 + i % 3) as f32 + 0.125)));
                assert!(hair.id.iter().copied().eq((0..20).map(|i| ((i * i) << 40) + i)));
                assert!(hair.root_uv.iter().enumerate().all(|(i, uv)| *uv == [i as f32 / 32.0, 0.5]));
                let colors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
                assert!(hair.color.iter().enumerate().all(|(i, c)| *c == colors[i % 2]));
                assert_eq!((&hair.opacity, hair.notes.len()), (&vec![0.5; 20], 0));

                assert_eq!((lines.kind.as_str(), lines.offsets.len()), ("linear", 16));
                assert!(lines.offsets.counts().eq((0..16).map(|i| 2 + i % 5)));
                assert!(lines.points.iter().enumerate().all(|(i, &p)| close(p, [2.0 * i as f32, 0.0, 0.0])));
                assert!(lines.width.iter().enumerate().all(|(i, w)| *w == 2.0 * i as f32));
                assert!(lines.stage.notes.iter().any(|n| n.contains("/_class")));
            }
        }
    }

    #[test]
    fn what_openusd_wrote_may_be_damaged() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        for (_, bytes) in FILES {
            for i in (0..bytes.len()).step_by(7) {
                let mut bad = bytes.to_vec();
                bad[i] ^= [0xff, 0x01, 0x80][i % 3];
                std::fs::write(&path, &bad).unwrap();
                if let Ok(curves) = read_curves(&path, Some(2.0)) {
                    assert!(curves.iter().all(|c| c.points.len() == c.offsets.total()));
                }
                std::fs::write(&path, &bytes[..i]).unwrap();
                assert!(read_curves(&path, Some(2.0)).is_err());
            }
        }
    }
}
