//! From a scene to results: builds the model, runs the analysis, records it.

mod build;
mod columns;
mod recorder;
mod snapshot;

use crate::assembly::kernel::Workspace;
use crate::clock::{Clock, PhaseSeconds};
use crate::config::Source;
use crate::continuum::Fields;
use crate::continuum::micropolar::Micropolar;
use crate::error::Error;
use crate::material::{Components, Material, micropolar_law, spec::MaterialSpec};
use crate::output::process;
use crate::output::progress::{Mode, Progress};
use crate::output::summary::{Status, Summary};
use crate::parallel::World;
use crate::petsc::{Partitioner, Session};
use crate::scene::{ContinuumKind, Kinematics, PartitionerKind, Scene};
use crate::solve::step::Analysis;
use build::{Built, build};
use recorder::Recorder;
use std::collections::BTreeMap;
use std::rc::Rc;

/// What to do with a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    Run { quiet: bool },
    Check,
}

/// A continuum with laws: what builds a law from its parameters.
pub trait Laws: crate::continuum::Continuum {
    fn law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Self>>;
}

impl Laws for Micropolar {
    fn law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Self>> {
        micropolar_law(spec, components)
    }
}

/// Collective. Checks or runs a scene: the one place that picks continuum and dimension.
///
/// # Errors
/// What is wrong with the scene once it meets the grid, and what ends an analysis early.
pub fn execute(world: &World, scene: &Scene, source: &Source, task: Task, clock: &Rc<Clock>) -> Result<(), Error> {
    match (scene.kinematics, scene.continuum) {
        (Kinematics::PlaneStrain, ContinuumKind::Micropolar) => {
            perform::<Micropolar, 2, 3>(world, scene, source, task, clock)
        }
        (Kinematics::ThreeDimensional, ContinuumKind::Micropolar) => {
            perform::<Micropolar, 3, 6>(world, scene, source, task, clock)
        }
    }
}

fn perform<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    task: Task,
    clock: &Rc<Clock>,
) -> Result<(), Error> {
    let built = build::<C, D, N>(world, scene, source)?;
    match task {
        Task::Check => {
            if world.is_root() {
                print!("{}", built.describe(scene));
            }
            Ok(())
        }
        Task::Run { quiet } => run(world, scene, built, quiet, clock),
    }
}

fn run<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    built: Built<C, D, N>,
    quiet: bool,
    clock: &Rc<Clock>,
) -> Result<(), Error> {
    let session = Session::start(world, &scene.solver.petsc_options)?;
    let partitioner = partitioner(scene.solver.partitioner).resolve(&session)?;
    let mut progress = Progress::on_stdout(Mode::choose(world.is_root(), quiet));
    header(&mut progress, world, scene, &built, session.version());
    for warning in &built.warnings {
        progress.message(&format!("warning: {warning}"));
    }
    let mut recorder = Recorder::create(world, scene, &built, progress, clock)?;
    recorder.initial(&built.model)?;
    let workspace = Workspace::new(clock.clone());
    let mut analysis =
        Analysis::new(world, &session, built.model, workspace, scene.solver.clone(), partitioner, clock);
    let outcome = analysis.run(&scene.stages, &mut recorder);
    let finished = recorder.finish(&analysis.model);
    let outcome = outcome.and(finished);
    let facts = RunFacts {
        title: &scene.title,
        points: recorder.total_points(),
        partitioner: if world.size() > 1 { partitioner.to_string() } else { "none: one rank".into() },
        unused_options: session.unused_options()?,
    };
    let summary = summarise(world, &session, &analysis, facts, &outcome, clock)?;
    recorder.summary(&summary)?;
    outcome
}

fn partitioner(kind: PartitionerKind) -> Partitioner {
    match kind {
        PartitionerKind::Auto => Partitioner::Auto,
        PartitionerKind::Metis => Partitioner::Metis,
        PartitionerKind::PtScotch => Partitioner::PtScotch,
        PartitionerKind::ParMetis => Partitioner::ParMetis,
    }
}
