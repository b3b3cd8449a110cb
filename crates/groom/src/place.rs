//! Placement of control hairs on a skin.
//!
//! "Course notes 2003, A production pipeline for hair", §3.2: by counts in u and v (equal there or in arc length), by
//! count per area, or as drawn, and besides these along curves on the surface and one by one; by default straight along
//! the normal. Roots may push each other apart (§5: placement by particle repulsion). Its seam step, on triangle meshes: every vertex of a chart's border carries a hair,
//! once for all charts that meet there, so that both sides of a seam blend the same hairs.

use crate::cells::Cells;
use crate::comb::side_of;
use crate::control::{ControlHairs, Sites, Skin, to_local, vec3};
use crate::near::Near;
use crate::parting::{PartingCounts, add_partings, evenly, trace};
use crate::place_grid::{even_roots, grid_roots};
use crate::place_relax::{chart_areas, relax};
use pelage_geom::curve::resample;
use pelage_geom::{Bvh, NONE, Strands, SurfacePoint, TiledMap, Vec3};
use rayon::prelude::*;

/// Inner control hairs nearer than this part of their mean spacing to a border or parting hair are dropped. Above half
/// the spacing a visible strip along every border is left to the border hairs alone; near 0 the triangulation gets
/// slivers, over which the direction jumps from one hair to another within a hair's width.
pub const BORDER_GAP: f64 = 0.35;

/// Drawn hairs shorter than this part of the mean length are strays of an export and carry no direction.
const TOO_SHORT: f64 = 1e-3;

/// Where the inner control hairs stand.
#[derive(Clone, Copy, Debug, Default)]
pub enum Placement<'a> {
    /// Nowhere.
    #[default]
    None,
    /// On every chart, v rows of u hairs.
    Grid {
        /// Hairs in a row.
        u: usize,
        /// Rows.
        v: usize,
        /// False: the centres of u x v equal cells over the chart's texture coordinates, where they fall inside. True:
        /// equally spaced by arc length, rows along the chart's middle column and hairs along each row.
        even: bool,
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

/// Hairs along a curve on the skin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Line {
    /// The curve as a polyline near the skin, rest scene space; followed as partings are.
    pub points: Vec<Vec3>,
    /// Hairs at equal steps of its arc length on the skin, the first and the last at its ends; one stands in its middle.
    pub count: usize,
}

/// A hair placed by hand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Single {
    /// Its root: the point of the skin nearest to this one, rest scene space.
    pub at: Vec3,
    /// Its shape, root first, scene units; moved so that it begins at the root. Without one it stands along the normal.
    pub line: Option<Vec<Vec3>>,
}

/// Settings of [`place`].
#[derive(Clone, Copy, Debug)]
pub struct PlaceSettings<'a> {
    /// Where the inner hairs stand.
    pub placement: Placement<'a>,
    /// Hairs along curves, besides those. Like those placed one by one they stay however near to others they stand;
    /// inner ones near them are dropped. At the texture coordinates of another hair the earlier of both counts.
    pub lines: &'a [Line],
    /// Hairs placed one by one, besides those.
    pub single: &'a [Single],
    /// Rounds in which the inner hairs (drawn ones excepted) push each other apart; about 30 even random roots out.
    pub relax: usize,
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

impl Default for PlaceSettings<'_> {
    /// Border hairs alone, of the paper's 4 points, one scene unit long.
    fn default() -> Self {
        PlaceSettings {
            placement: Placement::None,
            lines: &[],
            single: &[],
            relax: 0,
            points: 4,
            length: 1.0,
            length_map: None,
            partings: &[],
            parting_spacing: 1.0,
        }
    }
}

/// What placement found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaceCounts {
    /// Hairs on borders and seams.
    pub border: usize,
    /// Hairs inside charts.
    pub inner: usize,
    /// Inner hairs dropped because they stood too near to a border, a parting, a hair of a line or one placed by hand, or
    /// (drawn ones) each other.
    pub dropped: usize,
    /// Hairs of a grid that find no place: cells whose centre lies outside their chart, rows that miss it.
    pub outside: usize,
    /// Hairs along lines.
    pub on_lines: usize,
    /// Lines that could not be followed to their end over the skin; their hairs stand on the part before.
    pub lines_cut_short: usize,
    /// Lines left out because they have no length on the skin.
    pub lines_skipped: usize,
    /// Hairs placed one by one.
    pub single: usize,
    /// Hairs to be placed one by one that find no point of the skin (coordinates that are not finite).
    pub single_skipped: usize,
    /// Hairs placed one by one whose line has no length or is not finite; they stand along the normal.
    pub single_straight: usize,
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
    /// Which of the hairs placed one by one it is, or [`NONE`].
    pub single: Vec<u32>,
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
        self.single.push(NONE);
        (self.root.len() - 1) as u32
    }
}

/// Places control hairs: those of borders first, then of partings, those placed one by one, those along lines, and the
/// inner ones. `bvh` is that of the rest pose.
pub fn place(skin: &Skin, bvh: &Bvh, settings: &PlaceSettings) -> (ControlHairs, Sites, PlaceCounts) {
    assert!(settings.points >= 2, "a control hair has at least two points");
    let mut counts = PlaceCounts::default();
    let mut plan = Plan::default();
    place_borders(skin, &mut plan);
    counts.border = plan.root.len();
    counts.partings = add_partings(skin, bvh, settings.partings, settings.parting_spacing, &mut plan);
    add_singles(skin, bvh, settings.single, &mut plan, &mut counts);
    add_lines(skin, bvh, settings.lines, &mut plan, &mut counts);
    let drawn = match settings.placement {
        Placement::Curves { drawn, .. } => bind(skin, bvh, drawn, settings.points, &mut counts),
        _ => Vec::new(),
    };
    place_inner(skin, bvh, settings, &drawn, &mut plan, &mut counts);
    let hairs = shape(skin, settings, &drawn, &plan, &mut counts);
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

/// A hair at the nearest point of the skin for each that is placed by hand.
fn add_singles(skin: &Skin, bvh: &Bvh, single: &[Single], plan: &mut Plan, counts: &mut PlaceCounts) {
    for (k, s) in single.iter().enumerate() {
        let finite = s.at.iter().all(|x| x.is_finite());
        let Some(hit) = bvh.closest(s.at, f64::INFINITY).filter(|_| finite) else {
            counts.single_skipped += 1;
            continue;
        };
        let hair = add_hair(skin, hit.point, NONE, plan);
        plan.single[hair as usize] = k as u32;
        counts.single += 1;
    }
}

/// Hairs at equal steps along each line.
fn add_lines(skin: &Skin, bvh: &Bvh, lines: &[Line], plan: &mut Plan, counts: &mut PlaceCounts) {
    for line in lines {
        let (steps, complete) = trace(skin, bvh, &line.points);
        counts.lines_cut_short += usize::from(!complete);
        counts.lines_skipped += usize::from(steps.is_empty());
        for root in evenly(skin, &steps, line.count) {
            add_hair(skin, root, NONE, plan);
            counts.on_lines += 1;
        }
    }
}

/// A hair within a chart, and its site.
fn add_hair(skin: &Skin, root: SurfacePoint, drawn: u32, plan: &mut Plan) -> u32 {
    let hair = plan.hair(root, 0, NONE, false, drawn);
    plan.sites.push(skin.topology.chart[root.triangle as usize], skin.uv(&root), [hair; 2]);
    hair
}

/// Inner roots that keep their distance from all hairs so far (drawn ones also from each other).
fn place_inner(
    skin: &Skin,
    bvh: &Bvh,
    settings: &PlaceSettings,
    drawn: &[Drawn],
    plan: &mut Plan,
    counts: &mut PlaceCounts,
) {
    let mesh = skin.mesh;
    let (roots, gap): (Vec<SurfacePoint>, Vec<f64>) = match settings.placement {
        Placement::None => return,
        Placement::Grid { u, v, even } => {
            let (roots, outside) = if even { even_roots(skin, u, v) } else { grid_roots(skin, u, v) };
            counts.outside = outside;
            let area = chart_areas(skin);
            (roots, area.iter().map(|a| BORDER_GAP * (a / (u * v).max(1) as f64).sqrt()).collect())
        }
        Placement::PerArea { density, root } => {
            (root.to_vec(), vec![BORDER_GAP / density.max(f64::MIN_POSITIVE).sqrt(); skin.topology.charts])
        }
        Placement::Curves { spacing, .. } => {
            (drawn.iter().map(|d| d.root).collect(), vec![spacing; skin.topology.charts])
        }
    };
    // Roots at one point would be one site: never nearer than a millionth of the mesh.
    let (low, high) = mesh.bounds();
    let least = 1e-6 * (Vec3::from(high) - Vec3::from(low)).norm();
    let widest = gap.iter().copied().filter(|g| g.is_finite()).fold(least, f64::max);
    let mut taken = Cells::new(widest);
    plan.root.iter().for_each(|p| taken.insert(mesh.point(p)));
    let (mut kept, mut own) = (Vec::new(), Vec::new());
    for (i, root) in roots.iter().enumerate() {
        let at = mesh.point(root);
        let chart = skin.topology.chart[root.triangle as usize];
        if taken.any_within(at, gap[chart as usize].clamp(least, widest)) {
            counts.dropped += 1;
            continue;
        }
        if !drawn.is_empty() {
            taken.insert(at);
        }
        kept.push(*root);
        own.push(if drawn.is_empty() { NONE } else { i as u32 });
    }
    if drawn.is_empty() {
        let still = plan.root.iter().zip(&plan.border).filter(|(_, border)| !**border).map(|(p, _)| *p);
        relax(skin, bvh, &still.collect::<Vec<_>>(), settings.relax, &mut kept);
    }
    for (root, own) in kept.iter().zip(own) {
        add_hair(skin, *root, own, plan);
        counts.inner += 1;
    }
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
fn shape(
    skin: &Skin,
    settings: &PlaceSettings,
    drawn: &[Drawn],
    plan: &Plan,
    counts: &mut PlaceCounts,
) -> ControlHairs {
    let points = settings.points;
    let by_hand: Vec<Option<Vec<Vec3>>> = settings.single.iter().map(|s| by_hand(s, points)).collect();
    let local: Vec<Vec<Vec3>> = (0..plan.root.len())
        .into_par_iter()
        .map(|h| {
            let root = &plan.root[h];
            let frame = skin.frame(root);
            let world = |line: &[Vec3]| line.iter().map(|&p| to_local(&frame, p)).collect();
            if plan.drawn[h] != NONE {
                return world(&drawn[plan.drawn[h] as usize].line);
            }
            let single = by_hand.get(plan.single[h] as usize);
            if let Some(Some(line)) = single {
                return world(line);
            }
            if !drawn.is_empty() && single.is_none() {
                let parting = settings.partings.get(plan.parting[h] as usize).filter(|_| plan.side[h] != 0);
                let one_side = |d: &Drawn| parting.is_none_or(|p| side_of(p, d.at, frame.n) == plan.side[h]);
                return world(&blend_nearest(drawn, frame.origin, one_side));
            }
            let factor = settings.length_map.map_or(1.0, |m| f64::from(m.value(skin.uv(root)))).max(1e-3);
            let step = settings.length * factor / (points - 1) as f64;
            (0..points).map(|k| Vec3::x() * (k as f64 * step)).collect()
        })
        .collect();
    let straight = |s: &&u32| by_hand.get(**s as usize).is_some_and(Option::is_none);
    let asked = |s: &&u32| settings.single[**s as usize].line.is_some();
    counts.single_straight = plan.single.iter().filter(straight).filter(asked).count();
    let mut hairs = ControlHairs { points, ..ControlHairs::default() };
    for (root, local) in plan.root.iter().zip(&local) {
        hairs.push(*root, local);
    }
    hairs.side.clone_from(&plan.side);
    hairs.parting.clone_from(&plan.parting);
    hairs.border.clone_from(&plan.border);
    hairs.single.clone_from(&plan.single);
    hairs
}

/// Points of a hair placed by hand relative to its root, world directions, resampled; `None` without a shape.
fn by_hand(single: &Single, points: usize) -> Option<Vec<Vec3>> {
    let line = single.line.as_ref()?;
    let length: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let shaped = length > 0.0 && length.is_finite();
    shaped.then(|| resample(line, points).iter().map(|p| p - line[0]).collect())
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

#[cfg(test)]
#[path = "place_tests.rs"]
mod tests;
