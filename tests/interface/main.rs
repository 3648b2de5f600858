//! The program as its user meets it: command line, exit codes, bad input, result folder, history columns, shapes.

#[path = "../common/mod.rs"]
mod common;

mod advice;
mod bad_input;
mod columns;
mod commands;
mod diagnosis;
mod halving;
mod nonsense;
mod point;
mod point_files;
mod repetition;
mod report;
mod scenes;
mod shapes;
mod stopping;
mod strength;
mod templates;
