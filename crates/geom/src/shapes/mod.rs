//! Meshes made by formula: samples and test bodies.
