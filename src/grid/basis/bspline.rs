//! B-splines of order 1, 2 and 3 with open uniform knots, seen by points without extent (N 28-30).
//!
//! The knots are the lines of the grid, the first and the last of them `order + 1` times, so that at a face of the grid
//! all functions but one vanish. On a cell each function is a polynomial; values, derivatives, and what the ghost
//! penalty needs of them follow from its coefficients.

use super::{Basis, MAX_NODES_PER_AXIS, Shape1, Span};

/// Coefficients of powers 0, 1, .. of the coordinate of a cell, from 0 to 1.
type Polynomial = [f64; MAX_NODES_PER_AXIS];

/// Functions of one order; there are `cells + order` of them along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BSpline {
    order: usize,
}

impl BSpline {
    /// Highest order: a point sees [`MAX_NODES_PER_AXIS`] functions along an axis.
    pub const HIGHEST_ORDER: usize = MAX_NODES_PER_AXIS - 1;

    /// # Panics
    /// Where the order is not from 1 to [`BSpline::HIGHEST_ORDER`].
    pub fn new(order: usize) -> Self {
        assert!((1..=Self::HIGHEST_ORDER).contains(&order), "B-splines of order {order}");
        Self { order }
    }

    /// The functions on a cell as polynomials; the first `order + 1` entries, of the functions `cell`, `cell + 1`, ..
    /// By the recursion of Cox and de Boor.
    pub fn on_cell(&self, cell: usize, cells: usize) -> [Polynomial; MAX_NODES_PER_AXIS] {
        // Function i of order k lives between the knots i and i + k + 1; the cell begins at knot `cell + order`.
        let knot = |index: usize| index.saturating_sub(self.order).min(cells) as f64;
        let start = cell as f64;
        let mut functions = [Polynomial::default(); MAX_NODES_PER_AXIS];
        functions[self.order][0] = 1.0;
        for degree in 1..=self.order {
            for local in self.order - degree..=self.order {
                let index = cell + local;
                let mut sum = Polynomial::default();
                // A function of the lower degree that lives on an empty interval is zero, and left out.
                if local > self.order - degree {
                    let length = knot(index + degree) - knot(index);
                    add_product(
                        &mut sum,
                        &functions[local],
                        [(start - knot(index)) / length, 1.0 / length],
                    );
                }
                if local < self.order {
                    let length = knot(index + degree + 1) - knot(index + 1);
                    let line = [(knot(index + degree + 1) - start) / length, -1.0 / length];
                    add_product(&mut sum, &functions[local + 1], line);
                }
                functions[local] = sum;
            }
        }
        functions
    }

    /// Jump of the derivative of the highest order from a cell to the next one, of the `order + 2` functions that the
    /// two cells see; per power `order` of a cell.
    pub fn highest_jump(&self, cell: usize, cells: usize) -> Vec<f64> {
        let factorial: f64 = (1..=self.order).map(|k| k as f64).product();
        let mut jump = vec![0.0; self.order + 2];
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let functions = self.on_cell(cell + side, cells);
            for (entry, function) in jump[side..].iter_mut().zip(&functions[..=self.order]) {
                *entry += sign * factorial * function[self.order];
            }
        }
        jump
    }

    /// Integrals over a cell of the products of its functions, row by row, in units of a cell.
    pub fn products(&self, cell: usize, cells: usize) -> Vec<f64> {
        let functions = self.on_cell(cell, cells);
        let integral = |one: &Polynomial, other: &Polynomial| -> f64 {
            let powers = (0..one.len()).flat_map(|k| (0..other.len()).map(move |l| (k, l)));
            powers.map(|(k, l)| one[k] * other[l] / (k + l + 1) as f64).sum()
        };
        let seen = &functions[..=self.order];
        seen.iter()
            .flat_map(|one| seen.iter().map(move |other| integral(one, other)))
            .collect()
    }
}

/// Adds a polynomial times `line[0] + line[1] x`.
fn add_product(sum: &mut Polynomial, polynomial: &Polynomial, line: [f64; 2]) {
    for (power, coefficient) in polynomial.iter().enumerate() {
        sum[power] += line[0] * coefficient;
        if power + 1 < sum.len() {
            sum[power + 1] += line[1] * coefficient;
        }
    }
}

impl Basis for BSpline {
    fn order(&self) -> usize {
        self.order
    }

    fn span(&self, x: f64, _half: f64, cells: usize) -> Span {
        Span {
            lowest: (x.max(0.0) as u32).min(cells as u32 - 1),
            count: self.order as u32 + 1,
        }
    }

    fn evaluate(&self, span: Span, x: f64, _half: f64, cells: usize, out: &mut [Shape1]) {
        let cell = span.lowest as usize;
        let local = x - cell as f64;
        let functions = self.on_cell(cell, cells);
        for (shape, function) in out.iter_mut().zip(&functions) {
            let horner = |(value, derivative): (f64, f64), coefficient: &f64| {
                (value * local + coefficient, derivative * local + value)
            };
            let (value, derivative) = function.iter().rev().fold((0.0, 0.0), horner);
            *shape = Shape1 { value, derivative };
        }
    }

    fn has_domains(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All functions of an axis and their derivatives at a coordinate.
    fn all(spline: &BSpline, cells: usize, x: f64) -> Vec<Shape1> {
        let span = spline.span(x, 0.0, cells);
        let mut seen = vec![Shape1::default(); span.count as usize];
        spline.evaluate(span, x, 0.0, cells, &mut seen);
        let mut functions = vec![Shape1::default(); cells + spline.order];
        functions[span.lowest as usize..][..seen.len()].copy_from_slice(&seen);
        functions
    }

    /// The recursion with numbers instead of polynomials, from the definition of the functions (N 28, 29).
    fn by_definition(order: usize, degree: usize, index: usize, cells: usize, x: f64) -> f64 {
        let knot = |index: usize| index.saturating_sub(order).min(cells) as f64;
        if degree == 0 {
            return f64::from(u8::from(knot(index) <= x && x < knot(index + 1)));
        }
        let share = |numerator: f64, denominator: f64| {
            if denominator > 0.0 {
                numerator / denominator
            } else {
                0.0
            }
        };
        let lower = |index: usize| by_definition(order, degree - 1, index, cells, x);
        share(x - knot(index), knot(index + degree) - knot(index)) * lower(index)
            + share(knot(index + degree + 1) - x, knot(index + degree + 1) - knot(index + 1)) * lower(index + 1)
    }

    #[test]
    fn functions_are_those_of_the_definition() {
        for (order, cells) in [(1, 3), (2, 1), (2, 2), (2, 6), (3, 1), (3, 2), (3, 3), (3, 7)] {
            let spline = BSpline::new(order);
            for step in 0..40 * cells {
                let x = (step as f64 + 0.3) / 40.0;
                for (index, shape) in all(&spline, cells, x).iter().enumerate() {
                    let expected = by_definition(order, order, index, cells, x);
                    assert!(
                        (shape.value - expected).abs() < 1e-14,
                        "order {order}, {cells} cells, function {index} at {x}: {} instead of {expected}",
                        shape.value
                    );
                }
            }
        }
    }

    /// Open ends: at a face all functions but the first or last vanish.
    #[test]
    fn faces_conform() {
        for order in 1..=3 {
            let spline = BSpline::new(order);
            for cells in [1, 2, 5] {
                for (x, one) in [(0.0, 0), (cells as f64, cells + order - 1)] {
                    for (index, shape) in all(&spline, cells, x).iter().enumerate() {
                        let expected = f64::from(u8::from(index == one));
                        assert!((shape.value - expected).abs() < 1e-14);
                    }
                }
            }
        }
    }

    /// Polynomials up to the order are in the span of the functions: a least-squares fit at many places leaves nothing,
    /// while the next power leaves something.
    #[test]
    fn polynomials_up_to_the_order_are_reproduced() {
        use nalgebra::{DMatrix, DVector};
        for order in 1..=3 {
            let (spline, cells) = (BSpline::new(order), 5);
            let places: Vec<f64> = (0..100).map(|k| cells as f64 * (k as f64 + 0.5) / 100.0).collect();
            let rows: Vec<_> = places.iter().map(|&x| all(&spline, cells, x)).collect();
            let matrix = DMatrix::from_fn(places.len(), cells + order, |row, column| rows[row][column].value);
            for power in 0..=order as i32 + 1 {
                let field = DVector::from_iterator(places.len(), places.iter().map(|x| (x / cells as f64).powi(power)));
                let fit = matrix.clone().svd(true, true).solve(&field, 1e-12).expect("a fit");
                let remainder = (&matrix * &fit - &field).amax();
                assert!(
                    (remainder < 1e-12) == (power <= order as i32),
                    "order {order}, power {power}: {remainder}"
                );
                if power > order as i32 {
                    continue;
                }
                for (place, row) in places.iter().zip(&rows) {
                    let slope: f64 = row.iter().zip(fit.iter()).map(|(shape, c)| shape.derivative * c).sum();
                    let expected = f64::from(power) * (place / cells as f64).powi(power - 1) / cells as f64;
                    assert!((slope - expected).abs() < 1e-11, "{slope} instead of {expected}");
                }
            }
        }
    }

    /// Away from the ends the jump of the highest derivative is a difference of one order more.
    #[test]
    fn highest_derivatives_jump_by_binomials() {
        let expected: [&[f64]; 3] = [&[1.0, -2.0, 1.0], &[-1.0, 3.0, -3.0, 1.0], &[1.0, -4.0, 6.0, -4.0, 1.0]];
        for (order, expected) in (1..).zip(expected) {
            let sign = if order % 2 == 1 { 1.0 } else { -1.0 } * expected[0];
            let jump = BSpline::new(order).highest_jump(4, 10);
            for (jump, expected) in jump.iter().zip(expected) {
                assert!((jump - sign * expected).abs() < 1e-12, "{jump} instead of {expected}");
            }
        }
    }

    /// The integrals of all functions sum to the length of the cell.
    #[test]
    fn products_sum_to_a_cell() {
        for order in 1..=3 {
            for cell in 0..4 {
                let sum: f64 = BSpline::new(order).products(cell, 4).iter().sum();
                assert!((sum - 1.0).abs() < 1e-13);
            }
        }
        let hats = BSpline::new(1).products(0, 1);
        for (product, expected) in hats.iter().zip([1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0]) {
            assert!((product - expected).abs() < 1e-15);
        }
    }
}
