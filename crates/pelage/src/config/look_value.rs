//! Numbers of the look: a value, key frames, or a table with a map and variation.

use super::keyed::Keyed;
use super::{Channel, MapRef, WrapMode};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
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

    /// True if it is not the same for all hairs.
    pub fn varies(&self) -> bool {
        self.0.map.is_some() || self.0.noise != 0.0 || !self.0.vary.is_empty()
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

/// Schema of a value that is the same in all frames: a number, or a table with a map and variation.
pub(super) fn painted(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let (number, table) = (generator.subschema_for::<f64>(), generator.subschema_for::<VariedValue>());
    schemars::json_schema!({ "anyOf": [number, table] })
}

/// A parameter of the look that varies over the skin.
pub struct Varied<'a> {
    /// Its key below the operator's.
    pub name: &'static str,
    /// What it is.
    pub value: &'a LookValue,
    /// True if map and variation are added to it, not multiplied with it.
    pub added: bool,
    /// True if clumps are made by it, once, and not moved by it at every moment.
    pub making: bool,
    /// Smallest and largest value.
    pub range: [f64; 2],
}

/// A parameter whose map and variation multiply it.
pub(super) fn varied<'a>(name: &'static str, value: &'a LookValue, range: [f64; 2]) -> Varied<'a> {
    Varied { name, value, added: false, making: false, range }
}
