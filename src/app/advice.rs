//! What `check` estimates, and where a scene models more than it needs.

use super::build::Built;
use super::cost::SystemSize;
use super::symmetry;
use crate::condition::dirichlet::{Boundary, GridPlane};
use crate::continuum::Fields;
use crate::grid::words::length;
use crate::material::spec::MaterialSpec;
use crate::petsc::LinearSolver;
use crate::scene::{Kinematics, LoadKind, Scene};
use crate::solve::settings::Stage;

/// Points in a cell from which on they are more than any integral needs.
const MANY_POINTS: f64 = 1000.0;

/// A cell that is this many times smaller than the internal length resolves nothing more.
const FINE_CELLS: f64 = 20.0;

/// Newton iterations of a step, as most scenes take.
const ITERATIONS_PER_STEP: f64 = 5.0;

/// Lines about the size of a run: steps, memory of the solver, and the order of its time.
pub fn estimates(unknowns: usize, unknowns_per_node: usize, points: u64, scene: &Scene) -> Vec<String> {
    let dimension = scene.kinematics.dimension();
    let size = SystemSize::of(scene, unknowns, unknowns_per_node);
    let steps: usize = scene.stages.iter().map(Stage::full_steps).sum();
    let per_point = if dimension == 2 { 5e-6 } else { 2e-5 };
    let per_iteration = size.direct_seconds() + per_point * points as f64;
    let seconds = per_iteration * ITERATIONS_PER_STEP * steps as f64;
    let class = match seconds {
        ..60.0 => "seconds",
        ..3600.0 => "minutes",
        ..86400.0 => "hours",
        _ => "days",
    };
    vec![
        format!("steps               {steps}"),
        solver_memory(&size, scene),
        format!("cost class          {class} (rough estimate for one rank)"),
    ]
}

/// The memory of the solver that is taken; beside an iterative one, that of the direct solver too, to which `auto` may
/// change.
fn solver_memory(size: &SystemSize, scene: &Scene) -> String {
    let megabytes = |memory: f64| memory.max(1.0).round();
    let direct = megabytes(size.direct_memory());
    match scene.solver.linear_solver(size.unknowns as usize, size.dimension) {
        LinearSolver::Direct => {
            format!("solver memory       about {direct} MB in all (estimate for a direct solution of a compact body)")
        }
        LinearSolver::Iterative { .. } => format!(
            "solver memory       about {} MB in all (estimate for the iterative solver, which solver.method takes here; \
             about {direct} MB for a direct solution of a compact body)",
            megabytes(size.iterative_memory())
        ),
    }
}

/// Where a scene models more than it needs, or resolves less than it says.
pub fn advice<C: Fields<D, N>, const D: usize, const N: usize>(built: &Built<C, D, N>, scene: &Scene) -> Vec<String> {
    let mut advice = Vec::new();
    advice.extend(plane_strain_is_enough(scene, N));
    advice.extend(rotations_are_idle(scene, &C::IS_TRANSLATION));
    advice.extend(cells_and_lengths(scene));
    advice.extend(too_many_points(built.points, built.active_cells));
    advice.extend(symmetry::symmetric_halves(built, scene));
    advice
}

/// Whether a component is held at zero at all nodes from the start on: everywhere, or on both faces of a grid that is one
/// cell thick along an axis.
fn held_everywhere(scene: &Scene, component: usize, axis: usize) -> bool {
    let holding = scene
        .boundaries
        .iter()
        .filter(|boundary| boundary.stage == 0 && boundary.fix.contains(&component))
        .filter_map(Boundary::nodes);
    let planes: Vec<_> = holding
        .filter(|nodes| nodes.within.is_none())
        .map(|nodes| nodes.plane)
        .collect();
    let on_plane = |index| {
        let holds = |plane: &Option<GridPlane>| plane.is_some_and(|plane| plane.axis == axis && plane.index == index);
        planes.iter().any(holds)
    };
    planes.contains(&None) || (scene.grid.cells[axis] == 1 && on_plane(0) && on_plane(1))
}

/// In space, an axis along which nothing can move.
fn plane_strain_is_enough(scene: &Scene, unknowns: usize) -> Option<String> {
    if scene.kinematics != Kinematics::ThreeDimensional {
        return None;
    }
    let axis =
        (0..3).find(|&axis| out_of_plane(axis, unknowns).all(|component| held_everywhere(scene, component, axis)))?;
    let name = ["x", "y", "z"][axis];
    let in_plane = scene.continuum.unknowns(2).len();
    Some(format!(
        "nothing can move along {name}: kinematics: plane_strain gives the same with {in_plane} instead of {unknowns} \
         unknowns per node"
    ))
}

/// Components that leave the plane across an axis: the translation along it, the rotations about the others.
fn out_of_plane(axis: usize, unknowns: usize) -> impl Iterator<Item = usize> {
    let rotations = (3..unknowns.min(6)).filter(move |component| component - 3 != axis);
    std::iter::once(axis).chain(rotations)
}

/// Rotations that do not couple to displacements and that nothing drives.
fn rotations_are_idle(scene: &Scene, is_translation: &[bool]) -> Option<String> {
    let rotates = |&(component, _): &(usize, f64)| !is_translation[component];
    let driven = scene
        .boundaries
        .iter()
        .any(|boundary| boundary.moves.iter().any(rotates))
        || scene
            .loads
            .iter()
            .any(|load| matches!(load.kind, LoadKind::Couple { .. }))
        || scene.manufactured.is_some();
    let has_rotations = scene.continuum.has_rotations();
    let coupled = scene
        .materials
        .iter()
        .any(|material| material.spec.coupling_modulus() > 0.0);
    (has_rotations && !driven && !coupled).then(|| {
        "the coupling modulus is zero and nothing drives rotations: they stay zero; \
         continuum: classical has fewer unknowns per node"
            .to_owned()
    })
}

/// Cells beside the internal length of plastic materials with rotations.
fn cells_and_lengths(scene: &Scene) -> Vec<String> {
    if scene.is_on_a_mesh() || !scene.continuum.has_rotations() {
        return Vec::new();
    }
    let edges = &scene.grid.cell_size[..scene.kinematics.dimension()];
    let largest = edges.iter().copied().fold(0.0, f64::max);
    let smallest = edges.iter().copied().fold(f64::INFINITY, f64::min);
    let mut advice = Vec::new();
    for material in &scene.materials {
        let Some(internal) = plastic_length(&material.spec) else {
            continue;
        };
        // What regions made of a material is told of where its length is another.
        let origin = material.made_of.map(|origin| &scene.materials[origin].spec);
        if origin.and_then(plastic_length) == Some(internal) {
            continue;
        }
        let name = &material.name;
        let (cells, verdict) = if largest > internal {
            let verdict = "larger than the internal length of";
            (
                largest,
                [
                    verdict,
                    "a shear band is not resolved; its width then follows the cells",
                ],
            )
        } else if smallest * FINE_CELLS < internal {
            let verdict = "far smaller than the internal length of";
            (smallest, [verdict, "larger ones resolve a shear band as well"])
        } else {
            continue;
        };
        advice.push(format!(
            "the cells of {} m are {} {name}, plastic_length {} m: {}",
            length(cells),
            verdict[0],
            length(internal),
            verdict[1]
        ));
    }
    advice
}

fn plastic_length(spec: &MaterialSpec) -> Option<f64> {
    match spec {
        MaterialSpec::Elastoplastic(_, plastic) => Some(plastic.plastic_length),
        MaterialSpec::Elastic(_) | MaterialSpec::Sandstone(_) => None,
    }
}

fn too_many_points(points: u64, active_cells: u64) -> Option<String> {
    let per_cell = points as f64 / active_cells.max(1) as f64;
    (per_cell >= MANY_POINTS).then(|| {
        format!("there are {per_cell:.0} points per active cell: 2 to 4 points_per_cell along each axis are usual")
    })
}
