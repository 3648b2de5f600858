//! Plastic flow: what one step solves for.
//!
//! Stresses here are in units of the shear modulus. With `y = 3 dl/(2 q)` and the flow direction
//! `D(S) = 2 a1 S + 2 a2 S^T` the isochoric stretch and the deviator of the stress obey
//!
//! ```text
//! R = S - S^(V) = 0        V = Vt E        E = exp(-y D(S))
//! ```
//!
//! (`Vt` the trial stretch). The volume follows from the multiplier alone, `J = Jt exp(-md exp(-hd chi) dl)`, and so does
//! the wryness, whose deviatoric symmetric, skew and spherical parts shrink by `1/(1 + k y)` with a `k` each. What is
//! left are the components of `S` and the number `y` with the equations `R = 0` and `f = 0`: five unknowns in plane
//! strain, nine in space, in place of the ten and nineteen of elastic stretch, elastic wryness and multiplier.
//!
//! Newton's method starts at the solution for small strains, a scalar equation that is convex in `y`. Where it fails, `y` is
//! bracketed first, with `S` solved for at fixed `y`. Along that way `f` falls until dilatancy dies out at `dl = 1/hd`; then
//! the volume that was given back returns, and `f` may rise. A trial state whose tension is above the apex there has no
//! stress, rounded apex or not: the search sees the lowest `f` above zero and says so.

use super::exponential::Exponential;
use super::tensor::{Tensor, deviatoric_unit};
use crate::material::NoSolution;
use crate::material::curve::{Equations, follow};
use crate::material::dense::{Factors, System};
use crate::material::elastic::IsotropicMap;
use crate::material::spec::{SandstoneParameters, SandstoneYield};
use nalgebra::Matrix3;

/// Most local iterations before a return is given up.
const MOST_ITERATIONS: usize = 50;
/// Most halvings of a local correction.
const MOST_HALVINGS: usize = 10;
/// Most steps of the search for `y`.
const MOST_BRACKETINGS: usize = 60;
/// Smallest `1/(1 + 2 y)` that the curve is followed to.
const SMALLEST_SHARE: f64 = 1e-5;
/// Bisections of the piece of the curve where `f` vanishes, before the iteration takes over.
const CROSSING_BISECTIONS: usize = 8;

/// The law in units of the shear modulus.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlowRule {
    /// `K/G`.
    bulk: f64,
    /// `Gc/G`.
    coupling: f64,
    /// `M(Ge)` [N].
    couples: IsotropicMap,
    plastic: Option<Plastic>,
}

/// Numbers of the yield surface and the potential.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plastic {
    parameters: SandstoneYield,
    /// `k/G`.
    strength: f64,
    /// `hD/G`.
    hardening: f64,
    /// `(rounding/G)^2`.
    rounding_squared: f64,
    /// `a1 + a2` and `a1 - a2`: weights of the symmetric and skew part of `S`.
    weights: [f64; 2],
    /// Rounding of stresses.
    noise: f64,
    /// `k/G` of the three parts of the wryness.
    decay: [f64; 3],
    /// Share of the parts' squares in `J2/G^2` [m2].
    share: [f64; 3],
}

/// Trial wryness by parts: deviatoric symmetric, skew, spherical.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wryness {
    parts: [Matrix3<f64>; 3],
    /// Coefficients of the couple-stress of the parts [N].
    stiffness: [f64; 3],
    decay: [f64; 3],
    share: [f64; 3],
    /// `share |part|^2`.
    invariant: [f64; 3],
}

/// What a step starts from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial<T> {
    /// `Vt`.
    pub isochoric: T,
    /// `Jt`.
    pub volume: f64,
    /// `Jt^(-1/3)`.
    pub scale: f64,
    /// `Fp~^-1`.
    pub old_inverse: T,
    pub wryness: Wryness,
    /// `chi~`.
    pub chi: f64,
}

/// A state of stress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<T> {
    /// `V`.
    pub isochoric: T,
    /// `S/G`.
    pub deviator: T,
    /// `p/G`.
    pub pressure: f64,
    /// Nothing where the step is elastic.
    pub flow: Option<Flow<T>>,
}

/// Plastic flow of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flow<T> {
    /// `y G`.
    pub ratio: f64,
    /// `E`.
    pub exponential: Exponential<T>,
    /// `dl`.
    pub multiplier: f64,
    /// Logarithm of the plastic growth of the volume in this step.
    pub dilation: f64,
    /// `D(S)`.
    pub direction: T,
    /// `q/G`.
    pub shear: f64,
    /// `d(J2/G^2)/dy` of the couples.
    pub couple_rate: f64,
    /// Derivative of the dilation by the multiplier.
    pub dilation_rate: f64,
    /// Derivative of `f` by the multiplier at fixed `q`, with its sign turned.
    pub fall: f64,
    /// Corrections that it took to find this flow.
    pub corrections: usize,
}

/// A state of the iteration.
#[derive(Clone, Copy)]
struct Iterate<T> {
    point: Point<T>,
    flow: Flow<T>,
    /// `R`.
    residual: T,
    /// `f/G`.
    excess: f64,
}

impl Wryness {
    pub fn new(trial: &Matrix3<f64>, rule: &FlowRule) -> Self {
        let symmetric = (trial + trial.transpose()) * 0.5;
        let spherical = Matrix3::from_diagonal_element(trial.trace() / 3.0);
        let parts = [symmetric - spherical, (trial - trial.transpose()) * 0.5, spherical];
        let (decay, share) = rule
            .plastic
            .as_ref()
            .map_or(([0.0; 3], [0.0; 3]), |plastic| (plastic.decay, plastic.share));
        Self {
            parts,
            stiffness: stiffness_of_parts(&rule.couples),
            decay,
            share,
            invariant: [0, 1, 2].map(|i| share[i] * parts[i].norm_squared()),
        }
    }

    /// Elastic wryness after flow of the ratio `y G`.
    pub fn returned(&self, ratio: f64) -> Matrix3<f64> {
        self.combine(|i| 1.0 / (1.0 + self.decay[i] * ratio))
    }

    /// Effective couple-stress [N/m].
    pub fn couple(&self, ratio: f64) -> Matrix3<f64> {
        self.combine(|i| self.stiffness[i] / (1.0 + self.decay[i] * ratio))
    }

    /// Derivative of [`Self::couple`] by the ratio.
    pub fn couple_by_ratio(&self, ratio: f64) -> Matrix3<f64> {
        self.combine(|i| -self.stiffness[i] * self.decay[i] / (1.0 + self.decay[i] * ratio).powi(2))
    }

    /// Derivative of [`Self::couple`] by the trial wryness.
    pub fn couple_map(&self, ratio: f64) -> IsotropicMap {
        let [symmetric, skew, spherical] = [0, 1, 2].map(|i| self.stiffness[i] / (1.0 + self.decay[i] * ratio));
        IsotropicMap::new((spherical - symmetric) / 3.0, 0.5 * symmetric, 0.5 * skew)
    }

    /// Derivative of the couples' part of `J2/G^2` by the trial wryness.
    pub fn invariant_by_wryness(&self, ratio: f64) -> Matrix3<f64> {
        self.combine(|i| 2.0 * self.share[i] / (1.0 + self.decay[i] * ratio).powi(2))
    }

    /// The couples' part of `J2/G^2` and its derivative by the ratio.
    fn invariant(&self, ratio: f64) -> (f64, f64) {
        let mut sums = (0.0, 0.0);
        for i in 0..3 {
            let shrunk = 1.0 / (1.0 + self.decay[i] * ratio);
            let part = self.invariant[i] * shrunk * shrunk;
            sums.0 += part;
            sums.1 -= 2.0 * self.decay[i] * shrunk * part;
        }
        sums
    }

    fn combine(&self, factor: impl Fn(usize) -> f64) -> Matrix3<f64> {
        self.parts[0] * factor(0) + self.parts[1] * factor(1) + self.parts[2] * factor(2)
    }
}

/// Couple-stress of the deviatoric symmetric, skew and spherical part per unit of each.
fn stiffness_of_parts(map: &IsotropicMap) -> [f64; 3] {
    let symmetric = map.straight + map.crossed;
    [symmetric, map.straight - map.crossed, symmetric + 3.0 * map.trace]
}

impl FlowRule {
    pub fn new(parameters: &SandstoneParameters) -> Self {
        let modulus = parameters.shear_modulus;
        let couples = IsotropicMap::new(parameters.alpha, parameters.gamma, parameters.beta);
        Self {
            bulk: parameters.bulk_modulus / modulus,
            coupling: parameters.coupling_modulus / modulus,
            couples,
            plastic: parameters
                .plastic
                .map(|plastic| Plastic::new(plastic, parameters, &couples)),
        }
    }

    /// `S/G` of the isochoric stretch `V`.
    fn mandel<T: Tensor>(&self, v: &T) -> T {
        let skewed = (*v * *v).transpose();
        (v.transpose() * *v * (1.0 + self.coupling) - skewed * self.coupling).deviator()
    }

    /// Change of [`Self::mandel`].
    pub fn mandel_rate<T: Tensor>(&self, v: &T, change: &T) -> T {
        let half = v.transpose() * *change;
        let skewed = (*change * *v + *v * *change).transpose();
        ((half + half.transpose()) * (1.0 + self.coupling) - skewed * self.coupling).deviator()
    }

    fn pressure(&self, volume: f64) -> f64 {
        let square = volume * volume;
        0.25 * self.bulk * (square - 1.0 / square)
    }

    /// Derivative of the pressure by the logarithm of the volume.
    pub fn pressure_rate(&self, volume: f64) -> f64 {
        let square = volume * volume;
        0.5 * self.bulk * (square + 1.0 / square)
    }

    pub fn plastic(&self) -> Option<&Plastic> {
        self.plastic.as_ref()
    }

    /// The elastic state of a trial.
    pub fn elastic<T: Tensor>(&self, trial: &Trial<T>) -> Point<T> {
        Point {
            isochoric: trial.isochoric,
            deviator: self.mandel(&trial.isochoric),
            pressure: self.pressure(trial.volume),
            flow: None,
        }
    }

    /// The state at the end of a step.
    pub fn respond<T: Tensor, const N: usize>(&self, trial: &Trial<T>) -> Result<Point<T>, NoSolution> {
        let point = self.elastic(trial);
        let Some(plastic) = &self.plastic else {
            return Ok(point);
        };
        let shear = plastic.shear(&point.deviator, trial.wryness.invariant(0.0).0);
        let excess = plastic.excess(shear, point.pressure, trial.chi);
        if !excess.is_finite() {
            return Err(NoSolution {
                what: "the trial stress is not finite",
                residual: f64::INFINITY,
            });
        }
        if excess <= plastic.tolerance(shear) {
            return Ok(point);
        }
        let start = self.estimate(plastic, trial, &point.deviator);
        let mut corrections = 0;
        self.iterate::<T, N>(plastic, trial, &start, &mut corrections)
            .or_else(|_| self.search::<T, N>(plastic, trial, &start, &mut corrections))
            .map(|point| point.after(corrections))
    }

    /// An elastic state on the yield surface as one that is about to flow; `None` inside the surface, and for virgin
    /// material, which has not flowed before.
    pub fn about_to_flow<T: Tensor>(&self, trial: &Trial<T>) -> Option<Point<T>> {
        let plastic = self.plastic.as_ref().filter(|_| trial.chi > 0.0)?;
        let state = self.at(plastic, trial, &self.mandel(&trial.isochoric), 0.0)?;
        (state.excess >= -plastic.tolerance(state.flow.shear)).then_some(state.point)
    }

    /// The converged state of a step that is known to flow by `multiplier` to the isochoric stretch `v` and
    /// the elastic wryness `wryness`.
    pub fn rebuild<T: Tensor>(&self, trial: &Trial<T>, v: &T, wryness: &Wryness, multiplier: f64) -> Option<Point<T>> {
        let plastic = self.plastic.as_ref()?;
        let deviator = self.mandel(v);
        let ratio = 1.5 * multiplier / plastic.shear(&deviator, wryness.invariant(0.0).0);
        self.at(plastic, trial, &deviator, ratio).map(|iterate| iterate.point)
    }

    /// Everything that follows from the unknowns; `None` outside the domain.
    fn at<T: Tensor>(&self, plastic: &Plastic, trial: &Trial<T>, deviator: &T, ratio: f64) -> Option<Iterate<T>> {
        let direction = plastic.direction(deviator);
        let exponential = Exponential::new(&(direction * -ratio))?;
        let isochoric = trial.isochoric * exponential.value;
        let (couples, couple_rate) = trial.wryness.invariant(ratio);
        let shear = plastic.shear(deviator, couples);
        let multiplier = ratio * shear / 1.5;
        let chi = trial.chi + multiplier;
        let slope = plastic.parameters.dilatancy_slope * (-plastic.parameters.dilation_rate * chi).exp();
        let dilation = slope * multiplier;
        let dilation_rate = slope * (1.0 - plastic.parameters.dilation_rate * multiplier);
        let volume = trial.volume * (-dilation).exp();
        let pressure = self.pressure(volume);
        let fall = plastic.parameters.friction_slope * self.pressure_rate(volume) * dilation_rate
            + plastic.hardening_rate(chi);
        let flow = Flow {
            ratio,
            exponential,
            multiplier,
            dilation,
            direction,
            shear,
            couple_rate,
            dilation_rate,
            fall,
            corrections: 0,
        };
        Some(Iterate {
            point: Point {
                isochoric,
                deviator: *deviator,
                pressure,
                flow: Some(flow),
            },
            flow,
            residual: *deviator - self.mandel(&isochoric),
            excess: plastic.excess(shear, pressure, chi),
        })
    }

    /// Unknowns of a small strain: symmetric and skew part of `S` shrink as the couples do.
    fn estimate<T: Tensor>(&self, plastic: &Plastic, trial: &Trial<T>, deviator: &T) -> (T, f64) {
        let transposed = deviator.transpose();
        let parts = [(*deviator + transposed) * 0.5, (*deviator - transposed) * 0.5];
        let decay = self.decay(plastic);
        let squares = [0, 1].map(|i| plastic.weights[i] * parts[i].dot(&parts[i]));
        let mut ratio = 0.0;
        for _ in 0..MOST_ITERATIONS {
            let (mut j2, mut j2_rate) = trial.wryness.invariant(ratio);
            for i in 0..2 {
                let shrunk = 1.0 / (1.0 + decay[i] * ratio);
                let part = squares[i] * shrunk * shrunk;
                j2 += part;
                j2_rate -= 2.0 * decay[i] * shrunk * part;
            }
            let shear = (3.0 * j2 + plastic.rounding_squared).sqrt();
            let shear_rate = 1.5 * j2_rate / shear;
            let multiplier = ratio * shear / 1.5;
            let multiplier_rate = (shear + ratio * shear_rate) / 1.5;
            let chi = trial.chi + multiplier;
            let parameters = &plastic.parameters;
            let slope = parameters.dilatancy_slope * (-parameters.dilation_rate * chi).exp();
            let volume = trial.volume * (1.0 - slope * multiplier).max(1e-3);
            let excess = plastic.excess(shear, self.pressure(volume), chi);
            let fall = parameters.friction_slope * self.pressure_rate(volume) * slope + plastic.hardening_rate(chi);
            let rate = shear_rate - fall * multiplier_rate;
            let change = -excess / rate;
            // Also where the cone has no point for this trial: the iteration may start anywhere.
            if !change.is_finite() || ratio + change <= 0.0 {
                break;
            }
            ratio += change;
            if change.abs() <= 1e-3 * ratio {
                break;
            }
        }
        let [symmetric, skew] = [0, 1].map(|i| parts[i] * (1.0 / (1.0 + decay[i] * ratio)));
        (symmetric + skew, ratio)
    }

    /// Rates of the parts of `S`, symmetric and skew, that shrink by `1/(1 + rate y)` at small strains.
    fn decay(&self, plastic: &Plastic) -> [f64; 2] {
        [4.0 * plastic.weights[0], 4.0 * self.coupling * plastic.weights[1]]
    }

    /// `S` at another `y`, as at small strains.
    fn shrunk<T: Tensor>(&self, plastic: &Plastic, (deviator, from): &(T, f64), to: f64) -> T {
        let transposed = deviator.transpose();
        let parts = [(*deviator + transposed) * 0.5, (*deviator - transposed) * 0.5];
        let factors = self
            .decay(plastic)
            .map(|decay| (1.0 + decay * from) / (1.0 + decay * to));
        parts[0] * factors[0] + parts[1] * factors[1]
    }

    /// Newton's method from a start; counts its corrections.
    fn iterate<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        start: &(T, f64),
        corrections: &mut usize,
    ) -> Result<Point<T>, NoSolution> {
        let outside = NoSolution {
            what: "the plastic strain of the step is too large",
            residual: f64::INFINITY,
        };
        let mut state = self.at(plastic, trial, &start.0, start.1).ok_or(outside)?;
        let mut last: Option<Factors<N>> = None;
        for _ in 0..MOST_ITERATIONS {
            let merit = state.merit();
            if state.converged(plastic) {
                if let Some(factors) = last.as_ref().filter(|_| !state.is_sharp(plastic)) {
                    state = self.polished(plastic, trial, state, factors);
                }
                return state.accept();
            }
            *corrections += 1;
            let factors = self
                .system_of::<T, N>(plastic, trial, &state)
                .factorise()
                .ok_or(NoSolution {
                    what: "the local problem of the flow is singular",
                    residual: merit.sqrt(),
                })?;
            state = self.correct(plastic, trial, &state, &factors)?;
            last = Some(factors);
        }
        Err(NoSolution {
            what: "the return to the yield surface did not converge",
            residual: state.merit().sqrt(),
        })
    }

    /// One correction more with factors that are at hand, where it helps.
    fn polished<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        state: Iterate<T>,
        factors: &Factors<N>,
    ) -> Iterate<T> {
        let next = self.step(plastic, trial, &state, &factors.solve_one(&state.right_side()), 1.0);
        match next {
            Some(next) if next.merit() < state.merit() => next,
            _ => state,
        }
    }

    /// One damped correction: halved until the residuals fall.
    fn correct<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        state: &Iterate<T>,
        factors: &Factors<N>,
    ) -> Result<Iterate<T>, NoSolution> {
        let merit = state.merit();
        let correction = factors.solve_one(&state.right_side());
        let mut fraction = 1.0;
        for _ in 0..=MOST_HALVINGS {
            let next = self.step(plastic, trial, state, &correction, fraction);
            let better = |next: &Iterate<T>| next.merit() <= (1.0 - 1e-4 * fraction) * merit || next.converged(plastic);
            if let Some(next) = next.filter(better) {
                return Ok(next);
            }
            fraction *= 0.5;
        }
        Err(NoSolution {
            what: "the return to the yield surface stalled",
            residual: merit.sqrt(),
        })
    }

    /// The state after a fraction of a correction; `None` where there is none.
    fn step<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        state: &Iterate<T>,
        correction: &[f64; N],
        fraction: f64,
    ) -> Option<Iterate<T>> {
        let mut deviator = state.point.deviator;
        for (&pair, change) in T::DEVIATOR.iter().zip(correction) {
            deviator = deviator + deviatoric_unit::<T>(pair) * (fraction * change);
        }
        let ratio = state.flow.ratio + fraction * correction[N - 1];
        (ratio > 0.0).then(|| self.at(plastic, trial, &deviator, ratio))?
    }

    fn system_of<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        state: &Iterate<T>,
    ) -> System<N> {
        self.system(plastic, trial, &state.point.isochoric, &state.flow)
    }

    /// Derivatives of `R` and `f` by the components of `S` and by `y`.
    pub fn system<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        isochoric: &T,
        flow: &Flow<T>,
    ) -> System<N> {
        let mut system = System::zero();
        for (column, &pair) in T::DEVIATOR.iter().enumerate() {
            let change = deviatoric_unit::<T>(pair);
            let exponent = plastic.direction(&change) * -flow.ratio;
            let stretch = trial.isochoric * flow.exponential.rate(&exponent);
            let residual = change - self.mandel_rate(isochoric, &stretch);
            for (row, &pair) in T::DEVIATOR.iter().enumerate() {
                system.rows[row][column] = residual.at(pair);
            }
            system.rows[N - 1][column] = flow.excess_by_shear() * flow.shear_by_deviator(&change);
        }
        let stretch = trial.isochoric * flow.exponential.rate(&(flow.direction * -1.0));
        let residual = self.mandel_rate(isochoric, &stretch);
        for (row, &pair) in T::DEVIATOR.iter().enumerate() {
            system.rows[row][N - 1] = -residual.at(pair);
        }
        system.rows[N - 1][N - 1] = flow.excess_by_shear() * flow.shear_by_ratio() - flow.fall * flow.shear / 1.5;
        system
    }

    /// Return where the iteration fails: `y` between bounds, `S` solved for at each. Below the lower bound `f` is positive
    /// and falls; at the upper one it is negative, or rises.
    fn search<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        start: &(T, f64),
        corrections: &mut usize,
    ) -> Result<Point<T>, NoSolution> {
        let (mut low, mut high) = ((self.mandel(&trial.isochoric), 0.0), None);
        // The estimate may have run away where it has no root.
        let mut ratio = if (1e-3..1e3).contains(&start.1) { start.1 } else { 1.0 };
        let mut lowest = f64::INFINITY;
        for _ in 0..MOST_BRACKETINGS {
            let guess = self.shrunk(plastic, &low, ratio);
            match self.deviator_at::<T, N>(plastic, trial, &guess, ratio, corrections) {
                Some((state, slope)) if slope < 0.0 => {
                    lowest = lowest.min(state.excess);
                    let reached = (state.point.deviator, ratio);
                    if state.excess > 0.0 {
                        low = reached;
                    } else {
                        high = Some(ratio);
                        if let Ok(point) = self.iterate::<T, N>(plastic, trial, &reached, corrections) {
                            return Ok(point);
                        }
                    }
                }
                // Beyond the lowest `f`, or a shorter way from where the stress is known.
                _ => high = Some(ratio),
            }
            ratio = match high {
                Some(high) if low.1 > 0.0 => (low.1 * high).sqrt(),
                Some(high) => 0.1 * high,
                None => 4.0 * ratio,
            };
        }
        // From next to a double root, or to one of rounding.
        self.iterate::<T, N>(plastic, trial, &low, corrections)
            .or_else(|failure| match self.crossing::<T, N>(plastic, trial) {
                Some(start) => self.iterate::<T, N>(plastic, trial, &start, corrections),
                None => Err(failure),
            })
            .map_err(|_| NoSolution {
                what: if self.lowest_excess(plastic, trial) > 0.0 {
                    "the tension is beyond the apex of the yield surface, more than dilatancy can relieve"
                } else {
                    "the search for a return to the yield surface ended without one"
                },
                residual: lowest,
            })
    }

    /// Lower bound of `f/G` over all flow: no shear stress, all hardening and the largest dilatancy there is.
    fn lowest_excess<T: Tensor>(&self, plastic: &Plastic, trial: &Trial<T>) -> f64 {
        let parameters = &plastic.parameters;
        let rate = parameters.dilation_rate;
        // dl exp(-hd (chi + dl)) is largest at dl = 1/hd; without a rate it has no bound.
        let growth = if rate > 0.0 {
            parameters.dilatancy_slope * (-rate * trial.chi - 1.0).exp() / rate
        } else if parameters.dilatancy_slope > 0.0 {
            return f64::NEG_INFINITY;
        } else {
            0.0
        };
        let pressure = self.pressure(trial.volume * (-growth).exp());
        let sheared = parameters.friction_slope * pressure - plastic.strength - plastic.hardening;
        plastic.rounding_squared.sqrt() + sheared
    }

    /// Close to where `f` vanishes for the first time on the curve `R = 0`, which may turn back in `y` where skew stresses
    /// are large.
    fn crossing<T: Tensor, const N: usize>(&self, plastic: &Plastic, trial: &Trial<T>) -> Option<(T, f64)> {
        let path = FlowPath {
            rule: self,
            plastic,
            trial,
        };
        let elastic = self.mandel(&trial.isochoric);
        let mut start = [1.0; N];
        for (value, &pair) in start.iter_mut().zip(T::DEVIATOR) {
            *value = elastic.at(pair);
        }
        let beyond = |x: &[f64; N]| path.state(x).is_none_or(|state| state.excess <= 0.0);
        let segment = follow(&path, start, -1.0, |x| x[N - 1] <= SMALLEST_SHARE || beyond(x))?;
        path.state(&segment.end).filter(|state| state.excess <= 0.0)?;
        let (mut low, mut high) = (0.0, segment.length);
        for _ in 0..CROSSING_BISECTIONS {
            let middle = 0.5 * (low + high);
            *(if beyond(&segment.at(middle)?) {
                &mut high
            } else {
                &mut low
            }) = middle;
        }
        path.state(&segment.at(high)?)
            .map(|state| (state.point.deviator, state.flow.ratio))
    }

    /// Solves `R = 0` at fixed `y` from a guess of `S`; with the derivative of `f` by `y` along these solutions.
    fn deviator_at<T: Tensor, const N: usize>(
        &self,
        plastic: &Plastic,
        trial: &Trial<T>,
        guess: &T,
        ratio: f64,
        corrections: &mut usize,
    ) -> Option<(Iterate<T>, f64)> {
        let mut state = self.at(plastic, trial, guess, ratio)?;
        for _ in 0..MOST_ITERATIONS {
            *corrections += 1;
            let mut system = self.system_of::<T, N>(plastic, trial, &state);
            let by_excess = std::mem::replace(&mut system.rows[N - 1], [0.0; N]);
            system.rows[N - 1][N - 1] = 1.0;
            let factors = system.factorise()?;
            let error = state.residual.dot(&state.residual).sqrt();
            if error <= 1e-6 * state.flow.shear {
                let mut unit = [0.0; N];
                unit[N - 1] = 1.0;
                let along = factors.solve_one(&unit);
                let slope = by_excess.iter().zip(&along).map(|(a, b)| a * b).sum();
                return Some((state, slope));
            }
            let mut right = state.right_side::<N>();
            right[N - 1] = 0.0;
            let correction = factors.solve_one(&right);
            let closer = |fraction: f64| {
                let next = self.step(plastic, trial, &state, &correction, fraction)?;
                (next.residual.dot(&next.residual).sqrt() < error).then_some(next)
            };
            state = (0..MOST_HALVINGS as i32).find_map(|n| closer(0.5f64.powi(n)))?;
        }
        None
    }
}

/// `R = 0` as equations for the components of `S` and `1/(1 + 2 y)`, which is one without flow and falls to zero.
struct FlowPath<'a, T> {
    rule: &'a FlowRule,
    plastic: &'a Plastic,
    trial: &'a Trial<T>,
}

impl<T: Tensor> FlowPath<'_, T> {
    fn state<const N: usize>(&self, x: &[f64; N]) -> Option<Iterate<T>> {
        let mut deviator = T::identity() * 0.0;
        for (&value, &pair) in x.iter().zip(T::DEVIATOR) {
            deviator = deviator + deviatoric_unit::<T>(pair) * value;
        }
        let ratio = 0.5 * (1.0 / x[N - 1] - 1.0);
        self.rule.at(self.plastic, self.trial, &deviator, ratio)
    }
}

impl<T: Tensor, const N: usize> Equations<N> for FlowPath<'_, T> {
    fn residual(&self, x: &[f64; N]) -> Option<[f64; N]> {
        let state = self.state(x)?;
        let mut residual = [0.0; N];
        for (value, &pair) in residual.iter_mut().zip(T::DEVIATOR) {
            *value = state.residual.at(pair);
        }
        Some(residual)
    }

    fn derivatives(&self, x: &[f64; N]) -> Option<System<N>> {
        let state = self.state(x)?;
        let mut system = self.rule.system_of::<T, N>(self.plastic, self.trial, &state);
        let ratio_rate = -0.5 / x[N - 1].powi(2);
        system.rows.iter_mut().for_each(|row| row[N - 1] *= ratio_rate);
        Some(system)
    }
}

impl Plastic {
    fn new(parameters: SandstoneYield, elastic: &SandstoneParameters, couples: &IsotropicMap) -> Self {
        let modulus = elastic.shear_modulus;
        let [a1, a2, a3, a4] = parameters.weights;
        let stiffness = stiffness_of_parts(couples);
        // Weights of symmetric parts, spherical ones among them, and of the skew one.
        let weights = [a3 + a4, a3 - a4, a3 + a4].map(|weight| weight / parameters.plastic_length.powi(2));
        Self {
            parameters,
            strength: parameters.strength / modulus,
            hardening: parameters.hardening_stress / modulus,
            rounding_squared: (parameters.apex_rounding / modulus).powi(2),
            weights: [a1 + a2, a1 - a2],
            noise: 16.0 * f64::EPSILON * (1.0 + (elastic.bulk_modulus + elastic.coupling_modulus) / modulus),
            decay: [0, 1, 2].map(|i| 2.0 * weights[i] * stiffness[i] / modulus),
            share: [0, 1, 2].map(|i| weights[i] * (stiffness[i] / modulus).powi(2)),
        }
    }

    /// `D(S)`.
    pub fn direction<T: Tensor>(&self, deviator: &T) -> T {
        let [a1, a2, ..] = self.parameters.weights;
        if a2 == 0.0 {
            return *deviator * (2.0 * a1);
        }
        *deviator * (2.0 * a1) + deviator.transpose() * (2.0 * a2)
    }

    fn shear<T: Tensor>(&self, deviator: &T, couples: f64) -> f64 {
        let forces = 0.5 * self.direction(deviator).dot(deviator);
        (3.0 * (forces + couples) + self.rounding_squared).sqrt()
    }

    fn excess(&self, shear: f64, pressure: f64, chi: f64) -> f64 {
        let hardening = -self.hardening * (-self.parameters.hardening_rate * chi).exp_m1();
        shear + self.parameters.friction_slope * pressure - self.strength - hardening
    }

    fn hardening_rate(&self, chi: f64) -> f64 {
        let rate = self.parameters.hardening_rate;
        self.hardening * rate * (-rate * chi).exp()
    }

    /// `f/G` that counts as zero: relative to the stresses, never below their rounding.
    fn tolerance(&self, shear: f64) -> f64 {
        (self.parameters.tolerance * shear.max(self.strength)).max(self.noise)
    }

    pub fn friction_slope(&self) -> f64 {
        self.parameters.friction_slope
    }
}

impl<T: Tensor> Point<T> {
    /// The point with the number of corrections that it took.
    fn after(mut self, corrections: usize) -> Self {
        if let Some(flow) = &mut self.flow {
            flow.corrections = corrections;
        }
        self
    }
}

impl<T: Tensor> Flow<T> {
    /// Derivative of `f` by `q` at fixed `y`, through the multiplier `2 y q/3` too.
    pub fn excess_by_shear(&self) -> f64 {
        1.0 - self.fall * self.ratio / 1.5
    }

    /// Change of `q` with `S`.
    pub fn shear_by_deviator(&self, change: &T) -> f64 {
        1.5 * self.direction.dot(change) / self.shear
    }

    /// Derivative of `q` by `y` at fixed `S`.
    pub fn shear_by_ratio(&self) -> f64 {
        1.5 * self.couple_rate / self.shear
    }
}

impl<T: Tensor> Iterate<T> {
    /// Square of the norm of the residuals.
    fn merit(&self) -> f64 {
        self.residual.dot(&self.residual) + self.excess * self.excess
    }

    fn within(&self, tolerance: f64) -> bool {
        // Written so that what is not a number is outside.
        let residual = self.residual.dot(&self.residual).sqrt();
        residual <= tolerance && self.excess.abs() <= tolerance
    }

    fn converged(&self, plastic: &Plastic) -> bool {
        self.within(plastic.tolerance(self.flow.shear))
    }

    /// Whether the residuals are so small that another correction would be wasted.
    fn is_sharp(&self, plastic: &Plastic) -> bool {
        self.within((0.01 * plastic.tolerance(self.flow.shear)).max(0.25 * plastic.noise))
    }

    /// Minus the residuals.
    fn right_side<const N: usize>(&self) -> [f64; N] {
        let mut right = [0.0; N];
        for (value, &pair) in right.iter_mut().zip(T::DEVIATOR) {
            *value = -self.residual.at(pair);
        }
        right[N - 1] = -self.excess;
        right
    }

    fn accept(self) -> Result<Point<T>, NoSolution> {
        if self.flow.multiplier > 0.0 {
            Ok(self.point)
        } else {
            Err(NoSolution {
                what: "the return to the yield surface shows no plastic flow",
                residual: self.flow.multiplier.abs(),
            })
        }
    }
}
