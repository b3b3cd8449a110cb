//! A deforming skin between two frames: fields of both, interpolated in time from two sides (Selle, Lentine, Fedkiw
//! 2008, §5.1).

use super::{Field, Flow, Hit};
use crate::Vec3;

/// Times that the velocity of the surface at a point is looked up again where the last one says the surface came from
/// and goes to. With none (the paper's scheme) a surface that passes its own size in the span is lost, and one that
/// turns by 20 degrees shrinks by a voxel; the third changes less than a hundredth of a voxel.
const ROUNDS: usize = 2;

/// Fields at the beginning and the end of a span, and the velocities of their surfaces over it.
#[derive(Clone, Copy, Debug)]
pub struct Deforming<'a> {
    /// Distance at the beginning and at the end.
    pub field: [&'a Field; 2],
    /// Velocities of each field's surface: of the same vertices over the same span, displacement over seconds.
    pub flow: [&'a Flow; 2],
    /// Length of the span.
    pub seconds: f64,
}

impl Deforming<'_> {
    /// The surface at the fraction `alpha` of the span: `(1 - alpha) phi_0(x - dt alpha v) + alpha phi_1(x + dt (1 -
    /// alpha) v)`. Here v is not looked up at x, as in the paper, but where that v itself leads, by a fixed point: on
    /// the surface both end points are then those of the vertex path through x, so that its zero is the linearly
    /// interpolated mesh, whatever it does. The two errors of v cancel to first order under the weights 1 - alpha and
    /// alpha, so that two rounds are enough. The normal is the blended one.
    pub fn sample(&self, p: Vec3, alpha: f64) -> Hit {
        self.sample_rounds(p, alpha, ROUNDS)
    }

    fn sample_rounds(&self, p: Vec3, alpha: f64, rounds: usize) -> Hit {
        let at = |i: usize, x: Vec3| self.flow[i].at(&self.field[i].locate(x).0);
        let (behind, ahead) = (alpha * self.seconds, (1.0 - alpha) * self.seconds);
        let mut v = (at(0, p) + at(1, p)) * 0.5;
        for _ in 0..rounds {
            v = at(0, p - v * behind) * (1.0 - alpha) + at(1, p + v * ahead) * alpha;
        }
        let (a, b) = (self.field[0].sample(p - v * behind), self.field[1].sample(p + v * ahead));
        let nearer = if alpha < 0.5 { a.normal } else { b.normal };
        let normal = (a.normal * (1.0 - alpha) + b.normal * alpha).try_normalize(1e-6).unwrap_or(nearer);
        Hit { distance: a.distance * (1.0 - alpha) + b.distance * alpha, normal, velocity: v }
    }

    /// Lower bound of the distance outside, zero or less inside: that of either frame less how far any vertex moves.
    pub fn distance_bound(&self, p: Vec3, alpha: f64) -> f64 {
        let speed = self.flow[0].fastest.max(self.flow[1].fastest) * self.seconds;
        let (a, b) = (self.field[0].distance_bound(p), self.field[1].distance_bound(p));
        (a - alpha * speed).max(b - (1.0 - alpha) * speed)
    }
}

#[cfg(test)]
#[path = "deforming_tests.rs"]
mod tests;
