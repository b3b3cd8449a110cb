//! What the choice of the hairs that a shot needs reads.

use super::plan::{Reader, What, version};
use super::plan_look::acting_clumps;
use super::preview::shot_camera;
use crate::cache::{Field, Recipe};
use crate::project::Project;

/// The step that says which hairs a layer has in this shot.
pub fn hairs_of(project: &Project, i: usize) -> What {
    if project.shot.value.skip.any() { What::Kept(i) } else { What::Roots(i) }
}

impl Reader<'_> {
    /// What the choice of a layer's hairs reads apart from their roots.
    pub(super) fn kept(&self, i: usize) -> Recipe {
        let shot = &self.project.shot.value;
        let in_skip = |key: &str| self.in_shot(&format!("skip.{key}"));
        let mut r = self.unit(self.rest(Recipe::new("instance/kept", version::KEPT)));
        r = r.param("margin", shot.skip.margin(shot.shot.meters_per_unit), in_skip("margin"));
        if let (Some(m), Some(tiles)) = (&shot.skip.mask, &self.project.mask) {
            for (tile, file) in tiles {
                r = r.file(&format!("mask.map.{tile}"), &file.hash, file.label.clone());
            }
            r = r.param("mask.channel", format!("{:?}", m.channel), in_skip("mask.channel"));
            r = r.param("mask.wrap", format!("{:?}", m.wrap), in_skip("mask.wrap"));
        }
        if shot.skip.sees() {
            let layer = &self.project.groom.value.layer[i];
            r = r.param("camera", shot.skip.camera, in_skip("camera"));
            r = r.with(self.feature("length", &format!("layer[{i}].length"), &layer.length));
            r = self.guard(i, "length", r);
            r = self.pictures(r);
        }
        if let Some(lod) = shot.skip.lod {
            let layer = &self.project.groom.value.layer[i];
            r = r.param("lod", lod, in_skip("lod"));
            r = r.with(self.feature("width", &format!("layer[{i}].width"), &layer.width.feature()));
            r = self.guard(i, "width", r);
        }
        let of = |k: usize| {
            let named = move |f: Field| Field { name: format!("clump[{k}].{}", f.name), ..f };
            self.clump(i, k).fields.into_iter().map(named)
        };
        r.with(acting_clumps(self.project, i).into_iter().flat_map(of))
    }

    /// Where camera and skin are at every frame.
    fn pictures(&self, mut r: Recipe) -> Recipe {
        let size = self.project.shot.value.preview.size;
        r = r.param("size", format!("{size:?}"), self.in_shot("preview.size"));
        for (frame, at) in &self.project.frames {
            let camera = format!("{:?}", shot_camera(self.project, *frame));
            r = r.param(&format!("camera.{frame}"), camera, self.in_shot("preview.camera"));
            let skin = self.skin(Recipe::new("", 0), at, *frame).fields;
            r = r.with(skin.into_iter().map(|f| Field { name: format!("skin.{frame}"), ..f }));
        }
        r
    }
}
