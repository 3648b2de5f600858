//! The kernel over one batch of points: the only hot loop.
//!
//! All points of a batch share their nodes, so that unknowns are gathered once and residual and tangent leave in one
//! piece. With generalised strains `e = (value, gradient)` and their conjugates `s`:
//!
//! $$ r_I = \sum_p V_0 (S_I\,s_0 + \nabla S_I \cdot s), \qquad K_{IJ} = \sum_p V_0 B_I^T \frac{\partial s}{\partial e} B_J $$
//!
//! The residual leaves trial stresses and states in the points; the tangent starts from them.

use super::Sink;
use super::active::Active;
use crate::clock::{Clock, Phase};
use crate::continuum::{Fields, Flux, Jet, Linearisation, Tangent, UnknownKind};
use crate::material::{Material, NoSolution};
use crate::points::Points;
use crate::points::search::{Batch, Batches};
use std::rc::Rc;

/// A point whose response does not exist at a trial state, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct OutOfDomain {
    pub id: u64,
    pub what: &'static str,
    /// Norm of the residual where the law's own iteration ended [-]; `None` where the motion is impossible.
    pub residual: Option<f64>,
    /// Norm of the gradient that the increments have at the point [-].
    pub gradient: f64,
}

/// Scratch memory for batches of any size: grown when a batch is larger than any before, never allocated per point.
pub struct Workspace<C: Fields<D, N>, const D: usize, const N: usize> {
    unknowns: Vec<f64>,
    residual: Vec<f64>,
    tangent: Vec<f64>,
    /// Products of the tangent of one point with the basis: `(1 + D) N` rows over (node, unknown).
    products: Vec<f64>,
    strains: Vec<C::Strain>,
    frames: Vec<C::Frame>,
    tangents: Vec<Tangent<D, N>>,
    moduli: C::Moduli,
    clock: Rc<Clock>,
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Workspace<C, D, N> {
    /// Empty scratch memory; the clock is told what the kernel is busy with.
    pub fn new(clock: Rc<Clock>) -> Self {
        Self {
            unknowns: Vec::new(),
            residual: Vec::new(),
            tangent: Vec::new(),
            products: Vec::new(),
            strains: Vec::new(),
            frames: Vec::new(),
            tangents: Vec::new(),
            moduli: C::Moduli::default(),
            clock,
        }
    }
}

/// Increments of the unknowns and their gradients at a point, from those of its nodes.
pub fn jet<const D: usize, const N: usize>(shapes: &[f64], unknowns: &[f64]) -> Jet<D, N> {
    let mut jet = Jet::zero();
    for (shape, node) in shapes.chunks_exact(1 + D).zip(unknowns.chunks_exact(N)) {
        for (a, unknown) in node.iter().enumerate() {
            jet.value[a] += shape[0] * unknown;
            for k in 0..D {
                jet.gradient[(a, k)] += shape[1 + k] * unknown;
            }
        }
    }
    jet
}

/// Norm of the gradient of all unknowns.
fn steepness<const D: usize, const N: usize>(jet: &Jet<D, N>) -> f64 {
    jet.gradient.norm()
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Workspace<C, D, N> {
    /// Gathers the unknowns of a batch from the local ones.
    pub fn gather(&mut self, nodes: &[u32], u: &[f64]) -> &[f64] {
        self.unknowns.clear();
        for &node in nodes {
            self.unknowns.extend_from_slice(&u[node as usize * N..][..N]);
        }
        &self.unknowns
    }

    fn kinematics(&mut self, batches: &Batches<D>, batch: &Batch<D>, points: &Points<C, D>) -> Result<(), OutOfDomain> {
        self.strains.clear();
        self.frames.clear();
        for p in batch.points.clone() {
            let jet = jet(batches.shapes(batch, p), &self.unknowns);
            let Some((strain, frame)) = C::strain(&points.motion[p], &jet) else {
                let what = "the step turns the point by more than pi or its volume inside out";
                return Err(OutOfDomain {
                    id: points.id[p],
                    what,
                    residual: None,
                    gradient: steepness(&jet),
                });
            };
            self.strains.push(strain);
            self.frames.push(frame);
        }
        Ok(())
    }

    /// Adds the internal forces at local increments `u`; leaves trial stresses and states in the points. Returns sums
    /// of squares of what the batches add, the scale of what cancels: of forces and couples, and of the equation of a
    /// nonlocal damage field.
    pub fn add_internal_forces(
        &mut self,
        laws: &[Box<dyn Material<C>>],
        batches: &Batches<D>,
        active: &Active,
        points: &mut Points<C, D>,
        u: &[f64],
        forces: &mut [f64],
    ) -> Result<[f64; 2], OutOfDomain> {
        let mut scale = [0.0; 2];
        let clock = self.clock.clone();
        let _kernel = clock.enter(Phase::Constitutive);
        for (index, batch) in batches.batches.iter().enumerate() {
            clock.switch(Phase::Constitutive);
            let nodes = active.batch_nodes(index);
            self.gather(nodes, u);
            self.kinematics(batches, batch, points)?;
            self.respond(laws, batch, batches, points)?;
            clock.switch(Phase::Assembly);
            self.residual.clear();
            self.residual.resize(nodes.len() * N, 0.0);
            for (p, frame) in batch.points.clone().zip(&self.frames) {
                let flux = C::flux(frame, &points.trial_stress[p]);
                add_forces(&flux, points.volume[p], batches.shapes(batch, p), &mut self.residual);
            }
            for (&node, own) in nodes.iter().zip(self.residual.chunks_exact(N)) {
                forces[node as usize * N..][..N]
                    .iter_mut()
                    .zip(own)
                    .for_each(|(sum, force)| *sum += force);
                for (force, kind) in own.iter().zip(C::KIND) {
                    scale[usize::from(kind == UnknownKind::Damage)] += force * force;
                }
            }
        }
        Ok(scale)
    }

    fn respond(
        &mut self,
        laws: &[Box<dyn Material<C>>],
        batch: &Batch<D>,
        batches: &Batches<D>,
        points: &mut Points<C, D>,
    ) -> Result<(), OutOfDomain> {
        let length = points.state_length;
        let shapes = |p: usize| batches.shapes(batch, p);
        for (p, strain) in batch.points.clone().zip(&self.strains) {
            let state = p * length..(p + 1) * length;
            laws[points.material[p] as usize]
                .respond(
                    strain,
                    &points.state[state.clone()],
                    &mut points.trial_state[state],
                    &mut points.trial_stress[p],
                )
                .map_err(|NoSolution { what, residual }| OutOfDomain {
                    id: points.id[p],
                    what,
                    residual: Some(residual),
                    gradient: steepness(&jet::<D, N>(shapes(p), &self.unknowns)),
                })?;
        }
        Ok(())
    }

    /// Adds the tangent at local increments `u`, whose internal forces were evaluated last. Returns whether points flow on
    /// in it that do not flow in these forces.
    #[allow(clippy::too_many_arguments)]
    pub fn add_tangent(
        &mut self,
        laws: &[Box<dyn Material<C>>],
        batches: &Batches<D>,
        active: &Active,
        points: &Points<C, D>,
        u: &[f64],
        linearisation: Linearisation,
        sink: &mut impl Sink,
    ) -> Result<bool, OutOfDomain> {
        let clock = self.clock.clone();
        let _kernel = clock.enter(Phase::Constitutive);
        let mut flows_on = false;
        for (index, batch) in batches.batches.iter().enumerate() {
            clock.switch(Phase::Constitutive);
            let nodes = active.batch_nodes(index);
            self.gather(nodes, u);
            self.kinematics(batches, batch, points)?;
            flows_on |= self.differentiate(laws, batch, points, linearisation);
            clock.switch(Phase::Assembly);
            let width = nodes.len() * N;
            self.tangent.clear();
            self.tangent.resize(width * width, 0.0);
            self.products.resize((1 + D) * N * width, 0.0);
            for (p, tangent) in batch.points.clone().zip(&self.tangents) {
                let shapes = batches.shapes(batch, p);
                multiply(tangent, points.volume[p], shapes, &mut self.products);
                add_tangent::<D, N>(&self.products, shapes, &mut self.tangent);
            }
            sink.add(nodes, &self.tangent);
        }
        Ok(flows_on)
    }

    fn differentiate(
        &mut self,
        laws: &[Box<dyn Material<C>>],
        batch: &Batch<D>,
        points: &Points<C, D>,
        linearisation: Linearisation,
    ) -> bool {
        let mut flows_on = false;
        let length = points.state_length;
        self.tangents
            .resize(self.tangents.len().max(batch.points.len()), Tangent::zero());
        for (local, p) in batch.points.clone().enumerate() {
            let state = p * length..(p + 1) * length;
            let stress = &points.trial_stress[p];
            let law = &laws[points.material[p] as usize];
            let (old, new) = (&points.state[state.clone()], &points.trial_state[state]);
            let (strain, moduli) = (&self.strains[local], &mut self.moduli);
            match linearisation {
                Linearisation::Consistent => law.moduli(strain, old, new, stress, moduli),
                Linearisation::Opening => flows_on |= law.opening_moduli(strain, old, new, stress, moduli),
            }
            C::tangent(&self.frames[local], stress, &self.moduli, &mut self.tangents[local]);
        }
        flows_on
    }
}

/// Adds the nodal forces of one point.
fn add_forces<const D: usize, const N: usize>(flux: &Flux<D, N>, volume: f64, shapes: &[f64], forces: &mut [f64]) {
    for (shape, node) in shapes.chunks_exact(1 + D).zip(forces.chunks_exact_mut(N)) {
        for (a, force) in node.iter_mut().enumerate() {
            let along: f64 = (0..D).map(|k| flux.flux[(a, k)] * shape[1 + k]).sum();
            *force += volume * (shape[0] * flux.source[a] + along);
        }
    }
}

/// `products = V0 A B`: row `s N + a` is the derivative of conjugate `a` of the source (`s = 0`) or of the flux along
/// `s - 1` with respect to every unknown of every node.
fn multiply<const D: usize, const N: usize>(
    tangent: &Tangent<D, N>,
    volume: f64,
    shapes: &[f64],
    products: &mut [f64],
) {
    let width = products.len() / ((1 + D) * N);
    for s in 0..=D {
        let by_value = if s == 0 {
            &tangent.source_value
        } else {
            &tangent.flux_value[s - 1]
        };
        let by_gradient = if s == 0 {
            &tangent.source_gradient
        } else {
            &tangent.flux_gradient[s - 1]
        };
        for a in 0..N {
            let row = &mut products[(s * N + a) * width..][..width];
            for (shape, entries) in shapes.chunks_exact(1 + D).zip(row.chunks_exact_mut(N)) {
                for (b, entry) in entries.iter_mut().enumerate() {
                    let mut sum = by_value[(a, b)] * shape[0];
                    for k in 0..D {
                        sum += by_gradient[k][(a, b)] * shape[1 + k];
                    }
                    *entry = volume * sum;
                }
            }
        }
    }
}

/// `tangent += B^T products`, row by row.
fn add_tangent<const D: usize, const N: usize>(products: &[f64], shapes: &[f64], tangent: &mut [f64]) {
    let width = products.len() / ((1 + D) * N);
    for (shape, rows) in shapes.chunks_exact(1 + D).zip(tangent.chunks_exact_mut(N * width)) {
        for (a, row) in rows.chunks_exact_mut(width).enumerate() {
            let source = &products[a * width..][..width];
            row.iter_mut()
                .zip(source)
                .for_each(|(sum, product)| *sum += shape[0] * product);
            for k in 0..D {
                let flux = &products[((1 + k) * N + a) * width..][..width];
                row.iter_mut()
                    .zip(flux)
                    .for_each(|(sum, product)| *sum += shape[1 + k] * product);
            }
        }
    }
}
