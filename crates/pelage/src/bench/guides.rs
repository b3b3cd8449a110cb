//! Guides against every hair: what an artist gives up who simulates some of the hairs and interpolates the rest.

use super::plot::{Plot, Series};
use super::{Bench, Findings, Section, Study, shots};
use crate::Error;
use crate::cli::Sample;
use crate::progress::Progress;
use crate::project::Project;
use crate::stage::{Options, Runner, Skin, SkinPose, Stage, What, groom, instance, interpolate, simulate};
use pelage_geom::{Bvh, StrandId, Vec3};
use pelage_groom::control::{PartingPiece, Sites};
use pelage_groom::instance::{Roots, Weights, weights};
use pelage_groom::interpolate::{Blend, ControlPose, interpolate as blend};
use pelage_groom::triangulate::{mirrored_charts, triangulate};
use pelage_light::HairView;
use pelage_sim::body::Closed;
use rayon::prelude::*;
use std::cell::OnceCell;
use std::path::Path;
use std::rc::Rc;

pub(super) const STUDY: Study = Study {
    name: "guides",
    about: "Some hairs simulated and the rest interpolated, against all hairs simulated.",
    run,
};

/// Hairs of one that is simulated.
const SHARES: [usize; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];
const QUICK_SHARES: [usize; 4] = [1, 4, 16, 256];

/// A point of a hair this much inside the skin is seen to be, metres.
const DEEP: f64 = 1e-3;

/// The share that is simulated with finer steps, for the error of the steps themselves.
const STEP_SHARE: usize = 16;

/// Steps of a frame there; the default takes 8.
const FINE_STEPS: u32 = 64;

const COLUMNS: [&str; 9] = [
    "hairs simulated",
    "processor s",
    "median, mm",
    "RMS, mm",
    "95 %, mm",
    "worst, mm",
    "RMS, % of length",
    "RMS at rest, mm",
    "deeper than 1 mm in the skin, % of points",
];

/// The shot with all its hairs simulated.
struct Full {
    skin: Rc<Skin>,
    sites: Sites,
    roots: Rc<Roots>,
    points: usize,
    /// Scene units.
    length: Vec<f32>,
    rest: Vec<[f32; 3]>,
    /// Frames that are compared, and where the hairs are there.
    frames: Vec<i32>,
    position: Vec<Vec<[f32; 3]>>,
    /// The skin at the last frame, closed.
    pose: Rc<SkinPose>,
    body: Bvh,
    millimetres: f64,
}

/// Hairs that are simulated, of a smaller share.
struct Guides {
    id: Vec<StrandId>,
    rest: Vec<[f32; 3]>,
    position: Vec<Vec<[f32; 3]>>,
    seconds: f64,
}

/// Share of the hairs that the quick bench has.
const QUICK: f64 = 0.06;

/// The sample bust shaking its head; in the quick bench with fewer hairs and the first frames only.
fn shot(folder: &Path, quick: bool) -> Result<Project, Error> {
    let bust = shots::project(folder, Sample::Bust)?;
    Ok(if quick { shots::thinned(&shots::until(bust, 1004), QUICK) } else { shots::until(bust, 1024) })
}

/// Every third frame is compared.
fn frames(project: &Project) -> Vec<i32> {
    project.frames.keys().rev().copied().step_by(3).collect::<Vec<_>>().into_iter().rev().collect()
}

/// Simulates a shot anew, or takes what is kept of it.
fn simulated(project: &Project, anew: bool) -> Result<Guides, Error> {
    let mut progress = Progress::new(true);
    let force = anew.then_some(Stage::Simulate);
    let options = Options { to: Some(Stage::Simulate), force, ..shots::draft() };
    let mut run = Runner::new(project, options, &mut progress)?;
    let report = run.run()?;
    let seconds = report.stages.iter().find(|s| s.name == Stage::Simulate.name()).map_or(f64::NAN, |s| s.cpu_s);
    let id = instance::roots(&mut run, 0)?.id.clone();
    let rest = interpolate::positions(&mut run, What::Rest(0))?;
    let each = frames(project).into_iter().map(|f| simulate::positions(&mut run, 0, f));
    Ok(Guides { id, rest, position: each.collect::<Result<_, _>>()?, seconds })
}

fn full(project: &Project) -> Result<Full, Error> {
    let Guides { rest, position, .. } = simulated(project, false)?;
    let mut progress = Progress::new(true);
    let mut run = Runner::new(project, shots::draft(), &mut progress)?;
    let (skin, sites) = (groom::skin(&mut run)?, groom::placed(&mut run)?);
    let (roots, length) = (instance::roots(&mut run, 0)?, instance::column(&mut run, What::Length(0), 0)?);
    let frames = frames(project);
    let last = frames.last().expect("a shot has frames");
    let pose = groom::pose(&mut run, &project.frames[last])?;
    let solid = Closed::new(&skin.mesh, &skin.topology);
    let body = solid.bvh(&solid.extend(&pose.position));
    let millimetres = 1e3 * project.shot.value.shot.meters_per_unit;
    Ok(Full {
        points: project.base_points(0),
        skin,
        sites,
        roots,
        length,
        rest,
        frames,
        position,
        pose,
        body,
        millimetres,
    })
}

/// Which guides every hair follows: the Delaunay triangle of guides around its root in texture space. A guide beyond a
/// parting has no weight.
fn surround(full: &Full, guides: &[StrandId]) -> Weights {
    let roots = &full.roots;
    let place: Vec<usize> =
        guides.iter().map(|id| roots.id.binary_search(id).expect("a guide is one of the hairs")).collect();
    let mut sites = Sites::default();
    for (g, &h) in place.iter().enumerate() {
        sites.push(roots.chart[h], roots.uv[h], [g as u32; 2]);
    }
    let mirrored = mirrored_charts(&full.skin.mesh, &full.skin.topology);
    let mut found = weights(roots, &triangulate(&sites, &mirrored));
    for h in 0..roots.id.len() {
        let parted = |piece: &&PartingPiece| piece.chart == roots.chart[h];
        let beyond = |g: u32| {
            let line = [roots.uv[h], roots.uv[place[g as usize]]];
            full.sites.partings.iter().filter(parted).any(|piece| {
                piece.site.windows(2).any(|s| cross(line, [s[0], s[1]].map(|s| full.sites.uv[s as usize])))
            })
        };
        let own = std::array::from_fn(|k| if beyond(found.hair[h][k]) { 0.0 } else { found.weight[h][k] });
        let sum: f32 = own.iter().sum();
        if sum > 0.0 {
            found.weight[h] = own.map(|w| w / sum);
        }
    }
    found
}

/// True if two segments in the plane cross.
fn cross(a: [[f32; 2]; 2], b: [[f32; 2]; 2]) -> bool {
    let side = |l: [[f32; 2]; 2], p: [f32; 2]| {
        let d = |q: [f32; 2]| [0, 1].map(|x| f64::from(q[x]) - f64::from(l[0][x]));
        let (u, v) = (d(l[1]), d(p));
        u[0] * v[1] - u[1] * v[0]
    };
    side(a, b[0]) * side(a, b[1]) < 0.0 && side(b, a[0]) * side(b, a[1]) < 0.0
}

/// All hairs from the guides.
fn followed(full: &Full, weights: &Weights, guides: &[[f32; 3]], all: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let lines: Vec<Vec3> = guides.iter().map(|p| Vec3::from(p.map(f64::from))).collect();
    let control = ControlPose::from_polylines(&lines, full.points, full.points);
    let root: Vec<[f32; 3]> = all.iter().step_by(full.points).copied().collect();
    let hairs = Blend { root: &root, hair: &weights.hair, weight: &weights.weight, length: &full.length };
    let mut out = vec![[0.0; 3]; all.len()];
    blend(&hairs, &control, &mut out);
    out
}

fn distances(a: &[[f32; 3]], b: &[[f32; 3]]) -> impl Iterator<Item = f64> {
    let square = |(p, q): (&[f32; 3], &[f32; 3])| (0..3).map(|x| f64::from(p[x] - q[x]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(b).map(square)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(s, n), v| (s + v * v, n + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Median, RMS, 95th percentile and largest of some sizes.
fn spread(mut sizes: Vec<f64>) -> [f64; 4] {
    sizes.sort_by(f64::total_cmp);
    [sizes[sizes.len() / 2], rms(sizes.iter().copied()), sizes[sizes.len() * 95 / 100], sizes[sizes.len() - 1]]
}

fn compare(full: &Full, guides: &Guides) -> [f64; 9] {
    let weights = surround(full, &guides.id);
    let mm = full.millimetres;
    let of_length = |(p, d): (usize, f64)| d / f64::from(full.length[p / full.points]);
    let (mut all, mut relative, mut deep) = (Vec::new(), Vec::new(), f64::NAN);
    for (k, (own, truth)) in guides.position.iter().zip(&full.position).enumerate() {
        let found = followed(full, &weights, own, truth);
        let d: Vec<f64> = distances(&found, truth).collect();
        relative.push(rms(d.iter().copied().enumerate().map(of_length)));
        all.extend(d.iter().map(|d| d * mm));
        if k + 1 == full.frames.len() {
            deep = share_inside(full, &found);
        }
    }
    let rest = followed(full, &weights, &guides.rest, &full.rest);
    let rest = distances(&rest, &full.rest);
    let [median, r, p95, worst] = spread(all);
    let relative = 100.0 * rms(relative.into_iter());
    [guides.id.len() as f64, guides.seconds, median, r, p95, worst, relative, rms(rest) * mm, deep]
}

/// Share of the points, roots aside, that are [`DEEP`] in the skin at the last frame, percent.
fn share_inside(full: &Full, position: &[[f32; 3]]) -> f64 {
    let deep = DEEP * 1e3 / full.millimetres;
    let (body, points) = (&full.body, full.points);
    let inside = |(i, p): (usize, &[f32; 3])| {
        let closest = || body.closest(Vec3::from(p.map(f64::from)), f64::INFINITY);
        i % points != 0 && closest().is_some_and(|c| c.signed_distance < -deep)
    };
    let count = position.par_iter().enumerate().filter(|p| inside(*p)).count();
    100.0 * count as f64 / position.len() as f64
}

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let (folder, quick) = (bench.folder.to_path_buf(), bench.quick);
    let (project, reference) = (OnceCell::new(), OnceCell::new());
    let project = || shots::lazily(&project, || shot(&folder, quick));
    let reference = || shots::lazily(&reference, || full(project()?));
    let mut section = Section::new("Shares of the hairs", &COLUMNS)
        .says(
            "The sample bust shakes its head. All its hairs are simulated, then shares of them: the first of the \
             candidates, evenly spread, so that each share has the hairs of the smaller ones. The others are \
             interpolated as from simulated control hairs: each segment's direction is blended from the three guides \
             whose Delaunay triangle in texture space holds the root, none of them beyond a parting, and scaled to the \
             hair's own length. Every point is compared at every third frame with the same point of the hair where all \
             are simulated, before clumps and the like. No guide stands on the border of a chart, as control hairs do: along \
             seams this is worse than it must be.",
        )
        .says(
            "Processor seconds are those of the stage simulate, all threads added, the body's distance field included. \
             RMS at rest is what the guides lose of the groom before anything moves. In the rows of a part (the quick bench) the \
             shot has 6 % of its hairs and its first 4 frames.",
        );
    let shares: &[usize] = if quick { &QUICK_SHARES } else { &SHARES };
    for &share in shares {
        section.row(bench, &name(share, quick), || {
            let guides = simulated(&shots::thinned(project()?, 1.0 / share as f64), true)?;
            Ok(compare(reference()?, &guides))
        })?;
    }
    let mut steps = Section::new("The step's own error", &["median, mm", "RMS, mm", "95 %, mm", "worst, mm"]).says(
        "A sixteenth of the hairs once more with 64 steps a frame, each hair against itself with the steps that are \
         chosen by default: below this, more guides make no hair more right.",
    );
    let own = steps.row(bench, &format!("{}default-steps", part(quick)), || {
        let thin = shots::thinned(project()?, 1.0 / STEP_SHARE as f64);
        let mut fine = thin.clone();
        fine.shot.value.simulate.substeps = Some(FINE_STEPS);
        let (a, b) = (simulated(&thin, false)?, simulated(&fine, false)?);
        let mm = 1e3 * thin.shot.value.shot.meters_per_unit;
        let each = a.position.iter().zip(&b.position).flat_map(|(a, b)| distances(a, b));
        Ok(spread(each.map(|d| d * mm).collect()))
    })?;
    let pictured = [1, 16, 256];
    let file = bench.picture(if quick { "shares-part" } else { "shares" }, || {
        let full = reference()?;
        let each = pictured.map(|share| {
            let guides = simulated(&shots::thinned(project()?, 1.0 / share as f64), false)?;
            let at = full.frames.len() - 1;
            Ok(followed(full, &surround(full, &guides.id), &guides.position[at], &full.position[at]))
        });
        picture(full, project()?, quick, each.into_iter().collect::<Result<Vec<_>, Error>>()?)
    })?;
    let caption = "All hairs simulated, a 16th and a 256th of them, at the last frame, without clumps.";
    section.pictures.push((file, caption.to_owned()));
    section.plots = plots(&section, own[1]);
    let answers = answers(&section, own[1]);
    Ok(Findings { answers, sections: vec![section, steps] })
}

/// Name of the point of a share; the quick bench has another shot.
fn name(share: usize, quick: bool) -> String {
    format!("{}1-of-{share}", part(quick))
}

fn part(quick: bool) -> &'static str {
    if quick { "part/" } else { "" }
}

fn picture(full: &Full, project: &Project, quick: bool, each: Vec<Vec<[f32; 3]>>) -> Result<Vec<u8>, Error> {
    let mut progress = Progress::new(true);
    let mut run = Runner::new(project, shots::draft(), &mut progress)?;
    let mut look = crate::stage::export::look(&mut run, 0)?;
    // As wide as the whole groom would cover, where this is a part of it.
    let wider = if quick { 1.0 / QUICK } else { 1.0 };
    look.width.iter_mut().for_each(|w| *w *= wider as f32);
    let origin = run.origin()?;
    look.rest = each[0].clone();
    let camera = shots::camera(std::slice::from_ref(&look), origin, [0.3, 0.1, 1.0], 420.0 / 480.0);
    let names = ["all", "1 of 16", "1 of 256"];
    let views: Vec<(&SkinPose, HairView<'_>, &str)> = each
        .iter()
        .zip(names)
        .map(|(p, name)| (&*full.pose, HairView { position: p, ..shots::view(&look, origin) }, name))
        .collect();
    Ok(shots::side_by_side(&full.skin, &views, &camera))
}

fn plots(section: &Section, step: f64) -> Vec<String> {
    let rows = || section.rows.iter().skip(1).map(|(_, v)| v);
    let plot = |title: &str, axis: &str, x: &dyn Fn(&Vec<f64>) -> f64| {
        let of = |name: &str, k: usize| Series::new(name, rows().map(|v| [x(v), v[k]]).collect());
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        let ends = rows().fold(ends, |[a, b], v| [a.min(x(v)), b.max(x(v))]);
        let level = |name: &str, y: f64| Series { guide: true, ..Series::new(name, ends.map(|x| [x, y]).to_vec()) };
        let series = vec![
            of("median", 2),
            of("RMS", 3),
            of("95 %", 4),
            of("worst", 5),
            of("RMS at rest", 7),
            level("error of the steps", step),
            level("a hair's diameter", HAIR),
        ];
        Plot { title, axes: [axis, "distance to the full run, mm"], log: [true, true], series }.svg()
    };
    let all = section.rows.first().map_or(f64::NAN, |(_, v)| v[0]);
    vec![
        plot("Guides: error against the share simulated", "share of the hairs simulated", &|v| v[0] / all),
        plot("Guides: error against time", "processor seconds of the simulation", &|v| v[1]),
    ]
}

/// Diameter of the sample's hairs, mm.
const HAIR: f64 = 0.32;

fn answers(section: &Section, step: f64) -> Vec<String> {
    let row =
        |share: usize| section.rows.iter().find(|(n, _)| n.ends_with(&name(share, false))).map(|(_, v)| v.clone());
    let (Some(all), Some(some), Some(few)) = (row(1), row(16), row(256)) else { return Vec::new() };
    let below = |k: usize, limit: f64| {
        let found = section.rows.iter().skip(1).rfind(|(_, v)| v[k] <= limit);
        found.map_or("no share measured".to_owned(), |(n, _)| n.replace('-', " "))
    };
    vec![
        format!(
            "Simulating 1 hair of 16 takes {:.0} % of the time and leaves points {:.1} mm RMS ({:.1} % of the hair's length; \
             half of them under {:.2} mm, the worst {:.0} mm) from where they would be; 1 of 256 takes {:.1} % and leaves \
             {:.1} mm. At rest, before anything moves, {:.1} and {:.1} mm are lost already: what is groomed between the guides.",
            100.0 * some[1] / all[1],
            some[3],
            some[6],
            some[2],
            some[5],
            100.0 * few[1] / all[1],
            few[3],
            some[7],
            few[7]
        ),
        format!(
            "The RMS error of guides is below that of the default steps ({step:.2} mm) with {}, half of the points are within a \
             hair's diameter ({HAIR} mm) with {}. Where neighbours part at a contact no share is safe, so by default every \
             hair is simulated.",
            below(3, step),
            below(2, HAIR)
        ),
    ]
}
