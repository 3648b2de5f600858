//! Who owns what: a distributed table from keys (of nodes or cells) to ranks and numbers.
//!
//! Every key has a home rank, found by hashing; claims are sent there, the home decides, and anyone may ask it. No rank
//! ever holds the whole table.

use super::World;

/// Owners of claimed keys, spread over the ranks.
pub struct Directory {
    /// Keys at home on this rank with their owners, sorted by key.
    entries: Vec<(u64, u32)>,
}

fn home(key: u64, ranks: usize) -> usize {
    ((key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) % ranks as u64) as usize
}

/// Sends records to the ranks given for them. Returns what each rank sent here.
fn send<const W: usize>(world: &World, records: impl Iterator<Item = (usize, [u64; W])>) -> Vec<Vec<u64>> {
    let mut outgoing = vec![Vec::new(); world.size()];
    for (destination, record) in records {
        outgoing[destination].extend_from_slice(&record);
    }
    world.exchange(&outgoing)
}

/// Asks each key's question of the rank given for it; `answer` runs on the rank asked. Answers come in the order of the
/// questions, negative ones as `None`.
fn ask(world: &World, questions: &[(usize, u64)], answer: impl Fn(u64) -> i64) -> Vec<Option<usize>> {
    let asked = send(world, questions.iter().map(|&(rank, key)| (rank, [key])));
    let replies: Vec<Vec<i64>> = asked
        .iter()
        .map(|keys| keys.iter().map(|&key| answer(key)).collect())
        .collect();
    let answers = world.exchange(&replies);
    let mut next = vec![0; world.size()];
    questions
        .iter()
        .map(|&(rank, _)| {
            next[rank] += 1;
            usize::try_from(answers[rank][next[rank] - 1]).ok()
        })
        .collect()
}

impl Directory {
    /// Collective. Each rank claims keys with a weight; the heaviest claim wins a key, the lowest rank among equals.
    pub fn build(world: &World, claims: impl Iterator<Item = (u64, u64)>) -> Self {
        let received = send(
            world,
            claims.map(|(key, weight)| (home(key, world.size()), [key, weight])),
        );
        let mut entries: Vec<(u64, u64, u32)> = Vec::new();
        for (rank, pairs) in received.iter().enumerate() {
            entries.extend(pairs.chunks_exact(2).map(|pair| (pair[0], pair[1], rank as u32)));
        }
        entries.sort_unstable_by_key(|&(key, weight, rank)| (key, std::cmp::Reverse(weight), rank));
        entries.dedup_by_key(|entry| entry.0);
        Self {
            entries: entries.into_iter().map(|(key, _, rank)| (key, rank)).collect(),
        }
    }

    /// Collective. Owner of each key, `None` where nobody claimed it.
    pub fn owners(&self, world: &World, keys: &[u64]) -> Vec<Option<usize>> {
        let questions: Vec<_> = keys.iter().map(|&key| (home(key, world.size()), key)).collect();
        ask(world, &questions, |key| {
            match self.entries.binary_search_by_key(&key, |entry| entry.0) {
                Ok(position) => i64::from(self.entries[position].1),
                Err(_) => -1,
            }
        })
    }
}

/// A numbering of keys that several ranks may use: each key has one owner, each rank's own keys follow one another.
pub struct Numbering {
    directory: Directory,
    /// Keys that this rank owns, sorted.
    own: Vec<u64>,
    /// Number of the first own key.
    pub first: usize,
    /// How many keys there are on all ranks.
    pub total: usize,
}

/// Owner and number of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Numbered {
    pub owner: usize,
    pub number: usize,
}

impl Numbering {
    /// Collective. Numbers sorted, distinct keys; a key belongs to the lowest rank that uses it.
    pub fn new(world: &World, keys: &[u64]) -> Self {
        let directory = Directory::build(world, keys.iter().map(|&key| (key, 0)));
        let owners = directory.owners(world, keys);
        let own: Vec<u64> = keys
            .iter()
            .zip(&owners)
            .filter(|&(_, &owner)| owner == Some(world.rank()))
            .map(|(&key, _)| key)
            .collect();
        let counts = world.all_gather(own.len());
        let first = counts[..world.rank()].iter().sum();
        Self {
            directory,
            own,
            first,
            total: counts.iter().sum(),
        }
    }

    /// Keys that this rank owns, sorted.
    pub fn own(&self) -> &[u64] {
        &self.own
    }

    /// How many keys this rank owns.
    pub fn owned(&self) -> usize {
        self.own.len()
    }

    /// Collective. Owner and number of each key, `None` where it has none.
    pub fn look_up(&self, world: &World, keys: &[u64]) -> Vec<Option<Numbered>> {
        let owners = self.directory.owners(world, keys);
        let questions: Vec<_> = keys
            .iter()
            .zip(&owners)
            .filter_map(|(&key, owner)| owner.map(|owner| (owner, key)))
            .collect();
        let numbers = ask(world, &questions, |key| match self.own.binary_search(&key) {
            Ok(position) => (self.first + position) as i64,
            Err(_) => -1,
        });
        let mut numbers = numbers.into_iter();
        owners
            .into_iter()
            .map(|owner| {
                let owner = owner?;
                let number = numbers.next().flatten().expect("an owner knows its keys");
                Some(Numbered { owner, number })
            })
            .collect()
    }
}
