//! Every scene in `configs` is accepted and says what it is.

mod common;

use common::launch::Launch;
use std::path::{Path, PathBuf};

const HEAD: [&str; 5] = ["Shows", "Source", "Run", "Time", "Expected"];

/// Scenes that compute with hat functions, as their sources do, what yields without change of volume.
const LOCKING: [&str; 7] = [
    "biaxial_dilatancy_0",
    "copper_wire_12um",
    "copper_wire_15um",
    "copper_wire_170um",
    "copper_wire_20um",
    "copper_wire_30um",
    "elastoplastic_collapse",
];

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let entries = std::fs::read_dir(folder).expect("the folder of scenes");
    let mut scenes: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "yaml"));
    scenes.sort();
    assert!(scenes.len() >= 6, "only {} scenes", scenes.len());
    scenes
}

#[test]
fn every_scene_is_accepted() {
    for scene in scenes() {
        let check = Launch::arguments(&["check", &scene.to_string_lossy()])
            .run()
            .completed();
        assert!(check.stdout.contains("the configuration is valid"), "{}", check.stdout);
        let name = scene.file_stem().expect("a file").to_string_lossy().into_owned();
        let warnings: Vec<_> = check
            .stdout
            .lines()
            .filter(|line| line.starts_with("warning"))
            .collect();
        let expected = usize::from(LOCKING.contains(&name.as_str()));
        assert_eq!(warnings.len(), expected, "{name}: {warnings:?}");
        assert!(
            warnings.iter().all(|line| line.contains("volumetric locking")),
            "{name}: {warnings:?}"
        );
    }
}

/// A title, and under it what the scene shows, its source, how to run it, how long that takes, and numbers to expect.
#[test]
fn the_head_of_every_scene_tells_what_it_is() {
    for scene in scenes() {
        let name = scene.file_name().expect("a file").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&scene).expect("a readable scene");
        let head: Vec<&str> = text.lines().map_while(|line| line.strip_prefix('#')).collect();
        assert!(
            head.first().is_some_and(|title| title.trim().len() > 5),
            "{name} has no title"
        );
        let entry = |key: &str| {
            let line = head.iter().position(|line| line.split_whitespace().next() == Some(key));
            let first = line.unwrap_or_else(|| panic!("{name}: no {key} in its head"));
            // Lines that go on are set in.
            let rest = head[first + 1..]
                .iter()
                .take_while(|line| line.starts_with("           "));
            std::iter::once(&head[first])
                .chain(rest)
                .map(|line| line.trim())
                .collect::<Vec<_>>()
                .join(" ")
        };
        for key in HEAD {
            assert!(entry(key).len() > key.len() + 5, "{name}: {key} says nothing");
        }
        let run = entry("Run");
        assert!(
            run.ends_with(&format!("./scripts/run.sh configs/{name}")),
            "{name}: {run}"
        );
        let expected = entry("Expected");
        assert!(
            expected.chars().any(|letter| letter.is_ascii_digit()),
            "{name}: no number in {expected}"
        );
    }
}
