//! Constitutive laws: three-dimensional, pure, one file each.

mod active;
#[cfg(test)]
pub(crate) mod check;
pub mod cone_fit;
mod curve;
mod dense;
pub mod driver;
pub mod drucker_prager;
pub mod elastic;
pub mod hencky;
pub mod sandstone;
pub mod spec;
#[cfg(test)]
mod trials;

use crate::continuum::classical::Classical;
use crate::continuum::gradient_micropolar::GradientMicropolar;
use crate::continuum::micropolar::Micropolar;
use crate::continuum::{Continuum, Variable};
use drucker_prager::DruckerPrager;
use elastic::Elastic;
use hencky::{Hencky, HenckyPlasticity};
use sandstone::Sandstone;
use spec::MaterialSpec;

/// Which components of strain and stress a scene can excite; a law solves for those alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Components {
    /// Plane strain: in a micropolar body `U11 U12 U21 U22 U33` and the wryness of rotations about axis 3.
    Plane,
    /// All.
    Space,
}

/// A law found no stress for a strain: outside its domain, or its local iteration failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoSolution {
    pub what: &'static str,
    /// Norm of the local residual where the iteration ended [-].
    pub residual: f64,
}

/// A constitutive law. Pure: same inputs, same outputs; `old` is the accepted state.
pub trait Material<C: Continuum>: Send + Sync {
    /// The state that a point carries, by name.
    fn state_variables(&self) -> &'static [Variable];
    /// Largest modulus that a strain is multiplied by [Pa]. Laws see deformations next to one, so that a stress is exact to
    /// about this times the machine precision, however small it is.
    fn largest_modulus(&self) -> f64;
    /// Writes the state of virgin material.
    fn initial_state(&self, state: &mut [f64]);
    /// Stress and new state at the end of a step. Overwrites `new` and `stress`; on an error both are meaningless.
    fn respond(
        &self,
        strain: &C::Strain,
        old: &[f64],
        new: &mut [f64],
        stress: &mut C::Stress,
    ) -> Result<(), NoSolution>;
    /// Consistent moduli at a strain whose response `new`, `stress` is known: no second return map.
    /// Overwrites the components that are active.
    fn moduli(&self, strain: &C::Strain, old: &[f64], new: &[f64], stress: &C::Stress, out: &mut C::Moduli);
    /// Moduli for the solve that opens a step, at the strain where the last step ended: a point that this step left on
    /// the yield surface is taken to flow on, although its response to no change of strain is elastic. Returns whether
    /// these are other than [`Self::moduli`].
    fn opening_moduli(
        &self,
        strain: &C::Strain,
        old: &[f64],
        new: &[f64],
        stress: &C::Stress,
        out: &mut C::Moduli,
    ) -> bool {
        self.moduli(strain, old, new, stress, out);
        false
    }
    /// How many iterations of its local problem the law takes to respond; none where the answer has a closed form.
    fn local_iterations(&self, _strain: &C::Strain, _old: &[f64]) -> usize {
        0
    }
}

/// The classical law with these parameters, for a scene that can excite these components.
pub fn classical_law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Classical>> {
    match spec {
        MaterialSpec::Elastic(moduli) => Box::new(Hencky::new(moduli, components)),
        MaterialSpec::Elastoplastic(moduli, plastic) => Box::new(HenckyPlasticity::new(moduli, plastic, components)),
        MaterialSpec::Sandstone(_) => unreachable!("refused by MaterialKeys::resolve"),
    }
}

/// The micropolar law with these parameters, for a scene that can excite these components.
pub fn micropolar_law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<Micropolar>> {
    match spec {
        MaterialSpec::Elastic(moduli) => Box::new(Elastic::new(moduli, components)),
        MaterialSpec::Elastoplastic(moduli, plastic) => Box::new(DruckerPrager::new(moduli, plastic, components)),
        MaterialSpec::Sandstone(parameters) => Box::new(Sandstone::new(parameters, components)),
    }
}

/// The law of the gradient-enhanced micropolar continuum with these parameters.
pub fn gradient_micropolar_law(spec: &MaterialSpec, components: Components) -> Box<dyn Material<GradientMicropolar>> {
    match spec {
        MaterialSpec::Sandstone(parameters) => Box::new(Sandstone::new(parameters, components)),
        MaterialSpec::Elastic(_) | MaterialSpec::Elastoplastic(..) => {
            unreachable!("refused by MaterialKeys::resolve")
        }
    }
}
