//! Raw bindings to the installed PETSc.
