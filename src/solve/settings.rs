//! How steps are solved: what a user decides.

#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    pub steps: usize,
    pub max_halvings: u32,
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
