//! From what was typed to what is true: every rule that a valid scene obeys.
//!
//! Each part is checked as far as its own keys are sound, so that one mistake gives one message.

mod body;
mod boundary;
mod control;
mod grid;
mod load;
mod material;
mod mesh;
mod output;
mod point_file;
mod selection;
mod shape;
mod solver;
mod strength;
mod verification;
mod weak;

use super::decode::Findings;
use super::file::{ConfigFile, ContinuumName, KinematicsName};
use super::input::Files;
use super::nearest::{did_you_mean, nearest};
use super::path::Path;
use super::source::Source;
use super::tree::shorten;
use crate::material::spec::MaterialKeys;
use crate::points::elements::MeshSettings;
use crate::problem::figure;
use crate::scene::{ContinuumKind, GridSettings, Kinematics, Scene};

/// The scene that a configuration describes, or `None` with the reasons in `findings`.
pub fn check(config: &ConfigFile, source: &Source, files: &Files, findings: &mut Findings) -> Option<Scene> {
    let mut check = Check {
        config,
        source,
        files,
        findings,
        kinematics: Kinematics::PlaneStrain,
        continuum: ContinuumKind::Micropolar,
        grid: None,
        mesh: None,
    };
    check.continuum = check.continuum();
    check.kinematics = check.kinematics();
    if check.has_mesh() {
        check.mesh = check.mesh();
        check.grid = check.grid_of_mesh();
    } else {
        check.grid = check.grid();
    }
    let specs = check.materials();
    let bodies = check.bodies();
    let (materials, regions) = check.regions(specs);
    let stages = check.stages();
    let boundaries = check.boundaries();
    let loads = check.loads(materials.as_deref());
    let solver = check.solver();
    let ghost = check.ghost();
    let manufactured = check.manufactured(&verification::Parts {
        bodies: bodies.as_deref(),
        materials: materials.as_deref(),
        boundaries: boundaries.as_deref(),
    });
    let output = check.output();
    Some(Scene {
        title: config.title.clone(),
        kinematics: check.kinematics,
        continuum: check.continuum,
        grid: check.grid?,
        materials: materials?.into_iter().map(|material| material.named).collect(),
        bodies: bodies?,
        regions: regions?,
        boundaries: boundaries?,
        loads: loads?,
        stages: stages?,
        solver: solver?,
        ghost,
        manufactured: manufactured?,
        output: output?,
    })
}

/// A check in progress.
struct Check<'a> {
    config: &'a ConfigFile,
    source: &'a Source,
    files: &'a Files,
    findings: &'a mut Findings,
    kinematics: Kinematics,
    continuum: ContinuumKind,
    /// The grid, where it is known.
    grid: Option<GridSettings>,
    /// The mesh of finite elements, where there is one and it is known.
    mesh: Option<MeshSettings>,
}

impl Check<'_> {
    /// Adds a problem, unless the place is known to be wrong.
    fn report(&mut self, path: &Path, message: impl Into<String>, expected: impl Into<String>) {
        self.findings.add(self.source, path, message, expected);
    }

    /// Reports a condition that does not hold; returns whether it does.
    fn require(&mut self, holds: bool, path: &Path, message: impl Into<String>, expected: impl Into<String>) -> bool {
        if !holds {
            self.report(path, message, expected);
        }
        holds
    }

    fn sound(&self, path: &Path) -> bool {
        self.findings.sound(path)
    }

    /// As typed; where that is wrong, what the grid looks like, so that vectors can be checked.
    fn kinematics(&self) -> Kinematics {
        let typed = self.sound(&Path::root().key("model").key("kinematics"));
        let in_space = self.config.grid.as_ref().is_some_and(|grid| grid.min.len() == 3);
        match self.config.model.kinematics {
            KinematicsName::ThreeDimensional => Kinematics::ThreeDimensional,
            KinematicsName::PlaneStrain if !typed && in_space => Kinematics::ThreeDimensional,
            KinematicsName::PlaneStrain => Kinematics::PlaneStrain,
        }
    }

    /// As typed; where that is wrong, what the materials look like, so that their keys can be checked.
    fn continuum(&self) -> ContinuumKind {
        let typed = self.sound(&Path::root().key("model").key("continuum"));
        match self.config.model.continuum {
            ContinuumName::Classical if typed => ContinuumKind::Classical,
            ContinuumName::Micropolar if typed => ContinuumKind::Micropolar,
            ContinuumName::GradientMicropolar if typed => ContinuumKind::GradientMicropolar,
            _ if self.config.materials.values().any(MaterialKeys::sets_rotations) => ContinuumKind::Micropolar,
            _ => ContinuumKind::Classical,
        }
    }

    /// Names of the unknowns of a node: a component is an index into them.
    fn unknowns(&self) -> &'static [&'static str] {
        self.continuum.unknowns(self.kinematics.dimension())
    }

    /// Reports what only a body with rotations has, in one without.
    fn require_rotations(&mut self, path: &Path, expected: impl Into<String>) -> bool {
        let message = "a classical continuum has no rotations";
        self.require(self.continuum.has_rotations(), path, message, expected)
    }

    /// Reports what only a body with a nonlocal damage field has, in one without.
    fn require_damage(&mut self, path: &Path, expected: impl Into<String>) -> bool {
        let message = "only continuum: gradient_micropolar has a nonlocal damage field";
        self.require(self.continuum.has_damage(), path, message, expected)
    }

    /// One number per axis, the third zero in plane strain.
    fn vector(&mut self, path: &Path, values: &[f64]) -> Option<[f64; 3]> {
        let dimension = self.kinematics.dimension();
        let message = format!("{} where the kinematics has {dimension} axes", numbers(values.len()));
        let right = self.require(
            values.len() == dimension,
            path,
            message,
            format!("a list of {dimension} numbers"),
        );
        if !right || !self.sound(path) {
            return None;
        }
        let mut vector = [0.0; 3];
        vector[..dimension].copy_from_slice(values);
        Some(vector)
    }

    /// A number above zero.
    fn positive(&mut self, path: &Path, value: f64) -> Option<f64> {
        let message = format!("{} is out of bounds", figure(value));
        let right = self.require(value > 0.0, path, message, "a number > 0");
        (right && self.sound(path)).then_some(value)
    }

    /// The index of a name among the known ones of a section.
    fn lookup(&mut self, path: &Path, name: &str, what: &str, section: &str, known: &[&str]) -> Option<usize> {
        let found = known.iter().position(|candidate| *candidate == name);
        // A name that is missing because its own entry is wrong has been reported there.
        if found.is_none() && self.findings.names_known(&Path::root().key(section)) {
            let hint = did_you_mean(nearest(name, known.iter().copied()));
            let expected = if known.is_empty() {
                format!("{section} names none")
            } else {
                known.join(", ")
            };
            self.report(
                path,
                format!("there is no {what} named \"{}\"{hint}", shorten(name)),
                expected,
            );
        }
        found.filter(|_| self.sound(path))
    }

    /// Names in use by the entries of a section: words that files and messages can hold, each once.
    fn names<'n>(&mut self, section: &Path, names: impl Iterator<Item = Option<&'n str>>) {
        let mut seen: Vec<&str> = Vec::new();
        for (index, name) in names.enumerate() {
            let Some(name) = name else { continue };
            let path = section.index(index).key("name");
            self.name(&path, name);
            let message = format!("the name \"{}\" is taken", shorten(name));
            self.require(!seen.contains(&name), &path, message, "a name of its own");
            seen.push(name);
        }
    }

    fn name(&mut self, path: &Path, name: &str) {
        let right = |letter: char| letter.is_alphanumeric() || matches!(letter, ' ' | '_' | '-');
        let message = format!("\"{}\" cannot be a name", shorten(name));
        let holds = name.trim() == name && !name.is_empty() && name.chars().all(right);
        self.require(holds, path, message, "letters, digits, spaces between them, _ and -");
    }

    /// The stage from which an entry acts: the first unless named.
    fn stage(&mut self, entry: &Path, name: Option<&str>) -> Option<usize> {
        let config = self.config;
        let Some(name) = name else { return Some(0) };
        let stages: Vec<_> = config.stages.iter().map(|stage| stage.name.as_str()).collect();
        self.lookup(&entry.key("stage"), name, "stage", "stages", &stages)
    }
}

fn numbers(count: usize) -> String {
    if count == 1 {
        "1 number".to_owned()
    } else {
        format!("{count} numbers")
    }
}
