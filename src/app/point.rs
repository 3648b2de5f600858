//! `mpm-petsc point`: drives one material along a path and prints what it answers.

use super::{Laws, print, read_input};
use crate::config::point::{PointTask, TENSOR};
use crate::continuum::ContinuumKind;
use crate::continuum::classical::Classical;
use crate::continuum::gradient_micropolar::GradientMicropolar;
use crate::continuum::micropolar::Micropolar;
use crate::error::Error;
use crate::material::Components;
use crate::material::driver::{Answer, Deformation, Driven, drive};
use crate::parallel::World;
use crate::scene::Kinematics;
use nalgebra::Matrix3;
use std::fmt::Write;

/// Collective; the root alone drives and prints.
///
/// # Errors
/// What is wrong with the file, and the step at which the law finds no stress, after the rows before it.
pub fn point(world: &World, file: &str, overrides: &[String]) -> Result<(), Error> {
    let task = read_input(world, file, overrides)?
        .point()
        .map_err(Error::Configuration)?;
    let (text, outcome) = match task.continuum {
        ContinuumKind::Classical => table::<Classical>(&task),
        ContinuumKind::Micropolar => table::<Micropolar>(&task),
        ContinuumKind::GradientMicropolar => table::<GradientMicropolar>(&task),
    };
    print(world, || Ok(text)).and(outcome)
}

/// Rows of all steps, and why there are no more.
fn table<C: Laws + Driven>(task: &PointTask) -> (String, Result<(), Error>) {
    let components = match task.kinematics {
        Kinematics::PlaneStrain => Components::Plane,
        Kinematics::ThreeDimensional => Components::Space,
    };
    let law = C::law(&task.material, components);
    let mut text = String::new();
    let answers = drive(law.as_ref(), task.path.iter().copied());
    for (step, (deformation, answer)) in (1..).zip(task.path.iter().zip(answers)) {
        match answer {
            Ok(answer) => {
                let row = row(step, deformation, &answer);
                if step == 1 {
                    text += &line(row.iter().map(|(name, _)| name.clone()));
                }
                text += &line(row.into_iter().map(|(_, value)| value));
            }
            Err(failure) => {
                let message = format!(
                    "step {step} of {}: the law finds no stress: {} (local residual {:.2e})",
                    task.path.len(),
                    failure.what,
                    failure.residual
                );
                return (text, Err(Error::Analysis(message)));
            }
        }
    }
    (text, Ok(()))
}

/// Columns of a step with their names.
fn row(step: usize, deformation: &Deformation, answer: &Answer) -> Vec<(String, String)> {
    let seen = &answer.observation;
    let mut row = vec![("step".to_owned(), step.to_string())];
    let mut tensor = |base: &str, values: &Matrix3<f64>| {
        for (k, component) in TENSOR.iter().enumerate() {
            row.push((format!("{base}_{component}"), values[(k / 3, k % 3)].to_string()));
        }
    };
    tensor("F", &deformation.gradient);
    if let Some(wryness) = &seen.wryness {
        tensor("Q", &deformation.rotation_matrix());
        tensor("wryness", wryness);
    }
    tensor("stress", &seen.stress);
    if let Some(couple_stress) = &seen.couple_stress {
        tensor("couple_stress", couple_stress);
    }
    let pressure = seen.stress.trace() / 3.0;
    let symmetric = (seen.stress + seen.stress.transpose()) * 0.5;
    let deviator = symmetric - Matrix3::from_diagonal_element(pressure);
    let mut single = |name: &str, value: String| row.push((name.to_owned(), value));
    if seen.rotation.is_some() {
        for (axis, value) in ["x", "y", "z"].iter().zip(deformation.rotation.iter()) {
            single(&format!("rotation_{axis}"), value.to_string());
        }
    }
    single("pressure", pressure.to_string());
    single("von_mises", (1.5 * deviator.norm_squared()).sqrt().to_string());
    single("chi", answer.chi.unwrap_or(0.0).to_string());
    if let Some(alpha) = seen.alpha {
        single("alpha", alpha.to_string());
        single("damage", answer.damage.unwrap_or(0.0).to_string());
    }
    single("local_iterations", answer.local_iterations.to_string());
    row
}

fn line(fields: impl Iterator<Item = String>) -> String {
    let mut text = String::new();
    for (position, field) in fields.enumerate() {
        let separator = if position == 0 { "" } else { "," };
        write!(text, "{separator}{field}").expect("a text grows");
    }
    text + "\n"
}
