//! Figures of results: charts, and the page that shows a run.
//!
//! Nothing here knows a solver or a scene: all that is shown is read from the files of a result folder.

mod axis;
mod canvas;
pub mod chart;
pub mod error;
