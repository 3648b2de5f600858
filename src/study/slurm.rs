//! A batch script for Slurm: a job array with one task a run.

use super::launch::{is_plain, shell_line};
use super::outcome::{self, Start, State};
use super::plan::{Run, Study};
use crate::console;
use crate::error::Error;
use crate::output::folder::write_atomically;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What a script is made of.
struct Script<'a> {
    study: &'a Study,
    program: &'a str,
    /// The study as it was named.
    file: &'a str,
    /// Runs that are not done, and how each is started.
    due: Vec<(&'a Run, Start)>,
    /// Where the program was started.
    directory: PathBuf,
    /// Result folder of the study.
    folder: PathBuf,
}

/// Writes `study.slurm` with the runs that are not done into the folder of the study, and says how to go on.
///
/// # Errors
/// A name cannot stand in a script; the file cannot be written.
pub fn write(study: &Study, program: &str, file: &str, overwrite: bool) -> Result<(), Error> {
    let states = study.runs.iter().map(|run| (run, outcome::state(run)));
    let due: Vec<_> = states
        .filter(|(_, state)| *state != State::Done)
        .map(|(run, state)| (run, outcome::start(run, state, overwrite)))
        .collect();
    if due.is_empty() {
        console::say(format_args!(
            "every run is done; `{program} study {file} --collect` makes table and charts"
        ));
        return Ok(());
    }
    let directory = std::env::current_dir().map_err(|error| {
        Error::System(format!(
            "cannot find the folder that the program was started in: {error}"
        ))
    })?;
    let script = Script {
        study,
        program,
        file,
        due,
        directory,
        folder: std::path::absolute(&study.folder).unwrap_or_else(|_| study.folder.clone()),
    };
    script.check_names()?;
    write_atomically(&script.path(), script.text()?.as_bytes())?;
    let (path, count) = (script.path(), script.due.len());
    console::say(format_args!(
        "wrote {} with {count} tasks; submit it with",
        path.display()
    ));
    script
        .submissions()
        .iter()
        .for_each(|line| console::say(format_args!("    {line}")));
    console::say(format_args!(
        "and make table and charts when they are done with\n    {}",
        script.collection()
    ));
    Ok(())
}

impl Script<'_> {
    fn path(&self) -> PathBuf {
        self.folder.join("study.slurm")
    }

    /// A line end in a name would begin a command.
    fn check_names(&self) -> Result<(), Error> {
        let paths = [&self.directory, &self.folder].map(|path| path.to_string_lossy().into_owned());
        let scenes = self.due.iter().map(|(run, _)| run.scene.as_str());
        let names = paths.iter().map(String::as_str).chain([self.program, self.file]);
        match names.chain(scenes).find(|name| name.contains(char::is_control)) {
            None => Ok(()),
            Some(name) => Err(Error::Command(format!(
                "\"{}\" cannot stand in a batch script: it has control characters; rename it",
                name.escape_debug()
            ))),
        }
    }

    fn collection(&self) -> String {
        let folder = self.study.folder.to_string_lossy().into_owned();
        let words = [self.program, "study", self.file, "--collect", "--output", &folder].map(str::to_owned);
        shell_line(&words)
    }

    /// One submission for each number of ranks, so that no task asks for more than it needs.
    fn submissions(&self) -> Vec<String> {
        let mut tasks: BTreeMap<usize, Vec<String>> = BTreeMap::new();
        for (index, (run, _)) in self.due.iter().enumerate() {
            tasks.entry(run.ranks).or_default().push((index + 1).to_string());
        }
        let path = shell_line(&[self.path().to_string_lossy().into_owned()]);
        let line = |(ranks, tasks): (&usize, &Vec<String>)| {
            format!("sbatch --ntasks={ranks} --array={} {path}", tasks.join(","))
        };
        tasks.iter().map(line).collect()
    }

    fn text(&self) -> Result<String, Error> {
        let mut text = self.head()?;
        text.push_str("\n# One task a run. Written by `mpm-petsc study --slurm`. Submit with\n");
        for line in self.submissions() {
            let _ = writeln!(text, "#     {line}");
        }
        let _ = writeln!(
            text,
            "# and make table and charts when the tasks are done with\n#     {}\n",
            self.collection()
        );
        text.push_str("export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1\n");
        for line in &self.study.slurm.before {
            let _ = writeln!(text, "{line}");
        }
        let directory = shell_line(&[self.directory.to_string_lossy().into_owned()]);
        let _ = writeln!(text, "cd {directory} || exit 1");
        text.push_str("case \"$SLURM_ARRAY_TASK_ID\" in\n");
        for (index, (run, start)) in self.due.iter().enumerate() {
            let words = self.study.command(run, self.program, *start);
            let _ = writeln!(text, "{}) {} ;;", index + 1, shell_line(&words));
        }
        text.push_str("*) echo \"there is no run $SLURM_ARRAY_TASK_ID\" >&2; exit 2 ;;\nesac\n");
        Ok(text)
    }

    /// The lines that Slurm reads.
    fn head(&self) -> Result<String, Error> {
        let most = self.due.iter().map(|(run, _)| run.ranks).max().unwrap_or(1);
        let time = self.study.slurm.time.as_deref().unwrap_or("01:00:00");
        let mut text = format!(
            "#!/bin/bash\n\
             #SBATCH --job-name=mpm-petsc-study\n\
             #SBATCH --array=1-{}\n\
             #SBATCH --ntasks={most}\n\
             #SBATCH --cpus-per-task=1\n\
             #SBATCH --time={time}\n\
             #SBATCH --output={}\n",
            self.due.len(),
            file_of_task(&self.folder)?
        );
        for option in &self.study.slurm.options {
            let _ = writeln!(text, "#SBATCH {option}");
        }
        Ok(text)
    }
}

/// The file of what a task prints, as a value of `#SBATCH --output`: `%a` stands for the task, `%%` for itself.
fn file_of_task(folder: &Path) -> Result<String, Error> {
    let folder = folder.to_string_lossy();
    if folder.contains(['"', '\\']) {
        return Err(Error::Command(format!(
            "{folder}: Slurm does not take a file in a folder with quotation marks or backslashes in its name; accepted: \
             another folder with --output DIR"
        )));
    }
    let pattern = format!("{}/slurm_%a.txt", folder.replace('%', "%%"));
    if pattern.chars().all(is_plain) {
        Ok(pattern)
    } else {
        Ok(format!("\"{pattern}\""))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_folders_are_no_patterns_and_no_words() {
        let file = |folder: &str| file_of_task(Path::new(folder));
        assert_eq!(file("/scratch/a-b").unwrap(), "/scratch/a-b/slurm_%a.txt");
        assert_eq!(file("/a b/#50%j").unwrap(), "\"/a b/#50%%j/slurm_%a.txt\"");
        assert!(file("/a\"b").is_err() && file("/a\\b").is_err());
    }
}
