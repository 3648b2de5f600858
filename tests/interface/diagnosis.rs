//! A run that finds no equilibrium says once what happened, where, what usually causes it and which key mends it.

use crate::common::launch::{Launch, Run};

/// Triaxial compression of a cube of soil without dilatancy, under pressures that act beside lines of the grid: domains
/// that bulge reach into empty cells.
const TRIAXIAL: &str = "
model: {kinematics: three_dimensional, continuum: classical}
grid: {min: [0.0, 0.0, 0.0], max: [2.0, 2.0, 2.0], cell_size: 0.5, basis: gimp}
materials:
  soil: {law: drucker_prager, youngs_modulus: 50.0e6, poisson_ratio: 0.2, friction_angle: 30.0, dilatancy_angle: 0.0, cohesion: 10.0e3}
bodies:
  - {name: sample, material: soil, points_per_cell: 2, shape: {box: {min: [0.0, 0.0, 0.0], max: [1.0, 1.0, 1.0]}}}
boundary:
  - {face: x_min, fix: [ux]}
  - {face: y_min, fix: [uy]}
  - {face: z_min, fix: [uz], name: base}
  - {name: top, selection: {layer: {body: sample, face: z_max}}, penalty: 1.0e9, fix: [], move: {uz: -0.04}, stage: shear}
loads:
  - {pressure: 100.0e3, at: {layer: {body: sample, face: x_max}}}
  - {pressure: 100.0e3, at: {layer: {body: sample, face: y_max}}}
  - {pressure: 100.0e3, at: {layer: {body: sample, face: z_max}}}
stages:
  - {name: consolidate, steps: 5}
  - {name: shear, steps: 20}
output: {history: [{name: base, reaction: {boundary: base, component: uz}}]}
";

/// The lines of the message: the first, and those that explain it.
fn message(run: &Run) -> Vec<&str> {
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert!(lines[0].starts_with("error: stage "), "{}", run.stderr);
    assert!(lines[1..].iter().all(|line| line.starts_with("  ")), "{}", run.stderr);
    lines
}

#[test]
fn cells_that_hold_little_are_named_with_their_remedy_and_the_step_is_not_halved_for_ever() {
    let run = |ranks| Launch::text(TRIAXIAL).ranks(ranks).run().expect_code(3);
    let (alone, shared) = (run(1), run(2));
    let lines = message(&alone);
    assert!(
        lines[0].contains("fails in the same way at 4 sizes in succession"),
        "{}",
        lines[0]
    );
    for part in [
        "where: ",
        "body sample, material soil; before this step J = ",
        "cells there: the emptiest is filled to ",
        "usual cause: cells beside this place hold next to nothing",
        "stabilisation: {ghost: {translation: ..}}, or grid.basis: bspline2",
        "docs/stability.md, \"Cells that hold little\"",
    ] {
        let told = lines.iter().filter(|line| line.contains(part)).count();
        assert_eq!(told, 1, "`{part}`: {}", alone.stderr);
    }
    let attempts = alone.summary().count("attempts") - alone.summary().count("steps");
    assert!(attempts < 3 * 12, "{attempts} attempts failed: all sizes were tried");
    // What helps does not depend on the number of ranks.
    let advice = |run: &Run| -> Vec<String> {
        let hints = message(run).into_iter().skip(2);
        hints.map(str::to_owned).collect()
    };
    assert_eq!(advice(&alone), advice(&shared));
}

/// The remedies that the message names are remedies.
#[test]
fn what_helps_does_help() {
    for remedy in ["grid.basis=bspline2", "stabilisation.ghost={translation: 1.0e6}"] {
        Launch::text(TRIAXIAL).set(&[remedy]).run().completed();
    }
}

/// A step that is far too large fails by less at every size, and halving goes on until it succeeds.
#[test]
fn a_step_that_is_far_too_large_is_halved_until_it_succeeds() {
    let run = Launch::text(
        "
model: {kinematics: plane_strain, continuum: classical}
grid: {min: [0.0, 0.0], max: [2.0, 40.0], cell_size: 1.0, basis: linear}
materials: {rubber: {law: elastic, youngs_modulus: 1.0e6, poisson_ratio: 0.0}}
bodies: [{name: block, material: rubber, shape: {box: {min: [0.0, 0.0], max: [1.0, 1.0]}}, points_per_cell: 2}]
boundary:
  - {face: y_min, fix: [ux, uy], name: base}
  - {face: {axis: y, at: 1.0}, fix: [ux], move: {uy: -30.0}, name: top, stage: press}
stages: [{name: press, steps: 1, max_halvings: 8}]
output: {history: [{name: base, reaction: {boundary: base, component: uy}}]}
",
    )
    .run()
    .expect_code(3);
    assert!(run.history().rows.len() > 1, "no step was accepted\n{}", run.stdout);
    let failed = run
        .stdout
        .lines()
        .filter(|line| line.starts_with("step 1 of stage press"))
        .count();
    assert!(failed > 2 * 4, "{failed} attempts at the first step failed");
}
