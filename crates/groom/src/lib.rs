//! Hair without time: control hairs placed and combed, hairs instanced from maps, weights, interpolation.

pub mod comb;
pub mod control;
pub mod interpolate;
pub mod parting;
pub mod place;
pub mod push_up;
#[cfg(test)]
mod test_skin;
mod area_curve;
pub mod candidates;
mod point_grid;
