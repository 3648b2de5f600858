//! All the text that makes a scene: the configuration, overrides of the command line, and the files it names.
//!
//! Only one rank reads files. It sends the [`Input`] to the others, and every rank makes the same scene of it.

use super::arguments::command_like;
use super::decode::{Findings, decode};
use super::file::{ConfigFile, PointFile, ShapeKeys};
use super::nearest::did_you_mean;
use super::point::{self, PointTask};
use super::source::Source;
use super::{check, kind, overrides, tree};
use crate::file::read_text;
use crate::problem::Problem;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, absolute};

/// Longest configuration that is read [bytes]; a longer file is not one.
pub const MAXIMUM_CONFIGURATION: u64 = 16 << 20;

/// Longest file of points that is read [bytes].
const MAXIMUM_POINT_FILE: u64 = 4 << 30;

/// All the text that makes a scene. It is serialisable, so that one rank can read and broadcast it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// The configuration as the user named it.
    file_name: String,
    text: String,
    /// `KEY.KEY=VALUE`, in the order of the command line.
    overrides: Vec<String>,
    files: Files,
}

impl Input {
    /// A configuration and its overrides (`KEY.KEY=VALUE`); files that it names are not read.
    pub fn from_text(file_name: &str, text: &str, overrides: &[String]) -> Input {
        Input {
            file_name: file_name.to_owned(),
            text: text.to_owned(),
            overrides: overrides.to_vec(),
            files: Files::beside(file_name),
        }
    }

    /// Reads a configuration and the files that it names.
    ///
    /// # Errors
    /// The configuration cannot be read. What is wrong in it, or with the files it names, is left to [`Input::scene`].
    pub fn from_disk(file_name: &str, overrides: &[String]) -> Result<Input, Vec<Problem>> {
        let text = read_text(Path::new(file_name), MAXIMUM_CONFIGURATION).map_err(|reason| {
            // A command that takes no file is taken for one where it is misspelled.
            let (file, message) = (
                file_name.to_owned(),
                reason + &did_you_mean(command_like(file_name).as_deref()),
            );
            let expected = "a configuration in YAML".to_owned();
            vec![Problem {
                file,
                place: None,
                path: String::new(),
                message,
                expected,
            }]
        })?;
        let mut input = Input::from_text(file_name, &text, overrides);
        for name in input.named_files() {
            let text = read_text(Path::new(&name), MAXIMUM_POINT_FILE);
            input.files.texts.insert(name, text);
        }
        Ok(input)
    }

    /// The scene, with the places where its entries stand in the file.
    ///
    /// # Errors
    /// Everything that is wrong, in the order of the file.
    pub fn scene(&self) -> Result<(Scene, Source), Vec<Problem>> {
        let (mut source, mut findings) = self.source()?;
        let scene = decode::<ConfigFile>(&source, &mut findings)
            .ok()
            .filter(|_| !findings.full())
            .and_then(|config| check::check(&config, &source, &self.files, &mut findings));
        match scene {
            Some(scene) if findings.problems.is_empty() => {
                source.warnings = findings.warnings;
                Ok((scene, source))
            }
            _ => {
                findings.sort();
                Err(findings.problems)
            }
        }
    }

    /// The material to drive and its path, as `mpm-petsc point` reads them.
    ///
    /// # Errors
    /// Everything that is wrong, in the order of the file.
    pub fn point(&self) -> Result<PointTask, Vec<Problem>> {
        let (source, mut findings) = self.source()?;
        let task = decode::<PointFile>(&source, &mut findings)
            .ok()
            .filter(|_| !findings.full())
            .and_then(|file| point::check(&file, &source, &self.files, &mut findings));
        match task {
            Some(task) if findings.problems.is_empty() => Ok(task),
            _ => {
                findings.sort();
                Err(findings.problems)
            }
        }
    }

    /// The tree with its overrides, and what is wrong with its form.
    fn source(&self) -> Result<(Source, Findings), Vec<Problem>> {
        let (mut root, problems) = tree::parse(&self.file_name, &self.text)?;
        let unsound = problems
            .iter()
            .map(|problem| super::path::Path::parse(&problem.path))
            .collect();
        if let Some(mark) = kind::mark_of_a_study(&root) {
            let message = "this is a study, not a scene".to_owned();
            let expected = format!("a scene; `mpm-petsc study {}` runs a study", self.file_name);
            return Err(vec![
                Source::new(&self.file_name, root).problem_with_file(&mark, message, expected),
            ]);
        }
        let mut findings = Findings {
            problems,
            unsound,
            ..Findings::default()
        };
        overrides::apply(&mut root, &self.overrides, &mut findings);
        Ok((Source::new(&self.file_name, root), findings))
    }

    /// Absolute names of the files that the configuration names, as far as it can be understood.
    pub fn named_files(&self) -> Vec<String> {
        let Ok((source, mut findings)) = self.source() else {
            return Vec::new();
        };
        let Ok(config) = decode::<ConfigFile>(&source, &mut findings) else {
            return Vec::new();
        };
        let files = config.bodies.iter().filter_map(|body| match &body.shape {
            Some(ShapeKeys::Points(keys)) => Some(self.files.resolve(&keys.file)),
            _ => None,
        });
        let path = config.path.iter().filter_map(|path| path.file.as_ref());
        files.chain(path.map(|name| self.files.resolve(name))).collect()
    }
}

/// Files that a configuration names, and where names are looked up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Files {
    /// Folder of the configuration.
    directory: String,
    /// Name of the configuration without its extension.
    stem: String,
    /// Texts by absolute name, or why there is none.
    texts: BTreeMap<String, Result<String, String>>,
}

impl Files {
    fn beside(file_name: &str) -> Files {
        let path = Path::new(file_name);
        let directory = path.parent().unwrap_or_else(|| Path::new("")).join(".");
        let directory = absolute(&directory).unwrap_or(directory);
        let stem = path
            .file_stem()
            .map_or_else(|| "run".to_owned(), |stem| stem.to_string_lossy().into_owned());
        Files {
            directory: directory.to_string_lossy().into_owned(),
            stem,
            texts: BTreeMap::new(),
        }
    }

    /// Absolute name of a file that is named relative to the configuration.
    pub fn resolve(&self, name: &str) -> String {
        Path::new(&self.directory).join(name).to_string_lossy().into_owned()
    }

    /// The text of a file by its absolute name, or why there is none.
    pub fn text(&self, name: &str) -> Result<&str, &str> {
        match self.texts.get(name) {
            Some(Ok(text)) => Ok(text),
            Some(Err(reason)) => Err(reason),
            None => Err("the file was not read"),
        }
    }

    /// Result folder of a configuration that names none.
    pub fn default_directory(&self) -> String {
        format!("results/{}", self.stem)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        Input::from_disk(&path.to_string_lossy(), &[]).unwrap_err()[0]
            .message
            .clone()
    }

    #[test]
    fn files_that_cannot_be_read_are_named_with_the_reason() {
        let folder = std::env::temp_dir().join(format!("mpm-petsc-input-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let latin = folder.join("latin.yaml");
        std::fs::write(&latin, b"title: a\nname: caf\xe9\n").unwrap();
        assert_eq!(
            message(Path::new("/dev/zero")),
            "this is a pipe or a device, not a file that has an end"
        );
        assert_eq!(message(&folder.join("absent.yaml")), "there is no such file");
        assert_eq!(message(&folder), "this is a folder, not a file");
        assert_eq!(message(&latin), "line 2 is not UTF-8 text");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn an_input_survives_a_broadcast() {
        let mut input = Input::from_text("a/b.yaml", "title: ü\n", &["x=1".to_owned()]);
        input.files.texts.insert("c".to_owned(), Err("no".to_owned()));
        let sent = serde_json::to_string(&input).unwrap();
        assert_eq!(serde_json::from_str::<Input>(&sent).unwrap(), input);
        assert_eq!(input.files.default_directory(), "results/b");
    }
}
