//! Selections of material points.

use super::Check;
use super::boundary::face_axis;
use crate::config::file::{FaceName, LayerKeys, SelectionKeys, ShapeKeys, SurfaceKeys};
use crate::config::path::Path;
use crate::points::select::Selection;
use crate::scene::Target;

impl Check<'_> {
    /// Points, or a face of a mesh.
    pub(super) fn target(&mut self, path: &Path, keys: &SelectionKeys) -> Option<Target> {
        let selection = match keys {
            SelectionKeys::Nearest(position) => self.vector(&path.key("nearest"), position).map(Selection::Nearest),
            SelectionKeys::Layer(layer) => self.layer(&path.key("layer"), layer),
            SelectionKeys::Surface(surface) => self.surface(&path.key("surface"), surface),
            SelectionKeys::Within(shape) => self.shape(&path.key("within"), shape).map(Selection::Within),
            SelectionKeys::Load(name) => return self.target_of_load(&path.key("load"), name),
            SelectionKeys::Face(face) => return self.face_of_mesh(&path.key("face"), *face).map(Target::Face),
        };
        selection.map(Target::Points)
    }

    fn layer(&mut self, path: &Path, keys: &LayerKeys) -> Option<Selection> {
        let config = self.config;
        let known: Vec<_> = config.bodies.iter().map(|body| body.name.as_str()).collect();
        let body = self.lookup(&path.key("body"), &keys.body, "body", "bodies", &known);
        let direction = match (keys.face, &keys.direction) {
            (Some(_), None) if self.has_mesh() => {
                let expected = "direction; or {face: x_max} in place of layer for a face of the mesh";
                self.report(&path.key("face"), "there is no grid with faces", expected);
                None
            }
            (Some(face), None) => self.face_direction(&path.key("face"), face),
            (None, Some(direction)) => self.direction(&path.key("direction"), direction),
            _ => {
                self.report(path, "a layer is found by one direction", "either face or direction");
                None
            }
        };
        Some(Selection::Layer {
            body: body?,
            direction: direction?,
        })
    }

    fn surface(&mut self, path: &Path, keys: &SurfaceKeys) -> Option<Selection> {
        let config = self.config;
        let known: Vec<_> = config.bodies.iter().map(|body| body.name.as_str()).collect();
        let body = self.lookup(&path.key("body"), &keys.body, "body", "bodies", &known)?;
        let on_lattice = !self.has_mesh() && !matches!(config.bodies[body].shape, Some(ShapeKeys::Points(_)));
        let message = "the surface of this body is not known: its points are on no lattice of the grid";
        let expected = "a body with a shape other than points, or layer";
        self.require(on_lattice, &path.key("body"), message, expected);
        let all = [
            FaceName::XMin,
            FaceName::XMax,
            FaceName::YMin,
            FaceName::YMax,
            FaceName::ZMin,
            FaceName::ZMax,
        ];
        let facing = match &keys.facing {
            Some(facing) => facing.clone(),
            None => all[..2 * self.kinematics.dimension()].to_vec(),
        };
        let message = "no direction is given";
        let right = self.require(
            !facing.is_empty(),
            &path.key("facing"),
            message,
            "one or more of x_min to z_max",
        );
        let mut sides = Vec::new();
        for (index, face) in facing.iter().enumerate() {
            let direction = self.face_direction(&path.key("facing").index(index), *face)?;
            let axis = direction.iter().position(|&component| component != 0.0)?;
            let side = (axis, direction[axis] > 0.0);
            if !sides.contains(&side) {
                sides.push(side);
            }
        }
        sides.sort_unstable();
        (on_lattice && right).then_some(Selection::Surface { body, sides })
    }

    fn face_direction(&mut self, path: &Path, face: FaceName) -> Option<[f64; 3]> {
        let (axis, sign) = face_axis(face);
        let exists = face != FaceName::All && axis < self.kinematics.dimension();
        let axes = &["x_min, x_max", "y_min, y_max", "z_min, z_max"][..self.kinematics.dimension()];
        let right = self.require(exists, path, "no layer of points lies there", axes.join(", "));
        let mut direction = [0.0; 3];
        direction[axis] = sign;
        (right && self.sound(path)).then_some(direction)
    }

    fn direction(&mut self, path: &Path, direction: &[f64]) -> Option<[f64; 3]> {
        let direction = self.vector(path, direction)?;
        let length = direction.iter().map(|value| value * value).sum::<f64>().sqrt();
        let right = self.require(
            length > 0.0,
            path,
            "the direction is zero",
            "a direction of any length but zero",
        );
        right.then(|| direction.map(|value| value / length))
    }

    /// What a named load acts on.
    fn target_of_load(&mut self, path: &Path, name: &str) -> Option<Target> {
        let index = self.named_load(path, name)?;
        let at = &self.config.loads[index].at;
        if let Some(SelectionKeys::Face(face)) = at {
            // Reported where the load names it.
            let place = Path::root().key("loads").index(index).key("at").key("face");
            return self.face_of_mesh(&place, *face).map(Target::Face);
        }
        let message = format!("the load \"{name}\" acts on no selected points");
        self.require(at.is_some(), path, message, "a load of force, couple or pressure")
            .then_some(Target::Points(Selection::Load(index)))
    }

    /// The index of a named load.
    pub(super) fn named_load(&mut self, path: &Path, name: &str) -> Option<usize> {
        let config = self.config;
        let named = config
            .loads
            .iter()
            .enumerate()
            .filter_map(|(index, load)| Some((index, load.name.as_deref()?)));
        let (indices, names): (Vec<_>, Vec<_>) = named.unzip();
        self.lookup(path, name, "load", "loads", &names)
            .map(|found| indices[found])
    }
}
