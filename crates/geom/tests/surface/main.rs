//! Laws of the skin: topology, poses, closest points, paths.

mod bvh;
mod path;
mod pose;
mod shapes;
mod topology;
