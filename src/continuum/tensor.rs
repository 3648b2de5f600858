//! Small tensor algebra: the order of components, the permutation symbol, the exponential of a symmetric tensor.

use nalgebra::{Matrix3, Vector3};

/// Place of tensor component `ij` (from 0) wherever a tensor is a row of nine numbers.
pub const fn component(i: usize, j: usize) -> usize {
    3 * i + j
}

/// Writes a tensor to the first nine of `out`, component `ij` at `3 i + j`.
pub fn pack_tensor(tensor: &Matrix3<f64>, out: &mut [f64]) {
    for i in 0..3 {
        for j in 0..3 {
            out[component(i, j)] = tensor[(i, j)];
        }
    }
}

/// Reads what [`pack_tensor`] wrote.
pub fn unpack_tensor(values: &[f64]) -> Matrix3<f64> {
    Matrix3::from_row_slice(&values[..9])
}

/// Components of a symmetric tensor wherever it is a row of six numbers.
pub const SYMMETRIC_PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Place of component `ij` among [`SYMMETRIC_PAIRS`].
pub const fn symmetric_component(i: usize, j: usize) -> usize {
    const PLACES: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];
    PLACES[i][j]
}

/// Writes a symmetric tensor to the first six of `out`.
pub fn pack_symmetric(tensor: &Matrix3<f64>, out: &mut [f64]) {
    for (value, pair) in out.iter_mut().zip(SYMMETRIC_PAIRS) {
        *value = tensor[pair];
    }
}

/// Reads what [`pack_symmetric`] wrote.
pub fn unpack_symmetric(values: &[f64]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| values[symmetric_component(i, j)])
}

/// `c_i = eps_ijk T_jk`: minus twice the axial vector of the skew part.
pub fn permutation_product(tensor: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(
        tensor[(1, 2)] - tensor[(2, 1)],
        tensor[(2, 0)] - tensor[(0, 2)],
        tensor[(0, 1)] - tensor[(1, 0)],
    )
}

/// Symmetric part.
pub fn symmetric(tensor: &Matrix3<f64>) -> Matrix3<f64> {
    (tensor + tensor.transpose()) * 0.5
}

/// `exp(A)` of a symmetric tensor with what its derivative needs.
///
/// With `A = V diag(a) V^T`: `d exp(A) = V (Phi o (V^T dA V)) V^T`, where `Phi_ab` is the divided difference
/// `(e^a - e^b)/(a - b) = sqrt(e^a e^b) sinh(x)/x` with `x = (a - b)/2`: accurate for equal eigenvalues, close ones
/// and distinct ones alike.
#[derive(Clone, Copy, Debug)]
pub struct SymmetricExponential {
    /// `exp(A)`.
    pub value: Matrix3<f64>,
    directions: Matrix3<f64>,
    divided_differences: Matrix3<f64>,
}

impl SymmetricExponential {
    /// Exponential of `tensor`, of which the upper triangle is read. Not finite where `tensor` is not.
    pub fn new(tensor: &Matrix3<f64>) -> Self {
        let (eigenvalues, directions) = symmetric_eigen(tensor);
        let exponentials = eigenvalues.map(f64::exp);
        let roots = eigenvalues.map(|a| (0.5 * a).exp());
        let mut divided_differences = Matrix3::zeros();
        for a in 0..3 {
            divided_differences[(a, a)] = exponentials[a];
            for b in 0..a {
                let ratio = roots[a] * roots[b] * sinh_ratio(0.5 * (eigenvalues[a] - eigenvalues[b]));
                divided_differences[(a, b)] = ratio;
                divided_differences[(b, a)] = ratio;
            }
        }
        let scaled = Matrix3::from_fn(|i, a| directions[(i, a)] * exponentials[a]);
        Self {
            value: scaled * directions.transpose(),
            directions,
            divided_differences,
        }
    }

    /// `X -> V^T X`: the right factor of [`Self::derivative_times`], which many derivatives share.
    pub fn principal_factor(&self, x: &Matrix3<f64>) -> Matrix3<f64> {
        self.directions.tr_mul(x)
    }

    /// `(d exp(A)/dA_kl) X` for `k = l`, or for `A_kl = A_lk` together; `factor = principal_factor(X)`.
    pub fn derivative_times(&self, (k, l): (usize, usize), factor: &Matrix3<f64>) -> Matrix3<f64> {
        let v = &self.directions;
        let mut middle = Matrix3::zeros();
        for a in 0..3 {
            for b in 0..3 {
                let direction = if k == l {
                    v[(k, a)] * v[(k, b)]
                } else {
                    v[(k, a)] * v[(l, b)] + v[(l, a)] * v[(k, b)]
                };
                middle[(a, b)] = direction * self.divided_differences[(a, b)];
            }
        }
        v * (middle * factor)
    }
}

/// `sinh(x)/x`.
fn sinh_ratio(x: f64) -> f64 {
    if x.abs() > 0.5 {
        return x.sinh() / x;
    }
    let y = x * x;
    // 1/(2n+1)! from the last term to the first; the next one is below 1e-16.
    const SERIES: [f64; 6] = [
        1.0 / 6_227_020_800.0,
        1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        1.0 / 5_040.0,
        1.0 / 120.0,
        1.0 / 6.0,
    ];
    SERIES.iter().fold(0.0, |sum, coefficient| sum * y + coefficient) * y + 1.0
}

/// Eigenvalues and eigenvectors (columns) of a symmetric tensor by cyclic Jacobi rotations, of which one is enough
/// for a tensor of plane strain. Reads the upper triangle.
pub fn symmetric_eigen(tensor: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    /// Quadratic convergence needs five or six sweeps; the bound only ends the loop for tensors that are not finite.
    const SWEEPS: usize = 20;
    let mut a = *tensor;
    let mut v = Matrix3::identity();
    for _ in 0..SWEEPS {
        let off = a[(0, 1)].abs() + a[(0, 2)].abs() + a[(1, 2)].abs();
        if off == 0.0 {
            break;
        }
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            jacobi_rotation(&mut a, &mut v, p, q, r);
        }
    }
    (Vector3::new(a[(0, 0)], a[(1, 1)], a[(2, 2)]), v)
}

/// Turns the directions `p < q` so that `a_pq` vanishes; `r` is the third direction.
fn jacobi_rotation(a: &mut Matrix3<f64>, v: &mut Matrix3<f64>, p: usize, q: usize, r: usize) {
    let off = a[(p, q)];
    if off == 0.0 {
        return;
    }
    let difference = a[(q, q)] - a[(p, p)];
    // Rounds to nothing against the diagonal: dropping it changes no digit.
    if off.abs() < 0.25 * f64::EPSILON * a[(p, p)].abs().min(a[(q, q)].abs()) {
        a[(p, q)] = 0.0;
        return;
    }
    let cotangent = difference / (2.0 * off);
    let t = cotangent.signum() / (cotangent.abs() + (cotangent * cotangent + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    a[(p, p)] -= t * off;
    a[(q, q)] += t * off;
    a[(p, q)] = 0.0;
    let (pr, qr) = ((p.min(r), p.max(r)), (q.min(r), q.max(r)));
    let (a_pr, a_qr) = (a[pr], a[qr]);
    a[pr] = c * a_pr - s * a_qr;
    a[qr] = s * a_pr + c * a_qr;
    for i in 0..3 {
        let (v_p, v_q) = (v[(i, p)], v[(i, q)]);
        v[(i, p)] = c * v_p - s * v_q;
        v[(i, q)] = s * v_p + c * v_q;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// General, plane, two equal eigenvalues, two close ones, three equal, large.
    fn samples() -> Vec<Matrix3<f64>> {
        let general = Matrix3::new(0.3, -0.1, 0.2, -0.1, -0.4, 0.05, 0.2, 0.05, 0.1);
        let plane = Matrix3::new(0.3, -0.1, 0.0, -0.1, -0.4, 0.0, 0.0, 0.0, 0.1);
        let (_, v) = symmetric_eigen(&general);
        let spectral =
            |a: f64, b: f64, c: f64| symmetric(&(v * Matrix3::from_diagonal(&Vector3::new(a, b, c)) * v.transpose()));
        vec![
            general,
            plane,
            spectral(0.2, 0.2, -0.1),
            spectral(0.2, 0.2 + 1e-9, -0.1),
            spectral(0.2, 0.2 + 1e-5, -0.1),
            Matrix3::identity() * 0.3,
            Matrix3::zeros(),
            general * 8.0,
            general * 1e-12,
        ]
    }

    #[test]
    fn eigenvectors_are_orthonormal_and_rebuild_the_tensor() {
        for sample in samples() {
            let (values, v) = symmetric_eigen(&sample);
            assert!((v.transpose() * v - Matrix3::identity()).norm() < 1e-14);
            let rebuilt = v * Matrix3::from_diagonal(&values) * v.transpose();
            assert!((rebuilt - sample).norm() <= 4e-15 * sample.norm());
        }
    }

    #[test]
    fn exponential_equals_its_power_series() {
        for sample in samples() {
            let mut term = Matrix3::identity();
            let mut sum = term;
            for n in 1..80 {
                term = term * sample / f64::from(n);
                sum += term;
            }
            let value = SymmetricExponential::new(&sample).value;
            assert!((value - sum).norm() < 1e-13 * sum.norm(), "{}", (value - sum).norm());
        }
    }

    #[test]
    fn derivative_equals_that_of_the_power_series() {
        let x = Matrix3::new(0.4, -0.3, 0.9, 0.1, 0.8, -0.2, -0.7, 0.5, 0.6);
        for sample in samples() {
            let exponential = SymmetricExponential::new(&sample);
            let factor = exponential.principal_factor(&x);
            for (k, l) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)] {
                let mut direction = Matrix3::zeros();
                direction[(k, l)] = 1.0;
                direction[(l, k)] = 1.0;
                // d(A^n/n!) = (dA A^(n-1) + A d(A^(n-1)))/n!
                let (mut power, mut rate, mut sum) = (Matrix3::identity(), Matrix3::zeros(), Matrix3::zeros());
                for n in 1..80 {
                    rate = (direction * power + sample * rate) / f64::from(n);
                    power = sample * power / f64::from(n);
                    sum += rate;
                }
                let exact = sum * x;
                let error = (exponential.derivative_times((k, l), &factor) - exact).norm();
                assert!(error < 2e-13 * exact.norm(), "{error}");
            }
        }
    }

    #[test]
    fn exponential_of_what_is_not_finite_is_not_finite() {
        let sample = Matrix3::from_element(f64::NAN);
        assert!(!SymmetricExponential::new(&sample).value.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn permutation_product_picks_the_skew_part() {
        let tensor = Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0);
        assert_eq!(permutation_product(&tensor), Vector3::new(-2.0, 4.0, -2.0));
        let mut packed = [0.0; 9];
        pack_tensor(&tensor, &mut packed);
        assert_eq!(packed[component(1, 2)], 6.0);
        assert_eq!(unpack_tensor(&packed), tensor);
    }

    #[test]
    fn symmetric_tensors_survive_packing() {
        let tensor = Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0);
        let mut packed = [0.0; 6];
        pack_symmetric(&tensor, &mut packed);
        assert_eq!(packed, [1.0, 4.0, 6.0, 2.0, 3.0, 5.0]);
        assert_eq!(unpack_symmetric(&packed), tensor);
        for (place, (i, j)) in SYMMETRIC_PAIRS.into_iter().enumerate() {
            assert_eq!((symmetric_component(i, j), symmetric_component(j, i)), (place, place));
        }
    }
}
