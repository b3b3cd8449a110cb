//! Which three control hairs surround a point of the skin, and with what weights (paper §3.3).
//!
//! The control sites of every chart are triangulated in (u, v): Delaunay, which keeps triangles round, constrained to
//! the chart's outline and to partings. A point gets the hairs of its triangle with its barycentric weights (Figure 6);
//! a point in no triangle gets the nearest edge's. Predicates are exact (J. R. Shewchuk 1997, "Adaptive precision
//! floating-point arithmetic and fast robust geometric predicates"), so the answer is a function of the query alone.

use crate::box_tree::BoxTree;
use crate::chart_cut::{Chart, ChartCut, cut_chart, point};
use crate::control::Sites;
use pelage_geom::{Mesh, NONE, Topology};
use rayon::prelude::*;
use std::ops::Range;

/// Triangulated control sites.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangulation {
    /// \[T\] sites of each triangle, counter-clockwise in (u, v), lowest first; chart by chart, ascending.
    pub triangle: Vec<[u32; 3]>,
    /// \[T\] control hairs of the corners.
    pub hair: Vec<[u32; 3]>,
    /// \[T\] triangle across the edge from corner i to corner i + 1; [`NONE`] on the outline.
    pub neighbour: Vec<[u32; 3]>,
    /// \[T\] texture coordinates of the corners.
    pub uv: Vec<[[f32; 2]; 3]>,
    /// Where points outside go: edges with one triangle, and edges without one where a chart's sites lie on a line.
    pub edge: Vec<OutlineEdge>,
    /// What was found odd on the way.
    pub counts: TriangulationCounts,
    /// One a chart.
    chart: Vec<ChartIndex>,
}

/// An edge that points outside all triangles can be nearest to. Both ends are one if a chart has a single site.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlineEdge {
    /// Control hairs of its ends, and of the third corner of its triangle (or of its first end once more).
    pub hair: [u32; 3],
    /// Texture coordinates of its ends.
    pub uv: [[f32; 2]; 2],
}

/// Oddities of control sites, counted for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TriangulationCounts {
    /// Sites at the texture coordinates of an earlier site of their chart; the earlier one stands for both.
    pub duplicates: usize,
    /// Sites with texture coordinates that are not finite; left out.
    pub not_finite: usize,
    /// Outline and parting edges left out because they cross others (a chart that overlaps itself).
    pub crossing: usize,
    /// Charts whose outline is not closed; nothing of their convex hull was cut away.
    pub open_outlines: usize,
    /// Triangle corners at a parting whose side is not known; they took the left hair.
    pub no_side: usize,
    /// Triangles that touched both sides of a parting, part of which crosses the outline; they took one side.
    pub mixed: usize,
    /// Charts without any site.
    pub empty_charts: usize,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct ChartIndex {
    triangles: Range<usize>,
    edges: Range<usize>,
    triangle_tree: BoxTree,
    edge_tree: BoxTree,
}

/// Control hairs and weights of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// Control hairs.
    pub hair: [u32; 3],
    /// Their weights: non-negative, sum 1 to 1e-6.
    pub weight: [f32; 3],
    /// True if no triangle holds the point.
    pub outside: bool,
}

/// True for charts that are turned over in (u, v): more area clockwise than counter-clockwise.
pub fn mirrored_charts(mesh: &Mesh, topology: &Topology) -> Vec<bool> {
    let mut area = vec![0.0; topology.charts];
    for (uv, &chart) in mesh.corner_uv.iter().zip(&topology.chart) {
        let [a, b, c] = uv.map(|p| p.map(f64::from));
        area[chart as usize] += (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    }
    area.into_iter().map(|a| a < 0.0).collect()
}

/// Triangulates the sites of every chart. `mirrored` has one entry a chart, see [`mirrored_charts`].
pub fn triangulate(sites: &Sites, mirrored: &[bool]) -> Triangulation {
    let mut chart: Vec<Chart> = mirrored.iter().map(|&mirrored| Chart { mirrored, ..Chart::default() }).collect();
    for (s, &c) in sites.chart.iter().enumerate() {
        chart[c as usize].members.push(s as u32);
    }
    for &e in &sites.border_edges {
        chart[sites.chart[e[0] as usize] as usize].border.push(e);
    }
    for p in &sites.partings {
        chart[p.chart as usize].partings.push(p);
    }
    let cuts: Vec<(ChartCut, TriangulationCounts)> = chart
        .par_iter()
        .map(|c| {
            let mut counts = TriangulationCounts::default();
            if c.members.is_empty() {
                counts.empty_charts = 1;
                return (ChartCut::default(), counts);
            }
            (cut_chart(sites, c, &mut counts), counts)
        })
        .collect();
    let mut all = Triangulation::default();
    for (cut, counts) in cuts {
        all.append(sites, &cut);
        all.counts.add(&counts);
    }
    all
}

impl TriangulationCounts {
    fn add(&mut self, o: &TriangulationCounts) {
        self.duplicates += o.duplicates;
        self.not_finite += o.not_finite;
        self.crossing += o.crossing;
        self.open_outlines += o.open_outlines;
        self.no_side += o.no_side;
        self.mixed += o.mixed;
        self.empty_charts += o.empty_charts;
    }
}

impl Triangulation {
    fn append(&mut self, sites: &Sites, cut: &ChartCut) {
        let uv = |s: u32| {
            let p = point(sites.uv[s as usize]);
            [p.x as f32, p.y as f32]
        };
        let (first, first_edge) = (self.triangle.len(), self.edge.len());
        let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * cut.triangle.len());
        for (k, (site, hair)) in cut.triangle.iter().enumerate() {
            self.triangle.push(*site);
            self.hair.push(*hair);
            self.uv.push(site.map(uv));
            sides.extend((0..3).map(|i| ([site[i], site[(i + 1) % 3]], (first + k) as u32)));
        }
        sides.sort_unstable();
        for (site, hair) in &cut.triangle {
            let across: [u32; 3] = std::array::from_fn(|i| {
                let back = [site[(i + 1) % 3], site[i]];
                sides.binary_search_by_key(&back, |s| s.0).map_or(NONE, |k| sides[k].1)
            });
            self.neighbour.push(across);
            for i in (0..3).filter(|&i| across[i] == NONE) {
                let turn = [i, (i + 1) % 3, (i + 2) % 3];
                self.edge.push(OutlineEdge { hair: turn.map(|k| hair[k]), uv: [uv(site[turn[0]]), uv(site[turn[1]])] });
            }
        }
        let alone = cut.edge.iter().map(|(s, h)| OutlineEdge { hair: [h[0], h[1], h[0]], uv: s.map(uv) });
        self.edge.extend(alone);
        let boxed = |p: &[[f32; 2]]| {
            p.iter().fold((p[0], p[0]), |(lo, hi), q| {
                (std::array::from_fn(|k| lo[k].min(q[k])), std::array::from_fn(|k| hi[k].max(q[k])))
            })
        };
        let triangle_boxes: Vec<_> = self.uv[first..].iter().map(|t| boxed(t)).collect();
        let edge_boxes: Vec<_> = self.edge[first_edge..].iter().map(|e| boxed(&e.uv)).collect();
        self.chart.push(ChartIndex {
            triangles: first..self.triangle.len(),
            edges: first_edge..self.edge.len(),
            triangle_tree: BoxTree::new(&triangle_boxes),
            edge_tree: BoxTree::new(&edge_boxes),
        });
    }

    /// Triangles of a chart.
    pub fn triangles(&self, chart: u32) -> Range<usize> {
        self.chart[chart as usize].triangles.clone()
    }

    /// Hairs and weights at a point of a chart. On an edge or a corner the triangle of lowest number decides; outside,
    /// the nearest edge (the lowest of equals). `None` if the chart has no sites or `uv` is not finite.
    pub fn locate(&self, chart: u32, uv: [f32; 2]) -> Option<Located> {
        if !uv[0].is_finite() || !uv[1].is_finite() {
            return None;
        }
        let index = &self.chart[chart as usize];
        let p = point(uv);
        let uv = [p.x as f32, p.y as f32];
        let mut found = [0.0; 3];
        let hit = index.triangle_tree.first_at(uv, |k| {
            let o = areas(&self.uv[index.triangles.start + k as usize], uv);
            let holds = o.iter().all(|&x| x >= 0.0) && o.iter().any(|&x| x > 0.0);
            if holds {
                found = o;
            }
            holds
        });
        if let Some(k) = hit {
            let sum = found[0] + found[1] + found[2];
            let weight = rounded(found.map(|x| x / sum));
            return Some(Located { hair: self.hair[index.triangles.start + k as usize], weight, outside: false });
        }
        let edges = &self.edge[index.edges.clone()];
        let k = index.edge_tree.nearest(uv, |k| foot(&edges[k as usize].uv, uv).1)?;
        let edge = &edges[k as usize];
        let f = foot(&edge.uv, uv).0;
        Some(Located { hair: edge.hair, weight: rounded([1.0 - f, f, 0.0]), outside: true })
    }
}

/// Twice the areas of the triangles that `p` makes with the edges opposite to corners 0, 1, 2; signs are exact.
fn areas(t: &[[f32; 2]; 3], p: [f32; 2]) -> [f64; 3] {
    let coord = |q: [f32; 2]| robust::Coord { x: f64::from(q[0]), y: f64::from(q[1]) };
    std::array::from_fn(|i| robust::orient2d(coord(t[(i + 1) % 3]), coord(t[(i + 2) % 3]), coord(p)))
}

/// Nearest point of a segment: fraction and squared distance.
fn foot(e: &[[f32; 2]; 2], p: [f32; 2]) -> (f64, f64) {
    let [a, b, p] = [e[0], e[1], p].map(|q| q.map(f64::from));
    let (d, q) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length2 = d[0] * d[0] + d[1] * d[1];
    let f = if length2 > 0.0 { ((q[0] * d[0] + q[1] * d[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let r = [q[0] - f * d[0], q[1] - f * d[1]];
    (f, r[0] * r[0] + r[1] * r[1])
}

/// Weights in single precision, the largest one adjusted to the sum 1.
fn rounded(w: [f64; 3]) -> [f32; 3] {
    let mut f = w.map(|x| x as f32);
    let k = (0..3).fold(0, |best, i| if f[i] > f[best] { i } else { best });
    let rest = f64::from(f[(k + 1) % 3]) + f64::from(f[(k + 2) % 3]);
    f[k] = (1.0 - rest) as f32;
    f
}
