//! Classical shear layer.
//!
//! Source: O'Hare (2025), thesis, section 2.4; numbers of an independent implementation (tests/reference/README.md).
//!
//! ```text
//!        ---> ux = 20 mm, uy = 0
//!      +------+   y = 0.1 m
//!      |      |
//!      |::::::|   weak middle row: 0.9 times the yield strength
//!      |      |
//!      +------+   y = 0
//!        ux = uy = 0          plane strain; uy = 0 on all nodes; sides free
//! ```
//!
//! Expected: all shear after the peak gathers in the weak row, so that the softening is set by the size of the cells: on 9,
//! 19 and 39 rows the peak comes earlier and less and less is left of it.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::results::Table;
use std::sync::OnceLock;

/// Of the base reaction up to the peak, and beyond it.
const REACTION: [f64; 2] = [0.005, 0.03];
/// Of the largest multiplier.
const CHI: f64 = 0.01;
/// Multipliers below this are compared absolutely.
const SMALL_CHI: f64 = 1e-3;

/// History of one of the three grids; each is run once.
fn history(rows: usize) -> &'static Table {
    static HISTORIES: [OnceLock<Table>; 3] = [const { OnceLock::new() }; 3];
    let (place, config) = match rows {
        9 => (0, "classical_shear_layer"),
        19 => (1, "classical_shear_layer_19"),
        _ => (2, "classical_shear_layer_39"),
    };
    HISTORIES[place].get_or_init(|| Launch::config(config).run().completed().history())
}

fn reference(rows: usize) -> Reference {
    Reference::read("shear_layer_classical").part(&rows.to_string())
}

/// Value of a column at a displacement, between two steps by interpolation: after a failed step they need not meet those
/// of the reference.
fn at(history: &Table, column: &str, displacement: f64) -> f64 {
    let (displacements, values) = (history.column("displacement"), history.column(column));
    let after = displacements.iter().position(|own| *own >= displacement - 1e-12);
    let after = after.unwrap_or_else(|| panic!("no step reaches {displacement}"));
    let before = after.max(1) - 1;
    let length = displacements[after] - displacements[before];
    let share = if length > 0.0 {
        (displacement - displacements[before]) / length
    } else {
        1.0
    };
    values[before] + share * (values[after] - values[before])
}

fn agrees_with_reference(rows: usize) {
    let (history, reference) = (history(rows), reference(rows));
    let mut comparison = Comparison::new(&format!("classical shear layer on {rows} rows"));
    for point in reference.curve() {
        let displacement = number(point, "u");
        let beyond = displacement > reference.number("peak_at_u") + 1e-9;
        let name = format!("reaction at {displacement:.4}");
        let reaction = -at(history, "base_reaction", displacement);
        comparison.relative(&name, reaction, number(point, "base"), REACTION[usize::from(beyond)]);
    }
    let peak = -history.column("base_reaction").into_iter().fold(0.0, f64::min);
    comparison.relative(
        "peak",
        peak,
        reference.number("peak_reaction_per_thickness"),
        REACTION[0],
    );
    let at_peak = -at(history, "base_reaction", reference.number("peak_at_u"));
    comparison.relative("where the peak is listed", at_peak, peak, 1e-3);
    comparison.finish();
}

#[test]
fn nine_rows_agree_with_the_reference() {
    agrees_with_reference(9);
}

#[test]
fn nineteen_rows_agree_with_the_reference() {
    agrees_with_reference(19);
}

#[test]
fn thirty_nine_rows_agree_with_the_reference() {
    agrees_with_reference(39);
}

#[test]
fn the_largest_multiplier_agrees_on_nine_rows() {
    let mut comparison = Comparison::new("largest multiplier on nine rows");
    for point in reference(9).curve() {
        let displacement = number(point, "u");
        let listed = number(point, "epmax");
        let chi = at(history(9), "chi_max", displacement);
        let tolerance = CHI * listed.max(SMALL_CHI);
        comparison.within(&format!("chi_max at {displacement:.4}"), chi, listed, tolerance);
    }
    comparison.finish();
}

/// What is left of the peak at the end falls by a fifth and by a third of itself from grid to grid; the micropolar layer
/// keeps its curve.
#[test]
fn the_softening_depends_on_the_grid() {
    let left = [9, 19, 39].map(|rows| {
        let reactions = history(rows).column("base_reaction");
        let peak = reactions.iter().copied().fold(0.0, f64::min);
        reactions[reactions.len() - 1] / peak
    });
    println!("share of the peak that is left: {left:.3?}");
    assert!(
        left[0] > 0.75 && left[1] < 0.8 * left[0] && left[2] < 0.67 * left[1],
        "{left:?}"
    );
}
