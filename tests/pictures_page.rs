//! `docs/pictures.md` shows the settings of lights and pictures: the text of its second half is made from the configuration
//! structs and the list of pictures. `PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests pictures_page` rewrites it.

use super::look_page::{code, docs};
use pelage::config::{Document, GroomFile, ShotFile, schema};
use pelage_tests::parameters::light::{LIT, Lit};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

/// Tables of the page: title, name in the list of pictures, name in the schema.
const SECTIONS: [(&str, &str, &str); 5] = [
    ("`[[light]]`", "light", "Light"),
    ("`[shadow]`", "shadow", "Shadow"),
    ("`[preview]`", "preview", "Preview"),
    ("`[preview.shade]`", "shade", "Shade"),
    ("`[preview.camera]`", "camera", "CameraSettings"),
];

/// Where the part of the page begins that is made here.
const BEGINS: &str = "## Every setting\n";

fn settings() -> String {
    let root: Value = serde_json::from_str(&schema::<ShotFile>()).expect("a schema is JSON");
    let mut out = format!("{BEGINS}From left to right, with what stands in the shot file below.\n");
    for (title, name, table) in SECTIONS {
        writeln!(out, "\n### {title}").expect("text");
        let properties = root["$defs"][table]["properties"].as_object().expect("a table");
        let mut without = String::new();
        for (key, p) in properties {
            let meaning = p["description"].as_str().unwrap_or("").replace('\n', " ");
            match LIT.iter().find(|l| l.key == format!("{name}.{key}")) {
                Some(lit) => {
                    let captions = lit.settings.map(code).join(" · ");
                    let picture = format!("![{}](pictures/light/{})", lit.key, lit.file());
                    write!(out, "\n**`{key}`**: {meaning}\n\n{picture}<br>{captions}\n").expect("text");
                }
                None => writeln!(without, "- **`{key}`**: {meaning}").expect("text"),
            }
        }
        if !without.is_empty() {
            write!(out, "\nWithout a picture:\n\n{without}").expect("text");
        }
    }
    out
}

#[test]
fn every_setting_is_a_shot() {
    for lit in LIT {
        for setting in lit.settings {
            for (name, bytes) in lit.files(setting).into_iter().take(2) {
                let (path, text) = (Path::new(lit.key), String::from_utf8(bytes).expect("text"));
                let checked = match name.as_str() {
                    "pipeline.toml" => Document::<ShotFile>::parse(path, text.clone()).and_then(|d| d.check()),
                    _ => Document::<GroomFile>::parse(path, text.clone()).and_then(|d| d.check()),
                };
                checked.unwrap_or_else(|e| panic!("{} with `{setting}`: {e}\n{text}", lit.key));
            }
        }
    }
}

#[test]
fn the_page_shows_every_setting() {
    let path = docs().join("pictures.md");
    let found = std::fs::read_to_string(&path).expect("docs/pictures.md");
    let text = format!("{}{}", found.split(BEGINS).next().expect("a beginning"), settings());
    if std::env::var_os("PELAGE_UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &text).expect("a file");
    } else {
        assert!(
            found == text,
            "docs/pictures.md is out of date: PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests pictures_page"
        );
    }
    let names = |folder: &str| -> BTreeSet<String> {
        let files = std::fs::read_dir(docs().join("pictures").join(folder)).expect("pictures");
        files.map(|f| f.expect("a file").file_name().to_string_lossy().into_owned()).collect()
    };
    let wanted: BTreeSet<String> = LIT.iter().map(Lit::file).collect();
    assert_eq!(names("light"), wanted, "run the example parameter_pictures");
    for (folder, name) in wanted.iter().map(|n| ("light", n)).chain(names("gallery").iter().map(|n| ("gallery", n))) {
        assert!(text.contains(&format!("(pictures/{folder}/{name})")), "docs/pictures.md does not show {name}");
    }
}

#[test]
fn the_gallery_is_valid() {
    let mut count = 0;
    for file in std::fs::read_dir(docs().join("gallery")).expect("a gallery") {
        let path = file.expect("a file").path();
        let groom = path.to_string_lossy().ends_with("-groom.toml");
        let checked = match groom {
            true => Document::<GroomFile>::read_joined(&path).and_then(|d| d.check()),
            false => Document::<ShotFile>::read(&path).and_then(|d| d.check()),
        };
        checked.unwrap_or_else(|e| panic!("{e}"));
        count += 1;
    }
    assert!(count > 8, "{count} files");
}
