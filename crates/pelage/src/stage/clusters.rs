//! Clusters: the tree that a groom file says, and where hairs are in it.

use super::groom;
use super::run::Runner;
use super::skin::Texel;
use crate::Error;
use crate::config::{self, ClusterEdit, ClusterEditKind as Kind, MOST_CLUSTERS};
use pelage_geom::{Frame, NONE, SurfacePoint, TiledMap, Vec3};
use pelage_groom::cluster::{
    Braid, Cluster, Contour, Curve, Cylinder, Owners, Paste, Region, Tree, braid, copy, edit, paste, split,
};
use pelage_groom::control::Skin;
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
        // Steps of their making part clusters of the file, and add none beside them.
        let of = owners(&of_file(run, &run.project.groom.value.cluster, None)?, &at, Some(0));
        out.iter_mut().zip(of).for_each(|(o, k)| *o &= k != NONE);
    }
    Ok(out)
}

/// The clusters of the groom at a frame, or at rest, where no root is in another cluster than at any frame.
pub(super) fn tree(run: &mut Runner<'_>, frame: Option<i32>) -> Result<Arc<Tree>, Error> {
    let frame = frame.filter(|_| run.project.clusters_move());
    if let Some((_, found)) = run.tree.iter().find(|(at, _)| *at == frame) {
        return Ok(found.clone());
    }
    let shape = run.project.shape(frame);
    let mut tree = of_file(run, &shape.cluster, frame)?;
    let when = frame.map_or(String::new(), |f| format!(" (at frame {f})"));
    for (i, e) in shape.cluster_edit.iter().enumerate() {
        let wrong = |e: String| run.project.groom.error(&format!("cluster_edit[{i}]"), e + &when, "");
        apply(&mut tree, &shape.cluster, e).map_err(wrong)?;
    }
    // The one at rest and that of one frame.
    run.tree.retain(|(at, _)| at.is_none());
    let tree = Arc::new(tree);
    run.tree.push((frame, tree.clone()));
    Ok(tree)
}

/// The clusters that a file names, before any step.
fn of_file(run: &mut Runner<'_>, clusters: &[config::Cluster], frame: Option<i32>) -> Result<Tree, Error> {
    let when = frame.map_or(String::new(), |f| format!(" (at frame {f})"));
    let (skin, map) = (groom::skin(run)?, painted(run)?);
    let groom = &run.project.groom;
    let space = space(&groom.value.scalp, map.as_ref());
    let view = groom::view(&skin);
    let mut tree = Tree::default();
    for (i, c) in clusters.iter().enumerate() {
        let wrong = |e: String| groom.error(&format!("cluster[{i}]"), e + &when, "see where it stands on the skin");
        let onto = |p: Vec3| skin.bvh().closest(p, f64::INFINITY).map(|c| c.point).unwrap_or_default();
        let cluster = cluster(c, &view, &space, &onto).map_err(wrong)?;
        tree.cluster.push(cluster);
        tree.shape(i as u32).map_err(wrong)?;
    }
    Ok(tree)
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
    let scale = Curve::even(c.width.clone().unwrap_or_else(|| vec![radius]));
    let side = side(&frame, &(0..ANGLES).map(|k| space.at(skin, &around(0.5 * radius, k))).collect::<Vec<_>>());
    Ok(Cluster {
        parent: NONE,
        cylinder: Cylinder {
            control: [frame.origin].into_iter().chain(c.points.iter().map(|p| Vec3::from(*p))).collect(),
            axis: frame.n,
            side,
            contour: Contour::constant(region.radius.iter().map(|r| r / mean).collect()),
            scale: [scale.clone(), scale],
            twist: Curve::even(vec![0.0, TAU * c.twist]),
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

/// Says if so many clusters more are too many.
fn bound(tree: &Tree, more: usize) -> Result<(), String> {
    match tree.cluster.len() + more > MOST_CLUSTERS {
        true => Err(format!("makes more than {MOST_CLUSTERS} clusters")),
        false => Ok(()),
    }
}

/// Gives clusters at `e.to` what was split from the one at `e.of`.
fn copied(tree: &mut Tree, named: &[config::Cluster], e: &ClusterEdit, of: &[u32]) -> Result<(), String> {
    let [from] = of else { return Err(format!("`{}` is {} clusters: one can be copied", e.of, of.len())) };
    let to = e.to.as_deref().expect("checked: a copy goes somewhere");
    let all = find(tree, named, to)?.len();
    bound(tree, all * tree.below(*from).len())?;
    let (style, how) = (copy(tree, *from)?, if e.whole { Paste::Whole } else { Paste::Below });
    for k in 0..all {
        // Numbers change where something was split before: each is found again.
        let to = find(tree, named, to)?;
        if to.len() == all && to[k] != *from {
            paste(tree, &style, to[k], how)?;
        }
    }
    Ok(())
}

fn apply(tree: &mut Tree, named: &[config::Cluster], e: &ClusterEdit) -> Result<(), String> {
    let of = find(tree, named, &e.of)?;
    if e.kind == Kind::Copy {
        return copied(tree, named, e, &of);
    }
    let (turns, parts) = (e.turns.unwrap_or(0.0), e.count.unwrap_or(3));
    if matches!(e.kind, Kind::Split | Kind::Braid) {
        bound(tree, of.len() * parts)?;
    }
    for k in of {
        match e.kind {
            Kind::Split => _ = split(tree, k, parts, POINTS)?,
            Kind::Braid => {
                let how = Braid { strands: parts, turns, start: e.start.unwrap_or(0.1) };
                braid(tree, k, &how)?;
            }
            Kind::Twist => {
                let by = Curve::even(vec![0.0, TAU * turns]);
                edit(tree, k, |c| c.twist = c.twist.joined(&by, |a, b| a + b))?;
            }
            Kind::Scale => {
                let by = Curve::even(e.width.clone().expect("checked: factors"));
                edit(tree, k, |c| c.scale.iter_mut().for_each(|s| *s = s.joined(&by, |a, b| a * b)))?;
            }
            Kind::Move => {
                let points = e.points.iter().flatten().map(|p| Vec3::from(*p));
                edit(tree, k, |c| {
                    c.control.truncate(1);
                    c.control.extend(points);
                })?;
            }
            Kind::Copy => unreachable!("copied above"),
        }
    }
    Ok(())
}

/// Complains about a level, at a key of the groom, that no cluster is of.
pub(super) fn check_level(run: &Runner<'_>, tree: &Tree, key: &str, level: Option<usize>) -> Result<(), Error> {
    let last = tree.levels().into_iter().max().unwrap_or(0);
    match level.filter(|l| *l > last) {
        None => Ok(()),
        Some(level) => {
            let help = format!("levels go from 0, the clusters of the file, to {last}, what was split last");
            Err(run.project.groom.error(key, format!("there are no clusters of level {level}"), help).into())
        }
    }
}

/// \[N\] the cluster of a level that each root is in (its last if it is in none of that level, or if no level is given), or
/// [`NONE`].
pub(super) fn owners(tree: &Tree, uv: &[[f64; 2]], level: Option<usize>) -> Vec<u32> {
    let owners = Owners::find(tree, uv);
    level.map_or_else(|| owners.last(), |l| owners.at(l))
}
