//! Stages that follow their equilibrium path.

use super::Check;
use crate::config::file::{ArcLengthKeys, SelectionKeys};
use crate::config::path::Path;
use crate::points::select::Selection;
use crate::scene::Target;
use crate::solve::settings::ArcLength;

impl Check<'_> {
    /// How the stage with this number follows its path; `Some(None)` where it does not.
    pub(super) fn control(&mut self, stage: usize) -> Option<Option<ArcLength>> {
        let keys = &self.config.stages[stage];
        let Some(control) = &keys.control else {
            return Some(None);
        };
        let entry = Path::root().key("stages").index(stage);
        let path = entry.key("control").key("arc_length");
        let right = [
            self.require(
                keys.adaptive.is_none(),
                &entry.key("adaptive"),
                "the steps follow the path",
                "max_length in control.arc_length instead",
            ),
            self.only_dead_loads_grow(&entry, stage),
            self.sizes(&path, &control.arc_length),
        ];
        let at = match &control.arc_length.at {
            Some(keys) => Some(self.measured(&path.key("at"), keys)?),
            None => None,
        };
        if right.contains(&false) {
            return None;
        }
        let keys = &control.arc_length;
        Some(Some(ArcLength {
            at,
            length: keys.length,
            max_length: keys.max_length,
            target_iterations: keys.target_iterations,
            max_steps: keys.max_steps,
            max_displacement: keys.until.as_ref().map(|until| until.displacement),
        }))
    }

    /// One load factor is the only unknown beside those of the nodes, and the tangent knows it as a dead load.
    fn only_dead_loads_grow(&mut self, entry: &Path, stage: usize) -> bool {
        let config = self.config;
        let control = entry.key("control");
        let is_here = |name: &Option<String>| match name {
            Some(name) => *name == config.stages[stage].name,
            None => stage == 0,
        };
        let loads: Vec<_> = config.loads.iter().filter(|load| is_here(&load.stage)).collect();
        let moved = config
            .boundary
            .iter()
            .position(|boundary| is_here(&boundary.stage) && !boundary.moves.is_empty());
        let dead = "loads of the stage that are specific_weight, gravity, force or couple";
        let mut right = self.require(!loads.is_empty(), &control, "no load grows over the stage", dead);
        let pressed = loads.iter().any(|load| load.pressure.is_some());
        right &= self.require(!pressed, &control, "a pressure grows over the stage", dead);
        if let Some(index) = moved {
            let message = format!("boundary[{index}] moves over the stage");
            right &= self.require(
                false,
                &control,
                message,
                "conditions of the stage that fix, without move",
            );
        }
        let forced = stage == 0 && config.verification.manufactured.is_some();
        right &= self.require(!forced, &control, "a manufactured solution grows over the stage", dead);
        right
            & self.require(
                stage + 1 == config.stages.len(),
                &control,
                "a later stage would need the full load, which the path may never reach",
                "the last stage",
            )
    }

    fn sizes(&mut self, path: &Path, keys: &ArcLengthKeys) -> bool {
        let mut right = self.require(
            keys.max_steps >= 1,
            &path.key("max_steps"),
            "0 steps",
            "a whole number >= 1",
        );
        if let Some(length) = keys.length {
            right &= self.positive(&path.key("length"), length).is_some();
        }
        if let Some(longest) = keys.max_length {
            let shortest = keys.length.unwrap_or(0.0);
            right &= self.require(
                longest > 0.0 && longest >= shortest,
                &path.key("max_length"),
                format!("{longest} is out of bounds"),
                "a number > 0, at least length",
            );
        }
        if let Some(until) = &keys.until {
            let path = path.key("until").key("displacement");
            right &= self.positive(&path, until.displacement).is_some();
        }
        let most = self.config.solver.max_iterations;
        right
            & self.require(
                keys.max_length.is_none() || (1..=most).contains(&keys.target_iterations),
                &path.key("target_iterations"),
                format!("{} is out of bounds", keys.target_iterations),
                format!("a whole number from 1 to {most} (solver.max_iterations)"),
            )
    }

    /// Points whose motion counts.
    fn measured(&mut self, path: &Path, keys: &SelectionKeys) -> Option<Selection> {
        match self.target(path, keys)? {
            Target::Points(selection) => Some(selection),
            Target::Face(_) => {
                self.report(
                    path,
                    "a face of a mesh is no selection of points",
                    "nearest, layer or within",
                );
                None
            }
        }
    }
}
