//! The program: arguments, MPI, read, check, run, exit code.

use mpm_petsc::app::{self, Intent, Process, Task};
use mpm_petsc::clock::Clock;
use mpm_petsc::config::Source;
use mpm_petsc::config::arguments::{Command, Exit, completions, parse};
use mpm_petsc::console;
use mpm_petsc::error::Error;
use mpm_petsc::interrupt::Interrupt;
use mpm_petsc::parallel::World;
use mpm_petsc::scene::Scene;
use mpm_petsc::study;
use std::process::exit;
use std::rc::Rc;

#[global_allocator]
static MEMORY: last_words::Allocator = last_words::Allocator;

fn main() {
    let clock = Rc::new(Clock::start());
    let command = parse(std::env::args_os());
    // Before all that takes time. What writes nothing ends at once, as programs do.
    let interrupt = match &command {
        Ok(Command::Run(_) | Command::Study(_)) => Interrupt::catch(),
        _ => Ok(Interrupt::default()),
    };
    let interrupt = interrupt.unwrap_or_else(|error| {
        console::complain(format_args!("error: cannot catch signals: {error}"));
        exit(1);
    });
    if let Ok(Command::Study(study)) = &command
        && !study::is_one_of_many()
    {
        // Before MPI: a process that has started it cannot start mpirun.
        exit(study::execute(study, &interrupt).map_or_else(|error| told(&error), |()| 0));
    }
    let Some(world) = World::start() else {
        console::complain(format_args!("error: MPI cannot be started"));
        exit(1);
    };
    last_words::catch_aborts(world.is_root());
    let code = match command {
        Ok(command) => perform(&world, command, &Process { clock, interrupt }),
        Err(Exit { message, code }) => {
            match (world.is_root(), code) {
                (false, _) => {}
                (true, 0) => console::print(format_args!("{message}")),
                (true, _) => console::complain(format_args!("{}", message.trim_end())),
            }
            code
        }
    };
    drop(world);
    exit(code);
}

/// Collective. Does what the user asks; the exit code is the same on every rank.
fn perform(world: &World, command: Command, process: &Process) -> i32 {
    let outcome = match command {
        Command::Version => app::print_versions(world),
        Command::Run(run) => read(world, &run.config, &run.overrides()).and_then(|(mut scene, source)| {
            scene.solver.petsc_options.extend(run.petsc_options);
            let intent = match (run.restart, run.overwrite) {
                (true, _) => Intent::Restart,
                (false, true) => Intent::Overwrite,
                (false, false) => Intent::Begin,
            };
            let quiet = run.quiet;
            app::execute(world, &scene, &source, Task::Run { quiet, intent }, process)
        }),
        Command::Schema => app::print(world, || Ok(app::schema_text())),
        Command::Init { template } => app::print(world, || app::init(template.as_deref())),
        Command::Completions { shell } => app::print(world, || Ok(completions(shell))),
        Command::Point(point) => app::point(world, &point.config, &point.set),
        Command::Report(report) => app::report(world, &report.directory),
        Command::Check(check) => read(world, &check.config, &check.set)
            .and_then(|(scene, source)| app::execute(world, &scene, &source, Task::Check, process)),
        // Otherwise it is done before MPI is started.
        Command::Study(_) => Err(study::refusal(world.size())),
    };
    match outcome {
        Ok(()) => 0,
        Err(Error::Library(message)) if world.size() > 1 => world.fail(&message),
        Err(error) => {
            if world.is_root() {
                return told(&error);
            }
            error.exit_code()
        }
    }
}

/// Prints why the program ends early; returns its exit code.
fn told(error: &Error) -> i32 {
    console::complain(format_args!("{}", prefixed(error)));
    error.exit_code()
}

/// Every message on a line of its own, marked as an error; lines that belong to the one above are indented.
fn prefixed(error: &Error) -> String {
    error
        .to_string()
        .lines()
        .map(|line| match line.starts_with(' ') {
            true => line.to_owned(),
            false => format!("error: {line}"),
        })
        .collect::<Vec<_>>()
        .join("\n")
}

/// Collective. The root reads the configuration; every rank makes the same scene of it.
fn read(world: &World, file: &str, overrides: &[String]) -> Result<(Scene, Source), Error> {
    app::read_input(world, file, overrides)?
        .scene()
        .map_err(Error::Configuration)
}
