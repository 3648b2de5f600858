//! Conditions on nodes of the grid or mesh, and on points.

use super::Check;
use super::shape::axis_index;
use crate::condition::dirichlet::{Boundary, Component, GridPlane, NodeSet, Place};
use crate::config::file::{BoundaryKeys, FaceKeys, FaceName, ScalarOr};
use crate::config::nearest::{did_you_mean, nearest};
use crate::config::path::Path;
use crate::config::tree::shorten;
use crate::scene::Kinematics;

impl Check<'_> {
    pub(super) fn boundaries(&mut self) -> Option<Vec<Boundary>> {
        let config = self.config;
        let section = Path::root().key("boundary");
        self.names(
            &section,
            config.boundary.iter().map(|boundary| boundary.name.as_deref()),
        );
        let boundaries: Vec<_> = config
            .boundary
            .iter()
            .enumerate()
            .map(|(index, keys)| self.boundary(&section.index(index), keys))
            .collect();
        boundaries.into_iter().collect()
    }

    fn boundary(&mut self, path: &Path, keys: &BoundaryKeys) -> Option<Boundary> {
        let place = match (&keys.face, &keys.selection) {
            (Some(face), None) => self.nodes(path, face, keys).map(Place::Nodes),
            (None, Some(selection)) => self.held(path, selection, keys).map(Place::Points),
            _ => {
                let message = "a condition acts either on nodes or on points";
                self.report(path, message, "either face (nodes) or selection (points)");
                None
            }
        };
        let fix = self.fixed(&path.key("fix"), &keys.fix);
        let moves = self.moves(&path.key("move"), keys);
        let stage = self.stage(path, keys.stage.as_deref());
        let idle = keys.fix.is_empty() && keys.moves.is_empty() && keys.rigid.is_none();
        self.require(
            !idle,
            path,
            "the condition neither fixes nor moves anything",
            "fix, move or both",
        );
        let (place, mut fix, moves) = (place?, fix?, moves?);
        if let (Place::Points(held), Some(_)) = (&place, &keys.rigid) {
            self.complete_platen(held, &mut fix, &moves);
        }
        Some(Boundary {
            name: keys.name.clone().unwrap_or_else(|| path.to_string()),
            place,
            fix,
            moves,
            stage: stage?,
        })
    }

    /// Nodes of a face, as far as a shape holds them.
    fn nodes(&mut self, path: &Path, face: &FaceKeys, keys: &BoundaryKeys) -> Option<NodeSet> {
        let plane = self.face(&path.key("face"), face);
        let within = keys
            .within
            .as_ref()
            .map(|within| self.shape(&path.key("within"), within));
        let of_points = [
            ("penalty", keys.penalty.is_some()),
            ("rigid", keys.rigid.is_some()),
            ("penalise", keys.penalise.is_some()),
        ];
        for (key, given) in of_points {
            let message = "nodes are held exactly, without a penalty";
            self.require(
                !given,
                &path.key(key),
                message,
                "this key with selection in place of face",
            );
        }
        let within = match within {
            Some(shape) => Some(shape?),
            None => None,
        };
        Some(NodeSet { plane: plane?, within })
    }

    /// A plane of nodes, or `Some(None)` for all nodes.
    fn face(&mut self, path: &Path, face: &FaceKeys) -> Option<Option<GridPlane>> {
        let (axis, place) = match face {
            ScalarOr::Scalar(FaceName::All) => return self.sound(path).then_some(None),
            ScalarOr::Scalar(name) => (face_axis(*name).0, path.clone()),
            ScalarOr::Collection(_) if self.has_mesh() => {
                let expected = "a face of the mesh: x_min to z_max along its own axes, or all";
                self.report(path, "a mesh has no planes of nodes", expected);
                return None;
            }
            ScalarOr::Collection(plane) => (axis_index(plane.axis), path.key("axis")),
        };
        let exists = axis < self.kinematics.dimension();
        if !self.require(
            exists,
            &place,
            "plane strain has no axis z",
            "x_min, x_max, y_min, y_max, all, {axis: x, at: ..}",
        ) || !self.sound(path)
        {
            return None;
        }
        let plane = match face {
            ScalarOr::Scalar(name) => self.grid.as_ref()?.face(axis, face_axis(*name).1 > 0.0),
            ScalarOr::Collection(plane) => self.node_plane(&path.key("at"), axis, plane.at)?,
        };
        Some(Some(plane))
    }

    pub(super) fn component(&mut self, path: &Path, name: &str) -> Option<Component> {
        let known = self.unknowns();
        let found = known.iter().position(|candidate| *candidate == name);
        if found.is_none() {
            let hint = match (self.kinematics, name) {
                (_, "alpha") => " without a nonlocal damage field (continuum: gradient_micropolar)".to_owned(),
                (_, "rx" | "ry" | "rz") if !self.continuum.has_rotations() => " in a classical continuum".to_owned(),
                (Kinematics::PlaneStrain, "uz" | "rx" | "ry") => " in plane strain".to_owned(),
                _ => did_you_mean(nearest(name, known.iter().copied())),
            };
            let message = format!("there is no component \"{}\"{hint}", shorten(name));
            self.report(path, message, known.join(", "));
        }
        found.filter(|_| self.sound(path))
    }

    fn fixed(&mut self, path: &Path, names: &[String]) -> Option<Vec<Component>> {
        let mut components = Vec::new();
        let mut right = true;
        for (index, name) in names.iter().enumerate() {
            let Some(component) = self.component(&path.index(index), name) else {
                right = false;
                continue;
            };
            let message = format!("{name} is fixed twice");
            right &= self.require(
                !components.contains(&component),
                &path.index(index),
                message,
                "each component once",
            );
            components.push(component);
        }
        right.then_some(components)
    }

    fn moves(&mut self, path: &Path, keys: &BoundaryKeys) -> Option<Vec<(Component, f64)>> {
        let mut moves = Vec::new();
        let mut right = true;
        for (name, total) in &keys.moves {
            let place = path.key(name);
            let free = !keys.fix.contains(name);
            right &= self.require(
                free,
                &place,
                format!("{name} is fixed and moved"),
                "each component fixed or moved",
            );
            match self.component(&place, name) {
                Some(component) => moves.push((component, *total)),
                None => right = false,
            }
        }
        let rotations = moves
            .iter()
            .filter(|(component, _)| self.unknowns()[*component].starts_with('r'))
            .count();
        let message = "a prescribed rotation is about one fixed axis";
        right &= self.require(rotations <= 1, path, message, "one of rx, ry and rz");
        moves.sort_by_key(|(component, _)| *component);
        right.then_some(moves)
    }
}

/// Axis and sign of the outward normal of a face of the grid.
pub(super) fn face_axis(face: FaceName) -> (usize, f64) {
    match face {
        FaceName::XMin => (0, -1.0),
        FaceName::XMax | FaceName::All => (0, 1.0),
        FaceName::YMin => (1, -1.0),
        FaceName::YMax => (1, 1.0),
        FaceName::ZMin => (2, -1.0),
        FaceName::ZMax => (2, 1.0),
    }
}
