//! Bodies and where their points come from.

use super::Check;
use super::grid::axis_path;
use crate::config::file::{BodyKeys, OneOrPerAxis, PlacementName, ShapeKeys};
use crate::config::path::Path;
use crate::grid::region::Shape;
use crate::points::placement::Placement;
use crate::points::seed::{Body, PointSource};
use crate::problem::figure;
use crate::scene::BasisKind;

/// More points per cell and axis than this are a slip of the pen.
const MAXIMUM_POINTS: usize = 64;

impl Check<'_> {
    pub(super) fn bodies(&mut self) -> Option<Vec<Body>> {
        let config = self.config;
        let section = Path::root().key("bodies");
        self.names(&section, config.bodies.iter().map(|body| Some(body.name.as_str())));
        let some = self.require(
            !config.bodies.is_empty(),
            &section,
            "there is no body",
            "one body or more",
        );
        let bodies: Vec<_> = config
            .bodies
            .iter()
            .enumerate()
            .map(|(index, keys)| self.body(&section.index(index), keys))
            .collect();
        bodies.into_iter().collect::<Option<_>>().filter(|_| some)
    }

    fn body(&mut self, path: &Path, keys: &BodyKeys) -> Option<Body> {
        let config = self.config;
        let known: Vec<_> = config.materials.keys().map(String::as_str).collect();
        let material = self.lookup(&path.key("material"), &keys.material, "material", "materials", &known);
        let points = match &keys.shape {
            _ if self.has_mesh() => self.points_of_mesh(path, keys),
            None => {
                self.report(&path.key("shape"), "this key is missing", "what the body fills");
                None
            }
            Some(ShapeKeys::Points(file)) => {
                let place = path.key("points_per_cell");
                let message = "the points of this body come from a file";
                self.require(
                    keys.points_per_cell.is_none(),
                    &place,
                    message,
                    "no points_per_cell with a file",
                );
                self.point_file(&path.key("shape").key("points").key("file"), file)
                    .map(PointSource::List)
            }
            Some(shape) => self.lattice(path, keys, shape),
        };
        if !self.has_mesh() {
            let message = "a body made of material points has no mesh";
            let expected = "mesh with model.method: fem, or a shape";
            self.require(keys.mesh.is_none(), &path.key("mesh"), message, expected);
        }
        Some(Body {
            name: keys.name.clone(),
            material: material?,
            points: points?,
        })
    }

    /// The mesh was checked with the section of the grid, which it replaces.
    fn points_of_mesh(&mut self, path: &Path, keys: &BodyKeys) -> Option<PointSource> {
        let message = "a body of finite elements has its shape in its mesh";
        self.require(keys.shape.is_none(), &path.key("shape"), message, "mesh, and no shape");
        let gauss = keys.placement != Some(PlacementName::Even);
        let message = "the points of a mesh are those of Gauss";
        self.require(gauss, &path.key("placement"), message, "gauss, or nothing");
        self.mesh.clone().map(PointSource::Mesh)
    }

    fn lattice(&mut self, path: &Path, keys: &BodyKeys, shape: &ShapeKeys) -> Option<PointSource> {
        let place = path.key("shape");
        let shape = self.shape(&place, shape);
        if let Some(shape) = &shape {
            self.inside_grid(&place, shape);
        }
        let place = path.key("points_per_cell");
        let points_per_cell = match &keys.points_per_cell {
            Some(given) => self.points_per_cell(&place, given),
            None => {
                self.report(&place, "this key is missing", points_bounds());
                None
            }
        };
        Some(PointSource::Lattice {
            shape: shape?,
            points_per_cell: points_per_cell?,
            placement: self.placement(&path.key("placement"), keys.placement)?,
        })
    }

    /// Points with domains must fill their cells without gaps, which those of Gauss do not.
    fn placement(&mut self, path: &Path, name: Option<PlacementName>) -> Option<Placement> {
        let placement = match name {
            None | Some(PlacementName::Even) => Placement::Even,
            Some(PlacementName::Gauss) => Placement::Gauss,
        };
        let domains = self.grid.as_ref().is_some_and(|grid| grid.basis == BasisKind::Gimp);
        let message = "domains around Gauss points do not fill the cell";
        let fits = placement == Placement::Even || !domains;
        self.require(fits, path, message, "even, or gauss with another grid.basis than gimp")
            .then_some(placement)
    }

    pub(super) fn points_per_cell(&mut self, path: &Path, given: &OneOrPerAxis<usize>) -> Option<[usize; 3]> {
        let numbers = self.per_axis(path, given)?;
        let mut points = [1; 3];
        let mut right = true;
        for (axis, number) in numbers.into_iter().enumerate() {
            points[axis] = number;
            let message = format!("{number} is out of bounds");
            let holds = (1..=MAXIMUM_POINTS).contains(&number);
            right &= self.require(holds, &axis_path(path, given, axis), message, points_bounds());
        }
        right.then_some(points)
    }

    /// A body must not reach beyond the grid, as far as its bounds tell.
    fn inside_grid(&mut self, path: &Path, shape: &Shape) {
        let Some(grid) = self.grid.clone() else { return };
        let (low, high) = shape.bounds();
        for axis in 0..self.kinematics.dimension() {
            let size = grid.cell_size[axis];
            let (min, max) = (grid.min[axis], grid.min[axis] + grid.cells[axis] as f64 * size);
            let tolerance = 1e-9 * size * grid.cells[axis] as f64;
            // A shape without end along an axis is cut by the grid on purpose; loose bounds only tell when all is outside.
            let beyond = |end: f64, over: bool| end.is_finite() && over && shape.has_tight_bounds();
            let sticks_out =
                beyond(low[axis], low[axis] < min - tolerance) || beyond(high[axis], high[axis] > max + tolerance);
            let misses = low[axis] >= max || high[axis] <= min;
            let name = ["x", "y", "z"][axis];
            // No shape is empty by itself; a common part may be.
            let (meets, from, to) = (low[axis] < high[axis], figure(low[axis]), figure(high[axis]));
            let message = format!("the shapes do not meet along {name}: one begins at {from}, another ends at {to}");
            let meets = self.require(
                meets,
                path,
                message,
                "shapes with a common part, or any: [..] for their union",
            );
            let message = format!("the body reaches from {from} to {to} along {name}, beyond the grid");
            let expected = format!("a body between {} and {}", figure(min), figure(max));
            if !meets || !self.require(!(sticks_out || misses), path, message, expected) {
                return;
            }
        }
    }
}

fn points_bounds() -> String {
    format!("a whole number from 1 to {MAXIMUM_POINTS}")
}
