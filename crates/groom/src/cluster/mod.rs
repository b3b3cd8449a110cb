//! Hair as a tree of generalized cylinders: a few large clusters, split again and again into smaller ones.
//!
//! After Kim, Neumann, "Interactive multiresolution hair modeling and editing" (SIGGRAPH 2002; course notes 2003). A
//! cluster is a [`Cylinder`]: a skeleton with contours, scales and a twist along it. Where it stands on the skin is a
//! [`Region`] of scalp space, a plane that the roots have coordinates in: texture coordinates, or what else the caller
//! likes; where these stretch, clusters stretch with them. [`split`] fills a cluster with children, [`bind`] and
//! [`update`] carry them through edits of their parent, [`copy`] and [`paste`] bring a style from one cluster to
//! another, [`Owners`] says which clusters a root belongs to, and [`grow`] lets its hair follow the last of them.
//!
//! Coordinates in a cluster: `t` from 0 at the root to 1 at the tip by the arc length of the skeleton; `theta` in the
//! section, in radians; `r` from 0 on the skeleton to 1 on the contour, and beyond outside.

mod bind;
mod braid;
mod curve;
mod cylinder;
mod grow;
mod owner;
mod region;
mod shape;
mod skeleton;
mod split;
mod style;
#[cfg(test)]
mod test_clusters;
mod tree;

pub use bind::{Bound, Coordinates, bind, coordinates, edit, position, update};
pub use braid::{Braid, braid};
pub use curve::Curve;
pub use cylinder::{Contour, Cylinder};
pub use grow::{Length, Rooted, attach, fade, fill, fill_leaves, grow, line, lines};
pub use owner::{Owners, middles};
pub use region::Region;
pub use shape::{Section, Shape};
pub use skeleton::{Place, Skeleton};
pub use split::split;
pub use style::{Paste, Style, copy, paste};
pub use tree::{Cluster, Tree};
