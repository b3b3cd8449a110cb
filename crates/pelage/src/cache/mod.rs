//! Finished steps by content: what a step reads (its recipe), where its result is kept, and why it ran again.

mod hashes;
mod long_step;
mod recipe;
mod store;

pub use hashes::{FileHashes, hash_file};
pub use long_step::LongStep;
pub use recipe::{Field, Key, Recipe};
pub use store::{Entry, Stats, Store};
