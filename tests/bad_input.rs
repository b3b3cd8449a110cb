//! A corpus of broken inputs: each gives one clear error and exit code 2, leaves the outputs as they were, and neither
//! panics nor hangs nor takes memory that a header merely claims.

mod configuration;
mod curves;
mod edges;
mod images;
mod lights;
mod look;
mod motion;
mod skins;

use pelage_tests::{ShotFolder, small_shot};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");

/// A run that takes longer hangs: all inputs here are small.
const PATIENCE: Duration = Duration::from_secs(60);
/// Address space of a run, KiB, where the shell can limit it.
const MEMORY_KIB: u32 = 4 << 20;

/// What a run said.
#[derive(Debug)]
struct Said {
    code: Option<i32>,
    out: String,
    err: String,
}

/// Runs the command in a folder with bounded time and memory.
fn run_bounded(folder: &Path, arguments: &[&str]) -> Said {
    let talk = tempfile::tempdir().expect("a temporary folder");
    let file = |name: &str| std::fs::File::create(talk.path().join(name)).expect("a file");
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        let script = format!("ulimit -v {MEMORY_KIB} 2>/dev/null; exec \"$0\" \"$@\"");
        shell.args(["-c", &script, COMMAND]);
        shell
    } else {
        Command::new(COMMAND)
    };
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).env_remove("RUST_BACKTRACE");
    let mut child = command.stdout(file("out")).stderr(file("err")).spawn().expect("the command starts");
    let started = Instant::now();
    let status = loop {
        match child.try_wait().expect("the child is ours") {
            Some(status) => break Some(status),
            None if started.elapsed() > PATIENCE => {
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let text =
        |name: &str| String::from_utf8_lossy(&std::fs::read(talk.path().join(name)).expect("a file")).into_owned();
    let (out, err) = (text("out"), text("err"));
    let status = status.unwrap_or_else(|| panic!("pelage {arguments:?} did not end within {PATIENCE:?}:\n{err}"));
    Said { code: status.code(), out, err }
}

/// Every file below a folder, by path.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            out.extend(content(&path));
        } else {
            out.insert(path.display().to_string(), std::fs::read(&path).expect("a file"));
        }
    }
    out
}

/// A shot that has run once, to break one input after another.
struct Corpus {
    shot: ShotFolder,
    before: BTreeMap<String, Vec<u8>>,
    complaints: Vec<String>,
}

impl Corpus {
    fn new() -> Self {
        Self::of(small_shot(COMMAND, 2))
    }

    /// Runs the shot, which must be good.
    fn of(shot: ShotFolder) -> Self {
        let said = run_bounded(shot.path(), &["run"]);
        assert_eq!(said.code, Some(0), "the shot as it is:\n{}", said.err);
        let before = content(&shot.path().join("out"));
        assert!(before.len() >= 3, "the first run writes files");
        Corpus { shot, before, complaints: Vec::new() }
    }

    /// Replaces a file, runs, and checks that the run refuses it with an error that holds all `words` (parted by `|`).
    /// The file comes back as it was.
    fn refuse(&mut self, case: &str, file: &str, broken: impl AsRef<[u8]>, words: &str) {
        let good = self.shot.read(file);
        assert!(good != broken.as_ref(), "{case}: nothing was broken");
        self.shot.write(file, broken);
        self.refuse_as_it_is(case, words);
        self.shot.write(file, good);
    }

    /// The same after replacing a piece of text.
    fn refuse_edit(&mut self, file: &str, from: &str, to: &str, words: &str) {
        let text = String::from_utf8(self.shot.read(file)).expect("text");
        assert!(text.contains(from), "{file} has no `{from}`");
        self.refuse(&format!("{file}: `{from}` -> `{to}`"), file, text.replacen(from, to, 1), words);
    }

    /// Runs the folder as it stands, which must be refused.
    fn refuse_as_it_is(&mut self, case: &str, words: &str) {
        let said = run_bounded(self.shot.path(), &["run"]);
        let mut wrong = Vec::new();
        if said.code != Some(2) {
            wrong.push(format!("exit code {:?}, expected 2", said.code));
        }
        let errors = said.err.lines().filter(|l| l.starts_with("error: ")).count();
        if errors != 1 {
            wrong.push(format!("{errors} errors, expected 1"));
        }
        for poison in ["panicked", "RUST_BACKTRACE", "memory allocation", "overflow"] {
            if said.err.contains(poison) {
                wrong.push(format!("says `{poison}`"));
            }
        }
        // Long lines are broken for terminals, so white space says nothing.
        let plain = |s: &str| s.split_whitespace().collect::<Vec<_>>().join(" ");
        let text = plain(said.err.split_once("error: ").map_or("", |s| s.1));
        for word in words.split('|').filter(|w| !text.contains(&plain(w))) {
            wrong.push(format!("does not say `{word}`"));
        }
        if content(&self.shot.path().join("out")) != self.before {
            wrong.push("out/ is not what it was".to_owned());
        }
        if !wrong.is_empty() {
            self.complaints.push(format!("--- {case}: {}\n{}{}", wrong.join("; "), said.out, said.err));
        }
    }

    /// The repaired shot must have nothing to do: the cache stayed usable.
    fn finish(self) {
        let said = run_bounded(self.shot.path(), &["run"]);
        assert!(self.complaints.is_empty(), "{}", self.complaints.join("\n"));
        assert!(said.out.starts_with("nothing to do"), "after the repair:\n{}{}", said.out, said.err);
    }
}

/// Bytes that mean nothing, always the same.
fn noise(count: usize) -> Vec<u8> {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..count).map(|_| next()).collect()
}
