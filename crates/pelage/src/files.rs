//! Writing files so that a reader sees them whole or not at all.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A path beside `path` for a file that is not finished; unique to this process and call.
pub fn unfinished(path: &Path) -> PathBuf {
    use std::sync::atomic::{AtomicU64, Ordering};
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let n = COUNT.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(".{name}.{}-{n}.part", std::process::id()))
}

/// Removes files that killed processes left unfinished in a folder.
pub fn clear_unfinished(folder: &Path) {
    for file in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = file.file_name().to_string_lossy().into_owned();
        // ".<name>.<process>-<count>.part", as `unfinished` has it; no other file is touched.
        let number = name.strip_prefix('.').and_then(|n| n.strip_suffix(".part")).and_then(|n| n.rsplit_once('.'));
        let ours = number.and_then(|n| n.1.split_once('-')).is_some_and(|(process, count)| {
            [process, count].iter().all(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
        });
        if ours {
            let _ = std::fs::remove_file(file.path());
        }
    }
}

/// Writes a file beside its place and renames it there once it is complete.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let part = unfinished(path);
    let result = File::create(&part).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 20, file);
        write(&mut out)?;
        out.flush()?;
        drop(out);
        std::fs::rename(&part, path)
    });
    if result.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    result
}
