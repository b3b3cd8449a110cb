//! Spring constants from a rod's stiffness.
