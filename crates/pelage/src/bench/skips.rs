//! What is not computed in vain: run time of whole shots with and without what they can skip, and the difference of their files.

use super::{Bench, Findings, Section, Study};
use crate::Error;
use crate::cli::Sample;
use crate::format::mcap::read_hair_mcap;
use crate::format::ply::{mesh_bytes, parse_mesh};
use crate::progress::Progress;
use crate::project::Project;
use crate::sample;
use crate::stage::{Options, Runner};
use pelage_geom::{Mesh, Vec3, shapes};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(super) const STUDY: Study = Study {
    name: "skips",
    about: "Shots that need about 30 % of their hairs: how much of the run time skipping the others saves, and what that does to \
            the hairs that are left.",
    run,
};

/// A shot with a skip, and without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Hair under a mask is left out.
    Masked,
    /// Hair out of the picture, or behind the skin, is left out.
    View,
    /// Fur far from the part of the skin that moves sleeps.
    Still,
    /// Fur far from the camera is thinned.
    Distant,
}

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let columns = [
        "hairs left or moving, %",
        "run without, s",
        "run with, s",
        "saved, %",
        "largest distance, mm",
        "RMS distance, mm",
        "RMS difference of transmittance",
        "largest difference of transmittance",
    ];
    let mut section = Section::new("Shots that need a part of their hair", &columns)
        .says("Each shot is run twice from an empty cache, whole, on all threads: with the skip and without it. Hairs that are \
               in both files are compared point by point at every frame; the run without the skip is the reference.")
        .says("masked: long hair, [skip] mask. view: fur of a fox, [skip] camera, seen from near. still: fur of a fox that moves \
               its tail only, simulate.sleep on and off. distant: fur of a fox, [skip] lod = 1, seen from afar.");
    let kinds = [("masked", Kind::Masked), ("view", Kind::View), ("still", Kind::Still), ("distant", Kind::Distant)];
    let frames = if bench.quick { 3 } else { 24 };
    let mut answers = Vec::new();
    for (name, kind) in kinds {
        let folder = bench.folder.join("shots");
        // Fields of a deforming skin cost as much for few hairs as for many: a shot of few says little.
        let per_cm2 = match (kind, bench.quick) {
            (Kind::Masked, true) => 3,
            (Kind::Masked, false) => 8,
            (Kind::View, true) => 10,
            (Kind::Still, false) => 70,
            (_, false) => 35,
            // They take minutes.
            (Kind::Still | Kind::Distant, true) => continue,
        };
        let [left, _, _, saved, most, ..] =
            section.row(bench, &format!("{name}/{per_cm2}-per-cm2/{frames}-frames"), || {
                both(kind, per_cm2, frames, &folder)
            })?;
        answers.push(format!(
            "{name}: with {left:.0} % of the hairs left {saved:.0} % of the run time is saved; largest change {most:.2e} mm."
        ));
    }
    Ok(Findings { answers, sections: vec![section] })
}

/// Runs a shot with and without its skip.
fn both(kind: Kind, per_cm2: u32, frames: i32, folder: &Path) -> Result<[f64; 8], Error> {
    let _ = std::fs::remove_dir_all(folder);
    let without = whole(kind, per_cm2, frames, &folder.join("without"), false)?;
    let with = whole(kind, per_cm2, frames, &folder.join("with"), true)?;
    let d = difference(&without.file, &with.file)?;
    let left = 100.0 * with.left / without.left.max(1.0);
    let saved = 100.0 * (1.0 - with.seconds / without.seconds);
    let _ = std::fs::remove_dir_all(folder);
    Ok([left, without.seconds, with.seconds, saved, d.most, d.rms, d.light_rms, d.light_most])
}

/// A whole run.
struct Whole {
    seconds: f64,
    file: PathBuf,
    /// Hairs that are there, or that move.
    left: f64,
}

fn whole(kind: Kind, per_cm2: u32, frames: i32, folder: &Path, skip: bool) -> Result<Whole, Error> {
    write(kind, per_cm2, frames, folder, skip)?;
    let mut progress = Progress::new(true);
    let start = Instant::now();
    let project = Project::open(&folder.join("pipeline.toml"))?;
    let report = Runner::new(&project, Options::default(), &mut progress)?.run()?;
    let seconds = start.elapsed().as_secs_f64();
    let stage = |name: &str| report.stages.iter().find(|s| s.name == name);
    let of = |s: &BTreeMap<String, u64>, name: &str| s.get(name).copied().unwrap_or(0) as f64;
    let simulated = stage("simulate").map_or(0.0, |s| of(&s.counts, "simulated"));
    let asleep = stage("simulate").map_or(0.0, |s| of(&s.skipped, "sleeping_strands"));
    let drawn = stage("interpolate").map_or(0.0, |s| of(&s.counts, "hairs"));
    let left = if kind == Kind::Still { simulated - asleep } else { drawn };
    Ok(Whole { seconds, file: project.out_dir().join("hair.mcap"), left })
}

/// Writes the shot's files.
fn write(kind: Kind, per_cm2: u32, frames: i32, folder: &Path, skip: bool) -> Result<(), Error> {
    let sample = if kind == Kind::Masked { Sample::Bust } else { Sample::Animal };
    let mut files = sample::files(sample);
    let text = |files: &mut Vec<(String, Vec<u8>)>, name: &str, edit: &dyn Fn(String) -> String| {
        let (_, bytes) = files.iter_mut().find(|f| f.0 == name).expect("a file of the sample");
        *bytes = edit(String::from_utf8(std::mem::take(bytes)).expect("text")).into_bytes();
    };
    let last = 1000 + frames;
    if kind == Kind::Masked {
        text(&mut files, "grooms/bust-long.toml", &|t| {
            t.replace("density = { value = 24.0", &format!("density = {{ value = {per_cm2}.0"))
        });
        let one_side = |p: Vec3, _: Vec3| if p.x > 5.0 { 1.0 } else { 0.0 };
        let map = shapes::paint(&skin(&files, "grooms/bust.ply")?, sample::MAP_SIZE, one_side);
        files.push(("maps/mask.png".to_owned(), sample::png(&map)));
        let skipped = if skip { "[skip]\nmask = { map = \"maps/mask.png\" }\n" } else { "" };
        text(&mut files, "pipeline.toml", &|t| {
            format!("{skipped}{}", t.replace("1048]", &format!("{last}]")).replace("frame = 1012", "frame = 1002"))
        });
    } else {
        text(&mut files, "grooms/animal-fur.toml", &|t| {
            t.replace("density = { value = 140.0", &format!("density = {{ value = {per_cm2}.0"))
                .replace("density = { value = 50.0", &format!("density = {{ value = {}.0", per_cm2 / 3))
                .replace("density = 6.0", "density = 3.0")
        });
        let fox = skin(&files, "grooms/animal.ply")?;
        for k in 0..frames {
            let mut posed = fox.clone();
            posed.position =
                if kind == Kind::Still { wag(&fox, k) } else { shapes::animal_pose(f64::from(k) / 24.0, &fox) };
            files.push((format!("anim/fox.{}.ply", 1001 + k), mesh_bytes(&posed)));
        }
        let camera = match kind {
            Kind::View => "eye = [22.0, 26.0, 34.0]\ntarget = [0.0, 20.0, 14.0]\nfov = 14.0\n",
            Kind::Distant => "eye = [500.0, 120.0, 700.0]\ntarget = [0.0, 10.0, 0.0]\nfov = 12.0\n",
            _ => "eye = [60.0, 30.0, 70.0]\ntarget = [0.0, 12.0, 0.0]\nfov = 30.0\n",
        };
        let skipped = match (kind, skip) {
            (Kind::View, true) => "[skip]\ncamera = true\n",
            (Kind::Distant, true) => "[skip]\nlod = 1.0\n",
            _ => "",
        };
        let sleep = kind != Kind::Still || skip;
        files.retain(|f| f.0 != "pipeline.toml");
        let shot = format!(
            "{skipped}[shot]\nname = \"fox\"\nframes = [1001, {last}]\nfps = 24\nmeters_per_unit = 0.01\npreroll = 4\n\
             [skin]\nrest = \"grooms/animal.ply\"\nframes = \"anim/fox.####.ply\"\n[groom]\nfile = \"grooms/animal-fur.toml\"\n\
             [simulate]\ntarget = \"every-hair\"\nsegments = 8\nsleep = {sleep}\n[[light]]\nname = \"key\"\n\
             kind = \"directional\"\ndirection = [-0.5, -0.75, -0.5]\n[export]\nformats = [\"mcap\"]\n[preview.camera]\n{camera}"
        );
        files.push(("pipeline.toml".to_owned(), shot.into_bytes()));
    }
    sample::write(folder, &files)
}

fn skin(files: &[(String, Vec<u8>)], name: &str) -> Result<Mesh, Error> {
    let (_, bytes) = files.iter().find(|f| f.0 == name).expect("the sample's skin");
    Ok(parse_mesh(Path::new(name), bytes)?.mesh)
}

/// The fox's tail and hind part at a frame: they swing to the sides, the rest stays where it is.
fn wag(fox: &Mesh, frame: i32) -> Vec<[f64; 3]> {
    let swing = libm::sin(0.5 * f64::from(frame));
    let moved = |p: &[f64; 3]| {
        let back = (-9.5 - p[2]).max(0.0);
        [p[0] + 0.004 * swing * back * back, p[1], p[2]]
    };
    fox.position.iter().map(moved).collect()
}

/// How far the hairs that two files share differ.
#[derive(Default)]
struct Difference {
    /// Millimetres.
    most: f64,
    rms: f64,
    light_rms: f64,
    light_most: f64,
}

fn difference(a: &Path, b: &Path) -> Result<Difference, Error> {
    let (mut a, mut b) = (read_hair_mcap(a)?, read_hair_mcap(b)?);
    let (frames, layers) = (a.facts().frames.len(), a.layer_names().count());
    let millimetres = 1e3 * a.facts().meters_per_unit;
    let mut d = Difference::default();
    let (mut points, mut lit) = (0u64, 0u64);
    for i in 0..layers {
        let (la, lb) = (a.layer(i)?, b.layer(i)?);
        let of_a: BTreeMap<u64, usize> = la.id.iter().enumerate().map(|(h, id)| (*id, h)).collect();
        for f in 0..frames {
            let (fa, fb) = (a.frame(f, i)?, b.frame(f, i)?);
            for (h, id) in lb.id.iter().enumerate() {
                let (pa, pb) = (la.offsets.range(of_a[id]), lb.offsets.range(h));
                for (p, q) in pa.zip(pb) {
                    let way = |x: usize| f64::from(fa.position[p][x]) - f64::from(fb.position[q][x]);
                    let square: f64 = (0..3).map(|x| way(x) * way(x)).sum();
                    (d.most, d.rms, points) = (d.most.max(square), d.rms + square, points + 1);
                    for (ta, tb) in fa.transmittance.iter().zip(&fb.transmittance) {
                        let t = f64::from(ta[p]) - f64::from(tb[q]);
                        (d.light_most, d.light_rms, lit) = (d.light_most.max(t.abs()), d.light_rms + t * t, lit + 1);
                    }
                }
            }
        }
    }
    d.most = millimetres * d.most.sqrt();
    d.rms = millimetres * (d.rms / points.max(1) as f64).sqrt();
    d.light_rms = (d.light_rms / lit.max(1) as f64).sqrt();
    Ok(d)
}
