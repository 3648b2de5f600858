//! Implicit, quasi-static, geometrically exact micropolar (Cosserat) material point method on MPI and PETSc.
#![deny(unsafe_code)]

pub mod config;
pub mod continuum;
pub mod error;
pub mod grid;
pub mod material;
pub mod problem;
pub mod scene;
