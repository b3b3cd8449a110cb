//! The cache folder: one entry a step, whole or absent.
//!
//! ```text
//! <cache>/v1/entries/<ab>/<key>/manifest.json   recipe and the hash of every payload file; written last
//!                              /<payload files>
//! <cache>/v1/tmp/                                entries being written
//! <cache>/v1/unfinished/                         steps that take long, see `long_step`
//! <cache>/v1/last/<shot>.json                    the recipe that each step of a shot last had, for reasons
//! <cache>/v1/seconds/<shot>.json                 what its steps took when they ran last, for reports
//! <cache>/lock                                   shared by runs, exclusive for pruning
//! ```

use super::long_step::{self, LongStep};
use super::recipe::{Key, Recipe};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A payload file of an entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Payload {
    pub name: String,
    bytes: u64,
    blake3: String,
}

impl Payload {
    pub fn new(name: &str, content: &[u8]) -> Self {
        let blake3 = blake3::hash(content).to_hex().to_string();
        Payload { name: name.to_owned(), bytes: content.len() as u64, blake3 }
    }

    pub fn matches(&self, content: &[u8]) -> bool {
        content.len() as u64 == self.bytes && blake3::hash(content).to_hex().as_str() == self.blake3
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Manifest {
    key: Key,
    recipe: Recipe,
    counts: BTreeMap<String, u64>,
    payload: Vec<Payload>,
}

/// A finished step's payload, read back and checked.
#[derive(Debug)]
pub struct Entry {
    /// Counts that the step reported when it ran.
    pub counts: BTreeMap<String, u64>,
    /// Content of each payload file, in the order written.
    pub payload: Vec<Vec<u8>>,
}

/// What a cache holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Stats {
    /// Entries and bytes by stage.
    pub stages: BTreeMap<String, (u64, u64)>,
    /// Entries whose manifest or payload is damaged.
    pub damaged: Vec<String>,
}

/// A cache folder, opened for a run.
#[derive(Debug)]
pub struct Store {
    root: PathBuf,
    lock: File,
    warnings: std::sync::Mutex<Vec<String>>,
}

static TEMPORARY: AtomicU64 = AtomicU64::new(0);

impl Store {
    /// Opens (and makes) a cache folder. Leftovers of killed runs are cleared when no other run is using it.
    pub fn open(cache: &Path) -> io::Result<Self> {
        Self::open_clearing(cache, &[])
    }

    /// The same, and clears unfinished files in further folders that runs over this cache write into.
    pub fn open_clearing(cache: &Path, folders: &[&Path]) -> io::Result<Self> {
        let root = cache.join("v1");
        std::fs::create_dir_all(root.join("entries"))?;
        std::fs::create_dir_all(root.join("tmp"))?;
        std::fs::create_dir_all(root.join("last"))?;
        let lock = File::options().create(true).truncate(false).write(true).open(cache.join("lock"))?;
        let alone = lock.try_lock().is_ok();
        if alone {
            for left in std::fs::read_dir(root.join("tmp"))?.flatten() {
                let _ = std::fs::remove_dir_all(left.path());
            }
            for folder in [cache, &root.join("last")].iter().chain(folders) {
                crate::files::clear_unfinished(folder);
            }
        }
        let store = Store { root, lock, warnings: Default::default() };
        if alone {
            for (key, folder) in long_step::folders(&store.root) {
                if store.contains(&key) || !folder.join("lock").exists() {
                    long_step::clear(&folder);
                }
            }
            store.lock.unlock()?;
        }
        store.lock.lock_shared()?;
        Ok(store)
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    fn folder(&self, key: &Key) -> PathBuf {
        self.root.join("entries").join(&key.0[..2]).join(&key.0)
    }

    fn manifest(&self, key: &Key) -> Option<Manifest> {
        let bytes = std::fs::read(self.folder(key).join("manifest.json")).ok()?;
        let found: Manifest = serde_json::from_slice(&bytes).ok()?;
        (found.key == *key && found.recipe.key() == *key).then_some(found)
    }

    /// True if the step is finished, as far as its manifest and the sizes of its files tell.
    pub fn contains(&self, key: &Key) -> bool {
        let folder = self.folder(key);
        self.manifest(key).is_some_and(|m| {
            m.payload.iter().all(|p| folder.join(&p.name).metadata().is_ok_and(|d| d.len() == p.bytes))
        })
    }

    /// Counts that a finished step reported, without reading its payload.
    pub fn counts(&self, key: &Key) -> Option<BTreeMap<String, u64>> {
        self.manifest(key).map(|m| m.counts)
    }

    /// Reads a finished step and checks every byte; damage is a miss with a warning.
    pub fn get(&self, key: &Key) -> Option<Entry> {
        let folder = self.folder(key);
        if !folder.exists() {
            return None;
        }
        let Some(m) = self.manifest(key) else {
            self.warn(format!("cache entry {} has no readable manifest; its step runs again", key.0));
            return None;
        };
        let mut payload = Vec::new();
        for p in &m.payload {
            match std::fs::read(folder.join(&p.name)) {
                Ok(bytes) if p.matches(&bytes) => payload.push(bytes),
                _ => {
                    self.warn(format!("cache entry {} ({}) is damaged; its step runs again", key.0, m.recipe.stage));
                    return None;
                }
            }
        }
        Some(Entry { counts: m.counts, payload })
    }

    /// Reads one payload file of a finished step and checks it; damage is a miss with a warning.
    pub fn file(&self, key: &Key, name: &str) -> Option<Vec<u8>> {
        let m = self.manifest(key)?;
        let p = m.payload.iter().find(|p| p.name == name)?;
        let bytes = std::fs::read(self.folder(key).join(name)).ok().filter(|b| p.matches(b));
        if bytes.is_none() {
            self.warn(format!("cache entry {} ({}) is damaged; its step runs again", key.0, m.recipe.stage));
        }
        bytes
    }

    /// Goes on with what a killed run left of a long step, or begins; `anew` begins in any case.
    pub fn long_step(&self, recipe: &Recipe, anew: bool) -> io::Result<LongStep> {
        let n = TEMPORARY.fetch_add(1, Ordering::Relaxed);
        LongStep::open(&self.root, recipe, &format!("{}-{n}", std::process::id()), anew)
    }

    /// Keeps a finished step: written beside, manifest last, renamed. If another run was first, its entry stays,
    /// unless it is damaged.
    pub fn put(&self, recipe: &Recipe, counts: BTreeMap<String, u64>, files: &[(&str, &[u8])]) -> io::Result<Key> {
        let key = recipe.key();
        let n = TEMPORARY.fetch_add(1, Ordering::Relaxed);
        let tmp = self.root.join("tmp").join(format!("{}-{}-{n}", key.0, std::process::id()));
        std::fs::create_dir_all(&tmp)?;
        let mut payload = Vec::new();
        for (name, bytes) in files {
            File::create(tmp.join(name))?.write_all(bytes)?;
            payload.push(Payload::new(name, bytes));
        }
        self.write_manifest(&tmp, recipe, counts, payload)?;
        self.place(&tmp, &key)?;
        Ok(key)
    }

    pub(super) fn write_manifest(
        &self,
        folder: &Path,
        recipe: &Recipe,
        counts: BTreeMap<String, u64>,
        payload: Vec<Payload>,
    ) -> io::Result<()> {
        let manifest = Manifest { key: recipe.key(), recipe: recipe.clone(), counts, payload };
        std::fs::write(folder.join("manifest.json"), serde_json::to_vec_pretty(&manifest).expect("plain JSON"))
    }

    /// Renames a folder that is whole into its place.
    pub(super) fn place(&self, tmp: &Path, key: &Key) -> io::Result<()> {
        let place = self.folder(key);
        std::fs::create_dir_all(place.parent().expect("entries have a parent"))?;
        if std::fs::rename(tmp, &place).is_err() {
            // A damaged entry is in the way, or another run's whole one with the same bytes.
            if self.get(key).is_none() {
                let aside = tmp.with_extension("old");
                let _ = std::fs::rename(&place, &aside);
                let _ = std::fs::remove_dir_all(&aside);
                if std::fs::rename(tmp, &place).is_err() && self.get(key).is_none() {
                    let _ = std::fs::remove_dir_all(tmp);
                    return Err(io::Error::other(format!("can't move the cache entry to {}", place.display())));
                }
            }
            let _ = std::fs::remove_dir_all(tmp);
        }
        Ok(())
    }

    fn warn(&self, text: String) {
        let mut w = self.warnings.lock().expect("no panic while warning");
        if !w.contains(&text) {
            w.push(text);
        }
    }

    /// Warnings so far, each once; they are handed out once.
    pub fn take_warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.warnings.lock().expect("no panic while warning"))
    }

    /// Recipes that the steps of a shot last had, by step name.
    pub fn last(&self, shot: &str) -> BTreeMap<String, Recipe> {
        let path = self.root.join("last").join(format!("{shot}.json"));
        std::fs::read(path).ok().and_then(|b| serde_json::from_slice(&b).ok()).unwrap_or_default()
    }

    /// Keeps the recipes of a shot's steps.
    pub fn set_last(&self, shot: &str, recipes: &BTreeMap<String, Recipe>) -> io::Result<()> {
        let path = self.root.join("last").join(format!("{shot}.json"));
        let text = serde_json::to_vec(recipes).expect("plain JSON");
        crate::files::write_whole(&path, |f| f.write_all(&text))
    }

    /// Seconds that a shot's steps took when they ran last, by name, with their keys; none where they are not known.
    pub fn seconds(&self, shot: &str) -> BTreeMap<String, (String, f64)> {
        let path = self.root.join("seconds").join(format!("{shot}.json"));
        std::fs::read(path).ok().and_then(|b| serde_json::from_slice(&b).ok()).unwrap_or_default()
    }

    /// Keeps them. Losing them costs only what a report says, so a failure is not an error.
    pub fn set_seconds(&self, shot: &str, seconds: &BTreeMap<String, (String, f64)>) {
        let folder = self.root.join("seconds");
        let text = serde_json::to_vec(seconds).expect("plain JSON");
        let _ = std::fs::create_dir_all(&folder)
            .and_then(|()| crate::files::write_whole(&folder.join(format!("{shot}.json")), |f| f.write_all(&text)));
    }

    fn keys(&self) -> io::Result<Vec<Key>> {
        let mut keys = Vec::new();
        for shelf in std::fs::read_dir(self.root.join("entries"))?.flatten() {
            for entry in std::fs::read_dir(shelf.path())?.flatten() {
                keys.push(Key(entry.file_name().to_string_lossy().into_owned()));
            }
        }
        keys.retain(|k| k.0.len() == 32 && k.0.is_ascii());
        keys.sort();
        Ok(keys)
    }

    /// Counts entries and bytes; with `verify`, reads every byte and does not trust sizes.
    pub fn stats(&self, verify: bool) -> io::Result<Stats> {
        let mut stats = Stats::default();
        for key in self.keys()? {
            let whole = if verify { self.get(&key).is_some() } else { self.contains(&key) };
            match self.manifest(&key).filter(|_| whole) {
                Some(m) => {
                    let at = stats.stages.entry(m.recipe.stage).or_default();
                    at.0 += 1;
                    at.1 += m.payload.iter().map(|p| p.bytes).sum::<u64>();
                }
                None => stats.damaged.push(key.0),
            }
        }
        for (_, folder) in long_step::folders(&self.root) {
            let at = stats.stages.entry("unfinished".to_owned()).or_default();
            (at.0, at.1) = (at.0 + 1, at.1 + folder_bytes(&folder));
        }
        Ok(stats)
    }

    /// Removes every entry that no shot's last run used, and damaged ones. Returns (entries, bytes) removed, or `None`
    /// if another run is using the cache.
    pub fn prune(&self) -> io::Result<Option<(u64, u64)>> {
        self.lock.unlock()?;
        if self.lock.try_lock().is_err() {
            self.lock.lock_shared()?;
            return Ok(None);
        }
        let mut used = Vec::new();
        for file in std::fs::read_dir(self.root.join("last"))?.flatten() {
            let shot = file.path().file_stem().unwrap_or_default().to_string_lossy().into_owned();
            used.extend(self.last(&shot).values().map(Recipe::key));
        }
        used.sort();
        let (mut entries, mut bytes) = (0, 0);
        for key in self.keys()? {
            if used.binary_search(&key).is_ok() && self.contains(&key) {
                continue;
            }
            let folder = self.folder(&key);
            bytes += folder_bytes(&folder);
            entries += 1;
            std::fs::remove_dir_all(&folder)?;
        }
        for (_, folder) in long_step::folders(&self.root) {
            bytes += folder_bytes(&folder);
            entries += 1;
            std::fs::remove_dir_all(&folder)?;
        }
        self.lock.unlock()?;
        self.lock.lock_shared()?;
        Ok(Some((entries, bytes)))
    }
}

fn folder_bytes(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|f| f.metadata().ok()).map(|m| m.len()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(n: u32) -> Recipe {
        Recipe::new("test", 1).param("n", n, "n")
    }

    #[test]
    fn entries_come_back_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let key = store.put(&recipe(1), BTreeMap::new(), &[("a", b"hello"), ("b", b"")]).unwrap();
        assert_eq!(store.get(&key).unwrap().payload, [b"hello".to_vec(), Vec::new()]);
        assert!(store.contains(&key) && !store.contains(&recipe(2).key()));
        let file = store.folder(&key).join("a");
        std::fs::write(&file, b"hellp").unwrap();
        assert!(store.get(&key).is_none());
        assert_eq!(store.take_warnings().len(), 1);
        // Writing it again replaces the damaged one.
        store.put(&recipe(1), BTreeMap::new(), &[("a", b"hello"), ("b", b"")]).unwrap();
        assert_eq!(store.get(&key).unwrap().payload[0], b"hello");
    }

    #[test]
    fn a_manifest_of_another_key_is_foreign() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let one = store.put(&recipe(1), BTreeMap::new(), &[("a", b"1")]).unwrap();
        let two = recipe(2).key();
        std::fs::create_dir_all(store.folder(&two).parent().unwrap()).unwrap();
        std::fs::rename(store.folder(&one), store.folder(&two)).unwrap();
        assert!(store.get(&two).is_none() && !store.contains(&two));
        assert_eq!(store.stats(false).unwrap().damaged, [two.0]);
    }

    #[test]
    fn pruning_keeps_what_the_last_runs_used() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        for n in 0..3 {
            store.put(&recipe(n), BTreeMap::new(), &[("a", &[7; 10])]).unwrap();
        }
        store.set_last("shot", &BTreeMap::from([("step".to_owned(), recipe(1))])).unwrap();
        assert_eq!(store.prune().unwrap().map(|r| r.0), Some(2));
        assert!(store.contains(&recipe(1).key()) && !store.contains(&recipe(0).key()));
    }

    #[test]
    fn two_stores_write_the_same_entry() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (Store::open(dir.path()).unwrap(), Store::open(dir.path()).unwrap());
        a.put(&recipe(1), BTreeMap::new(), &[("a", b"x")]).unwrap();
        b.put(&recipe(1), BTreeMap::new(), &[("a", b"x")]).unwrap();
        assert!(a.contains(&recipe(1).key()));
        assert_eq!(a.prune().unwrap(), None);
    }
}
