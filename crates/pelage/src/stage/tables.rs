//! Results without frames as PLY tables in memory: how they are laid out in the cache.

use crate::format::ply::{Column, Table, parse_tables, split_ids, write_tables};
use pelage_geom::SurfacePoint;
use std::path::Path;

pub use crate::format::ply::Tables;

/// One table of columns of equal length.
pub fn table(name: &str, columns: Vec<(&str, Column)>) -> Table {
    let rows = columns.first().map_or(0, |c| match &c.1 {
        Column::F32(v) => v.len(),
        Column::F64(v) => v.len(),
        Column::U32(v) => v.len(),
        Column::I32(v) => v.len(),
        Column::U8(v) => v.len(),
    });
    Table { name: name.to_owned(), rows, columns: columns.into_iter().map(|(n, c)| (n.to_owned(), c)).collect() }
}

/// A PLY file of tables.
pub fn encode(comment: &str, tables: &[Table]) -> Vec<u8> {
    let mut out = Vec::new();
    write_tables(&mut out, &[comment.to_owned()], tables).expect("writing to memory does not fail");
    out
}

/// Reads a PLY file of tables; `None` if it is not one.
pub fn decode(bytes: &[u8]) -> Option<Tables> {
    parse_tables(Path::new("cache entry"), bytes).ok()
}

/// Columns of points on the skin.
pub fn root_columns(root: &[SurfacePoint]) -> Vec<(&'static str, Column)> {
    vec![
        ("triangle", Column::U32(root.iter().map(|p| p.triangle).collect())),
        ("b1", Column::F32(root.iter().map(|p| p.bary[0]).collect())),
        ("b2", Column::F32(root.iter().map(|p| p.bary[1]).collect())),
    ]
}

/// Reads what [`root_columns`] wrote.
pub fn roots_of(t: &Table) -> Option<Vec<SurfacePoint>> {
    let (triangle, b1, b2) = (t.u32("triangle")?, t.f32("b1")?, t.f32("b2")?);
    let point = |i: usize| SurfacePoint { triangle: triangle[i], bary: [b1[i], b2[i]] };
    Some((0..triangle.len()).map(point).collect())
}

/// Columns of N values per row, named by their letters.
pub fn vector_columns<const N: usize>(names: [&'static str; N], v: &[[f32; N]]) -> Vec<(&'static str, Column)> {
    (0..N).map(|x| (names[x], Column::F32(v.iter().map(|p| p[x]).collect()))).collect()
}

/// Reads what [`vector_columns`] wrote.
pub fn vectors_of<const N: usize>(t: &Table, names: [&str; N]) -> Option<Vec<[f32; N]>> {
    let columns: Vec<&[f32]> = names.iter().map(|n| t.f32(n)).collect::<Option<_>>()?;
    Some((0..t.rows).map(|i| std::array::from_fn(|x| columns[x][i])).collect())
}

/// Columns of 64-bit ids.
pub fn id_columns(id: &[u64]) -> Vec<(&'static str, Column)> {
    let (lo, hi) = split_ids(id);
    vec![("id_lo", lo), ("id_hi", hi)]
}

/// Reads what [`id_columns`] wrote.
pub fn ids_of(t: &Table) -> Option<Vec<u64>> {
    Some(crate::format::ply::join_ids(t.u32("id_lo")?, t.u32("id_hi")?))
}
