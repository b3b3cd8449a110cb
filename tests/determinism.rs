//! The same inputs give the same bytes: for any number of threads, any split into frames, any state of the cache, after
//! kills and beside other runs.

use pelage_geom::rng;
use pelage_tests::{ShotFolder, look_shot, simulated_shot, small_shot};
use std::collections::BTreeMap;
use std::process::{Child, Stdio};
use std::time::Duration;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";

type Files = BTreeMap<String, Vec<u8>>;

/// A small shot of six frames that writes every format.
fn every_format() -> ShotFolder {
    let shot = small_shot(COMMAND, 6);
    shot.edit("pipeline.toml", "[\"usd\", \"mcap\"]", "[\"usd\", \"mcap\", \"ply\"]");
    shot
}

/// Results of finished steps. Manifests name the step that was first, where two have the same recipe; results can't.
fn payloads(shot: &ShotFolder) -> Files {
    let mut entries = shot.entries();
    entries.retain(|name, _| !name.ends_with("/manifest.json"));
    entries
}

/// Outputs and results in the cache after an undisturbed run on one thread.
fn reference(shot: &ShotFolder) -> (Files, Files) {
    let shot = shot.fresh();
    shot.report(&["--jobs", "1"]);
    (shot.outputs(), payloads(&shot))
}

/// The same files with the same bytes; names the first that differs.
fn assert_same(found: &Files, expected: &Files, when: &str) {
    let names = |f: &Files| f.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected), "{when}");
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{when}: {name} has other bytes");
    }
}

fn assert_finished(shot: &ShotFolder, (outputs, results): &(Files, Files), when: &str) {
    assert_same(&shot.outputs(), outputs, when);
    assert_same(&payloads(shot), results, when);
    assert_eq!(shot.leftovers(), [""; 0], "{when}");
}

/// Numbers that look random and are the same in every run.
struct Dice(u64);

impl Dice {
    /// A whole number below `n`.
    fn below(&mut self, n: u64) -> u64 {
        self.0 += 1;
        (rng::uniform(7, self.0, rng::channel("dice"), 0) * n as f64) as u64 % n
    }

    fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            list.swap(i, self.below(i as u64 + 1) as usize);
        }
    }
}

/// Six frames of simulated hair, in one layer all of it and in the other the control hairs.
fn simulated() -> ShotFolder {
    let shot = simulated_shot(COMMAND, 6);
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nsimulate = \"control-hairs\"");
    shot
}

/// Six frames with every part of the look.
fn looked() -> ShotFolder {
    let shot = look_shot(COMMAND, 6);
    shot.edit("pipeline.toml", "[\"usd\", \"mcap\"]", "[\"mcap\"]");
    shot
}

#[test]
fn threads_do_not_show() {
    for shot in [every_format(), simulated(), looked()] {
        let expected = reference(&shot);
        for jobs in ["2", "5"] {
            let other = shot.fresh();
            other.report(&["--jobs", jobs]);
            assert_finished(&other, &expected, &format!("--jobs {jobs}"));
        }
    }
}

#[test]
fn splits_do_not_show() {
    let shot = every_format();
    let expected = reference(&shot);
    assert_eq!(expected.0.len(), 9, "two whole-shot files, six frames and a picture");
    split(&shot, &expected);
    for shot in [simulated(), looked()] {
        split(&shot, &reference(&shot));
    }
}

fn split(shot: &ShotFolder, expected: &(Files, Files)) {
    let mut dice = Dice(0);
    for round in 0..4 {
        let other = shot.fresh();
        let mut frames: Vec<u32> = (1..=6).collect();
        dice.shuffle(&mut frames);
        // The first round goes frame by frame.
        let mut split = vec![Vec::new(); if round == 0 { 6 } else { 3 }];
        for (i, f) in frames.iter().enumerate() {
            let at = if round == 0 { i } else { dice.below(3) as usize };
            split[at].push(f.to_string());
        }
        for part in split.iter().filter(|p| !p.is_empty()) {
            other.report(&["--frames", &part.join(",")]);
        }
        assert_finished(&other, expected, &format!("split {split:?}"));
        assert!(other.succeed(&["run"]).starts_with("nothing to do"));
    }
}

/// Edits of the groom one after another, and all taken back: what is in the cache shows nowhere.
fn edits_in_a_warm_cache(shot: &ShotFolder, edits: &[(&str, &str)]) {
    let expected = reference(shot);
    shot.report(&[]);
    for (from, to) in edits {
        shot.edit(GROOM, from, to);
        shot.report(&[]);
        assert!(shot.outputs() != expected.0);
        let fresh = reference(shot);
        assert_same(&shot.outputs(), &fresh.0, to);
    }
    // And back: every frame is in the cache.
    for (from, to) in edits {
        shot.edit(GROOM, to, from);
    }
    assert!(shot.plan(&["--to", "interpolate"]).0.is_empty());
    shot.report(&[]);
    assert_same(&shot.outputs(), &expected.0, "edits taken back");
    // Pruned to what this run used, the cache is that of a run from nothing.
    shot.succeed(&["cache", "prune"]);
    assert_finished(shot, &expected, "pruned");
}

#[test]
fn a_warm_cache_does_not_show() {
    let edits = [("bend = 0.6", "bend = 0.2"), ("value = 4.0", "value = 7.0"), ("noise = 0.2", "noise = 0.4")];
    edits_in_a_warm_cache(&every_format(), &edits);
}

#[test]
fn a_warm_cache_does_not_show_in_the_look() {
    let edits = [
        ("density = 0.25", "density = 0.5"),
        ("rate = 0.25", "rate = 0.5"),
        ("pitch = 0.8", "pitch = 0.6"),
        ("spread = 10", "spread = 20"),
    ];
    edits_in_a_warm_cache(&looked(), &edits);
}

fn start(shot: &ShotFolder, arguments: &[&str]) -> Child {
    let mut command = shot.command(&[&["run", "--quiet"], arguments].concat());
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the command starts")
}

#[test]
fn kills_do_not_show() {
    let shot = every_format();
    shot.edit("pipeline.toml", "frames = [1, 6]", "frames = [1, 12]");
    shot.edit(GROOM, "value = 4.0", "value = 30.0");
    kill_often(&shot, 30, 160);
}

#[test]
fn kills_do_not_show_in_simulated_hair() {
    let shot = simulated();
    // One stretch of several frames: a killed run leaves a part of it.
    shot.edit("pipeline.toml", "checkpoint = 2", "checkpoint = 4");
    shot.edit("pipeline.toml", "[\"usd\", \"mcap\"]", "[\"mcap\"]");
    shot.edit(GROOM, "value = 0.6", "value = 6.0");
    kill_often(&shot, 30, 160);
}

#[test]
fn kills_do_not_show_in_the_look() {
    let shot = looked();
    shot.edit(GROOM, "value = 4.0", "value = 16.0");
    kill_often(&shot, 20, 160);
}

/// Kills runs of a shot at random moments, up to so many milliseconds after their start; what they leave and what comes
/// of it must be whole.
fn kill_often(shot: &ShotFolder, most: u32, within: u64) {
    let expected = reference(shot);
    let (mut dice, mut kills, mut rounds) = (Dice(1000), 0, 0);
    while kills < most {
        let other = shot.fresh();
        rounds += 1;
        for _ in 0..15 {
            let mut child = start(&other, &[]);
            std::thread::sleep(Duration::from_millis(dice.below(within)));
            let ended = child.try_wait().expect("a child").is_some();
            child.kill().expect("a child to kill");
            let out = child.wait_with_output().expect("an end");
            if ended {
                assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
                break;
            }
            kills += 1;
            // Whatever stands under its own name is whole.
            for (name, bytes) in other.outputs().iter().filter(|(n, _)| !n.ends_with(".part")) {
                assert!(expected.0.get(name) == Some(bytes), "{name} is not whole after a kill");
            }
        }
        other.report(&[]);
        assert_finished(&other, &expected, &format!("after {kills} kills in {rounds} rounds"));
        other.succeed(&["cache", "verify"]);
    }
}

#[test]
fn runs_at_once_do_not_show() {
    let shot = every_format();
    let expected = reference(&shot);
    let together: [[&[&str]; 3]; 4] = [
        [&[], &[], &["--jobs", "1"]],
        [&["--frames", "1-3"], &["--frames", "4-6"], &["--frames", "3,5"]],
        [&["--force", "interpolate"], &["--force", "export"], &[]],
        [&["--to", "instance"], &["--force", "instance"], &[]],
    ];
    for arguments in together {
        let other = shot.fresh();
        let children: Vec<Child> = arguments.iter().map(|a| start(&other, a)).collect();
        for child in children {
            let out = child.wait_with_output().expect("an end");
            assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
        }
        other.report(&[]);
        assert_finished(&other, &expected, &format!("{arguments:?} at once"));
    }
}

/// What happens to the files of entries. `other` is another entry's file of the same name.
fn damage(how: &str, name: &str, bytes: &[u8], other: &[u8]) -> Option<Vec<u8>> {
    let manifest = name.ends_with("manifest.json");
    let mut bytes = bytes.to_vec();
    match how {
        "flip a bit" if !manifest => {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
        }
        "cut payloads short" if !manifest => bytes.truncate(bytes.len() - 1),
        "empty payloads" if !manifest => bytes.clear(),
        "delete payloads" if !manifest => return None,
        "delete manifests" if manifest => return None,
        "cut manifests short" if manifest => bytes.truncate(bytes.len() / 2),
        "exchange manifests" if manifest => bytes = other.to_vec(),
        "exchange payloads" if !manifest => bytes = other.to_vec(),
        "exchange both" => bytes = other.to_vec(),
        _ => {}
    }
    Some(bytes)
}

fn put(shot: &ShotFolder, name: &str, bytes: Option<Vec<u8>>) {
    let path = format!(".pelage-cache/v1/entries/{name}");
    match bytes {
        Some(bytes) => shot.write(&path, bytes),
        None => std::fs::remove_file(shot.path().join(path)).expect("a file to remove"),
    }
}

#[test]
fn damaged_entries_are_made_again() {
    damage_often(&small_shot(COMMAND, 2));
}

#[test]
fn damaged_checkpoints_are_made_again() {
    damage_often(&simulated());
}

fn damage_often(shot: &ShotFolder) {
    let expected = reference(shot);
    shot.report(&[]);
    let all = [
        "flip a bit",
        "cut payloads short",
        "empty payloads",
        "delete payloads",
        "delete manifests",
        "cut manifests short",
        "exchange manifests",
        "exchange payloads",
        "exchange both",
    ];
    for how in all {
        let entries = shot.entries();
        for (name, bytes) in &entries {
            let file = name.rsplit('/').next().expect("a name");
            let mut same_kind = entries.iter().filter(|(n, b)| n.rsplit('/').next() == Some(file) && *b != bytes);
            let other = same_kind.next().map_or(&b"?"[..], |(_, b)| b);
            put(shot, name, damage(how, name, bytes, other));
        }
        assert_eq!(shot.pelage(&["cache", "verify"]).status.code(), Some(1), "{how}");
        std::fs::remove_dir_all(shot.path().join("out")).expect("outputs");
        let out = shot.pelage(&["run"]);
        let talk = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success() && talk.contains("warning: cache entry "), "{how}: {talk}");
        assert!(!talk.contains("panicked"), "{how}: {talk}");
        assert_finished(shot, &expected, how);
        shot.succeed(&["cache", "verify"]);
        assert!(shot.succeed(&["run"]).starts_with("nothing to do"), "{how}");
    }
}

#[test]
fn one_flipped_bit_in_any_file_of_the_cache_does_not_show() {
    let shot = small_shot(COMMAND, 2);
    let expected = reference(&shot);
    shot.report(&[]);
    let mut dice = Dice(2000);
    for (name, bytes) in shot.entries() {
        let mut bytes = bytes;
        let at = dice.below(bytes.len() as u64) as usize;
        bytes[at] ^= 1 << dice.below(8);
        put(&shot, &name, Some(bytes));
        std::fs::remove_dir_all(shot.path().join("out")).expect("outputs");
        shot.report(&["--jobs", "1"]);
        assert_same(&shot.outputs(), &expected.0, &format!("byte {at} of {name}"));
    }
    for name in ["hashes.json", "v1/last/ball.json"] {
        for content in ["", "{", "[1]", "\0\u{1}"] {
            shot.write(&format!(".pelage-cache/{name}"), content);
            std::fs::remove_dir_all(shot.path().join("out")).expect("outputs");
            shot.report(&[]);
            assert_same(&shot.outputs(), &expected.0, &format!("{name} is {content:?}"));
        }
    }
}

#[test]
fn a_changed_output_is_written_again() {
    let shot = every_format();
    shot.report(&[]);
    let expected = shot.outputs();
    for (name, bytes) in &expected {
        let path = format!("out/{name}");
        let mut flipped = bytes.clone();
        flipped[bytes.len() / 3] ^= 4;
        for wrong in [Some(flipped), Some(bytes[..bytes.len() / 2].to_vec()), Some(Vec::new()), None] {
            match wrong {
                Some(wrong) => shot.write(&path, wrong),
                None => std::fs::remove_file(shot.path().join(&path)).expect("an output"),
            }
            let (run, reasons) = shot.plan(&[]);
            let step = run.first().expect("a step");
            assert_eq!(run.len(), 1, "{name}: {run:?}");
            assert!(reasons.contains(&format!("files of {step} are missing or not as written")), "{reasons:?}");
            shot.report(&[]);
            assert_same(&shot.outputs(), &expected, name);
        }
    }
}
