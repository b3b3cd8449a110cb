//! Combing: one operation after another on control hairs.

use super::GroomFile;
use super::document::{ConfigError, Document};
use super::groom::{MapRef, some_points};
use super::guides::{Ball, Element, Panels, Primitive, Region, Shear};
use schemars::JsonSchema;
use serde::Deserialize;

/// One combing operation. Which keys it reads depends on its kind.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Comb {
    /// What it does.
    pub kind: CombKind,
    /// Strength, 0 to 1. Default: 1.
    #[serde(default = "one")]
    pub weight: f64,
    /// Painted strength: a map that multiplies the weight.
    pub region: Option<MapRef>,
    /// direction-curve: the curve at the rest pose, scene units, in the direction of combing.
    #[serde(default, deserialize_with = "some_points")]
    pub points: Option<Vec<[f64; 3]>>,
    /// direction-curve: region of influence around the curve, scene units. Default: everywhere.
    pub radius: Option<f64>,
    /// direction-curve: share of the radius over which the influence fades, 0 (hard) to 1. Default: 1.
    pub falloff: Option<f64>,
    /// direction-curve, direction-map, field, flow, cluster: how far hairs turn toward the direction, 0 to 1. Default: 1.
    pub bend: Option<f64>,
    /// 0: the whole hair turns at its root; 1: the turn grows from root to tip. Default: 0.
    #[serde(default)]
    pub curvature: f64,
    /// direction-curve, field, flow, cluster, cut: acts only on one side of a parting.
    pub parting: Option<String>,
    /// direction-curve, field, flow, cluster, cut: the side of that parting, seen along its points from outside.
    pub side: Option<Side>,
    /// direction-map: RGB map of directions (0..1 stands for -1..1); bend, lay-down, length: a map that multiplies.
    pub map: Option<MapRef>,
    /// direction-map: what the map's directions refer to. Default: "root".
    pub space: Option<Space>,
    /// bend: angle at the tip, degrees.
    pub angle: Option<f64>,
    /// lay-down: 0 leaves hairs as they are, 1 lays them on the skin.
    pub amount: Option<f64>,
    /// length: factor on the control hair's length.
    pub value: Option<f64>,
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
    /// cut: where.
    pub shear: Option<Shear>,
    /// cut: hair gets the length of the shortest way around this ball to its plane. Default: it is cut where it meets the plane.
    pub scalp: Option<Ball>,
}

pub(super) fn one() -> f64 {
    1.0
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
    /// Cuts hairs at planes.
    Cut,
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
        use CombKind::{Bend, Cluster, Cut, DirectionCurve, DirectionMap, Field, Flow, LayDown, Length};
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
            Cluster => "",
            Cut => "shear",
        };
        let given: [(&str, bool, &[CombKind]); 19] = [
            ("points", c.points.is_some(), &[DirectionCurve]),
            ("radius", c.radius.is_some(), &[DirectionCurve]),
            ("falloff", c.falloff.is_some(), &[DirectionCurve]),
            ("bend", c.bend.is_some(), &[DirectionCurve, DirectionMap, Field, Flow, Cluster]),
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
            ("scalp", c.scalp.is_some(), &[Cut]),
        ];
        let read = |(name, has, kinds): (_, bool, &[CombKind])| {
            (name, has, kinds.contains(&c.kind) && (has || name == needed))
        };
        self.keys(key, &given.map(read))?;
        self.check_guides(key, c)?;
        if c.kind == Cluster && self.value.cluster.is_empty() {
            return Err(self.error(key, "there are no clusters", "add a [[cluster]]"));
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
        let unit = [("weight", Some(c.weight)), ("falloff", c.falloff), ("bend", c.bend), ("amount", c.amount)];
        for (name, value) in unit.into_iter().chain([("curvature", Some(c.curvature))]) {
            self.within(&format!("{key}.{name}"), value.unwrap_or(0.0), 0.0, 1.0)?;
        }
        self.within(&format!("{key}.radius"), c.radius.unwrap_or(1.0), 0.0, f64::MAX)?;
        self.within(&format!("{key}.angle"), c.angle.unwrap_or(0.0), -720.0, 720.0)?;
        self.within(&format!("{key}.value"), c.value.unwrap_or(1.0), 0.0, 1e6)
    }
}
