//! One load step as PETSc sees it: residual, tangent and convergence of the increments of the step.

use super::convergence::{DamageNorms, IterationRecord, Norms};
use super::failure::WorstNode;
use super::round_off::{Measured, RoundOff};
use super::settings::SolverSettings;
use crate::assembly::Sink;
use crate::assembly::active::Active;
use crate::assembly::balance::{Balance, StepTerms};
use crate::assembly::kernel::OutOfDomain;
use crate::assembly::model::{Model, StepSystem};
use crate::assembly::surface::ActingConditions;
use crate::condition::dirichlet::Prescribed;
use crate::condition::weak::platen_of;
use crate::continuum::{Fields, Linearisation, UnknownKind};
use crate::grid::words::place;
use crate::interrupt::Interrupt;
use crate::parallel::World;
use crate::petsc::{BlockMatrix, Evaluate, Iteration, Nonlinear, PetscError, PetscInt, Verdict};

/// What residuals of a step are measured by, beside the forces at its end.
pub struct Scales {
    /// Forces of pressures on own unknowns on the shape at the start of the step: part of the scale of forces.
    pub pushed: Vec<f64>,
    pub round_off: RoundOff,
}

/// Is told the number of an iteration, from 1, and the relative residual that it left.
pub type Watch = dyn Fn(usize, f64);

/// The nonlinear problem of one attempt at a step.
pub struct Equilibrium<'a, C: Fields<D, N>, const D: usize, const N: usize> {
    pub world: &'a World,
    pub model: &'a mut Model<C, D, N>,
    pub balance: &'a mut Balance<C, D, N>,
    pub system: &'a StepSystem<D>,
    pub prescribed: &'a Prescribed,
    /// Penalties and pressures at the end of the step.
    pub acting: &'a ActingConditions,
    /// External forces on own unknowns at the end of the step; where the load factor is an unknown, at the last evaluation.
    pub external: Vec<f64>,
    pub scales: &'a Scales,
    pub settings: &'a SolverSettings,
    /// Largest norm of external forces and reactions in the analysis so far.
    pub peak_force: f64,
    /// Reactions on own unknowns where they are prescribed, of the last evaluation; zero elsewhere.
    pub reactions: Vec<f64>,
    pub norms: Norms,
    pub records: Vec<IterationRecord>,
    /// Whether the last test was met by a residual at round-off.
    pub at_round_off: bool,
    /// The residual farthest above its round-off among own unknowns, at the last test above the tolerance.
    pub worst: Option<Measured>,
    /// Why the last evaluation failed, on the rank where it did.
    pub failure: Option<OutOfDomain>,
    /// Whether a rank was asked to stop by the time of the last evaluation; the same on every rank.
    pub interrupted: bool,
    /// Who is told of iterations on this rank.
    pub watch: Option<&'a Watch>,
    interrupt: &'a Interrupt,
    /// Local increments of the last evaluation.
    evaluated: Vec<f64>,
    unassembled: [f64; 2],
}

impl<'a, C: Fields<D, N>, const D: usize, const N: usize> Equilibrium<'a, C, D, N> {
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        world: &'a World,
        model: &'a mut Model<C, D, N>,
        balance: &'a mut Balance<C, D, N>,
        system: &'a StepSystem<D>,
        prescribed: &'a Prescribed,
        acting: &'a ActingConditions,
        external: Vec<f64>,
        scales: &'a Scales,
        settings: &'a SolverSettings,
        peak_force: f64,
        interrupt: &'a Interrupt,
    ) -> Self {
        let reactions = vec![0.0; external.len()];
        Self {
            world,
            model,
            balance,
            system,
            prescribed,
            acting,
            external,
            scales,
            settings,
            peak_force,
            reactions,
            norms: Norms::default(),
            records: Vec::new(),
            at_round_off: false,
            worst: None,
            failure: None,
            interrupted: false,
            watch: None,
            interrupt,
            evaluated: Vec::new(),
            unassembled: [0.0; 2],
        }
    }

    /// All internal forces at local increments; the failure, if any, is common to all ranks.
    fn internal_forces(&mut self, u: &[f64], forces: &mut [f64]) -> Result<(), Evaluate> {
        let terms = self.terms();
        let result = self.balance.add_forces(self.model, &terms, u, forces);
        self.evaluated.clear();
        self.evaluated.extend_from_slice(u);
        self.failure = None;
        match result {
            Ok(unassembled) => self.unassembled = unassembled,
            Err(failure) => self.failure = Some(failure),
        }
        if self.world.any(self.failure.is_some()) {
            self.evaluated.clear();
            return Err(Evaluate::OutOfDomain);
        }
        Ok(())
    }

    fn terms(&self) -> StepTerms<'a, D> {
        StepTerms {
            system: self.system,
            acting: self.acting,
        }
    }

    /// Collective. What becomes of an iteration whose residual is above the tolerance.
    fn not_yet(&mut self, iteration: &Iteration<'_>) -> Verdict {
        if self.evaluated.len() != self.system.active.nodes.len() * N {
            // The last evaluation failed, on every rank: the line search fell back on an earlier one.
            return Verdict::Continue;
        }
        let round_off = &self.scales.round_off;
        let tolerance = self.settings.force_tolerance;
        let excess = round_off.excess::<C, D, N>(self.world, iteration.residual, &self.evaluated);
        self.worst = excess.worst;
        let within = |norm: f64| norm <= tolerance * self.norms.scale(self.peak_force);
        let other_converged = self.norms.damage.relative_residual() < tolerance;
        let at_round_off = other_converged && within(excess.norm);
        let stalls = !at_round_off && self.stalls(iteration);
        self.at_round_off = at_round_off || stalls && other_converged && within(excess.stalled_norm);
        match (self.at_round_off, stalls) {
            (true, _) => Verdict::Converged,
            (false, true) => Verdict::Stagnates,
            (false, false) => Verdict::Continue,
        }
    }

    /// Collective. Where the residual of the last test that was not met is the farthest above its round-off.
    pub fn worst_node(&self) -> Option<WorstNode> {
        let above = self.worst.map_or(f64::NEG_INFINITY, |worst| worst.above());
        let most = self.world.max_of(above);
        let first = self.world.first_where(self.worst.is_some() && above == most)?;
        let own = self.worst.filter(|_| first == self.world.rank());
        let description = own.map_or_else(String::new, |worst| self.describe(&worst));
        let position = own.and_then(|worst| self.position_of(worst.index / N));
        let mut shared = position.map_or([0.0; 4], |[x, y, z]| [1.0, x, y, z]);
        self.world.sum_slice(&mut shared);
        let [found, x, y, z] = shared;
        Some(WorstNode {
            description: self.world.text_from(first, &description),
            position: (found > 0.0).then_some([x, y, z]),
        })
    }

    /// Place of a local node; none of a platen.
    fn position_of(&self, node: usize) -> Option<[f64; 3]> {
        let key = self.system.active.nodes[node];
        let nodes = self.model.nodes();
        platen_of(key).is_none().then(|| nodes.position(&nodes.indices(key)))
    }

    /// A residual with its node and component, in words.
    fn describe(&self, worst: &Measured) -> String {
        let (node, component) = (worst.index / N, worst.index % N);
        let where_it_is = match (platen_of(self.system.active.nodes[node]), self.position_of(node)) {
            (Some(boundary), _) => format!("the platen of {}", self.model.boundaries[boundary].name),
            (None, position) => {
                format!("the node at {}", place(&position.unwrap_or_default()[..D]))
            }
        };
        let unit = if C::IS_TRANSLATION[component] { "N" } else { "N m" };
        format!(
            "{where_it_is}, {}: {:.1e} {unit}, where round-off is about {:.0e} {unit}",
            C::UNKNOWNS[component],
            worst.residual,
            worst.round_off
        )
    }

    /// Collective. Whether iterations go on without getting anywhere: the residual has not fallen for some of them, and what
    /// they change is round-off beside the increments of the step. Residuals that alternate between branches of a law change
    /// more than that; a smaller step may mend them.
    fn stalls(&self, iteration: &Iteration<'_>) -> bool {
        let Some(update) = iteration.update else { return false };
        let (earlier, last) = self
            .records
            .split_at(self.records.len().saturating_sub(STALLED_ITERATIONS));
        let least = |records: &[IterationRecord]| {
            let residuals = records.iter().map(|record| record.force_residual);
            residuals.fold(f64::INFINITY, f64::min)
        };
        if earlier.is_empty() || least(last) < WORTHWHILE_FALL * least(earlier) {
            return false;
        }
        let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let mut sums = [square(update), square(&self.evaluated[..update.len()])];
        self.world.sum_slice(&mut sums);
        sums[0] <= NO_CHANGE.powi(2) * sums[1]
    }

    /// Adds the tangent at local increments `u` to a matrix. With `lift`, adds `K_fc v` of the prescribed increments to it.
    /// Returns whether own points flow on in it that do not flow in the residual.
    pub fn add_tangent(
        &mut self,
        u: &[f64],
        linearisation: Linearisation,
        matrix: &mut BlockMatrix,
        lift: Option<&mut [f64]>,
    ) -> Result<bool, Evaluate> {
        if self.world.any(self.evaluated != u) {
            let mut scratch = vec![0.0; u.len()];
            self.internal_forces(u, &mut scratch)?;
        }
        let active = &self.system.active;
        let mut sink = MatrixSink {
            matrix,
            active,
            unknowns: N,
            prescribed: self.prescribed,
            lift,
            block: Vec::new(),
            indices: Vec::new(),
            failure: None,
        };
        let terms = self.terms();
        let added = self
            .balance
            .add_stiffness(self.model, &terms, u, linearisation, &mut sink);
        let flows_on = added.map_err(|_| Evaluate::OutOfDomain)?;
        sink.finish(active.owned).map(|()| flows_on)
    }
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Nonlinear for Equilibrium<'_, C, D, N> {
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Evaluate> {
        self.internal_forces(u, r)
    }

    fn complete(&mut self, r: &mut [f64]) -> Result<(), Evaluate> {
        let asked_to_stop = f64::from(u8::from(self.interrupt.requested()));
        let mut sums = [0.0, 0.0, 0.0, self.unassembled[0], asked_to_stop];
        let mut damage = [0.0, self.unassembled[1], 0.0];
        for (index, own) in r.iter_mut().enumerate() {
            *own -= self.external[index];
            let constrained = self.prescribed.mask[index];
            self.reactions[index] = if constrained { *own } else { 0.0 };
            if constrained {
                *own = 0.0;
            }
            match C::KIND[index % N] {
                UnknownKind::Damage => damage[0] += *own * *own,
                kind => {
                    sums[usize::from(kind == UnknownKind::Rotation)] += *own * *own;
                    sums[2] += (self.external[index] + self.scales.pushed[index] + self.reactions[index]).powi(2);
                }
            }
        }
        self.world.sum_slice(&mut sums);
        self.norms = Norms::from_sums(&sums);
        self.interrupted = sums[4] > 0.0;
        if has_damage::<C, D, N>() {
            damage[2] = self.model.points.volume.iter().map(|volume| volume * volume).sum();
            self.world.sum_slice(&mut damage);
            let [residual, unassembled, volume] = damage;
            self.norms.damage = DamageNorms {
                residual,
                unassembled,
                volume,
            };
        }
        Ok(())
    }

    fn jacobian(&mut self, u: &[f64], k: &mut BlockMatrix) -> Result<(), Evaluate> {
        self.add_tangent(u, Linearisation::Consistent, k, None).map(drop)
    }

    fn test(&mut self, iteration: &Iteration<'_>) -> Verdict {
        let damage_residual = self.norms.damage.relative_residual();
        let force_residual = self.norms.relative_residual(self.peak_force);
        // What is not a number must not get lost.
        let force_residual = if damage_residual > force_residual || damage_residual.is_nan() {
            damage_residual
        } else {
            force_residual
        };
        let energy_residual = match iteration.update {
            Some(update) => {
                let work = iteration.residual.iter().zip(update).map(|(r, delta)| r * delta);
                let own: f64 = work
                    .enumerate()
                    .filter(|(index, _)| C::KIND[index % N] != UnknownKind::Damage)
                    .map(|(_, work)| work)
                    .sum();
                self.world.sum(own).abs()
            }
            None => f64::NAN,
        };
        if let Some(watch) = self.watch {
            watch(iteration.number + 1, force_residual);
        }
        self.records.push(IterationRecord {
            force_residual,
            energy_residual,
        });
        let energy_converged = self
            .settings
            .energy_tolerance
            .is_some_and(|tolerance| energy_residual < tolerance)
            && damage_residual < self.settings.force_tolerance;
        if force_residual < self.settings.force_tolerance || energy_converged {
            Verdict::Converged
        } else if force_residual.is_finite() && !self.interrupted {
            self.not_yet(iteration)
        } else {
            Verdict::Diverged
        }
    }
}

/// Iterations without progress after which there will be none.
const STALLED_ITERATIONS: usize = 4;

/// Share of an earlier residual below which iterations made progress.
const WORTHWHILE_FALL: f64 = 0.5;

/// Share of the increments of a step below which an iteration changes nothing.
const NO_CHANGE: f64 = 1.0e-7;

/// Number of a row and column that the matrix passes over.
const NOWHERE: PetscInt = -1;

/// Whether there is a nonlocal damage field, whose residual has units of its own.
pub(super) fn has_damage<C: Fields<D, N>, const D: usize, const N: usize>() -> bool {
    C::KIND.contains(&UnknownKind::Damage)
}

/// Hands blocks over to the matrix of PETSc: rows and columns of prescribed unknowns are left out and get a unit
/// diagonal, which is consistent because their values are exact since the opening solve.
struct MatrixSink<'a> {
    matrix: &'a mut BlockMatrix,
    active: &'a Active,
    unknowns: usize,
    prescribed: &'a Prescribed,
    lift: Option<&'a mut [f64]>,
    block: Vec<f64>,
    indices: Vec<PetscInt>,
    failure: Option<PetscError>,
}

impl MatrixSink<'_> {
    /// Adds `K_fc v` of a block to the right-hand side.
    fn add_lift(&mut self, nodes: &[u32], tangent: &[f64]) {
        let (n, prescribed) = (self.unknowns, self.prescribed);
        let Some(lift) = self.lift.as_deref_mut() else { return };
        let width = nodes.len() * n;
        for (column, index) in unknowns_of(nodes, n).enumerate() {
            let value = prescribed.increment[index];
            if !prescribed.mask[index] || value == 0.0 {
                continue;
            }
            for (row, index) in unknowns_of(nodes, n).enumerate() {
                lift[index] += tangent[row * width + column] * value;
            }
        }
    }

    /// Sets the unit diagonal of prescribed unknowns; reports the first failure since the sink was made.
    fn finish(self, owned_nodes: usize) -> Result<(), Evaluate> {
        for index in (0..owned_nodes * self.unknowns).filter(|&index| self.prescribed.mask[index]) {
            let node = self.active.global[index / self.unknowns] as PetscInt;
            self.matrix.add_diagonal(node, index % self.unknowns, 1.0)?;
        }
        self.failure.map_or(Ok(()), |error| Err(error.into()))
    }
}

/// Local unknowns of nodes, in order.
fn unknowns_of(nodes: &[u32], unknowns: usize) -> impl Iterator<Item = usize> {
    nodes
        .iter()
        .flat_map(move |&node| (0..unknowns).map(move |a| node as usize * unknowns + a))
}

impl Sink for MatrixSink<'_> {
    fn add(&mut self, nodes: &[u32], tangent: &[f64]) {
        let width = nodes.len() * self.unknowns;
        self.add_lift(nodes, tangent);
        self.indices.clear();
        self.indices
            .extend(nodes.iter().map(|&node| match self.active.is_detached(node) {
                true => NOWHERE,
                false => self.active.global[node as usize] as PetscInt,
            }));
        let mut values = tangent;
        if unknowns_of(nodes, self.unknowns).any(|index| self.prescribed.mask[index]) {
            self.block.clear();
            self.block.extend_from_slice(tangent);
            for (k, _) in unknowns_of(nodes, self.unknowns)
                .enumerate()
                .filter(|&(_, i)| self.prescribed.mask[i])
            {
                self.block[k * width..(k + 1) * width].fill(0.0);
                self.block
                    .iter_mut()
                    .skip(k)
                    .step_by(width)
                    .for_each(|entry| *entry = 0.0);
            }
            values = &self.block;
        }
        if let Err(error) = self.matrix.add_blocks(&self.indices, &self.indices, values) {
            self.failure.get_or_insert(error);
        }
    }
}
