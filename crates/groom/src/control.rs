//! Control hairs: the few hundred combed hairs that all others are blended from, and the sites they hold in (u, v).
//!
//! "Course notes 2003, A production pipeline for hair", §3.2: a control hair is attached to a point of the skin and its
//! vertices are kept in [N, dU, N x dU] coordinates there, so that one file serves every frame.

use pelage_geom::{Frame, Mesh, NONE, Pose, SurfacePoint, Topology, Vec3};

/// A skin in its rest pose, as grooming reads it.
#[derive(Clone, Copy, Debug)]
pub struct Skin<'a> {
    /// The mesh of the rest pose.
    pub mesh: &'a Mesh,
    /// Its connectivity.
    pub topology: &'a Topology,
    /// Its normals and tangents.
    pub rest: &'a Pose,
}

impl Skin<'_> {
    /// Root frame at a point of the rest skin.
    pub fn frame(&self, p: &SurfacePoint) -> Frame {
        self.rest.frame(self.mesh, self.topology, p)
    }

    /// Texture coordinates of a point; zero without texture coordinates.
    pub fn uv(&self, p: &SurfacePoint) -> [f32; 2] {
        if self.mesh.corner_uv.is_empty() { [0.0; 2] } else { self.mesh.uv(p) }
    }
}

/// H control hairs of P points each, kept in the frames of their roots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlHairs {
    /// P, the points of every hair; at least 2.
    pub points: usize,
    /// \[H\] roots on the rest skin.
    pub root: Vec<SurfacePoint>,
    /// \[H * P\] point minus root in the root frame [N, dU, N x dU], scene units; point 0 of each hair is zero.
    pub local: Vec<[f32; 3]>,
    /// \[H\] +1: left copy of a parting's site, -1: right copy (seen from outside, looking along the parting), 0: neither.
    pub side: Vec<i8>,
    /// \[H\] parting that the hair stands on, or [`NONE`].
    pub parting: Vec<u32>,
    /// \[H\] true for hairs on a chart's border, which several sites may share.
    pub border: Vec<bool>,
    /// \[H\] which of the hairs placed one by one it is, or [`NONE`].
    pub single: Vec<u32>,
    /// \[H\] length that the hair was cut to, scene units; infinite for one that never was.
    pub cut: Vec<f32>,
}

impl ControlHairs {
    /// Number of hairs.
    pub fn len(&self) -> usize {
        self.root.len()
    }

    /// True if there are no hairs.
    pub fn is_empty(&self) -> bool {
        self.root.is_empty()
    }

    /// The hair that is number `single` of those placed one by one.
    pub fn placed_alone(&self, single: u32) -> Option<usize> {
        self.single.iter().position(|s| *s == single)
    }

    /// Points of hair `h` in its root frame, root first.
    pub fn hair(&self, h: usize) -> &[[f32; 3]] {
        &self.local[h * self.points..(h + 1) * self.points]
    }

    /// Sum of the segment lengths of hair `h`, scene units.
    pub fn length(&self, h: usize) -> f64 {
        pelage_geom::curve::length(self.hair(h))
    }

    /// Points of hair `h` in the space of `frame`, the frame of its root in some pose.
    pub fn placed(&self, h: usize, frame: &Frame) -> impl Iterator<Item = Vec3> + '_ {
        let frame = *frame;
        self.hair(h).iter().map(move |&p| frame.origin + to_world(&frame, vec3(p)))
    }

    /// Adds a hair given by its points relative to the root in the root frame. Panics on a wrong number of points.
    pub fn push(&mut self, root: SurfacePoint, local: &[Vec3]) {
        assert_eq!(local.len(), self.points, "a control hair with another number of points");
        self.root.push(root);
        self.local.extend(local.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]));
        self.side.push(0);
        self.parting.push(NONE);
        self.border.push(false);
        self.single.push(NONE);
        self.cut.push(f32::INFINITY);
    }
}

/// Where control hairs stand in texture space: what is triangulated, chart by chart. A hair on a seam has one site in
/// each chart that meets there, so that both charts see the same hair (paper §3.2: coincident boundary hairs, aligned).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sites {
    /// \[S\] chart of each site.
    pub chart: Vec<u32>,
    /// \[S\] texture coordinates in that chart.
    pub uv: Vec<[f32; 2]>,
    /// \[S\] control hairs [left, right] of the site: two on the inner points of a parting, else twice the same. Left is
    /// left in space, seen from outside and looking along the parting; in a mirrored chart that is right in (u, v).
    pub hair: Vec<[u32; 2]>,
    /// Chart borders as pairs of sites, in the direction of the triangle they bound.
    pub border_edges: Vec<[u32; 2]>,
    /// The pieces of the partings, each within one chart.
    pub partings: Vec<PartingPiece>,
}

/// The run of one parting through one chart. Consecutive pieces of a parting meet in seam sites of the same hairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartingPiece {
    /// Index of the parting.
    pub parting: u32,
    /// The chart.
    pub chart: u32,
    /// Sites in the parting's direction, at least two.
    pub site: Vec<u32>,
}

impl Sites {
    /// Number of sites.
    pub fn len(&self) -> usize {
        self.chart.len()
    }

    /// True if there are no sites.
    pub fn is_empty(&self) -> bool {
        self.chart.is_empty()
    }

    /// Adds a site and returns its index.
    pub fn push(&mut self, chart: u32, uv: [f32; 2], hair: [u32; 2]) -> u32 {
        self.chart.push(chart);
        self.uv.push(uv);
        self.hair.push(hair);
        (self.chart.len() - 1) as u32
    }
}

/// A vector in double precision.
pub(crate) fn vec3(p: [f32; 3]) -> Vec3 {
    Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
}

/// A direction given in [N, dU, N x dU] as a world direction.
pub(crate) fn to_world(f: &Frame, local: Vec3) -> Vec3 {
    f.n * local.x + f.du * local.y + f.dv * local.z
}

/// A world direction in [N, dU, N x dU].
pub(crate) fn to_local(f: &Frame, world: Vec3) -> Vec3 {
    Vec3::new(f.n.dot(&world), f.du.dot(&world), f.dv.dot(&world))
}
