//! The command over a shot of a million hairs: `cargo bench -p pelage --bench pipeline`. Prints seconds, rates and peak
//! memory of each step, every one a process of its own.

use pelage::format::{image::png_bytes, ply::mesh_bytes};
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// 10,000 square centimetres of skin: 100 hairs per square centimetre are a million.
const RADIUS: f64 = 28.209_479;

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let dir = folder.path();
    make_shot(dir);
    let groom = dir.join("groom.toml");
    let edit = |from: &str, to: &str| {
        let text = std::fs::read_to_string(&groom).expect("the groom file");
        assert!(text.contains(from), "no `{from}`");
        std::fs::write(&groom, text.replacen(from, to, 1)).expect("the groom file");
    };
    say("first run to instance", &run(dir, &["--to", "instance"]), "instance");
    // Every column runs again, the candidates are in the cache.
    edit("value = 100.0", "value = 99.9");
    say("instance again, candidates cached", &run(dir, &["--to", "instance"]), "instance");
    say("interpolate 2 frames", &run(dir, &["--to", "interpolate"]), "interpolate");
    say("export USD and MCAP", &run(dir, &["--to", "export"]), "export");
    plain_write(dir);
    let start = Instant::now();
    run(dir, &["--to", "export"]);
    println!("{:<36} {:>8.3} s", "nothing to do", start.elapsed().as_secs_f64());
}

fn make_shot(dir: &Path) {
    let write = |name: &str, bytes: &[u8]| std::fs::write(dir.join(name), bytes).expect("a file");
    write("skin.ply", &mesh_bytes(&pelage_geom::shapes::cube_sphere(64, RADIUS)));
    let wave = |k: usize, c: usize| {
        let texel = |i: usize| (200 + (i / c % 1024 * k / 64 + i / c / 1024 * k / 32) % 56) as u8;
        png_bytes(1024, 1024, c, &(0..1024 * 1024 * c).map(texel).collect::<Vec<u8>>())
    };
    write("density.png", &png_bytes(1024, 1024, 1, &[255; 1024 * 1024]));
    for (k, name) in ["length", "width", "opacity"].iter().enumerate() {
        write(&format!("{name}.png"), &wave(k + 1, 1));
    }
    write("color.png", &wave(5, 3));
    write(
        "turn.csv",
        b"time_s,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0.1,0,0,0,0.7071067811865476,0,0.7071067811865476\n",
    );
    write(
        "pipeline.toml",
        br#"[shot]
name = "million"
frames = [1, 2]
fps = 24
meters_per_unit = 0.01
[skin]
rest = "skin.ply"
motion = "turn.csv"
[groom]
file = "groom.toml"
[export]
formats = ["usd", "mcap"]
"#,
    );
    write(
        "groom.toml",
        br#"[control]
placement = { per_cm2 = 0.15 }
points = 12
[[comb]]
kind = "lay-down"
amount = 0.5
[[layer]]
name = "coat"
density = { value = 100.0, map = "density.png" }
length = { value = 2.0, map = "length.png", noise = 0.1 }
width = { value = 60.0, map = "width.png" }
opacity = { value = 1.0, map = "opacity.png" }
color = { value = [1.0, 1.0, 1.0], map = "color.png" }
"#,
    );
}

/// Runs the command and returns its report.
fn run(dir: &Path, arguments: &[&str]) -> serde_json::Value {
    let command = Command::new(env!("CARGO_BIN_EXE_pelage"))
        .args(["run", "--json", "--quiet"])
        .args(arguments)
        .current_dir(dir)
        .output();
    let out = command.expect("the command starts");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("a report")
}

fn say(what: &str, report: &serde_json::Value, stage: &str) {
    let stages = report["stages"].as_array().expect("stages");
    let s = stages.iter().find(|s| s["name"] == stage).expect("the stage");
    let (wall, peak) = (s["wall_s"].as_f64().unwrap_or(0.0), s["peak_bytes"].as_f64().unwrap_or(0.0));
    println!("{what:<36} {wall:>8.3} s   peak {:>6.0} MB   {}", peak / 1e6, s["counts"]);
}

/// The disk's own rate: the bytes of the exported files, written and synchronised.
fn plain_write(dir: &Path) {
    let out = dir.join("out/million");
    for name in ["hair.usdc", "hair.mcap"] {
        let bytes = std::fs::read(out.join(name)).expect("the exported file");
        let start = Instant::now();
        let mut file = std::fs::File::create(dir.join("plain")).expect("a file");
        file.write_all(&bytes).expect("room on the disk");
        file.sync_all().expect("the disk");
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{:<36} {seconds:>8.3} s   {:>6.0} MB/s",
            format!("plain write of {name}"),
            bytes.len() as f64 / 1e6 / seconds
        );
    }
}
