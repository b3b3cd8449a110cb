//! A few hairs with everything prescribed: for tests, stress and studies.

use crate::{
    Body, Ellipsoid, End, Field, FieldSettings, Hairs, Material, Model, Motion, Part, Rigid, Root, Settings, Shape,
    SimError, Simulation, Span, SpanReport, Started, Vec3, Wind,
};
use pelage_geom::{Bvh, Mesh, Offsets, StrandId, Topology, shapes};
use std::f64::consts::{FRAC_PI_4, PI};

/// Seconds of a frame.
pub const FRAME: f64 = 1.0 / 24.0;

/// Size of gravity, metres per second squared.
pub const G: f64 = 9.81;

/// Gravity, metres per second squared.
pub const GRAVITY: [f64; 3] = [0.0, -G, 0.0];

/// Nothing moves.
pub fn still(_: f64) -> Rigid {
    Rigid::default()
}

/// A rotation about an axis as a placement.
pub fn turned(axis: Vec3, angle: f64) -> Rigid {
    let (s, c) = libm::sincos(0.5 * angle);
    let a = axis.normalize() * s;
    Rigid { rotation: [a.x, a.y, a.z, c], translation: [0.0; 3] }
}

/// A placement where hair was groomed.
pub fn placed(p: [f64; 3]) -> Root {
    Root { position: p, rotation: [0.0, 0.0, 0.0, 1.0] }
}

/// A placement there, turned about an axis.
pub fn placed_turned(p: [f64; 3], axis: Vec3, angle: f64) -> Root {
    Root { position: p, rotation: turned(axis, angle).rotation }
}

/// Hair of real thickness, without the air.
pub fn in_vacuum() -> Material {
    Material { drag_factor: 0.0, damping: 0.0, ..Material::default() }
}

/// A material with `w L^3 / B = gamma` for a rod of length 1 m and diameter 1 mm, hardly extensible, without damping.
pub fn rod(gamma: f64) -> Material {
    let m = Material { diameter: 1e-3, ..in_vacuum() };
    let area = FRAC_PI_4 * m.diameter * m.diameter;
    let bend = m.density * area * G / gamma;
    Material { young: bend / (area * m.diameter * m.diameter / 16.0), ..m }
}

/// Time unit of bending, `sqrt(rho A L^4 / B)`, of a rod of length 1 m with [`rod`]'s material, seconds.
pub fn bending_time(gamma: f64) -> f64 {
    (gamma / G).sqrt()
}

/// Settings for the model alone: the input is the natural shape, nothing sleeps, one step a span, strands subdivide only
/// where a stage does not converge.
pub fn plain(model: Model, material: Material) -> Settings {
    Settings {
        model,
        material,
        sag_free: false,
        sleep: false,
        substeps: Some(1),
        largest_turn: 10.0,
        tolerance: 1e-7,
        ..Settings::default()
    }
}

/// A straight hair of length 1 m from the origin in `n` segments.
pub fn straight(n: usize, direction: Vec3) -> Vec<[f64; 3]> {
    let d = direction.normalize();
    (0..=n).map(|i| (d * (i as f64 / n as f64)).into()).collect()
}

/// A hair of length 1 m in the plane z = 0 whose segments have these angles above the x axis.
pub fn links(angle: &[f64]) -> Vec<[f64; 3]> {
    let l = 1.0 / angle.len() as f64;
    let mut p = vec![[0.0; 3]];
    for a in angle {
        let [x, y, _] = p[p.len() - 1];
        p.push([x + l * libm::cos(*a), y + l * libm::sin(*a), 0.0]);
    }
    p
}

/// Length of a hair.
pub fn length(hair: &[[f64; 3]]) -> f64 {
    hair.windows(2).map(|w| (Vec3::from(w[1]) - Vec3::from(w[0])).norm()).sum()
}

/// A ball as a mesh with its field.
#[derive(Debug)]
pub struct Ball {
    /// Its surface.
    pub mesh: Mesh,
    /// Search structure of the surface.
    pub bvh: Bvh,
    /// Its signed distance.
    pub field: Field,
}

/// A ball about the origin.
pub fn ball(radius: f64) -> Ball {
    let mesh = shapes::cube_sphere(48, radius);
    let topology = Topology::new(&mesh);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let field = Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, &FieldSettings::default(), None, None);
    Ball { mesh, bvh, field }
}

/// Hairs that stand on the upper half of a ball and lie around it, slowly away from it.
pub fn tuft(radius: f64, count: usize, length: f64, points: usize) -> Vec<Vec<[f64; 3]>> {
    (0..count)
        .map(|k| {
            let around = 2.4 * k as f64;
            let up = 0.3 + 0.65 * (k as f64 + 0.5) / count as f64;
            let flat = (1.0f64 - up * up).sqrt();
            let n = Vec3::new(flat * libm::cos(around), up, flat * libm::sin(around));
            let down = (-Vec3::y() + n * n.y).normalize();
            (0..points)
                .map(|i| {
                    let s = length * i as f64 / (points - 1) as f64;
                    let a = s / radius;
                    // Around the ball and slowly away from it.
                    let out = n * libm::cos(a) + down * libm::sin(a);
                    (out * (radius * (1.0 + 0.05 * s / length))).into()
                })
                .collect()
        })
        .collect()
}

/// How far the far end of a string falls in six film frames, metres, that hangs over a drum (a cylinder about z of some
/// `radius`), `near` of it on one side and `far` on the other. Gravity comes in twelve frames before: a string that is dropped
/// bounces, and slips early.
pub fn fall_over_drum(
    settings: &Settings,
    segments: usize,
    radius: f64,
    [near, far]: [f64; 2],
) -> Result<f64, SimError> {
    // So long that its ends don't matter.
    let drum = Ellipsoid { placement: Rigid::default(), semi_axes: [radius, radius, 1e3 * radius] };
    let part = Part { motion: &still, shape: Shape::Ellipsoid(&drum), exact: None };
    let body = Body { parts: vec![part], seconds: FRAME };
    let r = radius + settings.offset;
    let total = near + PI * r + far;
    let at = |i: usize| {
        let s = total * i as f64 / segments as f64;
        let a = ((s - near) / r).clamp(0.0, PI);
        let hangs = if s < near { s - near } else { (near + PI * r - s).min(0.0) };
        [-r * libm::cos(a), r * libm::sin(a) + hangs, 0.0]
    };
    let mut rig = Rig::under(&[(0..=segments).map(at).collect()], settings, GRAVITY)?;
    for k in 1..=12 {
        rig.gravity = GRAVITY.map(|g| g * (f64::from(k) / 10.0).min(1.0));
        rig.go(FRAME, &still, &body, None)?;
    }
    let start = rig.tip(0).y;
    (0..6).try_for_each(|_| rig.go(FRAME, &still, &body, None))?;
    Ok(start - rig.tip(0).y)
}

/// A hair that is held nowhere, in a vacuum, with friction; metres that it keeps from a body.
pub fn loose(model: Model, friction: f64, offset: f64) -> Settings {
    Settings {
        model,
        material: in_vacuum(),
        root: End::Free,
        tip: End::Free,
        sag_free: false,
        friction,
        offset,
        sleep: false,
        ..Settings::default()
    }
}

/// Hairs in a simulation, with the ends where they were groomed until they are carried elsewhere.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Hairs as they were groomed.
    pub hairs: Vec<Vec<[f64; 3]>>,
    /// The simulation.
    pub sim: Simulation,
    /// What its start had to say.
    pub started: Started,
    /// Where roots are, relative to the skin.
    pub roots: Vec<Root>,
    /// Where tips are, if they are held.
    pub tips: Option<Vec<Root>>,
    /// Metres per second squared.
    pub gravity: [f64; 3],
    /// Seconds since the start.
    pub time: f64,
    /// Report of the last span.
    pub last: SpanReport,
}

impl Rig {
    /// Hairs with ids from 1.
    pub fn new(hairs: &[Vec<[f64; 3]>], settings: &Settings) -> Result<Rig, SimError> {
        Rig::under(hairs, settings, GRAVITY)
    }

    /// The same under any gravity.
    pub fn under(hairs: &[Vec<[f64; 3]>], settings: &Settings, gravity: [f64; 3]) -> Result<Rig, SimError> {
        Rig::made_of(&[], hairs, settings, gravity)
    }

    /// The same of hairs with materials of their own.
    pub fn made_of(
        material: &[Material],
        hairs: &[Vec<[f64; 3]>],
        settings: &Settings,
        gravity: [f64; 3],
    ) -> Result<Rig, SimError> {
        let offsets = Offsets::from_counts(hairs.iter().map(Vec::len));
        let id: Vec<StrandId> = (1..=hairs.len() as u64).collect();
        let position = hairs.concat();
        let input = Hairs { offsets: &offsets, position: &position, id: &id, material };
        let (sim, started) = Simulation::new(&input, settings, gravity)?;
        let roots = hairs.iter().map(|h| placed(h[0])).collect();
        let tips = (settings.tip != End::Free).then(|| hairs.iter().map(|h| placed(h[h.len() - 1])).collect());
        let (time, last) = (0.0, SpanReport::default());
        Ok(Rig { hairs: hairs.to_vec(), sim, started, roots, tips, gravity, time, last })
    }

    /// Hairs whose natural shape is `natural`, at rest but in the pose `pose`, not relaxed.
    pub fn deformed(
        natural: &[Vec<[f64; 3]>],
        pose: &[Vec<[f64; 3]>],
        settings: &Settings,
        gravity: [f64; 3],
    ) -> Result<Rig, SimError> {
        let mut rig = Rig::under(natural, settings, gravity)?;
        rig.sim.restore(&Rig::under(pose, settings, gravity)?.sim.save())?;
        Ok(rig)
    }

    /// Moves through a span with a skin and a body.
    pub fn go(
        &mut self,
        seconds: f64,
        motion: Motion<'_>,
        body: &Body<'_>,
        wind: Option<&Wind>,
    ) -> Result<(), SimError> {
        let (roots, tips) = (self.roots.clone(), self.tips.clone());
        self.span(seconds, motion, (roots, tips), body, wind)
    }

    /// Moves through a span at whose end roots (and tips, if given) are elsewhere; nothing else moves.
    pub fn carry(&mut self, seconds: f64, roots: Vec<Root>, tips: Option<Vec<Root>>) -> Result<(), SimError> {
        let tips = tips.or_else(|| self.tips.clone());
        self.span(seconds, &still, (roots, tips), &Body::default(), None)
    }

    fn span(
        &mut self,
        seconds: f64,
        motion: Motion<'_>,
        (roots, tips): (Vec<Root>, Option<Vec<Root>>),
        body: &Body<'_>,
        wind: Option<&Wind>,
    ) -> Result<(), SimError> {
        let span = Span {
            seconds,
            time: self.time,
            motion,
            roots: [&self.roots, &roots],
            tips: self.tips.as_deref().zip(tips.as_deref()).map(|(a, b)| [a, b]),
            body,
            gravity: [self.gravity; 2],
            wind: wind.map(|w| [w, w]),
            still: &[],
        };
        self.last = self.sim.advance(&span, &|_| true)?;
        self.time += seconds;
        (self.roots, self.tips) = (roots, tips);
        Ok(())
    }

    /// Moves through a span in which nothing around the hair moves.
    pub fn wait(&mut self, seconds: f64) -> Result<(), SimError> {
        self.go(seconds, &still, &Body::default(), None)
    }

    /// The same in a number of equal spans.
    pub fn steps(&mut self, count: usize, seconds: f64) -> Result<(), SimError> {
        (0..count).try_for_each(|_| self.wait(seconds))
    }

    /// Lets everything come to rest, as far as it does: long steps damp all that they can't resolve.
    pub fn rest(&mut self) -> Result<(), SimError> {
        [(40, 0.05), (40, 0.2), (60, 1.0)].into_iter().try_for_each(|(count, seconds)| self.steps(count, seconds))
    }

    /// Points of a hair.
    pub fn hair(&self, h: usize) -> Vec<Vec3> {
        self.sim.positions()[self.sim.offsets().range(h)].iter().map(|p| Vec3::from(*p)).collect()
    }

    /// Last point of a hair.
    pub fn tip(&self, h: usize) -> Vec3 {
        self.hair(h).last().copied().unwrap_or_default()
    }

    /// Largest distance between points of a hair here and of the same one elsewhere, metres.
    pub fn apart(&self, other: &Rig, h: usize) -> f64 {
        self.hair(h).iter().zip(other.hair(h)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    /// Largest speed of a point, metres per second.
    pub fn fastest(&self) -> f64 {
        self.sim.velocities().iter().map(|v| Vec3::from(*v).norm()).fold(0.0, f64::max)
    }
}
