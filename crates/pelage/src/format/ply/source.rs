//! A PLY file taken apart: header by `ply-rs`, then rows of one element at a time.
//!
//! The header is cleaned before it is parsed (line ends of any kind, comments in any encoding, odd names of properties
//! that nobody reads), because the parser is strict about things that old exporters are not. Rows of binary files are
//! parsed as they are. Rows of ascii files are reduced to the wanted values first, so that "nan" in a column that
//! nobody reads, ".5", and values over several lines do no harm.

use super::row::Row;
use crate::format::FormatError;
use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType};
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::Path;

/// Headers are a few hundred bytes; one that has not ended after this many is not a header.
const HEADER_LIMIT: usize = 1 << 20;

/// A PLY file in memory, read from the front.
pub(super) struct Source<'a> {
    /// Where it came from, for errors.
    pub path: &'a Path,
    /// The parsed header.
    pub header: Header,
    /// What has not been read yet.
    payload: &'a [u8],
    /// Line that `payload` starts on, counted from 1 (ascii only).
    line: usize,
    /// Scratch: the wanted values of one ascii row.
    row: String,
    /// Ascii rows with more values than the header declares, and the line of the first.
    long_rows: (usize, usize),
}

/// Which properties of an element are wanted, and under which one-letter slot [`Row`] keeps them.
pub(super) struct Plan {
    /// All properties, wanted ones renamed to their slots: what a binary row holds.
    binary: ElementDef,
    /// Only the wanted properties: what a reduced ascii row holds.
    ascii: ElementDef,
    /// Per property of the file: wanted or not.
    wanted: Vec<bool>,
}

/// Reads a whole file.
pub(in crate::format) fn read_bytes(path: &Path) -> Result<Vec<u8>, FormatError> {
    std::fs::read(path).map_err(|e| {
        let what = match e.kind() {
            ErrorKind::NotFound => "no such file".to_owned(),
            _ => format!("cannot be read: {e}"),
        };
        FormatError::new(path, what)
    })
}

impl<'a> Source<'a> {
    /// Parses the header of a file that is in memory.
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self, FormatError> {
        let (text, start, lines) = clean_header(path, bytes)?;
        let header = Parser::<Row<1>>::new()
            .read_header(&mut Reader::new(text.as_bytes()))
            .map_err(|e| FormatError::new(path, format!("the PLY header is wrong: {}", first_line(&e.to_string()))))?;
        for (name, element) in &header.elements {
            for p in element.properties.values() {
                if let PropertyType::List(ScalarType::Float | ScalarType::Double, _) = p.data_type {
                    let what = "the length of a list is declared as a real number; it must be an integer type";
                    return Err(FormatError::new(path, what).at(format!("element {name}, property {}", p.name)));
                }
            }
        }
        Ok(Source { path, header, payload: &bytes[start..], line: lines + 1, row: String::new(), long_rows: (0, 0) })
    }

    /// How many rows of `element` to make room for: what the header says, or fewer if the file cannot hold them.
    pub fn capacity(&self, element: &ElementDef) -> usize {
        let ascii = self.header.encoding == Encoding::Ascii;
        let least: usize = element
            .properties
            .values()
            .map(|p| match &p.data_type {
                _ if ascii => 2,
                PropertyType::Scalar(s) | PropertyType::List(s, _) => size(s),
            })
            .sum();
        self.payload.len().checked_div(least).map_or(0, |rows| element.count.min(rows + 1))
    }

    /// Reads all rows of `element`, which must be the next one of the file, and hands them to `each` with their index.
    pub fn rows<E: PropertyAccess>(
        &mut self,
        element: &ElementDef,
        plan: &Plan,
        mut each: impl FnMut(usize, E) -> Result<(), FormatError>,
    ) -> Result<(), FormatError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let parser = Parser::<E>::new();
        for i in 0..element.count {
            let row = match self.header.encoding {
                Encoding::Ascii => {
                    self.ascii_row(element, plan, i)?;
                    parser.read_ascii_element(&self.row, &plan.ascii)
                }
                Encoding::BinaryLittleEndian => parser.read_little_endian_element(&mut self.payload, &plan.binary),
                Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut self.payload, &plan.binary),
            };
            match row {
                Ok(row) => each(i, row)?,
                Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Err(self.truncated(element, i)),
                Err(e) if self.header.encoding == Encoding::Ascii => {
                    let what =
                        format!("'{}' does not fit the declared types ({})", self.row, first_line(&e.to_string()));
                    return Err(FormatError::new(self.path, what).at(self.place(element, i)));
                }
                Err(e) => {
                    return Err(FormatError::new(self.path, first_line(&e.to_string())).at(self.place(element, i)));
                }
            }
        }
        Ok(())
    }

    /// Passes over all rows of `element`.
    pub fn skip(&mut self, element: &ElementDef) -> Result<(), FormatError> {
        let fixed = element.properties.values().map(|p| match &p.data_type {
            PropertyType::Scalar(s) => Some(size(s)),
            PropertyType::List(..) => None,
        });
        let fixed: Option<usize> = fixed.sum();
        match fixed {
            Some(0) => Ok(()),
            Some(bytes) if self.header.encoding != Encoding::Ascii => {
                let there = self.payload.len() / bytes;
                if there < element.count {
                    return Err(self.truncated(element, there));
                }
                self.payload = &self.payload[bytes * element.count..];
                Ok(())
            }
            _ => self.rows(element, &Plan::new(element, &[]), |_, _: Row<1>| Ok(())),
        }
    }

    /// What of the file was passed over, in words: bytes after the last element, values after the last property.
    pub fn leftovers(&self) -> Vec<String> {
        let rest = self.payload.trim_ascii_start().len();
        let bytes = (rest > 0).then(|| format!("{rest} bytes after the last element were ignored"));
        let (rows, line) = self.long_rows;
        let values = (rows > 0).then(|| {
            format!(
                "{rows} lines have more values than the header declares, which were ignored (the first is line {line})"
            )
        });
        bytes.into_iter().chain(values).collect()
    }

    /// "vertex 7", with the line in ascii files.
    pub fn place(&self, element: &ElementDef, row: usize) -> String {
        match self.header.encoding {
            Encoding::Ascii => format!("line {}, {} {row}", self.line, element.name),
            _ => format!("{} {row}", element.name),
        }
    }

    fn truncated(&self, element: &ElementDef, row: usize) -> FormatError {
        let what = format!("the file ends after {row} of {} elements '{}'", element.count, element.name);
        FormatError::new(self.path, what).hint("the file was cut short or its header is wrong; export or copy it again")
    }

    /// Copies the wanted values of the next ascii row into `self.row`.
    fn ascii_row(&mut self, element: &ElementDef, plan: &Plan, i: usize) -> Result<(), FormatError> {
        self.row.clear();
        self.pass_blanks();
        let first_line = self.line;
        for (p, &wanted) in element.properties.values().zip(&plan.wanted) {
            let values = match p.data_type {
                PropertyType::Scalar(_) => 1,
                PropertyType::List(..) => {
                    let Some(token) = self.token() else { return Err(self.truncated(element, i)) };
                    let Some(n) = std::str::from_utf8(token).ok().and_then(|t| t.parse::<usize>().ok()) else {
                        let what = format!("'{}' is not the length of a list", String::from_utf8_lossy(token));
                        return Err(FormatError::new(self.path, what).at(self.value_place(element, i, p)));
                    };
                    if wanted {
                        push_value(&mut self.row, token);
                    }
                    n
                }
            };
            for _ in 0..values {
                let Some(token) = self.token() else { return Err(self.truncated(element, i)) };
                if wanted && !push_value(&mut self.row, token) {
                    let text = String::from_utf8_lossy(token);
                    let what = match looks_infinite(&text) {
                        true => format!("'{text}' is not a finite number"),
                        false => format!("'{text}' is not a number"),
                    };
                    return Err(FormatError::new(self.path, what).at(self.value_place(element, i, p)));
                }
            }
        }
        let end = self.payload.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(self.payload.len());
        let (rest, next) = self.payload.split_at(end);
        if rest.trim_ascii().is_empty() {
            return Ok(());
        }
        // On one line these are values that the header forgot. Over several, a value is missing.
        if first_line != self.line {
            let names: Vec<&str> = element.properties.keys().map(String::as_str).collect();
            let what = format!("more values on the line than the element has ({})", names.join(" "));
            return Err(FormatError::new(self.path, what).at(self.place(element, i)));
        }
        self.payload = next;
        self.long_rows = (self.long_rows.0 + 1, if self.long_rows.0 == 0 { self.line } else { self.long_rows.1 });
        Ok(())
    }

    fn value_place(&self, element: &ElementDef, row: usize, p: &PropertyDef) -> String {
        format!("{}, property {}", self.place(element, row), p.name)
    }

    /// Moves to the next word of an ascii payload and counts the lines on the way.
    fn pass_blanks(&mut self) {
        let mut at = 0;
        while at < self.payload.len() && self.payload[at].is_ascii_whitespace() {
            let next = self.payload.get(at + 1);
            if self.payload[at] == b'\n' || (self.payload[at] == b'\r' && next != Some(&b'\n')) {
                self.line += 1;
            }
            at += 1;
        }
        self.payload = &self.payload[at..];
    }

    /// The next word of an ascii payload.
    fn token(&mut self) -> Option<&'a [u8]> {
        self.pass_blanks();
        let end = self.payload.iter().position(u8::is_ascii_whitespace).unwrap_or(self.payload.len());
        let (word, rest) = self.payload.split_at(end);
        self.payload = rest;
        (end > 0).then_some(word)
    }
}

impl Plan {
    /// `wanted` pairs names of properties with slots. Scalars of integer type may be spelled "3.0" in ascii files.
    pub fn new(element: &ElementDef, wanted: &[(&str, char)]) -> Self {
        let mut plan = Plan::exact(element, wanted);
        for p in plan.ascii.properties.values_mut() {
            if !matches!(p.data_type, PropertyType::Scalar(ScalarType::Float) | PropertyType::List(..)) {
                p.data_type = PropertyType::Scalar(ScalarType::Double);
            }
        }
        plan
    }

    /// [`Plan::new`] with every type as it is declared.
    pub fn exact(element: &ElementDef, wanted: &[(&str, char)]) -> Self {
        let mut plan = Plan {
            binary: ElementDef::new(element.name.clone()),
            ascii: ElementDef::new(element.name.clone()),
            wanted: Vec::new(),
        };
        for (k, p) in element.properties.values().enumerate() {
            let slot = wanted.iter().find(|w| w.0 == p.name).map(|w| w.1);
            plan.wanted.push(slot.is_some());
            let name = slot.map_or_else(|| format!("~{k}"), String::from);
            plan.binary.properties.add(PropertyDef::new(name.clone(), p.data_type.clone()));
            if slot.is_some() {
                plan.ascii.properties.add(PropertyDef::new(name, p.data_type.clone()));
            }
        }
        plan
    }
}

/// Bytes of a binary value.
fn size(s: &ScalarType) -> usize {
    match s {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

fn first_line(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':').trim().to_owned()
}

/// Spellings of values that are no numbers: nan, -nan(ind), inf, Infinity, 1.#QNAN.
fn looks_infinite(text: &str) -> bool {
    let t = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    t.starts_with("nan") || t.starts_with("inf") || t.contains('#')
}

/// Appends an ascii number in the spelling that the parser takes (".5" as "0.5", "1." as "1.0"); false if it is none.
fn push_value(row: &mut String, token: &[u8]) -> bool {
    let (sign, body) = match token {
        [b'-', rest @ ..] => ("-", rest),
        [b'+', rest @ ..] => ("", rest),
        _ => ("", token),
    };
    let digits = |s: &[u8]| s.iter().take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(body);
    let fraction = match body.get(whole) {
        Some(b'.') => &body[whole + 1..whole + 1 + digits(&body[whole + 1..])],
        _ => &[],
    };
    let mut end = whole + fraction.len() + usize::from(body.get(whole) == Some(&b'.'));
    if whole + fraction.len() == 0 {
        return false;
    }
    let mut exponent: &[u8] = &[];
    if let Some(b'e' | b'E') = body.get(end) {
        let signed = usize::from(matches!(body.get(end + 1), Some(b'-' | b'+')));
        let n = digits(&body[(end + 1 + signed).min(body.len())..]);
        if n == 0 {
            return false;
        }
        exponent = &body[end..end + 1 + signed + n];
        end += exponent.len();
    }
    if end != body.len() {
        return false;
    }
    if !row.is_empty() {
        row.push(' ');
    }
    let mut ascii = |bytes: &[u8]| row.extend(bytes.iter().map(|&b| char::from(b)));
    ascii(sign.as_bytes());
    ascii(if whole == 0 { b"0" } else { &body[..whole] });
    if !fraction.is_empty() {
        ascii(b".");
        ascii(fraction);
    }
    ascii(exponent);
    true
}

/// The header with plain line ends, UTF-8 text and plain names; where the payload starts; and how many lines it had.
fn clean_header(path: &Path, bytes: &[u8]) -> Result<(String, usize, usize), FormatError> {
    let mut at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    if !bytes[at..].starts_with(b"ply") {
        return Err(not_ply(path, bytes));
    }
    let first = bytes[at..].iter().position(|b| matches!(b, b'\r' | b'\n')).map_or(bytes.len(), |p| at + p);
    let old_mac = bytes.get(first) == Some(&b'\r') && bytes.get(first + 1) != Some(&b'\n');
    let end_of_line = if old_mac { b'\r' } else { b'\n' };
    let (mut text, mut number) = (String::new(), 0);
    let mut declared = Declared::default();
    loop {
        let Some(length) = bytes[at..].iter().position(|&b| b == end_of_line).filter(|_| at < HEADER_LIMIT) else {
            // The last line may lack its line end, and a file without elements may end with it.
            if bytes[at..].trim_ascii() == b"end_header" {
                text.push_str("end_header\n");
                return Ok((text, bytes.len(), number + 1));
            }
            return Err(FormatError::new(path, "the header does not end: the line 'end_header' is missing"));
        };
        number += 1;
        let line = String::from_utf8_lossy(&bytes[at..at + length]).replace('\r', " ");
        at += length + 1;
        let here = |what: String| FormatError::new(path, what).at(format!("line {number}"));
        let line = clean_line(line.trim(), &mut declared).map_err(here)?;
        if line.is_empty() {
            continue;
        }
        if Parser::<Row<1>>::new().read_header_line(&line).is_err() {
            let hint = "expected format, comment, obj_info, element NAME COUNT, property TYPE NAME or end_header";
            return Err(here(format!("'{line}' is not a line of a PLY header")).hint(hint));
        }
        text.push_str(&line);
        text.push('\n');
        if line == "end_header" {
            return Ok((text, at, number));
        }
    }
}

/// Names declared so far in a header.
#[derive(Default)]
struct Declared {
    /// Elements as "name", properties as "element.name".
    names: BTreeSet<String>,
    /// The last element.
    element: String,
}

/// One header line in the parser's spelling; empty for a blank line.
fn clean_line(line: &str, declared: &mut Declared) -> Result<String, String> {
    let mut words: Vec<&str> = line.split_whitespace().collect();
    let slot = match words.first().copied() {
        Some("element") if words.len() == 3 => 1,
        Some("property") if words.len() >= 3 => words.len() - 1,
        Some("comment" | "obj_info") => return Ok(line.to_owned()),
        _ => return Ok(words.join(" ")),
    };
    if slot == 1 && words[2].parse::<usize>().is_err() {
        return Err(format!("element '{}' has no count: '{}' is not a whole number in range", words[1], words[2]));
    }
    let raw = words[slot];
    let mut plain: String =
        raw.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' }).collect();
    if !plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        plain.insert(0, '_');
    }
    let scope = if slot == 1 { String::new() } else { format!("{}.", declared.element) };
    if plain == raw && declared.names.contains(&format!("{scope}{plain}")) {
        return Err(format!("{} '{raw}' is declared twice", words[0]));
    }
    while !declared.names.insert(format!("{scope}{plain}")) {
        plain.push('_');
    }
    if slot == 1 {
        declared.element.clone_from(&plain);
    }
    words[slot] = &plain;
    Ok(words.join(" "))
}

fn not_ply(path: &Path, bytes: &[u8]) -> FormatError {
    let kind = match bytes {
        [] => "the file is empty",
        [0x1f, 0x8b, ..] => "not a PLY file: it is compressed with gzip",
        [b'v' | b'o' | b'#' | b'm', b' ' | b't', ..] => "not a PLY file: it looks like an OBJ file",
        _ => "not a PLY file: it does not start with the line 'ply'",
    };
    FormatError::new(path, kind).hint("export it as PLY, ascii or binary")
}

#[cfg(test)]
mod tests {
    use super::super::mesh::parse_mesh;
    use super::super::samples::quads;
    use super::*;

    fn mesh(bytes: &[u8]) -> Result<super::super::ReadMesh, FormatError> {
        parse_mesh(Path::new("s.ply"), bytes)
    }

    /// `file` with text replaced in its header.
    fn edited(file: &[u8], from: &str, to: &[u8]) -> Vec<u8> {
        let at = file.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&file[..at], to, &file[at + from.len()..]].concat()
    }

    fn with_line_ends(file: &[u8], end: &str, all: bool) -> Vec<u8> {
        let mark = b"end_header\n";
        let split = file.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
        let change = |part: &[u8]| String::from_utf8(part.to_vec()).unwrap().replace('\n', end).into_bytes();
        let tail = if all { change(&file[split..]) } else { file[split..].to_vec() };
        [change(&file[..split]), tail].concat()
    }

    #[test]
    fn line_ends_of_every_machine() {
        for end in ["\r\n", "\r"] {
            let ascii = quads("ascii");
            assert_eq!(mesh(&with_line_ends(&ascii, end, true)).unwrap(), mesh(&ascii).unwrap());
            for binary in [quads("binary_little_endian"), quads("binary_big_endian")] {
                assert_eq!(mesh(&with_line_ends(&binary, end, false)).unwrap(), mesh(&binary).unwrap());
            }
        }
        // Old Mac header, and a payload that starts with a line feed.
        let text = "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty uchar x\rproperty uchar y\rproperty uchar z\relement face 1\rproperty list uchar uchar vertex_indices\rend_header\r";
        let m = mesh(&[text.as_bytes(), &[10, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0, 1, 2]].concat()).unwrap();
        assert_eq!(m.mesh.position[0], [10.0, 0.0, 0.0]);
    }

    #[test]
    fn headers_that_old_exporters_write() {
        for file in [quads("ascii"), quads("binary_little_endian")] {
            let want = mesh(&file).unwrap();
            let same = |bytes: Vec<u8>| assert_eq!(mesh(&bytes).unwrap(), want);
            same(edited(&file, "comment by hand", b"comment Caf\xe9 \xff\xfe"));
            same(edited(&file, "comment by hand", b"obj_info num_cols 5\ncomment\n\ncomment  \t x"));
            same(edited(&file, "property float x", b"property  float\tx "));
            same([b"\xef\xbb\xbf", &file[..]].concat());
        }
        let odd = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float 2nd.value\nproperty float 2nd-value\nproperty float x\nproperty float y\nproperty float z\nelement my.thing 1\nproperty int a\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n9 9 0 0 0\n9 9 1 0 0\n9 9 0 1 0\n5\n3 0 1 2";
        assert_eq!(mesh(odd.as_bytes()).unwrap().mesh.position[1], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn broken_headers_are_named_by_line() {
        let file = quads("ascii");
        let error = |from: &str, to: &str| mesh(&edited(&file, from, to.as_bytes())).unwrap_err().to_string();
        assert!(error("property float y", "property float x").contains("(line 6): property 'x' is declared twice"));
        assert!(error("element face", "element vertex").contains("element 'vertex' is declared twice"));
        assert!(
            error("property float y", "property flaot y")
                .contains("(line 6): 'property flaot y' is not a line of a PLY header")
        );
        assert!(error("element vertex 6", "element vertex six").contains("(line 4)"));
        assert!(error("element vertex 6", "property float q\nelement vertex 6").contains("without preceding element"));
        assert!(error("format ascii 1.0\n", "").contains("No format line"));
        assert!(error("end_header", "end_head").contains("(line "));
        assert!(error("list uchar int", "list float int").contains("must be an integer type"));
        assert!(error("ply\n", "plyx\n").contains("(line 1)"));
        let start = |bytes: &[u8]| mesh(bytes).unwrap_err().what;
        assert!(start(b"").contains("empty"));
        assert!(start(b"\x1f\x8b\x08").contains("gzip"));
        assert!(start(b"v 0 0 0\n").contains("OBJ"));
        assert!(start(b"solid x").contains("not a PLY file"));
        assert!(start(b"ply\nformat ascii 1.0\nelement vertex 3\n").contains("'end_header' is missing"));
        assert!(start(b"ply\nformat ascii 1.0\nend_header").contains("no element 'vertex'"));
    }

    #[test]
    fn ascii_numbers_in_every_spelling() {
        let spelled = |text: &str| {
            let mut row = String::new();
            push_value(&mut row, text.as_bytes()).then_some(row)
        };
        for (text, want) in [
            ("1", "1"),
            (".5", "0.5"),
            ("-.5e3", "-0.5e3"),
            ("+7.", "7"),
            ("1.e-3", "1e-3"),
            ("-0.25E+2", "-0.25E+2"),
            ("034", "034"),
        ] {
            assert_eq!(spelled(text).as_deref(), Some(want));
            assert_eq!(spelled(text).unwrap().parse::<f64>().ok(), text.parse::<f64>().ok());
        }
        for text in ["", ".", "-", "e5", "1e", "1e+", "1.2.3", "0x10", "nan", "inf", "1,5", "--1", "1f"] {
            assert_eq!(spelled(text), None, "{text}");
        }
    }

    #[test]
    fn ascii_rows_over_several_lines_and_rows_that_are_too_long() {
        let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty int z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let m = mesh(format!("{head}\n0 0\n0\n\n 1. .5 2.0 \n0 1\t3\n\n3 0 1\n2").as_bytes()).unwrap();
        assert_eq!(m.mesh.position, [[0.0; 3], [1.0, 0.5, 2.0], [0.0, 1.0, 3.0]]);
        let e = mesh(format!("{head}0 0 0\n1 0\n0 1 0\n0 0 0\n3 0 1 2\n").as_bytes()).unwrap_err().to_string();
        assert!(e.contains("(line 12, vertex 1): more values on the line than the element has (x y z)"), "{e}");
        let m = mesh(format!("{head}0 0 0\n1 0 0 7 7\n0 1 0\n3 0 1 2 8\n").as_bytes()).unwrap();
        assert_eq!(m.mesh.triangle, [[0, 1, 2]]);
        assert!(m.warnings[0].contains("2 lines have more values") && m.warnings[0].contains("line 11"), "{m:?}");
        let e = mesh(format!("{head}0 0 0\n1 0 0\n0 1 0\n3 0 1.5 2\n").as_bytes()).unwrap_err().to_string();
        assert!(e.contains("face 0") && e.contains("'3 0 1.5 2' does not fit"), "{e}");
        let e = mesh(format!("{head}0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n").as_bytes()).unwrap_err().to_string();
        assert!(e.contains("'-3' is not the length of a list"), "{e}");
    }
}
