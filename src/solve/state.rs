//! What of an analysis outlives a step, beside the model: enough to go on as if nothing had happened.

use super::settings::Stage;
use super::step::Counts;
use super::steps::Steps;
use serde::{Deserialize, Serialize};

/// Where an analysis stands after an accepted step, or before the first. Whatever is added to an analysis that a later
/// step depends on belongs here, since this is what a checkpoint keeps of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnalysisState {
    /// Index of the stage under way.
    pub stage: usize,
    pub steps: Steps,
    pub counts: Counts,
    /// Largest norm of external forces and reactions so far.
    pub peak_force: f64,
    /// Imbalance that the last partition left; `None` before the first, and where the ranks are others than before.
    pub achieved_balance: Option<f64>,
}

impl AnalysisState {
    /// The state before the first step.
    pub fn initial(stages: &[Stage]) -> Self {
        Self {
            stage: 0,
            steps: Steps::new(0, &stages[0]),
            counts: Counts::default(),
            peak_force: 0.0,
            achieved_balance: None,
        }
    }
}
