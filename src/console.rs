//! Text for whoever started the program. A reader that has seen enough, such as `head`, is no failure: what it no longer
//! takes is dropped, and the work goes on.

use std::fmt::Arguments;
use std::io::Write;

/// Writes text to standard output.
pub fn print(text: Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_fmt(text).and_then(|()| out.flush());
}

/// Writes a line to standard output.
pub fn say(line: Arguments<'_>) {
    print(format_args!("{line}\n"));
}

/// Writes a line to standard error.
pub fn complain(line: Arguments<'_>) {
    let _ = std::io::stderr().lock().write_fmt(format_args!("{line}\n"));
}
