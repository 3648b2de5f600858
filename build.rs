//! Placeholder until the build script of the PETSc layer lands.
fn main() {
    println!("cargo::rustc-env=MPM_PETSC_COMMIT=unknown");
}
