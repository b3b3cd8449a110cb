//! What a shot does without: `[skip]`.

use super::document::{ConfigError, Document};
use super::groom::MapRef;
use super::shot::ShotFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// Hair that this shot does without. What is left is the same hair: it is chosen once, for all frames, so nothing pops.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Skip {
    /// Leave out hair that `preview.camera` sees at no frame of the shot: out of the picture, or behind the skin. Default: false.
    pub camera: bool,
    /// Map over the skin: hair is made where it is 0.5 or more, and left out where it is less. Default: all hair is made.
    pub mask: Option<MapRef>,
    /// Pixels that hair should be wide in the picture of `preview.camera` where it comes nearest: of hair that is narrower a
    /// part is made, as much wider as it is less, down to a 64th. 0.25 covers as much within 2 %; with 1 single hairs show.
    /// Default: all hair is made.
    pub lod: Option<f64>,
    /// Scene units around what is seen, or under the mask, in which hair is made all the same, for the shadows that it throws.
    /// Default: 2 cm.
    pub margin: Option<f64>,
}

/// Hair that throws shadows on what is seen stands no farther away, metres. At half of it thick fur at the border of the
/// picture is brighter than it should be; at twice as much little is left out of a close view.
const MARGIN: f64 = 0.02;

impl Skip {
    /// True if hair may be left out.
    pub fn any(&self) -> bool {
        self.sees() || self.mask.is_some()
    }

    /// True if the camera decides.
    pub fn sees(&self) -> bool {
        self.camera || self.lod.is_some()
    }

    /// The margin in scene units.
    pub fn margin(&self, meters_per_unit: f64) -> f64 {
        self.margin.unwrap_or(MARGIN / meters_per_unit)
    }
}

impl Document<ShotFile> {
    pub(super) fn check_skip(&self) -> Result<(), ConfigError> {
        let s = &self.value.skip;
        let bad = |key: &str, what: &str, help: &str| Err(self.error(key, what, help));
        if s.any() && self.value.groom.curves.is_some() {
            return bad("skip", "is for hair of a groom; this shot takes its hair from a curves file", "take it out");
        }
        let by_camera = [("skip.camera", s.camera), ("skip.lod", s.lod.is_some())];
        if let Some((key, _)) = by_camera.iter().find(|(_, on)| *on && self.value.preview.camera.is_none()) {
            let help = "say where the camera stands: [preview.camera] with eye and target";
            return bad(key, "needs the shot's camera, and there is none", help);
        }
        if s.lod.is_some_and(|x| !(x > 0.0 && x <= 1000.0)) {
            return bad("skip.lod", "must be above 0 and at most 1000 pixels", "0.25 is usual");
        }
        if s.margin.is_some_and(|x| !(x >= 0.0 && x.is_finite())) {
            return bad("skip.margin", "must be 0 or more", "in scene units");
        }
        Ok(())
    }
}
