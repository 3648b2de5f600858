//! What a solution takes, estimated before there is a matrix.

use crate::points::seed::PointSource;
use crate::scene::{BasisKind, Scene};

/// Directions that GMRES keeps, as `petsc::linear` sets it.
const DIRECTIONS: f64 = 150.0;

/// The linear systems of a scene, as far as their size tells what they take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemSize {
    pub unknowns: f64,
    pub unknowns_per_node: f64,
    pub dimension: usize,
    /// Nodes along an axis, to one side, that a node is coupled with.
    pub reach: f64,
}

impl SystemSize {
    /// The size of the systems of a scene with so many unknowns.
    pub fn of(scene: &Scene, unknowns: usize, unknowns_per_node: usize) -> Self {
        Self {
            unknowns: unknowns as f64,
            unknowns_per_node: unknowns_per_node as f64,
            dimension: scene.kinematics.dimension(),
            reach: reach(scene),
        }
    }

    /// Memory of complete factors and of the work on them [MB], all ranks together.
    ///
    /// Nested dissection of a compact body cuts it at separators that are as wide as nodes reach. With `n` unknowns, `N` a
    /// node, and a reach of `w`, all that MUMPS keeps is `55 N w^1.5 n log2(n / N)` bytes in the plane and
    /// `230 N^(2/3) w^1.5 n^(4/3)` in space; powers of `n` and `N` are those of the theory, the rest is fitted to what was
    /// measured (docs/performance.md). A slender body in space takes a fraction of it.
    pub fn direct_memory(&self) -> f64 {
        let (n, per_node) = (self.unknowns, self.unknowns_per_node);
        let bytes = match self.dimension {
            2 => 55.0 * per_node * n * (n / per_node).max(2.0).log2(),
            _ => 230.0 * per_node.powf(2.0 / 3.0) * n.powf(4.0 / 3.0),
        };
        bytes * self.reach.powf(1.5) / 1e6
    }

    /// Memory of the matrix, of incomplete factors in its pattern, and of the directions of GMRES [MB], all ranks together.
    pub fn iterative_memory(&self) -> f64 {
        let neighbours = (2.0 * self.reach + 1.0).powi(self.dimension as i32);
        let row = neighbours * self.unknowns_per_node;
        8.0 * self.unknowns * (2.0 * row + DIRECTIONS) / 1e6
    }

    /// Time of a complete factorisation on one rank [s], by the memory that it fills.
    pub fn direct_seconds(&self) -> f64 {
        let seconds_per_megabyte = if self.dimension == 2 { 0.01 } else { 0.02 };
        seconds_per_megabyte * self.direct_memory()
    }
}

/// How far nodes are coupled. Domains of GIMPM stay within a cell at first, and reach over its edges later.
fn reach(scene: &Scene) -> f64 {
    let on_a_mesh = |source: &PointSource| matches!(source, PointSource::Mesh(_));
    match scene.grid.basis {
        _ if scene.bodies.iter().any(|body| on_a_mesh(&body.points)) => 1.0,
        BasisKind::Linear => 1.0,
        BasisKind::Gimp => 1.4,
        BasisKind::BSpline(order) => order as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(dimension: usize, unknowns_per_node: usize, reach: f64, unknowns: usize) -> SystemSize {
        SystemSize {
            unknowns: unknowns as f64,
            unknowns_per_node: unknowns_per_node as f64,
            dimension,
            reach,
        }
    }

    /// The rows of docs/performance.md: MUMPS' own count of what it used, by `-ksp_view`, but for slender bodies.
    #[test]
    fn memory_of_factors_is_estimated_within_a_factor_of_two() {
        for (size, measured) in [
            (size(2, 3, 1.0, 5_043), 9.0),
            (size(2, 3, 1.0, 43_923), 99.0),
            (size(2, 3, 2.0, 5_292), 24.0),
            (size(2, 3, 2.0, 44_652), 290.0),
            (size(2, 3, 3.0, 5_547), 44.0),
            (size(2, 3, 3.0, 45_387), 529.0),
            (size(2, 3, 1.4, 2_583), 4.0),
            (size(2, 3, 1.4, 2_583), 12.0),
            (size(2, 3, 1.4, 39_123), 83.0),
            (size(2, 4, 2.0, 13_784), 96.0),
            (size(3, 3, 1.0, 14_739), 133.0),
            (size(3, 3, 2.0, 8_232), 170.0),
            (size(3, 6, 1.0, 4_374), 37.0),
            (size(3, 6, 1.0, 13_182), 175.0),
            (size(3, 6, 1.0, 29_478), 514.0),
            (size(3, 6, 2.0, 6_000), 156.0),
            (size(3, 6, 2.0, 16_464), 671.0),
            (size(3, 6, 3.0, 7_986), 433.0),
            (size(3, 7, 2.0, 20_167), 1_893.0),
            (size(3, 7, 2.0, 56_427), 8_806.0),
        ] {
            let ratio = size.direct_memory() / measured;
            assert!((0.5..2.0).contains(&ratio), "{size:?}: {ratio}");
        }
    }
}
