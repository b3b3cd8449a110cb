//! What the look reads: clumps, and what displaces the hairs of a frame.

use super::Stage;
use super::plan::{Plan, Reader, What, layer_seed, version};
use super::plan_kept::hairs_of;
use crate::cache::{Field, Recipe};
use crate::config::{Clump, ClumpOf, Keyed, LookValue, Operator, Target, Varied};
use crate::project::{Project, SkinAt};
use std::fmt::Display;

/// A part of the look that acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Places in clusters.
    Cluster,
    /// A level of clumps.
    Clump(usize),
    /// Curls.
    Curl,
    /// Waves of that number.
    Wave(usize),
    /// Noise of that number.
    Noise(usize),
    /// Wind.
    Wind,
}

impl Effect {
    /// True if it displaces along axes across the hair, which the skin carries.
    pub fn has_axes(self, project: &Project, i: usize) -> bool {
        match self {
            Effect::Cluster | Effect::Clump(_) => self.has_lines(project, i),
            Effect::Curl | Effect::Wave(_) | Effect::Noise(_) => true,
            Effect::Wind => false,
        }
    }

    /// True if it brings hair to lines that are no hairs.
    pub fn has_lines(self, project: &Project, i: usize) -> bool {
        match self {
            Effect::Cluster => true,
            Effect::Clump(k) => project.groom.value.layer[i].clump[k].has_lines(),
            _ => false,
        }
    }

    /// True if it follows clusters.
    pub fn clusters(self, project: &Project, i: usize) -> bool {
        match self {
            Effect::Cluster => true,
            Effect::Clump(k) => project.groom.value.layer[i].clump[k].clusters.is_some(),
            _ => false,
        }
    }

    /// Its key below the layer's.
    pub fn key(self) -> String {
        match self {
            Effect::Cluster => "cluster".to_owned(),
            Effect::Clump(k) => format!("clump[{k}]"),
            Effect::Curl => "curl".to_owned(),
            Effect::Wave(k) => format!("wave[{k}]"),
            Effect::Noise(k) => format!("noise[{k}]"),
            Effect::Wind => "wind".to_owned(),
        }
    }
}

/// Parts of a layer's look in their order: those that the simulation gets as the hair's shape, and those that act on every
/// frame.
pub fn effects(project: &Project, i: usize) -> [Vec<Effect>; 2] {
    let layer = &project.groom.value.layer[i];
    let shot = &project.shot.value;
    let every = project.target(i) == Target::EveryHair;
    let windy = project.target(i) != Target::Off && shot.simulate.wind.is_some();
    let mut out = [Vec::new(), Vec::new()];
    for operator in layer.order().into_iter().filter(|o| shot.look.has(*o)) {
        let mut add = |effect, simulated: bool| out[usize::from(!(simulated && every))].push(effect);
        match operator {
            Operator::Cluster => layer.cluster.iter().for_each(|c| add(Effect::Cluster, c.simulate)),
            Operator::Clump => layer.clump.iter().enumerate().for_each(|(k, c)| add(Effect::Clump(k), c.simulate)),
            Operator::Curl => layer.curl.iter().for_each(|c| add(Effect::Curl, c.simulate)),
            Operator::Wave => layer.wave.iter().enumerate().for_each(|(k, w)| add(Effect::Wave(k), w.simulate)),
            Operator::Noise => layer.noise.iter().enumerate().for_each(|(k, n)| add(Effect::Noise(k), n.simulate)),
            Operator::Wind => {
                layer.wind.iter().filter(|w| !windy || w.with_simulated).for_each(|_| add(Effect::Wind, false));
            }
        }
    }
    out
}

/// Levels of clumps of a layer that act, before or after the simulation.
pub fn acting_clumps(project: &Project, i: usize) -> Vec<usize> {
    let acting = effects(project, i).concat();
    (0..project.groom.value.layer[i].clump.len()).filter(|k| acting.contains(&Effect::Clump(*k))).collect()
}

/// True if clumps of a layer change widths and opacities.
pub fn is_wet(project: &Project, i: usize) -> bool {
    acting_clumps(project, i).into_iter().any(|k| project.groom.value.layer[i].clump[k].wet.is_some())
}

/// True if finished hairs of a layer are kept out of the skin. Hair from a curves file is taken as it is.
pub fn collides(project: &Project, i: usize) -> bool {
    project.curves.is_none() && project.shot.value.look.collision && project.groom.value.layer[i].collision.enabled
}

/// True if `acting` or what finishes a layer's hairs changes those that come into a step; `last` if they leave it finished.
pub fn changes_hairs(project: &Project, i: usize, acting: &[Effect], last: bool) -> bool {
    let finished = collides(project, i) || project.points(i) != project.base_points(i);
    !acting.is_empty() || (last && finished)
}

/// The step that makes a layer's finished hairs at the rest pose.
pub fn finished_rest(project: &Project, i: usize) -> What {
    let later = changes_hairs(project, i, &effects(project, i)[1], true);
    if project.target(i) == Target::EveryHair && later { What::Finished(i) } else { What::Rest(i) }
}

/// The look that acts in a step that makes hairs, and true if they leave it finished.
pub fn look_in(project: &Project, what: What) -> (Vec<Effect>, bool) {
    let i = what.layer().expect("hairs are of a layer");
    let [simulated, after] = effects(project, i);
    match what {
        What::Rest(_) if project.target(i) == Target::EveryHair => (simulated, finished_rest(project, i) == what),
        _ => (after, true),
    }
}

/// The value of a clump's parameter in this shot, and the key that says it.
pub fn overridden<'a>(project: &'a Project, i: usize, k: usize, v: &Varied<'a>) -> Option<(String, &'a Keyed<f64>)> {
    let layer = &project.groom.value.layer[i].name;
    let all = project.shot.value.look.overrides.iter().enumerate().rev();
    all.filter(|(_, o)| o.layer == *layer && o.clump == k).find_map(|(j, o)| {
        let value = match v.name {
            "percent" => o.percent.as_ref(),
            "rate" => o.rate.as_ref(),
            _ => None,
        };
        value.map(|value| (format!("look.override[{j}].{}", v.name), value))
    })
}

/// The level of clumps whose hairs curl alike: the last that acts.
pub fn by_clump(project: &Project, i: usize) -> Option<usize> {
    let together = project.groom.value.layer[i].curl.as_ref().is_some_and(|c| c.per_clump);
    acting_clumps(project, i).pop().filter(|_| together)
}

/// True if a level of clumps joins the clumps of the level before.
pub fn joins_clumps(clump: &Clump, k: usize) -> bool {
    let default = if k == 0 || clump.density.is_none() { ClumpOf::Hairs } else { ClumpOf::Clumps };
    clump.of.unwrap_or(default) == ClumpOf::Clumps
}

impl Plan {
    /// Steps that make a layer's clumps.
    pub(super) fn add_clumps(&mut self, r: &Reader<'_>, i: usize) {
        let layer = &r.project.groom.value.layer[i];
        for k in acting_clumps(r.project, i) {
            let what = What::Clump(i, k as u32);
            let mut reads = vec![hairs_of(r.project, i)];
            reads.extend(joins_clumps(&layer.clump[k], k).then(|| What::Clump(i, k as u32 - 1)));
            let name = format!("instance/clump[{k}]/{}", layer.name);
            self.add(what, name, Stage::Instance, r.clump(i, k), &reads);
        }
    }

    /// Steps that find where particles hit the skin, frame after frame.
    pub(super) fn add_hits(&mut self, r: &Reader<'_>) {
        if !r.project.has_areas() {
            return;
        }
        let mut before: Option<What> = None;
        for (frame, at) in &r.project.frames {
            let recipe = r.skin(r.rest(r.hits()), at, *frame).param("frame", frame, "the frame's number");
            let what = What::Hits(*frame);
            self.add(what, format!("interpolate/areas/{frame}"), Stage::Interpolate, recipe, before.as_slice());
            before = Some(what);
        }
    }

    /// Adds a step that makes hairs of a layer on a skin; `recipe` and `reads` are what it reads apart from the look.
    pub(super) fn add_hairs(
        &mut self,
        r: &Reader<'_>,
        what: What,
        name: String,
        mut recipe: Recipe,
        mut reads: Vec<What>,
        skin: &SkinAt,
    ) {
        let i = what.layer().expect("hairs are of a layer");
        let (frame, (effects, last)) = (what.frame(), look_in(r.project, what));
        for effect in &effects {
            recipe = recipe.with(r.effect(i, *effect, frame));
            match effect {
                // The rest pose is without areas.
                Effect::Clump(k) if frame.is_none() && r.in_areas(i, *k) => {}
                Effect::Clump(k) => {
                    reads.push(What::Clump(i, *k as u32));
                    reads.extend(frame.filter(|_| r.in_areas(i, *k)).map(What::Hits));
                }
                Effect::Curl => {
                    let clump = by_clump(r.project, i).map(|k| What::Clump(i, k as u32));
                    reads.extend(clump.filter(|w| !reads.contains(w)));
                }
                Effect::Wind if frame.is_some() => {
                    recipe = recipe.param("time", r.project.seconds(frame), "the frame's time");
                }
                _ => {}
            }
        }
        let layer = &r.project.groom.value.layer[i];
        if !effects.is_empty() {
            let order = r.in_groom(&format!("layer[{i}].order"));
            recipe =
                recipe.param("look", version::LOOK, "the look").param("order", format!("{:?}", layer.order()), order);
        }
        // What a shot switches off is told by its own key too; what is simulated reads only the parts that are.
        let simulated = matches!(what, What::Rest(_)) && r.project.target(i) == Target::EveryHair;
        for operator in Operator::ALL.into_iter().filter(|o| !simulated && layer.has(*o)) {
            let (name, on) = (format!("look.{}", operator.name()), r.project.shot.value.look.has(operator));
            recipe = recipe.param(&name, on, r.in_shot(&name));
        }
        let collides = last && collides(r.project, i);
        if collides {
            let c = r.project.groom.value.layer[i].collision;
            recipe = r.unit(r.rest(recipe)).param("collision", version::COLLISION, "collision");
            for (key, x) in [("clearance", c.clearance), ("held", c.held)] {
                recipe = recipe.param(key, x, r.in_groom(&format!("layer[{i}].collision.{key}")));
            }
        }
        if last && r.project.points(i) != r.project.base_points(i) {
            let at = format!("layer[{i}].points");
            recipe = recipe.param("finished points", r.project.points(i), r.in_groom(&at));
        }
        let carried = effects.iter().any(|e| e.has_axes(r.project, i));
        if carried && frame.is_some() {
            let rest = if r.project.target(i) == Target::EveryHair { What::Rest(i) } else { What::Comb };
            reads.extend(Some(rest).filter(|w| !reads.contains(w)));
        }
        if (carried || collides) && !recipe.fields.iter().any(|f| f.name == "skin") {
            recipe = r.skin(recipe, skin, frame.unwrap_or(0));
        }
        self.add(what, name, Stage::Interpolate, recipe, &reads);
    }
}

impl Reader<'_> {
    /// True if a level of clumps acts in areas only.
    fn in_areas(&self, i: usize, k: usize) -> bool {
        !self.project.groom.value.layer[i].clump[k].areas.is_empty()
    }

    pub(super) fn clump(&self, i: usize, k: usize) -> Recipe {
        let layer = &self.project.groom.value.layer[i];
        let c = &layer.clump[k];
        let at = format!("layer[{i}].clump[{k}]");
        let mut r = self.unit(Recipe::new("instance/clump", version::CLUMP));
        r = r.param("seed", layer_seed(&layer.name), self.in_groom(&format!("layer[{i}].name")));
        for v in c.making() {
            r = r.with(self.value(v.name, &format!("{at}.{}", v.name), v.value, 0.0));
        }
        for (name, map) in [("area", &c.area), ("regions", &c.regions)] {
            r = r.with(map.iter().flat_map(|m| self.map_at(name, &format!("{at}.{name}"), m)));
        }
        let by_hand = [
            ("roots", c.roots.as_ref().map(|p| format!("{p:?}"))),
            ("curves", c.curves.as_ref().map(|p| format!("{p:?}"))),
        ];
        for (name, value) in by_hand {
            r = value.into_iter().fold(r, |r, v| r.param(name, v, self.in_groom(&format!("{at}.{name}"))));
        }
        if let Some(level) = c.clusters {
            r = r.param("clusters", level, self.in_groom(&format!("{at}.clusters")));
            r = self.rest(self.clusters(r, None));
        }
        if c.regions.is_some() && c.size.is_none() {
            let density = format!("layer[{i}].density.value");
            r = r.param("layer density", layer.density.value, self.in_groom(&density));
        }
        for (p, parting) in self.project.groom.value.parting.iter().enumerate() {
            let key = format!("parting[{p}].points");
            r = r.param(&format!("parting[{p}]"), format!("{:?}", parting.points), self.in_groom(&key));
        }
        r = self.dividers(r);
        r.param("of", if joins_clumps(c, k) { "clumps" } else { "hairs" }, self.in_groom(&format!("{at}.of")))
    }

    /// Fields of a parameter that varies over the skin, at a frame.
    pub(super) fn value(&self, name: &str, key: &str, v: &LookValue, frame: f64) -> Vec<Field> {
        let at = self.in_groom(key);
        let mut r = Recipe::new("", 0).param(name, v.at(frame), at.clone());
        if v.0.noise != 0.0 {
            r = r.param(&format!("{name}.noise"), v.0.noise, format!("{at}.noise"));
        }
        if !v.0.vary.is_empty() {
            r = r.param(&format!("{name}.vary"), format!("{:?}", v.0.vary), format!("{at}.vary"));
        }
        r.with(v.map().iter().flat_map(|m| self.map_at(name, key, m))).fields
    }

    /// What one part of a layer's look reads at a frame, or at rest.
    fn effect(&self, i: usize, effect: Effect, frame: Option<i32>) -> Vec<Field> {
        let layer = &self.project.groom.value.layer[i];
        let key = effect.key();
        let at = format!("layer[{i}].{key}");
        let seed = layer_seed(&layer.name);
        let mut r = Recipe::new("", 0).param(&format!("{key}.seed"), seed, self.in_groom(&format!("layer[{i}].name")));
        let moment = self.project.moment(frame);
        let areas = matches!(effect, Effect::Clump(k) if self.in_areas(i, k));
        if frame.is_none() && (areas || effect == Effect::Wind) {
            return Vec::new();
        }
        for v in layer.acting(&key) {
            if areas && matches!(v.name, "percent" | "rate") {
                continue;
            }
            let fields = self.value(&format!("{key}.{}", v.name), &format!("{at}.{}", v.name), v.value, moment);
            let own = if let Effect::Clump(k) = effect { overridden(self.project, i, k, &v) } else { None };
            r = r.with(fields.into_iter().map(|f| match &own {
                Some((shot, keyed)) if f.name == format!("{key}.{}", v.name) => {
                    Field { value: keyed.at(moment).to_string(), label: self.in_shot(shot), ..f }
                }
                _ => f,
            }));
        }
        for (name, value) in self.settings_of(i, effect) {
            r = r.param(&format!("{key}.{name}"), value, self.in_groom(&format!("{at}.{name}")));
        }
        // The clusters at rest are read by the clumps' own step.
        if effect == Effect::Cluster || effect.clusters(self.project, i) && self.project.clusters_move() {
            r = self.rest(self.clusters(r, frame));
        }
        match effect {
            Effect::Clump(k) => {
                let all = self.project.groom.value.emitter.iter().enumerate();
                for (j, e) in all.filter(|(_, e)| layer.clump[k].areas.contains(&e.name)) {
                    for (part, keys) in [("radius", &e.radius), ("percent", &e.percent), ("clump_rate", &e.clump_rate)]
                    {
                        let label = self.in_groom(&format!("emitter[{j}].{part}"));
                        r = r.param(&format!("{key}.area.{}.{part}", e.name), keys, label);
                    }
                }
            }
            Effect::Wave(k) => {
                let map = layer.wave[k].map.as_ref();
                r = r.with(map.iter().flat_map(|m| self.map_at(&format!("{key}.root"), &format!("{at}.map"), m)));
            }
            _ => {}
        }
        r.fields
    }

    /// What else a part of the look says, by key.
    fn settings_of(&self, i: usize, effect: Effect) -> Vec<(String, String)> {
        let layer = &self.project.groom.value.layer[i];
        let mut out: Vec<(String, String)> = Vec::new();
        let mut add = |key: &str, value: &dyn Display| out.push((key.to_owned(), value.to_string()));
        match effect {
            Effect::Cluster => {
                let c = layer.cluster.as_ref().expect("the layer has clusters");
                add("start", &c.start);
                c.level.iter().for_each(|l| add("level", l));
            }
            Effect::Clump(k) => {
                let c = &layer.clump[k];
                add("taper", &c.taper);
                add("keep_length", &c.keep_length);
                c.hold.iter().for_each(|x| add("hold", x));
                if let Some(d) = &c.dilation {
                    add("dilation.mean", &format!("{:?}", d.mean));
                    add("dilation.deviation", &format!("{:?}", d.deviation));
                    add("dilation.scale", &d.scale);
                }
                if let Some(w) = &c.wet {
                    add("wet.width", &w.width);
                    add("wet.opacity", &w.opacity);
                }
            }
            Effect::Curl => {
                let c = layer.curl.as_ref().expect("the layer has curls");
                add("kind", &format!("{:?}", c.kind).to_lowercase());
                add("start", &c.start);
                add("keep_length", &c.keep_length);
                add("per_clump", &c.per_clump);
                c.depth.iter().for_each(|d| add("depth", d));
                c.profile.iter().for_each(|p| add("profile", &format!("{p:?}")));
                for (axis, w) in [("x", &c.x), ("y", &c.y)] {
                    w.iter().flat_map(|w| w.values()).for_each(|(key, x)| add(&format!("{axis}.{key}"), &x));
                }
            }
            Effect::Wave(k) => {
                let w = &layer.wave[k];
                add("shape", &format!("{:?}", w.shape).to_lowercase());
                for (axis, w) in [("x", &w.x), ("y", &w.y)] {
                    w.settings().into_iter().for_each(|(key, x)| add(&format!("{axis}.{key}"), &x));
                }
                add("size", &w.size);
                add("stray", &w.stray);
                add("keep_length", &w.keep_length);
            }
            Effect::Noise(k) => {
                let n = &layer.noise[k];
                add("size", &n.size);
                add("across", &n.across);
                add("keep_length", &n.keep_length);
                n.profile.iter().for_each(|p| add("profile", &format!("{p:?}")));
            }
            Effect::Wind => {
                let w = layer.wind.as_ref().expect("the layer has wind");
                add("direction", &format!("{:?}", w.direction));
                add("frequency", &w.frequency);
                add("size", &w.size);
                add("gust", &w.gust);
            }
        }
        out
    }

    /// Particles of all emitters.
    fn hits(&self) -> Recipe {
        let shot = &self.project.shot.value.shot;
        let mut r = Recipe::new("interpolate/areas", version::AREAS).param("fps", shot.fps, self.in_shot("shot.fps"));
        let emitters = self.project.groom.value.emitter.iter().enumerate();
        for (k, e) in emitters.filter(|(k, _)| self.project.opens_areas(*k)) {
            let name = format!("emitter[{k}]");
            let mut values = vec![("spread", e.spread.to_string()), ("rate", e.rate.to_string())];
            values.extend(e.position.iter().map(|p| ("position", p.to_string())));
            values.extend(e.direction.iter().map(|d| ("direction", d.to_string())));
            values.extend(e.frames.iter().map(|f| ("frames", format!("{f:?}"))));
            values.push(("seed", e.seed.to_string()));
            for (key, value) in values.into_iter().filter(|_| e.file.is_none()) {
                r = r.param(&format!("{name}.{key}"), value, self.in_groom(&format!("{name}.{key}")));
            }
            r = self.project.particles[k]
                .iter()
                .fold(r, |r, f| r.file(&format!("{name}.file"), &f.hash, f.label.clone()));
        }
        r.param("first", shot.frames[0], self.in_shot("shot.frames (first)"))
    }
}
