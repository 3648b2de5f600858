//! Linear relation between the micropolar strains and their conjugates.
//!
//! ```text
//! B = lambda tr(E) I + 2 mu sym E + 2 kappa skew E            E = U - I
//! S = alpha tr(Gamma) I + 2 gamma sym Gamma + 2 beta skew Gamma
//! ```
//!
//! Isotropic and objective for rotations of any size, since `U` and `Gamma` are. No state.

use super::active::{ActiveSet, Pair, PlaneSet};
use super::spec::ElasticModuli;
use super::{Components, Material, NoSolution};
use crate::continuum::Variable;
use crate::continuum::micropolar::{Micropolar, MicropolarModuli, MicropolarStrain, MicropolarStress};
use crate::continuum::tensor::component;
use nalgebra::{Matrix3, SMatrix};

/// An isotropic linear map of tensors, `X -> trace tr(X) I + straight X + crossed X^T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsotropicMap {
    pub trace: f64,
    pub straight: f64,
    pub crossed: f64,
}

impl IsotropicMap {
    /// From the coefficients of the trace, of twice the symmetric and of twice the skew part.
    pub fn new(trace: f64, symmetric: f64, skew: f64) -> Self {
        Self {
            trace,
            straight: symmetric + skew,
            crossed: symmetric - skew,
        }
    }

    pub fn apply(&self, x: &Matrix3<f64>) -> Matrix3<f64> {
        let mut y = x * self.straight + x.transpose() * self.crossed;
        let mean = self.trace * x.trace();
        for i in 0..3 {
            y[(i, i)] += mean;
        }
        y
    }

    /// Component `ij` of the image by component `kl`.
    pub fn coefficient(&self, (i, j): (usize, usize), (k, l): (usize, usize)) -> f64 {
        let delta = |a: usize, b: usize| f64::from(u8::from(a == b));
        self.trace * delta(i, j) * delta(k, l)
            + self.straight * delta(i, k) * delta(j, l)
            + self.crossed * delta(i, l) * delta(j, k)
    }

    /// All coefficients, component `ij` at `3 i + j`.
    pub fn matrix(&self) -> SMatrix<f64, 9, 9> {
        SMatrix::from_fn(|row, column| self.coefficient((row / 3, row % 3), (column / 3, column % 3)))
    }
}

/// The two maps of the elastic law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticMaps {
    /// `B` of `E`.
    pub force: IsotropicMap,
    /// `S` of `Gamma`.
    pub couple: IsotropicMap,
}

impl ElasticMaps {
    pub fn new(moduli: &ElasticModuli) -> Self {
        Self {
            force: IsotropicMap::new(moduli.lambda, moduli.mu, moduli.kappa),
            couple: IsotropicMap::new(moduli.alpha, moduli.gamma, moduli.beta),
        }
    }
}

/// The elastic micropolar law.
#[derive(Clone, Debug)]
pub struct Elastic {
    maps: ElasticMaps,
    components: Components,
    moduli: MicropolarModuli,
    largest_modulus: f64,
}

impl Elastic {
    pub fn new(moduli: &ElasticModuli, components: Components) -> Self {
        let maps = ElasticMaps::new(moduli);
        Self {
            maps,
            components,
            moduli: MicropolarModuli {
                force_stretch: maps.force.matrix(),
                couple_wryness: maps.couple.matrix(),
                ..MicropolarModuli::default()
            },
            largest_modulus: moduli.largest(),
        }
    }
}

impl Material<Micropolar> for Elastic {
    fn state_variables(&self) -> &'static [Variable] {
        &[]
    }

    fn largest_modulus(&self) -> f64 {
        self.largest_modulus
    }

    fn initial_state(&self, _state: &mut [f64]) {}

    fn respond(
        &self,
        strain: &MicropolarStrain,
        _old: &[f64],
        _new: &mut [f64],
        stress: &mut MicropolarStress,
    ) -> Result<(), NoSolution> {
        stress.force = self.maps.force.apply(&(strain.stretch - Matrix3::identity()));
        stress.couple = self.maps.couple.apply(&strain.wryness);
        require_finite(stress)
    }

    fn moduli(
        &self,
        _strain: &MicropolarStrain,
        _old: &[f64],
        _new: &[f64],
        _stress: &MicropolarStress,
        out: &mut MicropolarModuli,
    ) {
        out.coupled = false;
        match self.components {
            Components::Space => {
                out.force_stretch = self.moduli.force_stretch;
                out.couple_wryness = self.moduli.couple_wryness;
            }
            Components::Plane => {
                copy_entries(
                    PlaneSet::DRIVEN_STRETCH,
                    &self.moduli.force_stretch,
                    &mut out.force_stretch,
                );
                copy_entries(
                    PlaneSet::DRIVEN_WRYNESS,
                    &self.moduli.couple_wryness,
                    &mut out.couple_wryness,
                );
            }
        }
    }
}

fn copy_entries(pairs: &[Pair], from: &SMatrix<f64, 9, 9>, to: &mut SMatrix<f64, 9, 9>) {
    for &(k, l) in pairs {
        for &(i, j) in pairs {
            let entry = (component(i, j), component(k, l));
            to[entry] = from[entry];
        }
    }
}

/// A stress that is not a number is no stress.
pub fn require_finite(stress: &MicropolarStress) -> Result<(), NoSolution> {
    // Zero times anything finite is zero: one sum instead of eighteen tests.
    let sum: f64 = (stress.force * 0.0 + stress.couple * 0.0).sum();
    if sum == 0.0 {
        Ok(())
    } else {
        Err(NoSolution {
            what: "the stress is not finite",
            residual: f64::INFINITY,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::check::{self, Random, Subject};

    fn moduli() -> ElasticModuli {
        ElasticModuli {
            lambda: 5e6,
            mu: 3e6,
            kappa: 1e6,
            alpha: 40.0,
            beta: 30.0,
            gamma: 100.0,
        }
    }

    #[test]
    fn obeys_the_laws_of_materials() {
        for components in [Components::Plane, Components::Space] {
            let law = Elastic::new(&moduli(), components);
            let mut random = Random::new(3);
            let situations: Vec<_> = (0..4)
                .map(|_| (random.strain(components, 0.3, 50.0), Vec::new()))
                .collect();
            let subject = Subject {
                law: &law,
                components,
                length: 0.005,
                step: 0.1,
                rounding: 0.0,
            };
            check::obeys::<Micropolar>(&subject, &situations);
        }
    }

    #[test]
    fn coefficients_multiply_trace_symmetric_and_skew_part() {
        let law = Elastic::new(&moduli(), Components::Space);
        let strain = Random::new(5).strain(Components::Space, 0.2, 3.0);
        let mut stress = MicropolarStress::default();
        law.respond(&strain, &[], &mut [], &mut stress).expect("finite");
        let e = strain.stretch - Matrix3::identity();
        let by_hand = |x: &Matrix3<f64>, trace: f64, symmetric: f64, skew: f64| {
            Matrix3::identity() * (trace * x.trace()) + (x + x.transpose()) * symmetric + (x - x.transpose()) * skew
        };
        assert!((stress.force - by_hand(&e, 5e6, 3e6, 1e6)).norm() < 1e-9 * stress.force.norm());
        assert!((stress.couple - by_hand(&strain.wryness, 40.0, 100.0, 30.0)).norm() < 1e-12 * stress.couple.norm());
    }
}
