//! Dual numbers whose parts are tensors: a value at a point with its exact first derivatives along the three axes.
//!
//! Sums, products and linear maps carry the derivatives along by the product rule, so that what is written like a formula
//! of tensors yields the formula and its derivatives to round-off.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, Mul};

/// A scalar that varies in space.
#[derive(Clone, Copy, Debug)]
pub struct VaryingScalar {
    pub value: f64,
    /// Derivatives along the axes.
    pub gradient: Vector3<f64>,
}

/// A tensor that varies in space.
#[derive(Clone, Copy, Debug)]
pub struct VaryingTensor {
    pub value: Matrix3<f64>,
    /// Derivatives along the axes.
    pub along: [Matrix3<f64>; 3],
}

impl VaryingTensor {
    pub fn identity() -> Self {
        Self {
            value: Matrix3::identity(),
            along: [Matrix3::zeros(); 3],
        }
    }

    /// Image by a linear map that is the same everywhere.
    pub fn map(&self, linear: impl Fn(&Matrix3<f64>) -> Matrix3<f64>) -> Self {
        Self {
            value: linear(&self.value),
            along: self.along.each_ref().map(&linear),
        }
    }

    pub fn transpose(&self) -> Self {
        self.map(Matrix3::transpose)
    }

    /// `d T_ij / d X_j`.
    pub fn divergence(&self) -> Vector3<f64> {
        (0..3).map(|j| self.along[j].column(j).into_owned()).sum()
    }
}

impl Add for VaryingTensor {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            along: std::array::from_fn(|k| self.along[k] + other.along[k]),
        }
    }
}

impl Mul for VaryingTensor {
    type Output = Self;

    // The sum is that of the product rule.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            along: std::array::from_fn(|k| self.along[k] * other.value + self.value * other.along[k]),
        }
    }
}

impl Mul<VaryingTensor> for VaryingScalar {
    type Output = VaryingTensor;

    // The sum is that of the product rule.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, tensor: VaryingTensor) -> VaryingTensor {
        VaryingTensor {
            value: tensor.value * self.value,
            along: std::array::from_fn(|k| tensor.along[k] * self.value + tensor.value * self.gradient[k]),
        }
    }
}
