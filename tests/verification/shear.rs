//! Simple shear with free rotations: a patch test for the coupling of displacement and rotation.
//!
//! Source: closed form. Without couples at its surface a body that is sheared homogeneously by `F = I + g e_x e_y` turns
//! its microrotation to the rotation of the polar decomposition of `F`, `tan r = -g / 2`, where the stress is symmetric:
//! `U = Q^T F`, `B = lambda tr(U - I) I + 2 mu (U - I)`, `sigma = Q B F^T / det F`.
//!
//! ```text
//!       +---+---+
//!      /   /   /    ux = g y, uy = 0 on all nodes, rotations free; one step
//!     +---+---+
//!    /   /   /      linear basis, points at even positions of whole cells
//!   +---+---+
//! ```
//!
//! Expected: rotation, stress, and the sum of forces on the top nodes (the nominal stress `P = Q B` times the width), to
//! 1e-9.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::scene::extremes;
use nalgebra::Matrix3;

const LAMBDA: f64 = 8.0e6;
const MU: f64 = 6.0e6;
const EDGE: f64 = 0.01;
const SHEAR: f64 = 0.4;
const TOLERANCE: f64 = 1e-9;

#[test]
fn a_sheared_block_turns_like_the_polar_decomposition() {
    let rows: String = (0..=2)
        .map(|row| {
            let y = f64::from(row) * EDGE;
            let name = ["base", "middle", "top"][row as usize];
            format!(
                "  - {{face: {{axis: y, at: {y:?}}}, fix: [uy], move: {{ux: {:?}}}, name: {name}}}\n",
                SHEAR * y
            )
        })
        .collect();
    let history = Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [0.04, 0.02], cell_size: {EDGE}, basis: linear}}
materials:
  rubber: {{law: elastic, lame_lambda: {LAMBDA:?}, shear_modulus: {MU:?}, coupling_modulus: 2.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: block, material: rubber, shape: {{box: {{min: [0.0, 0.0], max: [0.02, 0.02]}}}}, points_per_cell: 2}}
boundary:
{rows}
stages: [{{name: shear, steps: 1}}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: top_x, reaction: {{boundary: top, component: ux}}}}
    - {{name: top_y, reaction: {{boundary: top, component: uy}}}}
{}",
        extremes(&["stress", "couple_stress", "rotation"])
    ))
    .run()
    .completed()
    .history();

    let gradient = Matrix3::new(1.0, SHEAR, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let angle = -(0.5 * SHEAR).atan();
    let (sine, cosine) = angle.sin_cos();
    let rotation = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
    let strain = rotation.transpose() * gradient - Matrix3::identity();
    assert!((strain - strain.transpose()).norm() < 1e-15);
    let nominal = rotation * (Matrix3::identity() * LAMBDA * strain.trace() + 2.0 * MU * strain);
    let stress = nominal * gradient.transpose();
    let width = 2.0 * EDGE;

    let mut comparison = Comparison::new("simple shear");
    comparison.relative(
        "force on the top, x",
        history.last("top_x"),
        nominal[(0, 1)] * width,
        TOLERANCE,
    );
    comparison.relative(
        "force on the top, y",
        history.last("top_y"),
        nominal[(1, 1)] * width,
        TOLERANCE,
    );
    for bound in ["max", "min"] {
        let title = format!("rotation_{bound}");
        comparison.relative(&title, history.last(&title), angle, TOLERANCE);
        for (row, name) in ["x", "y", "z"].iter().enumerate() {
            for (column, other) in ["x", "y", "z"].iter().enumerate() {
                let title = format!("stress_{bound}_{name}{other}");
                let expected = stress[(row, column)];
                comparison.within(&title, history.last(&title), expected, TOLERANCE * stress.norm());
                let title = format!("couple_stress_{bound}_{name}{other}");
                comparison.within(&title, history.last(&title), 0.0, TOLERANCE * EDGE * stress.norm());
            }
        }
    }
    comparison.finish();
}
