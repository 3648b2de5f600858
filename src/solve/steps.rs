//! The steps of a stage: of load and motion by the clock of the stage, or along the path.

use super::path::{Goal, PathSchedule, Reached, Review};
use super::schedule::Schedule;
use super::settings::Stage;
use crate::condition::Time;
use serde::{Deserialize, Serialize};

/// Progress through the steps of one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Steps {
    Ramp(Schedule),
    Path(PathSchedule),
}

impl Steps {
    /// The steps of a stage, by its number.
    pub fn new(number: usize, stage: &Stage) -> Self {
        match &stage.control {
            Some(control) => Steps::Path(PathSchedule::new(number, stage, control)),
            None => Steps::Ramp(Schedule::new(number, stage)),
        }
    }

    /// What the next step has to reach; `None` when the stage is done.
    pub fn next_goal(&self) -> Option<Goal> {
        match self {
            Steps::Ramp(schedule) => schedule.next_step().map(|(_, to)| Goal::Time(to)),
            Steps::Path(path) => path.next_goal(),
        }
    }

    /// Start of the last accepted step.
    pub fn start(&self) -> Time {
        match self {
            Steps::Ramp(schedule) => schedule.start(),
            Steps::Path(path) => path.start(),
        }
    }

    /// End of the last accepted step.
    pub fn done(&self) -> Time {
        match self {
            Steps::Ramp(schedule) => schedule.done(),
            Steps::Path(path) => path.done(),
        }
    }

    /// How far the stage has come, 0 to 1, never less than before.
    pub fn share(&self) -> f64 {
        match self {
            Steps::Ramp(schedule) => schedule.done().fraction,
            Steps::Path(path) => path.share(),
        }
    }

    /// Change of the load factor in the last accepted step.
    pub fn last_size(&self) -> f64 {
        match self {
            Steps::Ramp(schedule) => schedule.last_size(),
            Steps::Path(path) => path.done().fraction - path.start().fraction,
        }
    }

    /// Whether the stage has taken a step, so that the path has a direction.
    pub fn has_direction(&self) -> bool {
        matches!(self, Steps::Path(path) if path.taken() > 0)
    }

    /// Whether the last accepted step ended a full step; every step along a path is one.
    pub fn at_full_step(&self) -> bool {
        match self {
            Steps::Ramp(schedule) => schedule.at_full_step(),
            Steps::Path(_) => true,
        }
    }

    /// What becomes of a solved step. `reached` is known where the stage follows its path.
    pub fn review(&self, reached: Option<&Reached>) -> Review {
        match (self, reached) {
            (Steps::Path(path), Some(reached)) => path.review(reached),
            _ => Review::Accept,
        }
    }

    /// The step passed the full load: the next attempt goes to exactly there.
    pub fn close(&mut self) {
        if let Steps::Path(path) = self {
            path.close();
        }
    }

    /// The step was accepted after a number of linear solves.
    pub fn accept(&mut self, iterations: usize, reached: Option<&Reached>) {
        match (self, reached) {
            (Steps::Ramp(schedule), _) => schedule.accept(iterations),
            (Steps::Path(path), Some(reached)) => path.accept(iterations, reached),
            (Steps::Path(_), None) => unreachable!("a step along a path is measured"),
        }
    }

    /// The step failed: halves it. False when it is the smallest already.
    pub fn cut(&mut self) -> bool {
        match self {
            Steps::Ramp(schedule) => schedule.cut(),
            Steps::Path(path) => path.cut(),
        }
    }

    /// How often the step may be halved yet.
    pub fn halvings_left(&self) -> u32 {
        match self {
            Steps::Ramp(schedule) => schedule.halvings_left(),
            Steps::Path(path) => path.halvings_left(),
        }
    }

    /// The size of the next step, in words.
    pub fn describe_size(&self) -> String {
        match self {
            Steps::Ramp(schedule) => format!("{:.3e}", schedule.step_size()),
            Steps::Path(path) => path.describe_size(),
        }
    }

    /// Size and start of the next step, in words.
    pub fn describe_next(&self) -> String {
        let after = self.done().fraction;
        match self {
            Steps::Ramp(schedule) => format!("{:.3e} of the stage after {after:.6}", schedule.step_size()),
            Steps::Path(path) => format!("{}, after load factor {after:.6}", path.describe_size()),
        }
    }

    /// How the stage ended before all of its loads were there or with them, in words; nothing for a stage by the clock.
    pub fn describe_ending(&self) -> Option<String> {
        match self {
            Steps::Ramp(_) => None,
            Steps::Path(path) => path.describe_ending(),
        }
    }
}
