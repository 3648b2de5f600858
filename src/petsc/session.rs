//! The life of PETSc in this process.

use crate::console;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int};
use std::ptr::null_mut;
use std::rc::Rc;

use mpi::topology::SimpleCommunicator;
use mpi::traits::AsRaw;
use petsc_sys as sys;

use super::blas;
use super::error::{PetscError, check, remember, text};
use super::log::{PhaseSeconds, phase_seconds};
use super::matrix::MatrixFormat;
use super::{options, ordering};
use crate::parallel::World;

/// Options that this wrapper sets unless the user does.
const DEFAULTS: [(&CStr, &CStr); 1] = [(c"-options_left", c"no")];

/// A running PETSc. Handles share it; the last one to go finalises PETSc, and only then can MPI be finalised.
pub struct Session {
    world: World,
    version: String,
    stages: RefCell<Vec<(String, c_int)>>,
    /// Names of the options that this wrapper set.
    own_options: RefCell<Vec<String>>,
}

impl Session {
    /// Starts PETSc on all ranks with the given options, names and values in turn (`["-ksp_type", "gmres"]`).
    ///
    /// `PETSC_OPTIONS` of the environment and PETSc's option files count too; the given options take precedence.
    /// Signals are left alone. Times of PETSc's phases are logged from here on.
    ///
    /// # Errors
    /// Options that PETSc must not see (see [`Session::check_options`]), or what PETSc reports. PETSc can run only once
    /// per process.
    pub fn start(world: &World, given: &[String]) -> Result<Rc<Session>, PetscError> {
        let mut arguments = vec![c"mpm-petsc".to_owned(), c"-no_signal_handler".to_owned()];
        arguments.extend(options::checked(world, given)?);
        initialise(world, &arguments)?;
        // From here on the drop of the session finalises PETSc, whatever happens.
        let session = Rc::new(Session {
            world: world.clone(),
            version: library_version()?,
            stages: RefCell::default(),
            own_options: RefCell::default(),
        });
        for (name, value) in DEFAULTS {
            session.prefer(name, &value.to_string_lossy())?;
        }
        world.agree(
            blas::take_work_area(raw_communicator(&SimpleCommunicator::self_comm())),
            |rank| {
                PetscError::refused(
                    sys::PETSC_ERR_MEM,
                    format!("the linear algebra of rank {rank} gets no work area"),
                )
            },
        )?;
        // SAFETY: PETSc runs; the functions take no arguments.
        check(unsafe { sys::PetscLogDefaultBegin() })?;
        // SAFETY: as above.
        check(unsafe { sys::PetscSysRegisterMetisPartitioning() })?;
        ordering::register()?;
        Ok(session)
    }

    /// Looks at options, those of the environment and of files among them, without starting PETSc.
    ///
    /// # Errors
    /// The same on all ranks: a value without a name, options that would end or halt the process, files that cannot be
    /// read.
    pub fn check_options(world: &World, given: &[String]) -> Result<(), PetscError> {
        options::checked(world, given).map(drop)
    }

    /// The processes that PETSc runs on.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Version of the PETSc library in use, as `3.18.5`.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Options that were given but that nothing has asked for so far, each as `-name value`: mistyped ones, at the end
    /// of a run. Not collective.
    pub fn unused_options(&self) -> Result<Vec<String>, PetscError> {
        let (mut count, mut names, mut values) = (0, null_mut(), null_mut());
        // SAFETY: the out-pointers are valid; PETSc allocates two lists of `count` texts.
        check(unsafe { sys::PetscOptionsLeftGet(null_mut(), &mut count, &mut names, &mut values) })?;
        let mut unused = Vec::new();
        for i in 0..count as usize {
            // SAFETY: both lists have `count` entries, each null or a text that ends with a zero byte.
            let (name, value) = unsafe { (text(*names.add(i)), text(*values.add(i))) };
            let own = name == "no_signal_handler" || self.own_options.borrow().contains(&name);
            if !own {
                unused.push(format!("-{name} {value}").trim_end().to_string());
            }
        }
        // SAFETY: gives back what PetscOptionsLeftGet handed out.
        check(unsafe { sys::PetscOptionsLeftRestore(null_mut(), &mut count, &mut names, &mut values) })?;
        Ok(unused)
    }

    /// Wall seconds that this process has spent in PETSc's phases so far.
    pub fn phase_seconds(&self) -> Result<PhaseSeconds, PetscError> {
        phase_seconds()
    }

    /// The storage that the chosen linear solver works with: scalar rows for multigrid (`-pc_type gamg`, `hypre`,
    /// `ml`), for factorisations other than MUMPS' and PETSc's own, and where the user asks for it (`-mat_type aij`);
    /// node blocks otherwise.
    pub fn matrix_format(&self) -> Result<MatrixFormat, PetscError> {
        let preconditioner = self.option(c"-pc_type")?;
        let package = self.option(c"-pc_factor_mat_solver_type")?;
        let storage = self.option(c"-mat_type")?;
        let multigrid = matches!(preconditioner.as_deref(), Some("gamg" | "hypre" | "ml"));
        let foreign = !matches!(package.as_deref(), None | Some("mumps" | "petsc"));
        let asked = storage.is_some_and(|storage| storage.contains("aij") && !storage.contains("baij"));
        Ok(if multigrid || foreign || asked {
            MatrixFormat::Scalar
        } else {
            MatrixFormat::Block
        })
    }

    /// PETSc's name for the communicator of all ranks.
    pub(super) fn communicator(&self) -> sys::MPI_Comm {
        raw_communicator(self.world.communicator())
    }

    /// Numbers of the log stages by name; PETSc would register a second stage of the same name.
    pub(super) fn stages(&self) -> &RefCell<Vec<(String, c_int)>> {
        &self.stages
    }

    /// Sets an option unless the user did.
    pub(super) fn prefer(&self, name: &CStr, value: &str) -> Result<(), PetscError> {
        if self.has_option(name)? {
            return Ok(());
        }
        self.own_options.borrow_mut().push(plain(name));
        self.set_option(name, value)
    }

    /// Takes back what [`prefer`](Self::prefer) set.
    pub(super) fn withdraw(&self, name: &CStr) -> Result<(), PetscError> {
        if !self.is_own_option(name) {
            return Ok(());
        }
        self.own_options.borrow_mut().retain(|own| *own != plain(name));
        // SAFETY: PETSc runs; the name ends with a zero byte.
        check(unsafe { sys::PetscOptionsClearValue(null_mut(), name.as_ptr()) })
    }

    /// Whether [`prefer`](Self::prefer) set the option.
    pub(super) fn is_own_option(&self, name: &CStr) -> bool {
        self.own_options.borrow().contains(&plain(name))
    }

    /// Sets an option, whatever it was.
    pub(super) fn set_option(&self, name: &CStr, value: &str) -> Result<(), PetscError> {
        let text = CString::new(value).expect("values of own options hold no zero byte");
        // SAFETY: PETSc runs; both texts end with a zero byte and are copied.
        check(unsafe { sys::PetscOptionsSetValue(null_mut(), name.as_ptr(), text.as_ptr()) })
    }

    /// True when the option is set, to whatever value.
    pub(super) fn has_option(&self, name: &CStr) -> Result<bool, PetscError> {
        let mut set = sys::PETSC_FALSE;
        // SAFETY: PETSc runs; the name ends with a zero byte and the out-pointer is valid.
        check(unsafe { sys::PetscOptionsHasName(null_mut(), std::ptr::null(), name.as_ptr(), &mut set) })?;
        Ok(set == sys::PETSC_TRUE)
    }

    /// The value of an option, if it is set.
    pub(super) fn option(&self, name: &CStr) -> Result<Option<String>, PetscError> {
        let mut set = sys::PETSC_FALSE;
        let mut value = [0 as c_char; 256];
        // SAFETY: PETSc runs; the name ends with a zero byte, and PETSc writes at most the given number of bytes.
        check(unsafe {
            sys::PetscOptionsGetString(
                null_mut(),
                std::ptr::null(),
                name.as_ptr(),
                value.as_mut_ptr(),
                value.len(),
                &mut set,
            )
        })?;
        // SAFETY: the buffer was zeroed, and PETSc ends what it writes with a zero byte.
        Ok((set == sys::PETSC_TRUE).then(|| unsafe { text(value.as_ptr()) }))
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // Finalising is collective: a rank that unwinds from a panic would wait here for the others.
        if std::thread::panicking() {
            return;
        }
        // SAFETY: PETSc runs, every handle is gone (each holds this session), and MPI is not finalised (`world`). The
        // error handler goes last, so that nothing is printed by PETSc itself.
        let code = unsafe { sys::PetscFinalize() };
        // The user may be the cause, as with a log that PETSc shall write at its end into a folder that is not there.
        if let (Err(error), true) = (check(code), self.world.is_root()) {
            console::complain(format_args!("warning: the end of PETSc: {error}"));
        }
    }
}

/// Name of an option as PETSc lists it, without the hyphen.
fn plain(name: &CStr) -> String {
    name.to_string_lossy().trim_start_matches('-').to_owned()
}

/// Starts PETSc on `world` and silences it.
fn initialise(world: &World, arguments: &[CString]) -> Result<(), PetscError> {
    let mut running = sys::PETSC_FALSE;
    // SAFETY: may be called at any time with a valid out-pointer.
    check(unsafe { sys::PetscInitialized(&mut running) })?;
    if running == sys::PETSC_TRUE {
        return Err(PetscError::refused(
            sys::PETSC_ERR_ORDER,
            "PETSc is already running in this process",
        ));
    }
    // PETSc keeps pointers to the arguments until it is finalised, so they are never freed.
    let mut pointers: Vec<*mut c_char> = arguments.iter().map(|word| word.clone().into_raw()).collect();
    pointers.push(null_mut());
    let mut count = arguments.len() as c_int;
    let mut list = pointers.leak().as_mut_ptr();
    // SAFETY: MPI is initialised and stays so (`world`); no other thread runs PETSc, so its global communicator may be
    // written; the list has `count` texts, a null behind them, and is never freed.
    let started = unsafe {
        check(sys::PetscPushErrorHandler(Some(remember), null_mut()))?;
        sys::PETSC_COMM_WORLD = raw_communicator(world.communicator());
        check(sys::PetscInitialize(
            &mut count,
            &mut list,
            std::ptr::null(),
            std::ptr::null(),
        ))
    };
    if let (Err(error), true) = (&started, world.size() > 1) {
        // One rank may be the only one to know; the others wait inside PETSc.
        world.fail(&error.to_string());
    }
    started
}

/// rsmpi's communicator as PETSc's headers know it: the same C type behind two generated names.
fn raw_communicator(communicator: &SimpleCommunicator) -> sys::MPI_Comm {
    let raw = communicator.as_raw();
    const {
        assert!(
            size_of::<mpi::ffi::MPI_Comm>() == size_of::<sys::MPI_Comm>(),
            "PETSc and rsmpi use different MPIs"
        )
    };
    // SAFETY: both are the `MPI_Comm` of one MPI library (build.rs checks that), of the same size.
    unsafe { std::mem::transmute::<mpi::ffi::MPI_Comm, sys::MPI_Comm>(raw) }
}

fn library_version() -> Result<String, PetscError> {
    let (mut major, mut minor, mut patch, mut release) = (0, 0, 0, 0);
    // SAFETY: the out-pointers are valid.
    check(unsafe { sys::PetscGetVersionNumber(&mut major, &mut minor, &mut patch, &mut release) })?;
    Ok(format!("{major}.{minor}.{patch}"))
}
