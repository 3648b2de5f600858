//! A CSV file that grows by whole rows.

use std::fmt::{Display, Write as _};
use std::fs::File;
use std::io::{self, ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};

use super::folder::create_anew;
use crate::error::Error;

/// How much of a file is read at once [byte].
const PIECE: usize = 1 << 16;

/// Length of a file [byte] and the CRC-32 of all that it holds: what tells whether it is as it was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Extent {
    pub length: u64,
    pub checksum: u32,
}

/// An open CSV file. A row reaches the operating system in one piece, so that a run that is killed leaves whole rows.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    file: File,
    /// Length of what was written, and the checksum so far.
    length: u64,
    hasher: Hasher,
}

impl Table {
    /// Starts a file anew with its head line.
    pub(super) fn create(path: &Path, columns: &[&str]) -> Result<Self, Error> {
        let file = create_anew(path).map_err(|error| failure(path, &error))?;
        let mut table = Table {
            path: path.to_path_buf(),
            file,
            length: 0,
            hasher: Hasher::new(),
        };
        let names: Vec<String> = columns.iter().map(|name| quoted(name)).collect();
        table.write(&(names.join(",") + "\n"))?;
        Ok(table)
    }

    /// Opens a file that an earlier run left, to go on behind its first bytes; it stays as it is until [`Table::cut`].
    /// `None` if it is gone.
    ///
    /// # Errors
    /// It begins otherwise than it did, or cannot be written.
    pub(super) fn find(path: &Path, expected: Extent) -> Result<Option<Self>, Error> {
        let failed = |what: &dyn Display| {
            let path = path.display();
            Error::System(format!("cannot go on with {path}: {what}"))
        };
        let file = match File::options().read(true).write(true).open(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            opened => opened.map_err(|error| failed(&error))?,
        };
        // Reading a pipe would wait for ever.
        if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
            return Err(failed(&"it is no regular file"));
        }
        let hasher = checksum(&file, expected.length).map_err(|error| failed(&error))?;
        if hasher.as_ref().map(|hasher| hasher.clone().finalize()) != Some(expected.checksum) {
            return Err(failed(
                &"it was changed since the checkpoint was written; put it back as it was, or move it away, and a new one \
                  begins where the run goes on",
            ));
        }
        Ok(hasher.map(|hasher| Table {
            path: path.to_path_buf(),
            file,
            length: expected.length,
            hasher,
        }))
    }

    /// Drops what follows the part that was found.
    pub(super) fn cut(&mut self) -> Result<(), Error> {
        let cut = || {
            self.file.set_len(self.length)?;
            (&self.file).seek(SeekFrom::End(0))
        };
        cut().map(drop).map_err(|error| failure(&self.path, &error))
    }

    /// Tells that the file has another name now.
    pub(super) fn renamed(&mut self, path: &Path) {
        self.path = path.to_path_buf();
    }

    /// Returns when all rows are on disk, so that they outlive a crash of the machine.
    pub(super) fn secure(&self) -> Result<(), Error> {
        self.file.sync_data().map_err(|error| failure(&self.path, &error))
    }

    /// What the file holds now.
    pub(super) fn extent(&self) -> Extent {
        Extent {
            length: self.length,
            checksum: self.hasher.clone().finalize(),
        }
    }

    /// Adds text that consists of whole rows.
    pub(super) fn write(&mut self, rows: &str) -> Result<(), Error> {
        self.file
            .write_all(rows.as_bytes())
            .map_err(|error| failure(&self.path, &error))?;
        self.length += rows.len() as u64;
        self.hasher.update(rows.as_bytes());
        Ok(())
    }
}

/// Checksum of the first bytes of a file; `None` if there are not so many.
fn checksum(mut file: &File, length: u64) -> io::Result<Option<Hasher>> {
    let mut hasher = Hasher::new();
    let mut piece = vec![0; PIECE];
    let mut rest = length;
    while rest > 0 {
        let wanted = rest.min(PIECE as u64) as usize;
        match file.read(&mut piece[..wanted])? {
            0 => return Ok(None),
            count => {
                hasher.update(&piece[..count]);
                rest -= count as u64;
            }
        }
    }
    Ok(Some(hasher))
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
