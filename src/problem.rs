//! What is wrong in a configuration, and where.

use serde::{Deserialize, Serialize};
use std::fmt;

/// One thing that is wrong in a file or on the command line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// File as the user named it; empty for the command line.
    pub file: String,
    /// Line and column, counted from 1, where known.
    pub place: Option<(usize, usize)>,
    /// Path of the key, such as `materials.sand.poisson_ratio`.
    pub path: String,
    /// What is wrong, with the value found.
    pub message: String,
    /// What is accepted.
    pub expected: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.file.is_empty() {
            write!(out, "{}:", self.file)?;
            if let Some((line, column)) = self.place {
                write!(out, "{line}:{column}:")?;
            }
            write!(out, " ")?;
        }
        if !self.path.is_empty() {
            write!(out, "{}: ", self.path)?;
        }
        write!(out, "{}", self.message)?;
        if !self.expected.is_empty() {
            write!(out, " (accepted: {})", self.expected)?;
        }
        Ok(())
    }
}
