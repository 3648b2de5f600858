//! The unknowns of a step: active nodes, their numbering over the ranks, and the sparsity of the tangent.

use crate::condition::weak::platen_of;
use crate::grid::ghost::GhostFaces;
use crate::grid::{Grid, Support};
use crate::parallel::{Numbered, Numbering, World};
use crate::points::search::Batches;

/// Active nodes as one rank sees them: its own first, sorted by key, then those of other ranks by global number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Active {
    /// Keys of the local nodes.
    pub nodes: Vec<u64>,
    /// Global number of each local node.
    pub global: Vec<usize>,
    /// How many of the local nodes this rank owns.
    pub owned: usize,
    /// Global number of the first own node.
    pub first: usize,
    /// Nodes on all ranks.
    pub total: usize,
    /// Local nodes of each batch and, behind them, of each penalised face.
    cliques: Cliques,
    batches: usize,
    /// Local platens, by boundary, with whether the matrix has a place for them.
    platens: Vec<Platen>,
    /// For each own row the number of blocks in own columns and in columns of other ranks.
    pub own_blocks: Vec<usize>,
    pub other_blocks: Vec<usize>,
    /// Own rows of the block pattern, flattened: the pattern stands while these and the numbering do.
    columns: Vec<usize>,
}

/// A platen among the local nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Platen {
    boundary: usize,
    node: u32,
    coupled: bool,
}

/// Platens that this rank's points are tied to: nodes that belong to no place of the grid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Platens {
    /// Key of each, sorted, with the batches that the platen is an unknown of: none where all its motions are prescribed.
    pub batches: Vec<(u64, Vec<usize>)>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Cliques {
    nodes: Vec<u32>,
    ends: Vec<usize>,
}

impl Cliques {
    fn get(&self, index: usize) -> &[u32] {
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        &self.nodes[start..self.ends[index]]
    }

    /// Couples platens with the nodes of their batches, and each with itself. Returns the local platens.
    fn add_platens(&mut self, platens: &Platens, keys: &[u64], local: &[u32]) -> Vec<Platen> {
        let mut found = Vec::new();
        for (key, batches) in &platens.batches {
            let node = local[keys.binary_search(key).expect("platens are among the keys")];
            for &batch in batches {
                let nodes = self.get(batch).to_vec();
                self.nodes.extend(nodes);
                self.nodes.push(node);
                self.ends.push(self.nodes.len());
            }
            self.nodes.push(node);
            self.ends.push(self.nodes.len());
            found.push(Platen {
                boundary: platen_of(*key).expect("a platen's key"),
                node,
                coupled: !batches.is_empty(),
            });
        }
        found
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.ends.len()).map(|index| self.get(index))
    }
}

/// The nodes seen by points or penalised faces, and platens, numbered over the ranks; which of them are coupled is open.
pub struct ActiveNodes {
    /// Keys of the nodes that this rank sees, sorted.
    keys: Vec<u64>,
    numbering: Numbering,
}

impl ActiveNodes {
    /// Collective. Finds and numbers the nodes.
    pub fn new<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        batches: &Batches<D>,
        ghost: &GhostFaces<D>,
        platens: &Platens,
    ) -> Self {
        let mut keys = Vec::new();
        supports(batches, ghost).for_each(|support| support.for_each_node(|node| keys.push(grid.node_key(node))));
        keys.extend(platens.batches.iter().map(|&(key, _)| key));
        keys.sort_unstable();
        keys.dedup();
        let numbering = Numbering::new(world, &keys);
        Self { keys, numbering }
    }

    /// Keys of the nodes that this rank sees, sorted.
    pub fn keys(&self) -> &[u64] {
        &self.keys
    }

    /// Keys of the nodes that this rank owns, sorted.
    pub fn own(&self) -> &[u64] {
        self.numbering.own()
    }

    /// Collective. Owner of each node that this rank sees.
    pub fn owners(&self, world: &World) -> Vec<usize> {
        let numbered = self.numbering.look_up(world, &self.keys).into_iter();
        numbered
            .map(|found| found.expect("own keys are numbered").owner)
            .collect()
    }

    /// Nodes on all ranks.
    pub fn total(&self) -> usize {
        self.numbering.total
    }
}

/// Supports of batches and, behind them, of penalised faces.
fn supports<const D: usize>(batches: &Batches<D>, ghost: &GhostFaces<D>) -> impl Iterator<Item = Support<D>> {
    let of_batches = batches.batches.iter().map(|batch| batch.support);
    of_batches.chain(ghost.faces.iter().map(|face| face.support))
}

impl Active {
    /// Collective. Finds which of the active nodes are coupled.
    pub fn new<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        batches: &Batches<D>,
        ghost: &GhostFaces<D>,
        platens: &Platens,
        active: ActiveNodes,
    ) -> Self {
        let ActiveNodes { keys, numbering } = active;
        let numbered: Vec<Numbered> = numbering
            .look_up(world, &keys)
            .into_iter()
            .map(|found| found.expect("own keys are numbered"))
            .collect();
        let mut order: Vec<usize> = (0..keys.len()).collect();
        order.sort_by_key(|&k| (numbered[k].owner != world.rank(), numbered[k].number));
        let nodes: Vec<u64> = order.iter().map(|&k| keys[k]).collect();
        let global: Vec<usize> = order.iter().map(|&k| numbered[k].number).collect();
        let owners: Vec<usize> = order.iter().map(|&k| numbered[k].owner).collect();
        let mut local = vec![0; keys.len()];
        order
            .iter()
            .enumerate()
            .for_each(|(position, &k)| local[k] = position as u32);
        let mut cliques = cliques(grid, supports(batches, ghost), &keys, &local);
        let platens = cliques.add_platens(platens, &keys, &local);
        let rows = block_rows(world, &cliques, &global, &owners, numbering.first, numbering.owned());
        let own = |column: &&usize| (numbering.first..numbering.first + numbering.owned()).contains(column);
        let own_blocks: Vec<usize> = rows.iter().map(|row| row.iter().filter(own).count()).collect();
        let other_blocks = rows.iter().zip(&own_blocks).map(|(row, own)| row.len() - own).collect();
        Self {
            nodes,
            global,
            owned: numbering.owned(),
            first: numbering.first,
            total: numbering.total,
            cliques,
            batches: batches.batches.len(),
            platens,
            own_blocks,
            other_blocks,
            columns: rows.into_iter().flatten().collect(),
        }
    }

    /// Local nodes of a batch, in the order of its support.
    pub fn batch_nodes(&self, batch: usize) -> &[u32] {
        self.cliques.get(batch)
    }

    /// Local nodes of a penalised face.
    pub fn face_nodes(&self, face: usize) -> &[u32] {
        self.cliques.get(self.batches + face)
    }

    /// Local node of the platen of a boundary, where points of this rank are tied to it.
    pub fn platen(&self, boundary: usize) -> Option<u32> {
        let platen = self.platens.iter().find(|platen| platen.boundary == boundary);
        platen.map(|platen| platen.node)
    }

    /// Whether a local node has no place in the matrix but its diagonal: a platen whose motions are all prescribed.
    pub fn is_detached(&self, node: u32) -> bool {
        self.platens.iter().any(|platen| platen.node == node && !platen.coupled)
    }

    /// Whether a matrix made for `other` serves here too, on this rank.
    pub fn has_pattern_of(&self, other: &Self) -> bool {
        self.global == other.global
            && self.nodes == other.nodes
            && self.owned == other.owned
            && self.own_blocks == other.own_blocks
            && self.columns == other.columns
    }
}

/// Local nodes of each support.
fn cliques<const D: usize>(
    grid: &Grid<D>,
    supports: impl Iterator<Item = Support<D>>,
    keys: &[u64],
    local: &[u32],
) -> Cliques {
    let mut cliques = Cliques::default();
    for support in supports {
        support.for_each_node(|node| {
            let position = keys
                .binary_search(&grid.node_key(node))
                .expect("nodes of supports are active");
            cliques.nodes.push(local[position]);
        });
        cliques.ends.push(cliques.nodes.len());
    }
    cliques
}

/// Columns coupled to each own row, sorted. Couplings of rows that other ranks own are sent to them.
fn block_rows(
    world: &World,
    cliques: &Cliques,
    global: &[usize],
    owners: &[usize],
    first: usize,
    owned: usize,
) -> Vec<Vec<usize>> {
    let mut coupled: Vec<Vec<usize>> = vec![Vec::new(); global.len()];
    let mut previous: &[u32] = &[];
    for nodes in cliques.iter() {
        // Neighbouring batches of different materials share a support; faces never repeat.
        if nodes == previous {
            continue;
        }
        previous = nodes;
        for &row in nodes {
            let row = &mut coupled[row as usize];
            row.extend(nodes.iter().map(|&column| global[column as usize]));
            if row.len() > 4096 {
                row.sort_unstable();
                row.dedup();
            }
        }
    }
    for row in &mut coupled {
        row.sort_unstable();
        row.dedup();
    }
    let mut outgoing = vec![Vec::new(); world.size()];
    for local in owned..global.len() {
        let record = &mut outgoing[owners[local]];
        record.push(global[local] as u64);
        record.push(coupled[local].len() as u64);
        record.extend(coupled[local].iter().map(|&column| column as u64));
    }
    coupled.truncate(owned);
    for record in world.exchange(&outgoing) {
        let mut rest = record.as_slice();
        while let [row, length, tail @ ..] = rest {
            let (columns, later) = tail.split_at(*length as usize);
            coupled[*row as usize - first].extend(columns.iter().map(|&column| column as usize));
            rest = later;
        }
    }
    for row in &mut coupled {
        row.sort_unstable();
        row.dedup();
    }
    coupled
}
