//! How linear systems are solved: options of PETSc that hold unless the user set others.

use std::ffi::CStr;

use super::error::PetscError;
use super::session::Session;

/// The linear solver of Newton's iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LinearSolver {
    /// A factorisation of the matrix.
    Direct,
    /// A Krylov method with incomplete factors of the part that each rank owns.
    Iterative {
        /// Residual, as the preconditioner sees it, over that of the start, > 0 and < 1.
        tolerance: f64,
    },
}

/// GMRES keeps its directions for as many iterations as the systems that it suits take. Incomplete LU of the blocks of a
/// node without fill, one per rank. The norm is that of the preconditioned residual, PETSc's default: its entries
/// have the units of the unknowns, whose sizes differ less than those of forces, couples and damage.
const ITERATIVE: [(&CStr, &CStr); 5] = [
    (c"-ksp_type", c"gmres"),
    (c"-ksp_gmres_restart", c"150"),
    (c"-ksp_max_it", c"600"),
    (c"-pc_type", c"bjacobi"),
    (c"-sub_pc_type", c"ilu"),
];

impl Session {
    /// Chooses the linear solver of all systems from now on. Options of the user hold against it one by one; with a
    /// preconditioner of the user's (`-pc_type`) nothing is chosen here.
    pub fn choose_linear_solver(&self, solver: LinearSolver) -> Result<(), PetscError> {
        let LinearSolver::Iterative { tolerance } = solver else {
            return Ok(());
        };
        if self.has_option(c"-pc_type")? {
            return Ok(());
        }
        for (name, value) in ITERATIVE {
            self.prefer(name, &value.to_string_lossy())?;
        }
        self.prefer(c"-ksp_rtol", &format!("{tolerance:e}"))
    }

    /// Changes to the direct solver for what is set up from now on, where
    /// [`choose_linear_solver`](Self::choose_linear_solver) chose the iterative one. Returns whether it did so.
    pub fn fall_back_to_direct(&self) -> Result<bool, PetscError> {
        if !self.is_own_option(c"-pc_type") || self.option(c"-pc_type")?.as_deref() == Some("lu") {
            return Ok(false);
        }
        self.set_option(c"-pc_type", "lu")?;
        if self.is_own_option(c"-ksp_type") {
            self.set_option(c"-ksp_type", "preonly")?;
        }
        Ok(true)
    }
}
