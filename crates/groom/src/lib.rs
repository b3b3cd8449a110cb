//! Hair without time: control hairs placed and combed, hairs instanced from maps, weights, interpolation.

mod area_curve;
pub mod candidates;
mod point_grid;
