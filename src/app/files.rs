//! The files of a run when it begins, and when it goes on: everything is looked at before anything is changed.

use super::recorder::FilesState;
use crate::error::Error;
use crate::output::agree;
use crate::output::convergence::Convergence;
use crate::output::folder::{ResultFolder, aside};
use crate::output::history::History;
use crate::output::vtkhdf::Snapshots;
use crate::parallel::World;
use crate::scene::Scene;
use std::path::Path;

/// Files that the root writes.
pub struct RootFiles {
    pub folder: ResultFolder,
    pub history: History,
    pub convergence: Convergence,
}

/// All files of a run.
pub struct Files {
    /// On the root.
    pub root: Option<RootFiles>,
    pub snapshots: Snapshots,
    /// Whether the snapshots are those of the checkpoint.
    pub has_all_snapshots: bool,
    /// Whether tables begin where the run goes on; the root's answer, on every rank.
    pub has_all_rows: bool,
    /// What is missing and begins anew, on the root.
    pub gaps: Vec<String>,
}

impl Files {
    /// Collective. Begins files aside; `names` are the columns of the history.
    pub fn begin(world: &World, scene: &Scene, names: &[String]) -> Result<Self, Error> {
        let root = on_the_root(world, || begin_tables(scene, names))?;
        Ok(Files {
            root,
            snapshots: Snapshots::new(aside(&scene.output.directory.join("points.vtkhdf"))),
            has_all_snapshots: true,
            has_all_rows: true,
            gaps: Vec::new(),
        })
    }

    /// Collective. Goes on with the files that belong to a checkpoint, for so many points.
    ///
    /// # Errors
    /// The same on every rank: a table is not what it was, or a file cannot be written. Tables are as they were then.
    pub fn go_on(
        world: &World,
        scene: &Scene,
        names: &[String],
        state: &FilesState,
        points: u64,
    ) -> Result<Self, Error> {
        let directory = &scene.output.directory;
        let found = on_the_root(world, || FoundTables::look(directory, names, state))?;
        let path = directory.join("points.vtkhdf");
        let (snapshots, gap) = Snapshots::resume(world, path, state.snapshots(), points)?;
        let begun = on_the_root(world, || found.map(|found| found.go_on(scene, names)).transpose())?;
        let has_all_snapshots = gap.is_none();
        let (root, mut gaps) = begun
            .flatten()
            .map_or((None, Vec::new()), |(root, gaps)| (Some(root), gaps));
        let has_all_rows = !world.any(!gaps.is_empty());
        gaps.extend(gap);
        Ok(Files {
            root,
            snapshots,
            has_all_snapshots,
            has_all_rows,
            gaps,
        })
    }
}

/// Collective. What the root makes; its failure is one of every rank.
fn on_the_root<T>(world: &World, make: impl FnOnce() -> Result<T, Error>) -> Result<Option<T>, Error> {
    let made = world.is_root().then(make).transpose();
    agree(world, made.map_err(|error| error.to_string()))
}

fn begin_tables(scene: &Scene, names: &[String]) -> Result<RootFiles, Error> {
    let folder = ResultFolder::create(&scene.output.directory, &scene.output.resolved)?;
    let begin = || -> Result<_, Error> {
        let history = History::create(&folder.aside("history.csv"), names)?;
        Ok((history, Convergence::create(&folder.aside("convergence.csv"))?))
    };
    let (history, convergence) = begin().inspect_err(|_| folder.give_up())?;
    Ok(RootFiles {
        folder,
        history,
        convergence,
    })
}

/// Tables that belong to a checkpoint, as they are in the folder; those that are gone are absent.
struct FoundTables {
    history: Option<History>,
    convergence: Option<Convergence>,
}

impl FoundTables {
    fn look(directory: &Path, names: &[String], state: &FilesState) -> Result<Self, Error> {
        Ok(FoundTables {
            history: History::find(&directory.join("history.csv"), names.len(), state.history())?,
            convergence: Convergence::find(&directory.join("convergence.csv"), state.convergence())?,
        })
    }

    /// Cuts the tables back, begins those that are gone, and says which.
    fn go_on(self, scene: &Scene, names: &[String]) -> Result<(RootFiles, Vec<String>), Error> {
        let folder = ResultFolder::reopen(&scene.output.directory, &scene.output.resolved)?;
        let mut gaps = Vec::new();
        let mut gap = |name: &str| {
            let path = folder.file(name);
            gaps.push(format!(
                "{} is gone; a new one begins where the run goes on",
                path.display()
            ));
            path
        };
        let history = match self.history {
            Some(mut history) => history.cut().map(|()| history),
            None => History::create(&gap("history.csv"), names),
        };
        let convergence = match self.convergence {
            Some(mut convergence) => convergence.cut().map(|()| convergence),
            None => Convergence::create(&gap("convergence.csv")),
        };
        let files = RootFiles {
            history: history?,
            convergence: convergence?,
            folder,
        };
        Ok((files, gaps))
    }
}
