//! Where PETSc spent the time.

use std::ffi::{CStr, CString, c_int};
use std::marker::PhantomData;
use std::rc::Rc;

use petsc_sys as sys;

use super::error::{PetscError, check, report_in_drop};
use super::session::Session;

/// Wall seconds of this process in phases of the linear solver, since PETSc was started.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PhaseSeconds {
    /// Setting preconditioners up; for a direct solver that is the analysis and the factorisation.
    pub factorisation: f64,
    /// Linear solves without it: Krylov iterations, or the triangular solves of a direct solver.
    pub solve: f64,
}

/// A named part of the run in PETSc's log (`-log_view`).
pub struct LogStage {
    session: Rc<Session>,
    number: c_int,
}

/// The stage is on until this is dropped. Stages may be nested.
#[must_use = "the stage ends when the guard is dropped"]
pub struct StageGuard {
    _session: Rc<Session>,
    // The stack of stages belongs to the thread that runs PETSc.
    _not_send: PhantomData<*const ()>,
}

impl LogStage {
    /// The stage of this name, made when it is first asked for.
    pub fn new(session: &Rc<Session>, name: &str) -> Result<Self, PetscError> {
        let known = session
            .stages()
            .borrow()
            .iter()
            .find(|(known, _)| known == name)
            .map(|&(_, number)| number);
        if let Some(number) = known {
            return Ok(LogStage {
                session: session.clone(),
                number,
            });
        }
        let c_name = CString::new(name)
            .map_err(|_| PetscError::refused(sys::PETSC_ERR_ARG_WRONG, "the name of a log stage has a zero byte"))?;
        let mut number = 0;
        // SAFETY: the name ends with a zero byte and the out-pointer is valid; PETSc copies the name.
        check(unsafe { sys::PetscLogStageRegister(c_name.as_ptr(), &mut number) })?;
        session.stages().borrow_mut().push((name.to_string(), number));
        Ok(LogStage {
            session: session.clone(),
            number,
        })
    }

    /// Counts what PETSc does from now on to this stage.
    pub fn enter(&self) -> Result<StageGuard, PetscError> {
        // SAFETY: the number was given by PETSc.
        check(unsafe { sys::PetscLogStagePush(self.number) })?;
        Ok(StageGuard {
            _session: self.session.clone(),
            _not_send: PhantomData,
        })
    }
}

impl Drop for StageGuard {
    fn drop(&mut self) {
        // SAFETY: the stage was pushed when the guard was made.
        report_in_drop("PetscLogStagePop", unsafe { sys::PetscLogStagePop() });
    }
}

/// Sums PETSc's events over all stages.
pub(super) fn phase_seconds() -> Result<PhaseSeconds, PetscError> {
    let factorisation = event_seconds(c"PCSetUp")?;
    // PETSc 3.18 begins the event KSPSolve inside KSPSolve after the set-up, which is what is wanted here.
    Ok(PhaseSeconds {
        factorisation,
        solve: event_seconds(c"KSPSolve")?,
    })
}

/// Seconds in one event, over all stages. Nested events of the same name count once.
fn event_seconds(name: &CStr) -> Result<f64, PetscError> {
    let mut event = 0;
    let mut stages: sys::PetscStageLog = std::ptr::null_mut();
    // SAFETY: the name ends with a zero byte and the out-pointers are valid.
    let count = unsafe {
        check(sys::PetscLogEventGetId(name.as_ptr(), &mut event))?;
        check(sys::PetscLogGetStageLog(&mut stages))?;
        (*stages).numStages
    };
    let mut seconds = 0.0;
    for stage in 0..count {
        // SAFETY: the structure is plain numbers, for which zero is a value; stage and event exist.
        seconds += unsafe {
            let mut information: sys::PetscEventPerfInfo = std::mem::zeroed();
            check(sys::PetscLogEventGetPerfInfo(stage, event, &mut information))?;
            information.time
        };
    }
    Ok(seconds)
}
