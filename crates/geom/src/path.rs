//! Straight paths over a mesh.
