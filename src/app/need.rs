//! Whether a scene fits into the memory that there is, before it takes any of it.

use super::cost::SystemSize;
use crate::config::Source;
use crate::continuum::{Fields, total_length};
use crate::error::Error;
use crate::grid::Grid;
use crate::material::Material;
use crate::memory::{self, Bound};
use crate::parallel::World;
use crate::petsc::LinearSolver;
use crate::points::seed::{Body, Extent, PointSource, extent};
use crate::scene::Scene;

/// Bytes for each node of a mesh, which all ranks hold.
const NODE_OF_A_MESH: f64 = 100.0;

/// What a scene takes at least, on all ranks together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Need {
    points: f64,
    cells: f64,
    nodes: f64,
    /// Bytes of the points with their histories and basis values.
    point_bytes: f64,
    /// Bytes of the matrix, and as many of its factors, however sparse.
    matrix_bytes: f64,
    /// Bytes of what each rank has a copy of.
    copied_bytes: f64,
}

impl Need {
    fn of<C: Fields<D, N>, const D: usize, const N: usize>(
        scene: &Scene,
        grid: &Grid<D>,
        laws: &[Box<dyn Material<C>>],
    ) -> Self {
        let states = laws.iter().map(|law| total_length(law.state_variables()));
        let mut need = Need::default();
        for body in &scene.bodies {
            let extent = extent(grid, body);
            need.add(&extent, grid.order, N);
            need.copied_bytes += copied(body, &extent);
        }
        let values = 8 * (grid.order + 1).pow(D as u32) * (1 + D);
        let per_point = bytes_of_a_point::<C, D, N>(states.max().unwrap_or(0)) + values;
        need.point_bytes = need.points * per_point as f64;
        need
    }

    /// Adds a body: its points, and the rows of the nodes that it touches. Bodies that share cells are few.
    fn add<const D: usize>(&mut self, extent: &Extent<D>, order: usize, unknowns: usize) {
        let cells: f64 = extent.cells.iter().map(|&count| count as f64).product();
        let cells = cells * extent.filled;
        // A node is coupled with those that share a cell's support with it, as far as there are such.
        let coupled = |&count: &usize| (2 * order + 1).min(count + order) as f64;
        let row: f64 = extent.cells.iter().map(coupled).product();
        self.points += extent.points;
        self.cells += cells;
        self.nodes += cells;
        self.matrix_bytes += 2.0 * 8.0 * cells * row * (unknowns * unknowns) as f64;
    }

    /// Bytes that one of several ranks takes at least.
    fn of_a_rank(&self, ranks: usize) -> f64 {
        (self.point_bytes + self.matrix_bytes) / ranks as f64 + self.copied_bytes
    }
}

/// Bytes that all ranks hold of the mesh of a body.
fn copied<const D: usize>(body: &Body, extent: &Extent<D>) -> f64 {
    match &body.points {
        PointSource::Mesh(_) => {
            let nodes = extent.cells.iter().map(|&count| count as f64 + 1.0);
            NODE_OF_A_MESH * nodes.product::<f64>()
        }
        PointSource::Lattice { .. } | PointSource::List(_) => 0.0,
    }
}

/// Bytes of a point with its history, in the arrays of [`Points`](crate::points::Points).
fn bytes_of_a_point<C: Fields<D, N>, const D: usize, const N: usize>(state_length: usize) -> usize {
    let numbers = 3 + 4 * D + 2 * state_length;
    8 * numbers + 2 * size_of::<u32>() + size_of::<C::Motion>() + 2 * size_of::<C::Stress>()
}

/// Collective. Compares what a scene takes with what there is. Answers with a warning where the factors, which can only be
/// estimated, will hardly fit.
///
/// # Errors
/// The points and the matrix alone do not fit, on one of the ranks at least: an error of the scene where they take more than
/// the program and they are given, of the machine otherwise.
pub fn check<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    grid: &Grid<D>,
    laws: &[Box<dyn Material<C>>],
) -> Result<Option<String>, Error> {
    let need = Need::of(scene, grid, laws);
    let Some((free, bound)) = least_free(world) else {
        return Ok(None);
    };
    let own = need.of_a_rank(world.size());
    let each = if world.size() == 1 { "" } else { " on each rank" };
    if own > free {
        let message = format!(
            "there is not enough memory for about {:.3e} points in {:.3e} cells: with the matrix they take at least \
             {}{each}, and {} are left ({bound})",
            need.points,
            need.cells,
            size(own),
            size(free),
        );
        let expected = "fewer points_per_cell, larger cells, or more ranks on more machines";
        // A scene that does not fit beside the program, but would in its place, has met a limit that is too low for either.
        let program = world.max_of(memory::taken()) as f64;
        return Err(if own > free + program {
            Error::Configuration(vec![source.problem("bodies", message, expected)])
        } else {
            Error::System(format!("{message}; a higher limit, {expected}"))
        });
    }
    let factors = factors(scene, &need, N) / world.size() as f64;
    Ok((own + factors > free).then(|| {
        format!(
            "the solver will take about {}{each} beside {} for points and matrix (an estimate), and {} are left ({bound}): \
             solver.method: iterative, larger cells, or more ranks on more machines",
            size(factors),
            size(own),
            size(free),
        )
    }))
}

/// Collective. The bytes left to the rank that has least, and what bounds them.
fn least_free(world: &World) -> Option<(f64, Bound)> {
    let own = memory::available(world.ranks_of_this_machine());
    let free = own.map_or(f64::INFINITY, |(free, _)| free as f64);
    let least = world.min_of(free);
    // Ranks have their own bounds: the one of the rank with least is told.
    let tightest = |bound: Bound| own.is_some_and(|(_, own)| own == bound) && free == least;
    let bounds = [Bound::Machine, Bound::Group, Bound::AddressSpace];
    let found = bounds.map(|bound| world.any(tightest(bound)));
    let bound = bounds.into_iter().zip(found).find(|(_, found)| *found);
    bound.map(|(bound, _)| (least, bound))
}

/// Bytes that the solver that is taken is expected to take, all ranks together.
fn factors(scene: &Scene, need: &Need, unknowns_per_node: usize) -> f64 {
    let unknowns = need.nodes as usize * unknowns_per_node;
    let size = SystemSize::of(scene, unknowns, unknowns_per_node);
    1e6 * match scene.solver.linear_solver(unknowns, size.dimension) {
        LinearSolver::Direct => size.direct_memory(),
        LinearSolver::Iterative { .. } => size.iterative_memory(),
    }
}

/// Bytes for people.
fn size(bytes: f64) -> String {
    match bytes {
        ..1e9 => format!("{:.0} MB", bytes / 1e6),
        ..1e12 => format!("{:.1} GB", bytes / 1e9),
        _ => format!("{:.3e} GB", bytes / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_of_a_block_has_a_row_for_each_node() {
        // 10 x 10 x 10 cells of hats: 27 neighbours with 6 x 6 numbers each, twice.
        let mut need = Need::default();
        let block = Extent {
            cells: [10; 3],
            points: 8000.0,
            filled: 1.0,
        };
        need.add(&block, 1, 6);
        assert_eq!(need.matrix_bytes, 2.0 * 8.0 * 1000.0 * 27.0 * 36.0);
        // One cell across: its nodes have two neighbours there, not three.
        let mut need = Need::default();
        let sheet = Extent {
            cells: [10, 1],
            points: 40.0,
            filled: 0.5,
        };
        need.add(&sheet, 1, 2);
        assert_eq!(need.matrix_bytes, 2.0 * 8.0 * 5.0 * 6.0 * 4.0);
        need.copied_bytes = 7.0;
        assert_eq!(need.of_a_rank(2), 0.5 * need.matrix_bytes + 7.0);
    }

    #[test]
    fn sizes_are_short() {
        assert_eq!(size(2.5e6), "2 MB");
        assert_eq!(size(2.25e9), "2.2 GB");
        assert_eq!(size(5.9e14), "5.900e5 GB");
    }
}
