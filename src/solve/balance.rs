//! Sharing the points among the ranks: by cells, each with the number of its points as weight.

use crate::continuum::Continuum;
use crate::error::Error;
use crate::grid::Grid;
use crate::parallel::{Numbering, World};
use crate::petsc::{Graph, Partitioner, PetscInt, Session, partition};
use crate::points::Points;
use crate::points::migrate::count_points;
use std::rc::Rc;

/// Largest number of points on a rank over the mean, beyond which the points are shared anew.
pub const LARGEST_IMBALANCE: f64 = 1.10;

/// Largest number of points on a rank over the mean of all ranks.
pub fn imbalance(world: &World, points: usize) -> f64 {
    let total = world.sum(points as u64) as f64;
    let largest = world.max_of(points as u64) as f64;
    if total == 0.0 {
        1.0
    } else {
        largest * world.size() as f64 / total
    }
}

/// Collective. Divides the graph of the cells that hold points among the ranks and sends the points there. Every cell's
/// points are on one rank already. `cells` gives the cell of each point.
pub fn share_points<C: Continuum, const D: usize>(
    session: &Rc<Session>,
    world: &World,
    grid: &Grid<D>,
    partitioner: Partitioner,
    points: &mut Points<C, D>,
    cells: &[u64],
) -> Result<(), Error> {
    let weights = count_points(cells);
    let keys: Vec<u64> = weights.iter().map(|&(cell, _)| cell).collect();
    let graph = graph_of_cells(world, grid, &keys, weights.iter().map(|&(_, weight)| weight));
    let part = partition(session, &graph, world.size(), partitioner)?;
    let destination: Vec<usize> = cells
        .iter()
        .map(|cell| part[keys.binary_search(cell).expect("every point's cell is in the graph")])
        .collect();
    points.send(world, &destination);
    Ok(())
}

/// Cells as vertices, common faces as edges.
fn graph_of_cells<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    keys: &[u64],
    weights: impl Iterator<Item = u64>,
) -> Graph {
    let numbering = Numbering::new(world, keys);
    let mut asked = Vec::new();
    let mut counts = Vec::new();
    for &key in keys {
        let before = asked.len();
        asked.extend(grid.neighbours(&grid.cell(key)).map(|cell| grid.cell_key(&cell)));
        counts.push(asked.len() - before);
    }
    let found = numbering.look_up(world, &asked);
    let mut graph = Graph {
        first: numbering.first,
        offsets: vec![0],
        neighbours: Vec::new(),
        vertex_weights: weights.map(|weight| weight as PetscInt).collect(),
    };
    let mut found = found.into_iter();
    for count in counts {
        graph
            .neighbours
            .extend(found.by_ref().take(count).flatten().map(|cell| cell.number as PetscInt));
        graph.offsets.push(graph.neighbours.len() as PetscInt);
    }
    graph
}
