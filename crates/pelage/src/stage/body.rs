//! The skin as what hair can't enter: its distance field at the frames of a span.

use super::Skin;
use pelage_geom::{Bvh, Offsets, Vec3};
use pelage_sim::{
    Body, Bounds, Closed, Deforming, Exact, Field, FieldSettings, Flow, Motion, Part, Shape,
};

/// A skin's surface at one frame, metres.
struct Solid {
    frame: i64,
    position: Vec<[f64; 3]>,
    bvh: Bvh,
    field: Field,
}

/// The skin as a solid, frame after frame.
pub(super) struct SkinBody {
    closed: Closed,
    settings: FieldSettings,
    /// Farthest that a hair reaches from its root, metres.
    reach: f64,
    unit: f64,
    before: Option<Solid>,
    now: Option<Solid>,
    /// Velocities from `before` to `now`, by vertex and in both fields.
    velocity: Vec<[f64; 3]>,
    flow: Option<[Flow; 2]>,
}

impl SkinBody {
    /// Of a skin that carries hairs of the given points (metres).
    pub fn new(skin: &Skin, unit: f64, settings: FieldSettings, offsets: &Offsets, position: &[[f64; 3]]) -> Self {
        let reach = |h: usize| {
            let points = &position[offsets.range(h)];
            points.windows(2).map(|w| (Vec3::from(w[1]) - Vec3::from(w[0])).norm()).sum::<f64>()
        };
        SkinBody {
            closed: Closed::new(&skin.mesh, &skin.topology),
            settings,
            reach: (0..offsets.len()).map(reach).fold(0.0, f64::max),
            unit,
            before: None,
            now: None,
            velocity: Vec::new(),
            flow: None,
        }
    }

    /// Edges of holes that were closed, and of those that stay open.
    pub fn open_edges(&self) -> (usize, usize) {
        let left = self.closed.topology.counts.open_edges;
        (self.closed.open_edges - left.min(self.closed.open_edges), left)
    }

    /// Goes on to a frame, where the skin's vertices are at `position` (scene units) and its roots at `roots` (metres).
    pub fn go(&mut self, frame: i64, position: &[[f64; 3]], roots: &[[f64; 3]], seconds: f64) {
        if self.now.as_ref().is_some_and(|s| s.frame == frame) {
            return;
        }
        let solid = self.solid(frame, position, roots);
        self.before = self.now.replace(solid);
        let (Some(a), Some(b)) = (&self.before, &self.now) else { return };
        let speed = |(p, q): (&[f64; 3], &[f64; 3])| std::array::from_fn(|x| (q[x] - p[x]) / seconds);
        self.velocity = a.position.iter().zip(&b.position).map(speed).collect();
        let triangle = &self.closed.mesh.triangle;
        self.flow = Some([&a, &b].map(|s| s.field.flow(triangle, &self.velocity)));
    }

    fn solid(&self, frame: i64, position: &[[f64; 3]], roots: &[[f64; 3]]) -> Solid {
        let metres: Vec<[f64; 3]> = position.iter().map(|p| p.map(|x| x * self.unit)).collect();
        let position = self.closed.extend(&metres);
        let (triangle, topology) = (&self.closed.mesh.triangle, &self.closed.topology);
        let bvh = Bvh::build(&position, triangle, topology);
        let region = self.region(roots);
        let field = Field::build(&position, triangle, topology, &bvh, &self.settings, region);
        Solid { frame, position, bvh, field }
    }

    /// Where hair can come.
    fn region(&self, roots: &[[f64; 3]]) -> Option<Bounds> {
        let mut all = (*roots.first()?, *roots.first()?);
        for r in roots {
            for x in 0..3 {
                all.0[x] = all.0[x].min(r[x]);
                all.1[x] = all.1[x].max(r[x]);
            }
        }
        let reach = self.reach + self.settings.outside;
        Some((all.0.map(|x| x - reach), all.1.map(|x| x + reach)))
    }

    /// What hair can't enter from the last frame to this one. A skin that moves as a whole stays in its rest coordinates.
    pub fn body<'a>(&'a self, motion: Motion<'a>, seconds: f64) -> Body<'a> {
        let Some(now) = &self.now else { return Body::default() };
        let (shape, velocity) = match (&self.before, &self.flow) {
            (Some(before), Some([a, b])) => {
                let deforming = Deforming { field: [&before.field, &now.field], flow: [a, b], seconds };
                (Shape::Deforming(deforming), Some(&self.velocity[..]))
            }
            _ => (Shape::Field(&now.field), None),
        };
        let exact = Some(Exact { bvh: &now.bvh, triangle: &self.closed.mesh.triangle, velocity });
        Body { parts: vec![Part { motion, shape, exact }], seconds }
    }
}
