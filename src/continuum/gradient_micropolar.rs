//! Micropolar continuum with a nonlocal damage field `alpha` (Neuner et al. 2024).
//!
//! To the motion of [`micropolar`](super::micropolar) comes one scalar field on the reference volume that spreads the
//! local driver `alpha_d` of the damage over the length `l_d`,
//!
//! ```text
//! alpha - l_d^2 Div Grad alpha = alpha_d         int [N (alpha - alpha_d) + Grad N . l_d^2 Grad alpha] dV0 = 0
//! ```
//!
//! Strain is the micropolar strain with `alpha` and `Grad alpha` at the end of the step; stress the micropolar stress
//! with what works on them, `alpha - alpha_d` and `l_d^2 Grad alpha`. Length and driver come from the law, so that the
//! continuum has no parameter. Gradients on the coordinates at the start of the step become those on the reference by
//! `Grad N = F~^T grad N`.

use super::micropolar::{Micropolar, MicropolarModuli, MicropolarMotion, MicropolarStrain, MicropolarStress};
use super::micropolar::{PlaneFrame, SpaceFrame, StrainRates};
use super::{Continuum, Fields, Flux, Jet, Observation, Tangent, UnknownKind, Variable};
use nalgebra::{Matrix3, Vector3};

/// Strain of a point with a nonlocal damage field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GradientMicropolarStrain {
    pub micropolar: MicropolarStrain,
    /// `alpha` [-].
    pub alpha: f64,
    /// `Grad alpha` on the reference [1/m].
    pub alpha_gradient: Vector3<f64>,
}

/// Conjugates of [`GradientMicropolarStrain`], per unit reference volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GradientMicropolarStress {
    pub micropolar: MicropolarStress,
    /// `alpha - alpha_d` [-].
    pub source: f64,
    /// `l_d^2 Grad alpha` [m].
    pub flux: Vector3<f64>,
}

/// Derivative of [`GradientMicropolarStress`] by [`GradientMicropolarStrain`].
#[derive(Clone, Debug, Default)]
pub struct GradientMicropolarModuli {
    pub micropolar: MicropolarModuli,
    /// Of the micropolar stress by `alpha`.
    pub stress_alpha: MicropolarStress,
    /// Of the source by stretch and wryness.
    pub source_strain: MicropolarStress,
    /// Of the source by `alpha` [-].
    pub source_alpha: f64,
    /// Of the flux by the gradient, `l_d^2` [m2].
    pub flux_gradient: f64,
}

/// What a point remembers of its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GradientMicropolarMotion {
    pub micropolar: MicropolarMotion,
    /// `alpha` [-].
    pub alpha: f64,
    /// `Grad alpha` on the reference [1/m].
    pub alpha_gradient: Vector3<f64>,
}

/// Kinematics at the end of a step: those of the micropolar point, and the `F~` that turns gradients into reference
/// ones.
#[derive(Clone, Copy, Debug)]
pub struct GradientFrame<M> {
    micropolar: M,
    old_deformation: Matrix3<f64>,
}

/// Marker type of the gradient-enhanced micropolar continuum.
#[derive(Clone, Copy, Debug)]
pub struct GradientMicropolar;

/// Numbers that a packed micropolar motion takes, and a packed micropolar stress.
const MOTION: usize = super::total_length(Micropolar::MOTION);
const STRESS: usize = super::total_length(Micropolar::STRESS);

impl Continuum for GradientMicropolar {
    type Motion = GradientMicropolarMotion;
    type Strain = GradientMicropolarStrain;
    type Stress = GradientMicropolarStress;
    type Moduli = GradientMicropolarModuli;

    const MOTION: &'static [Variable] = &[
        Micropolar::MOTION[0],
        Micropolar::MOTION[1],
        Micropolar::MOTION[2],
        Micropolar::MOTION[3],
        Variable {
            name: "alpha",
            length: 1,
        },
        Variable {
            name: "alpha_gradient",
            length: 3,
        },
    ];
    const STRESS: &'static [Variable] = &[
        Micropolar::STRESS[0],
        Micropolar::STRESS[1],
        Variable {
            name: "damage_source",
            length: 1,
        },
        Variable {
            name: "damage_flux",
            length: 3,
        },
    ];

    fn pack_motion(motion: &GradientMicropolarMotion, out: &mut [f64]) {
        Micropolar::pack_motion(&motion.micropolar, &mut out[..MOTION]);
        pack_scalar_and_vector(motion.alpha, &motion.alpha_gradient, &mut out[MOTION..]);
    }

    fn unpack_motion(values: &[f64]) -> GradientMicropolarMotion {
        let (alpha, alpha_gradient) = unpack_scalar_and_vector(&values[MOTION..]);
        GradientMicropolarMotion {
            micropolar: Micropolar::unpack_motion(&values[..MOTION]),
            alpha,
            alpha_gradient,
        }
    }

    fn pack_stress(stress: &GradientMicropolarStress, out: &mut [f64]) {
        Micropolar::pack_stress(&stress.micropolar, &mut out[..STRESS]);
        pack_scalar_and_vector(stress.source, &stress.flux, &mut out[STRESS..]);
    }

    fn unpack_stress(values: &[f64]) -> GradientMicropolarStress {
        let (source, flux) = unpack_scalar_and_vector(&values[STRESS..]);
        GradientMicropolarStress {
            micropolar: Micropolar::unpack_stress(&values[..STRESS]),
            source,
            flux,
        }
    }

    fn deformation_gradient(motion: &GradientMicropolarMotion) -> Matrix3<f64> {
        motion.micropolar.deformation_gradient
    }

    fn observe(motion: &GradientMicropolarMotion, stress: &GradientMicropolarStress) -> Observation {
        Observation {
            alpha: Some(motion.alpha),
            ..Micropolar::observe(&motion.micropolar, &stress.micropolar)
        }
    }
}

fn pack_scalar_and_vector(scalar: f64, vector: &Vector3<f64>, out: &mut [f64]) {
    out[0] = scalar;
    out[1..4].copy_from_slice(vector.as_slice());
}

fn unpack_scalar_and_vector(values: &[f64]) -> (f64, Vector3<f64>) {
    (values[0], Vector3::from_column_slice(&values[1..4]))
}

/// The unknowns of a micropolar node and `alpha`, in one dimension: what stands in `part` has `M` unknowns, what stands
/// here one more.
macro_rules! fields {
    ($dimension:literal, $part:literal, $all:literal, $frame:ty, $unknowns:expr, $kind:expr) => {
        impl Fields<$dimension, $all> for GradientMicropolar {
            const UNKNOWNS: [&'static str; $all] = $unknowns;
            const KIND: [UnknownKind; $all] = $kind;
            type Frame = GradientFrame<$frame>;

            fn strain(
                motion: &GradientMicropolarMotion,
                jet: &Jet<$dimension, $all>,
            ) -> Option<(GradientMicropolarStrain, Self::Frame)> {
                strain::<$dimension, $part, $all>(motion, jet)
            }

            fn flux(frame: &Self::Frame, stress: &GradientMicropolarStress) -> Flux<$dimension, $all> {
                flux::<$dimension, $part, $all>(frame, stress)
            }

            fn tangent(
                frame: &Self::Frame,
                stress: &GradientMicropolarStress,
                moduli: &GradientMicropolarModuli,
                out: &mut Tangent<$dimension, $all>,
            ) {
                tangent::<$dimension, $part, $all>(frame, stress, moduli, out);
            }

            fn advance(motion: &GradientMicropolarMotion, jet: &Jet<$dimension, $all>) -> GradientMicropolarMotion {
                advance::<$dimension, $part, $all>(motion, jet)
            }

            fn observe_fields(motion: &GradientMicropolarMotion, stress: &GradientMicropolarStress) -> Observation {
                Observation {
                    alpha: Some(motion.alpha),
                    ..<Micropolar as Fields<$dimension, $part>>::observe_fields(&motion.micropolar, &stress.micropolar)
                }
            }
        }
    };
}

use UnknownKind::{Damage, Rotation, Translation};

fields!(
    2,
    3,
    4,
    PlaneFrame,
    ["ux", "uy", "rz", "alpha"],
    [Translation, Translation, Rotation, Damage]
);
fields!(
    3,
    6,
    7,
    SpaceFrame,
    ["ux", "uy", "uz", "rx", "ry", "rz", "alpha"],
    [
        Translation,
        Translation,
        Translation,
        Rotation,
        Rotation,
        Rotation,
        Damage
    ]
);

/// The jet of the first `M` unknowns.
fn part<const D: usize, const M: usize, const N: usize>(jet: &Jet<D, N>) -> Jet<D, M> {
    Jet {
        value: jet.value.fixed_rows::<M>(0).into_owned(),
        gradient: jet.gradient.fixed_rows::<M>(0).into_owned(),
    }
}

/// `alpha` and `Grad alpha` at the end of the step.
fn nonlocal<const D: usize, const N: usize>(motion: &GradientMicropolarMotion, jet: &Jet<D, N>) -> (f64, Vector3<f64>) {
    let f = &motion.micropolar.deformation_gradient;
    let change = Vector3::from_fn(|i, _| (0..D).map(|j| jet.gradient[(N - 1, j)] * f[(j, i)]).sum());
    (motion.alpha + jet.value[N - 1], motion.alpha_gradient + change)
}

fn strain<const D: usize, const M: usize, const N: usize>(
    motion: &GradientMicropolarMotion,
    jet: &Jet<D, N>,
) -> Option<(
    GradientMicropolarStrain,
    GradientFrame<<Micropolar as Fields<D, M>>::Frame>,
)>
where
    Micropolar: Fields<D, M>,
{
    let (micropolar, frame) = <Micropolar as Fields<D, M>>::strain(&motion.micropolar, &part(jet))?;
    let (alpha, alpha_gradient) = nonlocal(motion, jet);
    let strain = GradientMicropolarStrain {
        micropolar,
        alpha,
        alpha_gradient,
    };
    let frame = GradientFrame {
        micropolar: frame,
        old_deformation: motion.micropolar.deformation_gradient,
    };
    Some((strain, frame))
}

fn advance<const D: usize, const M: usize, const N: usize>(
    motion: &GradientMicropolarMotion,
    jet: &Jet<D, N>,
) -> GradientMicropolarMotion
where
    Micropolar: Fields<D, M>,
{
    let (alpha, alpha_gradient) = nonlocal(motion, jet);
    GradientMicropolarMotion {
        micropolar: <Micropolar as Fields<D, M>>::advance(&motion.micropolar, &part(jet)),
        alpha,
        alpha_gradient,
    }
}

fn flux<const D: usize, const M: usize, const N: usize>(
    frame: &GradientFrame<<Micropolar as Fields<D, M>>::Frame>,
    stress: &GradientMicropolarStress,
) -> Flux<D, N>
where
    Micropolar: Fields<D, M>,
{
    let inner = <Micropolar as Fields<D, M>>::flux(&frame.micropolar, &stress.micropolar);
    let mut out = Flux::<D, N>::zero();
    out.source.fixed_rows_mut::<M>(0).copy_from(&inner.source);
    out.flux.fixed_rows_mut::<M>(0).copy_from(&inner.flux);
    out.source[N - 1] = stress.source;
    let pushed = frame.old_deformation * stress.flux;
    (0..D).for_each(|k| out.flux[(N - 1, k)] = pushed[k]);
    out
}

fn tangent<const D: usize, const M: usize, const N: usize>(
    frame: &GradientFrame<<Micropolar as Fields<D, M>>::Frame>,
    stress: &GradientMicropolarStress,
    moduli: &GradientMicropolarModuli,
    out: &mut Tangent<D, N>,
) where
    Micropolar: Fields<D, M> + StrainRates<D, M>,
{
    let mut inner = Tangent::<D, M>::zero();
    <Micropolar as Fields<D, M>>::tangent(&frame.micropolar, &stress.micropolar, &moduli.micropolar, &mut inner);
    // The flux is linear in the stress: the same map takes the stress and its derivative by alpha.
    let by_alpha = <Micropolar as Fields<D, M>>::flux(&frame.micropolar, &moduli.stress_alpha);
    let of_source = Micropolar::strain_rates(&frame.micropolar, &moduli.source_strain);
    *out = Tangent::zero();
    embed(&inner.source_value, &mut out.source_value);
    out.source_value
        .fixed_view_mut::<M, 1>(0, N - 1)
        .copy_from(&by_alpha.source);
    out.source_value
        .fixed_view_mut::<1, M>(N - 1, 0)
        .copy_from(&of_source.source.transpose());
    out.source_value[(N - 1, N - 1)] = moduli.source_alpha;
    let f = &frame.old_deformation;
    let conductivity = f * f.transpose() * moduli.flux_gradient;
    for k in 0..D {
        embed(&inner.source_gradient[k], &mut out.source_gradient[k]);
        embed(&inner.flux_value[k], &mut out.flux_value[k]);
        for a in 0..M {
            out.source_gradient[k][(N - 1, a)] = of_source.flux[(a, k)];
            out.flux_value[k][(a, N - 1)] = by_alpha.flux[(a, k)];
        }
        for j in 0..D {
            embed(&inner.flux_gradient[j][k], &mut out.flux_gradient[j][k]);
            out.flux_gradient[j][k][(N - 1, N - 1)] = conductivity[(j, k)];
        }
    }
}

/// Puts a block of the micropolar unknowns in its place.
fn embed<const M: usize, const N: usize>(block: &nalgebra::SMatrix<f64, M, M>, out: &mut nalgebra::SMatrix<f64, N, N>) {
    out.fixed_view_mut::<M, M>(0, 0).copy_from(block);
}
