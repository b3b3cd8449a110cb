//! `pelage inspect`: what is in a file.

use super::print;
use crate::Error;
use crate::curves::{self, CurveFile, signature};
use crate::format::image::{self, Channel};
use crate::format::{csv, mcap, ply};
use crate::stage::shadow::decode;
use pelage_geom::Topology;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Prints counts, bounds, units, ids and warnings of a file.
pub fn inspect(file: &Path, as_json: bool) -> Result<bool, Error> {
    let start = signature(file)?;
    let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let found = match &start {
        s if s.starts_with(b"\x89MCAP") => inspect_mcap(file)?,
        s if s.starts_with(b"ply") => inspect_ply(file)?,
        s if s.starts_with(b"PXR-USDC") || s.starts_with(b"#usda") || s.starts_with(b"HAIR") => {
            describe_curves(&curves::read(file, None)?)
        }
        s if s.starts_with(b"\x89PNG") || s.starts_with(b"II*\0") || s.starts_with(b"MM\0*") => inspect_image(file)?,
        [0x76, 0x2f, 0x31, 0x01, ..] => inspect_image(file)?,
        _ if extension == "csv" => inspect_motion(file)?,
        _ if extension == "json" => inspect_record(file)?,
        _ => {
            let what = format!("{}: not a file that Pelage knows", file.display());
            return Err(Error::input(
                what,
                "it reads PLY, USD (.usdc), MCAP, .hair, PNG, TIFF, OpenEXR and motion CSV",
            ));
        }
    };
    if as_json {
        print(&(serde_json::to_string_pretty(&found).expect("plain JSON") + "\n"));
    } else {
        let mut out = String::new();
        lines(&found, 0, &mut out);
        print(&out);
    }
    Ok(true)
}

/// JSON as indented text.
fn lines(value: &Value, indent: usize, out: &mut String) {
    let Value::Object(map) = value else { return };
    for (key, value) in map {
        match value {
            Value::Object(_) => {
                out.push_str(&format!("{:indent$}{key}:\n", ""));
                lines(value, indent + 2, out);
            }
            Value::Array(items) if items.iter().any(Value::is_object) => {
                for item in items {
                    out.push_str(&format!("{:indent$}{key}:\n", ""));
                    lines(item, indent + 2, out);
                }
            }
            Value::String(s) => out.push_str(&format!("{:indent$}{key}: {s}\n", "")),
            other => out.push_str(&format!("{:indent$}{key}: {other}\n", "")),
        }
    }
}

fn inspect_ply(file: &Path) -> Result<Value, Error> {
    let tables = ply::read_tables(file);
    if let Ok(tables) = tables
        && tables.get("vertex").is_none()
    {
        let table = |t: &ply::Table| {
            let columns: Map<String, Value> = t.columns.iter().map(|(n, c)| (n.clone(), describe_column(c))).collect();
            json!({"name": t.name, "rows": t.rows, "columns": columns})
        };
        let all: Vec<Value> = tables.tables.iter().map(table).collect();
        return Ok(json!({"kind": "PLY tables", "comments": tables.comments, "table": all}));
    }
    match ply::read_mesh(file) {
        Ok(read) => Ok(describe_mesh(&read)),
        Err(mesh_error) => match ply::read_curves(file) {
            Ok(_) => Ok(describe_curves(&curves::read(file, None)?)),
            Err(_) => Err(mesh_error.into()),
        },
    }
}

fn describe_column(column: &ply::Column) -> Value {
    let values: Vec<f64> = match column {
        ply::Column::F32(v) => v.iter().map(|x| f64::from(*x)).collect(),
        ply::Column::F64(v) => v.clone(),
        ply::Column::U32(v) => v.iter().map(|x| f64::from(*x)).collect(),
        ply::Column::I32(v) => v.iter().map(|x| f64::from(*x)).collect(),
        ply::Column::U8(v) => v.iter().map(|x| f64::from(*x)).collect(),
    };
    spread(values.into_iter())
}

/// Smallest, mean and largest value, and a histogram of ten equal bins between the extremes.
fn spread(values: impl Iterator<Item = f64> + Clone) -> Value {
    let (mut n, mut sum, mut low, mut high) = (0u64, 0.0, f64::INFINITY, f64::NEG_INFINITY);
    for v in values.clone() {
        (n, sum, low, high) = (n + 1, sum + v, low.min(v), high.max(v));
    }
    if n == 0 {
        return Value::Null;
    }
    let mut bins = [0u64; 10];
    for v in values {
        let t = if high > low { (v - low) / (high - low) * 10.0 } else { 0.0 };
        bins[(t as usize).min(9)] += 1;
    }
    json!({"min": low, "mean": sum / n as f64, "max": high, "histogram": bins})
}

fn describe_mesh(read: &ply::ReadMesh) -> Value {
    let mesh = &read.mesh;
    let topology = Topology::new(mesh);
    let c = topology.counts;
    let (low, high) = mesh.bounds();
    let uv = mesh.corner_uv.iter().flatten();
    let outside = uv.clone().filter(|p| p.iter().any(|x| !(0.0..=1.0).contains(x))).count();
    json!({
        "kind": "skin",
        "vertices": mesh.position.len(),
        "triangles": mesh.triangle.len(),
        "polygons": read.faces,
        "texture coordinates": !mesh.corner_uv.is_empty(),
        "charts": topology.charts,
        "area": topology.area.iter().sum::<f64>(),
        "bounds": {"low": low, "high": high},
        "triangles without area": c.zero_area,
        "triangles without area in (u, v)": c.zero_uv_area,
        "mirrored triangles": c.mirrored,
        "open edges": c.open_edges,
        "non-manifold edges": c.non_manifold_edges,
        "seam edges": c.seam_edges,
        "corners outside the texture square": outside,
        "warnings": read.warnings,
    })
}

fn describe_curves(file: &CurveFile) -> Value {
    let layer = |l: &curves::CurveSet| {
        let s = &l.strands;
        let length = |i: usize| pelage_geom::curve::length(s.points(i));
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for p in &s.position {
            for x in 0..3 {
                let v = f64::from(p[x]) + s.origin[x];
                (low[x], high[x]) = (low[x].min(v), high[x].max(v));
            }
        }
        let (fewest, most) = (s.offsets.counts().min().unwrap_or(0), s.offsets.counts().max().unwrap_or(0));
        let bad = s.position.iter().flatten().filter(|x| !x.is_finite()).count();
        json!({
            "name": l.name,
            "hairs": s.len(),
            "points": s.position.len(),
            "points per hair": [fewest, most],
            "bounds": {"low": low, "high": high},
            "length": spread((0..s.len()).map(length)),
            "width (diameter)": spread(l.width.iter().map(|w| f64::from(*w))),
            "ids": if s.id.is_empty() { Value::Null } else { json!([s.id.iter().min(), s.id.iter().max()]) },
            "root uv": !s.root_uv.is_empty(),
            "numbers that are not finite": bad,
        })
    };
    let frames = match (file.frames.first(), file.frames.last()) {
        (Some(a), Some(b)) => json!({"first": a, "last": b, "count": file.frames.len()}),
        _ => Value::Null,
    };
    json!({
        "kind": format!("curves ({})", file.format),
        "meters per unit": file.meters_per_unit,
        "frames": frames,
        "layer": file.layers.iter().map(layer).collect::<Vec<_>>(),
        "warnings": file.warnings,
    })
}

fn inspect_mcap(file: &Path) -> Result<Value, Error> {
    if mcap::read_hair_mcap(file).is_ok() {
        return Ok(describe_curves(&curves::read(file, None)?));
    }
    if let Ok(bytes) = std::fs::read(file)
        && let Ok(layers) = mcap::read_frame_payload(&bytes)
    {
        let axis = |x: usize| spread(layers.iter().flatten().map(move |p| f64::from(p[x])));
        let points: Vec<usize> = layers.iter().map(Vec::len).collect();
        return Ok(json!({"kind": "cached frame", "points": points, "x": axis(0), "y": axis(1), "z": axis(2)}));
    }
    if let Ok(bytes) = std::fs::read(file)
        && let Ok(state) = mcap::read_state_payload(&bytes)
    {
        let Some(columns) = decode(&state) else {
            return Ok(json!({"kind": "simulation state", "bytes": state.len()}));
        };
        let points: usize = columns.iter().map(Vec::len).sum();
        let sum: f64 = columns.iter().flatten().map(|t| f64::from(*t)).sum();
        let mean = if points > 0 { sum / points as f64 } else { 1.0 };
        return Ok(
            json!({"kind": "transmittance of a light", "layers": columns.len(), "points": points, "mean": mean}),
        );
    }
    let summary = mcap::inspect(file)?;
    Ok(json!({"kind": "MCAP", "content": format!("{summary:#?}")}))
}

fn inspect_image(file: &Path) -> Result<Value, Error> {
    let (width, height) = image::read_size(file)?;
    let read = image::read_map(file, Channel::Auto, false)?;
    let values = spread(read.map.data.iter().map(|x| f64::from(*x)));
    Ok(json!({"kind": "map", "size": [width, height], "grey": values, "warnings": read.warnings}))
}

/// A record of the cache or a report: shown as it is.
fn inspect_record(file: &Path) -> Result<Value, Error> {
    let bytes = std::fs::read(file).map_err(Error::disk(file))?;
    let found: Value = serde_json::from_slice(&bytes)
        .map_err(|e| Error::input(format!("{}: not JSON: {e}", file.display()), "it may have been cut short"))?;
    Ok(match found {
        Value::Object(_) => json!({"kind": "record", "record": found}),
        list => json!({"kind": "record", "item": list}),
    })
}

fn inspect_motion(file: &Path) -> Result<Value, Error> {
    let motion = csv::read_motion(file, 1.0, 24.0)?;
    let reach = motion.translation.iter().map(|t| t.iter().map(|x| x * x).sum::<f64>().sqrt());
    let turn = motion.rotation.iter().map(|q| 2.0 * q[3].abs().min(1.0).acos().to_degrees());
    Ok(json!({
        "kind": "rigid motion",
        "samples": motion.time.len(),
        "seconds": [motion.time.first(), motion.time.last()],
        "displacement (m)": spread(reach),
        "rotation (degrees)": spread(turn),
    }))
}
