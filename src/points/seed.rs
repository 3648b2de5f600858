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

impl Region {
    /// Whether it changes the material of points at a position; `edge` is the shortest of the cells [m].
    pub fn holds(&self, position: &[f64; 3], edge: f64) -> bool {
        self.shape.contains(position, -BOUNDARY_MARGIN * edge)
    }

    /// Material that a point of a material has inside.
    pub fn replacement(&self, material: usize) -> Option<usize> {
        let replace = self.replace.iter().find(|(from, _)| *from == material);
        replace.map(|&(_, to)| to)
    }
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
                let lattice = Lattice::new(grid, shape, *points_per_cell, *placement);
                lattice.points(share(world, lattice.cells()))
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

/// Where a body can have points, and how many of them it has, before there are any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent<const D: usize> {
    /// Cells of the box around the body, along each axis.
    pub cells: [usize; D],
    /// Points of the body. A lattice of many is sampled: the number is known to a few thousandths of those in the box.
    pub points: f64,
    /// Share of the box that the body fills.
    pub filled: f64,
}

/// How much of the grid a body takes; allocates nothing that grows with it.
pub fn extent<const D: usize>(grid: &Grid<D>, body: &Body) -> Extent<D> {
    match &body.points {
        PointSource::Lattice {
            shape,
            points_per_cell,
            placement,
        } => {
            let lattice = Lattice::new(grid, shape, *points_per_cell, *placement);
            let filled = lattice.filled();
            Extent {
                cells: lattice.count,
                points: filled * lattice.sites() as f64,
                filled,
            }
        }
        PointSource::List(list) => {
            let cells = grid.cells;
            let most: f64 = cells.iter().map(|&count| count as f64).product();
            // As many points as are usual share a cell.
            let touched = list.len() as f64 / 2f64.powi(D as i32);
            Extent {
                cells,
                points: list.len() as f64,
                filled: (touched / most).min(1.0),
            }
        }
        PointSource::Mesh(settings) => {
            let points = |axis: usize| (settings.cells[axis] * settings.points_per_cell[axis]) as f64;
            Extent {
                cells: std::array::from_fn(|axis| settings.cells[axis]),
                points: (0..D).map(points).product(),
                filled: 1.0,
            }
        }
    }
}

/// Sites of which a lattice is sampled: the share of those inside a shape is known to a thousandth then.
const SAMPLES: u64 = 1 << 18;

/// Places of points in the cells that the bounds of a shape touch.
struct Lattice<'a, const D: usize> {
    grid: &'a Grid<D>,
    shape: &'a Shape,
    rules: [Vec<AxisPoint>; 3],
    /// First cell of the box, and its cells along each axis.
    lowest: [usize; D],
    count: [usize; D],
    per_cell: usize,
}

impl<'a, const D: usize> Lattice<'a, D> {
    fn new(grid: &'a Grid<D>, shape: &'a Shape, points_per_cell: [usize; 3], placement: Placement) -> Self {
        let bounds = shape.bounds();
        let (mut lowest, mut count) = ([0; D], [0; D]);
        for axis in 0..D {
            let clamp = |x: f64| grid.cell_coordinate(axis, x).clamp(0.0, grid.cells[axis] as f64);
            lowest[axis] = clamp(bounds.0[axis]).floor() as usize;
            count[axis] = (clamp(bounds.1[axis]).ceil() as usize).saturating_sub(lowest[axis]);
        }
        let rules = points_per_cell.map(|count| placement.axis_points(count));
        Self {
            grid,
            shape,
            lowest,
            count,
            per_cell: rules[..D].iter().map(Vec::len).product(),
            rules,
        }
    }

    fn cells(&self) -> usize {
        self.count.iter().product()
    }

    fn sites(&self) -> u64 {
        self.cells() as u64 * self.per_cell as u64
    }

    fn cell(&self, mut flat: usize) -> [usize; D] {
        std::array::from_fn(|axis| {
            let place = flat % self.count[axis];
            flat /= self.count[axis];
            self.lowest[axis] + place
        })
    }

    fn site(&self, cell: &[usize; D], mut local: usize) -> SeedPoint {
        let mut point = SeedPoint {
            position: [0.0; 3],
            volume: 1.0,
            half_lengths: [0.0; 3],
        };
        for (axis, &place) in cell.iter().enumerate() {
            let AxisPoint { position, weight } = self.rules[axis][local % self.rules[axis].len()];
            local /= self.rules[axis].len();
            let edge = self.grid.cell_size[axis];
            point.position[axis] = self.grid.min[axis] + (place as f64 + position) * edge;
            point.half_lengths[axis] = 0.5 * weight * edge;
            point.volume *= weight * edge;
        }
        point
    }

    fn holds(&self, point: &SeedPoint) -> bool {
        let margin = -BOUNDARY_MARGIN * self.grid.smallest_edge();
        self.shape.contains(&point.position, margin)
    }

    /// Share of the sites that are inside the shape, of a large lattice by samples that are spread without a pattern.
    fn filled(&self) -> f64 {
        let sites = self.sites();
        let inside = |site: u64| {
            let (cell, local) = (site / self.per_cell as u64, site % self.per_cell as u64);
            self.holds(&self.site(&self.cell(cell as usize), local as usize))
        };
        let count = if sites <= SAMPLES {
            (0..sites).filter(|&site| inside(site)).count()
        } else {
            // Multiples of the golden ratio of 2^64 fill the range evenly, whatever part of them is looked at.
            let spread = |k: u64| (u128::from(k.wrapping_mul(0x9e37_79b9_7f4a_7c15)) * u128::from(sites)) >> 64;
            (0..SAMPLES).filter(|&k| inside(spread(k) as u64)).count()
        };
        count as f64 / sites.clamp(1, SAMPLES) as f64
    }

    /// The points inside the shape in a range of cells.
    fn points(&self, cells: std::ops::Range<usize>) -> Vec<SeedPoint> {
        // Growing copies a large list several times over. What is left empty was never touched, and costs nothing.
        let filled = if self.sites() > SAMPLES { self.filled() } else { 0.0 };
        let expected = filled * (cells.len() * self.per_cell) as f64;
        let mut points = Vec::with_capacity(expected.ceil() as usize);
        for flat in cells {
            let cell = self.cell(flat);
            let sites = (0..self.per_cell).map(|local| self.site(&cell, local));
            points.extend(sites.filter(|point| self.holds(point)));
        }
        points
    }
}

/// Material of a point after the regions, in their order.
fn material_at(regions: &[Region], material: usize, position: &[f64; 3], edge: f64) -> usize {
    regions
        .iter()
        .fold(material, |material, region| match region.holds(position, edge) {
            true => region.replacement(material).unwrap_or(material),
            false => material,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn body(shape: Shape, points_per_cell: usize) -> Body {
        Body {
            name: "body".to_owned(),
            material: 0,
            points: PointSource::Lattice {
                shape,
                points_per_cell: [points_per_cell; 3],
                placement: Placement::Even,
            },
        }
    }

    fn grid(cells: usize) -> Grid<2> {
        Grid {
            min: [0.0; 2],
            cell_size: [1.0 / cells as f64; 2],
            cells: [cells; 2],
            order: 1,
        }
    }

    fn disc(radius: f64) -> Shape {
        Shape::Cylinder {
            axis: 2,
            centre: [0.5, 0.5, 0.0],
            radius,
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
        }
    }

    #[test]
    fn points_are_counted_before_there_are_any() {
        let ring = Shape::All(vec![disc(0.5), Shape::Not(Box::new(disc(0.45)))]);
        let area = std::f64::consts::PI * (0.25 - 0.2025);
        for (cells, per_cell) in [(10, 2), (100, 3), (40_000, 64)] {
            let found = extent(&grid(cells), &body(ring.clone(), per_cell));
            assert_eq!(found.cells, [cells; 2]);
            let sites = ((cells * per_cell) as f64).powi(2);
            let exact = if cells == 10 { 0.03 } else { 0.003 };
            assert!((found.points / sites - area).abs() < exact, "{found:?}");
            assert_eq!(found.points, found.filled * sites);
        }
        let (grid, body) = (grid(20), body(disc(0.3), 2));
        let PointSource::Lattice { shape, .. } = &body.points else {
            unreachable!()
        };
        let seeded = Lattice::new(&grid, shape, [2; 3], Placement::Even).points(0..144);
        assert_eq!(extent(&grid, &body).points, seeded.len() as f64);
    }

    #[test]
    fn samples_follow_no_pattern_of_the_lattice() {
        // Every other column of cells along either axis.
        for axis in 0..2 {
            let strip = |k: usize| {
                let (mut min, mut max) = ([0.0, 0.0, f64::NEG_INFINITY], [1.0, 1.0, f64::INFINITY]);
                (min[axis], max[axis]) = (k as f64 / 256.0, (k + 1) as f64 / 256.0);
                Shape::Box { min, max }
            };
            let strips = Shape::Any((0..256).step_by(2).map(strip).collect());
            let found = extent(&grid(256), &body(strips, 8));
            assert!((found.filled - 128.0 / 255.0).abs() < 0.005, "{found:?}");
        }
    }
}
