//! Files made of several: what `include`, `[style]` and `like` say is put together before anything reads it.
//!
//! All files lie one behind the other in one space of byte offsets, so that the span of a value says its file too.

use super::document::{ConfigError, first_line, nearest, tidy};
use super::keys::has_frame;
use miette::{NamedSource, SourceSpan};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Styles that every groom file may be like.
const PRESETS: &str = include_str!("presets.toml");

/// Their number among the parts of a joined file.
const PRESET: usize = 1;

/// Keys whose text is a path.
const PATHS: [&str; 3] = ["map", "file", "curves"];

/// A file of a joined one.
#[derive(Clone, Debug)]
pub struct Part {
    /// Where it was read.
    pub path: PathBuf,
    /// As it stands on disk, behind as much space as all files before it take.
    padded: String,
    /// Where its text begins.
    start: usize,
    /// Its folder as seen from that of the first file.
    folder: PathBuf,
    /// What it includes.
    includes: Vec<usize>,
}

impl Part {
    /// As it stands on disk.
    pub fn text(&self) -> &str {
        &self.padded[self.start..]
    }
}

/// The files of a joined one, the one that includes the others first.
#[derive(Clone, Debug)]
pub struct Source {
    /// The files.
    pub part: Vec<Part>,
    /// True if styles and includes are looked for.
    joins: bool,
}

/// What is wrong, and where.
#[derive(Debug)]
pub struct Flaw {
    what: String,
    help: String,
    span: Range<usize>,
}

impl Flaw {
    pub(super) fn new(what: String, help: &str, span: Range<usize>) -> Flaw {
        Flaw { what, help: help.to_owned(), span }
    }
}

impl Source {
    /// A text that includes nothing.
    pub fn plain(path: &Path, text: String) -> Self {
        let mut out = Source { part: Vec::new(), joins: false };
        out.add(path, text, PathBuf::new());
        out
    }

    /// The files that a person writes, the one that includes the others first.
    pub fn files(&self) -> impl Iterator<Item = (&Path, &str)> {
        let own = self.part.iter().enumerate().filter(|(k, _)| !self.is_preset(*k));
        own.map(|(_, p)| (p.path.as_path(), p.text()))
    }

    /// A text with all that it includes, and the presets.
    pub fn joined(path: &Path, text: String) -> Result<Self, ConfigError> {
        let mut out = Source { joins: true, ..Source::plain(path, text) };
        out.add(Path::new("presets"), PRESETS.to_owned(), PathBuf::new());
        out.include(0, &mut vec![tidy(path)])?;
        Ok(out)
    }

    fn add(&mut self, path: &Path, text: String, folder: PathBuf) -> usize {
        let start = self.part.last().map_or(0, |p| p.padded.len() + 1);
        let padded = " ".repeat(start) + &text;
        self.part.push(Part { path: path.to_path_buf(), padded, start, folder, includes: Vec::new() });
        self.part.len() - 1
    }

    /// Reads what a file includes; `within` are the files that include it.
    fn include(&mut self, k: usize, within: &mut Vec<PathBuf>) -> Result<(), ConfigError> {
        let named = match self.parsed(k)?.get_ref().get("include") {
            Some(list) => names(list, "include").map_err(|f| self.complaint(f))?,
            None => return Ok(()),
        };
        for (written, span) in named {
            let flaw = |what: String, help: &str| Flaw { what, help: help.to_owned(), span: span.clone() };
            let parent = |p: &Path| p.parent().unwrap_or(Path::new("")).to_path_buf();
            let path = tidy(&parent(&self.part[k].path).join(&written));
            if within.contains(&path) {
                let what = format!("include: {} includes itself", path.display());
                return Err(self.complaint(flaw(what, "take it out of one of the two")));
            }
            let known = (0..self.part.len()).find(|k| !self.is_preset(*k) && tidy(&self.part[*k].path) == path);
            let number = match known {
                Some(number) => number,
                None => {
                    let text = std::fs::read_to_string(&path).map_err(|e| {
                        let what = format!("include: {} can't be read: {e}", path.display());
                        self.complaint(flaw(what, "paths are relative to the file that names them"))
                    })?;
                    let folder = tidy(&self.part[k].folder.join(parent(Path::new(&written))));
                    let number = self.add(&path, text, folder);
                    within.push(path);
                    self.include(number, within)?;
                    within.pop();
                    number
                }
            };
            self.part[k].includes.push(number);
        }
        Ok(())
    }

    fn is_preset(&self, k: usize) -> bool {
        self.joins && k == PRESET
    }

    /// The number of the file where a byte lies.
    fn part_at(&self, byte: usize) -> usize {
        self.part.partition_point(|p| p.start <= byte).saturating_sub(1)
    }

    /// Keys of `root` that other files than the first say, and the number of the file.
    pub fn elsewhere(&self, root: &DeTable<'_>) -> BTreeMap<String, usize> {
        let mut out = BTreeMap::new();
        if self.joins {
            root.iter().for_each(|(key, v)| self.collect(key.get_ref().to_string(), v, &mut out));
        }
        out
    }

    fn collect(&self, key: String, v: &Spanned<DeValue<'_>>, out: &mut BTreeMap<String, usize>) {
        match v.get_ref() {
            DeValue::Table(t) => t.iter().for_each(|(k, v)| self.collect(format!("{key}.{}", k.get_ref()), v, out)),
            DeValue::Array(list) if lists_tables(list) => {
                list.iter().enumerate().for_each(|(k, v)| self.collect(format!("{key}[{k}]"), v, out));
            }
            _ => {}
        }
        match self.part_at(v.span().start) {
            0 => {}
            part => _ = out.insert(key, part),
        }
    }

    /// A complaint about a place.
    pub fn error(&self, span: Option<Range<usize>>, what: String, help: String) -> ConfigError {
        let k = self.part_at(span.as_ref().map_or(0, |s| s.start));
        let part = &self.part[k];
        let help = if self.is_preset(k) && help.is_empty() {
            "a table that is `like` this preset has no such key".to_owned()
        } else {
            help
        };
        let span = span.map(|s| {
            let text = part.text();
            let [from, to] = [s.start, s.end].map(|x| x.saturating_sub(part.start).min(text.len()));
            // A whole table would underline many lines: its first line says enough.
            let first = text.get(from..to).and_then(|t| t.find('\n')).map_or(to, |n| from + n);
            SourceSpan::from(from..first)
        });
        let source = Box::new(NamedSource::new(part.path.display().to_string(), part.text().to_owned()));
        ConfigError { path: part.path.clone(), what, help, source, span }
    }

    pub(super) fn complaint(&self, flaw: Flaw) -> ConfigError {
        self.error(Some(flaw.span), flaw.what, flaw.help)
    }

    fn parsed(&self, k: usize) -> Result<Spanned<DeTable<'_>>, ConfigError> {
        DeTable::parse(&self.part[k].padded).map_err(|e| self.error(e.span(), first_line(e.message()), String::new()))
    }

    /// All files as one.
    pub fn tree(&self) -> Result<Spanned<DeTable<'_>>, ConfigError> {
        let first = self.parsed(0)?;
        if !self.joins {
            return Ok(first);
        }
        let span = first.span();
        let mut once = vec![false; self.part.len()];
        let mut root = self.merged(0, first.into_inner(), &mut once)?;
        let mut styles = Styles::default();
        let mut presets = self.parsed(PRESET)?.into_inner();
        for named in [&mut root, &mut presets].into_iter().filter_map(|t| t.remove("style")) {
            let at = named.span();
            let DeValue::Table(named) = named.into_inner() else {
                let flaw = Flaw { what: "style: must be a table of styles".to_owned(), help: String::new(), span: at };
                return Err(self.complaint(flaw));
            };
            for (name, style) in named {
                styles.all.entry(name.into_inner().into_owned()).or_insert(style.into_inner());
            }
        }
        let mut value = DeValue::Table(root);
        styles.apply(&mut value, &mut Vec::new()).map_err(|f| self.complaint(f))?;
        let DeValue::Table(root) = value else { unreachable!("a table stays one") };
        Ok(Spanned::new(span, root))
    }

    /// A file on top of what it includes; each counts once.
    fn merged<'a>(&'a self, k: usize, mut own: DeTable<'a>, once: &mut [bool]) -> Result<DeTable<'a>, ConfigError> {
        once[k] = true;
        own.remove("include");
        own.iter_mut().for_each(|(_, v)| relocate(v.get_mut(), &self.part[k].folder));
        let mut out = DeTable::new();
        for &part in &self.part[k].includes {
            if !once[part] {
                merge(&mut out, self.merged(part, self.parsed(part)?.into_inner(), once)?);
            }
        }
        merge(&mut out, own);
        Ok(out)
    }
}

/// Paths in a file of another folder, as seen from that of the first.
fn relocate(v: &mut DeValue<'_>, folder: &Path) {
    match v {
        DeValue::Table(t) => {
            for (key, v) in t.iter_mut() {
                match v.get_mut() {
                    DeValue::String(s) if PATHS.contains(&key.get_ref().as_ref()) && folder != Path::new("") => {
                        *s = folder.join(s.as_ref()).to_string_lossy().into_owned().into();
                    }
                    v => relocate(v, folder),
                }
            }
        }
        DeValue::Array(a) => a.iter_mut().for_each(|v| relocate(v.get_mut(), folder)),
        _ => {}
    }
}

/// Puts a table on top of another: tables are joined key by key, tables of one name in lists of tables too; other tables of
/// such lists come last, and what else both have is taken from `over`, key frames as a whole.
fn merge<'a>(under: &mut DeTable<'a>, over: DeTable<'a>) {
    for (key, value) in over {
        let Some(below) = under.get_mut(&key) else {
            under.insert(key, value);
            continue;
        };
        let span = value.span();
        match (below.get_mut(), value.into_inner()) {
            (DeValue::Table(b), DeValue::Table(o)) => merge(b, o),
            (DeValue::Array(b), DeValue::Array(o))
                if lists_tables(b) && lists_tables(&o) && !o.iter().any(has_frame) =>
            {
                for item in o.iter().cloned() {
                    let name = name_of(item.get_ref());
                    let same = b.iter_mut().find(|i| name.is_some() && name_of(i.get_ref()) == name);
                    let at = item.span();
                    match (same.map(Spanned::get_mut), item.into_inner()) {
                        (Some(DeValue::Table(b)), DeValue::Table(o)) => merge(b, o),
                        (_, item) => b.push(Spanned::new(at, item)),
                    }
                }
            }
            (_, o) => *below = Spanned::new(span, o),
        }
    }
}

fn lists_tables(list: &[Spanned<DeValue<'_>>]) -> bool {
    !list.is_empty() && list.iter().all(|v| v.get_ref().is_table())
}

fn name_of<'v>(v: &'v DeValue<'_>) -> Option<&'v str> {
    v.as_table()?.get("name")?.get_ref().as_str()
}

/// Texts of a list, or the only one.
fn names(v: &Spanned<DeValue<'_>>, key: &str) -> Result<Vec<(String, Range<usize>)>, Flaw> {
    let one = |v: &Spanned<DeValue<'_>>| match v.get_ref() {
        DeValue::String(s) => Ok((s.to_string(), v.span())),
        _ => {
            Err(Flaw { what: format!("{key}: must be a text or a list of texts"), help: String::new(), span: v.span() })
        }
    };
    match v.get_ref() {
        DeValue::Array(list) => list.iter().map(one).collect(),
        _ => Ok(vec![one(v)?]),
    }
}

/// Named styles: those of the files, and presets of other names.
#[derive(Default)]
struct Styles<'a> {
    all: BTreeMap<String, DeValue<'a>>,
}

impl<'a> Styles<'a> {
    /// Puts every table that is `like` styles on top of them; `within` are the styles that are being put in.
    fn apply(&self, v: &mut DeValue<'a>, within: &mut Vec<String>) -> Result<(), Flaw> {
        match v {
            DeValue::Array(list) => list.iter_mut().try_for_each(|v| self.apply(v.get_mut(), within)),
            DeValue::Table(table) => {
                if let Some(like) = table.remove("like") {
                    let own = std::mem::take(table);
                    for (name, span) in names(&like, "like")? {
                        merge(table, self.style(&name, span, within)?);
                    }
                    merge(table, own);
                }
                table.iter_mut().try_for_each(|(_, v)| self.apply(v.get_mut(), within))
            }
            _ => Ok(()),
        }
    }

    /// A style with what it is like.
    fn style(&self, name: &str, span: Range<usize>, within: &mut Vec<String>) -> Result<DeTable<'a>, Flaw> {
        let flaw = |what: String, help: String| Flaw { what: format!("like: {what}"), help, span: span.clone() };
        let Some(style) = self.all.get(name) else {
            let help = nearest(name, self.all.keys().map(String::as_str))
                .unwrap_or_else(|| "name a [style.NAME] of this file or a preset".to_owned());
            return Err(flaw(format!("there is no style `{name}`"), help));
        };
        if within.iter().any(|w| w == name) {
            return Err(flaw(format!("the style `{name}` is like itself"), "take one of the two out".to_owned()));
        }
        let mut style = style.clone();
        within.push(name.to_owned());
        self.apply(&mut style, within)?;
        within.pop();
        match style {
            DeValue::Table(t) => Ok(t),
            _ => Err(flaw(format!("the style `{name}` is not a table"), format!("write [style.{name}]"))),
        }
    }
}

#[cfg(test)]
#[path = "joined_tests.rs"]
mod tests;
