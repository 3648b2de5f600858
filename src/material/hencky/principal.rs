//! Logarithmic strain of a trial state in its principal directions.
//!
//! With `b* = F Cp^-1 F^T = V diag(1 + x) V^T` the principal strains are `ln(1 + x)/2`. Taken from `b* - I`, small strains
//! lose no digits.
//!
//! For a stretching `d` the strain changes, in axes that turn with the material, by `L : d` with components in the
//! principal directions
//!
//! ```text
//! (L : d)_aa = d_aa      (L : d)_ab = x coth(x) d_ab,  x = eps_a - eps_b
//! ```
//!
//! For a return along fixed principal directions that scales the deviator by one factor the stress obeys the same rule,
//! so that close eigenvalues need no care: no difference of them is divided by.

use super::invariants::Rates;
use crate::continuum::classical::ClassicalModuli;
use crate::continuum::tensor::{SYMMETRIC_PAIRS, symmetric, symmetric_eigen};
use crate::material::{Components, NoSolution};
use nalgebra::{Matrix3, Vector3};

/// A trial elastic strain.
#[derive(Clone, Copy, Debug)]
pub struct LogarithmicStrain {
    /// Columns are the principal directions.
    directions: Matrix3<f64>,
    /// Principal strains without their mean.
    deviator: Vector3<f64>,
    /// `tr eps*`.
    pub volumetric: f64,
    /// `sqrt(2/3 dev eps* : dev eps*)`.
    pub equivalent: f64,
}

/// Largest principal elastic strain that a return may end at: a stretch of 22 thousand. Beyond, `b - I` no longer holds
/// the digits of a small `b`.
const LARGEST_STRAIN: f64 = 10.0;

/// Places of the stresses that do work in plane strain, where the third principal direction is axis 3.
const IN_PLANE: &[usize] = &[0, 1, 3];
const SHEARED_IN_PLANE: &[(usize, usize)] = &[(0, 1)];
const ALL: &[usize] = &[0, 1, 2, 3, 4, 5];
const SHEARED: &[(usize, usize)] = &[(0, 1), (0, 2), (1, 2)];

impl LogarithmicStrain {
    /// The strain of `F Cp^-1 F^T`.
    ///
    /// # Errors
    /// A tensor that is not positive definite or not finite.
    pub fn new(deformation_gradient: &Matrix3<f64>, inverse_metric: &Matrix3<f64>) -> Result<Self, NoSolution> {
        let stretch = deformation_gradient * inverse_metric * deformation_gradient.transpose();
        let (excess, directions) = symmetric_eigen(&symmetric(&(stretch - Matrix3::identity())));
        let strains = excess.map(|x| 0.5 * x.ln_1p());
        let volumetric = strains.sum();
        if !volumetric.is_finite() {
            return Err(NoSolution {
                what: "the elastic strain has no logarithm",
                residual: f64::INFINITY,
            });
        }
        let deviator = strains.add_scalar(-volumetric / 3.0);
        Ok(Self {
            directions,
            deviator,
            volumetric,
            equivalent: (2.0 / 3.0 * deviator.norm_squared()).sqrt(),
        })
    }

    /// `p I + factor dev eps*`.
    pub fn stress(&self, pressure: f64, factor: f64) -> Matrix3<f64> {
        self.coaxial(&(self.deviator * factor).add_scalar(pressure))
    }

    /// `Cp^-1` for an elastic strain with this trace and this part of the trial deviator.
    ///
    /// # Errors
    /// An elastic strain beyond [`LARGEST_STRAIN`], a deformation gradient that has no inverse, a metric that is not finite.
    pub fn inverse_metric(
        &self,
        deformation_gradient: &Matrix3<f64>,
        volumetric: f64,
        deviator_ratio: f64,
    ) -> Result<Matrix3<f64>, NoSolution> {
        let strains = (self.deviator * deviator_ratio).add_scalar(volumetric / 3.0);
        if strains.amax() > LARGEST_STRAIN {
            return Err(NoSolution {
                what: "the elastic strain of the return is out of bounds",
                residual: strains.amax(),
            });
        }
        let stretch = self.coaxial(&strains.map(|strain| (2.0 * strain).exp()));
        let inverse = deformation_gradient.try_inverse();
        let metric = inverse.map(|inverse| symmetric(&(inverse * stretch * inverse.transpose())));
        metric.filter(|metric| metric.sum().is_finite()).ok_or(NoSolution {
            what: "the plastic strain is not finite",
            residual: f64::INFINITY,
        })
    }

    /// Corotational moduli of a stress whose invariants change with those of the strain by `rates`; overwrites the
    /// components that are active.
    pub fn moduli(&self, rates: &Rates, components: Components, out: &mut ClassicalModuli) {
        let (active, sheared) = match components {
            Components::Plane => (IN_PLANE, SHEARED_IN_PLANE),
            Components::Space => (ALL, SHEARED),
        };
        let normal = self.flow_direction();
        let mean = rates.pressure_by_volume - rates.deviator / 3.0;
        for &row in active {
            let (row_mean, row_pressure) = if row < 3 {
                (mean, rates.pressure_by_shear)
            } else {
                (0.0, 0.0)
            };
            for &column in active {
                let by_shear = row_pressure + rates.shear_by_shear * normal[row];
                let mut modulus = by_shear * normal[column];
                if column < 3 {
                    modulus += row_mean + rates.shear_by_volume * normal[row];
                }
                if column == row {
                    modulus += rates.deviator * if row < 3 { 1.0 } else { 0.5 };
                }
                out.corotational[row][column] = modulus;
            }
        }
        for &(a, b) in sheared {
            let shear = self.shear_direction(a, b);
            let x = (self.deviator[a] - self.deviator[b]).abs();
            let excess = if x > 0.0 { x / x.tanh() - 1.0 } else { 0.0 };
            for &row in active {
                let factor = 2.0 * rates.deviator * excess * shear[row];
                for &column in active {
                    out.corotational[row][column] += factor * shear[column];
                }
            }
        }
    }

    /// A tensor with these values along the principal directions.
    fn coaxial(&self, values: &Vector3<f64>) -> Matrix3<f64> {
        let v = &self.directions;
        let scaled = Matrix3::from_fn(|i, a| v[(i, a)] * values[a]);
        symmetric(&(scaled * v.transpose()))
    }

    /// `3 s*/(2 q*)`; zero where there is no shear.
    fn flow_direction(&self) -> [f64; 6] {
        if self.equivalent == 0.0 {
            return [0.0; 6];
        }
        let normal = self.coaxial(&(self.deviator / self.equivalent));
        SYMMETRIC_PAIRS.map(|pair| normal[pair])
    }

    /// Symmetric part of the product of two principal directions.
    fn shear_direction(&self, a: usize, b: usize) -> [f64; 6] {
        let v = &self.directions;
        SYMMETRIC_PAIRS.map(|(i, j)| 0.5 * (v[(i, a)] * v[(j, b)] + v[(i, b)] * v[(j, a)]))
    }
}
