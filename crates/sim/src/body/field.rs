//! Signed distance fields of triangle meshes (Selle, Lentine, Fedkiw 2008, §5.1: negative inside, positive outside).
//!
//! A dense lattice of coarse corners covers the mesh and its band; where the surface is near, a cell of that lattice is
//! a brick of 8 x 8 x 8 fine samples. Fine samples hold the exact distance inside the band and go over into the trilinear
//! interpolation of the coarse corners beyond it, so that the field is continuous where bricks end: on a face towards a
//! cell without a brick both sides are the same bilinear function.

mod build;

pub use build::Known;

use super::Hit;
use crate::Vec3;
use pelage_geom::{Bvh, NONE, SurfacePoint, Topology};
use rayon::prelude::*;

/// Samples along a brick's side. With 4 a brick is mostly border, which neighbours store again; with 16 most samples of
/// a brick lie outside the band.
const SIDE: usize = 8;
const CELLS: usize = SIDE - 1;
const SAMPLES: usize = SIDE * SIDE * SIDE;

/// Voxels from the surface within which all samples are exact; farther out those between nodes are interpolated from
/// them, off by about voxel^2 / distance near a sharp feature. With 1 that shows in contact distances around ears and
/// noses; with 4 building takes twice as long.
const NEAR: f64 = 2.0;

/// Stands for no known foot.
const NOWHERE: SurfacePoint = SurfacePoint { triangle: NONE, bary: [0.0; 2] };

/// How finely and how far from the surface a field is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSettings {
    /// Distance between samples, metres; above 0.
    pub voxel: f64,
    /// Distance outside the surface up to which there are fine samples, metres.
    pub outside: f64,
    /// Distance inside the surface up to which there are fine samples, metres.
    pub inside: f64,
}

/// An axis-aligned box: lowest and highest corner.
pub type Bounds = ([f64; 3], [f64; 3]);

/// Signed distance to a mesh in the coordinates of its positions, metres.
#[derive(Clone, Debug, Default)]
pub struct Field {
    /// Edges with one triangle: where there are any, inside ends somewhere in the air (see [`Field::build`]).
    pub open_edges: usize,
    /// Vertices without a finite position; their triangles are left out.
    pub not_finite: usize,
    settings: FieldSettings,
    per_voxel: f64,
    /// Box of the mesh.
    mesh: Bounds,
    /// Lowest corner of the lattice, and its highest.
    domain: Bounds,
    /// Cells of the coarse lattice along each axis; zero if there is none.
    cells: [usize; 3],
    /// Cell -> first sample of its brick, or [`NONE`].
    brick: Vec<u32>,
    /// Cell -> distance at its centre, rounded down.
    centre: Vec<f32>,
    /// Distances: corners of the coarse lattice, then the bricks, each with x fastest.
    distance: Vec<f32>,
    /// Closest point of the mesh to each sample; triangle [`NONE`] where nothing exact is known.
    foot: Vec<SurfacePoint>,
    /// Positions of the feet of the coarse corners, metres.
    corner_foot: Vec<[f32; 3]>,
}

/// Velocity of the closest surface point at every sample of one [`Field`].
#[derive(Clone, Debug, Default)]
pub struct Flow {
    velocity: Vec<[f32; 3]>,
    /// Largest speed of any vertex, metres per second.
    pub fastest: f64,
}

/// Where a point lies among eight samples.
#[derive(Clone, Copy, Debug)]
struct Place {
    base: usize,
    stride: [usize; 2],
    /// Fractions between them.
    t: [f64; 3],
    /// Samples a metre.
    scale: f64,
}

impl Default for FieldSettings {
    fn default() -> Self {
        FieldSettings { voxel: 0.004, outside: 0.02, inside: 0.01 }
    }
}

impl Field {
    /// Samples the mesh of `position` (metres) and `triangle`; `bvh` and `topology` are its own. `region`: where hair
    /// can come, if less than everywhere; outside of it distances are extrapolated.
    ///
    /// The sign is that of [`Bvh::closest`]: points whose closest feature is an open border are outside, so that behind
    /// a rim the sign jumps somewhere in the open; [`super::Closed`] closes holes beforehand. Voxels are larger than
    /// asked where the lattice would be too large ([`Field::voxel`]). An empty mesh is infinitely far away.
    ///
    /// `known`: a field of the mesh in another pose; what is closer to the parts that lie as they did is taken from there.
    pub fn build(
        position: &[[f64; 3]],
        triangle: &[[u32; 3]],
        topology: &Topology,
        bvh: &Bvh,
        settings: &FieldSettings,
        region: Option<Bounds>,
        known: Option<Known<'_>>,
    ) -> Self {
        let mut field = Field {
            open_edges: topology.counts.open_edges,
            not_finite: position.iter().filter(|p| !finite(p)).count(),
            settings: *settings,
            mesh: build::mesh_bounds(position, triangle),
            ..Field::default()
        };
        if !field.lay_lattice(region) {
            return field;
        }
        let known = known.and_then(|k| k.aligned(&field));
        field.sample_corners(bvh, known.as_ref());
        let active = field.sample_centres(bvh, known.as_ref());
        field.sample_bricks(bvh, &active, known.as_ref().map(|k| k.field));
        field.join_bricks(&active);
        field
    }

    /// Distance between samples, metres.
    pub fn voxel(&self) -> f64 {
        self.settings.voxel
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        4 * (self.brick.len() + self.centre.len() + self.distance.len())
            + 12 * (self.foot.len() + self.corner_foot.len())
    }

    /// Number of bricks.
    pub fn bricks(&self) -> usize {
        (self.distance.len() - self.corners()) / SAMPLES
    }

    /// Trilinear distance, its unit gradient, and no velocity. Continuous. Beyond the lattice it is that of the surface
    /// point that is closest to the nearest point of the lattice.
    pub fn sample(&self, p: Vec3) -> Hit {
        if self.cells[0] == 0 {
            return self.away(p);
        }
        let (place, beyond) = self.locate(p);
        let (distance, gradient) = self.value(&place);
        if beyond != Vec3::zeros() && distance > 0.0 {
            return self.extrapolate(p, beyond);
        }
        let normal = gradient.try_normalize(1e-3).unwrap_or_else(|| self.coarse_normal(p));
        Hit { distance, normal, velocity: Vec3::zeros() }
    }

    /// Beyond the lattice: from the blended foot of its nearest point, and continuous there.
    fn extrapolate(&self, p: Vec3, beyond: Vec3) -> Hit {
        let q = p - beyond;
        let (cell, f) = self.cell(q);
        let place = self.coarse(cell, f);
        let foot = Vec3::from(std::array::from_fn(|i| place.blend(|k| f64::from(self.corner_foot[k][i]))));
        let distance = self.value(&self.locate(q).0).0 + (p - foot).norm() - (q - foot).norm();
        let normal = (p - foot).try_normalize(1e-12).unwrap_or_else(Vec3::y);
        Hit { distance, normal, velocity: Vec3::zeros() }
    }

    /// A lower bound of the distance to the surface where `p` is outside; zero or less where it is inside.
    pub fn distance_bound(&self, p: Vec3) -> f64 {
        let far = box_distance(p, &self.mesh);
        if self.cells[0] == 0 {
            return far;
        }
        let q = self.clamp(p);
        let (b, f) = self.cell(q);
        let cell = self.index(b);
        let size = self.cell_size();
        let off = |side: f64, g: [f64; 3]| side * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt();
        let mut bound = f64::from(self.centre[cell]) - off(size, f.map(|f| f - 0.5));
        let brick = self.brick[cell];
        if brick != NONE {
            let g = f.map(|f| f * CELLS as f64);
            let near = g.map(|g| (g + 0.5) as usize);
            let at = brick as usize + near[0] + SIDE * (near[1] + SIDE * near[2]);
            // Farther samples hold no less than this but may hold too much.
            let sure = self.settings.outside.min(NEAR * self.settings.voxel);
            let known = f64::from(self.distance[at]).min(sure);
            let short = off(self.settings.voxel, std::array::from_fn(|i| g[i] - near[i] as f64));
            bound = bound.max(known - known.abs() * 1e-6 - short);
        }
        (bound - (p - q).norm()).max(far)
    }

    /// Velocities of the closest surface points for vertex velocities (metres per second) of the mesh.
    pub fn flow(&self, triangle: &[[u32; 3]], velocity: &[[f64; 3]]) -> Flow {
        let vertex = |v: u32| {
            let v = velocity[v as usize];
            if finite(&v) { Vec3::from(v) } else { Vec3::zeros() }
        };
        let at = |p: &SurfacePoint| {
            let v = p.blend(triangle[p.triangle as usize].map(vertex));
            [v.x as f32, v.y as f32, v.z as f32]
        };
        let known = |p: &SurfacePoint| if p.triangle == NONE { [0.0; 3] } else { at(p) };
        let mut value: Vec<[f32; 3]> = self.foot.par_iter().map(known).collect();
        let (corner, brick) = value.split_at_mut(self.corners());
        let cells = self.cells_with_bricks();
        brick.par_chunks_mut(SAMPLES).zip(&cells).zip(self.foot[corner.len()..].par_chunks(SAMPLES)).for_each(
            |((value, &cell), foot)| {
                for n in 0..SAMPLES {
                    if foot[n].triangle == NONE {
                        let place = self.coarse(self.cell_at(cell), split(n).map(|i| i as f64 / CELLS as f64));
                        value[n] = std::array::from_fn(|i| place.blend(|k| f64::from(corner[k][i])) as f32);
                    }
                }
            },
        );
        let fastest = (0..velocity.len() as u32).map(|v| vertex(v).norm_squared()).fold(0.0, f64::max).sqrt();
        Flow { velocity: value, fastest }
    }

    /// Velocity of the surface closest to a point; zero without a lattice.
    pub(super) fn carried(&self, flow: &Flow, p: Vec3) -> Vec3 {
        if self.cells[0] == 0 { Vec3::zeros() } else { flow.at(&self.locate(p).0) }
    }

    /// The eight samples around a point, and how far beyond the lattice it is.
    fn locate(&self, p: Vec3) -> (Place, Vec3) {
        let q = self.clamp(p);
        let (cell, f) = self.cell(q);
        let brick = self.brick[self.index(cell)];
        let place = if brick == NONE {
            self.coarse(cell, f)
        } else {
            let g = f.map(|f| f * CELLS as f64);
            let i = g.map(|g| (g as usize).min(CELLS - 1));
            Place {
                base: brick as usize + i[0] + SIDE * (i[1] + SIDE * i[2]),
                stride: [SIDE, SIDE * SIDE],
                t: std::array::from_fn(|k| g[k] - i[k] as f64),
                scale: self.per_voxel,
            }
        };
        (place, p - q)
    }

    /// Distance and its gradient.
    fn value(&self, place: &Place) -> (f64, Vec3) {
        let d = &self.distance;
        let [tx, ty, tz] = place.t;
        let row = |k: usize| (f64::from(d[k]), f64::from(d[k + 1]) - f64::from(d[k]));
        let [sy, sz] = place.stride;
        let rows = [place.base, place.base + sy, place.base + sz, place.base + sy + sz].map(row);
        let v = rows.map(|r| r.0 + tx * r.1);
        let (y0, y1) = (v[1] - v[0], v[3] - v[2]);
        let (z0, z1) = (v[0] + ty * y0, v[2] + ty * y1);
        let (x0, x1) = (rows[0].1 + ty * (rows[1].1 - rows[0].1), rows[2].1 + ty * (rows[3].1 - rows[2].1));
        let gradient = Vec3::new(x0 + tz * (x1 - x0), y0 + tz * (y1 - y0), z1 - z0) * place.scale;
        (z0 + tz * (z1 - z0), gradient)
    }

    /// Nothing but the mesh's box is known.
    fn away(&self, p: Vec3) -> Hit {
        let distance = box_distance(p, &self.mesh);
        let out = if distance.is_finite() { p - clamped(p, &self.mesh) } else { Vec3::y() };
        Hit { distance, normal: out.try_normalize(1e-12).unwrap_or_else(Vec3::y), velocity: Vec3::zeros() }
    }

    /// Direction away from the surface by the coarse lattice; up where that knows none either.
    fn coarse_normal(&self, p: Vec3) -> Vec3 {
        let (cell, f) = self.cell(self.clamp(p));
        self.value(&self.coarse(cell, f)).1.try_normalize(1e-6).unwrap_or_else(Vec3::y)
    }

    fn clamp(&self, p: Vec3) -> Vec3 {
        clamped(p, &self.domain)
    }

    /// Side of a cell, metres.
    fn cell_size(&self) -> f64 {
        CELLS as f64 * self.settings.voxel
    }

    /// Number of corners of the coarse lattice.
    fn corners(&self) -> usize {
        if self.cells[0] == 0 { 0 } else { self.cells.iter().map(|n| n + 1).product() }
    }

    /// Cell of a point of the lattice, and where in it, 0 to 1.
    fn cell(&self, q: Vec3) -> ([usize; 3], [f64; 3]) {
        let per = self.per_voxel * (1.0 / CELLS as f64);
        let u: [f64; 3] = std::array::from_fn(|i| (q[i] - self.domain.0[i]) * per);
        let b: [usize; 3] = std::array::from_fn(|i| (u[i] as u32 as usize).min(self.cells[i] - 1));
        (b, std::array::from_fn(|i| (u[i] - b[i] as u32 as f64).min(1.0)))
    }

    /// Number of a cell.
    fn index(&self, b: [usize; 3]) -> usize {
        b[0] + self.cells[0] * (b[1] + self.cells[1] * b[2])
    }

    /// Cell coordinates.
    fn cell_at(&self, cell: usize) -> [usize; 3] {
        let [x, y, _] = self.cells;
        [cell % x, cell / x % y, cell / (x * y)]
    }

    /// Place among a cell's corners.
    fn coarse(&self, b: [usize; 3], t: [f64; 3]) -> Place {
        let (sy, sz) = (self.cells[0] + 1, (self.cells[0] + 1) * (self.cells[1] + 1));
        Place { base: b[0] + sy * b[1] + sz * b[2], stride: [sy, sz], t, scale: self.per_voxel * (1.0 / CELLS as f64) }
    }

    /// Cells that have a brick, ascending, as the bricks are stored.
    fn cells_with_bricks(&self) -> Vec<usize> {
        (0..self.brick.len()).filter(|&c| self.brick[c] != NONE).collect()
    }
}

impl Flow {
    /// Trilinear velocity.
    fn at(&self, place: &Place) -> Vec3 {
        let v = &self.velocity;
        let [tx, ty, tz] = place.t;
        let [sy, sz] = place.stride;
        let row = |k: usize| {
            let (a, b) = (v[k], v[k + 1]);
            [0, 1, 2].map(|i| f64::from(a[i]) + tx * (f64::from(b[i]) - f64::from(a[i])))
        };
        let [a, b, c, d] = [place.base, place.base + sy, place.base + sz, place.base + sy + sz].map(row);
        Vec3::from(std::array::from_fn(|i| {
            let (low, high) = (a[i] + ty * (b[i] - a[i]), c[i] + ty * (d[i] - c[i]));
            low + tz * (high - low)
        }))
    }
}

impl Place {
    /// Trilinear blend of a value by sample.
    fn blend(&self, value: impl Fn(usize) -> f64) -> f64 {
        let [tx, ty, tz] = self.t;
        let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
        let row = |k: usize| mix(value(k), value(k + 1), tx);
        let layer = |k: usize| mix(row(k), row(k + self.stride[0]), ty);
        mix(layer(self.base), layer(self.base + self.stride[1]), tz)
    }
}

/// Coordinates of sample `n` in its brick.
fn split(n: usize) -> [usize; 3] {
    [n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)]
}

fn finite(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// Nearest point of a box; the point itself for an empty one.
fn clamped(p: Vec3, (low, high): &Bounds) -> Vec3 {
    Vec3::from(std::array::from_fn(|i| p[i].max(low[i]).min(high[i])))
}

/// Distance from a box, 0 inside; infinite from an empty one.
fn box_distance(p: Vec3, bounds: &Bounds) -> f64 {
    if bounds.0[0] <= bounds.1[0] { (p - clamped(p, bounds)).norm() } else { f64::INFINITY }
}

#[cfg(test)]
#[path = "field_tests.rs"]
mod tests;
