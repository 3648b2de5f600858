//! Wrong input through the program: exit code 2, each message once, and nothing is touched. The messages themselves are
//! tested file by file in `tests/bad_input.rs`.

use super::scenes::BLOCK;
use crate::common::launch::{Launch, Run};

/// The scene with a part of its text replaced.
fn with(from: &str, to: &str) -> String {
    assert_eq!(BLOCK.matches(from).count(), 1, "{from}");
    BLOCK.replace(from, to)
}

/// Runs on two ranks what must be refused with exactly these messages, and checks that nothing was touched.
fn refused(launch: Launch, messages: &[&str]) -> Run {
    let run = launch.ranks(2).run().expect_code(2);
    assert_eq!(run.complaints("error:").len(), messages.len(), "{}", run.stderr);
    for message in messages {
        assert_eq!(run.complaints(message).len(), 1, "{message} in {}", run.stderr);
    }
    assert_eq!(run.stdout, "");
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    let folder = run.working_folder();
    assert!(!folder.join("results").exists(), "a result folder was made");
    run
}

#[test]
fn a_missing_file() {
    refused(
        Launch::arguments(&["absent.yaml"]),
        &["absent.yaml: there is no such file"],
    );
}

#[test]
fn a_misspelled_command() {
    let check = Launch::arguments(&["chek", "absent.yaml"]);
    refused(check, &["error: unknown command \"chek\", did you mean \"check\"?"]);
    let schema = Launch::arguments(&["shema"]);
    refused(schema, &["shema: there is no such file, did you mean \"schema\"?"]);
}

#[test]
fn a_study_instead_of_a_scene() {
    let study = crate::common::launch::config("studies/manufactured_rates");
    let study = study.to_string_lossy();
    for arguments in [&["run", &study], &["check", &study], &["point", &study]] {
        let run = refused(Launch::arguments(arguments), &["this is a study, not a scene"]);
        let hint = format!("`mpm-petsc study {study}` runs a study");
        assert_eq!(run.complaints(&hint).len(), 1, "{}", run.stderr);
    }
}

#[test]
fn a_folder_instead_of_a_file() {
    refused(Launch::arguments(&["."]), &["this is a folder, not a file"]);
}

#[test]
fn broken_yaml() {
    let text = with("stages: [{name: shear, steps: 2}]", "stages: [{name: shear, steps: 2}");
    let run = Launch::text(&text).ranks(2).run().expect_code(2);
    assert_eq!(run.complaints("scene.yaml:").len(), 1, "{}", run.stderr);
}

#[test]
fn a_misspelled_key_gets_a_suggestion() {
    let run = refused(
        Launch::text(&with("shear_modulus", "shear_modulos")),
        &["shear_modulos"],
    );
    let line = run.complaints("shear_modulos")[0];
    for part in ["scene.yaml:6:", "materials.rubber", "\"shear_modulus\""] {
        assert!(line.contains(part), "{part} in {line}");
    }
}

#[test]
fn all_mistakes_of_a_file_at_once() {
    let text = with("lame_lambda: 8.0e6", "lame_lambda: many").replace("steps: 2", "steps: 0");
    refused(
        Launch::text(&text),
        &["materials.rubber.lame_lambda", "stages[0].steps"],
    );
}

#[test]
fn a_negative_modulus() {
    refused(
        Launch::text(&with("shear_modulus: 6.0e6", "shear_modulus: -6.0e6")),
        &["materials.rubber"],
    );
}

#[test]
fn a_body_outside_the_grid() {
    let text = with(
        "{min: [0.0, 0.0], max: [0.02, 0.02]}}, points",
        "{min: [0.0, 0.0], max: [0.02, 0.05]}}, points",
    );
    refused(Launch::text(&text), &["bodies[0]"]);
}

#[test]
fn a_plane_without_nodes() {
    let text = with("face: y_max, fix", "face: {axis: y, at: 0.013}, fix");
    refused(Launch::text(&text), &["boundary[1].face"]);
}

#[test]
fn a_selection_without_points() {
    let selection = "at: {within: {box: {min: [0.021, 0.0], max: [0.03, 0.02]}}}";
    let text = with("max: von_mises}", &format!("max: von_mises, {selection}}}"));
    refused(Launch::text(&text), &["output.history[1].at"]);
}

/// A spring that is stiffer than the body by so much that its round-off is what equilibrium would be solved to.
#[test]
fn a_penalty_that_is_too_large() {
    let points = "selection: {layer: {body: block, face: y_max}}, penalty: 1.0e20, fix";
    let run = refused(
        Launch::text(&with("face: y_max, fix", points)),
        &["boundary[1].penalty: 1e20"],
    );
    let line = run.complaints("boundary[1].penalty")[0];
    for part in [
        "times the largest entry of the stiffness",
        "solver.force_tolerance",
        "a number > 0 and <= ",
    ] {
        assert!(line.contains(part), "{part} in {line}");
    }
}

/// What is accepted but near the limit gives a warning, and far below it nothing.
#[test]
fn a_penalty_that_is_doubtful() {
    let check = |penalty: f64| {
        let points = format!("selection: {{layer: {{body: block, face: y_max}}}}, penalty: {penalty:e}, fix");
        let launch = Launch::text(&with("face: y_max, fix", &points)).no_output();
        launch.checking().run()
    };
    let refused = check(1.0e20).expect_code(2);
    let (_, limit) = refused.stderr.split_once("a number > 0 and <= ").expect("a limit");
    let limit: f64 = limit.trim_end().trim_end_matches(')').parse().expect("a number");
    let warning = "warning: boundary[1].penalty: its round-off may keep steps from solver.force_tolerance";
    let accepted = |penalty| check(penalty).completed().stdout.matches(warning).count();
    assert_eq!([0.5, 0.02].map(|share| accepted(share * limit)), [1, 0]);
}

/// The body is thinner than half the distance of its points: it has none, and what stands on it has none either.
#[test]
fn a_surface_that_nothing_has() {
    let load = "loads: [{pressure: 1.0e3, at: {surface: {body: block, facing: [x_max]}}}]\nstages: [";
    let text = with("stages: [", load).replace("max: [0.02, 0.02]}}, points", "max: [0.001, 0.02]}}, points");
    let messages = [
        "bodies[0]",
        "boundary[1]",
        "loads[0].at: the selection holds no material point",
    ];
    refused(Launch::text(&text), &messages);
}

#[test]
fn a_wrong_override() {
    refused(
        Launch::text(BLOCK).set(&["solver.force_tollerance=1e-9"]),
        &["force_tollerance"],
    );
}

#[test]
fn a_wrong_point_file() {
    let shape = "shape: {points: {file: cloud.csv}}";
    let text = with(
        "shape: {box: {min: [0.0, 0.0], max: [0.02, 0.02]}}, points_per_cell: 2",
        shape,
    );
    refused(Launch::text(&text), &["cloud.csv"]);
    let cloud = "x, y, volume, lx, ly\n0.005, 0.005, -1.0, 0.005, 0.005\n";
    refused(Launch::text(&text).beside("cloud.csv", cloud), &["cloud.csv"]);
}

/// The results of an earlier run stay as they are.
#[test]
fn an_earlier_result_folder_is_not_touched() {
    let earlier = Launch::text(BLOCK).run().completed();
    let names = [
        "config.yaml",
        "history.csv",
        "convergence.csv",
        "summary.json",
        "points.vtkhdf",
        "checkpoint.h5",
    ];
    let contents = || names.map(|name| std::fs::read(earlier.file(name)).expect("a file of the earlier run"));
    let before = contents();
    let folder = earlier.file("").to_string_lossy().into_owned();
    let wrong = [
        with("shear_modulus: 6.0e6", "shear_modulus: -6.0e6"),
        // Found only once points and grid meet.
        with("max: [0.02, 0.02]}}, points", "max: [0.02, 0.05]}}, points"),
    ];
    for text in wrong {
        let launch = Launch::text(&text).output(&folder).with(&["--overwrite"]);
        launch.ranks(2).run().expect_code(2);
        assert!(contents() == before, "a file was touched");
        assert_eq!(std::fs::read_dir(&folder).expect("the folder").count(), names.len());
    }
}

/// `check` finds the same, and ends with the same code.
#[test]
fn check_refuses_too() {
    let scene = crate::common::launch::config("shear_layer");
    let check = Launch::arguments(&["check", &scene.to_string_lossy()]);
    refused(check.set(&["stages.0.steps=0"]), &["stages[0].steps"]);
}
