//! Samples that Pelage makes itself: skins, motions, maps and grooms by formula, always the same bytes.

use crate::Error;
use crate::cli::Sample;
use crate::format::image::png_bytes;
use crate::format::ply::mesh_bytes;
use pelage_geom::shapes;
use pelage_geom::{Map, Mesh, RigidMotion, Vec3};
use std::path::Path;

/// A file by its path in the shot folder.
pub type NamedFile = (String, Vec<u8>);

/// Side of the painted maps, texels: a texel is under a millimetre on the bust.
pub(crate) const MAP_SIZE: usize = 512;

/// Files of a sample shot.
pub fn files(kind: Sample) -> Vec<NamedFile> {
    match kind {
        Sample::Bust => bust(false),
        Sample::BustNod => bust(true),
        Sample::Animal => animal(),
    }
}

/// Writes files of a shot into its folder.
pub fn write(dir: &Path, files: &[NamedFile]) -> Result<(), Error> {
    for (name, bytes) in files {
        let path = dir.join(name);
        let folder = path.parent().expect("inside the folder");
        std::fs::create_dir_all(folder).map_err(Error::disk(folder))?;
        std::fs::write(&path, bytes).map_err(Error::disk(&path))?;
    }
    Ok(())
}

fn text(name: &str, content: &str) -> NamedFile {
    (name.to_owned(), content.as_bytes().to_vec())
}

fn bust(deforming: bool) -> Vec<NamedFile> {
    let sample = shapes::bust();
    let mesh = &sample.mesh;
    let scalp = |p: Vec3, _| shapes::scalp(p);
    // Shorter toward the hairline, so that the fringe and the nape do not hang into the face.
    let length = |p: Vec3, _| 0.35 + 0.65 * smooth(-2.0, 4.0, 2.0 - p.z + 0.15 * (p.y - 18.0));
    let mut files = vec![
        ("grooms/bust.ply".to_owned(), mesh_bytes(mesh)),
        ("maps/scalp_density.png".to_owned(), png(&shapes::paint(mesh, MAP_SIZE, scalp))),
        ("maps/scalp_length.png".to_owned(), png(&shapes::paint(mesh, MAP_SIZE, length))),
        text("grooms/bust-long.toml", include_str!("sample/bust-long.toml")),
    ];
    if deforming {
        files.push(text("pipeline.toml", include_str!("sample/bust-nod.pipeline.toml")));
        for frame in 1001..=1024 {
            let mut posed = mesh.clone();
            posed.position = shapes::bust_pose(f64::from(frame - 1001) / 24.0, mesh);
            files.push((format!("anim/bust.{frame}.ply"), mesh_bytes(&posed)));
        }
    } else {
        files.push(text("pipeline.toml", include_str!("sample/bust.pipeline.toml")));
        files.push(("grooms/bust-shake.csv".to_owned(), motion(&shapes::head_shake())));
    }
    files
}

fn animal() -> Vec<NamedFile> {
    let sample = shapes::animal();
    let mesh = &sample.mesh;
    let direction = |p: Vec3, n: Vec3| {
        let d = shapes::fur_direction(p, n);
        [0.5 + 0.5 * d.x as f32, 0.5 + 0.5 * d.y as f32, 0.5 + 0.5 * d.z as f32]
    };
    vec![
        ("grooms/animal.ply".to_owned(), mesh_bytes(mesh)),
        ("maps/undercoat.png".to_owned(), png(&shapes::paint(mesh, MAP_SIZE, |p, _| shapes::undercoat(p)))),
        ("maps/overcoat.png".to_owned(), png(&shapes::paint(mesh, MAP_SIZE, |p, _| shapes::overcoat(p)))),
        ("maps/direction.png".to_owned(), png(&shapes::paint3(mesh, MAP_SIZE, direction))),
        text("grooms/animal-fur.toml", include_str!("sample/animal-fur.toml")),
        text("pipeline.toml", include_str!("sample/animal.pipeline.toml")),
    ]
}

/// A shot around a skin: short hair over all of it, no maps.
pub fn around(skin: Vec<u8>, mesh: &Mesh, meters_per_unit: f64) -> Vec<NamedFile> {
    let (low, high) = mesh.bounds();
    let size = (Vec3::from(high) - Vec3::from(low)).norm();
    let area: f64 = (0..mesh.triangle.len() as u32).map(|t| mesh.area(t)).sum();
    let cm2 = area * (100.0 * meters_per_unit).powi(2);
    // About 20,000 hairs and 500 control hairs, whatever the size; an artist takes it from here.
    let density = two_digits((20_000.0 / cm2).clamp(0.001, 1e5));
    let control = two_digits((500.0 / cm2).clamp(1e-5, 1e4));
    let length = two_digits(0.03 * size);
    let width = two_digits((0.0006 * size * meters_per_unit * 1e6).clamp(1.0, 1e6));
    let fill = |template: &str| {
        let values = [("UNIT", meters_per_unit), ("DENSITY", density), ("CONTROL", control), ("LENGTH", length)];
        let filled = values.iter().fold(template.to_owned(), |t, (k, v)| t.replace(k, &v.to_string()));
        filled.replace("WIDTH", &width.to_string()).into_bytes()
    };
    vec![
        ("grooms/skin.ply".to_owned(), skin),
        ("grooms/groom.toml".to_owned(), fill(include_str!("sample/skin-groom.toml"))),
        ("pipeline.toml".to_owned(), fill(include_str!("sample/skin.pipeline.toml"))),
    ]
}

/// The number with two digits that count.
fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().expect("a number")
}

fn smooth(low: f64, high: f64, x: f64) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    (t * t * (3.0 - 2.0 * t)) as f32
}

/// An 8-bit PNG, rows from the top; one or three channels.
pub(crate) fn png(map: &Map) -> Vec<u8> {
    let texel = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let row = map.width * map.channels;
    let data: Vec<u8> = map.data.chunks(row).rev().flatten().map(|x| texel(*x)).collect();
    png_bytes(map.width, map.height, map.channels, &data)
}

/// Seconds, metres and quaternions of a rigid motion. The samples are in centimetres.
fn motion(m: &RigidMotion) -> Vec<u8> {
    let mut out = String::from("# displacement from the rest pose in metres, rotation as a unit quaternion\n");
    out.push_str("time_s,tx,ty,tz,qx,qy,qz,qw\n");
    for (i, t) in m.time.iter().enumerate() {
        let (d, q) = (m.translation[i].map(|x| 0.01 * x), m.rotation[i]);
        out.push_str(&format!("{t},{},{},{},{},{},{},{}\n", d[0], d[1], d[2], q[0], q[1], q[2], q[3]));
    }
    out.into_bytes()
}
