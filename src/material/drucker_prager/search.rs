//! Search for the return to the cone by one number: slower than the iteration of `cone.rs`, sure where that one fails.
//!
//! With `x = dg/q`, `y = 1/(1 + 3 mu x)` between 0 (the apex) and 1 (no flow), the flow `D` of the step
//! (`Ue = exp(-D) Ue*`) and the couples `M` of `couples.rs`, the flow rule reads without any division by `q`
//!
//! ```text
//! y dev D = (1 - y) s/(2 mu)      tr D = beta dg      dg = (1 - y) Q/(3 mu)      q = y Q
//! Q^2 = 3/2 (z : z + (M U^T U : M)/lp^2)              z = s + 2 mu dev D
//! ```
//!
//! For a given `y` the couples follow from a linear system and `D` from as many smooth equations as it has components;
//! the apex is no special place for them. What is left is `f(y) = 0`, one equation for one number. `f` is positive at
//! `y = 1`, the trial state. Where it is not at `y = 0`, a root lies between and is enclosed; else the strain belongs
//! to the apex.

use super::couples::Couples;
use super::{Branch, DruckerPrager, MOST_HALVINGS, MOST_ITERATIONS, NoSolution, Returned, StressPoint, Trial};
use crate::continuum::tensor::{SymmetricExponential, symmetric};
use crate::material::active::ActiveSet;
use crate::material::dense::System;
use nalgebra::Matrix3;

/// Most values of `y` that are looked at.
const MOST_LEVELS: usize = 100;

/// The flow rule at a `y` with a flow `D` that need not satisfy it.
#[derive(Clone, Copy)]
struct Level {
    y: f64,
    /// `D`.
    flow: Matrix3<f64>,
    /// `Gammae`.
    wryness: Matrix3<f64>,
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

/// Flows known so far: the last with `f > 0`, and with `f <= 0`, each with the value that false position uses for it.
struct Bracket {
    above: (Level, f64),
    below: Option<(Level, f64)>,
}

impl DruckerPrager {
    /// The return to the cone; `y` of the estimate is where the search starts.
    pub(super) fn search_cone<A: ActiveSet, const WRYNESS: usize, const SYMMETRIC: usize>(
        &self,
        trial: &Trial,
        start: f64,
    ) -> Result<Returned, NoSolution> {
        let solve_couples = |y: f64| self.couples_at::<A, WRYNESS>(trial, y);
        let solve = |y: f64, from: &Matrix3<f64>| {
            solve_couples(y).and_then(|couples| self.flow_at::<A, SYMMETRIC>(trial, y, &couples, from))
        };
        let elastic = self.level(trial, 1.0, &solve_couples(1.0)?, &Matrix3::zeros());
        let mut bracket = Bracket {
            above: (elastic, elastic.yield_value),
            below: None,
        };
        let mut y = start;
        for levels in 1..=MOST_LEVELS {
            let Ok(level) = solve(y, &bracket.nearest(y).flow) else {
                // Closer to a flow that is known.
                y = 0.5 * (y + bracket.nearest(y).y);
                continue;
            };
            let tolerance = self.yield_tolerance(trial.old.chi + level.multiplier, level.point.shear);
            if level.y > 0.0 && level.yield_value.abs() <= 1e-2 * tolerance {
                return Ok(returned(trial, &level, levels));
            }
            if level.y == 0.0 && level.yield_value > 0.0 {
                return Err(NoSolution {
                    what: "no point of the cone answers: the yield function is positive down to the apex",
                    residual: level.yield_value / (3.0 * self.elastic.mu),
                });
            }
            bracket.add(level);
            y = bracket.next();
            if bracket.is_closed(y) {
                // Rounding allows no sharper value.
                let best = bracket.best();
                if best.y > 0.0 && best.yield_value.abs() <= tolerance {
                    return Ok(returned(trial, best, levels));
                }
                break;
            }
        }
        Err(NoSolution {
            what: "the search for a return to the cone ended without one",
            residual: bracket.best().yield_value / (3.0 * self.elastic.mu),
        })
    }

    fn level(&self, trial: &Trial, y: f64, couples: &Couples, flow: &Matrix3<f64>) -> Level {
        let double_shear = 2.0 * self.elastic.mu;
        let exponential = SymmetricExponential::new(&-flow);
        let point = self.stress_point(trial, &(exponential.value * trial.stretch), &couples.wryness);
        let volume_flow = flow.trace();
        let deviatoric = flow - Matrix3::from_diagonal_element(volume_flow / 3.0);
        let direction = point.deviator + deviatoric * double_shear;
        let scale = (1.5 * (direction.norm_squared() + couples.square)).sqrt();
        let multiplier = (1.0 - y) * scale / (3.0 * self.elastic.mu);
        let volume_error = (volume_flow - self.plastic.dilatancy_slope * multiplier) / 3.0;
        Level {
            y,
            flow: *flow,
            wryness: couples.wryness,
            exponential,
            direction,
            scale,
            multiplier,
            residual: deviatoric * y - point.deviator * ((1.0 - y) / double_shear)
                + Matrix3::from_diagonal_element(volume_error),
            yield_value: y * scale + self.plastic.friction_slope * point.pressure
                - self.strength(trial.old.chi + multiplier),
            point,
        }
    }

    /// The flow that satisfies the flow rule at `y`, by a damped Newton iteration.
    fn flow_at<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        y: f64,
        couples: &Couples,
        from: &Matrix3<f64>,
    ) -> Result<Level, NoSolution> {
        const SHARPEST: f64 = 4.0 * f64::EPSILON;
        let mut level = self.level(trial, y, couples, from);
        for _ in 0..MOST_ITERATIONS {
            let error = level.residual.norm();
            if error <= SHARPEST {
                break;
            }
            let Some(factors) = self.flow_system::<A, N>(trial, &level).factorise() else {
                break;
            };
            let correction = factors.solve_one(&std::array::from_fn(|row| level.residual[A::SYMMETRIC[row]]));
            let step = |fraction: f64| {
                let mut flow = level.flow;
                for (value, &(i, j)) in correction.iter().zip(A::SYMMETRIC) {
                    flow[(i, j)] -= fraction * value;
                    flow[(j, i)] = flow[(i, j)];
                }
                self.level(trial, y, couples, &flow)
            };
            let next = (0..=MOST_HALVINGS as i32)
                .map(|halvings| 0.5_f64.powi(halvings))
                .map(|fraction| (fraction, step(fraction)))
                .find(|(fraction, next)| next.residual.norm() <= (1.0 - 1e-4 * fraction) * error);
            match next {
                Some((_, next)) => level = next,
                // Rounding allows no less, or the iteration is stuck: the norm tells.
                None => break,
            }
        }
        let error = level.residual.norm();
        if error <= (1e-3 * self.plastic.tolerance).max(64.0 * f64::EPSILON) {
            Ok(level)
        } else {
            Err(NoSolution {
                what: "the flow of the cone did not converge",
                residual: error,
            })
        }
    }

    /// Derivatives of the residual by the independent components of `D` at fixed `y`.
    fn flow_system<A: ActiveSet, const N: usize>(&self, trial: &Trial, level: &Level) -> System<N> {
        let double_shear = 2.0 * self.elastic.mu;
        let principal = level.exponential.principal_factor(&trial.stretch);
        let by_scale = self.plastic.dilatancy_slope * (1.0 - level.y) / (3.0 * self.elastic.mu);
        let mut system = System::zero();
        for (column, &(k, l)) in A::SYMMETRIC.iter().enumerate() {
            let stretch_rate = -level.exponential.derivative_times((k, l), &principal);
            let point = &level.point;
            let stress_rate = symmetric(
                &(self.maps.force.apply(&stretch_rate) * point.stretch.transpose()
                    + point.force * stretch_rate.transpose()),
            );
            let mut flow_rate = Matrix3::zeros();
            (flow_rate[(k, l)], flow_rate[(l, k)]) = (1.0, 1.0);
            let volume_rate = flow_rate.trace();
            let deviator_rate = stress_rate - Matrix3::from_diagonal_element(stress_rate.trace() / 3.0);
            let deviatoric_rate = flow_rate - Matrix3::from_diagonal_element(volume_rate / 3.0);
            let direction_rate = deviator_rate + deviatoric_rate * double_shear;
            let scale_rate = if level.scale > 0.0 {
                1.5 * level.direction.dot(&direction_rate) / level.scale
            } else {
                0.0
            };
            let rate = deviatoric_rate * level.y - deviator_rate * ((1.0 - level.y) / double_shear)
                + Matrix3::from_diagonal_element((volume_rate - by_scale * scale_rate) / 3.0);
            for (row, &pair) in system.rows.iter_mut().zip(A::SYMMETRIC) {
                row[column] = rate[pair];
            }
        }
        system
    }
}

impl Bracket {
    fn nearest(&self, y: f64) -> &Level {
        match &self.below {
            Some((below, _)) if y - below.y < self.above.0.y - y => below,
            _ => &self.above.0,
        }
    }

    /// The smaller of the two values.
    fn best(&self) -> &Level {
        match &self.below {
            Some((below, _)) if below.yield_value.abs() < self.above.0.yield_value.abs() => below,
            _ => &self.above.0,
        }
    }

    /// Takes the place of the end of its sign; the other end, stale, counts half from now on (Illinois).
    fn add(&mut self, level: Level) {
        let value = level.yield_value;
        if value > 0.0 {
            self.above = (level, value);
            if let Some((_, stale)) = &mut self.below {
                *stale *= 0.5;
            }
        } else {
            self.below = Some((level, value));
            self.above.1 *= 0.5;
        }
    }

    /// Where to look next: by false position, or further down as long as nothing lies below.
    fn next(&self) -> f64 {
        let (above, at_above) = &self.above;
        match &self.below {
            Some((below, at_below)) => below.y - at_below * (above.y - below.y) / (at_above - at_below),
            None if above.y > 1e-6 => 0.1 * above.y,
            None => 0.0,
        }
    }

    /// Whether no number is left strictly between the ends where the next value would be.
    fn is_closed(&self, y: f64) -> bool {
        self.below
            .as_ref()
            .is_some_and(|(below, _)| y <= below.y || y >= self.above.0.y)
    }
}

fn returned(trial: &Trial, level: &Level, iterations: usize) -> Returned {
    Returned {
        stretch: level.point.stretch,
        wryness: level.wryness,
        chi: trial.old.chi + level.multiplier,
        branch: Branch::Cone,
        iterations,
    }
}
