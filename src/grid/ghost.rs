//! Ghost penalty: stiffness against jumps of the normal derivative over faces near the edge of the body (T 2.3.4).
//!
//! A cell that is barely touched gives its nodes hardly any stiffness; the penalty ties them to their neighbours. It
//! acts on faces between two active cells of which one borders an inactive cell; the edge of the grid is not an empty
//! neighbour. For hat functions the jump over a face normal to axis `k` is `(1, -2, 1) / h_k` on the three nodes across
//! it, times the hats along the face:
//!
//! $$ K_{IJ} = \frac{\gamma h^s}{3} \int_{face} [\partial_n S_I]\,[\partial_n S_J]\,dA, \quad s = 3 \text{ or } 1 $$

use super::{Grid, Support};
use crate::parallel::{Directory, World};

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

/// The faces that this rank penalises, as boxes of nodes: three across the face, two along each other axis.
pub struct GhostFaces<const D: usize> {
    pub faces: Vec<GhostFace<D>>,
}

/// One penalised face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostFace<const D: usize> {
    pub normal: usize,
    pub support: Support<D>,
}

impl<const D: usize> GhostFaces<D> {
    /// Collective. Finds the faces of active cells, given the cells that this rank's points touch (sorted, distinct).
    /// A face belongs to the rank that owns its lower cell.
    pub fn find(world: &World, grid: &Grid<D>, touched: &[u64]) -> Self {
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
        let mut faces = Vec::new();
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
                    let mut count = [2; D];
                    count[normal] = 3;
                    faces.push(GhostFace {
                        normal,
                        support: Support {
                            lowest: cell.map(|index| index as u32),
                            count,
                        },
                    });
                }
            }
        }
        Self { faces }
    }
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

/// Penalty matrix of a face normal to an axis for one unknown and `gamma = 1`, row-major over the nodes of its box.
/// `power` is the exponent of the face's longest edge: 3 as printed, 1 for a stiffness.
pub fn penalty<const D: usize>(grid: &Grid<D>, normal: usize, power: i32) -> Vec<f64> {
    let tangential = (0..D).filter(|&axis| axis != normal);
    let longest = tangential.map(|axis| grid.cell_size[axis]).fold(0.0, f64::max);
    let mut count = [2; D];
    count[normal] = 3;
    let size: usize = count.iter().product();
    let split = |mut flat: usize| {
        count.map(|count| {
            let index = flat % count;
            flat /= count;
            index
        })
    };
    const JUMP: [f64; 3] = [1.0, -2.0, 1.0];
    let mut matrix = vec![0.0; size * size];
    for row in 0..size {
        for column in 0..size {
            let (i, j) = (split(row), split(column));
            matrix[row * size + column] = longest.powi(power) / 3.0
                * (0..D)
                    .map(|axis| {
                        let h = grid.cell_size[axis];
                        if axis == normal {
                            JUMP[i[axis]] * JUMP[j[axis]] / (h * h)
                        } else if i[axis] == j[axis] {
                            h / 3.0
                        } else {
                            h / 6.0
                        }
                    })
                    .product::<f64>();
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear field has no jump; a kink of slope one costs `gamma h^s / 3` times the face's area.
    #[test]
    fn penalty_sees_kinks_only() {
        let grid = Grid {
            min: [0.0; 3],
            cell_size: [0.5, 2.0, 0.25],
            cells: [4; 3],
        };
        for normal in 0..3 {
            let matrix = penalty(&grid, normal, 3);
            let mut count = [2u32; 3];
            count[normal] = 3;
            let support = Support { lowest: [0; 3], count };
            let (mut linear, mut kink) = (Vec::new(), Vec::new());
            support.for_each_node(|node| {
                let x = grid.node_position(node);
                linear.push(1.0 + x[0] - 2.0 * x[1] + 3.0 * x[2]);
                kink.push((x[normal] - grid.cell_size[normal]).max(0.0));
            });
            let energy = |field: &[f64]| -> f64 {
                let n = field.len();
                (0..n * n).map(|k| field[k / n] * matrix[k] * field[k % n]).sum()
            };
            let area: f64 = (0..3).filter(|&k| k != normal).map(|k| grid.cell_size[k]).product();
            let longest = (0..3)
                .filter(|&k| k != normal)
                .map(|k| grid.cell_size[k])
                .fold(0.0, f64::max);
            assert!(energy(&linear).abs() < 1e-12);
            assert!((energy(&kink) - longest.powi(3) / 3.0 * area).abs() < 1e-12);
        }
    }
}
