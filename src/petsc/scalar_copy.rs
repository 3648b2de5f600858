//! A matrix of blocks on one rank once more, in scalar rows.

use std::ptr::null_mut;
use std::rc::Rc;

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check, report_in_drop};
use super::matrix::BlockMatrix;
use super::pattern::{self, Pattern};
use super::session::Session;
use super::vector::index;

/// The entries of a block matrix on one rank in scalar rows, refilled in place: PETSc hands an ordering to MUMPS only
/// with such a matrix, while assembly is several times faster in blocks.
pub(super) struct ScalarCopy {
    pub(super) handle: sys::Mat,
    filled: bool,
    _session: Rc<Session>,
}

impl ScalarCopy {
    /// A copy of `matrix` to be, without entries yet.
    pub(super) fn new(matrix: &BlockMatrix) -> Result<Self, PetscError> {
        let mut copy = ScalarCopy {
            handle: null_mut(),
            filled: false,
            _session: matrix.session.clone(),
        };
        let rows = index(matrix.block() * matrix.owned_rows())?;
        // SAFETY: the handle is valid from MatCreate on.
        unsafe {
            check(sys::MatCreate(matrix.session.communicator(), &mut copy.handle))?;
            check(sys::MatSetSizes(copy.handle, rows, rows, rows, rows))?;
            check(sys::MatSetType(copy.handle, c"seqaij".as_ptr()))?;
        }
        Ok(copy)
    }

    /// Takes the entries over. The pattern must be that of the first time.
    pub(super) fn refill(&mut self, matrix: &BlockMatrix) -> Result<(), PetscError> {
        if self.filled {
            // SAFETY: both are valid and assembled on one rank, and the copy was made from this matrix.
            return unsafe { copy_blocks(matrix.handle, self.handle, matrix.block()) };
        }
        // SAFETY: the source is valid and assembled. The conversion makes a matrix of its own, whose content then replaces
        // that of the copy, which solvers know by its address.
        unsafe {
            let mut converted = null_mut();
            check(sys::MatConvert(
                matrix.handle,
                c"seqaij".as_ptr(),
                sys::MAT_INITIAL_MATRIX,
                &mut converted,
            ))?;
            check(sys::MatHeaderReplace(self.handle, &mut converted))?;
        }
        self.filled = true;
        Ok(())
    }
}

impl Drop for ScalarCopy {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // SAFETY: the handle is valid or null, and not used again.
            report_in_drop("MatDestroy", unsafe { sys::MatDestroy(&mut self.handle) });
        }
    }
}

/// Copies the entries of a matrix of blocks into one of scalar rows with its pattern, ten times as fast as PETSc converts
/// again.
///
/// # Safety
/// Both are valid and assembled, of types `seqbaij` and `seqaij`, and the second was converted from the first.
unsafe fn copy_blocks(blocks: sys::Mat, rows: sys::Mat, block: usize) -> Result<(), PetscError> {
    // SAFETY: by contract; the out-pointers are valid, the lengths are those of the pattern, and all is given back.
    unsafe {
        pattern::with_rows(rows, Pattern::Stored, |row_starts, columns| {
            let (mut from, mut into) = (null_mut(), null_mut());
            check(sys::MatSeqBAIJGetArray(blocks, &mut from))?;
            check(sys::MatSeqAIJGetArray(rows, &mut into))?;
            if !columns.is_empty() {
                let read = std::slice::from_raw_parts(from, columns.len());
                let written = std::slice::from_raw_parts_mut(into, columns.len());
                blocks_to_rows(row_starts, block, read, written);
            }
            check(sys::MatSeqAIJRestoreArray(rows, &mut into))?;
            check(sys::MatSeqBAIJRestoreArray(blocks, &mut from))
        })
    }
}

/// Entries of blocks, each stored by columns, in the order of scalar rows.
fn blocks_to_rows(row_starts: &[PetscInt], block: usize, from: &[f64], into: &mut [f64]) {
    for first_row in (0..row_starts.len() - 1).step_by(block) {
        let (begin, end) = (row_starts[first_row] as usize, row_starts[first_row + block] as usize);
        let width = (end - begin) / block;
        for (index, values) in from[begin..end].chunks_exact(block * block).enumerate() {
            for (i, j) in (0..block).flat_map(|i| (0..block).map(move |j| (i, j))) {
                into[begin + i * width + index * block + j] = values[j * block + i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_blocks_become_rows() {
        // Two block rows of 2 x 2 blocks, with two blocks and with one.
        let from = [1.0, 3.0, 2.0, 4.0, 5.0, 7.0, 6.0, 8.0, 9.0, 11.0, 10.0, 12.0];
        let mut into = [0.0; 12];
        blocks_to_rows(&[0, 4, 8, 10, 12], 2, &from, &mut into);
        assert_eq!(into, [1.0, 2.0, 5.0, 6.0, 3.0, 4.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]);
    }
}
