//! Checkpoints that cannot be used, scenes that changed, disks that are full: a clear message, and older data stay.

use crate::common::launch::{Launch, Run};
use crate::scenes::{BIAXIAL, Runs};
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A run that was stopped after a few steps.
fn stopped() -> Runs {
    let runs = Runs::of(BIAXIAL);
    runs.interrupt("part", 1, 5);
    runs
}

/// The restart ends with a code and a message, and nothing in the folder changes.
fn refused(runs: &Runs, launch: Launch, code: i32, message: &str) -> Run {
    let content = || {
        let names = [
            "checkpoint.h5",
            "history.csv",
            "convergence.csv",
            "points.vtkhdf",
            "config.yaml",
            "summary.json",
        ];
        names.map(|name| fs::read(runs.file("part", name)).ok())
    };
    let before = content();
    let run = launch.run().expect_code(code);
    assert_eq!(run.complaints(message).len(), 1, "{message}: {}", run.stderr);
    assert!(content() == before, "{message}: a file changed");
    run
}

#[test]
fn no_checkpoint_foreign_ones_and_truncated_ones_are_refused() {
    let runs = stopped();
    let checkpoint = runs.file("part", "checkpoint.h5");
    let good = runs.bytes("part", "checkpoint.h5");
    let again = || runs.again("part", 1);
    fs::write(&checkpoint, &good[..good.len() / 2]).unwrap();
    refused(&runs, again(), 1, "incomplete or damaged");
    fs::write(&checkpoint, "a text of another program\n").unwrap();
    refused(&runs, again().ranks(2), 1, "is no checkpoint");
    fs::write(&checkpoint, "").unwrap();
    refused(&runs, again(), 1, "is no checkpoint");
    fs::copy(runs.file("part", "points.vtkhdf"), &checkpoint).unwrap();
    refused(&runs, again(), 1, "an HDF5 file of another kind");
    fs::write(&checkpoint, &good).unwrap();
    let file = hdf5::File::open_rw(&checkpoint).unwrap();
    file.attr("version").unwrap().write_scalar(&99u32).unwrap();
    file.close().unwrap();
    refused(
        &runs,
        again(),
        1,
        "its layout is version 99, and this program reads version 2 alone",
    );
    fs::remove_file(&checkpoint).unwrap();
    refused(&runs, again(), 1, "there is no checkpoint to go on from");
}

/// A byte that is not what was written is found, wherever it changes what is read.
#[test]
fn a_flipped_byte_is_found() {
    let runs = stopped();
    runs.launch("whole", 1).run().completed();
    let good = ["checkpoint.h5", "history.csv", "convergence.csv", "points.vtkhdf"]
        .map(|name| (runs.file("part", name), runs.bytes("part", name)));
    let length = good[0].1.len();
    let mut found = 0;
    const PLACES: usize = 16;
    for place in 0..PLACES {
        good.iter().for_each(|(path, bytes)| fs::write(path, bytes).unwrap());
        let mut bytes = good[0].1.clone();
        bytes[(length - 1) * place / (PLACES - 1)] ^= 0x10;
        fs::write(&good[0].0, bytes).unwrap();
        let run = runs.again("part", 1).run();
        if run.code() == Some(1) {
            assert_eq!(run.complaints("checkpoint.h5").len(), 1, "{}", run.stderr);
            found += 1;
        } else {
            // Room between the tables holds nothing.
            let run = run.completed();
            assert_eq!(run.read("history.csv").as_bytes(), runs.bytes("whole", "history.csv"));
        }
    }
    assert!(found >= PLACES / 2, "{found} of {PLACES}");
}

#[test]
fn a_changed_scene_is_refused_with_what_changed() {
    let runs = stopped();
    let again = || runs.again("part", 1);
    let change = again().set(&["materials.soil.cohesion=90e3", "grid.cell_size=2.5e-3"]);
    let run = refused(
        &runs,
        change,
        2,
        "materials.soil.cohesion: the run to go on with had 100000.0, not 90000.0",
    );
    assert_eq!(run.complaints("grid.cell_size").len(), 1, "{}", run.stderr);
    refused(&runs, again().set(&["stages.0.steps=48"]), 2, "stages[0].steps");
    refused(
        &runs,
        again().set(&["output.history.0.name=thrust"]),
        2,
        "output.history[0].name",
    );
    // A tighter tolerance or another title is no other scene.
    let free = [
        "solver.force_tolerance=1e-11",
        "title=tighter",
        "output.snapshots.every=5",
    ];
    let run = again().set(&free).run().completed();
    assert_eq!(run.history().rows.len(), 25);
}

/// A run that has ended goes on when stages are added.
#[test]
fn stages_can_be_added_behind_the_last() {
    let runs = Runs::of(BIAXIAL);
    runs.launch("part", 1).run().completed();
    let ended = runs.bytes("part", "history.csv");
    runs.again("part", 1).run().completed();
    assert!(
        runs.bytes("part", "history.csv") == ended,
        "there is nothing left to do"
    );
    let stages = "stages=[{name: compress, steps: 24}, {name: hold, steps: 2}]";
    let run = runs.again("part", 1).set(&[stages]).run().completed();
    assert_eq!(run.history().text("stage")[24..], ["compress", "hold", "hold"]);
    assert!(run.read("history.csv").as_bytes().starts_with(&ended));
}

/// The limit on the size of files stands for a disk that is full; either is found before a byte is written.
#[test]
fn a_full_disk_leaves_the_checkpoint_before() {
    let runs = Runs::of(BIAXIAL);
    let program = env!("CARGO_BIN_EXE_mpm-petsc");
    let mut command = Command::new("bash");
    // Without the trap the system would end the process instead of telling it.
    command
        .args(["-c", "trap '' XFSZ; exec \"$@\"", "bash", program])
        .arg(BIAXIAL.path());
    BIAXIAL.set.iter().for_each(|assignment| {
        command.args(["--set", assignment]);
    });
    // No snapshot comes between.
    command.args(["--set", "output.snapshots.every=1000", "--output"]);
    command.arg(runs.directory("part")).env("OPENBLAS_NUM_THREADS", "1");
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // MPI needs larger files, so that the limit comes once it runs.
    while !runs.file("part", "checkpoint.h5").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let limit = Rlimit {
        current: Some(100 << 10),
        maximum: Some(100 << 10),
    };
    prlimit(Pid::from_raw(child.id() as i32), Resource::Fsize, limit).unwrap();
    let output = child.wait_with_output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{complaint}");
    assert!(complaint.contains("checkpoint.h5: File too large"), "{complaint}");
    assert!(!runs.file("part", "checkpoint.h5.part").exists());
    // With room again the run goes on as if nothing had happened.
    runs.again("part", 1).run().completed();
    runs.launch("whole", 1).run().completed();
    assert!(runs.bytes("part", "history.csv") == runs.bytes("whole", "history.csv"));
}

/// Something stands where the checkpoint is written: the same on all ranks, and the one before stays.
#[test]
fn a_folder_that_cannot_be_written_leaves_the_checkpoint_before() {
    let runs = stopped();
    let before = runs.bytes("part", "checkpoint.h5");
    fs::create_dir(runs.file("part", "checkpoint.h5.part")).unwrap();
    let run = runs.again("part", 2).run().expect_code(1);
    assert_eq!(run.complaints("checkpoint.h5: ").len(), 1, "{}", run.stderr);
    assert!(runs.bytes("part", "checkpoint.h5") == before);
}

/// Snapshots that cannot be gone on with are kept under another name, and the run tells so.
#[test]
fn damaged_snapshots_do_not_end_a_run() {
    let runs = stopped();
    let snapshots = runs.bytes("part", "points.vtkhdf");
    fs::write(runs.file("part", "points.vtkhdf"), &snapshots[..snapshots.len() / 3]).unwrap();
    let run = runs.again("part", 1).run().completed();
    assert!(
        run.stdout.contains("warning: ") && run.stdout.contains("points.damaged.vtkhdf"),
        "{}",
        run.stdout
    );
    assert_eq!(runs.bytes("part", "points.damaged.vtkhdf").len(), snapshots.len() / 3);
    crate::common::snapshots::Snapshots::read(&run.file("points.vtkhdf"));
}

/// Both tables are looked at before either is cut, and the message says what to do.
#[test]
fn a_table_that_was_changed_is_refused() {
    let runs = stopped();
    for name in ["history.csv", "convergence.csv"] {
        let good = runs.bytes("part", name);
        let text = String::from_utf8(good.clone()).unwrap();
        let rows: Vec<&str> = text.lines().collect();
        let mut swapped = rows.clone();
        swapped.swap(1, 2);
        let digit = text.rfind(|letter: char| ('1'..'9').contains(&letter)).unwrap();
        let changed = [
            good[..good.len() / 2].to_vec(),
            [&text[..digit], "9", &text[digit + 1..]].concat().into_bytes(),
            (swapped.join("\n") + "\n").into_bytes(),
            "\n".repeat(good.len()).into_bytes(),
            text.replace('\n', "\r\n").into_bytes(),
        ];
        for bytes in changed {
            fs::write(runs.file("part", name), bytes).unwrap();
            let run = refused(&runs, runs.again("part", 1), 1, "cannot go on with");
            assert_eq!(run.complaints(name).len(), 1, "{}", run.stderr);
            assert_eq!(run.complaints("or move it away").len(), 1, "{}", run.stderr);
        }
        fs::write(runs.file("part", name), good).unwrap();
    }
    runs.again("part", 1).run().completed();
}

/// A table that is gone begins where the run goes on; the other stays whole, and from then on so does the new one.
#[test]
fn a_table_that_is_gone_begins_anew_with_a_warning() {
    let runs = Runs::of(BIAXIAL);
    runs.interrupt("part", 2, 5);
    let before = runs.bytes("part", "convergence.csv");
    fs::remove_file(runs.file("part", "history.csv")).unwrap();
    fs::remove_file(runs.file("part", "points.vtkhdf")).unwrap();
    let run = runs.again("part", 2).run().completed();
    for warning in [
        "history.csv is gone; a new one begins where the run goes on",
        "points.vtkhdf is gone; a new series of snapshots begins here",
    ] {
        assert_eq!(run.stdout.matches(warning).count(), 1, "{}", run.stdout);
    }
    assert!(!run.stdout.contains("damaged"), "{}", run.stdout);
    assert!(runs.bytes("part", "convergence.csv").starts_with(&before));
    let table = run.history();
    assert!(table.column("step")[0] > 4.0 && table.last("step") == 24.0);
    runs.again("part", 1).run().completed();
}

/// A second mishap does not take what is left of the first.
#[test]
fn what_is_put_aside_has_a_name_of_its_own() {
    let runs = stopped();
    for name in ["points.damaged.vtkhdf", "points.damaged.2.vtkhdf"] {
        fs::write(runs.file("part", "points.vtkhdf"), name).unwrap();
        let run = runs.again("part", 1).run().completed();
        assert!(run.stdout.contains(name), "{}", run.stdout);
        assert_eq!(runs.bytes("part", name), name.as_bytes());
    }
}

/// The disk is full when a snapshot is due, and still is when the summary would be written: the first is told.
#[test]
fn what_failed_first_is_told() {
    let runs = Runs::of(BIAXIAL);
    let launch = runs
        .launch("part", 1)
        .set(&["output.checkpoint.every=1000", "output.snapshots.every=1"]);
    let started = launch.start();
    assert!(crate::scenes::wait_for_rows(
        &started,
        &runs.file("part", "history.csv"),
        3
    ));
    fs::create_dir(runs.file("part", "summary.json.part")).unwrap();
    fs::create_dir(runs.file("part", "checkpoint.h5.part")).unwrap();
    let run = started.wait().expect_code(1);
    assert_eq!(run.complaints("error: ").len(), 1, "{}", run.stderr);
    assert_eq!(run.complaints("checkpoint.h5: ").len(), 1, "{}", run.stderr);
}
