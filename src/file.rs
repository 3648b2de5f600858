//! Reading files that somebody named: whole, up to a limit, and no pipes or devices, which may never end.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// What the system says; and, in words, a folder, a pipe or a device.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    if kind.is_file() {
        return File::open(path);
    }
    let what = if kind.is_dir() {
        "this is a folder, not a file"
    } else {
        "this is a pipe or a device, not a file that has an end"
    };
    Err(io::Error::new(ErrorKind::InvalidInput, what))
}

/// The bytes of a regular file.
///
/// # Errors
/// As [`open`]; a file that is longer than `maximum` [byte].
pub fn read(path: &Path, maximum: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(maximum + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > maximum {
        let message = format!("the file is longer than {maximum} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// The text of a regular file of at most `maximum` bytes.
///
/// # Errors
/// A sentence that says why there is none.
pub fn read_text(path: &Path, maximum: u64) -> Result<String, String> {
    let bytes = read(path, maximum).map_err(|error| match error.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        ErrorKind::InvalidInput | ErrorKind::FileTooLarge => error.to_string(),
        _ => format!("the file cannot be read: {error}"),
    })?;
    String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        format!("line {line} is not UTF-8 text")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, FileType, Mode, mknodat};

    #[test]
    fn what_has_no_end_is_refused_at_once() {
        let folder = std::env::temp_dir().join(format!("mpm-petsc-file-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let pipe = folder.join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR, 0).unwrap();
        let ten = folder.join("ten");
        fs::write(&ten, "0123456789").unwrap();
        for (path, reason) in [
            (pipe.as_path(), "a pipe or a device"),
            (Path::new("/dev/zero"), "a pipe or a device"),
            (&folder, "this is a folder"),
            (&folder.join("absent"), "no such file"),
            (&ten, "longer than 9 bytes"),
        ] {
            let message = read_text(path, 9).unwrap_err();
            assert!(message.contains(reason), "{}: {message}", path.display());
        }
        assert_eq!(read_text(&ten, 10).unwrap(), "0123456789");
        fs::remove_dir_all(&folder).unwrap();
    }
}
