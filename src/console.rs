//! Text for whoever started the program. A reader that has seen enough, such as `head`, is no failure: what it no longer
//! takes is dropped, and the work goes on.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

/// Writes text to standard output.
///
/// # Errors
/// What keeps it from being written, such as a full disk; not a reader that has left.
pub fn write(text: Arguments<'_>) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_fmt(text).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// Writes text to standard output, if that is possible.
pub fn print(text: Arguments<'_>) {
    let _ = write(text);
}

/// Writes a line to standard output.
pub fn say(line: Arguments<'_>) {
    print(format_args!("{line}\n"));
}

/// Writes a line to standard error.
pub fn complain(line: Arguments<'_>) {
    let _ = io::stderr().lock().write_fmt(format_args!("{line}\n"));
}
