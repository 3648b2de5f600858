//! A great many random trial states per law: how many are returned, and whether each answer satisfies the equations of its
//! law, evaluated here from what leaves the law by other means than its own.
//!
//! Every trial has parameters of its own. `MPM_PETSC_TRIALS` sets how many there are of each law in plane strain and as
//! many in space (docs/stability.md has the counts of a million).

mod classical;
mod micropolar;
mod sandstone;

use super::check::{Random, driven};
use super::{Components, NoSolution};
use crate::continuum::micropolar::MicropolarStrain;
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};
use std::collections::BTreeMap;
use std::fmt::Debug;

/// Tolerance of the local iterations, as analyses have it.
const TOLERANCE: f64 = 1e-9;

/// Trials of a law in each set of components.
fn trials() -> usize {
    std::env::var("MPM_PETSC_TRIALS").map_or(5_000, |text| text.parse().expect("a number of trials"))
}

/// What became of the trials of a law.
#[derive(Debug, Default)]
struct Tally {
    returned: BTreeMap<&'static str, usize>,
    /// Refused, and there is no answer.
    without_answer: BTreeMap<&'static str, usize>,
    missed: BTreeMap<&'static str, usize>,
}

impl Tally {
    /// All trials that `make` makes; every answer is verified. `respond` gives for a trial the kind of its answer, or what is
    /// wrong with it, or why the law refused it; `has_answer` tells which of these have one.
    fn of<T: Debug>(
        components: Components,
        mut make: impl FnMut(&mut Random) -> T,
        respond: impl Fn(&T) -> Result<Result<&'static str, String>, NoSolution>,
        has_answer: impl Fn(&T) -> bool,
    ) -> Self {
        let mut random = Random::new(61);
        let mut tally = Self::default();
        for index in 0..trials() {
            let trial = make(&mut random);
            let (counts, kind) = match respond(&trial) {
                Ok(Ok(kind)) => (&mut tally.returned, kind),
                Ok(Err(failure)) => panic!("trial {index}: {failure}: {trial:?}"),
                Err(NoSolution { what, .. }) if has_answer(&trial) => (&mut tally.missed, what),
                Err(NoSolution { what, .. }) => (&mut tally.without_answer, what),
            };
            *counts.entry(kind).or_default() += 1;
        }
        println!("{components:?}: {:.6} {tally:?}", tally.share());
        tally
    }

    /// Returned ones among those that have an answer.
    fn share(&self) -> f64 {
        let sum = |counts: &BTreeMap<&'static str, usize>| counts.values().sum::<usize>() as f64;
        let returned = sum(&self.returned);
        returned / (returned + sum(&self.missed))
    }
}

/// A number from 0 to 1.
fn positive(random: &mut Random) -> f64 {
    random.number().abs()
}

/// One of several, each as likely.
fn choice<T: Copy>(random: &mut Random, choices: &[T]) -> T {
    choices[(positive(random) * choices.len() as f64) as usize % choices.len()]
}

/// A number between two others, of any magnitude between theirs.
fn spread(random: &mut Random, low: f64, high: f64) -> f64 {
    low * (high / low).powf(positive(random))
}

/// `6 sin / (3 - sin)` of an angle in degrees.
fn slope(degrees: f64) -> f64 {
    let sine = degrees.to_radians().sin();
    6.0 * sine / (3.0 - sine)
}

/// A rotation of up to `angle`, in plane strain about axis 3.
fn rotation(random: &mut Random, components: Components, angle: f64) -> Matrix3<f64> {
    let axis = match components {
        Components::Plane => Vector3::z(),
        Components::Space => Vector3::from_fn(|_, _| random.number()).normalize(),
    };
    Rotation3::new(axis * (angle * random.number())).into_inner()
}

/// A deformation gradient without rotation but for that of shear, with strains up to `size`: of any kind, without change of
/// shape, without change of volume, along one axis.
fn stretch(random: &mut Random, components: Components, size: f64) -> Matrix3<f64> {
    let dimension = if components == Components::Plane { 2 } else { 3 };
    loop {
        let mut change = random.tensor(driven(components).0) * size;
        match (positive(random) * 8.0) as usize {
            0 => {
                let along = change[(0, 0)];
                change.fill(0.0);
                (0..dimension).for_each(|k| change[(k, k)] = along);
            }
            1 => {
                let mean = change.trace() / dimension as f64;
                (0..dimension).for_each(|k| change[(k, k)] -= mean);
            }
            2 => {
                let along = change[(0, 0)];
                change.fill(0.0);
                change[(0, 0)] = along;
            }
            3 => (0..dimension).for_each(|k| change[(k, k)] += 0.5 * size),
            _ => {}
        }
        let stretch = Matrix3::identity() + change;
        if stretch.determinant() > 0.05 {
            return stretch;
        }
    }
}

/// A stretch of up to `size`, turned against the micro-rotation by up to `angle`, with wryness up to `1/length`.
fn micropolar_strain(
    random: &mut Random,
    components: Components,
    size: f64,
    [angle, length]: [f64; 2],
) -> MicropolarStrain {
    let wryness = match (positive(random) * 4.0) as usize {
        0 => 0.0,
        1 => 1.0 / length,
        _ => size / length,
    };
    MicropolarStrain {
        stretch: rotation(random, components, angle) * stretch(random, components, size),
        wryness: random.tensor(driven(components).1) * wryness,
    }
}

/// Size of the strains of a trial.
fn size(random: &mut Random) -> f64 {
    choice(random, &[0.5, 0.5, 0.2, 0.05, 5e-3, 1e-4])
}

/// Half of the logarithm of a tensor that is symmetric and positive definite.
fn half_logarithm(tensor: &Matrix3<f64>) -> Matrix3<f64> {
    let SymmetricEigen {
        eigenvalues,
        eigenvectors: v,
    } = SymmetricEigen::new((tensor + tensor.transpose()) * 0.5);
    v * Matrix3::from_diagonal(&eigenvalues.map(|value| 0.5 * value.ln())) * v.transpose()
}

/// Whether a residual is small beside what it is made of.
fn near(what: &str, value: f64, scale: f64, tolerance: f64) -> Result<(), String> {
    if value.abs() <= tolerance * scale {
        Ok(())
    } else {
        Err(format!("{what}: {value:e} of {scale:e}"))
    }
}

/// Tensor without its mean.
fn deviator(tensor: &Matrix3<f64>) -> Matrix3<f64> {
    tensor - Matrix3::from_diagonal_element(tensor.trace() / 3.0)
}
