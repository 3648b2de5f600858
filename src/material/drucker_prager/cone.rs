//! Return to the cone: a local Newton iteration, and the moduli by the implicit function theorem.
//!
//! Unknowns are the active components of `Ue` and `lp Gammae`, and the multiplier `dg`; residuals
//!
//! ```text
//! r_U = Ue - exp(-dg N) Ue*      r_Gamma = lp (Gammae + dg 3/(2 lp^2 q) nu U - Gammae*)      r_f = f/(3 mu)
//! ```
//!
//! all of the size of a strain. Near the apex `q` vanishes and the direction `s/q` turns with the slightest change of
//! stress. There it helps to let a Newton correction of `dg` act on `x = dg/q` instead, which is the same to first
//! order: the flow `dg N = 3/2 x s + ..` does not divide by `q` then, and `x` stays positive. Of the two forms each
//! reaches some points that the other does not, so that the second is tried where the first fails.

use super::estimate::Start;
use super::{Branch, DruckerPrager, LARGEST_FLOW, MOST_HALVINGS, MOST_ITERATIONS, PlasticState, Returned, Trial};
use super::{MicropolarModuli, MicropolarStrain, NoSolution, StressPoint, force_rate};
use crate::continuum::tensor::{SymmetricExponential, component};
use crate::material::active::{ActiveSet, Pair};
use crate::material::dense::{Factors, System};
use nalgebra::Matrix3;

/// The unknowns with everything that follows from them.
#[derive(Clone, Copy)]
struct ConeState {
    wryness: Matrix3<f64>,
    /// `x = dg/q`.
    ratio: f64,
    /// `dg`.
    multiplier: f64,
    point: StressPoint,
    exponential: SymmetricExponential,
    /// `exp(-dg N) Ue*`.
    returned_stretch: Matrix3<f64>,
    stretch_residual: Matrix3<f64>,
    wryness_residual: Matrix3<f64>,
    /// `f`.
    yield_value: f64,
}

/// What stands for the amount of flow while the iteration runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknown {
    /// `x = dg/q`.
    Ratio,
    /// `dg`.
    Multiplier,
}

/// The amount of flow, in either form.
#[derive(Clone, Copy)]
enum Amount {
    Ratio(f64),
    Multiplier(f64),
}

/// Derivatives of the invariants.
struct Gradients {
    pressure_by_stretch: Matrix3<f64>,
    shear_by_stretch: Matrix3<f64>,
    shear_by_wryness: Matrix3<f64>,
}

/// What all derivatives of the residuals share.
struct Rates {
    /// `d (exp(A) Ue*)` by the independent components of `A`: row per stretch, column per symmetric component.
    exponential: [[f64; 6]; 9],
    /// The same along `dA = s`.
    along_deviator: [f64; 9],
    gradients: Gradients,
}

impl DruckerPrager {
    pub(super) fn return_to_cone<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        start: &Start,
        unknown: Unknown,
    ) -> Result<Returned, NoSolution> {
        let mut state = self.cone_state(trial, &start.stretch, &start.wryness, Amount::Ratio(start.ratio));
        let mut last: Option<Factors<N>> = None;
        for iterations in 0..MOST_ITERATIONS {
            if self.cone_converged(trial, &state) {
                if let Some(factors) = last.as_ref().filter(|_| !self.cone_is_sharp(&state)) {
                    let polished = self.cone_step::<A, N>(trial, &state, factors, 1.0, unknown);
                    if self.cone_merit(&polished) < self.cone_merit(&state) {
                        state = polished;
                    }
                }
                return accept_cone(trial, &state, iterations);
            }
            let rates = self.rates::<A>(trial, &state);
            last = self.cone_system::<A, N>(trial, &state, &rates).factorise();
            let Some(factors) = &last else {
                return Err(NoSolution {
                    what: "the local problem of the cone is singular",
                    residual: self.cone_merit(&state).sqrt(),
                });
            };
            state = self.cone_correction::<A, N>(trial, &state, factors, unknown)?;
        }
        Err(NoSolution {
            what: "the return to the cone did not converge",
            residual: self.cone_merit(&state).sqrt(),
        })
    }

    /// Consistent moduli; `None` where the local problem is singular.
    pub(super) fn cone_moduli<A: ActiveSet, const N: usize, const COLUMNS: usize>(
        &self,
        trial: &Trial,
        strain: &MicropolarStrain,
        new: &PlasticState,
        out: &mut MicropolarModuli,
    ) -> Option<()> {
        let stretch = strain.stretch * new.inverse_plastic_deformation;
        let wryness = strain.wryness - new.plastic_wryness;
        let multiplier = Amount::Multiplier(new.chi - trial.old.chi);
        let state = self.cone_state(trial, &stretch, &wryness, multiplier);
        let rates = self.rates::<A>(trial, &state);
        let factors = self.cone_system::<A, N>(trial, &state, &rates).factorise()?;
        let rates = factors.solve(&self.cone_right_sides::<A, N, COLUMNS>(trial, &state, &rates));
        if !rates.iter().flatten().sum::<f64>().is_finite() {
            return None;
        }
        out.coupled = true;
        let inputs = A::DRIVEN_STRETCH.iter().map(|pair| (Some(*pair), *pair));
        let inputs = inputs.chain(A::DRIVEN_WRYNESS.iter().map(|pair| (None, *pair)));
        for (column, (total, input)) in inputs.enumerate() {
            let mut stretch_rate = Matrix3::zeros();
            for (row, &pair) in A::STRETCH.iter().enumerate() {
                stretch_rate[pair] = rates[row][column];
            }
            let mut wryness_rate = Matrix3::zeros();
            for (row, &pair) in A::WRYNESS.iter().enumerate() {
                wryness_rate[pair] = rates[A::STRETCH.len() + row][column] / self.plastic.plastic_length;
            }
            let force = force_rate(&self.maps, trial, &state.point, &stretch_rate, total);
            let couple = self.maps.couple.apply(&wryness_rate);
            let (of_force, of_couple) = match total {
                Some(_) => (&mut out.force_stretch, &mut out.couple_stretch),
                None => (&mut out.force_wryness, &mut out.couple_wryness),
            };
            let input = component(input.0, input.1);
            for &(i, j) in A::DRIVEN_STRETCH {
                of_force[(component(i, j), input)] = force[(i, j)];
            }
            for &(i, j) in A::DRIVEN_WRYNESS {
                of_couple[(component(i, j), input)] = couple[(i, j)];
            }
        }
        Some(())
    }

    fn cone_state(&self, trial: &Trial, stretch: &Matrix3<f64>, wryness: &Matrix3<f64>, amount: Amount) -> ConeState {
        let length = self.plastic.plastic_length;
        let point = self.stress_point(trial, stretch, wryness);
        let (ratio, multiplier) = match amount {
            Amount::Ratio(ratio) => (ratio, ratio * point.shear),
            Amount::Multiplier(multiplier) => (multiplier / point.shear, multiplier),
        };
        let spherical = Matrix3::from_diagonal_element(self.plastic.dilatancy_slope / 3.0 * multiplier);
        let exponential = SymmetricExponential::new(&-(point.deviator * (1.5 * ratio) + spherical));
        let returned_stretch = exponential.value * trial.stretch;
        let couple_factor = 1.5 * ratio / (length * length);
        ConeState {
            wryness: *wryness,
            ratio,
            multiplier,
            exponential,
            returned_stretch,
            stretch_residual: stretch - returned_stretch,
            wryness_residual: (wryness + point.couple_flow * couple_factor - trial.wryness) * length,
            yield_value: self.yield_value(&point, trial.old.chi + multiplier),
            point,
        }
    }

    /// Square of the norm of all residuals.
    fn cone_merit(&self, state: &ConeState) -> f64 {
        state.stretch_residual.norm_squared()
            + state.wryness_residual.norm_squared()
            + (state.yield_value / (3.0 * self.elastic.mu)).powi(2)
    }

    fn cone_converged(&self, trial: &Trial, state: &ConeState) -> bool {
        let shear = state.point.shear;
        // The direction s/q carries the rounding of the stretch, enlarged by mu/q: less cannot be asked.
        let rounding = 16.0 * f64::EPSILON * (1.0 + 2.0 * self.elastic.mu * state.ratio);
        let tolerance = self.plastic.tolerance.max(rounding.min(1e-9));
        let strain_error = (state.stretch_residual.norm_squared() + state.wryness_residual.norm_squared()).sqrt();
        let chi = trial.old.chi + state.multiplier;
        strain_error <= tolerance && state.yield_value.abs() <= self.yield_tolerance(chi, shear)
    }

    /// Whether the residuals are so far below the tolerance that another correction would be wasted.
    fn cone_is_sharp(&self, state: &ConeState) -> bool {
        self.cone_merit(state).sqrt() <= 0.01 * self.plastic.tolerance
    }

    /// One damped correction: halved until the residuals fall.
    fn cone_correction<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        state: &ConeState,
        factors: &Factors<N>,
        unknown: Unknown,
    ) -> Result<ConeState, NoSolution> {
        let merit = self.cone_merit(state);
        let mut fraction = 1.0;
        for _ in 0..=MOST_HALVINGS {
            let next = self.cone_step::<A, N>(trial, state, factors, fraction, unknown);
            if self.cone_merit(&next) <= (1.0 - 1e-4 * fraction) * merit || self.cone_converged(trial, &next) {
                return Ok(next);
            }
            fraction *= 0.5;
        }
        Err(NoSolution {
            what: "the return to the cone stalled",
            residual: merit.sqrt(),
        })
    }

    /// The state after a fraction of the Newton correction.
    fn cone_step<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        state: &ConeState,
        factors: &Factors<N>,
        fraction: f64,
        unknown: Unknown,
    ) -> ConeState {
        let mut residual = [0.0; N];
        for (row, &pair) in A::STRETCH.iter().enumerate() {
            residual[row] = state.stretch_residual[pair];
        }
        for (row, &pair) in A::WRYNESS.iter().enumerate() {
            residual[A::STRETCH.len() + row] = state.wryness_residual[pair];
        }
        residual[N - 1] = state.yield_value / (3.0 * self.elastic.mu);
        let correction = factors.solve_one(&residual);
        let mut stretch = state.point.stretch;
        for (row, &pair) in A::STRETCH.iter().enumerate() {
            stretch[pair] -= fraction * correction[row];
        }
        let mut wryness = state.wryness;
        for (row, &pair) in A::WRYNESS.iter().enumerate() {
            wryness[pair] -= fraction * correction[A::STRETCH.len() + row] / self.plastic.plastic_length;
        }
        let multiplier_change = -fraction * correction[N - 1];
        if unknown == Unknown::Multiplier {
            let amount = Amount::Multiplier(state.multiplier + multiplier_change);
            return self.cone_state(trial, &stretch, &wryness, amount);
        }
        let gradients = self.gradients(&state.point);
        let shear_change = gradients.shear_by_stretch.dot(&(stretch - state.point.stretch))
            + gradients.shear_by_wryness.dot(&(wryness - state.wryness));
        let ratio_change = (multiplier_change - state.ratio * shear_change) / state.point.shear;
        let amount = Amount::Ratio(moved_ratio(state.ratio, ratio_change));
        self.cone_state(trial, &stretch, &wryness, amount)
    }

    fn gradients(&self, point: &StressPoint) -> Gradients {
        let force = &self.maps.force;
        let u = &point.stretch;
        let s = &point.deviator;
        let factor = 1.5 / point.shear;
        let length = self.plastic.plastic_length;
        Gradients {
            pressure_by_stretch: (force.apply(u) + point.force) / 3.0,
            shear_by_stretch: (force.apply(&(s * u)) + s * point.force) * factor,
            shear_by_wryness: self.maps.couple.apply(&point.couple_flow) * (factor / (length * length)),
        }
    }

    fn rates<A: ActiveSet>(&self, trial: &Trial, state: &ConeState) -> Rates {
        let factor = state.exponential.principal_factor(&trial.stretch);
        let mut exponential = [[0.0; 6]; 9];
        for (column, &pair) in A::SYMMETRIC.iter().enumerate() {
            let rate = state.exponential.derivative_times(pair, &factor);
            for (row, &stretch) in A::STRETCH.iter().enumerate() {
                exponential[row][column] = rate[stretch];
            }
        }
        let along_deviator = exponential.map(|row| {
            let products = row
                .iter()
                .zip(A::SYMMETRIC)
                .map(|(rate, &pair)| rate * state.point.deviator[pair]);
            products.sum()
        });
        Rates {
            exponential,
            along_deviator,
            gradients: self.gradients(&state.point),
        }
    }

    /// Derivatives of the residuals by the unknowns.
    fn cone_system<A: ActiveSet, const N: usize>(&self, trial: &Trial, state: &ConeState, rates: &Rates) -> System<N> {
        let mut system = System::zero();
        self.columns_of_stretch::<A, N>(state, rates, &mut system);
        self.columns_of_wryness::<A, N>(trial, state, rates, &mut system);
        self.column_of_multiplier::<A, N>(state, rates, &mut system);
        system
    }

    fn columns_of_stretch<A: ActiveSet, const N: usize>(
        &self,
        state: &ConeState,
        rates: &Rates,
        system: &mut System<N>,
    ) {
        let ConeState {
            multiplier, ref point, ..
        } = *state;
        let length = self.plastic.plastic_length;
        // A = -dg N and dN = 3/2 (ds/q - s dq/q^2)
        let factor = -1.5 * multiplier / point.shear;
        let couple_factor = -length * 1.5 * multiplier / (length * length * point.shear * point.shear);
        for (column, &by) in A::STRETCH.iter().enumerate() {
            let (pressure, shear) = (
                rates.gradients.pressure_by_stretch[by],
                rates.gradients.shear_by_stretch[by],
            );
            let mut exponent_rate = [0.0; 6];
            for (value, &(i, j)) in exponent_rate.iter_mut().zip(A::SYMMETRIC) {
                let mean = if i == j { pressure } else { 0.0 };
                *value = factor * (self.stress_rate(point, (i, j), by) - mean);
            }
            for row in 0..A::STRETCH.len() {
                let through_deviator: f64 = (0..A::SYMMETRIC.len())
                    .map(|c| rates.exponential[row][c] * exponent_rate[c])
                    .sum();
                let through_shear = -factor * rates.along_deviator[row] * shear / point.shear;
                system.rows[row][column] = -(through_deviator + through_shear);
            }
            system.rows[column][column] += 1.0;
            for (row, &pair) in A::WRYNESS.iter().enumerate() {
                system.rows[A::STRETCH.len() + row][column] = couple_factor * point.couple_flow[pair] * shear;
            }
            system.rows[N - 1][column] = (shear + self.plastic.friction_slope * pressure) / (3.0 * self.elastic.mu);
        }
    }

    fn columns_of_wryness<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        state: &ConeState,
        rates: &Rates,
        system: &mut System<N>,
    ) {
        let ConeState {
            multiplier, ref point, ..
        } = *state;
        let length = self.plastic.plastic_length;
        let shears = A::STRETCH.len();
        let stretch_factor = -1.5 * multiplier / (point.shear * point.shear);
        let couple_factor = 1.5 * multiplier / (length * length * point.shear);
        for (column, &by) in A::WRYNESS.iter().enumerate() {
            let shear = rates.gradients.shear_by_wryness[by];
            for (row, rate) in rates.along_deviator[..shears].iter().enumerate() {
                system.rows[row][shears + column] = stretch_factor * rate * shear / length;
            }
            for (row, &pair) in A::WRYNESS.iter().enumerate() {
                let flow = self.couple_flow_rate(trial, pair, by) - point.couple_flow[pair] * shear / point.shear;
                system.rows[shears + row][shears + column] = couple_factor * flow;
            }
            system.rows[shears + column][shears + column] += 1.0;
            system.rows[N - 1][shears + column] = shear / (3.0 * self.elastic.mu * length);
        }
    }

    /// Derivative of `(S(Gammae) U^T U)_ij` by component `ab` of `Gammae`.
    fn couple_flow_rate(&self, trial: &Trial, (i, j): Pair, (a, b): Pair) -> f64 {
        let map = &self.maps.couple;
        let c = &trial.total_stretch_squared;
        let mut rate = 0.0;
        if a == b {
            rate += map.trace * c[(i, j)];
        }
        if i == a {
            rate += map.straight * c[(b, j)];
        }
        if i == b {
            rate += map.crossed * c[(a, j)];
        }
        rate
    }

    fn column_of_multiplier<A: ActiveSet, const N: usize>(
        &self,
        state: &ConeState,
        rates: &Rates,
        system: &mut System<N>,
    ) {
        let point = &state.point;
        let length = self.plastic.plastic_length;
        for (row, &pair) in A::STRETCH.iter().enumerate() {
            // The spherical part of N commutes with everything: its derivative is the exponential itself.
            system.rows[row][N - 1] = 1.5 / point.shear * rates.along_deviator[row]
                + self.plastic.dilatancy_slope / 3.0 * state.returned_stretch[pair];
        }
        for (row, &pair) in A::WRYNESS.iter().enumerate() {
            system.rows[A::STRETCH.len() + row][N - 1] = 1.5 / (length * point.shear) * point.couple_flow[pair];
        }
        system.rows[N - 1][N - 1] = -self.plastic.hardening_modulus / (3.0 * self.elastic.mu);
    }

    /// Minus the derivatives of the residuals by the total strains that a motion can change, one per column.
    fn cone_right_sides<A: ActiveSet, const N: usize, const COLUMNS: usize>(
        &self,
        trial: &Trial,
        state: &ConeState,
        rates: &Rates,
    ) -> [[f64; COLUMNS]; N] {
        let ConeState {
            multiplier, ref point, ..
        } = *state;
        let length = self.plastic.plastic_length;
        let couple = &point.couple;
        let nu = couple * trial.total_stretch.transpose();
        // nu = S U^T changes with U at fixed Gammae, and q with it.
        let shear_by_total = nu.tr_mul(couple) * (1.5 / (length * length * point.shear));
        let stretch_factor = 1.5 * multiplier / (point.shear * point.shear);
        let couple_factor = 1.5 * multiplier / (length * point.shear);
        let exponential = &state.exponential.value;
        let old_inverse = &trial.old.inverse_plastic_deformation;
        let mut right = [[0.0; COLUMNS]; N];
        for (column, &(a, b)) in A::DRIVEN_STRETCH.iter().enumerate() {
            let shear = shear_by_total[(a, b)];
            for (row, &(i, j)) in A::STRETCH.iter().enumerate() {
                right[row][column] =
                    exponential[(i, a)] * old_inverse[(b, j)] + stretch_factor * rates.along_deviator[row] * shear;
            }
            for (row, &(i, j)) in A::WRYNESS.iter().enumerate() {
                let mut flow =
                    couple[(i, b)] * trial.total_stretch[(a, j)] - point.couple_flow[(i, j)] * shear / point.shear;
                if j == b {
                    flow += nu[(i, a)];
                }
                right[A::STRETCH.len() + row][column] = -couple_factor * flow;
            }
            right[N - 1][column] = -shear / (3.0 * self.elastic.mu);
        }
        for (column, by) in A::DRIVEN_WRYNESS.iter().enumerate() {
            for (row, pair) in A::WRYNESS.iter().enumerate() {
                if pair == by {
                    right[A::STRETCH.len() + row][A::DRIVEN_STRETCH.len() + column] = length;
                }
            }
        }
        right
    }
}

/// The ratio after a change, which acts on its inverse where it would lower it: so it stays positive.
fn moved_ratio(ratio: f64, change: f64) -> f64 {
    if change < 0.0 && ratio > 0.0 {
        ratio / (1.0 - change / ratio)
    } else {
        ratio + change
    }
}

fn accept_cone(trial: &Trial, state: &ConeState, iterations: usize) -> Result<Returned, NoSolution> {
    let flow = 1.5 * state.ratio * state.point.deviator.norm();
    if flow > LARGEST_FLOW {
        return Err(NoSolution {
            what: "the return to the cone ended at a flow out of bounds",
            residual: flow,
        });
    }
    if state.point.shear > 0.0 && state.multiplier > 0.0 {
        Ok(Returned {
            stretch: state.point.stretch,
            wryness: state.wryness,
            chi: trial.old.chi + state.multiplier,
            branch: Branch::Cone,
            iterations,
        })
    } else {
        Err(NoSolution {
            what: "the return to the cone shows no plastic flow",
            residual: state.multiplier.abs(),
        })
    }
}
