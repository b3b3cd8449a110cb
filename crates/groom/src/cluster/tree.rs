//! The hair tree.

use super::{Cylinder, Region, Shape};
use pelage_geom::NONE;

/// A cluster of the hair tree.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// The cluster it was split from, or [`NONE`].
    pub parent: u32,
    /// Where its roots are.
    pub region: Region,
    /// What its hairs follow. An angle of the region is theta + W(0) of the cylinder.
    pub cylinder: Cylinder,
}

/// Clusters, parents before their children. What comes from a file is checked first ([`Tree::check`]); the other
/// functions do not fail on an unsound tree, but may miss clusters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// \[N\] the clusters.
    pub cluster: Vec<Cluster>,
}

impl Tree {
    /// Says what is wrong with it, and with which cluster.
    pub fn check(&self) -> Result<(), String> {
        for (k, c) in self.cluster.iter().enumerate() {
            if c.parent != NONE && c.parent as usize >= k {
                return Err(format!("cluster {k} comes before its parent, cluster {}", c.parent));
            }
            c.region.check().map_err(|e| format!("cluster {k}: {e}"))?;
        }
        self.shapes().map(|_| ())
    }

    /// \[N\] the cylinders, ready for evaluation; says which one is wrong, and how.
    pub fn shapes(&self) -> Result<Vec<Shape<'_>>, String> {
        (0..self.cluster.len()).map(|k| self.shape(k as u32)).collect()
    }

    /// The cylinder of a cluster, ready for evaluation.
    pub fn shape(&self, cluster: u32) -> Result<Shape<'_>, String> {
        Shape::new(&self.of(cluster)?.cylinder).map_err(|e| format!("cluster {cluster}: {e}"))
    }

    /// A cluster, or that there is none of this number.
    pub(super) fn of(&self, cluster: u32) -> Result<&Cluster, String> {
        let n = self.cluster.len();
        self.cluster.get(cluster as usize).ok_or_else(|| format!("there is no cluster {cluster} among {n}"))
    }

    /// Children of a cluster in order; of [`NONE`], the top-level clusters.
    pub fn children(&self, of: u32) -> Vec<u32> {
        (0..self.cluster.len() as u32).filter(|k| self.cluster[*k as usize].parent == of).collect()
    }

    /// All that was split from a cluster, parents before their children, without itself.
    pub fn below(&self, cluster: u32) -> Vec<u32> {
        let mut is = vec![false; self.cluster.len()];
        let mut out = Vec::new();
        for (k, c) in self.cluster.iter().enumerate() {
            if c.parent != NONE && (c.parent == cluster || is.get(c.parent as usize).is_some_and(|is| *is)) {
                is[k] = true;
                out.push(k as u32);
            }
        }
        out
    }

    /// \[N\] true for clusters without children.
    pub fn leaves(&self) -> Vec<bool> {
        let mut leaf = vec![true; self.cluster.len()];
        for c in &self.cluster {
            if let Some(leaf) = leaf.get_mut(c.parent as usize) {
                *leaf = false;
            }
        }
        leaf
    }

    /// \[N\] levels: 0 at the top.
    pub fn levels(&self) -> Vec<usize> {
        let mut level: Vec<usize> = Vec::with_capacity(self.cluster.len());
        for c in &self.cluster {
            level.push(level.get(c.parent as usize).map_or(0, |l| l + 1));
        }
        level
    }

    /// Removes all that was split from a cluster. Clusters behind those that go get lower numbers; its own stays.
    pub fn prune(&mut self, cluster: u32) {
        let gone = self.below(cluster);
        let mut number = Vec::with_capacity(self.cluster.len());
        let mut kept = 0;
        for k in 0..self.cluster.len() as u32 {
            let stays = gone.binary_search(&k).is_err();
            number.push(if stays { kept } else { NONE });
            kept += u32::from(stays);
        }
        let mut k = 0;
        self.cluster.retain(|_| {
            k += 1;
            number[k - 1] != NONE
        });
        let now = |parent: u32| number.get(parent as usize).copied().unwrap_or(NONE);
        self.cluster.iter_mut().for_each(|c| c.parent = now(c.parent));
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::{plain, upright};
    use super::*;
    use pelage_geom::Vec3;

    fn tree(parents: &[u32]) -> Tree {
        let of = |(k, parent): (usize, &u32)| Cluster { parent: *parent, ..upright([k as f64, 0.0], 0.5) };
        Tree { cluster: parents.iter().enumerate().map(of).collect() }
    }

    #[test]
    fn relations_and_pruning() {
        let mut t = tree(&[NONE, NONE, 0, 1, 2, 0, 4, 3]);
        assert!(t.check().is_ok());
        assert_eq!((t.children(NONE), t.children(0), t.below(0)), (vec![0, 1], vec![2, 5], vec![2, 4, 5, 6]));
        assert_eq!(t.levels(), [0, 0, 1, 1, 2, 1, 3, 2]);
        assert_eq!(t.leaves(), [false, false, false, false, false, true, true, true]);
        t.prune(0);
        let u: Vec<f64> = t.cluster.iter().map(|c| c.region.centre[0]).collect();
        let parents: Vec<u32> = t.cluster.iter().map(|c| c.parent).collect();
        assert_eq!((u, parents), (vec![0.0, 1.0, 3.0, 7.0], vec![NONE, NONE, 1, 2]));
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert!(tree(&[NONE, 1]).check().unwrap_err().contains("cluster 1 comes before its parent"));
        let mut t = tree(&[7, 1, 9]);
        assert!(t.check().is_err());
        assert_eq!((t.levels(), t.below(1), t.leaves()), (vec![0; 3], vec![1], vec![true, false, true]));
        t.prune(1);
        assert_eq!(t.cluster.len(), 2);
        let mut t = tree(&[NONE, 0]);
        t.cluster[1].cylinder = plain(vec![Vec3::zeros()], 1.0);
        assert!(t.check().unwrap_err().starts_with("cluster 1: a skeleton"));
        assert!(t.shape(2).map(|_| ()).unwrap_err().contains("no cluster 2 among 2"));
        t.cluster[0].region.radius.clear();
        assert!(t.check().unwrap_err().starts_with("cluster 0: a region"));
    }
}
