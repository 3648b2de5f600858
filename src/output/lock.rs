//! One writer a folder: a lock that the operating system lets go of however its holder ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use rustix::io::{Errno, FdFlags, fcntl_setfd};

use crate::error::Error;

/// Longest note of a holder that is read [byte].
const LONGEST_NOTE: u64 = 200;

/// What writes a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writer {
    Run,
    Study,
}

impl Writer {
    fn name(self) -> &'static str {
        match self {
            Writer::Run => "run",
            Writer::Study => "study",
        }
    }
}

/// Keeps other processes from writing a folder while it lives.
///
/// The lock is on a file of the folder, which its holder removes at the end. A file that a killed process left locks
/// nothing.
#[derive(Debug)]
pub struct FolderLock {
    path: PathBuf,
    file: File,
    /// Folders that were made for the lock, the deepest first; they go again unless something was put there.
    made: Vec<PathBuf>,
    /// False where the file system has no locks.
    holds: bool,
}

impl FolderLock {
    /// Locks a folder, which is made with those above it if need be.
    ///
    /// # Errors
    /// Another process holds the lock; the folder cannot be made or written.
    pub fn take(folder: &Path, writer: Writer) -> Result<Self, Error> {
        let made = make(folder)?;
        let path = folder.join(format!("{}.lock", writer.name()));
        let failure = |error: io::Error| Error::System(format!("cannot lock {}: {error}", path.display()));
        loop {
            let file = open(&path).map_err(failure)?;
            let holds = match file.try_lock() {
                // Otherwise the last holder removed the file between the two calls.
                Ok(()) if is_at(&file, &path) => true,
                Ok(()) => continue,
                Err(TryLockError::WouldBlock) => return Err(taken(folder, file, writer)),
                Err(TryLockError::Error(error)) if has_no_locks(&error) => false,
                Err(TryLockError::Error(error)) => return Err(failure(error)),
            };
            let lock = FolderLock {
                path,
                file,
                made,
                holds,
            };
            lock.note_holder();
            return Ok(lock);
        }
    }

    /// Where the file system cannot lock: what the user should know.
    pub fn warning(&self) -> Option<String> {
        let folder = self.path.parent().unwrap_or(&self.path).display();
        let warning =
            format!("the file system of {folder} has no locks; make sure that nothing else writes this folder");
        (!self.holds).then_some(warning)
    }

    /// Lets processes that are started from here on hold the lock as well, so that it lasts as long as one of them.
    ///
    /// # Errors
    /// The operating system does not allow it.
    pub fn pass_on(&self) -> io::Result<()> {
        Ok(fcntl_setfd(&self.file, FdFlags::empty())?)
    }

    /// Writes down who holds the lock. It helps whoever finds it taken; without it the lock is as good.
    fn note_holder(&self) {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let note = format!("process {} on {}\n", std::process::id(), host.trim());
        let _ = self
            .file
            .set_len(0)
            .and_then(|()| (&self.file).write_all(note.as_bytes()));
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // While it is still locked. That something cannot be removed is no harm.
        if self.holds && is_at(&self.file, &self.path) {
            let _ = fs::remove_file(&self.path);
        }
        self.made.iter().for_each(|folder| drop(fs::remove_dir(folder)));
    }
}

/// Makes a folder with those above it; answers with those that were not there, the deepest first.
fn make(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let missing = folder
        .ancestors()
        .take_while(|path| !path.as_os_str().is_empty() && !path.exists());
    let missing = missing.map(Path::to_path_buf).collect();
    fs::create_dir_all(folder)
        .map_err(|error| Error::System(format!("cannot make the folder {}: {error}", folder.display())))?;
    Ok(missing)
}

fn open(path: &Path) -> io::Result<File> {
    // A symbolic link would put the file elsewhere.
    let flags = OFlags::NOFOLLOW.bits() as i32;
    OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .custom_flags(flags)
        .open(path)
}

/// Whether an open file is the one that has this name.
fn is_at(file: &File, path: &Path) -> bool {
    let identity = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(own), Ok(named)) => identity(own) == identity(named),
        _ => false,
    }
}

/// Whether a lock failed because the file system has none, as some over a network.
fn has_no_locks(error: &io::Error) -> bool {
    let numbers = [Errno::NOSYS, Errno::OPNOTSUPP, Errno::NOLCK].map(Errno::raw_os_error);
    error.kind() == ErrorKind::Unsupported || error.raw_os_error().is_some_and(|number| numbers.contains(&number))
}

fn taken(folder: &Path, file: File, writer: Writer) -> Error {
    let mut holder = String::new();
    let _ = file.take(LONGEST_NOTE).read_to_string(&mut holder);
    let holder = match holder.trim() {
        "" => String::new(),
        holder => format!(" ({holder})"),
    };
    Error::System(format!(
        "another {} writes this folder{holder}: {}; wait for its end, or choose another folder with --output",
        writer.name(),
        folder.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::scratch;

    #[test]
    fn a_second_writer_is_refused_until_the_first_has_left() {
        let folder = scratch("lock");
        let first = FolderLock::take(&folder, Writer::Run).unwrap();
        assert_eq!(first.warning(), None);
        let message = FolderLock::take(&folder, Writer::Run).unwrap_err().to_string();
        let own = format!("another run writes this folder (process {} on ", std::process::id());
        assert!(message.starts_with(&own), "{message}");
        drop(first);
        drop(FolderLock::take(&folder, Writer::Run).unwrap());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0, "nothing is left");
    }

    #[test]
    fn a_file_that_was_left_locks_nothing_and_a_link_is_not_followed() {
        let folder = scratch("lock_left");
        fs::write(folder.join("run.lock"), "process 1 on elsewhere\n").unwrap();
        drop(FolderLock::take(&folder, Writer::Run).unwrap());
        let target = folder.join("target");
        std::os::unix::fs::symlink(&target, folder.join("run.lock")).unwrap();
        let message = FolderLock::take(&folder, Writer::Run).unwrap_err().to_string();
        assert!(message.contains("cannot lock"), "{message}");
        assert!(!target.exists());
    }

    #[test]
    fn folders_that_were_made_go_again_unless_something_is_put_there() {
        let above = scratch("lock_made");
        let folder = above.join("a/b");
        drop(FolderLock::take(&folder, Writer::Run).unwrap());
        assert!(!above.join("a").exists());
        let lock = FolderLock::take(&folder, Writer::Run).unwrap();
        fs::write(folder.join("history.csv"), "").unwrap();
        drop(lock);
        assert!(folder.join("history.csv").exists());
    }

    /// Holders come and go at the same moment, and each removes the file: at no time are there two.
    #[test]
    fn there_is_never_more_than_one_holder() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        let folder = scratch("lock_race");
        let (holders, taken) = (AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        if let Ok(_lock) = FolderLock::take(&folder, Writer::Study) {
                            assert_eq!(holders.fetch_add(1, Ordering::SeqCst), 0);
                            taken.fetch_add(1, Ordering::SeqCst);
                            holders.fetch_sub(1, Ordering::SeqCst);
                        }
                    }
                });
            }
        });
        assert!(taken.into_inner() > 0);
    }

    #[test]
    fn a_file_system_without_locks_is_told_from_a_failure() {
        for error in [Errno::NOLCK, Errno::OPNOTSUPP, Errno::NOSYS] {
            assert!(has_no_locks(&error.into()), "{error}");
        }
        assert!(!has_no_locks(&Errno::IO.into()));
    }
}
