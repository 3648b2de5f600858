//! Memory that does not suffice ends a run at once, with one message, on any number of ranks.

use super::scenes;
use crate::common::launch::{Launch, Run};

/// A block in space with some ten thousand unknowns.
const BLOCK: &str = "
model: {kinematics: three_dimensional, continuum: classical}
grid: {min: [0.0, 0.0, 0.0], max: [1.0, 1.0, 1.25], cells: [14, 14, 17], basis: gimp}
materials: {soil: {law: elastic, youngs_modulus: 1.0e6, poisson_ratio: 0.25}}
bodies:
  - {name: block, material: soil, points_per_cell: 2, shape: {box: {min: [0.0, 0.0, 0.0], max: [1.0, 1.0, 1.0]}}}
boundary: [{face: z_min, fix: [ux, uy, uz], name: base}]
loads: [{name: weight, specific_weight: [0.0, 0.0, -1.0e3]}]
stages: [{name: weight, steps: 2}]
solver: {method: direct}
output: {history: [{name: base, reaction: {boundary: base, component: uz}}]}
";

/// Ended with one message that names the cause and what to do, without a smaller step; what was computed is there.
fn ends_at_once(run: Run, remedy: &str) {
    let run = run.expect_code(1);
    let told = run.complaints("not enough memory for the factors");
    assert_eq!(told.len(), 1, "{}", run.stderr);
    for part in ["MUMPS estimates", " MB", remedy, "solver.method: iterative"] {
        assert!(told[0].contains(part), "no `{part}`: {}", told[0]);
    }
    assert!(!run.stdout.contains("not solved"), "{}", run.stdout);
    let summary = run.summary();
    assert_eq!((summary.text("status"), summary.number("exit_code")), ("failed", 1.0));
    assert_eq!(run.history().rows.len(), 1, "the initial state");
    for file in ["checkpoint.h5", "points.vtkhdf"] {
        assert!(run.file(file).exists(), "no {file}");
    }
}

#[test]
fn factors_beyond_a_limit_of_mumps() {
    for ranks in [1, 2] {
        let launch = Launch::text(BLOCK).ranks(ranks);
        ends_at_once(launch.petsc("-mat_mumps_icntl_23 5").run(), "-mat_mumps_icntl_23");
    }
}

/// The small matrix of this scene is factorised by every rank, inside another preconditioner.
#[test]
fn factors_that_every_rank_makes() {
    let run = scenes::block().ranks(2).petsc("-mat_mumps_icntl_23 1").run();
    ends_at_once(run, "-mat_mumps_icntl_23");
}

/// Whatever the limit of addresses is, a run ends by itself: with its results, or with one line.
#[test]
fn a_limit_of_addresses_never_makes_a_run_spin() {
    for megabytes in [300, 400, 500, 550, 620, 640, 660, 700, 1200] {
        let launch = Launch::text(BLOCK).environment("RUST_BACKTRACE", "0");
        let run = launch.address_limit(megabytes).run();
        let lines = run.stderr.lines().count();
        match run.code() {
            Some(0) => assert_eq!(lines, 0, "{megabytes} MB: {}", run.stderr),
            code => {
                assert!(code == Some(1) && lines == 1, "{megabytes} MB: {}", run.stderr);
                assert!(
                    run.stderr.contains("not enough memory"),
                    "{megabytes} MB: {}",
                    run.stderr
                );
            }
        }
    }
}
