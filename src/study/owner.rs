//! Whose folder it is: a study replaces what it made itself, and nothing of another one.

use super::outcome::{self, State};
use super::plan::Study;
use crate::error::Error;
use crate::file;
use crate::output::folder::write_atomically;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// What the study that writes a folder leaves there.
const RECORD: &str = "study.json";

/// Longest study or record that is looked at [byte].
const LONGEST: u64 = 1 << 26;

/// The study that made a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Record {
    study: PathBuf,
    /// CRC-32 of its text: a study that was moved is still the same.
    checksum: u32,
}

impl Record {
    fn of(name: &str) -> Self {
        Record {
            study: fs::canonicalize(name).unwrap_or_else(|_| PathBuf::from(name)),
            checksum: crc32fast::hash(&file::read(Path::new(name), LONGEST).unwrap_or_default()),
        }
    }

    fn read(folder: &Path) -> Option<Self> {
        serde_json::from_str(&file::read_text(&folder.join(RECORD), LONGEST).ok()?).ok()
    }

    fn is_of_one_study(&self, other: &Record) -> bool {
        self.study == other.study || self.checksum == other.checksum
    }
}

/// Makes a folder that exists the one of a study.
///
/// # Errors
/// It holds another study, unless that may be overwritten; it cannot be written.
pub fn claim(study: &Study, name: &str, overwrite: bool) -> Result<(), Error> {
    let own = Record::of(name);
    if let Some(other) = other_study(study, &own).filter(|_| !overwrite) {
        return Err(Error::Command(format!(
            "{} holds {other}; accepted: another folder with --output DIR, or --overwrite to replace what is not \
             of this study",
            study.folder.display()
        )));
    }
    let text = serde_json::to_string_pretty(&own).expect("a path and a number can be written") + "\n";
    write_atomically(&study.folder.join(RECORD), text.as_bytes())
}

/// What the folder holds of another study.
fn other_study(study: &Study, own: &Record) -> Option<String> {
    if let Some(record) = Record::read(&study.folder) {
        let other = format!("the study {}", record.study.display());
        return (!record.is_of_one_study(own)).then_some(other);
    }
    // Nobody says whose it is.
    let states: Vec<State> = study.runs.iter().map(outcome::state).collect();
    if states.contains(&State::Changed) {
        return Some("runs of other scenes".to_owned());
    }
    let foreign = study.folder.join("study.csv").exists() && states.iter().all(|state| *state == State::Missing);
    foreign.then(|| "the table of another study".to_owned())
}
