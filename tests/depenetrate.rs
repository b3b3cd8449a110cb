//! `pelage depenetrate`: any curves out of any skin, with their columns kept.

use pelage::curves;
use pelage::format::ply;
use pelage_geom::{Mesh, shapes};
use pelage_tests::ShotFolder;
use serde_json::Value;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");

/// Two hairs over a ball of 8 cm, with a column of somebody else's: the second one dips into it.
const CURVES: &str = "ply
format ascii 1.0
comment meters_per_unit 0.01
comment somebody was here
element vertex 8
property float x
property float y
property float z
property float width
property float heat
element hair 2
property uint first
property uint count
property uint id_lo
property uint id_hi
property float u
property float v
end_header
0 8 0 0.01 1
0 9 0 0.01 2
0 10 0 0.01 3
0 11 0 0.01 4
0 8 0 0.01 5
1 8.3 0 0.01 6
2 7.5 0 0.01 7
3 8.5 0 0.01 8
0 4 7 0 0.25 0.5
4 4 9 0 0.75 0.5
";

fn folder() -> ShotFolder {
    let shot = ShotFolder::new(COMMAND);
    // Without texture coordinates, and open at the bottom like a bust.
    let ball = shapes::cube_sphere(16, 8.0);
    let above = |t: &&[u32; 3]| t.iter().all(|&v| ball.position[v as usize][1] > -5.0);
    let triangle: Vec<[u32; 3]> = ball.triangle.iter().filter(above).copied().collect();
    let mesh = Mesh { position: ball.position.clone(), triangle, ..Mesh::default() };
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.position.len(),
        mesh.triangle.len()
    );
    mesh.position.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    mesh.triangle.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    shot.write("ball.ply", text);
    shot.write("hair.ply", CURVES);
    shot
}

fn json(shot: &ShotFolder, arguments: &[&str]) -> Value {
    let text = shot.succeed(&[&["depenetrate", "--skin", "ball.ply", "--json"], arguments].concat());
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn curves_leave_the_skin_and_keep_what_they_have() {
    let shot = folder();
    let found = json(&shot, &["hair.ply", "--out", "out.ply"]);
    assert_eq!((&found["hairs"], &found["pushed"], &found["still_inside"]), (&2.into(), &1.into(), &0.into()));
    assert!((1.0..5.0).contains(&found["deepest_before_mm"].as_f64().expect("a number")), "{found}");
    assert_eq!(found["deepest_after_mm"], 0.0);
    let read = |name: &str| ply::read_tables(&shot.path().join(name)).unwrap_or_else(|e| panic!("{e}"));
    let (before, after) = (read("hair.ply"), read("out.ply"));
    assert_eq!(before.comments, after.comments);
    assert_eq!(before.tables[1], after.tables[1]);
    for (a, b) in before.tables[0].columns.iter().zip(&after.tables[0].columns) {
        let (ply::Column::F32(x), ply::Column::F32(y)) = (&a.1, &b.1) else { panic!("{a:?} {b:?}") };
        assert_eq!((&a.0, &x[..5]), (&b.0, &y[..5]));
        assert!(x == y || ["x", "y", "z"].contains(&a.0.as_str()), "{} changed", a.0);
    }
    assert_ne!(before.tables[0], after.tables[0]);
    // Again: nothing to do, and the same file.
    let again = json(&shot, &["out.ply", "--out", "again.ply"]);
    assert_eq!((&again["pushed"], &again["deepest_before_mm"]), (&0.into(), &0.0.into()));
    assert_eq!(shot.read("out.ply"), shot.read("again.ply"));
}

#[test]
fn every_format_holds_the_same() {
    let shot = folder();
    for name in ["out.ply", "out.usdc", "out.mcap"] {
        json(&shot, &["hair.ply", "--out", name]);
    }
    json(&shot, &["out.usdc", "--out", "twice.mcap"]);
    json(&shot, &["out.mcap", "--out", "twice.ply"]);
    let read =
        |name: &str| curves::read(&shot.path().join(name), None).unwrap_or_else(|e| panic!("{e}")).layers.remove(0);
    let first = read("out.ply");
    assert_eq!(first.strands.id, [7, 9]);
    for name in ["out.usdc", "out.mcap", "twice.mcap", "twice.ply"] {
        let other = read(name);
        assert_eq!(first.strands.position, other.strands.position, "{name}");
        assert_eq!((&first.strands.id, &first.width), (&other.strands.id, &other.width), "{name}");
        assert_eq!(first.strands.root_uv, other.strands.root_uv, "{name}");
    }
}

#[test]
fn hair_below_an_open_bust_is_outside() {
    let shot = folder();
    let hang = CURVES.replace("1 8.3 0", "9 0 0").replace("2 7.5 0", "7 -9 0").replace("3 8.5 0", "0 -6.5 0");
    shot.write("hang.ply", hang.replace("\n0 8 0 0.01 5", "\n8.5 2 0 0.01 5"));
    assert_eq!(json(&shot, &["hang.ply"])["pushed"], 0);
    // Above the lid it is inside, though no triangle of the mesh is near.
    let inside = CURVES.replace("2 7.5 0", "2 -4 0");
    shot.write("inside.ply", inside);
    assert!(json(&shot, &["inside.ply"])["deepest_before_mm"].as_f64().expect("a number") > 8.0);
}

#[test]
fn what_is_wrong_is_said() {
    let shot = folder();
    shot.write("bare.ply", CURVES.replace("comment meters_per_unit 0.01\n", ""));
    let base = ["depenetrate", "hair.ply", "--skin", "ball.ply"];
    for (arguments, says) in [
        (vec!["--out", "hair.ply"], "overwrite"),
        (vec!["--out", "./ball.ply"], "overwrite"),
        (vec!["--out", "hair.abc"], ".usdc"),
        (vec!["--clearance", "0"], "--clearance"),
        (vec!["--held", "nan"], "--held"),
        (vec!["--meters-per-unit", "0"], "metres per unit"),
        (vec!["--out", "nowhere/out.usdc"], "nowhere"),
    ] {
        let out = shot.pelage(&[&base[..], &arguments].concat());
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(text.contains(says), "{arguments:?}: {text}");
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {text}");
    }
    for (curves, skin, says) in [
        ("bare.ply", "ball.ply", "--meters-per-unit"),
        ("ball.ply", "ball.ply", "curves"),
        ("hair.ply", "hair.ply", "face"),
        ("none.ply", "ball.ply", "none.ply"),
    ] {
        let out = shot.pelage(&["depenetrate", curves, "--skin", skin]);
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(2) && text.contains(says), "{curves}, {skin}: {text}");
    }
    assert_eq!(shot.read("hair.ply"), CURVES.as_bytes());
    assert_eq!(shot.leftovers(), Vec::<String>::new());
}
