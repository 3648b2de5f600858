//! Selections: sets of points found in the initial state, carried by the points as marks.

use super::Points;
use super::placement::AxisPoint;
use super::seed::{Body, PointSource};
use crate::continuum::Continuum;
use crate::grid::Grid;
use crate::grid::region::Shape;
use crate::parallel::{Numbering, World};
use nalgebra::{SVector, Vector3};

/// A set of material points, found in the initial state.
#[derive(Clone, Debug, PartialEq)]
pub enum Selection {
    /// Points of a body that lie farthest in a direction, within round-off.
    Layer {
        body: usize,
        direction: [f64; 3],
    },
    /// Points of a body whose domains have a side on its surface, towards any of these: axis, and whether upwards.
    Surface {
        body: usize,
        sides: Vec<(usize, bool)>,
    },
    Nearest([f64; 3]),
    Within(Shape),
    /// Those that a load (by index) acts on.
    Load(usize),
}

/// Most selections that a scene may have: one bit each.
pub const MAX_SELECTIONS: usize = 64;

/// A lattice plane is as thick as this share of a point's domain: round-off only.
const LAYER_TOLERANCE: f64 = 1.0e-6;

impl<C: Continuum, const D: usize> Points<C, D> {
    /// Collective. Marks the points of a selection with bit `bit` and returns how many there are on all ranks.
    /// `marks_of_load` gives the marks of the points that a load acts on; all points without. `edge` is the shortest
    /// distance of neighbouring nodes.
    pub fn mark(
        &mut self,
        world: &World,
        selection: &Selection,
        bit: usize,
        marks_of_load: impl Fn(usize) -> Option<u64>,
        (grid, bodies): (&Grid<D>, &[Body]),
        edge: f64,
    ) -> u64 {
        let chosen: Vec<bool> = match selection {
            Selection::Layer { body, direction } => self.layer(world, *body, direction, edge),
            Selection::Nearest(target) => {
                let nearest = self.nearest_id(world, target, edge);
                self.all(|p| self.id[p] == nearest)
            }
            Selection::Within(shape) => self.all(|p| shape.contains(&in_space(&self.position[p]), 0.0)),
            Selection::Surface { body, sides } => self.surface(world, grid, *body, &bodies[*body], sides),
            Selection::Load(load) => match marks_of_load(*load) {
                Some(marks) => self.all(|p| self.marks[p] & marks != 0),
                None => self.all(|_| true),
            },
        };
        for (marks, chosen) in self.marks.iter_mut().zip(&chosen) {
            *marks |= u64::from(*chosen) << bit;
        }
        world.sum(chosen.iter().filter(|&&chosen| chosen).count() as u64)
    }

    fn all(&self, test: impl Fn(usize) -> bool) -> Vec<bool> {
        (0..self.len()).map(test).collect()
    }

    /// Points of a body that lie farthest in a direction.
    fn layer(&self, world: &World, body: usize, direction: &[f64; 3], edge: f64) -> Vec<bool> {
        let direction = Vector3::from(*direction).normalize();
        let distance = |p: usize| Vector3::from(in_space(&self.position[p])).dot(&direction);
        let of_body = |p: usize| self.body[p] as usize == body;
        let own = (0..self.len())
            .filter(|&p| of_body(p))
            .map(distance)
            .fold(f64::NEG_INFINITY, f64::max);
        let farthest = world.max_of(own);
        self.all(|p| of_body(p) && distance(p) >= farthest - LAYER_TOLERANCE * edge)
    }

    /// Points of a body on a lattice that have no neighbour of the same body towards one of the sides.
    fn surface(&self, world: &World, grid: &Grid<D>, number: usize, body: &Body, sides: &[(usize, bool)]) -> Vec<bool> {
        let PointSource::Lattice {
            points_per_cell,
            placement,
            ..
        } = &body.points
        else {
            return vec![false; self.len()];
        };
        let rules: [Vec<AxisPoint>; D] = std::array::from_fn(|axis| placement.axis_points(points_per_cell[axis]));
        let lattice = Lattice { grid, rules: &rules };
        let own: Vec<usize> = (0..self.len()).filter(|&p| self.body[p] as usize == number).collect();
        let places: Vec<[usize; D]> = own.iter().map(|&p| lattice.place(&self.position[p])).collect();
        let mut keys: Vec<u64> = places.iter().map(|place| lattice.key(place)).collect();
        keys.sort_unstable();
        let numbering = Numbering::new(world, &keys);
        let mut chosen = vec![false; self.len()];
        for &(axis, upper) in sides {
            let neighbours: Vec<Option<[usize; D]>> = places
                .iter()
                .map(|place| lattice.neighbour(place, axis, upper))
                .collect();
            let asked: Vec<u64> = neighbours.iter().flatten().map(|place| lattice.key(place)).collect();
            let mut found = numbering.look_up(world, &asked).into_iter();
            for (&p, neighbour) in own.iter().zip(&neighbours) {
                let covered = neighbour.is_some() && found.next().flatten().is_some();
                chosen[p] |= !covered;
            }
        }
        chosen
    }

    /// Collective. Number of the point nearest to a position, the lowest among those at that distance within round-off of
    /// the edge of a cell; `u64::MAX` where there are no points.
    pub fn nearest_id(&self, world: &World, target: &[f64; 3], edge: f64) -> u64 {
        let distance = |p: usize| (Vector3::from(in_space(&self.position[p])) - Vector3::from(*target)).norm();
        let smallest = world.min_of((0..self.len()).map(distance).fold(f64::INFINITY, f64::min));
        let near = |p: usize| distance(p) <= smallest + LAYER_TOLERANCE * edge;
        world.min_of(
            (0..self.len())
                .filter(|&p| near(p))
                .map(|p| self.id[p])
                .min()
                .unwrap_or(u64::MAX),
        )
    }
}

/// The points of a lattice, counted along each axis of the grid.
struct Lattice<'a, const D: usize> {
    grid: &'a Grid<D>,
    rules: &'a [Vec<AxisPoint>; D],
}

impl<const D: usize> Lattice<'_, D> {
    /// Place of the lattice point at a position.
    fn place(&self, position: &SVector<f64, D>) -> [usize; D] {
        std::array::from_fn(|axis| {
            let rule = &self.rules[axis];
            let x = self.grid.cell_coordinate(axis, position[axis]);
            let far = |point: &AxisPoint| (point.position - x.fract()).abs();
            let nearest = (0..rule.len()).min_by(|&a, &b| far(&rule[a]).total_cmp(&far(&rule[b])));
            x as usize * rule.len() + nearest.unwrap_or_default()
        })
    }

    /// The next place along an axis; `None` beyond the grid.
    fn neighbour(&self, place: &[usize; D], axis: usize, upper: bool) -> Option<[usize; D]> {
        let mut next = *place;
        next[axis] = if upper {
            place[axis] + 1
        } else {
            place[axis].checked_sub(1)?
        };
        (next[axis] < self.count(axis)).then_some(next)
    }

    fn count(&self, axis: usize) -> usize {
        self.grid.cells[axis] * self.rules[axis].len()
    }

    fn key(&self, place: &[usize; D]) -> u64 {
        (0..D)
            .rev()
            .fold(0, |key, axis| key * self.count(axis) as u64 + place[axis] as u64)
    }
}

/// A position with a third coordinate of zero in the plane.
pub fn in_space<const D: usize>(position: &SVector<f64, D>) -> [f64; 3] {
    let mut result = [0.0; 3];
    result[..D].copy_from_slice(position.as_slice());
    result
}
