//! Selections: sets of points found in the initial state, carried by the points as marks.

use super::Points;
use crate::continuum::Continuum;
use crate::grid::region::Shape;
use crate::parallel::World;
use nalgebra::{SVector, Vector3};

/// A set of material points, found in the initial state.
#[derive(Clone, Debug, PartialEq)]
pub enum Selection {
    /// Points of a body that lie farthest in a direction, within round-off.
    Layer {
        body: usize,
        direction: [f64; 3],
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
    /// `bit_of_load` gives the bit of the selection that a load acts on.
    pub fn mark(
        &mut self,
        world: &World,
        selection: &Selection,
        bit: usize,
        bit_of_load: impl Fn(usize) -> Option<usize>,
        edge: f64,
    ) -> u64 {
        let chosen: Vec<bool> = match selection {
            Selection::Layer { body, direction } => self.layer(world, *body, direction, edge),
            Selection::Nearest(target) => self.nearest(world, target, edge),
            Selection::Within(shape) => self.all(|p| shape.contains(&in_space(&self.position[p]), 0.0)),
            Selection::Load(load) => match bit_of_load(*load) {
                Some(other) => self.all(|p| self.marks[p] >> other & 1 == 1),
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

    /// The one point nearest to a position, the lowest id among equals.
    fn nearest(&self, world: &World, target: &[f64; 3], edge: f64) -> Vec<bool> {
        let distance = |p: usize| (Vector3::from(in_space(&self.position[p])) - Vector3::from(*target)).norm();
        let smallest = world.min_of((0..self.len()).map(distance).fold(f64::INFINITY, f64::min));
        let near = |p: usize| distance(p) <= smallest + LAYER_TOLERANCE * edge;
        let lowest_id = world.min_of(
            (0..self.len())
                .filter(|&p| near(p))
                .map(|p| self.id[p])
                .min()
                .unwrap_or(u64::MAX),
        );
        self.all(|p| self.id[p] == lowest_id)
    }
}

/// A position with a third coordinate of zero in the plane.
pub fn in_space<const D: usize>(position: &SVector<f64, D>) -> [f64; 3] {
    let mut result = [0.0; 3];
    result[..D].copy_from_slice(position.as_slice());
    result
}
