//! Launches the cases and judges them.

use std::process::{Command, ExitCode, Stdio};

/// Seconds. No case takes more than a few; a hang must not stop the test suite.
const LIMIT: &str = "120";

/// How a case ended.
struct Finished {
    success: bool,
    timed_out: bool,
    stdout: String,
    stderr: String,
}

/// Runs one case on `ranks` processes.
fn launch(ranks: usize, case: &str, options: &str) -> Finished {
    run_limited(&["mpirun", "-n", &ranks.to_string()], case, options, "")
}

/// Runs one case without `mpirun`, with options from the environment.
fn launch_alone(case: &str, environment: &str) -> Finished {
    run_limited(&[], case, "", environment)
}

/// Runs a case under `timeout`, which asks `mpirun` to end all ranks. Open MPI may run in containers and with more
/// ranks than cores, and the BLAS has one thread a rank.
fn run_limited(launcher: &[&str], case: &str, options: &str, environment: &str) -> Finished {
    let program = std::env::current_exe().expect("this program has a path");
    let mut command = Command::new("timeout");
    command
        .args(["--kill-after=10", LIMIT])
        .args(launcher)
        .arg(program)
        .args(["--case", case]);
    command.args(options.split_whitespace()).stdin(Stdio::null()).envs([
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OPENBLAS_NUM_THREADS", "1"),
        ("PETSC_OPTIONS", environment),
    ]);
    let output = command.output().expect("`timeout` (coreutils) starts");
    Finished {
        success: output.status.success(),
        timed_out: matches!(output.status.code(), Some(124 | 137)),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Finished {
    /// What the case printed as `name: numbers`.
    fn numbers(&self, name: &str) -> Result<Vec<f64>, String> {
        let line = self
            .stdout
            .lines()
            .find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
        let line = line.ok_or_else(|| format!("the case printed no `{name}`: {}", self.report()))?;
        line.split_whitespace()
            .map(|word| word.parse().map_err(|_| format!("`{word}` is no number")))
            .collect()
    }

    fn report(&self) -> String {
        let end = if self.timed_out { "timed out" } else { "ended" };
        format!(
            "{end}\n--- standard output\n{}--- standard error\n{}",
            self.stdout, self.stderr
        )
    }

    fn must_succeed(self) -> Result<Self, String> {
        if self.success { Ok(self) } else { Err(self.report()) }
    }
}

type Check = (String, Box<dyn Fn() -> Result<(), String>>);

/// Every check of this suite.
fn checks() -> Vec<Check> {
    let mut checks: Vec<Check> = Vec::new();
    let mut add = |name: String, check: Box<dyn Fn() -> Result<(), String>>| checks.push((name, check));
    for ranks in 1..=3 {
        for case in [
            "world",
            "ghosts",
            "matrix",
            "partition",
            "repeat",
            "iterative",
            "failures",
            "answers",
            "log",
        ] {
            let options = if case == "iterative" { "-pc_type gamg" } else { "" };
            let run = move || launch(ranks, case, options).must_succeed().map(drop);
            add(format!("{case} on {ranks}"), Box::new(run));
        }
    }
    add(
        "world without mpirun".into(),
        Box::new(|| launch_alone("world", "").must_succeed().map(drop)),
    );
    for (options, tolerance) in [
        ("", 1e-12),
        ("-mat_type aij", 1e-12),
        ("-snes_linesearch_type l2", 1e-9),
    ] {
        let check = move || ranks_agree(options, tolerance);
        add(format!("poisson agrees on 1, 2 and 3 ranks {options}"), Box::new(check));
    }
    for ranks in 2..=3 {
        let run = move || launch(ranks, "empty rank", "").must_succeed().map(drop);
        add(format!("a rank without unknowns on {ranks}"), Box::new(run));
    }
    for line_search in ["bt", "l2", "cp", "basic"] {
        let run = move || {
            launch(2, "domain", &format!("-snes_linesearch_type {line_search}"))
                .must_succeed()
                .map(drop)
        };
        add(format!("domain error with {line_search} on 2"), Box::new(run));
    }
    add("METIS ordering gives PORD's solution".into(), Box::new(orderings_agree));
    for ranks in 1..=3 {
        add(
            format!("panic in a callback on {ranks}"),
            Box::new(move || panic_ends_the_run(ranks)),
        );
    }
    for ranks in 1..=2 {
        let options = "-options_file a/file/that/is/not/there";
        let run = move || launch(ranks, "refused", options).must_succeed().map(drop);
        add(format!("a missing options file on {ranks}"), Box::new(run));
        let run = move || broken_file_ends_the_run(ranks);
        add(format!("a broken options file on {ranks}"), Box::new(run));
    }
    let line = || unused_option(launch(1, "options", "-ksp_typo 3"));
    add("options on the command line".into(), Box::new(line));
    let environment = || unused_option(launch_alone("options", "-ksp_typo 3"));
    add("options in the environment".into(), Box::new(environment));
    checks
}

/// The same nonlinear problem, the same numbers.
fn ranks_agree(options: &str, tolerance: f64) -> Result<(), String> {
    let reference = launch(1, "poisson", options).must_succeed()?.numbers("solution")?;
    for ranks in [2, 3] {
        let other = launch(ranks, "poisson", options).must_succeed()?.numbers("solution")?;
        compare(&reference, &other, tolerance).map_err(|error| format!("{ranks} ranks: {error}"))?;
    }
    Ok(())
}

/// The ordering changes the work, not the answer; and it is the one that was asked for.
fn orderings_agree() -> Result<(), String> {
    let metis = launch(1, "poisson", "").must_succeed()?;
    let scalar = launch(1, "poisson", "-mat_type aij").must_succeed()?;
    let pord = launch(1, "poisson", "-mat_mumps_icntl_7 4").must_succeed()?;
    let metis_name = "METIS nested dissection";
    for (run, name) in [(&metis, metis_name), (&scalar, metis_name), (&pord, "PORD")] {
        if !run.stdout.contains(&format!("ordering: MUMPS lu, {name}")) {
            return Err(format!("expected {name}: {}", run.report()));
        }
    }
    compare(&metis.numbers("solution")?, &pord.numbers("solution")?, 1e-12)
}

/// PETSc reads the file on rank 0, and the other ranks must not wait for it: all know of it before PETSc does.
fn broken_file_ends_the_run(ranks: usize) -> Result<(), String> {
    let file = std::env::temp_dir().join(format!("petsc-options-{}-{ranks}", std::process::id()));
    std::fs::write(&file, "this is not an option\n").map_err(|error| error.to_string())?;
    let run = launch(ranks, "refused", &format!("-options_file {}", file.display()));
    std::fs::remove_file(&file).map_err(|error| error.to_string())?;
    let run = run.must_succeed()?;
    if run.stdout.matches(":1: `this` is no option for PETSc").count() == ranks {
        Ok(())
    } else {
        Err(run.report())
    }
}

/// A panic on the last rank ends all of them, with its message and without a trace of PETSc.
fn panic_ends_the_run(ranks: usize) -> Result<(), String> {
    let run = launch(ranks, "panic", "");
    let complaint = if run.timed_out {
        "it hangs"
    } else if run.success {
        "it ends as if nothing had happened"
    } else if !run.stderr.contains("the material law has a bug") {
        "the message is lost"
    } else if run.stderr.contains("PETSC ERROR") {
        "PETSc prints a trace"
    } else {
        return Ok(());
    };
    Err(format!("{complaint}: {}", run.report()))
}

/// The case itself finds the option that nobody asked for; PETSc must not print it as well.
fn unused_option(run: Finished) -> Result<(), String> {
    let run = run.must_succeed()?;
    let noise = run.stdout.contains("WARNING") || run.stderr.contains("WARNING");
    if noise {
        Err(format!("PETSc prints its own list: {}", run.report()))
    } else {
        Ok(())
    }
}

fn compare(left: &[f64], right: &[f64], tolerance: f64) -> Result<(), String> {
    if left.len() != right.len() || left.is_empty() {
        return Err(format!("{} and {} numbers", left.len(), right.len()));
    }
    let largest = left.iter().zip(right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    if largest <= tolerance {
        Ok(())
    } else {
        Err(format!("differ by {largest:e}, allowed {tolerance:e}"))
    }
}

/// Runs all checks, or those whose name contains an argument.
pub fn run() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let (mut passed, mut failed) = (0, 0);
    for (name, check) in checks() {
        if !wanted.is_empty() && !wanted.iter().any(|word| name.contains(word.as_str())) {
            continue;
        }
        match check() {
            Ok(()) => {
                passed += 1;
                println!("{name}: passed");
            }
            Err(error) => {
                failed += 1;
                println!("{name}: FAILED\n{error}");
            }
        }
    }
    println!("{passed} passed, {failed} failed");
    if failed == 0 && passed > 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
