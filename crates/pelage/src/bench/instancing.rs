//! Instancing and interpolation: weights, seams, points of a hair, and how evenly hairs stand.

use super::plot::{Plot, Series};
use super::{Bench, Findings, Section, Study, machine, shots};
use crate::Error;
use crate::cli::Sample;
use crate::progress::Progress;
use crate::stage::{Runner, Skin, comb, groom, instance};
use pelage_geom::curve::resample;
use pelage_geom::{Map, NONE, SurfacePoint, TiledMap, Vec3, Wrap, rng, shapes};
use pelage_groom::candidates::candidates;
use pelage_groom::control::{ControlHairs, Sites};
use pelage_groom::instance::{Density, Roots, roots as grow, weights};
use pelage_groom::interpolate::{Blend, interpolate, pose_controls};
use pelage_groom::triangulate::{Triangulation, mirrored_charts, triangulate};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

pub(super) const STUDY: Study = Study {
    name: "instancing",
    about: "Weights against exact ones, seams, points of a hair against bytes, how evenly hairs stand.",
    run,
};

/// The sample bust's groom.
struct Groomed {
    skin: Rc<Skin>,
    controls: Rc<ControlHairs>,
    sites: Sites,
    triangulation: Triangulation,
    roots: Rc<Roots>,
}

fn groomed(folder: &Path) -> Result<Groomed, Error> {
    let project = shots::project(folder, Sample::Bust)?;
    let mut progress = Progress::new(true);
    let mut run = Runner::new(&project, shots::draft(), &mut progress)?;
    let (skin, controls, sites) = (groom::skin(&mut run)?, comb::combed(&mut run)?, groom::placed(&mut run)?);
    let triangulation = triangulate(&sites, &mirrored_charts(&skin.mesh, &skin.topology));
    let roots = instance::roots(&mut run, 0)?;
    Ok(Groomed { skin, controls, sites, triangulation, roots })
}

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let folder = bench.folder.to_path_buf();
    let cell = OnceCell::new();
    let known = || shots::lazily(&cell, || groomed(&folder));
    let weights = weights_section(bench, &known)?;
    let seams = seams_section(bench, &known)?;
    let points = points_section(bench, &folder)?;
    let density = density_section(bench, &known)?;
    let answers = answers(&weights, &seams, &points, &density);
    Ok(Findings { answers, sections: vec![weights, seams, points, density] })
}

type Known<'a> = dyn Fn() -> Result<&'a Groomed, Error> + 'a;

const WEIGHTS: [&str; 6] = [
    "points",
    "in another triangle",
    "largest error of a weight",
    "largest error of the sum",
    "triangles that are not Delaunay",
    "ns a point",
];

fn weights_section(bench: &mut Bench<'_>, known: &Known<'_>) -> Result<Section, Error> {
    let mut section = Section::new("Weights", &WEIGHTS).says(
        "Roots find the triangle of control hairs around them in texture space. Every triangle of the chart is tried instead, \
         in double precision, and its barycentric weights compared; a point in another triangle is one whose weights would \
         differ. A triangle is not Delaunay if another site of its chart lies inside the circle through its corners by more \
         than rounding: on the bust that is where borders and partings cut the triangulation, among random sites in a \
         square it must not be.",
    );
    section.row(bench, "random-sites", || {
        let mut sites = Sites::default();
        let at = |k: u64, seed: u64| [0, 1].map(|c| rng::uniform(seed, k, c, 0) as f32);
        (0..1000).for_each(|k| {
            sites.push(0, at(k, 1), [k as u32; 2]);
        });
        let uv: Vec<[f32; 2]> = (0..20_000).map(|k| at(k, 2)).collect();
        let roots = Roots { chart: vec![0; uv.len()], uv, ..Roots::default() };
        Ok(check_weights(&sites, &triangulate(&sites, &[false]), &roots))
    })?;
    section.row(bench, "weights/bust", || {
        let g = known()?;
        Ok(check_weights(&g.sites, &g.triangulation, &g.roots))
    })?;
    Ok(section)
}

fn wide(p: [f32; 2]) -> [f64; 2] {
    p.map(f64::from)
}

/// Twice the signed area of a triangle.
fn area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn barycentric(t: [[f64; 2]; 3], p: [f64; 2]) -> [f64; 3] {
    let [a, b, c] = t;
    [[p, b, c], [a, p, c], [a, b, p]].map(|s| area(s) / area(t))
}

fn check_weights(sites: &Sites, triangulation: &Triangulation, roots: &Roots) -> [f64; 6] {
    let (found, seconds) = machine::alone(|| weights(roots, triangulation));
    let (mut points, mut other, mut worst, mut sum) = (0, 0, 0.0f64, 0.0f64);
    for (h, (&chart, &uv)) in roots.chart.iter().zip(&roots.uv).enumerate() {
        let inside = |k: usize| Some((k, barycentric(triangulation.uv[k].map(wide), wide(uv))));
        let all = triangulation.triangles(chart).filter_map(inside);
        // The one that the point is deepest in: on an edge two are right.
        let least = |w: &[f64; 3]| w.iter().copied().fold(f64::INFINITY, f64::min);
        let Some((k, exact)) = all.max_by(|a, b| least(&a.1).total_cmp(&least(&b.1))) else { continue };
        if least(&exact) < 0.0 {
            continue;
        }
        points += 1;
        let own = |hair: u32| {
            (0..3).filter(|i| found.hair[h][*i] == hair).map(|i| f64::from(found.weight[h][i])).sum::<f64>()
        };
        let true_weight =
            |hair: u32| (0..3).filter(|i| triangulation.hair[k][*i] == hair).map(|i| exact[i]).sum::<f64>();
        let off = triangulation.hair[k].map(|c| (own(c) - true_weight(c)).abs()).into_iter().fold(0.0, f64::max);
        if off > 1e-3 {
            other += 1;
        } else {
            worst = worst.max(off);
        }
        sum = sum.max((found.weight[h].iter().map(|w| f64::from(*w)).sum::<f64>() - 1.0).abs());
    }
    let bad = (0..triangulation.triangle.len()).filter(|k| !is_delaunay(sites, triangulation, *k)).count();
    let per_point = 1e9 * seconds / roots.uv.len() as f64;
    [f64::from(points), f64::from(other), worst, sum, bad as f64, per_point]
}

/// No site of the chart is inside the circle through the corners.
fn is_delaunay(sites: &Sites, triangulation: &Triangulation, k: usize) -> bool {
    let corner = triangulation.triangle[k];
    let [a, b, c] = corner.map(|s| wide(sites.uv[s as usize]));
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let (uu, vv, d) = (u[0] * u[0] + u[1] * u[1], v[0] * v[0] + v[1] * v[1], 2.0 * (u[0] * v[1] - u[1] * v[0]));
    let centre = [(v[1] * uu - u[1] * vv) / d, (u[0] * vv - v[0] * uu) / d];
    let radius = centre[0] * centre[0] + centre[1] * centre[1];
    let chart = sites.chart[corner[0] as usize];
    let inside = |s: usize| {
        let p = wide(sites.uv[s]);
        let (x, y) = (p[0] - a[0] - centre[0], p[1] - a[1] - centre[1]);
        sites.chart[s] == chart && !corner.contains(&(s as u32)) && x * x + y * y < radius * (1.0 - 1e-6)
    };
    !(0..sites.len()).any(inside)
}

const SEAMS: [&str; 5] = [
    "places",
    "largest angle between first segments, degrees",
    "largest angle, degrees",
    "RMS of tips, mm",
    "largest of tips, mm",
];

/// Points of a hair there, and its length, scene units.
const SEAM: (usize, f32) = (13, 24.0);

fn seams_section(bench: &mut Bench<'_>, known: &Known<'_>) -> Result<Section, Error> {
    let mut section = Section::new("Seams", &SEAMS).says(
        "On every edge of the sample bust where two charts meet, hairs of 24 cm at four places of the edge: interpolated in \
         the one chart and in the other. They should be one hair: control hairs on the border belong to both charts, and \
         both blend the same two there, so that what is left should be rounding.",
    );
    section.row(bench, "seams/bust", || {
        let g = known()?;
        let mesh = &g.skin.mesh;
        let mut pair: [Vec<SurfacePoint>; 2] = Default::default();
        for (t, across) in g.skin.topology.neighbour.iter().enumerate() {
            for (i, &o) in across.iter().enumerate() {
                if o == NONE || o as usize <= t || g.skin.topology.chart[t] == g.skin.topology.chart[o as usize] {
                    continue;
                }
                let weld = |t: usize, k: usize| g.skin.topology.weld[mesh.triangle[t][k] as usize];
                let ends = [weld(t, i), weld(t, (i + 1) % 3)];
                let there = ends.map(|e| (0..3).find(|k| weld(o as usize, *k) == e));
                let [Some(a), Some(b)] = there else { continue };
                for f in [0.2, 0.4, 0.6, 0.8] {
                    pair[0].push(on_edge(t as u32, i, (i + 1) % 3, f));
                    pair[1].push(on_edge(o, a, b, f));
                }
            }
        }
        let [a, b] = pair.map(|points| {
            let roots = Roots {
                uv: points.iter().map(|p| mesh.uv(p)).collect(),
                chart: points.iter().map(|p| g.skin.topology.chart[p.triangle as usize]).collect(),
                id: vec![0; points.len()],
                root: points,
            };
            let found = weights(&roots, &g.triangulation);
            let control = pose_controls(&g.controls, mesh, &g.skin.topology, &g.skin.rest, SEAM.0);
            let (root, length) = (vec![[0.0; 3]; roots.uv.len()], vec![SEAM.1; roots.uv.len()]);
            let hairs = Blend { root: &root, hair: &found.hair, weight: &found.weight, length: &length };
            let mut out = vec![[0.0f32; 3]; root.len() * SEAM.0];
            interpolate(&hairs, &control, &mut out);
            out
        });
        let (mut first, mut any, mut square, mut tip) = (0.0f64, 0.0f64, 0.0, 0.0f64);
        let count = a.len() / SEAM.0;
        for (a, b) in a.chunks(SEAM.0).zip(b.chunks(SEAM.0)) {
            let at = |h: &[[f32; 3]], k: usize| Vec3::from(h[k].map(f64::from));
            for k in 0..SEAM.0 - 1 {
                let angle = (at(a, k + 1) - at(a, k)).angle(&(at(b, k + 1) - at(b, k))).to_degrees();
                any = any.max(angle);
                first = if k == 0 { first.max(angle) } else { first };
            }
            let d = 10.0 * (at(a, SEAM.0 - 1) - at(b, SEAM.0 - 1)).norm();
            square += d * d / count as f64;
            tip = tip.max(d);
        }
        Ok([count as f64, first, any, square.sqrt(), tip])
    })?;
    Ok(section)
}

fn on_edge(triangle: u32, a: usize, b: usize, f: f32) -> SurfacePoint {
    let mut w = [0.0f32; 3];
    (w[a], w[b]) = (1.0 - f, f);
    SurfacePoint { triangle, bary: [w[1], w[2]] }
}

const POINT_COUNTS: [usize; 9] = [4, 6, 8, 12, 16, 24, 32, 48, 64];

const CHORD: [&str; 4] = ["RMS, mm", "largest, mm", "by its closed form, mm", "bytes a hair and frame"];

/// Curls: radius and length of a turn along the axis, and length of the hair, millimetres.
const CURLS: [(&str, [f64; 3]); 3] =
    [("wave", [5.0, 80.0, 240.0]), ("curl", [8.0, 25.0, 240.0]), ("fur", [1.0, 15.0, 30.0])];

fn points_section(bench: &mut Bench<'_>, folder: &Path) -> Result<Section, Error> {
    let mut section = Section::new("Points of a hair", &CHORD).says(
        "How far a hair with n points is from the smooth one: helices (wave: radius 5 mm, a turn in 80 mm, 240 mm long; curl: \
         8 mm, 25 mm, 240 mm; fur: 1 mm, 15 mm, 30 mm), at 4,096 places of each, with the closed form of a chord of a circle with the \
         helix's radius of curvature, R (1 - cos(s / 2R)) for pieces of length s; and the sample bust's finished hairs, \
         clumps and all, with 256 points against fewer on the same curve (its control hairs have 12 points: hairs of as \
         many hit the bends between them). Bytes are of positions in single precision.",
    );
    let counts: &[usize] = if bench.quick { &[6, 12, 24, 48] } else { &POINT_COUNTS };
    for (name, shape) in CURLS {
        for &n in counts {
            section.row(bench, &format!("{name}/{n}"), || Ok(helix_error(shape, n)))?;
        }
    }
    let fine = OnceCell::new();
    for &n in counts {
        section.row(bench, &format!("bust/{n}"), || {
            let hairs = shots::lazily(&fine, || {
                let mut project = shots::thinned(&shots::project(folder, Sample::Bust)?, 0.05);
                project.groom.value.layer[0].points = Some(256);
                let still = shots::still(&project)?;
                let layer = &still.layers[0];
                let line = |h: usize| layer.rest[layer.offsets.range(h)].iter().map(|p| Vec3::from(p.map(f64::from)));
                Ok((0..layer.offsets.len()).map(|h| line(h).collect()).collect::<Vec<Vec<Vec3>>>())
            })?;
            let (mut square, mut largest, mut count) = (0.0, 0.0f64, 0.0);
            for hair in hairs {
                for d in to_chords(hair, &resample(hair, n)) {
                    (square, largest, count) = (square + 100.0 * d * d, largest.max(10.0 * d), count + 1.0);
                }
            }
            Ok([(square / count).sqrt(), largest, f64::NAN, 12.0 * n as f64])
        })?;
    }
    let line = |name: &str, k: usize| {
        let rows = section.rows.iter().filter(|(point, _)| point.split('/').next() == Some(name));
        rows.map(|(_, v)| [v[3], v[k]]).collect::<Vec<_>>()
    };
    let mut series: Vec<Series> = ["wave", "curl", "fur", "bust"].map(|n| Series::new(n, line(n, 0))).into();
    series.push(Series { guide: true, ..Series::new("closed form, wave (largest)", line("wave", 2)) });
    let axes = ["bytes a hair and frame (12 a point)", "RMS distance to the smooth hair, mm"];
    section.plots =
        vec![Plot { title: "Points of a hair: error against bytes", axes, log: [true, true], series }.svg()];
    Ok(section)
}

/// Distances of points of a curve to a polyline along it.
fn to_chords(curve: &[Vec3], line: &[Vec3]) -> Vec<f64> {
    let one = |p: &Vec3| {
        let to = |w: &[Vec3]| {
            let d = w[1] - w[0];
            let f = (d.dot(&(p - w[0])) / d.norm_squared().max(1e-300)).clamp(0.0, 1.0);
            (w[0] + d * f - p).norm()
        };
        line.windows(2).map(to).fold(f64::INFINITY, f64::min)
    };
    curve.iter().map(one).collect()
}

fn helix_error([radius, pitch, length]: [f64; 3], n: usize) -> [f64; 4] {
    let climb = pitch / std::f64::consts::TAU;
    let rate = 1.0 / (radius * radius + climb * climb).sqrt();
    let at = |s: f64| {
        let a = s * rate;
        Vec3::new(radius * libm::cos(a), climb * a, radius * libm::sin(a))
    };
    let along = |n: usize| (0..n).map(|k| at(length * k as f64 / (n - 1) as f64)).collect::<Vec<Vec3>>();
    // A place is compared with the chord that spans it: where turns are lost, the nearest chord is another's.
    let line = along(n);
    const PLACES: usize = 4096;
    let d = (0..PLACES).map(|k| {
        let s = (k as f64 + 0.5) / PLACES as f64;
        let piece = ((s * (n - 1) as f64) as usize).min(n - 2);
        to_chords(&[at(length * s)], &line[piece..piece + 2])[0]
    });
    let d: Vec<f64> = d.collect();
    let rms = (d.iter().map(|d| d * d).sum::<f64>() / d.len() as f64).sqrt();
    let curvature = (radius * radius + climb * climb) / radius;
    let half = 0.5 * length / (n - 1) as f64 / curvature;
    let closed = curvature * (1.0 - libm::cos(half.min(std::f64::consts::PI)));
    [rms, d.iter().copied().fold(0.0, f64::max), closed, 12.0 * n as f64]
}

const DENSITY: [&str; 6] = [
    "hairs",
    "expected",
    "patches",
    "RMS difference of a patch, %",
    "variance over expected hairs",
    "ns a candidate, one thread",
];

fn density_section(bench: &mut Bench<'_>, known: &Known<'_>) -> Result<Section, Error> {
    let mut section = Section::new("Density", &DENSITY).says(
        "24 hairs a square centimetre times the painted map of the sample bust's scalp. Hairs are counted in cubes of the \
         scene and compared with the integral of the density over the skin in them, found by 64 places of every triangle. \
         Hairs of a blue-noise order that begin where their rank is below the density, against hairs placed at random with \
         the same density (Poisson: the variance of a count is the count, 1 in the last column). Patches with less than \
         one hair expected are left out.",
    );
    let cubes: &[f64] = if bench.quick { &[2.0] } else { &[1.0, 2.0, 4.0] };
    for &cube in cubes {
        for name in ["blue-noise", "random"] {
            section.row(bench, &format!("{name}/{cube}-cm"), || Ok(counted(&known()?.skin, name == "random", cube)))?;
        }
    }
    Ok(section)
}

const PER_CM2: f64 = 24.0;

fn map(skin: &Skin) -> TiledMap {
    let map: Map = shapes::paint(&skin.mesh, 512, |p, _| shapes::scalp(p));
    TiledMap { tiles: vec![(0, map)], wrap: Wrap::Clamp }
}

type Cube = [i64; 3];

fn cube_of(p: Vec3, side: f64) -> Cube {
    std::array::from_fn(|x| (p[x] / side).floor() as i64)
}

/// Hairs that the density asks for, by cube.
fn expected(skin: &Skin, side: f64) -> BTreeMap<Cube, f64> {
    let map = map(skin);
    let density = Density { value: PER_CM2, map: Some(&map), on_off: None };
    let mut out = BTreeMap::new();
    const SIDE: usize = 8;
    for t in 0..skin.mesh.triangle.len() as u32 {
        let share = skin.mesh.area(t) / (SIDE * SIDE) as f64;
        for k in 0..SIDE * SIDE {
            let [u, v] = [(k % SIDE) as f32 + 0.5, (k / SIDE) as f32 + 0.5].map(|x| x / SIDE as f32);
            let bary = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let p = SurfacePoint { triangle: t, bary };
            *out.entry(cube_of(skin.mesh.point(&p), side)).or_insert(0.0) += share * density.at(skin.mesh.uv(&p));
        }
    }
    out
}

fn counted(skin: &Skin, random: bool, side: f64) -> [f64; 6] {
    let (map, seed) = (map(skin), 7);
    let density = Density { value: PER_CM2, map: Some(&map), on_off: None };
    let count = density.needed_candidates(skin.area());
    let (mesh, topology) = (&skin.mesh, &skin.topology);
    let (found, seconds) = machine::alone(|| candidates(mesh, topology, seed, count, &mut |_| true));
    let mut found = found.expect("nothing stops the search");
    if random {
        found.root = at_random(skin, count);
    }
    let roots = grow(&skin.mesh, &skin.topology, &found, &density, 1);
    let mut hairs: BTreeMap<Cube, f64> = BTreeMap::new();
    for p in &roots.root {
        *hairs.entry(cube_of(skin.mesh.point(p), side)).or_insert(0.0) += 1.0;
    }
    let expected = expected(skin, side);
    let patches: Vec<[f64; 2]> =
        expected.iter().filter(|(_, e)| **e >= 1.0).map(|(c, e)| [hairs.get(c).copied().unwrap_or(0.0), *e]).collect();
    let n = patches.len() as f64;
    let relative = (patches.iter().map(|[h, e]| (h / e - 1.0).powi(2)).sum::<f64>() / n).sqrt();
    let variance = patches.iter().map(|[h, e]| (h - e).powi(2) / e).sum::<f64>() / n;
    [
        roots.id.len() as f64,
        expected.values().sum(),
        n,
        100.0 * relative,
        variance,
        if random { f64::NAN } else { 1e9 * seconds / count as f64 },
    ]
}

/// Points at random, evenly over the skin.
fn at_random(skin: &Skin, count: usize) -> Vec<SurfacePoint> {
    let mut sum = 0.0;
    let upto: Vec<f64> = (0..skin.mesh.triangle.len() as u32)
        .map(|t| {
            sum += skin.mesh.area(t);
            sum
        })
        .collect();
    let one = |k: u64| {
        let random = |step| rng::uniform(11, k, 0, step);
        let triangle = upto.partition_point(|s| *s < random(0) * sum).min(upto.len() - 1) as u32;
        let root = random(1).sqrt();
        SurfacePoint { triangle, bary: [(root * (1.0 - random(2))) as f32, (root * random(2)) as f32] }
    };
    (0..count as u64).map(one).collect()
}

fn answers(weights: &Section, seams: &Section, points: &Section, density: &Section) -> Vec<String> {
    let row =
        |s: &Section, name: &str| s.rows.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone()).unwrap_or_default();
    let at = |v: &Vec<f64>, k: usize| v.get(k).copied().unwrap_or(f64::NAN);
    let (w, s) = (row(weights, "weights/bust"), row(seams, "seams/bust"));
    let (blue, random) = (row(density, "blue-noise/2-cm"), row(density, "random/2-cm"));
    let enough = |name: &str, limit: f64| {
        let rows = || points.rows.iter().filter(|(n, _)| n.split('/').next() == Some(name));
        let found = rows().find(|(_, v)| v[0] <= limit).and_then(|(n, _)| n.split('/').nth(1));
        found.map_or("more than 64".to_owned(), str::to_owned)
    };
    let each = ["wave", "curl", "fur", "bust"].map(|n| format!("{n} {}", enough(n, 0.3)));
    vec![
        format!(
            "Weights of {:.0} roots are within {:.1e} of exact ones, {:.0} in another triangle; the two sides of a seam differ by \
             {:.4} degrees at most, tips of 24 cm hair by {:.4} mm.",
            at(&w, 0),
            at(&w, 2),
            at(&w, 1),
            at(&s, 2),
            at(&s, 4)
        ),
        format!("Points of a hair for an RMS error below 0.3 mm: {}.", each.join(", ")),
        format!(
            "Counts of hairs in patches of 2 cm are off by {:.1} % RMS in blue noise, by {:.1} % at random: {:.2} and {:.2} of \
             the variance of a Poisson process.",
            at(&blue, 3),
            at(&random, 3),
            at(&blue, 4),
            at(&random, 4)
        ),
    ]
}
