//! Result folders: one writer at a time, and nothing that lies there is lost.

use crate::common::launch::{Launch, Run};
use crate::common::scene::BLOCK;
use crate::scenes::{BIAXIAL, Runs, wait_for_rows};
use rustix::process::Signal;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A run of the block into a folder.
fn block(folder: &Path) -> Launch {
    Launch::text(BLOCK).output(&folder.to_string_lossy())
}

/// Files of a folder and those below it, with what they hold.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            all.extend(contents(&path));
        } else {
            all.insert(path.display().to_string(), fs::read(&path).expect("a file"));
        }
    }
    all
}

/// The run ends with a code and one message with these pieces, and the folder stays as it was.
fn refused(launch: Launch, folder: &Path, code: i32, pieces: &[&str]) -> Run {
    let before = contents(folder);
    let run = launch.run().expect_code(code);
    assert_eq!(run.complaints("error: ").len(), 1, "{}", run.stderr);
    for piece in pieces {
        assert_eq!(run.complaints(piece).len(), 1, "{piece}: {}", run.stderr);
    }
    assert!(contents(folder) == before, "something in the folder changed");
    run
}

#[test]
fn a_second_writer_is_refused_while_the_first_goes_on() {
    let runs = Runs::of(BIAXIAL);
    let started = runs.launch("part", 1).start();
    assert!(wait_for_rows(&started, &runs.file("part", "history.csv"), 6));
    // It stands still, so that what is in the folder can be compared.
    started.signal(Signal::STOP);
    let folder = runs.directory("part");
    let words = ["another run writes this folder (process ", "--output"];
    refused(runs.launch("part", 1), &folder, 1, &words);
    refused(runs.launch("part", 1).with(&["--overwrite"]), &folder, 1, &words);
    refused(runs.again("part", 1), &folder, 1, &words);
    // A killed run keeps nobody out, though its lock file is left.
    started.kill();
    started.wait();
    assert!(runs.file("part", "run.lock").exists());
    runs.again("part", 1).run().completed();
    assert!(!runs.file("part", "run.lock").exists());
}

#[test]
fn results_of_another_scene_are_replaced_on_demand_alone() {
    let first = Launch::text(BLOCK).run().completed();
    let folder = first.file("");
    let words = |change: &'static str| {
        [
            "holds results of another scene: \"Sheared block\", completed after 2 steps",
            change,
            "--overwrite",
            "--output",
        ]
    };
    let material = block(&folder).set(&["materials.rubber.shear_modulus=5e6"]);
    let change = "materials.rubber.shear_modulus was 6000000.0, and is 5000000.0 now";
    refused(material, &folder, 2, &words(change));
    let solver = block(&folder).set(&["solver.force_tolerance=1e-7"]).ranks(2);
    refused(solver, &folder, 2, &words("solver.force_tolerance was "));
    let history = block(&folder).set(&["output.history.0.name=thrust"]);
    refused(history, &folder, 2, &words("output.history[0].name was "));
    let other = block(&folder).set(&["stages.0.steps=3"]).with(&["--overwrite"]);
    let other = other.run().completed();
    assert!(
        other.stdout.contains("replaces a run of another scene"),
        "{}",
        other.stdout
    );
    assert_eq!(other.history().rows.len(), 4);
}

#[test]
fn a_completed_run_of_the_same_scene_is_replaced_and_nothing_of_it_stays() {
    let first = Launch::text(BLOCK).with_report().run().completed();
    let folder = first.file("");
    fs::write(folder.join("points.damaged.vtkhdf"), "snapshots").unwrap();
    fs::write(folder.join("figures/own.png"), "a picture of the user").unwrap();
    fs::write(folder.join("notes.txt"), "notes").unwrap();
    let again = block(&folder).set(&["title=Another title", "output.snapshots.every=2"]);
    let again = again.run().completed();
    assert!(
        again.stdout.contains("replaces a run of this scene in "),
        "{}",
        again.stdout
    );
    let mut names: Vec<String> = contents(&folder).into_keys().collect();
    names.retain(|name| !name.ends_with(".csv") && !name.ends_with("config.yaml"));
    let left = [
        "checkpoint.h5",
        "figures/own.png",
        "notes.txt",
        "points.vtkhdf",
        "summary.json",
    ];
    let left = left.map(|name| folder.join(name).display().to_string());
    assert_eq!(names, left);
}

#[test]
fn an_unfinished_run_goes_on_or_is_replaced_on_demand() {
    let runs = Runs::of(BIAXIAL);
    runs.interrupt("part", 1, 5);
    let words = [
        "holds a run of this scene that is not at its end: \"",
        "interrupted by a signal after ",
        "with a checkpoint",
        "--restart",
        "--overwrite",
    ];
    refused(runs.launch("part", 2), &runs.directory("part"), 2, &words);
    // One that was killed left no word of its end.
    fs::remove_file(runs.file("part", "summary.json")).unwrap();
    refused(
        runs.launch("part", 1),
        &runs.directory("part"),
        2,
        &["ended without a word"],
    );
    // Without a checkpoint there is nothing to go on from.
    fs::remove_file(runs.file("part", "checkpoint.h5")).unwrap();
    runs.launch("part", 1).run().completed();
}

#[test]
fn results_without_their_configuration_are_nobodys() {
    let first = Launch::text(BLOCK).run().completed();
    fs::remove_file(first.file("config.yaml")).unwrap();
    let folder = first.file("");
    refused(
        block(&folder),
        &folder,
        2,
        &["config.yaml is missing or cannot be read"],
    );
}

/// A link in the place of a file that is not complete yet would make the run write elsewhere.
#[test]
fn links_in_the_folder_are_not_followed() {
    let first = Launch::text(BLOCK).run().completed();
    let folder = first.file("");
    let target = folder.join("target");
    fs::write(&target, "the user's").unwrap();
    let names = [
        "config.yaml",
        "history.csv",
        "convergence.csv",
        "points.vtkhdf",
        "checkpoint.h5",
        "summary.json",
    ];
    for name in names {
        std::os::unix::fs::symlink(&target, folder.join(format!("{name}.part"))).unwrap();
    }
    block(&folder).run().completed();
    assert_eq!(fs::read_to_string(&target).unwrap(), "the user's");
}

/// What a run makes before it fails goes again.
#[test]
fn a_run_that_does_not_begin_leaves_no_folder() {
    // Found only once points and grid meet.
    let text = BLOCK.replace("max: [0.02, 0.02]}}, points", "max: [0.02, 0.05]}}, points");
    let run = Launch::text(&text).output("here/and/there").run().expect_code(2);
    assert!(!run.working_folder().join("here").exists());
}
