//! History columns: numbers drawn from the accepted state.

use super::snapshot::{mean_stress, state_scalar, von_mises};
use crate::assembly::model::Model;
use crate::condition::Time;
use crate::continuum::{Fields, Observation};
use crate::parallel::World;
use crate::scene::{HistoryColumn, HistoryQuantity, Kinematics, PointField, Reduction, Scene};
use nalgebra::Matrix3;

/// An entry of `output.history`, one or more columns.
pub struct Column {
    pub entry: HistoryColumn,
    /// Mark of the selected points; all points without.
    pub bit: Option<usize>,
    /// Shares of the nodes of a face of the mesh, where the entry is their mean.
    pub face: Vec<(u64, f64)>,
}

/// Where the components of a field stand among the numbers of [`value_of`].
fn places(field: PointField, kinematics: Kinematics) -> std::ops::Range<usize> {
    let count = field.components(kinematics).len();
    // In plane strain there is one rotation, about the third axis.
    let first = if field == PointField::Rotation && count == 1 {
        2
    } else {
        0
    };
    first..first + count
}

impl Column {
    /// Collective. Values of the columns, in the order of the names.
    pub fn values<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        world: &World,
        scene: &Scene,
        model: &Model<C, D, N>,
        time: Time,
        reactions: &[[f64; N]],
    ) -> Vec<f64> {
        match &self.entry.quantity {
            HistoryQuantity::Reaction { boundary, component } => vec![reactions[*boundary][*component]],
            HistoryQuantity::BoundaryMotion { boundary, component } => {
                let boundary = &scene.boundaries[*boundary];
                let total = boundary
                    .moves
                    .iter()
                    .find(|(moved, _)| moved == component)
                    .map_or(0.0, |(_, total)| *total);
                vec![total * time.ramp(boundary.stage)]
            }
            HistoryQuantity::LoadFactor { load } => vec![time.ramp(scene.loads[*load].stage)],
            HistoryQuantity::FaceMean { field, .. } => self.mean_of_face(model, *field),
            HistoryQuantity::Points { reduction, field, .. } => {
                self.reduce(world, model, *reduction, *field, places(*field, scene.kinematics))
            }
        }
    }

    fn mean_of_face<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        model: &Model<C, D, N>,
        field: PointField,
    ) -> Vec<f64> {
        let elements = model.elements.as_ref().expect("only a mesh has faces");
        let (position, displacement) = elements.mesh.mean_of_face(&self.face);
        let mean = match field {
            PointField::Displacement => displacement,
            _ => position + displacement,
        };
        mean.as_slice().to_vec()
    }

    fn reduce<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        world: &World,
        model: &Model<C, D, N>,
        reduction: Reduction,
        field: PointField,
        places: std::ops::Range<usize>,
    ) -> Vec<f64> {
        let start = match reduction {
            Reduction::Maximum => f64::NEG_INFINITY,
            Reduction::Minimum => f64::INFINITY,
            Reduction::Mean => 0.0,
        };
        let mut results = vec![start; places.len()];
        let mut count = 0u64;
        for p in 0..model.points.len() {
            if self.bit.is_some_and(|bit| model.points.marks[p] >> bit & 1 == 0) {
                continue;
            }
            count += 1;
            let value = value_of(model, field, p);
            for (result, place) in results.iter_mut().zip(places.clone()) {
                *result = match reduction {
                    Reduction::Maximum => result.max(value[place]),
                    Reduction::Minimum => result.min(value[place]),
                    Reduction::Mean => *result + value[place],
                };
            }
        }
        match reduction {
            Reduction::Maximum => world.max_slice(&mut results),
            Reduction::Minimum => world.min_slice(&mut results),
            Reduction::Mean => {
                world.sum_slice(&mut results);
                let total = world.sum(count) as f64;
                results.iter_mut().for_each(|sum| *sum /= total);
            }
        }
        results
    }
}

/// A field at a point, as up to nine numbers: scalars first, vectors by axis, tensors by row.
fn value_of<C: Fields<D, N>, const D: usize, const N: usize>(
    model: &Model<C, D, N>,
    field: PointField,
    p: usize,
) -> [f64; 9] {
    let points = &model.points;
    let mut value = [0.0; 9];
    let vector = |value: &mut [f64; 9], components: &[f64]| value[..components.len()].copy_from_slice(components);
    let tensor = |value: &mut [f64; 9], tensor: Option<Matrix3<f64>>| {
        value.copy_from_slice(tensor.unwrap_or_default().transpose().as_slice());
    };
    match field {
        PointField::Displacement => vector(&mut value, points.displacement[p].as_slice()),
        PointField::Position => vector(&mut value, points.position[p].as_slice()),
        PointField::Chi => value[0] = state_scalar(model, p, "chi"),
        PointField::Damage => value[0] = state_scalar(model, p, "damage"),
        _ => {
            let Observation {
                stress,
                couple_stress,
                wryness,
                rotation,
                twist,
                alpha,
                volume_ratio,
            } = C::observe_fields(&points.motion[p], &points.stress[p]);
            match field {
                PointField::Rotation => vector(&mut value, rotation.unwrap_or_default().as_slice()),
                PointField::TwistX => value[0] = twist.unwrap_or_default().x,
                PointField::TwistY => value[0] = twist.unwrap_or_default().y,
                PointField::TwistZ => value[0] = twist.unwrap_or_default().z,
                PointField::Pressure => value[0] = mean_stress(&stress),
                PointField::VonMises => value[0] = von_mises(&stress),
                PointField::Stress => tensor(&mut value, Some(stress)),
                PointField::CoupleStress => tensor(&mut value, couple_stress),
                PointField::Wryness => tensor(&mut value, wryness),
                PointField::Volume => value[0] = volume_ratio * points.volume[p],
                PointField::Alpha => value[0] = alpha.unwrap_or_default(),
                PointField::Displacement | PointField::Position | PointField::Chi | PointField::Damage => {}
            }
        }
    }
    value
}
