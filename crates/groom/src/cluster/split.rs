//! Subdivision: a cluster is parted among children that together are what it was.

use super::region::seen;
use super::{Cluster, Contour, Curve, Cylinder, Region, Shape, Tree};
use pelage_geom::{NONE, Vec3};
use std::f64::consts::TAU;

/// Angles of a child's contour. Of the parent's region, 5 % are in none or several of its children's with 12, 1.5 %
/// with 24, 0.5 % with 48, which are twice as many numbers to store and to evaluate.
const ANGLES: usize = 24;

/// Relaxation: points a child that stand for the region, and rounds. In a bent region, areas of 12 children differ by
/// 11 % (rms) with 100 points, by 10 % with 20 rounds, by 6 % with these and with more.
const SAMPLES: usize = 400;
const ROUNDS: usize = 60;

/// Stations for each turn of a parent's twist. The radius of a child's skeleton, a helix, is off by 12 % with 4, by 1 %
/// with 8 (5 % in its first and last piece); more than 8 are in the way of who edits it.
const PER_TURN: f64 = 8.0;

/// Splits a cluster without children into `n`, and gives their numbers.
///
/// Centres are spread over the region and relaxed (each moves to the middle of the points that are nearest to it); a
/// child's region is what is nearer to its centre than to the others', so that regions neither overlap nor leave holes.
/// The skeleton of a child is V of the parent at its centre's (r, theta), at `points` control points or more where the
/// parent has more or is twisted. Its contours and twist are such that a hair of the child is where it was as a hair of
/// the parent. The same input gives the same children.
pub fn split(tree: &mut Tree, cluster: u32, n: usize, points: usize) -> Result<Vec<u32>, String> {
    let parent = tree.of(cluster)?;
    if n == 0 || points < 2 {
        return Err(format!("a cluster splits into 1 or more of 2 or more points, not {n} of {points}"));
    }
    if !tree.children(cluster).is_empty() {
        return Err(format!("cluster {cluster} is split already"));
    }
    parent.region.check().map_err(|e| format!("cluster {cluster}: {e}"))?;
    let shape = tree.shape(cluster)?;
    let turns = (parent.cylinder.twist.variation() / TAU * PER_TURN).ceil() as usize;
    let points = points.max(parent.cylinder.control.len()).max(turns + 1);
    let of = |region: Region| {
        let cylinder = child(&shape, &parent.region, &region, points)?;
        Ok(Cluster { parent: cluster, region, cylinder })
    };
    let regions = cells(&parent.region, n);
    let children: Vec<Cluster> = regions.into_iter().map(of).collect::<Result<_, String>>()?;
    let first = tree.cluster.len() as u32;
    tree.cluster.extend(children);
    if tree.cluster.len() >= NONE as usize {
        return Err("a tree of too many clusters".into());
    }
    Ok((first..first + n as u32).collect())
}

/// The regions of `n` children: cells of relaxed centres.
pub(super) fn cells(region: &Region, n: usize) -> Vec<Region> {
    if n == 1 {
        return vec![region.clone()];
    }
    // A grid over the region, so that points stand for equal areas whatever its form.
    let reach = region.radius.iter().copied().fold(0.0, f64::max);
    let step = (region.area() / (n * SAMPLES) as f64).sqrt();
    let lines = (reach / step).ceil() as i64;
    let place = |i: i64| (i as f64 + 0.5) * step;
    let grid: Vec<[f64; 2]> = (-lines..lines)
        .flat_map(|i| (-lines..lines).map(move |j| (i, j)))
        .map(|(i, j)| [region.centre[0] + place(i), region.centre[1] + place(j)])
        .filter(|p| region.contains(*p))
        .collect();
    let mut centre: Vec<[f64; 2]> = region.fill(n).into_iter().map(|p| region.at(p)).collect();
    for _ in 0..ROUNDS {
        let mut sum = vec![[0.0; 3]; n];
        for p in &grid {
            let mut best = (f64::INFINITY, 0);
            for (k, c) in centre.iter().enumerate() {
                let d = (p[0] - c[0]) * (p[0] - c[0]) + (p[1] - c[1]) * (p[1] - c[1]);
                best = if d < best.0 { (d, k) } else { best };
            }
            let s = &mut sum[best.1];
            *s = [s[0] + p[0], s[1] + p[1], s[2] + 1.0];
        }
        let mut way = 0.0f64;
        for (c, [x, y, count]) in centre.iter_mut().zip(sum) {
            let to = [x / count, y / count];
            // The middle of a cell of a bent region may lie outside.
            if count > 0.0 && region.contains(to) {
                way = way.max((to[0] - c[0]).abs().max((to[1] - c[1]).abs()));
                *c = to;
            }
        }
        if way < 0.01 * step {
            break;
        }
    }
    (0..n).map(|k| cell(region, &centre, k)).collect()
}

/// What of a region is nearer to centre `k` than to the others.
fn cell(region: &Region, centre: &[[f64; 2]], k: usize) -> Region {
    let c = centre[k];
    let border = |a: usize| {
        let (sin, cos) = libm::sincos(TAU * a as f64 / ANGLES as f64);
        let mut reach = f64::INFINITY;
        for (_, o) in centre.iter().enumerate().filter(|(i, _)| *i != k) {
            let d = [o[0] - c[0], o[1] - c[1]];
            let toward = cos * d[0] + sin * d[1];
            if toward > 0.0 {
                reach = reach.min(0.5 * (d[0] * d[0] + d[1] * d[1]) / toward);
            }
        }
        // The first way out of the region before that.
        let out = |s: f64| !region.contains([c[0] + s * cos, c[1] + s * sin]);
        let widest = 2.0 * region.radius.iter().copied().fold(0.0, f64::max);
        let end = reach.min(widest);
        let Some(step) = (1..=64).find(|i| out(end * f64::from(*i) / 64.0)) else { return end };
        let (mut low, mut high) = (end * f64::from(step - 1) / 64.0, end * f64::from(step) / 64.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if out(middle) { &mut high } else { &mut low }) = middle;
        }
        high
    };
    Region { centre: c, radius: (0..ANGLES).map(border).collect() }
}

/// The cylinder of a child whose roots are in `region`, within a parent whose roots are in `around`.
fn child(parent: &Shape, around: &Region, region: &Region, points: usize) -> Result<Cylinder, String> {
    let untwisted = parent.cylinder().twist.at(0.0);
    let in_parent = |at: [f64; 2]| {
        let [r, angle] = around.polar(at);
        [r, angle - untwisted]
    };
    let centre = in_parent(region.centre);
    let angles = region.radius.len().max(ANGLES);
    let border: Vec<[f64; 2]> =
        (0..angles).map(|k| in_parent(region.at([1.0, TAU * k as f64 / angles as f64]))).collect();
    let at = |k: usize| parent.section(k as f64 / (points - 1) as f64);
    let control: Vec<Vec3> = (0..points).map(at).map(|s| s.point(centre[0], centre[1])).collect();
    let root = parent.section(0.0);
    let mut out = Cylinder::plain(control, root.axes[0], root.axes[1], vec![1.0]);
    let shape = Shape::new(&out)?;
    let t = shape.skeleton().control_t();
    let (mut twist, mut radius): (Vec<f64>, Vec<f64>) = Default::default();
    let mut first = 0.0;
    for (k, t) in t.iter().enumerate() {
        let (theirs, own) = (at(k), shape.section(*t));
        let flat = |[r, theta]: [f64; 2]| {
            let d = theirs.point(r, theta) - own.centre;
            [d.dot(&own.axes[1]), d.dot(&own.axes[2])]
        };
        let corner: Vec<[f64; 2]> = border.iter().map(|b| flat(*b)).collect();
        // The turn that is common to all corners since the root.
        let mut sum = [0.0; 2];
        for (k, [x, y]) in corner.iter().enumerate() {
            let (sin, cos) = libm::sincos(TAU * k as f64 / angles as f64);
            sum = [sum[0] + cos * x + sin * y, sum[1] + cos * y - sin * x];
        }
        let turn = if sum == [0.0; 2] { first } else { libm::atan2(sum[1], sum[0]) };
        first = if k == 0 { turn } else { first };
        let before = twist.last().copied().unwrap_or(0.0);
        let step = (turn - first - before) / TAU;
        let now = before + (step - step.round()) * TAU;
        let (sin, cos) = libm::sincos(now);
        let turned: Vec<[f64; 2]> = corner.iter().map(|[x, y]| [cos * x + sin * y, cos * y - sin * x]).collect();
        twist.push(now);
        radius.extend(seen(&turned, angles));
    }
    // Where a parent ends in a point, so do its children: a width that is as good as none.
    let widest = radius.iter().copied().fold(0.0, f64::max);
    radius.iter_mut().for_each(|r| *r = r.max(1e-6 * widest));
    out.contour = Contour { t: t.clone(), angles, radius };
    out.twist = Curve { t: t.clone(), value: twist };
    out.scale = [0, 1].map(|_| Curve { t: t.clone(), value: vec![1.0; t.len()] });
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::{samples, upright};
    use super::super::{Length, Owners, Rooted, attach, grow};
    use super::*;
    use pelage_geom::{curve, rng::uniform};

    fn bean() -> Region {
        let radius = |k: usize| 1.0 + 0.35 * libm::cos(2.0 * TAU * k as f64 / 36.0);
        Region { centre: [0.3, -0.2], radius: (0..36).map(radius).collect() }
    }

    fn within(region: &Region, n: u64) -> Vec<[f64; 2]> {
        (0..n)
            .map(|k| [0, 1].map(|i| region.centre[i as usize] + 3.0 * uniform(7, k, 0, i) - 1.5))
            .filter(|p| region.contains(*p))
            .collect()
    }

    #[test]
    fn children_share_their_parents_region_evenly() {
        for (region, n) in [(Region::circle([0.5, 0.5], 1.0), 7), (bean(), 12), (bean(), 60), (bean(), 2)] {
            let cells = cells(&region, n);
            let at = within(&region, 100_000);
            let mut owned = vec![0.0; n];
            let (mut nobody, mut several, mut foreign) = (0.0, 0.0, 0.0);
            for p in &at {
                let owners: Vec<usize> = (0..n).filter(|k| cells[*k].contains(*p)).collect();
                nobody += f64::from(u8::from(owners.is_empty()));
                several += f64::from(u8::from(owners.len() > 1));
                let nearest =
                    |a: &usize, b: &usize| cells[*a].distance_squared(*p).total_cmp(&cells[*b].distance_squared(*p));
                let owner = (0..n).min_by(nearest).expect("a cell");
                foreign += f64::from(u8::from(!owners.is_empty() && !owners.contains(&owner)));
                owned[owner] += 1.0;
            }
            let all = at.len() as f64;
            // Contours of so many angles miss a little near their corners.
            assert!(nobody < 0.02 * all && several < 0.02 * all, "{n}: {nobody} {several} of {all}");
            assert!(foreign < 0.005 * all, "{n}: {foreign} of {all}");
            let even = owned.iter().sum::<f64>() / n as f64;
            assert!(owned.iter().all(|o| (o / even - 1.0).abs() < 0.25), "{n}: {owned:?} of {even}");
            assert!(cells == super::cells(&region, n));
        }
    }

    const POINTS: usize = 33;

    /// How far the median hair may move, in largest girths of the parent. The third is an ellipse whose hairs go around
    /// it with the twist: its parts are sheared, which contours can't follow.
    const LIMIT: [f64; 5] = [1e-12, 0.005, 0.06, 0.03, 0.006];

    /// Hairs that follow clusters of `tree` from its roots, in the order of `uv`.
    fn hairs(tree: &Tree, uv: &[[f64; 2]], root: &[Vec3]) -> Vec<Vec3> {
        let owners = Owners::find(tree, uv);
        let hairs: Vec<Rooted> = attach(tree, &owners.last(), uv, root).expect("attached");
        grow(tree, &hairs, &[Length::Natural], POINTS, 1.0).expect("hairs")
    }

    #[test]
    fn hairs_are_where_they_were_before() {
        for (k, cylinder) in samples().into_iter().enumerate() {
            let region = Region::circle([0.0; 2], 1.0);
            let mut tree = Tree { cluster: vec![Cluster { parent: NONE, region, cylinder }] };
            let w = tree.cluster[0].cylinder.twist.at(0.0);
            let uv: Vec<[f64; 2]> =
                within(&tree.cluster[0].region, 400).into_iter().filter(|p| p[0] * p[0] + p[1] * p[1] < 0.8).collect();
            let shape = tree.shape(0).expect("a shape");
            let polar = |p: &[f64; 2]| tree.cluster[0].region.polar(*p);
            let root: Vec<Vec3> = uv.iter().map(polar).map(|[r, a]| shape.point(r, a - w, 0.0)).collect();
            let size = shape.widest();
            let before = hairs(&tree, &uv, &root);
            let children = split(&mut tree, 0, 5, 24).expect("children");
            let after = hairs(&tree, &uv, &root);
            let off = |a: &[Vec3], b: &[Vec3]| {
                let pairs = a.chunks(POINTS).zip(b.chunks(POINTS));
                let mut off: Vec<f64> =
                    pairs.flat_map(|(a, b)| b.iter().map(|p| curve::closest_on_polyline(a, *p).3 / size)).collect();
                off.sort_by(f64::total_cmp);
                (off[off.len() / 2], off[off.len() * 19 / 20])
            };
            let (median, most) = off(&before, &after);
            assert!(median < LIMIT[k] && most < 4.0 * LIMIT[k], "{k}: {median} {most}");
            for c in children {
                split(&mut tree, c, 4, 24).expect("children");
            }
            let (median, most) = off(&before, &hairs(&tree, &uv, &root));
            assert!(median < 2.0 * LIMIT[k] && most < 8.0 * LIMIT[k], "{k} twice: {median} {most}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let mut tree = Tree { cluster: vec![upright([0.0; 2], 1.0)] };
        assert!(split(&mut tree, 0, 0, 4).unwrap_err().contains("not 0 of 4"));
        assert!(split(&mut tree, 1, 2, 4).unwrap_err().contains("no cluster 1"));
        assert_eq!(split(&mut tree, 0, 1, 4), Ok(vec![1]));
        assert!(split(&mut tree, 0, 2, 4).unwrap_err().contains("split already"));
    }
}
