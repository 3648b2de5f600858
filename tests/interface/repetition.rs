//! A run can be repeated from its result folder.

use super::scenes::{BLOCK, column};
use crate::common::launch::Launch;

fn same_again(launch: Launch) {
    let first = launch.run().completed();
    let again = Launch::file(&first.file("config.yaml"))
        .output("again")
        .run()
        .completed();
    assert_eq!(again.read("history.csv"), first.read("history.csv"), "bit by bit");
    assert_eq!(again.read("convergence.csv"), first.read("convergence.csv"));
    // The configuration of the repetition differs by the name of its folder alone.
    let (first, again) = (first.read("config.yaml"), again.read("config.yaml"));
    let different = first.lines().zip(again.lines()).filter(|(first, again)| first != again);
    let different: Vec<_> = different.collect();
    assert_eq!(first.lines().count(), again.lines().count());
    assert!(
        different
            .iter()
            .all(|(line, _)| line.trim_start().starts_with("directory:")),
        "{different:?}"
    );
}

#[test]
fn with_overrides_of_the_command_line() {
    same_again(Launch::text(BLOCK).set(&["stages.0.steps=3", "solver.force_tolerance=1e-6"]));
}

#[test]
fn with_yield_and_halved_steps() {
    same_again(Launch::text(&column(&[(15, 1.0)], 3)));
}

#[test]
fn for_every_short_scene_of_the_repository() {
    same_again(Launch::config("shear_layer").set(&["stages.0.steps=20"]));
    same_again(Launch::config("curved_cantilever_2m").set(&["loads.0.force=[0.0, 0.0, 40.0]", "stages.0.steps=1"]));
}

#[test]
fn with_a_point_file_that_lies_beside_the_first_scene() {
    let text = BLOCK.replace(
        "shape: {box: {min: [0.0, 0.0], max: [0.02, 0.02]}}, points_per_cell: 2",
        "shape: {points: {file: cloud.csv}}",
    );
    let centres = [0.005, 0.015];
    let rows = centres
        .iter()
        .flat_map(|x| centres.map(|y| format!("{x}, {y}, 1e-4, 0.005, 0.005\n")));
    let cloud: String = std::iter::once("x, y, volume, lx, ly\n".to_owned())
        .chain(rows)
        .collect();
    same_again(Launch::text(&text).beside("cloud.csv", &cloud));
}

/// The same run on the same ranks gives the same bits.
#[test]
fn on_two_ranks_bit_by_bit() {
    let run = || {
        Launch::config("shear_layer")
            .set(&["stages.0.steps=20"])
            .ranks(2)
            .run()
            .completed()
    };
    assert_eq!(run().read("history.csv"), run().read("history.csv"));
}
