//! Curves from any file that Pelage reads, for comparing, inspecting and grooming.

use crate::format::{FormatError, hair, mcap, ply, usd};
use pelage_geom::Strands;
use std::path::Path;

/// The curves of one layer or primitive at one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveSet {
    /// Name of the layer or primitive; empty where the format has none.
    pub name: String,
    /// The curves; ids and root coordinates where the file has them.
    pub strands: Strands,
    /// Diameters, one a point, scene units; empty where the file has none.
    pub width: Vec<f32>,
}

/// Curves of a file, told apart by content.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveFile {
    /// "USD", "MCAP", "PLY" or ".hair".
    pub format: &'static str,
    /// Metres per unit, if the file says so.
    pub meters_per_unit: Option<f64>,
    /// Frames in the file; empty where the format has no time.
    pub frames: Vec<f64>,
    /// What was worked around while reading.
    pub warnings: Vec<String>,
    /// One entry a layer.
    pub layers: Vec<CurveSet>,
}

/// First bytes of a file, to tell formats apart.
pub fn signature(path: &Path) -> Result<[u8; 8], FormatError> {
    let mut start = [0u8; 8];
    let failed = |e: std::io::Error| FormatError::new(path, e.to_string());
    let mut input = std::fs::File::open(path).map_err(failed)?;
    let mut have = 0;
    while have < start.len() {
        match std::io::Read::read(&mut input, &mut start[have..]).map_err(failed)? {
            0 => break,
            n => have += n,
        }
    }
    Ok(start)
}

/// Reads the curves of a file at a frame (the first one if none is given).
pub fn read(path: &Path, frame: Option<f64>) -> Result<CurveFile, FormatError> {
    match signature(path)? {
        s if s.starts_with(b"PXR-USDC") || s.starts_with(b"#usda") => read_usd(path, frame),
        s if s.starts_with(b"\x89MCAP") => read_mcap(path, frame),
        s if s.starts_with(b"HAIR") => {
            let c = hair::read_hair(path)?;
            Ok(one(".hair", c))
        }
        _ => Ok(one("PLY", ply::read_curves(path)?)),
    }
}

fn one(format: &'static str, c: ply::Curves) -> CurveFile {
    let layer = CurveSet { name: String::new(), strands: c.strands, width: c.width.unwrap_or_default() };
    CurveFile { format, meters_per_unit: None, frames: Vec::new(), warnings: c.warnings, layers: vec![layer] }
}

fn read_usd(path: &Path, frame: Option<f64>) -> Result<CurveFile, FormatError> {
    let prims = usd::read_curves(path, frame)?;
    let stage = prims.first().map(|p| p.stage.clone());
    let layer = |p: usd::UsdCurves| CurveSet {
        name: p.name,
        strands: Strands {
            offsets: p.offsets,
            origin: p.origin,
            position: p.points,
            root: Vec::new(),
            root_uv: p.root_uv,
            id: p.id,
        },
        width: p.width,
    };
    Ok(CurveFile {
        format: "USD",
        meters_per_unit: stage.as_ref().map(|s| s.meters_per_unit),
        frames: prims.first().map(|p| p.times.clone()).unwrap_or_default(),
        warnings: prims.iter().flat_map(|p| p.notes.iter().cloned()).collect(),
        layers: prims.into_iter().map(layer).collect(),
    })
}

fn read_mcap(path: &Path, frame: Option<f64>) -> Result<CurveFile, FormatError> {
    let mut file = mcap::read_hair_mcap(path)?;
    let facts = file.facts().clone();
    let wanted = frame.unwrap_or_else(|| facts.frames.first().map_or(0.0, |f| f64::from(*f)));
    let index = facts.frames.iter().position(|f| f64::from(*f) == wanted).ok_or_else(|| {
        FormatError::new(path, format!("has no frame {wanted}")).hint("`pelage inspect` lists its frames")
    })?;
    let names: Vec<String> = file.layer_names().map(str::to_owned).collect();
    let mut layers = Vec::new();
    for (i, name) in names.into_iter().enumerate() {
        let (fixed, now) = (file.layer(i)?, file.frame(index, i)?);
        let strands = Strands {
            offsets: fixed.offsets,
            origin: now.origin,
            position: now.position,
            root: Vec::new(),
            root_uv: fixed.root_uv,
            id: fixed.id,
        };
        let width = if now.width.is_empty() { fixed.width } else { now.width };
        layers.push(CurveSet { name, strands, width });
    }
    Ok(CurveFile {
        format: "MCAP",
        meters_per_unit: Some(facts.meters_per_unit),
        frames: facts.frames.iter().map(|f| f64::from(*f)).collect(),
        warnings: Vec::new(),
        layers,
    })
}

impl CurveFile {
    /// All layers as one list of strands relative to the first one's origin; those without ids are numbered.
    pub fn joined(&self) -> Strands {
        let origin = self.layers.first().map_or([0.0; 3], |l| l.strands.origin);
        let mut all = Strands { origin, ..Strands::default() };
        let counts = self.layers.iter().flat_map(|l| l.strands.offsets.counts());
        all.offsets = pelage_geom::Offsets::from_counts(counts);
        for l in &self.layers {
            let to: [f64; 3] = std::array::from_fn(|x| l.strands.origin[x] - origin[x]);
            let placed = |p: &[f32; 3]| std::array::from_fn(|x| (f64::from(p[x]) + to[x]) as f32);
            all.position.extend(l.strands.position.iter().map(placed));
            let before = all.id.len();
            let id = |h: usize| l.strands.id.get(h).copied().unwrap_or((before + h) as u64);
            all.id.extend((0..l.strands.len()).map(id));
        }
        all
    }
}
