//! Samples that Pelage makes itself: skins, motions, maps and grooms by formula, always the same bytes.

use crate::cli::Sample;
