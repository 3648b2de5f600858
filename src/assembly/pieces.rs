//! Connected pieces of the body: points that the grid joins, because the same nodes see them.
//!
//! Bodies that share a node move together there, so that several may be one piece; a body whose parts lie too far apart
//! for the functions of the grid is several.

use super::active::ActiveNodes;
use crate::grid::{Grid, Support};
use crate::parallel::World;
use crate::points::search::Batches;

/// Which piece each point and node belongs to; pieces are numbered alike on every rank, and on any number of ranks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pieces {
    /// Piece of each point of this rank.
    pub of_point: Vec<usize>,
    /// Piece of each node that this rank owns, in the order of [`ActiveNodes::own`].
    pub of_own_node: Vec<usize>,
    /// Number of pieces on all ranks.
    pub count: usize,
}

impl Pieces {
    /// Collective. Finds the pieces; the points, with these numbers, are sorted into the batches.
    pub fn find<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        batches: &Batches<D>,
        nodes: &ActiveNodes,
        ids: &[u64],
    ) -> Self {
        let keys = nodes.keys();
        let mut local = DisjointSets::new(keys.len());
        let firsts: Vec<usize> = batches
            .batches
            .iter()
            .map(|batch| join_support(grid, &batch.support, keys, &mut local))
            .collect();
        let (labels, here) = local.labels();
        let (first, edges) = shared_nodes(world, nodes, &labels, here);
        let total = world.sum(here);
        let mut global = DisjointSets::new(total);
        for edge in edges.chunks_exact(2) {
            global.join(edge[0] as usize, edge[1] as usize);
        }
        let (of_label, count) = global.labels();
        let piece_of = |node: usize| of_label[first + labels[node]];
        let mut of_point = vec![0; ids.len()];
        for (batch, &node) in batches.batches.iter().zip(&firsts) {
            of_point[batch.points.clone()].fill(piece_of(node));
        }
        let own = nodes.own().iter();
        let of_own_node = own
            .map(|key| piece_of(keys.binary_search(key).expect("own nodes are among those seen")))
            .collect();
        let mut pieces = Self {
            of_point,
            of_own_node,
            count,
        };
        pieces.renumber(world, ids);
        pieces
    }

    /// Numbers the pieces by the lowest number of their points, and drops what holds no point: platens.
    fn renumber(&mut self, world: &World, ids: &[u64]) {
        let mut lowest = vec![u64::MAX; self.count];
        for (&piece, &id) in self.of_point.iter().zip(ids) {
            lowest[piece] = lowest[piece].min(id);
        }
        world.min_slice(&mut lowest);
        let mut order: Vec<usize> = (0..self.count).collect();
        order.sort_by_key(|&piece| lowest[piece]);
        let mut number = vec![0; self.count];
        for (new, &old) in order.iter().enumerate() {
            number[old] = new;
        }
        let all = self.of_point.iter_mut().chain(&mut self.of_own_node);
        all.for_each(|piece| *piece = number[*piece]);
        self.count = lowest.iter().filter(|&&id| id != u64::MAX).count();
    }
}

/// Joins the nodes of a support; returns the place of the first among the sorted keys.
fn join_support<const D: usize>(grid: &Grid<D>, support: &Support<D>, keys: &[u64], sets: &mut DisjointSets) -> usize {
    let mut first = None;
    support.for_each_node(|node| {
        // Along the first axis keys follow one another, and all of a support are active.
        if node[0] > support.lowest[0] as usize {
            return;
        }
        let start = keys
            .binary_search(&grid.node_key(node))
            .expect("nodes of supports are active");
        let first = *first.get_or_insert(start);
        (start..start + support.count[0] as usize).for_each(|place| sets.join(first, place));
    });
    first.expect("a support has nodes")
}

/// Collective. Number of this rank's first piece among those of all ranks, and pairs of pieces on different ranks that
/// share a node: the same pairs on every rank.
fn shared_nodes(world: &World, nodes: &ActiveNodes, labels: &[usize], here: usize) -> (usize, Vec<u64>) {
    if world.size() == 1 {
        return (0, Vec::new());
    }
    let first = world.exclusive_scan(here);
    let keys = nodes.keys();
    let mut outgoing = vec![Vec::new(); world.size()];
    for ((key, owner), label) in keys.iter().zip(nodes.owners(world)).zip(labels) {
        if owner != world.rank() {
            outgoing[owner].extend([*key, (first + label) as u64]);
        }
    }
    let received = world.exchange(&outgoing).concat();
    let pair = |claim: &[u64]| {
        let place = keys.binary_search(&claim[0]).expect("an owner sees its nodes");
        [(first + labels[place]) as u64, claim[1]]
    };
    let mut pairs: Vec<[u64; 2]> = received.chunks_exact(2).map(pair).collect();
    pairs.sort_unstable();
    pairs.dedup();
    (first, world.concatenate(&pairs.concat()))
}

/// Sets of numbers that are joined pair by pair.
struct DisjointSets {
    parents: Vec<usize>,
}

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count).collect(),
        }
    }

    fn root(&mut self, mut member: usize) -> usize {
        while self.parents[member] != member {
            // Halving the way keeps ways short.
            self.parents[member] = self.parents[self.parents[member]];
            member = self.parents[member];
        }
        member
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.root(one), self.root(other));
        self.parents[one.max(other)] = one.min(other);
    }

    /// Number of the set of each member, in the order of their lowest members, and how many there are.
    fn labels(mut self) -> (Vec<usize>, usize) {
        let mut labels = vec![0; self.parents.len()];
        let mut count = 0;
        for member in 0..labels.len() {
            let root = self.root(member);
            if root == member {
                labels[member] = count;
                count += 1;
            } else {
                labels[member] = labels[root];
            }
        }
        (labels, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_members_have_one_label() {
        let mut sets = DisjointSets::new(7);
        for (one, other) in [(5, 2), (6, 3), (2, 6), (4, 4)] {
            sets.join(one, other);
        }
        assert_eq!(sets.labels(), (vec![0, 1, 2, 2, 3, 2, 2], 4));
    }
}
