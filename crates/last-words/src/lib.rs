//! How a process ends that cannot go on: with a line for its user and exit code 1, not with a signal and the traces that
//! Rust and MPI print of it.
//!
//! Nothing here takes memory, and no destructors run: other ranks of a job are ended by its launcher.

use std::alloc::{GlobalAlloc, Layout, System};
use std::fmt::Arguments;
use std::io::{Cursor, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code: a failure of the machine or of a library.
const FAILURE: libc::c_int = 1;

/// How long others have to say it first [s]: launchers need one or two to end the processes of a job.
const HEAD_START: libc::c_uint = 4;

static LET_OTHERS_SPEAK: AtomicBool = AtomicBool::new(false);

/// The system's allocator, which ends the process where there is no memory. What asks for memory and could do without gets
/// no answer either.
pub struct Allocator;

// SAFETY: all is left to the system's allocator; null is the only answer that does not reach the caller.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of the same function.
        or_end(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        or_end(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        or_end(unsafe { System.realloc(pointer, layout, size) }, size)
    }
}

/// Makes an abort of a library, as for want of memory, an end with a line and exit code 1. To be called after MPI is
/// started, which has a handler of its own. `first` on the process that speaks for all of a job.
pub fn catch_aborts(first: bool) {
    LET_OTHERS_SPEAK.store(!first, Ordering::Relaxed);
    // SAFETY: the handler calls nothing but `write`, `sleep` and `_exit`, which a handler may.
    unsafe { libc::signal(libc::SIGABRT, aborted as *const () as libc::sighandler_t) };
}

extern "C" fn aborted(_signal: libc::c_int) {
    end(format_args!(
        "a library gave up, most often for want of memory; what it said stands above"
    ))
}

fn or_end(pointer: *mut u8, size: usize) -> *mut u8 {
    if pointer.is_null() {
        end(format_args!(
            "there is not enough memory: {size} bytes more were asked for"
        ));
    }
    pointer
}

#[cold]
fn end(reason: Arguments<'_>) -> ! {
    let mut line = Cursor::new([0_u8; 200]);
    let _ = writeln!(line, "error: {reason}");
    let length = line.position() as usize;
    // SAFETY: the bytes are those of the array; the functions take no locks and no memory.
    unsafe {
        let mut rest = if LET_OTHERS_SPEAK.load(Ordering::Relaxed) {
            HEAD_START
        } else {
            0
        };
        while rest > 0 {
            // Signals end a sleep early.
            rest = libc::sleep(rest);
        }
        libc::write(libc::STDERR_FILENO, line.get_ref().as_ptr().cast(), length);
        libc::_exit(FAILURE)
    }
}
