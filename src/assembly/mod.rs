//! Points and grid become residual and tangent.

pub mod active;
pub mod balance;
pub mod kernel;
pub mod model;
pub mod motion;
pub mod penalty;
pub mod pieces;
pub mod round_off;
pub mod surface;

/// Where dense blocks of the tangent go: a matrix of PETSc in a run, a small dense one in tests.
pub trait Sink {
    /// Adds a block of the tangent on local nodes, row-major over (node, unknown).
    fn add(&mut self, nodes: &[u32], tangent: &[f64]);
}
