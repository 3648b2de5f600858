//! Entries of a scene that change nothing.

use super::Inspection;
use crate::continuum::Fields;
use crate::points::seed::{Body, Region};
use crate::points::select::in_space;
use crate::scene::Scene;

/// Collective. Regions and materials that no point has, and files that are written more rarely than there are steps.
pub fn idle_entries<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> Vec<String> {
    let mut warnings = idle_regions(inspection);
    warnings.extend(unused_materials(inspection.scene));
    warnings.extend(rare_files(inspection.scene));
    warnings
}

/// Collective. Regions without points, or without any that they change.
fn idle_regions<C: Fields<D, N>, const D: usize, const N: usize>(inspection: &Inspection<'_, C, D, N>) -> Vec<String> {
    let (points, regions) = (&inspection.model.points, &inspection.scene.regions);
    if regions.is_empty() {
        return Vec::new();
    }
    let mut counts = vec![0_u64; 2 * regions.len()];
    let edge = inspection.model.initial_nodes().smallest_edge();
    for p in 0..points.len() {
        let position = in_space(&points.position[p]);
        let mut material = inspection.scene.bodies[points.body[p] as usize].material;
        for (region, counts) in regions.iter().zip(counts.chunks_exact_mut(2)) {
            if region.holds(&position, edge) {
                counts[0] += 1;
                if let Some(changed) = region.replacement(material) {
                    counts[1] += 1;
                    material = changed;
                }
            }
        }
    }
    inspection.world.sum_slice(&mut counts);
    let told = |(index, counts): (usize, &[u64])| match counts {
        [0, _] => Some(format!("regions[{index}] holds no material point: it changes nothing")),
        [held, 0] => Some(format!(
            "regions[{index}] changes nothing: the materials of its {held} points set none of the keys that it scales"
        )),
        _ => None,
    };
    counts.chunks_exact(2).enumerate().filter_map(told).collect()
}

fn unused_materials(scene: &Scene) -> Vec<String> {
    let is_used = |index: usize| scene.bodies.iter().any(|body: &Body| body.material == index);
    let is_variant = |index: usize| {
        scene
            .regions
            .iter()
            .any(|region: &Region| region.replace.iter().any(|&(_, to)| to == index))
    };
    let unused = scene
        .materials
        .iter()
        .enumerate()
        .filter(|&(index, _)| !is_used(index) && !is_variant(index));
    unused
        .map(|(_, material)| format!("materials.{} is the material of no body", material.name))
        .collect()
}

fn rare_files(scene: &Scene) -> Vec<String> {
    let steps: usize = scene.stages.iter().map(|stage| stage.full_steps()).sum();
    let told = |every: Option<usize>, key: &str, outcome: &str| {
        let every = every.filter(|&every| every > steps)?;
        Some(format!(
            "output.{key}.every: {every} is more than the {steps} steps of the run: {outcome}"
        ))
    };
    let snapshots = told(
        scene.output.snapshot_every,
        "snapshots",
        "only the first and the last state are written",
    );
    let checkpoints = told(
        scene.output.checkpoint_every,
        "checkpoint",
        "only the last state gives a checkpoint",
    );
    snapshots.into_iter().chain(checkpoints).collect()
}
