//! What is told of a run at its start and its end.

use super::build::Built;
use super::checkpoint::Spent;
use crate::clock::{Clock, PhaseSeconds};
use crate::console;
use crate::continuum::Fields;
use crate::error::Error;
use crate::output::process;
use crate::output::progress::{Progress, RunHeader};
use crate::output::summary::{Status, Summary};
use crate::parallel::World;
use crate::petsc::Session;
use crate::scene::Scene;
use crate::solve::step::{Analysis, Counts};
use crate::verification::{Manufactured, Solution, errors};
use std::collections::BTreeMap;

/// Overhang of domains over the grid from which on it is worth a warning [cell].
const NOTABLE_OVERHANG: f64 = 1.0e-2;

/// Versions of the program and of the libraries in use.
pub fn versions(petsc: &str) -> Vec<(&'static str, String)> {
    vec![
        ("PETSc", petsc.to_owned()),
        ("MPI", crate::version::mpi()),
        ("HDF5", crate::version::hdf5()),
    ]
}

/// Prints what is run, with what.
pub fn print_header<C: Fields<D, N>, const D: usize, const N: usize>(
    progress: &mut Progress,
    world: &World,
    scene: &Scene,
    built: &Built<C, D, N>,
    session: &Session,
) {
    progress.header(&RunHeader {
        version: crate::version::PROGRAM,
        commit: crate::version::COMMIT,
        libraries: &versions(session.version()),
        title: &console::shown(&scene.title),
        points: built.points,
        dofs: (built.nodes * N) as u64,
        ranks: world.size(),
    });
    for warning in &built.warnings {
        progress.message(&format!("warning: {warning}"));
    }
}

/// What the user is told of domains that stuck out of the grid, by up to so many cells.
pub fn overhang_warning(cells: f64) -> Option<String> {
    let most = crate::points::search::LARGEST_OVERHANG;
    (cells >= NOTABLE_OVERHANG)
        .then(|| format!("domains stuck out of the grid by up to {cells:.1e} of a cell ({most:.0e} is the most)"))
}

/// What the user is told of steps that came down to round-off before they came below the tolerance.
pub fn round_off_note(counts: &Counts) -> Option<String> {
    (counts.steps_at_round_off > 0).then(|| {
        format!(
            "{} of {} steps came down to round-off before solver.force_tolerance: their forces are small beside the moduli \
             (docs/stability.md, Round-off)",
            counts.steps_at_round_off, counts.steps
        )
    })
}

/// Collective. Counts, times and memory of a run that has ended; `earlier` is what parts before a restart used.
#[allow(clippy::too_many_arguments)]
pub fn summarise<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    session: &Session,
    scene: &Scene,
    points: u64,
    analysis: &Analysis<C, D, N>,
    outcome: &Result<(), Error>,
    earlier: &Spent,
    clock: &Clock,
) -> Result<Summary, Error> {
    let counts = &analysis.counts;
    let (status, exit_code, message) = match outcome {
        Ok(()) => (Status::Completed, 0, None),
        Err(error @ Error::Analysis(_)) => (Status::Stopped, error.exit_code(), Some(error.to_string())),
        Err(error @ Error::Interrupted(_)) => (Status::Interrupted, error.exit_code(), Some(error.to_string())),
        Err(error) => (Status::Failed, error.exit_code(), Some(error.to_string())),
    };
    let mut versions: BTreeMap<String, String> = versions(session.version())
        .into_iter()
        .map(|(name, version)| (name.to_lowercase(), version))
        .collect();
    versions.insert("mpm-petsc".into(), crate::version::PROGRAM.into());
    versions.insert("commit".into(), crate::version::COMMIT.into());
    let peak_memory_mb = world.all_gather(process::peak_memory_mb().unwrap_or(f64::NAN));
    let mut summary = Summary {
        status,
        exit_code,
        message,
        title: scene.title.clone(),
        warnings: Vec::new(),
        ranks: world.size(),
        points,
        active_cells: counts.active_cells,
        dofs: (counts.nodes * N) as u64,
        nonzeros: counts.nonzeros,
        largest_overhang: counts.largest_overhang,
        steps: counts.steps,
        attempts: counts.attempts,
        newton_iterations: counts.newton_iterations,
        steps_at_round_off: counts.steps_at_round_off,
        wall_seconds: 0.0,
        cpu_seconds: 0.0,
        phases: PhaseSeconds::default(),
        peak_memory_mb,
        partitioner: if world.size() > 1 {
            analysis.partitioner().to_string()
        } else {
            "none".into()
        },
        errors: BTreeMap::new(),
        ordering: analysis.ordering()?,
        versions,
    };
    take_times(world, session, &mut summary, earlier, clock)?;
    Ok(summary)
}

/// Collective. Puts the times until now into a summary.
pub fn take_times(
    world: &World,
    session: &Session,
    summary: &mut Summary,
    earlier: &Spent,
    clock: &Clock,
) -> Result<(), Error> {
    summary.cpu_seconds = earlier.cpu_seconds + world.sum(process::cpu_seconds());
    summary.phases = phases(session, clock)?.plus(&earlier.phases);
    summary.wall_seconds = summary.phases.total();
    Ok(())
}

/// Collective. Error norms of the accepted state against a manufactured solution, by their names in the summary.
pub fn manufactured_errors<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    manufactured: &Manufactured,
    analysis: &Analysis<C, D, N>,
) -> BTreeMap<&'static str, f64> {
    let errors = errors(world, &analysis.model.points, &Solution::new(manufactured, D));
    BTreeMap::from([
        ("error_u", errors.displacement),
        ("error_theta", errors.rotation),
        ("error_sigma", errors.stress),
        ("error_mu", errors.couple_stress),
    ])
}

/// Time split of the root. The clock counts all of PETSc's own work as `solve`; PETSc knows how much of it was set-up.
fn phases(session: &Session, clock: &Clock) -> Result<PhaseSeconds, Error> {
    let mut phases = clock.seconds();
    let factorise = session.phase_seconds()?.factorisation.min(phases.solve);
    phases.factorise += factorise;
    phases.solve -= factorise;
    Ok(phases)
}
