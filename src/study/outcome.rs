//! What a run of a study left in its folder: whether it is done, and how it ended.

use super::plan::Run;
use crate::file;
use crate::version;
use serde_json::Value;
use std::fmt;
use std::fs;
use std::io;
use std::path::Path;
use std::time::SystemTime;

/// Longest file of a run that is looked at [byte].
const MAXIMUM_LENGTH: u64 = 64 << 20;

/// Where a run that ended without a summary says why.
const FAILURE: &str = "failure.json";

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
        let failed = run.folder.join(FAILURE).exists();
        return if failed { State::Failed } else { State::Unfinished };
    };
    let made = modified(&path);
    let newer = |file: &String| modified(Path::new(file)) > made;
    if summary["ranks"] != run.ranks || run.files.iter().any(newer) {
        return State::Changed;
    }
    if !same_program(&summary["versions"], made) {
        return State::OtherProgram;
    }
    if summary["status"] == "completed" {
        State::Done
    } else {
        State::Failed
    }
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
    let failure = json(&run.folder.join(FAILURE));
    outcome.summary = json(&run.folder.join("summary.json"));
    for source in [&outcome.summary, &failure].into_iter().flatten() {
        outcome.exit_code = outcome.exit_code.or(source["exit_code"].as_i64());
        outcome.message = outcome
            .message
            .or_else(|| source["message"].as_str().map(str::to_owned));
    }
    if let Some(status) = outcome.summary.as_ref().and_then(|summary| summary["status"].as_str()) {
        outcome.status = status.to_owned();
    }
    outcome
}

/// Removes the ends of earlier runs: one that fails early would leave them.
///
/// # Errors
/// They cannot be removed.
pub fn forget(run: &Run) -> io::Result<()> {
    for name in [FAILURE, "summary.json", "config.yaml"] {
        match fs::remove_file(run.folder.join(name)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(())
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
    fs::write(run.folder.join(FAILURE), format!("{record:#}\n"))?;
    Ok(message)
}
