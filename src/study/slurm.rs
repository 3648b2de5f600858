//! A batch script for Slurm: a job array with one task a run.

use super::launch::shell_line;
use super::outcome::{self, State};
use super::plan::{Run, Study};
use crate::console;
use crate::error::Error;
use crate::output::folder::write_atomically;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Writes `study.slurm` with the runs that are not done into the folder of the study, and says how to go on.
///
/// # Errors
/// The file cannot be written.
pub fn write(study: &Study, program: &str, file: &str) -> Result<(), Error> {
    let due: Vec<&Run> = study
        .runs
        .iter()
        .filter(|run| outcome::state(run) != State::Done)
        .collect();
    if due.is_empty() {
        console::say(format_args!(
            "every run is done; `{} study {file} --collect` makes table and charts",
            program
        ));
        return Ok(());
    }
    let directory = std::env::current_dir().map_err(|error| {
        Error::System(format!(
            "cannot find the folder that the program was started in: {error}"
        ))
    })?;
    let folder = std::path::absolute(&study.folder).unwrap_or_else(|_| study.folder.clone());
    std::fs::create_dir_all(&folder)
        .map_err(|error| Error::System(format!("cannot make the folder {}: {error}", folder.display())))?;
    let path = folder.join("study.slurm");
    let collect = collection(study, program, file);
    write_atomically(
        &path,
        script(study, program, &due, &directory, &folder, &collect).as_bytes(),
    )?;
    console::say(format_args!(
        "wrote {} with {} tasks; submit it with",
        path.display(),
        due.len()
    ));
    submissions(&due, &path)
        .iter()
        .for_each(|line| console::say(format_args!("    {line}")));
    console::say(format_args!(
        "and make table and charts when they are done with\n    {collect}"
    ));
    Ok(())
}

fn collection(study: &Study, program: &str, file: &str) -> String {
    let folder = study.folder.to_string_lossy().into_owned();
    let words = [program, "study", file, "--collect", "--output", &folder].map(str::to_owned);
    shell_line(&words)
}

/// One submission for each number of ranks, so that no task asks for more than it needs.
fn submissions(due: &[&Run], path: &Path) -> Vec<String> {
    let mut tasks: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    for (index, run) in due.iter().enumerate() {
        tasks.entry(run.ranks).or_default().push((index + 1).to_string());
    }
    let path = shell_line(&[path.to_string_lossy().into_owned()]);
    let line =
        |(ranks, tasks): (&usize, &Vec<String>)| format!("sbatch --ntasks={ranks} --array={} {path}", tasks.join(","));
    tasks.iter().map(line).collect()
}

fn script(study: &Study, program: &str, due: &[&Run], directory: &Path, folder: &Path, collect: &str) -> String {
    let most = due.iter().map(|run| run.ranks).max().unwrap_or(1);
    let time = study.slurm.time.as_deref().unwrap_or("01:00:00");
    let mut text = format!(
        "#!/bin/bash\n\
         #SBATCH --job-name=mpm-petsc-study\n\
         #SBATCH --array=1-{}\n\
         #SBATCH --ntasks={most}\n\
         #SBATCH --cpus-per-task=1\n\
         #SBATCH --time={time}\n\
         #SBATCH --output={}/slurm_%a.txt\n",
        due.len(),
        folder.display()
    );
    for option in &study.slurm.options {
        let _ = writeln!(text, "#SBATCH {option}");
    }
    text.push_str("\n# One task a run. Written by `mpm-petsc study --slurm`. Submit with\n");
    for line in submissions(due, &folder.join("study.slurm")) {
        let _ = writeln!(text, "#     {line}");
    }
    let _ = writeln!(
        text,
        "# and make table and charts when the tasks are done with\n#     {collect}\n"
    );
    text.push_str("export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1\n");
    for line in &study.slurm.before {
        let _ = writeln!(text, "{line}");
    }
    let _ = writeln!(
        text,
        "cd {} || exit 1",
        shell_line(&[directory.to_string_lossy().into_owned()])
    );
    text.push_str("case \"$SLURM_ARRAY_TASK_ID\" in\n");
    for (index, run) in due.iter().enumerate() {
        let _ = writeln!(text, "{}) {} ;;", index + 1, shell_line(&study.command(run, program)));
    }
    text.push_str("*) echo \"there is no run $SLURM_ARRAY_TASK_ID\" >&2; exit 2 ;;\nesac\n");
    text
}
