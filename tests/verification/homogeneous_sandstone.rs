//! Sandstone in homogeneous plane strain, against an integration of its equations in principal stretches.
//!
//! Source: the law's equations as `src/material/sandstone.rs` states them, written down anew for a state without rotation,
//! in which all tensors are diagonal: the energy of the principal elastic stretches `c`,
//!
//! ```text
//! W = K/8 (J - 1/J)^2 + (1 - omega) G/2 (J^(-2/3) c.c - 3)
//!
//!      uy = -0.24 mm
//!        +------+
//!        | .  . |   one cell of 10 mm, four points in it, all four nodes moved, 24 steps;
//!        | .  . |-> rotation and damage field are solved for, and homogeneous: alpha = alpha_d
//!        +------+   ux = 0.18 mm
//! ```
//!
//! What could go wrong: the update of the plastic deformation over many steps, the volume in the dilatancy, the
//! field equation of `alpha` and the damage that follows from it.
//!
//! Expected: mean Cauchy stresses, alpha and the multiplier equal at every step to 1e-6 of the largest value; the same
//! equations in ever smaller steps approach one limit, with errors in proportion to the step.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::results::Table;
use nalgebra::{Matrix4, Vector3, Vector4};

const SHEAR: f64 = 13.0e9 / 2.7;
const BULK: f64 = 13.0e9 / 0.9;
const COHESION: f64 = 8.0e6;
const HARDENING_STRESS: f64 = 11.0e6;
const HARDENING_RATE: f64 = 1400.0;
const DILATION_RATE: f64 = 1.0;
const ROUNDING: f64 = 1.0e4;
const SOFTENING: f64 = 0.02;
const CELL: f64 = 0.01;
/// Motion of the sides of the cell [m].
const MOTION: [f64; 2] = [1.8e-4, -2.4e-4];
const STEPS: usize = 24;

/// `6 sin/(3 + sin)`.
fn slope(degrees: f64) -> f64 {
    let sine = degrees.to_radians().sin();
    6.0 * sine / (3.0 + sine)
}

/// State of a point in principal axes.
#[derive(Clone, Copy)]
struct State {
    /// Logarithms of the plastic stretches.
    plastic: Vector3<f64>,
    /// Accumulated multiplier.
    multiplier: f64,
}

/// Derivative of the energy by the logarithms of the elastic stretches: mean part and deviator.
fn mandel(logarithms: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let volume = logarithms.sum().exp();
    // d/d ln J of K/8 (J - 1/J)^2.
    let pressure = 0.25 * BULK * (volume - 1.0 / volume) * (volume + 1.0 / volume);
    let squares = logarithms.map(|x| (2.0 * x).exp()) * volume.powf(-2.0 / 3.0);
    (pressure, squares.add_scalar(-squares.mean()) * SHEAR)
}

/// Residuals of a step, for the elastic logarithms and the multiplier: flow rule, and yield function over the shear modulus.
fn residuals(unknown: &Vector4<f64>, trial: &Vector3<f64>, old: f64) -> Vector4<f64> {
    let elastic = unknown.xyz();
    let multiplier = unknown.w;
    let (pressure, deviator) = mandel(&elastic);
    // J2 = S:S/2.
    let shear = (1.5 * deviator.norm_squared() + ROUNDING * ROUNDING).sqrt();
    let accumulated = old + multiplier;
    let dilatancy = slope(20.0) * (-DILATION_RATE * accumulated).exp();
    let flow = deviator * (1.5 / shear) + Vector3::repeat(dilatancy / 3.0);
    let phi = 30f64.to_radians();
    let strength = 6.0 * COHESION * phi.cos() / (3.0 + phi.sin());
    let hardening = HARDENING_STRESS * (1.0 - (-HARDENING_RATE * accumulated).exp());
    let excess = shear + slope(30.0) * pressure - strength - hardening;
    (elastic - trial + flow * multiplier).push(excess / SHEAR)
}

/// One step to total logarithms: implicit Euler, by Newton's method with differences for derivatives.
fn step(old: &State, total: &Vector3<f64>) -> State {
    let trial = total - old.plastic;
    let mut unknown = trial.push(0.0);
    if residuals(&unknown, &trial, old.multiplier).w <= 0.0 {
        return *old;
    }
    for _ in 0..30 {
        let residual = residuals(&unknown, &trial, old.multiplier);
        if residual.norm() < 1e-14 {
            break;
        }
        let columns = [0, 1, 2, 3].map(|k| {
            const SHIFT: f64 = 1e-7;
            let mut moved = unknown;
            moved[k] += SHIFT;
            let ahead = residuals(&moved, &trial, old.multiplier);
            moved[k] -= 2.0 * SHIFT;
            (ahead - residuals(&moved, &trial, old.multiplier)) / (2.0 * SHIFT)
        });
        let change = Matrix4::from_columns(&columns).lu().solve(&residual).expect("regular");
        unknown -= change;
    }
    let left = residuals(&unknown, &trial, old.multiplier).norm();
    assert!(left < 1e-12 && unknown.w > 0.0, "{left} {unknown}");
    State {
        plastic: total - unknown.xyz(),
        multiplier: old.multiplier + unknown.w,
    }
}

/// Mean Cauchy stresses xx, yy, zz, alpha, damage and the multiplier.
fn observe(state: &State, total: &Vector3<f64>) -> [f64; 6] {
    let (pressure, deviator) = mandel(&(total - state.plastic));
    let alpha = state.plastic.sum();
    let damage = (1.0 - (-alpha / SOFTENING).exp()).clamp(0.0, 0.99);
    let cauchy = (deviator * (1.0 - damage)).add_scalar(pressure) / total.sum().exp();
    [cauchy.x, cauchy.y, cauchy.z, alpha, damage, state.multiplier]
}

/// Total logarithms after each step: the gradient of a step refers to the cell, which stays as it is.
fn path() -> impl Iterator<Item = Vector3<f64>> {
    let [x, y] = MOTION.map(|motion| (motion / (STEPS as f64 * CELL)).ln_1p());
    (1..=STEPS).map(move |step| Vector3::new(x, y, 0.0) * step as f64)
}

fn integrate(path: impl Iterator<Item = Vector3<f64>>) -> Vec<[f64; 6]> {
    let mut state = State {
        plastic: Vector3::zeros(),
        multiplier: 0.0,
    };
    path.map(|total| {
        state = step(&state, &total);
        observe(&state, &total)
    })
    .collect()
}

fn program() -> Table {
    let [x, y] = MOTION;
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain, continuum: gradient_micropolar}}
grid: {{min: [0.0, 0.0], max: [{CELL:?}, {CELL:?}], cells: 1, basis: linear}}
materials:
  sandstone:
    law: sandstone
    youngs_modulus: 13.0e9
    poisson_ratio: 0.35
    coupling_ratio: 1.0
    bending_length: 1.0e-3
    bounded_stiffness: true
    cohesion: {COHESION:?}
    friction_angle: 30.0
    dilatancy_angle: 20.0
    plastic_length: 1.0e-3
    hardening_stress: {HARDENING_STRESS:?}
    hardening_rate: {HARDENING_RATE:?}
    dilation_rate: {DILATION_RATE:?}
    apex_rounding: {ROUNDING:?}
    damage_length: 1.0e-3
    softening_modulus: {SOFTENING:?}
bodies:
  - {{name: block, material: sandstone, shape: {{box: {{min: [0.001, 0.001], max: [0.009, 0.009]}}}}, points_per_cell: 2}}
boundary:
  - {{face: x_min, fix: [ux]}}
  - {{face: y_min, fix: [uy]}}
  - {{face: x_max, move: {{ux: {x:?}}}}}
  - {{face: y_max, move: {{uy: {y:?}}}}}
stages: [{{name: squeeze, steps: {STEPS}}}]
solver: {{force_tolerance: 1.0e-12, return_map_tolerance: 1.0e-13}}
output:
  history:
    - {{name: stress, mean: stress}}
    - {{name: alpha, mean: alpha}}
    - {{name: damage, mean: damage}}
    - {{name: chi, mean: chi}}
    - {{name: chi_max, max: chi}}
"
    ))
    .run()
    .completed()
    .history()
}

const COLUMNS: [&str; 6] = ["stress_xx", "stress_yy", "stress_zz", "alpha", "damage", "chi"];

#[test]
fn one_cell_follows_the_integration_in_principal_stretches() {
    let found = program();
    let expected = integrate(path());
    assert_eq!(found.rows.len(), STEPS + 1, "no step is halved");
    let mut comparison = Comparison::new("one cell, and the integration in principal stretches");
    for (k, name) in COLUMNS.into_iter().enumerate() {
        let largest = expected.iter().fold(0.0f64, |largest, row| largest.max(row[k].abs()));
        let column = found.column(name);
        for (row, expected) in expected.iter().enumerate() {
            comparison.within(
                &format!("{name}, step {}", row + 1),
                column[row + 1],
                expected[k],
                1e-6 * largest,
            );
        }
    }
    comparison.finish();
    let [.., alpha, damage, multiplier] = expected[STEPS - 1];
    assert!(
        alpha > 1e-3 && damage > 0.1 && multiplier > 5e-3,
        "{alpha} {damage} {multiplier}"
    );
    let spread = found.last("chi_max") - found.last("chi");
    assert!(spread.abs() < 1e-9, "not homogeneous: {spread}");
}

/// The steps' own error is of first order: the program converges to the law, not to an artefact of its steps.
#[test]
fn error_of_the_steps_falls_in_proportion_to_them() {
    let end = path().last().expect("a path");
    let run = |steps: usize| {
        let path = (1..=steps).map(move |step| end * (step as f64 / steps as f64));
        integrate(path)[steps - 1]
    };
    let fine = run(8192);
    let error = |steps: usize| (run(steps)[1] / fine[1] - 1.0).abs();
    let (coarse, halved) = (error(32), error(64));
    println!("errors of the axial stress {coarse:e} {halved:e}");
    assert!(coarse < 1e-2, "{coarse}");
    assert!(coarse < 2.5 * halved && coarse > 1.7 * halved, "{coarse} {halved}");
}
