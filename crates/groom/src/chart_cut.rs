//! One chart's constrained Delaunay triangulation: what lies within the outline, and on which side of a parting.

use crate::control::{PartingPiece, Sites};
use crate::triangulate::TriangulationCounts;
use spade::handles::{DirectedEdgeHandle, FixedVertexHandle};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::BTreeMap;

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;
type Edge<'a> = DirectedEdgeHandle<'a, Point2<f64>, (), CdtEdge<()>, ()>;

/// What one chart gives: triangles of sites, counter-clockwise in (u, v), with the hairs of their corners. A chart
/// whose sites lie on one line gives edges instead, a chart of one site an edge of no length.
#[derive(Default)]
pub(crate) struct ChartCut {
    pub triangle: Vec<([u32; 3], [u32; 3])>,
    pub edge: Vec<([u32; 2], [u32; 2])>,
}

/// One chart's share of the sites.
#[derive(Default)]
pub(crate) struct Chart<'a> {
    /// Sites.
    pub members: Vec<u32>,
    /// Outline edges.
    pub border: Vec<[u32; 2]>,
    /// Runs of partings.
    pub partings: Vec<&'a PartingPiece>,
    /// True if the chart is turned over in (u, v).
    pub mirrored: bool,
}

/// Constraints by undirected edge of the triangulation.
#[derive(Default)]
struct Marks {
    /// Number of outline edges that cover the edge. Crossing an odd one enters or leaves the chart; an even one is a
    /// slit.
    outline: BTreeMap<usize, u32>,
    /// Tail vertex of the edge in the direction of the parting.
    parting: BTreeMap<usize, usize>,
    /// Parting through a vertex.
    parting_of: BTreeMap<usize, u32>,
    /// False if an outline edge is missing.
    whole: bool,
}

/// Triangulates the sites of one chart.
pub(crate) fn cut_chart(sites: &Sites, chart: &Chart, counts: &mut TriangulationCounts) -> ChartCut {
    let (site_of, vertex_of) = weld(sites, &chart.members, counts);
    let points = site_of.iter().map(|&s| point(sites.uv[s as usize])).collect();
    let Ok(mut cdt) = Cdt::bulk_load_cdt(points, Vec::new()) else {
        // Every coordinate was checked; spade refuses nothing else.
        return ChartCut::default();
    };
    let pair = |s: u32| sites.hair[s as usize];
    if cdt.num_inner_faces() == 0 {
        let mut edge: Vec<_> = cdt
            .undirected_edges()
            .map(|e| e.vertices().map(|v| site_of[v.index()]))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        if let ([], [only]) = (edge.as_slice(), site_of.as_slice()) {
            edge.push([*only; 2]);
        }
        edge.sort_unstable();
        return ChartCut { edge: edge.into_iter().map(|s| (s, s.map(|s| pair(s)[0]))).collect(), ..Default::default() };
    }
    let marks = constrain(&mut cdt, chart, &vertex_of, counts);
    let keep = within(&cdt, &marks, counts);
    let mut cut = ChartCut::default();
    for face in cdt.inner_faces() {
        if !keep[face.fix().index()] {
            continue;
        }
        let edges = face.adjacent_edges();
        let site = edges.map(|e| site_of[e.from().index()]);
        let mut is_left = [0, 1, 2].map(|i| {
            let [left, right] = pair(site[i]);
            (left != right).then(|| {
                side(edges[i], &marks).unwrap_or_else(|| {
                    counts.no_side += 1;
                    true
                })
            })
        });
        unmix(&mut is_left, edges.map(|e| marks.parting_of.get(&e.from().index()).copied()), counts);
        // Sides are those seen from outside in space.
        let hair = [0, 1, 2].map(|i| pair(site[i])[usize::from(is_left[i] == Some(chart.mirrored))]);
        let k = (0..3).min_by_key(|&k| site[k]).unwrap_or(0);
        let turned = |x: [u32; 3]| [x[k], x[(k + 1) % 3], x[(k + 2) % 3]];
        cut.triangle.push((turned(site), turned(hair)));
    }
    cut.triangle.sort_unstable();
    cut
}

/// Where part of a parting is missing (it crossed the outline), a triangle can touch both its sides: the side of more
/// corners gets all, the left one if there are as many.
fn unmix(is_left: &mut [Option<bool>; 3], parting: [Option<u32>; 3], counts: &mut TriangulationCounts) {
    for i in 0..3 {
        let same: Vec<usize> = (0..3).filter(|&k| is_left[k].is_some() && parting[k] == parting[i]).collect();
        let left = same.iter().filter(|&&k| is_left[k] == Some(true)).count();
        if left != 0 && left != same.len() {
            counts.mixed += 1;
            same.iter().for_each(|&k| is_left[k] = Some(2 * left >= same.len()));
        }
    }
}

/// Exact in double precision; subnormal numbers, which the predicates cannot square, count as zero.
pub(crate) fn point(uv: [f32; 2]) -> Point2<f64> {
    let [x, y] = uv.map(|x| if x.is_subnormal() { 0.0 } else { f64::from(x) });
    Point2::new(x, y)
}

/// Sites of distinct texture coordinates (the first of each), and the vertex of every member.
fn weld(sites: &Sites, members: &[u32], counts: &mut TriangulationCounts) -> (Vec<u32>, BTreeMap<u32, usize>) {
    let mut at: BTreeMap<[u64; 2], usize> = BTreeMap::new();
    let mut site_of = Vec::new();
    let mut vertex_of = BTreeMap::new();
    for &s in members {
        let uv = sites.uv[s as usize];
        if !uv[0].is_finite() || !uv[1].is_finite() {
            counts.not_finite += 1;
            continue;
        }
        let p = point(uv);
        // Adding zero makes one zero of both.
        let v = *at.entry([(p.x + 0.0).to_bits(), (p.y + 0.0).to_bits()]).or_insert_with(|| {
            site_of.push(s);
            site_of.len() - 1
        });
        counts.duplicates += usize::from(site_of[v] != s);
        vertex_of.insert(s, v);
    }
    (site_of, vertex_of)
}

/// Adds outline and partings; an edge that would cross an earlier one is left out.
fn constrain(
    cdt: &mut Cdt,
    chart: &Chart,
    vertex_of: &BTreeMap<u32, usize>,
    counts: &mut TriangulationCounts,
) -> Marks {
    let mut marks = Marks { whole: true, ..Marks::default() };
    let ends = |a: u32, b: u32| Some([*vertex_of.get(&a)?, *vertex_of.get(&b)?]).filter(|[a, b]| a != b);
    for &[a, b] in &chart.border {
        let Some([a, b]) = ends(a, b) else { continue };
        let Some(run) = add(cdt, a, b) else {
            counts.crossing += 1;
            marks.whole = false;
            continue;
        };
        run.into_iter().for_each(|(edge, _)| *marks.outline.entry(edge).or_default() += 1);
    }
    for piece in &chart.partings {
        marks.parting_of.extend(piece.site.iter().filter_map(|s| Some((*vertex_of.get(s)?, piece.parting))));
        for [a, b] in piece.site.windows(2).filter_map(|w| ends(w[0], w[1])) {
            let Some(run) = add(cdt, a, b) else {
                counts.crossing += 1;
                continue;
            };
            marks.parting.extend(run);
        }
    }
    marks
}

/// Makes a to b an edge, or a run of edges if vertices lie on it: (undirected edge, tail vertex). `None` if another
/// constraint is in the way.
fn add(cdt: &mut Cdt, a: usize, b: usize) -> Option<Vec<(usize, usize)>> {
    let [from, to] = [a, b].map(FixedVertexHandle::from_index);
    if !cdt.can_add_constraint(from, to) {
        return None;
    }
    cdt.add_constraint(from, to);
    let end = cdt.vertex(to).position();
    let mut at = cdt.vertex(from);
    let mut run = Vec::new();
    while at.fix() != to {
        let p = at.position();
        let next = at.out_edges().find(|e| {
            let q = e.to().position();
            let ahead = (q.x - p.x) * (end.x - p.x) + (q.y - p.y) * (end.y - p.y) > 0.0;
            e.to().fix() == to || (ahead && e.is_constraint_edge() && orient(p, end, q) == 0.0)
        })?;
        run.push((next.as_undirected().fix().index(), at.index()));
        at = next.to();
    }
    Some(run)
}

fn orient(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>) -> f64 {
    let coord = |p: Point2<f64>| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Faces within the outline, by parity of outline edges crossed from outside. All of them if there is no outline or if
/// it is not closed.
fn within(cdt: &Cdt, marks: &Marks, counts: &mut TriangulationCounts) -> Vec<bool> {
    if marks.outline.is_empty() && marks.whole {
        return vec![true; cdt.num_all_faces()];
    }
    let odd = |e: usize| marks.outline.get(&e).is_some_and(|n| n % 2 == 1);
    let closed =
        cdt.vertices().all(|v| v.out_edges().filter(|e| odd(e.as_undirected().fix().index())).count() % 2 == 0);
    if !marks.whole || !closed {
        counts.open_outlines += 1;
        return vec![true; cdt.num_all_faces()];
    }
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face().fix().index();
    inside[outer] = Some(false);
    // Face 0 is the outer one.
    let face: Vec<_> = cdt.inner_faces().collect();
    let mut stack = Vec::new();
    let cross = |e: Edge, from: bool, inside: &mut Vec<Option<bool>>| {
        let f = e.face().fix().index();
        if inside[f].is_none() {
            inside[f] = Some(from != odd(e.as_undirected().fix().index()));
            return Some(f);
        }
        None
    };
    for e in cdt.convex_hull() {
        stack.extend(cross(e.rev(), false, &mut inside));
    }
    while let Some(f) = stack.pop() {
        let here = inside[f] == Some(true);
        for e in face[f - 1].adjacent_edges() {
            stack.extend(cross(e.rev(), here, &mut inside));
        }
    }
    let keep: Vec<bool> = inside.into_iter().map(|x| x == Some(true)).collect();
    if keep.iter().any(|&k| k) { keep } else { vec![true; keep.len()] }
}

/// Whether the face left of `e` lies left of the parting through the tail of `e`, in (u, v). `None` if no parting edge
/// bounds its sector.
fn side(e: Edge, marks: &Marks) -> Option<bool> {
    let vertex = e.from().index();
    // Counter-clockwise: the sector right before an outgoing parting edge is on the right, before an incoming on the left.
    let mut edge = e.ccw();
    let stop = |x: Edge| marks.outline.contains_key(&x.as_undirected().fix().index());
    let outgoing = |x: Edge| marks.parting.get(&x.as_undirected().fix().index()).map(|&tail| tail == vertex);
    for _ in 0..e.from().out_edges().count() {
        if let Some(out) = outgoing(edge) {
            return Some(!out);
        }
        if stop(edge) || edge.is_outer_edge() {
            break;
        }
        edge = edge.ccw();
    }
    let mut edge = e;
    for _ in 0..e.from().out_edges().count() {
        if let Some(out) = outgoing(edge) {
            return Some(out);
        }
        if stop(edge) || edge.rev().is_outer_edge() {
            break;
        }
        edge = edge.cw();
    }
    None
}
