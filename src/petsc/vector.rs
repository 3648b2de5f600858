//! Who owns which unknowns, and vectors with copies of a neighbour's.

use std::ptr::{NonNull, null_mut};
use std::rc::Rc;

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check, report_in_drop};
use super::session::Session;

/// Numbering of the unknowns: `block` scalars a node, nodes numbered without gaps by rank.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Scalars per node.
    pub block: usize,
    /// Number of nodes that this rank owns; may be zero.
    pub owned: usize,
    /// Global number of the first of them.
    pub first: usize,
    /// Global numbers of the nodes of other ranks that this rank reads or adds to, each once.
    pub ghosts: Vec<PetscInt>,
}

impl Layout {
    /// Scalars that this rank owns.
    pub fn owned_length(&self) -> usize {
        self.block * self.owned
    }

    /// Scalars that this rank sees: its own, then those of the ghosts.
    pub fn local_length(&self) -> usize {
        self.block * (self.owned + self.ghosts.len())
    }
}

/// A length or number as PETSc counts.
pub(super) fn index(value: usize) -> Result<PetscInt, PetscError> {
    PetscInt::try_from(value).map_err(|_| {
        PetscError::refused(
            sys::PETSC_ERR_ARG_OUTOFRANGE,
            format!("{value} does not fit the {}-bit integers of this PETSc", PetscInt::BITS),
        )
    })
}

/// The owned and ghost values of a distributed vector, and the two exchanges between them.
pub struct GhostVector {
    handle: sys::Vec,
    /// The storage that PETSc works in: owned values, then ghosts in the order of the layout. Freed after the handle.
    values: NonNull<f64>,
    owned: usize,
    length: usize,
    _session: Rc<Session>,
}

impl GhostVector {
    /// A vector of zeros.
    ///
    /// # Errors
    /// What PETSc reports, as for a ghost that no rank owns.
    pub fn new(session: &Rc<Session>, layout: &Layout) -> Result<Self, PetscError> {
        let (owned, length) = (layout.owned_length(), layout.local_length());
        let values = NonNull::from(Box::leak(vec![0.0; length].into_boxed_slice())).cast::<f64>();
        let mut vector = GhostVector {
            handle: null_mut(),
            values,
            owned,
            length,
            _session: session.clone(),
        };
        // SAFETY: the storage has room for owned and ghost values and outlives the handle (see Drop); PETSc copies the
        // list of ghosts. PETSC_DETERMINE (-1) lets it sum the global length.
        check(unsafe {
            sys::VecCreateGhostBlockWithArray(
                session.communicator(),
                index(layout.block)?,
                index(owned)?,
                -1,
                index(layout.ghosts.len())?,
                layout.ghosts.as_ptr(),
                values.as_ptr(),
                &mut vector.handle,
            )
        })?;
        Ok(vector)
    }

    /// Owned values, then ghosts. Not collective.
    pub fn local(&self) -> &[f64] {
        // SAFETY: the storage holds `length` initialised numbers, and PETSc touches it only inside the exchanges below,
        // which borrow the vector mutably.
        unsafe { std::slice::from_raw_parts(self.values.as_ptr(), self.length) }
    }

    /// Owned values, then ghosts. Not collective.
    pub fn local_mut(&mut self) -> &mut [f64] {
        // SAFETY: as in `local`, and the borrow is exclusive.
        unsafe { std::slice::from_raw_parts_mut(self.values.as_ptr(), self.length) }
    }

    /// Owned values. Not collective.
    pub fn owned(&self) -> &[f64] {
        &self.local()[..self.owned]
    }

    /// Owned values. Not collective.
    pub fn owned_mut(&mut self) -> &mut [f64] {
        let owned = self.owned;
        &mut self.local_mut()[..owned]
    }

    /// Copies the owners' values into the ghosts.
    pub fn update_ghosts(&mut self) -> Result<(), PetscError> {
        self.exchange(sys::INSERT_VALUES, sys::SCATTER_FORWARD)
    }

    /// Adds the values in the ghosts to those of their owners, in the order of ranks; the ghosts keep theirs.
    pub fn add_to_owners(&mut self) -> Result<(), PetscError> {
        self.exchange(sys::ADD_VALUES, sys::SCATTER_REVERSE)
    }

    fn exchange(&mut self, insert: sys::InsertMode, direction: sys::ScatterMode) -> Result<(), PetscError> {
        // SAFETY: the handle is valid and made with ghosts; the exclusive borrow lets PETSc write the storage.
        unsafe {
            check(sys::VecGhostUpdateBegin(self.handle, insert, direction))?;
            check(sys::VecGhostUpdateEnd(self.handle, insert, direction))
        }
    }
}

impl Drop for GhostVector {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // Destruction is collective, and the storage must outlive the handle: leave both.
            return;
        }
        // SAFETY: the handle is valid or null, and not used again. The storage came from a boxed slice of this length,
        // and with the handle gone PETSc no longer knows it.
        unsafe {
            report_in_drop("VecDestroy", sys::VecDestroy(&mut self.handle));
            drop(Box::from_raw(std::ptr::slice_from_raw_parts_mut(
                self.values.as_ptr(),
                self.length,
            )));
        }
    }
}

/// A distributed vector without ghosts, as solvers work with.
pub(super) struct Vector {
    pub(super) handle: sys::Vec,
    _session: Rc<Session>,
}

impl Vector {
    /// A vector of zeros with the owned part of `layout`.
    pub(super) fn new(session: &Rc<Session>, layout: &Layout) -> Result<Self, PetscError> {
        let mut vector = Vector {
            handle: null_mut(),
            _session: session.clone(),
        };
        // SAFETY: the out-pointer is valid; PETSC_DETERMINE (-1) lets PETSc sum the global length; the handle is used
        // only after it was made.
        unsafe {
            check(sys::VecCreateMPI(
                session.communicator(),
                index(layout.owned_length())?,
                -1,
                &mut vector.handle,
            ))?;
            check(sys::VecSetBlockSize(vector.handle, index(layout.block)?))?;
        }
        Ok(vector)
    }

    /// Copies the owned values in.
    pub(super) fn set(&mut self, values: &[f64]) -> Result<(), PetscError> {
        // SAFETY: the handle is valid and nobody else has its array.
        unsafe { with_values_mut(self.handle, values.len(), |own| own.copy_from_slice(values)) }
    }

    /// Copies the owned values out.
    pub(super) fn copy_to(&self, values: &mut [f64]) -> Result<(), PetscError> {
        // SAFETY: the handle is valid and nobody writes its array.
        unsafe { with_values(self.handle, values.len(), |own| values.copy_from_slice(own)) }
    }

    /// Euclidean norm over all ranks; NaN or infinite if a value is.
    pub(super) fn norm(&self) -> Result<f64, PetscError> {
        // SAFETY: the handle is valid.
        unsafe { norm(self.handle) }
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // SAFETY: the handle is valid or null, and not used again.
            report_in_drop("VecDestroy", unsafe { sys::VecDestroy(&mut self.handle) });
        }
    }
}

/// Euclidean norm over all ranks.
///
/// # Safety
/// `handle` is a valid vector.
pub(super) unsafe fn norm(handle: sys::Vec) -> Result<f64, PetscError> {
    let mut norm = 0.0;
    // SAFETY: by contract, and the out-pointer is valid.
    check(unsafe { sys::VecNorm(handle, sys::NORM_2, &mut norm) })?;
    Ok(norm)
}

/// Runs `read` on the owned values.
///
/// # Safety
/// `handle` is a valid vector with `length` owned values, which nobody writes meanwhile.
pub(super) unsafe fn with_values<T>(
    handle: sys::Vec,
    length: usize,
    read: impl FnOnce(&[f64]) -> T,
) -> Result<T, PetscError> {
    let mut values = std::ptr::null();
    // SAFETY: by contract; the array is given back before anything else touches the vector. PETSc may hand out null for
    // an empty one.
    unsafe {
        check(sys::VecGetArrayRead(handle, &mut values))?;
        let result = read(if length == 0 {
            &[]
        } else {
            std::slice::from_raw_parts(values, length)
        });
        check(sys::VecRestoreArrayRead(handle, &mut values))?;
        Ok(result)
    }
}

/// Runs `write` on the owned values.
///
/// # Safety
/// `handle` is a valid vector with `length` owned values, which nobody else uses meanwhile.
pub(super) unsafe fn with_values_mut<T>(
    handle: sys::Vec,
    length: usize,
    write: impl FnOnce(&mut [f64]) -> T,
) -> Result<T, PetscError> {
    let mut values = null_mut();
    // SAFETY: as in `with_values`, with exclusive use by contract.
    unsafe {
        check(sys::VecGetArray(handle, &mut values))?;
        let result = write(if length == 0 {
            &mut []
        } else {
            std::slice::from_raw_parts_mut(values, length)
        });
        check(sys::VecRestoreArray(handle, &mut values))?;
        Ok(result)
    }
}
