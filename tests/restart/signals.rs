//! Signals that ask a run to stop.

use crate::common::launch::{Launch, Run};
use crate::scenes::{BIAXIAL, Runs, wait_for_rows};
use rustix::process::{Pid, Signal};
use std::time::{Duration, Instant};

/// A run that gets signals once it has five rows.
fn signalled(runs: &Runs, ranks: usize, signals: &[Signal]) -> Run {
    let started = runs.launch("part", ranks).start();
    assert!(wait_for_rows(&started, &runs.file("part", "history.csv"), 5));
    signals.iter().for_each(|&signal| started.signal(signal));
    started.wait()
}

fn goes_on_as_if_nothing_had_happened(runs: &Runs, ranks: usize) {
    runs.launch("whole", ranks).run().completed();
    let last = runs.again("part", ranks).run().completed();
    for file in ["history.csv", "convergence.csv"] {
        assert!(runs.bytes("part", file) == runs.bytes("whole", file), "{file} differs");
    }
    assert_eq!(last.summary().text("status"), "completed");
    assert_eq!(
        last.stdout
            .lines()
            .filter(|line| line.starts_with("goes on after step"))
            .count(),
        1
    );
}

#[test]
fn user_signal_through_mpirun() {
    let runs = Runs::of(BIAXIAL);
    let run = signalled(&runs, 2, &[Signal::USR1]).expect_code(4);
    let summary = run.summary();
    assert_eq!((summary.text("status"), summary.count("exit_code")), ("interrupted", 4));
    assert_eq!(
        run.complaints("error: stopped by a signal after step").len(),
        1,
        "{}",
        run.stderr
    );
    assert_eq!(run.history().rows.len(), summary.count("steps") + 1);
    let convergence = run.convergence();
    assert_eq!(
        convergence.accepted().count(),
        convergence.attempts.len(),
        "the iterations that were given up are told of nowhere"
    );
    goes_on_as_if_nothing_had_happened(&runs, 2);
}

/// mpirun ends its ranks with the same signal and kills them a second later; the checkpoint is there by then.
#[test]
fn termination_through_mpirun() {
    let runs = Runs::of(BIAXIAL);
    let run = signalled(&runs, 2, &[Signal::TERM]);
    assert!(!run.status.success(), "{:?}", run.status);
    assert!(runs.file("part", "checkpoint.h5").exists());
    goes_on_as_if_nothing_had_happened(&runs, 2);
}

#[test]
fn each_signal_without_mpirun() {
    for signal in [Signal::INT, Signal::TERM, Signal::USR1] {
        let runs = Runs::of(BIAXIAL);
        signalled(&runs, 1, &[signal]).expect_code(4);
        if signal == Signal::INT {
            goes_on_as_if_nothing_had_happened(&runs, 1);
        }
    }
}

/// While the process stands still both signals wait for it, so that the second finds the first unanswered.
#[test]
fn a_second_signal_ends_the_run_at_once() {
    let runs = Runs::of(BIAXIAL);
    let run = signalled(&runs, 1, &[Signal::STOP, Signal::TERM, Signal::INT, Signal::CONT]);
    assert!(matches!(run.code(), Some(130 | 143)), "{:?}", run.status);
    assert!(!run.file("summary.json").exists());
    goes_on_as_if_nothing_had_happened(&runs, 1);
}

/// A scene that takes a while to build.
const SLOW: &str = "
model: {kinematics: three_dimensional}
grid: {min: [0.0, 0.0, 0.0], max: [1.0, 1.0, 1.0], cell_size: 0.05, basis: linear}
materials: {rubber: {law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies: [{name: block, material: rubber, shape: {box: {min: [0.0, 0.0, 0.0], max: [1.0, 1.0, 1.0]}}, points_per_cell: 4}]
boundary: [{face: z_min, fix: [ux, uy, uz], name: base}]
stages: [{name: rest, steps: 1}]
";

/// Whether a process has its own way with a signal. Until the system has loaded its libraries, none has.
fn catches(process: Pid, signal: Signal) -> bool {
    let path = format!("/proc/{}/status", process.as_raw_nonzero());
    let status = std::fs::read_to_string(path).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    caught.is_some_and(|mask| mask & (1 << (signal.as_raw() - 1)) != 0)
}

/// From the first line of the program on, a signal is an order to stop, not an end without a word.
#[test]
fn a_signal_before_the_model_is_built_ends_with_four_and_nothing_written() {
    for ranks in [1, 2] {
        let started = Launch::text(SLOW).ranks(ranks).start();
        let begin = Instant::now();
        let ready = || match ranks {
            1 => catches(started.process(), Signal::USR1),
            _ => started.ranks().len() == ranks && started.ranks().into_iter().all(|rank| catches(rank, Signal::USR1)),
        };
        while !ready() {
            assert!(begin.elapsed() < Duration::from_secs(60), "the program does not start");
            std::thread::sleep(Duration::from_millis(1));
        }
        started.signal(Signal::USR1);
        let run = started.wait().expect_code(4);
        let words = "error: stopped by a signal before the first step; the result folder is as it was";
        assert_eq!(run.complaints(words).len(), 1, "{}", run.stderr);
        assert!(!run.file("").exists());
    }
}
