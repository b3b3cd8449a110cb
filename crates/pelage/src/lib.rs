//! Everything that touches a disk or a person: formats, shot and groom files, cache, stages, command line.

pub mod cache;
pub mod config;
pub mod error;
pub mod files;
pub mod format;

pub use error::Error;
