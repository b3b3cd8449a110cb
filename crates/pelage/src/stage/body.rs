//! What hair can't enter: distance fields of the skin and of other meshes.

use super::groom;
use super::run::Runner;
use crate::Error;
use crate::config::{BodyKind, UpAxis};
use crate::format::ply;
use crate::project::SkinMotion;
use crate::timeline::Timeline;
use pelage_geom::{Bvh, Mesh, Topology, Vec3};
use pelage_sim::body::{Closed, Deforming, Ellipsoid, Exact, Field, FieldSettings, Flow, Known, rigid_part};
use pelage_sim::{Body, Bounds, Part, Rigid, Shape, Table};
use std::rc::Rc;

/// Samples of a table around and along: on a head 3 mm apart. Half as many round a nose off; twice as many take longer to
/// make than a field.
const TABLE: [usize; 2] = [256, 128];

/// A solid's surface at one moment, metres.
struct Surface {
    position: Vec<[f64; 3]>,
    bvh: Bvh,
}

/// What stands for a solid.
enum Stand {
    Field(Field),
    Table(Table),
    Ellipsoid(Ellipsoid),
}

/// A solid that moves as a whole.
struct RigidSolid {
    solid: Closed,
    surface: Surface,
    stand: Stand,
    /// Its motion; `None`: that of the skin.
    motion: Option<Option<SkinMotion>>,
}

/// What the rigid part of a deforming skin's motion goes by.
struct Anchor {
    /// Vertices of the skin that hair can touch, and their places at rest, metres.
    vertex: Vec<usize>,
    rest: Vec<[f64; 3]>,
    /// Their middle: what goes straight ahead between frames.
    middle: Vec3,
}

/// Everything that hair can't enter in a shot, made once a run and layer.
pub(super) struct Colliders {
    settings: FieldSettings,
    rigid: Vec<RigidSolid>,
    /// The skin, if it deforms and is a body, and at rest.
    skin: Option<(Closed, End)>,
    /// `None` if the skin doesn't deform.
    anchor: Option<Anchor>,
}

/// A deforming skin at a frame.
pub(super) struct End {
    surface: Surface,
    field: Field,
}

/// A deforming skin over a span: its surfaces at both ends, and how they move in the coordinates of its rigid part.
pub(super) struct Moving {
    seconds: f64,
    ends: [Rc<End>; 2],
    flow: [Flow; 2],
    velocity: Vec<[f64; 3]>,
}

impl Surface {
    /// Of a solid whose mesh has its vertices at `position`, metres.
    fn new(solid: &Closed, position: &[[f64; 3]]) -> Self {
        let position = solid.extend(position);
        let bvh = solid.bvh(&position);
        Surface { position, bvh }
    }

    /// `before`: the solid in another pose, most of which may lie as it does.
    fn field(&self, solid: &Closed, settings: &FieldSettings, region: Option<Bounds>, before: Option<&End>) -> Field {
        let triangle = &solid.mesh.triangle;
        let known = before.and_then(|b| Known::new(&b.field, triangle, &b.surface.position, &self.position));
        Field::build(&self.position, triangle, &solid.topology, &self.bvh, settings, region, known)
    }
}

fn metres(position: &[[f64; 3]], unit: f64) -> Vec<[f64; 3]> {
    position.iter().map(|p| p.map(|x| x * unit)).collect()
}

/// A table around an axis in metres, or around the middle of the points along `up`; holds every point that is finite and,
/// in a cylinder, between its ends.
fn table(surface: &Surface, kind: BodyKind, axis: Option<[Vec3; 2]>, up: UpAxis) -> Table {
    let points = || surface.position.iter().map(|p| Vec3::from(*p)).filter(|p| p.iter().all(|x| x.is_finite()));
    let [from, to] = axis.unwrap_or_else(|| {
        let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = points().fold(start, |(low, high), p| (low.inf(&p), high.sup(&p)));
        let (middle, along) = ((low + high) * 0.5, if up == UpAxis::Y { Vec3::y() } else { Vec3::z() });
        let half = along * (0.5 * along.dot(&(high - low)));
        [middle - half, middle + half]
    });
    let along = (to - from).try_normalize(0.0).unwrap_or_else(Vec3::y);
    // A hair's breadth more, so that rays begin outside.
    let farthest = |far: &dyn Fn(Vec3) -> f64| 1.001 * points().map(far).fold(1e-6, f64::max);
    if kind == BodyKind::Sphere {
        let centre = (from + to) * 0.5;
        return Table::sphere(&surface.bvh, centre, along, farthest(&|p| (p - centre).norm()), TABLE);
    }
    let across = |p: Vec3| (p - from - along * along.dot(&(p - from))).norm();
    Table::cylinder(&surface.bvh, from, to, farthest(&across), TABLE)
}

/// What the shot has of bodies around the hair of a layer, whose roots at rest and longest hair give `region` (metres).
pub(super) fn colliders(
    run: &mut Runner<'_>,
    layer: usize,
    deforms: bool,
    region: Option<Bounds>,
) -> Result<Rc<Colliders>, Error> {
    if let Some((_, found)) = run.colliders.as_ref().filter(|(of, _)| *of == layer) {
        return Ok(found.clone());
    }
    let shot = &run.project.shot.value;
    let (unit, up, b) = (shot.shot.meters_per_unit, shot.shot.up, &shot.simulate.body);
    let settings = FieldSettings { voxel: b.voxel * 1e-3, outside: b.outside * 1e-3, inside: b.inside * 1e-3 };
    let in_metres = |axis: Option<[[f64; 3]; 2]>| axis.map(|a| a.map(|p| Vec3::from(p) * unit));
    let mut out = Colliders { settings, rigid: Vec::new(), skin: None, anchor: None };
    if run.project.rest.is_some() && (b.skin || deforms) {
        let skin = groom::skin(run)?;
        let rest = metres(&skin.mesh.position, unit);
        out.anchor = deforms.then(|| Anchor::new(&rest, region));
        if b.skin {
            let solid = closed(run, "the skin", &skin.mesh, &skin.topology);
            if deforms {
                let surface = Surface::new(&solid, &rest);
                let field = surface.field(&solid, &settings, region, None);
                out.skin = Some((solid, End { surface, field }));
            } else {
                let surface = Surface::new(&solid, &rest);
                let stand = match b.kind {
                    BodyKind::Field => Stand::Field(surface.field(&solid, &settings, region, None)),
                    BodyKind::Ellipsoid => Stand::Ellipsoid(ellipsoid(&solid, &surface)),
                    kind => Stand::Table(table(&surface, kind, in_metres(b.axis), up)),
                };
                note_rays(run, "the skin", &stand);
                out.rigid.push(RigidSolid { solid, surface, stand, motion: None });
            }
        }
    }
    for mesh in &run.project.bodies {
        let read = ply::read_mesh(&mesh.file.path)?;
        let topology = Topology::new(&read.mesh);
        let solid = closed(run, &mesh.file.label, &read.mesh, &topology);
        let surface = Surface::new(&solid, &metres(&read.mesh.position, unit));
        let stand = match mesh.kind {
            BodyKind::Field => Stand::Field(surface.field(&solid, &settings, None, None)),
            BodyKind::Ellipsoid => Stand::Ellipsoid(ellipsoid(&solid, &surface).around(&surface.position)),
            kind => Stand::Table(table(&surface, kind, in_metres(mesh.axis), up)),
        };
        note_rays(run, &mesh.file.label, &stand);
        out.rigid.push(RigidSolid { solid, surface, stand, motion: Some(mesh.motion.clone()) });
    }
    let out = Rc::new(out);
    run.colliders = Some((layer, out.clone()));
    Ok(out)
}

/// A mesh without a single finite vertex is a point at the origin.
fn ellipsoid(solid: &Closed, surface: &Surface) -> Ellipsoid {
    let nothing = Ellipsoid { placement: Rigid::default(), semi_axes: [0.0; 3] };
    Ellipsoid::fit(&surface.position, &solid.mesh.triangle).unwrap_or(nothing)
}

/// A mesh with its holes closed.
fn closed(run: &mut Runner<'_>, name: &str, mesh: &Mesh, topology: &Topology) -> Closed {
    let solid = Closed::new(mesh, topology);
    if solid.open_edges > 0 {
        let left = solid.topology.counts.open_edges;
        run.warn_once(format!("{name}: {} open edges are closed for collisions, {left} stay open", solid.open_edges));
    }
    solid
}

fn note_rays(run: &mut Runner<'_>, name: &str, stand: &Stand) {
    if let Stand::Table(table) = stand
        && table.missed > 0
    {
        let all = TABLE[0] * TABLE[1];
        run.warn_once(format!("{name}: {} of {all} samples of its radius met no surface and are 0", table.missed));
    }
}

impl Anchor {
    /// Vertices within `region`, or all where it has fewer than three.
    fn new(rest: &[[f64; 3]], region: Option<Bounds>) -> Self {
        let within = |p: &[f64; 3]| region.is_none_or(|(low, high)| (0..3).all(|i| low[i] <= p[i] && p[i] <= high[i]));
        let mut vertex: Vec<usize> = (0..rest.len()).filter(|v| within(&rest[*v])).collect();
        if vertex.len() < 3 {
            vertex = (0..rest.len()).collect();
        }
        let rest: Vec<[f64; 3]> = vertex.iter().map(|v| rest[*v]).collect();
        let middle = rest.iter().fold(Vec3::zeros(), |s, p| s + Vec3::from(*p)) / rest.len().max(1) as f64;
        Anchor { vertex, rest, middle }
    }
}

impl Colliders {
    /// The rigid part of the way from the rest pose to a skin with its vertices at `position` (scene units).
    pub(super) fn placement(&self, position: Option<&[[f64; 3]]>, unit: f64) -> Rigid {
        let Some((anchor, position)) = self.anchor.as_ref().zip(position) else { return Rigid::default() };
        let now: Vec<[f64; 3]> = anchor.vertex.iter().map(|v| position[*v].map(|x| x * unit)).collect();
        rigid_part(&anchor.rest, &now).motion
    }

    /// Between two such placements: the middle of what was fitted goes straight, the rotation along the shorter arc.
    pub(super) fn between(&self, [a, b]: &[Rigid; 2], f: f64) -> Rigid {
        let middle = self.anchor.as_ref().map_or(Vec3::zeros(), |a| a.middle);
        let turn = Rigid { rotation: Rigid::turn_between(a.rotation, b.rotation, f), translation: [0.0; 3] };
        let at = a.apply(middle) * (1.0 - f) + b.apply(middle) * f;
        Rigid { translation: (at - turn.apply(middle)).into(), ..turn }
    }

    /// The deforming skin at a frame in the coordinates of its rigid part, `at`; `None` if it doesn't deform.
    pub(super) fn end(
        &self,
        position: Option<&[[f64; 3]]>,
        unit: f64,
        at: &Rigid,
        region: Option<Bounds>,
    ) -> Option<Rc<End>> {
        let ((skin, rest), position) = self.skin.as_ref().zip(position)?;
        let local: Vec<[f64; 3]> = position.iter().map(|p| at.invert(Vec3::from(*p) * unit).into()).collect();
        let surface = Surface::new(skin, &local);
        // From the pose at rest, not the frame before: what a frame gives does not depend on where a run begins.
        let field = surface.field(skin, &self.settings, region, Some(rest));
        Some(Rc::new(End { surface, field }))
    }

    /// The deforming skin over a span of `seconds` between two frames.
    pub(super) fn moving(&self, ends: [Rc<End>; 2], seconds: f64) -> Option<Moving> {
        let triangle = &self.skin.as_ref()?.0.mesh.triangle;
        let [a, b] = [&ends[0], &ends[1]];
        let rate = |(p, q): (&[f64; 3], &[f64; 3])| std::array::from_fn(|x| (q[x] - p[x]) / seconds);
        let velocity: Vec<[f64; 3]> = a.surface.position.iter().zip(&b.surface.position).map(rate).collect();
        let flow = [a.field.flow(triangle, &velocity), b.field.flow(triangle, &velocity)];
        Some(Moving { seconds, ends, flow, velocity })
    }

    /// Motions of the solids that move by themselves over the span that begins at a frame.
    pub(super) fn motions(&self, from: f64, unit: f64) -> Vec<Box<dyn Fn(f64) -> Rigid + Sync + '_>> {
        let motion = move |m: &'_ Option<SkinMotion>, f: f64| {
            m.as_ref().map_or(Rigid::default(), |m| super::simulate::placement(&m.at(from + f), unit))
        };
        let own = self.rigid.iter().filter_map(|r| r.motion.as_ref());
        own.map(|m| Box::new(move |f: f64| motion(m, f)) as Box<dyn Fn(f64) -> Rigid + Sync>).collect()
    }

    /// Everything over a span: `skin` is the motion of the skin or of its rigid part, `own` those of other solids.
    pub(super) fn body<'a>(
        &'a self,
        skin: &'a (dyn Fn(f64) -> Rigid + Sync),
        own: &'a [Box<dyn Fn(f64) -> Rigid + Sync + 'a>],
        moving: Option<&'a Moving>,
        seconds: f64,
    ) -> Body<'a> {
        let mut parts = Vec::new();
        let mut own = own.iter();
        for r in &self.rigid {
            let motion = if r.motion.is_some() { &**own.next().expect("a motion each") } else { skin };
            let shape = match &r.stand {
                Stand::Field(field) => Shape::Field(field),
                Stand::Table(table) => Shape::Table(table),
                Stand::Ellipsoid(ellipsoid) => Shape::Ellipsoid(ellipsoid),
            };
            let exact = Some(Exact { bvh: &r.surface.bvh, triangle: &r.solid.mesh.triangle, velocity: None });
            parts.push(Part { motion, shape, exact });
        }
        if let Some((m, (solid, _))) = moving.zip(self.skin.as_ref()) {
            let field = [&m.ends[0].field, &m.ends[1].field];
            let shape = Shape::Deforming(Deforming { field, flow: [&m.flow[0], &m.flow[1]], seconds: m.seconds });
            let bvh = &m.ends[1].surface.bvh;
            let exact = Some(Exact { bvh, triangle: &solid.mesh.triangle, velocity: Some(&m.velocity) });
            parts.push(Part { motion: skin, shape, exact });
        }
        Body { parts, seconds }
    }
}

/// True if the skin of a shot deforms.
pub(super) fn deforms(timeline: &Timeline<'_>) -> bool {
    timeline.rigid(timeline.first, timeline.first as f64).is_none()
}
