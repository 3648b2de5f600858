//! What the round-off of strains makes of forces: the level below which no residual can come.
//!
//! A law sees deformations next to one, so that a stress is exact to about the machine precision times its largest
//! modulus `M`, however small it is. At a node that adds up to
//!
//! $$ \epsilon\,f_I, \qquad f_I^2 = \sum_{batches} \Big( \sum_p V_0 M |\nabla S_I| \Big)^2 $$
//!
//! since errors of different batches do not know of each other; for rotations `S_I` takes the place of its gradient, as the
//! skew stress acts on them directly. Increments that the body shares, as in a rigid motion, cancel in the strain of a
//! step and leave their own round-off, relative to the edge of a cell.

use super::active::Active;
use crate::continuum::{Fields, UnknownKind};
use crate::material::Material;
use crate::points::Points;
use crate::points::search::Batches;

/// Adds to local unknowns the squares of the forces [N2, N2 m2] that a strain of one would make. Returns the largest
/// sum of gradients of a point [1/m], which turns increments into strains.
pub fn add_strain_squares<C: Fields<D, N>, const D: usize, const N: usize>(
    laws: &[Box<dyn Material<C>>],
    batches: &Batches<D>,
    active: &Active,
    points: &Points<C, D>,
    squares: &mut [f64],
) -> f64 {
    let mut steepest: f64 = 0.0;
    let mut forces: Vec<[f64; 2]> = Vec::new();
    for (index, batch) in batches.batches.iter().enumerate() {
        let nodes = active.batch_nodes(index);
        forces.clear();
        forces.resize(nodes.len(), [0.0; 2]);
        for p in batch.points.clone() {
            let stiffness = points.volume[p] * laws[points.material[p] as usize].largest_modulus();
            let mut gradients = 0.0;
            for (force, shape) in forces.iter_mut().zip(batches.shapes(batch, p).chunks_exact(1 + D)) {
                let gradient = shape[1..].iter().map(|slope| slope * slope).sum::<f64>().sqrt();
                gradients += gradient;
                force[0] += stiffness * gradient;
                force[1] += stiffness * shape[0];
            }
            steepest = steepest.max(gradients);
        }
        for (&node, [force, couple]) in nodes.iter().zip(&forces) {
            for (square, kind) in squares[node as usize * N..][..N].iter_mut().zip(C::KIND) {
                *square += match kind {
                    UnknownKind::Translation => force * force,
                    UnknownKind::Rotation => couple * couple,
                    UnknownKind::Damage => 0.0,
                };
            }
        }
    }
    steepest
}
