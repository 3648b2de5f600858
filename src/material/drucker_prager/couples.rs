//! Elastic wryness and couple-stress where the amount of flow is given: a linear system.
//!
//! With `x = dg/q`, `y = 1/(1 + 3 mu x)` between 0 (the apex) and 1 (no flow), `c = (1 - y)/(2 mu lp^2)` and
//! `S(Gammae) = y M`, the flow rule `Gammae = Gammae* - 3 x/(2 lp^2) nu U` reads
//!
//! ```text
//! y M + c S(M U^T U) = S(Gammae*)      Gammae = Gammae* - c M U^T U
//! ```
//!
//! Only the parts of `Gammae*` with couples flow. Where `S` is singular (bounded stiffness: no couples of a spherical or
//! skew wryness), the others need no flow for any `y`, nor at the apex: to count the flow to `Gammae = 0` there would
//! refuse strains that no point of the cone answers either.

use super::{DruckerPrager, NoSolution, Trial};
use crate::material::active::ActiveSet;
use crate::material::dense::System;
use crate::material::elastic::IsotropicMap;
use nalgebra::Matrix3;

/// The couples at a `y`.
#[derive(Clone, Copy)]
pub(super) struct Couples {
    /// `Gammae`.
    pub(super) wryness: Matrix3<f64>,
    /// `(M U^T U : M)/lp^2`, the square of a stress.
    pub(super) square: f64,
    /// Its derivative by `y`.
    pub(super) square_rate: f64,
    /// `c M`, where `c M U^T = D_G` is the flow of the wryness.
    pub(super) flow_factor: Matrix3<f64>,
}

impl DruckerPrager {
    /// The couples at `y`.
    pub(super) fn couples_at<A: ActiveSet, const N: usize>(
        &self,
        trial: &Trial,
        y: f64,
    ) -> Result<Couples, NoSolution> {
        let length_squared = self.plastic.plastic_length.powi(2);
        let factor = (1.0 - y) / (2.0 * self.elastic.mu * length_squared);
        let map = &self.maps.couple;
        let metric = &trial.total_stretch_squared;
        let unstressed = self.parts_without_couples();
        let load = map.apply(&trial.wryness);
        let mut system = System::<N>::zero();
        for (row, &pair) in A::WRYNESS.iter().enumerate() {
            for (column, &by) in A::WRYNESS.iter().enumerate() {
                let flow: f64 = (0..3)
                    .map(|l| map.coefficient(pair, (by.0, l)) * metric[(by.1, l)])
                    .sum();
                // M = S(G) has no part in the kernel of S: pinning that part there changes nothing.
                system.rows[row][column] = factor * flow + unstressed.coefficient(pair, by);
            }
            system.rows[row][row] += y;
        }
        let factors = system.factorise().ok_or(NoSolution {
            what: "the local problem of the couples is singular",
            residual: f64::INFINITY,
        })?;
        let solve = |right: &Matrix3<f64>| {
            let solution = factors.solve_one(&std::array::from_fn(|row| right[A::WRYNESS[row]]));
            let mut couple = Matrix3::zeros();
            for (value, &pair) in solution.iter().zip(A::WRYNESS) {
                couple[pair] = *value;
            }
            couple
        };
        let couple = solve(&load);
        let flow = couple * metric;
        let factor_rate = -1.0 / (2.0 * self.elastic.mu * length_squared);
        let rate = -solve(&(couple + map.apply(&flow) * factor_rate));
        Ok(Couples {
            wryness: trial.wryness - flow * factor,
            square: flow.dot(&couple) / length_squared,
            square_rate: 2.0 * flow.dot(&rate) / length_squared,
            flow_factor: couple * factor,
        })
    }

    /// Projection on the parts of a wryness (spherical, symmetric deviatoric, skew) that make no couple-stress.
    fn parts_without_couples(&self) -> IsotropicMap {
        let [spherical, deviatoric, skew] = self.couple_moduli().map(|modulus| f64::from(u8::from(modulus == 0.0)));
        IsotropicMap::new((spherical - deviatoric) / 3.0, 0.5 * deviatoric, 0.5 * skew)
    }

    /// Moduli of the spherical, symmetric deviatoric and skew parts of a wryness; zero for what rounding leaves of it.
    pub(super) fn couple_moduli(&self) -> [f64; 3] {
        let elastic = &self.elastic;
        let moduli = [
            3.0 * elastic.alpha + 2.0 * elastic.gamma,
            2.0 * elastic.gamma,
            2.0 * elastic.beta,
        ];
        let floor = 1e-12
            * (3.0 * elastic.alpha.abs())
                .max(2.0 * elastic.gamma)
                .max(2.0 * elastic.beta);
        moduli.map(|modulus| if modulus > floor { modulus } else { 0.0 })
    }
}
