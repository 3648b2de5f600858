//! Where the wall time of a run goes: a stopwatch that is always in exactly one phase.

use std::cell::Cell;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

/// What the program is busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Finding the nodes of the points, migration, sorting, sparsity.
    Search,
    /// Constitutive laws.
    Constitutive,
    /// Sums over points into vectors and matrices.
    Assembly,
    /// Factorisation, or set-up of a preconditioner.
    Factorise,
    /// Solution with a factorisation, or iterations.
    Solve,
    /// Files and lines.
    Output,
    /// Everything else.
    Other,
}

/// Wall time spent in each phase [s].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhaseSeconds {
    pub search: f64,
    pub constitutive: f64,
    pub assembly: f64,
    pub factorise: f64,
    pub solve: f64,
    pub output: f64,
    pub other: f64,
}

impl PhaseSeconds {
    /// Phase by phase with those of an earlier part of the run.
    pub fn plus(&self, earlier: &Self) -> Self {
        Self {
            search: self.search + earlier.search,
            constitutive: self.constitutive + earlier.constitutive,
            assembly: self.assembly + earlier.assembly,
            factorise: self.factorise + earlier.factorise,
            solve: self.solve + earlier.solve,
            output: self.output + earlier.output,
            other: self.other + earlier.other,
        }
    }

    /// Sum over phases: the wall time of the run [s].
    pub fn total(&self) -> f64 {
        self.search + self.constitutive + self.assembly + self.factorise + self.solve + self.output + self.other
    }
}

/// Stopwatch of one rank. Time counts for the innermost phase that was entered, so phases never overlap and together
/// make up the wall time since the start. A change of phase costs one reading of the system's clock.
#[derive(Debug)]
pub struct Clock {
    start: Instant,
    since: Cell<Instant>,
    current: Cell<Phase>,
    spent: [Cell<Duration>; 7],
}

impl Default for Clock {
    fn default() -> Self {
        Self::start()
    }
}

impl Clock {
    /// Starts in phase [`Phase::Other`].
    pub fn start() -> Self {
        let now = Instant::now();
        Clock {
            start: now,
            since: Cell::new(now),
            current: Cell::new(Phase::Other),
            spent: Default::default(),
        }
    }

    /// Changes to a phase until the answer is dropped, then back to the one before.
    #[must_use = "the phase ends when this is dropped"]
    pub fn enter(&self, phase: Phase) -> InPhase<'_> {
        InPhase {
            clock: self,
            before: self.switch(phase),
        }
    }

    /// Changes to a phase for good; answers with the one before.
    pub fn switch(&self, phase: Phase) -> Phase {
        let now = Instant::now();
        let before = self.current.replace(phase);
        let spent = &self.spent[before as usize];
        spent.set(spent.get() + now.duration_since(self.since.replace(now)));
        before
    }

    /// Wall time since the start.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Time spent in each phase until now; the sum is the wall time since the start.
    pub fn seconds(&self) -> PhaseSeconds {
        self.switch(self.current.get());
        let of = |phase: Phase| self.spent[phase as usize].get().as_secs_f64();
        PhaseSeconds {
            search: of(Phase::Search),
            constitutive: of(Phase::Constitutive),
            assembly: of(Phase::Assembly),
            factorise: of(Phase::Factorise),
            solve: of(Phase::Solve),
            output: of(Phase::Output),
            other: of(Phase::Other),
        }
    }
}

/// Time counts for a phase while this lives; see [`Clock::enter`].
#[derive(Debug)]
pub struct InPhase<'a> {
    clock: &'a Clock,
    before: Phase,
}

impl Drop for InPhase<'_> {
    fn drop(&mut self) {
        self.clock.switch(self.before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait(milliseconds: u64) {
        std::thread::sleep(Duration::from_millis(milliseconds));
    }

    #[test]
    fn time_counts_for_the_innermost_phase() {
        let clock = Clock::start();
        {
            let _assembly = clock.enter(Phase::Assembly);
            wait(10);
            {
                let _law = clock.enter(Phase::Constitutive);
                wait(30);
            }
            wait(10);
        }
        let seconds = clock.seconds();
        assert!(seconds.assembly >= 0.020, "{seconds:?}");
        assert!(seconds.constitutive >= 0.030, "{seconds:?}");
        assert_eq!(seconds.solve, 0.0);
        assert_eq!(clock.switch(Phase::Solve), Phase::Other, "both phases have ended");
    }

    #[test]
    fn phases_make_up_the_wall_time() {
        let clock = Clock::start();
        let _output = clock.enter(Phase::Output);
        wait(5);
        let before = clock.elapsed().as_secs_f64();
        let total = clock.seconds().total();
        let after = clock.elapsed().as_secs_f64();
        assert!(
            before <= total + 1e-9 && total <= after + 1e-9,
            "{before} <= {total} <= {after}"
        );
    }
}
