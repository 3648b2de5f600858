//! The sine-product solution of T 3.186 and the body forces and couples that it needs.
//!
//! On the unit cube (square in plane strain) every component of displacement and rotation vector is
//!
//! ```text
//! f(X) = a sin(2 pi X_1) sin(2 pi X_2) sin(2 pi X_3)
//! ```
//!
//! which vanishes on all faces. With the micropolar elastic law, `P = Q B` and `M = Q S` per unit reference area, the
//! strong form of the balance of forces and moments gives the loads per unit reference volume:
//!
//! ```text
//! p_i = -dP_ij/dX_j        q_i = -dM_ij/dX_j + eps_ijk (P F^T)_jk
//! ```
//!
//! The derivatives are exact: `f` has closed ones, and everything after it is computed with dual numbers.

use super::varying::{VaryingScalar, VaryingTensor};
use crate::continuum::rotation::{RotationCoefficients, hat};
use crate::continuum::tensor::permutation_product;
use crate::material::elastic::ElasticMaps;
use crate::material::spec::ElasticModuli;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

/// What a user decides of a manufactured solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manufactured {
    /// Amplitude of displacement [m] and rotation vector [rad].
    pub amplitude: f64,
    /// Of the one material of the body.
    pub moduli: ElasticModuli,
}

/// The solution in a given dimension.
#[derive(Clone, Debug)]
pub struct Solution {
    amplitude: f64,
    maps: ElasticMaps,
    dimension: usize,
    /// Displacement and rotation vector are these times the sine product.
    displacement_direction: Vector3<f64>,
    rotation_direction: Vector3<f64>,
}

/// Load per unit reference volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyLoad {
    /// [N/m3].
    pub force: Vector3<f64>,
    /// [N m/m3].
    pub couple: Vector3<f64>,
}

/// What is exact at a point of the body.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    pub displacement: Vector3<f64>,
    /// Rotation vector.
    pub rotation: Vector3<f64>,
    /// Cauchy stress [Pa].
    pub stress: Matrix3<f64>,
    /// Cauchy couple-stress [N/m].
    pub couple_stress: Matrix3<f64>,
}

/// Stresses and what they follow from, with their derivatives by the reference position.
struct State {
    deformation: VaryingTensor,
    /// `P`.
    force: VaryingTensor,
    /// `M`.
    couple: VaryingTensor,
}

impl Solution {
    /// `dimension` is 2 in plane strain, 3 in space.
    pub fn new(manufactured: &Manufactured, dimension: usize) -> Self {
        let plane = dimension == 2;
        Self {
            amplitude: manufactured.amplitude,
            maps: ElasticMaps::new(&manufactured.moduli),
            dimension,
            displacement_direction: Vector3::new(1.0, 1.0, if plane { 0.0 } else { 1.0 }),
            rotation_direction: if plane { Vector3::z() } else { Vector3::repeat(1.0) },
        }
    }

    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Body force and couple at a reference position.
    pub fn load(&self, position: &Vector3<f64>) -> BodyLoad {
        let state = self.state(position);
        let kirchhoff = state.force.value * state.deformation.value.transpose();
        BodyLoad {
            force: -state.force.divergence(),
            couple: permutation_product(&kirchhoff) - state.couple.divergence(),
        }
    }

    /// Displacement, rotation and stresses at a reference position.
    pub fn exact(&self, position: &Vector3<f64>) -> Exact {
        let state = self.state(position);
        let f = self.product(position, [0; 3]);
        let gradient = state.deformation.value;
        let cauchy = |stress: &VaryingTensor| stress.value * gradient.transpose() / gradient.determinant();
        Exact {
            displacement: self.displacement_direction * f,
            rotation: self.rotation_direction * f,
            stress: cauchy(&state.force),
            couple_stress: cauchy(&state.couple),
        }
    }

    fn state(&self, position: &Vector3<f64>) -> State {
        let displacement_gradient = self.gradient_of(&self.displacement_direction, position);
        let rotation_gradient = self.gradient_of(&self.rotation_direction, position);
        let deformation = VaryingTensor::identity() + displacement_gradient;
        let (rotation, left) = self.rotation(position);
        let stretch = rotation.transpose() * deformation;
        let wryness = rotation.transpose() * left * rotation_gradient;
        let strain = VaryingTensor {
            value: stretch.value - Matrix3::identity(),
            ..stretch
        };
        State {
            deformation,
            force: rotation * strain.map(|strain| self.maps.force.apply(strain)),
            couple: rotation * wryness.map(|wryness| self.maps.couple.apply(wryness)),
        }
    }

    /// `Q = exp(hat w)` and `Jl(w)`, with the coefficients of `continuum::rotation`, functions of `x = w . w`.
    fn rotation(&self, position: &Vector3<f64>) -> (VaryingTensor, VaryingTensor) {
        let f = self.product(position, [0; 3]);
        let w = self.rotation_direction * f;
        let w_along = self.slope(position).data.0[0].map(|slope| self.rotation_direction * slope);
        let hat_w = VaryingTensor {
            value: hat(&w),
            along: w_along.each_ref().map(hat),
        };
        let x_gradient = Vector3::from(w_along.map(|along| 2.0 * w.dot(&along)));
        let coefficients = RotationCoefficients::at(w.norm_squared());
        let RotationCoefficients { a, b, c, .. } = coefficients;
        // (db/dtheta)/theta = 2 db/dx, likewise c; and a = 1 - c x.
        let (b_slope, c_slope) = (0.5 * coefficients.b_rate, 0.5 * coefficients.c_rate);
        let a_slope = -c - c_slope * w.norm_squared();
        let function = |value: f64, slope: f64| VaryingScalar {
            value,
            gradient: x_gradient * slope,
        };
        let squared = hat_w * hat_w;
        let rotation = VaryingTensor::identity() + function(a, a_slope) * hat_w + function(b, b_slope) * squared;
        let left = VaryingTensor::identity() + function(b, b_slope) * hat_w + function(c, c_slope) * squared;
        (rotation, left)
    }

    /// Gradient of the field `direction f`.
    fn gradient_of(&self, direction: &Vector3<f64>, position: &Vector3<f64>) -> VaryingTensor {
        let gradient_along = |k: usize| {
            let row = Vector3::from_fn(|j, _| {
                let mut orders = [0; 3];
                orders[j] += 1;
                orders[k] += 1;
                self.product(position, orders)
            });
            direction * row.transpose()
        };
        VaryingTensor {
            value: direction * self.slope(position).transpose(),
            along: std::array::from_fn(gradient_along),
        }
    }

    /// Gradient of the sine product.
    fn slope(&self, position: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|k, _| {
            let mut orders = [0; 3];
            orders[k] = 1;
            self.product(position, orders)
        })
    }

    /// The sine product, derived as often along each axis as `orders` say, at most twice.
    fn product(&self, position: &Vector3<f64>, orders: [usize; 3]) -> f64 {
        let factor = |axis: usize| {
            let (sin, cos) = (TAU * position[axis]).sin_cos();
            match (axis < self.dimension, orders[axis]) {
                (true, 0) => sin,
                (true, 1) => TAU * cos,
                (true, _) => -TAU * TAU * sin,
                (false, 0) => 1.0,
                (false, _) => 0.0,
            }
        };
        self.amplitude * (0..3).map(factor).product::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// No two alike, so that no term can take the place of another.
    fn solution(dimension: usize) -> Solution {
        let moduli = ElasticModuli {
            lambda: 15.0,
            mu: 10.0,
            kappa: 3.5,
            alpha: 0.7,
            beta: 1.3,
            gamma: 2.9,
        };
        Solution::new(
            &Manufactured {
                amplitude: 0.05,
                moduli,
            },
            dimension,
        )
    }

    /// Derivative along an axis by differences of fourth order.
    fn difference<T>(function: impl Fn(&Vector3<f64>) -> T, at: &Vector3<f64>, axis: usize) -> T
    where
        T: std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        const STEP: f64 = 2e-3;
        let moved = |steps: f64| function(&(at + Vector3::ith(axis, steps * STEP)));
        ((moved(1.0) - moved(-1.0)) * 8.0 - (moved(2.0) - moved(-2.0))) * (1.0 / (12.0 * STEP))
    }

    fn field(solution: &Solution, position: &Vector3<f64>) -> f64 {
        (0..solution.dimension).fold(0.05, |product, axis| product * (TAU * position[axis]).sin())
    }

    fn rotation(solution: &Solution, position: &Vector3<f64>) -> Matrix3<f64> {
        let vector = solution.rotation_direction * field(solution, position);
        Rotation3::from_scaled_axis(vector).into_inner()
    }

    /// `F`, `P` and `M` from the definitions: displacement and rotation matrix differentiated by differences, the wryness
    /// as `-1/2 eps_acd Q_ic dQ_id/dX_b`, the law in terms of symmetric and skew parts.
    fn stresses(solution: &Solution, position: &Vector3<f64>) -> [Matrix3<f64>; 3] {
        let displacement = |at: &Vector3<f64>| solution.displacement_direction * field(solution, at);
        let columns = [0, 1, 2].map(|axis| difference(displacement, position, axis));
        let deformation = Matrix3::identity() + Matrix3::from_columns(&columns);
        let q = rotation(solution, position);
        let turned = |axis| q.transpose() * difference(|at: &Vector3<f64>| rotation(solution, at), position, axis);
        let wryness = Matrix3::from_columns(&[0, 1, 2].map(|axis| permutation_product(&turned(axis)) * -0.5));
        let isotropic = |x: &Matrix3<f64>, [trace, symmetric, skew]: [f64; 3]| {
            let (even, odd) = (0.5 * (x + x.transpose()), 0.5 * (x - x.transpose()));
            Matrix3::identity() * (trace * x.trace()) + even * (2.0 * symmetric) + odd * (2.0 * skew)
        };
        let strain = q.transpose() * deformation - Matrix3::identity();
        let force = q * isotropic(&strain, [15.0, 10.0, 3.5]);
        [deformation, force, q * isotropic(&wryness, [0.7, 2.9, 1.3])]
    }

    const POSITIONS: [[f64; 3]; 3] = [[0.13, 0.27, 0.41], [0.6, 0.35, 0.82], [0.05, 0.9, 0.55]];

    #[test]
    fn the_loads_balance_stresses_that_are_differentiated_numerically() {
        for (dimension, position) in [2, 3]
            .into_iter()
            .flat_map(|d| POSITIONS.map(|at| (d, Vector3::from(at))))
        {
            let solution = solution(dimension);
            let divergence = |which: usize| -> Vector3<f64> {
                let of = |axis| difference(|at: &Vector3<f64>| stresses(&solution, at)[which], &position, axis);
                (0..3).map(|axis| of(axis).column(axis).into_owned()).sum()
            };
            let [deformation, force, _] = stresses(&solution, &position);
            let load = solution.load(&position);
            let force_balance = divergence(1) + load.force;
            let couple_balance = divergence(2) - permutation_product(&(force * deformation.transpose())) + load.couple;
            assert!(load.force.norm() > 0.1 && load.couple.norm() > 0.1, "{load:?}");
            assert!(
                force_balance.norm() < 1e-6 * load.force.norm(),
                "{dimension}: {force_balance}"
            );
            assert!(
                couple_balance.norm() < 1e-6 * load.couple.norm(),
                "{dimension}: {couple_balance}"
            );
        }
    }

    #[test]
    fn exact_fields_are_those_of_the_definitions() {
        for (dimension, position) in [2, 3]
            .into_iter()
            .flat_map(|d| POSITIONS.map(|at| (d, Vector3::from(at))))
        {
            let solution = solution(dimension);
            let exact = solution.exact(&position);
            let [deformation, force, couple] = stresses(&solution, &position);
            let cauchy = |stress: Matrix3<f64>| stress * deformation.transpose() / deformation.determinant();
            assert!((exact.stress - cauchy(force)).norm() < 1e-7 * exact.stress.norm());
            assert!((exact.couple_stress - cauchy(couple)).norm() < 1e-7 * exact.couple_stress.norm());
            let turned = Rotation3::from_scaled_axis(exact.rotation).into_inner();
            assert!((turned - rotation(&solution, &position)).norm() < 1e-15);
            assert!((exact.displacement.x - field(&solution, &position)).abs() < 1e-16);
        }
    }

    #[test]
    fn the_solution_vanishes_on_the_faces_and_plane_strain_has_no_third_axis() {
        let solution = solution(2);
        let exact = solution.exact(&Vector3::new(0.3, 1.0, 0.0));
        assert!(exact.displacement.norm() < 1e-16 && exact.rotation.norm() < 1e-16);
        let load = solution.load(&Vector3::new(0.3, 0.4, 0.0));
        assert_eq!((load.force.z, load.couple.x, load.couple.y), (0.0, 0.0, 0.0));
    }
}
