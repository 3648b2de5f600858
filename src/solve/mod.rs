//! A load step: try, accept or discard; step sizes; what the solver sees of the model.

mod arc_length;
mod attempt;
pub mod balance;
pub mod convergence;
pub mod equilibrium;
pub mod failure;
pub mod path;
pub mod patience;
mod round_off;
pub mod schedule;
pub mod settings;
pub mod state;
pub mod step;
pub mod steps;
