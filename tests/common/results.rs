//! What a run leaves behind, read back.

use serde_json::Value;
use std::path::Path;

/// Columns of every history, before those that the scene asks for.
pub const STEP_COLUMNS: [&str; 5] = ["step", "stage", "load_factor", "step_size", "newton_iterations"];

/// A CSV file.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// # Panics
    /// When the file cannot be read or a row has not as many cells as there are columns.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(text.ends_with('\n'), "{} ends within a row", path.display());
        let mut lines = text.lines().map(cells);
        let columns = lines
            .next()
            .unwrap_or_else(|| panic!("{} has no head line", path.display()));
        let rows: Vec<Vec<String>> = lines.collect();
        for row in &rows {
            assert_eq!(row.len(), columns.len(), "{}: {row:?}", path.display());
        }
        Table { columns, rows }
    }

    fn place(&self, name: &str) -> usize {
        let place = self.columns.iter().position(|column| column == name);
        place.unwrap_or_else(|| panic!("no column {name} among {:?}", self.columns))
    }

    /// A column as it stands in the file.
    pub fn text(&self, name: &str) -> Vec<&str> {
        let place = self.place(name);
        self.rows.iter().map(|row| row[place].as_str()).collect()
    }

    /// A column of numbers.
    pub fn column(&self, name: &str) -> Vec<f64> {
        let number = |text: &str| text.parse().unwrap_or_else(|_| panic!("{name}: {text} is no number"));
        self.text(name).into_iter().map(number).collect()
    }

    /// The last number of a column.
    pub fn last(&self, name: &str) -> f64 {
        *self.column(name).last().expect("the table has rows")
    }

    /// The last numbers of columns.
    pub fn last_of<const M: usize>(&self, names: [&str; M]) -> [f64; M] {
        names.map(|name| self.last(name))
    }

    /// Names of the columns that the scene asked for.
    pub fn quantities(&self) -> Vec<&str> {
        assert_eq!(self.columns[..STEP_COLUMNS.len()], STEP_COLUMNS);
        self.columns[STEP_COLUMNS.len()..].iter().map(String::as_str).collect()
    }
}

/// Cells of a line (RFC 4180, without line ends in cells).
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => {
                letters.next();
                cell.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(std::mem::take(&mut cell)),
            _ => cell.push(letter),
        }
    }
    cells.push(cell);
    cells
}

/// One attempt at a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempt {
    pub step: usize,
    pub attempt: usize,
    pub accepted: bool,
    /// Force residuals, the first after the opening linear solve.
    pub residuals: Vec<f64>,
}

/// `convergence.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct Convergence {
    pub attempts: Vec<Attempt>,
}

impl Convergence {
    pub fn read(path: &Path) -> Self {
        let table = Table::read(path);
        let expected = "step attempt iteration force_residual energy_residual accepted";
        assert_eq!(table.columns.join(" "), expected);
        let mut attempts: Vec<Attempt> = Vec::new();
        let (steps, numbers) = (table.column("step"), table.column("attempt"));
        let (iterations, residuals) = (table.column("iteration"), table.column("force_residual"));
        for (row, accepted) in table.text("accepted").into_iter().enumerate() {
            let iteration = iterations[row] as usize;
            if iteration == 0 {
                attempts.push(Attempt {
                    step: steps[row] as usize,
                    attempt: numbers[row] as usize,
                    accepted: accepted == "true",
                    residuals: Vec::new(),
                });
            }
            let own = attempts.last_mut().expect("a file begins with an iteration 0");
            assert_eq!((own.step, own.attempt), (steps[row] as usize, numbers[row] as usize));
            assert_eq!(
                iteration,
                own.residuals.len(),
                "iterations are counted from zero without gaps"
            );
            own.residuals.push(residuals[row]);
        }
        Convergence { attempts }
    }

    pub fn accepted(&self) -> impl Iterator<Item = &Attempt> {
        self.attempts.iter().filter(|attempt| attempt.accepted)
    }

    pub fn failed(&self) -> impl Iterator<Item = &Attempt> {
        self.attempts.iter().filter(|attempt| !attempt.accepted)
    }
}

/// `summary.json`.
#[derive(Clone, Debug)]
pub struct Summary(pub Value);

impl Summary {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Summary(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    }

    pub fn text(&self, key: &str) -> &str {
        self.0[key]
            .as_str()
            .unwrap_or_else(|| panic!("{key} is no text in {}", self.0))
    }

    pub fn number(&self, key: &str) -> f64 {
        self.0[key]
            .as_f64()
            .unwrap_or_else(|| panic!("{key} is no number in {}", self.0))
    }

    pub fn count(&self, key: &str) -> usize {
        self.0[key]
            .as_u64()
            .unwrap_or_else(|| panic!("{key} is no count in {}", self.0)) as usize
    }

    pub fn numbers(&self, key: &str) -> Vec<f64> {
        let list = self.0[key]
            .as_array()
            .unwrap_or_else(|| panic!("{key} is no list in {}", self.0));
        list.iter().map(|value| value.as_f64().expect("a number")).collect()
    }
}
