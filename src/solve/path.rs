//! Steps along an equilibrium path: by how far the points move instead of by load.
//!
//! The first step is one of load, unless a length is given; how far it moves the points is the length of the steps that
//! follow. A step that fails is halved, a success doubles it again up to that length, or steps follow the number of
//! iterations. The step that would take the loads beyond their full size is replaced by one to exactly there.

use super::settings::{ArcLength, Stage};
use crate::condition::Time;
use serde::{Deserialize, Serialize};

/// The next step is at most so many times as long as the last, and at least the inverse.
const LARGEST_CHANGE: f64 = 2.0;

/// A step to full load may move the points so many times as far as was asked for: beyond that it left the path.
const LARGEST_CLOSURE: f64 = 2.0;

/// What a step has to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The loads and motions of a moment.
    Time(Time),
    /// A distance along the path [m]; the load is unknown.
    Length(f64),
}

/// What a solved step has reached, not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    pub load_factor: f64,
    /// How far the step moved the measured points [m].
    pub length: f64,
    /// How far these are from where they were in the initial state [m].
    pub displacement: f64,
}

/// What becomes of a solved step.
#[derive(Clone, Debug, PartialEq)]
pub enum Review {
    Accept,
    /// It passed the full load: a step to exactly there takes its place.
    Close,
    /// It is on another part of the path.
    Refuse(String),
}

/// Progress along the path of one stage: all that decides which step comes next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathSchedule {
    stage: usize,
    settings: Limits,
    /// Steps taken.
    taken: usize,
    load_factor: f64,
    /// Load factor before the last accepted step.
    before: f64,
    /// Length of a full step [m]; `None` before the first step has shown it.
    full: Option<f64>,
    /// Size of the next step: a length [m], or a change of the load factor while there is no full length.
    size: f64,
    /// Whether the next step goes to full load.
    closing: bool,
    ending: Option<Ending>,
}

/// What a user decides of the steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Limits {
    /// Change of the load factor in a first step of load.
    first: f64,
    max_halvings: u32,
    max_steps: usize,
    max_displacement: Option<f64>,
    /// Longest step [m] where steps follow the number of iterations.
    max_length: Option<f64>,
    target_iterations: usize,
}

/// Why a path ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    FullLoad,
    Steps,
    Displacement,
}

impl PathSchedule {
    /// The steps of a stage, by its number.
    pub fn new(number: usize, stage: &Stage, control: &ArcLength) -> Self {
        let first = 1.0 / stage.steps as f64;
        Self {
            stage: number,
            settings: Limits {
                first,
                max_halvings: stage.max_halvings,
                max_steps: control.max_steps,
                max_displacement: control.max_displacement,
                max_length: control.max_length,
                target_iterations: control.target_iterations,
            },
            taken: 0,
            load_factor: 0.0,
            before: 0.0,
            full: control.length,
            size: control.length.unwrap_or(first),
            closing: false,
            ending: None,
        }
    }

    fn time(&self, load_factor: f64) -> Time {
        Time {
            stage: self.stage,
            fraction: load_factor,
        }
    }

    /// What the next step has to reach; `None` when the path is at its end.
    pub fn next_goal(&self) -> Option<Goal> {
        match (self.ending, self.full) {
            (Some(_), _) => None,
            (None, None) => Some(Goal::Time(self.time((self.load_factor + self.size).min(1.0)))),
            (None, Some(_)) if self.closing => Some(Goal::Time(self.time(1.0))),
            (None, Some(_)) => Some(Goal::Length(self.size)),
        }
    }

    /// Start of the last accepted step.
    pub fn start(&self) -> Time {
        self.time(self.before)
    }

    /// End of the last accepted step.
    pub fn done(&self) -> Time {
        self.time(self.load_factor)
    }

    /// Number of steps taken.
    pub fn taken(&self) -> usize {
        self.taken
    }

    /// Share of the steps that are allowed.
    pub fn share(&self) -> f64 {
        self.taken as f64 / self.settings.max_steps as f64
    }

    /// What becomes of a solved step.
    pub fn review(&self, reached: &Reached) -> Review {
        let full_load = self.time(1.0);
        match self.next_goal() {
            Some(Goal::Length(_)) if reached.load_factor > 1.0 => Review::Close,
            Some(Goal::Time(time))
                if self.closing && time == full_load && reached.length > LARGEST_CLOSURE * self.size =>
            {
                Review::Refuse(format!(
                    "full load is {:.3e} m away, a step is {:.3e} m",
                    reached.length, self.size
                ))
            }
            _ => Review::Accept,
        }
    }

    /// The next step goes to full load.
    pub fn close(&mut self) {
        self.closing = true;
    }

    /// The step was accepted after a number of linear solves.
    pub fn accept(&mut self, iterations: usize, reached: &Reached) {
        self.before = self.load_factor;
        self.load_factor = reached.load_factor;
        self.taken += 1;
        match (self.full, self.settings.max_length) {
            (None, longest) => {
                // A body that does not move at all must not stop the path.
                self.full = (reached.length > 0.0).then_some(reached.length);
                self.size = self.full.unwrap_or(self.settings.first);
                self.adapt(longest, iterations);
            }
            (Some(_), Some(longest)) => self.adapt(Some(longest), iterations),
            (Some(full), None) => self.size = (LARGEST_CHANGE * self.size).min(full),
        }
        let far = self.settings.max_displacement;
        self.ending = if self.load_factor >= 1.0 {
            Some(Ending::FullLoad)
        } else if far.is_some_and(|far| reached.displacement >= far) {
            Some(Ending::Displacement)
        } else if self.taken >= self.settings.max_steps {
            Some(Ending::Steps)
        } else {
            None
        };
    }

    /// Changes the length by the ratio of wanted to needed iterations, within bounds.
    fn adapt(&mut self, longest: Option<f64>, iterations: usize) {
        let (Some(longest), Some(_)) = (longest, self.full) else {
            return;
        };
        let ratio = self.settings.target_iterations as f64 / iterations.max(1) as f64;
        self.size = (self.size * ratio.clamp(1.0 / LARGEST_CHANGE, LARGEST_CHANGE)).min(longest);
    }

    /// Length below which a step is not halved.
    fn smallest(&self) -> f64 {
        self.full.unwrap_or(self.settings.first) * 0.5f64.powi(self.settings.max_halvings as i32)
    }

    /// How often the step may be halved yet.
    pub fn halvings_left(&self) -> u32 {
        (self.size / self.smallest()).log2().max(0.0) as u32
    }

    /// The step failed: halves it. False when it is the smallest already.
    pub fn cut(&mut self) -> bool {
        self.closing = false;
        if 0.5 * self.size < self.smallest() {
            return false;
        }
        self.size *= 0.5;
        true
    }

    /// The size of the next step, in words.
    pub fn describe_size(&self) -> String {
        match self.full {
            Some(_) => format!("{:.3e} m", self.size),
            None => format!("{:.3e} of the load", self.size),
        }
    }

    /// How the path ended, in words.
    pub fn describe_ending(&self) -> Option<String> {
        let reason = match self.ending? {
            Ending::FullLoad => "the load is at its full size".to_owned(),
            Ending::Steps => format!("{} steps (max_steps) are done", self.taken),
            Ending::Displacement => "the displacement of until is reached".to_owned(),
        };
        Some(format!(
            "the path ends at load factor {:.6}: {reason}",
            self.load_factor
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(control: ArcLength, max_halvings: u32) -> PathSchedule {
        let stage = Stage {
            name: "test".into(),
            steps: 10,
            max_halvings,
            adaptive: None,
            control: None,
        };
        PathSchedule::new(1, &stage, &control)
    }

    fn control() -> ArcLength {
        ArcLength {
            at: None,
            length: None,
            max_length: None,
            target_iterations: 6,
            max_steps: 5,
            max_displacement: None,
        }
    }

    fn reached(load_factor: f64, length: f64) -> Reached {
        Reached {
            load_factor,
            length,
            displacement: 1.0,
        }
    }

    #[test]
    fn the_first_step_of_load_sets_the_length() {
        let mut path = path(control(), 3);
        let Some(Goal::Time(time)) = path.next_goal() else {
            panic!("no step of load")
        };
        assert_eq!((time.stage, time.fraction), (1, 0.1));
        path.accept(4, &reached(0.1, 0.02));
        assert_eq!(path.next_goal(), Some(Goal::Length(0.02)));
        assert!(path.cut());
        assert_eq!(path.next_goal(), Some(Goal::Length(0.01)));
        path.accept(4, &reached(0.05, 0.01));
        assert_eq!(path.next_goal(), Some(Goal::Length(0.02)));
        assert_eq!((path.start().fraction, path.done().fraction), (0.1, 0.05));
        assert!(path.cut() && path.cut() && path.cut() && !path.cut());
    }

    #[test]
    fn steps_follow_the_number_of_iterations() {
        let settings = ArcLength {
            length: Some(0.01),
            max_length: Some(0.03),
            ..control()
        };
        let mut path = path(settings, 3);
        path.accept(3, &reached(0.1, 0.01));
        assert_eq!(path.next_goal(), Some(Goal::Length(0.02)));
        path.accept(3, &reached(0.2, 0.02));
        assert_eq!(path.next_goal(), Some(Goal::Length(0.03)));
        path.accept(12, &reached(0.2, 0.03));
        assert_eq!(path.next_goal(), Some(Goal::Length(0.015)));
    }

    #[test]
    fn a_path_ends_at_full_load_exactly_or_where_it_was_asked_to() {
        let settings = ArcLength {
            length: Some(0.01),
            ..control()
        };
        let mut closed = path(settings.clone(), 3);
        assert_eq!(closed.review(&reached(1.2, 0.01)), Review::Close);
        closed.close();
        assert_eq!(closed.next_goal(), Some(Goal::Time(closed.time(1.0))));
        assert!(matches!(closed.review(&reached(1.0, 0.03)), Review::Refuse(_)));
        let mut shorter = closed.clone();
        assert!(shorter.cut());
        assert_eq!(shorter.next_goal(), Some(Goal::Length(0.005)));
        assert_eq!(closed.review(&reached(1.0, 0.008)), Review::Accept);
        closed.accept(3, &reached(1.0, 0.008));
        assert_eq!((closed.next_goal(), closed.ending), (None, Some(Ending::FullLoad)));

        let mut counted = path(settings.clone(), 3);
        (0..5).for_each(|_| counted.accept(3, &reached(0.5, 0.01)));
        assert_eq!((counted.ending, counted.share()), (Some(Ending::Steps), 1.0));

        let far = ArcLength {
            max_displacement: Some(0.9),
            ..settings
        };
        let mut far = path(far, 3);
        far.accept(3, &reached(0.5, 0.01));
        assert_eq!(far.ending, Some(Ending::Displacement));
        assert!(far.describe_ending().is_some_and(|text| text.contains("0.500000")));
    }
}
