//! Weights, forces, couples and pressures.

use super::Check;
use super::material::Material;
use crate::condition::pressure::Side;
use crate::config::file::{LoadKeys, OneOrPerAxis, ScalarOr, SelectionKeys};
use crate::config::path::Path;
use crate::points::select::Selection;
use crate::scene::{Kinematics, Load, LoadKind, Target};

const KINDS: &str = "exactly one of specific_weight, gravity, force, couple, pressure";

impl Check<'_> {
    /// `materials` with their variants, where they are known: weights are given for each of them.
    pub(super) fn loads(&mut self, materials: Option<&[Material]>) -> Option<Vec<Load>> {
        let config = self.config;
        let section = Path::root().key("loads");
        self.names(&section, config.loads.iter().map(|load| load.name.as_deref()));
        let loads: Vec<_> = config
            .loads
            .iter()
            .enumerate()
            .map(|(index, keys)| self.load(&section.index(index), keys, materials))
            .collect();
        loads.into_iter().collect()
    }

    fn load(&mut self, path: &Path, keys: &LoadKeys, materials: Option<&[Material]>) -> Option<Load> {
        let stage = self.stage(path, keys.stage.as_deref());
        let given = (
            &keys.specific_weight,
            &keys.gravity,
            &keys.force,
            &keys.couple,
            keys.pressure,
        );
        let kind = match given {
            (Some(weight), None, None, None, None) => {
                self.without_points(path, keys);
                let weight = self.vector(&path.key("specific_weight"), weight);
                weight
                    .zip(materials)
                    .map(|(weight, list)| LoadKind::SpecificWeight(vec![weight; list.len()]))
            }
            (None, Some(gravity), None, None, None) => {
                self.without_points(path, keys);
                self.gravity(&path.key("gravity"), gravity, materials)
            }
            (None, None, Some(force), None, None) => {
                let total = self.vector(&path.key("force"), force);
                let at = self.points_of(path, keys);
                total.zip(at).map(|(total, at)| LoadKind::Force { total, at })
            }
            (None, None, None, Some(couple), None) => {
                let carried = self.require_rotations(&path.key("couple"), "a force");
                let total = self.couple(&path.key("couple"), couple);
                let at = self.points_of(path, keys);
                total
                    .zip(at)
                    .filter(|_| carried)
                    .map(|(total, at)| LoadKind::Couple { total, at })
            }
            (None, None, None, None, Some(pressure)) => {
                let at = self.surface_of(path, keys);
                at.map(|at| LoadKind::Pressure { pressure, at })
            }
            (None, None, None, None, None) => {
                self.report(path, "no load is given", KINDS);
                None
            }
            _ => {
                self.report(path, "one entry gives several loads", KINDS);
                None
            }
        };
        let name = keys.name.clone().unwrap_or_else(|| path.to_string());
        Some(Load {
            name,
            kind: kind?,
            stage: stage?,
        })
    }

    fn without_points(&mut self, path: &Path, keys: &LoadKeys) {
        let message = "a weight acts on all points";
        self.require(
            keys.at.is_none(),
            &path.key("at"),
            message,
            "no selection with specific_weight or gravity",
        );
    }

    fn points_of(&mut self, path: &Path, keys: &LoadKeys) -> Option<Target> {
        let path = path.key("at");
        let Some(at) = &keys.at else {
            self.report(
                &path,
                "this key is missing",
                "the points that share the load: nearest, layer or within",
            );
            return None;
        };
        if let SelectionKeys::Load(_) = at {
            let message = "a load cannot take its points from a load";
            self.report(&path.key("load"), message, "nearest, layer or within");
            return None;
        }
        self.target(&path, at)
    }

    /// A part of the surface of a body: its points, with the sides of their domains that carry the pressure.
    fn surface_of(&mut self, path: &Path, keys: &LoadKeys) -> Option<Vec<(Selection, Side)>> {
        const ACCEPTED: &str = "surface: {body: ..}, or layer: {body: .., face: x_max}";
        let entry = path;
        let path = path.key("at");
        let Some(at) = &keys.at else {
            self.report(&path, "this key is missing", ACCEPTED);
            return None;
        };
        if self.has_mesh() {
            let message = "a pressure acts on material points, not on a mesh";
            self.report(&path, message, "method: mpm, or force on a face of the mesh");
            return None;
        }
        match (at, self.points_of(entry, keys)?) {
            (SelectionKeys::Surface(_), Target::Points(Selection::Surface { body, sides })) => {
                let patch = |&(axis, upper): &(usize, bool)| {
                    let sides = vec![(axis, upper)];
                    (Selection::Surface { body, sides }, Side { axis, upper })
                };
                Some(sides.iter().map(patch).collect())
            }
            (SelectionKeys::Layer(_), Target::Points(Selection::Layer { body, direction })) => {
                let axis = direction.iter().position(|component| component.abs() == 1.0);
                let message = "the area of a layer that is not normal to an axis is not known";
                self.require(axis.is_some(), &path.key("layer").key("direction"), message, ACCEPTED);
                let axis = axis?;
                let side = Side {
                    axis,
                    upper: direction[axis] > 0.0,
                };
                Some(vec![(Selection::Layer { body, direction }, side)])
            }
            _ => {
                self.report(
                    &path,
                    "these points are no surface: they have no area and no normal",
                    ACCEPTED,
                );
                None
            }
        }
    }

    /// Three numbers, or one about z in plane strain, where the others must be zero.
    fn couple(&mut self, path: &Path, couple: &OneOrPerAxis<f64>) -> Option<[f64; 3]> {
        let plane = self.kinematics == Kinematics::PlaneStrain;
        let accepted = if plane {
            "one number, or [0, 0, couple]"
        } else {
            "a list of 3 numbers"
        };
        let total = match couple {
            ScalarOr::Scalar(about_z) if plane => Some([0.0, 0.0, *about_z]),
            ScalarOr::Collection(values) => values.as_slice().try_into().ok(),
            ScalarOr::Scalar(_) => None,
        };
        let total = total.filter(|[x, y, _]| !plane || (*x == 0.0 && *y == 0.0));
        self.require(
            total.is_some(),
            path,
            "this is not a couple of these kinematics",
            accepted,
        );
        total.filter(|_| self.sound(path))
    }

    /// Weights by density; every material that a body is made of must have one.
    fn gravity(&mut self, path: &Path, gravity: &[f64], materials: Option<&[Material]>) -> Option<LoadKind> {
        let config = self.config;
        let gravity = self.vector(path, gravity)?;
        let mut lacking: Vec<_> = config.bodies.iter().map(|body| body.material.as_str()).collect();
        lacking.retain(|name| config.materials.get(*name).is_some_and(|keys| keys.density.is_none()));
        lacking.sort_unstable();
        lacking.dedup();
        for name in &lacking {
            let sound = self.sound(&Path::root().key("materials").key(name));
            let message = format!("the material \"{name}\" of a body has no density");
            self.require(
                !sound,
                path,
                message,
                "density in the materials of all bodies, or specific_weight",
            );
        }
        let weight = |material: &Material| gravity.map(|value| value * material.density.unwrap_or(0.0));
        let weights = materials?.iter().map(weight).collect();
        lacking.is_empty().then_some(LoadKind::SpecificWeight(weights))
    }
}
