//! What stays the same while a skin moves: welded vertices, texture charts, seams.
#![allow(unused_imports)]
use crate::{Mesh, NONE, Vec3};
use std::collections::BTreeMap;

/// A vertex of one chart: the corners of that chart that share a position and texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartVertex {
    /// A mesh vertex at that position (the welded one: the first of its position).
    pub vertex: u32,
    /// Chart it belongs to.
    pub chart: u32,
    /// Its texture coordinates.
    pub uv: [f32; 2],
    /// True if it lies on its chart's border (a seam or an open edge).
    pub border: bool,
}

/// Connectivity of a mesh, found once on the rest pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topology {
    /// Vertex -> first vertex at exactly the same rest position.
    pub weld: Vec<u32>,
    /// Triangle -> chart. A chart is a set of triangles joined by edges on which texture coordinates agree, all of
    /// one orientation in (u, v).
    pub chart: Vec<u32>,
    /// Number of charts.
    pub charts: usize,
    /// Triangle -> triangle across the edge from corner i to corner i + 1 ([`NONE`] on an open or non-manifold edge).
    pub neighbour: Vec<[u32; 3]>,
    /// Vertices per chart.
    pub chart_vertex: Vec<ChartVertex>,
    /// Triangle corner -> chart vertex.
    pub corner: Vec<[u32; 3]>,
    /// Rest area of each triangle, square scene units.
    pub area: Vec<f64>,
    /// Triangles without area in (u, v); their tangent comes from neighbours.
    pub flat_uv: Vec<bool>,
    /// What was found odd on the way.
    pub counts: TopologyCounts,
}

/// Oddities of a mesh, counted for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TopologyCounts {
    /// Triangles with no area in space.
    pub zero_area: usize,
    /// Triangles with area in space and none in (u, v).
    pub zero_uv_area: usize,
    /// Triangles of opposite orientation in space and in (u, v).
    pub mirrored: usize,
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Edges with more than two triangles, or two that run the same way.
    pub non_manifold_edges: usize,
    /// Edges between two charts.
    pub seam_edges: usize,
}

impl Topology {
    /// Finds welds, charts, seams and areas of a rest mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let _ = mesh;
        Topology::default()
    }
}
