//! The analysis: stages, steps, attempts. A failed attempt leaves no trace in the points.

use super::arc_length::{LengthStep, try_length};
use super::attempt::{Approach, Solution, Solver, Tried, external_forces, pressure_forces, try_step};
use super::balance::{LARGEST_IMBALANCE, imbalance, share_points};
use super::convergence::IterationRecord;
use super::equilibrium::{Equilibrium, Scales, Watch, has_damage};
use super::failure::Failure;
use super::path::{Goal, Reached, Review};
use super::patience::Patience;
use super::round_off::RoundOff;
use super::settings::{SolverMethod, SolverSettings, Stage};
use super::state::AnalysisState;
use super::steps::Steps;
use crate::assembly::balance::Balance;
use crate::assembly::model::{Model, StepSystem};
use crate::assembly::motion::{Measure, PathPoints};
use crate::clock::{Clock, Phase};
use crate::condition::Time;
use crate::condition::dirichlet::prescribe;
use crate::condition::weak::prescribe_platens;
use crate::continuum::Fields;
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::parallel::World;
use crate::petsc::{BlockMatrix, Layout, Newton, NewtonOptions, Partitioner, PetscInt, Session};
use crate::points::search::Misplaced;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// The points are shared anew only where that improves on what the last partition could reach.
const WORTHWHILE: f64 = 1.05;

/// What is told of an attempt at a step.
pub struct Attempt<'a> {
    /// Number of the step that is attempted, from 1.
    pub step: usize,
    pub stage: &'a Stage,
    /// Size of the step, in words.
    pub size: &'a str,
    pub records: &'a [IterationRecord],
    /// Why the attempt failed; `None` where it was accepted.
    pub failure: Option<&'a str>,
}

/// What is told of an accepted step.
pub struct Accepted<'a, C: Fields<D, N>, const D: usize, const N: usize> {
    pub step: usize,
    pub stage: &'a Stage,
    pub time: Time,
    /// How far the stage has come, 0 to 1, never less than before.
    pub share: f64,
    /// Change of the load factor.
    pub step_size: f64,
    /// Linear solves, the opening one included.
    pub newton_iterations: usize,
    pub force_residual: f64,
    pub model: &'a Model<C, D, N>,
    /// What a later run needs beside the model to go on from here.
    pub state: &'a AnalysisState,
    /// Sum of the support's forces for each boundary, by component.
    pub reactions: &'a [[f64; N]],
    /// Whether the step ended a full step of the stage.
    pub full_step: bool,
    /// How the path of the stage came to its end, in words, where it did.
    pub ending: Option<&'a str>,
    /// Whether the analysis ends here.
    pub last: bool,
}

/// Who is told of the progress of an analysis. Calls are collective.
pub trait Observer<C: Fields<D, N>, const D: usize, const N: usize> {
    /// An attempt at a step begins.
    fn begins(&mut self, step: usize, stage: &Stage);
    fn attempted(&mut self, attempt: &Attempt<'_>) -> Result<(), Error>;
    fn accepted(&mut self, step: &Accepted<'_, C, D, N>) -> Result<(), Error>;
}

/// Counts of an analysis, for its summary.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    pub steps: usize,
    pub attempts: usize,
    pub newton_iterations: usize,
    /// Accepted steps that converged to round-off rather than to the tolerance.
    pub steps_at_round_off: usize,
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
    pub balance: Balance<C, D, N>,
    settings: SolverSettings,
    partitioner: Partitioner,
    solver: Option<Solver>,
    /// Where the last accepted step left the analysis.
    state: AnalysisState,
    /// Counts until now, failed attempts since the last accepted step included.
    pub counts: Counts,
    /// Why the last attempt failed, where no equilibrium was found.
    pub defeat: Option<Failure>,
    interrupt: Interrupt,
    watch: Option<Box<Watch>>,
    clock: Rc<Clock>,
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Analysis<C, D, N> {
    /// An analysis that goes on from a state that belongs to the model.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        world: &World,
        session: &Rc<Session>,
        model: Model<C, D, N>,
        settings: SolverSettings,
        partitioner: Partitioner,
        state: AnalysisState,
        interrupt: &Interrupt,
        clock: &Rc<Clock>,
    ) -> Self {
        Self {
            world: world.clone(),
            session: session.clone(),
            model,
            balance: Balance::new(clock.clone()),
            settings,
            partitioner,
            solver: None,
            counts: state.counts.clone(),
            defeat: None,
            state,
            interrupt: interrupt.clone(),
            watch: None,
            clock: clock.clone(),
        }
    }

    /// Tells of the iterations on this rank from here on. What is told must neither take long nor wait for other ranks.
    pub fn watch(&mut self, watch: impl Fn(usize, f64) + 'static) {
        self.watch = Some(Box::new(watch));
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

    /// Where the last accepted step left the analysis; it belongs to the model as it is.
    pub fn state(&self) -> &AnalysisState {
        &self.state
    }

    /// Collective. Runs all stages from where the analysis stands.
    ///
    /// # Errors
    /// `Analysis` when a step fails at its smallest size or a point leaves the grid; `Interrupted` when a signal asked a
    /// rank to stop, with the model in its last accepted state; what observers and libraries report.
    pub fn run(&mut self, stages: &[Stage], observer: &mut dyn Observer<C, D, N>) -> Result<(), Error> {
        for (index, stage) in stages.iter().enumerate().skip(self.state.stage) {
            let mut steps = if index == self.state.stage {
                self.state.steps.clone()
            } else {
                Steps::new(index, stage)
            };
            while steps.next_goal().is_some() {
                if self.world.any(self.interrupt.requested()) {
                    return Err(self.interrupted());
                }
                let system = self.search(index)?;
                let solution = self.solve_step(&system, stage, &mut steps, observer)?;
                let last = index + 1 == stages.len() && steps.next_goal().is_none();
                self.accept(&system, stage, &steps, solution, last, observer)?;
            }
        }
        Ok(())
    }

    /// Gives up an iterative linear solver that was not asked for. Returns whether there was one.
    fn change_to_direct(&mut self) -> Result<bool, Error> {
        let changed = self.settings.method == SolverMethod::Auto && self.session.fall_back_to_direct()?;
        if changed {
            self.solver = None;
        }
        Ok(changed)
    }

    /// Attempts the next step of a stage until one is solved: by one approach after the other, then with half the step.
    /// Moves the steps on.
    fn solve_step(
        &mut self,
        system: &StepSystem<D>,
        stage: &Stage,
        steps: &mut Steps,
        observer: &mut dyn Observer<C, D, N>,
    ) -> Result<Solution, Error> {
        let step = self.counts.steps + 1;
        let mut approach = Approach::FIRST;
        let mut patience = Patience::default();
        loop {
            let goal = steps.next_goal().expect("the stage is not done");
            observer.begins(step, stage);
            let Tried {
                end,
                records,
                interrupted,
            } = self.attempt(system, steps, goal, approach)?;
            if interrupted && end.is_err() {
                return Err(self.interrupted());
            }
            let reached = end.as_ref().ok().and_then(|end| self.reached(system, steps, goal, end));
            let review = steps.review(reached.as_ref());
            let end = end.and_then(|solution| accepted(solution, &review));
            let failure = end.as_ref().err().map(|failure| failure.reason.as_str());
            observer.attempted(&Attempt {
                step,
                stage,
                size: &steps.describe_size(),
                records: &records,
                failure,
            })?;
            match end {
                Ok(solution) => {
                    steps.accept(solution.iterations, reached.as_ref());
                    return Ok(solution);
                }
                Err(_) if review == Review::Close => {
                    approach = Approach::FIRST;
                    steps.close();
                }
                Err(Failure { linear: true, .. }) if self.change_to_direct()? => {}
                Err(failure) => {
                    patience.note(&failure, steps.halvings_left());
                    let next = approach.next(&failure);
                    approach = next.unwrap_or(Approach::FIRST);
                    if next.is_none()
                        && let Some(end) = no_smaller_step(&failure, steps, &mut patience)
                    {
                        let stage = &stage.name;
                        let message = format!("stage {stage}, step {step}: {end}: {}", failure.reason);
                        self.defeat = Some(failure);
                        return Err(Error::Analysis(message));
                    }
                }
            }
        }
    }

    /// Makes a solution the accepted state and tells the observer.
    fn accept(
        &mut self,
        system: &StepSystem<D>,
        stage: &Stage,
        steps: &Steps,
        solution: Solution,
        last: bool,
        observer: &mut dyn Observer<C, D, N>,
    ) -> Result<(), Error> {
        let acting = self.model.surface.acting(steps.done());
        self.model.accept_gaps(system, &acting, &solution.increments);
        let mut platens = self.model.platen_forces(&acting);
        self.model.accept(
            &self.world,
            &mut self.balance.points,
            &system.batches,
            &system.active,
            &solution.increments,
        );
        self.model.follow(steps.start(), steps.done());
        self.counts.steps += 1;
        self.counts.steps_at_round_off += usize::from(solution.at_round_off);
        self.state = AnalysisState {
            stage: steps.done().stage,
            steps: steps.clone(),
            counts: self.counts.clone(),
            peak_force: self.state.peak_force.max(solution.force_scale),
            achieved_balance: self.state.achieved_balance,
        };
        let reactions = self.boundary_reactions(system, &solution.reactions, &mut platens);
        observer.accepted(&Accepted {
            step: self.counts.steps,
            stage,
            time: steps.done(),
            share: steps.share(),
            step_size: steps.last_size(),
            newton_iterations: solution.iterations,
            force_residual: solution.force_residual,
            model: &self.model,
            state: &self.state,
            reactions: &reactions,
            full_step: steps.at_full_step(),
            ending: steps.describe_ending().as_deref(),
            last,
        })
    }

    /// Brings every point to the rank of its cell, shares the points anew where they are badly spread, and finds what
    /// they see of the grid in a stage.
    fn search(&mut self, stage: usize) -> Result<StepSystem<D>, Error> {
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
            let achieved = self.state.achieved_balance;
            if achieved.is_none_or(|achieved| now > LARGEST_IMBALANCE && now > WORTHWHILE * achieved) {
                let Model { grid, points, .. } = &mut self.model;
                share_points(&self.session, &world, grid, self.partitioner, points, &cells)?;
                self.state.achieved_balance = Some(imbalance(&world, points.len()));
            }
        }
        let system = self
            .model
            .search(&world, stage)
            .map_err(|misplaced| lost(steps, misplaced))?;
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
        let options = NewtonOptions {
            max_iterations: self.settings.max_iterations,
            redundant_entries: self.settings.repeatable.redundant_entries(),
            // Rows of damage are a field equation, whose diagonal says nothing about its coupling to forces.
            scaled_by_diagonal: !has_damage::<C, D, N>(),
        };
        // A new solver for a new pattern: preconditioners of several levels keep sizes that a reset does not clear.
        let newton = Newton::new(&self.session, &layout, matrix, &options)?;
        self.solver = Some(Solver {
            newton,
            layout,
            active: active.clone(),
        });
        Ok(())
    }

    /// How a run ends that a signal asked to stop.
    fn interrupted(&self) -> Error {
        let step = self.state.counts.steps;
        Error::Interrupted(format!(
            "stopped by a signal after step {step}; --restart goes on from there"
        ))
    }

    /// What a solved step has reached, where the stage follows its path.
    fn reached(&self, system: &StepSystem<D>, steps: &Steps, goal: Goal, solution: &Solution) -> Option<Reached> {
        let (Steps::Path(_), Some(chosen)) = (steps, self.model.path_points) else {
            return None;
        };
        let (world, points) = (&self.world, &self.model.points);
        let measure = Measure::new(world, chosen, points);
        let motion = measure.of_increments::<C, D, N>(&system.batches, &system.active, &solution.increments);
        let mut displacement = measure.of(&points.displacement);
        displacement.add(1.0, &motion);
        let asked = match goal {
            Goal::Time(time) => time.fraction,
            Goal::Length(_) => steps.done().fraction,
        };
        Some(Reached {
            load_factor: solution.load_factor.unwrap_or(asked),
            length: motion.length(world),
            displacement: displacement.length(world),
        })
    }

    /// One attempt at a step from the accepted state.
    fn attempt(
        &mut self,
        system: &StepSystem<D>,
        steps: &Steps,
        goal: Goal,
        approach: Approach,
    ) -> Result<Tried, Error> {
        let clock = self.clock.clone();
        let searching = clock.enter(Phase::Search);
        self.prepare_solver(system)?;
        let from = steps.done();
        // What else than loads grows over a stage that follows its path is ruled out by the check of the scene.
        let to = match goal {
            Goal::Time(to) => to,
            Goal::Length(_) => from,
        };
        let nodes = &system.active.nodes;
        let mut prescribed = prescribe(&self.model.boundaries, self.model.initial_nodes(), nodes, N, from, to);
        let acting = self.model.surface.acting(to);
        prescribe_platens(&acting.ties, nodes, N, from, to, &mut prescribed);
        let path = match goal {
            Goal::Time(_) => None,
            Goal::Length(length) => Some(self.length_step(system, steps, length, approach)?),
        };
        let solver = self.solver.as_mut().expect("the solver was prepared");
        let external = external_forces(&self.session, &solver.layout, &self.model, system, to)?;
        let scales = Scales {
            pushed: pressure_forces(&self.session, &solver.layout, &self.model, system, &acting)?,
            round_off: RoundOff::of(&self.session, &solver.layout, &self.model, system, &acting)?,
        };
        drop(searching);
        let _solving = clock.enter(Phase::Solve);
        solver.choose(approach.search)?;
        let mut problem = Equilibrium::new(
            &self.world,
            &mut self.model,
            &mut self.balance,
            system,
            &prescribed,
            &acting,
            external,
            &scales,
            &self.settings,
            self.state.peak_force,
            &self.interrupt,
        );
        problem.watch = self.watch.as_deref();
        let tried = match &path {
            Some(step) => try_length(&self.session, solver, problem, step)?,
            None => try_step(&self.session, solver, problem, approach.opening)?,
        };
        self.counts.attempts += 1;
        self.counts.newton_iterations += tried.records.len();
        self.counts.nonzeros = solver.newton.matrix().nonzeros()?;
        Ok(tried)
    }

    /// What a step of given length needs beside its problem.
    fn length_step(
        &self,
        system: &StepSystem<D>,
        steps: &Steps,
        length: f64,
        approach: Approach,
    ) -> Result<LengthStep, Error> {
        let solver = self.solver.as_ref().expect("the solver was prepared");
        let at = |fraction| {
            let stage = steps.done().stage;
            external_forces(
                &self.session,
                &solver.layout,
                &self.model,
                system,
                Time { stage, fraction },
            )
        };
        let (fixed, full) = (at(0.0)?, at(1.0)?);
        let points = &self.model.points;
        let chosen = self.model.path_points.unwrap_or(PathPoints { bit: None });
        let measure = Measure::new(&self.world, chosen, points);
        Ok(LengthStep {
            growing: full.iter().zip(&fixed).map(|(full, fixed)| full - fixed).collect(),
            fixed,
            start: steps.done().fraction,
            length,
            before: steps.has_direction().then(|| measure.of(&points.last_motion)),
            measure,
            approach,
        })
    }

    /// Forces of the supports on each boundary's nodes, from the reactions on own unknowns, or on its points, where
    /// `platens` has this rank's part.
    fn boundary_reactions(&self, system: &StepSystem<D>, reactions: &[f64], platens: &mut [[f64; N]]) -> Vec<[f64; N]> {
        let active = &system.active;
        let sums = platens.as_flattened_mut();
        for (boundary, sums) in self.model.boundaries.iter().zip(sums.chunks_exact_mut(N)) {
            let Some(place) = boundary.nodes() else { continue };
            for (&key, own) in active.nodes[..active.owned].iter().zip(reactions.chunks_exact(N)) {
                if place.holds(self.model.initial_nodes(), key) {
                    sums.iter_mut().zip(own).for_each(|(sum, reaction)| *sum += reaction);
                }
            }
        }
        self.world.sum_slice(sums);
        platens.to_vec()
    }
}

/// Halves a step, or says why there is no smaller one to try.
fn no_smaller_step(failure: &Failure, steps: &mut Steps, patience: &mut Patience) -> Option<String> {
    let size = steps.describe_next();
    if !failure.smaller_might_do {
        return Some(format!(
            "no equilibrium, and no smaller step would help; this one is {size}"
        ));
    }
    if let Some(sizes) = patience.exhausted() {
        return Some(format!(
            "no equilibrium: the step fails in the same way at {sizes} sizes in succession, the last {size}"
        ));
    }
    (!steps.cut()).then(|| format!("no equilibrium with the smallest step, {size}"))
}

/// A solution that is kept, or why it is not.
fn accepted(solution: Solution, review: &Review) -> Result<Solution, Failure> {
    let reason = match review {
        Review::Accept => return Ok(solution),
        Review::Close => "it goes beyond the full load; a step to exactly there takes its place",
        Review::Refuse(reason) => reason,
    };
    Err(Failure::plain(reason.to_owned()))
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
