//! `mpm-petsc init`: configurations to begin with.

use crate::error::Error;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};

/// A commented configuration that runs within seconds.
pub struct Template {
    pub name: &'static str,
    pub text: &'static str,
}

macro_rules! templates {
    ($($name:literal),*) => {
        &[$(Template { name: $name, text: include_str!(concat!("../../configs/templates/", $name, ".yaml")) }),*]
    };
}

/// All templates, each a file of configs/templates.
pub const TEMPLATES: &[Template] = templates!["biaxial", "slope", "torsion", "cantilever", "sandstone"];

impl Template {
    /// What the scene is: the first line of its head.
    fn subject(&self) -> &'static str {
        self.text
            .lines()
            .next()
            .unwrap_or_default()
            .trim_start_matches(['#', ' '])
    }
}

/// Lists the templates, or writes one into the current folder; the text to print.
///
/// # Errors
/// There is no such template, or its file cannot be written; a file that exists is left as it is.
pub fn init(name: Option<&str>) -> Result<String, Error> {
    let Some(name) = name else { return Ok(list()) };
    let Some(template) = TEMPLATES.iter().find(|template| template.name == name) else {
        let known: Vec<_> = TEMPLATES.iter().map(|template| template.name).collect();
        let message = format!("there is no template named \"{name}\" (accepted: {})", known.join(", "));
        return Err(Error::Command(message));
    };
    let file = format!("{name}.yaml");
    let written = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&file)
        .and_then(|mut handle| handle.write_all(template.text.as_bytes()));
    match written {
        Ok(()) => Ok(format!(
            "{file} written: {}\n\n    mpm-petsc check {file}\n    mpm-petsc {file}\n",
            template.subject()
        )),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(Error::Command(format!(
            "{file} exists and is left as it is; move it away first"
        ))),
        Err(error) => Err(Error::System(format!("{file}: {error}"))),
    }
}

fn list() -> String {
    let width = TEMPLATES.iter().map(|template| template.name.len()).max().unwrap_or(0);
    let mut text = String::from("Templates; mpm-petsc init NAME writes NAME.yaml into the current folder:\n\n");
    for template in TEMPLATES {
        text += &format!("    {:width$}  {}\n", template.name, template.subject());
    }
    text
}
