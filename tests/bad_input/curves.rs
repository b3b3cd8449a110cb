//! Broken curves for the placement of control hairs.

use super::{COMMAND, Corpus, noise};
use pelage_tests::{ShotFolder, small_shot};

const CURVES: &str = "grooms/drawn.ply";

/// Hairs of three points on the ball's axes, as PLY.
fn drawn() -> String {
    let axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let mut text = String::from("ply\nformat ascii 1.0\nelement vertex 18\n");
    text.push_str("property float x\nproperty float y\nproperty float z\nelement hair 6\n");
    text.push_str("property int first\nproperty int count\nend_header\n");
    for axis in axes {
        for r in [5, 6, 7] {
            let p = axis.map(|a| a * r);
            text.push_str(&format!("{} {} {}\n", p[0], p[1], p[2]));
        }
    }
    (0..6).for_each(|h| text.push_str(&format!("{} 3\n", 3 * h)));
    text
}

/// The same in the `.hair` format.
fn hair() -> Vec<u8> {
    let text = drawn();
    let lines = text.lines().skip(10).take(18);
    let points: Vec<f32> = lines.flat_map(|l| l.split(' ').map(|x| x.parse::<f32>().expect("a number"))).collect();
    let mut file = b"HAIR".to_vec();
    for word in [6u32, 18, 2, 2] {
        file.extend(word.to_le_bytes());
    }
    file.resize(128, 0);
    file.extend(points.iter().flat_map(|x| x.to_le_bytes()));
    file
}

fn shot() -> ShotFolder {
    let shot = small_shot(COMMAND, 2);
    shot.write(CURVES, drawn());
    shot.edit("grooms/ball.toml", "{ per_cm2 = 0.2 }", "{ curves = \"drawn.ply\" }");
    shot
}

#[test]
fn curves_that_are_broken() {
    let mut corpus = Corpus::of(shot());
    let text = drawn();
    for (case, broken, words) in [
        ("empty", String::new(), "empty"),
        ("cut short", text[..text.len() - 60].to_owned(), "vertex|help:"),
        ("not a number", text.replacen("5 0 0", "nan 0 0", 1), "vertex 0"),
        ("text", text.replacen("5 0 0", "five 0 0", 1), "vertex 0"),
        ("beyond the points", text.replacen("15 3", "16 3", 1), "hair 5"),
        ("before the points", text.replacen("15 3", "-1 3", 1), "hair 5"),
        ("a negative count", text.replacen("15 3", "15 -3", 1), "hair 5"),
        ("a huge count", text.replacen("15 3", "15 2000000000", 1), "hair 5"),
        ("shared points", text.replacen("15 3", "0 18", 1), "hair 5"),
        ("huge counts in the header", text.replacen("vertex 18", "vertex 4000000000", 1), "vertex"),
        ("huge counts in the header", text.replacen("hair 6", "hair 4000000000", 1), "hair"),
        ("points only", text.replacen("element hair", "element tail", 1), "help:"),
        ("single points", text.replace(" 3\n", " 1\n"), "curve"),
        ("a mesh", pelage_tests::ascii_ply(&pelage_geom::shapes::cube_sphere(2, 1.0)), "help:"),
    ] {
        corpus.refuse(case, CURVES, broken, &format!("drawn.ply|{words}"));
    }
    corpus.refuse("garbage", CURVES, noise(4000), "drawn.ply|help:");
    for start in [b"PXR-USDC".as_slice(), b"\x89MCAP0\r\n", b"#usda 1.0\n", b"HAIR"] {
        corpus.refuse("a signature only", CURVES, start, "drawn.ply");
        corpus.refuse("garbage with a signature", CURVES, [start, &noise(4000)].concat(), "drawn.ply");
    }
    corpus.refuse_edit("grooms/ball.toml", "drawn.ply", "gone.ply", "ball.toml|control.placement.curves|gone.ply");
    corpus.finish();
}

#[test]
fn hair_files_that_are_broken() {
    let shot = shot();
    shot.write(CURVES, hair());
    let mut corpus = Corpus::of(shot);
    let good = hair();
    for (case, at, word) in [
        ("no hairs", 4, 0u32),
        ("too many hairs", 4, u32::MAX),
        ("too many points", 8, u32::MAX),
        ("no points", 12, 0),
        ("all arrays", 12, u32::MAX),
        ("other segments", 16, 7),
        ("endless segments", 16, u32::MAX),
        ("not a number", 128, f32::NAN.to_bits()),
    ] {
        let mut broken = good.clone();
        broken[at..at + 4].copy_from_slice(&word.to_le_bytes());
        corpus.refuse(case, CURVES, broken, "drawn.ply");
    }
    for bytes in [5, 127, 128, good.len() - 1] {
        corpus.refuse("cut short", CURVES, &good[..bytes], "drawn.ply");
    }
    corpus.finish();
}

#[test]
fn exported_files_cut_short_or_scratched_are_no_curves() {
    let mut corpus = Corpus::of(shot());
    for name in ["out/ball/hair.usdc", "out/ball/hair.mcap"] {
        let good = corpus.shot.read(name);
        for share in [0.05, 0.5, 0.95] {
            let broken = &good[..(share * good.len() as f64) as usize];
            corpus.refuse(&format!("{name} cut to {share}"), CURVES, broken, "drawn.ply");
        }
        // Where the structure is: the head of the one, the tail of the other.
        let mut broken = good.clone();
        let n = good.len();
        broken[n - 200..].copy_from_slice(&noise(200));
        corpus.refuse(&format!("{name} with a scratched tail"), CURVES, &broken, "drawn.ply");
        let mut broken = good.clone();
        broken[16..64].copy_from_slice(&noise(48));
        corpus.refuse(&format!("{name} with a scratched head"), CURVES, &broken, "drawn.ply");
    }
    corpus.finish();
}
