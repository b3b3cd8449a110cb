//! Partings: curves on the skin on whose two sides hair falls apart.
//!
//! A parting is traced over the skin and carries control hairs in pairs, one copy for the triangles on its left and one for
//! those on its right, so that no hair mixes controls from both sides; at its two free ends a single hair closes it. Where
//! it crosses a seam, the crossing is a site of both charts with the same pair, and splits the border edge of both.

use crate::comb::side_of;
use crate::control::{PartingPiece, Skin};
use crate::place::Plan;
use pelage_geom::{Bvh, NONE, SurfacePoint, Vec3};

/// Crossings nearer to the end of a border edge than this part of the edge move to its vertex: closer, the split edge is
/// so short that rounding of its texture coordinates turns its triangles over.
const SNAP: f64 = 1e-3;

/// What became of the partings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartingCounts {
    /// Control hairs on partings: two at an inner point, one at an end.
    pub hairs: usize,
    /// Places where a parting crosses a seam.
    pub seam_crossings: usize,
    /// Partings that could not be followed to their end over the skin (it has a gap or an open border there) and stop.
    pub cut_short: usize,
    /// Partings left out because they have no length on the skin.
    pub skipped: usize,
}

/// The straight way through one triangle, as weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    triangle: u32,
    from: [f64; 3],
    to: [f64; 3],
    /// Edge it leaves by (from corner i to the next) and where on it; `None` where the way turns inside the triangle.
    exit: Option<(usize, f64)>,
}

/// A point on an edge: triangle, edge from corner i to the next, fraction.
type OnEdge = (u32, usize, f64);

/// A point of a parting that gets control hairs.
#[derive(Clone, Copy, Debug)]
enum Station {
    /// In a chart.
    Inside(SurfacePoint),
    /// Across a border edge, into another chart unless the skin ends there.
    Seam { out: OnEdge, into: Option<OnEdge> },
    /// Through a vertex of a border, out of one chart vertex and into another of the same welded vertex.
    Vertex { out: u32, into: Option<u32> },
}

/// A border edge's new site at a fraction of the edge.
struct Split {
    triangle: u32,
    edge: usize,
    fraction: f64,
    site: u32,
}

/// Adds sites and hairs of all partings to a plan that has its borders already.
pub(crate) fn add_partings(
    skin: &Skin,
    bvh: &Bvh,
    partings: &[Vec<Vec3>],
    spacing: f64,
    plan: &mut Plan,
) -> PartingCounts {
    let before = plan.root.len();
    let mut counts = PartingCounts::default();
    let mut splits = Vec::new();
    for (index, line) in partings.iter().enumerate() {
        let (steps, complete) = trace(skin, bvh, line);
        counts.cut_short += usize::from(!complete);
        if steps.is_empty() {
            counts.skipped += 1;
            continue;
        }
        let stations = stations(skin, &steps, spacing);
        counts.seam_crossings += stations.iter().filter(|s| !matches!(s, Station::Inside(_))).count();
        add_pieces(skin, line, index as u32, &stations, plan, &mut splits);
    }
    split_borders(skin, plan, splits);
    counts.hairs = plan.root.len() - before;
    counts
}

/// Length of a step on the rest skin.
fn length(skin: &Skin, step: &Step) -> f64 {
    let c = skin.mesh.corners(step.triangle);
    (0..3).map(|i| c[i] * (step.to[i] - step.from[i])).sum::<Vec3>().norm()
}

/// A point a fraction `f` along a step.
fn along(step: &Step, f: f64) -> SurfacePoint {
    let w: [f64; 3] = std::array::from_fn(|i| step.from[i] + (step.to[i] - step.from[i]) * f);
    SurfacePoint { triangle: step.triangle, bary: [w[1] as f32, w[2] as f32] }
}

/// `count` points at equal steps of arc length along a way, the first and the last at its ends; one: its middle. None of
/// an empty way.
pub(crate) fn evenly(skin: &Skin, steps: &[Step], count: usize) -> Vec<SurfacePoint> {
    let Some(last) = steps.last() else { return Vec::new() };
    let lengths: Vec<f64> = steps.iter().map(|s| length(skin, s)).collect();
    let total: f64 = lengths.iter().sum();
    let (mut i, mut before) = (0, 0.0);
    let place = |k: usize| {
        let target = total * if count == 1 { 0.5 } else { k as f64 / (count - 1) as f64 };
        while i + 1 < steps.len() && before + lengths[i] < target {
            before += lengths[i];
            i += 1;
        }
        let f = (target - before) / lengths[i].max(f64::MIN_POSITIVE);
        if count > 1 && k + 1 == count { along(last, 1.0) } else { along(&steps[i], f.clamp(0.0, 1.0)) }
    };
    (0..count).map(place).collect()
}

/// Stations of a parting: its ends, every seam, and between them points evenly spaced by about `spacing`.
fn stations(skin: &Skin, steps: &[Step], spacing: f64) -> Vec<Station> {
    let last = steps.len() - 1;
    let mut out = vec![Station::Inside(along(&steps[0], 0.0))];
    let mut first = 0;
    for i in 0..=last {
        let seam = crossing(skin, &steps[i]);
        if seam.is_none() && i < last {
            continue;
        }
        let run = &steps[first..=i];
        let free = first == 0 && seam.is_none();
        let total: f64 = run.iter().map(|s| length(skin, s)).sum();
        let parts = ((total / spacing).round() as usize).max(if free { 2 } else { 1 });
        let (mut k, mut before) = (1, 0.0);
        for s in run {
            let here = length(skin, s);
            while k < parts && total * k as f64 / parts as f64 <= before + here {
                let f = (total * k as f64 / parts as f64 - before) / here.max(f64::MIN_POSITIVE);
                out.push(Station::Inside(along(s, f.clamp(0.0, 1.0))));
                k += 1;
            }
            before += here;
        }
        let welded = |k: u32| skin.topology.chart_vertex[k as usize].vertex;
        match (out.last_mut(), seam) {
            // Round a vertex over several borders: one station.
            (Some(Station::Vertex { into: Some(x), .. }), Some(Station::Vertex { out: y, into: Some(z) }))
                if welded(*x) == welded(y) =>
            {
                *x = z;
            }
            _ => out.push(seam.unwrap_or_else(|| Station::Inside(along(&steps[last], 1.0)))),
        }
        first = i + 1;
    }
    out
}

/// How the way leaves a triangle, if that is across a border of its chart.
fn crossing(skin: &Skin, step: &Step) -> Option<Station> {
    let topology = skin.topology;
    let (i, f) = step.exit.filter(|e| topology.is_border(step.triangle, e.0))?;
    let beyond = topology.across(step.triangle, i);
    if !(SNAP..=1.0 - SNAP).contains(&f) {
        let end = usize::from(f > 0.5);
        let corner = |t: u32, i: usize| topology.corner[t as usize][i % 3];
        let into = beyond.map(|(n, j)| corner(n, j + 1 - end));
        return Some(Station::Vertex { out: corner(step.triangle, i + end), into });
    }
    Some(Station::Seam { out: (step.triangle, i, f), into: beyond.map(|(n, j)| (n, j, 1.0 - f)) })
}

/// A polyline near the skin as a way over it, and whether it was followed to its end. Its points move to the nearest
/// points of the skin; between two of them the way is the cut of the plane through both that holds the mean of their
/// normals.
pub(crate) fn trace(skin: &Skin, bvh: &Bvh, line: &[Vec3]) -> (Vec<Step>, bool) {
    let mut out: Vec<Step> = Vec::new();
    // A little inside their triangles, so that the plane cuts them.
    let inward = |p: SurfacePoint| {
        let w = p.weights().map(|w| w.max(1e-5));
        (p.triangle, w.map(|x| x / (w[0] + w[1] + w[2])))
    };
    let bound: Vec<_> = line.iter().filter_map(|&p| bvh.closest(p, f64::INFINITY)).map(|c| inward(c.point)).collect();
    for leg in bound.windows(2) {
        if leg[0] == leg[1] {
            continue;
        }
        if !walk(skin, leg[0], leg[1], &mut out) {
            return (out, false);
        }
    }
    (out, true)
}

/// Adds the steps of one leg; false if it does not arrive.
fn walk(skin: &Skin, from: (u32, [f64; 3]), to: (u32, [f64; 3]), out: &mut Vec<Step>) -> bool {
    let at = |(t, w): (u32, [f64; 3])| skin.mesh.corners(t).iter().zip(w).map(|(c, w)| c * w).sum::<Vec3>();
    let normal =
        |(t, w): (u32, [f64; 3])| skin.frame(&SurfacePoint { triangle: t, bary: [w[1] as f32, w[2] as f32] }).n;
    let (a, b) = (at(from), at(to));
    let plane = (b - a).cross(&(normal(from) + normal(to)));
    let (mut t, mut w, mut entry) = (from.0, from.1, None);
    for _ in 0..skin.mesh.triangle.len() {
        if t == to.0 {
            out.push(Step { triangle: t, from: w, to: to.1, exit: None });
            return true;
        }
        let corner = skin.mesh.corners(t);
        let side = corner.map(|c| plane.dot(&(c - a)));
        // A vertex on the plane counts as above it, for all its triangles: the way never runs through a vertex.
        let cut = |i: usize| (side[i] >= 0.0) != (side[(i + 1) % 3] >= 0.0) && Some(i) != entry;
        let point = |i: usize| {
            let f = side[i] / (side[i] - side[(i + 1) % 3]);
            (f, corner[i] + (corner[(i + 1) % 3] - corner[i]) * f)
        };
        let ahead = |i: &usize| (point(*i).1 - a).dot(&(b - a));
        let Some(i) = (0..3).filter(|&i| cut(i)).max_by(|i, j| ahead(i).total_cmp(&ahead(j))) else { return false };
        let f = point(i).0;
        let mut leave = [0.0; 3];
        leave[i] = 1.0 - f;
        leave[(i + 1) % 3] = f;
        out.push(Step { triangle: t, from: w, to: leave, exit: Some((i, f)) });
        let Some((n, j)) = skin.topology.across(t, i) else { return false };
        (t, entry, w) = (n, Some(j), [0.0; 3]);
        w[j] = f;
        w[(j + 1) % 3] = 1.0 - f;
    }
    false
}

/// Sites and hairs of the stations of one parting, cut into pieces at seams.
fn add_pieces(
    skin: &Skin,
    line: &[Vec3],
    parting: u32,
    stations: &[Station],
    plan: &mut Plan,
    splits: &mut Vec<Split>,
) {
    let chart = |t: u32| skin.topology.chart[t as usize];
    let mut piece = PartingPiece { parting, ..PartingPiece::default() };
    for (k, station) in stations.iter().enumerate() {
        let end = k == 0 || k + 1 == stations.len();
        match *station {
            Station::Inside(p) => {
                let hair = if end { [plan.hair(p, 0, parting, false, NONE); 2] } else { pair(plan, p, parting, false) };
                piece.chart = chart(p.triangle);
                piece.site.push(plan.sites.push(piece.chart, skin.uv(&p), hair));
            }
            Station::Seam { out, into } => {
                let sides = [Some(out), into].map(|e| e.map(|(t, i, f)| on_edge(t, i, f)));
                let lowest = sides.into_iter().flatten().min_by_key(|p| chart(p.triangle)).unwrap_or_default();
                let hair = pair(plan, lowest, parting, true);
                for ((triangle, edge, fraction), p) in
                    [Some(out), into].into_iter().flatten().zip(sides.into_iter().flatten())
                {
                    let site = plan.sites.push(chart(triangle), skin.uv(&p), hair);
                    splits.push(Split { triangle, edge, fraction, site });
                    piece.site.push(site);
                    if (triangle, edge) == (out.0, out.1) {
                        plan.sites.partings.push(std::mem::take(&mut piece));
                        piece.parting = parting;
                    } else {
                        piece.chart = chart(triangle);
                    }
                }
            }
            Station::Vertex { out, into } => {
                double_vertex(skin, line, parting, [Some(out), into], plan);
                piece.site.push(plan.site_of[out as usize]);
                plan.sites.partings.push(std::mem::take(&mut piece));
                piece.parting = parting;
                if let Some(k) = into {
                    piece.chart = skin.topology.chart_vertex[k as usize].chart;
                    piece.site.push(plan.site_of[k as usize]);
                }
            }
        }
    }
    plan.sites.partings.push(piece);
    plan.sites.partings.retain(|p| p.site.len() > 1);
}

/// The left and the right hair of an inner point.
fn pair(plan: &mut Plan, root: SurfacePoint, parting: u32, border: bool) -> [u32; 2] {
    [1, -1].map(|side| plan.hair(root, side, parting, border, NONE))
}

/// The point a fraction `f` along edge `i` of triangle `t`.
pub(crate) fn on_edge(t: u32, i: usize, f: f64) -> SurfacePoint {
    let mut w = [0.0; 3];
    w[i] = 1.0 - f;
    w[(i + 1) % 3] = f;
    SurfacePoint { triangle: t, bary: [w[1] as f32, w[2] as f32] }
}

/// Makes the hair of a border vertex the left one of a pair. Charts that the parting passes through there get the pair;
/// others touch the vertex from one side and get the hair of that side.
fn double_vertex(skin: &Skin, line: &[Vec3], parting: u32, through: [Option<u32>; 2], plan: &mut Plan) {
    let topology = skin.topology;
    let Some(first) = through[0] else { return };
    let left = plan.sites.hair[plan.site_of[first as usize] as usize][0];
    if plan.side[left as usize] != 0 {
        // A second parting through the same vertex: it shares the pair of the first.
        return;
    }
    let root = plan.root[left as usize];
    plan.side[left as usize] = 1;
    plan.parting[left as usize] = parting;
    let right = plan.hair(root, -1, parting, true, NONE);
    for k in topology.chart_vertices(topology.chart_vertex[first as usize].vertex) {
        let site = plan.site_of[k];
        if site == NONE {
            continue;
        }
        plan.sites.hair[site as usize] = if through.contains(&Some(k as u32)) {
            [left, right]
        } else {
            let triangles = topology.incident(k);
            let middle = |c: &u32| skin.mesh.corners(c / 3).iter().sum::<Vec3>() / 3.0;
            let at = triangles.iter().map(middle).sum::<Vec3>() / triangles.len() as f64;
            [if side_of(line, at, skin.frame(&root).n) >= 0 { left } else { right }; 2]
        };
    }
}

/// Puts the sites of crossings into the border edges they lie on.
fn split_borders(skin: &Skin, plan: &mut Plan, mut splits: Vec<Split>) {
    if splits.is_empty() {
        return;
    }
    splits.sort_by(|a, b| (a.triangle, a.edge).cmp(&(b.triangle, b.edge)).then(a.fraction.total_cmp(&b.fraction)));
    let mut out = Vec::with_capacity(plan.sites.border_edges.len() + splits.len());
    let topology = skin.topology;
    let edges = (0..topology.corner.len() as u32).flat_map(|t| (0..3).map(move |i| (t, i)));
    let borders = edges.filter(|&(t, i)| topology.is_border(t, i));
    for ((t, i), edge) in borders.zip(&plan.sites.border_edges) {
        let first = splits.partition_point(|s| (s.triangle, s.edge) < (t, i));
        let mut from = edge[0];
        for s in splits[first..].iter().take_while(|s| (s.triangle, s.edge) == (t, i)) {
            out.push([from, s.site]);
            from = s.site;
        }
        out.push([from, edge[1]]);
    }
    plan.sites.border_edges = out;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::{PlaceSettings, Placement, place};
    use crate::test_skin::TestSkin;

    fn settings<'a>(partings: &'a [Vec<Vec3>]) -> PlaceSettings<'a> {
        let placement = Placement::Grid { u: 8, v: 8, even: false };
        PlaceSettings { placement, length: 3.0, partings, ..PlaceSettings::default() }
    }

    /// Points on the sphere of radius 10 by longitude and latitude, degrees.
    fn arc(from: [f64; 2], to: [f64; 2]) -> Vec<Vec3> {
        let on = |[a, b]: [f64; 2]| {
            let (a, b) = (a.to_radians(), b.to_radians());
            Vec3::new(libm::cos(b) * libm::cos(a), libm::sin(b), -libm::cos(b) * libm::sin(a)) * 10.0
        };
        (0..=6).map(|k| f64::from(k) / 6.0).map(|t| on([0, 1].map(|i| from[i] + (to[i] - from[i]) * t))).collect()
    }

    #[test]
    fn a_parting_inside_a_chart_is_pairs_between_two_single_ends() {
        let s = TestSkin::new(48, 24, 0.5);
        let lines = [arc([40.0, 10.0], [130.0, 35.0])];
        let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(&lines));
        assert_eq!(counts.partings, PartingCounts { hairs: counts.partings.hairs, ..PartingCounts::default() });
        assert_eq!(sites.partings.len(), 1);
        let site = &sites.partings[0].site;
        assert!((14..18).contains(&site.len()), "{}", site.len());
        assert_eq!(counts.partings.hairs, 2 * site.len() - 2);
        for (k, &x) in site.iter().enumerate() {
            let [l, r] = sites.hair[x as usize].map(|h| h as usize);
            let end = k == 0 || k + 1 == site.len();
            assert_eq!((hairs.side[l], hairs.side[r], hairs.parting[l]), if end { (0, 0, 0) } else { (1, -1, 0) });
            assert_eq!((l == r, hairs.root[l]), (end, hairs.root[r]));
            assert_eq!(sites.chart[x as usize], sites.partings[0].chart);
        }
        let at = |x: u32| s.mesh.point(&hairs.root[sites.hair[x as usize][0] as usize]);
        let gap: Vec<f64> = site.windows(2).map(|w| (at(w[1]) - at(w[0])).norm()).collect();
        assert!(gap.iter().all(|g| (0.85..1.1).contains(g)), "{gap:?}");
    }

    #[test]
    fn a_parting_over_a_seam_shares_its_hairs_and_splits_both_borders() {
        let s = TestSkin::new(48, 24, 0.5);
        let plain = place(&s.skin(), &s.bvh, &settings(&[])).1;
        let lines = [arc([150.0, 12.0], [215.0, 31.0])];
        let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(&lines));
        assert_eq!(counts.partings.seam_crossings, 1);
        assert_eq!(sites.partings.len(), 2);
        let [a, b] = [&sites.partings[0], &sites.partings[1]];
        assert_ne!(a.chart, b.chart);
        let (x, y) = (a.site[a.site.len() - 1], b.site[0]);
        assert_eq!(sites.hair[x as usize], sites.hair[y as usize]);
        assert_ne!(sites.hair[x as usize][0], sites.hair[x as usize][1]);
        assert!(sites.hair[x as usize].iter().all(|&h| hairs.border[h as usize]));
        assert_eq!(sites.border_edges.len(), plain.border_edges.len() + 2);
        for site in [x, y] {
            let after = sites.border_edges.iter().find(|e| e[0] == site).unwrap()[1];
            let before = sites.border_edges.iter().find(|e| e[1] == site).unwrap()[0];
            assert!(plain.border_edges.contains(&[before, after]));
            let uv = [before, site, after].map(|k| sites.uv[k as usize].map(f64::from));
            let cross = (uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) - (uv[1][1] - uv[0][1]) * (uv[2][0] - uv[0][0]);
            assert!(cross.abs() < 1e-7, "on its edge");
        }
    }

    #[test]
    fn a_parting_through_a_vertex_of_a_seam_doubles_its_hair() {
        let s = TestSkin::new(48, 24, 0.0);
        // Latitude 15 degrees is a row of vertices, longitude 180 the seam.
        let on = |a: f64| arc([a, 15.0], [a, 15.0])[0];
        let lines = [vec![on(165.0), on(180.0), on(195.0)]];
        let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(&lines));
        assert_eq!((counts.partings.seam_crossings, sites.partings.len()), (1, 2));
        assert_eq!(sites.border_edges.len(), place(&s.skin(), &s.bvh, &settings(&[])).1.border_edges.len());
        let x = sites.partings[1].site[0] as usize;
        let [l, r] = sites.hair[x].map(|h| h as usize);
        assert_eq!((hairs.side[l], hairs.side[r], hairs.root[l]), (1, -1, hairs.root[r]));
        assert!((s.mesh.point(&hairs.root[l]) - on(180.0)).norm() < 1e-9);
    }

    #[test]
    fn combing_one_side_leaves_the_other_copy_as_it_is() {
        use crate::comb::{CombKind, CombOp, comb, side_of};
        let s = TestSkin::new(48, 24, 0.5);
        let lines = [arc([40.0, 10.0], [130.0, 35.0])];
        let (mut hairs, _, _) = place(&s.skin(), &s.bvh, &settings(&lines));
        let before = hairs.clone();
        let kind = CombKind::Bend { angle: 50.0.into(), map: None, curvature: 0.5.into() };
        comb(
            &s.skin(),
            &lines,
            &[CombOp { kind, weight: 1.0.into(), region: None, side: Some((0, -1)), only: None }],
            &mut hairs,
        );
        for h in 0..hairs.len() {
            let f = s.skin().frame(&hairs.root[h]);
            let on_line = hairs.parting[h] == 0;
            let side = if on_line { hairs.side[h] } else { side_of(&lines[0], f.origin, f.n) };
            assert_eq!(before.hair(h) == hairs.hair(h), side == 1, "hair {h}, side {side}");
        }
    }

    #[test]
    fn partings_without_length_or_beyond_the_skin_are_counted() {
        let s = TestSkin::new(24, 12, 0.5);
        let lines = [vec![Vec3::new(20.0, 1.0, 2.0)], vec![], arc([40.0, 10.0], [60.0, 12.0])];
        let counts = place(&s.skin(), &s.bvh, &settings(&lines)).2;
        assert_eq!((counts.partings.skipped, counts.partings.cut_short), (2, 0));
    }

    #[test]
    fn a_way_over_the_skin_is_connected() {
        let s = TestSkin::new(48, 24, 1.0);
        let (steps, complete) = trace(&s.skin(), &s.bvh, &arc([10.0, -40.0], [300.0, 50.0]));
        assert!(complete && steps.len() > 40);
        let at = |t: u32, w: [f64; 3]| s.mesh.corners(t).iter().zip(w).map(|(c, w)| c * w).sum::<Vec3>();
        for w in steps.windows(2) {
            assert!((at(w[0].triangle, w[0].to) - at(w[1].triangle, w[1].from)).norm() < 1e-9);
            assert!(w[0].to.iter().chain(&w[0].from).all(|x| (-1e-9..1.0 + 1e-9).contains(x)));
        }
    }
}
