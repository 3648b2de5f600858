//! Which entries a matrix on one rank has.

use std::ptr::null;

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check};

/// Which entries count.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Pattern {
    /// Those that are stored.
    Stored,
    /// Those of A + Aᵀ.
    Symmetric,
}

/// Hands the pattern of a matrix to a function: where each row starts in the list of columns, and that list.
///
/// # Safety
/// `matrix` is valid and assembled, on one rank.
pub(super) unsafe fn with_rows<T>(
    matrix: sys::Mat,
    pattern: Pattern,
    read: impl FnOnce(&[PetscInt], &[PetscInt]) -> Result<T, PetscError>,
) -> Result<T, PetscError> {
    let (mut rows, mut starts, mut columns, mut done) = (0, null(), null(), sys::PETSC_FALSE);
    // Row by row: PETSc's own compression joins equal rows, which need not be nodes.
    let (symmetric, compressed) = (sys::PetscBool::from(pattern == Pattern::Symmetric), sys::PETSC_FALSE);
    // SAFETY: the handle and the out-pointers are valid; the lists are read only before they are given back, whose
    // call also clears the count.
    unsafe {
        check(sys::MatGetRowIJ(
            matrix,
            0,
            symmetric,
            compressed,
            &mut rows,
            &mut starts,
            &mut columns,
            &mut done,
        ))?;
        if done != sys::PETSC_TRUE {
            return Err(PetscError::refused(
                sys::PETSC_ERR_SUP,
                "this matrix type gives no access to its pattern",
            ));
        }
        let row_starts = std::slice::from_raw_parts(starts, rows as usize + 1);
        let row_columns = match row_starts[rows as usize] as usize {
            0 => &[],
            length => std::slice::from_raw_parts(columns, length),
        };
        let answer = read(row_starts, row_columns);
        check(sys::MatRestoreRowIJ(
            matrix,
            0,
            symmetric,
            compressed,
            &mut rows,
            &mut starts,
            &mut columns,
            &mut done,
        ))?;
        answer
    }
}
