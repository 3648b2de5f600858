//! Why a linear system was not solved: what the Krylov method, the preconditioner and MUMPS say of it, in words.

use std::ptr::null_mut;

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check};
use super::ordering::factors_with_mumps;
use crate::parallel::World;

/// What a factorisation failed for. The later one counts where ranks say different things.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Failure {
    /// Something else, or no factorisation.
    Other,
    /// A pivot is zero.
    Singular,
    /// Memory or workspace.
    Memory,
}

impl Failure {
    /// Every kind, in order.
    const ALL: [Self; 3] = [Self::Other, Self::Singular, Self::Memory];

    /// As a number that ranks can compare.
    pub(super) fn number(self) -> u8 {
        self as u8
    }

    /// The kind of a number.
    pub(super) fn of_number(number: u8) -> Self {
        Self::ALL[usize::from(number)]
    }
}

/// MUMPS' own account of a factorisation: `INFOG`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Account {
    /// Negative where it failed.
    pub(super) code: PetscInt,
    /// Memory that it estimated for the factorisation, of the rank that takes the most and of all ranks [MB]; zero before
    /// there is an estimate.
    pub(super) largest: PetscInt,
    pub(super) total: PetscInt,
}

/// Codes of MUMPS for memory that could not be had (-5, -7, -13), for a limit that the user set and that is too low (-19),
/// and for workspace and buffers that are too small for what came up.
const SHORT_OF_MEMORY: [PetscInt; 11] = [-5, -7, -8, -9, -11, -13, -14, -15, -17, -19, -20];

/// Codes of MUMPS for a singular matrix.
const SINGULAR: [PetscInt; 2] = [-6, -10];

impl Account {
    /// What MUMPS says of the last factorisation of this preconditioner; `None` where it is none by MUMPS.
    ///
    /// # Safety
    /// `pc` is a valid preconditioner with its type set.
    pub(super) unsafe fn of(pc: sys::PC) -> Result<Option<Self>, PetscError> {
        let (mut factor, mut account) = (null_mut(), Account::default());
        // SAFETY: by contract; the out-pointers are valid, and the factor belongs to the preconditioner.
        unsafe {
            if !factors_with_mumps(pc)? || check(sys::PCFactorGetMatrix(pc, &mut factor)).is_err() {
                return Ok(None);
            }
            check(sys::MatMumpsGetInfog(factor, 1, &mut account.code))?;
            check(sys::MatMumpsGetInfog(factor, 16, &mut account.largest))?;
            check(sys::MatMumpsGetInfog(factor, 17, &mut account.total))?;
        }
        Ok(Some(account))
    }

    /// Collective. The account of all ranks: the worst code with its estimate. Where every rank factorises all of the matrix
    /// by itself (`redundant`), the estimates of the ranks add up.
    pub(super) fn common(self, world: &World, redundant: bool) -> Self {
        let total = match redundant {
            true => world.sum(self.total),
            false => world.max_of(self.total),
        };
        Account {
            code: world.min_of(self.code),
            largest: world.max_of(self.largest),
            total,
        }
    }

    /// What the factorisation failed for, by MUMPS' code.
    fn failure(self) -> Option<Failure> {
        if SHORT_OF_MEMORY.contains(&self.code) {
            Some(Failure::Memory)
        } else if SINGULAR.contains(&self.code) {
            Some(Failure::Singular)
        } else {
            None
        }
    }
}

/// What a factorisation failed for, by MUMPS' account of it or else by PETSc's reason.
pub(super) fn failure(account: Option<Account>, reason: sys::PCFailedReason) -> Failure {
    let by_code = account.and_then(Account::failure);
    by_code.unwrap_or(match reason {
        sys::PC_FACTOR_STRUCT_ZEROPIVOT | sys::PC_FACTOR_NUMERIC_ZEROPIVOT => Failure::Singular,
        sys::PC_FACTOR_OUTMEMORY => Failure::Memory,
        _ => Failure::Other,
    })
}

/// What to tell of factors that do not fit; `limited` where the user gave MUMPS a limit of its own.
pub(super) fn no_memory(account: Account, ranks: usize, limited: bool) -> String {
    let estimate = match (account.total, ranks) {
        (..=0, _) => String::new(),
        (total, 1) => format!(", for which MUMPS estimates {total} MB"),
        (total, _) => {
            let largest = account.largest;
            format!(", for which MUMPS estimates {total} MB in all and {largest} MB on the rank that takes most")
        }
    };
    let limit = match (limited, account.code) {
        (true, _) => "raise its limit, the option -mat_mumps_icntl_23 [MB], or take ",
        (false, -9 | -8) => "give it more than estimated (`-- -mat_mumps_icntl_14 100`, in per cent), or take ",
        _ => "take ",
    };
    format!(
        "there is not enough memory for the factors of the direct solver{estimate} (INFOG(1) = {}); {limit}\
         solver.method: iterative, fewer cells, or ranks on more machines",
        account.code
    )
}

/// How a singular matrix shows where the factorisation did not notice.
pub(super) const NOT_FINITE: &str = "the solution of a linear system is not finite";

/// PETSc's reason for the end of a linear solve, in words.
pub(super) fn linear_words(reason: sys::KSPConvergedReason) -> &'static str {
    match reason {
        1.. => "the linear system was solved",
        sys::KSP_DIVERGED_ITS => "the linear iterations reached their limit (-ksp_max_it)",
        sys::KSP_DIVERGED_BREAKDOWN | sys::KSP_DIVERGED_BREAKDOWN_BICG => "the linear iterations broke down",
        sys::KSP_DIVERGED_NANORINF => NOT_FINITE,
        sys::KSP_DIVERGED_PC_FAILED => "the linear solver could not be set up",
        sys::KSP_DIVERGED_INDEFINITE_PC | sys::KSP_DIVERGED_INDEFINITE_MAT | sys::KSP_DIVERGED_NONSYMMETRIC => {
            "the linear method does not suit the matrix"
        }
        _ => "the linear iterations do not converge",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_mumps_count_before_petsc_has_its_say() {
        let account = |code| {
            Some(Account {
                code,
                ..Account::default()
            })
        };
        for code in [-9, -13, -17, -19, -20] {
            assert_eq!(failure(account(code), sys::PC_FACTOR_OTHER), Failure::Memory, "{code}");
        }
        assert_eq!(failure(account(-10), sys::PC_FACTOR_OTHER), Failure::Singular);
        assert_eq!(failure(account(-3), sys::PC_SUBPC_ERROR), Failure::Other);
        assert_eq!(failure(None, sys::PC_FACTOR_OUTMEMORY), Failure::Memory);
        for kind in Failure::ALL {
            assert_eq!(Failure::of_number(kind.number()), kind);
        }
    }

    #[test]
    fn the_estimate_is_told_where_there_is_one() {
        let account = Account {
            code: -13,
            largest: 40,
            total: 70,
        };
        assert!(no_memory(account, 1, false).contains("estimates 70 MB (INFOG(1) = -13)"));
        assert!(no_memory(account, 2, false).contains("70 MB in all and 40 MB on the rank"));
        assert!(no_memory(account, 2, true).contains("-mat_mumps_icntl_23"));
        assert!(!no_memory(Account::default(), 2, false).contains("estimates"));
    }
}
