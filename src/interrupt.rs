//! Signals that ask a run to stop: SIGTERM, SIGINT and SIGUSR1.
//!
//! The first one is only noted; the run looks at the note at every Newton iteration, on all ranks together, writes a
//! checkpoint and leaves. The second one ends the process at once.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use signal_hook::flag;

/// What launchers and batch systems end a job with, and the one that they can be told to send ahead of that.
const SIGNALS: [i32; 3] = [SIGTERM, SIGINT, SIGUSR1];

/// Exit code of a process that a signal ended, as shells have it: this plus the number of the signal.
const ENDED_BY_SIGNAL: i32 = 128;

/// Whether this process was asked to stop.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Catches the signals from here on.
    ///
    /// # Errors
    /// The operating system does not allow it.
    pub fn catch() -> io::Result<Self> {
        let interrupt = Self::default();
        for signal in SIGNALS {
            // In this order: the first signal finds the note empty and only makes it, the second finds it there.
            flag::register_conditional_shutdown(signal, ENDED_BY_SIGNAL + signal, interrupt.requested.clone())?;
            flag::register(signal, interrupt.requested.clone())?;
        }
        Ok(interrupt)
    }

    /// Whether this process was asked; other ranks may not know yet.
    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }
}
