//! The terminal that a person watches: which one it is, how wide it is, and a line on it that changes while a run goes.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle, TermLike};
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use std::cell::RefCell;
use std::fmt::{self, Debug};
use std::io::{self, IsTerminal, Write};
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often the line is drawn again where nothing new is told, so that its clock goes on.
const TICK: Duration = Duration::from_secs(1);

/// Drawings a second at most.
const RATE: u8 = 20;

/// Columns of a terminal that does not tell them.
const USUAL_WIDTH: u16 = 80;

/// Where text goes; the line is drawn by a thread of its own as well.
pub type Out = Arc<Mutex<dyn Write + Send>>;

/// Tells the columns of a terminal, which may change at any time.
pub type Columns = Box<dyn Fn() -> u16 + Send + Sync>;

/// Columns of the terminal on which a person watches standard output; `None` where nobody does.
///
/// `mpirun` gives its processes a terminal of its own making, without a size, and copies what they print to wherever it
/// was told to; so under `mpirun` the terminal is where that process prints.
pub fn watched() -> Option<Columns> {
    let able = std::env::var_os("TERM").is_some_and(|kind| kind != "dumb");
    if !able || !io::stdout().is_terminal() {
        return None;
    }
    if std::env::var_os("OMPI_COMM_WORLD_SIZE").is_none() && std::env::var_os("PMIX_RANK").is_none() {
        return Some(Box::new(|| columns(rustix::termios::tcgetwinsize(io::stdout()))));
    }
    let path = format!("/proc/{}/fd/1", std::os::unix::process::parent_id());
    let flags = OFlags::WRONLY | OFlags::NOCTTY | OFlags::CLOEXEC | OFlags::NONBLOCK;
    let terminal: OwnedFd = rustix::fs::open(path, flags, Mode::empty()).ok()?;
    terminal
        .is_terminal()
        .then(|| Box::new(move || columns(rustix::termios::tcgetwinsize(&terminal))) as Columns)
}

fn columns(size: rustix::io::Result<rustix::termios::Winsize>) -> u16 {
    size.map_or(0, |size| size.ws_col)
}

/// A line that the next one takes the place of, as wide as the terminal at most. What it shows follows the clock.
#[derive(Clone, Debug)]
pub struct LiveLine {
    bar: ProgressBar,
    /// What the line says of the step that is being solved.
    step: Rc<RefCell<String>>,
}

impl LiveLine {
    /// A line that is empty as yet; `elapsed` is what its clock shows now.
    pub fn new(out: Out, columns: Columns, elapsed: Duration) -> Self {
        let clock = |state: &ProgressState, text: &mut dyn fmt::Write| {
            let _ = text.write_str(&clock_time(state.elapsed().as_secs_f64()));
        };
        let style = ProgressStyle::with_template("{clock}  {wide_msg}").expect("the template is valid");
        let screen = ProgressDrawTarget::term_like_with_hz(Box::new(Screen::new(out, columns)), RATE);
        let bar = ProgressBar::with_draw_target(None, screen)
            .with_style(style.with_key("clock", clock))
            .with_elapsed(elapsed)
            .with_finish(ProgressFinish::AndClear);
        bar.enable_steady_tick(TICK);
        LiveLine {
            bar,
            step: Rc::default(),
        }
    }

    /// Shows a step.
    pub fn show(&self, step: String) {
        self.bar.set_message(step.clone());
        self.step.replace(step);
    }

    /// Adds to the step that is shown what its newest iteration came to.
    pub fn iterated(&self, iteration: usize, residual: f64) {
        let step = self.step.borrow();
        self.bar
            .set_message(format!("{step}  iteration {iteration}  residual {residual:.1e}"));
    }

    /// Takes the line away, does something, and draws it again below.
    pub fn above(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    /// Takes the line away for good.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Draws the line and leaves the cursor at its beginning. So whatever a terminal makes of the line when it becomes
/// narrower, whether it breaks it or cuts it, the line lies between the cursor and the end of the screen.
struct Screen {
    out: Out,
    columns: Columns,
    /// What is to be drawn.
    text: Mutex<String>,
}

impl Screen {
    fn new(out: Out, columns: Columns) -> Self {
        let text = Mutex::default();
        Screen { out, columns, text }
    }

    fn add(&self, text: &str) {
        self.text.lock().unwrap_or_else(PoisonError::into_inner).push_str(text);
    }
}

impl Debug for Screen {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Screen").finish_non_exhaustive()
    }
}

impl TermLike for Screen {
    fn width(&self) -> u16 {
        match (self.columns)() {
            0 => USUAL_WIDTH,
            columns => columns,
        }
    }

    // There is one line, and the cursor is at its beginning already.
    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.add(text);
        self.add("\n");
        Ok(())
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.add(text);
        Ok(())
    }

    fn clear_line(&self) -> io::Result<()> {
        self.add("\r\x1b[J");
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        let text = std::mem::take(&mut *self.text.lock().unwrap_or_else(PoisonError::into_inner));
        // Without the blanks up to the margin, which a terminal that becomes narrower would break into lines.
        write(&self.out, &format!("{}\r", text.trim_end_matches(' ')));
        Ok(())
    }
}

/// Writes a text as one piece. A reader that went away (`| head`) must not end the run.
pub fn write(out: &Out, text: &str) {
    let mut out = out.lock().unwrap_or_else(PoisonError::into_inner);
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Seconds as `h:mm:ss`, or `m:ss` below an hour.
pub fn clock_time(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes}:{seconds:02}")
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU16, Ordering};

    /// A terminal of 6 rows that tells its width and can be read.
    #[derive(Clone)]
    pub struct Watched {
        screen: Arc<Mutex<vt100::Parser>>,
        width: Arc<AtomicU16>,
    }

    impl Watched {
        pub fn new(width: u16) -> Self {
            let screen = Arc::new(Mutex::new(vt100::Parser::new(6, width, 0)));
            let width = Arc::new(AtomicU16::new(width));
            Watched { screen, width }
        }

        pub fn out(&self) -> Out {
            Arc::new(Mutex::new(self.clone()))
        }

        pub fn columns(&self) -> Columns {
            let width = self.width.clone();
            Box::new(move || width.load(Ordering::Relaxed))
        }

        /// Gives it another width.
        pub fn resize(&self, width: u16) {
            self.screen.lock().unwrap().screen_mut().set_size(6, width);
            self.width.store(width, Ordering::Relaxed);
        }

        /// Rows that hold something.
        pub fn rows(&self) -> Vec<String> {
            let text = self.screen.lock().unwrap().screen().contents();
            text.lines().map(str::to_owned).filter(|row| !row.is_empty()).collect()
        }

        /// Row and column of the cursor.
        pub fn cursor(&self) -> (u16, u16) {
            self.screen.lock().unwrap().screen().cursor_position()
        }
    }

    impl Write for Watched {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            // The terminal's driver begins each line at the left.
            let text = String::from_utf8(bytes.to_vec()).unwrap().replace('\n', "\r\n");
            self.screen.lock().unwrap().process(text.as_bytes());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn line(terminal: &Watched) -> LiveLine {
        LiveLine::new(terminal.out(), terminal.columns(), Duration::from_secs(8))
    }

    #[test]
    fn a_line_is_as_wide_as_the_terminal_at_most() {
        for width in [20, 40, 80, 110, 200] {
            let terminal = Watched::new(width);
            let line = line(&terminal);
            line.show(format!("step 7  {}", "剪切 shear ".repeat(30)));
            line.iterated(3, 1.25e-6);
            assert!(terminal.rows().len() <= 1, "{width}: {:?}", terminal.rows());
            assert_eq!(terminal.cursor(), (0, 0), "{width}");
            line.clear();
            assert_eq!(terminal.rows(), [""; 0], "{width}");
        }
    }

    #[test]
    fn an_iteration_is_told_beside_its_step() {
        let terminal = Watched::new(80);
        let line = line(&terminal);
        line.show("step 7  shear".into());
        line.iterated(3, 1.2e-6);
        assert_eq!(terminal.rows(), ["0:08  step 7  shear  iteration 3  residual 1.2e-6"]);
    }

    #[test]
    fn what_is_printed_stays_above_the_line() {
        let terminal = Watched::new(40);
        let line = line(&terminal);
        line.show("step 7  shear".into());
        line.above(|| write(&terminal.out(), "warning: slow\n"));
        line.show("step 8  shear".into());
        assert_eq!(terminal.rows(), ["warning: slow", "0:08  step 8  shear"]);
        line.clear();
        assert_eq!(terminal.rows(), ["warning: slow"]);
        assert_eq!(terminal.cursor(), (1, 0));
    }

    #[test]
    fn nothing_is_left_of_a_line_when_the_terminal_is_resized() {
        let terminal = Watched::new(110);
        let line = line(&terminal);
        for width in [110, 40, 200, 60] {
            terminal.resize(width);
            line.show("step 7 ".repeat(40));
            assert_eq!(terminal.rows().len(), 1, "{width}: {:?}", terminal.rows());
        }
    }

    #[test]
    fn a_line_that_is_dropped_is_taken_away() {
        let terminal = Watched::new(80);
        let line = line(&terminal);
        line.show("step 7".into());
        drop(line);
        assert_eq!(terminal.rows(), [""; 0]);
    }

    #[test]
    fn times_are_read_as_on_a_clock() {
        for (seconds, text) in [(0.4, "0:00"), (89.6, "1:30"), (3599.7, "1:00:00"), (3725.0, "1:02:05")] {
            assert_eq!(clock_time(seconds), text);
        }
    }
}
