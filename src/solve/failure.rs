//! Why an attempt at a step failed, and where: what decides about the next attempt, and what a diagnosis starts from.

use super::equilibrium::Equilibrium;
use crate::continuum::Fields;
use crate::parallel::World;

/// Why an attempt failed; the same on every rank.
#[derive(Clone, Debug)]
pub struct Failure {
    /// In words, for a line on the screen.
    pub reason: String,
    pub cause: Cause,
    /// Whether another line search might do better.
    pub search_matters: bool,
    /// Whether a linear system was not solved.
    pub linear: bool,
    /// Whether a smaller step might do better.
    pub smaller_might_do: bool,
    /// Whether the step was opened with points that flow on, and not with the tangent of its residual.
    pub flowed_on: bool,
}

/// What lies behind a failure, as far as it is known.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// The motion of a point, or the response of its law, does not exist.
    Point(FailedPoint),
    /// The limit of iterations was reached.
    IterationLimit {
        /// Whether the residual was still falling.
        falling: bool,
        /// Least relative residual of the attempt [-].
        residual: f64,
        node: Option<WorstNode>,
    },
    /// The iteration found no way on, although its linear systems were solved.
    Divergence {
        /// Least relative residual of the attempt [-].
        residual: f64,
        node: Option<WorstNode>,
    },
    /// The residual stayed where it was, above the tolerance and above round-off.
    Stagnation {
        /// Its relative size [-].
        residual: f64,
        node: Option<WorstNode>,
    },
    /// The tangent is singular.
    Singular,
    Other,
}

impl Cause {
    /// Where the residual is worst, if that is known.
    pub fn node(&self) -> Option<&WorstNode> {
        match self {
            Cause::IterationLimit { node, .. } | Cause::Divergence { node, .. } | Cause::Stagnation { node, .. } => {
                node.as_ref()
            }
            Cause::Point(_) | Cause::Singular | Cause::Other => None,
        }
    }
}

/// Where the residual is the farthest above its round-off.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstNode {
    /// Node or platen, component and size of the residual, in words.
    pub description: String,
    /// Place of the node [m], the third coordinate zero in the plane; `None` for a platen.
    pub position: Option<[f64; 3]>,
}

impl Failure {
    /// A failure that no line search and no linear solver would mend.
    pub(super) fn plain(reason: String) -> Self {
        Self {
            reason,
            cause: Cause::Other,
            search_matters: false,
            linear: false,
            smaller_might_do: true,
            flowed_on: false,
        }
    }

    /// The same with what lies behind it.
    pub(super) fn because(self, cause: Cause) -> Self {
        Self { cause, ..self }
    }

    /// A failure at a point, if one is to blame.
    pub(super) fn at(point: Option<FailedPoint>) -> Self {
        match point {
            Some(point) => Self {
                cause: Cause::Point(point.clone()),
                ..Self::plain(point.to_string())
            },
            None => Self::plain("a point left the domain of its law during the iteration".into()),
        }
    }
}

/// A point without an answer.
#[derive(Clone, Debug, PartialEq)]
pub struct FailedPoint {
    pub id: u64,
    /// What the law says, or how the motion is impossible.
    pub what: String,
    /// Norm of the residual where the law's own iteration ended [-]; `None` where the motion is impossible.
    pub residual: Option<f64>,
    /// Norm of the gradient that the increments of the step have at the point [-].
    pub gradient: f64,
}

impl std::fmt::Display for FailedPoint {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "point {}: {}", self.id, self.what)?;
        match self.residual {
            Some(residual) => write!(out, " (local residual {residual:.1e})"),
            None => Ok(()),
        }
    }
}

impl FailedPoint {
    /// Collective. The first point that failed in the last evaluation, in the order in which one rank would find them.
    pub(super) fn first<C: Fields<D, N>, const D: usize, const N: usize>(
        problem: &Equilibrium<'_, C, D, N>,
    ) -> Option<Self> {
        let world = problem.world;
        let place = problem.failure.as_ref().map(|failure| order(problem, failure.id));
        let rank = first_rank(world, place)?;
        let own = problem.failure.as_ref().filter(|_| rank == world.rank());
        let text = world.text_from(rank, own.map_or("", |failure| failure.what));
        let mut numbers = own.map_or([0.0; 2], |failure| {
            [failure.residual.unwrap_or(f64::INFINITY), failure.gradient]
        });
        world.sum_slice(&mut numbers);
        Some(Self {
            id: world.sum(own.map_or(0, |failure| failure.id)),
            what: text,
            residual: (numbers[0] < f64::INFINITY).then_some(numbers[0]),
            gradient: numbers[1],
        })
    }
}

/// Place of an own point in the order of evaluation: by its nodes, then material, then number.
fn order<C: Fields<D, N>, const D: usize, const N: usize>(problem: &Equilibrium<'_, C, D, N>, id: u64) -> [u64; 4] {
    let points = &problem.model.points;
    let p = points
        .id
        .iter()
        .position(|&own| own == id)
        .expect("an own point failed");
    let batches = &problem.system.batches.batches;
    let batch = batches.iter().find(|batch| batch.points.contains(&p));
    let support = batch.expect("every point is in a batch").support;
    let lowest = problem.model.grid.node_key(&support.lowest.map(|index| index as usize));
    let count = support.count.iter().fold(0, |sum, &count| 256 * sum + count as u64);
    [lowest, count, u64::from(points.material[p]), id]
}

/// Collective. The rank whose key is the lowest, if one has a key.
fn first_rank(world: &World, own: Option<[u64; 4]>) -> Option<usize> {
    let mut candidate = own.is_some();
    for entry in own.unwrap_or([u64::MAX; 4]) {
        let least = world.min_of(if candidate { entry } else { u64::MAX });
        candidate &= entry == least;
    }
    world.first_where(candidate)
}
