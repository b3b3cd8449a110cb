//! Golden outputs: what small shots give, as readable text. A change of these files is a change of output.

use pelage::curves::{self, CurveSet};
use pelage::format::image::{Channel, read_map};
use pelage_geom::{Mesh, Topology, shapes};
use pelage_tests::{ShotFolder, ascii_ply, grey_png, look_shot, small_shot};
use std::fmt::Write;
use std::path::Path;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");

/// Runs a shot and compares its outputs with the golden text of that name.
fn check(name: &str, shot: &ShotFolder) {
    let found = describe(shot);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(format!("{name}.txt"));
    if std::env::var_os("PELAGE_UPDATE_GOLDEN").is_some_and(|v| v == "1") {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, &found).expect("a file");
        return;
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert!(
        found == expected,
        "the output of the shot `{name}` is not that of tests/golden/{name}.txt (-: golden, +: now)\n{}\n\
         If the change is meant, say so in CHANGELOG.md and run\n  \
         PELAGE_UPDATE_GOLDEN=1 cargo test -p pelage-tests golden\n",
        difference(&expected, &found)
    );
}

/// Lines that differ, each with the golden one before it.
fn difference(expected: &str, found: &str) -> String {
    let (a, b): (Vec<&str>, Vec<&str>) = (expected.lines().collect(), found.lines().collect());
    let head = a.iter().zip(&b).take_while(|(x, y)| x == y).count();
    let tail = a[head..].iter().rev().zip(b[head..].iter().rev()).take_while(|(x, y)| x == y).count();
    let (old, new) = (&a[head..a.len() - tail], &b[head..b.len() - tail]);
    if old.len() == new.len() {
        let lines = old.iter().zip(new).enumerate().filter(|(_, (x, y))| x != y);
        return lines.map(|(k, (x, y))| format!("line {}\n- {x}\n+ {y}\n", head + k + 1)).collect();
    }
    let gone: String = old.iter().map(|l| format!("- {l}\n")).collect();
    let come: String = new.iter().map(|l| format!("+ {l}\n")).collect();
    format!("line {}\n{gone}{come}", head + 1)
}

fn describe(shot: &ShotFolder) -> String {
    shot.edit("pipeline.toml", "sheet = 2", "sheet = 2\nzoom = 1.5");
    let report = shot.report(&[]);
    let name = report["shot"].as_str().expect("a name").to_owned();
    let mut out = format!("shot {name}\n\ncounts\n");
    for stage in report["stages"].as_array().expect("stages") {
        let stage_name = stage["name"].as_str().expect("a name");
        writeln!(out, "  {stage_name}: {} ran", stage["ran"]).expect("text");
        for (what, n) in stage["counts"].as_object().expect("counts") {
            // Sizes of files depend on how well they compress, which is no result.
            if what != "bytes" {
                writeln!(out, "    {n} {what}").expect("text");
            }
        }
        for warning in stage["warnings"].as_array().expect("warnings") {
            writeln!(out, "    warning: {}", warning.as_str().expect("text")).expect("text");
        }
    }
    let file = shot.path().join("out").join(&name).join("hair.usdc");
    let read = |frame: Option<f64>| curves::read(&file, frame).unwrap_or_else(|e| panic!("{e}"));
    let first = read(None);
    first.layers.iter().for_each(|layer| describe_layer(&mut out, layer));
    out.push_str("\nhashes of positions\n");
    for frame in &first.frames {
        for layer in read(Some(*frame)).layers {
            let bytes = layer.strands.position.iter().flatten().flat_map(|x| x.to_le_bytes());
            writeln!(out, "  frame {frame} {}: {:016x}", layer.name, fnv(bytes)).expect("text");
        }
    }
    out.push_str("\npreview\n");
    out.push_str(&picture(&shot.path().join("out").join(&name).join("preview.png")));
    out
}

fn describe_layer(out: &mut String, layer: &CurveSet) {
    let s = &layer.strands;
    let segment =
        |w: &[[f32; 3]]| (0..3).map(|x| (f64::from(w[1][x]) - f64::from(w[0][x])).powi(2)).sum::<f64>().sqrt();
    let lengths: Vec<f64> = (0..s.len()).map(|i| s.points(i).windows(2).map(segment).sum()).collect();
    let widths: Vec<f64> = layer.width.iter().map(|w| f64::from(*w)).collect();
    writeln!(out, "\nlayer {}: {} hairs, {} points", layer.name, s.len(), s.offsets.total()).expect("text");
    writeln!(out, "  ids {:016x}", fnv(s.id.iter().flat_map(|i| i.to_le_bytes()))).expect("text");
    writeln!(out, "  length {}", spread(&lengths)).expect("text");
    writeln!(out, "  width {}", spread(&widths)).expect("text");
    for (x, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let values: Vec<f64> = s.position.iter().map(|p| f64::from(p[x])).collect();
        writeln!(out, "  {axis} {}", spread(&values)).expect("text");
    }
}

/// Least, mean and greatest value, six digits each.
fn spread(values: &[f64]) -> String {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    format!("{low:.5e} to {high:.5e}, mean {mean:.5e}")
}

/// FNV-1a over bytes.
fn fnv(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// A picture as 40 x 30 characters, dark to bright.
fn picture(path: &Path) -> String {
    const RAMP: &[u8] = b" .:-=+*#%@";
    let map = read_map(path, Channel::Rgb, false).unwrap_or_else(|e| panic!("{e}")).map;
    let mut out = String::new();
    for row in 0..30 {
        out.push_str("  |");
        for column in 0..40 {
            // Row 0 of a map is the bottom one.
            let (y0, y1) = (map.height * (29 - row) / 30, map.height * (30 - row) / 30);
            let (x0, x1) = (map.width * column / 40, map.width * (column + 1) / 40);
            let texels = (y0..y1).flat_map(|y| (x0..x1).map(move |x| 3 * (y * map.width + x)));
            let (sum, n) = texels.fold((0.0, 0), |(s, n), i| {
                let [r, g, b] = [0, 1, 2].map(|k| f64::from(map.data[i + k]));
                (s + 0.2126 * r + 0.7152 * g + 0.0722 * b, n + 1)
            });
            let level = (sum / f64::from(n.max(1)) * 10.0) as usize;
            out.push(char::from(RAMP[level.min(9)]));
        }
        out.push_str("|\n");
    }
    out
}

#[test]
fn two_layers_on_a_moving_ball() {
    check("ball", &small_shot(COMMAND, 3));
}

/// Hairs of four points that lean, one at every vertex of a coarse ball, as PLY.
fn drawn() -> String {
    let mesh = shapes::cube_sphere(3, 5.0);
    let mut points = String::new();
    let mut roots: Vec<[f64; 3]> = Vec::new();
    for p in &mesh.position {
        if !roots.contains(p) {
            roots.push(*p);
        }
    }
    for p in &roots {
        for k in 0..4 {
            let t = f64::from(k);
            let q = [p[0] * (1.0 + 0.08 * t), p[1] * (1.0 + 0.08 * t) - 0.06 * t * t, p[2] * (1.0 + 0.08 * t)];
            writeln!(points, "{} {} {}", q[0], q[1], q[2]).expect("text");
        }
    }
    let ranges: String = (0..roots.len()).map(|h| format!("{} 4\n", 4 * h)).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element hair {}\nproperty int first\nproperty int count\nend_header\n{points}{ranges}",
        4 * roots.len(),
        roots.len()
    )
}

#[test]
fn drawn_hairs_with_a_parting() {
    let shot = small_shot(COMMAND, 2);
    shot.write("grooms/drawn.ply", drawn());
    shot.write(
        "grooms/ball.toml",
        r#"[control]
placement = { curves = "drawn.ply" }
points = 5

[[parting]]
name = "top"
points = [[0.3, 3.0, 4.0], [0.3, 5.0, 0.5], [0.2, 3.5, -3.5]]

[[comb]]
kind = "direction-curve"
parting = "top"
side = "left"
points = [[0.0, 6.0, 0.0], [-5.0, 3.0, 0.0], [-6.0, -3.0, 0.0]]
bend = 0.8

[[comb]]
kind = "direction-curve"
parting = "top"
side = "right"
points = [[0.0, 6.0, 0.0], [5.0, 3.0, 0.0], [6.0, -3.0, 0.0]]
bend = 0.8

[[comb]]
kind = "lay-down"
amount = 0.3

[[layer]]
name = "coat"
density = { value = 5.0 }
on_off = { map = "../maps/half.png" }
length = { value = 2.0, noise = 0.1 }
points = 7
"#,
    );
    shot.edit("pipeline.toml", "name = \"ball\"", "name = \"parted\"");
    check("parted", &shot);
}

/// The ball with its charts on two texture tiles.
fn tiled() -> Mesh {
    let mut mesh = shapes::cube_sphere(8, 5.0);
    let chart = Topology::new(&mesh).chart;
    for (uv, chart) in mesh.corner_uv.iter_mut().zip(chart) {
        uv.iter_mut().for_each(|c| c[0] += (chart % 2) as f32);
    }
    mesh
}

#[test]
fn a_deforming_skin_on_two_tiles() {
    let shot = small_shot(COMMAND, 3);
    let rest = tiled();
    shot.write("grooms/ball.ply", ascii_ply(&rest));
    for frame in 1..=3 {
        let mut mesh = rest.clone();
        let t = 0.04 * f64::from(frame);
        mesh.position.iter_mut().for_each(|p| *p = [p[0] * (1.0 + t), p[1] * (1.0 - t) + t * p[0], p[2] + t * p[1]]);
        shot.write(&format!("anim/ball.{frame:04}.ply"), ascii_ply(&mesh));
    }
    shot.write("maps/half.1001.png", grey_png(32, 32, |x, y| (4 * x + 3 * y) as u8));
    shot.write("maps/half.1002.png", grey_png(16, 16, |_, y| if y < 8 { 255 } else { 40 }));
    shot.edit("grooms/ball.toml", "half.png", "half.<UDIM>.png");
    shot.edit("pipeline.toml", "name = \"ball\"", "name = \"tiled\"");
    shot.edit("pipeline.toml", "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
    check("tiled", &shot);
}

#[test]
fn every_part_of_the_look() {
    let shot = look_shot(COMMAND, 3);
    shot.edit("pipeline.toml", "name = \"ball\"", "name = \"look\"");
    let color = "color = { value = [0.4, 0.2, 0.1]";
    let guard = "guard = { percent = 0.1, length = 1.25 }";
    shot.edit("grooms/ball.toml", color, &format!("{guard}\n{color}, noise = 0.25, ramp = [[1, 1, 1], [2, 2, 3]]"));
    check("look", &shot);
}

#[test]
fn differences_are_shown_line_by_line() {
    assert_eq!(difference("a\nb\nc\nd\n", "a\nx\nc\ny\n"), "line 2\n- b\n+ x\nline 4\n- d\n+ y\n");
    assert_eq!(difference("a\nb\nc\n", "a\nc\n"), "line 2\n- b\n");
}
