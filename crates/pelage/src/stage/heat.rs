//! Columns of hairs as pictures show them: one number a hair, or one a point.

use super::plan_look::{acting_clumps, finished_rest};
use super::run::Runner;
use super::{What, clumps, export, groom, interpolate, look, shadow};
use crate::Error;
use pelage_geom::{NONE, Offsets, Vec3, curve};
use rayon::prelude::*;

/// A column that a picture can show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Column {
    /// Length of each hair.
    Length,
    /// Hairs per area around each root, at rest.
    Density,
    /// Diameter.
    Width,
    /// Opacity.
    Opacity,
    /// How much longer each hair is than at rest.
    Strain,
    /// How deep it is in the skin.
    Penetration,
    /// What arrives of a light, or of all that are written.
    Transmittance(Option<String>),
    /// Which clump of a level it is in.
    Clump(usize),
    /// How wet it is.
    Wetness,
}

/// Names of columns as they are typed.
pub const COLUMNS: &str = "length, density, width, opacity, strain, penetration, transmittance, transmittance:LIGHT, clump, clump:LEVEL, wetness";

impl std::str::FromStr for Column {
    type Err = String;

    fn from_str(text: &str) -> Result<Column, String> {
        let (name, of) = text.split_once(':').map_or((text, None), |(name, of)| (name, Some(of)));
        Ok(match (name, of) {
            ("length", None) => Column::Length,
            ("density", None) => Column::Density,
            ("width", None) => Column::Width,
            ("opacity", None) => Column::Opacity,
            ("strain", None) => Column::Strain,
            ("penetration", None) => Column::Penetration,
            ("wetness", None) => Column::Wetness,
            ("transmittance", light) => Column::Transmittance(light.map(str::to_owned)),
            ("clump", None) => Column::Clump(0),
            ("clump", Some(level)) => {
                Column::Clump(level.parse().map_err(|_| format!("`{level}` is not a level: 0, 1 ..."))?)
            }
            _ => return Err(format!("`{text}` is not a column: {COLUMNS}")),
        })
    }
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Column::Length => "length",
            Column::Density => "density",
            Column::Width => "width",
            Column::Opacity => "opacity",
            Column::Strain => "strain",
            Column::Penetration => "penetration",
            Column::Wetness => "wetness",
            Column::Transmittance(None) => "transmittance",
            Column::Transmittance(Some(light)) => return write!(f, "transmittance-{light}"),
            Column::Clump(0) => "clump",
            Column::Clump(level) => return write!(f, "clump-{level}"),
        })
    }
}

/// Values of all hairs of a shot.
pub struct Heat {
    /// For each layer one value a hair or one a point.
    pub values: Vec<Vec<f32>>,
    /// What they are, with their unit.
    pub title: String,
    /// False for names that have no order; negative for none.
    pub scale: bool,
}

/// Values of a column at a frame.
pub fn column(run: &mut Runner<'_>, column: &Column, frame: i32) -> Result<Heat, Error> {
    let count = run.project.groom.value.layer.len();
    let unit = run.project.shot.value.shot.meters_per_unit;
    let at = |i: usize| What::Frame(i, frame);
    let mut each = |of: &mut dyn FnMut(&mut Runner<'_>, usize) -> Result<Vec<f32>, Error>| {
        (0..count).map(|i| of(run, i)).collect::<Result<Vec<_>, Error>>()
    };
    let (values, title) = match column {
        Column::Length => {
            let length = |o: &Offsets, p: &[[f32; 3]]| per_hair(o, |r| 100.0 * unit * curve::length(&p[r]));
            let of = &mut |run: &mut Runner<'_>, i| {
                let offsets = export::thickness(run, i)?.offsets;
                Ok(length(&offsets, &interpolate::hairs(run, at(i))?.position))
            };
            (each(of)?, "length, cm".to_owned())
        }
        Column::Strain => {
            let of = &mut |run: &mut Runner<'_>, i| {
                let offsets = export::thickness(run, i)?.offsets;
                let (now, rest) = (
                    interpolate::hairs(run, at(i))?.position,
                    interpolate::positions(run, finished_rest(run.project, i))?,
                );
                Ok(per_hair(&offsets, |r| 100.0 * (curve::length(&now[r.clone()]) / curve::length(&rest[r]) - 1.0)))
            };
            (each(of)?, "length over that at rest, %".to_owned())
        }
        Column::Density => {
            let cm2 = run_cm2(unit);
            let of = &mut |run: &mut Runner<'_>, i| {
                let share = run.project.share[i] as f32;
                Ok(shadow::density(run, i)?.into_iter().map(|d| d * cm2 / share).collect())
            };
            (each(of)?, "density, hairs per cm2".to_owned())
        }
        Column::Width => {
            let of = &mut |run: &mut Runner<'_>, i| {
                let layer = export::thickness(run, i)?;
                let wet = interpolate::hairs(run, at(i))?.wet_columns(Some(&layer)).0;
                let width = if wet.is_empty() { layer.width } else { wet };
                Ok(width.iter().map(|w| (f64::from(*w) * unit * 1e6) as f32).collect())
            };
            (each(of)?, "width, micrometres".to_owned())
        }
        Column::Opacity => {
            let of = &mut |run: &mut Runner<'_>, i| {
                let layer = export::thickness(run, i)?;
                let wet = interpolate::hairs(run, at(i))?.wet_columns(Some(&layer)).1;
                Ok(if wet.is_empty() { layer.opacity } else { wet })
            };
            (each(of)?, "opacity".to_owned())
        }
        Column::Wetness => {
            let of = &mut |run: &mut Runner<'_>, i| {
                let hairs = export::thickness(run, i)?.offsets.len();
                let wet = interpolate::hairs(run, at(i))?.wet;
                Ok((0..hairs).map(|h| wet.get(h).map_or(0.0, |w| w[2])).collect())
            };
            (each(of)?, "wetness".to_owned())
        }
        Column::Penetration => (penetration(run, frame)?, "depth in the skin, mm".to_owned()),
        Column::Transmittance(light) => (transmittance(run, light.as_deref(), frame)?, title_of(light.as_deref())),
        Column::Clump(level) => return clumps_of(run, *level),
    };
    Ok(Heat { values, title, scale: true })
}

fn title_of(light: Option<&str>) -> String {
    light.map_or("light that arrives".to_owned(), |l| format!("light of {l} that arrives"))
}

/// Square scene units of a square centimetre, inverted.
fn run_cm2(unit: f64) -> f32 {
    (1e-4 / (unit * unit)) as f32
}

fn per_hair(offsets: &Offsets, value: impl Fn(std::ops::Range<usize>) -> f64 + Sync) -> Vec<f32> {
    (0..offsets.len()).into_par_iter().map(|h| value(offsets.range(h)) as f32).collect()
}

/// Millimetres by which each point lies within the skin.
fn penetration(run: &mut Runner<'_>, frame: i32) -> Result<Vec<Vec<f32>>, Error> {
    if run.project.rest.is_none() {
        return Err(Error::input(
            "--show penetration: the shot has no skin",
            format!("give another column: {COLUMNS}"),
        ));
    }
    let (barrier, at, origin) = (look::barrier(run)?, run.project.frames[&frame].clone(), run.origin()?);
    let pose = groom::pose(run, &at)?;
    let bvh = barrier.closed.bvh(&barrier.closed.extend(&pose.position));
    let mm = 1e3 * run.project.shot.value.shot.meters_per_unit;
    let depth = |p: &[f32; 3]| {
        let p = Vec3::from(origin) + Vec3::from(p.map(f64::from));
        bvh.closest(p, f64::INFINITY).map_or(0.0, |c| (-c.signed_distance).max(0.0) * mm) as f32
    };
    let of = |run: &mut Runner<'_>, i| {
        Ok(interpolate::hairs(run, What::Frame(i, frame))?.position.par_iter().map(depth).collect())
    };
    (0..run.project.groom.value.layer.len()).map(|i| of(run, i)).collect()
}

fn transmittance(run: &mut Runner<'_>, light: Option<&str>, frame: i32) -> Result<Vec<Vec<f32>>, Error> {
    let lights = &run.project.shot.value.light;
    if let Some(name) = light {
        let Some(l) = lights.iter().position(|l| l.name == name) else {
            let names: Vec<&str> = lights.iter().map(|l| l.name.as_str()).collect();
            return Err(Error::input(
                format!("--show: the shot has no light `{name}`"),
                format!("it has: {}", names.join(", ")),
            ));
        };
        if !lights[l].is_on(frame) {
            return Err(Error::input(format!("--show: `{name}` is off at frame {frame}"), "choose preview.frame"));
        }
        return shadow::columns(run, l, frame);
    }
    let count = run.project.groom.value.layer.len();
    let of = |run: &mut Runner<'_>, i| Ok(export::thickness(run, i)?.offsets.total());
    let points = (0..count).map(|i| of(run, i)).collect::<Result<Vec<_>, Error>>()?;
    let mut found = shadow::written(run, frame, &points)?;
    if found.iter().any(Vec::is_empty) {
        return Err(Error::input(
            "--show transmittance: no light of the shot is written",
            "name one: transmittance:LIGHT",
        ));
    }
    Ok(found.iter_mut().map(|l| l.swap_remove(0)).collect())
}

fn clumps_of(run: &mut Runner<'_>, level: usize) -> Result<Heat, Error> {
    let count = run.project.groom.value.layer.len();
    let mut values = Vec::new();
    for i in 0..count {
        let hairs = export::thickness(run, i)?.offsets.len();
        let none = vec![-1.0; hairs];
        values.push(match acting_clumps(run.project, i).contains(&level) {
            true => {
                let members = clumps::clumps(run, i, level)?;
                members.clump.iter().map(|c| if *c == NONE { -1.0 } else { *c as f32 }).collect()
            }
            false => none,
        });
    }
    Ok(Heat { values, title: format!("clumps of level {level}"), scale: false })
}
