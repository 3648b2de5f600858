//! Filling shapes with points.

use super::Points;
use super::elements::{Elements, MeshSettings};
use super::placement::{AxisPoint, Placement};
use crate::continuum::Continuum;
use crate::grid::region::Shape;
use crate::grid::{Grid, InitialNodes};
use crate::parallel::World;
use nalgebra::SVector;

#[derive(Clone, Debug)]
pub struct Body {
    pub name: String,
    /// Index into `Scene::materials`, before regions.
    pub material: usize,
    pub points: PointSource,
}

/// Where the points of a body come from.
#[derive(Clone, Debug)]
pub enum PointSource {
    /// Seeded in each cell; those whose centre is outside the shape are left out.
    Lattice {
        shape: Shape,
        points_per_cell: [usize; 3],
        placement: Placement,
    },
    /// Read from a file.
    List(Vec<SeedPoint>),
    /// At Gauss' places in the cells of a mesh of the body's own; it is the only body then.
    Mesh(MeshSettings),
}

/// A point read from a file.
#[derive(Clone, Copy, Debug)]
pub struct SeedPoint {
    pub position: [f64; 3],
    pub volume: f64,
    pub half_lengths: [f64; 3],
}

/// Where a shape holds, material `from` is replaced by material `to`; regions apply in order.
#[derive(Clone, Debug)]
pub struct Region {
    pub shape: Shape,
    pub replace: Vec<(usize, usize)>,
}

/// A point counts as inside a shape only where it lies deeper than this, in cells: on the boundary is outside.
const BOUNDARY_MARGIN: f64 = 1.0e-9;

/// Collective. The points of all bodies where they are in the initial state, without histories, spread evenly over the
/// ranks in the order of seeding. Also the number of points of each body.
pub fn seed<C: Continuum, const D: usize>(
    world: &World,
    grid: &Grid<D>,
    bodies: &[Body],
    regions: &[Region],
) -> (Points<C, D>, Vec<u64>) {
    let mut points = Points::without_histories();
    let mut counts = Vec::new();
    let mut first_id = 0;
    for (index, body) in bodies.iter().enumerate() {
        let mut edge = grid.smallest_edge();
        let own = match &body.points {
            PointSource::Lattice {
                shape,
                points_per_cell,
                placement,
            } => {
                let inside =
                    |point: &SeedPoint| shape.contains(&point.position, -BOUNDARY_MARGIN * grid.smallest_edge());
                let rules = points_per_cell.map(|count| placement.axis_points(count));
                lattice(world, grid, shape.bounds(), &rules, inside)
            }
            PointSource::List(list) => share(world, list.len()).map(|k| list[k]).collect(),
            PointSource::Mesh(settings) => {
                let elements = Elements::<D>::new(settings);
                edge = elements.mesh.smallest_edge();
                let own = share(world, elements.points());
                own.map(|id| elements.seed_point(id as u64)).collect()
            }
        };
        let per_rank = world.all_gather(own.len());
        let first_own = first_id + per_rank[..world.rank()].iter().sum::<usize>() as u64;
        reserve(&mut points, own.len());
        for (id, point) in (first_own..).zip(&own) {
            let material = material_at(regions, body.material, &point.position, edge);
            push(&mut points, id, index, material, point);
        }
        let count = per_rank.iter().sum::<usize>() as u64;
        first_id += count;
        counts.push(count);
    }
    (points, counts)
}

/// This rank's share of a list of items.
fn share(world: &World, items: usize) -> std::ops::Range<usize> {
    let bound = |rank: usize| items * rank / world.size();
    bound(world.rank())..bound(world.rank() + 1)
}

/// The lattice points inside a shape, of this rank's share of the cells that its bounds touch.
fn lattice<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    bounds: ([f64; 3], [f64; 3]),
    rules: &[Vec<AxisPoint>; 3],
    inside: impl Fn(&SeedPoint) -> bool,
) -> Vec<SeedPoint> {
    let (mut lowest, mut count) = ([0; D], [0; D]);
    for axis in 0..D {
        let clamp = |x: f64| grid.cell_coordinate(axis, x).clamp(0.0, grid.cells[axis] as f64);
        lowest[axis] = clamp(bounds.0[axis]).floor() as usize;
        count[axis] = (clamp(bounds.1[axis]).ceil() as usize).saturating_sub(lowest[axis]);
    }
    let per_cell: usize = rules[..D].iter().map(Vec::len).product();
    let cells = share(world, count.iter().product());
    let mut points = Vec::new();
    // Growing copies a large list several times over. Room that a shape leaves empty costs nothing; where there is not so
    // much, the list grows.
    let _ = points.try_reserve(cells.len().saturating_mul(per_cell));
    for mut flat in cells {
        let mut cell = [0; D];
        for axis in 0..D {
            cell[axis] = lowest[axis] + flat % count[axis];
            flat /= count[axis];
        }
        for mut local in 0..per_cell {
            let mut point = SeedPoint {
                position: [0.0; 3],
                volume: 1.0,
                half_lengths: [0.0; 3],
            };
            for axis in 0..D {
                let AxisPoint { position, weight } = rules[axis][local % rules[axis].len()];
                local /= rules[axis].len();
                let edge = grid.cell_size[axis];
                point.position[axis] = grid.min[axis] + (cell[axis] as f64 + position) * edge;
                point.half_lengths[axis] = 0.5 * weight * edge;
                point.volume *= weight * edge;
            }
            if inside(&point) {
                points.push(point);
            }
        }
    }
    points
}

/// Material of a point after the regions, in their order.
fn material_at(regions: &[Region], material: usize, position: &[f64; 3], edge: f64) -> usize {
    regions.iter().fold(material, |material, region| {
        if !region.shape.contains(position, -BOUNDARY_MARGIN * edge) {
            return material;
        }
        region
            .replace
            .iter()
            .find(|(from, _)| *from == material)
            .map_or(material, |&(_, to)| to)
    })
}

/// Makes room for so many points more.
fn reserve<C: Continuum, const D: usize>(points: &mut Points<C, D>, count: usize) {
    points.id.reserve(count);
    points.body.reserve(count);
    points.material.reserve(count);
    points.marks.reserve(count);
    points.position.reserve(count);
    points.displacement.reserve(count);
    points.volume.reserve(count);
    points.reference_half_lengths.reserve(count);
    points.half_lengths.reserve(count);
}

fn push<C: Continuum, const D: usize>(
    points: &mut Points<C, D>,
    id: u64,
    body: usize,
    material: usize,
    point: &SeedPoint,
) {
    let half_lengths = SVector::from_fn(|k, _| point.half_lengths[k]);
    points.id.push(id);
    points.body.push(body as u32);
    points.material.push(material as u32);
    points.marks.push(0);
    points.position.push(SVector::from_fn(|k, _| point.position[k]));
    points.displacement.push(SVector::zeros());
    points.volume.push(point.volume);
    points.reference_half_lengths.push(half_lengths);
    points.half_lengths.push(half_lengths);
}
