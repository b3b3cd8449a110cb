//! Hairs that follow clusters from their own roots.

use super::{Region, Section, Shape, Tree};
use pelage_geom::{NONE, Vec3, curve};
use rayon::prelude::*;

/// Sections between two points of a hair, from which hairs that are cut are cut. With 1 a cut hair would miss what the
/// hair does between its points; more than 4 only cost time.
const BETWEEN: usize = 4;

/// A hair in a cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rooted {
    /// Its root, scene units.
    pub root: Vec3,
    /// The cluster that it follows, or [`NONE`].
    pub cluster: u32,
    /// Its r and theta (radians) there.
    pub at: [f64; 2],
}

/// The length of a hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// To the end of its cluster.
    Natural,
    /// Cut at this length, scene units; a hair that is shorter stays as it is.
    Cut(f64),
    /// Made larger or smaller about its root to this length, scene units.
    Scaled(f64),
}

/// Least length over which a hair comes into its cluster, in ways there: the steepest that the way there shrinks is 1.5 over
/// it, so that with 1.5 hair that comes from ahead stands still, and with less it turns back.
const STEEP: f64 = 2.0;

/// Puts hairs into clusters (`of`, one a hair): r and theta are those of the root in the cluster's region. `uv` in scalp
/// space and `root` in scene units, one a hair.
pub fn attach(tree: &Tree, of: &[u32], uv: &[[f64; 2]], root: &[Vec3]) -> Result<Vec<Rooted>, String> {
    if uv.len() != root.len() || of.len() != uv.len() {
        return Err(format!("clusters and roots of {} hairs, and {} roots in scalp space", root.len(), uv.len()));
    }
    let rooted = |(cluster, (uv, root)): (&u32, (&[f64; 2], &Vec3))| {
        let cluster = *cluster;
        let at = tree.cluster.get(cluster as usize).map_or([0.0; 2], |c| {
            let [r, angle] = c.region.polar(*uv);
            [r, angle - c.cylinder.twist.at(0.0)]
        });
        Rooted { root: *root, cluster, at }
    };
    Ok(of.iter().zip(uv.iter().zip(root)).map(rooted).collect())
}

/// `n` places (r, theta) spread evenly over the contour at the root ([`Region::fill`]).
pub fn fill(shape: &Shape, n: usize) -> Vec<[f64; 2]> {
    Region { centre: [0.0; 2], radius: shape.section(0.0).ring }.fill(n)
}

/// Hairs that fill the leaves of a tree evenly, `density` hairs per unit of area across the roots of clusters (scene
/// units squared), to the next whole number in each. Where clusters overlap they add up: sample the skin and find
/// [`super::Owners`] where that shows.
pub fn fill_leaves(tree: &Tree, density: f64) -> Result<Vec<Rooted>, String> {
    if !(0.0..).contains(&density) {
        return Err(format!("a density of hairs can't be {density}"));
    }
    let mut out = Vec::new();
    for k in (0..).zip(tree.leaves()).filter(|(_, leaf)| *leaf).map(|(k, _)| k) {
        let shape = tree.shape(k)?;
        let section = shape.section(0.0);
        let hairs = (section.area() * density).round();
        if !(0.0..=f64::from(NONE)).contains(&hairs) {
            return Err(format!("a density of {density} gives cluster {k} too many hairs"));
        }
        let rooted = |at: [f64; 2]| Rooted { root: section.point(at[0], at[1]), cluster: k, at };
        out.extend(fill(&shape, hairs as usize).into_iter().map(rooted));
    }
    Ok(out)
}

/// The skeleton of a cluster at `points` equal steps of arc length: the line that a clump gathers about, scene units.
pub fn line(shape: &Shape, points: usize) -> Vec<Vec3> {
    let last = points.max(2) - 1;
    (0..points).map(|k| shape.skeleton().place(k as f64 / last as f64).at).collect()
}

/// \[H * P\] points of hairs, scene units, root first: V(r, theta, t) at P equal steps of t. Where V does not begin in
/// a hair's own root, the way there is added to the hair, less and less up to t = `blend` or farther where it is long (above 0, up to 1; small, and
/// hairs bend where they meet the skin). `length` is one for all or one a hair; cut hairs have equal segments.
pub fn grow(tree: &Tree, hairs: &[Rooted], length: &[Length], points: usize, blend: f64) -> Result<Vec<Vec3>, String> {
    if points < 2 || !(blend > 0.0 && blend <= 1.0) {
        return Err(format!("hairs have 2 points or more, blended over 0 to 1, not {points} over {blend}"));
    }
    if length.len() != 1 && length.len() != hairs.len() {
        return Err(format!("{} lengths for {} hairs", length.len(), hairs.len()));
    }
    let sound = |l: &Length| match l {
        Length::Natural => true,
        Length::Cut(l) | Length::Scaled(l) => l.is_finite() && *l > 0.0,
    };
    if let Some(k) = length.iter().position(|l| !sound(l)) {
        return Err(format!("length {k} of hairs is not above 0"));
    }
    let mut used = vec![false; tree.cluster.len()];
    for (h, hair) in hairs.iter().enumerate() {
        match used.get_mut(hair.cluster as usize) {
            Some(u) => *u = true,
            None if hair.cluster == NONE => return Err(format!("hair {h} has no cluster")),
            None => return Err(format!("hair {h} follows cluster {} of {}", hair.cluster, tree.cluster.len())),
        }
    }
    let fine = if length.iter().any(|l| matches!(l, Length::Cut(_))) { BETWEEN } else { 1 };
    let steps = (points - 1) * fine;
    let t = |k: usize| k as f64 / steps as f64;
    let sections = |k: usize| -> Result<(Vec<Section>, f64), String> {
        if !used[k] {
            return Ok(Default::default());
        }
        let shape = tree.shape(k as u32)?;
        Ok(((0..=steps).map(|i| shape.section(t(i))).collect(), shape.skeleton().length()))
    };
    let sections: Vec<(Vec<Section>, f64)> = (0..used.len()).into_par_iter().map(sections).collect::<Result<_, _>>()?;
    let mut out = vec![Vec3::zeros(); hairs.len() * points];
    out.par_chunks_mut(points).zip(hairs).enumerate().for_each(|(h, (out, hair))| {
        let (section, way) = &sections[hair.cluster as usize];
        let [r, theta] = hair.at;
        let off = hair.root - section[0].point(r, theta);
        // Over less, a hair that comes from far would double back.
        let over = blend.max(STEEP * off.norm() / way).min(1.0);
        let keep = |k: usize| fade(t(k) / over);
        let point = |k: usize| if k == 0 { hair.root } else { section[k].point(r, theta) + off * keep(k) };
        let whole = |out: &mut [Vec3]| out.iter_mut().enumerate().for_each(|(k, p)| *p = point(k * fine));
        match length[if length.len() == 1 { 0 } else { h }] {
            Length::Natural => whole(out),
            Length::Scaled(l) => {
                whole(out);
                scale(out, l);
            }
            Length::Cut(l) => {
                let mut line: Vec<Vec3> = (0..=steps).map(point).collect();
                if cut(&mut line, l) {
                    out.copy_from_slice(&curve::resample(&line, out.len()));
                    scale(out, l);
                } else {
                    whole(out);
                }
            }
        }
    });
    Ok(out)
}

/// \[H * P\] points of a line for each root, root first, scene units, with equal chords: through its cluster (`of`, or
/// [`NONE`]) to the end of that, or as long as `length` says where it is given: cut, or straight on beyond the cluster.
/// Roots without a cluster get lines without length. `start` as `blend` in [`grow`].
pub fn lines(
    tree: &Tree,
    of: &[u32],
    uv: &[[f64; 2]],
    root: &[Vec3],
    length: Option<&[f64]>,
    points: usize,
    start: f64,
) -> Result<Vec<Vec3>, String> {
    let mut out: Vec<Vec3> = root.iter().flat_map(|r| std::iter::repeat_n(*r, points)).collect();
    let within: Vec<usize> = (0..of.len()).filter(|h| of[*h] != NONE).collect();
    if within.is_empty() {
        return Ok(out);
    }
    let rooted: Vec<Rooted> = attach(tree, of, uv, root)?.into_iter().filter(|h| h.cluster != NONE).collect();
    let cut: Vec<Length> = match length {
        Some(length) => within.iter().map(|h| Length::Cut(length[*h].max(f64::MIN_POSITIVE))).collect(),
        None => vec![Length::Natural],
    };
    let grown = grow(tree, &rooted, &cut, points, start)?;
    for (h, line) in within.iter().zip(grown.chunks_exact(points)) {
        let length = length.map(|l| l[*h]);
        let mut line = line.to_vec();
        let own = way(&line);
        let ahead = (line[points - 1] - line[points - 2]).try_normalize(0.0);
        if let (Some(length), Some(ahead)) = (length.filter(|l| *l > own), ahead) {
            line.push(line[points - 1] + ahead * (length - own));
        }
        let out = &mut out[h * points..][..points];
        out.copy_from_slice(&curve::resample(&line, points));
        // Chords are shorter than what they span.
        if let Some(length) = length {
            scale(out, length);
        }
    }
    Ok(out)
}

/// Length of a polyline.
fn way(line: &[Vec3]) -> f64 {
    line.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// Share of a way that is left: 1 at 0, 0 from 1 on, with no slope at either.
pub fn fade(x: f64) -> f64 {
    let x = x.min(1.0);
    1.0 - x * x * (3.0 - 2.0 * x)
}

/// Scales a hair about its root to a length; one without length stays.
fn scale(hair: &mut [Vec3], length: f64) {
    let now = way(hair);
    let root = hair[0];
    if now > 0.0 {
        hair[1..].iter_mut().for_each(|p| *p = root + (*p - root) * (length / now));
    }
}

/// Ends a polyline at a length; false if it is not longer.
fn cut(line: &mut Vec<Vec3>, length: f64) -> bool {
    let mut arc = 0.0;
    for k in 1..line.len() {
        let side = (line[k] - line[k - 1]).norm();
        if arc + side > length {
            line[k] = line[k - 1] + (line[k] - line[k - 1]) * ((length - arc) / side);
            line.truncate(k + 1);
            return true;
        }
        arc += side;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::{samples, upright};
    use super::super::{Cluster, Owners, split};
    use super::*;
    use pelage_geom::rng::uniform;
    use std::f64::consts::TAU;

    #[test]
    fn lines_are_as_long_as_asked_and_go_straight_on_beyond_their_cluster() {
        let tree = Tree { cluster: vec![upright([0.0; 2], 1.0)] };
        let uv = [[0.2, 0.3], [0.0, 0.0], [5.0, 5.0]];
        let root = uv.map(|[x, y]| Vec3::new(x, y, 0.0));
        let of = Owners::find(&tree, &uv).at(3);
        assert_eq!(of, [0, 0, NONE]);
        let long = lines(&tree, &of, &uv, &root, Some(&[2.5, 9.0, 1.0]), 6, 0.1).expect("lines");
        for (line, (root, length)) in long.chunks(6).zip(root.iter().zip([2.5, 9.0, 0.0])) {
            assert!(line[0] == *root && (way(line) - length).abs() < 1e-12);
            assert!(line.windows(2).all(|w| ((w[1] - w[0]).norm() - length / 5.0).abs() < 1e-5));
        }
        assert!((long[11] - Vec3::z() * 9.0).norm() < 1e-9, "straight on along the cluster, which is 4 long");
        let whole = lines(&tree, &of, &uv, &root, None, 6, 0.1).expect("lines");
        assert!((way(&whole[..6]) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn hairs_begin_in_their_roots_and_end_in_their_cluster() {
        for cylinder in samples() {
            let mut tree = Tree { cluster: vec![Cluster { cylinder, ..upright([0.0; 2], 1.0) }] };
            split(&mut tree, 0, 3, 6).expect("children");
            let uv: Vec<[f64; 2]> = (0..200).map(|k| [0, 1].map(|i| 1.3 * uniform(4, k, 0, i) - 0.6)).collect();
            let root: Vec<Vec3> = uv.iter().map(|[x, y]| Vec3::new(*x, *y, 0.1 * x * y)).collect();
            let owners = Owners::find(&tree, &uv);
            let hairs = attach(&tree, &owners.last(), &uv, &root).expect("attached");
            let hairs: Vec<Rooted> = hairs.into_iter().filter(|h| h.cluster != NONE).collect();
            assert!(hairs.len() > 150 && hairs.iter().all(|h| (1..4).contains(&h.cluster)));
            let got = grow(&tree, &hairs, &[Length::Natural], 11, 0.5).expect("hairs");
            for (hair, got) in hairs.iter().zip(got.chunks(11)) {
                assert_eq!(got[0], hair.root);
                let shape = tree.shape(hair.cluster).expect("a shape");
                let off = hair.root - shape.point(hair.at[0], hair.at[1], 0.0);
                for (k, p) in got.iter().enumerate() {
                    let t = k as f64 / 10.0;
                    let x = t / (2.0 * off.norm() / shape.skeleton().length()).clamp(0.5, 1.0);
                    let share = if x < 1.0 { 1.0 - 3.0 * x * x + 2.0 * x * x * x } else { 0.0 };
                    assert!((p - shape.point(hair.at[0], hair.at[1], t) - off * share).norm() < 1e-12);
                }
            }
            // Lengths, mixed.
            let lengths: Vec<Length> =
                (0..hairs.len()).map(|k| if k % 2 == 0 { Length::Cut(1.3) } else { Length::Scaled(7.0) }).collect();
            let cut = grow(&tree, &hairs, &lengths, 11, 0.5).expect("hairs");
            let fine = grow(&tree, &hairs, &[Length::Natural], 41, 0.5).expect("hairs");
            for (k, (hair, whole)) in cut.chunks(11).zip(fine.chunks(41)).enumerate() {
                let wanted = if k % 2 == 0 { 1.3 } else { 7.0 };
                assert!((way(hair) / wanted - 1.0).abs() < 1e-9 && hair[0] == whole[0]);
                if k % 2 == 0 {
                    assert!(hair.iter().all(|p| curve::closest_on_polyline(whole, *p).3 < 0.01));
                }
            }
            let long = grow(&tree, &hairs, &[Length::Cut(100.0)], 11, 0.5).expect("hairs");
            assert!(long.iter().zip(&got).all(|(a, b)| (a - b).norm() < 1e-12));
        }
    }

    #[test]
    fn filling_is_even() {
        for cylinder in samples() {
            let shape = Shape::new(&cylinder).expect("a shape");
            let places = fill(&shape, 4000);
            assert_eq!(fill(&shape, 50), places[..50]);
            // Shares of the parts between rings and angles, against areas by sums over a fine grid.
            let section = shape.section(0.0);
            let part =
                |[r, theta]: [f64; 2]| (r * r * 4.0) as usize * 6 + ((theta / TAU).rem_euclid(1.0) * 6.0) as usize;
            let mut counted = [0.0; 24];
            places.iter().for_each(|p| counted[part(*p).min(23)] += 1.0);
            let mut area = [0.0; 24];
            let reach = 1.2 * section.ring.iter().copied().fold(0.0, f64::max) * section.scale[0].max(section.scale[1]);
            let side = |i: usize| (i as f64 / 300.0 - 1.0) * reach;
            for (i, j) in (0..600).flat_map(|i| (0..600).map(move |j| (i, j))) {
                let p = section.centre + section.axes[1] * side(i) + section.axes[2] * side(j);
                let at = section.coordinates(p);
                if at[0] < 1.0 {
                    area[part(at)] += 1.0;
                }
            }
            let all: f64 = area.iter().sum();
            for (c, a) in counted.iter().zip(area) {
                assert!((c - a / all * 4000.0).abs() < 12.0, "{c} {}", a / all * 4000.0);
            }
            // No two stand close: evenly spread points of this number are about a 60th of the width apart.
            let points: Vec<Vec3> = places[..1000].iter().map(|[r, a]| section.point(*r, *a)).collect();
            let spacing = (section.area() / 1000.0).sqrt();
            let close = points.iter().enumerate().flat_map(|(k, p)| points[..k].iter().map(move |q| (p - q).norm()));
            assert!(close.fold(f64::INFINITY, f64::min) > 0.1 * spacing);
        }
    }

    #[test]
    fn leaves_are_filled_by_their_areas() {
        let mut tree = Tree {
            cluster: samples().into_iter().map(|cylinder| Cluster { cylinder, ..upright([0.0; 2], 1.0) }).collect(),
        };
        let area: Vec<f64> = tree.shapes().expect("shapes").iter().map(|s| s.section(0.0).area()).collect();
        let children = split(&mut tree, 0, 6, 4).expect("children");
        let hairs = fill_leaves(&tree, 3000.0).expect("hairs");
        let of = |clusters: &[u32]| hairs.iter().filter(|h| clusters.contains(&h.cluster)).count() as f64;
        assert!((of(&children) / (3000.0 * area[0]) - 1.0).abs() < 0.03 && of(&[0]) == 0.0);
        assert!((1..5).all(|k| (of(&[k]) - 3000.0 * area[k as usize]).abs() <= 0.5));
        let grown = grow(&tree, &hairs, &[Length::Natural], 3, 1.0).expect("hairs");
        for (hair, line) in hairs.iter().zip(grown.chunks(3)) {
            let shape = tree.shape(hair.cluster).map(|s| s.point(hair.at[0], hair.at[1], 0.5)).expect("a point");
            assert!(line[0] == hair.root && (line[1] - shape).norm() < 1e-12);
        }
        assert!(fill_leaves(&tree, -1.0).unwrap_err().contains("can't be -1"));
        assert!(fill_leaves(&tree, 1e12).unwrap_err().contains("too many"));
        assert!(fill_leaves(&tree, f64::NAN).is_err());
    }

    #[test]
    fn clump_lines_are_skeletons() {
        let c = samples().swap_remove(1);
        let shape = Shape::new(&c).expect("a shape");
        let got = line(&shape, 20);
        assert!((got[0] - c.control[0]).norm() < 1e-12 && (got[19] - c.control[4]).norm() < 1e-9);
        assert!(got.iter().enumerate().all(|(k, p)| (p - shape.point(0.0, 0.0, k as f64 / 19.0)).norm() < 1e-12));
        assert_eq!(line(&shape, 1).len(), 1);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let tree = Tree { cluster: vec![upright([0.0; 2], 1.0)] };
        let hair = Rooted { root: Vec3::zeros(), cluster: 0, at: [0.5, 0.0] };
        let of = |h: Rooted, l: &[Length], points, blend| grow(&tree, &[h], l, points, blend).unwrap_err();
        assert!(of(hair, &[Length::Natural], 1, 0.5).contains("2 points"));
        assert!(of(hair, &[Length::Natural], 3, 0.0).contains("over 0"));
        assert!(of(hair, &[], 3, 1.0).contains("0 lengths for 1 hairs"));
        assert!(of(hair, &[Length::Cut(f64::NAN)], 3, 1.0).contains("length 0"));
        assert!(of(Rooted { cluster: NONE, ..hair }, &[Length::Natural], 3, 1.0).contains("hair 0 has no cluster"));
        assert!(of(Rooted { cluster: 4, ..hair }, &[Length::Natural], 3, 1.0).contains("cluster 4 of 1"));
        assert!(attach(&tree, &[], &[[0.0; 2]], &[]).is_err());
    }
}
