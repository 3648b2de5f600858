//! Studies: many runs of a scene with varied keys, and charts of what they cost and how good they are.
//!
//! A study reads files and starts this program again for each run; it knows no solver, and nothing here may start MPI: a
//! process that has started MPI cannot start `mpirun`. In reading order: `file` (what may be typed), `plan` (the runs),
//! `launch` (processes), `outcome` (what a run left behind), `measure` (numbers of it), `table` (one row a run),
//! `lines`, `rates` and `charts` (figures), `page` (all of it to look at), `slurm` (a batch script instead of runs).

mod charts;
pub mod file;
mod launch;
mod lines;
mod measure;
mod outcome;
mod page;
mod plan;
mod rates;
mod slurm;
mod table;

use crate::config::arguments::StudyArguments;
use crate::console;
use crate::error::Error;
use outcome::State;
use plan::Study;

/// Does what the user asks of a study. Not to be called in a process that has started MPI.
///
/// # Errors
/// The study or one of its scenes is wrong; files cannot be written; a run did not complete.
pub fn execute(arguments: &StudyArguments) -> Result<(), Error> {
    launch::refuse_many_ranks()?;
    let study = plan::read(&arguments.study, arguments.output.as_deref()).map_err(Error::Configuration)?;
    let program = launch::program()?;
    if arguments.dry_run {
        return list(&study, &program);
    }
    if arguments.slurm {
        return slurm::write(&study, &program, &arguments.study);
    }
    if !arguments.collect {
        launch::all(&study, &program, arguments.jobs.get())?;
    }
    collect(&study)
}

/// Prints the runs, and which of them would be repeated.
fn list(study: &Study, program: &str) -> Result<(), Error> {
    for (number, run) in study.runs.iter().enumerate() {
        let state = outcome::state(run);
        console::say(format_args!("{:3}  {}  [{state}]", number + 1, run.name));
        console::say(format_args!(
            "     {}",
            launch::shell_line(&study.command(run, program))
        ));
    }
    let count = study
        .runs
        .iter()
        .filter(|run| outcome::state(run) != State::Done)
        .count();
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
