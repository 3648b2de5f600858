//! Implicit, quasi-static, geometrically exact micropolar (Cosserat) material point method on MPI and PETSc.
#![deny(unsafe_code)]
// Units stand in brackets, which rustdoc takes for links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod app;
pub mod assembly;
pub mod clock;
pub mod condition;
pub mod config;
pub mod continuum;
pub mod error;
pub mod grid;
pub mod material;
pub mod output;
pub mod parallel;
#[allow(unsafe_code)]
pub mod petsc;
pub mod points;
pub mod problem;
pub mod scene;
pub mod solve;
pub mod version;
