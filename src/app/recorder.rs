//! Writes an analysis down while it goes: history, convergence, snapshots, progress.

use super::columns::Column;
use super::snapshot;
use crate::assembly::model::Model;
use crate::clock::{Clock, Phase};
use crate::condition::Time;
use crate::continuum::Fields;
use crate::error::Error;
use crate::output::convergence::{Convergence, IterationRecord};
use crate::output::folder::ResultFolder;
use crate::output::history::{History, HistoryStep};
use crate::output::progress::{Progress, StepLine};
use crate::output::summary::Summary;
use crate::output::vtkhdf::Snapshots;
use crate::output::{PointFields, agree};
use crate::parallel::World;
use crate::scene::Scene;
use crate::solve::settings::Stage;
use crate::solve::step::{Accepted, Attempt, Observer};
use std::io::Stdout;
use std::path::PathBuf;
use std::rc::Rc;

/// Files that the root writes.
struct RootFiles {
    history: History,
    convergence: Convergence,
}

/// Writer of all results of one run.
pub struct Recorder<'a> {
    world: World,
    scene: &'a Scene,
    columns: Vec<Column>,
    total_points: u64,
    clock: Rc<Clock>,
    directory: PathBuf,
    files: Option<RootFiles>,
    snapshots: Snapshots,
    progress: Progress<Stdout>,
    /// Attempts at the current step so far.
    attempts: usize,
    full_steps: usize,
    /// Time of the last accepted state, and whether a snapshot shows it.
    last: (f64, bool),
}

/// Time in snapshots: stages done plus the share of the current one.
fn snapshot_time(time: Time) -> f64 {
    time.stage as f64 + time.fraction
}

impl<'a> Recorder<'a> {
    /// Collective. Makes the result folder and its files.
    pub fn create(
        world: &World,
        scene: &'a Scene,
        columns: Vec<Column>,
        total_points: u64,
        progress: Progress<Stdout>,
        clock: &Rc<Clock>,
    ) -> Result<Self, Error> {
        let _writing = clock.enter(Phase::Output);
        let directory = scene.output.directory.clone();
        let files = if world.is_root() {
            Some(create_files(scene, &columns))
        } else {
            None
        };
        let files = agree(world, files.transpose().map_err(|error| error.to_string()))?;
        Ok(Self {
            world: world.clone(),
            scene,
            columns,
            total_points,
            clock: clock.clone(),
            snapshots: Snapshots::new(directory.join("points.vtkhdf")),
            directory,
            files,
            progress,
            attempts: 0,
            full_steps: 0,
            last: (0.0, false),
        })
    }

    /// Collective. Row 0 and the first snapshot.
    pub fn initial<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
    ) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        let time = Time {
            stage: 0,
            fraction: 0.0,
        };
        let reactions = vec![[0.0; N]; model.boundaries.len()];
        let step = HistoryStep {
            step: 0,
            stage: &self.scene.stages[0].name,
            load_factor: 0.0,
            step_size: 0.0,
            newton_iterations: 0,
        };
        self.row(model, time, &reactions, &step)?;
        self.snapshot(model, 0.0)
    }

    fn row<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
        time: Time,
        reactions: &[[f64; N]],
        step: &HistoryStep<'_>,
    ) -> Result<(), Error> {
        let (world, scene) = (&self.world, self.scene);
        let values: Vec<f64> = self
            .columns
            .iter()
            .flat_map(|column| column.values(world, scene, model, time, reactions))
            .collect();
        let written = self
            .files
            .as_mut()
            .map_or(Ok(()), |files| files.history.record(step, &values));
        agree(&self.world, written.map_err(|error| error.to_string()))
    }

    fn snapshot<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
        time: f64,
    ) -> Result<(), Error> {
        let (position, fields) = snapshot::fields(model);
        let points = PointFields {
            ids: &model.points.id,
            total: self.total_points,
            position: &position,
            fields: &fields,
        };
        self.snapshots.append(&self.world, time, &points)?;
        self.last = (time, true);
        Ok(())
    }

    /// Collective. Writes what is still owed of the last accepted state; also after a failure.
    pub fn finish<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
    ) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        self.progress.finish();
        match self.last {
            (_, true) => Ok(()),
            (time, false) => self.snapshot(model, time),
        }
    }

    /// Collective. Writes `summary.json`.
    pub fn summary(&mut self, summary: &Summary) -> Result<(), Error> {
        let written = if self.world.is_root() {
            summary.write(&self.directory.join("summary.json"))
        } else {
            Ok(())
        };
        agree(&self.world, written.map_err(|error| error.to_string()))
    }

    /// Draws the report where it is wanted. A run is what it is without one: failure is a warning.
    pub fn report(&mut self) {
        if self.world.is_root()
            && self.scene.output.report
            && let Err(error) = crate::report::write(&self.directory)
        {
            self.progress.message(&format!("warning: no report: {error}"));
        }
    }

    /// A line for the user.
    pub fn message(&mut self, text: &str) {
        self.progress.message(text);
    }
}

fn create_files(scene: &Scene, columns: &[Column]) -> Result<RootFiles, Error> {
    let folder = ResultFolder::create(&scene.output.directory, &scene.output.resolved)?;
    let names: Vec<String> = columns
        .iter()
        .flat_map(|column| column.entry.column_names(scene.kinematics))
        .collect();
    Ok(RootFiles {
        history: History::create(&folder.file("history.csv"), &names)?,
        convergence: Convergence::create(&folder.file("convergence.csv"))?,
    })
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Observer<C, D, N> for Recorder<'_> {
    fn attempted(&mut self, attempt: &Attempt<'_>) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        self.attempts += 1;
        let records: Vec<IterationRecord> = attempt
            .records
            .iter()
            .map(|record| IterationRecord {
                force_residual: record.force_residual,
                energy_residual: record.energy_residual,
            })
            .collect();
        let accepted = attempt.failure.is_none();
        let number = self.attempts;
        let written = self.files.as_mut().map_or(Ok(()), |files| {
            files.convergence.record(attempt.step, number, &records, accepted)
        });
        agree(&self.world, written.map_err(|error| error.to_string()))?;
        if let Some(reason) = attempt.failure {
            let size = attempt.to.fraction - attempt.from.fraction;
            self.progress.message(&format!(
                "step {} of stage {}, size {size:.3e}: not solved: {reason}",
                attempt.step, attempt.stage.name
            ));
        }
        Ok(())
    }

    fn accepted(&mut self, step: &Accepted<'_, C, D, N>) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        self.attempts = 0;
        let row = HistoryStep {
            step: step.step,
            stage: &step.stage.name,
            load_factor: step.time.fraction,
            step_size: step.step_size,
            newton_iterations: step.newton_iterations,
        };
        self.row(step.model, step.time, step.reactions, &row)?;
        self.progress.step(&StepLine {
            step: step.step,
            stage: &step.stage.name,
            load_factor: step.time.fraction,
            step_size: step.step_size,
            newton_iterations: step.newton_iterations,
            residual: step.force_residual,
            elapsed: self.clock.elapsed(),
            done: done(self.scene, step.time),
        });
        self.last = (snapshot_time(step.time), false);
        self.full_steps += usize::from(step.full_step);
        let due = step.full_step
            && self
                .scene
                .output
                .snapshot_every
                .is_some_and(|every| self.full_steps.is_multiple_of(every));
        if due || step.last {
            self.snapshot(step.model, snapshot_time(step.time))
        } else {
            Ok(())
        }
    }
}

/// Share of all full steps of all stages that is done.
fn done(scene: &Scene, time: Time) -> f64 {
    let steps = |stages: &[Stage]| stages.iter().map(|stage| stage.steps).sum::<usize>() as f64;
    let before = steps(&scene.stages[..time.stage]);
    (before + time.fraction * scene.stages[time.stage].steps as f64) / steps(&scene.stages)
}
