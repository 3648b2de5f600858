//! The folder that a run leaves its results in.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustix::fs::FallocateFlags;
use rustix::io::Errno;

use crate::error::Error;

/// Files of a run, apart from `config.yaml`.
const RESULTS: [&str; 6] = [
    "history.csv",
    "convergence.csv",
    "summary.json",
    "points.vtkhdf",
    "checkpoint.h5",
    "report.html",
];

/// A result folder that exists; made by one rank, once the scene is known to be valid.
#[derive(Clone, Debug)]
pub struct ResultFolder {
    path: PathBuf,
}

impl ResultFolder {
    /// Creates the folder with those above it, removes what an earlier run left under the names of this program (so that
    /// no file of one run is taken for another's; other files stay) and writes `config.yaml`, the resolved configuration.
    pub fn create(path: &Path, configuration: &str) -> Result<Self, Error> {
        fs::create_dir_all(path)
            .map_err(|error| Error::System(format!("cannot make the folder {}: {error}", path.display())))?;
        let folder = ResultFolder {
            path: path.to_path_buf(),
        };
        for name in RESULTS {
            remove(&folder.file(name))?;
        }
        write_atomically(&folder.file("config.yaml"), configuration.as_bytes())?;
        Ok(folder)
    }

    /// The folder of an earlier run that this one goes on with; `config.yaml` is written anew, all else stays.
    pub fn reopen(path: &Path, configuration: &str) -> Result<Self, Error> {
        let folder = ResultFolder {
            path: path.to_path_buf(),
        };
        write_atomically(&folder.file("config.yaml"), configuration.as_bytes())?;
        Ok(folder)
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::System(format!(
            "cannot remove {} of an earlier run: {error}",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// Writes a file under a temporary name and renames it, so that under its own name it is never incomplete.
pub fn write_atomically(path: &Path, content: &[u8]) -> Result<(), Error> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".part");
    let temporary = PathBuf::from(temporary);
    let write = || -> std::io::Result<()> {
        let mut file = fs::File::create(&temporary)?;
        file.write_all(content)?;
        // Without this a crash of the machine may leave the new name with no content.
        file.sync_all()?;
        fs::rename(&temporary, path)
    };
    write().map_err(|error| {
        // The failure itself is what matters; that the remains cannot be removed adds nothing.
        let _ = fs::remove_file(&temporary);
        Error::System(format!("cannot write {}: {error}", path.display()))
    })
}

/// Claims space on disk behind the first `from` bytes of a file, so that a full disk is found before anything is written.
pub(super) fn claim_space(file: &fs::File, from: u64, bytes: u64) -> io::Result<()> {
    match rustix::fs::fallocate(file, FallocateFlags::KEEP_SIZE, from, bytes) {
        // Some network file systems cannot reserve; then the writer finds out.
        Ok(()) | Err(Errno::OPNOTSUPP | Errno::NOSYS) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// Returns when the name of a file is on disk, so that it outlives a crash of the machine.
pub(super) fn sync_folder(path: &Path) -> io::Result<()> {
    match path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        Some(parent) => fs::File::open(parent)?.sync_all(),
        None => fs::File::open(".")?.sync_all(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// An empty folder for one test.
    pub(in crate::output) fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("mpm-petsc-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        path
    }

    #[test]
    fn an_earlier_run_leaves_nothing_but_foreign_files() {
        let path = scratch("folder").join("results").join("biaxial");
        fs::create_dir_all(&path).unwrap();
        for name in ["summary.json", "points.vtkhdf", "notes.txt"] {
            fs::write(path.join(name), "old").unwrap();
        }
        let folder = ResultFolder::create(&path, "title: new\n").unwrap();
        let mut names: Vec<_> = fs::read_dir(&path)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, ["config.yaml", "notes.txt"]);
        assert_eq!(fs::read_to_string(folder.file("config.yaml")).unwrap(), "title: new\n");
    }

    #[test]
    fn a_file_in_the_way_is_an_error() {
        let path = scratch("folder_in_the_way").join("results");
        fs::write(&path, "a file").unwrap();
        let message = ResultFolder::create(&path, "").unwrap_err().to_string();
        assert!(message.contains("cannot make the folder"), "{message}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "a file");
    }

    #[test]
    fn a_write_that_fails_leaves_the_old_file_and_no_remains() {
        let folder = scratch("folder_atomic");
        let path = folder.join("summary.json");
        fs::create_dir_all(path.join("in the way")).unwrap();
        assert!(write_atomically(&path, b"{}").is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    }
}
