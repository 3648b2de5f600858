//! The background grid: axis-aligned cells, numbered with the first axis running fastest.

pub mod basis;
pub mod ghost;
pub mod mesh;
pub mod region;
pub mod words;

use nalgebra::SVector;

/// An axis-aligned grid of `cells` boxes a side. Nodes and cells are numbered by `u64` keys, first axis fastest.
///
/// Each basis function has its node. Of functions of order 1 the nodes are the corners of the cells. Of splines of a
/// higher order there are more, at their Greville points: with unknowns that are linear in the places of the nodes, the
/// field is that linear function; the first and the last plane of nodes lie on the faces of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<const D: usize> {
    pub min: [f64; D],
    pub cell_size: [f64; D],
    pub cells: [usize; D],
    /// Order of the basis functions as polynomials on a cell; an axis has `cells + order` nodes.
    pub order: usize,
}

impl<const D: usize> Grid<D> {
    /// Position along an axis in cells from the lower face.
    pub fn cell_coordinate(&self, axis: usize, x: f64) -> f64 {
        (x - self.min[axis]) / self.cell_size[axis]
    }

    /// Cell that holds a position; one on the upper face belongs to the last cell. `None` outside the grid.
    pub fn cell_at(&self, position: &SVector<f64, D>) -> Option<[usize; D]> {
        let mut cell = [0; D];
        for axis in 0..D {
            let coordinate = self.cell_coordinate(axis, position[axis]);
            if !(coordinate >= 0.0 && coordinate <= self.cells[axis] as f64) {
                return None;
            }
            cell[axis] = (coordinate as usize).min(self.cells[axis] - 1);
        }
        Some(cell)
    }

    /// Number of a cell.
    pub fn cell_key(&self, cell: &[usize; D]) -> u64 {
        key(cell, &self.cells)
    }

    /// Cell with a number.
    pub fn cell(&self, cell_key: u64) -> [usize; D] {
        multi_index(cell_key, &self.cells)
    }

    /// Number of a node.
    pub fn node_key(&self, node: &[usize; D]) -> u64 {
        key(node, &self.nodes_per_axis())
    }

    /// Node with a number.
    pub fn node(&self, node_key: u64) -> [usize; D] {
        multi_index(node_key, &self.nodes_per_axis())
    }

    /// Nodes along each axis.
    pub fn nodes_per_axis(&self) -> [usize; D] {
        self.cells.map(|cells| cells + self.order)
    }

    /// Position of a node, the third coordinate zero in the plane.
    pub fn node_position(&self, node: &[usize; D]) -> [f64; 3] {
        let mut position = [0.0; 3];
        for axis in 0..D {
            position[axis] = self.min[axis] + self.node_coordinate(axis, node[axis]) * self.cell_size[axis];
        }
        position
    }

    /// Place of a node along an axis in cells from the lower face: the mean of the `order` knots inside the range of its
    /// function (Greville), where the knots are the lines of the grid, those at its ends repeated.
    fn node_coordinate(&self, axis: usize, node: usize) -> f64 {
        let knots = node + 1..=node + self.order;
        let sum: usize = knots.map(|k| k.saturating_sub(self.order).min(self.cells[axis])).sum();
        sum as f64 / self.order as f64
    }

    /// Cells that share a face with a cell, within the grid.
    pub fn neighbours(&self, cell: &[usize; D]) -> impl Iterator<Item = [usize; D]> + use<D> {
        let (cell, cells) = (*cell, self.cells);
        (0..2 * D).filter_map(move |side| {
            let (axis, up) = (side / 2, side % 2 == 1);
            let mut other = cell;
            match (up, cell[axis]) {
                (true, index) if index + 1 < cells[axis] => other[axis] = index + 1,
                (false, index) if index > 0 => other[axis] = index - 1,
                _ => return None,
            }
            Some(other)
        })
    }

    /// Moves one face of the grid along its axis; the cells between the faces stay of equal size.
    pub fn move_face(&mut self, axis: usize, upper: bool, motion: f64) {
        let cells = self.cells[axis] as f64;
        let length = self.cell_size[axis] * cells;
        if upper {
            self.cell_size[axis] = (length + motion) / cells;
        } else {
            self.min[axis] += motion;
            self.cell_size[axis] = (length - motion) / cells;
        }
    }

    /// Smallest edge of a cell [m].
    pub fn smallest_edge(&self) -> f64 {
        self.cell_size.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Nodes in the initial state: what sets of nodes are found by.
pub trait InitialNodes<const D: usize> {
    /// Place of a node among the others, along each axis.
    fn indices(&self, node_key: u64) -> [usize; D];
    /// Position of a node [m], the third coordinate zero in the plane.
    fn position(&self, node: &[usize; D]) -> [f64; 3];
    /// Shortest distance of neighbouring nodes [m].
    fn smallest_edge(&self) -> f64;
}

impl<const D: usize> InitialNodes<D> for Grid<D> {
    fn indices(&self, node_key: u64) -> [usize; D] {
        self.node(node_key)
    }

    fn position(&self, node: &[usize; D]) -> [f64; 3] {
        self.node_position(node)
    }

    fn smallest_edge(&self) -> f64 {
        Grid::smallest_edge(self)
    }
}

fn key<const D: usize>(index: &[usize; D], counts: &[usize; D]) -> u64 {
    let mut result = 0;
    for axis in (0..D).rev() {
        result = result * counts[axis] as u64 + index[axis] as u64;
    }
    result
}

fn multi_index<const D: usize>(mut key: u64, counts: &[usize; D]) -> [usize; D] {
    counts.map(|count| {
        let index = key % count as u64;
        key /= count as u64;
        index as usize
    })
}

/// A box of nodes: the lowest one and the number along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Support<const D: usize> {
    pub lowest: [u32; D],
    pub count: [u32; D],
}

impl<const D: usize> Support<D> {
    /// Number of nodes.
    pub fn size(&self) -> usize {
        self.count.iter().map(|&count| count as usize).product()
    }

    /// Calls `visit` with every node, first axis fastest.
    pub fn for_each_node(&self, visit: impl FnMut(&[usize; D])) {
        for_each_in_box(&self.lowest, &self.count, visit);
    }

    /// Calls `visit` with every cell that sees none but these nodes, first axis fastest. A cell sees `order + 1` of them
    /// along each axis.
    pub fn for_each_cell(&self, order: usize, visit: impl FnMut(&[usize; D])) {
        for_each_in_box(&self.lowest, &self.count.map(|count| count - order as u32), visit);
    }
}

fn for_each_in_box<const D: usize>(lowest: &[u32; D], count: &[u32; D], mut visit: impl FnMut(&[usize; D])) {
    let total: u32 = count.iter().product();
    for mut flat in 0..total {
        let mut index = [0; D];
        for axis in 0..D {
            index[axis] = (lowest[axis] + flat % count[axis]) as usize;
            flat /= count[axis];
        }
        visit(&index);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_indices_are_inverse() {
        let grid = Grid {
            min: [0.0; 3],
            cell_size: [0.5; 3],
            cells: [3, 4, 5],
            order: 1,
        };
        for key in 0..60 {
            assert_eq!(grid.cell_key(&grid.cell(key)), key);
        }
        assert_eq!(grid.node_key(&[1, 0, 0]), 1);
        assert_eq!(grid.node_key(&[0, 1, 0]), 4);
        assert_eq!(grid.node([4, 5, 6].iter().product::<u64>() - 1), [3, 4, 5]);
    }

    /// Greville points of order 2 and 3 on four cells, by hand; a single cell has those of Bernstein's polynomials.
    #[test]
    fn nodes_of_splines_lie_at_their_greville_points() {
        let places = |order: usize, cells: usize| -> Vec<f64> {
            let grid = Grid {
                min: [0.0],
                cell_size: [1.0],
                cells: [cells],
                order,
            };
            let nodes = 0..grid.nodes_per_axis()[0];
            nodes.map(|node| grid.node_position(&[node])[0]).collect()
        };
        assert_eq!(places(2, 4), [0.0, 0.5, 1.5, 2.5, 3.5, 4.0]);
        let third = 1.0 / 3.0;
        assert_eq!(places(3, 4), [0.0, third, 1.0, 2.0, 3.0, 11.0 / 3.0, 4.0]);
        assert_eq!(places(3, 1), [0.0, third, 2.0 / 3.0, 1.0]);
    }

    #[test]
    fn a_moved_face_stretches_the_cells_between() {
        let mut grid = Grid {
            min: [-1.0, 0.0],
            cell_size: [0.5, 1.0],
            cells: [4, 2],
            order: 1,
        };
        grid.move_face(0, true, 0.4);
        grid.move_face(1, false, -1.0);
        assert_eq!(grid.node_position(&[4, 0]), [1.4, -1.0, 0.0]);
        assert_eq!(grid.node_position(&[0, 2]), [-1.0, 2.0, 0.0]);
    }

    #[test]
    fn cells_hold_their_positions() {
        let grid = Grid {
            min: [-1.0, 0.0],
            cell_size: [0.5, 1.0],
            cells: [4, 2],
            order: 1,
        };
        assert_eq!(grid.cell_at(&SVector::from([-1.0, 0.0])), Some([0, 0]));
        assert_eq!(grid.cell_at(&SVector::from([1.0, 2.0])), Some([3, 1]));
        assert_eq!(grid.cell_at(&SVector::from([1.0 + 1e-12, 2.0])), None);
        assert_eq!(grid.cell_at(&SVector::from([f64::NAN, 2.0])), None);
    }
}
