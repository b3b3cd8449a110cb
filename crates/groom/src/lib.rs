//! Hair without time: control hairs placed and combed, hairs instanced from maps, weights, interpolation.

pub mod along;
mod area_curve;
pub mod areas;
mod box_tree;
pub mod candidates;
mod cells;
pub mod chain;
mod chart_cut;
pub mod choose;
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
mod place_grid;
mod place_relax;
mod point_grid;
pub mod push_up;
pub mod scalp;
pub mod spline;
#[cfg(test)]
mod test_skin;
pub mod triangulate;
