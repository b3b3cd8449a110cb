//! Control hairs: where they stand and what they are before combing.

use super::GroomFile;
use super::document::{ConfigError, Document, exactly};
use super::groom::{Feature, points, some_points};
use super::look_value::{LookValue, painted, varied};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use std::path::PathBuf;

/// Control hairs: where they stand and what they are before combing.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Where they stand, besides one at every vertex of every chart's border, those along lines and those one by one.
    #[serde(default)]
    pub placement: Placement,
    /// Hairs along lines on the skin.
    #[serde(default)]
    pub line: Vec<ControlLine>,
    /// Hairs one by one.
    #[serde(default)]
    pub hair: Vec<ControlHair>,
    /// Points of a control hair, the root included. Default: 4.
    #[serde(default = "four")]
    pub points: usize,
    /// Length before combing, scene units. Default: the longest value among the layers, without its map.
    pub length: Option<Feature>,
    /// Push hairs that enter the skin back out after combing. Default: true.
    #[serde(default = "yes")]
    pub push_up: bool,
    /// Distance from the skin that pushed hairs keep, millimetres. Default: 0.5.
    #[serde(default = "half")]
    pub clearance: f64,
}

fn four() -> usize {
    4
}

fn yes() -> bool {
    true
}

fn half() -> f64 {
    0.5
}

/// Control hairs along a line on the skin.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlLine {
    /// The line, on or near the rest skin, scene units.
    #[serde(deserialize_with = "points")]
    pub points: Vec<[f64; 3]>,
    /// Hairs at equal steps along it on the skin, the first and the last at its ends.
    pub count: usize,
}

/// A control hair by itself.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlHair {
    /// Name, unique: for combing, and for layers of such hairs.
    pub name: String,
    /// Its root, on or near the rest skin, scene units.
    #[serde(deserialize_with = "exactly")]
    pub root: [f64; 3],
    /// Its points after the root, at the rest pose, scene units. Default: straight up, as long as the others.
    #[serde(default, deserialize_with = "some_points")]
    pub points: Option<Vec<[f64; 3]>>,
}

/// Where control hairs stand: one of the three, or none if there are others.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Control hairs per square centimetre of skin; a map lets fewer stand.
    #[schemars(schema_with = "painted")]
    pub per_cm2: Option<LookValue>,
    /// Counts along u and along v, on every chart.
    #[serde(default, deserialize_with = "grid")]
    pub grid: Option<[usize; 2]>,
    /// grid: equal steps along the skin instead of equal steps of u and v. Default: false.
    #[serde(default)]
    pub even: bool,
    /// Curves drawn elsewhere (USD, PLY or .hair), bound to the skin.
    pub curves: Option<PathBuf>,
    /// per_cm2, grid: rounds in which hairs push each other apart; 30 even them out. Default: 0.
    #[serde(default)]
    pub relax: usize,
}

fn grid<'de, D: Deserializer<'de>>(d: D) -> Result<Option<[usize; 2]>, D::Error> {
    exactly(d).map(Some)
}

impl Control {
    /// Numbers of the hairs placed one by one whose names are among `patterns`, which may end in `*`.
    pub fn named(&self, patterns: &[String]) -> Vec<u32> {
        let is = |name: &str, p: &String| p.strip_suffix('*').map_or(p == name, |start| name.starts_with(start));
        let named = |k: &u32| patterns.iter().any(|p| is(&self.hair[*k as usize].name, p));
        (0..self.hair.len() as u32).filter(named).collect()
    }
}

impl Document<GroomFile> {
    pub(super) fn check_control(&self) -> Result<(), ConfigError> {
        let c = &self.value.control;
        let p = &c.placement;
        let given = [p.per_cm2.is_some(), p.grid.is_some(), p.curves.is_some()];
        let count = given.iter().filter(|g| **g).count();
        if count > 1 || count == 0 && c.line.is_empty() && c.hair.is_empty() {
            let help = "give one of per_cm2, grid, curves, or add a [[control.line]] or a [[control.hair]]";
            return Err(self.error("control.placement", "does not say where control hairs stand", help));
        }
        self.keys(
            "control.placement",
            &[
                ("even", p.even, p.even && p.grid.is_some()),
                ("relax", p.relax > 0, p.relax > 0 && p.curves.is_none() && count > 0),
            ],
        )?;
        if p.relax > 10_000 {
            return Err(self.error("control.placement.relax", "is out of range", "rounds go from 0 to 10000"));
        }
        for (i, l) in c.line.iter().enumerate() {
            let at = format!("control.line[{i}]");
            self.line(&format!("{at}.points"), Some(&l.points))?;
            if !(1..=100_000).contains(&l.count) {
                return Err(self.error(&format!("{at}.count"), "is out of range", "counts go from 1 to 100000"));
            }
        }
        for (i, h) in c.hair.iter().enumerate() {
            let at = format!("control.hair[{i}]");
            if h.name.is_empty() || h.name.contains('*') || c.hair[..i].iter().any(|o| o.name == h.name) {
                let help = "name every hair differently, without *";
                return Err(self.error(&format!("{at}.name"), "is empty, used twice or a pattern", help));
            }
            let line: Vec<[f64; 3]> = [h.root].into_iter().chain(h.points.iter().flatten().copied()).collect();
            match h.points {
                Some(_) => self.line(&format!("{at}.points"), Some(&line))?,
                None => h.root.into_iter().try_for_each(|x| self.within(&format!("{at}.root"), x, -1e9, 1e9))?,
            }
        }
        if let Some(d) = &p.per_cm2 {
            let key = "control.placement.per_cm2";
            self.check_value(key, &varied("", d, [0.0, 1e4]))?;
            self.still(key, d)?;
            self.only_painted(key, d)?;
            if d.varies() && p.relax > 0 {
                return Err(self.error(key, "varies, and `relax` evens it out", "take one of the two out"));
            }
        }
        if let Some(g) = p.grid.filter(|g| g.iter().any(|n| !(1..=4096).contains(n))) {
            let what = format!("{} x {} is out of range", g[0], g[1]);
            return Err(self.error("control.placement.grid", what, "counts go from 1 to 4096"));
        }
        self.points("control.points", Some(c.points))?;
        if let Some(f) = &c.length {
            self.feature("control.length", f, 1e6)?;
        }
        self.within("control.clearance", c.clearance, 0.0, 1e3)
    }
}
