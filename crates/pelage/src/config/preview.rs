//! Pictures of a shot: `[preview]`.

use super::document::{ConfigError, Document, exactly, some_exactly};
use super::keyed::{Keyed, Vector};
use super::shot::ShotFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// Pictures to write.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Preview {
    /// Frame of the still. Default: the middle of the shot.
    pub frame: Option<i32>,
    /// Width and height in pixels. Default: `[1280, 960]`.
    #[serde(deserialize_with = "exactly")]
    pub size: [u32; 2],
    /// Direction from the subject to the camera. Default: from the front, a little to the side and above.
    #[serde(deserialize_with = "some_exactly")]
    pub from: Option<[f64; 3]>,
    /// Zoom on the subject: 1 frames all of the skin and hair, 2 shows half of that. Default: 1.
    pub zoom: Option<f64>,
    /// A camera that stands where it is told, instead of `from` and `zoom`.
    pub camera: Option<CameraSettings>,
    /// Pictures in the contact sheet of `pelage preview`. Default: 8.
    pub sheet: u32,
    /// Pictures of `pelage preview --turntable`. Default: 24.
    pub turntable: u32,
    /// Stops by which pictures are brighter than the light says. Default: 0.
    pub exposure: f64,
    /// How light becomes the values of a picture. Default: "shoulder".
    pub tone: PreviewTone,
    /// Part of its width that the farthest hair loses, nearer hair less, 0 up to 1 (not included). Default: 0.
    pub depth_cue: f64,
    /// How hair is shaded.
    pub shade: Shade,
}

impl Default for Preview {
    fn default() -> Self {
        Preview {
            frame: None,
            size: [1280, 960],
            from: None,
            zoom: None,
            camera: None,
            sheet: 8,
            turntable: 24,
            exposure: 0.0,
            tone: PreviewTone::default(),
            depth_cue: 0.0,
            shade: Shade::default(),
        }
    }
}

impl Preview {
    /// Direction from the subject to an automatic camera.
    pub fn from(&self) -> [f64; 3] {
        self.from.unwrap_or([0.5, 0.15, 1.0])
    }

    /// Zoom of an automatic camera.
    pub fn zoom(&self) -> f64 {
        self.zoom.unwrap_or(1.0)
    }
}

/// A camera; scene units.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Where it stands: three numbers, or key frames.
    pub eye: Keyed<Vector>,
    /// What is in the middle of the picture: three numbers, or key frames.
    pub target: Keyed<Vector>,
    /// Direction that is up in the picture. Default: that of the shot.
    #[serde(default, deserialize_with = "some_exactly")]
    pub up: Option<[f64; 3]>,
    /// Angle between the lower and the upper border, degrees: a number, or key frames. Default: 28.
    #[serde(default = "portrait")]
    pub fov: Keyed<f64>,
}

fn portrait() -> Keyed<f64> {
    Keyed::constant(28.0)
}

/// How light becomes the values of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PreviewTone {
    /// Straight, then a shoulder: highlights keep their shape.
    #[default]
    Shoulder,
    /// Straight, cut off at white.
    Straight,
}

/// How hair is shaded in pictures.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Shade {
    /// How much of the skin's shading a hair takes that stands up, 0 to 1: 0 shades each hair by its own direction (Kajiya and
    /// Kay), 1 gives fur the form of the body. Default: 0.8.
    pub fur: f64,
    /// Factor of the highlights. Default: 1.
    pub specular: f64,
    /// Light that comes through a hair from behind, relative to what it sends back. Default: 0.6.
    pub through: f64,
    /// Factor of the first highlight, that of the light's colour, of guard hairs. Default: 1.5.
    pub guard: f64,
    /// How wet all hair looks, 0 to 1; hair in wet areas is wet without it. Wet hair shines, and clumps are bright on the
    /// side of a light and dark on the other. Default: 0.
    pub wetness: f64,
}

impl Default for Shade {
    fn default() -> Self {
        Shade { fur: 0.8, specular: 1.0, through: 0.6, guard: 1.5, wetness: 0.0 }
    }
}

impl Document<ShotFile> {
    /// Checks `[preview]`.
    pub(super) fn check_preview(&self) -> Result<(), ConfigError> {
        let (p, frames) = (&self.value.preview, self.value.shot.frames);
        let bad = |key: &str, what: &str, help: &str| Err(self.error(key, what, help));
        if let Some(f) = p.frame.filter(|f| !(frames[0]..=frames[1]).contains(f)) {
            let help = format!("the shot goes from {} to {}", frames[0], frames[1]);
            return Err(self.error("preview.frame", format!("{f} is not a frame of the shot"), help));
        }
        if p.size.iter().any(|&x| !(16..=8192).contains(&x)) {
            return bad("preview.size", "must be between 16 and 8192 pixels", "");
        }
        if p.from.is_some_and(|from| !from.iter().all(|x| x.is_finite()) || from == [0.0; 3]) {
            return bad("preview.from", "must be a direction", "for example [0.0, 0.0, 1.0]");
        }
        if p.zoom.is_some_and(|zoom| !(zoom.is_finite() && zoom > 0.0)) {
            return bad("preview.zoom", "must be above 0", "1 shows everything");
        }
        for (key, pictures, most) in [("preview.sheet", p.sheet, 100), ("preview.turntable", p.turntable, 1000)] {
            if !(1..=most).contains(&pictures) {
                return bad(key, &format!("must be between 1 and {most} pictures"), "");
            }
        }
        let s = &p.shade;
        for (key, value, least, most) in [
            ("exposure", p.exposure, -20.0, 20.0),
            ("depth_cue", p.depth_cue, 0.0, 0.99),
            ("shade.fur", s.fur, 0.0, 1.0),
            ("shade.specular", s.specular, 0.0, 100.0),
            ("shade.through", s.through, 0.0, 10.0),
            ("shade.guard", s.guard, 0.0, 100.0),
            ("shade.wetness", s.wetness, 0.0, 1.0),
        ] {
            self.within(&format!("preview.{key}"), value, least, most)?;
        }
        p.camera.as_ref().map_or(Ok(()), |c| self.check_camera(c))
    }

    fn check_camera(&self, c: &CameraSettings) -> Result<(), ConfigError> {
        let p = &self.value.preview;
        for (key, given) in [("from", p.from.is_some()), ("zoom", p.zoom.is_some())] {
            if given {
                let what = "is not read where the shot has a camera";
                return Err(self.error(&format!("preview.{key}"), what, "take out one of the two"));
            }
        }
        for (key, keyed) in [("eye", &c.eye), ("target", &c.target)] {
            let at = format!("preview.camera.{key}");
            self.check_keys(&at, keyed)?;
            if !keyed.0.iter().all(|k| k.value.0.iter().all(|x| x.abs() <= 1e15)) {
                return Err(self.error(&at, "must be finite numbers", "scene units"));
            }
        }
        self.check_keys("preview.camera.fov", &c.fov)?;
        c.fov.0.iter().try_for_each(|k| self.within("preview.camera.fov", k.value, 0.1, 170.0))?;
        if c.up.is_some_and(|up| !up.iter().all(|x| x.is_finite()) || up == [0.0; 3]) {
            return Err(self.error("preview.camera.up", "must be a direction", "for example [0.0, 1.0, 0.0]"));
        }
        let frames = self.value.shot.frames[0]..=self.value.shot.frames[1];
        let keys = c.eye.0.iter().chain(&c.target.0).map(|k| k.frame);
        let ends = [*frames.start(), *frames.end()].map(f64::from);
        for frame in keys.chain(ends) {
            if c.eye.vectors().at(frame) == c.target.vectors().at(frame) {
                let what = format!("is where the target is, at frame {frame}");
                return Err(self.error("preview.camera.eye", what, "a camera needs a distance"));
            }
        }
        Ok(())
    }
}
