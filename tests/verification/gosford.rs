//! Gosford sandstone in plane-strain compression.
//!
//! Source: Neuner et al. (2024), section 3.2; finite elements with the same law (tests/reference/README.md).
//!
//! ```text
//!        platen, free along x: uy = -0.7 mm
//!        +-------+ -> 10 N
//!   ---> |       | <---
//!   ---> |       | <---    pressure of 20 MPa
//!   ---> |       | <---
//!        +-------+
//!          fixed           40 x 80 mm
//! ```
//!
//! Expected: the force follows that of finite elements up to the peak within 2 % of it, here on cells of 2 mm with B-splines
//! of order 2; the shear band begins behind it. docs/verification.md has finer grids and what comes after.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;

/// Largest difference of forces, over that of the peak.
const FORCE: f64 = 0.02;
/// A shortening before and one after every peak of the study [m].
const PEAK: [f64; 2] = [0.6e-3, 0.72e-3];

fn interpolate(places: &[f64], values: &[f64], place: f64) -> f64 {
    let after = places
        .iter()
        .position(|&other| other >= place)
        .expect("within the curve");
    let share = (place - places[after - 1]) / (places[after] - places[after - 1]);
    values[after - 1] + share * (values[after] - values[after - 1])
}

#[test]
fn the_force_rises_to_the_peak_of_finite_elements() {
    let history = Launch::config("gosford_plane_strain")
        .set(&[
            "grid.cells=[30, 40]",
            "boundary.2.move.uy=-0.75e-3",
            "stages.1.steps=15",
            "stages.1.adaptive.max_step=0.06666667",
        ])
        .run()
        .completed()
        .history();
    let reference = Reference::read("gosford_plane_strain");
    let peak = reference.part("peak");
    // The state after confinement, at which the platen has not moved, stands twice.
    let shortening: Vec<f64> = history.column("shortening")[1..].iter().map(|motion| -motion).collect();
    let force: Vec<f64> = history.column("reaction")[1..].iter().map(|force| -force).collect();
    let mut comparison = Comparison::new("Gosford sandstone, cells of 2 mm");
    for point in reference.curve() {
        let place = number(point, "shortening");
        let name = format!("force at {:.2} mm", 1e3 * place);
        let allowed = FORCE * peak.number("force");
        comparison.within(
            &name,
            interpolate(&shortening, &force, place),
            number(point, "force"),
            allowed,
        );
    }
    let largest = (0..force.len())
        .max_by(|&a, &b| force[a].total_cmp(&force[b]))
        .expect("steps");
    comparison.relative("peak", force[largest], peak.number("force"), FORCE);
    let [before, after] = PEAK;
    let middle = 0.5 * (before + after);
    comparison.within(
        "shortening at the peak",
        shortening[largest],
        middle,
        0.5 * (after - before),
    );
    comparison.finish();
    assert!(
        force[force.len() - 1] < force[largest],
        "the force falls behind its peak"
    );
    assert!(history.last("damage_max") > 0.04, "{}", history.last("damage_max"));
}
