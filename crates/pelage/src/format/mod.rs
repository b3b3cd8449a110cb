//! File formats, each a module that reads or writes plain data.

mod bytes;
mod check;
pub mod csv;
pub mod hair;
pub mod image;
pub mod mcap;
pub mod nurbs;
pub mod ply;
pub mod usd;

use std::path::{Path, PathBuf};

/// Something wrong in a file: which file, where in it, what was expected, what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{}: {what}", path.display(), at.as_ref().map(|a| format!(" ({a})")).unwrap_or_default())]
pub struct FormatError {
    /// The file.
    pub path: PathBuf,
    /// Line, element or byte, in words ("line 12", "vertex 7, property x"); `None` for the file as a whole.
    pub at: Option<String>,
    /// What is wrong and what was expected.
    pub what: String,
    /// What the user can do; empty if there is nothing to add.
    pub hint: String,
}

impl FormatError {
    /// An error about a file as a whole.
    pub fn new(path: &Path, what: impl Into<String>) -> Self {
        FormatError { path: path.to_path_buf(), at: None, what: what.into(), hint: String::new() }
    }

    /// The same error with a place in the file.
    pub fn at(mut self, at: impl Into<String>) -> Self {
        self.at = Some(at.into());
        self
    }

    /// The same error with advice.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }
}

/// Facts of a shot that every exported file states.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotFacts {
    /// Name of the shot.
    pub name: String,
    /// Metres per scene unit.
    pub meters_per_unit: f64,
    /// "Y" or "Z".
    pub up: char,
    /// Frames per second.
    pub fps: f64,
    /// Frames in the file, ascending.
    pub frames: Vec<i32>,
    /// Scene-space point that all positions are relative to (usually zero).
    pub origin: [f64; 3],
    /// Names of the lights whose transmittance frames have, in the order of its columns: letters, digits, `_`, `-`.
    pub lights: Vec<String>,
    /// Further facts as (name, value): version, groom, hash of the configuration.
    pub extra: Vec<(String, String)>,
}

/// What does not change over a shot, for one layer of hair. V points in C curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HairLayer {
    /// Name of the layer.
    pub name: String,
    /// C runs of points.
    pub offsets: pelage_geom::Offsets,
    /// Stable names, C.
    pub id: Vec<u64>,
    /// Root texture coordinates, C.
    pub root_uv: Vec<[f32; 2]>,
    /// Polygon of the skin file that each root lies on, C (empty without a skin).
    pub skin_face: Vec<i32>,
    /// Where on its triangle: barycentric weights of the second and third corner, C (empty without a skin).
    pub skin_bary: Vec<[f32; 2]>,
    /// Points at the rest pose, scene units relative to the origin, V.
    pub rest: Vec<[f32; 3]>,
    /// Diameters, scene units, V.
    pub width: Vec<f32>,
    /// Linear colours: C (one a curve) or V (one a point).
    pub color: Vec<[f32; 3]>,
    /// Opacities in [0, 1], C.
    pub opacity: Vec<f32>,
}

impl ShotFacts {
    /// Names of the columns of transmittance.
    pub fn shadow_columns(&self) -> Vec<String> {
        let each = self.lights.iter().map(|l| format!("transmittance:{l}"));
        if self.lights.is_empty() { vec![] } else { std::iter::once("transmittance".to_owned()).chain(each).collect() }
    }
}

impl HairLayer {
    /// Whether it has a colour for each point, not for each curve. (A curve has two points or more, so that a count
    /// says which; a layer without curves has none of either.)
    pub fn color_per_point(&self) -> bool {
        self.color.len() > self.offsets.len()
    }
}

/// One layer at one frame: V positions (scene units relative to the origin) and V velocities (scene units a second),
/// and what of the layer is another at this frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct HairFrame<'a> {
    /// Positions, root first.
    pub position: &'a [[f32; 3]],
    /// Velocities at the same points.
    pub velocity: &'a [[f32; 3]],
    /// Diameters at this frame, scene units, V; empty: those of the layer.
    pub width: &'a [f32],
    /// Opacities at this frame in [0, 1], C; empty: those of the layer.
    pub opacity: &'a [f32],
    /// The part of the light that arrives, in [0, 1], V values each: of all lights together, then of each light of the
    /// facts. Empty if the facts name none.
    pub transmittance: &'a [Vec<f32>],
}
