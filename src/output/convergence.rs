//! `convergence.csv`: one row per Newton iteration, of failed attempts too.

use std::path::Path;

use super::table::{Extent, Table, push_number};
use crate::error::Error;

/// Writer of `convergence.csv`; held by one rank.
#[derive(Debug)]
pub struct Convergence {
    table: Table,
}

impl Convergence {
    /// Starts the file.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let columns = [
            "step",
            "attempt",
            "iteration",
            "force_residual",
            "energy_residual",
            "accepted",
        ];
        Ok(Convergence {
            table: Table::create(path, &columns)?,
        })
    }

    /// Opens the file of an earlier run, which stays as it is until [`Convergence::cut`]; `None` if it is gone.
    ///
    /// # Errors
    /// It was changed, or cannot be written.
    pub fn find(path: &Path, expected: Extent) -> Result<Option<Self>, Error> {
        let table = Table::find(path, expected)?;
        Ok(table.map(|table| Convergence { table }))
    }

    /// Drops the rows behind those that were expected.
    pub fn cut(&mut self) -> Result<(), Error> {
        self.table.cut()
    }

    /// What the file holds now.
    pub fn extent(&self) -> Extent {
        self.table.extent()
    }

    /// Tells that the file has another name now.
    pub fn renamed(&mut self, path: &Path) {
        self.table.renamed(path);
    }

    /// Returns when all rows are on disk.
    pub fn secure(&self) -> Result<(), Error> {
        self.table.secure()
    }

    /// Adds the iterations of an attempt at a step, from iteration 0, the state before the first; they are in the file when
    /// this returns. Of each the relative residual of forces and couples [-] and the work of the residual on the correction
    /// [J]. `attempt` counts from 1 within a step. `accepted` (`true` or `false` in the file) says how the attempt ended.
    pub fn record(
        &mut self,
        step: usize,
        attempt: usize,
        residuals: impl Iterator<Item = [f64; 2]>,
        accepted: bool,
    ) -> Result<(), Error> {
        let mut rows = String::new();
        for (iteration, [force, energy]) in residuals.enumerate() {
            rows.push_str(&format!("{step},{attempt},{iteration}"));
            push_number(&mut rows, force);
            push_number(&mut rows, energy);
            rows.push_str(&format!(",{accepted}\n"));
        }
        self.table.write(&rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::scratch;

    #[test]
    fn failed_attempts_are_kept_and_marked() {
        let path = scratch("convergence").join("convergence.csv");
        let mut convergence = Convergence::create(&path).unwrap();
        let residuals = |values: &'static [f64]| values.iter().map(|&force| [force, force * 1e-3]);
        convergence.record(1, 1, residuals(&[1.0]), false).unwrap();
        convergence.record(1, 2, residuals(&[0.5, 1e-10]), true).unwrap();
        let expected = "step,attempt,iteration,force_residual,energy_residual,accepted\n\
                        1,1,0,1.0,0.001,false\n1,2,0,0.5,0.0005,true\n1,2,1,1e-10,1e-13,true\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
    }
}
