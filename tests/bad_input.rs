//! Every configuration in `tests/bad_input` is refused with the message that its first lines expect.

use mpm_petsc::config::Input;
use std::path::{Path, PathBuf};

fn cases() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_input");
    let entries = std::fs::read_dir(folder).expect("the folder of wrong configurations");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("an entry of the folder").path())
        .collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "yaml"));
    files.sort();
    files
}

/// What is wrong with how a configuration was refused.
fn disagreement(file: &Path) -> Option<String> {
    let text = std::fs::read_to_string(file).expect("a readable case");
    let expected: Vec<_> = text.lines().map_while(|line| line.strip_prefix("# expect: ")).collect();
    let name = file.file_name()?.to_string_lossy().into_owned();
    if expected.is_empty() {
        return Some(format!("{name}: it expects nothing"));
    }
    let problems = match Input::from_disk(file.to_str()?, &[]).and_then(|input| input.scene()) {
        Ok(_) => return Some(format!("{name}: it is accepted")),
        Err(problems) => problems,
    };
    let messages: Vec<_> = problems.iter().map(ToString::to_string).collect();
    let missed: Vec<_> = expected
        .iter()
        .filter(|text| !messages.iter().any(|message| message.contains(**text)))
        .collect();
    // One mistake gives one message: none beyond those that are expected.
    let surplus: Vec<_> = messages
        .iter()
        .filter(|message| !expected.iter().any(|text| message.contains(*text)))
        .collect();
    let agrees = missed.is_empty() && surplus.is_empty();
    (!agrees).then(|| format!("{name}:\n  missed {missed:#?}\n  among {messages:#?}"))
}

#[test]
fn wrong_configurations_are_refused_with_the_expected_messages() {
    let cases = cases();
    let disagreements: Vec<_> = cases.iter().filter_map(|file| disagreement(file)).collect();
    println!("{} wrong configurations", cases.len());
    assert!(cases.len() >= 60, "only {} cases were found", cases.len());
    assert!(disagreements.is_empty(), "{}", disagreements.join("\n"));
}
