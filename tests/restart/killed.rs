//! Runs that are killed at any moment lose at most the steps since the last checkpoint.

use crate::common::snapshots::Snapshots;
use crate::scenes::{BIAXIAL, Runs, rows, wait_for_rows};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Numbers in 0..1 from any seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[test]
fn ten_kills_at_random_moments_change_nothing() {
    let runs = Runs::of(BIAXIAL);
    runs.launch("whole", 2).run().completed();
    let seed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64;
    println!("seed {seed}");
    let mut random = Random(seed);
    let history = runs.file("killed", "history.csv");
    let mut killed = Vec::new();
    for _ in 0..10 {
        // A job that was killed before its first checkpoint begins anew.
        let launch = if runs.file("killed", "checkpoint.h5").exists() {
            runs.again("killed", 2)
        } else {
            runs.launch("killed", 2)
        };
        let before = rows(&history);
        let started = launch.start();
        // The rows of the part before stay until the run has found its checkpoint.
        let target = before + (4.0 * random.next()) as usize;
        let running = wait_for_rows(&started, &history, target.min(24));
        std::thread::sleep(Duration::from_secs_f64(0.3 * random.next()));
        started.kill();
        let ended = started.wait();
        killed.push((running && !ended.status.success(), rows(&history)));
    }
    println!("killed, rows left: {killed:?}");
    assert!(killed.iter().filter(|(running, _)| *running).count() >= 5, "{killed:?}");
    let last = runs.again("killed", 2).run().completed();
    for file in ["history.csv", "convergence.csv"] {
        assert!(
            runs.bytes("killed", file) == runs.bytes("whole", file),
            "{file} differs"
        );
    }
    let [killed, whole] = ["killed", "whole"].map(|run| Snapshots::read(&runs.file(run, "points.vtkhdf")));
    if !runs.file("killed", "points.damaged.vtkhdf").exists() {
        assert_eq!(killed.times, whole.times);
    }
    let end = |snapshots: &Snapshots| snapshots.field::<9>("stress", snapshots.times.len() - 1);
    assert!(end(&killed) == end(&whole), "the last snapshots differ");
    assert_eq!(last.summary().text("status"), "completed");
    assert_eq!(last.summary().count("steps"), 24);
}
