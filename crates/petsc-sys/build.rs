//! Finds PETSc, MPI and METIS, binds the functions that mpm-petsc calls, and compiles the METIS partitioner.

use std::path::{Path, PathBuf};
use std::process::exit;

const DEBIAN: &str = "On Debian and Ubuntu: apt-get install build-essential pkgconf libclang-dev libopenmpi-dev \
                      openmpi-bin libpetsc-real-dev libmetis-dev libopenblas0-serial";

/// Every PETSc function in use, by family. A missing name is a compile error in `src/petsc`, not a silent extra.
const FUNCTIONS: &[&str] = &[
    "PetscInitialize|PetscFinalize|PetscInitialized|PetscGetVersionNumber|PetscMallocA",
    "PetscOptions(HasName|SetValue|ClearValue|LeftGet|LeftRestore|GetString)",
    "PetscPushErrorHandler|PetscErrorMessage|PetscObjectGetComm",
    "PetscLog(DefaultBegin|GetStageLog|StageRegister|StagePush|StagePop|EventGetId|EventGetPerfInfo)",
    "Vec(CreateMPI|CreateGhostBlockWithArray|GhostUpdateBegin|GhostUpdateEnd|Destroy|Norm|SetBlockSize|ZeroEntries)",
    "Vec(GetArray|RestoreArray|GetArrayRead|RestoreArrayRead)",
    "Mat(Create|SetSizes|SetBlockSize|SetType|GetType|SetFromOptions|SetOption|Destroy|XAIJSetPreallocation)",
    "Mat(ZeroEntries|SetValues|SetValuesBlocked|AssemblyBegin|AssemblyEnd|GetInfo|Mult|Norm|Transpose|AXPY|Convert)",
    "Mat(GetBlockSize|GetRowIJ|RestoreRowIJ|OrderingRegister|HeaderReplace|CreateMPIAdj|MumpsGetInfog)",
    "Mat(SetNearNullSpace|NullSpaceCreate|NullSpaceDestroy|CreateSeqDense|Shift|LUFactor)",
    "MatSeqBAIJ(GetArray|RestoreArray)|MatSeqAIJ(GetArray|RestoreArray)",
    "MatPartitioning(Create|SetAdjacency|SetVertexWeights|SetNParts|SetType|SetFromOptions|Apply|Destroy)",
    "IS(CreateGeneral|Destroy|GetIndices|RestoreIndices|SetPermutation)",
    "KSP(SetType|GetPC|SetOperators|Solve|GetConvergedReason|GetConvergedReasonString|GetIterationNumber)",
    "PC(SetType|GetType|FactorSetMatSolverType|FactorGetMatSolverType|FactorSetMatOrderingType)",
    "PCGetFailedReason|PCFactorGetMatrix|PCSetOptionsPrefix|PCSetFromOptions|PCRedundantGetKSP|KSPReset",
    "SNES(Create|Destroy|Reset|SetType|SetFunction|SetJacobian|SetConvergenceTest|SetTolerances|SetFromOptions)",
    "SNES(GetKSP|GetLineSearch|Solve|GetConvergedReason|GetConvergedReasonString|GetIterationNumber|GetFunction)",
    "SNES(GetFunctionNorm|GetLinearSolveIterations|SetFunctionDomainError|SetConvergedReason|GetSolution)",
    "SNESLineSearch(SetType|GetType|SetFromOptions|SetPreCheck|GetSNES)",
    "METIS_NodeND|METIS_SetDefaultOptions|PetscSysRegisterMetisPartitioning",
];

/// Constants and globals in use.
const VARIABLES: &[&str] =
    &["PETSC_COMM_WORLD|PETSC_VERSION_(MAJOR|MINOR)|PETSC_ERR_.*|PETSC_SYS_HAVE_MUMPS|METIS_NOPTIONS"];

struct Libraries {
    includes: Vec<PathBuf>,
    directories: Vec<PathBuf>,
    petsc: pkg_config::Library,
    petsc_module: &'static str,
    mpi_module: &'static str,
    mpi_version: String,
}

fn main() {
    for file in ["build.rs", "src/wrapper.h", "src/metis_partitioning.c"] {
        println!("cargo:rerun-if-changed={file}");
    }
    println!("cargo:rerun-if-env-changed=PKG_CONFIG_PATH");
    let libraries = find().unwrap_or_else(|reasons| give_up(&reasons));
    // A static library must come before the shared ones that it calls.
    if let Err(error) = compile_partitioner(&libraries) {
        give_up(&[format!(
            "compiling src/metis_partitioning.c (needs petsc/private/matimpl.h and metis.h):\n{error}"
        )]);
    }
    println!("cargo:rustc-link-lib=metis");
    for directory in &libraries.directories {
        println!("cargo:rustc-link-search=native={}", directory.display());
    }
    for library in &libraries.petsc.libs {
        println!("cargo:rustc-link-lib={library}");
    }
    if let Err(error) = bind(&libraries) {
        give_up(&[format!("reading the PETSc and METIS headers with libclang:\n{error}")]);
    }
    export(&libraries);
}

/// Asks pkg-config for PETSc and its MPI; every failed question is a reason.
fn find() -> Result<Libraries, Vec<String>> {
    let mut reasons = Vec::new();
    let petsc = probe(&["PETSc", "petsc"], Some("3.18"), &mut reasons);
    let mpi = probe(&["ompi-c", "mpi-c", "mpich"], None, &mut reasons);
    let (Some((petsc_module, petsc)), Some((mpi_module, mpi))) = (petsc, mpi) else {
        return Err(reasons);
    };
    let mut includes = petsc.include_paths.clone();
    includes.extend(mpi.include_paths.iter().cloned());
    let mut directories = petsc.link_paths.clone();
    directories.extend(mpi.link_paths.iter().cloned());
    Ok(Libraries {
        includes,
        directories,
        petsc,
        petsc_module,
        mpi_module,
        mpi_version: mpi.version,
    })
}

/// The first of `modules` that pkg-config knows, without printing link flags yet.
fn probe(
    modules: &[&'static str],
    version: Option<&str>,
    reasons: &mut Vec<String>,
) -> Option<(&'static str, pkg_config::Library)> {
    let before = reasons.len();
    for module in modules {
        let mut config = pkg_config::Config::new();
        config.cargo_metadata(false);
        if let Some(version) = version {
            config.atleast_version(version);
        }
        match config.probe(module) {
            Ok(library) => {
                reasons.truncate(before);
                return Some((module, library));
            }
            Err(error) => reasons.push(format!("pkg-config {module}:\n{error}")),
        }
    }
    None
}

fn give_up(reasons: &[String]) -> ! {
    eprintln!("petsc-sys could not prepare the bindings to PETSc (3.18 or newer, real double scalars).\n");
    for (i, reason) in reasons.iter().enumerate() {
        eprintln!("Reason #{}: {reason}\n", i + 1);
    }
    eprintln!("{DEBIAN}");
    exit(1)
}

fn compile_partitioner(libraries: &Libraries) -> Result<(), cc::Error> {
    cc::Build::new()
        .file("src/metis_partitioning.c")
        .includes(&libraries.includes)
        .flag_if_supported("-Wno-unused-parameter")
        .try_compile("petsc_sys_metis")
}

fn bind(libraries: &Libraries) -> Result<(), String> {
    let mut builder = bindgen::Builder::default()
        .header("src/wrapper.h")
        .clang_args(libraries.includes.iter().map(|path| format!("-I{}", path.display())))
        .blocklist_type("_IO_FILE|FILE")
        .raw_line("pub type FILE = std::ffi::c_void;")
        .default_enum_style(bindgen::EnumVariation::Consts)
        .prepend_enum_name(false)
        .layout_tests(false)
        .generate_comments(false)
        .merge_extern_blocks(true)
        .rust_edition(bindgen::RustEdition::Edition2024);
    for functions in FUNCTIONS {
        builder = builder.allowlist_function(functions);
    }
    for variables in VARIABLES {
        builder = builder.allowlist_var(variables);
    }
    let builder =
        builder.allowlist_type("rstatus_et|PetscErrorType|PCFailedReason|KSPConvergedReason|SNESConvergedReason");
    let bindings = builder.generate().map_err(|error| error.to_string())?;
    let directory = PathBuf::from(std::env::var_os("OUT_DIR").ok_or("cargo did not set OUT_DIR")?);
    bindings
        .write_to_file(directory.join("bindings.rs"))
        .map_err(|error| error.to_string())
}

/// Metadata for the root build script, as `DEP_PETSC_*`.
fn export(libraries: &Libraries) {
    let join = |paths: &[PathBuf]| {
        paths
            .iter()
            .map(|path| path.display().to_string())
            .collect::<Vec<_>>()
            .join(":")
    };
    println!("cargo:include={}", join(&libraries.includes));
    println!("cargo:lib={}", join(&libraries.directories));
    println!("cargo:version={}", libraries.petsc.version);
    println!("cargo:module={}", libraries.petsc_module);
    println!("cargo:mpi_module={}", libraries.mpi_module);
    println!("cargo:mpi_version={}", libraries.mpi_version);
    println!("cargo:index_bits={}", index_bits(&libraries.petsc.include_paths));
}

/// Width of `PetscInt`, from PETSc's configuration header.
fn index_bits(includes: &[PathBuf]) -> u32 {
    let wide = |directory: &Path| {
        let text = std::fs::read_to_string(directory.join("petscconf.h")).unwrap_or_default();
        text.lines()
            .any(|line| line.starts_with("#define PETSC_USE_64BIT_INDICES 1"))
    };
    if includes.iter().any(|path| wide(path)) { 64 } else { 32 }
}
