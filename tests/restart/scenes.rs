//! Short runs that can be stopped at a row of their history.

use crate::common::folder::Folder;
use crate::common::launch::{Launch, Started};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A scene with few steps.
#[derive(Clone, Copy)]
pub struct Scene {
    pub name: &'static str,
    pub set: &'static [&'static str],
}

/// Plasticity, a grid that follows its platen, a ghost penalty.
pub const BIAXIAL: Scene = Scene {
    name: "biaxial_5mm",
    set: &[
        "stages.0.steps=24",
        "boundary.2.move.uy=-0.0024",
        "output.checkpoint.every=3",
        "output.snapshots.every=2",
    ],
};

/// A mesh that moves with its body, in space.
pub const ELEMENTS: Scene = Scene {
    name: "fem_curved_cantilever_64",
    set: &["stages.0.steps=8", "output.checkpoint.every=100"],
};

/// Another continuum.
pub const CLASSICAL: Scene = Scene {
    name: "classical_shear_layer",
    set: &["stages.0.steps=24", "output.checkpoint.every=100"],
};

/// A folder for all parts of a run.
pub struct Runs {
    folder: Folder,
    pub scene: Scene,
}

impl Runs {
    pub fn of(scene: Scene) -> Self {
        Runs {
            folder: Folder::new(),
            scene,
        }
    }

    pub fn directory(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn file(&self, run: &str, name: &str) -> PathBuf {
        self.directory(run).join(name)
    }

    pub fn bytes(&self, run: &str, name: &str) -> Vec<u8> {
        let path = self.file(run, name);
        std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// A run of the scene into a folder of this name.
    pub fn launch(&self, run: &str, ranks: usize) -> Launch {
        Launch::config(self.scene.name)
            .set(self.scene.set)
            .output(&self.directory(run).to_string_lossy())
            .ranks(ranks)
    }

    /// The run goes on from its checkpoint.
    pub fn again(&self, run: &str, ranks: usize) -> Launch {
        self.launch(run, ranks).with(&["--restart"])
    }

    /// Starts a run, and asks it to stop once its history has so many rows.
    pub fn interrupt(&self, run: &str, ranks: usize, rows: usize) {
        let started = self.launch(run, ranks).start();
        wait_for_rows(&started, &self.file(run, "history.csv"), rows);
        started.signal(rustix::process::Signal::USR1);
        started.wait().expect_code(4);
    }
}

/// Rows of a history, the head line not counted.
pub fn rows(path: &Path) -> usize {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.matches('\n').count().saturating_sub(1)
}

/// Waits until a history has so many rows. False when the run ended before.
pub fn wait_for_rows(started: &Started, path: &Path, count: usize) -> bool {
    let start = Instant::now();
    while rows(path) < count {
        if started.has_ended() {
            return false;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "the run does not get on");
        std::thread::sleep(Duration::from_millis(1));
    }
    true
}
