//! The background grid.

use super::Check;
use super::boundary::face_axis;
use crate::condition::dirichlet::GridPlane;
use crate::config::file::{BasisName, BoundaryKeys, FaceName, OneOrPerAxis, ScalarOr};
use crate::config::path::Path;
use crate::problem::figure;
use crate::scene::{BasisKind, GridSettings};

/// Largest number of nodes: an index of them must fit into 32 bits.
const MAXIMUM_NODES: f64 = 2_147_483_647.0;

/// How far the extent may be from a whole number of cells, relative to a cell per cell.
const ROUND_OFF: f64 = 1e-9;

impl Check<'_> {
    pub(super) fn grid(&mut self) -> Option<GridSettings> {
        let path = Path::root().key("grid");
        let Some(keys) = &self.config.grid else {
            self.report(&path, "this key is missing", "min, max and cell_size or cells");
            return None;
        };
        let min = self.vector(&path.key("min"), &keys.min);
        let max = self.vector(&path.key("max"), &keys.max);
        let given = (keys.cell_size.as_ref(), keys.cells.as_ref());
        let exactly_one = given.0.is_some() != given.1.is_some();
        let message = if given.0.is_some() {
            "cell_size and cells are both given"
        } else {
            "no size of the cells"
        };
        self.require(exactly_one, &path, message, "either cell_size or cells");
        let (min, max) = (min?, max?);
        let extent = self.extent(&path, min, max)?;
        let (cells, cell_size) = match given {
            (Some(size), None) => self.cells_of_size(&path.key("cell_size"), size, extent)?,
            (None, Some(cells)) => self.cells_of_number(&path.key("cells"), cells, extent)?,
            _ => return None,
        };
        let basis = match keys.basis {
            BasisName::Linear => BasisKind::Linear,
            BasisName::Gimp => BasisKind::Gimp,
            BasisName::BSpline1 => BasisKind::BSpline(1),
            BasisName::BSpline2 => BasisKind::BSpline(2),
            BasisName::BSpline3 => BasisKind::BSpline(3),
        };
        let order = basis.functions().order() as f64;
        let nodes: f64 = cells[..self.kinematics.dimension()]
            .iter()
            .map(|count| *count as f64 + order)
            .product();
        let message = format!("the grid has {nodes:.3e} nodes");
        let fits = self.require(nodes <= MAXIMUM_NODES, &path, message, "at most 2147483647 nodes");
        let mut grid = GridSettings {
            min,
            cell_size,
            cells,
            basis,
            follow_face: None,
        };
        if let Some(face) = keys.follow_face {
            grid.follow_face = Some(self.follow_face(&path.key("follow_face"), face, &grid)?);
        }
        fits.then_some(grid)
    }

    /// The face that the grid follows: one whose motion along its own axis is prescribed.
    fn follow_face(&mut self, path: &Path, face: FaceName, grid: &GridSettings) -> Option<GridPlane> {
        let expected = "a face with `move` of its own axis under `boundary`, as y_max with move: {uy: -0.01}";
        let (axis, normal) = face_axis(face);
        let exists = face != FaceName::All && axis < self.kinematics.dimension();
        if !self.require(exists, path, "the grid cannot follow this face", expected) {
            return None;
        }
        let moving = |keys: &BoundaryKeys| {
            let same = matches!(keys.face, Some(ScalarOr::Scalar(name)) if name == face);
            same && keys.moves.contains_key(self.unknowns()[axis])
        };
        let found = self.config.boundary.iter().any(moving);
        let message = "no motion of this face along its axis is prescribed";
        self.require(found, path, message, expected)
            .then(|| grid.face(axis, normal > 0.0))
    }

    /// Edges of the grid; 1 along an axis that plane strain does not have.
    fn extent(&mut self, path: &Path, min: [f64; 3], max: [f64; 3]) -> Option<[f64; 3]> {
        let mut extent = [1.0; 3];
        let mut right = true;
        for axis in 0..self.kinematics.dimension() {
            extent[axis] = max[axis] - min[axis];
            let message = format!(
                "{} is not larger than grid.min[{axis}] = {}",
                figure(max[axis]),
                figure(min[axis])
            );
            let holds = extent[axis] > 0.0 && extent[axis].is_finite();
            right &= self.require(
                holds,
                &path.key("max").index(axis),
                message,
                "max > min along every axis",
            );
        }
        right.then_some(extent)
    }

    fn cells_of_size(
        &mut self,
        path: &Path,
        size: &OneOrPerAxis<f64>,
        extent: [f64; 3],
    ) -> Option<([usize; 3], [f64; 3])> {
        let dimension = self.kinematics.dimension();
        let sizes = self.per_axis(path, size)?;
        let (mut cells, mut cell_size) = ([1; 3], [1.0; 3]);
        for axis in 0..dimension {
            let entry = axis_path(path, size, axis);
            let ratio = extent[axis] / self.positive(&entry, sizes[axis])?;
            let whole = ratio.round();
            let holds = whole >= 1.0 && (ratio - whole).abs() <= ROUND_OFF * ratio;
            let message = format!(
                "{} does not divide the extent {}: {ratio:.6} cells",
                sizes[axis], extent[axis]
            );
            let holds = self.require(holds, &entry, message, "an extent of whole cells");
            let few = self.require(
                whole <= MAXIMUM_NODES,
                &entry,
                "too many cells",
                "at most 2147483647 nodes",
            );
            if !(holds && few) {
                return None;
            }
            // The extent is exact and the size follows from it, so that the last plane of nodes lies on the face.
            cells[axis] = whole as usize;
            cell_size[axis] = extent[axis] / whole;
        }
        Some((cells, cell_size))
    }

    fn cells_of_number(
        &mut self,
        path: &Path,
        number: &OneOrPerAxis<usize>,
        extent: [f64; 3],
    ) -> Option<([usize; 3], [f64; 3])> {
        let numbers = self.per_axis(path, number)?;
        let (mut cells, mut cell_size) = ([1; 3], [1.0; 3]);
        for axis in 0..self.kinematics.dimension() {
            let entry = axis_path(path, number, axis);
            if !self.require(numbers[axis] >= 1, &entry, "0 cells", "a whole number >= 1") {
                return None;
            }
            cells[axis] = numbers[axis];
            cell_size[axis] = extent[axis] / numbers[axis] as f64;
        }
        Some((cells, cell_size))
    }

    /// The values of the axes of the kinematics, where one value or one per axis is accepted.
    pub(super) fn per_axis<T: Copy>(&mut self, path: &Path, given: &OneOrPerAxis<T>) -> Option<Vec<T>> {
        let dimension = self.kinematics.dimension();
        let values = match given {
            ScalarOr::Scalar(value) => vec![*value; dimension],
            ScalarOr::Collection(values) => values.clone(),
        };
        let message = format!(
            "{} where the kinematics has {dimension} axes",
            super::numbers(values.len())
        );
        let right = self.require(
            values.len() == dimension,
            path,
            message,
            format!("one number, or {dimension}"),
        );
        (right && self.sound(path)).then_some(values)
    }

    /// The plane of nodes at a coordinate.
    pub(super) fn node_plane(&mut self, path: &Path, axis: usize, at: f64) -> Option<GridPlane> {
        let grid = self.grid.clone()?;
        let (min, size, cells) = (grid.min[axis], grid.cell_size[axis], grid.cells[axis]);
        let ratio = (at - min) / size;
        let index = ratio.round();
        let inside = index >= 0.0 && index <= cells as f64;
        let holds = inside && (ratio - index).abs() <= ROUND_OFF * ratio.abs().max(1.0);
        let line = index as usize;
        if holds && (line == 0 || line == cells) {
            return Some(grid.face(axis, line > 0));
        }
        let order = grid.basis.functions().order();
        if order > 1 {
            let message = format!("splines of order {order} take no value from the nodes of an inner plane");
            let max = min + cells as f64 * size;
            let expected = format!("a face of the grid ({min} or {max}), or grid.basis: linear, gimp or bspline1");
            self.report(path, message, expected);
            return None;
        }
        let expected = format!("{min} + n * {size} with n from 0 to {cells}");
        self.require(holds, path, format!("no plane of nodes lies at {at}"), expected)
            .then_some(GridPlane { axis, index: line })
    }
}

/// Path of the value of an axis.
pub(super) fn axis_path<T>(path: &Path, given: &OneOrPerAxis<T>, axis: usize) -> Path {
    match given {
        ScalarOr::Scalar(_) => path.clone(),
        ScalarOr::Collection(_) => path.index(axis),
    }
}
