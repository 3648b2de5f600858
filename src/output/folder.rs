//! The folder that a run leaves its results in.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustix::fs::FallocateFlags;
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};

use crate::error::Error;

/// Files that a run begins with; they are written aside at first.
const BEGUN: [&str; 4] = ["config.yaml", "history.csv", "convergence.csv", "points.vtkhdf"];

/// Files that come later, in the order in which those of an earlier run go: first what a restart would go on from.
const LATER: [&str; 3] = ["checkpoint.h5", "summary.json", "report.html"];

/// Folder of the figures of a report.
const FIGURES: &str = "figures";

/// Files of a run that a folder holds.
pub fn results_in(folder: &Path) -> Vec<&'static str> {
    let names = BEGUN.into_iter().chain(LATER);
    names.filter(|name| folder.join(name).exists()).collect()
}

/// A result folder that exists; made by one rank, once the scene is known to be valid.
#[derive(Clone, Debug)]
pub struct ResultFolder {
    path: PathBuf,
}

impl ResultFolder {
    /// Creates the folder with those above it, and writes `config.yaml`, the resolved configuration, aside. What an
    /// earlier run left stays until [`ResultFolder::take_over`], but for what it wrote aside and did not finish.
    pub fn create(path: &Path, configuration: &str) -> Result<Self, Error> {
        fs::create_dir_all(path)
            .map_err(|error| Error::System(format!("cannot make the folder {}: {error}", path.display())))?;
        let folder = ResultFolder {
            path: path.to_path_buf(),
        };
        for name in BEGUN.into_iter().chain(LATER) {
            let path = folder.file(name);
            if path.is_dir() {
                let path = path.display();
                return Err(Error::System(format!("cannot write {path}: a folder has this name")));
            }
        }
        BEGUN
            .iter()
            .chain(&LATER)
            .try_for_each(|name| remove(&folder.aside(name)))?;
        write_synced(&folder.aside("config.yaml"), configuration.as_bytes()).map_err(|error| {
            Error::System(format!(
                "cannot write {}: {error}",
                folder.file("config.yaml").display()
            ))
        })?;
        Ok(folder)
    }

    /// Where a new run writes a file until it takes over.
    pub fn aside(&self, name: &str) -> PathBuf {
        aside(&self.file(name))
    }

    /// Puts the files that the new run began in the place of those of an earlier one, and removes its other files under
    /// the names of this program, so that no file of one run is taken for another's. Foreign files stay.
    pub fn take_over(&self) -> Result<(), Error> {
        LATER.iter().try_for_each(|name| remove(&self.file(name)))?;
        self.remove_figures()?;
        put_aside_before(&self.path).iter().try_for_each(|path| remove(path))?;
        BEGUN.iter().try_for_each(|name| {
            let path = self.file(name);
            fs::rename(self.aside(name), &path)
                .map_err(|error| Error::System(format!("cannot write {}: {error}", path.display())))
        })
    }

    /// Removes the figures of a report: each is there as SVG and as PNG. The folder goes unless it holds something else.
    fn remove_figures(&self) -> Result<(), Error> {
        let folder = self.file(FIGURES);
        for path in entries(&folder) {
            let picture = path.with_extension("png");
            if path.extension().is_some_and(|extension| extension == "svg") && picture.is_file() {
                remove(&path)?;
                remove(&picture)?;
            }
        }
        // It is not empty, or not there.
        let _ = fs::remove_dir(&folder);
        Ok(())
    }

    /// Removes what a new run wrote aside before it failed.
    pub fn give_up(&self) {
        // The failure itself is what matters; that the remains cannot be removed adds nothing.
        BEGUN.iter().for_each(|name| drop(fs::remove_file(self.aside(name))));
    }

    /// The folder of an earlier run that this one goes on with: `config.yaml` is written anew, and `summary.json` goes,
    /// since the end that it tells of is none; all else stays.
    pub fn reopen(path: &Path, configuration: &str) -> Result<Self, Error> {
        let folder = ResultFolder {
            path: path.to_path_buf(),
        };
        write_atomically(&folder.file("config.yaml"), configuration.as_bytes())?;
        remove(&folder.file("summary.json"))?;
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

/// Paths of what a folder holds; none where it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    entries.filter_map(|entry| Some(entry.ok()?.path())).collect()
}

/// What a file that cannot be gone on with is called between its name and its extension.
const DAMAGED: &str = "damaged";

/// Gives a file that cannot be gone on with a name that is free, `NAME.damaged.EXT` or `NAME.damaged.2.EXT`, and answers
/// with it; `None` if there is no file.
pub(super) fn put_aside(path: &Path) -> io::Result<Option<PathBuf>> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let name = |number: usize| match number {
        1 => path.with_extension(format!("{DAMAGED}.{extension}")),
        number => path.with_extension(format!("{DAMAGED}.{number}.{extension}")),
    };
    let free = (1..).map(name).find(|path| fs::symlink_metadata(path).is_err());
    let free = free.expect("there is a number that no file has");
    match fs::rename(path, &free) {
        Ok(()) => Ok(Some(free)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Snapshots that were put aside in a folder.
fn put_aside_before(folder: &Path) -> Vec<PathBuf> {
    let is_one = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let middle = name
            .strip_prefix("points.")
            .and_then(|rest| rest.strip_suffix(".vtkhdf"))
            .and_then(|middle| middle.strip_prefix(DAMAGED));
        middle.is_some_and(|number| number.is_empty() || number.starts_with('.'))
    };
    entries(folder).into_iter().filter(is_one).collect()
}

/// Creates a file in the place of what has its name; a symbolic link goes and is not followed.
pub fn create_anew(path: &Path) -> io::Result<fs::File> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => fs::File::create_new(path),
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
    let temporary = aside(path);
    let written = write_synced(&temporary, content).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|error| {
        // The failure itself is what matters; that the remains cannot be removed adds nothing.
        let _ = fs::remove_file(&temporary);
        Error::System(format!("cannot write {}: {error}", path.display()))
    })
}

/// The temporary name of a file that is not complete yet.
pub fn aside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

fn write_synced(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = create_anew(path)?;
    file.write_all(content)?;
    // Without this a crash of the machine may leave the name that it gets with no content.
    file.sync_all()
}

/// Claims space on disk behind the first `from` bytes of a file, so that a full disk is found before anything is written.
pub(super) fn claim_space(file: &fs::File, from: u64, bytes: u64) -> io::Result<()> {
    // Not every file system compares a reservation with the limit on the size of files (`ulimit -f`).
    if getrlimit(Resource::Fsize)
        .current
        .is_some_and(|limit| from + bytes > limit)
    {
        return Err(Errno::FBIG.into());
    }
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

    fn names(path: &Path) -> Vec<String> {
        let entries = fs::read_dir(path).unwrap();
        let mut names: Vec<_> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn an_earlier_run_stays_until_the_new_one_has_begun() {
        let path = scratch("folder").join("results").join("biaxial");
        fs::create_dir_all(&path).unwrap();
        let old = [
            "checkpoint.h5",
            "history.csv",
            "notes.txt",
            "points.vtkhdf",
            "summary.json",
        ];
        old.iter().for_each(|name| fs::write(path.join(name), "old").unwrap());
        let folder = ResultFolder::create(&path, "title: new\n").unwrap();
        assert!(old.iter().all(|name| fs::read(path.join(name)).unwrap() == b"old"));
        for name in ["history.csv", "convergence.csv", "points.vtkhdf"] {
            fs::write(folder.aside(name), "new").unwrap();
        }
        folder.take_over().unwrap();
        let left = [
            "config.yaml",
            "convergence.csv",
            "history.csv",
            "notes.txt",
            "points.vtkhdf",
        ];
        assert_eq!(names(&path), left);
        assert_eq!(fs::read(folder.file("history.csv")).unwrap(), b"new");
        assert_eq!(fs::read_to_string(folder.file("config.yaml")).unwrap(), "title: new\n");
    }

    #[test]
    fn a_run_that_gives_up_leaves_the_folder_as_it_was() {
        let path = scratch("folder_given_up");
        fs::write(path.join("history.csv"), "old").unwrap();
        let folder = ResultFolder::create(&path, "title: new\n").unwrap();
        fs::write(folder.aside("history.csv"), "new").unwrap();
        folder.give_up();
        assert_eq!(names(&path), ["history.csv"]);
        fs::create_dir(path.join("points.vtkhdf")).unwrap();
        let message = ResultFolder::create(&path, "").unwrap_err().to_string();
        assert!(message.contains("points.vtkhdf: a folder has this name"), "{message}");
        assert_eq!(names(&path), ["history.csv", "points.vtkhdf"]);
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
