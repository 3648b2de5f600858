//! Runs of the program under test, alone or under `mpirun`, with a time limit.

use super::folder::Folder;
use super::results::{Convergence, Summary, Table};
use rustix::process::{Pid, Signal, kill_process};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The slowest run takes half a minute on a machine with nothing else to do; a hang must not stop the test suite.
const LIMIT: Duration = Duration::from_secs(300);

/// How long a program may take to end after it was asked to.
const GRACE: Duration = Duration::from_secs(5);

/// A scene of the repository.
pub fn config(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("configs")
        .join(format!("{name}.yaml"))
}

/// What to run, and how.
pub struct Launch {
    ranks: usize,
    arguments: Vec<String>,
    petsc: Vec<String>,
    environment: Vec<(String, String)>,
    directory: Option<String>,
    report: bool,
    address_limit: Option<usize>,
    folder: Folder,
}

impl Launch {
    /// The program with these arguments alone, in an empty folder.
    pub fn arguments(arguments: &[&str]) -> Self {
        Launch {
            ranks: 1,
            arguments: arguments.iter().map(ToString::to_string).collect(),
            petsc: Vec::new(),
            environment: Vec::new(),
            directory: None,
            report: false,
            address_limit: None,
            folder: Folder::new(),
        }
    }

    /// A run of a configuration file; the results go to a folder of the test.
    pub fn file(path: &Path) -> Self {
        Launch::arguments(&[&path.to_string_lossy()]).output("results")
    }

    /// A run of a scene of the repository.
    pub fn config(name: &str) -> Self {
        Launch::file(&config(name))
    }

    /// A run of a scene given as text.
    pub fn text(yaml: &str) -> Self {
        let mut launch = Launch::arguments(&[]).output("results");
        let scene = launch.folder.write("scene.yaml", yaml);
        launch.arguments.push(scene.to_string_lossy().into_owned());
        launch
    }

    /// Drives a material along a path given as text.
    pub fn point(yaml: &str) -> Self {
        Launch::text(yaml).no_output().before("point")
    }

    /// Checks instead of running.
    pub fn checking(self) -> Self {
        self.before("check")
    }

    fn before(mut self, command: &str) -> Self {
        self.arguments.insert(0, command.to_owned());
        self
    }

    /// Runs on so many ranks; one rank runs without `mpirun`.
    pub fn ranks(mut self, ranks: usize) -> Self {
        self.ranks = ranks;
        self
    }

    /// More arguments, before the options of PETSc.
    pub fn with(mut self, arguments: &[&str]) -> Self {
        self.arguments.extend(arguments.iter().map(ToString::to_string));
        self
    }

    /// Overrides keys of the configuration, `a.b.c=value`.
    pub fn set(mut self, assignments: &[&str]) -> Self {
        for assignment in assignments {
            self = self.with(&["--set", assignment]);
        }
        self
    }

    /// Options after `--`.
    pub fn petsc(mut self, options: &str) -> Self {
        self.petsc.extend(options.split_whitespace().map(str::to_owned));
        self
    }

    /// Sets a variable of the environment of the run.
    pub fn environment(mut self, name: &str, value: &str) -> Self {
        self.environment.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Limits the addresses that a process of the run may use [MB].
    pub fn address_limit(mut self, megabytes: usize) -> Self {
        self.address_limit = Some(megabytes);
        self
    }

    /// Names the result folder on the command line, within the folder of the launch unless absolute.
    pub fn output(mut self, directory: &str) -> Self {
        self.directory = Some(directory.to_owned());
        self
    }

    /// Draws the report at the end, which other runs leave out to save time.
    pub fn with_report(mut self) -> Self {
        self.report = true;
        self
    }

    /// Leaves the result folder to the configuration.
    pub fn no_output(mut self) -> Self {
        self.directory = None;
        self
    }

    /// Puts a file beside the scene.
    pub fn beside(self, name: &str, text: &str) -> Self {
        self.folder.write(name, text);
        self
    }

    /// Starts the program and waits for it.
    pub fn run(self) -> Run {
        self.start().wait()
    }

    /// Starts the program.
    pub fn start(self) -> Started {
        let cores = Cores::take(self.ranks.min(CORES));
        let mut child = self
            .command()
            .spawn()
            .expect("the program starts (package openmpi-bin)");
        let out = reader(child.stdout.take().map(Pipe::Out));
        let err = reader(child.stderr.take().map(Pipe::Err));
        let directory = self.directory.as_ref().map(|name| self.folder.path().join(name));
        Started {
            child,
            out,
            err,
            begin: Instant::now(),
            folder: self.folder,
            directory,
            _cores: cores,
        }
    }

    fn command(&self) -> Command {
        let program = env!("CARGO_BIN_EXE_mpm-petsc");
        let mut words = Vec::new();
        if self.ranks > 1 {
            words.extend(["mpirun", "--quiet", "-n"].map(str::to_owned));
            words.push(self.ranks.to_string());
        }
        if let Some(megabytes) = self.address_limit {
            let limited = format!("ulimit -v {} && exec \"$0\" \"$@\"", megabytes * 1024);
            words.extend(["sh".into(), "-c".into(), limited]);
        }
        words.push(program.to_owned());
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        command.args(&self.arguments);
        if let Some(directory) = &self.directory {
            command.arg("--output").arg(directory);
            if !self.report {
                command.args(["--set", "output.report=false"]);
            }
        }
        if !self.petsc.is_empty() {
            command.arg("--").args(&self.petsc);
        }
        // As in scripts/environment.sh.
        command.envs([
            ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
            ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
            ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
            ("OMPI_MCA_btl_vader_single_copy_mechanism", "none"),
            ("OMPI_MCA_btl_openib_warn_no_device_params_found", "0"),
            ("OMPI_MCA_btl_base_warn_component_unused", "0"),
            ("OPENBLAS_NUM_THREADS", "1"),
            ("OMP_NUM_THREADS", "1"),
        ]);
        command
            .env_remove("PETSC_OPTIONS")
            .envs(self.environment.iter().map(|(name, value)| (name, value)))
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }
}

enum Pipe {
    Out(ChildStdout),
    Err(ChildStderr),
}

/// Empties a pipe beside the run, so that the program never waits for a reader.
fn reader(pipe: Option<Pipe>) -> JoinHandle<String> {
    let pipe = pipe.expect("the output of the program is piped");
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = match pipe {
            Pipe::Out(mut pipe) => pipe.read_to_end(&mut bytes),
            Pipe::Err(mut pipe) => pipe.read_to_end(&mut bytes),
        };
        read.expect("the pipe can be read");
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// A run that goes on.
pub struct Started {
    child: Child,
    out: JoinHandle<String>,
    err: JoinHandle<String>,
    begin: Instant,
    folder: Folder,
    directory: Option<PathBuf>,
    _cores: Cores,
}

impl Started {
    /// Process number of the program, or of the `mpirun` that started it.
    pub fn process(&self) -> Pid {
        Pid::from_raw(self.child.id() as i32).expect("a process has a positive number")
    }

    /// Process numbers of the ranks: the children of `mpirun` that run the program.
    pub fn ranks(&self) -> Vec<Pid> {
        children_of(self.child.id(), "mpm-petsc")
    }

    /// Sends a signal to the program, or to the `mpirun` that started it.
    pub fn signal(&self, signal: Signal) {
        let own = Pid::from_raw(self.child.id() as i32).expect("a process has a positive number");
        kill_process(own, signal).expect("the program runs");
    }

    /// Kills the program, its ranks and `mpirun`, all of a sudden.
    pub fn kill(&self) {
        let own = Pid::from_raw(self.child.id() as i32).expect("a process has a positive number");
        for process in self.ranks().into_iter().chain([own]) {
            let _ = kill_process(process, Signal::KILL);
        }
    }

    /// Whether the program has ended by itself.
    pub fn has_ended(&self) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).unwrap_or_default();
        stat.rsplit_once(')')
            .is_none_or(|(_, tail)| tail.trim_start().starts_with('Z'))
    }

    /// A file of the result folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.directory.as_ref().expect("a result folder was named").join(name)
    }

    /// Waits for the end.
    ///
    /// # Panics
    /// When the time limit is reached; the program is ended.
    pub fn wait(self) -> Run {
        self.wait_for(LIMIT)
    }

    /// Waits for the end, at most so long.
    ///
    /// # Panics
    /// When the time limit is reached; the program is ended.
    pub fn wait_for(mut self, limit: Duration) -> Run {
        let end = await_end(&mut self.child, limit);
        if end.is_none() {
            self.end();
        }
        let stdout = self.out.join().expect("the reader of standard output ends");
        let stderr = self.err.join().expect("the reader of standard error ends");
        let Some(status) = end else {
            panic!("the program still ran after {limit:?}\n{}", printed(&stdout, &stderr));
        };
        Run {
            status,
            stdout,
            stderr,
            seconds: self.begin.elapsed().as_secs_f64(),
            folder: self.folder,
            directory: self.directory,
        }
    }

    /// Ends the program and its ranks: `mpirun` ends its own when asked to; what is left is killed.
    fn end(&mut self) {
        let ranks = self.ranks();
        let own = Pid::from_raw(self.child.id() as i32).expect("a process has a positive number");
        let _ = kill_process(own, Signal::TERM);
        if await_end(&mut self.child, GRACE).is_none() {
            for rank in ranks {
                let _ = kill_process(rank, Signal::KILL);
            }
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

fn await_end(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("the program can be waited for") {
            return Some(status);
        }
        if start.elapsed() > limit {
            return None;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Child processes of a process that run a program of this name.
fn children_of(parent: u32, name: &str) -> Vec<Pid> {
    let entries = std::fs::read_dir("/proc").expect("/proc is there");
    let numbers = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<i32>().ok());
    let is_child = |number: &i32| {
        // "12 (mpm-petsc) S 11 ...": number, name, state, parent.
        let stat = std::fs::read_to_string(format!("/proc/{number}/stat")).unwrap_or_default();
        let Some((head, tail)) = stat.rsplit_once(')') else {
            return false;
        };
        let own_name = head.split_once('(').map_or("", |(_, name)| name);
        own_name == name && tail.split_whitespace().nth(1) == Some(&parent.to_string())
    };
    numbers.filter(is_child).filter_map(Pid::from_raw).collect()
}

/// A run that has ended.
#[derive(Debug)]
pub struct Run {
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
    /// Wall time.
    pub seconds: f64,
    folder: Folder,
    directory: Option<PathBuf>,
}

impl Run {
    /// Exit code; none after a signal.
    pub fn code(&self) -> Option<i32> {
        self.status.code()
    }

    /// The run itself, if it ended with this exit code.
    ///
    /// # Panics
    /// With everything that the program printed.
    pub fn expect_code(self, code: i32) -> Self {
        assert_eq!(
            self.code(),
            Some(code),
            "exit code\n{}",
            printed(&self.stdout, &self.stderr)
        );
        self
    }

    /// The run itself, if it reached the last stage.
    pub fn completed(self) -> Self {
        self.expect_code(0)
    }

    /// The folder in which the program was started.
    pub fn working_folder(&self) -> &Path {
        self.folder.path()
    }

    /// A file of the result folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.directory.as_ref().expect("a result folder was named").join(name)
    }

    /// Text of a file of the result folder.
    pub fn read(&self, name: &str) -> String {
        let path = self.file(name);
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    pub fn history(&self) -> Table {
        Table::read(&self.file("history.csv"))
    }

    pub fn convergence(&self) -> Convergence {
        Convergence::read(&self.file("convergence.csv"))
    }

    pub fn summary(&self) -> Summary {
        Summary::read(&self.file("summary.json"))
    }

    /// Lines of standard error that hold a text.
    pub fn complaints(&self, text: &str) -> Vec<&str> {
        self.stderr.lines().filter(|line| line.contains(text)).collect()
    }
}

fn printed(stdout: &str, stderr: &str) -> String {
    let tail = |text: &str| {
        let lines: Vec<&str> = text.lines().collect();
        lines[lines.len().saturating_sub(20)..].join("\n")
    };
    format!(
        "--- standard output\n{}\n--- standard error\n{}",
        tail(stdout),
        tail(stderr)
    )
}

/// Cores that runs share; tests run side by side, and time limits and time splits mean little on a crowded machine.
const CORES: usize = 2;

static FREE_CORES: Mutex<usize> = Mutex::new(CORES);
static FREED: Condvar = Condvar::new();

/// Cores that one run holds.
struct Cores(usize);

impl Cores {
    fn lock() -> MutexGuard<'static, usize> {
        FREE_CORES
            .lock()
            .expect("nobody fails while it holds the count of cores")
    }

    fn take(wanted: usize) -> Cores {
        let mut free = FREED
            .wait_while(Cores::lock(), |free| *free < wanted)
            .expect("nobody fails while it holds the count of cores");
        *free -= wanted;
        Cores(wanted)
    }
}

impl Drop for Cores {
    fn drop(&mut self) {
        *Cores::lock() += self.0;
        FREED.notify_all();
    }
}
