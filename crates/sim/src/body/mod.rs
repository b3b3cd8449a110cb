//! What hair can't enter, over one span of time.

mod field;
#[cfg(test)]
mod testing;

pub use field::{Bounds, Field, FieldSettings, Flow};

use crate::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};

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
}

/// A solid with a rigid motion of its own.
#[derive(Clone)]
pub struct Part<'a> {
    /// Where its local coordinates are.
    pub motion: Motion<'a>,
    /// Its surface in local coordinates.
    pub shape: Shape<'a>,
}

/// A solid's surface in its local coordinates.
#[derive(Clone, Copy)]
pub enum Shape<'a> {
    /// A field that doesn't change.
    Field(&'a Field),
}

/// A solid's surface as seen from a point, in the coordinates of the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Distance, negative inside, metres.
    pub distance: f64,
    /// Unit vector in which it grows.
    pub normal: Vec3,
    /// Velocity of the surface, metres per second.
    pub velocity: Vec3,
}
