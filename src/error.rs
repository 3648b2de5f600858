//! Errors that end a run, and their exit codes.

use crate::problem::Problem;
use std::fmt;

/// Why a run ended early.
#[derive(Debug)]
pub enum Error {
    /// The configuration or the command line is wrong; nothing was run. Exit code 2.
    Configuration(Vec<Problem>),
    /// The command asks for something that is not there or must not be; nothing was done. Exit code 2.
    Command(String),
    /// The analysis could not go on; results so far are complete. Exit code 3.
    Analysis(String),
    /// A signal asked the run to stop; a checkpoint of the last accepted state is there. Exit code 4.
    Interrupted(String),
    /// There is not enough memory to go on, common to all ranks; results so far are complete. Exit code 1.
    Memory(String),
    /// Failure outside the model, common to all ranks: files. Exit code 1.
    System(String),
    /// Failure of a library that other ranks may know nothing of: they would wait for this one for ever. Exit code 1.
    Library(String),
}

impl Error {
    /// Exit code of the process.
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::Configuration(_) | Error::Command(_) => 2,
            Error::Analysis(_) => 3,
            Error::Interrupted(_) => 4,
            Error::Memory(_) | Error::System(_) | Error::Library(_) => 1,
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
            Error::Command(message)
            | Error::Analysis(message)
            | Error::Interrupted(message)
            | Error::Memory(message)
            | Error::System(message)
            | Error::Library(message) => write!(out, "{message}"),
        }
    }
}

impl std::error::Error for Error {}
