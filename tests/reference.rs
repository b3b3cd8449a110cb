//! `docs/reference.md` and `docs/schema/` say what the configuration structs say.
//! `PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests reference` rewrites them.

use pelage::config::{GroomFile, ShotFile, groom_schema, schema};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// Where a key's table is described: follows references, optional values and lists.
fn target<'a>(root: &'a Value, mut v: &'a Value) -> &'a Value {
    loop {
        if let Some(name) = v["$ref"].as_str() {
            v = &root["$defs"][name.rsplit('/').next().expect("a name")];
        } else if let Some(options) = v["anyOf"].as_array() {
            v = options.iter().find(|o| o["type"] != "null").expect("a value besides null");
        } else if v["type"] == "array" && v["items"].is_object() && v["maxItems"].is_null() {
            v = &v["items"];
        } else {
            return v;
        }
    }
}

fn is_list(root: &Value, v: &Value) -> bool {
    let v = if v["$ref"].is_string() { target(root, v) } else { v };
    v["type"] == "array" && v["maxItems"].is_null()
}

/// The kind of value in a word or two.
fn kind(root: &Value, v: &Value) -> String {
    if let Some(options) = v["anyOf"].as_array() {
        let all: Vec<String> = options.iter().filter(|o| o["type"] != "null").map(|o| kind(root, o)).collect();
        return all.join(" or ");
    }
    if let Some(name) = v["$ref"].as_str() {
        return kind(root, &root["$defs"][name.rsplit('/').next().expect("a name")]);
    }
    if let Some(choices) = v["oneOf"].as_array().or(v["enum"].as_array()) {
        let name = |c: &Value| c["const"].as_str().or(c.as_str()).map(|s| format!("`\"{s}\"`"));
        return choices.iter().filter_map(name).collect::<Vec<_>>().join(" or ");
    }
    let types: Vec<&str> = match &v["type"] {
        Value::Array(all) => all.iter().filter_map(Value::as_str).filter(|t| *t != "null").collect(),
        one => one.as_str().into_iter().collect(),
    };
    match types.first().copied() {
        Some("array") => match v["maxItems"].as_u64() {
            Some(n) if v["items"]["type"] == "array" => format!("{n} times {}", kind(root, &v["items"])),
            Some(n) => format!("{n} {}s", kind(root, &v["items"])),
            None => format!("list of {}", kind(root, &v["items"])),
        },
        Some("object") => "table".to_owned(),
        Some("integer") => "whole number".to_owned(),
        Some("string") => "text".to_owned(),
        Some("boolean") => "true or false".to_owned(),
        Some(other) => other.to_owned(),
        None => "value".to_owned(),
    }
}

/// One section per table, depth first; a table in itself is not said again. `above`: the tables that this one stands in.
fn section<'a>(root: &'a Value, v: &'a Value, name: &str, above: &[&'a Value], out: &mut String) {
    let Some(properties) = v["properties"].as_object() else { return };
    let required: Vec<&str> = v["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    if !name.is_empty() {
        writeln!(out, "\n### `{name}`\n\n{}\n", v["description"].as_str().unwrap_or("")).expect("text");
        writeln!(out, "| key | value | |\n|---|---|---|").expect("text");
        for (key, p) in properties {
            let meaning = p["description"].as_str().unwrap_or("").replace('\n', " ");
            let needed = if required.contains(&key.as_str()) { " **Required.**" } else { "" };
            writeln!(out, "| `{key}` | {} | {meaning}{needed} |", kind(root, p)).expect("text");
        }
    }
    for (key, p) in properties {
        let table = target(root, p);
        let inside = [above, &[v]].concat();
        if table["properties"].is_object() && !inside.iter().any(|t| std::ptr::eq(*t, table)) {
            let inner = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
            let brackets = if is_list(root, p) { "[]" } else { "" };
            section(root, table, &format!("{inner}{brackets}"), &inside, out);
        }
    }
}

fn reference() -> String {
    let mut out = String::from(
        "# Reference\nEvery key of the two files that a person writes. Unknown keys are refused. Paths are relative to the \
         file that\nnames them. `[]` marks lists of tables, written `[[layer]]`. What the values do: `docs/stages.md`;\nthe look in pictures: `docs/look.md`.\n",
    );
    for (title, text) in
        [("`pipeline.toml`: a shot", schema::<ShotFile>()), ("`grooms/*.toml`: a groom", schema::<GroomFile>())]
    {
        let root: Value = serde_json::from_str(&text).expect("a schema is JSON");
        writeln!(out, "\n## {title}\n\n{}", root["description"].as_str().unwrap_or("")).expect("text");
        section(&root, &root, "", &[], &mut out);
    }
    out
}

#[test]
fn the_reference_says_what_the_structs_say() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let files = [
        ("reference.md", reference()),
        ("schema/shot.json", schema::<ShotFile>()),
        ("schema/groom.json", groom_schema()),
    ];
    for (name, text) in files {
        let path = docs.join(name);
        if std::env::var_os("PELAGE_UPDATE_GOLDEN").is_some() {
            std::fs::create_dir_all(path.parent().expect("inside docs")).expect("a folder");
            std::fs::write(&path, &text).expect("a file");
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == text,
            "docs/{name} is out of date: PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests reference"
        );
    }
}
