//! The text of a configuration as the user gave it: where a key stands, for problems found now or later.

use super::path::Path;
use super::tree::{Node, Place};
use crate::problem::Problem;

/// A configuration as it was given, to say where something stands in it.
#[derive(Clone, Debug)]
pub struct Source {
    file: String,
    root: Node,
    /// What can be run as it is given but may not be meant, in sentences.
    pub warnings: Vec<String>,
}

impl Source {
    /// The tree of a file, overrides applied.
    pub(super) fn new(file: &str, root: Node) -> Source {
        Source {
            file: file.to_owned(),
            root,
            warnings: Vec::new(),
        }
    }

    pub(super) fn root(&self) -> &Node {
        &self.root
    }

    /// A problem with the value at a path such as `boundary[2]` or `loads[0].at`. Entries of a scene have the order of the
    /// file, so that their index gives the path. A path that does not exist is placed where its last known part is.
    pub fn problem(&self, path: &str, message: impl Into<String>, expected: impl Into<String>) -> Problem {
        self.problem_at(&Path::parse(path), message.into(), expected.into())
    }

    /// A problem with the file as a whole, which shows at a path.
    pub(super) fn problem_with_file(&self, path: &Path, message: String, expected: String) -> Problem {
        Problem {
            path: String::new(),
            ..self.problem_at(path, message, expected)
        }
    }

    pub(super) fn problem_at(&self, path: &Path, message: String, expected: String) -> Problem {
        let (file, place) = match self.root.place_of(path) {
            Place::File { line, column } => (self.file.clone(), Some((line, column))),
            Place::CommandLine => ("--set".to_owned(), None),
        };
        Problem {
            file,
            place,
            path: path.to_string(),
            message,
            expected,
        }
    }
}
