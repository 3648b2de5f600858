//! Rotation vectors: exponential map, its left differential and the derivative of that differential.
//!
//! With `hat(w) v = w x v` and `theta = |w|`:
//!
//! ```text
//! exp(hat w) = I + a hat w + b hat^2 w        a = sin(theta)/theta
//! Jl(w)      = I + b hat w + c hat^2 w        b = (1 - cos theta)/theta^2    c = (theta - sin theta)/theta^3
//! d exp(hat w) = hat(Jl(w) dw) exp(hat w)     Jr(w) = Jl(-w) = exp(-hat w) Jl(w)
//! ```
//!
//! The coefficients are even functions of `theta`. Below `theta = 1` (almost every step of an analysis) their power
//! series are summed to machine precision; the closed forms lose digits there, their derivatives most of all.

use nalgebra::{Matrix3, Vector3};

/// Below this square of the angle the power series are used.
const SERIES_LIMIT: f64 = 1.0;

/// Number of terms of the power series: the first one left out is below 1e-17 at the limit.
const TERMS: usize = 9;

/// The coefficients of the exponential map at one angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationCoefficients {
    /// `sin(theta)/theta`.
    pub a: f64,
    /// `(1 - cos theta)/theta^2`.
    pub b: f64,
    /// `(theta - sin theta)/theta^3`.
    pub c: f64,
    /// `(db/dtheta)/theta`.
    pub b_rate: f64,
    /// `(dc/dtheta)/theta`.
    pub c_rate: f64,
}

impl RotationCoefficients {
    /// Coefficients at the given square of the angle.
    pub fn at(angle_squared: f64) -> Self {
        if angle_squared < SERIES_LIMIT {
            Self::by_series(angle_squared)
        } else {
            Self::in_closed_form(angle_squared)
        }
    }

    fn by_series(x: f64) -> Self {
        let c = horner(&C_SERIES, x);
        Self {
            a: 1.0 - c * x,
            b: horner(&B_SERIES, x),
            c,
            b_rate: horner(&B_RATE_SERIES, x),
            c_rate: horner(&C_RATE_SERIES, x),
        }
    }

    fn in_closed_form(x: f64) -> Self {
        let theta = x.sqrt();
        let (sin, cos) = theta.sin_cos();
        Self {
            a: sin / theta,
            b: (1.0 - cos) / x,
            c: (theta - sin) / (x * theta),
            b_rate: (theta * sin - 2.0 * (1.0 - cos)) / (x * x),
            c_rate: (theta * (1.0 - cos) - 3.0 * (theta - sin)) / (x * x * theta),
        }
    }
}

/// `w x .` as a matrix.
pub fn hat(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// A rotation vector with the maps of this module evaluated at it.
#[derive(Clone, Copy, Debug)]
pub struct RotationIncrement {
    vector: Vector3<f64>,
    coefficients: RotationCoefficients,
    hat: Matrix3<f64>,
    hat_squared: Matrix3<f64>,
}

impl RotationIncrement {
    pub fn new(vector: Vector3<f64>) -> Self {
        let hat = hat(&vector);
        Self {
            vector,
            coefficients: RotationCoefficients::at(vector.norm_squared()),
            hat,
            hat_squared: hat * hat,
        }
    }

    /// `exp(hat w)`.
    pub fn exponential(&self) -> Matrix3<f64> {
        Matrix3::identity() + self.hat * self.coefficients.a + self.hat_squared * self.coefficients.b
    }

    /// `Jl(w)`: turns a change of the vector into a spin.
    pub fn left_differential(&self) -> Matrix3<f64> {
        Matrix3::identity() + self.hat * self.coefficients.b + self.hat_squared * self.coefficients.c
    }

    /// `(d Jl(w)/d w_m) X` for the three components of `w`, at a fixed matrix `X`.
    pub fn left_differential_rates(&self, x: &Matrix3<f64>) -> [Matrix3<f64>; 3] {
        let RotationCoefficients {
            b, c, b_rate, c_rate, ..
        } = self.coefficients;
        let hat_x = self.hat * x;
        let radial = hat_x * b_rate + self.hat_squared * x * c_rate;
        std::array::from_fn(|m| {
            let unit = hat(&Vector3::ith(m, 1.0));
            let unit_x = unit * x;
            radial * self.vector[m] + unit_x * b + (unit * hat_x + self.hat * unit_x) * c
        })
    }
}

const B_SERIES: [f64; TERMS] = value_series(2);
const C_SERIES: [f64; TERMS] = value_series(3);
const B_RATE_SERIES: [f64; TERMS] = rate_series(2);
const C_RATE_SERIES: [f64; TERMS] = rate_series(3);

/// `(-1)^n / (2 n + first)!`, the coefficients of `x^n`.
const fn value_series(first: usize) -> [f64; TERMS] {
    let mut series = [0.0; TERMS];
    let mut n = 0;
    while n < TERMS {
        series[n] = alternating(n) / factorial(2 * n + first);
        n += 1;
    }
    series
}

/// Twice the derivative by `x` of [`value_series`]: `(d/dtheta)/theta` of the sum.
const fn rate_series(first: usize) -> [f64; TERMS] {
    let mut series = [0.0; TERMS];
    let mut n = 0;
    while n < TERMS {
        series[n] = 2.0 * (n as f64 + 1.0) * alternating(n + 1) / factorial(2 * n + 2 + first);
        n += 1;
    }
    series
}

const fn alternating(n: usize) -> f64 {
    1.0 - 2.0 * (n % 2) as f64
}

const fn factorial(n: usize) -> f64 {
    let mut product = 1.0;
    let mut k = 2;
    while k <= n {
        product *= k as f64;
        k += 1;
    }
    product
}

fn horner(series: &[f64; TERMS], x: f64) -> f64 {
    series.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random_vector(length: f64) -> Vector3<f64> {
        Vector3::new(0.3, -0.8, 0.52).normalize() * length
    }

    #[test]
    fn series_and_closed_form_agree_at_the_switch() {
        let series = RotationCoefficients::by_series(SERIES_LIMIT);
        let closed = RotationCoefficients::in_closed_form(SERIES_LIMIT);
        for (left, right) in [
            (series.a, closed.a),
            (series.b, closed.b),
            (series.c, closed.c),
            (series.b_rate, closed.b_rate),
            (series.c_rate, closed.c_rate),
        ] {
            assert!(
                (left - right).abs() < 1e-14 * right.abs().max(0.01),
                "{left} and {right}"
            );
        }
    }

    #[test]
    fn coefficients_at_zero_are_the_limits() {
        let limit = RotationCoefficients::at(0.0);
        assert_eq!((limit.a, limit.b, limit.c), (1.0, 0.5, 1.0 / 6.0));
        assert_eq!((limit.b_rate, limit.c_rate), (-1.0 / 12.0, -1.0 / 60.0));
    }

    #[test]
    fn exponential_is_a_rotation_and_transports_the_differentials() {
        for length in [0.0, 1e-9, 1e-3, 0.7, 0.999, 1.001, 2.0, 3.1] {
            let increment = RotationIncrement::new(random_vector(length));
            let rotation = increment.exponential();
            let right = RotationIncrement::new(-random_vector(length)).left_differential();
            assert!((rotation.transpose() * rotation - Matrix3::identity()).norm() < 1e-14);
            assert!((rotation * right - increment.left_differential()).norm() < 1e-14);
        }
    }

    /// Central differences of step `h` have errors of `h^2`, here below 1e-9.
    #[test]
    fn derivatives_match_central_differences() {
        let h = 1e-5;
        let x = Matrix3::new(0.4, -0.3, 0.9, 0.1, 0.8, -0.2, -0.7, 0.5, 0.6);
        for length in [0.0, 1e-4, 0.5, 0.9999, 1.0001, 3.0] {
            let w = random_vector(length);
            let increment = RotationIncrement::new(w);
            let rates = increment.left_differential_rates(&x);
            for (m, rate) in rates.iter().enumerate() {
                let step = Vector3::ith(m, h);
                let (ahead, behind) = (RotationIncrement::new(w + step), RotationIncrement::new(w - step));
                let jl = (ahead.left_differential() - behind.left_differential()) * x / (2.0 * h);
                assert!(
                    (rate - jl).norm() < 1e-9,
                    "rate of Jl, {length}: {}",
                    (rate - jl).norm()
                );

                let spin = hat(&(increment.left_differential() * Vector3::ith(m, 1.0)));
                let exact = spin * increment.exponential();
                let numerical = (ahead.exponential() - behind.exponential()) / (2.0 * h);
                assert!((exact - numerical).norm() < 1e-9, "spin, {length}");
            }
        }
    }
}
