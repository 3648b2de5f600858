//! The program on several ranks: the same numbers, points that change ranks, partitioners and orderings, ranks that fail.

#[path = "../common/mod.rs"]
mod common;

mod agreement;
mod failure;
mod memory;
mod migration;
mod scenes;
mod solvers;
mod summary;
