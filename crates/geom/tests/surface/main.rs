//! Laws of the skin: topology, poses, closest points, paths.

mod bvh;
mod pose;
mod shapes;
mod topology;
