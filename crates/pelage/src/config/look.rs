//! What displaces hairs after they are interpolated or simulated: `[[layer.clump]]`, `[layer.curl]`, `[[layer.wave]]`,
//! `[[layer.noise]]`, `[layer.wind]`, `[layer.collision]` and `[[emitter]]` of the groom file.

use super::document::{Fixed, exactly, some_exactly};
use super::groom::some_points;
use super::keyed::{Keyed, Vector};
use super::look_value::{LookValue, Varied, VariedValue, varied};
use super::{Layer, MapRef};
use schemars::JsonSchema;
use serde::de::Deserializer;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

pub(super) fn zero() -> LookValue {
    LookValue::constant(0.0)
}

pub(super) fn one() -> LookValue {
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
    /// Clumps per square centimetre; their centres are hairs of the layer. One of density, regions, roots, curves and clusters is given.
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
    /// Clusters of this level are clumps, 0 for those of the file; their lines are the centres. A hair's place in the cluster
    /// decides how near to the rim it is.
    pub clusters: Option<usize>,
    /// Radius of a clump, scene units (for regions: the longest step between hairs of one region). Default: four times the
    /// distance between clumps of that density; a centimetre for clumps placed by hand.
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
    /// Turns of hairs around the centre from root to tip at percent 1, each at random up to this. Default: 0.
    #[serde(default = "zero")]
    pub weave: LookValue,
    /// Above 0, clumps stay wide until near the tip; below, they are narrow from the root on; -1 to 1. Default: 0.
    #[serde(default)]
    pub taper: f64,
    /// Sizes of the clump's cross-section along the hair instead of a rate.
    pub dilation: Option<Dilation>,
    /// Distance from the centre up to which it holds a hair, scene units: hair that the motion takes farther leaves its
    /// clump, gradually up to twice the distance, from there to its tip. Default: none, clumps reach any distance.
    pub hold: Option<f64>,
    /// Keep the lengths of hairs instead of bringing their points exactly where the formula says. Default: false.
    #[serde(default)]
    pub keep_length: bool,
    /// Names of emitters: the clumps act only in the areas that their particles open; percent and rate are then those of the
    /// emitters, and the clump's own are not read.
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
    /// `[layer.cluster]`.
    Cluster,
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
    /// Name as written in a file.
    pub fn name(self) -> &'static str {
        match self {
            Operator::Cluster => "cluster",
            Operator::Clump => "clump",
            Operator::Curl => "curl",
            Operator::Wave => "wave",
            Operator::Noise => "noise",
            Operator::Wind => "wind",
        }
    }

    /// The order in which they act if a layer does not say otherwise.
    pub const ALL: [Operator; 6] =
        [Operator::Cluster, Operator::Clump, Operator::Curl, Operator::Wave, Operator::Noise, Operator::Wind];
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
    #[serde(default, deserialize_with = "some_exactly")]
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

impl Clump {
    /// True if its centres are lines and not hairs.
    pub fn has_lines(&self) -> bool {
        self.curves.is_some() || self.clusters.is_some()
    }

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
        let making = |name, value, most| Varied { making: true, ..varied(name, value, [0.0, most]) };
        let density = self.density.iter().map(|d| making("density", d, 1e5));
        density.chain(self.size.iter().map(|s| making("size", s, 1e6))).collect()
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
        self.cluster.iter().for_each(|c| add("cluster".to_owned(), vec![varied("percent", &c.percent, [0.0, 1.0])]));
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

    /// Parameters of the operator at a key that act on hairs at every moment.
    pub fn acting(&self, key: &str) -> Vec<Varied<'_>> {
        self.varied().into_iter().filter(|(k, v)| k == key && !v.making).map(|(_, v)| v).collect()
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

    /// True if the layer has parts of an operator.
    pub fn has(&self, operator: Operator) -> bool {
        !self.simulated(operator).is_empty()
    }

    /// True for each part of an operator that is handed to the simulation.
    pub(super) fn simulated(&self, operator: Operator) -> Vec<bool> {
        match operator {
            Operator::Cluster => self.cluster.iter().map(|c| c.simulate).collect(),
            Operator::Clump => self.clump.iter().map(|c| c.simulate).collect(),
            Operator::Curl => self.curl.iter().map(|c| c.simulate).collect(),
            Operator::Wave => self.wave.iter().map(|w| w.simulate).collect(),
            Operator::Noise => self.noise.iter().map(|n| n.simulate).collect(),
            Operator::Wind => self.wind.iter().map(|_| false).collect(),
        }
    }
}
