//! A nonlinear problem with three unknowns a node on a square lattice, with a known domain.
//!
//! For component c: −Δu_c + u_c³ + 0.3 (u_c − u_{c+1}) = load, u = 0 on the boundary. The Laplacian is summed over
//! edges, each by the rank that owns its lower node, so that residuals and matrix rows of other ranks are added to.

use std::collections::BTreeMap;

use mpm_petsc::parallel::World;
use mpm_petsc::petsc::{BlockMatrix, Evaluate, Iteration, Layout, MatrixFormat, Nonlinear, PetscInt, Session, Verdict};
use std::rc::Rc;

pub const BLOCK: usize = 3;

/// A square lattice of `side` × `side` nodes in row-major order, dealt to ranks in pieces that differ by one node.
#[derive(Clone)]
pub struct Lattice {
    pub side: usize,
    pub first: usize,
    pub owned: usize,
    ghosts: Vec<usize>,
    local: BTreeMap<usize, usize>,
}

impl Lattice {
    pub fn new(world: &World, side: usize) -> Self {
        Self::on_first_ranks(world, side, world.size())
    }

    /// The same on the first `ranks` ranks; the others own nothing.
    pub fn on_first_ranks(world: &World, side: usize, ranks: usize) -> Self {
        let (nodes, rank) = (side * side, world.rank());
        let start = |rank: usize| nodes * rank.min(ranks) / ranks;
        let first = start(rank);
        let owned = start(rank + 1) - first;
        let mut lattice = Lattice {
            side,
            first,
            owned,
            ghosts: Vec::new(),
            local: BTreeMap::new(),
        };
        let mut ghosts: Vec<usize> = lattice.range().flat_map(|node| lattice.neighbours(node)).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        ghosts.retain(|node| !lattice.range().contains(node));
        lattice.local = lattice
            .range()
            .chain(ghosts.iter().copied())
            .enumerate()
            .map(|(i, node)| (node, i))
            .collect();
        lattice.ghosts = ghosts;
        lattice
    }

    pub fn range(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.owned
    }

    pub fn neighbours(&self, node: usize) -> Vec<usize> {
        let (row, column) = (node / self.side, node % self.side);
        let mut neighbours = Vec::new();
        if row > 0 {
            neighbours.push(node - self.side);
        }
        if column > 0 {
            neighbours.push(node - 1);
        }
        if column + 1 < self.side {
            neighbours.push(node + 1);
        }
        if row + 1 < self.side {
            neighbours.push(node + self.side);
        }
        neighbours
    }

    pub fn on_boundary(&self, node: usize) -> bool {
        let (row, column) = (node / self.side, node % self.side);
        row == 0 || column == 0 || row + 1 == self.side || column + 1 == self.side
    }

    pub fn layout(&self) -> Layout {
        let ghosts = self.ghosts.iter().map(|&node| node as PetscInt).collect();
        Layout {
            block: BLOCK,
            owned: self.owned,
            first: self.first,
            ghosts,
        }
    }

    pub fn matrix(&self, session: &Rc<Session>, format: MatrixFormat) -> BlockMatrix {
        let own = |node: &usize| self.range().contains(node);
        let count = |keep: bool| -> Vec<PetscInt> {
            let blocks = |node: usize| self.neighbours(node).iter().filter(|other| own(other) == keep).count();
            self.range()
                .map(|node| (blocks(node) + usize::from(keep)) as PetscInt)
                .collect()
        };
        BlockMatrix::new(session, format, BLOCK, self.owned, &count(true), &count(false)).expect("a matrix")
    }
}

/// The problem, and what its solution went through.
pub struct Poisson {
    pub lattice: Lattice,
    pub load: f64,
    /// The problem exists only where every component is below this value.
    pub ceiling: f64,
    pub tolerance: f64,
    pub norms: Vec<f64>,
    pub updates_seen: usize,
    pub evaluations: usize,
}

impl Poisson {
    pub fn new(lattice: Lattice) -> Self {
        Poisson {
            lattice,
            load: 40.0,
            ceiling: f64::INFINITY,
            tolerance: 1e-9,
            norms: Vec::new(),
            updates_seen: 0,
            evaluations: 0,
        }
    }

    fn at(&self, node: usize) -> usize {
        BLOCK * self.lattice.local[&node]
    }

    /// Edges from owned nodes to later ones.
    fn edges(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let later = |node: usize| {
            self.lattice
                .neighbours(node)
                .into_iter()
                .filter(move |&other| other > node)
        };
        self.lattice
            .range()
            .flat_map(move |node| later(node).map(move |other| (node, other)))
    }

    /// A node as a matrix row: negative, and so left out, on the boundary.
    fn row(&self, node: usize) -> PetscInt {
        if self.lattice.on_boundary(node) {
            -1
        } else {
            node as PetscInt
        }
    }

    fn stiffness(&self) -> f64 {
        ((self.lattice.side - 1) * (self.lattice.side - 1)) as f64
    }
}

impl Nonlinear for Poisson {
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Evaluate> {
        assert!(
            u.iter().all(|value| value.is_finite()),
            "never evaluated at NaN or infinity"
        );
        self.evaluations += 1;
        for (one, other) in self.edges() {
            let (one, other) = (self.at(one), self.at(other));
            for c in 0..BLOCK {
                let flow = self.stiffness() * (u[one + c] - u[other + c]);
                r[one + c] += flow;
                r[other + c] -= flow;
            }
        }
        for node in self.lattice.range() {
            let at = self.at(node);
            for c in 0..BLOCK {
                let value = u[at + c];
                r[at + c] += value.powi(3) + 0.3 * (value - u[at + (c + 1) % BLOCK]) - self.load * (c + 1) as f64;
            }
        }
        let owned = &u[..BLOCK * self.lattice.owned];
        if owned.iter().any(|&value| value > self.ceiling) {
            Err(Evaluate::OutOfDomain)
        } else {
            Ok(())
        }
    }

    fn complete(&mut self, r: &mut [f64]) -> Result<(), Evaluate> {
        for node in self.lattice.range().filter(|&node| self.lattice.on_boundary(node)) {
            r[self.at(node)..][..BLOCK].fill(0.0);
        }
        Ok(())
    }

    fn jacobian(&mut self, u: &[f64], k: &mut BlockMatrix) -> Result<(), Evaluate> {
        let stiffness = self.stiffness();
        for (one, other) in self.edges() {
            let nodes = [self.row(one), self.row(other)];
            let mut values = [0.0; 4 * BLOCK * BLOCK];
            for i in 0..2 * BLOCK {
                values[i * 2 * BLOCK + i] = stiffness;
                values[i * 2 * BLOCK + (i + BLOCK) % (2 * BLOCK)] = -stiffness;
            }
            k.add_blocks(&nodes, &nodes, &values)?;
        }
        for node in self.lattice.range() {
            let (at, row) = (self.at(node), [self.row(node)]);
            let mut values = [0.0; BLOCK * BLOCK];
            for c in 0..BLOCK {
                values[c * BLOCK + c] = 3.0 * u[at + c].powi(2) + 0.3;
                values[c * BLOCK + (c + 1) % BLOCK] = -0.3;
            }
            k.add_blocks(&row, &row, &values)?;
            if self.lattice.on_boundary(node) {
                for c in 0..BLOCK {
                    k.add_diagonal(node as PetscInt, c, 1.0)?;
                }
            }
        }
        Ok(())
    }

    fn test(&mut self, iteration: &Iteration<'_>) -> Verdict {
        assert_eq!(iteration.number, self.norms.len());
        assert_eq!(iteration.residual.len(), BLOCK * self.lattice.owned);
        self.updates_seen += usize::from(iteration.update.is_some());
        self.norms.push(iteration.residual_norm);
        if iteration.residual_norm < self.tolerance {
            Verdict::Converged
        } else {
            Verdict::Continue
        }
    }
}
