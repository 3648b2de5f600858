//! Tensors of the local problem: full ones in space, one in-plane block and one normal component in plane strain.
//!
//! One set of formulas serves both; in plane strain a product takes nine multiplications instead of 27.

use crate::material::active::{ActiveSet, Pair, PlaneSet, SpaceSet};
use nalgebra::{Matrix2, Matrix3};
use std::ops::{Add, Mul, Sub};

/// A second-order tensor with the components that a scene can excite.
pub(super) trait Tensor:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    /// Components that fix a deviator: all but the last of its diagonal.
    const DEVIATOR: &'static [Pair];
    /// Components of the stretch that a motion can change.
    const STRETCH: &'static [Pair];
    /// Components of the wryness that a motion can change.
    const WRYNESS: &'static [Pair];

    fn identity() -> Self;
    /// The components of a tensor that this kind has.
    fn of(tensor: &Matrix3<f64>) -> Self;
    fn full(&self) -> Matrix3<f64>;
    fn at(&self, pair: Pair) -> f64;
    /// `e_i e_j^T`.
    fn unit(pair: Pair) -> Self;
    fn transpose(&self) -> Self;
    fn trace(&self) -> f64;
    fn determinant(&self) -> f64;
    /// `det(A) A^-T`.
    fn cofactor(&self) -> Self;
    /// `A : B`.
    fn dot(&self, other: &Self) -> f64;
    /// `A - tr(A)/3 I`, exactly zero for a multiple of the identity.
    fn deviator(&self) -> Self;
}

/// A deviator that changes in one of [`Tensor::DEVIATOR`] alone.
pub(super) fn deviatoric_unit<T: Tensor>(pair: Pair) -> T {
    if pair.0 == pair.1 {
        T::unit(pair) - T::unit((2, 2))
    } else {
        T::unit(pair)
    }
}

/// A tensor of plane strain.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneTensor {
    block: Matrix2<f64>,
    normal: f64,
}

impl Add for PlaneTensor {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            block: self.block + other.block,
            normal: self.normal + other.normal,
        }
    }
}

impl Sub for PlaneTensor {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            block: self.block - other.block,
            normal: self.normal - other.normal,
        }
    }
}

impl Mul for PlaneTensor {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            block: self.block * other.block,
            normal: self.normal * other.normal,
        }
    }
}

impl Mul<f64> for PlaneTensor {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            block: self.block * factor,
            normal: self.normal * factor,
        }
    }
}

impl Tensor for PlaneTensor {
    const DEVIATOR: &'static [Pair] = &[(0, 0), (0, 1), (1, 0), (1, 1)];
    const STRETCH: &'static [Pair] = PlaneSet::DRIVEN_STRETCH;
    const WRYNESS: &'static [Pair] = PlaneSet::DRIVEN_WRYNESS;

    fn identity() -> Self {
        Self {
            block: Matrix2::identity(),
            normal: 1.0,
        }
    }

    fn of(tensor: &Matrix3<f64>) -> Self {
        Self {
            block: tensor.fixed_view::<2, 2>(0, 0).into_owned(),
            normal: tensor[(2, 2)],
        }
    }

    fn full(&self) -> Matrix3<f64> {
        let b = &self.block;
        Matrix3::new(b.m11, b.m12, 0.0, b.m21, b.m22, 0.0, 0.0, 0.0, self.normal)
    }

    fn at(&self, (i, j): Pair) -> f64 {
        if i < 2 { self.block[(i, j)] } else { self.normal }
    }

    fn unit((i, j): Pair) -> Self {
        let mut unit = Self {
            block: Matrix2::zeros(),
            normal: 0.0,
        };
        if i < 2 {
            unit.block[(i, j)] = 1.0;
        } else {
            unit.normal = 1.0;
        }
        unit
    }

    fn transpose(&self) -> Self {
        Self {
            block: self.block.transpose(),
            normal: self.normal,
        }
    }

    fn trace(&self) -> f64 {
        self.block.m11 + self.block.m22 + self.normal
    }

    fn determinant(&self) -> f64 {
        self.block.determinant() * self.normal
    }

    fn cofactor(&self) -> Self {
        let b = &self.block;
        Self {
            block: Matrix2::new(b.m22, -b.m21, -b.m12, b.m11) * self.normal,
            normal: b.determinant(),
        }
    }

    fn dot(&self, other: &Self) -> f64 {
        self.block.dot(&other.block) + self.normal * other.normal
    }

    fn deviator(&self) -> Self {
        let [x, y, z] = deviatoric_diagonal([self.block.m11, self.block.m22, self.normal]);
        Self {
            block: Matrix2::new(x, self.block.m12, self.block.m21, y),
            normal: z,
        }
    }
}

impl Tensor for Matrix3<f64> {
    const DEVIATOR: &'static [Pair] = &[(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)];
    const STRETCH: &'static [Pair] = SpaceSet::DRIVEN_STRETCH;
    const WRYNESS: &'static [Pair] = SpaceSet::DRIVEN_WRYNESS;

    fn identity() -> Self {
        Matrix3::identity()
    }

    fn of(tensor: &Matrix3<f64>) -> Self {
        *tensor
    }

    fn full(&self) -> Matrix3<f64> {
        *self
    }

    fn at(&self, pair: Pair) -> f64 {
        self[pair]
    }

    fn unit(pair: Pair) -> Self {
        let mut unit = Matrix3::zeros();
        unit[pair] = 1.0;
        unit
    }

    fn transpose(&self) -> Self {
        self.transpose()
    }

    fn trace(&self) -> f64 {
        self.trace()
    }

    fn determinant(&self) -> f64 {
        self.determinant()
    }

    fn cofactor(&self) -> Self {
        let [x, y, z] = [self.column(0), self.column(1), self.column(2)];
        Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)])
    }

    fn dot(&self, other: &Self) -> f64 {
        self.dot(other)
    }

    fn deviator(&self) -> Self {
        let mut deviator = *self;
        deviator.set_diagonal(&deviatoric_diagonal([self.m11, self.m22, self.m33]).into());
        deviator
    }
}

fn deviatoric_diagonal([x, y, z]: [f64; 3]) -> [f64; 3] {
    [2.0 * x - y - z, 2.0 * y - z - x, 2.0 * z - x - y].map(|component| component / 3.0)
}
