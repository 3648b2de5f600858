//! Micropolar shear layer.
//!
//! Source: O'Hare (2025), thesis, section 4.4; numbers of an independent implementation (tests/reference/README.md).
//!
//! ```text
//!        ---> ux = 20 mm, uy = 0
//!      +------+   y = 0.1 m
//!      |      |
//!      |::::::|   weak middle row: 0.9 times the yield strength
//!      |      |
//!      +------+   y = 0
//!        ux = uy = 0          plane strain; uy = 0 on all nodes; sides and all rotations free
//! ```
//!
//! Expected: after yield a band forms in the weak row whose width the plastic length sets, so that 9, 19 and 39 rows
//! give one curve of the base reaction, which agrees with the reference at every listed displacement; steps ten to
//! twenty times as large as those that follow the curve still converge, quadratically in the end.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::results::{Convergence, Table};
use std::sync::OnceLock;

/// Of the base reaction.
const REACTION: f64 = 0.002;
/// Of the largest equivalent plastic strain and of the largest rotation.
const CHI: f64 = 0.01;
/// Equivalent plastic strains below the first number are compared absolutely, within the second.
const SMALL_CHI: [f64; 2] = [1e-3, 1e-5];

/// History of one of the three grids; each is run once.
fn history(rows: usize) -> &'static Table {
    static HISTORIES: [OnceLock<Table>; 3] = [const { OnceLock::new() }; 3];
    let (place, config) = match rows {
        9 => (0, "shear_layer"),
        19 => (1, "shear_layer_19"),
        _ => (2, "shear_layer_39"),
    };
    HISTORIES[place].get_or_init(|| Launch::config(config).run().completed().history())
}

/// Value of a column where the displacement is nearest to one that is wanted; the steps meet those of the reference.
fn at(history: &Table, column: &str, displacement: f64) -> f64 {
    let displacements = history.column("displacement");
    let row = displacements.iter().position(|own| (own - displacement).abs() < 1e-9);
    history.column(column)[row.unwrap_or_else(|| panic!("no step ends at {displacement}"))]
}

fn agrees_with_reference(history: &Table, reference: &Reference) {
    let mut comparison = Comparison::new("shear layer");
    for point in reference.curve() {
        let displacement = number(point, "displacement");
        let reaction = -at(history, "base_reaction", displacement);
        let listed = number(point, "base_reaction_per_thickness");
        comparison.relative(&format!("reaction at {displacement:.4}"), reaction, listed, REACTION);
        let (chi, listed) = (at(history, "chi_max", displacement), number(point, "chi_max"));
        let tolerance = if listed > SMALL_CHI[0] {
            CHI * listed
        } else {
            SMALL_CHI[1]
        };
        comparison.within(&format!("chi_max at {displacement:.4}"), chi, listed, tolerance);
    }
    let peak = history.column("base_reaction").into_iter().fold(0.0, f64::min);
    comparison.relative("peak", -peak, reference.number("peak_reaction_per_thickness"), REACTION);
    // The layer turns clockwise.
    let rotation = -history.last("rotation_min");
    comparison.relative("rotation", rotation, reference.number("rotation_max_final"), CHI);
    comparison.finish();
}

#[test]
fn nine_rows_agree_with_the_reference() {
    agrees_with_reference(history(9), &Reference::read("shear_layer_9"));
}

#[test]
fn nineteen_rows_agree_with_the_reference() {
    agrees_with_reference(history(19), &Reference::read("shear_layer_19"));
}

#[test]
fn thirty_nine_rows_agree_with_the_reference() {
    agrees_with_reference(history(39), &Reference::read("shear_layer_39"));
}

/// The reaction differs between the grids by at most 1.5 % of its peak anywhere, 0.7 % between the finer two: a layer
/// whose band follows the cells loses half its strength from grid to grid.
#[test]
fn the_curve_does_not_depend_on_the_grid() {
    let peak = history(39)
        .column("base_reaction")
        .into_iter()
        .fold(0.0, f64::min)
        .abs();
    let mut comparison = Comparison::new("base reaction on three grids");
    for (row, displacement) in history(39).column("displacement").into_iter().enumerate().step_by(10) {
        let finest = history(39).column("base_reaction")[row];
        let (coarse, middle) = (
            history(9).column("base_reaction")[row],
            history(19).column("base_reaction")[row],
        );
        comparison.within(&format!("9 rows at {displacement:.4}"), coarse, finest, 0.015 * peak);
        comparison.within(&format!("19 rows at {displacement:.4}"), middle, finest, 0.007 * peak);
    }
    comparison.finish();
}

#[test]
fn ten_steps_take_at_most_nine_iterations_each() {
    let run = Launch::config("shear_layer_39_ten_steps").run().completed();
    let history = run.history();
    agrees_with_reference(&history, &Reference::read("shear_layer_39_ten_steps"));
    assert_eq!(history.rows.len(), 11, "ten steps, none of them halved");
    let iterations = history.column("newton_iterations");
    assert!(iterations.iter().all(|&count| count <= 9.0), "{iterations:?}");
    assert_eq!(run.summary().count("attempts"), 10);
}

/// The tangent is consistent: once the residual is below 1e-3 of the load, an iteration leaves at most 200 times its
/// square, down to round-off. (A tangent that is wrong by a percent leaves a percent of it.) The factor grows from about
/// 10 to 160 while the iteration comes close, so that two residuals in a row show an order of 1.5 to 2; that it stays
/// bounded from 1e-3 down to 1e-7 is what quadratic means.
#[test]
fn the_last_iterations_of_a_step_fall_quadratically() {
    const ASYMPTOTIC: f64 = 1e-3;
    const FACTOR: f64 = 200.0;
    const ROUND_OFF: f64 = 1e-12;
    let mut comparison = Comparison::new("residual after an iteration, at most 200 times the square of that before");
    // How far down the residuals are from which an iteration was held to the square.
    let (mut held, mut smallest) = (0, ASYMPTOTIC);
    for steps in [4, 5, 10] {
        let run = Launch::config("shear_layer_39_ten_steps")
            .set(&["solver.force_tolerance=1e-11", &format!("stages.0.steps={steps}")])
            .run();
        let convergence: Convergence = run.completed().convergence();
        let accepted: Vec<_> = convergence.accepted().collect();
        assert_eq!(accepted.len(), steps);
        for attempt in accepted {
            for pair in attempt.residuals.windows(2).filter(|pair| pair[0] < ASYMPTOTIC) {
                let bound = FACTOR * pair[0] * pair[0];
                if bound > ROUND_OFF {
                    held += 1;
                    smallest = pair[0].min(smallest);
                }
                let name = format!("step {} of {steps}, from {:.1e}", attempt.step, pair[0]);
                comparison.at_most(&name, pair[1], bound.max(ROUND_OFF));
            }
        }
    }
    comparison.finish();
    assert!(held >= 25 && smallest < 2e-7, "{held} iterations, from {smallest:e}");
}
