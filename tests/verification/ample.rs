//! The three problems of AMPLE.
//!
//! Source: output of AMPLE, an open implicit GIMPM code for the classical continuum (tests/reference/README.md), which
//! this program repeats with the same points and steps.
//!
//! ```text
//!   |. .| 50 m, on rollers     O=============| 100 kN      |::::::|      8 x 8 m, half,
//!   |. .| weight in 40 steps     10 x 1 m    v             |::::::|      weight in 40 steps
//!   #####                                                  ########----  frictionless
//!   column                     cantilever                  collapse
//! ```
//!
//! Expected: the column's stresses are wrong against the closed form by what the method leaves, the same as there; the
//! points of the cantilever and of the collapsing block come to lie where they do there.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::{Launch, Run};
use crate::common::snapshots::Snapshots;

const HEIGHT: f64 = 50.0;
/// Density by gravity [N/m3].
const WEIGHT: f64 = 800.0;

fn column(cells: f64, youngs_modulus: f64, steps: f64) -> Run {
    let width = HEIGHT / cells;
    Launch::config("column_self_weight")
        .set(&[
            &format!("grid.cells=[1, {cells}]"),
            &format!("grid.max=[{width:?}, {HEIGHT:?}]"),
            &format!("bodies.0.shape.box.max=[{width:?}, {HEIGHT:?}]"),
            &format!("materials.soft.youngs_modulus={youngs_modulus:?}"),
            &format!("stages.0.steps={steps}"),
        ])
        .run()
        .completed()
}

/// Mean over the points, which have one volume, of the difference from the closed form, over the largest stress.
fn stress_error(run: &Run) -> f64 {
    let snapshots = Snapshots::read(&run.file("points.vtkhdf"));
    let stresses = snapshots.field::<9>("stress", snapshots.times.len() - 1);
    let heights = snapshots.positions(0).into_iter().map(|[_, y, _]| y);
    let errors = heights
        .zip(stresses)
        .map(|(height, stress)| (stress[4] + WEIGHT * (HEIGHT - height)).abs());
    errors.sum::<f64>() / (WEIGHT * HEIGHT * snapshots.points as f64)
}

#[test]
fn the_column_has_the_errors_of_ample() {
    let mut comparison = Comparison::new("column under its own weight");
    for case in Reference::read("column_self_weight").curve() {
        let [cells, youngs_modulus, steps] = ["cells", "youngs_modulus", "steps"].map(|key| number(case, key));
        let run = column(cells, youngs_modulus, steps);
        let name = |what: &str| format!("{what}, {cells} cells, E {youngs_modulus:.0e}");
        comparison.relative(&name("error"), stress_error(&run), number(case, "error"), 0.01);
        let [highest, stress] = run.history().last_of(["highest_y", "stress_min_yy"]);
        comparison.relative(&name("highest"), highest, number(case, "highest"), 1e-6);
        comparison.relative(&name("stress"), stress, number(case, "stress_min"), 1e-6);
    }
    comparison.finish();
}

/// Displacement of the loaded points over the length at a load factor.
fn tip(run: &Run, factor: f64) -> [f64; 2] {
    let history = run.history();
    let row = history
        .column("factor")
        .iter()
        .position(|own| (own - factor).abs() < 1e-9);
    let row = row.unwrap_or_else(|| panic!("no step ends at {factor}"));
    ["tip_x", "tip_y"].map(|name| history.column(name)[row] / 10.0)
}

#[test]
fn the_elastic_cantilever_bends_as_in_ample() {
    let run = Launch::config("elastic_cantilever").run().completed();
    let reference = Reference::read("elastic_cantilever");
    let mut comparison = Comparison::new("elastic cantilever");
    for point in reference.curve() {
        let (factor, listed) = (number(point, "load_factor"), ["ux", "uy"].map(|key| number(point, key)));
        let [x, y] = tip(&run, factor);
        let tolerance = 0.005 * f64::hypot(listed[0], listed[1]);
        comparison.within(&format!("ux at {factor}"), x, listed[0], tolerance);
        comparison.within(&format!("uy at {factor}"), y, listed[1], tolerance);
    }
    let analytical = reference.part("analytical");
    let [x, y] = tip(&run, 1.0);
    comparison.relative("ux, analytical", x, analytical.number("ux"), 0.02);
    comparison.relative("uy, analytical", y, analytical.number("uy"), 0.02);
    comparison.finish();
}

/// With 4 x 4 points AMPLE, which has no stabilisation, loses convergence after about ten of the 50 steps. The ghost
/// penalty carries the beam through; it stiffens the beam by less than a percent.
#[test]
fn few_points_survive_with_a_ghost_penalty() {
    let run = Launch::config("elastic_cantilever")
        .set(&["bodies.0.points_per_cell=4", "stabilisation.ghost={translation: 1.2e6}"])
        .run()
        .completed();
    let mut comparison = Comparison::new("elastic cantilever with 4 x 4 points a cell");
    let reference = Reference::read("elastic_cantilever");
    let last = reference.curve().last().expect("a curve has points");
    let [x, y] = tip(&run, 1.0);
    comparison.relative("ux", x, number(last, "ux"), 0.01);
    comparison.relative("uy", y, number(last, "uy"), 0.01);
    comparison.finish();
    assert_eq!(run.summary().count("attempts"), 50, "every step succeeds at once");
}

#[test]
fn the_block_collapses_as_in_ample() {
    let run = Launch::config("elastoplastic_collapse").run().completed();
    let history = run.history();
    let mut comparison = Comparison::new("elastoplastic collapse");
    for point in Reference::read("elastoplastic_collapse").curve() {
        let step = number(point, "step") as usize;
        let at = |name: &str| history.column(name)[step];
        comparison.relative(
            &format!("largest x, step {step}"),
            at("front_x"),
            number(point, "largest_x"),
            0.005,
        );
        comparison.relative(
            &format!("largest y, step {step}"),
            at("front_y"),
            number(point, "largest_y"),
            0.005,
        );
        if let Some(stress) = point["stress_min"].as_f64() {
            comparison.relative(&format!("stress, step {step}"), at("stress_min_yy"), stress, 0.005);
        }
    }
    comparison.finish();
    // The floor carries the weight; domains that stick out of the grid lose a little of it.
    let [floor] = history.last_of(["floor_reaction"]);
    assert!((floor / 640.0e3 - 1.0).abs() < 1e-3, "{floor}");
}
