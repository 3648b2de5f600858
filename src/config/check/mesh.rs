//! The mesh of finite elements: that of the only body.

use super::Check;
use super::boundary::face_axis;
use super::grid::axis_path;
use crate::config::file::{FaceName, MeshKeys, MethodName, ShapeKeys};
use crate::config::path::Path;
use crate::config::write::DEFAULT_POINTS_OF_MESH;
use crate::grid::mesh::MeshFace;
use crate::grid::region::Shape;
use crate::points::elements::MeshSettings;
use crate::scene::{BasisKind, GridSettings};

/// Largest number of nodes of a mesh: every rank holds about 100 bytes for each.
const MAXIMUM_NODES: f64 = 10_000_000.0;

impl Check<'_> {
    /// Whether the scene is one of finite elements.
    pub(super) fn has_mesh(&self) -> bool {
        self.config.model.method == MethodName::Fem
    }

    /// The mesh of the only body; reports what stands in its way.
    pub(super) fn mesh(&mut self) -> Option<MeshSettings> {
        let config = self.config;
        let expected = "no section with model.method: fem";
        let message = "finite elements have a mesh of their own";
        self.require(config.grid.is_none(), &Path::root().key("grid"), message, expected);
        let ghost = Path::root().key("stabilisation").key("ghost");
        let message = "the cells of a mesh are full";
        self.require(config.stabilisation.ghost.is_none(), &ghost, message, expected);
        let bodies = Path::root().key("bodies");
        let message = format!("{} bodies", config.bodies.len());
        let few = config.bodies.len() <= 1;
        self.require(few, &bodies, message, "one body with model.method: fem");
        let body = config.bodies.first()?;
        let path = bodies.index(0);
        let Some(keys) = &body.mesh else {
            let expected = "box or ring_sector with cells, as model.method is fem";
            self.report(&path.key("mesh"), "this key is missing", expected);
            return None;
        };
        let shape = self.shape_of_mesh(&path.key("mesh"), keys);
        let cells = self.cells_of_mesh(&path.key("mesh").key("cells"), keys);
        let points_per_cell = match &body.points_per_cell {
            Some(given) => self.points_per_cell(&path.key("points_per_cell"), given),
            None => self.points_per_cell(&path.key("points_per_cell"), &DEFAULT_POINTS_OF_MESH),
        };
        let (shape, cells) = (shape?, cells?);
        self.angle_of_cells(&path.key("mesh").key("cells"), &shape, cells[0])
            .then_some(MeshSettings {
                shape,
                cells,
                points_per_cell: points_per_cell?,
            })
    }

    fn shape_of_mesh(&mut self, path: &Path, keys: &MeshKeys) -> Option<Shape> {
        match (&keys.cuboid, &keys.ring_sector) {
            (Some(keys), None) => self.shape(path, &ShapeKeys::Box(keys.clone())),
            (None, Some(keys)) => {
                let shape = self.shape(path, &ShapeKeys::RingSector(keys.clone()))?;
                let path = path.key("ring_sector");
                let message = "the cells at the centre would have no inner face";
                let open = self.require(
                    keys.inner_radius > 0.0,
                    &path.key("inner_radius"),
                    message,
                    "a number > 0",
                );
                let message = "the ends of the mesh would meet";
                let short = keys.to_angle < keys.from_angle + 360.0;
                let expected = "from_angle < to_angle < from_angle + 360";
                let short = self.require(short, &path.key("to_angle"), message, expected);
                (open && short).then_some(shape)
            }
            _ => {
                self.report(path, "a mesh fills one shape", "either box or ring_sector");
                None
            }
        }
    }

    fn cells_of_mesh(&mut self, path: &Path, keys: &MeshKeys) -> Option<[usize; 3]> {
        let numbers = self.per_axis(path, &keys.cells)?;
        let mut cells = [1; 3];
        for (axis, number) in numbers.into_iter().enumerate() {
            let entry = axis_path(path, &keys.cells, axis);
            if !self.require(number >= 1, &entry, "0 cells", "a whole number >= 1") {
                return None;
            }
            cells[axis] = number;
        }
        let dimension = self.kinematics.dimension();
        let nodes: f64 = cells[..dimension].iter().map(|&count| count as f64 + 1.0).product();
        let message = format!("the mesh has {nodes:.3e} nodes");
        let fits = nodes <= MAXIMUM_NODES;
        self.require(fits, path, message, format!("at most {MAXIMUM_NODES} nodes"))
            .then_some(cells)
    }

    /// Cells have straight edges: one that spans half a turn is flat.
    fn angle_of_cells(&mut self, path: &Path, shape: &Shape, cells: usize) -> bool {
        let Shape::RingSector {
            from_angle, to_angle, ..
        } = shape
        else {
            return true;
        };
        let angle = ((to_angle - from_angle) / cells as f64).to_degrees();
        let message = format!("a cell spans {angle} degrees");
        let expected = "cells that span less than 180 degrees of the ring";
        self.require(angle < 180.0 - 1e-6, path, message, expected)
    }

    /// Cells and nodes of the mesh by number, as a grid with cells of unit size.
    pub(super) fn grid_of_mesh(&self) -> Option<GridSettings> {
        Some(GridSettings {
            min: [0.0; 3],
            cell_size: [1.0; 3],
            cells: self.mesh.as_ref()?.cells,
            basis: BasisKind::Linear,
            follow_face: None,
        })
    }

    /// A face of the mesh that a selection names.
    pub(super) fn face_of_mesh(&mut self, path: &Path, face: FaceName) -> Option<MeshFace> {
        let message = "only a mesh has faces that carry loads";
        let right = self.require(self.has_mesh(), path, message, "nearest, layer, within or load");
        let (axis, sign) = face_axis(face);
        let exists = face != FaceName::All && axis < self.kinematics.dimension();
        let axes = &["x_min, x_max", "y_min, y_max", "z_min, z_max"][..self.kinematics.dimension()];
        let exists = self.require(exists, path, "the mesh has no such face", axes.join(", "));
        let upper = sign > 0.0;
        (right && exists && self.sound(path)).then_some(MeshFace { axis, upper })
    }
}
