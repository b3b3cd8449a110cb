//! The groom file: control hairs, how they are combed, and the layers of hair grown from maps.

use super::cluster::{Cluster, ClusterEdit, ClusterLook, Scalp};
use super::comb::{Comb, NO_HAIR};
use super::control::Control;
use super::document::{ConfigError, Document, Fixed, exactly};
use super::keys::ROOTED;
use super::look::{Clump, Collision, Curl, Emitter, Noise, Operator, Wave, WindLook};
use super::look_value::{LookValue, painted, varied};
use super::simulate::{Material, Target, check_material};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Most points of a hair: a hundred turns of a curl with forty points each.
pub const MOST_POINTS: usize = 4096;

/// A look: control hairs and the layers of hair that follow them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroomFile {
    /// Control hairs: where they stand and what they are before combing.
    pub control: Control,
    /// Lines on the skin across which no hair mixes control hairs.
    #[serde(default)]
    pub parting: Vec<Parting>,
    /// Scalp space: where clusters and growth are drawn.
    #[serde(default)]
    pub scalp: Scalp,
    /// Clusters of hair.
    #[serde(default)]
    pub cluster: Vec<Cluster>,
    /// How clusters are split, braided and copied, in this order.
    #[serde(default)]
    pub cluster_edit: Vec<ClusterEdit>,
    /// Combing, in this order.
    #[serde(default)]
    pub comb: Vec<Comb>,
    /// Particles that open areas of clumped hair.
    #[serde(default)]
    pub emitter: Vec<Emitter>,
    /// Layers of hair: undercoat, overcoat, any number.
    pub layer: Vec<Layer>,
}

/// A line on the skin across which no hair mixes control hairs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parting {
    /// Name, for comb operations that act on one side.
    pub name: String,
    /// Points on or near the rest skin, scene units, in order.
    #[serde(deserialize_with = "points")]
    pub points: Vec<[f64; 3]>,
}

pub(super) fn points<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<[f64; 3]>, D::Error> {
    Ok(Vec::<Fixed<f64, 3>>::deserialize(d)?.into_iter().map(|p| p.0).collect())
}

pub(super) fn some_points<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Vec<[f64; 3]>>, D::Error> {
    points(d).map(Some)
}

/// A map without a value of its own.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapRef {
    /// Image file; `<UDIM>` stands for the tile number.
    pub map: PathBuf,
    /// Channel to read. Default: the grey value.
    #[serde(default)]
    pub channel: Channel,
    /// What the map says outside its square. Default: "clamp".
    #[serde(default)]
    pub wrap: WrapMode,
}

/// Channel of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// The grey value (luminance of a colour image).
    #[default]
    Grey,
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
}

/// What a map says outside its square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrapMode {
    /// The border texel goes on.
    #[default]
    Clamp,
    /// The map repeats.
    Repeat,
}

/// A value, a map that multiplies it, and noise.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Value where the map is 1.
    pub value: f64,
    /// Image that multiplies the value; `<UDIM>` stands for the tile number.
    pub map: Option<PathBuf>,
    /// Channel of the map. Default: the grey value.
    #[serde(default)]
    pub channel: Channel,
    /// What the map says outside its square. Default: "clamp".
    #[serde(default)]
    pub wrap: WrapMode,
    /// Random variation per hair: 0.1 spreads evenly over +-10 %. Default: 0.
    #[serde(default)]
    pub noise: f64,
}

impl Feature {
    /// The same everywhere.
    pub fn constant(value: f64) -> Feature {
        constant(value)
    }

    /// Its map.
    pub fn map(&self) -> Option<MapRef> {
        self.map.clone().map(|map| MapRef { map, channel: self.channel, wrap: self.wrap })
    }
}

/// Render width.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WidthFeature {
    /// Diameter at the root, micrometres, where the map is 1.
    pub value: f64,
    /// Diameter at the tip as a share of the root's, straight from root to tip. Default: 0.3.
    pub tip: Option<f64>,
    /// Instead of `tip`: shares of the diameter at 2 to 16 stations at equal distances from root to tip, straight between
    /// them.
    pub profile: Option<Vec<f64>>,
    /// Image that multiplies the value; `<UDIM>` stands for the tile number.
    pub map: Option<PathBuf>,
    /// Channel of the map. Default: the grey value.
    #[serde(default)]
    pub channel: Channel,
    /// What the map says outside its square. Default: "clamp".
    #[serde(default)]
    pub wrap: WrapMode,
    /// Random variation per hair. Default: 0.
    #[serde(default)]
    pub noise: f64,
}

impl WidthFeature {
    /// Diameter at the tip as a share of the root's, where no profile is given.
    pub fn tip(&self) -> f64 {
        self.tip.unwrap_or(0.3)
    }

    /// Shares of the diameter at stations at equal distances from root to tip.
    pub fn stations(&self) -> Vec<f32> {
        match &self.profile {
            Some(profile) => profile.iter().map(|x| *x as f32).collect(),
            None => vec![1.0, self.tip() as f32],
        }
    }

    /// The part that every feature has.
    pub fn feature(&self) -> Feature {
        let WidthFeature { value, map, channel, wrap, noise, .. } = self.clone();
        Feature { value, map, channel, wrap, noise }
    }
}

/// Hair colour.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColorFeature {
    /// Linear red, green, blue, 0 to 1. Multiplies the map.
    #[serde(deserialize_with = "exactly")]
    pub value: [f64; 3],
    /// Colour image (sRGB if 8 or 16 bit); `<UDIM>` stands for the tile number.
    pub map: Option<PathBuf>,
    /// What the map says outside its square. Default: "clamp".
    #[serde(default)]
    pub wrap: WrapMode,
    /// Random variation of brightness per hair. Default: 0.
    #[serde(default)]
    pub noise: f64,
    /// Factors for red, green and blue at 2 to 16 stations at equal distances from root to tip, straight between them; they
    /// multiply value and map. Default: the same colour from root to tip.
    #[serde(default, deserialize_with = "some_points")]
    pub ramp: Option<Vec<[f64; 3]>>,
}

impl ColorFeature {
    /// Factors at stations at equal distances from root to tip, if there is a ramp.
    pub fn stations(&self) -> Option<Vec<[f32; 3]>> {
        self.ramp.as_ref().map(|ramp| ramp.iter().map(|c| c.map(|x| x as f32)).collect())
    }

    /// Its map.
    pub fn map(&self) -> Option<MapRef> {
        self.map.clone().map(|map| MapRef { map, channel: Channel::default(), wrap: self.wrap })
    }
}

/// Guard hairs: some of a layer's hairs are longer and thicker than the rest.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// Share of the layer's hairs that are guard hairs, 0 to 1. More keeps those that were.
    #[schemars(schema_with = "painted")]
    pub percent: LookValue,
    /// Factor on their length. Default: 1.5.
    #[serde(default = "longer")]
    pub length: f64,
    /// Factor on their render width. Default: 1.6.
    #[serde(default = "thicker")]
    pub width: f64,
}

fn longer() -> f64 {
    1.5
}

fn thicker() -> f64 {
    1.6
}

/// Which of the three control hairs around it a hair follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GuideChoice {
    /// All three, by their weights.
    #[default]
    Blend,
    /// The one of the largest weight.
    Nearest,
    /// One at random, as probable as its weight is large: copies of it.
    Copy,
}

/// A layer of hair.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Name, unique; names the layer's ids and its primitive in exported files.
    pub name: String,
    /// Names of control hairs (or beginnings of names, `whisker*`) that are the hairs of this layer, instead of hairs of a
    /// density: whiskers, lashes.
    #[serde(default)]
    pub hairs: Vec<String>,
    /// Hairs per square centimetre. Required without `hairs`.
    #[serde(default = "unsaid")]
    pub density: Feature,
    /// Hair grows in clusters only. Default: false.
    #[serde(default)]
    pub in_clusters: bool,
    /// Map that turns areas off: multiplies the density.
    pub on_off: Option<MapRef>,
    /// Length, scene units; with `hairs`, a factor on that of the control hairs. Required without them.
    #[serde(default = "unsaid")]
    pub length: Feature,
    /// Which of the three control hairs around it a hair follows. Default: "blend".
    #[serde(default)]
    pub guides: GuideChoice,
    /// Follow control hairs as seen from the skin: their directions turn with it from their roots to the hair's. Default:
    /// false, directions in space.
    #[serde(default)]
    pub root_frames: bool,
    /// Render width. Default: 80 micrometres.
    #[serde(default = "default_width")]
    pub width: WidthFeature,
    /// Opacity, 0 to 1. Default: 1.
    #[serde(default = "default_opacity")]
    pub opacity: Feature,
    /// Colour. Default: brown.
    #[serde(default = "default_color")]
    pub color: ColorFeature,
    /// Some hairs are longer and thicker. Default: none.
    pub guard: Option<Guard>,
    /// Points of a finished hair, the root included. Default: as many as the control hairs have; for hairs simulated one by
    /// one, `simulate.segments` + 1. More of them are laid on a smooth curve.
    pub points: Option<usize>,
    /// What the hair is made of when it is simulated.
    #[serde(default)]
    pub material: Material,
    /// What is simulated of this layer. Default: what the shot says.
    pub simulate: Option<Target>,
    /// Hair takes its place in clusters.
    pub cluster: Option<ClusterLook>,
    /// Levels of clumps, the finest first.
    #[serde(default)]
    pub clump: Vec<Clump>,
    /// Curls.
    pub curl: Option<Curl>,
    /// Waves and noise along four stations of the hair.
    #[serde(default)]
    pub wave: Vec<Wave>,
    /// Noise and frizz.
    #[serde(default)]
    pub noise: Vec<Noise>,
    /// Wind for hair that is not simulated.
    pub wind: Option<WindLook>,
    /// Keeping finished hairs out of the skin.
    #[serde(default)]
    pub collision: Collision,
    /// Order in which the operators act. Default: cluster, clump, curl, wave, noise, wind. Collision comes last.
    pub order: Option<Vec<Operator>>,
}

/// Value that stands for one that is not given, until the layer is checked.
const UNSAID: f64 = f64::MIN;

fn unsaid() -> Feature {
    constant(UNSAID)
}

fn default_width() -> WidthFeature {
    let Feature { value, map, channel, wrap, noise } = constant(80.0);
    WidthFeature { value, tip: None, profile: None, map, channel, wrap, noise }
}

fn default_opacity() -> Feature {
    constant(1.0)
}

fn default_color() -> ColorFeature {
    ColorFeature { value: [0.15, 0.08, 0.04], map: None, wrap: WrapMode::Clamp, noise: 0.1, ramp: None }
}

pub(super) fn constant(value: f64) -> Feature {
    Feature { value, map: None, channel: Channel::Grey, wrap: WrapMode::Clamp, noise: 0.0 }
}

impl GroomFile {
    /// Gives features that a checked file does not say their values: no density and a factor of 1 for hairs by hand.
    pub fn settle(&mut self) {
        for l in self.layer.iter_mut().filter(|l| !l.hairs.is_empty()) {
            l.density = constant(0.0);
            if l.length.value == UNSAID {
                l.length = constant(1.0);
            }
        }
    }
}

impl Document<GroomFile> {
    /// Checks values that types can't, at every key frame.
    pub fn check(&self) -> Result<(), ConfigError> {
        let rooted = |key: &str| key.starts_with("cluster[") && ROOTED.contains(&key.rsplit('.').next().unwrap_or(key));
        if let Some(k) = self.keyed().find(|k| rooted(&k.key)) {
            let help = "its roots stay where they are: key `points`, `width` or `twist`";
            return Err(self.error(&k.key, "can't have key frames", help));
        }
        if let Some(k) = self.keyed().find(|k| k.key.contains("].divider[")) {
            let help = "which hair follows which is the same in all frames: key fields instead";
            return Err(self.error(&k.key, "can't have key frames", help));
        }
        let mut frames: Vec<f64> = self.keyed().flat_map(|k| k.frame.iter().copied()).collect();
        frames.sort_by(f64::total_cmp);
        frames.dedup();
        let mut wrong: Vec<(f64, ConfigError)> =
            frames.into_iter().filter_map(|f| Some((f, self.settled(f).check_now().err()?))).collect();
        // A value is complained of where it is written rather than between.
        let written = |(f, e): &(f64, ConfigError)| {
            let at = e.what.split(": ").next().unwrap_or_default();
            self.keyed().any(|k| k.frame.contains(f) && (k.key.starts_with(at) || at.starts_with(&k.key)))
        };
        match wrong.iter().position(written) {
            Some(k) => Err(wrong.swap_remove(k).1),
            None => self.check_now().and(wrong.into_iter().next().map_or(Ok(()), |(_, e)| Err(e))),
        }
    }

    /// It at every one of some frames, checked: what lies between key frames may be unsound too. Nothing without key frames.
    pub fn frames(&self, frames: impl Iterator<Item = i32>) -> Result<BTreeMap<i32, GroomFile>, ConfigError> {
        let then = |frame: i32| {
            let settled = self.settled(f64::from(frame));
            settled.check_now().map_err(|e| {
                let what = format!("{} (at frame {frame}, between key frames)", e.what);
                ConfigError { what, ..e }
            })?;
            Ok((frame, settled.value))
        };
        frames.filter(|_| self.keyed().next().is_some()).map(then).collect()
    }

    fn check_now(&self) -> Result<(), ConfigError> {
        self.check_control()?;
        for (i, p) in self.value.parting.iter().enumerate() {
            let key = format!("parting[{i}]");
            if p.points.len() < 2 || !p.points.iter().flatten().all(|x| x.is_finite()) {
                return Err(self.error(&format!("{key}.points"), "must be two or more finite points", ""));
            }
            if self.value.parting[..i].iter().any(|q| q.name == p.name) {
                return Err(self.error(&format!("{key}.name"), "is used twice", "name every parting differently"));
            }
        }
        for (i, c) in self.value.comb.iter().enumerate() {
            self.check_comb(&format!("comb[{i}]"), c)?;
        }
        self.check_clusters()?;
        self.check_emitters()?;
        if self.value.layer.is_empty() {
            return Err(self.error("layer", "the groom has no layer", "add a [[layer]]"));
        }
        for (i, l) in self.value.layer.iter().enumerate() {
            let key = format!("layer[{i}]");
            if l.name.is_empty()
                || l.name.chars().any(char::is_control)
                || self.value.layer[..i].iter().any(|m| m.name == l.name)
            {
                return Err(self.error(
                    &format!("{key}.name"),
                    "is empty, used twice or not one line of text",
                    "name every layer differently",
                ));
            }
            self.check_layer(&key, l)?;
        }
        Ok(())
    }

    fn check_layer(&self, key: &str, l: &Layer) -> Result<(), ConfigError> {
        let by_hand = !l.hairs.is_empty();
        let said = |f: &Feature| f.value != UNSAID;
        for (name, given) in [
            ("density", said(&l.density)),
            ("in_clusters", l.in_clusters),
            ("guides", l.guides != GuideChoice::Blend),
            ("on_off", l.on_off.is_some()),
        ] {
            if by_hand && given {
                return Err(self.error(
                    &format!("{key}.{name}"),
                    "is not read beside `hairs`",
                    "take one of the two out",
                ));
            }
        }
        for (name, f) in [("density", &l.density), ("length", &l.length)] {
            if !by_hand && !said(f) {
                return Err(self.error(key, format!("needs `{name}`"), "or `hairs`, for hairs placed one by one"));
            }
        }
        if let Some(n) = l.hairs.iter().find(|n| !self.has_hair(n)) {
            return Err(self.error(&format!("{key}.hairs"), format!("there is no hair `{n}`"), NO_HAIR));
        }
        if by_hand {
            let length = if l.length.value == UNSAID { &constant(1.0) } else { &l.length };
            self.feature(&format!("{key}.length"), length, 1e3)?;
        } else {
            self.feature(&format!("{key}.density"), &l.density, 1e5)?;
            self.feature(&format!("{key}.length"), &l.length, 1e6)?;
        }
        self.feature(&format!("{key}.width"), &l.width.feature(), 1e6)?;
        self.check_width(&format!("{key}.width"), &l.width)?;
        self.feature(&format!("{key}.opacity"), &l.opacity, 1.0)?;
        for (i, x) in l.color.value.iter().enumerate() {
            self.within(&format!("{key}.color.value[{i}]"), *x, 0.0, 1e3)?;
        }
        self.within(&format!("{key}.color.noise"), l.color.noise, 0.0, 1.0)?;
        if let Some(ramp) = &l.color.ramp {
            self.stations(&format!("{key}.color.ramp"), ramp.len())?;
            for (i, x) in ramp.iter().enumerate().flat_map(|(i, c)| c.iter().map(move |x| (i, *x))) {
                self.within(&format!("{key}.color.ramp[{i}]"), x, 0.0, 1e3)?;
            }
        }
        if let Some(g) = &l.guard {
            let percent = format!("{key}.guard.percent");
            self.check_value(&percent, &varied("", &g.percent, [0.0, 1.0]))?;
            self.still(&percent, &g.percent)?;
            for (name, x) in [("length", g.length), ("width", g.width)] {
                self.within(&format!("{key}.guard.{name}"), x, 0.0, 1e3)?;
            }
        }
        check_material(self, &format!("{key}.material"), &l.material)?;
        self.check_look(key, l)?;
        self.points(&format!("{key}.points"), l.points)
    }

    fn check_width(&self, key: &str, w: &WidthFeature) -> Result<(), ConfigError> {
        self.within(&format!("{key}.tip"), w.tip(), 0.0, 10.0)?;
        let Some(profile) = &w.profile else { return Ok(()) };
        let key = format!("{key}.profile");
        if w.tip.is_some() {
            return Err(self.error(&key, "says what `tip` says too", "take out one of the two"));
        }
        self.stations(&key, profile.len())?;
        profile.iter().enumerate().try_for_each(|(i, x)| self.within(&format!("{key}[{i}]"), *x, 0.0, 10.0))
    }

    /// Stations from root to tip.
    fn stations(&self, key: &str, count: usize) -> Result<(), ConfigError> {
        if (2..=16).contains(&count) {
            return Ok(());
        }
        Err(self.error(
            key,
            format!("has {count} stations"),
            "give 2 to 16, the first for the root, the last for the tip",
        ))
    }

    pub(super) fn feature(&self, key: &str, f: &Feature, max: f64) -> Result<(), ConfigError> {
        self.within(&format!("{key}.value"), f.value, 0.0, max)?;
        self.within(&format!("{key}.noise"), f.noise, 0.0, 1.0)
    }

    pub(super) fn points(&self, key: &str, points: Option<usize>) -> Result<(), ConfigError> {
        match points {
            Some(n) if !(2..=MOST_POINTS).contains(&n) => {
                Err(self.error(key, format!("must be between 2 and {MOST_POINTS}"), "8 to 16 is usual"))
            }
            _ => Ok(()),
        }
    }
}
