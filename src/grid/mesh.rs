//! A mesh that moves with its body: the cells of a grid, mapped to space by the positions of their nodes.
//!
//! Numbers of nodes and cells are those of a [`Grid`] with cells of unit size, so that all that knows supports and keys
//! serves here too. In a cell with coordinates `s` from 0 to 1 the map is isoparametric,
//! `x(s) = sum_a N_a(s) x_a`, and gradients in space are `J^-T dN_a/ds` with `J = dx/ds`. Every rank holds all nodes.

use super::basis::{self, Linear};
use super::region::Shape;
use super::{Grid, InitialNodes, Support};
use crate::parallel::World;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Nodes of a mesh, at the start and now.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh<const D: usize> {
    /// Cells of unit size that give nodes and cells their numbers.
    grid: Grid<D>,
    /// Positions of the nodes by key [m].
    initial: Vec<SVector<f64, D>>,
    current: Vec<SVector<f64, D>>,
    smallest_edge: f64,
}

/// A face of a mesh: the nodes at one end of one of its own axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshFace {
    pub axis: usize,
    pub upper: bool,
}

impl<const D: usize> Mesh<D> {
    /// Divides a box, or a sector of a ring, evenly along its own axes ([`Shape::at`]).
    ///
    /// # Panics
    /// Where the shape has no axes of its own.
    pub fn new(shape: &Shape, cells: [usize; D]) -> Self {
        let grid = Grid {
            min: [0.0; D],
            cell_size: [1.0; D],
            cells,
            order: 1,
        };
        let nodes: u64 = grid.nodes_per_axis().iter().map(|&count| count as u64).product();
        let place = |key: u64| {
            let node = grid.node(key);
            let mut coordinates = [0.0; 3];
            (0..D).for_each(|axis| coordinates[axis] = node[axis] as f64 / cells[axis] as f64);
            let position = shape
                .at(&coordinates)
                .expect("a mesh fills a box or a sector of a ring");
            SVector::from_fn(|k, _| position[k])
        };
        let initial: Vec<_> = (0..nodes).map(place).collect();
        let mut mesh = Self {
            current: initial.clone(),
            initial,
            grid,
            smallest_edge: 0.0,
        };
        mesh.smallest_edge = mesh.shortest();
        mesh
    }

    /// Shortest distance of neighbouring nodes.
    fn shortest(&self) -> f64 {
        let mut shortest = f64::INFINITY;
        for (key, position) in self.initial.iter().enumerate() {
            let node = self.grid.node(key as u64);
            for axis in (0..D).filter(|&axis| node[axis] < self.grid.cells[axis]) {
                let mut next = node;
                next[axis] += 1;
                let other = self.initial[self.grid.node_key(&next) as usize];
                shortest = shortest.min((other - position).norm());
            }
        }
        shortest
    }

    /// Cells of unit size with the numbers of this mesh.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Nodes of a cell.
    pub fn support(&self, cell: u64) -> Support<D> {
        Support {
            lowest: self.grid.cell(cell).map(|index| index as u32),
            count: [2; D],
        }
    }

    /// Values and gradients [1/m] at coordinates `place` of a cell, from 0 to 1, as [`basis::evaluate`] gives them, in
    /// space as the nodes are now. Returns the volume there per unit of the coordinates [m^D].
    pub fn evaluate(&self, support: &Support<D>, place: &SVector<f64, D>, out: &mut [f64]) -> f64 {
        self.evaluate_in_cell(support, place, out);
        let jacobian = self.jacobian(&self.current, support, out);
        // Without an inverse the residual is not a number either, and the attempt at a step ends in good order.
        let inverse = jacobian.try_inverse().unwrap_or(Matrix3::repeat(f64::NAN));
        for shape in out.chunks_exact_mut(1 + D) {
            let gradient = inverse.transpose() * Vector3::from_fn(|k, _| if k < D { shape[1 + k] } else { 0.0 });
            shape[1..].copy_from_slice(&gradient.as_slice()[..D]);
        }
        jacobian.determinant().abs()
    }

    /// Values and derivatives by the coordinates of the cell.
    fn evaluate_in_cell(&self, support: &Support<D>, place: &SVector<f64, D>, out: &mut [f64]) {
        let position = SVector::from_fn(|k, _| f64::from(support.lowest[k]) + place[k]);
        basis::evaluate(&Linear, &self.grid, support, &position, &SVector::zeros(), out);
    }

    /// `dx/ds` from values and derivatives by the coordinates; in the plane the third axis is left as it is.
    fn jacobian(&self, nodes: &[SVector<f64, D>], support: &Support<D>, shapes: &[f64]) -> Matrix3<f64> {
        let mut jacobian = SMatrix::<f64, D, D>::zeros();
        let mut rest = shapes.chunks_exact(1 + D);
        support.for_each_node(|node| {
            let shape = rest.next().expect("a shape for each node of the support");
            let derivative = SVector::<f64, D>::from_fn(|k, _| shape[1 + k]);
            jacobian += nodes[self.grid.node_key(node) as usize] * derivative.transpose();
        });
        Matrix3::from_fn(|i, k| match (i < D, k < D) {
            (true, true) => jacobian[(i, k)],
            _ => f64::from(u8::from(i == k)),
        })
    }

    /// Position in the initial state where functions have these values.
    pub fn initial_position(&self, support: &Support<D>, shapes: &[f64]) -> SVector<f64, D> {
        let mut position = SVector::zeros();
        let mut rest = shapes.chunks_exact(1 + D);
        support.for_each_node(|node| {
            let shape = rest.next().expect("a shape for each node of the support");
            position += self.initial[self.grid.node_key(node) as usize] * shape[0];
        });
        position
    }

    /// Collective. Moves the nodes by the increments that their owners give; every node has one owner.
    pub fn advance(&mut self, world: &World, increments: impl Iterator<Item = (u64, SVector<f64, D>)>) {
        let mut all = vec![0.0; self.current.len() * D];
        for (key, increment) in increments {
            all[key as usize * D..][..D].copy_from_slice(increment.as_slice());
        }
        world.sum_slice(&mut all);
        for (position, increment) in self.current.iter_mut().zip(all.chunks_exact(D)) {
            *position += SVector::<f64, D>::from_column_slice(increment);
        }
    }

    /// Positions of the nodes now, by key [m].
    pub fn nodes(&self) -> &[SVector<f64, D>] {
        &self.current
    }

    /// Puts the nodes to these positions, in the order of [`Mesh::nodes`].
    ///
    /// # Panics
    /// If there are not as many as nodes.
    pub fn place_nodes(&mut self, positions: impl ExactSizeIterator<Item = SVector<f64, D>>) {
        assert_eq!(positions.len(), self.current.len(), "one position per node");
        self.current = positions.collect();
    }

    /// Nodes of a face with their shares of something that is spread evenly over its initial area; they sum to one.
    pub fn face_shares(&self, face: MeshFace) -> Vec<(u64, f64)> {
        let mut shares = vec![0.0; self.initial.len()];
        let end = if face.upper { self.grid.cells[face.axis] - 1 } else { 0 };
        let cells: u64 = self.grid.cells.iter().map(|&count| count as u64).product();
        for cell in (0..cells).filter(|&cell| self.grid.cell(cell)[face.axis] == end) {
            self.add_face_of_cell(&self.support(cell), face, &mut shares);
        }
        let area: f64 = shares.iter().sum();
        let on_face = (0u64..).zip(shares).filter(|&(_, share)| share != 0.0);
        on_face.map(|(key, share)| (key, share / area)).collect()
    }

    /// Adds the integrals of a cell's functions over its part of a face, by Gauss' rule with two points an axis.
    fn add_face_of_cell(&self, support: &Support<D>, face: MeshFace, shares: &mut [f64]) {
        let mut shapes = vec![0.0; support.size() * (1 + D)];
        for mut corner in 0..1 << (D - 1) {
            let place = SVector::<f64, D>::from_fn(|axis, _| {
                if axis == face.axis {
                    return f64::from(u8::from(face.upper));
                }
                let side = if corner & 1 == 1 { 0.5 } else { -0.5 };
                corner >>= 1;
                0.5 + side / 3f64.sqrt()
            });
            self.evaluate_in_cell(support, &place, &mut shapes);
            let jacobian = self.jacobian(&self.initial, support, &shapes);
            let area = area_across(&jacobian, face.axis);
            let mut rest = shapes.chunks_exact(1 + D);
            support.for_each_node(|node| {
                let shape = rest.next().expect("a shape for each node of the support");
                shares[self.grid.node_key(node) as usize] += area * shape[0];
            });
        }
    }

    /// Mean over the initial area of a face: initial position and displacement so far [m].
    pub fn mean_of_face(&self, shares: &[(u64, f64)]) -> (SVector<f64, D>, SVector<f64, D>) {
        let (mut position, mut displacement) = (SVector::zeros(), SVector::zeros());
        for &(key, share) in shares {
            let initial = self.initial[key as usize];
            position += initial * share;
            displacement += (self.current[key as usize] - initial) * share;
        }
        (position, displacement)
    }
}

/// Area of a face across an axis, per unit of the other coordinates.
fn area_across(jacobian: &Matrix3<f64>, axis: usize) -> f64 {
    jacobian
        .column((axis + 1) % 3)
        .cross(&jacobian.column((axis + 2) % 3))
        .norm()
}

impl<const D: usize> InitialNodes<D> for Mesh<D> {
    fn indices(&self, node_key: u64) -> [usize; D] {
        self.grid.node(node_key)
    }

    fn position(&self, node: &[usize; D]) -> [f64; 3] {
        let mut position = [0.0; 3];
        position[..D].copy_from_slice(self.initial[self.grid.node_key(node) as usize].as_slice());
        position
    }

    fn smallest_edge(&self) -> f64 {
        self.smallest_edge
    }
}
