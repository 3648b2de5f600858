//! Runs as processes of their own, some at the same time.

use super::outcome::{self, State};
use super::plan::{Run, Study};
use super::tether::tether;
use crate::console;
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::output::folder::create_anew;
use crate::output::lock::{FolderLock, Writer};
use crate::problem::Problem;
use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::io::{self, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Variables by which a launcher says how many ranks it started.
const SIZES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"];

/// Time between two looks at a run that goes on: short beside any run, and no burden.
const LOOK: Duration = Duration::from_millis(20);

/// Whether a launcher started several copies of this process.
pub fn is_one_of_many() -> bool {
    let many = |name: &str| std::env::var(name).is_ok_and(|text| text.parse::<usize>().is_ok_and(|size| size > 1));
    SIZES.into_iter().any(many)
}

/// Why several copies of a study are not started: each would start every run.
pub fn refusal(ranks: usize) -> Error {
    Error::Configuration(vec![Problem {
        file: String::new(),
        place: None,
        path: String::new(),
        message: format!("a study was started on {ranks} ranks, and starts mpirun itself for each of its runs"),
        expected: "mpm-petsc study STUDY.yaml without mpirun; `ranks` in the study".to_owned(),
    }])
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

/// Whether a letter means nothing but itself to shells.
pub fn is_plain(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || "_-./=,:+@%".contains(letter)
}

/// A command as a shell takes it.
pub fn shell_line(words: &[String]) -> String {
    let quoted = |word: &String| match word {
        word if !word.is_empty() && word.chars().all(is_plain) => word.clone(),
        word => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

/// How a study makes its runs.
pub struct Launcher<'a> {
    pub study: &'a Study,
    pub program: &'a str,
    pub jobs: usize,
    /// Whether unfinished runs begin again.
    pub overwrite: bool,
    pub interrupt: &'a Interrupt,
}

impl Launcher<'_> {
    /// Makes the runs that are not done, some at a time; one that fails is recorded in its folder and stops no other.
    ///
    /// # Errors
    /// The folder of a run cannot be written; a signal asked the study to stop, and all runs have ended.
    pub fn all(&self) -> Result<(), Error> {
        let states = self.study.runs.iter().map(|run| (run, outcome::state(run)));
        let due: Vec<(&Run, State)> = states.filter(|(_, state)| *state != State::Done).collect();
        let total = self.study.runs.len();
        console::say(format_args!("{total} runs, {} to do", due.len()));
        warn_of_crowding(&due, self.jobs);
        let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || -> Result<(), Error> {
            while let Some((run, state)) = due.get(next.fetch_add(1, Ordering::Relaxed)) {
                if self.interrupt.requested() {
                    return Ok(());
                }
                let begin = Instant::now();
                let told = self.one(run, *state)?;
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
            let workers: Vec<_> = (0..self.jobs.min(due.len())).map(|_| scope.spawn(work)).collect();
            workers.into_iter().try_for_each(|worker| {
                worker
                    .join()
                    .unwrap_or_else(|_| Err(Error::System("a worker ended".to_owned())))
            })
        })?;
        if self.interrupt.requested() {
            let done = self
                .study
                .runs
                .iter()
                .filter(|run| outcome::state(run) == State::Done)
                .count();
            let message = format!("stopped by a signal with {done} of {total} runs done; the same command goes on");
            return Err(Error::Interrupted(message));
        }
        Ok(())
    }

    /// Makes a run, and says how it ended. A folder that another run writes is left alone.
    fn one(&self, run: &Run, state: State) -> Result<String, Error> {
        match FolderLock::take(&run.folder, Writer::Run) {
            Ok(lock) => drop(lock),
            Err(error) => return Ok(format!("not started ({error})")),
        }
        let start = outcome::start(run, state, self.overwrite);
        let words = self.study.command(run, self.program, start);
        process(&words, run, self.interrupt)
            .map_err(|error| Error::System(format!("cannot write the folder {}: {error}", run.folder.display())))
    }
}

fn warn_of_crowding(due: &[(&Run, State)], jobs: usize) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = due.iter().map(|(run, _)| run.ranks).max().unwrap_or(0) * jobs.min(due.len());
    if most > cores {
        console::say(format_args!(
            "warning: up to {most} ranks at once share {cores} cores; the times will not mean much"
        ));
    }
}

/// Starts the process of a run, waits for its end, and says how it ended.
fn process(words: &[String], run: &Run, interrupt: &Interrupt) -> io::Result<String> {
    fs::create_dir_all(&run.folder)?;
    outcome::forget(run)?;
    let mut log = create_anew(&run.folder.join("log.txt"))?;
    writeln!(log, "$ {}", shell_line(words))?;
    let mut command = Command::new(&words[0]);
    command
        .args(&words[1..])
        .stdin(Stdio::null())
        .stdout(log.try_clone()?)
        .stderr(log.try_clone()?);
    environment(&mut command);
    tether(&mut command);
    let failure = match command.spawn() {
        Ok(child) => ending(await_end(child, interrupt)?),
        Err(error) => Some((None, format!("cannot start {}: {error}", words[0]))),
    };
    let failure = failure.or_else(|| {
        let reason = "it ended well, but left other results than those of a completed run".to_owned();
        (!outcome::is_whole(run)).then_some((Some(0), reason))
    });
    match failure {
        None => Ok("completed".to_owned()),
        Some((code, reason)) => {
            let message = outcome::record_failure(run, code, &reason)?;
            let how = if interrupt.requested() { "interrupted" } else { "failed" };
            Ok(format!("{how} ({message})"))
        }
    }
}

/// Waits for the end of a process, and passes on that it should end: by the signal on which a run writes a checkpoint,
/// and that launchers hand to their ranks.
fn await_end(mut child: Child, interrupt: &Interrupt) -> io::Result<ExitStatus> {
    let mut told = false;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if interrupt.requested() && !told {
            told = true;
            kill_process(Pid::from_child(&child), Signal::USR1)?;
        }
        std::thread::sleep(LOOK);
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
