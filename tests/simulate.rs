//! Simulated hair end to end: what runs again, from which checkpoint, and that frames, pre-roll and targets fit together.

use pelage_tests::{ExportedHair, ShotFolder, deformed, exported_hairs, grey_png, simulated_shot};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";
const SHOT: &str = "pipeline.toml";

type Hairs = BTreeMap<(String, u64), ExportedHair>;

fn finished(frames: u32) -> ShotFolder {
    let shot = simulated_shot(COMMAND, frames);
    shot.report(&[]);
    shot
}

/// A skin in files, `first` to `last` of them there, in a shot of frames 1 to 6.
fn deforming(first: i32, last: i32) -> ShotFolder {
    let shot = simulated_shot(COMMAND, 6);
    for frame in first..=last {
        shot.write(&format!("anim/ball.{frame:04}.ply"), deformed(f64::from(frame)));
    }
    shot.edit(SHOT, "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
    shot.report(&[]);
    shot
}

fn stage<'a>(report: &'a Value, name: &str) -> &'a Value {
    report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == name).expect("the stage")
}

fn hairs(shot: &ShotFolder) -> Hairs {
    exported_hairs(&shot.path().join("out/ball/hair.mcap"))
}

/// The simulation's steps that would run are these; the reasons are among those that are printed; that many frames are
/// simulated; and the results are those of a run from nothing.
fn expect(shot: &ShotFolder, steps: &[&str], why: &[&str], frames: u64) {
    let (run, reasons) = shot.plan(&[]);
    let simulated: BTreeSet<&str> = run.iter().map(String::as_str).filter(|s| s.starts_with("simulate/")).collect();
    assert_eq!(simulated, steps.iter().copied().collect(), "because {reasons:?}");
    assert_eq!(reasons, why.iter().map(|r| (*r).to_owned()).collect());
    let done = shot.pelage(&["run", "--json"]);
    let talk = String::from_utf8_lossy(&done.stderr);
    let report: Value = serde_json::from_slice(&done.stdout).unwrap_or_else(|e| panic!("{e}: {talk}"));
    assert_eq!(stage(&report, "simulate")["ran"], frames, "{talk}");
    for reason in why {
        assert!(talk.contains(&format!("because {reason}\n")), "`{reason}` is not said in\n{talk}");
    }
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
    let fresh = shot.fresh();
    fresh.report(&[]);
    assert!(shot.outputs() == fresh.outputs(), "a run from nothing writes something else");
}

const UNDER: [&str; 3] = ["simulate/under/1", "simulate/under/3", "simulate/under/5"];
const OVER: [&str; 3] = ["simulate/over/1", "simulate/over/3", "simulate/over/5"];

fn all() -> Vec<&'static str> {
    [UNDER, OVER].concat()
}

#[test]
fn reports_say_what_was_simulated() {
    let shot = simulated_shot(COMMAND, 6);
    let out = shot.pelage(&["run", "--json"]);
    let talk = String::from_utf8_lossy(&out.stderr);
    let report: Value = serde_json::from_slice(&out.stdout).expect("a report");
    let simulated = stage(&report, "simulate");
    assert_eq!((&simulated["ran"], &simulated["reused"]), (&6.into(), &0.into()));
    let n = stage(&report, "instance")["counts"]["hairs"].as_u64().expect("a count");
    let counts = &simulated["counts"];
    assert!(n > 100);
    assert_eq!((&counts["hairs"], &counts["simulated"], &counts["particles"]), (&n.into(), &n.into(), &(9 * n).into()));
    assert!(talk.contains("hairs of 9 points in under: about "), "memory is stated\n{talk}");
    assert_eq!(stage(&report, "interpolate")["counts"]["points"], 9 * n);
    let again = shot.report(&["--force", "simulate"]);
    assert_eq!(stage(&again, "simulate")["ran"], 6);
    assert_eq!(stage(&again, "simulate")["reasons"], serde_json::json!(["--force simulate"]));
    assert_eq!(stage(&again, "interpolate")["ran"], 0);
}

#[test]
fn length_simulates_and_looks_do_not() {
    let shot = finished(6);
    shot.write("maps/length.png", grey_png(32, 32, |_, y| 100 + 4 * y as u8));
    expect(&shot, &OVER, &["maps/length.png changed"], 6);
    let before = hairs(&shot);
    shot.edit(GROOM, "width = { value = 40.0", "width = { value = 55.0");
    shot.edit(GROOM, "color = { value = [0.4, 0.2, 0.1] }", "color = { value = [0.4, 0.3, 0.1] }");
    shot.edit(GROOM, "[[layer]]\nname = \"over\"", "[[layer]]\nopacity = { value = 0.5 }\nname = \"over\"");
    let why = [
        "grooms/ball.toml: layer[0].width.value 40 -> 55",
        "grooms/ball.toml: layer[1].color.value [0.4, 0.2, 0.1] -> [0.4, 0.3, 0.1]",
        "grooms/ball.toml: layer[1].opacity.value 1 -> 0.5",
    ];
    expect(&shot, &[], &why, 0);
    let after = hairs(&shot);
    assert!(before.iter().all(|(k, h)| h.shape == after[k].shape && h.look != after[k].look));
}

/// Where hairs of the overcoat are in all frames, and how far along u their roots, by id.
fn overcoat(shot: &ShotFolder) -> BTreeMap<u64, (f32, Vec<u32>)> {
    let over = hairs(shot).into_iter().filter(|((name, _), _)| name == "over");
    over.map(|((_, id), h)| (id, (h.uv()[0], h.shape))).collect()
}

#[test]
fn materials_are_painted() {
    let shot = finished(3);
    let paint = |dark: u8| grey_png(64, 1, |x, _| if x < 32 { 255 } else { dark });
    shot.write("maps/stiff.png", paint(51));
    let bend = |value: &str| format!("name = \"over\"\nmaterial = {{ young_gpa = 0.05, bend_factor = {value} }}");
    let painted = "{ value = 5.0, map = \"../maps/stiff.png\" }";
    let mut before = "name = \"over\"".to_owned();
    let mut other = |value: &str| {
        shot.edit(GROOM, &before, &bend(value));
        before = bend(value);
        shot.report(&[]);
        overcoat(&shot)
    };
    let (stiff, both) = (other("5.0"), other(painted));
    let mut seen = [0; 2];
    for (id, (u, shape)) in both.iter().filter(|(_, (u, _))| !(0.48..0.52).contains(u)) {
        // Exactly as stiff where the map is 1, and softer where it is darker.
        assert_eq!(*shape == stiff[id].1, *u < 0.5, "hair {id} at {u}");
        seen[usize::from(*u < 0.5)] += 1;
    }
    assert!(seen[0] > 5 && seen[1] > 5, "{seen:?} hairs");
    shot.write("maps/stiff.png", paint(128));
    let (run, why) = shot.plan(&[]);
    assert!(run.contains("simulate/over/1") && !run.iter().any(|r| r.contains("under")), "{run:?}");
    assert_eq!(why.iter().collect::<Vec<_>>(), ["maps/stiff.png changed"]);
    // Nothing is without stiffness: black is a hundredth.
    shot.write("maps/stiff.png", paint(0));
    let said = stage(&shot.report(&[]), "simulate")["warnings"].to_string();
    assert!(said.contains("layer[1].material.bend_factor: its map and variation say less than 0.01"), "{said}");
    // Too much is refused.
    shot.edit(GROOM, &before, &bend("{ value = 1e9, noise = 0.5 }"));
    let said = String::from_utf8(shot.pelage(&["run"]).stderr).expect("text");
    assert!(said.contains("layer[1].material.bend_factor") && said.contains("by its map and variation"), "{said}");
    shot.edit(GROOM, &bend("{ value = 1e9, noise = 0.5 }"), &before);
    // Variation alone, through control hairs too.
    shot.edit(GROOM, &before, &bend("{ value = 5.0, noise = 0.5 }"));
    shot.edit(SHOT, "segments = 8", "segments = 8\ntarget = \"control-hairs\"");
    shot.report(&[]);
    let varied = overcoat(&shot);
    shot.edit(GROOM, &bend("{ value = 5.0, noise = 0.5 }"), &bend("5.0"));
    shot.report(&[]);
    assert!(overcoat(&shot) != varied);
}

#[test]
fn parameters_gravity_and_wind_simulate() {
    let shot = finished(6);
    shot.edit(SHOT, "segments = 8", "segments = 8\nfriction = 0.5");
    expect(&shot, &all(), &["pipeline.toml: simulate.friction 0.3 -> 0.5"], 6);
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nmaterial = { young_gpa = 4.5 }");
    expect(&shot, &OVER, &["grooms/ball.toml: layer[1].material.young_gpa 3.9 -> 4.5"], 6);
    shot.edit(SHOT, "friction = 0.5", "gravity = 5.0\nfriction = 0.5");
    expect(&shot, &all(), &["pipeline.toml: simulate.gravity [0.0, -9.81, 0.0] -> [0.0, -5.0, 0.0]"], 6);
    shot.edit(SHOT, "[export]", "[simulate.wind]\nvelocity = [1.0, 0.0, 0.0]\n\n[export]");
    let keys =
        ["velocity", "gust", "gust_period", "turbulence", "turbulence_size", "turbulence_period", "boundary", "seed"];
    let added = keys.map(|k| format!("pipeline.toml: simulate.wind.{k} added"));
    expect(&shot, &all(), &added.each_ref().map(String::as_str), 6);
    // A key frame late in the shot changes nothing before the stretch that it first acts in.
    let keys = "velocity = [{ frame = 4, value = [1, 0, 0] }, { frame = 6, value = [3, 0, 0] }]";
    shot.edit(SHOT, "velocity = [1.0, 0.0, 0.0]", keys);
    let (run, _) = shot.plan(&[]);
    assert!(run.contains("simulate/under/5") && !run.contains("simulate/under/3"), "{run:?}");
}

#[test]
fn one_frame_of_the_skin_goes_on_from_the_checkpoint_before_it() {
    let shot = deforming(1, 6);
    shot.write("anim/ball.0005.ply", deformed(7.0));
    let late = ["simulate/under/5", "simulate/over/5"];
    expect(&shot, &late, &["anim/ball.0005.ply changed"], 2);
    shot.write("anim/ball.0004.ply", deformed(3.0));
    let late = ["simulate/under/3", "simulate/over/3", "simulate/under/5", "simulate/over/5"];
    expect(&shot, &late, &["anim/ball.0004.ply changed"], 4);
}

#[test]
fn one_sample_of_a_motion_goes_on_from_the_checkpoint_before_it() {
    let shot = finished(6);
    let edit = |from: &str, to: &str| shot.edit("grooms/ball.csv", from, to);
    edit(&format!("{},0.004,", 4.0 / 24.0), &format!("{},0.009,", 4.0 / 24.0));
    let late = ["simulate/under/5", "simulate/over/5"];
    expect(&shot, &late, &["grooms/ball.csv at frame 5 changed"], 2);
    // A sample between frames 3 and 4: no frame but the way there is another.
    edit(&format!("\n{},0.003,", 3.0 / 24.0), &format!("\n{},0.9,0,0,0,0,0,1\n{},0.003,", 2.5 / 24.0, 3.0 / 24.0));
    let (run, reasons) = shot.plan(&[]);
    assert!(run.contains("simulate/under/3") && !run.contains("simulate/under/1"), "{run:?}");
    assert_eq!(reasons, BTreeSet::from(["grooms/ball.csv at frame 4 changed".to_owned()]));
}

#[test]
fn more_frames_go_on_from_the_last_checkpoint() {
    let shot = simulated_shot(COMMAND, 8);
    shot.edit(SHOT, "frames = [1, 8]", "frames = [1, 5]");
    shot.report(&[]);
    // The last stretch had one frame of its two.
    shot.edit(SHOT, "frames = [1, 5]", "frames = [1, 8]");
    let steps = ["simulate/under/5", "simulate/over/5", "simulate/under/7", "simulate/over/7"];
    let why = [
        "new: frame 6-8",
        "new: frame 7-8",
        "pipeline.toml: shot.frames (simulated) 5-5 -> 5-6",
        "pipeline.toml: shot.frames [1, 5] -> [1, 8]",
        "pipeline.toml: preview.frame 3 -> 4",
    ];
    expect(&shot, &steps, &why, 3);
}

#[test]
fn a_part_of_the_frames_needs_no_later_stretch() {
    let shot = simulated_shot(COMMAND, 6);
    let report = shot.report(&["--frames", "2-3", "--to", "simulate"]);
    assert_eq!(stage(&report, "simulate")["ran"], 4);
    let report = shot.report(&["--to", "simulate"]);
    assert_eq!((&stage(&report, "simulate")["ran"], &stage(&report, "simulate")["reused"]), (&2.into(), &4.into()));
    assert!(report["stages"].as_array().expect("stages").len() == 3 && shot.outputs().is_empty());
    assert_eq!(shot.succeed(&["cache", "prune"]), "removed 0 entries, 0.0 MB\n", "what a part needs is not lost");
}

#[test]
fn targets_give_the_points_that_they_should() {
    let shot = simulated_shot(COMMAND, 3);
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nsimulate = \"control-hairs\"");
    let report = shot.report(&[]);
    let counts = &stage(&report, "simulate")["counts"];
    let simulated = counts["simulated"].as_u64().expect("a count");
    assert!(counts["hairs"] != simulated && counts["particles"] == 9 * simulated, "{counts}");
    let points = |hairs: &Hairs, layer: &str| {
        let counts: BTreeSet<usize> = hairs.iter().filter(|h| h.0.0 == layer).map(|h| h.1.look.len() - 4).collect();
        counts.into_iter().collect::<Vec<_>>()
    };
    let all = hairs(&shot);
    assert_eq!((points(&all, "under"), points(&all, "over")), (vec![9], vec![6]));
    shot.edit(SHOT, "segments = 8", "target = \"off\"\nsegments = 8");
    let (run, reasons) = shot.plan(&[]);
    assert!(run.iter().all(|s| s.starts_with("simulate/over/") || !s.starts_with("simulate/")), "{run:?}");
    assert!(!run.iter().any(|s| s.starts_with("interpolate/over/")), "{run:?}");
    assert!(reasons.contains("pipeline.toml: simulate.target taken out"), "{reasons:?}");
    shot.report(&[]);
    assert_eq!(points(&hairs(&shot), "under"), [6]);
}

/// One layer moves hair by hair, the other rides the skin, in one run; neither's look is the other's matter.
#[test]
fn layers_have_targets_of_their_own() {
    let shot = simulated_shot(COMMAND, 6);
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nsimulate = \"off\"");
    let report = shot.report(&[]);
    let all = hairs(&shot);
    let under = all.keys().filter(|k| k.0 == "under").count();
    assert!(under > 50 && all.len() > under + 50);
    let counts = &stage(&report, "simulate")["counts"];
    assert_eq!((&counts["simulated"], &counts["particles"]), (&under.into(), &(9 * under).into()));
    let only = |steps: &[&str]| {
        let (run, _) = shot.plan(&[]);
        let files = ["export/usd", "export/mcap", "preview/still"];
        let stray: Vec<&String> =
            run.iter().filter(|s| !files.contains(&s.as_str()) && !steps.iter().any(|w| s.starts_with(w))).collect();
        assert!(stray.is_empty() && steps.iter().all(|w| run.iter().any(|s| s.starts_with(w))), "{run:?}");
    };
    // Looks of the simulated layer: no layer moves anew, and of the other layer nothing is read again.
    shot.edit(GROOM, "width = { value = 40.0, tip = 0.5 }", "width = { value = 55.0, profile = [1, 0.5, 0.1] }");
    shot.edit(GROOM, "[[layer]]", "[[layer]]\ncolor = { value = [0.2, 0.3, 0.1], ramp = [[1, 1, 1], [2, 2, 1]] }");
    only(&["instance/width/under", "instance/color/under"]);
    let why = [
        "width.value 40 -> 55",
        "width.profile added",
        "width.tip taken out",
        "color.value [0.15, 0.08, 0.04] -> [0.2, 0.3, 0.1]",
        "color.noise 0.1 -> 0",
        "color.ramp added",
    ]
    .map(|w| format!("grooms/ball.toml: layer[0].{w}"));
    expect(&shot, &[], &why.each_ref().map(String::as_str), 0);
    // The length of the layer that rides.
    shot.edit(GROOM, "length = { value = 2.5,", "length = { value = 2.5, noise = 0.1,");
    only(&["instance/length/over", "interpolate/over/"]);
    expect(&shot, &[], &["grooms/ball.toml: layer[1].length.noise 0 -> 0.1"], 0);
    let after = hairs(&shot);
    for (key, hair) in &all {
        assert_eq!(hair.shape == after[key].shape, key.0 == "under", "{key:?}");
        assert_eq!(hair.look == after[key].look, key.0 == "over", "{key:?}");
    }
    // Guard hairs are longer: where they are simulated, so are they anew.
    shot.edit(GROOM, "[[layer]]", "[[layer]]\nguard = { percent = 0.2, length = 1.3, width = 1 }");
    only(&["instance/length/under", "instance/width/under", "simulate/under/", "interpolate/under/"]);
    let why = ["percent", "length", "width"].map(|k| format!("grooms/ball.toml: layer[0].guard.{k} added"));
    expect(&shot, &UNDER, &why.each_ref().map(String::as_str), 6);
    shot.edit(GROOM, "width = 1 }", "width = 2 }");
    expect(&shot, &[], &["grooms/ball.toml: layer[0].guard.width 1 -> 2"], 0);
}

/// Without gravity, and before anything but the skin moves them, hairs start where the groom has them.
#[test]
fn frames_before_the_first_come_from_the_sequence() {
    let with = deforming(-2, 6);
    let without = deforming(1, 6);
    let changed = |shot: &ShotFolder, frame: i32| {
        shot.write(&format!("anim/ball.{frame:04}.ply"), deformed(9.0));
        shot.plan(&[]).0.contains("simulate/under/1")
    };
    // Three frames of pre-roll: the first eases from the rest pose at frame -2, so the sequence is read from -1 on.
    assert!(changed(&with, 0) && changed(&with, -1));
    assert!(changed(&without, 0), "a new file before the first frame is read");
    let shot = deforming(-2, 6);
    assert!(!changed(&shot, -2) && !changed(&shot, -3));
}

#[test]
fn without_preroll_the_skin_must_start_at_rest() {
    let shot = simulated_shot(COMMAND, 3);
    shot.edit(SHOT, "preroll = 3", "preroll = 0");
    shot.report(&[]);
    let first = hairs(&shot);
    for hair in first.values() {
        let points = (hair.look.len() - 4) * 3;
        let rest = &hair.shape[2..2 + points];
        assert_eq!(rest.len(), points);
    }
    shot.edit(SHOT, "motion = ", "motion_start = -3\nmotion = ");
    let out = shot.pelage(&["run"]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2));
    assert!(said.contains("shot.preroll: is 0, but roots are not at their rest pose at frame 1"), "{said}");
}

#[test]
fn every_file_of_a_simulated_stretch_can_be_inspected() {
    let shot = finished(3);
    let mut kinds = BTreeSet::new();
    for name in shot.entries().into_keys() {
        let path = format!(".pelage-cache/v1/entries/{name}");
        let found: Value = serde_json::from_str(&shot.succeed(&["inspect", &path, "--json"])).expect("JSON");
        let file = name.rsplit('/').next().expect("a name").split('.').next().expect("a word").to_owned();
        kinds.insert((file, found["kind"].as_str().expect("a kind").to_owned()));
    }
    assert!(kinds.contains(&("frame".to_owned(), "cached frame".to_owned())), "{kinds:?}");
    assert!(kinds.contains(&("state".to_owned(), "simulation state".to_owned())), "{kinds:?}");
}

/// Depth of the deepest point of any hair inside the ball's mesh at frame 1, where the ball is `moved` to along x, cm.
fn deepest(shot: &ShotFolder, frame: f64, moved: f64) -> f64 {
    let mesh = pelage_geom::shapes::cube_sphere(8, 5.0);
    let topology = pelage_geom::Topology::new(&mesh);
    let bvh = pelage_geom::Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let file = shot.path().join("out/ball/hair.usdc");
    let layers = pelage::curves::read(&file, Some(frame)).unwrap_or_else(|e| panic!("{e}")).layers;
    let mut deepest = 0.0f64;
    for l in &layers {
        for h in 0..l.strands.len() {
            // The clamped segment belongs to the skin.
            for p in &l.strands.points(h)[2..] {
                let at = pelage_geom::Vec3::new(f64::from(p[0]) - moved, f64::from(p[1]), f64::from(p[2]));
                let found = bvh.closest(at, f64::INFINITY).expect("a mesh");
                deepest = deepest.max(-found.signed_distance);
            }
        }
    }
    deepest
}

/// Hair so soft that it comes down on the ball.
fn soften(shot: &ShotFolder) {
    shot.edit(SHOT, "segments = 8", "segments = 8\nsag_free = false");
    shot.edit(GROOM, "name = \"over\"", "name = \"over\"\nmaterial = { young_gpa = 0.01 }");
    shot.edit(GROOM, "name = \"under\"", "name = \"under\"\nmaterial = { young_gpa = 0.01 }");
}

/// The ball only slides.
fn slide(shot: &ShotFolder) {
    let slide: String =
        (0..=4).map(|f| format!("{},{},0,0,0,0,0,1\n", f64::from(f) / 24.0, 0.002 * f64::from(f))).collect();
    shot.write("grooms/ball.csv", format!("time_s,tx,ty,tz,qx,qy,qz,qw\n{slide}"));
}

#[test]
fn the_skin_and_other_meshes_keep_hair_out() {
    let shot = simulated_shot(COMMAND, 4);
    soften(&shot);
    slide(&shot);
    // What the simulation lets in would be pushed out afterwards.
    shot.edit(SHOT, "[export]", "[look]\ncollision = false\n\n[export]");
    shot.report(&[]);
    let with = deepest(&shot, 4.0, 0.6);
    assert!(with < 0.05, "hair is {with} cm inside");
    let before = shot.outputs();
    shot.edit(SHOT, "[export]", "[simulate.body]\nskin = false\n\n[export]");
    let why = ["pipeline.toml: simulate.body.skin true -> false"];
    let (run, reasons) = shot.plan(&[]);
    assert!(all().iter().filter(|s| !s.ends_with("/5")).all(|s| run.contains(*s)), "{run:?}");
    assert!(why.iter().all(|w| reasons.contains(*w)), "{reasons:?}");
    shot.report(&[]);
    assert!(deepest(&shot, 4.0, 0.6) > 0.1 && shot.outputs() != before, "without the skin hair falls through it");
    // The same ball as a mesh of its own, with its motion.
    shot.edit(
        SHOT,
        "[export]",
        "[[simulate.body.mesh]]\nfile = \"grooms/ball.ply\"\nmotion = \"grooms/ball.csv\"\n\n[export]",
    );
    shot.report(&[]);
    let with = deepest(&shot, 4.0, 0.6);
    assert!(with < 0.05, "hair is {with} cm inside the other mesh");
    shot.edit(
        SHOT,
        "motion = \"grooms/ball.csv\"\n\n[export]",
        "motion = \"grooms/ball.csv\"\nkind = \"ellipsoid\"\n\n[export]",
    );
    let (_, reasons) = shot.plan(&[]);
    assert_eq!(
        reasons.into_iter().collect::<Vec<_>>(),
        ["pipeline.toml: simulate.body.mesh[0].kind field -> ellipsoid"]
    );
    shot.report(&[]);
    let fresh = shot.fresh();
    fresh.report(&[]);
    assert!(shot.outputs() == fresh.outputs(), "not what a run from nothing gives");
}

#[test]
fn threads_do_not_show_in_soft_hair_in_contact() {
    let shot = simulated_shot(COMMAND, 4);
    soften(&shot);
    let other = shot.fresh();
    shot.report(&["--jobs", "1"]);
    other.report(&["--jobs", "2"]);
    assert!(shot.outputs() == other.outputs());
}

#[test]
fn deforming_skins_and_gusts_give_the_same_bytes_from_any_checkpoint() {
    let shot = deforming(1, 6);
    let gusts = "[simulate.wind]\nvelocity = [{ frame = 1, value = [1, 0, 0] }, { frame = 4, value = [3, 0, 1] }]\n\
                 gust = 0.5\nturbulence = 0.5\n\n[export]";
    shot.edit(SHOT, "[export]", gusts);
    shot.report(&["--jobs", "2"]);
    shot.write("anim/ball.0005.ply", deformed(7.0));
    shot.report(&["--jobs", "1"]);
    let fresh = shot.fresh();
    fresh.report(&[]);
    assert!(shot.outputs() == fresh.outputs());
}

#[test]
fn tables_and_ellipsoids_keep_hair_out_too() {
    let shot = simulated_shot(COMMAND, 4);
    soften(&shot);
    shot.edit(SHOT, "[export]", "[simulate.body]\nkind = \"cylinder\"\n\n[export]");
    slide(&shot);
    for kind in ["cylinder", "sphere", "ellipsoid"] {
        if kind != "cylinder" {
            let before = if kind == "sphere" { "cylinder" } else { "sphere" };
            shot.edit(SHOT, &format!("kind = \"{before}\""), &format!("kind = \"{kind}\""));
        }
        shot.report(&[]);
        let inside = deepest(&shot, 4.0, 0.6);
        assert!(inside < 0.05, "{kind}: hair is {inside} cm inside");
    }
}
