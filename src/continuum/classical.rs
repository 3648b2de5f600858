//! Classical continuum: displacement only.
//!
//! With the displacement gradient `G` of the step on the coordinates at its start, and a tilde on what held there,
//!
//! ```text
//! dF = I + G      F = dF F~      P = tau dF^-T
//! ```
//!
//! A law sees the deformation gradient `F` and answers with the Kirchhoff stress `tau` (symmetric; tension positive).
//! Its moduli relate the rate of `tau` that turns with the material to the stretching `d = sym l`, `l = dG dF^-1`,
//! `w = skew l`:
//!
//! ```text
//! d tau = C : d + w tau - tau w
//! dP    = (C : d - d tau - tau d + l tau) dF^-T
//! ```
//!
//! The tangent is symmetric where `C` is, as it is for a hyperelastic law.
//!
//! The formulas are those of space; in plane strain the third row and column of `G` are zero, and so is what works on
//! them. One implementation serves both.

use super::tensor::{pack_symmetric, pack_tensor, symmetric_component, unpack_symmetric, unpack_tensor};
use super::{Continuum, Fields, Flux, Jet, Observation, Tangent, UnknownKind, Variable};
use nalgebra::{Matrix3, SMatrix, SVector};

/// Strain of a classical point, as its laws see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassicalStrain {
    /// `F` [-].
    pub deformation_gradient: Matrix3<f64>,
}

impl Default for ClassicalStrain {
    /// No deformation.
    fn default() -> Self {
        Self {
            deformation_gradient: Matrix3::identity(),
        }
    }
}

/// Kirchhoff stress, per unit reference volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassicalStress {
    /// `tau` [Pa], symmetric.
    pub kirchhoff: Matrix3<f64>,
}

/// `C` of the module: rate of `tau` that turns with the material by stretching.
#[derive(Clone, Debug, Default)]
pub struct ClassicalModuli {
    /// `C_ijkl` at the places of `ij` and `kl` among the components of a symmetric tensor.
    pub corotational: [[f64; 6]; 6],
}

/// What a classical point remembers of its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassicalMotion {
    /// `F` [-].
    pub deformation_gradient: Matrix3<f64>,
}

impl Default for ClassicalMotion {
    /// At rest in the reference configuration.
    fn default() -> Self {
        Self {
            deformation_gradient: Matrix3::identity(),
        }
    }
}

/// Marker type of the classical continuum.
#[derive(Clone, Copy, Debug)]
pub struct Classical;

impl Continuum for Classical {
    type Motion = ClassicalMotion;
    type Strain = ClassicalStrain;
    type Stress = ClassicalStress;
    type Moduli = ClassicalModuli;

    /// Row by row.
    const MOTION: &'static [Variable] = &[Variable {
        name: "deformation_gradient",
        length: 9,
    }];
    /// In the order of [`symmetric_component`].
    const STRESS: &'static [Variable] = &[Variable {
        name: "kirchhoff_stress",
        length: 6,
    }];

    fn pack_motion(motion: &ClassicalMotion, out: &mut [f64]) {
        pack_tensor(&motion.deformation_gradient, out);
    }

    fn unpack_motion(values: &[f64]) -> ClassicalMotion {
        ClassicalMotion {
            deformation_gradient: unpack_tensor(values),
        }
    }

    fn pack_stress(stress: &ClassicalStress, out: &mut [f64]) {
        pack_symmetric(&stress.kirchhoff, out);
    }

    fn unpack_stress(values: &[f64]) -> ClassicalStress {
        ClassicalStress {
            kirchhoff: unpack_symmetric(values),
        }
    }

    fn deformation_gradient(motion: &ClassicalMotion) -> Matrix3<f64> {
        motion.deformation_gradient
    }

    /// `sigma = tau / J`.
    fn observe(motion: &ClassicalMotion, stress: &ClassicalStress) -> Observation {
        let volume_ratio = motion.deformation_gradient.determinant();
        Observation {
            stress: stress.kirchhoff / volume_ratio,
            couple_stress: None,
            wryness: None,
            rotation: None,
            twist: None,
            alpha: None,
            volume_ratio,
        }
    }
}

/// Kinematics at the end of a step.
#[derive(Clone, Copy, Debug)]
pub struct ClassicalFrame {
    /// `dF^-1`.
    relative_inverse: Matrix3<f64>,
}

/// Names of the translations along the axes.
const fn translations<const D: usize>() -> [&'static str; D] {
    const NAMES: [&str; 3] = ["ux", "uy", "uz"];
    let mut names = [""; D];
    let mut axis = 0;
    while axis < D {
        names[axis] = NAMES[axis];
        axis += 1;
    }
    names
}

impl<const D: usize> Fields<D, D> for Classical {
    const UNKNOWNS: [&'static str; D] = translations();
    const KIND: [UnknownKind; D] = [UnknownKind::Translation; D];
    type Frame = ClassicalFrame;

    fn strain(motion: &ClassicalMotion, jet: &Jet<D, D>) -> Option<(ClassicalStrain, ClassicalFrame)> {
        let relative = relative_deformation(jet);
        let volume_change = relative.determinant();
        // Written so that what is not a number is outside, too.
        if !(volume_change > 0.0 && volume_change.is_finite()) {
            return None;
        }
        let strain = ClassicalStrain {
            deformation_gradient: relative * motion.deformation_gradient,
        };
        let relative_inverse = relative.try_inverse()?;
        Some((strain, ClassicalFrame { relative_inverse }))
    }

    fn flux(frame: &ClassicalFrame, stress: &ClassicalStress) -> Flux<D, D> {
        let p = stress.kirchhoff * frame.relative_inverse.transpose();
        Flux {
            source: SVector::zeros(),
            flux: SMatrix::from_fn(|i, j| p[(i, j)]),
        }
    }

    fn tangent(frame: &ClassicalFrame, stress: &ClassicalStress, moduli: &ClassicalModuli, out: &mut Tangent<D, D>) {
        out.source_value = SMatrix::zeros();
        out.source_gradient = [SMatrix::zeros(); D];
        out.flux_value = [SMatrix::zeros(); D];
        let inverse = &frame.relative_inverse;
        for i in 0..D {
            for k in 0..D {
                // a[j][l]: component ij of dP dF^T by component kl of l; pulled back index by index.
                let a: [[f64; D]; D] =
                    std::array::from_fn(|j| std::array::from_fn(|l| spatial_modulus(stress, moduli, [i, j, k, l])));
                for m in 0..D {
                    let half: [f64; D] = std::array::from_fn(|j| (0..D).map(|l| a[j][l] * inverse[(m, l)]).sum());
                    for j in 0..D {
                        out.flux_gradient[j][m][(i, k)] = (0..D).map(|n| inverse[(j, n)] * half[n]).sum();
                    }
                }
            }
        }
    }

    fn advance(motion: &ClassicalMotion, jet: &Jet<D, D>) -> ClassicalMotion {
        ClassicalMotion {
            deformation_gradient: relative_deformation(jet) * motion.deformation_gradient,
        }
    }
}

/// `dF`.
fn relative_deformation<const D: usize>(jet: &Jet<D, D>) -> Matrix3<f64> {
    let mut relative = Matrix3::identity();
    for i in 0..D {
        for k in 0..D {
            relative[(i, k)] += jet.gradient[(i, k)];
        }
    }
    relative
}

/// Component `ij` of `C : d - d tau - tau d + l tau` by component `kl` of `l`.
fn spatial_modulus(stress: &ClassicalStress, moduli: &ClassicalModuli, [i, j, k, l]: [usize; 4]) -> f64 {
    let tau = &stress.kirchhoff;
    let mut modulus = moduli.corotational[symmetric_component(i, j)][symmetric_component(k, l)];
    if i == k {
        modulus += 0.5 * tau[(l, j)];
    }
    if i == l {
        modulus -= 0.5 * tau[(k, j)];
    }
    if j == l {
        modulus -= 0.5 * tau[(i, k)];
    }
    if j == k {
        modulus -= 0.5 * tau[(i, l)];
    }
    modulus
}

#[cfg(test)]
mod tests;
