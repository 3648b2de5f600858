//! Ghost penalty: stiffness against kinks over faces near the edge of the body (T 2.3.4).
//!
//! A cell that is barely touched gives its nodes hardly any stiffness; the penalty ties them to their neighbours. It
//! acts on faces between two active cells of which one borders an inactive cell; the edge of the grid is not an empty
//! neighbour. Functions of order `p` have `p - 1` continuous derivatives, so what may jump over a face normal to axis
//! `k` is the derivative of order `p` along it, in cells: for hat functions `(1, -2, 1)` on the three nodes across the
//! face, times the hats along it.
//!
//! $$ K_{IJ} = \frac{\gamma h^s}{3 h_k^2} \int_{face} [\partial^p_\xi S_I]\,[\partial^p_\xi S_J]\,dA, \quad
//!    \xi = x_k / h_k, \quad s = 3 \text{ or } 1 $$
//!
//! with `h` the longest edge of the face.

use super::basis::BSpline;
use super::{Grid, Support};
use crate::parallel::{Directory, World};
use std::collections::BTreeMap;

/// Ghost penalty on faces of cells at the edge of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GhostSettings {
    /// gamma_g1 [Pa].
    pub translation: f64,
    /// gamma_g2 [N]; no part where there are no rotations.
    pub rotation: f64,
    pub scaling: GhostScaling,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GhostScaling {
    /// h^3 / 3, as printed.
    Paper,
    /// h / 3, a stiffness.
    Stiffness,
}

/// The faces that this rank penalises, as boxes of nodes: `p + 2` across the face, `p + 1` along each other axis.
pub struct GhostFaces<const D: usize> {
    pub faces: Vec<GhostFace<D>>,
    /// Matrices of the faces for one unknown and `gamma = 1`, row-major over the nodes of the box.
    pub matrices: Vec<Vec<f64>>,
}

/// One penalised face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostFace<const D: usize> {
    pub support: Support<D>,
    /// Index of its matrix.
    pub matrix: usize,
}

/// What the matrix of a face depends on: its normal, and along each axis how many cells away the ends of the grid are,
/// up to where the functions no longer see them.
type Kind<const D: usize> = (usize, [(usize, usize); D]);

impl<const D: usize> GhostFaces<D> {
    /// No faces.
    pub fn none() -> Self {
        Self {
            faces: Vec::new(),
            matrices: Vec::new(),
        }
    }

    /// Collective. Finds the faces of active cells, given the cells that this rank's points touch (sorted, distinct).
    /// A face belongs to the rank that owns its lower cell.
    pub fn find(world: &World, grid: &Grid<D>, touched: &[u64], scaling: GhostScaling) -> Self {
        let directory = Directory::build(world, touched.iter().map(|&cell| (cell, 0)));
        let asked = with_neighbours(grid, &with_neighbours(grid, touched));
        let owners = directory.owners(world, &asked);
        let owner = |cell: &[usize; D]| {
            let position = asked
                .binary_search(&grid.cell_key(cell))
                .expect("neighbours were asked for");
            owners[position]
        };
        let borders_inactive = |cell: &[usize; D]| grid.neighbours(cell).any(|other| owner(&other).is_none());
        let mut found = Self::none();
        let mut kinds = BTreeMap::new();
        for &cell_key in touched {
            let cell = grid.cell(cell_key);
            if owner(&cell) != Some(world.rank()) {
                continue;
            }
            for normal in 0..D {
                let mut above = cell;
                above[normal] += 1;
                if above[normal] == grid.cells[normal] || owner(&above).is_none() {
                    continue;
                }
                if borders_inactive(&cell) || borders_inactive(&above) {
                    let matrix = *kinds.entry(kind(grid, &cell, normal)).or_insert_with(|| {
                        found.matrices.push(penalty(grid, &cell, normal, scaling));
                        found.matrices.len() - 1
                    });
                    let support = support(grid, &cell, normal);
                    found.faces.push(GhostFace { support, matrix });
                }
            }
        }
        found
    }
}

/// Nodes that see the upper face of a cell along an axis, or the cells on its sides.
fn support<const D: usize>(grid: &Grid<D>, cell: &[usize; D], normal: usize) -> Support<D> {
    let mut count = [grid.order as u32 + 1; D];
    count[normal] += 1;
    Support {
        lowest: cell.map(|index| index as u32),
        count,
    }
}

fn kind<const D: usize>(grid: &Grid<D>, cell: &[usize; D], normal: usize) -> Kind<D> {
    let ends = std::array::from_fn(|axis| {
        let last = cell[axis] + usize::from(axis == normal);
        let seen = grid.order - 1;
        (cell[axis].min(seen), (grid.cells[axis] - 1 - last).min(seen))
    });
    (normal, ends)
}

fn with_neighbours<const D: usize>(grid: &Grid<D>, cells: &[u64]) -> Vec<u64> {
    let mut result = cells.to_vec();
    for &cell in cells {
        result.extend(grid.neighbours(&grid.cell(cell)).map(|other| grid.cell_key(&other)));
    }
    result.sort_unstable();
    result.dedup();
    result
}

/// Penalty matrix of the upper face of a cell along an axis.
fn penalty<const D: usize>(grid: &Grid<D>, cell: &[usize; D], normal: usize, scaling: GhostScaling) -> Vec<f64> {
    let functions = BSpline::new(grid.order);
    let tangential = (0..D).filter(|&axis| axis != normal);
    let longest = tangential.map(|axis| grid.cell_size[axis]).fold(0.0, f64::max);
    let power = match scaling {
        GhostScaling::Paper => 3,
        GhostScaling::Stiffness => 1,
    };
    // The matrix is a product of matrices of the axes.
    let factors: [Vec<f64>; D] = std::array::from_fn(|axis| {
        let (cell, cells, h) = (cell[axis], grid.cells[axis], grid.cell_size[axis]);
        if axis == normal {
            let jump = functions.highest_jump(cell, cells);
            jump.iter()
                .flat_map(|one| jump.iter().map(move |other| one * other / (h * h)))
                .collect()
        } else {
            let products = functions.products(cell, cells);
            products.iter().map(|product| h * product).collect()
        }
    });
    let support = support(grid, cell, normal);
    let local = |node: &[usize; D]| -> [usize; D] { std::array::from_fn(|axis| node[axis] - cell[axis]) };
    let mut matrix = Vec::with_capacity(support.size() * support.size());
    support.for_each_node(|row| {
        support.for_each_node(|column| {
            let (i, j) = (local(row), local(column));
            let factor = |axis: usize| factors[axis][i[axis] * support.count[axis] as usize + j[axis]];
            matrix.push(longest.powi(power) / 3.0 * (0..D).map(factor).product::<f64>());
        });
    });
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::basis::evaluate;
    use nalgebra::{DMatrix, DVector, SVector};

    fn grid(order: usize) -> Grid<3> {
        Grid {
            min: [0.0; 3],
            cell_size: [0.5, 2.0, 0.25],
            cells: [6; 3],
            order,
        }
    }

    /// Unknowns of the nodes of a face with which the field is `field` in the two cells, or as near as it can be.
    fn fit(grid: &Grid<3>, cell: &[usize; 3], normal: usize, field: impl Fn(&SVector<f64, 3>) -> f64) -> Vec<f64> {
        let (nodes, functions) = (support(grid, cell, normal), BSpline::new(grid.order));
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for place in 0..2 * 4usize.pow(3) {
            let (side, mut rest) = (place % 2, place / 2);
            let position = SVector::<f64, 3>::from_fn(|axis, _| {
                let share = (0.5 + (rest % 4) as f64) / 4.0;
                rest /= 4;
                let side = if axis == normal { side } else { 0 };
                ((cell[axis] + side) as f64 + share) * grid.cell_size[axis]
            });
            let seen = crate::grid::basis::support(&functions, grid, &position, &SVector::zeros());
            let mut shapes = vec![0.0; seen.size() * 4];
            evaluate(&functions, grid, &seen, &position, &SVector::zeros(), &mut shapes);
            let (mut row, mut values_seen) = (Vec::new(), shapes.chunks_exact(4));
            let mut of_node = std::collections::HashMap::new();
            seen.for_each_node(|node| {
                of_node.insert(*node, values_seen.next().expect("a value")[0]);
            });
            nodes.for_each_node(|node| row.push(of_node.get(node).copied().unwrap_or(0.0)));
            rows.extend(row);
            values.push(field(&position));
        }
        let matrix = DMatrix::from_row_slice(values.len(), nodes.size(), &rows);
        let solved = matrix.svd(true, true).solve(&DVector::from_vec(values), 1e-12);
        solved.expect("a fit").as_slice().to_vec()
    }

    /// The matrix is symmetric. A polynomial of the order of the functions has no jump, anywhere in the grid; a derivative of the highest order
    /// that jumps by one per power of a cell costs `gamma h^s / (3 h_k^2)` times the face's area.
    #[test]
    fn penalty_sees_jumps_of_the_highest_derivative_only() {
        for (order, cell) in [
            (1, [2, 2, 2]),
            (2, [0, 4, 1]),
            (2, [3, 0, 4]),
            (3, [2, 0, 4]),
            (3, [1, 4, 0]),
        ] {
            let grid = grid(order);
            let degree = order as i32;
            let factorial: f64 = (1..=order).map(|k| k as f64).product();
            for normal in 0..3 {
                let matrix = penalty(&grid, &cell, normal, GhostScaling::Paper);
                let at = |x: &SVector<f64, 3>, axis: usize| grid.cell_coordinate(axis, x[axis]) - cell[axis] as f64;
                let smooth = fit(&grid, &cell, normal, |x| {
                    1.0 + at(x, 0).powi(degree) - 2.0 * at(x, 1).powi(degree) * at(x, 2) + at(x, normal).powi(degree)
                });
                let kink = fit(&grid, &cell, normal, |x| {
                    (at(x, normal) - 1.0).max(0.0).powi(degree) / factorial
                });
                let energy = |field: &[f64]| -> f64 {
                    let n = field.len();
                    (0..n * n).map(|k| field[k / n] * matrix[k] * field[k % n]).sum()
                };
                let tangential: Vec<f64> = (0..3).filter(|&k| k != normal).map(|k| grid.cell_size[k]).collect();
                let longest = tangential.iter().copied().fold(0.0, f64::max);
                let scale = longest.powi(3) / 3.0 * tangential.iter().product::<f64>() / grid.cell_size[normal].powi(2);
                let n = smooth.len();
                let skew = |k: usize| (matrix[k] - matrix[k % n * n + k / n]).abs();
                assert!((0..n * n).all(|k| skew(k) < 1e-13 * scale), "not symmetric");
                assert!(
                    energy(&smooth).abs() < 1e-11 * scale,
                    "order {order}, normal {normal}: {}",
                    energy(&smooth) / scale
                );
                assert!(
                    (energy(&kink) - scale).abs() < 1e-10 * scale,
                    "order {order}, normal {normal}: {} instead of {scale}",
                    energy(&kink)
                );
            }
        }
    }

    /// Faces of one kind have one matrix, and others have another.
    #[test]
    fn kinds_tell_matrices_apart() {
        for order in 1..=3 {
            let grid = grid(order);
            let mut known: BTreeMap<Kind<3>, Vec<f64>> = BTreeMap::new();
            for place in 0..5usize.pow(3) {
                let cell = [place % 5, place / 5 % 5, place / 25];
                let matrix = penalty(&grid, &cell, 1, GhostScaling::Stiffness);
                let first = known.entry(kind(&grid, &cell, 1)).or_insert_with(|| matrix.clone());
                let difference = first
                    .iter()
                    .zip(&matrix)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(difference < 1e-13, "order {order}, cell {cell:?}: {difference}");
            }
            assert!(order == 1 || known.len() > 1);
        }
    }
}
