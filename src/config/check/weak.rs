//! Conditions on points, by a penalty.

use super::Check;
use crate::condition::dirichlet::Component;
use crate::condition::weak::{Held, Measure};
use crate::config::file::{BoundaryKeys, PenaliseName, RigidKeys, SelectionKeys};
use crate::config::path::Path;
use crate::scene::Target;

impl Check<'_> {
    /// Points and springs of a condition.
    pub(super) fn held(&mut self, path: &Path, selection: &SelectionKeys, keys: &BoundaryKeys) -> Option<Held> {
        let place = path.key("selection");
        let selection = match self.target(&place, selection) {
            Some(Target::Points(selection)) => Some(selection),
            Some(Target::Face(_)) => {
                let expected = "points, or face: .. in place of selection for nodes of the mesh";
                self.report(&place, "a face of the mesh has nodes, not points", expected);
                None
            }
            None => None,
        };
        let message = "a selection of points is not cut by a shape";
        let expected = "selection: {within: SHAPE}";
        self.require(keys.within.is_none(), &path.key("within"), message, expected);
        let penalty = match keys.penalty {
            Some(penalty) => self.positive(&path.key("penalty"), penalty),
            None => {
                let expected = "a stiffness > 0 in N/m for each point of the selection";
                self.report(&path.key("penalty"), "this key is missing", expected);
                None
            }
        };
        let free = match &keys.rigid {
            Some(rigid) => self.free(&path.key("rigid"), rigid, keys),
            None => Some(Vec::new()),
        };
        Some(Held {
            selection: selection?,
            penalty: penalty?,
            free: free?,
            measure: match keys.penalise {
                Some(PenaliseName::Increment) => Measure::Increment,
                Some(PenaliseName::Total) | None => Measure::Total,
            },
        })
    }

    /// Free translations of a platen.
    fn free(&mut self, path: &Path, rigid: &RigidKeys, keys: &BoundaryKeys) -> Option<Vec<Component>> {
        let path = path.key("free");
        let dimension = self.kinematics.dimension();
        let translations = self.unknowns()[..dimension].join(", ");
        let mut free: Vec<Component> = Vec::new();
        let mut right = true;
        for (index, name) in rigid.free.iter().enumerate() {
            let place = path.index(index);
            let Some(component) = self.component(&place, name) else {
                right = false;
                continue;
            };
            let message = format!("{name} is not a translation: a platen does not turn");
            right &= self.require(component < dimension, &place, message, translations.as_str());
            let other = free.contains(&component) || keys.fix.contains(name) || keys.moves.contains_key(name);
            let message = format!("{name} is free and also named elsewhere");
            right &= self.require(!other, &place, message, "each component once: free, fixed or moved");
            free.push(component);
        }
        let message = "a platen with every motion free holds nothing";
        right &= self.require(
            free.len() < dimension,
            &path,
            message,
            "at most all but one of the translations",
        );
        right.then_some(free)
    }

    /// Fixes the translations of a platen that nothing is said of.
    pub(super) fn complete_platen(&self, held: &Held, fix: &mut Vec<Component>, moves: &[(Component, f64)]) {
        for component in 0..self.kinematics.dimension() {
            let moved = moves.iter().any(|&(moved, _)| moved == component);
            if !moved && !held.free.contains(&component) && !fix.contains(&component) {
                fix.push(component);
            }
        }
    }
}
