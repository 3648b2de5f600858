//! Why a report or a figure cannot be made.

use std::fmt;

/// What is in the way of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReportError {
    /// The folder is none, or holds no results of a run. Exit code 2.
    NoResults(String),
    /// A file of the folder cannot be read or written, or is damaged; names it. Exit code 1.
    File(String),
    /// A figure cannot be drawn. Exit code 1.
    Drawing(String),
}

impl fmt::Display for ReportError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReportError::NoResults(message) | ReportError::File(message) => write!(out, "{message}"),
            ReportError::Drawing(message) => write!(out, "a figure cannot be drawn: {message}"),
        }
    }
}

impl std::error::Error for ReportError {}
