//! Basis functions: tensor products of one-dimensional ones, in units of cells.
//!
//! A basis describes one axis: which nodes see a domain, with what value and derivative. The tensor product and the
//! grid's lengths are added here, once for all of them.

mod bspline;
mod gimp;
mod linear;

pub use bspline::BSpline;
pub use gimp::Gimp;
pub use linear::Linear;

use super::{Grid, Support};
use nalgebra::SVector;

/// Largest number of nodes along an axis that see one domain.
pub const MAX_NODES_PER_AXIS: usize = 4;

/// How far a domain may reach over a cell's edge without touching the next cell, and a position over the grid's
/// face without leaving it, in cells: round-off must not create supports.
pub const SNAP: f64 = 1.0e-9;

/// The nodes along an axis that see a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    pub lowest: u32,
    pub count: u32,
}

/// Value and derivative of one node's function at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shape1 {
    pub value: f64,
    /// Per cell.
    pub derivative: f64,
}

/// One axis of a basis. Coordinates are in cells from the lower face of a grid of `cells` cells.
pub trait Basis: Send + Sync {
    /// Order of the functions as polynomials on a cell: there are `cells + order` of them along an axis ([`Grid::order`]).
    fn order(&self) -> usize;
    /// Nodes that see the domain of half-length `half` around `x`.
    fn span(&self, x: f64, half: f64, cells: usize) -> Span;
    /// Values and derivatives at the nodes of the span, lowest first.
    fn evaluate(&self, span: Span, x: f64, half: f64, cells: usize, out: &mut [Shape1]);
    /// Whether points carry a domain that deforms with them.
    fn has_domains(&self) -> bool;
    /// The same functions at a place without extent; the place lies within what the nodes of the span cover.
    fn evaluate_at_point(&self, span: Span, x: f64, cells: usize, out: &mut [Shape1]) {
        self.evaluate(span, x, 0.0, cells, out);
    }
}

/// Box of nodes that see a point's domain.
pub fn support<const D: usize>(
    basis: &dyn Basis,
    grid: &Grid<D>,
    position: &SVector<f64, D>,
    half_lengths: &SVector<f64, D>,
) -> Support<D> {
    let mut support = Support {
        lowest: [0; D],
        count: [0; D],
    };
    for axis in 0..D {
        let x = grid.cell_coordinate(axis, position[axis]);
        let span = basis.span(x, half_lengths[axis] / grid.cell_size[axis], grid.cells[axis]);
        support.lowest[axis] = span.lowest;
        support.count[axis] = span.count;
    }
    support
}

/// Values and gradients [1/m] at the nodes of a support, first axis fastest: for each node the value and then the
/// `D` components of the gradient. `out` has `support.size() * (1 + D)` entries.
pub fn evaluate<const D: usize>(
    basis: &dyn Basis,
    grid: &Grid<D>,
    support: &Support<D>,
    position: &SVector<f64, D>,
    half_lengths: &SVector<f64, D>,
    out: &mut [f64],
) {
    let along = |axis: usize, span: Span, out: &mut [Shape1]| {
        let x = grid.cell_coordinate(axis, position[axis]);
        let half = half_lengths[axis] / grid.cell_size[axis];
        basis.evaluate(span, x, half, grid.cells[axis], out);
    };
    multiply(grid, support, along, out);
}

/// As [`evaluate`], of the functions themselves at a place that the nodes of the support cover: no average over a domain.
pub fn evaluate_at_point<const D: usize>(
    basis: &dyn Basis,
    grid: &Grid<D>,
    support: &Support<D>,
    place: &SVector<f64, D>,
    out: &mut [f64],
) {
    let along = |axis: usize, span: Span, out: &mut [Shape1]| {
        let x = grid.cell_coordinate(axis, place[axis]);
        basis.evaluate_at_point(span, x, grid.cells[axis], out);
    };
    multiply(grid, support, along, out);
}

/// Tensor product of the functions along each axis, which `along` writes for a span of an axis.
fn multiply<const D: usize>(
    grid: &Grid<D>,
    support: &Support<D>,
    along: impl Fn(usize, Span, &mut [Shape1]),
    out: &mut [f64],
) {
    let mut factors = [[Shape1::default(); MAX_NODES_PER_AXIS]; D];
    for (axis, factors) in factors.iter_mut().enumerate() {
        let span = Span {
            lowest: support.lowest[axis],
            count: support.count[axis],
        };
        along(axis, span, &mut factors[..span.count as usize]);
    }
    for (flat, shape) in out.chunks_exact_mut(1 + D).enumerate() {
        let mut rest = flat;
        let mut node = [Shape1::default(); D];
        for axis in 0..D {
            node[axis] = factors[axis][rest % support.count[axis] as usize];
            rest /= support.count[axis] as usize;
        }
        shape[0] = node.iter().map(|factor| factor.value).product();
        for k in 0..D {
            shape[1 + k] = (0..D)
                .map(|axis| {
                    if axis == k {
                        node[axis].derivative / grid.cell_size[axis]
                    } else {
                        node[axis].value
                    }
                })
                .product();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic numbers in [0, 1).
    fn sequence() -> impl FnMut() -> f64 {
        let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn shapes<const D: usize>(
        basis: &dyn Basis,
        grid: &Grid<D>,
        x: &SVector<f64, D>,
        half: &SVector<f64, D>,
    ) -> (Support<D>, Vec<f64>) {
        let support = support(basis, grid, x, half);
        let mut out = vec![f64::NAN; support.size() * (1 + D)];
        evaluate(basis, grid, &support, x, half, &mut out);
        (support, out)
    }

    /// Partition of unity, linear completeness with the places of the nodes, and their gradients, for domains of all
    /// sizes, at inner points.
    fn is_complete<const D: usize>(basis: &dyn Basis, grid: &Grid<D>) {
        let mut random = sequence();
        for _ in 0..500 {
            let half = SVector::<f64, D>::from_fn(|k, _| grid.cell_size[k] * (0.01 + 0.9 * random()));
            let x = SVector::<f64, D>::from_fn(|k, _| {
                let length = grid.cells[k] as f64 * grid.cell_size[k];
                grid.min[k] + half[k] + random() * (length - 2.0 * half[k])
            });
            let (support, out) = shapes(basis, grid, &x, &half);
            let mut sums = [0.0; 4];
            let mut moments = SVector::<f64, D>::zeros();
            let mut gradients = nalgebra::SMatrix::<f64, D, D>::zeros();
            let mut flat = 0;
            support.for_each_node(|node| {
                let position = grid.node_position(node);
                let shape = &out[flat * (1 + D)..(flat + 1) * (1 + D)];
                for (sum, value) in sums.iter_mut().zip(shape) {
                    *sum += value;
                }
                for i in 0..D {
                    moments[i] += position[i] * shape[0];
                    for k in 0..D {
                        gradients[(i, k)] += position[i] * shape[1 + k];
                    }
                }
                assert!(shape[0] >= -1e-15, "negative value {}", shape[0]);
                flat += 1;
            });
            assert!((sums[0] - 1.0).abs() < 1e-12, "values sum to {}", sums[0]);
            assert!(
                sums[1..=D].iter().all(|sum| sum.abs() < 1e-9),
                "gradients sum to {sums:?}"
            );
            assert!(
                (moments - x).norm() < 1e-12,
                "a linear field is off by {}",
                (moments - x).norm()
            );
            assert!((gradients - nalgebra::SMatrix::identity()).norm() < 1e-9);
        }
    }

    /// The gradient is the derivative of the value.
    fn gradient_is_derivative<const D: usize>(basis: &dyn Basis, grid: &Grid<D>) {
        let mut random = sequence();
        for _ in 0..200 {
            let half = SVector::<f64, D>::from_fn(|k, _| grid.cell_size[k] * (0.05 + 0.4 * random()));
            let x = SVector::<f64, D>::from_fn(|k, _| grid.min[k] + grid.cell_size[k] * (1.0 + random()));
            let (support, out) = shapes(basis, grid, &x, &half);
            for k in 0..D {
                let step = 1e-6 * grid.cell_size[k];
                let value_at = |shift: f64| {
                    let mut moved = x;
                    moved[k] += shift;
                    let mut values = vec![0.0; out.len()];
                    evaluate(basis, grid, &support, &moved, &half, &mut values);
                    (values, super::support(basis, grid, &moved, &half) == support)
                };
                let ((above, same_above), (below, same_below)) = (value_at(step), value_at(-step));
                if !(same_above && same_below) {
                    continue;
                }
                for node in 0..support.size() {
                    let difference = (above[node * (1 + D)] - below[node * (1 + D)]) / (2.0 * step);
                    let gradient = out[node * (1 + D) + 1 + k];
                    assert!(
                        (difference - gradient).abs() * grid.cell_size[k] < 1e-6,
                        "{difference} against {gradient}"
                    );
                }
            }
        }
    }

    #[test]
    fn bases_are_complete_and_differentiable() {
        let plane = Grid {
            min: [-1.0, 2.0],
            cell_size: [0.3, 0.2],
            cells: [4, 5],
            order: 1,
        };
        let space = Grid {
            min: [0.0, 1.0, -3.0],
            cell_size: [0.3, 0.2, 1.0],
            cells: [4, 3, 5],
            order: 1,
        };
        let splines = [1, 2, 3].map(BSpline::new);
        let splines = splines.iter().map(|spline| spline as &dyn Basis);
        for basis in [&Linear as &dyn Basis, &Gimp].into_iter().chain(splines) {
            let plane = Grid {
                order: basis.order(),
                ..plane.clone()
            };
            let space = Grid {
                order: basis.order(),
                ..space.clone()
            };
            is_complete(basis, &plane);
            is_complete(basis, &space);
            gradient_is_derivative(basis, &plane);
            gradient_is_derivative(basis, &space);
        }
    }
}
