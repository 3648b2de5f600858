//! A rank that fails ends the whole job within seconds.

use super::scenes;
use crate::common::launch::Launch;
use rustix::process::{Pid, Signal, kill_process};
use std::time::{Duration, Instant};

/// From the death of a rank to the end of the job.
const SECONDS: u64 = 20;

#[test]
fn a_rank_that_is_killed_ends_the_job() {
    for victim in [0, 1, 2] {
        let started = Launch::config("shear_layer_39").ranks(3).start();
        wait_for_rows(&started.file("history.csv"));
        let ranks = started.ranks();
        assert_eq!(ranks.len(), 3, "{ranks:?}");
        kill_process(ranks[victim], Signal::KILL).expect("the rank runs");
        let death = Instant::now();
        let run = started.wait_for(Duration::from_secs(SECONDS));
        println!(
            "the job ended {:.1} s after the death of a rank",
            death.elapsed().as_secs_f64()
        );
        assert!(!run.status.success());
        // What was written until then can be read.
        assert!(run.history().rows.len() >= 2);
        assert!(
            !run.file("summary.json").exists(),
            "the summary tells of an end that did not happen"
        );
        for rank in ranks {
            wait_for_end(rank);
        }
    }
}

fn wait_for_rows(path: &std::path::Path) {
    let start = Instant::now();
    let rows = || std::fs::read_to_string(path).map_or(0, |text| text.lines().count());
    while rows() < 4 {
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "the run does not get under way"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A process that has ended may still be listed until somebody asks for its exit code (state Z).
fn wait_for_end(process: Pid) {
    let start = Instant::now();
    let running = || {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero())).unwrap_or_default();
        let state = stat
            .rsplit_once(')')
            .and_then(|(_, tail)| tail.split_whitespace().next());
        state.is_some_and(|state| state != "Z" && state != "X")
    };
    while running() {
        assert!(start.elapsed() < Duration::from_secs(SECONDS), "{process:?} still runs");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// One rank cannot write: all end with the message of that rank, once.
#[test]
fn a_result_folder_that_cannot_be_made_ends_all_ranks() {
    let launch = scenes::one_cell().beside("taken", "a file").output("taken");
    let run = launch.ranks(3).run().expect_code(1);
    assert_eq!(run.complaints("cannot make the folder").len(), 1, "{}", run.stderr);
    assert_eq!(
        std::fs::read_to_string(run.working_folder().join("taken")).unwrap(),
        "a file"
    );
}
