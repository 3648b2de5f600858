//! B-splines of order 1 to 3.
//!
//! Source: closed forms, and the linear basis, which splines of order 1 are.
//!
//! ```text
//!   o-o---o---o---o-o    order 2 on four cells: the nodes at their Greville points; those on the faces of the grid
//!   | |   |   |   | |    alone decide what the field is there
//!   |   |   |   |   |
//! ```
//!
//! Expected: histories of order 1 and of the linear basis agree to 1e-12; errors of the manufactured solution fall with
//! the cells to the power `p + 1` for the fields and `p` for the stresses, which are gradients; on a grid that follows
//! its platen a uniform compression has the stress `sigma = B F^T / det F` of uniaxial strain, everywhere, to 1e-9.

use crate::common::compare::{Comparison, same_history};
use crate::common::launch::{Launch, Run};
use crate::common::scene::extremes;
use crate::manufactured::errors_in_plane;

fn order_one_is_linear(scene: impl Fn() -> Launch) {
    let run = |basis: &str| scene().set(&[&format!("grid.basis={basis}")]).run().completed();
    let (linear, spline) = (run("linear"), run("bspline1"));
    same_history("bspline1 and linear", &spline.history(), &linear.history(), 1e-12);
    for key in ["active_cells", "dofs", "nonzeros", "newton_iterations"] {
        assert_eq!(spline.summary().count(key), linear.summary().count(key), "{key}");
    }
}

#[test]
fn order_one_is_the_linear_basis_in_the_shear_layer() {
    order_one_is_linear(|| Launch::config("shear_layer").set(&["stages.0.steps=20"]));
}

#[test]
fn order_one_is_the_linear_basis_with_ghost_penalty_in_space() {
    let ghost = "stabilisation={ghost: {translation: 1.0e9, rotation: 1.0e9, scaling: stiffness}}";
    order_one_is_linear(|| {
        let ramp = ["stages.0.steps=3", "loads.0.force=[0.0, 0.0, 200.0]", ghost];
        Launch::config("curved_cantilever_2m").set(&ramp)
    });
}

#[test]
fn errors_fall_at_the_rates_of_the_order() {
    for order in 1..=3 {
        let basis = format!("bspline{order}");
        let [coarse, fine] = [16, 32].map(|cells| errors_in_plane(&basis, cells, 4));
        let rates: Vec<f64> = coarse
            .iter()
            .zip(fine)
            .map(|(coarse, fine)| (coarse / fine).log2())
            .collect();
        println!("order {order}: errors {coarse:?} and {fine:?}, rates {rates:.3?}");
        let fields = order as f64 + 1.0;
        for (rate, expected) in rates.iter().zip([fields, fields, fields - 1.0, fields - 1.0]) {
            assert!(
                *rate > expected - 0.1,
                "order {order}: a rate of {rate} instead of {expected}"
            );
        }
    }
}

/// A block between rollers, pressed by a platen that the grid follows.
fn compress(basis: &str) -> Run {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [0.02, 0.04], cell_size: 0.01, basis: {basis}, follow_face: y_max}}
materials:
  rubber: {{law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: block, material: rubber, shape: {{box: {{min: [0.0, 0.0], max: [0.02, 0.04]}}}}, points_per_cell: 2, placement: gauss}}
boundary:
  - {{face: y_min, fix: [uy]}}
  - {{face: y_max, move: {{uy: -0.01}}, name: platen}}
  - {{face: x_min, fix: [ux]}}
  - {{face: x_max, fix: [ux]}}
stages: [{{name: compress, steps: 5}}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: platen, reaction: {{boundary: platen, component: uy}}}}
{}",
        extremes(&["stress", "position"])
    ))
    .run()
    .completed()
}

#[test]
fn uniaxial_strain_on_a_moving_grid() {
    let (stretch, lambda, mu): (f64, f64, f64) = (0.75, 8.0e6, 6.0e6);
    let (along, across) = (
        (lambda + 2.0 * mu) * (stretch - 1.0),
        lambda * (stretch - 1.0) / stretch,
    );
    for basis in ["bspline1", "bspline2", "bspline3"] {
        let history = compress(basis).history();
        let mut comparison = Comparison::new(basis);
        for bound in ["max", "min"] {
            for (component, expected) in [("yy", along), ("xx", across), ("zz", across)] {
                let title = format!("stress_{bound}_{component}");
                comparison.relative(&title, history.last(&title), expected, 1e-9);
            }
            comparison.within(
                bound,
                history.last(&format!("stress_{bound}_xy")),
                0.0,
                1e-9 * along.abs(),
            );
        }
        // The points stay at Gauss' places of the cells, with which a uniform stress is in equilibrium for every order.
        let highest = stretch * (0.04 - 0.01 * 0.5 * (1.0 - 1.0 / 3f64.sqrt()));
        comparison.relative("highest point", history.last("position_max_y"), highest, 1e-12);
        comparison.relative("platen", history.last("platen"), 0.02 * along, 1e-9);
        comparison.finish();
    }
}
