//! A failed attempt leaves no trace: a run that halves steps is the same as one that takes the smaller steps from the
//! start.

use super::scenes;
use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::results::Table;

/// One stage for each accepted step of a history, with its share of the load.
fn accepted_steps(history: &Table) -> Vec<(usize, f64)> {
    let factors = history.column("load_factor");
    factors.windows(2).map(|pair| (1, pair[1] - pair[0])).collect()
}

fn leaves_no_trace(scene: fn(&scenes::Growth, usize) -> String, growth: &scenes::Growth, code: i32) {
    let halved = Launch::text(&scene(growth, 3)).run().expect_code(code);
    let (history, convergence) = (halved.history(), halved.convergence());
    let first_failure = convergence.failed().next().expect("a step fails").step;
    let after = convergence
        .accepted()
        .filter(|attempt| attempt.step >= first_failure)
        .count();

    let direct = Launch::text(&scene(&accepted_steps(&history), 0))
        .run()
        .completed()
        .history();
    assert_eq!(history.rows.len(), direct.rows.len());
    let mut comparison = Comparison::new("steps that were halved, and the same steps from the start");
    for name in history.quantities() {
        let (halved, direct) = (history.column(name), direct.column(name));
        let largest = direct.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        for (step, (halved, direct)) in halved.iter().zip(&direct).enumerate() {
            comparison.within(&format!("{name}, step {step}"), *halved, *direct, 1e-8 * largest);
        }
    }
    comparison.finish();
    println!("{after} steps were accepted after the first failure");
    assert!(code == 3 || after >= 3, "the run hardly goes on after a failure");
}

#[test]
fn where_the_run_goes_on() {
    leaves_no_trace(scenes::column, &[(15, 1.0)], 0);
}

#[test]
fn where_the_run_stops() {
    leaves_no_trace(scenes::bar, &[(10, 1.0)], 3);
}

/// Failed attempts at one size, success at the half, then back to the full size at a multiple of it.
#[test]
fn the_step_is_halved_and_doubles_back() {
    let run = Launch::text(&scenes::column(&[(15, 1.0)], 3)).run().completed();
    let sizes = run.history().column("step_size");
    let full = 1.0 / 15.0;
    let (mut halved, mut restored) = (false, false);
    for pair in sizes[1..].windows(2) {
        let ratio = pair[1] / pair[0];
        assert!(
            [0.125, 0.25, 0.5, 1.0, 2.0]
                .iter()
                .any(|allowed| (ratio - allowed).abs() < 1e-9),
            "{sizes:?}"
        );
        halved |= ratio < 0.75;
        restored |= halved && ratio > 1.5 && (pair[1] - full).abs() < 1e-12;
    }
    assert!(halved && restored, "{sizes:?}");
    assert_eq!(run.history().last("load_factor"), 1.0);
    let snapshots = crate::common::snapshots::Snapshots::read(&run.file("points.vtkhdf"));
    // Every second full step, and the last.
    let times: Vec<f64> = (0..=7).map(|k| f64::from(2 * k) / 15.0).chain([1.0]).collect();
    assert_eq!(snapshots.times.len(), times.len(), "{:?}", snapshots.times);
    assert!(
        snapshots
            .times
            .iter()
            .zip(&times)
            .all(|(own, wanted)| (own - wanted).abs() < 1e-12)
    );
}
