//! Studies: many runs of a scene with varied keys, and charts of what they cost and how good they are.
//!
//! A study reads files and starts this program again for each run; it knows no solver, and nothing here may start MPI: a
//! process that has started MPI cannot start `mpirun`. In reading order: `file` (what may be typed), `plan` (the runs),
//! `launch` (processes, which `tether` ties to this one), `owner` (whose folder it is), `outcome` (what a run left behind), `measure` (numbers of it), `table` (one row a run),
//! `lines`, `rates` and `charts` (figures), `page` (all of it to look at), `slurm` (a batch script instead of runs).

mod charts;
pub mod file;
mod launch;
mod lines;
mod measure;
mod outcome;
mod owner;
mod page;
mod plan;
mod rates;
mod slurm;
mod table;
#[allow(unsafe_code)]
mod tether;

use crate::config::arguments::StudyArguments;
use crate::console;
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::output::lock::{FolderLock, Writer};
use launch::Launcher;
pub use launch::{is_one_of_many, refusal};
use outcome::{Start, State};
use plan::Study;

/// Does what the user asks of a study. Not to be called in a process that has started MPI.
///
/// # Errors
/// The study or one of its scenes is wrong; the folder is that of another study, or another study writes it; files
/// cannot be written; a run did not complete; a signal.
pub fn execute(arguments: &StudyArguments, interrupt: &Interrupt) -> Result<(), Error> {
    let study = plan::read(&arguments.study, arguments.output.as_deref()).map_err(Error::Configuration)?;
    let program = launch::program()?;
    if arguments.dry_run {
        return list(&study, &program, arguments.overwrite);
    }
    let lock = FolderLock::take(&study.folder, Writer::Study)?;
    if let Some(warning) = lock.warning() {
        console::say(format_args!("warning: {warning}"));
    }
    lock.pass_on()
        .map_err(|error| Error::System(format!("cannot lock {}: {error}", study.folder.display())))?;
    owner::claim(&study, &arguments.study, arguments.overwrite)?;
    if arguments.slurm {
        return slurm::write(&study, &program, &arguments.study, arguments.overwrite);
    }
    if !arguments.collect {
        let launcher = Launcher {
            study: &study,
            program: &program,
            jobs: arguments.jobs.get(),
            overwrite: arguments.overwrite,
            interrupt,
        };
        launcher.all()?;
    }
    collect(&study)
}

/// Prints the runs, and which of them would be repeated.
fn list(study: &Study, program: &str, overwrite: bool) -> Result<(), Error> {
    let mut count = 0;
    for (number, run) in study.runs.iter().enumerate() {
        let state = outcome::state(run);
        count += usize::from(state != State::Done);
        let start = outcome::start(run, state, overwrite);
        let command = study.command(run, program, start);
        let how = match start {
            Start::GoingOn => "to do: goes on from its checkpoint".to_owned(),
            Start::Anew | Start::Replacing => state.to_string(),
        };
        console::say(format_args!("{:3}  {}  [{how}]", number + 1, run.name));
        console::say(format_args!("     {}", launch::shell_line(&command)));
    }
    console::say(format_args!("{} runs, {count} to do", study.runs.len()));
    Ok(())
}

/// Makes table, charts and page of the results that are there.
fn collect(study: &Study) -> Result<(), Error> {
    let rows = table::rows(study);
    table::write(study, &rows)?;
    let rates = rates::table(study, &rows);
    console::print(format_args!("{}", rates::text(&rates)));
    let figures = charts::draw(study, &rows, &rates)?;
    page::write(study, &rows, &rates, &figures)?;
    console::say(format_args!("wrote {}", study.folder.join("study.csv").display()));
    console::say(format_args!("wrote {}", study.folder.join("study.html").display()));
    let incomplete = rows.iter().filter(|row| !row.outcome.completed()).count();
    if incomplete > 0 {
        let message = format!("{incomplete} of {} runs did not complete; see study.csv", rows.len());
        return Err(Error::Analysis(message));
    }
    Ok(())
}
