//! The `pelage` command.

use clap::Parser;
use pelage::cli::{Arguments, execute};
use std::process::ExitCode;

fn main() -> ExitCode {
    match execute(Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(e) => {
            pelage::progress::print_line(&e.report());
            ExitCode::from(e.exit_code())
        }
    }
}
