//! A rotation that dies away into a body: the length that the coupling modulus and the curvature moduli make.
//!
//! Source: closed form. Where displacements are held, small rotations obey `(beta + gamma) r'' = 4 kappa r`: with
//! `r(0) = 0` and `r(L) = r_L` the couple that turns the end is `(beta + gamma) p r_L coth(p L)` per unit area,
//! `p = 2 sqrt(kappa / (beta + gamma))`.
//!
//! ```text
//!    rz = 0 |=====================================| rz = r_L
//!           x = 0      ux = uy = 0 on all nodes   x = L = 5 / p
//! ```
//!
//! Expected: the couple within 1 % with cells of 1 / (4 p), and an error that falls with the square of the cell size.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;

const KAPPA: f64 = 1.0e6;
const CURVATURE_MODULUS: f64 = 400.0;
const LENGTH: f64 = 0.05;
const HEIGHT: f64 = 0.005;
const ROTATION: f64 = 1.0e-5;

/// The couple at the end, per unit area.
fn couple(cells: usize) -> f64 {
    let history = Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [{LENGTH}, {HEIGHT}], cells: [{cells}, 1], basis: linear}}
materials:
  rubber: {{law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: {KAPPA:?}, alpha: 5.0, beta: 150.0, gamma: 250.0}}
bodies:
  - {{name: strip, material: rubber, shape: {{box: {{min: [0.0, 0.0], max: [{LENGTH}, {HEIGHT}]}}}}, points_per_cell: 4}}
boundary:
  - {{face: all, fix: [ux, uy]}}
  - {{face: x_min, fix: [rz], name: held}}
  - {{face: x_max, move: {{rz: {ROTATION:?}}}, name: turned}}
stages: [{{name: turn, steps: 1}}]
output:
  history:
    - {{name: couple, reaction: {{boundary: turned, component: rz}}}}
"
    ))
    .run()
    .completed()
    .history();
    history.last("couple") / HEIGHT
}

#[test]
fn the_couple_that_turns_the_end_converges_with_the_square_of_the_cell_size() {
    let p = 2.0 * (KAPPA / CURVATURE_MODULUS).sqrt();
    let exact = CURVATURE_MODULUS * p * ROTATION / (p * LENGTH).tanh();
    let errors = [20, 40, 80].map(|cells| (couple(cells) - exact).abs() / exact);
    println!("relative errors {errors:?}");
    let mut comparison = Comparison::new("error of the couple");
    comparison.at_most("20 cells", errors[0], 0.01);
    comparison.at_most("40 cells, over 20", errors[1] / errors[0], 0.3);
    comparison.at_most("80 cells, over 40", errors[2] / errors[1], 0.3);
    comparison.finish();
}
