//! Skins: polygon meshes, and the positions of a deforming sequence.

use super::polygon::triangulate;
use super::row::Row;
use super::source::{Plan, Source, read_bytes};
use crate::format::FormatError;
use pelage_geom::{Mesh, Vec3};
use ply_rs::ply::{ElementDef, PropertyType, ScalarType};
use std::path::Path;

/// A mesh and what was noticed while it was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadMesh {
    /// The mesh; scene units of the file, triangles in the order of their faces.
    pub mesh: Mesh,
    /// Polygons in the file, those included that gave no triangle.
    pub faces: usize,
    /// The file has vertex normals (they are not read: normals come from the positions).
    pub vertex_normals_present: bool,
    /// Oddities that were worked around, in words.
    pub warnings: Vec<String>,
}

/// Names of texture coordinates per vertex, the first pair that is there counts.
const UV_NAMES: [[&str; 2]; 4] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
/// Names of the list of a face's corners.
const CORNER_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads a polygon mesh: ascii or binary, triangles, quads and n-gons, texture coordinates per vertex (`s,t`, `u,v` or
/// `texture_u,texture_v`) or per corner (`texcoord`, which wins where a face has it).
pub fn read_mesh(path: &Path) -> Result<ReadMesh, FormatError> {
    parse_mesh(path, &read_bytes(path)?)
}

/// [`read_mesh`] on a file that is in memory; `path` is for errors.
pub fn parse_mesh(path: &Path, bytes: &[u8]) -> Result<ReadMesh, FormatError> {
    let mut source = Source::new(path, bytes)?;
    let elements: Vec<ElementDef> = source.header.elements.values().cloned().collect();
    let face_count = elements.iter().find(|e| e.name == "face").map_or(0, |e| e.count);
    if elements.iter().all(|e| e.name != "vertex") {
        return Err(FormatError::new(path, "no element 'vertex': this file holds no mesh"));
    }
    if face_count == 0 {
        return Err(no_faces(path, &elements));
    }
    let mut warnings = Vec::new();
    let (mut vertices, mut faces) = (Vertices::default(), Faces::default());
    for element in &elements {
        match element.name.as_str() {
            "vertex" => vertices = read_vertices(&mut source, element)?,
            "face" => faces = read_faces(&mut source, element)?,
            _ => source.skip(element)?,
        }
    }
    warnings.extend(source.leftovers());
    warnings.extend(vertices.warning.take());
    let mesh = assemble(path, vertices.position, &vertices.uv, &mut faces, &mut warnings)?;
    let named = |e: &ElementDef| e.name == "vertex" && ["nx", "ny", "nz"].iter().all(|n| e.properties.contains_key(*n));
    Ok(ReadMesh { mesh, faces: face_count, vertex_normals_present: elements.iter().any(named), warnings })
}

/// Reads one frame of a deforming skin: positions only, in the vertex order of a rest pose of so many vertices and
/// faces. Where the frame has faces, it must have as many.
pub fn read_frame(path: &Path, vertices: usize, faces: usize) -> Result<Vec<[f64; 3]>, FormatError> {
    parse_positions(path, &read_bytes(path)?, vertices, Some(faces))
}

fn parse_positions(
    path: &Path,
    bytes: &[u8],
    vertices: usize,
    faces: Option<usize>,
) -> Result<Vec<[f64; 3]>, FormatError> {
    let mut source = Source::new(path, bytes)?;
    let elements: Vec<ElementDef> = source.header.elements.values().cloned().collect();
    let count = |name: &str| elements.iter().find(|e| e.name == name).map(|e| e.count);
    let hint = "every frame must keep the topology of the rest pose; export the sequence and the rest pose together";
    let Some(found) = count("vertex") else {
        return Err(FormatError::new(path, "no element 'vertex': this file holds no mesh"));
    };
    if found != vertices {
        let what = format!("has {found} vertices, the rest pose has {vertices}");
        return Err(FormatError::new(path, what).hint(hint));
    }
    if let (Some(found), Some(expected)) = (count("face").filter(|n| *n > 0), faces)
        && found != expected
    {
        let what = format!("has {found} faces, the rest pose has {expected}");
        return Err(FormatError::new(path, what).hint(hint));
    }
    for element in &elements {
        if element.name == "vertex" {
            let wanted = [("x", '0'), ("y", '1'), ("z", '2')];
            scalars(path, element, &["x", "y", "z"])?;
            let mut position = Vec::with_capacity(source.capacity(element));
            source.rows(element, &Plan::new(element, &wanted), |i, row: Row<3>| {
                position.push(finite(path, i, &["x", "y", "z"], row.value)?);
                Ok(())
            })?;
            return Ok(position);
        }
        source.skip(element)?;
    }
    unreachable!("the element was found above")
}

fn no_faces(path: &Path, elements: &[ElementDef]) -> FormatError {
    if elements.iter().any(|e| e.name == "tristrips" && e.count > 0) {
        return FormatError::new(
            path,
            "the mesh is stored as triangle strips (element 'tristrips'), which are not read",
        )
        .hint("export it with plain faces (element 'face')");
    }
    let vertices = elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    FormatError::new(path, format!("no faces: {vertices} vertices and no polygon"))
        .hint("a skin needs polygons; a file with positions only can be a frame of a sequence, not the rest pose")
}

/// Checks that `names` are scalar properties of `element`.
fn scalars(path: &Path, element: &ElementDef, names: &[&str]) -> Result<(), FormatError> {
    for name in names {
        let what = match element.properties.get(*name).map(|p| &p.data_type) {
            Some(PropertyType::Scalar(_)) => continue,
            Some(PropertyType::List(..)) => format!("property '{name}' is a list, expected one number"),
            None => format!("no property '{name}'"),
        };
        return Err(FormatError::new(path, what).at(format!("element {}", element.name)));
    }
    Ok(())
}

/// Larger coordinates are broken ones: their squares do not fit single precision.
const FARTHEST: f64 = 1e18;

/// The values if all are finite and in bounds, else an error that names the vertex and the property.
fn finite<const N: usize>(path: &Path, row: usize, names: &[&str; N], v: [f64; N]) -> Result<[f64; N], FormatError> {
    match v.iter().position(|x| !x.is_finite() || x.abs() > FARTHEST) {
        None => Ok(v),
        Some(k) if v[k].is_finite() => {
            Err(FormatError::new(path, format!("{} is {:e}, at most {FARTHEST:e} is read", names[k], v[k]))
                .at(format!("vertex {row}"))
                .hint("check the scale of the mesh"))
        }
        Some(k) => Err(FormatError::new(path, format!("{} is {}, not a finite number", names[k], v[k]))
            .at(format!("vertex {row}"))
            .hint("the program that wrote the file produced a broken position; repair the mesh there")),
    }
}

#[derive(Default)]
struct Vertices {
    position: Vec<[f64; 3]>,
    /// Empty without texture coordinates.
    uv: Vec<[f32; 2]>,
    warning: Option<String>,
}

fn read_vertices(source: &mut Source, element: &ElementDef) -> Result<Vertices, FormatError> {
    let path = source.path;
    scalars(path, element, &["x", "y", "z"])?;
    let has = |n: &str| matches!(element.properties.get(n).map(|p| &p.data_type), Some(PropertyType::Scalar(_)));
    let pair = UV_NAMES.iter().find(|p| has(p[0]) && has(p[1]));
    let half = UV_NAMES.iter().flatten().find(|n| has(n)).filter(|_| pair.is_none());
    let mut wanted = vec![("x", '0'), ("y", '1'), ("z", '2')];
    wanted.extend(pair.map(|p| (p[0], '3')));
    wanted.extend(pair.map(|p| (p[1], '4')));
    let names = ["x", "y", "z", pair.map_or("", |p| p[0]), pair.map_or("", |p| p[1])];
    let room = source.capacity(element);
    let mut out = Vertices {
        position: Vec::with_capacity(room),
        uv: Vec::with_capacity(if pair.is_some() { room } else { 0 }),
        warning: half.map(|n| format!("vertex property '{n}' has no partner; texture coordinates were not read")),
    };
    source.rows(element, &Plan::new(element, &wanted), |i, row: Row<5>| {
        let [x, y, z, u, v] = finite(path, i, &names, row.value)?;
        out.position.push([x, y, z]);
        if pair.is_some() {
            let uv = [u as f32, v as f32];
            finite(path, i, &[names[3], names[4]], uv.map(f64::from))?;
            out.uv.push(uv);
        }
        Ok(())
    })?;
    Ok(out)
}

#[derive(Default)]
struct Faces {
    /// Corners of face i: `corner[start[i]..start[i + 1]]`.
    start: Vec<usize>,
    corner: Vec<u32>,
    /// One a corner where any face has its own texture coordinates; NaN where a face has none.
    uv: Vec<[f32; 2]>,
    /// Indices are of a signed type, so that large ones were negative.
    signed: bool,
}

fn read_faces(source: &mut Source, element: &ElementDef) -> Result<Faces, FormatError> {
    let path = source.path;
    let kind = |n: &str| element.properties.get(n).map(|p| &p.data_type);
    let at = |e: FormatError| e.at("element face");
    let corners = match CORNER_NAMES.iter().find_map(|n| kind(n).map(|k| (*n, k))) {
        Some((name, PropertyType::List(_, ScalarType::Float | ScalarType::Double))) => {
            return Err(at(FormatError::new(path, format!("'{name}' is a list of real numbers, expected integers"))));
        }
        Some((name, PropertyType::List(..))) => name,
        Some((name, PropertyType::Scalar(_))) => {
            return Err(at(FormatError::new(path, format!("'{name}' is one number, expected a list"))));
        }
        None => return Err(at(FormatError::new(path, "no list 'vertex_indices' (or 'vertex_index')"))),
    };
    let signed = !matches!(kind(corners), Some(PropertyType::List(_, ScalarType::UInt)));
    let own_uv = matches!(kind("texcoord"), Some(PropertyType::List(..)));
    let mut wanted = vec![(corners, 'i')];
    wanted.extend(own_uv.then_some(("texcoord", 't')));
    let room = source.capacity(element);
    let mut out =
        Faces { start: Vec::with_capacity(room + 1), corner: Vec::with_capacity(3 * room), uv: Vec::new(), signed };
    out.start.push(0);
    source.rows(element, &Plan::new(element, &wanted), |i, row: Row<0>| {
        let n = row.index.len();
        out.corner.extend_from_slice(&row.index);
        out.start.push(out.corner.len());
        if own_uv && row.real.is_empty() {
            out.uv.resize(out.corner.len(), [f32::NAN; 2]);
        } else if own_uv {
            if row.real.len() != 2 * n {
                let what =
                    format!("texcoord has {} values, expected {} (2 for each of {n} corners)", row.real.len(), 2 * n);
                return Err(FormatError::new(path, what).at(format!("face {i}")));
            }
            if row.real.iter().any(|x| !x.is_finite()) {
                return Err(FormatError::new(path, "texcoord holds a value that is not finite").at(format!("face {i}")));
            }
            out.uv.extend(row.real.chunks_exact(2).map(|c| [c[0], c[1]]));
        }
        Ok(())
    })?;
    Ok(out)
}

/// Checks indices, cuts polygons and hands texture coordinates to corners.
fn assemble(
    path: &Path,
    position: Vec<[f64; 3]>,
    vertex_uv: &[[f32; 2]],
    faces: &mut Faces,
    warnings: &mut Vec<String>,
) -> Result<Mesh, FormatError> {
    let count = faces.start.len() - 1;
    let (mut skipped, mut first_skipped, mut fans) = (0, 0, 0);
    let (mut triangle, mut face) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let missing = corner_uvs(vertex_uv, faces, position.len());
    let has_uv = !faces.uv.is_empty();
    let mut corner_uv = Vec::with_capacity(if has_uv { count } else { 0 });
    let (mut points, mut cut) = (Vec::new(), Vec::new());
    for f in 0..count {
        let range = faces.start[f]..faces.start[f + 1];
        let corner = &faces.corner[range.clone()];
        if let Some(k) = corner.iter().position(|&v| v as usize >= position.len()) {
            let index = if faces.signed { i64::from(corner[k] as i32) } else { i64::from(corner[k]) };
            let what =
                format!("corner {k} is vertex {index}, but there are {} vertices (0 is the first)", position.len());
            return Err(FormatError::new(path, what).at(format!("face {f}")));
        }
        if corner.len() < 3 {
            first_skipped = if skipped == 0 { f } else { first_skipped };
            skipped += 1;
            continue;
        }
        if corner.len() == 3 {
            cut.clear();
            cut.push([0, 1, 2]);
        } else {
            points.clear();
            points.extend(corner.iter().map(|&v| Vec3::from(position[v as usize])));
            fans += usize::from(!triangulate(&points, &mut cut));
        }
        for t in &cut {
            triangle.push(t.map(|k| corner[k]));
            face.push(f as u32);
            if has_uv {
                corner_uv.push(t.map(|k| faces.uv[range.start + k]));
            }
        }
    }
    if triangle.is_empty() {
        return Err(FormatError::new(path, format!("no faces: each of {count} polygons has fewer than 3 corners")));
    }
    if skipped > 0 {
        warnings.push(format!(
            "{skipped} faces with fewer than 3 corners were skipped (the first is face {first_skipped})"
        ));
    }
    if fans > 0 {
        warnings.push(format!("{fans} large concave polygons were cut as fans; triangles may overlap there"));
    }
    if missing > 0 {
        warnings.push(format!("{missing} faces have no texture coordinates; (0, 0) was taken"));
    }
    Ok(Mesh { position, triangle, corner_uv, face })
}

/// Fills `faces.uv`: a face's own coordinates, else its vertices', else zeros. Returns how many faces got zeros.
fn corner_uvs(vertex_uv: &[[f32; 2]], faces: &mut Faces, vertices: usize) -> usize {
    let none = faces.uv.iter().all(|c| c[0].is_nan());
    if none && vertex_uv.is_empty() {
        faces.uv = Vec::new();
        return 0;
    }
    if none {
        // Out-of-range indices are reported by the caller.
        let last = vertices.saturating_sub(1);
        faces.uv = faces.corner.iter().map(|&v| vertex_uv[(v as usize).min(last)]).collect();
        return 0;
    }
    let mut missing = 0;
    for f in 0..faces.start.len() - 1 {
        let range = faces.start[f]..faces.start[f + 1];
        if range.is_empty() || !faces.uv[range.start][0].is_nan() {
            continue;
        }
        missing += usize::from(vertex_uv.is_empty());
        for k in range {
            faces.uv[k] = vertex_uv.get(faces.corner[k] as usize).copied().unwrap_or_default();
        }
    }
    missing
}

#[cfg(test)]
mod tests;
