//! `docs/look.md` shows every parameter of the look: the text of its second half is made from the configuration structs
//! and the list of pictures. `PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests look_page` rewrites it; the pictures are made
//! by `cargo run --release -p pelage-tests --example parameter_pictures`.

use pelage::config::{Document, GroomFile, ShotFile, schema};
use pelage::format::mcap::read_hair_mcap;
use pelage_tests::ShotFolder;
use pelage_tests::parameters::{Shown, WITHOUT, parameters};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Tables of the page: title, name in the list of pictures, name in the schema.
const SECTIONS: [(&str, &str, &str); 19] = [
    ("`[[layer.clump]]`", "clump", "Clump"),
    ("`layer.clump.dilation`", "dilation", "Dilation"),
    ("`layer.clump.wet`", "wet", "Wet"),
    ("`[layer.curl]`", "curl", "Curl"),
    ("`layer.curl.x`, `layer.curl.y`", "custom", "CurlWave"),
    ("`[[layer.wave]]`", "wave", "Wave"),
    ("`layer.wave.x`, `layer.wave.y`", "axis", "WaveAxis"),
    ("`[[layer.noise]]`", "noise", "Noise"),
    ("`[layer.wind]`", "wind", "WindLook"),
    ("`[layer.collision]`", "collision", "Collision"),
    ("`[[emitter]]`", "emitter", "Emitter"),
    ("A value of the look", "value", "VariedValue"),
    ("`vary` of a value", "vary", "VaryScale"),
    ("`[[layer]]`", "layer", "Layer"),
    ("`density`, `length`, `opacity` of a layer", "feature", "Feature"),
    ("`layer.width`", "width", "WidthFeature"),
    ("`layer.color`", "color", "ColorFeature"),
    ("`layer.guard`", "guard", "Guard"),
    ("`[[comb]]`", "comb", "Comb"),
];

/// Tables of a groom file that are not shown: where hair stands, what it is made of, where a map is, and what styles are made of.
const ELSEWHERE: [&str; 17] = [
    "Scalp",
    "Cluster",
    "JointTurn",
    "Control",
    "Placement",
    "Parting",
    "Material",
    "MapRef",
    "Key",
    "Primitive",
    "Falloff",
    "Region",
    "Element",
    "Panels",
    "Shear",
    "Plane",
    "Ball",
];

/// Where the part of the page begins that is made here.
const BEGINS: &str = "## Every parameter\n";

pub(super) fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

fn groom_schema() -> Value {
    serde_json::from_str(&schema::<GroomFile>()).expect("a schema is JSON")
}

fn keys<'a>(root: &'a Value, table: &str) -> impl Iterator<Item = (&'a String, &'a str)> {
    let properties = root["$defs"][table]["properties"].as_object().unwrap_or_else(|| panic!("no table {table}"));
    properties.iter().map(|(key, p)| (key, p["description"].as_str().unwrap_or("")))
}

/// Settings as they stand in a file, on one line.
pub(super) fn code(text: &str) -> String {
    let lines = text.lines().filter(|l| !l.is_empty()).map(|l| format!("`{l}`"));
    let all = lines.collect::<Vec<_>>().join(" ");
    if all.is_empty() { "not given".to_owned() } else { all }
}

fn pictured(shown: &Shown, key: &str, meaning: &str) -> String {
    let captions = shown.settings.map(code).join(" · ");
    let beside = if shown.with.is_empty() { String::new() } else { format!("<br>beside {}", code(shown.with)) };
    format!(
        "\n**`{key}`**: {}\n\n![{}](pictures/look/{})<br>{captions}{beside}\n",
        meaning.replace('\n', " "),
        shown.key,
        shown.file()
    )
}

fn pictures() -> String {
    let root = groom_schema();
    let mut out = format!(
        "{BEGINS}Low, usual, high, from left to right: fur of 1.7 cm on a patch of 4.4 by 3 cm, strands of 3.1 cm that hang \
         from a bar.\nThe settings stand below the pictures, and what else the table says (what acts always has a value).\n"
    );
    for (title, name, table) in SECTIONS {
        let about = root["$defs"][table]["description"].as_str().unwrap_or("").replace('\n', " ");
        writeln!(out, "\n### {title}\n{about}").expect("text");
        let mut without = String::new();
        for (key, meaning) in keys(&root, table) {
            let full = format!("{name}.{key}");
            if let Some(shown) = parameters().find(|s| s.key == full) {
                out += &pictured(shown, key, meaning);
            } else if let Some((_, why)) = WITHOUT.iter().find(|w| w.0 == full) {
                let meaning = meaning.replace('\n', " ");
                writeln!(without, "- **`{key}`**: {meaning} ({why})").expect("text");
            }
        }
        if !without.is_empty() {
            write!(out, "\nWithout a picture:\n\n{without}").expect("text");
        }
    }
    out
}

#[test]
fn every_key_of_the_look_has_a_picture_or_a_reason() {
    let root = groom_schema();
    let listed: Vec<&str> = parameters().map(|s| s.key).chain(WITHOUT.iter().map(|w| w.0)).collect();
    let known: BTreeSet<String> =
        SECTIONS.iter().flat_map(|(_, name, t)| keys(&root, t).map(move |(key, _)| format!("{name}.{key}"))).collect();
    let absent: Vec<&String> = known.iter().filter(|k| !listed.contains(&k.as_str())).collect();
    assert!(absent.is_empty(), "neither shown nor in WITHOUT: {absent:?}");
    for (i, key) in listed.iter().enumerate() {
        assert!(known.contains(*key), "{key} is not a key of the schema");
        assert!(!listed[..i].contains(key), "{key} is listed twice");
    }
    assert!(WITHOUT.iter().all(|w| !w.1.is_empty()), "a reason is given");
    let tables = root["$defs"].as_object().expect("tables").iter().filter(|(_, d)| d["properties"].is_object());
    for (name, _) in tables {
        let shown = SECTIONS.iter().any(|s| s.2 == name) || ELSEWHERE.iter().any(|e| name.starts_with(e));
        assert!(shown, "the page has no section for the table {name}");
    }
}

#[test]
fn every_setting_is_a_groom() {
    for shown in parameters() {
        for setting in shown.settings {
            let text = shown.groom(setting);
            let groom = Document::<GroomFile>::parse(Path::new(shown.key), text.clone())
                .and_then(|g| g.check().map(|()| g))
                .unwrap_or_else(|e| panic!("{} with `{setting}`: {e}\n{text}", shown.key));
            assert_eq!(groom.value.layer.len(), 1);
        }
        let [low, usual, high] = shown.settings;
        assert!(low != high && !(low == usual && usual == high), "{}: three settings that show nothing", shown.key);
    }
}

#[test]
fn the_page_shows_every_picture() {
    let path = docs().join("look.md");
    let found = std::fs::read_to_string(&path).expect("docs/look.md");
    let by_hand = found.split(BEGINS).next().expect("a beginning");
    let text = format!("{by_hand}{}", pictures());
    if std::env::var_os("PELAGE_UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &text).expect("a file");
    } else {
        assert!(
            found == text,
            "docs/look.md is out of date: PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests look_page"
        );
    }
    let folder = docs().join("pictures/look");
    let files = std::fs::read_dir(&folder).expect("pictures").map(|f| f.expect("a file").file_name());
    let files: BTreeSet<String> = files.map(|f| f.to_string_lossy().into_owned()).collect();
    let wanted: BTreeSet<String> = parameters().map(Shown::file).collect();
    assert_eq!(files, wanted, "run the example parameter_pictures");
    for name in &wanted {
        assert!(text.contains(&format!("(pictures/look/{name})")), "docs/look.md does not show {name}");
    }
}

#[test]
fn examples_of_the_page_are_valid() {
    let text = std::fs::read_to_string(docs().join("look.md")).expect("docs/look.md");
    let blocks: Vec<&str> = text.split("```toml\n").skip(1).filter_map(|b| b.split("```").next()).collect();
    assert!(blocks.len() >= 3, "{} examples", blocks.len());
    let layer = "[control]\nplacement = { per_cm2 = 1.0 }\n[[layer]]\nname = \"scalp\"\ndensity = { value = 1.0 }\n\
                 length = { value = 1.0 }\n";
    let shot = "[shot]\nname = \"a\"\nframes = [1, 2]\nfps = 24\nmeters_per_unit = 0.01\n[skin]\nrest = \"a.ply\"\n[groom]\nfile = \"a\"\n";
    for block in blocks {
        let path = Path::new("docs/look.md");
        let checked = if block.contains("[look]") {
            Document::<ShotFile>::parse(path, format!("{shot}{block}")).and_then(|d| d.check())
        } else {
            let before = if block.contains("[control]") { "" } else { layer };
            Document::<GroomFile>::parse(path, format!("{before}{block}")).and_then(|d| d.check())
        };
        checked.unwrap_or_else(|e| panic!("{e}\n{block}"));
    }
    let groom = Document::<GroomFile>::read(&docs().join("look-bust.toml")).and_then(|d| d.check());
    groom.unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn hairs_come_to_a_line_drawn_by_hand() {
    let shown = parameters().find(|s| s.key == "clump.curves").expect("a line drawn by hand");
    let shot = ShotFolder::new(env!("CARGO_BIN_EXE_pelage-under-test"));
    // All of the way, along a line that leaves the hair that carries it.
    shown.files(shown.settings[1]).iter().for_each(|(name, bytes)| shot.write(name, bytes));
    shot.edit("pipeline.toml", "formats = []", "formats = [\"mcap\"]");
    shot.succeed(&["run", "--quiet"]);
    let mut read = read_hair_mcap(&shot.path().join("out/shown/hair.mcap")).expect("an exported file");
    let (layer, frame) = (read.layer(0).expect("a layer"), read.frame(0, 0).expect("a frame"));
    let tips = (0..layer.id.len()).map(|h| frame.position[layer.offsets.range(h).end - 1]);
    let there = |p: [f32; 3]| [1.2, 1.5, 0.5].iter().zip(p).all(|(a, b)| (a - b).abs() < 1e-4);
    let found = tips.filter(|p| there(*p)).count();
    assert!(found > 50, "{found} of {} hairs end where the line does", layer.id.len());
}
