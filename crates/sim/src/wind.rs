//! The wind: a velocity of air at every point and time.

use crate::Vec3;

/// A wind field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wind {
    /// Mean velocity, metres per second.
    pub velocity: [f64; 3],
}

impl Wind {
    /// Velocity of the air at a point, metres per second; `time` in seconds of the shot.
    pub fn at(&self, _point: Vec3, _time: f64) -> Vec3 {
        Vec3::from(self.velocity)
    }
}
