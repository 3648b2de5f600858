//! Equilibrium paths beyond a limit point: `control: {arc_length: ..}`.
//!
//! Source: a closed form; the same scene driven by a prescribed displacement; numbers of an independent implementation
//! (tests/reference/README.md).
//!
//! ```text
//!     ^ ^ ^  force                  | force, or a spring whose end is moved
//!     |---|                         v
//!     |   |  one element         .--*--.
//!     #####                     #       #  half of a clamped arch
//! ```
//!
//! Expected: a bar with `P = M ln(s) / s` (Hencky elasticity, sides held, stretch `s`) carries at most `M / e`, at `s = e`;
//! every state of the path is on the curve to the tolerance. A shallow elastic arch snaps through: its load falls to half
//! of the first maximum and rises beyond it again; prescribing the displacement of the loaded point leads to the same
//! states, to 1e-6 of the maximum. The residual of every iteration is below a multiple of the square of that before it.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::{Launch, Run};
use crate::common::results::Table;

const BAR_FORCE: f64 = 4.0e6;
const BAR_MODULUS: f64 = 8.0e6;

fn bar(control: &str) -> Run {
    let stages = format!("{{name: pull, steps: 20, control: {{arc_length: {{{control}}}}}}}");
    pulled_bar(&format!("  - {stages}"), "")
}

fn pulled_bar(stages: &str, loads: &str) -> Run {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain, continuum: classical, method: fem}}
materials:
  rubber: {{law: elastic, lame_lambda: 2.0e6, shear_modulus: 3.0e6}}
bodies:
  - {{name: bar, material: rubber, mesh: {{box: {{min: [0.0, 0.0], max: [1.0, 1.0]}}, cells: [1, 1]}}}}
boundary:
  - {{face: y_min, fix: [uy], name: base}}
  - {{face: all, fix: [ux]}}
loads:
  - {{name: pull, force: [0.0, {BAR_FORCE:?}], at: {{face: y_max}}, stage: pull}}
{loads}
stages:
{stages}
output:
  history:
    - {{name: load, load_factor: pull}}
    - {{name: top, mean: displacement, at: {{face: y_max}}}}
    - {{name: base, reaction: {{boundary: base, component: uy}}}}
"
    ))
    .run()
    .completed()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_bar_beyond_its_largest_load() {
    let run = bar("max_length: 0.2, max_steps: 200, until: {displacement: 5.0}");
    let history = run.history();
    let peak = BAR_MODULUS / std::f64::consts::E;
    let mut comparison = Comparison::new("bar beyond its largest load");
    let (loads, tops, bases) = (history.column("load"), history.column("top_y"), history.column("base"));
    for (load, (top, base)) in loads.iter().zip(tops.iter().zip(&bases)) {
        let force = BAR_MODULUS * (1.0 + top).ln() / (1.0 + top);
        comparison.within(&format!("force at {top:.3} m"), BAR_FORCE * load, force, 1e-8 * peak);
        comparison.within("reaction", *base, -BAR_FORCE * load, 1e-8 * peak);
    }
    comparison.within("largest force", BAR_FORCE * largest(&loads), peak, 2e-3 * peak);
    comparison.at_most(
        "last force over the largest",
        BAR_FORCE * history.last("load") / peak,
        0.7,
    );
    comparison.finish();
    assert_eq!(history.column("load_factor"), loads);
    assert!(
        run.stdout.contains("the displacement of until is reached"),
        "{}",
        run.stdout
    );
}

/// Loads of an earlier stage hold while the path is followed; its first step goes towards more load although the bar moved
/// the other way before.
#[test]
fn a_bar_that_was_compressed_before() {
    let held = -0.1 * BAR_FORCE;
    let stages = "  - {name: press, steps: 4}
  - {name: pull, steps: 20, control: {arc_length: {length: 0.1, max_steps: 40}}}";
    let loads = format!("  - {{force: [0.0, {held:?}], at: {{face: y_max}}, stage: press}}");
    let history = pulled_bar(stages, &loads).history();
    let mut comparison = Comparison::new("bar that was compressed before");
    let rows = history.column("load").into_iter().zip(history.column("top_y"));
    for (load, top) in rows.skip(5) {
        let force = BAR_MODULUS * (1.0 + top).ln() / (1.0 + top);
        let title = format!("force at {top:.3} m");
        comparison.within(&title, held + BAR_FORCE * load, force, 1e-8 * BAR_FORCE);
    }
    comparison.finish();
    let tops = history.column("top_y");
    assert!(
        tops[4] < -0.04 && tops[5] > tops[4] && history.last("top_y") > 2.0,
        "{tops:?}"
    );
}

/// Before the limit point the path meets the full load exactly, and ends there.
#[test]
fn a_path_ends_at_full_load() {
    let run = bar("length: 0.12, max_steps: 50");
    let short = run.history();
    assert!(largest(&short.column("load_factor")) < 0.75 && short.rows.len() == 51);
    let run = Launch::text(&std::fs::read_to_string(run.file("config.yaml")).expect("the configuration of the run"))
        .set(&["loads.0.force=[0.0, 2.0e6]"])
        .run()
        .completed();
    assert_eq!(run.history().last("load_factor"), 1.0);
    assert!(run.stdout.contains("the load is at its full size"), "{}", run.stdout);
}

const ARCH_FORCE: f64 = 1.0e5;
const SPRING: f64 = 1.0e8;

/// Half of a clamped arch, loaded at the point nearest to the upper side of its crown.
fn arch(boundary: &str, rest: &str) -> Run {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain, continuum: classical, method: fem}}
materials:
  steel: {{law: elastic, youngs_modulus: 2.0e9, poisson_ratio: 0.3}}
bodies:
  - name: arch
    material: steel
    mesh:
      ring_sector: {{centre: [0.0, 0.0], inner_radius: 0.99, outer_radius: 1.01, from_angle: 65.0, to_angle: 90.0}}
      cells: [40, 2]
boundary:
  - {{face: x_min, fix: [ux, uy]}}
  - {{face: x_max, fix: [ux]}}
{boundary}
{rest}
solver: {{force_tolerance: 1.0e-10}}
output:
  history:
    - {{name: crown, mean: displacement, at: {{nearest: [0.0, 1.01]}}}}
"
    ))
    .run()
    .completed()
}

/// Downward displacement of the loaded point.
fn sag(history: &Table) -> Vec<f64> {
    history.column("crown_y").iter().map(|y| -y).collect()
}

#[test]
fn a_shallow_arch_snaps_through_as_with_a_prescribed_displacement() {
    let rest = format!(
        "loads: [{{name: push, force: [0.0, {:?}], at: {{nearest: [0.0, 1.01]}}}}]
stages: [{{name: push, steps: 40, control: {{arc_length: {{at: {{load: push}}, length: 5.0e-3, max_steps: 60}}}}}}]",
        -ARCH_FORCE
    );
    let run = arch("", &rest);
    let history = run.history();
    let (loads, sags) = (history.column("load_factor"), sag(&history));
    let turn = (1..loads.len() - 1).find(|&row| loads[row] > loads[row - 1] && loads[row] > loads[row + 1]);
    let turn = turn.expect("a limit point");
    let valley = loads[turn..].iter().copied().fold(f64::INFINITY, f64::min);
    println!(
        "limit point at load factor {}, {} m; valley at {valley}",
        loads[turn], sags[turn]
    );
    assert!(valley < 0.6 * loads[turn] && largest(&loads[turn..]) == 1.0);
    quadratic(&run);
    let mut comparison = Comparison::new("arch under a prescribed displacement");
    let lowest = loads.iter().rposition(|load| *load == valley).expect("a row");
    for row in [turn - 3, turn + 3, lowest, lowest + 3] {
        let end = sags[row] + ARCH_FORCE * loads[row] / SPRING;
        let spring = format!(
            "  - {{selection: {{nearest: [0.0, 1.01]}}, name: spring, penalty: {SPRING:?}, move: {{uy: {:?}}}}}",
            -end
        );
        let rest = "stages: [{name: push, steps: 40}]";
        let moved = arch(&spring, rest).history();
        let (sag, title) = (sag(&moved), format!("{:.4} m", sags[row]));
        let sag = *sag.last().expect("a row");
        comparison.within(&format!("displacement, {title}"), sag, sags[row], 1e-6 * sags[turn]);
        let force = SPRING * (end - sag);
        comparison.within(
            &format!("force, {title}"),
            force,
            ARCH_FORCE * loads[row],
            1e-6 * ARCH_FORCE * loads[turn],
        );
    }
    comparison.finish();
}

/// Residuals of steps along the path: `r' < C r^2` once they are small, until round-off.
fn quadratic(run: &Run) {
    let mut steepest = 0.0f64;
    for attempt in &run.convergence().attempts {
        let pairs = attempt.residuals.windows(2);
        for pair in pairs.filter(|pair| pair[0] < 1e-2 && pair[1] > 1e-12) {
            steepest = steepest.max(pair[1] / (pair[0] * pair[0]));
        }
    }
    println!("largest r' / r^2: {steepest:.2e}");
    assert!(steepest > 0.0 && steepest < 1e4, "not quadratic: {steepest}");
}

/// Thesis, section 4.5.3, which ends near 20 kN/m3 with a settlement of more than 0.45 m: the weight has a maximum, falls
/// as in the independent implementation, and rises again to where the thesis ends.
#[test]
fn the_column_of_soil_snaps_through() {
    let history = Launch::config("column_collapse_path").run().completed().history();
    assert_eq!(history.last("load_factor"), 1.0);
    let reference = Reference::read("column_collapse");
    let weights: Vec<f64> = history.column("weight").iter().map(|factor| 20.0e3 * factor).collect();
    let corner = std::iter::zip(history.column("corner_x"), history.column("corner_y"));
    let corner: Vec<f64> = corner.map(|(x, y)| x.hypot(y)).collect();
    let mut comparison = Comparison::new("column of soil");
    let [peak, falling @ ..] = reference.curve() else {
        panic!("no curve")
    };
    let before = weights.iter().zip(&corner).filter(|(_, u)| **u < 0.3);
    let before: Vec<f64> = before.map(|(weight, _)| *weight).collect();
    comparison.relative("largest weight", largest(&before), number(peak, "weight"), 0.01);
    for point in falling {
        let at = number(point, "corner");
        let row = corner.iter().position(|u| *u >= at).expect("the path goes so far");
        let share = (at - corner[row - 1]) / (corner[row] - corner[row - 1]);
        let weight = weights[row - 1] + share * (weights[row] - weights[row - 1]);
        comparison.relative(&format!("weight at {at} m"), weight, number(point, "weight"), 0.015);
    }
    let beyond = weights.iter().zip(&corner).filter(|(_, u)| **u > 0.3);
    let valley = beyond.map(|(weight, _)| *weight).fold(f64::INFINITY, f64::min);
    comparison.within("smallest weight behind it", valley, 9.7e3, 0.5e3);
    comparison.within("settlement at 20 kN/m3", -history.last("corner_y"), 0.46, 0.02);
    comparison.finish();
}
