//! Brings a shot up to date: walks the plan, runs what is not in the cache, and says why.

use super::explain::Seconds;
use super::plan_light::is_shadowed;
use super::{Plan, Stage, Step, What, reasons, skin};
use crate::Error;
use crate::cache::{Entry, FileHashes, Recipe, Store};
use crate::config::MapRef;
use crate::progress::Progress;
use crate::project::{Project, SkinAt, frame_list};
use crate::report::{Report, StageReport, cpu_seconds, peak_bytes};
use crate::timeline::Timeline;
use pelage_geom::TiledMap;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::rc::Rc;
use std::time::Instant;

/// Counts by name, as a step reports them.
pub type Counts = BTreeMap<String, u64>;

/// What to bring up to date.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Last stage; all if none.
    pub to: Option<Stage>,
    /// Frames; all if none.
    pub frames: Option<BTreeSet<i32>>,
    /// A stage that runs again whether its results are there or not.
    pub force: Option<Stage>,
    /// A stage to leave out.
    pub without: Option<Stage>,
    /// Pictures to make.
    pub pictures: Pictures,
    /// This is not the shot itself but a thinned one (see [`Project::thinned`]): what it does is not remembered as the
    /// shot's last run, and what is odd in it is told when the shot itself runs.
    pub draft: bool,
}

/// Pictures of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Pictures {
    /// The still.
    #[default]
    Still,
    /// The still and the contact sheet.
    Sheet,
    /// These frames.
    Sequence(BTreeSet<i32>),
    /// The still's frame from all sides.
    Turntable,
}

impl Pictures {
    /// True if a picture of a frame is drawn.
    fn show(&self, project: &Project, frame: i32) -> bool {
        match self {
            Pictures::Sequence(frames) => frames.contains(&frame),
            Pictures::Sheet if project.sheet_frames().contains(&frame) => true,
            _ => frame == project.still_frame(),
        }
    }
}

/// What would run in a stage, and why.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct PlannedStage {
    /// Name of the stage.
    pub name: String,
    /// Steps that would run, by name.
    pub run: Vec<String>,
    /// Steps found finished.
    pub reused: usize,
    /// What changed since the last run.
    pub reasons: Vec<String>,
}

/// A run over one shot: the plan, the cache, and what has been read so far.
pub struct Runner<'a> {
    /// The shot.
    pub project: &'a Project,
    /// Its steps.
    pub plan: Plan,
    /// The cache.
    pub store: Store,
    /// Warnings of the stage that runs.
    pub warnings: Vec<String>,
    pub(super) skin: Option<Rc<skin::Skin>>,
    /// Where the skin was last, and its pose there.
    pub(super) pose: Option<(SkinAt, Rc<skin::SkinPose>)>,
    pub(super) roots: BTreeMap<usize, Rc<pelage_groom::instance::Roots>>,
    pub(super) layers: BTreeMap<usize, Rc<super::interpolate::LayerHairs>>,
    pub(super) sites: BTreeMap<usize, Rc<super::clumps::RestSites>>,
    pub(super) members: BTreeMap<(usize, usize), Rc<pelage_groom::look::member::Members>>,
    pub(super) looks: BTreeMap<(usize, bool), Rc<super::look::LayerLook>>,
    /// With the frame that they are of, where they move.
    pub(super) lines: BTreeMap<(usize, bool), (Option<i32>, Rc<super::look::CarriedLines>)>,
    /// Clusters of the groom: at rest, and at the last frame that was asked for where they move.
    pub(super) tree: Vec<(Option<i32>, std::sync::Arc<pelage_groom::cluster::Tree>)>,
    pub(super) barrier: Option<Rc<super::look::Barrier>>,
    /// Particles of emitters that have a file.
    pub(super) particles: BTreeMap<usize, Rc<Vec<pelage_groom::areas::Particle>>>,
    /// What stands in the light at the frame whose shadows were made last.
    pub(super) scene: Option<(i32, Rc<super::shadow::Scene>)>,
    pub(super) props: Option<Rc<Vec<super::shadow::Prop>>>,
    pub(super) hits: Option<(i32, Rc<super::areas::Hits>)>,
    /// The camera that frames the hairs of some frames.
    pub(super) camera: Option<(Vec<i32>, pelage_light::Camera)>,
    /// The camera of the turntable at its beginning, and a point of the line that it goes round.
    pub(super) turning: Option<(pelage_light::Camera, [f64; 3])>,
    pub(super) placed: Option<pelage_groom::control::ControlHairs>,
    pub(super) control: Option<Rc<pelage_groom::control::ControlHairs>>,
    /// Control hairs of the frame that was last asked for.
    pub(super) control_at: Option<(i32, Rc<pelage_groom::control::ControlHairs>)>,
    pub(super) curves: Option<Rc<super::curves::CurveHair>>,
    pub(super) colliders: Option<(usize, Rc<super::body::Colliders>)>,
    pub(super) running: Option<super::simulate::Running>,
    /// Frames that this run simulated (true), or took over from a run that was killed or ended earlier.
    simulated: BTreeMap<i64, bool>,
    hashes: RefCell<FileHashes>,
    options: Options,
    last: BTreeMap<String, Recipe>,
    ran: BTreeMap<What, Counts>,
    seconds: Seconds,
    progress: &'a mut Progress,
}

impl<'a> Runner<'a> {
    /// Opens the cache of a shot and plans it.
    pub fn new(project: &'a Project, options: Options, progress: &'a mut Progress) -> Result<Self, Error> {
        if let Some(frames) = &options.frames {
            let strangers: Vec<i32> = frames.iter().filter(|f| !project.frames.contains_key(f)).copied().collect();
            if !strangers.is_empty() {
                let [a, b] = project.shot.value.shot.frames;
                let what = format!("frame {} is not in the shot", frame_list(&strangers));
                return Err(Error::input(what, format!("the shot goes from {a} to {b}")));
            }
        }
        let cache = project.cache_dir();
        let store = Store::open_clearing(&cache, &[&project.out_dir()]).map_err(Error::disk(&cache))?;
        let last = if options.draft { BTreeMap::new() } else { store.last(&project.shot.value.shot.name) };
        let seconds = store.seconds(&project.shot.value.shot.name);
        Ok(Runner {
            project,
            plan: Plan::new(project),
            store,
            warnings: Vec::new(),
            skin: None,
            pose: None,
            roots: BTreeMap::new(),
            layers: BTreeMap::new(),
            sites: BTreeMap::new(),
            members: BTreeMap::new(),
            looks: BTreeMap::new(),
            lines: BTreeMap::new(),
            tree: Vec::new(),
            barrier: None,
            particles: BTreeMap::new(),
            scene: None,
            props: None,
            hits: None,
            camera: None,
            turning: None,
            placed: None,
            control: None,
            control_at: None,
            curves: None,
            colliders: None,
            running: None,
            simulated: BTreeMap::new(),
            hashes: RefCell::new(FileHashes::open(&cache)),
            options,
            last,
            ran: BTreeMap::new(),
            seconds,
            progress,
        })
    }

    /// Warns once a run: layers and frames come one by one.
    pub(super) fn warn_once(&mut self, text: String) {
        if !self.warnings.contains(&text) {
            self.warnings.push(text);
        }
    }

    /// Payload of a finished step; `None` if it must run.
    pub fn fetch(&self, what: What) -> Option<Entry> {
        if self.is_forced(what) { None } else { self.store.get(&self.plan.step(what).key) }
    }

    /// One payload file of a finished step; `None` if the step must run.
    pub fn fetch_file(&self, what: What, name: &str) -> Option<Vec<u8>> {
        if self.is_forced(what) { None } else { self.store.file(&self.plan.step(what).key, name) }
    }

    /// True if a step runs whether its result is there or not.
    pub fn is_forced(&self, what: What) -> bool {
        self.options.force == Some(self.plan.step(what).stage) && !self.ran.contains_key(&what)
    }

    /// Keeps the result of a step.
    pub fn keep(&mut self, what: What, counts: Counts, files: &[(&str, &[u8])]) -> Result<(), Error> {
        let recipe = &self.plan.step(what).recipe;
        self.store.put(recipe, counts.clone(), files).map_err(Error::disk(&self.project.cache_dir()))?;
        self.ran.insert(what, counts);
        Ok(())
    }

    /// Notes that a step is finished, whose files are in the cache.
    pub(super) fn kept(&mut self, what: What, counts: Counts) {
        self.ran.insert(what, counts);
    }

    /// Notes that a frame is simulated: now, or by an earlier run.
    pub(super) fn simulated(&mut self, frame: i64, now: bool) {
        let known = self.simulated.entry(frame).or_default();
        *known = *known || now;
        self.progress.step();
    }

    /// Says how the work on a step goes.
    pub(super) fn working(&mut self, what: &str) {
        self.progress.working(what);
    }

    /// Says a line about the stage that runs.
    pub(super) fn say(&self, line: &str) {
        self.progress.say_of_stage(line);
    }

    /// Shows the fraction done of something that takes long; false as soon as the run is to stop.
    pub(super) fn ticker(&self, what: &str) -> impl Fn(f64) -> bool + Sync + use<> {
        self.progress.ticker(what)
    }

    /// Drops what was read of the layers' hairs: it is read again where it is needed.
    pub(super) fn forget_layers(&mut self) {
        self.roots.clear();
        self.layers.clear();
        self.sites.clear();
        self.members.clear();
        self.looks.clear();
        self.lines.clear();
        self.scene = None;
    }

    /// Scene-space point that positions are relative to.
    pub fn origin(&mut self) -> Result<[f64; 3], Error> {
        match &self.project.rest {
            Some(_) => Ok(super::groom::skin(self)?.origin()),
            None => Ok(super::curves::hair(self)?.origin),
        }
    }

    /// Reads a map that the groom names.
    pub fn map(&mut self, m: &MapRef, texel: skin::Texel) -> Result<TiledMap, Error> {
        skin::read_map(&self.project.maps[&m.map], m, texel, &mut self.warnings)
    }

    /// Content hash of an output file.
    pub fn file_hash(&self, path: &Path) -> Option<String> {
        self.hashes.borrow_mut().hash(path).ok()
    }

    fn is_done(&self, step: &Step) -> bool {
        if self.options.force == Some(step.stage) {
            return false;
        }
        match step.stage {
            Stage::Export | Stage::Preview => super::export::is_written(self, step),
            _ => self.store.contains(&step.key),
        }
    }

    /// Steps of a stage that this run is about.
    fn selected(&self, stage: Stage) -> Vec<Step> {
        let wanted = |s: &&Step| match s.what {
            What::Frame(_, f) | What::CombAt(f) => self.options.frames.as_ref().is_none_or(|o| o.contains(&f)),
            What::Shadow(l, f) => {
                let written = self.options.without != Some(Stage::Export);
                let used = written && is_shadowed(self.project, l as usize, f, true);
                (used || self.options.pictures.show(self.project, f))
                    && self.options.frames.as_ref().is_none_or(|o| o.contains(&f))
            }
            What::Hits(f) => self.options.frames.as_ref().is_none_or(|o| o.last().is_some_and(|last| f <= *last)),
            What::Simulate(_, k) => {
                let last = self.options.frames.as_ref().map(|o| o.last().copied().unwrap_or(i32::MIN));
                last.is_none_or(|f| *Timeline::new(self.project).stretch(k).start() <= i64::from(f))
            }
            What::Still => matches!(self.options.pictures, Pictures::Still | Pictures::Sheet),
            What::Sheet => self.options.pictures == Pictures::Sheet,
            What::Picture(f) => matches!(&self.options.pictures, Pictures::Sequence(frames) if frames.contains(&f)),
            What::Turn(_) => self.options.pictures == Pictures::Turntable,
            _ => true,
        };
        self.plan.steps.iter().filter(|s| s.stage == stage).filter(wanted).cloned().collect()
    }

    /// True if the run is about a frame.
    pub(super) fn wants(&self, frame: i32) -> bool {
        self.options.frames.as_ref().is_none_or(|o| o.contains(&frame))
    }

    /// True if a picture of a frame is drawn.
    pub(super) fn shows(&self, frame: i32) -> bool {
        self.options.pictures.show(self.project, frame)
    }

    pub(super) fn stages(&self) -> Vec<Stage> {
        let to = self.options.to.unwrap_or(Stage::Preview);
        Stage::ALL.into_iter().filter(|s| *s <= to && self.options.without != Some(*s)).collect()
    }

    /// Why steps of a stage run, each reason once. A shot's first run needs none.
    fn reasons(&self, steps: &[Step]) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        if self.last.is_empty() {
            return out;
        }
        for step in steps {
            for reason in self.plan.reasons(step.what, &self.last).into_iter().chain(self.own_reason(step)) {
                if !out.contains(&reason) {
                    out.push(reason);
                }
            }
        }
        let new = |s: &&Step| !self.last.contains_key(&s.name) && !self.in_new_layer(s);
        let frames: BTreeSet<i32> = steps.iter().filter(new).flat_map(|s| self.frames_of(s)).collect();
        if !frames.is_empty() {
            out.push(format!("new: frame {}", frame_list(&frames.into_iter().collect::<Vec<_>>())));
        }
        reasons::together(out)
    }

    /// Frames that a step makes.
    fn frames_of(&self, step: &Step) -> Vec<i32> {
        match step.what {
            What::Frame(_, f) | What::Shadow(_, f) => vec![f],
            What::Simulate(_, k) => Timeline::new(self.project).stretch(k).map(|f| f as i32).collect(),
            _ => Vec::new(),
        }
    }

    /// What every other step of a layer follows from.
    fn first_of_layer(&self, i: usize) -> What {
        if self.project.curves.is_some() { What::Curves } else { What::Roots(i) }
    }

    fn in_new_layer(&self, step: &Step) -> bool {
        step.what.layer().is_some_and(|i| !self.last.contains_key(&self.plan.step(self.first_of_layer(i)).name))
    }

    /// Why a step runs, if it is not for something that it reads.
    fn own_reason(&self, step: &Step) -> Option<String> {
        if self.options.force == Some(step.stage) {
            return Some(format!("--force {}", step.stage.name()));
        }
        if self.in_new_layer(step) {
            let layer = &self.project.groom.value.layer[step.what.layer()?];
            return Some(format!("new: layer {}", layer.name));
        }
        match (self.last.get(&step.name), step.stage) {
            (None, Stage::Export) => Some(format!("new: {}", step.name)),
            (Some(last), stage) if last.key() == step.key => Some(match stage {
                Stage::Export | Stage::Preview => format!("files of {} are missing or not as written", step.name),
                stage => format!("results of {} are missing from the cache", stage.name()),
            }),
            _ => None,
        }
    }

    /// Frames that a whole-shot file still waits for.
    fn waits_for(&self, step: &Step) -> Vec<i32> {
        let absent = |w: &What| match w {
            What::Frame(_, f) | What::Shadow(_, f) if !self.store.contains(&self.plan.step(*w).key) => Some(*f),
            _ => None,
        };
        let frames: BTreeSet<i32> = step.reads.iter().filter_map(absent).collect();
        frames.into_iter().collect()
    }

    /// What would run, and why.
    pub fn planned(&self) -> Vec<PlannedStage> {
        let stage = |stage: Stage| {
            let steps = self.selected(stage);
            let (done, run): (Vec<Step>, Vec<Step>) = steps.into_iter().partition(|s| self.is_done(s));
            let reasons = self.reasons(&run);
            let run = run.into_iter().map(|s| s.name).collect();
            PlannedStage { name: stage.name().to_owned(), run, reused: done.len(), reasons }
        };
        self.stages().into_iter().map(stage).collect()
    }

    /// Brings everything up to date.
    pub fn run(&mut self) -> Result<Report, Error> {
        let shot = self.project.shot.value.shot.name.clone();
        let mut report =
            Report { shot: shot.clone(), version: env!("CARGO_PKG_VERSION").to_owned(), ..Report::default() };
        let names: BTreeSet<String> = self.plan.steps.iter().map(|s| s.name.clone()).collect();
        let mut last = self.last.clone();
        last.retain(|name, _| names.contains(name));
        for stage in self.stages() {
            let stage_report = self.run_stage(stage, &mut last)?;
            report.stages.push(stage_report);
        }
        // What a stage had to make of a later one belongs to the shot too.
        for what in self.ran.keys() {
            let step = self.plan.step(*what);
            last.insert(step.name.clone(), step.recipe.clone());
        }
        if last != self.last && !self.options.draft {
            self.store.set_last(&shot, &last).map_err(Error::disk(&self.project.cache_dir()))?;
        }
        if !self.ran.is_empty() && !self.options.draft {
            self.seconds.retain(|name, _| names.contains(name));
            self.store.set_seconds(&shot, &self.seconds);
        }
        report.skips = self.skips(&report);
        self.hashes.borrow_mut().save();
        Ok(report)
    }

    fn run_stage(&mut self, stage: Stage, last: &mut BTreeMap<String, Recipe>) -> Result<StageReport, Error> {
        let (wall, cpu) = (Instant::now(), cpu_seconds());
        let steps = self.selected(stage);
        let (done, todo): (Vec<Step>, Vec<Step>) = steps.iter().cloned().partition(|s| self.is_done(s));
        let mut report = StageReport { name: stage.name().to_owned(), ..Default::default() };
        report.reasons = self.reasons(&todo);
        if !todo.is_empty() {
            let frames = |s: &Step| if stage == Stage::Simulate { self.frames_of(s).len() } else { 1 };
            self.progress.begin(stage.name(), todo.iter().map(frames).sum());
            for reason in &report.reasons {
                self.progress.say(&format!("{:<12} because {reason}", stage.name()));
            }
        }
        let mut waiting = BTreeSet::new();
        for step in &todo {
            let missing = if stage >= Stage::Export { self.waits_for(step) } else { Vec::new() };
            if !missing.is_empty() {
                self.progress.say(&format!("{} waits for frame {}", step.name, frame_list(&missing)));
                *report.skipped.entry(format!("{} waiting for frames", step.name)).or_default() += missing.len() as u64;
                waiting.insert(step.what);
                continue;
            }
            if self.progress.is_stopped() {
                return Err(Error::Stopped);
            }
            self.progress.working(&step.name);
            let start = Instant::now();
            self.make(step.what)?;
            if self.ran.contains_key(&step.what) {
                let seconds = start.elapsed().as_secs_f64();
                report.spent_s += seconds;
                self.seconds.insert(step.name.clone(), (step.key.0.clone(), seconds));
            }
            if stage != Stage::Simulate {
                self.progress.step();
            }
        }
        for step in steps.iter().filter(|s| !waiting.contains(&s.what)) {
            last.insert(step.name.clone(), step.recipe.clone());
        }
        // A step may turn out to be finished: another of this run had the same recipe.
        let (ran, found): (Vec<&Step>, Vec<&Step>) = todo.iter().partition(|s| self.ran.contains_key(&s.what));
        let found: Vec<&Step> = found.into_iter().filter(|s| !waiting.contains(&s.what)).collect();
        let cached = done.iter().filter(|s| !self.ran.contains_key(&s.what)).count();
        (report.made, report.from_cache, report.alike) = (ran.len(), cached, found.len());
        let known = |s: &Step| self.seconds.get(&s.name).filter(|k| k.0 == s.key.0).map_or(0.0, |k| k.1);
        report.known_s = steps.iter().map(known).sum();
        (report.ran, report.reused) = match stage {
            Stage::Simulate => self.tally_simulated(&steps),
            _ => tally(stage, &ran, &done.iter().chain(found).collect::<Vec<_>>()),
        };
        report.counts = self.counts(&steps);
        for name in super::simulate::SKIPPED.into_iter().chain([super::simulate::SLEEPING]).chain(super::kept::LEFT_OUT)
        {
            report.skipped.extend(report.counts.remove_entry(name).filter(|s| s.1 > 0));
        }
        report.warnings = std::mem::take(&mut self.warnings);
        report.warnings.extend(self.store.take_warnings());
        for warning in report.warnings.iter().filter(|_| !self.options.draft) {
            self.progress.say(&format!("warning: {warning}"));
        }
        report.wall_s = wall.elapsed().as_secs_f64();
        report.cpu_s = cpu_seconds() - cpu;
        report.peak_bytes = peak_bytes();
        if !todo.is_empty() {
            self.progress.end(&format!("{} ran, {} reused", report.ran, report.reused));
        }
        Ok(report)
    }

    /// Frames that were simulated, and frames that were there.
    fn tally_simulated(&self, steps: &[Step]) -> (usize, usize) {
        let frames: BTreeSet<i32> = steps.iter().flat_map(|s| self.frames_of(s)).collect();
        let ran = frames.iter().filter(|f| self.simulated.get(&i64::from(**f)) == Some(&true)).count();
        (ran, frames.len() - ran)
    }

    /// Counts of steps, of this or an earlier run, summed over layers. Frames are not summed: the largest
    /// frame (or stretch) counts.
    fn counts(&self, steps: &[Step]) -> Counts {
        let mut moments: BTreeMap<Option<i32>, Counts> = BTreeMap::new();
        for step in steps {
            let moment = match step.what {
                What::Simulate(_, k) => Some(k as i32),
                // Hairs of the rest pose a second time.
                What::Finished(_) => Some(i32::MIN),
                what => what.frame(),
            };
            let found = self.ran.get(&step.what).cloned().or_else(|| self.store.counts(&step.key));
            for (name, n) in found.unwrap_or_default() {
                let moment = moment.filter(|_| !super::simulate::SUMMED.contains(&name.as_str()));
                *moments.entry(moment).or_default().entry(name).or_default() += n;
            }
        }
        let mut largest = Counts::new();
        for (name, n) in moments.into_values().flatten() {
            let at = largest.entry(name).or_default();
            *at = n.max(*at);
        }
        largest
    }

    fn make(&mut self, what: What) -> Result<(), Error> {
        use super::{
            areas, clumps, comb, curves, export, groom, guides, instance, interpolate, kept, preview, shadow, simulate,
        };
        match what {
            What::Curves => curves::hair(self).map(drop),
            What::Place => groom::placed(self).map(drop),
            What::Panels(i) => guides::panels(self, i as usize).map(drop),
            What::Comb => comb::combed(self).map(drop),
            What::CombAt(frame) => comb::combed_at(self, frame).map(drop),
            What::Candidates(i) => instance::candidates(self, i).map(drop),
            What::Roots(i) => instance::grown(self, i).map(drop),
            What::Kept(i) => kept::kept_hairs(self, i).map(drop),
            What::Weights(i) => instance::weights(self, i).map(drop),
            What::Length(i) | What::Width(i) | What::Opacity(i) => instance::column(self, what, i).map(drop),
            What::Color(i) => instance::color(self, i).map(drop),
            What::Simulate(..) => simulate::make(self, what),
            What::Clump(i, k) => clumps::clumps(self, i, k as usize).map(drop),
            What::Hits(frame) => areas::hits(self, frame).map(drop),
            What::Rest(_) | What::Finished(_) | What::Frame(..) => interpolate::positions(self, what).map(drop),
            What::Shadow(l, frame) => shadow::columns(self, l as usize, frame).map(drop),
            What::Export(format) => export::write(self, what, format),
            What::Still => preview::still(self),
            What::Sheet => preview::sheet(self),
            What::Picture(frame) => preview::picture(self, frame),
            What::Turn(k) => preview::turn(self, k),
        }
    }
}

/// Steps as the report counts them: frames for interpolation, files for export and preview, else the stage as one.
fn tally(stage: Stage, ran: &[&Step], done: &[&Step]) -> (usize, usize) {
    match stage {
        Stage::Groom | Stage::Instance => (usize::from(!ran.is_empty()), usize::from(ran.is_empty())),
        Stage::Interpolate => {
            let frame = |s: &Step| match s.what {
                What::Frame(_, f) => Some(f),
                _ => None,
            };
            let new: BTreeSet<i32> = ran.iter().filter_map(|s| frame(s)).collect();
            let old: BTreeSet<i32> = done.iter().filter_map(|s| frame(s)).filter(|f| !new.contains(f)).collect();
            // On a still skin the rest pose is every frame: it ran, and stands for one of them.
            let rest = usize::from(new.is_empty() && !ran.is_empty() && !old.is_empty());
            (new.len() + rest, old.len() - rest)
        }
        Stage::Simulate | Stage::Shadow | Stage::Export | Stage::Preview => (ran.len(), done.len()),
    }
}
