//! Key frames of hair's shape: any number of combing and of clusters, and any list of numbers, may be a list of
//! `{ frame, value }` instead: linear in between, held beyond the ends. They are put in before anything reads the file.

use super::joined::Flaw;
use pelage_geom::motion::between;
use schemars::Schema;
use serde_json::{Value, json};
use std::fmt;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Keys of a groom file under which numbers may have key frames.
const SHAPE: [&str; 3] = ["comb", "cluster", "cluster_edit"];

/// What says where the roots of a cluster are, which has none.
pub const ROOTED: [&str; 3] = ["root", "radius", "outline"];

/// Largest number of a key frame: larger ones have no difference.
const LARGEST: f64 = 1e300;

/// A value with key frames.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyFrames {
    /// Its key.
    pub key: String,
    /// Its frames, in order.
    pub frame: Vec<f64>,
}

/// Numbers, or lists of them.
#[derive(Clone, Debug, PartialEq)]
enum Numbers {
    One(f64),
    List(Vec<Numbers>),
}

/// All key frames of a groom file.
#[derive(Clone, Debug, Default)]
pub struct AllKeys {
    each: Vec<(KeyFrames, Vec<(f64, Numbers)>)>,
}

impl AllKeys {
    /// Finds the key frames of a groom file.
    pub fn find(root: &mut DeTable<'_>) -> Result<AllKeys, Flaw> {
        let mut each = Vec::new();
        walk(root, &mut |key, v| {
            let list = v.get_ref().as_array().expect("key frames are a list");
            let keys = list.iter().map(|k| key_frame(key, k)).collect::<Result<Vec<_>, _>>()?;
            let flaw = |what: &str, help: &str| Err(Flaw::new(format!("{key}: {what}"), help, v.span()));
            if !keys.windows(2).all(|k| k[0].0 < k[1].0) {
                return flaw("key frames are not in order", "write each after the one before");
            }
            if keys.iter().any(|k| k.1.toward(&keys[0].1, 0.0).is_none()) {
                return flaw("key frames hold lists of different lengths", "give each as many numbers");
            }
            each.push((KeyFrames { key: key.to_owned(), frame: keys.iter().map(|k| k.0).collect() }, keys));
            Ok(())
        })?;
        Ok(AllKeys { each })
    }

    /// Where there are any.
    pub fn each(&self) -> impl Iterator<Item = &KeyFrames> {
        self.each.iter().map(|(at, _)| at)
    }

    /// The values at a frame number, as a list that a file could hold.
    pub fn text(&self, frame: f64) -> String {
        let now = |keys: &Vec<(f64, Numbers)>| {
            let (a, b, f) = between(keys, |k| k.0, frame).expect("at least one key");
            keys[a].1.toward(&keys[b].1, f).expect("as long as each other").to_string()
        };
        format!("[{}]", self.each.iter().map(|(_, keys)| now(keys)).collect::<Vec<_>>().join(", "))
    }
}

/// Puts the values of such a list in the place of the key frames.
pub fn put<'a>(root: &mut DeTable<'a>, text: &'a str) {
    let values = DeValue::parse(text).expect("numbers").into_inner();
    let mut values = values.as_array().expect("a list").iter();
    let all = walk(root, &mut |_, v| {
        let value = values.next().expect("as many as there are key frames").get_ref();
        *v = placed(value, &v.span());
        Ok(())
    });
    all.expect("nothing is refused");
}

/// A value as if it were read at a place of a file.
fn placed<'a>(v: &DeValue<'a>, span: &Range<usize>) -> Spanned<DeValue<'a>> {
    let value = match v {
        DeValue::Array(list) => {
            let mut all = DeArray::new();
            list.iter().for_each(|x| all.push(placed(x.get_ref(), span)));
            DeValue::Array(all)
        }
        other => other.clone(),
    };
    Spanned::new(span.clone(), value)
}

type Visit<'a, 'f> = dyn FnMut(&str, &mut Spanned<DeValue<'a>>) -> Result<(), Flaw> + 'f;

/// Goes to every list of key frames, in order.
fn walk<'a>(root: &mut DeTable<'a>, visit: &mut Visit<'a, '_>) -> Result<(), Flaw> {
    SHAPE.into_iter().try_for_each(|key| root.get_mut(key).map_or(Ok(()), |v| walk_in(key, v, visit)))
}

fn walk_in<'a>(key: &str, v: &mut Spanned<DeValue<'a>>, visit: &mut Visit<'a, '_>) -> Result<(), Flaw> {
    match v.get_mut() {
        DeValue::Table(t) => t.iter_mut().try_for_each(|(k, v)| walk_in(&format!("{key}.{}", k.get_ref()), v, visit)),
        DeValue::Array(list) if list.first().is_some_and(has_frame) => visit(key, v),
        DeValue::Array(list) => {
            list.iter_mut().enumerate().try_for_each(|(i, v)| walk_in(&format!("{key}[{i}]"), v, visit))
        }
        _ => Ok(()),
    }
}

/// True for a key frame.
pub(super) fn has_frame(v: &Spanned<DeValue<'_>>) -> bool {
    v.get_ref().as_table().is_some_and(|t| t.contains_key("frame"))
}

/// A key frame's number and value.
fn key_frame(key: &str, v: &Spanned<DeValue<'_>>) -> Result<(f64, Numbers), Flaw> {
    let flaw = |what: &str, span| Flaw::new(format!("{key}: {what}"), "write { frame = 1, value = 0.0 }", span);
    let table = v.get_ref().as_table().ok_or_else(|| flaw("is no key frame", v.span()))?;
    if let Some((other, _)) = table.iter().find(|(k, _)| !matches!(k.get_ref().as_ref(), "frame" | "value")) {
        return Err(flaw(&format!("unknown field `{}` of a key frame", other.get_ref()), other.span()));
    }
    let of = |name: &str| table.get(name).ok_or_else(|| flaw(&format!("missing field `{name}`"), v.span()));
    let (frame, value) = (of("frame")?, of("value")?);
    let read = |v: &Spanned<DeValue<'_>>| Numbers::read(v).map_err(|(what, span)| flaw(what, span));
    match read(frame)? {
        Numbers::One(frame_number) => Ok((frame_number, read(value)?)),
        Numbers::List(_) => Err(flaw("a frame is a number", frame.span())),
    }
}

impl Numbers {
    fn read(v: &Spanned<DeValue<'_>>) -> Result<Numbers, (&'static str, Range<usize>)> {
        let number = match v.get_ref() {
            DeValue::Array(list) => return list.iter().map(Numbers::read).collect::<Result<_, _>>().map(Numbers::List),
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            DeValue::Float(x) => x.as_str().parse().ok(),
            _ => return Err(("key frames hold numbers, or lists of them", v.span())),
        };
        match number {
            Some(x) if x.abs() <= LARGEST => Ok(Numbers::One(x)),
            _ => Err(("is out of range: key frames hold finite numbers", v.span())),
        }
    }

    /// The part `f` of the way from it to another; `None` if they do not hold as many numbers.
    fn toward(&self, to: &Numbers, f: f64) -> Option<Numbers> {
        match (self, to) {
            (Numbers::One(a), Numbers::One(b)) => Some(Numbers::One(a + (b - a) * f)),
            (Numbers::List(a), Numbers::List(b)) if a.len() == b.len() => {
                a.iter().zip(b).map(|(a, b)| a.toward(b, f)).collect::<Option<_>>().map(Numbers::List)
            }
            _ => None,
        }
    }
}

/// As a file would hold them: with a point, so that no whole number comes of them.
impl fmt::Display for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Numbers::One(x) => write!(f, "{x:?}"),
            Numbers::List(list) => {
                let all: Vec<String> = list.iter().map(ToString::to_string).collect();
                write!(f, "[{}]", all.join(", "))
            }
        }
    }
}

/// For the schema of a table: its numbers and lists of numbers may have key frames.
pub fn may_have_keys(schema: &mut Schema) {
    let properties = schema.get_mut("properties").and_then(Value::as_object_mut);
    // A cluster's roots stay where they are.
    let rooted = properties.as_ref().is_some_and(|p| ROOTED.iter().all(|key| p.contains_key(*key)));
    let may = |key: &str| !(rooted && ROOTED.contains(&key));
    let each = properties.into_iter().flatten().filter(|(key, p)| may(key) && is_numbers(p));
    for (_, property) in each {
        let mut value = property.clone();
        let rest: Vec<(&str, Value)> = ["description", "default"]
            .into_iter()
            .filter_map(|k| Some((k, value.as_object_mut()?.remove(k)?)))
            .collect();
        let key = json!({
            "type": "object",
            "properties": { "frame": { "type": "number" }, "value": value },
            "required": ["frame", "value"],
            "additionalProperties": false
        });
        *property = json!({ "anyOf": [value, { "type": "array", "items": key }] });
        rest.into_iter().for_each(|(k, v)| property[k] = v);
    }
}

/// True for the schema of a number, or of a list of such.
fn is_numbers(schema: &Value) -> bool {
    let is = |name: &str| match &schema["type"] {
        Value::Array(any) => any.iter().any(|t| t == name),
        one => one == name,
    };
    is("number") || is("array") && is_numbers(&schema["items"])
}
