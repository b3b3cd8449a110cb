//! Content hashes of input files, kept by size and modification time so that large files are not read again.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Known {
    bytes: u64,
    modified_ns: u128,
    hash: String,
}

/// A file written less than this before it was hashed may change again without its time stamp showing it; shorter than
/// the coarsest clock of common file systems (2 s on FAT) would let such a change slip, longer only rehashes more.
const SETTLED: Duration = Duration::from_secs(3);

/// Content hashes of input files.
#[derive(Debug, Default)]
pub struct FileHashes {
    path: PathBuf,
    known: BTreeMap<PathBuf, Known>,
    dirty: bool,
}

impl FileHashes {
    /// Opens the list in a cache folder; an unreadable one counts as empty.
    pub fn open(cache: &Path) -> Self {
        let path = cache.join("hashes.json");
        let known = std::fs::read(&path).ok().and_then(|b| serde_json::from_slice(&b).ok()).unwrap_or_default();
        FileHashes { path, known, dirty: false }
    }

    /// BLAKE3 of a file's content, in hexadecimal.
    pub fn hash(&mut self, file: &Path) -> std::io::Result<String> {
        let meta = std::fs::metadata(file)?;
        if !meta.is_file() {
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "is not a file"));
        }
        let modified = meta.modified().unwrap_or(UNIX_EPOCH);
        let modified_ns = modified.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let name = file.canonicalize()?;
        if let Some(k) = self.known.get(&name).filter(|k| k.bytes == meta.len() && k.modified_ns == modified_ns) {
            return Ok(k.hash.clone());
        }
        let hash = hash_file(file)?;
        let age = SystemTime::now().duration_since(modified).unwrap_or_default();
        if age > SETTLED {
            self.known.insert(name, Known { bytes: meta.len(), modified_ns, hash: hash.clone() });
            self.dirty = true;
        }
        Ok(hash)
    }

    /// Writes the list, whole or not at all. Losing it costs only time, so a failure is not an error.
    pub fn save(&mut self) {
        if std::mem::take(&mut self.dirty) {
            let text = serde_json::to_vec(&self.known).expect("plain JSON");
            let _ = crate::files::write_whole(&self.path, |f| std::io::Write::write_all(f, &text));
        }
    }
}

/// BLAKE3 of a file, read in pieces.
pub fn hash_file(file: &Path) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    let mut input = File::open(file)?;
    let mut piece = vec![0u8; 1 << 18];
    loop {
        match input.read(&mut piece)? {
            0 => return Ok(hasher.finalize().to_hex().to_string()),
            n => hasher.update(&piece[..n]),
        };
    }
}
