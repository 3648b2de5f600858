//! `history.csv`: one row per accepted step, the first for the initial state.

use std::path::Path;

use super::table::{Extent, Table, push_number, quoted};
use crate::error::Error;

/// What every row starts with.
#[derive(Clone, Copy, Debug)]
pub struct HistoryStep<'a> {
    /// Number of the accepted step; 0 is the initial state.
    pub step: usize,
    /// Name of the stage.
    pub stage: &'a str,
    /// Load factor of the stage at the end of the step, 0 to 1.
    pub load_factor: f64,
    /// Increment of the load factor.
    pub step_size: f64,
    /// Newton iterations of the accepted attempt.
    pub newton_iterations: usize,
}

/// Writer of `history.csv`; held by one rank.
#[derive(Debug)]
pub struct History {
    table: Table,
    columns: usize,
}

impl History {
    /// Starts the file with the names of the columns that follow those of every history.
    pub fn create(path: &Path, columns: &[String]) -> Result<Self, Error> {
        let mut names = vec!["step", "stage", "load_factor", "step_size", "newton_iterations"];
        names.extend(columns.iter().map(String::as_str));
        Ok(History {
            table: Table::create(path, &names)?,
            columns: columns.len(),
        })
    }

    /// Opens the file of an earlier run of the same columns, which stays as it is until [`History::cut`]; `None` if it
    /// is gone.
    ///
    /// # Errors
    /// It was changed, or cannot be written.
    pub fn find(path: &Path, columns: usize, expected: Extent) -> Result<Option<Self>, Error> {
        let table = Table::find(path, expected)?;
        Ok(table.map(|table| History { table, columns }))
    }

    /// Drops the rows behind those that were expected.
    pub fn cut(&mut self) -> Result<(), Error> {
        self.table.cut()
    }

    /// Tells that the file has another name now.
    pub fn renamed(&mut self, path: &Path) {
        self.table.renamed(path);
    }

    /// What the file holds now.
    pub fn extent(&self) -> Extent {
        self.table.extent()
    }

    /// Returns when all rows are on disk.
    pub fn secure(&self) -> Result<(), Error> {
        self.table.secure()
    }

    /// Adds a row; it is in the file when this returns.
    ///
    /// # Panics
    /// If there are not as many values as columns.
    pub fn record(&mut self, step: &HistoryStep<'_>, values: &[f64]) -> Result<(), Error> {
        assert_eq!(values.len(), self.columns, "one value per column of the history");
        let mut row = format!("{},{}", step.step, quoted(step.stage));
        push_number(&mut row, step.load_factor);
        push_number(&mut row, step.step_size);
        row.push_str(&format!(",{}", step.newton_iterations));
        for &value in values {
            push_number(&mut row, value);
        }
        row.push('\n');
        self.table.write(&row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::scratch;

    #[test]
    fn a_row_is_in_the_file_at_once_and_exact() {
        let folder = scratch("history");
        let path = folder.join("history.csv");
        let mut history = History::create(&path, &["force".into(), "corner, x".into()]).unwrap();
        let step = HistoryStep {
            step: 3,
            stage: "pull",
            load_factor: 0.1,
            step_size: 1.0,
            newton_iterations: 4,
        };
        history.record(&step, &[1.0 / 3.0, -2.5e-9]).unwrap();
        let expected = "step,stage,load_factor,step_size,newton_iterations,force,\"corner, x\"\n\
                        3,pull,0.1,1.0,4,0.3333333333333333,-2.5e-9\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_file() {
        let path = scratch("history_missing").join("none").join("history.csv");
        let message = History::create(&path, &[]).unwrap_err().to_string();
        assert!(message.contains("history.csv"), "{message}");
    }
}
