//! Bodies that share space: there the stiffness and the weight of both act.
//!
//! Counted are the points of one body whose centres lie inside the shape, or inside a domain, of another: domains that
//! reach a little over the surface of a shape, as those of a lattice do, are no overlap.

use super::space::Space;
use super::{Findings, Inspection};
use crate::app::advice::length;
use crate::continuum::Fields;
use crate::points::select::in_space;

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

/// Collective. Pairs of bodies that share more than a small part of their space. The same material twice in one place can
/// only be a mistake; two materials may be meant to act side by side.
pub fn overlaps<C: Fields<D, N>, const D: usize, const N: usize>(inspection: &Inspection<'_, C, D, N>) -> Findings {
    let scene = inspection.scene;
    let (volumes, overlaps) = measure(inspection);
    let count = scene.bodies.len();
    let mut findings = Findings::default();
    for second in 1..count {
        for first in 0..second {
            let (one, other) = (&overlaps[first * count + second], &overlaps[second * count + first]);
            let largest = if one.volume >= other.volume { one } else { other };
            let share = |body: usize| largest.volume / volumes[body];
            if largest.volume <= SMALL_SHARE * volumes[first].min(volumes[second]) {
                continue;
            }
            let corner = |corner: &[f64]| corner.iter().map(|&place| length(place)).collect::<Vec<_>>().join(", ");
            let message = format!(
                "the body \"{}\" shares {:.1} % of its space, from ({}) to ({}), with the body \"{}\" of bodies[{first}]: \
                 stiffness and weight of both act there",
                scene.bodies[second].name,
                100.0 * share(second).min(1.0),
                corner(&largest.low),
                corner(&largest.high),
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
    }
    findings
}

/// Collective. Volume of each body, and of each (row) what lies in each other one (column).
fn measure<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> (Vec<f64>, Vec<Overlap>) {
    let (scene, points, world) = (inspection.scene, &inspection.model.points, inspection.world);
    let count = scene.bodies.len();
    let mut volumes = vec![0.0; count];
    let mut shared = vec![0.0; count * count];
    let mut low = vec![f64::INFINITY; count * count * D];
    let mut high = vec![f64::NEG_INFINITY; count * count * D];
    let edge = inspection.model.initial_nodes().smallest_edge();
    let spaces: Vec<_> = scene.bodies.iter().map(|body| Space::of(body, edge)).collect();
    for p in 0..points.len() {
        let own = points.body[p] as usize;
        volumes[own] += points.volume[p];
        let position = in_space(&points.position[p]);
        let others = (0..count).filter(|&other| other != own && spaces[other].holds(&position));
        for pair in others.map(|other| own * count + other) {
            shared[pair] += points.volume[p];
            for axis in 0..D {
                let (low, high) = (&mut low[pair * D + axis], &mut high[pair * D + axis]);
                (*low, *high) = (low.min(position[axis]), high.max(position[axis]));
            }
        }
    }
    world.sum_slice(&mut volumes);
    world.sum_slice(&mut shared);
    world.min_slice(&mut low);
    world.max_slice(&mut high);
    let overlap = |(pair, volume): (usize, f64)| Overlap {
        volume,
        low: low[pair * D..][..D].to_vec(),
        high: high[pair * D..][..D].to_vec(),
    };
    let overlaps = shared.into_iter().enumerate().map(overlap).collect();
    (volumes, overlaps)
}
