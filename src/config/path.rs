//! Where a key stands in a configuration: `boundary[2].move.uy`.

use std::fmt;

/// One step down the tree of a configuration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    Key(String),
    Index(usize),
}

/// The way from the root of a configuration to one of its values.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path(pub Vec<Step>);

impl Path {
    /// The whole configuration.
    pub fn root() -> Path {
        Path::default()
    }

    /// The value of a key of the mapping at this path.
    pub fn key(&self, key: &str) -> Path {
        self.with(Step::Key(key.to_owned()))
    }

    /// An entry of the list at this path, counted from zero.
    pub fn index(&self, index: usize) -> Path {
        self.with(Step::Index(index))
    }

    fn with(&self, step: Step) -> Path {
        let mut steps = self.0.clone();
        steps.push(step);
        Path(steps)
    }

    /// Whether this path is the other one or leads to it.
    pub fn contains(&self, other: &Path) -> bool {
        other.0.starts_with(&self.0)
    }

    /// Reads `boundary[2].move.uy`, and `boundary.2.move.uy` as typed on the command line.
    pub fn parse(text: &str) -> Path {
        let steps = text
            .split(['.', '[', ']'])
            .filter(|part| !part.is_empty())
            .map(|part| match part.parse() {
                Ok(index) => Step::Index(index),
                Err(_) => Step::Key(part.to_owned()),
            });
        Path(steps.collect())
    }
}

impl fmt::Display for Path {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) if number == 0 => write!(out, "{key}")?,
                Step::Key(key) => write!(out, ".{key}")?,
                Step::Index(index) => write!(out, "[{index}]")?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_read_as_it_is_written() {
        let path = Path::root().key("boundary").index(2).key("move").key("uy");
        assert_eq!(path.to_string(), "boundary[2].move.uy");
        assert_eq!(Path::parse("boundary[2].move.uy"), path);
        assert_eq!(Path::parse("boundary.2.move.uy"), path);
        assert!(Path::parse("boundary[2]").contains(&path));
        assert!(!Path::parse("boundary[1]").contains(&path));
    }
}
