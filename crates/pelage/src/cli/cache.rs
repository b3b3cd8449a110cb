//! `pelage cache stats|prune|verify`.

use super::{CacheAction, CacheArguments, print};
use crate::Error;
use crate::cache::{Stats, Store};
use crate::config::{Document, ShotFile};

/// Looks after the cache that a shot file names.
pub fn cache(action: CacheAction) -> Result<bool, Error> {
    let (CacheAction::Stats(a) | CacheAction::Prune(a) | CacheAction::Verify(a)) = &action;
    let shot: Document<ShotFile> = Document::read(&a.shot)?;
    let folder = shot.resolve(&shot.value.cache.dir);
    let store = Store::open(&folder).map_err(Error::disk(&folder))?;
    match &action {
        CacheAction::Stats(a) => {
            let stats = store.stats(false).map_err(Error::disk(&folder))?;
            say(a, &stats);
            Ok(true)
        }
        CacheAction::Verify(a) => {
            let stats = store.stats(true).map_err(Error::disk(&folder))?;
            say(a, &stats);
            Ok(stats.damaged.is_empty())
        }
        CacheAction::Prune(a) => match store.prune().map_err(Error::disk(&folder))? {
            Some((entries, bytes)) if a.json => {
                print(&format!("{{\"entries\": {entries}, \"bytes\": {bytes}}}\n"));
                Ok(true)
            }
            Some((entries, bytes)) => {
                print(&format!("removed {entries} entries, {:.1} MB\n", bytes as f64 / 1e6));
                Ok(true)
            }
            None => Err(Error::input("another run is using the cache", "prune when it has ended")),
        },
    }
}

fn say(a: &CacheArguments, stats: &Stats) {
    if a.json {
        print(&(serde_json::to_string_pretty(stats).expect("plain JSON") + "\n"));
        return;
    }
    let mut out = String::new();
    for (stage, (entries, bytes)) in &stats.stages {
        out.push_str(&format!("{stage:<24} {entries:>6} entries {:>10.1} MB\n", *bytes as f64 / 1e6));
    }
    let (entries, bytes) = stats.stages.values().fold((0, 0), |t, s| (t.0 + s.0, t.1 + s.1));
    out.push_str(&format!("{:<24} {entries:>6} entries {:>10.1} MB\n", "all", bytes as f64 / 1e6));
    for key in &stats.damaged {
        out.push_str(&format!("damaged: {key} (its step runs again when needed)\n"));
    }
    print(&out);
}
