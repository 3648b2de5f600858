//! Small-strain estimate of a return: where the iteration starts, and whether the cone or its apex is tried first.
//!
//! In small strains every part of the stress shrinks along itself. With `x = dg/q >= 0`,
//!
//! ```text
//! s = s*/(1 + 3 mu x)     Gammae_m = Gammae*_m/(1 + 3 x c_m/(2 lp^2))     dg = x q(x)     p = p* - K beta dg
//! ```
//!
//! for the spherical, deviatoric symmetric and skew parts `m` of the wryness with `c = 3 alpha + 2 gamma`, `2 gamma`,
//! `2 beta`. So `f` is a function of one number, positive at zero; it falls through zero at the return to the cone, or
//! stays positive up to infinity, and then the answer is the apex.

use super::{DruckerPrager, StressPoint, Trial};
use crate::continuum::tensor::{SymmetricExponential, symmetric};
use nalgebra::Matrix3;

/// What the estimate says.
pub(super) enum Estimate {
    Cone(Start),
    Apex,
}

/// Where the iteration for the cone starts.
#[derive(Clone, Copy)]
pub(super) struct Start {
    pub(super) stretch: Matrix3<f64>,
    pub(super) wryness: Matrix3<f64>,
    /// `dg/q`.
    pub(super) ratio: f64,
}

/// Contributions to `3/2 (s:s + nu:nu/lp^2)` of the trial stress, each with the rate at which `x` divides it.
struct Parts {
    shares: [f64; 4],
    rates: [f64; 4],
    wrynesses: [Matrix3<f64>; 3],
}

impl DruckerPrager {
    pub(super) fn estimate(&self, trial: &Trial, point: &StressPoint) -> Estimate {
        let parts = self.parts(trial, point);
        match self.ratio(trial, point, &parts) {
            Some(x) => Estimate::Cone(self.start(trial, point, &parts, x)),
            None => Estimate::Apex,
        }
    }

    fn parts(&self, trial: &Trial, point: &StressPoint) -> Parts {
        let length_squared = self.plastic.plastic_length.powi(2);
        let moduli = self.couple_moduli();
        let upper = symmetric(&trial.wryness);
        let spherical = Matrix3::from_diagonal_element(upper.trace() / 3.0);
        let wrynesses = [spherical, upper - spherical, trial.wryness - upper];
        let mut shares = [1.5 * point.deviator.norm_squared(), 0.0, 0.0, 0.0];
        let mut rates = [3.0 * self.elastic.mu, 0.0, 0.0, 0.0];
        for (m, modulus) in moduli.into_iter().enumerate() {
            shares[m + 1] = 1.5 * modulus * modulus * wrynesses[m].norm_squared() / length_squared;
            rates[m + 1] = 1.5 * modulus / length_squared;
        }
        Parts {
            shares,
            rates,
            wrynesses,
        }
    }

    /// `x` of the return to the cone; `None` where `f` stays positive.
    fn ratio(&self, trial: &Trial, point: &StressPoint, parts: &Parts) -> Option<f64> {
        /// Enough for a start: the iteration proper does the rest.
        const ACCURACY: f64 = 1e-3;
        const MOST_EVALUATIONS: usize = 40;
        // y = 1/(1 + 3 mu x) maps the half-line to (0, 1].
        let rate = parts.rates[0];
        let excess = |y: f64| self.excess(trial, point, parts, y);
        let (mut low, mut high) = (0.0, 1.0);
        let (mut at_low, mut at_high) = (excess(low), excess(high));
        if at_low > 0.0 {
            return None;
        }
        let accuracy = ACCURACY * at_high.abs();
        let mut y = 1.0;
        // Regula falsi, the stale end halved (Illinois).
        for _ in 0..MOST_EVALUATIONS {
            if at_high <= at_low {
                break;
            }
            y = low - at_low * (high - low) / (at_high - at_low);
            let value = excess(y);
            if value.abs() <= accuracy {
                break;
            }
            if value > 0.0 {
                (high, at_high) = (y, value);
                at_low *= 0.5;
            } else {
                (low, at_low) = (y, value);
                at_high *= 0.5;
            }
        }
        Some((1.0 / y - 1.0) / rate)
    }

    /// `f` at `y = 1/(1 + 3 mu x)`, with its limit at `y = 0`.
    fn excess(&self, trial: &Trial, point: &StressPoint, parts: &Parts, y: f64) -> f64 {
        let plastic = &self.plastic;
        let bulk = self.elastic.lambda + 2.0 / 3.0 * self.elastic.mu;
        // (1 + x r) y = y + (1 - y) r/(3 mu), so that q = y Q and dg = (1 - y) Q/(3 mu) hold at y = 0, too.
        let sum: f64 = (0..4)
            .map(|m| {
                let divisor = y + (1.0 - y) * parts.rates[m] / parts.rates[0];
                // Couples without stiffness carry no stress.
                if divisor > 0.0 {
                    parts.shares[m] / (divisor * divisor)
                } else {
                    0.0
                }
            })
            .sum();
        let scale = sum.sqrt();
        let multiplier = (1.0 - y) * scale / parts.rates[0];
        let pressure = point.pressure - bulk * plastic.dilatancy_slope * multiplier;
        y * scale + plastic.friction_slope * pressure - self.strength(trial.old.chi + multiplier)
    }

    fn start(&self, trial: &Trial, point: &StressPoint, parts: &Parts, x: f64) -> Start {
        let divisors = parts.rates.map(|rate| 1.0 + x * rate);
        let square: f64 = (0..4).map(|m| parts.shares[m] / (divisors[m] * divisors[m])).sum();
        let multiplier = x * square.sqrt();
        let spherical = Matrix3::from_diagonal_element(multiplier * self.plastic.dilatancy_slope / 3.0);
        let flow = point.deviator * (1.5 * x / divisors[0]) + spherical;
        let [trace, upper, skew] = parts.wrynesses;
        Start {
            stretch: SymmetricExponential::new(&-flow).value * trial.stretch,
            wryness: trace / divisors[1] + upper / divisors[2] + skew / divisors[3],
            ratio: x,
        }
    }
}
