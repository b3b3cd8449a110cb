//! `pelage run`, `pelage plan`, `pelage preview`.

use super::{PreviewArguments, RunArguments, print};
use crate::Error;
use crate::config::ExportFormat;
use crate::files::write_whole;
use crate::progress::Progress;
use crate::project::Project;
use crate::quality;
use crate::report::{Report, Skipped};
use crate::stage::{Options, Pictures, PlannedStage, Runner, Stage};
use std::io::Write;

fn options(a: &RunArguments) -> Options {
    Options { to: a.to, frames: a.frames.as_ref().map(|f| f.0.clone()), force: a.force, ..Options::default() }
}

/// Sets the number of threads. Results do not depend on it.
pub(super) fn threads(jobs: Option<u16>) -> Result<(), Error> {
    let Some(jobs) = jobs else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(jobs)).build_global();
    pool.map_err(|e| Error::input(format!("--jobs {jobs}: {e}"), "give fewer"))
}

/// Brings a shot up to date.
pub fn run(a: RunArguments) -> Result<bool, Error> {
    threads(a.jobs)?;
    let project = quality::open(&a.shot, &mut Progress::new(a.quiet))?;
    let options = options(&a);
    bring(&a, &project, options)
}

/// Makes the still and the contact sheet of a shot, or a sequence, or a turntable, and what they need; no files.
pub fn pictures(a: &PreviewArguments) -> Result<bool, Error> {
    threads(a.run.jobs)?;
    let project = quality::open(&a.run.shot, &mut Progress::new(a.run.quiet))?;
    let (still, sheet) = (project.still_frame(), project.sheet_frames());
    let all = options(&a.run);
    let (pictures, frames) = if a.sequence {
        let drawn = all.frames.clone().unwrap_or_else(|| project.frames.keys().copied().collect());
        let framed = if project.shot.value.preview.camera.is_none() { sheet } else { Vec::new() };
        let frames = drawn.iter().copied().chain(framed).collect();
        (Pictures::Sequence(drawn), frames)
    } else if a.turntable {
        if project.shot.value.skip.camera {
            let text = "note: hair that the shot's camera does not see is left out (skip.camera): it is missing from other sides";
            crate::progress::print_line(text);
        }
        (Pictures::Turntable, [still].into())
    } else {
        (Pictures::Sheet, all.frames.clone().unwrap_or_else(|| sheet.into_iter().chain([still]).collect()))
    };
    bring(&a.run, &project, Options { pictures, frames: Some(frames), without: Some(Stage::Export), ..all })
}

fn bring(a: &RunArguments, project: &Project, options: Options) -> Result<bool, Error> {
    let mut progress = Progress::new(a.quiet);
    let mut runner = Runner::new(project, options, &mut progress)?;
    let report = runner.run()?;
    drop(runner);
    keep(project, &report)?;
    for name in leftovers(project) {
        progress.say(&format!("note: {name} in the output folder is of an earlier run: its format is not asked for"));
    }
    print(&match (a.json, a.explain_skips) {
        (true, _) => report.json(),
        (false, false) => summary(&report, project),
        (false, true) => summary(&report, project) + &explained(&report.skips),
    });
    Ok(true)
}

/// Writes the report of a run that did something beside its results.
pub(super) fn keep(project: &Project, report: &Report) -> Result<(), Error> {
    if report.ran() == 0 {
        return Ok(());
    }
    let out = project.out_dir();
    std::fs::create_dir_all(&out).map_err(Error::disk(&out))?;
    let path = out.join("report.json");
    write_whole(&path, |f| f.write_all(report.json().as_bytes())).map_err(Error::disk(&path))
}

/// Whole-shot files in the output folder that the shot does not ask for any more.
fn leftovers(project: &Project) -> Vec<&'static str> {
    let formats = &project.shot.value.export.formats;
    let files = [(ExportFormat::Usd, "hair.usdc"), (ExportFormat::Mcap, "hair.mcap")];
    let left =
        files.into_iter().filter(|(format, name)| !formats.contains(format) && project.out_dir().join(name).exists());
    left.map(|(_, name)| name).collect()
}

fn summary(report: &Report, project: &Project) -> String {
    if report.ran() == 0 {
        let reused: usize = report.stages.iter().map(|s| s.reused).sum();
        return format!("nothing to do: all {reused} steps are up to date\n");
    }
    let mut out = String::new();
    for s in &report.stages {
        let counts: Vec<String> = s.counts.iter().filter(|(_, n)| **n > 0).map(|(k, n)| format!("{n} {k}")).collect();
        let line = format!("{:<12} {:>4} ran {:>4} reused  {}", s.name, s.ran, s.reused, counts.join(", "));
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out.push_str(&format!("results in {}\n", project.label(&project.out_dir())));
    out
}

/// What was skipped, as a table.
fn explained(skips: &[Skipped]) -> String {
    let mut out = String::from("not computed:\n");
    for s in skips {
        let saved = s.saved_s.map_or("-".to_owned(), |t| format!("{t:.1} s"));
        let share = 100.0 * s.count as f64 / s.of.max(1) as f64;
        out += &format!(
            "  {:<12} {:<46} {:>9} of {:<9} ({share:3.0} %)  saved about {saved:>9}  error: {}\n",
            s.stage, s.what, s.count, s.of, s.error
        );
    }
    out
}

/// Says what would run, and why.
pub fn plan(a: RunArguments) -> Result<bool, Error> {
    let project = Project::open(&a.shot)?;
    if let Some(budget) = project.shot.value.simulate.quality.filter(|_| project.quality.is_none()) {
        let text =
            format!("note: nothing is chosen for simulate.quality = {budget} yet: this is the plan of the defaults");
        crate::progress::print_line(&text);
    }
    let mut progress = Progress::new(true);
    let planned = Runner::new(&project, options(&a), &mut progress)?.planned();
    if a.json {
        print(&(serde_json::to_string_pretty(&planned).expect("plain JSON") + "\n"));
    } else if planned.iter().all(|s| s.run.is_empty()) {
        print("nothing to do\n");
    } else {
        print(&planned.iter().map(describe).collect::<String>());
    }
    Ok(true)
}

fn describe(stage: &PlannedStage) -> String {
    let mut out = format!("{:<12} {:>4} steps to run {:>4} reused\n", stage.name, stage.run.len(), stage.reused);
    for reason in &stage.reasons {
        out.push_str(&format!("{:<12}   because {reason}\n", ""));
    }
    let shown = stage.run.iter().take(8).map(String::as_str).collect::<Vec<_>>().join(", ");
    if !stage.run.is_empty() {
        let more = if stage.run.len() > 8 { ", ..." } else { "" };
        out.push_str(&format!("{:<12}   {shown}{more}\n", ""));
    }
    out
}
