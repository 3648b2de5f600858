//! Errors that end a run, and their exit codes.

use crate::problem::Problem;
use std::fmt;

/// Why a run ended early.
#[derive(Debug)]
pub enum Error {
    /// The configuration or the command line is wrong; nothing was run. Exit code 2.
    Configuration(Vec<Problem>),
    /// The command line names something that does not exist; nothing was done. Exit code 2.
    CommandLine(String),
    /// The analysis could not go on; results so far are complete. Exit code 3.
    Analysis(String),
    /// Failure outside the model, common to all ranks: files, memory. Exit code 1.
    System(String),
    /// Failure of a library that other ranks may know nothing of: they would wait for this one for ever. Exit code 1.
    Library(String),
}

impl Error {
    /// Exit code of the process.
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::Configuration(_) | Error::CommandLine(_) => 2,
            Error::Analysis(_) => 3,
            Error::System(_) | Error::Library(_) => 1,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Configuration(problems) => {
                for (number, problem) in problems.iter().enumerate() {
                    if number > 0 {
                        writeln!(out)?;
                    }
                    write!(out, "{problem}")?;
                }
                Ok(())
            }
            Error::CommandLine(message)
            | Error::Analysis(message)
            | Error::System(message)
            | Error::Library(message) => write!(out, "{message}"),
        }
    }
}

impl std::error::Error for Error {}
