//! Hair from a curves file: with a skin and without one, still and moved, simulated and not.

use pelage::curves;
use pelage_tests::{ShotFolder, exported_hairs, simulated_shot};
use serde_json::Value;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");

/// The shot of one strand as the documentation has it.
fn documented() -> ShotFolder {
    let docs = include_str!("../docs/files.md");
    let block = |kind: &str| {
        let start = docs.find(&format!("```{kind}\n")).unwrap_or_else(|| panic!("no block of {kind}")) + kind.len() + 4;
        docs[start..start + docs[start..].find("```").expect("an end")].to_owned()
    };
    let shot = ShotFolder::new(COMMAND);
    let text = block("toml strand");
    assert!(text.lines().count() <= 10, "a shot of ten lines:\n{text}");
    shot.write("pipeline.toml", text);
    shot.write("strand.ply", block("ply"));
    shot
}

fn report(shot: &ShotFolder) -> Value {
    let report = shot.report(&[]);
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
    report
}

fn stage<'a>(report: &'a Value, name: &str) -> &'a Value {
    report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == name).expect("the stage")
}

#[test]
fn one_strand_is_a_shot_of_ten_lines() {
    let shot = documented();
    let done = report(&shot);
    assert_eq!(stage(&done, "simulate")["counts"]["simulated"], 1);
    let file = shot.path().join("out/strand/hair.usdc");
    let at = |frame: f64| curves::read(&file, Some(frame)).unwrap_or_else(|e| panic!("{e}")).layers.remove(0);
    let first = at(1.0);
    let drawn = curves::read(&shot.path().join("strand.ply"), None).unwrap_or_else(|e| panic!("{e}")).layers.remove(0);
    assert_eq!((first.name.as_str(), first.strands.position.len()), ("hair", drawn.strands.position.len()));
    // It starts as it was drawn, and its clamp stays.
    let apart = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|x| (a[x] - b[x]).abs()).fold(0.0, f32::max);
    let last = at(48.0);
    let pairs = first.strands.position.iter().zip(&drawn.strands.position);
    let moved = pairs.map(|(a, b)| apart(a, b)).fold(0.0, f32::max);
    assert!(moved < 1e-6, "at the first frame it has moved by {moved}");
    assert!(apart(&last.strands.position[0], &drawn.strands.position[0]) < 1e-6);
    assert!(last.strands.position[10][1] < -0.5, "the tip hangs: {:?}", last.strands.position[10]);
    shot.succeed(&["inspect", "out/strand/hair.usdc"]);
    assert!(shot.path().join("out/strand/preview.png").exists());
}

#[test]
fn segments_resample_and_off_leaves_curves_as_they_are() {
    let shot = documented();
    shot.edit("pipeline.toml", "[groom]", "[simulate]\ntarget = \"off\"\n[groom]");
    report(&shot);
    let file = shot.path().join("out/strand/hair.usdc");
    let points = |frame: f64| {
        let layer = curves::read(&file, Some(frame)).unwrap_or_else(|e| panic!("{e}")).layers.remove(0);
        layer.strands.position
    };
    let drawn = curves::read(&shot.path().join("strand.ply"), None).unwrap_or_else(|e| panic!("{e}")).layers.remove(0);
    assert_eq!(points(30.0), drawn.strands.position);
    shot.edit("pipeline.toml", "target = \"off\"", "target = \"off\"\nsegments = 7");
    let (run, reasons) = shot.plan(&[]);
    assert!(run.contains("interpolate/hair/rest") && !run.contains("instance/curves"), "{run:?}");
    assert!(reasons.contains("pipeline.toml: simulate.segments as they are -> 7"), "{reasons:?}");
    report(&shot);
    assert_eq!(points(30.0).len(), 8);
    shot.edit("pipeline.toml", "target = \"off\"\n", "");
    report(&shot);
    assert_eq!(points(1.0).len(), 8);
}

#[test]
fn a_motion_moves_curves_without_a_skin() {
    let shot = documented();
    shot.edit(
        "pipeline.toml",
        "[groom]",
        "[simulate]\ntarget = \"off\"\n[groom]\nmotion = \"go.csv\"\npivot = [0, 0, 0]",
    );
    let h = std::f64::consts::FRAC_1_SQRT_2;
    // 2 cm along x, and a quarter turn about z, in two seconds.
    shot.write("go.csv", format!("time_s,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0.02,0,0,0,0,{h},{h}\n"));
    report(&shot);
    let file = shot.path().join("out/strand/hair.usdc");
    let at = |frame: f64| curves::read(&file, Some(frame)).unwrap_or_else(|e| panic!("{e}")).layers.remove(0).strands;
    let (a, b) = (at(1.0).position, at(25.0).position);
    for (p, q) in a.iter().zip(&b) {
        let expected = [2.0 - p[1], p[0], p[2]];
        assert!((0..3).all(|x| (q[x] - expected[x]).abs() < 1e-4), "{q:?} is not {expected:?}");
    }
    shot.edit("pipeline.toml", "target = \"off\"\n", "");
    report(&shot);
    let q = at(25.0).position[0];
    assert!((q[0] - (2.0 - a[0][1])).abs() < 1e-4 && (q[1] - a[0][0]).abs() < 1e-4, "the clamp follows: {q:?}");
    // One that does not start at rest needs frames to come there.
    shot.edit("pipeline.toml", "motion = ", "motion_start = -5\nmotion = ");
    let out = shot.pelage(&["run"]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && said.contains("shot.preroll: is 0"), "{said}");
    shot.edit("pipeline.toml", "fps = 24", "fps = 24\npreroll = 8");
    report(&shot);
}

/// A shot on the ball whose hair is what another shot exported.
fn on_the_ball() -> ShotFolder {
    let shot = simulated_shot(COMMAND, 4);
    shot.edit("pipeline.toml", "preroll = 3", "preroll = 0");
    let first = shot.fresh();
    first.edit("pipeline.toml", "segments = 8", "target = \"off\"");
    first.report(&[]);
    shot.write("hair.usdc", first.read("out/ball/hair.usdc"));
    shot.edit("pipeline.toml", "file = \"grooms/ball.toml\"", "curves = \"hair.usdc\"");
    shot.edit("pipeline.toml", "segments = 8\n", "");
    shot
}

#[test]
fn curves_are_bound_to_the_skin() {
    let shot = on_the_ball();
    let done = report(&shot);
    let warnings = stage(&done, "instance")["warnings"].to_string();
    assert!(warnings.contains("roots are 0.00 mm from the skin on average, 0.00 mm at most"), "{warnings}");
    let n = stage(&done, "instance")["counts"]["hairs"].as_u64().expect("a count");
    assert!(n > 100 && stage(&done, "simulate")["counts"]["simulated"] == n);
    let hairs = exported_hairs(&shot.path().join("out/ball/hair.mcap"));
    assert!(hairs.len() as u64 == n && hairs.values().all(|h| h.root.0 >= 0));
    // Off, hairs ride the skin as they are.
    shot.edit("pipeline.toml", "checkpoint = 2", "target = \"off\"");
    report(&shot);
    let read = |frame: f64| {
        let file = curves::read(&shot.path().join("out/ball/hair.usdc"), Some(frame)).unwrap_or_else(|e| panic!("{e}"));
        file.layers.into_iter().next().expect("a layer").strands
    };
    let (a, b) = (read(1.0), read(4.0));
    let turned = 0.15f32;
    for (p, q) in a.position.iter().zip(&b.position) {
        let expected =
            [turned.cos() * p[0] + turned.sin() * p[2] + 0.3, p[1], turned.cos() * p[2] - turned.sin() * p[0]];
        assert!((0..3).all(|x| (q[x] - expected[x]).abs() < 1e-3), "{q:?} is not {expected:?}");
    }
}

#[test]
fn what_runs_again_for_curves() {
    let shot = on_the_ball();
    report(&shot);
    shot.edit("pipeline.toml", "checkpoint = 2", "checkpoint = 2\nmaterial = { young_gpa = 2.0 }");
    let (run, reasons) = shot.plan(&[]);
    assert!(run.iter().all(|s| !s.starts_with("instance/") && s != "interpolate/hair/rest"), "{run:?}");
    assert!(run.contains("simulate/hair/1"), "{run:?}");
    assert_eq!(reasons.into_iter().collect::<Vec<_>>(), ["pipeline.toml: simulate.material.young_gpa 3.9 -> 2"]);
    report(&shot);
    let fresh = shot.fresh();
    fresh.report(&["--jobs", "1"]);
    assert!(shot.outputs() == fresh.outputs());
    // Other curves: everything.
    let first = shot.fresh();
    first.edit("pipeline.toml", "curves = \"hair.usdc\"", "file = \"grooms/ball.toml\"");
    first.edit("pipeline.toml", "checkpoint = 2\nmaterial = { young_gpa = 2.0 }", "target = \"off\"");
    first.edit("grooms/ball.toml", "value = 0.6", "value = 0.7");
    first.report(&[]);
    shot.write("hair.usdc", first.read("out/ball/hair.usdc"));
    let (run, reasons) = shot.plan(&[]);
    assert!(run.contains("instance/curves") && run.contains("simulate/hair/3"), "{run:?}");
    assert!(reasons.contains("hair.usdc changed"), "{reasons:?}");
}

#[test]
fn odd_curves_are_said_or_refused() {
    let shot = documented();
    let good = String::from_utf8(shot.read("strand.ply")).expect("text");
    let refused = |text: &str, words: &[&str]| {
        shot.write("strand.ply", text);
        let out = shot.pelage(&["run"]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert!(words.iter().all(|w| said.contains(w)), "{words:?} are not in\n{said}");
    };
    refused(&good.replacen("1 0 0\n", "nan 0 0\n", 1), &["strand.ply", "vertex 1", "not a finite number"]);
    refused(&good.replacen("0 11\n", "0 1\n", 1), &["strand.ply", "curve"]);
    // The third point at the place of the second.
    shot.write("strand.ply", good.replacen("2 0 0\n", "1 0 0\n", 1));
    let done = report(&shot);
    assert_eq!(stage(&done, "instance")["counts"]["points at the place of the one before"], 1);
    shot.write("strand.ply", good);
    let wrong = [
        ("curves = \"strand.ply\"", "curves = \"strand.ply\"\nfile = \"a.toml\"", "groom.curves: can't go together"),
        ("curves = \"strand.ply\"", "file = \"a.toml\"", "groom.file: a groom needs a skin"),
        ("curves = \"strand.ply\"", "curves = \"gone.ply\"", "groom.curves: there is no file"),
        (
            "[groom]",
            "[simulate]\ntarget = \"control-hairs\"\n[groom]",
            "simulate.target: hair from a curves file has no",
        ),
        ("[groom]", "[groom]\nmotion = \"gone.csv\"", "groom.motion: there is no file"),
        ("[groom]", "[skin]\nrest = \"gone.ply\"\n[groom]\nmotion = \"go.csv\"", "groom.motion: moves curves without"),
        ("[groom]", "[groom]\npivot = [nan, 0, 0]", "groom.pivot: must be three finite numbers"),
    ];
    for (from, to, words) in wrong {
        let text = String::from_utf8(shot.read("pipeline.toml")).expect("text");
        shot.edit("pipeline.toml", from, to);
        let out = shot.pelage(&["run"]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(2) && said.contains(words), "`{words}` is not in\n{said}");
        shot.write("pipeline.toml", text);
    }
}
