//! Conditions that prescribe different motions of one unknown at one place.
//!
//! A condition of a later stage is meant to take over from an earlier one at the same nodes, or of the same selection.
//! Within a stage the later entry of the list holds at a node: where that leaves nothing of the earlier one, one of the two
//! is a mistake; where they only meet, as at the corner of two faces, it may be meant. Springs of two selections with
//! common points pull against each other, whenever their motions differ.

use super::{Findings, Inspection};
use crate::condition::dirichlet::{Boundary, Component};
use crate::condition::weak::{Goal, Tie, acting};
use crate::continuum::Fields;
use std::collections::BTreeMap;

/// Two conditions with a component that they move differently.
struct Contradiction {
    /// Entries of the list of boundaries, the earlier one first, and their motions in words.
    entries: [(usize, String); 2],
    component: Component,
    /// What both act on, nodes or points: how many, and how many there are of the one that loses.
    common: u64,
    losing: u64,
}

/// Collective. Contradictions on nodes and on points.
pub fn contradictions<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> Findings {
    let mut findings = Findings::default();
    for contradiction in on_nodes(inspection) {
        let losing = contradiction.losing;
        let holds = format!("of {losing} nodes, where the later entry holds");
        tell(inspection, &contradiction, &holds, &mut findings);
    }
    for contradiction in on_points(inspection) {
        let losing = contradiction.losing;
        let pull = format!("of {losing} points, which springs then pull both ways");
        tell(inspection, &contradiction, &pull, &mut findings);
    }
    findings
}

/// Collective. Conditions of one stage that act on the same nodes.
fn on_nodes<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> Vec<Contradiction> {
    let boundaries = &inspection.scene.boundaries;
    let (holders, sizes) = holders(inspection);
    let mut here = BTreeMap::new();
    for entries in holders.chunk_by(|one, other| one.0 == other.0) {
        for (place, &(_, second)) in entries.iter().enumerate() {
            for &(_, first) in &entries[..place] {
                let (earlier, later) = (&boundaries[first], &boundaries[second]);
                if earlier.stage == later.stage {
                    let differing = differing(earlier, later);
                    differing.for_each(|component| *here.entry([first, second, component]).or_insert(0) += 1);
                }
            }
        }
    }
    let records: Vec<u64> = here
        .iter()
        .flat_map(|(key, &count)| [key[0] as u64, key[1] as u64, key[2] as u64, count])
        .collect();
    let mut all: BTreeMap<[usize; 3], u64> = BTreeMap::new();
    for record in inspection.world.concatenate(&records).chunks_exact(4) {
        *all.entry([0, 1, 2].map(|k| record[k] as usize)).or_insert(0) += record[3];
    }
    let contradiction = |([first, second, component], common): ([usize; 3], u64)| Contradiction {
        entries: [first, second].map(|index| (index, motion(total(&boundaries[index], component)))),
        component,
        common,
        losing: sizes[first],
    };
    all.into_iter().map(contradiction).collect()
}

/// Collective. The nodes that this rank owns with each condition that acts on them, sorted; and the number of nodes, on all
/// ranks, that each condition acts on.
fn holders<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> (Vec<(usize, usize)>, Vec<u64>) {
    let nodes = inspection.model.initial_nodes();
    let mut holders = Vec::new();
    let mut sizes = vec![0; inspection.scene.boundaries.len()];
    for (index, boundary) in inspection.scene.boundaries.iter().enumerate() {
        let Some(set) = boundary.nodes() else { continue };
        let own = inspection.survey.nodes.own().iter().enumerate();
        holders.extend(
            own.filter(|&(_, &key)| set.holds(nodes, key))
                .map(|(node, _)| (node, index)),
        );
    }
    holders.iter().for_each(|&(_, index)| sizes[index] += 1);
    holders.sort_unstable();
    inspection.world.sum_slice(&mut sizes);
    (holders, sizes)
}

/// Components that both of two conditions prescribe, by different totals.
fn differing(one: &Boundary, other: &Boundary) -> impl Iterator<Item = Component> {
    let moved = one.moves.iter().map(|&(component, _)| component);
    let components = one.fix.iter().copied().chain(moved);
    components.filter(|&component| {
        let there = total(other, component);
        there.is_some() && there != total(one, component)
    })
}

/// Total motion that a condition prescribes for a component, where it does.
fn total(boundary: &Boundary, component: Component) -> Option<f64> {
    if boundary.fix.contains(&component) {
        return Some(0.0);
    }
    let moved = boundary.moves.iter().find(|&&(moved, _)| moved == component);
    moved.map(|&(_, total)| total)
}

/// Collective. Springs on the same points.
fn on_points<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> Vec<Contradiction> {
    let ties = &inspection.model.surface.ties;
    let mut found = Vec::new();
    for (second, later) in ties.iter().enumerate() {
        for earlier in ties[..second].iter().filter(|tie| tie.component == later.component) {
            let Some(goals) = opposed(ties, earlier, later) else {
                continue;
            };
            let [common, one, other] = shared_points(inspection, earlier.bit, later.bit);
            found.push(Contradiction {
                entries: [(earlier.boundary, goals[0].clone()), (later.boundary, goals[1].clone())],
                component: later.component,
                common,
                losing: one.min(other),
            });
        }
    }
    found
}

/// Motions of two springs in the stage from which on both act, where they differ.
fn opposed(ties: &[Tie], earlier: &Tie, later: &Tie) -> Option<[String; 2]> {
    if earlier.slot == later.slot {
        let differ = earlier.stage == later.stage && earlier.goal != later.goal;
        let goal = |tie: &Tie| match tie.goal {
            Goal::Prescribed(total) => motion(Some(total)),
            Goal::Free => motion(None),
        };
        return differ.then(|| [goal(earlier), goal(later)]);
    }
    let stage = earlier.stage.max(later.stage);
    let acting = acting(ties, stage);
    let in_stage = |tie: &Tie| match tie.goal {
        Goal::Prescribed(total) if acting.contains(tie) => Some(if tie.stage == stage { total } else { 0.0 }),
        _ => None,
    };
    let (one, other) = (in_stage(earlier)?, in_stage(later)?);
    (one != other).then(|| [motion(Some(one)), motion(Some(other))])
}

/// Collective. Number of points with both marks, with the first and with the second.
fn shared_points<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    one: usize,
    other: usize,
) -> [u64; 3] {
    let mut counts = [0; 3];
    for marks in &inspection.model.points.marks {
        let (one, other) = (marks >> one & 1, marks >> other & 1);
        counts[0] += one & other;
        counts[1] += one;
        counts[2] += other;
    }
    inspection.world.sum_slice(&mut counts);
    counts
}

fn motion(total: Option<f64>) -> String {
    match total {
        Some(0.0) => "fixed".to_owned(),
        Some(total) => format!("moved by {total}"),
        None => "free".to_owned(),
    }
}

/// An error where nothing is left of one of the two, else a warning.
fn tell<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    contradiction: &Contradiction,
    share: &str,
    findings: &mut Findings,
) {
    let Contradiction {
        entries: [(first, one), (second, other)],
        component,
        common,
        losing,
    } = contradiction;
    if *common == 0 {
        return;
    }
    let component = C::UNKNOWNS[*component];
    let path = |index: usize, motion: &str| match motion.starts_with("moved") {
        true => format!("boundary[{index}].move.{component}"),
        false => format!("boundary[{index}].fix"),
    };
    let (earlier, later) = (path(*first, one), path(*second, other));
    let message = format!("{component} is {other} here and {one} by {earlier} at {common} {share}");
    if common < losing {
        findings.warnings.push(format!("{later}: {message}"));
        return;
    }
    let expected = "one motion for each component and place in a stage; a condition of a later stage takes over";
    findings
        .problems
        .push(inspection.source.problem(&later, message, expected));
}
