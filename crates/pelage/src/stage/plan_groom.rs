//! What control hairs read.

use super::plan::{Reader, version};
use crate::cache::Recipe;
use crate::config::{Comb, CombKind, Panels, Parting};
use serde::Serialize;

impl Reader<'_> {
    /// What placing control hairs reads.
    pub(super) fn place(&self) -> Recipe {
        let control = &self.project.groom.value.control;
        let mut r = self.unit(self.rest(Recipe::new("groom/place", version::PLACE)));
        let p = &control.placement;
        let at = self.in_groom("control.placement");
        if let Some(d) = &p.per_cm2 {
            r = r.with(self.value("per_cm2", "control.placement.per_cm2", d, 0.0));
        }
        if let Some([u, v]) = p.grid {
            r = r.param("grid", format!("{u} x {v}"), format!("{at}.grid"));
        }
        if p.even {
            r = r.param("even", true, format!("{at}.even"));
        }
        if p.relax > 0 {
            r = r.param("relax", p.relax, format!("{at}.relax"));
        }
        r = self.plain(r, "control.line", &control.line);
        r = self.plain(r, "control.hair", &control.hair);
        if let Some(drawn) = &self.project.drawn {
            r = r.file("curves", &drawn.hash, drawn.label.clone());
        }
        for (i, Parting { points, .. }) in self.project.groom.value.parting.iter().enumerate() {
            r = r.param(
                &format!("parting[{i}]"),
                format!("{points:?}"),
                self.in_groom(&format!("parting[{i}].points")),
            );
        }
        r
    }

    /// What combing reads at a frame, or at rest.
    pub(super) fn comb(&self, frame: Option<i32>) -> Recipe {
        let groom = &self.project.groom.value;
        let mut r = self.unit(self.rest(Recipe::new("groom/comb", version::COMB)));
        r = r.param("points", groom.control.points, self.in_groom("control.points"));
        let (key, length) = self.project.control_length();
        r = r.with(self.feature("length", &key, &length));
        for (i, c) in self.project.shape(frame).comb.iter().enumerate() {
            r = self.comb_fields(r, i, c, frame);
        }
        let control = &groom.control;
        r = r.param("push_up", control.push_up, self.in_groom("control.push_up"));
        // Lines that hair follows keep it too.
        let follows = |c: &Comb| matches!(c.kind, CombKind::Field | CombKind::Flow);
        if control.push_up || groom.comb.iter().any(follows) {
            r = r.param("clearance", control.clearance, self.in_groom("control.clearance"));
        }
        r
    }

    /// What scalp space reads.
    fn scalp(&self, mut r: Recipe) -> Recipe {
        let s = &self.project.groom.value.scalp;
        for (key, v) in [("centre", s.centre), ("up", s.up), ("front", s.front)] {
            let name = format!("scalp.{key}");
            r = v.into_iter().fold(r, |r, v| r.param(&name, format!("{v:?}"), self.in_groom(&name)));
        }
        r.with(s.coordinates.iter().flat_map(|m| self.map("scalp.coordinates", m)))
    }

    /// What says where hair grows.
    pub(super) fn growth(&self, i: usize, mut r: Recipe) -> Recipe {
        let groom = &self.project.groom.value;
        let growth = &groom.scalp.growth;
        if groom.layer[i].in_clusters {
            let name = format!("layer[{i}].in_clusters");
            r = self.scalp(self.rest(r.param("in_clusters", true, self.in_groom(&name))));
            // Their lines and what they are parted into move no root.
            for (k, c) in groom.cluster.iter().enumerate() {
                let at = |key: &str| format!("cluster[{k}].{key}");
                r = self.plain(r, &at("root"), &c.root);
                r = self.plain(r, &at("radius"), &c.radius);
                r = self.plain(r, &at("outline"), &c.outline);
            }
        } else if !growth.is_empty() {
            r = self.scalp(r);
        }
        for (k, line) in growth.iter().enumerate() {
            let name = format!("scalp.growth[{k}]");
            r = r.param(&name, format!("{line:?}"), self.in_groom(&name));
        }
        r
    }

    /// What clusters read at a frame, or at rest.
    pub(super) fn clusters(&self, r: Recipe, frame: Option<i32>) -> Recipe {
        let shape = self.project.shape(frame);
        let r = self.plain(self.scalp(r), "cluster", &shape.cluster);
        self.plain(r, "cluster_edit", &shape.cluster_edit)
    }

    /// Numbers and names of a value, each with its key.
    fn plain(&self, r: Recipe, key: &str, value: &impl Serialize) -> Recipe {
        let value = serde_json::to_value(value).expect("plain numbers and names");
        leaves(key, &value).into_iter().fold(r, |r, (name, value)| r.param(&name, value, self.in_groom(&name)))
    }

    /// Names of the hairs placed one by one, for what chooses among them.
    pub(super) fn names(&self, r: Recipe) -> Recipe {
        let names: Vec<&String> = self.project.groom.value.control.hair.iter().map(|h| &h.name).collect();
        r.param("names", format!("{names:?}"), self.in_groom("control.hair"))
    }

    fn comb_fields(&self, mut r: Recipe, i: usize, c: &Comb, frame: Option<i32>) -> Recipe {
        let name = |key: &str| format!("comb[{i}].{key}");
        let mut add = |key: &str, value: Option<String>| {
            if let Some(value) = value {
                r = std::mem::replace(&mut r, Recipe::new("", 0)).param(&name(key), value, self.in_groom(&name(key)));
            }
        };
        add("kind", Some(format!("{:?}", c.kind)));
        add("points", c.points.as_ref().map(|p| format!("{p:?}")));
        add("hairs", c.hairs.as_ref().map(|n| format!("{n:?}")));
        add("hair", c.hair.clone());
        add("at", c.at.map(|p| format!("{p:?}")));
        add("reach", c.reach.map(|p| format!("{p:?}")));
        // A parting's name means nothing by itself: its place in the list does.
        let parting = |n: &String| self.project.groom.value.parting.iter().position(|p| p.name == *n);
        add("parting", c.parting.as_ref().and_then(parting).map(|p| p.to_string()));
        add("side", c.side.map(|s| format!("{s:?}")));
        add("space", c.space.map(|s| format!("{s:?}")));
        add("control_points", c.control_points.map(|n| n.to_string()));
        add("level", c.level.map(|x| x.to_string()));
        for (key, v) in c.varied() {
            r = r.with(self.value(&name(key), &name(key), v, 0.0));
        }
        if c.hairs.is_some() || c.hair.is_some() {
            r = self.names(r);
        }
        for (key, map) in [("region", &c.region), ("map", &c.map)] {
            r = r.with(map.iter().flat_map(|m| self.map(&name(key), m)));
        }
        if c.kind == CombKind::Cluster {
            r = self.clusters(r, frame);
        }
        self.comb_guides(r, i, c)
    }

    /// What hairs follow.
    fn comb_guides(&self, mut r: Recipe, i: usize, c: &Comb) -> Recipe {
        let at = |key: &str| format!("comb[{i}].{key}");
        r = self.plain(r, &at("primitive"), &c.primitive);
        for (k, p) in c.primitive.iter().enumerate() {
            let name = at(&format!("primitive[{k}].strength"));
            r = r.with(self.value(&name, &name, &p.strength, 0.0));
        }
        r = self.plain(r, &at("divider"), &c.divider);
        r = self.plain(r, &at("element"), &c.element);
        r = self.plain(r, &at("shear"), &c.shear);
        r = self.plain(r, &at("turn"), &c.turn);
        r = self.plain(r, &at("key"), &c.key);
        r = self.plain(r, &at("plane"), &c.plane);
        r = self.plain(r, &at("scalp"), &c.scalp);
        if c.reverse {
            r = r.param(&at("reverse"), true, self.in_groom(&at("reverse")));
        }
        if let Some(file) = self.project.trims.get(&i) {
            r = r.file(&at("file"), &file.hash, file.label.clone());
        }
        let Some(panels) = &c.panels else { return r };
        let name = |key: &str| format!("comb[{i}].panels.{key}");
        r = r.with(self.value(&name("through"), &name("through"), &panels.through, 0.0));
        self.panels_of(i, panels, r)
    }

    /// What the panels of an operation read.
    pub(super) fn panels(&self, i: usize, panels: &Panels) -> Recipe {
        self.panels_of(i, panels, self.rest(Recipe::new("groom/panels", version::PANELS)))
    }

    fn panels_of(&self, i: usize, panels: &Panels, r: Recipe) -> Recipe {
        let name = |key: &str| format!("comb[{i}].panels.{key}");
        match self.project.panels.get(&i) {
            Some(file) => r.file(&name("file"), &file.hash, file.label.clone()),
            None => r.param(&name("most"), panels.most, self.in_groom(&name("most"))),
        }
    }
}

/// Numbers and names of a value with their keys, in order; what is not given is left out.
fn leaves(key: &str, value: &serde_json::Value) -> Vec<(String, String)> {
    use serde_json::Value::{Array, Null, Object};
    match value {
        Null => Vec::new(),
        Object(all) => all.iter().flat_map(|(k, v)| leaves(&format!("{key}.{k}"), v)).collect(),
        Array(all) if all.iter().any(|v| v.is_object()) => {
            all.iter().enumerate().flat_map(|(k, v)| leaves(&format!("{key}[{k}]"), v)).collect()
        }
        Array(all) if all.is_empty() => Vec::new(),
        other => vec![(key.to_owned(), other.to_string())],
    }
}
