//! Implicit, quasi-static, geometrically exact micropolar (Cosserat) material point method on MPI and PETSc.
//!
//! The modules in reading order; each uses only what stands above it (`scripts/check_layers.sh` holds the exact table):
//!
//! 1. [`continuum`]: unknowns at one point become strains, stresses become forces. No mesh, no rank.
//! 2. [`material`]: constitutive laws, from strain and old state to stress, new state and moduli.
//! 3. [`parallel`]: what ranks say to each other; who owns which key.
//! 4. [`grid`]: the background grid, its regions, basis functions (hats, GIMPM, B-splines) and ghost penalty.
//! 5. [`points`]: the body, arrays of what material points carry; seeding, search, migration.
//! 6. [`condition`]: prescribed increments, weak conditions on points, dead loads and follower pressure.
//! 7. [`assembly`]: points and grid become residual and tangent; the only hot loop.
//! 8. [`petsc`]: matrix, vectors, Newton's method and partitioning, made safe; nearly all `unsafe` code.
//! 9. [`solve`]: a load step, attempted, accepted or cut; equal steps, or steps that follow the iterations.
//! 10. [`output`]: the files and lines that a run leaves behind, checkpoints among them.
//! 11. [`verification`]: problems with a known solution, and how far a run is from it.
//! 12. [`scene`] and [`config`]: a valid scene, and how the text of a user becomes one.
//! 13. [`report`]: the page and the figures of a result folder, read from its files.
//! 14. [`app`]: from a scene to results; the one match that picks continuum and dimension.
//! 15. [`study`]: many runs as processes of their own, and charts of them.
//!
//! Small ones that any may use: [`problem`] (what is wrong in a file, and where), [`error`] (why a run ends, exit codes),
//! [`clock`] (where the time goes), [`console`] (lines for the terminal), [`file`] (reading what has an end), [`memory`] (how much is left), [`interrupt`] (signals that end a run), [`version`].
//!
//! Equations are in `docs/theory.md`, a guided tour in `docs/tour.md`. In comments, `T 2.53` is equation or section 2.53 of
//! the thesis that is named there.
#![deny(unsafe_code)]
// Units stand in brackets, which rustdoc takes for links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod app;
pub mod assembly;
pub mod clock;
pub mod condition;
pub mod config;
pub mod console;
pub mod continuum;
pub mod error;
pub mod file;
pub mod grid;
pub mod interrupt;
pub mod material;
pub mod memory;
pub mod output;
pub mod parallel;
#[allow(unsafe_code)]
pub mod petsc;
pub mod points;
pub mod problem;
pub mod report;
pub mod scene;
pub mod solve;
pub mod study;
pub mod verification;
pub mod version;

/// The example of the page is a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/extend/material.md")]
mod extend_material {}

/// The example of the page is a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/extend/condition.md")]
mod extend_condition {}

/// The example of the page is a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/extend/basis.md")]
mod extend_basis {}

/// The example of the page is a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/extend/output.md")]
mod extend_output {}
