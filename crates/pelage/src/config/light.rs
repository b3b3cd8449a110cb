//! Lights of a shot, and how well their shadows are known: `[[light]]` and `[shadow]`.

use super::document::{ConfigError, Document, exactly, some_exactly};
use super::keyed::{Keyed, Vector};
use super::shot::ShotFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// A light.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Name, in the columns of exported files: letters, digits, `_` and `-`.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
    /// The way the light travels, along the scene's axes: three numbers, or key frames. Directional lights and spots.
    pub direction: Option<Keyed<Vector>>,
    /// Where it is, scene units: three numbers, or key frames. Points and spots.
    pub position: Option<Keyed<Vector>>,
    /// Angle between a spot's axis and its border, degrees: a number, or key frames. Default: 30.
    pub cone: Option<Keyed<f64>>,
    /// Part of a spot's cone over which it fades to the border, 0 to 1. Default: 0.2.
    pub softness: Option<f64>,
    /// Brightness: a number, or key frames. It weighs the light among the others and draws the preview; transmittance does
    /// not depend on it. Default: 1.
    #[serde(default = "one")]
    pub intensity: Keyed<f64>,
    /// Linear colour. Default: white.
    #[serde(default = "white", deserialize_with = "exactly")]
    pub color: [f64; 3],
    /// Degrees beyond a right angle up to which it lights fur in pictures, 0 to 90: a light from behind reaches round the body.
    /// Default: 0.
    #[serde(default)]
    pub wrap: f64,
    /// First and last frame at which it is on. Default: always.
    #[serde(default, deserialize_with = "some_exactly")]
    pub frames: Option<[i32; 2]>,
    /// Write its column. Default: true. A light that no file and no picture uses costs nothing.
    #[serde(default = "yes")]
    pub export: bool,
}

fn one() -> Keyed<f64> {
    Keyed::constant(1.0)
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn yes() -> bool {
    true
}

/// What a light is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// Parallel light, as from the sun.
    Directional,
    /// From a point to all sides.
    Point,
    /// From a point into a cone.
    Spot,
}

impl Light {
    /// Angle between a spot's axis and its border at a frame, degrees.
    pub fn border(&self, frame: i32) -> f64 {
        self.cone.as_ref().map_or(30.0, |c| c.at(f64::from(frame)))
    }

    /// Part of a spot's cone over which it fades.
    pub fn fade(&self) -> f64 {
        self.softness.unwrap_or(0.2)
    }

    /// True if it is on at a frame.
    pub fn is_on(&self, frame: i32) -> bool {
        self.frames.is_none_or(|[a, b]| (a..=b).contains(&frame))
    }
}

/// How shadows are made.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Shadow {
    /// How well: settings of measured error. Default: "default".
    pub quality: Option<ShadowQuality>,
    /// Instead: the error of transmittance that is wanted (root mean square), from which the tool takes the cheapest settings
    /// that it has measured to reach it.
    pub error: Option<f64>,
    /// Part of its length by which dense, long hair is shortened where it casts shadows, 0 to 0.95, thinner fur by less:
    /// lightens white fur, in which light goes round in ways that are not computed. What arrives is then no longer what
    /// physics says. Default: 0.
    pub shorten: f64,
}

/// Settings of shadows by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShadowQuality {
    /// For a first look: half the default's texels each way.
    Draft,
    /// Where the measured curve of error against time bends.
    #[default]
    Default,
    /// Twice the default's texels each way, for close-ups.
    Fine,
    /// By rays against every hair: exact, and hundreds of times slower.
    Reference,
}

/// A light's name as every format has it.
pub fn column(name: &str) -> String {
    name.replace('-', "_").to_ascii_lowercase()
}

impl Document<ShotFile> {
    /// Checks lights.
    pub(super) fn check_lights(&self) -> Result<(), ConfigError> {
        for (i, l) in self.value.light.iter().enumerate() {
            let at = format!("light[{i}]");
            self.check_light(&at, l)?;
            if self.value.light[..i].iter().any(|o| column(&o.name) == column(&l.name)) {
                return Err(self.error(&format!("{at}.name"), "is used twice", "name every light differently"));
            }
        }
        let s = &self.value.shadow;
        self.within("shadow.shorten", s.shorten, 0.0, 0.95)?;
        if let Some(error) = s.error {
            if !(1e-4..=1.0).contains(&error) {
                let what = format!("{error} is out of range");
                return Err(self.error("shadow.error", what, "it is an error of a fraction: 0.0001 to 1"));
            }
            if s.quality.is_some() {
                return Err(self.error("shadow.error", "stands beside `quality`", "keep one of the two"));
            }
        }
        Ok(())
    }

    fn check_light(&self, at: &str, l: &Light) -> Result<(), ConfigError> {
        let name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if l.name.is_empty() || !l.name.chars().all(name) {
            let help = "use letters, digits, `_` and `-`: it names columns of files";
            return Err(self.error(&format!("{at}.name"), "can't be the name of a column", help));
        }
        let (directed, placed, spot) = match l.kind {
            LightKind::Directional => (true, false, false),
            LightKind::Point => (false, true, false),
            LightKind::Spot => (true, true, true),
        };
        for (key, has, wanted) in [
            ("direction", l.direction.is_some(), directed),
            ("position", l.position.is_some(), placed),
            ("cone", l.cone.is_some(), spot && l.cone.is_some()),
            ("softness", l.softness.is_some(), spot && l.softness.is_some()),
        ] {
            if has && !wanted {
                return Err(self.error(&format!("{at}.{key}"), "is not read for this kind of light", "take it out"));
            }
            if wanted && !has {
                return Err(self.error(
                    at,
                    format!("this kind of light needs `{key}`"),
                    "three numbers, or key frames",
                ));
            }
        }
        for (key, keyed) in [("direction", &l.direction), ("position", &l.position)] {
            let Some(keyed) = keyed else { continue };
            let fine = |v: &Vector| v.0.iter().all(|x| x.abs() <= 1e18) && (key == "position" || v.0 != [0.0; 3]);
            if !keyed.0.iter().all(|k| fine(&k.value)) {
                let what = if key == "position" { "must be finite numbers, up to 1e18" } else { "must be a direction" };
                return Err(self.error(&format!("{at}.{key}"), what, "for example [0.0, -1.0, 0.0]"));
            }
            self.check_keys(&format!("{at}.{key}"), keyed)?;
        }
        for (key, keyed, most) in [("cone", l.cone.as_ref(), 90.0), ("intensity", Some(&l.intensity), 1e9)] {
            let Some(keyed) = keyed else { continue };
            let least = if key == "cone" { 0.01 } else { 0.0 };
            for k in &keyed.0 {
                self.within(&format!("{at}.{key}"), k.value, least, most)?;
            }
            self.check_keys(&format!("{at}.{key}"), keyed)?;
        }
        self.within(&format!("{at}.softness"), l.softness.unwrap_or(0.0), 0.0, 1.0)?;
        self.within(&format!("{at}.wrap"), l.wrap, 0.0, 90.0)?;
        l.color.iter().try_for_each(|c| self.within(&format!("{at}.color"), *c, 0.0, 1e6))?;
        if l.frames.is_some_and(|[a, b]| a > b) {
            return Err(self.error(&format!("{at}.frames"), "the last frame comes before the first", "first, last"));
        }
        Ok(())
    }
}
