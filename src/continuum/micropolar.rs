//! Micropolar continuum: displacement and independent micro-rotation.
//!
//! Strain measures are the micropolar stretch `U` and the wryness `Gamma`,
//!
//! ```text
//! U = Q^T F        Gamma_ab = -1/2 eps_acd Q_ic dQ_id/dX_b
//! ```
//!
//! Their conjugates per unit reference volume are `B` and `S`, with Kirchhoff stress `tau = Q B U^T Q^T` and
//! couple-stress `nu = Q S U^T Q^T` (first index force, second index normal; tension positive).
//!
//! A step has the increments `u` (translation) and `w` (rotation vector). With gradients on the coordinates at its
//! start, `G = grad u` and `K = grad w`, and a tilde on what held there:
//!
//! ```text
//! dF = I + G      F = dF F~      Q = exp(hat w) Q~      Gamma = Gamma~ + Q^T Jl(w) K F~
//! ```
//!
//! The last is exact for a rotation vector that varies linearly: `Q` there is the new rotation. Conjugate to spins
//! are `P = tau dF^-T = Q B F~^T`, `M = nu dF^-T = Q S F~^T` and `c_i = eps_ijk tau_jk`:
//!
//! ```text
//! P : grad u' + c . w' + M : grad w' = B : U' + S : Gamma'        for translations u' and spins w'
//! ```
//!
//! The unknown is the rotation vector and the test function a spin: the tangent is that of `(P, c, M)` by `(G, w, K)`
//! and unsymmetric in space even for an elastic law. In plane strain it is symmetric for an elastic law.

mod plane;
mod space;

pub use plane::PlaneFrame;
pub use space::SpaceFrame;

use super::rotation::RotationIncrement;
use super::tensor::{pack_tensor, unpack_tensor};
use super::{Continuum, Fields, Flux, Observation, Variable};
use nalgebra::{Matrix3, Quaternion, SMatrix, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Strain of a micropolar point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicropolarStrain {
    /// `U = Q^T F` [-].
    pub stretch: Matrix3<f64>,
    /// Wryness [1/m].
    pub wryness: Matrix3<f64>,
}

impl Default for MicropolarStrain {
    /// No deformation.
    fn default() -> Self {
        Self {
            stretch: Matrix3::identity(),
            wryness: Matrix3::zeros(),
        }
    }
}

/// Conjugates of [`MicropolarStrain`], per unit reference volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MicropolarStress {
    /// `B`, conjugate to the stretch [Pa].
    pub force: Matrix3<f64>,
    /// `S`, conjugate to the wryness [N/m].
    pub couple: Matrix3<f64>,
}

/// Derivative of [`MicropolarStress`] by [`MicropolarStrain`]; tensor component `ij` stands at `3 i + j`.
#[derive(Clone, Debug)]
pub struct MicropolarModuli {
    pub force_stretch: SMatrix<f64, 9, 9>,
    pub force_wryness: SMatrix<f64, 9, 9>,
    pub couple_stretch: SMatrix<f64, 9, 9>,
    pub couple_wryness: SMatrix<f64, 9, 9>,
    /// False where the two cross blocks are zero (an elastic point): they are then not read.
    pub coupled: bool,
}

impl Default for MicropolarModuli {
    fn default() -> Self {
        Self {
            force_stretch: SMatrix::zeros(),
            force_wryness: SMatrix::zeros(),
            couple_stretch: SMatrix::zeros(),
            couple_wryness: SMatrix::zeros(),
            coupled: false,
        }
    }
}

/// What a micropolar point remembers of its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicropolarMotion {
    /// `F` [-].
    pub deformation_gradient: Matrix3<f64>,
    /// Micro-rotation `Q`.
    pub rotation: UnitQuaternion<f64>,
    /// `Gamma` [1/m].
    pub wryness: Matrix3<f64>,
    /// `2 atan2(q_axis, q_w)` for each axis, continued over accepted steps [rad].
    pub twist: Vector3<f64>,
}

impl Default for MicropolarMotion {
    /// At rest in the reference configuration.
    fn default() -> Self {
        Self {
            deformation_gradient: Matrix3::identity(),
            rotation: UnitQuaternion::identity(),
            wryness: Matrix3::zeros(),
            twist: Vector3::zeros(),
        }
    }
}

/// How a number that depends on the strain changes with the unknowns of the step.
pub trait StrainRates<const D: usize, const N: usize>: Fields<D, N> {
    /// Derivatives by the jet of a number whose derivatives by stretch and wryness are given.
    fn strain_rates(frame: &Self::Frame, by_strain: &MicropolarStress) -> Flux<D, N>;
}

/// Marker type of the micropolar continuum.
#[derive(Clone, Copy, Debug)]
pub struct Micropolar;

impl Continuum for Micropolar {
    type Motion = MicropolarMotion;
    type Strain = MicropolarStrain;
    type Stress = MicropolarStress;
    type Moduli = MicropolarModuli;

    /// Tensors row by row; the quaternion as `w, x, y, z`.
    const MOTION: &'static [Variable] = &[
        Variable {
            name: "deformation_gradient",
            length: 9,
        },
        Variable {
            name: "rotation",
            length: 4,
        },
        Variable {
            name: "wryness",
            length: 9,
        },
        Variable {
            name: "twist",
            length: 3,
        },
    ];
    /// Tensors row by row.
    const STRESS: &'static [Variable] = &[
        Variable {
            name: "force_stress",
            length: 9,
        },
        Variable {
            name: "couple_stress",
            length: 9,
        },
    ];

    fn pack_motion(motion: &MicropolarMotion, out: &mut [f64]) {
        let q = motion.rotation.quaternion();
        pack_tensor(&motion.deformation_gradient, &mut out[0..9]);
        out[9..13].copy_from_slice(&[q.w, q.i, q.j, q.k]);
        pack_tensor(&motion.wryness, &mut out[13..22]);
        out[22..25].copy_from_slice(motion.twist.as_slice());
    }

    fn unpack_motion(values: &[f64]) -> MicropolarMotion {
        MicropolarMotion {
            deformation_gradient: unpack_tensor(&values[0..9]),
            // Not normalised again: what is read back is bit for bit what was written.
            rotation: UnitQuaternion::new_unchecked(Quaternion::new(values[9], values[10], values[11], values[12])),
            wryness: unpack_tensor(&values[13..22]),
            twist: Vector3::from_column_slice(&values[22..25]),
        }
    }

    fn pack_stress(stress: &MicropolarStress, out: &mut [f64]) {
        pack_tensor(&stress.force, &mut out[0..9]);
        pack_tensor(&stress.couple, &mut out[9..18]);
    }

    fn unpack_stress(values: &[f64]) -> MicropolarStress {
        MicropolarStress {
            force: unpack_tensor(&values[0..9]),
            couple: unpack_tensor(&values[9..18]),
        }
    }

    fn deformation_gradient(motion: &MicropolarMotion) -> Matrix3<f64> {
        motion.deformation_gradient
    }

    /// `sigma = Q B F^T / J` and likewise for the couple-stress. The rotation is the principal vector; in plane strain
    /// [`super::Fields::observe_fields`] puts the accumulated angle in its place.
    fn observe(motion: &MicropolarMotion, stress: &MicropolarStress) -> Observation {
        let q = rotation_matrix(&motion.rotation);
        let f = motion.deformation_gradient;
        let volume_ratio = f.determinant();
        let pushed = |conjugate: &Matrix3<f64>| q * conjugate * f.transpose() / volume_ratio;
        Observation {
            stress: pushed(&stress.force),
            couple_stress: Some(pushed(&stress.couple)),
            wryness: Some(motion.wryness),
            rotation: Some(motion.rotation.scaled_axis()),
            twist: Some(motion.twist),
            alpha: None,
            volume_ratio,
        }
    }
}

fn rotation_matrix(rotation: &UnitQuaternion<f64>) -> Matrix3<f64> {
    rotation.to_rotation_matrix().into_inner()
}

/// Motion at the end of a step with the displacement gradient `g`, the rotation vector `w` and its gradient `k`.
fn advanced(motion: &MicropolarMotion, g: &Matrix3<f64>, w: &Vector3<f64>, k: &Matrix3<f64>) -> MicropolarMotion {
    let increment = RotationIncrement::new(*w);
    let product = UnitQuaternion::from_scaled_axis(*w).quaternion() * motion.rotation.quaternion();
    let rotation = UnitQuaternion::new_normalize(product);
    let f_old = motion.deformation_gradient;
    let q = increment.exponential() * rotation_matrix(&motion.rotation);
    MicropolarMotion {
        deformation_gradient: f_old + g * f_old,
        rotation,
        wryness: motion.wryness + q.tr_mul(&(increment.left_differential() * k * f_old)),
        twist: continued_twist(&rotation, &motion.twist),
    }
}

/// Angles of the rotation about each axis, of all equivalent ones those nearest to `previous`.
fn continued_twist(rotation: &UnitQuaternion<f64>, previous: &Vector3<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    Vector3::from_fn(|axis, _| {
        let angle = 2.0 * q.imag()[axis].atan2(q.w);
        angle + TAU * ((previous[axis] - angle) / TAU).round()
    })
}

#[cfg(test)]
mod tests;
