//! How far the mesh is at least.

use super::{Bvh, STACK, Waiting};
use crate::Vec3;

/// Square of the factor by which a bound may fall short of the distance to the nearest leaf. At 1 points far from a round
/// mesh look into all of it; at 16 those who march by the bound take more steps than they save.
const SHORT: f64 = 4.0;

impl Bvh {
    /// A lower bound of the distance to the mesh, several times cheaper than [`Bvh::closest`] far from it: at least half
    /// the distance to the nearest leaf's box, 0 in such boxes; `limit` if it is more than that. No sign.
    pub fn distance_bound(&self, query: Vec3, limit: f64) -> f64 {
        let Some(root) = &self.root else { return limit };
        if query.iter().chain([&limit]).any(|x| x.is_nan()) {
            return 0.0;
        }
        let mut reach = limit * limit;
        let mut bound = reach;
        let mut stack = [Waiting::default(); STACK];
        stack[0] = root.waiting(|n| n.square_distance(&query));
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = stack[depth];
            if node.far * SHORT >= reach {
                // What is not looked into is at least this far.
                bound = bound.min(node.far);
            } else if node.count > 0 {
                reach = reach.min(node.far);
            } else {
                let (near, next) = self.pair[node.start as usize].order(|n| n.square_distance(&query));
                stack[depth] = next;
                stack[depth + 1] = near;
                depth += 2;
            }
        }
        bound.min(reach).sqrt()
    }
}
