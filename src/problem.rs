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

/// A number for a message: as one would type it, with an exponent where it had many zeros.
pub fn figure(value: f64) -> String {
    match value.abs() {
        1e-5..1e15 => value.to_string(),
        0.0 => "0".to_owned(),
        _ => format!("{value:e}"),
    }
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

#[cfg(test)]
mod tests {
    use super::figure;

    #[test]
    fn figures_stay_short() {
        for (value, text) in [
            (0.25, "0.25"),
            (-3.0, "-3"),
            (0.0, "0"),
            (1e308, "1e308"),
            (-2.5e-12, "-2.5e-12"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
