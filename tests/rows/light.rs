//! The rows for lights and shadows.

use super::{COMMAND, FILES, GROOM, SHOT, expect, expect_nothing, with_files};
use pelage_tests::{ShotFolder, lit_shot};

const KEY: [&str; 3] = ["shadow/key/1", "shadow/key/2", "shadow/key/3"];
const RIM: [&str; 2] = ["shadow/rim-2/2", "shadow/rim-2/3"];

fn lit() -> ShotFolder {
    let shot = lit_shot(COMMAND, 3);
    shot.report(&[]);
    shot
}

#[test]
fn a_light_moved_makes_its_own_shadows_again() {
    let shot = lit();
    expect_nothing(&shot);
    shot.edit(SHOT, "[0.25, -1.0, 0.0]", "[0.5, -1.0, 0.0]");
    let why = ["pipeline.toml: light[0].direction [0.25, -1.0, 0.0] -> [0.5, -1.0, 0.0]"];
    expect(&shot, &with_files(&KEY), &why);
    shot.edit(SHOT, "cone = 40.0", "cone = 30.0");
    expect(&shot, &with_files(&RIM), &["pipeline.toml: light[1].cone 40 -> 30"]);
    // A key frame that only moves the light at frame 3; the still is of frame 2.
    shot.edit(SHOT, "{ frame = 3, value = [20.0, 4.0, 0.0] }", "{ frame = 2, value = [20.0, 2.0, 0.0] }");
    let why = ["pipeline.toml: light[1].position [20.0, 4.0, 0.0] -> [20.0, 2.0, 0.0]"];
    expect(&shot, &["shadow/rim-2/3", "export/usd", "export/mcap"], &why);
}

#[test]
fn brightness_makes_no_shadows() {
    let shot = lit();
    shot.edit(SHOT, "intensity = 3.0", "intensity = 2.0");
    let light = |name: &str, x: u32| format!("{name}intensity {x}, color [1.0, 1.0, 1.0], frames 2 to 100");
    let changed = |name: &str| format!("pipeline.toml: light[1] {} -> {}", light(name, 3), light(name, 2));
    let why = [changed("rim-2, "), changed("")];
    expect(&shot, FILES, &why.each_ref().map(String::as_str));
}

#[test]
fn quality_makes_all_shadows_again() {
    let shot = lit();
    shot.edit(SHOT, "\"draft\"", "\"fine\"");
    let (run, reasons) = shot.plan(&[]);
    assert_eq!(run.iter().filter(|s| s.starts_with("shadow/")).count(), 5);
    assert!(reasons.len() == 1 && reasons.iter().all(|r| r.starts_with("pipeline.toml: shadow.quality 1024 texels")));
    // By the error that is wanted: the same settings under another name are the same shadows.
    shot.edit(SHOT, "quality = \"fine\"", "error = 0.03");
    expect_nothing(&shot);
}

#[test]
fn widths_and_opacities_are_read_by_shadows_and_colours_are_not() {
    let shot = lit();
    let shadows = [&KEY[..], &RIM].concat();
    shot.edit(GROOM, "value = 40.0, tip = 0.5", "value = 45.0, tip = 0.5");
    let names = [&["instance/width/under"], &shadows[..]].concat();
    expect(&shot, &with_files(&names), &["grooms/ball.toml: layer[0].width.value 40 -> 45"]);
    shot.edit(GROOM, "value = 45.0, tip = 0.5", "value = 45.0, tip = 0.25");
    expect(&shot, &with_files(&shadows), &["grooms/ball.toml: layer[0].width.tip 0.5 -> 0.25"]);
    let text = String::from_utf8(shot.read(GROOM)).expect("text");
    shot.write(GROOM, text.replacen("tip = 0.25 }", "tip = 0.25 }\ncolor = { value = [0.5, 0.25, 0.125] }", 1));
    let (run, _) = shot.plan(&[]);
    assert!(run.contains("instance/color/under") && !run.iter().any(|s| s.starts_with("shadow/")), "{run:?}");
}

#[test]
fn a_light_that_nothing_uses_costs_nothing() {
    let shot = lit_shot(COMMAND, 3);
    // Not written; the picture of frame 2 is drawn by it.
    shot.edit(SHOT, "intensity = 3.0", "intensity = 3.0\nexport = false");
    let (run, _) = shot.plan(&[]);
    assert_eq!(run.iter().filter(|s| s.starts_with("shadow/rim-2")).collect::<Vec<_>>(), ["shadow/rim-2/2"]);
    shot.edit(SHOT, "frames = [2, 100]", "frames = [3, 100]");
    let (run, _) = shot.plan(&[]);
    assert!(!run.iter().any(|s| s.starts_with("shadow/rim-2")));
}

#[test]
fn where_nothing_moves_one_frame_is_as_the_other() {
    let shot = lit_shot(COMMAND, 3);
    shot.edit(SHOT, "motion = \"grooms/ball.csv\"\n", "");
    let report = shot.report(&[]);
    let shadow = &report["stages"][4];
    assert_eq!((&shadow["name"], &shadow["ran"], &shadow["reused"]), (&"shadow".into(), &3.into(), &2.into()));
}
