//! Whether half of a scene would tell as much as the whole: points, nodes with their conditions, and loads against their
//! mirror images about the middle of the body.

use super::build::Built;
use crate::continuum::Fields;
use crate::grid::words::length;
use crate::scene::{LoadKind, Scene, Target};
use std::collections::{HashMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Steps of a coordinate within a cell by which points are told apart; the offset keeps lattices off their bounds.
const STEPS_PER_CELL: f64 = 4096.0;
const OFFSET: f64 = 0.2371;

/// Advice for the first axis about whose middle plane everything is its own mirror image; on one rank, without a mesh.
pub fn symmetric_halves<C: Fields<D, N>, const D: usize, const N: usize>(
    built: &Built<C, D, N>,
    scene: &Scene,
) -> Option<String> {
    let model = &built.model;
    let everything_here = model.points.len() as u64 == built.points;
    if !everything_here || model.elements.is_some() || scene.manufactured.is_some() {
        return None;
    }
    let axis = (0..D).find(|&axis| {
        let mirror = Mirror::of(built, axis);
        mirror.is_some_and(|mirror| {
            mirror.keeps_loads(scene) && mirror.keeps_conditions(built, scene) && mirror.keeps_points(built)
        })
    })?;
    let mirror = Mirror::of(built, axis)?;
    let at = model.grid.min[axis] + 0.5 * mirror.twice_middle * model.grid.cell_size[axis];
    let held: Vec<_> = (0..N)
        .filter(|&component| mirror.turns::<C, D, N>(component))
        .map(|k| C::UNKNOWNS[k])
        .collect();
    let (name, at) = (["x", "y", "z"][axis], length(at));
    Some(format!(
        "geometry, materials and conditions are mirror-symmetric about {name} = {at}: half of the model with fix: [{}] on \
         that plane gives the same, unless a band of localised strain breaks the symmetry",
        held.join(", ")
    ))
}

/// A plane of the grid, or of the middle of its cells, normal to an axis.
#[derive(Clone, Copy, Debug)]
struct Mirror {
    axis: usize,
    /// Twice its coordinate in cells from the lower face, a whole number.
    twice_middle: f64,
}

impl Mirror {
    /// The middle of the points along an axis, if the grid is symmetric about it.
    fn of<C: Fields<D, N>, const D: usize, const N: usize>(built: &Built<C, D, N>, axis: usize) -> Option<Self> {
        let model = &built.model;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for position in &model.points.position {
            let coordinate = model.grid.cell_coordinate(axis, position[axis]);
            (low, high) = (low.min(coordinate), high.max(coordinate));
        }
        let twice_middle = (low + high).round();
        ((low + high - twice_middle).abs() < 1e-6).then_some(Self { axis, twice_middle })
    }

    /// Whether a component changes its sign: the translation across the plane, and rotations about axes in it.
    fn turns<C: Fields<D, N>, const D: usize, const N: usize>(&self, component: usize) -> bool {
        if C::IS_TRANSLATION[component] {
            component == self.axis
        } else {
            // In the plane the only rotation is about the third axis.
            D == 2 || component - D != self.axis
        }
    }

    /// Loads without a part that the mirror would turn round; their points are compared with the others.
    fn keeps_loads(&self, scene: &Scene) -> bool {
        let along = |vector: &[f64; 3]| vector[self.axis] == 0.0;
        let about = |vector: &[f64; 3]| (0..3).all(|k| k == self.axis || vector[k] == 0.0);
        scene.loads.iter().all(|load| match &load.kind {
            LoadKind::SpecificWeight(weights) => weights.iter().all(along),
            LoadKind::Force {
                total,
                at: Target::Points(_),
            } => along(total),
            LoadKind::Couple {
                total,
                at: Target::Points(_),
            } => about(total),
            LoadKind::Force { .. } | LoadKind::Couple { .. } | LoadKind::Pressure { .. } => false,
        })
    }

    /// Whether what is prescribed at each active node is the mirror image of what is prescribed at its image.
    fn keeps_conditions<C: Fields<D, N>, const D: usize, const N: usize>(
        &self,
        built: &Built<C, D, N>,
        scene: &Scene,
    ) -> bool {
        let grid = &built.model.initial_grid;
        let active: HashSet<u64> = built.own_nodes.iter().copied().collect();
        let image = |key: u64| {
            let mut node = grid.node(key);
            // A spline of order p lies (p - 1)/2 cells below the grid line of its number.
            let mirrored = self.twice_middle + (grid.order - 1) as f64 - node[self.axis] as f64;
            if !(0.0..grid.nodes_per_axis()[self.axis] as f64).contains(&mirrored) {
                return None;
            }
            node[self.axis] = mirrored as usize;
            Some(grid.node_key(&node)).filter(|image| active.contains(image))
        };
        // Entries of the same stage add up at a node; a later one replaces earlier ones from its stage on.
        let mut prescribed: HashMap<u64, Vec<(usize, usize, f64)>> = HashMap::new();
        for boundary in &scene.boundaries {
            let held = boundary.fix.iter().map(|&component| (boundary.stage, component, 0.0));
            let moved = boundary
                .moves
                .iter()
                .map(|&(component, total)| (boundary.stage, component, total));
            let entries: Vec<_> = held.chain(moved).collect();
            // Points held by a penalty are not compared: no advice rather than a wrong one.
            let Some(nodes) = boundary.nodes() else { return false };
            for &key in built.own_nodes.iter().filter(|&&key| nodes.holds(grid, key)) {
                prescribed.entry(key).or_default().extend(&entries);
            }
        }
        let sorted = |mut entries: Vec<(usize, usize, f64)>| {
            entries.sort_by(|one, other| one.partial_cmp(other).unwrap_or(std::cmp::Ordering::Equal));
            entries.dedup();
            entries
        };
        built.own_nodes.iter().all(|&key| {
            let Some(image) = image(key) else { return false };
            let mirrored = |&(stage, component, total): &(usize, usize, f64)| {
                let turned = self.turns::<C, D, N>(component) && total != 0.0;
                (stage, component, if turned { -total } else { total })
            };
            let here = prescribed.get(&key).cloned().unwrap_or_default();
            let there = prescribed.get(&image).into_iter().flatten().map(mirrored).collect();
            sorted(here) == sorted(there)
        })
    }

    /// Whether each point has a mirror image of the same material that carries the same loads.
    fn keeps_points<C: Fields<D, N>, const D: usize, const N: usize>(&self, built: &Built<C, D, N>) -> bool {
        let (points, grid) = (&built.model.points, &built.model.grid);
        let bits = built.model.loads.iter().filter_map(|load| load.bit);
        let carried = bits.fold(0_u64, |mask, bit| mask | 1 << bit);
        let place = |p: usize, mirrored: bool| {
            let position = &points.position[p];
            let mut place = [0; D];
            for axis in 0..D {
                let coordinate = grid.cell_coordinate(axis, position[axis]);
                let coordinate = match mirrored && axis == self.axis {
                    true => self.twice_middle - coordinate,
                    false => coordinate,
                };
                place[axis] = (coordinate * STEPS_PER_CELL + OFFSET).floor() as i64;
            }
            (place, points.material[p], points.marks[p] & carried)
        };
        // Sums of hashes do not depend on the order: equal ones mean equal sets of points, as good as always.
        let sum = |mirrored: bool| {
            let hashes = (0..points.len()).map(|p| {
                let mut hasher = DefaultHasher::new();
                place(p, mirrored).hash(&mut hasher);
                hasher.finish()
            });
            hashes.fold(0, u64::wrapping_add)
        };
        sum(false) == sum(true)
    }
}
