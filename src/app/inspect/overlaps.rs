//! Bodies that share space: there the stiffness and the weight of both act.
//!
//! Counted are the points of one body whose centres lie inside the shape, or inside a domain, of another: domains that
//! reach a little over the surface of a shape, as those of a lattice do, are no overlap.

use super::space::Space;
use super::{Findings, Inspection};
use crate::continuum::Fields;
use crate::grid::words::place;
use crate::points::select::in_space;
use std::collections::BTreeMap;

/// Share of the smaller body from which on an overlap is told.
const SMALL_SHARE: f64 = 1.0e-3;

/// Share of both bodies from which on they are one body that is given twice.
const NEARLY_ALL: f64 = 0.99;

/// What points of one body lie inside another.
#[derive(Clone, Debug)]
struct Overlap {
    /// Reference volume [m3], per metre of thickness in the plane.
    volume: f64,
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Overlaps by the body of the points and the body that they lie in.
type Overlaps = BTreeMap<(usize, usize), Overlap>;

/// Collective. Pairs of bodies that share more than a small part of their space. The same material twice in one place can
/// only be a mistake; two materials may be meant to act side by side.
pub fn overlaps<C: Fields<D, N>, const D: usize, const N: usize>(inspection: &Inspection<'_, C, D, N>) -> Findings {
    let scene = inspection.scene;
    let volumes = volumes(inspection);
    let overlaps = measure(inspection);
    let mut pairs: Vec<_> = overlaps
        .keys()
        .map(|&(one, other)| (one.min(other), one.max(other)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut findings = Findings::default();
    for (first, second) in pairs {
        let both = [(first, second), (second, first)];
        let found = both.iter().filter_map(|pair| overlaps.get(pair));
        let Some(largest) = found.max_by(|one, other| one.volume.total_cmp(&other.volume)) else {
            continue;
        };
        let share = |body: usize| largest.volume / volumes[body];
        if share(first).max(share(second)) <= SMALL_SHARE {
            continue;
        }
        let message = format!(
            "the body \"{}\" shares {:.1} % of its space, from {} to {}, with the body \"{}\" of bodies[{first}]: \
             stiffness and weight of both act there",
            scene.bodies[second].name,
            100.0 * share(second).min(1.0),
            place(&largest.low),
            place(&largest.high),
            scene.bodies[first].name
        );
        let same = scene.bodies[first].material == scene.bodies[second].material;
        let path = format!("bodies[{second}]");
        if same && share(first).min(share(second)) > NEARLY_ALL {
            let expected = "bodies beside each other: cut one out of the other with all and not";
            findings
                .problems
                .push(inspection.source.problem(&path, message, expected));
        } else {
            findings.warnings.push(format!("{path}: {message}"));
        }
    }
    findings
}

/// Collective. Reference volume of each body.
fn volumes<C: Fields<D, N>, const D: usize, const N: usize>(inspection: &Inspection<'_, C, D, N>) -> Vec<f64> {
    let points = &inspection.model.points;
    let mut volumes = vec![0.0; inspection.scene.bodies.len()];
    for (&body, &volume) in points.body.iter().zip(&points.volume) {
        volumes[body as usize] += volume;
    }
    inspection.world.sum_slice(&mut volumes);
    volumes
}

/// Collective. All overlaps, the same on every rank.
fn measure<C: Fields<D, N>, const D: usize, const N: usize>(inspection: &Inspection<'_, C, D, N>) -> Overlaps {
    let points = &inspection.model.points;
    let edge = inspection.model.initial_nodes().smallest_edge();
    let bodies = &inspection.scene.bodies;
    let spaces: Vec<_> = bodies.iter().map(|body| Space::of(body, edge)).collect();
    let near = |own: usize| (0..spaces.len()).filter(move |&other| other != own);
    let near: Vec<Vec<usize>> = (0..spaces.len())
        .map(|own| near(own).filter(|&other| spaces[own].is_near(&spaces[other])).collect())
        .collect();
    let mut here = Overlaps::new();
    for p in 0..points.len() {
        let own = points.body[p] as usize;
        let position = in_space(&points.position[p]);
        for &other in near[own].iter().filter(|&&other| spaces[other].holds(&position)) {
            add(&mut here, (own, other), points.volume[p], [&position[..D]; 2]);
        }
    }
    let record = |(&(own, other), overlap): (&(usize, usize), &Overlap)| {
        let head = [own as f64, other as f64, overlap.volume];
        [&head[..], &overlap.low, &overlap.high].concat()
    };
    let records: Vec<f64> = here.iter().flat_map(record).collect();
    let mut all = Overlaps::new();
    for record in inspection.world.concatenate(&records).chunks_exact(3 + 2 * D) {
        let corners = [&record[3..3 + D], &record[3 + D..]];
        add(&mut all, (record[0] as usize, record[1] as usize), record[2], corners);
    }
    all
}

/// Adds a volume between two corners.
fn add(overlaps: &mut Overlaps, pair: (usize, usize), volume: f64, [low, high]: [&[f64]; 2]) {
    let overlap = overlaps.entry(pair).or_insert_with(|| Overlap {
        volume: 0.0,
        low: low.to_vec(),
        high: high.to_vec(),
    });
    overlap.volume += volume;
    for axis in 0..low.len() {
        overlap.low[axis] = overlap.low[axis].min(low[axis]);
        overlap.high[axis] = overlap.high[axis].max(high[axis]);
    }
}
