//! Return codes of PETSc as values.

use crate::console;
use std::cell::RefCell;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::fmt;

use petsc_sys as sys;

/// In the place of an error number where options were refused before PETSc was asked.
const REFUSED: i64 = 0;

/// A failed call of PETSc.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PetscError {
    /// PETSc's error number (`PETSC_ERR_*`).
    pub code: i64,
    /// What PETSc said where the error arose, or the general meaning of the number.
    pub message: String,
}

impl fmt::Display for PetscError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_memory() {
            return write!(f, "there is not enough memory: {}", self.message);
        }
        if self.is_refusal() {
            return write!(f, "{}", self.message);
        }
        write!(f, "PETSc error {}: {}", self.code, self.message)
    }
}

impl std::error::Error for PetscError {}

impl From<PetscError> for crate::error::Error {
    fn from(error: PetscError) -> Self {
        if error.is_refusal() {
            return crate::error::Error::Command(error.to_string());
        }
        crate::error::Error::Library(error.to_string())
    }
}

impl PetscError {
    /// Whether PETSc got no memory.
    pub fn is_memory(&self) -> bool {
        self.code == i64::from(sys::PETSC_ERR_MEM)
    }

    /// Whether the options were refused before PETSc saw them, on all ranks alike.
    pub fn is_refusal(&self) -> bool {
        self.code == REFUSED
    }

    /// Options that PETSc must not see; to be found on all ranks alike.
    pub(super) fn options(message: impl Into<String>) -> Self {
        PetscError {
            code: REFUSED,
            message: message.into(),
        }
    }

    /// An error found by this wrapper before PETSc was asked.
    pub(super) fn refused(code: u32, message: impl Into<String>) -> Self {
        PetscError {
            code: i64::from(code),
            message: message.into(),
        }
    }
}

thread_local! {
    /// The first error since the last failure was reported: later ones only say through where it passed.
    static FIRST: RefCell<Option<PetscError>> = const { RefCell::new(None) };
}

/// Where PETSc allocates. Version 3.18 reports its failures with line and function in the place of number and message.
const ALLOCATION: &str = "PetscMallocAlign";

/// Error handler that keeps the first error and prints nothing.
///
/// # Safety
/// To be called by PETSc only: the texts are null or end with a zero byte.
pub(super) unsafe extern "C" fn remember(
    _communicator: sys::MPI_Comm,
    _line: c_int,
    function: *const c_char,
    _file: *const c_char,
    code: sys::PetscErrorCode,
    kind: sys::PetscErrorType,
    message: *const c_char,
    _context: *mut c_void,
) -> sys::PetscErrorCode {
    if kind == sys::PETSC_ERROR_INITIAL {
        // SAFETY: PETSc passes null or texts that end with a zero byte and live during this call.
        let (function, message) = unsafe { (text(function), text(message)) };
        let error = if function == ALLOCATION {
            PetscError::refused(
                sys::PETSC_ERR_MEM,
                format!("PETSc asked for some in {}", message.trim_end()),
            )
        } else {
            PetscError {
                code: i64::from(code),
                message: format!("{} ({function})", message.trim_end()),
            }
        };
        FIRST.with_borrow_mut(|first| {
            first.get_or_insert(error);
        });
    }
    code
}

/// The one place where a return code of PETSc becomes a result.
pub(super) fn check(code: sys::PetscErrorCode) -> Result<(), PetscError> {
    if code == 0 {
        return Ok(());
    }
    Err(FIRST.take().unwrap_or_else(|| PetscError {
        code: i64::from(code),
        message: meaning(code),
    }))
}

/// Forgets an error that was left by a failure which PETSc handled itself.
pub(super) fn forget_message() {
    FIRST.take();
}

/// PETSc's general description of an error number.
fn meaning(code: sys::PetscErrorCode) -> String {
    let mut message: *const c_char = std::ptr::null();
    // SAFETY: the out-pointer is valid; the text is static in PETSc, and null for an unknown number.
    unsafe {
        sys::PetscErrorMessage(code, &mut message, std::ptr::null_mut());
        if message.is_null() {
            "unknown error".to_string()
        } else {
            text(message)
        }
    }
}

/// Copy of a C text; empty for null.
///
/// # Safety
/// `pointer` is null or a text that ends with a zero byte.
pub(super) unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: not null, and by contract it ends with a zero byte.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// What a destructor does with a failed call: it cannot return it, and must not hide it.
pub(super) fn report_in_drop(what: &str, code: sys::PetscErrorCode) {
    if let Err(error) = check(code) {
        console::complain(format_args!("{what}: {error}"));
        debug_assert!(false, "{what}: {error}");
    }
}
