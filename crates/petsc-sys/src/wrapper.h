/* What bindgen reads. The build script decides which names of it become Rust. */
#include <petscsnes.h>
#include <metis.h>

#if defined(PETSC_USE_COMPLEX) || !defined(PETSC_USE_REAL_DOUBLE)
  #error "PETSc must be built with real double-precision scalars (Debian: libpetsc-real-dev)"
#endif

#if defined(PETSC_HAVE_MUMPS)
  #define PETSC_SYS_HAVE_MUMPS 1
#else
  #define PETSC_SYS_HAVE_MUMPS 0
#endif

/* The library is the one reader of matrix-partitioning internals; see metis_partitioning.c. */
PetscErrorCode PetscSysRegisterMetisPartitioning(void);
