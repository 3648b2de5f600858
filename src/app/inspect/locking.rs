//! Volumetric locking: hat functions cannot keep the volume of every point, and become too stiff where material asks for
//! it (docs/stability.md).

use super::Inspection;
use crate::continuum::Fields;
use crate::material::spec::MaterialSpec;
use crate::points::seed::PointSource;
use crate::scene::Scene;

/// Poisson's ratio beyond which hats are too stiff.
pub const NEARLY_INCOMPRESSIBLE: f64 = 0.45;

/// Materials of points that lock with the basis of the scene. One point a cell asks for little enough to be met.
pub fn locking<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
) -> Option<String> {
    let scene = inspection.scene;
    let several = |source: &PointSource| match source {
        PointSource::Lattice { points_per_cell, .. } => points_per_cell[..D].iter().any(|&count| count > 1),
        PointSource::Mesh(mesh) => mesh.points_per_cell[..D].iter().any(|&count| count > 1),
        PointSource::List(_) => true,
    };
    let constrained: Vec<bool> = scene.bodies.iter().map(|body| several(&body.points)).collect();
    let remedy = remedy(scene)?;
    let mut materials = vec![0_u8; scene.materials.len()];
    let points = &inspection.model.points;
    for (&material, &body) in points.material.iter().zip(&points.body) {
        materials[material as usize] |= u8::from(constrained[body as usize]);
    }
    inspection.world.max_slice(&mut materials);
    let causes: Vec<_> = scene
        .materials
        .iter()
        .zip(&materials)
        .filter(|&(_, &used)| used > 0)
        .filter_map(|(material, _)| Some(format!("materials.{} {}", material.name, cause(&material.spec)?)))
        .collect();
    (!causes.is_empty()).then(|| {
        format!(
            "volumetric locking: {}; hat functions may be too stiff for that, with a mean stress that alternates from point \
             to point; {remedy} (docs/stability.md, \"Volumetric locking\")",
            causes.join(", and ")
        )
    })
}

/// Why a law keeps its volume, where it does.
fn cause(spec: &MaterialSpec) -> Option<String> {
    let ratio = spec.poisson_ratio();
    if ratio > NEARLY_INCOMPRESSIBLE + f64::EPSILON {
        return Some(format!("is nearly incompressible (Poisson's ratio {ratio:.4})"));
    }
    (spec.dilatancy_slope() == Some(0.0)).then(|| "yields without change of volume".to_owned())
}

/// What to do, where the functions are hats.
fn remedy(scene: &Scene) -> Option<&'static str> {
    if scene.is_on_a_mesh() {
        return Some("model.method: mpm with grid.basis: bspline2 does better");
    }
    let remedy = "grid.basis: bspline2 does better";
    scene.grid.basis.is_of_hats().then_some(remedy)
}
