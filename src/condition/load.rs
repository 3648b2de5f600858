//! Dead loads: weights, forces and couples on points, and on faces of a mesh.

use super::Time;
use crate::continuum::Continuum;
use crate::points::Points;
use crate::points::search::Batches;

/// What a load gives to its points or nodes at full load, by unknown in the order of the fields.
#[derive(Clone, Debug, PartialEq)]
pub enum Amount {
    /// Per unit reference volume, for each material.
    PerVolume(Vec<Vec<f64>>),
    PerPoint(Vec<f64>),
    /// A total, shared by nodes of a mesh: their keys, sorted, with their shares.
    OnNodes {
        total: Vec<f64>,
        shares: Vec<(u64, f64)>,
    },
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

/// Adds the nodal forces of all loads at a time. `nodes(b)` are the local nodes of batch `b`; the keys of the own nodes,
/// which are the first of the local ones, are sorted.
pub fn add_external_forces<'a, C: Continuum, const D: usize>(
    loads: &[DeadLoad],
    time: Time,
    points: &Points<C, D>,
    batches: &Batches<D>,
    nodes: impl Fn(usize) -> &'a [u32],
    own_nodes: &[u64],
    forces: &mut [f64],
) {
    for load in loads {
        let factor = time.ramp(load.stage);
        if factor == 0.0 {
            continue;
        }
        match &load.amount {
            Amount::OnNodes { total, shares } => add_to_nodes(total, shares, factor, own_nodes, forces),
            Amount::PerVolume(amounts) => add_to_points(load.bit, points, batches, &nodes, forces, |p| {
                (factor * points.volume[p], &amounts[points.material[p] as usize])
            }),
            Amount::PerPoint(amount) => {
                add_to_points(load.bit, points, batches, &nodes, forces, |_| (factor, amount));
            }
        }
    }
}

/// Adds what the selected points carry: a weight and an amount for each.
fn add_to_points<'a, 'b, C: Continuum, const D: usize>(
    bit: Option<usize>,
    points: &Points<C, D>,
    batches: &Batches<D>,
    nodes: &impl Fn(usize) -> &'a [u32],
    forces: &mut [f64],
    carried: impl Fn(usize) -> (f64, &'b Vec<f64>),
) {
    for (index, batch) in batches.batches.iter().enumerate() {
        for p in batch.points.clone() {
            if bit.is_some_and(|bit| points.marks[p] >> bit & 1 == 0) {
                continue;
            }
            let (weight, amount) = carried(p);
            for (&node, shape) in nodes(index).iter().zip(batches.shapes(batch, p).chunks_exact(1 + D)) {
                let own = &mut forces[node as usize * amount.len()..][..amount.len()];
                own.iter_mut()
                    .zip(amount)
                    .for_each(|(sum, amount)| *sum += weight * shape[0] * amount);
            }
        }
    }
}

/// Adds the shares of the nodes that this rank owns.
fn add_to_nodes(total: &[f64], shares: &[(u64, f64)], factor: f64, own_nodes: &[u64], forces: &mut [f64]) {
    for (key, share) in shares {
        let Ok(node) = own_nodes.binary_search(key) else {
            continue;
        };
        let own = &mut forces[node * total.len()..][..total.len()];
        own.iter_mut()
            .zip(total)
            .for_each(|(sum, total)| *sum += factor * share * total);
    }
}
