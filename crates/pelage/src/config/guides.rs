//! Combing along fields: vector fields, and flow around a body.

use super::GroomFile;
use super::comb::Comb;
use super::document::{ConfigError, Document, exactly, some_exactly};
use super::groom::some_points;
use super::keys::may_have_keys;
use super::look_value::{LookValue, varied};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Most panels of a body: 8 bytes times their square are needed, and time as their cube.
const MOST_PANELS: usize = 8000;

/// A vector field, for combing of the kind "field". Hair follows the sum of all of them.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Primitive {
    /// Its direction at a point.
    pub orientation: Orientation,
    /// constant: the direction. wave: where hair runs.
    #[serde(default, deserialize_with = "some_exactly")]
    pub direction: Option<[f64; 3]>,
    /// along, roller: a line, at least two points.
    #[serde(default, deserialize_with = "some_points")]
    pub points: Option<Vec<[f64; 3]>>,
    /// roller: radius of the roller, scene units.
    pub radius: Option<f64>,
    /// roller: way along the roller for the same way around it. Default: 0.1.
    pub pitch: Option<f64>,
    /// wave: where hair sways.
    #[serde(default, deserialize_with = "some_exactly")]
    pub sway: Option<[f64; 3]>,
    /// wave: its length, scene units.
    pub wavelength: Option<f64>,
    /// wave: greatest slope. Default: 0.5.
    pub amplitude: Option<f64>,
    /// wave: degrees; at 0 it begins at its steepest. Default: 0.
    pub phase: Option<f64>,
    /// Origin of its coordinates, scene units. Default: 0, 0, 0.
    #[serde(default, deserialize_with = "exactly")]
    pub position: [f64; 3],
    /// Turns its coordinates about x, then y, then z, degrees. Default: 0, 0, 0.
    #[serde(default, deserialize_with = "exactly")]
    pub turn: [f64; 3],
    /// Strength against the others; negative turns it round. Default: 1.
    #[serde(default = "super::look::one", skip_serializing)]
    pub strength: LookValue,
    /// How the strength falls with distance from the origin, or from the line. Default: it doesn't.
    pub falloff: Option<Falloff>,
    /// Lengths of its axes that count as distance 1, scene units. Default: 1, 1, 1.
    #[serde(default = "ones", deserialize_with = "exactly")]
    pub shape: [f64; 3],
    /// Acts only on hair rooted in one of these. Default: on all.
    #[serde(default)]
    pub domain: Vec<Region>,
    /// Acts on hair on the other side of dividers too. Default: false.
    #[serde(default)]
    pub across: bool,
}

fn unit() -> f64 {
    1.0
}

fn ones() -> [f64; 3] {
    [1.0; 3]
}

/// The direction of a vector field, in its own coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Orientation {
    /// The same everywhere.
    Constant,
    /// Away from the origin.
    Radial,
    /// Around the z axis.
    Around,
    /// As a line runs at its nearest point.
    Along,
    /// Away from the plane x = 0 on either side.
    Divide,
    /// Around a line as a current in it would have it: hair winds up on a roller.
    Roller,
    /// A wave that runs through space.
    Wave,
}

/// How a strength falls with distance: with `exponent`, or with `from` and `to`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Falloff {
    /// (near / distance)^exponent, and 1 within `near`.
    pub exponent: Option<f64>,
    /// Default: 1.
    pub near: Option<f64>,
    /// Distance up to which the factor is `inner`.
    pub from: Option<f64>,
    /// Distance from which on it is `outer`; half a cosine between.
    pub to: Option<f64>,
    /// Default: 1.
    pub inner: Option<f64>,
    /// Default: 0.
    pub outer: Option<f64>,
}

/// A part of space: an ellipsoid (`centre`, `radii`, `turn`), or the side of a plane that its normal points to (`point`,
/// `normal`).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Region {
    /// Centre of an ellipsoid, scene units.
    #[serde(default, deserialize_with = "some_exactly")]
    pub centre: Option<[f64; 3]>,
    /// Half its axes.
    #[serde(default, deserialize_with = "some_exactly")]
    pub radii: Option<[f64; 3]>,
    /// Turns it about x, then y, then z, degrees. Default: 0, 0, 0.
    #[serde(default, deserialize_with = "exactly")]
    pub turn: [f64; 3],
    /// A point of a plane, scene units.
    #[serde(default, deserialize_with = "some_exactly")]
    pub point: Option<[f64; 3]>,
    /// Its normal, any length.
    #[serde(default, deserialize_with = "some_exactly")]
    pub normal: Option<[f64; 3]>,
}

/// Where hair is cut: at a plane, or at others on both sides of one that parts the scalp.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Shear {
    /// Hair is cut at this plane.
    pub at: Option<Plane>,
    /// A plane that parts the roots.
    pub part: Option<Plane>,
    /// Where hair rooted on the side is cut that the normal of `part` points to.
    pub front: Option<Box<Shear>>,
    /// And on the other.
    pub back: Option<Box<Shear>>,
}

/// A plane.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Plane {
    /// A point of it, scene units.
    #[serde(deserialize_with = "exactly")]
    pub point: [f64; 3],
    /// Its normal, any length.
    #[serde(deserialize_with = "exactly")]
    pub normal: [f64; 3],
}

/// A ball that stands for the scalp.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Ball {
    /// Its centre, scene units.
    #[serde(deserialize_with = "exactly")]
    pub centre: [f64; 3],
    /// Its radius, scene units.
    pub radius: f64,
}

/// An element of ideal flow, for combing of the kind "flow".
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Element {
    /// What it is.
    pub kind: ElementKind,
    /// stream: velocity.
    #[serde(default, deserialize_with = "some_exactly")]
    pub velocity: Option<[f64; 3]>,
    /// source, vortex: a point, scene units.
    #[serde(default, deserialize_with = "some_exactly")]
    pub at: Option<[f64; 3]>,
    /// vortex: direction of its line.
    #[serde(default, deserialize_with = "some_exactly")]
    pub axis: Option<[f64; 3]>,
    /// filament: a line, at least two points.
    #[serde(default, deserialize_with = "some_points")]
    pub points: Option<Vec<[f64; 3]>>,
    /// source: volume a time, negative for a sink. vortex, filament: circulation. Default: 1.
    #[serde(default = "unit")]
    pub strength: f64,
    /// source, vortex, filament: within this distance the velocity falls to zero, scene units. Default: 0.1.
    #[serde(default = "tenth")]
    pub core: f64,
}

fn tenth() -> f64 {
    0.1
}

/// Elements of ideal flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElementKind {
    /// The same velocity everywhere.
    Stream,
    /// Out of a point.
    Source,
    /// Around a line without ends.
    Vortex,
    /// Around a line of some points.
    Filament,
}

/// Panels under the skin that hold a flow off it, for combing of the kind "flow".
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Panels {
    /// At most so many triangles, made from the skin. Default: 1000.
    #[serde(default = "thousand")]
    pub most: usize,
    /// A mesh (PLY) instead of the skin.
    pub file: Option<PathBuf>,
    /// Speed at which the flow comes out of the skin, negative to go in; its map is read where the skin is nearest to a panel.
    /// Default: 0.
    #[serde(default = "super::look::zero")]
    pub through: LookValue,
}

fn thousand() -> usize {
    1000
}

fn is_direction(v: &[f64; 3]) -> bool {
    *v != [0.0; 3] && v.iter().all(|x| x.abs() <= 1e9)
}

impl Document<GroomFile> {
    /// Checks what fields, flows and cuts say.
    pub(super) fn check_guides(&self, key: &str, c: &Comb) -> Result<(), ConfigError> {
        if let Some(s) = &c.shear {
            self.check_shear(&format!("{key}.shear"), s)?;
        }
        if let Some(b) = &c.scalp {
            b.centre.iter().try_for_each(|x| self.within(&format!("{key}.scalp.centre"), *x, -1e9, 1e9))?;
            self.within(&format!("{key}.scalp.radius"), b.radius, 1e-9, 1e9)?;
        }
        for (i, p) in c.primitive.iter().enumerate() {
            self.check_primitive(&format!("{key}.primitive[{i}]"), p)?;
        }
        for (i, d) in c.divider.iter().enumerate() {
            self.check_region(&format!("{key}.divider[{i}]"), d)?;
        }
        for (i, e) in c.element.iter().enumerate() {
            self.check_element(&format!("{key}.element[{i}]"), e)?;
        }
        let Some(p) = &c.panels else { return Ok(()) };
        if !(20..=MOST_PANELS).contains(&p.most) {
            return Err(self.error(&format!("{key}.panels.most"), "is out of range", format!("20 to {MOST_PANELS}")));
        }
        let through = format!("{key}.panels.through");
        self.only_painted(&through, &p.through)?;
        self.check_value(&through, &varied("", &p.through, [-1e6, 1e6]))
    }

    /// Each `(name, given, read)`: what is read must be given, and what is not must not.
    pub(super) fn keys(&self, key: &str, all: &[(&str, bool, bool)]) -> Result<(), ConfigError> {
        for (name, given, read) in all {
            if *given && !read {
                return Err(self.error(&format!("{key}.{name}"), "is not read by this kind", "take it out"));
            }
            if *read && !given {
                return Err(self.error(key, format!("this kind needs `{name}`"), ""));
            }
        }
        Ok(())
    }

    pub(super) fn check_plane(&self, key: &str, p: &Plane) -> Result<(), ConfigError> {
        if !is_direction(&p.normal) || !p.point.iter().all(|x| x.abs() <= 1e9) {
            let help = "for example { point = [0.0, 8.0, 0.0], normal = [0.0, 1.0, 0.0] }";
            return Err(self.error(key, "must be a finite point and a direction", help));
        }
        Ok(())
    }

    fn check_shear(&self, key: &str, s: &Shear) -> Result<(), ConfigError> {
        let parts = s.part.is_some();
        self.keys(
            key,
            &[("at", s.at.is_some(), !parts), ("front", s.front.is_some(), parts), ("back", s.back.is_some(), parts)],
        )?;
        for (name, plane) in [("at", s.at), ("part", s.part)] {
            plane.iter().try_for_each(|p| self.check_plane(&format!("{key}.{name}"), p))?;
        }
        let sides = [("front", &s.front), ("back", &s.back)];
        sides
            .into_iter()
            .filter_map(|(n, s)| Some((n, s.as_ref()?)))
            .try_for_each(|(n, s)| self.check_shear(&format!("{key}.{n}"), s))
    }

    fn check_primitive(&self, key: &str, p: &Primitive) -> Result<(), ConfigError> {
        use Orientation::{Along, Constant, Roller, Wave};
        let is = |kinds: &[Orientation]| kinds.contains(&p.orientation);
        self.keys(
            key,
            &[
                ("direction", p.direction.is_some(), is(&[Constant, Wave])),
                ("points", p.points.is_some(), is(&[Along, Roller])),
                ("radius", p.radius.is_some(), is(&[Roller])),
                ("pitch", p.pitch.is_some(), is(&[Roller]) && p.pitch.is_some()),
                ("sway", p.sway.is_some(), is(&[Wave])),
                ("wavelength", p.wavelength.is_some(), is(&[Wave])),
                ("amplitude", p.amplitude.is_some(), is(&[Wave]) && p.amplitude.is_some()),
                ("phase", p.phase.is_some(), is(&[Wave]) && p.phase.is_some()),
            ],
        )?;
        self.line(&format!("{key}.points"), p.points.as_ref())?;
        for (name, v) in [("direction", p.direction), ("sway", p.sway)] {
            self.direction(&format!("{key}.{name}"), v)?;
        }
        for (name, x) in [("radius", p.radius), ("wavelength", p.wavelength)] {
            self.within(&format!("{key}.{name}"), x.unwrap_or(1.0), 1e-9, 1e9)?;
        }
        self.within(&format!("{key}.pitch"), p.pitch.unwrap_or(0.0), -1e9, 1e9)?;
        let numbers = [("amplitude", p.amplitude), ("phase", p.phase)];
        numbers
            .into_iter()
            .try_for_each(|(name, x)| self.within(&format!("{key}.{name}"), x.unwrap_or(0.0), -1e9, 1e9))?;
        self.check_value(&format!("{key}.strength"), &varied("", &p.strength, [-1e9, 1e9]))?;
        for (name, v) in [("position", p.position), ("turn", p.turn)] {
            v.into_iter().try_for_each(|x| self.within(&format!("{key}.{name}"), x, -1e9, 1e9))?;
        }
        for x in &p.shape {
            self.within(&format!("{key}.shape"), *x, 1e-9, 1e9)?;
        }
        for (i, r) in p.domain.iter().enumerate() {
            self.check_region(&format!("{key}.domain[{i}]"), r)?;
        }
        let Some(f) = &p.falloff else { return Ok(()) };
        let at = format!("{key}.falloff");
        let power = f.exponent.is_some();
        self.keys(
            &at,
            &[
                ("near", f.near.is_some(), power && f.near.is_some()),
                ("from", f.from.is_some(), !power),
                ("to", f.to.is_some(), !power),
                ("inner", f.inner.is_some(), !power && f.inner.is_some()),
                ("outer", f.outer.is_some(), !power && f.outer.is_some()),
            ],
        )?;
        self.within(&format!("{at}.exponent"), f.exponent.unwrap_or(1.0), 1e-3, 100.0)?;
        self.within(&format!("{at}.near"), f.near.unwrap_or(1.0), 1e-9, 1e9)?;
        self.within(&format!("{at}.from"), f.from.unwrap_or(0.0), 0.0, 1e9)?;
        let least = f.from.map_or(1e-9, |from| from * (1.0 + 1e-9) + 1e-12);
        self.within(&format!("{at}.to"), f.to.unwrap_or(1e9), least, 1e9)?;
        [f.inner, f.outer].into_iter().try_for_each(|x| self.within(&at, x.unwrap_or(0.0), -1e9, 1e9))
    }

    fn check_region(&self, key: &str, r: &Region) -> Result<(), ConfigError> {
        let ellipsoid = r.centre.is_some() || r.radii.is_some();
        self.keys(
            key,
            &[
                ("centre", r.centre.is_some(), ellipsoid),
                ("radii", r.radii.is_some(), ellipsoid),
                ("point", r.point.is_some(), !ellipsoid),
                ("normal", r.normal.is_some(), !ellipsoid),
            ],
        )?;
        let numbers = [r.centre, r.point, r.normal, Some(r.turn)].into_iter().flatten().flatten();
        numbers.into_iter().try_for_each(|x| self.within(key, x, -1e9, 1e9))?;
        self.direction(&format!("{key}.normal"), r.normal)?;
        r.radii.iter().flatten().try_for_each(|x| self.within(&format!("{key}.radii"), *x, 1e-9, 1e9))
    }

    fn check_element(&self, key: &str, e: &Element) -> Result<(), ConfigError> {
        use ElementKind::{Filament, Source, Stream, Vortex};
        let is = |kinds: &[ElementKind]| kinds.contains(&e.kind);
        self.keys(
            key,
            &[
                ("velocity", e.velocity.is_some(), is(&[Stream])),
                ("at", e.at.is_some(), is(&[Source, Vortex])),
                ("axis", e.axis.is_some(), is(&[Vortex])),
                ("points", e.points.is_some(), is(&[Filament])),
            ],
        )?;
        self.line(&format!("{key}.points"), e.points.as_ref())?;
        for (name, v) in [("velocity", e.velocity), ("at", e.at)] {
            v.iter().flatten().try_for_each(|x| self.within(&format!("{key}.{name}"), *x, -1e9, 1e9))?;
        }
        self.direction(&format!("{key}.axis"), e.axis)?;
        self.within(&format!("{key}.strength"), e.strength, -1e12, 1e12)?;
        self.within(&format!("{key}.core"), e.core, 0.0, 1e9)
    }

    fn direction(&self, key: &str, v: Option<[f64; 3]>) -> Result<(), ConfigError> {
        match v.is_none_or(|v| is_direction(&v)) {
            true => Ok(()),
            false => Err(self.error(key, "must be a direction", "for example [1.0, 0.0, 0.0]")),
        }
    }

    pub(super) fn line(&self, key: &str, points: Option<&Vec<[f64; 3]>>) -> Result<(), ConfigError> {
        let Some(points) = points else { return Ok(()) };
        let apart = points.windows(2).any(|w| w[0] != w[1]);
        if points.len() < 2 || !apart || !points.iter().flatten().all(|x| x.is_finite()) {
            return Err(self.error(key, "must be two or more finite points that are apart", ""));
        }
        Ok(())
    }
}
