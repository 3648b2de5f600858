//! Runs as processes of their own, some at the same time.

use super::outcome::{self, State};
use super::plan::{Run, Study};
use crate::console;
use crate::error::Error;
use std::fs::{self, File};
use std::io::{self, Write};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Variables by which a launcher says how many ranks it started.
const SIZES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"];

/// Refuses to go on where a launcher started several copies: each would start every run.
///
/// # Errors
/// This process is one of several ranks.
pub fn refuse_many_ranks() -> Result<(), Error> {
    let many = |name: &str| std::env::var(name).ok()?.parse::<usize>().ok().filter(|size| *size > 1);
    match SIZES.into_iter().find_map(many) {
        None => Ok(()),
        Some(size) => Err(Error::Configuration(vec![crate::problem::Problem {
            file: String::new(),
            place: None,
            path: String::new(),
            message: format!("a study was started on {size} ranks, and starts mpirun itself for each of its runs"),
            expected: "mpm-petsc study STUDY.yaml without mpirun; `ranks` in the study".to_owned(),
        }])),
    }
}

/// The program that runs are made with: this one.
///
/// # Errors
/// The system does not tell its path.
pub fn program() -> Result<String, Error> {
    let path = std::env::current_exe()
        .map_err(|error| Error::System(format!("cannot find the path of this program: {error}")))?;
    Ok(path.to_string_lossy().into_owned())
}

/// A command as a shell takes it.
pub fn shell_line(words: &[String]) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "_-./=,:+@%".contains(letter);
    let quoted = |word: &String| match word {
        word if !word.is_empty() && word.chars().all(plain) => word.clone(),
        word => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

/// Keeps a second study out of a folder while the answer lives: two would write the same runs at the same time.
fn lock(folder: &std::path::Path) -> Result<File, Error> {
    let path = folder.join("study.lock");
    let failure = |error: &dyn std::fmt::Display| Error::System(format!("cannot lock {}: {error}", path.display()));
    fs::create_dir_all(folder).map_err(|error| failure(&error))?;
    let file = File::create(&path).map_err(|error| failure(&error))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(fs::TryLockError::WouldBlock) => Err(failure(&"another study is running in this folder")),
        Err(fs::TryLockError::Error(error)) => Err(failure(&error)),
    }
}

/// Makes the runs that are not done, `jobs` at a time; one that fails is recorded in its folder and stops no other.
///
/// # Errors
/// The folder of a run cannot be written.
pub fn all(study: &Study, program: &str, jobs: usize) -> Result<(), Error> {
    let _lock = lock(&study.folder)?;
    let due: Vec<&Run> = study
        .runs
        .iter()
        .filter(|run| outcome::state(run) != State::Done)
        .collect();
    console::say(format_args!("{} runs, {} to do", study.runs.len(), due.len()));
    warn_of_crowding(&due, jobs);
    let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || -> Result<(), Error> {
        while let Some(run) = due.get(next.fetch_add(1, Ordering::Relaxed)) {
            let begin = Instant::now();
            let told = one(&study.command(run, program), run).map_err(|error| {
                let folder = run.folder.display();
                Error::System(format!("cannot write the folder {folder}: {error}"))
            })?;
            let count = 1 + ended.fetch_add(1, Ordering::Relaxed);
            let seconds = begin.elapsed().as_secs_f64();
            console::say(format_args!(
                "[{count}/{}] {}: {told} in {seconds:.1} s",
                due.len(),
                run.name
            ));
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs.min(due.len())).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker
                .join()
                .unwrap_or_else(|_| Err(Error::System("a worker ended".to_owned())))
        })
    })
}

fn warn_of_crowding(due: &[&Run], jobs: usize) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = due.iter().map(|run| run.ranks).max().unwrap_or(0) * jobs.min(due.len());
    if most > cores {
        console::say(format_args!(
            "warning: up to {most} ranks at once share {cores} cores; the times will not mean much"
        ));
    }
}

/// Starts a run, waits for its end, and says how it ended.
fn one(words: &[String], run: &Run) -> io::Result<String> {
    fs::create_dir_all(&run.folder)?;
    outcome::forget(run)?;
    let mut log = File::create(run.folder.join("log.txt"))?;
    writeln!(log, "$ {}", shell_line(words))?;
    let mut command = Command::new(&words[0]);
    command
        .args(&words[1..])
        .stdin(Stdio::null())
        .stdout(log.try_clone()?)
        .stderr(log.try_clone()?);
    environment(&mut command);
    let failure = match command.status() {
        Ok(status) => ending(status),
        Err(error) => Some((None, format!("cannot start {}: {error}", words[0]))),
    };
    match failure {
        None => Ok("completed".to_owned()),
        Some((code, reason)) => {
            let message = outcome::record_failure(run, code, &reason)?;
            Ok(format!("failed ({message})"))
        }
    }
}

/// Exit code and reason of an end that is none of success.
fn ending(status: ExitStatus) -> Option<(Option<i32>, String)> {
    match status.code() {
        Some(0) => None,
        code => Some((code, status.to_string())),
    }
}

/// Makes the environment of a run one that no launcher is above of, with one thread a rank unless the user says otherwise.
fn environment(command: &mut Command) {
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(is_of_launcher) {
            command.env_remove(&name);
        }
    }
    for name in ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"] {
        if std::env::var_os(name).is_none() {
            command.env(name, "1");
        }
    }
}

/// Whether a variable was set by a launcher for its own rank; what a user sets (`OMPI_MCA_btl...`,
/// `OMPI_ALLOW_RUN_AS_ROOT`) is not.
fn is_of_launcher(name: &str) -> bool {
    let of_ranks = ["PMIX_", "PMI_", "ORTE_", "PRTE_"];
    let own_settings = [
        "ess",
        "orte",
        "pmix",
        "plm",
        "initial_wdir",
        "shmem_RUNTIME",
        "mpi_oversubscribe",
    ];
    if of_ranks.iter().any(|prefix| name.starts_with(prefix)) {
        return true;
    }
    match name.strip_prefix("OMPI_MCA_") {
        Some(setting) => own_settings.iter().any(|prefix| setting.starts_with(prefix)),
        None => name.starts_with("OMPI_") && !name.starts_with("OMPI_ALLOW_"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_with_special_letters_are_quoted() {
        let words = ["mpm-petsc", "--set", "grid.cells=[5, 9]", "it's", ""].map(str::to_owned);
        assert_eq!(shell_line(&words), r"mpm-petsc --set 'grid.cells=[5, 9]' 'it'\''s' ''");
    }

    #[test]
    fn settings_of_users_stay_and_those_of_launchers_go() {
        for name in [
            "OMPI_COMM_WORLD_SIZE",
            "PMIX_RANK",
            "OMPI_MCA_ess_base_jobid",
            "OMPI_APP_CTX_NUM_PROCS",
        ] {
            assert!(is_of_launcher(name), "{name}");
        }
        for name in [
            "OMPI_MCA_rmaps_base_oversubscribe",
            "OMPI_ALLOW_RUN_AS_ROOT",
            "PATH",
            "PETSC_OPTIONS",
        ] {
            assert!(!is_of_launcher(name), "{name}");
        }
    }
}
