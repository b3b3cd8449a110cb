//! What hair can't enter: distance fields of the skin and of other meshes.

use super::groom;
use super::run::Runner;
use crate::Error;
use crate::config::MeshShape;
use crate::format::ply;
use crate::project::SkinMotion;
use crate::timeline::Timeline;
use pelage_geom::{Bvh, Mesh, Topology};
use pelage_sim::body::{Closed, Ellipsoid, Exact, FieldSettings, Flow};
use pelage_sim::body::{Deforming, Field};
use pelage_sim::{Body, Part, Rigid, Shape};
use std::rc::Rc;

/// A mesh with its holes closed, in metres.
struct Solid {
    closed: Closed,
}

/// A solid's surface at one moment.
struct Surface {
    position: Vec<[f64; 3]>,
    bvh: Bvh,
    field: Field,
}

/// A solid that moves as a whole.
struct RigidSolid {
    solid: Solid,
    surface: Surface,
    ellipsoid: Option<Ellipsoid>,
    /// Its motion; `None`: that of the skin.
    motion: Option<Option<SkinMotion>>,
}

/// Everything that hair can't enter in a shot, made once a run.
pub(super) struct Colliders {
    settings: FieldSettings,
    rigid: Vec<RigidSolid>,
    /// The skin, if it deforms.
    skin: Option<Solid>,
}

/// A deforming skin over a span: its surfaces at both ends, and how they move.
pub(super) struct Moving {
    seconds: f64,
    ends: [Rc<End>; 2],
    flow: [Flow; 2],
    velocity: Vec<[f64; 3]>,
}

/// A deforming skin at a frame.
pub(super) struct End {
    surface: Surface,
}

impl Solid {
    fn new(mesh: &Mesh, topology: &Topology) -> Self {
        Solid { closed: Closed::new(mesh, topology) }
    }

    /// The solid with the mesh's vertices at `position`, scene units of `unit` metres.
    fn at(&self, position: &[[f64; 3]], unit: f64, settings: &FieldSettings) -> Surface {
        let metres: Vec<[f64; 3]> = position.iter().map(|p| p.map(|x| x * unit)).collect();
        let position = self.closed.extend(&metres);
        let (triangle, topology) = (&self.closed.mesh.triangle, &self.closed.topology);
        let bvh = Bvh::build(&position, triangle, topology);
        let field = Field::build(&position, triangle, topology, &bvh, settings, None);
        Surface { position, bvh, field }
    }
}

/// What the shot has of bodies.
pub(super) fn colliders(run: &mut Runner<'_>, deforms: bool) -> Result<Rc<Colliders>, Error> {
    if let Some(found) = &run.colliders {
        return Ok(found.clone());
    }
    let shot = &run.project.shot.value;
    let (unit, b) = (shot.shot.meters_per_unit, &shot.simulate.body);
    let settings = FieldSettings { voxel: b.voxel * 1e-3, outside: b.outside * 1e-3, inside: b.inside * 1e-3 };
    let mut out = Colliders { settings, rigid: Vec::new(), skin: None };
    if b.skin && run.project.rest.is_some() {
        let skin = groom::skin(run)?;
        let solid = Solid::new(&skin.mesh, &skin.topology);
        note_holes(run, "the skin", &solid);
        if deforms {
            out.skin = Some(solid);
        } else {
            let surface = solid.at(&skin.mesh.position, unit, &settings);
            out.rigid.push(RigidSolid { solid, surface, ellipsoid: None, motion: None });
        }
    }
    for mesh in &run.project.bodies {
        let read = ply::read_mesh(&mesh.file.path)?;
        let topology = Topology::new(&read.mesh);
        let solid = Solid::new(&read.mesh, &topology);
        note_holes(run, &mesh.file.label, &solid);
        let surface = solid.at(&read.mesh.position, unit, &settings);
        let whole = |e: Ellipsoid| e.around(&surface.position);
        let ellipsoid = match mesh.shape {
            MeshShape::Field => None,
            MeshShape::Ellipsoid => Ellipsoid::fit(&surface.position).map(whole),
        };
        out.rigid.push(RigidSolid { solid, surface, ellipsoid, motion: Some(mesh.motion.clone()) });
    }
    let out = Rc::new(out);
    run.colliders = Some(out.clone());
    Ok(out)
}

fn note_holes(run: &mut Runner<'_>, name: &str, solid: &Solid) {
    if solid.closed.open_edges > 0 {
        let left = solid.closed.topology.counts.open_edges;
        let text =
            format!("{name}: {} open edges are closed for collisions, {left} stay open", solid.closed.open_edges);
        run.warnings.push(text);
    }
}

impl Colliders {
    /// The deforming skin at a frame; `None` if it doesn't deform.
    pub(super) fn end(&self, position: Option<&[[f64; 3]]>, unit: f64) -> Option<Rc<End>> {
        let (skin, position) = self.skin.as_ref().zip(position)?;
        Some(Rc::new(End { surface: skin.at(position, unit, &self.settings) }))
    }

    /// The deforming skin over a span of `seconds` between two frames.
    pub(super) fn moving(&self, ends: [Rc<End>; 2], seconds: f64) -> Option<Moving> {
        let triangle = &self.skin.as_ref()?.closed.mesh.triangle;
        let [a, b] = [&ends[0].surface, &ends[1].surface];
        let rate = |(p, q): (&[f64; 3], &[f64; 3])| std::array::from_fn(|x| (q[x] - p[x]) / seconds);
        let velocity: Vec<[f64; 3]> = a.position.iter().zip(&b.position).map(rate).collect();
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

    /// Everything over a span: `skin` is the motion of a skin that moves as a whole, `own` those of other solids.
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
            let shape = r.ellipsoid.as_ref().map_or(Shape::Field(&r.surface.field), Shape::Ellipsoid);
            let triangle = &r.solid.closed.mesh.triangle;
            let exact = r.ellipsoid.is_none().then_some(Exact { bvh: &r.surface.bvh, triangle, velocity: None });
            parts.push(Part { motion, shape, exact });
        }
        if let Some((m, solid)) = moving.zip(self.skin.as_ref()) {
            let field = [&m.ends[0].surface.field, &m.ends[1].surface.field];
            let shape = Shape::Deforming(Deforming { field, flow: [&m.flow[0], &m.flow[1]], seconds: m.seconds });
            let triangle = &solid.closed.mesh.triangle;
            let exact = Some(Exact { bvh: &m.ends[1].surface.bvh, triangle, velocity: Some(&m.velocity) });
            parts.push(Part { motion: &still, shape, exact });
        }
        Body { parts, seconds }
    }
}

fn still(_: f64) -> Rigid {
    Rigid::default()
}

/// True if the skin of a shot deforms.
pub(super) fn deforms(timeline: &Timeline<'_>) -> bool {
    timeline.rigid(timeline.first, timeline.first as f64).is_none()
}
