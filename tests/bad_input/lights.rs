//! Broken lights, and lights at the edge of sense.

use super::edges::works;
use super::{COMMAND, Corpus};
use pelage_tests::{ShotFolder, lit_shot};

const SHOT: &str = "pipeline.toml";
const KEY: &str = "kind = \"directional\"\ndirection = [0.25, -1.0, 0.0]";

fn shot() -> ShotFolder {
    lit_shot(COMMAND, 2)
}

#[test]
fn lights() {
    let mut corpus = Corpus::of(shot());
    for (light, words) in [
        ("kind = \"directional\"", "light[0]|needs `direction`|help:"),
        ("kind = \"point\"", "light[0]|needs `position`|help:"),
        ("kind = \"spot\"\nposition = [0, 9, 0]", "light[0]|needs `direction`|help:"),
        ("kind = \"point\"\nposition = [0, 9, 0]\ndirection = [0, 1, 0]", ".direction|not read for this kind|help:"),
        ("kind = \"point\"\nposition = [0, 9, 0]\ncone = 10", ".cone|not read for this kind|help:"),
        ("kind = \"sun\"", "unknown variant `sun`"),
        ("kind = \"directional\"\ndirection = [0, 0, 0]", ".direction|must be a direction|help:"),
        ("kind = \"directional\"\ndirection = [0, nan, 0]", ".direction|must be a direction|help:"),
        ("kind = \"directional\"\ndirection = [0, 1]", "line|array of 3"),
        ("kind = \"point\"\nposition = [inf, 0, 0]", ".position|finite|help:"),
        (
            "kind = \"point\"\nposition = [{ frame = 2, value = [0, 9, 0] }, { frame = 1, value = [0, 9, 0] }]",
            ".position|not in order|help:",
        ),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\nintensity = -1", ".intensity|-1 is out of range|help:"),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\nintensity = nan", ".intensity|NaN is out of range"),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\ncolor = [1, 1, -1]", ".color|-1 is out of range"),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\nframes = [3, 2]", ".frames|before the first"),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\nfalloff = 2", "unknown field `falloff`"),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\nwrap = 91", ".wrap|91 is out of range"),
        (
            "kind = \"spot\"\nposition = [0, 9, 0]\ndirection = [0, -1, 0]\ncone = 0",
            ".cone|0 is out of range|from 0.01 to 90",
        ),
        ("kind = \"spot\"\nposition = [0, 9, 0]\ndirection = [0, -1, 0]\nsoftness = 2", ".softness|2 is out of range"),
    ] {
        corpus.refuse_edit(SHOT, KEY, light, &format!("pipeline.toml, line|{words}"));
    }
    for (from, to, words) in [
        ("\"rim-2\"", "\"\"", "light[1].name|name of a column|help:"),
        ("\"rim-2\"", "\"rim 2\"", "light[1].name|name of a column|help:"),
        ("\"rim-2\"", "\"KEY\"", "light[1].name|used twice|help:"),
        ("\"draft\"", "\"best\"", "unknown variant `best`"),
        ("\"draft\"", "\"draft\"\nerror = 0.1", "shadow.error|beside `quality`|help:"),
        ("quality = \"draft\"", "error = 0", "shadow.error|0 is out of range|help:"),
        ("quality = \"draft\"", "shorten = 1", "shadow.shorten|1 is out of range|help:"),
    ] {
        corpus.refuse_edit(SHOT, from, to, &format!("pipeline.toml, line|{words}"));
    }
    corpus.finish();
}

#[test]
fn a_direction_that_vanishes_between_keys() {
    let mut corpus = Corpus::of(shot());
    let keys = "kind = \"directional\"\n\
                direction = [{ frame = 0, value = [0, -1, 0] }, { frame = 4, value = [0, 1, 0] }]";
    corpus.refuse_edit(SHOT, KEY, keys, "pipeline.toml, line|light[0]|at frame 2|direction|help:");
    corpus.finish();
}

#[test]
fn lights_at_the_edge_of_sense() {
    for light in [
        "kind = \"point\"\nposition = [0, 0, 0]",
        "kind = \"point\"\nposition = [0, 5, 0]",
        "kind = \"point\"\nposition = [1e18, 0, 0]",
        "kind = \"directional\"\ndirection = [1e-300, 0, 0]",
        "kind = \"directional\"\ndirection = [1e18, 0, 0]",
        "kind = \"spot\"\nposition = [0, 5.5, 0]\ndirection = [0, 1, 0]\ncone = 90\nsoftness = 1",
        "kind = \"spot\"\nposition = [0, 99, 0]\ndirection = [0, 1, 0]\ncone = 0.01",
        "kind = \"directional\"\ndirection = [0, -1, 0]\nintensity = 0",
    ] {
        let shot = shot();
        shot.edit(SHOT, KEY, light);
        works(&shot);
    }
    let thin = shot();
    thin.edit("grooms/ball.toml", "value = 40.0, tip = 0.5", "value = 0.0");
    works(&thin);
    let bald = shot();
    bald.edit("grooms/ball.toml", "value = 4.0", "value = 0.0");
    works(&bald);
}
