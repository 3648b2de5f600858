//! The background grid.

pub mod region;
