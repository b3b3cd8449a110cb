//! Combing: one operation after another on control hairs.

use super::GroomFile;
use super::document::{ConfigError, Document, exactly, some_exactly};
use super::groom::{MapRef, some_points};
use super::guides::{Ball, Element, Panels, Plane, Primitive, Region, Shear};
use super::keys::may_have_keys;
use super::look_value::{LookValue, varied};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One combing operation. Which keys it reads depends on its kind.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct Comb {
    /// What it does.
    pub kind: CombKind,
    /// Names of hairs placed one by one (or beginnings of names, `whisker*`) that it acts on. Default: all hairs.
    pub hairs: Option<Vec<String>>,
    /// Strength, 0 to 1. Default: 1.
    #[serde(default = "super::look::one")]
    pub weight: LookValue,
    /// Painted strength: a map that multiplies the weight.
    pub region: Option<MapRef>,
    /// direction-curve: the curve at the rest pose, scene units, in the direction of combing.
    #[serde(default, deserialize_with = "some_points")]
    pub points: Option<Vec<[f64; 3]>>,
    /// direction-curve, chain: region of influence around the curve or the hair, scene units. Default: everywhere.
    pub radius: Option<LookValue>,
    /// direction-curve, chain: share of the radius over which the influence fades, 0 (hard) to 1. Default: 1.
    pub falloff: Option<LookValue>,
    /// direction-curve, direction-map, field, flow, cluster, smooth: how far hairs turn toward the direction, 0 to 1. Default: 1.
    pub bend: Option<LookValue>,
    /// 0: the whole hair turns at its root; 1: the turn grows from root to tip. Default: 0.
    #[serde(default = "super::look::zero")]
    pub curvature: LookValue,
    /// direction-curve, field, flow, cluster, cut: acts only on one side of a parting.
    pub parting: Option<String>,
    /// direction-curve, field, flow, cluster, cut: the side of that parting, seen along its points from outside.
    pub side: Option<Side>,
    /// direction-map: RGB map of directions (0..1 stands for -1..1); bend, lay-down, length: a map that multiplies.
    pub map: Option<MapRef>,
    /// direction-map: what the map's directions refer to. Default: "root".
    pub space: Option<Space>,
    /// bend: angle at the tip, degrees.
    pub angle: Option<LookValue>,
    /// lay-down: 0 leaves hairs as they are, 1 lays them on the skin.
    pub amount: Option<LookValue>,
    /// length: factor on the control hair's length.
    pub value: Option<LookValue>,
    /// smooth: control points of the B-spline that hairs turn toward, 4 to `control.points`: the fewer, the smoother. Default: 4.
    pub control_points: Option<usize>,
    /// chain: the name of the hair that is moved.
    pub hair: Option<String>,
    /// chain: instead of a name, the hair that stands nearest to this point, scene units.
    #[serde(default, deserialize_with = "some_exactly")]
    pub at: Option<[f64; 3]>,
    /// chain: turns at its joints, one after another.
    #[serde(default)]
    pub turn: Vec<JointTurn>,
    /// chain: where its tip goes, after the turns, scene units.
    #[serde(default, deserialize_with = "some_exactly")]
    pub reach: Option<[f64; 3]>,
    /// mirror: the plane; hair behind it (where its normal does not point) mirrors hair before it.
    pub plane: Option<Plane>,
    /// field: vector fields, whose sum hair follows.
    #[serde(default)]
    pub primitive: Vec<Primitive>,
    /// field: hair rooted on one side of a divider sees only the fields positioned on that side.
    #[serde(default)]
    pub divider: Vec<Region>,
    /// flow: what the flow is made of, besides the body.
    #[serde(default)]
    pub element: Vec<Element>,
    /// flow: the body that the flow goes around. Default: none.
    pub panels: Option<Panels>,
    /// flow: against the flow. Default: false.
    #[serde(default)]
    pub reverse: bool,
    /// cluster: level of the clusters, 0 for those of the file. Default: 0.
    pub level: Option<usize>,
    /// trim: a mesh (PLY); hair ends where it first runs through it.
    pub file: Option<PathBuf>,
    /// cut: where.
    pub shear: Option<Shear>,
    /// cut: lengths at places of the scalp; hair in between is cut to a length in between.
    #[serde(default)]
    pub key: Vec<KeyLength>,
    /// cut: hair gets the length of the shortest way around this ball to its plane. Default: it is cut where it meets the plane.
    pub scalp: Option<Ball>,
}

/// A length of hair at a place.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct KeyLength {
    /// The place, on or near the skin, scene units.
    #[serde(deserialize_with = "exactly")]
    pub at: [f64; 3],
    /// The length there, scene units.
    pub length: f64,
}

/// A turn of a chain at one of its joints.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = may_have_keys)]
pub struct JointTurn {
    /// The joint, 0 at the root.
    pub joint: usize,
    /// Axis and angle: a vector along the normal, u and normal x u of the root, as long as the angle in degrees.
    #[serde(deserialize_with = "exactly")]
    pub turn: [f64; 3],
}

impl Comb {
    /// Values that only some kinds read, by key.
    fn values(&self) -> impl Iterator<Item = (&'static str, &LookValue)> {
        let all = [
            ("radius", &self.radius),
            ("falloff", &self.falloff),
            ("bend", &self.bend),
            ("angle", &self.angle),
            ("amount", &self.amount),
            ("value", &self.value),
        ];
        all.into_iter().filter_map(|(key, v)| Some((key, v.as_ref()?)))
    }

    /// Every value that may vary over the skin, by key.
    pub fn varied(&self) -> Vec<(&'static str, &LookValue)> {
        [("weight", &self.weight), ("curvature", &self.curvature)].into_iter().chain(self.values()).collect()
    }
}

/// What a combing operation does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CombKind {
    /// Turns hairs along a curve in space.
    DirectionCurve,
    /// Turns hairs along painted directions.
    DirectionMap,
    /// Bends hairs in the plane of the normal and their lean.
    Bend,
    /// Lays hairs down toward the skin.
    LayDown,
    /// Scales control hairs.
    Length,
    /// Lets hairs follow a sum of vector fields.
    Field,
    /// Lets hairs follow the streamlines of an ideal flow.
    Flow,
    /// Lets hairs follow the clusters that they are in.
    Cluster,
    /// Takes kinks out: turns hairs toward smooth curves near them.
    Smooth,
    /// Moves a hair and its neighbours joint by joint, or by their tips.
    Chain,
    /// Gives hair on one side of a plane the mirrored shape of that on the other.
    Mirror,
    /// Cuts hairs at planes.
    Cut,
    /// Cuts hairs where they first run through a mesh.
    Trim,
}

/// A side of a parting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Left, seen from outside along the parting's points.
    Left,
    /// Right.
    Right,
}

/// What painted directions refer to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Space {
    /// The root frame: red along the normal, green along u, blue along normal x u.
    #[default]
    Root,
    /// The scene's axes at the rest pose.
    World,
}

impl Document<GroomFile> {
    /// Keys that belong to another kind are refused: nobody should tune a value that nothing reads.
    pub(super) fn check_comb(&self, key: &str, c: &Comb) -> Result<(), ConfigError> {
        use CombKind::{
            Bend, Chain, Cluster, Cut, DirectionCurve, DirectionMap, Field, Flow, LayDown, Length, Mirror, Smooth, Trim,
        };
        let needed = match c.kind {
            DirectionCurve => "points",
            DirectionMap => "map",
            Bend => "angle",
            LayDown => "amount",
            Length => "value",
            Field => "primitive",
            // A body that lets something through is a flow by itself.
            Flow if c.panels.is_none() => "element",
            Flow => "panels",
            Chain | Cluster | Smooth => "",
            Mirror => "plane",
            Trim => "file",
            Cut if c.key.is_empty() => "shear",
            Cut => "key",
        };
        let given: [(&str, bool, &[CombKind]); 27] = [
            ("points", c.points.is_some(), &[DirectionCurve]),
            ("radius", c.radius.is_some(), &[DirectionCurve, Chain]),
            ("falloff", c.falloff.is_some(), &[DirectionCurve, Chain]),
            ("hair", c.hair.is_some(), &[Chain]),
            ("at", c.at.is_some(), &[Chain]),
            ("turn", !c.turn.is_empty(), &[Chain]),
            ("reach", c.reach.is_some(), &[Chain]),
            ("file", c.file.is_some(), &[Trim]),
            ("plane", c.plane.is_some(), &[Mirror]),
            ("control_points", c.control_points.is_some(), &[Smooth]),
            ("bend", c.bend.is_some(), &[DirectionCurve, DirectionMap, Field, Flow, Cluster, Smooth]),
            ("parting", c.parting.is_some(), &[DirectionCurve, Field, Flow, Cluster, Cut]),
            ("side", c.side.is_some(), &[DirectionCurve, Field, Flow, Cluster, Cut]),
            ("map", c.map.is_some(), &[DirectionMap, Bend, LayDown, Length]),
            ("space", c.space.is_some(), &[DirectionMap]),
            ("angle", c.angle.is_some(), &[Bend]),
            ("amount", c.amount.is_some(), &[LayDown]),
            ("value", c.value.is_some(), &[Length]),
            ("primitive", !c.primitive.is_empty(), &[Field]),
            ("divider", !c.divider.is_empty(), &[Field]),
            ("element", !c.element.is_empty(), &[Flow]),
            ("panels", c.panels.is_some(), &[Flow]),
            ("reverse", c.reverse, &[Flow]),
            ("level", c.level.is_some(), &[Cluster]),
            ("shear", c.shear.is_some(), &[Cut]),
            ("key", !c.key.is_empty(), &[Cut]),
            ("scalp", c.scalp.is_some(), &[Cut]),
        ];
        let read = |(name, has, kinds): (_, bool, &[CombKind])| {
            (name, has, kinds.contains(&c.kind) && (has || name == needed))
        };
        self.keys(key, &given.map(read))?;
        self.check_guides(key, c)?;
        if c.kind == Cluster {
            self.needs_clusters(key)?;
        }
        let most = self.value.control.points;
        if c.kind == Smooth && !(4..=most).contains(&c.control_points.unwrap_or(4)) {
            let help =
                format!("splines have 4 control points or more, and no more than control hairs have points ({most})");
            return Err(self.error(&format!("{key}.control_points"), "is out of range", help));
        }
        if c.points.as_ref().is_some_and(|p| p.len() < 2 || !p.iter().flatten().all(|x| x.is_finite())) {
            return Err(self.error(&format!("{key}.points"), "must be two or more finite points", ""));
        }
        if c.parting.is_some() != c.side.is_some() {
            return Err(self.error(key, "`parting` and `side` go together", "give both or none"));
        }
        if let Some(name) = c.parting.as_ref().filter(|n| !self.value.parting.iter().any(|p| p.name == **n)) {
            let help = "name one of the [[parting]] of this file";
            return Err(self.error(&format!("{key}.parting"), format!("there is no parting `{name}`"), help));
        }
        let unit = |name: &str| matches!(name, "weight" | "curvature" | "bend" | "amount" | "falloff");
        for (name, v) in c.varied() {
            let range = match name {
                "angle" => [-720.0, 720.0],
                _ if unit(name) => [0.0, 1.0],
                "radius" => [0.0, f64::MAX],
                _ => [0.0, 1e6],
            };
            self.check_value(&format!("{key}.{name}"), &varied("", v, range))?;
        }
        let turns = c.turn.iter().enumerate().map(|(i, t)| (format!("{key}.turn[{i}].turn"), t.turn));
        for (at, v) in c.reach.iter().map(|v| (format!("{key}.reach"), *v)).chain(turns) {
            v.into_iter().try_for_each(|x| self.within(&at, x, -1e9, 1e9))?;
        }
        if let Some(n) = c.hairs.iter().flatten().find(|n| !self.has_hair(n)) {
            return Err(self.error(&format!("{key}.hairs"), format!("there is no hair `{n}`"), NO_HAIR));
        }
        for (i, k) in c.key.iter().enumerate() {
            k.at.into_iter().try_for_each(|x| self.within(&format!("{key}.key[{i}].at"), x, -1e9, 1e9))?;
            self.within(&format!("{key}.key[{i}].length"), k.length, 0.0, 1e6)?;
        }
        if !c.key.is_empty() && (c.shear.is_some() || c.scalp.is_none()) {
            let help = "a cut has a `shear`, or a `key` with the `scalp` that it lies on";
            return Err(self.error(&format!("{key}.key"), "goes with `scalp`, and not with `shear`", help));
        }
        if c.kind == Chain {
            if c.hair.is_some() == c.at.is_some() || c.turn.is_empty() && c.reach.is_none() {
                let help = "give `hair` or `at`, and `turn` or `reach`";
                return Err(self.error(key, "does not say which hair moves, or how", help));
            }
            if let Some(n) = c.hair.as_ref().filter(|n| n.contains('*') || !self.has_hair(n)) {
                return Err(self.error(&format!("{key}.hair"), format!("there is no hair `{n}`"), NO_HAIR));
            }
            c.at.into_iter().flatten().try_for_each(|x| self.within(&format!("{key}.at"), x, -1e9, 1e9))?;
            let last = self.value.control.points.saturating_sub(2);
            if let Some((i, t)) = c.turn.iter().enumerate().find(|(_, t)| t.joint > last) {
                let what = format!("there is no joint {} that turns anything", t.joint);
                let help = format!("control hairs have joints 0 to {last} (control.points)");
                return Err(self.error(&format!("{key}.turn[{i}].joint"), what, help));
            }
        }
        c.plane.iter().try_for_each(|p| self.check_plane(&format!("{key}.plane"), p))
    }

    pub(super) fn has_hair(&self, pattern: &String) -> bool {
        !self.value.control.named(std::slice::from_ref(pattern)).is_empty()
    }
}

pub(super) const NO_HAIR: &str = "name a [[control.hair]] of this file, or the beginning of some with a *";
