//! The command line.

use super::nearest::{did_you_mean, nearest};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand};
use std::ffi::{OsStr, OsString};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Commands of the program: without one, a configuration is run.
#[derive(Debug, Parser)]
#[command(name = "mpm-petsc", about, disable_version_flag = true)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(
    after_help = "Exit codes: 0 done; 1 failure of the machine, a file or the program; 2 wrong command line, configuration \
                        or restart; 3 no equilibrium with the smallest step, or a run of a study failed; 4 ended by a signal, \
                        `--restart` goes on."
)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<CommandName>,
    #[command(flatten)]
    run: Option<RunArguments>,
    /// Print the versions of the program, PETSc, MPI and HDF5
    #[arg(long, short = 'V', exclusive = true)]
    version: bool,
}

#[derive(Debug, Subcommand)]
enum CommandName {
    /// Run a configuration (the default)
    Run(RunArguments),
    /// Read and validate a configuration, print what would be solved; nothing is run
    Check(CheckArguments),
    /// Drive one material along a path of deformation, print what it answers as CSV
    Point(CheckArguments),
    /// Draw report.html and its figures from the files of a result folder
    Report(ReportArguments),
    /// Run a scene with varied keys and chart errors, times and efficiency; start it without mpirun
    Study(StudyArguments),
    /// Print the JSON Schema of a configuration
    Schema,
    /// List templates of configurations, or write one into the current folder
    Init {
        /// Template; without one they are listed
        #[arg(value_name = "TEMPLATE")]
        template: Option<String>,
    },
}

/// Arguments of a report.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct ReportArguments {
    /// Result folder of a run
    #[arg(value_name = "RESULTS_DIR")]
    pub directory: PathBuf,
}

/// Arguments of a run.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct RunArguments {
    /// Configuration (YAML)
    #[arg(value_name = "CONFIG.yaml")]
    pub config: String,
    /// Result folder, instead of the one that the configuration names
    #[arg(long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Override one key of the configuration; list entries by index from 0
    #[arg(long = "set", value_name = "A.B.C=VALUE", value_parser = assignment)]
    pub set: Vec<String>,
    /// Go on from the checkpoint in the result folder, on the same or another number of ranks
    #[arg(long)]
    pub restart: bool,
    /// Print nothing but problems
    #[arg(long)]
    pub quiet: bool,
    /// Options for PETSc, after `--`
    #[arg(last = true, value_name = "PETSC_OPTIONS")]
    pub petsc_options: Vec<String>,
}

/// Arguments of what reads a configuration and writes no files.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct CheckArguments {
    /// Configuration (YAML)
    #[arg(value_name = "CONFIG.yaml")]
    pub config: String,
    /// Override one key of the configuration; list entries by index from 0
    #[arg(long = "set", value_name = "A.B.C=VALUE", value_parser = assignment)]
    pub set: Vec<String>,
}

/// Arguments of a study.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct StudyArguments {
    /// Study (YAML)
    #[arg(value_name = "STUDY.yaml")]
    pub study: String,
    /// Result folder, instead of the one that the study names
    #[arg(long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Runs at the same time; more than one disturbs the timings
    #[arg(long, value_name = "N", default_value = "1")]
    pub jobs: NonZeroUsize,
    /// List the runs and what would be done; nothing is run or written
    #[arg(long, conflicts_with_all = ["collect", "slurm"])]
    pub dry_run: bool,
    /// Run nothing; make the table and the charts of the results that are there
    #[arg(long, conflicts_with = "slurm")]
    pub collect: bool,
    /// Run nothing; write a batch script for Slurm with one task a run
    #[arg(long)]
    pub slurm: bool,
}

/// What the user asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    Run(RunArguments),
    Check(CheckArguments),
    Point(CheckArguments),
    Report(ReportArguments),
    Study(StudyArguments),
    Schema,
    /// List templates, or write the named one.
    Init(Option<String>),
    /// Print versions.
    Version,
}

/// What to do, for those who call the program without anything.
const FIRST_STEPS: &str = "\
error: no configuration is given; to begin:

  mpm-petsc init                list templates
  mpm-petsc init slope          write slope.yaml into this folder
  mpm-petsc check slope.yaml
  mpm-petsc slope.yaml          run it; results and report.html go to results/slope

All commands and options: mpm-petsc --help
";

/// A text to print instead of doing anything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exit {
    pub message: String,
    /// 0 for help, on standard output; 2 for a wrong command line, on standard error.
    pub code: i32,
}

impl RunArguments {
    /// Overrides of the configuration, `--output` among them.
    pub fn overrides(&self) -> Vec<String> {
        let directory = self.output.as_ref().map(|folder| {
            let quoted = serde_json::Value::from(folder.to_string_lossy().into_owned());
            format!("output.directory={quoted}")
        });
        self.set.iter().cloned().chain(directory).collect()
    }
}

/// Reads the arguments of the process, the name of the program first. Prints nothing, so that one rank can.
///
/// # Errors
/// The text and exit code to end with: for help, and for a wrong command line.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Command, Exit> {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    if arguments.len() < 2 {
        return Err(Exit {
            message: FIRST_STEPS.to_owned(),
            code: 2,
        });
    }
    let line = CommandLine::try_parse_from(&arguments).map_err(|error| {
        let code = if error.use_stderr() { 2 } else { 0 };
        let message = misspelled(&arguments[1], error.kind());
        let message = message.unwrap_or_else(|| error.render().to_string());
        Exit { message, code }
    })?;
    match line {
        CommandLine { version: true, .. } => Ok(Command::Version),
        CommandLine {
            command: Some(CommandName::Run(run)),
            ..
        }
        | CommandLine {
            run: Some(run),
            command: None,
            ..
        } => Ok(Command::Run(run)),
        CommandLine {
            command: Some(CommandName::Check(check)),
            ..
        } => Ok(Command::Check(check)),
        CommandLine {
            command: Some(CommandName::Point(point)),
            ..
        } => Ok(Command::Point(point)),
        CommandLine {
            command: Some(CommandName::Report(report)),
            ..
        } => Ok(Command::Report(report)),
        CommandLine {
            command: Some(CommandName::Study(study)),
            ..
        } => Ok(Command::Study(study)),
        CommandLine {
            command: Some(CommandName::Schema),
            ..
        } => Ok(Command::Schema),
        CommandLine {
            command: Some(CommandName::Init { template }),
            ..
        } => Ok(Command::Init(template)),
        CommandLine {
            command: None,
            run: None,
            ..
        } => {
            let usage = CommandLine::command().render_usage();
            Err(Exit {
                message: format!("error: no configuration is given\n\n{usage}\n"),
                code: 2,
            })
        }
    }
}

/// The command that a word was probably meant to be: a file has a dot or a slash in its name.
pub fn command_like(word: &str) -> Option<&'static str> {
    const COMMANDS: [&str; 7] = ["run", "check", "point", "report", "study", "schema", "init"];
    nearest(word, COMMANDS).filter(|_| !word.contains(['.', '/']))
}

/// What to say where a misspelled command was taken for the configuration of a run, which has one argument only.
fn misspelled(word: &OsStr, error: ErrorKind) -> Option<String> {
    let word = word.to_str().filter(|_| error == ErrorKind::UnknownArgument)?;
    let suggestion = command_like(word)?;
    let (hint, usage) = (did_you_mean(Some(suggestion)), CommandLine::command().render_usage());
    Some(format!(
        "error: unknown command \"{word}\"{hint}\n\n{usage}\n\nFor more information, try '--help'.\n"
    ))
}

fn assignment(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((key, _)) if !key.trim().is_empty() => Ok(text.to_owned()),
        _ => Err("it has the form KEY.KEY=VALUE".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Command, Exit> {
        parse(line.split_whitespace().map(OsString::from))
    }

    fn run(line: &str) -> RunArguments {
        let Ok(Command::Run(run)) = read(line) else {
            panic!("{line}: {:?}", read(line))
        };
        run
    }

    #[test]
    fn a_configuration_alone_is_run() {
        let line = "mpm-petsc a.yaml --set x.y=1 --output out/b --set z=2 --quiet -- -ksp_type gmres -log_view";
        let arguments = run(line);
        assert_eq!(arguments, run(&line.replace("mpm-petsc", "mpm-petsc run")));
        assert_eq!(arguments.config, "a.yaml");
        assert_eq!(arguments.overrides(), ["x.y=1", "z=2", "output.directory=\"out/b\""]);
        assert!(arguments.quiet);
        assert_eq!(arguments.petsc_options, ["-ksp_type", "gmres", "-log_view"]);
        assert_eq!(run("mpm-petsc --set x=1 a.yaml").config, "a.yaml");
    }

    #[test]
    fn check_and_version_are_recognised() {
        let Ok(Command::Check(check)) = read("mpm-petsc check a.yaml --set x=1") else {
            panic!()
        };
        assert_eq!(
            (check.config.as_str(), check.set.as_slice()),
            ("a.yaml", ["x=1".to_owned()].as_slice())
        );
        assert_eq!(read("mpm-petsc --version"), Ok(Command::Version));
        assert_eq!(read("mpm-petsc point a.yaml --set x=1"), Ok(Command::Point(check)));
        assert_eq!(read("mpm-petsc schema"), Ok(Command::Schema));
        assert_eq!(read("mpm-petsc init"), Ok(Command::Init(None)));
        assert_eq!(
            read("mpm-petsc init slope"),
            Ok(Command::Init(Some("slope".to_owned())))
        );
    }

    #[test]
    fn misspelled_commands_are_told_from_files() {
        for (line, hint) in [
            (
                "mpm-petsc chek a.yaml",
                "unknown command \"chek\", did you mean \"check\"?",
            ),
            ("mpm-petsc Study a.yaml --jobs 2", "did you mean \"study\"?"),
            ("mpm-petsc a.yaml b.yaml", "unexpected argument 'b.yaml'"),
            ("mpm-petsc ./chek b.yaml", "unexpected argument 'b.yaml'"),
        ] {
            let exit = read(line).expect_err(line);
            assert_eq!(exit.code, 2);
            assert!(exit.message.contains(hint), "{line}: {}", exit.message);
        }
        assert_eq!(run("mpm-petsc chek").config, "chek");
        assert_eq!(command_like("shema"), Some("schema"));
        let commands: Vec<_> = CommandLine::command()
            .get_subcommands()
            .map(|c| c.get_name().to_owned())
            .collect();
        assert!(
            commands.iter().all(|name| command_like(name) == Some(name)),
            "{commands:?}"
        );
    }

    #[test]
    fn wrong_command_lines_end_with_code_two_and_a_message() {
        let wrong = [
            "mpm-petsc",
            "mpm-petsc run",
            "mpm-petsc check",
            "mpm-petsc a.yaml b.yaml",
            "mpm-petsc a.yaml --sett x=1",
            "mpm-petsc a.yaml --set x",
            "mpm-petsc a.yaml --set =1",
            "mpm-petsc a.yaml --set",
            "mpm-petsc a.yaml --output",
            "mpm-petsc a.yaml -ksp_type gmres",
            "mpm-petsc --version a.yaml",
            "mpm-petsc check a.yaml -- -log_view",
            "mpm-petsc point",
            "mpm-petsc init a b",
            "mpm-petsc schema a.yaml",
            "mpm-petsc study",
            "mpm-petsc study a.yaml --jobs 0",
            "mpm-petsc study a.yaml --collect --slurm",
            "mpm-petsc study a.yaml --dry-run --collect",
        ];
        for line in wrong {
            let exit = read(line).expect_err(line);
            assert_eq!(exit.code, 2, "{line}");
            assert!(exit.message.starts_with("error: "), "{line}: {}", exit.message);
            assert_eq!(exit.message.matches("error:").count(), 1, "{line}: {}", exit.message);
        }
        assert_eq!(read("mpm-petsc --help").unwrap_err().code, 0);
    }
}
