//! Options for PETSc, looked at before PETSc sees them: some take the process out of the hands of this program, and PETSc
//! reads files on one rank, where the others would wait for ever for one that cannot be read.

use std::ffi::CString;
use std::path::{Path, PathBuf};

use super::error::PetscError;
use crate::console;
use crate::file::read_text;
use crate::parallel::World;

/// Variable of the environment that PETSc reads options from.
const ENVIRONMENT: &str = "PETSC_OPTIONS";

/// Longest file of options [byte].
const LONGEST_FILE: u64 = 1 << 20;

/// Beginnings of options that are refused, without the hyphen, and why.
const REFUSED: [(&str, &str); 12] = [
    (
        "fp_trap",
        "PETSc would end the run at the first overflow, which a step that is cut may have",
    ),
    ("start_in_debugger", DEBUGGER),
    ("stop_for_debugger", DEBUGGER),
    ("debug_terminal", DEBUGGER),
    ("on_error_", "this program has its own way to report errors"),
    ("mpi_linear_solver_server", "all ranks but one would wait for work"),
    ("python", "this program runs no Python"),
    (
        "options_file_yaml",
        "options stand in a file of PETSc's own form (-options_file)",
    ),
    ("options_string_yaml", "options stand one by one"),
    ("prefix_push", "options have their full names"),
    ("prefix_pop", "options have their full names"),
    ("signal_", "this program catches signals itself"),
];

const DEBUGGER: &str = "start the debugger yourself, as in `gdb --args mpm-petsc ..`";

/// Collective. Options as C texts; those of the environment and of files are looked at, too. All ranks get the same error.
///
/// # Errors
/// What PETSc must not see: a value without a name, options that would end or halt the process, files that cannot be read.
pub(super) fn checked(world: &World, options: &[String]) -> Result<Vec<CString>, PetscError> {
    let fault = if world.is_root() {
        fault(options).unwrap_or_default()
    } else {
        String::new()
    };
    let fault = world.broadcast_text(&fault);
    if !fault.is_empty() {
        return Err(PetscError::options(fault));
    }
    let text = |word: &String| CString::new(word.as_str());
    let texts: Result<_, _> = options.iter().map(text).collect();
    texts.map_err(|_| PetscError::options("an option for PETSc holds a zero byte"))
}

/// What is wrong with the options that PETSc would read, the given ones among them.
fn fault(options: &[String]) -> Option<String> {
    let environment = std::env::var(ENVIRONMENT).unwrap_or_default();
    let environment: Vec<String> = environment.split_whitespace().map(str::to_owned).collect();
    let of_the_environment = format!("the variable {ENVIRONMENT}");
    let given = "the options for PETSc";
    let display = std::env::var_os("DISPLAY").is_some();
    if std::env::var_os("PETSC_OPTIONS_YAML").is_some() {
        return Some(format!(
            "the variable PETSC_OPTIONS_YAML is not accepted; {ENVIRONMENT} is"
        ));
    }
    in_words(&environment, &of_the_environment, display)
        .or_else(|| in_words(options, given, display))
        .or_else(|| named_files(&environment, &of_the_environment, display))
        .or_else(|| named_files(options, given, display))
        .or_else(|| usual_files(&[&environment, options].concat(), display))
}

/// What is wrong with options that stand one after the other.
fn in_words(words: &[String], place: &str, display: bool) -> Option<String> {
    if let Some(word) = words.iter().find(|word| word.contains(console::is_command)) {
        return Some(format!("`{word}` in {place} holds control characters"));
    }
    let mut after_name = false;
    for word in words {
        let name = is_name(word);
        if !name && !after_name {
            return Some(format!(
                "`{word}` in {place} is neither a name, such as -ksp_type, nor the value of the name before it"
            ));
        }
        after_name = name;
    }
    words
        .iter()
        .find_map(|word| refusal(word, display))
        .map(|(word, why)| format!("{place}: {word} is not accepted: {why}"))
}

/// Files that options name, and what is wrong with them.
fn named_files(words: &[String], place: &str, display: bool) -> Option<String> {
    let mut names = words.iter().zip(words.iter().skip(1).map(Some).chain([None]));
    names.find_map(|(name, value)| {
        if !names_a_file(name) {
            return None;
        }
        match value.filter(|value| !is_name(value)) {
            Some(file) => in_file(Path::new(file), display),
            None => Some(format!("{place}: {name} needs the name of a file")),
        }
    })
}

/// Files that PETSc reads unasked, and what is wrong with those that are there.
fn usual_files(words: &[String], display: bool) -> Option<String> {
    if words.iter().any(|word| plain(word) == "skip_petscrc") {
        return None;
    }
    let home = std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".petscrc"));
    let files = home
        .into_iter()
        .chain([PathBuf::from(".petscrc"), PathBuf::from("petscrc")]);
    files
        .filter(|file| file.exists())
        .find_map(|file| in_file(&file, display))
}

/// What is wrong with a file of options: lines of options, comments and aliases.
fn in_file(path: &Path, display: bool) -> Option<String> {
    let shown = path.display();
    let text = match read_text(path, LONGEST_FILE) {
        Ok(text) => text,
        Err(reason) => return Some(format!("the file of PETSc options {shown} cannot be used: {reason}")),
    };
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace().peekable();
        let Some(&first) = words.peek() else { continue };
        if first.starts_with(['#', '!', '%']) {
            continue;
        }
        if !is_name(first) && first != "alias" {
            return Some(format!(
                "{shown}:{number}: `{first}` is no option for PETSc, such as -ksp_type (accepted: a line for each option, \
                 comments after #)"
            ));
        }
        let nested = |word: &str| names_a_file(word).then_some("a file of options names no other");
        let found = words.find_map(|word| Some((word, refusal(word, display).map(|(_, why)| why).or(nested(word))?)));
        if let Some((word, why)) = found {
            return Some(format!("{shown}:{number}: {word} is not accepted: {why}"));
        }
    }
    None
}

/// Whether a word names an option; what follows may be its value. Negative numbers are values.
fn is_name(word: &str) -> bool {
    word.strip_prefix('-')
        .is_some_and(|rest| rest.starts_with(|letter: char| letter.is_alphabetic() || letter == '-'))
}

/// Name of an option as PETSc compares it.
fn plain(word: &str) -> String {
    word.trim_start_matches('-').to_lowercase()
}

fn names_a_file(word: &str) -> bool {
    is_name(word) && plain(word) == "options_file"
}

/// A word that is refused, and why.
fn refusal(word: &str, display: bool) -> Option<(&str, &'static str)> {
    let name = plain(word);
    if !is_name(word) {
        let draws = name == "draw" || name.starts_with("draw:");
        return (draws && !display).then_some((word, "there is no display to draw on"));
    }
    let (_, why) = REFUSED.into_iter().find(|(refused, _)| name.starts_with(refused))?;
    Some((word, why))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_string).collect()
    }

    fn wrong(text: &str) -> Option<String> {
        in_words(&words(text), "here", false)
    }

    #[test]
    fn names_with_and_without_values_are_options() {
        for right in [
            "",
            "-ksp_monitor -ksp_rtol 1e-8 -mat_mumps_icntl_14 -1 --help",
            "-fp -snes_view ascii:view.txt -log_view",
            "-ksp_monitor_python",
        ] {
            assert_eq!(wrong(right), None);
        }
    }

    #[test]
    fn stray_words_and_dangerous_options_are_refused_by_name() {
        for (text, name) in [
            ("-ksp_type gmres fgmres", "`fgmres`"),
            ("-ksp_view -FP_trap", "-FP_trap"),
            ("--start_in_debugger noxterm", "--start_in_debugger"),
            ("-on_error_abort", "-on_error_abort"),
            ("-mpi_linear_solver_server 1", "-mpi_linear_solver_server"),
            ("-ksp_monitor draw::draw_lg", "draw::draw_lg"),
            ("-ksp_type \u{1b}[2J", "control characters"),
        ] {
            let message = wrong(text).unwrap_or_default();
            assert!(message.contains(name), "{text}: {message}");
        }
        assert_eq!(in_words(&words("-ksp_monitor draw"), "here", true), None);
    }

    #[test]
    fn files_of_options_are_read_before_petsc_reads_them() {
        let folder = std::env::temp_dir().join(format!("mpm-petsc-options-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("options");
        let named = words(&format!("-ksp_view -options_file {}", file.display()));
        for (text, reason) in [
            (
                "# one\n\n-ksp_type gmres\n  -ksp_rtol 1e-3 # two\nalias -k -ksp_type\n",
                None,
            ),
            ("-ksp_type gmres\n-fp_trap\n", Some("options:2: -fp_trap")),
            ("this is no option\n", Some("options:1: `this`")),
            ("-options_file other\n", Some("names no other")),
        ] {
            std::fs::write(&file, text).unwrap();
            let message = named_files(&named, "here", false);
            match reason {
                Some(reason) => assert!(message.as_deref().unwrap_or("").contains(reason), "{message:?}"),
                None => assert_eq!(message, None),
            }
        }
        let of_a_folder = words(&format!("-options_file {}", folder.display()));
        let message = named_files(&of_a_folder, "here", false).unwrap();
        assert!(message.contains("this is a folder"), "{message}");
        let message = named_files(&words("-options_file -ksp_view"), "here", false).unwrap();
        assert!(message.contains("needs the name of a file"), "{message}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
