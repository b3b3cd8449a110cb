//! What shadows read: one light, the hairs of one frame, and what else stands in its way.

use super::Stage;
use super::plan::{Plan, Reader, What, version};
use crate::cache::Recipe;
use crate::config::{Keyed, Light, LightKind, Shadow, ShadowQuality, Vector};
use crate::project::{Project, SkinAt};
use pelage_geom::Vec3;
use pelage_light::shadow::{Quality, ShadowSettings, Source, for_error};

/// Lights whose columns are written, by number.
pub fn written_lights(project: &Project) -> Vec<usize> {
    let shot = &project.shot.value;
    if shot.export.formats.is_empty() {
        return Vec::new();
    }
    shot.light.iter().enumerate().filter(|(_, l)| l.export).map(|(l, _)| l).collect()
}

/// True if a light's shadows at a frame are read by a file (`written`), or would be by a picture of it.
pub fn is_shadowed(project: &Project, l: usize, frame: i32, written: bool) -> bool {
    (!written || written_lights(project).contains(&l)) && project.shot.value.light[l].is_on(frame)
}

/// Shadows that a file of a frame reads (`written`), or a picture of it.
pub fn shadows(project: &Project, frame: i32, written: bool) -> impl Iterator<Item = What> {
    let all = 0..project.shot.value.light.len();
    all.filter(move |l| is_shadowed(project, *l, frame, written)).map(move |l| What::Shadow(l as u32, frame))
}

/// How shadows are made: maps, or rays where exact ones are asked for.
pub fn settings(shadow: &Shadow) -> Option<ShadowSettings> {
    match (shadow.error, shadow.quality.unwrap_or_default()) {
        (Some(error), _) => Some(for_error(error)),
        (None, ShadowQuality::Draft) => Some(Quality::Draft.settings()),
        (None, ShadowQuality::Default) => Some(Quality::Default.settings()),
        (None, ShadowQuality::Fine) => Some(Quality::Fine.settings()),
        (None, ShadowQuality::Reference) => None,
    }
}

/// A light at a frame.
pub fn source(light: &Light, frame: i32) -> Source {
    let at = f64::from(frame);
    let vector = |v: &Option<Keyed<Vector>>| Vec3::from(v.as_ref().map_or([0.0; 3], |v| v.vectors().at(at)));
    let (direction, position) = (vector(&light.direction), vector(&light.position));
    match light.kind {
        LightKind::Directional => Source::Directional { direction },
        LightKind::Point => Source::Point { position },
        LightKind::Spot => {
            let border = light.border(frame).to_radians();
            let soft = border * light.fade();
            Source::Spot { position, direction, cone: border - soft, softness: soft }
        }
    }
}

impl Plan {
    /// Steps that make the shadows of a frame.
    pub(super) fn add_shadows(&mut self, r: &Reader<'_>, frame: i32, at: &SkinAt) {
        for (l, light) in r.project.shot.value.light.iter().enumerate() {
            if !is_shadowed(r.project, l, frame, false) {
                continue;
            }
            let mut recipe = r.shadow(l, light, frame, at);
            let mut reads = Vec::new();
            // By what they are and not by frame: where nothing moves, one frame is as the other.
            for (i, layer) in r.project.groom.value.layer.iter().enumerate() {
                let columns = match r.project.curves {
                    Some(_) => vec![("curves", What::Curves)],
                    None => vec![("width", What::Width(i)), ("opacity", What::Opacity(i))],
                };
                for (role, what) in columns.into_iter().chain([("hairs", What::Frame(i, frame))]) {
                    recipe = recipe.step(&format!("{role} of {}", layer.name), &self.step(what).key);
                    reads.push(what);
                }
            }
            let name = format!("shadow/{}/{frame}", light.name);
            self.push(What::Shadow(l as u32, frame), name, Stage::Shadow, recipe, reads);
        }
    }
}

impl Reader<'_> {
    /// What the shadows of a light at a frame read apart from hairs.
    fn shadow(&self, l: usize, light: &Light, frame: i32, at: &SkinAt) -> Recipe {
        let project = self.project;
        let mut r = Recipe::new("shadow", version::SHADOW);
        let key = |name: &str| self.in_shot(&format!("light[{l}].{name}"));
        r = r.param("kind", format!("{:?}", light.kind).to_lowercase(), key("kind"));
        let moment = f64::from(frame);
        for (name, v) in [("direction", &light.direction), ("position", &light.position)] {
            r = v.iter().fold(r, |r, v| r.param(name, format!("{:?}", v.vectors().at(moment)), key(name)));
        }
        if light.kind == LightKind::Spot {
            r = r.param("cone", light.border(frame), key("cone"));
            r = r.param("softness", light.fade(), key("softness"));
        }
        let how = match settings(&project.shot.value.shadow) {
            None => format!("{} rays", super::shadow::RAYS),
            Some(s) => format!(
                "{} texels, {} slices, {:?}, filter {}, {:?}",
                s.texels, s.slices, s.placement, s.filter, s.interpolation
            ),
        };
        r = self.widths(r.param("quality", how, self.in_shot("shadow.quality")));
        let shorten = project.shot.value.shadow.shorten;
        if shorten > 0.0 {
            r = r.param("shorten", shorten, self.in_shot("shadow.shorten"));
        }
        for (i, share) in project.share.iter().enumerate().filter(|(_, s)| **s != 1.0) {
            r = r.param(&format!("share[{i}]"), share, "the share of hairs that is drawn");
        }
        if project.rest.is_some() {
            r = self.skin(self.rest(r), at, frame);
        }
        for (k, body) in project.bodies.iter().enumerate() {
            r = r.file(&format!("body[{k}]"), &body.file.hash, body.file.label.clone());
            if let Some(m) = &body.motion {
                let label = format!("{} at frame {frame}", m.file.label);
                r = r.file(&format!("body[{k}].motion"), &format!("{:?}", m.at(moment)), label);
            }
        }
        r
    }

    /// Lights as files have them: which columns there are, and what weighs them.
    pub(super) fn lights_of_files(&self, r: Recipe) -> Recipe {
        written_lights(self.project).into_iter().fold(r, |r, l| self.brightness(l, true, r))
    }

    /// Lights as pictures have them, apart from where they are: their shadows say that.
    pub(super) fn lights_of_pictures(&self, r: Recipe) -> Recipe {
        (0..self.project.shot.value.light.len()).fold(r, |r, l| self.brightness(l, false, r))
    }

    /// How bright a light is, and when.
    fn brightness(&self, l: usize, named: bool, r: Recipe) -> Recipe {
        let light = &self.project.shot.value.light[l];
        let name = if named { format!("{}, ", light.name) } else { String::new() };
        let on = light.frames.map_or(String::new(), |[a, b]| format!(", frames {a} to {b}"));
        let key = format!("light[{l}]");
        let value = format!("{name}intensity {}, color {:?}{on}", light.intensity, light.color);
        let r = r.param(&key, value, self.in_shot(&key));
        if named || light.wrap == 0.0 {
            return r;
        }
        r.param(&format!("{key}.wrap"), light.wrap, self.in_shot(&format!("{key}.wrap")))
    }
}
