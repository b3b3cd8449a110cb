//! Hair with time: strand models, their state and the step; forces; what hair collides with.
//!
//! SI units throughout: metres, seconds, kilograms. Positions are in the world, axes as in the scene.

// Loops run over nodes, lanes and columns of several arrays at once: an index reads better there.
#![allow(clippy::needless_range_loop)]

pub mod band;
pub mod body;
pub mod contact;
pub mod drag;
pub mod group;
mod hinge;
pub mod integrate;
pub mod lanes;
pub mod nine_steps;
mod place;
pub mod reference;
pub mod rig;
pub mod rod;
mod scene;
pub mod settings;
pub mod settle;
pub mod simulation;
pub mod springs;
pub mod stage;
pub mod stress;
pub mod wind;

pub use body::{
    Body, Bounds, Closed, Deforming, Ellipsoid, Exact, Field, FieldSettings, Flow, Hit, Instant, Motion, Part, Rigid,
    RigidFit, Shape, Table, rigid_fit, rigid_part,
};
pub use settings::{End, Material, Model, Settings};
pub use simulation::{Hairs, Root, SimError, Simulation, Span, SpanReport, Started, StiffenedStrand};
pub use wind::Wind;

/// Three coordinates.
pub type Vec3 = nalgebra::Vector3<f64>;
