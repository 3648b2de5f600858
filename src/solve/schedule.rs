//! Step sizes: halve on failure, double on success up to the size of the start, or follow the number of iterations.
//!
//! Progress is counted in whole ticks of the smallest step, so that full steps are met exactly however often a step
//! was halved: a step doubles only where the doubled one would end on a multiple of itself. Adaptive steps may end on
//! any tick; the last one ends the stage exactly.

use super::settings::{Adaptive, Stage};
use crate::condition::Time;
use serde::{Deserialize, Serialize};

/// An adaptive step is at most so many times as long as the one before it, and at least the inverse.
const LARGEST_CHANGE: f64 = 2.0;

/// Progress through the steps of one stage: all that decides which step comes next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    stage: usize,
    steps: u64,
    /// Ticks of a full step: a power of two.
    full: u64,
    /// Ticks done.
    done: u64,
    /// Ticks that a step should have; the end of the stage may shorten it.
    size: u64,
    /// Ticks of the last accepted step.
    last: u64,
    adaptive: Option<Adaptive>,
}

impl Schedule {
    /// The steps of a stage, by its number.
    pub fn new(number: usize, stage: &Stage) -> Self {
        let full = 1 << stage.max_halvings;
        Self {
            stage: number,
            steps: stage.steps as u64,
            full,
            done: 0,
            size: full,
            last: 0,
            adaptive: stage.adaptive,
        }
    }

    fn time(&self, ticks: u64) -> Time {
        Time {
            stage: self.stage,
            fraction: ticks as f64 / (self.steps * self.full) as f64,
        }
    }

    /// Ticks of the next step: what is left ends in one step, or in two equal ones rather than in a splinter.
    fn next_size(&self) -> u64 {
        let left = self.steps * self.full - self.done;
        if left <= self.size {
            left
        } else if left < 2 * self.size {
            left.div_ceil(2)
        } else {
            self.size
        }
    }

    /// Start and end of the next step; `None` when the stage is done.
    pub fn next_step(&self) -> Option<(Time, Time)> {
        let next = self.done + self.next_size();
        (next > self.done).then(|| (self.time(self.done), self.time(next)))
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
        self.time(self.next_size()).fraction
    }

    /// Whether the last accepted step reached the end of a full step, or went past it.
    pub fn at_full_step(&self) -> bool {
        self.done / self.full > (self.done - self.last) / self.full
    }

    /// The step was accepted after a number of linear solves.
    pub fn accept(&mut self, iterations: usize) {
        self.last = self.next_size();
        self.done += self.last;
        match self.adaptive {
            Some(adaptive) => self.adapt(adaptive, iterations),
            None if self.size < self.full && self.done.is_multiple_of(2 * self.size) => self.size *= 2,
            None => {}
        }
    }

    /// Changes the size by the ratio of wanted to needed iterations, within bounds.
    fn adapt(&mut self, adaptive: Adaptive, iterations: usize) {
        let ratio = adaptive.target_iterations as f64 / iterations.max(1) as f64;
        let ratio = ratio.clamp(1.0 / LARGEST_CHANGE, LARGEST_CHANGE);
        let largest = (adaptive.max_step * (self.steps * self.full) as f64) as u64;
        self.size = ((self.last as f64 * ratio).round() as u64).clamp(1, largest.max(1));
    }

    /// How often the step may be halved yet.
    pub fn halvings_left(&self) -> u32 {
        self.next_size().ilog2()
    }

    /// The step failed: halves it. False when it is the smallest already.
    pub fn cut(&mut self) -> bool {
        let size = self.next_size();
        self.size = (size / 2).max(1);
        size > 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(steps: usize, max_halvings: u32, adaptive: Option<Adaptive>) -> Stage {
        Stage {
            name: "test".into(),
            steps,
            max_halvings,
            adaptive,
            control: None,
        }
    }

    const ADAPTIVE: Adaptive = Adaptive {
        max_step: 0.3,
        target_iterations: 6,
    };

    #[test]
    fn easy_steps_grow_to_the_largest_and_end_exactly() {
        let mut schedule = Schedule::new(0, &stage(20, 12, Some(ADAPTIVE)));
        let mut sizes = Vec::new();
        while schedule.next_step().is_some() {
            schedule.accept(3);
            sizes.push(schedule.last_size());
        }
        assert_eq!(schedule.done().fraction, 1.0);
        assert_eq!(sizes[..3], [0.05, 0.1, 0.2]);
        // What is left of the stage is more than one and less than two of the largest steps.
        assert_eq!(sizes.len(), 6, "{sizes:?}");
        assert!((sizes[3] - 0.3).abs() < 1e-4, "{sizes:?}");
        assert!((sizes[4] - sizes[5]).abs() < 1e-4 && sizes[4] < 0.2, "{sizes:?}");
    }

    #[test]
    fn hard_steps_shrink_and_count_as_full_ones_when_they_pass_one() {
        let mut schedule = Schedule::new(0, &stage(10, 12, Some(ADAPTIVE)));
        schedule.accept(9);
        assert!(schedule.at_full_step());
        assert!((schedule.step_size() - 0.1 * 6.0 / 9.0).abs() < 1e-3);
        schedule.accept(100);
        assert!(!schedule.at_full_step());
        assert!((schedule.step_size() - 0.05 * 6.0 / 9.0).abs() < 2e-3);
        schedule.accept(6);
        assert!(schedule.at_full_step());
        assert!(schedule.cut());
        assert!((schedule.step_size() - 0.025 * 6.0 / 9.0).abs() < 2e-3);
    }

    #[test]
    fn halved_steps_double_back_and_meet_the_full_ones() {
        let mut schedule = Schedule::new(0, &stage(4, 3, None));
        assert_eq!((schedule.step_size(), schedule.halvings_left()), (0.25, 3));
        assert!(schedule.cut() && schedule.cut());
        assert_eq!((schedule.step_size(), schedule.halvings_left()), (0.0625, 1));
        let mut ends = Vec::new();
        while let Some((_, to)) = schedule.next_step() {
            ends.push(to.fraction);
            schedule.accept(5);
        }
        assert_eq!(ends, [0.0625, 0.125, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn the_smallest_step_cannot_be_cut() {
        let mut schedule = Schedule::new(0, &stage(1, 2, None));
        assert!(schedule.cut() && schedule.cut() && !schedule.cut());
        assert_eq!(schedule.step_size(), 0.25);
        let mut whole = Schedule::new(0, &stage(1, 0, None));
        assert!(!whole.cut());
    }
}
