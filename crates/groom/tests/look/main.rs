//! The look against its formulas said plainly, and its laws: what stays where nothing is asked for, what moves with the
//! skin, what lengths are kept.

#![allow(clippy::disallowed_methods, reason = "expected values, compared within a tolerance")]

mod clumps;
mod common;
mod curls;
mod membership;
mod waves;
