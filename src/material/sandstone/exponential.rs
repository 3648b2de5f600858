//! Exponential of a deviator that need not be symmetric, and its derivative.
//!
//! By Cayley and Hamilton `A^3 = j2 A + j3 I` for `tr A = 0`, with `j2 = tr(A^2)/2` and `j3 = det A`. So every power is
//! `a I + b A + c A^2`, and
//!
//! ```text
//! exp(A)    = f0 I + f1 A + f2 A^2                      f = f(j2, j3)
//! d exp(A)  = df0 I + df1 A + df2 A^2 + f1 dA + f2 (A dA + dA A)
//! dj2 = tr(A dA)      dj3 = tr(A^2 dA)                  for tr dA = 0
//! ```
//!
//! The coefficients are power series, summed to machine precision; no eigenvalue is needed, and none of them may be
//! close to another.

use super::tensor::Tensor;

/// Norm of the exponent above which the series is not summed: a plastic strain of this size in one step is no solution.
const LARGEST_NORM: f64 = 4.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Exponential<T> {
    /// `exp(A)`.
    pub value: T,
    exponent: T,
    square: T,
    f: [f64; 3],
    by_j2: [f64; 3],
    by_j3: [f64; 3],
}

impl<T: Tensor> Exponential<T> {
    /// The exponential of a deviator; `None` for one that is too large or not finite.
    pub fn new(exponent: &T) -> Option<Self> {
        let norm = exponent.dot(exponent).sqrt();
        // Written so that what is not a number is refused, too.
        let within = norm <= LARGEST_NORM;
        if !within {
            return None;
        }
        let square = *exponent * *exponent;
        let [f, by_j2, by_j3] = coefficients(0.5 * square.trace(), exponent.determinant(), norm);
        Some(Self {
            value: T::identity() * f[0] + *exponent * f[1] + square * f[2],
            exponent: *exponent,
            square,
            f,
            by_j2,
            by_j3,
        })
    }

    /// Change of the exponential with a deviatoric change of its exponent.
    pub fn rate(&self, change: &T) -> T {
        let a = self.exponent;
        let transposed = change.transpose();
        let (j2, j3) = (a.dot(&transposed), self.square.dot(&transposed));
        let [c0, c1, c2] = [0, 1, 2].map(|k| self.by_j2[k] * j2 + self.by_j3[k] * j3);
        T::identity() * c0 + a * c1 + self.square * c2 + *change * self.f[1] + (a * *change + *change * a) * self.f[2]
    }
}

/// `f0, f1, f2`, and their derivatives by `j2` and by `j3`.
fn coefficients(j2: f64, j3: f64, norm: f64) -> [[f64; 3]; 3] {
    /// More than the longest series takes: `4^40/40!` is below 1e-23.
    const MOST_TERMS: u32 = 40;
    let mut term = [1.0, 0.0, 0.0];
    let (mut term_j2, mut term_j3) = ([0.0; 3], [0.0; 3]);
    let mut sums = [term, term_j2, term_j3];
    let mut size = 1.0;
    for n in 1..=MOST_TERMS {
        let share = 1.0 / f64::from(n);
        let [a, b, c] = term_j2;
        term_j2 = [c * j3, a + c * j2 + term[2], b].map(|x| x * share);
        let [a, b, c] = term_j3;
        term_j3 = [c * j3 + term[2], a + c * j2, b].map(|x| x * share);
        let [a, b, c] = term;
        term = [c * j3, a + c * j2, b].map(|x| x * share);
        for (sum, term) in sums.iter_mut().zip([term, term_j2, term_j3]) {
            (0..3).for_each(|k| sum[k] += term[k]);
        }
        size *= norm * share;
        // The derivatives begin with the fifth power.
        if n >= 5 && size <= 1e-18 * norm {
            break;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::tensor::{PlaneTensor, deviatoric_unit};
    use super::*;
    use nalgebra::Matrix3;

    fn samples() -> Vec<Matrix3<f64>> {
        let general = Matrix3::new(0.3, -0.1, 0.25, -0.4, 0.2, 0.15, 0.3, 0.05, -0.5);
        let nilpotent = Matrix3::new(0.0, 0.7, 0.2, 0.0, 0.0, -0.4, 0.0, 0.0, 0.0);
        let axial = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.4, 0.4, -0.8));
        let turning = Matrix3::new(0.1, -0.9, 0.0, 0.8, 0.1, 0.0, 0.0, 0.0, -0.2);
        vec![
            general,
            general * 1e-3,
            general * 1e-9,
            general * 4.0,
            nilpotent,
            axial,
            turning,
            Matrix3::zeros(),
        ]
    }

    /// Value and derivative along `change` of the power series.
    fn by_power_series(a: &Matrix3<f64>, change: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
        let (mut power, mut rate) = (Matrix3::identity(), Matrix3::zeros());
        let (mut value, mut derivative) = (power, rate);
        for n in 1..80 {
            rate = (change * power + a * rate) / f64::from(n);
            power = a * power / f64::from(n);
            value += power;
            derivative += rate;
        }
        (value, derivative)
    }

    #[test]
    fn value_and_derivative_equal_those_of_the_power_series() {
        for sample in samples() {
            let exponential = Exponential::new(&sample).expect("within bounds");
            for &pair in Matrix3::<f64>::DEVIATOR {
                let change = deviatoric_unit(pair);
                let (value, derivative) = by_power_series(&sample, &change);
                assert!((exponential.value - value).norm() < 2e-14 * value.norm());
                let error = (exponential.rate(&change) - derivative).norm();
                assert!(error < 2e-14 * derivative.norm(), "{error:e} for {sample}");
            }
        }
    }

    #[test]
    fn plane_tensors_agree_with_full_ones() {
        let turning = samples()[6];
        let plane = Exponential::new(&PlaneTensor::of(&turning)).expect("within bounds");
        for &pair in PlaneTensor::DEVIATOR {
            let (value, derivative) = by_power_series(&turning, &deviatoric_unit(pair));
            assert!((plane.value.full() - value).norm() < 1e-14);
            assert!((plane.rate(&deviatoric_unit(pair)).full() - derivative).norm() < 1e-14);
        }
    }

    #[test]
    fn refuses_what_is_too_large_or_no_number() {
        for factor in [1e9, f64::NAN, f64::INFINITY] {
            assert!(Exponential::new(&(samples()[0] * factor)).is_none());
        }
    }
}
