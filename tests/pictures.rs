//! Pictures end to end: sequences, turntables, cameras, heat maps.

use pelage::format::image::{Channel, read_map};
use pelage_tests::{ShotFolder, lit_shot, look_shot, small_shot};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const SHOT: &str = "pipeline.toml";
const OUT: &str = "out/ball";

fn pictures(shot: &ShotFolder) -> Vec<String> {
    let names = shot.outputs().into_keys().filter(|n| n.ends_with(".png"));
    names.map(|n| n.trim_start_matches("ball/").to_owned()).collect()
}

#[test]
fn a_sequence_is_a_picture_of_every_frame_and_goes_on_where_it_was() {
    let shot = lit_shot(COMMAND, 3);
    shot.succeed(&["preview", "--sequence", "--frames", "2-3"]);
    assert_eq!(pictures(&shot), ["preview.0002.png", "preview.0003.png"]);
    let first = shot.read(&format!("{OUT}/preview.0002.png"));
    let report: serde_json::Value =
        serde_json::from_str(&shot.succeed(&["preview", "--sequence", "--json", "--quiet"])).expect("a report");
    let stage = report["stages"].as_array().expect("stages").last().expect("one").clone();
    assert_eq!((&stage["name"], &stage["ran"], &stage["reused"]), (&"preview".into(), &1.into(), &2.into()));
    // The same picture whatever else was asked for: one camera for all.
    let fresh = shot.fresh();
    fresh.succeed(&["preview", "--sequence"]);
    assert_eq!(pictures(&fresh).len(), 3);
    assert!(fresh.read(&format!("{OUT}/preview.0002.png")) == first);
}

#[test]
fn a_turntable_goes_all_the_way_round() {
    let shot = small_shot(COMMAND, 2);
    shot.edit(SHOT, "sheet = 2", "turntable = 4");
    shot.succeed(&["preview", "--turntable"]);
    let names: Vec<String> = (1..=4).map(|k| format!("turntable.{k:03}.png")).collect();
    assert_eq!(pictures(&shot), names);
    let read: Vec<Vec<u8>> = names.iter().map(|n| shot.read(&format!("{OUT}/{n}"))).collect();
    assert!((0..4).all(|k| read[k] != read[(k + 1) % 4]));
    // A camera that is told where to stand goes round what it looks at.
    shot.edit(SHOT, "turntable = 4", "turntable = 2\ncamera = { eye = [0, 0, 40], target = [0, 0, 0] }");
    shot.succeed(&["preview", "--turntable"]);
    let one = shot.read(&format!("{OUT}/turntable.001.png"));
    shot.edit(SHOT, "eye = [0, 0, 40]", "eye = [0, 0, -40]");
    shot.succeed(&["preview", "--turntable"]);
    assert!(shot.read(&format!("{OUT}/turntable.002.png")) == one, "half way round is the other side");
}

#[test]
fn a_camera_with_key_frames_changes_the_frames_that_it_moves_at() {
    let shot = small_shot(COMMAND, 3);
    let keys = "[{ frame = 1, value = [0, 0, 40] }, { frame = 3, value = [10, 0, 40] }]";
    shot.edit(SHOT, "sheet = 2", &format!("camera = {{ eye = {keys}, target = [0, 0, 0] }}"));
    shot.succeed(&["preview", "--sequence"]);
    shot.edit(SHOT, "value = [10, 0, 40]", "value = [10, 10, 40]");
    let report: serde_json::Value =
        serde_json::from_str(&shot.succeed(&["preview", "--sequence", "--json", "--quiet"])).expect("a report");
    let stage = report["stages"].as_array().expect("stages").last().expect("one").clone();
    assert_eq!((&stage["ran"], &stage["reused"]), (&2.into(), &1.into()), "{stage}");
}

#[test]
fn exposure_and_tone_change_the_values_of_a_picture() {
    let mean = |line: &str| {
        let shot = small_shot(COMMAND, 2);
        shot.edit(SHOT, "sheet = 2", line);
        shot.succeed(&["run"]);
        let path = shot.path().join(format!("{OUT}/preview.png"));
        let map = read_map(&path, Channel::Rgb, true).expect("a picture").map;
        let values = map.data;
        values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
    };
    let plain = mean("sheet = 2");
    assert!((mean("exposure = -1.0") / plain - 0.5).abs() < 0.05);
    assert!(mean("tone = \"straight\"") >= plain);
}

#[test]
fn every_column_has_a_picture() {
    let shot = look_shot(COMMAND, 2);
    let text = String::from_utf8(shot.read(SHOT)).expect("text");
    shot.write(SHOT, text + "\n[[light]]\nname = \"key\"\nkind = \"directional\"\ndirection = [0, -1, 0]\n");
    let columns =
        ["length", "density", "width", "opacity", "strain", "penetration", "transmittance", "clump", "wetness"];
    let mut seen = std::collections::BTreeSet::new();
    for column in columns {
        let said = shot.succeed(&["preview", "--show", column]);
        assert!(said.starts_with(&format!("{OUT}/preview-{column}.png: 160 x 120")), "{said}");
        seen.insert(shot.read(&format!("{OUT}/preview-{column}.png")));
    }
    assert_eq!(seen.len(), columns.len(), "each looks different");
    shot.succeed(&["preview", "--show", "transmittance:key", "--range", "0,2"]);
    assert_ne!(
        shot.read(&format!("{OUT}/preview-transmittance-key.png")),
        shot.read(&format!("{OUT}/preview-transmittance.png"))
    );
    for (column, words) in
        [("lenght", "is not a column"), ("transmittance:rim", "no light `rim`"), ("clump:x", "not a level")]
    {
        let out = shot.pelage(&["preview", "--show", column]);
        let err = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(2) && err.contains(words), "{err}");
    }
}

#[test]
fn lengths_in_a_heat_map_are_those_of_the_hair() {
    // All hairs as long: one colour, that of the middle of the scale.
    let shot = small_shot(COMMAND, 2);
    shot.succeed(&["preview", "--show", "length", "--range", "0,1000"]);
    let low = shot.read(&format!("{OUT}/preview-length.png"));
    shot.succeed(&["preview", "--show", "length", "--range", "-1000,0"]);
    assert_ne!(low, shot.read(&format!("{OUT}/preview-length.png")));
}

#[test]
fn shortened_hair_lets_more_light_through() {
    let mean = |shorten: &str| {
        let shot = lit_shot(COMMAND, 2);
        shot.edit("grooms/ball.toml", "value = 4.0", "value = 40.0");
        shot.edit(SHOT, "quality = \"draft\"", &format!("quality = \"draft\"\n{shorten}"));
        shot.edit(SHOT, "\"usd\", ", "");
        shot.report(&["--to", "export"]);
        let mut file = pelage::format::mcap::read_hair_mcap(&shot.path().join(OUT).join("hair.mcap")).expect("a file");
        let t = file.frame(0, 0).expect("a frame").transmittance[1].clone();
        t.iter().sum::<f32>() / t.len() as f32
    };
    let (whole, short) = (mean(""), mean("shorten = 0.9"));
    assert!(short > whole + 0.002, "{whole} {short}");
}
