//! The command line.

use super::scenes::BLOCK;
use crate::common::launch::Launch;
use std::collections::HashMap;

/// Keys and values of the line of a step.
fn progress(line: &str) -> Option<HashMap<&str, &str>> {
    let pairs = line.split(' ').map(|pair| pair.split_once('='));
    line.starts_with("step=").then(|| pairs.map(Option::unwrap).collect())
}

#[test]
fn a_run_writes_its_results_and_ends_with_zero() {
    let run = Launch::text(BLOCK).run().completed();
    for name in [
        "config.yaml",
        "history.csv",
        "convergence.csv",
        "summary.json",
        "points.vtkhdf",
    ] {
        assert!(run.file(name).is_file(), "{name}");
    }
    assert!(run.stdout.contains("Sheared block"), "{}", run.stdout);
    let steps: Vec<_> = run.stdout.lines().filter_map(progress).collect();
    assert_eq!(steps.len(), 2, "{}", run.stdout);
    let history = run.history();
    for (step, row) in std::iter::zip(steps, 1..) {
        for (key, column) in [
            ("step", "step"),
            ("stage", "stage"),
            ("load_factor", "load_factor"),
            ("step_size", "step_size"),
            ("iterations", "newton_iterations"),
        ] {
            assert_eq!(step[key], history.text(column)[row], "{key}");
        }
        for key in ["residual", "elapsed", "rest"] {
            assert!(step[key].parse::<f64>().unwrap() >= 0.0, "{key}={}", step[key]);
        }
    }
    assert!(
        run.stdout.chars().all(|letter| letter == '\n' || !letter.is_control()),
        "{:?}",
        run.stdout
    );
    assert_eq!(run.stderr, "");
}

#[test]
fn only_one_rank_prints() {
    let run = Launch::text(BLOCK).ranks(3).run().completed();
    assert_eq!(run.stdout.matches("Sheared block").count(), 1, "{}", run.stdout);
    assert_eq!(run.stdout.matches("3 ranks").count(), 1, "{}", run.stdout);
}

#[test]
fn quiet_prints_nothing() {
    for ranks in [1, 2] {
        let run = Launch::text(BLOCK).with(&["--quiet"]).ranks(ranks).run().completed();
        assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
        assert_eq!(run.history().rows.len(), 3);
    }
}

#[test]
fn the_result_folder_is_that_of_the_command_line_or_of_the_configuration_or_named_after_it() {
    let named = Launch::text(BLOCK).output("here/and/there").run().completed();
    assert!(named.working_folder().join("here/and/there/summary.json").is_file());
    assert!(!named.working_folder().join("results").exists());
    let configured = Launch::text(BLOCK)
        .no_output()
        .set(&["output.directory=elsewhere"])
        .run()
        .completed();
    assert!(configured.working_folder().join("elsewhere/summary.json").is_file());
    let by_default = Launch::text(BLOCK).no_output().run().completed();
    assert!(by_default.working_folder().join("results/scene/summary.json").is_file());
}

#[test]
fn version_names_the_libraries() {
    for ranks in [1, 2] {
        let run = Launch::arguments(&["--version"]).ranks(ranks).run().completed();
        for library in ["mpm-petsc 0.", "PETSc 3.", "MPI ", "HDF5 1."] {
            let found = run.stdout.lines().filter(|line| line.starts_with(library)).count();
            assert_eq!(found, 1, "{library} in {}", run.stdout);
        }
    }
}

#[test]
fn check_tells_what_would_be_solved_and_runs_nothing() {
    let scene = crate::common::launch::config("shear_layer");
    for ranks in [1, 2] {
        let run = Launch::arguments(&["check", &scene.to_string_lossy()])
            .ranks(ranks)
            .run()
            .completed();
        for line in [
            "material points     144",
            "degrees of freedom  60",
            "active cells        9",
            "shear: 200 steps",
        ] {
            assert_eq!(run.stdout.matches(line).count(), 1, "{line} in {}", run.stdout);
        }
        let left: Vec<_> = std::fs::read_dir(run.working_folder()).expect("a folder").collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn set_overrides_a_key_for_run_and_check() {
    let run = Launch::text(BLOCK)
        .set(&["stages.0.steps=5", "title=Another title"])
        .run()
        .completed();
    assert_eq!(run.history().rows.len(), 6);
    assert!(run.stdout.contains("Another title"));
    assert!(run.read("config.yaml").contains("steps: 5"));
    let scene = crate::common::launch::config("shear_layer");
    let check = Launch::arguments(&["check", &scene.to_string_lossy()])
        .set(&["stages.0.steps=7"])
        .run()
        .completed();
    assert!(check.stdout.contains("7 steps"), "{}", check.stdout);
}

#[test]
fn a_wrong_command_line_ends_with_two_and_one_message() {
    let lines: [&[&str]; 5] = [
        &[],
        &["chek", "scene.yaml"],
        &["scene.yaml", "--sett", "a=1"],
        &["a.yaml", "b.yaml"],
        &["a.yaml", "--set", "a"],
    ];
    for arguments in lines {
        for ranks in [1, 2] {
            let run = Launch::arguments(arguments).ranks(ranks).run().expect_code(2);
            assert_eq!(run.complaints("error:").len(), 1, "{arguments:?}: {}", run.stderr);
            assert_eq!(run.stdout, "", "{arguments:?}");
        }
    }
}

/// A title comes from a file that others may have written: it must not move the cursor of who runs it.
#[test]
fn what_a_terminal_would_obey_in_a_title_is_shown_instead() {
    let title = [r#"title="red \e[31m\r\nand \x9B1A \u202E back""#];
    let shown = r"red \u{1b}[31m\r\nand \u{9b}1A \u{202e} back";
    for launch in [Launch::text(BLOCK), Launch::text(BLOCK).no_output().checking()] {
        let run = launch.set(&title).run().completed();
        assert!(run.stdout.contains(shown), "{:?}", run.stdout);
        let obeyed = |letter: char| letter != '\n' && letter.is_control();
        assert!(!run.stdout.contains(obeyed), "{:?}", run.stdout);
    }
    let folder = ["output.directory=\"a\\e[2J\""];
    let run = Launch::text(BLOCK).no_output().set(&folder).run().expect_code(2);
    assert!(run.stderr.contains("without control characters"), "{:?}", run.stderr);
    assert!(!run.stderr.contains('\u{1b}'), "{:?}", run.stderr);
}

#[test]
fn completions_are_printed_for_a_shell() {
    let run = Launch::arguments(&["completions", "bash"]).ranks(2).run().completed();
    assert_eq!(run.stdout.matches("complete -F").count(), 2, "{}", run.stdout);
}

#[test]
fn options_after_two_dashes_reach_petsc() {
    let usual = Launch::text(BLOCK).run().completed();
    assert!(usual.summary().text("ordering").contains("MUMPS"));
    let run = Launch::text(BLOCK)
        .petsc("-ksp_type gmres -pc_type jacobi -ksp_rtol 1e-12")
        .run()
        .completed();
    let used = run.summary().text("ordering").to_owned();
    assert!(used.contains("jacobi"), "{used}");
    let (own, other) = (run.history().last("base"), usual.history().last("base"));
    assert!((own - other).abs() < 1e-8 * other.abs(), "{own} and {other}");
}

#[test]
fn options_of_the_configuration_and_of_the_environment_reach_petsc_too() {
    let configured = Launch::text(BLOCK)
        .set(&["solver.petsc_options=-ksp_type gmres -pc_type jacobi"])
        .run();
    assert!(configured.completed().summary().text("ordering").contains("jacobi"));
    let environment = Launch::text(BLOCK)
        .environment("PETSC_OPTIONS", "-ksp_type gmres -pc_type jacobi")
        .run();
    assert!(environment.completed().summary().text("ordering").contains("jacobi"));
}

#[test]
fn a_misspelled_option_is_named() {
    for ranks in [1, 2] {
        let run = Launch::text(BLOCK)
            .petsc("-ksp_tipe gmres")
            .ranks(ranks)
            .run()
            .completed();
        let warnings = run.stdout.matches("-ksp_tipe").count() + run.stderr.matches("-ksp_tipe").count();
        assert_eq!(warnings, 1, "{}\n{}", run.stdout, run.stderr);
    }
}
