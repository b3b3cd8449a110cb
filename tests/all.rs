//! One test binary, so that everything links once.

mod bad_input;
mod command_line;
mod depenetrate;
mod determinism;
mod foreign;
mod golden;
mod light;
mod look;
mod look_page;
mod pictures;
mod pictures_page;
mod reference;
mod rows;
mod samples;
mod shape;
mod simulate;
mod skips;
mod watch;
