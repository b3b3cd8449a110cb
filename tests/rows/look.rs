//! The rows for the look: clumps, curls, waves, noise, wind, areas, collision and what a shot changes of them.

use super::{COMMAND, FILES, GROOM, SHOT, expect, expect_nothing, finished, hairs, with_files};
use pelage_tests::{ShotFolder, grey_png, look_shot, simulated_shot, small_shot};

/// Frames of the layer with clumps of clumps, curls and frizz, and its rest pose.
const OVER: &str = "interpolate/over/*";
/// Those of the layer with areas, waves and wind.
const UNDER: &str = "interpolate/under/*";
const CLUMPS: [&str; 2] = ["instance/clump[0]/over", "instance/clump[1]/over"];

fn looked() -> ShotFolder {
    let shot = look_shot(COMMAND, 3);
    shot.report(&[]);
    shot
}

/// One edit of the groom file after another: what runs besides the whole-shot files, and why.
fn rows(shot: &ShotFolder, rows: &[(&str, &str, &[&'static str], &[&str])]) {
    for (from, to, names, why) in rows {
        shot.edit(GROOM, from, to);
        let why: Vec<String> = why.iter().map(|w| format!("grooms/ball.toml: {w}")).collect();
        let why: Vec<&str> = why.iter().map(|w| w.trim_start_matches("grooms/ball.toml: file ")).collect();
        expect(shot, &with_files(names), &why);
    }
}

#[test]
fn what_clumps_are() {
    let shot = looked();
    let before = hairs(&shot);
    let both = [&CLUMPS[..], &[OVER]].concat();
    let coarse = [CLUMPS[1], OVER];
    shot.write("maps/area.png", grey_png(32, 32, |x, _| if x < 24 { 255 } else { 0 }));
    rows(
        &shot,
        &[
            ("density = 0.25\n", "density = 0.5\n", &both, &["layer[1].clump[0].density 0.25 -> 0.5"]),
            ("density = 0.0625", "density = 0.125", &coarse, &["layer[1].clump[1].density 0.0625 -> 0.125"]),
            ("density = 0.125", "size = 2\ndensity = 0.125", &coarse, &["layer[1].clump[1].size added"]),
            ("size = 2\n", "size = { value = 2, noise = 0.5 }\n", &coarse, &["layer[1].clump[1].size.noise added"]),
            (
                "density = 0.5\n",
                "density = 0.5\narea = { map = \"../maps/area.png\" }\n",
                &both,
                &[
                    "file maps/area.png added",
                    "layer[1].clump[0].area.channel added",
                    "layer[1].clump[0].area.wrap added",
                ],
            ),
        ],
    );
    shot.write("maps/area.png", grey_png(32, 32, |x, _| if x < 16 { 255 } else { 0 }));
    expect(&shot, &with_files(&both), &["maps/area.png changed"]);
    let after = hairs(&shot);
    assert!(
        before.iter().filter(|(k, _)| k.0 == "under").all(|(k, h)| after[k] == *h),
        "another layer's hairs changed"
    );
    assert!(before.iter().any(|(k, h)| after[k] != *h));
}

#[test]
fn how_clumps_draw() {
    let shot = looked();
    rows(
        &shot,
        &[
            ("value = 0.75, map", "value = 0.5, map", &[OVER], &["layer[1].clump[0].percent 0.75 -> 0.5"]),
            ("noise = 0.1 }\nrate", "noise = 0.2 }\nrate", &[OVER], &["layer[1].clump[0].percent.noise 0.1 -> 0.2"]),
            ("rate = 0.25", "rate = 0.5", &[OVER], &["layer[1].clump[0].rate 0.25 -> 0.5"]),
            ("splay = 0.125", "splay = 0.25", &[OVER], &["layer[1].clump[0].splay 0.125 -> 0.25"]),
            ("splay = 0.25", "splay = 0.25\ntaper = 0.5", &[OVER], &["layer[1].clump[0].taper 0 -> 0.5"]),
            (
                "taper = 0.5",
                "taper = 0.5\nkeep_length = true",
                &[OVER],
                &["layer[1].clump[0].keep_length false -> true"],
            ),
        ],
    );
    // The map of the percent is the other layer's density too; the first layer does not wait for the second.
    shot.write("maps/wet.png", grey_png(16, 16, |x, y| (8 * x + 7 * y) as u8));
    shot.edit(GROOM, "value = 0.5, map = \"../maps/half.png\"", "value = 0.5, map = \"../maps/wet.png\"");
    expect(&shot, &with_files(&[OVER]), &["maps/wet.png changed"]);
    shot.write("maps/wet.png", grey_png(16, 16, |x, y| (7 * x + 8 * y) as u8));
    expect(&shot, &with_files(&[OVER]), &["maps/wet.png changed"]);
}

#[test]
fn curls_waves_noise_and_wind() {
    let shot = looked();
    rows(
        &shot,
        &[
            ("radius = 0.08", "radius = 0.1", &[OVER], &["layer[1].curl.radius 0.08 -> 0.1"]),
            ("pitch = 0.8", "pitch = { value = 0.8, noise = 0.1 }", &[OVER], &["layer[1].curl.pitch.noise added"]),
            ("\"helix\"", "\"uniplanar\"", &[OVER], &["layer[1].curl.kind helix -> uniplanar"]),
            ("per_clump = true", "per_clump = false", &[OVER], &["layer[1].curl.per_clump true -> false"]),
            ("amplitude = 0.03", "amplitude = 0.04", &[OVER], &["layer[1].noise[0].amplitude 0.03 -> 0.04"]),
            ("size = 0.5", "size = 0.25", &[OVER], &["layer[1].noise[0].size 0.5 -> 0.25"]),
            ("size = 1.0", "size = 2.0", &[UNDER], &["layer[0].wave[0].size 1 -> 2"]),
            (
                "[0.02, 0.04, 0.04, 0.02]",
                "[0.02, 0.04, 0.04, 0.03]",
                &[UNDER],
                &["layer[0].wave[0].x.amplitude [0.02, 0.04, 0.04, 0.02] -> [0.02, 0.04, 0.04, 0.03]"],
            ),
        ],
    );
    // Wind blows in frames; the rest pose is without.
    let frames = ["interpolate/under/1", "interpolate/under/2", "interpolate/under/3"];
    rows(
        &shot,
        &[
            ("amplitude = 0.1\n", "amplitude = 0.2\n", &frames, &["layer[0].wind.amplitude 0.1 -> 0.2"]),
            ("size = 3.0", "size = 2.5", &frames, &["layer[0].wind.size 3 -> 2.5"]),
            ("size = 2.5", "size = 2.5\ngust = 0.75", &frames, &["layer[0].wind.gust 0.5 -> 0.75"]),
        ],
    );
}

#[test]
fn emitters_and_their_areas() {
    let shot = looked();
    let frames = ["interpolate/under/1", "interpolate/under/2", "interpolate/under/3"];
    let hits = ["interpolate/areas/1", "interpolate/areas/2", "interpolate/areas/3"];
    let both = [&frames[..], &hits].concat();
    rows(
        &shot,
        &[
            ("spread = 10", "spread = 12", &both, &["emitter[0].spread 10 -> 12"]),
            ("rate = 48", "rate = 72", &both, &["emitter[0].rate 48 -> 72"]),
            (
                "position = [0, 20, 0]",
                "position = [1, 20, 0]",
                &both,
                &["emitter[0].position [0, 20, 0] -> [1, 20, 0]"],
            ),
            ("rate = 72", "rate = 72\nseed = 3", &both, &["emitter[0].seed 0 -> 3"]),
            ("percent = 0.875", "percent = 0.5", &frames, &["emitter[0].percent 0.875 -> 0.5"]),
            (
                "{ frame = 4, value = 2 }",
                "{ frame = 4, value = 3 }",
                &frames,
                &["emitter[0].radius [0: 0, 4: 2] -> [0: 0, 4: 3]"],
            ),
            ("wet = { width = 1.5,", "wet = { width = 1.25,", &frames, &["layer[0].clump[0].wet.width 1.5 -> 1.25"]),
        ],
    );
    // What nothing names opens no areas, so it costs nothing.
    let groom = String::from_utf8(shot.read(GROOM)).expect("text");
    let other = "\n[[emitter]]\nname = \"other\"\nposition = [0, 9, 0]\ndirection = [0, -1, 0]\nradius = 1\n";
    shot.write(GROOM, groom + other);
    expect_nothing(&shot);
}

#[test]
fn what_a_shot_changes_of_the_look() {
    let shot = looked();
    // From the groom's value on the first frame on: the rest pose and that frame stay.
    let keys =
        "\n[[look.override]]\nlayer = \"over\"\npercent = [{ frame = 1, value = 0.75 }, { frame = 3, value = 0.25 }]\n";
    let text = String::from_utf8(shot.read(SHOT)).expect("text");
    shot.write(SHOT, text + keys);
    let late = ["interpolate/over/2", "interpolate/over/3"];
    let percent = "pipeline.toml: look.override[0].percent";
    expect(&shot, &with_files(&late), &[&format!("{percent} 0.75 -> 0.5"), &format!("{percent} 0.75 -> 0.25")]);
    // A key at the end changes the frames on its way.
    shot.edit(SHOT, "frame = 3, value = 0.25 }", "frame = 2, value = 0.5 }");
    let files = ["interpolate/over/3", "export/usd", "export/mcap"];
    expect(&shot, &files, &[&format!("{percent} 0.25 -> 0.5")]);
    let level = "clump = 1\nrate = 0.5\nlayer = \"over\"";
    shot.edit(SHOT, "layer = \"over\"", level);
    let why = [
        "pipeline.toml: look.override[0].rate 0 -> 0.5".to_owned(),
        // The first level is the groom's again, the second has the shot's keys.
        "grooms/ball.toml: layer[1].clump[0].percent 0.5 -> 0.75".to_owned(),
        format!("{percent} 0.25 -> 0.75"),
        format!("{percent} 0.375 -> 0.5"),
    ];
    expect(&shot, &with_files(&[OVER]), &why.each_ref().map(String::as_str));
}

#[test]
fn operators_off_in_a_shot() {
    let shot = looked();
    let before = hairs(&shot);
    let text = String::from_utf8(shot.read(SHOT)).expect("text");
    shot.write(SHOT, format!("{text}\n[look]\nnoise = false\n"));
    let (run, _) = shot.plan(&[]);
    assert!(run.iter().all(|s| FILES.contains(&s.as_str()) || s.starts_with("interpolate/over/")), "{run:?}");
    shot.report(&[]);
    shot.write(SHOT, format!("{text}\n[look]\nclump = false\n"));
    let report = shot.report(&[]);
    let counts = report["stages"].to_string();
    assert!(!counts.contains("clumps in level") && !counts.contains("particles"), "{counts}");
    let loose = hairs(&shot);
    assert!(before.keys().eq(loose.keys()) && before != loose);
    // On again, everything is in the cache.
    shot.write(SHOT, format!("{text}\n[look]\nclump = true\n"));
    assert!(shot.plan(&["--to", "interpolate"]).0.is_empty());
    shot.report(&[]);
    assert!(hairs(&shot) == before);
    let all = "clump = false\ncurl = false\nwave = false\nnoise = false\nwind = false\n";
    shot.write(SHOT, format!("{text}\n[look]\n{all}"));
    shot.report(&[]);
    // Nothing is left of the look but the number of points.
    let plain = small_shot(COMMAND, 3);
    plain.edit(GROOM, "color =", "points = 25\ncolor =");
    plain.report(&[]);
    assert!(hairs(&shot) == hairs(&plain));
}

#[test]
fn collision() {
    let shot = finished();
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\ncollision = { clearance = 0.1 }");
    expect(&shot, &with_files(&[OVER]), &["grooms/ball.toml: layer[1].collision.clearance 0.05 -> 0.1"]);
    shot.edit(GROOM, "clearance = 0.1", "clearance = 0.1, held = 2.0");
    expect(&shot, &with_files(&[OVER]), &["grooms/ball.toml: layer[1].collision.held 1 -> 2"]);
    shot.edit(GROOM, "clearance = 0.1, held = 2.0", "enabled = false");
    let gone = ["collision.clearance", "collision.held"].map(|k| format!("grooms/ball.toml: layer[1].{k} taken out"));
    let (run, reasons) = shot.plan(&[]);
    assert!(gone.iter().all(|g| reasons.contains(g)), "{reasons:?}");
    assert!(run.iter().all(|s| !s.contains("under") && !s.contains("instance")), "{run:?}");
    shot.report(&[]);
    let text = String::from_utf8(shot.read(SHOT)).expect("text");
    shot.write(SHOT, format!("{text}\n[look]\ncollision = false\n"));
    let run = shot.plan(&["--to", "interpolate"]).0;
    assert!(!run.is_empty() && run.iter().all(|s| s.starts_with("interpolate/under/")), "{run:?}");
}

/// Simulated hair with clumps and curls in one layer, plain in the other.
fn simulated() -> ShotFolder {
    let shot = simulated_shot(COMMAND, 3);
    let groom = String::from_utf8(shot.read(GROOM)).expect("text");
    let look = "\n[[layer.clump]]\ndensity = 0.25\n\n[layer.curl]\nkind = \"helix\"\nradius = 0.05\npitch = 1.5\n";
    shot.write(GROOM, groom + look);
    shot.report(&[]);
    shot
}

/// Frames and rest pose after the simulation.
const LATER: [&str; 4] =
    ["interpolate/over/finished", "interpolate/over/1", "interpolate/over/2", "interpolate/over/3"];

#[test]
fn no_tweak_of_the_look_simulates() {
    let shot = simulated();
    let clump = [&["instance/clump[0]/over"], &LATER[..]].concat();
    rows(
        &shot,
        &[
            ("density = 0.25", "density = 0.125", &clump, &["layer[1].clump[0].density 0.25 -> 0.125"]),
            ("density = 0.125", "density = 0.125\nsize = 2", &clump, &["layer[1].clump[0].size added"]),
            ("size = 2", "size = 2\npercent = 0.8", &LATER, &["layer[1].clump[0].percent 0.7 -> 0.8"]),
            ("size = 2", "size = 2\nrate = 0.5", &LATER, &["layer[1].clump[0].rate 0 -> 0.5"]),
            ("radius = 0.05", "radius = 0.1", &LATER, &["layer[1].curl.radius 0.05 -> 0.1"]),
            (
                "width = { value = 40.0",
                "width = { value = 55.0",
                &["instance/width/under"],
                &["layer[0].width.value 40 -> 55"],
            ),
            (
                "[0.4, 0.2, 0.1]",
                "[0.4, 0.3, 0.1]",
                &["instance/color/over"],
                &["layer[1].color.value [0.4, 0.2, 0.1] -> [0.4, 0.3, 0.1]"],
            ),
            (
                "name = \"over\"",
                "name = \"over\"\ncollision = { clearance = 0.1 }",
                &LATER,
                &["layer[1].collision.clearance 0.05 -> 0.1"],
            ),
        ],
    );
}

#[test]
fn what_is_simulated_of_the_look_simulates() {
    let shot = simulated();
    let again = [&LATER[..], &["interpolate/over/rest", "simulate/over/1", "simulate/over/3"]].concat();
    shot.edit(GROOM, "density = 0.25", "density = 0.25\nsimulate = true");
    let (run, _) = shot.plan(&[]);
    assert!(again.iter().all(|s| run.contains(*s)), "{run:?}");
    assert!(run.iter().all(|s| !s.contains("under") && !s.starts_with("instance")), "{run:?}");
    shot.report(&[]);
    rows(
        &shot,
        &[
            ("density = 0.25", "percent = 0.8\ndensity = 0.25", &again, &["layer[1].clump[0].percent 0.7 -> 0.8"]),
            // Curls still come afterwards.
            ("radius = 0.05", "radius = 0.1", &LATER, &["layer[1].curl.radius 0.05 -> 0.1"]),
        ],
    );
}

#[test]
fn curls_by_clump_follow_the_clumps_wherever_they_act() {
    // The curls are simulated, the clumps come later; still hairs of a clump curl alike.
    let shot = simulated();
    shot.edit(
        GROOM,
        "name = \"over\"",
        "name = \"over\"\norder = [\"curl\", \"clump\", \"wave\", \"noise\", \"wind\"]",
    );
    shot.edit(GROOM, "pitch = 1.5", "pitch = 1.5\nper_clump = true\nsimulate = true");
    shot.report(&[]);
    shot.edit(GROOM, "density = 0.25", "density = 0.125");
    let again =
        [&LATER[..], &["interpolate/over/rest", "simulate/over/1", "simulate/over/3", "instance/clump[0]/over"]];
    expect(&shot, &with_files(&again.concat()), &["grooms/ball.toml: layer[1].clump[0].density 0.25 -> 0.125"]);
}
