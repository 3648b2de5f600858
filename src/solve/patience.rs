//! When smaller steps are not worth trying.
//!
//! A step that is too large fails by less and less as it is halved. Where a point fails by as much at every size,
//! something else than the step drives it, such as a cell that holds next to nothing, and all that halving gains is time.

use super::failure::{Cause, Failure};

/// Sizes in succession at which a point may fail in the same way, with nothing gained.
const SIZES: usize = 4;

/// Less of a gradient than this times the least before is a gain.
const GAIN: f64 = 0.75;

/// A motion is impossible from a gradient of this order on.
const IMPOSSIBLE: f64 = 1.0;

/// What a step has failed by since it was last accepted.
#[derive(Debug, Default)]
pub struct Patience {
    /// What a point failed for at the last size.
    way: Option<String>,
    /// Sizes in succession with nothing gained.
    sizes: usize,
    /// Least gradient at a failing point among them.
    least: f64,
}

impl Patience {
    /// Notes the last failure at one size, which may be halved so many times yet. Returns at how many sizes a point has
    /// failed in the same way, where smaller ones are not worth trying.
    pub fn exhausted(&mut self, failure: &Failure, halvings: u32) -> Option<usize> {
        let Cause::Point(point) = &failure.cause else {
            *self = Self::default();
            return None;
        };
        let possible = point.residual.is_some() || point.gradient * 0.5f64.powi(halvings as i32) < IMPOSSIBLE;
        let gained = possible && point.gradient < GAIN * self.least;
        if gained || self.way.as_ref() != Some(&point.what) {
            self.sizes = 0;
            self.least = f64::INFINITY;
        }
        self.way = Some(point.what.clone());
        self.sizes += 1;
        self.least = self.least.min(point.gradient);
        (self.sizes >= SIZES).then_some(self.sizes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::failure::FailedPoint;
    use super::*;

    fn failure(what: &str, residual: Option<f64>, gradient: f64) -> Failure {
        Failure::at(Some(FailedPoint {
            id: 7,
            what: what.into(),
            residual,
            gradient,
        }))
    }

    /// At how many sizes the step is given up, of gradients at a point that its law fails at.
    fn given_up(gradients: &[f64]) -> Option<usize> {
        let mut patience = Patience::default();
        let mut verdicts = gradients.iter().map(|&gradient| {
            let left = 12;
            patience.exhausted(&failure("stalls", Some(1.0), gradient), left)
        });
        verdicts.position(|verdict| verdict.is_some()).map(|index| index + 1)
    }

    #[test]
    fn a_step_that_fails_by_less_and_less_goes_on() {
        let halved: Vec<f64> = (0..12).map(|k| 0.5f64.powi(k)).collect();
        assert_eq!(given_up(&halved), None);
        assert_eq!(given_up(&[1.0, 0.9, 0.4, 0.4, 0.39, 0.1, 0.1, 0.09]), None);
    }

    #[test]
    fn a_step_that_fails_by_as_much_at_four_sizes_is_given_up() {
        assert_eq!(given_up(&[0.1; 6]), Some(4));
        assert_eq!(given_up(&[0.1, 2.0, 0.5, 30.0]), Some(4));
        assert_eq!(given_up(&[1.0, 0.5, 0.4, 0.45, 0.41]), Some(5));
    }

    #[test]
    fn another_way_to_fail_begins_anew() {
        let mut patience = Patience::default();
        for what in ["a", "a", "a", "b", "b", "b", "a"] {
            assert_eq!(patience.exhausted(&failure(what, Some(1.0), 1.0), 9), None);
        }
        assert_eq!(patience.exhausted(&Failure::plain("else".into()), 9), None);
        for _ in 0..3 {
            assert_eq!(patience.exhausted(&failure("a", Some(1.0), 1.0), 9), None);
        }
    }

    #[test]
    fn motions_that_the_smallest_step_would_not_make_possible_gain_nothing() {
        let gives_up = |first: f64| {
            let mut patience = Patience::default();
            (0..12).any(|k| {
                let gradient = first * 0.5f64.powi(k);
                let halvings = 12 - k as u32;
                patience
                    .exhausted(&failure("turns", None, gradient), halvings)
                    .is_some()
            })
        };
        assert!(!gives_up(1000.0));
        assert!(gives_up(1.0e8));
    }
}
