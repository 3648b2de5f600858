//! Stages, tolerances, solver and stabilisation.

use super::Check;
use crate::config::file::{AdaptiveKeys, GhostScalingName, PartitionerName, RepeatableName, SolverMethodName};
use crate::config::path::Path;
use crate::grid::ghost::{GhostScaling, GhostSettings};
use crate::solve::settings::{Adaptive, PartitionerKind, Repeatable, SolverMethod, SolverSettings, Stage};

const MAXIMUM_HALVINGS: u32 = 40;

impl Check<'_> {
    pub(super) fn stages(&mut self) -> Option<Vec<Stage>> {
        let config = self.config;
        let section = Path::root().key("stages");
        self.names(&section, config.stages.iter().map(|stage| Some(stage.name.as_str())));
        let mut right = self.require(
            !config.stages.is_empty(),
            &section,
            "there is no stage",
            "one stage or more",
        );
        let mut stages = Vec::new();
        for (index, keys) in config.stages.iter().enumerate() {
            let path = section.index(index);
            right &= self.require(keys.steps >= 1, &path.key("steps"), "0 steps", "a whole number >= 1");
            let message = format!("{} is out of bounds", keys.max_halvings);
            let bounds = format!("a whole number from 0 to {MAXIMUM_HALVINGS}");
            right &= self.require(
                keys.max_halvings <= MAXIMUM_HALVINGS,
                &path.key("max_halvings"),
                message,
                bounds,
            );
            let adaptive = keys
                .adaptive
                .as_ref()
                .map(|keys| self.adaptive(&path.key("adaptive"), keys, config.stages[index].steps));
            right &= adaptive != Some(None);
            let control = self.control(index);
            right &= control.is_some();
            stages.push(Stage {
                name: keys.name.clone(),
                steps: keys.steps,
                max_halvings: keys.max_halvings,
                adaptive: adaptive.flatten(),
                control: control.flatten(),
            });
        }
        right.then_some(stages)
    }

    fn adaptive(&mut self, path: &Path, keys: &AdaptiveKeys, steps: usize) -> Option<Adaptive> {
        let equal = 1.0 / steps.max(1) as f64;
        let message = format!("{} is out of bounds", keys.max_step);
        // Shares such as 0.3333 of a third are meant.
        let holds = keys.max_step >= 0.99 * equal && keys.max_step <= 1.0;
        let bounds = format!("a share of the stage from {equal} (1/steps) to 1");
        let mut right = self.require(holds, &path.key("max_step"), message, bounds);
        let most = self.config.solver.max_iterations;
        let message = format!("{} is out of bounds", keys.target_iterations);
        let bounds = format!("a whole number from 1 to {most} (solver.max_iterations)");
        let holds = (1..=most).contains(&keys.target_iterations);
        right &= self.require(holds, &path.key("target_iterations"), message, bounds);
        right.then_some(Adaptive {
            max_step: keys.max_step.max(equal),
            target_iterations: keys.target_iterations,
        })
    }

    pub(super) fn solver(&mut self) -> Option<SolverSettings> {
        let keys = &self.config.solver;
        let path = Path::root().key("solver");
        let right = [
            self.tolerance(&path.key("force_tolerance"), keys.force_tolerance),
            self.tolerance(&path.key("return_map_tolerance"), keys.return_map_tolerance),
            keys.energy_tolerance
                .is_none_or(|value| self.positive(&path.key("energy_tolerance"), value).is_some()),
            self.require(
                keys.max_iterations >= 1,
                &path.key("max_iterations"),
                "0 iterations",
                "a whole number >= 1",
            ),
        ];
        let petsc_options = self.petsc_options(&path.key("petsc_options"), &keys.petsc_options);
        if right.contains(&false) {
            return None;
        }
        Some(SolverSettings {
            force_tolerance: keys.force_tolerance,
            energy_tolerance: keys.energy_tolerance,
            return_map_tolerance: keys.return_map_tolerance,
            max_iterations: keys.max_iterations,
            method: match keys.method {
                SolverMethodName::Auto => SolverMethod::Auto,
                SolverMethodName::Direct => SolverMethod::Direct,
                SolverMethodName::Iterative => SolverMethod::Iterative,
            },
            repeatable: match keys.repeatable {
                RepeatableName::Auto => Repeatable::Auto,
                RepeatableName::Always => Repeatable::Always,
                RepeatableName::Never => Repeatable::Never,
            },
            partitioner: match keys.partitioner {
                PartitionerName::Auto => PartitionerKind::Auto,
                PartitionerName::Metis => PartitionerKind::Metis,
                PartitionerName::PtScotch => PartitionerKind::PtScotch,
                PartitionerName::ParMetis => PartitionerKind::ParMetis,
            },
            petsc_options: petsc_options?,
        })
    }

    fn tolerance(&mut self, path: &Path, value: f64) -> bool {
        self.require(
            value > 0.0 && value < 1.0,
            path,
            format!("{value} is out of bounds"),
            "a number > 0 and < 1",
        )
    }

    /// The words of the options; PETSc would pass over what comes before the first option in silence.
    fn petsc_options(&mut self, path: &Path, text: &str) -> Option<Vec<String>> {
        let words: Vec<_> = text.split_whitespace().map(str::to_owned).collect();
        let first = words.first().map_or("-", String::as_str);
        let message = format!("\"{}\" is not an option", crate::config::tree::shorten(first));
        let right = first.starts_with('-') && !text.contains('\0');
        self.require(right, path, message, "options such as -ksp_type gmres")
            .then_some(words)
    }

    pub(super) fn ghost(&mut self) -> Option<GhostSettings> {
        let keys = self.config.stabilisation.ghost.as_ref()?;
        let path = Path::root().key("stabilisation").key("ghost");
        match keys.rotation {
            Some(_) => {
                self.require_rotations(&path.key("rotation"), "translation and scaling");
            }
            None => {
                let needless = !self.continuum.has_rotations();
                self.require(
                    needless,
                    &path.key("rotation"),
                    "this key is missing",
                    "a number >= 0 in N",
                );
            }
        }
        let rotation = keys.rotation.unwrap_or(0.0);
        for (key, value) in [("translation", keys.translation), ("rotation", rotation)] {
            self.require(
                value >= 0.0,
                &path.key(key),
                format!("{value} is out of bounds"),
                "a number >= 0",
            );
        }
        let scaling = match keys.scaling {
            GhostScalingName::Paper => GhostScaling::Paper,
            GhostScalingName::Stiffness => GhostScaling::Stiffness,
        };
        Some(GhostSettings {
            translation: keys.translation,
            rotation,
            scaling,
        })
    }
}
