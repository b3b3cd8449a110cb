//! Shadows end to end: what files hold of the light.

use pelage::format::mcap::{McapFrame, read_hair_mcap};
use pelage::format::ply::read_tables;
use pelage_tests::{ShotFolder, lit_shot};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const SHOT: &str = "pipeline.toml";

/// Every layer at every frame.
fn frames(shot: &ShotFolder) -> Vec<Vec<McapFrame>> {
    let mut file = read_hair_mcap(&shot.path().join("out/ball/hair.mcap")).expect("an exported file");
    assert_eq!(file.facts().lights, ["key", "rim-2"]);
    let (count, layers) = (file.facts().frames.len(), file.layer_names().count());
    (0..count).map(|f| (0..layers).map(|l| file.frame(f, l).expect("a frame")).collect()).collect()
}

#[test]
fn files_hold_what_arrives_of_every_light() {
    let shot = lit_shot(COMMAND, 3);
    shot.edit(SHOT, "\"usd\", \"mcap\"", "\"usd\", \"mcap\", \"ply\"");
    shot.report(&[]);
    let frames = frames(&shot);
    for (k, layers) in frames.iter().enumerate() {
        let tables = read_tables(&shot.path().join(format!("out/ball/hair.{:04}.ply", k + 1))).expect("a PLY");
        let vertex = tables.tables.iter().find(|t| t.name == "vertex").expect("vertices");
        for (c, name) in ["transmittance", "transmittance_key", "transmittance_rim_2"].into_iter().enumerate() {
            let all: Vec<f32> = layers.iter().flat_map(|l| l.transmittance[c].iter().copied()).collect();
            assert_eq!(vertex.f32(name).expect("a column"), all, "{name}");
        }
        for layer in layers {
            let [all, key, rim] = &layer.transmittance[..] else { panic!("three columns") };
            // The spot is off at the first frame, and weighs three times as much as the other.
            for ((all, key), rim) in all.iter().zip(key).zip(rim) {
                let expected = if k == 0 { *key } else { (key + 3.0 * rim) / 4.0 };
                assert!((all - expected).abs() < 1e-6 && (k > 0 || *rim == 1.0));
            }
            // The ball turns by 0.05 a frame around y and hides half of its hair from either light.
            for (i, p) in layer.position.iter().enumerate() {
                let r = p.iter().map(|x| x * x).sum::<f32>().sqrt();
                let toward = (p[1] - 0.25 * p[0]) / 1.0308;
                if toward < -0.9 * r {
                    assert_eq!(key[i], 0.0, "below the ball: {p:?}");
                }
                if toward > 0.9 * r {
                    assert!(key[i] > 0.2, "on top of the ball: {p:?}");
                }
            }
            let lit = |column: &[f32]| column.iter().filter(|t| **t > 0.0).count() as f64 / column.len() as f64;
            assert!((0.3..0.75).contains(&lit(key)), "{}", lit(key));
            assert!(key.iter().any(|t| *t > 0.0 && *t < 0.99), "hair shadows hair");
        }
    }
}

#[test]
fn shadows_are_the_same_bytes_for_any_number_of_threads() {
    let run = |jobs: &str| {
        let shot = lit_shot(COMMAND, 3);
        shot.report(&["--jobs", jobs]);
        shot.outputs()
    };
    assert!(run("1") == run("2"));
}

#[test]
fn exact_shadows_are_near_those_of_maps() {
    let mean = |quality: &str| {
        let shot = lit_shot(COMMAND, 2);
        shot.edit("grooms/ball.toml", "value = 4.0", "value = 1.0");
        shot.edit(SHOT, "\"draft\"", quality);
        shot.edit(SHOT, "\"usd\", ", "");
        shot.report(&["--to", "export"]);
        let frames = frames(&shot);
        let values: Vec<f64> =
            frames.iter().flatten().flat_map(|l| l.transmittance[1].iter().map(|t| f64::from(*t))).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let (maps, rays) = (mean("\"fine\""), mean("\"reference\""));
    assert!((maps - rays).abs() < 0.01, "{maps} {rays}");
}

#[test]
fn solids_beside_the_skin_cast_shadow() {
    let shot = lit_shot(COMMAND, 2);
    shot.edit(SHOT, "target = \"off\"", "target = \"off\"\n[[simulate.body.mesh]]\nfile = \"grooms/lid.ply\"");
    // A wide plate above the ball.
    let plate = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                 -90 12 -90\n-90 12 90\n90 12 90\n90 12 -90\n4 0 1 2 3\n";
    shot.write("grooms/lid.ply", plate);
    shot.report(&["--to", "export"]);
    let frames = frames(&shot);
    assert!(frames.iter().flatten().all(|l| l.transmittance[1].iter().all(|t| *t == 0.0)));
}

#[test]
fn shadows_in_the_cache_can_be_inspected() {
    let shot = lit_shot(COMMAND, 2);
    shot.report(&[]);
    let mut kinds = Vec::new();
    for name in shot.entries().into_keys().filter(|n| n.ends_with("shadow.mcap")) {
        let path = format!(".pelage-cache/v1/entries/{name}");
        let found: serde_json::Value =
            serde_json::from_str(&shot.succeed(&["inspect", &path, "--json"])).expect("JSON");
        let mean = found["mean"].as_f64().expect("a mean");
        assert!(mean > 0.1 && mean < 0.9 && found["layers"] == 2, "{found}");
        kinds.push(found["kind"].as_str().expect("a kind").to_owned());
    }
    assert_eq!(kinds, ["transmittance of a light"; 3]);
}
