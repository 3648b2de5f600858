//! The nonlinear problem as PETSc's solver sees it, and how a solve can end.

use std::fmt;

use super::error::PetscError;
use super::matrix::BlockMatrix;
use crate::parallel::World;

/// r(u) = 0 with its derivative. All methods are called on every rank, in the same order.
///
/// A rank that fails must still take part in whatever its own method does collectively; the solver then makes the
/// worst answer of any rank common to all.
pub trait Nonlinear {
    /// Adds this rank's contributions to the residual.
    ///
    /// `u` and `r` hold owned values, then ghosts in the order of the layout; `r` arrives zeroed. What is added to
    /// ghosts is afterwards added to their owners.
    ///
    /// # Errors
    /// [`Evaluate::OutOfDomain`] where r(u) does not exist, so that the line search shortens its step.
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Evaluate>;

    /// Last changes to the owned part of the residual, after all ranks' contributions were added: prescribed unknowns.
    fn complete(&mut self, r: &mut [f64]) -> Result<(), Evaluate>;

    /// Adds this rank's contributions to dr/du at `u`, where the residual was evaluated before.
    ///
    /// The matrix arrives zeroed, and is assembled afterwards.
    ///
    /// # Errors
    /// Only [`Evaluate::Failed`]: the residual exists at `u`, so that [`Evaluate::OutOfDomain`] counts as a failure
    /// too.
    fn jacobian(&mut self, u: &[f64], k: &mut BlockMatrix) -> Result<(), Evaluate>;

    /// Decides whether to go on. The answer must be the same on every rank.
    ///
    /// Replaces all of PETSc's own convergence tests; called before the first iteration and after each.
    fn test(&mut self, iteration: &Iteration<'_>) -> Verdict;
}

/// Why an evaluation gave no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Evaluate {
    /// The function is not defined there: try closer to the last iterate, or give the load step up.
    OutOfDomain,
    /// Nothing that a shorter step could mend: the solve ends with this error.
    Failed(SolveError),
}

impl From<PetscError> for Evaluate {
    fn from(error: PetscError) -> Self {
        Evaluate::Failed(error.into())
    }
}

impl Evaluate {
    /// How bad an answer is; the worst one of any rank counts.
    fn severity(answer: &Result<(), Evaluate>) -> u8 {
        match answer {
            Ok(()) => 0,
            Err(Evaluate::OutOfDomain) => 1,
            Err(Evaluate::Failed(error)) if !error.is_memory() => 2,
            Err(Evaluate::Failed(_)) => 3,
        }
    }
}

/// Collective. Makes the worst answer of any rank common to all, before the next call that all ranks must take part in.
/// An error keeps its kind, and every rank has the message of the lowest rank where it arose.
///
/// # Errors
/// The worst answer.
pub fn agree(world: &World, answer: Result<(), Evaluate>) -> Result<(), Evaluate> {
    let severity = Evaluate::severity(&answer);
    let worst = world.max_of(severity);
    match worst {
        0 => return Ok(()),
        1 => return Err(Evaluate::OutOfDomain),
        _ => {}
    }
    let first = world.first_where(severity == worst).unwrap_or_default();
    let own = match answer {
        Err(Evaluate::Failed(error)) => error.to_string(),
        _ => String::new(),
    };
    let mut message = world.text_from(first, &own);
    if world.size() > 1 {
        message = format!("rank {first}: {message}");
    }
    Err(Evaluate::Failed(match worst {
        3 => SolveError::Memory(message),
        _ => SolveError::Evaluation(message),
    }))
}

/// The state of the solve, as the convergence test sees it.
#[derive(Debug, Clone, Copy)]
pub struct Iteration<'a> {
    /// Newton iterations done; zero at the initial guess.
    pub number: usize,
    /// Owned residual at the current iterate.
    pub residual: &'a [f64],
    /// Owned change of the unknowns in the last iteration, after the line search; none at the initial guess.
    pub update: Option<&'a [f64]>,
    /// Euclidean norm of the residual over all ranks.
    pub residual_norm: f64,
}

/// What a convergence test says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Another iteration.
    Continue,
    /// The current iterate is the solution.
    Converged,
    /// It will not get better.
    Diverged,
    /// The residual stays where it is, above what counts as zero, and so does the iterate.
    Stagnates,
}

/// How a solve ended; the same on every rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Solved or not.
    pub end: End,
    /// Newton iterations done.
    pub iterations: usize,
    /// Iterations of the linear solver, over all Newton iterations.
    pub linear_iterations: usize,
    /// Euclidean norm of the last residual that the solver accepted.
    pub residual_norm: f64,
    /// Why it ended, in words, with PETSc's names in brackets.
    pub reason: String,
    /// True if it ended because a linear system was not solved.
    pub linear_failure: bool,
    /// True if the matrix of that system is singular.
    pub singular: bool,
    /// True if the last evaluation of the residual was at the returned solution, to the bit, on every rank.
    pub evaluated_at_solution: bool,
}

/// The ways in which a solve ends without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The convergence test was met.
    Converged,
    /// The solver could not find a step on which the residual exists.
    OutOfDomain,
    /// The test found that the residual stays where it is.
    Stagnated,
    /// The limit of iterations was reached.
    IterationLimit,
    /// Failed linear solve, NaN, failed line search, or the test's own verdict.
    NotConverged,
}

/// A failure that a smaller load step would not mend. The solver must not be used after it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SolveError {
    /// PETSc reported an error, of which other ranks may know nothing.
    Petsc(PetscError),
    /// An evaluation failed for good; every rank has this message.
    Evaluation(String),
    /// There is not enough memory; every rank has this message.
    Memory(String),
}

impl SolveError {
    /// Whether memory was short.
    fn is_memory(&self) -> bool {
        match self {
            SolveError::Petsc(error) => error.is_memory(),
            SolveError::Evaluation(_) => false,
            SolveError::Memory(_) => true,
        }
    }
}

impl fmt::Display for SolveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SolveError::Petsc(error) => error.fmt(f),
            SolveError::Evaluation(message) | SolveError::Memory(message) => f.write_str(message),
        }
    }
}

impl std::error::Error for SolveError {}

impl From<SolveError> for crate::error::Error {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::Petsc(error) => error.into(),
            SolveError::Evaluation(message) => crate::error::Error::System(message),
            SolveError::Memory(message) => crate::error::Error::Memory(message),
        }
    }
}

impl From<PetscError> for SolveError {
    fn from(error: PetscError) -> Self {
        SolveError::Petsc(error)
    }
}
