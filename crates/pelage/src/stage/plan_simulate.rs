//! What a stretch of the simulation reads.

use super::Stage;
use super::plan::{Plan, Reader, What, version};
use crate::cache::{Key, Recipe};
use crate::config::{BodyKind, Keyed, Target};
use crate::project::{Project, SkinAt, SkinMotion};
use crate::timeline::{STEP, Timeline};

impl Plan {
    /// Adds a stretch, chained to the one before it.
    pub(super) fn add_stretch(&mut self, r: &Reader<'_>, timeline: &Timeline<'_>, i: usize, k: u32) {
        let frames = timeline.stretch(k);
        let recipe = self.stretch(r, timeline, i, k, *frames.end());
        let name = format!("simulate/{}/{}", r.project.groom.value.layer[i].name, frames.start());
        let mut reads = vec![hairs(r.project, i)];
        reads.extend((k > 0).then(|| What::Simulate(i, k - 1)));
        self.push(What::Simulate(i, k), name, Stage::Simulate, recipe, reads);
    }

    /// Recipe of a stretch that ends with frame `end`. Layers do not enter by name: two that simulate the same control
    /// hairs alike share the result.
    fn stretch(&self, r: &Reader<'_>, timeline: &Timeline<'_>, i: usize, k: u32, end: i64) -> Recipe {
        let mut recipe = r.stretch(timeline, i, k, end).step("hairs", &self.step(hairs(r.project, i)).key);
        if k > 0 {
            recipe = recipe.step("before", &self.step(What::Simulate(i, k - 1)).key);
        }
        recipe
    }

    /// Keys that a stretch would have if it ended earlier, with its last frame, the longest first: where the shot has
    /// grown, simulation goes on from there.
    pub fn shorter(&self, project: &Project, i: usize, k: u32) -> impl Iterator<Item = (i64, Key)> {
        let timeline = Timeline::new(project);
        let frames = timeline.stretch(k);
        let ends = (*frames.start()..*frames.end()).rev();
        ends.map(move |end| (end, self.stretch(&Reader::new(project), &timeline, i, k, end).key()))
    }
}

/// The step that makes the hairs that are simulated.
fn hairs(project: &Project, i: usize) -> What {
    if project.target(i) == Target::EveryHair { What::Rest(i) } else { What::Comb }
}

impl Reader<'_> {
    fn stretch(&self, timeline: &Timeline<'_>, i: usize, k: u32, end: i64) -> Recipe {
        let shot = &self.project.shot.value;
        let r = self.unit(self.rest(Recipe::new("simulate", version::SIMULATE)));
        let r = r.param("target", self.project.target(i).name(), self.in_shot("simulate.target"));
        let r = r.param("fps", shot.shot.fps, self.in_shot("shot.fps"));
        let r = self.settings(r);
        let mut r = self.material(r, i);
        let first = *timeline.stretch(k).start();
        r = r.param("frames", format!("{first}-{end}"), self.in_shot("shot.frames (simulated)"));
        let simulated = *timeline.simulated(k).start()..=end;
        r = self.forces(r, *simulated.start() - 1, end);
        r = self.body(r, *simulated.start() - 1, end);
        let arrival = timeline.arrival();
        if k == 0 {
            r = r.param("preroll", timeline.preroll, self.in_shot("shot.preroll"));
        }
        if k == 0 && arrival > timeline.start() {
            r = r.param("arrival", arrival - first, self.in_shot("skin (frames before the first)"));
            r = self.easing(r, timeline, arrival, end);
        }
        let from = if k == 0 { timeline.start().max(arrival) } else { first };
        for frame in from..=end {
            r = self.skin_at(r, timeline, frame, frame > arrival);
        }
        r
    }

    fn settings(&self, r: Recipe) -> Recipe {
        let s = &self.project.shot.value.simulate;
        let substeps = s.substeps.map_or("automatic".to_owned(), |n| n.to_string());
        let segments = match (&self.project.curves, s.segments) {
            (Some(_), None) => "as they are".to_owned(),
            _ => self.project.segments().to_string(),
        };
        let values = [
            ("model", format!("{:?}", s.model).to_lowercase()),
            ("segments", segments),
            ("substeps", substeps),
            ("sag_free", self.project.sag_free().to_string()),
            ("strain_limit", s.strain_limit.to_string()),
            ("friction", s.friction.to_string()),
            ("offset", s.offset.to_string()),
            ("teleport", s.teleport.to_string()),
            ("sleep", s.sleep.to_string()),
        ];
        let add =
            |r: Recipe, (key, value): (&str, String)| r.param(key, value, self.in_shot(&format!("simulate.{key}")));
        let tolerance = s.tolerance.map(|t| ("tolerance", t.to_string()));
        values.into_iter().chain(tolerance).fold(r, add)
    }

    fn material(&self, r: Recipe, i: usize) -> Recipe {
        let (at, material) = self.project.material(i);
        let varied = material.varied().into_iter();
        let r = varied
            .fold(r, |r, (key, v)| r.with(self.value(&format!("material.{key}"), &format!("{at}.{key}"), v, 0.0)));
        let label = |key: &str| self.in_groom(&format!("{at}.{key}"));
        material.even().into_iter().fold(r, |r, (key, x)| r.param(&format!("material.{key}"), x, label(key)))
    }

    /// Gravity and wind as they are from one frame to another.
    fn forces(&self, r: Recipe, from: i64, to: i64) -> Recipe {
        let shot = &self.project.shot.value;
        let gravity = shot.simulate.gravity.downward(shot.shot.up);
        let frames = (from..=to).map(|f| f as f64);
        let r = r.param("gravity", values(&gravity, frames), self.in_shot("simulate.gravity"));
        let Some(wind) = &shot.simulate.wind else { return r };
        let all: Vec<pelage_sim::Wind> = (from..=to).map(|f| wind.at(f as f64, shot.shot.fps)).collect();
        let velocity = once(all.iter().map(|w| format!("{:?}", w.velocity)));
        let mut r = r.param("wind.velocity", velocity, self.in_shot("simulate.wind.velocity"));
        type Of = fn(&pelage_sim::Wind) -> f64;
        let strengths: [(&str, Of); 6] = [
            ("gust", |w| w.gust),
            ("gust_period", |w| w.gust_period),
            ("turbulence", |w| w.turbulence),
            ("turbulence_size", |w| w.turbulence_size),
            ("turbulence_period", |w| w.turbulence_period),
            ("boundary", |w| w.boundary),
        ];
        for (key, of) in strengths {
            let value = once(all.iter().map(|w| of(w).to_string()));
            r = r.param(&format!("wind.{key}"), value, self.in_shot(&format!("simulate.wind.{key}")));
        }
        if all.iter().any(|w| w.turbulence != 0.0) {
            let drift = once(all.iter().map(|w| format!("{:?}", w.drift)));
            r = r.param("wind.drift", drift, self.in_shot("simulate.wind.velocity (how far it carries)"));
        }
        r.param("wind.seed", wind.seed, self.in_shot("simulate.wind.seed"))
    }

    /// What hair can't enter, apart from the skin's motion.
    fn body(&self, r: Recipe, from: i64, to: i64) -> Recipe {
        let b = &self.project.shot.value.simulate.body;
        let in_shot = |key: &str| self.in_shot(&format!("simulate.body.{key}"));
        let skin = b.skin && self.project.rest.is_some();
        let mut r = r.param("body.skin", skin, in_shot("skin"));
        if skin {
            r = self.axis(r.param("body.kind", b.kind.name(), in_shot("kind")), "body", b.kind, b.axis);
        }
        if skin || !self.project.bodies.is_empty() {
            for (key, x) in [("voxel", b.voxel), ("outside", b.outside), ("inside", b.inside)] {
                r = r.param(&format!("body.{key}"), x, in_shot(key));
            }
        }
        for (i, m) in self.project.bodies.iter().enumerate() {
            let name = format!("mesh[{i}]");
            r = r.file(&name, &m.file.hash, m.file.label.clone());
            r = r.param(&format!("{name}.kind"), m.kind.name(), in_shot(&format!("{name}.kind")));
            r = self.axis(r, &name, m.kind, m.axis);
            for (frame, motion) in m.motion.iter().flat_map(|motion| (from..=to).map(move |f| (f, motion))) {
                let samples = between(motion, frame).filter(|_| frame > from).unwrap_or_default();
                let value = format!("{:?} {samples}", motion.at(frame as f64));
                r = r.file(&format!("skin.{frame}.{name}"), &value, format!("{} at frame {frame}", motion.file.label));
            }
        }
        r
    }

    /// Where a table stands: by its axis, or by the mesh's bounds along the scene's up.
    fn axis(&self, r: Recipe, name: &str, kind: BodyKind, axis: Option<[[f64; 3]; 2]>) -> Recipe {
        if !kind.is_table() {
            return r;
        }
        let up = self.project.shot.value.shot.up;
        let value = axis.map_or_else(|| format!("along {up:?}"), |a| format!("{a:?}"));
        r.param(&format!("{name}.axis"), value, self.in_shot(&format!("simulate.body ({name}.axis)")))
    }

    /// What the way from the rest pose into the motion reads of the motion, where its frames do not say it.
    fn easing(&self, r: Recipe, timeline: &Timeline<'_>, arrival: i64, end: i64) -> Recipe {
        if let Some(m) = &self.project.motion {
            let soon = m.at(arrival as f64 + STEP);
            return r.file("easing", &format!("{soon:?}"), format!("{} after frame {arrival}", m.file.label));
        }
        match timeline.skin_at(arrival + 1) {
            Some(SkinAt::File(file)) if arrival + 1 > end => r.file("easing", &file.hash, file.label.clone()),
            _ => r,
        }
    }

    /// The skin at a frame, and on the way to it from the frame before.
    fn skin_at(&self, r: Recipe, timeline: &Timeline<'_>, frame: i64, way: bool) -> Recipe {
        let name = format!("skin.{frame}");
        if let Some(m) = &self.project.motion {
            let label = format!("{} at frame {frame}", m.file.label);
            let r = r.file(&name, &format!("{:?}", m.at(frame as f64)), label.clone());
            let samples = if way { between(m, frame) } else { None };
            return r.file(&format!("{name}.way"), &samples.unwrap_or_default(), label);
        }
        match timeline.skin_at(frame) {
            Some(SkinAt::File(file)) => r.file(&name, &file.hash, file.label.clone()),
            _ => r,
        }
    }
}

/// The samples of a motion that say where it is between a frame and the one before; `None` if they are at the two frames.
fn between(m: &SkinMotion, frame: i64) -> Option<String> {
    let time = &m.motion.time;
    let [from, to] = [m.seconds(frame as f64 - 1.0), m.seconds(frame as f64)];
    let first = time.partition_point(|t| *t <= from).saturating_sub(1);
    let last = time.partition_point(|t| *t < to).min(time.len() - 1);
    if last == first || (last == first + 1 && time[first] == from && time[last] == to) {
        return None;
    }
    let sample = |i: usize| format!("{:?} {:?} {:?}", time[i], m.motion.translation[i], m.motion.rotation[i]);
    let all: Vec<String> = (first..=last).map(sample).collect();
    let text = format!("{from:?} {to:?} {}", all.join(" "));
    Some(blake3::hash(text.as_bytes()).to_hex().to_string())
}

/// Values at some frames; once, if they are all the same.
fn values(keyed: &Keyed<[f64; 3]>, frames: impl Iterator<Item = f64>) -> String {
    once(frames.map(|f| format!("{:?}", keyed.at(f))))
}

/// Values in a row; once, if they are all the same.
fn once(values: impl Iterator<Item = String>) -> String {
    let all: Vec<String> = values.collect();
    match all.first() {
        Some(first) if all.iter().all(|v| v == first) => first.clone(),
        _ => format!("[{}]", all.join(", ")),
    }
}
