//! Implicit, quasi-static, geometrically exact micropolar (Cosserat) material point method on MPI and PETSc.
#![deny(unsafe_code)]

pub mod parallel;
#[allow(unsafe_code)]
pub mod petsc;
