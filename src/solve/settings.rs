//! How steps are solved: what a user decides.

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
    pub partitioner: PartitionerKind,
    pub petsc_options: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartitionerKind {
    Auto,
    Metis,
    PtScotch,
    ParMetis,
}
