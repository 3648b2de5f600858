//! Whether something holds each piece of the body: rigid motions that no support prevents leave the stiffness singular.
//!
//! A support says of an unknown at a place that it is prescribed; of the rigid motions of the piece it leaves those that do
//! not move this unknown. A platen with free translations ties its points to unknowns of its own, by which it may hold
//! several pieces together. Loads, follower pressures and ghost penalties hold nothing.

use super::motions::{Motions, part};
use super::resultants::Resultants;
use super::row_space::RowSpace;
use super::{Findings, Inspection};
use crate::assembly::pieces::Pieces;
use crate::condition::dirichlet::Place;
use crate::condition::weak::{Goal, Tie, acting};
use crate::continuum::{Fields, UnknownKind};
use crate::grid::words::place;
use crate::parallel::World;
use crate::points::select::in_space;

/// More pieces than this are not told one by one.
const MOST_TOLD: usize = 5;

/// Collective. Pieces that may move as rigid bodies do. Where nothing holds a piece at all, or a load drives a free motion,
/// there is no equilibrium; otherwise the motion is left to round-off, which may go well.
pub fn unsupported<C: Fields<D, N>, const D: usize, const N: usize>(inspection: &Inspection<'_, C, D, N>) -> Findings {
    let pieces = inspection.model.pieces(inspection.world, inspection.survey);
    let outlines = outlines(inspection, &pieces);
    let mut findings = Findings::default();
    let mut is_loose = true;
    for stage in 0..inspection.scene.stages.len() {
        if !changes(inspection, stage, is_loose) {
            continue;
        }
        let free = free_motions(inspection, &pieces, &outlines, stage);
        let loose = loose(inspection, &pieces, &outlines, &free, stage);
        is_loose = !loose.is_empty();
        let told = tell(inspection, &outlines, &loose, stage);
        findings.problems = told.problems;
        if !findings.problems.is_empty() {
            break;
        }
        if findings.warnings.is_empty() {
            findings.warnings = told.warnings;
        }
    }
    findings
}

/// Whether a stage may free a piece, or load one that was loose before it. Conditions on nodes stay once they have begun;
/// points may be given to another support.
fn changes<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    stage: usize,
    is_loose: bool,
) -> bool {
    let scene = inspection.scene;
    let holds_anew = inspection.model.surface.ties.iter().any(|tie| tie.stage == stage);
    let begins = scene.boundaries.iter().any(|boundary| boundary.stage == stage)
        || scene.loads.iter().any(|load| load.stage == stage);
    stage == 0 || holds_anew || (is_loose && begins)
}

/// A piece with free motions.
struct Loose {
    piece: usize,
    motions: Vec<String>,
    cause: Cause,
}

/// Why free motions of a piece matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cause {
    Unheld,
    Driven,
    Undetermined,
}

/// Collective. Pieces with free motions. In a later stage a stress may keep a body from turning, as the weight does with a
/// pendulum: there translations alone count as driven.
fn loose<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    pieces: &Pieces,
    outlines: &[Outline],
    free: &[RowSpace],
    stage: usize,
) -> Vec<Loose> {
    if free.iter().all(|space| space.basis().is_empty()) {
        return Vec::new();
    }
    let before = Resultants::of(inspection, pieces, outlines, |load| load < stage);
    let now = Resultants::of(inspection, pieces, outlines, |load| load == stage);
    let mut found = Vec::new();
    for (piece, (outline, space)) in outlines.iter().zip(free).enumerate() {
        let motions = outline.motions.words(space);
        if motions.is_empty() {
            continue;
        }
        let tried = match stage {
            0 => space.basis().to_vec(),
            _ => outline.motions.translations(space),
        };
        let driven = |motion: &Vec<f64>| before.drive(piece, motion) || now.drive(piece, motion);
        let cause = match () {
            () if space.is_full() => Cause::Unheld,
            () if tried.iter().any(driven) => Cause::Driven,
            () => Cause::Undetermined,
        };
        found.push(Loose { piece, motions, cause });
    }
    found
}

/// What a piece is, as far as its supports and its name ask.
pub struct Outline {
    pub motions: Motions,
    low: Vec<f64>,
    high: Vec<f64>,
    /// Bodies that it is part of, with whether they are in other pieces too.
    bodies: Vec<(usize, bool)>,
}

/// Collective. The pieces by number.
fn outlines<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    pieces: &Pieces,
) -> Vec<Outline> {
    let (world, points) = (inspection.world, &inspection.model.points);
    let mut low = vec![f64::INFINITY; D * pieces.count];
    let mut high = vec![f64::NEG_INFINITY; D * pieces.count];
    let mut coupling = vec![0.0f64; pieces.count];
    for (p, &piece) in pieces.of_point.iter().enumerate() {
        for axis in 0..D {
            let place = points.position[p][axis];
            let (low, high) = (&mut low[piece * D + axis], &mut high[piece * D + axis]);
            (*low, *high) = (low.min(place), high.max(place));
        }
        let material = &inspection.scene.materials[points.material[p] as usize];
        coupling[piece] = coupling[piece].max(material.spec.coupling_modulus());
    }
    world.min_slice(&mut low);
    world.max_slice(&mut high);
    world.max_slice(&mut coupling);
    let edge = inspection.model.initial_nodes().smallest_edge();
    let outline = |(piece, bodies): (usize, Vec<(usize, bool)>)| {
        let (low, high) = (&low[piece * D..][..D], &high[piece * D..][..D]);
        let uncoupled = C::KIND.contains(&UnknownKind::Rotation) && coupling[piece] == 0.0;
        Outline {
            motions: Motions::new(D, low, high, edge, uncoupled),
            low: low.to_vec(),
            high: high.to_vec(),
            bodies,
        }
    };
    let members = members(inspection, pieces);
    members.into_iter().enumerate().map(outline).collect()
}

/// Collective. Bodies of each piece, with whether they are in other pieces too.
fn members<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    pieces: &Pieces,
) -> Vec<Vec<(usize, bool)>> {
    let bodies = inspection.model.points.body.iter().map(|&body| u64::from(body));
    let mut own: Vec<[u64; 2]> = Vec::new();
    for (&piece, body) in pieces.of_point.iter().zip(bodies) {
        let member = [piece as u64, body];
        if own.last() != Some(&member) {
            own.push(member);
        }
    }
    own.sort_unstable();
    own.dedup();
    let all = inspection.world.concatenate(&own.concat());
    let mut all: Vec<_> = all
        .chunks_exact(2)
        .map(|pair| (pair[0] as usize, pair[1] as usize))
        .collect();
    all.sort_unstable();
    all.dedup();
    let mut pieces_of_body = vec![0; inspection.scene.bodies.len()];
    all.iter().for_each(|&(_, body)| pieces_of_body[body] += 1);
    let mut members = vec![Vec::new(); pieces.count];
    all.iter()
        .for_each(|&(piece, body)| members[piece].push((body, pieces_of_body[body] > 1)));
    members
}

/// Collective. For each piece the rigid motions that nothing prevents in a stage.
fn free_motions<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    pieces: &Pieces,
    outlines: &[Outline],
    stage: usize,
) -> Vec<RowSpace> {
    let ties = acting(&inspection.model.surface.ties, stage);
    let free = ties.iter().filter(|tie| tie.goal == Goal::Free);
    let platens: Vec<_> = free.map(|tie| (tie.boundary, tie.component)).collect();
    let widths: Vec<usize> = outlines
        .iter()
        .map(|outline| outline.motions.count() + platens.len())
        .collect();
    let mut held: Vec<_> = widths.iter().map(|&width| RowSpace::new(width)).collect();
    hold_nodes(inspection, pieces, outlines, stage, &mut held);
    hold_points(inspection, pieces, outlines, (&ties, &platens), &mut held);
    let mut held = combine(inspection.world, held);
    // What each piece says of the platens alone holds for all.
    let mut fixed = RowSpace::new(platens.len());
    for (space, &width) in held.iter().zip(&widths).filter(|_| !platens.is_empty()) {
        let reached = part(&space.null_space(), width - platens.len()..width);
        reached.null_space().iter().for_each(|row| {
            fixed.add(row);
        });
    }
    for (space, &width) in held.iter_mut().zip(&widths) {
        for row in fixed.basis() {
            space.add(&[vec![0.0; width - platens.len()], row.clone()].concat());
        }
    }
    let own = |(space, outline): (&RowSpace, &Outline)| outline.motions.own(&space.null_space());
    held.iter().zip(outlines).map(own).collect()
}

/// What is prescribed at the nodes that this rank owns.
fn hold_nodes<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    pieces: &Pieces,
    outlines: &[Outline],
    stage: usize,
    held: &mut [RowSpace],
) {
    let nodes = inspection.model.initial_nodes();
    let acting = inspection
        .scene
        .boundaries
        .iter()
        .filter(|boundary| boundary.stage <= stage);
    for boundary in acting {
        let Place::Nodes(set) = &boundary.place else { continue };
        let moved = boundary.moves.iter().map(|&(component, _)| component);
        let components: Vec<_> = boundary.fix.iter().copied().chain(moved).collect();
        for (&key, &piece) in inspection.survey.nodes.own().iter().zip(&pieces.of_own_node) {
            // Platens are behind the pieces.
            if piece >= held.len() || held[piece].is_full() || !set.holds(nodes, key) {
                continue;
            }
            let position = nodes.position(&nodes.indices(key));
            for &component in &components {
                if let Some(row) = outlines[piece].motions.row(&C::KIND, component, &position) {
                    held[piece].add(&row);
                }
            }
        }
    }
}

/// What springs tie to platens at the points of this rank.
fn hold_points<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    pieces: &Pieces,
    outlines: &[Outline],
    (ties, platens): (&[Tie], &[(usize, usize)]),
    held: &mut [RowSpace],
) {
    let points = &inspection.model.points;
    for tie in ties {
        let platen = platens
            .iter()
            .position(|&platen| platen == (tie.boundary, tie.component));
        for p in (0..points.len()).filter(|&p| points.marks[p] >> tie.bit & 1 == 1) {
            let piece = pieces.of_point[p];
            if held[piece].is_full() {
                continue;
            }
            let row = outlines[piece]
                .motions
                .row(&C::KIND, tie.component, &in_space(&points.position[p]));
            if let Some(mut row) = row {
                let own = row.len();
                row.resize(own + platens.len(), 0.0);
                platen.iter().for_each(|platen| row[own + platen] = -1.0);
                held[piece].add(&row);
            }
        }
    }
}

/// Collective. The spaces of all ranks together.
fn combine(world: &World, mut spaces: Vec<RowSpace>) -> Vec<RowSpace> {
    if world.size() == 1 {
        return spaces;
    }
    let mut rows = Vec::new();
    for (number, space) in spaces.iter().enumerate() {
        for row in space.basis() {
            rows.push(number as f64);
            rows.extend(row);
        }
    }
    let rows = world.concatenate(&rows);
    spaces.iter_mut().for_each(RowSpace::clear);
    let mut rest = &rows[..];
    while let [number, tail @ ..] = rest {
        let space = &mut spaces[*number as usize];
        let (row, tail) = tail.split_at(space.width());
        space.add(row);
        rest = tail;
    }
    spaces
}

/// Errors where there is no equilibrium; warnings where a motion is left to round-off.
fn tell<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    outlines: &[Outline],
    loose: &[Loose],
    stage: usize,
) -> Findings {
    let mut findings = Findings::default();
    let since = match stage {
        0 => String::new(),
        _ => format!(" from stage \"{}\" on", inspection.scene.stages[stage].name),
    };
    for piece in loose.iter().take(MOST_TOLD) {
        let outline = &outlines[piece.piece];
        let path = format!("bodies[{}]", outline.bodies[0].0);
        let free = format!(
            "nothing keeps {} from {}{since}",
            name(outline, inspection),
            piece.motions.join(" and from ")
        );
        let message = match piece.cause {
            Cause::Undetermined => {
                let message = "no load drives it, so that round-off decides how far it goes; a support that prevents it changes nothing else";
                findings.warnings.push(format!("{path}: {free}: {message}"));
                continue;
            }
            Cause::Driven => format!(
                "{free}, which its loads do: there is no equilibrium{}",
                later(inspection, stage)
            ),
            Cause::Unheld => format!("{free}: its stiffness has no inverse{}", later(inspection, stage)),
        };
        let expected = "fix or move in boundary that prevents it; loads and pressures hold nothing";
        findings
            .problems
            .push(inspection.source.problem(&path, message, expected));
    }
    if let Some(more) = loose.len().checked_sub(MOST_TOLD).filter(|&more| more > 0) {
        let more = format!("; {more} more pieces of bodies, which share no node with others, are as loose");
        let problem = findings.problems.last_mut().map(|problem| &mut problem.message);
        problem
            .or(findings.warnings.last_mut())
            .into_iter()
            .for_each(|message| message.push_str(&more));
    }
    findings
}

/// The first condition that begins after a stage, where one does: it does not hold before.
fn later<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    stage: usize,
) -> String {
    let mut boundaries = inspection.scene.boundaries.iter().enumerate();
    let later = boundaries.find(|(_, boundary)| boundary.stage > stage);
    later.map_or_else(String::new, |(index, boundary)| {
        let begin = &inspection.scene.stages[boundary.stage].name;
        format!("; boundary[{index}] acts only from stage \"{begin}\" on")
    })
}

/// What a piece is called in a message.
fn name<C: Fields<D, N>, const D: usize, const N: usize>(
    outline: &Outline,
    inspection: &Inspection<'_, C, D, N>,
) -> String {
    let names = outline
        .bodies
        .iter()
        .map(|&(body, _)| format!("\"{}\"", inspection.scene.bodies[body].name));
    let names: Vec<_> = names.collect();
    let bodies = match &names[..] {
        [name] => format!("the body {name}"),
        names => format!("the bodies {}, which share nodes,", names.join(" and ")),
    };
    if outline.bodies.iter().all(|&(_, in_others)| !in_others) {
        return bodies;
    }
    format!(
        "the part from {} to {} of {bodies}",
        place(&outline.low),
        place(&outline.high)
    )
}
