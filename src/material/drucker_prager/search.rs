//! Search for the return to the cone along a curve: slower than the iteration of `cone.rs`, sure where that one fails.
//!
//! With `x = dg/q`, `y = 1/(1 + 3 mu x)` between 0 (the apex) and 1 (no flow), the flow `D` of the step
//! (`Ue = exp(-D) Ue*`) and the couples `M` of `couples.rs`, the flow rule reads without any division by `q`
//!
//! ```text
//! y dev D = (1 - y) s/(2 mu)      tr D = beta dg      dg = (1 - y) Q/(3 mu)      q = y Q
//! Q^2 = 3/2 (z : z + (M U^T U : M)/lp^2)              z = s + 2 mu dev D
//! ```
//!
//! The couples at a `y` follow from a linear system. What is left are as many smooth equations as `D` has components, for
//! these and `y`; the apex is no special place for them. Their solutions are a curve that begins at the trial state,
//! `D = 0` and `y = 1`, where `f` is positive. It is followed until `f` vanishes, the answer, or down to the apex. In
//! strong compression, where an elastic solid loses its stiffness in shear, the curve may turn back in `y`.

use super::apex::symmetric_of;
use super::couples::Couples;
use super::{Branch, DruckerPrager, LARGEST_FLOW, NoSolution, Returned, StressPoint, Trial};
use crate::continuum::tensor::{SymmetricExponential, symmetric};
use crate::material::active::ActiveSet;
use crate::material::curve::{Equations, Segment, follow};
use crate::material::dense::System;
use nalgebra::Matrix3;
use std::marker::PhantomData;

/// Most points that are looked at to find where `f` vanishes.
const MOST_LEVELS: usize = 100;

/// A point of the curve, or near it.
#[derive(Clone, Copy)]
struct Level {
    y: f64,
    /// `D`.
    flow: Matrix3<f64>,
    couples: Couples,
    exponential: SymmetricExponential,
    point: StressPoint,
    /// `z`.
    direction: Matrix3<f64>,
    /// `Q`.
    scale: f64,
    multiplier: f64,
    /// `y dev D - (1 - y) s/(2 mu) + (tr D - beta dg)/3 I`.
    residual: Matrix3<f64>,
    /// `f`.
    yield_value: f64,
}

/// The flow rule of a trial state as equations for the components of `D` and `y`.
struct FlowRule<'a, A, const WRYNESS: usize> {
    law: &'a DruckerPrager,
    trial: &'a Trial,
    components: PhantomData<A>,
}

impl DruckerPrager {
    /// The return to the cone. `N` is the number of independent components of a symmetric tensor and one.
    pub(super) fn search_cone<A: ActiveSet, const WRYNESS: usize, const N: usize>(
        &self,
        trial: &Trial,
    ) -> Result<Returned, NoSolution> {
        let rule = FlowRule::<A, WRYNESS> {
            law: self,
            trial,
            components: PhantomData,
        };
        let mut start = [0.0; N];
        start[N - 1] = 1.0;
        let stop = |x: &[f64; N]| {
            let level = rule.level(x);
            x[N - 1] <= 0.0 || level.is_none_or(|level| level.yield_value <= 0.0)
        };
        let segment = follow(&rule, start, -1.0, stop).ok_or(NoSolution {
            what: "the search for a return to the cone ended without one",
            residual: f64::INFINITY,
        })?;
        match rule.level(&segment.end) {
            Some(end) if end.yield_value > 0.0 => Err(self.beyond_the_cone(&end)),
            _ => self.root(&rule, &segment),
        }
    }

    /// Why there is no return where `f` is positive down to `q = 0`.
    fn beyond_the_cone(&self, level: &Level) -> NoSolution {
        NoSolution {
            what: if self.plastic.friction_slope == 0.0 {
                // All that is left of f at q = 0.
                "the strength is used up"
            } else {
                "no point of the cone answers: the yield function is positive down to the apex"
            },
            residual: level.yield_value / (3.0 * self.elastic.mu),
        }
    }

    /// Where `f` vanishes on a piece of the curve, by false position with the stale end halved (Illinois).
    fn root<A: ActiveSet, const WRYNESS: usize, const N: usize>(
        &self,
        rule: &FlowRule<'_, A, WRYNESS>,
        segment: &Segment<'_, FlowRule<'_, A, WRYNESS>, N>,
    ) -> Result<Returned, NoSolution> {
        let missing = NoSolution {
            what: "the search for a return to the cone ended without one",
            residual: f64::INFINITY,
        };
        let level_at = |length: f64| segment.at(length).and_then(|x| rule.level(&x)).ok_or(missing);
        let (mut low, mut high) = (0.0, segment.length);
        let mut best = level_at(high)?;
        let (mut at_low, mut at_high) = (level_at(low)?.yield_value, best.yield_value);
        for levels in 1..=MOST_LEVELS {
            let tolerance = self.yield_tolerance(rule.trial.old.chi + best.multiplier, best.point.shear);
            let length = low + at_low * (high - low) / (at_low - at_high);
            let closed = length <= low || length >= high;
            // Rounding allows no sharper value where no number is left between the ends.
            if best.yield_value.abs() <= if closed { tolerance } else { 1e-2 * tolerance } {
                return if best.y > 0.0 {
                    Ok(accepted(rule.trial, &best, levels))
                } else {
                    Err(self.beyond_the_cone(&best))
                };
            }
            if closed {
                break;
            }
            best = level_at(length)?;
            if best.yield_value > 0.0 {
                (low, at_low) = (length, best.yield_value);
                at_high *= 0.5;
            } else {
                (high, at_high) = (length, best.yield_value);
                at_low *= 0.5;
            }
        }
        Err(NoSolution {
            residual: best.yield_value / (3.0 * self.elastic.mu),
            ..missing
        })
    }
}

impl<A: ActiveSet, const WRYNESS: usize> FlowRule<'_, A, WRYNESS> {
    fn level<const N: usize>(&self, x: &[f64; N]) -> Option<Level> {
        let law = self.law;
        let y = x[N - 1];
        let flow = symmetric_of::<A>(x);
        let couples = law.couples_at::<A, WRYNESS>(self.trial, y).ok()?;
        // Written so that what is not a number is outside.
        let within = flow.norm() <= LARGEST_FLOW;
        if !within {
            return None;
        }
        let double_shear = 2.0 * law.elastic.mu;
        let exponential = SymmetricExponential::new(&-flow);
        let point = law.stress_point(self.trial, &(exponential.value * self.trial.stretch), &couples.wryness);
        let volume_flow = flow.trace();
        let deviatoric = flow - Matrix3::from_diagonal_element(volume_flow / 3.0);
        let direction = point.deviator + deviatoric * double_shear;
        let scale = (1.5 * (direction.norm_squared() + couples.square)).sqrt();
        let multiplier = (1.0 - y) * scale / (3.0 * law.elastic.mu);
        let volume_error = (volume_flow - law.plastic.dilatancy_slope * multiplier) / 3.0;
        Some(Level {
            y,
            flow,
            couples,
            exponential,
            direction,
            scale,
            multiplier,
            residual: deviatoric * y - point.deviator * ((1.0 - y) / double_shear)
                + Matrix3::from_diagonal_element(volume_error),
            yield_value: y * scale + law.plastic.friction_slope * point.pressure
                - law.strength(self.trial.old.chi + multiplier),
            point,
        })
    }

    /// Change of the residual with a change of `D`, at fixed `y`.
    fn rate_by_flow(&self, level: &Level, flow_rate: &Matrix3<f64>, stretch_rate: &Matrix3<f64>) -> Matrix3<f64> {
        let law = self.law;
        let double_shear = 2.0 * law.elastic.mu;
        let point = &level.point;
        let stress_rate = symmetric(
            &(law.maps.force.apply(stretch_rate) * point.stretch.transpose() + point.force * stretch_rate.transpose()),
        );
        let volume_rate = flow_rate.trace();
        let deviator_rate = stress_rate - Matrix3::from_diagonal_element(stress_rate.trace() / 3.0);
        let deviatoric_rate = flow_rate - Matrix3::from_diagonal_element(volume_rate / 3.0);
        let direction_rate = deviator_rate + deviatoric_rate * double_shear;
        let multiplier_rate = level.multiplier_rate(law, 1.5 * level.direction.dot(&direction_rate), 0.0);
        deviatoric_rate * level.y - deviator_rate * ((1.0 - level.y) / double_shear)
            + Matrix3::from_diagonal_element((volume_rate - law.plastic.dilatancy_slope * multiplier_rate) / 3.0)
    }

    /// Change of the residual with `y`, at fixed `D`.
    fn rate_by_y(&self, level: &Level) -> Matrix3<f64> {
        let law = self.law;
        let volume_flow = level.flow.trace();
        let deviatoric = level.flow - Matrix3::from_diagonal_element(volume_flow / 3.0);
        let multiplier_rate = level.multiplier_rate(law, 0.75 * level.couples.square_rate, 1.0);
        deviatoric + level.point.deviator / (2.0 * law.elastic.mu)
            - Matrix3::from_diagonal_element(law.plastic.dilatancy_slope * multiplier_rate / 3.0)
    }
}

impl Level {
    /// Change of `dg` with those of `Q^2/2` and `y`.
    fn multiplier_rate(&self, law: &DruckerPrager, half_square: f64, y: f64) -> f64 {
        let scale_rate = if self.scale > 0.0 {
            half_square / self.scale
        } else {
            0.0
        };
        ((1.0 - self.y) * scale_rate - y * self.scale) / (3.0 * law.elastic.mu)
    }
}

impl<A: ActiveSet, const WRYNESS: usize, const N: usize> Equations<N> for FlowRule<'_, A, WRYNESS> {
    fn residual(&self, x: &[f64; N]) -> Option<[f64; N]> {
        let level = self.level(x)?;
        let mut residual = [0.0; N];
        for (value, &pair) in residual.iter_mut().zip(A::SYMMETRIC) {
            *value = level.residual[pair];
        }
        Some(residual)
    }

    fn derivatives(&self, x: &[f64; N]) -> Option<System<N>> {
        let level = self.level(x)?;
        let principal = level.exponential.principal_factor(&self.trial.stretch);
        let mut system = System::zero();
        let by_y = self.rate_by_y(&level);
        for (column, &(k, l)) in A::SYMMETRIC.iter().enumerate() {
            let stretch_rate = -level.exponential.derivative_times((k, l), &principal);
            let mut flow_rate = Matrix3::zeros();
            (flow_rate[(k, l)], flow_rate[(l, k)]) = (1.0, 1.0);
            let rate = self.rate_by_flow(&level, &flow_rate, &stretch_rate);
            for (row, &pair) in system.rows.iter_mut().zip(A::SYMMETRIC) {
                row[column] = rate[pair];
                row[N - 1] = by_y[pair];
            }
        }
        Some(system)
    }
}

fn accepted(trial: &Trial, level: &Level, iterations: usize) -> Returned {
    Returned {
        stretch: level.point.stretch,
        wryness: level.couples.wryness,
        chi: trial.old.chi + level.multiplier,
        branch: Branch::Cone,
        iterations,
    }
}
