//! When a step has converged, and the table of how it came there.
//!
//! The measure is `|r_free| / |f_ext + f_reaction|` over translations and rotations together (T 2.53), ghost forces
//! included; where a scene sets it, `|r . delta| < e_tol` with the last correction (T 2.54) serves too.

/// Share of other force scales below which external forces and reactions count as zero: a body that is unloaded, or
/// turns freely, must not ask for a residual below round-off.
const NEGLIGIBLE: f64 = 1.0e-6;

/// Squares of norms at one trial state, summed over the ranks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Norms {
    /// Residual on free unknowns, translations and rotations.
    pub residual: [f64; 2],
    /// External forces and reactions.
    pub forces: f64,
    /// Forces of single batches before they are summed: the scale of what cancels.
    pub unassembled: f64,
}

impl Norms {
    pub fn from_sums(sums: &[f64]) -> Self {
        Self {
            residual: [sums[0], sums[1]],
            forces: sums[2],
            unassembled: sums[3],
        }
    }

    /// Force residual relative to external forces and reactions. `peak` is the largest norm of these so far.
    pub fn relative_residual(&self, peak: f64) -> f64 {
        let residual = (self.residual[0] + self.residual[1]).sqrt();
        let scale = self
            .forces
            .sqrt()
            .max(NEGLIGIBLE * self.unassembled.sqrt())
            .max(NEGLIGIBLE * peak);
        if residual == 0.0 { 0.0 } else { residual / scale }
    }
}

/// One row of the convergence table.
#[derive(Clone, Debug, PartialEq)]
pub struct IterationRecord {
    /// 1 is the state after the opening linear solve.
    pub iteration: usize,
    pub force_residual: f64,
    /// `|r . delta|` [J]; NaN before there is a correction.
    pub energy_residual: f64,
    /// Norms of the residual of translations [N] and of rotations [N m].
    pub fields: [f64; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vanished_load_does_not_divide_by_zero() {
        let norms = Norms {
            residual: [9.0, 16.0],
            forces: 0.0,
            unassembled: 0.0,
        };
        assert!((norms.relative_residual(5.0) / 1.0e6 - 1.0).abs() < 1e-15);
        assert_eq!(Norms::default().relative_residual(0.0), 0.0);
        let turning = Norms {
            residual: [1.0e-16, 0.0],
            forces: 0.0,
            unassembled: 1.0,
        };
        assert!((turning.relative_residual(0.0) - 1.0e-2).abs() < 1e-15);
    }
}
