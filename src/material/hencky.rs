//! Laws of the classical continuum: Hencky elasticity, and Drucker-Prager or von Mises plasticity on top of it.
//!
//! `F = Fe Fp` and `be = Fe Fe^T = F Cp^-1 F^T` with the plastic metric `Cp = Fp^T Fp`. In the logarithmic strain
//!
//! ```text
//! eps = 1/2 ln be      tau = lambda tr(eps) I + 2 mu eps
//! p = tr tau/3         s = tau - p I       q = sqrt(3/2 s:s)
//! f = q + alpha p - (k + H chi)            g = q + beta p - H chi
//! ```
//!
//! the exponential backward Euler step is the return map of small strains, along the principal directions of the trial
//! strain (`F` new, `Cp` old): `eps = eps* - dg dg/dtau`, `chi = chi~ + dg`. Its answer has a closed form, `invariants.rs`;
//! `principal.rs` holds the strain and what the principal directions do to the moduli.
//!
//! Stress is positive in tension. The elastic law has no state; that of plasticity is `Cp^-1` [-], `chi` [-] and the branch
//! of the last return. A trial state beyond the surface by less than the tolerance of the law times the larger of
//! `|k + H chi|` and `q` is elastic, so that rounding at a point on the surface decides nothing.

mod invariants;
mod principal;

use super::drucker_prager::Branch;
use super::spec::{ElasticModuli, PlasticParameters};
use super::{Components, Material, NoSolution};
use crate::continuum::Variable;
use crate::continuum::classical::{Classical, ClassicalModuli, ClassicalStrain, ClassicalStress};
use crate::continuum::tensor::{pack_symmetric, unpack_symmetric};
use invariants::{Rates, ReturnMap};
use nalgebra::Matrix3;
use principal::LogarithmicStrain;

/// The elastic law.
#[derive(Clone, Debug)]
pub struct Hencky {
    bulk: f64,
    shear: f64,
    components: Components,
}

impl Hencky {
    pub fn new(moduli: &ElasticModuli, components: Components) -> Self {
        Self {
            bulk: moduli.lambda + 2.0 / 3.0 * moduli.mu,
            shear: moduli.mu,
            components,
        }
    }
}

impl Material<Classical> for Hencky {
    fn state_variables(&self) -> &'static [Variable] {
        &[]
    }

    fn largest_modulus(&self) -> f64 {
        self.bulk + 4.0 / 3.0 * self.shear
    }

    fn initial_state(&self, _state: &mut [f64]) {}

    fn respond(
        &self,
        strain: &ClassicalStrain,
        _old: &[f64],
        _new: &mut [f64],
        stress: &mut ClassicalStress,
    ) -> Result<(), NoSolution> {
        let f = &strain.deformation_gradient;
        let trial = LogarithmicStrain::new(f, &Matrix3::identity())?;
        stress.kirchhoff = trial.stress(self.bulk * trial.volumetric, 2.0 * self.shear);
        require_finite(stress)
    }

    fn moduli(
        &self,
        strain: &ClassicalStrain,
        _old: &[f64],
        _new: &[f64],
        _stress: &ClassicalStress,
        out: &mut ClassicalModuli,
    ) {
        let f = &strain.deformation_gradient;
        // A strain that had a response has a logarithm.
        if let Ok(trial) = LogarithmicStrain::new(f, &Matrix3::identity()) {
            trial.moduli(&Rates::elastic(self.bulk, self.shear), self.components, out);
        }
    }
}

/// What a point of the plastic law remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetricState {
    /// `Cp^-1` [-].
    pub inverse_plastic_metric: Matrix3<f64>,
    /// Accumulated multiplier [-].
    pub chi: f64,
    /// Branch of the last return.
    pub branch: Branch,
}

impl Default for MetricState {
    /// Virgin material.
    fn default() -> Self {
        Self {
            inverse_plastic_metric: Matrix3::identity(),
            chi: 0.0,
            branch: Branch::Elastic,
        }
    }
}

impl MetricState {
    /// The parts, by name; the metric in the order of a symmetric tensor.
    pub const VARIABLES: &'static [Variable] = &[
        Variable {
            name: "inverse_plastic_metric",
            length: 6,
        },
        Variable { name: "chi", length: 1 },
        Variable {
            name: "return_branch",
            length: 1,
        },
    ];

    pub fn pack(&self, out: &mut [f64]) {
        pack_symmetric(&self.inverse_plastic_metric, &mut out[0..6]);
        out[6] = self.chi;
        out[7] = self.branch.code();
    }

    pub fn unpack(values: &[f64]) -> Self {
        Self {
            inverse_plastic_metric: unpack_symmetric(&values[0..6]),
            chi: values[6],
            branch: Branch::from_code(values[7]),
        }
    }
}

/// The elastoplastic law.
#[derive(Clone, Debug)]
pub struct HenckyPlasticity {
    map: ReturnMap,
    components: Components,
}

impl HenckyPlasticity {
    /// The law with these parameters; of the elastic ones those of rotations are not read, nor is the plastic length.
    pub fn new(elastic: &ElasticModuli, plastic: &PlasticParameters, components: Components) -> Self {
        Self {
            map: ReturnMap::new(elastic, plastic),
            components,
        }
    }

    /// Moduli as those of the branch that is chosen from that of the response, the state before it and the trial.
    fn moduli_of(
        &self,
        strain: &ClassicalStrain,
        old: &[f64],
        new: &[f64],
        choose: impl FnOnce(Branch, &MetricState, &LogarithmicStrain) -> Branch,
        out: &mut ClassicalModuli,
    ) {
        let (old, new) = (MetricState::unpack(old), MetricState::unpack(new));
        // A strain that had a response has a logarithm.
        if let Ok(trial) = LogarithmicStrain::new(&strain.deformation_gradient, &old.inverse_plastic_metric) {
            let branch = choose(new.branch, &old, &trial);
            let (volumetric, equivalent) = (trial.volumetric, trial.equivalent);
            let rates = self.map.rates(branch, volumetric, equivalent, [old.chi, new.chi]);
            trial.moduli(&rates, self.components, out);
        }
    }
}

impl Material<Classical> for HenckyPlasticity {
    fn state_variables(&self) -> &'static [Variable] {
        MetricState::VARIABLES
    }

    fn largest_modulus(&self) -> f64 {
        self.map.bulk + 4.0 / 3.0 * self.map.shear
    }

    fn initial_state(&self, state: &mut [f64]) {
        MetricState::default().pack(state);
    }

    fn respond(
        &self,
        strain: &ClassicalStrain,
        old: &[f64],
        new: &mut [f64],
        stress: &mut ClassicalStress,
    ) -> Result<(), NoSolution> {
        let mut state = MetricState::unpack(old);
        let f = &strain.deformation_gradient;
        let trial = LogarithmicStrain::new(f, &state.inverse_plastic_metric)?;
        let returned = self.map.respond(trial.volumetric, trial.equivalent, state.chi)?;
        stress.kirchhoff = trial.stress(returned.pressure, 2.0 * self.map.shear * returned.shear_ratio);
        require_finite(stress)?;
        state.branch = returned.branch;
        if returned.branch != Branch::Elastic {
            state.chi = returned.chi;
            let volumetric = returned.pressure / self.map.bulk;
            state.inverse_plastic_metric = trial.inverse_metric(f, volumetric, returned.shear_ratio)?;
        }
        state.pack(new);
        Ok(())
    }

    fn moduli(
        &self,
        strain: &ClassicalStrain,
        old: &[f64],
        new: &[f64],
        _stress: &ClassicalStress,
        out: &mut ClassicalModuli,
    ) {
        self.moduli_of(strain, old, new, |branch, _, _| branch, out);
    }

    fn opening_moduli(
        &self,
        strain: &ClassicalStrain,
        old: &[f64],
        new: &[f64],
        _stress: &ClassicalStress,
        out: &mut ClassicalModuli,
    ) -> bool {
        let mut flows_on = false;
        let branch = |branch, state: &MetricState, trial: &LogarithmicStrain| {
            // Still where the last step left it on the cone.
            flows_on = branch == Branch::Elastic
                && state.branch == Branch::Cone
                && self.map.is_on_cone(trial.volumetric, trial.equivalent, state.chi);
            if flows_on { Branch::Cone } else { branch }
        };
        self.moduli_of(strain, old, new, branch, out);
        flows_on
    }
}

/// A stress that is not a number is no stress.
fn require_finite(stress: &ClassicalStress) -> Result<(), NoSolution> {
    // Zero times anything finite is zero: one sum instead of nine tests.
    if (stress.kirchhoff * 0.0).sum() == 0.0 {
        Ok(())
    } else {
        Err(NoSolution {
            what: "the stress is not finite",
            residual: f64::INFINITY,
        })
    }
}

#[cfg(test)]
mod tests;
