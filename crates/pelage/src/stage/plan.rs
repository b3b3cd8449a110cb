//! Every step of a shot with its recipe: what each step reads, and nothing else, enters its key.

use super::Stage;
use super::plan_kept::hairs_of;
use super::plan_light::shadows;
use super::plan_look::finished_rest;
use crate::cache::{Field, Key, Recipe};
use crate::config::{ExportFormat, Feature, GuideChoice, MapRef, Target};
use crate::project::{Project, SkinAt};
use crate::timeline::Timeline;
use std::collections::BTreeMap;

/// What a step makes. Layers are numbered as in the groom file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum What {
    /// Hair from a curves file, bound to the skin.
    Curves,
    /// Sites and roots of the control hairs.
    Place,
    /// Panels that the flow of that operation of combing goes around, factored.
    Panels(u32),
    /// Control hairs after combing.
    Comb,
    /// Control hairs after combing at a frame, where combing has key frames.
    CombAt(i32),
    /// Blue-noise candidate roots for a layer.
    Candidates(usize),
    /// Roots of a layer's hairs.
    Roots(usize),
    /// Of a layer's hairs those that the shot needs.
    Kept(usize),
    /// The three control hairs and weights of every hair of a layer.
    Weights(usize),
    /// Lengths.
    Length(usize),
    /// Root diameters.
    Width(usize),
    /// Opacities.
    Opacity(usize),
    /// Colours.
    Color(usize),
    /// The clumps of a layer's level.
    Clump(usize, u32),
    /// A layer's hairs at the rest pose, as they are simulated; finished if nothing is simulated of it.
    Rest(usize),
    /// A simulated layer's finished hairs at the rest pose.
    Finished(usize),
    /// Where particles have hit the skin up to the end of a frame.
    Hits(i32),
    /// What is simulated of a layer over a stretch of frames between checkpoints.
    Simulate(usize, u32),
    /// A layer's hairs at a frame.
    Frame(usize, i32),
    /// What of a light arrives at the hairs of a frame.
    Shadow(u32, i32),
    /// An exported file, or one per frame.
    Export(ExportFormat),
    /// The preview picture.
    Still,
    /// The contact sheet over frames.
    Sheet,
    /// The picture of a frame in a sequence.
    Picture(i32),
    /// A picture of the turntable.
    Turn(u32),
}

/// A step of a shot.
#[derive(Clone, Debug)]
pub struct Step {
    /// What it makes.
    pub what: What,
    /// Its name over runs: `instance/length/scalp`, `interpolate/scalp/1001`.
    pub name: String,
    /// Its stage.
    pub stage: Stage,
    /// Everything it reads.
    pub recipe: Recipe,
    /// Its recipe's key: others read it many times.
    pub key: Key,
    /// The steps it reads.
    pub reads: Vec<What>,
}

/// Every step of a shot, in an order in which each comes after what it reads.
#[derive(Debug)]
pub struct Plan {
    /// The steps.
    pub steps: Vec<Step>,
    index: BTreeMap<What, usize>,
}

/// Versions of the stages' results. Raise one whenever its code gives other bytes for the same input.
pub(super) mod version {
    pub const CURVES: u32 = 1;
    pub const PLACE: u32 = 1;
    pub const PANELS: u32 = 1;
    pub const COMB: u32 = 5;
    pub const CANDIDATES: u32 = 1;
    pub const ROOTS: u32 = 1;
    pub const KEPT: u32 = 1;
    pub const WEIGHTS: u32 = 1;
    pub const COLUMN: u32 = 1;
    pub const SIMULATE: u32 = 6;
    pub const INTERPOLATE: u32 = 2;
    pub const CLUMP: u32 = 1;
    pub const LOOK: u32 = 4;
    pub const COLLISION: u32 = 3;
    pub const AREAS: u32 = 1;
    pub const SHADOW: u32 = 3;
    pub const EXPORT: u32 = 1;
    pub const PREVIEW: u32 = 4;
}

/// Candidates are made for the next power of two of the density, hairs per square centimetre, so that tweaking a
/// density within it finds them in the cache. A finer step would recompute more often, a coarser one makes more
/// candidates than are used (up to twice as many as it is).
pub fn candidate_density(per_cm2: f64) -> f64 {
    let mut level = 1.0 / 1024.0;
    while level < per_cm2 {
        level *= 2.0;
    }
    level
}

/// Seed of a layer's random numbers and the upper half of its hair ids: 31 bits of its name's hash.
pub fn layer_seed(name: &str) -> u32 {
    let hash = blake3::hash(name.as_bytes());
    u32::from_le_bytes(hash.as_bytes()[..4].try_into().expect("four bytes")) >> 1
}

impl Plan {
    /// Plans a shot.
    pub fn new(project: &Project) -> Self {
        let mut plan = Plan { steps: Vec::new(), index: BTreeMap::new() };
        let r = Reader::new(project);
        match &project.curves {
            Some(_) => plan.add_curves(&r),
            None => plan.add_groom(&r),
        }
        let timeline = Timeline::new(project);
        for i in (0..project.groom.value.layer.len()).filter(|i| project.target(*i) != Target::Off) {
            for k in 0..timeline.stretches() {
                plan.add_stretch(&r, &timeline, i, k);
            }
        }
        for i in (0..project.groom.value.layer.len()).filter(|i| finished_rest(project, *i) == What::Finished(*i)) {
            plan.add_finished(&r, i);
        }
        plan.add_hits(&r);
        for (frame, at) in &project.frames {
            for i in 0..project.groom.value.layer.len() {
                plan.add_frame(&r, i, *frame, at, What::Simulate(i, timeline.stretch_of(*frame)));
            }
            plan.add_shadows(&r, *frame, at);
        }
        let layers = 0..project.groom.value.layer.len();
        let columns = layers.clone().flat_map(|i| [What::Width(i), What::Opacity(i), What::Color(i)]);
        let look: Vec<What> = if project.curves.is_some() { vec![What::Curves] } else { columns.collect() };
        let mut all = look.clone();
        all.extend(layers.clone().map(|i| finished_rest(project, i)));
        all.extend(project.frames.keys().flat_map(|f| layers.clone().map(|i| What::Frame(i, *f))));
        all.extend(project.frames.keys().flat_map(|f| shadows(project, *f, true)));
        for format in &project.shot.value.export.formats {
            let name = format!("export/{}", format.name());
            plan.add(What::Export(*format), name, Stage::Export, r.export(*format), &all);
        }
        plan.add_pictures(&r, &look);
        plan
    }

    /// Steps of hair from a curves file up to its rest pose.
    fn add_curves(&mut self, r: &Reader<'_>) {
        let file = r.project.curves.as_ref().expect("a shot with curves");
        let recipe =
            r.unit(Recipe::new("instance/curves", version::CURVES)).file("curves", &file.hash, file.label.clone());
        self.add(What::Curves, "instance/curves".into(), Stage::Instance, r.rest(recipe), &[]);
        let recipe = r.points(0, Recipe::new("interpolate", version::INTERPOLATE));
        let name = "interpolate/hair/rest".to_owned();
        self.add_hairs(r, What::Rest(0), name, recipe, vec![What::Curves], &SkinAt::Rest);
    }

    /// A simulated layer's finished hairs at the rest pose.
    fn add_finished(&mut self, r: &Reader<'_>, i: usize) {
        let name = format!("interpolate/{}/finished", r.project.groom.value.layer[i].name);
        let recipe = Recipe::new("interpolate", version::INTERPOLATE);
        self.add_hairs(r, What::Finished(i), name, recipe, vec![What::Rest(i)], &SkinAt::Rest);
    }

    /// A layer's finished hairs at a frame.
    fn add_frame(&mut self, r: &Reader<'_>, i: usize, frame: i32, at: &SkinAt, simulated: What) {
        let reads: &[What] = match r.project.target(i) {
            Target::Off if r.project.curves.is_some() => &[What::Curves, What::Rest(0)],
            Target::EveryHair => &[simulated],
            Target::ControlHairs => &[simulated, hairs_of(r.project, i), What::Weights(i), What::Length(i)],
            Target::Off if r.combs_move => {
                &[What::CombAt(frame), What::Comb, hairs_of(r.project, i), What::Weights(i), What::Length(i)]
            }
            Target::Off => &[What::Comb, hairs_of(r.project, i), What::Weights(i), What::Length(i)],
        };
        let name = format!("interpolate/{}/{frame}", r.project.groom.value.layer[i].name);
        self.add_hairs(r, What::Frame(i, frame), name, r.frame(i, at, frame), reads.to_vec(), at);
    }

    /// Steps of a groom up to the hairs' rest pose.
    fn add_groom(&mut self, r: &Reader<'_>) {
        let (plan, project) = (self, r.project);
        plan.add(What::Place, "groom/place".into(), Stage::Groom, r.place(), &[]);
        let mut reads = vec![What::Place];
        for (i, c) in project.groom.value.comb.iter().enumerate() {
            if let Some(panels) = &c.panels {
                let what = What::Panels(i as u32);
                plan.add(what, format!("groom/panels[{i}]"), Stage::Groom, r.panels(i, panels), &[]);
                reads.push(what);
            }
        }
        plan.add(What::Comb, "groom/comb".into(), Stage::Groom, r.comb(None), &reads);
        if r.combs_move {
            for frame in project.frames.keys() {
                let name = format!("groom/comb/{frame}");
                plan.add(What::CombAt(*frame), name, Stage::Groom, r.comb(Some(*frame)), &reads);
            }
        }
        for (i, layer) in project.groom.value.layer.iter().enumerate() {
            let name = |part: &str| format!("instance/{part}/{}", layer.name);
            let mut add = |what, part: &str, recipe, reads: &[What]| {
                plan.add(what, name(part), Stage::Instance, recipe, reads);
            };
            let column = |part: &str, f: &Feature| {
                let recipe = Recipe::new(&format!("instance/{part}"), version::COLUMN);
                r.guard(i, part, recipe.with(r.feature(part, &format!("layer[{i}].{part}"), f)))
            };
            // Control hairs that are hairs, or candidates that a density lets grow.
            if layer.hairs.is_empty() {
                add(What::Candidates(i), "candidates", r.candidates(i), &[]);
                add(What::Roots(i), "roots", r.roots(i), &[What::Candidates(i)]);
            } else {
                add(What::Roots(i), "roots", r.roots_by_hand(i), &[What::Comb]);
            }
            let hairs = hairs_of(project, i);
            if hairs == What::Kept(i) {
                add(hairs, "kept", r.kept(i), &[What::Roots(i)]);
            }
            add(What::Weights(i), "weights", r.weights(i), &[What::Place, hairs]);
            add(What::Length(i), "length", column("length", &layer.length), &[hairs]);
            add(What::Width(i), "width", column("width", &layer.width.feature()), &[hairs]);
            add(What::Opacity(i), "opacity", column("opacity", &layer.opacity), &[hairs]);
            add(What::Color(i), "color", r.color(i), &[hairs]);
        }
        for (i, layer) in project.groom.value.layer.iter().enumerate() {
            let reads = [What::Comb, hairs_of(project, i), What::Weights(i), What::Length(i)];
            let name = format!("interpolate/{}/rest", layer.name);
            let rest = Recipe::new("interpolate", version::INTERPOLATE);
            let rest = r.skin(r.points(i, rest), &SkinAt::Rest, 0);
            plan.add_clumps(r, i);
            plan.add_hairs(r, What::Rest(i), name, rest, reads.to_vec(), &SkinAt::Rest);
        }
    }

    pub(super) fn add(&mut self, what: What, name: String, stage: Stage, mut recipe: Recipe, reads: &[What]) {
        for input in reads {
            let step = self.step(*input);
            recipe = recipe.step(&step.name.clone(), &step.key);
        }
        self.push(what, name, stage, recipe, reads.to_vec());
    }

    pub(super) fn push(&mut self, what: What, name: String, stage: Stage, recipe: Recipe, reads: Vec<What>) {
        self.index.insert(what, self.steps.len());
        self.steps.push(Step { what, name, stage, key: recipe.key(), recipe, reads });
    }

    /// The step that makes something. Panics if the shot has no such step.
    pub fn step(&self, what: What) -> &Step {
        &self.steps[self.index[&what]]
    }

    /// Why a step is not what it was in the last run: its own changes, and those of what it reads.
    pub fn reasons(&self, what: What, last: &BTreeMap<String, Recipe>) -> Vec<String> {
        let step = self.step(what);
        let mut out = match last.get(&step.name) {
            Some(before) if before.key() == step.key => return Vec::new(),
            Some(before) => changes(&step.recipe, before),
            None => Vec::new(),
        };
        for input in &step.reads {
            for reason in self.reasons(*input, last) {
                if !out.contains(&reason) {
                    out.push(reason);
                }
            }
        }
        out
    }
}

/// What changed between two recipes of a step. Frames that only one of them has say nothing: the range of frames does;
/// nor does what another target reads.
fn changes(now: &Recipe, before: &Recipe) -> Vec<String> {
    let target = |r: &Recipe| r.fields.iter().find(|f| f.name == "target").map(|f| f.value.clone());
    let other = target(now) != target(before);
    let only = |r: &Recipe, o: &Recipe| {
        let of_both = |f: &&Field| !f.name.starts_with("skin.") || o.fields.iter().any(|g| g.name == f.name);
        let told = |f: &&Field| if other { f.name == "target" } else { of_both(f) };
        Recipe { fields: r.fields.iter().filter(told).cloned().collect(), ..r.clone() }
    };
    only(now, before).changes(&only(before, now))
}

impl What {
    /// The frame that it is made for; `None` for what is made once.
    pub fn frame(self) -> Option<i32> {
        match self {
            What::Frame(_, f) | What::Hits(f) | What::Shadow(_, f) | What::Picture(f) => Some(f),
            _ => None,
        }
    }

    /// The frame of combing that it is; `None` at rest.
    pub fn comb_frame(self) -> Option<i32> {
        if let What::CombAt(f) = self { Some(f) } else { None }
    }

    /// The layer that it belongs to, if it belongs to one.
    pub fn layer(self) -> Option<usize> {
        match self {
            What::Candidates(i)
            | What::Roots(i)
            | What::Kept(i)
            | What::Weights(i)
            | What::Rest(i)
            | What::Finished(i) => Some(i),
            What::Simulate(i, _) | What::Frame(i, _) | What::Clump(i, _) => Some(i),
            What::Length(i) | What::Width(i) | What::Opacity(i) | What::Color(i) => Some(i),
            What::Curves | What::Place | What::Panels(_) | What::Comb | What::CombAt(_) | What::Hits(_) => None,
            What::Shadow(..) | What::Export(_) | What::Still | What::Sheet | What::Picture(_) | What::Turn(_) => None,
        }
    }
}

impl ExportFormat {
    /// Name as written in the shot file.
    pub fn name(self) -> &'static str {
        match self {
            ExportFormat::Usd => "usd",
            ExportFormat::Mcap => "mcap",
            ExportFormat::Ply => "ply",
        }
    }
}

/// Builds recipes from a project; `shot` is the label of its file.
pub(super) struct Reader<'a> {
    pub project: &'a Project,
    shot: String,
    /// True if combing has key frames.
    combs_move: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(project: &'a Project) -> Self {
        Reader { project, shot: project.label(&project.shot.path), combs_move: project.combs_move() }
    }

    pub(super) fn in_groom(&self, key: &str) -> String {
        format!("{}: {key}", self.project.label(self.project.groom.file_of(key)))
    }

    pub(super) fn in_shot(&self, key: &str) -> String {
        format!("{}: {key}", self.shot)
    }

    pub(super) fn rest(&self, recipe: Recipe) -> Recipe {
        match &self.project.rest {
            Some(rest) => recipe.file("rest", &rest.hash, rest.label.clone()),
            None => recipe,
        }
    }

    /// Scale between scene units and the units of a groom file.
    pub(super) fn unit(&self, recipe: Recipe) -> Recipe {
        let unit = self.project.shot.value.shot.meters_per_unit;
        recipe.param("meters_per_unit", unit, self.in_shot("shot.meters_per_unit"))
    }

    pub(super) fn map(&self, name: &str, m: &MapRef) -> Vec<Field> {
        self.map_at(name, name, m)
    }

    /// Fields of a map; `name` is what it is to the step, `key` where the groom file has it.
    pub(super) fn map_at(&self, name: &str, key: &str, m: &MapRef) -> Vec<Field> {
        let mut recipe = Recipe::new("", 0);
        for (tile, file) in &self.project.maps[&m.map] {
            recipe = recipe.file(&format!("{name}.map.{tile}"), &file.hash, file.label.clone());
        }
        let key = self.in_groom(key);
        let recipe = recipe.param(&format!("{name}.channel"), format!("{:?}", m.channel), format!("{key}.channel"));
        recipe.param(&format!("{name}.wrap"), format!("{:?}", m.wrap), format!("{key}.wrap")).fields
    }

    /// Fields of a feature; `name` is what it is to the step, `key` where the groom file has it.
    pub(super) fn feature(&self, name: &str, key: &str, f: &Feature) -> Vec<Field> {
        let at = self.in_groom(key);
        let recipe = Recipe::new("", 0).param(&format!("{name}.value"), f.value, format!("{at}.value"));
        let recipe = recipe.param(&format!("{name}.noise"), f.noise, format!("{at}.noise"));
        recipe.with(f.map().iter().flat_map(|m| self.map(name, m))).fields
    }

    fn candidates(&self, i: usize) -> Recipe {
        let layer = &self.project.groom.value.layer[i];
        let at = self.in_groom(&format!("layer[{i}]"));
        let r = self.unit(self.rest(Recipe::new("instance/candidates", version::CANDIDATES)));
        let r = r.param("seed", layer_seed(&layer.name), format!("{at}.name"));
        r.param("per_cm2", candidate_density(layer.density.value), format!("{at}.density.value (candidates)"))
    }

    /// Dividers of fields.
    pub(super) fn dividers(&self, mut r: Recipe) -> Recipe {
        let combs = self.project.groom.value.comb.iter().enumerate();
        for (k, c) in combs.filter(|(_, c)| !c.divider.is_empty()) {
            let at = format!("comb[{k}].divider");
            r = r.param(&at, serde_json::to_string(&c.divider).expect("plain numbers"), self.in_groom(&at));
        }
        r
    }

    /// What decides which control hairs the hairs of a layer follow, besides where they stand.
    fn weights(&self, i: usize) -> Recipe {
        let groom = &self.project.groom.value;
        let mut r = Recipe::new("instance/weights", version::WEIGHTS);
        r = self.dividers(r);
        let layer = &groom.layer[i];
        let at = |key: &str| self.in_groom(&format!("layer[{i}].{key}"));
        if layer.guides == GuideChoice::Copy {
            r = r.param("seed", layer_seed(&layer.name), at("name"));
        }
        match layer.guides {
            GuideChoice::Blend => r,
            other => r.param("guides", format!("{other:?}").to_lowercase(), at("guides")),
        }
    }

    fn roots_by_hand(&self, i: usize) -> Recipe {
        let layer = &self.project.groom.value.layer[i];
        let at = self.in_groom(&format!("layer[{i}]"));
        let r =
            Recipe::new("instance/roots", version::ROOTS).param("seed", layer_seed(&layer.name), format!("{at}.name"));
        self.names(r.param("hairs", format!("{:?}", layer.hairs), format!("{at}.hairs")))
    }

    fn roots(&self, i: usize) -> Recipe {
        let layer = &self.project.groom.value.layer[i];
        let r = Recipe::new("instance/roots", version::ROOTS);
        let r = r.with(self.feature("density", &format!("layer[{i}].density"), &layer.density));
        self.growth(i, r.with(layer.on_off.iter().flat_map(|m| self.map(&format!("layer[{i}].on_off"), m))))
    }

    /// What the column `part` of a layer reads of its guard hairs; nothing if it has none.
    pub(super) fn guard(&self, i: usize, part: &str, mut r: Recipe) -> Recipe {
        let Some(g) = &self.project.groom.value.layer[i].guard else { return r };
        let factor = match part {
            "length" => g.length,
            "width" => g.width,
            _ => return r,
        };
        let at = format!("layer[{i}].guard");
        r = r.with(self.value("guard.percent", &format!("{at}.percent"), &g.percent, 0.0));
        r.param(&format!("guard.{part}"), factor, self.in_groom(&format!("{at}.{part}")))
    }

    /// What makes columns of points of a layer's columns of hairs: it is read where points are written or drawn.
    pub(super) fn along(&self, r: Recipe) -> Recipe {
        let mut r = self.widths(r);
        for (i, layer) in self.project.groom.value.layer.iter().enumerate() {
            if let Some(ramp) = &layer.color.ramp {
                let at = format!("layer[{i}].color.ramp");
                r = r.param(&at, format!("{ramp:?}"), self.in_groom(&at));
            }
        }
        r
    }

    /// What makes widths of points.
    pub(super) fn widths(&self, mut r: Recipe) -> Recipe {
        for (i, layer) in self.project.groom.value.layer.iter().enumerate() {
            let at = |key: &str| format!("layer[{i}].{key}");
            r = match &layer.width.profile {
                Some(p) => r.param(&at("width.profile"), format!("{p:?}"), self.in_groom(&at("width.profile"))),
                None => r.param(&at("width.tip"), layer.width.tip(), self.in_groom(&at("width.tip"))),
            };
        }
        r
    }

    fn color(&self, i: usize) -> Recipe {
        let c = &self.project.groom.value.layer[i].color;
        let at = self.in_groom(&format!("layer[{i}].color"));
        let r = Recipe::new("instance/color", version::COLUMN);
        let r = r.param("value", format!("{:?}", c.value), format!("{at}.value"));
        let r = r.param("noise", c.noise, format!("{at}.noise"));
        let map = c.map();
        r.with(map.iter().flat_map(|m| self.map("color", m)))
    }

    fn points(&self, i: usize, r: Recipe) -> Recipe {
        if self.project.curves.is_some() {
            let segments =
                self.project.shot.value.simulate.segments.map_or("as they are".to_owned(), |s| s.to_string());
            return r.param("segments", segments, self.in_shot("simulate.segments"));
        }
        let label = match self.project.target(i) {
            Target::EveryHair => self.in_shot("simulate.segments (points)"),
            _ => self.in_groom(&format!("layer[{i}].points")),
        };
        let r = r.param("points", self.project.base_points(i), label);
        match self.project.groom.value.layer[i].root_frames {
            true => r.param("root_frames", true, self.in_groom(&format!("layer[{i}].root_frames"))),
            false => r,
        }
    }

    fn frame(&self, i: usize, at: &SkinAt, frame: i32) -> Recipe {
        let target = self.project.target(i);
        let r = Recipe::new("interpolate", version::INTERPOLATE);
        let simulated = |r: Recipe| {
            r.param("target", target.name(), self.in_shot("simulate.target")).param(
                "frame",
                frame,
                "the frame's number",
            )
        };
        match target {
            Target::EveryHair => simulated(r),
            Target::ControlHairs => simulated(self.skin(self.points(i, r), at, frame)),
            Target::Off => self.skin(self.points(i, r), at, frame),
        }
    }

    pub(super) fn skin(&self, r: Recipe, at: &SkinAt, frame: i32) -> Recipe {
        match at {
            SkinAt::Rest => r.param("skin", "rest", "the skin's rest pose"),
            SkinAt::Rigid(t) => {
                let motion = self.project.motion.as_ref().expect("a rigid skin has a motion");
                r.file("skin", &format!("{t:?}"), format!("{} at frame {frame}", motion.file.label))
            }
            SkinAt::File(file) => r.file("skin", &file.hash, file.label.clone()),
        }
    }

    fn export(&self, format: ExportFormat) -> Recipe {
        let s = &self.project.shot.value.shot;
        let mut r = Recipe::new("export", version::EXPORT).param("format", format.name(), "format");
        for (key, value) in [
            ("name", s.name.clone()),
            ("fps", s.fps.to_string()),
            ("up", format!("{:?}", s.up)),
            ("meters_per_unit", s.meters_per_unit.to_string()),
            ("frames", format!("{:?}", s.frames)),
        ] {
            r = r.param(key, value, self.in_shot(&format!("shot.{key}")));
        }
        self.lights_of_files(self.along(r))
    }
}
