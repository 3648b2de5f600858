//! Small systems on several ranks: every rank factorises all of the matrix by itself.
//!
//! MUMPS adds contributions of other ranks in the order in which their messages arrive, so that on several ranks its last
//! bits differ from run to run. A factorisation on one rank always takes the same sums; small ones take no longer there.

use std::ptr::{null, null_mut};

use petsc_sys as sys;

use super::error::{PetscError, check};

/// Makes a preconditioner of several ranks solve all of the system on every rank. Returns the preconditioner that does it,
/// which reads the options of the outer one and lives as long.
///
/// # Safety
/// `pc` is a valid preconditioner whose type is a factorisation, not set up yet.
pub(super) unsafe fn on_every_rank(pc: sys::PC) -> Result<sys::PC, PetscError> {
    let (mut ksp, mut inner) = (null_mut(), null_mut());
    // SAFETY: the handle is valid by contract, the out-pointers are valid, and the names end with a zero byte.
    unsafe {
        check(sys::PCSetType(pc, c"redundant".as_ptr()))?;
        check(sys::PCRedundantGetKSP(pc, &mut ksp))?;
        check(sys::KSPSetType(ksp, c"preonly".as_ptr()))?;
        check(sys::KSPGetPC(ksp, &mut inner))?;
        check(sys::PCSetType(inner, c"lu".as_ptr()))?;
        check(sys::PCFactorSetMatSolverType(inner, c"mumps".as_ptr()))?;
        check(sys::PCSetOptionsPrefix(inner, null()))?;
        check(sys::PCSetFromOptions(inner))?;
    }
    Ok(inner)
}
