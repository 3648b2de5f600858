//! The PETSc layer under MPI.
//!
//! MPI starts once per process, so this program runs itself: without `--case` it is the driver, which launches every
//! case under `mpirun` with a time limit and compares what the cases print; with `--case NAME` it is one rank of a
//! case.

mod cases;
mod driver;
mod problem;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [flag, name, options @ ..] if flag == "--case" => cases::run(name, options),
        [flag] if flag == "--list" => ExitCode::SUCCESS,
        _ => driver::run(),
    }
}
