//! The time of a simulated shot: pre-roll, frames, stretches between checkpoints, and where the skin is at every moment.

use crate::project::{Project, SkinAt, preroll};
use pelage_geom::motion::RigidTransform;
use pelage_geom::ride;
use std::ops::RangeInclusive;

/// Share of the pre-roll that always leads from the rest pose into the motion, even where a sequence has frames for all of
/// it. Without it the skin would jump there in one frame.
const EASED: f64 = 1.0 / 3.0;

/// Step for the velocity of a sampled motion, frames: shorter than usual distances of samples.
pub const STEP: f64 = 1.0 / 16.0;

/// Frames of a simulated shot. Frame numbers may leave 32 bits before the first one.
#[derive(Clone, Copy, Debug)]
pub struct Timeline<'a> {
    project: &'a Project,
    /// First frame of the shot.
    pub first: i64,
    /// Last frame of the shot.
    pub last: i64,
    /// Frames before the first, from the rest pose on.
    pub preroll: i64,
    checkpoint: i64,
}

impl<'a> Timeline<'a> {
    /// Of a shot.
    pub fn new(project: &'a Project) -> Self {
        let shot = &project.shot.value;
        let [first, last] = shot.shot.frames.map(i64::from);
        let checkpoint = i64::from(shot.simulate.checkpoint);
        Timeline { project, first, last, preroll: i64::from(preroll(shot)), checkpoint }
    }

    /// The frame at which everything is at rest.
    pub fn start(&self) -> i64 {
        self.first - self.preroll
    }

    /// Number of stretches between checkpoints.
    pub fn stretches(&self) -> u32 {
        ((self.last - self.first) / self.checkpoint + 1) as u32
    }

    /// Frames of a stretch.
    pub fn stretch(&self, k: u32) -> RangeInclusive<i64> {
        let start = self.first + i64::from(k) * self.checkpoint;
        start..=(start + self.checkpoint - 1).min(self.last)
    }

    /// The stretch that a frame of the shot is in.
    pub fn stretch_of(&self, frame: i32) -> u32 {
        ((i64::from(frame) - self.first) / self.checkpoint) as u32
    }

    /// Frames that are simulated in a stretch, pre-roll included. Each ends a span that begins a frame before it. Without
    /// pre-roll the first frame is where it starts.
    pub fn simulated(&self, k: u32) -> RangeInclusive<i64> {
        let frames = self.stretch(k);
        if k == 0 { self.start() + 1..=*frames.end() } else { frames }
    }

    /// Seconds at a frame number. They do not depend on where the shot begins.
    pub fn seconds(&self, frame: f64) -> f64 {
        frame / self.project.shot.value.shot.fps
    }

    /// The first frame at which the skin is where the motion or sequence has it. Before, it comes there from the rest pose.
    pub fn arrival(&self) -> i64 {
        let eased = self.start() + (EASED * self.preroll as f64).ceil() as i64;
        let known = |frame: i64| match &self.project.motion {
            Some(m) => m.seconds(frame as f64) >= m.motion.time[0],
            None => self.skin_at(frame).is_some(),
        };
        let mut arrival = self.first;
        while arrival > eased && known(arrival - 1) {
            arrival -= 1;
        }
        arrival
    }

    /// What the shot has of the skin at a whole frame.
    pub fn skin_at(&self, frame: i64) -> Option<&'a SkinAt> {
        let frame = i32::try_from(frame).ok()?;
        self.project.frames.get(&frame).or_else(|| self.project.before.get(&frame))
    }

    /// Placement of a skin that moves as a whole at any time, in frames; `None` if it deforms.
    pub fn rigid(&self, arrival: i64, frame: f64) -> Option<RigidTransform> {
        let Some(m) = &self.project.motion else {
            let still = RigidTransform { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0; 3], pivot: [0.0; 3] };
            let deforms = self.project.shot.value.skin.as_ref().is_some_and(|s| s.frames.is_some());
            return (!deforms).then_some(still);
        };
        let arrival = arrival as f64;
        if frame >= arrival {
            return Some(m.at(frame));
        }
        let frames = arrival - self.start() as f64;
        let s = (frame - self.start() as f64) / frames;
        Some(ride::ease_rigid(&m.at(arrival), &m.at(arrival + STEP), STEP, frames, s))
    }

    /// How far a frame before the arrival is on the way: fraction, and the way's length in frames.
    pub fn way(&self, arrival: i64, frame: i64) -> (f64, f64) {
        let frames = (arrival - self.start()) as f64;
        ((frame - self.start()) as f64 / frames, frames)
    }
}
