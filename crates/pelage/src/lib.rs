//! Everything that touches a disk or a person: formats, shot and groom files, cache, stages, command line.

pub mod bench;
pub mod cache;
pub mod cli;
pub mod config;
pub mod curves;
pub mod error;
pub mod files;
pub mod format;
pub mod progress;
pub mod project;
pub mod quality;
pub mod report;
pub mod sample;
pub mod stage;
pub mod timeline;

pub use error::Error;
