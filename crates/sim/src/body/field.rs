//! Signed distance fields of triangle meshes (Selle, Lentine, Fedkiw 2008, §5.1: negative inside, positive outside).
//!
//! A dense lattice of coarse corners covers the mesh and its band; where the surface is near, a cell of that lattice is
//! a brick of 8 x 8 x 8 fine samples. Fine samples hold the exact distance inside the band and go over into the trilinear
//! interpolation of the coarse corners beyond it, so that the field is continuous where bricks end: on a face towards a
//! cell without a brick both sides are the same bilinear function.

use super::Hit;
use crate::Vec3;
use pelage_geom::{Bvh, Closest, NONE, SurfacePoint, Topology};
use rayon::prelude::*;

/// Samples along a brick's side. With 4 a brick is mostly border, which neighbours store again; with 16 most samples of
/// a brick lie outside the band.
const SIDE: usize = 8;
const CELLS: usize = SIDE - 1;
const SAMPLES: usize = SIDE * SIDE * SIDE;

/// Voxels over which exact distances go over into coarse ones beyond the band. With less than one the gradient there is
/// off by the whole error of the coarse lattice over one voxel; each more costs as many exact queries as band.
const BLEND: f64 = 2.0;

/// Most cells of the coarse lattice. Voxels are made larger to keep to it: at about 1 us a corner building stays below
/// seconds, and a body scaled by a thousand doesn't fill the memory. A standing figure at 4 mm needs 30,000.
const MOST_CELLS: f64 = 131_072.0;

/// How finely and how far from the surface a field is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSettings {
    /// Distance between samples, metres; above 0.
    pub voxel: f64,
    /// Distance outside the surface up to which samples are exact, metres.
    pub outside: f64,
    /// Distance inside the surface up to which samples are exact, metres.
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
pub(super) struct Place {
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
    pub fn build(
        position: &[[f64; 3]],
        triangle: &[[u32; 3]],
        topology: &Topology,
        bvh: &Bvh,
        settings: &FieldSettings,
        region: Option<Bounds>,
    ) -> Self {
        let mut field = Field {
            open_edges: topology.counts.open_edges,
            not_finite: position.iter().filter(|p| !finite(p)).count(),
            settings: *settings,
            mesh: mesh_bounds(position, triangle),
            ..Field::default()
        };
        if !field.lay_lattice(region) {
            return field;
        }
        field.sample_corners(bvh);
        let active = field.sample_centres(bvh);
        field.sample_bricks(bvh, &active);
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
            // Samples outside the band hold at least its width.
            let known = f64::from(self.distance[at]).min(self.settings.outside);
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

    /// The eight samples around a point, and how far beyond the lattice it is.
    pub(super) fn locate(&self, p: Vec3) -> (Place, Vec3) {
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
    pub(super) fn value(&self, place: &Place) -> (f64, Vec3) {
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
    pub(super) fn at(&self, place: &Place) -> Vec3 {
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

// Building.
impl Field {
    /// Chooses domain, voxel and cells; false if there is nothing to sample.
    fn lay_lattice(&mut self, region: Option<Bounds>) -> bool {
        let (mut low, mut high) = self.mesh;
        if !(low[0] <= high[0]) {
            return false;
        }
        let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        // A point has no size of its own to choose voxels by.
        let smallest = if longest > 0.0 { longest * 1e-4 } else { 1e-6 };
        let voxel = if self.settings.voxel.is_finite() { self.settings.voxel.max(smallest) } else { smallest };
        let margin = self.settings.outside.max(0.0) + BLEND * voxel;
        for i in 0..3 {
            low[i] -= margin;
            high[i] += margin;
            if let Some((from, to)) = region {
                low[i] = low[i].max(from[i] - voxel);
                high[i] = high[i].min(to[i] + voxel);
            }
            if !(low[i] < high[i]) {
                return false;
            }
        }
        let cells = |voxel: f64| [0, 1, 2].map(|i| ((high[i] - low[i]) / (CELLS as f64 * voxel)).ceil().max(1.0));
        self.settings.voxel = voxel;
        while cells(self.settings.voxel).iter().product::<f64>() > MOST_CELLS {
            self.settings.voxel *= 1.25;
        }
        self.cells = cells(self.settings.voxel).map(|n| n as usize);
        self.per_voxel = 1.0 / self.settings.voxel;
        self.domain = (low, std::array::from_fn(|i| low[i] + self.cells[i] as f64 * self.cell_size()));
        true
    }

    /// Exact distances at the coarse corners.
    fn sample_corners(&mut self, bvh: &Bvh) {
        let [nx, ny, _] = self.cells.map(|n| n + 1);
        let size = self.cell_size();
        let rows: Vec<usize> = (0..self.corners() / nx).collect();
        let low = self.domain.0;
        let sampled: Vec<Vec<Closest>> = rows
            .par_iter()
            .map(|&row| {
                let mut limit = f64::INFINITY;
                let corner =
                    |i: usize| Vec3::from(low) + Vec3::new(i as f64, (row % ny) as f64, (row / ny) as f64) * size;
                let at = |i: usize| {
                    let found = query(bvh, corner(i), limit);
                    limit = (corner(i + 1) - found.position).norm();
                    found
                };
                (0..nx).map(at).collect()
            })
            .collect();
        for c in sampled.into_iter().flatten() {
            self.distance.push(c.signed_distance as f32);
            self.foot.push(c.point);
            self.corner_foot.push([c.position.x as f32, c.position.y as f32, c.position.z as f32]);
        }
    }

    /// Distances at the cells' centres; returns the cells that need a brick: all others lie outside the band and the
    /// blend with all their points, on one side of the surface.
    fn sample_centres(&mut self, bvh: &Bvh) -> Vec<usize> {
        let size = self.cell_size();
        let radius = 0.5 * 3f64.sqrt() * size;
        let centres: Vec<f64> = (0..self.cells.iter().product())
            .into_par_iter()
            .map(|cell: usize| {
                let centre = self.corner_of(cell) + Vec3::repeat(0.5 * size);
                let foot = self.corner_foot[self.coarse(self.cell_at(cell), [0.0; 3]).base].map(f64::from);
                query(bvh, centre, (centre - Vec3::from(foot)).norm() * (1.0 + 1e-6)).signed_distance
            })
            .collect();
        self.centre = centres.iter().map(|&d| (d - d.abs() * 1e-6) as f32).collect();
        let needs = |d: f64| d.abs() <= radius + self.width(d) + BLEND * self.settings.voxel;
        (0..centres.len()).filter(|&cell| needs(centres[cell])).collect()
    }

    /// Lowest corner of a cell.
    fn corner_of(&self, cell: usize) -> Vec3 {
        Vec3::from(self.domain.0) + Vec3::from(self.cell_at(cell).map(|i| i as f64)) * self.cell_size()
    }

    /// The band on the side of a distance, metres.
    fn width(&self, d: f64) -> f64 {
        if d < 0.0 { self.settings.inside } else { self.settings.outside }
    }

    /// Fills the bricks of the `active` cells with what each owns: samples but those on faces that the next cell owns.
    fn sample_bricks(&mut self, bvh: &Bvh, active: &[usize]) {
        self.brick = vec![NONE; self.centre.len()];
        for (k, &cell) in active.iter().enumerate() {
            self.brick[cell] = (self.corners() + k * SAMPLES) as u32;
        }
        let bricks: Vec<_> = active.par_iter().map(|&cell| self.sample_brick(bvh, cell)).collect();
        for (distance, foot) in bricks {
            self.distance.extend(distance);
            self.foot.extend(foot);
        }
    }

    /// Walks through a brick, to and fro, and asks for exact distances where the last one leaves open whether the sample
    /// lies in the band; the last one also limits the search.
    fn sample_brick(&self, bvh: &Bvh, cell: usize) -> ([f32; SAMPLES], [SurfacePoint; SAMPLES]) {
        let nowhere = SurfacePoint { triangle: NONE, bary: [0.0; 2] };
        let (mut distance, mut foot) = ([0.0; SAMPLES], [nowhere; SAMPLES]);
        let (corner, voxel, at) = (self.corner_of(cell), self.settings.voxel, self.cell_at(cell));
        let own = self.owned(cell);
        let mut sign = f64::from(self.centre[cell]);
        // At least this far from the surface, and a point of that.
        let mut least = sign.abs() * (1.0 - 1e-5) - 0.5 * 3f64.sqrt() * self.cell_size();
        let mut last = Vec3::from(self.corner_foot[self.coarse(at, [0.0; 3]).base].map(f64::from));
        for step in 0..own.iter().product() {
            let [i, j, k] = to_and_fro(step, own);
            let n = i + SIDE * (j + SIDE * k);
            let coarse = self.coarse(at, [i, j, k].map(|i| i as f64 / CELLS as f64));
            let coarse = coarse.blend(|k| f64::from(self.distance[k]));
            let (band, blend) = (self.width(sign), BLEND * voxel);
            let clear = |d: f64| sign.signum() * (d * sign.signum()).max(self.width(sign));
            if least > band + blend {
                distance[n] = clear(coarse) as f32;
            } else {
                let p = corner + Vec3::new(i as f64, j as f64, k as f64) * voxel;
                let found = query(bvh, p, (p - last).norm() * (1.0 + 1e-6));
                let d = found.signed_distance;
                (sign, least, last, foot[n]) = (d, d.abs(), found.position, found.point);
                let t = ((d.abs() - self.width(d)) / blend).clamp(0.0, 1.0);
                let clear = |x: f64| d.signum() * (x * d.signum()).max(self.width(d));
                distance[n] = if t > 0.0 { clear(d + t * (coarse - d)) } else { d } as f32;
                if t == 1.0 {
                    foot[n] = nowhere;
                }
            }
            least -= voxel;
        }
        (distance, foot)
    }

    /// Samples that a brick owns along each axis: all but the last, unless no cell follows.
    fn owned(&self, cell: usize) -> [usize; 3] {
        let b = self.cell_at(cell);
        std::array::from_fn(|i| if b[i] + 1 == self.cells[i] { SIDE } else { CELLS })
    }

    /// Fills the faces that the next cells own: from their bricks, or from the coarse corners where they have none.
    fn join_bricks(&mut self, active: &[usize]) {
        let faces: Vec<Vec<(u32, f32, SurfacePoint)>> = active
            .par_iter()
            .map(|&cell| {
                let (b, own) = (self.cell_at(cell), self.owned(cell));
                let mut face = Vec::new();
                for n in 0..SAMPLES {
                    let i = split(n);
                    if (0..3).all(|a| i[a] < own[a]) {
                        continue;
                    }
                    let next: [usize; 3] = std::array::from_fn(|a| b[a] + usize::from(i[a] >= own[a]));
                    let local: [usize; 3] = std::array::from_fn(|a| if i[a] >= own[a] { 0 } else { i[a] });
                    let brick = self.brick[self.index(next)];
                    face.push(if brick == NONE {
                        let place = self.coarse(b, i.map(|i| i as f64 / CELLS as f64));
                        let d = place.blend(|k| f64::from(self.distance[k]));
                        (n as u32, d as f32, SurfacePoint { triangle: NONE, bary: [0.0; 2] })
                    } else {
                        let at = brick as usize + local[0] + SIDE * (local[1] + SIDE * local[2]);
                        (n as u32, self.distance[at], self.foot[at])
                    });
                }
                face
            })
            .collect();
        for (&cell, face) in active.iter().zip(faces) {
            let base = self.brick[cell] as usize;
            for (n, d, foot) in face {
                self.distance[base + n as usize] = d;
                self.foot[base + n as usize] = foot;
            }
        }
    }
}

/// Coordinates of sample `n` in its brick.
fn split(n: usize) -> [usize; 3] {
    [n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)]
}

/// Step `n` of a walk through a block of `size` samples in which each is beside the one before.
fn to_and_fro(n: usize, size: [usize; 3]) -> [usize; 3] {
    let (row, k) = (n / size[0], n / (size[0] * size[1]));
    let back = |i: usize, size: usize, turn: usize| if turn % 2 == 0 { i } else { size - 1 - i };
    [back(n % size[0], size[0], row), back(row % size[1], size[1], k), k]
}

/// Closest point; `limit`: an upper bound of the distance but for rounding.
fn query(bvh: &Bvh, p: Vec3, limit: f64) -> Closest {
    let found = bvh.closest(p, limit * (1.0 + 1e-9) + 1e-12).or_else(|| bvh.closest(p, f64::INFINITY));
    let point = SurfacePoint { triangle: NONE, bary: [0.0; 2] };
    found.unwrap_or(Closest { point, position: p, signed_distance: f64::MAX, normal: Vec3::y() })
}

fn finite(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// Box of the triangles that are finite; infinite and empty (low above high) without any.
fn mesh_bounds(position: &[[f64; 3]], triangle: &[[u32; 3]]) -> Bounds {
    let corner = |t: &[u32; 3]| t.map(|v| position[v as usize]);
    let mut bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for c in triangle.iter().map(corner).filter(|c| c.iter().all(finite)) {
        for p in c {
            for i in 0..3 {
                bounds.0[i] = bounds.0[i].min(p[i]);
                bounds.1[i] = bounds.1[i].max(p[i]);
            }
        }
    }
    bounds
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
