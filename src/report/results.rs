//! What a result folder holds, read back.

use std::path::Path;

use serde_json::Value as Json;

use super::error::ReportError;
use super::snapshots::Snapshots;
use crate::config::tree::{self, Node};
use crate::file;

/// Longest file of text that is read [byte]: tables of 10 million rows are shorter.
const MAXIMUM_TEXT: u64 = 4 << 30;

/// A result folder as read. What a run that was killed did not come to write is absent, and named in `missing`.
#[derive(Debug)]
pub struct Results {
    /// The resolved configuration.
    pub configuration: Option<Node>,
    pub history: History,
    pub convergence: Vec<Iteration>,
    pub summary: Option<Json>,
    pub snapshots: Option<Snapshots>,
    /// Names of files that are not there.
    pub missing: Vec<&'static str>,
}

/// `history.csv`: rows of accepted steps, the first for the initial state.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Names of all columns but `stage`.
    pub names: Vec<String>,
    /// Values of each column.
    pub columns: Vec<Vec<f64>>,
    /// Stage of each row.
    pub stages: Vec<String>,
}

/// A row of `convergence.csv`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
pub struct Iteration {
    pub step: usize,
    pub attempt: usize,
    pub iteration: usize,
    pub force_residual: f64,
    pub accepted: bool,
}

impl Results {
    /// Reads a result folder.
    ///
    /// # Errors
    /// A folder without results of a run, and files that are damaged.
    pub fn read(directory: &Path) -> Result<Self, ReportError> {
        let shown = directory.display();
        if !directory.is_dir() {
            let message = format!("{shown}: there is no such folder; accepted: the result folder of a run");
            return Err(ReportError::NoResults(message));
        }
        let file = |name: &str| directory.join(name);
        if !file("history.csv").is_file() && !file("config.yaml").is_file() {
            let message = format!(
                "{shown}: this is no result folder, neither history.csv nor config.yaml is in it; \
                 accepted: the result folder of a run"
            );
            return Err(ReportError::NoResults(message));
        }
        let names = [
            "config.yaml",
            "history.csv",
            "convergence.csv",
            "summary.json",
            "points.vtkhdf",
        ];
        Ok(Results {
            configuration: text(&file("config.yaml"))?
                .map(|text| configuration(&file("config.yaml"), &text))
                .transpose()?,
            history: text(&file("history.csv"))?
                .map_or(Ok(History::default()), |text| history(&file("history.csv"), &text))?,
            convergence: text(&file("convergence.csv"))?
                .map_or(Ok(Vec::new()), |text| convergence(&file("convergence.csv"), &text))?,
            summary: text(&file("summary.json"))?
                .map(|text| summary(&file("summary.json"), &text))
                .transpose()?,
            snapshots: if file("points.vtkhdf").is_file() {
                Some(Snapshots::open(&file("points.vtkhdf"))?)
            } else {
                None
            },
            missing: names.into_iter().filter(|name| !file(name).is_file()).collect(),
        })
    }

    /// A value of the configuration by its path, as text.
    pub fn setting(&self, path: &[&str]) -> Option<&str> {
        setting(self.configuration.as_ref()?, path)
    }

    /// Whether the run was in plane strain.
    pub fn plane(&self) -> bool {
        self.setting(&["model", "kinematics"]) == Some("plane_strain")
    }
}

impl History {
    /// Values of a column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let place = self.names.iter().position(|other| other == name)?;
        Some(&self.columns[place])
    }

    /// Stages done plus the share of the current one, for each row.
    pub fn time(&self) -> Vec<f64> {
        let mut done = 0.0;
        let fraction = self.column("load_factor").unwrap_or_default();
        let rows = self.stages.iter().zip(fraction).enumerate();
        rows.map(|(row, (stage, fraction))| {
            if row > 0 && *stage != self.stages[row - 1] {
                done += 1.0;
            }
            done + fraction
        })
        .collect()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.stages.len()
    }
}

/// Text of a value below a node.
pub fn setting<'a>(node: &'a Node, path: &[&str]) -> Option<&'a str> {
    match path {
        [] => match &node.value {
            tree::Value::Plain(text) | tree::Value::Quoted(text) => Some(text),
            _ => None,
        },
        [key, rest @ ..] => setting(below(node, key)?, rest),
    }
}

/// The node under a key.
pub fn below<'a>(node: &'a Node, key: &str) -> Option<&'a Node> {
    match &node.value {
        tree::Value::Mapping(entries) => entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node),
        _ => None,
    }
}

fn text(path: &Path) -> Result<Option<String>, ReportError> {
    if !path.exists() {
        return Ok(None);
    }
    let text = file::read_text(path, MAXIMUM_TEXT).map_err(|reason| damaged(path, reason))?;
    Ok(Some(text))
}

fn damaged(path: &Path, what: impl std::fmt::Display) -> ReportError {
    ReportError::File(format!("{}: cannot be read: {what}", path.display()))
}

fn configuration(path: &Path, text: &str) -> Result<Node, ReportError> {
    match tree::parse(&path.to_string_lossy(), text) {
        Ok((node, _)) => Ok(node),
        Err(problems) => Err(damaged(
            path,
            problems.first().map_or_else(String::new, ToString::to_string),
        )),
    }
}

fn summary(path: &Path, text: &str) -> Result<Json, ReportError> {
    let value: Json = serde_json::from_str(text).map_err(|error| damaged(path, error))?;
    if value.is_object() {
        Ok(value)
    } else {
        Err(damaged(path, "this is no object of names and values"))
    }
}

fn history(path: &Path, text: &str) -> Result<History, ReportError> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| damaged(path, error))?.clone();
    for needed in ["step", "stage", "load_factor", "step_size", "newton_iterations"] {
        if !header.iter().any(|name| name == needed) {
            return Err(damaged(path, format!("there is no column \"{needed}\"")));
        }
    }
    let mut history = History {
        names: header
            .iter()
            .filter(|name| *name != "stage")
            .map(str::to_owned)
            .collect(),
        ..Default::default()
    };
    history.columns = vec![Vec::new(); history.names.len()];
    for (row, record) in reader.records().enumerate() {
        let record = record.map_err(|error| damaged(path, error))?;
        let mut columns = history.columns.iter_mut();
        for (name, entry) in header.iter().zip(&record) {
            if name == "stage" {
                history.stages.push(entry.to_owned());
                continue;
            }
            let number = entry.trim().parse().map_err(|_| {
                damaged(
                    path,
                    format!("line {}, column \"{name}\": \"{entry}\" is no number", row + 2),
                )
            })?;
            columns.next().expect("a column for each name").push(number);
        }
    }
    Ok(history)
}

fn convergence(path: &Path, text: &str) -> Result<Vec<Iteration>, ReportError> {
    let rows: Result<Vec<Iteration>, _> = csv::Reader::from_reader(text.as_bytes()).deserialize().collect();
    rows.map_err(|error| damaged(path, error))
}
