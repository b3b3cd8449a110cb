//! Clusters: the tree that a groom file says, and where hairs are in it.

use super::groom;
use super::run::Runner;
use super::skin::Texel;
use crate::Error;
use crate::config::{self, ClusterEdit, ClusterEditKind as Kind, MOST_CLUSTERS};
use pelage_geom::{Frame, NONE, SurfacePoint, TiledMap, Vec3, curve};
use pelage_groom::cluster::{
    Braid, Cluster, Contour, Curve, Cylinder, Length, Owners, Paste, Region, Rooted, Tree, attach, braid, copy, edit,
    grow, paste, split,
};
use pelage_groom::control::Skin;
use pelage_groom::flow::trace::Lines;
use pelage_groom::scalp::{self, Scalp};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Angles of a region. With 12, a rectangle's corners are cut by a tenth of its size.
const ANGLES: usize = 24;

/// Control points of what a cluster is split into, where it needs no more itself.
const POINTS: usize = 8;

/// The map of a scalp, if its coordinates are painted.
fn painted(run: &mut Runner<'_>) -> Result<Option<TiledMap>, Error> {
    let map = run.project.groom.value.scalp.coordinates.as_ref();
    map.map(|m| run.map(m, Texel::Direction)).transpose()
}

fn space<'a>(s: &config::Scalp, map: Option<&'a TiledMap>) -> Scalp<'a> {
    match (map, s.centre, s.up, s.front) {
        (Some(map), ..) => Scalp::Map(map),
        (None, Some(centre), Some(up), Some(front)) => {
            Scalp::Polar { centre: centre.into(), up: up.into(), front: front.into() }
        }
        _ => Scalp::Uv,
    }
}

/// Coordinates of roots in scalp space.
pub(super) fn coordinates(run: &mut Runner<'_>, roots: &[SurfacePoint]) -> Result<Vec<[f64; 2]>, Error> {
    let (skin, map) = (groom::skin(run)?, painted(run)?);
    let (view, space) = (groom::view(&skin), space(&run.project.groom.value.scalp, map.as_ref()));
    Ok(roots.par_iter().map(|p| space.at(&view, p)).collect())
}

/// True for roots where hair of a layer grows; empty if it does everywhere.
pub(super) fn growing(run: &mut Runner<'_>, i: usize, roots: &[SurfacePoint]) -> Result<Vec<bool>, Error> {
    let groom = &run.project.groom.value;
    let (growth, within) = (&groom.scalp.growth, groom.layer[i].in_clusters);
    if growth.is_empty() && !within {
        return Ok(Vec::new());
    }
    let at = coordinates(run, roots)?;
    let drawn = |p: &[f64; 2]| growth.is_empty() || growth.iter().any(|line| scalp::inside(line, *p));
    let mut out: Vec<bool> = at.par_iter().map(drawn).collect();
    if within {
        let of = owners(&*tree(run)?, &at, None);
        out.iter_mut().zip(of).for_each(|(o, k)| *o &= k != NONE);
    }
    Ok(out)
}

/// The clusters of the groom.
pub(super) fn tree(run: &mut Runner<'_>) -> Result<Arc<Tree>, Error> {
    if let Some(found) = &run.tree {
        return Ok(found.clone());
    }
    let (skin, map) = (groom::skin(run)?, painted(run)?);
    let groom = &run.project.groom;
    let space = space(&groom.value.scalp, map.as_ref());
    let view = groom::view(&skin);
    let mut tree = Tree::default();
    for (i, c) in groom.value.cluster.iter().enumerate() {
        let wrong = |e: String| groom.error(&format!("cluster[{i}]"), e, "see where it stands on the skin");
        let onto = |p: Vec3| skin.bvh().closest(p, f64::INFINITY).map(|c| c.point).unwrap_or_default();
        let cluster = cluster(c, &view, &space, &onto).map_err(wrong)?;
        tree.cluster.push(cluster);
        tree.shape(i as u32).map_err(wrong)?;
    }
    for (i, e) in groom.value.cluster_edit.iter().enumerate() {
        let wrong = |e: String| groom.error(&format!("cluster_edit[{i}]"), e, "");
        let of = find(&tree, &groom.value.cluster, &e.of).map_err(wrong)?;
        let more = match e.kind {
            Kind::Split => of.len() * e.count.unwrap_or(1),
            Kind::Braid => of.len() * e.count.unwrap_or(3),
            Kind::Copy => {
                let to = find(&tree, &groom.value.cluster, e.to.as_deref().unwrap_or_default()).map_err(wrong)?;
                to.len() * tree.below(of[0]).len()
            }
            Kind::Twist | Kind::Scale | Kind::Move => 0,
        };
        if tree.cluster.len() + more > MOST_CLUSTERS {
            return Err(wrong(format!("makes more than {MOST_CLUSTERS} clusters")).into());
        }
        apply(&mut tree, &groom.value.cluster, e, &of).map_err(wrong)?;
    }
    Ok(run.tree.insert(Arc::new(tree)).clone())
}

fn cluster(
    c: &config::Cluster,
    skin: &Skin<'_>,
    space: &Scalp<'_>,
    onto: &dyn Fn(Vec3) -> SurfacePoint,
) -> Result<Cluster, String> {
    let root = onto(c.root.into());
    let frame = skin.frame(&root);
    let around = |radius: f64, k: usize| {
        let (sin, cos) = libm::sincos(TAU * k as f64 / ANGLES as f64);
        onto(frame.origin + (frame.du * cos + frame.dv * sin) * radius)
    };
    let corner: Vec<SurfacePoint> = match (&c.outline, c.radius) {
        (Some(outline), _) => outline.iter().map(|p| onto((*p).into())).collect(),
        (None, radius) => (0..ANGLES).map(|k| around(radius.unwrap_or(1.0), k)).collect(),
    };
    let region = Region::polygon(&corner.iter().map(|p| space.at(skin, p)).collect::<Vec<_>>(), ANGLES)?;
    let apart = |p: &SurfacePoint| (skin.mesh.point(p) - frame.origin).norm();
    let radius = c.radius.unwrap_or_else(|| corner.iter().map(apart).sum::<f64>() / corner.len() as f64);
    let mean = region.radius.iter().sum::<f64>() / ANGLES as f64;
    let width = c.width.clone().unwrap_or_else(|| vec![radius]);
    let scale = stations(width);
    let side = side(&frame, &(0..ANGLES).map(|k| space.at(skin, &around(0.5 * radius, k))).collect::<Vec<_>>());
    Ok(Cluster {
        parent: NONE,
        cylinder: Cylinder {
            control: [frame.origin].into_iter().chain(c.points.iter().map(|p| Vec3::from(*p))).collect(),
            axis: frame.n,
            side,
            contour: Contour::constant(region.radius.iter().map(|r| r / mean).collect()),
            scale: [scale.clone(), scale],
            twist: Curve { t: vec![0.0, 1.0], value: vec![0.0, TAU * c.twist] },
        },
        region,
    })
}

/// The direction along the skin in which the first coordinate grows, from those of points around a root at equal angles.
fn side(frame: &Frame, around: &[[f64; 2]]) -> Vec3 {
    let n = around.len() as f64;
    let middle = [0, 1].map(|i| around.iter().map(|p| p[i]).sum::<f64>() / n);
    let mut sum = [0.0; 2];
    for (k, p) in around.iter().enumerate() {
        let (sin, cos) = libm::sincos(TAU * k as f64 / n);
        let [x, y] = [p[0] - middle[0], p[1] - middle[1]];
        sum = [sum[0] + cos * x + sin * y, sum[1] + sin * x - cos * y];
    }
    (frame.du * sum[0] + frame.dv * sum[1]).try_normalize(0.0).unwrap_or(frame.du)
}

/// Values at equal distances from root to tip.
fn stations(value: Vec<f64>) -> Curve {
    let last = (value.len() - 1).max(1) as f64;
    Curve { t: (0..value.len()).map(|k| k as f64 / last).collect(), value }
}

/// Clusters of a path.
fn find(tree: &Tree, named: &[config::Cluster], path: &str) -> Result<Vec<u32>, String> {
    let mut found: Vec<u32> = Vec::new();
    for (depth, part) in path.split('/').enumerate() {
        let among = |of: &[u32]| -> Vec<u32> {
            match (part, part.parse::<usize>()) {
                ("*", _) => of.to_vec(),
                (_, Ok(k)) if depth > 0 => of.get(k).copied().into_iter().collect(),
                _ if depth == 0 => named.iter().position(|c| c.name == part).map(|k| k as u32).into_iter().collect(),
                _ => Vec::new(),
            }
        };
        found = match depth {
            0 => among(&(0..named.len() as u32).collect::<Vec<_>>()),
            _ => found.into_iter().flat_map(|k| among(&tree.children(k))).collect(),
        };
        if found.is_empty() {
            return Err(format!("there is no cluster `{path}`: nothing is called `{part}` there"));
        }
    }
    Ok(found)
}

fn apply(tree: &mut Tree, named: &[config::Cluster], e: &ClusterEdit, of: &[u32]) -> Result<(), String> {
    let turns = e.turns.unwrap_or(0.0);
    if e.kind == Kind::Copy {
        let to = find(tree, named, e.to.as_deref().expect("checked: a copy goes somewhere"))?;
        let style = match of {
            [one] => copy(tree, *one)?,
            _ => return Err(format!("`{}` is {} clusters: one can be copied", e.of, of.len())),
        };
        let how = if e.whole { Paste::Whole } else { Paste::Below };
        // Numbers change where something was split before: each is found again.
        let all = to.len();
        for k in 0..all {
            let to = find(tree, named, e.to.as_deref().expect("given"))?;
            if to.len() == all && to[k] != of[0] {
                paste(tree, &style, to[k], how)?;
            }
        }
        return Ok(());
    }
    for &k in of {
        match e.kind {
            Kind::Split => _ = split(tree, k, e.count.unwrap_or(1), POINTS)?,
            Kind::Braid => {
                let how = Braid { strands: e.count.unwrap_or(3), turns, start: e.start.unwrap_or(0.1) };
                braid(tree, k, &how)?;
            }
            Kind::Twist => edit(tree, k, |c| twist(&mut c.twist, TAU * turns))?,
            Kind::Scale => {
                let by = stations(e.width.clone().expect("checked: factors"));
                edit(tree, k, |c| c.scale.iter_mut().for_each(|s| *s = product(s, &by)))?;
            }
            Kind::Move => {
                let points = e.points.iter().flatten().map(|p| Vec3::from(*p));
                edit(tree, k, |c| {
                    c.control.truncate(1);
                    c.control.extend(points);
                })?;
            }
            Kind::Copy => {}
        }
    }
    Ok(())
}

/// Adds a turn that grows evenly.
fn twist(curve: &mut Curve, turn: f64) {
    let t: Vec<f64> = merged(&curve.t, &[0.0, 1.0]);
    let value = t.iter().map(|s| curve.at(*s) + turn * s).collect();
    *curve = Curve { t, value };
}

fn product(a: &Curve, b: &Curve) -> Curve {
    let t = merged(&a.t, &b.t);
    let value = t.iter().map(|s| a.at(*s) * b.at(*s)).collect();
    Curve { t, value }
}

/// Stations of both, in order.
fn merged(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = a.iter().chain(b).copied().collect();
    out.sort_by(f64::total_cmp);
    out.dedup();
    out
}

/// \[N\] the cluster of a level that each root is in (its last if it is in none of that level, or if no level is given), or
/// [`NONE`].
pub(super) fn owners(tree: &Tree, uv: &[[f64; 2]], level: Option<usize>) -> Vec<u32> {
    let owners = Owners::find(tree, uv);
    let of = |h: usize| match level.and_then(|l| owners.path(h).get(l)) {
        Some(k) if *k != NONE => *k,
        _ => owners.leaf(h),
    };
    (0..uv.len()).map(of).collect()
}

/// Which of the hairs of each of `of`'s clusters is the nearest to its middle: \[clusters\], [`NONE`] for one without hairs.
pub(super) fn middles(tree: &Tree, of: &[u32], uv: &[[f64; 2]]) -> Vec<u32> {
    let mut best = vec![(f64::INFINITY, NONE); tree.cluster.len()];
    for (h, (k, at)) in of.iter().zip(uv).enumerate().filter(|(_, (k, _))| **k != NONE) {
        let r = tree.cluster[*k as usize].region.polar(*at)[0];
        let best = &mut best[*k as usize];
        *best = if r < best.0 { (r, h as u32) } else { *best };
    }
    best.into_iter().map(|b| b.1).collect()
}

/// Lines of `points` points at equal chords through the clusters that roots are in, root first, scene units: to their ends, or
/// as long as `length` says where it is given. Roots without a cluster get lines without length.
pub(super) fn lines(
    tree: &Tree,
    of: &[u32],
    uv: &[[f64; 2]],
    root: &[Vec3],
    length: Option<&[f64]>,
    points: usize,
    start: f64,
) -> Result<Lines, String> {
    let within: Vec<usize> = (0..of.len()).filter(|h| of[*h] != NONE).collect();
    let own: Vec<u32> = within.iter().map(|h| of[*h]).collect();
    let uv: Vec<[f64; 2]> = within.iter().map(|h| uv[*h]).collect();
    let at: Vec<Vec3> = within.iter().map(|h| root[*h]).collect();
    let rooted: Vec<Rooted> = attach(tree, &own, &uv, &at)?;
    let cut: Vec<Length> = match length {
        Some(length) => within.iter().map(|h| Length::Cut(length[*h].max(f64::MIN_POSITIVE))).collect(),
        None => vec![Length::Natural],
    };
    let grown = if within.is_empty() { Vec::new() } else { grow(tree, &rooted, &cut, points, start)? };
    let mut out: Vec<Vec3> = root.iter().flat_map(|r| std::iter::repeat_n(*r, points)).collect();
    for (h, line) in within.iter().zip(grown.chunks_exact(points)) {
        let mut line = line.to_vec();
        let own: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let ahead = (line[points - 1] - line[points - 2]).try_normalize(0.0);
        // Hair that is longer than its cluster goes straight on.
        if let (Some(length), Some(ahead)) = (length.map(|l| l[*h]).filter(|l| *l > own), ahead) {
            line.push(line[points - 1] + ahead * (length - own));
        }
        let mut line = curve::resample(&line, points);
        let own: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        // Chords are shorter than what they span.
        if let Some(length) = length.map(|l| l[*h]).filter(|_| own > 0.0) {
            let (root, by) = (line[0], length / own);
            line.iter_mut().for_each(|p| *p = root + (*p - root) * by);
        }
        out[h * points..][..points].copy_from_slice(&line);
    }
    Ok(Lines { points, at: out, straight_from: vec![points as u32; root.len()] })
}
