//! What a snapshot shows of the points.

use crate::assembly::model::Model;
use crate::continuum::{Fields, Observation, UnknownKind};
use crate::output::{PointField, PointValues};
use crate::points::select::in_space;
use nalgebra::{Matrix3, Vector3};

/// Mean stress `tr sigma / 3`, positive in tension.
pub fn mean_stress(stress: &Matrix3<f64>) -> f64 {
    stress.trace() / 3.0
}

/// Von Mises stress `sqrt(3/2 s : s)` of the symmetric part.
pub fn von_mises(stress: &Matrix3<f64>) -> f64 {
    let symmetric = 0.5 * (stress + stress.transpose());
    (1.5f64).sqrt() * (symmetric - Matrix3::identity() * mean_stress(stress)).norm()
}

/// A state variable of one number, such as the equivalent plastic strain `chi`; zero for laws without.
pub fn state_scalar<C: Fields<D, N>, const D: usize, const N: usize>(
    model: &Model<C, D, N>,
    p: usize,
    name: &str,
) -> f64 {
    let variables = model.laws[model.points.material[p] as usize].state_variables();
    let mut offset = 0;
    for variable in variables {
        if variable.name == name {
            return model.points.state_of(p)[offset];
        }
        offset += variable.length;
    }
    0.0
}

/// Positions and fields of the points of this rank.
pub fn fields<C: Fields<D, N>, const D: usize, const N: usize>(
    model: &Model<C, D, N>,
) -> (Vec<[f64; 3]>, Vec<PointField>) {
    let points = &model.points;
    let observed: Vec<Observation> = (0..points.len())
        .map(|p| C::observe_fields(&points.motion[p], &points.stress[p]))
        .collect();
    let vectors = |of: &dyn Fn(&Observation) -> Option<Vector3<f64>>| {
        PointValues::Vector(
            observed
                .iter()
                .map(|seen| of(seen).unwrap_or_default().into())
                .collect(),
        )
    };
    let tensors = |of: &dyn Fn(&Observation) -> Option<Matrix3<f64>>| {
        let rows = |tensor: Matrix3<f64>| std::array::from_fn(|k| tensor[(k / 3, k % 3)]);
        PointValues::Tensor(observed.iter().map(|seen| rows(of(seen).unwrap_or_default())).collect())
    };
    let scalars = |of: &dyn Fn(usize) -> f64| PointValues::Scalar((0..points.len()).map(of).collect());
    let mut fields = vec![
        PointField {
            name: "displacement",
            values: PointValues::Vector(points.displacement.iter().map(in_space).collect()),
        },
        PointField {
            name: "volume",
            values: scalars(&|p| observed[p].volume_ratio * points.volume[p]),
        },
        PointField {
            name: "half_lengths",
            values: PointValues::Vector(points.half_lengths.iter().map(in_space).collect()),
        },
        PointField {
            name: "stress",
            values: tensors(&|seen| Some(seen.stress)),
        },
        PointField {
            name: "pressure",
            values: scalars(&|p| mean_stress(&observed[p].stress)),
        },
        PointField {
            name: "von_mises",
            values: scalars(&|p| von_mises(&observed[p].stress)),
        },
        PointField {
            name: "chi",
            values: scalars(&|p| state_scalar(model, p, "chi")),
        },
    ];
    if C::IS_TRANSLATION.contains(&false) {
        fields.push(PointField {
            name: "couple_stress",
            values: tensors(&|seen| seen.couple_stress),
        });
        fields.push(PointField {
            name: "wryness",
            values: tensors(&|seen| seen.wryness),
        });
        fields.push(PointField {
            name: "rotation",
            values: vectors(&|seen| seen.rotation),
        });
    }
    if C::KIND.contains(&UnknownKind::Damage) {
        fields.push(PointField {
            name: "alpha",
            values: scalars(&|p| observed[p].alpha.unwrap_or_default()),
        });
        fields.push(PointField {
            name: "damage",
            values: scalars(&|p| state_scalar(model, p, "damage")),
        });
    }
    (points.position.iter().map(in_space).collect(), fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn von_mises_of_uniaxial_stress_is_the_stress() {
        let stress = Matrix3::from_diagonal(&Vector3::new(-3.0, 0.0, 0.0));
        assert!((von_mises(&stress) - 3.0).abs() < 1e-15);
        assert_eq!(mean_stress(&stress), -1.0);
    }
}
