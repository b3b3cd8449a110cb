//! PLY: skins and frames of skins in, hair curves in and out, tables for the cache.

mod curves;
mod mesh;
mod mesh_out;
mod polygon;
mod row;
#[cfg(test)]
mod samples;
mod source;
mod table;

pub use curves::{Curves, parse_curves, read_curves, verify_hair, write_hair};
pub use mesh::{ReadMesh, parse_mesh, read_frame, read_mesh};
pub use mesh_out::mesh_bytes;
pub(in crate::format) use source::read_bytes;
pub use table::{Column, MAX_COLUMNS, Table, Tables, join_ids, parse_tables, read_tables, split_ids, write_tables};

use super::FormatError;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// Writes a file beside its place and moves it there when it is whole.
pub(in crate::format) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), FormatError> {
    crate::files::write_whole(path, write).map_err(|e| FormatError::new(path, format!("cannot be written: {e}")))
}
