//! Dead loads: weights, forces and couples on points.

use super::Time;
use crate::continuum::Continuum;
use crate::points::Points;
use crate::points::search::Batches;

/// What a load gives to each of its points at full load, by unknown in the order of the fields.
#[derive(Clone, Debug, PartialEq)]
pub enum Amount {
    /// Per unit reference volume, for each material.
    PerVolume(Vec<Vec<f64>>),
    PerPoint(Vec<f64>),
}

/// A load whose direction and size do not depend on the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadLoad {
    /// Stage over which it ramps.
    pub stage: usize,
    pub amount: Amount,
    /// Bit of the selection that the load acts on; all points without.
    pub bit: Option<usize>,
}

/// Adds the nodal forces of all loads at a time. `nodes(b)` are the local nodes of batch `b`.
pub fn add_external_forces<'a, C: Continuum, const D: usize>(
    loads: &[DeadLoad],
    time: Time,
    points: &Points<C, D>,
    batches: &Batches<D>,
    nodes: impl Fn(usize) -> &'a [u32],
    forces: &mut [f64],
) {
    for load in loads {
        let factor = time.ramp(load.stage);
        if factor == 0.0 {
            continue;
        }
        for (index, batch) in batches.batches.iter().enumerate() {
            for p in batch.points.clone() {
                if load.bit.is_some_and(|bit| points.marks[p] >> bit & 1 == 0) {
                    continue;
                }
                let (weight, amount) = match &load.amount {
                    Amount::PerVolume(amounts) => (factor * points.volume[p], &amounts[points.material[p] as usize]),
                    Amount::PerPoint(amount) => (factor, amount),
                };
                for (&node, shape) in nodes(index).iter().zip(batches.shapes(batch, p).chunks_exact(1 + D)) {
                    let own = &mut forces[node as usize * amount.len()..][..amount.len()];
                    own.iter_mut()
                        .zip(amount)
                        .for_each(|(sum, amount)| *sum += weight * shape[0] * amount);
                }
            }
        }
    }
}
