//! Pressures on faces that are no surface: another body lies against them, so that they push inside the ground.

use super::Inspection;
use super::space::Space;
use crate::assembly::surface::SurfaceConditions;
use crate::condition::pressure::Pressure;
use crate::continuum::Fields;
use crate::points::select::in_space;
use crate::scene::LoadKind;

/// How far outside a side is looked for another body, as a multiple of the half-length of a domain.
const BEYOND: f64 = 0.5;

/// Collective. A warning for each pressure of which faces are hidden.
pub fn hidden_faces<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> Vec<String> {
    let scene = inspection.scene;
    let SurfaceConditions { pressures, .. } = &inspection.model.surface;
    let edge = inspection.model.initial_nodes().smallest_edge();
    let spaces: Vec<_> = scene.bodies.iter().map(|body| Space::of(body, edge)).collect();
    let loads = scene.loads.iter().enumerate();
    let pressed = loads.filter(|(_, load)| matches!(load.kind, LoadKind::Pressure { .. }));
    let mut warnings = Vec::new();
    for ((index, load), pressure) in pressed.zip(pressures) {
        let counts = count_hidden(inspection, &spaces, pressure);
        let hidden: u64 = counts[1..].iter().sum();
        let against = counts[1..].iter().zip(&scene.bodies).filter(|&(&count, _)| count > 0);
        let names: Vec<_> = against.map(|(_, body)| format!("\"{}\"", body.name)).collect();
        if hidden > 0 {
            warnings.push(format!(
                "loads[{index}] ({}): {hidden} of the {} faces under this pressure lie against the body {}: there it acts \
                 inside the ground, not on a surface",
                load.name,
                counts[0],
                names.join(" and ")
            ));
        }
    }
    warnings
}

/// Collective. Number of faces under a pressure, and of those that lie against each body.
fn count_hidden<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    spaces: &[Space<'_>],
    pressure: &Pressure,
) -> Vec<u64> {
    let points = &inspection.model.points;
    let mut counts = vec![0; 1 + spaces.len()];
    for patch in &pressure.patches {
        for p in (0..points.len()).filter(|&p| points.marks[p] >> patch.bit & 1 == 1) {
            let mut beyond = in_space(&points.position[p]);
            let offset = patch.side.offset(points, p);
            (0..D).for_each(|k| beyond[k] += (1.0 + BEYOND) * offset[k]);
            counts[0] += 1;
            let own = points.body[p] as usize;
            let against = (0..spaces.len()).find(|&body| body != own && spaces[body].holds(&beyond));
            against.iter().for_each(|body| counts[1 + body] += 1);
        }
    }
    inspection.world.sum_slice(&mut counts);
    counts
}
