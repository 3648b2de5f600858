//! Internal forces of a step and their tangent: the sum of all terms, written once, for the solver and for the tests of
//! its derivative alike.

use super::Sink;
use super::kernel::{OutOfDomain, Workspace};
use super::model::{Model, StepSystem};
use super::surface::{ActingConditions, Surface, SurfaceWorkspace};
use crate::clock::Clock;
use crate::continuum::{Fields, Linearisation};
use std::rc::Rc;

/// What is there in a step beside points and unknowns.
#[derive(Clone, Copy)]
pub struct StepTerms<'a, const D: usize> {
    pub system: &'a StepSystem<D>,
    /// Penalties and pressures at the end of the step.
    pub acting: &'a ActingConditions,
}

impl<'a, const D: usize> StepTerms<'a, D> {
    /// Penalties and pressures on the points of a model.
    pub fn surface<C: Fields<D, N>, const N: usize>(&self, model: &'a Model<C, D, N>) -> Surface<'a, C, D, N> {
        Surface {
            found: &self.system.surface,
            acting: self.acting,
            batches: &self.system.batches,
            active: &self.system.active,
            points: &model.points,
        }
    }
}

/// The terms: points, ghost penalty, springs, pressures that follow. Holds their scratch memory.
pub struct Balance<C: Fields<D, N>, const D: usize, const N: usize> {
    pub points: Workspace<C, D, N>,
    surface: SurfaceWorkspace,
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Balance<C, D, N> {
    /// The clock is told what the points are busy with.
    pub fn new(clock: Rc<Clock>) -> Self {
        Self {
            points: Workspace::new(clock),
            surface: SurfaceWorkspace::default(),
        }
    }

    /// Adds this rank's internal forces at local increments `u`; leaves trial stresses and states in the points. Returns
    /// what [`Workspace::add_internal_forces`] does.
    ///
    /// # Errors
    /// A point whose response does not exist there; `forces` are then meaningless.
    pub fn add_forces(
        &mut self,
        model: &mut Model<C, D, N>,
        terms: &StepTerms<'_, D>,
        u: &[f64],
        forces: &mut [f64],
    ) -> Result<[f64; 2], OutOfDomain> {
        let StepSystem {
            batches, faces, active, ..
        } = terms.system;
        let unassembled =
            self.points
                .add_internal_forces(&model.laws, batches, active, &mut model.points, u, forces)?;
        if let Some(ghost) = &model.ghost {
            ghost.add_forces(faces, active, u, forces);
        }
        let surface = terms.surface(model);
        surface.add_tie_forces(u, forces);
        surface.add_pressure_forces(u, 1.0, forces);
        Ok(unassembled)
    }

    /// Adds this rank's tangent at local increments `u`, whose forces were evaluated last. Returns whether points flow on in
    /// it that do not flow in these forces.
    ///
    /// # Errors
    /// A point whose response does not exist there.
    pub fn add_stiffness(
        &mut self,
        model: &Model<C, D, N>,
        terms: &StepTerms<'_, D>,
        u: &[f64],
        linearisation: Linearisation,
        sink: &mut impl Sink,
    ) -> Result<bool, OutOfDomain> {
        let StepSystem {
            batches, faces, active, ..
        } = terms.system;
        let flows_on = self
            .points
            .add_tangent(&model.laws, batches, active, &model.points, u, linearisation, sink)?;
        if let Some(ghost) = &model.ghost {
            ghost.add_stiffness(faces, active, sink);
        }
        let surface = terms.surface(model);
        surface.add_tie_stiffness(&mut self.surface, sink);
        surface.add_pressure_stiffness(u, &mut self.surface, sink);
        Ok(flows_on)
    }
}
