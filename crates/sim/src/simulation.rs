//! A layer of hair in motion: the constant model, the changing state, and the step over a span of time.

use crate::{Body, Motion, Rigid, Vec3, Wind};
use pelage_geom::{Offsets, StrandId};

/// Hairs at the rest pose, root first.
#[derive(Clone, Copy, Debug)]
pub struct Hairs<'a> {
    /// Runs of `position`, one a hair. A hair has at least one point.
    pub offsets: &'a Offsets,
    /// Points, metres.
    pub position: &'a [[f64; 3]],
    /// Names, one a hair.
    pub id: &'a [StrandId],
}

/// What hair is made of. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Diameter of the round section, metres.
    pub diameter: f64,
    /// Young's modulus, pascals.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kilograms per cubic metre.
    pub density: f64,
    /// Relaxation time of bending and twisting, seconds: internal damping is this times stiffness.
    pub damping: f64,
    /// Artist's factor on bending stiffness.
    pub bend_factor: f64,
    /// Artist's factor on twisting stiffness.
    pub twist_factor: f64,
    /// Artist's factor on stretching stiffness.
    pub stretch_factor: f64,
    /// Artist's factor on air drag.
    pub drag_factor: f64,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            diameter: 70e-6,
            young: 3.9e9,
            poisson: 0.3,
            density: 1300.0,
            damping: 2e-3,
            bend_factor: 1.0,
            twist_factor: 1.0,
            stretch_factor: 1.0,
            drag_factor: 1.0,
        }
    }
}

/// Model of a strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// Discrete elastic rod.
    #[default]
    Rod,
    /// Springs with altitude springs, calibrated to the material, robust integration.
    Springs,
    /// Springs with the paper's nine steps.
    Paper,
}

/// How a layer is simulated; constant over a shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Model of a strand.
    pub model: Model,
    /// What the hair is made of.
    pub material: Material,
    /// Segments of a strand, equal in arc length; `None`: the input's points as they are.
    pub segments: Option<usize>,
    /// Steps in a span; `None`: chosen from the prescribed motion.
    pub substeps: Option<u32>,
    /// Start in equilibrium under gravity.
    pub sag_free: bool,
    /// Largest strain that limiting leaves in a segment.
    pub strain_limit: f64,
    /// Coulomb friction with the body.
    pub friction: f64,
    /// Distance that hair keeps from the body, metres.
    pub offset: f64,
    /// A root that moves farther than this in a span takes its hair along without dynamics, metres.
    pub teleport: f64,
    /// Let strands at rest sleep.
    pub sleep: bool,
    /// Use the widest lanes of the processor. Changes no bit of the result.
    pub wide: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            model: Model::Rod,
            material: Material::default(),
            segments: None,
            substeps: None,
            sag_free: true,
            strain_limit: 0.01,
            friction: 0.3,
            offset: 0.5e-3,
            teleport: 1.0,
            sleep: true,
            wide: true,
        }
    }
}

/// A root's placement relative to its rest pose, in the coordinates of [`Span::motion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// Where the root is, metres.
    pub position: [f64; 3],
    /// Rotation from the rest pose, unit quaternion (x, y, z, w).
    pub rotation: [f64; 4],
}

/// A span of time, mostly one frame, with everything prescribed in it.
#[derive(Clone)]
pub struct Span<'a> {
    /// Its length, seconds.
    pub seconds: f64,
    /// Time of its beginning in the shot, seconds.
    pub time: f64,
    /// Placement of the coordinates of `roots`: the rigid part of the skin's motion.
    pub motion: Motion<'a>,
    /// Roots at the beginning and at the end, one a hair; linear in between.
    pub roots: [&'a [Root]; 2],
    /// What hair can't enter.
    pub body: &'a Body<'a>,
    /// Gravity at the beginning and at the end, metres per second squared.
    pub gravity: [[f64; 3]; 2],
    /// The wind.
    pub wind: Option<&'a Wind>,
}

/// A strand that had to be stiffened so that its groomed pose can stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffenedStrand {
    /// Its name.
    pub id: StrandId,
    /// Factor on its bending and twisting stiffness; 0 if no factor tried was enough.
    pub factor: f64,
}

/// What a simulation starts with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Started {
    /// Points that are simulated.
    pub particles: u64,
    /// Memory of model and state, bytes.
    pub bytes: u64,
    /// Strands that had to be stiffened.
    pub stiffened: Vec<StiffenedStrand>,
    /// Strands too short to simulate: they ride with their roots.
    pub rigid: Vec<StrandId>,
    /// Largest angle between neighbouring segments at rest, radians.
    pub largest_hinge: f64,
    /// Largest ratio of weight to bending stiffness, `w L^3 / B`.
    pub largest_gamma: f64,
}

/// What happened in a span.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpanReport {
    /// Steps in the span before any strand subdivides.
    pub steps: u32,
    /// Shortest step that any strand took, seconds.
    pub shortest_step: f64,
    /// Points times steps.
    pub particle_steps: u64,
    /// Linear solves times points.
    pub particle_solves: u64,
    /// Largest strain at the end.
    pub largest_strain: f64,
    /// Strands that took steps of their own.
    pub subdivided: u64,
    /// Strands that slept.
    pub sleeping: u64,
    /// Points touching the body at the end.
    pub contacts: u64,
    /// Strands carried over a jump of their root.
    pub teleported: u64,
    /// Strands that diverged and were held for this span.
    pub held: Vec<StrandId>,
    /// Strands whose root was not a number: held where it was last.
    pub bad_roots: Vec<StrandId>,
}

/// What can be wrong with a simulation's input or saved state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A value is not a number.
    #[error("hair {hair}, point {point}: not a finite position")]
    NotFinite {
        /// Index of the hair.
        hair: usize,
        /// Index of the point in its hair.
        point: usize,
    },
    /// A setting is out of range.
    #[error("{name} is {value}: {expected}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A saved state is not of this simulation.
    #[error("the saved state does not belong to this simulation: {0}")]
    State(&'static str),
    /// Work was stopped by the caller.
    #[error("stopped")]
    Stopped,
}

/// A layer of hair in motion.
#[derive(Clone, Debug)]
pub struct Simulation {
    offsets: Offsets,
    rest: Vec<[f64; 3]>,
    now: Vec<[f64; 3]>,
}

impl Simulation {
    /// Prepares the hairs of a layer at rest under `gravity` (metres per second squared).
    ///
    /// The result depends on the arguments only.
    pub fn new(hairs: &Hairs<'_>, settings: &Settings, gravity: [f64; 3]) -> Result<(Self, Started), SimError> {
        let _ = gravity;
        let mut rest = Vec::new();
        let mut counts = Vec::new();
        for h in 0..hairs.offsets.len() {
            let points: Vec<Vec3> = hairs.position[hairs.offsets.range(h)].iter().map(|p| Vec3::from(*p)).collect();
            let n = settings.segments.map_or(points.len(), |s| s + 1);
            counts.push(n);
            rest.extend(pelage_geom::curve::resample(&points, n).iter().map(|p| [p.x, p.y, p.z]));
        }
        let started = Started { particles: rest.len() as u64, ..Started::default() };
        Ok((Simulation { offsets: Offsets::from_counts(counts), now: rest.clone(), rest }, started))
    }

    /// Estimates the memory that [`Simulation::new`] will need, bytes, before any of it is taken.
    pub fn memory(hairs: usize, points: usize) -> u64 {
        (hairs * points * 200) as u64
    }

    /// Moves through a span. `progress` is told the fraction done and may stop the work by returning false; then the
    /// state is as it was before the call.
    pub fn advance(
        &mut self,
        span: &Span<'_>,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<SpanReport, SimError> {
        let end: Rigid = (span.motion)(1.0);
        for (s, root) in span.roots[1].iter().enumerate() {
            let turn = Rigid { rotation: root.rotation, translation: root.position };
            let run = self.offsets.range(s);
            let first = Vec3::from(self.rest[run.start]);
            for i in run {
                self.now[i] = end.apply(turn.apply(Vec3::from(self.rest[i]) - first)).into();
            }
        }
        if progress(1.0) { Ok(SpanReport::default()) } else { Err(SimError::Stopped) }
    }

    /// Runs of [`Simulation::positions`], one a hair, in the order of the input.
    pub fn offsets(&self) -> &Offsets {
        &self.offsets
    }

    /// Points of every hair, root first, metres.
    pub fn positions(&self) -> Vec<[f64; 3]> {
        self.now.clone()
    }

    /// The whole changing state as bytes: [`Simulation::restore`] on a simulation made from the same input goes on as
    /// if nothing had happened.
    pub fn save(&self) -> Vec<u8> {
        bytemuck::cast_slice(&self.now).to_vec()
    }

    /// Takes over a saved state.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), SimError> {
        if state.len() != self.now.len() * 24 {
            return Err(SimError::State("its length differs"));
        }
        self.now = state.chunks_exact(24).map(bytemuck::pod_read_unaligned).collect();
        Ok(())
    }
}
