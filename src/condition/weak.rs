//! Conditions on material points, held by a penalty (N 31): a support that need not lie on nodes of the grid.
//!
//! Every such condition stands for a *platen*: a rigid support without rotation, whose motions are either prescribed or
//! unknown. Springs of stiffness `k` [N/m, N m/rad], one a point and component, tie the points to it:
//!
//! $$ f_{pa} = k\,g_{pa}, \qquad g_{pa} = \tilde g_{pa} + \sum_I S_I(x_p)\,\Delta u_{Ia} - \Delta q_a $$
//!
//! with the gap `g`, its value at the start of the step, and the increment `q` of the platen. A motion that is unknown
//! has no force, so that the platen follows the mean of its points. The platen is a node of its own in the system, so
//! that prescribed motions, reactions and parallel sums are those of nodes. docs/theory.md, "Weak conditions".

use super::Time;
use super::dirichlet::{Boundary, Component, Place, Prescribed};
use crate::points::select::Selection;

/// Points that a condition holds, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    pub selection: Selection,
    /// Stiffness of the spring of a point [N/m, N m/rad], > 0.
    pub penalty: f64,
    /// Translations in which the platen moves freely.
    pub free: Vec<Component>,
    pub measure: Measure,
}

/// What the penalty acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The motion since the condition began: N 31.
    Total,
    /// The motion of the step alone; the force of earlier steps is forgotten.
    Increment,
}

/// One component of the points of one selection, tied to a platen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// Entry of the list of boundaries that it comes from: the number of the platen.
    pub boundary: usize,
    /// Mark of the points.
    pub bit: usize,
    /// Place of the gap among those of a point. Ties of one selection and component share it, so that a later one takes
    /// over the force of the earlier.
    pub slot: usize,
    pub component: Component,
    /// Stage from which it acts.
    pub stage: usize,
    pub penalty: f64,
    pub goal: Goal,
    pub measure: Measure,
}

/// Where a platen goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Total of the motion, ramped over the stage [m, rad].
    Prescribed(f64),
    Free,
}

impl Tie {
    /// The gap at the start of a step, as far as it counts.
    pub fn remembered(&self, gap: f64) -> f64 {
        match self.measure {
            Measure::Total => gap,
            Measure::Increment => 0.0,
        }
    }
}

/// Keys from here on are platens, by the number of their boundary; those below are nodes of the grid or mesh.
const FIRST_PLATEN: u64 = 1 << 63;

/// Key of the platen of a boundary among the nodes.
pub fn platen_key(boundary: usize) -> u64 {
    FIRST_PLATEN | boundary as u64
}

/// Boundary whose platen a key is; `None` for nodes of grid or mesh.
pub fn platen_of(key: u64) -> Option<usize> {
    (key >= FIRST_PLATEN).then_some((key & !FIRST_PLATEN) as usize)
}

/// Ties of all boundaries on points; `bit_of` gives the mark of the points of a boundary.
pub fn ties(boundaries: &[Boundary], bit_of: impl Fn(usize) -> usize) -> Vec<Tie> {
    let mut slots: Vec<(usize, Component)> = Vec::new();
    let mut ties = Vec::new();
    for (index, boundary) in boundaries.iter().enumerate() {
        let Place::Points(held) = &boundary.place else { continue };
        let bit = bit_of(index);
        let fixed = boundary.fix.iter().map(|&component| (component, Goal::Prescribed(0.0)));
        let moved = boundary
            .moves
            .iter()
            .map(|&(component, total)| (component, Goal::Prescribed(total)));
        let free = held.free.iter().map(|&component| (component, Goal::Free));
        for (component, goal) in fixed.chain(moved).chain(free) {
            let known = slots.iter().position(|&slot| slot == (bit, component));
            let slot = known.unwrap_or_else(|| {
                slots.push((bit, component));
                slots.len() - 1
            });
            ties.push(Tie {
                boundary: index,
                bit,
                slot,
                component,
                stage: boundary.stage,
                penalty: held.penalty,
                goal,
                measure: held.measure,
            });
        }
    }
    ties
}

/// Number of gaps that a point keeps for these ties.
pub fn slots(ties: &[Tie]) -> usize {
    ties.iter().map(|tie| tie.slot + 1).max().unwrap_or(0)
}

/// Ties that act in a stage, by boundary: of several on one selection and component the latest, by stage and then by
/// place in the list.
pub fn acting(ties: &[Tie], stage: usize) -> Vec<Tie> {
    let began = |tie: &&Tie| tie.stage <= stage;
    let replaced = |index: usize, tie: &Tie| {
        let later = ties
            .iter()
            .enumerate()
            .filter(|(_, other)| began(other) && other.slot == tie.slot);
        later
            .into_iter()
            .any(|(place, other)| (other.stage, place) > (tie.stage, index))
    };
    let ties = ties
        .iter()
        .enumerate()
        .filter(|(index, tie)| began(tie) && !replaced(*index, tie));
    ties.map(|(_, tie)| *tie).collect()
}

/// Adds to what is prescribed on local nodes what platens do between two moments: unknowns that no acting tie needs are
/// held still.
pub fn prescribe_platens(ties: &[Tie], nodes: &[u64], unknowns: usize, from: Time, to: Time, out: &mut Prescribed) {
    for (local, &key) in nodes.iter().enumerate() {
        let Some(boundary) = platen_of(key) else { continue };
        let start = local * unknowns;
        out.mask[start..start + unknowns].fill(true);
        out.increment[start..start + unknowns].fill(0.0);
        for tie in ties.iter().filter(|tie| tie.boundary == boundary) {
            match tie.goal {
                Goal::Prescribed(total) => {
                    out.increment[start + tie.component] = total * (to.ramp(tie.stage) - from.ramp(tie.stage));
                }
                Goal::Free => out.mask[start + tie.component] = false,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boundary(stage: usize, fix: Vec<usize>, moves: Vec<(usize, f64)>, free: Vec<usize>) -> Boundary {
        let held = Held {
            selection: Selection::Nearest([0.0; 3]),
            penalty: 1.0,
            free,
            measure: Measure::Total,
        };
        Boundary {
            name: "test".into(),
            place: Place::Points(held),
            fix,
            moves,
            stage,
        }
    }

    #[test]
    fn a_later_tie_of_the_same_points_takes_over() {
        let boundaries = [
            boundary(0, vec![1], vec![], vec![0]),
            boundary(1, vec![], vec![(1, 4.0)], vec![]),
        ];
        let ties = ties(&boundaries, |_| 5);
        assert_eq!(slots(&ties), 2);
        let first = acting(&ties, 0);
        assert!(first.len() == 2 && first.iter().all(|tie| tie.boundary == 0));
        let second = acting(&ties, 1);
        let of: Vec<_> = second.iter().map(|tie| (tie.boundary, tie.component)).collect();
        assert_eq!(of, [(0, 0), (1, 1)]);
        assert_eq!(second[1].slot, first[0].slot);
    }

    #[test]
    fn platens_move_as_told_and_idle_unknowns_are_held() {
        let boundaries = [boundary(1, vec![], vec![(1, 4.0)], vec![0])];
        let ties = ties(&boundaries, |_| 0);
        let mut prescribed = Prescribed {
            mask: vec![false; 6],
            increment: vec![0.5; 6],
        };
        let at = |fraction| Time { stage: 1, fraction };
        let nodes = [17, platen_key(0)];
        prescribe_platens(&acting(&ties, 1), &nodes, 3, at(0.25), at(0.5), &mut prescribed);
        assert_eq!(prescribed.mask, [false, false, false, false, true, true]);
        assert_eq!(prescribed.increment[4..], [1.0, 0.0]);
        assert_eq!(prescribed.increment[..3], [0.5; 3]);
        prescribe_platens(&acting(&ties, 0), &nodes, 3, at(0.25), at(0.5), &mut prescribed);
        assert_eq!(prescribed.mask[3..], [true; 3]);
        assert_eq!(platen_of(platen_key(3)), Some(3));
        assert_eq!(platen_of(3), None);
    }
}
