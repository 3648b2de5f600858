//! Processes that do not outlive the one that started them.

use rustix::process::{Pid, Signal, getpid, getppid, set_parent_process_death_signal};
use std::io::{Error, ErrorKind, Result};
use std::os::unix::process::CommandExt;
use std::process::Command;

/// Makes the system send SIGTERM to the process that the command starts when the thread that starts it ends, be it with
/// the whole process and by SIGKILL. The process gets a group of its own: what a terminal sends to all reaches this
/// process alone, which passes it on once.
pub fn tether(command: &mut Command) {
    let own = getpid();
    command.process_group(0);
    // SAFETY: between fork and exec the closure makes two system calls and allocates nothing.
    unsafe { command.pre_exec(move || end_with(own)) };
}

fn end_with(parent: Pid) -> Result<()> {
    set_parent_process_death_signal(Some(Signal::TERM))?;
    // It may have ended before the call.
    match getppid() {
        Some(now) if now == parent => Ok(()),
        _ => Err(Error::from(ErrorKind::Interrupted)),
    }
}
