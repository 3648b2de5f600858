//! How steps are solved: what a user decides.

use crate::petsc::LinearSolver;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    pub steps: usize,
    pub max_halvings: u32,
    /// Equal steps, but for those that fail, unless set.
    pub adaptive: Option<Adaptive>,
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
