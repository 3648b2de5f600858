//! Penalties and follower pressure in residual and tangent: what acts on some points only.

use super::Sink;
use super::active::{Active, Platens};
use crate::condition::Time;
use crate::condition::pressure::{Patch, Pressure, carried_area, carried_area_by_column};
use crate::condition::weak::{Goal, Tie, acting, platen_key};
use crate::continuum::Fields;
use crate::grid::Grid;
use crate::grid::basis::{self, Basis};
use crate::points::Points;
use crate::points::search::{Batch, Batches};
use nalgebra::{Matrix3, SVector, Vector3};
use std::ops::Range;

/// Conditions on some of the points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceConditions {
    pub ties: Vec<Tie>,
    pub pressures: Vec<Pressure>,
}

/// What of them acts at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActingConditions {
    /// Sorted by boundary.
    pub ties: Vec<Tie>,
    /// Each pressure at that moment [Pa].
    pub pressures: Vec<f64>,
}

/// The points that conditions act on in a step, with their basis values on the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfacePoints {
    /// Batches that hold tied points.
    tied: Vec<usize>,
    pressed: Vec<PressedPoint>,
    values: Vec<f64>,
}

/// A side of a point's domain under pressure.
#[derive(Clone, Debug, PartialEq)]
struct PressedPoint {
    batch: usize,
    point: usize,
    pressure: usize,
    /// Area vector on the shape at the start of the step [m2].
    area: Vector3<f64>,
    /// Basis values at the middle of the side.
    values: Range<usize>,
}

impl SurfaceConditions {
    /// What acts at a time.
    pub fn acting(&self, time: Time) -> ActingConditions {
        ActingConditions {
            ties: acting(&self.ties, time.stage),
            pressures: self.pressures.iter().map(|pressure| pressure.at(time)).collect(),
        }
    }

    /// Platens that points of this rank are tied to in a stage. Those of other stages must not be among the unknowns: the
    /// first assembly of a matrix fixes its pattern to what was added.
    pub fn platens<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        batches: &Batches<D>,
        points: &Points<C, D>,
        stage: usize,
    ) -> Platens {
        let mut platens = Platens::default();
        let acting = acting(&self.ties, stage);
        let mut boundaries: Vec<usize> = acting.iter().map(|tie| tie.boundary).collect();
        boundaries.dedup();
        for boundary in boundaries {
            let mut ties = acting.iter().filter(|tie| tie.boundary == boundary);
            let bit = ties.clone().map(|tie| tie.bit).next().unwrap_or_default();
            let free = ties.any(|tie| tie.goal == Goal::Free);
            let mut own = batches_of(batches, points, 1 << bit);
            if own.is_empty() {
                continue;
            }
            if !free {
                own.clear();
            }
            platens.batches.push((platen_key(boundary), own));
        }
        platens
    }

    /// Finds the points that conditions act on.
    pub fn find<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        grid: &Grid<D>,
        basis: &dyn Basis,
        batches: &Batches<D>,
        points: &Points<C, D>,
    ) -> SurfacePoints {
        let marks = self.ties.iter().fold(0, |marks, tie| marks | 1 << tie.bit);
        let mut found = SurfacePoints {
            tied: batches_of(batches, points, marks),
            ..SurfacePoints::default()
        };
        for (index, batch) in batches.batches.iter().enumerate() {
            for (number, pressure) in self.pressures.iter().enumerate() {
                for patch in &pressure.patches {
                    for p in batch.points.clone().filter(|&p| points.marks[p] >> patch.bit & 1 == 1) {
                        let start = found.values.len();
                        side_values::<C, D, N>(grid, basis, batch, points, p, patch, &mut found.values);
                        let gradient = C::deformation_gradient(&points.motion[p]);
                        found.pressed.push(PressedPoint {
                            batch: index,
                            point: p,
                            pressure: number,
                            area: carried_area(&gradient, &patch.side.area(points, p)),
                            values: start..found.values.len(),
                        });
                    }
                }
            }
        }
        found
    }
}

/// Batches with points that have any of these marks.
fn batches_of<C: Fields<D, N>, const D: usize, const N: usize>(
    batches: &Batches<D>,
    points: &Points<C, D>,
    marks: u64,
) -> Vec<usize> {
    let marked = |batch: &Batch<D>| batch.points.clone().any(|p| points.marks[p] & marks != 0);
    let all = batches.batches.iter().enumerate();
    all.filter(|(_, batch)| marked(batch)).map(|(index, _)| index).collect()
}

/// Appends the basis values at the middle of a side of a point's domain: where the deformed side is, but within what
/// the nodes of the point cover, its domain or else its cell.
fn side_values<C: Fields<D, N>, const D: usize, const N: usize>(
    grid: &Grid<D>,
    basis: &dyn Basis,
    batch: &Batch<D>,
    points: &Points<C, D>,
    p: usize,
    patch: &Patch,
    values: &mut Vec<f64>,
) {
    let offset = C::deformation_gradient(&points.motion[p]) * patch.side.offset(points, p);
    let centre = &points.position[p];
    let place = SVector::<f64, D>::from_fn(|axis, _| {
        let (low, high) = if basis.has_domains() {
            let half = points.half_lengths[p][axis];
            (centre[axis] - half, centre[axis] + half)
        } else {
            let edge = grid.cell_size[axis];
            let low = grid.min[axis] + edge * grid.cell_coordinate(axis, centre[axis]).floor();
            (low, low + edge)
        };
        let (first, last) = (
            grid.min[axis],
            grid.min[axis] + grid.cell_size[axis] * grid.cells[axis] as f64,
        );
        (centre[axis] + offset[axis]).clamp(low.max(first), high.min(last))
    });
    let mut shapes = vec![0.0; batch.support.size() * (1 + D)];
    basis::evaluate_at_point(basis, grid, &batch.support, &place, &mut shapes);
    values.extend(shapes.chunks_exact(1 + D).map(|shape| shape[0]));
}

/// Scratch memory, grown when a batch is larger than any before.
#[derive(Default)]
pub struct SurfaceWorkspace {
    nodes: Vec<u32>,
    tangent: Vec<f64>,
}

/// Where conditions act, and on what.
pub struct Surface<'a, C: Fields<D, N>, const D: usize, const N: usize> {
    pub found: &'a SurfacePoints,
    pub acting: &'a ActingConditions,
    pub batches: &'a Batches<D>,
    pub active: &'a Active,
    pub points: &'a Points<C, D>,
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Surface<'_, C, D, N> {
    /// Adds the forces of springs on points and platens at local increments `u`. The forces are those that equilibrium
    /// has on the side of the internal ones.
    pub fn add_tie_forces(&self, u: &[f64], forces: &mut [f64]) {
        for &index in &self.found.tied {
            let batch = &self.batches.batches[index];
            let nodes = self.active.batch_nodes(index);
            for tie in &self.acting.ties {
                for p in self.tied_points(batch, tie) {
                    let platen = self
                        .active
                        .platen(tie.boundary)
                        .expect("platens of own points are local");
                    let force = tie.penalty * self.gap(batch, nodes, p, tie, u);
                    for (&node, shape) in nodes.iter().zip(self.batches.shapes(batch, p).chunks_exact(1 + D)) {
                        forces[node as usize * N + tie.component] += shape[0] * force;
                    }
                    forces[platen as usize * N + tie.component] -= force;
                }
            }
        }
    }

    /// Adds to local unknowns the squares of the forces [N2, N2 m2] that a gap of one [m, rad] would make.
    pub fn add_tie_squares(&self, squares: &mut [f64]) {
        for &index in &self.found.tied {
            let (batch, nodes) = (&self.batches.batches[index], self.active.batch_nodes(index));
            for tie in &self.acting.ties {
                for p in self.tied_points(batch, tie) {
                    for (&node, shape) in nodes.iter().zip(self.batches.shapes(batch, p).chunks_exact(1 + D)) {
                        squares[node as usize * N + tie.component] += (tie.penalty * shape[0]).powi(2);
                    }
                    if let Some(platen) = self.active.platen(tie.boundary) {
                        squares[platen as usize * N + tie.component] += tie.penalty.powi(2);
                    }
                }
            }
        }
    }

    fn tied_points(&self, batch: &Batch<D>, tie: &Tie) -> impl Iterator<Item = usize> + use<'_, C, D, N> {
        let bit = tie.bit;
        batch
            .points
            .clone()
            .filter(move |&p| self.points.marks[p] >> bit & 1 == 1)
    }

    /// Gap of a spring at local increments `u`, as far as it makes a force [m, rad].
    fn gap(&self, batch: &Batch<D>, nodes: &[u32], p: usize, tie: &Tie, u: &[f64]) -> f64 {
        let increment: f64 = nodes
            .iter()
            .zip(self.batches.shapes(batch, p).chunks_exact(1 + D))
            .map(|(&node, shape)| shape[0] * u[node as usize * N + tie.component])
            .sum();
        let platen = self
            .active
            .platen(tie.boundary)
            .expect("platens of own points are local");
        let before = tie.remembered(self.points.gaps[p * self.points.gap_count + tie.slot]);
        before + increment - u[platen as usize * N + tie.component]
    }

    /// Gaps of all springs at local increments `u`, as [`Points::gaps`] has them; those of springs that do not act close.
    pub fn gaps(&self, u: &[f64]) -> Vec<f64> {
        let mut gaps = vec![0.0; self.points.gaps.len()];
        for &index in &self.found.tied {
            let (batch, nodes) = (&self.batches.batches[index], self.active.batch_nodes(index));
            for tie in &self.acting.ties {
                for p in self.tied_points(batch, tie) {
                    gaps[p * self.points.gap_count + tie.slot] = self.gap(batch, nodes, p, tie, u);
                }
            }
        }
        gaps
    }

    /// Adds the stiffness of the springs.
    pub fn add_tie_stiffness(&self, workspace: &mut SurfaceWorkspace, sink: &mut impl Sink) {
        for &index in &self.found.tied {
            let batch = &self.batches.batches[index];
            for ties in self.acting.ties.chunk_by(|a, b| a.boundary == b.boundary) {
                let Some(platen) = self.active.platen(ties[0].boundary) else {
                    continue;
                };
                if self.tied_points(batch, &ties[0]).next().is_none() {
                    continue;
                }
                let SurfaceWorkspace { nodes, tangent } = &mut *workspace;
                nodes.clear();
                nodes.extend_from_slice(self.active.batch_nodes(index));
                nodes.push(platen);
                let width = nodes.len() * N;
                tangent.clear();
                tangent.resize(width * width, 0.0);
                for tie in ties {
                    for p in self.tied_points(batch, tie) {
                        add_spring::<D, N>(self.batches.shapes(batch, p), tie, tangent);
                    }
                }
                sink.add(nodes, tangent);
            }
        }
    }

    /// Adds the forces of pressure at local increments `u`, on the side of the internal forces, times `factor`.
    pub fn add_pressure_forces(&self, u: &[f64], factor: f64, forces: &mut [f64]) {
        for pressed in &self.found.pressed {
            let pressure = factor * self.acting.pressures[pressed.pressure];
            if pressure == 0.0 {
                continue;
            }
            let nodes = self.active.batch_nodes(pressed.batch);
            let area = carried_area(&self.increment_gradient(pressed, u), &pressed.area);
            for (&node, value) in nodes.iter().zip(&self.found.values[pressed.values.clone()]) {
                for i in 0..D {
                    forces[node as usize * N + i] += pressure * value * area[i];
                }
            }
        }
    }

    /// Deformation gradient of the step at a point.
    fn increment_gradient(&self, pressed: &PressedPoint, u: &[f64]) -> Matrix3<f64> {
        let batch = &self.batches.batches[pressed.batch];
        let shapes = self.batches.shapes(batch, pressed.point).chunks_exact(1 + D);
        let mut gradient = Matrix3::identity();
        for (&node, shape) in self.active.batch_nodes(pressed.batch).iter().zip(shapes) {
            for i in 0..D {
                for k in 0..D {
                    gradient[(i, k)] += u[node as usize * N + i] * shape[1 + k];
                }
            }
        }
        gradient
    }

    /// Adds the load stiffness of pressure at local increments `u`; it is not symmetric.
    pub fn add_pressure_stiffness(&self, u: &[f64], workspace: &mut SurfaceWorkspace, sink: &mut impl Sink) {
        let tangent = &mut workspace.tangent;
        for group in self.found.pressed.chunk_by(|a, b| a.batch == b.batch) {
            let nodes = self.active.batch_nodes(group[0].batch);
            let width = nodes.len() * N;
            tangent.clear();
            tangent.resize(width * width, 0.0);
            for pressed in group {
                let gradient = self.increment_gradient(pressed, u);
                let slopes: [Matrix3<f64>; D] =
                    std::array::from_fn(|k| carried_area_by_column(&gradient, &pressed.area, k));
                let values = &self.found.values[pressed.values.clone()];
                let batch = &self.batches.batches[pressed.batch];
                let shapes = self.batches.shapes(batch, pressed.point);
                let pressure = self.acting.pressures[pressed.pressure];
                add_load_stiffness::<D, N>(pressure, values, shapes, &slopes, tangent);
            }
            sink.add(nodes, tangent);
        }
    }
}

/// Adds the stiffness of one spring to a block over the nodes of its point and the platen behind them.
fn add_spring<const D: usize, const N: usize>(shapes: &[f64], tie: &Tie, tangent: &mut [f64]) {
    let nodes = shapes.len() / (1 + D) + 1;
    let value = |node: usize| {
        if node + 1 == nodes {
            -1.0
        } else {
            shapes[node * (1 + D)]
        }
    };
    let width = nodes * N;
    for row in 0..nodes {
        for column in 0..nodes {
            tangent[(row * N + tie.component) * width + column * N + tie.component] +=
                tie.penalty * value(row) * value(column);
        }
    }
}

/// Adds `p S_I dA_i/dF_mk S_J,k` for the translations of all pairs of nodes.
fn add_load_stiffness<const D: usize, const N: usize>(
    pressure: f64,
    values: &[f64],
    shapes: &[f64],
    slopes: &[Matrix3<f64>; D],
    tangent: &mut [f64],
) {
    let width = values.len() * N;
    for (row, value) in values.iter().enumerate() {
        for (column, shape) in shapes.chunks_exact(1 + D).enumerate() {
            for i in 0..D {
                for m in 0..D {
                    let slope: f64 = (0..D).map(|k| slopes[k][(i, m)] * shape[1 + k]).sum();
                    tangent[(row * N + i) * width + column * N + m] += pressure * value * slope;
                }
            }
        }
    }
}
