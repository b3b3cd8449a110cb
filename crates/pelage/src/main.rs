//! The `pelage` command.
fn main() {}
