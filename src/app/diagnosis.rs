//! What to tell of a step that found no equilibrium: where it failed, what usually causes that, and which key mends it.

use super::inspect::locking::NEARLY_INCOMPRESSIBLE;
use super::snapshot::state_scalar;
use crate::assembly::model::Model;
use crate::continuum::Fields;
use crate::grid::words::place;
use crate::material::spec::MaterialSpec;
use crate::parallel::World;
use crate::points::select::in_space;
use crate::scene::{BasisKind, Scene};
use crate::solve::failure::{Cause, Failure};
use nalgebra::SVector;

/// The page that says more.
const PAGE: &str = "docs/stability.md";

/// Part of a cell below which it holds little.
const LITTLE: f64 = 0.3;

/// Slope of dilatancy below which plastic flow keeps the volume: that of about two degrees.
const ISOCHORIC: f64 = 0.04;

/// A remedy is told with its cause; more than so many confuse.
const MOST_HINTS: usize = 2;

/// Where a step failed, as far as hints depend on it.
struct Site {
    /// In words.
    place: String,
    /// Index of the material, where a point failed.
    material: Option<usize>,
    /// How full the emptiest cell is that holds something, among those about the place [-].
    emptiest: Option<f64>,
}

/// What usually causes a failure, with its remedy and the section of [`PAGE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hint {
    Unheld,
    LittleInCells,
    WeakGhost,
    Locking,
    MoreIterations,
    LimitPoint,
    RoundOff,
    LargeStep,
}

impl Hint {
    /// Cause, remedy, section.
    fn texts(self) -> [&'static str; 3] {
        match self {
            Hint::Unheld => [
                "nothing holds a body, or a part of it, in some direction, so that the matrix is singular",
                "hold it: boundary, fix or penalty; in cells that hold next to nothing, stabilisation.ghost",
                "When a step finds no equilibrium",
            ],
            Hint::LittleInCells => [
                "cells beside this place hold next to nothing, so that hardly any stiffness holds their nodes",
                "stabilisation: {ghost: {translation: ..}}, or grid.basis: bspline2, or faces of bodies on lines of the grid",
                "Cells that hold little",
            ],
            Hint::WeakGhost => [
                "cells beside this place hold next to nothing, and the ghost penalty is weak beside the stiffness",
                "a larger stabilisation.ghost, or grid.basis: bspline2",
                "Cells that hold little",
            ],
            Hint::Locking => [
                "the material hardly changes its volume, and hat functions lock under that",
                "grid.basis: bspline2",
                "Volumetric locking",
            ],
            Hint::MoreIterations => [
                "the residual was still falling when the limit of iterations was reached",
                "a larger solver.max_iterations, or shorter steps: stages, steps",
                "Attempts that fail, and step sizes",
            ],
            Hint::LimitPoint => [
                "the load is near the largest that the body carries",
                "to go beyond it: control: {arc_length: ..} in the stage, or a prescribed motion instead of the load",
                "Limit points",
            ],
            Hint::RoundOff => [
                "round-off of something far stiffer or far larger than the forces that are asked for",
                "a larger solver.force_tolerance, a smaller penalty, or less contrast of stiffness",
                "Round-off",
            ],
            Hint::LargeStep => [
                "the step is too large, the load beyond what the body carries, or a number in the wrong unit",
                "more steps or max_halvings in the stage; check loads and strengths",
                "Attempts that fail, and step sizes",
            ],
        }
    }
}

/// Collective. What to tell below the message of a step that found no equilibrium; the same on every rank.
pub fn explain<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    model: &Model<C, D, N>,
    steps: usize,
    failure: &Failure,
) -> String {
    let site = site(world, scene, model, &failure.cause);
    let mut lines = Vec::new();
    if let Some(Site { place, emptiest, .. }) = &site {
        lines.push(format!("where: {place}"));
        lines.extend(emptiest.map(|fill| format!("cells there: the emptiest is filled to {}", percentage(fill))));
    }
    for hint in hints(scene, steps, failure, site.as_ref()) {
        let [cause, remedy, section] = hint.texts();
        lines.push(format!("usual cause: {cause}"));
        lines.push(format!("what helps: {remedy} ({PAGE}, \"{section}\")"));
    }
    lines.iter().map(|line| format!("\n  {line}")).collect()
}

/// A share for a message.
fn percentage(share: f64) -> String {
    match 100.0 * share {
        percent if percent < 0.1 => "less than 0.1 %".into(),
        percent => format!("{percent:.1} %"),
    }
}

/// The most likely causes first.
fn hints(scene: &Scene, steps: usize, failure: &Failure, site: Option<&Site>) -> Vec<Hint> {
    let mut hints = Vec::new();
    match &failure.cause {
        Cause::Singular => hints.push(Hint::Unheld),
        Cause::Stagnation { .. } if !failure.smaller_might_do => return vec![Hint::RoundOff],
        Cause::IterationLimit { falling: true, .. } => hints.push(Hint::MoreIterations),
        _ => {}
    }
    let little = site.and_then(|site| site.emptiest).is_some_and(|fill| fill < LITTLE);
    if little {
        match (&scene.ghost, scene.grid.basis) {
            (Some(_), _) => hints.push(Hint::WeakGhost),
            (None, BasisKind::BSpline(2..)) => {}
            (None, _) => hints.push(Hint::LittleInCells),
        }
    }
    let loaded = !scene.loads.is_empty() && scene.stages.iter().all(|stage| stage.control.is_none());
    if hints.is_empty() && loaded && steps > 0 {
        hints.push(Hint::LimitPoint);
    }
    if scene.grid.basis.is_of_hats() && keeps_its_volume(scene, site.and_then(|site| site.material)) {
        hints.push(Hint::Locking);
    }
    if hints.is_empty() {
        hints.push(Hint::LargeStep);
    }
    hints.truncate(MOST_HINTS);
    hints
}

/// Whether a material hardly changes its volume, elastically or as it flows; any of the scene's where none is to blame.
fn keeps_its_volume(scene: &Scene, material: Option<usize>) -> bool {
    let keeps = |spec: &MaterialSpec| {
        spec.poisson_ratio() > NEARLY_INCOMPRESSIBLE
            || spec.dilatancy_slope().is_some_and(|slope| slope.abs() < ISOCHORIC)
    };
    let chosen = scene.materials.iter().enumerate();
    chosen
        .filter(|(index, _)| material.is_none_or(|material| material == *index))
        .any(|(_, material)| keeps(&material.spec))
}

/// Collective. The place of a failure; `None` where it has none.
fn site<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    model: &Model<C, D, N>,
    cause: &Cause,
) -> Option<Site> {
    if let Cause::Point(failed) = cause {
        let (position, material, place) = describe_point(world, scene, model, failed.id);
        return Some(Site {
            place,
            material: Some(material),
            emptiest: emptiest_cell(world, model, &position),
        });
    }
    let node = cause.node()?;
    let Some(position) = node.position else {
        return Some(Site {
            place: node.description.clone(),
            material: None,
            emptiest: None,
        });
    };
    let nearest = model.points.nearest_id(world, &position, model.grid.smallest_edge());
    let (_, material, nearest) = describe_point(world, scene, model, nearest);
    let position = SVector::from_fn(|axis, _| position[axis]);
    Some(Site {
        place: format!("{}; nearest to it {nearest}", node.description),
        material: Some(material),
        emptiest: emptiest_cell(world, model, &position),
    })
}

/// Collective. Position and material of a point of this number, and both with body and accepted state in words.
fn describe_point<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    model: &Model<C, D, N>,
    id: u64,
) -> (SVector<f64, D>, usize, String) {
    let points = &model.points;
    let own = points.id.iter().position(|&own| own == id);
    let mut numbers = [0.0; 3];
    let mut material = 0;
    let mut text = String::new();
    if let Some(p) = own {
        numbers = in_space(&points.position[p]);
        material = points.material[p] as usize;
        let chi = state_scalar(model, p, "chi");
        text = format!(
            "point {id} at {}, body {}, material {}; before this step J = {:.4}, {}",
            place(&numbers[..D]),
            scene.bodies[points.body[p] as usize].name,
            scene.materials[material].name,
            C::observe_fields(&points.motion[p], &points.stress[p]).volume_ratio,
            if chi > 0.0 {
                format!("plastic, chi = {chi:.3e}")
            } else {
                "elastic so far".into()
            },
        );
    }
    world.sum_slice(&mut numbers);
    let holder = world.first_where(own.is_some()).unwrap_or_default();
    let description = world.text_from(holder, &text);
    (
        SVector::from_fn(|axis, _| numbers[axis]),
        world.sum(material),
        description,
    )
}

/// Collective. How full the emptiest cell is that holds something, among that of a position and those around it; `None` on
/// a mesh, whose cells are full.
fn emptiest_cell<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    model: &Model<C, D, N>,
    position: &SVector<f64, D>,
) -> Option<f64> {
    if model.elements.is_some() {
        return None;
    }
    let grid = &model.grid;
    let lowest = |axis: usize| grid.cell_coordinate(axis, position[axis]).floor() - 1.0;
    let lowest: [f64; D] = std::array::from_fn(lowest);
    let mut volumes = vec![0.0; 3usize.pow(D as u32)];
    for p in 0..model.points.len() {
        let half = match model.basis.has_domains() {
            true => model.points.half_lengths[p],
            false => SVector::zeros(),
        };
        let volume =
            model.points.volume[p] * C::observe_fields(&model.points.motion[p], &model.points.stress[p]).volume_ratio;
        for (cell, total) in volumes.iter_mut().enumerate() {
            let share: f64 = (0..D)
                .map(|axis| {
                    let from = lowest[axis] + (cell / 3usize.pow(axis as u32) % 3) as f64;
                    let centre = grid.cell_coordinate(axis, model.points.position[p][axis]);
                    overlap(centre, half[axis] / grid.cell_size[axis], from)
                })
                .product();
            *total += share * volume;
        }
    }
    world.sum_slice(&mut volumes);
    let cell_volume: f64 = grid.cell_size.iter().product();
    volumes
        .into_iter()
        .map(|volume| volume / cell_volume)
        .filter(|&fill| fill > 0.0)
        .min_by(f64::total_cmp)
}

/// Share of a domain along an axis that lies in the cell from `from` to `from + 1`; all of a point where it has no length.
fn overlap(centre: f64, half: f64, from: f64) -> f64 {
    if half == 0.0 {
        return f64::from(u8::from(centre.floor() == from));
    }
    let inside = (centre + half).min(from + 1.0) - (centre - half).max(from);
    inside.max(0.0) / (2.0 * half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_is_shared_by_the_cells_that_it_lies_in() {
        assert_eq!(overlap(1.0, 0.25, 0.0), 0.5);
        assert_eq!(overlap(1.0, 0.25, 1.0), 0.5);
        assert_eq!(overlap(1.5, 0.25, 0.0), 0.0);
        assert_eq!((overlap(1.5, 0.0, 1.0), overlap(1.5, 0.0, 0.0)), (1.0, 0.0));
    }

    /// The page has every section that a hint sends the reader to.
    #[test]
    fn the_page_has_the_sections() {
        let page = std::fs::read_to_string(format!("{}/{PAGE}", env!("CARGO_MANIFEST_DIR"))).expect("the page");
        for hint in [
            Hint::Unheld,
            Hint::LittleInCells,
            Hint::WeakGhost,
            Hint::Locking,
            Hint::MoreIterations,
            Hint::LimitPoint,
            Hint::RoundOff,
            Hint::LargeStep,
        ] {
            let [_, _, section] = hint.texts();
            assert!(page.contains(&format!("\n## {section}\n")), "no section `{section}`");
        }
    }
}
