//! One material point without a body: a path of deformation in, the path of stress out.
//!
//! `mpm-petsc point` and calibration use it. The path prescribes what a law sees, so that nothing is solved but the law.

use super::{Material, NoSolution};
use crate::continuum::classical::{Classical, ClassicalMotion, ClassicalStrain};
use crate::continuum::gradient_micropolar::{GradientMicropolar, GradientMicropolarMotion, GradientMicropolarStrain};
use crate::continuum::micropolar::{Micropolar, MicropolarMotion, MicropolarStrain};
use crate::continuum::{Continuum, Observation, total_length};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The deformation of a point at the end of a step, counted from the undeformed state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deformation {
    /// Deformation gradient `F` [-].
    pub gradient: Matrix3<f64>,
    /// Rotation vector of the micro-rotation `Q` [rad]; not read by a classical continuum.
    pub rotation: Vector3<f64>,
    /// Wryness [1/m]; not read by a classical continuum.
    pub wryness: Matrix3<f64>,
    /// Nonlocal damage field [-], without a gradient; read by a continuum that has one.
    pub alpha: f64,
}

impl Default for Deformation {
    /// None.
    fn default() -> Self {
        Self {
            gradient: Matrix3::identity(),
            rotation: Vector3::zeros(),
            wryness: Matrix3::zeros(),
            alpha: 0.0,
        }
    }
}

impl Deformation {
    /// The share of this deformation that is reached after part of a path: linear in `F - I`, in the rotation vector, in
    /// the wryness and in `alpha`.
    pub fn portion(&self, share: f64) -> Self {
        Self {
            gradient: Matrix3::identity() + (self.gradient - Matrix3::identity()) * share,
            rotation: self.rotation * share,
            wryness: self.wryness * share,
            alpha: self.alpha * share,
        }
    }

    /// The micro-rotation `Q`.
    pub fn rotation_matrix(&self) -> Matrix3<f64> {
        UnitQuaternion::from_scaled_axis(self.rotation)
            .to_rotation_matrix()
            .into_inner()
    }
}

/// What a law answered at the end of a step.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Cauchy stresses and what else can be seen of the point.
    pub observation: Observation,
    /// Equivalent plastic strain [-], where the law has one.
    pub chi: Option<f64>,
    /// Damage [-], where the law has one.
    pub damage: Option<f64>,
    /// Iterations of the local problem of the law.
    pub local_iterations: usize,
}

/// A continuum whose strain follows from a prescribed deformation.
pub trait Driven: Continuum {
    /// What a law sees of a deformation, and the motion that it is the end of.
    fn prescribe(deformation: &Deformation) -> (Self::Strain, Self::Motion);
}

impl Driven for Classical {
    fn prescribe(deformation: &Deformation) -> (ClassicalStrain, ClassicalMotion) {
        let deformation_gradient = deformation.gradient;
        (
            ClassicalStrain { deformation_gradient },
            ClassicalMotion { deformation_gradient },
        )
    }
}

impl Driven for Micropolar {
    fn prescribe(deformation: &Deformation) -> (MicropolarStrain, MicropolarMotion) {
        let strain = MicropolarStrain {
            stretch: deformation.rotation_matrix().tr_mul(&deformation.gradient),
            wryness: deformation.wryness,
        };
        let motion = MicropolarMotion {
            deformation_gradient: deformation.gradient,
            rotation: UnitQuaternion::from_scaled_axis(deformation.rotation),
            wryness: deformation.wryness,
            twist: deformation.rotation,
        };
        (strain, motion)
    }
}

impl Driven for GradientMicropolar {
    fn prescribe(deformation: &Deformation) -> (GradientMicropolarStrain, GradientMicropolarMotion) {
        let (strain, motion) = Micropolar::prescribe(deformation);
        let alpha = deformation.alpha;
        (
            GradientMicropolarStrain {
                micropolar: strain,
                alpha,
                alpha_gradient: Vector3::zeros(),
            },
            GradientMicropolarMotion {
                micropolar: motion,
                alpha,
                alpha_gradient: Vector3::zeros(),
            },
        )
    }
}

/// Drives a law from virgin material along a path: one answer per deformation, the last one a failure where the law finds
/// no stress, which ends the path.
pub fn drive<'a, C: Driven>(
    law: &'a dyn Material<C>,
    path: impl Iterator<Item = Deformation> + 'a,
) -> impl Iterator<Item = Result<Answer, NoSolution>> + 'a {
    let mut old = vec![0.0; total_length(law.state_variables())];
    let mut new = old.clone();
    law.initial_state(&mut old);
    let (chi, damage) = (position_in_state(law, "chi"), position_in_state(law, "damage"));
    let mut failed = false;
    path.map_while(move |deformation| {
        if failed {
            return None;
        }
        let (strain, motion) = C::prescribe(&deformation);
        let mut stress = C::Stress::default();
        if let Err(failure) = law.respond(&strain, &old, &mut new, &mut stress) {
            failed = true;
            return Some(Err(failure));
        }
        let answer = Answer {
            observation: C::observe(&motion, &stress),
            chi: chi.map(|at| new[at]),
            damage: damage.map(|at| new[at]),
            local_iterations: law.local_iterations(&strain, &old),
        };
        std::mem::swap(&mut old, &mut new);
        Some(Ok(answer))
    })
}

/// Where in the state of a law a variable stands.
fn position_in_state<C: Continuum>(law: &dyn Material<C>, name: &str) -> Option<usize> {
    let mut begin = 0;
    for variable in law.state_variables() {
        if variable.name == name {
            return Some(begin);
        }
        begin += variable.length;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::spec::{ElasticModuli, PlasticParameters};
    use crate::material::{Components, drucker_prager::DruckerPrager, elastic::Elastic, hencky::Hencky};

    const MODULI: ElasticModuli = ElasticModuli {
        lambda: 8e6,
        mu: 4e6,
        kappa: 1e6,
        alpha: 2.0,
        beta: 3.0,
        gamma: 5.0,
    };

    fn sheared(amount: f64) -> Deformation {
        let mut end = Deformation::default();
        end.gradient[(0, 1)] = amount;
        end
    }

    /// Simple shear of a Hencky solid: the logarithm of `F F^T` in closed form.
    #[test]
    fn hencky_shear_has_its_closed_form() {
        let law = Hencky::new(&MODULI, Components::Space);
        let path = (1..=4).map(|step| sheared(0.5).portion(f64::from(step) / 4.0));
        let answers: Vec<_> = drive::<Classical>(&law, path)
            .map(|answer| answer.expect("elastic"))
            .collect();
        assert_eq!(answers.len(), 4);
        // Principal stretch s with s - 1/s = g; tau_12 = 2 mu ln s sin 2a with tan 2a = 2/g.
        let g: f64 = 0.5;
        let s = g / 2.0 + (1.0 + g * g / 4.0).sqrt();
        let expected = 2.0 * MODULI.mu * s.ln() * (2.0 / g).atan().sin();
        let found = answers[3].observation.stress[(0, 1)];
        assert!((found - expected).abs() <= 1e-12 * expected, "{found} {expected}");
        assert_eq!((answers[3].chi, answers[3].local_iterations), (None, 0));
    }

    /// A rotation of the whole point gives no strain; the couple-stress turns with it.
    #[test]
    fn a_rigid_rotation_gives_no_force_stress() {
        let law = Elastic::new(&MODULI, Components::Space);
        let mut turned = Deformation {
            rotation: Vector3::new(0.3, -0.2, 0.9),
            ..Deformation::default()
        };
        turned.gradient = turned.rotation_matrix();
        turned.wryness[(0, 0)] = 2.0;
        let answer = drive::<Micropolar>(&law, std::iter::once(turned))
            .next()
            .expect("a step")
            .expect("elastic");
        assert!(answer.observation.stress.norm() < 1e-8);
        let q = turned.rotation_matrix();
        let at_rest = Matrix3::from_diagonal(&Vector3::new(2.0 * 2.0 + 10.0 * 2.0, 4.0, 4.0));
        let expected = q * at_rest * q.transpose();
        let found = answer.observation.couple_stress.expect("micropolar");
        assert!((found - expected).norm() < 1e-12 * expected.norm());
    }

    #[test]
    fn plastic_steps_report_their_iterations_and_a_failure_ends_the_path() {
        let plastic = PlasticParameters {
            friction_slope: 0.0,
            dilatancy_slope: 0.0,
            yield_strength: 1e5,
            hardening_modulus: 0.0,
            plastic_length: 1e-3,
            tolerance: 1e-12,
        };
        let law = DruckerPrager::new(&MODULI, &plastic, Components::Space);
        let mut broken = sheared(0.0);
        broken.gradient = Matrix3::zeros();
        let path = [sheared(0.001), sheared(0.1), broken, sheared(0.2)];
        let answers: Vec<_> = drive::<Micropolar>(&law, path.into_iter()).collect();
        assert_eq!(answers.len(), 3, "nothing follows a failure");
        let iterations = |step: usize| answers[step].as_ref().map(|answer| answer.local_iterations);
        assert_eq!(iterations(0), Ok(0));
        assert!(iterations(1).is_ok_and(|count| (1..20).contains(&count)));
        assert!(
            answers[1]
                .as_ref()
                .is_ok_and(|answer| answer.chi.is_some_and(|chi| chi > 0.01))
        );
        assert_eq!(
            answers[2].as_ref().map_err(|failure| failure.what).err(),
            Some("the stretch is singular")
        );
    }
}
