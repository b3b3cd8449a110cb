//! Copy and paste: the style of a cluster and of all that was split from it, for another cluster.

use super::bind::{Bound, bind, update};
use super::region::seen;
use super::{Cluster, Region, Tree};
use pelage_geom::NONE;
use std::f64::consts::TAU;

/// Angles of a region that was a circle and is pasted into another form.
const ANGLES: usize = 24;

/// A copied cluster with all that was split from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// The cluster itself (number 0) and what is below it, where they were.
    pub tree: Tree,
    /// What is below it, bound to its parents.
    pub bound: Vec<Bound>,
}

/// How much of a style is pasted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paste {
    /// All of it: the target takes the copied skeleton, contours, scales and twist as well, in its own root frame and
    /// scaled by its own size (the girth at its root). A congruent target gets a rigid copy.
    Whole,
    /// What is below the cluster: the target stays as it is, and its new children lie in it as the copied ones lay in
    /// their parent (the paper's copy and paste).
    Below,
}

/// Copies the style of a cluster at any level.
pub fn copy(tree: &Tree, cluster: u32) -> Result<Style, String> {
    let top = Cluster { parent: NONE, ..tree.of(cluster)?.clone() };
    let below = tree.below(cluster);
    let mut copied = vec![top];
    for k in &below {
        let c = &tree.cluster[*k as usize];
        let parent = below.binary_search(&c.parent).map_or(0, |at| at as u32 + 1);
        copied.push(Cluster { parent, ..c.clone() });
    }
    let tree = Tree { cluster: copied };
    tree.check()?;
    Ok(Style { bound: bind(&tree, 0)?, tree })
}

/// Pastes a style onto a cluster at any level: what was split from it before goes, and copies of what is below the
/// copied cluster come, last in the tree. Their regions lie in its region as they lay in theirs. A tree that can't be
/// pasted to stays as it is.
pub fn paste(tree: &mut Tree, style: &Style, target: u32, how: Paste) -> Result<(), String> {
    let mut out = tree.clone();
    let Some((from, below)) = style.tree.cluster.split_first() else { return Err("an empty style".into()) };
    let size = |tree: &Tree, k: u32| {
        let girth = tree.shape(k)?.section(0.0).girth();
        if girth > 0.0 { Ok(girth) } else { Err(format!("cluster {k} has no width at its root")) }
    };
    out.of(target)?;
    out.prune(target);
    // Its number has not changed: what was below it came after it.
    let to = out.of(target)?.clone();
    let first = out.cluster.len() as u32;
    for c in below {
        let parent = if c.parent == 0 { target } else { first + c.parent - 1 };
        out.cluster.push(Cluster { parent, region: carried(&c.region, &from.region, &to.region), ..c.clone() });
    }
    match how {
        Paste::Whole => {
            let source = from.cylinder.root_motion(size(&style.tree, 0)?);
            let motion = to.cylinder.root_motion(size(&out, target)?) * source.inverse();
            let copies = first as usize..out.cluster.len();
            out.cluster[copies].iter_mut().for_each(|c| c.cylinder = c.cylinder.moved(&motion));
            out.cluster[target as usize].cylinder = from.cylinder.moved(&motion);
        }
        Paste::Below => {
            let number = |b: &Bound| Bound { cluster: first + b.cluster - 1, ..b.clone() };
            update(&mut out, &style.bound.iter().map(number).collect::<Vec<_>>())?;
        }
    }
    out.check()?;
    *tree = out;
    Ok(())
}

/// A region within `from`, carried to where it would be within `to`.
fn carried(region: &Region, from: &Region, to: &Region) -> Region {
    let carry = |at: [f64; 2]| to.at(from.polar(at));
    let centre = carry(region.centre);
    if [region, from, to].iter().all(|r| r.radius.len() == 1) {
        return Region::circle(centre, region.radius[0] * to.radius[0] / from.radius[0]);
    }
    let angles = if region.radius.len() == 1 { ANGLES } else { region.radius.len() };
    let corner = |k: usize| {
        let [x, y] = carry(region.at([1.0, TAU * k as f64 / angles as f64]));
        [x - centre[0], y - centre[1]]
    };
    Region { centre, radius: seen(&(0..angles).map(corner).collect::<Vec<_>>(), angles) }
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::{far, motion, samples, upright};
    use super::super::{Shape, split};
    use super::*;
    use nalgebra::Similarity3;

    /// A tree of the sample `k`, split twice, its children edited, and a second cluster of its form moved by `by`.
    fn pair(k: usize, by: &Similarity3<f64>) -> Tree {
        let cylinder = samples().swap_remove(k);
        let first = Cluster { cylinder: cylinder.clone(), ..upright([0.2, 0.4], 0.3) };
        let second = Cluster { cylinder: cylinder.moved(by), ..upright([0.7, 0.1], 0.3 * by.scaling()) };
        let mut tree = Tree { cluster: vec![first, second] };
        let children = split(&mut tree, 0, 3, 5).expect("children");
        split(&mut tree, children[1], 2, 5).expect("children");
        tree.cluster[3].cylinder.twist.value[2] += 1.0;
        tree.cluster[3].cylinder.control[3] *= 1.01;
        tree
    }

    #[test]
    fn a_congruent_cluster_gets_a_rigid_copy() {
        for k in 0..samples().len() {
            let by = motion();
            for how in [Paste::Whole, Paste::Below] {
                let mut tree = pair(k, &by);
                let style = copy(&tree, 0).expect("a style");
                // Its own children make place.
                split(&mut tree, 1, 4, 4).expect("children");
                let size = tree.shape(0).expect("a shape").widest();
                let mut wanted = tree.clone();
                wanted.prune(1);
                paste(&mut tree, &style, 1, how).expect("pasted");
                for c in 2..7 {
                    let of = wanted.cluster[c].clone();
                    let parent = if of.parent == 0 { 1 } else { of.parent + 5 };
                    let [u, v] = of.region.centre;
                    let region = Region { centre: [u + 0.5, v - 0.3], ..of.region };
                    wanted.cluster.push(Cluster { parent, region, cylinder: of.cylinder.moved(&by) });
                }
                assert!(far(&tree, &wanted) < 1e-9 * size, "{k} {how:?}: {}", far(&tree, &wanted));
                for (a, b) in tree.cluster.iter().zip(&wanted.cluster) {
                    assert_eq!((a.parent, a.region.radius.len()), (b.parent, b.region.radius.len()));
                    assert!((0..2).all(|i| (a.region.centre[i] - b.region.centre[i]).abs() < 1e-12));
                    assert!(a.region.radius.iter().zip(&b.region.radius).all(|(x, y)| (x - y).abs() < 1e-9));
                }
            }
        }
    }

    #[test]
    fn larger_clusters_get_larger_copies_at_any_level() {
        let by = Similarity3::from_isometry(motion().isometry, 2.5);
        for how in [Paste::Whole, Paste::Below] {
            let mut tree = pair(1, &by);
            let style = copy(&tree, 0).expect("a style");
            paste(&mut tree, &style, 1, how).expect("pasted");
            let of =
                |k: usize| tree.shape(k as u32).map(|s| (s.skeleton().length(), s.section(0.5).girth())).expect("it");
            for k in 2..7 {
                let (a, b) = (of(k), of(k + 5));
                assert!((b.0 / a.0 / 2.5 - 1.0).abs() < 1e-9 && (b.1 / a.1 / 2.5 - 1.0).abs() < 1e-9, "{how:?} {k}");
                let (a, b) = (&tree.cluster[k].region, &tree.cluster[k + 5].region);
                assert!((b.radius(1.0) / a.radius(1.0) - 2.5).abs() < 1e-9);
            }
            // From the second level to the third, into itself.
            let inner = copy(&tree, 3).expect("a style");
            let before = tree.cluster.len();
            paste(&mut tree, &inner, 5, how).expect("pasted");
            assert_eq!((tree.cluster.len(), tree.children(5).len()), (before + 2, 2));
            assert!(tree.check().is_ok());
        }
    }

    #[test]
    fn below_a_bent_target_children_keep_their_coordinates() {
        let mut tree = pair(1, &motion());
        let n = tree.cluster[1].cylinder.control.len();
        for (k, p) in tree.cluster[1].cylinder.control.iter_mut().enumerate() {
            p.x += 0.3 * (k * k) as f64 / (n * n) as f64;
        }
        let bent = tree.cluster[1].cylinder.clone();
        let style = copy(&tree, 0).expect("a style");
        paste(&mut tree, &style, 1, Paste::Below).expect("pasted");
        assert_eq!(tree.cluster[1].cylinder, bent);
        let (a, b) = (Shape::new(&tree.cluster[0].cylinder), Shape::new(&bent));
        let (a, b) = (a.expect("a shape"), b.expect("a shape"));
        for (p, q) in tree.cluster[2].cylinder.control.iter().zip(&tree.cluster[7].cylinder.control) {
            let c = super::super::coordinates(&a, *p, 0.5);
            assert!((super::super::position(&b, &c) - q).norm() < 1e-9);
        }
        assert!(paste(&mut tree, &style, 99, Paste::Whole).unwrap_err().contains("no cluster 99"));
        assert!(copy(&tree, 99).unwrap_err().contains("no cluster 99"));
    }
}
