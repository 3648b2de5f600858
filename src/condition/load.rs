//! Dead loads: weights, forces and couples on points and on faces of a mesh, and loads that vary over the body.

use super::Time;
use crate::continuum::Continuum;
use crate::points::Points;
use crate::points::search::Batches;
use std::borrow::Cow;
use std::fmt;
use std::rc::Rc;

/// What a load gives to each of its points at full load, by unknown in the order of the fields.
#[derive(Clone, Debug)]
pub enum Amount {
    /// Per unit reference volume, for each material.
    PerVolume(Vec<Vec<f64>>),
    PerPoint(Vec<f64>),
    /// Per unit reference volume, varying over the body.
    Field(LoadField),
}

/// A load per unit reference volume, by unknown, as a function of the reference position.
#[derive(Clone)]
pub struct LoadField(Rc<LoadFunction>);

type LoadFunction = dyn Fn(&[f64; 3]) -> Vec<f64>;

impl LoadField {
    pub fn new(function: impl Fn(&[f64; 3]) -> Vec<f64> + 'static) -> Self {
        Self(Rc::new(function))
    }
}

impl fmt::Debug for LoadField {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("LoadField")
    }
}

impl Amount {
    /// What point `p` gets at full load.
    pub fn at<C: Continuum, const D: usize>(&self, points: &Points<C, D>, p: usize) -> Cow<'_, [f64]> {
        let volume = points.volume[p];
        let times_volume = |amount: &[f64]| amount.iter().map(|amount| volume * amount).collect::<Vec<_>>();
        match self {
            Amount::PerVolume(amounts) => Cow::Owned(times_volume(&amounts[points.material[p] as usize])),
            Amount::PerPoint(amount) => Cow::Borrowed(amount),
            Amount::Field(field) => Cow::Owned(times_volume(&field.0(&points.reference_position(p)))),
        }
    }
}

/// A load whose direction and size do not depend on the motion.
#[derive(Clone, Debug)]
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
                let amount = load.amount.at(points, p);
                for (&node, shape) in nodes(index).iter().zip(batches.shapes(batch, p).chunks_exact(1 + D)) {
                    let own = &mut forces[node as usize * amount.len()..][..amount.len()];
                    own.iter_mut()
                        .zip(amount.iter())
                        .for_each(|(sum, amount)| *sum += factor * shape[0] * amount);
                }
            }
        }
    }
}

/// A force or couple that is spread evenly over a face of a mesh; its direction and size do not depend on the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceLoad {
    /// Stage over which it ramps.
    pub stage: usize,
    /// What all nodes together get at full load, by unknown in the order of the fields.
    pub total: Vec<f64>,
    /// Keys of the nodes, with their shares.
    pub shares: Vec<(u64, f64)>,
}

/// Adds the forces on faces to the nodes that this rank owns: the first of the local ones, whose keys are sorted.
pub fn add_face_forces(loads: &[FaceLoad], time: Time, own_nodes: &[u64], forces: &mut [f64]) {
    for load in loads {
        let factor = time.ramp(load.stage);
        for (key, share) in &load.shares {
            let Ok(node) = own_nodes.binary_search(key) else {
                continue;
            };
            let own = &mut forces[node * load.total.len()..][..load.total.len()];
            own.iter_mut()
                .zip(&load.total)
                .for_each(|(sum, total)| *sum += factor * share * total);
        }
    }
}
