//! A column under its own weight.
//!
//! Source: closed form. With the sides held, the nominal stress at a height `Y` of the unloaded column of height `H`
//! carries the weight above, `P = -w (H - Y)`; there `B = P` (no rotation), and since `sigma = B F / det F = B` the Cauchy
//! stress is the same, at any strain.
//!
//! ```text
//!     |. .|   H
//!     |. .|
//!     |. .|        w per unit reference volume, ux = rz = 0 on all nodes
//!     |. .|
//!     #####   0
//! ```
//!
//! Expected: with one point in the middle of each cell, linear basis and one step, every stress to 1e-9 (the strain of a
//! cell is that of its middle). In ten steps with GIMPM the points leave their places in the cells, and the strain still
//! hardly varies within a cell: stresses are wrong by at most the weight of half a cell, an error of first order. The base
//! carries the whole weight to 1e-9 in any case.

use crate::common::compare::{Comparison, same_history};
use crate::common::launch::{Launch, Run};
use crate::common::snapshots::Snapshots;

const WEIGHT: f64 = 20.0e3;
const HEIGHT: f64 = 10.0;
const WIDTH: f64 = 0.5;

/// `load` and `density` are the entries that make the weight.
fn run(load: &str, density: &str, cells: usize, basis: &str, points_per_cell: usize, steps: usize) -> Run {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [{WIDTH}, {HEIGHT}], cells: [1, {cells}], basis: {basis}}}
materials:
  soil: {{law: elastic, lame_lambda: 0.8e6, shear_modulus: 0.6e6, coupling_modulus: 1.0e5, bending_length: 0.1, bounded_stiffness: true{density}}}
bodies:
  - {{name: column, material: soil, shape: {{box: {{min: [0.0, 0.0], max: [{WIDTH}, {HEIGHT}]}}}}, points_per_cell: {points_per_cell}}}
boundary:
  - {{face: all, fix: [ux, rz]}}
  - {{face: y_min, fix: [uy], name: base}}
loads:
  - {load}
stages: [{{name: load, steps: {steps}}}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: base, reaction: {{boundary: base, component: uy}}}}
    - {{name: top, min: displacement}}
    - {{name: stress, min: stress}}
"
    ))
    .run()
    .completed()
}

/// Largest difference from the closed form, over the largest stress.
fn stress_error(run: &Run) -> f64 {
    let snapshots = Snapshots::read(&run.file("points.vtkhdf"));
    let last = snapshots.times.len() - 1;
    let stresses = snapshots.field::<9>("stress", last);
    let heights = snapshots.positions(0).into_iter().map(|[_, y, _]| y);
    heights
        .zip(stresses)
        .map(|(height, stress)| (stress[4] + WEIGHT * (HEIGHT - height)).abs() / (WEIGHT * HEIGHT))
        .fold(0.0, f64::max)
}

fn compare(run: &Run, stress_tolerance: f64) {
    let history = run.history();
    let mut comparison = Comparison::new("column under its own weight");
    let total = WEIGHT * HEIGHT * WIDTH;
    let factors = history.column("load_factor");
    for (factor, base) in factors.iter().zip(history.column("base")).skip(1) {
        comparison.relative(&format!("base reaction at {factor}"), base, factor * total, 1e-9);
    }
    comparison.at_most("error of the stress", stress_error(run), stress_tolerance);
    comparison.finish();
    let settled = -history.last("top_y") / HEIGHT;
    assert!(settled > 0.04, "the strain of {settled} is not finite");
}

const SPECIFIC_WEIGHT: &str = "{specific_weight: [0.0, -20.0e3]}";

#[test]
fn one_point_in_the_middle_of_each_cell_has_the_exact_stress() {
    compare(&run(SPECIFIC_WEIGHT, "", 20, "linear", 1, 1), 1e-9);
}

#[test]
fn ten_steps_with_domains_converge_to_the_closed_form() {
    let errors = [10, 20, 40].map(|cells| {
        let run = run(SPECIFIC_WEIGHT, "", cells, "gimp", 2, 10);
        compare(&run, 0.5 / cells as f64);
        stress_error(&run)
    });
    println!("errors of the stress, over the largest: {errors:.3?}");
    assert!(errors.windows(2).all(|pair| pair[1] < 0.6 * pair[0]), "{errors:?}");
}

#[test]
fn gravity_on_a_density_is_a_specific_weight() {
    let gravity = run("{gravity: [0.0, -10.0]}", ", density: 2000.0", 20, "gimp", 2, 2);
    let weight = run(SPECIFIC_WEIGHT, "", 20, "gimp", 2, 2);
    same_history(
        "gravity and specific weight",
        &gravity.history(),
        &weight.history(),
        1e-12,
    );
}
