//! Which nodes see which points: supports, batches and basis values of a step.
//!
//! Two points of one cell need not see the same nodes: a domain that reaches over a cell's edge adds a row. Points are
//! therefore sorted and batched by support; all points of a batch share exactly their nodes. Basis values and
//! gradients belong to the start of the step and are computed once.

use super::Points;
use super::elements::Elements;
use crate::continuum::Continuum;
use crate::grid::basis::{self, Basis, MAX_NODES_PER_AXIS};
use crate::grid::{Grid, Support};
use std::ops::Range;

/// Points with the same support.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch<const D: usize> {
    pub support: Support<D>,
    pub points: Range<usize>,
    /// Where the basis values of the first point begin.
    first_shape: usize,
}

/// The points of a rank, sorted into batches; with their basis values once these are evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Batches<const D: usize> {
    pub batches: Vec<Batch<D>>,
    shapes: Vec<f64>,
    /// Farthest reach of a domain over the face of the grid, in cells.
    pub overhang: f64,
}

/// Part of a cell by which a domain may stick out of the grid; what nodes outside would take is dropped.
pub const LARGEST_OVERHANG: f64 = 0.05;

/// A point that the grid cannot carry.
#[derive(Clone, Debug, PartialEq)]
pub struct Misplaced {
    pub id: u64,
    pub body: usize,
    pub what: String,
}

impl<const D: usize> Batches<D> {
    /// Basis values of a point of a batch: for each node the value and the gradient [1/m].
    pub fn shapes(&self, batch: &Batch<D>, point: usize) -> &[f64] {
        let stride = batch.support.size() * (1 + D);
        let start = batch.first_shape + (point - batch.points.start) * stride;
        &self.shapes[start..start + stride]
    }

    /// Computes the basis values of all points: `evaluate` writes those of a point, at the nodes of its support.
    pub fn evaluate(&mut self, evaluate: impl Fn(usize, &Support<D>, &mut [f64])) {
        let stride = |batch: &Batch<D>| batch.support.size() * (1 + D);
        let length = self
            .batches
            .iter()
            .map(|batch| batch.points.len() * stride(batch))
            .sum();
        self.shapes = vec![0.0; length];
        for batch in &self.batches {
            let own = self.shapes[batch.first_shape..].chunks_exact_mut(stride(batch));
            for (p, shapes) in batch.points.clone().zip(own) {
                evaluate(p, &batch.support, shapes);
            }
        }
    }

    /// Cells touched by a domain, sorted.
    pub fn touched_cells(&self, grid: &Grid<D>) -> Vec<u64> {
        let mut cells = Vec::new();
        for batch in &self.batches {
            batch
                .support
                .for_each_cell(grid.order, |cell| cells.push(grid.cell_key(cell)));
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }
}

/// Cell of each point's centre, or the first point whose centre lies outside the grid.
pub fn cells_of_points<C: Continuum, const D: usize>(
    grid: &Grid<D>,
    points: &Points<C, D>,
) -> Result<Vec<u64>, Misplaced> {
    let cell_of = |p: usize| match grid.cell_at(&points.position[p]) {
        Some(cell) => Ok(grid.cell_key(&cell)),
        None => Err(Misplaced {
            id: points.id[p],
            body: points.body[p] as usize,
            what: format!(
                "its centre {} lies outside the grid",
                coordinates(points.position[p].as_slice())
            ),
        }),
    };
    (0..points.len()).map(cell_of).collect()
}

/// Sorts the points by (support, material, id). Basis values are left to [`Batches::evaluate`].
pub fn search<C: Continuum, const D: usize>(
    grid: &Grid<D>,
    basis: &dyn Basis,
    points: &mut Points<C, D>,
) -> Result<Batches<D>, Misplaced> {
    let mut overhang: f64 = 0.0;
    let mut supports = Vec::with_capacity(points.len());
    for p in 0..points.len() {
        if basis.has_domains() {
            overhang = overhang.max(reach_outside(grid, points, p)?);
        }
        let support = basis::support(basis, grid, &points.position[p], &points.half_lengths[p]);
        if support.count.iter().any(|&count| count as usize > MAX_NODES_PER_AXIS) {
            return Err(misplaced(points, p, "its domain is longer than two cells".into()));
        }
        supports.push(support);
    }
    sort(grid, points, &mut supports);
    Ok(Batches {
        overhang,
        ..batch(&supports)
    })
}

/// As [`search`], for the points of finite elements, which see the nodes of their cell.
pub fn search_elements<C: Continuum, const D: usize>(elements: &Elements<D>, points: &mut Points<C, D>) -> Batches<D> {
    let mut supports: Vec<_> = points.id.iter().map(|&id| elements.support(id)).collect();
    sort(elements.mesh.grid(), points, &mut supports);
    batch(&supports)
}

/// Batches of sorted points.
fn batch<const D: usize>(supports: &[Support<D>]) -> Batches<D> {
    let mut batches: Vec<Batch<D>> = Vec::new();
    let mut length = 0;
    for (p, &support) in supports.iter().enumerate() {
        match batches.last_mut() {
            Some(batch) if batch.support == support => batch.points.end = p + 1,
            _ => batches.push(Batch {
                support,
                points: p..p + 1,
                first_shape: length,
            }),
        }
        length += support.size() * (1 + D);
    }
    Batches {
        batches,
        shapes: Vec::new(),
        overhang: 0.0,
    }
}

fn misplaced<C: Continuum, const D: usize>(points: &Points<C, D>, p: usize, what: String) -> Misplaced {
    Misplaced {
        id: points.id[p],
        body: points.body[p] as usize,
        what,
    }
}

/// By how many cells a point's domain sticks out of the grid; an error beyond [`LARGEST_OVERHANG`].
fn reach_outside<C: Continuum, const D: usize>(
    grid: &Grid<D>,
    points: &Points<C, D>,
    p: usize,
) -> Result<f64, Misplaced> {
    let mut reach: f64 = 0.0;
    for axis in 0..D {
        let x = grid.cell_coordinate(axis, points.position[p][axis]);
        let half = points.half_lengths[p][axis] / grid.cell_size[axis];
        reach = reach.max(half - x).max(x + half - grid.cells[axis] as f64);
    }
    if reach > LARGEST_OVERHANG {
        let reach = if reach < 100.0 {
            format!("{reach:.3}")
        } else {
            format!("{reach:.3e}")
        };
        let what = format!(
            "its domain around {} sticks {reach} of a cell out of the grid; up to {LARGEST_OVERHANG} is dropped",
            coordinates(points.position[p].as_slice())
        );
        return Err(misplaced(points, p, what));
    }
    Ok(reach)
}

fn coordinates(position: &[f64]) -> String {
    let parts: Vec<String> = position.iter().map(|x| format!("{x:.6e}")).collect();
    format!("({})", parts.join(", "))
}

fn sort<C: Continuum, const D: usize>(grid: &Grid<D>, points: &mut Points<C, D>, supports: &mut Vec<Support<D>>) {
    let keys: Vec<_> = supports
        .iter()
        .enumerate()
        .map(|(p, support)| {
            let lowest = grid.node_key(&support.lowest.map(|index| index as usize));
            (lowest, support.count, points.material[p], points.id[p])
        })
        .collect();
    if keys.is_sorted() {
        return;
    }
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by_key(|&p| keys[p]);
    points.reorder(&order);
    *supports = order.iter().map(|&p| supports[p]).collect();
}
