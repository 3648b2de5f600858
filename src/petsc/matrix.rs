//! The tangent: a sparse matrix of node blocks.

use std::ffi::CStr;
use std::ptr::{null, null_mut};
use std::rc::Rc;

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check, report_in_drop, text};
use super::remote::RemoteBlocks;
use super::session::Session;
use super::vector::{Layout, Vector, index};
use crate::parallel::World;

/// How the entries are stored. The interface is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixFormat {
    /// Dense node blocks (PETSc's BAIJ): fast to assemble, for direct solvers and simple preconditioners.
    Block,
    /// Single entries (PETSc's AIJ, which keeps the block size): what multigrid needs.
    Scalar,
}

impl MatrixFormat {
    fn petsc_name(self) -> &'static CStr {
        match self {
            MatrixFormat::Block => c"baij",
            MatrixFormat::Scalar => c"aij",
        }
    }
}

/// A square, distributed sparse matrix of `block` × `block` entries, preallocated exactly.
///
/// Entries are added, by any rank to any row, and count after [`assemble`](Self::assemble). The first assembly fixes
/// the pattern: a block that was not added by then cannot be added later.
pub struct BlockMatrix {
    pub(super) handle: sys::Mat,
    block: usize,
    owned: usize,
    remote: RemoteBlocks,
    pub(super) session: Rc<Session>,
}

impl BlockMatrix {
    /// Collective. An empty matrix with room for the given numbers of blocks in each owned block row: in the columns that this rank
    /// owns, and in those of the others. Both counts must include what other ranks will add.
    ///
    /// # Errors
    /// Lists that do not have one count per owned row, or what PETSc reports.
    pub fn new(
        session: &Rc<Session>,
        format: MatrixFormat,
        block: usize,
        owned_rows: usize,
        diagonal_blocks_per_row: &[PetscInt],
        off_diagonal_blocks_per_row: &[PetscInt],
    ) -> Result<Self, PetscError> {
        if diagonal_blocks_per_row.len() != owned_rows || off_diagonal_blocks_per_row.len() != owned_rows {
            return Err(PetscError::refused(
                sys::PETSC_ERR_ARG_SIZ,
                format!("a matrix of {owned_rows} owned block rows needs as many counts of blocks"),
            ));
        }
        let mut matrix = BlockMatrix {
            handle: null_mut(),
            block,
            owned: owned_rows,
            remote: RemoteBlocks::new(session.world(), index(owned_rows)?, block),
            session: session.clone(),
        };
        let (scalar_rows, block_size) = (index(block * owned_rows)?, index(block)?);
        // SAFETY: the handle is valid from MatCreate on; the lists have one entry per owned block row and are copied.
        unsafe {
            check(sys::MatCreate(session.communicator(), &mut matrix.handle))?;
            let handle = matrix.handle;
            check(sys::MatSetSizes(handle, scalar_rows, scalar_rows, -1, -1))?;
            check(sys::MatSetBlockSize(handle, block_size))?;
            check(sys::MatSetType(handle, format.petsc_name().as_ptr()))?;
            check(sys::MatSetFromOptions(handle))?;
            let (diagonal, off_diagonal) = (diagonal_blocks_per_row.as_ptr(), off_diagonal_blocks_per_row.as_ptr());
            check(sys::MatXAIJSetPreallocation(
                handle,
                block_size,
                diagonal,
                off_diagonal,
                null(),
                null(),
            ))?;
            check(sys::MatSetOption(
                handle,
                sys::MAT_NEW_NONZERO_ALLOCATION_ERR,
                sys::PETSC_TRUE,
            ))?;
            // They go by another way.
            check(sys::MatSetOption(handle, sys::MAT_NO_OFF_PROC_ENTRIES, sys::PETSC_TRUE))?;
        }
        Ok(matrix)
    }

    /// Tells algebraic multigrid which vectors (owned parts) the undamped operator nearly maps to zero: rigid motions.
    ///
    /// They are made orthonormal here; those that depend on the others are left out.
    ///
    /// # Panics
    /// If a mode has not one value per owned unknown.
    pub fn set_near_null_space(&mut self, modes: &[Vec<f64>]) -> Result<(), PetscError> {
        let layout = Layout {
            block: self.block,
            owned: self.owned,
            first: 0,
            ghosts: Vec::new(),
        };
        let mut vectors = Vec::new();
        for mode in orthonormal(self.session.world(), modes) {
            let mut vector = Vector::new(&self.session, &layout)?;
            vector.set(&mode)?;
            vectors.push(vector);
        }
        let handles: Vec<sys::Vec> = vectors.iter().map(|vector| vector.handle).collect();
        let (count, mut space) = (index(handles.len())?, null_mut());
        // SAFETY: the handles and the out-pointer are valid; space and matrix keep references of their own.
        unsafe {
            let communicator = self.session.communicator();
            check(sys::MatNullSpaceCreate(
                communicator,
                sys::PETSC_FALSE,
                count,
                handles.as_ptr(),
                &mut space,
            ))?;
            check(sys::MatSetNearNullSpace(self.handle, space))?;
            check(sys::MatNullSpaceDestroy(&mut space))
        }
    }

    /// PETSc's name of the storage in use.
    pub(super) fn storage(&self) -> Result<String, PetscError> {
        let mut name = null();
        // SAFETY: the handle and the out-pointer are valid; the name lives in the matrix.
        unsafe {
            check(sys::MatGetType(self.handle, &mut name))?;
            Ok(text(name))
        }
    }

    /// Scalars per node.
    pub fn block(&self) -> usize {
        self.block
    }

    /// Block rows that this rank owns.
    pub fn owned_rows(&self) -> usize {
        self.owned
    }

    /// Sets every entry to zero and keeps the pattern.
    pub fn zero(&mut self) -> Result<(), PetscError> {
        // SAFETY: the handle is valid.
        check(unsafe { sys::MatZeroEntries(self.handle) })
    }

    /// Adds a dense matrix to the blocks of these rows and columns (global node numbers).
    ///
    /// `values` is row-major, `rows.len() * block` rows of `columns.len() * block` entries. Rows and columns with a
    /// negative number are skipped. Not collective.
    ///
    /// # Errors
    /// An entry outside the preallocated pattern.
    ///
    /// # Panics
    /// If `values` has another length.
    pub fn add_blocks(&mut self, rows: &[PetscInt], columns: &[PetscInt], values: &[f64]) -> Result<(), PetscError> {
        assert_eq!(
            values.len(),
            rows.len() * columns.len() * self.block * self.block,
            "a dense matrix of all blocks"
        );
        if rows.iter().all(|&row| self.remote.is_local(row)) {
            return self.put_blocks(rows, columns, values);
        }
        let width = columns.len() * self.block;
        for (&row, values) in std::iter::zip(rows, values.chunks_exact(self.block * width)) {
            if self.remote.is_local(row) {
                self.put_blocks(&[row], columns, values)?;
                continue;
            }
            for (place, &column) in columns.iter().enumerate().filter(|&(_, &column)| column >= 0) {
                let start = place * self.block;
                let block = values
                    .chunks_exact(width)
                    .flat_map(|line| &line[start..start + self.block]);
                self.remote.add(row, column, block.copied());
            }
        }
        Ok(())
    }

    /// Adds to rows of this rank.
    fn put_blocks(&mut self, rows: &[PetscInt], columns: &[PetscInt], values: &[f64]) -> Result<(), PetscError> {
        // SAFETY: the handle is valid and the lengths match; numbers beyond the matrix are an error of PETSc.
        check(unsafe {
            sys::MatSetValuesBlocked(
                self.handle,
                index(rows.len())?,
                rows.as_ptr(),
                index(columns.len())?,
                columns.as_ptr(),
                values.as_ptr(),
                sys::ADD_VALUES,
            )
        })
    }

    /// Adds to one entry of the diagonal: unknown `component` of a node (global number). Not collective.
    ///
    /// # Errors
    /// A diagonal block outside the preallocated pattern.
    pub fn add_diagonal(&mut self, node: PetscInt, component: usize, value: f64) -> Result<(), PetscError> {
        assert!(
            component < self.block,
            "component {component} of a block of {}",
            self.block
        );
        if !self.remote.is_local(node) {
            let own = component * (self.block + 1);
            let entries = (0..self.block * self.block).map(|entry| if entry == own { value } else { 0.0 });
            self.remote.add(node, node, entries);
            return Ok(());
        }
        let row = node * index(self.block)? + index(component)?;
        // SAFETY: the handle is valid; one row, one column, one value.
        check(unsafe { sys::MatSetValues(self.handle, 1, &row, 1, &row, &value, sys::ADD_VALUES) })
    }

    /// Collective. Brings the entries to the ranks that own them, added in the order of ranks.
    pub fn assemble(&mut self) -> Result<(), PetscError> {
        for (keys, values) in self.remote.exchange(self.session.clone().world()) {
            let blocks = values.chunks_exact(self.block * self.block);
            for (key, block) in std::iter::zip(keys.chunks_exact(2), blocks) {
                self.put_blocks(&key[..1], &key[1..], block)?;
            }
        }
        // SAFETY: the handle is valid.
        unsafe {
            check(sys::MatAssemblyBegin(self.handle, sys::MAT_FINAL_ASSEMBLY))?;
            check(sys::MatAssemblyEnd(self.handle, sys::MAT_FINAL_ASSEMBLY))
        }
    }

    /// Number of stored entries over all ranks.
    pub fn nonzeros(&self) -> Result<u64, PetscError> {
        Ok(self.information()?.nz_used as u64)
    }

    /// Number of entries over all ranks that there is room for.
    pub(super) fn room(&self) -> Result<u64, PetscError> {
        Ok(self.information()?.nz_allocated as u64)
    }

    /// PETSc's counts over all ranks.
    fn information(&self) -> Result<sys::MatInfo, PetscError> {
        // SAFETY: the structure is plain numbers, for which zero is a value; handle and out-pointer are valid.
        unsafe {
            let mut information: sys::MatInfo = std::mem::zeroed();
            check(sys::MatGetInfo(self.handle, sys::MAT_GLOBAL_SUM, &mut information))?;
            Ok(information)
        }
    }

    /// Product with a vector, owned parts only.
    pub fn multiply(&self, x: &[f64]) -> Result<Vec<f64>, PetscError> {
        let layout = Layout {
            block: self.block,
            owned: self.owned,
            first: 0,
            ghosts: Vec::new(),
        };
        let mut input = Vector::new(&self.session, &layout)?;
        let output = Vector::new(&self.session, &layout)?;
        input.set(x)?;
        // SAFETY: the handles are valid, and the vectors have the layout of the matrix.
        check(unsafe { sys::MatMult(self.handle, input.handle, output.handle) })?;
        let mut product = vec![0.0; x.len()];
        output.copy_to(&mut product)?;
        Ok(product)
    }

    /// Frobenius norm.
    pub fn norm(&self) -> Result<f64, PetscError> {
        // SAFETY: the handle is valid.
        unsafe { frobenius(self.handle) }
    }

    /// Frobenius norm of K − Kᵀ over that of K; zero for a matrix of zeros.
    pub fn asymmetry(&self) -> Result<f64, PetscError> {
        let norm = self.norm()?;
        let mut difference = BlockMatrix {
            handle: null_mut(),
            remote: self.remote.clone(),
            session: self.session.clone(),
            ..*self
        };
        // SAFETY: the handles are valid; the transpose is a new matrix, destroyed with `difference`.
        let skew = unsafe {
            check(sys::MatTranspose(
                self.handle,
                sys::MAT_INITIAL_MATRIX,
                &mut difference.handle,
            ))?;
            check(sys::MatAXPY(
                difference.handle,
                -1.0,
                self.handle,
                sys::DIFFERENT_NONZERO_PATTERN,
            ))?;
            frobenius(difference.handle)?
        };
        Ok(if norm > 0.0 { skew / norm } else { 0.0 })
    }
}

/// Gram-Schmidt, twice for accuracy, on vectors that are spread over the ranks.
fn orthonormal(world: &World, modes: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| world.sum(a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>());
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mode in modes {
        let mut rest = mode.clone();
        let length = dot(mode, mode).sqrt();
        for other in basis.iter().chain(&basis) {
            let share = dot(&rest, other);
            rest.iter_mut()
                .zip(other)
                .for_each(|(value, other)| *value -= share * other);
        }
        let left = dot(&rest, &rest).sqrt();
        if left > 1e-8 * length {
            rest.iter_mut().for_each(|value| *value /= left);
            basis.push(rest);
        }
    }
    basis
}

/// # Safety
/// `handle` is a valid, assembled matrix.
unsafe fn frobenius(handle: sys::Mat) -> Result<f64, PetscError> {
    let mut norm = 0.0;
    // SAFETY: by contract, and the out-pointer is valid.
    check(unsafe { sys::MatNorm(handle, sys::NORM_FROBENIUS, &mut norm) })?;
    Ok(norm)
}

impl Drop for BlockMatrix {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // SAFETY: the handle is valid or null, and not used again.
            report_in_drop("MatDestroy", unsafe { sys::MatDestroy(&mut self.handle) });
        }
    }
}
