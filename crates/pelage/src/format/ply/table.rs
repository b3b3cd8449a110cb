//! Tables: columns of numbers under names, kept as binary little-endian PLY.
//!
//! One element a table, one scalar property a column, so that any PLY reader can look inside. PLY knows no 64-bit
//! integers: they are two columns, see [`split_ids`].

use super::source::{Plan, Source, read_bytes};
use crate::format::FormatError;
use ply_rs::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use ply_rs::writer::Writer;
use std::io::{self, Write};
use std::path::Path;

/// Columns of equal length under one name. Names of tables and columns are ascii letters, digits and `_`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Name of the PLY element.
    pub name: String,
    /// Length of every column.
    pub rows: usize,
    /// Names and values, at most [`MAX_COLUMNS`].
    pub columns: Vec<(String, Column)>,
}

/// Values of one column.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// PLY float.
    F32(Vec<f32>),
    /// PLY double.
    F64(Vec<f64>),
    /// PLY uint; ushort is read as this.
    U32(Vec<u32>),
    /// PLY int; char and short are read as this.
    I32(Vec<i32>),
    /// PLY uchar.
    U8(Vec<u8>),
}

/// What a file of tables holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tables {
    /// Comment lines of the header in order.
    pub comments: Vec<String>,
    /// Tables in the order of the file.
    pub tables: Vec<Table>,
}

/// Most columns that a table can have.
pub const MAX_COLUMNS: usize = 64;

impl Tables {
    /// The table of that name.
    pub fn get(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|t| t.name == name)
    }
}

impl Table {
    /// The column of that name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.0 == name).map(|c| &c.1)
    }

    /// Values of an `F32` column.
    pub fn f32(&self, name: &str) -> Option<&[f32]> {
        if let Some(Column::F32(v)) = self.column(name) { Some(v) } else { None }
    }

    /// Values of an `F64` column.
    pub fn f64(&self, name: &str) -> Option<&[f64]> {
        if let Some(Column::F64(v)) = self.column(name) { Some(v) } else { None }
    }

    /// Values of a `U32` column.
    pub fn u32(&self, name: &str) -> Option<&[u32]> {
        if let Some(Column::U32(v)) = self.column(name) { Some(v) } else { None }
    }
}

impl Column {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Column::F32(v) => v.len(),
            Column::F64(v) => v.len(),
            Column::U32(v) => v.len(),
            Column::I32(v) => v.len(),
            Column::U8(v) => v.len(),
        }
    }

    /// True without values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn scalar_type(&self) -> ScalarType {
        match self {
            Column::F32(_) => ScalarType::Float,
            Column::F64(_) => ScalarType::Double,
            Column::U32(_) => ScalarType::UInt,
            Column::I32(_) => ScalarType::Int,
            Column::U8(_) => ScalarType::UChar,
        }
    }

    /// An empty column for values of `t`, with room for `rows`.
    fn empty(t: &ScalarType, rows: usize) -> Self {
        match t {
            ScalarType::Float => Column::F32(Vec::with_capacity(rows)),
            ScalarType::Double => Column::F64(Vec::with_capacity(rows)),
            ScalarType::UInt | ScalarType::UShort => Column::U32(Vec::with_capacity(rows)),
            ScalarType::Int | ScalarType::Short | ScalarType::Char => Column::I32(Vec::with_capacity(rows)),
            ScalarType::UChar => Column::U8(Vec::with_capacity(rows)),
        }
    }

    fn push(&mut self, bits: u64) {
        match self {
            Column::F32(v) => v.push(f32::from_bits(bits as u32)),
            Column::F64(v) => v.push(f64::from_bits(bits)),
            Column::U32(v) => v.push(bits as u32),
            Column::I32(v) => v.push(bits as u32 as i32),
            Column::U8(v) => v.push(bits as u8),
        }
    }
}

/// Low and high halves of 64-bit ids, for columns `id_lo` and `id_hi`.
pub fn split_ids(id: &[u64]) -> (Column, Column) {
    (Column::U32(id.iter().map(|x| *x as u32).collect()), Column::U32(id.iter().map(|x| (*x >> 32) as u32).collect()))
}

/// 64-bit ids of their halves.
pub fn join_ids(lo: &[u32], hi: &[u32]) -> Vec<u64> {
    lo.iter().zip(hi).map(|(l, h)| u64::from(*l) | u64::from(*h) << 32).collect()
}

/// Slot of column `k`: one character from '0' up, so that a look-up is a subtraction.
fn slot(k: usize) -> String {
    char::from(b'0' + k as u8).to_string()
}

fn slot_index(slot: &str) -> usize {
    usize::from(slot.as_bytes()[0].wrapping_sub(b'0'))
}

/// A row of a table as the PLY writer asks for it.
struct Cursor<'a> {
    columns: &'a [(String, Column)],
    row: usize,
}

macro_rules! get {
    ($($name:ident $kind:ident $t:ty),*) => {
        $(fn $name(&self, slot: &str) -> Option<$t> {
            match &self.columns[slot_index(slot)].1 {
                Column::$kind(v) => Some(v[self.row]),
                _ => None,
            }
        })*
    };
}

impl PropertyAccess for Cursor<'_> {
    fn new() -> Self {
        Cursor { columns: &[], row: 0 }
    }

    get!(get_float F32 f32, get_double F64 f64, get_uint U32 u32, get_int I32 i32, get_uchar U8 u8);
}

/// A row of a table as the PLY parser fills it: the bits of each value.
struct Bits<const N: usize>([u64; N]);

impl<const N: usize> Bits<N> {
    fn set(&mut self, slot: &str, bits: u64) -> PropertyAccessResult {
        self.0[slot_index(slot)] = bits;
        PropertyAccessResult::Set
    }
}

impl<const N: usize> PropertyAccess for Bits<N> {
    fn new() -> Self {
        Bits([0; N])
    }

    fn set_float(&mut self, slot: &str, v: f32) -> PropertyAccessResult {
        self.set(slot, u64::from(v.to_bits()))
    }

    fn set_double(&mut self, slot: &str, v: f64) -> PropertyAccessResult {
        self.set(slot, v.to_bits())
    }

    fn set_uint(&mut self, slot: &str, v: u32) -> PropertyAccessResult {
        self.set(slot, u64::from(v))
    }

    fn set_ushort(&mut self, slot: &str, v: u16) -> PropertyAccessResult {
        self.set(slot, u64::from(v))
    }

    fn set_uchar(&mut self, slot: &str, v: u8) -> PropertyAccessResult {
        self.set(slot, u64::from(v))
    }

    fn set_int(&mut self, slot: &str, v: i32) -> PropertyAccessResult {
        self.set(slot, u64::from(v as u32))
    }

    fn set_short(&mut self, slot: &str, v: i16) -> PropertyAccessResult {
        self.set(slot, u64::from(i32::from(v) as u32))
    }

    fn set_char(&mut self, slot: &str, v: i8) -> PropertyAccessResult {
        self.set(slot, u64::from(i32::from(v) as u32))
    }
}

/// Writes tables as one binary little-endian PLY. Fails with `InvalidInput` on names or comments that PLY cannot hold,
/// on columns of wrong length and on too many columns.
pub fn write_tables(out: &mut impl Write, comments: &[String], tables: &[Table]) -> io::Result<()> {
    let wrong = |what: String| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments = comments.to_vec();
    if let Some(c) = comments.iter().find(|c| c.contains(['\n', '\r'])) {
        return wrong(format!("comment '{}' has a line break", c.escape_debug()));
    }
    for table in tables {
        let mut element = ElementDef::new(table.name.clone());
        element.count = table.rows;
        for (name, column) in &table.columns {
            if column.len() != table.rows {
                return wrong(format!("{}.{name} has {} values, expected {}", table.name, column.len(), table.rows));
            }
            if !plain(name) || element.properties.contains_key(name) {
                return wrong(format!("'{name}' cannot name a column of {}", table.name));
            }
            element.properties.add(PropertyDef::new(name.clone(), PropertyType::Scalar(column.scalar_type())));
        }
        if !plain(&table.name) || header.elements.contains_key(&table.name) || table.columns.len() > MAX_COLUMNS {
            return wrong(format!("'{}' cannot be a table: bad or repeated name, or too many columns", table.name));
        }
        header.elements.add(element);
    }
    let writer = Writer::<Cursor>::new();
    writer.write_header(out, &header)?;
    let mut buffer = Vec::new();
    for table in tables {
        let mut element = ElementDef::new(table.name.clone());
        for (k, (_, column)) in table.columns.iter().enumerate() {
            element.properties.add(PropertyDef::new(slot(k), PropertyType::Scalar(column.scalar_type())));
        }
        for row in 0..table.rows {
            writer.write_little_endian_element(&mut buffer, &Cursor { columns: &table.columns, row }, &element)?;
            if buffer.len() >= 1 << 16 {
                out.write_all(&buffer)?;
                buffer.clear();
            }
        }
        out.write_all(&buffer)?;
        buffer.clear();
    }
    Ok(())
}

fn plain(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Reads every element of a PLY file as a table. Lists are an error.
pub fn read_tables(path: &Path) -> Result<Tables, FormatError> {
    parse_tables(path, &read_bytes(path)?)
}

/// [`read_tables`] on a file that is in memory; `path` is for errors.
pub fn parse_tables(path: &Path, bytes: &[u8]) -> Result<Tables, FormatError> {
    let mut source = Source::new(path, bytes)?;
    let elements: Vec<ElementDef> = source.header.elements.values().cloned().collect();
    let mut tables = Tables { comments: source.header.comments.clone(), tables: Vec::with_capacity(elements.len()) };
    for element in &elements {
        tables.tables.push(read_table(&mut source, element)?);
    }
    match source.leftovers().first() {
        Some(what) => Err(FormatError::new(path, what.replace("were ignored", "belong to no table"))),
        None => Ok(tables),
    }
}

/// Reads the next element of a file as a table.
pub(super) fn read_table(source: &mut Source, element: &ElementDef) -> Result<Table, FormatError> {
    let at = |what: String| Err(FormatError::new(source.path, what).at(format!("element {}", element.name)));
    let room = source.capacity(element);
    let (mut columns, mut names) = (Vec::new(), Vec::new());
    if element.properties.len() > MAX_COLUMNS {
        return at(format!("{} columns, at most {MAX_COLUMNS} are read", element.properties.len()));
    }
    for (k, p) in element.properties.values().enumerate() {
        let PropertyType::Scalar(t) = &p.data_type else {
            return at(format!("property '{}' is a list, a table has only numbers", p.name));
        };
        columns.push((p.name.clone(), Column::empty(t, room)));
        names.push((p.name.clone(), char::from(b'0' + k as u8)));
    }
    let wanted: Vec<(&str, char)> = names.iter().map(|(n, c)| (n.as_str(), *c)).collect();
    let plan = Plan::exact(element, &wanted);
    match columns.len() {
        0..=4 => fill::<4>(source, element, &plan, &mut columns)?,
        5..=12 => fill::<12>(source, element, &plan, &mut columns)?,
        _ => fill::<MAX_COLUMNS>(source, element, &plan, &mut columns)?,
    }
    Ok(Table { name: element.name.clone(), rows: element.count, columns })
}

fn fill<const N: usize>(
    source: &mut Source,
    element: &ElementDef,
    plan: &Plan,
    columns: &mut [(String, Column)],
) -> Result<(), FormatError> {
    source.rows(element, plan, |_, row: Bits<N>| {
        for ((_, column), bits) in columns.iter_mut().zip(row.0) {
            column.push(bits);
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ply_rs::parser::Parser;
    use ply_rs::ply::{DefaultElement, Property};

    fn sample() -> Vec<Table> {
        let (lo, hi) = split_ids(&[1, 0x7fff_ffff_ffff_ffff, 1 << 40]);
        vec![
            Table {
                name: "root".into(),
                rows: 3,
                columns: vec![
                    ("id_lo".into(), lo),
                    ("id_hi".into(), hi),
                    ("u".into(), Column::F32(vec![0.1, -0.0, f32::MIN_POSITIVE])),
                    ("x".into(), Column::F64(vec![0.1, 1e300, -7.0])),
                    ("layer".into(), Column::U8(vec![0, 255, 3])),
                    ("k".into(), Column::I32(vec![i32::MIN, 0, i32::MAX])),
                ],
            },
            Table { name: "empty".into(), rows: 0, columns: vec![("x".into(), Column::F32(vec![]))] },
            Table { name: "bare".into(), rows: 5, columns: vec![] },
        ]
    }

    fn written(tables: &[Table]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_tables(&mut bytes, &["made by a test".into(), String::new()], tables).unwrap();
        bytes
    }

    #[test]
    fn tables_come_back_bit_for_bit() {
        let back = parse_tables(Path::new("t.ply"), &written(&sample())).unwrap();
        assert_eq!(back.comments, ["made by a test", ""]);
        assert_eq!(back.tables, sample());
        let root = back.get("root").unwrap();
        assert_eq!(
            join_ids(root.u32("id_lo").unwrap(), root.u32("id_hi").unwrap()),
            [1, 0x7fff_ffff_ffff_ffff, 1 << 40]
        );
        let Some(Column::F32(u)) = root.column("u") else { panic!() };
        assert_eq!(u[1].to_bits(), (-0.0f32).to_bits());
    }

    #[test]
    fn the_plain_reader_of_the_crate_agrees() {
        let ply = Parser::<DefaultElement>::new().read_ply(&mut written(&sample()).as_slice()).unwrap();
        assert_eq!(ply.payload["root"].len(), 3);
        assert_eq!(ply.payload["root"][1]["x"], Property::Double(1e300));
        assert_eq!(ply.payload["root"][1]["layer"], Property::UChar(255));
        assert_eq!(ply.payload["root"][0]["k"], Property::Int(i32::MIN));
        assert_eq!(ply.payload["root"][1]["id_hi"], Property::UInt(0x7fff_ffff));
    }

    #[test]
    fn wide_tables_and_narrow_integers() {
        let columns: Vec<_> = (0..64).map(|k| (format!("c{k}"), Column::U32(vec![k, k * k]))).collect();
        let wide = vec![Table { name: "wide".into(), rows: 2, columns }];
        assert_eq!(parse_tables(Path::new("t.ply"), &written(&wide)).unwrap().tables, wide);
        let text = b"ply\nformat ascii 1.0\nelement e 1\nproperty char a\nproperty short b\nproperty ushort c\nproperty uint d\nend_header\n-3 -300 65535 4294967295\n";
        let t = parse_tables(Path::new("t.ply"), text).unwrap();
        let want =
            [Column::I32(vec![-3]), Column::I32(vec![-300]), Column::U32(vec![65535]), Column::U32(vec![u32::MAX])];
        assert!(t.tables[0].columns.iter().map(|c| &c.1).eq(&want), "{t:?}");
    }

    #[test]
    fn wrong_input_is_refused_on_both_sides() {
        let one = |name: &str, column: &str, v: Vec<f32>| {
            let table = Table { name: name.into(), rows: 1, columns: vec![(column.into(), Column::F32(v))] };
            write_tables(&mut Vec::new(), &[], &[table]).map_err(|e| e.to_string())
        };
        assert!(one("a", "x", vec![1.0]).is_ok());
        assert!(one("a b", "x", vec![1.0]).is_err());
        assert!(one("a", "x.y", vec![1.0]).is_err());
        assert!(one("a", "x", vec![]).unwrap_err().contains("0 values, expected 1"));
        assert!(write_tables(&mut Vec::new(), &["a\nb".into()], &[]).is_err());
        let bytes = written(&sample());
        for cut in [bytes.len() - 1, bytes.len() - 30] {
            let e = parse_tables(Path::new("t.ply"), &bytes[..cut]).unwrap_err();
            assert!(e.what.contains("of 3 elements 'root'"), "{e}");
        }
        let long = [bytes.as_slice(), b"xyz"].concat();
        assert!(parse_tables(Path::new("t.ply"), &long).unwrap_err().what.contains("3 bytes"));
        let list = b"ply\nformat ascii 1.0\nelement f 0\nproperty list uchar int i\nend_header\n";
        assert!(parse_tables(Path::new("t.ply"), list).unwrap_err().what.contains("is a list"));
    }
}
