//! Clusters of hair: where they stand, what they follow, and how they are split, braided and copied.

use super::GroomFile;
use super::document::{ConfigError, Document, exactly, some_exactly};
use super::groom::{MapRef, points, some_points};
use super::keys::may_have_keys;
use super::look_value::LookValue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most clusters of a groom: splitting takes 2 ms each, in every run that needs them.
pub const MOST_CLUSTERS: usize = 5_000;

/// Most parts of one step: relaxing them takes time as their square.
const MOST_PARTS: usize = 100;

/// Scalp space, a plane that roots have coordinates in: polar about a middle (`centre`, `up`, `front`), those of a map, or, if
/// nothing is given, texture coordinates.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scalp {
    /// Middle of the scalp, scene units: coordinates are degrees from `up` as seen from there.
    #[serde(default, deserialize_with = "some_exactly")]
    pub centre: Option<[f64; 3]>,
    /// Direction of the crown, where both coordinates are 0.
    #[serde(default, deserialize_with = "some_exactly")]
    pub up: Option<[f64; 3]>,
    /// Direction of the first coordinate; the second grows to the left of it.
    #[serde(default, deserialize_with = "some_exactly")]
    pub front: Option<[f64; 3]>,
    /// Red and green are the coordinates: what is painted there moves in scalp space.
    pub coordinates: Option<MapRef>,
    /// Closed lines in scalp space, corner after corner: hair grows inside one of them only. Default: everywhere.
    #[serde(default)]
    pub growth: Vec<Vec<[f64; 2]>>,
}

/// A cluster of hair: a cylinder along a line.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Cluster {
    /// Name, unique. Those split from it are `name/0`, `name/1`, and so on.
    pub name: String,
    /// Its root, on or near the rest skin, scene units.
    #[serde(deserialize_with = "exactly")]
    pub root: [f64; 3],
    /// Hair within this distance from its root is its own, scene units. This or `outline`.
    pub radius: Option<f64>,
    /// Hair inside this closed line is its own: corners on or near the rest skin, scene units, to be seen whole from their
    /// middle.
    #[serde(default, deserialize_with = "some_points")]
    pub outline: Option<Vec<[f64; 3]>>,
    /// The line that it follows from its root on, at the rest pose, scene units.
    #[serde(deserialize_with = "points")]
    pub points: Vec<[f64; 3]>,
    /// Radii at equal distances from root to tip, scene units. Default: as wide as where its roots are.
    pub width: Option<Vec<f64>>,
    /// Turns about its line from root to tip. Default: 0.
    #[serde(default)]
    pub twist: f64,
}

/// A step in the making of clusters. Clusters are named by paths: `tail`, `tail/0` for the first that was split from it,
/// `tail/*` for all of them.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct ClusterEdit {
    /// What it does.
    pub kind: ClusterEditKind,
    /// The cluster or clusters.
    pub of: String,
    /// split: into how many. braid: strands, 3, 5, 7 or 9. Default for that: 3.
    pub count: Option<usize>,
    /// twist: turns from root to tip. braid: times that a strand comes back to its side.
    pub turns: Option<f64>,
    /// braid: share of the length over which strands come together. Default: 0.1.
    pub start: Option<f64>,
    /// scale: factors on the width at equal distances from root to tip.
    pub width: Option<Vec<f64>>,
    /// move: the line that it follows from its root on, scene units.
    #[serde(default, deserialize_with = "some_points")]
    pub points: Option<Vec<[f64; 3]>>,
    /// copy: where to, a path; what was split from clusters there goes.
    pub to: Option<String>,
    /// copy: the line, width and twist too, in the other's root frame and size. Default: false, what was split from it.
    #[serde(default)]
    pub whole: bool,
}

/// What a step does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ClusterEditKind {
    /// Parts it among smaller ones side by side.
    Split,
    /// Parts it among strands that weave.
    Braid,
    /// Turns it about its line.
    Twist,
    /// Makes it wider or narrower.
    Scale,
    /// Gives it another line. What was split from it comes along.
    Move,
    /// Copies what was split from it to others.
    Copy,
}

/// Hair follows clusters: the look of a layer.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClusterLook {
    /// How far hairs come to their place in their cluster, 0 to 1. Default: 1.
    #[serde(default = "super::look::one")]
    pub percent: LookValue,
    /// Level of the clusters that they follow: 0 for those of the file. Default: the last that they are in.
    pub level: Option<usize>,
    /// Share of the length over which hairs come from their roots into their cluster. Default: 0.15.
    #[serde(default = "part")]
    pub start: f64,
    /// Hand it to the simulation as the hair's shape. Default: false.
    #[serde(default)]
    pub simulate: bool,
}

fn part() -> f64 {
    0.15
}

impl Document<GroomFile> {
    /// Complains about a key that reads clusters where there are none.
    pub(super) fn needs_clusters(&self, key: &str) -> Result<(), ConfigError> {
        match self.value.cluster.is_empty() {
            true => Err(self.error(key, "there are no clusters", "add a [[cluster]]")),
            false => Ok(()),
        }
    }

    pub(super) fn check_clusters(&self) -> Result<(), ConfigError> {
        let groom = &self.value;
        self.check_scalp(&groom.scalp)?;
        for (i, c) in groom.cluster.iter().enumerate() {
            let at = format!("cluster[{i}]");
            if c.name.is_empty() || c.name.contains(['/', '*']) || groom.cluster[..i].iter().any(|o| o.name == c.name) {
                let help = "name every cluster differently, without / and *";
                return Err(self.error(&format!("{at}.name"), "is empty, used twice or a path", help));
            }
            if c.radius.is_some() == c.outline.is_some() {
                return Err(self.error(&at, "does not say where its roots are", "give one of `radius`, `outline`"));
            }
            let numbers = c.root.iter().chain(c.points.iter().flatten()).chain(c.outline.iter().flatten().flatten());
            numbers.copied().try_for_each(|x| self.within(&at, x, -1e9, 1e9))?;
            if c.points.is_empty() {
                return Err(self.error(&format!("{at}.points"), "must be one or more points", "from root to tip"));
            }
            self.within(&format!("{at}.radius"), c.radius.unwrap_or(1.0), 1e-9, 1e9)?;
            if c.outline.as_ref().is_some_and(|o| o.len() < 3) {
                return Err(self.error(&format!("{at}.outline"), "must have three corners or more", ""));
            }
            self.check_widths(&format!("{at}.width"), c.width.as_ref())?;
            self.within(&format!("{at}.twist"), c.twist, -1e3, 1e3)?;
        }
        let edits = groom.cluster_edit.iter().enumerate();
        edits.map(|(i, e)| (format!("cluster_edit[{i}]"), e)).try_for_each(|(at, e)| self.check_cluster_edit(&at, e))
    }

    fn check_scalp(&self, s: &Scalp) -> Result<(), ConfigError> {
        let polar = [s.centre, s.up, s.front].map(|v| v.is_some());
        if polar.contains(&true) && (polar.contains(&false) || s.coordinates.is_some()) {
            let help = "give `centre`, `up` and `front`, or `coordinates`, or none";
            return Err(self.error("scalp", "does not say how roots get coordinates", help));
        }
        for (key, v) in [("centre", s.centre), ("up", s.up), ("front", s.front)] {
            v.iter().flatten().try_for_each(|x| self.within(&format!("scalp.{key}"), *x, -1e9, 1e9))?;
        }
        if let (Some(up), Some(front)) = (s.up, s.front) {
            let [u, f] = [up, front].map(pelage_geom::Vec3::from);
            if u.cross(&f).norm() <= 1e-6 * u.norm() * f.norm() {
                return Err(self.error("scalp.front", "must be a direction that is not along `up`", ""));
            }
        }
        for (k, line) in s.growth.iter().enumerate() {
            if line.len() < 3 || !line.iter().flatten().all(|x| x.is_finite()) {
                return Err(self.error(&format!("scalp.growth[{k}]"), "must be three or more finite corners", ""));
            }
        }
        Ok(())
    }

    fn check_widths(&self, key: &str, widths: Option<&Vec<f64>>) -> Result<(), ConfigError> {
        let Some(w) = widths else { return Ok(()) };
        if w.is_empty() || w.iter().all(|x| *x == 0.0) {
            return Err(self.error(key, "must have a width above 0", "one number for each station from root to tip"));
        }
        w.iter().try_for_each(|x| self.within(key, *x, 0.0, 1e9))
    }

    fn check_cluster_edit(&self, at: &str, e: &ClusterEdit) -> Result<(), ConfigError> {
        use ClusterEditKind::{Braid, Copy, Move, Scale, Split, Twist};
        let is = |kinds: &[ClusterEditKind]| kinds.contains(&e.kind);
        self.keys(
            at,
            &[
                ("count", e.count.is_some(), is(&[Split]) || is(&[Braid]) && e.count.is_some()),
                ("turns", e.turns.is_some(), is(&[Braid, Twist])),
                ("start", e.start.is_some(), is(&[Braid]) && e.start.is_some()),
                ("width", e.width.is_some(), is(&[Scale])),
                ("points", e.points.is_some(), is(&[Move])),
                ("to", e.to.is_some(), is(&[Copy])),
                ("whole", e.whole, is(&[Copy]) && e.whole),
            ],
        )?;
        for (key, path) in [("of", Some(&e.of)), ("to", e.to.as_ref())] {
            let first = path.map(|p| p.split('/').next().unwrap_or(p));
            if first.is_some_and(|f| f != "*" && !self.value.cluster.iter().any(|c| c.name == f)) {
                let help = "name a [[cluster]] of this file, and what was split from it as name/0 or name/*";
                return Err(self.error(
                    &format!("{at}.{key}"),
                    format!("there is no cluster `{}`", path.expect("given")),
                    help,
                ));
            }
        }
        if e.count.is_some_and(|n| !(1..=MOST_PARTS).contains(&n)) {
            let help = format!("1 to {MOST_PARTS}; split what was split for more");
            return Err(self.error(&format!("{at}.count"), "is out of range", help));
        }
        if e.kind == Braid && e.count.is_some_and(|n| !matches!(n, 3 | 5 | 7 | 9)) {
            return Err(self.error(&format!("{at}.count"), "no such braid", "3, 5, 7 or 9 strands"));
        }
        self.within(&format!("{at}.turns"), e.turns.unwrap_or(0.0), -1e3, 1e3)?;
        self.within(&format!("{at}.start"), e.start.unwrap_or(0.1), 1e-3, 0.999)?;
        if e.points.as_ref().is_some_and(|p| p.is_empty() || !p.iter().flatten().all(|x| x.is_finite())) {
            return Err(self.error(&format!("{at}.points"), "must be one or more finite points", "from root to tip"));
        }
        self.check_widths(&format!("{at}.width"), e.width.as_ref())
    }
}
