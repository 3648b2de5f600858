//! What `mpm-petsc point` is asked to do: one material and the path of deformation that it is driven along.

use super::decode::{Findings, number};
use super::file::{ContinuumName, KinematicsName, OneOrPerAxis, PathKeys, PointFile, ScalarOr};
use super::input::Files;
use super::nearest::{did_you_mean, nearest};
use super::path::Path;
use super::source::Source;
use super::table::{LineProblem, Table};
use super::tree::shorten;
use crate::material::driver::Deformation;
use crate::material::spec::MaterialSpec;
use crate::problem::Problem;
use crate::scene::{ContinuumKind, Kinematics};
use nalgebra::{Matrix3, Vector3};

/// Most steps of a path.
const MAXIMUM_STEPS: usize = 1_000_000;

/// Components of a tensor in columns of a file, row by row.
pub const TENSOR: [&str; 9] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

/// Names before `_xx` or `_x` of all columns that `point` prints, and of those without components.
pub const COLUMNS: [&str; 6] = ["F", "Q", "rotation", "wryness", "stress", "couple_stress"];
pub const SINGLE_COLUMNS: [&str; 7] = [
    "step",
    "pressure",
    "von_mises",
    "chi",
    "alpha",
    "damage",
    "local_iterations",
];

/// A material and its path, checked.
#[derive(Clone, Debug)]
pub struct PointTask {
    pub continuum: ContinuumKind,
    pub kinematics: Kinematics,
    pub material: MaterialSpec,
    /// The deformation at the end of every step, each with a positive volume and, in plane strain, in the plane.
    pub path: Vec<Deformation>,
}

/// The task of a file, or `None` with the reasons in `findings`.
pub(super) fn check(file: &PointFile, source: &Source, files: &Files, findings: &mut Findings) -> Option<PointTask> {
    let mut check = PointCheck {
        keys: &file.path,
        source,
        files,
        findings,
        section: Path::root().key("path"),
    };
    let kinematics = check.kinematics(file);
    let continuum = check.continuum(file);
    let material = check.material(file, continuum);
    let path = kinematics.and_then(|kinematics| check.path(kinematics, continuum));
    Some(PointTask {
        continuum,
        kinematics: kinematics?,
        material: material?,
        path: path?,
    })
}

struct PointCheck<'a> {
    keys: &'a PathKeys,
    source: &'a Source,
    files: &'a Files,
    findings: &'a mut Findings,
    /// Where the path stands.
    section: Path,
}

impl PointCheck<'_> {
    fn report(&mut self, key: &str, message: impl Into<String>, expected: impl Into<String>) {
        let path = self.section.key(key);
        self.findings.add(self.source, &path, message, expected);
    }

    fn kinematics(&mut self, file: &PointFile) -> Option<Kinematics> {
        let of_model = file.model.as_ref().map(|model| model.kinematics);
        let name = self.keys.kinematics.or(of_model);
        if name.is_none() {
            let message = "this key is missing, and there is no model that has it";
            self.report("kinematics", message, "plane_strain, three_dimensional");
        }
        name.map(|name| match name {
            KinematicsName::PlaneStrain => Kinematics::PlaneStrain,
            KinematicsName::ThreeDimensional => Kinematics::ThreeDimensional,
        })
    }

    fn continuum(&self, file: &PointFile) -> ContinuumKind {
        let of_model = file.model.as_ref().map(|model| model.continuum);
        match self.keys.continuum.or(of_model).unwrap_or_default() {
            ContinuumName::Classical => ContinuumKind::Classical,
            ContinuumName::Micropolar => ContinuumKind::Micropolar,
            ContinuumName::GradientMicropolar => ContinuumKind::GradientMicropolar,
        }
    }

    fn material(&mut self, file: &PointFile, continuum: ContinuumKind) -> Option<MaterialSpec> {
        let name = &self.keys.material;
        let Some(keys) = file.materials.get(name) else {
            let known: Vec<_> = file.materials.keys().map(String::as_str).collect();
            let hint = did_you_mean(nearest(name, known.iter().copied()));
            let message = format!("there is no material named \"{}\"{hint}", shorten(name));
            self.report("material", message, known.join(", "));
            return None;
        };
        let path = Path::root().key("materials").key(name);
        if !self.findings.sound(&path) {
            return None;
        }
        keys.resolve(continuum, file.solver.return_map_tolerance)
            .map_err(|problems| self.findings.add_keys(self.source, &path, problems))
            .ok()
    }

    /// The deformations of all steps.
    fn path(&mut self, kinematics: Kinematics, continuum: ContinuumKind) -> Option<Vec<Deformation>> {
        let (path, key, what) = match &self.keys.file {
            Some(name) => (self.states(name)?, "file", "state"),
            None => (self.steps_to_end(kinematics)?, "deformation_gradient", "step"),
        };
        for (number, deformation) in path.iter().enumerate().map(|(index, state)| (index + 1, state)) {
            let wrong = if deformation.gradient.determinant() <= 0.0 {
                Some((
                    key,
                    "the deformation gradient has no positive determinant",
                    "a volume above zero",
                ))
            } else if kinematics == Kinematics::PlaneStrain && !in_plane(deformation) {
                let expected = "F_xz, F_yz, F_zx, F_zy zero and F_zz one; rotation about z; wryness zx and zy";
                Some((key, "the deformation leaves the plane", expected))
            } else if !continuum.has_rotations() && !is_classical(deformation) {
                Some((
                    key,
                    "a classical continuum has no rotation and no wryness",
                    "both zero, or not set",
                ))
            } else if !continuum.has_damage() && deformation.alpha != 0.0 {
                Some((
                    key,
                    "this continuum has no nonlocal damage field",
                    "alpha zero or not set, or continuum: gradient_micropolar",
                ))
            } else {
                None
            };
            if let Some((key, message, expected)) = wrong {
                self.report(key, format!("{what} {number}: {message}"), expected);
                return None;
            }
        }
        Some(path)
    }

    fn steps_to_end(&mut self, kinematics: Kinematics) -> Option<Vec<Deformation>> {
        let keys = self.keys;
        let end = Deformation {
            gradient: match &keys.deformation_gradient {
                Some(rows) => self.tensor("deformation_gradient", rows, kinematics)?,
                None => Matrix3::identity(),
            },
            rotation: match &keys.rotation {
                Some(values) => self.rotation(values, kinematics)?,
                None => Vector3::zeros(),
            },
            wryness: match &keys.wryness {
                Some(rows) => self.tensor("wryness", rows, Kinematics::ThreeDimensional)?,
                None => Matrix3::zeros(),
            },
            alpha: keys.alpha.unwrap_or(0.0),
        };
        let Some(steps) = keys.steps else {
            self.report("steps", "this key is missing", "a number of steps, or a file of states");
            return None;
        };
        if steps == 0 || steps > MAXIMUM_STEPS {
            let expected = format!("a whole number from 1 to {MAXIMUM_STEPS}");
            self.report("steps", format!("{steps} is out of bounds"), expected);
            return None;
        }
        Some(
            (1..=steps)
                .map(|step| end.portion(step as f64 / steps as f64))
                .collect(),
        )
    }

    /// Rows of three numbers, or of two in plane strain, where the rest is as without deformation.
    fn tensor(&mut self, key: &str, rows: &[Vec<f64>], kinematics: Kinematics) -> Option<Matrix3<f64>> {
        let has_size = |size: usize| rows.len() == size && rows.iter().all(|row| row.len() == size);
        let dimension = kinematics.dimension();
        if !has_size(3) && !has_size(dimension) {
            let expected = match kinematics {
                Kinematics::PlaneStrain => "2 rows of 2 numbers, or 3 rows of 3",
                Kinematics::ThreeDimensional => "3 rows of 3 numbers",
            };
            self.report(key, "this is no tensor", expected);
            return None;
        }
        let mut tensor = Matrix3::identity();
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                tensor[(i, j)] = *value;
            }
        }
        Some(tensor)
    }

    fn rotation(&mut self, values: &OneOrPerAxis<f64>, kinematics: Kinematics) -> Option<Vector3<f64>> {
        match values {
            ScalarOr::Scalar(angle) if kinematics == Kinematics::PlaneStrain => Some(Vector3::new(0.0, 0.0, *angle)),
            ScalarOr::Collection(values) if values.len() == 3 => Some(Vector3::from_column_slice(values)),
            _ => {
                let expected = match kinematics {
                    Kinematics::PlaneStrain => "an angle about z, or 3 numbers",
                    Kinematics::ThreeDimensional => "a list of 3 numbers",
                };
                self.report("rotation", "this is no rotation vector", expected);
                None
            }
        }
    }

    /// The states of a file, which then says all.
    fn states(&mut self, name: &str) -> Option<Vec<Deformation>> {
        let keys = self.keys;
        let beside = [
            ("steps", keys.steps.is_some()),
            ("deformation_gradient", keys.deformation_gradient.is_some()),
            ("rotation", keys.rotation.is_some()),
            ("wryness", keys.wryness.is_some()),
            ("alpha", keys.alpha.is_some()),
        ];
        for (key, _) in beside.iter().filter(|(_, set)| *set) {
            self.report(
                key,
                "the states of the path come from a file",
                "either file or end values with steps",
            );
        }
        let file = self.files.resolve(name);
        let text = match self.files.text(&file) {
            Ok(text) => text,
            Err(reason) => {
                self.report("file", format!("{file}: {reason}"), "a readable CSV file of states");
                return None;
            }
        };
        let read = read_states(text);
        for problem in read.as_ref().err().into_iter().flatten() {
            self.findings.problems.push(Problem {
                file: file.clone(),
                place: Some((problem.line, 1)),
                path: "path.file".to_owned(),
                message: problem.message.clone(),
                expected: problem.expected.clone(),
            });
        }
        read.ok()
    }
}

fn in_plane(deformation: &Deformation) -> bool {
    let f = &deformation.gradient;
    let w = &deformation.wryness;
    let rows = (0..3).all(|k| (0..2).all(|i| w[(i, k)] == 0.0)) && w[(2, 2)] == 0.0;
    let across = [f[(0, 2)], f[(1, 2)], f[(2, 0)], f[(2, 1)]];
    let turned = deformation.rotation[0] != 0.0 || deformation.rotation[1] != 0.0;
    across.iter().all(|value| *value == 0.0) && f[(2, 2)] == 1.0 && !turned && rows
}

fn is_classical(deformation: &Deformation) -> bool {
    deformation.rotation == Vector3::zeros() && deformation.wryness == Matrix3::zeros()
}

/// Reads states by the names of their columns.
fn read_states(text: &str) -> Result<Vec<Deformation>, Vec<LineProblem>> {
    let accepted = "F_xx to F_zz, rotation_x to rotation_z, wryness_xx to wryness_zz, alpha";
    let refuse = |line: usize, message: String, expected: &str| Err(vec![LineProblem::new(line, message, expected)]);
    let table = Table::open(text).map_err(|problem| vec![problem])?;
    let quantities = columns();
    let known: Vec<&str> = quantities.iter().map(String::as_str).collect();
    let find = |name: &str| Ok(known.iter().position(|other| other.eq_ignore_ascii_case(name)));
    let columns = table.columns(&known, accepted, find)?;
    let Some(names) = table.names() else {
        let (line, message) = match table.rows().next() {
            Some((line, _)) => (line, "there are no names of columns"),
            None => (1, "the file holds no states"),
        };
        return refuse(line, message.to_owned(), accepted);
    };
    let mut states = Vec::new();
    for (line, fields) in table.rows() {
        if fields.len() != names.len() {
            let message = format!("{} columns instead of {}", fields.len(), names.len());
            return refuse(line, message, "a number for every column");
        }
        if states.len() == MAXIMUM_STEPS {
            return refuse(line, format!("more than {MAXIMUM_STEPS} states"), "fewer states");
        }
        let mut state = Deformation::default();
        for (name, column) in known.iter().zip(&columns) {
            let (Some(column), Some(entry)) = (column, entry_of(&mut state, name)) else {
                continue;
            };
            let field = &fields[*column];
            let Some(value) = number(field) else {
                let message = format!("{name}: \"{}\" is not a number", shorten(field));
                return refuse(line, message, "a finite number");
            };
            *entry = value;
        }
        states.push(state);
    }
    if states.is_empty() {
        let message = "the file holds no states".to_owned();
        return refuse(table.line_of_names(), message, "a line of numbers per state");
    }
    Ok(states)
}

/// Names of all columns that `point` prints.
fn columns() -> Vec<String> {
    let components = |base: &str| {
        let components = TENSOR.iter().chain(&["x", "y", "z"]);
        components
            .map(|component| format!("{base}_{component}"))
            .collect::<Vec<_>>()
    };
    let several = COLUMNS.iter().flat_map(|base| components(base));
    several.chain(SINGLE_COLUMNS.map(str::to_owned)).collect()
}

/// The number of a state that a column holds, if it is one that a path prescribes.
fn entry_of<'a>(state: &'a mut Deformation, name: &str) -> Option<&'a mut f64> {
    if name == "alpha" {
        return Some(&mut state.alpha);
    }
    let (base, component) = name.rsplit_once('_')?;
    let tensor = TENSOR
        .iter()
        .position(|known| *known == component)
        .map(|k| (k / 3, k % 3));
    let axis = ["x", "y", "z"].iter().position(|known| *known == component);
    match base {
        "F" => tensor.map(|at| &mut state.gradient[at]),
        "wryness" => tensor.map(|at| &mut state.wryness[at]),
        "rotation" => axis.map(|at| &mut state.rotation[at]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_read_by_name_and_the_rest_is_undeformed() {
        let states = read_states("# shear\nstep,F_xy, rotation_z, wryness_zx\n1, 0.5, 0.25, 3\n2,1,0,0").unwrap();
        assert_eq!(states.len(), 2);
        assert_eq!((states[0].gradient[(0, 1)], states[0].gradient[(0, 0)]), (0.5, 1.0));
        assert_eq!((states[0].rotation[2], states[0].wryness[(2, 0)]), (0.25, 3.0));
        let again = read_states("\u{feff}ROTATION_Z;f_xy [-];Wryness zx [1/m]\r\n0.25;0.5;3\r\n0;1;0\r\n").unwrap();
        assert_eq!(again, states);
    }

    #[test]
    fn wrong_files_say_where() {
        for (text, line, message) in [
            ("", 1, "no states"),
            ("F_xx\n", 1, "no states"),
            ("F_xx,G_xx\n1,1\n", 1, "unknown column \"G_xx\""),
            ("F_xx,F_xx\n1,1\n", 1, "twice"),
            ("F_xx,F_xy\n1,0\n1\n", 3, "1 columns instead of 2"),
            ("F_xx\nnan\n", 2, "not a number"),
            ("1,2\n", 1, "no names of columns"),
            ("F_xx;F_xy\n1,1;0,5\n", 2, "decimal commas"),
            ("F_xx,wrynes_zx\n1,0\n", 1, "did you mean \"wryness_zx\"?"),
        ] {
            let problems = read_states(text).unwrap_err();
            assert_eq!((problems.len(), problems[0].line), (1, line), "{text}: {problems:?}");
            assert!(problems[0].message.contains(message), "{text}: {problems:?}");
        }
    }
}
