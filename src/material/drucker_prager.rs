//! Micropolar Drucker-Prager plasticity at finite strain, with returns to the cone and to its apex.
//!
//! `F = Fe Fp` and `Gamma = Gammae + Gammap` (O'Hare 2025, chapter 4). With the elastic stretch `Ue = Q^T Fe = U Fp^-1`
//! the law does not contain the rotation: in the rotated stresses (`Q^T . Q` of the Kirchhoff stresses)
//!
//! ```text
//! tau = B(Ue - I) Ue^T      nu = S(Gammae) U^T                         (total U in the second)
//! p = tr tau/3              s = sym tau - p I      q = sqrt(3/2 (s:s + nu:nu/lp^2))
//! f = q + alpha p - (k + H chi)                    g = q + beta p - H chi
//! N = dg/dtau = 3 s/(2 q) + beta/3 I               dg/dnu = 3 nu/(2 lp^2 q)
//! ```
//!
//! where `B(.)` and `S(.)` are the maps of the elastic law. Backward Euler over the step:
//!
//! ```text
//! Ue = exp(-dg N) Ue*      Gammae = Gammae* - dg 3/(2 lp^2 q) nu U      chi = chi~ + dg      f = 0
//! Ue* = U Fp~^-1           Gammae* = Gamma - Gammap~
//! ```
//!
//! (file `cone.rs`; `estimate.rs` says where its iteration starts; `search.rs` finds by bracketing what that iteration
//! misses). Beyond the apex no point of the cone is reached; `apex.rs` has the return to it and the condition that tells
//! the two apart. Only the symmetric part of `tau` yields.
//! With `alpha = beta = 0` (von Mises) there is no apex. What leaves the law, per unit reference volume:
//! `B = tau U^-T = B(Ue - I) Fp^-T` and `S(Gammae)`.
//!
//! Stress is positive in tension. State: `Fp^-1` [-], `Gammap` [1/m], `chi` [-], and the branch of the last return.
//!
//! **Tolerances.** The local iteration ends when the norm of the residuals of strain, `(r_U, lp r_Gamma)`, is below the
//! tolerance of the law and `|f|` below that tolerance times the larger of `|k + H chi|` and `q`, or where rounding
//! allows no less; one more correction with the last factors follows unless all is a hundred times sharper already.
//! A trial state beyond the surface by less than the tolerance of `|f|` is elastic, so that rounding at a point on the
//! surface decides nothing.

mod apex;
mod cone;
mod couples;
mod estimate;
mod search;

use super::active::{ActiveSet, Pair, PlaneSet, SpaceSet};
use super::elastic::{ElasticMaps, require_finite};
use super::spec::{ElasticModuli, PlasticParameters};
use super::{Components, Material, NoSolution};
use crate::continuum::Variable;
use crate::continuum::micropolar::{Micropolar, MicropolarModuli, MicropolarStrain, MicropolarStress};
use crate::continuum::tensor::{component, pack_tensor, symmetric, unpack_tensor};
use cone::Unknown;
use estimate::{Estimate, Start};
use nalgebra::Matrix3;

/// Most local iterations before a return is given up.
const MOST_ITERATIONS: usize = 50;
/// Most halvings of a local correction.
const MOST_HALVINGS: usize = 10;
/// Norm of the largest flow `D` of a step: a root beyond is one of the equations, not of a solid.
const LARGEST_FLOW: f64 = 8.0;

/// The elastoplastic micropolar law.
#[derive(Clone, Debug)]
pub struct DruckerPrager {
    maps: ElasticMaps,
    elastic: ElasticModuli,
    plastic: PlasticParameters,
    components: Components,
}

/// How a point responded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    Elastic,
    Cone,
    Apex,
}

impl Branch {
    /// Number that stands for the branch in the state.
    pub fn code(self) -> f64 {
        match self {
            Branch::Elastic => 0.0,
            Branch::Cone => 1.0,
            Branch::Apex => 2.0,
        }
    }

    /// The branch that [`Self::code`] stands for; any other number is the elastic one.
    pub fn from_code(code: f64) -> Self {
        if code == Branch::Cone.code() {
            Branch::Cone
        } else if code == Branch::Apex.code() {
            Branch::Apex
        } else {
            Branch::Elastic
        }
    }
}

/// What a point remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlasticState {
    /// `Fp^-1` [-].
    pub inverse_plastic_deformation: Matrix3<f64>,
    /// `Gammap` [1/m].
    pub plastic_wryness: Matrix3<f64>,
    /// Accumulated multiplier [-].
    pub chi: f64,
    /// Branch of the last return.
    pub branch: Branch,
}

impl Default for PlasticState {
    /// Virgin material.
    fn default() -> Self {
        Self {
            inverse_plastic_deformation: Matrix3::identity(),
            plastic_wryness: Matrix3::zeros(),
            chi: 0.0,
            branch: Branch::Elastic,
        }
    }
}

impl PlasticState {
    /// The parts, by name; tensors row by row.
    pub const VARIABLES: &'static [Variable] = &[
        Variable {
            name: "inverse_plastic_deformation",
            length: 9,
        },
        Variable {
            name: "plastic_wryness",
            length: 9,
        },
        Variable { name: "chi", length: 1 },
        Variable {
            name: "return_branch",
            length: 1,
        },
    ];

    pub fn pack(&self, out: &mut [f64]) {
        pack_tensor(&self.inverse_plastic_deformation, &mut out[0..9]);
        pack_tensor(&self.plastic_wryness, &mut out[9..18]);
        out[18] = self.chi;
        out[19] = self.branch.code();
    }

    pub fn unpack(values: &[f64]) -> Self {
        Self {
            inverse_plastic_deformation: unpack_tensor(&values[0..9]),
            plastic_wryness: unpack_tensor(&values[9..18]),
            chi: values[18],
            branch: Branch::from_code(values[19]),
        }
    }
}

/// The strain at the end of the step and the trial state it makes.
#[derive(Clone, Copy, Debug)]
struct Trial {
    /// `U`.
    total_stretch: Matrix3<f64>,
    /// `U^T U`.
    total_stretch_squared: Matrix3<f64>,
    /// `U^-1`.
    total_stretch_inverse: Matrix3<f64>,
    /// `Ue*`.
    stretch: Matrix3<f64>,
    /// `Gammae*`.
    wryness: Matrix3<f64>,
    old: PlasticState,
}

/// Stresses and invariants at an elastic strain.
#[derive(Clone, Copy, Debug)]
struct StressPoint {
    /// `Ue`.
    stretch: Matrix3<f64>,
    /// `B(Ue - I)`.
    force: Matrix3<f64>,
    /// `sym tau`.
    symmetric_stress: Matrix3<f64>,
    /// `s`.
    deviator: Matrix3<f64>,
    /// `p`.
    pressure: f64,
    /// `S(Gammae)`.
    couple: Matrix3<f64>,
    /// `nu U = S U^T U`.
    couple_flow: Matrix3<f64>,
    /// `q`.
    shear: f64,
}

/// Where a return ended.
#[derive(Clone, Copy, Debug)]
struct Returned {
    stretch: Matrix3<f64>,
    wryness: Matrix3<f64>,
    chi: f64,
    branch: Branch,
    /// Iterations of the local problem that found it.
    iterations: usize,
}

impl DruckerPrager {
    /// The law with these parameters; `plastic_length` must be positive.
    pub fn new(elastic: &ElasticModuli, plastic: &PlasticParameters, components: Components) -> Self {
        Self {
            maps: ElasticMaps::new(elastic),
            elastic: *elastic,
            plastic: *plastic,
            components,
        }
    }

    /// `k + H chi`.
    fn strength(&self, chi: f64) -> f64 {
        self.plastic.yield_strength + self.plastic.hardening_modulus * chi
    }

    /// `f`.
    fn yield_value(&self, point: &StressPoint, chi: f64) -> f64 {
        point.shear + self.plastic.friction_slope * point.pressure - self.strength(chi)
    }

    /// Stress below which `f` counts as zero: relative to the strength, never below the rounding of the stresses.
    fn yield_tolerance(&self, chi: f64, shear: f64) -> f64 {
        let scale = self.strength(chi).abs().max(shear.abs());
        let stiffness = 3.0 * self.elastic.lambda.abs() + 2.0 * self.elastic.mu + 2.0 * self.elastic.kappa;
        (self.plastic.tolerance * scale).max(16.0 * f64::EPSILON * stiffness)
    }

    fn stress_point(&self, trial: &Trial, stretch: &Matrix3<f64>, wryness: &Matrix3<f64>) -> StressPoint {
        let force = self.maps.force.apply(&(stretch - Matrix3::identity()));
        let symmetric_stress = symmetric(&(force * stretch.transpose()));
        let pressure = symmetric_stress.trace() / 3.0;
        let deviator = symmetric_stress - Matrix3::from_diagonal_element(pressure);
        let couple = self.maps.couple.apply(wryness);
        let couple_flow = couple * trial.total_stretch_squared;
        let couples = couple_flow.dot(&couple) / self.plastic.plastic_length.powi(2);
        StressPoint {
            stretch: *stretch,
            force,
            symmetric_stress,
            deviator,
            pressure,
            couple,
            couple_flow,
            shear: (1.5 * (deviator.norm_squared() + couples)).sqrt(),
        }
    }

    /// Derivative of the component `ij` of `sym tau` by component `ab` of `Ue`.
    fn stress_rate(&self, point: &StressPoint, (i, j): Pair, by: Pair) -> f64 {
        if i == j {
            self.stress_rate_unsymmetric(point, (i, i), by)
        } else {
            0.5 * (self.stress_rate_unsymmetric(point, (i, j), by) + self.stress_rate_unsymmetric(point, (j, i), by))
        }
    }

    /// Derivative of `tau_ij = B(Ue - I)_ik Ue_jk` by component `ab` of `Ue`.
    fn stress_rate_unsymmetric(&self, point: &StressPoint, (i, j): Pair, (a, b): Pair) -> f64 {
        let map = &self.maps.force;
        let u = &point.stretch;
        let mut rate = 0.0;
        if a == b {
            rate += map.trace * u[(j, i)];
        }
        if i == a {
            rate += map.straight * u[(j, b)];
        }
        if i == b {
            rate += map.crossed * u[(j, a)];
        }
        if j == a {
            rate += point.force[(i, b)];
        }
        rate
    }

    /// The return of a trial state beyond the surface.
    fn return_from(&self, trial: &Trial, trial_point: &StressPoint) -> Result<Returned, NoSolution> {
        match self.components {
            Components::Plane => self.respond_in::<PlaneSet, 10, 4, 4, 5>(trial, trial_point),
            Components::Space => self.respond_in::<SpaceSet, 19, 6, 9, 7>(trial, trial_point),
        }
    }

    /// The iterations that nearly always succeed come first; what follows them is slower, and surer.
    fn respond_in<A: ActiveSet, const CONE: usize, const APEX: usize, const WRYNESS: usize, const CURVE: usize>(
        &self,
        trial: &Trial,
        trial_point: &StressPoint,
    ) -> Result<Returned, NoSolution> {
        let elastic = Start {
            stretch: trial.stretch,
            wryness: trial.wryness,
            ratio: 0.0,
        };
        let apex = || self.return_to_apex::<A, APEX, WRYNESS>(trial);
        let cone = |start: &Start, unknown| self.return_to_cone::<A, CONE>(trial, start, unknown);
        let search = || {
            let along_curve = self.search_cone::<A, WRYNESS, CURVE>(trial);
            along_curve.or_else(|failure| {
                let to_apex = || self.search_apex::<A, APEX, WRYNESS, CURVE>(trial);
                apex().or_else(|_| to_apex()).map_err(|_| failure)
            })
        };
        match self.estimate(trial, trial_point) {
            Estimate::Cone(start) => cone(&start, Unknown::Ratio)
                .or_else(|_| cone(&start, Unknown::Multiplier))
                .or_else(|_| cone(&elastic, Unknown::Multiplier))
                .or_else(|_| search()),
            Estimate::Apex => apex()
                .or_else(|_| cone(&elastic, Unknown::Ratio))
                .or_else(|_| cone(&elastic, Unknown::Multiplier))
                .or_else(|_| search()),
        }
    }

    /// Moduli of a state as one of a branch.
    fn moduli_of(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &PlasticState,
        branch: Branch,
        out: &mut MicropolarModuli,
    ) {
        match self.components {
            Components::Plane => self.moduli_in::<PlaneSet, 10, 4, 4, 6>(strain, old, new, branch, out),
            Components::Space => self.moduli_in::<SpaceSet, 19, 6, 9, 18>(strain, old, new, branch, out),
        }
    }

    /// Whether an elastic response is still where the last step left it on the cone.
    fn is_about_to_flow(&self, strain: &MicropolarStrain, old: &[f64], new: &PlasticState) -> bool {
        if new.branch != Branch::Elastic || PlasticState::unpack(old).branch != Branch::Cone {
            return false;
        }
        Trial::new(strain, old).is_ok_and(|trial| {
            let point = self.stress_point(&trial, &trial.stretch, &trial.wryness);
            let tolerance = self.yield_tolerance(new.chi, point.shear);
            point.shear > 0.0 && self.yield_value(&point, new.chi) >= -tolerance
        })
    }

    /// Moduli of an elastic point: `dB = B(dU Fp^-1) Fp^-T`.
    fn elastic_moduli<A: ActiveSet>(&self, inverse_plastic: &Matrix3<f64>, out: &mut MicropolarModuli) {
        let g = inverse_plastic;
        let gg = g * g.transpose();
        let map = &self.maps.force;
        out.coupled = false;
        for &(k, l) in A::DRIVEN_STRETCH {
            for &(i, j) in A::DRIVEN_STRETCH {
                let mut modulus = map.trace * g[(j, i)] * g[(l, k)] + map.crossed * g[(l, i)] * g[(j, k)];
                if i == k {
                    modulus += map.straight * gg[(j, l)];
                }
                out.force_stretch[(component(i, j), component(k, l))] = modulus;
            }
        }
        for &kl in A::DRIVEN_WRYNESS {
            for &ij in A::DRIVEN_WRYNESS {
                let entry = (component(ij.0, ij.1), component(kl.0, kl.1));
                out.couple_wryness[entry] = self.maps.couple.coefficient(ij, kl);
            }
        }
    }

    fn moduli_in<A: ActiveSet, const CONE: usize, const APEX: usize, const WRYNESS: usize, const COLUMNS: usize>(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &PlasticState,
        branch: Branch,
        out: &mut MicropolarModuli,
    ) {
        let found = match branch {
            Branch::Elastic => None,
            Branch::Cone => Trial::new(strain, old)
                .ok()
                .and_then(|trial| self.cone_moduli::<A, CONE, COLUMNS>(&trial, strain, new, out)),
            Branch::Apex => Trial::new(strain, old)
                .ok()
                .and_then(|trial| self.apex_moduli::<A, APEX, WRYNESS>(&trial, new, out)),
        };
        // Also for a singular local problem, a limit of softening, where no consistent moduli exist.
        if found.is_none() {
            self.elastic_moduli::<A>(&new.inverse_plastic_deformation, out);
        }
    }
}

impl Trial {
    fn new(strain: &MicropolarStrain, old: &[f64]) -> Result<Self, NoSolution> {
        let old = PlasticState::unpack(old);
        let total_stretch = strain.stretch;
        let total_stretch_inverse = total_stretch.try_inverse().ok_or(NoSolution {
            what: "the stretch is singular",
            residual: f64::INFINITY,
        })?;
        Ok(Self {
            total_stretch,
            total_stretch_squared: total_stretch.tr_mul(&total_stretch),
            total_stretch_inverse,
            stretch: total_stretch * old.inverse_plastic_deformation,
            wryness: strain.wryness - old.plastic_wryness,
            old,
        })
    }
}

impl Material<Micropolar> for DruckerPrager {
    fn state_variables(&self) -> &'static [Variable] {
        PlasticState::VARIABLES
    }

    fn largest_modulus(&self) -> f64 {
        self.elastic.largest()
    }

    fn initial_state(&self, state: &mut [f64]) {
        PlasticState::default().pack(state);
    }

    fn respond(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &mut [f64],
        stress: &mut MicropolarStress,
    ) -> Result<(), NoSolution> {
        let trial = Trial::new(strain, old)?;
        let trial_point = self.stress_point(&trial, &trial.stretch, &trial.wryness);
        let excess = self.yield_value(&trial_point, trial.old.chi);
        if !excess.is_finite() {
            return Err(NoSolution {
                what: "the trial stress is not finite",
                residual: f64::INFINITY,
            });
        }
        if excess <= self.yield_tolerance(trial.old.chi, trial_point.shear) {
            let state = PlasticState {
                branch: Branch::Elastic,
                ..trial.old
            };
            state.pack(new);
            stress.force = trial_point.force * state.inverse_plastic_deformation.transpose();
            stress.couple = trial_point.couple;
            return require_finite(stress);
        }
        let returned = self.return_from(&trial, &trial_point)?;
        let state = PlasticState {
            inverse_plastic_deformation: trial.total_stretch_inverse * returned.stretch,
            plastic_wryness: strain.wryness - returned.wryness,
            chi: returned.chi,
            branch: returned.branch,
        };
        state.pack(new);
        let force = self.maps.force.apply(&(returned.stretch - Matrix3::identity()));
        stress.force = force * state.inverse_plastic_deformation.transpose();
        stress.couple = self.maps.couple.apply(&returned.wryness);
        require_finite(stress)
    }

    fn moduli(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &[f64],
        _stress: &MicropolarStress,
        out: &mut MicropolarModuli,
    ) {
        let new = PlasticState::unpack(new);
        self.moduli_of(strain, old, &new, new.branch, out);
    }

    fn opening_moduli(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &[f64],
        _stress: &MicropolarStress,
        out: &mut MicropolarModuli,
    ) -> bool {
        let new = PlasticState::unpack(new);
        let flows_on = self.is_about_to_flow(strain, old, &new);
        let branch = if flows_on { Branch::Cone } else { new.branch };
        self.moduli_of(strain, old, &new, branch, out);
        flows_on
    }

    fn local_iterations(&self, strain: &MicropolarStrain, old: &[f64]) -> usize {
        let Ok(trial) = Trial::new(strain, old) else { return 0 };
        let point = self.stress_point(&trial, &trial.stretch, &trial.wryness);
        let excess = self.yield_value(&point, trial.old.chi);
        if excess <= self.yield_tolerance(trial.old.chi, point.shear) {
            return 0;
        }
        self.return_from(&trial, &point)
            .map_or(0, |returned| returned.iterations)
    }
}

/// Derivative of `B = tau U^-T` from those of `Ue` and, where given, of `U` by its component `ab`:
/// `dB = (d tau - B dU^T) U^-T`.
fn force_rate(
    maps: &ElasticMaps,
    trial: &Trial,
    point: &StressPoint,
    stretch_rate: &Matrix3<f64>,
    total: Option<Pair>,
) -> Matrix3<f64> {
    let stress_rate =
        maps.force.apply(stretch_rate) * point.stretch.transpose() + point.force * stretch_rate.transpose();
    let inverse = &trial.total_stretch_inverse;
    let mut rate = stress_rate * inverse.transpose();
    if let Some((a, b)) = total {
        // B = B(Ue - I) Ue^T U^-T; its column b times row a of U^-T.
        let column = point.force * point.stretch.tr_mul(&inverse.row(b).transpose());
        rate -= column * inverse.column(a).transpose();
    }
    rate
}

#[cfg(test)]
mod tests;
