//! A shot as it stands on disk: shot file, groom file, and every input file they name, found and hashed.

mod find;

use crate::Error;
use crate::cache::FileHashes;
use crate::config::{
    BodyKind, CombKind, Document, Emitter, Feature, GroomFile, Key, Keyed, Layer, Material, SEGMENTS, ShotFile, Target,
};
use crate::quality::{self, Resolved};
use find::{Finder, missing, named_maps};
use pelage_geom::RigidMotion;
use pelage_geom::motion::RigidTransform;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Frames of pre-roll where the shot does not say: half a second, in which hair that was set in motion by the way from the
/// rest pose comes to follow the skin. Half as many show that way in the first frames; twice as many cost as much as half
/// a second of film more.
const PREROLL: u32 = 12;

/// Hairs a clump has at least in a draft: with fewer it does not look like one, with many more the draft is no faster.
const HAIRS_A_CLUMP: f64 = 5.0;

/// The one layer of hair from a curves file: what the file does not say.
const CURVES_GROOM: &str = r#"
[control]
placement = { per_cm2 = 0 }
[[layer]]
name = "hair"
density = { value = 0 }
length = { value = 0 }
"#;

type Frames = BTreeMap<i32, SkinAt>;

/// An input file and what is in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// Where it is.
    pub path: PathBuf,
    /// The same for people: relative to the shot file's folder where it lies below it.
    pub label: String,
    /// BLAKE3 of its content.
    pub hash: String,
}

/// Where the skin is at a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum SkinAt {
    /// At its rest pose.
    Rest,
    /// Moved as a whole.
    Rigid(RigidTransform),
    /// In a file of its own.
    File(InputFile),
}

/// A skin that moves as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinMotion {
    /// The table.
    pub file: InputFile,
    /// Its samples, scene units.
    pub motion: RigidMotion,
    /// The frame at which its time is 0.
    pub start: f64,
    /// Point that rotations leave in place, scene units.
    pub pivot: [f64; 3],
    fps: f64,
}

impl SkinMotion {
    /// Time in the table at a frame number, seconds.
    pub fn seconds(&self, frame: f64) -> f64 {
        (frame - self.start) / self.fps
    }

    /// Placement at a frame number, which may lie between frames.
    pub fn at(&self, frame: f64) -> RigidTransform {
        self.motion.at(self.seconds(frame), self.pivot)
    }
}

/// A mesh that hair can't enter.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyFile {
    /// The mesh.
    pub file: InputFile,
    /// What stands for it.
    pub kind: BodyKind,
    /// Where its table stands, scene units; `None`: by its bounds.
    pub axis: Option<[[f64; 3]; 2]>,
    /// Its motion, if it moves.
    pub motion: Option<SkinMotion>,
}

/// A shot with its input files.
#[derive(Clone, Debug)]
pub struct Project {
    /// The shot file.
    pub shot: Document<ShotFile>,
    /// The groom file; for hair from a curves file one that has a layer of defaults.
    pub groom: Document<GroomFile>,
    /// The rest pose of the skin, if there is one.
    pub rest: Option<InputFile>,
    /// Curves that are the hair, instead of a groom.
    pub curves: Option<InputFile>,
    /// Curves that control hairs are drawn as, if they are.
    pub drawn: Option<InputFile>,
    /// Meshes that trim hair, by the operation of combing.
    pub trims: BTreeMap<usize, InputFile>,
    /// Meshes whose triangles are the panels of flows, by comb operation.
    pub panels: BTreeMap<usize, InputFile>,
    /// The skin at every frame of the shot.
    pub frames: BTreeMap<i32, SkinAt>,
    /// The skin at frames of the pre-roll that a sequence has files for.
    pub before: BTreeMap<i32, SkinAt>,
    /// Meshes besides the skin that hair can't enter.
    pub bodies: Vec<BodyFile>,
    /// The motion of a skin that moves as a whole.
    pub motion: Option<SkinMotion>,
    /// Files of particles, one entry an emitter.
    pub particles: Vec<Option<InputFile>>,
    /// What was chosen for `simulate.quality`; its settings stand in `shot`.
    pub quality: Option<Resolved>,
    /// The map of `skip.mask`, as `maps` has it.
    pub mask: Option<Vec<(u32, InputFile)>>,
    /// Share of each layer's hairs that this is of: 1 for the shot itself.
    pub share: Vec<f64>,
    /// What the groom file says at each frame, where combing or clusters have key frames.
    pub shapes: BTreeMap<i32, GroomFile>,
    /// Every map, by the path written in the groom file: UDIM number (0 without tiles) and file.
    pub maps: BTreeMap<PathBuf, Vec<(u32, InputFile)>>,
}

impl Project {
    /// Reads both files and finds every input they name.
    pub fn open(shot_file: &Path) -> Result<Self, Error> {
        let mut shot: Document<ShotFile> = Document::read(shot_file)?;
        shot.check()?;
        let quality =
            shot.value.simulate.quality.map(|budget| quality::resolved(shot_file, &budget)).transpose()?.flatten();
        if let Some(Resolved { settings, .. }) = &quality {
            let s = &mut shot.value.simulate;
            (s.segments, s.substeps) = (Some(settings.segments), Some(settings.substeps));
            s.tolerance = Some(settings.tolerance);
        }
        let folders = [("cache.dir", &shot.value.cache.dir), ("export.dir", &shot.value.export.dir)];
        for (key, folder) in folders.map(|(key, written)| (key, shot.resolve(written))) {
            if folder.exists() && !folder.is_dir() {
                let what = format!("{} is not a folder", folder.display());
                return Err(shot.error(key, what, "name a folder; it is made if it is absent").into());
            }
        }
        let mut shapes = BTreeMap::new();
        let groom = match &shot.value.groom.file {
            Some(file) => {
                let path = shot.resolve(file);
                if !path.is_file() {
                    return Err(missing(&shot, "groom.file", &path).into());
                }
                let mut groom: Document<GroomFile> = Document::read_joined(&path)?;
                groom.check()?;
                let [first, last] = shot.value.shot.frames;
                shapes = groom.frames(first..=last)?;
                groom.value = groom.at(f64::from(shot.value.shot.frames[0]));
                groom.value.settle();
                check_motion(&shot, &groom)?;
                groom
            }
            None => Document::parse(&shot.path, CURVES_GROOM.to_owned())?,
        };
        let mut hashes = FileHashes::open(&shot.resolve(&shot.value.cache.dir));
        let base = shot.path.parent().unwrap_or(Path::new("")).to_path_buf();
        let simulated =
            groom.value.layer.iter().any(|l| l.simulate.unwrap_or(shot.value.simulate.target) != Target::Off);
        let preroll = if simulated { preroll(&shot.value) } else { 0 };
        let mut find = Finder { base, hashes: &mut hashes, preroll };
        let rest = shot.value.skin.as_ref().map(|s| find.file(&shot, "skin.rest", &s.rest)).transpose()?;
        let curves = shot.value.groom.curves.as_ref();
        let curves = curves.map(|c| find.file(&shot, "groom.curves", c)).transpose()?;
        let motion = find.motion(&shot)?;
        let [frames, before] = find.frames(&shot, motion.as_ref())?;
        let bodies = if simulated || !shot.value.light.is_empty() { find.bodies(&shot)? } else { Vec::new() };
        let drawn = groom.value.control.placement.curves.as_ref();
        let drawn = drawn.map(|p| find.file(&groom, "control.placement.curves", p)).transpose()?;
        let (mut panels, mut trims) = (BTreeMap::new(), BTreeMap::new());
        for (i, c) in groom.value.comb.iter().enumerate() {
            if let Some(path) = c.panels.as_ref().and_then(|p| p.file.as_ref()) {
                panels.insert(i, find.file(&groom, &format!("comb[{i}].panels.file"), path)?);
            }
            if let Some(path) = &c.file {
                trims.insert(i, find.file(&groom, &format!("comb[{i}].file"), path)?);
            }
        }
        let emitters = groom.value.emitter.iter().enumerate();
        let file = |(k, e): (usize, &Emitter)| {
            e.file.as_ref().map(|f| find.file(&groom, &format!("emitter[{k}].file"), f)).transpose()
        };
        let particles = emitters.map(file).collect::<Result<_, _>>()?;
        check_overrides(&shot, &groom)?;
        let mut maps = BTreeMap::new();
        for (key, path) in named_maps(&groom.value) {
            if let std::collections::btree_map::Entry::Vacant(place) = maps.entry(path) {
                let tiles = find.map(&groom, &key, place.key())?;
                place.insert(tiles);
            }
        }
        let mask = shot.value.skip.mask.as_ref();
        let mask = mask.map(|m| find.map(&shot, "skip.mask.map", &m.map)).transpose()?;
        hashes.save();
        let share = vec![1.0; groom.value.layer.len()];
        Ok(Project {
            shot,
            groom,
            share,
            rest,
            curves,
            bodies,
            drawn,
            panels,
            trims,
            frames,
            before,
            motion,
            particles,
            maps,
            mask,
            quality,
            shapes,
        })
    }

    /// True for a part of the shot's hairs ([`Project::thinned`]).
    pub fn is_draft(&self) -> bool {
        self.share.iter().any(|s| *s != 1.0)
    }

    /// The same shot with `percent` of its hairs, in (0, 100], or as many as its clumps need: a smaller density keeps the
    /// first of the candidates, so each of these hairs is one of the shot's, and as even over the skin. Hair from a curves
    /// file stays as it is.
    pub fn thinned(&self, percent: f64) -> Project {
        let mut out = self.clone();
        for (layer, share) in out.groom.value.layer.iter_mut().zip(&mut out.share) {
            // Fewer hairs than that and clumps would be single hairs.
            let clumps = layer.clump.iter().filter_map(|c| c.density.as_ref()).map(|d| d.at(0.0)).fold(0.0, f64::max);
            let least = if layer.density.value > 0.0 { HAIRS_A_CLUMP * clumps / layer.density.value } else { 0.0 };
            *share = (percent / 100.0).max(least).min(1.0);
            layer.density.value *= *share;
        }
        out
    }

    /// Every input file but the shot and the groom file.
    pub fn inputs(&self) -> Vec<&InputFile> {
        let skins = self.frames.values().chain(self.before.values());
        let skins = skins.filter_map(|at| if let SkinAt::File(file) = at { Some(file) } else { None });
        let motions = self.bodies.iter().map(|b| &b.motion).chain([&self.motion]).flatten().map(|m| &m.file);
        let single = [&self.rest, &self.curves, &self.drawn].into_iter().flatten();
        let maps = self.maps.values().chain(&self.mask).flatten().map(|(_, file)| file);
        let single =
            single.chain(self.particles.iter().flatten()).chain(self.panels.values()).chain(self.trims.values());
        single.chain(skins).chain(self.bodies.iter().map(|b| &b.file)).chain(motions).chain(maps).collect()
    }

    /// Folder of the shot's outputs.
    pub fn out_dir(&self) -> PathBuf {
        self.shot.resolve(&self.shot.value.export.dir).join(&self.shot.value.shot.name)
    }

    /// Folder of the cache.
    pub fn cache_dir(&self) -> PathBuf {
        self.shot.resolve(&self.shot.value.cache.dir)
    }

    /// Square centimetres in a square scene unit.
    pub fn cm2_per_unit2(&self) -> f64 {
        let cm = 100.0 * self.shot.value.shot.meters_per_unit;
        cm * cm
    }

    /// Frame of the preview's still.
    pub fn still_frame(&self) -> i32 {
        let [first, last] = self.shot.value.shot.frames;
        self.shot.value.preview.frame.unwrap_or(first + (last - first) / 2)
    }

    /// Frames of the contact sheet, evenly over the shot.
    pub fn sheet_frames(&self) -> Vec<i32> {
        let [first, last] = self.shot.value.shot.frames;
        let n = i64::from(self.shot.value.preview.sheet).min(i64::from(last) - i64::from(first) + 1);
        let at = |k: i64| first + ((i64::from(last) - i64::from(first)) * k / (n - 1).max(1)) as i32;
        (0..n).map(at).collect()
    }

    /// Length of control hairs before combing, and the key that says so: their own, or the longest layer's value
    /// without its map, so that painting lengths never combs again.
    pub fn control_length(&self) -> (String, Feature) {
        let groom = &self.groom.value;
        if let Some(own) = &groom.control.length {
            return ("control.length".to_owned(), own.clone());
        }
        let value = |i: usize| groom.layer[i].length.value;
        // Lengths of hairs by hand are factors.
        let grown = (0..groom.layer.len()).filter(|i| groom.layer[*i].hairs.is_empty());
        let Some(longest) = grown.reduce(|best, i| if value(i) > value(best) { i } else { best }) else {
            return ("control.length".to_owned(), Feature::constant(1.0));
        };
        let length = Feature { noise: 0.0, map: None, ..groom.layer[longest].length.clone() };
        (format!("layer[{longest}].length"), length)
    }

    /// What the groom file says of combing and clusters at a frame, or at rest.
    pub fn shape(&self, frame: Option<i32>) -> &GroomFile {
        frame.and_then(|f| self.shapes.get(&f)).unwrap_or(&self.groom.value)
    }

    /// True if control hairs change over the shot by themselves.
    pub fn combs_move(&self) -> bool {
        moves_hairs(&self.groom).is_some()
    }

    /// True if clusters change over the shot by themselves.
    pub fn clusters_move(&self) -> bool {
        moving(&self.groom, "cluster").is_some()
    }

    /// What is simulated of a layer.
    pub fn target(&self, i: usize) -> Target {
        self.groom.value.layer[i].simulate.unwrap_or(self.shot.value.simulate.target)
    }

    /// Points of a hair of a layer as it is simulated or interpolated.
    pub fn base_points(&self, i: usize) -> usize {
        match self.target(i) {
            Target::EveryHair => self.segments() + 1,
            _ => self.points(i),
        }
    }

    /// Points of a hair of a layer in the finished frames.
    pub fn points(&self, i: usize) -> usize {
        let groom = &self.groom.value;
        let simulated = self.target(i) == Target::EveryHair;
        let default = if simulated { self.segments() + 1 } else { groom.control.points };
        groom.layer[i].points.unwrap_or(default)
    }

    /// True if hair is clumped where particles hit the skin.
    pub fn has_areas(&self) -> bool {
        (0..self.groom.value.emitter.len()).any(|k| self.opens_areas(k))
    }

    /// True if clumps act where the particles of an emitter hit the skin.
    pub fn opens_areas(&self, emitter: usize) -> bool {
        let name = &self.groom.value.emitter[emitter].name;
        let mut clumps = self.groom.value.layer.iter().flat_map(|l| &l.clump);
        self.shot.value.look.clump && clumps.any(|c| c.areas.contains(name))
    }

    /// Number of the frame whose keys hold: at rest, the shot's first.
    pub fn moment(&self, frame: Option<i32>) -> f64 {
        f64::from(frame.unwrap_or(self.shot.value.shot.frames[0]))
    }

    /// Seconds from the shot's first frame.
    pub fn seconds(&self, frame: Option<i32>) -> f64 {
        (self.moment(frame) - self.moment(None)) / self.shot.value.shot.fps
    }

    /// Segments of a simulated hair of a groom.
    pub fn segments(&self) -> usize {
        self.shot.value.simulate.segments.unwrap_or(SEGMENTS)
    }

    /// True if simulated hair starts in equilibrium under gravity.
    pub fn sag_free(&self) -> bool {
        self.shot.value.simulate.sag_free.unwrap_or(self.curves.is_none())
    }

    /// What the hair of a layer is made of, and the key that says so.
    pub fn material(&self, i: usize) -> (String, Material) {
        match (&self.curves, &self.shot.value.simulate.material) {
            (None, _) => (format!("layer[{i}].material"), self.groom.value.layer[i].material.clone()),
            (Some(_), own) => ("simulate.material".to_owned(), own.clone().unwrap_or_default()),
        }
    }

    /// A path for people: relative to the shot file's folder where it lies below it.
    pub fn label(&self, path: &Path) -> String {
        label(self.shot.path.parent().unwrap_or(Path::new("")), path)
    }
}

/// Frames that are simulated before the first.
pub fn preroll(shot: &ShotFile) -> u32 {
    shot.shot.preroll.unwrap_or(if shot.skin.is_some() { PREROLL } else { 0 })
}

fn label(base: &Path, path: &Path) -> String {
    path.strip_prefix(base).unwrap_or(path).display().to_string()
}

/// The first value with several key frames below a key that begins so.
fn moving<'a>(groom: &'a Document<GroomFile>, start: &str) -> Option<&'a str> {
    groom.keyed().find(|k| k.key.starts_with(start) && k.frame.len() > 1).map(|k| k.key.as_str())
}

/// What moves control hairs.
fn moves_hairs(groom: &Document<GroomFile>) -> Option<&str> {
    let in_clusters = || groom.value.comb.iter().any(|c| c.kind == CombKind::Cluster);
    moving(groom, "comb").or_else(|| moving(groom, "cluster").filter(|_| in_clusters()))
}

/// Key frames move hair that is not simulated.
fn check_motion(shot: &Document<ShotFile>, groom: &Document<GroomFile>) -> Result<(), Error> {
    let simulated = |l: &&Layer| l.simulate.unwrap_or(shot.value.simulate.target) != Target::Off;
    // What is handed to the simulation of every hair is its shape at rest.
    let every = |l: &Layer| l.simulate.unwrap_or(shot.value.simulate.target) == Target::EveryHair;
    let in_shape = |l: &Layer| {
        l.cluster.as_ref().is_some_and(|c| c.simulate) || l.clump.iter().any(|c| c.clusters.is_some() && c.simulate)
    };
    let shaped = |l: &&Layer| every(l) && in_shape(l);
    let layers = || groom.value.layer.iter();
    let (combs, clusters) = (moves_hairs(groom), moving(groom, "cluster"));
    let found = combs.zip(layers().find(simulated)).or_else(|| clusters.zip(layers().find(shaped)));
    let Some((key, l)) = found else { return Ok(()) };
    let what = format!("has key frames, and layer {} is simulated: its hair would not follow them", l.name);
    Err(groom.error(key, what, "set `simulate = \"off\"` for the layer, or take them out").into())
}

/// Levels of clumps that a shot changes must be in its groom.
fn check_overrides(shot: &Document<ShotFile>, groom: &Document<GroomFile>) -> Result<(), Error> {
    for (j, o) in shot.value.look.overrides.iter().enumerate() {
        let at = format!("look.override[{j}]");
        let Some(layer) = groom.value.layer.iter().find(|l| l.name == o.layer) else {
            let what = format!("the groom has no layer `{}`", o.layer);
            return Err(shot.error(&format!("{at}.layer"), what, "name a [[layer]] of the groom file").into());
        };
        if o.clump >= layer.clump.len() {
            let what = format!("layer {} has no level {} of clumps", o.layer, o.clump);
            return Err(shot.error(&format!("{at}.clump"), what, "levels are numbered from 0").into());
        }
        if o.rate.is_some() && layer.clump[o.clump].dilation.is_some() {
            let what = format!("the level has a dilation in {}, beside which no rate is read", groom.path.display());
            return Err(shot.error(&format!("{at}.rate"), what, "take one of the two out").into());
        }
        if !layer.clump[o.clump].areas.is_empty() {
            let what = format!("the level acts in the areas of emitters in {}", groom.path.display());
            return Err(shot.error(&at, what, "key the emitter's percent and clump_rate").into());
        }
        if o.percent.is_none() && o.rate.is_none() {
            return Err(shot.error(&at, "changes nothing", "give percent or rate, or take it out").into());
        }
        for (key, keyed) in [("percent", &o.percent), ("rate", &o.rate)] {
            let within = |k: &Key<f64>| (0.0..=1.0).contains(&k.value) && k.frame.is_finite();
            let fine = |k: &Keyed<f64>| k.in_order() && k.0.iter().all(within);
            if !keyed.iter().all(fine) {
                let help = "a number, or key frames in order";
                return Err(shot.error(&format!("{at}.{key}"), "must be between 0 and 1", help).into());
            }
        }
    }
    Ok(())
}

/// "1001-1003, 1007".
pub fn frame_list(frames: &[i32]) -> String {
    let mut out: Vec<String> = Vec::new();
    let mut i = 0;
    while i < frames.len() {
        let mut j = i;
        while j + 1 < frames.len() && frames[j + 1] == frames[j] + 1 {
            j += 1;
        }
        out.push(if i == j { frames[i].to_string() } else { format!("{}-{}", frames[i], frames[j]) });
        i = j + 1;
    }
    out.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_listed_in_ranges() {
        assert_eq!(frame_list(&[1, 2, 3, 7, 9, 10]), "1-3, 7, 9-10");
        assert_eq!(frame_list(&[]), "");
    }
}
