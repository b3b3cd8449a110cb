//! Mass-spring strands (Selle, Lentine, Fedkiw 2008, section 3), calibrated to a rod's stiffness.
//!
//! Particles run in a zig-zag `p0 q0 p1 q1 p2 ...`: `p` are the hair's points, `q` extra particles off the axis. Every
//! spring joins a particle with one of the three before it, every altitude spring acts on four particles in a row, so a
//! strand's matrix has a half-bandwidth of three particles.

pub mod calibrate;
pub mod kernel;
pub mod layout;
pub mod paper;
pub mod plain;
pub mod sag;
pub mod tetrahedron;

#[cfg(test)]
mod paper_tests;
#[cfg(test)]
mod tests;
