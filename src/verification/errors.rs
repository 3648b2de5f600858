//! How far a run is from its manufactured solution.

use super::manufactured::Solution;
use crate::continuum::Fields;
use crate::parallel::World;
use crate::points::Points;
use crate::points::select::in_space;
use nalgebra::Vector3;

/// Error norms, integrals over the reference volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Of the displacement [m4] (T 3.187).
    pub displacement: f64,
    /// Of the rotation vector [rad m3] (T 3.187).
    pub rotation: f64,
    /// Of the Cauchy stress, relative to its exact norm at each point [m3] (T 3.188).
    pub stress: f64,
    /// Of the couple-stress, likewise (T 3.188).
    pub couple_stress: f64,
}

/// Collective. Error norms of the accepted state, with reference volumes as weights. Those of the stresses are not finite
/// where a point lies at an exact zero of the stress, as none of Gauss' points with two an axis do.
pub fn errors<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    points: &Points<C, D>,
    solution: &Solution,
) -> Errors {
    let mut sums = [0.0; 4];
    for p in 0..points.len() {
        let own = at_point(points, solution, p);
        sums.iter_mut()
            .zip(own)
            .for_each(|(sum, own)| *sum += points.volume[p] * own);
    }
    world.sum_slice(&mut sums);
    let [displacement, rotation, stress, couple_stress] = sums;
    Errors {
        displacement,
        rotation,
        stress,
        couple_stress,
    }
}

fn at_point<C: Fields<D, N>, const D: usize, const N: usize>(
    points: &Points<C, D>,
    solution: &Solution,
    p: usize,
) -> [f64; 4] {
    let displacement = Vector3::from(in_space(&points.displacement[p]));
    let exact = solution.exact(&Vector3::from(points.reference_position(p)));
    let seen = C::observe_fields(&points.motion[p], &points.stress[p]);
    let rotation = seen.rotation.unwrap_or_default();
    let couple_stress = seen.couple_stress.unwrap_or_default();
    [
        (displacement - exact.displacement).norm(),
        (rotation - exact.rotation).norm(),
        (seen.stress - exact.stress).norm() / exact.stress.norm(),
        (couple_stress - exact.couple_stress).norm() / exact.couple_stress.norm(),
    ]
}
