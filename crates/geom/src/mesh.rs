//! A triangle mesh as it stands in a file, and points on it.

use crate::Vec3;

/// A triangulated skin in the vertex order of its file. Vertices may be split at texture seams; [`crate::Topology`]
/// joins them again by position.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, scene units.
    pub position: Vec<[f64; 3]>,
    /// Triangles as vertex indices, counter-clockwise seen from outside.
    pub triangle: Vec<[u32; 3]>,
    /// Texture coordinates of each triangle's corners, v up, any value (UDIM tiles included). Empty if the mesh has none.
    pub corner_uv: Vec<[[f32; 2]; 3]>,
    /// The polygon of the file that each triangle was cut from.
    pub face: Vec<u32>,
}

impl Mesh {
    /// Corners of triangle `t`.
    pub fn corners(&self, t: u32) -> [Vec3; 3] {
        corners(&self.position, self.triangle[t as usize])
    }

    /// Position of a point on the mesh.
    pub fn point(&self, p: &SurfacePoint) -> Vec3 {
        p.blend(self.corners(p.triangle))
    }

    /// Texture coordinates of a point on the mesh.
    pub fn uv(&self, p: &SurfacePoint) -> [f32; 2] {
        let (c, w) = (&self.corner_uv[p.triangle as usize], p.weights());
        std::array::from_fn(|i| {
            (w[0] * f64::from(c[0][i]) + w[1] * f64::from(c[1][i]) + w[2] * f64::from(c[2][i])) as f32
        })
    }

    /// Smallest axis-aligned box: (low, high); zeros for an empty mesh.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let Some(first) = self.position.first() else { return ([0.0; 3], [0.0; 3]) };
        self.position.iter().fold((*first, *first), |(lo, hi), p| {
            (std::array::from_fn(|i| lo[i].min(p[i])), std::array::from_fn(|i| hi[i].max(p[i])))
        })
    }

    /// Area of triangle `t`, square scene units.
    pub fn area(&self, t: u32) -> f64 {
        let [a, b, c] = self.corners(t);
        0.5 * (b - a).cross(&(c - a)).norm()
    }
}

/// Corners of a triangle in a vertex array.
pub fn corners(position: &[[f64; 3]], triangle: [u32; 3]) -> [Vec3; 3] {
    triangle.map(|v| Vec3::from(position[v as usize]))
}

/// A point on a triangle mesh: triangle and barycentric coordinates of its second and third corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// Triangle index.
    pub triangle: u32,
    /// Weights of corners 1 and 2; corner 0 has the rest.
    pub bary: [f32; 2],
}

impl SurfacePoint {
    /// The three corner weights; they sum to 1.
    pub fn weights(&self) -> [f64; 3] {
        let (b, c) = (f64::from(self.bary[0]), f64::from(self.bary[1]));
        [1.0 - b - c, b, c]
    }

    /// Weighted sum of the three corner values.
    pub fn blend(&self, corner: [Vec3; 3]) -> Vec3 {
        let w = self.weights();
        corner[0] * w[0] + corner[1] * w[1] + corner[2] * w[2]
    }
}
