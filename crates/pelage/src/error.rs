//! What can go wrong, and how the command says it.

use crate::config::ConfigError;
use crate::format::FormatError;
use std::path::{Path, PathBuf};

/// Any failure of a command.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A shot or groom file says something wrong.
    #[error(transparent)]
    Config(#[from] Box<ConfigError>),
    /// An input file is broken.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The input does not fit together, or an argument is wrong.
    #[error("{what}")]
    Input {
        /// What is wrong and what was expected.
        what: String,
        /// What the user can do; empty if there is nothing to add.
        hint: String,
    },
    /// Work was given up because something newer is to be done.
    #[error("stopped")]
    Stopped,
    /// The disk failed while running.
    #[error("{}: {source}", path.display())]
    Disk {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl From<ConfigError> for Error {
    fn from(e: ConfigError) -> Self {
        Error::Config(Box::new(e))
    }
}

impl Error {
    /// An input error.
    pub fn input(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Error::Input { what: what.into(), hint: hint.into() }
    }

    /// Turns a failure of the disk into an error that names the path.
    pub fn disk(path: &Path) -> impl FnOnce(std::io::Error) -> Error + '_ {
        move |source| Error::Disk { path: path.to_path_buf(), source }
    }

    /// Exit code of the command: 2 for bad input, 1 for a failure while running.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Config(_) | Error::Format(_) | Error::Input { .. } => 2,
            Error::Disk { .. } | Error::Stopped => 1,
        }
    }

    /// The whole message for a terminal: what, where, what to do.
    pub fn report(&self) -> String {
        let with = |hint: &str| if hint.is_empty() { String::new() } else { format!("\n  help: {hint}") };
        match self {
            Error::Config(e) => {
                let mut text = String::new();
                let handler = miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor());
                match handler.render_report(&mut text, e.as_ref()) {
                    // Without its first lines, which say the same as ours.
                    Ok(()) => {
                        let rest = text.lines().skip_while(|l| !l.contains("╭─") && !l.starts_with("  help:"));
                        let rest = rest.map(|l| format!("\n{}", l.trim_end())).collect::<String>();
                        format!("error: {e}{}", rest.trim_end())
                    }
                    Err(_) => format!("error: {e}{}", with(&e.help)),
                }
            }
            Error::Format(e) => format!("error: {e}{}", with(&e.hint)),
            Error::Input { what, hint } => format!("error: {what}{}", with(hint)),
            Error::Disk { .. } | Error::Stopped => format!("error: {self}"),
        }
    }
}
