//! Laws of the skin: topology, poses, closest points, paths.

mod pose;
mod shapes;
mod topology;
