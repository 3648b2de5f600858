//! Return to the apex of the cone.
//!
//! At the apex `S(Gammae) = 0` and `sym tau = (k + H chi)/alpha I`; the skew part of `tau` stays elastic. The plastic
//! flow of the step is a symmetric tensor `D`, `Ue = exp(-D) Ue*`: as many unknowns as equations. The flow `D_G` of the
//! wryness that counts is the one that the cone tends to, the smallest that takes the couples away: where `S` is
//! singular, part of `Gammae` has no couples and needs none (`couples.rs`); it is set to zero, which no stress notices. Every direction between those of the cone is open at the apex, hence
//!
//! ```text
//! chi = chi~ + tr D/beta
//! e <= tr D/beta      e = sqrt(2/3 (dev D : dev D + lp^2 D_G : D_G))      D_G = (Gammae* - Gammae) U^-1
//! ```
//!
//! The second line tells the apex from the cone: a point of the cone with `q -> 0` has `D = dg N`, for which `e = dg`
//! and `tr D = beta dg`, so that the two returns meet where it is an equality. In small strains it is exactly the
//! condition that no point of the cone answers.
//!
//! With `beta = 0` the flow of the cone keeps the volume and `tr D/beta` has no meaning. Then the apex answers every
//! strain with `tr D >= 0`, and the multiplier is the norm of all flow, `sqrt(2/3 (D : D + lp^2 D_G : D_G))`: again the
//! cone's where the two meet (`tr D = 0`), and smooth beyond.

use super::couples::Couples;
use super::{Branch, DruckerPrager, LARGEST_FLOW, MOST_HALVINGS, MOST_ITERATIONS, PlasticState, Returned, Trial};
use super::{MicropolarModuli, NoSolution, StressPoint, force_rate};
use crate::continuum::tensor::{SymmetricExponential, component, symmetric, symmetric_eigen};
use crate::material::active::{ActiveSet, Pair};
use crate::material::curve::{Equations, follow};
use crate::material::dense::{Factors, System};
use nalgebra::Matrix3;
use std::marker::PhantomData;

/// Where the returns to cone and apex meet, rounding may favour neither: relative play of the condition above.
const PLAY: f64 = 1e-6;

/// The unknown with everything that follows from it.
#[derive(Clone, Copy)]
struct ApexState {
    /// `D`.
    flow: Matrix3<f64>,
    couples: Couples,
    exponential: SymmetricExponential,
    point: StressPoint,
    /// Increment of `chi`.
    multiplier: f64,
    /// `sym tau - (k + H chi)/alpha I`, over `2 mu`.
    residual: Matrix3<f64>,
}

impl DruckerPrager {
    /// Return to the apex, if the strain belongs to it.
    pub(super) fn return_to_apex<A: ActiveSet, const N: usize, const WRYNESS: usize>(
        &self,
        trial: &Trial,
    ) -> Result<Returned, NoSolution> {
        self.return_to_apex_from::<A, N, WRYNESS>(trial, &Matrix3::zeros())
    }

    /// The same from where the elastic stretch is a rotation and the stress small, as at most apices; then along a curve
    /// from the stress there to that of the apex: slower, and surer where the flow is large.
    pub(super) fn search_apex<A: ActiveSet, const N: usize, const WRYNESS: usize, const CURVE: usize>(
        &self,
        trial: &Trial,
    ) -> Result<Returned, NoSolution> {
        let missing = NoSolution {
            what: "the search for a return to the apex ended without one",
            residual: f64::INFINITY,
        };
        let (squares, directions) = symmetric_eigen(&symmetric(&(trial.stretch * trial.stretch.transpose())));
        let start = directions * Matrix3::from_diagonal(&squares.map(|x| 0.5 * x.ln())) * directions.transpose();
        if !start.sum().is_finite() {
            return Err(missing);
        }
        self.return_to_apex_from::<A, N, WRYNESS>(trial, &start).or_else(|_| {
            let couples = self.couples_at::<A, WRYNESS>(trial, 0.0)?;
            let path = ApexPath::<A> {
                law: self,
                trial,
                couples,
                start_stress: self.apex_state(trial, &couples, &start).point.symmetric_stress,
                components: PhantomData,
            };
            let mut from = [0.0; CURVE];
            for (value, &pair) in from.iter_mut().zip(A::SYMMETRIC) {
                *value = start[pair];
            }
            let end = follow(&path, from, 1.0, |x| x[CURVE - 1] >= 1.0).ok_or(missing)?.end;
            self.return_to_apex_from::<A, N, WRYNESS>(trial, &symmetric_of::<A>(&end))
        })
    }

    fn return_to_apex_from<A: ActiveSet, const N: usize, const WRYNESS: usize>(
        &self,
        trial: &Trial,
        start: &Matrix3<f64>,
    ) -> Result<Returned, NoSolution> {
        if self.plastic.friction_slope == 0.0 {
            return Err(NoSolution {
                what: "a cylinder has no apex",
                residual: f64::INFINITY,
            });
        }
        let couples = self.couples_at::<A, WRYNESS>(trial, 0.0)?;
        let mut state = self.apex_state(trial, &couples, start);
        let mut last: Option<Factors<N>> = None;
        for iterations in 0..MOST_ITERATIONS {
            if self.apex_converged(trial, &state) {
                if let Some(factors) = &last {
                    let polished = self.apex_step::<A, N>(trial, &state, factors, 1.0);
                    if polished.residual.norm() < state.residual.norm() {
                        state = polished;
                    }
                }
                return self.accept_apex(trial, &state, iterations);
            }
            let factors = self.apex_system::<A, N>(&state, trial).factorise().ok_or(NoSolution {
                what: "the local problem of the apex is singular",
                residual: state.residual.norm(),
            })?;
            state = self.apex_correction::<A, N>(trial, &state, &factors)?;
            last = Some(factors);
        }
        Err(NoSolution {
            what: "the return to the apex did not converge",
            residual: state.residual.norm(),
        })
    }

    fn accept_apex(&self, trial: &Trial, state: &ApexState, iterations: usize) -> Result<Returned, NoSolution> {
        let volume_flow = state.flow.trace();
        let deviatoric = state.flow - Matrix3::from_diagonal_element(volume_flow / 3.0);
        let shear_flow = self.equivalent_flow(&deviatoric, &state.couples);
        let beta = self.plastic.dilatancy_slope;
        let admissible = state.flow.norm() <= LARGEST_FLOW
            && if beta == 0.0 {
                volume_flow >= -PLAY * shear_flow
            } else {
                shear_flow <= state.multiplier * (1.0 + PLAY)
            };
        if !admissible {
            return Err(NoSolution {
                what: "the strain does not belong to the apex",
                residual: shear_flow,
            });
        }
        Ok(Returned {
            stretch: state.point.stretch,
            // What is left of it in the kernel of S has no stress and no say in later flow: zero is as good, and plain.
            wryness: Matrix3::zeros(),
            chi: trial.old.chi + state.multiplier,
            branch: Branch::Apex,
            iterations,
        })
    }

    /// Consistent moduli; `None` where the local problem is singular.
    pub(super) fn apex_moduli<A: ActiveSet, const N: usize, const WRYNESS: usize>(
        &self,
        trial: &Trial,
        new: &PlasticState,
        out: &mut MicropolarModuli,
    ) -> Option<()> {
        let couples = self.couples_at::<A, WRYNESS>(trial, 0.0).ok()?;
        let state = self.apex_state(trial, &couples, &self.flow_between(trial, new)?);
        let factors = self.apex_system::<A, N>(&state, trial).factorise()?;
        let (chi_by_stretch, chi_by_wryness) = self.multiplier_by_strain(trial, &state);
        let old_inverse = &trial.old.inverse_plastic_deformation;
        let principal = state.exponential.principal_factor(&trial.stretch);
        let stretches = A::DRIVEN_STRETCH.iter().map(|pair| (Some(*pair), *pair));
        let inputs = stretches.chain(A::DRIVEN_WRYNESS.iter().map(|pair| (None, *pair)));
        out.coupled = self.chi_couples();
        for (total, input) in inputs {
            // Change of Ue at fixed D.
            let mut stretch_rate = Matrix3::zeros();
            let chi_rate = match total {
                Some((a, b)) => {
                    stretch_rate = state.exponential.value.column(a) * old_inverse.row(b);
                    chi_by_stretch[(a, b)]
                }
                None => chi_by_wryness[input],
            };
            let right: [f64; N] = self.apex_residual_rates::<A, N>(&state.point, &stretch_rate, chi_rate);
            let flow_rates = factors.solve_one(&right);
            // The residual stays zero: dD = -(dr/dD)^-1 dr, and dUe/dD has a minus sign, too.
            for (rate, &pair) in flow_rates.iter().zip(A::SYMMETRIC) {
                stretch_rate += state.exponential.derivative_times(pair, &principal) * *rate;
            }
            let force = force_rate(&self.maps, trial, &state.point, &stretch_rate, total);
            if !force.sum().is_finite() {
                return None;
            }
            let (of_force, of_couple) = match total {
                Some(_) => (&mut out.force_stretch, &mut out.couple_stretch),
                None => (&mut out.force_wryness, &mut out.couple_wryness),
            };
            let input = component(input.0, input.1);
            for &(i, j) in A::DRIVEN_STRETCH {
                of_force[(component(i, j), input)] = force[(i, j)];
            }
            for &(i, j) in A::DRIVEN_WRYNESS {
                of_couple[(component(i, j), input)] = 0.0;
            }
        }
        Some(())
    }

    /// The flow of an accepted step: `exp(-D) = Ue Ue*^-1`.
    fn flow_between(&self, trial: &Trial, new: &PlasticState) -> Option<Matrix3<f64>> {
        let stretch = trial.total_stretch * new.inverse_plastic_deformation;
        let (values, directions) = symmetric_eigen(&symmetric(&(stretch * trial.stretch.try_inverse()?)));
        Some(directions * Matrix3::from_diagonal(&values.map(|value| -value.ln())) * directions.transpose())
    }

    fn apex_state(&self, trial: &Trial, couples: &Couples, flow: &Matrix3<f64>) -> ApexState {
        let exponential = SymmetricExponential::new(&-flow);
        let point = self.stress_point(trial, &(exponential.value * trial.stretch), &couples.wryness);
        let multiplier = self.multiplier_at_apex(couples, flow);
        let apex = self.strength(trial.old.chi + multiplier) / self.plastic.friction_slope;
        let residual = (point.symmetric_stress - Matrix3::from_diagonal_element(apex)) / (2.0 * self.elastic.mu);
        ApexState {
            flow: *flow,
            couples: *couples,
            exponential,
            point,
            multiplier,
            residual,
        }
    }

    fn multiplier_at_apex(&self, couples: &Couples, flow: &Matrix3<f64>) -> f64 {
        let beta = self.plastic.dilatancy_slope;
        if beta == 0.0 {
            self.equivalent_flow(flow, couples)
        } else {
            flow.trace() / beta
        }
    }

    /// `sqrt(2/3 (D : D + lp^2 D_G : D_G))`.
    fn equivalent_flow(&self, flow: &Matrix3<f64>, couples: &Couples) -> f64 {
        // lp^2 D_G : D_G with D_G = M U^T/(2 mu lp^2)
        let couples = couples.square / (2.0 * self.elastic.mu).powi(2);
        (2.0 / 3.0 * (flow.norm_squared() + couples)).sqrt()
    }

    fn apex_converged(&self, trial: &Trial, state: &ApexState) -> bool {
        let error = state.residual.norm();
        let stress_tolerance = self.yield_tolerance(trial.old.chi + state.multiplier, 0.0);
        error <= self.plastic.tolerance.max(16.0 * f64::EPSILON) && 2.0 * self.elastic.mu * error <= stress_tolerance
    }

    /// One damped correction: halved until the residual falls.
    fn apex_correction<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        state: &ApexState,
        factors: &Factors<N>,
    ) -> Result<ApexState, NoSolution> {
        let error = state.residual.norm();
        let mut fraction = 1.0;
        for _ in 0..=MOST_HALVINGS {
            let next = self.apex_step::<A, N>(trial, state, factors, fraction);
            if next.residual.norm() <= (1.0 - 1e-4 * fraction) * error || self.apex_converged(trial, &next) {
                return Ok(next);
            }
            fraction *= 0.5;
        }
        Err(NoSolution {
            what: "the return to the apex stalled",
            residual: error,
        })
    }

    /// The state after a fraction of the Newton correction.
    fn apex_step<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        state: &ApexState,
        factors: &Factors<N>,
        fraction: f64,
    ) -> ApexState {
        let correction = factors.solve_one(&std::array::from_fn(|row| state.residual[A::SYMMETRIC[row]]));
        let mut flow = state.flow;
        for (value, &(i, j)) in correction.iter().zip(A::SYMMETRIC) {
            flow[(i, j)] -= fraction * value;
            flow[(j, i)] = flow[(i, j)];
        }
        self.apex_state(trial, &state.couples, &flow)
    }

    /// Derivatives of the residual by the independent components of `D`.
    fn apex_system<A: ActiveSet, const N: usize>(&self, state: &ApexState, trial: &Trial) -> System<N> {
        let principal = state.exponential.principal_factor(&trial.stretch);
        let mut system = System::zero();
        for (column, &pair) in A::SYMMETRIC.iter().enumerate() {
            let stretch_rate = -state.exponential.derivative_times(pair, &principal);
            let chi_rate = self.multiplier_by_flow(state, pair);
            let rates: [f64; N] = self.apex_residual_rates::<A, N>(&state.point, &stretch_rate, chi_rate);
            for (row, rate) in system.rows.iter_mut().zip(rates) {
                row[column] = rate;
            }
        }
        system
    }

    /// Change of the residual with changes of `Ue` and `chi`.
    fn apex_residual_rates<A: ActiveSet, const N: usize>(
        &self,
        point: &StressPoint,
        stretch_rate: &Matrix3<f64>,
        chi_rate: f64,
    ) -> [f64; N] {
        let stress_rate = symmetric(
            &(self.maps.force.apply(stretch_rate) * point.stretch.transpose() + point.force * stretch_rate.transpose()),
        );
        let apex_rate = self.plastic.hardening_modulus / self.plastic.friction_slope * chi_rate;
        let mut rates = [0.0; N];
        for (rate, &(i, j)) in rates.iter_mut().zip(A::SYMMETRIC) {
            let mean = if i == j { apex_rate } else { 0.0 };
            *rate = (stress_rate[(i, j)] - mean) / (2.0 * self.elastic.mu);
        }
        rates
    }

    /// Derivative of the multiplier by an independent component of `D`.
    fn multiplier_by_flow(&self, state: &ApexState, (i, j): Pair) -> f64 {
        let beta = self.plastic.dilatancy_slope;
        if beta != 0.0 {
            return if i == j { 1.0 / beta } else { 0.0 };
        }
        // No flow at all, the start of the iteration: any subgradient of the norm will do.
        if state.multiplier == 0.0 {
            return 0.0;
        }
        let twice = if i == j { 1.0 } else { 2.0 };
        2.0 / 3.0 * twice * state.flow[(i, j)] / state.multiplier
    }

    /// Whether the multiplier, and with it the stress, depends on the strain at fixed `D`.
    fn chi_couples(&self) -> bool {
        self.plastic.dilatancy_slope == 0.0 && self.plastic.hardening_modulus != 0.0
    }

    /// Derivatives of the multiplier by total stretch and wryness at fixed `D`, through the smallest `D_G` with
    /// `S(Gammae* - D_G U) = 0`: half of the change of `D_G : D_G` is `c M : (d Gammae* - D_G dU)`.
    fn multiplier_by_strain(&self, trial: &Trial, state: &ApexState) -> (Matrix3<f64>, Matrix3<f64>) {
        if !self.chi_couples() || state.multiplier == 0.0 {
            return (Matrix3::zeros(), Matrix3::zeros());
        }
        let couple_flow = state.couples.flow_factor * trial.total_stretch.transpose();
        let factor = 2.0 / 3.0 * self.plastic.plastic_length.powi(2) / state.multiplier;
        let by_wryness = state.couples.flow_factor * factor;
        (-couple_flow.tr_mul(&by_wryness), by_wryness)
    }
}

/// The stress of the apex, reached from another one in proportion to one number `t`: equations for the components of
/// `D` and `t`.
struct ApexPath<'a, A> {
    law: &'a DruckerPrager,
    trial: &'a Trial,
    couples: Couples,
    /// `sym tau` where the curve begins.
    start_stress: Matrix3<f64>,
    components: PhantomData<A>,
}

/// The symmetric tensor with these independent components.
pub(super) fn symmetric_of<A: ActiveSet>(components: &[f64]) -> Matrix3<f64> {
    let mut tensor = Matrix3::zeros();
    for (&value, &(i, j)) in components.iter().zip(A::SYMMETRIC) {
        (tensor[(i, j)], tensor[(j, i)]) = (value, value);
    }
    tensor
}

impl<A: ActiveSet> ApexPath<'_, A> {
    /// The state with what is left of that stress at the apex.
    fn state<const N: usize>(&self, x: &[f64; N]) -> Option<ApexState> {
        let flow = symmetric_of::<A>(x);
        let within = flow.norm() <= LARGEST_FLOW;
        within.then(|| self.law.apex_state(self.trial, &self.couples, &flow))
    }

    /// What the target moves by with `t`, over `2 mu`.
    fn rate_by_share(&self, state: &ApexState) -> Matrix3<f64> {
        let double_shear = 2.0 * self.law.elastic.mu;
        state.residual - (state.point.symmetric_stress - self.start_stress) / double_shear
    }
}

impl<A: ActiveSet, const N: usize> Equations<N> for ApexPath<'_, A> {
    fn residual(&self, x: &[f64; N]) -> Option<[f64; N]> {
        let state = self.state(x)?;
        let left = state.residual - self.rate_by_share(&state) * (1.0 - x[N - 1]);
        let mut residual = [0.0; N];
        for (value, &pair) in residual.iter_mut().zip(A::SYMMETRIC) {
            *value = left[pair];
        }
        Some(residual)
    }

    fn derivatives(&self, x: &[f64; N]) -> Option<System<N>> {
        let state = self.state(x)?;
        let principal = state.exponential.principal_factor(&self.trial.stretch);
        let by_share = self.rate_by_share(&state);
        let mut system = System::zero();
        for (column, &pair) in A::SYMMETRIC.iter().enumerate() {
            let stretch_rate = -state.exponential.derivative_times(pair, &principal);
            let chi_rate = self.law.multiplier_by_flow(&state, pair) * x[N - 1];
            let rates: [f64; N] = self
                .law
                .apex_residual_rates::<A, N>(&state.point, &stretch_rate, chi_rate);
            for (row, rate) in system.rows.iter_mut().zip(rates) {
                row[column] = rate;
            }
        }
        for (row, &pair) in system.rows.iter_mut().zip(A::SYMMETRIC) {
            row[N - 1] = by_share[pair];
        }
        Some(system)
    }
}
