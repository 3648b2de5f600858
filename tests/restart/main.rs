//! Runs that are interrupted and go on: the same results as without, on the same ranks and on others; files that a
//! restart cannot use.

#[path = "../common/mod.rs"]
mod common;

mod files;
mod folder;
mod killed;
mod ranks;
mod scenes;
mod signals;
