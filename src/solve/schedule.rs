//! Step sizes: halve on failure, double on success up to the size of the start.
//!
//! Progress is counted in whole ticks of the smallest step, so that full steps are met exactly however often a step
//! was halved: a step doubles only where the doubled one would end on a multiple of itself.

use super::settings::Stage;
use crate::condition::Time;
use serde::{Deserialize, Serialize};

/// Progress through the steps of one stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Schedule {
    stage: usize,
    steps: u64,
    /// Ticks of a full step: a power of two.
    full: u64,
    /// Ticks done.
    done: u64,
    /// Ticks of the next step.
    size: u64,
    /// Ticks of the last accepted step.
    last: u64,
}

impl Schedule {
    /// The steps of a stage, by its index.
    pub fn of(index: usize, stage: &Stage) -> Self {
        Self::new(index, stage.steps, stage.max_halvings)
    }

    /// `steps` equal steps, each of which may be halved up to `max_halvings` times.
    pub fn new(stage: usize, steps: usize, max_halvings: u32) -> Self {
        let full = 1 << max_halvings;
        Self {
            stage,
            steps: steps as u64,
            full,
            done: 0,
            size: full,
            last: 0,
        }
    }

    fn time(&self, ticks: u64) -> Time {
        Time {
            stage: self.stage,
            fraction: ticks as f64 / (self.steps * self.full) as f64,
        }
    }

    /// Start and end of the next step; `None` when the stage is done.
    pub fn next_step(&self) -> Option<(Time, Time)> {
        (self.done < self.steps * self.full).then(|| (self.time(self.done), self.time(self.done + self.size)))
    }

    /// Start of the last accepted step.
    pub fn start(&self) -> Time {
        self.time(self.done - self.last)
    }

    /// End of the last accepted step.
    pub fn done(&self) -> Time {
        self.time(self.done)
    }

    /// Size of the last accepted step as a share of the stage.
    pub fn last_size(&self) -> f64 {
        self.time(self.last).fraction
    }

    /// Size of the next step as a share of the stage.
    pub fn step_size(&self) -> f64 {
        self.time(self.size).fraction
    }

    /// Whether the last accepted step ended a full step.
    pub fn at_full_step(&self) -> bool {
        self.done.is_multiple_of(self.full)
    }

    /// The step was accepted.
    pub fn accept(&mut self) {
        self.done += self.size;
        self.last = self.size;
        if self.size < self.full && self.done.is_multiple_of(2 * self.size) {
            self.size *= 2;
        }
    }

    /// The step failed: halves it. False when it is the smallest already.
    pub fn cut(&mut self) -> bool {
        if self.size == 1 {
            return false;
        }
        self.size /= 2;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halved_steps_double_back_and_meet_the_full_ones() {
        let mut schedule = Schedule::new(0, 4, 3);
        assert_eq!(schedule.step_size(), 0.25);
        assert!(schedule.cut() && schedule.cut());
        assert_eq!(schedule.step_size(), 0.0625);
        let mut ends = Vec::new();
        while let Some((_, to)) = schedule.next_step() {
            ends.push(to.fraction);
            schedule.accept();
        }
        assert_eq!(ends, [0.0625, 0.125, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn the_smallest_step_cannot_be_cut() {
        let mut schedule = Schedule::new(0, 1, 2);
        assert!(schedule.cut() && schedule.cut() && !schedule.cut());
        assert_eq!(schedule.step_size(), 0.25);
        let mut whole = Schedule::new(0, 1, 0);
        assert!(!whole.cut());
    }
}
