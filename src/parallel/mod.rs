//! The processes of a run and what they agree on: reductions, exchanges, broadcasts.
//!
//! Everything here is collective unless its name says otherwise: every rank must call it, in the same order. A sum runs
//! in the order that the MPI library chooses for a given number of ranks, which does not change from run to run.

mod directory;

pub use directory::{Directory, Numbered, Numbering};

use crate::console;
use std::ops::Range;
use std::rc::Rc;
use std::time::Duration;

use mpi::collective::SystemOperation;
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::{Threading, Universe};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Equivalence, Root};

/// Head start of the root where several ranks have a failure to report: a launcher needs two to three seconds to end the
/// others, since they catch its first signal.
const FIRST_WORD: Duration = Duration::from_secs(4);

/// Most that MPI gets in one call [byte]. It counts in 32 bits, and some libraries count bytes in them, too.
const LARGEST_MESSAGE: usize = 1 << 30;

/// The rank that reads, prints and writes what exists once.
pub const ROOT: usize = 0;

/// All processes of this run.
///
/// Copies share one MPI environment, which is finalised when the last of them is dropped. A rank that unwinds from a
/// panic takes the others with it (exit code 101), since they would wait for it for ever. Lists of any length are sent: in
/// pieces where MPI cannot count them.
#[derive(Clone)]
pub struct World {
    shared: Rc<Shared>,
    /// Most that MPI gets in one call [byte], the same on all ranks.
    largest_message: usize,
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
            largest_message: LARGEST_MESSAGE,
        })
    }

    /// The same processes with smaller messages [byte]. All ranks name the same size.
    pub fn with_messages_of(self, largest_message: usize) -> World {
        World {
            largest_message,
            ..self
        }
    }

    /// How many values of a type each of `parts` lists may have in one call of MPI.
    fn piece<T>(&self, parts: usize) -> usize {
        (self.largest_message / (size_of::<T>().max(1) * parts)).max(1)
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

    /// Collective. How many of the processes run on this machine.
    pub fn ranks_of_this_machine(&self) -> usize {
        self.communicator().split_shared(0).size() as usize
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

    /// The lowest rank where `holds` is true; `None` where there is none.
    pub fn first_where(&self, holds: bool) -> Option<usize> {
        let first = self.min_of(if holds { self.rank() } else { self.size() });
        (first < self.size()).then_some(first)
    }

    /// Makes a result common: `Ok` if it is `Ok` everywhere, otherwise an error on every rank.
    ///
    /// A rank that succeeded itself gets `elsewhere(rank)`, with the lowest rank that failed.
    pub fn agree<T, E>(&self, result: Result<T, E>, elsewhere: impl FnOnce(usize) -> E) -> Result<T, E> {
        let failed = result.is_err();
        match (result, self.first_where(failed)) {
            (Ok(_), Some(first)) => Err(elsewhere(first)),
            (result, _) => result,
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
        for piece in values.chunks_mut(self.piece::<T>(1)) {
            let own = piece.to_vec();
            self.communicator().all_reduce_into(&own[..], piece, operation);
        }
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
    /// If `outgoing` has not one entry per rank.
    pub fn exchange<T: Equivalence + Copy + Default>(&self, outgoing: &[Vec<T>]) -> Vec<Vec<T>> {
        assert_eq!(outgoing.len(), self.size(), "one list per rank");
        let longest_own = outgoing.iter().map(Vec::len).max().unwrap_or(0);
        let own: Vec<usize> = outgoing.iter().flat_map(|list| [list.len(), longest_own]).collect();
        let mut others = vec![0; 2 * self.size()];
        self.communicator().all_to_all_into(&own[..], &mut others[..]);
        let lengths: Vec<usize> = others.iter().copied().step_by(2).collect();
        let longest = others.into_iter().skip(1).step_by(2).max().unwrap_or(0);
        let mut received: Vec<Vec<T>> = lengths.iter().map(|&length| Vec::with_capacity(length)).collect();
        let piece = self.piece::<T>(self.size());
        for start in (0..longest).step_by(piece) {
            let part = |list: &Vec<T>| section(list.len(), start, piece);
            let pieces: Vec<&[T]> = outgoing.iter().map(|list| &list[part(list)]).collect();
            let counts = lengths.iter().map(|&length| section(length, start, piece).len());
            self.exchange_pieces(&pieces, &counts.collect::<Vec<_>>(), &mut received);
        }
        received
    }

    /// One call of MPI: appends what comes, `counts[r]` values from rank `r`, to the lists.
    fn exchange_pieces<T: Equivalence + Copy + Default>(
        &self,
        outgoing: &[&[T]],
        counts: &[usize],
        received: &mut [Vec<T>],
    ) {
        let send = with_address(&outgoing.concat());
        let send_counts: Vec<i32> = outgoing.iter().map(|list| count(list.len())).collect();
        let counts: Vec<i32> = counts.iter().map(|&length| count(length)).collect();
        let mut arrived = vec![T::default(); total(&counts)];
        let (send_starts, starts) = (starts(&send_counts), starts(&counts));
        self.communicator().all_to_all_varcount_into(
            &Partition::new(&send[..], send_counts, send_starts),
            &mut PartitionMut::new(&mut arrived[..], &counts[..], starts),
        );
        append(received, &arrived, &counts);
    }

    /// The lists of all ranks on the root, in the order of ranks; `None` elsewhere.
    pub fn gather<T: Equivalence + Copy + Default>(&self, values: &[T]) -> Option<Vec<Vec<T>>> {
        let lengths = self.all_gather(values.len());
        let longest = lengths.iter().copied().max().unwrap_or(0);
        let piece = self.piece::<T>(self.size());
        let kept = |&length: &usize| if self.is_root() { length } else { 0 };
        let mut received: Vec<Vec<T>> = lengths.iter().map(kept).map(Vec::with_capacity).collect();
        for start in (0..longest).step_by(piece) {
            let counts = lengths.iter().map(|&length| section(length, start, piece).len());
            let counts: Vec<i32> = counts.map(count).collect();
            self.gather_pieces(&values[section(values.len(), start, piece)], &counts, &mut received);
        }
        self.is_root().then_some(received)
    }

    /// One call of MPI: appends what comes to the root, `counts[r]` values from rank `r`, to its lists.
    fn gather_pieces<T: Equivalence + Copy + Default>(&self, values: &[T], counts: &[i32], received: &mut [Vec<T>]) {
        let values = &with_address(values)[..];
        let root = self.communicator().process_at_rank(ROOT as i32);
        if !self.is_root() {
            root.gather_varcount_into(values);
            return;
        }
        let mut arrived = vec![T::default(); total(counts)];
        root.gather_varcount_into_root(values, &mut PartitionMut::new(&mut arrived[..], counts, starts(counts)));
        append(received, &arrived, counts);
    }

    /// The lists of all ranks one behind the other, in the order of ranks, on every rank.
    ///
    /// # Panics
    /// If the total exceeds what MPI counts in an `i32`.
    pub fn concatenate<T: Equivalence + Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let all = self.gather(values).map(|lists| lists.concat());
        self.broadcast(&all.unwrap_or_default())
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
        for piece in received.chunks_mut(self.piece::<T>(1)) {
            root.broadcast_into(piece);
        }
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

/// A length as MPI counts it; pieces are made to fit.
fn count(length: usize) -> i32 {
    i32::try_from(length).expect("a piece holds less than 2^31 values")
}

/// Where each part starts in a list of the parts.
fn starts(counts: &[i32]) -> Vec<i32> {
    let ends = counts.iter().scan(0, |end, &count| {
        *end += count;
        Some(*end)
    });
    ends.zip(counts).map(|(end, &count)| end - count).collect()
}

/// Length of a list of parts.
fn total(counts: &[i32]) -> usize {
    counts.iter().map(|&count| count as usize).sum()
}

/// The part of a list that belongs to the piece from `start` on.
fn section(length: usize, start: usize, piece: usize) -> Range<usize> {
    start.min(length)..start.saturating_add(piece).min(length)
}

/// Appends the parts of a list, of these lengths, to one list each.
fn append<T: Copy>(lists: &mut [Vec<T>], all: &[T], counts: &[i32]) {
    let mut rest = all;
    for (list, &count) in lists.iter_mut().zip(counts) {
        let (part, others) = rest.split_at(count as usize);
        list.extend_from_slice(part);
        rest = others;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_start_where_the_previous_ones_end() {
        assert_eq!(starts(&[2, 0, 3]), [0, 2, 2]);
        assert_eq!(total(&[2, 0, 3]), 5);
        let mut lists = [vec![0], vec![], vec![]];
        append(&mut lists, &[1, 2, 3, 4, 5], &[2, 0, 3]);
        assert_eq!(lists, [vec![0, 1, 2], vec![], vec![3, 4, 5]]);
    }

    #[test]
    fn pieces_cover_a_list() {
        let pieces: Vec<_> = (0..10).step_by(4).map(|start| section(7, start, 4)).collect();
        assert_eq!(pieces, [0..4, 4..7, 7..7]);
        assert_eq!(section(3, 8, usize::MAX), 3..3);
    }
}
