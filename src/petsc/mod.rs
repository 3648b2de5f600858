//! What the project uses of PETSc, made safe: the only module of this crate with `unsafe` code.
//!
//! In reading order: [`Session`] starts and ends PETSc; [`Layout`] and [`GhostVector`] say which rank owns what and
//! exchange the rest; [`BlockMatrix`] is the tangent; [`Nonlinear`] is the problem that [`Newton`] solves;
//! [`partition`](partition()) divides a graph between ranks; [`LogStage`] and [`PhaseSeconds`] tell where the time
//! went.
//!
//! Every handle keeps its [`Session`] alive, and the session keeps MPI alive, so that they end in the right order
//! without lifetimes in user code. Return codes of PETSc become [`PetscError`] with PETSc's own first message; PETSc
//! prints nothing by itself. Unless said otherwise, functions are collective: all ranks call them in the same order.

mod blas;
mod error;
mod evaluation;
mod factors;
mod linear;
mod log;
mod matrix;
mod newton;
mod nonlinear;
mod options;
mod ordering;
mod partition;
mod pattern;
mod redundant;
mod remote;
mod scalar_copy;
mod session;
mod vector;

pub use error::PetscError;
pub use linear::LinearSolver;
pub use log::{LogStage, PhaseSeconds, StageGuard};
pub use matrix::{BlockMatrix, MatrixFormat};
pub use newton::{BACKTRACKING, FULL_STEPS, LinearOutcome, Newton, NewtonOptions};
pub use nonlinear::{End, Evaluate, Iteration, Nonlinear, Outcome, SolveError, Verdict, agree};
pub use partition::{Graph, Partitioner, partition};
/// PETSc's integer: 32 or 64 bits, as PETSc was built.
pub use petsc_sys::PetscInt;
pub use session::Session;
pub use vector::{GhostVector, Layout};
