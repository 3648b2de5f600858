//! The return map between invariants: trace and equivalent of the logarithmic strain to pressure and shear.
//!
//! With `e = sqrt(2/3 dev eps* : dev eps*)` the trial stress has `q* = 3 mu e` and `p* = K tr eps*`.
//!
//! **Cone.** `q = q* - 3 mu dg` and `p = p* - K beta dg`, hence `dg = f*/(3 mu + K alpha beta + H)`: the answer where `q`
//! stays positive, `dg <= e`.
//!
//! **Apex.** Beyond, `q = 0` and `p = (k + H chi)/alpha`. The flow of the step has the deviator of the trial strain and a
//! trace `D = (p* - p)/K`. As in the micropolar law, `chi = chi~ + D/beta`; and with `beta = 0`, where `D/beta` has no
//! meaning, the multiplier is the norm of all flow, `sqrt(e^2 + 2/9 D^2)`. Both equal the cone's where the returns meet,
//! at `dg = e`, and so does the stress.

use super::super::drucker_prager::Branch;
use super::super::spec::{ElasticModuli, PlasticParameters};
use crate::material::NoSolution;

/// The parameters of the law.
#[derive(Clone, Debug)]
pub struct ReturnMap {
    /// K [Pa].
    pub bulk: f64,
    /// mu [Pa].
    pub shear: f64,
    pub plastic: PlasticParameters,
}

/// Where a return ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Returned {
    /// p [Pa].
    pub pressure: f64,
    /// `q/q*`.
    pub shear_ratio: f64,
    pub chi: f64,
    pub branch: Branch,
}

/// How the stress follows the strain in axes that turn with the material, with `N = 3 s*/(2 q*)`:
///
/// ```text
/// deviator (L - 1/3 I x I) + pressure_by_volume I x I + pressure_by_shear I x N + shear_by_volume N x I
///     + shear_by_shear N x N
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    pub deviator: f64,
    pub pressure_by_volume: f64,
    pub pressure_by_shear: f64,
    pub shear_by_volume: f64,
    pub shear_by_shear: f64,
}

impl Rates {
    pub fn elastic(bulk: f64, shear: f64) -> Self {
        Self {
            deviator: 2.0 * shear,
            pressure_by_volume: bulk,
            ..Self::default()
        }
    }
}

fn refuse<T>(what: &'static str, residual: f64) -> Result<T, NoSolution> {
    Err(NoSolution { what, residual })
}

impl ReturnMap {
    pub fn new(elastic: &ElasticModuli, plastic: &PlasticParameters) -> Self {
        Self {
            bulk: elastic.lambda + 2.0 / 3.0 * elastic.mu,
            shear: elastic.mu,
            plastic: *plastic,
        }
    }

    /// `k + H chi`.
    fn strength(&self, chi: f64) -> f64 {
        self.plastic.yield_strength + self.plastic.hardening_modulus * chi
    }

    /// `3 mu + K alpha beta + H`: fall of `f` with the multiplier on the cone.
    fn cone_slope(&self) -> f64 {
        let PlasticParameters {
            friction_slope,
            dilatancy_slope,
            hardening_modulus,
            ..
        } = self.plastic;
        3.0 * self.shear + self.bulk * friction_slope * dilatancy_slope + hardening_modulus
    }

    /// Stress below which `f` counts as zero: relative to the strength, never below the rounding of the stresses.
    fn yield_tolerance(&self, chi: f64, shear: f64) -> f64 {
        let scale = self.strength(chi).abs().max(shear.abs());
        let stiffness = 3.0 * self.bulk + 2.0 * self.shear;
        (self.plastic.tolerance * scale).max(16.0 * f64::EPSILON * stiffness)
    }

    /// Stress invariants at the end of a step with this trial strain and this `chi` at its start.
    ///
    /// # Errors
    /// None of rounding: a material that softens faster than its stress can fall, or whose strength is used up.
    pub fn respond(&self, volumetric: f64, equivalent: f64, chi: f64) -> Result<Returned, NoSolution> {
        let (pressure, shear) = (self.bulk * volumetric, 3.0 * self.shear * equivalent);
        let friction = self.plastic.friction_slope;
        let overstress = shear + friction * pressure - self.strength(chi);
        if overstress <= self.yield_tolerance(chi, shear) {
            return Ok(Returned {
                pressure,
                shear_ratio: 1.0,
                chi,
                branch: Branch::Elastic,
            });
        }
        let past = overstress / (3.0 * self.shear);
        let slope = self.cone_slope();
        if slope <= 0.0 {
            return refuse("the material softens faster than its stress can fall", past);
        }
        let multiplier = overstress / slope;
        if multiplier <= equivalent {
            return Ok(Returned {
                pressure: pressure - self.bulk * self.plastic.dilatancy_slope * multiplier,
                shear_ratio: 1.0 - multiplier / equivalent,
                chi: chi + multiplier,
                branch: Branch::Cone,
            });
        }
        if friction == 0.0 {
            return refuse("the strength is used up", past);
        }
        let volume_flow = self.volume_flow(pressure, equivalent, chi)?;
        let multiplier = self.apex_multiplier(volume_flow, equivalent);
        Ok(Returned {
            pressure: self.strength(chi + multiplier) / friction,
            shear_ratio: 0.0,
            chi: chi + multiplier,
            branch: Branch::Apex,
        })
    }

    /// Whether a trial that responds elastically lies on the cone.
    pub fn is_on_cone(&self, volumetric: f64, equivalent: f64, chi: f64) -> bool {
        let (pressure, shear) = (self.bulk * volumetric, 3.0 * self.shear * equivalent);
        let overstress = shear + self.plastic.friction_slope * pressure - self.strength(chi);
        equivalent > 0.0 && self.cone_slope() > 0.0 && overstress >= -self.yield_tolerance(chi, shear)
    }

    /// Multiplier of a flow to the apex.
    fn apex_multiplier(&self, volume_flow: f64, equivalent: f64) -> f64 {
        let beta = self.plastic.dilatancy_slope;
        if beta == 0.0 {
            (equivalent.powi(2) + 2.0 / 9.0 * volume_flow.powi(2)).sqrt()
        } else {
            volume_flow / beta
        }
    }

    /// `D` of the return to the apex.
    fn volume_flow(&self, pressure: f64, equivalent: f64, chi: f64) -> Result<f64, NoSolution> {
        let PlasticParameters {
            friction_slope: alpha,
            dilatancy_slope: beta,
            hardening_modulus: hardening,
            ..
        } = self.plastic;
        // alpha (p* - K D) = k + H chi~ + H dg
        let excess = alpha * pressure - self.strength(chi);
        let stiffness = alpha * self.bulk;
        let flow = if beta == 0.0 {
            isochoric_root(excess, stiffness, hardening, equivalent)
        } else {
            // Not below the flow at the end of the cone, where rounding may put it.
            let slope = stiffness * beta + hardening;
            (slope > 0.0).then(|| beta * (excess / slope).max(equivalent))
        };
        match flow {
            Some(flow) => Ok(flow),
            None => refuse(
                "the apex softens faster than its stress can fall",
                excess / (3.0 * self.shear),
            ),
        }
    }

    /// Derivatives of the return of a trial strain that ended on a branch and took `chi` from `old` to `new`.
    pub fn rates(&self, branch: Branch, volumetric: f64, equivalent: f64, [old, new]: [f64; 2]) -> Rates {
        match branch {
            Branch::Elastic => Rates::elastic(self.bulk, self.shear),
            Branch::Cone => self.cone_rates((new - old) / equivalent),
            Branch::Apex => {
                let stiffness = self.bulk * self.plastic.friction_slope;
                let volume_flow = volumetric - self.strength(new) / stiffness;
                self.apex_rates(volume_flow, equivalent, new - old)
            }
        }
    }

    /// `d dg = (2 mu N : d eps + K alpha tr d eps)/slope`; the deviator shrinks by `flown = 3 mu dg/q*`.
    fn cone_rates(&self, flown: f64) -> Rates {
        let (bulk, twice_shear) = (self.bulk, 2.0 * self.shear);
        let (alpha, beta) = (self.plastic.friction_slope, self.plastic.dilatancy_slope);
        let by_shear = twice_shear / self.cone_slope();
        let by_volume = bulk * alpha / self.cone_slope();
        Rates {
            deviator: twice_shear * (1.0 - flown),
            pressure_by_volume: bulk - bulk * beta * by_volume,
            pressure_by_shear: -bulk * beta * by_shear,
            shear_by_volume: -twice_shear * by_volume,
            shear_by_shear: twice_shear * (2.0 / 3.0 * flown - by_shear),
        }
    }

    /// `d p = H d chi/alpha`, from the derivative of the condition of the apex.
    fn apex_rates(&self, volume_flow: f64, equivalent: f64, multiplier: f64) -> Rates {
        let (bulk, hardening) = (self.bulk, self.plastic.hardening_modulus);
        let (alpha, beta) = (self.plastic.friction_slope, self.plastic.dilatancy_slope);
        let stiffness = alpha * bulk;
        if beta != 0.0 {
            return Rates {
                pressure_by_volume: bulk * hardening / (stiffness * beta + hardening),
                ..Rates::default()
            };
        }
        if multiplier == 0.0 {
            return Rates::default();
        }
        // The multiplier changes by (2/9 D dD + e de)/dg, with e de = 2/3 e N : d eps.
        let by_volume = 2.0 / 9.0 * hardening * volume_flow / multiplier;
        let slope = stiffness + by_volume;
        Rates {
            pressure_by_volume: bulk * by_volume / slope,
            pressure_by_shear: bulk * hardening * 2.0 / 3.0 * equivalent / multiplier / slope,
            ..Rates::default()
        }
    }
}

/// The smallest flow `D >= 0` with `excess - stiffness D = hardening sqrt(e^2 + 2/9 D^2)`; `None` where there is none.
///
/// The left side exceeds the right one where the cone ends, at `D = 0`, by `past`. Squared, it is a quadratic equation
///
/// ```text
/// a D^2 - 2 b D + c = 0        a = stiffness^2 - 2/9 hardening^2     b = excess stiffness
///                              c = (excess - hardening e) (excess + hardening e)
/// b^2 - a c = hardening^2 (2/9 excess^2 + a e^2)
/// ```
///
/// and the sign of both sides picks the root. The last line is the discriminant without the difference of two large
/// numbers: zero without hardening, and negative only where the material softens so fast that `a` is. Signs are such that
/// no sum below cancels.
fn isochoric_root(excess: f64, stiffness: f64, hardening: f64, equivalent: f64) -> Option<f64> {
    let past = excess - hardening * equivalent;
    if past <= 0.0 {
        // On the cone but for rounding.
        return Some(0.0);
    }
    let share = (2.0_f64 / 9.0).sqrt() * hardening;
    let a = (stiffness - share) * (stiffness + share);
    let b = excess * stiffness;
    let discriminant = 2.0 / 9.0 * excess * excess + a * equivalent * equivalent;
    let root = hardening.abs() * discriminant.sqrt();
    let other = excess + hardening * equivalent;
    let flow = if hardening >= 0.0 {
        past * (other / (b + root))
    } else if excess < 0.0 {
        past * (other / (b - root))
    } else if a > 0.0 {
        (b + root) / a
    } else {
        return None;
    };
    flow.is_finite().then_some(flow)
}
