//! One attempt at a step: the opening linear solve, Newton's iterations, and a state that belongs to the solution.

use super::convergence::IterationRecord;
use super::equilibrium::Equilibrium;
use super::failure::{Cause, FailedPoint, Failure};
use crate::assembly::active::Active;
use crate::assembly::balance::StepTerms;
use crate::assembly::model::{Model, StepSystem};
use crate::assembly::surface::ActingConditions;
use crate::condition::Time;
use crate::condition::load::{add_external_forces, add_face_forces};
use crate::continuum::{Fields, Linearisation};
use crate::error::Error;
use crate::petsc::{
    BACKTRACKING, End, Evaluate, FULL_STEPS, GhostVector, Layout, LinearOutcome, Newton, Nonlinear, PetscError,
    Session, agree,
};
use std::rc::Rc;

/// The solver with the pattern it was made for.
pub struct Solver {
    pub newton: Newton,
    pub layout: Layout,
    pub active: Active,
}

/// Which line search an attempt uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Full Newton steps unless an option says otherwise.
    Configured,
    /// Backtracking where full steps are configured, full steps otherwise. The norm of the residual is a poor guide
    /// where forces and couples, stiff and soft directions meet: it makes a line search reject steps that are right.
    Other,
}

/// How an attempt goes about a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Approach {
    /// Tangent of the solve that opens the step.
    pub opening: Linearisation,
    pub search: Search,
}

impl Approach {
    /// Points that flowed in the last step are taken to flow on: mostly they do, and the iteration starts close to where
    /// it ends. Under a load near its limit that tangent is almost singular and leads astray.
    pub const FIRST: Self = Self {
        opening: Linearisation::Opening,
        search: Search::Configured,
    };

    /// What to try after a failure, before the step is made smaller.
    pub fn next(self, failure: &Failure) -> Option<Self> {
        if !failure.smaller_might_do {
            None
        } else if failure.flowed_on {
            let opening = Linearisation::Consistent;
            Some(Self { opening, ..self })
        } else if failure.search_matters && self.search == Search::Configured {
            let search = Search::Other;
            Some(Self { search, ..self })
        } else {
            None
        }
    }
}

/// What an attempt came to.
pub struct Tried {
    pub end: Result<Solution, Failure>,
    pub records: Vec<IterationRecord>,
    /// Whether a rank was asked to stop meanwhile; a failure may be due to that alone.
    pub interrupted: bool,
}

/// A solved step, not yet accepted.
pub struct Solution {
    /// Linear solves, the opening one included.
    pub iterations: usize,
    pub force_residual: f64,
    /// Whether only round-off keeps that residual from the tolerance.
    pub at_round_off: bool,
    /// Norm of external forces and reactions.
    pub force_scale: f64,
    /// Reactions on own unknowns, zero where nothing is prescribed.
    pub reactions: Vec<f64>,
    /// Local increments, at which the trial state of the points was evaluated.
    pub increments: Vec<f64>,
    /// Load factor at the end of the step, where it was an unknown.
    pub load_factor: Option<f64>,
}

impl Solver {
    /// Sets the line search of the next solve.
    pub fn choose(&mut self, search: Search) -> Result<(), PetscError> {
        self.newton.use_line_search(None)?;
        if search == Search::Other {
            let configured = self.newton.line_search()?;
            let full = configured.as_bytes() == FULL_STEPS.to_bytes();
            self.newton
                .use_line_search(Some(if full { BACKTRACKING } else { FULL_STEPS }))?;
        }
        Ok(())
    }
}

/// Solves a step from the accepted state of the points, which stays as it is; the solver has its line search already.
pub fn try_step<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    solver: &mut Solver,
    mut problem: Equilibrium<'_, C, D, N>,
    opening: Linearisation,
) -> Result<Tried, Error> {
    let Opened {
        mut increments,
        flowed_on,
    } = match open(session, solver, &mut problem, opening)? {
        Ok(opened) => opened,
        Err(failure) => {
            return Ok(Tried {
                end: Err(failure),
                records: problem.records,
                interrupted: problem.interrupted,
            });
        }
    };
    let outcome = solver.newton.solve(&mut problem, &mut increments)?;
    let end = match outcome.end {
        End::Converged => {
            let evaluated = outcome.evaluated_at_solution;
            Ok(settle(session, solver, &mut problem, &increments, evaluated)?)
        }
        End::OutOfDomain => Err(Failure {
            search_matters: true,
            flowed_on,
            ..Failure::at(FailedPoint::first(&problem))
        }),
        End::Stagnated => Err(stagnated(&problem)),
        End::IterationLimit => Err(Failure {
            flowed_on,
            ..limit_reached(&problem)
        }),
        End::NotConverged => Err(Failure {
            search_matters: true,
            linear: outcome.linear_failure,
            flowed_on,
            ..Failure::plain(outcome.reason)
        }
        .because(match (outcome.singular, outcome.linear_failure) {
            (true, _) => Cause::Singular,
            (false, true) => Cause::Other,
            (false, false) => Cause::Divergence {
                residual: least(&problem.records),
                node: problem.worst_node(),
            },
        })),
    };
    Ok(Tried {
        end,
        records: problem.records,
        interrupted: problem.interrupted,
    })
}

/// External forces on own unknowns at a time.
pub fn external_forces<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    layout: &Layout,
    model: &Model<C, D, N>,
    system: &StepSystem<D>,
    time: Time,
) -> Result<Vec<f64>, Error> {
    let mut forces = GhostVector::new(session, layout)?;
    let nodes = |batch: usize| system.active.batch_nodes(batch);
    add_external_forces(
        &model.loads,
        time,
        &model.points,
        &system.batches,
        nodes,
        forces.local_mut(),
    );
    let own_nodes = &system.active.nodes[..system.active.owned];
    add_face_forces(&model.face_loads, time, own_nodes, forces.local_mut());
    forces.add_to_owners()?;
    Ok(forces.owned().to_vec())
}

/// Forces that pressures put on own unknowns, on the shape at the start of the step.
pub fn pressure_forces<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    layout: &Layout,
    model: &Model<C, D, N>,
    system: &StepSystem<D>,
    acting: &ActingConditions,
) -> Result<Vec<f64>, Error> {
    if acting.pressures.is_empty() {
        return Ok(vec![0.0; layout.owned_length()]);
    }
    let mut forces = GhostVector::new(session, layout)?;
    let surface = StepTerms { system, acting }.surface(model);
    let zero = vec![0.0; layout.local_length()];
    surface.add_pressure_forces(&zero, -1.0, forces.local_mut());
    forces.add_to_owners()?;
    Ok(forces.owned().to_vec())
}

/// Where the linear solve that opens a step leads.
struct Opened {
    /// Increments of own unknowns.
    increments: Vec<f64>,
    /// Whether points flow on in its tangent; the same on every rank.
    flowed_on: bool,
}

/// The linear solve that opens a step: `K_ff d = -r_f - K_fc v`, prescribed increments exact.
fn open<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    solver: &mut Solver,
    problem: &mut Equilibrium<'_, C, D, N>,
    linearisation: Linearisation,
) -> Result<Result<Opened, Failure>, Error> {
    let owned = solver.layout.owned_length();
    let zero = vec![0.0; solver.layout.local_length()];
    let mut residual = GhostVector::new(session, &solver.layout)?;
    let mut lift = GhostVector::new(session, &solver.layout)?;
    let evaluated = problem.residual(&zero, residual.local_mut());
    if let Some(failure) = not_evaluated(evaluated, problem)? {
        return Ok(Err(failure));
    }
    residual.add_to_owners()?;
    let mut right_hand_side = residual.owned().to_vec();
    let completed = problem.complete(&mut right_hand_side);
    if let Some(failure) = not_evaluated(completed, problem)? {
        return Ok(Err(failure));
    }
    if problem.interrupted {
        return Ok(Err(Failure::plain("the run was asked to stop".into())));
    }
    let matrix = solver.newton.matrix_mut();
    matrix.zero()?;
    let added = problem.add_tangent(&zero, linearisation, matrix, Some(lift.local_mut()));
    let flowed_on = problem.world.any(*added.as_ref().unwrap_or(&false));
    if let Some(failure) = not_evaluated(added.map(drop), problem)? {
        return Ok(Err(failure));
    }
    matrix.assemble()?;
    lift.add_to_owners()?;
    let prescribed = problem.prescribed;
    for (index, value) in right_hand_side.iter_mut().enumerate() {
        *value = if prescribed.mask[index] {
            0.0
        } else {
            -(*value + lift.owned()[index])
        };
    }
    let mut increments = vec![0.0; owned];
    let solved = solver.newton.linear_solve(&right_hand_side, &mut increments)?;
    if !solved.converged {
        return Ok(Err(unsolved(&solved, flowed_on)));
    }
    for (index, value) in increments
        .iter_mut()
        .enumerate()
        .filter(|(index, _)| prescribed.mask[*index])
    {
        *value = prescribed.increment[index];
    }
    Ok(Ok(Opened { increments, flowed_on }))
}

/// A linear system at the start of a step that has no solution. Where it is singular and the tangent that of the accepted
/// state, it is so for steps of any size.
fn unsolved(solved: &LinearOutcome, flowed_on: bool) -> Failure {
    Failure {
        cause: if solved.singular { Cause::Singular } else { Cause::Other },
        linear: true,
        smaller_might_do: flowed_on || !solved.singular,
        flowed_on,
        ..Failure::plain(format!("the step cannot be opened: {}", solved.reason))
    }
}

/// Collective. Why an evaluation failed on some rank, where that only ends the attempt.
///
/// # Errors
/// What ends the analysis, with the same message on every rank.
pub(super) fn not_evaluated<C: Fields<D, N>, const D: usize, const N: usize>(
    result: Result<(), Evaluate>,
    problem: &Equilibrium<'_, C, D, N>,
) -> Result<Option<Failure>, Error> {
    match agree(problem.world, result) {
        Ok(()) => Ok(None),
        Err(Evaluate::OutOfDomain) => Ok(Some(Failure::at(FailedPoint::first(problem)))),
        Err(Evaluate::Failed(error)) => Err(error.into()),
    }
}

/// The solution at own increments; evaluates there once more unless that was the last evaluation, so that the trial
/// state that becomes the accepted one belongs to the accepted unknowns.
pub(super) fn settle<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    solver: &Solver,
    problem: &mut Equilibrium<'_, C, D, N>,
    increments: &[f64],
    evaluated: bool,
) -> Result<Solution, Error> {
    let mut local = GhostVector::new(session, &solver.layout)?;
    local.owned_mut().copy_from_slice(increments);
    local.update_ghosts()?;
    if !evaluated {
        let mut residual = GhostVector::new(session, &solver.layout)?;
        let result = problem.residual(local.local(), residual.local_mut());
        if let Some(failure) = not_evaluated(result, problem)? {
            return Err(Error::System(format!(
                "the converged state cannot be evaluated again: {}",
                failure.reason
            )));
        }
        residual.add_to_owners()?;
        let mut own = residual.owned().to_vec();
        not_evaluated(problem.complete(&mut own), problem)?;
    }
    let record = problem.records.last().expect("a converged step was tested");
    Ok(Solution {
        iterations: problem.records.len(),
        force_residual: record.force_residual,
        at_round_off: problem.at_round_off,
        force_scale: problem.norms.forces.sqrt(),
        reactions: std::mem::take(&mut problem.reactions),
        increments: local.local().to_vec(),
        load_factor: None,
    })
}

/// Relative residual up to which one that stays where it is comes of round-off. Neither another line search nor a smaller
/// step changes its level; beside smaller loads it only weighs more. A larger one belongs to a step that led astray.
const LARGEST_ROUND_OFF: f64 = 1.0e-3;

/// Collective. A residual that stays where it is, above the tolerance and above its expected round-off.
pub(super) fn stagnated<C: Fields<D, N>, const D: usize, const N: usize>(
    problem: &Equilibrium<'_, C, D, N>,
) -> Failure {
    let residual = problem.records.last().map_or(f64::NAN, |record| record.force_residual);
    let tolerance = problem.settings.force_tolerance;
    let node = problem.worst_node();
    let place = node.as_ref().map_or("no single place", |node| &node.description);
    Failure {
        search_matters: true,
        smaller_might_do: residual > LARGEST_ROUND_OFF,
        ..Failure::plain(format!(
            "the residual stagnates at {residual:.1e} of the forces, above solver.force_tolerance {tolerance:e}; \
             it is largest at {place}"
        ))
    }
    .because(Cause::Stagnation { residual, node })
}

/// Least relative residual of some iterations.
fn least(records: &[IterationRecord]) -> f64 {
    let residuals = records.iter().map(|record| record.force_residual);
    residuals.fold(f64::INFINITY, f64::min)
}

/// Iterations over which a residual that falls must have fallen.
const FALLING: usize = 3;

/// Collective. An iteration that went on to its limit: that of the scene, unless an option of PETSc holds against it.
pub(super) fn limit_reached<C: Fields<D, N>, const D: usize, const N: usize>(
    problem: &Equilibrium<'_, C, D, N>,
) -> Failure {
    let records = &problem.records;
    let done = records.len().saturating_sub(1);
    let (earlier, last) = records.split_at(records.len() - FALLING.min(done));
    let falling = !earlier.is_empty() && least(last) < 0.5 * least(earlier);
    let name = if done == problem.settings.max_iterations {
        "solver.max_iterations"
    } else {
        "-snes_max_it"
    };
    Failure {
        search_matters: true,
        ..Failure::plain(format!(
            "the iteration did not converge within {name} = {done} (residual {:.1e}, {}; DIVERGED_MAX_IT)",
            records.last().map_or(f64::NAN, |record| record.force_residual),
            if falling { "still falling" } else { "no longer falling" }
        ))
    }
    .because(Cause::IterationLimit {
        falling,
        residual: least(records),
        node: problem.worst_node(),
    })
}
