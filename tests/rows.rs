//! What runs again when something changes, row by row of `docs/cache.md`, with the reason printed. After every edit the
//! results must also be those of a run that starts from nothing.

use pelage_tests::{ExportedHair, ShotFolder, ascii_ply, deformed, exported_hairs, grey_png, small_shot};
use std::collections::{BTreeMap, BTreeSet};

mod comb;
mod light;
mod look;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";
const SHOT: &str = "pipeline.toml";

/// Every whole-shot file and the picture of the small shot.
const FILES: &[&str] = &["export/usd", "export/mcap", "preview/still"];

fn finished() -> ShotFolder {
    let shot = small_shot(COMMAND, 3);
    shot.report(&[]);
    shot
}

/// The small shot with a skin that deforms, one file a frame.
fn deforming() -> ShotFolder {
    let shot = small_shot(COMMAND, 3);
    for frame in 1..=3 {
        shot.write(&format!("anim/ball.{frame:04}.ply"), deformed(f64::from(frame)));
    }
    shot.edit(SHOT, "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
    shot.report(&[]);
    shot
}

/// Step names; `interpolate/x/*` stands for the rest pose and frames 1 to 3, `instance/*/x` for what follows the roots.
fn steps(names: &[&str]) -> BTreeSet<String> {
    let mut out = BTreeSet::new();
    for name in names {
        match name.split_once('*') {
            Some((before, "")) => out.extend(["rest", "1", "2", "3"].map(|f| format!("{before}{f}"))),
            Some((before, after)) => {
                let columns = ["roots", "weights", "length", "width", "opacity", "color"];
                out.extend(columns.map(|c| format!("{before}{c}{after}")));
            }
            None => _ = out.insert((*name).to_owned()),
        }
    }
    out
}

/// Steps that ran, by stage name.
fn ran(report: &serde_json::Value) -> BTreeMap<String, u64> {
    let stages = report["stages"].as_array().expect("stages");
    stages
        .iter()
        .map(|s| (s["name"].as_str().expect("a name").to_owned(), s["ran"].as_u64().expect("a count")))
        .collect()
}

/// What the report of a run over those steps says.
fn tally(steps: &BTreeSet<String>) -> BTreeMap<String, u64> {
    let of = |stage: &str| -> Vec<&String> { steps.iter().filter(|s| s.starts_with(&format!("{stage}/"))).collect() };
    let last = |s: &String| s.rsplit('/').next().expect("a name").to_owned();
    let frames: BTreeSet<String> =
        of("interpolate").into_iter().map(last).filter(|f| f != "rest" && f != "finished").collect();
    // Every stretch is simulated from the first on here.
    let simulated = if of("simulate").is_empty() { 0 } else { frames.len() as u64 };
    let once = |stage| (stage, u64::from(!of(stage).is_empty()));
    let each = |stage| (stage, of(stage).len() as u64);
    let frames = ("interpolate", frames.len() as u64);
    let steps = [frames, each("shadow"), each("export"), each("preview")];
    let all = [once("groom"), once("instance"), ("simulate", simulated)].into_iter().chain(steps);
    all.map(|(name, n)| (name.to_owned(), n)).collect()
}

/// The steps that run are these and no other, for these reasons and no other, and the results are right.
fn expect(shot: &ShotFolder, names: &[&str], why: &[&str]) {
    let (run, reasons) = shot.plan(&[]);
    let expected = steps(names);
    assert_eq!(run, expected, "because {reasons:?}");
    assert_eq!(reasons, why.iter().map(|r| (*r).to_owned()).collect());
    let done = shot.pelage(&["run", "--json"]);
    let talk = String::from_utf8_lossy(&done.stderr);
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap_or_else(|e| panic!("{e}: {talk}"));
    assert_eq!(ran(&report), tally(&expected));
    for reason in why {
        assert!(talk.contains(&format!("because {reason}\n")), "`{reason}` is not said in\n{talk}");
        let stages = report["stages"].as_array().expect("stages");
        assert!(stages.iter().any(|s| s["reasons"].as_array().expect("reasons").iter().any(|r| r == reason)));
    }
    assert!(shot.plan(&[]).0.is_empty());
    let fresh = shot.fresh();
    fresh.report(&[]);
    let (now, new) = (shot.outputs(), fresh.outputs());
    for (name, bytes) in &new {
        assert!(now.get(name) == Some(bytes), "{name} is not what a run from nothing writes");
    }
}

fn expect_nothing(shot: &ShotFolder) {
    let before = shot.outputs();
    expect(shot, &[], &[]);
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
    assert!(shot.outputs() == before);
}

fn with_files(names: &[&'static str]) -> Vec<&'static str> {
    [names, FILES].concat()
}

fn hairs(shot: &ShotFolder) -> BTreeMap<(String, u64), ExportedHair> {
    exported_hairs(&shot.path().join("out/ball/hair.mcap"))
}

#[test]
fn a_second_run_has_nothing_to_do() {
    expect_nothing(&finished());
}

#[test]
fn the_first_run_makes_everything_and_needs_no_reason() {
    let all = ["groom/place", "groom/comb", "instance/candidates/under", "instance/candidates/over"];
    let rest = ["instance/*/under", "instance/*/over", "interpolate/under/*", "interpolate/over/*"];
    expect(&small_shot(COMMAND, 3), &with_files(&[all, rest].concat()), &[]);
}

#[test]
fn density_value() {
    let shot = finished();
    shot.edit(GROOM, "value = 4.0, map", "value = 3.0, map");
    let why = ["grooms/ball.toml: layer[0].density.value 4 -> 3"];
    expect(&shot, &with_files(&["instance/*/under", "interpolate/under/*"]), &why);
    // Beyond the power of two that candidates are made for, they are made anew.
    shot.edit(GROOM, "value = 3.0, map", "value = 5.0, map");
    let why = [
        "grooms/ball.toml: layer[0].density.value 3 -> 5",
        "grooms/ball.toml: layer[0].density.value (candidates) 4 -> 8",
    ];
    let names = with_files(&["instance/candidates/under", "instance/*/under", "interpolate/under/*"]);
    expect(&shot, &names, &why);
    // Far below, they are the beginning of the longer list.
    shot.edit(GROOM, "value = 5.0, map", "value = 1.5, map");
    let why = [
        "grooms/ball.toml: layer[0].density.value 5 -> 1.5",
        "grooms/ball.toml: layer[0].density.value (candidates) 8 -> 2",
    ];
    expect(&shot, &names, &why);
}

#[test]
fn density_map_and_on_off_map() {
    let shot = finished();
    shot.write("maps/half.png", grey_png(64, 64, |x, _| if x < 30 { 255 } else { 96 }));
    expect(&shot, &with_files(&["instance/*/under", "interpolate/under/*"]), &["maps/half.png changed"]);
    shot.write("maps/off.png", grey_png(8, 8, |_, y| if y < 2 { 0 } else { 255 }));
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\non_off = { map = \"../maps/off.png\" }");
    let why = [
        "maps/off.png added",
        "grooms/ball.toml: layer[1].on_off.channel added",
        "grooms/ball.toml: layer[1].on_off.wrap added",
    ];
    expect(&shot, &with_files(&["instance/*/over", "interpolate/over/*"]), &why);
}

#[test]
fn length_map_value_and_noise() {
    let shot = finished();
    shot.write("maps/length.png", grey_png(32, 32, |_, y| 100 + 4 * y as u8));
    expect(&shot, &with_files(&["instance/length/over", "interpolate/over/*"]), &["maps/length.png changed"]);
    shot.edit(GROOM, "length = { value = 1.0, noise = 0.2 }", "length = { value = 1.25, noise = 0.3 }");
    let why =
        ["grooms/ball.toml: layer[0].length.value 1 -> 1.25", "grooms/ball.toml: layer[0].length.noise 0.2 -> 0.3"];
    expect(&shot, &with_files(&["instance/length/under", "interpolate/under/*"]), &why);
}

#[test]
fn the_longest_length_is_that_of_the_control_hairs() {
    let shot = finished();
    shot.edit(GROOM, "value = 2.5", "value = 3");
    let names = ["groom/comb", "instance/length/over", "interpolate/under/*", "interpolate/over/*"];
    expect(&shot, &with_files(&names), &["grooms/ball.toml: layer[1].length.value 2.5 -> 3"]);
    // With a length of their own they are not combed again.
    shot.edit(GROOM, "points = 6\n", "points = 6\nlength = { value = 3.0 }\n");
    shot.report(&[]);
    shot.edit(GROOM, "value = 3,", "value = 2,");
    let names = ["instance/length/over", "interpolate/over/*"];
    expect(&shot, &with_files(&names), &["grooms/ball.toml: layer[1].length.value 3 -> 2"]);
}

#[test]
fn width_opacity_and_colour_interpolate_nothing() {
    let shot = finished();
    let before = hairs(&shot);
    shot.edit(GROOM, "width = { value = 40.0", "width = { value = 55.0");
    expect(&shot, &with_files(&["instance/width/under"]), &["grooms/ball.toml: layer[0].width.value 40 -> 55"]);
    shot.edit(GROOM, "tip = 0.5", "tip = 0.25");
    expect(&shot, FILES, &["grooms/ball.toml: layer[0].width.tip 0.5 -> 0.25"]);
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nopacity = { value = 0.5 }");
    expect(&shot, &with_files(&["instance/opacity/over"]), &["grooms/ball.toml: layer[1].opacity.value 1 -> 0.5"]);
    shot.edit(GROOM, "[0.4, 0.2, 0.1]", "[0.4, 0.3, 0.1]");
    let why = ["grooms/ball.toml: layer[1].color.value [0.4, 0.2, 0.1] -> [0.4, 0.3, 0.1]"];
    expect(&shot, &with_files(&["instance/color/over"]), &why);
    let after = hairs(&shot);
    assert!(before.iter().map(|(k, h)| (k, &h.root, &h.shape)).eq(after.iter().map(|(k, h)| (k, &h.root, &h.shape))));
    assert!(before.iter().all(|(k, h)| h.look != after[k].look));
}

#[test]
fn profiles_and_ramps_only_write_files() {
    let shot = finished();
    let before = hairs(&shot);
    shot.edit(GROOM, "tip = 0.5", "profile = [1.0, 1.25, 0.5]");
    let why = ["grooms/ball.toml: layer[0].width.profile added", "grooms/ball.toml: layer[0].width.tip taken out"];
    expect(&shot, FILES, &why);
    shot.edit(GROOM, "1.25, 0.5]", "1.25, 0.75]");
    let why = ["grooms/ball.toml: layer[0].width.profile [1.0, 1.25, 0.5] -> [1.0, 1.25, 0.75]"];
    expect(&shot, FILES, &why);
    shot.edit(GROOM, "[0.4, 0.2, 0.1]", "[0.4, 0.2, 0.1], noise = 0.0, ramp = [[1, 1, 1], [0.5, 0.5, 2]]");
    expect(&shot, FILES, &["grooms/ball.toml: layer[1].color.ramp added"]);
    shot.edit(GROOM, "[0.5, 0.5, 2]]", "[0.5, 0.5, 1]]");
    let why = [
        "grooms/ball.toml: layer[1].color.ramp [[1.0, 1.0, 1.0], [0.5, 0.5, 2.0]] -> [[1.0, 1.0, 1.0], [0.5, 0.5, 1.0]]",
    ];
    expect(&shot, FILES, &why);
    // Six points a hair: diameters on the profile, colours of the other layer on the ramp, all else as it was.
    for (key, hair) in &hairs(&shot) {
        let (old, look) = (&before[key].look, |k: usize| f32::from_bits(hair.look[k]));
        assert_eq!((&hair.root, &hair.shape), (&before[key].root, &before[key].shape));
        if key.0 == "under" {
            for (k, factor) in [1.0, 1.1, 1.2, 1.15, 0.95, 0.75].into_iter().enumerate() {
                assert!((look(k) / (40e-4 * factor) - 1.0).abs() < 1e-5, "{key:?}: {} at point {k}", look(k));
            }
            assert_eq!(hair.look[6..], old[6..]);
        } else {
            assert_eq!((&hair.look[..6], hair.look.len()), (&old[..6], 6 + 3 * 6 + 1));
            for k in 0..6 {
                let shade = 1.0 - 0.1 * k as f32;
                let wanted = [0.4 * shade, 0.2 * shade, 0.1];
                assert!((0..3).all(|x| (look(6 + 3 * k + x) - wanted[x]).abs() < 1e-6), "{key:?}: point {k}");
            }
        }
    }
}

#[test]
fn guard_hairs_are_two_columns() {
    let shot = finished();
    let before = hairs(&shot);
    let length = with_files(&["instance/length/over", "instance/width/over", "interpolate/over/*"]);
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nguard = { percent = 0.1 }");
    let why = ["percent", "length", "width"].map(|k| format!("grooms/ball.toml: layer[1].guard.{k} added"));
    expect(&shot, &length, &why.each_ref().map(String::as_str));
    shot.edit(GROOM, "percent = 0.1", "percent = 0.1, width = 2.0");
    expect(&shot, &with_files(&["instance/width/over"]), &["grooms/ball.toml: layer[1].guard.width 1.6 -> 2"]);
    let few = hairs(&shot);
    shot.edit(GROOM, "percent = 0.1", "percent = 0.3");
    expect(&shot, &length, &["grooms/ball.toml: layer[1].guard.percent 0.1 -> 0.3"]);
    let many = hairs(&shot);
    // Their rest points, after two weights on the skin.
    let long = |hair: &ExportedHair| {
        let p: Vec<[f32; 3]> = hair.shape[2..20].chunks(3).map(|p| [0, 1, 2].map(|x| f32::from_bits(p[x]))).collect();
        p.windows(2).map(|w| (0..3).map(|x| f64::from(w[1][x] - w[0][x]).powi(2)).sum::<f64>().sqrt()).sum::<f64>()
    };
    let is_guard = |hair: &ExportedHair, old: &ExportedHair| {
        let guard = hair.look[0] != old.look[0];
        let (wide, longer) = if guard { (2.0, 1.5) } else { (1.0, 1.0) };
        assert_eq!(f32::from_bits(hair.look[0]), wide * f32::from_bits(old.look[0]));
        assert!((long(hair) / long(old) - longer).abs() < 1e-5, "{} instead of {}", long(hair), long(old));
        guard
    };
    let mut found = [0; 3];
    for (key, old) in &before {
        if key.0 == "under" {
            assert!(many[key] == *old);
            continue;
        }
        let (a, b) = (is_guard(&few[key], old), is_guard(&many[key], old));
        assert!(b || !a, "hair {key:?} is no guard hair any more");
        found = [found[0] + 1, found[1] + usize::from(a), found[2] + usize::from(b)];
    }
    let [n, a, b] = found.map(|n| n as f64);
    assert!(
        (a / n - 0.1).abs() < 5.0 * (0.09 / n).sqrt() && (b / n - 0.3).abs() < 5.0 * (0.21 / n).sqrt(),
        "{found:?}"
    );
}

#[test]
fn a_comb_operation() {
    let shot = finished();
    let names = with_files(&["groom/comb", "interpolate/under/*", "interpolate/over/*"]);
    shot.edit(GROOM, "bend = 0.6", "bend = 0.7");
    expect(&shot, &names, &["grooms/ball.toml: comb[0].bend 0.6 -> 0.7"]);
    shot.edit(GROOM, "points = 6", "points = 5");
    let why = [
        "grooms/ball.toml: control.points 6 -> 5",
        "grooms/ball.toml: layer[0].points 6 -> 5",
        "grooms/ball.toml: layer[1].points 6 -> 5",
    ];
    expect(&shot, &names, &why);
}

#[test]
fn control_placement_and_partings() {
    let shot = finished();
    let groom = ["groom/place", "groom/comb", "instance/weights/under", "instance/weights/over"];
    let names = with_files(&[&groom[..], &["interpolate/under/*", "interpolate/over/*"]].concat());
    shot.edit(GROOM, "per_cm2 = 0.2", "per_cm2 = 0.25");
    expect(&shot, &names, &["grooms/ball.toml: control.placement.per_cm2 0.2 -> 0.25"]);
    shot.edit(
        GROOM,
        "[[comb]]",
        "[[parting]]\nname = \"top\"\npoints = [[-2.0, 5.0, 0.0], [2.0, 5.0, 0.0]]\n\n[[comb]]",
    );
    expect(&shot, &names, &["grooms/ball.toml: parting[0].points added"]);
}

#[test]
fn a_new_layer() {
    let shot = finished();
    let groom = String::from_utf8(shot.read(GROOM)).expect("text");
    shot.write(GROOM, groom + "\n[[layer]]\nname = \"fluff\"\ndensity = { value = 2.0 }\nlength = { value = 0.5 }\n");
    let names = ["instance/candidates/fluff", "instance/*/fluff", "interpolate/fluff/*"];
    expect(&shot, &with_files(&names), &["new: layer fluff", "grooms/ball.toml: layer[2].width.tip added"]);
}

#[test]
fn one_frame_of_a_deforming_skin() {
    let shot = deforming();
    shot.write("anim/ball.0003.ply", deformed(7.0));
    let names = ["interpolate/under/3", "interpolate/over/3", "export/usd", "export/mcap"];
    expect(&shot, &names, &["anim/ball.0003.ply changed"]);
    // The still shows frame 2.
    shot.write("anim/ball.0002.ply", deformed(5.0));
    expect(&shot, &with_files(&["interpolate/under/2", "interpolate/over/2"]), &["anim/ball.0002.ply changed"]);
}

#[test]
fn one_sample_of_a_motion() {
    let shot = finished();
    let text = String::from_utf8(shot.read("grooms/ball.csv")).expect("text");
    let mut lines: Vec<&str> = text.lines().collect();
    assert!(lines[3].starts_with(&format!("{},0.002,", 2.0 / 24.0)), "{}", lines[3]);
    let moved = lines[3].replacen(",0.002,", ",0.009,", 1);
    lines[3] = &moved;
    shot.write("grooms/ball.csv", lines.join("\n"));
    let names = ["interpolate/under/3", "interpolate/over/3", "export/usd", "export/mcap"];
    expect(&shot, &names, &["grooms/ball.csv at frame 3 changed"]);
}

#[test]
fn the_rest_pose_of_the_skin() {
    let shot = finished();
    let mut mesh = pelage_geom::shapes::cube_sphere(8, 5.0);
    mesh.position[3][1] += 0.05;
    shot.write("grooms/ball.ply", ascii_ply(&mesh));
    let groom = ["groom/place", "groom/comb", "instance/candidates/under", "instance/candidates/over"];
    let rest = ["instance/*/under", "instance/*/over", "interpolate/under/*", "interpolate/over/*"];
    expect(&shot, &with_files(&[groom, rest].concat()), &["grooms/ball.ply changed"]);
}

#[test]
fn preview_settings() {
    let shot = finished();
    shot.edit(SHOT, "size = [160, 120]", "size = [120, 120]");
    expect(&shot, &["preview/still"], &["pipeline.toml: preview.size [160, 120] -> [120, 120]"]);
    shot.edit(SHOT, "sheet = 2", "sheet = 3\nzoom = 2.0\nframe = 3");
    let why = ["pipeline.toml: preview.zoom 1 -> 2", "pipeline.toml: preview.frame 2 -> 3"];
    expect(&shot, &["preview/still"], &why);
    shot.edit(SHOT, "zoom = 2.0\nframe = 3", "exposure = 1.0\nshade = { fur = 0.5 }\nzoom = 2.0\nframe = 3");
    let why = ["pipeline.toml: preview.exposure 0 -> 1", "pipeline.toml: preview.shade.fur 0.8 -> 0.5"];
    expect(&shot, &["preview/still"], &why);
    shot.edit(SHOT, "zoom = 2.0", "camera = { eye = [0, 0, 30], target = [0, 0, 0] }");
    let added = ["eye", "target", "up", "fov"].map(|key| format!("pipeline.toml: preview.camera.{key} added"));
    let gone = ["from", "zoom"].map(|key| format!("pipeline.toml: preview.{key} taken out"));
    let why: Vec<&str> = added.iter().chain(&gone).map(String::as_str).collect();
    expect(&shot, &["preview/still"], &why);
}

#[test]
fn export_formats() {
    let shot = finished();
    shot.edit(SHOT, "[\"usd\", \"mcap\"]", "[\"ply\", \"usd\", \"mcap\"]");
    expect(&shot, &["export/ply"], &["new: export/ply"]);
    assert_eq!(shot.outputs().keys().filter(|n| n.ends_with(".ply")).count(), 3);
    shot.edit(SHOT, "[\"ply\", \"usd\", \"mcap\"]", "[\"mcap\"]");
    expect(&shot, &[], &[]);
}

#[test]
fn more_frames() {
    let shot = small_shot(COMMAND, 5);
    shot.edit(SHOT, "frames = [1, 5]", "frames = [1, 3]");
    shot.report(&[]);
    shot.edit(SHOT, "frames = [1, 3]", "frames = [1, 5]");
    // The middle of the shot is now frame 3.
    let frames = ["interpolate/under/4", "interpolate/over/4", "interpolate/under/5", "interpolate/over/5"];
    let why = ["new: frame 4-5", "pipeline.toml: shot.frames [1, 3] -> [1, 5]", "pipeline.toml: preview.frame 2 -> 3"];
    expect(&shot, &with_files(&frames), &why);
    shot.edit(SHOT, "frames = [1, 5]", "frames = [2, 4]");
    // The motion starts at the shot's first frame unless the file says otherwise, so every frame is another.
    shot.edit(SHOT, "motion = ", "motion_start = 1\nmotion = ");
    expect(&shot, &["export/usd", "export/mcap"], &["pipeline.toml: shot.frames [1, 5] -> [2, 4]"]);
}

#[test]
fn nothing_for_what_is_not_content() {
    let shot = finished();
    let groom = String::from_utf8(shot.read(GROOM)).expect("text");
    shot.write(GROOM, format!("# A comment.\n{}", groom.replace("bend = 0.6", "bend   = 0.60 # sixty percent")));
    expect_nothing(&shot);
    // Touched: the same content with another time.
    for name in ["grooms/ball.ply", "grooms/ball.csv", "maps/half.png", "maps/length.png", SHOT] {
        let past = std::time::SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000_000);
        let file = std::fs::File::options().append(true).open(shot.path().join(name)).expect("the file");
        file.set_modified(past).expect("a time");
    }
    expect_nothing(&shot);
    // Keys in another order.
    shot.edit(GROOM, "placement = { per_cm2 = 0.2 }\npoints = 6", "points = 6\nplacement = { per_cm2 = 0.2 }");
    shot.edit(GROOM, "{ value = 1.0, noise = 0.2 }", "{ noise = 0.2, value = 1.0 }");
    shot.edit(SHOT, "[\"usd\", \"mcap\"]", "[\"mcap\", \"usd\"]");
    expect_nothing(&shot);
    // Defaults written out.
    shot.edit(GROOM, "kind = \"direction-curve\"", "kind = \"direction-curve\"\nweight = 1.0");
    shot.edit(GROOM, "map = \"../maps/half.png\"", "map = \"../maps/half.png\", wrap = \"clamp\", noise = 0");
    expect_nothing(&shot);
}

#[test]
fn nothing_for_another_path() {
    let shot = finished();
    for (from, to) in
        [("maps/half.png", "paint/density/coat.png"), ("grooms/ball.ply", "skin/b.ply"), (GROOM, "b.toml")]
    {
        shot.write(to, shot.read(from));
        std::fs::remove_file(shot.path().join(from)).expect("the file");
    }
    shot.edit("b.toml", "../maps/half.png", "paint/density/coat.png");
    shot.edit("b.toml", "../maps/length.png", "maps/length.png");
    shot.edit(SHOT, "grooms/ball.ply", "skin/b.ply");
    shot.edit(SHOT, GROOM, "b.toml");
    expect_nothing(&shot);
    // The whole folder, with cache and results.
    let moved = ShotFolder::new(COMMAND);
    let place = moved.path().join("deep/er");
    std::fs::create_dir_all(&place).expect("a folder");
    for (name, bytes) in pelage_tests::files_below(shot.path()) {
        moved.write(&format!("deep/er/{name}"), bytes);
    }
    assert!(moved.succeed(&["run", "deep/er/pipeline.toml"]).starts_with("nothing to do"));
    let absolute = place.join(SHOT).to_string_lossy().into_owned();
    assert!(moved.succeed(&["run", &absolute]).starts_with("nothing to do"));
}

#[test]
fn nothing_for_threads_and_verbosity() {
    let shot = finished();
    for arguments in [&["--jobs", "1"][..], &["--jobs", "3", "--quiet"], &["-q"], &["--frames", "2"]] {
        assert!(shot.succeed(&[&["run"], arguments].concat()).starts_with("nothing to do"), "{arguments:?}");
    }
}

#[test]
fn a_forced_stage_runs_and_gives_the_same() {
    let shot = finished();
    let before = (shot.outputs(), shot.entries());
    let all = [
        ("groom", 1),
        ("instance", 1),
        ("simulate", 0),
        ("interpolate", 3),
        ("shadow", 0),
        ("export", 2),
        ("preview", 1),
    ];
    for (stage, n) in all.into_iter().filter(|s| s.1 > 0) {
        let report = shot.report(&["--force", stage]);
        let expected: BTreeMap<String, u64> = all.map(|(s, _)| (s.to_owned(), if s == stage { n } else { 0 })).into();
        assert_eq!(ran(&report), expected);
        let stages = report["stages"].as_array().expect("stages");
        let reasons: Vec<_> = stages.iter().flat_map(|s| s["reasons"].as_array().expect("reasons")).collect();
        assert_eq!(reasons, [&format!("--force {stage}")]);
    }
    assert!(before == (shot.outputs(), shot.entries()));
}

#[test]
fn to_a_stage_and_no_further() {
    let shot = small_shot(COMMAND, 3);
    let report = shot.report(&["--to", "instance"]);
    assert_eq!(ran(&report), BTreeMap::from([("groom".to_owned(), 1), ("instance".to_owned(), 1)]));
    assert!(shot.outputs().is_empty());
    let report = shot.report(&["--to", "export"]);
    assert_eq!(ran(&report)["groom"] + ran(&report)["instance"], 0);
    assert_eq!(shot.outputs().into_keys().collect::<Vec<_>>(), ["ball/hair.mcap", "ball/hair.usdc"]);
    expect(&shot, &["preview/still"], &[]);
}

#[test]
fn whole_shot_files_wait_for_every_frame() {
    let shot = small_shot(COMMAND, 3);
    let out = shot.pelage(&["run", "--json", "--frames", "1,3"]);
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).expect("a report");
    let done = ran(&report);
    assert_eq!((done["interpolate"], done["export"], done["preview"]), (2, 0, 0));
    assert!(String::from_utf8_lossy(&out.stderr).contains("export/usd waits for frame 2\n"));
    assert_eq!(report["stages"][5]["skipped"]["export/usd waiting for frames"], 1);
    assert!(shot.outputs().is_empty());
    let done = ran(&shot.report(&["--frames", "2"]));
    assert_eq!((done["interpolate"], done["export"], done["preview"]), (1, 2, 1));
    expect_nothing(&shot);
}

/// The small shot with a map of 1024 x 1024 on both the density and the length of a dense layer.
fn painted(density: impl Fn(u32, u32) -> u8, length: impl Fn(u32, u32) -> u8) -> ShotFolder {
    let shot = small_shot(COMMAND, 2);
    shot.write("maps/half.png", grey_png(1024, 1024, density));
    shot.write("maps/long.png", grey_png(1024, 1024, length));
    shot.edit(GROOM, "value = 4.0", "value = 40.0");
    shot.edit(GROOM, "length = { value = 1.0,", "length = { value = 1.0, map = \"../maps/long.png\",");
    shot.report(&["--to", "export"]);
    shot
}

#[test]
fn a_higher_density_keeps_every_hair() {
    let shot = painted(|x, y| (x / 8 + y / 8) as u8, |_, _| 255);
    let few = hairs(&shot);
    for value in ["41.0", "82.0", "640.0"] {
        let text = String::from_utf8(shot.read(GROOM)).expect("text");
        let at = text.find("density = { value = ").expect("a density") + 20;
        shot.write(GROOM, format!("{}{value}{}", &text[..at], &text[at + text[at..].find(',').expect("a comma")..]));
        shot.report(&["--to", "export"]);
        let many = hairs(&shot);
        assert!(many.len() > few.len());
        for (key, hair) in &few {
            assert!(many.get(key) == Some(hair), "hair {key:?} is another at a density of {value}");
        }
    }
}

#[test]
fn an_edit_of_a_map_touches_only_hairs_under_it() {
    let block = |x: u32, y: u32| (240..272).contains(&x) && (600..632).contains(&y);
    let paint = |x: u32, y: u32| (60 + (x / 16 + y / 16) % 64) as u8;
    let shot = painted(paint, paint);
    let before = hairs(&shot);
    // Texture coordinates whose filter footprint meets the block; row 0 of the picture is at the top.
    let under = |hair: &ExportedHair| {
        let [u, v] = hair.uv().map(|x| f64::from(x) * 1024.0);
        (239.0..=273.0).contains(&u) && (1024.0 - 633.0..=1024.0 - 599.0).contains(&v)
    };
    assert!(before.values().any(under), "no hair under the edit");
    let mut seen = 0;
    for (file, value) in [("maps/half.png", 0), ("maps/half.png", 255), ("maps/long.png", 255)] {
        shot.write(file, grey_png(1024, 1024, |x, y| if block(x, y) { value } else { paint(x, y) }));
        shot.report(&["--to", "export"]);
        let after = hairs(&shot);
        for (key, hair) in before.iter().filter(|(_, h)| !under(h)) {
            assert!(after.get(key) == Some(hair), "hair {key:?} outside the edit of {file} is another");
        }
        assert!(after.iter().all(|(key, hair)| under(hair) || before.contains_key(key)), "a new hair outside {file}");
        seen += usize::from(after != before);
        shot.write(file, grey_png(1024, 1024, paint));
    }
    assert_eq!(seen, 3, "an edit changed nothing");
}
