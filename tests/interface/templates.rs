//! `mpm-petsc init`: every template is listed, written, checked and runs to its end.

use crate::common::launch::Launch;
use mpm_petsc::app::TEMPLATES;
use std::process::{Command, Stdio};

#[test]
fn templates_are_listed() {
    let list = Launch::arguments(&["init"]).run().completed();
    for template in TEMPLATES {
        assert!(
            list.stdout.contains(&format!("    {} ", template.name)),
            "{}",
            list.stdout
        );
    }
    assert_eq!(
        std::fs::read_dir(list.working_folder()).expect("a folder").count(),
        0,
        "nothing is written"
    );
}

#[test]
fn every_template_is_checked_and_runs_to_its_end() {
    assert!(TEMPLATES.len() >= 4);
    for template in TEMPLATES {
        let written = Launch::arguments(&["init", template.name]).run().completed();
        let file = format!("{}.yaml", template.name);
        let path = written.working_folder().join(&file);
        assert_eq!(
            std::fs::read_to_string(&path).expect("the template is written"),
            template.text
        );
        let check = Launch::arguments(&["check", &path.to_string_lossy()]).run().completed();
        assert!(!check.stdout.contains("warning"), "{}", check.stdout);
        let run = Launch::file(&path).with(&["--quiet"]).run().completed();
        assert!(run.history().rows.len() > 5, "{}", template.name);
        let comments = template.text.lines().filter(|line| line.contains('#')).count();
        assert!(comments > 8, "{} explains little", template.name);
    }
}

#[test]
fn a_file_that_exists_is_left_as_it_is() {
    let run = Launch::arguments(&["init", "slope"])
        .beside("slope.yaml", "mine")
        .run()
        .expect_code(2);
    assert!(run.stderr.contains("slope.yaml exists"), "{}", run.stderr);
    assert_eq!(
        std::fs::read_to_string(run.working_folder().join("slope.yaml")).expect("a file"),
        "mine"
    );
}

#[test]
fn an_unknown_template_gets_the_list() {
    let run = Launch::arguments(&["init", "slop"]).run().expect_code(2);
    assert!(
        run.stderr.contains("there is no template named \"slop\"") && run.stderr.contains("slope"),
        "{}",
        run.stderr
    );
}

/// A reader that closes early is no failure.
#[test]
fn the_schema_is_printed_and_may_be_cut_short() {
    let run = Launch::arguments(&["schema"]).run().completed();
    let schema: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    let program = env!("CARGO_BIN_EXE_mpm-petsc");
    let shell = format!("'{program}' schema 2>&1 >/dev/full | head -c 300; '{program}' schema | head -n 1");
    let cut = Command::new("bash").args(["-c", &shell]).output().expect("bash runs");
    let printed = String::from_utf8_lossy(&cut.stdout);
    assert!(
        printed.contains("error: standard output: ") && printed.ends_with("{\n"),
        "{printed}"
    );
}

/// What nobody reads is dropped, and the work goes on.
#[test]
fn a_reader_that_leaves_at_once_changes_nothing() {
    let study = ["study", "configs/studies/weak_scaling.yaml", "--dry-run"];
    let commands: [(&[&str], i32); 4] = [
        (&["--version"], 0),
        (&["--help"], 0),
        (&study, 0),
        (&["check", "no_such_file.yaml"], 2),
    ];
    for (words, code) in commands {
        let mut child = Command::new(env!("CARGO_BIN_EXE_mpm-petsc"))
            .args(words)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().expect("it ends").code(), Some(code), "{words:?}");
    }
}
