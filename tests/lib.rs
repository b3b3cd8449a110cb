//! Small shots made in a temporary folder, and the command to run over them.

pub mod parameter_shots;
pub mod parameters;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A shot folder that goes away with this value.
pub struct ShotFolder {
    folder: tempfile::TempDir,
    command: PathBuf,
}

impl ShotFolder {
    /// An empty folder; `command` is the `pelage` binary.
    pub fn new(command: &str) -> Self {
        ShotFolder { folder: tempfile::tempdir().expect("a temporary folder"), command: command.into() }
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file, making folders on the way.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path().join(name);
        std::fs::create_dir_all(path.parent().expect("inside the folder")).expect("a folder");
        std::fs::write(path, content).expect("a file");
    }

    /// Content of a file.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Replaces text in a file; the text must be there.
    pub fn edit(&self, name: &str, from: &str, to: &str) {
        let text = String::from_utf8(self.read(name)).expect("text");
        assert!(text.contains(from), "{name} has no `{from}`");
        self.write(name, text.replacen(from, to, 1));
    }

    /// The command in this folder, not yet started.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.command);
        command.args(arguments).current_dir(self.path()).stdin(std::process::Stdio::null());
        command
    }

    /// Runs the command.
    pub fn pelage(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the command starts")
    }

    /// Runs the command, which must succeed, and returns stdout.
    pub fn succeed(&self, arguments: &[&str]) -> String {
        let out = self.pelage(arguments);
        let err = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "pelage {arguments:?} failed:\n{err}");
        String::from_utf8(out.stdout).expect("text on stdout")
    }

    /// Runs with `--json --quiet` and returns the report.
    pub fn report(&self, arguments: &[&str]) -> serde_json::Value {
        let text = self.succeed(&[&["run", "--json", "--quiet"], arguments].concat());
        serde_json::from_str(&text).expect("a report")
    }

    /// Names of the steps that `pelage plan` says would run, and its reasons.
    pub fn plan(&self, arguments: &[&str]) -> (BTreeSet<String>, BTreeSet<String>) {
        let text = self.succeed(&[&["plan", "--json"], arguments].concat());
        let stages: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let all = |key: &str| {
            let lists = stages.as_array().expect("stages").iter().map(|s| s[key].as_array().expect("a list"));
            lists.flatten().map(|v| v.as_str().expect("text").to_owned()).collect()
        };
        (all("run"), all("reasons"))
    }

    /// The same inputs in another folder, without results and cache.
    pub fn fresh(&self) -> ShotFolder {
        let other =
            ShotFolder { folder: tempfile::tempdir().expect("a temporary folder"), command: self.command.clone() };
        for (name, bytes) in files_below(self.path()) {
            if !name.starts_with("out/") && !name.starts_with(".pelage-cache/") {
                other.write(&name, bytes);
            }
        }
        other
    }

    /// Every file of the output folder but the report, whose times differ from run to run.
    pub fn outputs(&self) -> BTreeMap<String, Vec<u8>> {
        let mut found = files_below(&self.path().join("out"));
        found.retain(|name, _| !name.ends_with("/report.json"));
        found
    }

    /// Every file of every finished step in the cache.
    pub fn entries(&self) -> BTreeMap<String, Vec<u8>> {
        files_below(&self.path().join(".pelage-cache/v1/entries"))
    }

    /// Files that only an unfinished run has: none are left when it has ended.
    pub fn leftovers(&self) -> Vec<String> {
        let unfinished = |n: &String| n.ends_with(".part") || n.contains("/v1/tmp/") || n.contains("/v1/unfinished/");
        files_below(self.path()).into_keys().filter(unfinished).collect()
    }
}

/// Files below a folder, by path from it.
pub fn files_below(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(&at).into_iter().flatten() {
            let path = entry.expect("a directory entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below the folder").to_string_lossy().into_owned();
                match std::fs::read(&path) {
                    Ok(bytes) => drop(found.insert(name, bytes)),
                    // A command that is still at work takes its own away.
                    Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
                    Err(e) => panic!("{}: {e}", path.display()),
                }
            }
        }
    }
    found
}

/// One exported hair: where it stands, and every other number that the file has of it, bit by bit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportedHair {
    /// Face of the skin and texture coordinates of the root.
    pub root: (i32, [u32; 2]),
    /// Weights on the face, rest points, and positions and velocities at every frame.
    pub shape: Vec<u32>,
    /// Diameters, colour and opacity.
    pub look: Vec<u32>,
}

impl ExportedHair {
    /// Texture coordinates of the root.
    pub fn uv(&self) -> [f32; 2] {
        self.root.1.map(f32::from_bits)
    }
}

/// Every hair of an exported `hair.mcap` by layer and id.
pub fn exported_hairs(file: &Path) -> BTreeMap<(String, u64), ExportedHair> {
    fn bits<'a>(values: impl IntoIterator<Item = &'a [f32; 3]>) -> impl Iterator<Item = u32> {
        values.into_iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>().into_iter()
    }
    let mut read = pelage::format::mcap::read_hair_mcap(file).expect("an exported file");
    let names: Vec<String> = read.layer_names().map(str::to_owned).collect();
    let mut hairs = BTreeMap::new();
    for (l, name) in names.iter().enumerate() {
        let layer = read.layer(l).expect("a layer");
        let frames: Vec<_> = (0..read.facts().frames.len()).map(|f| read.frame(f, l).expect("a frame")).collect();
        for (i, id) in layer.id.iter().enumerate() {
            let points = layer.offsets.range(i);
            let mut shape: Vec<u32> = layer.skin_bary[i].iter().map(|x| x.to_bits()).collect();
            shape.extend(bits(&layer.rest[points.clone()]));
            for f in &frames {
                shape.extend(bits(&f.position[points.clone()]).chain(bits(&f.velocity[points.clone()])));
            }
            let mut look: Vec<u32> = layer.width[points.clone()].iter().map(|x| x.to_bits()).collect();
            let colors = if layer.color_per_point() { points.clone() } else { i..i + 1 };
            look.extend(bits(&layer.color[colors]).chain([layer.opacity[i].to_bits()]));
            for f in &frames {
                look.extend(
                    f.width.get(points.clone()).into_iter().flatten().chain(f.opacity.get(i)).map(|x| x.to_bits()),
                );
            }
            let hair = ExportedHair { root: (layer.skin_face[i], layer.root_uv[i].map(f32::to_bits)), shape, look };
            assert!(hairs.insert((name.clone(), *id), hair).is_none(), "hair {id} of {name} is there twice");
        }
    }
    hairs
}

/// An ASCII PLY of a mesh, written independently of the code under test: one vertex per (position, uv) pair.
pub fn ascii_ply(mesh: &pelage_geom::Mesh) -> String {
    let mut vertices: Vec<String> = Vec::new();
    let mut index = BTreeMap::new();
    let mut faces = String::new();
    for (t, triangle) in mesh.triangle.iter().enumerate() {
        let corners: Vec<String> = (0..3)
            .map(|k| {
                let (p, uv) = (mesh.position[triangle[k] as usize], mesh.corner_uv[t][k]);
                let line = format!("{} {} {} {} {}", p[0], p[1], p[2], uv[0], uv[1]);
                let n = *index.entry((triangle[k], line.clone())).or_insert_with(|| {
                    vertices.push(line);
                    vertices.len() - 1
                });
                n.to_string()
            })
            .collect();
        faces.push_str(&format!("3 {}\n", corners.join(" ")));
    }
    let properties = ["x", "y", "z", "s", "t"].map(|p| format!("property double {p}\n")).concat();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar int vertex_indices\nend_header\n{}\n{faces}",
        vertices.len(),
        mesh.triangle.len(),
        vertices.join("\n"),
    )
}

/// The ball of the small shots sheared by an amount, as a PLY.
pub fn deformed(amount: f64) -> String {
    let mut mesh = pelage_geom::shapes::cube_sphere(8, 5.0);
    mesh.position.iter_mut().for_each(|p| p[0] += 0.02 * amount * p[1]);
    ascii_ply(&mesh)
}

/// A greyscale 8-bit PNG, rows from the top.
pub fn grey_png(width: u32, height: u32, value: impl Fn(u32, u32) -> u8) -> Vec<u8> {
    let mut raw = Vec::new();
    for y in 0..height {
        raw.push(0);
        raw.extend((0..width).map(|x| value(x, y)));
    }
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::new();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 0, 0, 0, 0]);
    chunk(&mut out, b"IHDR", &header);
    chunk(&mut out, b"IDAT", &stored_zlib(&raw));
    chunk(&mut out, b"IEND", &[]);
    out
}

/// The PNG whose pixels are those of an 8-bit greyscale PNG looked up in a palette.
pub fn indexed_png(grey: &[u8], palette: &[[u8; 3]]) -> Vec<u8> {
    let (signature, mut rest) = grey.split_at(8);
    let mut out = signature.to_vec();
    while let Some((head, tail)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let name = [head[4], head[5], head[6], head[7]];
        let mut data = tail[..length].to_vec();
        if &name == b"IHDR" {
            // Colour type: 0 is grey, 3 is an index.
            data[9] = 3;
        }
        chunk(&mut out, &name, &data);
        if &name == b"IHDR" {
            chunk(&mut out, b"PLTE", palette.as_flattened());
        }
        rest = &tail[length + 4..];
    }
    out
}

fn chunk(out: &mut Vec<u8>, name: &[u8; 4], data: &[u8]) {
    out.extend((data.len() as u32).to_be_bytes());
    let body = [name.as_slice(), data].concat();
    out.extend(&body);
    let mut crc = !0u32;
    for byte in body {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    out.extend((!crc).to_be_bytes());
}

/// A zlib stream of stored blocks.
fn stored_zlib(data: &[u8]) -> Vec<u8> {
    let mut out = vec![0x78, 0x01];
    let blocks: Vec<&[u8]> = data.chunks(65_535).collect();
    for (i, block) in blocks.iter().enumerate() {
        let n = block.len() as u16;
        out.push(u8::from(i + 1 == blocks.len()));
        out.extend(n.to_le_bytes());
        out.extend((!n).to_le_bytes());
        out.extend(*block);
    }
    let (mut a, mut b) = (1u32, 0u32);
    for byte in data {
        a = (a + u32::from(*byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    out.extend(((b << 16) | a).to_be_bytes());
    out
}

/// The small shot under two lights: parallel light from above at every frame, and a spot that moves and is on from frame 2.
pub fn lit_shot(command: &str, frames: u32) -> ShotFolder {
    let shot = small_shot(command, frames);
    let text = String::from_utf8(shot.read("pipeline.toml")).expect("text");
    let lights = r#"
[[light]]
name = "key"
kind = "directional"
direction = [0.25, -1.0, 0.0]

[[light]]
name = "rim-2"
kind = "spot"
position = [{ frame = 1, value = [20.0, 0.0, 0.0] }, { frame = 3, value = [20.0, 4.0, 0.0] }]
direction = [-1.0, 0.0, 0.0]
cone = 40.0
intensity = 3.0
frames = [2, 100]

[shadow]
quality = "draft"
"#;
    shot.write("pipeline.toml", text + lights);
    shot
}

/// The small shot with few hairs, all simulated; a checkpoint after every second frame.
pub fn simulated_shot(command: &str, frames: u32) -> ShotFolder {
    let shot = small_shot(command, frames);
    shot.edit("grooms/ball.toml", "value = 4.0", "value = 0.6");
    shot.edit("grooms/ball.toml", "density = { value = 1.0 }", "density = { value = 0.3 }");
    shot.edit("pipeline.toml", "target = \"off\"", "segments = 8\ncheckpoint = 2");
    shot.edit("pipeline.toml", "fps = 24", "fps = 24\npreroll = 3");
    shot
}

/// The small shot with every part of the look: in one layer clumps of clumps, curls by clump and frizz, in the other wet
/// clumps where an emitter's particles hit, waves and wind.
pub fn look_shot(command: &str, frames: u32) -> ShotFolder {
    let shot = small_shot(command, frames);
    shot.edit(
        "grooms/ball.toml",
        "width = { value = 40.0, tip = 0.5 }\n",
        r#"width = { value = 40.0, tip = 0.5 }

[[layer.clump]]
density = 0.8
areas = ["hose"]
wet = { width = 1.5, opacity = 0.75 }

[[layer.wave]]
x = { amplitude = [0.02, 0.04, 0.04, 0.02], frequency = [1, 2, 2, 1] }
size = 1.0

[layer.wind]
amplitude = 0.1
direction = [1, 0, 0]
size = 3.0
"#,
    );
    let groom = String::from_utf8(shot.read("grooms/ball.toml")).expect("text");
    let more = r#"points = 25

[[layer.clump]]
density = 0.25
percent = { value = 0.75, map = "../maps/half.png", noise = 0.1 }
rate = 0.25
splay = 0.125

[[layer.clump]]
density = 0.0625
percent = [{ frame = 1, value = 0.25 }, { frame = 5, value = 0.75 }]

[layer.curl]
kind = "helix"
radius = 0.08
pitch = 0.8
per_clump = true

[[layer.noise]]
amplitude = 0.03
size = 0.5

[[emitter]]
name = "hose"
position = [0, 20, 0]
direction = [0, -1, 0]
spread = 10
rate = 48
radius = [{ frame = 0, value = 0 }, { frame = 4, value = 2 }]
percent = 0.875
"#;
    shot.write("grooms/ball.toml", groom + more);
    shot
}

/// A small two-layer shot on a ball of radius 5 cm with six charts, moved rigidly over `frames` frames.
pub fn small_shot(command: &str, frames: u32) -> ShotFolder {
    let shot = ShotFolder::new(command);
    shot.write("grooms/ball.ply", ascii_ply(&pelage_geom::shapes::cube_sphere(8, 5.0)));
    let mut csv = String::from("time_s,tx,ty,tz,qx,qy,qz,qw\n");
    for f in 0..=frames {
        let (t, angle) = (f64::from(f) / 24.0, 0.05 * f64::from(f));
        csv.push_str(&format!(
            "{t},{},0,0,0,{},0,{}\n",
            0.001 * f64::from(f),
            (0.5 * angle).sin(),
            (0.5 * angle).cos()
        ));
    }
    shot.write("grooms/ball.csv", csv);
    shot.write("maps/half.png", grey_png(64, 64, |x, _| if x < 32 { 255 } else { 96 }));
    shot.write("maps/length.png", grey_png(32, 32, |_, y| 128 + 3 * y as u8));
    shot.write(
        "pipeline.toml",
        format!(
            r#"[shot]
name = "ball"
frames = [1, {frames}]
fps = 24
meters_per_unit = 0.01

[skin]
rest = "grooms/ball.ply"
motion = "grooms/ball.csv"

[groom]
file = "grooms/ball.toml"

[simulate]
target = "off"

[export]
formats = ["usd", "mcap"]

[preview]
size = [160, 120]
sheet = 2
"#
        ),
    );
    shot.write(
        "grooms/ball.toml",
        r#"[control]
placement = { per_cm2 = 0.2 }
points = 6

[[comb]]
kind = "direction-curve"
points = [[0.0, 10.0, 0.0], [0.0, -10.0, 0.0]]
bend = 0.6
curvature = 0.5

[[layer]]
name = "under"
density = { value = 4.0, map = "../maps/half.png" }
length = { value = 1.0, noise = 0.2 }
width = { value = 40.0, tip = 0.5 }

[[layer]]
name = "over"
density = { value = 1.0 }
length = { value = 2.5, map = "../maps/length.png" }
color = { value = [0.4, 0.2, 0.1] }
"#,
    );
    shot
}
