//! One nonlinear solve as PETSc calls back: the state of the solve and the functions that PETSc knows.

use std::any::Any;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check};
use super::matrix::BlockMatrix;
use super::nonlinear::{Evaluate, Iteration, Nonlinear, SolveError, Verdict, agree};
use super::scalar_copy::ScalarCopy;
use super::vector::{GhostVector, norm, with_values, with_values_mut};
use crate::parallel::World;

/// What the callbacks of one solve share; PETSc carries a pointer to it.
pub(super) struct Evaluation<'a> {
    pub(super) problem: &'a mut dyn Nonlinear,
    pub(super) world: &'a World,
    pub(super) matrix: &'a mut BlockMatrix,
    /// What the preconditioner is made from, where it is not the matrix itself.
    pub(super) copy: Option<&'a mut ScalarCopy>,
    /// Unknowns at the point evaluated last.
    pub(super) unknowns: &'a mut GhostVector,
    pub(super) residual: &'a mut GhostVector,
    /// The last iterate shown to the convergence test, and its difference from the one before.
    pub(super) previous: Vec<f64>,
    pub(super) update: Vec<f64>,
    /// The verdict of the last test.
    pub(super) verdict: Verdict,
    /// True if the last evaluation was out of the domain.
    pub(super) out_of_domain: bool,
    /// True if the last evaluation was a residual.
    pub(super) residual_was_last: bool,
    /// What ended the solve from inside a callback.
    pub(super) stop: Option<Stop>,
}

/// Why a callback told PETSc to end.
pub(super) enum Stop {
    Failed(SolveError),
    Panic(Box<dyn Any + Send>),
}

impl From<PetscError> for Stop {
    fn from(error: PetscError) -> Self {
        Stop::Failed(error.into())
    }
}

/// Whether the function exists at the point; the same on every rank.
#[derive(PartialEq)]
enum Domain {
    Inside,
    Outside,
}

impl Evaluation<'_> {
    /// The worst answer of any rank, on every rank. PETSc requires a domain error to be set on all ranks at once, since
    /// some line searches leave at once where it is set and wait in a norm where it is not.
    fn agree(&mut self, answer: Result<(), Evaluate>) -> Result<Domain, Stop> {
        match agree(self.world, answer) {
            Ok(()) => Ok(Domain::Inside),
            Err(Evaluate::OutOfDomain) => Ok(Domain::Outside),
            Err(Evaluate::Failed(error)) => Err(Stop::Failed(error)),
        }
    }

    /// Takes over the unknowns of `x` with their ghosts.
    ///
    /// # Safety
    /// `x` is a valid vector of the layout of this solve.
    unsafe fn load(&mut self, x: sys::Vec) -> Result<(), Stop> {
        let owned = self.unknowns.owned_mut();
        // SAFETY: by contract; PETSc lends the vector for reading.
        unsafe { with_values(x, owned.len(), |values| owned.copy_from_slice(values))? };
        Ok(self.unknowns.update_ghosts()?)
    }

    /// # Safety
    /// `x` and `f` are valid vectors of the layout of this solve.
    unsafe fn residual(&mut self, x: sys::Vec, f: sys::Vec) -> Result<Domain, Stop> {
        self.residual_was_last = true;
        // SAFETY: by contract.
        unsafe { self.load(x)? };
        self.residual.local_mut().fill(0.0);
        let answer = self.problem.residual(self.unknowns.local(), self.residual.local_mut());
        if self.agree(answer)? == Domain::Outside {
            return Ok(Domain::Outside);
        }
        self.residual.add_to_owners()?;
        let answer = self.problem.complete(self.residual.owned_mut());
        let domain = self.agree(answer)?;
        let owned = self.residual.owned();
        // SAFETY: by contract; `f` is there to be written.
        unsafe { with_values_mut(f, owned.len(), |values| values.copy_from_slice(owned))? };
        Ok(domain)
    }

    /// # Safety
    /// `x` is a valid vector of the layout of this solve, and the operator is a valid matrix.
    unsafe fn jacobian(&mut self, x: sys::Vec, operator: sys::Mat) -> Result<(), Stop> {
        self.residual_was_last = false;
        // SAFETY: by contract.
        unsafe { self.load(x)? };
        self.matrix.zero()?;
        let answer = self.problem.jacobian(self.unknowns.local(), self.matrix);
        if self.agree(answer)? == Domain::Outside {
            let message = "the derivative does not exist at a point where the residual does";
            return Err(Stop::Failed(SolveError::Evaluation(message.to_owned())));
        }
        self.matrix.assemble()?;
        if let Some(copy) = &mut self.copy {
            copy.refill(self.matrix)?;
        }
        if operator != self.matrix.handle {
            // SAFETY: by contract. A matrix-free operator takes over the new point when it is assembled.
            unsafe {
                check(sys::MatAssemblyBegin(operator, sys::MAT_FINAL_ASSEMBLY))?;
                check(sys::MatAssemblyEnd(operator, sys::MAT_FINAL_ASSEMBLY))?;
            }
        }
        Ok(())
    }

    /// # Safety
    /// `x` and `f` are valid vectors of the layout of this solve.
    unsafe fn test(&mut self, number: usize, norm: f64, x: sys::Vec, f: sys::Vec) -> Result<Verdict, Stop> {
        let length = self.previous.len();
        // SAFETY: by contract; nobody writes the vectors during a convergence test.
        unsafe {
            with_values(x, length, |x| {
                for ((update, previous), &x) in self.update.iter_mut().zip(&mut self.previous).zip(x) {
                    *update = x - *previous;
                    *previous = x;
                }
            })?;
            let update = (number > 0).then_some(&self.update[..]);
            self.verdict = with_values(f, length, |residual| {
                self.problem.test(&Iteration {
                    number,
                    residual,
                    update,
                    residual_norm: norm,
                })
            })?;
        }
        Ok(self.verdict)
    }
}

/// Runs a callback's body. A panic or an error is kept for after the solve, and PETSc is told to stop.
///
/// # Safety
/// `context` points to the [`Evaluation`] of the running solve, which nothing else uses until the callback returns.
unsafe fn guarded<T>(
    context: *mut c_void,
    body: impl FnOnce(&mut Evaluation<'_>) -> Result<T, Stop>,
) -> Result<T, sys::PetscErrorCode> {
    // SAFETY: by contract. What a panic leaves half-done is not used again: the solve ends.
    let evaluation = unsafe { &mut *context.cast::<Evaluation<'_>>() };
    let stop = match catch_unwind(AssertUnwindSafe(|| body(evaluation))) {
        Ok(Ok(value)) => return Ok(value),
        Ok(Err(stop)) => stop,
        Err(panic) => Stop::Panic(panic),
    };
    evaluation.stop = Some(stop);
    Err(sys::PETSC_ERR_USER as sys::PetscErrorCode)
}

/// PETSc's residual function.
///
/// # Safety
/// To be called by PETSc only, with the context of the running solve.
pub(super) unsafe extern "C" fn residual(
    snes: sys::SNES,
    x: sys::Vec,
    f: sys::Vec,
    context: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: PETSc passes the solver's own vectors and the context that was set for this solve.
    unsafe {
        let evaluated = guarded(context, |evaluation| {
            let domain = evaluation.residual(x, f)?;
            evaluation.out_of_domain = domain == Domain::Outside;
            Ok(domain)
        });
        match evaluated {
            Ok(Domain::Inside) => 0,
            Ok(Domain::Outside) => sys::SNESSetFunctionDomainError(snes),
            Err(code) => code,
        }
    }
}

/// PETSc's Jacobian function.
///
/// # Safety
/// To be called by PETSc only, with the context of the running solve.
pub(super) unsafe extern "C" fn jacobian(
    _snes: sys::SNES,
    x: sys::Vec,
    operator: sys::Mat,
    _preconditioner: sys::Mat,
    context: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: PETSc passes the solver's own objects and the context that was set for this solve.
    unsafe { guarded(context, |evaluation| evaluation.jacobian(x, operator)).map_or_else(|code| code, |()| 0) }
}

/// PETSc's convergence test.
///
/// # Safety
/// To be called by PETSc only, with the context of the running solve.
pub(super) unsafe extern "C" fn converged(
    snes: sys::SNES,
    number: PetscInt,
    _solution_norm: f64,
    _update_norm: f64,
    residual_norm: f64,
    reason: *mut sys::SNESConvergedReason,
    context: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: PETSc passes its own solver, a valid out-pointer and the context that was set for this solve.
    unsafe {
        let tested = guarded(context, |evaluation| {
            if !residual_norm.is_finite() {
                return Ok(sys::SNES_DIVERGED_FNORM_NAN);
            }
            let (mut x, mut f) = (std::ptr::null_mut(), std::ptr::null_mut());
            check(sys::SNESGetSolution(snes, &mut x))?;
            check(sys::SNESGetFunction(
                snes,
                &mut f,
                std::ptr::null_mut(),
                std::ptr::null_mut(),
            ))?;
            Ok(match evaluation.test(number as usize, residual_norm, x, f)? {
                Verdict::Continue => sys::SNES_CONVERGED_ITERATING,
                Verdict::Converged => sys::SNES_CONVERGED_FNORM_ABS,
                Verdict::Diverged | Verdict::Stagnates => sys::SNES_DIVERGED_DTOL,
            })
        });
        match tested {
            Ok(value) => {
                *reason = value;
                0
            }
            Err(code) => code,
        }
    }
}

/// Looks at the Newton direction before the line search: a linear solver can return NaN or infinity without saying so,
/// and the problem must not be evaluated there.
///
/// # Safety
/// To be called by PETSc only.
pub(super) unsafe extern "C" fn check_direction(
    line_search: sys::SNESLineSearch,
    _x: sys::Vec,
    direction: sys::Vec,
    changed: *mut sys::PetscBool,
    _context: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: PETSc passes its own line search and vectors and a valid out-pointer. No Rust code of the problem runs.
    let checked = || unsafe {
        *changed = sys::PETSC_FALSE;
        if norm(direction)?.is_finite() {
            return Ok(());
        }
        let mut snes = std::ptr::null_mut();
        check(sys::SNESLineSearchGetSNES(line_search, &mut snes))?;
        check(sys::SNESSetConvergedReason(snes, sys::SNES_DIVERGED_LINEAR_SOLVE))?;
        check(sys::VecZeroEntries(direction))?;
        *changed = sys::PETSC_TRUE;
        Ok(())
    };
    checked().map_or_else(|error: PetscError| error.code as sys::PetscErrorCode, |()| 0)
}
