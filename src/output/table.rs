//! A CSV file that grows by whole rows.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use crate::error::Error;

/// An open CSV file. A row reaches the operating system in one piece, so that a run that is killed leaves whole rows.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    file: File,
}

impl Table {
    /// Starts a file anew with its head line.
    pub(super) fn create(path: &Path, columns: &[&str]) -> Result<Self, Error> {
        let file = File::create(path).map_err(|error| failure(path, &error))?;
        let mut table = Table {
            path: path.to_path_buf(),
            file,
        };
        let names: Vec<String> = columns.iter().map(|name| quoted(name)).collect();
        table.write(&(names.join(",") + "\n"))?;
        Ok(table)
    }

    /// Goes on with a file that an earlier run left, cut back to its first `length` bytes, which end a row.
    pub(super) fn resume(path: &Path, length: u64) -> Result<Self, Error> {
        let open = || -> std::io::Result<File> {
            let mut file = File::options().read(true).write(true).open(path)?;
            let mut end = [0];
            file.seek(SeekFrom::Start(length.saturating_sub(1)))?;
            file.read_exact(&mut end)?;
            if end != [b'\n'] {
                return Err(std::io::Error::other("it was changed since the checkpoint was written"));
            }
            file.set_len(length)?;
            Ok(file)
        };
        let file = open().map_err(|error| Error::System(format!("cannot go on with {}: {error}", path.display())))?;
        Ok(Table {
            path: path.to_path_buf(),
            file,
        })
    }

    /// Tells that the file has another name now.
    pub(super) fn renamed(&mut self, path: &Path) {
        self.path = path.to_path_buf();
    }

    /// Returns when all rows are on disk, so that they outlive a crash of the machine.
    pub(super) fn secure(&self) -> Result<(), Error> {
        self.file.sync_data().map_err(|error| failure(&self.path, &error))
    }

    /// Length of the file [byte].
    pub(super) fn length(&self) -> Result<u64, Error> {
        let metadata = self.file.metadata().map_err(|error| failure(&self.path, &error))?;
        Ok(metadata.len())
    }

    /// Adds text that consists of whole rows.
    pub(super) fn write(&mut self, rows: &str) -> Result<(), Error> {
        self.file
            .write_all(rows.as_bytes())
            .map_err(|error| failure(&self.path, &error))
    }
}

fn failure(path: &Path, error: &std::io::Error) -> Error {
    Error::System(format!("cannot write {}: {error}", path.display()))
}

/// Text as a CSV cell (RFC 4180).
pub(super) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_string()
    }
}

/// Adds a cell with a number, with just the digits that give it back when read.
pub(super) fn push_number(row: &mut String, value: f64) {
    write!(row, ",{value:?}").expect("writing to a string cannot fail");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_back_exactly() {
        for value in [0.1 + 0.2, 1.0 / 3.0, -5e-324, f64::MAX, 1e-7, 123456789.0, -0.0] {
            let mut row = String::new();
            push_number(&mut row, value);
            let read: f64 = row.strip_prefix(',').unwrap().parse().unwrap();
            assert_eq!(read.to_bits(), value.to_bits(), "{row}");
        }
    }

    #[test]
    fn names_with_commas_and_quotes_stay_one_cell() {
        assert_eq!(quoted("compress"), "compress");
        assert_eq!(quoted("press, \"slowly\""), "\"press, \"\"slowly\"\"\"");
    }
}
