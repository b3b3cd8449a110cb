//! A skin at one instant: positions, smooth normals, tangents along u, and root frames.
#![allow(unused_imports)]
use crate::{Mesh, SurfacePoint, Topology, Vec3};

/// A skin at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Vertices, scene units, in the mesh's order.
    pub position: Vec<[f64; 3]>,
    /// Unit normals, one a mesh vertex; equal at vertices that are welded.
    pub normal: Vec<[f32; 3]>,
    /// Unit tangents along u, one a chart vertex.
    pub tangent: Vec<[f32; 3]>,
}

/// Root frame [N, dU, N x dU] at a point of the skin (production-pipeline paper, Figure 4): columns of a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The point, scene units.
    pub origin: Vec3,
    /// Unit smooth normal.
    pub n: Vec3,
    /// Unit tangent along u, at right angles to `n`.
    pub du: Vec3,
    /// `n` x `du`.
    pub dv: Vec3,
}

impl Pose {
    /// Normals and tangents of `position` on the topology of the rest pose.
    pub fn new(mesh: &Mesh, topology: &Topology, position: Vec<[f64; 3]>) -> Self {
        let _ = (mesh, topology);
        Pose { position, ..Pose::default() }
    }

    /// Root frame at a point of the skin.
    pub fn frame(&self, mesh: &Mesh, topology: &Topology, p: &SurfacePoint) -> Frame {
        let _ = (mesh, topology, p);
        Frame { origin: Vec3::zeros(), n: Vec3::x(), du: Vec3::y(), dv: Vec3::z() }
    }
}
