//! init
use super::Sample;
use crate::Error;
use std::path::Path;
/// x
pub fn init(_d:&Path,_s:Option<&Path>,_m:f64,_k:Sample)->Result<bool,Error>{Ok(true)}
