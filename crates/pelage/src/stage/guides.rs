//! Fields that control hairs are combed along.

use super::clumps::column;
use super::look::barrier;
use super::run::{Counts, Runner};
use super::skin::Texel;
use super::tables::{decode, encode, table};
use super::{What, clusters, groom};
use crate::Error;
use crate::config::{
    Ball, Comb, CombKind, Element, ElementKind, GroomFile, Orientation, Panels, Plane, Primitive, Region, Shear,
};
use crate::format::ply::{self, Column};
use nalgebra::UnitQuaternion;
use pelage_geom::{Bvh, Mesh, Pose, TiledMap, Vec3};
use pelage_groom::cluster::{Tree, lines};
use pelage_groom::control::ControlHairs;
use pelage_groom::field::{self, Falloff, GuideField, lengths};
use pelage_groom::flow::trace::{Guard, Lines, Start, Trace, trace};
use pelage_groom::flow::{self, Body, Factored, Fast, Grid, OPENING, coarse};
use pelage_groom::look::vary::Drawn;
use std::sync::Arc;

/// Cells along the longest side of the box that lines can come to: velocities between are off by 1e-4 in the middle, and more
/// where the flow nearly rests. Twice as many take eight times as long to fill.
const CELLS: f64 = 60.0;

/// Steps of lines in chords of the longest: with 1, hair that a field turns round within a chord goes straight on instead.
const STEP: f64 = 0.25;

/// Lines from which on a grid is worth filling.
const MANY: usize = 2000;

/// Share of their length over which control hairs come into their cluster: less, and they bend sharply at the skin.
const START: f64 = 0.15;

/// What an operation lets hairs follow.
pub(super) enum Guides {
    Field(GuideField),
    Flow(Flow),
    /// Lines through clusters from all roots.
    Clusters(InClusters),
}

/// Roots of all control hairs in clusters.
pub(super) struct InClusters {
    tree: Arc<Tree>,
    of: Vec<u32>,
    uv: Vec<[f64; 2]>,
}

/// A flow with its body solved.
pub(super) struct Flow {
    element: Vec<flow::Element>,
    body: Option<(Body, Vec<f64>)>,
    reverse: bool,
}

/// What the operations of a groom let hairs follow; `None` for those that follow nothing.
pub(super) fn guides(
    run: &mut Runner<'_>,
    frame: Option<i32>,
    combs: &[Comb],
    hairs: &ControlHairs,
    drawn: &Drawn<'_>,
) -> Result<Vec<Option<Guides>>, Error> {
    let each = combs.iter().enumerate();
    each.map(|(i, c)| match c.kind {
        CombKind::Field => Ok(Some(Guides::Field(field_of(run, i, c, drawn)?))),
        CombKind::Flow => Ok(Some(Guides::Flow(flow_of(run, i, c)?))),
        CombKind::Cluster => {
            let (tree, uv) = (clusters::tree(run, frame)?, clusters::coordinates(run, &hairs.root)?);
            clusters::check_level(run, &tree, &format!("comb[{i}].level"), c.level)?;
            let of = clusters::owners(&tree, &uv, Some(c.level.unwrap_or(0)));
            Ok(Some(Guides::Clusters(InClusters { tree, of, uv })))
        }
        _ => Ok(None),
    })
    .collect()
}

impl Guides {
    /// Lines of `points` points from the roots of hairs, out of the skin.
    pub(super) fn lines(&self, points: usize, guard: &Guard<'_>, starts: &[Start]) -> Lines {
        let longest = starts.iter().map(|s| s.length).fold(0.0, f64::max);
        let step = longest / points.max(2).saturating_sub(1) as f64 * STEP;
        let settings = Trace { points, step, reverse: false, slow: 0.0 };
        match self {
            Guides::Field(field) => field.trace(starts, &settings, Some(guard)),
            Guides::Clusters(c) => {
                // A control hair stands for hair of any length: it takes the shape of the whole cluster.
                let root: Vec<Vec3> = starts.iter().map(|s| s.at).collect();
                let at = lines(&c.tree, &c.of, &c.uv, &root, None, points, START).expect("the tree was checked");
                Lines { points, at, straight_from: vec![points as u32; root.len()] }
            }
            Guides::Flow(f) => f.lines(&Trace { reverse: f.reverse, ..settings }, guard, starts, longest),
        }
    }
}

impl Flow {
    /// Lines no longer than `reach`.
    fn lines(&self, settings: &Trace, guard: &Guard<'_>, starts: &[Start], reach: f64) -> Lines {
        let Some((body, strength)) = &self.body else {
            let flow = flow::Flow { elements: &self.element, ..flow::Flow::default() };
            return trace(|_, p| flow.velocity(p), starts, settings, Some(guard));
        };
        let fast = Fast::new(body.flow(&self.element, strength), OPENING);
        let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = starts.iter().fold(none, |(low, high), s| (low.inf(&s.at), high.sup(&s.at)));
        let (low, high) = (low.add_scalar(-reach), high.add_scalar(reach));
        let grid = (starts.len() >= MANY).then(|| Grid::fill(&fast, low, high, (high - low).max() / CELLS).ok());
        match grid.flatten() {
            Some(grid) => trace(|_, p| grid.velocity(p), starts, settings, Some(guard)),
            None => trace(|_, p| fast.velocity(p), starts, settings, Some(guard)),
        }
    }
}

fn turned(degrees: [f64; 3]) -> UnitQuaternion<f64> {
    let [x, y, z] = degrees.map(f64::to_radians);
    let about = |axis: Vec3, angle: f64| {
        let half = 0.5 * angle;
        let v = axis * libm::sin(half);
        UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(libm::cos(half), v.x, v.y, v.z))
    };
    about(Vec3::z(), z) * about(Vec3::y(), y) * about(Vec3::x(), x)
}

fn points(p: Option<&Vec<[f64; 3]>>) -> Vec<Vec3> {
    p.into_iter().flatten().map(|p| Vec3::from(*p)).collect()
}

fn vector(v: Option<[f64; 3]>) -> Vec3 {
    Vec3::from(v.unwrap_or_default())
}

fn field_of(run: &mut Runner<'_>, i: usize, c: &Comb, hairs: &Drawn<'_>) -> Result<GuideField, Error> {
    let name = |k: usize| format!("comb[{i}].primitive[{k}].strength");
    let each = c.primitive.iter().enumerate();
    Ok(GuideField {
        primitives: c.primitive.iter().map(primitive).collect(),
        dividers: c.divider.iter().map(region).collect(),
        factor: each.map(|(k, p)| column(run, hairs, &name(k), &p.strength, false)).collect::<Result<_, _>>()?,
    })
}

fn primitive(p: &Primitive) -> field::Primitive {
    let orientation = match p.orientation {
        Orientation::Constant => field::Orientation::Constant { direction: vector(p.direction) },
        Orientation::Radial => field::Orientation::Radial,
        Orientation::Around => field::Orientation::Around,
        Orientation::Along => field::Orientation::Along { points: points(p.points.as_ref()) },
        Orientation::Divide => field::Orientation::Divide,
        Orientation::Roller => field::Orientation::Roller {
            points: points(p.points.as_ref()),
            radius: p.radius.unwrap_or(1.0),
            pitch: p.pitch.unwrap_or(0.1),
        },
        Orientation::Wave => field::Orientation::Wave {
            along: vector(p.direction),
            across: vector(p.sway),
            wavelength: p.wavelength.unwrap_or(1.0),
            amplitude: p.amplitude.unwrap_or(0.5),
            phase: p.phase.unwrap_or(0.0).to_radians(),
        },
    };
    let falloff = match &p.falloff {
        None => Falloff::Uniform,
        Some(f) => match f.exponent {
            Some(exponent) => Falloff::InversePower { exponent, near: f.near.unwrap_or(1.0) },
            None => Falloff::Smooth {
                r0: f.from.unwrap_or(0.0),
                r1: f.to.unwrap_or(1.0),
                s0: f.inner.unwrap_or(1.0),
                s1: f.outer.unwrap_or(0.0),
            },
        },
    };
    field::Primitive {
        position: p.position.into(),
        rotation: turned(p.turn),
        strength: p.strength.at(0.0),
        falloff,
        shape: p.shape.into(),
        domain: p.domain.iter().map(region).collect(),
        across: p.across,
        ..field::Primitive::new(orientation)
    }
}

/// The dividers of all fields.
pub(super) fn dividers(groom: &GroomFile) -> Vec<field::Region> {
    groom.comb.iter().flat_map(|c| &c.divider).map(region).collect()
}

/// A part of space.
fn region(r: &Region) -> field::Region {
    match (r.centre, r.radii) {
        (Some(centre), Some(radii)) => {
            field::Region::Ellipsoid { centre: centre.into(), rotation: turned(r.turn), radii: radii.into() }
        }
        _ => field::Region::HalfSpace { point: vector(r.point), normal: vector(r.normal) },
    }
}

fn plane(p: Option<Plane>) -> lengths::Plane {
    let p = p.expect("checked: a plane");
    lengths::Plane { point: p.point.into(), normal: p.normal.into() }
}

/// Where an operation cuts.
pub(super) fn shear(s: &Shear) -> lengths::Shear {
    match (&s.front, &s.back) {
        (Some(front), Some(back)) => {
            lengths::Shear::Part { plane: plane(s.part), front: Box::new(shear(front)), back: Box::new(shear(back)) }
        }
        _ => lengths::Shear::Cut { plane: plane(s.at) },
    }
}

/// The ball that stands for the scalp.
pub(super) fn ball(b: &Ball) -> lengths::Sphere {
    lengths::Sphere { centre: b.centre.into(), radius: b.radius }
}

fn element(e: &Element) -> flow::Element {
    let (at, strength, core) = (vector(e.at), e.strength, e.core);
    match e.kind {
        ElementKind::Stream => flow::Element::Stream { velocity: vector(e.velocity) },
        ElementKind::Source => flow::Element::Source { at, strength, core },
        ElementKind::Vortex => flow::Element::Vortex { at, axis: vector(e.axis), strength, core },
        ElementKind::Filament => flow::Element::Filament { points: points(e.points.as_ref()), strength, core },
    }
}

fn flow_of(run: &mut Runner<'_>, i: usize, c: &Comb) -> Result<Flow, Error> {
    let element: Vec<flow::Element> = c.element.iter().map(element).collect();
    let body = c.panels.as_ref().map(|p| body_of(run, i, p, &element)).transpose()?;
    Ok(Flow { element, body, reverse: c.reverse })
}

fn unsound(run: &Runner<'_>, i: usize, e: &flow::FlowError) -> Error {
    let help = "change `panels.most`, or give a closed mesh as `panels.file`";
    run.project.groom.error(&format!("comb[{i}].panels"), e.to_string(), help).into()
}

/// Panels of an operation, factored: elements and speeds can change without doing it again.
pub(super) fn panels(run: &mut Runner<'_>, i: usize) -> Result<Body, Error> {
    let what = What::Panels(i as u32);
    if let Some(found) = run.fetch(what).and_then(|e| decode_body(e.payload.first()?)) {
        return Ok(found);
    }
    let p = run.project.groom.value.comb[i].panels.clone().expect("the operation has panels");
    let mesh = match run.project.panels.get(&i) {
        Some(file) => ply::read_mesh(&file.path)?.mesh,
        None => {
            let barrier = barrier(run)?;
            let (whole, topology) = (&barrier.closed.mesh, &barrier.closed.topology);
            coarse(whole, &Pose::new(whole, topology, whole.position.clone()).normal, p.most)
        }
    };
    let body = Body::new(&mesh.position, &mesh.triangle).map_err(|e| unsound(run, i, &e))?;
    let position = |x: usize| Column::F64(mesh.position.iter().map(|p| p[x]).collect());
    let corner = |x: usize| Column::U32(mesh.triangle.iter().map(|t| t[x]).collect());
    let factored = body.factored();
    let file = encode(
        "panels; the factored matrix of the velocities that they induce on each other; which of its rows stands where",
        &[
            table("vertex", vec![("x", position(0)), ("y", position(1)), ("z", position(2))]),
            table(
                "panel",
                vec![("a", corner(0)), ("b", corner(1)), ("c", corner(2)), ("row", Column::U32(factored.row.clone()))],
            ),
            table("matrix", vec![("value", Column::F64(factored.matrix.clone()))]),
        ],
    );
    let counts = Counts::from([("panels".to_owned(), body.panels().len() as u64)]);
    run.keep(what, counts, &[("data.ply", &file)])?;
    Ok(body)
}

fn decode_body(bytes: &[u8]) -> Option<Body> {
    let file = decode(bytes)?;
    let (vertex, panel) = (file.get("vertex")?, file.get("panel")?);
    let of = |name: &str| vertex.f64(name);
    let (x, y, z) = (of("x")?, of("y")?, of("z")?);
    let position: Vec<[f64; 3]> = (0..vertex.rows).map(|k| [x[k], y[k], z[k]]).collect();
    let (a, b, c) = (panel.u32("a")?, panel.u32("b")?, panel.u32("c")?);
    let triangle: Vec<[u32; 3]> = (0..panel.rows).map(|k| [a[k], b[k], c[k]]).collect();
    let matrix = file.get("matrix")?.f64("value")?.to_vec();
    Body::again(&position, &triangle, Factored { matrix, row: panel.u32("row")?.to_vec() })
}

/// Panels of a flow with the strengths that let through what is asked.
fn body_of(run: &mut Runner<'_>, i: usize, p: &Panels, element: &[flow::Element]) -> Result<(Body, Vec<f64>), Error> {
    let skin = groom::skin(run)?;
    let body = panels(run, i)?;
    let map = p.through.map().map(|m| run.map(&m, Texel::Value)).transpose()?;
    let through: Vec<f64> =
        body.panels().iter().map(|panel| speed(&skin.mesh, skin.bvh(), p, map.as_ref(), panel.centre)).collect();
    let strength = body.solve(element, &through).map_err(|e| unsound(run, i, &e))?;
    Ok((body, strength))
}

/// Speed through the skin where it is nearest to a point.
fn speed(skin: &Mesh, bvh: &Bvh, p: &Panels, map: Option<&TiledMap>, at: Vec3) -> f64 {
    let painted = map.zip(bvh.closest(at, f64::INFINITY)).map(|(map, near)| f64::from(map.value(skin.uv(&near.point))));
    p.through.at(0.0) * painted.unwrap_or(1.0)
}
