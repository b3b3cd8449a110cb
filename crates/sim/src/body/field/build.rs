//! Building fields: where exact distances are asked for, and what stands where they are not.

use super::{Bounds, CELLS, Field, NEAR, NOWHERE, SAMPLES, SIDE, finite, split};
use crate::Vec3;
use pelage_geom::{Bvh, Closest, Mesh, NONE, SurfacePoint, Topology};
use rayon::prelude::*;

/// Voxels over which exact distances go over into coarse ones beyond the band. With less than one the gradient there is
/// off by the whole error of the coarse lattice over one voxel; each more costs as many exact queries as band.
const BLEND: f64 = 2.0;

/// Every second sample along an axis of a brick is a node: these are exact in the whole band.
const NODES: usize = CELLS / 2 + 1;

/// Most cells of the coarse lattice. Voxels are made larger to keep to it: at about 1 us a corner building stays below
/// seconds, and a body scaled by a thousand doesn't fill the memory. A standing figure at 4 mm needs 30,000.
pub(super) const MOST_CELLS: f64 = 131_072.0;

/// Vertices that moved by no more, metres, are where they were: what coordinates round to.
const SAME: f64 = 1e-9;

/// Least part of the triangles that stay for whose sake a known field is asked: below, asking costs as much as it saves.
const WORTHWHILE: f64 = 0.25;

/// What is known of a sample while building: signed distance, foot, and some point of the surface.
#[derive(Clone, Copy)]
struct Node {
    distance: f64,
    foot: SurfacePoint,
    position: Vec3,
}

/// A field of the same mesh in another pose, and what of the mesh lies elsewhere now: what is closer to the rest need not be
/// sampled again.
pub struct Known<'a> {
    pub(super) field: &'a Field,
    /// Triangles that lie elsewhere, as they were and as they are.
    moved: Bvh,
    /// Cells from the lowest of the field that is built to the lowest of the known one.
    offset: [i64; 3],
}

impl<'a> Known<'a> {
    /// `field` of the triangles at the positions `before` (metres), a quarter of which at least are `now` where they were, to a
    /// nanometre; otherwise nothing, as there is little to gain.
    pub fn new(field: &'a Field, triangle: &[[u32; 3]], before: &[[f64; 3]], now: &[[f64; 3]]) -> Option<Self> {
        let same = |v: &u32| {
            let (a, b) = (before[*v as usize], now[*v as usize]);
            (0..3).all(|x| (a[x] - b[x]).abs() <= SAME)
        };
        let moved: Vec<[u32; 3]> = triangle.iter().filter(|t| !t.iter().all(same)).copied().collect();
        if (triangle.len() - moved.len()) as f64 <= WORTHWHILE * triangle.len() as f64 {
            return None;
        }
        let corners = [before, now].into_iter().flat_map(|p| moved.iter().flatten().map(|v| p[*v as usize]));
        let position: Vec<[f64; 3]> = corners.collect();
        let triangle = (0..2 * moved.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh { position, triangle, ..Mesh::default() };
        let moved = Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(&mesh));
        Some(Known { field, moved, offset: [0; 3] })
    }

    /// Where the lattices lie to each other; nothing of use if their cells are of different size.
    pub(super) fn aligned(mut self, field: &Field) -> Option<Self> {
        let size = field.cell_size();
        let cells = |i: usize| ((field.domain.0[i] - self.field.domain.0[i]) / size).round() as i64;
        self.offset = std::array::from_fn(cells);
        (self.field.settings == field.settings && self.field.cells[0] > 0).then_some(self)
    }

    /// The same place in the known lattice of `size` cells or corners.
    fn same(&self, at: [usize; 3], size: [usize; 3]) -> Option<[usize; 3]> {
        let there: [i64; 3] = std::array::from_fn(|i| at[i] as i64 + self.offset[i]);
        let within = (0..3).all(|i| 0 <= there[i] && there[i] < size[i] as i64);
        within.then(|| there.map(|i| i as usize))
    }

    /// Number of a corner of the known lattice from which nothing that moved is closer than the surface was.
    fn corner(&self, at: [usize; 3], p: Vec3) -> Option<usize> {
        let there = self.same(at, self.field.cells.map(|n| n + 1))?;
        let k = self.field.coarse(there, [0.0; 3]).base;
        let distance = f64::from(self.field.distance[k].abs());
        self.moved.closest(p, distance * (1.0 + 1e-6) + SAME).is_none().then_some(k)
    }

    /// Number of a cell of the known lattice from none of whose points anything that moved is closer than the surface was.
    fn cell(&self, at: [usize; 3], centre: Vec3) -> Option<usize> {
        let there = self.same(at, self.field.cells)?;
        let k = self.field.index(there);
        // From a point of the cell the surface is no farther than the centre's distance and the way to it, what moved no
        // nearer than its distance from the centre less that way.
        let way = 3f64.sqrt() * self.field.cell_size();
        let distance = f64::from(self.field.centre[k].abs());
        self.moved.closest(centre, (distance + way) * (1.0 + 1e-5) + SAME).is_none().then_some(k)
    }
}

impl Field {
    /// Chooses domain, voxel and cells; false if there is nothing to sample.
    pub(super) fn lay_lattice(&mut self, region: Option<Bounds>) -> bool {
        let (mut low, mut high) = self.mesh;
        if low[0] > high[0] {
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
            if low[i].partial_cmp(&high[i]) != Some(std::cmp::Ordering::Less) {
                return false;
            }
        }
        // Cells lie as if the lattice filled space: what a part of a mesh gives does not depend on where the rest of it ends, or
        // the region.
        let first = |i: usize, voxel: f64| (low[i] / (CELLS as f64 * voxel)).floor();
        let count = |i: usize, voxel: f64| ((high[i] / (CELLS as f64 * voxel)).ceil() - first(i, voxel)).max(1.0);
        self.settings.voxel = voxel;
        while (0..3).map(|i| count(i, self.settings.voxel)).product::<f64>() > MOST_CELLS {
            self.settings.voxel *= 1.25;
        }
        let voxel = self.settings.voxel;
        self.cells = std::array::from_fn(|i| count(i, voxel) as usize);
        self.per_voxel = 1.0 / voxel;
        let low = std::array::from_fn(|i| first(i, voxel) * self.cell_size());
        self.domain = (low, std::array::from_fn(|i| low[i] + self.cells[i] as f64 * self.cell_size()));
        true
    }

    /// Exact distances at the coarse corners.
    pub(super) fn sample_corners(&mut self, bvh: &Bvh, known: Option<&Known<'_>>) {
        let [nx, ny, _] = self.cells.map(|n| n + 1);
        let size = self.cell_size();
        let rows: Vec<usize> = (0..self.corners() / nx).collect();
        let low = self.domain.0;
        let sampled: Vec<Vec<(f32, SurfacePoint, [f32; 3])>> = rows
            .par_iter()
            .map(|&row| {
                let mut limit = f64::INFINITY;
                let corner =
                    |i: usize| Vec3::from(low) + Vec3::new(i as f64, (row % ny) as f64, (row / ny) as f64) * size;
                let at = |i: usize| {
                    let same = known.and_then(|k| Some((k.field, k.corner([i, row % ny, row / ny], corner(i))?)));
                    let found = match same {
                        Some((f, k)) => (f.distance[k], f.foot[k], f.corner_foot[k]),
                        None => {
                            let c = query(bvh, corner(i), limit);
                            (
                                c.signed_distance as f32,
                                c.point,
                                [c.position.x, c.position.y, c.position.z].map(|x| x as f32),
                            )
                        }
                    };
                    // Feet are rounded: a search that finds nothing within the limit is done again without.
                    limit = (corner(i + 1) - Vec3::from(found.2.map(f64::from))).norm();
                    found
                };
                (0..nx).map(at).collect()
            })
            .collect();
        for (distance, foot, position) in sampled.into_iter().flatten() {
            self.distance.push(distance);
            self.foot.push(foot);
            self.corner_foot.push(position);
        }
    }

    /// Distances at the cells' centres; returns the cells that need a brick: all others lie outside the band and the
    /// blend with all their points, on one side of the surface. With each comes its number in the known field, if it is the same
    /// there.
    pub(super) fn sample_centres(&mut self, bvh: &Bvh, known: Option<&Known<'_>>) -> Vec<(usize, Option<usize>)> {
        let size = self.cell_size();
        let radius = 0.5 * 3f64.sqrt() * size;
        let needs = |d: f64| d.abs() <= radius + self.width(d) + BLEND * self.settings.voxel;
        let centres: Vec<(f32, bool, Option<usize>)> = (0..self.cells.iter().product())
            .into_par_iter()
            .map(|cell: usize| {
                let centre = self.corner_of(cell) + Vec3::repeat(0.5 * size);
                if let Some((k, same)) = known.and_then(|k| Some((k, k.cell(self.cell_at(cell), centre)?))) {
                    return (k.field.centre[same], k.field.brick[same] != NONE, Some(same));
                }
                let foot = self.corner_foot[self.coarse(self.cell_at(cell), [0.0; 3]).base].map(f64::from);
                let d = query(bvh, centre, (centre - Vec3::from(foot)).norm() * (1.0 + 1e-6)).signed_distance;
                ((d - d.abs() * 1e-6) as f32, needs(d), None)
            })
            .collect();
        self.centre = centres.iter().map(|c| c.0).collect();
        centres.iter().enumerate().filter(|(_, c)| c.1).map(|(cell, c)| (cell, c.2)).collect()
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
    pub(super) fn sample_bricks(&mut self, bvh: &Bvh, active: &[(usize, Option<usize>)], known: Option<&Field>) {
        self.brick = vec![NONE; self.centre.len()];
        for (k, &(cell, _)) in active.iter().enumerate() {
            self.brick[cell] = (self.corners() + k * SAMPLES) as u32;
        }
        let one = |&(cell, same): &(usize, Option<usize>)| {
            let same = known.zip(same).filter(|(k, there)| self.joins_alike(cell, k, *there));
            same.map_or_else(|| self.sample_brick(bvh, cell), |(k, there)| k.brick_at(there))
        };
        let bricks: Vec<_> = active.par_iter().map(one).collect();
        for (distance, foot) in bricks {
            self.distance.extend(distance);
            self.foot.extend(foot);
        }
    }

    /// Samples of a brick as they are.
    fn brick_at(&self, cell: usize) -> ([f32; SAMPLES], [SurfacePoint; SAMPLES]) {
        let at = self.brick[cell] as usize..self.brick[cell] as usize + SAMPLES;
        let whole = "a brick of all its samples";
        (self.distance[at.clone()].try_into().expect(whole), self.foot[at].try_into().expect(whole))
    }

    /// True if a cell owns the same samples as one of another field and cells before both have bricks where the other's have.
    fn joins_alike(&self, cell: usize, other: &Field, there: usize) -> bool {
        let (b, c) = (self.cell_at(cell), other.cell_at(there));
        let before = |f: &Field, at: [usize; 3], set: usize| {
            let back: [usize; 3] = std::array::from_fn(|a| set >> a & 1);
            let within = (0..3).all(|a| at[a] >= back[a]);
            within.then(|| f.brick[f.index(std::array::from_fn(|a| at[a] - back[a]))] != NONE)
        };
        self.owned(cell) == other.owned(there) && (1..8).all(|set| before(self, b, set) == before(other, c, set))
    }

    /// Samples what a brick owns: every second sample along each axis first, then what lies between.
    fn sample_brick(&self, bvh: &Bvh, cell: usize) -> ([f32; SAMPLES], [SurfacePoint; SAMPLES]) {
        let (mut distance, mut foot) = ([0.0; SAMPLES], [NOWHERE; SAMPLES]);
        let (b, own) = (self.cell_at(cell), self.owned(cell));
        let known = self.sample_nodes(bvh, cell);
        let mut last = Vec3::zeros();
        for step in 0..own.iter().product() {
            let i = to_and_fro(step, own);
            let n = i[0] + SIDE * (i[1] + SIDE * i[2]);
            let place = self.coarse(b, i.map(|i| i as f64 / CELLS as f64));
            let coarse = place.blend(|k| f64::from(self.distance[k]));
            if self.beside_none(b, i) {
                distance[n] = coarse as f32;
                continue;
            }
            let p = self.corner_of(cell) + Vec3::from(i.map(|i| i as f64)) * self.settings.voxel;
            let Node { distance: d, foot: point, .. } = self.between(&known, i).unwrap_or_else(|first| {
                let reach = (p - last).norm_squared().min((p - first).norm_squared()).sqrt();
                let found = query(bvh, p, reach * (1.0 + 1e-6));
                last = found.position;
                Node { distance: found.signed_distance, foot: found.point, position: found.position }
            });
            let t = ((d.abs() - self.width(d)) / (BLEND * self.settings.voxel)).clamp(0.0, 1.0);
            let clear = |x: f64| d.signum() * (x * d.signum()).max(self.width(d));
            distance[n] = if t > 0.0 { clear(d + t * (coarse - d)) } else { d } as f32;
            foot[n] = if t < 1.0 { point } else { NOWHERE };
        }
        (distance, foot)
    }

    /// Walks through the nodes of a brick, to and fro, and asks for distances where the last one leaves open whether the
    /// node lies in the band; the last one also limits the search.
    fn sample_nodes(&self, bvh: &Bvh, cell: usize) -> [Node; NODES * NODES * NODES] {
        let (corner, step) = (self.corner_of(cell), 2.0 * self.settings.voxel);
        let mut sign = f64::from(self.centre[cell]).signum();
        // At least this far from the surface, and a point of that.
        let mut least = f64::from(self.centre[cell]).abs() * (1.0 - 1e-5) - 0.5 * 3f64.sqrt() * self.cell_size();
        let first = self.coarse(self.cell_at(cell), [0.0; 3]).base;
        let mut last = Vec3::from(self.corner_foot[first].map(f64::from));
        let mut nodes = [Node { distance: 0.0, foot: NOWHERE, position: last }; NODES * NODES * NODES];
        for k in 0..nodes.len() {
            let i = to_and_fro(k, [NODES; 3]);
            let p = corner + Vec3::from(i.map(|i| i as f64)) * step;
            let far = self.width(sign) + BLEND * self.settings.voxel;
            let node = &mut nodes[i[0] + NODES * (i[1] + NODES * i[2])];
            if least > far {
                (node.distance, node.position) = (sign * least, last);
            } else {
                let found = query(bvh, p, (p - last).norm() * (1.0 + 1e-6));
                *node = Node { distance: found.signed_distance, foot: found.point, position: found.position };
                (sign, least, last) = (node.distance.signum(), node.distance.abs(), found.position);
            }
            least -= step;
        }
        nodes
    }

    /// A sample as the mean of the nodes around it, if that surely leaves it [`NEAR`] from the surface or it is a node;
    /// otherwise a point of the surface.
    fn between(&self, known: &[Node], i: [usize; 3]) -> Result<Node, Vec3> {
        // The nodes below and above along each axis; no node is above the last.
        let low = i.map(|i| (i / 2).min(NODES - 1));
        let high: [usize; 3] = std::array::from_fn(|a| if i[a] == 2 * low[a] { low[a] } else { low[a] + 1 });
        let at = |x: usize, y: usize, z: usize| &known[x + NODES * (y + NODES * z)];
        let base = at(low[0], low[1], low[2]);
        if low == high {
            return Ok(*base);
        }
        let above = high.contains(&NODES);
        let off = self.settings.voxel * ((0..3).filter(|&a| low[a] != high[a]).count() as f64).sqrt();
        if above || base.distance.abs() - off <= NEAR * self.settings.voxel {
            return Err(base.position);
        }
        let corner: [&Node; 8] = std::array::from_fn(|k| {
            let pick = |a: usize| if k >> a & 1 == 0 { low[a] } else { high[a] };
            at(pick(0), pick(1), pick(2))
        });
        let distance = corner.iter().map(|c| c.distance).sum::<f64>() / 8.0;
        Ok(Node { distance, ..*base })
    }

    /// True for a sample on a face, edge or corner of its brick where a cell without a brick touches it (of the cells
    /// before it; the others are its owner's).
    fn beside_none(&self, b: [usize; 3], i: [usize; 3]) -> bool {
        let low: [bool; 3] = std::array::from_fn(|a| i[a] == 0 && b[a] > 0);
        (1..8).any(|set| {
            let back: [usize; 3] = std::array::from_fn(|a| set >> a & 1);
            (0..3).all(|a| back[a] == 0 || low[a])
                && self.brick[self.index([0, 1, 2].map(|a| b[a] - back[a] * usize::from(low[a])))] == NONE
        })
    }

    /// Samples that a brick owns along each axis: all but the last, unless no cell follows.
    fn owned(&self, cell: usize) -> [usize; 3] {
        let b = self.cell_at(cell);
        std::array::from_fn(|i| if b[i] + 1 == self.cells[i] { SIDE } else { CELLS })
    }

    /// Fills the faces that the next cells own: from their bricks, or from the coarse corners where they have none.
    pub(super) fn join_bricks(&mut self, active: &[(usize, Option<usize>)]) {
        let faces: Vec<Vec<(u32, f32, SurfacePoint)>> = active
            .par_iter()
            .map(|&(cell, _)| {
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
                        (n as u32, d as f32, NOWHERE)
                    } else {
                        let at = brick as usize + local[0] + SIDE * (local[1] + SIDE * local[2]);
                        (n as u32, self.distance[at], self.foot[at])
                    });
                }
                face
            })
            .collect();
        for (&(cell, _), face) in active.iter().zip(faces) {
            let base = self.brick[cell] as usize;
            for (n, d, foot) in face {
                self.distance[base + n as usize] = d;
                self.foot[base + n as usize] = foot;
            }
        }
    }
}

/// Step `n` of a walk through a block of `size` samples in which each is beside the one before.
fn to_and_fro(n: usize, size: [usize; 3]) -> [usize; 3] {
    let (row, k) = (n / size[0], n / (size[0] * size[1]));
    let back = |i: usize, size: usize, turn: usize| if turn.is_multiple_of(2) { i } else { size - 1 - i };
    [back(n % size[0], size[0], row), back(row % size[1], size[1], k), k]
}

/// Closest point; `limit`: an upper bound of the distance but for rounding.
fn query(bvh: &Bvh, p: Vec3, limit: f64) -> Closest {
    let found = bvh.closest(p, limit * (1.0 + 1e-9) + 1e-12).or_else(|| bvh.closest(p, f64::INFINITY));
    found.unwrap_or(Closest { point: NOWHERE, position: p, signed_distance: f64::MAX, normal: Vec3::y() })
}

/// Box of the triangles that are finite; infinite and empty (low above high) without any.
pub fn mesh_bounds(position: &[[f64; 3]], triangle: &[[u32; 3]]) -> Bounds {
    let corner = |t: &[u32; 3]| t.map(|v| position[v as usize]);
    let mut bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for c in triangle.iter().map(corner).filter(|c| c.iter().all(finite)) {
        for p in c {
            bounds.0 = std::array::from_fn(|i| bounds.0[i].min(p[i]));
            bounds.1 = std::array::from_fn(|i| bounds.1[i].max(p[i]));
        }
    }
    bounds
}
