//! Small dense linear systems on the stack: the local problems of the laws.

/// A system of `N` equations.
#[derive(Clone, Copy, Debug)]
pub struct System<const N: usize> {
    pub rows: [[f64; N]; N],
}

/// Triangular factors of a [`System`] with the order of its rows.
#[derive(Clone, Copy, Debug)]
pub struct Factors<const N: usize> {
    rows: [[f64; N]; N],
    order: [usize; N],
}

impl<const N: usize> System<N> {
    pub fn zero() -> Self {
        Self { rows: [[0.0; N]; N] }
    }

    /// Gaussian elimination with partial pivoting; `None` for a system that is singular or not finite.
    pub fn factorise(&self) -> Option<Factors<N>> {
        let mut rows = self.rows;
        let mut order: [usize; N] = std::array::from_fn(|row| row);
        for k in 0..N {
            let larger = |best: usize, row: usize| {
                if rows[row][k].abs() > rows[best][k].abs() {
                    row
                } else {
                    best
                }
            };
            let pivot_row = (k + 1..N).fold(k, larger);
            let pivot = rows[pivot_row][k];
            if pivot == 0.0 || !pivot.is_finite() {
                return None;
            }
            rows.swap(k, pivot_row);
            order.swap(k, pivot_row);
            let source = rows[k];
            let inverse = 1.0 / pivot;
            for row in &mut rows[k + 1..] {
                let factor = row[k] * inverse;
                row[k] = factor;
                for j in k + 1..N {
                    row[j] -= factor * source[j];
                }
            }
        }
        Some(Factors { rows, order })
    }
}

impl<const N: usize> Factors<N> {
    /// Solves for one right-hand side per column of `right`.
    pub fn solve<const COLUMNS: usize>(&self, right: &[[f64; COLUMNS]; N]) -> [[f64; COLUMNS]; N] {
        let mut x = self.order.map(|row| right[row]);
        for i in 0..N {
            let mut value = x[i];
            for (factor, row) in self.rows[i][..i].iter().zip(&x) {
                subtract(&mut value, *factor, row);
            }
            x[i] = value;
        }
        for i in (0..N).rev() {
            let mut value = x[i];
            for (factor, row) in self.rows[i][i + 1..].iter().zip(&x[i + 1..]) {
                subtract(&mut value, *factor, row);
            }
            let inverse = 1.0 / self.rows[i][i];
            x[i] = value.map(|v| v * inverse);
        }
        x
    }

    /// Solves for one right-hand side.
    pub fn solve_one(&self, right: &[f64; N]) -> [f64; N] {
        self.solve(&right.map(|value| [value])).map(|[value]| value)
    }
}

fn subtract<const COLUMNS: usize>(value: &mut [f64; COLUMNS], factor: f64, row: &[f64; COLUMNS]) {
    for (v, r) in value.iter_mut().zip(row) {
        *v -= factor * r;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regular, with a zero on the diagonal that asks for pivoting.
    fn sample<const N: usize>() -> System<N> {
        let mut system = System::zero();
        for i in 0..N {
            for j in 0..N {
                system.rows[i][j] = ((3 + 7 * i + 11 * j * j + i * j) % 17) as f64 - 8.0;
            }
            system.rows[i][(i + 1) % N] += 30.0;
        }
        system.rows[0][0] = 0.0;
        system
    }

    fn solves_its_own_product<const N: usize>() {
        let system = sample::<N>();
        let exact: [[f64; 2]; N] = std::array::from_fn(|i| [i as f64 + 1.0, 2.0 - i as f64]);
        let right = system.rows.map(|row| {
            let product = |column: usize| row.iter().zip(&exact).map(|(a, x)| a * x[column]).sum();
            [product(0), product(1)]
        });
        let factors = system.factorise().expect("regular");
        let solution = factors.solve(&right);
        let first = factors.solve_one(&right.map(|row| row[0]));
        for i in 0..N {
            assert_eq!(solution[i][0], first[i]);
            for column in 0..2 {
                assert!((solution[i][column] - exact[i][column]).abs() < 1e-11, "{N}, {i}");
            }
        }
    }

    #[test]
    fn solves_several_right_hand_sides() {
        solves_its_own_product::<4>();
        solves_its_own_product::<10>();
        solves_its_own_product::<19>();
    }

    #[test]
    fn refuses_singular_and_not_finite_systems() {
        let mut singular = sample::<5>();
        singular.rows[3] = [0.0; 5];
        assert!(singular.factorise().is_none());
        let mut broken = sample::<5>();
        for row in &mut broken.rows {
            row[2] = f64::NAN;
        }
        assert!(broken.factorise().is_none());
    }
}
