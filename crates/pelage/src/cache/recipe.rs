//! A recipe: everything that a step's result depends on, field by field. Its hash is the step's key.

use serde::{Deserialize, Serialize};

/// Key of a step: 128 bits of BLAKE3 over its recipe, as 32 hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Key(pub String);

/// One thing that a step reads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Field {
    /// What it is to the step; enters the key.
    pub name: String,
    /// Its value, or a hash of its content; enters the key.
    pub value: String,
    /// Where a person finds it (`grooms/fox.toml: layer[0].length.value`, `maps/length.png`); does not enter the key.
    pub label: String,
    /// True if the value is the key of another step: a change there has reasons of its own.
    pub is_step: bool,
    /// True if the value is a hash, which tells a person nothing.
    pub is_hash: bool,
}

/// Everything that a step's result depends on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recipe {
    /// Stage and part: `instance/length`.
    pub stage: String,
    /// Raised whenever the code of the stage gives other results.
    pub version: u32,
    /// What it reads.
    pub fields: Vec<Field>,
}

impl Recipe {
    /// A recipe that reads nothing yet.
    pub fn new(stage: &str, version: u32) -> Self {
        Recipe { stage: stage.to_owned(), version, fields: Vec::new() }
    }

    /// Adds a parameter.
    pub fn param(mut self, name: &str, value: impl ToString, label: impl Into<String>) -> Self {
        self.push(name, value.to_string(), label.into(), false, false);
        self
    }

    /// Adds the content of a file.
    pub fn file(mut self, name: &str, hash: &str, label: impl Into<String>) -> Self {
        self.push(name, hash.to_owned(), label.into(), false, true);
        self
    }

    /// Adds the result of another step.
    pub fn step(mut self, name: &str, key: &Key) -> Self {
        self.push(name, key.0.clone(), name.to_owned(), true, true);
        self
    }

    /// Appends all fields of a list.
    pub fn with(mut self, fields: impl IntoIterator<Item = Field>) -> Self {
        self.fields.extend(fields);
        self
    }

    fn push(&mut self, name: &str, value: String, label: String, is_step: bool, is_hash: bool) {
        self.fields.push(Field { name: name.to_owned(), value, label, is_step, is_hash });
    }

    /// Hash over stage, version, names and values, each preceded by its length.
    pub fn key(&self) -> Key {
        let mut hasher = blake3::Hasher::new();
        let mut add = |text: &str| {
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        };
        add(&self.stage);
        add(&self.version.to_string());
        for f in &self.fields {
            add(&f.name);
            add(&f.value);
        }
        Key(hasher.finalize().to_hex()[..32].to_owned())
    }

    /// What differs from an earlier recipe of the same step, for a person; changes of other steps are left out, they
    /// have reasons of their own.
    pub fn changes(&self, before: &Recipe) -> Vec<String> {
        if self.version != before.version {
            return vec![format!("{} works differently in this version", self.stage)];
        }
        let old = |name: &str| before.fields.iter().find(|f| f.name == name);
        let mut out = Vec::new();
        for f in &self.fields {
            match old(&f.name) {
                Some(o) if o.value == f.value || f.is_step => {}
                Some(o) if f.is_hash && o.is_hash => out.push(format!("{} changed", f.label)),
                Some(o) if f.is_hash => out.push(format!("{} added", or(&f.label, &o.label))),
                Some(o) if o.is_hash => out.push(format!("{} taken out", o.label)),
                Some(o) => out.push(format!("{} {} -> {}", f.label, o.value, f.value)),
                None if f.is_step => {}
                None => out.push(format!("{} added", f.label)),
            }
        }
        let gone = before.fields.iter().filter(|o| !o.is_step && !self.fields.iter().any(|f| f.name == o.name));
        out.extend(gone.map(|o| format!("{} taken out", o.label)));
        out
    }
}

fn or<'a>(a: &'a str, b: &'a str) -> &'a str {
    if a.is_empty() { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(length: f64, label: &str) -> Recipe {
        Recipe::new("instance/length", 1).param("value", length, label).file("map", "aa", "maps/l.png")
    }

    #[test]
    fn labels_do_not_enter_the_key_and_values_do() {
        assert_eq!(recipe(1.0, "a").key(), recipe(1.0, "b").key());
        assert_ne!(recipe(1.0, "a").key(), recipe(2.0, "a").key());
        assert_ne!(Recipe::new("a", 1).key(), Recipe::new("a", 2).key());
        let split = |a: &str, b: &str| Recipe::new("s", 1).param(a, b, "").key();
        assert_ne!(split("ab", "c"), split("a", "bc"));
    }

    #[test]
    fn changes_name_the_field_with_both_values() {
        assert_eq!(recipe(2.0, "g.toml: length").changes(&recipe(1.0, "x")), ["g.toml: length 1 -> 2"]);
        let other = Recipe::new("instance/length", 1).param("value", 1.0, "v").file("map", "bb", "maps/l.png");
        assert_eq!(other.changes(&recipe(1.0, "v")), ["maps/l.png changed"]);
        assert!(recipe(1.0, "v").changes(&recipe(1.0, "w")).is_empty());
    }
}
