//! Placement of control hairs on a skin.
//!
//! "Course notes 2003, A production pipeline for hair", §3.2: by counts in u and v, by count per area, or as drawn; by
//! default straight along the normal. Its seam step, on triangle meshes: every vertex of a chart's border carries a hair,
//! once for all charts that meet there, so that both sides of a seam blend the same hairs.

use crate::comb::side_of;
use crate::control::{ControlHairs, Sites, Skin, to_local, vec3};
use crate::near::Near;
use crate::parting::{PartingCounts, add_partings};
use pelage_geom::curve::resample;
use pelage_geom::{Bvh, NONE, Strands, SurfacePoint, TiledMap, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Inner control hairs nearer than this part of their mean spacing to a border or parting hair are dropped. Above half
/// the spacing a visible strip along every border is left to the border hairs alone; near 0 the triangulation gets
/// slivers, over which the direction jumps from one hair to another within a hair's width.
pub const BORDER_GAP: f64 = 0.35;

/// Drawn hairs shorter than this part of the mean length are strays of an export and carry no direction.
const TOO_SHORT: f64 = 1e-3;

/// Where the inner control hairs stand.
#[derive(Clone, Copy, Debug)]
pub enum Placement<'a> {
    /// On every chart, the centres of u x v equal cells over its texture coordinates, where they fall inside.
    Grid {
        /// Cells along u.
        u: usize,
        /// Cells along v.
        v: usize,
    },
    /// At given roots, evenly spread over the area (the first of a blue-noise sequence).
    PerArea {
        /// Hairs per square scene unit, from which the gap to the border follows.
        density: f64,
        /// The roots.
        root: &'a [SurfacePoint],
    },
    /// Where curves drawn elsewhere stand, in their shapes: each is moved onto the nearest point of the skin.
    Curves {
        /// The curves, rest scene space.
        drawn: &'a Strands,
        /// Curves nearer than this to one before them, to the border or to a parting are left out, scene units.
        spacing: f64,
    },
}

/// Settings of [`place`].
#[derive(Clone, Copy, Debug)]
pub struct PlaceSettings<'a> {
    /// Where the inner hairs stand.
    pub placement: Placement<'a>,
    /// Points per hair, at least 2; the paper's default is 4.
    pub points: usize,
    /// Length of hairs that are not drawn, scene units.
    pub length: f64,
    /// Map multiplied onto it; not below 1/1000, so that every hair keeps a direction.
    pub length_map: Option<&'a TiledMap>,
    /// Partings as polylines near the skin, rest scene space.
    pub partings: &'a [Vec<Vec3>],
    /// Distance between control hairs along a parting, scene units.
    pub parting_spacing: f64,
}

/// What placement found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaceCounts {
    /// Hairs on borders and seams.
    pub border: usize,
    /// Hairs inside charts.
    pub inner: usize,
    /// Inner hairs dropped because they stood too near to a border, a parting or (drawn ones) each other.
    pub dropped: usize,
    /// Grid cells whose centre lies outside their chart.
    pub outside: usize,
    /// Drawn hairs without length or with less than two points.
    pub skipped_short: usize,
    /// Mean distance of drawn roots from the skin before they were moved onto it, scene units.
    pub bind_mean: f64,
    /// Largest such distance, scene units.
    pub bind_max: f64,
    /// Partings.
    pub partings: PartingCounts,
}

/// Hairs and sites before the hairs have a shape.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    pub root: Vec<SurfacePoint>,
    pub side: Vec<i8>,
    pub parting: Vec<u32>,
    pub border: Vec<bool>,
    /// Drawn hair that gives the shape, or [`NONE`].
    pub drawn: Vec<u32>,
    pub sites: Sites,
    /// Chart vertex -> site, or [`NONE`].
    pub site_of: Vec<u32>,
}

impl Plan {
    /// Adds a hair and returns its index.
    pub fn hair(&mut self, root: SurfacePoint, side: i8, parting: u32, border: bool, drawn: u32) -> u32 {
        self.root.push(root);
        self.side.push(side);
        self.parting.push(parting);
        self.border.push(border);
        self.drawn.push(drawn);
        (self.root.len() - 1) as u32
    }
}

/// Places control hairs: those of borders first, then of partings, then the inner ones. `bvh` is that of the rest pose.
pub fn place(skin: &Skin, bvh: &Bvh, settings: &PlaceSettings) -> (ControlHairs, Sites, PlaceCounts) {
    assert!(settings.points >= 2, "a control hair has at least two points");
    let mut counts = PlaceCounts::default();
    let mut plan = Plan::default();
    place_borders(skin, &mut plan);
    counts.border = plan.root.len();
    counts.partings = add_partings(skin, bvh, settings.partings, settings.parting_spacing, &mut plan);
    let drawn = match settings.placement {
        Placement::Curves { drawn, .. } => bind(skin, bvh, drawn, settings.points, &mut counts),
        _ => Vec::new(),
    };
    place_inner(skin, settings, &drawn, &mut plan, &mut counts);
    let hairs = shape(skin, settings, &drawn, &plan);
    (hairs, plan.sites, counts)
}

/// One hair per welded border vertex, rooted in its lowest chart; one site per border vertex of each chart.
fn place_borders(skin: &Skin, plan: &mut Plan) {
    let topology = skin.topology;
    plan.site_of = vec![NONE; topology.chart_vertex.len()];
    let mut here: Option<(u32, u32)> = None;
    for (k, cv) in topology.chart_vertex.iter().enumerate().filter(|(_, cv)| cv.border) {
        let hair = match here {
            Some((vertex, hair)) if vertex == cv.vertex => hair,
            _ => {
                let corner = topology.incident(k)[0];
                let bary = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][corner as usize % 3];
                plan.hair(SurfacePoint { triangle: corner / 3, bary }, 0, NONE, true, NONE)
            }
        };
        here = Some((cv.vertex, hair));
        plan.site_of[k] = plan.sites.push(cv.chart, cv.uv, [hair; 2]);
    }
    let site = |k: u32| plan.site_of[k as usize];
    plan.sites.border_edges = topology.border_edges().into_iter().map(|e| e.map(site)).collect();
}

/// Inner roots that keep their distance from all hairs so far (drawn ones also from each other).
fn place_inner(skin: &Skin, settings: &PlaceSettings, drawn: &[Drawn], plan: &mut Plan, counts: &mut PlaceCounts) {
    let mesh = skin.mesh;
    let chart = |p: &SurfacePoint| skin.topology.chart[p.triangle as usize];
    let grid;
    let drawn_roots: Vec<SurfacePoint>;
    let roots: &[SurfacePoint] = match settings.placement {
        Placement::Grid { u, v } => {
            (grid, counts.outside) = grid_roots(skin, u, v);
            &grid
        }
        Placement::PerArea { root, .. } => root,
        Placement::Curves { .. } => {
            drawn_roots = drawn.iter().map(|d| d.root).collect();
            &drawn_roots
        }
    };
    let gap: Vec<f64> = match settings.placement {
        Placement::Grid { u, v } => {
            let area = chart_areas(skin);
            area.iter().map(|a| BORDER_GAP * (a / (u * v).max(1) as f64).sqrt()).collect()
        }
        Placement::PerArea { density, .. } => {
            vec![BORDER_GAP / density.max(f64::MIN_POSITIVE).sqrt(); skin.topology.charts]
        }
        Placement::Curves { spacing, .. } => vec![spacing; skin.topology.charts],
    };
    // Roots at one point would be one site: never nearer than a millionth of the mesh.
    let (low, high) = mesh.bounds();
    let least = 1e-6 * (Vec3::from(high) - Vec3::from(low)).norm();
    let widest = gap.iter().copied().filter(|g| g.is_finite()).fold(least, f64::max);
    let mut taken = Cells::new(widest);
    plan.root.iter().for_each(|p| taken.insert(mesh.point(p)));
    for (i, root) in roots.iter().enumerate() {
        let at = mesh.point(root);
        if taken.any_within(at, gap[chart(root) as usize].clamp(least, widest)) {
            counts.dropped += 1;
            continue;
        }
        let own = if drawn.is_empty() { NONE } else { i as u32 };
        if own != NONE {
            taken.insert(at);
        }
        let hair = plan.hair(*root, 0, NONE, false, own);
        plan.sites.push(chart(root), skin.uv(root), [hair; 2]);
        counts.inner += 1;
    }
}

/// Rest areas of the charts, square scene units.
fn chart_areas(skin: &Skin) -> Vec<f64> {
    let mut area = vec![0.0; skin.topology.charts];
    for (c, a) in skin.topology.chart.iter().zip(&skin.topology.area) {
        area[*c as usize] += a;
    }
    area
}

/// Centres of u x v cells over each chart's box in texture space, as points of the skin (where triangles overlap: of the
/// lowest); and how many centres lie outside. Chart by chart, rows of rising v.
fn grid_roots(skin: &Skin, u: usize, v: usize) -> (Vec<SurfacePoint>, usize) {
    let (mesh, topology) = (skin.mesh, skin.topology);
    let mut bounds = vec![([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]); topology.charts];
    for cv in &topology.chart_vertex {
        let (low, high) = &mut bounds[cv.chart as usize];
        for i in 0..2 {
            low[i] = low[i].min(f64::from(cv.uv[i]));
            high[i] = high[i].max(f64::from(cv.uv[i]));
        }
    }
    let mut found: Vec<Option<SurfacePoint>> = vec![None; topology.charts * u * v];
    for t in 0..mesh.triangle.len() {
        if topology.flat_uv[t] {
            continue;
        }
        let chart = topology.chart[t] as usize;
        let (low, high) = bounds[chart];
        let size = [(high[0] - low[0]) / u as f64, (high[1] - low[1]) / v as f64];
        let uv = mesh.corner_uv[t].map(|c| c.map(f64::from));
        let range = |i: usize, n: usize| {
            let of = |x: f64| (x - low[i]) / size[i] - 0.5;
            let (a, b) = (
                uv.iter().map(|c| of(c[i])).fold(f64::MAX, f64::min),
                uv.iter().map(|c| of(c[i])).fold(f64::MIN, f64::max),
            );
            // One cell more on both sides, for rounding; the triangle decides.
            (a.ceil() as i64 - 1).max(0) as usize..(b.floor() as i64 + 2).clamp(0, n as i64) as usize
        };
        for j in range(1, v) {
            for i in range(0, u) {
                let at = [low[0] + (i as f64 + 0.5) * size[0], low[1] + (j as f64 + 0.5) * size[1]];
                let slot = &mut found[(chart * v + j) * u + i];
                if let (None, Some(bary)) = (&slot, barycentric(uv, at)) {
                    *slot = Some(SurfacePoint { triangle: t as u32, bary });
                }
            }
        }
    }
    let total = found.len();
    let roots: Vec<SurfacePoint> = found.into_iter().flatten().collect();
    let outside = total - roots.len();
    (roots, outside)
}

/// Weights of the second and third corner at a point of texture space; `None` outside.
fn barycentric(uv: [[f64; 2]; 3], at: [f64; 2]) -> Option<[f32; 2]> {
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let area = cross(uv[0], uv[1], uv[2]);
    let w = [cross(uv[1], uv[2], at), cross(uv[2], uv[0], at), cross(uv[0], uv[1], at)].map(|x| x / area);
    if w.iter().any(|&x| x.is_nan() || x < -1e-12) {
        return None;
    }
    let w = w.map(|x| x.max(0.0));
    let sum = w[0] + w[1] + w[2];
    Some([(w[1] / sum) as f32, (w[2] / sum) as f32])
}

/// A curve drawn elsewhere, on the skin.
struct Drawn {
    root: SurfacePoint,
    /// Its root on the rest skin.
    at: Vec3,
    /// Points relative to the root, world directions, resampled.
    line: Vec<Vec3>,
}

/// Moves drawn curves onto the nearest point of the skin and resamples them.
fn bind(skin: &Skin, bvh: &Bvh, drawn: &Strands, points: usize, counts: &mut PlaceCounts) -> Vec<Drawn> {
    let origin = Vec3::from(drawn.origin);
    let length = |s: usize| drawn.points(s).windows(2).map(|w| (vec3(w[1]) - vec3(w[0])).norm()).sum::<f64>();
    let lengths: Vec<f64> = (0..drawn.len()).into_par_iter().map(length).collect();
    let usable = |l: f64| l > 0.0 && l.is_finite();
    let total: f64 = lengths.iter().copied().filter(|&l| usable(l)).sum();
    let least = TOO_SHORT * total / lengths.iter().filter(|&&l| usable(l)).count().max(1) as f64;
    let bound: Vec<Option<(Drawn, f64)>> = (0..drawn.len())
        .into_par_iter()
        .map(|s| {
            if !usable(lengths[s]) || lengths[s] < least {
                return None;
            }
            let line: Vec<Vec3> = drawn.points(s).iter().map(|&p| vec3(p)).collect();
            let hit = bvh.closest(origin + line[0], f64::INFINITY)?;
            let line = resample(&line, points);
            let line = line.iter().map(|p| p - line[0]).collect();
            Some((Drawn { root: hit.point, at: skin.mesh.point(&hit.point), line }, hit.signed_distance.abs()))
        })
        .collect();
    let mut out = Vec::new();
    for (d, distance) in bound.into_iter().flatten() {
        counts.bind_mean += distance;
        counts.bind_max = counts.bind_max.max(distance);
        out.push(d);
    }
    counts.bind_mean /= out.len().max(1) as f64;
    counts.skipped_short = drawn.len() - out.len();
    out
}

/// Gives every planned hair its points.
fn shape(skin: &Skin, settings: &PlaceSettings, drawn: &[Drawn], plan: &Plan) -> ControlHairs {
    let points = settings.points;
    let local: Vec<Vec<Vec3>> = (0..plan.root.len())
        .into_par_iter()
        .map(|h| {
            let root = &plan.root[h];
            let frame = skin.frame(root);
            let world = |line: &[Vec3]| line.iter().map(|&p| to_local(&frame, p)).collect();
            if plan.drawn[h] != NONE {
                return world(&drawn[plan.drawn[h] as usize].line);
            }
            if !drawn.is_empty() {
                let parting = settings.partings.get(plan.parting[h] as usize).filter(|_| plan.side[h] != 0);
                let one_side = |d: &Drawn| parting.is_none_or(|p| side_of(p, d.at, frame.n) == plan.side[h]);
                return world(&blend_nearest(drawn, frame.origin, one_side));
            }
            let factor = settings.length_map.map_or(1.0, |m| f64::from(m.value(skin.uv(root)))).max(1e-3);
            let step = settings.length * factor / (points - 1) as f64;
            (0..points).map(|k| Vec3::x() * (k as f64 * step)).collect()
        })
        .collect();
    let mut hairs = ControlHairs { points, ..ControlHairs::default() };
    for (root, local) in plan.root.iter().zip(&local) {
        hairs.push(*root, local);
    }
    hairs.side.clone_from(&plan.side);
    hairs.parting.clone_from(&plan.parting);
    hairs.border.clone_from(&plan.border);
    hairs
}

/// A hair between drawn ones: the unit segment vectors and the length of the nearest, weighted by 1 / distance^2 in space,
/// world directions. Only drawn hairs that `accept` takes, unless it takes none.
fn blend_nearest(drawn: &[Drawn], at: Vec3, accept: impl Fn(&Drawn) -> bool) -> Vec<Vec3> {
    let near = Near::find(drawn.iter().map(|d| d.at), at, |i| accept(&drawn[i])).expect("there are drawn hairs");
    let nearest = &drawn[near.nearest()].line;
    if near.squared == 0.0 {
        return nearest.clone();
    }
    let length = |i: usize| drawn[i].line.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
    let step = near.mean(length) / (nearest.len() - 1) as f64;
    let mut out = vec![Vec3::zeros()];
    for s in 0..nearest.len() - 1 {
        let unit = |i: usize| (drawn[i].line[s + 1] - drawn[i].line[s]).try_normalize(0.0).unwrap_or_default();
        out.push(out[s] + near.direction(unit) * step);
    }
    out
}

/// Points in cubic cells, for "is anything this near".
struct Cells {
    size: f64,
    cell: BTreeMap<[i64; 3], Vec<Vec3>>,
}

impl Cells {
    /// `size` is the largest radius that will be asked for.
    fn new(size: f64) -> Self {
        Cells { size: size.max(f64::MIN_POSITIVE), cell: BTreeMap::new() }
    }

    fn key(&self, p: Vec3) -> [i64; 3] {
        [p.x, p.y, p.z].map(|x| (x / self.size).floor() as i64)
    }

    fn insert(&mut self, p: Vec3) {
        self.cell.entry(self.key(p)).or_default().push(p);
    }

    fn any_within(&self, p: Vec3, radius: f64) -> bool {
        let [x, y, z] = self.key(p);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])));
        around.filter_map(|c| self.cell.get(&c)).flatten().any(|q| (q - p).norm() <= radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolate::{Blend, interpolate, pose_controls, root_positions};
    use crate::test_skin::TestSkin;
    use pelage_geom::{Map, Offsets, Wrap, rng::uniform};

    fn settings(placement: Placement<'_>) -> PlaceSettings<'_> {
        PlaceSettings { placement, points: 4, length: 3.0, length_map: None, partings: &[], parting_spacing: 1.0 }
    }

    fn random_roots(s: &TestSkin, n: u64) -> Vec<SurfacePoint> {
        let t = |i| (uniform(1, i, 2, 0) * s.mesh.triangle.len() as f64) as u32;
        (0..n).map(|i| SurfacePoint { triangle: t(i), bary: [0.3, 0.2 + 0.3 * uniform(1, i, 2, 1) as f32] }).collect()
    }

    /// Hairs that go up and along x, different everywhere, with roots off the skin.
    fn drawn(s: &TestSkin, n: u64, off: f64) -> Strands {
        let roots = random_roots(s, n);
        let mut out =
            Strands { offsets: Offsets::uniform(n as usize, 6), origin: [1.0, 2.0, 3.0], ..Strands::default() };
        for (i, r) in roots.iter().enumerate() {
            let f = s.skin().frame(r);
            let curl = uniform(1, i as u64, 2, 2);
            for k in 0..6 {
                let t = f64::from(k);
                let p = f.origin + f.n * (off + 0.5 * t) + Vec3::new(0.1 * t * t * curl, 0.0, 0.1 * t);
                let p = p - Vec3::from(out.origin);
                out.position.push([p.x as f32, p.y as f32, p.z as f32]);
            }
        }
        out
    }

    #[test]
    fn every_border_vertex_has_one_hair_and_a_site_in_each_chart() {
        let s = TestSkin::new(24, 12, 1.0);
        let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(Placement::Grid { u: 6, v: 5 }));
        // Two meridians of 11 inner vertices and the poles.
        assert_eq!(counts.border, 24);
        assert!(hairs.border[..24].iter().all(|&b| b) && hairs.border[24..].iter().all(|&b| !b));
        assert_eq!(counts.inner + counts.dropped + counts.outside, 2 * 6 * 5);
        assert_eq!(hairs.len(), counts.border + counts.inner);
        let mut seen: Vec<(u32, [u32; 2])> = Vec::new();
        for cv in s.topology.chart_vertex.iter().filter(|cv| cv.border) {
            let k = (0..sites.len()).find(|&k| sites.chart[k] == cv.chart && sites.uv[k] == cv.uv).unwrap();
            seen.push((cv.vertex, sites.hair[k]));
            let at = Vec3::from(s.mesh.position[cv.vertex as usize]);
            assert!((s.mesh.point(&hairs.root[sites.hair[k][0] as usize]) - at).norm() < 1e-9);
        }
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 24, "one hair a border vertex");
    }

    #[test]
    fn default_hairs_stand_along_the_normal_with_the_length_of_the_map() {
        let s = TestSkin::new(24, 12, 1.0);
        let map = TiledMap {
            tiles: vec![(0, Map { width: 2, height: 1, channels: 1, data: vec![0.0, 2.0] })],
            wrap: Wrap::Clamp,
        };
        let with = PlaceSettings { length_map: Some(&map), ..settings(Placement::Grid { u: 5, v: 5 }) };
        let (hairs, _, _) = place(&s.skin(), &s.bvh, &with);
        for h in 0..hairs.len() {
            let expected = 3.0 * f64::from(map.value(s.mesh.uv(&hairs.root[h]))).max(1e-3);
            assert!((hairs.length(h) - expected).abs() < 1e-5 * expected);
            assert!(hairs.hair(h).iter().all(|p| p[1] == 0.0 && p[2] == 0.0 && p[0] >= 0.0));
        }
    }

    #[test]
    fn grid_cells_are_found_where_their_centres_are() {
        let s = TestSkin::new(24, 12, 0.0);
        let (roots, outside) = grid_roots(&s.skin(), 9, 5);
        assert_eq!(roots.len() + outside, 2 * 9 * 5);
        // The charts fill their boxes but for the corners at the poles, where no cell centre comes.
        assert_eq!(outside, 0);
        for (k, r) in roots.iter().enumerate() {
            let (chart, j, i) = (k / 45, k / 9 % 5, k % 9);
            assert_eq!(s.topology.chart[r.triangle as usize] as usize, chart);
            let low = if s.topology.chart[0] as usize == chart { 0.0 } else { 0.625 };
            let uv = s.mesh.uv(r).map(f64::from);
            assert!((uv[0] - (low + 0.375 * (i as f64 + 0.5) / 9.0)).abs() < 1e-6, "{uv:?}");
            assert!((uv[1] - (j as f64 + 0.5) / 5.0).abs() < 1e-6, "{uv:?}");
        }
    }

    #[test]
    fn inner_hairs_keep_their_distance_from_the_border() {
        let s = TestSkin::new(48, 24, 0.5);
        let roots = random_roots(&s, 500);
        let density = 0.4;
        let (hairs, sites, counts) = place(&s.skin(), &s.bvh, &settings(Placement::PerArea { density, root: &roots }));
        assert_eq!(counts.inner + counts.dropped, 500);
        assert!(counts.dropped > 5 && counts.dropped < 100, "{}", counts.dropped);
        let at = |h: usize| s.mesh.point(&hairs.root[h]);
        for h in counts.border..hairs.len() {
            let nearest = (0..counts.border).map(|b| (at(h) - at(b)).norm()).fold(f64::MAX, f64::min);
            assert!(nearest > BORDER_GAP / density.sqrt());
        }
        assert_eq!(sites.hair[sites.len() - 1], [hairs.len() as u32 - 1; 2]);
    }

    #[test]
    fn drawn_hairs_keep_their_shape_and_are_moved_onto_the_skin() {
        let s = TestSkin::new(24, 12, 0.5);
        let mut curves = drawn(&s, 60, -0.3);
        for k in 12..18 {
            curves.position[k] = curves.position[12];
        }
        let with = PlaceSettings { points: 6, ..settings(Placement::Curves { drawn: &curves, spacing: 0.0 }) };
        let (hairs, _, counts) = place(&s.skin(), &s.bvh, &with);
        assert_eq!((counts.skipped_short, counts.inner), (1, 59));
        assert!(counts.bind_max <= 0.3 + 1e-6 && counts.bind_mean > 0.2, "{counts:?}");
        for (h, strand) in (counts.border..hairs.len()).zip((0..60).filter(|&i| i != 2)) {
            let line = crate::comb::world_points(&s.skin().frame(&hairs.root[h]), hairs.hair(h));
            let source: Vec<Vec3> = curves.points(strand).iter().map(|&p| vec3(p)).collect();
            for (a, b) in line.iter().zip(resample(&source, 6)) {
                assert!(((a - line[0]) - (b - source[0])).norm() < 1e-5);
            }
        }
        // Border hairs lie between drawn ones: as long, outward.
        for h in 0..counts.border {
            assert!((1.5..6.0).contains(&hairs.length(h)) && hairs.hair(h)[1][0] > 0.2, "{:?}", hairs.hair(h));
        }
    }

    #[test]
    fn near_drawn_hairs_are_thinned() {
        let s = TestSkin::new(24, 12, 0.5);
        let curves = drawn(&s, 300, 0.1);
        let (hairs, _, counts) =
            place(&s.skin(), &s.bvh, &settings(Placement::Curves { drawn: &curves, spacing: 1.5 }));
        assert_eq!(counts.inner + counts.dropped, 300);
        let at: Vec<Vec3> = hairs.root.iter().map(|r| s.mesh.point(r)).collect();
        for h in counts.border..hairs.len() {
            assert!((0..h).all(|o| (at[h] - at[o]).norm() > 1.5));
        }
    }

    /// The seam step: a hair on a seam gets the same direction from the controls of either chart, in any pose.
    #[test]
    fn directions_agree_across_seams_in_every_pose() {
        let s = TestSkin::new(24, 12, 1.0);
        let curves = drawn(&s, 200, 0.1);
        let with = PlaceSettings { points: 6, ..settings(Placement::Curves { drawn: &curves, spacing: 0.5 }) };
        let (hairs, sites, _) = place(&s.skin(), &s.bvh, &with);
        let edge = |e: &[u32; 2]| e.map(|k| sites.hair[k as usize][0]);
        let mut tested = 0;
        for shear in [0.0, 0.7] {
            let pose = s.posed(|p| Vec3::new(p.x + shear * p.y, p.y * (1.0 + shear), p.z - shear * p.x * p.x * 0.1));
            let controls = pose_controls(&hairs, &s.mesh, &s.topology, &pose, 6);
            for a in &sites.border_edges {
                let chart = sites.chart[a[0] as usize];
                if chart != 0 {
                    continue;
                }
                // The same edge seen from the other chart runs the other way.
                let b = sites
                    .border_edges
                    .iter()
                    .find(|b| sites.chart[b[0] as usize] != chart && edge(b) == [edge(a)[1], edge(a)[0]])
                    .expect("the seam has two sides");
                let inner = |chart: u32| (0..sites.len()).rfind(|&k| sites.chart[k] == chart).unwrap();
                let third = [inner(0), inner(1)].map(|k| sites.hair[k][0]);
                let t = uniform(3, tested, 4, 0) as f32;
                let corner = [[edge(a)[0], edge(a)[1], third[0]], [edge(b)[0], third[1], edge(b)[1]]];
                let weight = [[1.0 - t, t, 0.0], [t, 0.0, 1.0 - t]];
                let blend = Blend { root: &[[0.0; 3]; 2], hair: &corner, weight: &weight, length: &[5.0; 2] };
                let mut out = [[0.0; 3]; 12];
                interpolate(&blend, &controls, &mut out);
                for k in 0..5 {
                    let [p, q] = [k, k + 6].map(|k| (vec3(out[k + 1]) - vec3(out[k])).normalize());
                    assert!(p.cross(&q).norm() < 1e-5 && p.dot(&q) > 0.0);
                }
                tested += 1;
            }
        }
        assert_eq!(tested, 2 * 24);
    }

    /// A rigid motion of the skin carries the hairs along.
    #[test]
    fn hairs_ride_a_rigid_motion() {
        let s = TestSkin::new(24, 12, 1.0);
        let curves = drawn(&s, 100, 0.1);
        let (hairs, _, counts) =
            place(&s.skin(), &s.bvh, &settings(Placement::Curves { drawn: &curves, spacing: 0.5 }));
        let axis = Vec3::new(1.0, -2.0, 0.5).normalize();
        let shift = Vec3::new(1000.0, -500.0, 20.0);
        let turn = |p: Vec3| crate::comb::rotate(p, axis, 1.1);
        let roots = random_roots(&s, 50);
        let n = counts.inner as u64;
        let pick = |i: u64, k| counts.border as u32 + (uniform(5, i, 6, k) * n as f64) as u32;
        let hair: Vec<[u32; 3]> = (0..50).map(|i| [pick(i, 0), pick(i, 1), pick(i, 2)]).collect();
        let run = |pose: &pelage_geom::Pose, origin: Vec3| {
            let controls = pose_controls(&hairs, &s.mesh, &s.topology, pose, 12);
            let root = root_positions(&s.mesh, pose, &roots, origin.into());
            for (r, p) in root.iter().zip(&roots) {
                let at = p.blend(pelage_geom::mesh::corners(&pose.position, s.mesh.triangle[p.triangle as usize]));
                assert!((vec3(*r) + origin - at).norm() < 1e-5);
            }
            let mut out = vec![[0.0; 3]; 50 * 12];
            let blend = Blend { root: &root, hair: &hair, weight: &[[0.3, 0.2, 0.5]; 50], length: &[4.0; 50] };
            interpolate(&blend, &controls, &mut out);
            out
        };
        let still = run(&s.rest, Vec3::zeros());
        let moved = run(&s.posed(|p| turn(p) + shift), shift);
        for (a, b) in still.iter().zip(&moved) {
            assert!((turn(vec3(*a)) - vec3(*b)).norm() < 1e-5 * 10.0, "{a:?} {b:?}");
        }
    }
}
