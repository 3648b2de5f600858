//! How far points move: the measure of a step along an equilibrium path.
//!
//! Mean square over points, weighted by their reference volumes:
//!
//! $$ \langle a, b \rangle = \frac{\sum_p V_p\, a_p \cdot b_p}{\sum_p V_p} $$
//!
//! It is taken at points, not at nodes: the grid is new in every step, and a node that the body barely touches may move
//! by any amount.

use super::active::Active;
use super::kernel::jet;
use crate::continuum::Fields;
use crate::parallel::World;
use crate::points::Points;
use crate::points::search::Batches;
use nalgebra::SVector;

/// Which points are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathPoints {
    /// Bit of their selection; all points without.
    pub bit: Option<usize>,
}

/// The measure on the points of this rank, in the order that they have in a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// Root of each point's share.
    roots: Vec<f64>,
}

/// Vectors at the points of this rank, each times the root of its point's share.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMotion(Vec<f64>);

impl Measure {
    /// Collective. The measure of these points; it holds until their order changes.
    pub fn new<C: Fields<D, N>, const D: usize, const N: usize>(
        world: &World,
        chosen: PathPoints,
        points: &Points<C, D>,
    ) -> Self {
        let counts = |p: usize| chosen.bit.is_none_or(|bit| points.marks[p] >> bit & 1 == 1);
        let volumes: Vec<f64> = (0..points.len())
            .map(|p| if counts(p) { points.volume[p] } else { 0.0 })
            .collect();
        let total = world.sum(volumes.iter().sum::<f64>());
        Self {
            roots: volumes.iter().map(|volume| (volume / total).sqrt()).collect(),
        }
    }

    /// Motions that each point has already.
    pub fn of<const D: usize>(&self, motions: &[SVector<f64, D>]) -> PointMotion {
        let weighted = self.roots.iter().zip(motions);
        PointMotion(
            weighted
                .flat_map(|(root, motion)| motion.iter().map(move |x| root * x))
                .collect(),
        )
    }

    /// Motions of the points in a step with local increments `u`.
    pub fn of_increments<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        batches: &Batches<D>,
        active: &Active,
        u: &[f64],
    ) -> PointMotion {
        let mut motion = vec![0.0; self.roots.len() * D];
        let mut unknowns = Vec::new();
        for (index, batch) in batches.batches.iter().enumerate() {
            unknowns.clear();
            for &node in active.batch_nodes(index) {
                unknowns.extend_from_slice(&u[node as usize * N..][..N]);
            }
            for p in batch.points.clone() {
                let value = jet::<D, N>(batches.shapes(batch, p), &unknowns).value;
                // Translations come first among the unknowns of a node.
                (0..D).for_each(|k| motion[p * D + k] = self.roots[p] * value[k]);
            }
        }
        PointMotion(motion)
    }
}

impl PointMotion {
    /// Adds a multiple of another.
    pub fn add(&mut self, factor: f64, other: &PointMotion) {
        self.0
            .iter_mut()
            .zip(&other.0)
            .for_each(|(own, other)| *own += factor * other);
    }

    /// Collective. Products of pairs, the same on every rank.
    pub fn products<const M: usize>(world: &World, pairs: [(&PointMotion, &PointMotion); M]) -> [f64; M] {
        let mut sums = pairs.map(|(a, b)| a.0.iter().zip(&b.0).map(|(a, b)| a * b).sum::<f64>());
        world.sum_slice(&mut sums);
        sums
    }

    /// Collective. Root of the mean square [m].
    pub fn length(&self, world: &World) -> f64 {
        let [square] = Self::products(world, [(self, self)]);
        square.sqrt()
    }
}
