//! What a shot does without: the hairs that are left are those of the whole shot, bit by bit; and what is chosen for a budget.

use pelage_tests::{ShotFolder, deformed, exported_hairs, grey_png, simulated_shot};
use serde_json::Value;
use std::collections::BTreeMap;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const SHOT: &str = "pipeline.toml";
const CAMERA: &str = "\n[preview.camera]\neye = [0.0, 4.0, 14.0]\ntarget = [0.0, 4.0, 0.0]\nfov = 30.0\n";
const CLUMPS: &str = "\n[[layer.clump]]\ndensity = 0.1\n\n[[layer.clump]]\ndensity = 0.02\n";

/// A deforming skin with clumped hair that is simulated, seen by a camera.
fn shot() -> ShotFolder {
    let shot = simulated_shot(COMMAND, 3);
    for frame in 1..=3 {
        shot.write(&format!("anim/ball.{frame:04}.ply"), deformed(f64::from(frame)));
    }
    shot.edit(SHOT, "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
    let groom = String::from_utf8(shot.read("grooms/ball.toml")).expect("text");
    shot.write("grooms/ball.toml", groom + CLUMPS);
    append(&shot, CAMERA);
    shot
}

fn append(shot: &ShotFolder, more: &str) {
    let text = String::from_utf8(shot.read(SHOT)).expect("text");
    shot.write(SHOT, text + more);
}

fn stage<'a>(report: &'a Value, name: &str) -> &'a Value {
    report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == name).expect("the stage")
}

/// Runs a shot whole and with `skip`; the report of the latter, and how many hairs there are in both. Those that are left are the
/// same but, where `wider`, for their width.
fn compared(skip: &str, wider: bool) -> (Value, [usize; 2]) {
    let whole = shot();
    whole.report(&[]);
    let less = whole.fresh();
    append(&less, skip);
    let report = less.report(&[]);
    let hairs = |s: &ShotFolder| exported_hairs(&s.path().join("out/ball/hair.mcap"));
    let (all, left) = (hairs(&whole), hairs(&less));
    for (name, hair) in &left {
        let same = &all[name];
        assert_eq!((&hair.root, &hair.shape), (&same.root, &same.shape), "{name:?}");
        assert!(wider || hair.look == same.look, "{name:?}");
    }
    assert!(!left.is_empty() && left.len() < all.len(), "{} of {}", left.len(), all.len());
    (report, [all.len(), left.len()])
}

#[test]
fn hair_that_no_camera_sees_is_left_out_and_the_rest_is_as_it_was() {
    let (report, [all, left]) = compared("\n[skip]\ncamera = true\nmargin = 0.1\n", false);
    let skipped = &stage(&report, "instance")["skipped"];
    let count = |name: &str| skipped[name].as_u64().unwrap_or(0) as usize;
    // The camera looks at the upper part of the ball, from the front.
    assert!(count("hairs out of the picture") > all / 10 && count("hairs behind the skin") > 5, "{skipped}");
    let gone = count("hairs out of the picture") + count("hairs behind the skin");
    assert_eq!(all - gone, left);
    let named: Vec<&str> =
        report["skips"].as_array().expect("a list").iter().map(|s| s["what"].as_str().expect("text")).collect();
    assert!(named.contains(&"hairs out of the picture") && named.contains(&"hairs behind the skin"), "{named:?}");
}

#[test]
fn masked_hair_is_left_out_and_the_rest_is_as_it_was() {
    let mask = grey_png(16, 16, |x, _| if x < 6 { 255 } else { 0 });
    let whole = shot();
    whole.write("maps/mask.png", &mask);
    let text = "\n[skip]\nmask = { map = \"maps/mask.png\" }\nmargin = 0.2\n";
    whole.report(&[]);
    let less = whole.fresh();
    append(&less, text);
    less.report(&[]);
    let hairs = |s: &ShotFolder| exported_hairs(&s.path().join("out/ball/hair.mcap"));
    let (all, left) = (hairs(&whole), hairs(&less));
    assert!(left.iter().all(|(name, hair)| all[name] == *hair));
    let open = |u: f32| u < 6.0 / 16.0;
    assert!(all.iter().filter(|(_, h)| open(h.uv()[0] + 0.05)).all(|(name, _)| left.contains_key(name)));
    assert!(left.len() < all.len() * 3 / 4, "{} of {}", left.len(), all.len());
    // A mask is an input: painting on it runs the choice and what follows again, and nothing before it.
    less.write("maps/mask.png", grey_png(16, 16, |x, _| if x < 8 { 255 } else { 0 }));
    let (run, reasons) = less.plan(&[]);
    assert!(run.contains("instance/kept/under") && !run.contains("instance/roots/under"), "{run:?}");
    assert!(reasons.iter().all(|r| r == "maps/mask.png changed"), "{reasons:?}");
}

/// Far away a part of the hair is made, as much wider as it is less, and evenly: by its rank.
#[test]
fn distant_hair_is_thinned_and_wider() {
    let (report, [all, left]) = compared("\n[skip]\nlod = 40.0\n", true);
    assert!(left * 4 < all, "{left} of {all}");
    let thinned =
        stage(&report, "instance")["skipped"]["hairs thinned by distance"].as_u64().expect("a count") as usize;
    assert_eq!(all - thinned, left);
}

/// Where a part of the skin rests, its hair sleeps; it is where it would have been, within micrometres.
#[test]
fn hair_on_skin_that_rests_sleeps() {
    let run = |sleep: bool| {
        let shot = simulated_shot(COMMAND, 6);
        for frame in -2..=6 {
            let mut mesh = pelage_geom::shapes::cube_sphere(8, 5.0);
            let moved = mesh.position.iter_mut().filter(|p| p[0] > 4.0);
            moved.for_each(|p| p[1] += 0.1 * f64::from((frame + 3) % 3));
            shot.write(&format!("anim/ball.{frame:04}.ply"), pelage_tests::ascii_ply(&mesh));
        }
        shot.edit(SHOT, "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
        shot.edit(SHOT, "segments = 8", &format!("segments = 8\nsleep = {sleep}"));
        let report = shot.report(&[]);
        let mut file = pelage::format::mcap::read_hair_mcap(&shot.path().join("out/ball/hair.mcap")).expect("a file");
        let frames: Vec<Vec<[f32; 3]>> =
            (0..6).flat_map(|f| [0, 1].map(|l| file.frame(f, l).expect("a frame").position)).collect();
        (report, frames)
    };
    let ((report, asleep), (_, awake)) = (run(true), run(false));
    let simulate = stage(&report, "simulate");
    let [slept, all] = ["sleeping_hair_frames", "hair_frames"].map(|n| simulate["skipped"][n].as_u64().unwrap_or(0));
    assert!(slept * 10 > all * 3, "{slept} of {all}");
    let far = asleep
        .iter()
        .flatten()
        .zip(awake.iter().flatten())
        .map(|(p, q)| (0..3).map(|x| f64::from(p[x] - q[x]) * f64::from(p[x] - q[x])).sum::<f64>().sqrt());
    // Scene units are centimetres.
    let most = far.fold(0.0, f64::max);
    assert!(most < 1e-3, "{most} cm");
}

/// A budget is resolved once, into settings that stand beside the shot file; they are what enters the keys.
#[test]
fn a_budget_becomes_settings_once() {
    let shot = simulated_shot(COMMAND, 3);
    shot.edit(SHOT, "segments = 8\n", "quality = { error = 0.2 }\n");
    shot.report(&[]);
    let chosen = String::from_utf8(shot.read("pipeline.quality.toml")).expect("text");
    let table: toml::Table = chosen.parse().expect("TOML");
    assert_eq!(table["budget"].as_str(), Some("{ error = 0.2 }"));
    let number = |group: &str, key: &str| {
        let v = &table[group][key];
        v.as_float().or(v.as_integer().map(|i| i as f64)).expect("a number")
    };
    assert!(number("estimate", "error_mm") <= 0.2, "{chosen}");
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
    // The same settings by hand are the same steps.
    let by_hand = shot.fresh();
    std::fs::remove_file(by_hand.path().join("pipeline.quality.toml")).expect("the file");
    let settings = ["substeps", "segments", "tolerance"].map(|key| format!("{key} = {}\n", number("settings", key)));
    by_hand.edit(SHOT, "quality = { error = 0.2 }\n", &settings.concat());
    by_hand.report(&[]);
    assert!(by_hand.outputs() == shot.outputs());
    // What is estimated is what comes of it, against a run that is much finer, hair by hair.
    let finer = by_hand.fresh();
    finer.edit(SHOT, &settings[0], "substeps = 48\n");
    finer.edit(SHOT, &settings[2], "tolerance = 1e-7\n");
    finer.report(&[]);
    let tips = |s: &ShotFolder| -> BTreeMap<u64, Vec<[f32; 3]>> {
        let mut file = pelage::format::mcap::read_hair_mcap(&s.path().join("out/ball/hair.mcap")).expect("a file");
        let mut out: BTreeMap<u64, Vec<[f32; 3]>> = BTreeMap::new();
        for l in 0..2 {
            let layer = file.layer(l).expect("a layer");
            for f in 0..3 {
                let frame = file.frame(f, l).expect("a frame");
                for (h, id) in layer.id.iter().enumerate() {
                    out.entry(*id).or_default().push(frame.position[layer.offsets.range(h).end - 1]);
                }
            }
        }
        out
    };
    let (a, b) = (tips(&by_hand), tips(&finer));
    let mut far: Vec<f64> = a
        .iter()
        .flat_map(|(id, p)| p.iter().zip(&b[id]))
        .map(|(p, q)| 10.0 * (0..3).map(|x| f64::from(p[x] - q[x]).powi(2)).sum::<f64>().sqrt())
        .collect();
    far.sort_by(f64::total_cmp);
    // Tips are the farthest of a hair's points: twice the mean of it is generous.
    assert!(far[far.len() / 2] < 2.0 * 0.2, "{} mm", far[far.len() / 2]);
    // Another budget chooses again; a broken file is refused by name.
    shot.edit(SHOT, "error = 0.2", "seconds = 5");
    assert!(shot.succeed(&["plan"]).contains("simulate"));
    shot.report(&[]);
    assert!(String::from_utf8(shot.read("pipeline.quality.toml")).expect("text").contains("seconds = 5"));
    shot.write("pipeline.quality.toml", "budget = 3");
    let out = shot.pelage(&["run"]);
    let err = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && err.contains("pipeline.quality.toml") && err.contains("help:"), "{err}");
}

#[test]
fn the_command_explains_what_it_skipped() {
    let shot = simulated_shot(COMMAND, 2);
    let first = shot.succeed(&["run", "--explain-skips"]);
    assert!(first.contains("not computed:") && first.contains("formats that are not asked for"), "{first}");
    let again = shot.succeed(&["run", "--explain-skips"]);
    assert!(again.starts_with("nothing to do") && again.contains("steps in the cache"), "{again}");
}

#[test]
fn skips_that_make_no_sense_are_refused() {
    for (more, words) in [
        ("\n[skip]\ncamera = true\n", "skip.camera|[preview.camera]"),
        ("\n[skip]\nlod = 1\n", "skip.lod|[preview.camera]"),
        ("\n[skip]\nmask = { map = \"maps/none.png\" }\n", "maps/none.png"),
        ("\n[skip]\nmargin = -1\n", "skip.margin|0 or more"),
        ("\n[skip]\nlods = 1\n", "unknown field `lods`"),
    ] {
        let shot = simulated_shot(COMMAND, 2);
        append(&shot, more);
        let out = shot.pelage(&["run"]);
        let err = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{more}: {err}");
        assert!(words.split('|').all(|w| err.contains(w)), "{more}: {err}");
    }
    for (from, to, words) in [
        ("segments = 8", "segments = 8\nquality = { error = 0.5 }", "simulate.segments|simulate.quality"),
        ("segments = 8", "quality = { error = 0 }", "simulate.quality.error|out of range"),
        ("segments = 8", "quality = { mm = 1 }", "unknown variant `mm`"),
        ("segments = 8", "tolerance = 1.0", "simulate.tolerance|out of range"),
    ] {
        let shot = simulated_shot(COMMAND, 2);
        shot.edit(SHOT, from, to);
        let out = shot.pelage(&["run"]);
        let err = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{to}: {err}");
        assert!(words.split('|').all(|w| err.contains(w)), "{to}: {err}");
    }
}
