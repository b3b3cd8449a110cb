//! Which clusters a root belongs to.

use super::Tree;
use pelage_geom::NONE;
use rayon::prelude::*;

/// The owners of H hairs at each level of a tree, what clumps are made of: level by level, hairs of one owner move
/// together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Owners {
    /// Levels of the tree.
    pub levels: usize,
    /// \[H * levels\] owner at each level, the top first; [`NONE`] where there is none, at the top and below a leaf.
    pub owner: Vec<u32>,
}

impl Owners {
    /// Finds the owners of roots (`uv`, in scalp space). The paper's FINDOWNER: from the top, at each level the child
    /// of the owner that contains the root, of several the one with the nearest centre. Where no child does and the
    /// owner is no leaf, the leaf below it with the nearest centre. Distances of one level are not compared with those
    /// of another; of equal ones the first counts.
    pub fn find(tree: &Tree, uv: &[[f64; 2]]) -> Self {
        let levels = tree.levels().iter().max().map_or(0, |l| l + 1);
        let n = tree.cluster.len() as u32;
        let mut children = vec![Vec::new(); n as usize];
        for k in 0..n {
            if let Some(of) = children.get_mut(tree.cluster[k as usize].parent as usize) {
                of.push(k);
            }
        }
        let top = tree.children(NONE);
        let leaves: Vec<Vec<u32>> =
            (0..n).map(|k| tree.below(k).into_iter().filter(|k| children[*k as usize].is_empty()).collect()).collect();
        let nearest = |at: [f64; 2], among: &[u32], inside: bool| {
            let mut best = (f64::INFINITY, None);
            for &k in among {
                let region = &tree.cluster[k as usize].region;
                let distance = region.distance_squared(at);
                if distance < best.0 && (!inside || region.contains(at)) {
                    best = (distance, Some(k));
                }
            }
            best.1
        };
        let mut owner = vec![NONE; uv.len() * levels];
        owner.par_chunks_mut(levels.max(1)).zip(uv).for_each(|(path, &at)| {
            let mut among = &top;
            let mut last = NONE;
            for place in path.iter_mut() {
                let Some(k) = nearest(at, among, true) else { break };
                (*place, last) = (k, k);
                among = &children[k as usize];
            }
            if last != NONE && !children[last as usize].is_empty() {
                // The way to the leaf, from its end.
                let mut up = Vec::new();
                let mut k = nearest(at, &leaves[last as usize], false).unwrap_or(last);
                while k != last {
                    up.push(k);
                    k = tree.cluster[k as usize].parent;
                }
                let from = path.iter().position(|p| *p == NONE).unwrap_or(levels);
                path[from..].iter_mut().zip(up.into_iter().rev()).for_each(|(p, k)| *p = k);
            }
        });
        Owners { levels, owner }
    }

    /// Owners of hair `h`, the top first.
    pub fn path(&self, h: usize) -> &[u32] {
        &self.owner[h * self.levels..(h + 1) * self.levels]
    }

    /// \[H\] the last owner of each hair, or [`NONE`].
    pub fn last(&self) -> Vec<u32> {
        (0..self.owner.len() / self.levels.max(1)).map(|h| self.leaf(h)).collect()
    }

    /// \[H\] the owner of each hair at a level: its last if it has none there.
    pub fn at(&self, level: usize) -> Vec<u32> {
        let own = |h: usize| self.path(h).get(level).copied().filter(|k| *k != NONE);
        (0..self.owner.len() / self.levels.max(1)).map(|h| own(h).unwrap_or_else(|| self.leaf(h))).collect()
    }

    /// The last owner of hair `h`, or [`NONE`].
    pub fn leaf(&self, h: usize) -> u32 {
        self.path(h).iter().rev().copied().find(|k| *k != NONE).unwrap_or(NONE)
    }
}

/// \[clusters\] which of the hairs of each cluster is the nearest to its middle, or [`NONE`] for one without hairs. `of`: the
/// cluster of each hair or [`NONE`]; `uv`: its root in scalp space.
pub fn middles(tree: &Tree, of: &[u32], uv: &[[f64; 2]]) -> Vec<u32> {
    let mut best = vec![(f64::INFINITY, NONE); tree.cluster.len()];
    for (h, (k, at)) in of.iter().zip(uv).enumerate().filter(|(_, (k, _))| **k != NONE) {
        let r = tree.cluster[*k as usize].region.polar(*at)[0];
        let best = &mut best[*k as usize];
        *best = if r < best.0 { (r, h as u32) } else { *best };
    }
    best.into_iter().map(|b| b.1).collect()
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::upright;
    use super::super::{Cluster, Tree, split};
    use super::*;
    use pelage_geom::rng::uniform;

    /// The rule in its plainest form.
    fn plain(tree: &Tree, at: [f64; 2]) -> Vec<u32> {
        let mut path = Vec::new();
        let mut of = NONE;
        loop {
            let mut best = (f64::INFINITY, NONE);
            for k in tree.children(of) {
                let c = &tree.cluster[k as usize].region;
                let d = c.distance_squared(at).sqrt();
                let angle = libm::atan2(at[1] - c.centre[1], at[0] - c.centre[0]);
                if d <= c.radius(angle) && d < best.0 {
                    best = (d, k);
                }
            }
            if best.1 == NONE {
                break;
            }
            path.push(best.1);
            of = best.1;
        }
        if of != NONE && !tree.children(of).is_empty() {
            let mut best = (f64::INFINITY, NONE);
            for k in tree.below(of).into_iter().filter(|k| tree.children(*k).is_empty()) {
                let d = tree.cluster[k as usize].region.distance_squared(at);
                best = if d < best.0 { (d, k) } else { best };
            }
            let mut up = vec![best.1];
            while tree.cluster[up[up.len() - 1] as usize].parent != of {
                up.push(tree.cluster[up[up.len() - 1] as usize].parent);
            }
            path.extend(up.into_iter().rev());
        }
        path
    }

    #[test]
    fn owners_are_those_of_the_plain_rule() {
        let mut tree = Tree { cluster: vec![upright([0.0, 0.0], 1.0), upright([1.2, 0.3], 0.9)] };
        let first = split(&mut tree, 0, 5, 4).expect("children");
        split(&mut tree, first[2], 4, 4).expect("children");
        split(&mut tree, 1, 3, 4).expect("children");
        // Holes: some children shrink.
        for k in [3, 8, 9] {
            tree.cluster[k].region.radius.iter_mut().for_each(|r| *r *= 0.4);
        }
        let uv: Vec<[f64; 2]> = (0..3000).map(|k| [0, 1].map(|i| 3.6 * uniform(2, k, 0, i) - 1.3)).collect();
        let owners = Owners::find(&tree, &uv);
        assert_eq!(owners.levels, 3);
        let leaf = tree.leaves();
        let mut deep = 0;
        for (h, at) in uv.iter().enumerate() {
            let path: Vec<u32> = owners.path(h).iter().copied().filter(|k| *k != NONE).collect();
            assert_eq!(path, plain(&tree, *at), "{at:?}");
            assert_eq!(owners.leaf(h), path.last().copied().unwrap_or(NONE));
            assert!(path.last().is_none_or(|k| leaf[*k as usize]));
            deep += usize::from(path.len() == 3);
        }
        assert!(deep > 50 && (0..3000).any(|h| owners.leaf(h) == NONE));
    }

    #[test]
    fn a_child_farther_than_its_parent_owns_what_it_contains() {
        // The centre of the only child is farther away than its parent's.
        let child = Cluster { parent: 0, ..upright([0.5, 0.0], 0.6) };
        let tree = Tree { cluster: vec![upright([0.0, 0.0], 1.0), child] };
        assert_eq!(Owners::find(&tree, &[[0.01, 0.0], [0.0, 3.0]]).owner, [0, 1, NONE, NONE]);
        assert_eq!(Owners::find(&Tree::default(), &[[0.0; 2]]).levels, 0);
        assert_eq!(Owners::find(&Tree::default(), &[[0.0; 2]]).leaf(0), NONE);
    }
}
