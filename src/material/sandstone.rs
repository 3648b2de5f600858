//! Gradient-enhanced micropolar damage-plasticity of sandstone at finite strain (Neuner et al. 2024, section 3.1).
//!
//! With the elastic stretch `Ue = U Fp^-1`, `J = det Ue`, the isochoric `V = J^(-1/3) Ue` and `Ge = Gamma - Gammap`, the
//! energy per reference volume is
//!
//! ```text
//! W = K/8 (J - 1/J)^2 + (1 - omega) { (G + Gc)/2 (V:V - 3) - Gc/2 (tr V^2 - 3) + w(Ge) }
//! w = 1/2 [(gamma + beta) Ge:Ge + (gamma - beta) Ge:Ge^T + alpha (tr Ge)^2]
//! ```
//!
//! so that damage leaves the volume stiffness as it is. Plasticity sees effective stresses, those with `omega = 0`: the
//! Mandel stress `Ue^T dW/dUe`, of which the mean depends on the volume alone and the deviator `S` on `V` alone, and the
//! couple-stress `M = dW/dGe`:
//!
//! ```text
//! p = K/4 (J^2 - J^-2)        S = dev[(G + Gc) V^T V - Gc (V^2)^T]
//! J2 = a1 S:S + a2 S:S^T + (a3 M:M + a4 M:M^T)/l^2          q = sqrt(3 J2 + rounding^2)
//! f = q + mf p - k - hD (1 - exp(-hexp chi))                g = q + md exp(-hd chi) p
//! ```
//!
//! The rounding of the cone's apex is an extension of the law: without it, there are strains that have no stress.
//! Backward Euler over the step, everything at its end:
//!
//! ```text
//! Fp = exp(dl dg/dSigma) Fp~     Gammap = Gammap~ + dl dg/dM     chi = chi~ + dl     f = 0
//! ```
//!
//! The driver of the damage is `alpha_d = ln det Fp`, and `omega = clip(1 - exp(-alpha/eps_f), 0, omega_max)` takes the
//! field `alpha` at the end of the step. Conjugates of the total strains: `B = dW/dUe Fp^-T` and `dW/dGe`.
//!
//! What the local iteration solves is in `flow.rs`, moduli in `moduli.rs`. State: `Fp^-1`, `Gammap`, `chi` and
//! `omega` (for output alone). Under the micropolar continuum the law is the same with `omega = 0`.

mod exponential;
mod flow;
mod moduli;
mod tensor;

use super::elastic::require_finite;
use super::spec::{SandstoneDamage, SandstoneParameters};
use super::{Components, Material, NoSolution};
use crate::continuum::gradient_micropolar::{
    GradientMicropolar, GradientMicropolarModuli, GradientMicropolarStrain, GradientMicropolarStress,
};
use crate::continuum::micropolar::{Micropolar, MicropolarModuli, MicropolarStrain, MicropolarStress};
use crate::continuum::tensor::{pack_tensor, unpack_tensor};
use crate::continuum::{Linearisation, Variable};
use flow::{FlowRule, Point, Trial, Wryness};
use nalgebra::Matrix3;
use tensor::{PlaneTensor, Tensor};

/// The sandstone law.
#[derive(Clone, Debug)]
pub struct Sandstone {
    parameters: SandstoneParameters,
    flow: FlowRule,
    components: Components,
}

/// What a point remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SandstoneState {
    /// `Fp^-1` [-].
    pub inverse_plastic_deformation: Matrix3<f64>,
    /// `Gammap` [1/m].
    pub plastic_wryness: Matrix3<f64>,
    /// Accumulated multiplier `alpha_p` [-].
    pub chi: f64,
    /// `omega` [-].
    pub damage: f64,
}

impl Default for SandstoneState {
    /// Virgin material.
    fn default() -> Self {
        Self {
            inverse_plastic_deformation: Matrix3::identity(),
            plastic_wryness: Matrix3::zeros(),
            chi: 0.0,
            damage: 0.0,
        }
    }
}

impl SandstoneState {
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
            name: "damage",
            length: 1,
        },
    ];

    pub fn pack(&self, out: &mut [f64]) {
        pack_tensor(&self.inverse_plastic_deformation, &mut out[0..9]);
        pack_tensor(&self.plastic_wryness, &mut out[9..18]);
        out[18] = self.chi;
        out[19] = self.damage;
    }

    pub fn unpack(values: &[f64]) -> Self {
        Self {
            inverse_plastic_deformation: unpack_tensor(&values[0..9]),
            plastic_wryness: unpack_tensor(&values[9..18]),
            chi: values[18],
            damage: values[19],
        }
    }

    /// Driver of the damage, `ln det Fp`.
    pub fn driver(&self) -> f64 {
        // Not minus zero for virgin material.
        0.0 - self.inverse_plastic_deformation.determinant().ln()
    }
}

/// `omega` and its derivative by `alpha`.
fn damage(parameters: Option<&SandstoneDamage>, alpha: f64) -> (f64, f64) {
    let Some(parameters) = parameters else {
        return (0.0, 0.0);
    };
    let exponent = -alpha / parameters.softening_modulus;
    let omega = -exponent.exp_m1();
    if omega <= 0.0 {
        (0.0, 0.0)
    } else if omega >= parameters.max_damage {
        (parameters.max_damage, 0.0)
    } else {
        (omega, exponent.exp() / parameters.softening_modulus)
    }
}

impl Sandstone {
    /// The law with these parameters.
    pub fn new(parameters: &SandstoneParameters, components: Components) -> Self {
        Self {
            parameters: *parameters,
            flow: FlowRule::new(parameters),
            components,
        }
    }

    /// Stress and new state with intact share `1 - omega` of the material.
    fn respond_in<T: Tensor, const N: usize>(
        &self,
        strain: &MicropolarStrain,
        old: &SandstoneState,
        omega: f64,
        stress: &mut MicropolarStress,
    ) -> Result<SandstoneState, NoSolution> {
        let trial = self.trial::<T>(strain, old)?;
        let point = self.flow.respond::<T, N>(&trial)?;
        let returned = match &point.flow {
            None => SandstoneState { damage: omega, ..*old },
            Some(flow) => {
                let spherical = (-flow.dilation / 3.0).exp();
                let advanced = trial.old_inverse * flow.exponential.value * spherical;
                SandstoneState {
                    inverse_plastic_deformation: advanced.full(),
                    plastic_wryness: strain.wryness - trial.wryness.returned(flow.ratio),
                    chi: old.chi + flow.multiplier,
                    damage: omega,
                }
            }
        };
        *stress = self.stress(&trial, &point, omega);
        require_finite(stress)?;
        Ok(returned)
    }

    fn trial<T: Tensor>(&self, strain: &MicropolarStrain, old: &SandstoneState) -> Result<Trial<T>, NoSolution> {
        let old_inverse = T::of(&old.inverse_plastic_deformation);
        let stretch = T::of(&strain.stretch) * old_inverse;
        let volume = stretch.determinant();
        // Written so that what is not a number is refused, too.
        let inside = volume > 0.0 && volume.is_finite();
        if !inside {
            return Err(NoSolution {
                what: "the elastic volume vanishes",
                residual: f64::INFINITY,
            });
        }
        let scale = 1.0 / volume.cbrt();
        Ok(Trial {
            isochoric: stretch * scale,
            volume,
            scale,
            old_inverse,
            wryness: Wryness::new(&(strain.wryness - old.plastic_wryness), &self.flow),
            chi: old.chi,
        })
    }

    /// `B = Jt^(-1/3) [p Vt^-T + (1 - omega) V^-T S E^T] Fp~^-T` with the trial `Vt`, `V = Vt E`, and the couples.
    fn stress<T: Tensor>(&self, trial: &Trial<T>, point: &Point<T>, omega: f64) -> MicropolarStress {
        let modulus = self.parameters.shear_modulus;
        let intact = 1.0 - omega;
        let isochoric = self.isochoric_force(point);
        let inner = trial.isochoric.cofactor() * point.pressure + isochoric * intact;
        let force = inner * trial.old_inverse.transpose() * (trial.scale * modulus);
        let ratio = point.flow.as_ref().map_or(0.0, |flow| flow.ratio);
        MicropolarStress {
            force: force.full(),
            couple: trial.wryness.couple(ratio) * intact,
        }
    }

    /// `V^-T S E^T` in units of the shear modulus.
    fn isochoric_force<T: Tensor>(&self, point: &Point<T>) -> T {
        let force = point.isochoric.cofactor() * point.deviator;
        match &point.flow {
            None => force,
            Some(flow) => force * flow.exponential.value.transpose(),
        }
    }

    fn respond_any(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        omega: f64,
        new: &mut [f64],
        stress: &mut MicropolarStress,
    ) -> Result<f64, NoSolution> {
        let old = SandstoneState::unpack(old);
        let state = match self.components {
            Components::Plane => self.respond_in::<PlaneTensor, 5>(strain, &old, omega, stress),
            Components::Space => self.respond_in::<Matrix3<f64>, 9>(strain, &old, omega, stress),
        }?;
        state.pack(new);
        let driver = state.driver();
        if driver.is_finite() && state.plastic_wryness.sum().is_finite() {
            Ok(driver)
        } else {
            Err(NoSolution {
                what: "the plastic strain is not finite",
                residual: f64::INFINITY,
            })
        }
    }

    fn corrections(&self, strain: &MicropolarStrain, old: &[f64]) -> usize {
        let old = SandstoneState::unpack(old);
        match self.components {
            Components::Plane => self.corrections_in::<PlaneTensor, 5>(strain, &old),
            Components::Space => self.corrections_in::<Matrix3<f64>, 9>(strain, &old),
        }
    }

    /// Corrections of the local problem; none where the step is elastic or has no stress.
    fn corrections_in<T: Tensor, const N: usize>(&self, strain: &MicropolarStrain, old: &SandstoneState) -> usize {
        self.trial::<T>(strain, old)
            .and_then(|trial| self.flow.respond::<T, N>(&trial))
            .ok()
            .and_then(|point| point.flow)
            .map_or(0, |flow| flow.corrections)
    }

    /// Moduli at `alpha` with damage `omega`, and its derivative. Returns whether they are those of a point that flows on.
    fn moduli_any(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &[f64],
        damage: (f64, f64),
        linearisation: Linearisation,
        out: &mut GradientMicropolarModuli,
    ) -> bool {
        let (old, new) = (SandstoneState::unpack(old), SandstoneState::unpack(new));
        match self.components {
            Components::Plane => self.moduli_in::<PlaneTensor, 5, 5>(strain, &old, &new, damage, linearisation, out),
            Components::Space => self.moduli_in::<Matrix3<f64>, 9, 10>(strain, &old, &new, damage, linearisation, out),
        }
    }
}

impl Material<GradientMicropolar> for Sandstone {
    fn state_variables(&self) -> &'static [Variable] {
        SandstoneState::VARIABLES
    }

    fn largest_modulus(&self) -> f64 {
        self.parameters.largest_modulus()
    }

    fn initial_state(&self, state: &mut [f64]) {
        SandstoneState::default().pack(state);
    }

    fn respond(
        &self,
        strain: &GradientMicropolarStrain,
        old: &[f64],
        new: &mut [f64],
        stress: &mut GradientMicropolarStress,
    ) -> Result<(), NoSolution> {
        let (omega, _) = damage(self.parameters.damage.as_ref(), strain.alpha);
        let driver = self.respond_any(&strain.micropolar, old, omega, new, &mut stress.micropolar)?;
        stress.source = strain.alpha - driver;
        stress.flux = strain.alpha_gradient * self.conductivity();
        if stress.source.is_finite() && stress.flux.sum().is_finite() {
            Ok(())
        } else {
            Err(NoSolution {
                what: "the nonlocal damage field is not finite",
                residual: f64::INFINITY,
            })
        }
    }

    fn moduli(
        &self,
        strain: &GradientMicropolarStrain,
        old: &[f64],
        new: &[f64],
        _stress: &GradientMicropolarStress,
        out: &mut GradientMicropolarModuli,
    ) {
        self.gradient_moduli(strain, old, new, Linearisation::Consistent, out);
    }

    fn opening_moduli(
        &self,
        strain: &GradientMicropolarStrain,
        old: &[f64],
        new: &[f64],
        _stress: &GradientMicropolarStress,
        out: &mut GradientMicropolarModuli,
    ) -> bool {
        self.gradient_moduli(strain, old, new, Linearisation::Opening, out)
    }

    fn local_iterations(&self, strain: &GradientMicropolarStrain, old: &[f64]) -> usize {
        self.corrections(&strain.micropolar, old)
    }
}

impl Sandstone {
    fn gradient_moduli(
        &self,
        strain: &GradientMicropolarStrain,
        old: &[f64],
        new: &[f64],
        linearisation: Linearisation,
        out: &mut GradientMicropolarModuli,
    ) -> bool {
        let damage = damage(self.parameters.damage.as_ref(), strain.alpha);
        out.source_alpha = 1.0;
        out.flux_gradient = self.conductivity();
        self.moduli_any(&strain.micropolar, old, new, damage, linearisation, out)
    }

    fn micropolar_moduli(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &[f64],
        linearisation: Linearisation,
        out: &mut MicropolarModuli,
    ) -> bool {
        let mut all = GradientMicropolarModuli::default();
        let flows_on = self.moduli_any(strain, old, new, (0.0, 0.0), linearisation, &mut all);
        *out = all.micropolar;
        flows_on
    }

    /// `l_d^2` [m2].
    fn conductivity(&self) -> f64 {
        self.parameters.damage.map_or(0.0, |damage| damage.length.powi(2))
    }
}

impl Material<Micropolar> for Sandstone {
    fn state_variables(&self) -> &'static [Variable] {
        SandstoneState::VARIABLES
    }

    fn largest_modulus(&self) -> f64 {
        self.parameters.largest_modulus()
    }

    fn initial_state(&self, state: &mut [f64]) {
        SandstoneState::default().pack(state);
    }

    fn respond(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &mut [f64],
        stress: &mut MicropolarStress,
    ) -> Result<(), NoSolution> {
        self.respond_any(strain, old, 0.0, new, stress).map(drop)
    }

    fn moduli(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &[f64],
        _stress: &MicropolarStress,
        out: &mut MicropolarModuli,
    ) {
        self.micropolar_moduli(strain, old, new, Linearisation::Consistent, out);
    }

    fn opening_moduli(
        &self,
        strain: &MicropolarStrain,
        old: &[f64],
        new: &[f64],
        _stress: &MicropolarStress,
        out: &mut MicropolarModuli,
    ) -> bool {
        self.micropolar_moduli(strain, old, new, Linearisation::Opening, out)
    }

    fn local_iterations(&self, strain: &MicropolarStrain, old: &[f64]) -> usize {
        self.corrections(strain, old)
    }
}

#[cfg(test)]
mod tests;
