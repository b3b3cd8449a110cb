//! What hair can't enter, over one span of time.

mod closed;
mod deforming;
mod eigen;
mod ellipsoid;
mod field;
mod rigid_fit;
mod table;
#[cfg(test)]
mod testing;

pub use closed::Closed;
pub use deforming::Deforming;
pub use ellipsoid::Ellipsoid;
pub use field::{Bounds, Field, FieldSettings, Flow, Known};
pub use rigid_fit::{RigidFit, rigid_fit, rigid_part};
pub use table::Table;

use crate::Vec3;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use pelage_geom::Bvh;

/// Fraction of the span over which a part's velocity is a difference. Below 1e-9 rounding shows in it; above 1e-4
/// the one-sided difference at the ends of the span is off by more than 1e-4 of itself.
const RATE: f64 = 1e-6;

/// A rigid placement: `world = rotation * local + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// Unit quaternion (x, y, z, w).
    pub rotation: [f64; 4],
    /// Metres.
    pub translation: [f64; 3],
}

impl Default for Rigid {
    fn default() -> Self {
        Rigid { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0; 3] }
    }
}

impl Rigid {
    /// Rotation as nalgebra's type.
    pub fn quaternion(&self) -> UnitQuaternion<f64> {
        let [x, y, z, w] = self.rotation;
        UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
    }

    /// A fraction of the way from one rotation to another, unit quaternions, along the shorter arc; linear and normalised.
    pub fn turn_between(a: [f64; 4], b: [f64; 4], f: f64) -> [f64; 4] {
        let dot: f64 = (0..4).map(|i| a[i] * b[i]).sum();
        let q: [f64; 4] = std::array::from_fn(|i| (1.0 - f) * a[i] + f.copysign(dot) * b[i]);
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        q.map(|x| x / norm)
    }

    /// Moves a local point into the world.
    pub fn apply(&self, local: Vec3) -> Vec3 {
        self.quaternion() * local + Vec3::from(self.translation)
    }

    /// Moves a world point into local coordinates.
    pub fn invert(&self, world: Vec3) -> Vec3 {
        self.quaternion().inverse() * (world - Vec3::from(self.translation))
    }
}

/// Placement of something rigid over a span, as a function of the fraction of the span, 0 to 1.
pub type Motion<'a> = &'a (dyn Fn(f64) -> Rigid + Sync);

/// Everything that hair can't enter over one span.
#[derive(Clone, Default)]
pub struct Body<'a> {
    /// Its parts; none: hair moves freely.
    pub parts: Vec<Part<'a>>,
    /// Length of the span: turns motion into velocity.
    pub seconds: f64,
}

/// A solid with a rigid motion of its own.
#[derive(Clone)]
pub struct Part<'a> {
    /// Where its local coordinates are.
    pub motion: Motion<'a>,
    /// Its surface in local coordinates.
    pub shape: Shape<'a>,
    /// The mesh itself at the end of the span.
    pub exact: Option<Exact<'a>>,
}

/// A solid's surface in its local coordinates.
#[derive(Clone, Copy)]
pub enum Shape<'a> {
    /// A field that doesn't change.
    Field(&'a Field),
    /// Fields at the beginning and the end.
    Deforming(Deforming<'a>),
    /// A table that doesn't change.
    Table(&'a Table),
    /// An ellipsoid that doesn't change.
    Ellipsoid(&'a Ellipsoid),
}

/// A mesh at the end of a span, in its part's local coordinates.
#[derive(Clone, Copy)]
pub struct Exact<'a> {
    /// Its hierarchy.
    pub bvh: &'a Bvh,
    /// Its triangles.
    pub triangle: &'a [[u32; 3]],
    /// Velocities of its vertices over the span in local coordinates, metres per second; `None` if it doesn't deform.
    pub velocity: Option<&'a [[f64; 3]]>,
}

/// A solid's surface as seen from a point, in the coordinates of the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance, negative inside, metres.
    pub distance: f64,
    /// Unit vector in which it grows.
    pub normal: Vec3,
    /// Velocity of the surface, metres per second.
    pub velocity: Vec3,
}

/// A [`Body`] at one instant. Making it costs a few calls of each part's motion; share it among points.
#[derive(Clone)]
pub struct Instant<'b, 'a> {
    body: &'b Body<'a>,
    alpha: f64,
    placed: Vec<Placed>,
}

/// A part's placement and its rate of change.
#[derive(Clone, Copy)]
struct Placed {
    rotation: Matrix3<f64>,
    translation: Vec3,
    /// Rates per second.
    turning: Matrix3<f64>,
    velocity: Vec3,
}

impl<'a> Body<'a> {
    /// The body at the fraction `alpha` of the span.
    pub fn at(&self, alpha: f64) -> Instant<'_, 'a> {
        let placed = self.parts.iter().map(|p| Placed::of(p.motion, alpha, self.seconds)).collect();
        Instant { body: self, alpha, placed }
    }

    /// [`Instant::sample`] for a single point.
    pub fn sample(&self, p: Vec3, alpha: f64) -> Hit {
        self.at(alpha).sample(p)
    }

    /// [`Instant::distance_bound`] for a single point.
    pub fn distance_bound(&self, p: Vec3, alpha: f64) -> f64 {
        self.at(alpha).distance_bound(p)
    }

    /// [`Instant::exact`] at the end of the span for a single point.
    pub fn exact(&self, p: Vec3, within: f64) -> Option<Hit> {
        self.at(1.0).exact(p, within)
    }
}

impl Instant<'_, '_> {
    /// The nearest of the parts' surfaces (deepest, where a point is inside of several): distance, normal, velocity with
    /// that of the rigid motion, in the world. Infinitely far without parts.
    pub fn sample(&self, p: Vec3) -> Hit {
        self.nearest(p).0
    }

    /// [`Instant::sample`], and whether that surface is a shape that only stands for a mesh: groomed hair may be in it.
    pub fn nearest(&self, p: Vec3) -> (Hit, bool) {
        let mut nearest = Hit { distance: f64::INFINITY, normal: Vec3::y(), velocity: Vec3::zeros() };
        let mut stands_for = false;
        for (part, placed) in self.body.parts.iter().zip(&self.placed) {
            let local = placed.invert(p);
            if nearest.distance < f64::INFINITY && part.shape.distance_bound(local, self.alpha) > nearest.distance {
                continue;
            }
            let hit = part.shape.sample(local, self.alpha);
            if hit.distance < nearest.distance {
                nearest = placed.into_world(local, hit);
                stands_for = matches!(part.shape, Shape::Table(_) | Shape::Ellipsoid(_));
            }
        }
        (nearest, stands_for)
    }

    /// A lower bound of the distance where the point is outside, zero or less inside; cheaper than [`Instant::sample`].
    pub fn distance_bound(&self, p: Vec3) -> f64 {
        let parts = self.body.parts.iter().zip(&self.placed);
        parts
            .map(|(part, placed)| part.shape.distance_bound(placed.invert(p), self.alpha))
            .fold(f64::INFINITY, f64::min)
    }

    /// The nearest of the exact meshes, which are those at the end of the span: ask at `alpha` = 1. `None` where none is
    /// nearer than `within` metres and the point is inside of none. Points that the bounds of the parts' shapes keep
    /// farther away are not looked up.
    pub fn exact(&self, p: Vec3, within: f64) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (part, placed) in self.body.parts.iter().zip(&self.placed) {
            let Some(exact) = part.exact else { continue };
            let local = placed.invert(p);
            if part.shape.distance_bound(local, self.alpha) > within {
                continue;
            }
            let Some(hit) = exact.sample(local, within) else { continue };
            if nearest.is_none_or(|n| hit.distance < n.distance) {
                nearest = Some(placed.into_world(local, hit));
            }
        }
        nearest
    }
}

impl Exact<'_> {
    /// Closest point, unless it is outside and not nearer than `within`.
    fn sample(&self, p: Vec3, within: f64) -> Option<Hit> {
        let c = self.bvh.closest(p, f64::INFINITY).filter(|c| c.signed_distance < within)?;
        let away = (p - c.position).try_normalize(1e-9);
        let normal = away.map_or(c.normal, |n| if c.signed_distance < 0.0 { -n } else { n });
        let velocity = self.velocity.map_or(Vec3::zeros(), |velocity| {
            c.point.blend(self.triangle[c.point.triangle as usize].map(|v| Vec3::from(velocity[v as usize])))
        });
        Some(Hit { distance: c.signed_distance, normal, velocity })
    }
}

impl Shape<'_> {
    /// Distance, normal and velocity in local coordinates at the fraction `alpha` of the span.
    pub fn sample(&self, p: Vec3, alpha: f64) -> Hit {
        match self {
            Shape::Field(field) => field.sample(p),
            Shape::Deforming(deforming) => deforming.sample(p, alpha),
            Shape::Table(table) => table.sample(p),
            Shape::Ellipsoid(ellipsoid) => ellipsoid.sample(p),
        }
    }

    /// Lower bound of the distance outside, zero or less inside.
    pub fn distance_bound(&self, p: Vec3, alpha: f64) -> f64 {
        match self {
            Shape::Field(field) => field.distance_bound(p),
            Shape::Deforming(deforming) => deforming.distance_bound(p, alpha),
            Shape::Table(table) => table.distance_bound(p),
            Shape::Ellipsoid(ellipsoid) => ellipsoid.distance_bound(p),
        }
    }
}

impl Placed {
    /// Rates are differences over `2 * RATE` of the span around `alpha`, or over what of that lies in the span.
    fn of(motion: Motion, alpha: f64, seconds: f64) -> Self {
        let matrix = |r: Rigid| r.quaternion().to_rotation_matrix().into_inner();
        let (here, from, to) = (motion(alpha), (alpha - RATE).max(0.0), (alpha + RATE).min(1.0));
        let (before, after) = (motion(from), motion(to));
        let time = (to - from) * seconds;
        let per = if time > 0.0 { 1.0 / time } else { 0.0 };
        Placed {
            rotation: matrix(here),
            translation: Vec3::from(here.translation),
            turning: (matrix(after) - matrix(before)) * per,
            velocity: (Vec3::from(after.translation) - Vec3::from(before.translation)) * per,
        }
    }

    fn invert(&self, p: Vec3) -> Vec3 {
        self.rotation.tr_mul(&(p - self.translation))
    }

    /// Carries a hit into the world; the surface point moves as the part does there.
    fn into_world(self, local: Vec3, hit: Hit) -> Hit {
        let foot = local - hit.normal * hit.distance;
        Hit {
            distance: hit.distance,
            normal: self.rotation * hit.normal,
            velocity: self.rotation * hit.velocity + self.turning * foot + self.velocity,
        }
    }
}

#[cfg(test)]
#[path = "body_tests.rs"]
mod tests;
