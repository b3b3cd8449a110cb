//! Headline figures of the papers beside ours on the same counts, and two of their comparisons in pictures.

use super::machine::fastest;
use super::shot::{LENGTH, RADIUS, advance};
use super::strand::{name, refused};
use super::{Bench, Findings, Section, Study};
use crate::Error;
use crate::format::image::png_bytes;
use crate::format::ply::mesh_bytes;
use pelage_geom::{Offsets, shapes};
use pelage_light::shadow::{ShadowHair, ShadowSettings, Source, transmittance};
use pelage_light::{Camera, HairView, Image, Scene, SkinView, Tone, contact_sheet, render, studio_lights};
use pelage_sim::rig::{self, Ball, FRAME, Rig};
use pelage_sim::{Model, Settings};
use std::cell::LazyCell;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

pub(super) const STUDY: Study = Study {
    name: "papers",
    about: "The headline figures of the papers that this program follows, beside its own on the same counts.",
    run,
};

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let ball: LazyCell<Ball> = LazyCell::new(|| rig::ball(RADIUS));
    let mut findings = Findings::default();
    simulated(bench, &ball, &mut findings)?;
    pipeline(bench, &mut findings)?;
    shadows(bench, &mut findings)?;
    pictures(bench, &ball, &mut findings)?;
    Ok(findings)
}

/// A simulated shot of a paper.
struct Shot {
    paper: &'static str,
    /// Seconds a frame, particles and steps a frame that the paper says; NaN where it does not.
    says: [f64; 3],
    hairs: usize,
    segments: usize,
    model: Model,
    steps: u32,
}

/// Hairs of 25 cm that lie on the upper half of the ball down to its equator and hang from there.
fn long_hair(count: usize, segments: usize) -> Vec<Vec<[f64; 3]>> {
    let (length, out) = (0.25, 1.02 * RADIUS);
    let hair = |k: usize| {
        // Angle below the pole; even over the surface.
        let start = libm::acos(1.0 - 0.97 * (k as f64 + 0.5) / count as f64);
        let (sin, cos) = libm::sincos(2.4 * k as f64);
        let at = |i: usize| {
            let angle = start + length * i as f64 / (segments as f64 * out);
            let below = (angle - FRAC_PI_2).max(0.0) * out;
            let (flat, up) = libm::sincos(angle.min(FRAC_PI_2));
            [out * flat * cos, out * up - below, out * flat * sin]
        };
        (0..=segments).map(at).collect()
    };
    (0..count).map(hair).collect()
}

/// A paper's step of 6e-4 s in frames of 1/24 s.
const PAPER_STEPS: u32 = 70;

fn shots(quick: bool) -> Vec<Shot> {
    let of = |paper, says, hairs, segments, model, steps| {
        let hairs = if quick { hairs / 10 } else { hairs };
        Shot { paper, says, hairs, segments, model, steps }
    };
    let none = f64::NAN;
    let selle_5k = [17.0 * 60.0, 500e3, f64::from(PAPER_STEPS)];
    let mut out = vec![
        of("selle-long-5k", selle_5k, 5_000, 50, Model::Rod, 8),
        of("selle-long-5k", selle_5k, 5_000, 50, Model::Paper, PAPER_STEPS),
        of("selle-long-10k", [38.0 * 60.0, 1e6, f64::from(PAPER_STEPS)], 10_000, 50, Model::Rod, 8),
        of("hadap-dynamics", [120.0, none, none], 10_000, 30, Model::Rod, 8),
        of("chang-guides", [1.0, 3e3, none], 200, 15, Model::Rod, 8),
        of("kurihara", [30.0, 40e3, none], 1_000, 40, Model::Rod, 8),
    ];
    if !quick {
        // A tenth of the hairs: springs at the paper's step take a minute a frame for all.
        out.insert(1, of("selle-long-5k", selle_5k, 500, 50, Model::Springs, PAPER_STEPS));
    }
    out
}

fn simulated(bench: &mut Bench<'_>, ball: &LazyCell<Ball>, findings: &mut Findings) -> Result<(), Error> {
    let columns = [
        "paper: s a frame",
        "here: s a frame",
        "paper: ns a particle and step",
        "here: ns a particle and step",
        "here: particles",
        "here: largest strain",
    ];
    let mut s = Section::new("Simulation", &columns)
        .says(
            "As many hairs and segments as the paper, 25 cm long, on the upper half of the ball of the study `shot` (its distance \
             field is the body), lying on it down to its equator and hanging from there; it shakes by 1 rad once a second, in air; seconds on the clock with all threads for the second and third \
             frame of 1/24 s, the mean. Points name paper, hairs, segments, model and steps a frame; springs have a tenth of the hairs.",
        )
        .says(
            "Papers: Selle, Lentine, Fedkiw 2008, Table 2 (long hair, 5,000 and 10,000 hairs of 50 segments, 500,000 and \
             1,000,000 particles, 17 and 38 minutes a frame on four machines of four processors, steps of 6e-4 s). Hadap \
             (course 2003, dynamics): 10,000 hairs of 30 segments under two minutes a frame. Chang, Jin, Yu 2002: 200 guides \
             of 15 segments, 1 s a frame. Kurihara, Anjyo, Thalmann 1993: 1,000 hairs of 40 segments, 30 s a frame.",
        )
        .says(
            "Not comparable: machines of 1993 to 2008 against this one; their heads and motions; Selle's hairs meet each other \
             (repulsions, self-collisions, stiction), Hadap's too, ours do not yet; Selle does not say how long a frame is, so \
             that the figure a particle and step takes 1/24 s, 70 steps, which favours the paper. Selle's count of particles \
             includes those that span the tetrahedra. `paper` is the paper's nine steps with parameters of our own, since it \
             prints none.",
        );
    for shot in shots(bench.quick) {
        let point = format!(
            "{}/{}-hairs/{}-segments/{}/{}-steps",
            shot.paper,
            shot.hairs,
            shot.segments,
            name(shot.model),
            shot.steps
        );
        s.row(bench, &point, || {
            let hairs = long_hair(shot.hairs, shot.segments);
            let settings = Settings { model: shot.model, substeps: Some(shot.steps), ..Settings::default() };
            let mut rig = Rig::new(&hairs, &settings).map_err(refused)?;
            advance(&mut rig, 0, Some(&ball.field)).map_err(refused)?;
            let (start, mut work) = (Instant::now(), 0);
            for frame in 1..3 {
                advance(&mut rig, frame, Some(&ball.field)).map_err(refused)?;
                work += rig.last.particle_steps;
            }
            let seconds = start.elapsed().as_secs_f64();
            let [paper, particles, steps] = shot.says;
            let per = paper / (particles * steps) * 1e9;
            let points = work as f64 / (2.0 * f64::from(shot.steps));
            Ok([paper, seconds / 2.0, per, seconds * 1e9 / work as f64, points, rig.last.largest_strain])
        })?;
    }
    let of = |what: &str, model: &str| {
        let row = s.rows.iter().find(|(p, _)| p.starts_with(what) && p.contains(&format!("/{model}/")));
        row.map_or([f64::NAN; 6], |(_, v)| v[..].try_into().expect("six columns"))
    };
    let (rod, paper) = (of("selle-long-5k", "rod"), of("selle-long-5k", "paper"));
    findings.answers.push(format!(
        "Selle's long hair (Table 2), a particle and step: paper {:.0} ns on 16 processors, here rod {:.0} ns, the paper's nine \
         steps {:.0} ns; a frame of as much hair ({:.0} points) {:.2} s by rods with 8 steps and {:.2} s by the nine steps, without \
         hair against hair. Largest strain: rods {:.0e}, nine steps {:.0e}.",
        rod[2], rod[3], paper[3], rod[4], rod[1], paper[1], rod[5], paper[5]
    ));
    findings.sections.push(s);
    Ok(())
}

/// 10,000 square centimetres of skin, in centimetres.
const SKIN_RADIUS: f64 = 28.209_479;

/// A shot of a ball with this many hairs.
fn make_shot(folder: &Path, hairs: usize, points: usize, hairs_a_guide: f64) -> Result<(), Error> {
    let density = hairs as f64 / 1e4;
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).map_err(Error::disk(folder));
    write("skin.ply", &mesh_bytes(&shapes::cube_sphere(64, SKIN_RADIUS)))?;
    let turn = "time_s,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0.1,0,0,0,0.7071067811865476,0,0.7071067811865476\n";
    write("turn.csv", turn.as_bytes())?;
    let shot = "[shot]\nname = \"papers\"\nframes = [1, 2]\nfps = 24\nmeters_per_unit = 0.01\n[skin]\nrest = \"skin.ply\"\n\
                motion = \"turn.csv\"\n[groom]\nfile = \"groom.toml\"\n[simulate]\ntarget = \"off\"\n[export]\nformats = [\"mcap\"]\n\
                [preview]\nsize = [720, 486]\n";
    write("pipeline.toml", shot.as_bytes())?;
    let groom = format!(
        "[control]\nplacement = {{ per_cm2 = {} }}\npoints = 12\n[[comb]]\nkind = \"lay-down\"\namount = 0.5\n[[layer]]\n\
         name = \"coat\"\ndensity = {{ value = {density:?} }}\nlength = {{ value = 5.0, noise = 0.1 }}\npoints = {points}\n",
        density / hairs_a_guide
    );
    write("groom.toml", groom.as_bytes())
}

/// Seconds of some stages together, and the most memory of any, bytes.
fn stages(report: &serde_json::Value, names: &[&str]) -> [f64; 2] {
    let all = report["stages"].as_array().map_or(&[][..], Vec::as_slice);
    let of = all.iter().filter(|s| s["name"].as_str().is_some_and(|n| names.contains(&n)));
    of.fold([0.0, 0.0], |[t, m], s| {
        [t + s["wall_s"].as_f64().unwrap_or(0.0), s["peak_bytes"].as_f64().unwrap_or(0.0).max(m)]
    })
}

fn pipeline(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let columns = ["paper: s", "here: s", "paper: MB", "here: MB", "here: preview, s"];
    let mut s = Section::new("From roots to hairs", &columns)
        .says(
            "`pelage run` in a process of its own over a ball of 1 square metre with as many hairs, first run, nothing cached: \
             groom, instance and interpolate of two frames, seconds on the clock with all threads, and the most memory in use; \
             and the drawing of one preview of 720 x 486 pixels.",
        )
        .says(
            "Papers: Bruderlin (course 2003, production pipeline): 450,000 hairs, one control hair per 800, 30 minutes and 200 MB \
             at video size, an hour at 2048 x 1556. Chang, Jin, Yu 2002: 200 guides, 50,000 hairs of 50 segments, 20 s a frame \
             for interpolation, collision and drawing. Not comparable: the papers' seconds include final rendering \
             (RenderMan for Bruderlin) and their machines are 20 years older; Bruderlin's 200 MB are for hairs made as they \
             are rendered, here all hairs of a frame are kept and written.",
        );
    let cases: [(&str, usize, usize, f64, [f64; 2]); 2] = [
        ("bruderlin", 450_000, 12, 800.0, [1800.0, 200.0]),
        ("chang-interpolation", 50_000, 51, 250.0, [20.0, f64::NAN]),
    ];
    let folder = bench.folder.to_owned();
    for (paper, hairs, points, each, [seconds, megabytes]) in cases {
        let hairs = if bench.quick { hairs / 10 } else { hairs };
        s.row(bench, &format!("{paper}/{hairs}-hairs/{points}-points"), || {
            let dir = folder.join("papers-shot");
            let _ = std::fs::remove_dir_all(&dir);
            std::fs::create_dir_all(&dir).map_err(Error::disk(&dir))?;
            make_shot(&dir, hairs, points, each)?;
            let program = std::env::current_exe().map_err(Error::disk(&dir))?;
            let out = Command::new(program).args(["run", "--json", "--quiet"]).current_dir(&dir).output();
            let out = out.map_err(Error::disk(&dir))?;
            if !out.status.success() {
                return Err(Error::input(String::from_utf8_lossy(&out.stderr), "the shot of a study does not run"));
            }
            let report = serde_json::from_slice(&out.stdout).unwrap_or_default();
            let [t, m] = stages(&report, &["groom", "instance", "interpolate"]);
            let [drawn, _] = stages(&report, &["preview"]);
            let _ = std::fs::remove_dir_all(&dir);
            Ok([seconds, t, megabytes, m / 1e6, drawn])
        })?;
    }
    let first = s.rows.first().map_or(vec![f64::NAN; 5], |(_, v)| v.clone());
    findings.answers.push(format!(
        "Bruderlin's count{}: {:.1} s and {:.0} MB from roots to finished hairs (two frames) and {:.1} s for a preview, where the \
         paper has 1,800 s and 200 MB with final rendering.",
        if bench.quick { " (a tenth of it)" } else { "" },
        first[1],
        first[3],
        first[4]
    ));
    findings.sections.push(s);
    Ok(())
}

fn shadows(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let columns = ["paper: s", "here: s", "relative to N = 7, paper", "relative to N = 7, here"];
    let mut s = Section::new("Opacity shadow maps", &columns)
        .says(
            "Transmittance at every point of 10,000 hairs of 40 segments round a ball (quick: 2,000) for one light, 1,024 texels, by \
             the number of maps N (slices along the light): seconds on the clock with all threads, the fastest of two.",
        )
        .says(
            "Paper: Kim (course 2003): N = 7, 15, 30, 60, 100, 200, 500 take 5, 7, 10, 16, 25, 46, 109 s on a Pentium III with graphics \
             hardware; with clipping about 12 s at 500. Not comparable: another scene (its counts are not printed) and the \
             papers' seconds include drawing. Comparable is how time grows with N: linear there, hardly here, since each hair \
             is put into the slices that it crosses only.",
        );
    let hairs = if bench.quick { 2_000 } else { 10_000 };
    let strands = LazyCell::new(|| rig::tuft(RADIUS, hairs, LENGTH, 41));
    let mut first = [f64::NAN; 2];
    for (slices, paper) in [(7, 5.0), (15, 7.0), (30, 10.0), (60, 16.0), (100, 25.0), (200, 46.0), (500, 109.0)] {
        let point = format!("kim/{hairs}-hairs/N={slices}");
        let [_, here] = bench.point(&point, || {
            let offsets = Offsets::from_counts(strands.iter().map(Vec::len));
            let position: Vec<[f32; 3]> = strands.iter().flatten().map(|p| p.map(|c| c as f32)).collect();
            let width = vec![80e-6; position.len()];
            let layer =
                ShadowHair { offsets: &offsets, position: &position, origin: [0.0; 3], width: &width, opacity: &[] };
            let settings = ShadowSettings { texels: 1024, slices, ..ShadowSettings::default() };
            let source = Source::Directional { direction: [-0.4, -0.8, -0.4].into() };
            let seconds = fastest(2, || {
                std::hint::black_box(transmittance(source, &[layer], &[], &settings).map(|(t, _)| t.len()).ok());
            });
            Ok([paper, seconds])
        })?;
        if slices == 7 {
            first = [paper, here];
        }
        s.rows.push((point, vec![paper, here, paper / first[0], here / first[1]]));
    }
    let last = s.rows.last().map_or(vec![f64::NAN; 4], |(_, v)| v.clone());
    findings.answers.push(format!(
        "Kim's shadow maps: 500 maps take {:.1} times as long as 7 (paper: {:.0} times, 2.4 with clipping), {:.2} s for all points.",
        last[3], last[2], last[1]
    ));
    findings.sections.push(s);
    Ok(())
}

/// Frame at which pictures are taken: the ball swings to its other side.
const SEEN: usize = 14;

/// Pixels of a picture.
const SIZE: [usize; 2] = [480, 600];

/// Hairs on the shaking ball at the frame that is seen.
fn drawn(ball: &Ball, hairs: usize, steps: u32) -> Result<Image, Error> {
    let settings = Settings {
        substeps: Some(steps),
        // A step a frame means one: strands that turn far do not halve it.
        largest_turn: if steps == 1 { 10.0 } else { Settings::default().largest_turn },
        ..Settings::default()
    };
    let mut rig = Rig::new(&long_hair(hairs, 50), &settings).map_err(refused)?;
    (0..SEEN).try_for_each(|frame| advance(&mut rig, frame, Some(&ball.field))).map_err(refused)?;
    let position: Vec<[f32; 3]> = rig.sim.positions().iter().map(|p| p.map(|c| c as f32)).collect();
    // As wide as real hair that covers this much: 100,000 hairs of 80 micrometres, drawn as fewer, not wider than 0.5 mm.
    let width = vec![(100_000.0 / hairs as f32 * 80e-6).min(0.5e-3); position.len()];
    let view = HairView::plain(rig.sim.offsets(), &position, [0.0; 3], &width);
    let skin = SkinView {
        position: &ball.mesh.position,
        triangle: &ball.mesh.triangle,
        normal: &[],
        color: [0.42, 0.31, 0.26],
    };
    let camera = Camera::frame(([-0.13, -0.25, -0.13], [0.13, 0.11, 0.13]), [-0.3, -0.15, -1.0], [0.0, 1.0, 0.0], 0.8);
    let lights = studio_lights(&camera);
    let scene = Scene { skin: Some(skin), layers: &[view], lights: &lights, background: [0.16, 0.17, 0.19] };
    Ok(render(&scene, &camera, 2 * SIZE[0], 2 * SIZE[1], &pelage_light::Settings::default()).0.shrunk(2))
}

fn pictures(bench: &mut Bench<'_>, ball: &LazyCell<Ball>, findings: &mut Findings) -> Result<(), Error> {
    let hairs = if bench.quick { 250 } else { 5_000 };
    let mut s = Section::new("In pictures", &[]).says(format!(
        "Hair of 25 cm and 50 segments on the shaking ball after {SEEN} frames ({:.2} s), drawn by the preview.",
        SEEN as f64 * FRAME
    ));
    let usual = LazyCell::new(|| drawn(ball, hairs, 8));
    let pair = |other: Result<Image, Error>, usual_first: bool| {
        let usual = usual.as_ref().map_err(|e| Error::input(e.to_string(), ""))?.clone();
        let both = if usual_first { [usual, other?] } else { [other?, usual] };
        let sheet = contact_sheet(&both, 2);
        Ok(png_bytes(sheet.width, sheet.height, 3, &sheet.to_srgb8(Tone::default())))
    };
    let file = bench.picture(&format!("{hairs}-and-{}-hairs", 2 * hairs), || pair(drawn(ball, 2 * hairs, 8), true))?;
    let caption = format!(
        "{hairs} hairs (left) and {} hairs (right), 8 steps a frame; compare Selle, Lentine, Fedkiw 2008, Figure 17: more hairs \
         show more detail where the mass parts.",
        2 * hairs
    );
    s.pictures.push((file, caption));
    let file = bench.picture(&format!("steps-{hairs}-hairs"), || pair(drawn(ball, hairs, 1), false))?;
    let caption = format!(
        "One step a frame (left) and eight (right), {hairs} hairs; compare Figure 12: so long an implicit step stays whole and \
         the mass looks alike, but some hairs stray."
    );
    s.pictures.push((file, caption));
    findings.sections.push(s);
    Ok(())
}
