//! From a field to a quad mesh: surface nets (S. Gibson 1998, "Constrained elastic surface nets") on a grid that is finer
//! around one point, then relaxation along the surface.

use crate::{NONE, Vec3};
use rayon::prelude::*;

/// A grid whose cells grow with the distance from a centre: size `cell` up to distance `inner`, then `cell` plus `growth`
/// times the distance beyond. The centre should have x = 0: a column of cells then straddles the plane x = 0 and has its
/// vertices exactly there.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Where cells are finest.
    pub centre: Vec3,
    /// Radius of constant cell size, scene units.
    pub inner: f64,
    /// Finest cell size, scene units.
    pub cell: f64,
    /// Growth of the cell size per unit of distance; above 0.
    pub growth: f64,
    /// Corners of the box to cover.
    pub bounds: [Vec3; 2],
}

/// Quads and their vertices.
#[derive(Clone, Debug, Default)]
pub struct QuadMesh {
    /// Vertices, scene units.
    pub position: Vec<Vec3>,
    /// Quads, counter-clockwise seen from outside.
    pub quad: Vec<[u32; 4]>,
}

impl Grid {
    /// Grid coordinates (cells) to space.
    fn space(&self, q: Vec3) -> Vec3 {
        let (rho, edge) = (q.norm(), self.inner / self.cell);
        if rho <= edge {
            return self.centre + q * self.cell;
        }
        let r = self.inner + self.cell * libm::expm1(self.growth * (rho - edge)) / self.growth;
        self.centre + q * (r / rho)
    }

    /// Space to grid coordinates.
    fn cells(&self, p: Vec3) -> Vec3 {
        let d = p - self.centre;
        let r = d.norm();
        if r <= self.inner {
            return d / self.cell;
        }
        let rho = self.inner / self.cell + libm::log1p(self.growth * (r - self.inner) / self.cell) / self.growth;
        d * (rho / r)
    }

    /// Node range: (lowest node, number of nodes per axis). Nodes lie at integer + 1/2.
    fn nodes(&self) -> ([i64; 3], [usize; 3]) {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        const N: usize = 9;
        for c in 0..N * N * N {
            let t = [c % N, c / N % N, c / N / N].map(|i| i as f64 / (N - 1) as f64);
            let p = Vec3::from_fn(|i, _| self.bounds[0][i] + (self.bounds[1][i] - self.bounds[0][i]) * t[i]);
            let q = self.cells(p);
            for i in 0..3 {
                lo[i] = lo[i].min(q[i]);
                hi[i] = hi[i].max(q[i]);
            }
        }
        let low = lo.map(|x| x.floor() as i64 - 2);
        // Blocks of four nodes.
        (low, std::array::from_fn(|i| (hi[i].ceil() as i64 + 2 - low[i]) as usize / 4 * 4 + 4))
    }
}

/// Field values at the nodes; far from the surface only their sign is right. A block of 4 x 4 x 4 nodes is skipped where
/// the field at its centre exceeds twice its radius: fields here are close to distances, so 1 would nearly do.
fn sample(grid: &Grid, field: &(dyn Fn(Vec3) -> f64 + Sync), low: [i64; 3], n: [usize; 3]) -> Vec<f64> {
    let node = |i: usize, j: usize, k: usize| {
        let q = [i, j, k];
        grid.space(Vec3::from_fn(|a, _| (low[a] + q[a] as i64) as f64 + 0.5))
    };
    let mut value = vec![0.0; n[0] * n[1] * n[2]];
    value.par_chunks_mut(n[0] * n[1] * 4).enumerate().for_each(|(block_k, slab)| {
        for block in 0..n[0] / 4 * (n[1] / 4) {
            let first = [block % (n[0] / 4) * 4, block / (n[0] / 4) * 4, block_k * 4];
            let (a, b) = (node(first[0], first[1], first[2]), node(first[0] + 3, first[1] + 3, first[2] + 3));
            let centre = (a + b) * 0.5;
            let far = field(centre);
            let skip = far.abs() > 2.0 * (b - a).norm();
            for k in 0..4 {
                for j in 0..4 {
                    for i in 0..4 {
                        let at = (k * n[1] + first[1] + j) * n[0] + first[0] + i;
                        slab[at] = if skip { far } else { field(node(first[0] + i, first[1] + j, first[2] + k)) };
                    }
                }
            }
        }
    });
    value
}

/// Quad mesh of the zero set of `field`, one vertex per cell that the surface crosses.
pub fn polygonise(grid: &Grid, field: &(dyn Fn(Vec3) -> f64 + Sync)) -> QuadMesh {
    let (low, n) = grid.nodes();
    let value = sample(grid, field, low, n);
    let (position, cell_vertex) = vertices(grid, &value, low, n);
    QuadMesh { position, quad: quads(&value, &cell_vertex, n) }
}

/// Grid coordinates of entry `at` of an array of `n` entries per axis, x fastest.
fn coordinates(at: usize, n: [usize; 3]) -> [usize; 3] {
    [at % n[0], at / n[0] % n[1], at / n[0] / n[1]]
}

/// One vertex per crossed cell, at the mean of the crossings of its edges: positions, and the vertex of each cell (named
/// by its lowest node).
fn vertices(grid: &Grid, value: &[f64], low: [i64; 3], n: [usize; 3]) -> (Vec<Vec3>, Vec<u32>) {
    let index = |c: [usize; 3]| (c[2] * n[1] + c[1]) * n[0] + c[0];
    let node = |c: [usize; 3]| grid.space(Vec3::from_fn(|a, _| (low[a] + c[a] as i64) as f64 + 0.5));
    let (mut position, mut cell_vertex) = (Vec::new(), vec![NONE; value.len()]);
    for (at, vertex) in cell_vertex.iter_mut().enumerate() {
        let c = coordinates(at, n);
        if (0..3).any(|a| c[a] + 1 >= n[a]) {
            continue;
        }
        let corner = |m: usize| std::array::from_fn(|a| c[a] + (m >> a & 1));
        let inside = |m: usize| value[index(corner(m))] < 0.0;
        if (1..8).all(|m| inside(m) == inside(0)) {
            continue;
        }
        let (mut sum, mut count) = (Vec3::zeros(), 0.0);
        for m in 0..8 {
            for axis in (0..3).filter(|a| m >> a & 1 == 0) {
                let (p, q) = (corner(m), corner(m | 1 << axis));
                let (a, b) = (value[index(p)], value[index(q)]);
                if (a < 0.0) != (b < 0.0) {
                    sum += node(p) + (node(q) - node(p)) * (a / (a - b));
                    count += 1.0;
                }
            }
        }
        *vertex = position.len() as u32;
        let mut p = sum / count;
        if low[0] + c[0] as i64 == -1 {
            p.x = 0.0;
        }
        position.push(p);
    }
    (position, cell_vertex)
}

/// One quad per grid edge that the surface crosses, around the edge's four cells.
fn quads(value: &[f64], cell_vertex: &[u32], n: [usize; 3]) -> Vec<[u32; 4]> {
    let stride = [1, n[0], n[0] * n[1]];
    let mut quad = Vec::new();
    for at in 0..value.len() {
        let c = coordinates(at, n);
        for axis in 0..3 {
            let (u, w) = ((axis + 1) % 3, (axis + 2) % 3);
            if c[axis] + 1 >= n[axis] || c[u] == 0 || c[w] == 0 {
                continue;
            }
            let (a, b) = (value[at] < 0.0, value[at + stride[axis]] < 0.0);
            if a != b {
                let mut ring = [at - stride[u] - stride[w], at - stride[w], at, at - stride[u]];
                if b {
                    ring.reverse();
                }
                quad.push(ring.map(|k| cell_vertex[k]));
            }
        }
    }
    quad
}

/// Gradient and value of a field by four samples on a tetrahedron of half-size `h`.
pub fn gradient(field: &(dyn Fn(Vec3) -> f64 + Sync), p: Vec3, h: f64) -> (f64, Vec3) {
    let corner = [[1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, 1.0, 1.0]].map(Vec3::from);
    let f = corner.map(|c| field(p + c * h));
    let g = corner[0] * f[0] + corner[1] * f[1] + corner[2] * f[2] + corner[3] * f[3];
    ((f[0] + f[1] + f[2] + f[3]) * 0.25, g / (4.0 * h))
}

/// Evens out a mesh without leaving the surface: `rounds` times, each vertex goes half-way to the mean of its neighbours
/// along the tangent plane and then back onto the zero set by one Newton step. Vertices with x = 0 stay in that plane.
pub fn relax(mesh: &mut QuadMesh, field: &(dyn Fn(Vec3) -> f64 + Sync), rounds: usize) {
    let mut link: Vec<Vec<u32>> = vec![Vec::new(); mesh.position.len()];
    for q in &mesh.quad {
        for i in 0..4 {
            let (a, b) = (q[i], q[(i + 1) % 4]);
            for (a, b) in [(a, b), (b, a)] {
                if !link[a as usize].contains(&b) {
                    link[a as usize].push(b);
                }
            }
        }
    }
    for round in 0..=rounds {
        let old = &mesh.position;
        mesh.position = (0..old.len())
            .into_par_iter()
            .map(|i| {
                let p = old[i];
                let (f, g) = gradient(field, p, 1e-3);
                let square = g.norm_squared().max(0.04);
                let mean = link[i].iter().fold(Vec3::zeros(), |s, &j| s + old[j as usize]) / link[i].len() as f64;
                let mut shift = (mean - p) * if round == rounds { 0.0 } else { 0.5 };
                shift -= g * (shift.dot(&g) / square);
                let mut q = p + shift - g * (f / square);
                if p.x == 0.0 {
                    q.x = 0.0;
                }
                q
            })
            .collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::field::ball;

    #[test]
    fn a_ball_comes_out_closed_round_and_outward() {
        let grid = Grid {
            centre: Vec3::zeros(),
            inner: 1.0,
            cell: 0.2,
            growth: 0.1,
            bounds: [Vec3::repeat(-2.0), Vec3::repeat(2.0)],
        };
        let field = |p: Vec3| ball(p, Vec3::new(0.0, 0.1, 0.0), 1.5);
        let mut mesh = polygonise(&grid, &field);
        relax(&mut mesh, &field, 6);
        let edges = mesh.quad.len() * 2;
        assert_eq!(mesh.position.len() as i64 - edges as i64 + mesh.quad.len() as i64, 2);
        assert!(mesh.position.iter().all(|&p| field(p).abs() < 1e-3));
        for q in &mesh.quad {
            let c = q.map(|i| mesh.position[i as usize]);
            let n = (c[2] - c[0]).cross(&(c[3] - c[1]));
            assert!(n.dot(&(c[0] + c[1] + c[2] + c[3])) > 0.0);
        }
        assert!(mesh.position.iter().filter(|p| p.x == 0.0).count() > 20);
    }

    #[test]
    fn grid_coordinates_go_there_and_back() {
        let grid = Grid {
            centre: Vec3::new(0.0, 3.0, 1.0),
            inner: 4.0,
            cell: 0.4,
            growth: 0.05,
            bounds: [Vec3::repeat(-9.0), Vec3::repeat(9.0)],
        };
        for p in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(8.0, -7.0, 5.0)] {
            assert!((grid.space(grid.cells(p)) - p).norm() < 1e-12);
        }
    }
}
