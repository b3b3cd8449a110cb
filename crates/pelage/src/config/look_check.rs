//! Checks of the look that types can't make.

use super::document::{ConfigError, Document};
use super::keyed::{Keyed, Vector};
use super::look_value::{LookValue, Varied, varied};
use super::{Clump, ClumpOf, Curl, CurlKind, GroomFile, Layer, Operator};

impl<T> Document<T> {
    /// Complains about key frames of what is made once.
    pub(super) fn still(&self, at: &str, v: &LookValue) -> Result<(), ConfigError> {
        match v.0.value.0.len() {
            1 => Ok(()),
            _ => Err(self.error(at, "can't have key frames", "it is the same in all frames; give a number")),
        }
    }

    /// Complains about noise and variation of what only a map varies.
    pub(super) fn only_painted(&self, at: &str, v: &LookValue) -> Result<(), ConfigError> {
        for (name, given) in [("noise", v.0.noise != 0.0), ("vary", !v.0.vary.is_empty())] {
            if given {
                return Err(self.error(&format!("{at}.{name}"), "is not read here", "take it out; a map is read"));
            }
        }
        Ok(())
    }

    /// Checks a value, its key frames and how it varies.
    pub(super) fn check_value(&self, at: &str, v: &Varied<'_>) -> Result<(), ConfigError> {
        for k in &v.value.0.value.0 {
            self.within(at, k.value, v.range[0], v.range[1])?;
            self.within(at, k.frame, -1e9, 1e9)?;
        }
        self.check_keys(at, &v.value.0.value)?;
        self.within(&format!("{at}.noise"), v.value.0.noise, 0.0, if v.added { 1e3 } else { 1.0 })?;
        for s in &v.value.0.vary {
            self.within(&format!("{at}.vary"), s.size, 1e-9, 1e9)?;
            self.within(&format!("{at}.vary"), s.deviation, 0.0, 1e3)?;
        }
        Ok(())
    }
}

impl Document<GroomFile> {
    pub(super) fn check_look(&self, at: &str, l: &Layer) -> Result<(), ConfigError> {
        for (key, v) in l.varied() {
            self.check_value(&format!("{at}.{key}.{}", v.name), &v)?;
        }
        for (k, c) in l.clump.iter().enumerate() {
            self.check_clump(&format!("{at}.clump[{k}]"), k, c)?;
        }
        if let Some(c) = &l.curl {
            self.check_curl(&format!("{at}.curl"), c)?;
            if c.per_clump && l.clump.is_empty() {
                let help = "add a [[layer.clump]], or take it out";
                return Err(self.error(&format!("{at}.curl.per_clump"), "the layer has no clumps", help));
            }
        }
        if l.in_clusters {
            self.needs_clusters(&format!("{at}.in_clusters"))?;
        }
        if let Some(c) = &l.cluster {
            self.needs_clusters(&format!("{at}.cluster"))?;
            self.within(&format!("{at}.cluster.start"), c.start, 1e-3, 1.0)?;
            if c.simulate {
                self.check_rest_shape(&format!("{at}.cluster"), &[varied("percent", &c.percent, [0.0, 1.0])])?;
            }
        }
        for (k, c) in l.clump.iter().enumerate().filter(|(_, c)| c.simulate) {
            self.check_rest_shape(&format!("{at}.clump[{k}]"), &c.varied())?;
        }
        if let Some(c) = l.curl.as_ref().filter(|c| c.simulate) {
            self.check_rest_shape(&format!("{at}.curl"), &c.varied())?;
        }
        for (k, w) in l.wave.iter().enumerate() {
            let at = format!("{at}.wave[{k}]");
            for (axis, values) in [("x", w.x.values()), ("y", w.y.values())] {
                for (key, x) in values {
                    self.within(&format!("{at}.{axis}.{key}"), x, -1e6, 1e6)?;
                }
            }
            self.within(&format!("{at}.size"), if w.size == 0.0 { 1.0 } else { w.size }, 1e-9, 1e6)?;
            self.within(&format!("{at}.stray"), w.stray, 0.0, 1.0)?;
        }
        for (k, n) in l.noise.iter().enumerate() {
            let at = format!("{at}.noise[{k}]");
            self.within(&format!("{at}.size"), n.size, 1e-9, 1e6)?;
            self.within(&format!("{at}.across"), n.across, 0.0, 1e6)?;
            self.check_profile(&at, n.profile.as_ref())?;
        }
        if let Some(w) = &l.wind {
            let at = format!("{at}.wind");
            if !w.direction.iter().all(|x| x.is_finite()) || w.direction == [0.0; 3] {
                return Err(self.error(
                    &format!("{at}.direction"),
                    "must be a direction",
                    "for example [1.0, 0.0, 0.0]",
                ));
            }
            self.within(&format!("{at}.size"), w.size, 1e-9, 1e9)?;
            self.within(&format!("{at}.frequency"), w.frequency, 0.0, 1e3)?;
            self.within(&format!("{at}.gust"), w.gust, 0.0, 1.0)?;
        }
        self.within(&format!("{at}.collision.clearance"), l.collision.clearance, 1e-4, 1e3)?;
        self.within(&format!("{at}.collision.held"), l.collision.held, 1e-4, 1e6)?;
        self.check_order(at, l)
    }

    /// Parameters of what is handed to the simulation.
    fn check_rest_shape(&self, at: &str, varied: &[Varied<'_>]) -> Result<(), ConfigError> {
        match varied.iter().find(|v| v.value.0.value.0.len() > 1) {
            None => Ok(()),
            Some(v) => Err(self.error(
                &format!("{at}.{}", v.name),
                "can't have key frames: it makes the rest shape of the simulation",
                "take the keys out, or `simulate`",
            )),
        }
    }

    fn check_clump(&self, at: &str, level: usize, c: &Clump) -> Result<(), ConfigError> {
        let given =
            [c.density.is_some(), c.regions.is_some(), c.roots.is_some(), c.curves.is_some(), c.clusters.is_some()];
        if given.iter().filter(|g| **g).count() != 1 {
            return Err(self.error(
                at,
                "does not say what its clumps are",
                "give one of density, regions, roots, curves, clusters",
            ));
        }
        if c.clusters.is_some() {
            self.needs_clusters(&format!("{at}.clusters"))?;
        }
        if c.clusters.is_some() && c.size.is_some() {
            return Err(self.error(&format!("{at}.size"), "is not read beside clusters", "take it out"));
        }
        for v in c.making() {
            if v.value.0.value.0.len() > 1 {
                let help = "clumps are made once; key percent or rate";
                return Err(self.error(&format!("{at}.{}", v.name), "can't have key frames", help));
            }
        }
        let none = c.roots.as_ref().is_some_and(Vec::is_empty) || c.curves.as_ref().is_some_and(Vec::is_empty);
        let lines =
            c.curves.iter().flatten().map(|l| (l.as_slice(), 2)).chain(c.roots.iter().map(|r| (r.as_slice(), 1)));
        for (line, least) in lines.chain(none.then_some((&[][..], 1))) {
            if line.len() < least || !line.iter().flatten().all(|x| x.is_finite()) {
                let what = "clumps placed by hand need finite points, a curve two or more";
                return Err(self.error(at, what, "root first, at the rest pose, in scene units"));
            }
        }
        if c.of.is_some() && c.density.is_none() {
            let help = "regions and clumps placed by hand are made of hairs";
            return Err(self.error(&format!("{at}.of"), "is read for clumps of a density only", help));
        }
        if c.of == Some(ClumpOf::Clumps) && level == 0 {
            return Err(self.error(
                &format!("{at}.of"),
                "there is no level before the first",
                "list the finest level first",
            ));
        }
        self.within(&format!("{at}.taper"), c.taper, -1.0, 1.0)?;
        if let Some(hold) = c.hold {
            self.within(&format!("{at}.hold"), hold, 1e-6, 1e9)?;
        }
        if let Some(d) = &c.dilation {
            for x in d.mean.iter().chain(&d.deviation) {
                self.within(&format!("{at}.dilation"), *x, 0.0, 1e3)?;
            }
            self.within(&format!("{at}.dilation.scale"), d.scale, 0.0, 1e6)?;
            if !c.rate.is_zero() {
                return Err(self.error(&format!("{at}.rate"), "is not read beside a dilation", "keep one of the two"));
            }
        }
        if let Some(w) = &c.wet {
            self.within(&format!("{at}.wet.width"), w.width, 0.0, 100.0)?;
            self.within(&format!("{at}.wet.opacity"), w.opacity, 0.0, 100.0)?;
        }
        for name in &c.areas {
            if !self.value.emitter.iter().any(|e| e.name == *name) {
                let help = "name one of the [[emitter]] of this file";
                return Err(self.error(&format!("{at}.areas"), format!("there is no emitter `{name}`"), help));
            }
        }
        if c.simulate && c.wet.is_some() {
            let help = "give it to a level that is not simulated";
            return Err(self.error(&format!("{at}.wet"), "a simulated level hands on its shape only", help));
        }
        if c.simulate && !c.areas.is_empty() {
            return Err(self.error(
                &format!("{at}.simulate"),
                "areas come and go in the shot",
                "take one of the two out",
            ));
        }
        Ok(())
    }

    fn check_curl(&self, at: &str, c: &Curl) -> Result<(), ConfigError> {
        let custom = c.kind == CurlKind::Custom;
        for (name, has) in [("radius", c.radius.is_some()), ("pitch", c.pitch.is_some())] {
            if !has && !custom {
                return Err(self.error(at, format!("this kind of curl needs `{name}`"), "in scene units"));
            }
        }
        if c.pitch.iter().flat_map(|p| &p.0.value.0).any(|k| k.value < 1e-12) {
            return Err(self.error(&format!("{at}.pitch"), "must be above 0", "it is the length of a turn"));
        }
        for (name, has) in [("x", c.x.is_some()), ("y", c.y.is_some())] {
            if has != custom {
                let help = if custom { "give both x and y" } else { "write kind = \"custom\"" };
                return Err(self.error(&format!("{at}.{name}"), "goes with kind \"custom\" and no other", help));
            }
        }
        for (axis, wave) in [("x", &c.x), ("y", &c.y)] {
            for (key, x) in wave.iter().flat_map(|w| w.values()) {
                self.within(&format!("{at}.{axis}.{key}"), x, -1e6, 1e6)?;
            }
        }
        if c.depth.is_some() && c.kind != CurlKind::Dished {
            return Err(self.error(&format!("{at}.depth"), "is read by kind \"dished\" only", "take it out"));
        }
        self.within(&format!("{at}.depth"), c.depth.unwrap_or(0.0), 0.0, 100.0)?;
        self.within(&format!("{at}.start"), c.start, 0.0, 1e6)?;
        self.check_profile(at, c.profile.as_ref())
    }

    fn check_profile(&self, at: &str, profile: Option<&Vec<f64>>) -> Result<(), ConfigError> {
        let Some(p) = profile else { return Ok(()) };
        if !(2..=64).contains(&p.len()) {
            return Err(self.error(&format!("{at}.profile"), "must have 2 to 64 stations", "from root to tip"));
        }
        p.iter().try_for_each(|x| self.within(&format!("{at}.profile"), *x, 0.0, 1e3))
    }

    /// Every operator once, and what is simulated before what is not.
    fn check_order(&self, at: &str, l: &Layer) -> Result<(), ConfigError> {
        let order = l.order();
        let count = |o: &Operator| order.iter().filter(|p| *p == o).count();
        if Operator::ALL.iter().any(|o| count(o) > 1 || count(o) == 0 && l.has(*o)) {
            let help = "[\"cluster\", \"clump\", \"curl\", \"wave\", \"noise\", \"wind\"] in another order";
            return Err(self.error(&format!("{at}.order"), "must name every operator of the layer once", help));
        }
        let simulated: Vec<bool> = order.iter().flat_map(|o| l.simulated(*o)).collect();
        if simulated.windows(2).any(|w| !w[0] && w[1]) {
            let what = "an operator that is simulated comes after one that is not";
            return Err(self.error(at, what, "simulate the one before it too, or change `order`"));
        }
        Ok(())
    }

    pub(super) fn check_emitters(&self) -> Result<(), ConfigError> {
        for (i, e) in self.value.emitter.iter().enumerate() {
            let at = format!("emitter[{i}]");
            if e.name.is_empty() || self.value.emitter[..i].iter().any(|o| o.name == e.name) {
                return Err(self.error(
                    &format!("{at}.name"),
                    "is empty or used twice",
                    "name every emitter differently",
                ));
            }
            let own = [e.position.is_some(), e.direction.is_some()];
            if own != [e.file.is_none(); 2] {
                let help = "give `file`, or `position` and `direction`";
                return Err(self.error(&at, "does not say where its particles come from", help));
            }
            let finite = |v: &Vector| v.0.iter().all(|x| x.is_finite());
            if !e.position.iter().flat_map(|p| &p.0).all(|k| finite(&k.value)) {
                return Err(self.error(&format!("{at}.position"), "must be three finite numbers", "in scene units"));
            }
            if !e.direction.iter().all(|d| finite(d) && d.0 != [0.0; 3]) {
                return Err(self.error(&format!("{at}.direction"), "must be a direction", "for example [0, -1, 0]"));
            }
            let position = e.position.iter().flat_map(|p| &p.0);
            position.map(|k| k.frame).try_for_each(|f| self.within(&format!("{at}.position"), f, -1e9, 1e9))?;
            if !e.position.iter().all(Keyed::in_order) {
                let help = "each comes after the one before";
                return Err(self.error(&format!("{at}.position"), "key frames are not in order", help));
            }
            if e.frames.is_some_and(|f| f[0] > f[1]) {
                return Err(self.error(
                    &format!("{at}.frames"),
                    "the last frame comes before the first",
                    "first, last",
                ));
            }
            self.within(&format!("{at}.spread"), e.spread, 0.0, 180.0)?;
            self.within(&format!("{at}.rate"), e.rate, 0.0, 1e5)?;
            for (key, v, most) in
                [("radius", &e.radius, 1e6), ("percent", &e.percent, 1.0), ("clump_rate", &e.clump_rate, 1.0)]
            {
                for k in &v.0 {
                    self.within(&format!("{at}.{key}"), k.value, 0.0, most)?;
                    self.within(&format!("{at}.{key}"), k.frame, -1e9, 1e9)?;
                }
                if !v.in_order() {
                    let help = "each comes after the one before";
                    return Err(self.error(&format!("{at}.{key}"), "key frames are not in order", help));
                }
            }
        }
        Ok(())
    }
}
