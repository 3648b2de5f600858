//! A YAML file other than a scene, which is a study, read with the same care: every problem in one pass, each with its place.

use super::decode::{Findings, decode};
use super::input::MAXIMUM_CONFIGURATION;
use super::kind;
use super::path::Path;
use super::source::Source;
use super::tree;
use crate::file::read_text;
use crate::problem::Problem;
use serde::de::DeserializeOwned;

/// The content of a file, as far as it can be understood, and what is wrong in it so far.
#[derive(Clone, Debug)]
pub struct Document<T> {
    pub content: T,
    source: Source,
    findings: Findings,
}

impl<T: DeserializeOwned> Document<T> {
    /// Reads a file. `keys` are examples of what it holds, for the message about an empty one.
    ///
    /// # Errors
    /// The file cannot be read, is not YAML, is a scene, or so much is wrong in it that nothing can be checked.
    pub fn from_disk(file: &str, keys: &str) -> Result<Document<T>, Vec<Problem>> {
        let text = read_text(std::path::Path::new(file), MAXIMUM_CONFIGURATION).map_err(|message| {
            vec![Problem {
                file: file.to_owned(),
                place: None,
                path: String::new(),
                message,
                expected: format!("a file in YAML with keys such as {keys}"),
            }]
        })?;
        let (root, problems) = tree::parse_keys(file, &text, keys)?;
        let unsound = problems.iter().map(|problem| Path::parse(&problem.path)).collect();
        let mut findings = Findings {
            problems,
            unsound,
            ..Findings::default()
        };
        let mark = kind::mark_of_a_scene(&root);
        let source = Source::new(file, root);
        if let Some(mark) = mark {
            let message = "this is a scene, not a study".to_owned();
            let expected = format!("a study; `mpm-petsc {file}` runs a scene");
            return Err(vec![source.problem_with_file(&mark, message, expected)]);
        }
        match decode(&source, &mut findings) {
            Ok(content) => Ok(Document {
                content,
                source,
                findings,
            }),
            Err(()) => Err(in_order(findings.problems)),
        }
    }
}

impl<T> Document<T> {
    /// Adds a problem unless it or the place is known to be wrong.
    pub fn report(&mut self, path: &Path, message: impl Into<String>, expected: impl Into<String>) {
        if self.findings.sound(path) {
            self.add(self.source.problem_at(path, message.into(), expected.into()));
        }
    }

    /// Adds a problem, as one that was found in another file; one that is known already is not repeated.
    pub fn add(&mut self, problem: Problem) {
        if !self.findings.full() && !self.findings.problems.contains(&problem) {
            self.findings.problems.push(problem);
        }
    }

    /// Whether nothing is wrong at a path, above or below it.
    pub fn sound(&self, path: &Path) -> bool {
        self.findings.sound(path)
    }

    /// Whether nothing is wrong so far.
    pub fn valid(&self) -> bool {
        self.findings.problems.is_empty()
    }

    /// Everything that is wrong, in the order of the file.
    pub fn problems(&self) -> Vec<Problem> {
        in_order(self.findings.problems.clone())
    }
}

fn in_order(mut problems: Vec<Problem>) -> Vec<Problem> {
    problems.sort_by(|one, other| (&one.file, one.place).cmp(&(&other.file, other.place)));
    problems
}
