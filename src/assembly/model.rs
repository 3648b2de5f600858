//! The model in motion: grid, basis, laws, points and what acts on them.

use crate::assembly::active::{Active, ActiveNodes, Platens};
use crate::assembly::kernel::{Workspace, jet};
use crate::assembly::motion::PathPoints;
use crate::assembly::penalty::GhostPenalty;
use crate::assembly::pieces::Pieces;
use crate::assembly::surface::{ActingConditions, Surface, SurfaceConditions, SurfacePoints};
use crate::condition::Time;
use crate::condition::dirichlet::{Boundary, GridPlane, plane_increment};
use crate::condition::load::{DeadLoad, FaceLoad};
use crate::condition::weak::platen_of;
use crate::continuum::{Fields, total_length};
use crate::grid::basis::{self, Basis};
use crate::grid::ghost::GhostFaces;
use crate::grid::{Grid, InitialNodes};
use crate::material::Material;
use crate::parallel::{Numbering, World};
use crate::points::Points;
use crate::points::elements::Elements;
use crate::points::search::{Batches, Misplaced, cells_of_points, search, search_elements};
use nalgebra::{Matrix3, SVector, SymmetricEigen};
use serde::{Deserialize, Serialize};

/// What is solved, as far as this rank holds it.
pub struct Model<C: Fields<D, N>, const D: usize, const N: usize> {
    /// Cells and nodes by number; where `elements` are, they have unit size and no place in space.
    pub grid: Grid<D>,
    /// The grid of the start, on which sets of nodes are defined.
    pub initial_grid: Grid<D>,
    /// Face that follows its prescribed motion.
    pub follow_face: Option<GridPlane>,
    pub basis: Box<dyn Basis>,
    pub laws: Vec<Box<dyn Material<C>>>,
    pub points: Points<C, D>,
    /// The mesh that carries the points instead of the grid.
    pub elements: Option<Elements<D>>,
    pub boundaries: Vec<Boundary>,
    pub loads: Vec<DeadLoad>,
    /// Loads on faces of the mesh.
    pub face_loads: Vec<FaceLoad>,
    /// Penalties and pressures on points.
    pub surface: SurfaceConditions,
    pub ghost: Option<GhostPenalty>,
    /// Points whose motion measures the length of a step, where a stage follows its path.
    pub path_points: Option<PathPoints>,
}

/// What a model carries from step to step beside its points and the nodes of its mesh. Whatever is added to [`Model`]
/// and outlives a step belongs here, since this is what a checkpoint keeps of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelState {
    /// Lower corner of the grid [m].
    pub grid_min: Vec<f64>,
    /// Edges of its cells [m].
    pub cell_size: Vec<f64>,
}

/// Where the points stand on the grid at the start of a step: all that a check needs to know.
pub struct Survey<const D: usize> {
    batches: Batches<D>,
    faces: GhostFaces<D>,
    platens: Platens,
    pub nodes: ActiveNodes,
    /// Cells touched by a domain, on all ranks.
    pub active_cells: u64,
}

/// What the points see of the grid at the start of a step; it does not change while the step is solved.
pub struct StepSystem<const D: usize> {
    pub batches: Batches<D>,
    pub faces: GhostFaces<D>,
    pub active: Active,
    pub surface: SurfacePoints,
    /// Cells touched by a domain, on all ranks.
    pub active_cells: u64,
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Model<C, D, N> {
    /// Collective. Brings all points of a cell to one rank. Returns the cell of each point.
    ///
    /// # Errors
    /// A point whose centre lies outside the grid, known to every rank.
    pub fn gather_cells(&mut self, world: &World) -> Result<Vec<u64>, Misplaced> {
        let cells = agree_on_place(world, self.cells())?;
        if world.size() == 1 {
            return Ok(cells);
        }
        self.points.gather_cells(world, &cells);
        agree_on_place(world, self.cells())
    }

    fn cells(&self) -> Result<Vec<u64>, Misplaced> {
        match &self.elements {
            Some(elements) => Ok(self.points.id.iter().map(|&id| elements.cell(id)).collect()),
            None => cells_of_points(&self.grid, &self.points),
        }
    }

    /// Nodes of the start, by which sets of nodes are found.
    pub fn initial_nodes(&self) -> &dyn InitialNodes<D> {
        match &self.elements {
            Some(elements) => &elements.mesh,
            None => &self.initial_grid,
        }
    }

    /// Nodes as they are now.
    pub fn nodes(&self) -> &dyn InitialNodes<D> {
        match &self.elements {
            Some(elements) => &elements.mesh,
            None => &self.grid,
        }
    }

    /// Collective. Finds supports, penalised faces and the nodes that are active in a stage; sorts the points.
    ///
    /// # Errors
    /// A point that the grid cannot carry, known to every rank.
    pub fn search(&mut self, world: &World, stage: usize) -> Result<StepSystem<D>, Misplaced> {
        let survey = self.survey(world, stage)?;
        Ok(self.complete(world, survey))
    }

    /// Collective. As [`Model::search`], without what only a solution needs: basis values and couplings.
    ///
    /// # Errors
    /// A point that the grid cannot carry, known to every rank.
    pub fn survey(&mut self, world: &World, stage: usize) -> Result<Survey<D>, Misplaced> {
        let batches = match &self.elements {
            Some(elements) => search_elements(elements, &mut self.points),
            None => agree_on_place(world, search(&self.grid, self.basis.as_ref(), &mut self.points))?,
        };
        let touched = batches.touched_cells(&self.grid);
        let faces = match &self.ghost {
            Some(ghost) => GhostFaces::find(world, &self.grid, &touched, ghost.scaling()),
            None => GhostFaces::none(),
        };
        let platens = self.surface.platens(&batches, &self.points, stage);
        let nodes = ActiveNodes::new(world, &self.grid, &batches, &faces, &platens);
        let active_cells = Numbering::new(world, &touched).total as u64;
        Ok(Survey {
            batches,
            faces,
            platens,
            nodes,
            active_cells,
        })
    }

    /// Collective. Pieces of the body that the grid joins.
    pub fn pieces(&self, world: &World, survey: &Survey<D>) -> Pieces {
        Pieces::find(world, &self.grid, &survey.batches, &survey.nodes, &self.points.id)
    }

    /// Collective. What a solution needs beside a survey; the points have histories.
    pub fn complete(&self, world: &World, survey: Survey<D>) -> StepSystem<D> {
        let Survey {
            mut batches,
            faces,
            platens,
            nodes,
            active_cells,
        } = survey;
        let (grid, basis, points) = (&self.grid, self.basis.as_ref(), &self.points);
        match &self.elements {
            Some(elements) => batches.evaluate(|p, support, out| {
                elements.evaluate(points.id[p], support, out);
            }),
            None => batches.evaluate(|p, support, out| {
                basis::evaluate(basis, grid, support, &points.position[p], &points.half_lengths[p], out);
            }),
        }
        let active = Active::new(world, grid, &batches, &faces, &platens, nodes);
        let surface = self.surface.find(grid, basis, &batches, points);
        StepSystem {
            batches,
            faces,
            active,
            surface,
            active_cells,
        }
    }

    /// Gives points that were only placed so far the histories of the initial state, as the laws have it.
    pub fn start_histories(&mut self) {
        let laws = &self.laws;
        let lengths = laws.iter().map(|law| total_length(law.state_variables()));
        let longest = lengths.max().unwrap_or(0);
        self.points
            .start_histories(longest, |material, state| laws[material].initial_state(state));
    }

    /// Moves the face that the grid follows by what was prescribed in a step; stretches the cells of its axis evenly.
    pub fn follow(&mut self, from: Time, to: Time) {
        let Some(face) = self.follow_face else { return };
        let motion = plane_increment(&self.boundaries, face, face.axis, from, to);
        self.grid.move_face(face.axis, face.index > 0, motion);
    }

    /// Stores the gaps that a step leaves between points and platens, at local increments `u`.
    pub fn accept_gaps(&mut self, system: &StepSystem<D>, acting: &ActingConditions, u: &[f64]) {
        let surface = Surface {
            found: &system.surface,
            acting,
            batches: &system.batches,
            active: &system.active,
            points: &self.points,
        };
        self.points.gaps = surface.gaps(u);
    }

    /// Forces of the platens on the points of this rank, by boundary and component, at the accepted gaps.
    pub fn platen_forces(&self, acting: &ActingConditions) -> Vec<[f64; N]> {
        let points = &self.points;
        let mut forces = vec![[0.0; N]; self.boundaries.len()];
        for tie in &acting.ties {
            for p in (0..points.len()).filter(|&p| points.marks[p] >> tie.bit & 1 == 1) {
                forces[tie.boundary][tie.component] -= tie.penalty * points.gaps[p * points.gap_count + tie.slot];
            }
        }
        forces
    }

    /// What the model carries beside points and mesh.
    pub fn state(&self) -> ModelState {
        ModelState {
            grid_min: self.grid.min.to_vec(),
            cell_size: self.grid.cell_size.to_vec(),
        }
    }

    /// Takes over a state of the same scene.
    ///
    /// # Panics
    /// If the state is one of another dimension.
    pub fn restore(&mut self, state: &ModelState) {
        self.grid.min.copy_from_slice(&state.grid_min);
        self.grid.cell_size.copy_from_slice(&state.cell_size);
    }

    /// Collective. Ends a step at local increments `u`, at which the trial stresses and states were evaluated: moves the
    /// points, and the nodes of a mesh; advances motion and domains of the points.
    pub fn accept(
        &mut self,
        world: &World,
        workspace: &mut Workspace<C, D, N>,
        batches: &Batches<D>,
        active: &Active,
        u: &[f64],
    ) {
        for (index, batch) in batches.batches.iter().enumerate() {
            let unknowns = workspace.gather(active.batch_nodes(index), u);
            for p in batch.points.clone() {
                let jet = jet::<D, N>(batches.shapes(batch, p), unknowns);
                for k in 0..D {
                    self.points.position[p][k] += jet.value[k];
                    self.points.displacement[p][k] += jet.value[k];
                }
                if self.points.keeps_last_motion {
                    self.points.last_motion[p] = SVector::from_fn(|k, _| jet.value[k]);
                }
                self.points.motion[p] = C::advance(&self.points.motion[p], &jet);
                if self.basis.has_domains() {
                    let stretch = stretch_diagonal(&C::deformation_gradient(&self.points.motion[p]));
                    self.points.half_lengths[p] =
                        SVector::from_fn(|k, _| stretch[k] * self.points.reference_half_lengths[p][k]);
                }
            }
        }
        self.points.accept_trial();
        if let Some(elements) = &mut self.elements {
            let own = active.nodes[..active.owned].iter().zip(u.chunks_exact(N));
            let own = own.filter(|(key, _)| platen_of(**key).is_none());
            // Translations come first among the unknowns of a node.
            let increments = own.map(|(&key, unknowns)| (key, SVector::from_fn(|k, _| unknowns[k])));
            elements.mesh.advance(world, increments);
        }
    }
}

/// Makes a misplaced point known to every rank.
fn agree_on_place<T>(world: &World, result: Result<T, Misplaced>) -> Result<T, Misplaced> {
    let Some(first) = world.first_where(result.is_err()) else {
        return result;
    };
    let own = result
        .err()
        .map(|misplaced| (misplaced.id, misplaced.body as u64, misplaced.what));
    let speaker = own.filter(|_| world.rank() == first);
    let (id, body, what) = speaker.unwrap_or_default();
    Err(Misplaced {
        id: world.sum(id),
        body: world.sum(body) as usize,
        what: world.text_from(first, &what),
    })
}

/// Diagonal of the symmetric stretch `U = sqrt(F^T F)`: how domains grow along the axes (T 2.29).
fn stretch_diagonal(gradient: &Matrix3<f64>) -> [f64; 3] {
    let eigen = SymmetricEigen::new(gradient.transpose() * gradient);
    std::array::from_fn(|i| {
        (0..3)
            .map(|k| eigen.eigenvectors[(i, k)].powi(2) * eigen.eigenvalues[k].sqrt())
            .sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn domains_stretch_but_do_not_turn() {
        let stretch = Matrix3::new(1.2, 0.1, 0.0, 0.1, 0.9, 0.05, 0.0, 0.05, 1.1);
        let rotation = Rotation3::new(Vector3::new(0.3, -1.2, 0.7));
        let diagonal = stretch_diagonal(&(rotation.matrix() * stretch));
        for (k, length) in diagonal.iter().enumerate() {
            assert!((length - stretch[(k, k)]).abs() < 1e-14);
        }
    }
}
