//! Broken PLY skins, at rest and in a deforming sequence.

use super::{COMMAND, Corpus, noise, run_bounded};
use pelage_geom::{Mesh, shapes};
use pelage_tests::{ShotFolder, ascii_ply, small_shot};

const SKIN: &str = "grooms/ball.ply";

fn ball() -> Mesh {
    shapes::cube_sphere(8, 5.0)
}

/// Header of a mesh in binary; `list` is the types of the face list.
fn header(vertices: &str, faces: &str, list: &str) -> Vec<u8> {
    let properties = ["x", "y", "z", "s", "t"].map(|p| format!("property float {p}\n")).concat();
    format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{properties}element face {faces}\n\
         property list {list} vertex_indices\nend_header\n"
    )
    .into_bytes()
}

/// The vertices of a mesh, three a triangle.
fn vertices(mesh: &Mesh) -> Vec<u8> {
    let mut out = Vec::new();
    for (triangle, uv) in mesh.triangle.iter().zip(&mesh.corner_uv) {
        for (v, uv) in triangle.iter().zip(uv) {
            let p = mesh.position[*v as usize].map(|x| x as f32);
            out.extend([p[0], p[1], p[2], uv[0], uv[1]].iter().flat_map(|x| x.to_le_bytes()));
        }
    }
    out
}

/// Its faces, with a count of `width` bytes.
fn faces(mesh: &Mesh, width: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for t in 0..mesh.triangle.len() as u32 {
        out.extend(&3u32.to_le_bytes()[..width]);
        out.extend((0..3).flat_map(|k| (3 * t + k).to_le_bytes()));
    }
    out
}

fn binary(vertex_count: &str, face_count: &str, body: &[u8]) -> Vec<u8> {
    [header(vertex_count, face_count, "uchar int").as_slice(), body].concat()
}

/// Keeps a share of the bytes after the header.
fn cut(file: &[u8], share: f64) -> &[u8] {
    let mark = b"end_header\n";
    let body = file.windows(mark.len()).position(|w| w == mark).expect("a header") + mark.len();
    &file[..body + (share * (file.len() - body) as f64) as usize]
}

#[test]
fn headers_that_are_wrong() {
    let mut corpus = Corpus::new();
    let good = ascii_ply(&ball());
    let mut try_one = |case: &str, broken: &[u8], words: &str| {
        corpus.refuse(case, SKIN, broken, &format!("ball.ply|{words}"));
    };
    try_one("empty", b"", "empty");
    try_one("wrong magic", good.replacen("ply", "plx", 1).as_bytes(), "PLY|help:");
    try_one("another format", b"# a cube\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "PLY|help:");
    try_one("binary garbage", &noise(5000), "PLY|help:");
    try_one("garbage after the magic", &[b"ply\n".as_slice(), &noise(5000)].concat(), "header");
    for bytes in [4, 20, 60, 120] {
        try_one("header cut short", &good.as_bytes()[..bytes], "header");
    }
    let edits = [
        ("format ascii 1.0", "format middle_endian 1.0", "line 2"),
        ("format ascii 1.0\n", "", "format"),
        ("element vertex ", "element vertex -", "line 3"),
        ("element vertex ", "element vertex many", "line 3"),
        ("property double y", "property quad y", "line 5"),
        ("property double y", "property double x", "line 5"),
        ("property double y", "property double w", "no property 'y'"),
        ("property double y", "property list uchar double y", "'y' is a list"),
        ("vertex_indices", "corners", "vertex_indices"),
        ("property list uchar int vertex_indices", "property int vertex_indices", "expected a list"),
        ("list uchar int", "list uchar float", "real numbers"),
        ("list uchar int", "list float int", "list"),
        ("element vertex", "element point", "no element 'vertex'"),
        ("element face", "element polygon", "no faces"),
    ];
    for (from, to, words) in edits {
        corpus.refuse_edit(SKIN, from, to, &format!("ball.ply|{words}"));
    }
    corpus.finish();
}

#[test]
fn counts_that_lie() {
    let mut corpus = Corpus::new();
    let good = ascii_ply(&ball());
    let mesh = ball();
    let count = good.lines().nth(2).expect("a count").to_owned();
    let face_count = format!("element face {}", mesh.triangle.len());
    for huge in ["4000000000", "18446744073709551615", "99999999999999999999999"] {
        corpus.refuse_edit(SKIN, &count, &format!("element vertex {huge}"), "ball.ply|vertex");
        corpus.refuse_edit(SKIN, &face_count, &format!("element face {huge}"), "ball.ply|face");
    }
    let body = [vertices(&mesh), faces(&mesh, 1)].concat();
    let (v, f) = ((3 * mesh.triangle.len()).to_string(), mesh.triangle.len().to_string());
    let mut try_one = |case: &str, broken: &[u8], words: &str| {
        corpus.refuse(case, SKIN, broken, &format!("ball.ply|{words}"));
    };
    try_one("vertices", &binary("4000000000", &f, &body), "vertex|help:");
    try_one("faces", &binary(&v, "4000000000", &body), "face|help:");
    try_one("no faces", &binary(&v, "0", &body), "no faces|help:");
    for (width, list, count) in [
        (1, "char int", -1i32),
        (1, "uchar int", 255),
        (4, "int int", -1),
        (4, "int int", i32::MAX),
        (4, "uint int", -1),
        (4, "int int", 100_000_000),
    ] {
        let mut body = faces(&mesh, width);
        let record = width + 12;
        body[7 * record..7 * record + width].copy_from_slice(&count.to_le_bytes()[..width]);
        let file = [header(&v, &f, list), vertices(&mesh), body].concat();
        try_one(&format!("{list} list of {count}"), &file, "face");
    }
    let empty = |n: usize| [header(&v, &f, "uchar int"), vertices(&mesh), vec![0; n]].concat();
    try_one("faces without corners", &empty(mesh.triangle.len()), "no faces");
    corpus.finish();
}

#[test]
fn bodies_that_are_wrong() {
    let mut corpus = Corpus::new();
    let mesh = ball();
    let good = ascii_ply(&mesh).into_bytes();
    let body = [vertices(&mesh), faces(&mesh, 1)].concat();
    let whole = binary(&(3 * mesh.triangle.len()).to_string(), &mesh.triangle.len().to_string(), &body);
    for (share, words) in [(0.0, "vertex"), (0.2, "vertex"), (0.9, "face"), (0.999, "face")] {
        let words = format!("ball.ply|{words}|help:");
        corpus.refuse("text cut short", SKIN, cut(&good, share), &words);
        corpus.refuse("binary cut short", SKIN, cut(&whole, share), &words);
    }
    let last = good.iter().rposition(|b| *b == b' ').expect("a space");
    corpus.refuse("last corner cut off", SKIN, &good[..last], "ball.ply|767 of 768|face|help:");
    let text = String::from_utf8(good).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    let vertex_count = lines[2].rsplit(' ').next().expect("a count").parse::<usize>().expect("a number");
    let edit = |line: usize, to: &str| [&lines[..line], &[to], &lines[line + 1..]].concat().join("\n");
    let (vertex, face) = (11, 11 + vertex_count);
    for (line, to, words) in [
        (vertex + 5, "nan 0 0 0 0", "vertex 5"),
        (vertex + 5, "0 inf 0 0 0", "vertex 5"),
        (vertex + 5, "0 1e999 0 0 0", "vertex 5"),
        (vertex + 5, "0 0 0 nan 0", "vertex 5"),
        (vertex + 5, "0 0 zero 0 0", "vertex 5"),
        (vertex + 5, "0 0 0 0", "vertex 5"),
        (face + 3, "3 0 1 999999", "face 3|999999"),
        (face + 3, "3 0 1 -1", "face 3|-1"),
        (face + 3, "3 0 1 99999999999", "face 3"),
        (face + 3, "3 0 1", "face 3"),
        (face + 3, "-3 0 1 2", "face 3"),
        (face + 3, "200 0 1 2", "face 3"),
        (face + 3, "3 0 1 two", "face 3"),
    ] {
        corpus.refuse(&format!("line {line}: {to}"), SKIN, edit(line, to), &format!("ball.ply|{words}"));
    }
    let mut mesh = ball();
    mesh.position[0] = [1e300, -1e300, 1e300];
    corpus.refuse("a vertex beyond all measure", SKIN, ascii_ply(&mesh), "ball.ply|vertex|1e300|help:");
    mesh.position.iter_mut().flatten().for_each(|x| *x = x.clamp(-1.0, 1.0) * 1e17);
    corpus.refuse("larger than the sun", SKIN, ascii_ply(&mesh), "ball.toml|control hairs|help:");
    corpus.finish();
}

#[test]
fn skins_that_cannot_carry_hair() {
    let mut corpus = Corpus::new();
    let mesh = ball();
    let bare = |line: &str| line.split(' ').take(3).collect::<Vec<_>>().join(" ");
    let text = ascii_ply(&mesh);
    let (head, body) = text.split_once("end_header\n").expect("a header");
    let head = head.replace("property double s\nproperty double t\n", "");
    let vertices = text.lines().nth(2).and_then(|l| l.rsplit(' ').next()).and_then(|n| n.parse::<usize>().ok());
    let vertices = vertices.expect("a count");
    let lines = body.lines().enumerate().map(|(i, l)| if i < vertices { bare(l) } else { l.to_owned() });
    let file = format!("{head}end_header\n{}\n", lines.collect::<Vec<_>>().join("\n"));
    corpus.refuse("no texture coordinates", SKIN, file, "ball.ply|texture coordinates|help:");
    let mut flat = ball();
    flat.position.iter_mut().for_each(|p| *p = [1.0, 2.0, 3.0]);
    corpus.refuse("all vertices in one place", SKIN, ascii_ply(&flat), "ball.ply|area");
    let path = corpus.shot.path().join(SKIN);
    std::fs::remove_file(&path).expect("the file was there");
    corpus.refuse_as_it_is("no file", "pipeline.toml|skin.rest|ball.ply|help:");
    std::fs::create_dir(&path).expect("a folder");
    corpus.refuse_as_it_is("a folder", "pipeline.toml|skin.rest|ball.ply|not a file");
    std::fs::remove_dir(&path).expect("an empty folder");
    corpus.shot.write(SKIN, text);
    corpus.finish();
}

/// The ball swelling over three frames, one file a frame.
fn deforming() -> ShotFolder {
    let shot = small_shot(COMMAND, 3);
    for frame in 1..=3 {
        shot.write(&format!("anim/ball.{frame:04}.ply"), swollen(frame));
    }
    shot.edit("pipeline.toml", "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
    shot
}

fn swollen(frame: u32) -> String {
    let mut mesh = ball();
    mesh.position.iter_mut().flatten().for_each(|x| *x *= 1.0 + 0.01 * f64::from(frame));
    ascii_ply(&mesh)
}

#[test]
fn frames_that_do_not_fit() {
    let mut corpus = Corpus::of(deforming());
    let last = "anim/ball.0003.ply";
    let text = swollen(3);
    let frame = |case: &str, broken: String, words: &str, corpus: &mut Corpus| {
        corpus.refuse(case, last, broken, &format!("ball.0003.ply|{words}"));
    };
    let finer = ascii_ply(&shapes::cube_sphere(9, 5.0));
    frame("other vertices", finer, "vertices|the rest pose has|help:", &mut corpus);
    let line = text.lines().nth(40).expect("a vertex");
    frame("not a number", text.replacen(line, "nan 0 0 0 0", 1), "vertex 29", &mut corpus);
    frame("cut short", text[..text.len() / 3].to_owned(), "vertex|help:", &mut corpus);
    frame("empty", String::new(), "empty", &mut corpus);
    let faces = "element face 768";
    let fewer = text.replacen(faces, "element face 767", 1);
    frame("other faces", fewer, "767 faces|768|help:", &mut corpus);
    std::fs::remove_file(corpus.shot.path().join(last)).expect("the file was there");
    corpus.refuse_as_it_is("a gap", "pipeline.toml|skin.frames|frame 3|help:");
    corpus.shot.write(last, &text);
    corpus.refuse_edit("pipeline.toml", "anim/ball.####.ply", "anim/ball.ply", "skin.frames|help:");
    corpus.refuse_edit("pipeline.toml", "anim/", "nowhere/", "pipeline.toml|skin.frames|frame 1-3");
    corpus.finish();
}

#[test]
fn a_late_broken_frame_keeps_the_frames_before_it() {
    let shot = deforming();
    shot.write("anim/ball.0003.ply", "ply\n");
    let said = run_bounded(shot.path(), &["run"]);
    assert_eq!(said.code, Some(2), "{}", said.err);
    assert!(!shot.path().join("out").exists(), "nothing was exported");
    shot.write("anim/ball.0003.ply", swollen(3));
    let report = shot.report(&[]);
    let stage = report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == "interpolate");
    let stage = stage.expect("a stage");
    assert_eq!((stage["ran"].as_u64(), stage["reused"].as_u64()), (Some(1), Some(2)), "{stage}");
}
