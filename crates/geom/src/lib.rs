//! What hair and skin are: plain data in structures of arrays, and the geometry that every other part asks of them.
//!
//! Lengths are scene units unless a name says otherwise; coordinates are right-handed world (scene) space; texture
//! coordinates have v up. Nothing here reads a file, a clock or the environment.

pub mod bvh;
pub mod curve;
pub mod map;
pub mod mesh;
pub mod motion;
pub mod nurbs;
pub mod pose;
pub mod registers;
#[cfg(test)]
mod registers_tests;
pub mod ride;
pub mod rng;
pub mod shapes;
pub mod strands;
pub mod topology;

pub use bvh::{Bvh, Closest};
pub use map::{Map, TiledMap, Wrap};
pub use mesh::{Mesh, SurfacePoint};
pub use motion::RigidMotion;
pub use pose::{Frame, Pose};
pub use strands::{Offsets, StrandId, Strands};
pub use topology::Topology;

/// A point or direction in double precision: what geometry is computed in.
pub type Vec3 = nalgebra::Vector3<f64>;

/// Index that stands for "none" in `u32` tables.
pub const NONE: u32 = u32::MAX;
