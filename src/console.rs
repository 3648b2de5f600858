//! Text for whoever started the program. A reader that has seen enough, such as `head`, is no failure: what it no longer
//! takes is dropped, and the work goes on.
//!
//! Titles, names of files and values of keys come from files that others wrote. What a terminal would obey instead of
//! showing it is written as in a program, `\u{1b}`.

use std::borrow::Cow;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

/// Writes text to standard output.
///
/// # Errors
/// What keeps it from being written, such as a full disk; not a reader that has left.
pub fn write(text: Arguments<'_>) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let text = text.to_string();
    match out.write_all(lines(&text).as_bytes()).and_then(|()| out.flush()) {
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
    let line = format!("{line}\n");
    let _ = io::stderr().lock().write_all(lines(&line).as_bytes());
}

/// A text of others as part of a line: nothing in it ends the line or moves the cursor.
pub fn shown(text: &str) -> Cow<'_, str> {
    escape(text, |_| false)
}

/// Text of several lines, of which nothing else than their ends and tabulators moves the cursor.
pub fn lines(text: &str) -> Cow<'_, str> {
    escape(text, |letter| matches!(letter, '\n' | '\t'))
}

/// Whether a terminal obeys a letter instead of showing it: control characters, and marks that turn the direction of
/// writing around.
pub fn is_command(letter: char) -> bool {
    letter.is_control() || matches!(letter, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn escape(text: &str, stays: impl Fn(char) -> bool) -> Cow<'_, str> {
    let obeyed = |letter: char| is_command(letter) && !stays(letter);
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 8);
    for letter in text.chars() {
        if obeyed(letter) {
            escaped.extend(letter.escape_default());
        } else {
            escaped.push(letter);
        }
    }
    Cow::Owned(escaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown() {
        assert_eq!(shown("Säule\u{1b}[2J\r\n\u{9b}1A"), "Säule\\u{1b}[2J\\r\\n\\u{9b}1A");
        assert_eq!(shown("\u{202e}txt.exe"), "\\u{202e}txt.exe");
        assert_eq!(lines("one\n\ttwo\u{7}\n"), "one\n\ttwo\\u{7}\n");
        assert!(matches!(lines("nothing to do 加\n"), Cow::Borrowed(_)));
    }
}
