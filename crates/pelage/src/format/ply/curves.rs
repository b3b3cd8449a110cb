//! Hair curves as PLY: points in element `vertex`, one row a hair in element `hair`.

use super::row::Row;
use super::source::{Plan, Source, read_bytes};
use super::table::{Column, Table, read_tables, split_ids, write_tables};
use super::write_whole;
use crate::format::{FormatError, HairFrame, HairLayer, ShotFacts};
use pelage_geom::{Offsets, Strands};
use ply_rs::ply::{ElementDef, PropertyType};
use std::collections::BTreeSet;
use std::path::Path;

/// Curves of a file, and what was noticed while they were read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// The curves in the order of the file, scene units of the file; ids and root coordinates where it has them.
    pub strands: Strands,
    /// Diameters, one a point, scene units (`None` if the file has none).
    pub width: Option<Vec<f32>>,
    /// Comments of the header.
    pub comments: Vec<String>,
    /// Oddities that were worked around, in words.
    pub warnings: Vec<String>,
}

/// Elements that hold curves, in the order in which they are looked for.
const CURVE_ELEMENTS: [&str; 5] = ["hair", "strand", "curve", "polyline", "edge"];
/// The comment that carries the point that positions are relative to in memory.
const ORIGIN: &str = "origin";
/// First comment of our own files.
const MARK: &str = "pelage hair 1";

/// Writes one frame of hair: element `vertex` with `x y z` (scene units), velocities `vx vy vz` (scene units a second)
/// and `width` (diameter, scene units), element `hair` with the range of its points (`first`, `count`), `id_lo`,
/// `id_hi`, `layer`, and where a layer has them root `u v`, linear `r g b` and `opacity`. If a layer has a colour for
/// each point, `r g b` of all layers are properties of `vertex` instead. Where the facts name lights, vertices have
/// `transmittance` of all lights together and `transmittance_NAME` of each. Widths and opacities are those of the frame
/// where it has its own. The units stand in the comments. Positions are 32-bit, or 64-bit and absolute where the shot has an origin.
pub fn write_hair(
    path: &Path,
    facts: &ShotFacts,
    layers: &[HairLayer],
    frame: &[HairFrame<'_>],
) -> Result<(), FormatError> {
    check_sizes(path, facts, layers, frame)?;
    write_whole(path, |out| write_tables(out, &comments(facts, layers), &tables(facts, layers, frame)))
}

fn tables(facts: &ShotFacts, layers: &[HairLayer], frame: &[HairFrame<'_>]) -> [Table; 2] {
    [vertex_table(facts, layers, frame), hair_table(layers, frame)]
}

/// Reads `path` back and compares every column with what [`write_hair`] was given.
pub fn verify_hair(
    path: &Path,
    facts: &ShotFacts,
    layers: &[HairLayer],
    frame: &[HairFrame<'_>],
) -> Result<(), FormatError> {
    let (read, wanted) = (read_tables(path)?.tables, tables(facts, layers, frame));
    let Some(wrong) = wanted.iter().find(|table| !read.contains(table)) else { return Ok(()) };
    let found = read.iter().find(|t| t.name == wrong.name);
    let column = wrong.columns.iter().find(|(name, values)| found.and_then(|t| t.column(name)) != Some(values));
    let what = format!("{} differs from what was exported", column.map_or("a column", |c| &c.0));
    let at = format!("element {}", wrong.name);
    Err(FormatError::new(path, what).at(at).hint("the file is not what was exported: export it again"))
}

fn check_sizes(
    path: &Path,
    facts: &ShotFacts,
    layers: &[HairLayer],
    frame: &[HairFrame<'_>],
) -> Result<(), FormatError> {
    let wrong = |what: String| Err(FormatError::new(path, what));
    if layers.len() != frame.len() {
        return wrong(format!("{} layers but {} frames of layers", layers.len(), frame.len()));
    }
    let shadows = facts.shadow_columns().len();
    for (l, f) in layers.iter().zip(frame) {
        let (curves, points) = (l.offsets.len(), l.offsets.total());
        let exact = [
            ("id", l.id.len(), curves),
            ("position", f.position.len(), points),
            ("velocity", f.velocity.len(), points),
            ("width", l.width.len(), points),
        ];
        let optional = [
            ("root_uv", l.root_uv.len(), curves),
            ("color", l.color.len(), if l.color_per_point() { points } else { curves }),
            ("opacity", l.opacity.len(), curves),
            ("width of the frame", f.width.len(), points),
            ("opacity of the frame", f.opacity.len(), curves),
        ];
        if f.transmittance.len() != shadows || f.transmittance.iter().any(|c| c.len() != points) {
            return wrong(format!("layer '{}': wrong columns of transmittance, expected {shadows}", l.name));
        }
        let bad = exact.iter().find(|c| c.1 != c.2).or_else(|| optional.iter().find(|c| c.1 != c.2 && c.1 != 0));
        if let Some((name, found, expected)) = bad {
            return wrong(format!("layer '{}': {found} values of {name}, expected {expected}", l.name));
        }
    }
    Ok(())
}

fn comments(facts: &ShotFacts, layers: &[HairLayer]) -> Vec<String> {
    let mut lines = vec![
        MARK.to_owned(),
        format!("shot {}", facts.name),
        format!("meters_per_unit {}", facts.meters_per_unit),
        format!("up {}", facts.up),
        format!("fps {}", facts.fps),
    ];
    if let [frame] = facts.frames[..] {
        lines.push(format!("frame {frame}"));
    }
    if facts.origin != [0.0; 3] {
        lines.push(format!("{ORIGIN} {} {} {}", facts.origin[0], facts.origin[1], facts.origin[2]));
    }
    lines.push("x y z in scene units, vx vy vz in scene units per second, width is a diameter in scene units".into());
    lines.push("hair: points first to first + count - 1, root first; id = id_lo + 2^32 id_hi".into());
    lines.extend(layers.iter().enumerate().map(|(k, l)| format!("layer {k} {}", l.name)));
    lines.extend(facts.extra.iter().map(|(name, value)| format!("{name} {value}")));
    lines.iter().map(|l| l.replace(['\n', '\r'], " ")).collect()
}

fn vertex_table<'a>(facts: &ShotFacts, layers: &'a [HairLayer], frame: &[HairFrame<'a>]) -> Table {
    let floats = |v: &mut dyn Iterator<Item = f32>| Column::F32(v.collect());
    let mut columns = Vec::new();
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut x = frame.iter().flat_map(|f| f.position.iter().map(move |p| p[k]));
        columns.push((
            name.to_owned(),
            match facts.origin {
                [0.0, 0.0, 0.0] => floats(&mut x),
                origin => Column::F64(x.map(|x| origin[k] + f64::from(x)).collect()),
            },
        ));
    }
    for (k, name) in ["vx", "vy", "vz"].into_iter().enumerate() {
        columns.push((name.to_owned(), floats(&mut frame.iter().flat_map(|f| f.velocity.iter().map(move |p| p[k])))));
    }
    let width = |(l, f): (&'a HairLayer, &HairFrame<'a>)| if f.width.is_empty() { &l.width[..] } else { f.width };
    columns.push(("width".to_owned(), floats(&mut layers.iter().zip(frame).flat_map(width).copied())));
    for (c, name) in facts.shadow_columns().iter().enumerate() {
        let name = name.replace([':', '-'], "_");
        columns.push((name, floats(&mut frame.iter().flat_map(|f| f.transmittance[c].iter().copied()))));
    }
    if layers.iter().any(HairLayer::color_per_point) {
        let colors: Vec<[f32; 3]> = layers.iter().flat_map(point_colors).collect();
        for (k, name) in ["r", "g", "b"].into_iter().enumerate() {
            columns.push((name.to_owned(), floats(&mut colors.iter().map(|c| c[k]))));
        }
    }
    Table { name: "vertex".into(), rows: columns[0].1.len(), columns }
}

/// A colour for each point of a layer, white without any.
fn point_colors(l: &HairLayer) -> Vec<[f32; 3]> {
    if l.color_per_point() {
        return l.color.clone();
    }
    let of = |s: usize| l.color.get(s).copied().unwrap_or([1.0; 3]);
    l.offsets.counts().enumerate().flat_map(|(s, n)| std::iter::repeat_n(of(s), n)).collect()
}

fn hair_table(layers: &[HairLayer], frame: &[HairFrame<'_>]) -> Table {
    let id: Vec<u64> = layers.iter().flat_map(|l| l.id.iter().copied()).collect();
    let (lo, hi) = split_ids(&id);
    let mut first = 0;
    let mut starts = Vec::with_capacity(id.len());
    for count in layers.iter().flat_map(|l| l.offsets.counts()) {
        starts.push(first);
        first += count as u32;
    }
    let counts = layers.iter().flat_map(|l| l.offsets.counts().map(|c| c as u32)).collect();
    let layer = layers.iter().enumerate().flat_map(|(k, l)| l.id.iter().map(move |_| k as u32)).collect();
    let mut columns: Vec<(String, Column)> = vec![
        ("first".into(), Column::U32(starts)),
        ("count".into(), Column::U32(counts)),
        ("id_lo".into(), lo),
        ("id_hi".into(), hi),
        ("layer".into(), Column::U32(layer)),
    ];
    // A layer without a column among layers that have it gets what its absence means.
    let mut optional = |name: &str, default: f32, value: &dyn Fn(usize, usize) -> Option<f32>| {
        if (0..layers.len()).any(|l| value(l, 0).is_some()) {
            let of = |l: usize| (0..layers[l].id.len()).map(move |s| value(l, s).unwrap_or(default));
            columns.push((name.to_owned(), Column::F32((0..layers.len()).flat_map(of).collect())));
        }
    };
    for (k, name) in ["u", "v"].into_iter().enumerate() {
        optional(name, 0.0, &|l, s| layers[l].root_uv.get(s).map(|c| c[k]));
    }
    if !layers.iter().any(HairLayer::color_per_point) {
        for (k, name) in ["r", "g", "b"].into_iter().enumerate() {
            optional(name, 1.0, &|l, s| layers[l].color.get(s).map(|c| c[k]));
        }
    }
    optional("opacity", 1.0, &|l, s| frame[l].opacity.get(s).or(layers[l].opacity.get(s)).copied());
    Table { name: "hair".into(), rows: id.len(), columns }
}

/// Reads curves: the layout of [`write_hair`], or polylines as lists `vertex_indices` of an element `hair`, `strand`,
/// `curve`, `polyline` or `edge`, or chains of edges `vertex1 vertex2`. A vertex property `width` is a diameter,
/// `radius` half of one.
///
/// A chain starts at the end that is the `vertex1` of its edge; if both ends or neither are, at the lower vertex.
pub fn read_curves(path: &Path) -> Result<Curves, FormatError> {
    parse_curves(path, &read_bytes(path)?)
}

/// [`read_curves`] on a file that is in memory; `path` is for errors.
pub fn parse_curves(path: &Path, bytes: &[u8]) -> Result<Curves, FormatError> {
    let mut source = Source::new(path, bytes)?;
    let elements: Vec<ElementDef> = source.header.elements.values().cloned().collect();
    let curve = CURVE_ELEMENTS.iter().find_map(|n| elements.iter().find(|e| e.name == *n && layout(e).is_some()));
    let (Some(curve), true) = (curve, elements.iter().any(|e| e.name == "vertex")) else {
        let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
        let what = format!("holds no curves (its elements: {})", names.join(", "));
        let hint = "expected an element 'vertex' and an element 'hair', 'strand', 'curve', 'polyline' or 'edge' with \
                    first and count, a list vertex_indices, or vertex1 and vertex2";
        return Err(FormatError::new(path, what).hint(hint));
    };
    let (mut points, mut rows) = (Points::default(), Rows::default());
    for element in &elements {
        if element.name == "vertex" {
            points = read_points(&mut source, element)?;
        } else if element.name == curve.name {
            rows = read_rows(&mut source, element)?;
        } else {
            source.skip(element)?;
        }
    }
    let mut warnings = source.leftovers();
    if layout(curve) == Some(Layout::Edges) {
        rows = chains(path, &rows.index, points.position.len())?;
    }
    rows.gather(path, &curve.name, points.position.len())?;
    let comments = source.header.comments.clone();
    assemble(path, &curve.name, points, rows, comments, &mut warnings)
}

/// How an element lists the points of its curves.
#[derive(Clone, Copy, PartialEq)]
enum Layout {
    Ranges,
    Lists(&'static str),
    Edges,
}

fn layout(element: &ElementDef) -> Option<Layout> {
    let kind = |n: &str| element.properties.get(n).map(|p| &p.data_type);
    let scalar = |n: &str| matches!(kind(n), Some(PropertyType::Scalar(_)));
    let list = ["vertex_indices", "vertex_index"].into_iter().find(|n| matches!(kind(n), Some(PropertyType::List(..))));
    if scalar("first") && scalar("count") {
        Some(Layout::Ranges)
    } else if let Some(name) = list {
        Some(Layout::Lists(name))
    } else if scalar("vertex1") && scalar("vertex2") {
        Some(Layout::Edges)
    } else {
        None
    }
}

#[derive(Default)]
struct Points {
    position: Vec<[f64; 3]>,
    /// Diameters; empty without.
    width: Vec<f32>,
}

fn read_points(source: &mut Source, element: &ElementDef) -> Result<Points, FormatError> {
    let path = source.path;
    let scalar = |n: &str| matches!(element.properties.get(n).map(|p| &p.data_type), Some(PropertyType::Scalar(_)));
    if let Some(name) = ["x", "y", "z"].into_iter().find(|n| !scalar(n)) {
        return Err(FormatError::new(path, format!("no number '{name}'")).at("element vertex"));
    }
    let width = [("width", 1.0), ("radius", 2.0)].into_iter().find(|w| scalar(w.0));
    let mut wanted = vec![("x", '0'), ("y", '1'), ("z", '2')];
    wanted.extend(width.map(|w| (w.0, '3')));
    let room = source.capacity(element);
    let mut out = Points { position: Vec::with_capacity(room), width: Vec::new() };
    source.rows(element, &Plan::new(element, &wanted), |i, row: Row<4>| {
        let [x, y, z, w] = row.value;
        if let Some(k) = row.value.iter().position(|x| !(*x as f32).is_finite()) {
            let what = format!("{} is {}, not a finite number", ["x", "y", "z", "width"][k], row.value[k]);
            return Err(FormatError::new(path, what).at(format!("vertex {i}")));
        }
        out.position.push([x, y, z]);
        if let Some((_, scale)) = width {
            out.width.push((scale * w) as f32);
        }
        Ok(())
    })?;
    Ok(out)
}

/// What the rows of the curve element say.
#[derive(Default)]
struct Rows {
    /// (first, count) of each curve, for [`Layout::Ranges`].
    range: Vec<[f64; 2]>,
    /// Vertices of all curves (or both ends of all edges) in order.
    index: Vec<u32>,
    /// Vertices a curve.
    count: Vec<usize>,
    id: Vec<u64>,
    uv: Vec<[f32; 2]>,
}

fn read_rows(source: &mut Source, element: &ElementDef) -> Result<Rows, FormatError> {
    let path = source.path;
    let scalar = |n: &str| matches!(element.properties.get(n).map(|p| &p.data_type), Some(PropertyType::Scalar(_)));
    let layout = layout(element);
    let mut wanted = match layout {
        Some(Layout::Ranges) => vec![("first", '0'), ("count", '1')],
        Some(Layout::Lists(name)) => vec![(name, 'i')],
        _ => vec![("vertex1", '0'), ("vertex2", '1')],
    };
    let (ids, uvs) = (scalar("id_lo") && scalar("id_hi"), scalar("u") && scalar("v"));
    wanted.extend([("id_lo", '2'), ("id_hi", '3'), ("u", '4'), ("v", '5')]);
    let room = source.capacity(element);
    let mut out = Rows::default();
    if layout == Some(Layout::Ranges) {
        out.range.reserve(room);
    }
    source.rows(element, &Plan::new(element, &wanted), |i, row: Row<6>| {
        let at = |what: &str| Err(FormatError::new(path, what).at(format!("{} {i}", element.name)));
        let [a, b, lo, hi, u, v] = row.value;
        match layout {
            Some(Layout::Ranges) => out.range.push([a, b]),
            Some(Layout::Lists(_)) => {
                out.count.push(row.index.len());
                out.index.extend_from_slice(&row.index);
            }
            _ if [a, b].iter().all(|x| (0.0..4e9).contains(x)) => out.index.extend([a as u32, b as u32]),
            _ => return at("the ends of an edge must be vertex numbers from 0"),
        }
        if ids {
            if ![lo, hi].iter().all(|x| (0.0..=f64::from(u32::MAX)).contains(x)) {
                return at("id_lo and id_hi must be unsigned 32-bit numbers");
            }
            out.id.push(lo as u64 | (hi as u64) << 32);
        }
        if uvs {
            let uv = [u as f32, v as f32];
            if !uv.iter().all(|x| x.is_finite()) {
                return at("u or v is not a finite number");
            }
            out.uv.push(uv);
        }
        Ok(())
    })?;
    Ok(out)
}

impl Rows {
    /// Turns ranges into vertex lists and checks every index.
    fn gather(&mut self, path: &Path, name: &str, vertices: usize) -> Result<(), FormatError> {
        let at = |what: String, s: usize| Err(FormatError::new(path, what).at(format!("{name} {s}")));
        for (s, [first, count]) in self.range.iter().enumerate() {
            if !(*first >= 0.0 && *count >= 0.0 && first + count <= vertices as f64) {
                let what = format!("points {first} to {} of {vertices} vertices", first + count - 1.0);
                return at(what, s);
            }
            if self.index.len() + *count as usize > vertices {
                return at("curves share points: the counts sum to more than there are vertices".to_owned(), s);
            }
            self.count.push(*count as usize);
            self.index.extend((0..*count as u32).map(|k| *first as u32 + k));
        }
        let mut start = 0;
        for (s, count) in self.count.iter().enumerate() {
            if let Some(v) = self.index[start..start + count].iter().find(|v| **v as usize >= vertices) {
                return at(format!("vertex {v}, but there are {vertices} vertices (0 is the first)"), s);
            }
            start += count;
        }
        Ok(())
    }
}

/// Joins edges (pairs of `end`) to polylines.
fn chains(path: &Path, end: &[u32], vertices: usize) -> Result<Rows, FormatError> {
    let none = u32::MAX;
    let mut next = vec![[none; 2]; vertices];
    let mut starts = vec![false; vertices];
    for (e, pair) in end.chunks_exact(2).enumerate() {
        for (v, other) in [(pair[0], pair[1]), (pair[1], pair[0])] {
            let Some(slot) = next.get_mut(v as usize) else {
                let what = format!("vertex {v}, but there are {vertices} vertices (0 is the first)");
                return Err(FormatError::new(path, what).at(format!("edge {e}")));
            };
            match slot.iter().position(|n| *n == none) {
                Some(k) if v != other => slot[k] = other,
                _ => {
                    let what = format!("vertex {v} joins more than two edges, or one to itself: not a set of hairs");
                    return Err(FormatError::new(path, what).at(format!("edge {e}")));
                }
            }
        }
        starts[pair[0] as usize] = true;
    }
    let mut rows = Rows::default();
    let mut seen = vec![false; vertices];
    // First the ends that are a `vertex1`, then whatever is left (chains drawn from both sides, or towards both).
    for directed in [true, false] {
        for v in 0..vertices {
            let is_end = next[v][0] != none && next[v][1] == none;
            if seen[v] || !is_end || (directed && !starts[v]) {
                continue;
            }
            let (before, mut at, mut from) = (rows.index.len(), v as u32, none);
            while at != none {
                seen[at as usize] = true;
                rows.index.push(at);
                let [a, b] = next[at as usize];
                (at, from) = (if a == from { b } else { a }, at);
            }
            rows.count.push(rows.index.len() - before);
        }
    }
    if let Some(v) = (0..vertices).find(|v| next[*v][0] != none && !seen[*v]) {
        let what = "the edges form a closed loop, which has no root";
        return Err(FormatError::new(path, what).at(format!("vertex {v}")));
    }
    Ok(rows)
}

fn assemble(
    path: &Path,
    name: &str,
    points: Points,
    rows: Rows,
    comments: Vec<String>,
    warnings: &mut Vec<String>,
) -> Result<Curves, FormatError> {
    if u32::try_from(rows.index.len()).is_err() {
        return Err(FormatError::new(path, "more than 2^32 points"));
    }
    let origin = origin(&comments, &points.position);
    let mut out = Curves { comments, width: (!points.width.is_empty()).then(Vec::new), ..Curves::default() };
    let s = &mut out.strands;
    s.origin = origin;
    let (mut start, mut counts, mut short) = (0, Vec::with_capacity(rows.count.len()), 0);
    for (k, &count) in rows.count.iter().enumerate() {
        let range = start..start + count;
        start += count;
        if count < 2 {
            short += 1;
            continue;
        }
        counts.push(count);
        for &v in &rows.index[range] {
            let p = points.position[v as usize];
            s.position.push(std::array::from_fn(|i| (p[i] - origin[i]) as f32));
            if let Some(w) = &mut out.width {
                w.push(points.width[v as usize]);
            }
        }
        s.id.extend(rows.id.get(k));
        s.root_uv.extend(rows.uv.get(k));
    }
    s.offsets = Offsets::from_counts(counts);
    let mut known = BTreeSet::new();
    if let Some(id) = s.id.iter().find(|id| **id >> 63 != 0 || !known.insert(**id)) {
        let what = format!("id {id} of an element '{name}' is used twice or does not fit 63 bits");
        return Err(FormatError::new(path, what));
    }
    if s.is_empty() {
        return Err(FormatError::new(path, format!("no curve of two or more points in element '{name}'")));
    }
    if short > 0 {
        warnings.push(format!("{short} curves with fewer than 2 points were skipped"));
    }
    out.warnings = std::mem::take(warnings);
    Ok(out)
}

/// The origin that the comments name; zero for our own files that name none; else, for curves that are far from the scene's
/// origin for their size, the middle of their box in whole units; else zero.
fn origin(comments: &[String], position: &[[f64; 3]]) -> [f64; 3] {
    let parse = |c: &String| {
        let mut words =
            c.strip_prefix(ORIGIN)?.split_whitespace().map(|w| w.parse::<f64>().ok().filter(|x| x.is_finite()));
        let found = [words.next()??, words.next()??, words.next()??];
        words.next().is_none().then_some(found)
    };
    if let Some(found) = comments.iter().find_map(parse) {
        return found;
    }
    if comments.iter().any(|c| c == MARK) {
        return [0.0; 3];
    }
    let Some(first) = position.first() else { return [0.0; 3] };
    let (lo, hi) = position.iter().fold((*first, *first), |(lo, hi): ([f64; 3], [f64; 3]), p| {
        (std::array::from_fn(|i| lo[i].min(p[i])), std::array::from_fn(|i| hi[i].max(p[i])))
    });
    let middle: [f64; 3] = std::array::from_fn(|i| (0.5 * (lo[i] + hi[i])).round());
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Below: f32 still resolves 1/2^18 of the curves. Above this, points of a hair start to fall together.
    let far = length(middle) > 64.0 * length(std::array::from_fn(|i| hi[i] - lo[i]));
    if far { middle } else { [0.0; 3] }
}

#[cfg(test)]
mod tests;
