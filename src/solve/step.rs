//! The analysis: stages, steps, attempts. A failed attempt leaves no trace in the points.

use super::balance::{LARGEST_IMBALANCE, imbalance, share_points};
use super::convergence::IterationRecord;
use super::equilibrium::Equilibrium;
use super::model::{Model, StepSystem};
use super::schedule::Schedule;
use crate::assembly::active::Active;
use crate::assembly::kernel::Workspace;
use crate::clock::{Clock, Phase};
use crate::condition::Time;
use crate::condition::dirichlet::prescribe;
use crate::condition::load::add_external_forces;
use crate::continuum::Fields;
use crate::error::Error;
use crate::parallel::World;
use crate::petsc::{
    BlockMatrix, End, Evaluate, GhostVector, Layout, Newton, NewtonOptions, Nonlinear, Partitioner, PetscInt, Session,
};
use crate::points::search::Misplaced;
use crate::scene::{SolverSettings, Stage};
use std::rc::Rc;

/// The points are shared anew only where that improves on what the last partition could reach.
const WORTHWHILE: f64 = 1.05;

/// What is told of an attempt at a step.
pub struct Attempt<'a> {
    /// Number of the step that is attempted, from 1.
    pub step: usize,
    /// Number of this attempt in the whole analysis, from 1.
    pub attempt: usize,
    pub stage: &'a Stage,
    pub from: Time,
    pub to: Time,
    pub records: &'a [IterationRecord],
    /// Why the attempt failed; `None` where it was accepted.
    pub failure: Option<&'a str>,
}

/// What is told of an accepted step.
pub struct Accepted<'a, C: Fields<D, N>, const D: usize, const N: usize> {
    pub step: usize,
    pub stage: &'a Stage,
    pub time: Time,
    /// Share of the stage.
    pub step_size: f64,
    /// Linear solves, the opening one included.
    pub newton_iterations: usize,
    pub force_residual: f64,
    pub model: &'a Model<C, D, N>,
    /// Sum of the support's forces for each boundary, by component.
    pub reactions: &'a [[f64; N]],
    /// Whether the step ended a full step of the stage.
    pub full_step: bool,
    /// Whether the analysis ends here.
    pub last: bool,
}

/// Who is told of the progress of an analysis. Calls are collective.
pub trait Observer<C: Fields<D, N>, const D: usize, const N: usize> {
    fn attempted(&mut self, attempt: &Attempt<'_>) -> Result<(), Error>;
    fn accepted(&mut self, step: &Accepted<'_, C, D, N>) -> Result<(), Error>;
}

/// Counts of an analysis, for its summary.
#[derive(Clone, Debug, Default)]
pub struct Counts {
    pub steps: usize,
    pub attempts: usize,
    pub newton_iterations: usize,
    pub active_cells: u64,
    pub nodes: usize,
    pub nonzeros: u64,
    pub largest_overhang: f64,
}

/// A quasi-static analysis.
pub struct Analysis<C: Fields<D, N>, const D: usize, const N: usize> {
    world: World,
    session: Rc<Session>,
    pub model: Model<C, D, N>,
    pub workspace: Workspace<C, D, N>,
    settings: SolverSettings,
    partitioner: Partitioner,
    solver: Option<Solver>,
    peak_force: f64,
    /// Imbalance that the last partition left.
    achieved_balance: f64,
    pub counts: Counts,
    clock: Rc<Clock>,
}

/// The solver with the pattern it was made for.
struct Solver {
    newton: Newton,
    layout: Layout,
    active: Active,
}

/// How an attempt ended.
enum AttemptEnd {
    Converged {
        iterations: usize,
        force_residual: f64,
        reactions: Vec<f64>,
        increments: Vec<f64>,
    },
    Failed(String),
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Analysis<C, D, N> {
    pub fn new(
        world: &World,
        session: &Rc<Session>,
        model: Model<C, D, N>,
        settings: SolverSettings,
        partitioner: Partitioner,
        clock: &Rc<Clock>,
    ) -> Self {
        Self {
            world: world.clone(),
            session: session.clone(),
            model,
            workspace: Workspace::new(clock.clone()),
            settings,
            partitioner,
            solver: None,
            peak_force: 0.0,
            achieved_balance: f64::INFINITY,
            counts: Counts::default(),
            clock: clock.clone(),
        }
    }

    /// How cells are shared among the ranks.
    pub fn partitioner(&self) -> Partitioner {
        self.partitioner
    }

    /// Fill-reducing ordering of the last factorisation, in words; empty before the first.
    pub fn ordering(&self) -> Result<String, Error> {
        Ok(match &self.solver {
            Some(solver) => solver.newton.ordering_used()?,
            None => String::new(),
        })
    }

    /// Collective. Runs all stages.
    ///
    /// # Errors
    /// `Analysis` when a step fails at its smallest size or a point leaves the grid; what observers and libraries report.
    pub fn run(&mut self, stages: &[Stage], observer: &mut dyn Observer<C, D, N>) -> Result<(), Error> {
        let mut system = self.search()?;
        for (index, stage) in stages.iter().enumerate() {
            let mut schedule = Schedule::new(index, stage.steps, stage.max_halvings);
            while let Some((from, to)) = schedule.next_step() {
                let (end, records) = self.attempt(&system, from, to)?;
                self.counts.attempts += 1;
                self.counts.newton_iterations += records.len();
                let failure = match &end {
                    AttemptEnd::Converged { .. } => None,
                    AttemptEnd::Failed(reason) => Some(reason.as_str()),
                };
                let step = self.counts.steps + 1;
                let attempt = self.counts.attempts;
                observer.attempted(&Attempt {
                    step,
                    attempt,
                    stage,
                    from,
                    to,
                    records: &records,
                    failure,
                })?;
                match end {
                    AttemptEnd::Converged {
                        iterations,
                        force_residual,
                        reactions,
                        increments,
                    } => {
                        self.model
                            .accept(&mut self.workspace, &system.batches, &system.active, &increments);
                        self.counts.steps = step;
                        let reactions = self.boundary_reactions(&system, &reactions);
                        let step_size = schedule.step_size();
                        schedule.accept();
                        let last = index + 1 == stages.len() && schedule.next_step().is_none();
                        observer.accepted(&Accepted {
                            step,
                            stage,
                            time: to,
                            step_size,
                            newton_iterations: iterations,
                            force_residual,
                            model: &self.model,
                            reactions: &reactions,
                            full_step: schedule.at_full_step(),
                            last,
                        })?;
                        if !last {
                            system = self.search()?;
                        }
                    }
                    AttemptEnd::Failed(reason) => {
                        if !schedule.cut() {
                            return Err(Error::Analysis(format!(
                                "stage {}, step {step}: no equilibrium with the smallest step, {:.3e} of the stage \
                                 after {:.6}: {reason}",
                                stage.name,
                                schedule.step_size(),
                                from.fraction
                            )));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Brings every point to the rank of its cell, shares the points anew where they are badly spread, and finds what
    /// they see of the grid.
    fn search(&mut self) -> Result<StepSystem<D>, Error> {
        let clock = self.clock.clone();
        let _searching = clock.enter(Phase::Search);
        let steps = self.counts.steps;
        let world = self.world.clone();
        let cells = self
            .model
            .gather_cells(&world)
            .map_err(|misplaced| lost(steps, misplaced))?;
        if world.size() > 1 {
            let now = imbalance(&world, self.model.points.len());
            let worse = now > LARGEST_IMBALANCE && now > WORTHWHILE * self.achieved_balance;
            if worse || self.achieved_balance.is_infinite() {
                let Model { grid, points, .. } = &mut self.model;
                share_points(&self.session, &world, grid, self.partitioner, points, &cells)?;
                self.achieved_balance = imbalance(&world, points.len());
            }
        }
        let system = self.model.search(&world).map_err(|misplaced| lost(steps, misplaced))?;
        self.counts.largest_overhang = self.counts.largest_overhang.max(world.max_of(system.batches.overhang));
        self.counts.nodes = system.active.total;
        self.counts.active_cells = system.active_cells;
        Ok(system)
    }

    /// Makes solver and matrix fit the active nodes; keeps them where the pattern stands.
    fn prepare_solver(&mut self, system: &StepSystem<D>) -> Result<(), Error> {
        let fits = self
            .solver
            .as_ref()
            .is_some_and(|solver| solver.active.has_pattern_of(&system.active));
        if self.world.all_ok(fits) {
            return Ok(());
        }
        let active = &system.active;
        let layout = Layout {
            block: N,
            owned: active.owned,
            first: active.first,
            ghosts: petsc_numbers(&active.global[active.owned..]),
        };
        let (own, other) = (petsc_numbers(&active.own_blocks), petsc_numbers(&active.other_blocks));
        let format = self.session.matrix_format()?;
        let matrix = BlockMatrix::new(&self.session, format, N, active.owned, &own, &other)?;
        match &mut self.solver {
            Some(solver) => {
                solver.newton.rebuild(&layout, matrix)?;
                solver.layout = layout;
                solver.active = active.clone();
            }
            None => {
                let options = NewtonOptions {
                    max_iterations: self.settings.max_iterations,
                };
                let newton = Newton::new(&self.session, &layout, matrix, &options)?;
                self.solver = Some(Solver {
                    newton,
                    layout,
                    active: active.clone(),
                });
            }
        }
        Ok(())
    }

    /// One attempt at a step from the accepted state.
    fn attempt(
        &mut self,
        system: &StepSystem<D>,
        from: Time,
        to: Time,
    ) -> Result<(AttemptEnd, Vec<IterationRecord>), Error> {
        let clock = self.clock.clone();
        let searching = clock.enter(Phase::Search);
        self.prepare_solver(system)?;
        let active = &system.active;
        let prescribed = prescribe(&self.model.boundaries, &self.model.grid, &active.nodes, N, from, to);
        let solver = self.solver.as_mut().expect("the solver was prepared");
        let external = external_forces(&self.session, &solver.layout, &self.model, system, to)?;
        drop(searching);
        let _solving = clock.enter(Phase::Solve);
        let mut problem = Equilibrium::new(
            &self.world,
            &mut self.model,
            &mut self.workspace,
            system,
            &prescribed,
            &external,
            &self.settings,
            self.peak_force,
        );
        let opening = open(&self.session, solver, &mut problem)?;
        let mut increments = match opening {
            Ok(increments) => increments,
            Err(reason) => return Ok((AttemptEnd::Failed(reason), problem.records)),
        };
        let outcome = solver.newton.solve(&mut problem, &mut increments)?;
        let end = match outcome.end {
            End::Converged => {
                let local = settle(
                    &self.session,
                    solver,
                    &mut problem,
                    &increments,
                    outcome.evaluated_at_solution,
                )?;
                let record = problem.records.last().expect("a converged step was tested");
                let (iterations, force_residual) = (problem.records.len(), record.force_residual);
                self.peak_force = self.peak_force.max(problem.norms.forces.sqrt());
                let reactions = std::mem::take(&mut problem.reactions);
                AttemptEnd::Converged {
                    iterations,
                    force_residual,
                    reactions,
                    increments: local,
                }
            }
            End::OutOfDomain => AttemptEnd::Failed(describe_failure(&problem)),
            End::NotConverged => AttemptEnd::Failed(outcome.reason),
        };
        let records = problem.records;
        self.counts.nonzeros = solver.newton.matrix().nonzeros()?;
        Ok((end, records))
    }

    /// Forces of the supports on each boundary's nodes.
    fn boundary_reactions(&self, system: &StepSystem<D>, reactions: &[f64]) -> Vec<[f64; N]> {
        let active = &system.active;
        let mut sums = vec![0.0; self.model.boundaries.len() * N];
        for (boundary, sums) in self.model.boundaries.iter().zip(sums.chunks_exact_mut(N)) {
            for (&key, own) in active.nodes[..active.owned].iter().zip(reactions.chunks_exact(N)) {
                if boundary.place.holds(&self.model.grid, &self.model.grid.node(key)) {
                    sums.iter_mut().zip(own).for_each(|(sum, reaction)| *sum += reaction);
                }
            }
        }
        self.world.sum_slice(&mut sums);
        sums.chunks_exact(N)
            .map(|sums| std::array::from_fn(|a| sums[a]))
            .collect()
    }
}

/// Counts and numbers as PETSc has them.
fn petsc_numbers(values: &[usize]) -> Vec<PetscInt> {
    values.iter().map(|&value| value as PetscInt).collect()
}

/// Message for a point that the grid cannot carry after a step.
fn lost(step: usize, misplaced: Misplaced) -> Error {
    let Misplaced { id, what, .. } = misplaced;
    Error::Analysis(format!("after step {step}: point {id}: {what}; enlarge the grid"))
}

/// External forces on own unknowns at a time.
fn external_forces<C: Fields<D, N>, const D: usize, const N: usize>(
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
    forces.add_to_owners()?;
    Ok(forces.owned().to_vec())
}

/// The linear solve that opens a step: `K_ff d = -r_f - K_fc v`, prescribed increments exact.
fn open<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    solver: &mut Solver,
    problem: &mut Equilibrium<'_, C, D, N>,
) -> Result<Result<Vec<f64>, String>, Error> {
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
    let matrix = solver.newton.matrix_mut();
    matrix.zero()?;
    let added = problem.add_tangent(&zero, matrix, Some(lift.local_mut()));
    if let Some(failure) = not_evaluated(added, problem)? {
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
        return Ok(Err(format!("the opening linear solve failed: {}", solved.reason)));
    }
    for (index, value) in increments
        .iter_mut()
        .enumerate()
        .filter(|(index, _)| prescribed.mask[*index])
    {
        *value = prescribed.increment[index];
    }
    Ok(Ok(increments))
}

/// Why an evaluation failed, where that only ends the attempt.
fn not_evaluated<C: Fields<D, N>, const D: usize, const N: usize>(
    result: Result<(), Evaluate>,
    problem: &Equilibrium<'_, C, D, N>,
) -> Result<Option<String>, Error> {
    match result {
        Ok(()) => Ok(None),
        Err(Evaluate::OutOfDomain) => Ok(Some(describe_failure(problem))),
        Err(Evaluate::Failed(message)) => Err(Error::System(message)),
    }
}

/// Local increments of the solution; evaluates there once more unless that was the last evaluation, so that the trial
/// state that becomes the accepted one belongs to the accepted unknowns.
fn settle<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    solver: &Solver,
    problem: &mut Equilibrium<'_, C, D, N>,
    increments: &[f64],
    evaluated: bool,
) -> Result<Vec<f64>, Error> {
    let mut local = GhostVector::new(session, &solver.layout)?;
    local.owned_mut().copy_from_slice(increments);
    local.update_ghosts()?;
    if !evaluated {
        let mut residual = GhostVector::new(session, &solver.layout)?;
        let result = problem.residual(local.local(), residual.local_mut());
        if let Some(failure) = not_evaluated(result, problem)? {
            return Err(Error::System(format!(
                "the converged state cannot be evaluated again: {failure}"
            )));
        }
        residual.add_to_owners()?;
        let mut own = residual.owned().to_vec();
        not_evaluated(problem.complete(&mut own), problem)?;
    }
    Ok(local.local().to_vec())
}

/// What the law said, from the lowest rank where it failed.
fn describe_failure<C: Fields<D, N>, const D: usize, const N: usize>(problem: &Equilibrium<'_, C, D, N>) -> String {
    let world = problem.world;
    let failing = if problem.failure.is_some() {
        world.rank()
    } else {
        world.size()
    };
    let first = world.min_of(failing);
    if first == world.size() {
        return "a point left the domain of its law during the iteration".into();
    }
    let own = problem.failure.as_ref().map_or(String::new(), |failure| {
        format!(
            "point {}: {} (local residual {:.1e})",
            failure.id, failure.what, failure.residual
        )
    });
    world.text_from(first, &own)
}
