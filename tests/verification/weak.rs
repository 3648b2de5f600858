//! Conditions on points and pressure on surfaces.
//!
//! Source: closed forms, in the heads of the tests.
//!
//! ```text
//!     v v v  platen on points, k     p  -> |::::| <- p
//!     |: : |                         p  -> |::::| <- p
//!     |: : |  rows of cells                 ^^^^
//!     #######                                p
//! ```
//!
//! Expected: a chain of springs to round-off; a uniform stress of -p to round-off on bodies of any shape whose points
//! fill their domains; no force on a platen in the direction in which it is free.

use crate::common::compare::{Comparison, same_history};
use crate::common::launch::{Launch, Run};
use crate::common::results::Table;

const MU: f64 = 6.0e6;
/// Displacement of the platen: so small that the bar is linear within 1e-4.
const TOTAL: f64 = -1.0e-6;
const PENALTY: f64 = 1.0e8;
const STEPS: usize = 4;

/// A bar of four cells with lambda = 0, one cell wide, between smooth walls.
fn bar(condition: &str) -> Run {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain, continuum: classical}}
grid: {{min: [0.0, 0.0], max: [0.01, 0.05], cell_size: 0.01, basis: linear}}
materials:
  rubber: {{law: elastic, lame_lambda: 0.0, shear_modulus: {MU:?}}}
bodies:
  - {{name: bar, material: rubber, shape: {{box: {{min: [0.0, 0.0], max: [0.01, 0.04]}}}}, points_per_cell: 2}}
boundary:
  - {{face: x_min, fix: [ux]}}
  - {{face: x_max, fix: [ux]}}
  - {{face: y_min, fix: [uy], name: base}}
  - {{selection: {{layer: {{body: bar, face: y_max}}}}, name: top, penalty: {PENALTY:?}, move: {{uy: {TOTAL:?}}}, {condition}}}
stages: [{{name: push, steps: {STEPS}}}]
output:
  history:
    - {{name: base, reaction: {{boundary: base, component: uy}}}}
    - {{name: top, reaction: {{boundary: top, component: uy}}}}
    - {{name: motion, boundary_motion: {{boundary: top, component: uy}}}}
    - {{name: end, mean: displacement, at: {{layer: {{body: bar, face: y_max}}}}}}
"
    ))
    .run()
    .completed()
}

/// Stiffness of the bar at its upper row of points [N/m]: a cell is a spring of `k = 2 mu A / h`. The row lies at 3/4 of
/// the fourth cell, which therefore carries 3/4 of the force, and moves by `3 R/k + 3/4 (3/4 R)/k`.
fn bar_stiffness() -> f64 {
    2.0 * MU / (3.0 + 0.75 * 0.75)
}

/// The two springs of the row stand behind the bar in one line.
#[test]
fn a_bar_against_springs() {
    let history = bar("penalise: total").history();
    let mut comparison = Comparison::new("bar pushed by a penalty");
    let force = TOTAL / (1.0 / bar_stiffness() + 1.0 / (2.0 * PENALTY));
    comparison.relative("top", history.last("top"), force, 1e-4);
    comparison.relative("base", history.last("base"), -force, 1e-4);
    comparison.relative("end", history.last("end_y"), force / bar_stiffness(), 1e-4);
    comparison.relative("motion", history.last("motion"), TOTAL, 1e-14);
    comparison.finish();
}

/// Springs that forget: in every step they hold the whole force `K u` by the slip of that step alone, so that
/// `K u = 2 k (v - (u - u_before))`.
#[test]
fn springs_that_forget() {
    let history = bar("penalise: increment").history();
    let mut end = 0.0;
    for _ in 0..STEPS {
        end = 2.0 * PENALTY * (TOTAL / STEPS as f64 + end) / (bar_stiffness() + 2.0 * PENALTY);
    }
    let mut comparison = Comparison::new("bar pushed by a penalty on increments");
    comparison.relative("end", history.last("end_y"), end, 1e-4);
    comparison.relative("top", history.last("top"), bar_stiffness() * end, 1e-4);
    comparison.finish();
    let total = TOTAL / (1.0 / bar_stiffness() + 1.0 / (2.0 * PENALTY));
    assert!(
        (history.last("top") / total - 1.0).abs() > 0.01,
        "the two kinds of penalty cannot be told apart"
    );
}

const RUBBER: &str = "{law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}";

/// A body in the middle of a grid of edge 0.08 under pressure on its whole surface, held on planes of symmetry.
fn under_pressure(space: bool, basis: &str, shape: &str, stages: &str) -> Run {
    let axes = if space { &["x", "y", "z"][..] } else { &["x", "y"][..] };
    let held: String = axes
        .iter()
        .map(|axis| format!("  - {{face: {{axis: {axis}, at: 0.04}}, fix: [u{axis}], name: {axis}}}\n"))
        .collect();
    let columns: String = axes
        .iter()
        .map(|axis| format!("    - {{name: support_{axis}, reaction: {{boundary: {axis}, component: u{axis}}}}}\n"))
        .collect();
    let kinematics = if space { "three_dimensional" } else { "plane_strain" };
    let size = vec![0.08; axes.len()];
    let zero = vec![0.0; axes.len()];
    Launch::text(&format!(
        "
model: {{kinematics: {kinematics}}}
grid: {{min: {zero:?}, max: {size:?}, cell_size: 0.01, basis: {basis}}}
materials:
  rubber: {RUBBER}
bodies:
  - {{name: block, material: rubber, shape: {shape}, points_per_cell: 2}}
boundary:
{held}loads:
  - {{pressure: 1.0e6, at: {{surface: {{body: block}}}}}}
stages: [{stages}]
output:
  history:
{columns}    - {{name: most, max: stress}}
    - {{name: least, min: stress}}
    - {{name: volume, mean: volume}}
"
    ))
    .run()
    .completed()
}

fn uniform_stress(run: &Run, axes: &[&str]) {
    const PRESSURE: f64 = 1.0e6;
    let history = run.history();
    let mut comparison = Comparison::new("body under pressure");
    for row in ["x", "y", "z"].into_iter().filter(|row| axes.contains(row)) {
        comparison.within(
            &format!("support {row}"),
            history.last(&format!("support_{row}")),
            0.0,
            1e-6,
        );
        for column in axes {
            let expected = if row == *column { -PRESSURE } else { 0.0 };
            for bound in ["most", "least"] {
                let title = format!("{bound}_{row}{column}");
                comparison.within(&title, history.last(&title), expected, 1e-8 * PRESSURE);
            }
        }
    }
    comparison.finish();
}

/// In one step from a lattice the forces of the sides are the exact integrals of the hats: the patch test holds.
#[test]
fn a_square_under_pressure() {
    let square = "{box: {min: [0.02, 0.02], max: [0.06, 0.06]}}";
    for basis in ["linear", "gimp"] {
        uniform_stress(
            &under_pressure(false, basis, square, "{name: squeeze, steps: 1}"),
            &["x", "y"],
        );
    }
}

/// The surface of the domains has steps, but the pressure on them is that of a uniform stress.
#[test]
fn a_disc_under_pressure() {
    let disc = "{ball: {centre: [0.04, 0.04], radius: 0.021}}";
    uniform_stress(
        &under_pressure(false, "gimp", disc, "{name: squeeze, steps: 1}"),
        &["x", "y"],
    );
}

#[test]
fn a_cube_under_pressure() {
    let cube = "{box: {min: [0.03, 0.03, 0.03], max: [0.05, 0.05, 0.05]}}";
    let run = under_pressure(true, "gimp", cube, "{name: squeeze, steps: 1}");
    uniform_stress(&run, &["x", "y", "z"]);
}

/// A pressure ramps over its stage and stays.
#[test]
fn a_pressure_holds_after_its_stage() {
    let square = "{box: {min: [0.02, 0.02], max: [0.06, 0.06]}}";
    let stages = "{name: squeeze, steps: 2}, {name: hold, steps: 2}";
    let history = under_pressure(false, "gimp", square, stages).history();
    let volume = history.column("volume");
    let change = |row: usize| volume[row] / volume[0] - 1.0;
    assert!((change(1) / change(2) - 0.5).abs() < 0.05, "{volume:?}");
    assert!((change(4) / change(2) - 1.0).abs() < 0.01, "{volume:?}");
}

/// A block between a rough base and a platen, confined at its sides, pushed aside at a corner; the platen's uy is held
/// in the first stage and moves in the second, by another condition on the same points.
fn block(sliding: &str, stages: &str) -> Launch {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [0.08, 0.05], cell_size: 0.01, basis: gimp}}
materials:
  rubber: {RUBBER}
bodies:
  - {{name: block, material: rubber, shape: {{box: {{min: [0.02, 0.0], max: [0.05, 0.04]}}}}, points_per_cell: 3}}
boundary:
  - {{face: y_min, fix: [ux, uy], name: base}}
  - {{selection: {{layer: {{body: block, face: y_max}}}}, name: held, penalty: 1.0e9, {sliding}}}
  - {{selection: {{layer: {{body: block, face: y_max}}}}, name: platen, penalty: 1.0e9, {sliding}, move: {{uy: -0.004}}, stage: push}}
loads:
  - {{name: nudge, force: [1.0e3, 0.0], at: {{nearest: [0.05, 0.04]}}}}
  - {{name: cell, pressure: 2.0e5, at: {{surface: {{body: block, facing: [x_min, x_max]}}}}}}
stages: {stages}
solver: {{force_tolerance: 1.0e-11}}
output:
  history:
    - {{name: base_x, reaction: {{boundary: base, component: ux}}}}
    - {{name: base_y, reaction: {{boundary: base, component: uy}}}}
    - {{name: held_x, reaction: {{boundary: held, component: ux}}}}
    - {{name: held_y, reaction: {{boundary: held, component: uy}}}}
    - {{name: platen_x, reaction: {{boundary: platen, component: ux}}}}
    - {{name: platen_y, reaction: {{boundary: platen, component: uy}}}}
    - {{name: most, max: displacement, at: {{layer: {{body: block, face: y_max}}}}}}
    - {{name: least, min: displacement, at: {{layer: {{body: block, face: y_max}}}}}}
    - {{name: confined, mean: displacement, at: {{load: cell}}}}
"
    ))
}

const EQUAL: &str = "[{name: confine, steps: 4}, {name: push, steps: 10}]";

#[test]
fn a_free_platen_takes_no_force_and_moves_as_one() {
    let history = block("rigid: {free: [ux]}", EQUAL).run().completed().history();
    let mut comparison = Comparison::new("block under a platen that slides");
    let [base, platen] = history.last_of(["base_y", "platen_y"]);
    comparison.within("force along the platen", history.last("platen_x"), 0.0, 1e-5);
    comparison.relative("force across it", platen, -base, 2e-3);
    comparison.within("condition that was replaced", history.last("held_y"), 0.0, 0.0);
    let [most, least] = ["most", "least"].map(|name| {
        history.last_of(
            ["x", "y"]
                .map(|k| format!("{name}_{k}"))
                .each_ref()
                .map(|name| name.as_str()),
        )
    });
    // Springs of 1e9 N/m under some 1e3 N each.
    comparison.within("spread along", most[0], least[0], 1e-5);
    comparison.within("spread across", most[1], -0.004, 2e-5);
    comparison.within("spread across", least[1], -0.004, 2e-5);
    comparison.finish();
    assert!(most[0] > 1e-4, "the platen does not slide: {most:?}");
    // The other condition takes the force over: no step of the history jumps back towards zero.
    let force: Vec<f64> = history
        .column("held_y")
        .iter()
        .zip(history.column("platen_y"))
        .map(|(a, b)| a + b)
        .collect();
    let growth = (force[5] - force[4]).abs();
    assert!(growth < 2.0 * (force[6] - force[5]).abs(), "{force:?}");
}

/// Nothing but the support takes a force on a point that a fixed platen holds; base and platen share all of it.
#[test]
fn a_fixed_platen_takes_the_force() {
    let history = block("rigid: {}", EQUAL).run().completed().history();
    let mut comparison = Comparison::new("block under a fixed platen");
    let [base, held] = ["base_x", "held_x"].map(|name| history.column(name)[4]);
    comparison.relative("both", base + held, -1.0e3, 1e-4);
    comparison.relative("platen", held, -1.0e3, 0.01);
    comparison.finish();
}

/// A history without the columns that hold nothing but noise.
fn without_zero_forces(run: &Run) -> Table {
    let mut table = run.history();
    for name in ["held_x", "platen_x"] {
        let place = table
            .columns
            .iter()
            .position(|column| column == name)
            .expect("the column");
        table.columns.remove(place);
        table.rows.iter_mut().for_each(|row| drop(row.remove(place)));
    }
    table
}

#[test]
fn ranks_agree_on_platens_and_pressures() {
    let adaptive = "[{name: confine, steps: 4}, {name: push, steps: 10, adaptive: {max_step: 0.4}}]";
    let alone = block("rigid: {free: [ux]}", adaptive).run().completed();
    for ranks in [2, 3] {
        let together = block("rigid: {free: [ux]}", adaptive).ranks(ranks).run().completed();
        same_history(
            "platen",
            &without_zero_forces(&together),
            &without_zero_forces(&alone),
            1e-8,
        );
        assert_eq!(
            together.history().column("step_size"),
            alone.history().column("step_size")
        );
    }
}

/// Steps grow past the equal size and come to the same end.
#[test]
fn adaptive_steps_come_to_the_same_end() {
    let adaptive =
        "[{name: confine, steps: 4}, {name: push, steps: 40, adaptive: {max_step: 0.1, target_iterations: 8}}]";
    let equal = "[{name: confine, steps: 4}, {name: push, steps: 40}]";
    let [adaptive, equal] =
        [adaptive, equal].map(|stages| block("rigid: {free: [ux]}", stages).run().completed().history());
    let sizes = adaptive.column("step_size");
    let largest = sizes[5..].iter().fold(0.0f64, |largest, size| largest.max(*size));
    assert!(largest > 2.0 / 40.0 && largest <= 0.1 + 1e-12, "{sizes:?}");
    assert!(adaptive.rows.len() < 25, "{} steps", adaptive.rows.len());
    assert_eq!(adaptive.last("load_factor"), 1.0);
    let [few, many] = [&adaptive, &equal].map(|history| history.last("platen_y"));
    assert!((few / many - 1.0).abs() < 0.02, "{few} and {many}");
}

/// Where a step takes more iterations than wanted the next one is shorter.
#[test]
fn adaptive_steps_shrink_where_it_is_hard() {
    let stages =
        "[{name: confine, steps: 4}, {name: push, steps: 4, adaptive: {max_step: 0.25, target_iterations: 2}}]";
    let history = block("rigid: {free: [ux]}", stages).run().completed().history();
    let (sizes, iterations) = (history.column("step_size"), history.column("newton_iterations"));
    let step = (5..sizes.len() - 2)
        .find(|&step| iterations[step] > 2.0)
        .expect("a step that is hard");
    assert!(sizes[step + 1] < 0.9 * sizes[step], "{sizes:?} {iterations:?}");
    assert_eq!(history.last("load_factor"), 1.0);
}

/// A second platen that slides takes over from a first one, of which nothing is left among the unknowns: the end is that of
/// one platen alone.
#[test]
fn a_sliding_platen_takes_over_from_another() {
    let pressed = |platens: &str, stages: &str| {
        let run = Launch::text(&format!(
            "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [0.03, 0.04], cell_size: 0.01, basis: bspline2}}
materials:
  rubber: {{law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: block, material: rubber, shape: {{box: {{min: [0.0, 0.0], max: [0.02, 0.04]}}}}, points_per_cell: 2}}
boundary:
  - {{face: y_min, fix: [ux, uy], name: base}}
{platens}
stages: [{stages}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: base, reaction: {{boundary: base, component: uy}}}}
    - {{name: end, mean: displacement, at: {{layer: {{body: block, face: y_max}}}}}}
"
        ));
        run.run().completed().history()
    };
    let platen = |keys: &str| {
        format!(
            "  - {{selection: {{layer: {{body: block, face: y_max}}}}, rigid: {{free: [ux]}}, penalty: 1.0e9, {keys}}}\n"
        )
    };
    let moved = platen("move: {uy: -2.0e-4}, stage: press");
    let rest = platen("fix: [uy]");
    let together = pressed(&(rest + &moved), "{name: rest, steps: 1}, {name: press, steps: 2}");
    let alone = pressed(&moved, "{name: press, steps: 2}");
    let mut comparison = Comparison::new("one platen after another");
    for name in ["base", "end_y"] {
        comparison.relative(name, together.last(name), alone.last(name), 1e-9);
    }
    comparison.within("end_x", together.last("end_x"), alone.last("end_x"), 1e-13);
    comparison.finish();
    assert!(alone.last("base") > 1e3, "{}", alone.last("base"));
}
