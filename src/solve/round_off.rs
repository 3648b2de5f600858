//! The level of round-off of a residual, and what of a residual is above it.
//!
//! A residual that has come down to this level is zero for all that the machine can tell. Measured by forces alone, a
//! stiff body under a small load would never come to rest: the ratio of the two levels is the precision times modulus
//! over stress.

use crate::assembly::balance::StepTerms;
use crate::assembly::model::{Model, StepSystem};
use crate::assembly::round_off::add_strain_squares;
use crate::assembly::surface::ActingConditions;
use crate::continuum::{Fields, UnknownKind};
use crate::error::Error;
use crate::parallel::World;
use crate::petsc::{GhostVector, Layout, Session};
use std::rc::Rc;

/// Round-off of a strain in units of the machine precision: what the update of the deformation gradient, its polar or
/// spectral decomposition and the law itself add up to. Measured, docs/stability.md, "Round-off".
const STRAIN_ERRORS: f64 = 4.0;

/// A residual that no iteration brings down is at round-off up to so many times that level.
const STALLED_AT_ROUND_OFF: f64 = 16.0;

/// Motions of a step, in lengths over which the basis falls, that round-off is reckoned with. A body that flies off farther
/// is not held, and the size of its increments is no reason to take any residual for zero.
const FARTHEST_MOTION: f64 = 1.0e3;

/// What round-off can make of the residual of own unknowns in a step.
pub struct RoundOff {
    /// Forces that a strain of one would make [N, N m]; none where the residual has units of its own.
    strain: Vec<f64>,
    /// Forces that a gap of one would make [N/m, N].
    springs: Vec<f64>,
    /// Largest sum of gradients of a point [1/m].
    steepest: f64,
}

/// Size of the residual of an unknown beside its round-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Own unknown.
    pub index: usize,
    /// [N, N m]
    pub residual: f64,
    /// [N, N m]
    pub round_off: f64,
}

/// What of a residual is above its round-off.
#[derive(Clone, Copy, Debug)]
pub struct Excess {
    /// Norm of what is above it, over all ranks [N, N m].
    pub norm: f64,
    /// The same above [`STALLED_AT_ROUND_OFF`] times it.
    pub stalled_norm: f64,
    /// Where it is the most, among own unknowns.
    pub worst: Option<Measured>,
}

impl Measured {
    /// What of the residual is above its round-off [N, N m].
    pub fn above(&self) -> f64 {
        self.residual - self.round_off
    }
}

impl RoundOff {
    /// Collective. Of the step from the accepted state of the points.
    pub fn of<C: Fields<D, N>, const D: usize, const N: usize>(
        session: &Rc<Session>,
        layout: &Layout,
        model: &Model<C, D, N>,
        system: &StepSystem<D>,
        acting: &ActingConditions,
    ) -> Result<Self, Error> {
        let StepSystem {
            batches, faces, active, ..
        } = system;
        let mut strain = GhostVector::new(session, layout)?;
        let own = add_strain_squares(&model.laws, batches, active, &model.points, strain.local_mut());
        strain.add_to_owners()?;
        let mut springs = GhostVector::new(session, layout)?;
        let surface = StepTerms { system, acting }.surface(model);
        surface.add_tie_squares(springs.local_mut());
        if let Some(ghost) = &model.ghost {
            ghost.add_squares(faces, active, springs.local_mut());
        }
        springs.add_to_owners()?;
        let root = |squares: &GhostVector| squares.owned().iter().map(|square| square.sqrt()).collect();
        Ok(Self {
            strain: root(&strain),
            springs: root(&springs),
            steepest: session.world().max_of(own),
        })
    }

    /// Round-off of the residual of an own unknown at an increment of its node [m, rad].
    fn at(&self, index: usize, motion: f64) -> f64 {
        let motion = motion.min(FARTHEST_MOTION / self.steepest);
        let strain = self.strain[index] * (1.0 + self.steepest * motion);
        STRAIN_ERRORS * f64::EPSILON * (strain + self.springs[index] * motion)
    }

    /// Collective. What of the residual of forces and couples on own unknowns is above round-off.
    pub fn excess<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        world: &World,
        residual: &[f64],
        increments: &[f64],
    ) -> Excess {
        let mut squares = [0.0; 2];
        let mut worst: Option<Measured> = None;
        for own in self.measured::<C, D, N>(residual, increments) {
            for (square, times) in squares.iter_mut().zip([1.0, STALLED_AT_ROUND_OFF]) {
                *square += (own.residual - times * own.round_off).max(0.0).powi(2);
            }
            if worst.is_none_or(|worst| own.above() > worst.above()) {
                worst = Some(own);
            }
        }
        world.sum_slice(&mut squares);
        let [norm, stalled_norm] = squares.map(f64::sqrt);
        Excess {
            norm,
            stalled_norm,
            worst,
        }
    }

    /// Residuals of forces and couples with their round-off.
    fn measured<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        residual: &[f64],
        increments: &[f64],
    ) -> impl Iterator<Item = Measured> {
        let nodes = residual.chunks_exact(N).zip(increments.chunks_exact(N)).enumerate();
        nodes.flat_map(move |(node, (residual, increment))| {
            let motion = increment
                .iter()
                .zip(C::KIND)
                .filter(|(_, kind)| *kind != UnknownKind::Damage)
                .fold(0.0f64, |most, (increment, _)| most.max(increment.abs()));
            residual
                .iter()
                .enumerate()
                .filter(|(a, _)| C::KIND[*a] != UnknownKind::Damage)
                .map(move |(a, residual)| {
                    let index = node * N + a;
                    Measured {
                        index,
                        residual: residual.abs(),
                        round_off: self.at(index, motion),
                    }
                })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_off_grows_with_the_motion_but_not_for_a_body_that_flies_off() {
        let of = |steepest| RoundOff {
            strain: vec![1.0e9],
            springs: vec![0.0],
            steepest,
        };
        let unit = STRAIN_ERRORS * f64::EPSILON * 1.0e9;
        assert!((of(8.0).at(0, 0.0) / unit - 1.0).abs() < 1e-15);
        assert!((of(8.0).at(0, 2.0) / unit - 17.0).abs() < 1e-13);
        assert!((of(8.0).at(0, 1.0e11) / unit - 1.0 - FARTHEST_MOTION).abs() < 1e-10);
        // No points on any rank.
        assert!((of(0.0).at(0, 1.0) / unit - 1.0).abs() < 1e-15);
    }
}
