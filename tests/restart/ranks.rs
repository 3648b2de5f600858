//! A run goes on on other numbers of ranks, and with other kinds of bodies.

use crate::common::compare::{same_history, same_path};
use crate::common::results::Table;
use crate::scenes::{BIAXIAL, CLASSICAL, ELEMENTS, PATH, PLATEN, Runs, SANDSTONE, Scene};

/// Largest difference over the largest magnitude of a column.
const AGREEMENT: f64 = 1e-8;

fn stopped_and_continued(scene: Scene, rows: usize, from: usize, to: usize) {
    stopped_and_compared(scene, rows, from, to, same_history);
}

fn stopped_and_compared(scene: Scene, rows: usize, from: usize, to: usize, same: fn(&str, &Table, &Table, share: f64)) {
    let runs = Runs::of(scene);
    let whole = runs.launch("whole", from).run().completed();
    runs.interrupt("part", from, rows);
    let part = runs.again("part", to).run().completed();
    let title = format!("{}, from {from} ranks to {to}", scene.file);
    if from == to {
        for file in ["history.csv", "convergence.csv"] {
            assert!(
                runs.bytes("part", file) == runs.bytes("whole", file),
                "{title}: {file} differs"
            );
        }
    }
    let [part_table, whole_table] = ["part", "whole"].map(|run| Table::read(&runs.file(run, "history.csv")));
    same(&title, &part_table, &whole_table, AGREEMENT);
    let (part, whole) = (part.summary(), whole.summary());
    assert_eq!(part.count("steps"), whole.count("steps"));
    assert_eq!(part.count("attempts"), whole.count("attempts"));
    assert_eq!(part.count("ranks"), to);
}

#[test]
fn from_one_to_two() {
    stopped_and_continued(BIAXIAL, 7, 1, 2);
}

#[test]
fn from_two_to_one() {
    stopped_and_continued(BIAXIAL, 7, 2, 1);
}

#[test]
fn from_two_to_three() {
    stopped_and_continued(BIAXIAL, 7, 2, 3);
}

#[test]
fn finite_elements() {
    stopped_and_continued(ELEMENTS, 3, 1, 1);
    stopped_and_continued(ELEMENTS, 3, 2, 1);
}

#[test]
fn classical_continuum() {
    stopped_and_continued(CLASSICAL, 5, 2, 2);
    stopped_and_continued(CLASSICAL, 5, 1, 2);
}

#[test]
fn points_held_by_penalties_and_steps_that_adapt() {
    stopped_and_continued(PLATEN, 10, 1, 1);
    stopped_and_continued(PLATEN, 10, 2, 2);
    stopped_and_continued(PLATEN, 10, 2, 1);
}

#[test]
fn damage_on_splines() {
    stopped_and_continued(SANDSTONE, 9, 1, 1);
    stopped_and_continued(SANDSTONE, 9, 2, 2);
    stopped_and_continued(SANDSTONE, 9, 1, 2);
}

#[test]
fn a_path_beyond_its_limit_point() {
    for (from, to) in [(1, 1), (1, 2), (2, 1)] {
        stopped_and_compared(PATH, 8, from, to, same_path);
    }
}

/// Entries of the matrix that travel between the ranks, and migration: each sum in a fixed order.
#[test]
fn two_runs_on_two_ranks_are_the_same() {
    for scene in [BIAXIAL, PLATEN, SANDSTONE] {
        let runs = Runs::of(scene);
        for run in ["one", "other"] {
            runs.launch(run, 2).run().completed();
        }
        for file in ["history.csv", "convergence.csv"] {
            let [one, other] = ["one", "other"].map(|run| runs.bytes(run, file));
            assert!(one == other, "{}: {file} differs", scene.file);
        }
    }
}
