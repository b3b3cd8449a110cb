//! A configuration file: its text, what it says, and where it says it.

use super::joined::Source;
use super::keys::{self, AllKeys, KeyFrames};
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceSpan};
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error as _};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// A complaint that points into a configuration file.
#[derive(Debug)]
pub struct ConfigError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong and what was expected.
    pub what: String,
    /// What the user can do; empty if there is nothing to add.
    pub help: String,
    pub(super) source: Box<NamedSource<String>>,
    pub(super) span: Option<SourceSpan>,
}

impl std::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line() {
            Some(line) => write!(f, "{}, line {line}: {}", self.path.display(), self.what),
            None => write!(f, "{}: {}", self.path.display(), self.what),
        }
    }
}

impl std::error::Error for ConfigError {}

impl Diagnostic for ConfigError {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        (!self.help.is_empty()).then(|| Box::new(&self.help) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        self.span.map(|_| &*self.source as &dyn miette::SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.span?;
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some("here".to_owned()), span))))
    }
}

impl ConfigError {
    /// Line of the complaint, from 1.
    pub fn line(&self) -> Option<usize> {
        let at = self.span?.offset().min(self.source.inner().len());
        Some(self.source.inner()[..at].matches('\n').count() + 1)
    }
}

/// An array of exactly N values. Plain arrays take the first N of a longer list and drop the rest in silence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed<T, const N: usize>(pub [T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Fixed<T, N> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let list = Vec::<T>::deserialize(d)?;
        let found = list.len();
        let wrong = |_| D::Error::invalid_length(found, &format!("an array of {N} values").as_str());
        list.try_into().map(Fixed).map_err(wrong)
    }
}

/// Reads an array of exactly N values.
pub fn exactly<'de, D, T, const N: usize>(d: D) -> Result<[T; N], D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Fixed::deserialize(d).map(|f| f.0)
}

/// Reads an array of exactly N values that may be left out.
pub fn some_exactly<'de, D, T, const N: usize>(d: D) -> Result<Option<[T; N]>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    exactly(d).map(Some)
}

/// A parsed file with its text, kept to point into.
#[derive(Clone, Debug)]
pub struct Document<T> {
    /// Where it was read.
    pub path: PathBuf,
    /// What it says.
    pub value: T,
    source: Source,
    /// Keys that other files than the first say, and which.
    elsewhere: BTreeMap<String, usize>,
    keys: AllKeys,
}

impl<T: DeserializeOwned> Document<T> {
    /// Reads and parses a file. Unknown keys are refused, with the nearest known one as advice.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        Self::of(Source::plain(path, read_text(path)?))
    }

    /// Reads a file with all that it includes and is like.
    pub fn read_joined(path: &Path) -> Result<Self, ConfigError> {
        Self::of(Source::joined(path, read_text(path)?)?)
    }

    /// Parses the text of a file.
    pub fn parse(path: &Path, text: String) -> Result<Self, ConfigError> {
        Self::of(Source::plain(path, text))
    }

    fn of(source: Source) -> Result<Self, ConfigError> {
        let mut tree = source.tree()?;
        let elsewhere = source.elsewhere(tree.get_ref());
        let keys = AllKeys::find(tree.get_mut()).map_err(|f| source.complaint(f))?;
        let value = read_at(&source, &keys, f64::MIN)?;
        Ok(Document { path: source.part[0].path.clone(), value, source, elsewhere, keys })
    }

    /// What it says at a frame number; `value` is what it says before the first key frame.
    pub fn at(&self, frame: f64) -> T {
        // Key frames hold numbers of one kind, so what is read at one frame is read at all.
        read_at(&self.source, &self.keys, frame).expect("it was read before")
    }

    /// It as it is at a frame number.
    pub(super) fn settled(&self, frame: f64) -> Self {
        let Document { path, source, elsewhere, keys, .. } = self;
        let (path, source, elsewhere, keys) = (path.clone(), source.clone(), elsewhere.clone(), keys.clone());
        Document { path, value: self.at(frame), source, elsewhere, keys }
    }
}

/// What a file says with the values of a frame number in the place of key frames.
fn read_at<T: DeserializeOwned>(source: &Source, keys: &AllKeys, frame: f64) -> Result<T, ConfigError> {
    let text = keys.text(frame);
    let mut tree = source.tree()?;
    keys::put(tree.get_mut(), &text);
    T::deserialize(toml::Deserializer::from(tree)).map_err(|e| {
        let whole = e.message().contains("floating point") && e.message().contains("expected usize");
        let help = match suggestion(e.message()) {
            None if whole => "write a whole number, without key frames".to_owned(),
            help => help.unwrap_or_default(),
        };
        source.error(e.span(), first_line(e.message()), help)
    })
}

fn read_text(path: &Path) -> Result<String, ConfigError> {
    let bytes = std::fs::read(path).map_err(|e| {
        let help = match e.kind() {
            std::io::ErrorKind::NotFound => "`pelage init DIR` makes a shot folder that runs as it is",
            _ => "",
        };
        plain(path, format!("can't be read: {e}"), help.to_owned())
    })?;
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        plain(path, format!("is not UTF-8 text (byte {at})"), "save it as UTF-8".to_owned())
    })
}

impl<T> Document<T> {
    /// Complains about a number at a key that is not between two others.
    pub(super) fn within(&self, key: &str, x: f64, low: f64, high: f64) -> Result<(), ConfigError> {
        if (low..=high).contains(&x) {
            return Ok(());
        }
        Err(self.error(key, format!("{x} is out of range"), format!("values go from {low} to {high}")))
    }

    /// A complaint about the value at a key such as `layer[0].length.value`; points at the longest part of the key that
    /// the file has.
    pub fn error(&self, key: &str, what: impl Into<String>, help: impl Into<String>) -> ConfigError {
        let span = self.source.tree().ok().and_then(|tree| span_of(tree.get_ref(), key));
        self.source.error(span, format!("{key}: {}", what.into()), help.into())
    }

    /// Values of combing and clusters that have key frames.
    pub fn keyed(&self) -> impl Iterator<Item = &KeyFrames> {
        self.keys.each()
    }

    /// The files that it was read from and their texts, the one that includes the others first.
    pub fn files(&self) -> impl Iterator<Item = (&Path, &str)> {
        self.source.files()
    }

    /// The file that says a key, or would.
    pub fn file_of(&self, key: &str) -> &Path {
        &self.source.part[self.elsewhere.get(key).copied().unwrap_or(0)].path
    }

    /// A path written in this file, relative to the file's folder.
    pub fn resolve(&self, written: &Path) -> PathBuf {
        match self.path.parent() {
            Some(folder) if written.is_relative() => tidy(&folder.join(written)),
            _ => tidy(written),
        }
    }
}

/// Takes `x/..` and `.` out of a path without asking the disk.
pub(super) fn tidy(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut out: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, out.last()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                out.pop();
            }
            _ => out.push(part),
        }
    }
    out.iter().collect()
}

fn plain(path: &Path, what: String, help: String) -> ConfigError {
    let source = Box::new(NamedSource::new(path.display().to_string(), String::new()));
    ConfigError { path: path.to_path_buf(), what, help, source, span: None }
}

pub(super) fn first_line(message: &str) -> String {
    message.lines().collect::<Vec<_>>().join("; ")
}

/// "unknown field `lenght`, expected one of `name`, `length`" -> "did you mean `length`?"
fn suggestion(message: &str) -> Option<String> {
    if !message.starts_with("unknown field") && !message.starts_with("unknown variant") {
        return None;
    }
    let mut quoted = message.split('`').skip(1).step_by(2);
    nearest(quoted.next()?, quoted)
}

/// "did you mean" the nearest of `known`, if one is near.
pub(super) fn nearest<'a>(wrong: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let (distance, best) = known.map(|k| (strsim::damerau_levenshtein(wrong, k), k)).min()?;
    (distance <= 1 + best.len().max(wrong.len()) / 3).then(|| format!("did you mean `{best}`?"))
}

/// Byte range of a key's value, or of the nearest enclosing value that exists.
fn span_of(root: &DeTable<'_>, key: &str) -> Option<Range<usize>> {
    let mut span = None;
    let mut at: Option<&DeValue<'_>> = None;
    for part in key.split('.') {
        let (name, indices) = part.split_once('[').map_or((part, ""), |(n, i)| (n, i));
        let next = match at {
            None => root.get(name),
            Some(DeValue::Table(t)) => t.get(name),
            Some(_) => None,
        };
        let Some(next) = next else { break };
        span = Some(next.span());
        at = Some(next.get_ref());
        for index in indices.split('[').filter_map(|i| i.trim_end_matches(']').parse::<usize>().ok()) {
            let Some(DeValue::Array(items)) = at else { break };
            let Some(item) = items.get(index) else { break };
            span = Some(item.span());
            at = Some(item.get_ref());
        }
    }
    span
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only parsed")]
    struct Inner {
        length: f64,
        #[serde(default)]
        points: u32,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only parsed")]
    struct Outer {
        layer: Vec<Inner>,
    }

    fn parse(text: &str) -> Result<Document<Outer>, ConfigError> {
        Document::parse(Path::new("a/b.toml"), text.to_owned())
    }

    #[test]
    fn unknown_keys_are_refused_with_the_line_and_the_nearest_name() {
        let e = parse("[[layer]]\nlength = 2\nlenght = 3\n").unwrap_err();
        assert_eq!(e.line(), Some(3));
        assert_eq!(e.help, "did you mean `length`?");
    }

    #[test]
    fn complaints_point_at_the_value() {
        let doc = parse("[[layer]]\nlength = 2\n\n[[layer]]\nlength = -1\n").unwrap();
        let e = doc.error("layer[1].length", "is negative", "");
        assert_eq!(e.to_string(), "a/b.toml, line 5: layer[1].length: is negative");
        assert_eq!(doc.error("layer[1].points", "is missing", "").line(), Some(4));
    }

    #[test]
    fn paths_are_relative_to_the_file() {
        let doc = parse("layer = []").unwrap();
        assert_eq!(doc.resolve(Path::new("../maps/x.png")), Path::new("maps/x.png"));
        assert_eq!(doc.resolve(Path::new("/x.png")), Path::new("/x.png"));
    }
}
