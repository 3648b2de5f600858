//! Finite elements: a body on a mesh of its own, with points at fixed places of its cells.
//!
//! The number of a point names its cell and its place in it, so that a point needs no more memory than one on a grid.

use super::placement::Placement;
use super::seed::SeedPoint;
use crate::grid::Support;
use crate::grid::mesh::Mesh;
use crate::grid::region::Shape;
use nalgebra::SVector;

/// What a mesh is made of, as a scene has it.
#[derive(Clone, Debug)]
pub struct MeshSettings {
    /// A box or a sector of a ring.
    pub shape: Shape,
    /// Cells along its own axes; 1 along an axis that plane strain does not have.
    pub cells: [usize; 3],
    /// Points of Gauss' quadrature along each axis of a cell.
    pub points_per_cell: [usize; 3],
}

/// A mesh with the points of its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Elements<const D: usize> {
    pub mesh: Mesh<D>,
    /// Coordinates of the points of a cell, from 0 to 1, with their share of the unit cell.
    places: Vec<(SVector<f64, D>, f64)>,
}

impl<const D: usize> Elements<D> {
    pub fn new(settings: &MeshSettings) -> Self {
        let rules = settings
            .points_per_cell
            .map(|count| Placement::Gauss.axis_points(count));
        let count: usize = rules[..D].iter().map(Vec::len).product();
        let place = |mut local: usize| {
            let mut weight = 1.0;
            let coordinates = SVector::from_fn(|axis, _| {
                let point = rules[axis][local % rules[axis].len()];
                local /= rules[axis].len();
                weight *= point.weight;
                point.position
            });
            (coordinates, weight)
        };
        Self {
            mesh: Mesh::new(&settings.shape, std::array::from_fn(|axis| settings.cells[axis])),
            places: (0..count).map(place).collect(),
        }
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.mesh.grid().cells.iter().product::<usize>() * self.places.len()
    }

    /// Cell of a point.
    pub fn cell(&self, id: u64) -> u64 {
        id / self.places.len() as u64
    }

    /// Nodes that see a point.
    pub fn support(&self, id: u64) -> Support<D> {
        self.mesh.support(self.cell(id))
    }

    /// Values and gradients at a point, as the nodes are now; see [`Mesh::evaluate`].
    pub fn evaluate(&self, id: u64, support: &Support<D>, out: &mut [f64]) -> f64 {
        let (place, weight) = &self.places[id as usize % self.places.len()];
        weight * self.mesh.evaluate(support, place, out)
    }

    /// A point of the initial state. For pictures it has the domain of a cube of its volume; nothing else asks for it.
    pub fn seed_point(&self, id: u64) -> SeedPoint {
        let support = self.support(id);
        let mut shapes = vec![0.0; support.size() * (1 + D)];
        let volume = self.evaluate(id, &support, &mut shapes);
        let mut position = [0.0; 3];
        position[..D].copy_from_slice(self.mesh.initial_position(&support, &shapes).as_slice());
        SeedPoint {
            position,
            volume,
            half_lengths: [0.5 * volume.powf(1.0 / D as f64); 3],
        }
    }
}
