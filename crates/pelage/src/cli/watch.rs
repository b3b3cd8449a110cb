//! `pelage preview --watch`: the artist's loop. Draws the still again whenever an input changes, with few hairs first.
//!
//! Files are looked at a few times a second: by size and time, then by content. What is drawn is decided by the still's
//! recipe, so that a comment costs nothing. An edit ends the work on the picture before it.

use super::{PreviewArguments, preview, print, run};
use crate::Error;
use crate::cache::Key;
use crate::progress::Progress;
use crate::project::Project;
use crate::stage::{Options, Plan, Runner, Stage, What};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Time between two looks at the files. A second is felt; a tenth of this keeps a network disk busy.
const POLL: Duration = Duration::from_millis(300);

/// Files must stay as they are for so long before they are read: a program that saves in several writes is done by then.
const SETTLE: Duration = Duration::from_millis(150);

/// Percentage of the hairs of a draft where none is given.
const DRAFT: f64 = 10.0;

/// Size and time of files and folders; `None` for one that is not there.
type Stamps = BTreeMap<PathBuf, Option<(u64, Option<SystemTime>)>>;

fn stamps<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Stamps {
    let stamp = |f: &PathBuf| f.metadata().ok().map(|m| (m.len(), m.modified().ok()));
    files.into_iter().map(|f| (f.clone(), stamp(f))).collect()
}

/// Stamps of the same files after they have stopped changing.
fn settled(before: &Stamps) -> Stamps {
    let mut last = stamps(before.keys());
    loop {
        std::thread::sleep(SETTLE);
        let now = stamps(before.keys());
        if now == last {
            return now;
        }
        last = now;
    }
}

/// The shot as it stands on disk.
struct Seen {
    project: Project,
    /// Everything that the still reads, and where it goes.
    picture: (Key, PathBuf),
    /// Content hash of every input, by its label.
    inputs: BTreeMap<String, String>,
}

impl Seen {
    fn read(shot: &Path) -> Result<Seen, Error> {
        let project = Project::open(shot)?;
        let key = Plan::new(&project).step(What::Still).key.clone();
        let text = |path: &Path, text: &str| (project.label(path), blake3::hash(text.as_bytes()).to_hex().to_string());
        let mut inputs: BTreeMap<String, String> =
            project.inputs().into_iter().map(|f| (f.label.clone(), f.hash.clone())).collect();
        inputs.extend(project.groom.files().chain(project.shot.files()).map(|(p, t)| text(p, t)));
        Ok(Seen { picture: (key, project.out_dir()), inputs, project })
    }

    /// Every input file, and the folders they are in: a new tile of a map or frame of a skin changes those.
    fn files(&self) -> BTreeSet<PathBuf> {
        let p = &self.project;
        let mut files: BTreeSet<PathBuf> = p.inputs().into_iter().map(|f| f.path.clone()).collect();
        files.extend(p.groom.files().chain(p.shot.files()).map(|(p, _)| p.to_path_buf()));
        let folder = |f: &PathBuf| f.parent().map(|f| if f == Path::new("") { ".".into() } else { f.to_path_buf() });
        let folders: Vec<PathBuf> = files.iter().filter_map(folder).collect();
        files.extend(folders);
        files
    }
}

/// What was changed, added and taken out between two looks.
fn changes(before: &BTreeMap<String, String>, now: &BTreeMap<String, String>) -> Vec<String> {
    let come = now.iter().filter_map(|(label, hash)| match before.get(label) {
        Some(old) if old == hash => None,
        Some(_) => Some(format!("{label} changed")),
        None => Some(format!("{label} is new")),
    });
    let gone =
        before.keys().filter(|label| !now.contains_key(*label)).map(|label| format!("{label} is no input any more"));
    come.chain(gone).collect()
}

/// Draws the still, and again after every edit, until the process is ended.
pub fn watch(a: &PreviewArguments) -> Result<bool, Error> {
    run::threads(a.run.jobs)?;
    let shot = a.run.shot.as_path();
    let talk = Progress::new(a.run.quiet);
    let mut known = stamps([&shot.to_path_buf()]);
    if known.values().all(Option::is_none) {
        return Project::open(shot).map(|_| true);
    }
    let mut inputs: Option<BTreeMap<String, String>> = None;
    let (mut drawn, mut complaint) = (None, String::new());
    loop {
        let seen = match Seen::read(shot) {
            Ok(seen) => seen,
            // Looked at again and again: what is wrong may be a file that is not among those known.
            Err(e) => {
                tell(&mut complaint, &e);
                std::thread::sleep(POLL);
                known = settled(&known);
                continue;
            }
        };
        // Where a file was known before it was read, its older stamp counts: what changes meanwhile is seen.
        let before = std::mem::replace(&mut known, stamps(&seen.files()));
        known.iter_mut().for_each(|(file, stamp)| *stamp = before.get(file).copied().unwrap_or(*stamp));
        if inputs.is_none() {
            talk.say(&format!("watching {} files; Ctrl-C ends it", seen.inputs.len()));
        }
        let changed = inputs.as_ref().map(|before| changes(before, &seen.inputs)).unwrap_or_default();
        changed.iter().for_each(|line| talk.say(line));
        if drawn.as_ref() != Some(&seen.picture) {
            drawn = None;
            match draw_unless_overtaken(a, &seen, &known) {
                Ok(()) => (drawn, complaint) = (Some(seen.picture.clone()), String::new()),
                Err(Error::Stopped) => {}
                Err(e) => tell(&mut complaint, &e),
            }
        } else if !changed.is_empty() || !complaint.is_empty() {
            complaint.clear();
            talk.say("nothing in the picture changes");
        }
        inputs = Some(seen.inputs);
        while stamps(known.keys()) == known {
            std::thread::sleep(POLL);
        }
        known = settled(&known);
    }
}

/// Says what is wrong, once.
fn tell(complaint: &mut String, e: &Error) {
    let report = e.report();
    if *complaint != report {
        crate::progress::print_line(&report);
        *complaint = report;
    }
}

/// Draws the draft and then the full picture; gives up with [`Error::Stopped`] when the inputs ask for another one.
fn draw_unless_overtaken(a: &PreviewArguments, seen: &Seen, known: &Stamps) -> Result<(), Error> {
    let (stop, ended) = (Arc::new(AtomicBool::new(false)), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let looking = scope.spawn(|| look(&a.run.shot, seen, known.clone(), &stop, &ended));
        let result = draw(a, &seen.project, &stop);
        ended.store(true, Ordering::Relaxed);
        looking.thread().unpark();
        result
    })
}

/// Sets `stop` when another picture is asked for than that of `seen`.
fn look(shot: &Path, seen: &Seen, mut known: Stamps, stop: &AtomicBool, ended: &AtomicBool) {
    loop {
        std::thread::park_timeout(POLL);
        if ended.load(Ordering::Relaxed) {
            return;
        }
        if stamps(known.keys()) == known {
            continue;
        }
        known = settled(&known);
        // A broken file stops nothing: the picture before it is still the best there is.
        if Seen::read(shot).is_ok_and(|now| now.picture != seen.picture) {
            stop.store(true, Ordering::Relaxed);
            return;
        }
    }
}

fn draw(a: &PreviewArguments, project: &Project, stop: &Arc<AtomicBool>) -> Result<(), Error> {
    let mut progress = Progress::stoppable(a.run.quiet, stop.clone());
    let frames = Some([project.still_frame()].into());
    let options = Options { frames, without: Some(Stage::Export), ..Options::default() };
    let planned = Runner::new(project, options.clone(), &mut progress)?.planned();
    let to_run = |stage: Stage| planned.iter().find(|p| p.name == stage.name()).map_or(0, |p| p.run.len());
    let percent = a.hairs.unwrap_or(DRAFT);
    let name = if a.crop.is_some() { "preview-crop.png" } else { "preview.png" };
    let timed = |what: &str, started: Instant, line: &str| {
        print(&format!("{what} in {:.1} s: {line}\n", started.elapsed().as_secs_f64()));
    };
    let is_drawn = a.crop.is_none() && to_run(Stage::Preview) == 0;
    if percent < 100.0 && !is_drawn {
        if to_run(Stage::Simulate) > 0 {
            progress.say("hair has to be simulated: the draft's first, then all of it");
        }
        let (started, wanted) = (Instant::now(), preview::wanted(a, percent));
        // Under the still's own name, so that an open viewer shows it. The still counts as drawn only with its receipt.
        let path = preview::draw(project, &wanted, name, Options::default(), &mut progress)?.0;
        timed("draft", started, &preview::said(project, &wanted, &path));
    }
    let (started, wanted) = (Instant::now(), preview::wanted(a, 100.0));
    let (path, report) = if a.crop.is_some() {
        preview::draw(project, &wanted, name, Options::default(), &mut progress)?
    } else {
        (project.out_dir().join(name), Runner::new(project, options, &mut progress)?.run()?)
    };
    run::keep(project, &report)?;
    timed("full", started, &preview::said(project, &wanted, &path));
    Ok(())
}
