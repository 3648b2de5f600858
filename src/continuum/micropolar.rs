//! Micropolar continuum: displacement and independent micro-rotation.
//!
//! Strain measures: micropolar stretch `U = Q^T F` and wryness `Gamma` (docs/theory.md). Their conjugates per unit
//! reference volume are `B` and `S`, with Kirchhoff stress `tau = Q B U^T Q^T` and couple-stress `nu = Q S U^T Q^T`.

use nalgebra::{Matrix3, SMatrix};

/// Strain of a micropolar point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicropolarStrain {
    /// `U = Q^T F` [-].
    pub stretch: Matrix3<f64>,
    /// Wryness [1/m].
    pub wryness: Matrix3<f64>,
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

/// Marker type of the micropolar continuum.
#[derive(Clone, Copy, Debug)]
pub struct Micropolar;
