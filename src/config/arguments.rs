//! The command line.

use super::nearest::{did_you_mean, nearest};
use crate::console;
use clap::builder::{OsStringValueParser, StyledStr, TypedValueParser};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Name of the program, as it is typed.
const PROGRAM: &str = "mpm-petsc";

#[derive(Debug, Parser)]
#[command(name = PROGRAM, about, disable_version_flag = true)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(
    after_help = "Exit codes: 0 done; 1 failure of the machine, a file or the program; 2 wrong command line, configuration \
                        or restart; 3 no equilibrium with the smallest step, or a run of a study failed; 4 ended by a signal, \
                        `--restart` goes on."
)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: Option<RunArguments>,
    /// Print the versions of the program, PETSc, MPI and HDF5
    #[arg(long, short = 'V', exclusive = true)]
    version: bool,
}

/// What the user asks for: without a command, a configuration is run.
#[derive(Clone, Debug, PartialEq, Eq, Subcommand)]
pub enum Command {
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
        #[arg(value_name = "TEMPLATE", value_parser = words())]
        template: Option<String>,
    },
    /// Print what makes a shell complete commands and options
    Completions {
        #[arg(value_name = "SHELL")]
        shell: clap_complete::Shell,
    },
    /// `--version`.
    #[command(skip)]
    Version,
}

/// Arguments of a report.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct ReportArguments {
    /// Result folder of a run
    #[arg(value_name = "RESULTS_DIR", value_parser = folder())]
    pub directory: PathBuf,
}

/// Arguments of a run.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct RunArguments {
    /// Configuration (YAML)
    #[arg(value_name = "CONFIG.yaml", value_parser = file_name())]
    pub config: String,
    /// Result folder, instead of the one that the configuration names
    #[arg(long, value_name = "DIR", value_parser = folder())]
    pub output: Option<PathBuf>,
    /// Override one key of the configuration; list entries by index from 0
    #[arg(long = "set", value_name = "A.B.C=VALUE", value_parser = assignments())]
    pub set: Vec<String>,
    /// Go on from the checkpoint in the result folder, on the same or another number of ranks
    #[arg(long)]
    pub restart: bool,
    /// Begin even where that replaces results of another scene, or a run that is not at its end
    #[arg(long, conflicts_with = "restart")]
    pub overwrite: bool,
    /// Print nothing but problems
    #[arg(long)]
    pub quiet: bool,
    /// Options for PETSc, after `--`
    #[arg(last = true, value_name = "PETSC_OPTIONS", value_parser = words())]
    pub petsc_options: Vec<String>,
}

/// Arguments of what reads a configuration and writes no files.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct CheckArguments {
    /// Configuration (YAML)
    #[arg(value_name = "CONFIG.yaml", value_parser = file_name())]
    pub config: String,
    /// Override one key of the configuration; list entries by index from 0
    #[arg(long = "set", value_name = "A.B.C=VALUE", value_parser = assignments())]
    pub set: Vec<String>,
}

/// Arguments of a study.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct StudyArguments {
    /// Study (YAML)
    #[arg(value_name = "STUDY.yaml", value_parser = file_name())]
    pub study: String,
    /// Result folder, instead of the one that the study names
    #[arg(long, value_name = "DIR", value_parser = folder())]
    pub output: Option<PathBuf>,
    /// Runs at the same time; more than one disturbs the timings
    #[arg(long, value_name = "N", default_value = "1")]
    pub jobs: NonZeroUsize,
    /// Begin again what was interrupted, and replace another study in the result folder
    #[arg(long)]
    pub overwrite: bool,
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
            let quoted = serde_json::Value::from(folder.to_string_lossy());
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
    let line = CommandLine::try_parse_from(&arguments).map_err(|error| Exit {
        code: if error.use_stderr() { 2 } else { 0 },
        message: mistaken(&arguments, error.kind())
            .unwrap_or_else(|| with_whole_word(error, &arguments).render().to_string()),
    })?;
    match line {
        CommandLine { version: true, .. } => Ok(Command::Version),
        CommandLine {
            command: Some(command), ..
        } => Ok(command),
        CommandLine { run: Some(run), .. } => Ok(Command::Run(run)),
        CommandLine { run: None, .. } => {
            let usage = CommandLine::command().render_usage();
            Err(Exit {
                message: format!("error: no configuration is given\n\n{usage}\n"),
                code: 2,
            })
        }
    }
}

/// What makes a shell complete the commands and options of the program.
pub fn completions(shell: clap_complete::Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut CommandLine::command(), PROGRAM, &mut script);
    String::from_utf8(script).expect("commands and options are UTF-8")
}

/// The command that a word was probably meant to be: a file has a dot or a slash in its name.
pub fn command_like(word: &str) -> Option<String> {
    let line = CommandLine::command();
    let commands = || line.get_subcommands().map(clap::Command::get_name);
    let is_other = !word.contains(['.', '/']) && commands().all(|name| name != word);
    nearest(word, commands()).filter(|_| is_other).map(str::to_owned)
}

/// What to say where a command was taken for the configuration of a run, which has one argument only.
fn mistaken(arguments: &[OsString], error: ErrorKind) -> Option<String> {
    let as_far_as_understood = CommandLine::command()
        .ignore_errors(true)
        .try_get_matches_from(arguments)
        .ok()
        .filter(|_| error == ErrorKind::UnknownArgument)?;
    let word = as_far_as_understood.get_one::<String>("config")?;
    let mut line = CommandLine::command();
    let what = match (line.find_subcommand(word), command_like(word)) {
        (Some(_), _) => format!("the command \"{word}\" stands before all options: {PROGRAM} {word} .."),
        (None, Some(near)) => format!("unknown command \"{word}\"{}", did_you_mean(Some(&near))),
        (None, None) => return None,
    };
    let usage = line.render_usage();
    Some(format!(
        "error: {what}\n\n{usage}\n\nFor more information, try '--help'.\n"
    ))
}

/// The same error for an option of PETSc that stands among those of the program. Of `-ksp_type` only `-k` would be named,
/// since letters after one hyphen are options of their own.
fn with_whole_word(mut error: clap::Error, arguments: &[OsString]) -> clap::Error {
    let Some(ContextValue::String(named)) = error.get(ContextKind::InvalidArg) else {
        return error;
    };
    let is_letter = error.kind() == ErrorKind::UnknownArgument && named.len() == 2 && named.starts_with('-');
    let mut words = arguments.iter().filter_map(|word| word.to_str());
    let whole = words.find(|word| is_letter && word.len() > 2 && word.starts_with(named.as_str()));
    if let Some(whole) = whole {
        let tip = StyledStr::from("options for PETSc come last in the command line of a run, after `--`");
        error.insert(ContextKind::InvalidArg, ContextValue::String(whole.to_owned()));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
    error
}

/// Reads names of files and folders: texts that every file of results can hold and a terminal shows as they are.
fn file_name() -> impl TypedValueParser<Value = String> {
    OsStringValueParser::new().try_map(|given| {
        let name = text(given)?;
        if name.contains(console::is_command) {
            return Err("control characters are not accepted in names of files and folders".to_owned());
        }
        Ok(name)
    })
}

fn folder() -> impl TypedValueParser<Value = PathBuf> {
    file_name().map(PathBuf::from)
}

/// Reads overrides of keys.
fn assignments() -> impl TypedValueParser<Value = String> {
    OsStringValueParser::new().try_map(|given| {
        let given = text(given)?;
        match given.split_once('=') {
            Some((key, _)) if !key.trim().is_empty() => Ok(given),
            _ => Err("it has the form KEY.KEY=VALUE".to_owned()),
        }
    })
}

/// Reads words as they are.
fn words() -> impl TypedValueParser<Value = String> {
    OsStringValueParser::new().try_map(text)
}

fn text(given: OsString) -> Result<String, String> {
    given
        .into_string()
        .map_err(|_| "it is no text in UTF-8, which is all that is accepted".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::ffi::OsStringExt;

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
        assert_eq!(read("mpm-petsc init"), Ok(Command::Init { template: None }));
        let template = Some("slope".to_owned());
        assert_eq!(read("mpm-petsc init slope"), Ok(Command::Init { template }));
    }

    #[test]
    fn misspelled_commands_are_told_from_files() {
        for (line, hint) in [
            (
                "mpm-petsc chek a.yaml",
                "unknown command \"chek\", did you mean \"check\"?",
            ),
            ("mpm-petsc --quiet chek a.yaml", "did you mean \"check\"?"),
            ("mpm-petsc Study a.yaml --jobs 2", "did you mean \"study\"?"),
            ("mpm-petsc a.yaml b.yaml", "unexpected argument 'b.yaml'"),
            ("mpm-petsc ./chek b.yaml", "unexpected argument 'b.yaml'"),
        ] {
            let exit = read(line).expect_err(line);
            assert_eq!(exit.code, 2);
            assert!(exit.message.contains(hint), "{line}: {}", exit.message);
        }
        assert_eq!(run("mpm-petsc chek").config, "chek");
        assert_eq!(command_like("shema").as_deref(), Some("schema"));
        assert_eq!(command_like("schema"), None, "this is the command");
    }

    #[test]
    fn wrong_command_lines_end_with_code_two_and_say_what_is_wrong() {
        for (line, what) in [
            ("mpm-petsc", "no configuration is given"),
            (
                "mpm-petsc run",
                "required arguments were not provided:\n  <CONFIG.yaml>",
            ),
            (
                "mpm-petsc check",
                "required arguments were not provided:\n  <CONFIG.yaml>",
            ),
            (
                "mpm-petsc point",
                "required arguments were not provided:\n  <CONFIG.yaml>",
            ),
            (
                "mpm-petsc study",
                "required arguments were not provided:\n  <STUDY.yaml>",
            ),
            (
                "mpm-petsc report",
                "required arguments were not provided:\n  <RESULTS_DIR>",
            ),
            (
                "mpm-petsc completions",
                "required arguments were not provided:\n  <SHELL>",
            ),
            ("mpm-petsc a.yaml b.yaml", "unexpected argument 'b.yaml'"),
            ("mpm-petsc check a.yaml b.yaml", "unexpected argument 'b.yaml'"),
            ("mpm-petsc init a b", "unexpected argument 'b'"),
            ("mpm-petsc schema x", "unexpected argument 'x'"),
            ("mpm-petsc report a b", "unexpected argument 'b'"),
            ("mpm-petsc a.yaml --sett x=1", "unexpected argument '--sett'"),
            ("mpm-petsc run a.yaml --foo", "unexpected argument '--foo'"),
            ("mpm-petsc check a.yaml --foo", "unexpected argument '--foo'"),
            ("mpm-petsc check a.yaml --quiet", "unexpected argument '--quiet'"),
            ("mpm-petsc point a.yaml --output b", "unexpected argument '--output'"),
            ("mpm-petsc report a --restart", "unexpected argument '--restart'"),
            ("mpm-petsc study a.yaml --job 2", "unexpected argument '--job'"),
            ("mpm-petsc study a.yaml --job 2", "'--jobs'"),
            ("mpm-petsc schema --foo", "unexpected argument '--foo'"),
            ("mpm-petsc init --foo", "unexpected argument '--foo'"),
            ("mpm-petsc --foo", "unexpected argument '--foo'"),
            ("mpm-petsc a.yaml -ksp_type gmres", "unexpected argument '-ksp_type'"),
            ("mpm-petsc a.yaml -ksp_type gmres", "after `--`"),
            ("mpm-petsc check a.yaml -- -log_view", "unexpected argument '-log_view'"),
            ("mpm-petsc a.yaml --set x", "KEY.KEY=VALUE"),
            ("mpm-petsc a.yaml --set =1", "KEY.KEY=VALUE"),
            ("mpm-petsc a.yaml --set", "value is required for '--set"),
            ("mpm-petsc a.yaml --output", "value is required for '--output"),
            (
                "mpm-petsc a.yaml --quiet --quiet",
                "'--quiet' cannot be used multiple times",
            ),
            ("mpm-petsc --version a.yaml", "'--version' cannot be used with"),
            (
                "mpm-petsc --quiet check a.yaml",
                "command \"check\" stands before all options",
            ),
            ("mpm-petsc study a.yaml --jobs 0", "invalid value '0' for '--jobs"),
            (
                "mpm-petsc study a.yaml --collect --slurm",
                "'--collect' cannot be used with '--slurm'",
            ),
            (
                "mpm-petsc study a.yaml --dry-run --collect",
                "'--dry-run' cannot be used with '--collect'",
            ),
            ("mpm-petsc completions csh", "invalid value 'csh' for '<SHELL>'"),
        ] {
            let exit = read(line).expect_err(line);
            assert_eq!(exit.code, 2, "{line}");
            assert!(exit.message.starts_with("error: "), "{line}: {}", exit.message);
            assert_eq!(exit.message.matches("error:").count(), 1, "{line}: {}", exit.message);
            assert!(exit.message.contains(what), "{line}: {}", exit.message);
            assert!(!exit.message.contains("unknown command"), "{line}: {}", exit.message);
        }
        assert_eq!(read("mpm-petsc --help").unwrap_err().code, 0);
    }

    #[test]
    fn bytes_that_are_no_text_are_refused_by_the_argument_that_holds_them() {
        let strange = OsString::from_vec(b"caf\xe9".to_vec());
        let with = |words: &[&str], last: &OsString| {
            let words = words.iter().map(OsString::from).chain([last.clone()]);
            parse([OsString::from(PROGRAM)].into_iter().chain(words))
        };
        for (words, argument) in [
            (&["a.yaml", "--output"] as &[&str], "--output <DIR>"),
            (&["run"], "<CONFIG.yaml>"),
            (&["check"], "<CONFIG.yaml>"),
            (&["report"], "<RESULTS_DIR>"),
            (&["study"], "<STUDY.yaml>"),
            (&["init"], "[TEMPLATE]"),
            (&["a.yaml", "--set"], "--set <A.B.C=VALUE>"),
            (&["a.yaml", "--", "-ksp_type"], "[PETSC_OPTIONS]..."),
        ] {
            let exit = with(words, &strange).expect_err("no text");
            assert!(exit.message.contains("UTF-8"), "{words:?}: {}", exit.message);
            assert!(exit.message.contains(argument), "{words:?}: {}", exit.message);
        }
        let escape = OsString::from("a\u{1b}[2J");
        for words in [&["a.yaml", "--output"] as &[&str], &["check"], &["report"], &["study"]] {
            let exit = with(words, &escape).expect_err("an escape");
            assert!(
                exit.message.contains("control characters"),
                "{words:?}: {}",
                exit.message
            );
        }
    }

    #[test]
    fn shells_learn_all_commands_and_options() {
        use clap::ValueEnum;
        for &shell in clap_complete::Shell::value_variants() {
            assert_eq!(
                read(&format!("mpm-petsc completions {shell}")),
                Ok(Command::Completions { shell })
            );
            let script = completions(shell);
            for word in ["study", "completions", "restart", "dry-run"] {
                assert!(script.contains(word), "{shell}: {word}");
            }
        }
    }
}
