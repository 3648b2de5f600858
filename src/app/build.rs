//! The model of a scene: points, laws, conditions; and what only shows once points and grid meet.

use super::advice::{advice, estimates};
use super::columns::Column;
use super::inspect::{Inspection, inspect};
use super::need;
use super::{Laws, Process};
use crate::assembly::Sink;
use crate::assembly::kernel::Workspace;
use crate::assembly::model::{Model, Survey};
use crate::assembly::motion::PathPoints;
use crate::assembly::penalty::GhostPenalty;
use crate::assembly::surface::SurfaceConditions;
use crate::clock::Clock;
use crate::condition::dirichlet::Place;
use crate::condition::load::{Amount, DeadLoad, FaceLoad, LoadField};
use crate::condition::pressure::{Patch, Pressure, Side};
use crate::condition::weak::{slots, ties};
use crate::config::Source;
use crate::console;
use crate::continuum::{Fields, Linearisation};
use crate::error::Error;
use crate::grid::Grid;
use crate::grid::mesh::MeshFace;
use crate::material::Components;
use crate::parallel::World;
use crate::points::elements::Elements;
use crate::points::search::Misplaced;
use crate::points::seed::{PointSource, seed};
use crate::points::select::MAX_SELECTIONS;
use crate::points::select::Selection;
use crate::problem::Problem;
use crate::scene::{HistoryColumn, HistoryQuantity, Load, LoadKind, Scene, Target};
use crate::verification::Solution;
use nalgebra::Vector3;
use std::rc::Rc;

/// A model in its initial state, its points without histories, with facts for header, check and history.
pub struct Built<C: Fields<D, N>, const D: usize, const N: usize> {
    pub model: Model<C, D, N>,
    pub columns: Vec<Column>,
    pub points: u64,
    pub points_per_body: Vec<u64>,
    pub active_cells: u64,
    pub nodes: usize,
    /// Keys of the active nodes that this rank owns.
    pub own_nodes: Vec<u64>,
    pub warnings: Vec<String>,
}

/// Collective. Builds the model of a scene.
///
/// # Errors
/// Everything that is wrong with the scene where points and grid meet, in one list.
pub fn build<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    process: &Process,
) -> Result<Built<C, D, N>, Error> {
    let (mut model, points_per_body, scarce) = unloaded(world, scene, source)?;
    let mut warnings = source.warnings.clone();
    warnings.extend(scarce);
    process.go_on(world)?;
    let mut problems = empty_bodies(source, &points_per_body);
    let columns = select(world, scene, source, &mut model, &mut problems);
    if let Some(manufactured) = &scene.manufactured {
        let solution = Solution::new(manufactured, D);
        model
            .loads
            .push(manufactured_load(solution, C::IS_TRANSLATION.to_vec()));
    }
    let survey = match locate(world, source, &mut model) {
        Ok(survey) => survey,
        Err(problem) => {
            problems.push(problem);
            return Err(Error::Configuration(problems));
        }
    };
    process.go_on(world)?;
    let (active_cells, nodes, own_nodes) = (survey.active_cells, survey.nodes.total(), survey.nodes.own().to_vec());
    warnings.extend(check_boundaries(
        world,
        scene,
        source,
        &model,
        &own_nodes,
        &mut problems,
    ));
    let inspection = Inspection {
        world,
        scene,
        source,
        model: &model,
        survey: &survey,
    };
    let found = inspect(&inspection, !problems.is_empty());
    problems.extend(found.problems);
    warnings.extend(found.warnings);
    warnings.extend(check_penalties(world, scene, source, &mut model, survey, &mut problems));
    if !problems.is_empty() {
        return Err(Error::Configuration(problems));
    }
    Ok(Built {
        model,
        columns,
        points: points_per_body.iter().sum(),
        points_per_body,
        active_cells,
        nodes,
        own_nodes,
        warnings,
    })
}

/// Grid, points and laws without loads and selections, the number of points of each body, and a warning about memory.
type Unloaded<C, const D: usize, const N: usize> = (Model<C, D, N>, Vec<u64>, Option<String>);

/// Collective. The model before anything acts on it.
///
/// # Errors
/// More points or unknowns than there is memory for.
fn unloaded<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
) -> Result<Unloaded<C, D, N>, Error> {
    let components = if D == 2 { Components::Plane } else { Components::Space };
    let laws: Vec<_> = scene
        .materials
        .iter()
        .map(|material| C::law(&material.spec, components))
        .collect();
    let settings = &scene.grid;
    let basis = settings.basis.functions();
    let grid = Grid {
        min: std::array::from_fn(|k| settings.min[k]),
        cell_size: std::array::from_fn(|k| settings.cell_size[k]),
        cells: std::array::from_fn(|k| settings.cells[k]),
        order: basis.order(),
    };
    let scarce = need::check(world, scene, source, &grid, &laws)?;
    let (points, points_per_body) = seed(world, &grid, &scene.bodies, &scene.regions);
    let ghost = scene.ghost.as_ref().map(|ghost| GhostPenalty::new(ghost, &C::KIND));
    let model = Model {
        initial_grid: grid.clone(),
        follow_face: settings.follow_face,
        grid,
        basis,
        laws,
        points,
        elements: elements(scene),
        boundaries: scene.boundaries.clone(),
        loads: Vec::new(),
        face_loads: Vec::new(),
        surface: SurfaceConditions::default(),
        ghost,
        path_points: None,
    };
    Ok((model, points_per_body, scarce))
}

/// The mesh of the scene, which is that of its only body.
fn elements<const D: usize>(scene: &Scene) -> Option<Elements<D>> {
    scene.bodies.iter().find_map(|body| match &body.points {
        PointSource::Mesh(settings) => Some(Elements::new(settings)),
        PointSource::Lattice { .. } | PointSource::List(_) => None,
    })
}

fn empty_bodies(source: &Source, points_per_body: &[u64]) -> Vec<Problem> {
    let empty = points_per_body.iter().enumerate().filter(|&(_, &count)| count == 0);
    empty
        .map(|(body, _)| {
            let message = "the body has no material points: its shape holds the centre of none";
            source.problem(
                &format!("bodies[{body}]"),
                message,
                "a shape that fills at least part of a cell; smaller cells or more points_per_cell",
            )
        })
        .collect()
}

/// Marks of the points for the selections of a scene; equal selections share one.
struct Marks<'a> {
    world: &'a World,
    scene: &'a Scene,
    source: &'a Source,
    /// Selection of each bit, with the number of its points.
    used: Vec<(Selection, u64)>,
    /// Marks of the points that each load acts on, for the loads seen so far; `None` for all points.
    of_load: Vec<Option<u64>>,
}

impl Marks<'_> {
    /// Bit and number of points of a selection that stands at a path of the file.
    fn of<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &mut Model<C, D, N>,
        selection: &Selection,
        path: &str,
        problems: &mut Vec<Problem>,
    ) -> (usize, u64) {
        if let Some(bit) = self.used.iter().position(|(known, _)| known == selection) {
            return (bit, self.used[bit].1);
        }
        let bit = self.used.len();
        if bit == MAX_SELECTIONS {
            let expected = format!("at most {MAX_SELECTIONS} that differ");
            problems.push(self.source.problem(path, "too many selections", expected));
            return (0, 1);
        }
        let edge = model.initial_nodes().smallest_edge();
        let lattice = (&model.initial_grid, &self.scene.bodies[..]);
        let count = model
            .points
            .mark(self.world, selection, bit, |load| self.of_load[load], lattice, edge);
        // What a load lacks has been told of the load.
        if count == 0 && !matches!(selection, Selection::Load(_)) {
            let message = "the selection holds no material point";
            let problem = self.source.problem(path, message, "a selection with at least one");
            // A surface is a selection for each side.
            if !problems.contains(&problem) {
                problems.push(problem);
            }
        }
        self.used.push((selection.clone(), count.max(1)));
        (bit, count.max(1))
    }
}

/// Turns selections into marks of the points: those of loads, of conditions and of history columns.
fn select<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    model: &mut Model<C, D, N>,
    problems: &mut Vec<Problem>,
) -> Vec<Column> {
    let mut marks = Marks {
        world,
        scene,
        source,
        used: Vec::new(),
        of_load: Vec::new(),
    };
    for (index, load) in scene.loads.iter().enumerate() {
        if let Some(pressure) = pressure_of(load, &format!("loads[{index}].at"), &mut marks, model, problems) {
            let all = pressure.patches.iter().fold(0, |all, patch| all | 1 << patch.bit);
            marks.of_load.push(Some(all));
            model.surface.pressures.push(pressure);
            continue;
        }
        let (bit, count) = match selection_of(load) {
            Some(selection) => {
                let (bit, count) = marks.of(model, selection, &format!("loads[{index}].at"), problems);
                (Some(bit), count)
            }
            None => (None, 1),
        };
        marks.of_load.push(bit.map(|bit| 1 << bit));
        match face_load(model, load) {
            Some(load) => model.face_loads.push(load),
            None => model.loads.extend(dead_load(load, bit, count, &C::IS_TRANSLATION, D)),
        }
    }
    tie(scene, &mut marks, model, problems);
    follow_path(scene, &mut marks, model, problems);
    let column_of = |(index, entry): (usize, &HistoryColumn)| {
        let path = format!("output.history[{index}].at");
        let bit = match &entry.quantity {
            HistoryQuantity::Points {
                at: Some(selection), ..
            } => Some(marks.of(model, selection, &path, problems).0),
            _ => None,
        };
        let face = match &entry.quantity {
            HistoryQuantity::FaceMean { face, .. } => face_shares(model, *face),
            _ => None,
        };
        Column {
            entry: entry.clone(),
            bit,
            face: face.unwrap_or_default(),
        }
    };
    scene.output.history.iter().enumerate().map(column_of).collect()
}

/// A pressure with marks for each part of its surface, where the load is one.
fn pressure_of<C: Fields<D, N>, const D: usize, const N: usize>(
    load: &Load,
    path: &str,
    marks: &mut Marks<'_>,
    model: &mut Model<C, D, N>,
    problems: &mut Vec<Problem>,
) -> Option<Pressure> {
    let LoadKind::Pressure { pressure, at } = &load.kind else {
        return None;
    };
    let patch = |(selection, side): &(Selection, Side)| Patch {
        bit: marks.of(model, selection, path, problems).0,
        side: *side,
    };
    Some(Pressure {
        stage: load.stage,
        pressure: *pressure,
        patches: at.iter().map(patch).collect(),
    })
}

/// Marks the points that conditions hold, and ties them to their platens.
fn tie<C: Fields<D, N>, const D: usize, const N: usize>(
    scene: &Scene,
    marks: &mut Marks<'_>,
    model: &mut Model<C, D, N>,
    problems: &mut Vec<Problem>,
) {
    let mut bits = vec![0; scene.boundaries.len()];
    for (index, boundary) in scene.boundaries.iter().enumerate() {
        if let Place::Points(held) = &boundary.place {
            let path = format!("boundary[{index}].selection");
            bits[index] = marks.of(model, &held.selection, &path, problems).0;
        }
    }
    model.surface.ties = ties(&scene.boundaries, |boundary| bits[boundary]);
    model.points.keep_gaps(slots(&model.surface.ties));
}

/// Marks the points whose motion is the length of a step, where a stage follows its path.
fn follow_path<C: Fields<D, N>, const D: usize, const N: usize>(
    scene: &Scene,
    marks: &mut Marks<'_>,
    model: &mut Model<C, D, N>,
    problems: &mut Vec<Problem>,
) {
    let controls = scene.stages.iter().enumerate();
    let control = controls
        .filter_map(|(index, stage)| Some((index, stage.control.as_ref()?)))
        .next();
    let Some((index, control)) = control else { return };
    let path = format!("stages[{index}].control.arc_length.at");
    let at = control.at.as_ref();
    model.path_points = Some(PathPoints {
        bit: at.map(|selection| marks.of(model, selection, &path, problems).0),
    });
    model.points.keep_last_motion();
}

fn selection_of(load: &Load) -> Option<&Selection> {
    match &load.kind {
        LoadKind::Force {
            at: Target::Points(selection),
            ..
        }
        | LoadKind::Couple {
            at: Target::Points(selection),
            ..
        } => Some(selection),
        _ => None,
    }
}

/// Nodes of a face of the mesh with their shares.
fn face_shares<C: Fields<D, N>, const D: usize, const N: usize>(
    model: &Model<C, D, N>,
    face: MeshFace,
) -> Option<Vec<(u64, f64)>> {
    model.elements.as_ref().map(|elements| elements.mesh.face_shares(face))
}

/// A load on a face of the mesh, where the load is one.
fn face_load<C: Fields<D, N>, const D: usize, const N: usize>(model: &Model<C, D, N>, load: &Load) -> Option<FaceLoad> {
    let (total, translations, at) = match &load.kind {
        LoadKind::SpecificWeight(_) | LoadKind::Pressure { .. } => return None,
        LoadKind::Force { total, at } => (total, true, at),
        LoadKind::Couple { total, at } => (total, false, at),
    };
    let Target::Face(face) = at else { return None };
    Some(FaceLoad {
        stage: load.stage,
        total: by_unknown(total, translations, &C::IS_TRANSLATION, D),
        shares: face_shares(model, *face)?,
    })
}

/// What a load gives to each of `count` points; `None` where it follows the motion.
fn dead_load(
    load: &Load,
    bit: Option<usize>,
    count: u64,
    is_translation: &[bool],
    dimension: usize,
) -> Option<DeadLoad> {
    let spread = |vector: &[f64; 3], translations| by_unknown(vector, translations, is_translation, dimension);
    let share = |total: &[f64; 3]| total.map(|total| total / count as f64);
    let amount = match &load.kind {
        LoadKind::SpecificWeight(weights) => {
            Amount::PerVolume(weights.iter().map(|weight| spread(weight, true)).collect())
        }
        LoadKind::Force { total, .. } => Amount::PerPoint(spread(&share(total), true)),
        LoadKind::Couple { total, .. } => Amount::PerPoint(spread(&share(total), false)),
        LoadKind::Pressure { .. } => return None,
    };
    Some(DeadLoad {
        stage: load.stage,
        amount,
        bit,
    })
}

/// The body force and couple of a manufactured solution, over the first stage.
fn manufactured_load(solution: Solution, is_translation: Vec<bool>) -> DeadLoad {
    let dimension = solution.dimension();
    let field = move |position: &[f64; 3]| {
        let load = solution.load(&Vector3::from(*position));
        let mut amounts = by_unknown(&load.force.into(), true, &is_translation, dimension);
        let couples = by_unknown(&load.couple.into(), false, &is_translation, dimension);
        amounts
            .iter_mut()
            .zip(couples)
            .for_each(|(amount, couple)| *amount += couple);
        amounts
    };
    DeadLoad {
        stage: 0,
        amount: Amount::Field(LoadField::new(field)),
        bit: None,
    }
}

/// Components of a vector on the translations or rotations of a node; in the plane the only rotation is about the third
/// axis.
fn by_unknown(vector: &[f64; 3], translations: bool, is_translation: &[bool], dimension: usize) -> Vec<f64> {
    let first = if translations || dimension == 3 { 0 } else { 2 };
    let mut components = vector[first..].iter();
    let pick = |&translation: &bool| {
        if translation == translations {
            components.next().copied()
        } else {
            None
        }
    };
    is_translation.iter().map(pick).map(Option::unwrap_or_default).collect()
}

/// Places the points on the grid for the first time.
fn locate<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    source: &Source,
    model: &mut Model<C, D, N>,
) -> Result<Survey<D>, Problem> {
    let describe = |misplaced: Misplaced| {
        let message = format!("point {} of the body: {}", misplaced.id, misplaced.what);
        source.problem(
            &format!("bodies[{}]", misplaced.body),
            message,
            "a body within the grid",
        )
    };
    model.gather_cells(world).map_err(describe)?;
    model.survey(world, 0).map_err(describe)
}

/// Share of `tolerance / precision` times the stiffness from which on no spring was solved, and from which on some were
/// not: the more points, the sooner (docs/theory.md, "How stiff").
const HOPELESS_PENALTY: f64 = 0.2;
const DOUBTFUL_PENALTY: f64 = 0.01;

/// Round-off of a spring, whose two ends move nearly alike, must not exceed what equilibrium is solved to. Returns warnings
/// about springs that come near it.
fn check_penalties<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    model: &mut Model<C, D, N>,
    survey: Survey<D>,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    if model.surface.ties.is_empty() {
        return Vec::new();
    }
    let largest = stiffest(world, model, survey);
    let ratio = scene.solver.force_tolerance / f64::EPSILON;
    let mut doubtful: Vec<(String, f64)> = Vec::new();
    for tie in &model.surface.ties {
        let kind = usize::from(!C::IS_TRANSLATION[tie.component]);
        let most = HOPELESS_PENALTY * ratio * largest[kind];
        let safe = DOUBTFUL_PENALTY * ratio * largest[kind];
        let path = format!("boundary[{}].penalty", tie.boundary);
        let known = problems.iter().any(|problem| problem.path == path);
        if largest[kind] == 0.0 {
            // No point has a stiffness, which has been told.
            continue;
        }
        if tie.penalty > most && !known {
            let message = format!(
                "{:e} is {:.1e} times the largest entry of the stiffness for {}: round-off would be worse than \
                 solver.force_tolerance",
                tie.penalty,
                tie.penalty / largest[kind],
                C::UNKNOWNS[tie.component]
            );
            problems.push(source.problem(&path, message, format!("a number > 0 and <= {most:.3e}")));
        } else if tie.penalty > safe && doubtful.iter().all(|(known, _)| *known != path) {
            doubtful.push((path, safe));
        }
    }
    let warning = |(path, safe): (String, f64)| {
        format!("{path}: its round-off may keep steps from solver.force_tolerance; up to {safe:.1e} is safe")
    };
    doubtful.into_iter().map(warning).collect()
}

/// Largest entry on the diagonal of the initial stiffness, for translations and for the other unknowns.
fn stiffest<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    model: &mut Model<C, D, N>,
    survey: Survey<D>,
) -> [f64; 2] {
    model.start_histories();
    let system = &model.complete(world, survey);
    let zero = vec![0.0; system.active.nodes.len() * N];
    let mut diagonal = Diagonal {
        unknowns: N,
        entries: zero.clone(),
    };
    let mut workspace = Workspace::<C, D, N>::new(Rc::new(Clock::start()));
    let Model { laws, points, .. } = model;
    let (batches, active) = (&system.batches, &system.active);
    let at_rest = "the initial state is in the domain of every law";
    workspace
        .add_internal_forces(laws, batches, active, points, &zero, &mut zero.clone())
        .expect(at_rest);
    workspace
        .add_tangent(
            laws,
            batches,
            active,
            points,
            &zero,
            Linearisation::Consistent,
            &mut diagonal,
        )
        .expect(at_rest);
    let mut largest = [0.0f64; 2];
    for (index, entry) in diagonal.entries.iter().enumerate() {
        let kind = usize::from(!C::IS_TRANSLATION[index % N]);
        largest[kind] = largest[kind].max(*entry);
    }
    world.max_slice(&mut largest);
    largest
}

/// Collects the diagonal of a tangent.
struct Diagonal {
    unknowns: usize,
    entries: Vec<f64>,
}

impl Sink for Diagonal {
    fn add(&mut self, nodes: &[u32], tangent: &[f64]) {
        let unknowns = self.unknowns;
        let width = nodes.len() * unknowns;
        for (k, entry) in tangent.iter().step_by(width + 1).enumerate() {
            self.entries[nodes[k / unknowns] as usize * unknowns + k % unknowns] += entry;
        }
    }
}

/// Conditions on nodes that do not exist are an error; on nodes that no point touches yet, a warning.
fn check_boundaries<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    model: &Model<C, D, N>,
    own_nodes: &[u64],
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for (index, boundary) in scene.boundaries.iter().enumerate() {
        let Place::Nodes(place) = &boundary.place else { continue };
        let holds = |&key: &u64| place.holds(model.initial_nodes(), key);
        if world.any(own_nodes.iter().any(holds)) {
            continue;
        }
        let path = format!("boundary[{index}]");
        if !boundary.moves.is_empty() || place.within.is_some() {
            let message = "none of its nodes is touched by a body";
            problems.push(source.problem(&path, message, "a face or plane of nodes that a body reaches"));
        } else {
            // One without a name is called by its place.
            let name = if boundary.name == path {
                String::new()
            } else {
                format!(" ({})", boundary.name)
            };
            warnings.push(format!("{path}{name} acts on no node until a body reaches it"));
        }
    }
    warnings
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Built<C, D, N> {
    /// What would be solved, in words.
    pub fn describe(&self, scene: &Scene) -> String {
        let mut lines = vec![console::shown(&scene.title).into_owned()];
        lines.push(format!("unknowns per node   {} ({})", N, C::UNKNOWNS.join(" ")));
        lines.push(format!("active nodes        {}", self.nodes));
        lines.push(format!("degrees of freedom  {}", self.nodes * N));
        lines.push(format!("active cells        {}", self.active_cells));
        lines.push(format!("material points     {}", self.points));
        for (body, count) in scene.bodies.iter().zip(&self.points_per_body) {
            lines.push(format!("  {}: {count}", body.name));
        }
        lines.extend(estimates(self.nodes * N, N, self.points, scene));
        for stage in &scene.stages {
            let steps = stage.full_steps();
            lines.push(match stage.control {
                Some(_) => format!("stage {}: along the path, at most {steps} steps", stage.name),
                None => format!("stage {}: {steps} steps", stage.name),
            });
        }
        if let Some(manufactured) = &scene.manufactured {
            let amplitude = manufactured.amplitude;
            lines.push(format!(
                "manufactured solution of amplitude {amplitude}: body force and couple as it needs"
            ));
        }
        lines.extend(self.warnings.iter().map(|warning| format!("warning: {warning}")));
        lines.extend(advice(self, scene).iter().map(|advice| format!("advice: {advice}")));
        lines.push("the configuration is valid; nothing was run".into());
        lines.join("\n") + "\n"
    }
}
