//! Newton's method with a line search: PETSc's SNES with its linear solver.

use std::ffi::{CStr, c_void};
use std::panic::resume_unwind;
use std::ptr::null_mut;
use std::rc::Rc;

use petsc_sys as sys;

use super::error::{PetscError, check, forget_message, report_in_drop, text};
use super::evaluation::{Evaluation, Stop, check_direction, converged, jacobian, residual};
use super::factors::{self, Account, Failure, NOT_FINITE, linear_words};
use super::matrix::BlockMatrix;
use super::nonlinear::{End, Nonlinear, Outcome, SolveError, Verdict};
use super::ordering;
use super::redundant;
use super::scalar_copy::ScalarCopy;
use super::session::Session;
use super::vector::{GhostVector, Layout, Vector, index};

/// Full Newton steps, PETSc's default here.
pub const FULL_STEPS: &CStr = c"basic";

/// Backtracking on the norm of the residual.
pub const BACKTRACKING: &CStr = c"bt";

/// What the caller decides; everything else is PETSc's options.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewtonOptions {
    /// Newton iterations before giving up (`-snes_max_it`).
    pub max_iterations: usize,
    /// Matrices of at most so many entries are factorised by every rank, which repeats to the last bit; larger ones by all
    /// ranks together.
    pub redundant_entries: u64,
    /// Whether the diagonal tells the scale of every unknown. Factorisations on one rank then scale by it instead of by
    /// norms of rows and columns that are found iteratively.
    pub scaled_by_diagonal: bool,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        NewtonOptions {
            max_iterations: 15,
            redundant_entries: 0,
            scaled_by_diagonal: false,
        }
    }
}

/// How a linear solve ended; the same on every rank.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinearOutcome {
    /// True if the solution is there and finite.
    pub converged: bool,
    /// Iterations of the Krylov method; one for a direct solver.
    pub iterations: usize,
    /// Why it ended, in words, with PETSc's name in brackets.
    pub reason: String,
    /// True if the matrix is singular.
    pub singular: bool,
}

/// A nonlinear solver with its matrix.
///
/// Defaults: Newton with full steps (`newtonls`, `basic`), every linear system by MUMPS' LU factorisation. Any option of
/// PETSc overrides them (`-snes_...`, `-ksp_...`, `-pc_...`, `-mat_...`), except convergence tests of SNES, which
/// [`Nonlinear::test`] replaces. While matrix and pattern stand, the analysis of the factorisation is reused.
pub struct Newton {
    snes: sys::SNES,
    ksp: sys::KSP,
    pc: sys::PC,
    /// The preconditioner that holds the factors: `pc`, or one inside it.
    factors: sys::PC,
    matrix: BlockMatrix,
    /// What the factorisation works on, where it is not the matrix itself.
    copy: Option<ScalarCopy>,
    // What PETSc works on, and the same with ghosts for the problem.
    solution: Vector,
    function: Vector,
    unknowns: GhostVector,
    residual: GhostVector,
    session: Rc<Session>,
}

impl Newton {
    /// A solver for the unknowns of `layout` with this matrix.
    pub fn new(
        session: &Rc<Session>,
        layout: &Layout,
        matrix: BlockMatrix,
        options: &NewtonOptions,
    ) -> Result<Self, PetscError> {
        let mut newton = Newton {
            snes: null_mut(),
            ksp: null_mut(),
            pc: null_mut(),
            factors: null_mut(),
            matrix,
            copy: None,
            solution: Vector::new(session, layout)?,
            function: Vector::new(session, layout)?,
            unknowns: GhostVector::new(session, layout)?,
            residual: GhostVector::new(session, layout)?,
            session: session.clone(),
        };
        // SAFETY: the out-pointers are valid; linear solver and preconditioner belong to the solver and live as long.
        unsafe {
            check(sys::SNESCreate(session.communicator(), &mut newton.snes))?;
            check(sys::SNESGetKSP(newton.snes, &mut newton.ksp))?;
            check(sys::KSPGetPC(newton.ksp, &mut newton.pc))?;
        }
        newton.set_nonlinear_defaults(options)?;
        newton.set_linear_defaults()?;
        // SAFETY: the handle is valid. This also reads the options of linear solver and preconditioner.
        check(unsafe { sys::SNESSetFromOptions(newton.snes) })?;
        newton.factors = newton.pc;
        let alone = session.world().size() == 1 || newton.factorise_on_every_rank(options)?;
        newton.choose_scaling(alone && options.scaled_by_diagonal)?;
        newton.copy = newton.scalar_copy()?;
        Ok(newton)
    }

    fn set_nonlinear_defaults(&mut self, options: &NewtonOptions) -> Result<(), PetscError> {
        let snes = self.snes;
        let mut line_search = null_mut();
        // SAFETY: the handles are valid, the names end with a zero byte, and the callback has PETSc's signature. Zero
        // tolerances and no limit of evaluations (-1) leave every decision to the problem's own test.
        unsafe {
            check(sys::SNESSetType(snes, c"newtonls".as_ptr()))?;
            check(sys::SNESSetTolerances(
                snes,
                0.0,
                0.0,
                0.0,
                index(options.max_iterations)?,
                -1,
            ))?;
            check(sys::SNESGetLineSearch(snes, &mut line_search))?;
            check(sys::SNESLineSearchSetType(line_search, FULL_STEPS.as_ptr()))?;
            check(sys::SNESLineSearchSetPreCheck(
                line_search,
                Some(check_direction),
                null_mut(),
            ))
        }
    }

    /// A direct solver by default; where the user chose another preconditioner, GMRES with it.
    fn set_linear_defaults(&mut self) -> Result<(), PetscError> {
        let preconditioner = self.session.option(c"-pc_type")?;
        let direct = matches!(preconditioner.as_deref(), None | Some("lu" | "cholesky"));
        let method = if direct { c"preonly" } else { c"gmres" };
        // SAFETY: the handles are valid and the names end with a zero byte.
        unsafe {
            check(sys::KSPSetType(self.ksp, method.as_ptr()))?;
            check(sys::PCSetType(self.pc, c"lu".as_ptr()))?;
            if sys::PETSC_SYS_HAVE_MUMPS != 0 {
                check(sys::PCFactorSetMatSolverType(self.pc, c"mumps".as_ptr()))?;
            }
            // MUMPS takes an ordering from outside on one rank only; other packages have their own preferences.
            let package = self.session.option(c"-pc_factor_mat_solver_type")?;
            let mumps_decides = self.session.has_option(c"-mat_mumps_icntl_7")?;
            let mumps = package.is_none_or(|package| package == "mumps");
            if self.session.world().size() == 1 && mumps && !mumps_decides {
                check(sys::PCFactorSetMatOrderingType(self.pc, ordering::NAME.as_ptr()))?;
            }
        }
        Ok(())
    }

    /// Lets every rank factorise a small matrix, unless the user chose a preconditioner. Returns whether it does.
    fn factorise_on_every_rank(&mut self, options: &NewtonOptions) -> Result<bool, PetscError> {
        let chosen = self.session.has_option(c"-pc_type")? && !self.session.is_own_option(c"-pc_type");
        let small = self.matrix.room()? <= options.redundant_entries;
        // SAFETY: the preconditioner is valid as long as `self`.
        if chosen || !small || !unsafe { ordering::factors_with_mumps(self.pc)? } {
            return Ok(false);
        }
        // SAFETY: as above; its type is a factorisation, and nothing was set up.
        self.factors = unsafe { redundant::on_every_rank(self.pc)? };
        Ok(true)
    }

    /// What MUMPS scales a matrix with before it factorises.
    /// The diagonal saves an eighth to a fifth of a factorisation against the iterative default.
    fn choose_scaling(&self, by_diagonal: bool) -> Result<(), PetscError> {
        const SCALING: &CStr = c"-mat_mumps_icntl_8";
        // SAFETY: the preconditioner is valid as long as `self`.
        if by_diagonal && unsafe { ordering::factors_with_mumps(self.factors)? } {
            return self.session.prefer(SCALING, "1");
        }
        self.session.withdraw(SCALING)
    }

    /// A scalar copy where MUMPS would otherwise not see the ordering: one rank, node blocks, an ordering by PETSc.
    fn scalar_copy(&self) -> Result<Option<ScalarCopy>, PetscError> {
        let ordering = self.session.option(c"-pc_factor_mat_ordering_type")?;
        let wanted = self.session.world().size() == 1
            && self.matrix.storage()? == "seqbaij"
            && ordering.map_or(!self.session.has_option(c"-mat_mumps_icntl_7")?, |name| name != "external")
            // SAFETY: the preconditioner is valid as long as `self`.
            && unsafe { ordering::factors_with_mumps(self.pc)? };
        wanted.then(|| ScalarCopy::new(&self.matrix)).transpose()
    }

    /// Name of the line search in use, as `-snes_linesearch_type` has it.
    pub fn line_search(&self) -> Result<String, PetscError> {
        let (mut line_search, mut name) = (null_mut(), std::ptr::null());
        // SAFETY: the handle and the out-pointers are valid; the name is a text of PETSc that lives in the line search.
        unsafe {
            check(sys::SNESGetLineSearch(self.snes, &mut line_search))?;
            check(sys::SNESLineSearchGetType(line_search, &mut name))?;
            Ok(text(name))
        }
    }

    /// Changes to another line search for the next solves: `Some` one by name, `None` back to that of the options.
    pub fn use_line_search(&mut self, name: Option<&CStr>) -> Result<(), PetscError> {
        let mut line_search = null_mut();
        // SAFETY: the handle and the out-pointer are valid; the names end with a zero byte.
        unsafe {
            check(sys::SNESGetLineSearch(self.snes, &mut line_search))?;
            check(sys::SNESLineSearchSetType(
                line_search,
                name.unwrap_or(FULL_STEPS).as_ptr(),
            ))?;
            if name.is_none() {
                check(sys::SNESLineSearchSetFromOptions(line_search))?;
            }
        }
        Ok(())
    }

    /// The matrix of the last iteration, or as filled by the caller.
    pub fn matrix(&self) -> &BlockMatrix {
        &self.matrix
    }

    /// The matrix, to be filled for [`linear_solve`](Self::linear_solve).
    pub fn matrix_mut(&mut self) -> &mut BlockMatrix {
        &mut self.matrix
    }

    /// Solves r(u) = 0 from the owned values in `u`, which become the solution if it converged and stay otherwise.
    ///
    /// # Errors
    /// What the caller cannot mend with a smaller step; then the solver must not be used again.
    ///
    /// # Panics
    /// With the panic of a callback, after PETSc was left.
    pub fn solve(&mut self, problem: &mut dyn Nonlinear, u: &mut [f64]) -> Result<Outcome, SolveError> {
        self.solution.set(u)?;
        let mut evaluation = Evaluation {
            problem,
            world: self.session.world(),
            matrix: &mut self.matrix,
            copy: self.copy.as_mut(),
            unknowns: &mut self.unknowns,
            residual: &mut self.residual,
            previous: u.to_vec(),
            update: vec![0.0; u.len()],
            verdict: Verdict::Continue,
            out_of_domain: false,
            residual_was_last: false,
            stop: None,
        };
        // SAFETY: the handle is valid, and the evaluation outlives the run.
        let code = unsafe { run(self.snes, self.function.handle, self.solution.handle, &mut evaluation) };
        let Evaluation {
            verdict,
            out_of_domain,
            residual_was_last,
            stop,
            ..
        } = evaluation;
        match stop {
            Some(Stop::Panic(panic)) => resume_unwind(panic),
            Some(Stop::Failed(error)) => {
                forget_message();
                return Err(error);
            }
            None => code?,
        }
        let reason = self.nonlinear_reason()?;
        let end = match (verdict, out_of_domain) {
            (Verdict::Converged, _) => End::Converged,
            (Verdict::Stagnates, _) => End::Stagnated,
            (_, true) => End::OutOfDomain,
            _ if reason == sys::SNES_DIVERGED_MAX_IT => End::IterationLimit,
            _ => End::NotConverged,
        };
        if end == End::Converged {
            self.solution.copy_to(u)?;
        }
        let same = self
            .unknowns
            .owned()
            .iter()
            .zip(&*u)
            .all(|(a, b)| a.to_bits() == b.to_bits());
        let evaluated_at_solution = self.session.world().all_ok(same && residual_was_last);
        self.outcome(end, reason, evaluated_at_solution)
    }

    /// PETSc's reason for the end of the last nonlinear solve.
    fn nonlinear_reason(&self) -> Result<sys::SNESConvergedReason, PetscError> {
        let mut reason = 0;
        // SAFETY: the handle and the out-pointer are valid.
        check(unsafe { sys::SNESGetConvergedReason(self.snes, &mut reason) })?;
        Ok(reason)
    }

    /// Reads the counters of the last solve.
    fn outcome(
        &mut self,
        end: End,
        code: sys::SNESConvergedReason,
        evaluated_at_solution: bool,
    ) -> Result<Outcome, SolveError> {
        let (mut iterations, mut linear_iterations, mut residual_norm) = (0, 0, 0.0);
        let mut name = std::ptr::null();
        // SAFETY: the handles and out-pointers are valid; the names are static texts of PETSc.
        let name = unsafe {
            check(sys::SNESGetIterationNumber(self.snes, &mut iterations))?;
            check(sys::SNESGetLinearSolveIterations(self.snes, &mut linear_iterations))?;
            check(sys::SNESGetFunctionNorm(self.snes, &mut residual_norm))?;
            check(sys::SNESGetConvergedReasonString(self.snes, &mut name))?;
            text(name)
        };
        let linear_failure = code == sys::SNES_DIVERGED_LINEAR_SOLVE;
        let linear = linear_failure.then(|| self.linear_reason()).transpose()?;
        let singular = linear.as_ref().is_some_and(LinearReason::is_singular);
        let reason = linear.map_or_else(
            || format!("{} ({name})", nonlinear_words(code)),
            |linear| linear.described(),
        );
        self.discard_failed_factors()?;
        Ok(Outcome {
            end,
            iterations: iterations as usize,
            linear_iterations: linear_iterations as usize,
            residual_norm,
            reason,
            linear_failure,
            singular,
            evaluated_at_solution,
        })
    }

    /// Solves K x = `rhs` (owned parts) with the matrix as it is now, by the linear solver of the iterations.
    ///
    /// `x` is overwritten if the solve converged. The matrix must be assembled.
    pub fn linear_solve(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<LinearOutcome, SolveError> {
        let matrix = self.matrix.handle;
        if let Some(copy) = &mut self.copy {
            copy.refill(&self.matrix)?;
        }
        let factored = self.copy.as_ref().map_or(matrix, |copy| copy.handle);
        // SAFETY: the handles are valid and of one layout.
        check(unsafe { sys::KSPSetOperators(self.ksp, matrix, factored) })?;
        self.linear_solve_again(rhs, x)
    }

    /// As [`linear_solve`](Self::linear_solve), with the matrix of the last one and its factors.
    ///
    /// # Errors
    /// What a smaller load step would not mend, such as a lack of memory.
    pub fn linear_solve_again(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<LinearOutcome, SolveError> {
        self.function.set(rhs)?;
        let mut iterations = 0;
        // SAFETY: the handles are valid and of one layout, the operators were set; the out-pointer is valid.
        unsafe {
            check(sys::KSPSolve(self.ksp, self.function.handle, self.solution.handle))?;
            check(sys::KSPGetIterationNumber(self.ksp, &mut iterations))?;
        }
        let mut reason = self.linear_reason()?;
        self.discard_failed_factors()?;
        let converged = reason.succeeded && self.solution.norm()?.is_finite();
        if converged {
            self.solution.copy_to(x)?;
        } else if reason.succeeded {
            reason.words = NOT_FINITE;
        }
        Ok(LinearOutcome {
            converged,
            iterations: iterations as usize,
            singular: reason.is_singular(),
            reason: reason.described(),
        })
    }

    /// How the last linear solve ended; the same on every rank.
    ///
    /// # Errors
    /// Factors that do not fit into memory: no smaller step would need less.
    fn linear_reason(&self) -> Result<LinearReason, SolveError> {
        let (mut code, mut name) = (0, std::ptr::null());
        // SAFETY: the handle and the out-pointers are valid; the name is a static text of PETSc.
        let name = unsafe {
            check(sys::KSPGetConvergedReason(self.ksp, &mut code))?;
            check(sys::KSPGetConvergedReasonString(self.ksp, &mut name))?;
            text(name)
        };
        let mut reason = LinearReason {
            succeeded: code > 0,
            words: linear_words(code),
            name,
            failure: None,
        };
        let world = self.session.world();
        if !world.any(self.failure_of(self.pc)? != sys::PC_NOERROR) {
            return Ok(reason);
        }
        // SAFETY: the preconditioner is valid as long as `self`.
        let account = unsafe { Account::of(self.factors)? };
        let own = factors::failure(account, self.failure_of(self.factors)?);
        let failure = Failure::of_number(world.max_of(own.number()));
        if failure == Failure::Memory {
            let limited = self.session.has_option(c"-mat_mumps_icntl_23")?;
            let account = account.unwrap_or_default().common(world, self.factors != self.pc);
            return Err(SolveError::Memory(factors::no_memory(account, world.size(), limited)));
        }
        reason.failure = Some(failure);
        Ok(reason)
    }

    /// PETSc's reason for a failed set-up of one of the two preconditioners.
    fn failure_of(&self, pc: sys::PC) -> Result<sys::PCFailedReason, PetscError> {
        let mut reason = sys::PC_NOERROR;
        // SAFETY: the preconditioners are valid as long as `self`, and the out-pointer is valid.
        check(unsafe { sys::PCGetFailedReason(pc, &mut reason) })?;
        Ok(reason)
    }

    /// Starts the next factorisation from scratch if the last one failed: PETSc 3.18 would otherwise take MUMPS' old
    /// error for one of the analysis, skip the factorisation and solve with nothing.
    fn discard_failed_factors(&mut self) -> Result<(), PetscError> {
        if self.failure_of(self.pc)? == sys::PC_NOERROR {
            return Ok(());
        }
        // SAFETY: the handle is valid; operators are set again before every solve.
        check(unsafe { sys::KSPReset(self.ksp) })
    }

    /// The linear solver and the fill-reducing ordering of the last factorisation, in words for a summary.
    pub fn ordering_used(&self) -> Result<String, PetscError> {
        // SAFETY: the preconditioners are valid as long as `self`.
        let used = unsafe { ordering::used(self.factors, &self.session)? };
        let redundant = self.factors != self.pc;
        Ok(if redundant {
            format!("{used}, on every rank")
        } else {
            used
        })
    }
}

/// How a linear solve ended.
struct LinearReason {
    succeeded: bool,
    words: &'static str,
    /// PETSc's name.
    name: String,
    /// Why there are no factors, where that ended it.
    failure: Option<Failure>,
}

impl LinearReason {
    /// Whether the matrix is singular: by its factorisation, or by what came of it.
    fn is_singular(&self) -> bool {
        self.failure == Some(Failure::Singular) || self.words == NOT_FINITE
    }

    fn described(&self) -> String {
        let words = match self.failure {
            Some(Failure::Singular) => "the matrix of a linear system is singular",
            _ => self.words,
        };
        format!("{words} ({})", self.name)
    }
}

/// PETSc's reason for the end of a nonlinear solve, in words.
fn nonlinear_words(reason: sys::SNESConvergedReason) -> &'static str {
    match reason {
        1.. => "the iteration converged",
        sys::SNES_DIVERGED_FUNCTION_DOMAIN => "the iteration left the domain of the laws",
        sys::SNES_DIVERGED_FNORM_NAN => "the residual is not a number",
        sys::SNES_DIVERGED_MAX_IT => "the iteration did not converge within its limit",
        sys::SNES_DIVERGED_LINE_SEARCH => "no share of the Newton step makes the residual smaller",
        sys::SNES_DIVERGED_DTOL => "the iteration diverged",
        _ => "the iteration gave up",
    }
}

/// Lets SNES run on one evaluation. The outer result is PETSc's own error.
///
/// # Safety
/// The handles are valid and belong together with the evaluation's matrix.
unsafe fn run(
    snes: sys::SNES,
    function: sys::Vec,
    solution: sys::Vec,
    evaluation: &mut Evaluation<'_>,
) -> Result<(), PetscError> {
    let matrix = evaluation.matrix.handle;
    let factored = evaluation.copy.as_ref().map_or(matrix, |copy| copy.handle);
    let context: *mut c_void = std::ptr::from_mut(evaluation).cast();
    // SAFETY: by contract; the callbacks have PETSc's signatures and get the context, which lives until the end of this
    // function. SNES keeps the pointer afterwards, but every solve sets its own before anything is called back.
    unsafe {
        check(sys::SNESSetFunction(snes, function, Some(residual), context))?;
        check(sys::SNESSetJacobian(snes, matrix, factored, Some(jacobian), context))?;
        check(sys::SNESSetConvergenceTest(snes, Some(converged), context, None))?;
        check(sys::SNESSolve(snes, null_mut(), solution))
    }
}

impl Drop for Newton {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // SAFETY: the handle is valid or null, and not used again; it lets go of vectors and matrix.
            report_in_drop("SNESDestroy", unsafe { sys::SNESDestroy(&mut self.snes) });
        }
    }
}
