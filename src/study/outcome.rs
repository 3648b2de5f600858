//! What a run of a study left in its folder: whether it is done, and how it ended.

use super::plan::Run;
use crate::file;
use crate::output::folder::create_anew;
use crate::version;
use serde_json::Value;
use std::fmt;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::SystemTime;

/// Longest file of a run that is looked at [byte].
const MAXIMUM_LENGTH: u64 = 64 << 20;

/// Where a run that ended without a summary says why.
const FAILURE: &str = "failure.json";

/// What a run goes on from.
const CHECKPOINT: &str = "checkpoint.h5";

/// Whether a run has to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It completed, with this configuration, number of ranks and program.
    Done,
    /// There are no results.
    Missing,
    /// Another configuration, number of ranks, or a newer file that the scene names.
    Changed,
    /// Made by another version of the program.
    OtherProgram,
    /// It began and left no word of its end: it goes on elsewhere, or was killed.
    Unfinished,
    /// It ended early.
    Failed,
}

impl fmt::Display for State {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            State::Done => "done",
            State::Missing => "to do: no results",
            State::Changed => "to do: configuration has changed",
            State::OtherProgram => "to do: program has changed",
            State::Unfinished => "to do: no end",
            State::Failed => "to do: failed before",
        })
    }
}

/// How a run ended.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// `completed`, `stopped`, `failed`, `interrupted`; otherwise `missing`, `outdated` or `unfinished`.
    pub status: String,
    pub exit_code: Option<i64>,
    pub message: Option<String>,
    /// `summary.json`, where it belongs to this run.
    pub summary: Option<Value>,
}

impl Outcome {
    pub fn completed(&self) -> bool {
        self.status == "completed"
    }

    /// A number of the summary, by its keys with points between them.
    pub fn number(&self, key: &str) -> Option<f64> {
        let start = self.summary.as_ref()?;
        key.split('.').try_fold(start, |value, key| value.get(key))?.as_f64()
    }

    /// Largest resident memory, sum over ranks [MiB].
    pub fn memory(&self) -> Option<f64> {
        let ranks = self.summary.as_ref()?.get("peak_memory_mb")?.as_array()?;
        ranks.iter().map(Value::as_f64).sum()
    }
}

/// How a run is started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// In a folder without results.
    Anew,
    /// In the place of results that the study no longer wants.
    Replacing,
    /// From its checkpoint.
    GoingOn,
}

/// How to start a run that is due; unless it begins again in any case, one that was interrupted goes on.
pub fn start(run: &Run, state: State, overwrite: bool) -> Start {
    match state {
        // What lies in a folder without a configuration is not of this study.
        _ if !overwrite && !run.folder.join("config.yaml").exists() => Start::Anew,
        State::Missing => Start::Anew,
        State::Unfinished | State::Failed if !overwrite && run.folder.join(CHECKPOINT).exists() => Start::GoingOn,
        _ => Start::Replacing,
    }
}

/// Whether a run has to be made.
pub fn state(run: &Run) -> State {
    let Ok(configuration) = file::read_text(&run.folder.join("config.yaml"), MAXIMUM_LENGTH) else {
        // A run may fail before it makes its folder.
        let failed = run.folder.join(FAILURE).exists();
        return if failed { State::Failed } else { State::Missing };
    };
    if configuration != run.resolved {
        return State::Changed;
    }
    let path = run.folder.join("summary.json");
    let Some(summary) = json(&path) else {
        return state_without_summary(run);
    };
    let made = modified(&path);
    if summary["ranks"] != run.ranks || has_newer_file(run, made) {
        return State::Changed;
    }
    if !same_program(&summary["versions"], made) {
        return State::OtherProgram;
    }
    if failure(run).is_none() && is_whole(run) {
        State::Done
    } else {
        State::Failed
    }
}

/// The state of a run that left no word of its end.
fn state_without_summary(run: &Run) -> State {
    if has_newer_file(run, modified(&run.folder.join("config.yaml"))) {
        return State::Changed;
    }
    let saved = modified(&run.folder.join(CHECKPOINT));
    if saved.is_some() && std::env::current_exe().is_ok_and(|program| modified(&program) > saved) {
        return State::OtherProgram;
    }
    if failure(run).is_some() {
        State::Failed
    } else {
        State::Unfinished
    }
}

/// Whether a file that the scene names was changed since.
fn has_newer_file(run: &Run, made: Option<SystemTime>) -> bool {
    run.files.iter().any(|file| modified(Path::new(file)) > made)
}

/// Whether the results of a run are those of one that completed: its summary says so, and counts the rows of its history.
pub fn is_whole(run: &Run) -> bool {
    let Some(summary) = json(&run.folder.join("summary.json")) else {
        return false;
    };
    let rows = file::open(&run.folder.join("history.csv"))
        .map(csv::Reader::from_reader)
        .map(|mut reader| reader.records().take_while(Result::is_ok).count() as u64);
    // The first row is the initial state.
    let steps = rows.ok().and_then(|rows| rows.checked_sub(1));
    summary["status"] == "completed" && steps.is_some() && summary["steps"].as_u64() == steps
}

/// Why the process of a run failed; `None` where a later one left a summary.
fn failure(run: &Run) -> Option<Value> {
    let path = run.folder.join(FAILURE);
    let record = json(&path)?;
    (modified(&path) >= modified(&run.folder.join("summary.json"))).then_some(record)
}

/// The same version and commit; where a commit does not tell all, a program that is not newer than the results.
fn same_program(versions: &Value, made: Option<SystemTime>) -> bool {
    let same = versions["mpm-petsc"] == version::PROGRAM && versions["commit"] == version::COMMIT;
    let exact = version::COMMIT != "unknown" && !version::COMMIT.ends_with("-modified");
    let older = || std::env::current_exe().is_ok_and(|program| modified(&program) <= made);
    same && (exact || older())
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|metadata| metadata.modified()).ok()
}

fn json(path: &Path) -> Option<Value> {
    serde_json::from_str(&file::read_text(path, MAXIMUM_LENGTH).ok()?).ok()
}

/// How a run ended, from what is in its folder.
pub fn read(run: &Run) -> Outcome {
    let status = match state(run) {
        State::Done => "completed",
        State::Missing => "missing",
        State::Changed | State::OtherProgram => "outdated",
        State::Unfinished => "unfinished",
        State::Failed => "failed",
    };
    let mut outcome = Outcome {
        status: status.to_owned(),
        ..Outcome::default()
    };
    if !matches!(status, "completed" | "failed") {
        return outcome;
    }
    let failure = failure(run);
    let code = |record: &Value| record["exit_code"].as_i64();
    // A summary of an earlier run tells nothing of a process that failed before it wrote its own.
    outcome.summary = json(&run.folder.join("summary.json"))
        .filter(|summary| failure.as_ref().is_none_or(|failure| code(failure) == code(summary)));
    for source in [&failure, &outcome.summary].into_iter().flatten() {
        outcome.exit_code = outcome.exit_code.or(code(source));
        // What helps stands below the first line, and in the folder of the run.
        let message = source["message"].as_str().and_then(|text| text.lines().next());
        outcome.message = outcome.message.or_else(|| message.map(str::to_owned));
    }
    let told = outcome.summary.as_ref().and_then(|summary| summary["status"].as_str());
    if let Some(told) = told.filter(|told| *told != "completed") {
        outcome.status = told.to_owned();
    }
    outcome
}

/// Removes what an earlier process said of its failure.
///
/// # Errors
/// It cannot be removed.
pub fn forget(run: &Run) -> io::Result<()> {
    match fs::remove_file(run.folder.join(FAILURE)) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes down why a run ended early: its own words where it had any, otherwise `reason`. Returns them.
///
/// # Errors
/// The file cannot be written.
pub fn record_failure(run: &Run, exit_code: Option<i32>, reason: &str) -> io::Result<String> {
    let log = file::read(&run.folder.join("log.txt"), MAXIMUM_LENGTH).unwrap_or_default();
    let log = String::from_utf8_lossy(&log).into_owned();
    let own: Vec<&str> = log.lines().filter_map(|line| line.strip_prefix("error: ")).collect();
    let message = match own.as_slice() {
        [] => format!("{reason}; see log.txt in {}", run.folder.display()),
        words => words.join("; "),
    };
    let record = serde_json::json!({"exit_code": exit_code, "message": message});
    create_anew(&run.folder.join(FAILURE))?.write_all(format!("{record:#}\n").as_bytes())?;
    Ok(message)
}
