//! Steps that take long: their files are kept one by one, so that the next run goes on where a killed one stopped.
//!
//! ```text
//! <cache>/v1/unfinished/<key>-<process>-<count>/lock          held by the process that works on it
//!                                              /record.json   what is whole; written whole
//!                                              /<payload files>
//! ```

use super::recipe::{Key, Recipe};
use super::store::{Payload, Store};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Record {
    payload: Vec<Payload>,
    counts: BTreeMap<String, u64>,
}

/// A step that is being worked on.
#[derive(Debug)]
pub struct LongStep {
    folder: PathBuf,
    /// Held until the folder has its final name.
    lock: File,
    record: Record,
    recipe: Recipe,
}

/// Folders of unfinished steps, with their keys.
pub(super) fn folders(root: &Path) -> Vec<(Key, PathBuf)> {
    let found = std::fs::read_dir(root.join("unfinished")).into_iter().flatten().flatten();
    let keyed = found.filter_map(|e| Some((Key(e.file_name().to_string_lossy().get(..32)?.to_owned()), e.path())));
    let mut out: Vec<_> = keyed.collect();
    out.sort();
    out
}

impl LongStep {
    /// Goes on with what a killed run left of this step, or begins; `anew` begins in any case.
    pub(super) fn open(root: &Path, recipe: &Recipe, name: &str, anew: bool) -> io::Result<Self> {
        let key = recipe.key();
        for (_, folder) in folders(root).into_iter().filter(|f| f.0 == key) {
            let Some(lock) = File::options().write(true).open(folder.join("lock")).ok() else { continue };
            if lock.try_lock().is_err() {
                continue;
            }
            let step = LongStep { record: Record::default(), recipe: recipe.clone(), lock, folder };
            match step.recorded().filter(|_| !anew) {
                Some(record) => return Ok(LongStep { record, ..step }),
                None => drop(std::fs::remove_dir_all(&step.folder)),
            }
        }
        let folder = root.join("unfinished").join(format!("{}-{name}", key.0));
        std::fs::create_dir_all(&folder)?;
        let lock = File::create(folder.join("lock"))?;
        lock.try_lock().map_err(|e| io::Error::other(e.to_string()))?;
        Ok(LongStep { record: Record::default(), recipe: recipe.clone(), lock, folder })
    }

    /// The record, if every file is as it says.
    fn recorded(&self) -> Option<Record> {
        let record: Record = serde_json::from_slice(&std::fs::read(self.folder.join("record.json")).ok()?).ok()?;
        let whole = |p: &Payload| std::fs::read(self.folder.join(&p.name)).is_ok_and(|b| p.matches(&b));
        record.payload.iter().all(whole).then_some(record)
    }

    /// Files that are whole, in the order written.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.record.payload.iter().map(|p| p.name.as_str())
    }

    /// Counts so far; they are recorded with the files.
    pub fn counts(&mut self) -> &mut BTreeMap<String, u64> {
        &mut self.record.counts
    }

    /// Reads a file that is whole.
    pub fn read(&self, name: &str) -> Option<Vec<u8>> {
        let payload = self.record.payload.iter().find(|p| p.name == name)?;
        std::fs::read(self.folder.join(name)).ok().filter(|b| payload.matches(b))
    }

    /// Adds a file, or replaces it. It counts after the next [`LongStep::save`].
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        File::create(self.folder.join(name))?.write_all(bytes)?;
        self.record.payload.retain(|p| p.name != name);
        self.record.payload.push(Payload::new(name, bytes));
        Ok(())
    }

    /// Records what is there: a run after a kill goes on from here. Files whose name starts with `but` are dropped,
    /// unless they are `keep`.
    pub fn save(&mut self, but: &str, keep: &str) -> io::Result<()> {
        let (old, kept): (Vec<Payload>, Vec<Payload>) = std::mem::take(&mut self.record.payload)
            .into_iter()
            .partition(|p| p.name.starts_with(but) && p.name != keep);
        self.record.payload = kept;
        let text = serde_json::to_vec(&self.record).expect("plain JSON");
        crate::files::write_whole(&self.folder.join("record.json"), |f| f.write_all(&text))?;
        for p in old {
            let _ = std::fs::remove_file(self.folder.join(&p.name));
        }
        Ok(())
    }

    /// Makes it a finished step; returns its counts. If another run was first, its entry stays.
    pub fn finish(self, store: &Store) -> io::Result<BTreeMap<String, u64>> {
        let key = self.recipe.key();
        store.write_manifest(&self.folder, &self.recipe, self.record.counts.clone(), self.record.payload)?;
        for gone in ["record.json", "lock"] {
            let _ = std::fs::remove_file(self.folder.join(gone));
        }
        store.place(&self.folder, &key)?;
        drop(self.lock);
        // What other killed runs left of the same step.
        for (_, folder) in folders(store.root()).into_iter().filter(|f| f.0 == key) {
            clear(&folder);
        }
        Ok(self.record.counts)
    }
}

/// Removes an unfinished step's folder unless a process works on it.
pub(super) fn clear(folder: &Path) {
    let lock = File::options().write(true).open(folder.join("lock"));
    if lock.is_ok_and(|lock| lock.try_lock().is_ok()) || !folder.join("lock").exists() {
        let _ = std::fs::remove_dir_all(folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(n: u32) -> Recipe {
        Recipe::new("long", 1).param("n", n, "n")
    }

    #[test]
    fn a_dropped_step_goes_on_where_it_was_saved() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let mut step = store.long_step(&recipe(1), false).unwrap();
        step.write("a", b"one").unwrap();
        step.write("state.1", b"1").unwrap();
        step.counts().insert("hairs".into(), 3);
        step.save("state.", "state.1").unwrap();
        step.write("b", b"lost").unwrap();
        // While it is worked on, another begins for itself.
        let other = store.long_step(&recipe(1), false).unwrap();
        assert_eq!(other.files().count(), 0);
        drop(other);
        drop(step);
        let mut step = store.long_step(&recipe(1), false).unwrap();
        if step.files().count() == 0 {
            // The empty one came first; it is held now, so the next has what was saved.
            let held = step;
            step = store.long_step(&recipe(1), false).unwrap();
            drop(held);
        }
        assert_eq!(step.files().collect::<Vec<_>>(), ["a", "state.1"]);
        assert_eq!(step.read("state.1").unwrap(), b"1");
        assert!(!store.contains(&recipe(1).key()));
        step.write("b", b"two").unwrap();
        step.write("state.2", b"2").unwrap();
        step.save("state.", "state.2").unwrap();
        assert_eq!(step.finish(&store).unwrap()["hairs"], 3);
        let entry = store.get(&recipe(1).key()).unwrap();
        assert_eq!(entry.payload, [b"one".to_vec(), b"two".to_vec(), b"2".to_vec()]);
        assert_eq!(store.file(&recipe(1).key(), "b").unwrap(), b"two");
        assert!(folders(store.root()).is_empty());
    }

    #[test]
    fn damage_begins_anew() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let mut step = store.long_step(&recipe(1), false).unwrap();
        step.write("a", b"one").unwrap();
        step.save("state.", "").unwrap();
        std::fs::write(step.folder.join("a"), b"onf").unwrap();
        drop(step);
        let step = store.long_step(&recipe(1), false).unwrap();
        assert_eq!(step.files().count(), 0);
        drop(step);
        store.prune().unwrap();
        assert!(folders(store.root()).is_empty());
    }
}
