//! Hair without time: control hairs placed and combed, hairs instanced from maps, weights, interpolation.

pub mod along;
mod area_curve;
pub mod areas;
mod box_tree;
pub mod candidates;
pub mod chain;
mod chart_cut;
pub mod cluster;
pub mod comb;
pub mod control;
pub mod depenetrate;
pub mod field;
pub mod flow;
pub mod instance;
pub mod interpolate;
pub mod keep;
pub mod look;
mod near;
pub mod parting;
pub mod place;
mod point_grid;
pub mod push_up;
pub mod spline;
#[cfg(test)]
mod test_skin;
pub mod triangulate;
