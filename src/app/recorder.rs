//! Writes an analysis down while it goes: history, convergence, snapshots, progress.

use super::checkpoint::{self, RunState, Spent};
use super::columns::Column;
use super::files::{Files, RootFiles};
use super::snapshot;
use crate::assembly::model::Model;
use crate::clock::{Clock, Phase};
use crate::condition::Time;
use crate::continuum::Fields;
use crate::error::Error;
use crate::output::history::HistoryStep;
use crate::output::progress::{Ending, Progress, StepLine};
use crate::output::summary::Summary;
use crate::output::vtkhdf::Snapshots;
use crate::output::{Extent, PointFields, agree, process};
use crate::parallel::World;
use crate::scene::Scene;
use crate::solve::settings::Stage;
use crate::solve::state::AnalysisState;
use crate::solve::step::{Accepted, Attempt, Observer};
use serde::{Deserialize, Serialize};
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

/// Time between two checkpoints over what one takes, where the user does not say how often.
const CHECKPOINT_SPACING: u32 = 50;

/// What the first checkpoint is expected to take: it is written after ten seconds.
const EXPECTED_CHECKPOINT: Duration = Duration::from_millis(200);

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
    progress: Progress,
    /// Attempts at the current step so far.
    attempts: usize,
    /// What the files hold of the last accepted state.
    state: FilesState,
    /// Wall time when the last checkpoint was finished, and what it took.
    checkpoint_times: (Duration, Duration),
    /// Number of the step that the checkpoint in the folder belongs to.
    saved: Option<usize>,
    spent_before: Spent,
    /// Share of the run that was done when this part of it began.
    begun: f64,
}

/// What the files of a run hold when a step is accepted. Whatever is added to the recorder that a later row or snapshot
/// depends on belongs here, since this is what a checkpoint keeps of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FilesState {
    /// What `history.csv` and `convergence.csv` hold; only the root knows.
    history: Extent,
    convergence: Extent,
    /// Number of snapshots.
    snapshots: usize,
    /// Full steps done, by which snapshots and checkpoints are counted.
    full_steps: usize,
    /// Time of the state, stages done plus the share of the current one, and whether a snapshot shows it.
    time: f64,
    shown: bool,
}

impl FilesState {
    pub fn history(&self) -> Extent {
        self.history
    }

    pub fn convergence(&self) -> Extent {
        self.convergence
    }

    pub fn snapshots(&self) -> usize {
        self.snapshots
    }
}

impl<'a> Recorder<'a> {
    /// Collective. Makes the result folder and its files, or goes on with those that belong to a checkpoint.
    pub fn create(
        world: &World,
        scene: &'a Scene,
        columns: Vec<Column>,
        total_points: u64,
        saved: Option<&RunState>,
        progress: Progress,
        clock: &Rc<Clock>,
    ) -> Result<Self, Error> {
        let _writing = clock.enter(Phase::Output);
        let names: Vec<String> = columns
            .iter()
            .flat_map(|column| column.entry.column_names(scene.kinematics))
            .collect();
        let files = match saved {
            Some(saved) => Files::go_on(world, scene, &names, &saved.files, total_points)?,
            None => Files::begin(world, scene, &names)?,
        };
        let mut state = saved.map_or_else(FilesState::default, |saved| saved.files);
        state.shown &= files.has_all_snapshots;
        let mut recorder = Self {
            world: world.clone(),
            scene,
            columns,
            total_points,
            clock: clock.clone(),
            snapshots: files.snapshots,
            directory: scene.output.directory.clone(),
            files: files.root,
            progress,
            attempts: 0,
            state,
            checkpoint_times: (clock.elapsed(), EXPECTED_CHECKPOINT),
            // A table that begins here is not the one of the checkpoint.
            saved: saved
                .filter(|_| files.has_all_rows)
                .map(|saved| saved.analysis.counts.steps),
            spent_before: saved.map_or_else(Spent::default, |saved| saved.spent),
            begun: saved.map_or(0.0, |saved| {
                done(scene, saved.analysis.stage, saved.analysis.steps.share())
            }),
        };
        recorder.note_extents();
        recorder.tell_of_restart(saved, &files.gaps);
        Ok(recorder)
    }

    fn tell_of_restart(&mut self, saved: Option<&RunState>, gaps: &[String]) {
        let Some(saved) = saved else { return };
        let (step, stage) = (
            saved.analysis.counts.steps,
            &self.scene.stages[saved.analysis.stage].name,
        );
        self.message(&format!("goes on after step {step}, stage {stage}"));
        if saved.commit != crate::version::COMMIT {
            let (program, commit) = (&saved.program, &saved.commit);
            self.message(&format!(
                "warning: the checkpoint was written by version {program} ({commit}) of the program, not by this one"
            ));
        }
        gaps.iter().for_each(|gap| self.message(&format!("warning: {gap}")));
    }

    /// What earlier parts of the run used.
    pub fn spent_before(&self) -> Spent {
        self.spent_before
    }

    /// Collective. Row 0 and the first snapshot of a new run. Once they are written, what an earlier run left in the
    /// folder makes room.
    pub fn initial<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
    ) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        let begun = self.begin(model).and_then(|()| self.take_over());
        if let (Err(_), Some(files)) = (&begun, &self.files) {
            files.folder.give_up();
        }
        begun
    }

    fn begin<C: Fields<D, N>, const D: usize, const N: usize>(&mut self, model: &Model<C, D, N>) -> Result<(), Error> {
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
        self.snapshot(model)?;
        self.note_extents();
        Ok(())
    }

    /// Collective. Gives the files their names.
    fn take_over(&mut self) -> Result<(), Error> {
        let taken = self.files.as_mut().map_or(Ok(()), |files| {
            files.folder.take_over()?;
            files.history.renamed(&files.folder.file("history.csv"));
            files.convergence.renamed(&files.folder.file("convergence.csv"));
            Ok(())
        });
        agree(&self.world, taken.map_err(|error: Error| error.to_string()))?;
        self.snapshots.renamed(self.directory.join("points.vtkhdf"));
        Ok(())
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
    ) -> Result<(), Error> {
        let (position, fields) = snapshot::fields(model);
        let points = PointFields {
            ids: &model.points.id,
            total: self.total_points,
            position: &position,
            fields: &fields,
        };
        self.snapshots.append(&self.world, self.state.time, &points)?;
        self.state.snapshots = self.snapshots.written();
        self.state.shown = true;
        Ok(())
    }

    /// Notes what the tables hold with the last accepted state; the root knows.
    fn note_extents(&mut self) {
        if let Some(files) = &self.files {
            (self.state.history, self.state.convergence) = (files.history.extent(), files.convergence.extent());
        }
    }

    /// Collective. Writes a checkpoint of the accepted state unless the one in the folder is of this state.
    pub fn checkpoint<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
        analysis: &AnalysisState,
    ) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        if self.saved == Some(analysis.counts.steps) {
            return Ok(());
        }
        let begin = clock.elapsed();
        // What the checkpoint refers to must be on disk before it is.
        let secured = self.files.as_ref().map_or(Ok(()), |files| {
            files.history.secure()?;
            files.convergence.secure()?;
            self.snapshots.secure()
        });
        agree(&self.world, secured.map_err(|error| error.to_string()))?;
        let spent = Spent {
            phases: clock.seconds().plus(&self.spent_before.phases),
            cpu_seconds: self.spent_before.cpu_seconds + self.world.sum(process::cpu_seconds()),
        };
        let state = RunState {
            program: crate::version::PROGRAM.to_owned(),
            commit: crate::version::COMMIT.to_owned(),
            configuration: self.scene.output.resolved_tree.clone(),
            points: self.total_points,
            analysis: analysis.clone(),
            model: model.state(),
            files: self.state,
            spent,
        };
        checkpoint::save(&self.world, &self.directory, model, state)?;
        self.saved = Some(analysis.counts.steps);
        self.checkpoint_times = (clock.elapsed(), clock.elapsed() - begin);
        Ok(())
    }

    /// Collective. Whether checkpoints keep to their share of the wall time if one is written now.
    fn checkpoint_is_worth_its_time(&self) -> bool {
        let (finished, took) = self.checkpoint_times;
        let worth = self.clock.elapsed().saturating_sub(finished) >= CHECKPOINT_SPACING * took;
        // Clocks differ; that of the root counts.
        self.world.any(worth && self.world.is_root())
    }

    /// Collective. Writes what is still owed of the last accepted state; also after a failure.
    pub fn finish<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        model: &Model<C, D, N>,
    ) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        self.progress.finish();
        if self.state.shown { Ok(()) } else { self.snapshot(model) }
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

    /// Draws the report, on the root; returns where it is. A run is what it is without one: failure is a warning, even one
    /// of the program.
    pub fn report(&mut self) -> Option<PathBuf> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        if !self.world.is_root() {
            return None;
        }
        let failure = match caught(|| crate::report::write(&self.directory)) {
            Ok(Ok(page)) => return Some(page),
            Ok(Err(error)) => error.to_string(),
            Err(panic) => format!("a fault of the program while it was drawn: {panic}"),
        };
        self.progress.message(&format!("warning: no report: {failure}"));
        None
    }

    /// Tells how the run ended.
    pub fn ending(&mut self, summary: &Summary, report: Option<&Path>) {
        self.progress.ending(&Ending {
            status: summary.status,
            steps: summary.steps,
            seconds: summary.wall_seconds,
            directory: &self.directory,
            report,
            saved: self.saved,
        });
    }

    /// Number of points on all ranks.
    pub fn points(&self) -> u64 {
        self.total_points
    }

    /// A line for the user.
    pub fn message(&mut self, text: &str) {
        self.progress.message(text);
    }
}

impl<C: Fields<D, N>, const D: usize, const N: usize> Observer<C, D, N> for Recorder<'_> {
    fn begins(&mut self, step: usize, stage: &Stage) {
        self.progress.attempt(step, &stage.name);
    }

    fn attempted(&mut self, attempt: &Attempt<'_>) -> Result<(), Error> {
        let clock = self.clock.clone();
        let _writing = clock.enter(Phase::Output);
        self.attempts += 1;
        let residuals = attempt.records.iter();
        let residuals = residuals.map(|record| [record.force_residual, record.energy_residual]);
        let accepted = attempt.failure.is_none();
        let number = self.attempts;
        let written = self.files.as_mut().map_or(Ok(()), |files| {
            files.convergence.record(attempt.step, number, residuals, accepted)
        });
        agree(&self.world, written.map_err(|error| error.to_string()))?;
        if let Some(reason) = attempt.failure {
            self.progress.message(&format!(
                "step {} of stage {}, size {}: not solved: {reason}",
                attempt.step, attempt.stage.name, attempt.size
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
            done: done(self.scene, step.time.stage, step.share),
            begun: self.begun,
        });
        if let Some(ending) = step.ending {
            self.progress.message(&format!("stage {}: {ending}", step.stage.name));
        }
        self.state.time = step.time.stage as f64 + step.share;
        self.state.shown = false;
        self.state.full_steps += usize::from(step.full_step);
        let output = &self.scene.output;
        let due = |every: usize| step.last || step.full_step && self.state.full_steps.is_multiple_of(every);
        let snapshot = due(output.snapshot_every.unwrap_or(usize::MAX));
        let save = match output.checkpoint_every {
            Some(every) => due(every),
            None => step.last || self.checkpoint_is_worth_its_time(),
        };
        if snapshot {
            self.snapshot(step.model)?;
        }
        self.note_extents();
        // The tables of a checkpoint are those in the folder from its first step on.
        if save || self.saved.is_none() && self.begun > 0.0 {
            self.checkpoint(step.model, step.state)?;
        }
        Ok(())
    }
}

/// Does what may fail by a panic; the answer is then what the panic says, and nothing is printed.
fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let outcome = std::panic::catch_unwind(AssertUnwindSafe(work));
    std::panic::set_hook(hook);
    outcome.map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(ToString::to_string);
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        text.unwrap_or_else(|| "no message".to_owned())
    })
}

/// Share of all full steps of all stages that is done.
fn done(scene: &Scene, stage: usize, share: f64) -> f64 {
    let steps = |stages: &[Stage]| stages.iter().map(Stage::full_steps).sum::<usize>() as f64;
    let before = steps(&scene.stages[..stage]);
    (before + share * scene.stages[stage].full_steps() as f64) / steps(&scene.stages)
}
