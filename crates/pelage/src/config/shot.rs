//! The shot file, `pipeline.toml`.

use super::document::{ConfigError, Document, exactly};
use super::keyed::Keyed;
use super::light::{Light, Shadow};
use super::look::Operator;
use super::preview::Preview;
use super::simulate::{Simulate, Target};
use super::skip::Skip;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::PathBuf;

/// A shot: a skin in motion, the groom it wears, and what to write.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShotFile {
    /// What the shot is.
    pub shot: Shot,
    /// The surface that hair grows on. Hair from a curves file needs none.
    pub skin: Option<Skin>,
    /// The look: a groom, or hair from a curves file.
    pub groom: GroomRef,
    /// How hair is simulated.
    #[serde(default)]
    pub simulate: Simulate,
    /// What this shot changes of the groom's look.
    #[serde(default)]
    pub look: Look,
    /// Lights, by which shadows are made for files and pictures.
    #[serde(default)]
    pub light: Vec<Light>,
    /// How shadows are made.
    #[serde(default)]
    pub shadow: Shadow,
    /// Files to write.
    #[serde(default)]
    pub export: Export,
    /// Pictures to write.
    #[serde(default)]
    pub preview: Preview,
    /// Hair that this shot does without.
    #[serde(default)]
    pub skip: Skip,
    /// Where finished steps are kept.
    #[serde(default)]
    pub cache: CacheSettings,
}

/// What the shot is.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shot {
    /// Name; outputs go to a folder of that name.
    pub name: String,
    /// First and last frame, both included.
    #[serde(deserialize_with = "exactly")]
    pub frames: [i32; 2],
    /// Frames per second.
    pub fps: f64,
    /// Metres per scene unit: 1 for metres, 0.01 for centimetres.
    pub meters_per_unit: f64,
    /// The axis that points up. Default: "y".
    #[serde(default)]
    pub up: UpAxis,
    /// Frames that are simulated before the first one, from the rest pose on. Default: 12; 0 without a skin.
    pub preroll: Option<u32>,
}

/// The axis that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// +y.
    #[default]
    Y,
    /// +z.
    Z,
}

/// The surface that hair grows on: a rest pose, and either no motion, a rigid motion, or one file per frame.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Skin {
    /// PLY of the rest pose, with texture coordinates.
    pub rest: PathBuf,
    /// CSV of a rigid motion: time_s, tx, ty, tz (metres), qx, qy, qz, qw, from the rest pose.
    pub motion: Option<PathBuf>,
    /// The frame at which the motion's time is 0. Default: the shot's first frame.
    pub motion_start: Option<f64>,
    /// Point in scene units that the motion's rotation leaves in place. Default: the origin.
    #[serde(default, deserialize_with = "exactly")]
    pub pivot: [f64; 3],
    /// PLY per frame with the rest pose's vertices, `#` standing for the frame number: "anim/bust.####.ply".
    pub frames: Option<PathBuf>,
}

/// Where hair comes from: exactly one of `file` and `curves`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroomRef {
    /// The groom file.
    pub file: Option<PathBuf>,
    /// Curves (USD, PLY or .hair) that are the hair, instead of a groom. Bound to the skin if there is one.
    pub curves: Option<PathBuf>,
    /// Curves without a skin: CSV of a rigid motion of their roots, as for `skin.motion`. Default: they stay.
    pub motion: Option<PathBuf>,
    /// The frame at which that motion's time is 0. Default: the shot's first frame.
    pub motion_start: Option<f64>,
    /// Point in scene units that the motion's rotation leaves in place. Default: the origin.
    #[serde(default, deserialize_with = "exactly")]
    pub pivot: [f64; 3],
}

/// What a shot changes of the look of its groom.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Look {
    /// Let hair take its place in clusters. Default: true.
    pub cluster: bool,
    /// Clump hair. Default: true.
    pub clump: bool,
    /// Curl it. Default: true.
    pub curl: bool,
    /// Wave it. Default: true.
    pub wave: bool,
    /// Add noise. Default: true.
    pub noise: bool,
    /// Blow. Default: true.
    pub wind: bool,
    /// Keep finished hairs out of the skin. Default: true.
    pub collision: bool,
    /// Clumping of this shot.
    #[serde(rename = "override")]
    pub overrides: Vec<LookOverride>,
}

impl Default for Look {
    fn default() -> Self {
        Look {
            cluster: true,
            clump: true,
            curl: true,
            wave: true,
            noise: true,
            wind: true,
            collision: true,
            overrides: Vec::new(),
        }
    }
}

impl Look {
    /// True if an operator acts in this shot.
    pub fn has(&self, operator: Operator) -> bool {
        match operator {
            Operator::Cluster => self.cluster,
            Operator::Clump => self.clump,
            Operator::Curl => self.curl,
            Operator::Wave => self.wave,
            Operator::Noise => self.noise,
            Operator::Wind => self.wind,
        }
    }
}

/// Percent and rate of a level of clumps in this shot.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LookOverride {
    /// Name of the layer.
    pub layer: String,
    /// Number of the level, from 0. Default: 0.
    #[serde(default)]
    pub clump: usize,
    /// Percent instead of the groom's; its map and variation stay.
    pub percent: Option<Keyed<f64>>,
    /// Rate instead of the groom's; its map and variation stay.
    pub rate: Option<Keyed<f64>>,
}

/// Files to write.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Export {
    /// Formats. Default: `["usd"]`.
    pub formats: Vec<ExportFormat>,
    /// Folder that holds the folder of the shot. Default: "out".
    pub dir: PathBuf,
}

impl Default for Export {
    fn default() -> Self {
        Export { formats: vec![ExportFormat::Usd], dir: "out".into() }
    }
}

/// A file format for finished hair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ExportFormat {
    /// OpenUSD, `hair.usdc`: one file, all frames.
    Usd,
    /// MCAP with protobuf messages, `hair.mcap`: one file, all frames.
    Mcap,
    /// PLY, `hair.####.ply`: one file per frame.
    Ply,
}

/// Where finished steps are kept.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CacheSettings {
    /// Folder. Default: ".pelage-cache".
    pub dir: PathBuf,
}

impl Default for CacheSettings {
    fn default() -> Self {
        CacheSettings { dir: ".pelage-cache".into() }
    }
}

impl Document<ShotFile> {
    /// Checks values that types can't.
    pub fn check(&self) -> Result<(), ConfigError> {
        let s = &self.value;
        let bad = |key: &str, what: &str, help: &str| Err(self.error(key, what, help));
        let name_ok = |c: char| c.is_alphanumeric() || "-_. ".contains(c);
        if s.shot.name.is_empty() || !s.shot.name.chars().all(name_ok) || s.shot.name.starts_with('.') {
            return bad("shot.name", "is not a folder name", "use letters, digits, '-', '_' and '.'");
        }
        if s.shot.frames[0] > s.shot.frames[1] {
            return bad("shot.frames", "the last frame comes before the first", "write [first, last]");
        }
        if i64::from(s.shot.frames[1]) - i64::from(s.shot.frames[0]) >= 1_000_000 {
            return bad("shot.frames", "is more than a million frames", "write [first, last]");
        }
        if !(1e-6..=1e6).contains(&s.shot.fps) {
            return bad("shot.fps", "must be between 0.000001 and 1000000", "24 is film");
        }
        if !(1e-9..=1e9).contains(&s.shot.meters_per_unit) {
            return bad("shot.meters_per_unit", "must be between 1e-9 and 1e9", "1 for metres, 0.01 for centimetres");
        }
        if s.shot.preroll.is_some_and(|n| n > 100_000) {
            return bad("shot.preroll", "is more than 100000 frames", "12 is usual");
        }
        self.check_hair()?;
        if s.export.formats.iter().enumerate().any(|(i, f)| s.export.formats[..i].contains(f)) {
            return bad("export.formats", "names a format twice", "");
        }
        self.check_preview()?;
        self.check_lights()?;
        self.check_skip()?;
        self.check_simulate()
    }

    /// Checks `[skin]` and `[groom]`.
    fn check_hair(&self) -> Result<(), ConfigError> {
        let s = &self.value;
        let bad = |key: &str, what: &str, help: &str| Err(self.error(key, what, help));
        if let Some(skin) = &s.skin {
            if skin.motion.is_some() && skin.frames.is_some() {
                return bad("skin.motion", "can't go together with skin.frames", "keep one of the two");
            }
            self.check_motion("skin", skin.motion_start, skin.pivot)?;
            if skin.frames.as_ref().is_some_and(|f| f.to_string_lossy().matches('#').count() == 0) {
                return bad("skin.frames", "has no # for the frame number", "write for example \"anim/bust.####.ply\"");
            }
        }
        let g = &s.groom;
        self.check_motion("groom", g.motion_start, g.pivot)?;
        match (&g.file, &g.curves) {
            (Some(_), Some(_)) => {
                return bad("groom.curves", "can't go together with groom.file", "keep one of the two");
            }
            (None, None) => return bad("groom", "does not say where hair comes from", "give `file` or `curves`"),
            (Some(_), None) if s.skin.is_none() => {
                return bad("groom.file", "a groom needs a skin", "add [skin] with rest = \"mesh.ply\"");
            }
            _ => {}
        }
        if g.motion.is_some() && (s.skin.is_some() || g.curves.is_none()) {
            return bad("groom.motion", "moves curves without a skin only", "write skin.motion");
        }
        if s.simulate.material.is_some() && g.curves.is_none() {
            return bad(
                "simulate.material",
                "is for hair from a curves file",
                "write layer.material in the groom file",
            );
        }
        if s.simulate.target == Target::ControlHairs && g.curves.is_some() {
            return bad("simulate.target", "hair from a curves file has no control hairs", "write \"every-hair\"");
        }
        Ok(())
    }

    pub(super) fn check_motion(&self, table: &str, start: Option<f64>, pivot: [f64; 3]) -> Result<(), ConfigError> {
        if start.is_some_and(|x| !x.is_finite()) {
            let help = "it is the frame at which the motion's time is 0";
            return Err(self.error(&format!("{table}.motion_start"), "must be a finite number", help));
        }
        if !pivot.iter().all(|x| x.is_finite()) {
            return Err(self.error(&format!("{table}.pivot"), "must be three finite numbers", ""));
        }
        Ok(())
    }
}
