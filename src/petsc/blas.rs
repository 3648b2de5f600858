//! The work area of the linear algebra.
//!
//! OpenBLAS takes its work area in the first call that needs one, keeps it, and where the system refuses it asks again and
//! again, for ever and deaf to signals. Taken at the start, before anything large, it is there when MUMPS needs it.

use std::ptr::null_mut;

use petsc_sys as sys;
use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};

use super::error::{PetscError, check, report_in_drop};

/// What OpenBLAS asks for on the machines with the largest work area [byte], and some room for the call itself. Memory
/// that is not written to costs nothing but addresses.
const WORK_AREA: usize = (128 << 20) + (4 << 20);

/// Order of the matrix that is factorised: large enough that no kernel for small ones passes the work area by.
const ORDER: sys::PetscInt = 128;

/// Lets the linear algebra take its work area. Not collective; the communicator is that of this rank alone.
///
/// # Errors
/// The system does not give so much memory.
pub(super) fn take_work_area(own_rank: sys::MPI_Comm) -> Result<(), PetscError> {
    // SAFETY: a fresh mapping that nothing points into, given back at once.
    let there_is_room = unsafe {
        mmap_anonymous(
            null_mut(),
            WORK_AREA,
            ProtFlags::READ | ProtFlags::WRITE,
            MapFlags::PRIVATE,
        )
        .and_then(|room| munmap(room, WORK_AREA))
        .is_ok()
    };
    if !there_is_room {
        let megabytes = WORK_AREA >> 20;
        return Err(PetscError::refused(
            sys::PETSC_ERR_MEM,
            format!("the linear algebra asks for a work area of {megabytes} MB; raise the limit (`ulimit -v`)"),
        ));
    }
    factorise_unit_matrix(own_rank)
}

fn factorise_unit_matrix(own_rank: sys::MPI_Comm) -> Result<(), PetscError> {
    let mut matrix = null_mut();
    // SAFETY: PETSc runs; the handle is valid from the first call on, and its rows are on this rank alone. PETSc allows no
    // permutations and no parameters for dense matrices.
    unsafe {
        check(sys::MatCreateSeqDense(own_rank, ORDER, ORDER, null_mut(), &mut matrix))?;
        let factorised = check(sys::MatShift(matrix, 1.0))
            .and_then(|()| check(sys::MatLUFactor(matrix, null_mut(), null_mut(), null_mut())));
        report_in_drop("MatDestroy", sys::MatDestroy(&mut matrix));
        factorised
    }
}
