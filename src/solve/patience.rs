//! When smaller steps are not worth trying.
//!
//! A step that is too large fails by less and less as it is halved. Where it fails by as much at every size, something
//! else than the step drives it, such as a cell that holds next to nothing, and all that halving costs is time.

use super::failure::{Cause, Failure};

/// Sizes in succession at which a step may fail in the same way, with nothing gained.
const SIZES: usize = 4;

/// Less than this times the least before is a gain.
const GAIN: f64 = 0.75;

/// A motion is impossible from a gradient of this order on.
const IMPOSSIBLE: f64 = 1.0;

/// How a step has failed at one size after the other since the last one was accepted.
#[derive(Debug, Default)]
pub struct Patience {
    /// Attempts at the size under way.
    attempts: Vec<Setback>,
    /// The least that the attempts at earlier sizes failed by, where they failed in the same ways.
    least: Vec<Setback>,
    /// Sizes in succession with nothing gained.
    sizes: usize,
}

/// How an attempt failed, and by how much.
#[derive(Clone, Debug, PartialEq)]
struct Setback {
    way: String,
    /// Gradient at the point, or residual [-].
    amount: f64,
    /// Whether the smallest step might do better.
    within_reach: bool,
}

impl Setback {
    fn of(failure: &Failure, halvings: u32) -> Self {
        let (way, amount, within_reach) = match &failure.cause {
            Cause::Point(point) => {
                let possible = point.gradient * 0.5f64.powi(halvings as i32) < IMPOSSIBLE;
                (
                    point.what.as_str(),
                    point.gradient,
                    point.residual.is_some() || possible,
                )
            }
            Cause::IterationLimit { residual, .. } => ("limit of iterations", *residual, true),
            Cause::Divergence { residual, .. } => ("divergence", *residual, true),
            Cause::Singular => ("singular", f64::INFINITY, true),
            Cause::Stagnation { residual, .. } => ("stagnation", *residual, true),
            // Whatever it is may be gone at the next size.
            Cause::Other => ("else", 0.0, true),
        };
        Self {
            way: way.to_owned(),
            amount,
            within_reach,
        }
    }

    fn gains_on(&self, least: &Self) -> bool {
        self.way == "else" || self.within_reach && self.amount < GAIN * least.amount
    }
}

impl Patience {
    /// Notes that an attempt failed, at a size that may be halved so many times yet.
    pub fn note(&mut self, failure: &Failure, halvings: u32) {
        self.attempts.push(Setback::of(failure, halvings));
    }

    /// The step failed at this size for good. Returns at how many sizes it has failed in the same way, where smaller ones
    /// are not worth trying.
    pub fn exhausted(&mut self) -> Option<usize> {
        let attempts = std::mem::take(&mut self.attempts);
        let pairs = || attempts.iter().zip(&self.least);
        let alike = attempts.len() == self.least.len() && pairs().all(|(now, least)| now.way == least.way);
        if !alike || pairs().any(|(now, least)| now.gains_on(least)) {
            self.sizes = 1;
            self.least = attempts;
            return None;
        }
        for (least, now) in self.least.iter_mut().zip(attempts) {
            least.amount = least.amount.min(now.amount);
        }
        self.sizes += 1;
        (self.sizes >= SIZES).then_some(self.sizes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::failure::FailedPoint;
    use super::*;

    fn at_point(what: &str, residual: Option<f64>, gradient: f64) -> Failure {
        Failure::at(Some(FailedPoint {
            id: 7,
            what: what.into(),
            residual,
            gradient,
        }))
    }

    fn at_limit(residual: f64) -> Failure {
        Failure::plain("limit".into()).because(Cause::IterationLimit {
            falling: false,
            residual,
            node: None,
        })
    }

    /// At which size a step is given up that fails like this, attempt by attempt and size by size.
    fn given_up(sizes: &[Vec<Failure>]) -> Option<usize> {
        let mut patience = Patience::default();
        let mut verdicts = sizes.iter().enumerate().map(|(index, attempts)| {
            for failure in attempts {
                patience.note(failure, (sizes.len() - 1 - index) as u32);
            }
            patience.exhausted()
        });
        verdicts.position(|verdict| verdict.is_some()).map(|index| index + 1)
    }

    fn at_one_point(gradients: &[f64]) -> Vec<Vec<Failure>> {
        let failures = gradients
            .iter()
            .map(|&gradient| at_point("stalls", Some(1.0), gradient));
        failures.map(|failure| vec![failure]).collect()
    }

    #[test]
    fn a_step_that_fails_by_less_and_less_goes_on() {
        let halved: Vec<f64> = (0..12).map(|k| 0.5f64.powi(k)).collect();
        assert_eq!(given_up(&at_one_point(&halved)), None);
        assert_eq!(
            given_up(&at_one_point(&[1.0, 0.9, 0.4, 0.4, 0.39, 0.1, 0.1, 0.09])),
            None
        );
        let residuals = halved.iter().map(|&residual| vec![at_limit(residual)]);
        assert_eq!(given_up(&residuals.collect::<Vec<_>>()), None);
    }

    #[test]
    fn a_step_that_fails_by_as_much_at_four_sizes_is_given_up() {
        assert_eq!(given_up(&at_one_point(&[0.1; 6])), Some(4));
        assert_eq!(given_up(&at_one_point(&[0.1, 2.0, 0.5, 30.0])), Some(4));
        assert_eq!(given_up(&at_one_point(&[1.0, 0.5, 0.4, 0.45, 0.41])), Some(5));
        let both = |_| vec![at_point("turns", None, 3.0), at_limit(7.6e-2)];
        assert_eq!(given_up(&(0..6).map(both).collect::<Vec<_>>()), Some(4));
    }

    #[test]
    fn another_way_to_fail_begins_anew() {
        let ways = ["a", "a", "a", "b", "b", "b", "a"];
        let sizes: Vec<_> = ways.map(|way| vec![at_point(way, Some(1.0), 1.0)]).into();
        assert_eq!(given_up(&sizes), None);
        let unknown = |_| vec![Failure::plain("else".into())];
        assert_eq!(given_up(&(0..9).map(unknown).collect::<Vec<_>>()), None);
    }

    #[test]
    fn motions_that_the_smallest_step_would_not_make_possible_gain_nothing() {
        let turns = |first: f64| -> Vec<_> {
            let sizes = (0..13).map(|k| vec![at_point("turns", None, first * 0.5f64.powi(k))]);
            sizes.collect()
        };
        assert_eq!(given_up(&turns(1000.0)), None);
        assert_eq!(given_up(&turns(1.0e8)), Some(4));
    }
}
