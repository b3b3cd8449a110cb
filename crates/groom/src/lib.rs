//! Hair without time: control hairs placed and combed, hairs instanced from maps, weights, interpolation.

pub mod control;
pub mod interpolate;
