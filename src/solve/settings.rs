//! How steps are solved: what a user decides.

use crate::petsc::LinearSolver;
use crate::points::select::Selection;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    pub steps: usize,
    pub max_halvings: u32,
    /// Equal steps, but for those that fail, unless set.
    pub adaptive: Option<Adaptive>,
    /// Steps along the equilibrium path, whose load is an unknown, instead of steps by the clock.
    pub control: Option<ArcLength>,
}

impl Stage {
    /// Number of full steps, or the largest number of steps along a path.
    pub fn full_steps(&self) -> usize {
        self.control.as_ref().map_or(self.steps, |control| control.max_steps)
    }
}

/// Steps of a given length along an equilibrium path.
#[derive(Clone, Debug, PartialEq)]
pub struct ArcLength {
    /// Points whose motion is the length of a step; all unless set.
    pub at: Option<Selection>,
    /// Length of a step [m]; unless set, what the first step of load comes to.
    pub length: Option<f64>,
    /// Longest step [m] where steps follow the number of iterations; equal steps unless set.
    pub max_length: Option<f64>,
    /// Linear solves that a step should take, the opening one included.
    pub target_iterations: usize,
    pub max_steps: usize,
    /// Mean displacement of the points [m] at which the path ends.
    pub max_displacement: Option<f64>,
}

/// Steps that grow and shrink with the number of iterations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Adaptive {
    /// Longest step as a share of the stage.
    pub max_step: f64,
    /// Linear solves that a step should take, the opening one included.
    pub target_iterations: usize,
}

#[derive(Clone, Debug)]
pub struct SolverSettings {
    pub force_tolerance: f64,
    /// Off unless set [J].
    pub energy_tolerance: Option<f64>,
    pub return_map_tolerance: f64,
    pub max_iterations: usize,
    pub method: SolverMethod,
    pub repeatable: Repeatable,
    pub partitioner: PartitionerKind,
    pub petsc_options: Vec<String>,
}

/// How linear systems are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverMethod {
    Auto,
    Direct,
    Iterative,
}

/// Whether a direct solver repeats to the last bit on several ranks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repeatable {
    Auto,
    Always,
    Never,
}

impl Repeatable {
    /// Entries in a matrix up to which every rank factorises all of it. On two ranks that takes as long as sharing the
    /// work up to about this number: docs/performance.md.
    const FREE: u64 = 250_000;

    pub fn redundant_entries(self) -> u64 {
        match self {
            Repeatable::Auto => Repeatable::FREE,
            Repeatable::Always => u64::MAX,
            Repeatable::Never => 0,
        }
    }
}

/// Unknowns from which on incomplete factors are better than complete ones in space: docs/performance.md. In the plane
/// complete ones stay cheap.
const LARGE: usize = 50_000;

impl SolverSettings {
    /// The linear solver for a problem of so many unknowns in a number of dimensions.
    ///
    /// Newton's method converges quadratically with an exact tangent: its last iteration takes the residual from the
    /// square root of the tolerance to the tolerance. A tenth of that root is an accuracy that costs no iteration.
    pub fn linear_solver(&self, unknowns: usize, dimension: usize) -> LinearSolver {
        let iterative = match self.method {
            SolverMethod::Auto => dimension == 3 && unknowns >= LARGE,
            SolverMethod::Direct => false,
            SolverMethod::Iterative => true,
        };
        match iterative {
            true => LinearSolver::Iterative {
                tolerance: 0.1 * self.force_tolerance.sqrt(),
            },
            false => LinearSolver::Direct,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartitionerKind {
    Auto,
    Metis,
    PtScotch,
    ParMetis,
}
