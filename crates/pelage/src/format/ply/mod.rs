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

pub use curves::{Curves, parse_curves, read_curves, write_hair};
pub use mesh::{ReadMesh, parse_mesh, read_frame, read_mesh, read_positions};
pub use mesh_out::mesh_bytes;
pub(in crate::format) use source::read_bytes;
pub use table::{Column, MAX_COLUMNS, Table, Tables, join_ids, parse_tables, read_tables, split_ids, write_tables};

use super::FormatError;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a file beside its place and moves it there when it is whole, readable by everyone (a farm's nodes may run
/// under other users).
pub(in crate::format) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), FormatError> {
    let folder = match path.parent() {
        Some(p) if p != Path::new("") => p,
        _ => Path::new("."),
    };
    let run = || {
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
        let beside = builder.tempfile_in(folder)?;
        let mut out = BufWriter::with_capacity(1 << 16, beside.as_file());
        write(&mut out)?;
        out.flush()?;
        drop(out);
        beside.persist(path).map(drop).map_err(|e| e.error)
    };
    run().map_err(|e| FormatError::new(path, format!("cannot be written: {e}")))
}
