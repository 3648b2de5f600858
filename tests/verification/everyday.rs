//! Small scenes as users of other codes bring them: layers that turn at their faces, motions back and forth, stages in
//! which nothing happens, more ranks than cells.
//!
//! Source: closed forms and balance. For the layer, the linear equations of the micropolar continuum (Eringen 1966): with
//! the constant shear stress `tau`, `u' = (tau - 2 kappa r) / (mu + kappa)` and `B r'' = 2 kappa (u' + 2 r)`, so that with
//! `r = 0` at both faces of a layer of height `h`
//!
//! ```text
//!     r   = -tau / (2 mu) (1 - cosh(p (y - h / 2)) / cosh(p h / 2)),    p^2 = 4 kappa mu / (B (mu + kappa))
//!     u_h = tau / (mu + kappa) (h + kappa / mu (h - 2 / p tanh(p h / 2)))
//!     couple on the faces = tau / (2 mu) B p tanh(p h / 2),             B = 4 mu l^2
//! ```
//!
//! Expected: forces that balance, and motions that are where they were moved to, to round-off; the layer as its tests say.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::results::Table;

/// A shear of 1e-4 makes the answer of the finite theory differ by that much; the cells of a quarter of the internal
/// length, with quadratic splines, by less.
const LAYER: f64 = 2.0e-4;

#[test]
fn a_layer_that_does_not_turn_at_its_faces_has_force_and_couple_of_the_closed_form() {
    let [mu, kappa, length, width, motion]: [f64; 5] = [1.0e6, 0.5e6, 0.1, 0.2, 1.0e-4];
    let history = Launch::text(
        "
model: {kinematics: plane_strain}
grid: {min: [0.0, 0.0], max: [0.2, 1.0], cells: [2, 40], basis: bspline2}
materials:
  rock: {law: elastic, youngs_modulus: 2.5e6, poisson_ratio: 0.25, coupling_modulus: 0.5e6, bending_length: 0.1, bounded_stiffness: true}
bodies:
  - {name: layer, material: rock, points_per_cell: 3, shape: {box: {min: [0.0, 0.0], max: [0.2, 1.0]}}}
boundary:
  - {face: y_min, fix: [ux, uy, rz], name: base}
  - {face: y_max, fix: [uy, rz], move: {ux: 1.0e-4}}
  - {face: x_min, fix: [uy]}
  - {face: x_max, fix: [uy]}
stages: [{name: shear, steps: 1}]
output:
  history:
    - {name: force, reaction: {boundary: base, component: ux}}
    - {name: couple, reaction: {boundary: base, component: rz}}
",
    )
    .run()
    .completed()
    .history();
    let stiffness = 4.0 * mu * length * length;
    let p = (4.0 * kappa * mu / (stiffness * (mu + kappa))).sqrt();
    let bend = (0.5 * p).tanh();
    let stress = motion * (mu + kappa) / (1.0 + kappa / mu * (1.0 - 2.0 / p * bend));
    let mut comparison = Comparison::new("layer that does not turn at its faces");
    comparison.relative("force", -history.last("force"), stress * width, LAYER);
    let couple = stress / (2.0 * mu) * stiffness * p * bend;
    comparison.relative("couple", history.last("couple"), couple * width, 2.0 * LAYER);
    comparison.finish();
}

/// How far the reaction of a converged step may be from the load: `solver.force_tolerance` unless set.
const FORCE_TOLERANCE: f64 = 1.0e-9;

/// History of a block of one cell under these conditions, loads and stages.
fn block(conditions: &str, ranks: usize) -> Table {
    let scene = format!(
        "
model: {{kinematics: plane_strain, continuum: classical}}
grid: {{min: [0.0, 0.0], max: [1.0, 1.0], cells: 1, basis: linear}}
materials:
  soil: {{law: von_mises, youngs_modulus: 1.0e7, poisson_ratio: 0.3, yield_strength: 50.0e3}}
bodies:
  - {{name: block, material: soil, points_per_cell: 2, shape: {{box: {{min: [0.0, 0.0], max: [1.0, 1.0]}}}}}}
{conditions}"
    );
    Launch::text(&scene).ranks(ranks).run().completed().history()
}

/// A `move` counts from where its stage begins, as the page of keys says with these numbers.
#[test]
fn a_face_goes_forth_back_and_beyond_by_the_motions_of_its_stages() {
    let history = block(
        "boundary:
  - {face: y_min, fix: [ux, uy]}
  - {face: y_max, fix: [uy], move: {ux: 0.01}, name: forth}
  - {face: y_max, fix: [uy], move: {ux: -0.01}, name: back, stage: back}
  - {face: y_max, fix: [uy], move: {ux: -0.01}, name: beyond, stage: beyond}
stages:
  - {name: forth, steps: 2}
  - {name: back, steps: 2}
  - {name: beyond, steps: 2}
output:
  history:
    - {name: top, max: displacement}
    - {name: low, min: displacement}
",
        1,
    );
    // Points at a quarter and at three quarters of the height of a block that is sheared evenly.
    let ends = [2, 4, 6].map(|row| history.column("top_x")[row] + history.column("low_x")[row]);
    let mut comparison = Comparison::new("motion back and forth");
    for (end, motion) in ends.into_iter().zip([0.01, 0.0, -0.01]) {
        comparison.within("sum of the largest and the smallest motion", end, motion, 1e-9 * 0.01);
    }
    comparison.finish();
}

/// On one rank, and on four that share one cell; the first and the last stage have no load of their own.
#[test]
fn stages_without_a_load_pass_and_those_after_them_balance() {
    for ranks in [1, 4] {
        let history = block(
            "boundary:
  - {face: x_min, fix: [ux]}
  - {face: y_min, fix: [uy], name: base}
loads:
  - {name: push, force: [0.0, -20.0e3], at: {layer: {body: block, face: y_max}}, stage: load}
stages:
  - {name: nothing, steps: 2}
  - {name: load, steps: 2}
  - {name: hold, steps: 2}
output: {history: [{name: base, reaction: {boundary: base, component: uy}}]}
",
            ranks,
        );
        let base = history.column("base");
        assert_eq!(base.len(), 7);
        assert!(base[1].abs() < 1e-6 && base[2].abs() < 1e-6, "{base:?}");
        for reaction in &base[4..] {
            assert!((reaction / 20.0e3 - 1.0).abs() < FORCE_TOLERANCE, "{base:?}");
        }
    }
}
