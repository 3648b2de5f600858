//! The six unknowns of a micropolar body in space.
//!
//! In terms of the spin `psi = Jl(w) dw` every change of strain is the pull-back `Q^T (.) F~` of
//!
//! ```text
//! X = dG - hat(psi) dF            dU     = Q^T X F~
//! Y = dJl K - hat(psi) Jl K + Jl dK   dGamma = Q^T Y F~
//! ```
//!
//! so that with the moduli pushed forward, `A = (Q x F~) C (Q x F~)^T`:
//!
//! ```text
//! dP = hat(psi) P + A_UU : X + A_UG : Y      dM = hat(psi) M + A_GU : X + A_GG : Y
//! dc_i = eps_ijk (dP dF^T + P dG^T)_jk
//! ```

use super::{Micropolar, MicropolarModuli, MicropolarMotion, MicropolarStrain, MicropolarStress, StrainRates};
use super::{advanced, rotation_matrix};
use crate::continuum::rotation::{RotationIncrement, hat};
use crate::continuum::tensor::{component, permutation_product};
use crate::continuum::{Fields, Flux, Jet, Tangent, UnknownKind};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::f64::consts::PI;

/// Kinematics at the end of a step.
#[derive(Clone, Copy, Debug)]
pub struct SpaceFrame {
    /// `F~`.
    old_deformation: Matrix3<f64>,
    /// `dF = I + G`.
    relative_deformation: Matrix3<f64>,
    /// `Q`, new.
    rotation: Matrix3<f64>,
    increment: RotationIncrement,
    /// `Jl(w)`.
    left: Matrix3<f64>,
    /// `K`.
    rotation_gradient: Matrix3<f64>,
}

type Nine = [[f64; 9]; 9];

impl Fields<3, 6> for Micropolar {
    const UNKNOWNS: [&'static str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];
    const KIND: [UnknownKind; 6] = [
        UnknownKind::Translation,
        UnknownKind::Translation,
        UnknownKind::Translation,
        UnknownKind::Rotation,
        UnknownKind::Rotation,
        UnknownKind::Rotation,
    ];
    type Frame = SpaceFrame;

    fn strain(motion: &MicropolarMotion, jet: &Jet<3, 6>) -> Option<(MicropolarStrain, SpaceFrame)> {
        let (g, w, k) = split(jet);
        let relative_deformation = Matrix3::identity() + g;
        // The comparisons are written so that what is not a number is outside, too.
        let volume_change = relative_deformation.determinant();
        let inside = volume_change > 0.0 && volume_change.is_finite() && w.norm_squared() < PI * PI;
        if !inside || !k.iter().all(|v| v.is_finite()) {
            return None;
        }
        let increment = RotationIncrement::new(w);
        let old_deformation = motion.deformation_gradient;
        let rotation = increment.exponential() * rotation_matrix(&motion.rotation);
        let left = increment.left_differential();
        let strain = MicropolarStrain {
            stretch: rotation.tr_mul(&(relative_deformation * old_deformation)),
            wryness: motion.wryness + rotation.tr_mul(&(left * k * old_deformation)),
        };
        let frame = SpaceFrame {
            old_deformation,
            relative_deformation,
            rotation,
            increment,
            left,
            rotation_gradient: k,
        };
        Some((strain, frame))
    }

    fn flux(frame: &SpaceFrame, stress: &MicropolarStress) -> Flux<3, 6> {
        let (p, m) = pushed_stress(frame, stress);
        let c = permutation_product(&(p * frame.relative_deformation.transpose()));
        let mut out = Flux::<3, 6> {
            source: SMatrix::zeros(),
            flux: SMatrix::zeros(),
        };
        out.source.fixed_rows_mut::<3>(3).copy_from(&c);
        out.flux.fixed_rows_mut::<3>(0).copy_from(&p);
        out.flux.fixed_rows_mut::<3>(3).copy_from(&m);
        out
    }

    fn tangent(frame: &SpaceFrame, stress: &MicropolarStress, moduli: &MicropolarModuli, out: &mut Tangent<3, 6>) {
        let (p, m) = pushed_stress(frame, stress);
        let pushed = PushedModuli::new(frame, moduli);
        by_gradient(frame, &pushed, out);
        by_rotation(frame, &p, &m, &pushed, out);
        sources(frame, &p, out);
    }

    fn advance(motion: &MicropolarMotion, jet: &Jet<3, 6>) -> MicropolarMotion {
        let (g, w, k) = split(jet);
        advanced(motion, &g, &w, &k)
    }
}

impl StrainRates<3, 6> for Micropolar {
    /// `P : X + M : Y` by `G`, `w` and `K`, with `P` and `M` pushed forward from the derivatives by the strain.
    fn strain_rates(frame: &SpaceFrame, by_strain: &MicropolarStress) -> Flux<3, 6> {
        let (p, m) = pushed_stress(frame, by_strain);
        let k = &frame.rotation_gradient;
        let jl_k = frame.left * k;
        let jl_rates = frame.increment.left_differential_rates(k);
        let mut out = Flux::<3, 6>::zero();
        out.flux.fixed_rows_mut::<3>(0).copy_from(&p);
        out.flux.fixed_rows_mut::<3>(3).copy_from(&frame.left.tr_mul(&m));
        for (b, jl_rate) in jl_rates.iter().enumerate() {
            let spin = hat(&frame.left.column(b).into_owned());
            let x = -spin * frame.relative_deformation;
            let y = jl_rate - spin * jl_k;
            out.source[3 + b] = p.dot(&x) + m.dot(&y);
        }
        out
    }
}

/// Displacement gradient, rotation vector and its gradient.
fn split(jet: &Jet<3, 6>) -> (Matrix3<f64>, Vector3<f64>, Matrix3<f64>) {
    (
        jet.gradient.fixed_rows::<3>(0).into_owned(),
        jet.value.fixed_rows::<3>(3).into_owned(),
        jet.gradient.fixed_rows::<3>(3).into_owned(),
    )
}

/// `P` and `M`.
fn pushed_stress(frame: &SpaceFrame, stress: &MicropolarStress) -> (Matrix3<f64>, Matrix3<f64>) {
    let f_old = frame.old_deformation.transpose();
    (
        frame.rotation * stress.force * f_old,
        frame.rotation * stress.couple * f_old,
    )
}

/// Moduli between `(P, M)` at fixed rotation and `(X, Y)`; no cross blocks where the law has none.
struct PushedModuli {
    force_stretch: Nine,
    couple_wryness: Nine,
    /// By wryness of the force, by stretch of the couple.
    cross: Option<(Nine, Nine)>,
}

impl PushedModuli {
    fn new(frame: &SpaceFrame, moduli: &MicropolarModuli) -> Self {
        let push = |block: &SMatrix<f64, 9, 9>| push_forward(&frame.rotation, &frame.old_deformation, block);
        Self {
            force_stretch: push(&moduli.force_stretch),
            couple_wryness: push(&moduli.couple_wryness),
            cross: moduli
                .coupled
                .then(|| (push(&moduli.force_wryness), push(&moduli.couple_stretch))),
        }
    }
}

/// `(Q x F~) C (Q x F~)^T`, one index after the other.
fn push_forward(q: &Matrix3<f64>, f: &Matrix3<f64>, block: &SMatrix<f64, 9, 9>) -> Nine {
    // Column-major storage read as rows: the transpose, hence columns first.
    let transposed: Nine = block.data.0;
    let columns = push_rows(q, f, &transposed);
    push_rows(q, f, &transpose(&columns))
}

/// `out[ij] = Q_ia F_jb rows[ab]`.
fn push_rows(q: &Matrix3<f64>, f: &Matrix3<f64>, rows: &Nine) -> Nine {
    let mut half = [[0.0; 9]; 9];
    for a in 0..3 {
        for j in 0..3 {
            for (n, value) in half[component(a, j)].iter_mut().enumerate() {
                *value = f[(j, 0)] * rows[3 * a][n] + f[(j, 1)] * rows[3 * a + 1][n] + f[(j, 2)] * rows[3 * a + 2][n];
            }
        }
    }
    let mut out = [[0.0; 9]; 9];
    for i in 0..3 {
        for j in 0..3 {
            for (n, value) in out[component(i, j)].iter_mut().enumerate() {
                *value = q[(i, 0)] * half[j][n] + q[(i, 1)] * half[3 + j][n] + q[(i, 2)] * half[6 + j][n];
            }
        }
    }
    out
}

fn transpose(rows: &Nine) -> Nine {
    std::array::from_fn(|i| std::array::from_fn(|j| rows[j][i]))
}

/// `A : X` as a tensor.
fn contract(block: &Nine, x: &Matrix3<f64>) -> Matrix3<f64> {
    let x = x.transpose();
    let x = x.as_slice();
    Matrix3::from_fn(|i, j| {
        let row = &block[component(i, j)];
        (0..9).map(|n| row[n] * x[n]).sum()
    })
}

/// Flux by gradients: the pushed moduli, the rotation gradient through `Jl`.
fn by_gradient(frame: &SpaceFrame, pushed: &PushedModuli, out: &mut Tangent<3, 6>) {
    let jl = &frame.left;
    let through_jl = |block: &Nine, a: usize, j: usize, b: usize, k: usize| {
        let row = &block[component(a, j)];
        row[component(0, k)] * jl[(0, b)] + row[component(1, k)] * jl[(1, b)] + row[component(2, k)] * jl[(2, b)]
    };
    for j in 0..3 {
        for k in 0..3 {
            let block = &mut out.flux_gradient[j][k];
            for b in 0..3 {
                for a in 0..3 {
                    block[(a, b)] = pushed.force_stretch[component(a, j)][component(b, k)];
                    block[(3 + a, 3 + b)] = through_jl(&pushed.couple_wryness, a, j, b, k);
                    let cross = pushed.cross.as_ref().map_or((0.0, 0.0), |(force, couple)| {
                        (through_jl(force, a, j, b, k), couple[component(a, j)][component(b, k)])
                    });
                    (block[(a, 3 + b)], block[(3 + a, b)]) = cross;
                }
            }
        }
    }
}

/// Flux by the rotation vector.
fn by_rotation(frame: &SpaceFrame, p: &Matrix3<f64>, m: &Matrix3<f64>, pushed: &PushedModuli, out: &mut Tangent<3, 6>) {
    let k = &frame.rotation_gradient;
    let jl_k = frame.left * k;
    let jl_rates = frame.increment.left_differential_rates(k);
    for block in &mut out.flux_value {
        block.fill(0.0);
    }
    for (b, jl_rate) in jl_rates.iter().enumerate() {
        let spin = hat(&frame.left.column(b).into_owned());
        let x = -spin * frame.relative_deformation;
        let y = jl_rate - spin * jl_k;
        let mut dp = spin * p + contract(&pushed.force_stretch, &x);
        let mut dm = spin * m + contract(&pushed.couple_wryness, &y);
        if let Some((force_wryness, couple_stretch)) = &pushed.cross {
            dp += contract(force_wryness, &y);
            dm += contract(couple_stretch, &x);
        }
        for (j, block) in out.flux_value.iter_mut().enumerate() {
            block.fixed_view_mut::<3, 1>(0, 3 + b).copy_from(&dp.column(j));
            block.fixed_view_mut::<3, 1>(3, 3 + b).copy_from(&dm.column(j));
        }
    }
}

/// Rows of `c` from the rows of `P` that are already there, and `P dG^T`.
fn sources(frame: &SpaceFrame, p: &Matrix3<f64>, out: &mut Tangent<3, 6>) {
    out.source_value.fill(0.0);
    for block in &mut out.source_gradient {
        block.fill(0.0);
    }
    let df = &frame.relative_deformation;
    for b in 0..6 {
        let c = couple_of(df, |m| out.flux_value[m].fixed_view::<3, 1>(0, b).into_owned());
        out.source_value.fixed_view_mut::<3, 1>(3, b).copy_from(&c);
        for k in 0..3 {
            let c = couple_of(df, |m| out.flux_gradient[m][k].fixed_view::<3, 1>(0, b).into_owned());
            out.source_gradient[k].fixed_view_mut::<3, 1>(3, b).copy_from(&c);
        }
    }
    for (k, block) in out.source_gradient.iter_mut().enumerate() {
        // eps_ijb P_jk = hat(P e_k)_ib
        let mut view = block.fixed_view_mut::<3, 3>(3, 0);
        view += hat(&p.column(k).into_owned());
    }
}

/// `c_i = eps_ijl P_jm dF_lm` of the columns of (a change of) `P`.
fn couple_of(df: &Matrix3<f64>, column: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
    column(0).cross(&df.column(0)) + column(1).cross(&df.column(1)) + column(2).cross(&df.column(2))
}
