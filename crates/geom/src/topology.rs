//! What stays the same while a skin moves: welded vertices, texture charts, seams.

use crate::{Mesh, NONE, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// A triangle counts as flat in (u, v) when its height over its longest side is at most this fraction of its largest
/// coordinate. Sixteen units in the last place of a 32-bit coordinate, and the rounding of a text file with six
/// decimals. Below it the orientation of a collapsed triangle is rounding noise, so that collapsed triangles break
/// charts into specks and give tangents of random direction; far above it (1e-4) the small triangles of dense meshes
/// (an eyelid in a 4K atlas) lose their own tangent and stop joining charts.
const FLAT_UV: f64 = 1e-6;

/// A triangle counts as having no area when twice its area is at most this fraction of its longest side squared: what
/// cancellation leaves of three collinear points in double precision. Only the report reads it.
const FLAT: f64 = 1e-12;

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
    /// one orientation in (u, v); flat triangles go with a chart they touch. Numbered by lowest triangle. Without
    /// texture coordinates a chart is a connected component.
    pub chart: Vec<u32>,
    /// Number of charts.
    pub charts: usize,
    /// Triangle -> triangle across the edge from corner i to corner i + 1 ([`NONE`] on an open or non-manifold edge,
    /// and on all edges of a triangle with two corners welded together).
    pub neighbour: Vec<[u32; 3]>,
    /// Vertices per chart, those of one welded vertex side by side, welded vertices ascending.
    pub chart_vertex: Vec<ChartVertex>,
    /// Triangle corner -> chart vertex.
    pub corner: Vec<[u32; 3]>,
    /// Rest area of each triangle, square scene units.
    pub area: Vec<f64>,
    /// Triangles without area in (u, v); their tangent comes from neighbours.
    pub flat_uv: Vec<bool>,
    /// What was found odd on the way.
    pub counts: TopologyCounts,
    /// `vertices + 1` offsets into `chart_vertex`; see [`Topology::chart_vertices`].
    vertex_offset: Vec<u32>,
    /// `chart vertices + 1` offsets into `incident`.
    incident_offset: Vec<u32>,
    /// Corners as `3 * triangle + corner`, grouped by chart vertex, ascending within one.
    incident: Vec<u32>,
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
    /// Edges between two charts, or inside one where its texture coordinates jump.
    pub seam_edges: usize,
}

impl Topology {
    /// Finds welds, charts, seams and areas of a rest mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let weld = weld(&mesh.position);
        let skin = Welded::new(mesh, &weld);
        let mut counts = TopologyCounts::default();
        let (mate, links) = match_edges(&skin, &mut counts);
        let shape: Vec<Shape> = (0..skin.tri.len() as u32).into_par_iter().map(|t| Shape::of(mesh, &skin, t)).collect();
        for s in &shape {
            counts.zero_area += usize::from(s.zero_area);
            counts.zero_uv_area += usize::from(s.uv_sign == 0 && !s.zero_area);
            counts.mirrored += usize::from(s.uv_sign < 0 && !s.zero_area);
        }
        let (chart, charts) = find_charts(&skin, &mate, &links, &shape);
        let mut topology = Topology {
            charts,
            neighbour: mate.iter().map(|m| m.map(|h| if h == NONE { NONE } else { h / 3 })).collect(),
            area: shape.iter().map(|s| s.area).collect(),
            flat_uv: shape.iter().map(|s| s.uv_sign == 0).collect(),
            counts,
            corner: vec![[0; 3]; skin.tri.len()],
            ..Topology::default()
        };
        topology.number_chart_vertices(&skin, &chart);
        topology.chart = chart;
        topology.weld = weld;
        topology.mark_borders(&mate);
        topology
    }

    /// Welded vertex of a triangle's corner.
    pub fn welded(&self, triangle: u32, corner: usize) -> u32 {
        self.chart_vertex[self.corner[triangle as usize][corner] as usize].vertex
    }

    /// Chart vertices at the position of a welded vertex (`weld[v] == v`); empty for others and for unused vertices.
    pub fn chart_vertices(&self, welded: u32) -> Range<usize> {
        self.vertex_offset[welded as usize] as usize..self.vertex_offset[welded as usize + 1] as usize
    }

    /// Triangle corners of a chart vertex, as `3 * triangle + corner`, ascending.
    pub fn incident(&self, chart_vertex: usize) -> &[u32] {
        &self.incident[self.incident_offset[chart_vertex] as usize..self.incident_offset[chart_vertex + 1] as usize]
    }

    /// Triangle corners of a welded vertex over all its charts, as `3 * triangle + corner`; empty as
    /// [`Topology::chart_vertices`] is.
    pub fn incident_welded(&self, welded: u32) -> &[u32] {
        let r = self.chart_vertices(welded);
        &self.incident[self.incident_offset[r.start] as usize..self.incident_offset[r.end] as usize]
    }

    /// Triangle and edge on the other side of the edge from corner `edge` to the next; `None` where `neighbour` is
    /// [`NONE`].
    pub fn across(&self, triangle: u32, edge: usize) -> Option<(u32, usize)> {
        let n = self.neighbour[triangle as usize][edge];
        if n == NONE {
            return None;
        }
        let (a, b) = (self.welded(triangle, edge), self.welded(triangle, next(edge)));
        let j = (0..3).find(|&j| self.welded(n, j) == b && self.welded(n, next(j)) == a)?;
        Some((n, j))
    }

    /// True if the edge from corner `edge` to the next ends the triangle's chart: no neighbour, another chart, or
    /// other texture coordinates. Edges of a triangle with two corners welded together never count.
    pub fn is_border(&self, triangle: u32, edge: usize) -> bool {
        let c = self.corner[triangle as usize];
        match self.across(triangle, edge) {
            Some((n, j)) => {
                let d = self.corner[n as usize];
                c[edge] != d[next(j)] || c[next(edge)] != d[j]
            }
            None => distinct([0, 1, 2].map(|i| self.welded(triangle, i))),
        }
    }

    /// Border edges of all charts as pairs of chart vertices, in the direction of their triangle, in triangle order.
    /// Both belong to the chart `chart_vertex[pair[0]].chart`.
    pub fn border_edges(&self) -> Vec<[u32; 2]> {
        let edges = (0..self.corner.len() as u32).flat_map(|t| (0..3).map(move |i| (t, i)));
        edges
            .filter(|&(t, i)| self.is_border(t, i))
            .map(|(t, i)| [self.corner[t as usize][i], self.corner[t as usize][next(i)]])
            .collect()
    }

    /// Numbers the distinct (welded vertex, chart, uv) and lists their corners.
    fn number_chart_vertices(&mut self, skin: &Welded, chart: &[u32]) {
        self.incident.reserve(skin.incident.len());
        self.vertex_offset.reserve(skin.vertices() + 1);
        self.vertex_offset.push(0);
        let mut here: Vec<(u32, [u32; 2], u32)> = Vec::new();
        for v in 0..skin.vertices() {
            here.clear();
            here.extend(skin.around(v).iter().map(|&c| (chart[c as usize / 3], bits(skin.uv(c)), c)));
            here.sort_unstable();
            for (k, &(chart, uv, c)) in here.iter().enumerate() {
                if k == 0 || (here[k - 1].0, here[k - 1].1) != (chart, uv) {
                    self.incident_offset.push(self.incident.len() as u32);
                    let uv = uv.map(f32::from_bits);
                    self.chart_vertex.push(ChartVertex { vertex: v as u32, chart, uv, border: false });
                }
                self.corner[c as usize / 3][c as usize % 3] = self.chart_vertex.len() as u32 - 1;
                self.incident.push(c);
            }
            self.vertex_offset.push(self.chart_vertex.len() as u32);
        }
        self.incident_offset.push(self.incident.len() as u32);
    }

    /// Sets the border flags and counts the seams.
    fn mark_borders(&mut self, mate: &[[u32; 3]]) {
        for (t, m) in mate.iter().enumerate() {
            let c = self.corner[t];
            if !distinct(c.map(|k| self.chart_vertex[k as usize].vertex)) {
                continue;
            }
            for i in 0..3 {
                if m[i] != NONE {
                    let (n, j) = (m[i] as usize / 3, m[i] as usize % 3);
                    if c[i] == self.corner[n][next(j)] && c[next(i)] == self.corner[n][j] {
                        continue;
                    }
                    self.counts.seam_edges += usize::from(t < n);
                }
                self.chart_vertex[c[i] as usize].border = true;
                self.chart_vertex[c[next(i)] as usize].border = true;
            }
        }
    }
}

/// The corner after `i` in a triangle.
fn next(i: usize) -> usize {
    (i + 1) % 3
}

fn distinct([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Bits of texture coordinates, equal where the coordinates are (-0 becomes 0).
fn bits(uv: [f32; 2]) -> [u32; 2] {
    uv.map(|x| (x + 0.0).to_bits())
}

/// Vertex -> first vertex of exactly the same position.
fn weld(position: &[[f64; 3]]) -> Vec<u32> {
    let mut sorted: Vec<([u64; 3], u32)> =
        position.par_iter().enumerate().map(|(i, p)| (p.map(|x| (x + 0.0).to_bits()), i as u32)).collect();
    sorted.par_sort_unstable();
    let mut weld = vec![0; position.len()];
    let mut first = 0;
    for (k, &(p, i)) in sorted.iter().enumerate() {
        if k == 0 || sorted[k - 1].0 != p {
            first = i;
        }
        weld[i as usize] = first;
    }
    weld
}

/// Triangles over welded vertices, and the corners around each.
struct Welded<'a> {
    mesh: &'a Mesh,
    tri: Vec<[u32; 3]>,
    offset: Vec<u32>,
    /// Corners as `3 * triangle + corner`, grouped by welded vertex, ascending within one.
    incident: Vec<u32>,
}

impl<'a> Welded<'a> {
    fn new(mesh: &'a Mesh, weld: &[u32]) -> Self {
        assert!(mesh.triangle.len() < (NONE / 3) as usize, "more than 2^32 triangle corners");
        let tri: Vec<[u32; 3]> = mesh.triangle.iter().map(|t| t.map(|v| weld[v as usize])).collect();
        let mut offset = vec![0u32; weld.len() + 1];
        for v in tri.iter().flatten() {
            offset[*v as usize + 1] += 1;
        }
        for v in 0..weld.len() {
            offset[v + 1] += offset[v];
        }
        let mut fill = offset.clone();
        let mut incident = vec![0; 3 * tri.len()];
        for (c, v) in tri.iter().flatten().enumerate() {
            incident[fill[*v as usize] as usize] = c as u32;
            fill[*v as usize] += 1;
        }
        Welded { mesh, tri, offset, incident }
    }

    fn vertices(&self) -> usize {
        self.offset.len() - 1
    }

    fn around(&self, v: usize) -> &[u32] {
        &self.incident[self.offset[v] as usize..self.offset[v + 1] as usize]
    }

    fn uv(&self, corner: u32) -> [f32; 2] {
        self.mesh.corner_uv.get(corner as usize / 3).map_or([0.0; 2], |t| t[corner as usize % 3])
    }

    /// Texture coordinates at the lower and the higher welded vertex of half-edge `h`.
    fn edge_uv(&self, h: u32) -> [[u32; 2]; 2] {
        let t = 3 * (h / 3);
        let (i, j) = ((h % 3) as usize, next((h % 3) as usize));
        let (a, b) = (bits(self.uv(t + i as u32)), bits(self.uv(t + j as u32)));
        let tri = self.tri[h as usize / 3];
        if tri[i] < tri[j] { [a, b] } else { [b, a] }
    }
}

/// Opposite half-edge of each half-edge (`3 * triangle + edge`, or [`NONE`]); and pairs of triangles, both ways round
/// and sorted, that share an edge with equal texture coordinates of which one has two corners welded together.
fn match_edges(skin: &Welded, counts: &mut TopologyCounts) -> (Vec<[u32; 3]>, Vec<[u32; 2]>) {
    let mut mate = vec![[NONE; 3]; skin.tri.len()];
    let mut links = Vec::new();
    let mut here: Vec<(u32, u32)> = Vec::new();
    let mut solid: Vec<u32> = Vec::new();
    for v in 0..skin.vertices() {
        here.clear();
        for &c in skin.around(v) {
            let (t, i) = (c / 3, (c % 3) as usize);
            let tri = skin.tri[t as usize];
            let prev = (i + 2) % 3;
            for (other, edge) in [(tri[next(i)], i), (tri[prev], prev)] {
                if other > v as u32 {
                    here.push((other, 3 * t + edge as u32));
                }
            }
        }
        here.sort_unstable();
        for group in here.chunk_by(|a, b| a.0 == b.0) {
            solid.clear();
            solid.extend(group.iter().map(|g| g.1).filter(|h| distinct(skin.tri[*h as usize / 3])));
            if solid.len() < group.len() {
                link_collapsed(skin, group, &mut links);
            }
            let from = |h: u32| skin.tri[h as usize / 3][h as usize % 3];
            match solid[..] {
                [] => {}
                [_] => counts.open_edges += 1,
                [a, b] if from(a) != from(b) => {
                    mate[a as usize / 3][a as usize % 3] = b;
                    mate[b as usize / 3][b as usize % 3] = a;
                }
                _ => counts.non_manifold_edges += 1,
            }
        }
    }
    links.sort_unstable();
    (mate, links)
}

/// Links the triangles of one edge that have two corners welded together to others of equal texture coordinates there.
fn link_collapsed(skin: &Welded, group: &[(u32, u32)], links: &mut Vec<[u32; 2]>) {
    let mut keyed: Vec<_> = group.iter().map(|g| (skin.edge_uv(g.1), g.1 / 3)).collect();
    keyed.sort_unstable();
    for w in keyed.windows(2) {
        let (a, b) = (w[0].1, w[1].1);
        if w[0].0 == w[1].0 && a != b && !(distinct(skin.tri[a as usize]) && distinct(skin.tri[b as usize])) {
            links.extend([[a, b], [b, a]]);
        }
    }
}

/// Areas of one triangle.
struct Shape {
    area: f64,
    zero_area: bool,
    /// 0 where flat.
    uv_sign: i8,
}

impl Shape {
    fn of(mesh: &Mesh, skin: &Welded, t: u32) -> Self {
        let [a, b, c] = mesh.corners(t);
        let twice = (b - a).cross(&(c - a)).norm();
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        let uv = [0, 1, 2].map(|i| {
            let [u, v] = skin.uv(3 * t + i);
            Vec3::new(f64::from(u), f64::from(v), 0.0)
        });
        let sides = [uv[1] - uv[0], uv[2] - uv[1], uv[0] - uv[2]];
        let uv_twice = sides[2].x * sides[0].y - sides[0].x * sides[2].y;
        let uv_longest = sides.iter().map(|s| s.norm()).fold(0.0, f64::max);
        let largest = uv.iter().map(|p| p.amax()).fold(0.0, f64::max);
        // Written so that NaN coordinates are flat.
        let sign = if uv_twice.abs() > FLAT_UV * largest * uv_longest { uv_twice.signum() as i8 } else { 0 };
        Shape { area: 0.5 * twice, zero_area: twice <= FLAT * longest, uv_sign: sign }
    }
}

/// Charts of triangles, and their number.
fn find_charts(skin: &Welded, mate: &[[u32; 3]], links: &[[u32; 2]], shape: &[Shape]) -> (Vec<u32>, usize) {
    let n = skin.tri.len();
    let firm = |t: u32| shape[t as usize].uv_sign != 0 && distinct(skin.tri[t as usize]);
    let beside = |t: u32, found: &mut Vec<u32>| {
        found.clear();
        for (i, &m) in mate[t as usize].iter().enumerate() {
            if m != NONE && skin.edge_uv(3 * t + i as u32) == skin.edge_uv(m) {
                found.push(m / 3);
            }
        }
        let first = links.partition_point(|l| l[0] < t);
        found.extend(links[first..].iter().take_while(|l| l[0] == t).map(|l| l[1]));
    };
    let mut chart = vec![NONE; n];
    let mut charts = 0;
    let (mut stack, mut found) = (Vec::new(), Vec::new());
    // Joins what can be reached from each unlabelled triangle of a kind over triangles of the same kind.
    let mut join = |chart: &mut Vec<u32>, charts: &mut u32, same: &dyn Fn(u32, u32) -> bool| {
        for seed in 0..n as u32 {
            if chart[seed as usize] != NONE || !same(seed, seed) {
                continue;
            }
            chart[seed as usize] = *charts;
            stack.push(seed);
            while let Some(t) = stack.pop() {
                beside(t, &mut found);
                for &o in found.iter() {
                    if chart[o as usize] == NONE && same(t, o) {
                        chart[o as usize] = *charts;
                        stack.push(o);
                    }
                }
            }
            *charts += 1;
        }
    };
    let sign = |t: u32| shape[t as usize].uv_sign;
    join(&mut chart, &mut charts, &|t, o| firm(o) && sign(t) == sign(o));
    attach_flat(&mut chart, &beside);
    join(&mut chart, &mut charts, &|_, _| true);

    let mut renumber = vec![NONE; charts as usize];
    let mut used = 0;
    for c in &mut chart {
        let r = &mut renumber[*c as usize];
        if *r == NONE {
            *r = used;
            used += 1;
        }
        *c = *r;
    }
    (chart, charts as usize)
}

/// Gives unlabelled triangles the lowest label beside them, ring by ring.
fn attach_flat(chart: &mut [u32], beside: &dyn Fn(u32, &mut Vec<u32>)) {
    let mut found = Vec::new();
    let mut ring: Vec<u32> = (0..chart.len() as u32).filter(|&t| chart[t as usize] == NONE).collect();
    while !ring.is_empty() {
        let mut set = Vec::new();
        for &t in &ring {
            beside(t, &mut found);
            let lowest = found.iter().map(|&o| chart[o as usize]).min().unwrap_or(NONE);
            if lowest != NONE {
                set.push((t, lowest));
            }
        }
        for &(t, c) in &set {
            chart[t as usize] = c;
        }
        ring.clear();
        for &(t, _) in &set {
            beside(t, &mut found);
            ring.extend(found.iter().filter(|&&o| chart[o as usize] == NONE));
        }
        ring.sort_unstable();
        ring.dedup();
    }
}
