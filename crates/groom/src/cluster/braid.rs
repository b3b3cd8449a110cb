//! Braids: a cluster is parted among strands that weave along it.

use super::split::cells;
use super::{Cluster, Curve, Cylinder, Region, Shape, Tree, fade};
use pelage_geom::Vec3;
use std::f64::consts::TAU;

/// Half the depth of a braid over half its width. Flatter, and strands touch sooner; rounder, and it looks like a rope.
const DEPTH: f64 = 0.6;

/// Control points of a strand a turn. With 12 three strands come nearer than they should by 6 % of their width, with 18 by
/// 1.4 %, with 24 by 0.2 %; more only cost time.
const PER_TURN: f64 = 24.0;

/// How a cluster is braided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Braid {
    /// Strands: 3, 5, 7 or 9. With an even number their paths meet.
    pub strands: usize,
    /// Times that each strand comes back to its side, along the whole cluster.
    pub turns: f64,
    /// Share of the length over which strands come together from their roots, above 0 and below 1.
    pub start: f64,
}

/// Half the least distance of strands whose paths are (sin a, DEPTH sin 2a), one a phase.
fn touching(strands: usize) -> f64 {
    const STEPS: usize = 720;
    let path = |a: f64| [libm::sin(a), DEPTH * libm::sin(2.0 * a)];
    let gap = |a: f64, j: usize| {
        let (p, q) = (path(a), path(a + TAU * j as f64 / strands as f64));
        ((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1])).sqrt()
    };
    let all = (0..STEPS).flat_map(|k| (1..strands).map(move |j| (k, j)));
    0.5 * all.map(|(k, j)| gap(TAU * k as f64 / STEPS as f64, j)).fold(f64::INFINITY, f64::min)
}

/// Splits a cluster without children into the strands of a braid, and gives their numbers.
///
/// Across the cluster, in shares of its contour, strand j of n is at `w (sin a, 0.6 sin 2 a)` with `a = 2 pi (turns t + j / n)`:
/// an eight on its side, along which strands follow each other, over and under. Their radius `r` is as large as it can be
/// without strands that meet, and `w + r = 1`: the braid fills the contour. Roots are parted as by [`super::split`], and
/// strands come from there over the first `start` of the length.
pub fn braid(tree: &mut Tree, cluster: u32, braid: &Braid) -> Result<Vec<u32>, String> {
    let Braid { strands: n, turns, start } = *braid;
    if !(3..=9).contains(&n) || n.is_multiple_of(2) {
        return Err(format!("a braid has 3, 5, 7 or 9 strands, not {n}"));
    }
    if !(turns.abs() <= 1e3 && start > 0.0 && start < 1.0) {
        return Err(format!("a braid of {turns} turns that starts over {start} of its length"));
    }
    let parent = tree.of(cluster)?;
    if !tree.children(cluster).is_empty() {
        return Err(format!("cluster {cluster} is split already"));
    }
    let shape = tree.shape(cluster)?;
    // Strands of a path of half width 1 are as wide as `half`.
    let half = touching(n);
    let (way, radius) = (1.0 / (1.0 + half), half / (1.0 + half));
    // The strand that begins farthest to one side gets the roots there.
    let across = |a: f64| [way * libm::sin(a), way * DEPTH * libm::sin(2.0 * a)];
    let mut phase: Vec<f64> = (0..n).map(|j| TAU * j as f64 / n as f64).collect();
    phase.sort_by(|a, b| across(*a)[0].total_cmp(&across(*b)[0]));
    let untwisted = parent.cylinder.twist.at(0.0);
    let mut regions: Vec<([f64; 2], Region)> = cells(&parent.region, n)
        .into_iter()
        .map(|cell| {
            let [r, angle] = parent.region.polar(cell.centre);
            let (sin, cos) = libm::sincos(angle - untwisted);
            ([r * cos, r * sin], cell)
        })
        .collect();
    regions.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    let whole = parent.region.area();
    let points = ((turns.abs() * PER_TURN).ceil() as usize + 1).max(parent.cylinder.control.len()).max(8);
    let strand = |((root, region), phase): (([f64; 2], Region), &f64)| {
        let share = (region.area() / whole).sqrt();
        let at = |k: usize| {
            let t = k as f64 / (points - 1) as f64;
            let woven = 1.0 - fade(t / start);
            let to = across(TAU * turns * t + phase);
            let [x, y] = [0, 1].map(|i| root[i] + (to[i] - root[i]) * woven);
            let section = shape.section(t);
            let point = section.point((x * x + y * y).sqrt(), libm::atan2(y, x));
            (point, section.girth() * (share + (radius - share) * woven))
        };
        let (control, width): (Vec<Vec3>, Vec<f64>) = (0..points).map(at).unzip();
        let first = shape.section(0.0);
        let mut out = Cylinder::plain(control, first.axes[0], first.axes[1], vec![1.0]);
        out.twist = Curve::constant(untwisted);
        let t = Shape::new(&out)?.skeleton().control_t();
        out.scale = [0, 1].map(|_| Curve { t: t.clone(), value: width.clone() });
        Ok(Cluster { parent: cluster, region, cylinder: out })
    };
    let children: Vec<Cluster> = regions.into_iter().zip(&phase).map(strand).collect::<Result<_, String>>()?;
    let first = tree.cluster.len() as u32;
    tree.cluster.extend(children);
    Ok((first..first + n as u32).collect())
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::upright;
    use super::super::{Paste, copy, paste};
    use super::*;

    const BRAID: Braid = Braid { strands: 3, turns: 3.0, start: 0.1 };

    fn plait(strands: usize) -> Tree {
        let mut tree = Tree { cluster: vec![upright([0.3, 0.1], 0.2)] };
        braid(&mut tree, 0, &Braid { strands, ..BRAID }).expect("a braid");
        tree
    }

    #[test]
    fn strands_touch_but_do_not_meet_and_stay_within() {
        for n in [3, 5] {
            let tree = plait(n);
            let shape = tree.shape(0).unwrap();
            let mut closest = f64::INFINITY;
            for k in 20..=100 {
                let t = f64::from(k) / 100.0;
                let section = shape.section(t);
                // Where each strand goes through the section.
                let through: Vec<(Vec3, f64)> = (1..=n as u32)
                    .map(|j| {
                        let strand = tree.shape(j).unwrap();
                        let at = |s: f64| strand.skeleton().place(s).at;
                        let beyond = |s: f64| (at(s) - section.centre).dot(&section.axes[0]);
                        let (mut low, mut high) = (0.0, 1.0);
                        for _ in 0..60 {
                            let middle = 0.5 * (low + high);
                            *(if beyond(middle) > 0.0 { &mut high } else { &mut low }) = middle;
                        }
                        (at(low), strand.section(low).girth())
                    })
                    .collect();
                for (i, (p, r)) in through.iter().enumerate() {
                    assert!((p - section.centre).norm() + r < 1.02 * section.girth(), "{n} strands at {t}");
                    for (q, s) in &through[..i] {
                        closest = closest.min((p - q).norm() / (r + s));
                    }
                }
            }
            assert!((0.99..1.1).contains(&closest), "{n} strands come as close as {closest} of what they need");
        }
    }

    #[test]
    fn each_strand_visits_both_sides_and_goes_over_and_under() {
        let tree = plait(3);
        let shape = tree.shape(0).unwrap();
        for j in 1..=3 {
            let strand = tree.shape(j).unwrap();
            let (mut turns, mut over) = (0, 0);
            let mut before = [0.0; 2];
            for k in 30..=300 {
                let p = strand.skeleton().place(f64::from(k) / 300.0).at;
                let section = shape.section(0.0);
                let d = p - section.centre;
                let now = [d.dot(&section.axes[1]), d.dot(&section.axes[2])];
                turns += usize::from(before[0] * now[0] < 0.0);
                over += usize::from(before[1] * now[1] < 0.0);
                before = now;
            }
            // Each turn crosses the middle twice, and the plane between over and under four times.
            assert!((4..=6).contains(&turns) && (9..=12).contains(&over), "strand {j}: {turns} and {over}");
        }
    }

    #[test]
    fn a_braid_is_pasted_onto_its_strands_twice() {
        let mut tree = plait(3);
        let leaves =
            |tree: &Tree| (0..tree.cluster.len() as u32).filter(|k| tree.leaves()[*k as usize]).collect::<Vec<_>>();
        for from in [0, 1] {
            let style = copy(&tree, from).unwrap();
            for leaf in leaves(&tree) {
                paste(&mut tree, &style, leaf, Paste::Below).unwrap();
            }
        }
        assert_eq!(leaves(&tree).len(), 27);
        assert_eq!(tree.levels().iter().max(), Some(&3));
        // The last strands are within their grandparent.
        let shape = tree.shape(0).unwrap();
        for leaf in leaves(&tree) {
            let strand = tree.shape(leaf).unwrap();
            for k in 0..=50 {
                let p = strand.skeleton().place(f64::from(k) / 50.0).at;
                let c = super::super::coordinates(&shape, p, f64::from(k) / 50.0);
                assert!(c.r < 1.05, "cluster {leaf} at {k}: {}", c.r);
            }
        }
    }

    #[test]
    fn what_cannot_be_braided_is_said() {
        let mut tree = plait(3);
        assert!(braid(&mut tree, 0, &BRAID).unwrap_err().contains("split already"));
        assert!(braid(&mut tree, 1, &Braid { strands: 4, ..BRAID }).unwrap_err().contains("not 4"));
        assert!(braid(&mut tree, 1, &Braid { start: 0.0, ..BRAID }).is_err());
        assert!(braid(&mut tree, 9, &BRAID).unwrap_err().contains("no cluster 9"));
    }
}
