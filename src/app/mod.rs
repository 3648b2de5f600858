//! From a scene to results: builds the model, runs the analysis, records it.

mod advice;
mod build;
mod checkpoint;
mod claim;
mod columns;
mod cost;
mod diagnosis;
mod facts;
mod files;
mod inspect;
mod need;
mod point;
mod recorder;
mod snapshot;
mod symmetry;
mod templates;

use crate::clock::Clock;
use crate::config::{Input, Source};
use crate::console;
use crate::continuum::classical::Classical;
use crate::continuum::gradient_micropolar::GradientMicropolar;
use crate::continuum::micropolar::Micropolar;
use crate::continuum::{Continuum, Fields};
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::material::spec::MaterialSpec;
use crate::material::{Components, Material, classical_law, gradient_micropolar_law, micropolar_law};
use crate::output::progress::Progress;
use crate::parallel::World;
use crate::petsc::{Partitioner, Session};
use crate::problem::Problem;
use crate::report::error::ReportError;
use crate::scene::{ContinuumKind, Kinematics, Scene};
use crate::solve::settings::PartitionerKind;
use crate::solve::state::AnalysisState;
use crate::solve::step::Analysis;
use build::{Built, build};
use claim::Claim;
pub use claim::Intent;
pub use point::point;
use recorder::Recorder;
use std::path::Path;
use std::rc::Rc;
pub use templates::{TEMPLATES, init};

/// What to do with a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    Run { quiet: bool, intent: Intent },
    Check,
}

/// What a process has from its start.
pub struct Process {
    pub clock: Rc<Clock>,
    pub interrupt: Interrupt,
}

impl Process {
    /// Collective. Ends a run that was asked to stop before it began.
    ///
    /// # Errors
    /// It was.
    fn go_on(&self, world: &World) -> Result<(), Error> {
        if world.any(self.interrupt.requested()) {
            let message = "stopped by a signal before the first step; the result folder is as it was";
            return Err(Error::Interrupted(message.to_owned()));
        }
        Ok(())
    }
}

/// A scene and those who work on it.
struct Job<'a> {
    world: &'a World,
    scene: &'a Scene,
    source: &'a Source,
    process: &'a Process,
}

/// A continuum with laws: what makes a law of its parameters.
pub trait Laws: Continuum {
    fn law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Self>>;
}

impl Laws for Classical {
    fn law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Self>> {
        classical_law(spec, components)
    }
}

impl Laws for Micropolar {
    fn law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Self>> {
        micropolar_law(spec, components)
    }
}

impl Laws for GradientMicropolar {
    fn law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Self>> {
        gradient_micropolar_law(spec, components)
    }
}

/// Collective. Checks or runs a scene: the one place that picks continuum and dimension.
///
/// # Errors
/// What is wrong with the scene once it meets the grid, and what ends an analysis early.
pub fn execute(world: &World, scene: &Scene, source: &Source, task: Task, process: &Process) -> Result<(), Error> {
    let job = Job {
        world,
        scene,
        source,
        process,
    };
    process.go_on(world)?;
    match (scene.kinematics, scene.continuum) {
        (Kinematics::PlaneStrain, ContinuumKind::Classical) => perform::<Classical, 2, 2>(&job, task),
        (Kinematics::ThreeDimensional, ContinuumKind::Classical) => perform::<Classical, 3, 3>(&job, task),
        (Kinematics::PlaneStrain, ContinuumKind::Micropolar) => perform::<Micropolar, 2, 3>(&job, task),
        (Kinematics::ThreeDimensional, ContinuumKind::Micropolar) => perform::<Micropolar, 3, 6>(&job, task),
        (Kinematics::PlaneStrain, ContinuumKind::GradientMicropolar) => perform::<GradientMicropolar, 2, 4>(&job, task),
        (Kinematics::ThreeDimensional, ContinuumKind::GradientMicropolar) => {
            perform::<GradientMicropolar, 3, 7>(&job, task)
        }
    }
}

/// Collective. Prints the versions of program and libraries.
pub fn print_versions(world: &World) -> Result<(), Error> {
    let session = Session::start(world, &[])?;
    print(world, || {
        let program = format!("mpm-petsc {} ({})\n", crate::version::PROGRAM, crate::version::COMMIT);
        let libraries = facts::versions(session.version());
        let lines = libraries.iter().map(|(name, version)| format!("{name} {version}\n"));
        Ok(program + &lines.collect::<String>())
    })
}

/// Collective. Prints a text that the root makes; a reader that has seen enough is no failure.
///
/// # Errors
/// What the root could not do; the other ranks know nothing of it, as it is the last that they do.
pub fn print(world: &World, text: impl FnOnce() -> Result<String, Error>) -> Result<(), Error> {
    if !world.is_root() {
        return Ok(());
    }
    let text = text()?;
    console::write(format_args!("{text}")).map_err(|error| Error::System(format!("standard output: {error}")))
}

/// The JSON Schema of a configuration, as text.
pub fn schema_text() -> String {
    format!("{:#}\n", crate::config::schema())
}

/// Collective. The root reads a configuration and the files that it names; every rank has the same.
///
/// # Errors
/// The configuration cannot be read.
pub fn read_input(world: &World, file: &str, overrides: &[String]) -> Result<Input, Error> {
    if world.size() == 1 {
        // A file of points may fill much of the memory: no copies of it.
        return Input::from_disk(file, overrides).map_err(Error::Configuration);
    }
    let text = if world.is_root() {
        encode_input(Input::from_disk(file, overrides))
    } else {
        String::new()
    };
    decode_input(&world.broadcast_text(&text))
}

/// Collective. Draws the report of a result folder; the root does all of it.
///
/// # Errors
/// A folder without results, files that are damaged, and what cannot be written.
pub fn report(world: &World, directory: &Path) -> Result<(), Error> {
    print(world, || {
        let page = crate::report::write(directory).map_err(|error| match error {
            ReportError::NoResults(message) => Error::Command(message),
            other => Error::System(other.to_string()),
        })?;
        Ok(format!("{}\n", page.display()))
    })
}

/// What the root read, as text for the other ranks.
fn encode_input(input: Result<Input, Vec<Problem>>) -> String {
    serde_json::to_string(&input).expect("texts and numbers can be written")
}

/// What the root read.
///
/// # Errors
/// What was wrong with the file.
fn decode_input(text: &str) -> Result<Input, Error> {
    let input: Result<Input, Vec<Problem>> = serde_json::from_str(text)
        .map_err(|error| Error::System(format!("broadcast of the configuration: {error}")))?;
    input.map_err(Error::Configuration)
}

fn perform<C: Fields<D, N> + Laws, const D: usize, const N: usize>(job: &Job<'_>, task: Task) -> Result<(), Error> {
    let (world, scene) = (job.world, job.scene);
    // Before anything that takes time.
    Session::check_options(world, &scene.solver.petsc_options)?;
    match task {
        Task::Check => {
            let built = build::<C, D, N>(world, scene, job.source, job.process)?;
            print(world, || Ok(built.describe(scene)))
        }
        Task::Run { quiet, intent } => {
            // Before the work of building, and until the last file is written.
            let claim = Claim::take(world, &scene.output, intent)?;
            let built = build::<C, D, N>(world, scene, job.source, job.process)?;
            run(job, built, quiet, intent, &claim)
        }
    }
}

fn run<C: Fields<D, N>, const D: usize, const N: usize>(
    job: &Job<'_>,
    mut built: Built<C, D, N>,
    quiet: bool,
    intent: Intent,
    claim: &Claim,
) -> Result<(), Error> {
    let Job {
        world,
        scene,
        source,
        process,
    } = *job;
    let clock = &process.clock;
    built.model.start_histories();
    let saved = if intent == Intent::Restart {
        Some(checkpoint::load(world, scene, source, &mut built)?)
    } else {
        None
    };
    let session = Session::start(world, &scene.solver.petsc_options)?;
    session.choose_linear_solver(scene.solver.linear_solver(built.nodes * N, D))?;
    let partitioner = partitioner(scene.solver.partitioner)
        .resolve(&session)
        .map_err(|error| {
            let expected = "auto, or one that this PETSc has";
            Error::Configuration(vec![source.problem("solver.partitioner", error.to_string(), expected)])
        })?;
    let mut progress = Progress::on_stdout(world.is_root() && !quiet, clock.elapsed());
    facts::print_header(&mut progress, world, scene, &built, &session);
    claim.notes.iter().for_each(|note| progress.message(note));
    process.go_on(world)?;
    let line = progress.line();
    let points = built.points;
    let mut recorder = Recorder::create(world, scene, built.columns, points, saved.as_ref(), progress, clock)?;
    let state = match saved {
        Some(saved) => saved.analysis,
        None => {
            recorder.initial(&built.model)?;
            AnalysisState::initial(&scene.stages)
        }
    };
    let settings = scene.solver.clone();
    let mut analysis = Analysis::new(
        world,
        &session,
        built.model,
        settings,
        partitioner,
        state,
        &process.interrupt,
        clock,
    );
    if let Some(line) = line {
        analysis.watch(move |iteration, residual| line.iterated(iteration, residual));
    }
    let outcome = analysis.run(&scene.stages, &mut recorder);
    if let Err(Error::Library(message)) = &outcome
        && world.size() > 1
    {
        // Before anything is let go of: even that would wait for ranks that go on.
        world.fail(message);
    }
    let outcome = outcome.map_err(|error| match (error, &analysis.defeat) {
        (Error::Analysis(message), Some(failure)) => {
            let steps = analysis.counts.steps;
            let diagnosis = diagnosis::explain(world, scene, &analysis.model, steps, failure);
            Error::Analysis(message + &diagnosis)
        }
        (error, _) => error,
    });
    let outcome = match outcome {
        // Another failure than these may come from the disk, and leaves the last checkpoint alone.
        Ok(()) | Err(Error::Analysis(_) | Error::Interrupted(_) | Error::Memory(_)) => {
            let saved = recorder.checkpoint(&analysis.model, analysis.state());
            saved.and(outcome)
        }
        failed => failed,
    };
    let finished = recorder.finish(&analysis.model);
    let outcome = outcome.and(finished);
    // What failed first is told, whatever fails after it.
    let concluded = conclude(job, &session, &analysis, &outcome, built.warnings, &mut recorder);
    outcome.and(concluded)
}

/// Collective. Tells how a run ended: to the user, in `summary.json` and in the report.
fn conclude<C: Fields<D, N>, const D: usize, const N: usize>(
    job: &Job<'_>,
    session: &Session,
    analysis: &Analysis<C, D, N>,
    outcome: &Result<(), Error>,
    mut warnings: Vec<String>,
    recorder: &mut Recorder<'_>,
) -> Result<(), Error> {
    let Job {
        world, scene, process, ..
    } = *job;
    for option in session.unused_options()? {
        let warning = format!("PETSc did not use the option {option}");
        recorder.message(&format!("warning: {warning}"));
        warnings.push(warning);
    }
    if let Some(warning) = facts::overhang_warning(analysis.counts.largest_overhang) {
        recorder.message(&format!("warning: {warning}"));
        warnings.push(warning);
    }
    if let Some(note) = facts::round_off_note(&analysis.counts) {
        recorder.message(&note);
    }
    let (spent, clock) = (recorder.spent_before(), &process.clock);
    let points = recorder.points();
    let mut summary = facts::summarise(world, session, scene, points, analysis, outcome, &spent, clock)?;
    if let (Some(manufactured), Ok(())) = (&scene.manufactured, outcome) {
        summary.errors = facts::manufactured_errors(world, manufactured, analysis);
        for (name, value) in &summary.errors {
            recorder.message(&format!("{name} {value:.6e}"));
        }
    }
    summary.warnings = warnings;
    recorder.summary(&summary)?;
    let mut page = None;
    if scene.output.report {
        page = recorder.report();
        // The report is drawn from a summary that is complete but for the time that drawing takes. A disk that the
        // report filled leaves that one.
        facts::take_times(world, session, &mut summary, &spent, clock)?;
        if let Err(error) = recorder.summary(&summary) {
            recorder.message(&format!(
                "warning: the time of the report is missing in the summary: {error}"
            ));
        }
    }
    recorder.ending(&summary, page.as_deref());
    Ok(())
}

fn partitioner(kind: PartitionerKind) -> Partitioner {
    match kind {
        PartitionerKind::Auto => Partitioner::Auto,
        PartitionerKind::Metis => Partitioner::Metis,
        PartitionerKind::PtScotch => Partitioner::PtScotch,
        PartitionerKind::ParMetis => Partitioner::ParMetis,
    }
}
