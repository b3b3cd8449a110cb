//! What displaces hairs after they are interpolated or simulated: `[[layer.clump]]`, `[layer.curl]`, `[[layer.wave]]`,
//! `[[layer.noise]]`, `[layer.wind]`, `[layer.collision]` and `[[emitter]]` of the groom file, `[look]` of the shot file.

use super::document::{ConfigError, Document, Fixed, exactly};
use super::simulate::{Keyed, Vector};
use super::{Channel, GroomFile, Layer, MapRef, WrapMode};
use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::path::PathBuf;

/// A number, key frames, or a table with a map and variation: `0.7`, `[{ frame = 1001, value = 0 }, ...]`,
/// `{ value = 0.7, map = "../maps/wet.png" }`.
#[derive(Clone, Debug, PartialEq)]
pub struct LookValue(pub VariedValue);

/// A value with a map and variation.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariedValue {
    /// Value where the map is 1: a number, or key frames `[{ frame, value }]`.
    pub value: Keyed<f64>,
    /// Image that multiplies the value (phases and angles: is added to it); `<UDIM>` stands for the tile number.
    pub map: Option<PathBuf>,
    /// Channel of the map. Default: the grey value.
    #[serde(default)]
    pub channel: Channel,
    /// What the map says outside its square. Default: "clamp".
    #[serde(default)]
    pub wrap: WrapMode,
    /// Random variation per hair: 0.1 spreads evenly over +-10 % (phases and angles: over +-0.1 turns). Default: 0.
    #[serde(default)]
    pub noise: f64,
    /// Smooth variation over the skin, one entry a scale.
    #[serde(default)]
    pub vary: Vec<VaryScale>,
}

/// Smooth variation over the skin at one scale.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VaryScale {
    /// Distance over which it changes, scene units.
    pub size: f64,
    /// Standard deviation, as a fraction of the value (phases and angles: turns).
    pub deviation: f64,
}

impl LookValue {
    /// The same everywhere and always.
    pub fn constant(value: f64) -> Self {
        let value = Keyed::constant(value);
        LookValue(VariedValue {
            value,
            map: None,
            channel: Channel::Grey,
            wrap: WrapMode::Clamp,
            noise: 0.0,
            vary: vec![],
        })
    }

    /// Value at a frame number.
    pub fn at(&self, frame: f64) -> f64 {
        self.0.value.at(frame)
    }

    /// Its map.
    pub fn map(&self) -> Option<MapRef> {
        self.0.map.clone().map(|map| MapRef { map, channel: self.0.channel, wrap: self.0.wrap })
    }

    /// True if it is 0 at all times.
    pub fn is_zero(&self) -> bool {
        self.0.value.0.iter().all(|k| k.value == 0.0)
    }
}

impl<'de> Deserialize<'de> for LookValue {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(AnyOf)
    }
}

/// Reads what is there without going through a tree of values, so that errors point into it.
struct AnyOf;

impl<'de> Visitor<'de> for AnyOf {
    type Value = LookValue;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, key frames [{ frame, value }], or a table with a value")
    }

    fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<LookValue, E> {
        Ok(LookValue::constant(x))
    }

    fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<LookValue, E> {
        Ok(LookValue::constant(x as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<LookValue, A::Error> {
        let value = Keyed::deserialize(SeqAccessDeserializer::new(list))?;
        Ok(LookValue(VariedValue { value, ..LookValue::constant(0.0).0 }))
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<LookValue, A::Error> {
        VariedValue::deserialize(MapAccessDeserializer::new(table)).map(LookValue)
    }
}

impl JsonSchema for LookValue {
    fn schema_name() -> Cow<'static, str> {
        "LookValue".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let (keyed, table) = (generator.subschema_for::<Keyed<f64>>(), generator.subschema_for::<VariedValue>());
        schemars::json_schema!({ "anyOf": [keyed, table] })
    }
}

fn zero() -> LookValue {
    LookValue::constant(0.0)
}

fn one() -> LookValue {
    LookValue::constant(1.0)
}

fn yes() -> bool {
    true
}

/// A level of clumps: hairs are drawn toward the centre hair of their clump. Levels act one after another, the finest
/// first.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Clump {
    /// Clumps per square centimetre; their centres are hairs of the layer. One of density, regions, roots and curves is given.
    pub density: Option<LookValue>,
    /// Regions of equal value of a map are clumps.
    pub regions: Option<MapRef>,
    /// Clumps placed by hand: points on or near the rest skin, whose nearest hairs are centres.
    #[serde(default, deserialize_with = "some_points")]
    pub roots: Option<Vec<[f64; 3]>>,
    /// Clumps placed by hand: lines at the rest pose, root first, which are centres; they move with the hairs nearest to
    /// their roots.
    #[serde(default, deserialize_with = "some_lines")]
    pub curves: Option<Lines>,
    /// Radius of a clump, scene units (for regions: the longest step between hairs of one region). Default: so large that
    /// every hair is in a clump.
    pub size: Option<LookValue>,
    /// Map that limits clumps to where it is at least 0.5.
    pub area: Option<MapRef>,
    /// What joins a clump. Default: "hairs" in the first level, "clumps" in the others.
    pub of: Option<ClumpOf>,
    /// How far tips come to the centre's tip, 0 to 1. Default: 0.7.
    #[serde(default = "percent")]
    pub percent: LookValue,
    /// How early along the hair, 0 (evenly from root to tip) to 1 (within the first third). Default: 0.
    #[serde(default = "zero")]
    pub rate: LookValue,
    /// How much less hairs at the rim of a clump are drawn, 0 to 1. Default: 0.
    #[serde(default = "zero")]
    pub falloff: LookValue,
    /// How far tips open again, each at random up to this share, 0 to 1. Default: 0.
    #[serde(default = "zero")]
    pub splay: LookValue,
    /// Turns of hairs around the centre from root to tip, each at random up to this. Default: 0.
    #[serde(default = "zero")]
    pub weave: LookValue,
    /// Above 0, clumps stay wide until near the tip; below, they are narrow from the root on; -1 to 1. Default: 0.
    #[serde(default)]
    pub taper: f64,
    /// Sizes of the clump's cross-section along the hair instead of a rate.
    pub dilation: Option<Dilation>,
    /// Keep the lengths of hairs instead of bringing their points exactly where the formula says. Default: false.
    #[serde(default)]
    pub keep_length: bool,
    /// Names of emitters: the clumps act only in the areas that their particles open, as those say.
    #[serde(default)]
    pub areas: Vec<String>,
    /// Factors on width and opacity of hairs of percent 1.
    pub wet: Option<Wet>,
    /// Hand the clumped hair to the simulation as its rest shape, instead of clumping what was simulated. Default: false.
    #[serde(default)]
    pub simulate: bool,
}

fn percent() -> LookValue {
    LookValue::constant(0.7)
}

fn some_points<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Vec<[f64; 3]>>, D::Error> {
    Ok(Some(Vec::<Fixed<f64, 3>>::deserialize(d)?.into_iter().map(|p| p.0).collect()))
}

/// Lines of points.
type Lines = Vec<Vec<[f64; 3]>>;

fn some_lines<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Lines>, D::Error> {
    let lines = Vec::<Vec<Fixed<f64, 3>>>::deserialize(d)?;
    Ok(Some(lines.into_iter().map(|l| l.into_iter().map(|p| p.0).collect()).collect()))
}

/// What joins a clump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ClumpOf {
    /// Every hair by itself.
    Hairs,
    /// Clumps of the level before, as wholes.
    Clumps,
}

/// Sizes of a clump's cross-section at a quarter, half, three quarters of the hair and its tip, relative to the root's.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dilation {
    /// Mean sizes.
    #[serde(deserialize_with = "exactly")]
    pub mean: [f64; 4],
    /// How far they differ from clump to clump. Default: 0.
    #[serde(default, deserialize_with = "exactly")]
    pub deviation: [f64; 4],
    /// How fast they change with the region's value; without regions every clump is drawn by itself. Default: 100.
    #[serde(default = "hundred")]
    pub scale: f64,
}

fn hundred() -> f64 {
    100.0
}

/// Factors for wet hair.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wet {
    /// Factor on the width of a hair of percent 1. Default: 1.
    #[serde(default = "factor")]
    pub width: f64,
    /// Factor on the opacity. Default: 1.
    #[serde(default = "factor")]
    pub opacity: f64,
}

fn factor() -> f64 {
    1.0
}

/// Curls: offsets across the hair along its length.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curl {
    /// Type of wave.
    pub kind: CurlKind,
    /// How far the hair goes from its middle line, scene units; a factor for kind "custom". Default for that: 1.
    pub radius: Option<LookValue>,
    /// Length of a turn along the hair, scene units; a factor for kind "custom". Default for that: 1.
    pub pitch: Option<LookValue>,
    /// Where in its turn a hair starts, turns. Default: 0, +-0.5 at random.
    #[serde(default = "any_phase")]
    pub phase: LookValue,
    /// Turns the wave's plane about the hair, turns; at 0 the wave is toward and away from the skin. Default: 0.
    #[serde(default = "zero")]
    pub angle: LookValue,
    /// How much tighter turns are at the tip: 1 means half as long. Default: 0.
    #[serde(default = "zero")]
    pub tighten: LookValue,
    /// dished: depth of the dish, radii. Default: 0.5.
    pub depth: Option<f64>,
    /// Length over which curls begin at the root, turns. Default: 0.5.
    #[serde(default = "half")]
    pub start: f64,
    /// Factors on the radius at equally spaced stations from root to tip. Default: 1 everywhere.
    pub profile: Option<Vec<f64>>,
    /// Keep the length of hairs: they end nearer to the skin. false: curls make them longer. Default: true.
    #[serde(default = "yes")]
    pub keep_length: bool,
    /// Hairs of a clump curl alike: parameters are those of its centre. Default: false.
    #[serde(default)]
    pub per_clump: bool,
    /// custom: the offset along the axis away from the skin.
    pub x: Option<CurlWave>,
    /// custom: the offset along the other axis.
    pub y: Option<CurlWave>,
    /// Hand the curled hair to the simulation as its rest shape. Default: false.
    #[serde(default)]
    pub simulate: bool,
}

fn any_phase() -> LookValue {
    LookValue(VariedValue { noise: 0.5, ..LookValue::constant(0.0).0 })
}

fn half() -> f64 {
    0.5
}

/// Type of a hair's wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CurlKind {
    /// A circle around the middle line.
    Helix,
    /// A wave in a plane.
    Uniplanar,
    /// A wave on half a cylinder.
    Dished,
    /// What `x` and `y` say.
    Custom,
}

/// An offset: `Mag(t) sin(2 pi (r t + p0) t + phase) + bias`, `Mag(t) = a + b t exp(-alpha t) + c (1 - exp(-beta t)) +
/// d exp(gamma (t - t0))`, t the length along the hair in scene units.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CurlWave {
    /// Size at the root, scene units.
    pub a: f64,
    /// A bulge, greatest at `1 / alpha`.
    pub b: f64,
    /// Where the bulge is.
    pub alpha: f64,
    /// What the size gains along the hair, scene units.
    pub c: f64,
    /// How soon it gains.
    pub beta: f64,
    /// Growth at the end of the hair, scene units.
    pub d: f64,
    /// How steep that growth is.
    pub gamma: f64,
    /// From where on it is, scene units.
    pub t0: f64,
    /// How much faster waves get: the local frequency is `2 r t + p0`.
    pub r: f64,
    /// Waves a scene unit at the root.
    pub p0: f64,
    /// Phase, turns.
    pub phase: f64,
    /// Constant offset, scene units.
    pub bias: f64,
}

impl CurlWave {
    /// Values by key.
    pub fn values(&self) -> [(&'static str, f64); 12] {
        [
            ("a", self.a),
            ("b", self.b),
            ("alpha", self.alpha),
            ("c", self.c),
            ("beta", self.beta),
            ("d", self.d),
            ("gamma", self.gamma),
            ("t0", self.t0),
            ("r", self.r),
            ("p0", self.p0),
            ("phase", self.phase),
            ("bias", self.bias),
        ]
    }
}

/// Waves or noise whose size and frequency run through four stations along the hair, all decided by one painted number.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// What it is made of. Default: "sine".
    #[serde(default)]
    pub shape: WaveShape,
    /// The wave away from and toward the skin.
    #[serde(default)]
    pub x: WaveAxis,
    /// The wave along the skin.
    #[serde(default)]
    pub y: WaveAxis,
    /// Factor on both. Default: 1.
    #[serde(default = "one")]
    pub strength: LookValue,
    /// Map of the root variable: hairs of equal value wave alike.
    pub map: Option<MapRef>,
    /// Without a map: distance over the skin over which the root variable changes, scene units. Default: 0, it is 0
    /// everywhere.
    #[serde(default)]
    pub size: f64,
    /// Share of hairs that break away: theirs is a random number. Default: 0.
    #[serde(default)]
    pub stray: f64,
    /// Keep the lengths of hairs. Default: true.
    #[serde(default = "yes")]
    pub keep_length: bool,
    /// Hand the waved hair to the simulation as its rest shape. Default: false.
    #[serde(default)]
    pub simulate: bool,
}

/// What a wave is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WaveShape {
    /// A sine.
    #[default]
    Sine,
    /// Noise along the hair.
    Noise,
}

/// The wave along one axis.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WaveAxis {
    /// Amplitude at a quarter, half, three quarters of the hair and its tip, scene units.
    #[serde(deserialize_with = "exactly")]
    pub amplitude: [f64; 4],
    /// How far amplitudes differ with the root variable, scene units.
    #[serde(deserialize_with = "exactly")]
    pub amplitude_deviation: [f64; 4],
    /// How fast they change with it.
    #[serde(deserialize_with = "exactly")]
    pub amplitude_scale: [f64; 4],
    /// Waves over the hair's length, at the same stations.
    #[serde(deserialize_with = "exactly")]
    pub frequency: [f64; 4],
    /// How far frequencies differ with the root variable.
    #[serde(deserialize_with = "exactly")]
    pub frequency_deviation: [f64; 4],
    /// How fast they change with it.
    #[serde(deserialize_with = "exactly")]
    pub frequency_scale: [f64; 4],
    /// Phase at the root, turns.
    pub phase: f64,
    /// How far phases differ with the root variable, turns.
    pub phase_deviation: f64,
    /// How fast they change with it.
    pub phase_scale: f64,
}

impl WaveAxis {
    /// Values by key.
    pub fn values(&self) -> Vec<(&'static str, f64)> {
        let stations = [
            ("amplitude", self.amplitude),
            ("amplitude_deviation", self.amplitude_deviation),
            ("amplitude_scale", self.amplitude_scale),
            ("frequency", self.frequency),
            ("frequency_deviation", self.frequency_deviation),
            ("frequency_scale", self.frequency_scale),
        ];
        let phase =
            [("phase", self.phase), ("phase_deviation", self.phase_deviation), ("phase_scale", self.phase_scale)];
        stations.into_iter().flat_map(|(key, v)| v.map(|x| (key, x))).chain(phase).collect()
    }

    /// Values by key as text, those of stations together.
    pub fn settings(&self) -> Vec<(&'static str, String)> {
        let values = self.values();
        let same = values.chunk_by(|a, b| a.0 == b.0);
        same.map(|s| match s {
            [(key, x)] => (*key, x.to_string()),
            _ => (s[0].0, format!("{:?}", s.iter().map(|v| v.1).collect::<Vec<_>>())),
        })
        .collect()
    }
}

/// Random offsets across the hair, smooth along it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Size of the offsets (root mean square), scene units.
    pub amplitude: LookValue,
    /// Distance along the hair over which they change, scene units.
    pub size: f64,
    /// Distance over the skin over which they change, scene units. Default: 0, every hair by itself: frizz.
    #[serde(default)]
    pub across: f64,
    /// Factors on the amplitude at equally spaced stations from root to tip. Default: 1 everywhere.
    pub profile: Option<Vec<f64>>,
    /// Keep the lengths of hairs. Default: true.
    #[serde(default = "yes")]
    pub keep_length: bool,
    /// Hand the noisy hair to the simulation as its rest shape. Default: false.
    #[serde(default)]
    pub simulate: bool,
}

/// Wind for hair that is not simulated: it moves points, and lengths stay.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindLook {
    /// How far tips are moved on average, scene units.
    pub amplitude: LookValue,
    /// Where it blows to, along the scene's axes.
    #[serde(deserialize_with = "exactly")]
    pub direction: [f64; 3],
    /// Gusts a second. Default: 0.5.
    #[serde(default = "half")]
    pub frequency: f64,
    /// Size of a gust, scene units.
    pub size: f64,
    /// How much gusts change it, 0 to 1. Default: 0.5.
    #[serde(default = "half")]
    pub gust: f64,
    /// Blow also where the simulation of the layer has wind of its own. Default: false.
    #[serde(default)]
    pub with_simulated: bool,
}

/// Keeping finished hairs out of the skin.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Collision {
    /// Do it. Default: true.
    pub enabled: bool,
    /// Distance from the skin at which pushed hairs end, millimetres; it grows from 0 at the root over a hundred times this.
    /// Default: 0.05.
    pub clearance: f64,
    /// Length at the root that may be inside, millimetres. Default: 1.
    pub held: f64,
}

impl Default for Collision {
    fn default() -> Self {
        Collision { enabled: true, clearance: 0.05, held: 1.0 }
    }
}

/// An operator of the look, for the order in which they act.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Operator {
    /// `[[layer.clump]]`, all levels.
    Clump,
    /// `[layer.curl]`.
    Curl,
    /// `[[layer.wave]]`.
    Wave,
    /// `[[layer.noise]]`.
    Noise,
    /// `[layer.wind]`.
    Wind,
}

impl Operator {
    /// The order in which they act if a layer does not say otherwise.
    pub const ALL: [Operator; 5] = [Operator::Clump, Operator::Curl, Operator::Wave, Operator::Noise, Operator::Wind];
}

/// Particles that hit the skin and open areas of clumped (wet) hair.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Emitter {
    /// Name, for the clumps that act in its areas.
    pub name: String,
    /// Particles from a file instead: CSV of frame, x, y, z, dx, dy, dz, in scene units.
    pub file: Option<PathBuf>,
    /// Where particles start, scene units: three numbers, or key frames along its way.
    pub position: Option<Keyed<Vector>>,
    /// Where they fly, along the scene's axes.
    pub direction: Option<Vector>,
    /// Half the angle of the cone that they leave in, degrees. Default: 0.
    #[serde(default)]
    pub spread: f64,
    /// Particles a second. Default: 24.
    #[serde(default = "two_dozen")]
    pub rate: f64,
    /// First and last frame. Default: those of the shot.
    #[serde(default, deserialize_with = "some_frames")]
    pub frames: Option<[i32; 2]>,
    /// Names its random numbers. Default: 0.
    #[serde(default)]
    pub seed: u32,
    /// Radius of an area, scene units: a number, or keys by its age in frames.
    pub radius: Keyed<f64>,
    /// Clump percent in the area: a number, or keys by its age in frames. Default: 1.
    #[serde(default = "always")]
    pub percent: Keyed<f64>,
    /// Clump rate in the area: a number, or keys by its age in frames. Default: 0.
    #[serde(default = "never")]
    pub clump_rate: Keyed<f64>,
}

fn two_dozen() -> f64 {
    24.0
}

fn always() -> Keyed<f64> {
    Keyed::constant(1.0)
}

fn never() -> Keyed<f64> {
    Keyed::constant(0.0)
}

fn some_frames<'de, D: Deserializer<'de>>(d: D) -> Result<Option<[i32; 2]>, D::Error> {
    exactly(d).map(Some)
}

/// What a shot changes of the look of its groom.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Look {
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
        Look { clump: true, curl: true, wave: true, noise: true, wind: true, collision: true, overrides: Vec::new() }
    }
}

impl Look {
    /// True if an operator acts in this shot.
    pub fn has(&self, operator: Operator) -> bool {
        match operator {
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

/// A parameter of the look that varies over the skin.
pub struct Varied<'a> {
    /// Its key below the operator's.
    pub name: &'static str,
    /// What it is.
    pub value: &'a LookValue,
    /// True if map and variation are added to it, not multiplied with it.
    pub added: bool,
    /// Smallest and largest value.
    pub range: [f64; 2],
}

fn varied<'a>(name: &'static str, value: &'a LookValue, range: [f64; 2]) -> Varied<'a> {
    Varied { name, value, added: false, range }
}

impl Clump {
    /// Parameters that act on hairs of a clump.
    pub fn varied(&self) -> Vec<Varied<'_>> {
        let unit = [0.0, 1.0];
        vec![
            varied("percent", &self.percent, unit),
            varied("rate", &self.rate, unit),
            varied("falloff", &self.falloff, unit),
            varied("splay", &self.splay, unit),
            varied("weave", &self.weave, [-1e3, 1e3]),
        ]
    }

    /// Parameters that make clumps.
    pub fn making(&self) -> Vec<Varied<'_>> {
        let density = self.density.iter().map(|d| varied("density", d, [0.0, 1e5]));
        density.chain(self.size.iter().map(|s| varied("size", s, [0.0, 1e6]))).collect()
    }
}

impl Curl {
    /// Parameters that vary over the skin.
    pub fn varied(&self) -> Vec<Varied<'_>> {
        let turns = |name, value| Varied { added: true, ..varied(name, value, [-1e6, 1e6]) };
        let mut out: Vec<_> = self.radius.iter().map(|r| varied("radius", r, [0.0, 1e6])).collect();
        out.extend(self.pitch.iter().map(|p| varied("pitch", p, [0.0, 1e6])));
        out.extend([turns("phase", &self.phase), turns("angle", &self.angle)]);
        out.push(varied("tighten", &self.tighten, [0.0, 1e3]));
        out
    }
}

impl Layer {
    /// Every parameter of the look that varies over the skin, with the key of its operator below the layer's.
    pub fn varied(&self) -> Vec<(String, Varied<'_>)> {
        let mut out = Vec::new();
        let mut add = |key: String, all: Vec<_>| out.extend(all.into_iter().map(|v| (key.clone(), v)));
        for (k, c) in self.clump.iter().enumerate() {
            add(format!("clump[{k}]"), c.making().into_iter().chain(c.varied()).collect());
        }
        self.curl.iter().for_each(|c| add("curl".to_owned(), c.varied()));
        for (k, w) in self.wave.iter().enumerate() {
            add(format!("wave[{k}]"), vec![varied("strength", &w.strength, [0.0, 1e6])]);
        }
        for (k, n) in self.noise.iter().enumerate() {
            add(format!("noise[{k}]"), vec![varied("amplitude", &n.amplitude, [0.0, 1e6])]);
        }
        self.wind.iter().for_each(|w| add("wind".to_owned(), vec![varied("amplitude", &w.amplitude, [-1e6, 1e6])]));
        out
    }

    /// Other maps of the look, with their keys below the layer's.
    pub fn look_maps(&self) -> Vec<(String, &MapRef)> {
        let mut out = Vec::new();
        for (k, c) in self.clump.iter().enumerate() {
            out.extend(c.area.iter().map(|m| (format!("clump[{k}].area"), m)));
            out.extend(c.regions.iter().map(|m| (format!("clump[{k}].regions"), m)));
        }
        for (k, w) in self.wave.iter().enumerate() {
            out.extend(w.map.iter().map(|m| (format!("wave[{k}].map"), m)));
        }
        out
    }

    /// Operators in the order in which they act.
    pub fn order(&self) -> Vec<Operator> {
        self.order.clone().unwrap_or(Operator::ALL.to_vec())
    }

    /// True for each part of an operator that is handed to the simulation.
    fn simulated(&self, operator: Operator) -> Vec<bool> {
        match operator {
            Operator::Clump => self.clump.iter().map(|c| c.simulate).collect(),
            Operator::Curl => self.curl.iter().map(|c| c.simulate).collect(),
            Operator::Wave => self.wave.iter().map(|w| w.simulate).collect(),
            Operator::Noise => self.noise.iter().map(|n| n.simulate).collect(),
            Operator::Wind => self.wind.iter().map(|_| false).collect(),
        }
    }
}

impl Document<GroomFile> {
    pub(super) fn check_look(&self, at: &str, l: &Layer) -> Result<(), ConfigError> {
        for (key, v) in l.varied() {
            self.check_value(&format!("{at}.{key}.{}", v.name), &v)?;
        }
        for (k, c) in l.clump.iter().enumerate() {
            self.check_clump(&format!("{at}.clump[{k}]"), k, c)?;
        }
        if let Some(c) = &l.curl {
            self.check_curl(&format!("{at}.curl"), c)?;
            if c.per_clump && l.clump.is_empty() {
                let help = "add a [[layer.clump]], or take it out";
                return Err(self.error(&format!("{at}.curl.per_clump"), "the layer has no clumps", help));
            }
        }
        for (k, w) in l.wave.iter().enumerate() {
            let at = format!("{at}.wave[{k}]");
            for (axis, values) in [("x", w.x.values()), ("y", w.y.values())] {
                for (key, x) in values {
                    self.within(&format!("{at}.{axis}.{key}"), x, -1e6, 1e6)?;
                }
            }
            self.within(&format!("{at}.size"), w.size, 0.0, 1e6)?;
            self.within(&format!("{at}.stray"), w.stray, 0.0, 1.0)?;
        }
        for (k, n) in l.noise.iter().enumerate() {
            let at = format!("{at}.noise[{k}]");
            self.within(&format!("{at}.size"), n.size, 1e-9, 1e6)?;
            self.within(&format!("{at}.across"), n.across, 0.0, 1e6)?;
            self.check_profile(&at, n.profile.as_ref())?;
        }
        if let Some(w) = &l.wind {
            let at = format!("{at}.wind");
            if !w.direction.iter().all(|x| x.is_finite()) || w.direction == [0.0; 3] {
                return Err(self.error(
                    &format!("{at}.direction"),
                    "must be a direction",
                    "for example [1.0, 0.0, 0.0]",
                ));
            }
            self.within(&format!("{at}.size"), w.size, 1e-9, 1e9)?;
            self.within(&format!("{at}.frequency"), w.frequency, 0.0, 1e3)?;
            self.within(&format!("{at}.gust"), w.gust, 0.0, 1.0)?;
        }
        self.within(&format!("{at}.collision.clearance"), l.collision.clearance, 1e-4, 1e3)?;
        self.within(&format!("{at}.collision.held"), l.collision.held, 1e-4, 1e6)?;
        self.check_order(at, l)
    }

    fn check_value(&self, at: &str, v: &Varied<'_>) -> Result<(), ConfigError> {
        for k in &v.value.0.value.0 {
            self.within(at, k.value, v.range[0], v.range[1])?;
            self.within(at, k.frame, -1e9, 1e9)?;
        }
        if !v.value.0.value.in_order() {
            return Err(self.error(at, "key frames are not in order", "write one or more, each after the one before"));
        }
        self.within(&format!("{at}.noise"), v.value.0.noise, 0.0, if v.added { 1e3 } else { 1.0 })?;
        for s in &v.value.0.vary {
            self.within(&format!("{at}.vary"), s.size, 1e-9, 1e9)?;
            self.within(&format!("{at}.vary"), s.deviation, 0.0, 1e3)?;
        }
        Ok(())
    }

    fn check_clump(&self, at: &str, level: usize, c: &Clump) -> Result<(), ConfigError> {
        let given = [c.density.is_some(), c.regions.is_some(), c.roots.is_some(), c.curves.is_some()];
        if given.iter().filter(|g| **g).count() != 1 {
            return Err(self.error(
                at,
                "does not say what its clumps are",
                "give one of density, regions, roots, curves",
            ));
        }
        for v in c.making() {
            if v.value.0.value.0.len() > 1 {
                let help = "clumps are made once; key percent or rate";
                return Err(self.error(&format!("{at}.{}", v.name), "can't have key frames", help));
            }
        }
        let none = c.roots.as_ref().is_some_and(Vec::is_empty) || c.curves.as_ref().is_some_and(Vec::is_empty);
        let lines =
            c.curves.iter().flatten().map(|l| (l.as_slice(), 2)).chain(c.roots.iter().map(|r| (r.as_slice(), 1)));
        for (line, least) in lines.chain(none.then_some((&[][..], 1))) {
            if line.len() < least || !line.iter().flatten().all(|x| x.is_finite()) {
                let what = "clumps placed by hand need finite points, a curve two or more";
                return Err(self.error(at, what, "root first, at the rest pose, in scene units"));
            }
        }
        if c.of == Some(ClumpOf::Clumps) && level == 0 {
            return Err(self.error(
                &format!("{at}.of"),
                "there is no level before the first",
                "list the finest level first",
            ));
        }
        self.within(&format!("{at}.taper"), c.taper, -1.0, 1.0)?;
        if let Some(d) = &c.dilation {
            for x in d.mean.iter().chain(&d.deviation) {
                self.within(&format!("{at}.dilation"), *x, 0.0, 1e3)?;
            }
            self.within(&format!("{at}.dilation.scale"), d.scale, 0.0, 1e6)?;
            if !c.rate.is_zero() {
                return Err(self.error(&format!("{at}.rate"), "is not read beside a dilation", "keep one of the two"));
            }
        }
        if let Some(w) = &c.wet {
            self.within(&format!("{at}.wet.width"), w.width, 0.0, 100.0)?;
            self.within(&format!("{at}.wet.opacity"), w.opacity, 0.0, 100.0)?;
        }
        for name in &c.areas {
            if !self.value.emitter.iter().any(|e| e.name == *name) {
                let help = "name one of the [[emitter]] of this file";
                return Err(self.error(&format!("{at}.areas"), format!("there is no emitter `{name}`"), help));
            }
        }
        if c.simulate && c.wet.is_some() {
            let help = "give it to a level that is not simulated";
            return Err(self.error(&format!("{at}.wet"), "a simulated level hands on its shape only", help));
        }
        if c.simulate && !c.areas.is_empty() {
            return Err(self.error(
                &format!("{at}.simulate"),
                "areas come and go in the shot",
                "take one of the two out",
            ));
        }
        Ok(())
    }

    fn check_curl(&self, at: &str, c: &Curl) -> Result<(), ConfigError> {
        let custom = c.kind == CurlKind::Custom;
        for (name, has) in [("radius", c.radius.is_some()), ("pitch", c.pitch.is_some())] {
            if !has && !custom {
                return Err(self.error(at, format!("this kind of curl needs `{name}`"), "in scene units"));
            }
        }
        if c.pitch.iter().flat_map(|p| &p.0.value.0).any(|k| k.value <= 0.0) {
            return Err(self.error(&format!("{at}.pitch"), "must be above 0", "it is the length of a turn"));
        }
        for (name, has) in [("x", c.x.is_some()), ("y", c.y.is_some())] {
            if has != custom {
                let help = if custom { "give both x and y" } else { "write kind = \"custom\"" };
                return Err(self.error(&format!("{at}.{name}"), "goes with kind \"custom\" and no other", help));
            }
        }
        for (axis, wave) in [("x", &c.x), ("y", &c.y)] {
            for (key, x) in wave.iter().flat_map(|w| w.values()) {
                self.within(&format!("{at}.{axis}.{key}"), x, -1e6, 1e6)?;
            }
        }
        if c.depth.is_some() && c.kind != CurlKind::Dished {
            return Err(self.error(&format!("{at}.depth"), "is read by kind \"dished\" only", "take it out"));
        }
        self.within(&format!("{at}.depth"), c.depth.unwrap_or(0.0), 0.0, 100.0)?;
        self.within(&format!("{at}.start"), c.start, 0.0, 1e6)?;
        self.check_profile(at, c.profile.as_ref())
    }

    fn check_profile(&self, at: &str, profile: Option<&Vec<f64>>) -> Result<(), ConfigError> {
        let Some(p) = profile else { return Ok(()) };
        if !(2..=64).contains(&p.len()) {
            return Err(self.error(&format!("{at}.profile"), "must have 2 to 64 stations", "from root to tip"));
        }
        p.iter().try_for_each(|x| self.within(&format!("{at}.profile"), *x, 0.0, 1e3))
    }

    /// Every operator once, and what is simulated before what is not.
    fn check_order(&self, at: &str, l: &Layer) -> Result<(), ConfigError> {
        let order = l.order();
        let all = Operator::ALL.iter().all(|o| order.iter().filter(|p| *p == o).count() == 1);
        if !all || order.len() != Operator::ALL.len() {
            let help = "[\"clump\", \"curl\", \"wave\", \"noise\", \"wind\"] in another order";
            return Err(self.error(&format!("{at}.order"), "must name every operator once", help));
        }
        let simulated: Vec<bool> = order.iter().flat_map(|o| l.simulated(*o)).collect();
        if simulated.windows(2).any(|w| !w[0] && w[1]) {
            let what = "an operator that is simulated comes after one that is not";
            return Err(self.error(at, what, "simulate the one before it too, or change `order`"));
        }
        Ok(())
    }

    pub(super) fn check_emitters(&self) -> Result<(), ConfigError> {
        for (i, e) in self.value.emitter.iter().enumerate() {
            let at = format!("emitter[{i}]");
            if e.name.is_empty() || self.value.emitter[..i].iter().any(|o| o.name == e.name) {
                return Err(self.error(
                    &format!("{at}.name"),
                    "is empty or used twice",
                    "name every emitter differently",
                ));
            }
            let own = [e.position.is_some(), e.direction.is_some()];
            if own != [e.file.is_none(); 2] {
                let help = "give `file`, or `position` and `direction`";
                return Err(self.error(&at, "does not say where its particles come from", help));
            }
            let finite = |v: &Vector| v.0.iter().all(|x| x.is_finite());
            if !e.position.iter().flat_map(|p| &p.0).all(|k| finite(&k.value)) {
                return Err(self.error(&format!("{at}.position"), "must be three finite numbers", "in scene units"));
            }
            if !e.direction.iter().all(|d| finite(d) && d.0 != [0.0; 3]) {
                return Err(self.error(&format!("{at}.direction"), "must be a direction", "for example [0, -1, 0]"));
            }
            let position = e.position.iter().flat_map(|p| &p.0);
            position.map(|k| k.frame).try_for_each(|f| self.within(&format!("{at}.position"), f, -1e9, 1e9))?;
            if !e.position.iter().all(Keyed::in_order) {
                let help = "each comes after the one before";
                return Err(self.error(&format!("{at}.position"), "key frames are not in order", help));
            }
            if e.frames.is_some_and(|f| f[0] > f[1]) {
                return Err(self.error(
                    &format!("{at}.frames"),
                    "the last frame comes before the first",
                    "first, last",
                ));
            }
            self.within(&format!("{at}.spread"), e.spread, 0.0, 180.0)?;
            self.within(&format!("{at}.rate"), e.rate, 0.0, 1e5)?;
            for (key, v, most) in
                [("radius", &e.radius, 1e6), ("percent", &e.percent, 1.0), ("clump_rate", &e.clump_rate, 1.0)]
            {
                for k in &v.0 {
                    self.within(&format!("{at}.{key}"), k.value, 0.0, most)?;
                    self.within(&format!("{at}.{key}"), k.frame, -1e9, 1e9)?;
                }
                if !v.in_order() {
                    let help = "each comes after the one before";
                    return Err(self.error(&format!("{at}.{key}"), "key frames are not in order", help));
                }
            }
        }
        Ok(())
    }
}
