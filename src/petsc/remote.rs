//! Blocks of a matrix in rows of other ranks, on their way there.
//!
//! PETSc's own stash hands them over in the order of arrival; with its option `-matstash_reproduce` in the order in which
//! their lengths arrived. On three ranks and more, either gives sums that differ in the last digit from run to run. Here
//! they are added in the order of ranks, and each block travels once.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use petsc_sys::PetscInt;

use crate::parallel::World;

/// Blocks that one rank has for another.
#[derive(Clone, Debug, Default)]
struct Outgoing {
    /// Where in the lists a row and a column stand.
    places: HashMap<(PetscInt, PetscInt), usize>,
    /// Row and column of each block, in the order of their first use.
    keys: Vec<PetscInt>,
    /// The blocks, row-major.
    values: Vec<f64>,
}

/// Blocks for rows that this rank does not own.
#[derive(Clone, Debug)]
pub(super) struct RemoteBlocks {
    /// First block row of each rank, and the number of all block rows.
    starts: Vec<PetscInt>,
    rank: usize,
    /// Entries of a block.
    entries: usize,
    outgoing: Vec<Outgoing>,
}

impl RemoteBlocks {
    /// Collective. No blocks, for a matrix of which this rank owns so many block rows.
    pub(super) fn new(world: &World, owned_rows: PetscInt, block: usize) -> Self {
        let mut starts = vec![0];
        for rows in world.all_gather(owned_rows) {
            starts.push(starts[starts.len() - 1] + rows);
        }
        Self {
            starts,
            rank: world.rank(),
            entries: block * block,
            outgoing: vec![Outgoing::default(); world.size()],
        }
    }

    /// True for rows of this rank, and for those that PETSc skips or refuses.
    pub(super) fn is_local(&self, row: PetscInt) -> bool {
        let elsewhere = 0..self.starts[self.starts.len() - 1];
        let own = self.starts[self.rank]..self.starts[self.rank + 1];
        own.contains(&row) || !elsewhere.contains(&row)
    }

    /// Adds to a block of another rank, whose entries are given row by row.
    pub(super) fn add(&mut self, row: PetscInt, column: PetscInt, values: impl Iterator<Item = f64>) {
        let owner = self.starts.partition_point(|&start| start <= row) - 1;
        let Outgoing {
            places,
            keys,
            values: sums,
        } = &mut self.outgoing[owner];
        let place = match places.entry((row, column)) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                keys.extend([row, column]);
                sums.resize(sums.len() + self.entries, 0.0);
                *new.insert(sums.len() - self.entries)
            }
        };
        std::iter::zip(&mut sums[place..place + self.entries], values).for_each(|(sum, value)| *sum += value);
    }

    /// Collective. Hands the blocks over. What the other ranks had for this one: rows and columns in turn, and blocks, in
    /// the order of ranks.
    pub(super) fn exchange(&mut self, world: &World) -> Vec<(Vec<PetscInt>, Vec<f64>)> {
        let (mut keys, mut values) = (Vec::new(), Vec::new());
        for outgoing in &mut self.outgoing {
            outgoing.places.clear();
            keys.push(std::mem::take(&mut outgoing.keys));
            values.push(std::mem::take(&mut outgoing.values));
        }
        std::iter::zip(world.exchange(&keys), world.exchange(&values)).collect()
    }
}
