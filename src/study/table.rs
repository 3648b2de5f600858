//! `study.csv`: one row a run, with what it is, how it ended, what it took and what was measured.

use super::measure::{History, Reading, ReferenceResults};
use super::outcome::{self, Outcome};
use super::plan::{Run, Study};
use crate::error::Error;
use crate::output::folder::write_atomically;

/// Columns that every table has, besides parameters and measures. `memory_mb` is the sum over ranks, times are in
/// seconds, `cell_size` in metres.
pub const FIXED_COLUMNS: [&str; 17] = [
    "run",
    "ranks",
    "status",
    "exit_code",
    "message",
    "cell_size",
    "active_cells",
    "points",
    "dofs",
    "nonzeros",
    "steps",
    "attempts",
    "newton_iterations",
    "wall_seconds",
    "cpu_seconds",
    "memory_mb",
    "folder",
];

/// A run with everything that is known of it.
#[derive(Clone, Debug)]
pub struct Row<'a> {
    pub run: &'a Run,
    pub outcome: Outcome,
    /// One per measure.
    pub readings: Vec<Reading>,
}

/// Reads the results of every run. Only completed runs are measured: what a shorter one ends with means something else.
pub fn rows(study: &Study) -> Vec<Row<'_>> {
    let outcomes: Vec<Outcome> = study.runs.iter().map(outcome::read).collect();
    let exact = study.runs.iter().zip(&outcomes);
    let exact = exact
        .filter(|(run, outcome)| run.is_reference() && outcome.completed())
        .map(|(run, outcome)| (outcome, run.folder.as_path()))
        .next();
    let reference = ReferenceResults::of(&study.reference, &study.measures, exact);
    let row = |(run, outcome): (&'_ Run, &Outcome)| -> Vec<Reading> {
        let history = History::read(&run.folder.join("history.csv")).ok();
        let readings = study.measures.iter().map(|measure| {
            if !outcome.completed() {
                return measure.unread();
            }
            let mut reading = measure.read(history.as_ref(), outcome, &reference);
            if run.is_reference() {
                // By definition; it has no place among the errors of the others.
                reading.error = None;
            }
            reading
        });
        readings.collect()
    };
    let readings: Vec<Vec<Reading>> = study.runs.iter().zip(&outcomes).map(row).collect();
    let rows = study.runs.iter().zip(outcomes).zip(readings);
    rows.map(|((run, outcome), readings)| Row { run, outcome, readings })
        .collect()
}

/// Names of the columns: the run, parameters, ranks, measures, and the rest.
pub fn head(study: &Study) -> Vec<String> {
    let mut head = vec!["run".to_owned()];
    head.extend(study.parameters.iter().cloned());
    head.extend(FIXED_COLUMNS[1..4].iter().map(ToString::to_string));
    head.extend(study.measures.iter().flat_map(|measure| measure.columns()));
    head.extend(FIXED_COLUMNS[5..].iter().map(ToString::to_string));
    head.push("message".to_owned());
    head
}

/// The cells of a row, in the order of [`head`]; empty where nothing is known.
pub fn cells(study: &Study, row: &Row<'_>) -> Vec<String> {
    let mut cells = vec![row.run.name.clone()];
    let parameters = study.parameters.len();
    cells.extend((0..parameters).map(|index| row.run.labels.get(index).cloned().unwrap_or_default()));
    cells.push(row.run.ranks.to_string());
    cells.push(row.outcome.status.clone());
    cells.push(row.outcome.exit_code.map(|code| code.to_string()).unwrap_or_default());
    for (measure, reading) in study.measures.iter().zip(&row.readings) {
        let values = reading.values.iter().map(|value| number(Some(*value)));
        cells.extend(values);
        cells.push(number(reading.error));
        debug_assert_eq!(reading.values.len() + 1, measure.columns().len());
    }
    cells.push(number(row.run.cell_size));
    for key in &FIXED_COLUMNS[6..15] {
        let value = row.outcome.number(key);
        cells.push(number(value));
    }
    cells.push(number(row.outcome.memory()));
    cells.push(row.run.folder.to_string_lossy().into_owned());
    cells.push(row.outcome.message.clone().unwrap_or_default());
    cells
}

/// With the digits that give it back when read; counts without a point.
fn number(value: Option<f64>) -> String {
    match value.filter(|value| value.is_finite()) {
        Some(value) if value.fract() == 0.0 && value.abs() < 1e15 => format!("{value:.0}"),
        Some(value) => format!("{value:?}"),
        None => String::new(),
    }
}

/// Writes `study.csv`.
///
/// # Errors
/// The file cannot be written.
pub fn write(study: &Study, rows: &[Row<'_>]) -> Result<(), Error> {
    let path = study.folder.join("study.csv");
    let failure = |error: &dyn std::fmt::Display| Error::System(format!("cannot write {}: {error}", path.display()));
    std::fs::create_dir_all(&study.folder).map_err(|error| failure(&error))?;
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(head(study)).map_err(|error| failure(&error))?;
    for row in rows {
        writer
            .write_record(cells(study, row))
            .map_err(|error| failure(&error))?;
    }
    let bytes = writer.into_inner().map_err(|error| failure(&error))?;
    write_atomically(&path, &bytes)
}
