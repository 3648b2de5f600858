//! What a run prints while it goes: a head, and a line per step.
//!
//! On a terminal the line of a step is for people: it is overwritten by the next, and a failed attempt or the end of a
//! stage stays. Elsewhere it is for programs, `step=1 stage=pull load_factor=0.1 ...`: every line stays, its keys do not
//! change, and it holds no control characters.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::time::Duration;

/// Where lines go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Nothing is printed.
    Silent,
    /// One line below the other.
    Lines,
    /// The line of a step takes the place of the one before.
    Terminal,
}

impl Mode {
    /// Only the rank that prints does, unless the user asked for quiet.
    pub fn choose(prints: bool, quiet: bool) -> Self {
        if !prints || quiet {
            Mode::Silent
        } else if on_terminal() {
            Mode::Terminal
        } else {
            Mode::Lines
        }
    }
}

/// True where a person watches standard output.
///
/// `mpirun` gives its processes a terminal of its own making and copies what they print to wherever it was told to; so
/// under `mpirun` the question is where that process prints.
fn on_terminal() -> bool {
    if !std::io::stdout().is_terminal() {
        return false;
    }
    if std::env::var_os("OMPI_COMM_WORLD_SIZE").is_none() && std::env::var_os("PMIX_RANK").is_none() {
        return true;
    }
    let target = std::fs::read_link(format!("/proc/{}/fd/1", std::os::unix::process::parent_id()));
    target.is_ok_and(|path| path.starts_with("/dev/pts") || path.to_string_lossy().starts_with("/dev/tty"))
}

/// What is known before the first step.
#[derive(Clone, Debug)]
pub struct RunHeader<'a> {
    /// Version of the program.
    pub version: &'a str,
    /// Commit that it was built from; empty where unknown.
    pub commit: &'a str,
    /// Name and version of each library.
    pub libraries: &'a [(&'a str, String)],
    /// Title of the scene.
    pub title: &'a str,
    pub points: u64,
    /// Unknowns of the first step.
    pub dofs: u64,
    pub ranks: usize,
}

/// A step that was accepted.
#[derive(Clone, Copy, Debug)]
pub struct StepLine<'a> {
    pub step: usize,
    pub stage: &'a str,
    /// Load factor of the stage, 0 to 1.
    pub load_factor: f64,
    pub step_size: f64,
    pub newton_iterations: usize,
    /// Relative residual that was reached.
    pub residual: f64,
    /// Wall time since the start.
    pub elapsed: Duration,
    /// Part of the whole run that is done, 0 to 1; the rest is estimated from it.
    pub done: f64,
    /// The same when this part of the run began: above 0 after a restart.
    pub begun: f64,
}

impl StepLine<'_> {
    /// Wall time that is still to come if the rest goes on like this part of the run [s]; `None` without a guess.
    fn rest(&self) -> Option<f64> {
        let progress = self.done - self.begun;
        (progress > 0.0).then(|| self.elapsed.as_secs_f64() * (1.0 - self.done).max(0.0) / progress)
    }
}

/// Printer of a run.
#[derive(Debug)]
pub struct Progress<W: Write> {
    mode: Mode,
    out: W,
    /// A line is on the terminal that the next one takes the place of.
    open: bool,
}

impl Progress<std::io::Stdout> {
    /// Prints on standard output.
    pub fn on_stdout(mode: Mode) -> Self {
        Progress::new(mode, std::io::stdout())
    }
}

impl<W: Write> Progress<W> {
    /// Prints elsewhere.
    pub fn new(mode: Mode, out: W) -> Self {
        Progress { mode, out, open: false }
    }

    /// Prints what is run, with what.
    pub fn header(&mut self, header: &RunHeader<'_>) {
        let commit = if header.commit.is_empty() {
            String::new()
        } else {
            format!(" ({})", header.commit)
        };
        let libraries: Vec<String> = header
            .libraries
            .iter()
            .map(|(name, version)| format!("{name} {version}"))
            .collect();
        self.message(&format!(
            "mpm-petsc {}{commit}, {}",
            header.version,
            libraries.join(", ")
        ));
        self.message(header.title);
        let (points, dofs, ranks) = (header.points, header.dofs, header.ranks);
        let word = if ranks == 1 { "rank" } else { "ranks" };
        self.message(&format!(
            "{points} material points, {dofs} degrees of freedom, {ranks} {word}"
        ));
    }

    /// Prints an accepted step.
    pub fn step(&mut self, line: &StepLine<'_>) {
        match self.mode {
            Mode::Silent => {}
            Mode::Lines => self.message(&pairs(line)),
            Mode::Terminal => {
                self.put(&format!("\r\x1b[K{}", describe(line)));
                self.open = true;
                if line.load_factor >= 1.0 {
                    self.close_line();
                }
            }
        }
    }

    /// Prints a line that stays, such as why an attempt failed.
    pub fn message(&mut self, text: &str) {
        if self.mode != Mode::Silent {
            self.close_line();
            self.put(&format!("{text}\n"));
        }
    }

    /// Leaves the terminal with the cursor on a line of its own; to be called at the end of a run, however it ends.
    pub fn finish(&mut self) {
        self.close_line();
    }

    fn close_line(&mut self) {
        if std::mem::take(&mut self.open) {
            self.put("\n");
        }
    }

    fn put(&mut self, text: &str) {
        // A reader that went away (`| head`) must not end the run.
        let _ = self.out.write_all(text.as_bytes()).and_then(|()| self.out.flush());
    }
}

/// A step as keys and values, in the words of `history.csv`; times in seconds.
fn pairs(line: &StepLine<'_>) -> String {
    let mut text = format!(
        "step={} stage={} load_factor={:?} step_size={:?} iterations={} residual={:.1e} elapsed={:.1}",
        line.step,
        word(line.stage),
        line.load_factor,
        line.step_size,
        line.newton_iterations,
        line.residual,
        line.elapsed.as_secs_f64(),
    );
    if let Some(rest) = line.rest() {
        write!(text, " rest={rest:.1}").expect("writing to a string cannot fail");
    }
    text
}

/// A text as the value of a key: in quotation marks where it would not end at the next space.
fn word(text: &str) -> String {
    let plain = |letter: char| !letter.is_whitespace() && !letter.is_control() && !['"', '=', '\\'].contains(&letter);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        serde_json::Value::from(text).to_string()
    }
}

/// A step for people.
fn describe(line: &StepLine<'_>) -> String {
    let mut text = format!(
        "step {:>4}  {}  load factor {:.6}  step {:.2e}  {:>2} iterations  residual {:.1e}  {}",
        line.step,
        line.stage,
        line.load_factor,
        line.step_size,
        line.newton_iterations,
        line.residual,
        clock_time(line.elapsed.as_secs_f64()),
    );
    if let Some(rest) = line.rest().filter(|_| line.done < 1.0) {
        write!(text, "  rest {}", clock_time(rest)).expect("writing to a string cannot fail");
    }
    text
}

/// Seconds as `h:mm:ss`, or `m:ss` below an hour.
fn clock_time(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(load_factor: f64) -> StepLine<'static> {
        StepLine {
            step: 7,
            stage: "compress",
            load_factor,
            step_size: 0.005,
            newton_iterations: 4,
            residual: 3.2e-11,
            elapsed: Duration::from_secs(90),
            done: load_factor,
            begun: 0.0,
        }
    }

    fn printed(mode: Mode) -> String {
        let mut out = Vec::new();
        let mut progress = Progress::new(mode, &mut out);
        let libraries = [("PETSc", "3.18.5".to_string())];
        progress.header(&RunHeader {
            version: "0.1.0",
            commit: "abc1234",
            libraries: &libraries,
            title: "Biaxial test",
            points: 900,
            dofs: 363,
            ranks: 2,
        });
        progress.step(&line(0.25));
        progress.message("attempt failed");
        progress.step(&line(1.0));
        progress.finish();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn a_step_on_a_terminal_tells_stage_load_iterations_residual_and_rest() {
        let text = printed(Mode::Terminal);
        assert!(
            text.starts_with("mpm-petsc 0.1.0 (abc1234), PETSc 3.18.5\nBiaxial test\n900 material points"),
            "{text}"
        );
        let step = text.lines().find(|line| line.contains("load factor")).unwrap();
        for part in [
            "compress",
            "0.250000",
            "5.00e-3",
            "4 iterations",
            "3.2e-11",
            "1:30",
            "rest 4:30",
        ] {
            assert!(step.contains(part), "{part} in {step}");
        }
    }

    #[test]
    fn elsewhere_a_step_is_keys_and_values() {
        let text = printed(Mode::Lines);
        let steps: Vec<&str> = text.lines().filter(|line| line.starts_with("step=")).collect();
        let expected = [
            "step=7 stage=compress load_factor=0.25 step_size=0.005 iterations=4 residual=3.2e-11 elapsed=90.0 rest=270.0",
            "step=7 stage=compress load_factor=1.0 step_size=0.005 iterations=4 residual=3.2e-11 elapsed=90.0 rest=0.0",
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn a_name_of_several_words_is_one_value() {
        for (name, value) in [
            ("pull", "pull"),
            ("pull it", "\"pull it\""),
            ("a=\"b\"", r#""a=\"b\"""#),
            ("", "\"\""),
            ("two\nlines", r#""two\nlines""#),
        ] {
            assert_eq!(word(name), value);
        }
    }

    #[test]
    fn plain_lines_hold_no_control_characters() {
        assert!(
            printed(Mode::Lines)
                .chars()
                .all(|letter| letter == '\n' || !letter.is_control())
        );
        assert_eq!(printed(Mode::Silent), "");
    }

    #[test]
    fn on_a_terminal_a_step_overwrites_the_last_and_messages_stay() {
        let text = printed(Mode::Terminal);
        assert_eq!(text.matches("\r\x1b[K").count(), 2);
        assert!(text.contains("\nattempt failed\n"), "the step before stays: {text:?}");
        assert!(text.ends_with('\n'));
    }

    #[test]
    fn nothing_is_printed_on_other_ranks_or_when_quiet() {
        assert_eq!(Mode::choose(false, false), Mode::Silent);
        assert_eq!(Mode::choose(true, true), Mode::Silent);
    }
}
