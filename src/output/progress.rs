//! What a run prints while it goes: a head, a line per step, and how it ended.
//!
//! On a terminal one line follows the run down to its iterations and keeps to the width of the terminal; messages stay
//! above it. Elsewhere each step leaves a line for programs, `step=1 stage=pull load_factor=0.1 ...`: its keys do not
//! change, and it holds no control characters.

use super::summary::Status;
use super::terminal::{Columns, LiveLine, Out, clock_time, watched, write};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

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

/// How a run ended, and what it leaves.
#[derive(Clone, Copy, Debug)]
pub struct Ending<'a> {
    pub status: Status,
    /// Steps that were accepted.
    pub steps: usize,
    /// Wall time of all parts of the run [s].
    pub seconds: f64,
    /// The result folder.
    pub directory: &'a Path,
    /// The page on the run, where it was drawn.
    pub report: Option<&'a Path>,
    /// Step from which `--restart` goes on, where there is a checkpoint.
    pub saved: Option<usize>,
}

/// Printer of a run.
#[derive(Default)]
pub struct Progress {
    /// Where lines go; nowhere on other ranks and where the user asked for quiet.
    out: Option<Out>,
    /// The line on a terminal that a person watches.
    line: Option<LiveLine>,
    /// What the line says before the step: rest of the time and share of the run.
    rest: String,
}

impl Progress {
    /// Prints on standard output, on the rank that `prints`, of a run that takes so long already.
    pub fn on_stdout(prints: bool, elapsed: Duration) -> Self {
        if prints {
            Progress::new(Arc::new(Mutex::new(std::io::stdout())), watched(), elapsed)
        } else {
            Progress::default()
        }
    }

    /// Prints elsewhere; for a person where there is a terminal with so many columns.
    fn new(out: Out, terminal: Option<Columns>, elapsed: Duration) -> Self {
        Progress {
            line: terminal.map(|columns| LiveLine::new(out.clone(), columns, elapsed)),
            out: Some(out),
            rest: String::new(),
        }
    }

    /// The line on a terminal, which is to be told of iterations; `None` where no terminal listens.
    pub fn line(&self) -> Option<LiveLine> {
        self.line.clone()
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

    /// Shows on a terminal that a step is attempted.
    pub fn attempt(&mut self, step: usize, stage: &str) {
        if let Some(line) = &self.line {
            line.show(format!("{}step {step}  {stage}", self.rest));
        }
    }

    /// Prints an accepted step.
    pub fn step(&mut self, step: &StepLine<'_>) {
        let Some(line) = &self.line else {
            return self.message(&pairs(step));
        };
        let rest = step.rest().map(|rest| format!("rest {}  ", clock_time(rest)));
        self.rest = format!("{}{:.0} %  ", rest.unwrap_or_default(), 100.0 * step.done);
        line.show(format!("{}{}", self.rest, describe(step)));
        if step.load_factor >= 1.0 {
            let elapsed = clock_time(step.elapsed.as_secs_f64());
            self.message(&format!(
                "stage {}: done with step {}, {elapsed}",
                step.stage, step.step
            ));
        }
    }

    /// Prints a line that stays, such as why an attempt failed.
    pub fn message(&mut self, text: &str) {
        let Some(out) = &self.out else { return };
        let print = || write(out, &format!("{text}\n"));
        match &self.line {
            Some(line) => line.above(print),
            None => print(),
        }
    }

    /// Prints how a run ended, where its results and its report are, and what to do next.
    pub fn ending(&mut self, ending: &Ending<'_>) {
        let (word, results) = match ending.status {
            Status::Completed => ("completed", "results are"),
            Status::Stopped => ("stopped", "results up to there are"),
            Status::Interrupted => ("interrupted", "results up to there are"),
            Status::Failed => ("failed", "what was written until then is"),
        };
        let (steps, time, directory) = (ending.steps, clock_time(ending.seconds), ending.directory.display());
        self.message(&format!("{word} after step {steps}, {time}; {results} in {directory}"));
        if let Some(report) = ending.report {
            self.message(&format!("report: {}", report.display()));
        }
        let next = match ending.status {
            Status::Completed => return,
            Status::Stopped => "what helps is in docs/stability.md",
            Status::Interrupted => "nothing is wrong",
            Status::Failed => "mend what the error names",
        };
        let restart = ending.saved.map(|step| match ending.status {
            Status::Stopped => format!("; --restart goes on from step {step}, with another `solver` too"),
            _ => format!("; --restart goes on from step {step}"),
        });
        self.message(&format!("next: {next}{}", restart.unwrap_or_default()));
    }

    /// Takes the line of a terminal away; to be called at the end of a run, however it ends.
    pub fn finish(&mut self) {
        if let Some(line) = self.line.take() {
            line.clear();
        }
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

/// A step that was solved, for people; what matters most first, since a narrow terminal cuts the end off.
fn describe(line: &StepLine<'_>) -> String {
    format!(
        "step {}  {}  {} iterations  residual {:.1e}  load factor {:.6}  size {:.3e}",
        line.step, line.stage, line.newton_iterations, line.residual, line.load_factor, line.step_size,
    )
}

#[cfg(test)]
mod tests {
    use super::super::terminal::tests::Watched;
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

    fn run(mut progress: Progress) -> Progress {
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
        progress.attempt(7, "compress");
        progress.step(&line(0.25));
        progress.message("attempt failed");
        progress
    }

    fn plain() -> String {
        let out = Arc::new(Mutex::new(Vec::new()));
        let mut progress = run(Progress::new(out.clone(), None, Duration::ZERO));
        progress.step(&line(1.0));
        progress.finish();
        let bytes = out.lock().unwrap().clone();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn a_step_on_a_terminal_tells_rest_share_stage_iterations_residual_and_load() {
        let terminal = Watched::new(110);
        let mut progress = run(Progress::new(terminal.out(), Some(terminal.columns()), Duration::ZERO));
        let rows = terminal.rows();
        assert_eq!(rows[0], "mpm-petsc 0.1.0 (abc1234), PETSc 3.18.5");
        assert_eq!(rows[3], "attempt failed", "{rows:?}");
        let step =
            "rest 4:30  25 %  step 7  compress  4 iterations  residual 3.2e-11  load factor 0.250000  size 5.000e-3";
        assert_eq!(rows[4..], [format!("0:00  {step}")]);
        progress.attempt(8, "compress");
        progress.line().unwrap().iterated(2, 1e-3);
        let next = "0:00  rest 4:30  25 %  step 8  compress  iteration 2  residual 1.0e-3";
        assert_eq!(terminal.rows()[4..], [next]);
    }

    #[test]
    fn the_end_of_a_stage_stays_on_a_terminal_and_its_last_step_does_not() {
        let terminal = Watched::new(40);
        let mut progress = Progress::new(terminal.out(), Some(terminal.columns()), Duration::ZERO);
        progress.step(&line(1.0));
        progress.finish();
        assert_eq!(terminal.rows(), ["stage compress: done with step 7, 1:30"]);
    }

    #[test]
    fn elsewhere_a_step_is_keys_and_values() {
        let text = plain();
        let steps: Vec<&str> = text.lines().filter(|line| line.starts_with("step=")).collect();
        let expected = [
            "step=7 stage=compress load_factor=0.25 step_size=0.005 iterations=4 residual=3.2e-11 elapsed=90.0 rest=270.0",
            "step=7 stage=compress load_factor=1.0 step_size=0.005 iterations=4 residual=3.2e-11 elapsed=90.0 rest=0.0",
        ];
        assert_eq!(steps, expected);
        assert_eq!(text.lines().count(), 6, "{text}");
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
        assert!(plain().chars().all(|letter| letter == '\n' || !letter.is_control()));
    }

    #[test]
    fn the_last_lines_tell_how_a_run_ended_where_its_report_is_and_what_to_do() {
        let told = |status, saved| {
            let out = Arc::new(Mutex::new(Vec::new()));
            Progress::new(out.clone(), None, Duration::ZERO).ending(&Ending {
                status,
                steps: 28,
                seconds: 61.0,
                directory: Path::new("results/slope"),
                report: Some(Path::new("results/slope/report.html")),
                saved,
            });
            let bytes = out.lock().unwrap().clone();
            String::from_utf8(bytes).unwrap()
        };
        let report = "report: results/slope/report.html";
        assert_eq!(
            told(Status::Completed, Some(28)),
            format!("completed after step 28, 1:01; results are in results/slope\n{report}\n")
        );
        assert_eq!(
            told(Status::Stopped, Some(28)),
            format!(
                "stopped after step 28, 1:01; results up to there are in results/slope\n{report}\nnext: what helps is in \
                 docs/stability.md; --restart goes on from step 28, with another `solver` too\n"
            )
        );
        let next = |status, saved| told(status, saved).lines().last().unwrap().to_owned();
        let interrupted = "next: nothing is wrong; --restart goes on from step 28";
        assert_eq!(next(Status::Interrupted, Some(28)), interrupted);
        assert_eq!(next(Status::Failed, None), "next: mend what the error names");
    }

    #[test]
    fn on_other_ranks_nothing_listens() {
        assert!(run(Progress::on_stdout(false, Duration::ZERO)).line().is_none());
    }
}
