//! Inputs at the edge of sense: they work, or are refused like any other bad input.

use super::{COMMAND, Corpus, run_bounded};
use pelage::curves;
use pelage_geom::{Mesh, shapes};
use pelage_tests::{ShotFolder, ascii_ply, grey_png, small_shot};

const GROOM: &str = "grooms/ball.toml";

/// Runs a shot that must work, twice, and returns what it exported, layer by layer.
pub(super) fn works(shot: &ShotFolder) -> Vec<curves::CurveSet> {
    let said = run_bounded(shot.path(), &["run"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(!said.err.contains("panicked") && !said.err.contains("NaN"), "{}", said.err);
    let again = run_bounded(shot.path(), &["run"]);
    assert!(again.out.starts_with("nothing to do"), "{}{}", again.out, again.err);
    let read = |name: &str| curves::read(&shot.path().join(name), None).unwrap_or_else(|e| panic!("{e}"));
    let (usd, mcap) = (read("out/ball/hair.usdc").layers, read("out/ball/hair.mcap").layers);
    let hairs = |l: &[curves::CurveSet]| l.iter().map(|l| l.strands.len()).collect::<Vec<_>>();
    assert_eq!(hairs(&usd), hairs(&mcap));
    for layer in &usd {
        assert!(layer.strands.position.iter().flatten().all(|x| x.is_finite()), "{}", layer.name);
    }
    usd
}

fn hairs(layers: &[curves::CurveSet]) -> Vec<usize> {
    layers.iter().map(|l| l.strands.len()).collect()
}

#[test]
fn layers_without_hair() {
    let shot = small_shot(COMMAND, 2);
    shot.write("maps/half.png", grey_png(64, 64, |_, _| 0));
    let all = hairs(&works(&shot));
    assert!(all.len() == 2 && all[0] == 0 && all[1] > 100, "{all:?}");
    shot.edit(GROOM, "density = { value = 1.0 }", "density = { value = 0.0 }");
    assert_eq!(hairs(&works(&shot)), [0, 0]);
}

#[test]
fn hair_without_length_or_width() {
    let shot = small_shot(COMMAND, 2);
    shot.edit(GROOM, "length = { value = 1.0, noise = 0.2 }", "length = { value = 0.0 }");
    shot.edit(GROOM, "width = { value = 40.0, tip = 0.5 }", "width = { value = 0.0 }");
    let layers = works(&shot);
    let strands = &layers[0].strands;
    assert!(strands.len() > 500);
    assert!((0..strands.len()).all(|s| strands.points(s).iter().all(|p| *p == strands.points(s)[0])));
    shot.edit(GROOM, "length = { value = 2.5,", "length = { value = 0.0,");
    works(&shot);
}

#[test]
fn one_frame() {
    let shot = small_shot(COMMAND, 1);
    assert!(hairs(&works(&shot)).iter().all(|n| *n > 100));
    shot.edit("pipeline.toml", "motion = \"grooms/ball.csv\"\n", "");
    works(&shot);
}

/// A shot on another skin.
fn on(mesh: &Mesh) -> ShotFolder {
    let shot = small_shot(COMMAND, 2);
    shot.write("grooms/ball.ply", ascii_ply(mesh));
    shot
}

#[test]
fn a_skin_of_one_triangle() {
    let mesh = Mesh {
        position: vec![[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0]],
        triangle: vec![[0, 1, 2]],
        corner_uv: vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
        face: vec![0],
    };
    assert!(hairs(&works(&on(&mesh))).iter().all(|n| *n > 100));
}

#[test]
fn texture_coordinates_without_area() {
    for uv in [[0.25, 0.25], [0.0, 0.0], [-7.0, 1e6]] {
        let mut mesh = shapes::cube_sphere(8, 5.0);
        mesh.corner_uv.iter_mut().flatten().for_each(|c| *c = uv);
        let shot = on(&mesh);
        let all = hairs(&works(&shot));
        assert!(all[1] > 100, "{all:?}");
        let report: String = String::from_utf8(shot.read("out/ball/report.json")).expect("text");
        assert!(report.contains("without area in (u, v)"), "the report says so");
    }
    let mut line = shapes::cube_sphere(8, 5.0);
    line.corner_uv.iter_mut().flatten().for_each(|c| c[1] = 0.5);
    works(&on(&line));
}

#[test]
fn skins_with_odd_faces() {
    let mut mesh = shapes::cube_sphere(8, 5.0);
    mesh.triangle[10] = [mesh.triangle[10][0]; 3];
    mesh.triangle[11] = mesh.triangle[12];
    mesh.triangle[13].swap(1, 2);
    works(&on(&mesh));
    let mut far = shapes::cube_sphere(8, 5.0);
    far.position.iter_mut().for_each(|p| *p = p.map(|x| x + 1e7));
    works(&on(&far));
    let small = shapes::cube_sphere(8, 1e-6);
    works(&on(&small));
}

#[test]
fn densities_that_no_memory_holds() {
    let mut corpus = Corpus::new();
    let (unit, placement) = ("meters_per_unit = 0.01", "per_cm2 = 0.2");
    corpus.refuse_edit("pipeline.toml", unit, "meters_per_unit = 1e9", "ball.toml, line 2|control hairs|help:");
    corpus.shot.edit("pipeline.toml", unit, "meters_per_unit = 1.0");
    corpus.refuse_edit(GROOM, placement, "per_cm2 = 5000", "ball.toml, line 2|per_cm2|control hairs|help:");
    corpus.shot.edit(GROOM, placement, "grid = [2, 2]");
    let words = "ball.toml, line|layer[0].density.value|2^32|help:";
    corpus.refuse_edit(GROOM, "density = { value = 4.0", "density = { value = 40000.0", words);
    corpus.shot.edit(GROOM, "grid = [2, 2]", placement);
    corpus.shot.edit("pipeline.toml", "meters_per_unit = 1.0", unit);
    corpus.finish();
}

#[test]
fn values_beyond_their_range() {
    let mut corpus = Corpus::new();
    for (from, to, words) in [
        ("meters_per_unit = 0.01", "meters_per_unit = 1e-300", "shot.meters_per_unit|help:"),
        ("meters_per_unit = 0.01", "meters_per_unit = 1e300", "shot.meters_per_unit|help:"),
        ("fps = 24", "fps = 1e-300", "shot.fps|help:"),
        ("fps = 24", "fps = 1e300", "shot.fps|help:"),
        ("motion =", "pivot = [1e300, 0, 0]\nmotion =", "skin.motion|frame 1|skin.pivot"),
    ] {
        corpus.refuse_edit("pipeline.toml", from, to, &format!("pipeline.toml, line|{words}"));
    }
    corpus.refuse_edit(GROOM, "name = \"over\"", "name = \"a\\nb\"", "ball.toml, line|layer[1].name|help:");
    corpus.finish();
}

#[test]
fn values_at_the_end_of_their_range() {
    let points = "[[0.0, 10.0, 0.0], [0.0, -10.0, 0.0]]";
    let parting = |to: &str| format!("[[parting]]\nname = \"p\"\npoints = [[0, 5, 0], {to}]\n\n[[layer]]");
    let (straight, no_length) = ("control hairs combed", "parting p has no length");
    for (file, from, to, says) in [
        ("pipeline.toml", "motion =", "motion_start = 1e300\nmotion =".to_owned(), straight),
        ("pipeline.toml", "sheet = 2", "zoom = 1e300".to_owned(), straight),
        ("pipeline.toml", "sheet = 2", "zoom = 1e-300".to_owned(), straight),
        ("pipeline.toml", "sheet = 2", "from = [1e-300, 0, 0]".to_owned(), straight),
        ("pipeline.toml", "sheet = 2", "from = [0, 1, 0]".to_owned(), straight),
        ("pipeline.toml", "frames = [1, 2]", "frames = [2147483646, 2147483647]".to_owned(), straight),
        ("pipeline.toml", "frames = [1, 2]", "frames = [-2147483648, -2147483647]".to_owned(), straight),
        (GROOM, points, "[[1e300, 0, 0], [-1e300, 0, 0]]".to_owned(), "control hairs"),
        (GROOM, points, "[[0, 0, 0], [0, 0, 0]]".to_owned(), "control hairs"),
        (GROOM, "bend = 0.6", "radius = 0".to_owned(), "control hairs"),
        (GROOM, "[[layer]]", parting("[1e9, 0, 0]"), "control hairs on partings"),
        (GROOM, "[[layer]]", parting("[0, -5, 0]"), "control hairs on partings"),
        (GROOM, "[[layer]]", parting("[0, 5, 0]"), no_length),
        (GROOM, "per_cm2 = 0.2", "per_cm2 = 0".to_owned(), "control hairs on chart borders"),
        (GROOM, "per_cm2 = 0.2", "grid = [1, 1]".to_owned(), straight),
        (GROOM, "per_cm2 = 0.2", "grid = [512, 1]".to_owned(), "control hairs too near to others"),
        (GROOM, "points = 6", "points = 2".to_owned(), straight),
        (GROOM, "points = 6", "points = 6\nclearance = 1000".to_owned(), straight),
        (GROOM, "length = { value = 1.0", "length = { value = 1000000.0".to_owned(), straight),
        (GROOM, "width = { value = 40.0", "width = { value = 1000000.0".to_owned(), straight),
        (GROOM, "name = \"over\"", "name = \"o/v{er}\\\"..\"".to_owned(), straight),
        (GROOM, "name = \"over\"", "name = \"毛\"".to_owned(), straight),
    ] {
        let shot = small_shot(COMMAND, 2);
        shot.edit(file, from, &to);
        let said = run_bounded(shot.path(), &["run"]);
        let case = format!("{file}: `{from}` -> `{to}`");
        assert_eq!(said.code, Some(0), "{case}: {}", said.err);
        assert!(!said.err.contains("panicked"), "{case}: {}", said.err);
        assert!(said.out.contains(says) || said.err.contains(says), "{case} does not say `{says}`: {said:?}");
        let file =
            curves::read(&shot.path().join("out/ball/hair.usdc"), None).unwrap_or_else(|e| panic!("{case}: {e}"));
        assert_eq!(hairs(&file.layers), [862, 312], "{case}");
    }
}

#[test]
fn caches_that_are_broken() {
    let corpus = Corpus::new();
    let entries = corpus.shot.path().join(".pelage-cache/v1/entries");
    let files = super::content(&entries);
    assert!(files.len() > 10);
    for (k, (path, good)) in files.iter().enumerate() {
        let broken = match k % 4 {
            0 => Vec::new(),
            1 => good[..good.len() / 2].to_vec(),
            2 => super::noise(300),
            _ => good.iter().rev().copied().collect(),
        };
        std::fs::write(path, broken).expect("a file of ours");
    }
    for name in ["hashes.json", "v1/last/ball.json"] {
        corpus.shot.write(&format!(".pelage-cache/{name}"), super::noise(500));
    }
    let said = run_bounded(corpus.shot.path(), &["run"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(!said.err.contains("panicked") && said.err.contains("warning:"), "{}", said.err);
    let without_report = |mut c: std::collections::BTreeMap<String, Vec<u8>>| {
        c.retain(|path, _| !path.ends_with("report.json"));
        c
    };
    let after = without_report(super::content(&corpus.shot.path().join("out")));
    assert!(after == without_report(corpus.before.clone()), "the same bytes as before the damage");
    corpus.shot.succeed(&["cache", "verify"]);
    corpus.finish();
}

#[test]
fn folders_that_are_none() {
    let mut corpus = Corpus::new();
    corpus.shot.write("a-file", "nothing");
    let cache = "[cache]\ndir = \"a-file\"\n\n[preview]";
    corpus.refuse_edit("pipeline.toml", "[preview]", cache, "pipeline.toml, line|cache.dir|a-file|help:");
    let out = "[export]\ndir = \"a-file\"";
    corpus.refuse_edit("pipeline.toml", "[export]", out, "pipeline.toml, line|export.dir|a-file|help:");
    corpus.finish();
}
