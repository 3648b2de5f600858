//! Plane-strain biaxial test.
//!
//! Source: O'Hare (2025), thesis, section 4.5.1; numbers of an independent implementation (tests/reference/README.md).
//!
//! ```text
//!         uy = -10 mm, ux = 0
//!      +---------+   y = 50 mm       a quarter of a block of dilatant soil between rough platens;
//!      |        /|                   the grid is stretched with the platen after each step
//!   ux |      // |
//!  = 0 |    //   | free
//!      |  //     |
//!      +---------+   y = 0, x from 0 to 25 mm
//!         uy = 0
//! ```
//!
//! Expected: stress, largest equivalent plastic strain and largest rotation follow those of the reference.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;

/// Height and width of the quarter [m].
const HEIGHT: f64 = 0.05;
const WIDTH: f64 = 0.025;
/// Of the stress; of the largest equivalent plastic strain and rotation.
const STRESS: f64 = 0.005;
const CHI: f64 = 0.02;
/// Equivalent plastic strains below this are compared absolutely.
const SMALL_CHI: f64 = 1e-2;

fn agrees_with_reference(config: &str) {
    let history = Launch::config(config).run().completed().history();
    let reference = Reference::read(config);
    let strains = history.column("shortening").into_iter().map(|motion| -motion / HEIGHT);
    let strains: Vec<f64> = strains.collect();
    let (forces, chi) = (history.column("force"), history.column("chi_max"));
    let mut comparison = Comparison::new(config);
    for point in reference.curve() {
        let strain = number(point, "strain");
        let row = strains.iter().position(|own| (own - strain).abs() < 1e-9);
        let row = row.unwrap_or_else(|| panic!("no step ends at a strain of {strain}"));
        let (stress, listed) = (-forces[row] / WIDTH, number(point, "stress"));
        comparison.relative(&format!("stress at {strain:.4}"), stress, listed, STRESS);
        let listed = number(point, "chimax");
        let tolerance = CHI * listed.max(SMALL_CHI);
        comparison.within(&format!("chi_max at {strain:.4}"), chi[row], listed, tolerance);
    }
    let largest = forces.iter().fold(0.0f64, |largest, force| largest.max(-force / WIDTH));
    comparison.relative("peak", largest, reference.number("peak_stress"), STRESS);
    let rotation = history.last("rotation_max").max(-history.last("rotation_min"));
    comparison.relative("rotation", rotation, reference.number("phi3_absmax"), CHI);
    comparison.finish();
}

#[test]
fn cells_of_five_millimetres_agree_with_the_reference() {
    agrees_with_reference("biaxial_5mm");
}

#[test]
fn cells_of_a_quarter_of_that_agree_with_the_reference() {
    agrees_with_reference("biaxial_1.25mm");
}
