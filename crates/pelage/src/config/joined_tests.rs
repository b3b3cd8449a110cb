//! Files of several.

use super::super::GroomFile;
use super::super::document::Document;

type Groom = Document<GroomFile>;

const BASE: &str = "[control]\nplacement = { per_cm2 = 1.0 }\n[[comb]]\nkind = \"lay-down\"\namount = 0.5\n\
    [[layer]]\nname = \"a\"\ndensity = { value = 1.0, map = \"a.png\" }\nlength = { value = 2.0 }\nwidth = { value = 70.0 }\n";

/// Groom files of a folder; the last is read.
fn read(files: &[(&str, &str)]) -> Result<(Groom, tempfile::TempDir), super::ConfigError> {
    let dir = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    let last = dir.path().join(files.last().expect("a file").0);
    Groom::read_joined(&last).map(|doc| (doc, dir))
}

#[test]
fn a_file_lies_on_top_of_what_it_includes() {
    let top = "include = \"base/hair.toml\"\n[[comb]]\nkind = \"bend\"\nangle = 3.0\n\
        [[layer]]\nname = \"b\"\nlike = \"thick\"\ndensity = { value = 3.0, map = \"b.png\" }\n\
        [[layer]]\nname = \"a\"\nlength = { value = 5.0 }\n\
        [style.thick]\nlike = \"long\"\nwidth = { value = 90.0 }\n[style.long]\nlength = { value = 9.0 }\nwidth = { value = 1.0 }\n";
    let (doc, dir) = read(&[("base/hair.toml", BASE), ("top.toml", top)]).expect("sound files");
    let groom = &doc.value;
    assert_eq!(groom.control.placement.per_cm2.as_ref().map(|d| d.at(0.0)), Some(1.0));
    // Operations go on, layers of one name are one.
    assert_eq!(groom.comb.len(), 2);
    assert_eq!(groom.comb[1].angle.as_ref().map(|v| v.at(0.0)), Some(3.0));
    let layers: Vec<_> = groom.layer.iter().map(|l| (l.name.as_str(), l.length.value, l.width.value)).collect();
    assert_eq!(layers, [("a", 5.0, 70.0), ("b", 9.0, 90.0)]);
    // Paths are relative to the file that names them.
    let maps = [0, 1].map(|i| doc.resolve(groom.layer[i].density.map.as_ref().expect("a map")));
    assert_eq!(maps, [dir.path().join("base/a.png"), dir.path().join("b.png")]);
    assert!(doc.file_of("comb[0].amount").ends_with("base/hair.toml"));
    assert!(doc.file_of("comb[1].angle").ends_with("top.toml"));
    assert!(doc.file_of("layer[0].length.value").ends_with("top.toml"));
}

#[test]
fn key_frames_replace_key_frames() {
    let keys = |value: f64| format!("[{{ frame = 1, value = 0.5 }}, {{ frame = 3, value = {value:?} }}]");
    let base = format!("[style.flat]\nkind = \"lay-down\"\namount = {}\n{BASE}", keys(0.7));
    let top = format!("include = \"b.toml\"\n[[comb]]\nlike = \"flat\"\namount = {}\n", keys(0.9));
    let (doc, _dir) = read(&[("b.toml", &base), ("top.toml", &top)]).expect("sound files");
    let amount = |frame: f64| doc.at(frame).comb[1].amount.as_ref().map(|v| v.at(0.0));
    assert_eq!([0.0, 1.0, 2.0, 3.0, 9.0].map(amount), [0.5, 0.5, 0.5 + (0.9 - 0.5) * 0.5, 0.9, 0.9].map(Some));
    let keyed: Vec<_> = doc.keyed().map(|k| (k.key.as_str(), &k.frame[..])).collect();
    assert_eq!(keyed, [("comb[1].amount", &[1.0, 3.0][..])]);
}

#[test]
fn complaints_name_the_file_and_the_line() {
    let wrong = |files: &[(&str, &str)]| {
        let e = read(files).expect_err("an unsound file");
        let name = e.path.file_name().expect("a file").to_string_lossy().into_owned();
        (name, e.line(), e.what, e.help)
    };
    let (name, line, what, help) =
        wrong(&[("b.toml", &BASE.replace("amount", "amuont")), ("t.toml", "include = [\"b.toml\"]\n")]);
    assert_eq!((name.as_str(), line, help.as_str()), ("b.toml", Some(5), "did you mean `amount`?"), "{what}");
    let (name, line, what, _) = wrong(&[("b.toml", "include = \"t.toml\"\n"), ("t.toml", "\ninclude = \"b.toml\"\n")]);
    assert!(name == "b.toml" && line == Some(1) && what.contains("includes itself"), "{name} {what}");
    let (_, line, what, _) = wrong(&[("t.toml", "\ninclude = \"gone.toml\"\n")]);
    assert!(line == Some(2) && what.contains("gone.toml can't be read"), "{what}");
    let (_, line, what, help) = wrong(&[("t.toml", &BASE.replace("[[layer]]\n", "[[layer]]\nlike = \"blnd\"\n"))]);
    assert!(line == Some(7) && what == "like: there is no style `blnd`", "{what}");
    assert_eq!(help, "did you mean `blond`?");
    let (_, _, what, _) =
        wrong(&[("t.toml", "[control]\nlike = \"a\"\n[style.a]\nlike = \"b\"\n[style.b]\nlike = \"a\"\n")]);
    assert_eq!(what, "like: the style `a` is like itself");
    let doc = read(&[("b.toml", BASE), ("t.toml", "include = \"b.toml\"\n")]).expect("sound files").0;
    let e = doc.error("layer[0].length.value", "is wrong", "");
    assert_eq!((e.path.file_name().expect("a file").to_str(), e.line()), (Some("b.toml"), Some(9)));
}

#[test]
fn presets_are_there() {
    let text = BASE.replace("name = \"a\"\n", "name = \"a\"\nlike = [\"coarse-hair\", \"auburn\"]\n");
    let (doc, _dir) = read(&[("t.toml", &text)]).expect("a sound file");
    let layer = &doc.value.layer[0];
    assert_eq!((layer.material.diameter.at(0.0), layer.width.value, layer.width.tip), (95.0, 70.0, Some(0.5)));
    assert_eq!(layer.color.value[1], 0.055);
    assert!(doc.check().is_ok());
}

#[test]
fn every_preset_is_a_sound_layer() {
    let table: toml::Table = super::PRESETS.parse().expect("TOML");
    for name in table["style"].as_table().expect("styles").keys() {
        let layer = format!("{}\n", BASE.replace("name = \"a\"\n", &format!("name = \"a\"\nlike = \"{name}\"\n")));
        // The width is the preset's own.
        let layer = layer.replace(
            "width = { value = 70.0 }\n",
            if layer_has_width(name) { "" } else { "width = { value = 70.0 }\n" },
        );
        let (doc, _dir) = read(&[("t.toml", &layer)]).unwrap_or_else(|e| panic!("{name}: {e}"));
        doc.check().unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

fn layer_has_width(name: &str) -> bool {
    let table: toml::Table = super::PRESETS.parse().expect("TOML");
    table["style"][name].get("width").is_some()
}
