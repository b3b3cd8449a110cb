//! Finding the inputs that a shot and its groom name.

use super::{BodyFile, Frames, InputFile, SkinAt, SkinMotion, frame_list, label};
use crate::Error;
use crate::cache::FileHashes;
use crate::config::{BodyMesh, Document, GroomFile, ShotFile};
use crate::format::csv;
use pelage_geom::motion::RigidTransform;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Farthest that a skin may be from the scene's origin, scene units: what single precision can still square.
const FARTHEST: f64 = 1e18;

pub(super) fn missing<T>(doc: &Document<T>, key: &str, path: &Path) -> crate::config::ConfigError {
    doc.error(key, format!("there is no file {}", path.display()), "paths are relative to the file that names them")
}

/// Every map that a groom names, with the key that names it.
pub(super) fn named_maps(groom: &GroomFile) -> Vec<(String, PathBuf)> {
    let mut out = Vec::new();
    let mut add = |key: String, map: Option<&PathBuf>| out.extend(map.map(|m| (key, m.clone())));
    add("control.length.map".into(), groom.control.length.as_ref().and_then(|f| f.map.as_ref()));
    add("scalp.coordinates.map".into(), groom.scalp.coordinates.as_ref().map(|m| &m.map));
    add(
        "control.placement.per_cm2.map".into(),
        groom.control.placement.per_cm2.as_ref().and_then(|d| d.0.map.as_ref()),
    );
    for (i, c) in groom.comb.iter().enumerate() {
        for (k, p) in c.primitive.iter().enumerate() {
            add(format!("comb[{i}].primitive[{k}].strength.map"), p.strength.0.map.as_ref());
        }
        for (key, v) in c.varied() {
            add(format!("comb[{i}].{key}.map"), v.0.map.as_ref());
        }
        add(format!("comb[{i}].region.map"), c.region.as_ref().map(|m| &m.map));
        add(format!("comb[{i}].map.map"), c.map.as_ref().map(|m| &m.map));
        let through = c.panels.as_ref().and_then(|p| p.through.0.map.as_ref());
        add(format!("comb[{i}].panels.through.map"), through);
    }
    for (i, l) in groom.layer.iter().enumerate() {
        add(format!("layer[{i}].density.map"), l.density.map.as_ref());
        add(format!("layer[{i}].on_off.map"), l.on_off.as_ref().map(|m| &m.map));
        add(format!("layer[{i}].length.map"), l.length.map.as_ref());
        add(format!("layer[{i}].width.map"), l.width.map.as_ref());
        add(format!("layer[{i}].opacity.map"), l.opacity.map.as_ref());
        add(format!("layer[{i}].color.map"), l.color.map.as_ref());
        add(format!("layer[{i}].guard.percent.map"), l.guard.as_ref().and_then(|g| g.percent.0.map.as_ref()));
        for (key, v) in l.material.varied() {
            add(format!("layer[{i}].material.{key}.map"), v.0.map.as_ref());
        }
        for (key, v) in l.varied() {
            add(format!("layer[{i}].{key}.{}.map", v.name), v.value.0.map.as_ref());
        }
        for (key, m) in l.look_maps() {
            add(format!("layer[{i}].{key}.map"), Some(&m.map));
        }
    }
    out
}

/// Finds and hashes the files that a shot and its groom name.
pub(super) struct Finder<'a> {
    /// Folder that labels are relative to.
    pub base: PathBuf,
    pub hashes: &'a mut FileHashes,
    /// Frames before the first that are looked for.
    pub preroll: u32,
}

impl Finder<'_> {
    pub fn file<T>(&mut self, doc: &Document<T>, key: &str, written: &Path) -> Result<InputFile, Error> {
        self.found(doc, key, doc.resolve(written))
    }

    fn found<T>(&mut self, doc: &Document<T>, key: &str, path: PathBuf) -> Result<InputFile, Error> {
        match self.hashes.hash(&path) {
            Ok(hash) => Ok(InputFile { label: label(&self.base, &path), path, hash }),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(missing(doc, key, &path).into()),
            Err(e) => Err(doc.error(key, format!("{}: {e}", path.display()), "").into()),
        }
    }

    pub fn map<T>(&mut self, doc: &Document<T>, key: &str, written: &Path) -> Result<Vec<(u32, InputFile)>, Error> {
        let path = doc.resolve(written);
        let text = path.to_string_lossy().into_owned();
        let Some((before, after)) = text.split_once("<UDIM>") else {
            return Ok(vec![(0, self.found(doc, key, path)?)]);
        };
        let mut tiles = Vec::new();
        for (number, path) in numbered(Path::new(before), after, 4) {
            if (1001..=9999).contains(&number) {
                tiles.push((number as u32, self.found(doc, key, path)?));
            }
        }
        if tiles.is_empty() {
            return Err(missing(doc, key, &path).into());
        }
        Ok(tiles)
    }

    pub fn motion(&mut self, doc: &Document<ShotFile>) -> Result<Option<SkinMotion>, Error> {
        let groom = &doc.value.groom;
        let (path, start, pivot, key) = match &doc.value.skin {
            Some(skin) => (&skin.motion, skin.motion_start, skin.pivot, "skin.motion"),
            None => (&groom.motion, groom.motion_start, groom.pivot, "groom.motion"),
        };
        path.as_ref().map(|path| self.table(doc, key, path, start, pivot)).transpose()
    }

    fn table(
        &mut self,
        doc: &Document<ShotFile>,
        key: &str,
        path: &Path,
        start: Option<f64>,
        pivot: [f64; 3],
    ) -> Result<SkinMotion, Error> {
        let shot = &doc.value.shot;
        let file = self.file(doc, key, path)?;
        let motion = csv::read_motion(&file.path, shot.meters_per_unit, shot.fps)?;
        let start = start.unwrap_or(f64::from(shot.frames[0]));
        Ok(SkinMotion { file, motion, start, pivot, fps: shot.fps })
    }

    pub fn bodies(&mut self, doc: &Document<ShotFile>) -> Result<Vec<BodyFile>, Error> {
        let meshes = doc.value.simulate.body.mesh.iter().enumerate();
        let body = |(i, m): (usize, &BodyMesh)| {
            let key = |name: &str| format!("simulate.body.mesh[{i}].{name}");
            let file = self.file(doc, &key("file"), &m.file)?;
            let path = m.motion.as_ref();
            let motion = path.map(|p| self.table(doc, &key("motion"), p, m.motion_start, m.pivot)).transpose()?;
            let kind = m.kind.unwrap_or(doc.value.simulate.body.kind);
            Ok(BodyFile { file, kind, axis: m.axis, motion })
        };
        meshes.map(body).collect()
    }

    /// The skin at every frame of the shot, and at those of the pre-roll that there are files for.
    pub fn frames(&mut self, doc: &Document<ShotFile>, motion: Option<&SkinMotion>) -> Result<[Frames; 2], Error> {
        let shot = &doc.value.shot;
        let range = shot.frames[0]..=shot.frames[1];
        if let Some(m) = motion {
            let near = |t: &RigidTransform| t.translation.iter().chain(&t.pivot).all(|x| x.abs() <= FARTHEST);
            let at = |f: i32| {
                let t = m.at(f64::from(f));
                if near(&t) {
                    return Ok((f, SkinAt::Rigid(t)));
                }
                let what = format!("{} moves the skin out of all bounds at frame {f}", m.file.label);
                Err(doc.error("skin.motion", what, "translations are in metres; check skin.pivot too").into())
            };
            return Ok([range.map(at).collect::<Result<_, Error>>()?, Frames::new()]);
        }
        let Some(pattern) = doc.value.skin.as_ref().and_then(|s| s.frames.as_ref()) else {
            return Ok([range.map(|f| (f, SkinAt::Rest)).collect(), Frames::new()]);
        };
        let pattern = doc.resolve(pattern);
        let text = pattern.to_string_lossy().into_owned();
        let first = text.find('#').expect("checked: the pattern has a #");
        let width = text[first..].chars().take_while(|c| *c == '#').count();
        let files: BTreeMap<i64, PathBuf> =
            numbered(Path::new(&text[..first]), &text[first + width..], 1).into_iter().collect();
        let gone: Vec<i32> = range.clone().filter(|f| !files.contains_key(&i64::from(*f))).collect();
        if !gone.is_empty() {
            let what = format!("{} has no file for frame {}", pattern.display(), frame_list(&gone));
            return Err(doc.error("skin.frames", what, "every frame of the shot needs a file").into());
        }
        let early = shot.frames[0].saturating_sub(i32::try_from(self.preroll).unwrap_or(i32::MAX));
        let mut of = |range: &mut dyn Iterator<Item = i32>| -> Result<Frames, Error> {
            let files = range.filter_map(|f| Some((f, files.get(&i64::from(f))?)));
            files.map(|(f, file)| Ok((f, SkinAt::File(self.found(doc, "skin.frames", file.clone())?)))).collect()
        };
        Ok([of(&mut range.clone())?, of(&mut (early..*range.start()))?])
    }
}

/// Files named `before` + digits + `after`, by number.
fn numbered(before: &Path, after: &str, digits: usize) -> Vec<(i64, PathBuf)> {
    let text = before.to_string_lossy();
    let (folder, prefix) = text.rsplit_once('/').map_or((".", text.as_ref()), |(f, p)| (f, p));
    let Ok(entries) = std::fs::read_dir(if folder.is_empty() { "/" } else { folder }) else { return Vec::new() };
    let mut out: Vec<(i64, PathBuf)> = entries
        .flatten()
        .filter_map(|e| {
            let name = e.file_name().to_string_lossy().into_owned();
            let number = name.strip_prefix(prefix)?.strip_suffix(after)?;
            let plain = number.strip_prefix('-').unwrap_or(number);
            let good = plain.len() >= digits && plain.bytes().all(|b| b.is_ascii_digit());
            Some((number.parse().ok().filter(|_| good)?, e.path()))
        })
        .collect();
    out.sort();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_files_are_found_whatever_their_padding() {
        let dir = tempfile::tempdir().unwrap();
        for n in ["a.0007.ply", "a.8.ply", "a.x.ply", "b.0009.ply", "a.-3.ply"] {
            std::fs::write(dir.path().join(n), "").unwrap();
        }
        let found = numbered(&dir.path().join("a."), ".ply", 1);
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [-3, 7, 8]);
    }
}
