//! Meshes made by formula: samples and test bodies.

pub mod atlas;
pub mod banded;
pub mod bust;
pub mod field;
pub mod nets;
pub mod remesh;
pub mod unwrap;
