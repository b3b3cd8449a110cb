//! Values of a shot that may have key frames.

use super::UpAxis;
use super::document::{ConfigError, Document, exactly};
use pelage_geom::motion::between;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Deserializer, Error as _, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// Three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct Vector(#[serde(deserialize_with = "exactly")] pub [f64; 3]);

impl fmt::Display for Vector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0;
        write!(f, "[{x}, {y}, {z}]")
    }
}

/// A number, or three.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, three numbers, or a list of { frame, value }")]
pub enum Amount {
    /// A number.
    Number(f64),
    /// Three numbers.
    Vector(Vector),
}

/// A value, or key frames `{ frame, value }`: linear in between, held beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyed<T>(pub Vec<Key<T>>);

/// A key frame.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Key<T> {
    /// Frame number, may lie between frames.
    pub frame: f64,
    /// Value there.
    pub value: T,
}

impl<T> Keyed<T> {
    /// The same value at all times.
    pub fn constant(value: T) -> Self {
        Keyed(vec![Key { frame: 0.0, value }])
    }

    /// True if there are keys, each after the one before.
    pub fn in_order(&self) -> bool {
        !self.0.is_empty() && self.0.windows(2).all(|k| k[0].frame < k[1].frame)
    }
}

impl<T> Document<T> {
    /// Complains about key frames that are not each after the one before.
    pub(super) fn check_keys<V>(&self, at: &str, keyed: &Keyed<V>) -> Result<(), ConfigError> {
        if keyed.in_order() && keyed.0.iter().all(|k| k.frame.is_finite()) {
            return Ok(());
        }
        Err(self.error(at, "key frames are not in order", "write one or more, each after the one before"))
    }
}

/// The value, or `[frame: value, ...]`.
impl<T: fmt::Display> fmt::Display for Keyed<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let [k] = &self.0[..] {
            return k.value.fmt(f);
        }
        let keys: Vec<String> = self.0.iter().map(|k| format!("{}: {}", k.frame, k.value)).collect();
        write!(f, "[{}]", keys.join(", "))
    }
}

/// The value, or the list of keys.
impl<T: Serialize> Serialize for Keyed<T> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        match &self.0[..] {
            [only] => only.value.serialize(s),
            keys => keys.serialize(s),
        }
    }
}

impl Keyed<[f64; 3]> {
    /// Value at a frame number.
    pub fn at(&self, frame: f64) -> [f64; 3] {
        let (a, b, f) = self.around(frame);
        std::array::from_fn(|x| a[x] + (b[x] - a[x]) * f)
    }
}

impl Keyed<f64> {
    /// Value at a frame number.
    pub fn at(&self, frame: f64) -> f64 {
        let (a, b, f) = self.around(frame);
        a + (b - a) * f
    }
}

impl<T> Keyed<T> {
    /// The values around a frame number, and the fraction of the way from the first to the second.
    fn around(&self, frame: f64) -> (&T, &T, f64) {
        let (a, b, f) = between(&self.0, |k| k.frame, frame).expect("at least one key");
        (&self.0[a].value, &self.0[b].value, f)
    }
}

impl Keyed<Amount> {
    /// As vectors; numbers count along `-up`.
    pub fn downward(&self, up: UpAxis) -> Keyed<[f64; 3]> {
        let vector = |v: Amount| match (v, up) {
            (Amount::Vector(v), _) => v.0,
            (Amount::Number(g), UpAxis::Y) => [0.0, -g, 0.0],
            (Amount::Number(g), UpAxis::Z) => [0.0, 0.0, -g],
        };
        Keyed(self.0.iter().map(|k| Key { frame: k.frame, value: vector(k.value) }).collect())
    }
}

impl Keyed<Vector> {
    /// As plain arrays.
    pub fn vectors(&self) -> Keyed<[f64; 3]> {
        Keyed(self.0.iter().map(|k| Key { frame: k.frame, value: k.value.0 }).collect())
    }
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Keyed<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(ValueOrKeys(PhantomData))
    }
}

/// Reads what is there without going through a tree of values, so that errors point into it.
struct ValueOrKeys<T>(PhantomData<T>);

impl<'de, T: DeserializeOwned> Visitor<'de> for ValueOrKeys<T> {
    type Value = Keyed<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, three numbers, or a list of { frame, value }")
    }

    fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<Keyed<T>, E> {
        T::deserialize(x.into_deserializer()).map(Keyed::constant)
    }

    fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<Keyed<T>, E> {
        self.visit_f64(x as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Keyed<T>, A::Error> {
        let (mut numbers, mut keys) = (Vec::new(), Vec::new());
        while let Some(item) = list.next_element::<Item<T>>()? {
            match item {
                Item::Number(x) => numbers.push(x),
                Item::Key(k) => keys.push(k),
            }
        }
        match (numbers.len(), keys.len()) {
            (0, 0) => Err(A::Error::invalid_length(0, &self)),
            (0, _) => Ok(Keyed(keys)),
            (_, 0) => T::deserialize(numbers.into_deserializer()).map(Keyed::constant),
            _ => Err(A::Error::custom("key frames and numbers in one list")),
        }
    }
}

/// A number of a vector, or a key frame.
enum Item<T> {
    Number(f64),
    Key(Key<T>),
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Item<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(ItemVisitor(PhantomData))
    }
}

struct ItemVisitor<T>(PhantomData<T>);

impl<'de, T: DeserializeOwned> Visitor<'de> for ItemVisitor<T> {
    type Value = Item<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, or a key frame { frame, value }")
    }

    fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<Item<T>, E> {
        Ok(Item::Number(x))
    }

    fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<Item<T>, E> {
        Ok(Item::Number(x as f64))
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Item<T>, A::Error> {
        Key::deserialize(MapAccessDeserializer::new(table)).map(Item::Key)
    }
}

impl<T: JsonSchema> JsonSchema for Keyed<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("Keyed{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let (value, key) = (generator.subschema_for::<T>(), generator.subschema_for::<Key<T>>());
        schemars::json_schema!({ "anyOf": [value, { "type": "array", "items": key }] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct Holder {
        gravity: Keyed<Amount>,
    }

    fn read(text: &str) -> Keyed<[f64; 3]> {
        toml::from_str::<Holder>(&format!("gravity = {text}")).unwrap().gravity.downward(UpAxis::Z)
    }

    #[test]
    fn values_are_numbers_vectors_or_keys() {
        assert_eq!(read("9.81").at(7.0), [0.0, 0.0, -9.81]);
        assert_eq!(read("10").at(7.0), [0.0, 0.0, -10.0]);
        assert_eq!(read("[1, 2.5, 3]").at(-7.0), [1.0, 2.5, 3.0]);
        let keys = read("[{ frame = 10, value = 4 }, { frame = 20, value = [2, 0, 0] }]");
        for (frame, value) in [(0.0, [0.0, 0.0, -4.0]), (15.0, [1.0, 0.0, -2.0]), (20.0, [2.0, 0.0, 0.0])] {
            assert_eq!(keys.at(frame), value);
        }
        assert_eq!(keys.at(99.0), [2.0, 0.0, 0.0]);
    }

    #[test]
    fn other_values_are_refused_in_words() {
        let error = |text: &str| toml::from_str::<Holder>(&format!("gravity = {text}")).unwrap_err().to_string();
        for text in ["\"down\"", "[1, 2]", "[]", "true"] {
            assert!(error(text).contains("expected a number, three numbers"), "{text}: {}", error(text));
        }
        assert!(error("[{ frame = 1 }]").contains("missing field `value`"));
        assert!(error("[{ frame = 1, valeu = 3 }]").contains("unknown field `valeu`"));
    }
}
