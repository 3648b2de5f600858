//! The three unknowns of a micropolar body in plane strain, the rotation about axis 3.
//!
//! The formulas of the space version with the components that cannot move left out: `Jl(w) K = K` for a rotation
//! about a fixed axis, `dGamma_3b = dK_l F~_lb`, and the couples work on `M_3j = S_3b F~_jb` alone.

use super::{
    Continuum, Micropolar, MicropolarModuli, MicropolarMotion, MicropolarStrain, MicropolarStress, StrainRates,
    advanced,
};
use crate::continuum::tensor::component;
use crate::continuum::{Fields, Flux, Jet, Observation, Tangent, UnknownKind};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};
use std::f64::consts::PI;

/// Kinematics at the end of a step, in the plane.
#[derive(Clone, Copy, Debug)]
pub struct PlaneFrame {
    /// `F~`.
    old_deformation: Matrix2<f64>,
    /// `dF = I + G`.
    relative_deformation: Matrix2<f64>,
    /// `Q`, new.
    rotation: Matrix2<f64>,
}

impl Fields<2, 3> for Micropolar {
    const UNKNOWNS: [&'static str; 3] = ["ux", "uy", "rz"];
    const KIND: [UnknownKind; 3] = [
        UnknownKind::Translation,
        UnknownKind::Translation,
        UnknownKind::Rotation,
    ];
    type Frame = PlaneFrame;

    fn strain(motion: &MicropolarMotion, jet: &Jet<2, 3>) -> Option<(MicropolarStrain, PlaneFrame)> {
        let relative_deformation = Matrix2::identity() + jet.gradient.fixed_rows::<2>(0);
        let w = jet.value[2];
        let k = jet.gradient.row(2);
        // The comparisons are written so that what is not a number is outside, too.
        let volume_change = relative_deformation.determinant();
        let inside = volume_change > 0.0 && volume_change.is_finite() && w.abs() < PI;
        if !(inside && k[0].is_finite() && k[1].is_finite()) {
            return None;
        }
        let old_deformation = motion.deformation_gradient.fixed_view::<2, 2>(0, 0).into_owned();
        let (sin, cos) = w.sin_cos();
        let rotation = Matrix2::new(cos, -sin, sin, cos) * plane_rotation(motion);
        let mut strain = MicropolarStrain {
            stretch: motion.deformation_gradient,
            wryness: motion.wryness,
        };
        let stretch = rotation.tr_mul(&(relative_deformation * old_deformation));
        strain.stretch.fixed_view_mut::<2, 2>(0, 0).copy_from(&stretch);
        let mut curvature = strain.wryness.fixed_view_mut::<1, 2>(2, 0);
        curvature += k * old_deformation;
        let frame = PlaneFrame {
            old_deformation,
            relative_deformation,
            rotation,
        };
        Some((strain, frame))
    }

    fn flux(frame: &PlaneFrame, stress: &MicropolarStress) -> Flux<2, 3> {
        let (p, m) = pushed_stress(frame, stress);
        let tau = p * frame.relative_deformation.transpose();
        Flux {
            source: Vector3::new(0.0, 0.0, tau[(0, 1)] - tau[(1, 0)]),
            flux: SMatrix::<f64, 3, 2>::new(p.m11, p.m12, p.m21, p.m22, m.x, m.y),
        }
    }

    fn tangent(frame: &PlaneFrame, stress: &MicropolarStress, moduli: &MicropolarModuli, out: &mut Tangent<2, 3>) {
        let (p, _) = pushed_stress(frame, stress);
        let push = Push::new(frame);
        let force_stretch = push.force_stretch(&moduli.force_stretch);
        let couple_wryness = push.couple_wryness(&moduli.couple_wryness);
        let (force_wryness, couple_stretch) = if moduli.coupled {
            (
                push.force_wryness(&moduli.force_wryness),
                push.couple_stretch(&moduli.couple_stretch),
            )
        } else {
            ([[0.0; 2]; 4], [[0.0; 4]; 2])
        };
        let df = &frame.relative_deformation;
        // X = -hat(e_3) dF, the spin's part of the change of U.
        let x = [df.m21, df.m22, -df.m11, -df.m12];
        // hat(e_3) P
        let turned = [-p.m21, -p.m22, p.m11, p.m12];
        for j in 0..2 {
            out.flux_value[j] = SMatrix::zeros();
            for a in 0..2 {
                out.flux_value[j][(a, 2)] = turned[2 * a + j] + dot(&force_stretch[2 * a + j], &x);
            }
            out.flux_value[j][(2, 2)] = dot(&couple_stretch[j], &x);
            for k in 0..2 {
                let block = &mut out.flux_gradient[j][k];
                for a in 0..2 {
                    for b in 0..2 {
                        block[(a, b)] = force_stretch[2 * a + j][2 * b + k];
                    }
                    block[(a, 2)] = force_wryness[2 * a + j][k];
                    block[(2, a)] = couple_stretch[j][2 * a + k];
                }
                block[(2, 2)] = couple_wryness[j][k];
            }
        }
        sources(df, &p, out);
    }

    fn advance(motion: &MicropolarMotion, jet: &Jet<2, 3>) -> MicropolarMotion {
        let mut g = Matrix3::zeros();
        let mut k = Matrix3::zeros();
        g.fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&jet.gradient.fixed_rows::<2>(0));
        k.fixed_view_mut::<1, 2>(2, 0).copy_from(&jet.gradient.row(2));
        advanced(motion, &g, &Vector3::new(0.0, 0.0, jet.value[2]), &k)
    }

    fn observe_fields(motion: &MicropolarMotion, stress: &MicropolarStress) -> Observation {
        Observation {
            rotation: Some(Vector3::new(0.0, 0.0, motion.twist.z)),
            ..Micropolar::observe(motion, stress)
        }
    }
}

impl StrainRates<2, 3> for Micropolar {
    /// In the plane a change of the rotation is a spin, so that these are the fluxes of a stress.
    fn strain_rates(frame: &PlaneFrame, by_strain: &MicropolarStress) -> Flux<2, 3> {
        <Micropolar as Fields<2, 3>>::flux(frame, by_strain)
    }
}

/// The rotation of a motion whose axis is 3.
fn plane_rotation(motion: &MicropolarMotion) -> Matrix2<f64> {
    let q = motion.rotation.quaternion();
    let (cos, sin) = (q.w * q.w - q.k * q.k, 2.0 * q.w * q.k);
    Matrix2::new(cos, -sin, sin, cos)
}

/// `P` and the third row of `M`.
fn pushed_stress(frame: &PlaneFrame, stress: &MicropolarStress) -> (Matrix2<f64>, Vector2<f64>) {
    let force = stress.force.fixed_view::<2, 2>(0, 0);
    let couple = Vector2::new(stress.couple.m31, stress.couple.m32);
    let f = &frame.old_deformation;
    (frame.rotation * force * f.transpose(), f * couple)
}

/// Rows and columns of a tensor's in-plane components, and of the third row.
const IN_PLANE: [usize; 4] = [component(0, 0), component(0, 1), component(1, 0), component(1, 1)];
const THIRD_ROW: [usize; 2] = [component(2, 0), component(2, 1)];

/// Push-forward of moduli: `Q x F~` on the force side, `F~` on the couple side.
struct Push {
    force: [[f64; 4]; 4],
    couple: [[f64; 2]; 2],
}

impl Push {
    fn new(frame: &PlaneFrame) -> Self {
        let (q, f) = (&frame.rotation, &frame.old_deformation);
        Self {
            force: std::array::from_fn(|aj| std::array::from_fn(|im| q[(aj / 2, im / 2)] * f[(aj % 2, im % 2)])),
            couple: std::array::from_fn(|j| [f[(j, 0)], f[(j, 1)]]),
        }
    }

    fn force_stretch(&self, block: &SMatrix<f64, 9, 9>) -> [[f64; 4]; 4] {
        sandwich(&self.force, &gather(block, IN_PLANE, IN_PLANE), &self.force)
    }

    fn force_wryness(&self, block: &SMatrix<f64, 9, 9>) -> [[f64; 2]; 4] {
        sandwich(&self.force, &gather(block, IN_PLANE, THIRD_ROW), &self.couple)
    }

    fn couple_stretch(&self, block: &SMatrix<f64, 9, 9>) -> [[f64; 4]; 2] {
        sandwich(&self.couple, &gather(block, THIRD_ROW, IN_PLANE), &self.force)
    }

    fn couple_wryness(&self, block: &SMatrix<f64, 9, 9>) -> [[f64; 2]; 2] {
        sandwich(&self.couple, &gather(block, THIRD_ROW, THIRD_ROW), &self.couple)
    }
}

fn gather<const R: usize, const C: usize>(
    block: &SMatrix<f64, 9, 9>,
    rows: [usize; R],
    columns: [usize; C],
) -> [[f64; C]; R] {
    rows.map(|row| columns.map(|column| block[(row, column)]))
}

/// `L C R^T`.
fn sandwich<const R: usize, const C: usize>(
    left: &[[f64; R]; R],
    block: &[[f64; C]; R],
    right: &[[f64; C]; C],
) -> [[f64; C]; R] {
    let mut half = [[0.0; C]; R];
    for i in 0..R {
        for (m, row) in block.iter().enumerate() {
            for n in 0..C {
                half[i][n] += left[i][m] * row[n];
            }
        }
    }
    half.map(|row| std::array::from_fn(|j| dot(&row, &right[j])))
}

fn dot<const L: usize>(left: &[f64; L], right: &[f64; L]) -> f64 {
    left.iter().zip(right).map(|(a, b)| a * b).sum()
}

/// Rows of `c_3 = tau_12 - tau_21`, `tau = P dF^T`, from the rows of `P` that are already there, and `P dG^T`.
fn sources(df: &Matrix2<f64>, p: &Matrix2<f64>, out: &mut Tangent<2, 3>) {
    out.source_value = SMatrix::zeros();
    out.source_value[(2, 2)] = (0..2)
        .map(|m| out.flux_value[m][(0, 2)] * df[(1, m)] - out.flux_value[m][(1, 2)] * df[(0, m)])
        .sum();
    for k in 0..2 {
        out.source_gradient[k] = SMatrix::zeros();
        for b in 0..3 {
            out.source_gradient[k][(2, b)] = (0..2)
                .map(|m| {
                    let dp = &out.flux_gradient[m][k];
                    dp[(0, b)] * df[(1, m)] - dp[(1, b)] * df[(0, m)]
                })
                .sum();
        }
        out.source_gradient[k][(2, 0)] -= p[(1, k)];
        out.source_gradient[k][(2, 1)] += p[(0, k)];
    }
}
