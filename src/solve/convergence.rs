//! When a step has converged, and the table of how it came there.
//!
//! The measure is `|r_free| / |f_ext + f_reaction|` over translations and rotations together (T 2.53), ghost forces
//! included; where a scene sets it, `|r . delta| < e_tol` with the last correction (T 2.54) serves too.
//!
//! The residual of a nonlocal damage field is a volume times a number and has a measure of its own: relative to what its
//! cells add up to before it cancels, or to a field of 1e-6 over all points where there is less than that. Both must
//! be below the tolerance.

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
    pub damage: DamageNorms,
}

/// Squares of norms of the equation of the nonlocal damage field [m6].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DamageNorms {
    /// Residual on free unknowns.
    pub residual: f64,
    /// Contributions of single batches before they are summed.
    pub unassembled: f64,
    /// Reference volumes of the points.
    pub volume: f64,
}

impl DamageNorms {
    /// Residual relative to its own largest terms.
    pub fn relative_residual(&self) -> f64 {
        let scale = self.unassembled.sqrt().max(NEGLIGIBLE * self.volume.sqrt());
        if self.residual == 0.0 {
            0.0
        } else {
            self.residual.sqrt() / scale
        }
    }
}

impl Norms {
    pub fn from_sums(sums: &[f64]) -> Self {
        Self {
            residual: [sums[0], sums[1]],
            forces: sums[2],
            unassembled: sums[3],
            damage: DamageNorms::default(),
        }
    }

    /// Forces that count: external forces and reactions, but not less than what makes others negligible. `peak` is the
    /// largest norm of external forces and reactions so far.
    pub fn scale(&self, peak: f64) -> f64 {
        self.forces
            .sqrt()
            .max(NEGLIGIBLE * self.unassembled.sqrt())
            .max(NEGLIGIBLE * peak)
    }

    /// Force residual relative to external forces and reactions. `peak` is the largest norm of these so far.
    pub fn relative_residual(&self, peak: f64) -> f64 {
        let residual = (self.residual[0] + self.residual[1]).sqrt();
        if residual == 0.0 {
            0.0
        } else {
            residual / self.scale(peak)
        }
    }
}

/// What one iteration of an attempt left: the first row of an attempt is the state after the opening linear solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IterationRecord {
    /// Of forces and couples, or of the nonlocal damage field where that is larger [-].
    pub force_residual: f64,
    /// `|r . delta|` [J]; NaN before there is a correction.
    pub energy_residual: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vanished_load_does_not_divide_by_zero() {
        let norms = Norms {
            residual: [9.0, 16.0],
            ..Norms::default()
        };
        assert!((norms.relative_residual(5.0) / 1.0e6 - 1.0).abs() < 1e-15);
        assert_eq!(Norms::default().relative_residual(0.0), 0.0);
        let turning = Norms {
            residual: [1.0e-16, 0.0],
            unassembled: 1.0,
            ..Norms::default()
        };
        assert!((turning.relative_residual(0.0) - 1.0e-2).abs() < 1e-15);
    }

    #[test]
    fn a_field_that_vanishes_is_measured_by_the_volume() {
        let vanishing = DamageNorms {
            residual: 1.0e-32,
            unassembled: 1.0e-40,
            volume: 4.0,
        };
        assert!((vanishing.relative_residual() / 5.0e-11 - 1.0).abs() < 1e-12);
        let present = DamageNorms {
            residual: 1.0e-12,
            unassembled: 1.0e-4,
            volume: 4.0,
        };
        assert!((present.relative_residual() / 1.0e-4 - 1.0).abs() < 1e-12);
        assert_eq!(DamageNorms::default().relative_residual(), 0.0);
    }
}
