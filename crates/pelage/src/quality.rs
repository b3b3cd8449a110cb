//! Settings of the simulation chosen by what they cost and how exact they are in the shot at hand: `simulate.quality`.
//!
//! A few hairs of each layer are simulated over the whole shot with different settings, and compared with a much finer run of
//! the same hairs. The cheapest settings that keep the budget are written beside the shot file, once; they, not the budget,
//! enter the keys. Deleting that file, or changing the budget, chooses again.

use crate::Error;
use crate::config::{Quality, Target};
use crate::files::write_whole;
use crate::progress::Progress;
use crate::project::Project;
use crate::report::Report;
use crate::stage::{Options, Plan, Runner, Stage, simulate};
use pelage_geom::Vec3;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Hairs of a layer that are tried. With a quarter of it the median moves by a fifth from one choice of hairs to the next.
const TRIED: f64 = 64.0;
/// Settings that are tried, in the order of their cost.
const SUBSTEPS: [u32; 6] = [1, 2, 4, 8, 16, 32];
const SEGMENTS: [usize; 6] = [6, 9, 13, 18, 25, 40];
const TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];
/// Those of the run that others are compared with: its own error is a fourth or less of the finest that is tried.
const REFERENCE: Choice = Choice { substeps: 64, segments: 80, tolerance: 1e-8 };
/// Those that are varied one at a time.
const MIDDLE: Choice = Choice { substeps: 8, segments: 25, tolerance: 1e-5 };
/// Guesses that are measured before what comes nearest is taken.
const MOST_GUESSES: usize = 6;
/// Places along a hair at which it is compared.
const PLACES: usize = 16;

/// Concrete settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Steps in a frame.
    pub substeps: u32,
    /// Segments of a hair.
    pub segments: usize,
    /// Change of an edge's direction at which iterations end, radians.
    pub tolerance: f64,
}

/// What was chosen, as it is written beside the shot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resolved {
    /// The budget that it was chosen for.
    pub budget: String,
    /// Hash of the shot that it was chosen in, apart from these settings.
    pub shot: String,
    /// The settings.
    pub settings: Choice,
    /// What they were found to give.
    pub estimate: Estimate,
}

/// What settings give in a shot, by a few of its hairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimate {
    /// Of each hair at each frame the root of the mean square distance to a much finer run; of these the median, millimetres.
    pub error_mm: f64,
    /// The 95th percentile.
    pub error_p95_mm: f64,
    /// Seconds of simulation a frame on the threads of the machine that chose.
    pub seconds_per_frame: f64,
}

/// The file beside a shot file that says what was chosen.
pub fn file_of(shot: &Path) -> PathBuf {
    shot.with_extension("quality.toml")
}

/// What was chosen for a budget, if it was.
pub fn resolved(shot: &Path, budget: &Quality) -> Result<Option<Resolved>, Error> {
    let path = file_of(shot);
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(None) };
    let found: Resolved = toml::from_str(&text).map_err(|e| {
        let what = format!("{}: {}", path.display(), e.message());
        Error::input(what, "delete it, and settings are chosen again")
    })?;
    let Choice { substeps, segments, tolerance } = found.settings;
    if !(1..=1_000_000).contains(&substeps) || !(1..=4095).contains(&segments) || !(1e-12..=0.1).contains(&tolerance) {
        let what = format!("{}: settings are out of range", path.display());
        return Err(Error::input(what, "delete it, and settings are chosen again"));
    }
    Ok((found.budget == budget.to_string()).then_some(found))
}

/// Hash of what is simulated, apart from the settings that a budget chooses.
fn shot_hash(project: &Project) -> String {
    let mut plain = project.clone();
    let s = &mut plain.shot.value.simulate;
    (s.segments, s.substeps, s.tolerance) = (None, None, None);
    let plan = Plan::new(&plain);
    let keys = plan.steps.iter().filter(|s| s.stage == Stage::Simulate).map(|s| s.key.0.as_str());
    blake3::hash(keys.collect::<String>().as_bytes()).to_hex()[..16].to_owned()
}

/// Opens a shot; where it has a budget that nothing was chosen for yet, chooses first.
pub fn open(shot: &Path, progress: &mut Progress) -> Result<Project, Error> {
    let project = Project::open(shot)?;
    let Some(budget) = project.shot.value.simulate.quality else { return Ok(project) };
    if (0..project.groom.value.layer.len()).all(|i| project.target(i) == Target::Off) {
        let help = "simulate something, or take it out";
        return Err(project.shot.error("simulate.quality", "nothing is simulated in this shot", help).into());
    }
    if let Some(chosen) = &project.quality {
        if chosen.shot != shot_hash(&project) {
            let file = project.label(&file_of(shot));
            progress.say(&format!(
                "note: {file} was chosen before the shot was edited: its settings are used, its estimates may be off; delete it to \
                 choose again"
            ));
        }
        return Ok(project);
    }
    let chosen = choose(&project, &budget, progress)?;
    let path = file_of(shot);
    let text = format!(
        "# Chosen by measuring a few hairs of this shot. Delete this file to choose again.\n{}",
        toml::to_string(&chosen).expect("plain TOML")
    );
    write_whole(&path, |f| f.write_all(text.as_bytes())).map_err(Error::disk(&path))?;
    Project::open(shot)
}

/// A run of the tried hairs.
struct Trial {
    /// Of each hair at each frame, places along it, scene units.
    line: Vec<Vec<Vec3>>,
    /// Points times steps.
    work: f64,
    cpu_s: f64,
}

fn choose(project: &Project, budget: &Quality, progress: &mut Progress) -> Result<Resolved, Error> {
    let folder = project.cache_dir().join("quality");
    let found = search(project, budget, &folder, progress);
    let _ = std::fs::remove_dir_all(&folder);
    found
}

fn search(project: &Project, budget: &Quality, folder: &Path, progress: &mut Progress) -> Result<Resolved, Error> {
    let (pilot, whole) = pilot(project, folder, progress)?;
    progress.begin("quality", SUBSTEPS.len() + SEGMENTS.len() + TOLERANCES.len());
    progress.working("the reference");
    let reference = run(&pilot, &REFERENCE)?;
    let parallel = project.frames.len() as f64 * rayon::current_num_threads() as f64;
    let rate = reference.cpu_s / reference.work.max(1.0) * whole / parallel;
    let millimetres = 1e3 * project.shot.value.shot.meters_per_unit;
    let mut search = Search { pilot, reference, rate, millimetres, found: Vec::new(), progress };
    for choice in axes().concat() {
        search.measure(&choice)?;
    }
    // What a budget is of, over it; and what is to be as small as can be.
    let against = |e: &Estimate| match budget {
        Quality::Error(mm) => e.error_mm / mm,
        Quality::Seconds(s) => e.seconds_per_frame / s,
    };
    let price = |e: &Estimate| match budget {
        Quality::Error(_) => e.seconds_per_frame,
        Quality::Seconds(_) => e.error_mm,
    };
    // Those that keep the budget by their price, then the others by how far they are from it.
    let mut guesses = guesses(&search.found);
    let rank = |e: &Estimate| if against(e) <= 1.0 { (false, price(e)) } else { (true, against(e)) };
    guesses.sort_by(|a, b| {
        let (a, b) = (rank(&a.1), rank(&b.1));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    // The best guess is measured; where it does not keep the budget the next best is.
    let mut chosen = None;
    for (choice, _) in guesses.iter().take(MOST_GUESSES) {
        let estimate = search.measure(choice)?;
        if against(&estimate) <= 1.0 {
            chosen = Some((*choice, estimate));
            break;
        }
    }
    let Search { found, progress, .. } = search;
    let (settings, estimate) = chosen.unwrap_or_else(|| {
        progress.say(&format!("warning: simulate.quality = {budget} is out of reach: what comes nearest is taken"));
        *found.iter().min_by(|a, b| against(&a.1).total_cmp(&against(&b.1))).expect("some were measured")
    });
    progress.end(&format!(
        "{} substeps, {} segments, tolerance {:e}: median error {:.3} mm (95 %: {:.3} mm), about {:.2} s a frame",
        settings.substeps,
        settings.segments,
        settings.tolerance,
        estimate.error_mm,
        estimate.error_p95_mm,
        estimate.seconds_per_frame
    ));
    Ok(Resolved { budget: budget.to_string(), shot: shot_hash(project), settings, estimate })
}

/// What is tried of each setting, with the others in the middle.
fn axes() -> [Vec<Choice>; 3] {
    [
        SUBSTEPS.map(|substeps| Choice { substeps, ..MIDDLE }).to_vec(),
        SEGMENTS.map(|segments| Choice { segments, ..MIDDLE }).to_vec(),
        TOLERANCES.map(|tolerance| Choice { tolerance, ..MIDDLE }).to_vec(),
    ]
}

/// What all combinations should give, by what was measured along the axes: errors of different causes add up as squares, costs as
/// factors.
fn guesses(found: &[(Choice, Estimate)]) -> Vec<(Choice, Estimate)> {
    let known = |choice: &Choice| found.iter().find(|f| f.0 == *choice).expect("measured").1;
    let middle = known(&MIDDLE);
    let [steps, segments, tolerances] = axes();
    let mut out = Vec::new();
    for a in &steps {
        for b in &segments {
            for c in &tolerances {
                let of = [known(a), known(b), known(c)];
                let sum = |value: fn(&Estimate) -> f64| {
                    let squares: f64 = of.iter().map(|e| value(e) * value(e)).sum();
                    // The middle is in all three.
                    (squares - 2.0 * value(&middle) * value(&middle)).max(0.0).sqrt()
                };
                let factor: f64 = of.iter().map(|e| e.seconds_per_frame / middle.seconds_per_frame).product();
                let estimate = Estimate {
                    error_mm: sum(|e| e.error_mm),
                    error_p95_mm: sum(|e| e.error_p95_mm),
                    seconds_per_frame: factor * middle.seconds_per_frame,
                };
                out.push((Choice { substeps: a.substeps, segments: b.segments, tolerance: c.tolerance }, estimate));
            }
        }
    }
    out
}

/// What was measured so far.
struct Search<'a> {
    pilot: Project,
    reference: Trial,
    /// Seconds a frame of the whole shot for a point and step of the tried hairs.
    rate: f64,
    /// In a scene unit.
    millimetres: f64,
    found: Vec<(Choice, Estimate)>,
    progress: &'a mut Progress,
}

impl Search<'_> {
    fn measure(&mut self, choice: &Choice) -> Result<Estimate, Error> {
        if let Some((_, known)) = self.found.iter().find(|f| f.0 == *choice) {
            return Ok(*known);
        }
        let Choice { substeps, segments, tolerance } = choice;
        self.progress.working(&format!("{substeps} substeps, {segments} segments, tolerance {tolerance:e}"));
        let trial = run(&self.pilot, choice)?;
        let [error_mm, error_p95_mm] = errors(&trial, &self.reference).map(|e| e * self.millimetres);
        let estimate = Estimate { error_mm, error_p95_mm, seconds_per_frame: self.rate * trial.work };
        self.found.push((*choice, estimate));
        self.progress.step();
        Ok(estimate)
    }
}

/// The shot with few hairs in a cache of its own, and how many times as many it has.
fn pilot(project: &Project, folder: &Path, progress: &mut Progress) -> Result<(Project, f64), Error> {
    let options = Options { to: Some(Stage::Instance), ..Options::default() };
    let report = Runner::new(project, options, progress)?.run()?;
    let count = |name: &str| -> f64 {
        let counts = report.stages.iter().flat_map(|s| &s.counts);
        let of =
            |kind: &str| counts.clone().find(|c| c.0 == &format!("hairs {kind} in layer {name}").replace("  ", " "));
        of("needed").or(of("")).map_or(0.0, |c| *c.1 as f64)
    };
    let mut out = project.clone();
    out.shot.value.cache.dir = folder.to_path_buf();
    out.shot.value.skip = Default::default();
    let (mut all, mut few) = (0.0, 0.0);
    for (i, (layer, share)) in out.groom.value.layer.iter_mut().zip(&mut out.share).enumerate() {
        if project.target(i) != Target::EveryHair {
            continue;
        }
        let hairs = count(&layer.name);
        *share = (TRIED / hairs.max(1.0)).min(1.0);
        layer.density.value *= *share;
        (all, few) = (all + hairs, few + hairs * *share);
    }
    Ok((out, if few > 0.0 { all / few } else { 1.0 }))
}

/// Simulates the tried hairs with some settings.
fn run(pilot: &Project, choice: &Choice) -> Result<Trial, Error> {
    let mut project = pilot.clone();
    let s = &mut project.shot.value.simulate;
    (s.substeps, s.segments, s.tolerance) = (Some(choice.substeps), Some(choice.segments), Some(choice.tolerance));
    let mut silent = Progress::new(true);
    let options = Options { to: Some(Stage::Simulate), draft: true, ..Options::default() };
    let mut runner = Runner::new(&project, options, &mut silent)?;
    let report: Report = runner.run()?;
    let stage = report.stages.iter().find(|s| s.name == Stage::Simulate.name());
    let mut line = Vec::new();
    for i in (0..project.groom.value.layer.len()).filter(|i| project.target(*i) != Target::Off) {
        let points = choice.segments + 1;
        for frame in project.frames.keys() {
            let position = simulate::positions(&mut runner, i, *frame)?;
            line.extend(position.chunks(points).map(places));
        }
    }
    let work = stage.and_then(|s| s.counts.get("particle steps")).copied().unwrap_or(0) as f64;
    Ok(Trial { line, work, cpu_s: stage.map_or(0.0, |s| s.cpu_s) })
}

/// Points at even places along a hair of equal segments.
fn places(hair: &[[f32; 3]]) -> Vec<Vec3> {
    let at = |k: usize| {
        let x = k as f64 / PLACES as f64 * (hair.len() - 1) as f64;
        let i = (x as usize).min(hair.len() - 2);
        let [a, b] = [hair[i], hair[i + 1]].map(|p| Vec3::from(p.map(f64::from)));
        a + (b - a) * (x - i as f64)
    };
    (1..=PLACES).map(at).collect()
}

/// Of each hair at each frame the root of the mean square distance; of these the median and the 95th percentile, scene units.
fn errors(a: &Trial, b: &Trial) -> [f64; 2] {
    let mut each: Vec<f64> = a
        .line
        .iter()
        .zip(&b.line)
        .map(|(p, q)| {
            let sum: f64 = p.iter().zip(q).map(|(p, q)| (p - q).norm_squared()).sum();
            (sum / PLACES as f64).sqrt()
        })
        .collect();
    each.sort_by(f64::total_cmp);
    let at = |q: f64| each.get(((each.len() as f64 - 1.0) * q).round() as usize).copied().unwrap_or(0.0);
    [at(0.5), at(0.95)]
}
