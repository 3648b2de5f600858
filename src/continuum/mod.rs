//! Which fields a body has, and what strain they make of it: one point, no mesh, no rank.
//!
//! Physics is three-dimensional throughout. The discretisation knows only *values and gradients of `N` unknowns in
//! `D` dimensions*: increments of the step, with gradients on the coordinates at its start (docs/theory.md, section 1).

pub mod classical;
pub mod gradient_micropolar;
mod kind;
pub mod micropolar;
pub mod rotation;
pub mod tensor;

pub use kind::ContinuumKind;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Values and gradients of the `N` unknowns at one point.
#[derive(Clone, Copy, Debug)]
pub struct Jet<const D: usize, const N: usize> {
    pub value: SVector<f64, N>,
    /// `gradient[(a, k)]` = derivative of unknown `a` along start-of-step coordinate `k`.
    pub gradient: SMatrix<f64, N, D>,
}

/// What the variations of a [`Jet`] do work on, per unit reference volume.
#[derive(Clone, Copy, Debug)]
pub struct Flux<const D: usize, const N: usize> {
    pub source: SVector<f64, N>,
    pub flux: SMatrix<f64, N, D>,
}

/// Derivative of a [`Flux`] with respect to its [`Jet`], in `N x N` blocks.
#[derive(Clone, Copy, Debug)]
pub struct Tangent<const D: usize, const N: usize> {
    pub source_value: SMatrix<f64, N, N>,
    pub source_gradient: [SMatrix<f64, N, N>; D],
    pub flux_value: [SMatrix<f64, N, N>; D],
    /// `flux_gradient[j][k]`: flux along `j` by gradient along `k`.
    pub flux_gradient: [[SMatrix<f64, N, N>; D]; D],
}

/// A named array of numbers that every point carries: memory, migration, files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variable {
    pub name: &'static str,
    pub length: usize,
}

/// Numbers that these variables take together.
pub const fn total_length(variables: &[Variable]) -> usize {
    let mut total = 0;
    let mut index = 0;
    while index < variables.len() {
        total += variables[index].length;
        index += 1;
    }
    total
}

/// What can be seen of a point in its accepted state, in three dimensions.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Cauchy stress [Pa]; first index force, second index normal.
    pub stress: Matrix3<f64>,
    /// Cauchy couple-stress [N/m].
    pub couple_stress: Option<Matrix3<f64>>,
    /// Wryness [1/m].
    pub wryness: Option<Matrix3<f64>>,
    /// Principal rotation vector of the micro-rotation [rad].
    pub rotation: Option<Vector3<f64>>,
    /// Rotation about each axis, continued past full turns [rad].
    pub twist: Option<Vector3<f64>>,
    /// Nonlocal damage field [-].
    pub alpha: Option<f64>,
    /// Determinant of the deformation gradient [-].
    pub volume_ratio: f64,
}

/// Which derivative of the stress a tangent is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Linearisation {
    /// That at the strain.
    Consistent,
    /// That for the solve that opens a step: points that flowed in the last one flow on.
    Opening,
}

/// A continuum: what a point remembers, and what strain, stress and moduli are.
pub trait Continuum: Sized + 'static {
    /// What a point remembers of its motion at the start of the step.
    type Motion: Copy + Default + std::fmt::Debug + PartialEq;
    /// What a constitutive law sees: objective strain measures.
    type Strain: Copy + Default + std::fmt::Debug;
    /// Work conjugates of the strain, per unit reference volume.
    type Stress: Copy + Default + std::fmt::Debug + PartialEq;
    /// Derivative of the stress with respect to the strain.
    type Moduli: Clone + Default + std::fmt::Debug;

    /// The parts of a motion, by name: migration, restart and output are written against this list.
    const MOTION: &'static [Variable];
    /// The parts of a stress, by name.
    const STRESS: &'static [Variable];

    fn pack_motion(motion: &Self::Motion, out: &mut [f64]);
    fn unpack_motion(values: &[f64]) -> Self::Motion;
    fn pack_stress(stress: &Self::Stress, out: &mut [f64]);
    fn unpack_stress(values: &[f64]) -> Self::Stress;

    /// Deformation gradient of the motion (reference to start of step).
    fn deformation_gradient(motion: &Self::Motion) -> Matrix3<f64>;
    /// What can be seen from outside: Cauchy stresses, rotation, volume ratio.
    fn observe(motion: &Self::Motion, stress: &Self::Stress) -> Observation;
}

/// What an unknown of a node is, and with it the units of its residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnknownKind {
    /// A displacement [m]; its residual is a force [N].
    Translation,
    /// A rotation [rad]; its residual is a couple [N m].
    Rotation,
    /// The nonlocal damage field [-]; its residual is a volume [m3].
    Damage,
}

const fn translations<const N: usize>(kinds: [UnknownKind; N]) -> [bool; N] {
    let mut result = [false; N];
    let mut index = 0;
    while index < N {
        result[index] = matches!(kinds[index], UnknownKind::Translation);
        index += 1;
    }
    result
}

/// The unknowns of a continuum in a given dimension; plane strain lives here.
pub trait Fields<const D: usize, const N: usize>: Continuum {
    /// Names of the unknowns, as the configuration spells them.
    const UNKNOWNS: [&'static str; N];
    /// What each unknown is; translations come first, in the order of the axes.
    const KIND: [UnknownKind; N];
    /// Whether each unknown is a translation (its residual a force) or not.
    const IS_TRANSLATION: [bool; N] = translations(Self::KIND);
    /// Kinematic by-products of the strain that flux and tangent need again.
    type Frame: Copy;

    /// Strain at the end of a step with the increments `jet`; `None` outside the domain (a rotation beyond pi,
    /// a volume turned inside out).
    fn strain(motion: &Self::Motion, jet: &Jet<D, N>) -> Option<(Self::Strain, Self::Frame)>;
    /// Work conjugates of the jet.
    fn flux(frame: &Self::Frame, stress: &Self::Stress) -> Flux<D, N>;
    /// Derivative of the flux with respect to the jet; overwrites `out`.
    fn tangent(frame: &Self::Frame, stress: &Self::Stress, moduli: &Self::Moduli, out: &mut Tangent<D, N>);
    /// Motion at the end of the step.
    fn advance(motion: &Self::Motion, jet: &Jet<D, N>) -> Self::Motion;
    /// [`Continuum::observe`] with what this dimension alone knows: in plane strain the rotation is the accumulated
    /// angle, in space the principal rotation vector.
    fn observe_fields(motion: &Self::Motion, stress: &Self::Stress) -> Observation {
        Self::observe(motion, stress)
    }
}

impl<const D: usize, const N: usize> Jet<D, N> {
    pub fn zero() -> Self {
        Self {
            value: SVector::zeros(),
            gradient: SMatrix::zeros(),
        }
    }
}

impl<const D: usize, const N: usize> Flux<D, N> {
    pub fn zero() -> Self {
        Self {
            source: SVector::zeros(),
            flux: SMatrix::zeros(),
        }
    }
}

impl<const D: usize, const N: usize> Tangent<D, N> {
    pub fn zero() -> Self {
        let block = SMatrix::zeros();
        Self {
            source_value: block,
            source_gradient: [block; D],
            flux_value: [block; D],
            flux_gradient: [[block; D]; D],
        }
    }
}
