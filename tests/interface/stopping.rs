//! An analysis that cannot go on: exit code 3, and everything up to there is on disk.

use super::scenes;
use crate::common::launch::{Launch, Run};
use crate::common::snapshots::Snapshots;

/// Steps of 10 % of a load of which the bar can carry four fifths and a little.
fn overloaded_bar() -> String {
    scenes::bar(&[(10, 1.0)], 3)
}

/// The results of a bar that was pulled beyond its strength.
fn results_are_complete(run: &Run) {
    assert_eq!(run.complaints("error:").len(), 1, "{}", run.stderr);
    assert_eq!(
        run.complaints("no equilibrium with the smallest step").len(),
        1,
        "{}",
        run.stderr
    );
    assert!(
        !run.stderr.contains("panicked") && !run.stderr.contains("PETSC ERROR"),
        "{}",
        run.stderr
    );

    for hint in [
        "where: the node at",
        "near the largest that the body carries",
        "control: {arc_length: ..}",
    ] {
        assert_eq!(run.complaints(hint).len(), 1, "no `{hint}`: {}", run.stderr);
    }

    let (history, convergence, summary) = (run.history(), run.convergence(), run.summary());
    let steps = history.rows.len() - 1;
    assert!(steps >= 8, "the bar carries eight steps; {steps} were accepted");
    let carried = history.last("load_factor");
    assert!((0.8..0.9).contains(&carried), "the bar carries {carried} of the load");
    assert_eq!((summary.text("status"), summary.count("exit_code")), ("stopped", 3));
    assert!(
        run.stderr.contains(summary.text("message")),
        "{}",
        summary.text("message")
    );
    assert_eq!(summary.count("steps"), steps);

    // Every attempt is there; the last ones are those at the smallest step, an eighth of a full one.
    assert_eq!(summary.count("attempts"), convergence.attempts.len());
    assert_eq!(convergence.accepted().count(), steps);
    let last: Vec<_> = convergence
        .attempts
        .iter()
        .filter(|attempt| attempt.step == steps + 1)
        .collect();
    assert!(
        last.len() >= 4,
        "one attempt at each of four sizes at least: {}",
        last.len()
    );
    assert!(last.iter().all(|attempt| !attempt.accepted));
    let numbers: Vec<usize> = last.iter().map(|attempt| attempt.attempt).collect();
    assert_eq!(numbers, (1..=last.len()).collect::<Vec<_>>());

    // The last snapshot shows the last accepted state.
    let snapshots = Snapshots::read(&run.file("points.vtkhdf"));
    let end = snapshots.times.len() - 1;
    assert_eq!(snapshots.times[end], carried);
    let chi = snapshots.scalar("chi", end).into_iter().fold(0.0, f64::max);
    assert_eq!(chi, history.last("chi"));
    let displacement = snapshots.field::<3>("displacement", end);
    assert!(displacement.iter().flatten().all(|u| u.is_finite()));
    assert!(run.read("config.yaml").contains("Bar pulled beyond its strength"));
}

#[test]
fn on_one_rank() {
    results_are_complete(&Launch::text(&overloaded_bar()).run().expect_code(3));
}

#[test]
fn on_two_ranks() {
    results_are_complete(&Launch::text(&overloaded_bar()).ranks(2).run().expect_code(3));
}

/// With eight full steps the run ends where the other one got to before its first failure, by itself.
#[test]
fn the_accepted_steps_are_those_of_a_run_that_ends_there() {
    let stopped = Launch::text(&scenes::bar(&[(10, 1.0)], 0))
        .run()
        .expect_code(3)
        .history();
    let complete = Launch::text(&scenes::bar(&[(8, 0.8)], 0)).run().completed().history();
    assert_eq!(stopped.rows.len(), complete.rows.len());
    for name in stopped.quantities() {
        let largest = complete
            .column(name)
            .into_iter()
            .fold(0.0f64, |largest, value| largest.max(value.abs()));
        for (stopped, complete) in stopped.column(name).into_iter().zip(complete.column(name)) {
            assert!(
                (stopped - complete).abs() <= 1e-9 * largest,
                "{name}: {stopped} and {complete}"
            );
        }
    }
}

#[test]
fn a_limit_of_iterations_stops_too() {
    let run = Launch::text(&overloaded_bar())
        .petsc("-snes_max_it 1")
        .set(&["stages.0.max_halvings=1"])
        .run();
    let summary = run.expect_code(3).summary();
    assert!(
        summary.text("message").contains("-snes_max_it = 1") && summary.text("message").contains("DIVERGED_MAX_IT"),
        "{}",
        summary.text("message")
    );
}
