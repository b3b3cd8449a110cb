//! What pictures read: the camera, how they are drawn, hairs and shadows of their frames.

use super::Stage;
use super::plan::{Plan, Reader, What, version};
use super::plan_light::shadows;
use crate::cache::Recipe;
use crate::config::{Keyed, Vector};
use crate::project::frame_list;

impl Plan {
    /// Steps of all pictures. `look` makes widths, opacities and colours.
    pub(super) fn add_pictures(&mut self, r: &Reader<'_>, look: &[What]) {
        let project = r.project;
        let layers = 0..project.groom.value.layer.len();
        // Frames that are drawn, and frames by which the camera is placed.
        let of = |drawn: &[i32], framed: &[i32]| {
            let mut frames = drawn.to_vec();
            if project.shot.value.preview.camera.is_none() {
                frames.extend(framed.iter().filter(|f| !drawn.contains(f)));
            }
            let hairs = frames.iter().flat_map(|f| layers.clone().map(|i| What::Frame(i, *f)));
            let shadows = drawn.iter().flat_map(|f| shadows(project, *f, false));
            look.iter().copied().chain(hairs).chain(shadows).collect::<Vec<What>>()
        };
        let (still, sheet) = (project.still_frame(), project.sheet_frames());
        let mut add = |what, name: String, recipe, reads: &[What]| {
            self.add(what, format!("preview/{name}"), Stage::Preview, recipe, reads);
        };
        let frame = r.picture(&[still]).param("frame", still, r.in_shot("preview.frame"));
        add(What::Still, "still".into(), frame.clone(), &of(&[still], &[]));
        let frames = r.picture(&sheet).param("sheet", frame_list(&sheet), r.in_shot("preview.sheet (frames)"));
        add(What::Sheet, "sheet".into(), frames, &of(&sheet, &[]));
        for f in project.frames.keys() {
            let recipe = r.picture(&[*f]).param("sequence", f, "the frame's number");
            let recipe = recipe.param("sheet", frame_list(&sheet), r.in_shot("preview.sheet (frames)"));
            add(What::Picture(*f), format!("sequence/{f}"), recipe, &of(&[*f], &sheet));
        }
        let count = project.shot.value.preview.turntable;
        for k in 0..count {
            let turn = frame.clone().param("turn", format!("{} of {count}", k + 1), r.in_shot("preview.turntable"));
            add(What::Turn(k), format!("turntable/{}", k + 1), turn, &of(&[still], &[]));
        }
    }
}

impl Reader<'_> {
    /// What pictures of frames read.
    fn picture(&self, frames: &[i32]) -> Recipe {
        let p = &self.project.shot.value.preview;
        let s = &p.shade;
        let mut r = self.rest(Recipe::new("preview", version::PREVIEW));
        let place = match &p.camera {
            None => vec![("from", format!("{:?}", p.from())), ("zoom", p.zoom().to_string())],
            Some(c) => {
                let at =
                    |k: &Keyed<Vector>| frames.iter().map(|f| format!("{:?}", k.vectors().at(f64::from(*f)))).collect();
                let fov = frames.iter().map(|f| c.fov.at(f64::from(*f)).to_string()).collect::<Vec<_>>();
                let list = |v: Vec<String>| v.join(" ");
                vec![
                    ("camera.eye", list(at(&c.eye))),
                    ("camera.target", list(at(&c.target))),
                    ("camera.up", format!("{:?}", c.up)),
                    ("camera.fov", list(fov)),
                ]
            }
        };
        let rest = [
            ("size", format!("{:?}", p.size)),
            ("exposure", p.exposure.to_string()),
            ("tone", format!("{:?}", p.tone).to_lowercase()),
            ("depth_cue", p.depth_cue.to_string()),
            ("shade.fur", s.fur.to_string()),
            ("shade.specular", s.specular.to_string()),
            ("shade.through", s.through.to_string()),
            ("shade.guard", s.guard.to_string()),
            ("shade.wetness", s.wetness.to_string()),
        ];
        for (key, value) in place.into_iter().chain(rest) {
            r = r.param(key, value, self.in_shot(&format!("preview.{key}")));
        }
        self.lights_of_pictures(self.along(r)).param(
            "up",
            format!("{:?}", self.project.shot.value.shot.up),
            self.in_shot("shot.up"),
        )
    }
}
