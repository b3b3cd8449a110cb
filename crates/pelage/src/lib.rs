//! Everything that touches a disk or a person: formats, shot and groom files, cache, stages, command line.

pub mod config;
pub mod format;
