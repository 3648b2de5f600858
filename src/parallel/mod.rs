//! The processes of a run and what they agree on: reductions, exchanges, broadcasts.
//!
//! Everything here is collective unless its name says otherwise: every rank must call it, in the same order. A sum runs
//! in the order that the MPI library chooses for a given number of ranks, which does not change from run to run.

mod directory;

pub use directory::{Directory, Numbered, Numbering};

use crate::console;
use std::rc::Rc;
use std::time::Duration;

use mpi::collective::SystemOperation;
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::{Threading, Universe};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Equivalence, Root};

/// Head start of the root where several ranks have a failure to report.
const FIRST_WORD: Duration = Duration::from_secs(1);

/// The rank that reads, prints and writes what exists once.
pub const ROOT: usize = 0;

/// All processes of this run.
///
/// Copies share one MPI environment, which is finalised when the last of them is dropped. A rank that unwinds from a
/// panic takes the others with it (exit code 101), since they would wait for it for ever.
#[derive(Clone)]
pub struct World {
    shared: Rc<Shared>,
}

struct Shared {
    communicator: SimpleCommunicator,
    threads: bool,
    // Dropped last: it finalises MPI.
    universe: Option<Universe>,
}

impl Drop for Shared {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            return;
        }
        if self.communicator.size() > 1 {
            self.communicator.abort(101);
        }
        // Libraries on top of MPI were not finalised, so MPI must not be either.
        std::mem::forget(self.universe.take());
    }
}

impl World {
    /// Initialises MPI; works with and without `mpirun`. `None` when this process has done so before.
    pub fn start() -> Option<World> {
        // This program runs one thread a rank, but PT-Scotch starts its own and calls MPI from them.
        let (universe, provided) = mpi::initialize_with_threading(Threading::Multiple)?;
        let communicator = universe.world();
        Some(World {
            shared: Rc::new(Shared {
                communicator,
                threads: provided == Threading::Multiple,
                universe: Some(universe),
            }),
        })
    }

    /// The MPI communicator, for libraries that take one (PETSc, HDF5).
    pub fn communicator(&self) -> &SimpleCommunicator {
        &self.shared.communicator
    }

    /// This process's number, from zero.
    pub fn rank(&self) -> usize {
        self.communicator().rank() as usize
    }

    /// Number of processes.
    pub fn size(&self) -> usize {
        self.communicator().size() as usize
    }

    /// True on the rank that prints.
    pub fn is_root(&self) -> bool {
        self.rank() == ROOT
    }

    /// True if this MPI can be called from several threads at once.
    pub fn is_thread_safe(&self) -> bool {
        self.shared.threads
    }

    /// Waits until every rank is here.
    pub fn barrier(&self) {
        self.communicator().barrier();
    }

    /// Ends every process at once with this exit code. Not collective; for failures that one rank cannot share.
    pub fn abort(&self, code: i32) -> ! {
        self.communicator().abort(code)
    }

    /// Ends every process with exit code 1 and a message, of which other ranks may know nothing. Not collective: where
    /// all ranks fail alike, the root is quicker and speaks for all.
    pub fn fail(&self, message: &str) -> ! {
        if !self.is_root() {
            std::thread::sleep(FIRST_WORD);
        }
        console::complain(format_args!("error: rank {}: {message}", self.rank()));
        self.abort(1)
    }

    /// True where `ok` is true on every rank.
    pub fn all_ok(&self, ok: bool) -> bool {
        self.min_of(u8::from(ok)) == 1
    }

    /// True where `any` is true on at least one rank.
    pub fn any(&self, any: bool) -> bool {
        self.max_of(u8::from(any)) == 1
    }

    /// Makes a result common: `Ok` if it is `Ok` everywhere, otherwise an error on every rank.
    ///
    /// A rank that succeeded itself gets `elsewhere(rank)`, with the lowest rank that failed.
    pub fn agree<T, E>(&self, result: Result<T, E>, elsewhere: impl FnOnce(usize) -> E) -> Result<T, E> {
        let failed = if result.is_err() { self.rank() } else { self.size() };
        let first = self.min_of(failed);
        match result {
            Ok(_) if first < self.size() => Err(elsewhere(first)),
            other => other,
        }
    }

    /// Sum over ranks.
    pub fn sum<T: Equivalence + Copy>(&self, value: T) -> T {
        self.reduce(value, SystemOperation::sum())
    }

    /// Largest value over ranks. NaN on a rank gives an unspecified result.
    pub fn max_of<T: Equivalence + Copy>(&self, value: T) -> T {
        self.reduce(value, SystemOperation::max())
    }

    /// Smallest value over ranks. NaN on a rank gives an unspecified result.
    pub fn min_of<T: Equivalence + Copy>(&self, value: T) -> T {
        self.reduce(value, SystemOperation::min())
    }

    /// Entry-wise sum over ranks, in place; the length is the same on every rank.
    pub fn sum_slice<T: Equivalence + Copy>(&self, values: &mut [T]) {
        self.reduce_slice(values, SystemOperation::sum());
    }

    /// Entry-wise maximum over ranks, in place; the length is the same on every rank.
    pub fn max_slice<T: Equivalence + Copy>(&self, values: &mut [T]) {
        self.reduce_slice(values, SystemOperation::max());
    }

    /// Entry-wise minimum over ranks, in place; the length is the same on every rank.
    pub fn min_slice<T: Equivalence + Copy>(&self, values: &mut [T]) {
        self.reduce_slice(values, SystemOperation::min());
    }

    fn reduce<T: Equivalence + Copy>(&self, value: T, operation: SystemOperation) -> T {
        let mut result = value;
        self.communicator().all_reduce_into(&value, &mut result, operation);
        result
    }

    fn reduce_slice<T: Equivalence + Copy>(&self, values: &mut [T], operation: SystemOperation) {
        let own = values.to_vec();
        self.communicator().all_reduce_into(&own[..], values, operation);
    }

    /// Sum of `count` over the lower ranks: the first number of a range that every rank gets a piece of.
    pub fn exclusive_scan(&self, count: usize) -> usize {
        let mut before = 0_usize;
        self.communicator()
            .exclusive_scan_into(&count, &mut before, SystemOperation::sum());
        // MPI leaves the value of rank 0 undefined.
        if self.is_root() { 0 } else { before }
    }

    /// The value of every rank, in the order of ranks, on every rank.
    pub fn all_gather<T: Equivalence + Copy>(&self, value: T) -> Vec<T> {
        let mut values = vec![value; self.size()];
        self.communicator().all_gather_into(&value, &mut values[..]);
        values
    }

    /// Sends `outgoing[r]` to rank `r`; entry `r` of the answer came from rank `r`.
    ///
    /// # Panics
    /// If `outgoing` has not one entry per rank, or a rank's total exceeds what MPI counts in an `i32`.
    pub fn exchange<T: Equivalence + Copy + Default>(&self, outgoing: &[Vec<T>]) -> Vec<Vec<T>> {
        assert_eq!(outgoing.len(), self.size(), "one list per rank");
        let send_counts: Vec<i32> = outgoing.iter().map(|list| count(list.len())).collect();
        let mut receive_counts = vec![0_i32; self.size()];
        self.communicator()
            .all_to_all_into(&send_counts[..], &mut receive_counts[..]);
        let send = with_address(&outgoing.concat());
        let total: usize = receive_counts.iter().map(|&n| n as usize).sum();
        let mut received = vec![T::default(); total];
        let (send_starts, receive_starts) = (starts(&send_counts), starts(&receive_counts));
        self.communicator().all_to_all_varcount_into(
            &Partition::new(&send[..], send_counts, send_starts),
            &mut PartitionMut::new(&mut received[..], &receive_counts[..], receive_starts),
        );
        split(received, &receive_counts)
    }

    /// The lists of all ranks on the root, in the order of ranks; `None` elsewhere.
    ///
    /// # Panics
    /// If the total exceeds what MPI counts in an `i32`.
    pub fn gather<T: Equivalence + Copy + Default>(&self, values: &[T]) -> Option<Vec<Vec<T>>> {
        let counts = self.all_gather(count(values.len()));
        let values = &with_address(values)[..];
        let root = self.communicator().process_at_rank(ROOT as i32);
        if !self.is_root() {
            root.gather_varcount_into(values);
            return None;
        }
        let total: usize = counts.iter().map(|&n| n as usize).sum();
        let mut received = vec![T::default(); total];
        let starts = starts(&counts);
        root.gather_varcount_into_root(values, &mut PartitionMut::new(&mut received[..], &counts[..], starts));
        Some(split(received, &counts))
    }

    /// The root's list on every rank; what the others pass is ignored.
    pub fn broadcast<T: Equivalence + Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let root = self.communicator().process_at_rank(ROOT as i32);
        let mut length = values.len();
        root.broadcast_into(&mut length);
        let mut received = if self.is_root() {
            values.to_vec()
        } else {
            vec![T::default(); length]
        };
        root.broadcast_into(&mut received[..]);
        received
    }

    /// The text of one rank on every rank; what the others pass is ignored. All name the same rank.
    pub fn text_from(&self, rank: usize, text: &str) -> String {
        let own = if self.rank() == rank {
            text.as_bytes().to_vec()
        } else {
            Vec::new()
        };
        let received = self.exchange(&vec![own; self.size()]).swap_remove(rank);
        String::from_utf8(received).expect("bytes of a text are UTF-8")
    }

    /// The root's text on every rank; what the others pass is ignored.
    pub fn broadcast_text(&self, text: &str) -> String {
        let bytes = self.broadcast(text.as_bytes());
        String::from_utf8(bytes).expect("bytes of a text of the root are UTF-8")
    }
}

/// A copy that MPI can send even if it is empty: the address that Rust gives an empty list of bytes is 1, which Open MPI
/// takes for `MPI_IN_PLACE`.
fn with_address<T: Copy>(values: &[T]) -> Vec<T> {
    let mut copy = Vec::with_capacity(values.len().max(1));
    copy.extend_from_slice(values);
    copy
}

/// A length as MPI counts it.
fn count(length: usize) -> i32 {
    i32::try_from(length).expect("one message holds at most 2^31 - 1 entries")
}

/// Where each part starts in a list of the parts.
fn starts(counts: &[i32]) -> Vec<i32> {
    let mut next = 0_i32;
    counts
        .iter()
        .map(|&n| {
            let start = next;
            next = next
                .checked_add(n)
                .expect("one exchange holds at most 2^31 - 1 entries");
            start
        })
        .collect()
}

/// Cuts a list into parts of these lengths.
fn split<T>(all: Vec<T>, counts: &[i32]) -> Vec<Vec<T>> {
    let mut rest = all.into_iter();
    counts
        .iter()
        .map(|&n| rest.by_ref().take(n as usize).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_start_where_the_previous_ones_end() {
        assert_eq!(starts(&[2, 0, 3]), [0, 2, 2]);
        assert_eq!(
            split(vec![1, 2, 3, 4, 5], &[2, 0, 3]),
            [vec![1, 2], vec![], vec![3, 4, 5]]
        );
    }

    #[test]
    #[should_panic(expected = "at most 2^31 - 1 entries")]
    fn an_exchange_too_large_for_mpi_is_refused() {
        starts(&[i32::MAX, 1, 1]);
    }
}
