//! `summary.json`: how a run ended and what it took.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::folder::write_atomically;
use crate::clock::PhaseSeconds;
use crate::error::Error;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The last stage was reached (exit code 0).
    Completed,
    /// Failure outside the model (exit code 1).
    Failed,
    /// The analysis could not go on (exit code 3).
    Stopped,
    /// Stopped by a signal (exit code 4).
    Interrupted,
}

/// Content of `summary.json`. Counts are over all ranks.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub status: Status,
    pub exit_code: i32,
    /// Why the run ended early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    pub title: String,
    /// What the user was warned of, a sentence each.
    pub warnings: Vec<String>,
    pub ranks: usize,
    pub points: u64,
    /// Cells that hold points, at the end.
    pub active_cells: u64,
    /// Unknowns, at the end.
    pub dofs: u64,
    /// Entries of the matrix, at the end.
    pub nonzeros: u64,
    /// How far the domain of a point stuck out of the grid at most [cell].
    pub largest_overhang: f64,
    /// Accepted steps.
    pub steps: usize,
    /// Steps tried, accepted or not.
    pub attempts: usize,
    /// Over all attempts.
    pub newton_iterations: usize,
    /// Accepted steps whose residual came down to round-off before it came below `solver.force_tolerance`.
    pub steps_at_round_off: usize,
    pub wall_seconds: f64,
    /// Sum over ranks.
    pub cpu_seconds: f64,
    /// Wall time; their sum is `wall_seconds`.
    pub phases: PhaseSeconds,
    /// Largest resident memory of each rank [MiB].
    pub peak_memory_mb: Vec<f64>,
    /// How cells were shared out to the ranks.
    pub partitioner: String,
    /// Errors against an exact solution where there is one, by name.
    #[serde(flatten)]
    pub errors: BTreeMap<&'static str, f64>,
    /// Linear solver and the ordering of the unknowns for its factorisation.
    pub ordering: String,
    /// Program, commit and libraries.
    pub versions: BTreeMap<String, String>,
}

impl Summary {
    /// Writes the file so that it is complete whenever it exists. A number that is not finite becomes `null`.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let mut text = serde_json::to_string_pretty(self)
            .map_err(|error| Error::System(format!("cannot write {}: {error}", path.display())))?;
        text.push('\n');
        write_atomically(path, text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::scratch;

    fn example() -> Summary {
        Summary {
            status: Status::Stopped,
            exit_code: 3,
            message: Some("smallest step reached".into()),
            title: "Biaxial".into(),
            warnings: vec!["domains stuck out of the grid".into()],
            ranks: 2,
            points: 900,
            active_cells: 100,
            dofs: 363,
            nonzeros: 9000,
            largest_overhang: 1.0e-3,
            steps: 7,
            attempts: 9,
            newton_iterations: 31,
            steps_at_round_off: 0,
            wall_seconds: 1.25,
            cpu_seconds: 2.5,
            phases: PhaseSeconds {
                assembly: 1.0,
                other: 0.25,
                ..Default::default()
            },
            peak_memory_mb: vec![10.0, 11.5],
            partitioner: "metis".into(),
            errors: BTreeMap::new(),
            ordering: "metis".into(),
            versions: BTreeMap::from([("petsc".into(), "3.18.5".into())]),
        }
    }

    #[test]
    fn the_file_has_the_promised_keys() {
        let path = scratch("summary").join("summary.json");
        example().write(&path).unwrap();
        let read: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let promised = "status exit_code ranks points active_cells dofs nonzeros largest_overhang steps attempts newton_iterations \
                        wall_seconds cpu_seconds phases peak_memory_mb versions";
        for key in promised.split_whitespace() {
            assert!(read.get(key).is_some(), "{key} is missing");
        }
        for key in "search constitutive assembly factorise solve output other".split_whitespace() {
            assert!(read["phases"][key].is_number(), "phases.{key} is missing");
        }
        assert_eq!(read["status"], "stopped");
        assert_eq!(read["peak_memory_mb"][1], 11.5);
    }

    #[test]
    fn a_number_that_is_not_finite_does_not_spoil_the_file() {
        let path = scratch("summary_nan").join("summary.json");
        let mut summary = example();
        summary.peak_memory_mb[0] = f64::NAN;
        summary.errors.insert("error_u", 0.5);
        summary.errors.insert("error_mu", f64::NAN);
        summary.write(&path).unwrap();
        let read: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert!(read["peak_memory_mb"][0].is_null() && read["error_mu"].is_null());
        assert_eq!(read["error_u"], 0.5);
    }
}
