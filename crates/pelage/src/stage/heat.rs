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

/// Columns that are named by a word alone.
const PLAIN: [(&str, Column); 7] = [
    ("length", Column::Length),
    ("density", Column::Density),
    ("width", Column::Width),
    ("opacity", Column::Opacity),
    ("strain", Column::Strain),
    ("penetration", Column::Penetration),
    ("wetness", Column::Wetness),
];

impl std::str::FromStr for Column {
    type Err = String;

    fn from_str(text: &str) -> Result<Column, String> {
        if let Some((_, column)) = PLAIN.into_iter().find(|(name, _)| *name == text) {
            return Ok(column);
        }
        let (name, of) = text.split_once(':').map_or((text, None), |(name, of)| (name, Some(of)));
        match name {
            "transmittance" => Ok(Column::Transmittance(of.map(str::to_owned))),
            "clump" => {
                let level = of.unwrap_or("0");
                level.parse().map(Column::Clump).map_err(|_| format!("`{level}` is not a level: 0, 1 ..."))
            }
            _ => Err(format!("`{text}` is not a column: {COLUMNS}")),
        }
    }
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Column::Transmittance(Some(light)) => write!(f, "transmittance-{light}"),
            Column::Transmittance(None) => f.write_str("transmittance"),
            Column::Clump(0) => f.write_str("clump"),
            Column::Clump(level) => write!(f, "clump-{level}"),
            plain => f.write_str(PLAIN.iter().find(|(_, c)| c == plain).map_or("", |(name, _)| name)),
        }
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
    let title = match column {
        Column::Length => "length, cm",
        Column::Strain => "length over that at rest, %",
        Column::Density => "density, hairs per cm2",
        Column::Width => "width, micrometres",
        Column::Opacity => "opacity",
        Column::Wetness => "wetness",
        Column::Penetration => "depth in the skin, mm",
        Column::Transmittance(None) => "light that arrives",
        Column::Transmittance(Some(light)) => &format!("light of {light} that arrives"),
        Column::Clump(level) => &format!("clumps of level {level}"),
    };
    let layers = 0..run.project.groom.value.layer.len();
    let values = match column {
        Column::Penetration => penetration(run, frame)?,
        Column::Transmittance(light) => transmittance(run, light.as_deref(), frame)?,
        Column::Clump(level) => layers.map(|i| clump(run, i, *level)).collect::<Result<_, Error>>()?,
        _ => layers.map(|i| of_layer(run, column, i, frame)).collect::<Result<_, Error>>()?,
    };
    Ok(Heat { values, title: title.to_owned(), scale: !matches!(column, Column::Clump(_)) })
}

/// Values of a layer that follow from its hairs and columns alone.
fn of_layer(run: &mut Runner<'_>, column: &Column, i: usize, frame: i32) -> Result<Vec<f32>, Error> {
    let unit = run.project.shot.value.shot.meters_per_unit;
    if *column == Column::Density {
        let per = (1.0 / (run.project.cm2_per_unit2() * run.project.share[i])) as f32;
        return Ok(shadow::density(run, i)?.into_iter().map(|d| d * per).collect());
    }
    let (layer, hairs) = (export::thickness(run, i)?, interpolate::hairs(run, What::Frame(i, frame))?);
    let offsets = layer.offsets.clone();
    let length = |p: &[[f32; 3]], r| curve::length(&p[r]);
    let (width, opacity) = match hairs.wet.is_empty() {
        true => (layer.width, layer.opacity),
        false => hairs.wet_columns(Some(&layer)),
    };
    Ok(match column {
        Column::Length => per_hair(&offsets, |r| 100.0 * unit * length(&hairs.position, r)),
        Column::Strain => {
            let rest = interpolate::positions(run, finished_rest(run.project, i))?;
            per_hair(&offsets, |r| 100.0 * (length(&hairs.position, r.clone()) / length(&rest, r) - 1.0))
        }
        Column::Width => width.iter().map(|w| (f64::from(*w) * unit * 1e6) as f32).collect(),
        Column::Opacity => opacity,
        _ => (0..offsets.len()).map(|h| hairs.wet.get(h).map_or(0.0, |w| w[2])).collect(),
    })
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
    // As collision sees it; asked once before many threads do.
    bvh.is_folded();
    let depth = |p: &[f32; 3]| {
        let p = Vec3::from(origin) + Vec3::from(p.map(f64::from));
        bvh.closest_outside(p, f64::INFINITY).map_or(0.0, |c| (-c.signed_distance).max(0.0) * mm) as f32
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

/// Number of each hair's clump; -1 without one.
fn clump(run: &mut Runner<'_>, i: usize, level: usize) -> Result<Vec<f32>, Error> {
    if !acting_clumps(run.project, i).contains(&level) {
        return Ok(vec![-1.0; export::thickness(run, i)?.offsets.len()]);
    }
    let members = clumps::clumps(run, i, level)?;
    Ok(members.clump.iter().map(|c| if *c == NONE { -1.0 } else { *c as f32 }).collect())
}
