//! Short runs that can be stopped at a row of their history.

use crate::common::folder::Folder;
use crate::common::launch::{Launch, Started};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A scene with few steps.
#[derive(Clone, Copy)]
pub struct Scene {
    /// From the root of the repository.
    pub file: &'static str,
    pub set: &'static [&'static str],
}

impl Scene {
    pub fn path(&self) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join(self.file)
    }
}

/// Plasticity, a grid that follows its platen, a ghost penalty.
pub const BIAXIAL: Scene = Scene {
    file: "configs/biaxial_5mm.yaml",
    set: &[
        "stages.0.steps=24",
        "boundary.2.move.uy=-0.0024",
        "output.checkpoint.every=3",
        "output.snapshots.every=2",
    ],
};

/// A mesh that moves with its body, in space.
pub const ELEMENTS: Scene = Scene {
    file: "configs/fem_curved_cantilever_64.yaml",
    set: &["stages.0.steps=8", "output.checkpoint.every=100"],
};

/// Another continuum.
pub const CLASSICAL: Scene = Scene {
    file: "configs/classical_shear_layer.yaml",
    set: &["stages.0.steps=24", "output.checkpoint.every=100"],
};

/// Penalties, a platen, springs that forget, pressure, two stages, steps that adapt.
pub const PLATEN: Scene = Scene {
    file: "tests/restart/platen.yaml",
    set: &[],
};

/// A third kind of unknown, on splines; damage.
pub const SANDSTONE: Scene = Scene {
    file: "tests/restart/sandstone.yaml",
    set: &["solver.repeatable=always"],
};

/// A path beyond its limit point, whose direction the points remember.
pub const PATH: Scene = Scene {
    file: "configs/column_collapse_path.yaml",
    set: &[
        "stages.0.control.arc_length.length=1.0e-2",
        "stages.0.control.arc_length.max_steps=14",
        "output.checkpoint.every=100",
    ],
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
        Launch::file(&self.scene.path())
            .set(self.scene.set)
            .output(&self.directory(run).to_string_lossy())
            .ranks(ranks)
    }

    /// The run goes on from its checkpoint.
    pub fn again(&self, run: &str, ranks: usize) -> Launch {
        self.launch(run, ranks).with(&["--restart"])
    }

    /// Starts a run, and asks it to stop once its history has so many rows. A run that came to its end before the signal
    /// did, as on a crowded machine, is started anew.
    pub fn interrupt(&self, run: &str, ranks: usize, rows: usize) {
        let stopped = (0..5).any(|_| {
            let _ = std::fs::remove_dir_all(self.directory(run));
            let started = self.launch(run, ranks).start();
            wait_for_rows(&started, &self.file(run, "history.csv"), rows);
            started.signal(rustix::process::Signal::USR1);
            let ended = started.wait();
            match ended.code() {
                Some(0) => false,
                _ => ended.expect_code(4).code().is_some(),
            }
        });
        assert!(stopped, "each run was at its end before it could be stopped");
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
