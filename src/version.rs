//! What this program was built from, and with what.

/// Version of the program.
pub const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// Commit that it was built from, or `unknown`.
pub const COMMIT: &str = env!("MPM_PETSC_COMMIT");

/// Version of the MPI library in use.
pub fn mpi() -> String {
    let text = mpi::environment::library_version().unwrap_or_default();
    text.split(',').next().unwrap_or_default().trim().to_owned()
}

/// Version of the HDF5 library in use.
pub fn hdf5() -> String {
    let (major, minor, release) = hdf5::library_version();
    format!("{major}.{minor}.{release}")
}
