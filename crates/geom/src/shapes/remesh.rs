//! Triangles of a wanted size on a field's zero set: the incremental remeshing of Botsch and Kobbelt (2004, "A Remeshing
//! Approach to Multiresolution Modeling": split, collapse, flip, relax), with Delaunay flips and a size field.
//!
//! Works on the half x >= 0 of a body; vertices with x = 0 are its border and stay there.

use super::nets::{QuadMesh, gradient};
use crate::{NONE, Vec3};
use rayon::prelude::*;

/// A triangle mesh under change.
struct Work {
    position: Vec<Vec3>,
    /// Wanted edge length at each vertex.
    size: Vec<f64>,
    /// Triangles; removed ones hold [`NONE`].
    triangle: Vec<[u32; 3]>,
    /// Live triangles at each vertex; empty for a removed vertex.
    around: Vec<Vec<u32>>,
}

/// Triangles of the half x >= 0 of `mesh` brought to edge lengths near `size`, all vertices on the zero set of `field`:
/// (positions, triangles).
pub fn remesh(
    mesh: &QuadMesh,
    field: &(dyn Fn(Vec3) -> f64 + Sync),
    size: &(dyn Fn(Vec3) -> f64 + Sync),
    rounds: usize,
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut work = Work::new(mesh);
    for round in 0..rounds {
        work.size = work.position.par_iter().map(|&p| size(p)).collect();
        work.split_long(size);
        work.collapse_short();
        work.flip();
        work.relax(field, if round + 1 == rounds { 5 } else { 2 });
        if round + 1 == rounds {
            work.flip();
        }
    }
    work.compact()
}

impl Work {
    fn new(mesh: &QuadMesh) -> Work {
        let mut work = Work {
            position: mesh.position.clone(),
            size: Vec::new(),
            triangle: Vec::new(),
            around: vec![Vec::new(); mesh.position.len()],
        };
        for q in &mesh.quad {
            let p = q.map(|i| mesh.position[i as usize]);
            if p.iter().all(|p| p.x >= 0.0) {
                let short = (p[0] - p[2]).norm_squared() <= (p[1] - p[3]).norm_squared();
                let pair = if short {
                    [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
                } else {
                    [[q[0], q[1], q[3]], [q[1], q[2], q[3]]]
                };
                pair.into_iter().for_each(|t| work.add(t));
            }
        }
        work
    }

    fn add(&mut self, t: [u32; 3]) {
        for v in t {
            self.around[v as usize].push(self.triangle.len() as u32);
        }
        self.triangle.push(t);
    }

    fn remove(&mut self, t: u32) {
        for v in self.triangle[t as usize] {
            self.around[v as usize].retain(|&s| s != t);
        }
        self.triangle[t as usize] = [NONE; 3];
    }

    /// All edges, each once, in a fixed order.
    fn edges(&self) -> Vec<[u32; 2]> {
        let mut edge: Vec<[u32; 2]> = Vec::with_capacity(self.triangle.len() * 3);
        for t in self.triangle.iter().filter(|t| t[0] != NONE) {
            edge.extend((0..3).map(|i| [t[i].min(t[(i + 1) % 3]), t[i].max(t[(i + 1) % 3])]));
        }
        edge.sort_unstable();
        edge.dedup();
        edge
    }

    /// Triangles on edge `a b`.
    fn on_edge(&self, [a, b]: [u32; 2]) -> Vec<u32> {
        self.around[a as usize].iter().copied().filter(|&t| self.triangle[t as usize].contains(&b)).collect()
    }

    fn at(&self, v: u32) -> Vec3 {
        self.position[v as usize]
    }

    fn length(&self, [a, b]: [u32; 2]) -> f64 {
        (self.at(a) - self.at(b)).norm()
    }

    fn wanted(&self, [a, b]: [u32; 2]) -> f64 {
        0.5 * (self.size[a as usize] + self.size[b as usize])
    }

    /// Twice the area times the unit normal.
    fn normal(&self, t: [u32; 3]) -> Vec3 {
        let [a, b, c] = t.map(|v| self.at(v));
        (b - a).cross(&(c - a))
    }

    /// The corner of triangle `t` off edge `e`.
    fn opposite(&self, t: u32, e: [u32; 2]) -> u32 {
        self.triangle[t as usize].into_iter().find(|v| !e.contains(v)).unwrap_or(NONE)
    }

    fn split_long(&mut self, size: &(dyn Fn(Vec3) -> f64 + Sync)) {
        for e in self.edges() {
            if self.length(e) < 4.0 / 3.0 * self.wanted(e) {
                continue;
            }
            let both = self.on_edge(e);
            let middle = self.position.len() as u32;
            let mut p = (self.at(e[0]) + self.at(e[1])) * 0.5;
            if both.len() == 1 {
                p.x = 0.0;
            }
            self.position.push(p);
            self.size.push(size(p));
            self.around.push(Vec::new());
            for t in both {
                let old = self.triangle[t as usize];
                self.remove(t);
                for end in e {
                    self.add(old.map(|v| if v == end { middle } else { v }));
                }
            }
        }
    }

    fn collapse_short(&mut self) {
        for e in self.edges() {
            let [a, b] = e;
            let both = self.on_edge(e);
            if both.is_empty() || self.length(e) > 0.8 * self.wanted(e) {
                continue;
            }
            let border = e.map(|v| self.at(v).x == 0.0);
            if border == [true, true] && both.len() == 2 {
                continue;
            }
            let (keep, drop) = if border[1] { (b, a) } else { (a, b) };
            let p = if border[0] == border[1] { (self.at(a) + self.at(b)) * 0.5 } else { self.at(keep) };
            if self.may_collapse(keep, drop, p, &both) {
                for t in both {
                    self.remove(t);
                }
                for t in std::mem::take(&mut self.around[drop as usize]) {
                    self.triangle[t as usize] = self.triangle[t as usize].map(|v| if v == drop { keep } else { v });
                    self.around[keep as usize].push(t);
                }
                self.position[keep as usize] = p;
            }
        }
    }

    /// Neighbours of a vertex, ascending.
    fn ring(&self, v: u32) -> Vec<u32> {
        let mut ring: Vec<u32> = self.around[v as usize].iter().flat_map(|&t| self.triangle[t as usize]).collect();
        ring.sort_unstable();
        ring.dedup();
        ring.retain(|&w| w != v);
        ring
    }

    /// Collapsing `drop` into `keep` at `p` keeps the mesh a manifold, turns no triangle by more than about 60 degrees
    /// and makes no edge that would be split again.
    fn may_collapse(&self, keep: u32, drop: u32, p: Vec3, both: &[u32]) -> bool {
        let (near, far) = (self.ring(keep), self.ring(drop));
        let common = near.iter().filter(|v| far.binary_search(v).is_ok()).count();
        if common != both.len() {
            return false;
        }
        let long = |v: &u32| (self.at(*v) - p).norm() > 4.0 / 3.0 * self.wanted([*v, keep]);
        if near.iter().chain(&far).any(|v| *v != keep && *v != drop && long(v)) {
            return false;
        }
        let rest = self.around[keep as usize].iter().chain(&self.around[drop as usize]);
        rest.filter(|t| !both.contains(t)).all(|&t| {
            let corner = self.triangle[t as usize];
            let moved = corner.map(|v| if v == keep || v == drop { p } else { self.at(v) });
            let (old, new) = (self.normal(corner), (moved[1] - moved[0]).cross(&(moved[2] - moved[0])));
            new.dot(&old) > 0.5 * old.norm() * new.norm()
        })
    }

    /// Flips edges until (nearly) every one is Delaunay: the angles opposite to it sum to at most 180 degrees.
    fn flip(&mut self) {
        for _ in 0..4 {
            let mut changed = false;
            for e in self.edges() {
                let both = self.on_edge(e);
                if let [s, t] = both[..] {
                    changed |= self.flip_edge(e, s, t);
                }
            }
            if !changed {
                break;
            }
        }
    }

    fn flip_edge(&mut self, e: [u32; 2], s: u32, t: u32) -> bool {
        let (c, d) = (self.opposite(s, e), self.opposite(t, e));
        let cot = |v: u32| {
            let (x, y) = (self.at(e[0]) - self.at(v), self.at(e[1]) - self.at(v));
            x.dot(&y) / x.cross(&y).norm().max(1e-12)
        };
        if cot(c) + cot(d) > -1e-6 || self.around[c as usize].iter().any(|&r| self.triangle[r as usize].contains(&d)) {
            return false;
        }
        // In triangle s the edge may run either way.
        let old = self.triangle[s as usize];
        let i = old.iter().position(|&v| v == c).unwrap_or(0);
        let (a, b) = (old[(i + 1) % 3], old[(i + 2) % 3]);
        let new = [[a, d, c], [d, b, c]];
        let mean = self.normal(old) + self.normal(self.triangle[t as usize]);
        if new.iter().any(|&n| self.normal(n).dot(&mean) < 0.5 * self.normal(n).norm() * mean.norm()) {
            return false;
        }
        self.remove(s);
        self.remove(t);
        new.into_iter().for_each(|n| self.add(n));
        true
    }

    /// Moves vertices along the surface towards the area-weighted mean of their triangles' centres, then onto it.
    fn relax(&mut self, field: &(dyn Fn(Vec3) -> f64 + Sync), rounds: usize) {
        for _ in 0..rounds {
            let this = &*self;
            let moved = (0..this.position.len()).into_par_iter().map(|i| {
                let p = this.position[i];
                if this.around[i].is_empty() {
                    return p;
                }
                let (mut sum, mut weight) = (Vec3::zeros(), 0.0);
                for &t in &this.around[i] {
                    let corner = this.triangle[t as usize];
                    let middle = corner.iter().fold(Vec3::zeros(), |s, &v| s + this.at(v)) / 3.0;
                    let wanted = corner.iter().map(|&v| this.size[v as usize]).sum::<f64>() / 3.0;
                    let w = this.normal(corner).norm() / (wanted * wanted);
                    sum += middle * w;
                    weight += w;
                }
                let mut shift = (sum / weight - p) * 0.7;
                if p.x == 0.0 {
                    shift.x = 0.0;
                }
                let (f, g) = gradient(field, p, 1e-3);
                let square = g.norm_squared().max(0.04);
                shift -= g * (shift.dot(&g) / square);
                let mut q = p + shift - g * (f / square);
                let (f, g) = gradient(field, q, 1e-3);
                q -= g * (f / g.norm_squared().max(0.04));
                if p.x == 0.0 {
                    q.x = 0.0;
                } else {
                    q.x = q.x.max(1e-3);
                }
                q
            });
            self.position = moved.collect();
        }
    }

    /// Live vertices and triangles only.
    fn compact(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut number = vec![NONE; self.position.len()];
        let mut position = Vec::new();
        let live = self.triangle.iter().filter(|t| t[0] != NONE);
        let triangle = live.map(|t| {
            t.map(|v| {
                if number[v as usize] == NONE {
                    number[v as usize] = position.len() as u32;
                    position.push(self.at(v));
                }
                number[v as usize]
            })
        });
        let triangle = triangle.collect();
        (position, triangle)
    }
}
