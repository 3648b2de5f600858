//! What the binary says about itself (commit, library versions), where it finds PETSc at run time, and a check that
//! PETSc, rsmpi and HDF5 use one MPI.

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let petsc = Petsc::from_metadata();
    run_time_path(&petsc.directories);
    let hdf5 = probe("hdf5");
    for problem in check_one_mpi(&petsc, hdf5.as_ref()) {
        println!("cargo:warning={problem}");
    }
    let hdf5_version = hdf5.map_or_else(|| "unknown".to_string(), |library| library.version);
    println!("cargo:rustc-env=MPM_PETSC_COMMIT={}", commit());
    println!("cargo:rustc-env=MPM_PETSC_PETSC_VERSION={}", petsc.version);
    println!("cargo:rustc-env=MPM_PETSC_MPI_VERSION={}", petsc.mpi_version);
    println!("cargo:rustc-env=MPM_PETSC_HDF5_VERSION={hdf5_version}");
    println!("cargo:rustc-env=MPM_PETSC_INDEX_BITS={}", petsc.index_bits);
}

/// What petsc-sys found.
struct Petsc {
    includes: Vec<PathBuf>,
    directories: Vec<PathBuf>,
    version: String,
    mpi_version: String,
    index_bits: String,
}

impl Petsc {
    fn from_metadata() -> Self {
        let value = |key: &str| std::env::var(format!("DEP_PETSC_{key}")).unwrap_or_else(|_| "unknown".to_string());
        let paths = |key: &str| std::env::split_paths(&value(key)).collect();
        Petsc {
            includes: paths("INCLUDE"),
            directories: paths("LIB"),
            version: value("VERSION"),
            mpi_version: value("MPI_VERSION"),
            index_bits: value("INDEX_BITS"),
        }
    }
}

/// Lets the loader find libraries outside the system's own directories, such as a PETSc in a home directory.
fn run_time_path(directories: &[PathBuf]) {
    for directory in directories
        .iter()
        .filter(|path| !path.starts_with("/usr/lib") && !path.starts_with("/lib"))
    {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", directory.display());
    }
}

fn probe(module: &str) -> Option<pkg_config::Library> {
    pkg_config::Config::new()
        .cargo_metadata(false)
        .print_system_libs(false)
        .probe(module)
        .ok()
}

/// Signs that the libraries were built with different MPIs; such a program links, and fails in strange ways.
fn check_one_mpi(petsc: &Petsc, hdf5: Option<&pkg_config::Library>) -> Vec<String> {
    let mut problems = Vec::new();
    let petsc_defines = defines(&petsc.includes, "petscconf.h");
    let header = defines(&petsc.includes, "mpi.h");
    for part in ["MAJOR", "MINOR", "RELEASE"] {
        let built = petsc_defines(&format!("PETSC_HAVE_OMPI_{part}_VERSION"));
        let found = header(&format!("OMPI_{part}_VERSION"));
        if built.is_some() && built != found {
            problems.push(format!(
                "PETSc was built with Open MPI whose {part} version is {}, but the compiler finds {}",
                built.unwrap_or_default(),
                found.unwrap_or_else(|| "another MPI".to_string())
            ));
        }
    }
    let mpi_directory = directory_with(&petsc.includes, "mpi.h");
    // rsmpi asks the compiler wrapper.
    let wrapper = std::env::var("MPICC").unwrap_or_else(|_| "mpicc".to_string());
    if let (Some(directory), Some(shown)) = (&mpi_directory, output(Command::new(&wrapper).arg("-show")))
        && !shown.contains(&directory.display().to_string())
    {
        problems.push(format!(
            "`{wrapper}` (used by rsmpi) does not use the MPI of PETSc in {}",
            directory.display()
        ));
    }
    if let Some(hdf5) = hdf5 {
        if defines(&hdf5.include_paths, "H5pubconf.h")("H5_HAVE_PARALLEL").is_none() {
            problems.push("HDF5 was built without MPI (Debian: libhdf5-openmpi-dev)".to_string());
        }
        let directory = directory_with(&hdf5.include_paths, "mpi.h");
        if directory.is_some() && directory != mpi_directory {
            problems.push("HDF5 and PETSc use different MPIs".to_string());
        }
    }
    problems
}

fn directory_with(directories: &[PathBuf], file: &str) -> Option<PathBuf> {
    directories
        .iter()
        .find(|directory| directory.join(file).is_file())
        .and_then(|path| path.canonicalize().ok())
}

/// Looks up the value of `#define NAME VALUE` in a header.
fn defines(directories: &[PathBuf], file: &str) -> impl Fn(&str) -> Option<String> {
    let text = directory_with(directories, file)
        .and_then(|directory| std::fs::read_to_string(directory.join(file)).ok())
        .unwrap_or_default();
    move |name| {
        text.lines().find_map(|line| {
            let mut words = line.split_whitespace();
            (words.next() == Some("#define") && words.next() == Some(name))
                .then(|| words.next().unwrap_or("").to_string())
        })
    }
}

/// The commit that is built, with `-modified` where files differ from it; `unknown` without git.
fn commit() -> String {
    let git = |arguments: &[&str]| output(Command::new("git").args(arguments));
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return "unknown".to_string();
    };
    if let Some(directory) = git(&["rev-parse", "--git-dir"]) {
        for file in ["HEAD", "logs/HEAD"].map(|file| Path::new(&directory).join(file)) {
            if file.is_file() {
                println!("cargo:rerun-if-changed={}", file.display());
            }
        }
    }
    // A change of the sources runs this script again only if cargo watches them.
    for path in ["src", "crates", "Cargo.toml"] {
        println!("cargo:rerun-if-changed={path}");
    }
    let modified = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|text| !text.is_empty());
    if modified { format!("{commit}-modified") } else { commit }
}

/// Standard output of a command that succeeded, without the last line end.
fn output(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim_end().to_string())
}
