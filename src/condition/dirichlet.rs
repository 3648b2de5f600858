//! Prescribed increments on nodes.

use super::Time;
use super::weak::{Held, platen_of};
use crate::grid::InitialNodes;
use crate::grid::region::Shape;

/// A component of the unknowns, by its index in the fields of the scene.
pub type Component = usize;

/// Conditions on nodes of a plane of the grid, or on material points.
#[derive(Clone, Debug)]
pub struct Boundary {
    /// Given name, or a name made of its place in the list: `boundary[2]`.
    pub name: String,
    pub place: Place,
    /// Components whose increment is zero.
    pub fix: Vec<Component>,
    /// Components with their total, ramped linearly over the stage.
    pub moves: Vec<(Component, f64)>,
    /// Stage from which the condition acts.
    pub stage: usize,
}

/// What a condition holds.
#[derive(Clone, Debug)]
pub enum Place {
    Nodes(NodeSet),
    /// Points, by a penalty.
    Points(Held),
}

impl Boundary {
    /// The nodes that the condition acts on; `None` where it acts on points.
    pub fn nodes(&self) -> Option<&NodeSet> {
        match &self.place {
            Place::Nodes(nodes) => Some(nodes),
            Place::Points(_) => None,
        }
    }
}

/// Nodes of the grid.
#[derive(Clone, Debug)]
pub struct NodeSet {
    pub plane: Option<GridPlane>,
    pub within: Option<Shape>,
}

/// A plane of grid nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPlane {
    pub axis: usize,
    /// Index of the plane of nodes along the axis.
    pub index: usize,
}

/// A node within this share of a cell of a shape's boundary counts as inside.
const NODE_MARGIN: f64 = 1.0e-9;

/// Prescribed unknowns of the local nodes: `mask` and `increment` have one entry an unknown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prescribed {
    pub mask: Vec<bool>,
    pub increment: Vec<f64>,
}

impl NodeSet {
    /// Whether a node belongs to the set; what moves later keeps the sets of the start. Platens belong to none.
    pub fn holds<const D: usize>(&self, nodes: &dyn InitialNodes<D>, node_key: u64) -> bool {
        if platen_of(node_key).is_some() {
            return false;
        }
        let node = nodes.indices(node_key);
        self.plane.is_none_or(|plane| node[plane.axis] == plane.index)
            && self
                .within
                .as_ref()
                .is_none_or(|shape| shape.contains(&nodes.position(&node), NODE_MARGIN * nodes.smallest_edge()))
    }
}

/// Increments that the conditions prescribe between two moments of one stage on the nodes with these keys, `unknowns`
/// a node. Of several conditions on one component the latest holds: by stage, then by place in the list.
pub fn prescribe<const D: usize>(
    boundaries: &[Boundary],
    initial: &dyn InitialNodes<D>,
    nodes: &[u64],
    unknowns: usize,
    from: Time,
    to: Time,
) -> Prescribed {
    let mut prescribed = Prescribed {
        mask: vec![false; nodes.len() * unknowns],
        increment: vec![0.0; nodes.len() * unknowns],
    };
    let mut active: Vec<&Boundary> = boundaries
        .iter()
        .filter(|boundary| boundary.stage <= to.stage)
        .collect();
    active.sort_by_key(|boundary| boundary.stage);
    for boundary in active {
        let Some(place) = boundary.nodes() else { continue };
        let increment = to.ramp(boundary.stage) - from.ramp(boundary.stage);
        for (local, &key) in nodes.iter().enumerate() {
            if !place.holds(initial, key) {
                continue;
            }
            let mut set = |component: usize, value: f64| {
                prescribed.mask[local * unknowns + component] = true;
                prescribed.increment[local * unknowns + component] = value;
            };
            boundary.fix.iter().for_each(|&component| set(component, 0.0));
            boundary
                .moves
                .iter()
                .for_each(|&(component, total)| set(component, total * increment));
        }
    }
    prescribed
}

/// Increment that the conditions prescribe for a component of all nodes of a plane, as [`prescribe`] would.
pub fn plane_increment(boundaries: &[Boundary], plane: GridPlane, component: Component, from: Time, to: Time) -> f64 {
    let mut acting: Vec<&Boundary> = boundaries
        .iter()
        .filter(|boundary| boundary.stage <= to.stage)
        .filter(|boundary| boundary.nodes().is_some_and(|nodes| nodes.plane == Some(plane)))
        .collect();
    acting.sort_by_key(|boundary| boundary.stage);
    let increment_of = |boundary: &&Boundary| {
        if boundary.fix.contains(&component) {
            return Some(0.0);
        }
        let total = boundary.moves.iter().find(|(moved, _)| *moved == component)?.1;
        Some(total * (to.ramp(boundary.stage) - from.ramp(boundary.stage)))
    };
    acting.iter().rev().find_map(increment_of).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn boundary(index: usize, fix: Vec<usize>, moves: Vec<(usize, f64)>, stage: usize) -> Boundary {
        let place = Place::Nodes(NodeSet {
            plane: Some(GridPlane { axis: 1, index }),
            within: None,
        });
        Boundary {
            name: "test".into(),
            place,
            fix,
            moves,
            stage,
        }
    }

    #[test]
    fn later_conditions_replace_earlier_ones_and_ramps_hold() {
        let grid = Grid {
            min: [0.0; 2],
            cell_size: [1.0; 2],
            cells: [1, 1],
            order: 1,
        };
        let nodes = [0, 1, 2, 3];
        let boundaries = [
            boundary(1, vec![0], vec![(1, 4.0)], 1),
            boundary(1, vec![], vec![(1, 8.0)], 0),
            boundary(0, vec![2], vec![], 0),
        ];
        let at = |stage, fraction| Time { stage, fraction };
        let first = prescribe(&boundaries, &grid, &nodes, 3, at(0, 0.25), at(0, 0.5));
        assert_eq!(first.increment[2 * 3 + 1], 2.0);
        assert!(!first.mask[2 * 3] && first.mask[2] && !first.mask[1]);
        let second = prescribe(&boundaries, &grid, &nodes, 3, at(1, 0.0), at(1, 0.5));
        assert_eq!(second.increment[3 * 3 + 1], 2.0);
        assert!(second.mask[3 * 3]);
        let plane = |index, from, to| plane_increment(&boundaries, GridPlane { axis: 1, index }, 1, from, to);
        assert_eq!(plane(1, at(0, 0.25), at(0, 0.5)), 2.0);
        assert_eq!(plane(1, at(1, 0.0), at(1, 0.5)), 2.0);
        assert_eq!(plane(0, at(1, 0.0), at(1, 0.5)), 0.0);
        let third = prescribe(&boundaries, &grid, &nodes, 3, at(2, 0.0), at(2, 0.5));
        assert_eq!(third.increment[3 * 3 + 1], 0.0);
        assert!(third.mask[3 * 3 + 1]);
    }
}
