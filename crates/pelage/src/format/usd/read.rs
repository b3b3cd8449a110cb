//! A reader of crate files, versions 0.0.1 to 0.13. It never trusts a size or an offset: every one is compared with
//! the length of the file before memory is asked for, so that a broken file is an error and nothing else.

use super::coding::decode_ints;
pub(super) use super::tables::Node;
use super::tables::{NEWEST, TABLES, Tables};
use super::{BOOTSTRAP, END_OF_SET, MAGIC, Number, Rep, Type, spec};
use crate::format::FormatError;
use crate::format::bytes::{Broken, Bytes};
use crate::format::check::read_error;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, FormatError>;

/// Shorter arrays are never packed.
const SHORTEST_PACKED: u64 = 16;

/// An open file: its tables in memory, its values read on demand.
pub(super) struct CrateFile {
    path: PathBuf,
    file: File,
    len: u64,
    tables: Tables,
}

impl CrateFile {
    /// Opens a file and reads its tables.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| read_error(path, &e))?;
        let len = file.metadata().map_err(|e| read_error(path, &e))?.len();
        let mut crate_file = CrateFile { path: path.to_path_buf(), file, len, tables: Tables::default() };
        let sections = crate_file.read_head()?;
        crate_file.read_tables(&sections)?;
        Ok(crate_file)
    }

    /// An error about this file.
    pub(super) fn bad(&self, what: impl Into<String>) -> FormatError {
        FormatError::new(&self.path, what)
    }

    fn bad_at(&self, at: u64, what: impl Into<String>) -> FormatError {
        self.bad(what).at(format!("byte {at}"))
    }

    /// Reads `n` bytes at `at`.
    fn block(&mut self, at: u64, n: u64) -> Result<Vec<u8>> {
        self.check_span(at, n)?;
        let mut out = vec![0; n as usize];
        self.read_into(at, &mut out)?;
        Ok(out)
    }

    fn check_span(&self, at: u64, n: u64) -> Result<()> {
        match at.checked_add(n) {
            Some(end) if end <= self.len => Ok(()),
            _ => Err(self
                .bad_at(at, format!("{n} bytes are announced, but the file ends at byte {}", self.len))
                .hint("the file is damaged or was not written to the end: export it again")),
        }
    }

    fn read_into(&mut self, at: u64, out: &mut [u8]) -> Result<()> {
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(out));
        read.map_err(|e| read_error(&self.path, &e))
    }

    fn u64_at(&mut self, at: u64) -> Result<u64> {
        self.check_span(at, 8)?;
        let mut out = [0; 8];
        self.read_into(at, &mut out)?;
        Ok(u64::from_le_bytes(out))
    }

    /// Checks mark and version; returns (name, start, length) of the sections.
    fn read_head(&mut self) -> Result<Vec<(String, u64, u64)>> {
        let head = self.block(0, self.len.min(BOOTSTRAP))?;
        if head.starts_with(b"#usda") || head.starts_with(b"PK") {
            let kind = if head[0] == b'#' { "a text file (.usda)" } else { "a package (.usdz)" };
            return Err(self.bad(format!("is {kind}, only binary USD (.usdc) is read")).hint(
                "convert it first: `usdcat -o hair.usdc FILE`, or Export as .usdc from the application it comes from",
            ));
        }
        if head.len() < BOOTSTRAP as usize || !head.starts_with(MAGIC) {
            return Err(self
                .bad("is not a binary USD file (it does not start with \"PXR-USDC\")")
                .hint("if it is an export that was interrupted, export it again"));
        }
        self.tables.version = [head[8], head[9], head[10]];
        let [major, minor, patch] = self.tables.version;
        if major > 0 || minor > NEWEST {
            return Err(self
                .bad(format!("has crate version {major}.{minor}.{patch}, versions up to 0.{NEWEST} are read"))
                .hint("write it again with an older version, e.g. USD_WRITE_NEW_USDC_FILES_AS_VERSION=0.8.0"));
        }
        let mut input = Bytes::new(&head[16..]);
        let at = input.u64().map_err(|e| self.bad(e))?;
        let count = self.u64_at(at)?;
        let table = self.block(at + 8, count.saturating_mul(32))?;
        let mut input = Bytes::new(&table);
        let mut section = || -> std::result::Result<_, Broken> {
            let name = String::from_utf8_lossy(input.take(16)?).trim_end_matches('\0').to_string();
            Ok((name, input.u64()?, input.u64()?))
        };
        (0..count).map(|_| section()).collect::<std::result::Result<_, _>>().map_err(|e| self.bad_at(at, e))
    }

    fn read_tables(&mut self, sections: &[(String, u64, u64)]) -> Result<()> {
        for (name, parse) in TABLES {
            let Some((_, start, len)) = sections.iter().find(|s| s.0 == name) else {
                return Err(self.bad(format!("has no section {name}")));
            };
            let bytes = self.block(*start, *len)?;
            parse(&mut self.tables, Bytes::new(&bytes), *start)
                .map_err(|e| self.bad_at(*start, format!("section {name}: {e}")))?;
        }
        Ok(())
    }

    /// The root of the tree.
    pub(super) fn root(&self) -> Node {
        self.tables.root
    }

    /// Name of a prim or property.
    pub(super) fn name(&self, node: Node) -> &str {
        let name = self.tables.nodes.get(node as usize).copied().flatten().map_or(u32::MAX, |n| n.name);
        self.tables.tokens.get(name as usize).map_or("?", |s| s)
    }

    /// The parent of a prim or property, `None` for the root.
    pub(super) fn parent(&self, node: Node) -> Option<Node> {
        self.tables.nodes.get(node as usize).copied().flatten()?.parent
    }

    /// The prims below `node`, in the order of the file.
    pub(super) fn prims_below(&mut self, node: Node) -> Result<Vec<Node>> {
        let Some(rep) = self.field(node, "primChildren") else { return Ok(vec![]) };
        let mut seen = BTreeSet::new();
        let mut names = self.token_numbers_of(rep)?;
        names.retain(|&n| seen.insert(n)); // a broken file may name one twice
        Ok(names.iter().filter_map(|&n| self.tables.children.get(&(node, false, n)).copied()).collect())
    }

    /// The attribute `name` of a prim.
    pub(super) fn attribute(&self, prim: Node, name: &str) -> Option<Node> {
        let name = self.tables.token_numbers.get(name)?;
        let node = *self.tables.children.get(&(prim, true, *name))?;
        let (_, kind) = (*self.tables.specs.get(node as usize)?)?;
        (kind == spec::ATTRIBUTE).then_some(node)
    }

    /// The field `name` of a prim or property.
    pub(super) fn field(&self, node: Node, name: &str) -> Option<Rep> {
        let name = *self.tables.token_numbers.get(name)?;
        let (set, _) = (*self.tables.specs.get(node as usize)?)?;
        let set = self.tables.sets.get(set as usize..)?;
        let fields = set.iter().take_while(|&&f| f != END_OF_SET).filter_map(|&f| self.tables.fields.get(f as usize));
        fields.into_iter().find(|f| f.0 == name).map(|f| f.1)
    }

    fn kind(&self, rep: Rep) -> Result<Type> {
        let unknown = |code| self.bad(format!("a value has type {code}, which curves cannot have"));
        let kind = rep.kind().map_err(unknown)?;
        if rep.is(Rep::EDIT) { Err(self.bad("a value is an edit of an array, which is not read")) } else { Ok(kind) }
    }

    fn token_text(&self, number: u64) -> Result<String> {
        let token = usize::try_from(number).ok().and_then(|n| self.tables.tokens.get(n));
        token.cloned().ok_or_else(|| self.bad(format!("refers to token {number}, which does not exist")))
    }

    /// Text of a token or string value.
    pub(super) fn text(&self, rep: Rep) -> Result<String> {
        match self.kind(rep)? {
            Type::Token if rep.is(Rep::INLINE) => self.token_text(rep.payload()),
            Type::String if rep.is(Rep::INLINE) => {
                let number = usize::try_from(rep.payload()).ok().and_then(|n| self.tables.strings.get(n));
                self.token_text(number.map_or(u64::MAX, |&n| u64::from(n)))
            }
            other => Err(self.bad(format!("a value has type {other:?}, expected text"))),
        }
    }

    fn token_numbers_of(&mut self, rep: Rep) -> Result<Vec<u32>> {
        let (at, count) = match self.kind(rep)? {
            Type::TokenVector => (rep.payload() + 8, self.u64_at(rep.payload())?),
            Type::Token if rep.is(Rep::ARRAY) => self.span(rep)?,
            other => return Err(self.bad(format!("a value has type {other:?}, expected tokens"))),
        };
        let bytes = self.block(at, count.saturating_mul(4))?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect())
    }

    /// Texts of an array of tokens.
    pub(super) fn tokens(&mut self, rep: Rep) -> Result<Vec<String>> {
        self.token_numbers_of(rep)?.into_iter().map(|n| self.token_text(u64::from(n))).collect()
    }

    /// First byte and number of elements of an array.
    fn span(&mut self, rep: Rep) -> Result<(u64, u64)> {
        let mut at = rep.payload();
        if at == 0 {
            return Ok((0, 0));
        }
        if !self.tables.at_least(5) {
            at += 4; // a rank that is always 1
        }
        if self.tables.at_least(7) {
            return Ok((at + 8, self.u64_at(at)?));
        }
        let mut count = [0; 4];
        self.check_span(at, 4)?;
        self.read_into(at, &mut count)?;
        Ok((at + 4, u64::from(u32::from_le_bytes(count))))
    }

    /// Number of elements of an array; 1 for a single value.
    pub(super) fn array_len(&mut self, rep: Rep) -> Result<u64> {
        if rep.is(Rep::ARRAY) { Ok(self.span(rep)?.1) } else { Ok(1) }
    }

    /// The numbers of an array (or of a single value, as an array of one), `arity` to an element.
    pub(super) fn floats(&mut self, rep: Rep, arity: usize) -> Result<Vec<f32>> {
        let (number, n) = self.number_kind(rep, arity)?;
        if number == Number::F32 && rep.is(Rep::ARRAY) && !rep.is(Rep::COMPRESSED) {
            let (at, count) = self.span(rep)?;
            self.check_span(at, count.saturating_mul(4 * n as u64))?;
            let mut out = vec![0f32; count as usize * n];
            self.read_into(at, bytemuck::cast_slice_mut(&mut out))?;
            return Ok(out);
        }
        Ok(self.numbers(rep)?.into_iter().map(|v| v as f32).collect())
    }

    /// The whole numbers of an array (or of a single value, as an array of one).
    pub(super) fn integers(&mut self, rep: Rep) -> Result<Vec<i64>> {
        let (number, _) = self.number_kind(rep, 1)?;
        let wide = match number {
            Number::F16 | Number::F32 | Number::F64 => return Err(self.bad("has fractions where whole numbers belong")),
            Number::I64 | Number::U64 => true,
            _ => false,
        };
        if !rep.is(Rep::ARRAY) {
            return Ok(self.numbers(rep)?.into_iter().map(|v| v as i64).collect());
        }
        let (at, count) = self.span(rep)?;
        if rep.is(Rep::COMPRESSED) && self.tables.at_least(5) && count >= SHORTEST_PACKED {
            return Ok(self.packed_ints(at, count, wide)?.0);
        }
        let bytes = self.block(at, count.saturating_mul(number.size() as u64))?;
        Ok(match number {
            Number::U8 => bytes.iter().map(|&b| i64::from(b)).collect(),
            Number::U32 => bytes.as_chunks().0.iter().map(|b| i64::from(u32::from_le_bytes(*b))).collect(),
            Number::I32 => bytes.as_chunks().0.iter().map(|b| i64::from(i32::from_le_bytes(*b))).collect(),
            _ => bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b)).collect(),
        })
    }

    fn number_kind(&self, rep: Rep, arity: usize) -> Result<(Number, usize)> {
        let kind = self.kind(rep)?;
        match kind.numbers() {
            Some((number, n)) if n == arity => Ok((number, n)),
            _ => Err(self.bad(format!("a value has type {kind:?}, expected {arity} numbers an element"))),
        }
    }

    /// All numbers of a value made of numbers.
    pub(super) fn numbers(&mut self, rep: Rep) -> Result<Vec<f64>> {
        let kind = self.kind(rep)?;
        let Some((number, n)) = kind.numbers() else {
            return Err(self.bad(format!("a value has type {kind:?}, expected numbers")));
        };
        let size = (number.size() * n) as u64;
        if !rep.is(Rep::ARRAY) {
            if rep.is(Rep::INLINE) {
                return Ok(inline_numbers(rep, kind, number, n));
            }
            return Ok(decode_numbers(&self.block(rep.payload(), size)?, number));
        }
        let (at, count) = self.span(rep)?;
        if !rep.is(Rep::COMPRESSED) || count < SHORTEST_PACKED {
            return Ok(decode_numbers(&self.block(at, count.saturating_mul(size))?, number));
        }
        match number {
            Number::F16 | Number::F32 | Number::F64 => self.packed_floats(at, count, number),
            _ => Ok(self.packed_ints(at, count, number.size() == 8)?.0.into_iter().map(|v| v as f64).collect()),
        }
    }

    /// Unpacks integers at `at`; returns them and where they end.
    fn packed_ints(&mut self, at: u64, count: u64, wide: bool) -> Result<(Vec<i64>, u64)> {
        let size = self.u64_at(at)?;
        let packed = self.block(at + 8, size)?;
        let ints = decode_ints(&packed, count, wide).map_err(|e| self.bad_at(at, e))?;
        Ok((ints, at + 8 + size))
    }

    /// Unpacks numbers stored as whole numbers ('i') or as indices into a table ('t').
    fn packed_floats(&mut self, at: u64, count: u64, number: Number) -> Result<Vec<f64>> {
        let code = self.block(at, 1)?[0];
        match code {
            b'i' => Ok(self.packed_ints(at + 1, count, false)?.0.into_iter().map(|v| v as f64).collect()),
            b't' => {
                let size = self.block(at + 1, 4)?;
                let size = u64::from(u32::from_le_bytes([size[0], size[1], size[2], size[3]]));
                let bytes = size * number.size() as u64;
                let table = decode_numbers(&self.block(at + 5, bytes)?, number);
                let (indices, _) = self.packed_ints(at + 5 + bytes, count, false)?;
                let value = |i: i64| usize::try_from(i).ok().and_then(|i| table.get(i)).copied();
                let values: Option<Vec<f64>> = indices.into_iter().map(value).collect();
                values.ok_or_else(|| self.bad_at(at, "a packed array refers to a value out of range"))
            }
            other => Err(self.bad_at(at, format!("a packed array has the unknown code {other}"))),
        }
    }

    /// Times and values of time samples.
    pub(super) fn samples(&mut self, rep: Rep) -> Result<(Vec<f64>, Vec<Rep>)> {
        if self.kind(rep)? != Type::TimeSamples {
            return Err(self.bad("time samples have another type"));
        }
        let at = self.jump(rep.payload())?;
        let times = Rep(self.u64_at(at)?);
        let times = match self.kind(times)? {
            Type::DoubleVector => {
                let count = self.u64_at(times.payload())?;
                decode_numbers(&self.block(times.payload() + 8, count.saturating_mul(8))?, Number::F64)
            }
            _ => self.numbers(times)?,
        };
        let at = self.jump(at + 8)?;
        let count = self.u64_at(at)?;
        let values = self.block(at + 8, count.saturating_mul(8))?;
        let values: Vec<Rep> = values.as_chunks().0.iter().map(|b| Rep(u64::from_le_bytes(*b))).collect();
        if values.len() != times.len()
            || times.windows(2).any(|w| !matches!(w[0].partial_cmp(&w[1]), Some(std::cmp::Ordering::Less)))
        {
            return Err(self.bad_at(at, format!("{} times for {} values, or not ascending", times.len(), values.len())));
        }
        Ok((times, values))
    }

    /// Follows a jump stored at `at`, relative to itself.
    fn jump(&mut self, at: u64) -> Result<u64> {
        let by = self.u64_at(at)? as i64;
        at.checked_add_signed(by).ok_or_else(|| self.bad_at(at, "a jump leads out of the file"))
    }
}

fn decode_numbers(bytes: &[u8], number: Number) -> Vec<f64> {
    match number {
        Number::U8 => bytes.iter().map(|&b| f64::from(b)).collect(),
        Number::I32 => bytes.as_chunks().0.iter().map(|b| f64::from(i32::from_le_bytes(*b))).collect(),
        Number::U32 => bytes.as_chunks().0.iter().map(|b| f64::from(u32::from_le_bytes(*b))).collect(),
        Number::I64 => bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b) as f64).collect(),
        Number::U64 => bytes.as_chunks().0.iter().map(|b| u64::from_le_bytes(*b) as f64).collect(),
        Number::F16 => bytes.as_chunks().0.iter().map(|b| half(u16::from_le_bytes(*b))).collect(),
        Number::F32 => bytes.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect(),
        Number::F64 => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
    }
}

/// Numbers that lie in the payload: 4 bytes as they are, 8 bytes as a number of 4, vectors and the diagonals of
/// matrices as one byte a component.
fn inline_numbers(rep: Rep, kind: Type, number: Number, n: usize) -> Vec<f64> {
    let bytes = (rep.payload() as u32).to_le_bytes();
    let small = |k: usize| f64::from(bytes[k] as i8);
    match (kind, number) {
        (Type::Matrix4d, _) => (0..16).map(|k| if k % 5 == 0 { small(k / 5) } else { 0.0 }).collect(),
        (Type::Vec2h, _) => decode_numbers(&bytes, Number::F16),
        _ if n > 1 => (0..n).map(small).collect(),
        (_, Number::U8) => vec![f64::from(bytes[0])],
        (_, Number::F16) => decode_numbers(&bytes[..2], number),
        (_, Number::F64 | Number::F32) => decode_numbers(&bytes, Number::F32),
        (_, Number::U32 | Number::U64) => decode_numbers(&bytes, Number::U32),
        (_, Number::I32 | Number::I64) => decode_numbers(&bytes, Number::I32),
    }
}

/// A 16-bit float (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction / (1 << 24) as f64,
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * f64::from_bits((1023 + exponent as u64 - 15) << 52),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_floats() {
        let known = [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_477_539_063e-8),
            (0x3555, 0.333_251_953_125),
        ];
        for (bits, value) in known {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }

    #[test]
    fn inline_values() {
        let numbers = |kind: Type, payload: u32| {
            let (number, n) = kind.numbers().unwrap();
            inline_numbers(Rep::inline(kind, payload), kind, number, n)
        };
        assert_eq!(numbers(Type::Double, 2.5f32.to_bits()), [2.5]);
        assert_eq!(numbers(Type::Int64, -7i32 as u32), [-7.0]);
        assert_eq!(numbers(Type::Vec3d, u32::from_le_bytes([1, 0xff, 3, 0])), [1.0, -1.0, 3.0]);
        let m = numbers(Type::Matrix4d, u32::from_le_bytes([1, 2, 3, 1]));
        assert_eq!((m[0], m[5], m[10], m[15], m.iter().sum::<f64>()), (1.0, 2.0, 3.0, 1.0, 7.0));
    }
}
